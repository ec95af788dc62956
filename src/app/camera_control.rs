//! The hand on the camera: what drags, the wheel and the view keys do to it.

use std::f64::consts::PI;

use eframe::egui::{Event, InputState, MouseWheelUnit, PointerButton, Pos2, Rect, Response, Vec2};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::core::{Camera, Projection};
use crate::scene::{NamedView, Orientation, Scene, among_axes, framing_all, in_perspective};
use crate::volume::Lattice;

/// How a drag turns the view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Turning {
    /// About the axis that is up, and nearer to it or farther away: what is up stays up.
    #[default]
    Turntable,
    /// As a ball under the hand, whatever is up.
    Trackball,
}

/// Zoom factor of one notch of the wheel.
const ZOOM_PER_NOTCH: f64 = 1.15;
/// Points of smooth scrolling that count as one notch.
const POINTS_PER_NOTCH: f64 = 50.0;
/// Zoom factor of a right drag over the viewport's whole height.
const ZOOM_PER_HEIGHT: f64 = 16.0;

/// A camera along a named view that shows in a picture of any shape what can be seen of a scene; see [`framing_all`]. Where it `has_axes`,
/// with these.
pub fn framed(
    scene: &Scene,
    (view, orientation): (NamedView, Orientation),
    size: [f64; 2],
    has_axes: bool,
) -> Camera {
    framed_along(scene, view.direction_and_up(orientation), size, has_axes)
}

/// The same along a direction, with what is up.
pub fn framed_along(
    scene: &Scene,
    (direction, up): (DVec3, DVec3),
    size: [f64; 2],
    has_axes: bool,
) -> Camera {
    let projection = scene.camera.projection;
    let framed = framing_all(scene, direction, up);
    let mut camera = in_perspective(scene, Camera { projection, ..framed });
    if has_axes {
        camera = among_axes(scene, camera);
    }
    // The scale is that of the height; a narrow picture needs more.
    camera.parallel_scale *= (size[1] / size[0]).max(1.0);
    camera
}

/// The same view with the other kind of projection.
pub fn with_other_projection(camera: &Camera, view_angle_deg: f64) -> Camera {
    let projection = match camera.projection {
        Projection::Orthographic => {
            Projection::Perspective { view_angle: view_angle_deg.to_radians() }
        }
        Projection::Perspective { .. } => Projection::Orthographic,
    };
    Camera { projection, ..*camera }
}

/// The camera moved so that the focal-plane point under `pixel` comes to the centre.
pub fn recentred(camera: &Camera, pixel: DVec2, size: [f64; 2]) -> Camera {
    let to_centre = DVec2::new(size[0] / 2.0, size[1] / 2.0) - pixel;
    camera.panned(to_centre, size[1])
}

/// Notches of the wheel in one event, up positive.
fn notches(event: &Event) -> f64 {
    let Event::MouseWheel { unit, delta, .. } = event else { return 0.0 };
    let delta = f64::from(delta.y);
    match unit {
        MouseWheelUnit::Point => delta / POINTS_PER_NOTCH,
        MouseWheelUnit::Line => delta,
        MouseWheelUnit::Page => delta * 10.0,
    }
}

/// Half heights of a view that zooming ends at, world units: a quarter of a voxel, where there is nothing more to see, and
/// sixteen times what holds all of a lattice.
fn zoom_ends(lattice: &Lattice) -> [f64; 2] {
    [0.25 * lattice.smallest_spacing(), 16.0 * lattice.bounding_radius()]
}

/// The camera nearer by a factor, up to where zooming ends. One that is beyond comes back, and goes no further.
fn zoomed(camera: &Camera, factor: f64, about: DVec2, size: [f64; 2], ends: [f64; 2]) -> Camera {
    let scale = camera.parallel_scale;
    let [nearest, farthest] = [ends[0].min(scale), ends[1].max(scale)];
    camera.zoomed(factor.clamp(scale / farthest, scale / nearest), about, size)
}

