//! Vector splats of a scene: classified and averaged on a thread of their own, and put into the slabs
//! that pixels walk.

use std::ops::Range;
use std::sync::Arc;

use super::draw::{DrawError, Drawer, Observer};
use super::job::Job;
use super::slabs::STOP_BELOW;
use crate::core::{Cancelled, Ticket};
use crate::gpu::layout::{LAYER_SLABS, TILE};
use crate::gpu::{GpuError, Renderer, VectorLook, VectorSplats};
use crate::native;
use crate::plan::{Classification, KernelList, KernelSlabs, Plan, SlabField};
use crate::scene::{SplatSettings, View};
use crate::vector::Splats;

/// Splats of finished pictures are no smaller than this radius in pixels: below, means are drawn.
const LEAST_RADIUS_PX: f64 = 1.0;
/// Those of quick pictures, in pixels of what is drawn. Played in the window by the native engine on two cores, at 14 to 18 pictures a
/// second: carotid 29, 36, 36 dB and tornado 32, 34, 31 dB with 4, 2 and 1. Graphics cards are unmeasured.
const LEAST_QUICK_RADIUS_PX: f64 = 2.0;

/// The least radius of a picture's splats, pixels.
fn least_radius_px(is_quick: bool) -> f64 {
    if is_quick { LEAST_QUICK_RADIUS_PX } else { LEAST_RADIUS_PX }
}

/// How much thicker slabs are in quick pictures: splats then lie in half as many.
const QUICK_SLABS: f64 = 2.0;
/// Slabs of a field that share one of vectors in quick pictures, at most.
const MOST_FIELD_SLABS: f64 = 64.0;

/// The splats of the scene drawn last, of each field and the finest level first, and those under way.
#[derive(Debug, Default)]
pub(super) struct VectorJob {
    held: Vec<(Classification, Levels)>,
    under_way: Option<(Classification, Job<Result<Levels, Cancelled>>)>,
}

/// Splats, the finest level first.
type Levels = Vec<Arc<Splats>>;

/// Vectors of one picture: which level, and how the slabs are cut.
#[derive(Debug, Clone)]
pub(super) struct PictureVectors {
    plan: Plan,
    slabs: KernelSlabs,
    /// Whether there are means of them, too.
    has_coarser: bool,
    /// See `Drawn::vectors_averaged`.
    averaged: usize,
    /// See [`visits`].
    visits: f64,
}

impl PictureVectors {
    /// See the field.
    pub(super) fn averaged(&self) -> usize {
        self.averaged
    }

    /// See the field.
    pub(super) fn visits(&self) -> f64 {
        self.visits
    }

    /// See the field.
    pub(super) fn has_coarser(&self) -> bool {
        self.has_coarser
    }

    /// What is drawn of each list, and the slabs that it is cut into.
    pub(super) fn slabs(&self) -> &KernelSlabs {
        &self.slabs
    }

    /// Splats in the picture, or beside it.
    pub(super) fn count(&self) -> u64 {
        self.slabs.splats.iter().map(|splats| splats.list.len() as u64).sum()
    }

    /// Makes the lists of the tiles from `first` on, and as many rows after as fit; the one after the
    /// last tile.
    pub(super) fn make_lists(
        &self,
        renderer: &mut Renderer,
        view: &View,
        tiles: Range<u32>,
    ) -> Result<u32, GpuError> {
        let plan = &self.plan;
        let columns = view.size[0].div_ceil(TILE);
        let what = VectorSplats {
            looks: &looks(&self.slabs.splats, &plan.kernels),
            phase: plan.phase,
            splat: &plan.mode,
            camera: &plan.camera,
            centre: plan.frame.lattice.centre(),
            slab: self.slabs.thickness,
            field_slabs: self.slabs.field_slabs,
            stop_below: STOP_BELOW as f32,
        };
        let rows = tiles.start / columns..tiles.end / columns;
        Ok(renderer.make_vector_lists(view, &what, rows)?.end * columns)
    }
}

