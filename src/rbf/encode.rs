//! Fits functions to samples. New ones are added where the sum is furthest from the samples (Jang, section 4). A fit may go on
//! from the functions of an earlier one.

use std::ops::ControlFlow;

use glam::{DMat3, DVec3};
use nalgebra::Matrix3;

use super::cluster::{Cluster, Spread, principal, split_into};
use super::encoding::{Encoding, Errors};
use super::function::{Basis, Function};
use super::points::{Points, weighed};
use super::refine::{Sample, Widths, parameters, refined, squared_error};
use super::solve::{Column, least_squares};
use crate::core::memory::{self, TooLarge};
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};

/// ε, below which a function is cut off, as a share of the error asked for.
const EPSILON: f64 = 0.02;
/// The least error that ε is derived from, as a share of the range.
const LEAST_ERROR: f64 = 1e-12;
/// Functions that a round adds, as a share of those that there are, and between these bounds.
const GROWTH: f64 = 0.3;
const FEWEST_AT_ONCE: usize = 4;
const MOST_AT_ONCE: usize = 128;
/// How often a round refines all shapes, at most. It stops sooner where a sweep leaves more than [`ENOUGH`] of the error.
const SWEEPS: u32 = 4;
/// The same in the last round.
const LAST_SWEEPS: u32 = 12;
/// A step that leaves more than this share of the error was not worth its time.
const ENOUGH: f64 = 0.99;
/// The least width of functions, as a part of how far samples lie apart there.
const NARROWEST: f64 = 0.5;
/// Samples that a function's shape is fitted to, at most.
const PLACES: usize = 400;
/// Damping of the least squares, for columns of length one.
const DAMPING: f64 = 1e-4;
/// Squared distance, in widths, of the samples that a shape is fitted to.
const NEAR: f64 = 9.0;
/// Inverse multiquadrics have a third of their height left there, and far more of what they are beyond it: samples all over, about
/// so many, count as well, each for all that lie about it. Without them a shape is made for its surroundings and spoils the rest.
const FAR_PLACES: usize = 1000;
/// λ of the weights of inverse multiquadrics, as a share of that by which the weights that there are would cost as much as what is
/// left of the samples: a hundredth of the squared error, so 0.5 % of the error, is the most that it can cost. Their tails are much
/// alike, and weights grew against each other to 10⁶ of the values' range.
const HELD: f64 = 0.1;
/// Bytes of an entry of a column: a sample's number, and a function's value there. New columns are made beside the old ones.
const BYTES_AN_ENTRY: u64 = 2 * 8;
/// Rounds in a row that may leave more than [`ENOUGH`] of the error before the encoder gives up. A round counts as one that
/// does not where its new functions took away a part of what as many numbers would be expected to take of noise, so many of so many
/// samples: of hundreds of features that are alike each few are little.
const PATIENCE: u32 = 6;
const OF_NOISE: f64 = 0.25;
/// But rounding is none.
const NOT_ROUNDING: f64 = 1.0 - 1e-9;

/// When it is enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// What functions look like.
    pub basis: Basis,
    /// The greatest error, in the samples' units; 0 for as near as the functions allow, infinite where any will do.
    pub max_error: f64,
    /// The mean of the errors' sizes, likewise.
    pub mean_error: f64,
    /// Functions at most.
    pub functions: usize,
}

impl Goal {
    /// Whether errors are as small as asked for.
    pub fn is_met(&self, errors: &Errors) -> bool {
        errors.max <= self.max_error && errors.mean <= self.mean_error
    }

    /// The error that functions may end by: the least that is asked for, if any.
    fn least_error(&self) -> f64 {
        let least = self.max_error.min(self.mean_error);
        if least.is_finite() { least } else { 0.0 }
    }
}

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// How many functions there are.
    pub functions: usize,
    /// How far their sum is from the samples, while functions still end by the weights that they had.
    pub errors: Errors,
}

