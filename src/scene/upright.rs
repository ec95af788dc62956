//! Which way round a scan stands whose file does not say, as far as what shows of it tells: things stand on their heavy
//! end, and patients lie on the scanner's table.

use glam::DVec3;

use super::{Orientation, UpAxis};
use crate::core::parallel;
use crate::transfer::{Kind, TransferFunction};
use crate::volume::{Lattice, Scalar, ScalarVolume};
use crate::with_samples;

/// Blocks along a side that a volume is looked at in, at most.
const MOST_BLOCKS: usize = 64;
/// Volumes with fewer samples along a side have too little of a shape.
const LEAST_SAMPLES: usize = 32;
/// Opacity from which a sample counts as matter.
const MATTER: f64 = 0.01;
/// The part of what shows that may lie beyond the ends at either side.
const BEYOND: f64 = 0.005;
/// How far from its middle to its end the centre of matter lies along an axis that it stands along, at least. (A tree in its
/// pot: 0.65. A tooth: 0.41. Vessels: 0.35. Patients: 0.15 at most, along any axis.)
const LEAST_HEAVY: f64 = 0.5;
/// And along the other two, at most: a heap in a corner stands on no end. (The tree: 0.07.)
const MOST_ASIDE: f64 = 0.25;
/// What was turned on a wheel is as wide along both other axes and its centre lies on its own, to this part,
const ROUND: f64 = 0.02;
/// and stands on its heavier end from here on. (A vase: 0.14.)
const LEAST_HEAVY_WHERE_ROUND: f64 = 0.1;
/// A table is in this part of the slices, or more,
const LEAST_LENGTH: f64 = 0.9;
/// reaches across this part of the picture's width, or more,
const LEAST_WIDTH: f64 = 0.4;
/// and is a sheet: so many blocks thick at most, as a mean. (LIDC2: 1.4.)
const MOST_THICKNESS: f64 = 2.0;
/// Its middle lies beyond this part of the patient.
const LEAST_BEYOND: f64 = 0.95;

/// The way round that a volume's matter tells; `None` where it tells none. Of measurements alone: what programs compute has
/// the axes that it was computed in.
pub(super) fn told_by_matter(
    volume: &ScalarVolume,
    transfer: &TransferFunction,
) -> Option<Orientation> {
    let is_scan = matches!(
        Kind::of(&volume.statistics),
        Kind::Ct { .. } | Kind::EightBits | Kind::WholeNumbers
    );
    let has_shape = volume.lattice.dims.iter().all(|&n| n >= LEAST_SAMPLES);
    if !is_scan || !has_shape || volume.scattered.is_some() || volume.cells.is_some() {
        return None;
    }
    let blocks = Blocks::of(volume, transfer);
    blocks.standing().or_else(|| blocks.lying())
}

/// A volume in blocks of samples.
struct Blocks {
    lattice: Lattice,
    /// How many there are along each axis.
    dims: [usize; 3],
    /// Samples along a block's sides.
    side: [usize; 3],
    /// Opacity in the middle of each, first axis first.
    opacity: Vec<f64>,
    /// Whether any of its samples is matter.
    is_matter: Vec<bool>,
}