/// What the mouse did in the viewport since the last pass, applied to the camera, which looks at a lattice.
///
/// Lengths are points: a camera cares only for their ratio to the viewport's height. `up` is the axis of the world that
/// a turntable turns about.
pub fn steered(
    camera: &Camera,
    response: &Response,
    lattice: &Lattice,
    (turning, up): (Turning, DVec3),
) -> Camera {
    // Read in one go: a response must not be asked while the input is held.
    let hand = response.ctx.input(Hand::of);
    let rect = response.rect;
    let size = [f64::from(rect.width()), f64::from(rect.height())];
    let mut camera = *camera;
    let delta = drag_delta(response);
    let delta = DVec2::new(f64::from(delta.x), f64::from(delta.y));
    if delta != DVec2::ZERO {
        let panning = response.dragged_by(PointerButton::Middle)
            || (response.dragged_by(PointerButton::Primary) && hand.shift);
        if panning {
            camera = camera.panned(delta, size[1]);
        } else if response.dragged_by(PointerButton::Primary) && hand.command {
            if let Some(at) = response.interact_pointer_pos() {
                let from_middle = at - rect.center();
                camera = camera.rolled(turned_by(from_middle - drag_delta(response), from_middle));
            }
        } else if response.dragged_by(PointerButton::Primary) {
            let turn = delta * (PI / size[1]);
            camera = match turning {
                Turning::Turntable => camera.turned_about(up, turn.x, turn.y),
                Turning::Trackball => camera.orbited(turn.x, turn.y),
            };
        } else if response.dragged_by(PointerButton::Secondary) {
            let factor = ZOOM_PER_HEIGHT.powf(-delta.y / size[1]);
            let middle = DVec2::new(size[0] / 2.0, size[1] / 2.0);
            camera = zoomed(&camera, factor, middle, size, zoom_ends(lattice));
        }
    }
    let Some(pointer) = response.hover_pos() else { return camera };
    let pixel = in_rect(pointer, rect);
    if hand.zoom != 1.0 {
        camera = zoomed(&camera, hand.zoom, pixel, size, zoom_ends(lattice));
    }
    if hand.double_click {
        camera = recentred(&camera, pixel, size);
    }
    camera
}

/// How far the hand went in this pass with the button down, points. A pass in which it came and pressed holds both ways:
/// what came before the press is none of it.
pub(super) fn drag_delta(response: &Response) -> Vec2 {
    if !response.drag_started() {
        return response.drag_delta();
    }
    let [pressed, now] =
        response.ctx.input(|input| [input.pointer.press_origin(), input.pointer.latest_pos()]);
    match (pressed, now) {
        (Some(pressed), Some(now)) => now - pressed,
        _ => Vec2::ZERO,
    }
}

/// What the input of a pass says about the hand.
struct Hand {
    /// Factor of wheel and pinch together.
    zoom: f64,
    shift: bool,
    command: bool,
    double_click: bool,
}

impl Hand {
    fn of(input: &InputState) -> Self {
        let wheel: f64 = input.events.iter().map(notches).sum();
        let pinch: f64 = input.events.iter().map(pinch_factor).product();
        Self {
            zoom: ZOOM_PER_NOTCH.powf(wheel) * pinch,
            shift: input.modifiers.shift,
            command: input.modifiers.command,
            double_click: input.pointer.button_double_clicked(PointerButton::Primary),
        }
    }
}

/// By how much a hand went clockwise around the middle, radians, from one place to another as seen from there.
fn turned_by(from: Vec2, to: Vec2) -> f64 {
    let (cross, dot) = (from.x * to.y - from.y * to.x, from.dot(to));
    f64::from(cross).atan2(f64::from(dot))
}

/// Zoom factor of a pinch gesture.
fn pinch_factor(event: &Event) -> f64 {
    if let Event::Zoom(factor) = event { f64::from(*factor) } else { 1.0 }
}

