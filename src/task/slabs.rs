//! Draws pictures tile by tile: slabs of a reconstructed field, and kernels gathered from the grid.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use super::draw::{DrawError, Drawer, Drawn, LEAST_SIDE, LEAST_WHOLE, Observer};
use super::engines::EngineKind;
use super::job::Job;
use super::previews::preview_coefficients;
use crate::core::{Pace, Ticket, memory};
use crate::gpu::layout::TILE;
use crate::gpu::{GpuError, PictureConstants, Renderer, tile_count};
use crate::kernel::{Coefficients, CoefficientsError, Kernel, coefficients};
use crate::native::{self, stored_bytes};
use crate::plan::{Field, Plan, SlabField, Way};
use crate::scene::{OpacityModel, Reconstruction, SplatSettings, View};
use crate::transfer::{Cumulative, TransferFunction, Weight};
use crate::volume::ScalarVolume;

/// Tiles in the first piece, before any was timed.
const FIRST_TILES: u32 = 64;
/// Of the time that a piece may take, what the first of a whole picture is thought to. An NVIDIA H200 draws 1920 × 1080 in
/// 2 or 3 pieces rather than 9, each of which costs 0.2 ms.
const FIRST_SHARE: f64 = 0.25;
/// Bricks of samples that are shaded in the first piece.
const FIRST_BRICKS: u32 = 512;
/// Transmittance at which rays end: what is behind can change no channel by more than half a step
/// of 10 bits.
pub(super) const STOP_BELOW: f64 = 5e-4;
/// Where one ray a pixel would miss small things, a smaller picture gets so many rays more at most for each that
/// it has,
const MOST_MORE_RAYS: f64 = 0.125;
/// or so many: a few single voxels in the smallest pictures there are.
const LEAST_MORE_RAYS: f64 = 1536.0;

/// Coefficients under way on a thread of their own, and the classification of those that arrived.
///
/// Sharpening a large volume takes longer than a hand should wait: whoever waits may leave, and
/// finds the coefficients done when it comes back.
#[derive(Debug, Default)]
pub(super) struct FieldJob {
    under_way: Option<UnderWay>,
    /// Of the GPU engine and of the native one, by [`SlabField`].
    tables: [[Option<TableKey>; 2]; 2],
}

impl FieldJob {
    fn table(&mut self, is_native: bool, which: SlabField) -> &mut Option<TableKey> {
        &mut self.tables[usize::from(is_native)][which as usize]
    }
}

#[derive(Debug)]
struct UnderWay {
    which: SlabField,
    volume: Arc<ScalarVolume>,
    settings: SplatSettings,
    job: Job<Result<Made, CoefficientsError>>,
    is_native: bool,
}

/// What an engine takes a field in from.
#[derive(Debug)]
enum Made {
    /// The GPU engine, which uploads them.
    Coefficients(Coefficients),
    /// The native one.
    Stored(native::Stored),
}

/// What the table on the device was made of.
#[derive(Debug, PartialEq)]
struct TableKey {
    transfer: TransferFunction,
    opacity_model: OpacityModel,
    reach: usize,
    /// Of isosurfaces.
    levels: Vec<f64>,
}

impl UnderWay {
    fn start(
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: SplatSettings,
        is_native: bool,
    ) -> Result<Self, GpuError> {
        let work = {
            let volume = Arc::clone(volume);
            let interpolating = settings.reconstruction == Reconstruction::Interpolating;
            move |ticket: &Ticket| {
                let found = match which {
                    SlabField::Own => {
                        let SplatSettings { kernel, extent, .. } = settings;
                        coefficients(&volume, kernel, extent, interpolating, ticket)?
                    }
                    SlabField::Preview if settings.kernel == Kernel::Functions => {
                        coefficients(&volume, settings.kernel, None, false, ticket)?
                    }
                    SlabField::Preview => preview_coefficients(&volume, ticket)?,
                };
                if !is_native {
                    return Ok(Made::Coefficients(found));
                }
                Ok(Made::Stored(native::Stored::new(which, &volume, &settings, found, ticket)?))
            }
        };
        let job = Job::start(("voxsplat-field", "the field"), work)?;
        Ok(Self { which, volume: Arc::clone(volume), settings, job, is_native })
    }