impl Blocks {
    fn of(volume: &ScalarVolume, transfer: &TransferFunction) -> Self {
        let lattice = volume.lattice;
        let side = lattice.dims.map(|n| n.div_ceil(MOST_BLOCKS));
        let dims = [0, 1, 2].map(|axis| lattice.dims[axis].div_ceil(side[axis]));
        let [nx, ny, _] = lattice.dims;
        let ends = with_samples!(&*volume.samples, values => ends_in_blocks(values, (lattice.dims, side, dims)));
        let is_matter = |[low, high]: &[f64; 2]| {
            low <= high && [low, high].iter().any(|value| transfer.opacity_at(**value) >= MATTER)
        };
        let middle = |i: usize| {
            let block = [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]];
            let [x, y, z] = [0, 1, 2].map(|axis| {
                (block[axis] * side[axis] + side[axis] / 2).min(lattice.dims[axis] - 1)
            });
            transfer.opacity_at(volume.samples.get((z * ny + y) * nx + x))
        };
        Self {
            lattice,
            dims,
            side,
            is_matter: ends.iter().map(is_matter).collect(),
            opacity: parallel::list(ends.len(), middle),
        }
    }

    fn place(&self, block: usize) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        [block % nx, block / nx % ny, block / nx / ny]
    }

    /// Where most of what shows lies at one end of an axis, that end is down.
    fn standing(&self) -> Option<Orientation> {
        let along = [0, 1, 2].map(|axis| {
            let mut along = vec![0.0; self.dims[axis]];
            for (block, opacity) in self.opacity.iter().enumerate() {
                along[self.place(block)[axis]] += opacity;
            }
            along
        });
        let heaviness = [0, 1, 2].map(|axis| heaviness(&along[axis]));
        let axis = (0..3).max_by(|&a, &b| heaviness[a].abs().total_cmp(&heaviness[b].abs()))?;
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let aside = heaviness[a].abs().max(heaviness[b].abs());
        let width = |axis: usize| {
            spread(&along[axis]) * self.side[axis] as f64 * self.lattice.spacing[axis].abs()
        };
        let is_round = aside < ROUND && (width(a) / width(b) - 1.0).abs() < ROUND;
        let least = if is_round { LEAST_HEAVY_WHERE_ROUND } else { LEAST_HEAVY };
        if heaviness[axis].abs() < least || aside > MOST_ASIDE {
            return None;
        }
        let up = self.lattice.axes().col(axis) * -heaviness[axis].signum();
        Some(Orientation { up: nearest(up), ..Orientation::default() })
    }

    /// Where a table lies along the slices at one side of what shows, who lies on it has the back there. Slices show the
    /// right of who is in them at their left, as all scanners do.
    fn lying(&self) -> Option<Orientation> {
        let bodies = self.bodies();
        let (largest, _) = bodies.iter().enumerate().max_by_key(|(_, body)| body.len())?;
        let rows = |body: &[usize]| {
            let mut rows: Vec<usize> = body.iter().map(|block| self.place(*block)[1]).collect();
            rows.sort_unstable();
            rows
        };
        let of_patient = rows(&bodies[largest]);
        let others = bodies.iter().enumerate().filter(|(number, _)| *number != largest);
        let sides = others.filter(|(_, body)| self.is_table(body)).filter_map(|(_, body)| {
            let of_table = rows(body);
            let middle = of_table[of_table.len() / 2];
            let share = |is_before: &dyn Fn(usize) -> bool| {
                let count = of_patient.iter().filter(|row| is_before(**row)).count();
                count as f64 / of_patient.len() as f64
            };
            if share(&|row| row > middle) >= LEAST_BEYOND {
                Some(-1.0)
            } else if share(&|row| row < middle) >= LEAST_BEYOND {
                Some(1.0)
            } else {
                None
            }
        });
        let sides: Vec<f64> = sides.collect();
        // Two tables, one at either side, tell nothing.
        let side = *sides.first().filter(|first| sides.iter().all(|side| side == *first))?;
        let axes = self.lattice.axes();
        let (left, back) = (axes.x_axis, axes.y_axis * side);
        Some(Orientation {
            right: Some(nearest(-left)),
            anterior: Some(nearest(-back)),
            up: nearest(left.cross(back)),
        })
    }

    fn is_table(&self, body: &[usize]) -> bool {
        let span = |axis: usize| {
            let along = body.iter().map(|block| self.place(*block)[axis]);
            let (least, most) =
                along.fold((usize::MAX, 0), |(least, most), at| (least.min(at), most.max(at)));
            (most + 1).saturating_sub(least) as f64
        };
        let [width, length] = [span(0), span(2)];
        width >= LEAST_WIDTH * self.dims[0] as f64
            && length >= LEAST_LENGTH * self.dims[2] as f64
            && body.len() as f64 <= MOST_THICKNESS * width * length
    }

    /// Blocks of matter that hang together by their faces.
    fn bodies(&self) -> Vec<Vec<usize>> {
        let mut is_free = self.is_matter.clone();
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        let mut bodies = Vec::new();
        for first in 0..is_free.len() {
            if !std::mem::take(&mut is_free[first]) {
                continue;
            }
            let (mut body, mut done) = (vec![first], 0);
            while let Some(&block) = body.get(done) {
                done += 1;
                let place = self.place(block);
                for axis in 0..3 {
                    let before = (place[axis] > 0).then(|| block - strides[axis]);
                    let after = (place[axis] + 1 < self.dims[axis]).then(|| block + strides[axis]);
                    for next in [before, after].into_iter().flatten() {
                        if std::mem::take(&mut is_free[next]) {
                            body.push(next);
                        }
                    }
                }
            }
            bodies.push(body);
        }
        bodies
    }
}

