//! A sum of functions, and the tree in which it is evaluated.

use std::fmt;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::function::{Basis, Function};
use super::points::Points;
use crate::core::progress::{Cancelled, Ticket};

/// Cells of the tree are split while more functions than this reach them.
const FEW: usize = 12;
/// Of the functions of a cell, what its parts may have on average for it to be split.
const MOST_KEPT: f64 = 0.8;
/// How often a cell is split at most.
const DEEPEST: u32 = 7;
/// Samples that are evaluated between two looks at the ticket.
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
        let sum = |of: fn(&f64) -> f64| differences.par_iter().map(of).sum::<f64>();
        Self {
            max: differences.par_iter().map(|d| d.abs()).reduce(|| 0.0, f64::max),
            mean: sum(|d| d.abs()) / count,
            rms: (sum(|d| d * d) / count).sqrt(),
        }
    }
}

/// s(x) = b + Σ wᵢ φ(|Sᵢ (x − cᵢ)|), where each function ends where it is below ε; within a box.
#[derive(Debug, Clone)]
pub struct Encoding {
    basis: Basis,
    bias: f64,
    epsilon: f64,
    functions: Vec<Function>,
    bounds: [DVec3; 2],
    tree: Cell,
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
    /// Of functions within a box. Those whose weight is ε at most reach nowhere, and are dropped.
    pub fn new(
        basis: Basis,
        bias: f64,
        epsilon: f64,
        functions: impl IntoIterator<Item = Function>,
        bounds: [DVec3; 2],
    ) -> Self {
        let reaches = |f: &Function| basis.reach_square(f.weight, epsilon).is_some();
        let functions: Vec<Function> = functions.into_iter().filter(reaches).collect();
        let all: Vec<u32> = (0..functions.len() as u32).collect();
        let boxes: Vec<[DVec3; 2]> = functions
            .iter()
            .map(|f| {
                let half = f.half_box(basis.reach_square(f.weight, epsilon).unwrap_or_default());
                [f.centre - half, f.centre + half]
            })
            .collect();
        let tree = Cell::of(&all, &boxes, bounds, 0);
        Self { basis, bias, epsilon, functions, bounds, tree }
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

    /// The sum at a place, also beyond the box: there by all functions.
    pub fn value(&self, at: DVec3) -> f64 {
        let [mut low, mut high] = self.bounds;
        if at.cmplt(low).any() || at.cmpgt(high).any() {
            return self.bias + self.functions.iter().map(|f| self.share(f, at)).sum::<f64>();
        }
        let mut cell = &self.tree;
        loop {
            match cell {
                Cell::Leaf(list) => {
                    let shares = list.iter().map(|i| self.share(&self.functions[*i as usize], at));
                    return self.bias + shares.sum::<f64>();
                }
                Cell::Split(cells) => {
                    let middle = (low + high) * 0.5;
                    let upper = at.cmpge(middle);
                    let bit = |axis| usize::from(upper.test(axis));
                    cell = &cells[bit(0) | bit(1) << 1 | bit(2) << 2];
                    low = DVec3::select(upper, middle, low);
                    high = DVec3::select(upper, high, middle);
                }
            }
        }
    }

    fn share(&self, function: &Function, at: DVec3) -> f64 {
        let square = function.square(at);
        match self.basis.reach_square(function.weight, self.epsilon) {
            Some(reach) if square <= reach => function.weight * self.basis.of_square(square),
            _ => 0.0,
        }
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
        let values = self.values(points.positions(), ticket)?;
        let pairs = values.iter().zip(points.values());
        Ok(Errors::of(&pairs.map(|(own, value)| value - own).collect::<Vec<_>>()))
    }

    /// How many cells its tree has.
    pub fn cells(&self) -> usize {
        self.tree.count()
    }
}

impl Cell {
    fn of(reaching: &[u32], boxes: &[[DVec3; 2]], [low, high]: [DVec3; 2], depth: u32) -> Self {
        let touches = |i: &&u32| {
            let [own_low, own_high] = boxes[**i as usize];
            own_low.cmple(high).all() && own_high.cmpge(low).all()
        };
        let list: Vec<u32> = reaching.iter().filter(touches).copied().collect();
        if list.len() <= FEW || depth == DEEPEST {
            return Self::Leaf(list);
        }
        let middle = (low + high) * 0.5;
        let part = |i: usize| {
            let upper = glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
            [DVec3::select(upper, middle, low), DVec3::select(upper, high, middle)]
        };
        let reach = |[low, high]: [DVec3; 2]| {
            let touches = |i: &&u32| {
                let [own_low, own_high] = boxes[**i as usize];
                own_low.cmple(high).all() && own_high.cmpge(low).all()
            };
            list.iter().filter(touches).count()
        };
        // Functions that reach nearly all eight gain nothing by being listed eight times.
        let in_parts: usize = (0..8).map(|i| reach(part(i))).sum();
        if in_parts as f64 > MOST_KEPT * 8.0 * list.len() as f64 {
            return Self::Leaf(list);
        }
        let cells: [Self; 8] = std::array::from_fn(|i| Self::of(&list, boxes, part(i), depth + 1));
        Self::Split(Box::new(cells))
    }

    fn count(&self) -> usize {
        match self {
            Self::Leaf(_) => 1,
            Self::Split(cells) => 1 + cells.iter().map(Self::count).sum::<usize>(),
        }
    }
}
