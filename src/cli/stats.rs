//! What `--stats` writes.

use serde::Serialize;

use super::flags::RefineFlag;
use crate::plan::Outline;
use crate::scene::{Backend, Effect, Scene, SplatSettings};
use crate::task::effect_costs::{AddedTime, LeftOut};
use crate::task::engine::{EngineKind, HeldBytes, OctreeBuilder};
use crate::task::smooth;
use crate::task::still::{Convergence, PassTime, Refine, ShownField, Still, Timer};

/// The file's content; the names are stable.
#[derive(Debug, Serialize)]
pub(super) struct Stats<'a> {
    /// Which engine drew: `native` or `gpu`.
    engine: EngineKind,
    /// The adapter, or the processor's instructions and threads.
    adapter: &'a str,
    /// The native engine's compiled loop that drew; null where the other engine did.
    #[serde(rename = "loop")]
    native_loop: Option<&'static str>,
    resolution: [u32; 2],
    /// The mode it was drawn in.
    mode: SplatSettings,
    /// `raster` or `tiles`.
    backend: Backend,
    /// What the picture is made of, and what of the scene it has no place for.
    plan: &'a Outline,
    kernels_total: u64,
    kernels_active: u64,
    kernels_drawn: u64,
    /// Of basis functions, what is left out of them everywhere; null where none may be.
    functions_left_out: Option<LeftOutRow>,
    octree_nodes: u64,
    /// Of a cut: how many levels its nodes are of; null of other pictures.
    octree_levels: Option<usize>,
    octree_error: f32,
    /// Who classified and merged the octree: `host` or `device`; null where there was none.
    octree_built_by: Option<OctreeBuilder>,
    /// Size the picture was drawn at before it was enlarged.
    drawn_resolution: [u32; 2],
    /// The reconstructed field that it shows; null where kernels are shaded first, and of octree cuts.
    field: Option<ShownField>,
    /// `--budget-ms`.
    budget_ms: Option<f64>,
    /// What the picture is thought to be off by, RMSE in linear light over black, against the converged one; of modes
    /// without slabs against that of the exact mode; of quick pictures with vectors or polygons against `full`.
    estimated_rmse: Option<f64>,
    /// And what that may be off by, dB, mostly.
    estimated_within_db: Option<f64>,
    /// `coarse`, `full` or `converged`.
    refinement: RefineFlag,
    /// Where slabs were doubled, how that ended.
    convergence: Option<ConvergenceRow>,
    /// Measured against `full`, where `--max-error` asked for it.
    rmse: Option<f64>,
    /// What is on the picture beside the transfer function.
    effects: Vec<&'static str>,
    /// Of each that the scene asks for, what asks, what it costs and what it changes.
    effect_rows: Vec<EffectRow>,
    /// Bytes on the device, of parts that not every scene has.
    held: HeldBytes,
    /// Of one more frame, in which each pass is waited for by itself: they add up to `timed_frame_ms` at most. The native
    /// engine's stages, which are timed in any frame.
    passes: &'a [PassTime],
    /// Wall time of that frame, `present` included, but not its reading back; null where passes were not timed.
    timed_frame_ms: Option<f64>,
    /// Whose clock the passes were timed by: `device` or `wall`.
    timer: Option<Timer>,
    /// Wall time from camera set until the pixels are in memory, as light, without `present`: of the picture written
    /// first, then of each of `--repeat`.
    frame_ms: &'a [f64],
    /// Rays a pixel of the picture that was written: 1, or 5 where edges were smoothed.
    rays_per_pixel: u32,
    /// Wall time of smoothing, beyond the first of `frame_ms`; null where no edges were.
    smoothed_ms: Option<f64>,
    load_ms: f64,
    peak_gpu_bytes: u64,
    pipelines: usize,
    /// Sums of published opacities that were over 1 and lowered to it.
    capped_sums: u64,
    /// Transfer table entries whose opacity was lowered to the transmittance floor.
    capped_opacities: usize,
}

/// Functions that a picture does without.
#[derive(Debug, Serialize)]
pub(super) struct LeftOutRow {
    count: u64,
    /// What they are thought to be over the box of the encoding, in the units of values.
    rms: f64,
}

