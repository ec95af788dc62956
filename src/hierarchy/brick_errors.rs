//! What it costs to draw bricks of a field from means of its samples, as a transfer function shows them.

use crate::core::{Cancelled, Ticket, mapped};
use crate::transfer::Cumulative;
use crate::volume::{Scalar, ScalarVolume};
use crate::with_samples;

use super::moments::{ScalarPyramid, ScalarPyramidError};

/// Edge of a brick, cells between samples.
const BRICK: usize = 4;
/// Samples of a brick: those at 4b − 1 … 4b + 2 along each axis. Each sample is in one brick.
const IN_BRICK: usize = BRICK * BRICK * BRICK;
/// Levels of means: of 2³ and of 4³ samples.
const LEVELS: usize = 2;
/// Means along an axis that tents at a brick's samples are made of.
const MEANS: usize = 3;
/// Bricks between two looks at the ticket.
const AT_ONCE: usize = 1 << 12;

/// Means of 2³ and of 4³ samples of a volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Means {
    /// What was taken off each value before it was rounded to 32 bits.
    pub bias: f64,
    /// The finer ones first.
    pub levels: [MeansOfLevel; LEVELS],
}

/// Means of one level; NaN where there are no data.
#[derive(Debug, Clone, PartialEq)]
pub struct MeansOfLevel {
    /// Along x, y, z.
    pub dims: [usize; 3],
    /// Less the bias, x fastest.
    pub values: Vec<f32>,
}

impl Means {
    /// Of a volume; `None` where that is too small to have both.
    ///
    /// # Errors
    /// Cancelled, or too little memory.
    pub fn of(volume: &ScalarVolume, ticket: &Ticket) -> Result<Option<Self>, ScalarPyramidError> {
        let ScalarPyramid { bias, levels, .. } =
            ScalarPyramid::build_levels(volume, LEVELS, ticket)?;
        let of = |level: super::ScalarLevel| MeansOfLevel { dims: level.dims, values: level.mean };
        let levels: Result<[_; LEVELS], _> =
            levels.into_iter().map(of).collect::<Vec<_>>().try_into();
        Ok(levels.ok().map(|levels| Self { bias, levels }))
    }

    /// The mean of the block of 4³ samples that a sample is in.
    pub fn of_block(&self, [x, y, z]: [usize; 3]) -> f64 {
        let MeansOfLevel { dims: [nx, ny, _], values } = &self.levels[1];
        f64::from(values[(z / 4 * ny + y / 4) * nx + x / 4]) + self.bias
    }
}

/// What drawing each brick from means changes of it: the difference in opacity, and in opacity times colour, a sample
/// thick, of columns of four samples along each axis; the root of its mean square over these and the channels.
#[derive(Debug, Clone, PartialEq)]
pub struct BrickErrors {
    /// By brick, x fastest, of each level; of bricks that were not asked for 0, and infinite where samples hold no data.
    pub errors: Vec<[f32; LEVELS]>,
}

impl BrickErrors {
    /// Of some of the bricks of a volume, there being `bricks` along each axis; brick b has the cells from 4b − 1 to
    /// 4b + 3. `thickness` is that of a sample in the function's unit distances.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(
        volume: &ScalarVolume,
        means: &Means,
        (function, thickness): (&Cumulative, f64),
        (bricks, asked): ([usize; 3], &[u32]),
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let looks = Looks::new(function, thickness);
        let dims = volume.lattice.dims;
        let of_brick = |brick: u32, samples: &[f32; IN_BRICK]| {
            let at = place(brick, bricks);
            let shown = samples.map(|value| looks.of(value));
            let mut found = [0.0; LEVELS];
            for (level, found) in found.iter_mut().enumerate() {
                let coarse = tents(&means.levels[level], level, at);
                *found = difference(
                    &shown,
                    &coarse.map(|value| looks.of(value + looks.shift(means.bias))),
                );
            }
            found
        };
        let mut errors = vec![[0.0; LEVELS]; bricks.iter().product()];
        let found = with_samples!(&*volume.samples, values => {
            let of_brick = |i: usize| {
                let brick = asked[i];
                let mut samples = [0.0_f32; IN_BRICK];
                let mut has_holes = false;
                for_each_sample(place(brick, bricks), dims, |i, at| {
                    let value = Scalar::to_f64(values[at]);
                    has_holes |= value.is_nan();
                    samples[i] = looks.stored(value);
                });
                if has_holes { [f32::INFINITY; LEVELS] } else { of_brick(brick, &samples) }
            };
            mapped(asked.len(), AT_ONCE, of_brick, ticket)
        })?;
        for (&brick, found) in asked.iter().zip(found) {
            errors[brick as usize] = found.map(|e| if e.is_nan() { f32::INFINITY } else { e });
        }
        Ok(Self { errors })
    }
}

