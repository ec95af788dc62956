//! One still picture at any size, for files and scripts, and what it cost.

use std::time::Instant;

use serde::Serialize;

use super::draw::{DrawError, Drawer, Drawn, Observer, Rung, lists_cut, previews_by_lists};
use super::effect_costs::{LeftOut, left_out};
use super::engine::HeldBytes;
use super::engines::{Canvas, EngineKind};
use super::estimate::{Coarseness, Estimator};
use super::previews::is_plain;
use super::remaining::{self, Told, WITHIN_DB};
use super::smooth;
use crate::accuracy::sweep::Detail;
use crate::accuracy::{self, Difference};
use crate::core::colour::srgb_bytes;
use crate::core::enlarge::enlarged;
use crate::core::memory::TooLarge;
use crate::core::{Camera, Cancelled, Ticket};
use crate::gpu::{GpuError, OctreeBuilder};
pub use crate::gpu::{PassTime, timing::Timer};
use crate::kernel::Kernel;
use crate::plan::{Outline, Plan, SlabField};
use crate::scene::{Backend, Cells, Scene, SplatSettings, Visibility};

/// How far a still picture is to be refined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refine {
    /// Every voxel's full kernel.
    Full,
    /// The best coarse picture within a time.
    Budget {
        /// Milliseconds.
        budget_ms: f64,
    },
    /// The coarsest octree cut whose picture is within an error of `full`: of the field where it has cuts, else of
    /// classified voxels.
    Error {
        /// Root mean square over pixels and RGB, linear light, black behind.
        max_error: f64,
        /// Of classified voxels in any case.
        of_voxels: bool,
    },
    /// Full, with slabs doubled until two pictures differ by less than [`CONVERGED`] in every
    /// channel of every pixel, alpha included. Modes without slabs have nothing to double: `full`.
    Converged {
        /// Slabs per voxel that are not gone beyond.
        most_slabs: f64,
    },
    /// An octree cut, or a smaller picture, or both: a setting of the price list.
    Reduced {
        /// Full, or the cut of an error.
        detail: Detail,
        /// Share of the width and height that is drawn, in 0..=1, and enlarged.
        scale: f64,
    },
}

/// Two pictures that differ by less than this in every channel are the same one: half a step of an
/// 8-bit channel.
pub const CONVERGED: f64 = 1.0 / 512.0;

/// Limits on the errors of bricks that are tried, to a doubling.
const LIMITS_A_DOUBLING: f64 = 4.0;

/// How `converged` ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Convergence {
    /// Slabs per voxel of the picture.
    pub slabs_per_voxel: f64,
    /// Greatest difference of a channel from the picture with half as many; `None` where the first
    /// picture already had the most slabs.
    pub last_difference: Option<f64>,
}

impl Convergence {
    /// Whether the last difference is below [`CONVERGED`].
    pub fn is_reached(&self) -> bool {
        self.last_difference.is_some_and(|difference| difference < CONVERGED)
    }
}

/// The reconstructed field that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShownField {
    /// The one that `full` is drawn from, or a quicker one that stands in for it.
    pub which: SlabField,
    /// What reconstructs it.
    pub kernel: Kernel,
    /// Its samples along each axis: the volume's, or fewer where previews are drawn from means.
    pub dims: [usize; 3],
}

/// A still picture to be drawn.
#[derive(Debug, Clone)]
pub struct StillRequest {
    /// What is to be seen.
    pub scene: Scene,
    /// Size in pixels.
    pub size: [u32; 2],
    /// How far to go.
    pub refine: Refine,
    /// More frames after the picture, each with the camera turned by one degree, for timing.
    pub repeat: u32,
    /// Whether to time each pass, in one more frame, and to find what each effect of a full picture costs
    /// and changes, in a few more, and what the picture is off by.
    pub time_passes: bool,
    /// Whether to smooth what ends within a pixel, where it is drawn in full (see [`super::smooth`]).
    pub smooth_edges: bool,
}