    fn is_for(
        &self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        settings: &SplatSettings,
        is_native: bool,
    ) -> bool {
        let key = |s: &SplatSettings| (s.kernel, s.extent, s.reconstruction, s.limits());
        self.which == which
            && self.is_native == is_native
            && Arc::ptr_eq(&self.volume, volume)
            && key(&self.settings) == key(settings)
    }
}

impl Drawer {
    /// Every slab of a reconstructed field, for a picture that is shown `enlarged` times larger.
    pub(super) fn slabs(
        &mut self,
        plan: &Plan,
        which: SlabField,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let (view, enlarged) = (plan.view(), plan.enlarged);
        let has_field = plan.field().is_some();
        self.prepare_field(plan, which, observer)?;
        self.engines.gpu()?.put_cut(plan)?;
        self.engines.gpu()?.make_polygon_lists(plan, &view)?;
        let constants = PictureConstants {
            unit_distance: plan.frame.unit_distance,
            smallest_spacing: plan.frame.lattice.smallest_spacing(),
            stop_below: STOP_BELOW,
        };
        // The price of a whole picture's rays was learnt in another view, and a hand may be waiting.
        let (ray_ms, share) = match enlarged > 1.0 {
            true => (self.costs.reduced_ray_ms[which as usize], 1.0),
            false => (self.costs.ray_ms, FIRST_SHARE),
        };
        let tile_ms = ray_ms * f64::from(TILE * TILE);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let first =
            (share * observer.piece_ms() / tile_ms).clamp(f64::from(FIRST_TILES), 1e6) as u32;
        let pipelines = self.engines.gpu()?.pipeline_count();
        let rays = f64::from(plan.size[0]) * f64::from(plan.size[1]);
        if has_field {
            // What these take is learnt with the others: the next picture is smaller for it.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rays")]
            let most = (rays * MOST_MORE_RAYS).max(LEAST_MORE_RAYS) as u64;
            self.engines.gpu()?.mark_specks(which, &view, &plan.mode, most);
        }
        let draw = |renderer: &mut Renderer, tiles: Range<u32>| match has_field {
            false => renderer.draw_tiles_without_field(&view, plan, tiles),
            true => renderer.draw_slab_tiles(which, &view, &plan.mode, constants, tiles),
        };
        let (mut drawn, (splats, visits)) =
            self.beside_vectors(plan, &view, which, observer, (first, draw))?;
        if !has_field {
            drawn.kernels = splats;
        }
        drawn.made_pipelines = self.engines.gpu()?.pipeline_count() != pipelines;
        // The next one will not wait for a compiler, and what a cut takes is not what all of the field does.
        if !drawn.made_pipelines && plan.cut.is_none() {
            self.learn_slabs((plan, which), (drawn.wall_ms, drawn.lists_ms), visits);
        }
        Ok(Drawn { is_shaded: has_field, ..drawn })
    }

    /// Learns from a picture in slabs what rays and visits (`vectors::PictureVectors::visits`) cost, from milliseconds in all
    /// and those of its lists.
    pub(super) fn learn_slabs(
        &mut self,
        (plan, which): (&Plan, SlabField),
        (wall_ms, lists_ms): (f64, f64),
        visits: f64,
    ) {
        let rays = f64::from(plan.size[0]) * f64::from(plan.size[1]);
        // In a window that is hardly there, a picture's time is none of its rays'; and nothing costs nothing.
        if rays < LEAST_SIDE * LEAST_SIDE || plan.way == Way::Nothing {
            return;
        }
        match which {
            SlabField::Own if plan.enlarged <= 1.0 && rays < LEAST_WHOLE * LEAST_WHOLE => {}
            SlabField::Own if plan.enlarged <= 1.0 => self.costs.learn_rays(rays, wall_ms),
            _ if visits > 0.0 => {
                let of_field = if plan.is_of_kernels_alone() { 0.0 } else { rays };
                self.costs.learn_lists(lists_ms);
                self.costs.learn_visits(which, of_field, visits, wall_ms - lists_ms);
            }
            _ => self.costs.learn_reduced(which, rays, wall_ms),
        }
    }

