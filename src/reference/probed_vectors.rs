//! What a probe finds of vectors: the nearest one, and where those that are shown alone are first seen.

use glam::DVec3;
use serde::Serialize;

use super::inside::{Met, Surface};
use super::line::voxel_span;
use super::sources::Line;
use super::splats::{quantity, slimmed};
use crate::scene::{Scene, VectorLayer};
use crate::transfer::extinction_from_opacity;
use crate::vector::VectorSettings;
use crate::volume::{Places, ScalarVolume, VectorField};

/// Where a vector is in its field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum VectorPlace {
    /// In the field's grid.
    Index([usize; 3]),
    /// In this one of the file's cells.
    Cell(u32),
}

/// A vector of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ProbedVector {
    /// Where it is in the field.
    #[serde(flatten)]
    pub place: VectorPlace,
    /// World position.
    pub world: DVec3,
    /// World components; NaN where there is no data.
    pub vector: DVec3,
    /// Its length.
    pub length: f64,
}

/// The vector nearest to a place, in steps of the grid there; `None` more than half a step beside the grid. Of vectors on
/// cells that at the place itself; `None` outside the cells.
pub(super) fn nearest(field: &VectorField, world: DVec3) -> Option<ProbedVector> {
    if let Some(cells) = &field.on_cells {
        let (vector, cell) = cells.at(world)?;
        let place = VectorPlace::Cell(cell);
        return Some(ProbedVector { place, world, vector, length: vector.length() });
    }
    // From a vector's own place, in its steps: within 0.5 along each axis is the box that is its own.
    let beside = |index: usize| {
        let (place, axes) = field.places.at(index);
        (axes.inverse() * (world - place)).abs().max_element()
    };
    let dims = field.places.dims();
    let index = match &field.places {
        Places::Lattice(lattice) => {
            let at = lattice.index_from_world(world);
            let high = DVec3::from(dims.map(|n| n as f64)) - 1.0;
            let [x, y, z] = at.clamp(DVec3::ZERO, high).round().to_array().map(|n| n as usize);
            (z * dims[1] + y) * dims[0] + x
        }
        Places::Points { points, .. } => {
            let apart = |&index: &usize| points[index].distance_squared(world);
            (0..points.len()).min_by(|a, b| apart(a).total_cmp(&apart(b)))?
        }
    };
    // Cells of uneven grids leave gaps between the boxes of their points.
    let most = if matches!(field.places, Places::Lattice(_)) { 0.5 + 1e-9 } else { 1.0 };
    (beside(index) <= most).then(|| {
        let [nx, ny, _] = dims;
        let vector = field.vectors[index].as_dvec3();
        ProbedVector {
            place: VectorPlace::Index([index % nx, index / nx % ny, index / (nx * ny)]),
            world: field.places.at(index).0,
            vector,
            length: vector.length(),
        }
    })
}

/// A box of a vector along a ray.
struct Box {
    enter: f64,
    leave: f64,
    /// Per world unit.
    extinction: f64,
}

/// The boxes that a ray passes of vectors with opacity.
fn boxes(
    field: &VectorField,
    settings: &VectorSettings,
    (scalar, unit_distance): (Option<&ScalarVolume>, f64),
    ray: &Line,
) -> Vec<Box> {
    let of = |index: usize| {
        let vector = field.vectors[index].as_dvec3();
        let (place, steps) = field.places.at(index);
        let (axes, share) = slimmed(steps);
        let inverse = axes.inverse();
        let [enter, leave] = voxel_span(inverse * (ray.start - place), inverse * ray.step)?;
        let by = quantity(settings.opacity_by, vector, place, scalar);
        let opacity = settings.transfer.opacity_at(by);
        let extinction =
            extinction_from_opacity(opacity) / (unit_distance * share) * ray.step.length();
        let is_seen = vector.is_finite() && opacity > 0.0 && leave > ray.from;
        is_seen.then(|| Box { enter: enter.max(ray.from), leave, extinction })
    };
    (0..field.vectors.len()).filter_map(of).collect()
}

/// Where a ray past vectors alone, each as dense in the box about it as its opacity says and without marks,
/// first has gathered `share`, and in or on what; else all that it gathers. Surfaces are sorted.
pub(super) fn first_seen(
    scene: &Scene,
    ray: &Line,
    surfaces: &[Surface],
    share: f64,
) -> Result<(f64, Met), f64> {
    let beside = (scene.volume().map(|volume| &**volume), scene.opacity_unit_distance());
    let layers = scene.vectors().into_iter();
    let of = |layer: VectorLayer| boxes(&layer.field, &layer.settings, beside, ray);
    let mut boxes: Vec<Box> = layers.flat_map(of).collect();
    boxes.sort_by(|p, q| p.enter.total_cmp(&q.enter));
    let mut places: Vec<f64> = boxes.iter().flat_map(|b| [b.enter, b.leave]).collect();
    places.extend(surfaces.iter().map(|surface| surface.t));
    places.sort_by(f64::total_cmp);
    let mut surfaces = surfaces.iter().peekable();
    let (mut next, mut active) = (0, Vec::<&Box>::new());
    let mut left = 1.0;
    for (i, &from) in places.iter().enumerate() {
        while let Some(surface) = surfaces.next_if(|surface| surface.t <= from) {
            left *= 1.0 - surface.opacity;
            if 1.0 - left >= share {
                return Ok((surface.t, surface.of));
            }
        }
        let Some(&to) = places.get(i + 1).filter(|to| **to > from) else { continue };
        let middle = f64::midpoint(from, to);
        while let Some(of) = boxes.get(next).filter(|of| of.enter < middle) {
            active.push(of);
            next += 1;
        }
        active.retain(|of| of.leave > middle);
        let extinction: f64 = active.iter().map(|of| of.extinction).sum();
        let behind = left * (-extinction * (to - from)).exp();
        if 1.0 - behind >= share {
            return Ok((from + (left / (1.0 - share)).ln() / extinction, Met::Vectors));
        }
        left = behind;
    }
    Err(1.0 - left)
}
