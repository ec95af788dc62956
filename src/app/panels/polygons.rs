//! Polygons embedded in the volume, and the surfaces of labels: which, and what they look like.

use std::ops::Range;

use eframe::egui::{ComboBox, DragValue, Label, Ui};

use super::inside::{note_ui, opacity_ui, remove_ui};
use super::lists::ListUi;
use super::maps::choose_ui;
use super::{labels, row_ui};
use crate::app::actions::{Action, entry_of};
use crate::app::words;
use crate::core::Srgb8;
use crate::polygons::MeshArray;
use crate::scene::{
    ByArray, Effect, Ground, Layer, Look, POLYGON_COLOUR, PolygonLook, SampleSource, Sampled, Scene,
};

/// The section; the command for another file, where it is asked for.
pub fn polygons_ui(ui: &mut Ui, scene: &mut Scene) -> Option<Action> {
    let files = files(scene);
    if !files.is_empty() && scene.refusal_of(Effect::Polygons).is_some() {
        let text = match Ground::of_mode(&scene.splat) {
            None => "Not drawn: Rendering is not Volume. Choose Volume above",
            Some(_) => {
                "Not drawn: this mode is of triangles of its own. Choose the exact mode under Splats, or another kernel and \
                 back end, and Volume above"
            }
        };
        note_ui(ui, text);
    }
    let mut removed = 0..0;
    let mut meshes = 0;
    let has_field = scene.volume().is_some();
    for of_file in files {
        let first = of_file.start;
        let is_removed = if is_of_polygons(&scene.layers[of_file.clone()]) {
            meshes += 1;
            let samples = scene.store.get(&scene.layers[first].source);
            let arrays = match samples {
                Some(Sampled::Mesh(mesh)) => mesh.arrays(),
                _ => &[],
            };
            let numbers = Numbers { arrays, has_field };
            let mesh = (samples.map(Sampled::about).unwrap_or_default(), numbers);
            let layer = &mut scene.layers[first];
            ui.push_id(("mesh", meshes), |ui| layer_ui(ui, meshes, mesh, layer)).inner
        } else {
            let layers = &mut scene.layers[of_file.clone()];
            ui.push_id(("labels", first), |ui| labels_ui(ui, layers)).inner
        };
        if is_removed {
            removed = of_file;
        }
    }
    for at in removed.rev() {
        scene.remove(at);
    }
    let mut asked = None;
    ui.horizontal_wrapped(|ui| {
        for action in [Action::EmbedPolygons, Action::AddLabels] {
            let entry = entry_of(action);
            if ui.button(entry.name).on_hover_text(entry.help).clicked() {
                asked = Some(action);
            }
        }
    });
    asked
}

/// Whether they are the triangles of a file, called as it is, or made here, rather than surfaces of labels.
fn is_of_polygons(layers: &[Layer]) -> bool {
    let SampleSource { path, field, .. } = &layers[0].source;
    layers.len() == 1 && path.file_name().is_none_or(|name| name.to_string_lossy() == *field)
}

/// The surfaces of each file, which lie side by side.
fn files(scene: &Scene) -> Vec<Range<usize>> {
    let mut files: Vec<Range<usize>> = Vec::new();
    for (at, layer) in scene.layers.iter().enumerate().filter(|(_, layer)| layer.look.is_surface())
    {
        let is_another = |last: &Range<usize>| {
            let first = &scene.layers[last.start].source;
            // The first label once more is that of the same file, added again.
            last.end != at || layer.source.path != first.path || layer.source.field == first.field
        };
        match files.last_mut() {
            Some(last) if !is_another(last) => last.end += 1,
            _ => files.push(at..at + 1),
        }
    }
    files
}

/// The labels of a file; whether all are to be removed.
fn labels_ui(ui: &mut Ui, layers: &mut [Layer]) -> bool {
    let file = layers[0].source.path.file_name().unwrap_or_default();
    let file = file.to_string_lossy().into_owned();
    let mut are_shown = layers.iter().all(|layer| layer.is_shown);
    let removed = row_ui(ui, "Labels", |ui| {
        let switch = ui.checkbox(&mut are_shown, "").accessible_name("All labels shown");
        if switch.on_hover_text("Draw all of them").changed() {
            layers.iter_mut().for_each(|layer| layer.is_shown = are_shown);
        }
        let removed = remove_ui(ui, "labels", "Remove all of them");
        ui.add(Label::new(file).truncate());
        removed
    });
    let mut opacity = layers[0].look.opacity_mut().map_or(1.0, |opacity| *opacity);
    let before = opacity;
    opacity_ui(ui, "Labels", &mut opacity, "How much each surface hides of what is behind");
    if opacity != before {
        layers.iter_mut().filter_map(|layer| layer.look.opacity_mut()).for_each(|a| *a = opacity);
    }
    labels::list().show(ui, |ui| layers.iter_mut().for_each(|layer| label_ui(ui, layer)));
    removed
}

/// One label.
fn label_ui(ui: &mut Ui, layer: &mut Layer) {
    let colour = match &mut layer.look {
        Look::Polygons(look) => Some(look.colour.get_or_insert(POLYGON_COLOUR)),
        _ => None,
    };
    labels::row_ui(ui, &layer.source.field, &mut layer.is_shown, colour);
}

