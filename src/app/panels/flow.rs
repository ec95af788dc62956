//! Streamlines and arrows: what they are made by.

use eframe::egui::{CollapsingHeader, ComboBox, RichText, Slider, SliderClamping, Ui};

use super::{row_ui, slider_ui};
use crate::app::flow::{FlowChoice, FlowShape};
use crate::app::theme;

/// What lines and arrows are made by; which of the two is to be made.
pub(super) fn flow_ui(ui: &mut Ui, choice: &mut FlowChoice) -> Option<FlowShape> {
    let title = RichText::new("Streamlines and arrows").size(12.5).color(theme::TEXT_FAINT);
    let header = CollapsingHeader::new(title).default_open(false);
    let shown = header.show_unindented(ui, |ui| {
        row_ui(ui, "Lines", |ui| {
            let slider = Slider::new(&mut choice.seeds, 1..=500).logarithmic(true);
            let help = "Lines along the vectors, about so many, from seeds on a plane";
            slider_ui(ui, "Streamlines", true, slider).on_hover_text(help);
        });
        row_ui(ui, "Seeded across", |ui| {
            let names = ["x", "y", "z"];
            let combo = ComboBox::from_id_salt("seeds").width(48.0);
            let shown = combo.selected_text(names[choice.axis.min(2)]).show_ui(ui, |ui| {
                for (axis, name) in names.into_iter().enumerate() {
                    ui.selectable_value(&mut choice.axis, axis, name);
                }
            });
            let help = "The axis of the vectors' grid that the plane of the seeds lies across";
            shown.response.accessible_name("Seeded across").on_hover_text(help);
            let slider = Slider::new(&mut choice.share, 0.0..=1.0).max_decimals(2);
            slider_ui(ui, "Seeds at", true, slider).on_hover_text("Where along it, 0 to 1");
        });
        row_ui(ui, "Tube radius", |ui| {
            let slider = Slider::new(&mut choice.radius, 0.02..=2.0).max_decimals(2);
            let slider = slider.logarithmic(true).clamping(SliderClamping::Edits);
            slider_ui(ui, "Tube radius", true, slider).on_hover_text("In steps of the grid");
        });
        row_ui(ui, "Arrow every", |ui| {
            let help = "An arrow at every so many of the vectors along each axis";
            let slider = Slider::new(&mut choice.every, 1..=32);
            slider_ui(ui, "Arrow every", true, slider).on_hover_text(help);
        });
        row_ui(ui, "", |ui| {
            let help = "They become a mesh under Polygons, in place of those made before";
            let lines = ui.button("Make streamlines").on_hover_text(help).clicked();
            let arrows = ui.button("Make arrows").on_hover_text(help).clicked();
            match (lines, arrows) {
                (true, _) => Some(FlowShape::Streamlines),
                (_, true) => Some(FlowShape::Arrows),
                _ => None,
            }
        })
    });
    shown.body_returned.flatten()
}
