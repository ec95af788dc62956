//! Vector splats: which field, what they look like, and the animation.

use eframe::egui::{CollapsingHeader, ComboBox, RichText, Slider, SliderClamping, Ui};

use super::{maps, reset_ui, row_ui, slider_ui};
use crate::app::document::Document;
use crate::app::flow::{FlowChoice, FlowShape};
use crate::app::theme;
use crate::core::Srgb8;
use crate::scene::{AlongRay, Scene, VectorLayer};
use crate::vector::{
    ColourBy, Design, Foreshortening, MOST_SPEED, MOST_STRETCH, PhaseClock, VectorMode,
    VectorSettings,
};

/// Radii on offer, steps of the grid.
const EXTENT: std::ops::RangeInclusive<f64> = 0.5..=4.0;
/// Most halvings on offer.
const COARSER: std::ops::RangeInclusive<u32> = 0..=5;

/// What a person asked of the section that it cannot do itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VectorRequest {
    /// The vectors of this field of the file, or none.
    Field(Option<usize>),
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
    flow: &mut FlowChoice,
) -> Option<VectorRequest> {
    let request = field_ui(ui, document, scene);
    let lacks_room = scene.lacks_room_for_vectors();
    let projects = scene.inside.along != AlongRay::Composite;
    let cuts = !scene.inside.is_plain();
    let range = |layer: &VectorLayer, by| layer.range_of(by, &scene.volume);
    let Some(layer) = &mut scene.vectors else { return request };
    ui.horizontal(|ui| {
        ui.checkbox(&mut layer.alone, "Hide the scalar field").on_hover_text(
            "Draw the vectors alone: nothing of the scalar field is computed, and pictures are quicker",
        );
    });
    if lacks_room && !layer.alone {
        let text = "Not drawn: this mode is of triangles, or of several sheets a kernel. Hide the scalar \
                    field, or choose another mode under Splats";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    }
    if projects && !layer.alone {
        let text = "Beside vectors, values are not projected, and what is cut away is drawn";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    } else if cuts && layer.alone {
        let text = "Vectors alone are drawn whole: nothing of them is cut away";
        ui.label(RichText::new(text).size(12.0).color(theme::NOTE));
    }
    animation_ui(ui, clock, fps, now);
    let help = "Draw one whole cycle and save it as an animated GIF or as numbered PNGs: it runs on \
                without a seam";
    let save = row_ui(ui, "", |ui| ui.button("Save loop…").on_hover_text(help).clicked());
    let request = if save { Some(VectorRequest::SaveLoop) } else { request };
    let settings = &mut layer.settings;
    choice_ui(ui, "Mode", VectorMode::ALL, &mut settings.mode, mode_words);
    choice_ui(ui, "Marks", Design::ALL, &mut settings.design, design_words);
    let before = (settings.colour_by, settings.opacity_by);
    opacity_ui(ui, layer);
    let settings = &mut layer.settings;
    choice_ui(ui, "Coloured by", ColourBy::ALL, &mut settings.colour_by, by_words);
    maps::map_ui(ui, &mut settings.transfer);
    if settings.mode == VectorMode::Blend {
        marks_colour_ui(ui, settings);
    }
    if layer.settings.colour_by != before.0 {
        let range = range(layer, layer.settings.colour_by);
        if let crate::transfer::ColourSource::Map { range: colours, .. } =
            &mut layer.settings.transfer.colour
        {
            *colours = range;
        }
    }
    shape_ui(ui, &mut layer.settings);
    let shape = flow_ui(ui, flow);
    shape.map(VectorRequest::Flow).or(request)
}

