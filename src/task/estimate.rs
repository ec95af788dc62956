//! How far a coarse picture is thought to be from the finished one, and how far it turned out to be.

use super::draw::{Drawn, Rung, background_light};
use super::engine::Picture;
use crate::accuracy::{self, CompareError};
use crate::core::colour::linear_from_srgb;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::plan::SlabField;
use crate::scene::{Background, Classify};

/// RMSE that a cut adds, per unit of its greatest node error: 0.03 to 0.08 on the demos shells,
/// tornado and head (48³) and on hydrogen, 480 × 400 pixels, budgets of 4 to 50 ms.
const PER_ERROR: f64 = 0.06;
/// How much farther off averages of every second or fourth sample are than cuts of the same greatest error, most of whose nodes
/// are nearer: 2.4 to 5.6 dB of a head.
const SUBSAMPLED: f32 = 1.5;
/// RMSE that drawing an octree cut smaller adds, for each time that it is smaller: 0.001 to 0.005
/// there.
const PER_SHRINK: f64 = 0.002;
/// How fast what is lost may grow with the distance between pixels, as powers of it: linear
/// interpolation of what is smooth loses four times as much at twice the distance; noise, no more.
const GROWTH: [f64; 2] = [0.2, 2.0];
/// RMSE of a whole picture of the nearest tents: 0.0057 on aneurism, 0.0045 on LIDC2, 0.0012 on bonsai,
/// 1280 × 800 pixels.
const TENTS_RMSE: f64 = 0.004;
/// The same of what lights fall on, since tents have other gradients: 0.024 on aneurism, 0.02 on bonsai, as they open.
const LIT_TENTS_RMSE: f64 = 0.02;
/// And of cells, whose border is lit as it is turned, which tents know nothing of: 0.045 on a million tetrahedra.
const LIT_TENTS_OF_CELLS_RMSE: f64 = 0.045;
/// RMSE of means of vectors in the place of all, of the root mean square of their picture's light: 0.27 to 0.98
/// at 3 ms and 0.18 to 0.75 at 150 ms on carotid, office and the tornado (MODULATE and BLEND), 640 × 400 pixels.
const MEANS_SHARE: f64 = 0.5;
/// The same of vectors that are all there, whose marks are blurred for larger pixels, for each time that the
/// picture is halved, up to that of means: 0.22 on carotid and 0.065 on the tornado (BLEND) at 226 × 141 for
/// 640 × 400 pixels. A picture drawn smaller cannot tell: what it lacks it does not show.
const BLUR_SHARE: f64 = 0.12;
/// What shading before reconstruction costs even with every voxel drawn: 0.0009 to 0.028 there, 0.01
/// to 0.05 on scans (design.md §1).
const SHADE_FIRST_RMSE: f64 = 0.01;
/// RMSE of every voxel as a point, which leaves holes: 0.34 and 0.35 of heads, 0.16 of a scan (`docs/reproductions.md`).
const POINTS_RMSE: f64 = 0.27;
/// And as a box: 0.09 and 0.05 there, 0.017 of a head of 64³ samples at 640 × 480 pixels.
const NEAREST_RMSE: f64 = 0.042;
/// No estimate by a model begins below this: bytes hardly show it.
const LEAST_RMSE: f64 = 1e-3;
/// Nor one of fields, whose parts are measured, below this: no difference that is told from rounding to bytes.
const LEAST_OF_FIELDS: f64 = 1e-4;
/// Share of the way that a check takes the gain towards what would have been right; the first one of
/// a mode takes it all the way.
const TRUST: f64 = 0.5;
/// A gain never leaves 1 by more than a factor of 2 to this power: it stays a number.
const MOST_DOUBLINGS: f64 = 10.0;
/// Pixels along each side that two pictures are compared at, at most.
const COMPARED_SIDE: u32 = 256;
/// Pixels of a picture that are looked at for its detail, about: 1 to 2 ms.
const MOST_PIXELS: usize = 1 << 16;

/// What a coarse picture was thought to be off by, and what it was. Root mean square over RGB, linear
/// light, as shown over its background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    /// Thought before.
    pub estimated_rmse: f64,
    /// Found against the finished picture.
    pub measured_rmse: f64,
}

impl Checked {
    /// The estimate minus the truth in dB: positive where the picture was worse than thought.
    /// `None` where one of the two has no finite level.
    pub fn off_db(&self) -> Option<f64> {
        let level = accuracy::psnr_from_rmse;
        let off = level(self.estimated_rmse) - level(self.measured_rmse);
        off.is_finite().then_some(off)
    }
}

