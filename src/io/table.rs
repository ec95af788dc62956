//! Tables of points: one a line of text, its place in three columns and numbers in the others. Columns of words, such as names,
//! are left out and told. Molecules are read here, too.

mod molecule;
mod names;
mod row;

use std::io::BufRead;
use std::path::Path;

use glam::DVec3;

use self::names::{columns_of_place, names_columns, words_of_header};
use self::row::{Entry, Separator, is_comment, is_row, unquoted};
use super::error::{Problem, header, quoted, quoted_bytes, truncated, unrecognised, unsupported};
use super::unstructured::{self, Part, field_of, kind};
use super::{Format, Opened, files};
use crate::cells::Listing;
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Association, Samples};

/// Extensions of files that are taken for tables, where they are text.
const EXTENSIONS: [&str; 5] = ["txt", "csv", "tsv", "xyz", "asc"];
/// Extension of files of molecules, too.
const MOLECULES: &str = "xyz";
/// More columns than this are no list that anybody picks from.
const MOST_COLUMNS: usize = 1024;
/// No line is longer.
const LONGEST_LINE: u64 = 1 << 16;
/// Columns that a note names, before it counts the others.
const MOST_TOLD: usize = 4;
/// Whether some first bytes are a table, of a file with an extension of one.
pub(super) fn is_it(extension: &str, start: &[u8]) -> bool {
    if !EXTENSIONS.contains(&extension) {
        return false;
    }
    if extension == MOLECULES && molecule::is_it(start) {
        return true;
    }
    let text = String::from_utf8_lossy(start);
    // The last line may be cut.
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.len() > 1 && !text.ends_with('\n') && start.len() >= 4096 {
        lines.pop();
    }
    lines.into_iter().filter(|line| !is_comment(line)).take(2).any(is_row)
}

/// Why a file that is called a table is none.
pub(super) fn refusal(start: &[u8]) -> Problem {
    let text = String::from_utf8_lossy(start);
    let mut lines = text.lines().filter(|line| !is_comment(line));
    let first = lines.next().unwrap_or_default().trim_start_matches('\u{feff}');
    let (is_header, second) = (Separator::of(first).words(first).len() >= 3, lines.next());
    if let (true, None) = (is_header, second) {
        return unrecognised(
            "a table of points, one a line below the names of its columns",
            format!("the line {} alone", quoted(first)),
            "write the file again with its rows",
        );
    }
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let words = |c: char| !c.is_alphanumeric() && !"+-.".contains(c);
    if !text.split(words).any(is_number) {
        return unrecognised(
            "a volume, or a table of points",
            format!("a text without a number, which begins with {}", quoted(first)),
            "open a file of one of the formats that are read",
        );
    }
    let found = match second {
        Some(row) => format!("{} below {}", quoted(row), quoted(first)),
        None => quoted(first),
    };
    unrecognised(
        "a table of points, one a line: three numbers or more",
        found,
        "separate numbers by commas, semicolons, tabs or blanks, and give x, y and z in three columns",
    )
}

/// Lines of a file, and their numbers from 1.
struct Lines<R> {
    reader: R,
    line: usize,
    bytes: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    /// The next line, whatever it says; `None` at the end.
    fn any(&mut self) -> Result<Option<String>, Problem> {
        use std::io::Read;
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
        if text.trim_end().contains('\r') {
            return Err(header(
                "lines that end with a line feed",
                format!("a carriage return alone in line {}, as old programs end lines", self.line),
                "save the table with the line ends of Unix or Windows",
            ));
        }
        Ok(Some(text.into_owned()))
    }

    /// Whether the last line that was read ends as lines do, rather than where the file ends.
    fn is_whole(&self) -> bool {
        self.bytes.last() == Some(&b'\n')
    }

