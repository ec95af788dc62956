//! How the volume is splatted.

use eframe::egui::{
    Button, CollapsingHeader, ComboBox, Label, Painter, Rect, Response, RichText, Slider, Ui,
};

use super::lists::ListUi;
use super::{number_ui, pictures, reset_ui, row_ui, slider_ui, typed};
use crate::app::modes::{self, PRESETS};
use crate::app::{theme, words};
use crate::kernel::{Kernel, MOST_EXTENT, Subdivisions};
use crate::scene::{
    Backend, Classify, CutSettings, ErrorMeasure, LEAST_SLABS_PER_VOXEL, ModeChoice, OpacityModel,
    Order, Reconstruction, SplatSettings, Visibility,
};

/// The splat radii on offer, voxels.
const EXTENT: std::ops::RangeInclusive<f64> = 0.5..=MOST_EXTENT;
/// The slabs on offer, per voxel: more is a wait that hardly shows.
const SLABS: std::ops::RangeInclusive<f64> = LEAST_SLABS_PER_VOXEL..=16.0;
/// The functions a cell on offer; the last stands for all of them.
const MOST_PER_CELL: u32 = 1024;
/// The sheets on offer, per kernel.
const SHEETS: std::ops::RangeInclusive<u32> = 1..=16;

/// Every choice of a mode. `unit` is the distance over which opacities are given where nobody chose one, world units; `slabs` is how
/// many a voxel has in a first look; `offers` tells which kernels the field can be drawn with.
///
/// A choice that contradicts others takes them along; see [`modes::changed`]. What would only put samples in the place of
/// cells, points or functions that are drawn as they are is left to the choice of the kernel.
pub fn splat_ui(
    ui: &mut Ui,
    splat: &mut SplatSettings,
    (unit, slabs, offers): (f64, f64, impl Fn(Kernel) -> bool),
) {
    let of_samples = splat.kernel.is_of_samples();
    if !modes::is_of_cells_or_points(splat) {
        presets_ui(ui, splat);
    }
    let mut chosen = ModeChoice::default();
    let kernels: Vec<Kernel> = Kernel::ALL.into_iter().filter(|kernel| offers(*kernel)).collect();
    let kernel_words = |kernel| (words::kernel(kernel), words::kernel_help(kernel));
    let help = match modes::is_of_cells_or_points(splat) {
        false => {
            "How far the value of one sample reaches, and how strongly: its neighbours' are faint"
        }
        true => {
            "What values are found by: cells or points as they are, or a kernel that blends evenly spaced samples of \
             them"
        }
    };
    chosen.kernel =
        pictured_ui(ui, ("Kernel", help), &kernels, splat.kernel, (kernel_words, pictures::kernel));
    if splat.kernel == Kernel::Gouraud {
        mesh_ui(ui, splat.gouraud, &mut chosen);
    }
    let now = *splat;
    if of_samples {
        let help = "What the samples, the dots, are blended to: along the filled curve; the other choice is faint";
        chosen.reconstruction = pictured_ui(
            ui,
            ("Reconstruction", help),
            Reconstruction::ALL,
            now.reconstruction,
            (words::reconstruction, pictures::reconstruction),
        );
    }
    let has_means = offers(Kernel::Functions);
    let is_offered = |classify: &Classify| match classify {
        Classify::Before => of_samples,
        Classify::Mean => has_means,
        Classify::After | Classify::PreIntegrated => true,
    };
    let times: Vec<Classify> = Classify::ALL.iter().copied().filter(is_offered).collect();
    let help = "When values become opacities. The green values pass through a thin layer that has opacity: what \
                is drawn of it is filled, the truth is faint";
    chosen.classify = pictured_ui(
        ui,
        ("Colouring", help),
        &times,
        now.classify,
        (words::classify, pictures::classify),
    );
    if of_samples {
        let help = "What is added up before it is laid over what lies behind it, seen from the side: the eye looks \
                    at a turned lattice of samples";
        chosen.visibility = pictured_ui(
            ui,
            ("Visibility", help),
            Visibility::ALL,
            now.visibility,
            (words::visibility, pictures::visibility),
        );
    }
    layers_ui(ui, splat, slabs, &mut chosen);
    if of_samples {
        let wide =
            |painter: &Painter, rect| pictures::extent(painter, rect, now.kernel, now.extent);
        let help = "How far a kernel reaches, in voxels; at its natural width it is faint";
        pictures::explained_row_ui(ui, "Extent", (help, wide), |ui| {
            extent_ui(ui, splat, &mut chosen);
        });
    }
    let help = "How thick matter has to be to be as opaque as the transfer function says: thicker matter hides more, as here";
    pictures::explained_row_ui(ui, "Opacity over", (help, pictures::unit_distance), |ui| {
        unit_distance_ui(ui, splat, unit);
    });
    let title = RichText::new("Advanced").size(12.5).color(theme::TEXT_FAINT);
    CollapsingHeader::new(title).default_open(false).show_unindented(ui, |ui| {
        let help = "How opaque samples are together where they overlap: here three of opacity 0.6; the other choice \
                    is faint";
        chosen.opacity_model = pictured_ui(
            ui,
            ("Opacity", help),
            OpacityModel::ALL,
            now.opacity_model,
            (words::opacity_model, pictures::opacity_model),
        );
        let help = "What is drawn first, as seen from the side: what opaque matter hides need not be drawn";
        chosen.order = pictured_ui(
            ui,
            ("Order", help),
            Order::ALL,
            now.order,
            (words::order, pictures::order),
        );
        if of_samples {
            let help = "How splats come onto the screen: as triangles, or in tiles of pixels";
            chosen.backend = pictured_ui(
                ui,
                ("Back end", help),
                Backend::ALL,
                now.backend,
                (words::backend, pictures::backend),
            );
            let [text, why] = back_end_words(&now);
            let text = RichText::new(text).size(12.0).color(theme::TEXT_FAINT);
            row_ui(ui, "", |ui| ui.add(Label::new(text).truncate()).on_hover_text(why));
        }
    });
    if chosen != ModeChoice::default() {
        *splat = modes::changed(splat, chosen);
    }
    if of_samples {
        cut_ui(ui, &mut splat.cut);
    }
}