/// What a mesh may be coloured by.
#[derive(Clone, Copy)]
struct Numbers<'a> {
    /// Of its file.
    arrays: &'a [MeshArray],
    /// Whether there is a field, whose values it may have.
    has_field: bool,
}

/// One mesh; whether it is to be removed.
fn layer_ui(
    ui: &mut Ui,
    i: usize,
    (about, numbers): (String, Numbers<'_>),
    layer: &mut Layer,
) -> bool {
    let arrays = numbers.arrays;
    let name = format!("Mesh {i}");
    let removed = row_ui(ui, &name, |ui| {
        let shown = ui.checkbox(&mut layer.is_shown, "").accessible_name(format!("{name} shown"));
        shown.on_hover_text("Draw it");
        let removed = remove_ui(ui, &name, "Remove it");
        ui.add(Label::new(about).truncate());
        removed
    });
    if let Some(opacity) = layer.look.opacity_mut() {
        opacity_ui(ui, &name, opacity, "How much each triangle hides of what is behind");
    }
    let Look::Polygons(look) = &mut layer.look else { return removed };
    if !arrays.is_empty() || numbers.has_field || look.by_field {
        row_ui(ui, "Colour by", |ui| array_ui(ui, &name, numbers, look));
    }
    if let Some(by) = &mut look.by {
        row_ui(ui, "Colours", |ui| {
            let chosen = choose_ui(ui, &format!("{name} colours"), Some(by.map));
            by.map = chosen.unwrap_or(by.map);
        });
        row_ui(ui, "From, to", |ui| ends_ui(ui, &name, arrays.get(by.array), &mut by.range));
    }
    row_ui(ui, "", |ui| {
        if look.by.is_none() && !look.by_field {
            one_colour_ui(ui, &name, look);
        }
        ui.checkbox(&mut look.is_smooth, "Smooth")
            .accessible_name(format!("{name} smooth"))
            .on_hover_text("Lit by the file's normals, or across edges at which triangles are turned by less than 30°, rather than by each triangle's own");
    });
    removed
}

fn one_colour_ui(ui: &mut Ui, name: &str, look: &mut PolygonLook) {
    let mut is_one = look.colour.is_some();
    let switch = ui.checkbox(&mut is_one, "One colour");
    let switch = switch.accessible_name(format!("{name} one colour"));
    let help = "Another colour than the file's own";
    if switch.on_hover_text(help).changed() {
        look.colour = is_one.then_some(POLYGON_COLOUR);
    }
    if let Some(Srgb8(colour)) = &mut look.colour {
        ui.color_edit_button_srgb(colour)
            .accessible_name(format!("{name} colour"))
            .on_hover_text("The colour of all its triangles");
    }
}

/// Which numbers it is coloured by, if any.
fn array_ui(ui: &mut Ui, name: &str, numbers: Numbers<'_>, look: &mut PolygonLook) {
    const NONE: &str = "Nothing";
    const FIELD: &str = "The field";
    let Numbers { arrays, has_field } = numbers;
    let own = look.by.and_then(|by| arrays.get(by.array));
    let chosen = match own {
        _ if look.by_field => FIELD,
        Some(array) => &array.name,
        None => NONE,
    };
    let combo = ComboBox::from_id_salt("array").selected_text(chosen).truncate();
    let shown = combo.show_ui(ui, |ui| {
        if ui.choice(look.by.is_none() && !look.by_field, NONE).clicked() {
            (look.by, look.by_field) = (None, false);
        }
        if has_field {
            let choice = ui.choice(look.by_field, FIELD).on_hover_text(
                "The values of the volume at its triangles, in the colours of the transfer function; plain beside the volume",
            );
            if choice.clicked() {
                (look.by, look.by_field) = (None, true);
            }
        }
        for (array, own) in arrays.iter().enumerate() {
            let is_chosen = look.by.is_some_and(|by| by.array == array);
            if ui.choice(is_chosen, &own.name).clicked()
                && let Some(range) = own.range()
            {
                let map = look.by.map_or(ByArray::FIRST_MAP, |by| by.map);
                (look.by, look.by_field) = (Some(ByArray { array, map, range }), false);
            }
        }
    });
    let response = shown.response.accessible_name(format!("{name} colour by"));
    response.on_hover_text(
        "Which numbers colour it: those of its file, or the values of the volume that it lies in",
    );
}

/// The numbers that take the first and the last colour.
fn ends_ui(ui: &mut Ui, name: &str, array: Option<&MeshArray>, range: &mut [f64; 2]) {
    let own = array.and_then(MeshArray::range).unwrap_or(*range);
    let speed = ((own[1] - own[0]).abs() / 200.0).max(f64::MIN_POSITIVE);
    for (end, what) in range.iter_mut().zip(["first", "last"]) {
        let field = DragValue::new(end).speed(speed).custom_formatter(|v, _| words::value(v));
        ui.add(field)
            .accessible_name(format!("{name} {what} colour at"))
            .on_hover_text(format!("The number that takes the {what} colour"));
    }
}
