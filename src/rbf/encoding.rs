//! A sum of functions, and the tree in which it is evaluated.

use std::fmt;
use std::sync::OnceLock;

use glam::{BVec3, DMat3, DVec3};
use rstar::RTree;
use rstar::primitives::{GeomWithData, Rectangle};
use serde::{Deserialize, Serialize};

use super::function::{Basis, Function};
use super::points::Points;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};
use crate::core::{Looks, plain_number};

/// A cell that more functions reach is split.
const FEW: usize = 12;
/// A cell is split only if its eight parts keep no more than this share of its functions, on average.
const MOST_KEPT: f64 = 0.8;
/// Levels of the tree below its root, at most.
const DEEPEST: u32 = 7;
/// Places that are evaluated between two looks at the ticket.
const A_PART: usize = 4096;
/// What a term of a sum in single precision is off by, in ε of that precision, besides what moves it.
const TERM_ROUNDING: f64 = 4.0;
/// Places in the box at which it is measured how far functions that may be left out change the sum.
const MEASURED: usize = 4096;
/// Of them, those that one thread takes at once.
const MEASURED_AT_ONCE: usize = 256;
/// Functions whose values there are added up between two looks at the ticket.
const BETWEEN_LOOKS: usize = 256;
/// What is measured there is taken to be off by a twentieth: places lie between others.
const UNMEASURED: f64 = 1.05;

/// How far a sum is from the samples, in their units.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Errors {
    /// The greatest difference.
    pub max: f64,
    /// The mean of the differences' sizes.
    pub mean: f64,
    /// The root of the mean of their squares.
    pub rms: f64,
}

/// A number to four digits.
pub(crate) fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The same as it stands in a sentence: never a row of zeros.
pub(crate) fn few_digits(value: f64) -> String {
    plain_number(four_digits(value))
}

impl fmt::Display for Errors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "greatest error {}, mean {}", few_digits(self.max), few_digits(self.mean))
    }
}

impl Errors {
    /// Of differences.
    pub fn of(differences: &[f64]) -> Self {
        let count = differences.len().max(1) as f64;
        // Parts are summed in their order, so that every run and any number of threads gives the same bits.
        let sum = |of: fn(&f64) -> f64| -> f64 {
            let parts: Vec<&[f64]> = differences.chunks(A_PART).collect();
            let sums = parallel::list(parts.len(), |part| parts[part].iter().map(of).sum::<f64>());
            sums.iter().sum()
        };
        Self {
            max: differences.iter().map(|d| d.abs()).fold(0.0, f64::max),
            mean: sum(|d| d.abs()) / count,
            rms: (sum(|d| d * d) / count).sqrt(),
        }
    }
}

/// How functions that overlap make one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Blend {
    /// Their sum (Jang).
    #[default]
    Sum,
    /// Their mean, each weighed by how near it is: Σ wᵢ hᵢ φᵢ / Σ hᵢ φᵢ (Shepard), φ less what it is where it ends. A constant
    /// stays one. Heights hᵢ make the *coverage* Σ hᵢ φᵢ about 1 / `SHARE` among functions, however they lie; nothing is where
    /// it is less than 1, so that a mean ends about as far beyond the last functions as these lie apart, halved. Functions
    /// without a weight take twice as much from the coverage as they would give, and nothing from the mean: they are holes.
    Mean,
}

/// Widths at which the functions of a mean end: 1.8 steps of a cubic lattice, whose places are 0.87 from a sample at most.
pub(super) const REACH: f64 = 3.0;
/// Of what covers places among functions, the share down to which a mean goes on beyond them: half a step beyond a lattice. Of
/// places among points at random a thousandth has less.
const SHARE: f64 = 0.4;
/// What a hole takes, of what a function of its width gives: so much makes it a step of a lattice wide.
const HOLE: f64 = 2.0;
/// The coverage from which on light falls as values grow; below it, down to 1, more and more as the border is turned.
pub const LIT: f64 = 2.25;
/// Widths beyond its last function that a mean reaches at most, or about so: there a function alone covers a third of what it
/// would have to.
const BORDER: f64 = 2.0;

