//! The functions of an encoding over a lattice: in its index space, listed by cells.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec3};

use super::encoding::{Blend, Encoding};
use super::function::{Basis, Function};
use crate::core::parallel;
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
    /// Of a mean, what each is at its centre, less than 0 where it is a hole; empty of a sum.
    pub heights: Vec<f64>,
    /// How far the weights of a mean lie apart, 1 where they do not; 0 of a sum.
    pub range: f64,
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
    /// What cells leave out, where any does.
    pub left_out: Option<LeftOut>,
}

/// What the cells of [`Listed`] leave out, each the functions that are least in it.
///
/// Jang's cells are those of an octree, split until each has few functions. These are as small everywhere as that would make
/// them where functions lie densest, and are found without a walk: lists are no longer than the octree's, and since all cells
/// are of one size, every corner of one is a corner of its neighbours, so that values are exact there on all sides.
#[derive(Debug, Clone)]
pub struct LeftOut {
    /// What the functions that each cell leaves out add up to at its corners, x fastest; empty where nothing is added for them.
    pub corners: Vec<[f64; 8]>,
    /// The lists of all functions that reach each cell, as those of [`Listed`].
    starts: Vec<u32>,
    lists: Vec<u32>,
    /// How far values in each cell may be off for it.
    off: Vec<f64>,
}

