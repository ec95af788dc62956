//! The functions of an encoding over a lattice: in its index space, listed by cells.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec3};

use super::encoding::{Blend, Encoding};
use super::function::{Basis, Function};
use crate::core::{Cancelled, Looks, Ticket};

/// Cells along an axis, at most: more would gain nothing, since functions reach across many of them.
const MOST_CELLS: usize = 32;
/// Samples along the edge of a cell, at least.
const LEAST_EDGE: usize = 4;
/// Entries of all lists, at most; cells are larger where they would be more.
const MOST_ENTRIES: usize = 1 << 26;
/// Functions placed, or cells that one may reach, between two looks at the ticket.
const A_PART: usize = 1 << 14;
/// A function is as much work as so many cells.
const A_FUNCTION: usize = 16;

/// The functions of an encoding, less its bias, in the index space of a lattice, and which of them reach each of its cells.
///
/// Cells are cubes of so many samples along each edge. The first begins half a sample before the first sample.
#[derive(Debug, Clone)]
pub struct Listed {
    /// What the functions look like.
    pub basis: Basis,
    /// How those that overlap make one value.
    pub blend: Blend,
    /// Where functions end.
    pub epsilon: f64,
    /// The functions, in index space.
    pub functions: Vec<Function>,
    /// The squared distance, in widths, at which each ends.
    pub reaches: Vec<f64>,
    /// Samples along the lattice's axes.
    pub dims: [usize; 3],
    /// Samples along the edge of a cell.
    pub edge: usize,
    /// Cells along each axis.
    pub cells: [usize; 3],
    /// Where the list of each cell begins, x fastest, and where the last ends.
    pub starts: Vec<u32>,
    /// Which functions, cell by cell.
    pub lists: Vec<u32>,
}

