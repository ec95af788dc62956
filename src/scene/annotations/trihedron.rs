//! The directions of the world's axes.

use glam::{DVec2, DVec3};

use super::MARGIN;
use super::primitives::{Area, FIGURE, Primitive, Sheet};
use crate::core::Camera;
use crate::scene::axis_letters;

/// Length of an axis that lies in the picture, ems.
const LENGTH: f64 = 2.3;
/// Distance of an axis' letter from its tip, ems.
const BEYOND: f64 = 0.95;
/// Half the room that it takes, ems.
const REACH: f64 = LENGTH + BEYOND + FIGURE / 2.0;
/// Axes shorter than this on the picture, as a part of their length, point at the eye.
const SHORT: f64 = 0.2;

/// An end of an axis, where the trihedron shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisEnd {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether it is the end that the axis points to, which alone is drawn.
    pub is_positive: bool,
    /// Pixels.
    pub at: DVec2,
}

/// One axis on the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Axis {
    /// 0, 1, 2 for x, y, z.
    index: usize,
    /// Its tip from the origin, axis lengths; y down.
    tip: DVec2,
    /// How far away its tip is, −1 (towards the eye) to 1.
    depth: f64,
}

/// The three axes, the farthest first.
fn axes_of(camera: &Camera) -> [Axis; 3] {
    let world = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut axes = [0, 1, 2].map(|index: usize| {
        let view = camera.view_from_world_rotation() * world[index];
        Axis { index, tip: DVec2::new(view.x, -view.y), depth: view.z }
    });
    axes.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    axes
}

/// Lays it out in the lower left corner, with letters of the file's space; `None` where there is no room, or the ends of
/// its axes, the farthest first.
pub(super) fn lay_out(
    sheet: &mut Sheet<'_>,
    camera: &Camera,
    space: Option<&str>,
) -> Option<Vec<AxisEnd>> {
    let (em, size) = (sheet.em, sheet.picture.size());
    let inset = (MARGIN + REACH) * em - 0.5 * em;
    let origin = DVec2::new(inset, size.y - inset).round();
    let area = Area { low: origin - REACH * em, high: origin + REACH * em };
    if area.size().max_element() > 0.45 * size.min_element() || !sheet.is_free(&area) {
        return None;
    }
    sheet.take(area);
    let letters = axis_letters(space);
    let mut written: Vec<Area> = Vec::new();
    let mut words = Vec::new();
    let axes = axes_of(camera);
    for axis in &axes {
        let tip = origin + axis.tip * LENGTH * em;
        // What points away is fainter.
        let mut ink = sheet.inks.axes[axis.index];
        ink.opacity = 0.8 - 0.2 * axis.depth;
        sheet.line([origin, tip], 0.15 * em, ink);
        sheet.primitives.push(Primitive::Dot { centre: tip, radius: 0.2 * em, ink });
        let is_short = axis.tip.length() <= SHORT;
        let beyond = if is_short { DVec2::new(0.7, -0.7) } else { axis.tip.normalize() };
        let letter = letters[axis.index];
        let extent = DVec2::new((sheet.width_of)(letter), FIGURE) * em;
        let low = tip + beyond * BEYOND * em - extent / 2.0;
        words.push((Area::new(low, extent), letter, sheet.inks.axes[axis.index]));
    }
    // The nearest letters first: where two would overlap, the one behind gives way.
    for (area, letter, ink) in words.into_iter().rev() {
        if written.iter().all(|other| !other.meets(&area)) {
            sheet.words(DVec2::new(area.low.x, area.high.y), letter, 1.0, ink);
            written.push(area);
        }
    }
    let end = |axis: &Axis, is_positive: bool| {
        let (way, index) = (if is_positive { 1.0 } else { -1.0 }, axis.index);
        let end = AxisEnd { axis: index, is_positive, at: origin + axis.tip * (way * LENGTH * em) };
        (way * axis.depth, end)
    };
    let mut ends: Vec<_> =
        axes.iter().flat_map(|axis| [end(axis, true), end(axis, false)]).collect();
    ends.sort_by(|a, b| b.0.total_cmp(&a.0));
    Some(ends.into_iter().map(|(_, end)| end).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_points_up_on_the_picture_and_what_is_near_is_painted_last() {
        let camera = Camera::new(DVec3::ZERO, DVec3::Y, DVec3::Z, 1.0);
        let axes = axes_of(&camera);
        let of = |index| axes.iter().find(|a| a.index == index).unwrap();
        assert!(of(2).tip.y < -0.99, "z is up: {:?}", of(2));
        assert!(of(0).tip.x > 0.99, "x is right: {:?}", of(0));
        assert_eq!(axes[0].index, 1, "y points away and is painted first");
    }
}
