//! The table of marks: what the texture of a vector splat shows of its direction.
//!
//! Crawfis–Max, "Combined vector and scalar textures": small particles or scratch marks along x,
//! moved along it from phase to phase, and seen under sixteen phases and twelve foreshortenings. Here
//! the particles stand in a ball and are projected, so that a splat that is turned towards the eye
//! shows the same particles from their ends.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use crate::core::parallel;
use crate::core::{Cancelled, Ticket, names};
use crate::kernel::{Kernel, RadialKernel};

/// Steps that the marks take from one end of the splat to the other.
pub const PHASES: usize = 16;
/// Directions to the eye that the marks are drawn for: the component across the view is 0, 1/11, …, 1.
pub const FORESHORTENINGS: usize = 12;
/// Columns of the table: the foreshortenings, and marks that go round without fading at the ends, for
/// coordinates that are stretched instead.
pub const MARK_COLUMNS: usize = FORESHORTENINGS + 1;
/// Texels along the side of a picture of the table at its finest.
pub const MARK_SIDE: usize = 64;

/// What MODULATE's marks leave of the depth that BLEND's matter has, in the mean over a splat and over
/// foreshortenings: 0.22 to 0.25 of the three designs, and 0.08 to 0.39 by how the vector is turned to the eye.
pub(super) const MARKED: f64 = 0.24;

/// Texels along the side at the coarsest.
const LEAST_SIDE: usize = 4;
/// Particles lie within this of the axis: beyond, the window leaves little of them.
const BALL: f64 = 0.92;
/// The table's own seed: splats differ by their phases.
const SEED: u64 = 0x76c5_92f1;

/// What the marks look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Design {
    /// Short scratch marks along the flow, as in the paper.
    #[default]
    Streaks,
    /// Round particles.
    Dots,
    /// Bright heads with fading tails: they tell where the flow goes to, at rest too.
    Comets,
}

/// How the particles of a design look, in radii of the splat.
struct Look {
    count: usize,
    /// Length of the tail.
    length: f64,
    /// Standard deviation across.
    width: f64,
    /// Brightness at the end of the tail.
    tail: f64,
}

names!(Design[3] { Streaks => "streaks", Dots => "dots", Comets => "comets" });

impl Design {
    fn look(self) -> Look {
        match self {
            Self::Streaks => Look { count: 14, length: 0.5, width: 0.055, tail: 1.0 },
            Self::Dots => Look { count: 16, length: 0.0, width: 0.085, tail: 1.0 },
            Self::Comets => Look { count: 9, length: 0.75, width: 0.075, tail: 0.0 },
        }
    }
}

/// One size of the table's pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Texels along the side of a picture.
    pub side: usize,
    /// Intensities of 255: column by column, in each phase by phase, in each row by row from the least
    /// y, x fastest.
    pub intensities: Vec<u8>,
    /// Of each column: what marks have lost of their contrast in texels that are larger than they are,
    /// 0..=1; nothing at the finest. See [`Marks::light`].
    pub blur: [f64; MARK_COLUMNS],
}

impl Level {
    /// Where a picture begins.
    fn begin(&self, column: usize, phase: usize) -> usize {
        (column * PHASES + phase) * self.side * self.side
    }

    /// Of every picture, in their order, each texel beside the same one of the next phase, and these beside those of
    /// the next foreshortening: what a lookup mixes.
    pub fn texels(&self) -> Vec<[u8; 4]> {
        let mut texels = Vec::with_capacity(self.intensities.len());
        for column in 0..MARK_COLUMNS {
            // Neither the last foreshortening nor the marks that go round have a next one.
            let beside = if column + 1 < FORESHORTENINGS { column + 1 } else { column };
            for phase in 0..PHASES {
                let next = (phase + 1) % PHASES;
                let of = |column, phase| self.picture(column, phase);
                let four =
                    [of(column, phase), of(column, next), of(beside, phase), of(beside, next)];
                texels.extend((0..self.side * self.side).map(|i| four.map(|picture| picture[i])));
            }
        }
        texels
    }

    /// The intensities of one picture.
    pub fn picture(&self, column: usize, phase: usize) -> &[u8] {
        &self.intensities[self.begin(column, phase)..][..self.side * self.side]
    }
}

/// Intensities 0..=1 over the disc of radius 1, by phase and foreshortening, at falling sizes; without
/// the window, which is the kernel's and known in closed form.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Marks {
    /// The finest first, each half as many texels a side.
    pub levels: Vec<Level>,
}

