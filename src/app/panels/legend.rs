//! What the marks on the chart mean. Marks differ in shape and size, not only in colour.

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Color32, FontId, Painter, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, pos2,
    vec2,
};

use crate::app::theme;

/// Height of a row, room for a mark, and room between two entries, points.
const ROW: f32 = 17.0;
const MARK: f32 = 20.0;
const BETWEEN: f32 = 14.0;
/// Size of the words, points.
const FONT: f32 = 11.0;
/// Marks that go around others are smaller here than on the chart, to stay within their row.
const AROUND_NOTHING: f32 = 0.75;

/// A mark on the chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A mode that no other beats in both time and level.
    Best,
    /// A mode that another beats in both.
    Beaten,
    /// Not to be chosen: no mode of its own.
    Aside,
    /// Around the mode on screen.
    OnScreen,
    /// Around the mode it is compared with.
    Compared,
}

impl Mark {
    /// What it means, in a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Best => "Best for its time",
            Self::Beaten => "Beaten by another",
            Self::Aside => "Smaller or coarser, for comparison",
            Self::OnScreen => "On screen",
            Self::Compared => "Compared with it",
        }
    }

    /// Paints it; `large` while it is pointed at, faint where it is `old`.
    pub fn paint(self, painter: &Painter, at: Pos2, large: bool, old: bool) {
        self.paint_around(painter, at, large, old, 1.0);
    }

    /// The same, with `around` the size of marks that go around others.
    fn paint_around(self, painter: &Painter, at: Pos2, large: bool, old: bool, around: f32) {
        let more = if large { 1.5 } else { 0.0 };
        let faint = theme::TEXT_FAINT.gamma_multiply(if old { 0.45 } else { 1.0 });
        let accent = if old { faint } else { theme::ACCENT };
        let ring = |radius: f32, width: f32, colour: Color32| {
            painter.circle_stroke(at, radius, Stroke::new(width, colour));
        };
        match self {
            Self::Best => {
                painter.circle_filled(at, 3.8 + more, accent);
            }
            Self::Beaten => {
                painter.circle_filled(at, 2.4 + more, faint);
            }
            Self::Aside => ring(3.0 + more, 1.2, faint),
            Self::OnScreen => ring(7.0 * around, 1.8, theme::TEXT),
            Self::Compared => {
                let square = Rect::from_center_size(at, Vec2::splat(17.0 * around));
                let stroke = Stroke::new(1.6, theme::NOTE);
                painter.rect_stroke(square, 2.0, stroke, StrokeKind::Middle);
            }
        }
    }
}

/// Where the entries of a legend lie within a width: their upper left corners, and the height.
fn placed(widths: &[f32], width: f32) -> (Vec<Vec2>, f32) {
    let mut at = Vec2::ZERO;
    let mut places = Vec::new();
    for entry in widths {
        if at.x > 0.0 && at.x + entry > width {
            at = vec2(0.0, at.y + ROW);
        }
        places.push(at);
        at.x += entry + BETWEEN;
    }
    (places, at.y + ROW)
}

/// The legend along the lower edge of `room`, in as many rows as it takes; its height, or 0 where
/// it would leave the graph less than `least` of the height.
pub fn legend_ui(ui: &Ui, room: Rect, least: f32, entries: &[Mark]) -> f32 {
    let painter = ui.painter_at(room);
    let font = FontId::proportional(FONT);
    let galleys: Vec<_> = entries
        .iter()
        .map(|mark| painter.layout_no_wrap(mark.words().into(), font.clone(), theme::TEXT_FAINT))
        .collect();
    let widths: Vec<f32> = galleys.iter().map(|galley| MARK + galley.size().x).collect();
    let (places, height) = placed(&widths, room.width());
    let is_too_wide = widths.iter().any(|&width| width > room.width());
    if entries.is_empty() || is_too_wide || room.height() - height < least {
        return 0.0;
    }
    let corner = pos2(room.left(), room.bottom() - height);
    for ((mark, galley), place) in entries.iter().zip(galleys).zip(places) {
        let middle = corner + place + vec2(MARK / 2.0 - 1.0, ROW / 2.0);
        mark.paint_around(&painter, middle, false, false, AROUND_NOTHING);
        let text = corner + place + vec2(MARK, (ROW - galley.size().y) / 2.0);
        painter.galley(text, galley, theme::TEXT_FAINT);
    }
    let rect = Rect::from_min_max(corner, room.max);
    let response = ui.interact(rect, ui.scope_id().with("legend"), Sense::hover());
    let words: Vec<_> = entries.iter().map(|mark| mark.words()).collect();
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Label, true, format!("Legend: {}", words.join(", ")))
    });
    response.on_hover_text(
        "A mode is beaten where another is both quicker and better; the line joins those that are \
         not",
    );
    height
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_wrap_into_rows_and_never_overlap() {
        let widths = [80.0, 90.0, 60.0, 70.0];
        assert_eq!(placed(&widths, 1000.0).1, ROW);
        let (places, height) = placed(&widths, 190.0);
        assert_eq!(height, 2.0 * ROW);
        for (i, (place, width)) in places.iter().zip(widths).enumerate() {
            assert!(place.x + width <= 190.0);
            for (other, its) in places.iter().zip(widths).skip(i + 1) {
                let apart =
                    other.y != place.y || place.x + width <= other.x || other.x + its <= place.x;
                assert!(apart, "{place} {other}");
            }
        }
        assert_eq!(placed(&widths, 10.0).1, 4.0 * ROW);
    }
}
