//! Tables of points: one a line of text, its place in three columns and numbers in the others.

use std::io::BufRead;
use std::path::Path;

use glam::DVec3;

use super::error::{Problem, header, quoted, quoted_bytes, unsupported};
use super::unstructured::{self, Part, field_of, kind};
use super::{Format, Opened, files};
use crate::cells::Listing;
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Samples};

/// Extensions of files that are taken for tables, where they are text.
const EXTENSIONS: [&str; 5] = ["txt", "csv", "tsv", "xyz", "asc"];
/// More columns than this are no list that anybody picks from.
const MOST_COLUMNS: usize = 1024;
/// No line is longer.
const LONGEST_LINE: u64 = 1 << 16;
/// Names of the columns of a place.
const PLACES: [[&str; 3]; 4] = [
    ["x", "y", "z"],
    ["points:0", "points:1", "points:2"],
    ["points_0", "points_1", "points_2"],
    ["px", "py", "pz"],
];

/// Whether some first bytes are a table, of a file with an extension of one.
pub(super) fn is_it(extension: &str, start: &[u8]) -> bool {
    if !EXTENSIONS.contains(&extension) {
        return false;
    }
    let text = String::from_utf8_lossy(start);
    // The last line may be cut.
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.len() > 1 && !text.ends_with('\n') && start.len() >= 4096 {
        lines.pop();
    }
    let mut lines = lines.into_iter().filter(|line| !is_comment(line));
    let Some(first) = lines.next() else { return false };
    let is_row = |line: &str| Separator::of(line).numbers(line).is_some_and(|row| row.len() >= 3);
    is_row(first) || lines.next().is_some_and(is_row)
}

fn is_comment(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with('#') || line.starts_with("//") || line.starts_with('%')
}

/// What stands between the numbers of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Comma,
    Semicolon,
    /// Each of its own, where two stand side by side.
    Tab,
    /// Blanks and tabs, as many as there are.
    Blanks,
}

impl Separator {
    /// That of a line.
    fn of(line: &str) -> Self {
        match line {
            line if line.contains(';') => Self::Semicolon,
            line if line.contains(',') => Self::Comma,
            line if line.trim().contains("\t\t") => Self::Tab,
            _ => Self::Blanks,
        }
    }

    /// The words of a line; a separator between quotes is none.
    fn words(self, line: &str) -> Vec<&str> {
        let line = line.trim_end_matches(['\r', '\n']);
        match self {
            Self::Comma => line.split(outside_quotes(',')).map(str::trim).collect(),
            Self::Semicolon => line.split(outside_quotes(';')).map(str::trim).collect(),
            // Blanks beside tabs are none of their own columns.
            Self::Tab => line.trim().split(outside_quotes('\t')).map(str::trim).collect(),
            Self::Blanks => line.split_whitespace().collect(),
        }
    }

    /// The numbers of a line; what is empty between two separators is NaN. `None` where a word is no number.
    fn numbers(self, line: &str) -> Option<Vec<f64>> {
        let number = |word: &str| if word.is_empty() { Some(f64::NAN) } else { word.parse().ok() };
        let numbers: Vec<f64> = self.words(line).into_iter().map(number).collect::<Option<_>>()?;
        numbers.iter().any(|number| !number.is_nan()).then_some(numbers)
    }
}

/// Finds separators, from the start of a line on.
fn outside_quotes(separator: char) -> impl FnMut(char) -> bool {
    let mut is_quoted = false;
    move |c| {
        is_quoted ^= c == '"';
        c == separator && !is_quoted
    }
}

