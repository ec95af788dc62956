//! Slices into volumes: where they lie along their normal, which are at one place, and what is missing.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::error::{Problem, unsupported};
use super::slices::{Frame, Slices};
use crate::volume::{Lattice, Shape};

/// Steps of neighbours that differ by less than this share of them are even.
const EVEN: f64 = 0.01;
/// Slices lean against their normal from this angle on, degrees.
const LEANS: f64 = 0.05;

/// A frame of one of several files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) file: usize,
    pub(super) frame: usize,
}

/// Volumes at one place, each of as many frames, and how these lie.
pub(super) struct Stack {
    /// Of each time step, the frames along z.
    pub(super) steps: Vec<Vec<Place>>,
    /// All frames at each place along z: those of segmentations overlie one another.
    pub(super) heights: Vec<Vec<Place>>,
    pub(super) lattice: Lattice,
    /// Other than evenly spaced, where slices are missing or lie anyhow.
    pub(super) shape: Shape,
    pub(super) is_placed: bool,
}

/// A frame, and how far along the normal it lies.
struct Along<'a> {
    place: Place,
    frame: &'a Frame,
    height: f64,
}

/// Puts the frames of a series in order.
///
/// # Errors
/// No frames.
pub(super) fn stack(files: &[Slices], warnings: &mut Vec<String>) -> Result<Stack, Problem> {
    let places = files.iter().enumerate().flat_map(|(file, slices)| {
        (0..slices.frames.len()).map(move |frame| Place { file, frame })
    });
    let of = |place: &Place| &files[place.file].frames[place.frame];
    let all: Vec<Place> = places.collect();
    let is_placed = |place: &Place| of(place).position.is_some() && of(place).orientation.is_some();
    let (placed, rest): (Vec<Place>, Vec<Place>) = all.iter().copied().partition(is_placed);
    if placed.is_empty() {
        return unplaced(files, rest, warnings);
    }
    if !rest.is_empty() {
        warnings
            .push(format!("{} pictures that do not say where they lie are left out", rest.len()));
    }
    let main = of_one_plane(files, placed, warnings);
    let Some(first) = main.first().map(of) else { return Err(nothing()) };
    let [x, y] = first.orientation.unwrap_or([DVec3::X, DVec3::Y]);
    let normal = x.cross(y).normalize();
    let mut along: Vec<Along<'_>> = main
        .into_iter()
        .map(|place| {
            let frame = of(&place);
            Along { place, frame, height: frame.position.unwrap_or_default().dot(normal) }
        })
        .collect();
    along.sort_by(|a, b| a.height.total_cmp(&b.height).then(a.frame.order.cmp(&b.frame.order)));
    let heights = at_one_height(along);
    let steps = match first.segment {
        // Frames of other segments are no volumes of their own.
        Some(_) => vec![heights.iter().map(|group| group[0].place).collect()],
        None => steps(&heights, warnings),
    };
    let heights = heights.iter().map(|group| group.iter().map(|one| one.place).collect()).collect();
    let [row_spacing, column_spacing] = spacing(first, warnings);
    let lattice = Lattice {
        dims: [
            files[steps[0][0].file].form.columns,
            files[steps[0][0].file].form.rows,
            steps[0].len(),
        ],
        spacing: DVec3::new(row_spacing, column_spacing, 1.0),
        origin: of(&steps[0][0]).position.unwrap_or_default(),
        direction: DMat3::from_cols(x, y, normal),
    };
    let positions: Vec<DVec3> =
        steps[0].iter().map(|place| of(place).position.unwrap_or_default()).collect();
    let thickness = Some(first.thickness).filter(|t| *t > 0.0).unwrap_or(1.0);
    let (lattice, shape) = spread(lattice, &positions, thickness, warnings);
    Ok(Stack { steps, heights, lattice, shape, is_placed: true })
}

fn nothing() -> Problem {
    unsupported("a series with pictures", "none", "choose another file")
}