/// Why there is no encoding.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EncodeError {
    /// No sample is finite.
    #[error("expected at least one finite sample, found none")]
    Nothing,
    /// More samples than are numbered.
    #[error("expected at most 4294967295 samples, found {0}; encode a coarser field")]
    TooMany(usize),
    /// Values are so large or so small that their squares are not finite.
    #[error(
        "expected values between 1e-140 and 1e140 from each other, found a range of {0:e}; scale them first"
    )]
    Range(f64),
    /// Functions to go on from that look otherwise.
    #[error(
        "expected a fit by functions of the basis {} to go on from, found one by {}; ask for that basis, or encode anew",
        .expected.name(),
        .found.name()
    )]
    OtherBasis {
        /// Of the goal.
        expected: Basis,
        /// Of the earlier fit.
        found: Basis,
    },
    /// Functions whose values at the samples are more than memory has room for.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// It was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is known of the fit so far.
struct Fit<'a> {
    points: &'a Points,
    goal: Goal,
    epsilon: f64,
    widths: Widths,
    /// λ of the last solution's weights; 0 where they are free.
    ridge: f64,
    /// How far samples lie apart in the mean.
    spacing: f64,
    /// The same at each; none where they lie evenly.
    spacings: Vec<f64>,
    bias: f64,
    functions: Vec<Function>,
    columns: Vec<Column>,
    /// That the columns may have.
    free_bytes: u64,
    /// Values less the sum, a point each.
    residual: Vec<f64>,
}