/// The least and the greatest finite value in each block; of blocks without any, infinities the wrong way round.
fn ends_in_blocks<T: Scalar>(
    values: &[T],
    ([nx, ny, nz], side, dims): ([usize; 3], [usize; 3], [usize; 3]),
) -> Vec<[f64; 2]> {
    let of_layer = |layer: usize| {
        let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; dims[0] * dims[1]];
        for z in layer * side[2]..((layer + 1) * side[2]).min(nz) {
            for y in 0..ny {
                let row = &values[(z * ny + y) * nx..][..nx];
                for (block, part) in row.chunks(side[0]).enumerate() {
                    let [low, high] = &mut ends[y / side[1] * dims[0] + block];
                    for value in part.iter().map(|value| value.to_f64()) {
                        // Neither is moved by NaN.
                        *low = low.min(value);
                        *high = high.max(value);
                    }
                }
            }
        }
        ends
    };
    parallel::list(dims[2], of_layer).concat()
}

/// How far towards the last (1) or the first (−1) of its ends the centre of what lies along an axis is, from their middle.
fn heaviness(along: &[f64]) -> f64 {
    let all: f64 = along.iter().sum();
    let within = |parts: &mut dyn Iterator<Item = (usize, &f64)>| {
        let mut sum = 0.0;
        let mut parts = parts.skip_while(|(_, part)| {
            sum += **part;
            sum <= BEYOND * all
        });
        parts.next().map(|(at, _)| at as f64)
    };
    let ends = [within(&mut along.iter().enumerate()), within(&mut along.iter().enumerate().rev())];
    let [Some(first), Some(last)] = ends else { return 0.0 };
    let centre = along.iter().enumerate().map(|(at, part)| at as f64 * part).sum::<f64>() / all;
    (centre - 0.5 * (first + last)) / (0.5 * (last - first)).max(0.5)
}

/// Standard deviation of the places of what lies along an axis.
fn spread(along: &[f64]) -> f64 {
    let all: f64 = along.iter().sum();
    let mean = |of: &dyn Fn(f64) -> f64| {
        along.iter().enumerate().map(|(at, part)| of(at as f64) * part).sum::<f64>() / all
    };
    let centre = mean(&|at| at);
    mean(&|at| (at - centre).powi(2)).sqrt()
}

