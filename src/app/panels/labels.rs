//! The things that a volume of labels has names for: which are shown, and in what colour.

use eframe::egui::{Label, RichText, ScrollArea, Ui};

use crate::app::theme;
use crate::core::Srgb8;
use crate::transfer::{ColourSource, TransferFunction, labels_of};
use crate::volume::{LabelName, Statistics};

/// How high a list of labels grows before it scrolls, points.
const MOST_HEIGHT: f32 = 220.0;

/// What a list of labels stands in.
pub(super) fn list() -> ScrollArea {
    ScrollArea::vertical().max_height(MOST_HEIGHT).auto_shrink([false, true])
}

/// A label in a list: whether it is shown, its colour, where it has one, and its name. Whether each of the two was changed.
pub(super) fn row_ui(
    ui: &mut Ui,
    name: &str,
    is_shown: &mut bool,
    colour: Option<&mut Srgb8>,
) -> [bool; 2] {
    ui.horizontal(|ui| {
        let shown = ui.checkbox(is_shown, "").accessible_name(format!("{name} shown"));
        let is_switched = shown.on_hover_text("Draw it").changed();
        let is_coloured = colour.is_some_and(|Srgb8(colour)| {
            let button = ui.color_edit_button_srgb(colour);
            button.accessible_name(format!("{name} colour")).on_hover_text("Its colour").changed()
        });
        let text = RichText::new(name);
        let text = if *is_shown { text } else { text.color(theme::TEXT_FAINT) };
        ui.add(Label::new(text).truncate());
        [is_switched, is_coloured]
    })
    .inner
}

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
    list().id_salt("labels").show(ui, |ui| {
        for label in labels {
            #[expect(clippy::cast_precision_loss, reason = "labels are few and small")]
            let own = names.iter().find(|one| one.value as f64 == label);
            let name = own.map_or_else(|| format!("Label {label}"), |own| own.name.clone());
            let mut is_shown = transfer.opacity_at(label) > 0.0;
            let mut colour = transfer.colour_at(label).to_srgb();
            let [is_switched, is_coloured] = row_ui(ui, &name, &mut is_shown, Some(&mut colour));
            if is_switched {
                transfer.show_label(label, is_shown);
                is_changed = true;
            }
            if is_coloured {
                transfer.set_label_colour(label, colour);
            }
        }
    });
    is_changed
}
