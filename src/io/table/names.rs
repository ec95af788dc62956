//! Which columns a table has, by its first line.

use super::super::error::{Problem, header, quoted};
use super::row::{Entry, Separator};

/// Names of the columns of a place.
const PLACES: [[&str; 3]; 4] = [
    ["x", "y", "z"],
    ["points:0", "points:1", "points:2"],
    ["points_0", "points_1", "points_2"],
    ["px", "py", "pz"],
];

/// Whether the first line names columns rather than being a row.
///
/// # Errors
/// A line of numbers with a word where the next one has none: taken for names it would be lost.
pub(super) fn names_columns(first: &str, second: Option<&str>) -> Result<bool, Problem> {
    let separator = Separator::of(first);
    let words = separator.words(first);
    let entries = separator.entries(first);
    let Some(word) = entries.iter().position(|entry| *entry == Entry::Word) else {
        return Ok(false);
    };
    // Names may be numbers between quotes.
    let is_number = |(word, entry): (&&str, &Entry)| {
        matches!(entry, Entry::Number(_)) && !word.starts_with('"')
    };
    let numbers = words.iter().zip(&entries).filter(|of| is_number(*of)).count();
    let is_alike = |row: &str| {
        let row = separator.entries(row);
        let pairs = entries.iter().zip(&row);
        row.len() == entries.len()
            && pairs.filter(|(one, _)| **one == Entry::Word).all(|(_, other)| {
                // What is missing in a column of words is one as well.
                matches!(other, Entry::Word | Entry::Missing)
            })
    };
    if numbers >= 3 && second.is_none_or(is_alike) {
        return Ok(false);
    }
    if 2 * numbers > words.len() {
        return Err(header(
            "names of columns or a row of numbers on the first line",
            format!("both, the word {} among {numbers} numbers", quoted(words[word])),
            "correct the line, or write the table again",
        ));
    }
    Ok(true)
}

/// Names of columns, as a line has them; `None` where it has another number of words.
pub(super) fn words_of_header(
    line: &str,
    separator: Separator,
    count: usize,
) -> Option<Vec<String>> {
    let words = |separator: Separator| -> Vec<String> {
        separator.words(line).into_iter().map(|word| word.trim_matches('"').to_owned()).collect()
    };
    let own = words(separator);
    // A header may be separated otherwise.
    let own = if own.len() == count { own } else { words(Separator::of(line)) };
    (own.len() == count).then_some(own)
}

/// What a column of a place is called in short: `x` of `X_coord`, `Coord.x` and `x [mm]`.
fn axis_name(name: &str) -> String {
    let lower = name.to_lowercase();
    let bare = lower.split(['(', '[']).next().unwrap_or_default();
    let bare = bare.replace("coordinates", "").replace("coordinate", "").replace("coord", "");
    bare.trim_matches(|c: char| c.is_whitespace() || "_.-".contains(c)).to_owned()
}

/// The columns that hold x, y and z, where their names say so.
pub(super) fn columns_of_place(names: &[String]) -> Option<[usize; 3]> {
    PLACES.iter().find_map(|place| {
        let at = place.map(|of| {
            let own = names.iter().position(|name| name.eq_ignore_ascii_case(of));
            own.or_else(|| names.iter().position(|name| axis_name(name) == of))
        });
        let [Some(x), Some(y), Some(z)] = at else { return None };
        Some([x, y, z])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_row_with_a_word_is_no_header() {
        let check = |line: &str| names_columns(line, Some("1,2,3,4"));
        assert!(check("1,2,b,4").is_err() && names_columns("1 2 3 x", Some("1 2 3 4")).is_err());
        for names in
            ["x,y,z,T", "x,y,z,1,2", "\"Points:0\",\"Points:1\",b,4", "a", "\"1\",\"2\",\"3\",T"]
        {
            assert!(check(names).unwrap(), "{names}");
        }
        // A column of words.
        assert!(!names_columns("st1,DE,1,2,3", Some("st2,,4,5,6")).unwrap());
        assert!(!names_columns("1,2,3,a", None).unwrap());
    }

    #[test]
    fn columns_are_found_by_name() {
        let names = |line: &str| words_of_header(line, Separator::of(line), 4).unwrap();
        assert_eq!(
            names("\"T\",\"Points:0\",\"Points:1\",\"Points:2\""),
            ["T", "Points:0", "Points:1", "Points:2"]
        );
        assert_eq!(names("\"p (Pa, abs)\",x,y,z")[0], "p (Pa, abs)");
        assert_eq!(words_of_header("a b", Separator::Blanks, 4), None);
        assert_eq!(words_of_header("x y z val", Separator::Comma, 4).unwrap()[3], "val");
        for name in ["X", "x_coord", "Coord.x", "x [mm]", "X coordinate (m)"] {
            assert_eq!(axis_name(name), "x");
        }
        assert_eq!(axis_name("max"), "max");
    }
}
