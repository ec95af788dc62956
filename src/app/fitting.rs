//! Views of everything: by their name, from where one looks, and while the window changes its size.

use glam::{DVec2, DVec3};

use super::actions::Action;
use super::camera_control;
use super::window::Window;
use crate::scene::{Annotation, Annotations, ClipBox, NamedView, View};
use crate::task::annotations::beside_bars;

impl Window {
    /// Shows everything along a named view, by the projection that there is.
    pub(super) fn fit(&mut self, view: NamedView) {
        self.fit_along(view.direction_and_up(self.orientation()));
        self.fitted = self.scene.as_ref().map(|scene| (view, scene.camera));
    }

    /// Shows everything along a direction, with what is up.
    pub(super) fn fit_along(&mut self, along: (DVec3, DVec3)) {
        if let Some(scene) = &mut self.scene {
            let annotations = self.settings.annotations;
            let has_axes = annotations.has(Annotation::Axes);
            let size = beside_bars(annotations, scene, self.viewport_size);
            scene.camera = camera_control::framed_along(scene, along, size, has_axes);
        }
    }

    /// Shows everything from where one looks.
    pub(super) fn fit_to_window(&mut self) {
        if let Some(scene) = &self.scene {
            self.fit_along((scene.camera.direction, scene.camera.up));
            self.notices.withdraw(Action::FitView);
        }
    }

    /// Offers to show all, where a part of the volume's box, or of what is left of it by a clip box, lies beside the picture: what was
    /// switched on reaches as far.
    pub(super) fn offer_to_fit_box(&mut self, sentence: &str) {
        // A view of everything that nobody has moved takes it in by itself.
        let Some(scene) = self.scene.as_ref().filter(|_| self.unmoved_view().is_none()) else {
            return;
        };
        let left = scene.inside.clip.bounds.unwrap_or(ClipBox::WHOLE);
        let [low, high] = left.in_index(scene.lattice().dims);
        let corner = |bits: u32| {
            let share = |axis: u32| f64::from(bits >> axis & 1);
            low + (high - low) * DVec3::new(share(0), share(1), share(2))
        };
        self.offer_to_fit(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner), sentence);
    }

    /// The same where any of some places, index space, lies beside the picture.
    pub(super) fn offer_to_fit(&mut self, places: &[DVec3], sentence: &str) {
        let Some(scene) = &self.scene else { return };
        let (view, size) =
            (View::new(scene, self.viewport_size), self.viewport_size.map(f64::from));
        let is_in = |at: DVec2| (0.0..=size[0]).contains(&at.x) && (0.0..=size[1]).contains(&at.y);
        if places.iter().any(|at| !view.point_on_picture(*at).is_some_and(is_in)) {
            self.notices.offer(Action::FitView, sentence);
        }
    }

    /// The view of everything, while nobody has moved it.
    pub(super) fn unmoved_view(&self) -> Option<NamedView> {
        let camera = self.scene.as_ref().map(|scene| scene.camera)?;
        self.fitted.filter(|(_, fitted)| *fitted == camera).map(|(view, _)| view)
    }

    /// Takes note of the viewport's size in physical pixels, and of what annotations leave of it. A view of everything that nobody has
    /// moved stays one, which is no step of the view.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.viewport_size = size;
        let Annotations { axes, scalar_bar, .. } = self.settings.annotations;
        let room = (size, axes, scalar_bar);
        if std::mem::replace(&mut self.room, room) == room {
            return;
        }
        if let Some(view) = self.unmoved_view() {
            self.fit(view);
            self.amend_view();
        }
    }
}
