//! What `accuracy` writes.

use serde::Serialize;

use crate::accuracy::sweep::{Detail, Point, SampledError};
use crate::core::Camera;
use crate::scene::{SplatSettings, Visibility};
use crate::task::still::PassTime;
use crate::task::sweep::Sweep;
use crate::transfer::{Region, TransferFunction};

/// The file's content; the names are stable. dB of no error at all, which JSON has no number for,
/// are null.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    adapter: &'a str,
    scene: SceneRow<'a>,
    resolution: [u32; 2],
    truth: TruthRow,
    /// What whole pictures are compared with; null where it could not be drawn.
    converged: Option<ConvergedRow>,
    /// Why there is none.
    converged_failed: Option<&'a str>,
    points: Vec<PointRow<'a>>,
    /// Names of the points on the Pareto front of time and error, quickest first.
    front: Vec<&'a str>,
}

#[derive(Debug, Serialize)]
struct SceneRow<'a> {
    file: String,
    field: &'a str,
    dims: [usize; 3],
    spacing: [f64; 3],
    camera: &'a Camera,
    transfer: Option<&'a TransferFunction>,
    /// Regions of value and gradient strength beside it.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    regions: &'a [Region],
    opacity_unit_distance: f64,
    /// Vector fields beside it, or instead.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    vectors: Vec<String>,
    /// Whether the field itself is not shown.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    vectors_only: bool,
    /// Meshes among all of it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    meshes: Vec<String>,
}

/// What every point is held to: the exact integral in float64, at some pixels.
#[derive(Debug, Serialize)]
struct TruthRow {
    mode: SplatSettings,
    /// What a channel may be off by.
    stated_error: Option<f64>,
    pixels: usize,
    seed: u64,
}

#[derive(Debug, Serialize)]
struct ConvergedRow {
    slabs_per_voxel: f64,
    /// Greatest difference of a channel from the picture with half as many.
    last_difference: Option<f64>,
    /// Whether that is below 1/512.
    is_reached: bool,
    time_ms: f64,
    /// Its own distance from the truth.
    #[serde(flatten)]
    sampled: SampledRow,
}

/// Distance from the truth at the sampled pixels, with the ends of 95 % intervals; null where the
/// pixels do not tell how sure it is.
#[derive(Debug, Serialize)]
struct SampledRow {
    rmse: f64,
    rmse_ci: Option<[f64; 2]>,
    psnr_db: f64,
    psnr_ci_db: Option<[f64; 2]>,
    max: f64,
    alpha_rmse: f64,
    alpha_max: f64,
}

impl From<SampledError> for SampledRow {
    fn from(found: SampledError) -> Self {
        Self {
            rmse: found.rmse,
            rmse_ci: found.rmse_interval,
            psnr_db: found.psnr_db,
            psnr_ci_db: found.psnr_interval_db,
            max: found.max_abs,
            alpha_rmse: found.alpha_rmse,
            alpha_max: found.alpha_max,
        }
    }
}

#[derive(Debug, Serialize)]
struct PointRow<'a> {
    name: &'a str,
    settings: &'a SplatSettings,
    detail: Detail,
    scale: f64,
    on_front: bool,
    /// One sentence where it could not be drawn; then there are no numbers.
    failed: Option<&'a str>,
    /// Slabs per voxel, where there are slabs.
    slabs: Option<f64>,
    #[serde(flatten)]
    found: Option<FoundRow<'a>>,
}

#[derive(Debug, Serialize)]
struct FoundRow<'a> {
    /// Median of `times_ms`.
    time_ms: f64,
    times_ms: &'a [f64],
    /// `native` or `gpu`: modes of one table may be drawn by two engines.
    engine: &'static str,
    /// The native engine's compiled loop, and what its stages of the first frame took; null and none of the other engine,
    /// whose passes are timed by waiting for each.
    #[serde(rename = "loop")]
    native_loop: Option<&'static str>,
    stages: &'a [PassTime],
    /// Bytes that the engine held.
    bytes: u64,
    kernels: u64,
    drawn_resolution: [u32; 2],
    #[serde(flatten)]
    sampled: SampledRow,
    /// Against `converged`, over the whole picture.
    ssim: Option<f64>,
    flip: Option<f64>,
    whole_rmse: Option<f64>,
    whole_psnr_db: Option<f64>,
    whole_max: Option<f64>,
    whole_alpha_rmse: Option<f64>,
    whole_alpha_max: Option<f64>,
}

