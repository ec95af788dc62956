//! The opacity curve drawn with the hand.

use eframe::egui::{CursorIcon, PointerButton, Response, Ui};

use super::graph::Axes;
use crate::transfer::{TransferFunction, redrawn};

/// A line being drawn.
#[derive(Debug, Clone)]
pub struct Stroke {
    /// The points before it.
    before: Vec<(f64, f64)>,
    /// Opacity of each column of the graph, as far as it was drawn.
    columns: Vec<Option<f64>>,
    /// The column and the opacity at which the pointer was last.
    last: (usize, f64),
}

impl Stroke {
    /// Begins a line at a place.
    fn start(before: &TransferFunction, count: usize, at: (usize, f64)) -> Self {
        let mut columns = vec![None; count];
        columns[at.0] = Some(at.1);
        Self { before: before.opacity.clone(), columns, last: at }
    }

    /// Draws on, straight from where the pointer was last.
    fn go_to(&mut self, (column, opacity): (usize, f64)) {
        let (from, start) = self.last;
        let steps = column.abs_diff(from).max(1);
        for i in 0..=steps {
            let f = i as f64 / steps as f64;
            let at = from.min(column)
                + if column > from {
                    i
                } else {
                    from.abs_diff(column) - i.min(from.abs_diff(column))
                };
            if let Some(place) = self.columns.get_mut(at) {
                *place = Some(start * (1.0 - f) + opacity * f);
            }
        }
        self.last = (column, opacity);
    }

    /// The drawn columns: what they stand for, low to high.
    fn drawn(&self, axes: Axes) -> Vec<(f64, f64)> {
        let count = self.columns.len().max(2) - 1;
        let value = |column: usize| {
            let f = column as f64 / count as f64;
            axes.low * (1.0 - f) + axes.high * f
        };
        let columns = self.columns.iter().enumerate();
        columns.filter_map(|(i, opacity)| Some((value(i), (*opacity)?))).collect()
    }
}

/// What the hand drew since the last pass. While it draws, every column is a point; once it is let
/// go, as few as follow the line.
pub(super) fn handle_freehand(
    ui: &Ui,
    response: &Response,
    stroke: &mut Option<Stroke>,
    transfer: &mut TransferFunction,
    axes: Axes,
) {
    if response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    if let Some(at) = response.interact_pointer_pos() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a width")]
        let count = (axes.rect.width() as usize).max(2);
        let fraction = ((at.x - axes.rect.left()) / axes.rect.width()).clamp(0.0, 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a column")]
        let column = (fraction * (count - 1) as f32).round() as usize;
        let place = (column, axes.opacity(at.y));
        if response.drag_started_by(PointerButton::Primary) {
            *stroke = Some(Stroke::start(transfer, count, place));
        }
        if response.dragged_by(PointerButton::Primary)
            && let Some(stroke) = stroke
            && stroke.columns.len() == count
        {
            stroke.go_to(place);
            transfer.opacity = redrawn(&stroke.before, &stroke.drawn(axes), false);
        }
    }
    if response.drag_stopped()
        && let Some(stroke) = stroke.take()
    {
        transfer.opacity = redrawn(&stroke.before, &stroke.drawn(axes), true);
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Rect, pos2, vec2};

    use super::*;
    use crate::transfer::{ColourMap, ColourSource};

    #[test]
    fn a_line_is_drawn_both_ways_and_the_later_pass_counts() {
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 1.0] };
        let before = TransferFunction::of(vec![(0.0, 0.5)], colour);
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(101.0, 100.0));
        let axes = Axes { rect, low: 0.0, high: 100.0 };
        let mut stroke = Stroke::start(&before, 101, (20, 0.0));
        stroke.go_to((40, 1.0));
        assert_eq!(stroke.drawn(axes).len(), 21);
        assert_eq!(stroke.drawn(axes)[10], (30.0, 0.5));
        stroke.go_to((30, 0.0));
        let drawn = stroke.drawn(axes);
        assert_eq!([drawn[0], drawn[10], drawn[20]], [(20.0, 0.0), (30.0, 0.0), (40.0, 1.0)]);
        assert_eq!(drawn[15], (35.0, 0.5), "on the way back");
        stroke.go_to((30, 0.75));
        assert_eq!(stroke.drawn(axes)[10].1, 0.75, "up and down in one column");
    }
}