    /// A picture of tiles, so many in the first piece, with a scene's vectors among them, and how many of
    /// these there are, and are visited. Where more lie over a tile than lists hold, means of vectors are drawn.
    fn beside_vectors(
        &mut self,
        plan: &Plan,
        view: &View,
        which: SlabField,
        observer: &mut dyn Observer,
        (first, draw): (u32, impl Fn(&mut Renderer, Range<u32>) -> Result<f64, GpuError>),
    ) -> Result<(Drawn, (u64, f64)), DrawError> {
        let mut vectors_halved = 0;
        let mut first_refusal = None;
        loop {
            let vectors = self.prepare_vectors(plan, view, (which, vectors_halved), observer)?;
            self.engines.gpu()?.put_vectors_in_slabs(vectors.is_some());
            let make_lists = |renderer: &mut Renderer, tiles: Range<u32>| match &vectors {
                Some(vectors) => vectors.make_lists(renderer, view, tiles),
                None => Ok(tiles.end),
            };
            match self.tiled(plan, view, observer, (first, make_lists), &draw) {
                Err(DrawError::Gpu(error @ GpuError::TooManyVectors { .. })) => {
                    // Means lie in as many more slabs as they are larger: why the finest were too many says more.
                    let error = first_refusal.get_or_insert(error);
                    if !vectors.is_some_and(|vectors| vectors.has_coarser()) {
                        return Err(error.clone().into());
                    }
                    // The picture begins anew.
                    vectors_halved += 1;
                }
                Err(error) => return Err(error),
                Ok(drawn) => {
                    let (counted, vectors_averaged) = vectors.map_or(((0, 0.0), 0), |vectors| {
                        ((vectors.count(), vectors.visits()), vectors.averaged())
                    });
                    return Ok((Drawn { vectors_halved, vectors_averaged, ..drawn }, counted));
                }
            }
        }
    }

    /// Brings a field of a plan that reconstructs one to the device.
    pub(super) fn prepare_field(
        &mut self,
        plan: &Plan,
        which: SlabField,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        match plan.field() {
            Some(field) if plan.reconstructs() => self.prepare_slabs(plan, field, which, observer),
            _ => Ok(()),
        }
    }

    /// Every kernel of the grid, gathered pixel by pixel.
    pub(super) fn gathered(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let (view, unit_distance) = (plan.view(), plan.frame.unit_distance);
        self.engines.gpu()?.make_polygon_lists(plan, &view)?;
        let pipelines = self.engines.gpu()?.pipeline_count();
        let start = Instant::now();
        self.shade_samples(plan, &view, observer)?;
        let shading_ms = start.elapsed().as_secs_f64() * 1e3;
        let draw = |renderer: &mut Renderer, tiles: Range<u32>| {
            renderer.draw_gathered(&view, &plan.mode, unit_distance, STOP_BELOW, tiles)
        };
        let how = (FIRST_TILES, draw);
        let (drawn, _) = self.beside_vectors(plan, &view, SlabField::Own, observer, how)?;
        let made_pipelines = self.engines.gpu()?.pipeline_count() != pipelines;
        let wall_ms = drawn.wall_ms + shading_ms;
        Ok(Drawn { is_shaded: true, made_pipelines, wall_ms, ..drawn })
    }