/// How the octree cuts of coarse pictures are fitted.
fn cut_ui(ui: &mut Ui, cut: &mut CutSettings) {
    let title = RichText::new("Coarse octree").size(12.5).color(theme::TEXT_FAINT);
    let header = CollapsingHeader::new(title).default_open(false);
    let shown = header.show_unindented(ui, |ui| {
        let chosen = choice_ui(ui, "Error of", ErrorMeasure::ALL, cut.measure, measure_words);
        cut.measure = chosen.unwrap_or(cut.measure);
        row_ui(ui, "Weighting", |ui| {
            ui.checkbox(&mut cut.view_dependent, "By what shows").on_hover_text(
                "Nodes behind opaque matter may stay coarse, and those near the eye are split further: \
                 nearer to the full picture with as many nodes, but they change as you turn it",
            );
        });
        row_ui(ui, "Neighbours", |ui| {
            ui.checkbox(&mut cut.balanced, "Balanced").on_hover_text(
                "Nodes that share a face differ by at most one level, so that no large splat lies \
                 beside tiny ones: smoother seams, for nodes that could be finer elsewhere",
            );
        });
    });
    shown.header_response.on_hover_text(
        "While the view moves, boxes of voxels that differ little are drawn as one splat each. This says \
         which; the finished picture does not depend on it",
    );
}

/// What an error measure is called, and what it means, one line.
fn measure_words(measure: ErrorMeasure) -> (&'static str, &'static str) {
    match measure {
        ErrorMeasure::Scalar => (
            "Values",
            "How much the values in a node differ, whatever the transfer function makes of them \
             (Laur and Hanrahan's)",
        ),
        ErrorMeasure::Classified => (
            "Opacity and colour",
            "How much the voxels in a node differ once they have opacity and colour: follows the \
             transfer function",
        ),
        ErrorMeasure::OpticalDepth => (
            "Optical depth",
            "How much the matter differs from column to column, looking through a node along each of \
             its sides; colours do not count",
        ),
    }
}

/// What draws a mode, and what that was chosen by.
fn back_end_words(splat: &SplatSettings) -> [&'static str; 2] {
    if splat.kernel == Kernel::Gouraud {
        return [
            "Triangles draw this kernel",
            "A Gouraud splat is a mesh of triangles: tiles have none, so there is nothing to choose",
        ];
    }
    if splat.needs_tiles() {
        return [
            "Tiles draw this mode",
            "Triangles can only draw every sample by \
             optical depth, back to front: for all else there is nothing to choose",
        ];
    }
    match splat.backend {
        Backend::Auto => [
            "Triangles on a graphics processor",
            "Tiles draw this mode on the native engine, and kernels narrower than a pixel, of which they \
             average several rays; triangles all else. Both draw the same picture",
        ],
        Backend::Raster | Backend::Tiles => [
            "Chosen by you",
            "Automatic takes triangles on a graphics processor, and tiles on the native engine; both draw \
             the same picture",
        ],
    }
}

