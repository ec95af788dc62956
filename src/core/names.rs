//! Names that scripts, files and statistics use for what there are a few of.

use std::fmt::{Display, LowerExp};

/// Gives an enum its names, the list of all, and the way back: `names!(Type { Variant => "name" })`; a name may have
/// another that is read, too (`"name" | "other"`), and with its length after the type the list is an array.
macro_rules! names {
    ($(#[$doc:meta])* $type:ident { $($variant:ident => $name:literal $(| $other:literal)?),* $(,)? }) => {
        $crate::core::names!(
            $(#[$doc])* $type: &[Self] = &[$(Self::$variant),*];
            $($variant => $name $(| $other)?),*
        );
    };
    ($(#[$doc:meta])* $type:ident[$count:literal] {
        $($variant:ident => $name:literal $(| $other:literal)?),* $(,)?
    }) => {
        $crate::core::names!(
            $(#[$doc])* $type: [Self; $count] = [$(Self::$variant),*];
            $($variant => $name $(| $other)?),*
        );
    };
    ($(#[$doc:meta])* $type:ident: $list:ty = $all:expr; $($variant:ident => $name:literal $(| $other:literal)?),*) => {
        impl $type {
            /// Every one.
            $(#[$doc])*
            pub const ALL: $list = $all;

            /// The name in scripts, statistics and sentences.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// The one of this name.
            pub fn from_name(name: &str) -> Option<Self> {
                match name {
                    $($name $(| $other)? => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }
    };
}

pub(crate) use names;

/// So many of what is called `one`: "1 triangle", "2 triangles".
pub fn counted(count: usize, one: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
}

/// A number in full, or by its power of ten where that would be a row of zeros.
pub fn plain_number<T: Into<f64> + Display + LowerExp + Copy>(value: T) -> String {
    let wide: f64 = value.into();
    let is_plain = wide == 0.0 || (1e-6..1e16).contains(&wide.abs());
    if is_plain { value.to_string() } else { format!("{value:e}") }
}

/// [`plain_number`] of each, with commas between.
pub fn plain_numbers<T: Into<f64> + Display + LowerExp + Copy>(
    values: impl IntoIterator<Item = T>,
) -> String {
    values.into_iter().map(plain_number).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::{counted, plain_number, plain_numbers};

    #[test]
    fn numbers_are_written_without_rows_of_zeros() {
        let words = [0.0, -2.5, 1e-5, 1e300, -1e-9].map(plain_number);
        assert_eq!(words, ["0", "-2.5", "0.00001", "1e300", "-1e-9"]);
        assert_eq!(plain_numbers([1.0, 1e308, -1e-320]), "1, 1e308, -1e-320");
        assert_eq!(plain_numbers([0.1_f32, 3e38]), "0.1, 3e38");
    }

    #[test]
    fn one_of_a_kind_is_no_plural() {
        let words = [0, 1, 2].map(|count| counted(count, "triangle"));
        assert_eq!(words, ["0 triangles", "1 triangle", "2 triangles"]);
    }
}