/// What lines and arrows are made by; which of the two is to be made.
fn flow_ui(ui: &mut Ui, choice: &mut FlowChoice) -> Option<FlowShape> {
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

fn field_ui(ui: &mut Ui, document: &Document, scene: &Scene) -> Option<VectorRequest> {
    let vectors: Vec<(usize, &str)> = document
        .grid
        .fields
        .iter()
        .enumerate()
        .filter(|(_, field)| field.components == 3)
        .map(|(index, field)| (index, field.name.as_str()))
        .collect();
    let shown = scene.vectors.as_ref().map(|layer| layer.field.name.as_str());
    let mut request = None;
    row_ui(ui, "Vectors", |ui| {
        let combo = ComboBox::from_id_salt("vectors").selected_text(shown.unwrap_or("None"));
        let response = combo.truncate().show_ui(ui, |ui| {
            if ui.selectable_label(shown.is_none(), "None").clicked() {
                request = Some(VectorRequest::Field(None));
            }
            for (index, name) in vectors {
                if ui.selectable_label(shown == Some(name), name).clicked() && shown != Some(name) {
                    request = Some(VectorRequest::Field(Some(index)));
                }
            }
        });
        response
            .response
            .accessible_name("Vectors")
            .on_hover_text("Which field of three components is drawn as vectors");
    });
    request
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
                ui.selectable_value(fps, most, format!("≤ {most} fps"));
            }
        });
        shown
            .response
            .accessible_name("Pictures a second")
            .on_hover_text("Animated pictures a second at most: fewer spare the battery");
    });
    row_ui(ui, "Speed", |ui| {
        let mut speed = clock.speed();
        let slider = Slider::new(&mut speed, -MOST_SPEED..=MOST_SPEED).max_decimals(2);
        let help = "Cycles a second: negative runs backwards, 0 stands still";
        let response = slider_ui(ui, "Speed", true, slider).on_hover_text(help);
        if response.changed() {
            clock.set_speed(speed, now);
        }
    });
    row_ui(ui, "Phase", |ui| {
        let mut phase = clock.phase(now);
        let slider = Slider::new(&mut phase, 0.0..=1.0).fixed_decimals(3);
        let help = "How far the marks have moved, in cycles; drag to scrub";
        let response = slider_ui(ui, "Phase", true, slider).on_hover_text(help);
        if response.changed() {
            clock.set_phase(phase, now);
        }
    });
}

/// Opacity as a ramp: below one length nothing, from another on the greatest.
fn opacity_ui(ui: &mut Ui, layer: &mut VectorLayer) {
    let most = layer.field.statistics.max.max(f64::MIN_POSITIVE);
    let settings = &mut layer.settings;
    let points = &settings.transfer.opacity;
    let (low, high) = match points.as_slice() {
        [] => (0.0, most),
        [only] => (0.0, only.0),
        [first, .., last] => (first.0, last.0),
    };
    let greatest = points.iter().map(|(_, opacity)| *opacity).fold(0.0, f64::max);
    let (mut from_length, mut to_length, mut opacity) = (low, high, greatest);
    let mut changed = false;
    // Numbers that nobody has touched stay as they are: rounded, they would be a step to take back.
    let untouched = SliderClamping::Edits;
    row_ui(ui, "Shown from", |ui| {
        let slider = Slider::new(&mut from_length, 0.0..=most).max_decimals(6);
        let slider = slider.clamping(untouched);
        let help = "Shorter vectors are transparent, and cost nothing";
        changed |= slider_ui(ui, "Shown from", true, slider).on_hover_text(help).changed();
    });
    row_ui(ui, "Full from", |ui| {
        let slider = Slider::new(&mut to_length, 0.0..=most).max_decimals(6);
        let slider = slider.clamping(untouched);
        let help = "Vectors of this length and longer have the greatest opacity";
        changed |= slider_ui(ui, "Full from", true, slider).on_hover_text(help).changed();
    });
    row_ui(ui, "Opacity", |ui| {
        let slider = Slider::new(&mut opacity, 0.0..=1.0).max_decimals(3);
        let slider = slider.clamping(untouched);
        let help = "The greatest opacity per unit distance";
        changed |= slider_ui(ui, "Vector opacity", true, slider).on_hover_text(help).changed();
    });
    if changed {
        // A ramp that is dragged past its other end takes it along.
        let (a, b) = match from_length != low {
            true => (from_length, to_length.max(from_length)),
            false => (from_length.min(to_length), to_length),
        };
        settings.transfer.opacity = vec![(a, 0.0), (b, opacity)];
    }
}

fn marks_colour_ui(ui: &mut Ui, settings: &mut VectorSettings) {
    row_ui(ui, "Mark colour", |ui| {
        let mut mapped = settings.marks.is_none();
        let mut colour = settings.marks.unwrap_or(Srgb8::WHITE);
        ui.add_enabled_ui(!mapped, |ui| {
            ui.color_edit_button_srgb(&mut colour.0)
                .on_hover_text("The constant colour that BLEND dissolves the splat's own into");
        });
        ui.checkbox(&mut mapped, "Mapped")
            .on_hover_text("Marks in the colours of the map, in grey matter");
        settings.marks = (!mapped).then_some(colour);
    });
}