impl LeftOutRow {
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let (count, rms) = scene.left_out_functions()?;
        Some(Self { count, rms })
    }
}

#[derive(Debug, Serialize)]
struct ConvergenceRow {
    #[serde(flatten)]
    end: Convergence,
    /// Whether the last difference is below 1/512.
    is_reached: bool,
}

#[derive(Debug, Serialize)]
struct EffectRow {
    name: &'static str,
    asked_by: String,
    /// Whether it is on the picture.
    runs: bool,
    /// This and the rest: of full pictures with it and without; null where none such were drawn.
    added: Option<AddedTime>,
    /// On the device, more than without it.
    bytes: Option<i64>,
    /// Of the picture without it, linear light.
    rmse: Option<f64>,
    mean_brightness: Option<f64>,
}

/// What a scene asks for, and what of it: the parts of all shading, not that as a whole.
pub(super) fn asked_of(scene: &Scene) -> Vec<(Effect, String)> {
    let parts = Effect::ALL.iter().copied().filter(|effect| *effect != Effect::Shading);
    parts.filter_map(|effect| Some((effect, effect.asked_by(scene)?))).collect()
}

impl EffectRow {
    fn of((effect, asked_by): (Effect, String), runs: bool, measured: &[LeftOut]) -> Self {
        let measured = measured.iter().find(|row| row.effect == effect);
        Self {
            name: effect.name(),
            asked_by,
            runs,
            added: measured.map(|row| row.added),
            bytes: measured.map(|row| row.bytes),
            rmse: measured.map(|row| row.rmse),
            mean_brightness: measured.map(|row| row.mean_brightness),
        }
    }
}

impl<'a> Stats<'a> {
    pub(super) fn of(
        still: &'a Still,
        mode: SplatSettings,
        (asked, effects): (Vec<(Effect, String)>, &[Effect]),
        refine: Refine,
        (kernels_total, functions_left_out): (u64, Option<LeftOutRow>),
        load_ms: f64,
    ) -> Self {
        let row = |asked: (Effect, String)| {
            let runs = effects.contains(&asked.0);
            EffectRow::of(asked, runs, &still.effects)
        };
        Self {
            effect_rows: asked.into_iter().map(row).collect(),
            engine: still.engine,
            adapter: &still.adapter,
            native_loop: still.native_loop,
            resolution: still.size,
            mode,
            backend: still.backend,
            plan: &still.outline,
            kernels_total,
            kernels_active: still.kernels_active,
            kernels_drawn: still.drawn.kernels,
            functions_left_out,
            octree_nodes: still.drawn.cut.map_or(still.drawn.nodes, |cut| cut.nodes()),
            octree_levels: match still.drawn.cut {
                Some(cut) => Some(cut.levels()),
                None => Some(still.drawn.levels).filter(|&levels| levels > 0),
            },
            octree_error: still.drawn.cut.map_or(still.drawn.max_error, |cut| cut.max_error),
            octree_built_by: still.octree,
            drawn_resolution: still.drawn.size,
            field: still.field,
            budget_ms: match refine {
                Refine::Budget { budget_ms } => Some(budget_ms),
                _ => None,
            },
            estimated_rmse: still.estimated_rmse,
            estimated_within_db: still.estimated_rmse.map(|_| still.estimated_within_db),
            refinement: match &still.convergence {
                Some(convergence) if convergence.is_reached() => RefineFlag::Converged,
                _ if still.is_full => RefineFlag::Full,
                _ => RefineFlag::Coarse,
            },
            convergence: still
                .convergence
                .map(|end| ConvergenceRow { end, is_reached: end.is_reached() }),
            rmse: still.measured_rmse,
            effects: effects.iter().map(|effect| effect.name()).collect(),
            held: still.held,
            passes: &still.passes,
            timed_frame_ms: still.timed_frame_ms,
            timer: still.timer,
            frame_ms: &still.frame_ms,
            rays_per_pixel: if still.smoothed_ms.is_some() { smooth::RAYS } else { 1 },
            smoothed_ms: still.smoothed_ms,
            load_ms,
            peak_gpu_bytes: still.peak_gpu_bytes,
            pipelines: still.pipelines,
            capped_sums: still.capped_sums,
            capped_opacities: still.capped_opacities,
        }
    }
}
