//! The colour bar under the graph, and its stops: click for a new one, pull, remove.

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Color32, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Sense, Stroke, StrokeKind,
    Ui, WidgetInfo, pos2, vec2,
};

use super::curve::{PULL_OUT, insert_point, move_point, nearest, remove_point};
use super::graph::{Axes, paint_colours, to_screen};
use super::row_ui;
use super::transfer::{step_button, steps_ui, value_ui};
use crate::app::theme;
use crate::core::Srgb8;
use crate::transfer::{ColourSource, TransferFunction};
use crate::volume::Statistics;

/// Height of the bar, points.
pub(super) const BAR_HEIGHT: f32 = 14.0;

/// A press this close to a stop takes it, points: less than half of the way to the next one of a map
/// that was turned into stops.
const GRAB: f32 = 7.0;

type Stops = Vec<(f64, Srgb8)>;

/// What the hand is doing with the stops. Only the selection outlives a drag.
#[derive(Debug, Clone, Default)]
pub struct StopEditor {
    /// The stop whose value and colour are shown.
    pub selected: usize,
    held: Option<Held>,
}

impl StopEditor {
    /// Lets go of what is held.
    pub fn let_go(&mut self) {
        self.held = None;
    }
}

#[derive(Debug, Clone, Copy)]
struct Held {
    index: usize,
    /// From the pointer to the stop when it was taken.
    offset: f32,
    pulled_out: bool,
}

/// The bar over the graph's values, with its stops where there are any.
pub(super) fn bar_ui(
    ui: &mut Ui,
    editor: &mut StopEditor,
    transfer: &mut TransferFunction,
    graph: Axes,
) {
    let size = vec2(ui.available_width(), BAR_HEIGHT);
    let (outer, response) = ui.allocate_exact_size(size, Sense::drag());
    let name = "Colours by value";
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), name));
    let bar = Rect::from_x_y_ranges(graph.rect.x_range(), outer.y_range());
    let axes = Axes { rect: bar, ..graph };
    if let ColourSource::Stops(_) = &transfer.colour {
        handle_stops(ui, &response, editor, transfer, axes);
    } else {
        response.clone().on_hover_text("To change single colours, press Edit below");
    }
    let painter = ui.painter_at(outer.expand(3.0));
    paint_colours(&painter, axes, transfer);
    painter.rect_stroke(bar, 2.0, Stroke::new(1.0, theme::LINE), StrokeKind::Outside);
    if let ColourSource::Stops(stops) = &transfer.colour {
        paint_stops(&painter, axes, stops, editor, response.hover_pos());
    }
}

fn x_of(axes: Axes, stop: (f64, Srgb8)) -> f32 {
    axes.x(stop.0)
}

fn stop_near(stops: &Stops, axes: Axes, at: Pos2) -> Option<usize> {
    let distances = stops.iter().map(|&stop| (x_of(axes, stop) - at.x).abs());
    nearest(distances.enumerate(), GRAB)
}

/// Puts a stop of the colour that is there already in its place, and returns its index.
fn insert_stop(transfer: &mut TransferFunction, value: f64) -> usize {
    let [r, g, b, _] = to_screen(transfer.colour_at(value)).to_array();
    let ColourSource::Stops(stops) = &mut transfer.colour else { return 0 };
    insert_point(stops, value, Srgb8([r, g, b]))
}