impl Listed {
    /// Over a lattice of `dims` samples, the world steps between which are the columns of `axes`.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "32³ cells, and few enough functions")]
    pub fn new(
        encoding: &Encoding,
        (dims, axes, origin): ([usize; 3], DMat3, DVec3),
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let mut looks = Looks::every(ticket, A_PART);
        let mut functions = Vec::with_capacity(encoding.functions().len());
        for function in encoding.functions() {
            looks.after(A_FUNCTION)?;
            functions.push(function.seen_from(axes, origin));
        }
        let reaches = encoding.reaches().to_vec();
        let (edge, cells) = cells_for(&functions, &reaches, dims, ticket)?;
        let mut starts = vec![0_u32; cells.iter().product::<usize>() + 1];
        let mut touched: Vec<[u32; 2]> = Vec::new();
        for (i, (function, reach)) in functions.iter().zip(&reaches).enumerate() {
            let before = touched.len();
            touch(function, *reach, (edge, cells), |cell| {
                starts[cell + 1] += 1;
                touched.push([cell as u32, i as u32]);
            });
            looks.after(touched.len() - before + A_FUNCTION)?;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut lists = vec![0; touched.len()];
        for [cell, function] in touched {
            looks.after(1)?;
            let at = &mut next[cell as usize];
            lists[*at as usize] = function;
            *at += 1;
        }
        let (basis, blend, epsilon) = (encoding.basis(), encoding.blend(), encoding.epsilon());
        Ok(Self { basis, blend, epsilon, functions, reaches, dims, edge, cells, starts, lists })
    }

    /// Bytes of memory.
    pub fn size_bytes(&self) -> usize {
        size_of_val(&self.functions[..])
            + size_of_val(&self.reaches[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.lists[..])
    }

    /// The list of a cell.
    fn list(&self, [x, y, z]: [usize; 3]) -> &[u32] {
        let cell = (z * self.cells[1] + y) * self.cells[0] + x;
        &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Boxes about the functions of a mean, each with its weight: no value is beyond those of the functions that reach it.
    pub fn boxes(&self) -> impl Iterator<Item = ([DVec3; 2], [f64; 2])> {
        self.functions.iter().zip(&self.reaches).map(|(function, reach)| {
            let half = function.half_box(*reach);
            ([function.centre - half, function.centre + half], [function.weight; 2])
        })
    }

    /// The sum at a place of index space in the lattice, less the bias.
    pub fn value(&self, at: DVec3) -> f64 {
        let cell = cell_of(at, (self.edge as f64, self.cells));
        let share = |i: &u32| {
            let function = &self.functions[*i as usize];
            let square = function.square(at);
            let is_there = square <= self.reaches[*i as usize];
            if is_there { function.weight * self.basis.of_square(square) } else { 0.0 }
        };
        self.list(cell).iter().map(share).sum()
    }

    /// How far the sum within a box can be beyond the least and the greatest of the sums at the samples about it. Between
    /// samples it is off the straight lines through them by an eighth of its second derivative along each axis at most;
    /// beyond the last sample by half its first. Where functions end, each leaves a step of up to ε.
    pub fn slack(&self, low: DVec3, high: DVec3) -> f64 {
        let last = DVec3::from(self.dims.map(|n| n as f64 - 1.0));
        let is_beyond = [0, 1, 2].map(|axis| low[axis] < 0.0 || high[axis] > last[axis]);
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let mut slack = 0.0;
        for i in self.near(low, high) {
            let function = &self.functions[i];
            let speeds = [0, 1, 2].map(|axis| function.shape.col(axis).length());
            let radius: f64 = (0..3).map(|axis| speeds[axis] * half[axis]).sum();
            let nearest = (function.square(middle).sqrt() - radius).max(0.0);
            if nearest * nearest > self.reaches[i] {
                continue;
            }
            let [first, second] = self.basis.steepest(nearest);
            let weight = function.weight.abs();
            for axis in 0..3 {
                slack += weight * second * speeds[axis] * speeds[axis] / 8.0;
                if is_beyond[axis] {
                    slack += weight * first * speeds[axis] / 2.0;
                }
            }
            slack += self.epsilon;
        }
        slack
    }

    /// The functions that reach the cells of a box.
    fn near(&self, low: DVec3, high: DVec3) -> Vec<usize> {
        let [low, high] = [low, high].map(|place| cell_of(place, (self.edge as f64, self.cells)));
        let mut all: Vec<u32> = Vec::new();
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    all.extend(self.list([x, y, z]));
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        all.into_iter().map(|i| i as usize).collect()
    }
}

/// Samples along the edge of a cell, and cells along each axis: as fine as lists have room for.
fn cells_for(
    functions: &[Function],
    reaches: &[f64],
    dims: [usize; 3],
    ticket: &Ticket,
) -> Result<(usize, [usize; 3]), Cancelled> {
    let mut looks = Looks::every(ticket, A_PART);
    let mut edge = dims.iter().map(|n| n.div_ceil(MOST_CELLS)).fold(LEAST_EDGE, usize::max);
    loop {
        let cells = dims.map(|n| n.div_ceil(edge));
        let mut entries = 0;
        for (function, reach) in functions.iter().zip(reaches) {
            looks.after(A_FUNCTION)?;
            let [low, high] = spans(function, *reach, (edge as f64, cells));
            entries += (0..3).map(|axis| high[axis] - low[axis] + 1).product::<usize>();
            if entries > MOST_ENTRIES {
                break;
            }
        }
        if entries <= MOST_ENTRIES || cells == [1; 3] {
            return Ok((edge, cells));
        }
        edge *= 2;
    }
}

/// The first and the last cell along each axis that the box about a function touches.
fn spans(function: &Function, reach: f64, cells: (f64, [usize; 3])) -> [[usize; 3]; 2] {
    let half = function.half_box(reach);
    [function.centre - half, function.centre + half].map(|corner| cell_of(corner, cells))
}

/// The cell that a place lies in, or the nearest.
fn cell_of(place: DVec3, (edge, cells): (f64, [usize; 3])) -> [usize; 3] {
    [0, 1, 2].map(|axis| {
        let cell = ((place[axis] + 0.5) / edge).floor();
        cell.clamp(0.0, (cells[axis] - 1) as f64) as usize
    })
}

/// The cells that a function reaches, and some more at its corners.
fn touch(
    function: &Function,
    reach: f64,
    (edge, cells): (usize, [usize; 3]),
    mut touched: impl FnMut(usize),
) {
    let edge = edge as f64;
    let [low, high] = spans(function, reach, (edge, cells));
    let span = |axis: usize| -> RangeInclusive<usize> { low[axis]..=high[axis] };
    // No place of a cell is farther from its middle than this, in widths.
    let radius: f64 = (0..3).map(|axis| function.shape.col(axis).length() * edge / 2.0).sum();
    let beyond = reach.sqrt() + radius;
    for z in span(2) {
        for y in span(1) {
            for x in span(0) {
                let middle = (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * edge - 0.5;
                if function.square(middle) <= beyond * beyond {
                    touched((z * cells[1] + y) * cells[0] + x);
                }
            }
        }
    }
}
