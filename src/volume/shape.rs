//! Grids that are not evenly spaced: where their points lie, and what steps lead from one to the next.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Lattice, VolumeError};
use crate::cells::Cells;
use crate::core::{parallel, plain_number};

/// Points that lie this far from a lattice's, in steps of it, lie on it: the digits that texts and
/// 32-bit floats keep of evenly spaced points leave less.
const ON_LATTICE_STEPS: f64 = 1e-4;
/// An axis whose part away from the others is shorter than this share of it is replaced.
const LEAST_SLANT: f64 = 0.02;

/// How the points of a grid lie.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Shape {
    /// On the grid's lattice.
    #[default]
    Affine,
    /// At every combination of three lists of world coordinates x, y, z, each rising or falling.
    Rectilinear([Arc<[f64]>; 3]),
    /// At world positions of their own, x fastest.
    Curvilinear(Arc<[DVec3]>),
    /// At world positions of their own, and cells between them that lie in no order.
    Unstructured(Arc<Cells>),
}

impl Shape {
    /// The word that `info` and scripts use.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Affine => "grid",
            Self::Rectilinear(_) => "rectilinear",
            Self::Curvilinear(_) => "curvilinear",
            Self::Unstructured(_) => "unstructured",
        }
    }

    /// # Errors
    /// Coordinates that are too few or too many for `dims`, not finite, or repeated; points that all
    /// lie in one place.
    pub fn check(&self, dims: [usize; 3]) -> Result<(), VolumeError> {
        let size = |what: &str, expected: usize, found: usize| {
            (expected == found).then_some(()).ok_or_else(|| VolumeError::Size {
                what: what.to_owned(),
                expected: expected.to_string(),
                found,
            })
        };
        match self {
            Self::Affine => Ok(()),
            Self::Rectilinear(axes) => {
                for ((list, n), axis) in axes.iter().zip(dims).zip(["x", "y", "z"]) {
                    size(&format!("the coordinates along {axis}"), n, list.len())?;
                    check_list(list, axis)?;
                }
                Ok(())
            }
            Self::Curvilinear(points) => {
                size("the points of the grid", dims.iter().product(), points.len())?;
                if let Some(at) = points.iter().position(|point| !point.is_finite()) {
                    return Err(uneven(format!("{:?} for point {at}", points[at].to_array())));
                }
                let [low, high] = bounds(points);
                if points.len() > 1 && low == high {
                    return Err(uneven(format!("all of them at {:?}", low.to_array())));
                }
                Ok(())
            }
            Self::Unstructured(_) => Ok(()),
        }
    }

    /// The shape of the cells' middles: one fewer along each axis, at least one.
    #[must_use]
    pub(super) fn cells(&self, dims: [usize; 3]) -> Self {
        match self {
            Self::Affine => Self::Affine,
            Self::Unstructured(cells) => Self::Unstructured(Arc::clone(cells)),
            Self::Rectilinear(axes) => Self::Rectilinear(axes.each_ref().map(|list| {
                if list.len() < 2 {
                    return Arc::clone(list);
                }
                list.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0).collect()
            })),
            Self::Curvilinear(points) => {
                let cells = dims.map(|n| n.saturating_sub(1).max(1));
                let middle = |cell: usize| {
                    let mut sum = DVec3::ZERO;
                    for corner in corners(dims, voxel(cells, cell)) {
                        sum += points[corner];
                    }
                    sum / 8.0
                };
                let count = cells.iter().product::<usize>();
                Self::Curvilinear(parallel::list(count, middle).into())
            }
        }
    }

    /// The lattice on whose points these lie; `None` where they lie beside every lattice's. Affine
    /// grids have their own.
    pub(super) fn even(&self, dims: [usize; 3]) -> Option<Lattice> {
        match self {
            Self::Affine | Self::Unstructured(_) => None,
            Self::Rectilinear(axes) => {
                let mut lattice = Lattice::unit(dims);
                for (axis, list) in axes.iter().enumerate() {
                    let last = list.len() - 1;
                    lattice.origin[axis] = list[0];
                    if last == 0 {
                        continue;
                    }
                    let step = (list[last] - list[0]) / last as f64;
                    let is_even = list.iter().enumerate().all(|(i, value)| {
                        (list[0] + step * i as f64 - value).abs() <= ON_LATTICE_STEPS * step.abs()
                    });
                    if !is_even {
                        return None;
                    }
                    lattice.spacing[axis] = step;
                }
                set_missing_spacing(&mut lattice, dims);
                Some(lattice)
            }
            Self::Curvilinear(points) => even_points(points, dims),
        }
    }

    /// A lattice of as many points over the same box, for what needs no more than that.
    pub fn outline(&self, dims: [usize; 3]) -> Lattice {
        let [low, high] = match self {
            Self::Affine => return Lattice::unit(dims),
            Self::Rectilinear(axes) => {
                let end = |pick: fn(f64, f64) -> f64| {
                    DVec3::from_array(
                        axes.each_ref().map(|list| pick(list[0], list[list.len() - 1])),
                    )
                };
                [end(f64::min), end(f64::max)]
            }
            Self::Curvilinear(points) => bounds(points),
            Self::Unstructured(cells) => cells.bounds(),
        };
        let mut lattice = Lattice { origin: low, ..Lattice::unit(dims) };
        let extent = high - low;
        let largest = extent.max_element();
        for axis in 0..3 {
            let steps = dims[axis].saturating_sub(1).max(1) as f64;
            // Flat grids get a depth as of one of their cells.
            let of_axis = if extent[axis] > 0.0 { extent[axis] } else { largest / 100.0 };
            lattice.spacing[axis] = if of_axis > 0.0 { of_axis / steps } else { 1.0 };
        }
        lattice
    }

    /// World position of each point, x fastest; empty for affine grids.
    pub(super) fn points(&self, dims: [usize; 3]) -> Arc<[DVec3]> {
        match self {
            Self::Affine => Arc::from([]),
            Self::Rectilinear([x, y, z]) => {
                let at = |index| {
                    let [i, j, k] = voxel(dims, index);
                    DVec3::new(x[i], y[j], z[k])
                };
                parallel::list(dims.iter().product(), at).into()
            }
            Self::Curvilinear(points) => Arc::clone(points),
            Self::Unstructured(cells) => cells.points()[..cells.own_points()].into(),
        }
    }
}

