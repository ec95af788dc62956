//! The drawing service: what is asked last is what arrives, and then nothing more.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use glam::{DAffine3, DVec3};
use voxsplat::core::Ticket;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::plan::Plan;
use voxsplat::reference::Rays;
use voxsplat::scene::{Scene, SplatSettings};
use voxsplat::task::draw::{DrawError, Drawer, Rung};
use voxsplat::task::engine::{
    Effort, Engine, EngineState, FrameRequest, Ladder, Picture, SecondRequest,
};
use voxsplat::task::level::LevelOfDetail;
use voxsplat::task::still::{Refine, Still, StillRequest, Timer};
use voxsplat::volume::{Lattice, Samples};

use crate::support::*;

/// Far longer than anything takes beside all other tests on two cores, where 30 s were too short once: it only ends a wait for ever.
pub(crate) const PATIENCE: Duration = Duration::from_secs(180);

/// An engine on the adapter that the tests use, and how often it woke us.
pub(crate) struct Bench {
    pub(crate) engine: Engine,
    wakes: Arc<AtomicUsize>,
}

impl Bench {
    /// `None` where there is no device.
    pub(crate) fn new() -> Option<Self> {
        Self::with(Wishes::default())
    }

    pub(crate) fn with(wishes: Wishes) -> Option<Self> {
        context(wishes)?;
        let wakes = Arc::new(AtomicUsize::new(0));
        let count = Arc::clone(&wakes);
        let wake = move || {
            count.fetch_add(1, Ordering::SeqCst);
        };
        Some(Self { engine: Engine::start_with(adapter(), wishes, wake), wakes })
    }

    pub(crate) fn request(&self, scene: &Scene, size: [u32; 2], effort: Effort) {
        self.engine.request(FrameRequest { scene: scene.clone(), size, effort });
    }

