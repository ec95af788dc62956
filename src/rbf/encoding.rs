//! A sum of functions, and the tree in which it is evaluated.

use std::fmt;
use std::sync::OnceLock;

use glam::{BVec3, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::function::{Basis, Function};
use super::points::Points;
use crate::core::progress::{Cancelled, Ticket};

/// A cell that more functions reach is split.
const FEW: usize = 12;
/// A cell is split only if its eight parts keep no more than this share of its functions, on average.
const MOST_KEPT: f64 = 0.8;
/// Levels of the tree below its root, at most.
const DEEPEST: u32 = 7;
/// Places that are evaluated between two looks at the ticket.
const A_PART: usize = 4096;

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

impl fmt::Display for Errors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "greatest error {}, mean {}", four_digits(self.max), four_digits(self.mean))
    }
}

impl Errors {
    /// Of differences.
    pub fn of(differences: &[f64]) -> Self {
        let count = differences.len().max(1) as f64;
        // Parts are summed in their order, so that every run and any number of threads gives the same bits.
        let sum = |of: fn(&f64) -> f64| -> f64 {
            let parts = differences.par_chunks(A_PART).map(|part| part.iter().map(of).sum());
            parts.collect::<Vec<f64>>().iter().sum()
        };
        Self {
            max: differences.par_iter().map(|d| d.abs()).reduce(|| 0.0, f64::max),
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
    /// Their mean, each weighed by how near it is: Σ wᵢ φᵢ / Σ φᵢ (Shepard), φ less what it is where it ends. A constant
    /// stays one; nothing is where none reaches.
    Mean,
}

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
    bounds: [DVec3; 2],
    /// Made once a value is asked for: pictures have lists of their own.
    tree: OnceLock<Cell>,
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
        let blend = Blend::Sum;
        Self { basis, blend, bias, epsilon, functions, reaches, bounds, tree: OnceLock::new() }
    }

    /// The mean of ellipsoidal Gaussians, each of which ends at so many widths from its centre; it is told in the box about
    /// all of them. Their weights are less the bias.
    pub fn mean(bias: f64, reach: f64, functions: Vec<Function>) -> Self {
        let (basis, blend) = (Basis::Ellipsoid, Blend::Mean);
        let reaches = vec![reach * reach; functions.len()];
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = functions.iter().fold(none, |[low, high], function| {
            let half = function.half_box(reach * reach);
            [low.min(function.centre - half), high.max(function.centre + half)]
        });
        let epsilon = basis.of_square(reach * reach);
        Self { basis, blend, bias, epsilon, functions, reaches, bounds, tree: OnceLock::new() }
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

    /// The value at a place; not a number where none is. Beyond the box, where there is no tree, all functions of a sum are
    /// looked at; none of a mean reaches there.
    pub fn value(&self, at: DVec3) -> f64 {
        let mut bounds = self.bounds;
        if at.cmplt(bounds[0]).any() || at.cmpgt(bounds[1]).any() {
            return match self.blend {
                Blend::Sum => self.blended(0..self.functions.len(), at),
                Blend::Mean => f64::NAN,
            };
        }
        let mut cell = self.tree();
        let list = loop {
            match cell {
                Cell::Leaf(list) => break list,
                Cell::Split(cells) => {
                    let index = part_of(bounds, at);
                    (cell, bounds) = (&cells[index], part(bounds, index));
                }
            }
        };
        self.blended(list.iter().map(|i| *i as usize), at)
    }

    /// What some functions make of a place.
    fn blended(&self, all: impl Iterator<Item = usize>, at: DVec3) -> f64 {
        let (sum, total) = all.fold((0.0, 0.0), |(sum, total), i| {
            let phi = self.phi(i, at);
            (sum + self.functions[i].weight * phi, total + phi)
        });
        match self.blend {
            Blend::Sum => self.bias + sum,
            Blend::Mean if total > 0.0 => self.bias + sum / total,
            Blend::Mean => f64::NAN,
        }
    }

    /// How the value grows at a place, per world length along each axis. Of a sum Σ 2 w φ′ Sᵀ S (x − c), φ′ by the squared
    /// distance; of a mean the same of w − s, by Σ φ.
    pub fn gradient(&self, at: DVec3) -> DVec3 {
        let (own, scale) = match self.blend {
            Blend::Sum => (0.0, 1.0),
            Blend::Mean => {
                let total: f64 = (0..self.functions.len()).map(|i| self.phi(i, at)).sum();
                if total <= 0.0 {
                    return DVec3::ZERO;
                }
                (self.value(at) - self.bias, total.recip())
            }
        };
        let growth = |(function, reach): (&Function, &f64)| {
            let square = function.square(at);
            if square > *reach {
                return DVec3::ZERO;
            }
            let along = function.shape.transpose() * (function.shape * (at - function.centre));
            2.0 * (function.weight - own) * self.basis.slope(square) * along
        };
        self.functions.iter().zip(&self.reaches).map(growth).sum::<DVec3>() * scale
    }

    /// The squared distance, in widths, at which each function ends.
    pub fn reaches(&self) -> &[f64] {
        &self.reaches
    }

    /// φ of a function at a place; 0 where it does not reach. Of a mean less what it is where it ends, so that no step is
    /// there.
    fn phi(&self, index: usize, at: DVec3) -> f64 {
        let square = self.functions[index].square(at);
        let end = if self.blend == Blend::Mean { self.epsilon } else { 0.0 };
        if square > self.reaches[index] { 0.0 } else { self.basis.of_square(square) - end }
    }

    fn tree(&self) -> &Cell {
        self.tree.get_or_init(|| {
            #[expect(clippy::cast_possible_truncation, reason = "fewer functions than 2^32")]
            let all: Vec<u32> = (0..self.functions.len() as u32).collect();
            let about = |(function, reach): (&Function, &f64)| {
                let half = function.half_box(*reach);
                [function.centre - half, function.centre + half]
            };
            let boxes: Vec<_> = self.functions.iter().zip(&self.reaches).map(about).collect();
            Cell::of(touching(&all, &boxes, self.bounds), &boxes, self.bounds, 0)
        })
    }

    /// The values at many places.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn values(&self, places: &[DVec3], ticket: &Ticket) -> Result<Vec<f64>, Cancelled> {
        let parts: Result<Vec<Vec<f64>>, Cancelled> = places
            .par_chunks(A_PART)
            .map(|places| {
                if ticket.is_cancelled() {
                    return Err(Cancelled);
                }
                Ok(places.iter().map(|at| self.value(*at)).collect())
            })
            .collect();
        Ok(parts?.concat())
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

    /// How many cells its tree has.
    pub fn cells(&self) -> usize {
        self.tree().count()
    }
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

    fn count(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Split(cells) => 1 + cells.iter().map(Self::count).sum::<usize>(),
        }
    }
}