/// Lines of a file, and their numbers from 1.
struct Lines<R> {
    reader: R,
    line: usize,
    bytes: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    /// The next line that is no comment, and the last comment before it; `None` at the end.
    fn next(&mut self) -> Result<Option<(String, Option<String>)>, Problem> {
        use std::io::Read;
        let mut comment = None;
        loop {
            self.bytes.clear();
            let mut limited = (&mut self.reader).take(LONGEST_LINE);
            let read = limited.read_until(b'\n', &mut self.bytes).map_err(Problem::Io)?;
            if read == 0 {
                return Ok(None);
            }
            self.line += 1;
            if read as u64 == LONGEST_LINE && self.bytes.last() != Some(&b'\n') {
                return Err(header(
                    format!("lines of at most {LONGEST_LINE} bytes"),
                    format!("a longer one, number {}", self.line),
                    "write one point a line",
                ));
            }
            let text = String::from_utf8_lossy(&self.bytes);
            if !is_comment(&text) {
                return Ok(Some((text.into_owned(), comment)));
            }
            if !text.trim().is_empty() {
                comment = Some(text.trim().trim_start_matches(['#', '/', '%']).trim().to_owned());
            }
        }
    }
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, len) = files::open_file(path)?;
    // A number is a character and a separator at least; points are kept beside.
    memory::require("the numbers of the table", len.saturating_mul(8), free_bytes)?;
    let mut lines = Lines { reader: files::buffered(file), line: 0, bytes: Vec::new() };
    let none = || {
        header(
            "a table of numbers, one point a line",
            "no line of three numbers or more",
            "give x, y and z in the first three columns",
        )
    };
    let (first, comment) = lines.next()?.ok_or_else(none)?;
    // Some programs begin what they write with a mark of its encoding.
    let first = first.trim_start_matches('\u{feff}').to_owned();
    let mut separator = Separator::of(&first);
    let mut names = None;
    let mut row = separator.numbers(&first);
    if row.is_none() {
        refuse_row_with_word(&first, separator)?;
        names = Some(first);
        let (second, _) = lines.next()?.ok_or_else(none)?;
        separator = Separator::of(&second);
        row = separator.numbers(&second);
    }
    let mut row = row.filter(|row| row.len() >= 3).ok_or_else(none)?;
    // One name fewer, where each row ends with a separator that nothing follows.
    let names_fewer = names
        .as_ref()
        .is_some_and(|line: &String| words_of_header(line, separator, row.len() - 1).is_some());
    let ends_empty = names_fewer && row.len() > 3 && row[row.len() - 1].is_nan();
    if ends_empty {
        row.pop();
    }
    let count = row.len();
    if count > MOST_COLUMNS {
        return Err(unsupported(
            format!("at most {MOST_COLUMNS} columns"),
            count.to_string(),
            "leave some of them out",
        ));
    }
    let mut warnings = Vec::new();
    if let Some(line) =
        names.as_ref().filter(|line| words_of_header(line, separator, count).is_none())
    {
        warnings.push(format!(
            "the first line, {}, has another number of words than the rows, {count}: it names no columns",
            quoted(line)
        ));
    }
    let names = names.or(comment).and_then(|line| words_of_header(&line, separator, count));
    let mut columns: Vec<Vec<f64>> = row.into_iter().map(|number| vec![number]).collect();
    let mut done = 0;
    while let Some((line, _)) = lines.next()? {
        done += line.len() as u64;
        if lines.line % 1024 == 0 {
            ticket.checkpoint(done, len)?;
        }
        let mut words = separator.words(&line);
        if ends_empty && words.len() == count + 1 && words[count].is_empty() {
            words.pop();
        }
        if words.len() != count {
            return Err(header(
                format!("{count} numbers on line {}, as on those before it", lines.line),
                words.len().to_string(),
                "correct the line, or write the table again",
            ));
        }
        for (column, word) in columns.iter_mut().zip(words) {
            let number = if word.is_empty() { Ok(f64::NAN) } else { word.parse() };
            column.push(number.map_err(|_not| {
                header(
                    format!("numbers on line {}", lines.line),
                    quoted_bytes(word.as_bytes()),
                    "correct the line, or write the table again",
                )
            })?);
        }
    }
    points(columns, names, warnings, free_bytes)
}

/// Refuses a first line that is a row but for a word: taken for names it would be lost.
fn refuse_row_with_word(line: &str, separator: Separator) -> Result<(), Problem> {
    let words = separator.words(line);
    let is_number = |word: &&&str| word.parse::<f64>().is_ok();
    let numbers = words.iter().filter(is_number).count();
    let word = words.iter().find(|word| !word.is_empty() && !is_number(word));
    match word {
        Some(word) if 2 * numbers > words.len() => Err(header(
            "names of columns or a row of numbers on the first line",
            format!("both, the word {} among {numbers} numbers", quoted(word)),
            "correct the line, or write the table again",
        )),
        _ => Ok(()),
    }
}

