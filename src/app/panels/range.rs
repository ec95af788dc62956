//! A range with two handles, each of which is also a number.

use eframe::egui::{
    CornerRadius, CursorIcon, DragValue, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2,
};

use super::{NUMBER_WIDTH, number_ui, row_ui};
use crate::app::theme;

/// Width of a handle, points.
const HANDLE: f32 = 8.0;

/// A row of a part of 0..=1, in percent: its ends as numbers, and between them a track with a handle
/// for each. Neither end comes nearer to the other than `least`.
pub(super) fn range_ui(
    ui: &mut Ui,
    name: &str,
    [low, high]: [&mut f64; 2],
    least: f64,
    help: &str,
) {
    row_ui(ui, name, |ui| {
        let percent = |ui: &mut Ui, value: &mut f64, name: String| {
            let mut shown = *value * 100.0;
            let drag = DragValue::new(&mut shown).speed(0.25).range(0.0..=100.0);
            // No wider than its place: whole ones without their point.
            let drag =
                drag.custom_formatter(|percent, _| format!("{}", (percent * 10.0).round() / 10.0));
            let response = number_ui(ui, &name, drag.suffix("%"));
            if response.on_hover_text(help).changed() {
                *value = shown / 100.0;
            }
        };
        percent(ui, low, format!("{name} from"));
        *low = low.clamp(0.0, 1.0 - least);
        *high = high.max(*low + least);
        let spacing = ui.spacing().item_spacing.x;
        let width = (ui.available_width() - NUMBER_WIDTH - spacing).max(40.0);
        let size = vec2(width, ui.spacing().interact_size.y);
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        track_ui(ui, name, rect, [&mut *low, &mut *high], least);
        percent(ui, high, format!("{name} to"));
        *high = high.clamp(least, 1.0);
        *low = low.min(*high - least);
    });
}

fn track_ui(ui: &Ui, name: &str, rect: Rect, [low, high]: [&mut f64; 2], least: f64) {
    let inner = rect.shrink2(vec2(HANDLE / 2.0, 0.0));
    let x = |share: f64| inner.left() + inner.width() * share as f32;
    let share = |x: f32| f64::from((x - inner.left()) / inner.width()).clamp(0.0, 1.0);
    let track = Rect::from_center_size(rect.center(), vec2(rect.width(), 4.0));
    let painter = ui.painter();
    painter.rect_filled(track, CornerRadius::same(2), theme::WELL);
    let kept = Rect::from_x_y_ranges(x(*low)..=x(*high), track.y_range());
    painter.rect_filled(kept, CornerRadius::same(2), theme::ACCENT.gamma_multiply(0.6));
    for end in 0..2 {
        let at = if end == 0 { *low } else { *high };
        let handle = Rect::from_center_size(pos2(x(at), rect.center().y), vec2(HANDLE, 16.0));
        // Numbers beside it say what the handles do to those who cannot see them.
        let id = ui.scope_id().with((name, "handle", end));
        let held = ui.interact(handle.expand(2.0), id, Sense::drag());
        let held = held.on_hover_cursor(CursorIcon::ResizeHorizontal);
        if let Some(pointer) = held.interact_pointer_pos().filter(|_| held.dragged()) {
            let to = share(pointer.x);
            if end == 0 {
                *low = to.min(*high - least).max(0.0);
            } else {
                *high = to.max(*low + least).min(1.0);
            }
        }
        let is_lit = held.hovered() || held.dragged();
        let fill = if is_lit { theme::TEXT } else { theme::ACCENT };
        painter.rect(
            handle,
            CornerRadius::same(3),
            fill,
            Stroke::new(1.0, theme::LINE),
            StrokeKind::Inside,
        );
    }
}