/// Where a brick is among the bricks.
fn place(brick: u32, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    let brick = brick as usize;
    [brick % nx, brick / nx % ny, brick / (nx * ny)]
}

/// The samples of a brick, x fastest, by their numbers; those beyond a border are the nearest ones.
fn for_each_sample(brick: [usize; 3], dims: [usize; 3], mut each: impl FnMut(usize, usize)) {
    let along =
        |axis: usize, i: usize| (brick[axis] * BRICK + i).saturating_sub(1).min(dims[axis] - 1);
    for i in 0..IN_BRICK {
        let [x, y, z] = [i % BRICK, i / BRICK % BRICK, i / (BRICK * BRICK)];
        each(i, (along(2, z) * dims[1] + along(1, y)) * dims[0] + along(0, x));
    }
}

/// Tents through the means of a level at the samples of a brick.
fn tents(means: &MeansOfLevel, level: usize, brick: [usize; 3]) -> [f32; IN_BRICK] {
    let [nx, ny, _] = means.dims;
    // Of each sample along an axis: the first of two means, counted from the first of three, and what the second weighs.
    const WEIGHTS: [[(usize, f32); BRICK]; LEVELS] = [
        [(0, 0.25), (0, 0.75), (1, 0.25), (1, 0.75)],
        [(0, 0.375), (0, 0.625), (0, 0.875), (1, 0.125)],
    ];
    let weights = &WEIGHTS[level];
    // The mean that lies before sample 4b − 1.
    let first = |b: usize, i: usize, n: usize| {
        let (per_brick, before) = if level == 0 { (2, 1) } else { (1, 1) };
        (b * per_brick + i).saturating_sub(before).min(n - 1)
    };
    let mut along_x = [0.0_f32; BRICK * MEANS * MEANS];
    for z in 0..MEANS {
        for y in 0..MEANS {
            let row = (first(brick[2], z, means.dims[2]) * ny + first(brick[1], y, ny)) * nx;
            let three = [0, 1, 2].map(|x| means.values[row + first(brick[0], x, nx)]);
            for (x, &(i, share)) in weights.iter().enumerate() {
                along_x[(z * MEANS + y) * BRICK + x] = three[i] + (three[i + 1] - three[i]) * share;
            }
        }
    }
    let mut along_y = [0.0_f32; BRICK * BRICK * MEANS];
    for z in 0..MEANS {
        for (y, &(i, share)) in weights.iter().enumerate() {
            for x in 0..BRICK {
                let [a, b] = [i, i + 1].map(|y| along_x[(z * MEANS + y) * BRICK + x]);
                along_y[(z * BRICK + y) * BRICK + x] = a + (b - a) * share;
            }
        }
    }
    let mut values = [0.0_f32; IN_BRICK];
    for (z, &(i, share)) in weights.iter().enumerate() {
        for j in 0..BRICK * BRICK {
            let [a, b] = [i, i + 1].map(|z| along_y[z * BRICK * BRICK + j]);
            values[z * BRICK * BRICK + j] = a + (b - a) * share;
        }
    }
    values
}

