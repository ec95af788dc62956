//! What stands for a ray.

use eframe::egui::{ComboBox, Ui};

use super::row_ui;
use crate::scene::{AlongRay, Scene};

/// The section.
pub fn inside_ui(ui: &mut Ui, scene: &mut Scene) {
    along_ui(ui, &mut scene.inside.along);
}

/// What stands for a ray is called so, and means this, one line.
pub fn along_words(along: AlongRay) -> (&'static str, &'static str) {
    match along {
        AlongRay::Composite => {
            ("Light", "The light of all values, each hiding what is behind by its opacity")
        }
        AlongRay::Maximum => {
            ("Maximum", "The greatest value along each ray in its colour, whatever the opacities")
        }
        AlongRay::Minimum => {
            ("Minimum", "The least value along each ray in its colour, whatever the opacities")
        }
        AlongRay::Average => (
            "Average",
            "The mean of the values along each ray in its colour, whatever the opacities: as an X-ray \
             picture",
        ),
    }
}

fn along_ui(ui: &mut Ui, along: &mut AlongRay) {
    row_ui(ui, "Along rays", |ui| {
        let (name, help) = along_words(*along);
        let combo = ComboBox::from_id_salt("along rays").selected_text(name);
        let shown = combo.show_ui(ui, |ui| {
            for &one in AlongRay::ALL {
                let (name, help) = along_words(one);
                ui.selectable_value(along, one, name).on_hover_text(help);
            }
        });
        shown.response.accessible_name("Along rays").on_hover_text(help);
    });
}
