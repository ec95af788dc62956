//! What is said of the arrays and cells of a file: what is left out, stands in for what it has not, or is drawn as something
//! simpler.

use std::sync::Arc;

use glam::DVec3;

use super::super::error::quoted;
use super::kind;
use crate::cells::{Cells, Listing, has_volume, is_flat};
use crate::core::counted;
use crate::rbf::log_densities;
use crate::volume::{Association, Field, Grid, Samples, Shape};

/// What to do about cells that are left out.
pub(in super::super) const EMBED_THEM: &str =
    "to see such cells, embed the file as polygons (--mesh)";

/// Whether cells have volume, rather than an area, a length or a place.
fn has_solids(types: &[u8]) -> bool {
    types.iter().any(|kind| has_volume(*kind))
}

/// Whether cells are polygons, and none has volume: a surface, which has a colour without any number.
pub(super) fn are_surface(types: &[u8]) -> bool {
    types.iter().any(|kind| is_flat(*kind)) && !has_solids(types)
}

/// Puts arrays behind others that say how a surface is lit or where pictures lie on it, which is not what it is about; and colours
/// before others.
pub(super) fn in_order(fields: &mut [Field]) {
    let rank = |field: &Field| {
        let name = field.name.to_lowercase();
        match ["normals", "tcoords", "texture coordinates", "texcoords"].contains(&name.as_str()) {
            true => 2,
            false => u8::from(!holds_colours(field)),
        }
    };
    fields.sort_by_key(rank);
}

/// Whether an array is of colours: three or four bytes, as VTK takes them for.
pub(in super::super) fn holds_colours(field: &Field) -> bool {
    matches!(field.components, 3 | 4) && matches!(*field.samples, Samples::UInt8(_))
}

/// What becomes of cells without a volume.
pub(super) fn flat_cells(types: &[u8]) -> Option<String> {
    let flat = types.iter().filter(|kind| is_flat(**kind)).count();
    match (flat, has_solids(types)) {
        (0, _) => None,
        (flat, true) => Some(format!(
            "{} {} no volume: left out here; {EMBED_THEM}",
            counted(flat, "polygon"),
            if flat == 1 { "has" } else { "have" }
        )),
        // They are shown as polygons.
        (_, false) => None,
    }
}

/// What becomes of cells that are solids, where none has a volume.
pub(super) fn as_polygons(cells: &Cells) -> Option<String> {
    let flat = cells.census().flat;
    (flat > 0 && cells.is_surface()).then(|| {
        let verb = if flat == 1 { "has" } else { "have" };
        format!(
            "{} {verb} no volume, and no other has: drawn are the faces, as polygons",
            counted(flat, "cell")
        )
    })
}

/// What becomes of lines and points beside cells that have an area or a volume.
pub(super) fn thin_cells(types: &[u8]) -> Option<String> {
    let count = |is: fn(u8) -> bool| types.iter().filter(|kind| is(**kind)).count();
    let lines = count(|kind| matches!(kind, 3 | 4 | 21 | 35 | 68 | 75));
    let points = count(|kind| matches!(kind, 1 | 2));
    let left_out = match (lines, points) {
        (0, 0) => return None,
        (lines, 0) => counted(lines, "line"),
        (0, points) => counted(points, "single point"),
        (lines, points) => {
            format!("{} and {}", counted(lines, "line"), counted(points, "single point"))
        }
    };
    let has_more = types.iter().any(|kind| has_volume(*kind) || is_flat(*kind));
    has_more.then(|| format!("{left_out} beside cells with an area or a volume: left out"))
}

/// How many polyhedra have an edge of one face alone.
pub(super) fn open_polyhedra(listing: &Listing) -> Option<String> {
    let is_open = |faces: &Vec<Vec<u32>>| {
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for face in faces {
            let next = face.iter().cycle().skip(1);
            edges.extend(face.iter().zip(next).map(|(a, b)| [*a.min(b), *a.max(b)]));
        }
        edges.sort_unstable();
        edges.chunk_by(|a, b| a == b).any(|own| own.len() == 1)
    };
    let open = listing.faces.values().filter(|faces| is_open(faces)).count();
    let polyhedra = if open == 1 { "1 polyhedron is" } else { &format!("{open} polyhedra are") };
    (open > 0).then(|| {
        format!("{polyhedra} not closed: drawn is what lies between the faces and their middle")
    })
}

/// What becomes of cells that are said to be nothing.
pub(super) fn empty_cells(types: &[u8]) -> Option<String> {
    let empty = types.iter().filter(|kind| **kind == kind::EMPTY).count();
    (empty > 0).then(|| {
        let verb = if empty == 1 { "is" } else { "are" };
        format!("{} {verb} empty (VTK's type 0): left out", counted(empty, "cell"))
    })
}

