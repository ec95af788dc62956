//! A volume under its transfer function: on the device at once, its octree when something calls for it.
//!
//! The whole octree takes up to a tenth of a second (`task::octrees`), which whoever waits for it may
//! leave, and which another transfer function cancels. While a hand moves one, quick pictures
//! are drawn from level 3 and up.

use std::sync::Arc;
use std::time::Duration;

use super::cells::CutSource;
use super::draw::{DrawError, Drawer, Observer};
use super::engines::{Canvas, Engines};
use super::job::LOOK_EVERY;
use super::octrees::{self, Octree, Source};
use super::previews::is_scaled;
use crate::core::Ticket;
use crate::gpu::{GpuError, OctreeBuilder, supports};
use crate::hierarchy::{ErrorMeasure, Pyramid, PyramidError};
use crate::plan::{Field, Plan, SlabField};
use crate::transfer::{Table, TransferFunction};
use crate::volume::ScalarVolume;

/// So many voxels that can show are classified before a quick picture: 3 to 6 ms on two free cores. Of
/// more, it is drawn from what level 3 knows.
const WHOLE_AT_ONCE: u64 = 1 << 20;

/// The volume under the transfer function.
#[derive(Debug)]
pub(super) struct Classified {
    pub(super) volume: Arc<ScalarVolume>,
    transfer: TransferFunction,
    /// The transfer function on the device, where samples are shaded by another one than this.
    by_value: Option<TransferFunction>,
    unit_distance: f64,
    pub(super) table: Arc<Table>,
    /// Whether a graphics device holds the volume and the table.
    is_on_device: bool,
    /// Where something has called for it; perhaps only its coarse levels.
    pyramid: Option<Arc<Pyramid>>,
    /// Who made it.
    builder: OctreeBuilder,
    /// All of it, on its way.
    under_way: Option<Octree>,
}

impl From<PyramidError> for DrawError {
    fn from(error: PyramidError) -> Self {
        match error {
            PyramidError::Cancelled(_) => Self::Interrupted,
            PyramidError::TooLarge(error) => Self::TooLarge(error),
        }
    }
}

impl Classified {
    fn voxel_depth(&self) -> f64 {
        // The mean over the axes is what matters for how opaque a voxel looks.
        self.volume.lattice.axes().determinant().abs().cbrt() / self.unit_distance
    }

    /// Whether it is a plan's volume under its function.
    fn is_of(&self, plan: &Plan) -> bool {
        let is_of = |f: &Field| Arc::ptr_eq(&self.volume, &f.volume) && self.transfer == f.transfer;
        plan.field().is_some_and(is_of)
    }

    /// The octree, if all of it is there.
    pub(super) fn whole(&self) -> Option<&Arc<Pyramid>> {
        self.pyramid.as_ref().filter(|pyramid| pyramid.is_whole())
    }

    fn source(&self, measure: ErrorMeasure) -> Source {
        Source {
            volume: Arc::clone(&self.volume),
            table: Arc::clone(&self.table),
            voxel_depth: self.voxel_depth(),
            measure,
            is_on_device: self.is_on_device && self.by_value.is_none(),
        }
    }

    /// Begins to build the octree, unless it is there or on its way.
    fn begin(&mut self, measure: ErrorMeasure, engines: &Engines) -> Result<(), DrawError> {
        if self.pyramid.as_ref().is_some_and(|pyramid| pyramid.measure != measure) {
            // Never two at a time.
            self.pyramid = None;
        }
        let is_of = |octree: &Octree| octree.measure() == measure;
        if self.whole().is_some() || self.under_way.as_ref().is_some_and(is_of) {
            return Ok(());
        }
        self.under_way = None;
        self.under_way = Some(Octree::begin(self.source(measure), engines)?);
        Ok(())
    }