/// A still picture and what it cost.
#[derive(Debug, Clone)]
pub struct Still {
    /// Its size in pixels.
    pub size: [u32; 2],
    /// What it is made of.
    pub outline: Outline,
    /// Premultiplied linear RGBA, rows from the top, no background.
    pub light: Vec<[f32; 4]>,
    /// sRGB bytes with straight alpha, background composited.
    pub rgba: Vec<u8>,
    /// What was drawn.
    pub drawn: Drawn,
    /// Whether it is `full`, down to the pixel where kernels are smaller than one.
    pub is_full: bool,
    /// Why it is of no octree cut within a time, where these were asked for; in words that follow "there is no cut: ".
    pub why_not_octree: Option<&'static str>,
    /// Voxels with opacity.
    pub kernels_active: u64,
    /// Who built the octree; `None` where there is none.
    pub octree: Option<OctreeBuilder>,
    /// Which engine drew it.
    pub engine: EngineKind,
    /// What the native engine does not draw of it, where that was to draw.
    pub not_native: Option<String>,
    /// The native engine's compiled loop that drew it; `None` where the other engine did, or nothing was to be drawn.
    pub native_loop: Option<&'static str>,
    /// What the native engine's stages of the picture itself took: it always times them. Empty by the other engine.
    pub native_stages: Vec<PassTime>,
    /// The adapter, or the processor's instructions.
    pub adapter: String,
    /// Wall milliseconds from camera set until the pixels are in memory, as light; the picture's first.
    pub frame_ms: Vec<f64>,
    /// The reconstructed field that it shows; `None` where kernels are shaded first, and of cuts.
    pub field: Option<ShownField>,
    /// What it is thought to be off by, RMSE in linear light over black. Where passes were timed, against the converged
    /// picture, measured at some of its pixels ([`super::remaining`]). Else of a picture within a budget to `full`, by a
    /// model that has seen no picture of this volume yet; `None` of others.
    pub estimated_rmse: Option<f64>,
    /// What that may be off by, dB, mostly.
    pub estimated_within_db: f64,
    /// What smoothing its edges took beyond [`Still::own_ms`], milliseconds; `None` where they are as they were drawn.
    pub smoothed_ms: Option<f64>,
    /// Pass times, where asked for, of one more frame in which each pass is submitted and waited for
    /// by itself: disjoint spans of [`Still::timed_frame_ms`], not of `frame_ms`.
    pub passes: Vec<PassTime>,
    /// Wall milliseconds of that frame: from camera set to queue finished, and `present`.
    pub timed_frame_ms: Option<f64>,
    /// Whose clock the passes were timed by.
    pub timer: Option<Timer>,
    /// What each effect of a full picture costs, where passes were timed.
    pub effects: Vec<LeftOut>,
    /// Bytes held on the device when it was drawn, of parts that not every scene has.
    pub held: HeldBytes,
    /// Most bytes held on the device.
    pub peak_gpu_bytes: u64,
    /// Opacities and sums of them that were over 1 and lowered to it, with published opacity.
    pub capped_sums: u64,
    /// What drew it, never [`Backend::Auto`].
    pub backend: Backend,
    /// Pipelines compiled.
    pub pipelines: usize,
    /// Volumes and fields brought to the device since there is one.
    pub uploads: u64,
    /// Measured error against `full`, where it was asked for.
    pub measured_rmse: Option<f64>,
    /// Where slabs were doubled, how that ended.
    pub convergence: Option<Convergence>,
    /// Every cell of the cut on the picture, where they were asked for and it is one.
    pub cells: Option<Cells>,
    /// Entries of the transfer table whose opacity was lowered to the transmittance floor.
    pub capped_opacities: usize,
}

impl Still {
    /// Wall milliseconds of the picture itself, from camera set until its pixels are in memory.
    pub fn own_ms(&self) -> f64 {
        self.frame_ms.first().copied().unwrap_or(self.drawn.wall_ms)
    }
}

/// Why there is no still picture.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StillError {
    /// The ticket.
    #[error("cancelled")]
    Cancelled,
    /// The host's memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl From<Cancelled> for StillError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

impl From<DrawError> for StillError {
    fn from(error: DrawError) -> Self {
        match error {
            DrawError::Interrupted => Self::Cancelled,
            DrawError::TooLarge(error) => Self::TooLarge(error),
            DrawError::Gpu(error) => Self::Gpu(error),
        }
    }
}

/// Stops at a cancelled ticket, and tells it how far the picture is.
struct Watch<'a>(&'a Ticket);

/// A piece of a still picture, which no hand waits for, milliseconds: each costs a wait of its own.
const STILL_PIECE_MS: f64 = 60.0;