/// The sum s(x) = b + Σ wᵢ φ(|Sᵢ (x − cᵢ)|) in a box, or the mean of the weights by φ. Each function counts only where it is
/// at least ε.
#[derive(Debug, Clone)]
pub struct Encoding {
    basis: Basis,
    blend: Blend,
    bias: f64,
    epsilon: f64,
    functions: Vec<Function>,
    /// The squared distance, in widths, at which each ends.
    reaches: Vec<f64>,
    /// Of a mean, what each is at its centre, less than 0 where it is a hole; empty of a sum.
    heights: Vec<f64>,
    /// Of a mean, how far its functions' weights lie apart, 1 where they do not; 0 of a sum.
    range: f64,
    bounds: [DVec3; 2],
    /// Made once a value is asked for: pictures have lists of their own.
    tree: OnceLock<Cell>,
    /// Made once some are left out.
    least: OnceLock<Least>,
}

/// The functions that are the first to be left out.
#[derive(Debug, Clone, Default)]
struct Least {
    /// Which, the least first.
    order: Vec<usize>,
    /// What so many of them are thought to be, rms over the box.
    rms: Vec<f64>,
}

/// A box, and what reaches it.
#[derive(Debug, Clone)]
enum Cell {
    /// Which functions.
    Leaf(Vec<u32>),
    /// Eight of half the sides, x fastest.
    Split(Box<[Cell; 8]>),
}

impl Encoding {
    /// A sum of functions within a box. Those whose weight is ε at most reach nowhere, and are dropped.
    pub fn new(
        basis: Basis,
        bias: f64,
        epsilon: f64,
        functions: impl IntoIterator<Item = Function>,
        bounds: [DVec3; 2],
    ) -> Self {
        let reaching =
            functions.into_iter().filter_map(|f| Some((f, basis.reach_square(f.weight, epsilon)?)));
        let (functions, reaches) = reaching.unzip();
        let (blend, tree, least) = (Blend::Sum, OnceLock::new(), OnceLock::new());
        let (heights, range) = (Vec::new(), 0.0);
        Self {
            basis,
            blend,
            bias,
            epsilon,
            functions,
            reaches,
            heights,
            range,
            bounds,
            tree,
            least,
        }
    }

