//! How the volume is splatted.

use eframe::egui::{Button, CollapsingHeader, ComboBox, RichText, Slider, Ui};

use super::{reset_ui, row_ui, slider_ui};
use crate::app::modes::{self, PRESETS};
use crate::app::{theme, words};
use crate::kernel::Kernel;
use crate::scene::{
    Backend, Classify, LEAST_SLABS_PER_VOXEL, ModeChoice, OpacityModel, Order, Reconstruction,
    SplatSettings, Visibility,
};

/// The splat radii on offer, voxels.
const EXTENT: std::ops::RangeInclusive<f64> = 0.5..=4.0;
/// The slabs on offer, per voxel: more is a wait that hardly shows.
const SLABS: std::ops::RangeInclusive<f64> = LEAST_SLABS_PER_VOXEL..=16.0;
/// The sheets on offer, per kernel.
const SHEETS: std::ops::RangeInclusive<u32> = 1..=16;

/// Every choice of a mode. `voxel` is the smallest spacing, world units.
///
/// A choice that contradicts others takes them along; see [`modes::changed`].
pub fn splat_ui(ui: &mut Ui, splat: &mut SplatSettings, voxel: f64) {
    presets_ui(ui, splat);
    let mut chosen = ModeChoice::default();
    kernel_ui(ui, splat, &mut chosen);
    let now = *splat;
    let choice =
        Choice { row: "Reconstruction", all: Reconstruction::ALL, now: now.reconstruction };
    chosen.reconstruction = choice.ui(ui, words::reconstruction);
    let choice = Choice { row: "Classify", all: Classify::ALL, now: now.classify };
    chosen.classify = choice.ui(ui, words::classify);
    let choice = Choice { row: "Visibility", all: Visibility::ALL, now: now.visibility };
    chosen.visibility = choice.ui(ui, words::visibility);
    layers_ui(ui, splat, &mut chosen);
    row_ui(ui, "Extent", |ui| extent_ui(ui, splat, &mut chosen));
    row_ui(ui, "Unit distance", |ui| unit_distance_ui(ui, splat, voxel));
    let title = RichText::new("Advanced").size(12.5).color(theme::TEXT_FAINT);
    CollapsingHeader::new(title).default_open(false).show_unindented(ui, |ui| {
        let choice = Choice { row: "Opacity", all: OpacityModel::ALL, now: now.opacity_model };
        chosen.opacity_model = choice.ui(ui, words::opacity_model);
        let choice = Choice { row: "Order", all: Order::ALL, now: now.order };
        chosen.order = choice.ui(ui, words::order);
        let choice = Choice { row: "Back end", all: Backend::ALL, now: now.backend };
        chosen.backend = choice.ui(ui, words::backend);
    });
    if chosen != ModeChoice::default() {
        *splat = modes::changed(splat, chosen);
    }
}

fn presets_ui(ui: &mut Ui, splat: &mut SplatSettings) {
    row_ui(ui, "Preset", |ui| {
        for (name, preset, help) in PRESETS {
            let button = Button::new(name).selected(modes::same_mode(splat, &preset));
            if ui.add(button).on_hover_text(help).clicked() {
                *splat = modes::with_unit_distance_of(preset, splat);
            }
        }
    });
}

fn kernel_ui(ui: &mut Ui, splat: &SplatSettings, chosen: &mut ModeChoice) {
    row_ui(ui, "Kernel", |ui| {
        let combo = ComboBox::from_id_salt("kernel").selected_text(words::kernel(splat.kernel));
        let shown = combo.show_ui(ui, |ui| {
            for kernel in Kernel::ALL {
                let label = ui.selectable_label(kernel == splat.kernel, words::kernel(kernel));
                if label.on_hover_text(words::kernel_help(kernel)).clicked() {
                    chosen.kernel = Some(kernel);
                }
            }
        });
        let help = words::kernel_help(splat.kernel);
        shown.response.accessible_name("Kernel").on_hover_text(help);
    });
}

/// A row with a list of names.
struct Choice<T: 'static> {
    row: &'static str,
    all: &'static [T],
    now: T,
}