/// A position relative to the top left corner of a rectangle.
fn in_rect(position: Pos2, rect: Rect) -> DVec2 {
    let offset = position - rect.min;
    DVec2::new(f64::from(offset.x), f64::from(offset.y))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use eframe::egui::vec2;

    use super::*;
    use crate::volume::{Samples, ScalarVolume};

    #[test]
    fn recentring_brings_the_point_under_the_cursor_to_the_middle() {
        let size = [640.0, 480.0];
        let camera = Camera::new(DVec3::ONE, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, 3.0);
        let (origin, direction) = camera.ray(DVec2::new(100.0, 400.0), size);
        let t = (camera.focal_point - origin).dot(camera.direction);
        let aimed_at = origin + direction * t;
        let moved = recentred(&camera, DVec2::new(100.0, 400.0), size);
        assert!((moved.focal_point - aimed_at).length() < 1e-9);
        assert_eq!(moved.direction, camera.direction);
    }

    #[test]
    fn a_narrow_picture_still_holds_the_whole_volume() {
        let samples = Samples::UInt8((0..1000).map(|i| (i % 251) as u8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([10; 3]), samples);
        let scene =
            crate::scene::opening(Default::default(), Arc::new(volume.expect("sound")), None);
        let view = (NamedView::Front, Orientation::default());
        let framed = |size| framed(&scene, view, size, false);
        let (wide, narrow) = (framed([800.0, 400.0]), framed([200.0, 400.0]));
        assert!((narrow.parallel_scale - 2.0 * wide.parallel_scale).abs() < 1e-9);
    }

    #[test]
    fn zooming_ends_at_a_voxel_and_far_from_the_volume_and_comes_back_from_beyond() {
        let size = [400.0, 300.0];
        let ends = zoom_ends(&Lattice::unit([20; 3]));
        let mut camera = Camera::new(DVec3::ONE, DVec3::X, DVec3::Z, 10.0);
        for (factor, end) in [(1.15, ends[0]), (1.0 / 1.15, ends[1])] {
            for _ in 0..200 {
                camera = zoomed(&camera, factor, DVec2::new(10.0, 20.0), size, ends);
            }
            assert!((camera.parallel_scale / end - 1.0).abs() < 1e-9, "{}", camera.parallel_scale);
            // At the end the view stays where it is.
            let still = zoomed(&camera, factor, DVec2::new(10.0, 20.0), size, ends);
            assert!((still.focal_point - camera.focal_point).length() < 1e-6 * end);
        }
        let beyond = Camera { parallel_scale: 1e9, ..camera };
        assert_eq!(zoomed(&beyond, 0.5, DVec2::ZERO, size, ends).parallel_scale, 1e9);
        assert_eq!(zoomed(&beyond, 2.0, DVec2::ZERO, size, ends).parallel_scale, 5e8);
    }

    #[test]
    fn a_hand_that_goes_around_the_middle_rolls_by_the_angle_that_it_went() {
        let quarter = turned_by(vec2(0.0, -10.0), vec2(30.0, 0.0));
        assert!(
            (quarter - PI / 2.0).abs() < 1e-6,
            "from above to the right is clockwise: {quarter}"
        );
        assert!((turned_by(vec2(30.0, 0.0), vec2(0.0, -10.0)) + PI / 2.0).abs() < 1e-6);
        assert_eq!(turned_by(Vec2::ZERO, vec2(1.0, 0.0)), 0.0, "from the middle nowhere");
    }

    #[test]
    fn switching_the_projection_twice_changes_nothing() {
        let camera = Camera::new(DVec3::ONE, DVec3::X, DVec3::Z, 3.0);
        let there = with_other_projection(&camera, 30.0);
        assert!((there.eye_distance().unwrap() - 3.0 / 15.0_f64.to_radians().tan()).abs() < 1e-9);
        assert_eq!(with_other_projection(&there, 30.0), camera);
    }
}
