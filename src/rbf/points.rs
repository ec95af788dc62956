//! Samples anywhere in space, sorted into bins so that those near a place are found.

use std::borrow::Cow;
use std::ops::Range;

use glam::DVec3;

use super::neighbours::spacings;

/// About so many points in a bin.
const A_BIN: f64 = 16.0;
/// Points lie evenly where no bin holds so many times as many.
const MOST_EVEN: f64 = 4.0;
/// Where points lie closer than this part of what they do in the mean, or at one place, it counts as so much.
const LEAST_OF_MEAN: f64 = 1e-6;
/// Bins along an axis at most.
const MOST_BINS: f64 = 256.0;

/// Places with a value each, in the order of the bins that they lie in.
#[derive(Debug, Clone)]
pub struct Points {
    positions: Vec<DVec3>,
    values: Vec<f64>,
    /// The roots of how much each counts; none where all count the same.
    roots: Vec<f64>,
    /// How many were not finite, and are left out.
    left_out: usize,
    low: DVec3,
    high: DVec3,
    bins: [usize; 3],
    /// Where each bin begins, x fastest, and where the last ends.
    starts: Vec<usize>,
}

impl Points {
    /// Of places and their values. What is not finite is left out, and counted.
    pub fn new(samples: impl IntoIterator<Item = (DVec3, f64)>) -> Self {
        let mut left_out = 0;
        let is_finite = |&(at, value): &(DVec3, f64)| at.is_finite() && value.is_finite();
        let all: Vec<(DVec3, f64)> = samples
            .into_iter()
            .filter(|sample| {
                let kept = is_finite(sample);
                left_out += usize::from(!kept);
                kept
            })
            .collect();
        let low = all.iter().fold(DVec3::INFINITY, |low, (at, _)| low.min(*at));
        let high = all.iter().fold(DVec3::NEG_INFINITY, |high, (at, _)| high.max(*at));
        let (low, high) = if all.is_empty() { (DVec3::ZERO, DVec3::ZERO) } else { (low, high) };
        let mut points = Self {
            positions: Vec::new(),
            values: Vec::new(),
            roots: Vec::new(),
            left_out,
            low,
            high,
            bins: bins(high - low, all.len()),
            starts: Vec::new(),
        };
        points.sort(&all);
        points
    }

    fn sort(&mut self, all: &[(DVec3, f64)]) {
        let count = self.bins.iter().product::<usize>();
        let bin_of: Vec<usize> = all.iter().map(|(at, _)| self.bin(*at)).collect();
        let mut starts = vec![0_usize; count + 1];
        for bin in &bin_of {
            starts[bin + 1] += 1;
        }
        for bin in 0..count {
            starts[bin + 1] += starts[bin];
        }
        let mut next = starts.clone();
        self.positions = vec![DVec3::ZERO; all.len()];
        self.values = vec![0.0; all.len()];
        for ((at, value), bin) in all.iter().zip(bin_of) {
            let place = next[bin];
            next[bin] += 1;
            self.positions[place] = *at;
            self.values[place] = *value;
        }
        self.starts = starts;
    }

    /// Of each axis.
    fn bin_along(&self, at: DVec3, axis: usize) -> usize {
        let side = self.high[axis] - self.low[axis];
        let share = if side > 0.0 { (at[axis] - self.low[axis]) / side } else { 0.0 };
        ((share * self.bins[axis] as f64).max(0.0) as usize).min(self.bins[axis] - 1)
    }

    fn bin(&self, at: DVec3) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| self.bin_along(at, axis));
        (z * self.bins[1] + y) * self.bins[0] + x
    }

    /// The same points, each of which counts so much, by its place and value: as if it were there so often. Weights are finite
    /// and above 0.
    #[must_use]
    pub fn weighted(mut self, weight: impl Fn(DVec3, f64) -> f64) -> Self {
        let samples = self.positions.iter().zip(&self.values);
        let roots = samples.map(|(at, value)| {
            let weight = weight(*at, *value);
            assert!(weight.is_finite() && weight > 0.0, "a sample that counts {weight} times");
            weight.sqrt()
        });
        self.roots = roots.collect();
        // Where all count the same, nothing is multiplied by it.
        if self.roots.iter().all(|root| *root == 1.0) {
            self.roots = Vec::new();
        }
        self
    }

    /// The root of how much a point counts: what its residual is multiplied by before it is squared.
    pub(super) fn root(&self, index: usize) -> f64 {
        self.roots.get(index).copied().unwrap_or(1.0)
    }

    /// Of all of them; none where all count the same.
    pub(super) fn roots(&self) -> &[f64] {
        &self.roots
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// How many were not finite, and are left out.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Where they lie, world.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Their values, in the same order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Least and greatest x, y, z.
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.low, self.high]
    }

    /// About how far neighbours lie apart: the side of a cube (a square, a line, of flat sets) as large as the part of the box
    /// that each point has. 1 for a single place.
    pub fn spacing(&self) -> f64 {
        let size = self.high - self.low;
        let sides: Vec<f64> = size.to_array().into_iter().filter(|side| *side > 0.0).collect();
        if sides.is_empty() || self.len() < 2 {
            return 1.0;
        }
        let share: f64 = sides.iter().map(|side| side.ln()).sum::<f64>() - (self.len() as f64).ln();
        (share / sides.len() as f64).exp().max(f64::MIN_POSITIVE)
    }

    /// About how far neighbours lie apart at each point, but no further than in the mean; nothing where they lie so evenly that the
    /// mean will do.
    pub(super) fn own_spacings(&self) -> Vec<f64> {
        let fullest = self.starts.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        if (fullest as f64) < MOST_EVEN * A_BIN {
            return Vec::new();
        }
        let mean = self.spacing();
        let mut own = spacings(&self.positions);
        own.iter_mut().for_each(|own| *own = own.clamp(LEAST_OF_MEAN * mean, mean));
        own
    }

    /// Ranges of points. Together they hold all points in a box, and some near it.
    pub fn in_box(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = Range<usize>> + '_ {
        let is_beside =
            (0..3).any(|axis| high[axis] < self.low[axis] || low[axis] > self.high[axis]);
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let end = if is_beside { 0 } else { self.bin_along(high, axis) + 1 };
            (self.bin_along(low, axis)).min(end)..end
        });
        let row = move |z: usize, y: usize| (z * self.bins[1] + y) * self.bins[0];
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().map(move |y| {
                let (begin, end) = (row(z, y) + x.start, row(z, y) + x.end);
                self.starts[begin]..self.starts[end]
            })
        })
    }
}

/// How many bins along each axis.
fn bins(size: DVec3, count: usize) -> [usize; 3] {
    let sides = size.to_array();
    let wide = sides.iter().filter(|side| **side > 0.0).count();
    if wide == 0 || count == 0 {
        return [1; 3];
    }
    let volume: f64 = sides.iter().filter(|side| **side > 0.0).map(|side| side.ln()).sum();
    let side = ((volume - (count as f64 / A_BIN).max(1.0).ln()) / wide as f64).exp();
    sides.map(|own| if own > 0.0 { (own / side).clamp(1.0, MOST_BINS) as usize } else { 1 })
}

/// Numbers of each point by the roots of how much these count; as they are where there are none.
pub(super) fn weighed<'v>(roots: &[f64], values: &'v [f64]) -> Cow<'v, [f64]> {
    if roots.is_empty() {
        return Cow::Borrowed(values);
    }
    values.iter().zip(roots).map(|(value, root)| value * root).collect()
}
