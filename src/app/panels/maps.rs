//! The choice of a colour map, each with its swatch.

use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Atom, Button, ComboBox, IdSalt, Rect, Response, RichText, Shape, Ui, pos2, vec2,
};

use super::{graph, row_ui};
use crate::app::{theme, words};
use crate::core::LinearRgb;
use crate::transfer::{ColourMap, ColourSource, TransferFunction};

/// Height of the list, points: all maps are seen at once.
const LIST: f32 = 600.0;
/// Size of a colour map's swatch, points.
const SWATCH: eframe::egui::Vec2 = vec2(56.0, 10.0);

/// The row of the colours: which map, or that they are edited one by one.
pub(super) fn map_ui(ui: &mut Ui, transfer: &mut TransferFunction) {
    let range = transfer.colour.range();
    let chosen = match &transfer.colour {
        ColourSource::Map { map, .. } => Some(*map),
        ColourSource::Stops(_) => None,
    };
    row_ui(ui, "Colours", |ui| {
        if let Some(map) = choose_ui(ui, "Colours", chosen) {
            transfer.colour = ColourSource::Map { map, range };
        }
        let help = "Turn the map into colours at single values, on the bar above: drag them, change them, \
                    add and remove some";
        let edit = ui.add_enabled(chosen.is_some(), Button::new("Edit"));
        let edit = edit.accessible_name("Edit colours").on_hover_text(help);
        let edit =
            edit.on_disabled_hover_text("They can be edited on the bar above; or choose a map");
        if edit.clicked() {
            transfer.colour = ColourSource::Stops(transfer.colour.stops());
        }
    });
}

/// The list of colour maps, called `name` by what reads the screen; that which was chosen now.
pub(super) fn choose_ui(ui: &mut Ui, name: &str, chosen: Option<ColourMap>) -> Option<ColourMap> {
    let selected = chosen.map_or_else(|| "Own colours".to_owned(), words::colour_map);
    let combo = ComboBox::from_id_salt("colour map").selected_text(selected).height(LIST);
    let mut clicked = None;
    let shown = combo.show_ui(ui, |ui| {
        for map in ColourMap::ALL {
            // The safe ones come first.
            if !map.is_safe() {
                ui.separator();
                ui.label(
                    RichText::new("Not safe for colour-blind people").color(theme::TEXT_FAINT),
                );
            }
            let entry = map_choice_ui(ui, map, chosen == Some(map));
            if entry.on_hover_text(words::colour_map_help(map)).clicked() {
                clicked = Some(map);
            }
        }
    });
    shown.response.accessible_name(name).on_hover_text("The colours of low to high values");
    clicked
}

/// One colour map in the list, with its swatch.
fn map_choice_ui(ui: &mut Ui, map: ColourMap, selected: bool) -> Response {
    let swatch = IdSalt::new("swatch");
    let atoms = (Atom::custom(swatch, SWATCH), words::colour_map(map), Atom::grow());
    let shown = Button::selectable(selected, atoms).atom_ui(ui);
    if let Some(rect) = shown.rect(swatch) {
        paint_map(ui, rect, map);
    }
    if shown.response.clicked() {
        ui.close();
    }
    shown.response
}

fn paint_map(ui: &Ui, rect: Rect, map: ColourMap) {
    let stops = map.stops();
    let mut mesh = Mesh::default();
    for (i, stop) in stops.iter().enumerate() {
        let fraction = i as f32 / (stops.len() - 1).max(1) as f32;
        let x = rect.left() + fraction * rect.width();
        let colour = graph::to_screen(LinearRgb(stop.to_linear().0));
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