    /// Every picture until `enough`; panics when patience ends.
    #[track_caller]
    pub(crate) fn pictures_until(
        &self,
        enough: impl Fn(&Self, &[Arc<Picture>]) -> bool,
    ) -> Vec<Arc<Picture>> {
        let start = Instant::now();
        let mut pictures = Vec::new();
        loop {
            pictures.extend(self.engine.take_picture());
            if enough(self, &pictures) {
                return pictures;
            }
            assert!(
                start.elapsed() < PATIENCE,
                "{:?} after {}",
                self.engine.state(),
                pictures.len()
            );
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Every picture up to one of this size that is `full`.
    #[track_caller]
    pub(crate) fn until_full(&self, size: [u32; 2]) -> Vec<Arc<Picture>> {
        self.pictures_until(|bench, seen| {
            seen.last().is_some_and(|p| p.report.level.is_full() && p.requested_size == size)
                && bench.engine.state() == EngineState::Idle
        })
    }

    pub(crate) fn still(&self, scene: &Scene) -> Still {
        let request = still_request(scene, SIZE);
        self.engine.still(request, &Ticket::new()).expect("a still")
    }
}

/// Without those that came once more, for what they were found to be off by: nothing was drawn for them.
fn drawn_anew(mut pictures: Vec<Arc<Picture>>) -> Vec<Arc<Picture>> {
    pictures.dedup_by(|again, first| {
        let key = |picture: &Picture| (picture.report.level, picture.report.frame_ms);
        key(again) == key(first) && again.rgba == first.rgba
    });
    pictures
}

fn still_request(scene: &Scene, size: [u32; 2]) -> StillRequest {
    StillRequest {
        scene: scene.clone(),
        size,
        refine: Refine::Full,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    }
}

pub(crate) fn rest() -> Effort {
    Effort::Rest {
        budget_ms: 20.0,
        ladder: Ladder::Octree,
        show_partial: false,
        converge_ms: 0.0,
        smooth_edges: false,
    }
}

pub(crate) fn small() -> Scene {
    scene(Lattice::unit([9, 8, 10]), DVec3::new(0.35, -0.52, 0.78))
}

/// Work for some hundred milliseconds and more.
pub(crate) fn large() -> Scene {
    scene(Lattice::unit([96, 96, 96]), DVec3::new(0.35, -0.52, 0.78))
}

#[test]
fn of_many_requests_the_last_ones_picture_arrives_and_most_others_are_dropped() {
    let Some(bench) = Bench::new() else { return };
    let scene = large();
    for i in 0..60 {
        bench.request(&scene, [100 + i, 90], rest());
        std::thread::sleep(Duration::from_millis(1));
    }
    let pictures = bench.until_full([159, 90]);
    let full = pictures.iter().filter(|p| p.report.level.is_full()).count();
    assert!(full < 10, "{full} of 60 were finished");
}

#[test]
fn a_picture_under_way_is_dropped_for_a_newer_request() {
    let Some(bench) = Bench::new() else { return };
    let scene = large();
    let timed = Instant::now();
    bench.request(&scene, [700, 700], rest());
    bench.until_full([700, 700]);
    let whole = timed.elapsed();
    bench.request(&scene, [710, 700], rest());
    // The first, coarse picture is there; `full` has begun.
    bench.pictures_until(|_, seen| seen.iter().any(|p| p.requested_size == [710, 700]));
    let asked = Instant::now();
    bench.request(&scene, [60, 50], Effort::Moving { budget_ms: 10.0 });
    let pictures =
        bench.pictures_until(|_, seen| seen.iter().any(|p| p.requested_size == [60, 50]));
    println!("measured answer after {:?}, the whole takes {whole:?}", asked.elapsed());
    assert!(pictures.iter().all(|p| p.requested_size == [60, 50]), "the old one was finished");
    assert!(asked.elapsed() < whole / 2, "{:?} of {whole:?}", asked.elapsed());
}

#[test]
fn rest_ends_in_full_and_then_nothing_more_happens() {
    let Some(bench) = Bench::new() else { return };
    let scene = large();
    for ladder in [Ladder::Octree, Ladder::Subsampling, Ladder::CheaperKernels] {
        for show_partial in [false, true] {
            bench.request(&small(), SIZE, rest());
            bench.until_full(SIZE);
            let effort = Effort::Rest {
                budget_ms: 20.0,
                ladder,
                show_partial,
                converge_ms: 0.0,
                smooth_edges: false,
            };
            bench.request(&scene, [320, 200], effort);
            let pictures = bench.until_full([320, 200]);
            let reports: Vec<_> = pictures.iter().map(|p| &p.report).collect();
            assert!(reports.windows(2).all(|w| w[0].progress <= w[1].progress), "{reports:?}");
            let last = reports[reports.len() - 1];
            assert_eq!(
                (last.progress, last.kernels.map(|k| k.drawn)),
                (1.0, last.kernels.map(|k| k.active))
            );
            assert_eq!(last.kernels_total, 96 * 96 * 96);
        }
    }
    let wakes = bench.wakes.load(Ordering::SeqCst);
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!(bench.wakes.load(Ordering::SeqCst), wakes, "woken while idle");
    assert!(bench.engine.take_picture().is_none());
    assert_eq!(bench.engine.state(), EngineState::Idle);
}

#[test]
fn moving_gives_one_coarse_picture() {
    let Some(bench) = Bench::new() else { return };
    bench.request(&large(), [320, 200], Effort::Moving { budget_ms: 10.0 });
    let pictures = bench.pictures_until(|bench, seen| {
        !seen.is_empty() && bench.engine.state() == EngineState::Idle
    });
    let [picture] = &pictures[..] else { panic!("{} pictures", pictures.len()) };
    assert!(picture.report.level.is_coarse(), "{:?}", picture.report);
    assert!(picture.report.kernels.is_some_and(|kernels| kernels.drawn < kernels.active));
    assert!(picture.size[0] <= 320 && picture.size[1] <= 200);
    assert_eq!(picture.rgba.len(), (picture.size[0] * picture.size[1] * 4) as usize);
    assert!(picture.rgba.chunks(4).any(|p| p[0] > 20), "something is seen");
}

/// What cannot be drawn is told in one sentence, and takes neither the device nor what lies on it.
#[test]
fn a_refused_scene_leaves_the_device_as_it_is() {
    let Some(bench) = Bench::new() else { return };
    bench.still(&large());
    let scene = small();
    let before = bench.still(&scene);
    assert!(before.uploads > 1, "a new device would begin to count anew");
    let mut moved = scene.clone();
    moved.layers[0].placement = DAffine3::from_translation(DVec3::X);
    bench.request(&moved, SIZE, rest());
    let start = Instant::now();
    let sentence = loop {
        match bench.engine.state() {
            EngineState::Failed(sentence) => break sentence,
            state => assert!(start.elapsed() < PATIENCE, "{state:?}"),
        }
    };
    assert!(sentence.starts_with("expected every layer where its file says"), "{sentence}");
    assert!(bench.engine.take_picture().is_none());
    let after = bench.still(&scene);
    assert_eq!((after.uploads, after.pipelines), (before.uploads, before.pipelines));
    assert_eq!(after.light, before.light);
}

#[test]
fn a_lost_device_is_made_anew_and_draws_the_same_picture() {
    let Some(bench) = Bench::new() else { return };
    bench.request(&small(), SIZE, rest());
    let before = bench.until_full(SIZE);
    bench.engine.lose_device();
    bench.request(&small(), SIZE, rest());
    let after = bench.until_full(SIZE);
    let last = |pictures: &[Arc<Picture>]| pictures[pictures.len() - 1].rgba.clone();
    assert!(last(&before) == last(&after), "another picture");
    bench.engine.lose_device();
    let still = bench.still(&small());
    assert!(still.rgba == last(&before), "another picture");
}

/// A driver may tell of it while work is waited for, where `wgpu` panics: the device is made anew there, too.
#[test]
fn a_device_that_is_lost_in_a_wait_is_made_anew_for_stills_and_frames() {
    let Some(bench) = Bench::new() else { return };
    let before = bench.still(&small());
    bench.engine.lose_device_in_wait();
    assert!(bench.still(&small()).rgba == before.rgba, "another picture");
    bench.engine.lose_device_in_wait();
    bench.request(&small(), SIZE, rest());
    let after = bench.until_full(SIZE);
    assert!(after[after.len() - 1].rgba == before.rgba, "another picture");
}

/// Whoever waits is told, what waits behind is drawn, and nothing says "Drawing" for ever.
#[test]
fn after_a_panic_the_queued_still_and_the_next_frame_arrive() {
    let Some(bench) = Bench::new() else { return };
    bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle);
    let engine = Arc::new(bench.engine);
    engine.panic_at_next();
    let (done, is_done) = mpsc::channel();
    for _ in 0..2 {
        let (engine, done) = (Arc::clone(&engine), done.clone());
        std::thread::spawn(move || {
            let still = engine.still(still_request(&small(), SIZE), &Ticket::new());
            done.send(still.map(|still| still.rgba)).expect("somebody waits");
        });
    }
    let stills = [0, 1].map(|_| is_done.recv_timeout(PATIENCE).expect("it ends"));
    assert_eq!(stills.iter().filter(|still| still.is_ok()).count(), 1);
    let ends = |is_end: &dyn Fn(&EngineState) -> bool| {
        let start = Instant::now();
        while !is_end(&engine.state()) {
            assert!(start.elapsed() < PATIENCE, "{:?}", engine.state());
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    let frame = || FrameRequest { scene: small(), size: SIZE, effort: rest() };
    // Nothing is under way, nor said of what was: else the next failure could be that of the stills, and the one after it the
    // frame's.
    engine.request(frame());
    let start = Instant::now();
    while engine.take_picture().is_none_or(|picture| !picture.report.level.is_full()) {
        assert!(start.elapsed() < PATIENCE, "{:?}", engine.state());
        std::thread::sleep(Duration::from_millis(2));
    }
    ends(&|state| *state == EngineState::Idle);
    // A frame that fails so is told, and the next one is drawn.
    engine.panic_at_next();
    engine.request(frame());
    ends(
        &|state| matches!(state, EngineState::Failed(sentence) if sentence.contains("found an error")),
    );
    engine.request(frame());
    ends(&|state| *state == EngineState::Idle);
    assert!(engine.take_picture().is_some_and(|picture| picture.report.level.is_full()));
}

/// Bringing a volume to the device takes as long as a picture: a newer wish ends it as soon.
#[test]
fn a_volume_that_nobody_waits_for_is_not_brought_to_the_device() {
    let Some(bench) = Bench::new() else { return };
    let heavy = scene(Lattice::unit([320, 320, 320]), DVec3::Z);
    let plan = Plan::of(&heavy, SIZE);
    let own = context(Wishes::default()).expect("there was one");
    let mut drawer = Drawer::new(Renderer::new(own));
    let uploads = |drawer: &Drawer| drawer.engines.made_gpu().map(Renderer::upload_count);
    let cancelled = Ticket::new();
    cancelled.cancel();
    assert_eq!(drawer.prepare(&plan, &cancelled), Err(DrawError::Interrupted));
    assert_eq!(uploads(&drawer), Some(0));
    assert_eq!(drawer.prepare(&plan, &Ticket::new()), Ok(()));
    assert_eq!(uploads(&drawer), Some(1), "what was interrupted can be begun anew");

    // A picture beside the one on the screen, once nobody wants it.
    let first = {
        bench.request(&small(), SIZE, rest());
        let mut seen = bench.until_full(SIZE);
        seen.pop().expect("a picture")
    };
    let before = bench.still(&small()).uploads;
    bench.engine.request_second(Some(SecondRequest { scene: heavy, size: SIZE, first }));
    bench.pictures_until(|bench, _| matches!(bench.engine.state(), EngineState::Drawing(_)));
    bench.engine.request_second(None);
    bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle);
    // Its own volume comes anew, as room was made for the other one.
    assert_eq!(bench.still(&small()).uploads, before + 1);
}

#[test]
fn the_same_scene_gives_the_same_bits_whatever_came_between() {
    let (Some(bench), Some(other)) = (Bench::new(), Bench::new()) else { return };
    let first = bench.still(&small());
    bench.still(&large());
    let second = bench.still(&small());
    assert!(first.light == second.light, "after another scene");
    assert!(first.light == other.still(&small()).light, "on another device");
    bench.request(&small(), SIZE, rest());
    let frames = bench.until_full(SIZE);
    assert!(frames[frames.len() - 1].rgba == first.rgba, "the frame is the still");
}

/// Blending in 16-bit floats loses 2⁻¹¹ a layer. Measured: max 5.4e-3, rmse 6.7e-4, bias −3.4e-4.
#[test]
fn without_float32_blending_and_timestamps_pictures_are_as_near_as_stated() {
    let Some(bench) =
        Bench::with(Wishes { float32_blending: false, timestamps: false, ..Wishes::default() })
    else {
        return;
    };
    let expected = reference(&small(), SIZE, Rays::Local);
    let narrow = bench.still(&small());
    let found = wide(&narrow.light);
    print_measured("16-bit blending", &found, &expected);
    let within = Within { max_abs: 1e-2, rmse: 1.2e-3, bias: 6e-4 };
    assert_eq!(fault(&found, &expected, within), None);
    let Some(mut drawer) = drawer() else { return };
    let (full, _) = drawn(&mut drawer, &small(), SIZE, Rung::Full);
    assert!(fault(&found, &full, Within { max_abs: 1e-6, rmse: 1e-6, bias: 1e-6 }).is_some());
    let timed = StillRequest { time_passes: true, ..still_request(&small(), SIZE) };
    let still = bench.engine.still(timed, &Ticket::new()).expect("a still");
    assert_eq!(still.timer, Some(Timer::Wall));
}

/// One sentence: what was expected and found, no line break, no Rust.
#[track_caller]
fn is_a_sentence(text: &str) {
    let ok = text.contains("expected") && text.contains("found") && text.contains("; ");
    assert!(ok && !text.contains('\n') && text.len() < 300, "{text}");
}

#[test]
fn what_the_device_cannot_hold_is_one_sentence_and_the_next_request_works() {
    let Some(bench) = Bench::new() else { return };
    let long = Lattice::unit([70_000, 1, 1]);
    let mut too_long = small();
    too_long = with_field(too_long, volume(long, Samples::UInt8(vec![200; 70_000])));
    for (scene, size) in [(&too_long, SIZE), (&small(), [1_000_000, 8]), (&small(), [0, 5])] {
        bench.request(scene, size, rest());
        bench.pictures_until(|bench, _| matches!(bench.engine.state(), EngineState::Failed(_)));
        let EngineState::Failed(sentence) = bench.engine.state() else { panic!("no failure") };
        is_a_sentence(&sentence);
        let refused = bench.engine.still(still_request(scene, size), &Ticket::new());
        is_a_sentence(&refused.expect_err("refused").to_string());
        bench.request(&small(), SIZE, rest());
        bench.until_full(SIZE);
    }
}

#[test]
fn a_picture_of_one_pixel_is_drawn() {
    let Some(bench) = Bench::new() else { return };
    bench.request(&small(), [1, 1], rest());
    let pictures = bench.until_full([1, 1]);
    assert_eq!(pictures[pictures.len() - 1].rgba.len(), 4);
}

#[test]
fn dropping_the_engine_in_mid_draw_is_quick() {
    let Some(bench) = Bench::new() else { return };
    let scene = scene(Lattice::unit([160, 160, 160]), DVec3::Z);
    // In preparation, and in drawing.
    for pause_ms in [5, 400] {
        let Some(bench) = Bench::new() else { return };
        bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle);
        bench.request(&scene, [900, 900], rest());
        std::thread::sleep(Duration::from_millis(pause_ms));
        let start = Instant::now();
        drop(bench);
        println!("measured dropped in {:?}", start.elapsed());
        // A third of a second at most on two free cores; the picture takes several.
        assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    }
    drop(bench);
}

#[test]
fn a_frame_and_a_still_that_are_asked_for_together_both_arrive() {
    let Some(bench) = Bench::new() else { return };
    let scene = small();
    std::thread::scope(|scope| {
        // Before the device is there, so that all of them wait together.
        let stills = [0, 1].map(|_| scope.spawn(|| bench.still(&scene)));
        std::thread::sleep(Duration::from_millis(10));
        bench.request(&scene, SIZE, rest());
        bench.until_full(SIZE);
        for still in stills {
            assert_eq!(still.join().expect("no panic").size, SIZE);
        }
    });
    // A still that comes while a frame is refined takes its turn; the frame goes on after it.
    bench.request(&large(), [320, 200], rest());
    std::thread::sleep(Duration::from_millis(100));
    bench.still(&scene);
    bench.until_full([320, 200]);
}

/// A still takes its turn between two pieces; nothing that was finished is drawn again for it.
#[test]
fn a_still_makes_no_finished_picture_drawn_again() {
    let Some(bench) = Bench::new() else { return };
    let mut scene = large();
    scene.splat = SplatSettings::SHADE_FIRST;
    let effort = Effort::Rest {
        budget_ms: 20.0,
        ladder: Ladder::Subsampling,
        show_partial: false,
        converge_ms: 0.0,
        smooth_edges: false,
    };
    bench.request(&scene, [320, 200], effort);
    let mut pictures = bench.pictures_until(|_, seen| !seen.is_empty());
    // In the middle of the ladder.
    bench.still(&small());
    pictures.extend(bench.pictures_until(|_, seen| {
        seen.last().is_some_and(|picture| picture.report.level.is_full())
    }));
    bench.still(&small());
    pictures.extend(bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle));
    std::thread::sleep(Duration::from_millis(50));
    pictures.extend(bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle));
    let pictures = drawn_anew(pictures);
    let levels: Vec<_> = pictures.iter().map(|p| p.report.level).collect();
    let of = |is: fn(&LevelOfDetail) -> bool| levels.iter().copied().filter(is).count();
    let counts = (of(LevelOfDetail::is_coarse), of(LevelOfDetail::is_full));
    assert_eq!(counts, (1, 1), "{levels:?}");
}

