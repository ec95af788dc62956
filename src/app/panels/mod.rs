//! The side panel's sections and the status line, one file each.
//!
//! A section reads and changes plain data (the scene, the settings) and returns what it cannot do
//! itself.

pub mod accuracy;
pub mod axes;
pub mod bells;
pub mod chart;
pub mod clip;
pub mod compare;
pub mod curve;
pub mod data;
pub mod effects;
pub mod encoding;
pub mod flow;
pub mod freehand;
pub mod graph;
pub mod inside;
mod labels;
pub mod legend;
mod light;
pub(super) mod lists;
mod maps;
mod pictures;
pub mod places;
pub mod polygons;
mod range;
pub mod regions;
pub mod shading;
mod shading_table;
mod sought;
pub mod splat;
pub mod status;
pub mod stops;
pub mod stretch;
mod told;
pub mod transfer;
pub(super) mod typed;
mod vector_look;
pub mod vectors;
pub mod view;

use std::collections::BTreeMap;

use eframe::egui::{
    Align, CollapsingHeader, DragValue, Label, Layout, Response, RichText, Slider, Ui, vec2,
};

pub use self::sought::marked_row;
pub(super) use self::sought::{in_section_ui, seek, seek_row};
use self::sought::{show_sought, take_sought};
use super::theme;

/// Width of the column of names, points.
const NAME_WIDTH: f32 = 90.0;
/// Width of a number that can be dragged or typed, points: one that changes must not push others.
const NUMBER_WIDTH: f32 = 60.0;
/// Width of a slider's number and its reset button, points: of as long a number as `1.2346e-7`.
const VALUE_AND_RESET_WIDTH: f32 = 140.0;

/// Sections that are closed until somebody opens them: they are needed rarely.
const CLOSED_AT_FIRST: [&str; 3] = [FUNCTIONS, POLYGONS, SPLATS];
/// What stands above all sections.
pub(super) const ON_TOP: &str = "Side panel";
/// The sections, from above.
pub(super) const DATA: &str = "Data";
pub(super) const VECTORS: &str = "Vectors";
pub(super) const TRANSFER: &str = "Transfer function";
pub(super) const SHADING: &str = "Shading";
pub(super) const INSIDE: &str = "Surfaces and slices";
pub(super) const POLYGONS: &str = "Polygons and labels";
pub(super) const CLIP: &str = "Clip";
/// That of the mode; see [`super::modes::section`].
pub(super) const SPLATS: &str = "Splats";
pub(super) const FUNCTIONS: &str = "Basis functions";
pub(super) const VIEW: &str = "View";

/// Which sections somebody has opened or closed, by their names; the others are as at first.
pub type Sections = BTreeMap<String, bool>;

/// Whether a section is open, by its name.
pub fn is_open(sections: &Sections, name: &str) -> bool {
    sections.get(name).copied().unwrap_or(!CLOSED_AT_FIRST.contains(&name))
}

/// A titled section that folds, and stays as it was left.
pub(super) fn section_ui<R>(
    ui: &mut Ui,
    sections: &mut Sections,
    title: &str,
    add: impl FnOnce(&mut Ui) -> R,
) -> Option<R> {
    titled_section_ui(ui, sections, (title, title), add)
}

/// The same where a section has another title at times; it is kept by its `name`.
pub(super) fn titled_section_ui<R>(
    ui: &mut Ui,
    sections: &mut Sections,
    (name, title): (&str, &str),
    add: impl FnOnce(&mut Ui) -> R,
) -> Option<R> {
    let is_open = is_open(sections, name);
    let words = RichText::new(title).size(13.5).strong();
    // As it is from its first pass on, without being opened before all eyes.
    let header = CollapsingHeader::new(words).default_open(is_open).open(Some(is_open));
    let shown = header.show_unindented(ui, |ui| {
        ui.add_space(2.0);
        let result = in_section_ui(ui, name, add);
        ui.add_space(8.0);
        result
    });
    if take_sought(ui.ctx(), name) {
        shown.header_response.scroll_to_me(Some(Align::TOP));
    }
    if shown.header_response.clicked() {
        sections.insert(name.to_owned(), !is_open);
        ui.ctx().request_repaint();
    }
    shown.body_returned
}

/// Rows of a name, a value and what they mean. A value too long for the panel is cut short and
/// shown whole while the pointer rests on it.
pub(super) fn facts_ui(ui: &mut Ui, rows: &[(&str, String, &str)]) {
    ui.scope(|ui| {
        ui.spacing_mut().interact_size.y = 17.0;
        ui.spacing_mut().item_spacing.y = 3.0;
        for (name, value, help) in rows {
            row_ui(ui, name, |ui| ui.add(Label::new(value).truncate())).on_hover_text(*help);
        }
    });
}

/// A faint name before a widget.
pub(super) fn name_ui(ui: &mut Ui, name: &str) -> Response {
    ui.label(RichText::new(name).color(theme::TEXT_FAINT))
}

/// A row that is switched on and off.
pub(super) fn switch_ui(ui: &mut Ui, is_on: &mut bool, name: &str) -> Response {
    let row = ui.checkbox(is_on, name);
    show_sought(ui, name, &row);
    row
}

/// A row of a name in a column of its own and what it names.
pub(super) fn row_ui<R>(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui) -> R) -> R {
    let row = ui.horizontal(|ui| {
        name_column_ui(ui, name);
        add(ui)
    });
    show_sought(ui, name, &row.response);
    row.inner
}

/// The name of a row in the column of names.
fn name_column_ui(ui: &mut Ui, name: &str) -> Response {
    let size = vec2(NAME_WIDTH, ui.spacing().interact_size.y);
    let column = Layout::left_to_right(Align::Center);
    let shown = ui.allocate_ui_with_layout(size, column, |ui| {
        ui.set_min_width(NAME_WIDTH);
        name_ui(ui, name)
    });
    shown.inner
}

/// A slider after its name in the row, with room for a reset button.
pub(super) fn slider_ui(ui: &mut Ui, name: &str, enabled: bool, slider: Slider<'_>) -> Response {
    ui.spacing_mut().slider_width = (ui.available_width() - VALUE_AND_RESET_WIDTH).max(60.0);
    // Before any hover text, which would name the handle otherwise.
    ui.name_inputs(name, |ui| ui.add_enabled(enabled, slider))
}

/// A number that can be dragged or typed, called `name`.
pub(super) fn number_ui(ui: &mut Ui, name: &str, drag: DragValue<'_>) -> Response {
    wide_number_ui(ui, name, NUMBER_WIDTH, drag)
}

/// The same of numbers that may need more room.
fn wide_number_ui(ui: &mut Ui, name: &str, width: f32, drag: DragValue<'_>) -> Response {
    let size = vec2(width, ui.spacing().interact_size.y);
    ui.add_sized(size, drag).accessible_name(name)
}

/// A small button, there while a value is not its default, that takes it back; `name` is what it is
/// called.
pub(super) fn reset_ui(ui: &mut Ui, changed: bool, name: &str, help: &str) -> bool {
    changed && ui.small_button("×").accessible_name(name).on_hover_text(help).clicked()
}