    /// The mean of ellipsoidal Gaussians, told in the box about all places that it has. Those whose weight is not finite are holes.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn mean(mut functions: Vec<Function>, ticket: &Ticket) -> Result<Self, Cancelled> {
        let (basis, blend) = (Basis::Ellipsoid, Blend::Mean);
        let reaches = vec![REACH * REACH; functions.len()];
        let epsilon = basis.of_square(REACH * REACH);
        let is_there = |function: &&Function| function.weight.is_finite();
        let there = functions.iter().filter(is_there);
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let [least, most] =
            there.clone().fold(none, |[a, b], f| [a.min(f.weight), b.max(f.weight)]);
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = there.fold(none, |[low, high], function| {
            let [own_low, own_high] = box_about(function, BORDER * BORDER);
            [low.min(own_low), high.max(own_high)]
        });
        let heights = totals(&functions, epsilon, ticket)?.into_iter().zip(&functions);
        let height = |(total, function): (f64, &Function)| {
            (SHARE * total).recip() * if is_there(&function) { 1.0 } else { -HOLE }
        };
        let heights = heights.map(height).collect();
        let bias = if least <= most { least / 2.0 + most / 2.0 } else { 0.0 };
        for function in &mut functions {
            function.weight = if is_there(&&*function) { function.weight - bias } else { 0.0 };
        }
        // Where all are alike any will do.
        let range = if most > least { most - least } else { 1.0 };
        let empty = Self::new(basis, bias, epsilon, [], bounds);
        Ok(Self { blend, functions, reaches, heights, range, ..empty })
    }

    /// How functions that overlap make one value.
    pub fn blend(&self) -> Blend {
        self.blend
    }

    /// What its functions look like.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// The value where no function reaches.
    pub fn bias(&self) -> f64 {
        self.bias
    }

    /// Where functions end.
    pub fn epsilon(&self) -> f64 {
        self.epsilon
    }

    /// Its functions.
    pub fn functions(&self) -> &[Function] {
        &self.functions
    }

    /// The box in which it stands for samples, world: least and greatest x, y, z.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The value at a place; not a number where none is.
    pub fn value(&self, at: DVec3) -> f64 {
        match self.blend {
            Blend::Sum => {
                let mut sum = 0.0;
                self.each_about(at, |i| sum += self.functions[i].weight * self.phi(i, at));
                self.bias + sum
            }
            Blend::Mean => {
                let found = self.weighed(at);
                if found.coverage < 1.0 { f64::NAN } else { self.bias + found.mean() }
            }
        }
    }

    /// Of a mean, how far functions cover a place: it has a value from 1 on.
    pub fn coverage(&self, at: DVec3) -> f64 {
        self.weighed(at).coverage
    }

    /// Calls with the functions that may reach a place. Beyond the box, where there is no tree, all functions of a sum may; a mean
    /// has nothing there.
    fn each_about(&self, at: DVec3, mut call: impl FnMut(usize)) {
        let [low, high] = self.bounds;
        if at.cmpge(low).all() && at.cmple(high).all() {
            self.near(at).iter().for_each(|i| call(*i as usize));
        } else if self.blend == Blend::Sum {
            (0..self.functions.len()).for_each(call);
        }
    }

    /// The sums at a place that a mean is made of.
    fn weighed(&self, at: DVec3) -> Weighed {
        let mut found = Weighed::default();
        self.each_about(at, |i| {
            let (function, height) = (&self.functions[i], self.heights[i]);
            let square = function.square(at);
            if square > self.reaches[i] {
                return;
            }
            let share = height * (self.basis.of_square(square) - self.epsilon);
            let along = function.shape.transpose() * (function.shape * (at - function.centre));
            let growth = 2.0 * height * self.basis.slope(square) * along;
            found.coverage += share;
            found.thickening += growth;
            if height > 0.0 {
                found.sum += function.weight * share;
                found.total += share;
                found.sum_growth += function.weight * growth;
                found.total_growth += growth;
            }
        });
        found
    }

    /// The functions that may reach a place in the box.
    fn near(&self, at: DVec3) -> &[u32] {
        let (mut cell, mut bounds) = (self.tree(), self.bounds);
        loop {
            match cell {
                Cell::Leaf(list) => return list,
                Cell::Split(cells) => {
                    let index = part_of(bounds, at);
                    (cell, bounds) = (&cells[index], part(bounds, index));
                }
            }
        }
    }

    /// About how far sums in single precision are off at most, as engines draw them: the greatest Σ |wᵢ| φᵢ ε at any function's
    /// centre, where ε is also what rounding places across the box moves them by, up a function's steepest flank. Where weights
    /// of opposite signs cancel it may be more than what is left of the sum.
    pub fn rounding(&self) -> f64 {
        let [low, high] = self.bounds;
        let [steepest, _] = self.basis.steepest(0.0);
        let size = high - low;
        let term = |function: &Function| {
            let across = |axis: usize| function.shape.col(axis).length() * size[axis];
            let widths = across(0).max(across(1)).max(across(2));
            function.weight.abs() * (TERM_ROUNDING + steepest * widths)
        };
        let terms: Vec<f64> = self.functions.iter().map(term).collect();
        let at_centre = |function: &Function| -> f64 {
            let at = function.centre.clamp(low, high);
            let near = self.near(at).iter().map(|i| *i as usize);
            near.map(|i| terms[i] * self.phi(i, at)).sum()
        };
        let at_centre = |i: usize| at_centre(&self.functions[i]);
        let greatest = parallel::merged(self.functions.len(), || 0.0, at_centre, f64::max);
        greatest * f64::from(f32::EPSILON)
    }

    /// How the value grows at a place, per world length along each axis. Of a sum Σ 2 w φ′ Sᵀ S (x − c), φ′ by the squared
    /// distance; of a mean the same of (w − s) h, by Σ h φ.
    pub fn gradient(&self, at: DVec3) -> DVec3 {
        match self.blend {
            Blend::Mean => self.weighed(at).growth(),
            Blend::Sum => {
                let mut sum = DVec3::ZERO;
                self.each_about(at, |i| {
                    let function = &self.functions[i];
                    let square = function.square(at);
                    if square <= self.reaches[i] {
                        let along =
                            function.shape.transpose() * (function.shape * (at - function.centre));
                        sum += 2.0 * function.weight * self.basis.slope(square) * along;
                    }
                });
                sum
            }
        }
    }

    /// What light takes for that growth of a mean: near its border, where coverage c is below [`LIT`], inwards as coverage grows
    /// besides, by ((LIT − c) / (LIT − 1))² ∇c times the range of its values. A surface and its back are lit alike.
    ///
    /// Per step along each of `axes`, the columns of a lattice's: by these it is told what is alike, too, as engines do, which know
    /// no others.
    pub fn growth_for_light(&self, at: DVec3, axes: DMat3) -> DVec3 {
        let found = self.weighed(at);
        let near = ((LIT - found.coverage) / (LIT - 1.0)).clamp(0.0, 1.0);
        let per_step = axes.transpose();
        let border = per_step * found.thickening * (self.range * near * near);
        let growth = per_step * found.growth();
        if border.dot(growth) < 0.0 { border - growth } else { border + growth }
    }

    /// Of a mean, what each function is at its centre, less than 0 where it is a hole; empty of a sum.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Of a mean, how far its functions' weights lie apart, 1 where they do not; 0 of a sum.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// The squared distance, in widths, at which each function ends.
    pub fn reaches(&self) -> &[f64] {
        &self.reaches
    }

    /// φ of a function at a place; 0 where it does not reach.
    fn phi(&self, index: usize, at: DVec3) -> f64 {
        let square = self.functions[index].square(at);
        if square > self.reaches[index] { 0.0 } else { self.basis.of_square(square) }
    }

    fn tree(&self) -> &Cell {
        self.tree.get_or_init(|| {
            #[expect(clippy::cast_possible_truncation, reason = "fewer functions than 2^32")]
            let all: Vec<u32> = (0..self.functions.len() as u32).collect();
            let reaches = self.functions.iter().zip(&self.reaches);
            let boxes: Vec<_> =
                reaches.map(|(function, reach)| box_about(function, *reach)).collect();
            Cell::of(touching(&all, &boxes, self.bounds), &boxes, self.bounds, 0)
        })
    }

    /// The values at many places.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn values(&self, places: &[DVec3], ticket: &Ticket) -> Result<Vec<f64>, Cancelled> {
        parallel::try_list(places.len(), |i| {
            match i.is_multiple_of(A_PART) && ticket.is_cancelled() {
                true => Err(Cancelled),
                false => Ok(self.value(places[i])),
            }
        })
    }

    /// How far it is from samples.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn errors(&self, points: &Points, ticket: &Ticket) -> Result<Errors, Cancelled> {
        Ok(Errors::of(&self.differences(points, ticket)?))
    }

    /// What it leaves of samples, one a point.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn differences(&self, points: &Points, ticket: &Ticket) -> Result<Vec<f64>, Cancelled> {
        let values = self.values(points.positions(), ticket)?;
        Ok(values.iter().zip(points.values()).map(|(own, value)| value - own).collect())
    }

    /// The sum without its least functions, by their L2 norms: as many as it can do without while what is left out is thought
    /// to be no more than `max_rms`, rms over the box, in the units of values. A mean keeps all of them, and so does a sum
    /// that may not be off at all.
    #[must_use]
    pub fn without_least(&self, max_rms: f64) -> Self {
        let mut is_kept = vec![true; self.functions.len()];
        self.least_of(max_rms).0.iter().for_each(|i| is_kept[*i] = false);
        let kept = |(function, is_kept): (&Function, &bool)| is_kept.then_some(*function);
        let functions = self.functions.iter().zip(&is_kept).filter_map(kept).collect();
        let kept = |(reach, is_kept): (&f64, &bool)| is_kept.then_some(*reach);
        let reaches = self.reaches.iter().zip(&is_kept).filter_map(kept).collect();
        let heights = self.heights.clone();
        let (tree, least) = (OnceLock::new(), OnceLock::new());
        Self { functions, reaches, heights, tree, least, ..*self }
    }

    /// How many functions [`Encoding::without_least`] leaves out, and what they are thought to be, rms over the box.
    pub fn left_out(&self, max_rms: f64) -> (usize, f64) {
        let (least, rms) = self.least_of(max_rms);
        (least.len(), rms)
    }

    /// Which functions [`Encoding::without_least`] leaves out, and their rms.
    fn least_of(&self, max_rms: f64) -> (&[usize], f64) {
        if max_rms.is_nan() || max_rms <= 0.0 {
            return (&[], 0.0);
        }
        let least = || self.least(&Ticket::new()).unwrap_or_default();
        let Least { order, rms } = self.least.get_or_init(least);
        match rms.iter().rposition(|rms| *rms <= max_rms) {
            Some(last) => (&order[..=last], rms[last]),
            None => (&[], 0.0),
        }
    }

    /// By the diagonal of their Gram matrix, the squares of their norms, it is known what functions are where they do not
    /// overlap, however narrow they are; by what they add up to at places all over the box, where they do. The greater of the
    /// two counts.
    fn least(&self, ticket: &Ticket) -> Result<Least, Cancelled> {
        let size = self.bounds[1] - self.bounds[0];
        let volume = size.x * size.y * size.z;
        // A box without volume has no mean over it.
        if self.blend == Blend::Mean || !volume.is_finite() || volume <= 0.0 {
            return Ok(Least::default());
        }
        let square = |i: usize| {
            let function = &self.functions[i];
            let in_widths = function.shape.determinant().abs() * volume;
            let integral = self.basis.square_integral(self.reaches[i], in_widths);
            function.weight.powi(2) * integral / in_widths
        };
        let squares: Vec<f64> = (0..self.functions.len()).map(square).collect();
        let mut order: Vec<usize> = (0..squares.len()).collect();
        order.sort_by(|a, b| squares[*a].total_cmp(&squares[*b]).then(a.cmp(b)));
        let mut diagonal = 0.0;
        let measured = self.measured(&order, ticket)?;
        let rms = |(i, measured): (&usize, &f64)| {
            diagonal += squares[*i];
            diagonal.sqrt().max(UNMEASURED * measured.sqrt())
        };
        let rms = order.iter().zip(&measured).map(rms).collect();
        Ok(Least { order, rms })
    }

    /// Finds which functions are the first to be left out, which takes seconds of many; who asks for them later has them then.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn find_least(&self, ticket: &Ticket) -> Result<(), Cancelled> {
        if self.least.get().is_none() {
            // Somebody else may have been sooner: it is the same.
            self.least.set(self.least(ticket)?).ok();
        }
        Ok(())
    }

    /// The mean square, over places all over the box, of what the first of some functions add up to, from one of them to all.
    fn measured(&self, order: &[usize], ticket: &Ticket) -> Result<Vec<f64>, Cancelled> {
        let [low, high] = self.bounds;
        // Roberts' sequence fills a box evenly, whatever the number of places.
        let root = 1.220_744_084_6_f64;
        let steps = DVec3::new(root.recip(), root.powi(-2), root.powi(-3));
        let parts = parallel::try_list(MEASURED / MEASURED_AT_ONCE, |part| {
            let first = part * MEASURED_AT_ONCE;
            let places = (first..first + MEASURED_AT_ONCE).map(|i| {
                let share = (0.5 + steps * i as f64).fract();
                low + (high - low) * share
            });
            let places: Vec<DVec3> = places.collect();
            let mut sums = vec![0.0; places.len()];
            let mut looks = Looks::every(ticket, BETWEEN_LOOKS);
            let square = |i: &usize| {
                looks.after(1)?;
                let weight = self.functions[*i].weight;
                for (sum, at) in sums.iter_mut().zip(&places) {
                    *sum += weight * self.phi(*i, *at);
                }
                Ok(sums.iter().map(|sum| sum * sum).sum::<f64>())
            };
            order.iter().map(square).collect::<Result<Vec<f64>, Cancelled>>()
        })?;
        // In their order, so that any number of threads gives the same bits.
        let mean = |i: usize| parts.iter().map(|part| part[i]).sum::<f64>() / MEASURED as f64;
        Ok((0..order.len()).map(mean).collect())
    }

    /// How many cells its tree has.
    pub fn cells(&self) -> usize {
        self.tree().count()
    }

    /// The cells of its tree that are not split: the box of each, world, and how many functions it lists.
    pub fn leaves(&self) -> Vec<([DVec3; 2], usize)> {
        let mut leaves = Vec::new();
        self.tree().leaves(self.bounds, &mut leaves);
        leaves
    }
}

