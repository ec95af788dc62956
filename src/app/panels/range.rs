//! A range with two handles, each of which is also a number.

use eframe::egui::{
    CornerRadius, CursorIcon, Rect, Sense, Stroke, StrokeKind, TextStyle, Ui, WidgetText, pos2,
    vec2,
};

use super::{NUMBER_WIDTH, row_ui, typed, wide_number_ui};
use crate::app::theme;
use crate::volume::Coordinates;

/// Width of a handle, points.
const HANDLE: f32 = 8.0;

/// What the ends of a range are told in.
#[derive(Debug, Clone)]
pub(super) enum Numbers<'a> {
    /// Shares of the whole.
    Percent,
    /// Coordinates, and what lengths are given in where that is known.
    Coordinates(Coordinates, Option<&'a str>),
}

impl Numbers<'_> {
    /// The number of a share, and the least and the greatest that can be chosen. The whole ends where the file's places do, not
    /// with the samples that were made over these.
    fn shown(&self, share: f64) -> (f64, [f64; 2]) {
        match self {
            Self::Percent => (share * 100.0, [0.0, 100.0]),
            Self::Coordinates(along, _) => {
                let [low, high] = along.ends;
                let shown = match share {
                    share if share <= 0.0 => low,
                    share if share >= 1.0 => high,
                    share => along.at(share).clamp(low, high),
                };
                (shown, along.ends)
            }
        }
    }

    fn share(&self, shown: f64) -> f64 {
        match self {
            Self::Percent => shown / 100.0,
            Self::Coordinates(along, _) if shown <= along.ends[0] => 0.0,
            Self::Coordinates(along, _) if shown >= along.ends[1] => 1.0,
            Self::Coordinates(along, _) => along.share(shown),
        }
    }

    fn words(&self, shown: f64) -> String {
        match self {
            // No wider than its place: whole ones without their point.
            Self::Percent => ((shown * 10.0).round() / 10.0).to_string(),
            Self::Coordinates(along, _) => along.words(shown),
        }
    }

    /// What stands behind a number.
    fn suffix(&self) -> &'static str {
        if matches!(self, Self::Percent) { "%" } else { "" }
    }

    /// Room for either end wherever it is, points.
    fn width(&self, ui: &Ui) -> f32 {
        let width = |share: f64| {
            let words = WidgetText::from(self.words(self.shown(share).0) + self.suffix());
            words.into_galley(ui, None, f32::INFINITY, TextStyle::Button).size().x
        };
        // One between the ends has all digits.
        let longest =
            [0.0, 0.123_456_7, 0.876_543_3, 1.0].map(width).into_iter().fold(0.0, f32::max);
        NUMBER_WIDTH.max(longest + 2.0 * ui.spacing().button_padding.x)
    }
}

/// A row of a part of 0..=1: its ends as numbers, and between them a track with a handle for each. Neither end comes nearer to
/// the other than `least`.
pub(super) fn range_ui(
    ui: &mut Ui,
    (name, numbers): (&str, &Numbers<'_>),
    [low, high]: [&mut f64; 2],
    least: f64,
    help: &str,
) {
    let label = match numbers {
        Numbers::Coordinates(_, Some(unit)) => format!("{name} ({unit})"),
        _ => name.to_owned(),
    };
    row_ui(ui, &label, |ui| {
        let number_width = numbers.width(ui);
        let number = |ui: &mut Ui, share: &mut f64, name: String, [from, to]: [f64; 2]| {
            let (mut shown, [low, high]) = numbers.shown(*share);
            let [least, most] = [from, to].map(|share| numbers.shown(share).0);
            let speed = (high - low) / 400.0;
            let drag = typed::number(ui, &name, &mut shown, least..=most).speed(speed);
            let drag = drag.custom_formatter(|shown, _| numbers.words(shown));
            let response = wide_number_ui(ui, &name, number_width, drag.suffix(numbers.suffix()));
            if response.on_hover_text(help).changed() {
                *share = numbers.share(shown);
            }
        };
        number(ui, low, format!("{name} from"), [0.0, *high - least]);
        *low = low.clamp(0.0, 1.0 - least);
        *high = high.max(*low + least);
        let spacing = ui.spacing().item_spacing.x;
        let width = (ui.available_width() - number_width - spacing).max(24.0);
        let size = vec2(width, ui.spacing().interact_size.y);
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        track_ui(ui, name, rect, [&mut *low, &mut *high], least);
        number(ui, high, format!("{name} to"), [*low + least, 1.0]);
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