/// A cell that may leave functions out.
struct Limited {
    kept: Vec<u32>,
    corners: [f64; 8],
    off: f64,
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
        let left_out = None;
        let (heights, range) = (encoding.heights().to_vec(), encoding.range());
        Ok(Self {
            basis,
            blend,
            epsilon,
            functions,
            reaches,
            heights,
            range,
            dims,
            edge,
            cells,
            starts,
            lists,
            left_out,
        })
    }

    /// The same with at most so many functions in each cell, those that are greatest in it (Jang, section 5). What a cell
    /// leaves out is known at its corners; between them it is interpolated and added, where `corrects` asks for it. A sum that
    /// no cell has more functions of, and a mean, stay as they are.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn limited(
        mut self,
        most: usize,
        corrects: bool,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let longest = self.starts.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        if longest as usize <= most || self.blend == Blend::Mean {
            return Ok(self);
        }
        let cells = parallel::try_list(self.starts.len() - 1, |cell| match ticket.is_cancelled() {
            true => Err(Cancelled),
            false => Ok(self.limited_cell(cell, most, corrects)),
        });
        let (mut starts, mut lists) = (vec![0_u32], Vec::new());
        let (mut corners, mut off) = (Vec::new(), Vec::new());
        for cell in cells? {
            lists.extend(cell.kept);
            #[expect(clippy::cast_possible_truncation, reason = "fewer than before")]
            starts.push(lists.len() as u32);
            if corrects {
                corners.push(cell.corners);
            }
            off.push(cell.off);
        }
        let starts = std::mem::replace(&mut self.starts, starts);
        let lists = std::mem::replace(&mut self.lists, lists);
        self.left_out = Some(LeftOut { corners, starts, lists, off });
        Ok(self)
    }

    /// What a cell keeps of its list, and what it is off by for it.
    fn limited_cell(&self, cell: usize, most: usize, corrects: bool) -> Limited {
        let list = &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        let [nx, ny, _] = self.cells;
        let at = DVec3::from([cell % nx, cell / nx % ny, cell / (nx * ny)].map(|i| i as f64));
        let edge = self.edge as f64;
        let low = at * edge - 0.5;
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            low + DVec3::from([i & 1, i >> 1 & 1, i >> 2].map(|upper| upper as f64)) * edge
        });
        let greatest = |i: u32| {
            let nearest = self.functions[i as usize].centre.clamp(low, low + edge);
            let places = corners.iter().chain([&nearest]);
            places.map(|place| self.share(i, *place).abs()).fold(0.0, f64::max)
        };
        let mut ranked: Vec<(f64, u32)> = list.iter().map(|&i| (greatest(i), i)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut left_out: Vec<u32> = ranked.iter().skip(most).map(|(_, i)| *i).collect();
        let mut kept: Vec<u32> = ranked.iter().take(most).map(|(_, i)| *i).collect();
        // In their order, so that sums are rounded alike.
        left_out.sort_unstable();
        kept.sort_unstable();
        let corners =
            corners.map(|corner| left_out.iter().map(|&i| self.share(i, corner)).sum::<f64>());
        let middle = low + edge / 2.0;
        let off = left_out.iter().map(|&i| self.off_by(i as usize, middle, corrects)).sum();
        Limited { kept, corners, off }
    }

    /// How far values in a cell about a place may be off without a function. What is added for it has no other sign than the
    /// function, and is no greater; and it is off the straight lines through the corners by an eighth of its second derivative
    /// along each axis at most, and by the step where it ends.
    fn off_by(&self, i: usize, middle: DVec3, corrects: bool) -> f64 {
        let (function, edge) = (&self.functions[i], self.edge as f64);
        let speeds = [0, 1, 2].map(|axis| function.shape.col(axis).length());
        let radius: f64 = speeds.iter().map(|speed| speed * edge / 2.0).sum();
        let nearest = (function.square(middle).sqrt() - radius).max(0.0);
        if nearest * nearest > self.reaches[i] {
            return 0.0;
        }
        let weight = function.weight.abs();
        let whole = weight * self.basis.of_square(nearest * nearest);
        if !corrects {
            return whole;
        }
        let [_, second] = self.basis.steepest(nearest);
        let squares: f64 = speeds.iter().map(|speed| speed * speed).sum();
        whole.min(weight * second * squares * edge * edge / 8.0 + self.epsilon)
    }

    /// Bytes of memory.
    pub fn size_bytes(&self) -> usize {
        let left_out = self.left_out.as_ref().map_or(0, |left_out| {
            size_of_val(&left_out.corners[..])
                + size_of_val(&left_out.starts[..])
                + size_of_val(&left_out.lists[..])
                + size_of_val(&left_out.off[..])
        });
        size_of_val(&self.functions[..])
            + size_of_val(&self.reaches[..])
            + size_of_val(&self.heights[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.lists[..])
            + left_out
    }

    /// Which cell it is, x fastest.
    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// The list of a cell.
    fn list(&self, cell: [usize; 3]) -> &[u32] {
        let cell = self.number(cell);
        &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The list of all functions that reach a cell, whatever it leaves out.
    fn whole_list(&self, cell: [usize; 3]) -> &[u32] {
        let Some(LeftOut { starts, lists, .. }) = &self.left_out else { return self.list(cell) };
        let cell = self.number(cell);
        &lists[starts[cell] as usize..starts[cell + 1] as usize]
    }

    /// Places along an axis where one cell ends and the next begins.
    pub fn faces(&self, axis: usize) -> impl Iterator<Item = f64> {
        (1..self.cells[axis]).map(|cell| (cell * self.edge) as f64 - 0.5)
    }

    /// Boxes about the functions of a mean that are no holes, each with its weight: no value is beyond those of the functions that
    /// reach it.
    pub fn boxes(&self) -> impl Iterator<Item = ([DVec3; 2], [f64; 2])> {
        let all = self.functions.iter().zip(&self.reaches).zip(&self.heights);
        all.filter(|(_, height)| **height > 0.0).map(|((function, reach), _)| {
            let half = function.half_box(*reach);
            ([function.centre - half, function.centre + half], [function.weight; 2])
        })
    }

    /// The sum at a place of index space in the lattice, less the bias.
    pub fn value(&self, at: DVec3) -> f64 {
        let cell = cell_of(at, (self.edge as f64, self.cells));
        let sum: f64 = self.list(cell).iter().map(|&i| self.share(i, at)).sum();
        match self.added(cell, at) {
            Some((added, _)) => sum + added,
            None => sum,
        }
    }

    /// How the sum grows per index at a place: Σ 2 w φ′ Sᵀ S (x − c), φ′ by the squared distance.
    pub fn gradient(&self, at: DVec3) -> DVec3 {
        let cell = cell_of(at, (self.edge as f64, self.cells));
        let growth = |i: &u32| {
            let function = &self.functions[*i as usize];
            let square = function.square(at);
            if square > self.reaches[*i as usize] {
                return DVec3::ZERO;
            }
            let along = function.shape.transpose() * (function.shape * (at - function.centre));
            2.0 * function.weight * self.basis.slope(square) * along
        };
        let sum: DVec3 = self.list(cell).iter().map(growth).sum();
        match self.added(cell, at) {
            Some((_, growth)) => sum + growth,
            None => sum,
        }
    }

    /// What a function gives to a place; nothing where it does not reach.
    fn share(&self, i: u32, at: DVec3) -> f64 {
        let function = &self.functions[i as usize];
        let square = function.square(at);
        let is_there = square <= self.reaches[i as usize];
        if is_there { function.weight * self.basis.of_square(square) } else { 0.0 }
    }

    /// What is added at a place for the functions that its cell leaves out, and how that grows per index.
    fn added(&self, cell: [usize; 3], at: DVec3) -> Option<(f64, DVec3)> {
        let corners = self.left_out.as_ref()?.corners.get(self.number(cell))?;
        let edge = self.edge as f64;
        let part = (at + 0.5) / edge - DVec3::from(cell.map(|i| i as f64));
        let (value, growth) = between(corners, part);
        Some((value, growth / edge))
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
        // Both the values in the box and those at samples, which may lie in the next cell, are off.
        slack + 2.0 * self.most_off(low - 1.0, high + 1.0)
    }

    /// How far values in a box may be off for what cells leave out.
    fn most_off(&self, low: DVec3, high: DVec3) -> f64 {
        let Some(LeftOut { off, .. }) = &self.left_out else { return 0.0 };
        self.cells_in(low, high).map(|cell| off[self.number(cell)]).fold(0.0, f64::max)
    }

    /// The functions that reach the cells of a box.
    fn near(&self, low: DVec3, high: DVec3) -> Vec<usize> {
        let mut all: Vec<u32> = Vec::new();
        for cell in self.cells_in(low, high) {
            all.extend(self.whole_list(cell));
        }
        all.sort_unstable();
        all.dedup();
        all.into_iter().map(|i| i as usize).collect()
    }

    /// The cells of a box, x fastest.
    fn cells_in(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = [usize; 3]> {
        let [low, high] = [low, high].map(|place| cell_of(place, (self.edge as f64, self.cells)));
        let span = move |axis: usize| low[axis]..=high[axis];
        span(2).flat_map(move |z| span(1).flat_map(move |y| span(0).map(move |x| [x, y, z])))
    }
}

/// What lies between eight corners, x fastest, at a share of the way along each axis, and how it grows by that.
fn between(corners: &[f64; 8], part: DVec3) -> (f64, DVec3) {
    let mix = |low: f64, high: f64, share: f64| low + (high - low) * share;
    // Along x: both ends of four edges.
    let on = [0, 2, 4, 6].map(|i| mix(corners[i], corners[i + 1], part.x));
    let slopes = [0, 2, 4, 6].map(|i| corners[i + 1] - corners[i]);
    let (near, far) = (mix(on[0], on[1], part.y), mix(on[2], on[3], part.y));
    let growth = DVec3::new(
        mix(mix(slopes[0], slopes[1], part.y), mix(slopes[2], slopes[3], part.y), part.z),
        mix(on[1] - on[0], on[3] - on[2], part.z),
        far - near,
    );
    (mix(near, far, part.z), growth)
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
