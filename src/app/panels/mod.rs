//! The side panel's sections and the status line, one file each.
//!
//! A section reads and changes plain data (the scene, the settings) and returns what it cannot do
//! itself.

pub mod curve;
pub mod data;
pub mod splat;
pub mod status;
pub mod transfer;
pub mod view;

use eframe::egui::{CollapsingHeader, Grid, Response, RichText, Ui};

use super::theme;

/// A titled section that folds.
pub(super) fn section_ui<R>(ui: &mut Ui, title: &str, add: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let title = RichText::new(title).size(13.5).strong();
    let shown = CollapsingHeader::new(title).default_open(true).show_unindented(ui, |ui| {
        ui.add_space(2.0);
        let result = add(ui);
        ui.add_space(8.0);
        result
    });
    shown.body_returned
}

/// Rows of a name and a value.
pub(super) fn facts_ui(ui: &mut Ui, id: &str, rows: &[(&str, String, &str)]) {
    Grid::new(id).num_columns(2).spacing([14.0, 4.0]).show(ui, |ui| {
        for (name, value, help) in rows {
            let name = ui.label(RichText::new(*name).color(theme::TEXT_FAINT));
            let value = ui.label(value);
            if !help.is_empty() {
                name.on_hover_text(*help);
                value.on_hover_text(*help);
            }
            ui.end_row();
        }
    });
}

/// A faint name before a widget.
pub(super) fn name_ui(ui: &mut Ui, name: &str) -> Response {
    ui.label(RichText::new(name).color(theme::TEXT_FAINT))
}

/// A small button that takes a value back to its default; `name` is what it is called.
pub(super) fn reset_button(name: &str) -> impl eframe::egui::Widget + '_ {
    move |ui: &mut Ui| ui.small_button("Reset").accessible_name(name)
}