/// How a picture is coarser than the finished one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coarseness {
    /// A cut of the octree, shaded first whatever the mode, perhaps drawn smaller.
    Octree {
        /// The greatest error of its nodes.
        max_error: f32,
        /// What pixels that points leave out are thought to cost (see `Drawn`).
        missing_rmse: f64,
    },
    /// The scene's own mode, only smaller.
    Reduced {
        /// See [`sampling_rmse`].
        sampling_rmse: f64,
        /// Of which field.
        field: SlabField,
        /// What it is thought to cost that this is another than the scene's own.
        field_rmse: f64,
        /// What a cut of it is thought to cost, where it is one.
        cut_rmse: Option<f64>,
    },
    /// Every so many-th sample, averaged: a cut of the octree that nobody fitted.
    Subsampled {
        /// The greatest error of its nodes.
        max_error: f32,
    },
    /// Every voxel with a cheaper kernel than the mode's.
    Cheaper(Kernel),
    /// A scene with vectors, smaller.
    Vectors {
        /// See [`sampling_rmse`].
        sampling_rmse: f64,
        /// What it is thought to cost that means stand for them, or that their marks are blurred.
        marks_rmse: f64,
        /// Whether means do.
        are_means: bool,
    },
}

impl Coarseness {
    /// How the picture of a rung of `plan` is coarser, drawn `shrink` times smaller than it is shown; `rgba`
    /// are its bytes at the size drawn, as in [`Picture`]. `None` for rungs without an estimate.
    pub(super) fn of(
        plan: &Plan,
        rung: Rung,
        drawn: &Drawn,
        shrink: f64,
        rgba: &[u8],
    ) -> Option<Self> {
        match rung {
            Rung::Octree { .. } | Rung::Subsampled { .. } | Rung::Cheaper(_)
                if drawn.is_reduced => {}
            Rung::Subsampled { .. } => {
                return Some(Self::Subsampled { max_error: drawn.max_error });
            }
            Rung::Cheaper(kernel) => return Some(Self::Cheaper(kernel)),
            _ => {}
        }
        match rung {
            Rung::Coarse { .. } | Rung::Octree { .. } if !drawn.is_reduced => {
                let &Drawn { max_error, missing_rmse, .. } = drawn;
                // What it leaves out of a scene, nobody has seen: as much light, it is thought, as is there.
                let left_out = match plan.kernels.is_empty() {
                    true => 0.0,
                    false => light_rms(plan.background, rgba),
                };
                Some(Self::Octree { max_error, missing_rmse: missing_rmse.hypot(left_out) })
            }
            Rung::Full => None,
            _ => {
                let is_smaller = shrink > 1.0;
                if !is_smaller && drawn.is_of_own() {
                    // The finished picture.
                    return None;
                }
                let sampling_rmse = if is_smaller { sampling_rmse(drawn.size, rgba) } else { 0.0 };
                if !plan.kernels.is_empty() {
                    let are_means = drawn.vectors_averaged > 0;
                    let share = match are_means {
                        true => MEANS_SHARE,
                        false => (BLUR_SHARE * shrink.max(1.0).log2()).min(MEANS_SHARE),
                    };
                    let marks_rmse = match share {
                        0.0 => 0.0,
                        _ => share * light_rms(plan.background, rgba),
                    };
                    return Some(Self::Vectors { sampling_rmse, marks_rmse, are_means });
                }
                let cut_rmse = drawn.cut.map(|cut| cut.rmse);
                let &Drawn { field, field_rmse, .. } = drawn;
                Some(Self::Reduced { sampling_rmse, field, field_rmse, cut_rmse })
            }
        }
    }

    fn kind(self) -> usize {
        match self {
            Self::Octree { .. } => 0,
            Self::Reduced { cut_rmse: Some(_), .. } => 5,
            Self::Reduced { field: SlabField::Own, .. } => 1,
            Self::Reduced { field: SlabField::Preview, .. } => 2,
            Self::Vectors { are_means, .. } => 3 + usize::from(are_means),
            Self::Subsampled { .. } => 6,
            Self::Cheaper(Kernel::Point) => 7,
            Self::Cheaper(_) => 8,
        }
    }

    fn least_rmse(self) -> f64 {
        if let Self::Reduced { .. } = self { LEAST_OF_FIELDS } else { LEAST_RMSE }
    }

    /// The estimate before anything was learnt: RMSE in linear light. Errors of different origin add
    /// up in squares.
    fn first_rmse(self, classify: Classify, shrink: f64) -> f64 {
        let (max_error, missing_rmse) = match self {
            Self::Reduced { sampling_rmse, field_rmse, cut_rmse, .. } => {
                return field_rmse.hypot(sampling_rmse).hypot(cut_rmse.unwrap_or(0.0));
            }
            Self::Vectors { sampling_rmse, marks_rmse, .. } => {
                return marks_rmse.hypot(sampling_rmse);
            }
            Self::Cheaper(Kernel::Point) => return POINTS_RMSE,
            Self::Cheaper(_) => return NEAREST_RMSE,
            Self::Octree { max_error, missing_rmse } => (max_error, missing_rmse),
            Self::Subsampled { max_error } => (SUBSAMPLED * max_error, 0.0),
        };
        let enlarged = PER_SHRINK * (shrink - 1.0).max(0.0);
        // Nor is any picture further off than black from white.
        let octree = (PER_ERROR * f64::from(max_error).max(0.0)).min(1.0);
        let shade_first = match classify {
            Classify::Before => 0.0,
            Classify::After | Classify::PreIntegrated | Classify::Mean => SHADE_FIRST_RMSE,
        };
        octree.hypot(enlarged).hypot(shade_first).hypot(missing_rmse)
    }
}

