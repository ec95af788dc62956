//! Draws plans with the native engine, some tiles at a time.

use std::sync::Arc;
use std::sync::mpsc;
use std::time::Instant;

use super::draw::{DrawError, Drawer, Drawn, Observer};
use super::engines::EngineKind;
use super::job::LOOK_EVERY;
use super::previews::is_of_few_cells;
use super::slabs::STOP_BELOW;
use super::vectors::PictureVectors;
use crate::core::parallel;
use crate::core::{Cancelled, Pace, Ticket, memory};
use crate::gpu::timing::Timer;
use crate::gpu::{GpuError, PassTime};
use crate::kernel::Kernel;
use crate::native::{self, Node, NotBegun, Unsupported, tile_count};
use crate::plan::{Field, Plan, SlabField};
use crate::scene::{Classify, SplatSettings, Visibility};
use crate::transfer::{Table, TransferFunction};
use crate::volume::{Scalar, ScalarVolume};
use crate::with_samples;

/// Tiles in the first piece, before any was timed: each piece costs a thread's start, and none is waited for to its end.
const FIRST_TILES: u32 = 1024;
/// And no shorter pieces are aimed at, milliseconds.
const LEAST_PIECE_MS: f64 = 30.0;
/// No tile is begun after so many times the time of a piece: how far a picture is, and what of it is there, is told in between.
const LATEST: f64 = 3.0;

/// Samples that are counted between two looks at the ticket.
const COUNTED: usize = 1 << 16;

/// Pictures of more pixels than this ask for memory first: looking how much is free takes a while.
const MANY_PIXELS: u64 = 1 << 23;
/// And lists of more kernels.
const MANY_KERNELS: u64 = 1 << 16;
/// A kernel of a list as it is found, sorted and kept, and its places in lists of cells.
const BYTES_A_KERNEL: u64 = 288;
/// A pixel in tiles, in rows, and on its way to a file.
const BYTES_A_PIXEL: u64 = 48;

/// What the kernels of an octree cut are laid down in: they lie in no sheet of the lattice, and stand in for a
/// reconstructed field one by one.
fn mode_of_nodes(mode: &SplatSettings) -> SplatSettings {
    match mode.visibility {
        Visibility::Slabs if mode.classify == Classify::Before => *mode,
        Visibility::Slabs => mode.previewed(),
        _ => SplatSettings { visibility: Visibility::EverySample, ..*mode },
    }
}

/// What the native engine finds out only once it begins a picture.
fn refusal(reason: Unsupported) -> DrawError {
    let sentence = format!(
        "expected a picture that the native engine draws, found {reason}; choose fewer --slabs-per-voxel, a smaller \
         picture or another --kernel, or correct a spacing that is far less than the others, or cells that are there twice"
    );
    GpuError::Unsupported(sentence).into()
}

/// Memory for lists of so many kernels, where they are many: looking how much is free takes a while.
fn require_lists(what: &'static str, count: u64) -> Result<(), DrawError> {
    if count > MANY_KERNELS {
        memory::require(what, count * BYTES_A_KERNEL, memory::free_bytes())?;
    }
    Ok(())
}

impl Drawer {
    /// Slabs of a field, by the engine that draws the plan.
    pub(super) fn slabs_of(
        &mut self,
        plan: &Plan,
        which: SlabField,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        match self.engines.of_plan(plan) {
            EngineKind::Native => self.natively(plan, which, observer),
            EngineKind::Gpu => self.slabs(plan, which, observer),
        }
    }

    /// Whether the engine that draws now holds the field of a volume in a mode.
    pub(super) fn holds_field(
        &self,
        which: SlabField,
        volume: &Arc<ScalarVolume>,
        mode: &SplatSettings,
    ) -> bool {
        match self.is_native() {
            true => self.engines.native.holds_field(which, volume, mode),
            false => {
                let renderer = self.engines.made_gpu();
                renderer.is_some_and(|renderer| renderer.holds_field(which, volume, mode))
            }
        }
    }

    /// The kernel and the samples of a field that the engine with the picture holds.
    pub(super) fn field_shape(&self, which: SlabField) -> Option<(Kernel, [usize; 3])> {
        match self.engines.drew() {
            EngineKind::Native => self.engines.native.field_shape(which),
            EngineKind::Gpu => self.engines.made_gpu()?.field_shape(which),
        }
    }

