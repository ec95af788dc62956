//! When the engine is asked for what: once for every change, then once more at rest, then never.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use eframe::egui::Context;

use super::settings::Settings;
use crate::scene::{Scene, SplatSettings};
use crate::task::engine::{Effort, FrameRequest};

/// How long a view must stay unchanged before it counts as resting, seconds.
pub const REST_AFTER_SECS: f64 = 0.12;
/// The same after a hand has let go, which has ended its movement; wheels and keys end none.
const REST_AFTER_RELEASE_SECS: f64 = 0.04;
/// And how much longer while a hand holds it still, and looks.
const HELD_SECS: f64 = 0.4;
/// How long a pass may wait for the picture of the change it has just posted.
///
/// A pass of the interface costs as much as a coarse picture on a software adapter, so while the
/// hand moves it is better to show that picture in this pass than to run another for it. After
/// an edit 256³ samples are classified anew, 22 to 25 ms on llvmpipe's two cores: pictures of up to 20 ms
/// still come in time.
pub const WAIT_FOR_PICTURE: Duration = Duration::from_millis(45);
/// Least time between two repaints for the engine's sake while the view rests.
const REPAINT_AT_REST: Duration = Duration::from_millis(50);

/// Share of the time between two animated pictures that drawing one may take: the rest is the
/// interface's.
const ANIMATION_SHARE: f64 = 0.75;
/// The same where full quality is asked for: more than any takes.
const FULL_ANIMATION_MS: f64 = 60_000.0;
/// What drawing one may take in any case, milliseconds, while no hand moves the view: in less, on two cores, marks run into one another
/// (the carotid's, its volume faded, 1065 × 817: a fog in 33 ms, streaks in 83).
const LEAST_ANIMATION_MS: f64 = 80.0;

/// What the next pass should do.
#[derive(Debug, Default)]
pub struct Decision {
    /// To be posted now.
    pub post: Option<FrameRequest>,
    /// Seconds after which to decide again, should nothing else happen before.
    pub again_in_secs: Option<f64>,
}

/// Remembers what was asked for, and when the view last changed.
#[derive(Debug, Default)]
pub struct Pacing {
    posted: Option<FrameRequest>,
    /// When a view that moves counts as resting, if nothing changes before.
    rests_at_secs: f64,
    /// Whether something was held at the last decision.
    was_held: bool,
    /// The view is to converge however long that takes, until it changes.
    insists: bool,
    /// Modes are being judged: each is shown as it is, and not refined further.
    judging: bool,
    /// Milliseconds from one animated picture to the next, while there are any.
    animation_ms: Option<f64>,
}

impl Pacing {
    /// Decides for a scene at `size` physical pixels, at `now_secs`; `held` while a mouse button
    /// holds something.
    pub fn decide(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        settings: &Settings,
        now_secs: f64,
        held: bool,
    ) -> Decision {
        let Some(posted) = &self.posted else {
            return self.post(
                scene,
                size,
                self.effort_at_rest(scene, settings),
                now_secs + REST_AFTER_SECS,
            );
        };
        if !posted.scene.has_same_volume(scene) {
            self.insists = false;
            // Nothing moves: the ladder's own first rung is the coarse picture.
            return self.post(
                scene,
                size,
                self.effort_at_rest(scene, settings),
                now_secs + REST_AFTER_SECS,
            );
        }
        if posted.size != size || !posted.scene.makes_same_picture(scene) {
            self.insists = false;
            self.was_held = held;
            return self.post(
                scene,
                size,
                self.effort_while_moving(scene, settings, held),
                now_secs + REST_AFTER_SECS,
            );
        }
        let moving = matches!(posted.effort, Effort::Moving { .. });
        if std::mem::replace(&mut self.was_held, held) && !held {
            self.rests_at_secs = self.rests_at_secs.min(now_secs + REST_AFTER_RELEASE_SECS);
        }
        let rests_at_secs = self.rests_at_secs + if held { HELD_SECS } else { 0.0 };
        let settled = !moving || now_secs >= rests_at_secs;
        let effort = if settled {
            self.effort_at_rest(scene, settings)
        } else {
            self.effort_while_moving(scene, settings, held)
        };
        if posted.effort != effort {
            let rests_at_secs = self.rests_at_secs;
            return self.post(scene, size, effort, rests_at_secs);
        }
        let again_in_secs = moving.then_some((rests_at_secs - now_secs).max(0.0));
        Decision { post: None, again_in_secs }
    }