/// Fits functions to samples until their errors are those of the goal, or the goal's number of functions is used, or more
/// functions bring no more. The best sum found is returned in every case: [`Encoding::errors`] says how good it is. Where
/// points count more than others ([`Points::weighted`]), that is what is fitted; the goal's errors are of all of them alike.
/// Each round is `told`, which may break it off. Where the ticket is paused it rests between two sweeps over all functions.
///
/// # Errors
/// See [`EncodeError`].
pub fn encode(
    points: &Points,
    goal: Goal,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoding, EncodeError> {
    let fit = Fit::new(points, goal)?;
    let start = fit.encoding();
    fitted(fit, start, Start { is_resumed: false, is_held: false }, ticket, told)
}

/// What a fit begins with.
#[derive(Debug, Clone, Copy)]
struct Start {
    /// The functions of an earlier fit.
    is_resumed: bool,
    /// No greatest error above that of these is of use.
    is_held: bool,
}

/// Goes on from the functions of an earlier fit to the same samples: they are refined, and others added, until the goal is
/// reached as in [`encode`]. A fit that is as near already comes back as it is, and none of its functions are taken away
/// where the goal allows fewer. No sum is returned whose greatest error is above that of `start`.
///
/// # Errors
/// See [`EncodeError`].
pub fn resume(
    points: &Points,
    start: &Encoding,
    goal: Goal,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoding, EncodeError> {
    resume_within(points, (start, goal), memory::free_bytes(), ticket, told)
}

/// The same for who minds all errors together alone: the greatest one may grow where the sum of squares falls.
///
/// # Errors
/// See [`EncodeError`].
pub fn extend(
    points: &Points,
    start: &Encoding,
    goal: Goal,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoding, EncodeError> {
    let fit = resumed(points, (start, goal), memory::free_bytes())?;
    fitted(fit, start.clone(), Start { is_resumed: true, is_held: false }, ticket, told)
}

/// The same within so many bytes.
pub(super) fn resume_within(
    points: &Points,
    (start, goal): (&Encoding, Goal),
    free_bytes: u64,
    ticket: &Ticket,
    told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoding, EncodeError> {
    let fit = resumed(points, (start, goal), free_bytes)?;
    fitted(fit, start.clone(), Start { is_resumed: true, is_held: true }, ticket, told)
}

/// What is known of an earlier fit to go on from.
fn resumed<'a>(
    points: &'a Points,
    (start, goal): (&Encoding, Goal),
    free_bytes: u64,
) -> Result<Fit<'a>, EncodeError> {
    if start.basis() != goal.basis {
        return Err(EncodeError::OtherBasis { expected: goal.basis, found: start.basis() });
    }
    let mut fit = Fit::new(points, goal)?;
    // Functions that ended sooner than they did would begin further off.
    fit.epsilon = fit.epsilon.min(start.epsilon());
    fit.free_bytes = free_bytes;
    fit.check_room(start.functions())?;
    fit.restore((start.functions().to_vec(), start.bias()));
    Ok(fit)
}

/// The same functions by the weights, and above the bias, that come nearest to samples. Those that have a weight of no more
/// than ε then are left out.
///
/// # Errors
/// See [`EncodeError`].
pub fn reweighted(points: &Points, start: &Encoding) -> Result<Encoding, EncodeError> {
    let (basis, functions) = (start.basis(), start.functions().len());
    let goal = Goal { basis, max_error: 0.0, mean_error: f64::INFINITY, functions };
    let mut fit = Fit::new(points, goal)?;
    fit.epsilon = start.epsilon();
    fit.restore((start.functions().to_vec(), start.bias()));
    fit.solve();
    Ok(fit.encoding())
}

/// Adds functions and refines them until it is enough. What `start` gives stays the best until something is nearer.
fn fitted(
    mut fit: Fit<'_>,
    start: Encoding,
    Start { is_resumed, is_held }: Start,
    ticket: &Ticket,
    mut told: impl FnMut(Step) -> ControlFlow<()>,
) -> Result<Encoding, EncodeError> {
    let goal = fit.goal;
    let mut clusters = fit.clusters(ticket)?;
    let best_left = start.differences(fit.points, ticket)?;
    let mut best_errors = Errors::of(&best_left);
    let mut best = start;
    // Who goes on from a fit has seen its greatest error, which is not to grow.
    let most = if is_held { best_errors.max } else { f64::INFINITY };
    // All of an earlier fit may be refined once more, also where no function may be added.
    let mut is_to_be_refined = is_resumed;
    let roots = fit.points.roots();
    // As much as points count. What it is divided by does not matter.
    let cost_of = |differences: &[f64]| Errors::of(&weighed(roots, differences)).rms;
    let mut best_cost = cost_of(&best_left);
    let mut nearest = best_cost;
    let mut since_nearer = 0;
    loop {
        let errors = Errors::of(&fit.residual);
        let is_enough = told(Step { functions: fit.functions.len(), errors }).is_break();
        ticket.checkpoint(fit.functions.len() as u64, goal.functions.max(1) as u64)?;
        let left = goal.functions.saturating_sub(fit.functions.len());
        let is_near = goal.is_met(&best_errors);
        let is_full = left == 0 && !is_to_be_refined;
        if is_enough || is_near || is_full || since_nearer >= PATIENCE {
            return Ok(best);
        }
        is_to_be_refined = false;
        let cost = cost_of(&fit.residual);
        let before = (fit.functions.clone(), fit.bias);
        let count = fit.functions.len();
        fit.add(&mut clusters, left)?;
        fit.solve();
        let is_last = fit.functions.len() >= goal.functions;
        for _ in 0..if is_last { LAST_SWEEPS } else { SWEEPS } {
            ticket.rest()?;
            ticket.checkpoint(fit.functions.len() as u64, goal.functions.max(1) as u64)?;
            let before = cost_of(&fit.residual);
            fit.refine();
            fit.solve();
            if cost_of(&fit.residual) > ENOUGH * before {
                break;
            }
        }
        // New cut-offs may cost more than new functions bring. Then other clusters are tried.
        if cost_of(&fit.residual) > cost {
            fit.restore(before);
        }
        // As functions end by their own weights, which is what a file holds.
        let now = fit.encoding();
        let now_left = now.differences(fit.points, ticket)?;
        let (now_errors, now_cost) = (Errors::of(&now_left), cost_of(&now_left));
        let added = fit.functions.len().saturating_sub(count);
        let enough = fit.enough_of(added);
        since_nearer = if now_cost < enough * nearest { 0 } else { since_nearer + 1 };
        nearest = nearest.min(now_cost);
        if now_errors.max <= most && (goal.is_met(&now_errors) || now_cost < best_cost) {
            (best, best_errors, best_cost) = (now, now_errors, now_cost);
        }
        let left = weighed(roots, &fit.residual);
        parallel::each(clusters.iter_mut(), |cluster| cluster.measure(&left));
    }
}

impl<'a> Fit<'a> {
    fn new(points: &'a Points, goal: Goal) -> Result<Self, EncodeError> {
        if points.is_empty() {
            return Err(EncodeError::Nothing);
        }
        if u32::try_from(points.len()).is_err() {
            return Err(EncodeError::TooMany(points.len()));
        }
        let values = points.values();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = high - low;
        if range > 0.0 && !(1e-140..1e140).contains(&range) || !range.is_finite() {
            return Err(EncodeError::Range(range));
        }
        // A mean that does not overflow.
        let bias = low + values.iter().map(|v| (v - low) / values.len() as f64).sum::<f64>();
        let error = goal.least_error().max(LEAST_ERROR * range).max(f64::MIN_POSITIVE / EPSILON);
        let (spacing, spacings) = (points.spacing(), points.own_spacings());
        let [least, greatest] = points.bounds();
        let most = (greatest - least).length().max(spacing);
        Ok(Self {
            points,
            goal,
            epsilon: EPSILON * error,
            widths: Widths { least: spacings.is_empty().then_some(NARROWEST * spacing), most },
            ridge: 0.0,
            spacing,
            spacings,
            bias,
            functions: Vec::new(),
            columns: Vec::new(),
            free_bytes: memory::free_bytes(),
            residual: values.iter().map(|v| v - bias).collect(),
        })
    }

    /// The share of the error that so many functions more may leave.
    fn enough_of(&self, added: usize) -> f64 {
        if added == 0 {
            return ENOUGH;
        }
        let numbers = (added * parameters(self.goal.basis)) as f64;
        (1.0 - OF_NOISE * numbers / self.points.len() as f64).clamp(ENOUGH, NOT_ROUNDING)
    }

    fn encoding(&self) -> Encoding {
        let functions = self.functions.iter().copied();
        Encoding::new(self.goal.basis, self.bias, self.epsilon, functions, self.points.bounds())
    }

    /// All samples in one cluster more than there are functions, as many as fitting these would have left; fewer where
    /// they lie at fewer places.
    fn clusters(&self, ticket: &Ticket) -> Result<Vec<Cluster>, Cancelled> {
        let all = (0..self.points.len() as u32).collect();
        let left = weighed(self.points.roots(), &self.residual);
        let all = Cluster::of(all, &left);
        split_into(self.functions.len() + 1, all, (self.points, &left), ticket)
    }

    /// Adds a function in each of the clusters with the largest errors, and splits these clusters.
    fn add(&mut self, clusters: &mut Vec<Cluster>, most: usize) -> Result<(), TooLarge> {
        let wanted = (self.functions.len() as f64 * GROWTH) as usize;
        let wanted = wanted.clamp(FEWEST_AT_ONCE, MOST_AT_ONCE).min(most).min(clusters.len());
        // Half of them have the most squared error, the other half the worst single sample: the goal is a greatest error.
        clusters.sort_by(|a, b| b.energy.total_cmp(&a.energy));
        let by_worst = wanted / 2;
        if let Some(rest) = clusters.get_mut(wanted - by_worst..) {
            rest.sort_by(|a, b| b.worst.0.abs().total_cmp(&a.worst.0.abs()));
        }
        let others = clusters.split_off(wanted);
        let chosen = std::mem::replace(clusters, others);
        let is_missed = |cluster: &&Cluster| cluster.worst.0 != 0.0;
        let left = weighed(self.points.roots(), &self.residual);
        let missed: Vec<&Cluster> = chosen.iter().filter(is_missed).collect();
        let added = parallel::list(missed.len(), |i| self.placed(missed[i], &left));
        // All of them are made anew once their weights are known.
        self.check_room(&[&self.functions[..], &added].concat())?;
        let columns = self.columns_of(&added);
        // Each was fitted as if it were alone. Their weights are found together, so they begin at 0.
        self.functions
            .extend(added.into_iter().map(|function| Function { weight: 0.0, ..function }));
        self.columns.extend(columns);
        for cluster in chosen {
            match cluster.split(self.points, &left) {
                Ok(halves) => clusters.extend(halves),
                Err(whole) => clusters.push(whole),
            }
        }
        Ok(())
    }

    /// The function that removes most of a cluster's residual, as much as its samples count: a wide one about the weighted mean,
    /// or a narrow one at the worst sample. `left` is what is left by the roots of that.
    fn placed(&self, cluster: &Cluster, left: &[f64]) -> Function {
        let Spread { mean, covariance } = cluster.spread(self.points, left);
        let worst = self.points.positions()[cluster.worst.1 as usize];
        // The weights are squared residuals, and the square of a Gaussian has half its variance.
        let covariance = covariance * 2.0;
        let around = |centre: DVec3, shape: DMat3| {
            let weight = self.residual[cluster.worst.1 as usize];
            let start = Function { centre, shape, weight };
            let places = self.places(&start, false);
            let basis = self.goal.basis;
            let found = refined(basis, start, &places, self.widths);
            let before: f64 = places.iter().map(|place| (place.root * place.value).powi(2)).sum();
            (before - squared_error(basis, &found, &places), found)
        };
        let least = self.least_width(cluster.worst.1 as usize);
        let narrow = DMat3::from_diagonal(DVec3::splat((1.5 * least).recip()));
        let wide = around(mean, self.shape(covariance, least));
        let close = around(worst, narrow);
        if wide.0 >= close.0 { wide.1 } else { close.1 }
    }

    /// The shape of a spread: as wide in each direction, or of one width for all.
    fn shape(&self, covariance: DMat3, least: f64) -> DMat3 {
        let (variances, axes) = principal(covariance);
        let clamped = |variance: f64| variance.sqrt().clamp(least, self.widths.most);
        let widths = DVec3::from(variances.to_array().map(clamped));
        if self.goal.basis != Basis::Ellipsoid {
            let mean = (widths.x * widths.y * widths.z).cbrt().clamp(least, self.widths.most);
            return DMat3::from_diagonal(DVec3::splat(mean.recip()));
        }
        let precision = axes * DMat3::from_diagonal((widths * widths).recip()) * axes.transpose();
        let matrix = Matrix3::from_column_slice(&precision.to_cols_array());
        let upper = matrix.cholesky().map(|cholesky| cholesky.l().transpose());
        upper.map_or(DMat3::from_diagonal(widths.recip()), |upper| {
            DMat3::from_cols_slice(upper.as_slice())
        })
    }

    /// How wide functions about a sample are at least.
    fn least_width(&self, sample: usize) -> f64 {
        NARROWEST * self.spacings.get(sample).copied().unwrap_or(self.spacing)
    }

    /// Samples near a function, and their residuals. Of a function that is in the sum, what it gives is added back.
    fn places(&self, function: &Function, is_in_sum: bool) -> Vec<Sample> {
        let half = function.half_box(NEAR);
        let ranges = self.points.in_box(function.centre - half, function.centre + half);
        let mut near: Vec<usize> = Vec::new();
        for range in ranges {
            near.extend(range.filter(|i| function.square(self.points.positions()[*i]) <= NEAR));
        }
        // Spread evenly over the list. The stride is a fraction, so that it does not follow the rows of a grid.
        let stride = (near.len() as f64 / PLACES as f64).max(1.0);
        let count = (near.len() as f64 / stride) as usize;
        let basis = self.goal.basis;
        let place = |i: usize| {
            let at = self.points.positions()[i];
            let own = if is_in_sum {
                function.weight * basis.of_square(function.square(at))
            } else {
                0.0
            };
            Sample {
                at,
                value: self.residual[i] + own,
                root: self.points.root(i),
                least_width: self.least_width(i),
            }
        };
        let chosen = (0..count).map(|k| near[((k as f64 * stride) as usize).min(near.len() - 1)]);
        if basis != Basis::Multiquadric {
            return chosen.map(place).collect();
        }
        let standing_for =
            |sample: Sample, many: f64| Sample { root: sample.root * many.sqrt(), ..sample };
        let mut all: Vec<Sample> = chosen.map(|i| standing_for(place(i), stride)).collect();
        let reach = self.reach(function);
        let positions = self.points.positions();
        let stride = (positions.len() as f64 / FAR_PLACES as f64).max(1.0);
        let far = (0..(positions.len() as f64 / stride) as usize)
            .map(|k| (((k as f64 + 0.5) * stride) as usize).min(positions.len() - 1));
        let is_far = |i: &usize| (NEAR..=reach).contains(&function.square(positions[*i]));
        all.extend(far.filter(is_far).map(|i| standing_for(place(i), stride)));
        all
    }

    /// The squared distance, in widths, at which a function ends. A weight that is still small counts as e ε, so that it can
    /// grow.
    fn reach(&self, function: &Function) -> f64 {
        let weight = function.weight.abs().max(self.epsilon * std::f64::consts::E);
        self.goal.basis.reach_square(weight, self.epsilon).unwrap_or_default()
    }

    /// Entries that the columns of functions have together, at most: of all samples in the boxes about them.
    fn most_entries(&self, functions: &[Function]) -> u64 {
        let of_one = |function: &Function| -> u64 {
            let half = function.half_box(self.reach(function));
            let ranges = self.points.in_box(function.centre - half, function.centre + half);
            ranges.map(|range| range.len() as u64).sum()
        };
        parallel::list(functions.len(), |i| of_one(&functions[i])).iter().sum()
    }

    /// Refuses functions whose columns have no room.
    fn check_room(&self, functions: &[Function]) -> Result<(), TooLarge> {
        let needed = self.most_entries(functions).saturating_mul(BYTES_AN_ENTRY);
        memory::require("the functions' values at the samples", needed, self.free_bytes)
    }

    fn columns_of(&self, functions: &[Function]) -> Vec<Column> {
        parallel::list(functions.len(), |i| self.column(&functions[i]))
    }

    /// A function's values at the samples that it reaches.
    fn column(&self, function: &Function) -> Column {
        let basis = self.goal.basis;
        let reach = self.reach(function);
        let half = function.half_box(reach);
        let mut column = Column::default();
        for range in self.points.in_box(function.centre - half, function.centre + half) {
            for i in range {
                let square = function.square(self.points.positions()[i]);
                if square <= reach {
                    column.points.push(i as u32);
                    column.values.push(basis.of_square(square) as f32);
                }
            }
        }
        column
    }

    /// Finds all weights and the bias, drops functions that are nowhere above ε, and cuts the others off by their new weights.
    fn solve(&mut self) {
        // What was exchanged left rounding behind.
        self.measure();
        let roots = self.points.roots();
        let weights: Vec<f64> = match self.goal.basis {
            Basis::Multiquadric => self.functions.iter().map(|function| function.weight).collect(),
            Basis::Gaussian | Basis::Ellipsoid => Vec::new(),
        };
        self.ridge = self.ridge_of(&weights);
        let held = (&weights[..], self.ridge);
        let changes = least_squares(&self.columns, &self.residual, roots, DAMPING, held);
        for (function, change) in self.functions.iter_mut().zip(&changes) {
            function.weight += change;
        }
        self.bias += changes.last().copied().unwrap_or_default();
        let epsilon = self.epsilon;
        let basis = self.goal.basis;
        let before: Vec<Function> = std::mem::take(&mut self.functions);
        self.functions = before
            .into_iter()
            .filter(|f| basis.reach_square(f.weight, epsilon).is_some())
            .collect();
        self.columns = self.columns_of(&self.functions);
        self.measure();
    }

    /// λ of so many weights, of which there may be none. Where all are 0, as at first, it is that of weights as large as the samples.
    fn ridge_of(&self, weights: &[f64]) -> f64 {
        let roots = self.points.roots();
        let lengths = weights.iter().zip(&self.columns).map(|(w, column)| w * column.norm(roots));
        let of_weights = lengths.map(|length| length * length).sum::<f64>().sqrt();
        let left =
            weighed(roots, &self.residual).iter().map(|left| left * left).sum::<f64>().sqrt();
        match () {
            () if weights.is_empty() => 0.0,
            // Where little of the samples is in the weights yet, these must not be held until nothing is.
            () if of_weights > 0.0 => HELD * (left / of_weights).min(1.0),
            () => HELD * HELD,
        }
    }

    /// Functions and a bias that were there before.
    fn restore(&mut self, (functions, bias): (Vec<Function>, f64)) {
        (self.functions, self.bias) = (functions, bias);
        self.columns = self.columns_of(&self.functions);
        self.measure();
    }

    /// The residual anew.
    fn measure(&mut self) {
        let mut sum = vec![0.0; self.points.len()];
        for (function, column) in self.functions.iter().zip(&self.columns) {
            column.add_to(&mut sum, function.weight);
        }
        let values = self.points.values();
        self.residual =
            values.iter().zip(&sum).map(|(value, sum)| value - self.bias - sum).collect();
    }

    /// Refines each function while the others stay. Functions that do not overlap are refined side by side. The squared
    /// residual never grows, with what held weights cost.
    fn refine(&mut self) {
        let mut waiting: Vec<usize> = (0..self.functions.len()).collect();
        while !waiting.is_empty() {
            let (batch, rest) = apart(&self.functions, &waiting);
            let fit = &*self;
            let found = parallel::list(batch.len(), |i| {
                let own = fit.functions[batch[i]];
                let function = refined(fit.goal.basis, own, &fit.places(&own, true), fit.widths);
                (batch[i], function, fit.column(&function))
            });
            for (index, function, column) in found {
                self.exchange(index, function, column);
            }
            waiting = rest;
        }
    }

    /// Puts another function in the place of one, unless that makes the squared residual larger, with what held weights cost.
    fn exchange(&mut self, index: usize, function: Function, column: Column) {
        let own = self.functions[index].weight;
        let points = self.points;
        let squares = |residual: &[f64], column: &Column| -> f64 {
            let weighed = |i: usize| residual[i] * points.root(i);
            column.points.iter().map(|point| weighed(*point as usize).powi(2)).sum()
        };
        // Only the samples of the old and of the new one change.
        let whole = squares(&self.residual, &self.columns[index]);
        self.columns[index].add_to(&mut self.residual, own);
        let change = squares(&self.residual, &self.columns[index]) - whole;
        let without = squares(&self.residual, &column);
        column.add_to(&mut self.residual, -function.weight);
        let change = change + squares(&self.residual, &column) - without;
        // As in the solution.
        let cost = |weight: f64, column: &Column| match self.ridge {
            0.0 => 0.0,
            ridge => (ridge * weight * column.norm(points.roots())).powi(2),
        };
        let change = change + cost(function.weight, &column) - cost(own, &self.columns[index]);
        if change < 0.0 {
            self.functions[index] = function;
            self.columns[index] = column;
        } else {
            column.add_to(&mut self.residual, function.weight);
            self.columns[index].add_to(&mut self.residual, -own);
        }
    }
}

/// Of functions that wait, some whose boxes do not overlap; and the rest.
fn apart(functions: &[Function], waiting: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let mut taken: Vec<[DVec3; 2]> = Vec::new();
    waiting.iter().partition(|index| {
        let function = &functions[**index];
        let half = function.half_box(NEAR);
        let [low, high] = [function.centre - half, function.centre + half];
        let is_apart = taken.iter().all(|[l, h]| low.cmpgt(*h).any() || high.cmplt(*l).any());
        if is_apart {
            taken.push([low, high]);
        }
        is_apart
    })
}