    /// The picture of a plan that the native engine supports, from one of its fields.
    pub(super) fn natively(
        &mut self,
        plan: &Plan,
        which: SlabField,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        self.prepare_field(plan, which, observer)?;
        let pixels = u64::from(plan.size[0]) * u64::from(plan.size[1]);
        if pixels > MANY_PIXELS {
            memory::require(memory::PICTURE, pixels * BYTES_A_PIXEL, memory::free_bytes())?;
        }
        let start = Instant::now();
        self.prepare_samples(plan, observer)?;
        let view = plan.view();
        let vectors = self.prepare_vectors(plan, &view, (which, 0), observer)?;
        let slabs = vectors.as_ref().map(PictureVectors::slabs);
        let count = vectors.as_ref().map_or(0, PictureVectors::count);
        require_lists("the vectors of a picture", count)?;
        self.begin_native(observer, |native, ticket| {
            native.begin(plan, which, slabs, STOP_BELOW, ticket)
        })?;
        let lists_ms = if slabs.is_some() { start.elapsed().as_secs_f64() * 1e3 } else { 0.0 };
        self.native_tiles(plan.size, observer)?;
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        let are_alone = plan.is_of_kernels_alone();
        let visits = vectors.as_ref().map_or(0.0, PictureVectors::visits);
        if plan.cut.is_none() {
            self.learn_slabs((plan, which), (wall_ms, lists_ms), visits);
            // Of a finished picture it is another price that was measured.
            if plan.enlarged > 1.0 && !is_of_few_cells(plan) {
                self.costs.hold_fields_together(which);
            }
        }
        let (splats, vectors_averaged) =
            vectors.map_or((0, 0), |vectors| (vectors.count(), vectors.averaged()));
        Ok(Drawn {
            size: plan.size,
            kernels: if are_alone { splats } else { self.active_count().unwrap_or(0) },
            is_shaded: plan.field().is_some(),
            vectors_averaged,
            wall_ms,
            lists_ms,
            ..Drawn::default()
        })
    }

    /// Has the native engine begin a picture, on a thread of its own: lists of a million kernels take longer than
    /// something newer should wait.
    pub(super) fn begin_native(
        &mut self,
        observer: &mut dyn Observer,
        begin: impl FnOnce(&mut native::Renderer, &Ticket) -> Result<(), NotBegun> + Send,
    ) -> Result<(), DrawError> {
        // The observer looks at what has a picture, which this engine has not meanwhile.
        let mut native = std::mem::take(&mut self.engines.native);
        let begun = self.watched(observer, |ticket| begin(&mut native, ticket));
        self.engines.native = native;
        match begun {
            Ok(()) => Ok(()),
            Err(NotBegun::Cancelled(cancelled)) => Err(cancelled.into()),
            Err(NotBegun::Unsupported(reason)) => Err(refusal(reason)),
        }
    }

    /// Does work that asks a ticket on a thread of its own, and cancels that where something newer comes.
    pub(super) fn watched<T: Send>(
        &mut self,
        observer: &mut dyn Observer,
        work: impl FnOnce(&Ticket) -> T + Send,
    ) -> T {
        watched_by(|| observer.piece_done(&mut self.engines, 0.0), work)
    }

