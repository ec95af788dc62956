//! The file or files that hold an NRRD's samples.

use std::path::Path;

use super::super::error::{Problem, header, quoted, unsupported};
use super::super::files::{DataFile, Part, numbered, open_file};
use super::header::Header;

/// More files than this are a mistake in the header.
const MOST_FILES: u64 = 1 << 16;

/// The files in order. Each is looked up now, so that a missing one is told before any is read.
///
/// # Errors
/// A missing file, or a count of files that does not divide the samples.
pub(super) fn parts(path: &Path, said: &Header, sizes: &[usize]) -> Result<Vec<Part>, Problem> {
    let count = sizes.iter().product();
    let Some(value) = said.get("datafile") else {
        let (_, len) = open_file(path)?;
        let file = DataFile { path: path.to_owned(), len };
        return Ok(vec![Part { file, start: said.len, count }]);
    };
    let words: Vec<&str> = value.split_whitespace().collect();
    let is_list = words.first().is_some_and(|w| w.eq_ignore_ascii_case("list"));
    let (names, subdim) = if is_list {
        let subdim = words.get(1).map(|word| word.parse::<usize>().map_err(|_not| bad(value)));
        (said.listed_files.clone(), subdim.transpose()?)
    } else if let Some((pattern, numbers)) = pattern(&words) {
        expand(&pattern, &numbers, value)?
    } else {
        let file = DataFile::find(path, value)?;
        return Ok(vec![Part { file, start: 0, count }]);
    };
    let files = names.len();
    let each = match subdim {
        // Each file holds the first `subdim` axes; by default all but the last.
        None => sizes[..sizes.len() - 1].iter().product(),
        Some(n) if n >= 1 && n < sizes.len() => sizes[..n].iter().product(),
        // Slabs of the last axis, equally thick.
        Some(n) if n == sizes.len() && files > 0 && sizes[n - 1].is_multiple_of(files) => {
            count / files
        }
        Some(_) => return Err(bad(value)),
    };
    if each == 0 || count % each != 0 || count / each != files {
        return Err(header(
            format!("{} data files for sizes {sizes:?}", count.checked_div(each).unwrap_or(0)),
            format!("{files}"),
            "correct the list of data files",
        ));
    }
    names
        .iter()
        .map(|name| Ok(Part { file: DataFile::find(path, name)?, start: 0, count: each }))
        .collect()
}

fn bad(value: &str) -> Problem {
    header(
        "\"data file\" with one name, \"LIST [subdim]\" or \"PATTERN MIN MAX STEP [subdim]\"",
        quoted(value),
        "correct the field",
    )
}

/// The pattern and its numbers, where that is what the words are.
fn pattern(words: &[&str]) -> Option<(String, Vec<i64>)> {
    let first_number = words.iter().position(|w| w.contains('%'))? + 1;
    let numbers: Vec<i64> =
        words[first_number..].iter().map(|w| w.parse().ok()).collect::<Option<_>>()?;
    (3..=4).contains(&numbers.len()).then(|| (words[..first_number].join(" "), numbers))
}

fn expand(
    pattern: &str,
    numbers: &[i64],
    value: &str,
) -> Result<(Vec<String>, Option<usize>), Problem> {
    let (min, max, step) = (numbers[0], numbers[1], numbers[2]);
    let subdim = numbers.get(3).map(|&n| usize::try_from(n).map_err(|_negative| bad(value)));
    let span = max.checked_sub(min).ok_or_else(|| bad(value))?;
    let steps = if step == 0 { None } else { span.checked_div(step) };
    let steps = steps.and_then(|n| u64::try_from(n).ok()).ok_or_else(|| bad(value))?;
    if steps >= MOST_FILES {
        return Err(unsupported(
            format!("at most {MOST_FILES} data files"),
            quoted(value),
            "correct the pattern's numbers",
        ));
    }
    let names = (0..=steps)
        .map(|i| {
            let number = min + i64::try_from(i).unwrap_or(i64::MAX) * step;
            numbered(pattern, number).ok_or_else(|| bad(value))
        })
        .collect::<Result<_, _>>()?;
    Ok((names, subdim.transpose()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_run_to_the_end_in_steps_and_absurd_ones_are_refused() {
        let names = |numbers: &[i64]| expand("%d", numbers, "").map(|(names, _)| names);
        assert_eq!(names(&[1, 5, 2]).unwrap(), ["1", "3", "5"]);
        assert_eq!(names(&[3, 1, -1]).unwrap(), ["3", "2", "1"]);
        for bad in [[1, 5, 0], [1, 5, -1], [0, i64::MAX, 1], [i64::MIN, i64::MAX, 1]] {
            assert!(names(&bad).is_err(), "{bad:?}");
        }
    }
}
