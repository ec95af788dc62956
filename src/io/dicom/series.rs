//! Which files belong together, of all that lie in a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::slices::Slices;
use super::{MOST_DEPTH, files_of};
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::io::Series;
use crate::io::error::{Problem, quoted, unsupported};

/// The files of one series.
pub(super) struct Chosen {
    pub(super) files: Vec<Slices>,
    /// All series at its place; empty where it is the only one.
    pub(super) series: Vec<Series>,
}

/// The series of this name at a place; else that of the file, or of a folder that with most pixels. The others are told.
pub(super) fn choose(
    path: &Path,
    name: Option<&str>,
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Chosen, Problem> {
    let is_folder = path.is_dir();
    let mut groups = match is_folder {
        true => grouped(read_all(&files_of(path, MOST_DEPTH, ticket)?, ticket, warnings)?),
        false => beside(path, ticket)?,
    };
    let pixels = |group: &Vec<Slices>| -> usize {
        group.iter().map(|slices| slices.form.len() * slices.frames.len()).sum()
    };
    let most = groups.iter().map(pixels).max().unwrap_or_default();
    let is_usual = |group: &Vec<Slices>| match is_folder {
        true => pixels(group) == most,
        false => group.iter().any(|slices| slices.path == path),
    };
    let Some(usual) = groups.iter().position(is_usual) else {
        return Err(unsupported(
            "a folder with DICOM pictures",
            "none",
            "choose the folder that has the series",
        ));
    };
    let (mut series, order) = listed(&groups);
    let named = series.iter().position(|series| Some(series.name.as_str()) == name);
    let at = named.map_or(usual, |named| order[named]);
    if groups.len() == 1 {
        series.clear();
    }
    for (series, group) in series.iter_mut().zip(order) {
        series.is_open = group == at;
    }
    let files = groups.swap_remove(at);
    if !is_folder && files.len() > 1 {
        warnings.push(format!("the series is of {} files in the folder", files.len()));
    }
    // Who named a file chose it.
    if is_folder && !series.is_empty() {
        warnings.push(others(&series, path));
    }
    Ok(Chosen { files, series })
}

/// A file, and what lies beside it.
fn beside(path: &Path, ticket: &Ticket) -> Result<Vec<Vec<Slices>>, Problem> {
    let own = Slices::read(path)?;
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    // Nothing says what it belongs to.
    if own.series.is_empty() || (own.frames.len() == 1 && own.frames[0].position.is_none()) {
        return Ok(vec![vec![own]]);
    }
    // The file that was asked for first, before its doubles.
    let mut paths = vec![path.to_owned()];
    let others = files_of(folder, 0, ticket).unwrap_or_default();
    paths.extend(others.into_iter().filter(|other| other.file_name() != path.file_name()));
    // What else lies in the folder need not be whole.
    Ok(grouped(read_all(&paths, ticket, &mut Vec::new())?))
}

/// Files of one series each. Those of several frames are each a series of their own.
fn grouped(all: Vec<Slices>) -> Vec<Vec<Slices>> {
    let mut groups: Vec<Vec<Slices>> = Vec::new();
    for slices in all {
        let is_of = |group: &Vec<Slices>| {
            group[0].series == slices.series
                && group[0].frames.len() == 1
                && slices.frames.len() == 1
        };
        match groups.iter_mut().find(|group| is_of(group)) {
            Some(group) => group.push(slices),
            None => groups.push(vec![slices]),
        }
    }
    groups
}

/// Groups as series in the order of their numbers, by names of which no two are alike; and which group each is.
fn listed(groups: &[Vec<Slices>]) -> (Vec<Series>, Vec<usize>) {
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_key(|&i| (groups[i][0].series_number, &groups[i][0].path));
    let described = |i: usize| {
        let first = &groups[i][0];
        first.described().unwrap_or_else(|| format!("series {}", first.series_number))
    };
    let mut taken = BTreeSet::new();
    let mut named = |i: usize| {
        let (plain, number) = (described(i), groups[i][0].series_number);
        let is_double = order.iter().filter(|&&other| described(other) == plain).count() > 1;
        let wanted = if is_double { format!("{plain} (series {number})") } else { plain };
        let mut name = wanted.clone();
        for count in 2.. {
            if taken.insert(name.clone()) {
                break;
            }
            name = format!("{wanted}, {count}");
        }
        name
    };
    let series = order.iter().map(|&i| Series {
        name: named(i),
        path: groups[i][0].path.clone(),
        slices: groups[i].iter().map(|slices| slices.frames.len()).sum(),
        is_open: false,
    });
    (series.collect(), order.clone())
}

/// Which series are in a folder besides.
fn others(series: &[Series], folder: &Path) -> String {
    const MOST: usize = 5;
    let others = || series.iter().filter(|series| !series.is_open);
    let told: Vec<String> = others()
        .take(MOST)
        .map(|series| {
            let path = series.path.strip_prefix(folder).unwrap_or(&series.path);
            let noun = if series.slices == 1 { "slice" } else { "slices" };
            format!("{} ({} {noun}: {})", quoted(&series.name), series.slices, path.display())
        })
        .collect();
    let count = others().count();
    let more = if count > MOST { ", …" } else { "" };
    let noun = if count == 1 { "series is" } else { "series are" };
    format!(
        "{count} more {noun} in the folder, chosen by name or opened by a file: {}{more}",
        told.join(", ")
    )
}

/// The slices of all files that have any, without doubles of one instance.
fn read_all(
    paths: &[PathBuf],
    ticket: &Ticket,
    warnings: &mut Vec<String>,
) -> Result<Vec<Slices>, Problem> {
    let read = |i: usize| {
        let path = &paths[i];
        if ticket.is_cancelled() {
            return Err(crate::core::Cancelled.into());
        }
        match Slices::read(path) {
            Ok(slices) => Ok(Some(Ok(slices))),
            // Reports, structures and the like lie beside the pictures.
            Err(Problem::Unsupported(_)) => Ok(None),
            Err(_) => Ok(Some(Err(path.clone()))),
        }
    };
    let all: Result<Vec<Option<Result<Slices, PathBuf>>>, Problem> =
        parallel::try_list(paths.len(), read);
    let (all, damaged): (Vec<_>, Vec<_>) = all?.into_iter().flatten().partition(Result::is_ok);
    if let Some(Err(first)) = damaged.first() {
        let (count, first) =
            (damaged.len(), first.file_name().unwrap_or_default().to_string_lossy());
        let noun = if count == 1 { "file is" } else { "files are" };
        warnings.push(format!("{count} {noun} damaged and left out ({})", quoted(&first)));
    }
    let mut known = BTreeMap::new();
    let all = all.into_iter().filter_map(Result::ok);
    Ok(all
        .filter(|slices| {
            slices.instance.is_empty() || known.insert(slices.instance.clone(), ()).is_none()
        })
        .collect())
}
