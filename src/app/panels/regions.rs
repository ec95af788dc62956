//! Regions of value and gradient strength, over how often both occur together: to add, pull and colour.

mod plane;

use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Button, Checkbox, ComboBox, CornerRadius, Response, RichText, Sense, Ui, WidgetInfo, vec2,
};

use self::plane::{Counted, Grip, PlaneAxes, paint};
use super::inside::note_ui;
use super::splat::combo_ui;
use super::transfer::{opacity_ui, step_button, steps_ui, value_ui};
use super::{number_ui, row_ui, typed};
use crate::app::{theme, words};
use crate::core::Srgb8;
use crate::scene::{Scene, Shading, strong_gradient};
use crate::transfer::{MOST_REGIONS, Region, RegionShape};

/// Height of the plane, points.
const PLANE_HEIGHT: f32 = 156.0;
/// A new region is this part of the plane wide and high.
const NEW_SIZE: f64 = 0.25;
/// Until gradients are counted, the plane ends at this many strong ones.
const STRONG_SHOWN: f64 = 3.0;

/// What the hand is doing with the regions, and the counts behind them. Only the selection and the counts
/// outlive a drag.
#[derive(Default)]
pub struct RegionEditor {
    /// The region whose numbers are shown.
    pub selected: usize,
    held: Option<Held>,
    counted: Counted,
}

/// A region in the hand: how it was when it was taken, and where.
#[derive(Debug, Clone, Copy)]
struct Held {
    grip: Grip,
    index: usize,
    region: Region,
    at: [f64; 2],
}

impl RegionEditor {
    /// Lets go of what is held.
    pub fn let_go(&mut self) {
        self.held = None;
    }
}

/// The rows, and while there are regions the plane; `shown` are the values that the graph shows.
pub(super) fn regions_ui(
    ui: &mut Ui,
    editor: &mut RegionEditor,
    scene: &mut Scene,
    shown: [f64; 2],
) {
    let Some(volume) = scene.volume().map(Arc::clone) else { return };
    let strongest = editor.counted.strongest(&volume);
    let strongest = strongest.unwrap_or_else(|| STRONG_SHOWN * strong_gradient(&volume));
    let regions = &mut scene.shading.regions;
    let top = regions.iter().fold(strongest, |top, region| top.max(region.strengths[1]));
    row_ui(ui, "Boundaries", |ui| {
        let room = regions.len() < MOST_REGIONS;
        let add = ui.add_enabled(room, Button::new("Add region")).on_hover_text(
            "Choose matter by its value and by how sharply values change there (a 2D transfer function): \
             so a boundary is seen without other matter of the same value. Regions take the place of the \
             opacity curve",
        );
        let add =
            add.on_disabled_hover_text(format!("There are {MOST_REGIONS}, as many as may be"));
        if add.clicked() {
            let middle = [shown[0] / 2.0 + shown[1] / 2.0, NEW_SIZE / 2.0 * top];
            editor.selected = regions.len();
            regions.push(region_at(middle, shown, top));
        }
        let any = !regions.is_empty();
        let clear = ui.add_enabled(any, Button::new("Remove all"));
        let clear = clear.accessible_name("Remove all regions");
        if clear.on_hover_text("Back to opacities by the curve").clicked() {
            regions.clear();
        }
    });
    if regions.is_empty() {
        editor.held = None;
        return;
    }
    editor.counted.count(ui.ctx(), &volume);
    editor.selected = editor.selected.min(regions.len() - 1);
    unseen_ui(ui, scene);
    plane_ui(ui, editor, scene, shown, top);
    region_ui(ui, editor, scene);
}

/// Where the regions are not what is seen.
fn unseen_ui(ui: &mut Ui, scene: &Scene) {
    let text = if scene.shading.opacity.is_some() {
        "Opacity by another quantity (Shading, below) takes the place of the regions"
    } else if !Shading::is_shown_by(&scene.splat) {
        "This mode draws splats as triangles: it shows the opacity curve, and no regions"
    } else {
        return;
    };
    note_ui(ui, text);
}

/// The plane with its counts; changes regions as the hand says.
fn plane_ui(ui: &mut Ui, editor: &mut RegionEditor, scene: &mut Scene, shown: [f64; 2], top: f64) {
    let size = vec2(ui.available_width(), PLANE_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::drag());
    response.widget_info(|| {
        WidgetInfo::labeled(
            Role::Canvas,
            ui.is_enabled(),
            "Regions over value and gradient strength",
        )
    });
    let axes = PlaneAxes::new(rect.shrink(7.0), shown, top);
    plane::handle(ui, &response, editor, &mut scene.shading.regions, axes);
    let hover = response.hover_pos().filter(|at| axes.rect().expand(7.0).contains(*at));
    let painter = ui.painter_at(rect.expand(2.0));
    painter.rect_filled(rect, CornerRadius::same(5), theme::WELL);
    let inside = painter.with_clip_rect(rect.shrink(1.0));
    if let Some(counts) = editor.counted.counts() {
        plane::paint_counts(&inside, axes, counts);
    }
    paint(&inside, axes, scene, editor.selected, hover);
    ui.spacing_mut().item_spacing.y = 4.0;
    let caption = match (hover, editor.counted.is_under_way()) {
        (Some(at), _) => {
            let [value, strength] = axes.place(at);
            format!("{}, gradient {} a unit of length", words::value(value), words::value(strength))
        }
        (None, true) => "Counting gradients…".to_owned(),
        (None, false) => {
            "Values across, gradients upwards: pull at a side or the middle".to_owned()
        }
    };
    ui.label(RichText::new(caption).size(11.0).color(theme::TEXT_FAINT));
    ui.spacing_mut().item_spacing.y = theme::ROW_SPACING;
}

