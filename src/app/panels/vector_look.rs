//! What vector splats look like.

use eframe::egui::{CollapsingHeader, ComboBox, RichText, Ui};

use super::splat::{combo_ui, slider_row};
use super::{maps, reset_ui, row_ui, slider_ui, typed};
use crate::app::{theme, words};
use crate::core::Srgb8;
use crate::transfer::ColourSource;
use crate::vector::{ColourBy, Design, Foreshortening, MOST_STRETCH, VectorMode, VectorSettings};
use crate::volume::{ScalarVolume, VectorField};

/// Radii on offer, steps of the grid.
const EXTENT: std::ops::RangeInclusive<f64> = 0.5..=4.0;
/// Most halvings on offer.
const COARSER: std::ops::RangeInclusive<u32> = 0..=5;

/// What the widgets of a field are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Names {
    /// By what they are.
    First,
    /// With a word more, where there are two of each.
    Second,
}

impl Names {
    fn of(self, name: &str) -> String {
        match self {
            Self::First => name.to_owned(),
            Self::Second => format!("{name} (second)"),
        }
    }
}

/// Everything about how the vectors of a field look; `scalar` is the field beside them.
pub(super) fn look_ui(
    ui: &mut Ui,
    names: Names,
    field: &VectorField,
    settings: &mut VectorSettings,
    scalar: Option<&ScalarVolume>,
) {
    choice_ui(ui, names, "Mode", VectorMode::ALL, &mut settings.mode, mode_words);
    choice_ui(ui, names, "Marks", Design::ALL, &mut settings.design, design_words);
    opacity_ui(ui, names, field, settings, scalar);
    let before = settings.colour_by;
    choice_ui(ui, names, "Coloured by", ColourBy::ALL, &mut settings.colour_by, by_words);
    maps::map_ui(ui, &mut settings.transfer);
    if settings.mode == VectorMode::Blend {
        marks_colour_ui(ui, settings);
    }
    if settings.colour_by != before
        && let ColourSource::Map { range, .. } = &mut settings.transfer.colour
    {
        *range = settings.colour_by.range(field, scalar);
    }
    shape_ui(ui, names, settings);
}

/// Opacity as a ramp: below one length (or place, or value) nothing, from another on the greatest.
fn opacity_ui(
    ui: &mut Ui,
    names: Names,
    field: &VectorField,
    settings: &mut VectorSettings,
    scalar: Option<&ScalarVolume>,
) {
    let greatest = |settings: &VectorSettings| {
        settings.transfer.opacity.iter().map(|(_, opacity)| *opacity).fold(0.0, f64::max)
    };
    let by = settings.opacity_by;
    choice_ui(ui, names, "Opacity by", ColourBy::ALL, &mut settings.opacity_by, by_words);
    let range = match settings.opacity_by {
        // Nothing is shorter than nothing.
        ColourBy::Magnitude => [0.0, field.statistics.max],
        by => by.range(field, scalar),
    };
    if settings.opacity_by != by {
        let most = greatest(settings);
        settings.transfer.opacity = match settings.opacity_by {
            ColourBy::Magnitude => VectorSettings::for_field(field).transfer.opacity,
            // Nowhere transparent but at the lower end.
            _ => vec![(range[0], 0.0), (range[1], most)],
        };
    }
    let [least, most] = range;
    let most = if most > least { most } else { least + 1.0 };
    let points = &settings.transfer.opacity;
    let (low, high) = match points.as_slice() {
        [] => (least, most),
        [only] => (least, only.0),
        [first, .., last] => (first.0, last.0),
    };
    let (mut shown_from, mut full_from, mut opacity) = (low, high, greatest(settings));
    let mut changed = false;
    // Numbers that nobody has touched stay as they are: rounded, they would be a step to take back.
    let of_length = settings.opacity_by == ColourBy::Magnitude;
    let help = match of_length {
        true => "Shorter vectors are transparent, and cost nothing",
        false => "Vectors where it is less are transparent, and cost nothing",
    };
    let slider = typed::slider(ui, &names.of("Visible from"), &mut shown_from, least..=most)
        .custom_formatter(|length, _| words::value(length));
    changed |= slider_row(ui, "Visible from", &names.of("Visible from"), slider, help);
    let help = match of_length {
        true => "Vectors of this length and longer have the greatest opacity",
        false => "Vectors where it is this much and more have the greatest opacity",
    };
    let slider = typed::slider(ui, &names.of("Opaque from"), &mut full_from, least..=most)
        .custom_formatter(|length, _| words::value(length));
    changed |= slider_row(ui, "Opaque from", &names.of("Opaque from"), slider, help);
    let slider =
        typed::slider(ui, &names.of("Vector opacity"), &mut opacity, 0.0..=1.0).max_decimals(3);
    let help = "The greatest opacity, of matter as thick as Opacity over, under Splats, says";
    changed |= slider_row(ui, "Opacity", &names.of("Vector opacity"), slider, help);
    if changed {
        // A ramp that is dragged past its other end takes it along.
        let (a, b) = match shown_from != low {
            true => (shown_from, full_from.max(shown_from)),
            false => (shown_from.min(full_from), full_from),
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
                .on_hover_text("The one colour that marks have, blended into that of their splats");
        });
        ui.checkbox(&mut mapped, "Mapped")
            .on_hover_text("Marks in the colours of the map, in grey matter");
        settings.marks = (!mapped).then_some(colour);
    });
}