/// Distances of pixels along rows and down columns.
fn spacing(frame: &Frame, warnings: &mut Vec<String>) -> [f64; 2] {
    if frame.spacing[0] > 0.0 {
        return frame.spacing;
    }
    warnings.push("nothing tells the distance of pixels: 1 mm is used".into());
    [1.0; 2]
}

/// Pictures that do not say where they lie, in the order of their numbers.
fn unplaced(
    files: &[Slices],
    mut places: Vec<Place>,
    warnings: &mut Vec<String>,
) -> Result<Stack, Problem> {
    let of = |place: &Place| &files[place.file].frames[place.frame];
    places.sort_by_key(|place| of(place).order);
    let form = |place: &Place| &files[place.file].form;
    let Some(&first) = places.first() else { return Err(nothing()) };
    let before = places.len();
    places.retain(|place| form(place) == form(&first));
    if places.len() < before {
        warnings.push(format!("{} pictures of another size are left out", before - places.len()));
    }
    let [x, y] = spacing(of(&first), warnings);
    let told = of(&first).thickness;
    if places.len() > 1 {
        let used = if told > 0.0 {
            "they are as far apart as they are thick"
        } else {
            "they are 1 mm apart"
        };
        warnings.push(format!(
            "the {} pictures do not say where they lie: they are stacked in their order, and {used}",
            places.len()
        ));
    }
    let lattice = Lattice {
        dims: [form(&first).columns, form(&first).rows, places.len()],
        spacing: DVec3::new(x, y, if told > 0.0 { told } else { 1.0 }),
        origin: DVec3::ZERO,
        // Rows go down.
        direction: DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::Z),
    };
    let heights = places.iter().map(|place| vec![*place]).collect();
    let steps = vec![places];
    Ok(Stack { steps, heights, lattice, shape: Shape::Affine, is_placed: false })
}

/// The frames of the orientation, size and spacing that most have.
fn of_one_plane(files: &[Slices], placed: Vec<Place>, warnings: &mut Vec<String>) -> Vec<Place> {
    let of = |place: &Place| &files[place.file].frames[place.frame];
    let alike = |a: &Place, b: &Place| {
        let near = |a: DVec3, b: DVec3| a.dot(b) > 0.9999;
        let planes = [of(a).orientation, of(b).orientation];
        let [Some(p), Some(q)] = planes else { return false };
        let same_spacing = (0..2).all(|axis| {
            let [s, t] = [of(a).spacing[axis], of(b).spacing[axis]];
            (s - t).abs() <= 1e-3 * s.max(t)
        });
        near(p[0], q[0])
            && near(p[1], q[1])
            && same_spacing
            && files[a.file].form == files[b.file].form
    };
    let mut groups: Vec<Vec<Place>> = Vec::new();
    for place in placed {
        match groups.iter_mut().find(|group| alike(&group[0], &place)) {
            Some(group) => group.push(place),
            None => groups.push(vec![place]),
        }
    }
    // The first of those that have most.
    let most = groups.iter().map(Vec::len).max().unwrap_or_default();
    let at = groups.iter().position(|group| group.len() == most).unwrap_or_default();
    let left: usize = groups.iter().map(Vec::len).sum::<usize>() - most;
    if left > 0 {
        let slices =
            if left == 1 { "1 slice lies".to_owned() } else { format!("{left} slices lie") };
        warnings.push(format!(
            "{slices} in another plane than the {most} that are shown, or differ in size, and are left out"
        ));
    }
    groups.into_iter().nth(at).unwrap_or_default()
}

