//! The accuracy panel's job: modes measured one after the other, only while nothing else happens.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use eframe::egui::Context;

use super::job::{Ended, Job};
use crate::core::Ticket;
use crate::scene::{Scene, SplatSettings};

/// How long nothing must have happened before measuring begins or goes on, seconds.
pub const QUIET_SECS: f64 = 0.4;
/// Least time between two repaints for the job's sake.
const REPAINT_EVERY: Duration = Duration::from_millis(250);

/// One mode on the chart.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartPoint {
    /// What it is called.
    pub name: String,
    /// Wall milliseconds of a picture.
    pub ms: f64,
    /// PSNR to the exact picture, dB; +∞ where there is no difference.
    pub db: f64,
    /// Half the width of the 95 % confidence interval, dB; NaN where it is not known.
    pub ci: f64,
    /// The mode, where a scene can have it.
    pub settings: Option<SplatSettings>,
    /// Whether nothing at all is both quicker and better.
    pub on_front: bool,
    /// Why it could not be drawn, if it could not: its numbers mean nothing then.
    pub failed: Option<String>,
}

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stepped {
    /// There is more.
    More,
    /// That was all.
    Done,
    /// The ticket stopped it; it can be taken again.
    Stopped,
    /// It cannot go on; one sentence for people.
    Failed(String),
}

/// Measures modes step by step: the engine's sweep, or a stand-in in tests.
pub trait Measurer: Send {
    /// One step, which the ticket may stop.
    fn step(&mut self, ticket: &Ticket) -> Stepped;
    /// What was found so far.
    fn points(&self) -> Vec<ChartPoint>;
    /// Share done, 0..=1.
    fn fraction(&self) -> f32;
}

/// Begins to measure a scene's modes at a size in pixels.
pub type StartMeasuring = Arc<dyn Fn(&Scene, [u32; 2]) -> Box<dyn Measurer> + Send + Sync>;

/// What the panel shows of it.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// Waits until the view rests.
    Waiting,
    /// Under way.
    Measuring,
    /// Everything is measured.
    Done,
    /// It cannot go on; one sentence for people.
    Failed(String),
}

/// A mode's point on the chart, and whether it is of the view on screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The point.
    pub point: ChartPoint,
    /// Otherwise it was measured in an earlier view of the same volume.
    pub is_of_this_view: bool,
}

/// The job, and what it has found.
pub struct Measuring {
    subject: Option<(Scene, [u32; 2])>,
    work: Work,
    found: Arc<Mutex<Found>>,
    quiet_since_secs: Option<f64>,
}

enum Work {
    /// Not begun, for this subject.
    None,
    Running(Job<Rest>),
    /// Stopped in the middle; goes on from there.
    Paused(Box<dyn Measurer>),
    Ended(Option<String>),
}

/// What a job hands back.
struct Rest {
    measurer: Box<dyn Measurer>,
    ended: Stepped,
}

#[derive(Debug, Default)]
struct Found {
    points: Vec<ChartPoint>,
    fraction: f32,
    /// Whether the points are of an earlier view.
    is_old: bool,
    /// What the points are of.
    of: Option<Scene>,
}

impl Default for Measuring {
    fn default() -> Self {
        Self { subject: None, work: Work::None, found: Arc::default(), quiet_since_secs: None }
    }
}

/// What the window is about to do with the panel.
pub struct Now<'a> {
    /// Whether the panel is open.
    pub open: bool,
    /// Whether the view rests and everything asked for is drawn.
    pub quiet: bool,
    /// What would be measured.
    pub scene: &'a Scene,
    /// At which size, pixels.
    pub size: [u32; 2],
    /// The time of the pass.
    pub secs: f64,
}

impl Measuring {
    /// Starts, stops and goes on as the window stands now.
    pub fn pace(&mut self, ctx: &Context, now: &Now<'_>, start: &StartMeasuring) {
        self.take_rest();
        let is_same = |(scene, size): &(Scene, [u32; 2])| {
            *size == now.size && makes_same_chart(scene, now.scene)
        };
        if !self.subject.as_ref().is_some_and(is_same) {
            // Dropping a job stops it.
            self.work = Work::None;
            self.subject = Some((now.scene.clone(), now.size));
            self.make_old();
        }
        if !now.open && !matches!(self.work, Work::Ended(_)) {
            // What is held of the device goes with it.
            self.work = Work::None;
        }
        if !now.open || !now.quiet {
            self.quiet_since_secs = None;
            if let Work::Running(job) = &self.work {
                job.cancel();
            }
            return;
        }
        let since = *self.quiet_since_secs.get_or_insert(now.secs);
        let missing_secs = QUIET_SECS - (now.secs - since);
        match &self.work {
            Work::Ended(_) | Work::Running(_) => {}
            _ if missing_secs > 0.0 => {
                ctx.request_repaint_after(Duration::from_secs_f64(missing_secs));
            }
            Work::None | Work::Paused(_) => self.go_on(ctx, start),
        }
    }