impl<'a> Report<'a> {
    /// A finished sweep of `file`.
    pub(super) fn of(sweep: &'a Sweep, file: String) -> Self {
        let scene = sweep.scene();
        let volume = scene.volume();
        let lattice = scene.lattice();
        let fields = scene.vectors().into_iter();
        let meshes = scene.surfaces().into_iter();
        let front = sweep.front();
        let converged = sweep.converged();
        Self {
            adapter: sweep.adapter().unwrap_or_default(),
            scene: SceneRow {
                file,
                field: volume.map_or("", |volume| &volume.name),
                dims: lattice.dims,
                spacing: lattice.spacing.to_array(),
                camera: &scene.camera,
                transfer: scene.transfer(),
                regions: &scene.shading.regions,
                opacity_unit_distance: scene.opacity_unit_distance(),
                vectors: fields.map(|layer| layer.field.name.clone()).collect(),
                vectors_only: !scene.shows_field(),
                meshes: meshes.map(|surface| surface.name().to_owned()).collect(),
            },
            resolution: sweep.size(),
            truth: TruthRow {
                mode: sweep.truth_mode(),
                stated_error: sweep.truth_error(),
                pixels: sweep.pixel_count(),
                seed: sweep.options().seed,
            },
            converged: converged.and_then(Result::ok).map(|found| ConvergedRow {
                slabs_per_voxel: found.convergence.slabs_per_voxel,
                last_difference: found.convergence.last_difference,
                is_reached: found.convergence.is_reached(),
                time_ms: found.time_ms,
                sampled: found.sampled.into(),
            }),
            converged_failed: converged.and_then(Result::err),
            points: sweep
                .points()
                .iter()
                .enumerate()
                .map(|(i, point)| PointRow::of(point, front.contains(&i)))
                .collect(),
            front: front.iter().map(|&i| sweep.points()[i].setting.name.as_str()).collect(),
        }
    }

    /// What the truth reconstructs, in few words.
    pub(super) fn truth_words(sweep: &Sweep) -> String {
        if !sweep.scene().shows_field() {
            return "splats of vectors where they lie".to_owned();
        }
        let mode = sweep.truth_mode();
        let (kernel, how) = (mode.kernel.name(), mode.reconstruction.name());
        format!("{kernel} {how}, classified after reconstruction")
    }
}

impl<'a> PointRow<'a> {
    fn of(point: &'a Point, on_front: bool) -> Self {
        let setting = &point.setting;
        let slabs = setting.splat.visibility == Visibility::Slabs;
        Self {
            name: &setting.name,
            settings: &setting.splat,
            detail: setting.detail,
            scale: setting.scale,
            on_front,
            failed: point.outcome.as_ref().err().map(String::as_str),
            slabs: slabs.then_some(setting.splat.slabs_per_voxel),
            found: point.outcome.as_ref().ok().map(|found| FoundRow {
                time_ms: found.median_ms(),
                times_ms: &found.time_ms,
                engine: found.engine,
                native_loop: found.native_loop,
                stages: &found.native_stages,
                bytes: found.bytes,
                kernels: found.kernels,
                drawn_resolution: found.drawn_size,
                sampled: found.sampled.into(),
                ssim: found.whole.and_then(|whole| whole.ssim),
                flip: found.whole.map(|whole| whole.flip),
                whole_rmse: found.whole.map(|whole| whole.rmse),
                whole_psnr_db: found.whole.map(|whole| whole.psnr_db),
                whole_max: found.whole.map(|whole| whole.max_abs),
                whole_alpha_rmse: found.whole.map(|whole| whole.alpha_rmse),
                whole_alpha_max: found.whole.map(|whole| whole.alpha_max),
            }),
        }
    }
}
