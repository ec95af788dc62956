//! What pixels show, found on a thread of its own: the newest question wins.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use glam::{DVec2, DVec3};

use crate::core::memory::{self, TooLarge};
use crate::kernel::Kernel;
pub use crate::reference::{Met, Point, ProbedVector, Seen, VectorPlace};
use crate::reference::{Probe, seen_alone};
use crate::scene::{AlongRay, Scene};

/// A ray's first visible point is where it has gathered this much opacity, unless one says otherwise.
pub const FIRST_SEEN: f64 = 0.1;

/// A question.
#[derive(Debug, Clone)]
pub struct Look {
    /// What is seen.
    pub scene: Scene,
    /// Size of its picture in pixels.
    pub size: [u32; 2],
    /// A pixel of it, from the upper left corner; the ray goes through its middle.
    pub pixel: [u32; 2],
    /// How much opacity the ray is to have gathered, in 0..1.
    pub share: f64,
}

impl Look {
    /// Whether two have the same answer.
    pub fn is_same(&self, other: &Self) -> bool {
        let Self { scene, size, pixel, share } = self;
        scene.makes_same_picture(&other.scene)
            && (size, pixel, share) == (&other.size, &other.pixel, &other.share)
    }

    /// What stands for the ray in the picture.
    pub fn along(&self) -> AlongRay {
        if !self.scene.shows_field() {
            return AlongRay::Composite;
        }
        self.scene.inside.shown_by(&self.scene.splat).along
    }

    /// The answer, and what was made for it, to be used for the next question.
    ///
    /// # Errors
    /// Where the field does not fit into memory.
    fn answer(&self, kept: &mut Option<Probe>) -> Result<Seen, TooLarge> {
        let at = DVec2::from(self.pixel.map(|p| f64::from(p) + 0.5));
        let alone = || Ok(seen_alone(&self.scene, self.size, at, self.share));
        if !self.scene.shows_field() {
            return alone();
        }
        if self.along() == AlongRay::Average {
            // Known without a field.
            return Ok(Seen::Average);
        }
        let probe = match kept.take().filter(|probe| probe.suits(&self.scene)) {
            Some(probe) => Some(probe),
            None => probe_of(&self.scene)?,
        };
        let Some(probe) = probe else { return alone() };
        let seen = probe.look(&self.scene, self.size, at, self.share);
        *kept = Some(probe);
        Ok(seen)
    }
}

/// Of a scene's volume, if it has one.
pub(super) fn probe_of(scene: &Scene) -> Result<Option<Probe>, TooLarge> {
    // Sharpening radial kernels needs what was before beside what comes.
    let copies = match scene.splat.kernel {
        Kernel::Nearest | Kernel::Linear | Kernel::BSpline => 1,
        _ => 3,
    };
    let bytes = scene.voxel_count() * 8 * copies;
    memory::require("the probe's field in double precision", bytes, memory::free_bytes())?;
    Ok(Probe::new(scene))
}

/// The field of a scene at a place of the world, whatever hides it there; `None` beside the data.
///
/// # Errors
/// Where the field does not fit into memory.
pub fn at(scene: &Scene, world: DVec3) -> Result<Option<Point>, TooLarge> {
    Ok(probe_of(scene)?.and_then(|probe| probe.at(scene, world)))
}

/// Looks once.
///
/// # Errors
/// Where the field does not fit into memory.
pub fn look(look: &Look) -> Result<Seen, TooLarge> {
    look.answer(&mut None)
}

/// A question and its answer: one sentence where there can be none.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What was asked.
    pub look: Look,
    /// What is there.
    pub seen: Result<Seen, String>,
}

#[derive(Default)]
struct Desk {
    asked: Option<Look>,
    answered: Option<Answer>,
    is_closed: bool,
}

#[derive(Default)]
struct Shared {
    desk: Mutex<Desk>,
    news: Condvar,
}

impl Shared {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        // What a thread that died left is a question or an answer all the same.
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A thread that looks; it ends, and gives its memory back, when this is dropped.
pub struct Prober {
    shared: Arc<Shared>,
}

impl Prober {
    /// Starts one; `wake` is called, on its thread, whenever there is an answer.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        thread::Builder::new().name("voxsplat-probe".to_owned()).spawn(move || {
            let mut kept = None;
            while let Some(look) = next(&theirs) {
                let seen = look.answer(&mut kept).map_err(|error| error.to_string());
                theirs.desk().answered = Some(Answer { look, seen });
                wake();
            }
        })?;
        Ok(Self { shared })
    }

    /// Asks; what was asked before and has not been begun is forgotten.
    pub fn ask(&self, look: Look) {
        self.shared.desk().asked = Some(look);
        self.shared.news.notify_one();
    }

    /// The newest answer, once.
    pub fn take(&self) -> Option<Answer> {
        self.shared.desk().answered.take()
    }
}

impl Drop for Prober {
    fn drop(&mut self) {
        self.shared.desk().is_closed = true;
        self.shared.news.notify_one();
    }
}

/// Waits for a question; `None` once nobody asks any more.
fn next(shared: &Shared) -> Option<Look> {
    let mut desk = shared.desk();
    loop {
        if desk.is_closed {
            return None;
        }
        if let Some(look) = desk.asked.take() {
            return Some(look);
        }
        desk = shared.news.wait(desk).unwrap_or_else(PoisonError::into_inner);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;
    use crate::scene::opening;
    use crate::volume::{Lattice, Samples, ScalarVolume};

    fn question(pixel: [u32; 2]) -> Look {
        let lattice = Lattice::unit([12; 3]);
        let samples = Samples::Float64((0..lattice.len()).map(|i| i as f64).collect());
        let volume = ScalarVolume::from_samples("v", lattice, samples).unwrap();
        let mut scene = opening(Default::default(), Arc::new(volume), None);
        scene.transfer_mut().expect("a field").opacity = vec![(0.0, 0.5)];
        Look { scene, size: [30, 30], pixel, share: FIRST_SEEN }
    }

    #[test]
    fn the_newest_question_is_answered_as_looking_once_answers_it() {
        let (sender, receiver) = mpsc::channel();
        let prober = Prober::start(move || sender.send(()).unwrap_or_default()).unwrap();
        assert!(prober.take().is_none());
        let looks = [[3, 3], [15, 15], [14, 17]].map(question);
        looks.iter().cloned().for_each(|look| prober.ask(look));
        let wait = || receiver.recv_timeout(Duration::from_secs(20)).expect("an answer");
        wait();
        // The first may have been begun before the others came.
        let mut answer = prober.take().expect("an answer");
        while !answer.look.is_same(&looks[2]) {
            wait();
            answer = prober.take().expect("an answer");
        }
        assert_eq!(answer.seen, look(&looks[2]).map_err(|error| error.to_string()));
        let Ok(Seen::Point(Point { world, .. })) = answer.seen else { panic!("{answer:?}") };
        // The ray goes through the middle of the pixel.
        let Look { scene, size, pixel, .. } = &looks[2];
        let camera = scene.camera;
        let found = camera.pixel_from_view(camera.to_view(world), size.map(f64::from)).unwrap();
        let middle = DVec2::from(pixel.map(f64::from)) + 0.5;
        assert!((found - middle).length() < 1e-9, "{found}");
        assert!(!looks[2].is_same(&looks[1]));
        drop(prober);
        // Its thread ends, and with it the line that it wakes by.
        assert!(
            receiver
                .recv_timeout(Duration::from_secs(20))
                .is_err_and(|error| { error == mpsc::RecvTimeoutError::Disconnected })
        );
    }
}