/// A particle of the ball.
#[derive(Debug, Clone, Copy)]
struct Particle {
    x: f64,
    y: f64,
    z: f64,
    brightness: f64,
}

impl Marks {
    /// The table of a design. The same on every machine.
    pub fn new(design: Design) -> Arc<Self> {
        // Nobody cancels a fresh ticket.
        Self::of(design, &Ticket::new()).unwrap_or_default()
    }

    /// The same, made when first asked for, for as long as nobody cancels it: that takes some tenths of a second.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn of(design: Design, ticket: &Ticket) -> Result<Arc<Self>, Cancelled> {
        static ALL: [OnceLock<Arc<Marks>>; Design::ALL.len()] =
            [const { OnceLock::new() }; Design::ALL.len()];
        let kept = &ALL[design as usize];
        if let Some(made) = kept.get() {
            return Ok(Arc::clone(made));
        }
        // Made beside the lock: a thread that waits for it may be the one that others share the work with.
        let made = Arc::new(Self::made(design, ticket)?);
        Ok(Arc::clone(kept.get_or_init(|| made)))
    }

    fn made(design: Design, ticket: &Ticket) -> Result<Self, Cancelled> {
        let look = design.look();
        let particles = particles(look.count);
        let side = MARK_SIDE;
        let picture = |picture: usize| {
            ticket.look()?;
            let (column, phase) = (picture / PHASES, picture % PHASES);
            Ok(drawn(&look, &particles, column, phase as f64 / PHASES as f64))
        };
        let pictures: Vec<Vec<u8>> = parallel::try_list(MARK_COLUMNS * PHASES, picture)?;
        let blur = [0.0; MARK_COLUMNS];
        let mut levels = vec![Level { side, intensities: pictures.concat(), blur }];
        while let Some(finer) = levels.last().filter(|level| level.side > LEAST_SIDE) {
            ticket.look()?;
            let coarser = halved(finer);
            levels.push(coarser);
        }
        let finest = levels[0].clone();
        for level in &mut levels[1..] {
            level.blur = blur_of(level, &finest, ticket)?;
        }
        Ok(Self { levels })
    }

    /// What the colour of MODULATE is multiplied by where the intensity was found to be `intensity`.
    ///
    /// Printed is the intensity itself, as for the opacity, so that light goes by its square; and the mean
    /// of squares is more than the square of a mean: marks that are too small to be told apart would be
    /// darker than the same marks seen from near. What is missing is in proportion to m (1 − m), which is
    /// how far a mean m can be from what it is of, and `Level::blur` says to which part.
    pub fn light(&self, level: usize, intensity: f64, seen: Seen) -> f64 {
        let blur = &self.levels[level.min(self.levels.len() - 1)].blur;
        let lost = match seen {
            Seen::Round => blur[FORESHORTENINGS],
            Seen::Across(across) => {
                let (low, share) = column_of(across);
                blur[low] * (1.0 - share) + blur[low + 1] * share
            }
        };
        intensity + lost * (1.0 - intensity)
    }

    /// Intensity 0..=1 at (x, y) in −1..=1, at a phase in cycles and a foreshortening 0..=1 (the part of
    /// the vector across the view), from the pictures of a level.
    ///
    /// Linear between texels, between the two nearest phases, and between the two nearest
    /// foreshortenings; `round` takes instead the marks that go round, at x of any size.
    pub fn intensity(&self, level: usize, [x, y]: [f64; 2], phase: f64, seen: Seen) -> f64 {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        let turns = (phase - phase.floor()) * PHASES as f64;
        let (early, late) =
            (turns.floor() as usize % PHASES, (turns.floor() as usize + 1) % PHASES);
        let between = turns - turns.floor();
        let corners = Corners::about(level.side, [x, y], seen == Seen::Round);
        let at = |column: usize| {
            let [a, b] = [early, late].map(|phase| corners.intensity(level.picture(column, phase)));
            a * (1.0 - between) + b * between
        };
        match seen {
            Seen::Round => at(FORESHORTENINGS),
            Seen::Across(across) => {
                let (low, share) = column_of(across);
                at(low) * (1.0 - share) + at(low + 1) * share
            }
        }
    }
}

/// The column before a foreshortening, and how far towards the next it lies.
fn column_of(across: f64) -> (usize, f64) {
    let place = across.clamp(0.0, 1.0) * (FORESHORTENINGS - 1) as f64;
    let low = (place.floor() as usize).min(FORESHORTENINGS - 2);
    (low, place - low as f64)
}

