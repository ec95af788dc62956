//! How the view is drawn: background, projection, and what moving may cost.

use eframe::egui::{Checkbox, ComboBox, Slider, Ui};

use super::name_ui;
use crate::app::settings::{BUDGET_MS, LADDERS, Settings, VIEW_ANGLE_DEG, ladder_label};
use crate::core::{Projection, Srgb8};
use crate::scene::Scene;

/// Background, projection, frame budget and the switches of refinement.
pub fn view_ui(ui: &mut Ui, scene: &mut Scene, settings: &mut Settings) {
    background_ui(ui, settings);
    projection_ui(ui, scene, settings);
    ui.add_space(4.0);
    refinement_ui(ui, settings);
    ui.checkbox(&mut settings.trihedron, "Show axes")
        .on_hover_text("The world's axes in the corner of the viewport");
}

fn background_ui(ui: &mut Ui, settings: &mut Settings) {
    ui.horizontal(|ui| {
        name_ui(ui, "Background");
        ui.add_enabled_ui(!settings.transparent_background, |ui| {
            let Srgb8(mut colour) = settings.background;
            ui.color_edit_button_srgb(&mut colour)
                .accessible_name("Background colour")
                .on_hover_text("The colour behind the volume");
            settings.background = Srgb8(colour);
        });
        ui.checkbox(&mut settings.transparent_background, "Transparent")
            .on_hover_text("Nothing behind the volume: saved pictures keep their transparency");
    });
}

fn projection_ui(ui: &mut Ui, scene: &mut Scene, settings: &mut Settings) {
    let mut perspective = matches!(scene.camera.projection, Projection::Perspective { .. });
    ui.horizontal(|ui| {
        ui.radio_value(&mut perspective, false, "Orthographic")
            .on_hover_text("Parallel rays: lengths can be compared, and splats are exact (key 5)");
        ui.radio_value(&mut perspective, true, "Perspective")
            .on_hover_text("What is near looks larger (key 5)");
    });
    let slider = Slider::new(&mut settings.view_angle_deg, VIEW_ANGLE_DEG)
        .suffix("°")
        .fixed_decimals(0)
        .text("View angle");
    ui.add_enabled(perspective, slider)
        .on_hover_text("How much the eye takes in from top to bottom: wider is more dramatic")
        .on_disabled_hover_text("Only a perspective view has an angle");
    scene.camera.projection = if perspective {
        Projection::Perspective { view_angle: settings.view_angle_deg.to_radians() }
    } else {
        Projection::Orthographic
    };
}

fn refinement_ui(ui: &mut Ui, settings: &mut Settings) {
    let budget = Slider::new(&mut settings.budget_ms, BUDGET_MS)
        .logarithmic(true)
        .suffix(" ms")
        .fixed_decimals(0)
        .text("Frame budget");
    ui.add_enabled(!settings.full_quality_while_moving, budget)
        .on_hover_text(
            "What a picture may cost while the view moves: more time shows finer detail, less \
             time follows the hand more closely",
        )
        .on_disabled_hover_text("Full quality takes the time it needs");
    ui.horizontal(|ui| {
        let name = name_ui(ui, "Refine by");
        let combo = ComboBox::from_id_salt("ladder").selected_text(ladder_label(settings.ladder));
        let shown = combo.show_ui(ui, |ui| {
            for (ladder, label, help) in LADDERS {
                ui.selectable_value(&mut settings.ladder, ladder, label).on_hover_text(help);
            }
        });
        shown
            .response
            .labelled_by(name.id)
            .on_hover_text("The way from the first coarse picture to the full one, once at rest");
    });
    ui.add(Checkbox::new(&mut settings.show_partial, "Show partial pictures"))
        .on_hover_text("Show a picture while it is still being drawn, or only once it is complete");
    ui.add(Checkbox::new(&mut settings.full_quality_while_moving, "Full quality while moving"))
        .on_hover_text("Draw every voxel even while the view moves, however slowly that goes");
}