    /// Whether the last request was for a moving view.
    pub fn is_moving(&self) -> bool {
        self.posted.as_ref().is_some_and(|p| matches!(p.effort, Effort::Moving { .. }))
    }

    /// From now on the view converges however long that takes, until it changes.
    pub fn insist(&mut self) {
        self.insists = true;
    }

    /// Whether modes are being judged, and so shown as they are.
    pub fn is_judging(&self) -> bool {
        self.judging
    }

    /// See [`Pacing::is_judging`].
    pub fn set_judging(&mut self, judging: bool) {
        self.judging = judging;
    }

    /// While something moves by itself, a picture may take as long as it is shown.
    pub fn set_animation(&mut self, every_ms: Option<f64>) {
        self.animation_ms = every_ms;
    }

    /// The picture on screen is the `full` that was asked for, and is to stay: where no more than
    /// that is wanted from now on, nothing need be asked for, unless its edges were smoothed.
    pub fn keep_full(&mut self, is_smooth: bool) {
        if let Some(FrameRequest { effort, .. }) = &mut self.posted
            && let Effort::Rest { converge_ms, smooth_edges, .. } = effort
        {
            *converge_ms = 0.0;
            *smooth_edges &= is_smooth;
        }
    }

    fn effort_at_rest(&self, scene: &Scene, settings: &Settings) -> Effort {
        let mut effort = settings.effort_at_rest();
        if let Effort::Rest { converge_ms, smooth_edges, .. } = &mut effort {
            // What modes differ by would be hidden.
            *smooth_edges &= !self.judging;
            // Who chooses fewer slabs than usual wants to see what they make.
            let is_chosen_coarse =
                scene.splat.slabs_per_voxel < SplatSettings::EXACT.slabs_per_voxel;
            *converge_ms = match () {
                () if self.judging => 0.0,
                () if self.insists => f64::INFINITY,
                () if is_chosen_coarse => 0.0,
                () => *converge_ms,
            };
        }
        effort
    }

    fn effort_while_moving(&self, scene: &Scene, settings: &Settings, held: bool) -> Effort {
        let animated = self.animation_ms.map_or(0.0, |ms| ms * ANIMATION_SHARE);
        match settings.effort_while_moving() {
            Effort::Rest { .. } if self.animation_ms.is_none() => {
                self.effort_at_rest(scene, settings)
            }
            // An animation never ends: each of its pictures is one of a moving view, however long it takes.
            Effort::Rest { .. } => Effort::Moving { budget_ms: FULL_ANIMATION_MS },
            Effort::Moving { budget_ms } if self.animation_ms.is_some() && !held => {
                Effort::Moving { budget_ms: budget_ms.max(animated).max(LEAST_ANIMATION_MS) }
            }
            Effort::Moving { budget_ms } => Effort::Moving { budget_ms: budget_ms.max(animated) },
        }
    }

    fn post(
        &mut self,
        scene: &Scene,
        size: [u32; 2],
        effort: Effort,
        rests_at_secs: f64,
    ) -> Decision {
        let request = FrameRequest { scene: scene.clone(), size, effort };
        self.posted = Some(request.clone());
        self.rests_at_secs = rests_at_secs;
        let moving = matches!(effort, Effort::Moving { .. });
        Decision { post: Some(request), again_in_secs: moving.then_some(REST_AFTER_SECS) }
    }
}

/// Turns the engine's news into repaints: at once while the hand moves, a few times a second else.
#[derive(Debug, Default)]
struct NewsGate {
    last_repaint: Option<Instant>,
}