impl Observer for Watch<'_> {
    fn piece_ms(&self) -> f64 {
        STILL_PIECE_MS
    }

    fn is_overtaken(&mut self) -> bool {
        self.0.is_cancelled()
    }

    fn piece_done(&mut self, _: &mut dyn Canvas, done: f64) -> bool {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=1000")]
        self.0.checkpoint((done * 1000.0) as u64, 1000).is_err()
    }
}

/// Draws a still picture.
pub(super) fn draw(
    drawer: &mut Drawer,
    request: &StillRequest,
    keeps_cells: bool,
    ticket: &Ticket,
) -> Result<Still, StillError> {
    let StillRequest { scene, size, .. } = request;
    drawer.keeps_cut = keeps_cells;
    let mut plan = Plan::of(scene, *size);
    let mut watch = Watch(ticket);
    drawer.prepare(&plan, ticket)?;
    let (mut measured_rmse, mut convergence, mut drawn) = (None, None, None);
    let rung = match request.refine {
        Refine::Full => Rung::Full,
        Refine::Budget { budget_ms } => Rung::Coarse { budget_ms },
        Refine::Error { max_error, of_voxels } => {
            let (rung, rmse) = within_error(drawer, &plan, (max_error, of_voxels), &mut watch)?;
            measured_rmse = Some(rmse);
            rung
        }
        Refine::Converged { most_slabs } => {
            if plan.mode.visibility == Visibility::Slabs {
                let (reached, last) = converge(drawer, &plan, most_slabs, &mut watch)?;
                (convergence, drawn) = (Some(reached), Some(last));
                plan = with_slabs(&plan, reached.slabs_per_voxel);
            }
            Rung::Full
        }
        Refine::Reduced { detail, scale } => match detail {
            Detail::Full if scale == 1.0 => Rung::Full,
            Detail::Full => Rung::Reduced { field: SlabField::Own, shrink: 1.0 / scale },
            Detail::Octree { max_error } => {
                plan = plan.at_size(scaled(*size, scale), 1.0);
                Rung::Octree { max_error }
            }
        },
    };
    if let Rung::Coarse { .. } = rung {
        drawer.prepare_field(&plan, SlabField::Own, &mut watch)?;
        drawer.prepare_preview_field(&plan, &mut watch)?;
        drawer.prepare_cuts(&plan, &mut watch)?;
        drawer.measure_stand_ins(&plan, &mut watch)?;
        // Costs are learnt first; the picture then fits its budget.
        for _ in 0..4 {
            let drawn = drawer.draw(&plan, rung, &mut watch)?;
            let shrink = f64::from(size[1]) / f64::from(drawn.size[1]);
            let shown = drawer.engines.present(plan.background.light())?;
            let coarseness = Coarseness::of(&plan, rung, &drawn, shrink, &shown);
            if let Some(Coarseness::Reduced { sampling_rmse, .. }) = coarseness {
                let known = drawer.known_rmse(&plan, &drawn)?;
                drawer.note_sampling(shrink, &drawn, (known, sampling_rmse));
            }
        }
    }
    let prices = drawer.costs;
    let mut drawn = match drawn {
        Some(drawn) => drawn,
        None => drawer.draw(&plan, rung, &mut watch)?,
    };
    if matches!(rung, Rung::Coarse { .. }) && drawn.made_pipelines {
        // By the other field, which had not been drawn yet: a compiler's time is none of a picture's.
        drawn = drawer.draw(&plan, rung, &mut watch)?;
    }
    let cells = drawer.take_cells(usize::MAX);
    drawer.keeps_cut = false;
    let capped_sums = drawer.capped_sums()?;
    let (drew, native_loop) = (drawer.engines.drew(), drawer.engines.native_loop());
    let native_stages = match drew {
        EngineKind::Native => drawer.times(),
        EngineKind::Gpu => Vec::new(),
    };
    let (light, reading_ms) = in_memory(drawer)?;
    let mut frame_ms = vec![drawn.wall_ms + reading_ms];
    let smooths = request.smooth_edges && rung == Rung::Full && smooth::has_edges(&plan);
    let light = enlarged(light, drawn.size, *size);
    let background = plan.background.light();
    let shown = drawer.engines.present(background)?;
    let shrink = f64::from(size[1]) / f64::from(drawn.size[1]);
    let known = drawer.known_rmse(&plan, &drawn)?;
    let estimated_rmse = Coarseness::of(&plan, rung, &drawn, shrink, &shown).map(|coarseness| {
        known.unwrap_or_else(|| Estimator::default().rmse(&plan, coarseness, shrink))
    });
    let rgba = if drawn.size == *size { shown } else { srgb_bytes(&light, background) };
    let field = shown_field(drawer, rung, &drawn, &plan);
    let (mut smooth_light, mut smoothed_ms) = (None, None);
    if smooths {
        let start = Instant::now();
        smooth_light = Some(drawer.smoothed(&plan, light.clone(), &mut watch)?);
        smoothed_ms = Some(start.elapsed().as_secs_f64() * 1e3);
    }
    for turn in 1..=request.repeat {
        ticket.checkpoint(u64::from(turn), u64::from(request.repeat))?;
        let camera = turned(&plan.camera, turn);
        let turned = Plan { camera, ..plan.clone() }.at_size(plan.size, plan.enlarged);
        let drawing_ms = drawer.draw(&turned, rung, &mut watch)?.wall_ms;
        frame_ms.push(drawing_ms + in_memory(drawer)?.1);
    }
    let (mut timer, mut timed_frame_ms) = (None, None);
    let mut passes = Vec::new();
    if request.time_passes {
        timer = Some(drawer.time_passes()?);
        // What fitted a budget then fits it now: the same picture is timed.
        drawer.costs = prices;
        let timed_ms = drawer.draw(&plan, rung, &mut watch)?.wall_ms;
        let drawing = drawer.times().len();
        drawer.engines.present(background)?;
        passes = drawer.times();
        let presenting = passes[drawing..].iter().map(|pass| pass.gpu_ms).sum::<f64>();
        timed_frame_ms = Some(timed_ms + presenting);
        drawer.stop_timing();
    }
    let backend = match drew {
        // Lists and rays by tiles, whatever is drawn.
        EngineKind::Native => Backend::Tiles,
        EngineKind::Gpu => backend_of(rung, &drawn, &plan),
    };
    let kernels_active = drawer.count_active(&plan, ticket)?;
    if let Some((_, count)) = scene.own_kernels().filter(|_| rung == Rung::Full) {
        drawn.kernels = count - scene.left_out_functions().map_or(0, |(count, _)| count);
    } else if drew == EngineKind::Native && drawn.nodes == 0 {
        drawn.kernels = kernels_active;
    }
    let is_full = rung == Rung::Full;
    let held = drawer.engines.held();
    let peak_gpu_bytes = drawer.engines.peak_bytes();
    let of_gpu = drawer.engines.made_gpu();
    let (pipelines, uploads) = of_gpu.map_or((0, 0), |r| (r.pipeline_count(), r.upload_count()));
    let adapter = drawer.engines.name();
    let effects = match request.time_passes && is_full {
        true => {
            let scene = Scene { splat: plan.mode, ..scene.clone() };
            left_out(drawer, &scene, (*size, &light), &mut watch, ticket)?
        }
        false => Vec::new(),
    };
    let mut still = Still {
        size: *size,
        outline: plan.outline(),
        effects,
        held,
        light,
        rgba,
        smoothed_ms,
        drawn,
        is_full,
        why_not_octree: matches!(rung, Rung::Coarse { .. })
            .then(|| drawer.why_not_octree(&plan))
            .flatten(),
        kernels_active,
        octree: drawer.octree_builder(),
        engine: drew,
        not_native: drawer.engines.why_not_native(&plan),
        native_loop,
        native_stages,
        adapter,
        frame_ms,
        field,
        estimated_rmse,
        estimated_within_db: WITHIN_DB,
        passes,
        timed_frame_ms,
        timer,
        peak_gpu_bytes,
        capped_sums,
        backend,
        pipelines,
        uploads,
        measured_rmse,
        convergence,
        cells,
        capped_opacities: drawer.capped_count(&plan),
    };
    if request.time_passes {
        // At the size that was asked for, with the slabs that it came to.
        let plan = Plan::of(scene, *size).in_mode(plan.mode);
        if let Some(Told { rmse, within_db }) = measured_error(drawer, &plan, &still, &mut watch)? {
            (still.estimated_rmse, still.estimated_within_db) = (Some(rmse), within_db);
        }
    }
    // What effects change and what it is off by was found of the picture as it was drawn.
    if let Some(light) = smooth_light {
        (still.rgba, still.light) = (srgb_bytes(&light, background), light);
    }
    Ok(still)
}

