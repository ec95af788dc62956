//! The things that a volume of labels has names for: which are shown, and in what colour.

use eframe::egui::{Label, RichText, ScrollArea, Ui};

use super::polygons::MOST_LABELS_HEIGHT;
use crate::app::theme;
use crate::transfer::{ColourSource, TransferFunction, labels_of};
use crate::volume::{LabelName, Statistics};

/// A row for each label; nothing where values are no labels, or their colours are a map's. `names` are those of the file. Whether
/// one was shown or hidden.
pub(super) fn labels_ui(
    ui: &mut Ui,
    transfer: &mut TransferFunction,
    statistics: &Statistics,
    names: &[&LabelName],
) -> bool {
    let labels = match &transfer.colour {
        ColourSource::Stops(_) => labels_of(statistics),
        ColourSource::Map { .. } => Vec::new(),
    };
    if labels.is_empty() {
        return false;
    }
    let mut is_changed = false;
    let list = ScrollArea::vertical().id_salt("labels").max_height(MOST_LABELS_HEIGHT);
    list.auto_shrink([false, true]).show(ui, |ui| {
        for label in labels {
            #[expect(clippy::cast_precision_loss, reason = "labels are few and small")]
            let own = names.iter().find(|one| one.value as f64 == label);
            let name = own.map_or_else(|| format!("Label {label}"), |own| own.name.clone());
            is_changed |= ui.horizontal(|ui| label_ui(ui, transfer, label, &name)).inner;
        }
    });
    is_changed
}

/// One label; whether it was shown or hidden.
fn label_ui(ui: &mut Ui, transfer: &mut TransferFunction, label: f64, name: &str) -> bool {
    let mut is_shown = transfer.opacity_at(label) > 0.0;
    let shown = ui.checkbox(&mut is_shown, "").accessible_name(format!("{name} shown"));
    let is_changed = shown.on_hover_text("Draw it").changed();
    if is_changed {
        transfer.show_label(label, is_shown);
    }
    let mut colour = transfer.colour_at(label).to_srgb();
    let button = ui.color_edit_button_srgb(&mut colour.0).accessible_name(format!("{name} colour"));
    if button.on_hover_text("Its colour").changed() {
        transfer.set_label_colour(label, colour);
    }
    let text = RichText::new(name);
    let text = if is_shown { text } else { text.color(theme::TEXT_FAINT) };
    ui.add(Label::new(text).truncate());
    is_changed
}
