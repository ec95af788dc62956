//! Streamlines and arrows: what they are made by.

use eframe::egui::{Button, CollapsingHeader, ComboBox, DragValue, RichText, Ui};
use glam::DVec3;

use super::lists::ListUi;
use super::splat::slider_row;
use super::{number_ui, row_ui, slider_ui, take_sought, typed};
use crate::app::flow::{FlowChoice, FlowShape, SeedPlace};
use crate::app::theme;

/// What they are called where they are sought.
pub(in crate::app) const FLOW: &str = "Streamlines and arrows";

/// What lines and arrows are made by; which of the two is to be made.
///
/// `probed` is the world point that the probe found last, and `box_of` says between which world points the
/// vectors lie.
pub(super) fn flow_ui(
    ui: &mut Ui,
    choice: &mut FlowChoice,
    probed: Option<DVec3>,
    box_of: impl Fn() -> [DVec3; 2],
) -> Option<FlowShape> {
    let title = RichText::new(FLOW).size(12.5).color(theme::TEXT_FAINT);
    let is_sought = take_sought(ui.ctx(), FLOW);
    let header = CollapsingHeader::new(title).default_open(false).open(is_sought.then_some(true));
    let shown = header.show_unindented(ui, |ui| {
        let slider = typed::slider(ui, "Streamlines", &mut choice.seeds, 1..=500).logarithmic(true);
        let help = "Lines along the vectors, about so many";
        slider_row(ui, "Lines", "Streamlines", slider, help);
        seeds_ui(ui, choice, probed, box_of);
        let slider = typed::slider(ui, "Tube radius", &mut choice.radius, 0.02..=2.0);
        let slider = slider.logarithmic(true).max_decimals(2);
        slider_row(ui, "Tube radius", "Tube radius", slider, "In steps of the grid");
        let help = "An arrow at every so many of the vectors along each axis";
        let slider = typed::slider(ui, "Arrow every", &mut choice.every, 1..=32);
        slider_row(ui, "Arrow every", "Arrow every", slider, help);
        // Both beside each other need all of the panel.
        let made = ui.horizontal(|ui| {
            let help = "They become a mesh under Polygons, in place of those made before";
            let lines = ui.button("Make streamlines").on_hover_text(help).clicked();
            let arrows = ui.button("Make arrows").on_hover_text(help).clicked();
            match (lines, arrows) {
                (true, _) => Some(FlowShape::Streamlines),
                (_, true) => Some(FlowShape::Arrows),
                _ => None,
            }
        });
        made.inner
    });
    shown.body_returned.flatten()
}

/// Where the lines begin.
fn seeds_ui(
    ui: &mut Ui,
    choice: &mut FlowChoice,
    probed: Option<DVec3>,
    box_of: impl Fn() -> [DVec3; 2],
) {
    row_ui(ui, "Seeded", |ui| {
        let words = |place| match place {
            SeedPlace::Vectors => "Where they are long",
            SeedPlace::Plane => "On a plane",
            SeedPlace::Line => "On a line",
            SeedPlace::Point => "About a point",
        };
        let combo = ComboBox::from_id_salt("seed place").selected_text(words(choice.place));
        let shown = combo.show_ui(ui, |ui| {
            for place in [SeedPlace::Vectors, SeedPlace::Plane, SeedPlace::Line, SeedPlace::Point] {
                ui.choice_of(&mut choice.place, place, words(place));
            }
        });
        let help = "Where the lines begin: all over the field, and more of them where vectors are long; or evenly on a plane of the \
                    grid; or evenly between two points of the world; or about one such point";
        shown.response.accessible_name("Seeded").on_hover_text(help);
    });
    if choice.place == SeedPlace::Vectors {
        return;
    }
    if choice.place == SeedPlace::Plane {
        row_ui(ui, "Seeded across", |ui| {
            let names = ["x", "y", "z"];
            let combo = ComboBox::from_id_salt("seeds").width(48.0);
            let shown = combo.selected_text(names[choice.axis.min(2)]).show_ui(ui, |ui| {
                for (axis, name) in names.into_iter().enumerate() {
                    ui.choice_of(&mut choice.axis, axis, name);
                }
            });
            let help = "The axis of the vectors' grid that the plane of the seeds lies across";
            shown.response.accessible_name("Seeded across").on_hover_text(help);
            let slider =
                typed::slider(ui, "Seeds at", &mut choice.share, 0.0..=1.0).max_decimals(2);
            slider_ui(ui, "Seeds at", true, slider).on_hover_text("Where along it, 0 to 1");
        });
        return;
    }
    // Through the middle of the vectors, until something else is said.
    let opening = || {
        let [low, high] = box_of();
        let middle = (low + high) / 2.0;
        match choice.place {
            SeedPlace::Point => [middle; 2],
            _ => [DVec3::new(low.x, middle.y, middle.z), DVec3::new(high.x, middle.y, middle.z)],
        }
    };
    let ends = choice.ends.get_or_insert_with(opening);
    let (names, count) = match choice.place {
        SeedPlace::Point => (["Point", ""], 1),
        _ => (["From", "To"], 2),
    };
    for (name, point) in names.into_iter().zip(ends).take(count) {
        row_ui(ui, name, |ui| {
            for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                let drag = DragValue::new(&mut point[axis]).speed(0.1).max_decimals(4);
                number_ui(ui, &format!("{name} {letter}"), drag).on_hover_text("In the world");
            }
        });
        row_ui(ui, "", |ui| {
            let button = ui.add_enabled(probed.is_some(), Button::new("From the probe"));
            let button = button.accessible_name(format!("{name} from the probe"));
            let help = "The point that the probe found last";
            let none =
                "The probe has found no point yet: choose it under View, and point at the picture";
            let button = button.on_hover_text(help).on_disabled_hover_text(none);
            if let Some(probed) = probed.filter(|_| button.clicked()) {
                *point = probed;
            }
        });
    }
}