/// What it is thought to cost to draw a plan from a field: RMSE of a whole picture.
pub(super) fn field_rmse(plan: &Plan, field: SlabField) -> f64 {
    match field {
        SlabField::Own => 0.0,
        SlabField::Preview
            if plan.mode.kernel == Kernel::Cells && plan.shading.lights_borders() =>
        {
            LIT_TENTS_OF_CELLS_RMSE
        }
        SlabField::Preview if plan.shading.uses_gradient() => LIT_TENTS_RMSE,
        SlabField::Preview => TENTS_RMSE,
    }
}

/// Of coarseness.
const KINDS: usize = 9;

/// The model of a coarse picture's error: what its cut, its size and its shading are thought to
/// cost, times a gain learnt from the finished pictures of the same volume and mode.
#[derive(Debug, Clone, Default)]
pub struct Estimator {
    /// log₂ of the gain of each kind of coarseness.
    doublings: [f64; KINDS],
    /// Checks of each kind.
    checks: [u32; KINDS],
    learnt_from: Option<Plan>,
}

impl Estimator {
    /// The RMSE that a coarse picture of `plan` is thought to have, drawn `shrink` times smaller
    /// than it is shown.
    pub fn rmse(&self, plan: &Plan, coarseness: Coarseness, shrink: f64) -> f64 {
        let known = if self.knows(plan) { self.doublings[coarseness.kind()] } else { 0.0 };
        let first = coarseness.first_rmse(plan.mode.classify, shrink);
        first.max(coarseness.least_rmse()) * known.exp2()
    }

    /// Takes in what a coarse picture of `plan` turned out to be.
    pub fn learn(&mut self, plan: &Plan, coarseness: Coarseness, checked: &Checked) {
        if !self.knows(plan) {
            (self.doublings, self.checks) = Default::default();
            self.learnt_from = Some(plan.clone());
        }
        let off = (checked.measured_rmse / checked.estimated_rmse).log2();
        if off.is_finite() {
            let kind = coarseness.kind();
            let trust = if self.checks[kind] == 0 { 1.0 } else { TRUST };
            self.checks[kind] += 1;
            let doublings = &mut self.doublings[kind];
            *doublings = (*doublings + trust * off).clamp(-MOST_DOUBLINGS, MOST_DOUBLINGS);
        }
    }

    fn knows(&self, plan: &Plan) -> bool {
        let is_like = |of: &Plan| of.has_same_samples(plan) && of.mode == plan.mode;
        self.learnt_from.as_ref().is_some_and(is_like)
    }
}

/// What a picture in part is off by, of which a share is drawn, where a coarse one of the same view was shown before it,
/// thought to be off by so much: as much as the two differ, less what that one lacks where the part has it.
pub(super) fn part_rmse(part: &Picture, done: f64, coarse: Option<&Picture>) -> f64 {
    let known = coarse.and_then(|coarse| Some((coarse, coarse.report.estimated_rmse?)));
    let found = known.and_then(|(coarse, rmse)| {
        let differ = shown_rmse(part, coarse).ok()?;
        let of_rest = differ * differ - done * rmse * rmse;
        // Nor is it nearer than a picture of which as much were coarse.
        Some(of_rest.max((1.0 - done) * rmse * rmse).sqrt())
    });
    found.unwrap_or_else(|| {
        // As bright as what is there.
        let light = light_rms(Background::Transparent, &part.rgba);
        light * ((1.0 - done) / done.max(1e-3)).sqrt()
    })
}

/// RMSE between two pictures as they are shown at the size they were asked for: sRGB bytes enlarged
/// linearly, then taken as linear premultiplied light over RGB; at up to 256² pixels.
///
/// # Errors
/// Where a picture is empty or incomplete.
pub fn shown_rmse(first: &Picture, second: &Picture) -> Result<f64, CompareError> {
    let light: Vec<f64> =
        (0..=255_u8).map(|byte| linear_from_srgb(f64::from(byte) / 255.0)).collect();
    let size = second.requested_size;
    accuracy::rmse(&sampled(first, size, &light)?, &sampled(second, size, &light)?)
}

/// What a picture that is enlarged linearly is thought to be off by for lack of pixels: RMSE over RGB,
/// linear light. By what leaving out every second pixel of it, and two of three, would cost, with as much
/// growth from no pixel left out to the first as from the first to the second. `size` and `rgba` as in
/// [`Picture`].
///
/// Exact pictures of three scans at every 4th to 10th pixel, and of four demos at every 2nd to 5th, were
/// off by as much within 1.6 dB rms (0.4 dB better in the mean, 5.2 worse at worst).
pub fn sampling_rmse(size: [u32; 2], rgba: &[u8]) -> f64 {
    let [second, third] = [2, 3].map(|step| detail_rmse(size, rgba, step));
    let growth = (third / second).ln() / 1.5_f64.ln();
    // Nothing lost, or too few pixels to tell.
    if !growth.is_finite() {
        return second;
    }
    second / growth.clamp(GROWTH[0], GROWTH[1]).exp2()
}