/// What becomes of points that lie nowhere, where no cell has them as corners, or only as points by themselves.
pub(super) fn nowhere(listing: &Listing) -> Option<String> {
    let count = listing.points.iter().filter(|point| !point.is_finite()).count();
    let are_alone = listing.types.iter().all(|kind| *kind <= kind::POLY_VERTEX);
    (count > 0 && are_alone).then(|| {
        let verb = if count == 1 { "lies" } else { "lie" };
        format!("{} {verb} nowhere (NaN or infinite): left out", counted(count, "point"))
    })
}

/// Whether there are cells, and each has a corner that lies nowhere.
pub(super) fn lie_nowhere(listing: &Listing) -> bool {
    let lies_nowhere = |cell: &[usize]| {
        let own = listing.corners.get(cell[0]..cell[1]).unwrap_or_default();
        own.iter().any(|corner| {
            listing.points.get(*corner as usize).is_some_and(|point| !point.is_finite())
        })
    };
    !listing.types.is_empty() && listing.starts.windows(2).all(lies_nowhere)
}

/// Of pictures that frame them, things that are so many times longer than wide are thinner than a pixel.
pub(in super::super) const THINNER_THAN_A_PIXEL: f64 = 2000.0;

/// That cells are seen as no more than a few pixels at first, where they are very thin all together.
pub(super) fn thin(cells: &Cells) -> Option<String> {
    let [low, high] = cells.bounds();
    let mut extents = (high - low).to_array();
    extents.sort_by(f64::total_cmp);
    let [_, wide, long] = extents;
    let have_extent = !cells.solids().is_empty() || cells.is_surface();
    (have_extent && wide * THINNER_THAN_A_PIXEL < long).then(|| {
        format!(
            "the cells are {} long and {} wide, thinner than a pixel of a picture of them all: zoom in to see them",
            in_short(long),
            in_short(wide)
        )
    })
}

