//! Which files belong together: by their names, or as a third one says (`.p3d`).

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::super::error::{Problem, header, quoted, quoted_bytes};
use super::super::files::DataFile;
use super::start_of;

/// A file of names is not longer.
const MOST_BYTES: u64 = 1 << 20;
/// Extensions of grids, the likeliest first.
const GRIDS: [&str; 5] = ["xyz", "x", "grd", "p3d", "bin"];

/// Whether some first bytes are a file of names.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    start.trim_ascii_start().starts_with(b"{")
}

/// The grid, and the solution where there is one, of what was asked for: either of them, or a file that names both.
///
/// # Errors
/// Names that are none, and files that are not there.
pub(super) fn pair(
    path: &Path,
    warnings: &mut Vec<String>,
) -> Result<(PathBuf, Option<PathBuf>), Problem> {
    let (start, _) = start_of(path, MOST_BYTES)?;
    if looks_like_it(&start) {
        return named(path, &start, warnings);
    }
    if let Some(solution) = solution_beside(path) {
        return Ok((path.to_owned(), Some(solution)));
    }
    match grid_beside(path) {
        Some(grid) => Ok((grid, Some(path.to_owned()))),
        None => Ok((path.to_owned(), None)),
    }
}

fn named(
    path: &Path,
    text: &[u8],
    warnings: &mut Vec<String>,
) -> Result<(PathBuf, Option<PathBuf>), Problem> {
    let wrong = |found: String| {
        header(
            "JSON with a list \"filenames\" of entries with \"xyz\" and \"q\"",
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
    if first["function"].is_string() {
        warnings.push("the file's functions are not read".into());
    }
    Ok((grid, solution))
}

fn parts(path: &Path) -> Option<(&str, &str)> {
    Some((path.file_stem()?.to_str()?, path.extension()?.to_str()?))
}

fn existing(path: &Path, names: impl IntoIterator<Item = String>) -> Option<PathBuf> {
    let beside = names.into_iter().map(|name| path.with_file_name(name));
    beside.filter(|other| other != path).find(|other| other.is_file())
}

/// The solution of a grid: its name with `q` for its extension, or for the `xyz` or `x` at the end of its stem.
fn solution_beside(path: &Path) -> Option<PathBuf> {
    let (stem, extension) = parts(path)?;
    let of_stem = ["xyz", "x"].iter().filter_map(|end| stem.strip_suffix(end));
    let names = [format!("{stem}.q"), format!("{stem}.Q")];
    existing(path, names.into_iter().chain(of_stem.map(|stem| format!("{stem}q.{extension}"))))
}

/// The grid of a solution, by the same rule.
pub(super) fn grid_beside(path: &Path) -> Option<PathBuf> {
    let (stem, extension) = parts(path)?;
    if extension.eq_ignore_ascii_case("q") {
        return existing(path, GRIDS.map(|grid| format!("{stem}.{grid}")));
    }
    let stem = stem.strip_suffix('q')?;
    existing(path, ["xyz", "x"].map(|end| format!("{stem}{end}.{extension}")))
}