/// Names of columns, as a line has them; `None` where it has another number of words.
fn words_of_header(line: &str, separator: Separator, count: usize) -> Option<Vec<String>> {
    let words = |separator: Separator| -> Vec<String> {
        let unquoted = |word: &str| word.trim_matches('"').to_owned();
        separator.words(line).into_iter().map(unquoted).collect()
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

fn points(
    mut columns: Vec<Vec<f64>>,
    names: Option<Vec<String>>,
    mut warnings: Vec<String>,
    free_bytes: u64,
) -> Result<Opened, Problem> {
    let named =
        |at: usize| names.as_ref().map_or_else(|| format!("column {}", at + 1), |n| n[at].clone());
    let place = names.as_ref().and_then(|names| {
        PLACES.iter().find_map(|place| {
            let at = place.map(|of| {
                let own = names.iter().position(|name| name.eq_ignore_ascii_case(of));
                own.or_else(|| names.iter().position(|name| axis_name(name) == of))
            });
            let [Some(x), Some(y), Some(z)] = at else { return None };
            Some([x, y, z])
        })
    });
    let place = place.unwrap_or_else(|| {
        if names.is_some() {
            let used = [0, 1, 2].map(|at| quoted(&named(at))).join(", ");
            warnings.push(format!(
                "no columns are called x, y and z: the first three, {used}, are taken for these; rename the columns \
                 that hold the place"
            ));
        }
        [0, 1, 2]
    });
    let count = columns[0].len();
    let at = |i: usize| DVec3::from_array(place.map(|column| columns[column][i]));
    unstructured::require_memory(count as u64, count as u64, count as u64, free_bytes)?;
    let listing = cloud((0..count).map(at).collect());
    let mut fields = Vec::new();
    for (at, column) in columns.iter_mut().enumerate() {
        if !place.contains(&at) {
            let samples = Samples::Float64(std::mem::take(column));
            fields.push(field_of(named(at), (1, Association::Point), samples));
        }
    }
    let part = Part { listing, fields };
    let grid = unstructured::grid(part, &[], free_bytes, &mut warnings)?;
    Ok(Opened::of(grid, Format::Table, warnings))
}

/// A cell of one point for each.
pub(super) fn cloud(points: Vec<DVec3>) -> Listing {
    let count = points.len();
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 points were checked")]
    let corners = (0..count as u32).collect();
    Listing {
        points,
        types: vec![kind::VERTEX; count],
        starts: (0..=count).collect(),
        corners,
        ..Listing::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_known_by_their_first_lines() {
        assert!(is_it("txt", b" 20 76 21\n21 76 21\n"));
        assert!(is_it("csv", b"x,y,z,val\n1,2,3,4\n"));
        assert!(is_it("xyz", b"# a comment\n\n1;2;3\n"));
        assert!(!is_it("txt", b"some words and nothing else\nand more of them\n"));
        assert!(!is_it("txt", b"1 2\n3 4\n"), "two columns are no places");
        assert!(!is_it("raw", b"1 2 3\n"));
        assert!(!is_it("xyz", b"3\nwater\nO 0 0 0\n"), "molecules are none");
    }

    #[test]
    fn words_are_separated_as_the_first_line_says() {
        let numbers = |line: &str| Separator::of(line).numbers(line);
        assert_eq!(numbers(" 1  2\t3 "), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(numbers("1\t 2\t3\r\n"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(numbers(" 1  2 3 \n"), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(numbers("1, -2e3 ,3"), Some(vec![1.0, -2000.0, 3.0]));
        for line in ["1,,3", "1\t\t3"] {
            let empty = numbers(line).unwrap();
            assert!(empty[1].is_nan() && empty.len() == 3);
        }
        assert_eq!(numbers("1,b,3"), None);
    }

    #[test]
    fn a_first_row_with_a_word_is_no_header() {
        let check = |line: &str| refuse_row_with_word(line, Separator::of(line));
        assert!(check("1,2,b,4").is_err() && check("1 2 3 x").is_err());
        for names in ["x,y,z,T", "x,y,z,1,2", "\"Points:0\",\"Points:1\",b,4", "12"] {
            assert!(check(names).is_ok(), "{names}");
        }
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
