//! What a finished picture is still off by: some of its pixels are drawn once more, with ever thinner slabs.
//!
//! Nothing is modelled but how the differences of such pictures go on. A field in smooth colours gains 12 dB with each
//! doubling and more, what is lit 5 to 8, and where it is the middle of a slab that is off, every doubling is off to the
//! same side: both are seen from three pictures, each of twice the slabs of the one before.

use super::draw::{DrawError, Drawer, Observer, Rung, shrunk};
use super::still::widened;
use crate::accuracy::{self, sweep::exact_mode};
use crate::core::{Camera, Projection};
use crate::gpu::GpuError;
use crate::plan::{Plan, Way};
use crate::scene::{Classify, MOST_SLABS_PER_VOXEL, SplatSettings, Visibility};

/// What an error that was found so may be off by, dB, in 95 pictures of 100 (`tests/remaining.rs`).
pub const WITHIN_DB: f64 = 3.0;
/// What finished pictures are mostly off by where nothing could be drawn beside one, and what that may be off by, dB: 40 to 66 dB in
/// slabs of reconstructed fields, and 26 to 61 shaded first (0.0009 to 0.05 on demos and scans, as in `estimate`).
const USUAL: [Told; 2] =
    [Told { rmse: 2.2e-3, within_db: 13.0 }, Told { rmse: 6.7e-3, within_db: 17.5 }];
/// The same of what is lit, in slabs of reconstructed fields: 37 to 67 dB of ten scans and simulations as they open, 480 × 320 pixels.
const USUAL_LIT: Told = Told { rmse: 2.4e-3, within_db: 15.5 };
/// What a doubling of the slabs leaves of what is lit, mostly: 0.26 to 0.31 on two scans. Of what is not it leaves less.
const LEFT_OF_LIT: f64 = 0.3;
/// How much farther off what was found of a picture may be for one that is seen from elsewhere, dB.
const ELSEWHERE_DB: f64 = 3.0;
/// Pixels of a picture that are drawn again, about.
const PIXELS: f64 = 16_384.0;
/// What a doubling of the slabs leaves of a difference: within these, whatever two differences say. Rounding and
/// steps of a transfer function are no series.
const LEFT: [f64; 2] = [0.05, 0.75];

/// What a picture is said to be off by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// RMSE over RGB, linear light, over black.
    pub rmse: f64,
    /// What that may be off by, dB.
    pub within_db: f64,
}

impl Told {
    /// Of a picture of a plan that was measured; or, where no other could be drawn beside it, of such pictures as a rule.
    ///
    /// # Errors
    /// Interrupted, and a device that is not well.
    pub(super) fn of(plan: &Plan, measured: Result<f64, DrawError>) -> Result<Self, DrawError> {
        match measured {
            Ok(rmse) => Ok(Self { rmse, within_db: WITHIN_DB }),
            Err(error) if error.is_refusal() && error != DrawError::Interrupted => {
                log::warn!("what the picture is off by was not found: {error}");
                Ok(Self::usual(plan))
            }
            Err(error) => Err(error),
        }
    }

    /// After so many doublings of the slabs.
    pub(super) fn with_slabs_doubled(self, times: f64) -> Self {
        Self { rmse: self.rmse * LEFT_OF_LIT.powf(times), ..self }
    }

    /// Of such pictures as a rule.
    fn usual(plan: &Plan) -> Self {
        let is_in_slabs =
            plan.mode.visibility == Visibility::Slabs && plan.mode.classify != Classify::Before;
        match is_in_slabs {
            _ if plan.way == Way::Nothing => Self { rmse: 0.0, within_db: WITHIN_DB },
            true if plan.shading.lighting.is_some() => USUAL_LIT,
            _ => USUAL[usize::from(!is_in_slabs)],
        }
    }

    /// Of a picture that is not measured yet: as what was found last of the same samples in the same mode, from elsewhere perhaps;
    /// else as such pictures are as a rule.
    pub(super) fn thought(plan: &Plan, last: Option<&(Plan, Self)>) -> Self {
        let is_like = |(of, _): &&(Plan, Self)| {
            of.has_same_samples(plan) && of.mode == plan.mode && of.shading == plan.shading
        };
        match last.filter(is_like) {
            Some((_, told)) if plan.way != Way::Nothing => {
                Self { within_db: told.within_db + ELSEWHERE_DB, ..*told }
            }
            _ => Self::usual(plan),
        }
    }
}