fn presets_ui(ui: &mut Ui, splat: &mut SplatSettings) {
    row_ui(ui, "Preset", |ui| {
        for (name, preset, help) in PRESETS {
            let button = Button::new(name).selected(modes::is_preset(splat, &preset));
            if ui.add(button).on_hover_text(help).clicked() {
                *splat = modes::with_unit_distance_of(preset, splat);
            }
        }
    });
}

/// How finely a splat is cut into triangles.
fn mesh_ui(ui: &mut Ui, now: Subdivisions, chosen: &mut ModeChoice) {
    let mut angles = now.angles;
    let slider = typed::slider(ui, "Mesh angles", &mut angles, Subdivisions::ANGLES);
    let help = "Corners about the middle of each splat: more are rounder and slower, fewer show their \
                edges";
    if slider_row(ui, "Mesh angles", "Mesh angles", slider, help) {
        chosen.gouraud_angles = Some(angles);
    }
    let mut rings = now.rings;
    let slider = typed::slider(ui, "Mesh rings", &mut rings, Subdivisions::RINGS);
    let help = "Rings of corners in each splat: more are smoother and slower, and matter most where \
                the data is opaque";
    if slider_row(ui, "Mesh rings", "Mesh rings", slider, help) {
        chosen.gouraud_rings = Some(rings);
    }
}

/// What of the basis functions is left out where these are drawn.
pub fn limits_ui(ui: &mut Ui, splat: &mut SplatSettings) {
    if splat.kernel != Kernel::Functions {
        return;
    }
    // Means of slabs are of whole functions.
    let can_limit = splat.classify != Classify::Mean;
    let limits = &mut splat.functions;
    row_ui(ui, "Per cell", |ui| {
        // As many as there are on offer stand for all of them, and for more that a saved scene or a flag asked for.
        let beyond = limits.per_cell.filter(|most| *most > MOST_PER_CELL);
        let mut most = limits.per_cell.unwrap_or(MOST_PER_CELL).min(MOST_PER_CELL);
        let slider = typed::slider(ui, "Functions per cell", &mut most, 1..=MOST_PER_CELL);
        let slider = slider.logarithmic(true).custom_formatter(move |v, _| match beyond {
            _ if v < f64::from(MOST_PER_CELL) => format!("{v:.0}"),
            Some(most) => most.to_string(),
            None => "all".to_owned(),
        });
        let response = slider_ui(ui, "Functions per cell", can_limit, slider)
            .on_hover_text(
                "The field is cut into cells, and each sums up the functions that are greatest in it: fewer are quicker and \
                 farther from the encoding",
            )
            .on_disabled_hover_text(
                "The mean of a slab is known of whole functions alone. Choose another colouring to sum up fewer in each cell",
            );
        if response.changed() {
            limits.per_cell = Some(most).filter(|most| *most < MOST_PER_CELL);
        }
        let changed = limits.per_cell.is_some();
        if reset_ui(ui, changed, "Reset functions per cell", "Back to all functions") {
            limits.per_cell = None;
        }
    });
    if limits.per_cell.is_some() {
        row_ui(ui, "", |ui| {
            ui.checkbox(&mut limits.corrects, "Correct between corners").on_hover_text(
                "What a cell leaves out is known at its corners, and added between them: smooth functions are hardly missed",
            );
        });
    }
    row_ui(ui, "Leave out", |ui| {
        error_ui(ui, ERROR_LEFT_OUT, &mut limits.max_rms).on_hover_text(
            "The least functions are not drawn, as long as the field is off by no more than this, on average, in the units of \
             its values; at 0 all are",
        );
        let changed = limits.max_rms != 0.0;
        if reset_ui(ui, changed, "Reset error of functions", "Back to all functions") {
            limits.max_rms = 0.0;
        }
    });
    row_ui(ui, "Quick pictures", |ui| {
        // At 0 tents stand for them.
        let mut rms = splat.quick_functions.unwrap_or_default();
        let response = error_ui(ui, ERROR_WHILE_MOVING, &mut rms).on_hover_text(
            "Quick pictures are of the functions that matter most, as long as the field is off by no more than this, on \
             average, in the units of its values; at 0 they are of linear kernels through evenly spaced samples",
        );
        if response.changed() {
            splat.quick_functions = Some(rms).filter(|rms| *rms > 0.0);
        }
        let changed = splat.quick_functions.is_some();
        if reset_ui(ui, changed, "Reset functions while moving", "Back to samples") {
            splat.quick_functions = None;
        }
    });
}