/// Which column of the table is looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// The one of a foreshortening 0..=1.
    Across(f64),
    /// The marks that go round without fading.
    Round,
}

/// The four texels about a place of a level's pictures, and the share of each.
struct Corners {
    texels: [usize; 4],
    shares: [f64; 4],
}

impl Corners {
    /// Of (x, y) in −1..=1; `round`: of pictures that go round along x.
    fn about(side: usize, [x, y]: [f64; 2], round: bool) -> Self {
        let texels = side as f64;
        let place = |v: f64| (v * 0.5 + 0.5) * texels - 0.5;
        let (px, py) = (place(x), place(y));
        let (i, j) = (px.floor(), py.floor());
        let (fx, fy) = (px - i, py - j);
        let column = |i: f64| {
            (if round { i.rem_euclid(texels) } else { i.clamp(0.0, texels - 1.0) }) as usize
        };
        let row = |j: f64| j.clamp(0.0, texels - 1.0) as usize * side;
        let ([left, right], [low, high]) = ([i, i + 1.0].map(column), [j, j + 1.0].map(row));
        Self {
            texels: [low + left, low + right, high + left, high + right],
            shares: [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy],
        }
    }

    /// The intensity there, 0..=1.
    fn intensity(&self, picture: &[u8]) -> f64 {
        let texels = self.texels.map(|texel| f64::from(picture[texel]));
        let [a, b, c, d] = self.shares;
        (texels[0] * a + texels[1] * b + texels[2] * c + texels[3] * d) / 255.0
    }
}

/// Particles spread through the ball: by the golden ratio along x, and about it by the golden angle,
/// with a seeded jitter, so that no two streaks hide one another.
fn particles(count: usize) -> Vec<Particle> {
    let golden = 0.618_033_988_749_895;
    (0..count)
        .map(|i| {
            let noise =
                |k: u64| unit_from_hash(SEED ^ (i as u64 * 8 + k).wrapping_mul(0x9e37_79b9));
            let rank = (i as f64 + 0.5) / count as f64;
            let radius =
                BALL * (rank + 0.3 * (noise(0) - 0.5) / count as f64).clamp(0.0, 1.0).sqrt();
            let angle = std::f64::consts::TAU * (i as f64 * golden + 0.15 * (noise(1) - 0.5));
            Particle {
                x: 2.0 * ((i as f64 * golden * golden + 0.1 * noise(2)).fract()) - 1.0,
                y: radius * angle.cos(),
                z: radius * angle.sin(),
                brightness: 0.75 + 0.25 * noise(3),
            }
        })
        .collect()
}

/// One picture of the table.
fn drawn(look: &Look, particles: &[Particle], column: usize, phase: f64) -> Vec<u8> {
    let round = column == FORESHORTENINGS;
    let across = if round { 1.0 } else { column as f64 / (FORESHORTENINGS - 1) as f64 };
    let towards = (1.0 - across * across).max(0.0).sqrt();
    // Head, tail, brightness on the screen; those that go round are there three times.
    let marks: Vec<([f64; 2], f64, f64)> = particles
        .iter()
        .flat_map(|particle| {
            let x = (particle.x + 1.0 + 2.0 * phase).rem_euclid(2.0) - 1.0;
            // Particles come and go at the ends of the ball: gently.
            let fade = if round { 1.0 } else { (FRAC_PI_2 * x).cos().powi(2) };
            let turns: &[f64] = if round { &[-2.0, 0.0, 2.0] } else { &[0.0] };
            turns.iter().map(move |turn| {
                let at = [(x + turn) * across + particle.z * towards, particle.y];
                (at, look.length * across, particle.brightness * fade)
            })
        })
        .collect();
    let texel = 2.0 / MARK_SIDE as f64;
    let place = |i: usize| -1.0 + texel * (i as f64 + 0.5);
    (0..MARK_SIDE * MARK_SIDE)
        .map(|i| {
            let [x, y] = [place(i % MARK_SIDE), place(i / MARK_SIDE)];
            let dark: f64 = marks
                .iter()
                .map(|&(head, length, brightness)| {
                    1.0 - brightness * mark(look, x - head[0], y - head[1], length)
                })
                .product();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let byte = ((1.0 - dark) * 255.0).round() as u8;
            byte
        })
        .collect()
}