/// Whether [`of_finished`] looks at the picture itself.
pub(super) fn needs_light(plan: &Plan) -> bool {
    plan.way != Way::Nothing && plan.mode.visibility != Visibility::Slabs
}

/// What the finished picture of a plan is off by: RMSE over RGB, linear light, over black. Against the converged one of
/// its mode; where that has no slabs, against that of the exact mode, and `light` is the picture itself. 0 where
/// neither values nor vectors are on it. The engine's picture is another one afterwards.
///
/// # Errors
/// Interrupted by the observer, or the device.
pub(super) fn of_finished(
    drawer: &mut Drawer,
    plan: &Plan,
    light: &[[f32; 4]],
    observer: &mut dyn Observer,
) -> Result<f64, DrawError> {
    if plan.way == Way::Nothing {
        return Ok(0.0);
    }
    if needs_light(plan) {
        return of_shown(drawer, plan, light, observer);
    }
    let series = Series::of(plan.mode.slabs_per_voxel);
    let small = fewer_pixels(plan);
    let mut differences = Vec::new();
    let mut coarser: Option<Vec<[f32; 4]>> = None;
    for slabs_per_voxel in series.slabs {
        let mode = SplatSettings { slabs_per_voxel, ..plan.mode };
        let finer = drawn_aside(drawer, &Plan { mode, ..small.clone() }, observer)?;
        if let Some(coarser) = &coarser {
            differences.push(difference(coarser, &finer)?);
        }
        coarser = Some(finer);
    }
    Ok(match differences.as_slice() {
        [first, second] => series.rmse(first, second),
        _ => 0.0,
    })
}

/// What a picture is off by whose pixels are `light`, premultiplied, at the size of `plan`, as [`of_finished`], but for
/// what its mode has no slabs for, or fewer pixels were drawn for: against the exact picture at some of its pixels.
///
/// # Errors
/// Interrupted by the observer, or the device.
pub(super) fn of_shown(
    drawer: &mut Drawer,
    plan: &Plan,
    light: &[[f32; 4]],
    observer: &mut dyn Observer,
) -> Result<f64, DrawError> {
    if plan.way == Way::Nothing {
        return Ok(0.0);
    }
    let mode = match plan.mode.visibility {
        Visibility::Slabs => plan.mode,
        _ => exact_mode(&plan.mode, 1.0),
    };
    // Marks and the edges of triangles are averaged over a pixel, whose size they depend on.
    let is_of_points = plan.kernels.is_empty() && plan.surfaces.is_empty();
    let every = Every::of(plan.size, if is_of_points { PIXELS } else { f64::INFINITY });
    let slabs_per_voxel = (4.0 * mode.slabs_per_voxel).min(MOST_SLABS_PER_VOXEL);
    let truth = Plan { camera: every.camera(plan), ..plan.clone() };
    let truth = truth.at_size(every.small, f64::from(every.step));
    let truth = truth.in_mode(SplatSettings { slabs_per_voxel, ..mode });
    let held = drawer.holds_own_field(&truth);
    let exact = drawn_aside(drawer, &truth, observer);
    if !held && mode.visibility != plan.mode.visibility {
        // The picture itself has no use for it.
        drawer.forget_own_field();
    }
    let exact = exact?;
    let found: Option<Vec<_>> = every.indices().map(|at| light.get(at).copied()).collect();
    rmse(&found.unwrap_or_default(), &exact)
}

/// The plan's picture of fewer pixels.
fn fewer_pixels(plan: &Plan) -> Plan {
    let pixels = f64::from(plan.size[0]) * f64::from(plan.size[1]);
    let shrink = (pixels / PIXELS).sqrt().max(1.0);
    // Rays are those of the picture, however far they are apart. Vectors would be drawn in a hurry.
    let enlarged = if plan.kernels.is_empty() { shrink } else { 1.0 };
    // Samples that are shaded first do not become nodes of an octree because they are smaller.
    Plan { way: plan.way, ..plan.at_size(shrunk(plan.size, shrink), enlarged) }
}

/// The light of a picture that nobody waits for: what it costs says nothing of those that somebody does.
fn drawn_aside(
    drawer: &mut Drawer,
    plan: &Plan,
    observer: &mut dyn Observer,
) -> Result<Vec<[f32; 4]>, DrawError> {
    drawer.aside(|drawer| {
        drawer.draw(plan, Rung::Full, observer)?;
        Ok(drawer.engines.read_light()?)
    })
}

fn rmse(found: &[[f32; 4]], exact: &[[f32; 4]]) -> Result<f64, DrawError> {
    let compared = accuracy::rmse(&widened(found), &widened(exact));
    Ok(compared.map_err(|error| GpuError::Device(format!("two pictures of one size: {error}")))?)
}