/// What a still is found to be off by, against the converged picture; `None` where some of its pixels do not tell: quick
/// pictures with marks or triangles on them, whose pixels are means.
fn measured_error(
    drawer: &mut Drawer,
    plan: &Plan,
    still: &Still,
    watch: &mut Watch<'_>,
) -> Result<Option<Told>, StillError> {
    let is_finished = still.is_full || still.drawn.is_whole(still.size);
    let measured = match is_finished {
        true => remaining::of_finished(drawer, plan, &still.light, watch),
        false if plan.kernels.is_empty() && plan.surfaces.is_empty() => {
            remaining::of_shown(drawer, plan, &still.light, watch)
        }
        false => return Ok(None),
    };
    match measured {
        // It was estimated.
        Err(error) if still.estimated_rmse.is_some() && is_no_more_than_refused(&error) => Ok(None),
        measured => Ok(Some(Told::of(plan, measured)?)),
    }
}

fn is_no_more_than_refused(error: &DrawError) -> bool {
    error.is_refusal() && *error != DrawError::Interrupted
}

/// The light of the picture that was drawn last, and what it took to have it in memory, milliseconds: nothing where the
/// processor drew it there.
fn in_memory(drawer: &mut Drawer) -> Result<(Vec<[f32; 4]>, f64), GpuError> {
    let start = Instant::now();
    let light = drawer.engines.read_light()?;
    let ms = match drawer.engines.drew() {
        EngineKind::Native => 0.0,
        EngineKind::Gpu => start.elapsed().as_secs_f64() * 1e3,
    };
    Ok((light, ms))
}