    /// Forgets what was found, so that it is measured again.
    pub fn start_over(&mut self) {
        self.work = Work::None;
        self.make_old();
    }

    /// Keeps what was found, as of an earlier view.
    fn make_old(&mut self) {
        // A job that was dropped may still write into the old place.
        let old = std::mem::take(&mut *lock(&self.found));
        let old = Found { fraction: 0.0, is_old: true, ..old };
        self.found = Arc::new(Mutex::new(old));
    }

    fn go_on(&mut self, ctx: &Context, start: &StartMeasuring) {
        let Some((scene, size)) = self.subject.clone() else { return };
        let paused = match std::mem::replace(&mut self.work, Work::None) {
            Work::Paused(measurer) => Some(measurer),
            _ => None,
        };
        let (start, again) = (Arc::clone(start), ctx.clone());
        if paused.is_none() {
            self.make_old();
        }
        let found = Arc::clone(&self.found);
        self.work = Work::Running(Job::start("accuracy", "Measuring", ctx, move |ticket| {
            let mut measurer = paused.unwrap_or_else(|| start(&scene, size));
            let mut announced: Option<Instant> = None;
            let ended = loop {
                let stepped = measurer.step(ticket);
                let points = measurer.points();
                {
                    let mut found = lock(&found);
                    found.fraction = measurer.fraction();
                    // Old points stay until there are new ones.
                    if !points.is_empty() {
                        (found.points, found.is_old) = (points, false);
                        found.of = Some(scene.clone());
                    }
                }
                match stepped {
                    Stepped::More if ticket.is_cancelled() => break Stepped::Stopped,
                    Stepped::More => {}
                    ended => break ended,
                }
                if announced.is_none_or(|at| at.elapsed() >= REPAINT_EVERY) {
                    announced = Some(Instant::now());
                    again.request_repaint();
                }
            };
            Rest { measurer, ended }
        }));
    }

    fn take_rest(&mut self) {
        let Work::Running(job) = &self.work else { return };
        let Some(ended) = job.poll() else { return };
        self.work = match ended {
            Ended::Finished(Rest { ended: Stepped::Done, .. }) => Work::Ended(None),
            Ended::Finished(Rest { ended: Stepped::Failed(reason), .. }) => {
                Work::Ended(Some(reason))
            }
            Ended::Finished(Rest { measurer, .. }) => Work::Paused(measurer),
            Ended::Lost => {
                Work::Ended(Some("Measuring stopped on a bug of the program".to_owned()))
            }
        };
    }

    /// Where it stands.
    pub fn state(&self) -> State {
        match &self.work {
            Work::None | Work::Paused(_) => State::Waiting,
            Work::Running(job) if job.is_cancelled() => State::Waiting,
            Work::Running(_) => State::Measuring,
            Work::Ended(None) => State::Done,
            Work::Ended(Some(reason)) => State::Failed(reason.clone()),
        }
    }

    /// Whether a job has been started and has not ended yet.
    pub fn is_running(&self) -> bool {
        matches!(self.work, Work::Running(_))
    }

    /// What was found, and whether it is of an earlier view.
    pub fn points(&self) -> (Vec<ChartPoint>, bool) {
        let found = lock(&self.found);
        (found.points.clone(), found.is_old)
    }

    /// Share done, 0..=1.
    pub fn fraction(&self) -> f32 {
        lock(&self.found).fraction
    }

    /// The point of a mode, if it was measured for this scene, perhaps seen otherwise.
    pub fn point_of(&self, scene: &Scene, mode: &SplatSettings) -> Option<Measured> {
        let found = lock(&self.found);
        found.of.as_ref().filter(|of| shows_same_data(of, scene))?;
        let mut measured = found.points.iter().filter(|point| point.failed.is_none());
        let point = measured.find(|point| is_of(point, mode)).cloned()?;
        Some(Measured { point, is_of_this_view: !found.is_old })
    }
}

/// Whether a point is the one of a mode.
pub fn is_of(point: &ChartPoint, mode: &SplatSettings) -> bool {
    point.settings.as_ref().is_some_and(|settings| super::modes::same_mode(settings, mode))
}

/// Whether two scenes show the same volume in the same way, from wherever.
fn shows_same_data(a: &Scene, b: &Scene) -> bool {
    // However far their marks have moved.
    a.has_same_layers(b)
        && a.shading == b.shading
        && a.inside == b.inside
        && a.opacity_unit_distance() == b.opacity_unit_distance()
}