fn handle_stops(
    ui: &Ui,
    response: &Response,
    editor: &mut StopEditor,
    transfer: &mut TransferFunction,
    axes: Axes,
) {
    let right_click = ui.input(|input| input.pointer.button_clicked(PointerButton::Secondary));
    let ColourSource::Stops(stops) = &mut transfer.colour else { return };
    if let Some(at) = response.hover_pos() {
        let near = stop_near(stops, axes, at);
        let cursor = if near.is_some() { CursorIcon::PointingHand } else { CursorIcon::Copy };
        ui.ctx().set_cursor_icon(cursor);
        if right_click && let Some(index) = near {
            remove_point(stops, index);
            editor.held = None;
        }
    }
    let Some(at) = response.interact_pointer_pos() else { return };
    if response.drag_started_by(PointerButton::Primary) {
        let index = match stop_near(stops, axes, at) {
            Some(index) => index,
            None => insert_stop(transfer, axes.value(at.x)),
        };
        let ColourSource::Stops(stops) = &transfer.colour else { return };
        let offset = stops.get(index).map_or(0.0, |&stop| x_of(axes, stop) - at.x);
        editor.held = Some(Held { index, offset, pulled_out: false });
        editor.selected = index;
    }
    let ColourSource::Stops(stops) = &mut transfer.colour else { return };
    let Some(held) = &mut editor.held else { return };
    if response.dragged_by(PointerButton::Primary) {
        held.pulled_out = (at.y - axes.rect.center().y).abs() > PULL_OUT && stops.len() > 1;
        if !held.pulled_out && response.drag_delta().x != 0.0 {
            move_point(stops, held.index, axes.value(at.x + held.offset));
        }
    }
    if response.drag_stopped() {
        if held.pulled_out {
            remove_point(stops, held.index);
        }
        editor.held = None;
    }
}

fn paint_stops(
    painter: &Painter,
    axes: Axes,
    stops: &Stops,
    editor: &StopEditor,
    hover: Option<Pos2>,
) {
    let near = hover.and_then(|at| stop_near(stops, axes, at));
    for (index, &stop) in stops.iter().enumerate() {
        let at = pos2(x_of(axes, stop), axes.rect.center().y);
        if !axes.rect.expand(1.0).contains(at) {
            continue;
        }
        let is_held = editor.held.filter(|held| held.index == index);
        let radius = if near == Some(index) || is_held.is_some() { 6.0 } else { 5.0 };
        let line = match (is_held, editor.selected == index) {
            (Some(Held { pulled_out: true, .. }), _) => theme::ERROR,
            (_, true) => Color32::WHITE,
            _ => theme::TEXT_FAINT,
        };
        let Srgb8([r, g, b]) = stop.1;
        // Dark between the ring and the bar, so that it shows on any colour.
        painter.circle(at, radius + 1.0, Color32::BLACK, Stroke::NONE);
        painter.circle(at, radius - 1.0, Color32::from_rgb(r, g, b), Stroke::new(1.5, line));
    }
}

/// Value and colour of the chosen stop.
pub(super) fn stop_ui(
    ui: &mut Ui,
    editor: &mut StopEditor,
    stops: &mut Stops,
    statistics: &Statistics,
) {
    editor.selected = editor.selected.min(stops.len().saturating_sub(1));
    let index = editor.selected;
    let Some(&(mut value, Srgb8(mut colour))) = stops.get(index) else { return };
    row_ui(ui, "Chosen colour", |ui| {
        let response = value_ui(ui, "Colour point value", &mut value, statistics)
            .on_hover_text("The value that has the chosen colour, in the data's own units");
        if response.changed() {
            move_point(stops, index, value);
        }
        ui.color_edit_button_srgb(&mut colour)
            .accessible_name("Colour point colour")
            .on_hover_text("The chosen colour; between two chosen ones colours are mixed");
        stops[index].1 = Srgb8(colour);
        let last = stops.len() - 1;
        steps_ui(ui, &mut editor.selected, last, "colour");
        if step_button(ui, "×", "Remove colour", last > 0).clicked() {
            remove_point(stops, index);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transfer() -> TransferFunction {
        let stops = vec![(0.0, Srgb8::BLACK), (100.0, Srgb8::WHITE)];
        TransferFunction::of(vec![], ColourSource::Stops(stops))
    }

    #[test]
    fn a_new_stop_changes_no_colour_yet() {
        let mut t = transfer();
        assert_eq!(insert_stop(&mut t, 50.0), 1);
        let before = transfer();
        for value in 0..=100 {
            let (a, b) = (t.colour_at(f64::from(value)).0, before.colour_at(f64::from(value)).0);
            assert!((a[0] - b[0]).abs() < 0.005, "{value}: {a:?} {b:?}");
        }
    }
}