/// What the numbers of errors are called.
const ERROR_LEFT_OUT: &str = "Error of functions left out";
const ERROR_WHILE_MOVING: &str = "Error of functions while moving";

/// An error in the units of values, which may be none.
fn error_ui(ui: &mut Ui, name: &str, rms: &mut f64) -> Response {
    // By a fiftieth of what it is, and from nothing at all.
    let speed = (0.02 * *rms).max(0.001);
    let drag = typed::number(ui, name, rms, 0.0..=f64::MAX).speed(speed);
    number_ui(ui, name, drag.custom_formatter(|v, _| words::value(v)))
}

/// A row of a slider; whether it was moved.
pub(super) fn slider_row(
    ui: &mut Ui,
    row: &str,
    name: &str,
    slider: Slider<'_>,
    help: &str,
) -> bool {
    row_ui(ui, row, |ui| slider_ui(ui, name, true, slider).on_hover_text(help).changed())
}

/// A row with a list of names; what was chosen in it. `words` names each entry and says what it means.
pub(super) fn choice_ui<T: Copy + PartialEq, W: Into<String>>(
    ui: &mut Ui,
    row: &str,
    all: &[T],
    now: T,
    words: impl Fn(T) -> (W, &'static str),
) -> Option<T> {
    row_ui(ui, row, |ui| combo_ui(ui, row, ComboBox::from_id_salt(row), all, now, words))
}

/// The same with a picture of each entry, and one of what was chosen at the row's name, which `help` explains.
fn pictured_ui<T: Copy + PartialEq, W: Into<String>>(
    ui: &mut Ui,
    (row, help): (&str, &str),
    all: &[T],
    now: T,
    (words, paint): (impl Fn(T) -> (W, &'static str), impl Fn(&Painter, Rect, T)),
) -> Option<T> {
    let tooltip = |ui: &mut Ui, one: T| {
        pictures::explained_ui(ui, words(one).1, |painter, rect| paint(painter, rect, one));
    };
    let of_now = |painter: &Painter, rect| paint(painter, rect, now);
    pictures::explained_row_ui(ui, row, (help, of_now), |ui| {
        let mut chosen = None;
        // All entries at once: who does not see one does not look for it.
        let combo = ComboBox::from_id_salt(row).height(420.0);
        let combo = combo.selected_text(words(now).0.into());
        let shown = combo.show_ui(ui, |ui| {
            for &one in all {
                let entry = ui.choice(one == now, words(one).0.into());
                if entry.on_hover_ui(|ui| tooltip(ui, one)).clicked() {
                    chosen = Some(one);
                }
            }
        });
        shown.response.accessible_name(row).on_hover_ui(|ui| tooltip(ui, now));
        chosen
    })
}

/// The same without its row, called `name`.
pub(super) fn combo_ui<T: Copy + PartialEq, W: Into<String>>(
    ui: &mut Ui,
    name: &str,
    combo: ComboBox,
    all: &[T],
    now: T,
    words: impl Fn(T) -> (W, &'static str),
) -> Option<T> {
    let mut chosen = None;
    let (text, help) = words(now);
    let shown = combo.selected_text(text.into()).show_ui(ui, |ui| {
        for &one in all {
            let (text, help) = words(one);
            if ui.choice(one == now, text.into()).on_hover_text(help).clicked() {
                chosen = Some(one);
            }
        }
    });
    shown.response.accessible_name(name).on_hover_text(help);
    chosen
}

/// How finely the volume is cut, where it is cut.
fn layers_ui(ui: &mut Ui, splat: &SplatSettings, first: f64, chosen: &mut ModeChoice) {
    match splat.visibility {
        Visibility::EverySample => {}
        Visibility::Slabs => {
            let [name, help, reset, back] = slabs_words(splat);
            row_ui(ui, name, |ui| {
                let mut slabs = splat.slabs_per_voxel;
                let slider = typed::slider(ui, name, &mut slabs, SLABS)
                    .logarithmic(true)
                    .custom_formatter(|v, _| words::value((v * 100.0).round() / 100.0));
                let response = slider_ui(ui, name, true, slider).on_hover_text(help);
                if response.changed() {
                    chosen.slabs_per_voxel = Some(slabs);
                }
                if reset_ui(ui, splat.slabs_per_voxel != first, reset, back) {
                    chosen.slabs_per_voxel = Some(first);
                }
            });
        }
        Visibility::Sheets => {
            let mut sheets = splat.sheets_per_kernel;
            let slider = typed::slider(ui, "Sheets per kernel", &mut sheets, SHEETS);
            let help = "Sheets that each kernel is cut into; one keeps every kernel whole in the \
                        sheet of its own slice";
            if slider_row(ui, "Sheets", "Sheets per kernel", slider, help) {
                chosen.sheets_per_kernel = Some(sheets);
                chosen.visibility = Some(Visibility::Sheets);
            }
        }
    }
}

/// What the slider of slabs is called and helps with, and its reset button: slabs are measured by the samples, which stand for
/// cells, points and functions while these move.
fn slabs_words(splat: &SplatSettings) -> [&'static str; 4] {
    match splat.kernel.is_of_samples() {
        true => [
            "Slabs per voxel",
            "Each ray is cut into short steps, called slabs: so many in each voxel. More are slower and nearer to the exact \
             picture; twice as many leave about a quarter of the error",
            "Reset slabs per voxel",
            "Back to as many as the file was opened with",
        ],
        false => [
            "Slabs per sample",
            "Each ray is cut into short steps, called slabs: so many from one to the next of evenly spaced samples (Data tells \
             how many there are). More are slower and nearer to the exact picture",
            "Reset slabs per sample",
            "Back to as many as the file was opened with",
        ],
    }
}

fn extent_ui(ui: &mut Ui, splat: &mut SplatSettings, chosen: &mut ModeChoice) {
    let natural = splat.kernel.natural_extent();
    let mut extent = splat.extent.or(natural).unwrap_or(1.0);
    let (of_kernel, on_offer) = (splat.kernel.extents(), EXTENT);
    let least = on_offer.start().max(*of_kernel.start());
    let most = on_offer.end().min(*of_kernel.end());
    let slider = typed::slider(ui, "Extent", &mut extent, least..=most)
        // Only shown rounded: rounding the value itself would change it untouched.
        .custom_formatter(|v, _| format!("{v:.2}"));
    let response = slider_ui(ui, "Extent", natural.is_some(), slider)
        .on_hover_text(
            "How far each sample reaches, in voxels. Wider is smoother; narrower shows the samples themselves, and \
             gaps between round splats. At their default radius B-spline and linear kernels keep the value of every \
             sample. Matter stays as dense: only its detail changes",
        )
        .on_disabled_hover_text(
            "A point is one pixel and a nearest voxel is its own box, so neither has a radius. Choose any other \
             kernel to change it",
        );
    if response.changed() {
        chosen.extent = Some(extent);
    }
    let changed = natural.is_some() && splat.extent.is_some_and(|e| Some(e) != natural);
    if reset_ui(ui, changed, "Reset extent", "Back to the kernel's own radius") {
        splat.extent = None;
    }
}

fn unit_distance_ui(ui: &mut Ui, splat: &mut SplatSettings, own: f64) {
    let mut distance = splat.opacity_unit_distance.unwrap_or(own);
    let slider = typed::slider(ui, "Opacity over", &mut distance, own * 0.01..=own * 100.0)
        .logarithmic(true)
        .custom_formatter(|v, _| words::value(v));
    let response = slider_ui(ui, "Opacity over", true, slider).on_hover_text(
        "How thick matter has to be to be as opaque as the transfer function says (the opacity's unit distance): a longer \
         one makes everything more transparent. At first one voxel, the smallest spacing; of meshes the median edge of \
         their cells, of points how far they lie apart",
    );
    if response.changed() {
        splat.opacity_unit_distance = Some(distance);
    }
    let changed = splat.opacity_unit_distance.is_some_and(|d| d != own);
    if reset_ui(ui, changed, "Reset unit distance", "Back to the data's own") {
        splat.opacity_unit_distance = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_back_end_says_what_it_was_chosen_by() {
        let classic = SplatSettings::SHADE_FIRST;
        let words = |splat: &SplatSettings| back_end_words(splat)[0];
        assert_eq!(words(&classic), "Triangles on a graphics processor");
        let chosen = SplatSettings { backend: Backend::Raster, ..classic };
        assert_eq!(words(&chosen), "Chosen by you");
        assert_eq!(words(&SplatSettings::EXACT), "Tiles draw this mode");
    }
}