/// What the second picture of two is more than the first, RGB.
fn difference(first: &[[f32; 4]], second: &[[f32; 4]]) -> Result<Vec<f64>, DrawError> {
    // Says what is no colour, and what is of another size.
    rmse(first, second)?;
    let channels = |(a, b): (&[f32; 4], &[f32; 4])| [0, 1, 2].map(|c| f64::from(b[c] - a[c]));
    Ok(first.iter().zip(second).flat_map(channels).collect())
}

/// Three pictures, each of twice as many slabs as the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Series {
    /// Slabs per voxel.
    slabs: [f64; 3],
    /// Doublings from the first of them to the picture that is judged.
    behind: f64,
}

impl Series {
    /// From a picture on; where that many slabs are not drawn, from a coarser one.
    fn of(slabs_per_voxel: f64) -> Self {
        let most = (4.0 * slabs_per_voxel).min(MOST_SLABS_PER_VOXEL);
        let slabs = [most / 4.0, most / 2.0, most];
        Self { slabs, behind: (slabs_per_voxel / slabs[0]).log2() }
    }

    /// The judged picture's distance from the end of the series, whose first two differences are given: that the next
    /// ones fall as the second did, and point away from one another as these two do.
    fn rmse(&self, first: &[f64], second: &[f64]) -> f64 {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let [first_square, second_square] = [first, second].map(|d| product(d, d));
        let sum = first_square + second_square + 2.0 * product(first, second);
        if first_square <= 0.0 || second_square <= 0.0 {
            return (sum.max(0.0) / first.len().max(1) as f64).sqrt();
        }
        let left = (second_square / first_square).sqrt().clamp(LEFT[0], LEFT[1]);
        let cosine = product(first, second) / (first_square * second_square).sqrt();
        let cosine = cosine.clamp(0.0, 1.0);
        // Of differences 1, left, left², …: the square of the sum of all, and of the first two.
        let all = cosine / (1.0 - left).powi(2) + (1.0 - cosine) / (1.0 - left * left);
        let two = 1.0 + left * left + 2.0 * cosine * left;
        let square = sum.max(0.0) * all / two / first.len() as f64;
        square.sqrt() * left.powf(self.behind)
    }
}

/// Every so many-th pixel of a picture in both directions, by a camera that sees just these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Every {
    size: [u32; 2],
    /// Odd, so that one pixel is in the middle of so many.
    pub(super) step: u32,
    /// Pixels that are seen.
    pub(super) small: [u32; 2],
}

impl Every {
    /// At most about so many pixels; those along the border may be missing.
    pub(super) fn of(size: [u32; 2], pixels: f64) -> Self {
        let most = (f64::from(size[0]) * f64::from(size[1]) / pixels).sqrt();
        let least_side = size[0].min(size[1]).max(1);
        let mut step = 1;
        while f64::from(step) < most && (step + 2) * 2 <= least_side {
            step += 2;
        }
        // As odd or even as the picture, about whose middle they lie.
        let small = size.map(|n| {
            let count = n / step;
            if count % 2 == n % 2 { count } else { count.saturating_sub(1) }
        });
        let is_empty = small.contains(&0);
        match is_empty {
            true => Self { size, step: 1, small: size },
            false => Self { size, step, small },
        }
    }

    /// Sees the pixels' middles as the plan's does.
    pub(super) fn camera(&self, plan: &Plan) -> Camera {
        let share = f64::from(self.small[1] * self.step) / f64::from(self.size[1].max(1));
        let projection = match plan.camera.projection {
            Projection::Orthographic => Projection::Orthographic,
            Projection::Perspective { view_angle } => {
                let tangent = (view_angle / 2.0).tan() * share;
                Projection::Perspective { view_angle: 2.0 * tangent.atan() }
            }
        };
        Camera { parallel_scale: plan.camera.parallel_scale * share, projection, ..plan.camera }
    }

    /// Where they are among the pixels of the picture, rows from the top.
    pub(super) fn indices(self) -> impl Iterator<Item = usize> {
        let at = move |axis: usize, i: u32| {
            let border = (self.size[axis] - self.small[axis] * self.step) / 2;
            (border + i * self.step + self.step / 2) as usize
        };
        let row = self.size[0] as usize;
        let [columns, rows] = self.small;
        (0..rows).flat_map(move |y| (0..columns).map(move |x| at(1, y) * row + at(0, x)))
    }
}
