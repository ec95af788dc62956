//! Numbers of functions as whole ones of two or three bytes, number by number: all x of centres, then all y, and so on, of
//! each number all first bytes, then all second ones.
//!
//! Of a function these are the centre less the box's least corner; the logarithms to base 2 of the shape's diagonal (one where
//! it is as wide in every direction); the rest of the upper triangle by the diagonal below it; and the weight.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::{Precision, numbers_of};
use crate::rbf::{Basis, Encoding, Function};

/// Powers of two that steps may be: those that double precision holds, and some room.
const EXPONENTS: std::ops::RangeInclusive<i32> = -1020..=1000;
/// Whole numbers that double precision holds, and the step beyond them as well.
const MOST: i64 = 1 << 50;
/// The least step of logarithms: finer ones would be those of rounding.
const LEAST_OF_LOGARITHMS: i32 = -40;
/// What a byte of deflated ones may be at most: 1032, and some for the beginning.
const MOST_INFLATED: u64 = 1100;

/// How a number of each function is held: its steps are 2 to the power of the first, whole ones are counted from the second,
/// and have so many bytes as the third.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Column(pub(super) i32, pub(super) i64, pub(super) u8);

impl Column {
    /// The longest that a header can have.
    pub(super) const LONGEST: Self = Self(-1020, -MOST, 3);

    /// The least steps by which so many bytes hold the values, which are finite. They are powers of two: values that are on
    /// such steps already stay as they are. None is below the power `from`.
    fn of(values: &[f64], bytes: u8, from: i32) -> Self {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let largest = low.abs().max(high.abs());
        if values.is_empty() || largest == 0.0 {
            return Self(0, 0, bytes);
        }
        let bits = 8 * i32::from(bytes);
        // Two more than the least that can do. Where all are the same, it is told in the header alone, by as many digits: all that
        // double precision has would take more letters there than a function takes bytes.
        let by_range = exponent(if high > low { high - low } else { largest }) - bits - 2;
        let least = by_range.max(exponent(largest) - 52).max(from);
        let ends = |exponent: i32| [low, high].map(|end| (end / step(exponent)).round());
        let fits = |exponent: &i32| {
            let [first, last] = ends(*exponent);
            last - first < f64::from(bits).exp2() && first.abs().max(last.abs()) <= MOST as f64
        };
        let exponent = (least..=*EXPONENTS.end()).find(fits).unwrap_or(*EXPONENTS.end());
        Self(exponent, ends(exponent)[0] as i64, bytes)
    }

    fn index(self, value: f64) -> u32 {
        let Self(exponent, first, _) = self;
        let whole = (value / step(exponent)).round() as i64;
        u32::try_from(whole - first).unwrap_or(u32::MAX)
    }

    fn value(self, index: u32) -> f64 {
        let Self(exponent, first, _) = self;
        (first + i64::from(index)) as f64 * step(exponent)
    }

    fn is_sound(self) -> bool {
        let Self(exponent, first, bytes) = self;
        EXPONENTS.contains(&exponent) && (-MOST..=MOST).contains(&first) && (1..=4).contains(&bytes)
    }
}

/// 2 to a whole power within [`EXPONENTS`], without rounding.
fn step(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// The power of two at or below a positive number.
fn exponent(value: f64) -> i32 {
    (((value.to_bits() >> 52) & 0x7ff) as i32) - 1023
}

/// Functions as whole numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Packed {
    pub(super) columns: Vec<Column>,
    /// A list for each column.
    indices: Vec<Vec<u32>>,
}

impl Packed {
    /// `None` where that precision has floats, or a function no width.
    pub(super) fn of(encoding: &Encoding, precision: Precision) -> Option<Self> {
        let (basis, low) = (encoding.basis(), encoding.bounds()[0]);
        let count = numbers_of(basis);
        let functions = encoding.functions();
        let mut columns = Vec::with_capacity(count);
        let mut indices = Vec::with_capacity(count);
        let all: Vec<[f64; 10]> = functions.iter().map(|f| numbers(f, basis, low)).collect();
        for number in 0..count {
            let bytes = precision.bytes_of(number + 1 == count)?;
            let values: Vec<f64> = all.iter().map(|numbers| numbers[number]).collect();
            if !values.iter().all(|value| value.is_finite()) {
                return None;
            }
            let from = match are_logarithms(number, basis) {
                true => LEAST_OF_LOGARITHMS,
                false => *EXPONENTS.start(),
            };
            let column = Column::of(&values, bytes, from);
            let found: Vec<u32> = values.iter().map(|value| column.index(*value)).collect();
            // Of numbers 300 decades apart no step is a power of two that fits.
            if found.iter().any(|index| u64::from(*index) >> (8 * bytes) != 0) {
                return None;
            }
            indices.push(found);
            columns.push(column);
        }
        Some(Self { columns, indices })
    }

    /// What they are.
    pub(super) fn functions(&self, basis: Basis, low: DVec3) -> Vec<Function> {
        let count = self.indices.first().map_or(0, Vec::len);
        let one = |i: usize| {
            let mut numbers = [0.0; 10];
            for ((number, column), indices) in
                numbers.iter_mut().zip(&self.columns).zip(&self.indices)
            {
                *number = column.value(indices[i]);
            }
            function(&numbers, basis, low)
        };
        (0..count).map(one).collect()
    }