fn exact(scene: Scene) -> Scene {
    Scene { splat: SplatSettings::EXACT, ..scene }
}

fn until_converged(converge_ms: f64) -> Effort {
    let ladder = Ladder::Octree;
    Effort::Rest { budget_ms: 20.0, ladder, show_partial: true, converge_ms, smooth_edges: false }
}

#[test]
fn the_ladder_ends_in_converged_slabs_which_are_those_of_a_still() {
    let Some(bench) = Bench::new() else { return };
    let scene = exact(small());
    let refine = Refine::Converged { most_slabs: 64.0 };
    let still = StillRequest { refine, ..still_request(&scene, SIZE) };
    let still = bench.engine.still(still, &Ticket::new()).expect("a still");
    // Too little for the whole picture, so that there is a preview to be checked.
    let Effort::Rest { ladder, show_partial, converge_ms, .. } = until_converged(f64::INFINITY)
    else {
        unreachable!("at rest")
    };
    let effort =
        Effort::Rest { budget_ms: 1.0, ladder, show_partial, converge_ms, smooth_edges: false };
    bench.request(&scene, SIZE, effort);
    let pictures = bench.pictures_until(|bench, seen| {
        !seen.is_empty() && bench.engine.state() == EngineState::Idle
    });
    let wakes = bench.wakes.load(Ordering::SeqCst);
    let last = pictures[pictures.len() - 1].clone();
    let refined = last.report.refined.expect("slabs were doubled");
    println!("measured {:?}, as a still {:?}", refined.convergence, still.convergence);
    assert_eq!(Some(refined.convergence), still.convergence);
    assert!(refined.convergence.is_reached() && refined.left_ms == 0.0, "{refined:?}");
    assert!(last.rgba == still.rgba, "another picture than the still");
    assert_eq!(last.report.level, LevelOfDetail::Refined(refined.convergence));
    assert_eq!(last.report.progress, 1.0);
    let checked = last.report.checked.expect("what the full picture found of its preview");
    assert!(checked.estimated_rmse > 0.0, "{checked:?}");
    assert!(last.report.remaining_rmse.is_some_and(|rmse| rmse < 1e-3), "{:?}", last.report);
    let pictures = drawn_anew(pictures);
    let reports: Vec<_> = pictures.iter().map(|p| &p.report).collect();
    assert!(reports.windows(2).all(|w| w[0].progress <= w[1].progress), "{reports:?}");
    // The bench may miss pictures, but what it sees is in order, and none is shown in part.
    let before_last = pictures.iter().rev().skip(1);
    assert!(before_last.clone().all(|p| p.report.progress < 1.0), "{reports:?}");
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(bench.wakes.load(Ordering::SeqCst), wakes, "woken while idle");
}