impl NewsGate {
    /// How long the repaint for news that arrive `now` is to be put off.
    fn delay(&mut self, now: Instant, moving: bool) -> Duration {
        let due = match self.last_repaint {
            Some(pending) if !moving && pending > now => pending,
            Some(last) if !moving => now.max(last + REPAINT_AT_REST),
            _ => now,
        };
        self.last_repaint = Some(due);
        due - now
    }
}

/// The engine's line to the window: announces news, and lets a pass wait for them.
#[derive(Debug)]
pub struct News {
    ctx: Context,
    state: Mutex<NewsState>,
    arrived: Condvar,
}

#[derive(Debug, Default)]
struct NewsState {
    fresh: bool,
    moving: bool,
    awaited: bool,
    gate: NewsGate,
}

impl News {
    /// News for the window of this context.
    pub fn new(ctx: &Context) -> Self {
        Self { ctx: ctx.clone(), state: Mutex::default(), arrived: Condvar::new() }
    }

    /// Called from the engine's thread: there is a picture or a new state.
    pub fn announce(&self) {
        let mut state = self.state();
        state.fresh = true;
        if state.awaited {
            // The pass that waits shows it.
            self.arrived.notify_all();
            return;
        }
        let moving = state.moving;
        let delay = state.gate.delay(Instant::now(), moving);
        drop(state);
        self.ctx.request_repaint_after(delay);
    }

    /// Whether repaints are to follow the news at once.
    pub fn set_moving(&self, moving: bool) {
        self.state().moving = moving;
    }

    /// What came before this is no news any more.
    pub fn forget(&self) {
        self.state().fresh = false;
    }

    /// Waits until what is waited for `came`, at most `limit`; whether it has. Other news, that the
    /// engine has begun say, are no reason to go on without it.
    pub fn wait_for(&self, limit: Duration, mut came: impl FnMut() -> bool) -> bool {
        let until = Instant::now() + limit;
        while self.wait(until.saturating_duration_since(Instant::now())) {
            if came() {
                return true;
            }
        }
        false
    }

    /// Waits until there are news, at most `limit`; whether there are.
    fn wait(&self, limit: Duration) -> bool {
        let mut state = self.state();
        state.awaited = true;
        let waited = self.arrived.wait_timeout_while(state, limit, |state| !state.fresh);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.awaited = false;
        std::mem::take(&mut state.fresh)
    }

    fn state(&self) -> MutexGuard<'_, NewsState> {
        // Plain values: a panic elsewhere leaves them whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use std::sync::Arc;

    use crate::scene::{Background, Look, SampleSource, Sampled, framing_camera};
    use crate::transfer::{ColourMap, ColourSource, TransferFunction};
    use crate::volume::{Lattice, Samples, ScalarVolume};