/// What a mean is made of at a place.
#[derive(Debug, Clone, Copy, Default)]
struct Weighed {
    /// Σ w h φ and Σ h φ of functions with a weight, and how they grow.
    sum: f64,
    total: f64,
    sum_growth: DVec3,
    total_growth: DVec3,
    /// Σ h φ of all, and how it grows.
    coverage: f64,
    thickening: DVec3,
}

impl Weighed {
    /// 0 where there is nothing to weigh.
    fn mean(&self) -> f64 {
        if self.total > 0.0 { self.sum / self.total } else { 0.0 }
    }

    fn growth(&self) -> DVec3 {
        match self.total > 0.0 {
            true => (self.sum_growth - self.mean() * self.total_growth) / self.total,
            false => DVec3::ZERO,
        }
    }
}

/// What the functions of a mean, holes as well, add up to at the centre of each, were all of them as high. By a tree of their boxes,
/// which has any sizes beside each other: they may be a thousand times as large in one place as in another.
fn totals(functions: &[Function], epsilon: f64, ticket: &Ticket) -> Result<Vec<f64>, Cancelled> {
    let boxed = |(i, function): (usize, &Function)| {
        let [low, high] = box_about(function, REACH * REACH).map(|at| at.to_array());
        GeomWithData::new(Rectangle::from_corners(low, high), i)
    };
    let tree = RTree::bulk_load(functions.iter().enumerate().map(boxed).collect());
    parallel::try_list(functions.len(), |i| {
        if i.is_multiple_of(A_PART) && ticket.is_cancelled() {
            return Err(Cancelled);
        }
        let at = functions[i].centre;
        let share = |near: &GeomWithData<Rectangle<[f64; 3]>, usize>| {
            let square = functions[near.data].square(at);
            (Basis::Ellipsoid.of_square(square) - epsilon).max(0.0)
        };
        Ok(tree.locate_all_at_point(at.to_array()).map(share).sum())
    })
}