    /// Takes the octree that is on its way, waiting for it so long at most, or merging a piece of it;
    /// whether all of it is there.
    fn take(&mut self, engines: &mut Engines, patience: Duration) -> Result<bool, DrawError> {
        let Some(octree) = &mut self.under_way else { return Ok(self.whole().is_some()) };
        let builder = octree.builder;
        match octree.step(engines, patience) {
            Ok(None) => Ok(false),
            Ok(Some(built)) => {
                self.under_way = None;
                (self.pyramid, self.builder) = (Some(Arc::new(built)), builder);
                Ok(true)
            }
            Err(error) => {
                self.under_way = None;
                Err(error)
            }
        }
    }

    /// Has an octree at hand that quick pictures can be drawn from.
    fn coarse(
        &mut self,
        measure: ErrorMeasure,
        engines: &mut Engines,
        ticket: &Ticket,
    ) -> Result<(), DrawError> {
        let is_of = |pyramid: &Arc<Pyramid>| pyramid.measure == measure;
        if self.take(engines, Duration::ZERO)? && self.pyramid.as_ref().is_some_and(is_of) {
            return Ok(());
        }
        if self.pyramid.as_ref().is_some_and(is_of) {
            return Ok(());
        }
        self.pyramid = None;
        let (volume, table, depth) = (&*self.volume, &*self.table, self.voxel_depth());
        let work = match measure {
            ErrorMeasure::Scalar => volume.lattice.len() as u64,
            ErrorMeasure::Classified => Pyramid::visible_voxels(volume, table),
            ErrorMeasure::OpticalDepth => 2 * Pyramid::visible_voxels(volume, table),
        };
        let (pyramid, builder) = match work <= WHOLE_AT_ONCE {
            true => (Pyramid::build(volume, table, depth, measure, ticket)?, OctreeBuilder::Host),
            false => octrees::coarse(&self.source(measure), engines, ticket)?,
        };
        (self.pyramid, self.builder) = (Some(Arc::new(pyramid)), builder);
        Ok(())
    }
}

/// Stops where a ticket is cancelled, and where somebody else stops it.
struct Unless<'a> {
    ticket: &'a Ticket,
    observer: &'a mut dyn Observer,
}

impl Observer for Unless<'_> {
    fn piece_done(&mut self, picture: &mut dyn Canvas, done: f64) -> bool {
        self.ticket.is_cancelled() || self.observer.piece_done(picture, done)
    }

    fn is_overtaken(&mut self) -> bool {
        self.ticket.is_cancelled() || self.observer.is_overtaken()
    }
}

impl Drawer {
    /// Brings the engine that draws a plan up to its volume and transfer function: the native one its field, the GPU
    /// engine the samples and the whole octree.
    ///
    /// # Errors
    /// Interrupted by the ticket, too little memory, a plan that no engine here draws, or the device.
    pub fn prepare(&mut self, plan: &Plan, ticket: &Ticket) -> Result<(), DrawError> {
        self.prepare_watched(plan, ticket, &mut ())
    }

    /// The same, for as long as nothing newer comes. The octree then goes on being built.
    pub(super) fn prepare_watched(
        &mut self,
        plan: &Plan,
        ticket: &Ticket,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        self.engines.ready(plan)?;
        self.turn_to(plan);
        if self.is_native() {
            self.forget_other_volumes(plan);
            return self.prepare_native(plan, &mut Unless { ticket, observer });
        }
        supports(plan)?;
        self.prepare_octree(plan, true, &mut Unless { ticket, observer })
    }

    /// Has what the first quick picture of a plan is drawn from at hand, where that is its samples; whether it is.
    pub(super) fn prepare_first(
        &mut self,
        plan: &Plan,
        ticket: &Ticket,
        observer: &mut dyn Observer,
    ) -> Result<bool, DrawError> {
        self.engines.ready(plan)?;
        self.turn_to(plan);
        if !self.begins_with_samples(plan) {
            return Ok(false);
        }
        self.forget_other_volumes(plan);
        self.prepare_preview_field(plan, &mut Unless { ticket, observer })?;
        Ok(self.is_at_hand(plan, SlabField::Preview))
    }