    /// The next line that is no comment, and the last comment before it; `None` at the end.
    fn next(&mut self) -> Result<Option<(String, Option<String>)>, Problem> {
        let mut comment = None;
        loop {
            let Some(text) = self.any()? else { return Ok(None) };
            if !is_comment(&text) {
                return Ok(Some((text, comment)));
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
    let is_named_so = path.extension().is_some_and(|of| of.eq_ignore_ascii_case(MOLECULES));
    if is_named_so && molecule::is_it(lines.reader.fill_buf().map_err(Problem::Io)?) {
        return molecule::read(&mut lines, (len, free_bytes), ticket);
    }
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
    let first_at = lines.line;
    let second = lines.next()?.map(|(line, _)| (line, lines.line));
    // Whether the file ends with the last row, without the end of a line.
    let mut is_cut = !lines.is_whole();
    let has_names = names_columns(&first, second.as_ref().map(|(line, _)| line.as_str()))?;
    let (names, mut rows) = match (has_names, second) {
        (true, Some(second)) => (Some(first), vec![second]),
        (true, None) => return Err(none()),
        (false, second) => (None, std::iter::once((first, first_at)).chain(second).collect()),
    };
    let separator = Separator::of(&rows[0].0);
    let mut count = separator.words(&rows[0].0).len();
    // One name fewer, where each row ends with a separator that nothing follows.
    let names_fewer = names.as_ref().is_some_and(|line: &String| {
        count > 3 && words_of_header(line, separator, count - 1).is_some()
    });
    let ends_empty = names_fewer && separator.words(&rows[0].0).last() == Some(&"");
    count -= usize::from(ends_empty);
    if count < 3 {
        return Err(none());
    }
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
    let columns = vec![Column::default(); count];
    let mut table = Table { separator, ends_empty, columns, with_comma: None };
    let last = rows.last().map(|(_, at)| *at);
    for (line, at) in rows.drain(..) {
        table.add(&line, (at, is_cut && last == Some(at)))?;
    }
    let mut done = 0;
    while let Some((line, _)) = lines.next()? {
        done += line.len() as u64;
        if lines.line % 1024 == 0 {
            ticket.checkpoint(done, len)?;
        }
        is_cut = !lines.is_whole();
        table.add(&line, (lines.line, is_cut))?;
    }
    if let Some(word) = &table.with_comma {
        let example = quoted(word);
        warnings
            .push(format!("commas within numbers, as in {example}, are taken for decimal points"));
    }
    points(table.columns, names, warnings, free_bytes)
}

/// The rows of a file, as its first one is separated.
struct Table {
    separator: Separator,
    /// Whether each row ends with a separator that nothing follows.
    ends_empty: bool,
    columns: Vec<Column>,
    /// The first number whose fraction follows a comma.
    with_comma: Option<String>,
}

/// The numbers of a column, and what is none.
#[derive(Debug, Clone, Default)]
struct Column {
    /// NaN where there is none.
    numbers: Vec<f64>,
    missing: usize,
    words: usize,
    /// The first word, and its line.
    word: Option<(String, usize)>,
}

impl Column {
    /// Whether it is of words, such as names: more than half of what is not missing.
    fn is_of_words(&self) -> bool {
        2 * self.words > self.numbers.len() - self.missing
    }
}

impl Table {
    /// The row on line `at`, which the file may be cut off within.
    fn add(&mut self, line: &str, (at, is_cut): (usize, bool)) -> Result<(), Problem> {
        let count = self.columns.len();
        let mut words = self.separator.words(line);
        if self.ends_empty && words.len() == count + 1 && words[count].is_empty() {
            words.pop();
        }
        if self.separator == Separator::Tab && words.len() != count {
            // Some lines may be separated by blanks all the same.
            let between_blanks = Separator::Blanks.words(line);
            words = if between_blanks.len() == count { between_blanks } else { words };
        }
        if words.len() < count && is_cut {
            return Err(ends_within(at, format!("{count} columns"), words.len()));
        }
        if words.len() != count {
            return Err(header(
                format!("{count} columns on line {at}, as on those before it"),
                words.len().to_string(),
                "correct the line, or write the table again",
            ));
        }
        for (column, word) in self.columns.iter_mut().zip(words) {
            let entry = self.separator.entry(word);
            column.numbers.push(if let Entry::Number(number) = entry { number } else { f64::NAN });
            match entry {
                Entry::Missing => column.missing += 1,
                Entry::Word => {
                    column.words += 1;
                    column.word.get_or_insert_with(|| (unquoted(word).to_owned(), at));
                }
                Entry::Number(_) if self.with_comma.is_none() && word.contains(',') => {
                    self.with_comma = Some(word.to_owned());
                }
                Entry::Number(_) => {}
            }
        }
        Ok(())
    }
}

fn points(
    mut columns: Vec<Column>,
    names: Option<Vec<String>>,
    mut warnings: Vec<String>,
    free_bytes: u64,
) -> Result<Opened, Problem> {
    let named =
        |at: usize| names.as_ref().map_or_else(|| format!("column {}", at + 1), |n| n[at].clone());
    refuse_words_among_numbers(&columns)?;
    let is_empty = |column: &Column| column.missing == column.numbers.len();
    if names.is_none() && columns.len() > 3 && columns.last().is_some_and(is_empty) {
        // Each row ends with a separator that nothing follows.
        columns.pop();
    }
    let of_words: Vec<usize> = (0..columns.len()).filter(|at| columns[*at].is_of_words()).collect();
    let example = |at: usize| columns[at].word.as_ref().map_or("", |(word, _)| word.as_str());
    if !of_words.is_empty() {
        let shown = of_words.iter().take(MOST_TOLD);
        let shown =
            shown.map(|at| format!("{} (such as {})", quoted(&named(*at)), quoted(example(*at))));
        let (one, are) = if of_words.len() == 1 { ("a column", "is") } else { ("columns", "are") };
        warnings.push(format!(
            "{one} of words {are} left out: {}",
            and_more(shown.collect(), of_words.len())
        ));
    }
    let place = names.as_ref().and_then(|names| columns_of_place(names));
    if let Some(at) = place.and_then(|place| place.into_iter().find(|at| of_words.contains(at))) {
        let name = named(at).to_lowercase();
        let names_xyz = ["x", "y", "z"].contains(&name.as_str());
        return Err(header(
            format!("numbers in the column {} of a place", quoted(&named(at))),
            format!("words, such as {}", quoted(example(at))),
            match names_xyz {
                true => "write numbers with a decimal point, and without separators of thousands",
                false => "rename the columns that hold the place x, y and z",
            },
        ));
    }
    let of_numbers: Vec<usize> = (0..columns.len()).filter(|at| !of_words.contains(at)).collect();
    let first_three = match of_numbers[..] {
        [x, y, z, ..] => [x, y, z],
        _ => {
            return Err(header(
                "three columns of numbers or more",
                format!("{} beside {} of words", of_numbers.len(), of_words.len()),
                "give x, y and z in three columns",
            ));
        }
    };
    let place = place.unwrap_or_else(|| {
        if names.is_some() || first_three != [0, 1, 2] {
            let used = first_three.map(|at| quoted(&named(at))).join(", ");
            let of = if of_words.is_empty() { "" } else { " of numbers" };
            warnings.push(format!(
                "no columns are called x, y and z: the first three{of}, {used}, are taken for these; rename the columns \
                 that hold the place"
            ));
        }
        first_three
    });
    let count = columns[0].numbers.len();
    let at = |i: usize| DVec3::from_array(place.map(|column| columns[column].numbers[i]));
    unstructured::require_memory(count as u64, count as u64, count as u64, free_bytes)?;
    let listing = cloud((0..count).map(at).collect());
    let mut fields = Vec::new();
    let mut without_value = Vec::new();
    for (at, column) in columns.iter_mut().enumerate() {
        if place.contains(&at) || of_words.contains(&at) {
            continue;
        }
        let numbers = std::mem::take(&mut column.numbers);
        let lacking = numbers.iter().filter(|number| !number.is_finite()).count();
        if lacking > 0 {
            without_value.push(format!("{lacking} of {count} in {}", quoted(&named(at))));
        }
        fields.push(field_of(named(at), (1, Association::Point), Samples::Float64(numbers)));
    }
    if !without_value.is_empty() {
        let all = without_value.len();
        without_value.truncate(MOST_TOLD);
        warnings.push(format!(
            "some points have no finite value (missing, NaN or infinite): {}",
            and_more(without_value, all)
        ));
    }
    let part = Part { listing, fields };
    let grid = unstructured::grid(part, &[], free_bytes, &mut warnings)?;
    Ok(Opened::of(grid, Format::Table, warnings))
}

/// Refuses a file that ends in the middle of its last line.
fn ends_within(line: usize, expected: String, found: usize) -> Problem {
    truncated(
        format!("{expected} on line {line}"),
        format!("that the file ends within that line, behind {found}"),
        "it was cut short: copy or write it again",
    )
}

/// Refuses the first word of a column that is otherwise of numbers.
fn refuse_words_among_numbers(columns: &[Column]) -> Result<(), Problem> {
    let among_numbers = columns.iter().filter(|column| !column.is_of_words());
    let first = among_numbers.filter_map(|column| column.word.as_ref()).min_by_key(|(_, at)| *at);
    let Some((word, at)) = first else { return Ok(()) };
    Err(header(
        format!("numbers on line {at}"),
        quoted_bytes(word.as_bytes()),
        "correct the line, or write the table again",
    ))
}

/// The first of so many, and how many more there are.
fn and_more(mut shown: Vec<String>, all: usize) -> String {
    if all > shown.len() {
        shown.push(format!("{} more", all - shown.len()));
    }
    shown.join(", ")
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
        let water = b"3\nwater\nO 0 0 0\n";
        assert!(is_it("xyz", water) && !is_it("txt", water), "molecules are called so");
    }

    #[test]
    fn rows_may_have_words_and_lack_values() {
        assert!(is_it("csv", b"name,lat,lon,depth\na,1,2,3\n"));
        assert!(is_it("csv", b"x,y,z\nnan,NA,-\n"));
        assert!(is_it("csv", b"x;y;z\n1,5;2,25;3,0\n"));
        assert!(is_it("txt", b"a 1 2 3\n"));
        assert!(!is_it("txt", b"on 3 May at 4 pm, 5 came\nand left\n"), "words between blanks");
        assert!(!is_it("csv", b"x,y,z,t\n"), "names alone");
    }
}
