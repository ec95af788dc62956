//! The world's axes as seen by the camera, in a corner of the viewport.

use eframe::egui::{Align2, FontId, Painter, Pos2, Rect, Stroke, vec2};
use glam::DVec3;

use super::theme;
use crate::core::Camera;
use crate::scene;

/// Length of an axis that lies in the picture, points.
const LENGTH: f32 = 30.0;
/// Distance of the origin from the viewport's left and bottom edges, points.
const INSET: f32 = 52.0;

/// One axis on screen.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    /// Which: 0, 1, 2 for x, y, z.
    index: usize,
    /// Its tip relative to the origin, axis lengths; y down.
    tip: [f32; 2],
    /// How far away its tip is, −1 (towards the eye) to 1.
    depth: f32,
}

/// The three axes, the farthest first.
fn axes_of(camera: &Camera) -> [Axis; 3] {
    let world = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut axes = [0, 1, 2].map(|index: usize| {
        let view = camera.view_from_world_rotation() * world[index];
        let view = view.as_vec3();
        Axis { index, tip: [view.x, -view.y], depth: view.z }
    });
    axes.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    axes
}

/// Paints the axes into the lower left corner of `rect`, labelled for the file's space.
pub fn paint(painter: &Painter, rect: Rect, camera: &Camera, space: Option<&str>) {
    if rect.width() < 4.0 * INSET || rect.height() < 4.0 * INSET {
        return;
    }
    let letters = scene::axis_letters(space);
    let origin = Pos2::new(rect.left() + INSET, rect.bottom() - INSET);
    for axis in axes_of(camera) {
        let direction = vec2(axis.tip[0], axis.tip[1]);
        let tip = origin + direction * LENGTH;
        // What points away is fainter.
        let colour = theme::AXES[axis.index].gamma_multiply(0.8 - 0.2 * axis.depth);
        painter.line_segment([origin, tip], Stroke::new(2.0, colour));
        painter.circle_filled(tip, 2.5, colour);
        let beyond =
            if direction.length() > 0.2 { direction.normalized() } else { vec2(0.7, -0.7) };
        let font = FontId::proportional(12.0);
        painter.text(tip + beyond * 11.0, Align2::CENTER_CENTER, letters[axis.index], font, colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_points_up_on_screen_and_what_is_near_is_painted_last() {
        let camera = Camera::new(DVec3::ZERO, DVec3::Y, DVec3::Z, 1.0);
        let axes = axes_of(&camera);
        let of = |index| axes.iter().find(|a| a.index == index).unwrap();
        assert!(of(2).tip[1] < -0.99, "z is up: {:?}", of(2));
        assert!(of(0).tip[0] > 0.99, "x is right: {:?}", of(0));
        assert_eq!(axes[0].index, 1, "y points away and is painted first");
    }
}