/// Between two bricks of looks.
fn difference(fine: &[[f32; 4]; IN_BRICK], coarse: &[[f32; 4]; IN_BRICK]) -> f32 {
    const LAYER: usize = BRICK * BRICK;
    let mut columns = [[[0.0_f32; 4]; LAYER]; 3];
    for i in 0..IN_BRICK {
        let [x, y, z] = [i % BRICK, i / BRICK % BRICK, i / LAYER];
        let off: [f32; 4] = std::array::from_fn(|c| coarse[i][c] - fine[i][c]);
        for (axis, column) in [(0, z * BRICK + y), (1, z * BRICK + x), (2, y * BRICK + x)] {
            for (sum, off) in columns[axis][column].iter_mut().zip(off) {
                *sum += off;
            }
        }
    }
    let squares: f32 = columns.iter().flatten().flatten().map(|sum| sum * sum).sum();
    let mean = squares / (3 * LAYER * 4 * LAYER) as f32;
    mean.sqrt()
}

/// What a transfer function makes of values: opacity of a sample's thickness times linear colour, and opacity.
struct Looks {
    cells: Vec<[f32; 4]>,
    low: f64,
    scale: f64,
}

impl Looks {
    fn new(function: &Cumulative, thickness: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "an opacity")]
        let look = |&[r, g, b, w]: &[f32; 4]| {
            let alpha = -(-f64::from(w) * thickness).exp_m1() as f32;
            [r * alpha, g * alpha, b * alpha, alpha]
        };
        let [below, beyond] = &function.ends;
        let cells = std::iter::once(below).chain(&function.cells).chain([beyond]);
        Self { cells: cells.map(look).collect(), low: function.low, scale: function.scale }
    }

    /// A value as it is looked up.
    #[expect(clippy::cast_possible_truncation, reason = "a place in a table")]
    fn stored(&self, value: f64) -> f32 {
        (value - self.low) as f32
    }

    /// What values less a bias are raised by to be looked up.
    #[expect(clippy::cast_possible_truncation, reason = "a place in a table")]
    fn shift(&self, bias: f64) -> f32 {
        (bias - self.low) as f32
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped, and NaN is 0"
    )]
    fn of(&self, stored: f32) -> [f32; 4] {
        let cell = stored * self.scale as f32 + 1.0;
        let last = self.cells.len() - 1;
        self.cells[(cell.max(0.0) as usize).min(last)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Srgb8;
    use crate::transfer::{ColourSource, TransferFunction, Weight, extinction_from_opacity};
    use crate::volume::{Lattice, Samples};

    const DIMS: [usize; 3] = [14, 9, 11];

    fn value(i: usize) -> f64 {
        500.0 + ((i * 7919) % 101) as f64
    }

    fn volume(value: impl Fn(usize) -> f64) -> ScalarVolume {
        let samples = (0..DIMS.iter().product()).map(value).collect();
        let lattice = Lattice::unit(DIMS);
        ScalarVolume::from_samples("noise", lattice, Samples::Float64(samples)).expect("a volume")
    }

    fn function() -> TransferFunction {
        let stops = vec![(500.0, Srgb8([255, 30, 0])), (600.0, Srgb8([0, 90, 255]))];
        TransferFunction::of(vec![(510.0, 0.0), (590.0, 0.8)], ColourSource::Stops(stops))
    }

    fn errors(volume: &ScalarVolume, thickness: f64) -> (Means, Vec<[f32; LEVELS]>) {
        let ticket = Ticket::new();
        let means = Means::of(volume, &ticket).expect("it fits").expect("large enough");
        let table = Cumulative::new(
            &function(),
            volume.samples.scalar_type(),
            &volume.statistics,
            Weight::Extinction,
        );
        let bricks = DIMS.map(|n| (n + 1).div_ceil(BRICK));
        let all: Vec<u32> = (0..bricks.iter().product::<usize>() as u32).collect();
        let found = BrickErrors::of(volume, &means, (&table, thickness), (bricks, &all), &ticket)
            .expect("done");
        (means, found.errors)
    }

    /// By their definition, in float64: means and tents by brute force, classified by the function itself.
    #[test]
    fn errors_are_differences_in_what_columns_of_four_samples_show() {
        let volume = volume(value);
        let thickness = 0.7;
        let (_, found) = errors(&volume, thickness);
        let [nx, ny, nz] = DIMS;
        let at = |p: [usize; 3]| value((p[2] * ny + p[1]) * nx + p[0]);
        let mean = |level: usize, b: [usize; 3]| {
            let edge = 2 << level;
            let (mut sum, mut count) = (0.0, 0.0);
            for i in 0..edge * edge * edge {
                let p = [i % edge, i / edge % edge, i / (edge * edge)];
                let p = [0, 1, 2].map(|a| b[a] * edge + p[a]);
                if p[0] < nx && p[1] < ny && p[2] < nz {
                    (sum, count) = (sum + at(p), count + 1.0);
                }
            }
            sum / count
        };
        let tent = |level: usize, p: [usize; 3]| {
            let edge = (2 << level) as f64;
            let dims = DIMS.map(|n| n.div_ceil(2 << level));
            let mut sum = 0.0;
            for corner in 0..8 {
                let (mut weight, mut b) = (1.0, [0; 3]);
                for a in 0..3 {
                    let place = (p[a] as f64 + 0.5) / edge - 0.5;
                    let share = place - place.floor();
                    let upper = corner >> a & 1 == 1;
                    weight *= if upper { share } else { 1.0 - share };
                    let index = place.floor() + f64::from(u8::from(upper));
                    b[a] = (index.max(0.0) as usize).min(dims[a] - 1);
                }
                sum += weight * mean(level, b);
            }
            sum
        };
        let function = function();
        let look = |value: f64| {
            let depth = extinction_from_opacity(function.opacity_at(value)) * thickness;
            let alpha = -(-depth).exp_m1();
            let [r, g, b] = function.colour_at(value).0;
            [r * alpha, g * alpha, b * alpha, alpha]
        };
        let bricks = DIMS.map(|n| (n + 1).div_ceil(BRICK));
        for b in [[1, 1, 1], [2, 1, 1], [1, 1, 2]] {
            for level in 0..LEVELS {
                let along = |a: usize, i: usize| (b[a] * 4 + i).saturating_sub(1).min(DIMS[a] - 1);
                let off = |i: [usize; 3]| {
                    let p = [0, 1, 2].map(|a| along(a, i[a]));
                    let (coarse, fine) = (look(tent(level, p)), look(at(p)));
                    [0, 1, 2, 3].map(|c| coarse[c] - fine[c])
                };
                let mut squares = 0.0;
                for axis in 0..3 {
                    for column in 0..16 {
                        let sum = (0..4).fold([0.0; 4], |sum, i| {
                            let mut at = [0; 3];
                            (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) =
                                (i, column % 4, column / 4);
                            let off = off(at);
                            [0, 1, 2, 3].map(|c| sum[c] + off[c] / 4.0)
                        });
                        squares += sum.iter().map(|x| x * x).sum::<f64>();
                    }
                }
                let expected = (squares / (3.0 * 16.0 * 4.0)).sqrt();
                let found = f64::from(found[(b[2] * bricks[1] + b[1]) * bricks[0] + b[0]][level]);
                // The table has cells of a fortieth of a value.
                assert!((found - expected).abs() < 2e-3, "{b:?} {level}: {found} {expected}");
                assert!(expected > 0.02, "noise is not its means: {expected}");
            }
        }
    }

    #[test]
    fn what_is_flat_costs_nothing_and_what_has_no_data_is_never_drawn_from_means() {
        let (_, flat) = errors(&volume(|_| 555.0), 1.0);
        assert!(flat.iter().flatten().all(|&e| e == 0.0));
        let hole = (5 * DIMS[1] + 4) * DIMS[0] + 6;
        let (means, found) =
            errors(&volume(|i| if i == hole { f64::NAN } else { 555.0 + (i % 2) as f64 }), 1.0);
        let bricks = DIMS.map(|n| (n + 1).div_ceil(BRICK));
        // Sample (6, 4, 5) is in brick (1, 1, 1).
        let of_hole = (bricks[1] + 1) * bricks[0] + 1;
        for (brick, errors) in found.iter().enumerate() {
            assert_eq!(errors[0].is_infinite(), brick == of_hole, "{brick}");
        }
        assert!((means.of_block([6, 4, 5]) - 555.5).abs() < 0.1);
    }
}