    /// Shades the samples of a scene that asks for it, some bricks at a time.
    fn shade_samples(
        &mut self,
        plan: &Plan,
        view: &View,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let unit_distance = plan.frame.unit_distance;
        let total = self.engines.gpu()?.bricks_to_shade(view, &plan.mode, unit_distance)?;
        let (mut done, mut pace) = (0, Pace::new(FIRST_BRICKS, 64));
        while done < total {
            let end = (done + pace.piece()).min(total);
            let wall_ms = self.engines.gpu()?.shade_bricks(done..end)?;
            pace.learn(f64::from(end - done), wall_ms, observer.piece_ms());
            done = end;
            if observer.piece_done(&mut self.engines, 0.0) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(())
    }

    /// A picture a few tiles at a time, so many of them in the first piece. Before the tiles of a band
    /// are drawn it is made ready, which says where it ends.
    fn tiled(
        &mut self,
        plan: &Plan,
        view: &View,
        observer: &mut dyn Observer,
        (first, mut make_ready): (
            u32,
            impl FnMut(&mut Renderer, Range<u32>) -> Result<u32, GpuError>,
        ),
        mut draw: impl FnMut(&mut Renderer, Range<u32>) -> Result<f64, GpuError>,
    ) -> Result<Drawn, DrawError> {
        let start = Instant::now();
        self.begin(plan, view, plan.mode.kernel.splatted())?;
        let total = tile_count(view.size);
        let (mut done, mut ready, mut lists_ms) = (0, 0, 0.0);
        let mut pace = Pace::new(first, 1);
        while done < total {
            if done == ready {
                let start = Instant::now();
                ready = make_ready(self.engines.gpu()?, done..total)?;
                lists_ms += start.elapsed().as_secs_f64() * 1e3;
            }
            let end = (done + pace.piece()).min(ready);
            let wall_ms = draw(self.engines.gpu()?, done..end)?;
            pace.learn(f64::from(end - done), wall_ms, observer.piece_ms());
            done = end;
            let share = f64::from(done) / f64::from(total);
            if observer.piece_done(&mut self.engines, share) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(Drawn {
            size: view.size,
            kernels: self.active_count().unwrap_or(0),
            wall_ms: start.elapsed().as_secs_f64() * 1e3,
            lists_ms,
            ..Drawn::default()
        })
    }

    /// Whether the engine that draws a plan holds the field that it reconstructs.
    pub(super) fn holds_own_field(&self, plan: &Plan) -> bool {
        let holds = |Field { volume, .. }: &Field| match self.engines.of_plan(plan) {
            EngineKind::Native => {
                self.engines.native.holds_field(SlabField::Own, volume, &plan.mode)
            }
            EngineKind::Gpu => {
                let renderer = self.engines.made_gpu();
                renderer.is_some_and(|gpu| gpu.holds_field(SlabField::Own, volume, &plan.mode))
            }
        };
        plan.field().is_some_and(holds)
    }

    /// Lets go of the field that was reconstructed last, whichever engine has it.
    pub(super) fn forget_own_field(&mut self) {
        for is_native in [true, false] {
            *self.field.table(is_native, SlabField::Own) = None;
        }
        self.engines.native.clear_field(SlabField::Own);
        if let Some(renderer) = self.engines.made_gpu_mut() {
            renderer.clear_field(SlabField::Own);
        }
    }

    /// Brings the device up to a field of a plan and its classification.
    fn prepare_slabs(
        &mut self,
        plan: &Plan,
        Field { volume, transfer, .. }: &Field,
        which: SlabField,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let (mode, is_native) = (&plan.mode, self.engines.of_plan(plan) == EngineKind::Native);
        let is_lit = mode.kernel == Kernel::Cells && plan.shading.lights_borders();
        let holds_field = match is_native {
            true => self.engines.native.holds_field(which, volume, mode),
            false => {
                let renderer = self.engines.gpu()?;
                renderer.holds_field(which, volume, mode)
                    && (renderer.is_field_lit(which) || !is_lit)
            }
        };
        if !holds_field {
            *self.field.table(is_native, which) = None;
            if is_native {
                // Room for the next one.
                self.engines.native.clear_field(which);
            }
            match self.made(volume, mode, which, is_native, observer)? {
                Made::Stored(stored) => self.engines.native.set_field(which, stored),
                Made::Coefficients(coefficients) => {
                    // The observer looks at what has a picture, which this engine has not meanwhile.
                    let mut renderer = self.engines.take_gpu()?;
                    let set = self.watched(observer, |ticket| {
                        if is_lit {
                            renderer.set_lit_field(which, volume, mode, coefficients, ticket)
                        } else {
                            renderer.set_field(which, volume, mode, coefficients, ticket)
                        }
                    });
                    self.engines.put_gpu(renderer);
                    match set {
                        Err(GpuError::Cancelled) => return Err(DrawError::Interrupted),
                        other => other?,
                    }
                }
            }
        }
        let spacing = plan.frame.lattice.smallest_spacing();
        let key = TableKey {
            transfer: plan.shading.by_value(transfer),
            opacity_model: plan.mode.opacity_model,
            reach: Renderer::slab_reach(&plan.view(), spacing, &plan.mode),
            levels: plan.inside.isosurfaces.iter().map(|iso| iso.value).collect(),
        };
        let holds_table = match is_native {
            true => self.engines.native.holds_table(which),
            false => self.engines.gpu()?.holds_slab_table(which),
        };
        let is_current = holds_table && self.field.table(is_native, which).as_ref() == Some(&key);
        if !is_current {
            let weight = match key.opacity_model {
                OpacityModel::OpticalDepth => Weight::Extinction,
                OpacityModel::Published => Weight::Opacity,
            };
            let table = Cumulative::new(
                &key.transfer,
                volume.samples.scalar_type(),
                &volume.statistics,
                weight,
            );
            match is_native {
                true => self.begin_native(observer, |native, ticket| {
                    Ok(native.set_table(which, &table, &key.levels, ticket)?)
                })?,
                false => {
                    self.engines.gpu()?.set_slab_table(which, &table, key.reach, &key.levels)?;
                }
            }
            *self.field.table(is_native, which) = Some(key);
        }
        Ok(())
    }

    /// What an engine takes a field in from, waited for as long as nothing newer comes.
    fn made(
        &mut self,
        volume: &Arc<ScalarVolume>,
        mode: &SplatSettings,
        which: SlabField,
        is_native: bool,
        observer: &mut dyn Observer,
    ) -> Result<Made, DrawError> {
        // Another is cancelled.
        let kept = self.field.under_way.take();
        let under_way = match kept.filter(|job| job.is_for(which, volume, mode, is_native)) {
            Some(kept) => kept,
            None => {
                if is_native {
                    // The coefficients, and what is made of them.
                    let bytes = stored_bytes(volume.lattice.dims, mode).saturating_mul(2);
                    memory::require("a field beside its volume", bytes, memory::free_bytes())?;
                }
                UnderWay::start(which, volume, *mode, is_native)?
            }
        };
        let Some(made) = under_way.job.wait(&mut self.engines, observer)? else {
            self.field.under_way = Some(under_way);
            return Err(DrawError::Interrupted);
        };
        match made {
            Ok(made) => Ok(made),
            Err(CoefficientsError::Cancelled(_)) => Err(DrawError::Interrupted),
            Err(CoefficientsError::TooLarge(error)) if which == SlabField::Preview => {
                Err(GpuError::TooLarge {
                    what: "a field for previews",
                    limit: "memory that is free".to_owned(),
                    found: error.to_string(),
                    advice: "close other programs",
                }
                .into())
            }
            Err(error) => Err(GpuError::Device(error.to_string()).into()),
        }
    }
}
