//! The price list of a scene and view: every setting drawn, timed and held to the exact picture.
//!
//! A [`Sweep`] goes in steps, each of which its ticket can stop; what it has found stays, and it
//! goes on from there. So a window runs it while nothing moves.

use super::engine::Engine;
use super::still::{CONVERGED, Convergence, Refine, Still, StillError, StillRequest};
use crate::accuracy::flip::Flip;
use crate::accuracy::sample::StratifiedPixels;
use crate::accuracy::ssim::Ssim;
use crate::accuracy::sweep::{
    Measured, Point, SampledError, Setting, WholeError, candidates_of, exact_mode, front,
};
use crate::accuracy::{CompareError, Difference};
use crate::core::parallel;
use crate::core::{Cancelled, Ticket};
use crate::reference::{Reference, TOLERANCE};
use crate::scene::{ModeError, Scene, SplatSettings, View};

/// The exact picture, pixel by pixel: the exact mode's integral in float64.
pub trait Truth: Send + Sync {
    /// Linear premultiplied RGBA at a pixel's centre.
    fn pixel(&self, pixel: [u32; 2]) -> [f64; 4];

    /// What each channel may be off by.
    fn stated_error(&self) -> f64;
}

/// Makes the truth for a scene, whose mode is the exact one, at a size.
pub type MakeTruth = fn(&Scene, [u32; 2]) -> Box<dyn Truth>;

/// Radius of the exact mode's B-splines, voxels.
const EXACT_RADIUS: f64 = 2.0;
/// Rays along the side of a pixel, where it is averaged (design: 8 × 8).
const AVERAGED_RAYS: usize = 8;

/// [`MakeTruth`] by the reference, within [`TOLERANCE`].
///
/// # Panics
/// Where the scene's mode means nothing, which the exact one never does.
pub fn exact_truth(scene: &Scene, size: [u32; 2]) -> Box<dyn Truth> {
    let size_at = size.map(|n| n as usize);
    // The mean of rays where kernels are smaller than a pixel, or nothing thin would be there.
    let is_point = EXACT_RADIUS * View::new(scene, size).narrowest_voxel_pixels() >= 1.0;
    let reference = match is_point {
        true => Reference::exact(scene, size_at),
        false => Reference::supersampled(scene, size_at, AVERAGED_RAYS, true),
    };
    match reference {
        Ok(reference) => Box::new(reference),
        // A scene that no engine draws either: no picture is ever held to it.
        Err(error) => Box::new(NoTruth(error)),
    }
}

/// Of a scene that there is no picture of.
struct NoTruth(ModeError);

impl Truth for NoTruth {
    fn pixel(&self, _: [u32; 2]) -> [f64; 4] {
        log::error!("{}", self.0);
        [f64::NAN; 4]
    }

    fn stated_error(&self) -> f64 {
        f64::NAN
    }
}

impl Truth for Reference {
    fn pixel(&self, pixel: [u32; 2]) -> [f64; 4] {
        Self::pixel(self, pixel.map(|n| n as usize))
    }

    fn stated_error(&self) -> f64 {
        TOLERANCE
    }
}

/// How thorough a sweep is.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepOptions {
    /// What is compared.
    pub settings: Vec<Setting>,
    /// Pixels compared with the exact picture, at least (all where there are no more).
    pub pixels: usize,
    /// Chooses them.
    pub seed: u64,
    /// Frames more than one, for timing.
    pub repeat: u32,
    /// No further frame once a setting's frames have taken this long together, milliseconds.
    pub repeat_within_ms: f64,
    /// Whether whole pictures are compared with `converged`, too.
    pub whole_picture: bool,
    /// Slabs per voxel that `converged` may go to.
    pub most_slabs: f64,
}

impl SweepOptions {
    /// All candidates for a scene, as the command line has them by default.
    pub fn new(scene: &Scene) -> Self {
        Self {
            settings: candidates_of(scene),
            pixels: 2000,
            seed: 1,
            repeat: 2,
            repeat_within_ms: 20_000.0,
            whole_picture: true,
            most_slabs: 16.0,
        }
    }
}

