//! Window and level with the hand: a drag over the picture moves the range of the colours, and the
//! opacities along with it.

use eframe::egui::{Align2, FontId, PointerButton, Rect, Response, Ui, vec2};

use super::camera_control::drag_delta;
use super::panels::stretch::stretch;
use super::{theme, words};
use crate::transfer::{Gaussian, TransferFunction};
use crate::volume::Statistics;

/// The window is never less than this part of the values' range.
const LEAST: f64 = 1e-3;

/// The tool: whether a drag with the left button changes window and level instead of the view.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Leveling {
    /// Whether it is chosen.
    pub on: bool,
}

/// The range after a drag by parts of the viewport's width (right) and height (down): to the right
/// the window widens, upwards the level rises. A drag over all of the viewport is as much as the
/// values' own range. A reversed range stays one.
fn leveled(range: [f64; 2], drag: [f64; 2], statistics: &Statistics) -> [f64; 2] {
    // Halved, so that ±1e308 does not overflow; outliers do not count.
    let ends = [0.005, 0.995].map(|fraction| statistics.quantile(fraction) / 2.0);
    let own = [statistics.min / 2.0, statistics.max / 2.0];
    let ends = if ends[0] < ends[1] { ends } else { own };
    let half_span = ends[1] - ends[0];
    let half = range[1] / 2.0 - range[0] / 2.0;
    let sign = if half < 0.0 { -1.0 } else { 1.0 };
    let half = sign * (half.abs() + drag[0] * half_span).max(LEAST * half_span);
    let level = range[0] / 2.0 + range[1] / 2.0 - 2.0 * drag[1] * half_span;
    [level - half, level + half]
}

impl Leveling {
    /// Whether a drag is this tool's, which it then does.
    pub fn drag(
        self,
        response: &Response,
        transfer: &mut TransferFunction,
        gaussians: &mut [Gaussian],
        statistics: &Statistics,
    ) -> bool {
        let range = transfer.colour.range();
        let dragged = self.dragged(response, range, statistics);
        if let Some(to) = dragged.filter(|to| *to != range) {
            stretch(transfer, gaussians, to);
        }
        dragged.is_some()
    }

    /// The same of a range that projected values have of their own.
    pub fn drag_range(
        self,
        response: &Response,
        range: &mut [f64; 2],
        statistics: &Statistics,
    ) -> bool {
        let dragged = self.dragged(response, *range, statistics);
        *range = dragged.unwrap_or(*range);
        dragged.is_some()
    }

    /// Where a range is after a drag that is this tool's; `None` where it is none.
    fn dragged(
        self,
        response: &Response,
        range: [f64; 2],
        statistics: &Statistics,
    ) -> Option<[f64; 2]> {
        let shift = response.ctx.input(|input| input.modifiers.shift);
        if !self.on || shift || !response.dragged_by(PointerButton::Primary) {
            return None;
        }
        let (by, size) = (drag_delta(response), response.rect.size());
        if by == eframe::egui::Vec2::ZERO {
            return Some(range);
        }
        let drag = [f64::from(by.x / size.x), f64::from(by.y / size.y)];
        Some(leveled(range, drag, statistics))
    }

    /// Says over the picture what window and level are while the tool is chosen.
    pub fn caption_ui(self, ui: &Ui, viewport: Rect, transfer: &TransferFunction) {
        if !self.on {
            return;
        }
        let [low, high] = transfer.colour.range();
        let window = words::value((high / 2.0 - low / 2.0) * 2.0);
        let level = words::value(low / 2.0 + high / 2.0);
        let text = format!("Window {window}, level {level} – drag to change, W or Escape to stop");
        let at = viewport.center_bottom() - vec2(0.0, 14.0);
        let font = FontId::proportional(13.0);
        let galley = ui.painter().layout_no_wrap(text, font, theme::TEXT);
        let rect = Align2::CENTER_BOTTOM.anchor_size(at, galley.size());
        ui.painter().rect_filled(rect.expand2(vec2(10.0, 5.0)), 5.0, theme::PANEL);
        ui.painter().galley(rect.min, galley, theme::TEXT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Ticket;
    use crate::volume::Samples;

    #[test]
    fn right_widens_the_window_and_up_raises_the_level() {
        let samples = Samples::Float64((0..=1000).map(f64::from).collect());
        let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
        let near =
            |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 2.0 && (a[1] - b[1]).abs() < 2.0;
        let wider = leveled([400.0, 600.0], [0.1, 0.0], &statistics);
        assert!(near(wider, [350.0, 650.0]), "{wider:?}");
        let higher = leveled([400.0, 600.0], [0.0, -0.1], &statistics);
        assert!(near(higher, [500.0, 700.0]), "{higher:?}");
        let reversed = leveled([600.0, 400.0], [0.1, 0.0], &statistics);
        assert!(near(reversed, [650.0, 350.0]), "{reversed:?}");
        let [low, high] = leveled([400.0, 600.0], [-9.0, 0.0], &statistics);
        assert!(low < high && high - low < 2.0, "{low} {high}");
    }

    #[test]
    fn the_widest_and_the_narrowest_values_stay_finite() {
        for values in [vec![f64::MIN, f64::MAX], vec![5.0; 3], vec![f64::NAN]] {
            let samples = Samples::Float64(values);
            let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
            let [low, high] = leveled([-1.0, 1.0], [0.01, 0.01], &statistics);
            assert!(low.is_finite() && high.is_finite() && low < high, "{low} {high}");
        }
    }
}
