//! The marks of vector splats, from what Crawfis and Max's table is defined as.
//!
//! That the particles of a design are seen in so many phases, under so many foreshortenings and at the middles
//! of so many texels, in steps of 255, and linear between all of these, is how marks look, and so are the means
//! that smaller pictures have.

use std::array;
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

use glam::DVec3;

use super::line;
use crate::core::parallel;
use crate::kernel::{Kernel, RadialKernel};
use crate::vector::{Design, FORESHORTENINGS, MARK_COLUMNS, MARK_SIDE, PHASES};

/// Sizes of the pictures: the smallest is 4 texels wide.
pub(super) const LEVELS: usize = 5;
const SEED: u64 = 0x76c5_92f1;
/// Particles are no farther from the axis.
const BALL: f64 = 0.92;
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Places that light is averaged over, and how far along x and y from one to the next.
const PLACES: u32 = 1 << 14;
const ALL_OVER: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// The pictures of a design, at sizes that fall by half.
pub(super) struct Pictures {
    /// Of each size, in steps of 255: x fastest, then y from the least, phases, columns.
    texels: Vec<Vec<f64>>,
    /// Of each size and column: see [`Self::lost`].
    lost: Vec<Vec<f64>>,
}

impl Pictures {
    /// Those of a design, made when first asked for.
    pub(super) fn of(design: Design) -> &'static Self {
        static ALL: [OnceLock<Pictures>; Design::ALL.len()] =
            [const { OnceLock::new() }; Design::ALL.len()];
        ALL[design as usize].get_or_init(|| Self::new(design))
    }

    fn new(design: Design) -> Self {
        let picture = |i: usize| drawn(design, i / PHASES, i % PHASES).collect::<Vec<_>>();
        let largest = parallel::list(MARK_COLUMNS * PHASES, picture).concat();
        let mut all = Self { texels: vec![largest], lost: Vec::new() };
        for level in 1..LEVELS {
            let width = MARK_SIDE >> (level - 1);
            let rows = all.texels[level - 1].chunks(2 * width).enumerate();
            let means = rows.flat_map(|(y, two_rows)| {
                let sum = move |x: usize| -> f64 {
                    [0, 1, width, width + 1].iter().map(|n| two_rows[2 * x + n]).sum()
                };
                // Halves are rounded up in every other one.
                let rounded = move |x: usize| (sum(x) / 4.0 + [0.25, 0.5][(x ^ y) % 2]).floor();
                (0..width / 2).map(rounded)
            });
            let means = means.collect();
            all.texels.push(means);
        }
        let Some(kernel) = RadialKernel::new(Kernel::Cubic, None) else { return all };
        let places = (0..PLACES).map(|i| {
            let place = ALL_OVER.map(|step| 2.0 * (f64::from(i) * step).fract() - 1.0);
            let beside = DVec3::new(place[0], place[1], 0.0) * kernel.radius();
            (place, line::radial(kernel, beside, DVec3::Z, line::ENDLESS))
        });
        let places: Vec<_> = places.filter(|(_, window)| *window > 0.0).collect();
        let columns =
            |level| parallel::list(MARK_COLUMNS, |column| all.lost(level, column, &places));
        all.lost = (0..LEVELS).map(columns).collect();
        all
    }

    /// Intensity, and what MODULATE's colour is multiplied by, at x and y in −1..=1 of a level, at a phase in
    /// cycles. `across` is the part of the vector across the view; `None`: of marks that go round.
    pub(super) fn at(
        &self,
        level: usize,
        place: [f64; 2],
        phase: f64,
        across: Option<f64>,
    ) -> [f64; 2] {
        let turns = phase.rem_euclid(1.0) * PHASES as f64;
        let last = (FORESHORTENINGS - 1) as f64;
        let column = across.map_or(last + 1.0, |across| across * last);
        let (mut mark, mut lost) = (0.0, 0.0);
        for (of, share) in [(column, 1.0 - column.fract()), (column + 1.0, column.fract())] {
            if share > 0.0 {
                let [a, b] = [turns, turns + 1.0]
                    .map(|turns| self.texel(level, of as usize, turns as usize % PHASES, place));
                mark += share * (a + turns.fract() * (b - a));
                lost += share * self.lost[level][of as usize];
            }
        }
        [mark, mark + lost * (1.0 - mark)]
    }

    /// Linear between the texels of a picture.
    fn texel(&self, level: usize, column: usize, phase: usize, place: [f64; 2]) -> f64 {
        let side = MARK_SIDE as i64 >> level;
        let [x, y] = place.map(|v| (v + 1.0) / 2.0 * side as f64 - 0.5);
        let texel = |i: i64, j: i64| {
            let round = column == FORESHORTENINGS;
            let i = if round { i.rem_euclid(side) } else { i.clamp(0, side - 1) };
            let row = (column * PHASES + phase) as i64 * side + j.clamp(0, side - 1);
            self.texels[level][(row * side + i) as usize] / 255.0
        };
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let mix = |a: f64, b: f64, part: f64| a + (part - part.floor()) * (b - a);
        let row = |j| mix(texel(i, j), texel(i + 1, j), x);
        mix(row(j), row(j + 1), y)
    }

    /// MODULATE's colour and opacity have the intensity m each, so that light goes by m²: over phases and places
    /// in the window, that of the largest pictures less m², in parts of m (1 − m).
    fn lost(&self, level: usize, column: usize, places: &[([f64; 2], f64)]) -> f64 {
        let (mut lost, mut most) = (0.0, 0.0);
        for &(place, window) in places {
            let [[_, own], [mark, square]] = [0, level].map(|level| {
                let marks: [f64; PHASES] = array::from_fn(|p| self.texel(level, column, p, place));
                let next = |phase: usize| marks[(phase + 1) % PHASES];
                // ∫ (a + t (b − a))² dt is (a² + ab + b²)/3, and Σ a² = Σ b².
                let squares = (0..PHASES).map(|p| marks[p] * (2.0 * marks[p] + next(p)) / 3.0);
                [marks.iter().sum::<f64>(), squares.sum()]
            });
            lost += window * window * (own - square);
            most += window * window * (mark - square);
        }
        (lost / most).clamp(0.0, 1.0)
    }
}