/// The converged picture that whole pictures are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Converged {
    /// How it ended.
    pub convergence: Convergence,
    /// Its own distance from the exact picture.
    pub sampled: SampledError,
    /// Wall milliseconds of its last frame.
    pub time_ms: f64,
}

/// What a sweep does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The exact picture at some more of the sampled pixels.
    Truth,
    /// The converged picture.
    Converged,
    /// The setting of this index.
    Setting(usize),
    /// Nothing.
    Done,
}

/// Why a sweep stopped before its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The ticket. What was found so far is kept.
    #[error("cancelled")]
    Cancelled,
    /// The exact picture is no picture.
    #[error("the exact picture cannot be compared with: {0}")]
    Truth(#[from] CompareError),
}

impl From<Cancelled> for SweepError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// A price list under way.
pub struct Sweep {
    scene: Scene,
    size: [u32; 2],
    options: SweepOptions,
    make_truth: MakeTruth,
    truth: Option<Box<dyn Truth>>,
    sample: StratifiedPixels,
    /// The exact light at the first of the sampled pixels.
    exact: Vec<[f64; 4]>,
    converged: Option<Result<(Converged, WholeTruth), String>>,
    points: Vec<Point>,
    adapter: Option<String>,
}

/// A whole picture to compare with, prepared once.
struct WholeTruth {
    light: Vec<[f64; 4]>,
    ssim: Option<Ssim>,
    flip: Flip,
}

/// Width and height of the picture that is drawn before any is timed.
const FEW_PIXELS: u32 = 32;
/// Pixels of the truth between two looks at the ticket.
const PIXELS_A_STEP: usize = 64;

impl Sweep {
    /// Nothing done yet. `size` in pixels, each at least 1.
    pub fn new(scene: Scene, size: [u32; 2], options: SweepOptions, make_truth: MakeTruth) -> Self {
        let sample = StratifiedPixels::new(size, options.pixels, options.seed);
        Self {
            scene,
            size,
            options,
            make_truth,
            truth: None,
            sample,
            exact: Vec::new(),
            converged: None,
            points: Vec::new(),
            adapter: None,
        }
    }

    /// What comes next.
    pub fn next_step(&self) -> Step {
        if self.exact.len() < self.sample.pixels.len() {
            Step::Truth
        } else if self.options.whole_picture && self.converged.is_none() {
            Step::Converged
        } else if self.points.len() < self.options.settings.len() {
            Step::Setting(self.points.len())
        } else {
            Step::Done
        }
    }

    /// Takes one step.
    ///
    /// # Errors
    /// Cancelled in the middle of it, or without a truth. A setting that cannot be drawn is no
    /// error but a [`Point`] that says so.
    pub fn step(&mut self, engine: &Engine, ticket: &Ticket) -> Result<(), SweepError> {
        match self.next_step() {
            Step::Truth => self.more_truth(ticket),
            Step::Converged => self.converge(engine, ticket),
            Step::Setting(index) => self.measure(index, engine, ticket),
            Step::Done => Ok(()),
        }
    }

    /// Takes all steps that are left; `on_step` is called before each and at the end.
    ///
    /// # Errors
    /// As [`Sweep::step`].
    pub fn run(
        &mut self,
        engine: &Engine,
        ticket: &Ticket,
        on_step: &mut dyn FnMut(&Self),
    ) -> Result<(), SweepError> {
        loop {
            on_step(self);
            if self.next_step() == Step::Done {
                return Ok(());
            }
            self.step(engine, ticket)?;
        }
    }

    /// What was found so far, in the order of [`SweepOptions::settings`].
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Indices of the points on the Pareto front, quickest first.
    pub fn front(&self) -> Vec<usize> {
        front(&self.points)
    }

    /// What is swept.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Of which size.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How.
    pub fn options(&self) -> &SweepOptions {
        &self.options
    }

    /// Pixels compared with the exact picture.
    pub fn pixel_count(&self) -> usize {
        self.sample.pixels.len()
    }

    /// Share of the work done, 0..=1, truth and settings counted alike.
    pub fn fraction(&self) -> f32 {
        let pixels = self.sample.pixels.len().max(1) as f32;
        let settings = self.options.settings.len() as f32;
        // The truth counts as much as a tenth of the settings.
        let truth = self.exact.len() as f32 / pixels;
        (0.1 * truth * settings + self.points.len() as f32) / (1.1 * settings).max(1.0)
    }