/// The box about all places within a squared distance of a function, in widths.
fn box_about(function: &Function, square: f64) -> [DVec3; 2] {
    let half = function.half_box(square);
    [function.centre - half, function.centre + half]
}

/// One of the eight parts of a box, x fastest.
fn part([low, high]: [DVec3; 2], index: usize) -> [DVec3; 2] {
    let middle = (low + high) * 0.5;
    let upper = BVec3::new(index & 1 != 0, index & 2 != 0, index & 4 != 0);
    [DVec3::select(upper, middle, low), DVec3::select(upper, high, middle)]
}

/// Which of the eight parts of a box a place in it lies in.
fn part_of([low, high]: [DVec3; 2], at: DVec3) -> usize {
    let upper = at.cmpge((low + high) * 0.5);
    (0..3).map(|axis| usize::from(upper.test(axis)) << axis).sum()
}

/// Those of a list whose boxes touch another.
fn touching(list: &[u32], boxes: &[[DVec3; 2]], [low, high]: [DVec3; 2]) -> Vec<u32> {
    let touches = |i: &&u32| {
        let [own_low, own_high] = boxes[**i as usize];
        own_low.cmple(high).all() && own_high.cmpge(low).all()
    };
    list.iter().filter(touches).copied().collect()
}

impl Cell {
    /// Of the functions that reach a box.
    fn of(list: Vec<u32>, boxes: &[[DVec3; 2]], bounds: [DVec3; 2], depth: u32) -> Self {
        if list.len() <= FEW || depth == DEEPEST {
            return Self::Leaf(list);
        }
        let lists: [Vec<u32>; 8] = std::array::from_fn(|i| touching(&list, boxes, part(bounds, i)));
        // Functions that reach nearly all eight gain nothing by being listed eight times.
        let in_parts: usize = lists.iter().map(Vec::len).sum();
        if in_parts as f64 > MOST_KEPT * 8.0 * list.len() as f64 {
            return Self::Leaf(list);
        }
        let mut index = 0;
        let cells = lists.map(|list| {
            let bounds = part(bounds, index);
            index += 1;
            Self::of(list, boxes, bounds, depth + 1)
        });
        Self::Split(Box::new(cells))
    }

    /// Adds those of a cell in this box that are not split.
    fn leaves(&self, bounds: [DVec3; 2], into: &mut Vec<([DVec3; 2], usize)>) {
        match self {
            Self::Leaf(list) => into.push((bounds, list.len())),
            Self::Split(cells) => {
                for (index, cell) in cells.iter().enumerate() {
                    cell.leaves(part(bounds, index), into);
                }
            }
        }
    }

    fn count(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Split(cells) => 1 + cells.iter().map(Self::count).sum::<usize>(),
        }
    }
}