/// The reconstructed field on the picture of a rung, if that is of one.
fn shown_field(drawer: &Drawer, rung: Rung, drawn: &Drawn, plan: &Plan) -> Option<ShownField> {
    let is_preview = drawn.is_reduced && drawn.field == SlabField::Preview;
    let is_own = plan.reconstructs() && (rung == Rung::Full || drawn.is_reduced);
    let is_of_field = is_preview || is_own;
    let (kernel, dims) = drawer.field_shape(drawn.field).filter(|_| is_of_field)?;
    Some(ShownField { which: drawn.field, kernel, dims })
}

/// What a rung of a still picture is drawn with.
fn backend_of(rung: Rung, drawn: &Drawn, plan: &Plan) -> Backend {
    let splat = &plan.mode;
    let lists = match rung {
        Rung::Full => return plan.at_size(drawn.size, 1.0).backend(),
        Rung::Reduced { .. } | Rung::Bricks { .. } => return splat.fixed_backend(),
        Rung::Coarse { .. } if drawn.is_reduced => return splat.fixed_backend(),
        Rung::Octree { .. } | Rung::Subsampled { .. } => lists_cut(splat),
        Rung::Coarse { .. } => previews_by_lists(splat),
        Rung::Cheaper(_) => false,
    };
    if lists { Backend::Tiles } else { Backend::Raster }
}

/// The camera turned about its up vector by whole degrees.
fn turned(camera: &Camera, degrees: u32) -> Camera {
    let angle = f64::from(degrees).to_radians();
    camera.rotated(glam::DQuat::from_axis_angle(camera.up, angle))
}

/// The rung of the coarsest cut whose picture is near enough to `full`, and how near it is.
fn within_error(
    drawer: &mut Drawer,
    plan: &Plan,
    (max_error, of_voxels): (f64, bool),
    watch: &mut Watch<'_>,
) -> Result<(Rung, f64), StillError> {
    if !of_voxels {
        drawer.prepare_field(plan, SlabField::Own, watch)?;
        drawer.prepare_cuts(plan, watch)?;
        if let Some(limits) = drawer.cut_limits_of(plan) {
            return coarsest_cut_within(drawer, plan, (max_error, limits), watch);
        }
        if !is_plain(plan) {
            // Cuts of classified voxels show nothing of what stands beside these.
            return Ok((Rung::Full, 0.0));
        }
    }
    coarsest_within(drawer, plan, max_error, watch)
}

