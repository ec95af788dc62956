//! Labels: whole numbers that name things (a segmentation), as the surface of each of these.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DAffine3;

use super::error::{Problem, ReadError, unsupported};
use super::{OpenOptions, Opened};
use crate::core::Srgb8;
use crate::core::memory::{self, require};
use crate::core::progress::Ticket;
use crate::polygons::{Mesh, NOTHING, Nets};
use crate::volume::{Field, Grid, LabelName, Lattice, Scalar, Shape};
use crate::with_samples;

/// More things than this are measurements.
const MOST_LABELS: usize = 255;
/// More borders than this are noise, and take minutes: those of a dissected frog of 32 million samples are a tenth.
const MOST_FACES: u64 = 10_000_000;
/// What becomes of a border between two samples: its face, its triangles on both sides, and its part of the corners.
const BYTES_PER_FACE: u64 = 220;

/// One thing that samples are labelled with.
#[derive(Debug, Clone)]
pub struct Labelled {
    /// Its number.
    pub value: i64,
    /// The colour that the file gives it.
    pub colour: Option<Srgb8>,
    /// Its surface, called as it is.
    pub mesh: Mesh,
}

/// A file's labels in memory.
#[derive(Debug, Clone)]
pub struct OpenedLabels {
    /// At least one, in the order of their numbers.
    pub labels: Vec<Labelled>,
    /// The file.
    pub path: PathBuf,
    /// What was ignored or repaired, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads a volume of labels; 0 and NaN are nothing. `place` tells what takes the index of a sample of a lattice, in a space
/// that is called so, to the world that the surfaces are shown in, and what is to be said of that; `memory_limit_bytes` of
/// `None` is what the system says is free.
///
/// # Errors
/// What was expected, what was found and what to try, with the path last.
pub fn open(
    path: &Path,
    memory_limit_bytes: Option<u64>,
    place: impl Fn(&Lattice, Option<&str>) -> (DAffine3, Option<&'static str>),
    ticket: &Ticket,
) -> Result<OpenedLabels, ReadError> {
    let free_bytes = memory_limit_bytes.unwrap_or_else(memory::free_bytes);
    let options = OpenOptions { memory_limit_bytes: Some(free_bytes), ..OpenOptions::default() };
    let Opened { grid, mut warnings, .. } = super::open(path, &options, &ticket.part(0, 2))?;
    let labels = labelled_field(&grid).and_then(|field| {
        let (place, said) = place(&grid.lattice_of(field), grid.space.as_deref());
        warnings.extend(said.map(str::to_owned));
        surfaces(&grid, field, place, free_bytes, &ticket.part(1, 2))
    });
    let labels = labels.map_err(|problem| problem.at(path))?;
    Ok(OpenedLabels { labels, path: path.to_owned(), warnings })
}

fn labelled_field(grid: &Grid) -> Result<&Field, Problem> {
    if grid.shape != Shape::Affine {
        return Err(unsupported(
            "labels on an evenly spaced grid",
            format!("one that is {}", grid.shape.name()),
            "resample them",
        ));
    }
    let field = grid.field(None)?;
    if field.components > 1 && grid.label_names.is_empty() {
        return Err(unsupported(
            "one label a sample, or layers of them whose segments have names",
            format!("{} numbers a sample", field.components),
            "choose the file of a segmentation",
        ));
    }
    Ok(field)
}

fn surfaces(
    grid: &Grid,
    field: &Field,
    place: DAffine3,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Vec<Labelled>, Problem> {
    let layers = u32::try_from(field.components).unwrap_or(u32::MAX);
    let mut all = Vec::new();
    for component in 0..field.components {
        let part = ticket.part(u32::try_from(component).unwrap_or(0), layers);
        all.extend(layer(grid, field, component, place, free_bytes, &part)?);
    }
    match all.is_empty() {
        true => Err(unsupported("labels other than 0", "none", "choose another file")),
        false => Ok(all),
    }
}

/// What one number of each sample names.
fn layer(
    grid: &Grid,
    field: &Field,
    component: usize,
    place: DAffine3,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Vec<Labelled>, Problem> {
    let lattice = grid.lattice_of(field);
    require("the labels of the volume", 2 * lattice.len() as u64, free_bytes)?;
    let (values, numbers) = numbered(field, component)?;
    let faces = Nets::faces_of(lattice.dims, &numbers);
    if faces > MOST_FACES {
        return Err(unsupported(
            format!("labels with a border between {MOST_FACES} pairs of samples at most"),
            faces.to_string(),
            "smooth them, or choose a file that is no noise",
        ));
    }
    require("the surfaces of the labels", faces.saturating_mul(BYTES_PER_FACE), free_bytes)?;
    let nets = Nets::of(lattice.dims, &numbers, ticket)?;
    let surfaces = nets.surfaces(values.len() + 1).into_iter().skip(1);
    let labelled = values.iter().zip(surfaces).map(|(value, surface)| {
        let is_it = |name: &&LabelName| name.value == *value && name.component == component;
        let named = grid.label_names.iter().find(is_it);
        let name = named.map_or_else(|| format!("Label {value}"), |named| named.name.clone());
        let places: Vec<_> =
            surface.corners.iter().map(|corner| place.transform_point3(*corner)).collect();
        let mesh = Mesh::of_places(name, &places, Vec::new(), Vec::new(), surface.triangles);
        let mesh = mesh.map_err(super::mesh::no_mesh)?;
        Ok(Labelled { value: *value, colour: named.and_then(|named| named.colour), mesh })
    });
    labelled.collect()
}

/// The labels that there are, rising, and of each sample which of them it has, counted from 1, or [`NOTHING`].
fn numbered(field: &Field, component: usize) -> Result<(Vec<i64>, Vec<u16>), Problem> {
    with_samples!(&*field.samples, samples => {
        let of_component = || samples.iter().skip(component).step_by(field.components);
        let mut found = BTreeMap::new();
        let mut last = 0;
        for sample in of_component() {
            let (value, whole) = (sample.to_f64(), sample.to_i64());
            // Infinite numbers have no fraction, not even 0.
            if !value.is_nan() && value.fract() != 0.0 {
                return Err(not_labels(value.to_string()));
            }
            // Neighbours are mostly alike.
            if whole != last {
                last = whole;
                if whole == 0 {
                    continue;
                }
                found.insert(whole, NOTHING);
                if found.len() > MOST_LABELS {
                    return Err(not_labels(format!("more than {MOST_LABELS}")));
                }
            }
        }
        for (number, at) in (1..).zip(found.values_mut()) {
            *at = number;
        }
        let mut last = (0, NOTHING);
        let number = |sample: &_| {
            let whole = Scalar::to_i64(*sample);
            if whole != last.0 {
                last = (whole, found.get(&whole).copied().unwrap_or(NOTHING));
            }
            last.1
        };
        let numbers = of_component().map(number).collect();
        Ok((found.into_keys().collect(), numbers))
    })
}

fn not_labels(found: String) -> Problem {
    unsupported(
        format!("labels, which are at most {MOST_LABELS} different whole numbers"),
        found,
        "choose the file of a segmentation, or open this one as a volume",
    )
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::volume::{Association, Samples};

    fn field(components: usize, samples: Samples) -> Field {
        let association = Association::Point;
        Field { name: "labels".into(), components, association, samples: Arc::new(samples) }
    }

    #[test]
    fn labels_are_numbered_as_they_rise_and_0_and_nan_are_nothing() {
        let floats = Samples::Float32(vec![3.0, 0.0, f32::NAN, -2.0, 3.0, 70_000.0]);
        let (values, numbers) = numbered(&field(1, floats), 0).unwrap();
        assert_eq!((values, numbers), (vec![-2, 3, 70_000], vec![2, 0, 0, 1, 2, 3]));
        // Each number of a sample by itself.
        let pairs = field(2, Samples::UInt8(vec![1, 9, 0, 9, 2, 0]));
        assert_eq!(numbered(&pairs, 0).unwrap(), (vec![1, 2], vec![1, 0, 2]));
        assert_eq!(numbered(&pairs, 1).unwrap(), (vec![9], vec![1, 1, 0]));
    }

    #[test]
    fn measurements_are_no_labels() {
        for samples in [
            Samples::Float64(vec![0.0, 1.0, 1.5]),
            Samples::Float64(vec![0.5]),
            Samples::Float32(vec![1.0, f32::INFINITY]),
            Samples::UInt16((0..=256).collect()),
        ] {
            let refused = numbered(&field(1, samples), 0).unwrap_err().to_string();
            assert!(refused.starts_with("expected labels, which are at most 255"), "{refused}");
        }
        assert!(numbered(&field(1, Samples::UInt16((0..=255).collect())), 0).is_ok());
    }
}