/// Brightness of a mark whose head is at the origin and whose tail reaches `length` to the left.
fn mark(look: &Look, x: f64, y: f64, length: f64) -> f64 {
    // How far along the tail the nearest point of the mark is.
    let along = (-x).clamp(0.0, length);
    let squared = (x + along).powi(2) + y * y;
    let back = if look.length > 0.0 { along / look.length } else { 0.0 };
    let level = 1.0 + (look.tail - 1.0) * back;
    level * (-squared / (2.0 * look.width * look.width)).exp()
}

/// Means of two by two texels; halves are rounded up in every other one, so that means stay.
fn halved(finer: &Level) -> Level {
    let side = finer.side / 2;
    let pictures = finer.intensities.chunks_exact(finer.side * finer.side);
    let intensities = pictures.flat_map(|picture| {
        (0..side * side).map(move |i| {
            let (x, y) = (2 * (i % side), 2 * (i / side));
            let sum: u32 = [0, 1, finer.side, finer.side + 1]
                .iter()
                .map(|step| u32::from(picture[y * finer.side + x + step]))
                .sum();
            #[expect(clippy::cast_possible_truncation, reason = "a mean of bytes")]
            let mean = ((sum + 1 + ((x ^ y) as u32 >> 1 & 1)) / 4) as u8;
            mean
        })
    });
    Level { side, intensities: intensities.collect(), blur: [0.0; MARK_COLUMNS] }
}

/// Places of the window between two looks at the ticket.
const BLUR_LOOKS: usize = 1 << 8;
/// Places of the window, and how far along x and y from one to the next, within 0..1: no row of texels is met
/// at one height alone, or all of a streak would be.
const BLUR_PLACES: usize = 1 << 13;
const BLUR_STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// What a level's marks have lost of the finest's contrast, so that both give as much light through the
/// window: the sum over places and phases of I² is that of m (m + blur (1 − m)), m found as the device
/// finds it.
fn blur_of(
    level: &Level,
    finest: &Level,
    ticket: &Ticket,
) -> Result<[f64; MARK_COLUMNS], Cancelled> {
    let none = [0.0; MARK_COLUMNS];
    let Some(kernel) = RadialKernel::new(Kernel::Cubic, None) else { return Ok(none) };
    let places = (0..BLUR_PLACES).map(|i| {
        let at = BLUR_STEPS.map(|step| 2.0 * (i as f64 * step).fract() - 1.0);
        (at, kernel.footprint(at[0].hypot(at[1]) * kernel.radius()).powi(2))
    });
    let places: Vec<([f64; 2], f64)> = places.filter(|(_, window)| *window > 0.0).collect();
    let columns: Result<Vec<f64>, Cancelled> = parallel::try_list(MARK_COLUMNS, |column| {
        let round = column == FORESHORTENINGS;
        let (mut lost, mut at_most) = (0.0, 0.0);
        for (i, &(at, window)) in places.iter().enumerate() {
            if i.is_multiple_of(BLUR_LOOKS) {
                ticket.look()?;
            }
            let of = |level: &Level| -> [f64; 2] {
                let corners = Corners::about(level.side, at, round);
                let marks: [f64; PHASES] =
                    std::array::from_fn(|phase| corners.intensity(level.picture(column, phase)));
                // From a phase to the next, a to b, squares are (a² + ab + b²)/3 in the mean.
                let squares = (0..PHASES)
                    .map(|i| marks[i] * (2.0 * marks[i] + marks[(i + 1) % PHASES]) / 3.0);
                [marks.iter().sum(), squares.sum()]
            };
            let ([sum, squares], [_, own]) = (of(level), of(finest));
            lost += window * (own - squares);
            at_most += window * (sum - squares);
        }
        Ok(if at_most > 0.0 { (lost / at_most).clamp(0.0, 1.0) } else { 0.0 })
    });
    let columns = columns?;
    Ok(std::array::from_fn(|column| columns[column]))
}

