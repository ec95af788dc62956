//! From values to opacity and colour: the curve, the colour map, the range.

use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Atom, AtomExt as _, Button, ComboBox, DragValue, IdSalt, Rect, Response, RichText, Shape, Ui,
    pos2, vec2,
};

use super::curve::{self, CurveEditor, curve_ui, remove_point};
use super::name_ui;
use crate::app::{theme, words};
use crate::core::LinearRgb;
use crate::transfer::presets::{self, RangeRule};
use crate::transfer::{ColourMap, ColourSource, TransferFunction};
use crate::volume::Statistics;

/// Size of a colour map's swatch, points.
const SWATCH: eframe::egui::Vec2 = vec2(56.0, 10.0);

/// The range of values that the colours span.
pub fn colour_range(transfer: &TransferFunction) -> [f64; 2] {
    match &transfer.colour {
        ColourSource::Map { range, .. } => *range,
        ColourSource::Stops(stops) => {
            let end = |stop: Option<&(f64, _)>| stop.map_or(0.0, |(value, _)| *value);
            [end(stops.first()), end(stops.last())]
        }
    }
}

/// Stretches colours and opacities alike from their range to `to`.
///
/// A range without width has no inner proportions: opacities then keep their values.
pub fn stretch(transfer: &mut TransferFunction, to: [f64; 2]) {
    let from = colour_range(transfer);
    if from == to || !to.iter().all(|v| v.is_finite()) {
        return;
    }
    let width = from[1] / 2.0 - from[0] / 2.0;
    let moved = |value: f64| {
        let fraction = (value / 2.0 - from[0] / 2.0) / width;
        to[0] * (1.0 - fraction) + to[1] * fraction
    };
    if width != 0.0 {
        for point in &mut transfer.opacity {
            point.0 = moved(point.0);
        }
        // A reversed range reverses the order.
        transfer.opacity.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    match &mut transfer.colour {
        ColourSource::Map { range, .. } => *range = to,
        ColourSource::Stops(stops) if width != 0.0 => {
            for stop in stops.iter_mut() {
                stop.0 = moved(stop.0);
            }
            stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        ColourSource::Stops(_) => {}
    }
}

/// The section; `default` makes the function that a fresh file would get.
pub fn transfer_ui(
    ui: &mut Ui,
    editor: &mut CurveEditor,
    transfer: &mut TransferFunction,
    statistics: &Statistics,
    default: impl FnOnce() -> TransferFunction,
) {
    let colours = colour_range(transfer);
    curve_ui(ui, editor, transfer, statistics, colours);
    let caption = "Drag a point, press on the line to add one, right-click to remove it";
    ui.label(RichText::new(caption).size(11.0).color(theme::TEXT_FAINT));
    point_ui(ui, editor, transfer, statistics);
    ui.add_space(4.0);
    map_ui(ui, transfer);
    range_ui(ui, transfer, statistics);
    ui.horizontal_wrapped(|ui| {
        let whole = presets::range(statistics, RangeRule::MinMax);
        if ui
            .button("Min–max")
            .on_hover_text("Stretch colours and opacities over the whole range of the data")
            .clicked()
        {
            stretch(transfer, whole);
        }
        let middle = presets::range(statistics, RangeRule::Percentiles);
        if ui
            .button("Percentiles")
            .on_hover_text(
                "Stretch colours and opacities over the middle 99 % of the values, so that a few \
                 outliers do not spoil the rest",
            )
            .clicked()
            && middle[0] < middle[1]
        {
            stretch(transfer, middle);
        }
        if ui
            .button("Reset to default")
            .on_hover_text("Back to what this file looked like when it was opened")
            .clicked()
        {
            *transfer = default();
            editor.selected = 0;
        }
    });
    ui.checkbox(&mut editor.zoomed, "Zoom graph to range")
        .on_hover_text("Show only the range of the colours in the graph, not all of the data");
}

/// Numbers of the selected point.
fn point_ui(
    ui: &mut Ui,
    editor: &mut CurveEditor,
    transfer: &mut TransferFunction,
    statistics: &Statistics,
) {
    let index = editor.selected;
    let Some(&(mut value, mut opacity)) = transfer.opacity.get(index) else { return };
    ui.horizontal(|ui| {
        name_ui(ui, "Point");
        let value_response = ui
            .add(value_drag(&mut value, statistics))
            .accessible_name("Point value")
            .on_hover_text("The value at which the selected point lies, in the data's own units");
        let drag = DragValue::new(&mut opacity).speed(0.005).range(0.0..=1.0).max_decimals(4);
        let opacity_response = ui
            .add(drag)
            .accessible_name("Point opacity")
            .on_hover_text("Opacity per unit distance at the selected point, 0 to 1");
        if value_response.changed() || opacity_response.changed() {
            curve::move_point(transfer, index, value, opacity);
        }
        let last = transfer.opacity.len() - 1;
        if step_button(ui, "‹", "Previous point", index > 0).clicked() {
            editor.selected -= 1;
        }
        if step_button(ui, "›", "Next point", index < last).clicked() {
            editor.selected += 1;
        }
        if step_button(ui, "×", "Remove point", last > 0).clicked() {
            remove_point(transfer, index);
        }
    });
}

fn step_button(ui: &mut Ui, symbol: &str, name: &str, enabled: bool) -> Response {
    ui.add_enabled(enabled, Button::new(symbol).small()).accessible_name(name).on_hover_text(name)
}

/// A drag value over the range of the data, in its own units.
fn value_drag<'a>(value: &'a mut f64, statistics: &Statistics) -> DragValue<'a> {
    let width = statistics.max / 2.0 - statistics.min / 2.0;
    let speed = if width > 0.0 { width / 150.0 } else { 0.01 };
    DragValue::new(value).speed(speed).custom_formatter(|v, _| words::value(v))
}