    fn scene() -> Scene {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2, 2, 2]), samples).unwrap();
        let camera = framing_camera(&volume.lattice, DVec3::Y, DVec3::Z);
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 7.0] };
        let transfer = TransferFunction::of(vec![(0.0, 0.0), (7.0, 1.0)], colour);
        let field = (Sampled::Volume(Arc::new(volume)), Look::Field(transfer));
        Scene { background: Background::Transparent, ..Scene::seen_by(camera) }.with(field)
    }

    fn effort(decision: &Decision) -> Option<Effort> {
        decision.post.as_ref().map(|request| request.effort)
    }

    #[test]
    fn a_change_asks_once_while_moving_and_once_at_rest_then_nothing() {
        let (mut pacing, mut scene, settings) = (Pacing::default(), scene(), Settings::default());
        let first = pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        assert_eq!(effort(&first), Some(settings.effort_at_rest()));
        assert_eq!(first.again_in_secs, None);

        scene.camera = scene.camera.orbited(0.1, 0.0);
        let moved = pacing.decide(&scene, [10, 10], &settings, 1.0, true);
        assert_eq!(effort(&moved), Some(settings.effort_while_moving()));
        let held = pacing.decide(&scene, [10, 10], &settings, 1.01, true);
        let wait = held.again_in_secs.unwrap();
        assert!(held.post.is_none() && (wait - 0.51).abs() < 1e-9, "still held: {held:?}");
        let released = pacing.decide(&scene, [10, 10], &settings, 1.02, false);
        assert!(released.post.is_none());
        let wait = released.again_in_secs.unwrap();
        assert!((wait - 0.04).abs() < 1e-9, "{wait}");
        let released = pacing.decide(&scene, [10, 10], &settings, 1.02 + wait, false);
        assert_eq!(effort(&released), Some(settings.effort_at_rest()));
        let idle = pacing.decide(&scene, [10, 10], &settings, 9.0, false);
        assert!(idle.post.is_none() && idle.again_in_secs.is_none(), "{idle:?}");
    }

    #[test]
    fn a_view_that_is_held_still_for_long_rests_until_it_is_moved_on() {
        let (mut pacing, mut scene, settings) = (Pacing::default(), scene(), Settings::default());
        let decide = |pacing: &mut Pacing, scene: &Scene, secs| {
            effort(&pacing.decide(scene, [10, 10], &settings, secs, true))
        };
        pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        for (moved_at, looks_at) in [(1.0, 1.53), (2.0, 2.53)] {
            scene.camera = scene.camera.orbited(0.1, 0.0);
            let moving = Some(settings.effort_while_moving());
            assert_eq!(decide(&mut pacing, &scene, moved_at), moving);
            assert_eq!(decide(&mut pacing, &scene, looks_at - 0.03), None);
            assert_eq!(decide(&mut pacing, &scene, looks_at), Some(settings.effort_at_rest()));
        }
        let released = pacing.decide(&scene, [10, 10], &settings, 3.0, false);
        assert!(released.post.is_none() && released.again_in_secs.is_none(), "{released:?}");
    }

    #[test]
    fn what_plays_has_time_for_its_marks_unless_a_hand_moves_it() {
        let budget = |settings: &Settings, held: bool| {
            let (mut pacing, mut scene) = (Pacing::default(), scene());
            pacing.decide(&scene, [10, 10], settings, 0.0, false);
            pacing.set_animation(Some(50.0));
            scene.phase = 0.3;
            match effort(&pacing.decide(&scene, [10, 10], settings, 1.0, held)) {
                Some(Effort::Moving { budget_ms }) => budget_ms,
                other => panic!("{other:?}"),
            }
        };
        let settings = Settings::default();
        assert_eq!(budget(&settings, false), LEAST_ANIMATION_MS);
        assert_eq!(budget(&settings, true), settings.budget_ms.max(37.5));
        let full = Settings { full_quality_while_moving: true, ..settings };
        assert_eq!([true, false].map(|held| budget(&full, held)), [FULL_ANIMATION_MS; 2]);
    }

    #[test]
    fn a_change_without_a_held_button_rests_after_the_delay() {
        let (mut pacing, mut scene, settings) = (Pacing::default(), scene(), Settings::default());
        pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        scene.camera.parallel_scale *= 0.9;
        pacing.decide(&scene, [10, 10], &settings, 1.0, false);
        let early = pacing.decide(&scene, [10, 10], &settings, 1.05, false);
        assert!(early.post.is_none());
        let wait = early.again_in_secs.unwrap();
        assert!((wait - 0.07).abs() < 1e-9, "{wait}");
        let late = pacing.decide(&scene, [10, 10], &settings, 1.05 + wait, false);
        assert_eq!(effort(&late), Some(settings.effort_at_rest()));
    }

    #[test]
    fn full_quality_while_moving_never_asks_for_less() {
        let settings = Settings { full_quality_while_moving: true, ..Settings::default() };
        let (mut pacing, mut scene) = (Pacing::default(), scene());
        pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        scene.camera = scene.camera.orbited(0.1, 0.0);
        let moved = pacing.decide(&scene, [10, 10], &settings, 1.0, true);
        assert_eq!(effort(&moved), Some(settings.effort_at_rest()));
        assert!(pacing.decide(&scene, [10, 10], &settings, 2.0, false).post.is_none());
    }

    #[test]
    fn another_ladder_asks_again_at_rest() {
        let (mut pacing, scene, mut settings) = (Pacing::default(), scene(), Settings::default());
        pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        settings.ladder = crate::task::engine::Ladder::Subsampling;
        let asked = pacing.decide(&scene, [10, 10], &settings, 1.0, false);
        assert_eq!(effort(&asked), Some(settings.effort_at_rest()));
        assert!(pacing.decide(&scene, [10, 10], &settings, 2.0, false).post.is_none());
    }

    #[test]
    fn slabs_are_doubled_for_as_long_as_is_wanted_and_only_for_this_view() {
        let converge_ms = |decision: &Decision| match effort(decision) {
            Some(Effort::Rest { converge_ms, .. }) => Some(converge_ms),
            _ => None,
        };
        let (mut pacing, mut scene, mut settings) =
            (Pacing::default(), scene(), Settings { smooth_edges: false, ..Settings::default() });
        let decide = |pacing: &mut Pacing, scene: &Scene, settings: &Settings, secs| {
            converge_ms(&pacing.decide(scene, [10, 10], settings, secs, false))
        };
        let within = Some(crate::app::settings::CONVERGE_WITHIN_MS);
        assert_eq!(decide(&mut pacing, &scene, &settings, 0.0), within);
        pacing.insist();
        assert_eq!(decide(&mut pacing, &scene, &settings, 1.0), Some(f64::INFINITY));
        assert_eq!(decide(&mut pacing, &scene, &settings, 2.0), None, "asked once");
        scene.camera = scene.camera.orbited(0.1, 0.0);
        assert_eq!(decide(&mut pacing, &scene, &settings, 3.0), None, "it moves");
        assert_eq!(decide(&mut pacing, &scene, &settings, 4.0), within, "another view");
        pacing.set_judging(true);
        assert_eq!(decide(&mut pacing, &scene, &settings, 5.0), Some(0.0));
        pacing.set_judging(false);
        settings.converge = false;
        assert_eq!(decide(&mut pacing, &scene, &settings, 6.0), None, "both end in full");
        settings.converge = true;
        assert_eq!(decide(&mut pacing, &scene, &settings, 7.0), within);
        scene.splat.slabs_per_voxel = 0.5;
        decide(&mut pacing, &scene, &settings, 8.0);
        assert_eq!(decide(&mut pacing, &scene, &settings, 9.0), Some(0.0), "chosen to be coarse");
    }

    /// Modes are judged without smooth edges: a picture that has such is drawn anew, and no other one is.
    #[test]
    fn what_is_judged_is_asked_for_again_only_where_its_edges_were_smoothed() {
        let (scene, settings) = (scene(), Settings { converge: false, ..Settings::default() });
        for is_smooth in [false, true] {
            let mut pacing = Pacing::default();
            pacing.decide(&scene, [10, 10], &settings, 0.0, false);
            pacing.keep_full(is_smooth);
            pacing.set_judging(true);
            let asked = pacing.decide(&scene, [10, 10], &settings, 1.0, false);
            assert_eq!(effort(&asked).is_some(), is_smooth);
            if let Some(effort) = effort(&asked) {
                assert!(matches!(effort, Effort::Rest { smooth_edges: false, .. }), "{effort:?}");
            }
            pacing.set_judging(false);
            let again = effort(&pacing.decide(&scene, [10, 10], &settings, 2.0, false));
            assert!(matches!(again, Some(Effort::Rest { smooth_edges: true, .. })), "{again:?}");
        }
    }

    #[test]
    fn every_part_of_a_scene_counts_as_a_change() {
        let base = scene();
        let changes: [fn(&mut Scene); 5] = [
            |s| s.inside.clip.faces = crate::scene::CutFaces::Coloured,
            |s| s.transfer_mut().unwrap().opacity[0].1 = 0.5,
            |s| s.splat.extent = Some(1.0),
            |s| s.camera.parallel_scale *= 2.0,
            |s| s.background = Background::Colour(crate::core::Srgb8::WHITE),
        ];
        for (i, change) in changes.into_iter().enumerate() {
            let mut changed = base.clone();
            assert!(base.makes_same_picture(&changed));
            change(&mut changed);
            assert!(!base.makes_same_picture(&changed), "change {i}");
        }
        // How cuts are found is no part of a finished field, and all of one that is shaded first.
        for (splat, is_same) in [(SplatSettings::EXACT, true), (SplatSettings::SHADE_FIRST, false)]
        {
            let base = Scene { splat, ..scene() };
            let mut changed = base.clone();
            changed.splat.cut.balanced = !changed.splat.cut.balanced;
            assert_eq!(base.makes_same_picture(&changed), is_same, "{:?}", splat.visibility);
        }
    }

    #[test]
    fn news_at_rest_repaint_a_few_times_a_second_and_at_once_while_moving() {
        let mut gate = NewsGate::default();
        let start = Instant::now();
        assert_eq!(gate.delay(start, false), Duration::ZERO, "the first news is shown at once");
        let later = start + Duration::from_millis(20);
        assert_eq!(gate.delay(later, false), Duration::from_millis(30));
        let soon_after = start + Duration::from_millis(40);
        assert_eq!(gate.delay(soon_after, false), Duration::from_millis(10), "still the same");
        assert_eq!(gate.delay(later, true), Duration::ZERO);
    }

    #[test]
    fn a_waiting_pass_goes_on_waiting_when_other_news_come_first() {
        let news = Arc::new(News::new(&Context::default()));
        let engine = Arc::clone(&news);
        let (tell, told) = std::sync::mpsc::channel();
        let came = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let picture = Arc::clone(&came);
        let thread = std::thread::spawn(move || {
            engine.announce();
            // Not before the pass has looked for a picture in vain.
            told.recv().expect("the pass looks");
            picture.store(true, std::sync::atomic::Ordering::SeqCst);
            engine.announce();
        });
        let mut looks = 0;
        let found = news.wait_for(Duration::from_secs(10), || {
            looks += 1;
            let has_come = came.load(std::sync::atomic::Ordering::SeqCst);
            let _is_late = tell.send(());
            has_come
        });
        assert!(found && looks == 2, "{found} after {looks}");
        thread.join().expect("it ends");
        assert!(!news.wait_for(Duration::from_millis(5), || true), "nothing came");
    }

    #[test]
    fn a_waiting_pass_is_woken_by_news_and_gives_up_without() {
        let news = Arc::new(News::new(&Context::default()));
        assert!(!news.wait(Duration::from_millis(5)));
        let engine = Arc::clone(&news);
        let thread = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            engine.announce();
        });
        assert!(news.wait(Duration::from_secs(10)));
        thread.join().unwrap();
        assert!(!news.wait(Duration::ZERO), "news are news once");
    }

    #[test]
    fn another_size_is_a_change_and_another_volume_goes_straight_to_rest() {
        let (mut pacing, mut scene, settings) = (Pacing::default(), scene(), Settings::default());
        pacing.decide(&scene, [10, 10], &settings, 0.0, false);
        let resized = pacing.decide(&scene, [12, 10], &settings, 1.0, false);
        assert_eq!(effort(&resized), Some(settings.effort_while_moving()));
        assert_eq!(resized.post.unwrap().size, [12, 10]);
        let volume = Arc::new((**scene.volume().unwrap()).clone());
        let look = scene.layers[0].look.clone();
        scene.replace(0, SampleSource::default(), (Sampled::Volume(volume), look));
        let opened = pacing.decide(&scene, [12, 10], &settings, 1.01, false);
        assert_eq!(effort(&opened), Some(settings.effort_at_rest()));
    }
}