/// Numbers, shape and colour of the selected region.
fn region_ui(ui: &mut Ui, editor: &mut RegionEditor, scene: &mut Scene) {
    let Some((volume, transfer)) = scene.volume().cloned().zip(scene.transfer().cloned()) else {
        return;
    };
    let regions = &mut scene.shading.regions;
    let (index, last) = (editor.selected, regions.len().saturating_sub(1));
    let Some(&(mut region)) = regions.get(index) else { return };
    let mut removed = false;
    row_ui(ui, "Region", |ui| {
        ui.spacing_mut().combo_width = 84.0;
        let combo = ComboBox::from_id_salt("region shape");
        let chosen =
            combo_ui(ui, "Region shape", combo, &RegionShape::ALL, region.shape, shape_words);
        region.shape = chosen.unwrap_or(region.shape);
        steps_ui(ui, &mut editor.selected, last, "region");
        removed = step_button(ui, "×", "Remove region", true).clicked();
    });
    row_ui(ui, "Region opacity", |ui| {
        opacity_ui(ui, "Region opacity", &mut region.opacity)
            .on_hover_text("Opacity in its middle, 0 to 1");
        super::name_ui(ui, "soft");
        let softness = typed::number(ui, "Region softness", &mut region.softness, 0.0..=1.0);
        number_ui(ui, "Region softness", softness.speed(0.005).max_decimals(3)).on_hover_text(
            "Softness: the part of the way from its border to its middle over which the opacity rises",
        );
    });
    row_ui(ui, "Region colour", |ui| {
        let mut own = region.colour.is_some();
        let check = ui.add(Checkbox::new(&mut own, "Own")).accessible_name("Region's own colour");
        let check = check.on_hover_text("A colour of its own, rather than those of its values");
        if check.changed() {
            let middle = region.values[0] / 2.0 + region.values[1] / 2.0;
            let [r, g, b, _] = super::graph::to_screen(transfer.colour_at(middle)).to_array();
            region.colour = own.then_some(Srgb8([r, g, b]));
        }
        if let Some(Srgb8(colour)) = &mut region.colour {
            ui.color_edit_button_srgb(colour)
                .accessible_name("Region colour")
                .on_hover_text("Its colour");
        }
    });
    let help = "The values that it spans, in the data's own units";
    pair_ui(
        ui,
        "Values",
        ["Region values from", "Region values to"],
        help,
        &mut region.values,
        |ui, name, value| value_ui(ui, name, value, &volume.statistics),
    );
    let speed = strong_gradient(&volume) / 100.0;
    let help = "The gradient strengths that it spans: data units per unit of length, from 0 on";
    let names = ["Region gradients from", "Region gradients to"];
    pair_ui(ui, "Gradients", names, help, &mut region.strengths, |ui, name, strength| {
        let drag = typed::number(ui, name, strength, 0.0..=f64::MAX).speed(speed);
        number_ui(ui, name, drag.custom_formatter(|v, _| words::value(v)))
    });
    if removed {
        regions.remove(index);
        editor.held = None;
    } else if region != regions[index] && region.validate().is_ok() {
        regions[index] = region;
    }
}

/// Two numbers, the lower one first.
fn pair_ui(
    ui: &mut Ui,
    row: &str,
    names: [&str; 2],
    help: &str,
    [low, high]: &mut [f64; 2],
    number: impl Fn(&mut Ui, &str, &mut f64) -> Response,
) {
    row_ui(ui, row, |ui| {
        number(ui, names[0], low).on_hover_text(help);
        super::name_ui(ui, "to");
        number(ui, names[1], high).on_hover_text(help);
    });
}

fn shape_words(shape: RegionShape) -> (&'static str, &'static str) {
    match shape {
        RegionShape::Rectangle => (
            "Rectangle",
            "Matter of some values, where gradients are weak: one that begins at gradient 0 has no \
             border there",
        ),
        RegionShape::Ellipse => {
            ("Ellipse", "The boundary between two matters: an arch in the counts")
        }
        RegionShape::Triangle => (
            "Triangle",
            "The surface of one value, equally thick whether values change slowly or abruptly",
        ),
    }
}

/// A new region about a place of the plane: down to gradient 0 where it comes near.
fn region_at([value, strength]: [f64; 2], shown: [f64; 2], top: f64) -> Region {
    // Halved, so that ±1e308 does not overflow.
    let half_width = (shown[1] / 2.0 - shown[0] / 2.0) * NEW_SIZE;
    let half_height = top * NEW_SIZE / 2.0;
    let low = strength - half_height;
    Region {
        shape: RegionShape::Rectangle,
        values: [value - half_width, value + half_width],
        strengths: [if low < 0.1 * half_height { 0.0 } else { low }, strength + half_height],
        softness: 0.3,
        opacity: 0.3,
        colour: None,
    }
}