/// A length in three digits.
pub(in super::super) fn in_short(length: f64) -> String {
    match (1e-3..1e4).contains(&length) || length == 0.0 {
        true => format!("{length:.3}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => format!("{length:.2e}"),
    }
}

/// That points are drawn by themselves, where a file of cells has none that is drawn.
pub(in super::super) fn points_alone(grid: &Grid) -> Option<String> {
    let Shape::Unstructured(cells) = &grid.shape else { return None };
    let census = cells.census();
    if !cells.solids().is_empty() || cells.is_surface() {
        return None;
    }
    let are_points = census.by_type.keys().all(|kind| *kind <= kind::POLY_VERTEX);
    let why = match cells.own_cells() {
        0 => "the file has no cells",
        all if census.not_finite == all => "all cells of the file have corners that lie nowhere",
        _ if are_points => return None,
        _ => "the file has no cells with volume or area",
    };
    Some(format!("{why}: its points are drawn by themselves"))
}

/// What becomes of points where others are.
pub(super) fn coincident(points: &[DVec3]) -> Option<String> {
    let bits = |point: &DVec3| point.to_array().map(|x| (x + 0.0).to_bits());
    let mut all: Vec<[u64; 3]> = points.iter().filter(|p| p.is_finite()).map(bits).collect();
    let count = all.len();
    all.sort_unstable();
    all.dedup();
    let doubles = count - all.len();
    (doubles > 0).then(|| {
        format!(
            "{doubles} of {} lie where others are: those at one place are drawn as one, with the mean of their values",
            counted(count, "point")
        )
    })
}

/// Gives arrays of one name on the same places names of their own.
pub(in super::super) fn tell_apart(fields: &mut [Field], warnings: &mut Vec<String>) {
    for at in 1..fields.len() {
        let (before, rest) = fields.split_at_mut(at);
        let field = &mut rest[0];
        let same =
            |other: &&Field| other.name == field.name && other.association == field.association;
        let name = field.name.clone();
        if before.iter().any(|other| same(&other)) {
            let is_taken = |new: &String| before.iter().any(|other| other.name == *new);
            let new = (2..).map(|n| format!("{name} {n}")).find(|new| !is_taken(new));
            field.name = new.unwrap_or(name.clone());
            warnings.push(format!(
                "several arrays are called {}: one of them is {} here",
                quoted(&name),
                quoted(&field.name)
            ));
        }
    }
}

/// A field for points without any.
pub(super) fn density(points: &[DVec3], warnings: &mut Vec<String>) -> Field {
    let name = "log10 density";
    warnings.push(format!(
        "the file has no array of numbers: how dense its points lie stands in as the field {name:?}, the decimal logarithm of \
         points per unit of volume"
    ));
    let samples = Arc::new(Samples::Float64(log_densities(points)));
    Field { name: name.into(), components: 1, association: Association::Point, samples }
}

/// A field for files of cells without any: the cells' numbers, or the points' where there are no cells.
pub(super) fn numbers(points: usize, cells: usize, warnings: &mut Vec<String>) -> Field {
    let (name, association, count) = match cells {
        0 => ("point", Association::Point, points),
        _ => ("cell", Association::Cell, cells),
    };
    warnings.push(format!(
        "the file has no array of numbers: the numbers of its {name}s stand in as the field {name:?}"
    ));
    #[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32")]
    let samples = Samples::UInt32((0..count as u32).collect());
    Field { name: name.into(), components: 1, association, samples: Arc::new(samples) }
}

/// The edges of a curved cell, by the corners that each goes between, with the number of the first point on them, and how many
/// each has; none of straight ones. By VTK's number, and how many points a cell has.
fn curved_edges(kind: u8, points: usize) -> (&'static [[usize; 2]], usize, usize) {
    const TETRAHEDRON: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
    const PYRAMID: [[usize; 2]; 8] =
        [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];
    const WEDGE: [[usize; 2]; 9] =
        [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
    // As Lagrange's go along the axes.
    const HEXAHEDRON: [[usize; 2]; 12] = [
        [0, 1],
        [1, 2],
        [3, 2],
        [0, 3],
        [4, 5],
        [5, 6],
        [7, 6],
        [4, 7],
        [0, 4],
        [1, 5],
        [2, 6],
        [3, 7],
    ];
    let order_of = |all: fn(usize) -> usize| (2..=10).find(|order| all(*order) == points);
    let on_each = |all: fn(usize) -> usize| order_of(all).map_or(0, |order| order - 1);
    match kind {
        69 => (&TETRAHEDRON[..3], 3, on_each(|n| (n + 1) * (n + 2) / 2)),
        70 => (&HEXAHEDRON[..4], 4, on_each(|n| (n + 1).pow(2))),
        24 => (&TETRAHEDRON, 4, 1),
        25 | 29 => (&HEXAHEDRON, 8, 1),
        26 | 32 => (&WEDGE, 6, 1),
        27 => (&PYRAMID, 5, 1),
        31 => (&WEDGE[..6], 6, 1),
        71 => (&TETRAHEDRON, 4, on_each(|n| (n + 1) * (n + 2) * (n + 3) / 6)),
        72 => (&HEXAHEDRON, 8, on_each(|n| (n + 1).pow(3))),
        73 => (&WEDGE, 6, on_each(|n| (n + 1) * (n + 1) * (n + 2) / 2)),
        _ => (&[], 0, 0),
    }
}

/// Of the edges of all curved cells, every three points that follow each other; those that cells share once.
fn edges_of(listing: &Listing) -> Vec<[usize; 3]> {
    let mut all: Vec<[usize; 3]> = Vec::new();
    for (cell, kind) in listing.types.iter().enumerate() {
        let own = listing.corners.get(listing.starts[cell]..listing.starts[cell + 1]);
        let own = own.unwrap_or_default();
        let (edges, first, each) = curved_edges(*kind, own.len());
        for (number, [a, b]) in edges.iter().enumerate() {
            let inner = (0..each).map(|i| first + number * each + i);
            let line = std::iter::once(*a).chain(inner).chain([*b]).filter_map(|i| own.get(i));
            let line: Vec<usize> = line.map(|point| *point as usize).collect();
            let three = |own: &[usize]| [own[0].min(own[2]), own[1], own[0].max(own[2])];
            all.extend(line.windows(3).map(three));
        }
    }
    all.sort_unstable();
    all.dedup();
    all
}

/// How far the straight parts that curved cells are split into are off along their edges: there a quadratic function through
/// a, m and b differs from straight lines between these by |a − 2m + b| / 8 at most, and one of a higher order by about
/// that. Of the field that is off by the greatest part of its range.
pub(super) fn straightened(listing: &Listing, fields: &[Field]) -> Option<String> {
    let edges = edges_of(listing);
    if edges.is_empty() {
        return None;
    }
    let share = |field: &Field| -> f64 {
        let of = |i: usize| field.samples.get(i);
        let parts = (0..field.components).map(|c| {
            let at = |point: usize| of(point * field.components + c);
            let off = edges.iter().map(|&[a, m, b]| ((at(a) - 2.0 * at(m) + at(b)) / 8.0).abs());
            let off = off.filter(|off| off.is_finite()).fold(0.0, f64::max);
            let own = (0..field.samples.len() / field.components).map(at);
            let none = [f64::INFINITY, f64::NEG_INFINITY];
            let own = own.filter(|v| v.is_finite());
            let [low, high] = own.fold(none, |[low, high], v| [low.min(v), high.max(v)]);
            if high > low { off / (high - low) } else { 0.0 }
        });
        parts.fold(0.0, f64::max)
    };
    let on_points = fields.iter().filter(|field| field.association == Association::Point);
    let worst = on_points.map(|field| (share(field), field)).max_by(|a, b| a.0.total_cmp(&b.0));
    Some(match worst {
        Some((share, field)) if share > 0.0 => format!(
            "cells of curved functions are drawn as straight parts between all of their points: along edges {} is off by up to \
             {:.2} % of its range, within cells by up to about three times that",
            quoted(&field.name),
            100.0 * share
        ),
        _ => "cells of curved functions are drawn as straight parts between all of their points"
            .to_owned(),
    })
}