/// Root mean square over RGB of what a picture's light is beyond its background's, linear; at up to
/// [`MOST_PIXELS`] pixels.
fn light_rms(background: Background, rgba: &[u8]) -> f64 {
    let behind = background_light(background).map_or([0.0; 3], |colour| colour.0);
    let light: Vec<f64> =
        (0..=255_u8).map(|byte| linear_from_srgb(f64::from(byte) / 255.0)).collect();
    let step = (rgba.len() / 4).div_ceil(MOST_PIXELS).max(1);
    let pixels = rgba.chunks_exact(4).step_by(step);
    let count = pixels.len().max(1) as f64;
    let square =
        |(c, behind): (usize, f64), pixel: &[u8]| (light[usize::from(pixel[c])] - behind).powi(2);
    let squares: f64 = pixels
        .flat_map(|pixel| behind.into_iter().enumerate().map(move |of| (of, pixel)))
        .map(|(of, pixel)| square(of, pixel))
        .sum();
    (squares / (3.0 * count)).sqrt()
}

/// What leaving out all but every `step`-th pixel of a picture, in both directions, would cost: RMSE over
/// RGB, linear light, of what is enlarged from them linearly against the picture itself. 0 for
/// pictures of fewer than four pixels a side.
fn detail_rmse(size: [u32; 2], rgba: &[u8], step: usize) -> f64 {
    let [width, height] = size.map(|n| n as usize);
    if width < 4 || height < 4 || rgba.len() != width * height * 4 {
        return 0.0;
    }
    let light: Vec<f64> =
        (0..=255_u8).map(|byte| linear_from_srgb(f64::from(byte) / 255.0)).collect();
    // Pixels between the middles of the first and the last whole block.
    let middle = step / 2;
    let [columns, rows] = [width, height].map(|n| middle..=(n / step - 1) * step + middle);
    let share = |at: usize| ((at - middle) % step) as f64 / step as f64;
    let row_step = (width * height).div_ceil(MOST_PIXELS);
    let byte = |x: usize, y: usize, c: usize| f64::from(rgba[(y * width + x) * 4 + c]);
    let (mut squares, mut count) = (0.0, 0.0);
    for y in rows.step_by(row_step) {
        let (top, down) = ((y - middle) / step * step + middle, share(y));
        let bottom = if down > 0.0 { top + step } else { top };
        for x in columns.clone() {
            let (left, across) = ((x - middle) / step * step + middle, share(x));
            let right = if across > 0.0 { left + step } else { left };
            for c in 0..3 {
                let row = |y| byte(left, y, c) + (byte(right, y, c) - byte(left, y, c)) * across;
                let mixed = row(top) + (row(bottom) - row(top)) * down;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a byte"
                )]
                let off = light[(mixed + 0.5) as usize] - light[byte(x, y, c) as usize];
                squares += off * off;
                count += 1.0;
            }
        }
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// The light of a picture at the centres of evenly spaced pixels of `size`.
fn sampled(
    picture: &Picture,
    size: [u32; 2],
    light: &[f64],
) -> Result<Vec<[f64; 4]>, CompareError> {
    let [width, height] = picture.size.map(|n| n as usize);
    if picture.rgba.len() != width * height * 4 {
        let (first, second) = (picture.rgba.len() / 4, width * height);
        return Err(CompareError::Size { first, second });
    }
    if picture.rgba.is_empty() || size.contains(&0) {
        return Err(CompareError::Empty);
    }
    let [across, down] = [0, 1].map(|axis| positions(size[axis], picture.size[axis]));
    let texel = |x: usize, y: usize| -> [f64; 4] {
        let at = (y * width + x) * 4;
        std::array::from_fn(|channel| f64::from(picture.rgba[at + channel]))
    };
    let decode = |pixel: [f64; 4]| {
        let alpha = pixel[3] / 255.0;
        let lit = |byte: f64| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let low = byte as usize;
            let (low, high) = (light[low], light[(low + 1).min(255)]);
            (low + (high - low) * byte.fract()) * alpha
        };
        [lit(pixel[0]), lit(pixel[1]), lit(pixel[2]), alpha]
    };
    let mix = |a: [f64; 4], b: [f64; 4], share: f64| -> [f64; 4] {
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
    };
    let row = |&(top, bottom, share): &(usize, usize, f64)| {
        let pixel = |&(left, right, beside): &(usize, usize, f64)| {
            let above = mix(texel(left, top), texel(right, top), beside);
            let below = mix(texel(left, bottom), texel(right, bottom), beside);
            decode(mix(above, below, share))
        };
        across.iter().map(pixel).collect::<Vec<_>>()
    };
    Ok(down.iter().flat_map(row).collect())
}