/// Whether two scenes have the same chart: what is behind the volume, and the mode it is in, do not
/// matter.
fn makes_same_chart(a: &Scene, b: &Scene) -> bool {
    let splat = super::modes::with_unit_distance_of(a.splat, &b.splat);
    let unit_distance = a.opacity_unit_distance() == b.opacity_unit_distance();
    let moded = Scene { splat, background: a.background, ..b.clone() };
    unit_distance && Scene { splat, ..a.clone() }.makes_same_picture(&moded)
}

fn lock(found: &Mutex<Found>) -> MutexGuard<'_, Found> {
    // Replaced in whole values: a panic elsewhere leaves them whole.
    found.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The best mode within a time, or the quickest of all.
pub fn best_within(points: &[ChartPoint], ms: f64) -> Option<usize> {
    let front = front(points);
    let affordable = front.iter().rev().find(|&&i| points[i].ms <= ms * (1.0 + 1e-9));
    affordable.or(front.first()).copied()
}

/// The quickest mode with at least a level, or the best of all.
pub fn quickest_with(points: &[ChartPoint], db: f64) -> Option<usize> {
    let front = front(points);
    let good = front.iter().find(|&&i| points[i].db >= db - 1e-9);
    good.or(front.last()).copied()
}

/// The modes that a scene can have and that no other such mode beats in both time and level:
/// quickest first, and so worst first.
pub fn front(points: &[ChartPoint]) -> Vec<usize> {
    let can_be_chosen = |point: &ChartPoint| point.failed.is_none() && point.settings.is_some();
    let mut chosen: Vec<usize> =
        (0..points.len()).filter(|&index| can_be_chosen(&points[index])).collect();
    chosen.sort_by(|&a, &b| {
        let (a, b) = (&points[a], &points[b]);
        a.ms.total_cmp(&b.ms).then(b.db.total_cmp(&a.db))
    });
    let mut best = f64::NEG_INFINITY;
    chosen.retain(|&index| {
        let better = points[index].db > best;
        best = best.max(points[index].db);
        better
    });
    chosen
}

/// How good the estimates of coarse pictures turned out to be: estimate minus truth, dB.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EstimateRecord {
    /// Pictures checked.
    pub count: u32,
    /// Mean: above 0 where pictures were worse than thought.
    pub mean_db: f64,
    /// Sum of squared deviations from the mean (Welford).
    m2: f64,
}

impl EstimateRecord {
    /// Takes in one check.
    pub fn add(&mut self, off_db: f64) {
        if !off_db.is_finite() {
            return;
        }
        self.count += 1;
        let delta = off_db - self.mean_db;
        self.mean_db += delta / f64::from(self.count);
        self.m2 += delta * (off_db - self.mean_db);
    }

    /// Standard deviation, dB; `None` with fewer than two.
    pub fn spread_db(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.m2 / f64::from(self.count - 1)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(ms: f64, db: f64) -> ChartPoint {
        ChartPoint {
            name: format!("{ms} ms"),
            ms,
            db,
            ci: 0.1,
            settings: Some(SplatSettings::EXACT),
            on_front: false,
            failed: None,
        }
    }

    #[test]
    fn the_front_is_walked_by_time_and_by_level() {
        let mut points =
            vec![point(10.0, 20.0), point(50.0, 15.0), point(100.0, 40.0), point(30.0, 30.0)];
        points.push(ChartPoint { failed: Some("no".into()), ..point(1.0, 99.0) });
        // What cannot be chosen beats nothing that can.
        points.push(ChartPoint { settings: None, on_front: true, ..point(1.0, 98.0) });
        assert_eq!(front(&points), [0, 3, 2]);
        let within = |ms| best_within(&points, ms).map(|i| points[i].ms);
        assert_eq!(within(30.0), Some(30.0));
        assert_eq!(within(99.0), Some(30.0));
        assert_eq!(within(1e9), Some(100.0));
        assert_eq!(within(1.0), Some(10.0), "the quickest where nothing fits");
        let with = |db| quickest_with(&points, db).map(|i| points[i].ms);
        assert_eq!(with(15.0), Some(10.0));
        assert_eq!(with(21.0), Some(30.0));
        assert_eq!(with(90.0), Some(100.0), "the best where nothing is good enough");
        assert_eq!(best_within(&[], 5.0), None);
    }

    #[test]
    fn the_record_is_the_mean_and_the_spread() {
        let mut record = EstimateRecord::default();
        assert_eq!(record.spread_db(), None);
        for off in [1.0, 3.0, 5.0, f64::INFINITY, f64::NAN] {
            record.add(off);
        }
        assert_eq!((record.count, record.mean_db), (3, 3.0));
        assert!((record.spread_db().unwrap() - 2.0).abs() < 1e-12);
    }
}