    /// Has the whole octree of a plan at hand, and where a device is to draw it the volume there.
    pub(super) fn prepare_octree(
        &mut self,
        plan: &Plan,
        on_device: bool,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        if plan.field().is_none() {
            self.classified = None;
            return Ok(());
        }
        self.classify(plan, on_device, observer)?;
        self.begin_octree(plan)?;
        while let Some(classified) = &mut self.classified
            && !classified.take(&mut self.engines, LOOK_EVERY)?
        {
            if observer.piece_done(&mut self.engines, 0.0) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(())
    }

    /// Lets go of fields of another volume than a plan's, and of an octree of another volume or function.
    fn forget_other_volumes(&mut self, plan: &Plan) {
        if let Some(field) = plan.field() {
            self.engines.native.keep_fields_of(&field.volume);
        }
        if !self.classified.as_ref().is_some_and(|classified| classified.is_of(plan)) {
            self.classified = None;
        }
    }

    /// The same for a coarse picture within a budget, which may do without the octree, or with its
    /// coarse levels.
    ///
    /// # Errors
    /// See [`Drawer::prepare`].
    pub fn prepare_preview(
        &mut self,
        plan: &Plan,
        budget_ms: f64,
        ticket: &Ticket,
    ) -> Result<(), DrawError> {
        self.engines.ready(plan)?;
        self.turn_to(plan);
        if plan.field().is_none() {
            return Ok(());
        }
        if self.is_native() {
            self.forget_other_volumes(plan);
            let mut observer = Unless { ticket, observer: &mut () };
            if plan.is_gathered() || self.begins_with_samples(plan) {
                return self.prepare_preview_field(plan, &mut observer);
            }
            if plan.reconstructs() {
                return self.prepare_native(plan, &mut observer);
            }
        }
        if plan.reconstructs() && is_scaled(&plan.mode) {
            // All quick pictures are of it. A cut in its place would flash up whenever the extent is changed.
            self.prepare_field(plan, SlabField::Own, &mut Unless { ticket, observer: &mut () })?;
        }
        let needs_octree = self.reduction(plan, budget_ms).is_none();
        self.classify(plan, !self.is_native(), &mut Unless { ticket, observer: &mut () })?;
        match &mut self.classified {
            Some(classified) if needs_octree => {
                classified.coarse(plan.mode.cut.measure, &mut self.engines, ticket)
            }
            _ => Ok(()),
        }
    }

    /// Begins to build all of the octree of the plan prepared last, where there is but a part.
    ///
    /// # Errors
    /// A thread that does not start.
    pub fn begin_octree(&mut self, plan: &Plan) -> Result<(), DrawError> {
        match &mut self.classified {
            Some(classified) => classified.begin(plan.mode.cut.measure, &self.engines),
            None => Ok(()),
        }
    }

    /// Merges a piece of the octree that was begun, where the device builds it; whether there are more.
    ///
    /// # Errors
    /// A failing device.
    pub fn advance_octree(&mut self) -> Result<bool, DrawError> {
        let Some(classified) = &mut self.classified else { return Ok(false) };
        let has_pieces = |c: &Classified| c.under_way.as_ref().is_some_and(Octree::has_pieces);
        if !has_pieces(classified) {
            return Ok(false);
        }
        classified.take(&mut self.engines, LOOK_EVERY)?;
        Ok(has_pieces(classified))
    }

    /// Who made the octree of the plan prepared last, where there is one.
    pub fn octree_builder(&self) -> Option<OctreeBuilder> {
        let classified = self.classified.as_ref()?;
        classified.pyramid.is_some().then_some(classified.builder)
    }

    /// Whether the octree of the plan prepared last is there only in part.
    pub fn has_coarse_octree(&self) -> bool {
        self.pyramid().is_some_and(|pyramid| !pyramid.is_whole())
    }

    /// Takes the plan's volume and transfer function in, and where a device is to draw them brings them there, for as
    /// long as nothing newer comes.
    fn classify(
        &mut self,
        plan: &Plan,
        on_device: bool,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let Some(Field { volume, transfer, .. }) = plan.field() else { return Ok(()) };
        let unit_distance = plan.frame.unit_distance;
        let by_value = plan.shades_samples().then(|| plan.shading.by_value(transfer));
        let by_value = by_value.filter(|by_value| by_value != transfer);
        let current = self.classified.as_ref().is_some_and(|c| {
            Arc::ptr_eq(&c.volume, volume)
                && c.transfer == *transfer
                && c.by_value == by_value
                && c.unit_distance == unit_distance
                && (c.is_on_device || !on_device)
        });
        if current {
            return Ok(());
        }
        // An octree on its way is cancelled.
        self.classified = None;
        let table = Table::new(transfer, volume.samples.scalar_type());
        if on_device {
            // The observer looks at what has a picture, which this engine has not meanwhile.
            let mut renderer = self.engines.take_gpu()?;
            renderer.drop_bricks();
            let set = self.watched(observer, |ticket| renderer.set_volume(volume, ticket));
            self.engines.put_gpu(renderer);
            match set {
                Err(GpuError::Cancelled) => return Err(DrawError::Interrupted),
                other => other?,
            }
            let renderer = self.engines.gpu()?;
            // Octrees stand in unlit, and know the transfer function alone.
            match &by_value {
                Some(transfer) => {
                    let table = Table::new(transfer, volume.samples.scalar_type());
                    renderer.set_table(&table)?;
                }
                None => renderer.set_table(&table)?,
            }
        }
        self.classified = Some(Classified {
            volume: Arc::clone(volume),
            transfer: transfer.clone(),
            by_value,
            unit_distance,
            table: Arc::new(table),
            is_on_device: on_device,
            pyramid: None,
            builder: OctreeBuilder::Host,
            under_way: None,
        });
        Ok(())
    }

    /// Voxels with opacity in the scene prepared last; `None` where they were not counted. Of 32-bit
    /// values and wider about as many, while there are only the octree's coarse levels.
    pub fn active_count(&self) -> Option<u64> {
        self.pyramid().map(|pyramid| pyramid.active.total)
    }

    pub(super) fn pyramid(&self) -> Option<&Pyramid> {
        self.classified.as_ref()?.pyramid.as_deref()
    }

    /// What octree cuts of the plan prepared last are found in, once all of it is there.
    pub(super) fn cut_source(&self) -> Option<CutSource> {
        self.coarse_cut_source().filter(|source| source.pyramid.is_whole())
    }

    /// The same, perhaps of the coarse levels only.
    pub(super) fn coarse_cut_source(&self) -> Option<CutSource> {
        let Classified { volume, transfer, unit_distance, table, pyramid, .. } =
            self.classified.as_ref()?;
        Some(CutSource {
            volume: Arc::clone(volume),
            transfer: transfer.clone(),
            unit_distance: *unit_distance,
            table: Arc::clone(table),
            pyramid: Arc::clone(pyramid.as_ref()?),
            bricks: self.cuts.bricks().map(Arc::clone),
        })
    }

    /// The error of the octree cut that has about `count` nodes.
    pub fn error_for_count(&self, count: u64) -> f32 {
        self.pyramid().map_or(0.0, |pyramid| pyramid.error_for_count(count))
    }

    /// Entries of a plan's table whose transmittance is at its floor.
    pub fn capped_count(&self, plan: &Plan) -> usize {
        let Some(Field { volume, transfer, .. }) = plan.field() else { return 0 };
        match self.classified.as_ref().filter(|c| c.is_of(plan)) {
            Some(classified) => classified.table.capped_count,
            // The native engine has integrals of the function, and no such table.
            None => Table::new(transfer, volume.samples.scalar_type()).capped_count,
        }
    }

    /// Bytes of host memory the hierarchy takes.
    pub fn hierarchy_bytes(&self) -> usize {
        self.pyramid().map_or(0, Pyramid::size_bytes)
    }
}