fn map_ui(ui: &mut Ui, transfer: &mut TransferFunction) {
    let range = colour_range(transfer);
    let chosen = match &transfer.colour {
        ColourSource::Map { map, .. } => Some(*map),
        ColourSource::Stops(_) => None,
    };
    ui.horizontal(|ui| {
        let name = name_ui(ui, "Colours");
        let selected = chosen.map_or_else(|| "Custom".to_owned(), words::colour_map);
        let combo = ComboBox::from_id_salt("colour map").selected_text(selected).height(360.0);
        let shown = combo.show_ui(ui, |ui| {
            for map in ColourMap::ALL {
                if map_choice_ui(ui, map, chosen == Some(map)).clicked() {
                    transfer.colour = ColourSource::Map { map, range };
                }
            }
        });
        shown.response.labelled_by(name.id).on_hover_text(
            "The colours of low to high values; the first five are equally readable \
                            for most colour-blind people and in print",
        );
    });
}

/// One colour map in the list, with its swatch.
fn map_choice_ui(ui: &mut Ui, map: ColourMap, selected: bool) -> Response {
    let swatch = IdSalt::new("swatch");
    let atoms = (Atom::custom(swatch, SWATCH), words::colour_map(map).atom_grow(true));
    let shown = Button::selectable(selected, atoms).atom_ui(ui);
    if let Some(rect) = shown.rect(swatch) {
        paint_map(ui, rect, map);
    }
    shown.response
}

fn paint_map(ui: &Ui, rect: Rect, map: ColourMap) {
    let stops = map.stops();
    let mut mesh = Mesh::default();
    for (i, stop) in stops.iter().enumerate() {
        let fraction = i as f32 / (stops.len() - 1).max(1) as f32;
        let x = rect.left() + fraction * rect.width();
        let colour = curve::to_screen(LinearRgb(stop.to_linear().0));
        mesh.colored_vertex(pos2(x, rect.top()), colour);
        mesh.colored_vertex(pos2(x, rect.bottom()), colour);
        if i + 1 < stops.len()
            && let Ok(at) = u32::try_from(2 * i)
        {
            mesh.add_triangle(at, at + 1, at + 2);
            mesh.add_triangle(at + 1, at + 2, at + 3);
        }
    }
    ui.painter().add(Shape::mesh(mesh));
}

fn range_ui(ui: &mut Ui, transfer: &mut TransferFunction, statistics: &Statistics) {
    let mut range = colour_range(transfer);
    let help = "The values that take the first and the last colour; the opacities stretch along";
    ui.horizontal(|ui| {
        name_ui(ui, "Range");
        let [low, high] = &mut range;
        let low =
            ui.add(value_drag(low, statistics)).accessible_name("Range low").on_hover_text(help);
        name_ui(ui, "to");
        let high =
            ui.add(value_drag(high, statistics)).accessible_name("Range high").on_hover_text(help);
        if low.changed() || high.changed() {
            stretch(transfer, range);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Srgb8;

    fn transfer() -> TransferFunction {
        TransferFunction {
            opacity: vec![(0.0, 0.0), (25.0, 0.5), (100.0, 1.0)],
            colour: ColourSource::Map { map: ColourMap::Gray, range: [0.0, 100.0] },
        }
    }

    #[test]
    fn stretching_moves_opacities_with_the_colours() {
        let mut t = transfer();
        stretch(&mut t, [1000.0, 1200.0]);
        assert_eq!(t.opacity, [(1000.0, 0.0), (1050.0, 0.5), (1200.0, 1.0)]);
        assert_eq!(colour_range(&t), [1000.0, 1200.0]);
        stretch(&mut t, [0.0, 100.0]);
        assert_eq!(t, transfer());
    }

    #[test]
    fn a_reversed_range_keeps_the_opacities_sorted() {
        let mut t = transfer();
        stretch(&mut t, [100.0, 0.0]);
        assert_eq!(t.opacity, [(0.0, 1.0), (75.0, 0.5), (100.0, 0.0)]);
    }

    #[test]
    fn what_is_not_finite_stretches_nothing() {
        let mut t = transfer();
        stretch(&mut t, [f64::NAN, 1.0]);
        stretch(&mut t, [0.0, f64::INFINITY]);
        assert_eq!(t, transfer());
    }

    #[test]
    fn a_range_without_width_can_be_left_again() {
        let mut t = transfer();
        t.colour = ColourSource::Map { map: ColourMap::Gray, range: [5.0, 5.0] };
        stretch(&mut t, [0.0, 10.0]);
        assert_eq!(colour_range(&t), [0.0, 10.0]);
        assert!(t.opacity.iter().all(|(v, _)| v.is_finite()));
    }

    #[test]
    fn custom_colours_stretch_too() {
        let mut t = transfer();
        t.colour = ColourSource::Stops(vec![(0.0, Srgb8::BLACK), (100.0, Srgb8::WHITE)]);
        stretch(&mut t, [-1.0, 1.0]);
        assert_eq!(colour_range(&t), [-1.0, 1.0]);
        assert_eq!(t.opacity[1].0, -0.5);
    }
}
