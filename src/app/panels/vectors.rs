//! Vector splats: which field, what they look like, and the animation.

use std::sync::Arc;

use eframe::egui::{CollapsingHeader, ComboBox, RichText, Ui};
use glam::DVec3;

use super::lists::ListUi;
use super::places::SAVE_LOOP;
use super::splat::slider_row;
use super::vector_look::Names;
use super::{flow, row_ui, slider_ui, typed, vector_look};
use crate::app::document::Document;
use crate::app::flow::{FlowChoice, FlowShape};
use crate::app::theme;
use crate::app::vectors::{Triple, VectorSource};
use crate::scene::{AlongRay, Effect, Scene};
use crate::vector::{ColourBy, MOST_SPEED, PhaseClock};

/// What a person asked of the section that it cannot do itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VectorRequest {
    /// The vectors of these fields of the file, or none.
    Field(Option<VectorSource>),
    /// The same of a second field among them.
    Second(Option<VectorSource>),
    /// A loop of pictures as a file.
    SaveLoop,
    /// Polygons made of the vectors.
    Flow(FlowShape),
}

/// The section; the clock with `now`, in seconds of the window's clock.
pub fn vectors_ui(
    ui: &mut Ui,
    document: &Document,
    scene: &mut Scene,
    (clock, now): (&mut PhaseClock, f64),
    fps: &mut u32,
    (choice, triples, probed): (&mut FlowChoice, &mut [Triple; 2], Option<DVec3>),
) -> Option<VectorRequest> {
    let names: Vec<String> = scene.vectors().iter().map(|layer| layer.field.name.clone()).collect();
    let shown = |index: usize| names.get(index).map(String::as_str);
    let request = field_ui(ui, document, FIRST, shown(0), &mut triples[0]);
    let request = request.map(VectorRequest::Field);
    if names.is_empty() {
        return request;
    }
    let has_no_room = scene.refusal_of(Effect::Vectors).is_some();
    let projects = scene.inside.along != AlongRay::Composite;
    let cuts = !scene.inside.is_plain();
    let mut is_alone = !scene.shows_field();
    ui.horizontal(|ui| {
        let hides = ui.checkbox(&mut is_alone, "Hide the scalar field").on_hover_text(
            "Draw the vectors alone: nothing of the scalar field is computed, and pictures are quicker",
        );
        if hides.changed() {
            scene.show_field(!is_alone);
        }
    });
    if has_no_room && !is_alone {
        let text = "Not drawn: this mode has no room for vectors beside the scalar field. Hide the field, \
                    or choose the exact mode under Splats";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    }
    if projects && !is_alone {
        let text = "Beside vectors Rendering is Volume, and nothing is cut away";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    } else if cuts && is_alone {
        let text = "Vectors alone are drawn whole: nothing of them is cut away";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    }
    animation_ui(ui, clock, fps, now);
    let help = "Draw one whole cycle and save it as an animated GIF or as numbered PNGs: it runs on \
                without a seam";
    let save = row_ui(ui, "", |ui| ui.button(SAVE_LOOP).on_hover_text(help).clicked());
    let request = if save { Some(VectorRequest::SaveLoop) } else { request };
    let scalar = scene.volume().map(Arc::clone);
    let scalar = scalar.as_deref();
    let mut layers = scene.vectors_mut().into_iter();
    let Some((first, settings)) = layers.next() else { return request };
    vector_look::look_ui(ui, Names::First, &first, settings, scalar);
    let second = ui.push_id("second", |ui| {
        let second = field_ui(ui, document, SECOND, shown(1), &mut triples[1]);
        if let Some((field, settings)) = layers.next() {
            let title = RichText::new("Look of the second field").size(12.5);
            let header = CollapsingHeader::new(title.color(theme::TEXT_FAINT)).default_open(true);
            header.show_unindented(ui, |ui| {
                vector_look::look_ui(ui, Names::Second, &field, settings, scalar);
            });
        }
        second
    });
    let request = second.inner.map(VectorRequest::Second).or(request);
    let box_of = || {
        let along = [ColourBy::X, ColourBy::Y, ColourBy::Z];
        let ranges = along.map(|by| by.range(&first, scalar));
        [0, 1].map(|end| DVec3::from(ranges.map(|range| range[end])))
    };
    let shape = flow::flow_ui(ui, choice, probed, box_of);
    shape.map(VectorRequest::Flow).or(request)
}

/// What the choice of a field is called, of which what is.
#[derive(Debug, Clone, Copy)]
struct Choice {
    name: &'static str,
    help: &'static str,
}

const FIRST: Choice = Choice {
    name: "Vectors",
    help: "Which field of three components is drawn as vectors, or which three scalar fields",
};
const SECOND: Choice = Choice {
    name: "Second field",
    help: "Add a second vector field, with a look of its own: both lie among each other in depth",
};