    /// The tiles of a picture that the native engine has begun, some at a time: as many as took one piece's time before, and fewer
    /// where these take much longer. Something newer waits for the tiles under way alone.
    fn native_tiles(
        &mut self,
        size: [u32; 2],
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let total = tile_count(size);
        let (mut done, mut pace) = (0, Pace::new(FIRST_TILES, 8));
        while done < total {
            let begin = Instant::now();
            let end = (done + pace.piece()).min(total);
            let piece_ms = observer.piece_ms().max(LEAST_PIECE_MS);
            let most_ms = LATEST * piece_ms;
            let native = &mut self.engines.native;
            let piece = |ticket: &Ticket| native.draw_tiles(done..end, most_ms, ticket);
            let end = watched_by(|| observer.is_overtaken(), piece)?;
            let took_ms = begin.elapsed().as_secs_f64() * 1e3;
            pace.learn(f64::from(end - done), took_ms, piece_ms);
            done = end;
            let share = f64::from(done) / f64::from(total);
            if observer.piece_done(&mut self.engines, share) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(())
    }

    /// A picture of the nodes of an octree cut, far to near, by the native engine.
    pub(super) fn native_nodes(
        &mut self,
        plan: &Plan,
        nodes: &[Node],
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        require_lists("the kernels of an octree cut", nodes.len() as u64)?;
        let plan = plan.in_mode(mode_of_nodes(&plan.mode));
        self.begin_native(observer, |native, ticket| {
            native.begin_nodes(&plan, nodes, STOP_BELOW, ticket)
        })?;
        self.native_tiles(plan.size, observer)
    }

    /// Has the samples of a plan that shades first at hand.
    fn prepare_samples(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        if plan.reconstructs() || plan.field().is_none() {
            return Ok(());
        }
        if self.engines.native.holds_samples(plan) {
            return Ok(());
        }
        if !self.engines.native.begun_samples(plan) {
            let bytes = self.watched(observer, |ticket| native::samples_bytes(plan, ticket))?;
            memory::require("samples beside their volume", bytes, memory::free_bytes())?;
        }
        self.begin_native(observer, |native, ticket| Ok(native.make_samples(plan, ticket)?))
    }

    /// What quick pictures are drawn from, where the native engine draws: without a field there would be nothing.
    pub(super) fn prepare_native(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        if let Some(field) = plan.field() {
            self.engines.native.keep_fields_of(&field.volume);
        }
        self.prepare_field(plan, SlabField::Own, observer)
    }

    /// Counts the voxels with opacity of a plan that was drawn without an octree.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn count_active(&mut self, plan: &Plan, ticket: &Ticket) -> Result<u64, Cancelled> {
        if let Some(count) = self.active_count() {
            return Ok(count);
        }
        let Some(Field { volume, transfer, .. }) = plan.field() else { return Ok(0) };
        let is_of = |(of, by, _): &&(Arc<ScalarVolume>, TransferFunction, u64)| {
            Arc::ptr_eq(of, volume) && by == transfer
        };
        if let Some((_, _, count)) = self.counted.as_ref().filter(is_of) {
            return Ok(*count);
        }
        let table = Table::new(transfer, volume.samples.scalar_type());
        let count = with_samples!(&*volume.samples, values => {
            let shows = |value: &&_| table.lookup(Scalar::to_f64(**value))[3] > 0.0;
            let count = |sum: &mut u64, some: &[_]| {
                *sum += some.iter().filter(shows).count() as u64;
                ticket.look()
            };
            parallel::try_summed(values.chunks(COUNTED), || 0, count, |sum, more| *sum += more)?
        });
        self.counted = Some((Arc::clone(volume), transfer.clone(), count));
        Ok(count)
    }

    /// Has passes timed from now on; by whose clock.
    ///
    /// # Errors
    /// A failing device.
    pub(super) fn time_passes(&mut self) -> Result<Timer, GpuError> {
        match self.engines.drew() {
            // It always does.
            EngineKind::Native => Ok(Timer::Wall),
            EngineKind::Gpu => Ok(self.engines.gpu()?.time_passes()),
        }
    }

    /// What the stages of the picture took so far.
    pub(super) fn times(&self) -> Vec<PassTime> {
        let stage = |&(name, gpu_ms, runs): &(_, _, _)| PassTime { name, gpu_ms, runs };
        match (self.engines.drew(), self.engines.made_gpu()) {
            (EngineKind::Gpu, Some(renderer)) => renderer.times().to_vec(),
            _ => self.engines.native.stages().iter().map(stage).collect(),
        }
    }

    /// Has passes timed no longer.
    pub(super) fn stop_timing(&mut self) {
        if let Some(renderer) = self.engines.made_gpu_mut() {
            renderer.stop_timing();
        }
    }
}

