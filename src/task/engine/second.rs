//! A second picture of the view on screen, to be compared with it.

use std::sync::Arc;

use super::report::picture;
use super::worker::{REBUILDS, Worker};
use super::{Engine, EngineState, Picture};
use crate::core::Ticket;
use crate::core::colour::LIGHT_OF_BYTES;
use crate::gpu::GpuError;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::task::draw::{DrawError, Observer, Rung};
use crate::task::engines::Canvas;
use crate::task::estimate;
use crate::task::level::LevelOfDetail;

/// A second picture of a view, beside the one on screen.
#[derive(Debug, Clone)]
pub struct SecondRequest {
    /// What is to be seen.
    pub scene: Scene,
    /// Picture size in physical pixels, each at least 1.
    pub size: [u32; 2],
    /// What it is to be compared with: the picture on screen.
    pub first: Arc<Picture>,
}

/// A second picture and how far it is from the first.
#[derive(Debug, Clone)]
pub struct SecondPicture {
    /// The picture, every voxel of it.
    pub picture: Arc<Picture>,
    /// What it was compared with.
    pub first: Arc<Picture>,
    /// RMSE between the two in linear light, as shown; `None` where they cannot be compared.
    pub rmse: Option<f64>,
    /// The greatest difference of a channel in linear light, as shown; `None` where sizes differ.
    pub greatest: Option<f64>,
}

impl Engine {
    /// Asks for a second picture, drawn once nothing else is to be done; a newer frame stops it, and
    /// `None` forgets it. Never blocks.
    pub fn request_second(&self, request: Option<SecondRequest>) {
        let mut slot = self.shared.lock();
        slot.second_wanted = request.is_some();
        slot.second = request;
        slot.second_picture = None;
        drop(slot);
        self.shared.posted.notify_one();
    }

    /// The second picture not yet taken, if any. Never blocks.
    pub fn take_second(&self) -> Option<Arc<SecondPicture>> {
        self.shared.lock().second_picture.take()
    }
}

impl Worker {
    /// Draws a second picture, unless something else comes.
    pub(super) fn serve_second(&mut self, request: SecondRequest) {
        let mut tries = 0;
        let outcome = loop {
            match self.second(&request) {
                Err(DrawError::Gpu(GpuError::Lost(_))) if tries < REBUILDS => self.drop_device(),
                outcome => break outcome,
            }
            tries += 1;
        };
        match outcome {
            Ok(()) => self.announce(EngineState::Idle),
            // After a still it goes on; after a frame its first picture is another.
            Err(DrawError::Interrupted) => {
                let mut slot = self.shared.lock();
                if slot.frame.is_none() && slot.second_wanted {
                    slot.second.get_or_insert(request);
                }
                let nothing_follows = slot.is_empty() && slot.second.is_none();
                drop(slot);
                if nothing_follows {
                    self.announce(EngineState::Idle);
                }
            }
            Err(error) => self.fail(&error),
        }
    }

    fn second(&mut self, request: &SecondRequest) -> Result<(), DrawError> {
        self.announce(EngineState::Drawing(0.0));
        let SecondRequest { scene, size, first } = request;
        let plan = Plan::of(scene, *size);
        self.device()?;
        let Some(mut drawer) = self.drawer.take() else { return Ok(()) };
        self.holds_finished = false;
        let mut aside = Aside(self);
        let prepared = drawer.prepare_watched(&plan, &Ticket::new(), &mut aside);
        let drawn = prepared.and_then(|()| drawer.draw(&plan, Rung::Full, &mut aside));
        let background = scene.background.light();
        let drawn = drawn.and_then(|drawn| Ok((drawn, drawer.engines.present(background)?)));
        let (held, drew) = (drawer.engines.held(), drawer.engines.drew());
        let active = drawer.active_count();
        self.drawer = Some(drawer);
        let (drawn, rgba) = drawn?;
        let level = (LevelOfDetail::of(Rung::Full, &drawn), 1.0);
        let mut picture = picture((scene, *size), level, &drawn, rgba, active);
        picture.report.backend = plan.backend();
        picture.report.held = Some(held);
        picture.report.engine = drew;
        let rmse = estimate::shown_rmse(&picture, first).ok();
        let is_as_large = picture.size == first.size;
        let greatest = is_as_large.then(|| greatest_difference(&picture.rgba, &first.rgba));
        let (picture, first) = (Arc::new(picture), Arc::clone(first));
        let second = SecondPicture { picture, first, rmse, greatest };
        self.shared.lock().second_picture = Some(Arc::new(second));
        (self.wake)();
        Ok(())
    }
}

/// The greatest difference of a channel of two pictures' sRGB bytes with straight alpha, in linear light over black.
fn greatest_difference(one: &[u8], other: &[u8]) -> f64 {
    let light = &*LIGHT_OF_BYTES;
    let of = |pixel: &[u8], channel: usize| {
        light[usize::from(pixel[channel])] * f64::from(pixel[3]) / 255.0
    };
    let pixels = one.chunks_exact(4).zip(other.chunks_exact(4));
    let apart = pixels.flat_map(|(a, b)| [0, 1, 2].map(|c| (of(a, c) - of(b, c)).abs()));
    apart.fold(0.0, f64::max)
}

/// Stops a second picture when something newer came.
struct Aside<'a>(&'a Worker);

impl Observer for Aside<'_> {
    fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
        self.is_overtaken()
    }

    fn is_overtaken(&mut self) -> bool {
        let replaced = {
            let slot = self.0.shared.lock();
            slot.second.is_some() || !slot.second_wanted
        };
        replaced || self.0.newer_came()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::colour::linear_from_srgb;

    #[test]
    fn the_greatest_difference_is_of_one_channel_in_linear_light_as_seen_over_black() {
        let black = [0, 0, 0, 255].repeat(3);
        let mut other = black.clone();
        assert_eq!(greatest_difference(&black, &other), 0.0);
        other[1] = 188;
        other[6] = 99;
        let half = linear_from_srgb(188.0 / 255.0);
        assert_eq!(greatest_difference(&black, &other), half);
        other[3] = 0;
        assert_eq!(greatest_difference(&other, &black), linear_from_srgb(99.0 / 255.0));
    }
}