fn uneven(found: String) -> VolumeError {
    VolumeError::Uneven { found }
}

fn check_list(list: &[f64], axis: &str) -> Result<(), VolumeError> {
    if let Some(value) = list.iter().find(|value| !value.is_finite()) {
        return Err(uneven(format!("{} along {axis}", plain_number(*value))));
    }
    let rises = list.len() < 2 || list[1] > list[0];
    let wrong =
        list.windows(2).find(|pair| if rises { pair[0] >= pair[1] } else { pair[0] <= pair[1] });
    match wrong {
        None => Ok(()),
        Some(pair) => Err(uneven(format!(
            "{} after {} along {axis}",
            plain_number(pair[1]),
            plain_number(pair[0])
        ))),
    }
}

/// Least and greatest coordinates.
pub(super) fn bounds(points: &[DVec3]) -> [DVec3; 2] {
    let none = || [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let wider = |a: [DVec3; 2], b: [DVec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    parallel::merged(points.len(), none, |at| [points[at]; 2], wider)
}

/// Index along x, y, z.
pub(super) fn voxel(dims: [usize; 3], index: usize) -> [usize; 3] {
    let [nx, ny, _] = dims;
    [index % nx, index / nx % ny, index / (nx * ny)]
}

/// Point numbers of a cell's eight corners, x fastest; along axes of one point both are that one.
pub(super) fn corners(dims: [usize; 3], [i, j, k]: [usize; 3]) -> [usize; 8] {
    let [nx, ny, nz] = dims;
    let next = |at: usize, n: usize| (at + 1).min(n - 1);
    let mut corners = [0; 8];
    for (corner, number) in corners.iter_mut().enumerate() {
        let x = if corner & 1 == 0 { i } else { next(i, nx) };
        let y = if corner & 2 == 0 { j } else { next(j, ny) };
        let z = if corner & 4 == 0 { k } else { next(k, nz) };
        *number = (z * ny + y) * nx + x;
    }
    corners
}

fn even_points(points: &[DVec3], dims: [usize; 3]) -> Option<Lattice> {
    let [nx, ny, _] = dims;
    let strides = [1, nx, nx * ny];
    let mut steps = [None; 3];
    for axis in 0..3 {
        let last = dims[axis] - 1;
        if last > 0 {
            steps[axis] = Some((points[strides[axis] * last] - points[0]) / last as f64);
        }
    }
    let axes = usable_axes(steps, 1.0);
    let lengths = DVec3::from_array(axes.map(DVec3::length));
    let mut lattice = Lattice::unit(dims);
    lattice.origin = points[0];
    lattice.spacing = lengths;
    lattice.direction =
        DMat3::from_cols(axes[0] / lengths.x, axes[1] / lengths.y, axes[2] / lengths.z);
    let most = ON_LATTICE_STEPS * lengths.min_element();
    let is_on = |(index, point): (usize, &DVec3)| {
        let at = DVec3::from(voxel(dims, index).map(|i| i as f64));
        (lattice.world_from_index(at) - *point).length() <= most
    };
    points.iter().enumerate().all(is_on).then_some(lattice)
}

/// Axes of one sample get the mean of the others' spacings.
fn set_missing_spacing(lattice: &mut Lattice, dims: [usize; 3]) {
    let known: Vec<f64> =
        (0..3).filter(|&axis| dims[axis] > 1).map(|axis| lattice.spacing[axis].abs()).collect();
    if known.is_empty() {
        return;
    }
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    for (axis, n) in dims.into_iter().enumerate() {
        if n == 1 {
            lattice.spacing[axis] = mean;
        }
    }
}

/// Three independent axes from the steps along them: what is missing, of no length, or (nearly) in the
/// plane of longer ones is replaced by a perpendicular, of the length of the others' mean, or of
/// `length` where nothing tells one.
pub(super) fn usable_axes(steps: [Option<DVec3>; 3], length: f64) -> [DVec3; 3] {
    let lengths = steps.map(|step| step.map_or(0.0, DVec3::length));
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| lengths[b].total_cmp(&lengths[a]));
    let mut axes = [DVec3::ZERO; 3];
    let mut units: Vec<DVec3> = Vec::with_capacity(3);
    let mut bad = Vec::new();
    for axis in order {
        let Some(step) = steps[axis].filter(|_| lengths[axis] > 1e-9 * longest) else {
            bad.push(axis);
            continue;
        };
        // What the longer axes leave of this one.
        let left = units.iter().fold(step, |left, unit| left - *unit * left.dot(*unit));
        if left.length() < LEAST_SLANT * lengths[axis] {
            bad.push(axis);
            continue;
        }
        axes[axis] = step;
        units.push(left.normalize());
    }
    let good: Vec<f64> =
        (0..3).filter(|axis| !bad.contains(axis)).map(|axis| lengths[axis]).collect();
    let mean = if good.is_empty() { length } else { good.iter().sum::<f64>() / good.len() as f64 };
    bad.sort_unstable();
    for axis in bad {
        let unit = perpendicular(&units, axis);
        axes[axis] = unit * mean;
        units.push(unit);
    }
    axes
}

/// A unit vector perpendicular to fewer than three perpendicular units, as near to the world's axis as
/// they leave it.
fn perpendicular(units: &[DVec3], axis: usize) -> DVec3 {
    if let [a, b] = units {
        let normal = a.cross(*b).normalize();
        return if normal[axis] < 0.0 { -normal } else { normal };
    }
    let mut candidates = DVec3::AXES;
    candidates.rotate_left(axis);
    let rejected = candidates.map(|c| units.iter().fold(c, |c, unit| c - *unit * c.dot(*unit)));
    // One unit takes more than half of no more than one of three axes.
    let best = rejected.into_iter().find(|c| c.length() > 0.5).unwrap_or(candidates[0]);
    best.normalize()
}

/// World steps from each point to its neighbours along x, y, z as columns, invertible everywhere: half
/// the difference of the two beside it, at borders the difference to the only one. See [`usable_axes`].
pub(super) fn axes_of(points: &[DVec3], dims: [usize; 3]) -> Arc<[DMat3]> {
    let [nx, ny, _] = dims;
    let strides = [1, nx, nx * ny];
    let [low, high] = bounds(points);
    let samples = dims.into_iter().max().unwrap_or(1) as f64;
    let typical = (high - low).length() / samples;
    let typical = if typical > 0.0 { typical } else { 1.0 };
    let at = |index: usize| {
        let place = voxel(dims, index);
        let mut steps = [None; 3];
        for axis in 0..3 {
            let (i, last) = (place[axis], dims[axis] - 1);
            if last == 0 {
                continue;
            }
            let before = if i > 0 { index - strides[axis] } else { index };
            let after = if i < last { index + strides[axis] } else { index };
            let apart = if i > 0 && i < last { 2.0 } else { 1.0 };
            steps[axis] = Some((points[after] - points[before]) / apart);
        }
        DMat3::from_cols_array_2d(&usable_axes(steps, typical).map(|axis| axis.to_array()))
    };
    parallel::list(points.len(), at).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(values: &[f64]) -> Arc<[f64]> {
        values.into()
    }

    fn rectilinear(x: &[f64], y: &[f64], z: &[f64]) -> Shape {
        Shape::Rectilinear([list(x), list(y), list(z)])
    }

    /// Points of a map of index space.
    fn mapped(dims: [usize; 3], map: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let count = dims.iter().product::<usize>();
        (0..count).map(|i| map(DVec3::from(voxel(dims, i).map(|v| v as f64)))).collect()
    }

    #[test]
    fn even_coordinates_are_a_lattice_whichever_way_they_run_and_whatever_their_digits() {
        let x: Vec<f64> = (0..7).map(|i| f64::from(0.1_f32 * i as f32 - 3.0)).collect();
        let shape = rectilinear(&x, &[9.0, 7.0, 5.0], &[4.0]);
        let lattice = shape.even([7, 3, 1]).unwrap();
        assert!((lattice.spacing.x - 0.1).abs() < 1e-6, "{lattice:?}");
        assert_eq!((lattice.spacing.y, lattice.origin.y), (-2.0, 9.0));
        assert!((lattice.spacing.z - 1.05).abs() < 1e-6, "the mean of the others: {lattice:?}");
        assert!(rectilinear(&[0.0, 1.0, 2.001], &[0.0], &[0.0]).even([3, 1, 1]).is_none());
    }

    #[test]
    fn points_of_a_turned_and_sheared_lattice_are_even_and_one_beside_it_is_not() {
        let axes = DMat3::from_cols(
            DVec3::new(0.5, 0.5, 0.0),
            DVec3::new(-1.0, 2.0, 0.3),
            DVec3::new(0.0, 0.1, -0.7),
        );
        let dims = [4, 3, 5];
        let mut points = mapped(dims, |index| DVec3::new(10.0, -3.0, 1e3) + axes * index);
        let lattice = Shape::Curvilinear(points.clone().into()).even(dims).unwrap();
        assert!((lattice.axes() - axes).abs_diff_eq(DMat3::ZERO, 1e-9), "{lattice:?}");
        points[17].x += 1e-3;
        assert!(Shape::Curvilinear(points.into()).even(dims).is_none());
    }

    #[test]
    fn cells_are_in_the_middle_of_their_corners() {
        let dims = [3, 2, 1];
        let bent = |i: DVec3| DVec3::new(i.x * i.x, i.y + 0.25 * i.x, 7.0);
        let cells = Shape::Curvilinear(mapped(dims, bent).into()).cells(dims);
        let Shape::Curvilinear(cells) = cells else { panic!("{cells:?}") };
        assert_eq!(&*cells, &[DVec3::new(0.5, 0.625, 7.0), DVec3::new(2.5, 0.875, 7.0)]);
        let cells = rectilinear(&[0.0, 1.0, 4.0], &[2.0], &[0.0, -2.0]).cells([3, 1, 2]);
        assert_eq!(cells, rectilinear(&[0.5, 2.5], &[2.0], &[-1.0]));
    }

    #[test]
    fn coordinates_and_points_that_make_no_grid_are_refused() {
        let refused = |shape: Shape, dims| shape.check(dims).unwrap_err().to_string();
        assert_eq!(rectilinear(&[3.0, 2.0], &[0.0], &[0.0, 1.0]).check([2, 1, 2]), Ok(()));
        for (x, words) in [
            (vec![0.0, 1.0, 1.0], "1 after 1 along x"),
            (vec![0.0, 2.0, 1.0], "1 after 2 along x"),
            (vec![0.0, f64::NAN, 1.0], "NaN along x"),
            (vec![0.0, 1.0], "expected 3 samples"),
        ] {
            let message = refused(rectilinear(&x, &[0.0], &[0.0]), [3, 1, 1]);
            assert!(message.contains(words), "{message}");
        }
        let points = |points: &[DVec3]| Shape::Curvilinear(points.into());
        let message = refused(points(&[DVec3::ZERO, DVec3::NAN]), [2, 1, 1]);
        assert!(message.contains("for point 1"), "{message}");
        assert!(refused(points(&[DVec3::ONE; 4]), [2, 2, 1]).contains("all of them"));
        assert_eq!(points(&[DVec3::ONE]).check([1; 3]), Ok(()));
    }

    /// The volume of a box of unit edges along three axes.
    fn independence(axes: [DVec3; 3]) -> f64 {
        let [a, b, c] = axes.map(DVec3::normalize);
        a.cross(b).dot(c).abs()
    }

    #[test]
    fn axes_that_are_missing_flat_or_of_no_length_are_replaced_and_no_others() {
        let (x, y) = (DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0));
        let flat = usable_axes([Some(x), Some(y), None], 1.0);
        assert_eq!(flat, [x, y, DVec3::new(0.0, 0.0, 3.0)]);
        assert_eq!(usable_axes([None; 3], 0.5), [DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5]);
        // Neither a step of nothing, nor one along another, nor one between two.
        for bad in [DVec3::ZERO, -y, x + y * 2.0, DVec3::new(1.0, 1.0, 1e-3)] {
            let axes = usable_axes([Some(x), Some(bad), Some(y)], 1.0);
            assert!(independence(axes) > 0.2, "{bad}: {axes:?}");
        }
        // A slanted one stays.
        let slanted = DVec3::new(2.0, 0.2, 0.0);
        let axes = usable_axes([Some(x), Some(slanted), None], 1.0);
        assert_eq!(axes[1], slanted);
        assert!(axes[2].x.abs() + axes[2].y.abs() < 1e-12, "{axes:?}");
    }

    #[test]
    fn random_axes_are_invertible_and_the_longest_is_never_touched() {
        let mut state = 0x5eed_0003_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % 2001) as f64 / 1000.0 - 1.0
        };
        for round in 0..2000 {
            let mut steps = [0; 3].map(|_| Some(DVec3::new(random(), random(), random())));
            // Many of them singular.
            match round % 5 {
                0 => steps[1] = None,
                1 => steps[2] = steps[0].map(|v| v * random()),
                2 => steps[0] = Some(steps[1].unwrap() * random() + steps[2].unwrap() * random()),
                3 => steps = steps.map(|v| v.map(|v| v * 1e-30)),
                _ => {}
            }
            let axes = usable_axes(steps, 1.0);
            let least = LEAST_SLANT * LEAST_SLANT;
            assert!(independence(axes) >= 0.9 * least, "seed 0x5eed0003, round {round}: {axes:?}");
            let longest =
                steps.into_iter().flatten().max_by(|a, b| a.length().total_cmp(&b.length()));
            assert!(axes.contains(&longest.unwrap()), "{steps:?}: {axes:?}");
        }
    }

    #[test]
    fn axes_are_half_the_difference_of_neighbours_and_at_borders_all_of_it() {
        let dims = [4, 2, 1];
        let points = mapped(dims, |i| DVec3::new(i.x * i.x, 3.0 * i.y, 0.0));
        let axes = axes_of(&points, dims);
        assert_eq!(axes[0].x_axis, DVec3::new(1.0, 0.0, 0.0));
        assert_eq!(axes[2].x_axis, DVec3::new(4.0, 0.0, 0.0));
        assert_eq!(axes[3].x_axis, DVec3::new(5.0, 0.0, 0.0));
        assert_eq!(axes[2].y_axis, DVec3::new(0.0, 3.0, 0.0));
        assert_eq!(axes[2].z_axis, DVec3::new(0.0, 0.0, 3.5));
        // Points that fall together, as at a pole, leave axes that can be inverted.
        let pole = axes_of(&mapped(dims, |i| DVec3::new(i.x * i.y, i.y, 0.0)), dims);
        assert!(pole.iter().all(|axes| axes.inverse().is_finite()), "{pole:?}");
    }
}