/// Count, length of the tails, standard deviation across, and brightness at the tails' ends.
fn look(design: Design) -> (usize, f64, f64, f64) {
    match design {
        Design::Streaks => (14, 0.5, 0.055, 1.0),
        Design::Dots => (16, 0.0, 0.085, 1.0),
        Design::Comets => (9, 0.75, 0.075, 0.0),
    }
}

/// Where a particle of so many is along the axis, in cycles, and across it, and its brightness: apart by the
/// golden ratio and the golden angle, nearly.
fn particle(i: usize, count: usize) -> [f64; 4] {
    let noise = |k: usize| hashed(SEED ^ ((8 * i + k) as u64 * 0x9e37_79b9));
    let (number, count) = (i as f64, count as f64);
    let rank = (number + 0.5 + 0.3 * (noise(0) - 0.5)) / count;
    let (sine, cosine) = (TAU * (number * GOLDEN + 0.15 * (noise(1) - 0.5))).sin_cos();
    let beside = BALL * rank.clamp(0.0, 1.0).sqrt();
    let along = number * GOLDEN * GOLDEN + 0.1 * noise(2);
    [along, beside * cosine, beside * sine, 0.75 + 0.25 * noise(3)]
}

/// A picture of the table, in steps of 255: all but what is left dark by every mark.
fn drawn(design: Design, column: usize, phase: usize) -> impl Iterator<Item = f64> {
    let (count, tail, width, dim) = look(design);
    let round = column == FORESHORTENINGS;
    let across = if round { 1.0 } else { column as f64 / (FORESHORTENINGS - 1) as f64 };
    let marks = (0..count).flat_map(move |i| {
        let [along, y, z, brightness] = particle(i, count);
        let cycle = (along + phase as f64 / PHASES as f64).fract();
        let fade = if round { 1.0 } else { (PI * cycle).sin().powi(2) };
        let turns = if round { -1..=1 } else { 0..=0 };
        turns.map(move |turn| {
            let x = 2.0 * (cycle + f64::from(turn)) - 1.0;
            [x * across + z * (1.0 - across * across).sqrt(), y, brightness * fade]
        })
    });
    let marks: Vec<[f64; 3]> = marks.collect();
    (0..MARK_SIDE * MARK_SIDE).map(move |i| {
        let at = [i % MARK_SIDE, i / MARK_SIDE];
        let [x, y] = at.map(|n| (2 * n + 1) as f64 / MARK_SIDE as f64 - 1.0);
        let dark = marks.iter().map(|[head, middle, brightness]| {
            let behind = (head - x).clamp(0.0, tail * across);
            let beside = (x - head + behind).hypot(y - middle) / width;
            let end = if tail > 0.0 { behind / tail } else { 0.0 };
            1.0 - brightness * (1.0 - end * (1.0 - dim)) * (-beside * beside / 2.0).exp()
        });
        (255.0 * (1.0 - dark.product::<f64>())).round()
    })
}

/// A number 0..1 for another, by chance: splitmix64.
pub(super) fn hashed(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 * (-53.0_f64).exp2()
}