/// How the splats of each list look.
fn looks<'a>(splats: &'a [Arc<Splats>], lists: &'a [KernelList]) -> Vec<VectorLook<'a>> {
    let both = splats.iter().zip(lists);
    both.map(|(splats, list)| VectorLook { splats, settings: &list.settings }).collect()
}

/// Width of a splat in steps of its grid.
fn size_of(splats: &Splats) -> f64 {
    splats.list.first().map_or(1.0, |splat| f64::from(splat.size))
}

/// The radius of splats without their stretch, pixels.
fn radius_px(splats: &Splats, pixels_per_unit: f64) -> f64 {
    splats.radius * size_of(splats) * splats.unit * pixels_per_unit
}

/// The finest of some levels whose splats have a radius of so many pixels at least; else the coarsest.
fn finest(levels: &[Arc<Splats>], least: f64, pixels_per_unit: f64) -> Option<usize> {
    let found = levels.iter().position(|splats| radius_px(splats, pixels_per_unit) >= least);
    found.or(levels.len().checked_sub(1))
}

/// As thick as slabs of vectors alone are, pixels: as their own steps, and of two fields as the shorter ones of
/// what shows.
fn own_slab(
    splats: &[Arc<Splats>],
    mode: &SplatSettings,
    (pixels_per_unit, is_quick): (f64, bool),
) -> f64 {
    let thick = if is_quick { QUICK_SLABS } else { 1.0 };
    let some = splats.iter().filter(|splats| !splats.list.is_empty());
    let steps = some.map(|splats| size_of(splats) * splats.unit);
    let none = splats.first().map_or(1.0, |splats| splats.unit);
    let step = steps.min_by(f64::total_cmp).unwrap_or(none);
    thick * step / mode.slabs_per_voxel * pixels_per_unit
}

/// How often pixels look at a splat: each one of the tiles that it may lie over, once for each layer of slabs. A
/// measure of what they cost.
fn visits(splats: &[Arc<Splats>], slab: f64, pixels_per_unit: f64) -> f64 {
    let of = |splats: &Arc<Splats>| {
        let across = 2.0 * radius_px(splats, pixels_per_unit);
        let layers = across / (f64::from(LAYER_SLABS) * slab) + 1.0;
        splats.list.len() as f64 * (across + f64::from(TILE)).powi(2) * layers
    };
    splats.iter().map(of).sum()
}

impl Drawer {
    /// Classifies the kernel lists of a plan, and averages them, where that is not done; lets go of others.
    ///
    /// # Errors
    /// Interrupted.
    pub(super) fn classify_vectors(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        if plan.kernels.is_empty() {
            self.vectors = VectorJob::default();
            self.engines.native.clear_kernels();
            if let Some(renderer) = self.engines.made_gpu_mut() {
                renderer.clear_vectors();
            }
            return Ok(());
        }
        for (i, KernelList { classification: key, .. }) in plan.kernels.iter().enumerate() {
            if self.vectors.held.get(i).is_some_and(|(held, _)| held == key) {
                continue;
            }
            let levels = self.vector_levels(key, observer)?;
            match self.vectors.held.get_mut(i) {
                Some(held) => *held = (key.clone(), levels),
                None => self.vectors.held.push((key.clone(), levels)),
            }
        }
        self.vectors.held.truncate(plan.kernels.len());
        Ok(())
    }