/// Which field is drawn, of those of three components or put together of three: what is to be drawn
/// instead of the one of the name that is `shown`.
fn field_ui(
    ui: &mut Ui,
    document: &Document,
    choice: Choice,
    shown: Option<&str>,
    triple: &mut Triple,
) -> Option<Option<VectorSource>> {
    let fields = || document.grid.fields.iter().enumerate();
    let mut request = None;
    row_ui(ui, choice.name, |ui| {
        let combo = ComboBox::from_id_salt("vectors").selected_text(shown.unwrap_or("None"));
        let response = combo.truncate().show_ui(ui, |ui| {
            if ui.choice(shown.is_none(), "None").clicked() {
                request = Some(None);
            }
            for (index, field) in fields().filter(|(_, field)| field.components == 3) {
                let name = field.name.as_str();
                if ui.choice(shown == Some(name), name).clicked() && shown != Some(name) {
                    request = Some(Some(VectorSource::Field(index)));
                }
            }
            if let Some(first) = document.scalar_triple() {
                let help = "Put vectors together of three scalar fields of the file: their components \
                            along x, y and z";
                let entry = ui.choice(triple.is_open(), "Three scalar fields…");
                if entry.on_hover_text(help).clicked() {
                    triple.open(first);
                }
            }
        });
        response.response.accessible_name(choice.name).on_hover_text(choice.help);
    });
    if request.is_some() {
        triple.close();
    }
    triple_ui(ui, document, triple).map(Some).or(request)
}

/// The three fields that vectors are put together of, while they are chosen.
fn triple_ui(ui: &mut Ui, document: &Document, triple: &mut Triple) -> Option<VectorSource> {
    let chosen = triple.fields()?;
    let fields = &document.grid.fields;
    for (axis, name) in ["Along x", "Along y", "Along z"].into_iter().enumerate() {
        row_ui(ui, name, |ui| {
            let label = fields.get(chosen[axis]).map_or("", |field| field.name.as_str());
            let combo = ComboBox::from_id_salt(name).selected_text(label).truncate();
            let shown = combo.show_ui(ui, |ui| {
                for (index, field) in fields.iter().enumerate() {
                    if field.components == 1
                        && ui.choice(index == chosen[axis], &field.name).clicked()
                    {
                        triple.choose(axis, index);
                    }
                }
            });
            let help = format!("The field whose values are the vectors' components {}", &name[6..]);
            shown.response.accessible_name(name).on_hover_text(help);
        });
    }
    let buttons = row_ui(ui, "", |ui| {
        let draw = ui.button("Draw as vectors").on_hover_text("Draw these three as vectors");
        let cancel = ui.button("Cancel").on_hover_text("Leave the vectors as they are");
        [draw.clicked(), cancel.clicked()]
    });
    if buttons != [false; 2] {
        triple.close();
    }
    buttons[0].then_some(VectorSource::Triple(chosen))
}

fn animation_ui(ui: &mut Ui, clock: &mut PhaseClock, fps: &mut u32, now: f64) {
    row_ui(ui, "Animation", |ui| {
        let text = if clock.is_running() { "Pause" } else { "Play" };
        let help =
            "Let the marks move along the flow (Space). At rest the picture is refined again";
        if ui.button(text).on_hover_text(help).clicked() {
            let runs = clock.is_running();
            clock.set_running(!runs, now);
        }
        let combo = ComboBox::from_id_salt("fps").width(84.0).selected_text(format!("≤ {fps} fps"));
        let shown = combo.show_ui(ui, |ui| {
            for most in [10, 20, 30, 60] {
                ui.choice_of(fps, most, format!("≤ {most} fps"));
            }
        });
        shown
            .response
            .accessible_name("Pictures a second")
            .on_hover_text("Animated pictures a second at most: fewer spare the battery");
    });
    row_ui(ui, "Speed", |ui| {
        let mut speed = clock.speed();
        let slider = typed::slider(ui, "Speed", &mut speed, -MOST_SPEED..=MOST_SPEED);
        let slider = slider.max_decimals(2);
        let help = "Cycles a second: negative runs backwards, 0 stands still";
        let response = slider_ui(ui, "Speed", true, slider).on_hover_text(help);
        if response.changed() {
            clock.set_speed(speed, now);
        }
    });
    let mut phase = clock.phase(now);
    let slider = typed::slider(ui, "Phase", &mut phase, 0.0..=1.0).fixed_decimals(3);
    let help = "How far the marks have moved, in cycles; drag to scrub";
    if slider_row(ui, "Phase", "Phase", slider, help) {
        clock.set_phase(phase, now);
    }
}