    /// What a channel of the exact picture may be off by, once it was asked for.
    pub fn truth_error(&self) -> Option<f64> {
        self.truth.as_ref().map(|truth| truth.stated_error())
    }

    /// Whether all of the exact light found so far is too faint to be seen: less than half a step of
    /// an 8-bit channel.
    pub fn sees_nothing(&self) -> bool {
        self.exact.iter().all(|pixel| pixel[3] < CONVERGED)
    }

    /// The converged picture, once there is one; or one sentence on why there is none.
    pub fn converged(&self) -> Option<Result<&Converged, &str>> {
        self.converged.as_ref().map(|found| match found {
            Ok((converged, _)) => Ok(converged),
            Err(sentence) => Err(sentence.as_str()),
        })
    }

    /// The adapter that drew, once one did.
    pub fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref()
    }

    /// The mode whose limit the truth is: the exact one.
    pub fn truth_mode(&self) -> SplatSettings {
        exact_mode(&self.scene.splat, 1.0)
    }

    fn exact_scene(&self) -> Scene {
        Scene { splat: self.truth_mode(), ..self.scene.clone() }
    }

    fn more_truth(&mut self, ticket: &Ticket) -> Result<(), SweepError> {
        ticket.checkpoint(self.exact.len() as u64, self.sample.pixels.len() as u64)?;
        if self.truth.is_none() {
            self.truth = Some((self.make_truth)(&self.exact_scene(), self.size));
        }
        let Some(truth) = &self.truth else { return Ok(()) };
        let from = self.exact.len();
        let to = (from + PIXELS_A_STEP).min(self.sample.pixels.len());
        let pixels = &self.sample.pixels[from..to];
        let more = parallel::list(pixels.len(), |i| truth.pixel(pixels[i]));
        if let Some(wild) = more.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
            return Err(CompareError::NotFinite { pixel: from + wild }.into());
        }
        self.exact.extend(more);
        Ok(())
    }

    fn still(
        &mut self,
        setting: &Setting,
        size: [u32; 2],
        refine: Refine,
        engine: &Engine,
        ticket: &Ticket,
    ) -> Result<Still, StillError> {
        let scene = Scene { splat: setting.splat, ..self.scene.clone() };
        let request = StillRequest {
            scene,
            size,
            refine,
            repeat: 0,
            time_passes: false,
            smooth_edges: false,
        };
        let still = engine.still(request, ticket)?;
        self.adapter = Some(still.adapter.clone());
        Ok(still)
    }

    fn sampled(&self, light: &[[f64; 4]]) -> Result<SampledError, CompareError> {
        let width = self.size[0] as usize;
        let at = |pixel: &[u32; 2]| light[pixel[1] as usize * width + pixel[0] as usize];
        let found: Vec<_> = self.sample.pixels.iter().map(at).collect();
        self.sample.error(&found, &self.exact, self.options.seed)
    }

    fn converge(&mut self, engine: &Engine, ticket: &Ticket) -> Result<(), SweepError> {
        let setting = Setting::full(self.exact_scene().splat);
        let refine = Refine::Converged { most_slabs: self.options.most_slabs };
        let still = match self.still(&setting, self.size, refine, engine, ticket) {
            Err(StillError::Cancelled) => return Err(SweepError::Cancelled),
            Err(error) => {
                self.converged = Some(Err(error.to_string()));
                return Ok(());
            }
            Ok(still) => still,
        };
        let light = widened(&still.light);
        let found = self.sampled(&light).map_err(|error| error.to_string());
        self.converged = Some(found.map(|sampled| {
            let convergence = still.convergence.unwrap_or(Convergence {
                slabs_per_voxel: setting.splat.slabs_per_voxel,
                last_difference: None,
            });
            let converged = Converged { convergence, sampled, time_ms: still.own_ms() };
            let whole = WholeTruth {
                ssim: Ssim::new(&light, self.size),
                flip: Flip::new(&light, self.size),
                light,
            };
            (converged, whole)
        }));
        Ok(())
    }

    fn measure(
        &mut self,
        index: usize,
        engine: &Engine,
        ticket: &Ticket,
    ) -> Result<(), SweepError> {
        let setting = self.options.settings[index].clone();
        let refine = Refine::Reduced { detail: setting.detail, scale: setting.scale };
        if let Err(error) = setting.splat.check() {
            self.points.push(Point { setting, outcome: Err(error.to_string()) });
            return Ok(());
        }
        // A few pixels first: shaders are compiled, and the field made ready, in nobody's time.
        let few = self.size.map(|n| n.min(FEW_PIXELS));
        let mut pipelines = match self.still(&setting, few, refine, engine, ticket) {
            Err(StillError::Cancelled) => return Err(SweepError::Cancelled),
            Err(_) => 0,
            Ok(still) => still.pipelines,
        };
        let mut time_ms = Vec::new();
        let mut first = None;
        while time_ms.len() <= self.options.repeat as usize
            && time_ms.iter().sum::<f64>() < self.options.repeat_within_ms
        {
            match self.still(&setting, self.size, refine, engine, ticket) {
                Err(StillError::Cancelled) => return Err(SweepError::Cancelled),
                Err(error) => {
                    self.points.push(Point { setting, outcome: Err(error.to_string()) });
                    return Ok(());
                }
                Ok(still) => {
                    // Where few pixels take other shaders, these were compiled in its time.
                    if still.pipelines == pipelines {
                        time_ms.push(still.own_ms());
                    }
                    pipelines = still.pipelines;
                    first.get_or_insert(still);
                }
            }
        }
        let Some(still) = first else { return Ok(()) };
        let outcome = self.judged(&still, time_ms).map_err(|error| error.to_string());
        self.points.push(Point { setting, outcome });
        Ok(())
    }

    fn judged(&self, still: &Still, time_ms: Vec<f64>) -> Result<Measured, CompareError> {
        let light = widened(&still.light);
        let whole = match &self.converged {
            Some(Ok((_, truth))) => {
                let difference = Difference::between(&light, &truth.light)?;
                Some(WholeError {
                    rmse: difference.rmse,
                    psnr_db: difference.psnr(),
                    max_abs: difference.max_abs,
                    alpha_rmse: difference.rmse_alpha,
                    alpha_max: difference.max_alpha,
                    ssim: truth.ssim.as_ref().map(|ssim| ssim.mean(&light)),
                    flip: truth.flip.mean(&light),
                })
            }
            _ => None,
        };
        Ok(Measured {
            time_ms,
            engine: still.engine.name(),
            native_loop: still.native_loop,
            native_stages: still.native_stages.clone(),
            bytes: still.held.all,
            kernels: still.drawn.kernels,
            drawn_size: still.drawn.size,
            sampled: self.sampled(&light)?,
            whole,
        })
    }
}