/// A number 0..1 that looks random, from another (splitmix64).
pub(super) fn unit_from_hash(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::assert_stops;
    use crate::vector::WINDOW;

    fn mean(picture: &[u8]) -> f64 {
        picture.iter().map(|&v| f64::from(v)).sum::<f64>() / picture.len() as f64 / 255.0
    }

    #[test]
    fn marks_leave_about_a_quarter_of_the_depth() {
        let kernel = RadialKernel::new(Kernel::Cubic, None).unwrap();
        let texel = 2.0 / MARK_SIDE as f64;
        let place = |i: usize| -1.0 + texel * (i as f64 + 0.5);
        let footprint: Vec<f64> = (0..MARK_SIDE * MARK_SIDE)
            .map(|i| place(i % MARK_SIDE).hypot(place(i / MARK_SIDE)) * kernel.radius())
            .map(|r| kernel.footprint(r))
            .collect();
        let matter: f64 = footprint.iter().sum();
        for design in Design::ALL {
            let marks = Marks::new(design);
            let level = &marks.levels[0];
            let shares = (0..FORESHORTENINGS).map(|column| {
                let of_phase = |phase| -> f64 {
                    let marks = level.picture(column, phase).iter().zip(&footprint);
                    marks.map(|(i, f)| f64::from(*i) / 255.0 * f).sum()
                };
                // The window is as high as 1, and reaches further than the matter.
                let marked = (0..PHASES).map(of_phase).sum::<f64>() / PHASES as f64;
                marked * (WINDOW * WINDOW) / kernel.footprint(0.0) / matter
            });
            let shares: Vec<f64> = shares.collect();
            let mean = shares.iter().sum::<f64>() / FORESHORTENINGS as f64;
            println!("measured {design:?}: {mean:.3}, by foreshortening {shares:.2?}");
            assert!((mean / MARKED - 1.0).abs() < 0.15, "{design:?}: {mean}");
        }
    }

    #[test]
    fn marks_move_along_x_from_phase_to_phase_and_come_round() {
        for design in Design::ALL {
            let table = Marks::new(design);
            // Those that go round are the same, an eighth of the radius further: 4 texels.
            let level = &table.levels[0];
            for phase in 0..PHASES {
                let now = level.picture(FORESHORTENINGS, phase);
                let next = level.picture(FORESHORTENINGS, (phase + 1) % PHASES);
                for y in 0..MARK_SIDE {
                    for x in 0..MARK_SIDE {
                        let to = y * MARK_SIDE + (x + MARK_SIDE / PHASES) % MARK_SIDE;
                        let moved = now[y * MARK_SIDE + x].abs_diff(next[to]);
                        // Three turns of a mark are there, and a fourth would show beyond.
                        assert!(moved <= 1, "{design:?} {phase} {x} {y}: {moved}");
                    }
                }
            }
        }
    }

    #[test]
    fn comets_are_brighter_ahead_and_streaks_are_not() {
        // Where brightness falls along x, over all the picture: ahead of a comet's head.
        let fall = |design: Design| {
            let table = Marks::new(design);
            let picture = table.levels[0].picture(FORESHORTENINGS, 0).to_vec();
            let rows = picture.chunks_exact(MARK_SIDE);
            let steepest = |sign: f64| {
                rows.clone()
                    .flat_map(|row| {
                        row.windows(2).map(|w| sign * (f64::from(w[1]) - f64::from(w[0])))
                    })
                    .fold(0.0, f64::max)
            };
            steepest(-1.0) / steepest(1.0)
        };
        let [streaks, comets] = [fall(Design::Streaks), fall(Design::Comets)];
        // Measured: 1.03 and 3.1.
        assert!((0.8..1.25).contains(&streaks), "{streaks}");
        assert!(comets > 2.0, "{comets}");
    }

    #[test]
    fn a_mark_seen_from_its_end_is_as_short_as_it_is_wide() {
        let look = Design::Streaks.look();
        let one = [Particle { x: 0.0, y: 0.0, z: 0.0, brightness: 1.0 }];
        let lit = |column: usize, axis: usize| {
            let picture = drawn(&look, &one, column, 0.0);
            let count = (0..MARK_SIDE * MARK_SIDE)
                .filter(|&i| picture[i] > 127)
                .map(|i| if axis == 0 { i % MARK_SIDE } else { i / MARK_SIDE });
            count.collect::<std::collections::BTreeSet<_>>().len()
        };
        assert_eq!(lit(0, 0), lit(0, 1));
        // Half a radius of 32 texels longer.
        assert_eq!(lit(FORESHORTENINGS - 1, 0), lit(0, 0) + 16);
        assert_eq!(lit(FORESHORTENINGS - 1, 1), lit(0, 1));
    }

    /// Every picture is drawn by itself, and coarser levels are held against the finest one.
    #[test]
    fn marks_are_left_off_where_a_ticket_says_so() {
        let places = BLUR_PLACES / 2 / BLUR_LOOKS;
        let least = MARK_COLUMNS * PHASES + 4 * MARK_COLUMNS * places;
        assert_stops("marks", least, |ticket| Marks::made(Design::Dots, ticket));
    }

    #[test]
    fn coarser_levels_keep_the_mean() {
        let table = Marks::new(Design::Streaks);
        assert_eq!(table.levels.iter().map(|l| l.side).collect::<Vec<_>>(), [64, 32, 16, 8, 4]);
        for (column, phase) in [(0, 0), (5, 3), (11, 15), (12, 8)] {
            let fine = mean(table.levels[0].picture(column, phase));
            for level in &table.levels[1..] {
                let coarse = mean(level.picture(column, phase));
                // Measured: 2e-4.
                assert!((coarse - fine).abs() < 1e-3, "{column} {phase}: {coarse} {fine}");
            }
        }
    }

    #[test]
    fn blurred_marks_give_as_much_light_as_those_they_are_blurred_of() {
        for design in Design::ALL {
            let table = Marks::new(design);
            assert!(table.levels[0].blur.iter().all(|blur| *blur == 0.0), "as printed");
            let kernel = RadialKernel::new(Kernel::Cubic, None).unwrap();
            // Through the window, of phases and foreshortenings between those of the table, too.
            for seen in [0.0, 0.37, 1.0].map(Seen::Across).into_iter().chain([Seen::Round]) {
                let sums = |level: usize| -> [f64; 2] {
                    let (mut light, mut squared) = (0.0, 0.0);
                    for i in 0..7 * 50 * 50 {
                        let at = [i % 50, i / 50 % 50].map(|n| (2.0 * n as f64 + 1.0) / 50.0 - 1.0);
                        let l = at[0].hypot(at[1]) * kernel.radius();
                        let window = (kernel.footprint(l) / kernel.footprint(0.0)).powi(2);
                        let phase = (i / 2500) as f64 / 7.0;
                        let m = table.intensity(level, at, phase, seen);
                        light += window * m * table.light(level, m, seen);
                        squared += window * m * m;
                    }
                    [light, squared]
                };
                let [fine, _] = sums(0);
                for level in 1..table.levels.len() {
                    let [light, squared] = sums(level).map(|sum| sum / fine);
                    // Measured: 0.989 to 1.006.
                    println!("measured {design:?} {seen:?} {level}: {light:.4} {squared:.4}");
                    assert!((light - 1.0).abs() < 0.02, "{design:?} {seen:?} {level}: {light}");
                    // 0.145 to 0.948.
                    assert!(squared < 0.95, "squares alone: {squared}");
                }
            }
        }
    }

    #[test]
    fn lookups_meet_the_texels_and_run_straight_between() {
        let table = Marks::new(Design::Dots);
        let level = &table.levels[0];
        let place = |i: usize| -1.0 + (2.0 * i as f64 + 1.0) / MARK_SIDE as f64;
        let texel =
            |c: usize, p: usize| f64::from(level.picture(c, p)[20 * MARK_SIDE + 31]) / 255.0;
        let at = [place(31), place(20)];
        let across = |c: f64| Seen::Across(c / 11.0);
        let found = table.intensity(0, at, 3.0 / 16.0, across(4.0));
        assert!((found - texel(4, 3)).abs() < 1e-12);
        let between = table.intensity(0, at, 3.25 / 16.0, across(4.5));
        let expected = (texel(4, 3) + texel(5, 3)) * 0.375 + (texel(4, 4) + texel(5, 4)) * 0.125;
        assert!((between - expected).abs() < 1e-9, "{between} {expected}");
        // The last phase is followed by the first, and phases count in cycles.
        let late = table.intensity(0, at, 15.5 / 16.0 - 7.0, across(0.0));
        assert!((late - (texel(0, 15) + texel(0, 0)) / 2.0).abs() < 1e-9);
        let round = |x: f64| table.intensity(0, [x, place(20)], 0.0, Seen::Round);
        assert!((round(0.3) - round(2.3)).abs() < 1e-9 && (round(0.3) - round(-3.7)).abs() < 1e-9);
    }

    #[test]
    fn the_mean_over_a_cycle_hardly_flickers() {
        for design in Design::ALL {
            let table = Marks::new(design);
            for column in 0..FORESHORTENINGS {
                let means: Vec<f64> =
                    (0..PHASES).map(|p| mean(table.levels[0].picture(column, p))).collect();
                let all = means.iter().sum::<f64>() / PHASES as f64;
                let worst = means.iter().map(|m| (m - all).abs() / all).fold(0.0, f64::max);
                // Splats have phases of their own, which takes off the rest.
                assert!(all > 0.02 && worst < 0.35, "{design:?} {column}: {all} {worst}");
            }
        }
    }
}