#[test]
fn it_ends_in_full_where_slabs_would_take_too_long_are_not_wanted_or_are_none() {
    let Some(bench) = Bench::new() else { return };
    let ends = |scene: &Scene, converge_ms| {
        bench.request(scene, SIZE, until_converged(converge_ms));
        let pictures = bench.until_full(SIZE);
        let report = pictures[pictures.len() - 1].report.clone();
        assert_eq!(report.progress, 1.0);
        report.refined
    };
    let scene = exact(small());
    let too_long = ends(&scene, 0.01).expect("it could be done");
    assert!(too_long.left_ms > 0.01 && too_long.convergence.last_difference.is_none());
    assert_eq!(ends(&scene, 0.0), None);
    assert_eq!(ends(&small(), f64::INFINITY), None, "every sample has no slabs");
}

#[test]
fn doubling_slabs_stops_for_the_hand() {
    let Some(bench) = Bench::new() else { return };
    let scene = exact(large());
    bench.request(&scene, [400, 300], until_converged(f64::INFINITY));
    bench.pictures_until(|_, seen| seen.iter().any(|p| p.report.level.is_full()));
    // In the middle of the first doubling.
    std::thread::sleep(Duration::from_millis(30));
    let turned = Scene { camera: scene.camera.orbited(0.1, 0.0), ..scene };
    let asked = Instant::now();
    bench.request(&turned, [400, 300], Effort::Moving { budget_ms: 10.0 });
    let pictures = bench.pictures_until(|bench, seen| {
        !seen.is_empty() && bench.engine.state() == EngineState::Idle
    });
    println!("measured answer after {:?}", asked.elapsed());
    let levels: Vec<_> = pictures.iter().map(|p| p.report.level).collect();
    // A quick device has doubled them before the hand comes.
    let done = usize::from(voxsplat::gpu::has_hardware() && !levels[0].is_coarse());
    assert!(levels[done..].iter().all(LevelOfDetail::is_coarse), "{levels:?}");
}

