//! Ellipsoids about scattered samples, each as wide in every direction as its neighbours lie apart there.

use std::cmp::Ordering;

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::slice::ParallelSliceMut;
use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};

use super::encoding::Encoding;
use super::function::Function;
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket};

/// Neighbours that tell how dense points lie: those of a cubic lattice along its axes and its faces' diagonals.
const NEIGHBOURS: usize = 18;
/// Standard deviations of the Gaussians about points, of those of their neighbours: 0.6 steps of a cubic lattice, as Westover has
/// it, which are its neighbours there. About the points of cells, of those of the 18 nearest of such a lattice.
const WIDTH: f64 = 1.04;
const WIDTH_OF_CELLS: f64 = 0.8;
/// Of the nearest samples so many are looked at, at most, and no more than twice as many as the last neighbour is the how many-th,
/// where there are six and so many were.
const MOST_LOOKED_AT: usize = 128;
const FEWEST_LOOKED_AT: usize = 24;
const ENOUGH: usize = 6;
/// Where neighbours lie on a plane or a line ellipsoids are still so thick, of their greatest width.
const THINNEST: f64 = 0.25;
/// The same about the points of cells, which may be long and thin, and lie close where they are.
const THINNEST_OF_CELLS: f64 = 1e-3;
/// The greatest width of an ellipsoid about a point, of their median.
const WIDEST: f64 = 2.0;
/// Samples that a thread looks at after one another.
const A_PART: usize = 1 << 10;
/// Of them, those between two looks at the ticket: each looks for its neighbours.
const BETWEEN_LOOKS: usize = 1 << 6;

/// A place, and the number of a sample there.
type Place = GeomWithData<[f64; 3], usize>;

impl Encoding {
    /// The mean of ellipsoids about samples at places anywhere. Samples at places that are not finite are left out, those whose
    /// value is not are holes; several at one place count as one, which has the mean of their values. A sample alone has a width
    /// of 1, and none is wider than twice the median: a lone one tells nothing of what lies far from it, and would hide all
    /// others. Of no samples the value is nowhere.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn about_samples(
        samples: impl IntoIterator<Item = (DVec3, f64)>,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let samples = merged(samples.into_iter().map(|(at, value)| (at, [value])));
        let places = samples.iter().enumerate();
        let places = places.map(|(i, (at, _))| Place::new(at.to_array(), i)).collect();
        let tree = RTree::bulk_load(places);
        let mut functions = functions_of(&samples, |at, _| shape_at(at, &tree), ticket)?;
        let most = WIDEST * median_width(&functions);
        for function in &mut functions {
            function.shape *= (function.width() / most).max(1.0);
        }
        Self::mean(functions, ticket)
    }

    /// The same of samples that tell themselves how wide their ellipsoids are: each with the mean of [`log_spread`]s of what is about
    /// it, in squares of `unit`. No tree is searched for neighbours: of points that lie close along one axis and far apart along the
    /// others the nearest lie along that one alone.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn about_cells(
        samples: impl IntoIterator<Item = (DVec3, f64, DMat3)>,
        unit: f64,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let numbers = |(at, value, spread): (DVec3, f64, DMat3)| {
            let [x, y, z] = [spread.x_axis, spread.y_axis, spread.z_axis];
            (at, [value, x.x, y.y, z.z, x.y, x.z, y.z])
        };
        let samples = merged(samples.into_iter().map(numbers));
        let shape = |_, [_, xx, yy, zz, xy, xz, yz]: &[f64; 7]| {
            let logs = Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz);
            let axes = Axes::of_spread(logs, unit, |log| (log / 2.0).exp());
            axes.shape(WIDTH_OF_CELLS, THINNEST_OF_CELLS)
        };
        Self::mean(functions_of(&samples, shape, ticket)?, ticket)
    }
}

