//! The clip box over the picture: its edges, and a handle on each of its faces.

use eframe::egui::{CursorIcon, Pos2, Rect, Sense, Stroke, Ui, Vec2, vec2};
use glam::{DVec2, DVec3};

use super::panels::clip::LEAST;
use super::theme;
use super::viewport::PixelArea;
use crate::scene::{ClipBox, Scene, View};

/// Radius of a handle, points.
const RADIUS: f32 = 5.0;

/// What is remembered while a handle is held.
#[derive(Debug, Default)]
pub struct BoxHandles {
    /// Where its face was when it was taken, and the pointer.
    taken: Option<(f64, Pos2)>,
}

impl BoxHandles {
    /// Draws the box as `scene`'s camera sees it, and moves the faces that are dragged.
    pub fn show(&mut self, ui: &Ui, area: PixelArea, scene: &mut Scene) {
        let view = View::new(scene, area.size);
        let dims = scene.lattice().dims;
        let Some(bounds) = &mut scene.inside.clip.bounds else { return };
        let points_per_pixel = area.rect.width() / area.size[0] as f32;
        let to_screen = |pixel: DVec2| {
            let pixel = pixel.as_vec2();
            area.rect.min + vec2(pixel.x, pixel.y) * points_per_pixel
        };
        let painter = ui.painter_at(area.rect);
        let [low, high] = bounds.in_index(dims);
        let stroke = Stroke::new(1.0, theme::TEXT_FAINT.gamma_multiply(0.8));
        for ends in view.box_on_picture([low, high]) {
            painter.line_segment(ends.map(to_screen), stroke);
        }
        let mut dragged = false;
        for face in 0..6 {
            let (axis, is_high) = (face / 2, face % 2 == 1);
            let mut at = (low + high) / 2.0;
            at[axis] = if is_high { high[axis] } else { low[axis] };
            let mut unit = DVec3::ZERO;
            unit[axis] = dims[axis] as f64;
            // A hundredth of the volume, so that perspective hardly matters.
            let place = |at: DVec3| view.point_on_picture(at).map(to_screen);
            let (Some(here), Some(there)) = (place(at), place(at + unit / 100.0)) else { continue };
            let along = (there - here) * 100.0;
            let Some(here) = within(area.rect.shrink(2.0 * RADIUS), here) else { continue };
            let handle = Rect::from_center_size(here, Vec2::splat(4.0 * RADIUS));
            let id = ui.scope_id().with(("clip box face", face));
            let held = ui.interact(handle, id, Sense::drag()).on_hover_cursor(CursorIcon::Grab);
            let share = if is_high { bounds.high[axis] } else { bounds.low[axis] };
            if held.drag_started() {
                self.taken = held.interact_pointer_pos().map(|pointer| (share, pointer));
            }
            let pointer = held.interact_pointer_pos().filter(|_| held.dragged());
            if let (Some((from, taken)), Some(pointer)) = (self.taken, pointer) {
                dragged = true;
                set_face(bounds, axis, is_high, from + moved(along, pointer - taken));
            }
            let is_lit = held.hovered() || held.dragged();
            let fill = if is_lit { theme::TEXT } else { theme::AXES[axis] };
            painter.circle(here, RADIUS, fill, Stroke::new(1.0, theme::PANEL));
        }
        if !dragged && !ui.input(|input| input.pointer.any_down()) {
            self.taken = None;
        }
    }
}

/// A place on the picture, or where the line towards it from the picture's middle leaves it: what lies beyond can be taken hold
/// of there. `None` of a picture without room, or a place that is nowhere.
pub(super) fn within(picture: Rect, at: Pos2) -> Option<Pos2> {
    let (middle, half) = (picture.center(), picture.size() / 2.0);
    if !(picture.is_positive() && at.is_finite()) {
        return None;
    }
    let away = at - middle;
    let beyond = (away.x / half.x).abs().max((away.y / half.y).abs());
    Some(if beyond > 1.0 { middle + away / beyond } else { at })
}

/// What share of an axis, which is seen as `along`, a hand that went so far on the picture moved: as it
/// went along it, and nothing where it is seen end on.
pub(super) fn moved(along: Vec2, hand: Vec2) -> f64 {
    let square = along.length_sq();
    if square < 1.0 { 0.0 } else { f64::from(hand.dot(along) / square) }
}

/// Moves a face, no further than to the volume's end and the other face.
fn set_face(bounds: &mut ClipBox, axis: usize, is_high: bool, to: f64) {
    if is_high {
        bounds.high[axis] = to.max(bounds.low[axis] + LEAST).min(1.0);
    } else {
        bounds.low[axis] = to.min(bounds.high[axis] - LEAST).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beyond_the_picture_is_taken_hold_of_at_its_edge() {
        let picture = Rect::from_min_size(Pos2::new(10.0, 20.0), vec2(200.0, 100.0));
        let inside = Pos2::new(15.0, 110.0);
        assert_eq!(within(picture, inside), Some(inside));
        assert_eq!(within(picture, Pos2::new(1110.0, 70.0)), Some(Pos2::new(210.0, 70.0)));
        // Towards it, not beside it: half as far across as down.
        assert_eq!(within(picture, Pos2::new(160.0, 170.0)), Some(Pos2::new(135.0, 120.0)));
        assert_eq!(within(picture, Pos2::new(f32::INFINITY, 0.0)), None);
        assert_eq!(within(Rect::NOTHING, inside), None);
    }

    #[test]
    fn a_face_follows_the_hand_along_its_axis_and_stops_at_the_ends() {
        assert!((moved(vec2(200.0, 0.0), vec2(50.0, 99.0)) - 0.25).abs() < 1e-6);
        assert!((moved(vec2(-100.0, 100.0), vec2(10.0, -10.0)) + 0.1).abs() < 1e-6);
        assert_eq!(moved(vec2(0.1, 0.0), vec2(50.0, 0.0)), 0.0);
        let mut bounds = ClipBox { low: [0.2; 3], high: [0.6; 3] };
        set_face(&mut bounds, 1, true, 1.7);
        set_face(&mut bounds, 2, false, 0.9);
        set_face(&mut bounds, 0, false, -3.0);
        assert_eq!((bounds.low, bounds.high), ([0.0, 0.2, 0.6 - LEAST], [0.6, 1.0, 0.6]));
    }
}