impl<T: Copy + PartialEq> Choice<T> {
    /// The row; what was chosen in it. `words` names each entry and says what it means.
    fn ui(self, ui: &mut Ui, words: fn(T) -> (&'static str, &'static str)) -> Option<T> {
        let mut chosen = None;
        row_ui(ui, self.row, |ui| {
            let (name, help) = words(self.now);
            let combo = ComboBox::from_id_salt(self.row).selected_text(name);
            let shown = combo.show_ui(ui, |ui| {
                for &one in self.all {
                    let (name, help) = words(one);
                    let label = ui.selectable_label(one == self.now, name);
                    if label.on_hover_text(help).clicked() {
                        chosen = Some(one);
                    }
                }
            });
            shown.response.accessible_name(self.row).on_hover_text(help);
        });
        chosen
    }
}

/// How finely the volume is cut, where it is cut.
fn layers_ui(ui: &mut Ui, splat: &SplatSettings, chosen: &mut ModeChoice) {
    match splat.visibility {
        Visibility::EverySample => {}
        Visibility::Slabs => {
            row_ui(ui, "Slabs", |ui| {
                let mut slabs = splat.slabs_per_voxel;
                let slider = Slider::new(&mut slabs, SLABS)
                    .logarithmic(true)
                    .custom_formatter(|v, _| words::value((v * 100.0).round() / 100.0));
                let response = slider_ui(ui, "Slabs per voxel", true, slider).on_hover_text(
                    "Slabs per voxel: more are slower and nearer to the exact picture; twice as \
                     many leave about a quarter of the error",
                );
                if response.changed() {
                    chosen.slabs_per_voxel = Some(slabs);
                }
                let changed = splat.slabs_per_voxel != 1.0;
                if reset_ui(ui, changed, "Reset slabs per voxel", "Back to one slab per voxel") {
                    chosen.slabs_per_voxel = Some(1.0);
                }
            });
        }
        Visibility::Sheets => {
            row_ui(ui, "Sheets", |ui| {
                let mut sheets = splat.sheets_per_kernel;
                let slider = Slider::new(&mut sheets, SHEETS);
                let response = slider_ui(ui, "Sheets per kernel", true, slider).on_hover_text(
                    "Sheets that each kernel is cut into; one keeps every kernel whole in the \
                     sheet of its own slice",
                );
                if response.changed() {
                    chosen.sheets_per_kernel = Some(sheets);
                    chosen.visibility = Some(Visibility::Sheets);
                }
            });
        }
    }
}

fn extent_ui(ui: &mut Ui, splat: &mut SplatSettings, chosen: &mut ModeChoice) {
    let natural = splat.kernel.natural_extent();
    let mut extent = splat.extent.or(natural).unwrap_or(1.0);
    let slider = Slider::new(&mut extent, EXTENT)
        // Only shown rounded: rounding the value itself would change it untouched.
        .custom_formatter(|v, _| format!("{v:.2}"));
    let response = slider_ui(ui, "Extent", natural.is_some(), slider)
        .on_hover_text(
            "Radius of a splat in voxels: larger is smoother, smaller is sharper and may show \
             gaps; the mean depth stays the same",
        )
        .on_disabled_hover_text("This kernel has a size of its own; Gaussian and cubic have not");
    if response.changed() {
        chosen.extent = Some(extent);
    }
    let changed = natural.is_some() && splat.extent.is_some_and(|e| Some(e) != natural);
    if reset_ui(ui, changed, "Reset extent", "Back to the kernel's own radius") {
        splat.extent = None;
    }
}

fn unit_distance_ui(ui: &mut Ui, splat: &mut SplatSettings, voxel: f64) {
    let mut distance = splat.opacity_unit_distance.unwrap_or(voxel);
    let slider = Slider::new(&mut distance, voxel * 0.01..=voxel * 100.0)
        .logarithmic(true)
        .custom_formatter(|v, _| words::value(v));
    let response = slider_ui(ui, "Unit distance", true, slider).on_hover_text(
        "The world length over which the opacities of the transfer function hold: longer makes \
         everything more transparent; by default the smallest voxel spacing",
    );
    if response.changed() {
        splat.opacity_unit_distance = Some(distance);
    }
    let changed = splat.opacity_unit_distance.is_some_and(|d| d != voxel);
    if reset_ui(ui, changed, "Reset unit distance", "Back to the smallest voxel spacing") {
        splat.opacity_unit_distance = None;
    }
}