/// Halves the range of limits on the errors of bricks until the greatest is found whose picture is near enough to `full`:
/// the higher the limit, the further off.
fn coarsest_cut_within(
    drawer: &mut Drawer,
    plan: &Plan,
    (max_error, limits): (f64, [f32; 2]),
    watch: &mut Watch<'_>,
) -> Result<(Rung, f64), StillError> {
    let full = light_of(drawer, plan, Rung::Full, watch)?;
    let [least, most] = limits.map(|limit| f64::from(limit).log2());
    #[expect(clippy::cast_possible_truncation, reason = "of 32 bits")]
    let limit = |step: u32| (least + f64::from(step) / LIMITS_A_DOUBLING).exp2() as f32 * 1.0001;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few dozen")]
    let mut beyond = ((most - least) * LIMITS_A_DOUBLING).ceil() as u32 + 1;
    let (mut first, mut found) = (0, (Rung::Full, 0.0));
    while first < beyond {
        let step = first + (beyond - first) / 2;
        let rung = Rung::Bricks { max_error: limit(step) };
        let rmse = rmse_between(&light_of(drawer, plan, rung, watch)?, &full)?;
        if rmse <= max_error {
            (first, found) = (step + 1, (rung, rmse));
        } else {
            beyond = step;
        }
    }
    Ok(found)
}

fn light_of(
    drawer: &mut Drawer,
    plan: &Plan,
    rung: Rung,
    watch: &mut Watch<'_>,
) -> Result<Vec<[f64; 4]>, StillError> {
    drawer.draw(plan, rung, watch)?;
    Ok(widened(&drawer.engines.read_light()?))
}

fn rmse_between(picture: &[[f64; 4]], full: &[[f64; 4]]) -> Result<f64, StillError> {
    let rmse = accuracy::rmse(picture, full);
    Ok(rmse.map_err(|error| GpuError::Device(format!("two pictures of one size: {error}")))?)
}

/// Doubles the nodes of a cut of classified voxels until its picture is near enough to `full`.
fn coarsest_within(
    drawer: &mut Drawer,
    plan: &Plan,
    max_error: f64,
    watch: &mut Watch<'_>,
) -> Result<(Rung, f64), StillError> {
    // What a plan's own engine does not need: the cuts are found in it.
    let engine = drawer.engine_of(plan, Rung::Octree { max_error: 0.0 });
    drawer.prepare_octree(plan, engine == EngineKind::Gpu, watch)?;
    let full = light_of(drawer, plan, Rung::Full, watch)?;
    let mut count = 64;
    while count < drawer.active_count().unwrap_or(0) {
        let rung = Rung::Octree { max_error: drawer.error_for_count(count) };
        let rmse = rmse_between(&light_of(drawer, plan, rung, watch)?, &full)?;
        if rmse <= max_error {
            return Ok((rung, rmse));
        }
        count *= 2;
    }
    Ok((Rung::Full, 0.0))
}

fn with_slabs(plan: &Plan, slabs_per_voxel: f64) -> Plan {
    plan.in_mode(SplatSettings { slabs_per_voxel, ..plan.mode })
}

/// Doubles the slabs until two pictures are the same, or there are the most. The last is the
/// renderer's.
fn converge(
    drawer: &mut Drawer,
    plan: &Plan,
    most_slabs: f64,
    watch: &mut Watch<'_>,
) -> Result<(Convergence, Drawn), StillError> {
    let mut slabs_per_voxel = plan.mode.slabs_per_voxel;
    let mut picture = |slabs: f64| -> Result<_, StillError> {
        let drawn = drawer.draw(&with_slabs(plan, slabs), Rung::Full, watch)?;
        Ok((drawn, widened(&drawer.engines.read_light()?)))
    };
    let (mut drawn, mut coarser) = picture(slabs_per_voxel)?;
    let mut last_difference = None;
    while 2.0 * slabs_per_voxel <= most_slabs {
        slabs_per_voxel *= 2.0;
        let (again, finer) = picture(slabs_per_voxel)?;
        let difference = Difference::between(&finer, &coarser)
            .map_err(|error| GpuError::Device(format!("two pictures of one size: {error}")))?;
        last_difference = Some(difference.max_abs);
        (drawn, coarser) = (again, finer);
        if difference.max_abs < CONVERGED {
            break;
        }
    }
    Ok((Convergence { slabs_per_voxel, last_difference }, drawn))
}

/// A share of a picture's size, at least one pixel each way.
pub fn scaled(size: [u32; 2], scale: f64) -> [u32; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=size")]
    size.map(|n| (f64::from(n) * scale.clamp(0.0, 1.0)).round().max(1.0) as u32)
}

pub(super) fn widened(light: &[[f32; 4]]) -> Vec<[f64; 4]> {
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}
