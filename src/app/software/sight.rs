//! Whether a window can be seen, and whether the screen still has what was shown last.

use egui_winit::winit::event::WindowEvent;

/// What is known of a window's place on the screen.
#[derive(Debug)]
pub(super) struct Sight {
    /// Nothing of it can be seen.
    is_covered: bool,
    /// The screen's memory may hold nothing of the frame before.
    is_stale: bool,
}

impl Sight {
    /// Of a window of which nothing was shown yet.
    pub(super) fn new() -> Self {
        Self { is_covered: false, is_stale: true }
    }

    /// Takes in what happened to the window; whether that asks for a frame.
    pub(super) fn note(&mut self, event: &WindowEvent) -> bool {
        match event {
            WindowEvent::Occluded(is_covered) => {
                (self.is_covered, self.is_stale) = (*is_covered, true);
                true
            }
            // The screen has lost what was there.
            WindowEvent::RedrawRequested | WindowEvent::Resized(_) => {
                (self.is_covered, self.is_stale) = (false, true);
                true
            }
            // Not every desktop says that it is seen again.
            WindowEvent::Focused(true) | WindowEvent::CursorMoved { .. } => {
                self.is_covered = false;
                false
            }
            _ => false,
        }
    }

    /// Whether anything of it can be seen, by what the desktop says of its being minimised: nothing is drawn else. What
    /// uncovers it asks for a frame.
    pub(super) fn is_open(&self, is_minimised: Option<bool>) -> bool {
        !self.is_covered && is_minimised != Some(true)
    }

    /// The screen may lose what was shown.
    pub(super) fn lose(&mut self) {
        self.is_stale = true;
    }

    /// Whether the next frame is to be shown whole. It is shown then.
    pub(super) fn take_stale(&mut self) -> bool {
        std::mem::take(&mut self.is_stale)
    }
}

#[cfg(test)]
mod tests {
    use egui_winit::winit::dpi::{PhysicalPosition, PhysicalSize};
    use egui_winit::winit::event::DeviceId;

    use super::*;

    #[test]
    fn a_window_that_is_covered_or_minimised_is_not_drawn() {
        let mut sight = Sight::new();
        assert!(sight.is_open(None) && sight.is_open(Some(false)) && !sight.is_open(Some(true)));
        assert!(sight.note(&WindowEvent::Occluded(true)));
        assert!([None, Some(false), Some(true)].iter().all(|is| !sight.is_open(*is)));
        // Nothing that happens to a covered window uncovers it, but what only a seen one meets with.
        assert!(!sight.note(&WindowEvent::Focused(false)) && !sight.is_open(None));
        let moved = WindowEvent::CursorMoved {
            device_id: DeviceId::dummy(),
            position: PhysicalPosition::new(1.0, 1.0),
        };
        for (event, asks) in [
            (WindowEvent::Occluded(false), true),
            (WindowEvent::RedrawRequested, true),
            (WindowEvent::Resized(PhysicalSize::new(9, 9)), true),
            (WindowEvent::Focused(true), false),
            (moved, false),
        ] {
            sight.note(&WindowEvent::Occluded(true));
            assert_eq!(sight.note(&event), asks, "{event:?}");
            assert!(sight.is_open(None), "{event:?}");
        }
    }

    #[test]
    fn what_the_screen_may_have_lost_is_shown_whole_once() {
        let mut sight = Sight::new();
        assert!(sight.take_stale() && !sight.take_stale(), "the first frame, and no other");
        for event in [
            WindowEvent::Occluded(false),
            WindowEvent::RedrawRequested,
            WindowEvent::Resized(PhysicalSize::new(9, 9)),
        ] {
            sight.note(&event);
            assert!(sight.take_stale() && !sight.take_stale(), "{event:?}");
        }
        sight.note(&WindowEvent::Focused(true));
        assert!(!sight.take_stale());
        sight.lose();
        assert!(sight.take_stale());
    }
}
