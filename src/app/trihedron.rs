//! The trihedron under the hand: a click on the end of an axis looks from there.

use eframe::egui::{Align2, CursorIcon, FontId, Rect, Sense, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use super::theme;
use super::viewport::PixelArea;
use crate::core::Camera;
use crate::scene::annotations::AxisEnd;
use crate::scene::{NamedView, Orientation};

/// Half the side of what can be clicked about an end, points.
const REACH: f32 = 9.0;
/// Radius of what is shown of an end that is not written, points.
const RADIUS: f32 = 3.5;

/// Shows the ends under the hand, and returns the view from the one that was clicked. `letters` are those of the ends
/// that the axes point to.
pub(super) fn trihedron_ui(
    ui: &Ui,
    area: PixelArea,
    ends: &[AxisEnd],
    letters: [&'static str; 3],
    (camera, orientation): (&Camera, Orientation),
) -> Option<NamedView> {
    let points_per_pixel = area.rect.width() / area.size[0] as f32;
    let place = |end: &AxisEnd| {
        let at = end.at.as_vec2();
        area.rect.min + vec2(at.x, at.y) * points_per_pixel
    };
    let around = ends.iter().fold(Rect::NOTHING, |all, end| {
        all.union(Rect::from_center_size(place(end), Vec2::splat(2.0 * REACH)))
    });
    let is_near = ui.rect_contains_pointer(around);
    let painter = ui.painter_at(area.rect);
    let mut chosen = None;
    // The nearest to the eye come last, and so lie over the others.
    for end in ends {
        let rect = Rect::from_center_size(place(end), Vec2::splat(2.0 * REACH));
        let name = end_name(end, letters);
        let id = ui.scope_id().with(("end of an axis", end.axis, end.is_positive));
        let hand = ui.interact(rect, id, Sense::click()).on_hover_cursor(CursorIcon::PointingHand);
        hand.widget_info(|| {
            let name = format!("Look from {name}");
            eframe::egui::WidgetInfo::labeled(eframe::egui::accesskit::Role::Button, true, name)
        });
        if is_near && !end.is_positive {
            let colour = theme::AXES[end.axis].gamma_multiply(0.8);
            painter.circle(rect.center(), RADIUS, theme::PANEL, Stroke::new(1.5, colour));
        }
        let (from, is_there) = looked_from(end, camera);
        if hand.hovered() {
            let stroke = Stroke::new(1.5, theme::TEXT);
            painter.circle_stroke(rect.center(), RADIUS + 2.5, stroke);
            if !end.is_positive {
                let font = FontId::proportional(11.0);
                let beside = rect.center() - vec2(0.0, 2.0 * RADIUS);
                painter.text(beside, Align2::CENTER_BOTTOM, &name, font, theme::TEXT);
            }
        }
        let words = match is_there {
            true => format!("Seen from {name} now: click to look from the other side"),
            false => format!("Click to look from {name}"),
        };
        if hand.on_hover_text(words).clicked() {
            chosen = NamedView::from_axis(from, orientation);
        }
    }
    chosen
}

/// Where a click on an end looks from, a unit vector: from its end, or from the other one where it is seen from there.
/// Whether it is.
fn looked_from(end: &AxisEnd, camera: &Camera) -> (DVec3, bool) {
    let mut from = DVec3::ZERO;
    from[end.axis] = if end.is_positive { 1.0 } else { -1.0 };
    let is_there = camera.direction.dot(from) < -1.0 + 1e-9;
    (if is_there { -from } else { from }, is_there)
}

/// What an end is called: a side of a patient, or an axis with its sign.
fn end_name(end: &AxisEnd, letters: [&'static str; 3]) -> String {
    let letter = letters[end.axis];
    let sides = [
        ("L", "the left", "the right"),
        ("R", "the right", "the left"),
        ("P", "behind", "the front"),
        ("A", "the front", "behind"),
        ("S", "above", "below"),
    ];
    match sides.into_iter().find(|(known, ..)| *known == letter) {
        Some((_, towards, away)) => if end.is_positive { towards } else { away }.to_owned(),
        None if end.is_positive => format!("+{letter}"),
        None => format!("−{letter}"),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn ends_are_called_by_the_sides_of_a_patient_or_by_their_signs() {
        let end = |axis, is_positive| AxisEnd { axis, is_positive, at: DVec2::ZERO };
        let ras = ["R", "A", "S"];
        assert_eq!(end_name(&end(0, true), ras), "the right");
        assert_eq!(end_name(&end(1, false), ras), "behind");
        assert_eq!(end_name(&end(2, false), ["L", "P", "S"]), "below");
        assert_eq!(end_name(&end(1, false), ["x", "y", "z"]), "−y");
    }
}