fn shape_ui(ui: &mut Ui, names: Names, settings: &mut VectorSettings) {
    let title = RichText::new("Shape").size(12.5).color(theme::TEXT_FAINT);
    CollapsingHeader::new(title).default_open(false).show_unindented(ui, |ui| {
        let slider =
            typed::slider(ui, &names.of("Stretch"), &mut settings.stretch, 1.0..=MOST_STRETCH)
                .max_decimals(2);
        let help = "Length of a splat along the flow over its width: wisps";
        slider_row(ui, "Stretch", &names.of("Stretch"), slider, help);
        row_ui(ui, "Splat radius", |ui| {
            let mut radius = settings.radius();
            let slider =
                typed::slider(ui, &names.of("Splat radius"), &mut radius, EXTENT).max_decimals(2);
            let help = "In steps of the vectors' grid; at 1.6 single splats are no longer seen";
            if slider_ui(ui, &names.of("Splat radius"), true, slider).on_hover_text(help).changed()
            {
                settings.extent = Some(radius);
            }
            let given = settings.extent.is_some();
            if reset_ui(ui, given, &names.of("Reset splat radius"), "Back to 1.6") {
                settings.extent = None;
            }
        });
        let slider = typed::slider(ui, &names.of("Coarser"), &mut settings.coarser, COARSER);
        let help = "Draw means of 2 × 2 × 2 vectors, and of these again: larger marks, and fewer";
        slider_row(ui, "Coarser", &names.of("Coarser"), slider, help);
        let way = &mut settings.foreshortening;
        choice_ui(ui, names, "Seen askew", Foreshortening::ALL, way, way_words);
        row_ui(ui, "Seed", |ui| {
            let drag = eframe::egui::DragValue::new(&mut settings.seed);
            super::number_ui(ui, &names.of("Seed"), drag).on_hover_text(
                "Another number shuffles the marks, so that they do not move in step",
            );
        });
    });
}

fn choice_ui<T: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    names: Names,
    name: &str,
    all: [T; N],
    now: &mut T,
    words: fn(T) -> (&'static str, &'static str),
) {
    row_ui(ui, name, |ui| {
        let combo = ComboBox::from_id_salt(name);
        *now = combo_ui(ui, &names.of(name), combo, &all, *now, words).unwrap_or(*now);
    });
}

fn mode_words(mode: VectorMode) -> (&'static str, &'static str) {
    match mode {
        VectorMode::Modulate => (
            "Modulate",
            "The marks alone are seen, in the colour and opacity of their vectors (Crawfis–Max)",
        ),
        VectorMode::Blend => (
            "Blend",
            "Vectors are seen as matter, with marks of another colour on it (Crawfis–Max)",
        ),
    }
}

fn design_words(design: Design) -> (&'static str, &'static str) {
    match design {
        Design::Streaks => ("Streaks", "Short lines along the flow, as Crawfis and Max drew them"),
        Design::Dots => ("Dots", "Round particles: the flow shows once they move"),
        Design::Comets => {
            ("Comets", "Bright heads and fading tails: the sense of the flow shows at rest")
        }
    }
}

fn way_words(way: Foreshortening) -> (&'static str, &'static str) {
    match way {
        Foreshortening::Table => {
            ("Table", "The marks as they look from there, from a table of views")
        }
        Foreshortening::Polygon => ("Shorter splat", "The splat itself is shortened"),
        Foreshortening::Coordinates => (
            "Stretched texture",
            "The marks alone are shortened, within a splat of the same length",
        ),
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