#[test]
fn another_effort_for_the_same_view_shows_nothing_coarse_again() {
    let Some(bench) = Bench::new() else { return };
    let scene = exact(small());
    bench.request(&scene, SIZE, until_converged(0.0));
    let mut full = bench.until_full(SIZE);
    full.drain(..full.len() - 1);
    bench.request(&scene, SIZE, until_converged(f64::INFINITY));
    let pictures = bench.pictures_until(|bench, seen| {
        seen.last().is_some_and(|p| p.report.progress >= 1.0)
            && bench.engine.state() == EngineState::Idle
    });
    let levels: Vec<_> = pictures.iter().map(|p| p.report.level).collect();
    assert!(!levels.iter().any(LevelOfDetail::is_coarse), "{levels:?}");

    // Back to full, or on where the time does not suffice: from memory.
    for (converge_ms, is_noted) in [(0.0, false), (0.01, true)] {
        bench.request(&scene, SIZE, until_converged(converge_ms));
        let again = drawn_anew(bench.until_full(SIZE));
        let [again] = &again[..] else { panic!("{} pictures", again.len()) };
        assert_eq!(again.report.refined.is_some(), is_noted);
        full.extend([Arc::clone(again)]);
    }
    let [first, .., last] = &full[..] else { panic!("nothing") };
    assert!(first.rgba == last.rgba && first.report.progress == 1.0);
    assert_eq!(full[1].report.frame_ms, last.report.frame_ms, "nothing was drawn for it");
}

