//! Polygons embedded in the volume: which, and what they look like.

use eframe::egui::{Label, Ui};

use super::inside::{note_ui, opacity_ui, remove_ui};
use super::row_ui;
use crate::core::Srgb8;
use crate::scene::{Effect, Layer, Look, POLYGON_COLOUR, Sampled, Scene};

/// The section; whether another file is to be opened.
pub fn polygons_ui(ui: &mut Ui, scene: &mut Scene) -> bool {
    let at: Vec<usize> =
        (0..scene.layers.len()).filter(|at| scene.layers[*at].look.is_surface()).collect();
    if !at.is_empty() && scene.refusal_of(Effect::Polygons).is_some() {
        let text = "Not drawn: this mode is of triangles of its own, or Rendering is not Volume. Choose the exact \
                    mode under Splats, or another kernel and back end, and Volume above";
        note_ui(ui, text);
    }
    let mut removed = None;
    for (i, at) in at.into_iter().enumerate() {
        let about = scene.store.get(&scene.layers[at].source).map(Sampled::about);
        let layer = (about.unwrap_or_default(), &mut scene.layers[at]);
        if ui.push_id(("mesh", i), |ui| layer_ui(ui, i, layer)).inner {
            removed = Some(at);
        }
    }
    if let Some(at) = removed {
        scene.remove(at);
    }
    let open = ui.button("Add polygons…");
    open.on_hover_text("Show the triangles of an STL, PLY or OBJ file within the volume").clicked()
}

/// One mesh; whether it is to be removed.
fn layer_ui(ui: &mut Ui, i: usize, (about, layer): (String, &mut Layer)) -> bool {
    let name = format!("Mesh {}", i + 1);
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
    row_ui(ui, "", |ui| {
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
        ui.checkbox(&mut look.is_smooth, "Smooth")
            .accessible_name(format!("{name} smooth"))
            .on_hover_text("Lit by the corners' normals rather than each triangle's own");
    });
    removed
}