    /// As a file holds them, and whether they are deflated: they are where that is shorter.
    pub(super) fn body(&self) -> (Vec<u8>, bool) {
        let mut plain = Vec::new();
        for (Column(_, _, bytes), indices) in self.columns.iter().zip(&self.indices) {
            for byte in 0..usize::from(*bytes) {
                plain.extend(indices.iter().map(|index| index.to_le_bytes()[byte]));
            }
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
        let deflated = encoder.write_all(&plain).and_then(|()| encoder.finish());
        match deflated {
            Ok(deflated) if deflated.len() < plain.len() => (deflated, true),
            _ => (plain, false),
        }
    }

    /// So many of them from a file's body; `None` where these are not as many.
    pub(super) fn from_body(
        columns: Vec<Column>,
        count: usize,
        (body, is_deflated): (&[u8], bool),
    ) -> Option<Self> {
        let each: u64 = columns.iter().map(|column| u64::from(column.2)).sum();
        let expected = each.checked_mul(count as u64)?;
        // A body that cannot be so long is not begun with.
        if is_deflated && expected > (body.len() as u64).checked_mul(MOST_INFLATED)? {
            return None;
        }
        let mut inflated = Vec::new();
        let plain = if is_deflated {
            let decoder = ZlibDecoder::new(body);
            decoder.take(expected.checked_add(1)?).read_to_end(&mut inflated).ok()?;
            &inflated[..]
        } else {
            body
        };
        if plain.len() as u64 != expected {
            return None;
        }
        let mut rest = plain;
        let mut indices = Vec::with_capacity(columns.len());
        for Column(_, _, bytes) in &columns {
            let mut list = vec![0_u32; count];
            for byte in 0..u32::from(*bytes) {
                let (plane, others) = rest.split_at_checked(count)?;
                for (index, own) in list.iter_mut().zip(plane) {
                    *index |= u32::from(*own) << (8 * byte);
                }
                rest = others;
            }
            indices.push(list);
        }
        Some(Self { columns, indices })
    }

    /// Whether columns mean numbers of such functions.
    pub(super) fn are_sound(columns: &[Column], basis: Basis) -> bool {
        columns.len() == numbers_of(basis) && columns.iter().all(|column| column.is_sound())
    }
}

fn are_logarithms(number: usize, basis: Basis) -> bool {
    match basis {
        Basis::Ellipsoid => (3..6).contains(&number),
        Basis::Gaussian | Basis::Multiquadric => number == 3,
    }
}

/// Of a function; those that its basis does not have are 0.
fn numbers(function: &Function, basis: Basis, low: DVec3) -> [f64; 10] {
    let [x, y, z] = (function.centre - low).to_array();
    let shape = &function.shape;
    let [a, b, c] = [shape.x_axis.x, shape.y_axis.y, shape.z_axis.z];
    let weight = function.weight;
    match basis {
        Basis::Ellipsoid => {
            let [ab, ac, bc] = [shape.y_axis.x / b, shape.z_axis.x / c, shape.z_axis.y / c];
            [x, y, z, a.log2(), b.log2(), c.log2(), ab, ac, bc, weight]
        }
        Basis::Gaussian | Basis::Multiquadric => {
            [x, y, z, a.log2(), weight, 0.0, 0.0, 0.0, 0.0, 0.0]
        }
    }
}

fn function(numbers: &[f64; 10], basis: Basis, low: DVec3) -> Function {
    let [x, y, z, a, b, c, ab, ac, bc, last] = *numbers;
    let centre = DVec3::new(x, y, z) + low;
    match basis {
        Basis::Ellipsoid => {
            let [a, b, c] = [a, b, c].map(f64::exp2);
            let columns = [a, 0.0, 0.0, ab * b, b, 0.0, ac * c, bc * c, c];
            Function { centre, shape: DMat3::from_cols_array(&columns), weight: last }
        }
        Basis::Gaussian | Basis::Multiquadric => {
            Function { centre, shape: DMat3::from_diagonal(DVec3::splat(a.exp2())), weight: b }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_are_the_same_take_few_letters_of_the_header() {
        for value in [5.3, -1e7 / 3.0, 1e-300, 0.1] {
            for bytes in [2, 3] {
                let column = Column::of(&[value; 3], bytes, *EXPONENTS.start());
                assert!(column.1.abs() < 1 << (8 * bytes + 4), "{value}: {column:?}");
                let off = (column.value(column.index(value)) / value - 1.0).abs();
                assert!(off < (-8.0 * f64::from(bytes)).exp2(), "{value}: {column:?} {off}");
            }
        }
    }

    #[test]
    fn values_are_off_by_half_a_step_at_most_and_stay_where_they_are_once_rounded() {
        let lists: [&[f64]; 9] = [
            &[0.0, 0.0],
            &[0.0, 1.0],
            &[5.3; 3],
            &[1e-300, 2e-300],
            &[-1e150, 1e150, 3.7],
            &[1.0, 1.0 + 1e-15],
            &[-0.1, 0.2, 1e7 / 3.0],
            &[65535.0, 0.0, 65536.0, 1.0],
            &[-7.000_01, -7.0],
        ];
        for values in lists {
            for bytes in [2, 3] {
                let column = Column::of(values, bytes, *EXPONENTS.start());
                assert!(column.is_sound(), "{values:?} {column:?}");
                let most = 1_u32 << (8 * u32::from(bytes));
                let once: Vec<f64> = values
                    .iter()
                    .map(|value| {
                        let index = column.index(*value);
                        assert!(index < most, "{values:?} {column:?} {index}");
                        column.value(index)
                    })
                    .collect();
                for (value, rounded) in values.iter().zip(&once) {
                    assert!(
                        (value - rounded).abs() <= 0.5 * step(column.0),
                        "{values:?} {column:?}"
                    );
                }
                let again = Column::of(&once, bytes, *EXPONENTS.start());
                assert!(again.0 <= column.0, "{values:?} {column:?} {again:?}");
                for value in &once {
                    assert_eq!(again.value(again.index(*value)), *value, "{values:?} {again:?}");
                }
            }
        }
    }
}