/// Where a budget affords every ray, its picture is the finished one: after the hand nothing is drawn again.
#[test]
fn a_budget_for_every_ray_ends_in_full_at_once() {
    let Some(bench) = Bench::new() else { return };
    let scene = exact(small());
    bench.request(&scene, SIZE, until_converged(0.0));
    bench.until_full(SIZE);
    let turned = Scene { camera: scene.camera.orbited(0.3, 0.1), ..scene };
    bench.request(&turned, SIZE, Effort::Moving { budget_ms: 10_000.0 });
    let moving = bench.until_full(SIZE);
    assert!(moving.iter().all(|p| p.report.remaining_rmse.is_none()), "the hand waits for nothing");
    let [moved] = &moving[..] else { panic!("{} pictures", moving.len()) };
    assert_eq!((moved.report.progress, moved.report.estimated_rmse), (1.0, None));
    assert!(moved.size == SIZE && moved.rgba == bench.still(&turned).rgba);
    bench.request(&turned, SIZE, until_converged(0.0));
    let told = bench.until_full(SIZE);
    assert!(told.iter().any(|p| p.report.remaining_rmse.is_some()), "what it is off by is told");
    let again = drawn_anew(told);
    let [again] = &again[..] else { panic!("{} pictures", again.len()) };
    assert_eq!(again.report.frame_ms, moved.report.frame_ms, "nothing was drawn for it");

    // And at rest, of a view that nobody has seen.
    let beyond = Scene { camera: turned.camera.orbited(0.3, 0.1), ..turned };
    let effort = Effort::Rest {
        budget_ms: 10_000.0,
        ladder: Ladder::Octree,
        show_partial: false,
        converge_ms: 0.0,
        smooth_edges: false,
    };
    bench.request(&beyond, SIZE, effort);
    let rested = drawn_anew(bench.until_full(SIZE));
    assert_eq!(rested.len(), 1, "{:?}", rested.iter().map(|p| p.report.level).collect::<Vec<_>>());
    assert!(rested[0].rgba == bench.still(&beyond).rgba);
}

#[test]
fn another_volume_is_not_kept_waiting_by_the_first_ones_preparation() {
    let Some(bench) = Bench::new() else { return };
    bench.pictures_until(|bench, _| bench.engine.state() == EngineState::Idle);
    let heavy = scene(Lattice::unit([400, 400, 400]), DVec3::Z);
    let start = Instant::now();
    bench.request(&heavy, [900, 900], rest());
    std::thread::sleep(Duration::from_millis(30));
    bench.request(&small(), SIZE, rest());
    bench.until_full(SIZE);
    let switched = start.elapsed();
    let start = Instant::now();
    bench.request(&heavy, [900, 900], rest());
    bench.pictures_until(|_, seen| seen.iter().any(|p| p.requested_size == [900, 900]));
    println!("measured switched in {switched:?}, the heavy one takes {:?}", start.elapsed());
    assert!(switched < start.elapsed(), "{switched:?} is not less than {:?}", start.elapsed());
}
