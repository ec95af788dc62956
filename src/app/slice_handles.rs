//! Slices over the picture: a frame around each, and a handle that moves it along its normal.

use eframe::egui::{CursorIcon, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use super::clip_box::{moved, within};
use super::theme;
use super::viewport::PixelArea;
use crate::scene::{Plane, Scene, Slice, View};
use crate::volume::Lattice;

/// Half the side of a handle, points.
const REACH: f32 = 5.0;

/// What is remembered while a handle is held.
#[derive(Debug, Default)]
pub(super) struct SliceHandles {
    /// Where the slice lay when its handle was taken, and the pointer.
    taken: Option<(DVec3, Pos2)>,
}

impl SliceHandles {
    /// Draws a frame around each slice as `scene`'s camera sees it, and moves the one whose handle is dragged.
    pub(super) fn show(&mut self, ui: &Ui, area: PixelArea, scene: &mut Scene) {
        let (view, lattice) = (View::new(scene, area.size), scene.lattice());
        let points_per_pixel = area.rect.width() / area.size[0] as f32;
        let place = |at: DVec3| {
            let pixel = view.point_on_picture(at)?.as_vec2();
            Some(area.rect.min + vec2(pixel.x, pixel.y) * points_per_pixel)
        };
        let painter = ui.painter_at(area.rect);
        let mut dragged = false;
        for (i, slice) in scene.inside.slices.iter_mut().enumerate() {
            let outline = slice.plane.outline(&lattice);
            let corners: Option<Vec<Pos2>> = outline.iter().map(|&at| place(at)).collect();
            // With a corner behind the eye there is no frame, but for what is written in the panel.
            let Some(corners) = corners.filter(|corners| corners.len() > 2) else { continue };
            let across = (0..3).find(|&axis| slice.share_across(&lattice, axis).is_some());
            let colour = across.map_or(theme::TEXT_FAINT, |axis| theme::AXES[axis]);
            painter.add(Shape::closed_line(corners, Stroke::new(1.5, colour.gamma_multiply(0.8))));
            let Some((at, here)) = handle(&outline, place) else { continue };
            let Some(shown) = within(area.rect.shrink(2.0 * REACH), here) else { continue };
            let rect = Rect::from_center_size(shown, Vec2::splat(4.0 * REACH));
            let id = ui.scope_id().with(("slice", i));
            let held = ui.interact(rect, id, Sense::drag()).on_hover_cursor(CursorIcon::Grab);
            let held = held.on_hover_text(format!("Drag to move slice {}", i + 1));
            let unit = step(&slice.plane, &lattice);
            let there = place(at + lattice.axes().inverse() * (unit / 100.0));
            if held.drag_started() {
                let pointer = held.interact_pointer_pos();
                self.taken = pointer.map(|pointer| (slice.plane.point, pointer));
            }
            let pointer = held.interact_pointer_pos().filter(|_| held.dragged());
            if let (Some((from, taken)), Some(pointer), Some(there)) = (self.taken, pointer, there)
            {
                dragged = true;
                let along = (there - here) * 100.0;
                move_to(slice, from + unit * moved(along, pointer - taken), &lattice);
            }
            let is_lit = held.hovered() || held.dragged();
            let fill = if is_lit { theme::TEXT } else { colour };
            let square = Rect::from_center_size(shown, Vec2::splat(2.0 * REACH));
            painter.rect_filled(square.expand(1.0), 2.0, theme::PANEL);
            painter.rect_filled(square, 2.0, fill);
        }
        if !dragged && !ui.input(|input| input.pointer.any_down()) {
            self.taken = None;
        }
    }
}

/// A step along a plane's normal, as long as the volume is large.
fn step(plane: &Plane, lattice: &Lattice) -> DVec3 {
    plane.normal.normalize_or_zero() * 2.0 * lattice.bounding_radius()
}

/// Moves a slice so that it passes a point, no further than the first and the last samples.
fn move_to(slice: &mut Slice, point: DVec3, lattice: &Lattice) {
    let normal = slice.plane.normal.normalize_or_zero();
    let last = DVec3::from(lattice.dims.map(|n| n as f64)) - 1.0;
    // How far the outermost samples lie from the middle along the normal.
    let reach = (lattice.axes().transpose() * normal).abs().dot(last) / 2.0;
    let height = (point - lattice.centre()).dot(normal);
    slice.plane.point = point + normal * (height.max(-reach).min(reach) - height);
}

/// Where the handle of an outline is: in the middle of the side that lies lowest on the picture, where it is apart from
/// those of others.
fn handle(outline: &[DVec3], place: impl Fn(DVec3) -> Option<Pos2>) -> Option<(DVec3, Pos2)> {
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let middles = sides.filter_map(|(a, b)| {
        let at = (*a + *b) / 2.0;
        Some((at, place(at)?))
    });
    middles.max_by(|(_, a), (_, b)| a.y.total_cmp(&b.y))
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn the_frame_of_a_slice_goes_around_what_it_cuts_of_the_volume() {
        let spacing = DVec3::new(1.0, 1.0, 2.0);
        let lattice = Lattice { spacing, ..Lattice::unit([8, 4, 6]) };
        let across = Slice::across(&lattice, 0, 0.25, 1.0).plane;
        let corners = across.outline(&lattice);
        assert_eq!(corners.len(), 4);
        for pair in [(0, 1), (1, 2), (2, 3), (3, 0)] {
            let side = corners[pair.1] - corners[pair.0];
            assert!(side.x.abs() < 1e-12 && side.y * side.z == 0.0, "along an axis: {side}");
        }
        assert!(corners.iter().all(|at| (at.x - 1.5).abs() < 1e-12));
        let oblique = Plane { point: lattice.centre(), normal: DVec3::new(1.0, 1.0, 0.5) };
        let corners = oblique.outline(&lattice);
        assert!((3..=6).contains(&corners.len()), "{}", corners.len());
        for at in &corners {
            let off = (lattice.world_from_index(*at) - oblique.point).dot(oblique.normal);
            assert!(off.abs() < 1e-9, "{off}");
        }
        let beside = Plane { point: DVec3::splat(100.0), ..oblique };
        assert!(beside.outline(&lattice).is_empty());
    }

    #[test]
    fn a_slice_moves_along_its_normal_and_no_further_than_the_samples() {
        let lattice = Lattice::unit([8, 4, 6]);
        let mut slice = Slice::across(&lattice, 0, 0.5, 1.0);
        move_to(&mut slice, lattice.centre() + DVec3::new(1.0, 0.0, 0.0), &lattice);
        assert!((slice.plane.point.x - 4.5).abs() < 1e-12);
        for (to, end) in [(1e3, 7.0), (-1e3, 0.0)] {
            move_to(&mut slice, DVec3::new(to, 0.0, 0.0), &lattice);
            assert!((slice.plane.point.x - end).abs() < 1e-9, "{}", slice.plane.point);
        }
        assert!(
            (step(&slice.plane, &lattice).length() - 2.0 * lattice.bounding_radius()).abs() < 1e-9
        );
    }

    #[test]
    fn the_handle_is_on_the_lowest_side() {
        let outline = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
        let place =
            |at: DVec3| Some(DVec2::new(at.x, -at.y).as_vec2()).map(|p| Pos2::new(p.x, p.y));
        let (at, here) = handle(&outline, place).expect("in sight");
        assert_eq!((at, here), (DVec3::X / 2.0, Pos2::new(0.5, 0.0)));
        assert_eq!(handle(&outline, |_| None), None);
    }
}