/// Functions of merged samples, whose first number is their value, with what takes an offset from each to one in widths.
fn functions_of<const N: usize>(
    samples: &[(DVec3, [f64; N])],
    shape: impl Fn(DVec3, &[f64; N]) -> DMat3 + Sync,
    ticket: &Ticket,
) -> Result<Vec<Function>, Cancelled> {
    let parts: Vec<&[(DVec3, [f64; N])]> = samples.chunks(A_PART).collect();
    let parts = parallel::try_list(parts.len(), |part| {
        let mut looks = Looks::every(ticket, BETWEEN_LOOKS);
        let function = |(at, numbers): &(DVec3, [f64; N])| {
            looks.after(1)?;
            Ok(Function::about(*at, shape(*at, numbers), numbers[0]))
        };
        parts[part].iter().map(function).collect::<Result<Vec<Function>, Cancelled>>()
    });
    Ok(parts?.concat())
}

/// The median of the geometric means of functions' widths, world; 0 of none.
fn median_width(functions: &[Function]) -> f64 {
    let mut widths: Vec<f64> = functions.iter().map(Function::width).collect();
    let middle = widths.len() / 2;
    match widths.is_empty() {
        true => 0.0,
        false => *widths.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// The logarithm of the mean of the products of offsets, as a matrix. Means of these are geometric ones: what is long about a
/// sample weighs no more than what is short, as it would in means of squares.
pub fn log_spread(spread: DMat3) -> DMat3 {
    let [x, y, z] = [spread.x_axis, spread.y_axis, spread.z_axis];
    let spread = Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z);
    let axes = Axes::of_spread(spread, 1.0, |square| square.max(0.0).sqrt());
    if axes.widths[2] <= 0.0 {
        return DMat3::ZERO;
    }
    (0..3).fold(DMat3::ZERO, |sum, i| {
        let own = axes.widths[i].max(THINNEST_OF_CELLS * axes.widths[2]);
        let along = axes.directions[i];
        let log = 2.0 * own.ln() * along;
        sum + DMat3::from_cols(log * along.x, log * along.y, log * along.z)
    })
}

/// How far points lie from those next to them: the median distance of the fourth nearest at another place, of some of many. 1
/// of a point alone.
pub fn next_distance(points: &[DVec3]) -> f64 {
    const FOURTH: usize = 4;
    const MOST: usize = 2000;
    let unique = merged(points.iter().map(|at| (*at, [])));
    let places = unique.iter().map(|(at, _)| Place::new(at.to_array(), 0)).collect();
    let tree = RTree::bulk_load(places);
    let every = unique.len().div_ceil(MOST).max(1);
    let far = |(at, _): &(DVec3, [f64; 0])| {
        let near = tree.nearest_neighbor_iter(at.to_array()).skip(1).take(FOURTH).last();
        near.map(|place| DVec3::from(*place.geom()).distance(*at))
    };
    let mut all: Vec<f64> = unique.iter().step_by(every).filter_map(far).collect();
    let middle = all.len() / 2;
    match all.is_empty() {
        true => 1.0,
        false => *all.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// The decimal logarithm of how many points there are to a unit of volume about each: of a ball that its 18 nearest fill;
/// those at its own place count for nothing. NaN of points that are not finite; 0 of one alone.
pub fn log_densities(points: &[DVec3]) -> Vec<f64> {
    let radii = Radii::of(points);
    let others = radii.unique.len().saturating_sub(1).min(NEIGHBOURS) as f64;
    let density = |at: &DVec3| {
        if !at.is_finite() {
            return f64::NAN;
        }
        match radii.at(*at) {
            // Not by its cube, which may have no number.
            Some(radius) if others > 0.0 => {
                others.log10() - (4.0 / 3.0 * std::f64::consts::PI).log10() - 3.0 * radius.log10()
            }
            _ => 0.0,
        }
    };
    parallel::list(points.len(), |i| density(&points[i]))
}

/// About how far neighbours lie apart at each of some points, which are finite: the step of a cubic lattice whose 18th nearest
/// other place lies as far away. On a plane it is half as much again, and six times as much on a line.
pub(super) fn spacings(points: &[DVec3]) -> Vec<f64> {
    let radii = Radii::of(points);
    let step = |at: &DVec3| radii.at(*at).unwrap_or_default() / std::f64::consts::SQRT_2;
    parallel::list(points.len(), |i| step(&points[i]))
}

/// How far the 18th nearest other place lies from each, or the farthest of fewer; 0 of a place alone.
struct Radii {
    /// In their order.
    unique: Vec<(DVec3, [f64; 0])>,
    radii: Vec<f64>,
}

impl Radii {
    fn of(points: &[DVec3]) -> Self {
        let unique = merged(points.iter().map(|at| (*at, [])));
        let places = unique.iter().enumerate();
        let places = places.map(|(i, (at, _))| Place::new(at.to_array(), i));
        let tree = RTree::bulk_load(places.collect());
        // In the order of the tree what is looked at one after the other lies side by side, in space and in memory.
        let in_order: Vec<&Place> = tree.iter().collect();
        let parts: Vec<&[&Place]> = in_order.chunks(A_PART).collect();
        let parts = parallel::list(parts.len(), |part| {
            let mut guess = f64::NAN;
            let radius = |place: &&Place| (place.data, radius_of_nearest(&tree, place, &mut guess));
            parts[part].iter().map(radius).collect::<Vec<_>>()
        });
        let mut radii = vec![0.0; unique.len()];
        for (i, radius) in parts.concat() {
            radii[i] = radius;
        }
        Self { unique, radii }
    }

    /// Of one of the points.
    fn at(&self, at: DVec3) -> Option<f64> {
        let at = at + DVec3::ZERO;
        let known = self.unique.binary_search_by(|(place, _)| order(place, &at));
        known.ok().map(|i| self.radii[i])
    }
}

/// How far the 18th nearest other place lies, or the farthest of fewer; 0 of a place alone. `guess` is the square of what
/// it is at a place near by, and after that here: what lies within twice that is found sooner than one place after the other.
fn radius_of_nearest(tree: &RTree<Place>, place: &Place, guess: &mut f64) -> f64 {
    // Those within a guess that is far too great are as many as there are.
    const MOST: usize = 8 * NEIGHBOURS;
    let at = *place.geom();
    let within = tree.locate_within_distance(at, 2.0 * *guess).take(MOST);
    let mut squares: Vec<f64> = within.map(|other| other.distance_2(&at)).collect();
    // The place itself is one of them.
    *guess = if (NEIGHBOURS + 1..MOST).contains(&squares.len()) {
        *squares.select_nth_unstable_by(NEIGHBOURS, f64::total_cmp).1
    } else {
        let nearest = tree.nearest_neighbor_iter(at).take(NEIGHBOURS + 1).last();
        nearest.map_or(0.0, |other| other.distance_2(&at))
    };
    guess.sqrt()
}

/// Samples by their places, each place once, with the means of their numbers: of those whose first one is finite, where any is.
fn merged<const N: usize>(
    samples: impl IntoIterator<Item = (DVec3, [f64; N])>,
) -> Vec<(DVec3, [f64; N])> {
    let is_there = |numbers: &[f64; N]| numbers.first().is_none_or(|number| number.is_finite());
    let is_placed = |(at, numbers): &(DVec3, [f64; N])| {
        at.is_finite() && numbers.iter().skip(1).all(|number| number.is_finite())
    };
    let mut all: Vec<(DVec3, [f64; N])> = samples.into_iter().filter(is_placed).collect();
    // −0 is at the place of 0.
    all.iter_mut().for_each(|(at, _)| *at += DVec3::ZERO);
    all.par_sort_by(|(a, a_numbers), (b, b_numbers)| {
        order(a, b).then(is_there(b_numbers).cmp(&is_there(a_numbers)))
    });
    all.chunk_by(|(a, _), (b, _)| a == b)
        .map(|own| {
            let there = own.iter().take_while(|(_, numbers)| is_there(numbers)).count();
            let counted = &own[..if there > 0 { there } else { own.len() }];
            let count = counted.len() as f64;
            let mean = |i: usize| counted.iter().map(|(_, numbers)| numbers[i] / count).sum();
            (own[0].0, std::array::from_fn(mean))
        })
        .collect()
}

/// The order of places by x, then y, then z.
fn order(a: &DVec3, b: &DVec3) -> Ordering {
    let axes = a.to_array().into_iter().zip(b.to_array());
    axes.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// What takes an offset from a sample to one in widths: by the covariance of its neighbours' offsets. Neighbours are samples between
/// which and it no other lies, in the ball about the middle of the two (Gabriel): they are found on all sides, however much nearer
/// others lie on some, on a plane and a line as well.
fn shape_at(at: DVec3, tree: &RTree<Place>) -> DMat3 {
    let nearest = tree.nearest_neighbor_iter(at.to_array()).skip(1).take(MOST_LOOKED_AT);
    let mut neighbours: Vec<DVec3> = Vec::new();
    let mut last = 0;
    for (looked_at, place) in nearest.enumerate() {
        if neighbours.len() >= ENOUGH && looked_at >= FEWEST_LOOKED_AT.max(2 * last) {
            break;
        }
        let offset = DVec3::from(*place.geom()) - at;
        // In the ball, or but for rounding on it: a lattice has no neighbours along diagonals.
        let is_between = |own: &DVec3| (offset - *own).dot(*own) > -1e-6 * own.length_squared();
        if !neighbours.iter().any(is_between) {
            neighbours.push(offset);
            last = looked_at + 1;
        }
    }
    Axes::of(&neighbours).shape(WIDTH, THINNEST)
}

/// How far neighbours lie in the directions of their spread.
struct Axes {
    /// Of length 1.
    directions: [DVec3; 3],
    /// Root of the mean square along each, the least first, in units.
    widths: [f64; 3],
    /// Distance of the farthest, or another length about as long; 0 where there is none, or one so far that squares of
    /// distances have no number.
    unit: f64,
}

impl Axes {
    fn of(near: &[DVec3]) -> Self {
        let farthest = near.iter().map(|offset| offset.length()).fold(0.0, f64::max);
        if !(farthest > 0.0 && farthest.is_finite()) {
            return Self { directions: DVec3::AXES, widths: [0.0; 3], unit: 0.0 };
        }
        // In units of the farthest: squares of great and small lengths have a number, too.
        let mut covariance = Matrix3::<f64>::zeros();
        for offset in near.iter().map(|offset| (*offset / farthest).to_array()) {
            for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
                covariance[(row, column)] += offset[row] * offset[column] / near.len() as f64;
            }
        }
        Self::of_spread(covariance, farthest, |square| square.max(0.0).sqrt())
    }

    /// Of a matrix that tells how they spread, with what takes its eigenvalues to widths in units.
    fn of_spread(spread: Matrix3<f64>, unit: f64, width: impl Fn(f64) -> f64) -> Self {
        let SymmetricEigen { eigenvalues, eigenvectors } = spread.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigenvalues[*a].total_cmp(&eigenvalues[*b]));
        let direction = |i: usize| {
            let axis = eigenvectors.column(i);
            DVec3::new(axis[0], axis[1], axis[2])
        };
        let width = |i: usize| width(eigenvalues[i]);
        Self { directions: order.map(direction), widths: order.map(width), unit }
    }

    /// What takes an offset to one in widths of an ellipsoid, `width` of the spread and so thick at least, of its greatest width;
    /// of a sample alone the offset itself.
    fn shape(&self, width: f64, thinnest: f64) -> DMat3 {
        let widest = self.widths[2];
        if widest * self.unit <= 0.0 {
            return DMat3::IDENTITY;
        }
        let row = |i: usize| {
            let own = self.widths[i].max(thinnest * widest);
            self.directions[i] / (width * own * self.unit)
        };
        DMat3::from_cols(row(0), row(1), row(2)).transpose()
    }
}
#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::assert_stops;
    use crate::rbf::encoding::REACH;

    fn lattice(steps: DVec3) -> impl Iterator<Item = DVec3> {
        (0..7 * 7 * 7).map(move |i| steps * DVec3::from([i % 7, i / 7 % 7, i / 49].map(f64::from)))
    }

    fn mean_of(samples: impl IntoIterator<Item = (DVec3, f64)>) -> Encoding {
        Encoding::about_samples(samples, &Ticket::new()).expect("not cancelled")
    }

    #[test]
    fn a_lone_point_is_no_wider_than_others_twice() {
        let cube = |i: usize| DVec3::new((i % 5) as f64, (i / 5 % 5) as f64, (i / 25) as f64);
        let lone = DVec3::X * 1e5;
        let found = mean_of((0..125).map(cube).chain([lone]).map(|at| (at, at.x)));
        let widest = found.functions().iter().map(Function::width).fold(0.0, f64::max);
        let times = widest / median_width(found.functions());
        assert!((times - WIDEST).abs() < 1e-9, "{times}");
        assert!((found.value(DVec3::new(1.3, 2.2, 2.1)) - 1.3).abs() < 0.2);
        assert!(found.value(lone / 2.0).is_nan() && (found.value(lone) - 1e5).abs() < 1e-6);
    }

    /// Steps of a stretched lattice.
    const STRETCHED: DVec3 = DVec3::new(1.0, 2.0, 0.5);

    /// Points of a kind each, about one apart.
    fn clouds() -> Vec<(&'static str, Vec<DVec3>)> {
        let any = |i: u32, k: u32| f64::from(i.wrapping_mul(k) % 9973) / 9973.0;
        let place = |i: u32| DVec3::new(any(i, 389), any(i, 2111), any(i, 677));
        let shaken = lattice(DVec3::ONE).zip(0..).map(|(at, i)| at + 0.8 * (place(i) - 0.5));
        vec![
            ("lattice", lattice(DVec3::ONE).collect()),
            ("shaken", shaken.collect()),
            ("random", (0..343).map(|i| 7.0 * place(i)).collect()),
            ("stretched", lattice(STRETCHED).collect()),
            ("plane", lattice(DVec3::new(1.0, 1.0, 0.0)).collect()),
            ("line", (0..9).map(|i| DVec3::X * f64::from(i)).collect()),
            ("two", vec![DVec3::ZERO, DVec3::ONE]),
            ("one", vec![DVec3::ONE]),
        ]
    }

    #[test]
    fn a_mean_ends_half_a_step_beyond_a_lattice_and_no_box_cuts_it() {
        for (name, points) in clouds() {
            let found = mean_of(points.iter().map(|at| (*at, 1.0)));
            let [low, high] = found.bounds();
            for i in 0..3000_usize {
                let share = DVec3::from([i % 17, i % 19, i % 23].map(|n| n as f64))
                    / DVec3::new(16.0, 18.0, 22.0);
                let mut at = low + share * (high - low);
                at[i % 3] = [low, high][i % 2][i % 3];
                assert!(found.coverage(at) < 1.0, "{name} {at}");
            }
            for at in &points {
                assert!((found.value(*at) - 1.0).abs() < 1e-12, "{name} {at}");
            }
        }
        let found = mean_of(lattice(DVec3::ONE).map(|at| (at, 1.0)));
        for i in 0..100 {
            let at = |beyond: f64| {
                DVec3::new(1.0 + 0.04 * f64::from(i), 5.0 - 0.03 * f64::from(i), 6.0 + beyond)
            };
            assert!(!found.value(at(0.3)).is_nan() && found.value(at(0.7)).is_nan(), "{i}");
        }
    }

    #[test]
    fn few_places_among_points_are_not_covered() {
        for (name, most) in [("lattice", 0), ("shaken", 0), ("random", 20), ("stretched", 0)] {
            let points = clouds().into_iter().find(|(of, _)| *of == name).unwrap().1;
            let found = mean_of(points.iter().map(|at| (*at, 1.0)));
            let sides = if name == "stretched" { STRETCHED } else { DVec3::ONE };
            let place = |i: u32| {
                let at = DVec3::from([i % 10, i / 10 % 10, i / 100].map(f64::from));
                sides * (1.0 + 4.0 / 9.0 * at)
            };
            let open = (0..1000).filter(|i| found.value(place(*i)).is_nan()).count();
            assert!(open <= most, "{name}: {open} of 1000");
        }
    }

    #[test]
    fn a_sample_without_a_value_is_a_hole_as_wide_as_a_step() {
        let hole = DVec3::splat(3.0);
        let value = |at: DVec3| if at == hole { f64::NAN } else { at.x };
        let found = mean_of(lattice(DVec3::ONE).map(|at| (at, value(at))));
        for axis in DVec3::AXES {
            for far in [-0.25, 0.0, 0.25] {
                assert!(found.value(hole + axis * far).is_nan(), "{axis} {far}");
            }
            for far in [-1.0, -0.75, 0.75, 1.0] {
                let at = hole + axis * far;
                assert!((found.value(at) - at.x).abs() < 0.2, "{at}: {}", found.value(at));
            }
        }
        // It takes nothing from what lies farther away.
        let whole = mean_of(lattice(DVec3::ONE).map(|at| (at, at.x)));
        let far = DVec3::new(0.3, 3.2, 0.4);
        assert!((found.value(far) - whole.value(far)).abs() < 1e-12);
    }

    #[test]
    fn light_falls_on_the_border_of_a_mean_and_within_as_values_grow() {
        for constant in [true, false] {
            let value = |at: DVec3| if constant { 4.0 } else { at.x };
            let found = mean_of(lattice(DVec3::ONE).map(|at| (at, value(at))));
            for (axis, side) in [(DVec3::Y, 1.0), (DVec3::Z, -1.0), (DVec3::X, 1.0)] {
                let at = 3.1 + axis * (3.5 * side - 0.1);
                let lit = found.growth_for_light(at, DMat3::IDENTITY).normalize();
                assert!(lit.dot(-axis * side) > 0.95, "{constant} {axis}: {lit}");
            }
            let inside = DVec3::new(3.2, 2.7, 3.4);
            assert_eq!(found.growth_for_light(inside, DMat3::IDENTITY), found.gradient(inside));
        }
    }

    #[test]
    fn a_constant_stays_one_and_nothing_is_where_no_sample_is_near() {
        let steps = DVec3::new(1.0, 2.0, 0.5);
        let found = mean_of(lattice(steps).map(|at| (at, 7.25)));
        for i in 0..500 {
            let share = DVec3::new(f64::from(i % 11), f64::from(i % 13), f64::from(i % 17)) / 20.0;
            let at = steps * 6.0 * share;
            assert!((found.value(at) - 7.25).abs() < 1e-12, "{at}");
            assert!(found.gradient(at).length() < 1e-12, "{at}");
        }
        assert!(found.value(steps * 6.0 * 2.0).is_nan());
        assert_eq!(found.gradient(steps * 12.0), DVec3::ZERO);
    }

    #[test]
    fn ellipsoids_are_as_wide_as_neighbours_lie_apart() {
        let found = mean_of(lattice(DVec3::splat(2.0)).map(|at| (at, at.x)));
        let inner = found.functions().iter().find(|f| f.centre == DVec3::splat(6.0)).expect("one");
        for axis in DVec3::AXES {
            let width = (inner.shape * axis).length().recip();
            assert!((width - 1.2).abs() < 0.05, "0.6 steps of 2 along each axis: {width}");
        }
        let median = median_width(found.functions());
        assert!((median - 1.2).abs() < 0.18, "{median}");
        // What grows along x does so between the samples, too.
        let at = DVec3::new(5.3, 6.1, 5.7);
        assert!((found.value(at) - 5.3).abs() < 0.1 && (found.gradient(at).x - 1.0).abs() < 0.2);
    }

    #[test]
    fn densities_are_those_of_a_search_among_all() {
        let any = |i: u32, k: u32| f64::from(i.wrapping_mul(k) % 9973) / 9973.0;
        // A dense ball, a thin cloud, and two far away: no guess holds for long.
        let place = |i: u32| {
            let at = DVec3::new(any(i, 389), any(i, 2111), any(i, 677));
            if i.is_multiple_of(3) { at * 1e-3 } else { at }
        };
        let mut points: Vec<DVec3> = (0..2000).map(place).collect();
        points.extend([DVec3::splat(1e6), DVec3::splat(-1e160), place(3)]);
        let found = log_densities(&points);
        for (at, found) in
            points.iter().zip(&found).step_by(7).chain([(&points[2000], &found[2000])])
        {
            let mut far: Vec<f64> =
                points[..2002].iter().map(|other| other.distance(*at)).collect();
            far.sort_by(f64::total_cmp);
            // The first is itself.
            let ball = 4.0 / 3.0 * std::f64::consts::PI * far[NEIGHBOURS].powi(3);
            assert!((found - (NEIGHBOURS as f64 / ball).log10()).abs() < 1e-9, "{at}: {found}");
        }
        assert_eq!(found[2002], found[3]);
        assert!(found.iter().all(|density| !density.is_nan()));
    }

    #[test]
    fn the_growth_of_a_mean_is_that_of_differences() {
        let any = |i: u32, k: u32| f64::from(i.wrapping_mul(k) % 997) / 997.0;
        let found = mean_of(
            (0..200).map(|i| (DVec3::new(any(i, 389), any(i, 211), any(i, 677)), any(i, 101))),
        );
        let mut counted = 0;
        for i in 200..300 {
            let at = 0.2 + 0.6 * DVec3::new(any(i, 389), any(i, 211), any(i, 677));
            let step = 1e-6;
            let slope = |axis: DVec3| {
                (found.value(at + axis * step) - found.value(at - axis * step)) / (2.0 * step)
            };
            let differences = DVec3::from(DVec3::AXES.map(slope));
            if differences.is_nan() {
                continue;
            }
            counted += 1;
            let off = (found.gradient(at) - differences).length();
            assert!(off < 1e-4 * (1.0 + differences.length()), "{at}: {off}");
        }
        assert!(counted > 80, "{counted}");
    }

    #[test]
    fn samples_of_any_lie_have_ellipsoids() {
        let flat = mean_of(lattice(DVec3::new(1.0, 1.0, 0.0)).map(|at| (at, at.x)));
        assert_eq!(flat.functions().len(), 49, "seven lie at each place");
        let line = mean_of((0..9).map(|i| (DVec3::X * f64::from(i), 1.0)));
        for found in [&flat, &line] {
            for function in found.functions() {
                let half = function.half_box(REACH * REACH);
                let thickest = half.max_element();
                assert!(half.min_element() >= 0.2 * thickest && thickest.is_finite(), "{half}");
            }
        }
        // They are as wide as the next ones lie apart, however many lie beyond.
        for (found, most) in [(&line, 1.1), (&flat, 0.9)] {
            let inner = &found.functions()[found.functions().len() / 2];
            let width = (inner.shape * DVec3::X).length().recip();
            assert!((0.6..most).contains(&width), "{width}");
        }
        let found = log_densities(&[DVec3::ZERO, DVec3::NAN, DVec3::X * 0.1, DVec3::ZERO]);
        let expected = 3.0 - (4.0 / 3.0 * std::f64::consts::PI).log10();
        assert!((found[0] - expected).abs() < 1e-12 && found[1].is_nan() && found[3] == found[0]);
        assert_eq!(log_densities(&[DVec3::ONE]), [0.0]);
        // One alone, many at one place, very far apart, very near, and none.
        let one = mean_of([(DVec3::ONE, 3.0)]);
        assert_eq!((one.value(DVec3::ONE), one.value(DVec3::ONE * 9.0).is_nan()), (3.0, true));
        let twice = mean_of([(DVec3::ONE, 3.0), (DVec3::ONE, 5.0), (-DVec3::ONE, 1.0)]);
        let weights: Vec<f64> = twice.functions().iter().map(|f| f.weight + twice.bias()).collect();
        assert_eq!(weights, [1.0, 4.0], "in the order of their places");
        for scale in [1e-60, 1e60] {
            let all = mean_of(lattice(DVec3::splat(scale)).map(|at| (at, 2.0)));
            assert_eq!(all.value(DVec3::splat(2.5 * scale)), 2.0, "{scale}");
        }
        let farthest = mean_of([(DVec3::splat(1e300), 2.0), (DVec3::splat(-1e300), 3.0)]);
        assert_eq!(farthest.value(DVec3::splat(1e300)), 2.0);
        let nan = (DVec3::NAN, 1.0);
        assert!(mean_of([nan, (DVec3::ONE, f64::NAN)]).value(DVec3::ZERO).is_nan());
    }

    #[test]
    fn ellipsoids_are_left_off_within_a_part_where_a_ticket_says_so() {
        let at = |i: usize| DVec3::from([i % 20, i / 20 % 20, i / 400].map(|n| n as f64));
        assert_stops("ellipsoids", 20_usize.pow(3) / BETWEEN_LOOKS, |ticket| {
            Encoding::about_samples((0..20_usize.pow(3)).map(|i| (at(i), 1.0)), ticket)
        });
    }
}