/// Frames in groups of one height each, from the lowest up.
fn at_one_height(along: Vec<Along<'_>>) -> Vec<Vec<Along<'_>>> {
    let range = match (along.first(), along.last()) {
        (Some(first), Some(last)) => last.height - first.height,
        _ => 0.0,
    };
    let near = 1e-3_f64.max(1e-4 * range / along.len().max(1) as f64);
    let mut groups: Vec<Vec<Along<'_>>> = Vec::new();
    for one in along {
        match groups.last_mut() {
            Some(group) if one.height - group[0].height <= near => group.push(one),
            _ => groups.push(vec![one]),
        }
    }
    for group in &mut groups {
        group.sort_by_key(|one| one.frame.order);
    }
    groups
}

/// As many volumes as there are frames at every height.
fn steps(heights: &[Vec<Along<'_>>], warnings: &mut Vec<String>) -> Vec<Vec<Place>> {
    let fewest = heights.iter().map(Vec::len).min().unwrap_or_default();
    let surplus: usize = heights.iter().map(|group| group.len() - fewest).sum();
    if surplus > 0 {
        let slices = |one: &str, many: &str| match surplus {
            1 => format!("1 slice {one}"),
            n => format!("{n} slices {many}"),
        };
        warnings.push(match fewest {
            1 => format!(
                "{} where others do: the first of each place is shown",
                slices("lies", "lie")
            ),
            _ => format!("{} of a volume that is not whole: left out", slices("is", "are")),
        });
    }
    let step = |index: usize| heights.iter().map(|group| group[index].place).collect();
    (0..fewest).map(step).collect()
}

/// The lattice whose third axis goes through the slices' places; and true places where these are not evenly spaced.
fn spread(
    mut lattice: Lattice,
    positions: &[DVec3],
    thickness: f64,
    warnings: &mut Vec<String>,
) -> (Lattice, Shape) {
    let (Some(first), Some(last)) = (positions.first(), positions.last()) else {
        return (lattice, Shape::Affine);
    };
    let normal = lattice.direction.z_axis;
    if positions.len() == 1 {
        lattice.spacing.z = thickness;
        return (lattice, Shape::Affine);
    }
    let count = (positions.len() - 1) as f64;
    let step = (*last - *first) / count;
    lattice.spacing.z = step.length();
    lattice.direction.z_axis = step / step.length();
    let angle = step.normalize().dot(normal).clamp(-1.0, 1.0).acos().to_degrees();
    if angle > LEANS {
        warnings.push(format!(
            "the slices lean by {angle:.1}° against their normal (a tilted gantry): the volume is shown sheared, as \
             they lie"
        ));
    }
    let off =
        |(index, position): (usize, &DVec3)| (*position - (*first + step * index as f64)).length();
    let worst = positions.iter().enumerate().map(off).fold(0.0, f64::max);
    if worst <= EVEN * step.length() + 2e-3 {
        return (lattice, Shape::Affine);
    }
    let gaps: Vec<f64> = positions.windows(2).map(|pair| (pair[1] - pair[0]).dot(normal)).collect();
    let (least, most) =
        gaps.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), g| (a.min(*g), b.max(*g)));
    let mut said = format!("the slices are from {least:.4} to {most:.4} mm apart");
    // Whole steps that nothing lies at.
    let missing: f64 = gaps.iter().map(|gap| (gap / least).round() - 1.0).sum();
    let is_whole = gaps.iter().all(|gap| (gap / least - (gap / least).round()).abs() < 0.05);
    if is_whole && missing >= 1.0 {
        said = format!("{said}, as if {missing} of them were missing");
    }
    let axes = [lattice.direction.x_axis, lattice.direction.y_axis, normal];
    let is_along_world =
        axes.iter().zip([DVec3::X, DVec3::Y, DVec3::Z]).all(|(a, w)| a.dot(w) > 1.0 - 1e-9);
    if is_along_world && angle <= LEANS {
        let even = |axis: usize| -> Arc<[f64]> {
            let (start, step) = (lattice.origin[axis], lattice.spacing[axis]);
            (0..lattice.dims[axis]).map(|i| start + step * i as f64).collect()
        };
        let heights = positions.iter().map(|p| p.z).collect();
        warnings.push(format!("{said}: each is shown where it lies"));
        return (lattice, Shape::Rectilinear([even(0), even(1), heights]));
    }
    warnings.push(format!(
        "{said}: they are shown evenly spaced, at most {worst:.3} mm from where they lie"
    ));
    (lattice, Shape::Affine)
}