/// The axis of the world that is nearest to a direction.
fn nearest(direction: DVec3) -> UpAxis {
    let along = |axis: &UpAxis| axis.vector().dot(direction);
    let nearest = UpAxis::ALL.into_iter().max_by(|a, b| along(a).total_cmp(&along(b)));
    nearest.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FirstLook;
    use crate::volume::Samples;

    const SIDE: usize = 64;

    /// 8 bits at places of 0..64³, in a volume whose file says nothing.
    fn told(value: impl Fn([f64; 3]) -> u8) -> Orientation {
        let at = |i: usize| [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|n| n as f64);
        // A few of every value, so that they are measurements.
        let spread = |i: usize| if i.is_multiple_of(97) { (i / 97 % 60) as u8 } else { 0 };
        let values = (0..SIDE.pow(3)).map(|i| value(at(i)).max(spread(i)));
        let lattice = Lattice::unit([SIDE; 3]);
        let volume = ScalarVolume::from_samples("made", lattice, Samples::UInt8(values.collect()));
        FirstLook::of(&volume.expect("sound"), None).orientation
    }

    /// A pot at the low end of y, and a thin stem above it.
    fn potted([x, y, z]: [f64; 3]) -> u8 {
        let from_stem = (x - 32.0).hypot(z - 32.0);
        match y {
            y if y < 14.0 && from_stem < 16.0 => 200,
            y if y < 60.0 && from_stem < 2.5 => 200,
            _ => 0,
        }
    }

    /// An ellipse all along z whose shoulders are at one end; below it, or above, an arc.
    fn on_table([x, y, _]: [f64; 3], table: f64) -> u8 {
        let is_body = ((x - 32.0) / 24.0).hypot((y - 32.0) / 14.0) < 1.0;
        let is_table = (y - table).abs() < 1.0 && (x - 32.0).abs() < 20.0;
        if is_body {
            150
        } else if is_table {
            90
        } else {
            0
        }
    }

    #[test]
    fn what_was_turned_on_a_wheel_stands_on_its_heavier_end() {
        // Half as wide from the middle on, as wide as it is deep times `depth`.
        let vessel = |depth: f64| {
            move |[x, y, z]: [f64; 3]| {
                let radius = if (4.0..34.0).contains(&y) { 16.0 } else { 12.0 };
                let from_axis = (x - 31.5).hypot((z - 31.5) / depth);
                if (4.0..60.0).contains(&y) && from_axis < radius { 200 } else { 0 }
            }
        };
        assert_eq!(told(vessel(1.0)).up, UpAxis::PlusY);
        let upside_down = |[x, y, z]: [f64; 3]| vessel(1.0)([x, 63.0 - y, z]);
        assert_eq!(told(upside_down).up, UpAxis::MinusY);
        assert_eq!(told(|[x, y, z]| vessel(1.0)([y, z, x])).up, UpAxis::PlusZ);
        // As heavy at one end, but not round.
        assert_eq!(told(vessel(1.3)), Orientation::default());
    }

    #[test]
    fn what_has_a_heavy_end_stands_on_it() {
        assert_eq!(told(potted).up, UpAxis::PlusY);
        assert_eq!(told(|[x, y, z]| potted([x, 63.0 - y, z])).up, UpAxis::MinusY);
        assert_eq!(told(|[x, y, z]| potted([y, x, z])).up, UpAxis::PlusX);
        assert_eq!(
            told(|[x, y, z]| potted([x, 63.0 - z, y])),
            Orientation { up: UpAxis::MinusZ, ..Orientation::default() }
        );
        // A ball has none, nor a rod.
        let ball = |at: [f64; 3]| if (DVec3::from(at) - 32.0).length() < 24.0 { 200 } else { 0 };
        assert_eq!(told(ball), Orientation::default());
        let rod = |[x, y, _]: [f64; 3]| if (x - 32.0).hypot(y - 32.0) < 6.0 { 200 } else { 0 };
        assert_eq!(told(rod), Orientation::default());
    }

    #[test]
    fn who_lies_on_a_scanners_table_is_seen_from_the_front_with_the_head_up() {
        // Rows that run from the front to the back: slices from the feet upwards.
        let usual = told(|at| on_table(at, 58.0));
        assert_eq!(
            usual,
            Orientation {
                right: Some(UpAxis::MinusX),
                anterior: Some(UpAxis::MinusY),
                up: UpAxis::PlusZ,
            }
        );
        // Rows that run from the back to the front: slices from the head downwards.
        let turned = told(|at| on_table(at, 6.0));
        assert_eq!(
            turned,
            Orientation {
                right: Some(UpAxis::MinusX),
                anterior: Some(UpAxis::PlusY),
                up: UpAxis::MinusZ,
            }
        );
        // Without a table, with two, or one that ends half way, nobody knows.
        let bare = told(|at| on_table(at, -9.0));
        let two = told(|at| on_table(at, 58.0).max(on_table(at, 6.0)));
        let half = told(|at| if at[2] < 30.0 { on_table(at, 58.0) } else { on_table(at, -9.0) });
        assert_eq!([bare, two, half], [Orientation::default(); 3]);
    }

    #[test]
    fn heaviness_is_of_the_centre_between_the_ends() {
        assert_eq!(heaviness(&[0.0, 1.0, 1.0, 1.0, 0.0]), 0.0);
        assert!((heaviness(&[8.0, 1.0, 1.0, 1.0, 1.0]) + 0.583).abs() < 1e-3);
        assert_eq!(heaviness(&[0.0; 5]), 0.0);
        assert_eq!(heaviness(&[1.0]), 0.0);
    }
}