fn widened(light: &[[f32; 4]]) -> Vec<[f64; 4]> {
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::polygons::Mesh;
    use crate::scene::{PolygonLayer, opening};
    use crate::volume::{Lattice, Samples, ScalarVolume};

    #[test]
    fn polygons_that_are_seen_leave_out_modes_that_do_not_show_them() {
        let samples = Samples::UInt8(vec![1; 8]);
        let volume = ScalarVolume::from_samples("t", Lattice::unit([2; 3]), samples).unwrap();
        let mut scene = opening(Default::default(), Arc::new(volume), None);
        scene.splat = SplatSettings::EXACT;
        let all = candidates_of(&scene);
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh::new("t", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
        let mesh = PolygonLayer::new(Arc::new(mesh));
        for (is_shown, opacity) in [(true, 1.0), (true, 0.0), (false, 1.0)] {
            let mut among = scene.clone().with(mesh.clone());
            if let Some(layer) = among.layers.last_mut() {
                layer.is_shown = is_shown;
                *layer.look.opacity_mut().unwrap() = opacity;
            }
            let is_seen = is_shown && opacity > 0.0;
            let found = candidates_of(&among);
            assert_eq!(found != all, is_seen, "{is_shown} {opacity}");
            assert!(found.len() > 30 && (!is_seen || found.len() < all.len()), "{}", found.len());
        }
    }
}