fn shape_ui(ui: &mut Ui, settings: &mut VectorSettings) {
    let title = RichText::new("Shape").size(12.5).color(theme::TEXT_FAINT);
    CollapsingHeader::new(title).default_open(false).show_unindented(ui, |ui| {
        row_ui(ui, "Stretch", |ui| {
            let slider = Slider::new(&mut settings.stretch, 1.0..=MOST_STRETCH).max_decimals(2);
            let help = "Length of a splat along the flow over its width: wisps";
            slider_ui(ui, "Stretch", true, slider).on_hover_text(help);
        });
        row_ui(ui, "Splat radius", |ui| {
            let mut radius = settings.radius();
            let slider = Slider::new(&mut radius, EXTENT).max_decimals(2);
            let help = "In steps of the vectors' grid; 1.6 hides the single splats";
            if slider_ui(ui, "Splat radius", true, slider).on_hover_text(help).changed() {
                settings.extent = Some(radius);
            }
            let given = settings.extent.is_some();
            if reset_ui(ui, given, "Reset splat radius", "Back to 1.6") {
                settings.extent = None;
            }
        });
        row_ui(ui, "Coarser", |ui| {
            let slider = Slider::new(&mut settings.coarser, COARSER);
            let help =
                "Draw means of 2 × 2 × 2 vectors, and of these again: larger marks, and fewer";
            slider_ui(ui, "Coarser", true, slider).on_hover_text(help);
        });
        choice_ui(ui, "Seen askew", Foreshortening::ALL, &mut settings.foreshortening, way_words);
        row_ui(ui, "Seed", |ui| {
            let drag = eframe::egui::DragValue::new(&mut settings.seed);
            super::number_ui(ui, "Seed", drag)
                .on_hover_text("Of the splats' own phases, which keep them from moving in step");
        });
    });
}

fn choice_ui<T: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    name: &str,
    all: [T; N],
    now: &mut T,
    words: impl Fn(T) -> (&'static str, &'static str),
) {
    row_ui(ui, name, |ui| {
        let combo = ComboBox::from_id_salt(name).selected_text(words(*now).0);
        let shown = combo.show_ui(ui, |ui| {
            for one in all {
                let (text, help) = words(one);
                if ui.selectable_label(one == *now, text).on_hover_text(help).clicked() {
                    *now = one;
                }
            }
        });
        shown.response.accessible_name(name).on_hover_text(words(*now).1);
    });
}

fn mode_words(mode: VectorMode) -> (&'static str, &'static str) {
    match mode {
        VectorMode::Modulate => (
            "Modulate",
            "Colour and opacity times the marks' intensity: the marks alone are seen (Crawfis–Max)",
        ),
        VectorMode::Blend => (
            "Blend",
            "Matter with marks in it: a dissolve from the splat's colour to that of the marks \
             (Crawfis–Max)",
        ),
    }
}

fn design_words(design: Design) -> (&'static str, &'static str) {
    match design {
        Design::Streaks => ("Streaks", "Short scratch marks along the flow, as in the paper"),
        Design::Dots => ("Dots", "Round particles: the flow shows once they move"),
        Design::Comets => {
            ("Comets", "Bright heads and fading tails: the sense of the flow shows at rest")
        }
    }
}

fn way_words(way: Foreshortening) -> (&'static str, &'static str) {
    match way {
        Foreshortening::Table => {
            ("Table", "The particles as seen from there, from a table of views")
        }
        Foreshortening::Polygon => ("Shorter splat", "The splat itself is shortened"),
        Foreshortening::Coordinates => {
            ("Stretched texture", "The texture is compressed within the same window")
        }
    }
}

fn by_words(by: ColourBy) -> (&'static str, &'static str) {
    match by {
        ColourBy::Magnitude => ("Length", "The length of the vector"),
        ColourBy::X => ("x", "World position along x"),
        ColourBy::Y => ("y", "World position along y"),
        ColourBy::Z => ("z", "World position along z"),
        ColourBy::Scalar => ("Scalar field", "The scalar field, where the vector stands"),
    }
}