    /// Brings the device up to the vectors of a picture, halved so many times beyond what was asked for;
    /// `None` for a scene without any.
    ///
    /// # Errors
    /// Interrupted, vectors beside a field that is shaded first, or the device.
    pub(super) fn prepare_vectors(
        &mut self,
        plan: &Plan,
        view: &View,
        (which, halved): (SlabField, u32),
        observer: &mut dyn Observer,
    ) -> Result<Option<PictureVectors>, DrawError> {
        self.classify_vectors(plan, observer)?;
        if plan.kernels.is_empty() {
            return Ok(None);
        }
        let spacing = plan.frame.lattice.smallest_spacing();
        let (pixels_per_unit, is_quick) = (view.pixels_per_unit, view.enlarged > 1.0);
        let least = least_radius_px(is_quick);
        let mut splats = Vec::new();
        let (mut has_coarser, mut averaged) = (false, 0);
        for ((_, levels), list) in self.vectors.held.iter().zip(&plan.kernels) {
            let coarsest = levels.len().saturating_sub(1);
            let asked = coarsest.min(list.settings.coarser as usize);
            let first = coarsest.min(asked + halved as usize);
            let Some(found) = finest(&levels[first..], least, pixels_per_unit) else {
                return Ok(None);
            };
            let at_rest =
                finest(&levels[asked..], LEAST_RADIUS_PX / view.enlarged, pixels_per_unit);
            let level = first + found;
            splats.push(Arc::clone(&levels[level]));
            has_coarser |= first < coarsest;
            averaged = averaged.max(level - asked - at_rest.unwrap_or(0));
        }
        let own_slab = own_slab(&splats, &plan.mode, (pixels_per_unit, is_quick));
        let (slab, field_slabs) = match plan.is_of_kernels_alone() {
            true => (own_slab, 1),
            false => {
                let thickness = match self.is_native() {
                    true => native::slab_thickness(plan),
                    false => self.engines.gpu()?.slab_thickness(which, view, &plan.mode, spacing),
                };
                // Those of the field are shared out only where nobody looks closely.
                let most = if is_quick { MOST_FIELD_SLABS } else { 1.0 };
                let count = (own_slab / thickness).floor().clamp(1.0, most);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few")]
                let whole = count as u32;
                (count * thickness, whole)
            }
        };
        if !self.is_native() {
            self.engines.gpu()?.set_vectors(&looks(&splats, &plan.kernels))?;
        }
        let (plan, visits) = (plan.clone(), visits(&splats, slab, pixels_per_unit));
        let slabs = KernelSlabs { splats, thickness: slab, field_slabs };
        Ok(Some(PictureVectors { plan, slabs, has_coarser, averaged, visits }))
    }

    /// How often pixels of a smaller picture look at splats of a scene's vectors ([`visits`]), about; `None` before
    /// these were drawn.
    pub(super) fn thought_visits(&self, plan: &Plan, shrink: f64) -> Option<f64> {
        let is_quick = shrink > 1.0;
        let pixels_per_unit = plan.view().pixels_per_unit / shrink;
        let both = plan.kernels.iter().zip(&self.vectors.held);
        let splats = both.map(|(list, (key, levels))| {
            let first = (levels.len().checked_sub(1)?).min(list.settings.coarser as usize);
            let levels = key.is_of(&list.field).then(|| &levels[first..])?;
            let found = finest(levels, least_radius_px(is_quick), pixels_per_unit)?;
            Some(Arc::clone(&levels[found]))
        });
        let splats = splats.collect::<Option<Vec<_>>>().filter(|splats| !splats.is_empty())?;
        let own = own_slab(&splats, &plan.mode, (pixels_per_unit, is_quick));
        let spacing = plan.frame.lattice.smallest_spacing();
        let of_field = match plan.is_of_kernels_alone() {
            true => 0.0,
            false => spacing / plan.mode.slabs_per_voxel * pixels_per_unit,
        };
        Some(visits(&splats, own.max(of_field), pixels_per_unit))
    }

    /// The splats of a key, waited for as long as nothing newer comes.
    fn vector_levels(
        &mut self,
        key: &Classification,
        observer: &mut dyn Observer,
    ) -> Result<Levels, DrawError> {
        // Others are cancelled.
        let kept = self.vectors.under_way.take().filter(|(of, _)| of == key);
        let (_, job) = match kept {
            Some(kept) => self.vectors.under_way.insert(kept),
            None => {
                let of = key.clone();
                let work = move |ticket: &Ticket| of.levels(ticket);
                let job = Job::start(("voxsplat-vectors", "the vectors' splats"), work)?;
                self.vectors.under_way.insert((key.clone(), job))
            }
        };
        let waited = job.wait(&mut self.engines, observer);
        if !matches!(waited, Ok(None)) {
            self.vectors.under_way = None;
        }
        Ok(waited?.ok_or(DrawError::Interrupted)??)
    }
}