/// For evenly spaced pixels of `shown`, the two of `stored` around each centre and the share of the
/// second.
fn positions(shown: u32, stored: u32) -> Vec<(usize, usize, f64)> {
    let count = shown.min(COMPARED_SIDE);
    let last = stored as usize - 1;
    (0..count)
        .map(|i| {
            // The centre of a whole pixel, so that a picture of that size is taken as it is.
            let pixel = (f64::from(i) + 0.5) * f64::from(shown) / f64::from(count);
            let centre = pixel.floor() + 0.5;
            let x = centre * f64::from(stored) / f64::from(shown) - 0.5;
            let x = x.clamp(0.0, last as f64);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=last")]
            let left = x as usize;
            (left, (left + 1).min(last), x.fract())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Srgb8, Ticket};
    use std::sync::Arc;

    use crate::scene::{Scene, VectorLayer};
    use crate::task::engine::FrameReport;
    use crate::task::level::LevelOfDetail;
    use crate::volume::{Lattice, Places, ScalarVolume, VectorField};

    fn picture(
        size: [u32; 2],
        requested_size: [u32; 2],
        pixel: impl Fn(u32, u32) -> u8,
    ) -> Picture {
        let rgba = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
            .flat_map(|(x, y)| [pixel(x, y), pixel(x, y), pixel(x, y), 255])
            .collect();
        let report = FrameReport::last(LevelOfDetail::FULL, 1, crate::scene::Backend::Raster, 1.0);
        Picture { size, requested_size, rgba, report }
    }

    fn plan(classify: Classify) -> Plan {
        Plan::of(&scene(classify), [32, 24])
    }

    fn scene(classify: Classify) -> Scene {
        use crate::volume::{Lattice, Samples};
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let mut scene = crate::scene::opening(Default::default(), Arc::new(volume), None);
        scene.splat.classify = classify;
        scene
    }

    const REDUCED: Coarseness = Coarseness::Reduced {
        sampling_rmse: 0.05,
        field: SlabField::Own,
        field_rmse: 0.0,
        cut_rmse: None,
    };

    #[test]
    fn detail_is_what_two_thirds_of_the_pixels_add() {
        let detail = |picture: Picture| detail_rmse(picture.size, &picture.rgba, 3);
        let grey = |of: fn(u32, u32) -> u8| detail(picture([32, 23], [64, 46], of));
        assert_eq!(grey(|_, _| 90), 0.0);
        assert_eq!(detail(picture([3, 20], [6, 40], |x, _| (x * 50) as u8)), 0.0, "too few");
        // Bytes along a ramp are met by interpolation, in both directions.
        assert_eq!(grey(|x, y| (3 * x + 2 * y) as u8), 0.0);
        // A line of light beside the pixels that are kept is lost: one of 28 columns.
        let line = grey(|x, _| if x == 12 { 255 } else { 0 });
        assert!((line - (1.0_f64 / 28.0).sqrt()).abs() < 1e-9, "{line}");
        let row = grey(|_, y| if y == 12 { 255 } else { 0 });
        assert!((row - (1.0_f64 / 19.0).sqrt()).abs() < 1e-9, "{row}");
    }

    /// Every fourth pixel of a picture, and what that has lost.
    #[test]
    fn what_is_lost_is_told_from_a_small_picture_alone() {
        fn estimated_and_true(of: fn(u32, u32) -> u8) -> [f64; 2] {
            let fine = picture([320, 240], [320, 240], of);
            let middles = |x: u32, y: u32| of(4 * x + 2, 4 * y + 2);
            let every_fourth = (0..60_u32)
                .flat_map(|y| (0..80).map(move |x| (x, y)))
                .flat_map(|(x, y)| [middles(x, y), middles(x, y), middles(x, y), 255])
                .collect::<Vec<u8>>();
            [sampling_rmse([80, 60], &every_fourth), detail_rmse(fine.size, &fine.rgba, 4)]
        }
        let [smooth, lost] = estimated_and_true(|x, y| {
            let wave = (f64::from(x) / 13.0).sin() * (f64::from(y) / 17.0).cos();
            (128.0 + 100.0 * wave) as u8
        });
        // Measured: 0.82.
        assert!((smooth / lost - 1.0).abs() < 0.25, "{smooth} {lost}");
        let [noise, lost] = estimated_and_true(|x, y| {
            let hash = x.wrapping_mul(374_761_393).wrapping_add(y.wrapping_mul(668_265_263));
            ((hash ^ hash >> 13).wrapping_mul(1_274_126_177) >> 24) as u8
        });
        // Measured: 0.77.
        assert!((noise / lost - 1.0).abs() < 0.25, "{noise} {lost}");
    }

    #[test]
    fn equal_pictures_differ_by_nothing_and_others_by_their_light() {
        let grey = picture([40, 30], [40, 30], |_, _| 128);
        assert_eq!(shown_rmse(&grey, &grey), Ok(0.0));
        let black = picture([40, 30], [40, 30], |_, _| 0);
        let expected = linear_from_srgb(128.0 / 255.0);
        assert!((shown_rmse(&grey, &black).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_small_picture_is_compared_as_it_is_enlarged() {
        let small = picture([5, 5], [40, 40], |_, _| 200);
        let large = picture([40, 40], [40, 40], |_, _| 200);
        assert_eq!(shown_rmse(&small, &large), Ok(0.0));
        let edge = picture([40, 40], [40, 40], |x, _| if x < 20 { 0 } else { 200 });
        let soft = picture([5, 5], [40, 40], |x, _| if x < 3 { 0 } else { 200 });
        let rmse = shown_rmse(&soft, &edge).unwrap();
        assert!((0.05..0.4).contains(&rmse), "{rmse}");
    }

    #[test]
    fn large_pictures_are_compared_at_whole_pixels_only() {
        // Lines one pixel wide would blur between pixels.
        let lines = picture([1000, 700], [1000, 700], |x, _| if x % 2 == 0 { 0 } else { 255 });
        assert_eq!(shown_rmse(&lines, &lines), Ok(0.0));
        let shifted = picture([1000, 700], [1000, 700], |x, _| if x % 2 == 1 { 0 } else { 255 });
        let rmse = shown_rmse(&lines, &shifted).unwrap();
        assert!((rmse - 1.0).abs() < 1e-12, "{rmse}");
    }

    #[test]
    fn pictures_that_are_none_are_refused() {
        let good = picture([4, 4], [4, 4], |_, _| 1);
        let mut bad = picture([4, 4], [4, 4], |_, _| 1);
        bad.rgba.pop();
        assert!(matches!(shown_rmse(&bad, &good), Err(CompareError::Size { .. })));
        let none = picture([0, 0], [4, 4], |_, _| 1);
        assert_eq!(shown_rmse(&none, &good), Err(CompareError::Empty));
    }

    const CUT: Coarseness = Coarseness::Octree { max_error: 0.01, missing_rmse: 0.0 };

    #[test]
    fn estimates_come_to_what_was_found_and_begin_anew_for_another_mode() {
        let (before, after) = (plan(Classify::Before), plan(Classify::PreIntegrated));
        let mut estimator = Estimator::default();
        let first = estimator.rmse(&before, CUT, 1.0);
        let reduced = estimator.rmse(&before, REDUCED, 4.0);
        for _ in 0..20 {
            let estimated_rmse = estimator.rmse(&before, CUT, 1.0);
            estimator.learn(&before, CUT, &Checked { estimated_rmse, measured_rmse: 0.03 });
        }
        let learnt = estimator.rmse(&before, CUT, 1.0);
        assert!((learnt / 0.03 - 1.0).abs() < 1e-3 && learnt != first, "{first} {learnt}");
        assert_eq!(estimator.rmse(&before, REDUCED, 4.0), reduced, "another kind");
        let fresh = Estimator::default().rmse(&after, CUT, 1.0);
        assert_eq!(estimator.rmse(&after, CUT, 1.0), fresh);
        assert!(fresh >= SHADE_FIRST_RMSE, "shade first costs something: {fresh}");
    }

    /// What tents cost is no matter of what the own field costs, and what one is found to cost
    /// teaches nothing about the other.
    #[test]
    fn tents_are_thought_to_be_worse_and_are_learnt_apart() {
        let scene = plan(Classify::PreIntegrated);
        let tents = Coarseness::Reduced {
            sampling_rmse: 0.05,
            field: SlabField::Preview,
            field_rmse: TENTS_RMSE,
            cut_rmse: None,
        };
        let mut estimator = Estimator::default();
        let of = |estimator: &Estimator| {
            [CUT, REDUCED, tents].map(|kind| estimator.rmse(&scene, kind, 2.0))
        };
        let first = of(&estimator);
        assert_eq!(first[1], 0.05);
        assert!((first[2] - 0.05_f64.hypot(0.004)).abs() < 1e-12, "and tents: {first:?}");
        for (kind, coarseness) in [CUT, REDUCED, tents].into_iter().enumerate() {
            let before = of(&estimator);
            let estimated_rmse = before[kind];
            let measured_rmse = 2.0 * estimated_rmse;
            estimator.learn(&scene, coarseness, &Checked { estimated_rmse, measured_rmse });
            for (other, (before, after)) in before.into_iter().zip(of(&estimator)).enumerate() {
                let times = if other == kind { 2.0 } else { 1.0 };
                assert!((after / before - times).abs() < 1e-9, "{kind} {other}: {after}");
            }
        }
        let own = first_of_whole(SlabField::Own);
        assert!(first_of_whole(SlabField::Preview) > 3.0 * own, "even whole, tents are off: {own}");
    }

    /// Nor does a field teach anything about the vectors in it. Means are off by a share of the light that
    /// they give, whatever lies behind it; vectors that are all there, by less, as their marks are blurred.
    #[test]
    fn means_of_vectors_are_thought_to_be_off_by_a_share_of_their_light() {
        let (grey, lit) = (Srgb8([40; 3]), linear_from_srgb(200.0 / 255.0));
        let behind = linear_from_srgb(40.0 / 255.0);
        let picture = picture([40, 30], [80, 60], |x, _| if x < 10 { 200 } else { 40 });
        let rms = light_rms(Background::Colour(grey), &picture.rgba);
        assert!((rms - (lit - behind) / 2.0).abs() < 1e-9, "{rms}");
        // Each colour counts; of large pictures some pixels are looked at, and behind transparent ones is nothing.
        let large: Vec<u8> = [[40, 40, 40, 255], [200, 40, 120, 255]].repeat(90_000).concat();
        let of_three = light_rms(Background::Colour(grey), &large[..4 * 60_000]);
        let middle = linear_from_srgb(120.0 / 255.0) - behind;
        let expected = ((lit - behind).powi(2) + middle.powi(2)) / 6.0;
        assert!((of_three - expected.sqrt()).abs() < 1e-9, "{of_three}");
        let white = vec![200; 4 * 300_000];
        assert!((light_rms(Background::Transparent, &white) - lit).abs() < 1e-9);
        let mut scene = scene(Classify::PreIntegrated);
        scene.background = Background::Colour(grey);
        let field = Plan::of(&scene, [32, 24]);
        let mut scene = scene.with(vectors());
        scene.show_field(false);
        let scene = Plan::of(&scene, [32, 24]);
        let of = |averaged: usize, scene: &Plan| {
            let drawn = Drawn {
                size: picture.size,
                is_reduced: true,
                vectors_averaged: averaged,
                ..Drawn::default()
            };
            let rung = Rung::Reduced { field: SlabField::Own, shrink: 2.0 };
            Coarseness::of(scene, rung, &drawn, 2.0, &picture.rgba).unwrap()
        };
        let mut estimator = Estimator::default();
        let [all, means] = [0, 2].map(|n| estimator.rmse(&scene, of(n, &scene), 2.0));
        let plain = field;
        let field = estimator.rmse(&plain, of(0, &plain), 2.0);
        // Halved once.
        assert!((all - field.hypot(BLUR_SHARE * rms)).abs() < 1e-12, "{all} {field}");
        assert!((means - field.hypot(MEANS_SHARE * rms)).abs() < 1e-12, "{means} {field}");
        let checked = Checked { estimated_rmse: means, measured_rmse: means / 3.0 };
        estimator.learn(&scene, of(2, &scene), &checked);
        assert!((estimator.rmse(&scene, of(2, &scene), 2.0) * 3.0 / means - 1.0).abs() < 1e-9);
        assert_eq!(estimator.rmse(&plain, of(0, &plain), 2.0), field);
        assert_eq!(
            estimator.rmse(&scene, of(0, &scene), 2.0),
            all,
            "what means cost is no pixels' matter"
        );
        // Of every pixel, it is the finished picture, unless means stand for some of its vectors.
        let whole = |vectors_averaged| {
            let drawn = Drawn {
                size: picture.size,
                is_reduced: true,
                vectors_averaged,
                ..Drawn::default()
            };
            let rung = Rung::Reduced { field: SlabField::Own, shrink: 1.0 };
            Coarseness::of(&scene, rung, &drawn, 1.0, &picture.rgba)
        };
        assert_eq!(whole(0), None);
        assert!(matches!(
            whole(1),
            Some(Coarseness::Vectors { sampling_rmse: 0.0, are_means: true, .. })
        ));
    }

    fn vectors() -> VectorLayer {
        let places = Places::Lattice(Lattice::unit([2, 1, 1]));
        let vectors = vec![glam::Vec3::X; 2].into();
        let field = VectorField::new("v", places, vectors, &Ticket::new()).unwrap();
        VectorLayer::new(Arc::new(field))
    }

    /// Of a picture without detail.
    fn first_of_whole(field: SlabField) -> f64 {
        let field_rmse = field_rmse(&plan(Classify::PreIntegrated), field);
        let whole = Coarseness::Reduced { sampling_rmse: 0.0, field, field_rmse, cut_rmse: None };
        Estimator::default().rmse(&plan(Classify::PreIntegrated), whole, 1.0)
    }

    #[test]
    fn a_coarser_cut_and_a_smaller_picture_are_thought_to_be_worse() {
        let (scene, estimator) = (plan(Classify::Before), Estimator::default());
        let worse = Coarseness::Octree { max_error: 0.1, missing_rmse: 0.0 };
        assert!(estimator.rmse(&scene, worse, 1.0) > estimator.rmse(&scene, CUT, 1.0));
        let holes = Coarseness::Octree { max_error: 0.01, missing_rmse: 0.2 };
        let rmse = estimator.rmse(&scene, holes, 1.0);
        assert!((0.2..0.21).contains(&rmse), "dark pixels add to the rest: {rmse}");
        assert!(estimator.rmse(&scene, CUT, 3.0) > estimator.rmse(&scene, CUT, 1.5));
        let richer = Coarseness::Reduced {
            sampling_rmse: 0.1,
            field: SlabField::Own,
            field_rmse: 0.0,
            cut_rmse: None,
        };
        assert!(estimator.rmse(&scene, richer, 2.0) > estimator.rmse(&scene, REDUCED, 2.0));
    }

    /// What a cut of the field costs adds to the rest, and what is learnt of cuts says nothing of the whole field.
    #[test]
    fn cuts_of_the_field_are_thought_of_and_learnt_apart() {
        let (plan, mut estimator) = (plan(Classify::PreIntegrated), Estimator::default());
        let own = SlabField::Own;
        let cut = |cut_rmse| Coarseness::Reduced {
            sampling_rmse: 0.03,
            field: own,
            field_rmse: 0.0,
            cut_rmse,
        };
        let rmse = |estimator: &Estimator, cut_rmse| estimator.rmse(&plan, cut(cut_rmse), 2.0);
        assert!((rmse(&estimator, Some(0.04)) - 0.05).abs() < 1e-12);
        let checked = Checked { estimated_rmse: 0.05, measured_rmse: 0.1 };
        estimator.learn(&plan, cut(Some(0.04)), &checked);
        assert!((rmse(&estimator, Some(0.04)) - 0.1).abs() < 1e-12);
        assert!((rmse(&estimator, None) - 0.03).abs() < 1e-12);
    }

    #[test]
    fn what_is_lit_is_further_off_in_another_field() {
        let mut lit = plan(Classify::PreIntegrated);
        assert_eq!(field_rmse(&lit, SlabField::Preview), TENTS_RMSE);
        lit.shading.lighting = Some(crate::scene::Lighting::default());
        assert_eq!(field_rmse(&lit, SlabField::Preview), LIT_TENTS_RMSE);
        lit.mode.kernel = Kernel::Cells;
        assert_eq!(field_rmse(&lit, SlabField::Preview), LIT_TENTS_OF_CELLS_RMSE);
        assert_eq!(field_rmse(&lit, SlabField::Own), 0.0);
    }

    /// A part is held to what was shown before it.
    #[test]
    fn a_picture_in_part_is_off_by_what_it_lacks() {
        let fine = |x: u32, y: u32| (40 + 3 * x + (y % 7) * 8) as u8;
        let full = picture([64, 48], [64, 48], fine);
        let mut coarse = picture([64, 48], [64, 48], |x, y| fine(x, y).saturating_add(6));
        coarse.report.estimated_rmse = Some(shown_rmse(&coarse, &full).unwrap());
        for rows in [6, 24, 45] {
            let done = f64::from(rows) / 48.0;
            let part = picture([64, 48], [64, 48], |x, y| if y < rows { fine(x, y) } else { 0 });
            let is = shown_rmse(&part, &full).unwrap();
            let told = part_rmse(&part, done, Some(&coarse));
            // Measured: 0.92 to 1.1.
            assert!((told / is - 1.0).abs() < 0.2, "{rows}: {told} {is}");
            // Nothing was shown: as bright as what is there. Measured: 0.98 to 1.02.
            let alone = part_rmse(&part, done, None);
            assert!((alone / is - 1.0).abs() < 0.2, "{rows}: {alone} {is}");
        }
        assert_eq!(part_rmse(&full, 1.0, None), 0.0);
    }

    /// Rungs of other ladders are learnt like any other coarse picture.
    #[test]
    fn subsampled_pictures_and_cheaper_kernels_have_estimates_of_their_own() {
        let scene = plan(Classify::Before);
        let kinds = [
            Coarseness::Subsampled { max_error: 1.0 },
            Coarseness::Cheaper(Kernel::Point),
            Coarseness::Cheaper(Kernel::Nearest),
        ];
        let mut estimator = Estimator::default();
        let of = |estimator: &Estimator| kinds.map(|kind| estimator.rmse(&scene, kind, 1.0));
        assert_eq!(of(&estimator), [PER_ERROR * 1.5, POINTS_RMSE, NEAREST_RMSE]);
        for (kind, coarseness) in kinds.into_iter().enumerate() {
            let before = of(&estimator);
            let estimated_rmse = before[kind];
            let checked = Checked { estimated_rmse, measured_rmse: 0.5 * estimated_rmse };
            estimator.learn(&scene, coarseness, &checked);
            for (other, (before, after)) in before.into_iter().zip(of(&estimator)).enumerate() {
                let times = if other == kind { 0.5 } else { 1.0 };
                assert!((after / before - times).abs() < 1e-9, "{kind} {other}: {after}");
            }
        }
    }

    #[test]
    fn a_perfect_or_broken_check_teaches_nothing_wild() {
        let scene = plan(Classify::Before);
        for measured_rmse in [0.0, f64::NAN, f64::INFINITY, 1e300] {
            let mut estimator = Estimator::default();
            estimator.learn(&scene, CUT, &Checked { estimated_rmse: 0.01, measured_rmse });
            let estimate = estimator.rmse(&scene, CUT, 1.0);
            assert!(estimate > 0.0 && estimate < 10.0, "{measured_rmse}: {estimate}");
        }
        let perfect = Checked { estimated_rmse: 0.01, measured_rmse: 0.0 };
        assert_eq!(perfect.off_db(), None);
        let worse = Checked { estimated_rmse: 0.01, measured_rmse: 0.1 };
        assert!((worse.off_db().unwrap() - 20.0).abs() < 1e-9);
    }
}
