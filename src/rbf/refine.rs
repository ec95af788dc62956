//! Centre, widths and weight of one function, by the method of Levenberg and Marquardt.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::function::{Basis, Function};

/// Steps that are tried.
const TRIES: usize = 14;

/// How wide functions may be, world.
#[derive(Debug, Clone, Copy)]
pub(super) struct Widths {
    /// `None` where it is that of the sample that is nearest to the centre.
    pub(super) least: Option<f64>,
    pub(super) most: f64,
}

impl Widths {
    /// Whether a function is that wide in every direction, among places.
    fn has(self, function: &Function, places: &[Sample]) -> bool {
        let shape = function.shape;
        let far = |place: &&Sample| place.at.distance_squared(function.centre);
        let nearest = || places.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let least = self.least.or_else(|| nearest().map(|place| place.least_width));
        let least = least.unwrap_or_default();
        let matrix = nalgebra::Matrix3::from_column_slice(&shape.to_cols_array());
        let singular = matrix.svd(false, false).singular_values;
        let slack = 1.0 + 1e-9;
        singular
            .iter()
            .all(|s| s.is_finite() && *s * least <= slack && *s * self.most * slack >= 1.0)
    }
}

/// What a function is fitted to at a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: DVec3,
    pub(super) value: f64,
    /// The root of how much it counts.
    pub(super) root: f64,
    /// How wide functions about it are at least.
    pub(super) least_width: f64,
}

/// Moves a function nearer to values at places. The squared error never grows; a function that no step improves comes back
/// unchanged.
pub(super) fn refined(
    basis: Basis,
    start: Function,
    places: &[Sample],
    widths: Widths,
) -> Function {
    let mut best = start;
    let mut cost = squared_error(basis, &best, places);
    let count = parameters(basis);
    if places.len() < count {
        return best;
    }
    let mut damping = 1e-2;
    for _ in 0..TRIES {
        let Some(step) = step(basis, &best, places, damping) else { break };
        let next = moved(basis, &best, &step);
        let is_sound =
            next.centre.is_finite() && next.weight.is_finite() && widths.has(&next, places);
        let next_cost = if is_sound { squared_error(basis, &next, places) } else { f64::INFINITY };
        if next_cost < cost {
            let gain = 1.0 - next_cost / cost;
            (best, cost, damping) = (next, next_cost, damping * 0.2);
            if gain < 1e-3 {
                break;
            }
        } else {
            damping *= 8.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    best
}

/// Weight, centre, and one width or the six numbers of an upper triangle.
pub(super) fn parameters(basis: Basis) -> usize {
    if basis == Basis::Ellipsoid { 10 } else { 5 }
}

/// Sum of the squared differences between a function and values at places, each as often as it counts.
pub(super) fn squared_error(basis: Basis, function: &Function, places: &[Sample]) -> f64 {
    let differences = places.iter().map(|place| {
        let own = function.weight * basis.of_square(function.square(place.at));
        place.root * (place.value - own)
    });
    differences.map(|d| d * d).sum()
}

/// Derivatives of a function's value by its parameters. Diagonal entries of the shape, and the one width, go by their
/// logarithm, so that they keep their sign.
pub(super) fn derivatives(basis: Basis, function: &Function, at: DVec3) -> ([f64; 10], f64) {
    let offset = at - function.centre;
    let scaled = function.shape * offset;
    let square = scaled.length_squared();
    let phi = basis.of_square(square);
    // By the square, of the whole.
    let slope = function.weight * basis.slope(square);
    let by_centre = function.shape.transpose() * scaled * (-2.0 * slope);
    let mut all = [0.0; 10];
    all[0] = phi;
    all[1..4].copy_from_slice(&by_centre.to_array());
    if basis == Basis::Ellipsoid {
        for (i, (row, column)) in TRIANGLE.into_iter().enumerate() {
            let by_log = if row == column { function.shape.col(column)[row] } else { 1.0 };
            all[4 + i] = 2.0 * slope * scaled[row] * offset[column] * by_log;
        }
    } else {
        // The logarithm of 1/σ.
        all[4] = 2.0 * slope * square;
    }
    (all, function.weight * phi)
}

/// Rows and columns of an upper triangle.
const TRIANGLE: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// The step for this damping: least squares by QR. Below the derivatives stands a row for each parameter, which holds it back.
fn step(basis: Basis, function: &Function, places: &[Sample], damping: f64) -> Option<Vec<f64>> {
    let count = parameters(basis);
    let rows = places.len();
    let mut matrix = DMatrix::zeros(rows + count, count);
    let mut right = DVector::zeros(rows + count);
    let mut lengths = vec![0.0; count];
    for (row, Sample { at, value, root, .. }) in places.iter().enumerate() {
        let (by, own) = derivatives(basis, function, *at);
        right[row] = root * (value - own);
        for (column, by) in by.iter().take(count).enumerate() {
            let by = root * by;
            matrix[(row, column)] = by;
            lengths[column] += by * by;
        }
    }
    for (column, length) in lengths.iter().enumerate() {
        matrix[(rows + column, column)] = (damping * length).sqrt().max(f64::MIN_POSITIVE);
    }
    let qr = matrix.qr();
    qr.q_tr_mul(&mut right);
    let step = qr.r().solve_upper_triangular(&right.rows(0, count).into_owned())?;
    step.iter().all(|s| s.is_finite()).then(|| step.iter().copied().collect())
}

fn moved(basis: Basis, function: &Function, step: &[f64]) -> Function {
    let mut shape = function.shape;
    // One step changes a width by e at most.
    let grown = |step: f64| step.clamp(-1.0, 1.0).exp();
    if basis == Basis::Ellipsoid {
        for (step, (row, column)) in step[4..].iter().zip(TRIANGLE) {
            if row == column {
                shape.col_mut(column)[row] *= grown(*step);
            } else {
                shape.col_mut(column)[row] += step;
            }
        }
    } else {
        shape *= grown(step[4]);
    }
    Function {
        centre: function.centre + DVec3::new(step[1], step[2], step[3]),
        shape,
        weight: function.weight + step[0],
    }
}