/// Does work that asks a ticket on a thread of its own, and cancels that once it is overtaken.
fn watched_by<T: Send>(
    mut is_overtaken: impl FnMut() -> bool,
    work: impl FnOnce(&Ticket) -> T + Send,
) -> T {
    let ticket = Ticket::new();
    let done = std::thread::scope(|scope| {
        let (done, is_done) = mpsc::channel::<()>();
        let worker = scope.spawn(|| {
            // Dropped at the end, or where it fails.
            let _done = done;
            work(&ticket)
        });
        let mut goes_on = true;
        while is_done.recv_timeout(LOOK_EVERY) == Err(mpsc::RecvTimeoutError::Timeout) {
            // Once is enough: it may have been told of something that it takes.
            if goes_on && is_overtaken() {
                ticket.cancel();
                goes_on = false;
            }
        }
        worker.join()
    });
    done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::engines::{Canvas, EngineChoice, Engines};
    use super::*;
    use crate::core::assert_stops;
    use crate::gpu::Wishes;
    use crate::scene::{SampleSource, Scene, opening};
    use crate::volume::demo;

    /// Stops at the look of a number.
    struct StopsAt(u32);

    impl Observer for StopsAt {
        fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
            self.0 -= 1;
            self.0 == 0
        }
    }

    fn drawer() -> Drawer {
        let engines = Engines::new(EngineChoice::Native.into(), Wishes::default());
        Drawer::with(engines.expect("no adapter is asked for"))
    }

    /// Without the ticket it would not end.
    #[test]
    fn lists_are_left_off_where_something_newer_comes() {
        let mut drawer = drawer();
        drawer.engines.native = native::Renderer::with_threads(3);
        let begun = drawer.begin_native(&mut StopsAt(2), |_, ticket| {
            while !ticket.is_cancelled() {
                std::thread::sleep(Duration::from_millis(1));
            }
            Err(Cancelled.into())
        });
        assert_eq!(begun, Err(DrawError::Interrupted));
        assert!(drawer.engines.native.name().ends_with("3 threads"), "the engine is another");
    }

    fn shells(name: &str) -> Scene {
        let grid = demo::open(name, None).expect("a demo");
        let field = grid.field(None).expect("a field");
        let component = crate::volume::Component::Index(0);
        let volume = grid.scalar(field, component, &Ticket::new()).expect("not cancelled");
        let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
        scene.splat = SplatSettings::EXACT;
        scene
    }

    /// Counts its looks, and is overtaken from one of them on; its pieces are as long as there are.
    struct Overtaken {
        looks: u32,
        after: u32,
        pieces: u32,
    }

    impl Observer for Overtaken {
        fn piece_done(&mut self, _: &mut dyn Canvas, done: f64) -> bool {
            self.pieces += u32::from(done > 0.0);
            false
        }

        fn is_overtaken(&mut self) -> bool {
            self.looks += 1;
            self.looks > self.after
        }

        fn piece_ms(&self) -> f64 {
            1e9
        }
    }

    /// Pieces of a still take as long as they like: what overtakes them does not wait for their ends.
    #[test]
    fn something_newer_waits_for_no_piece_of_tiles() {
        let mut scene = shells("demo:shells:24");
        let drawer = &mut drawer();
        drawer.engines.native = native::Renderer::with_threads(2);
        // Seconds of drawing in pieces of tenths of seconds.
        scene.splat.slabs_per_voxel = 64.0;
        let plan = Plan::of(&scene, [800, 600]);
        let mut overtaken = Overtaken { looks: 0, after: 3, pieces: 0 };
        let ended = drawer.natively(&plan, SlabField::Own, &mut overtaken);
        assert_eq!(ended.map(|drawn| drawn.size), Err(DrawError::Interrupted));
        assert_eq!(overtaken.looks, 4, "nobody asks again");
        // It is as well as it was.
        scene.splat.slabs_per_voxel = 1.0;
        let plan = Plan::of(&scene, [48, 32]);
        let mut goes_on = Overtaken { looks: 0, after: u32::MAX, pieces: 0 };
        let drawn = drawer.natively(&plan, SlabField::Own, &mut goes_on);
        assert_eq!(drawn.map(|drawn| drawn.size), Ok([48, 32]));
        assert!(goes_on.pieces > 0);
    }

    #[test]
    fn voxels_are_counted_some_at_a_time() {
        let plan = Plan::of(&shells("demo:shells:96"), [16, 16]);
        assert_stops("counting", 96 * 96 * 96 / COUNTED, |ticket| {
            drawer().count_active(&plan, ticket)
        });
    }

    /// What whole pictures cost is learnt of those that are large enough to tell.
    #[test]
    fn small_whole_pictures_say_nothing_of_what_larger_ones_take() {
        use super::super::draw::{LEAST_SIDE, LEAST_WHOLE};

        let scene = shells("demo:shells:16");
        let mut drawer = drawer();
        let mut learnt = |side: f64, which: SlabField| {
            let before = drawer.costs;
            let plan = Plan::of(&scene, [side as u32; 2]);
            drawer.learn_slabs((&plan, which), (1e3, 0.0), 0.0);
            drawer.costs != before
        };
        assert!(!learnt(LEAST_WHOLE - 1.0, SlabField::Own));
        assert!(learnt(LEAST_WHOLE, SlabField::Own));
        // Quick pictures are small: they tell from a lesser size on.
        assert!(!learnt(LEAST_SIDE - 1.0, SlabField::Preview));
        assert!(learnt(LEAST_SIDE, SlabField::Preview));
    }

    #[test]
    fn what_an_engine_finds_too_late_is_a_refusal() {
        let refused = |_: &mut native::Renderer, _: &Ticket| {
            Err(Unsupported("vectors that reach far".to_owned()).into())
        };
        let begun = drawer().begin_native(&mut (), refused);
        let sentence = begun.expect_err("refused").to_string();
        assert!(sentence.contains("found vectors that reach far; choose fewer"), "{sentence}");
    }
}
