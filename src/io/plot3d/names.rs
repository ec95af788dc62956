//! Which files belong together: by their names, or as a third one says (`.p3d`).

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::super::error::{Problem, header, quoted, quoted_bytes};
use super::super::files::DataFile;
use super::start_of;

/// A file of names is not longer.
const MOST_BYTES: u64 = 1 << 20;
/// Extensions of grids, the likeliest first.
pub(super) const GRIDS: [&str; 5] = ["xyz", "x", "grd", "p3d", "bin"];
/// Extensions of functions.
pub(super) const FUNCTIONS: [&str; 3] = ["f", "fun", "fn"];

/// Whether some first bytes are a file of names.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    start.trim_ascii_start().starts_with(b"{")
}

/// Files that belong together.
#[derive(Debug, Default)]
pub(super) struct Files {
    pub(super) grid: PathBuf,
    pub(super) solution: Option<PathBuf>,
    pub(super) functions: Option<PathBuf>,
}

/// The files of what was asked for: any of them, or one that names them.
///
/// # Errors
/// Names that are none, and files that are not there.
pub(super) fn files(path: &Path, warnings: &mut Vec<String>) -> Result<Files, Problem> {
    let (start, _) = start_of(path, MOST_BYTES)?;
    if looks_like_it(&start) {
        return named(path, &start, warnings);
    }
    // A grid with a solution may have a name that ends in a q, too.
    let is_grid = !has_functions(path) && solution_beside(path).is_some();
    let of_grid = grid_beside(path).filter(|_| !is_grid);
    let grid = of_grid.clone().unwrap_or_else(|| path.to_owned());
    let mut files =
        Files { solution: solution_beside(&grid), functions: functions_beside(&grid), grid };
    if of_grid.is_some() {
        let own = if has_functions(path) { &mut files.functions } else { &mut files.solution };
        *own = Some(path.to_owned());
    }
    Ok(files)
}

fn named(path: &Path, text: &[u8], warnings: &mut Vec<String>) -> Result<Files, Problem> {
    let wrong = |found: String| {
        header(
            "JSON with a list \"filenames\" of entries with \"xyz\"",
            found,
            "correct the file, or open the grid itself",
        )
    };
    let content: Value =
        serde_json::from_slice(text).map_err(|_no_json| wrong(quoted_bytes(text)))?;
    let entries = content["filenames"].as_array().map(Vec::as_slice).unwrap_or_default();
    let first = entries.first().ok_or_else(|| wrong("no such list".into()))?;
    let name = first["xyz"].as_str().ok_or_else(|| wrong(quoted(&first.to_string())))?;
    let grid = DataFile::find(path, name)?.path;
    let solution = match first["q"].as_str() {
        Some(name) => Some(DataFile::find(path, name)?.path),
        None => None,
    };
    if entries.len() > 1 {
        warnings.push(format!("the file names {} times: the first is opened", entries.len()));
    }
    let functions = first["function"].as_str().and_then(|name| {
        let found = DataFile::find(path, name).ok().map(|file| file.path);
        if found.is_none() {
            warnings.push(format!(
                "the functions {} that the file names are not there: left out",
                quoted(name)
            ));
        }
        found
    });
    Ok(Files { grid, solution, functions })
}

fn parts(path: &Path) -> Option<(&str, &str)> {
    Some((path.file_stem()?.to_str()?, path.extension()?.to_str()?))
}

fn existing(path: &Path, names: impl IntoIterator<Item = String>) -> Option<PathBuf> {
    let beside = names.into_iter().map(|name| path.with_file_name(name));
    beside.filter(|other| other != path).find(|other| other.is_file())
}

/// What belongs to a grid: its name with another extension, or with one of some letters for the `xyz` or `x` at the end of its
/// stem.
fn beside(path: &Path, extensions: &[&str], letter: &str) -> Option<PathBuf> {
    let (stem, extension) = parts(path)?;
    let of_stem = ["xyz", "x"].iter().filter_map(|end| stem.strip_suffix(end));
    let names = extensions.iter().map(|other| format!("{stem}.{other}"));
    existing(path, names.chain(of_stem.map(|stem| format!("{stem}{letter}.{extension}"))))
}

/// The solution of a grid.
fn solution_beside(path: &Path) -> Option<PathBuf> {
    beside(path, &["q", "Q"], "q")
}

/// The functions on a grid.
fn functions_beside(path: &Path) -> Option<PathBuf> {
    beside(path, &["f", "F", "fun", "FUN", "fn"], "f")
}

/// Whether a file's extension is that of functions.
fn has_functions(path: &Path) -> bool {
    let (_, extension) = parts(path).unwrap_or_default();
    FUNCTIONS.iter().any(|own| extension.eq_ignore_ascii_case(own))
}

/// The grid of a solution or of functions, by the same rule.
pub(super) fn grid_beside(path: &Path) -> Option<PathBuf> {
    let (stem, extension) = parts(path)?;
    if extension.eq_ignore_ascii_case("q") || has_functions(path) {
        return existing(path, GRIDS.map(|grid| format!("{stem}.{grid}")));
    }
    let stem = stem.strip_suffix('q')?;
    existing(path, ["xyz", "x"].map(|end| format!("{stem}{end}.{extension}")))
}

/// What the functions are called: by a text beside them that has the name of each in a line.
pub(super) fn names_of(functions: &Path, count: usize) -> Vec<String> {
    let plain = |i: usize| format!("Function{i}");
    let text = functions.with_extension("nam");
    let start = start_of(&text, MOST_BYTES).map(|(start, _)| start).unwrap_or_default();
    let text = String::from_utf8_lossy(&start);
    // Behind a semicolon is what the vectors are called that three of them are.
    let mut named = text.lines().map(|line| line.split(';').next().unwrap_or_default().trim());
    let name = |i| match named.next() {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => plain(i),
    };
    (0..count).map(name).collect()
}
