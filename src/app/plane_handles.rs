//! Slices and clip planes over the picture: a frame around each, and a handle that moves it along its normal.

use eframe::egui::{CursorIcon, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use super::clip_box::{moved, within};
use super::theme;
use super::viewport::PixelArea;
use crate::scene::{Plane, Scene, View};
use crate::volume::Lattice;

/// Half the side of a handle, points.
const REACH: f32 = 5.0;

/// The least share of the picture's height that the volume has to be long along a normal, for a hand to follow it.
const LEAST_ALONG: f32 = 0.1;

/// What is remembered while a handle is held.
#[derive(Debug, Default)]
pub(super) struct PlaneHandles {
    /// Where the plane lay when its handle was taken, and the pointer.
    taken: Option<(DVec3, Pos2)>,
}

impl PlaneHandles {
    /// Draws a frame around each slice and each clip plane (where `shows_clip`) as `scene`'s camera sees it, and moves the one
    /// whose handle is dragged: by `area`'s height where its normal is seen end on, away from the eye for upwards.
    pub(super) fn show(
        &mut self,
        ui: &Ui,
        area: PixelArea,
        scene: &mut Scene,
        [shows_slices, shows_clip]: [bool; 2],
    ) {
        let (view, lattice) = (View::new(scene, area.size), scene.lattice());
        let away = scene.camera.direction;
        let points_per_pixel = area.rect.width() / area.size[0] as f32;
        let place = |at: DVec3| {
            let pixel = view.point_on_picture(at)?.as_vec2();
            Some(area.rect.min + vec2(pixel.x, pixel.y) * points_per_pixel)
        };
        let painter = ui.painter_at(area.rect);
        let mut dragged = false;
        let slices = scene.inside.slices.iter_mut().map(|slice| &mut slice.plane).enumerate();
        let slices = slices.filter(|_| shows_slices).map(|(i, plane)| ("slice", i, plane));
        let planes = scene.inside.clip.planes.iter_mut().enumerate();
        let planes = planes.filter(|_| shows_clip).map(|(i, plane)| ("clip plane", i, plane));
        for (kind, i, plane) in slices.chain(planes) {
            let outline = plane.outline(&lattice);
            let corners: Option<Vec<Pos2>> = outline.iter().map(|&at| place(at)).collect();
            // With a corner behind the eye there is no frame, but for what is written in the panel.
            let Some(corners) = corners.filter(|corners| corners.len() > 2) else { continue };
            let colour =
                plane.axis_across(&lattice).map_or(theme::TEXT_FAINT, |axis| theme::AXES[axis]);
            painter.add(Shape::closed_line(corners, Stroke::new(1.5, colour.gamma_multiply(0.8))));
            let Some((at, here)) = handle(&outline, place) else { continue };
            let Some(shown) = within(area.rect.shrink(2.0 * REACH), here) else { continue };
            let rect = Rect::from_center_size(shown, Vec2::splat(4.0 * REACH));
            let id = ui.scope_id().with((kind, i));
            let held = ui.interact(rect, id, Sense::drag()).on_hover_cursor(CursorIcon::Grab);
            let held = held.on_hover_text(format!("Drag to move {kind} {}", i + 1));
            let unit = step(plane, &lattice);
            let there = place(at + lattice.axes().inverse() * (unit / 100.0));
            if held.drag_started() {
                let pointer = held.interact_pointer_pos();
                self.taken = pointer.map(|pointer| (plane.point, pointer));
            }
            let pointer = held.interact_pointer_pos().filter(|_| held.dragged());
            if let (Some((from, taken)), Some(pointer), Some(there)) = (self.taken, pointer, there)
            {
                dragged = true;
                let along = followed((there - here) * 100.0, unit.dot(away), area.rect.height());
                move_to(plane, from + unit * moved(along, pointer - taken), &lattice);
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

/// The way on the picture that a hand follows to move a plane by the volume's size: `along`, as its normal is seen, or the
/// picture's height where that is seen nearly end on. `away` is positive for a normal that points away from the eye.
fn followed(along: Vec2, away: f64, height: f32) -> Vec2 {
    match along.length() < LEAST_ALONG * height {
        true => vec2(0.0, if away > 0.0 { -height } else { height }),
        false => along,
    }
}

/// A step along a plane's normal, as long as the volume is large.
fn step(plane: &Plane, lattice: &Lattice) -> DVec3 {
    plane.normal.normalize_or_zero() * 2.0 * lattice.bounding_radius()
}

/// Moves a plane so that it passes a point, no further than the first and the last samples.
fn move_to(plane: &mut Plane, point: DVec3, lattice: &Lattice) {
    let normal = plane.normal.normalize_or_zero();
    let last = DVec3::from(lattice.dims.map(|n| n as f64)) - 1.0;
    // How far the outermost samples lie from the middle along the normal.
    let reach = (lattice.axes().transpose() * normal).abs().dot(last) / 2.0;
    let height = (point - lattice.centre()).dot(normal);
    plane.point = point + normal * (height.max(-reach).min(reach) - height);
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
    use crate::scene::Slice;

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
    fn a_plane_moves_along_its_normal_and_no_further_than_the_samples() {
        let lattice = Lattice::unit([8, 4, 6]);
        let mut plane = Slice::across(&lattice, 0, 0.5, 1.0).plane;
        move_to(&mut plane, lattice.centre() + DVec3::new(1.0, 0.0, 0.0), &lattice);
        assert!((plane.point.x - 4.5).abs() < 1e-12);
        for (to, end) in [(1e3, 7.0), (-1e3, 0.0)] {
            move_to(&mut plane, DVec3::new(to, 0.0, 0.0), &lattice);
            assert!((plane.point.x - end).abs() < 1e-9, "{}", plane.point);
        }
        assert!((step(&plane, &lattice).length() - 2.0 * lattice.bounding_radius()).abs() < 1e-9);
    }

    #[test]
    fn a_plane_that_is_seen_face_on_follows_the_hand_up_and_down() {
        let aslant = vec2(30.0, -60.0);
        assert_eq!(followed(aslant, 1.0, 500.0), aslant);
        // Upwards is away from the eye, whichever side the normal points to.
        assert_eq!(followed(vec2(9.0, 0.0), 1.0, 500.0), vec2(0.0, -500.0));
        assert_eq!(followed(Vec2::ZERO, -1.0, 500.0), vec2(0.0, 500.0));
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
