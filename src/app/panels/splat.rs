//! How the volume is splatted.

use eframe::egui::{ComboBox, Slider, Ui};

use super::{reset_ui, row_ui, slider_ui};
use crate::app::words;
use crate::kernel::Kernel;
use crate::scene::Scene;

/// The splat radii on offer, voxels.
const EXTENT: std::ops::RangeInclusive<f64> = 0.5..=4.0;

/// Kernel, extent and opacity unit distance.
pub fn splat_ui(ui: &mut Ui, scene: &mut Scene) {
    row_ui(ui, "Kernel", |ui| {
        let chosen = scene.splat.kernel;
        let combo = ComboBox::from_id_salt("kernel").selected_text(words::kernel(chosen));
        let shown = combo.show_ui(ui, |ui| {
            for kernel in Kernel::ALL.into_iter().filter(|kernel| !kernel.is_separable()) {
                ui.selectable_value(&mut scene.splat.kernel, kernel, words::kernel(kernel))
                    .on_hover_text(words::kernel_help(kernel));
            }
        });
        shown.response.accessible_name("Kernel").on_hover_text(words::kernel_help(chosen));
    });
    row_ui(ui, "Extent", |ui| extent_ui(ui, scene));
    row_ui(ui, "Unit distance", |ui| unit_distance_ui(ui, scene));
}

fn extent_ui(ui: &mut Ui, scene: &mut Scene) {
    let natural = scene.splat.kernel.natural_extent();
    let mut extent = scene.splat.extent.or(natural).unwrap_or(1.0);
    let slider = Slider::new(&mut extent, EXTENT)
        // Only shown rounded: rounding the value itself would change it untouched.
        .custom_formatter(|v, _| format!("{v:.2}"));
    let response = slider_ui(ui, "Extent", natural.is_some(), slider)
        .on_hover_text(
            "Radius of a splat in voxels: larger is smoother, smaller is sharper and may show \
             gaps; the mean depth stays the same",
        )
        .on_disabled_hover_text("Points and boxes have a size of their own");
    if response.changed() {
        scene.splat.extent = Some(extent);
    }
    let changed = natural.is_some() && scene.splat.extent.is_some_and(|e| Some(e) != natural);
    if reset_ui(ui, changed, "Reset extent", "Back to the kernel's own radius") {
        scene.splat.extent = None;
    }
}

fn unit_distance_ui(ui: &mut Ui, scene: &mut Scene) {
    let voxel = scene.volume.lattice.smallest_spacing();
    let mut distance = scene.opacity_unit_distance();
    let slider = Slider::new(&mut distance, voxel * 0.01..=voxel * 100.0)
        .logarithmic(true)
        .custom_formatter(|v, _| words::value(v));
    let response = slider_ui(ui, "Unit distance", true, slider).on_hover_text(
        "The world length over which the opacities of the transfer function hold: longer makes \
         everything more transparent; by default the smallest voxel spacing",
    );
    if response.changed() {
        scene.splat.opacity_unit_distance = Some(distance);
    }
    let changed = scene.splat.opacity_unit_distance.is_some_and(|d| d != voxel);
    if reset_ui(ui, changed, "Reset unit distance", "Back to the smallest voxel spacing") {
        scene.splat.opacity_unit_distance = None;
    }
}
