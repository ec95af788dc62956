//! From values to opacity and colour: presets, the graph with its editors, the colours, the range.

use std::ops::RangeInclusive;
use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Button, ComboBox, CornerRadius, Response, RichText, Sense, Ui, WidgetInfo, vec2,
};

use super::bells::{self, BellEditor, handle_bells, paint_bells};
use super::curve::{
    PointEditor, handle_points, paint_curve, paint_points, pull_point, remove_point,
};
use super::freehand::{Stroke, handle_freehand};
use super::graph::{self, Axes, Extent, GraphView};
use super::inside::note_ui;
use super::labels::labels_ui;
use super::lists::ListUi;
use super::maps::map_ui;
use super::regions::{RegionEditor, regions_ui};
use super::stops::{self, StopEditor};
use super::stretch::{stretch, stretch_colours};
use super::{name_ui, number_ui, row_ui, typed, wide_number_ui};
use crate::app::actions::{Action, entry_of};
use crate::app::{theme, words};
use crate::scene::{AlongRay, Scene};
use crate::transfer::presets::{self, Preset, RangeRule};
use crate::transfer::{ColourSource, Gaussian, NoData, TransferFunction};
use crate::volume::{LabelName, Statistics};

/// Height of the graph, points.
const GRAPH_HEIGHT: f32 = 132.0;
/// Width of an opacity, points: long values beside it leave room for the buttons of their row.
const OPACITY_WIDTH: f32 = 48.0;

/// How the opacity curve is edited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Tool {
    #[default]
    Points,
    Gaussians,
    Freehand,
}

/// How the curve is shown and edited; none of it is part of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveView {
    tool: Tool,
    graph: GraphView,
}

/// What the hand is doing with the transfer function; none of it is part of the picture.
#[derive(Default)]
pub struct TransferEditor {
    points: PointEditor,
    bells: BellEditor,
    stops: StopEditor,
    /// Points or freehand; that there are bells says that these are edited.
    tool: Tool,
    stroke: Option<Stroke>,
    regions: RegionEditor,
    graph: GraphView,
    /// What each preset is for the volume that is open.
    known: Vec<(Preset, TransferFunction)>,
}

impl TransferEditor {
    /// How the curve is shown and edited.
    pub fn curve_view(&self) -> CurveView {
        CurveView { tool: self.tool, graph: self.graph }
    }

    /// Shows it as it was shown.
    pub fn set_curve_view(&mut self, CurveView { tool, graph }: CurveView) {
        (self.tool, self.graph) = (tool, graph);
    }

    /// Lets go of what is held, after something else has changed the function or the volume.
    pub fn let_go(&mut self) {
        self.points.let_go();
        self.bells.let_go();
        self.stops.let_go();
        self.stroke = None;
        self.regions.let_go();
        self.known.clear();
    }

    /// Lets go of everything that belongs to one function.
    pub fn start_over(&mut self) {
        let graph = self.graph;
        // What was counted of a volume is counted once.
        let mut regions = std::mem::take(&mut self.regions);
        regions.let_go();
        *self = Self { graph, regions, ..Self::default() };
    }
}

/// The section; `default` makes the function that a fresh file of these statistics would get, `names` are those of its labels.
/// What it cannot do itself is returned.
pub fn transfer_ui(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    scene: &mut Scene,
    gaussians: &mut Vec<Gaussian>,
    (default, names): (impl FnOnce(&Statistics) -> TransferFunction, &[&LabelName]),
) -> Option<Action> {
    let volume = Arc::clone(scene.volume()?);
    let statistics = &volume.statistics;
    let transfer = scene.transfer_mut()?;
    if editor.known.is_empty() {
        let made = |preset: Preset| (preset, preset.function(statistics));
        editor.known =
            Preset::ALL.into_iter().filter(|p| *p != Preset::Default).map(made).collect();
        editor.known.insert(0, (Preset::Default, default(statistics)));
    }
    if preset_ui(ui, editor, transfer, gaussians, statistics) {
        scene.shading.regions.clear();
    }
    let transfer = scene.transfer_mut()?;
    if labels_ui(ui, transfer, statistics, names) {
        gaussians.clear();
        editor.let_go();
    }
    if !scene.shading.regions.is_empty() {
        note_ui(ui, "Regions say what is opaque now: the curve counts again once all are removed");
    }
    if scene.inside.along != AlongRay::Composite {
        note_ui(
            ui,
            "In this rendering opacities do not count, and the colours span its own Range, on top of the side panel",
        );
    } else if scene.inside.is_faded {
        note_ui(
            ui,
            "The volume is faded: it is drawn with a small part of these opacities until View, Fade the volume, is switched off",
        );
    }
    let transfer = scene.transfer_mut()?;
    tools_ui(ui, editor, transfer, gaussians, statistics);
    graph_ui(ui, editor, transfer, gaussians, statistics);
    if !gaussians.is_empty() {
        bell_ui(ui, editor, transfer, gaussians, statistics);
    } else if editor.tool == Tool::Points {
        point_ui(ui, &mut editor.points, transfer, statistics);
    }
    view_ui(ui, &mut editor.graph);
    let shown = editor.graph.range(statistics, transfer.colour.range());
    regions_ui(ui, &mut editor.regions, scene, shown);
    let transfer = scene.transfer_mut()?;
    ui.add_space(4.0);
    map_ui(ui, transfer);
    if let ColourSource::Stops(stops) = &mut transfer.colour {
        stops::stop_ui(ui, &mut editor.stops, stops, statistics);
    }
    if statistics.nan_count > 0 {
        no_data_ui(ui, &mut transfer.no_data);
    }
    range_ui(ui, transfer, statistics);
    stretch_ui(ui, &editor.graph, transfer, gaussians, statistics);
    exchange_ui(ui)
}

/// Looks that many data call for; whether one was chosen.
fn preset_ui(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    transfer: &mut TransferFunction,
    gaussians: &mut Vec<Gaussian>,
    statistics: &Statistics,
) -> bool {
    // Presets say nothing of NaN.
    let with_no_data =
        |f: &TransferFunction| TransferFunction { no_data: transfer.no_data, ..f.clone() };
    let known = editor.known.iter().find(|(_, function)| with_no_data(function) == *transfer);
    let current = known.map(|(preset, _)| *preset).filter(|_| gaussians.is_empty());
    let mut chosen = None;
    row_ui(ui, "Preset", |ui| {
        let label = current.map_or("Custom", |preset| words::preset(preset).0);
        let combo = ComboBox::from_id_salt("preset").selected_text(label);
        let shown = combo.show_ui(ui, |ui| {
            for (preset, function) in &editor.known {
                let (label, help) = words::preset(*preset);
                let help = match preset.lacks_hounsfield_units(statistics) {
                    true => format!("{help}. These values are no Hounsfield units: by percentiles"),
                    false => help.to_owned(),
                };
                let entry = ui.choice(current == Some(*preset), label);
                if entry.on_hover_text(help).clicked() {
                    chosen = Some(with_no_data(function));
                }
            }
        });
        shown
            .response
            .accessible_name("Preset")
            .on_hover_text("Opacities and colours to begin with; each can be changed further");
    });
    let is_chosen = chosen.is_some();
    if let Some(function) = chosen {
        *transfer = function;
        gaussians.clear();
        (editor.tool, editor.points.selected) = (Tool::Points, 0);
    }
    is_chosen
}

/// How the curve is edited. From bells to points the curve stays; from points to bells it begins
/// anew, since points are no bells.
fn tools_ui(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    transfer: &mut TransferFunction,
    gaussians: &mut Vec<Gaussian>,
    statistics: &Statistics,
) {
    let before = if gaussians.is_empty() { editor.tool } else { Tool::Gaussians };
    let mut tool = before;
    row_ui(ui, "Opacity", |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.selectable_value(&mut tool, Tool::Points, "Points")
            .on_hover_text("Straight lines between points that can be pulled");
        ui.selectable_value(&mut tool, Tool::Gaussians, "Gaussians").on_hover_text(
            "Bells, each about one value; where they overlap the highest counts. Points are \
             replaced by a first one",
        );
        ui.selectable_value(&mut tool, Tool::Freehand, "Freehand")
            .on_hover_text("Draw the curve with the mouse; it becomes few points once let go");
    });
    if tool == before {
        return;
    }
    editor.let_go();
    editor.tool = tool;
    if tool == Tool::Gaussians {
        let shown = editor.graph.range(statistics, transfer.colour.range());
        let first = bells::first_bell(transfer, shown);
        bells::add_bell(transfer, gaussians, first);
    } else {
        gaussians.clear();
    }
}

/// The graph with its colour bar; changes opacities and stops as the hand says.
fn graph_ui(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    transfer: &mut TransferFunction,
    gaussians: &mut Vec<Gaussian>,
    statistics: &Statistics,
) {
    let size = vec2(ui.available_width(), GRAPH_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::drag());
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), "Opacity curve over the histogram")
    });
    let [low, high] = editor.graph.range(statistics, transfer.colour.range());
    let axes = Axes { rect: rect.shrink2(vec2(7.0, 7.0)), low, high };
    let caption = if !gaussians.is_empty() {
        handle_bells(ui, &response, &mut editor.bells, transfer, gaussians, axes);
        "Pull at a peak or a side, double-click for another"
    } else if editor.tool == Tool::Freehand {
        handle_freehand(ui, &response, &mut editor.stroke, transfer, axes);
        "Draw over the graph; what you do not pass over stays"
    } else {
        handle_points(ui, &response, &mut editor.points, transfer, axes);
        "Drag a point, press the line for a new one, right-click to remove"
    };
    let hover = response.hover_pos().filter(|at| axes.rect.expand(7.0).contains(*at));
    let painter = ui.painter_at(rect.expand(2.0));
    painter.rect_filled(rect, CornerRadius::same(5), theme::WELL);
    let inside = painter.with_clip_rect(rect.shrink(1.0));
    graph::paint_histogram(&inside, axes, statistics, editor.graph.log);
    graph::paint_under_curve(&inside, axes, transfer);
    paint_curve(&inside, axes, transfer);
    if !gaussians.is_empty() {
        paint_bells(&inside, axes, gaussians, &editor.bells, hover);
    } else if editor.tool == Tool::Points {
        paint_points(&inside, axes, transfer, &editor.points, hover);
    }
    ui.spacing_mut().item_spacing.y = 4.0;
    stops::bar_ui(ui, &mut editor.stops, transfer, axes);
    let caption = hover.map_or(caption.to_owned(), |at| graph::readout(axes, at, statistics));
    ui.label(RichText::new(caption).size(11.0).color(theme::TEXT_FAINT));
    ui.spacing_mut().item_spacing.y = theme::ROW_SPACING;
}

/// Numbers of the selected point.
fn point_ui(
    ui: &mut Ui,
    editor: &mut PointEditor,
    transfer: &mut TransferFunction,
    statistics: &Statistics,
) {
    editor.selected = editor.selected.min(transfer.opacity.len().saturating_sub(1));
    let index = editor.selected;
    let Some(&(mut value, mut opacity)) = transfer.opacity.get(index) else { return };
    // A point stays between its neighbours.
    let most = greatest_value(statistics);
    let beside = |index: Option<usize>, end: f64| {
        let point = index.and_then(|index| transfer.opacity.get(index));
        point.map_or(end, |point| point.0)
    };
    let range = beside(index.checked_sub(1), -most)..=beside(Some(index + 1), most);
    row_ui(ui, "Point", |ui| {
        // Long numbers leave room for the buttons.
        ui.spacing_mut().item_spacing.x = 4.0;
        let value_response = value_within_ui(ui, "Point value", &mut value, range, statistics)
            .on_hover_text("The value at which the selected point lies, in the data's own units");
        let opacity_response = opacity_ui(ui, "Point opacity", &mut opacity)
            .on_hover_text(
                "Opacity at the selected point, 0 to 1: of matter as thick as Opacity over, under Splats, says; at first one \
                    voxel or the edge of a cell",
            );
        if value_response.changed() || opacity_response.changed() {
            pull_point(transfer, index, value, opacity);
        }
        let last = transfer.opacity.len() - 1;
        steps_ui(ui, &mut editor.selected, last, "point");
        if step_button(ui, "×", "Remove point", last > 0).clicked() {
            remove_point(&mut transfer.opacity, index);
        }
    });
}

/// Numbers of the selected bell.
fn bell_ui(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    transfer: &mut TransferFunction,
    gaussians: &mut Vec<Gaussian>,
    statistics: &Statistics,
) {
    let chosen = &mut editor.bells.selected;
    *chosen = (*chosen).min(gaussians.len() - 1);
    let (index, mut bell) = (*chosen, gaussians[*chosen]);
    row_ui(ui, "Gaussian", |ui| {
        value_ui(ui, "Gaussian centre", &mut bell.centre, statistics)
            .on_hover_text("The value of its peak, in the data's own units");
        opacity_ui(ui, "Gaussian height", &mut bell.height)
            .on_hover_text("Opacity at the peak, 0 to 1");
        steps_ui(ui, chosen, gaussians.len() - 1, "Gaussian");
    });
    let mut removed = false;
    row_ui(ui, "Width", |ui| {
        value_ui(ui, "Gaussian width", &mut bell.width, statistics).on_hover_text(
            "Standard deviation: at this distance from the peak it has 61 % of its height",
        );
        let shown = editor.graph.range(statistics, transfer.colour.range());
        if ui.button("Add").on_hover_text("Another Gaussian, in the middle of the graph").clicked()
        {
            let first = bells::first_bell(transfer, shown);
            let narrow = Gaussian { width: first.width / 2.0, ..first };
            if bells::add_bell(transfer, gaussians, narrow) {
                editor.bells.selected = gaussians.len() - 1;
            }
        }
        removed = step_button(ui, "×", "Remove Gaussian", gaussians.len() > 1).clicked();
    });
    if removed {
        bells::remove_bell(transfer, gaussians, index);
    } else if bell != gaussians[index] {
        bells::change_bell(transfer, gaussians, index, bell);
    }
}

pub(super) fn step_button(ui: &mut Ui, symbol: &str, name: &str, enabled: bool) -> Response {
    ui.add_enabled(enabled, Button::new(symbol).small()).accessible_name(name).on_hover_text(name)
}

/// Buttons from one of several to that before and to the next.
pub(super) fn steps_ui(ui: &mut Ui, chosen: &mut usize, last: usize, one: &str) {
    ui.spacing_mut().item_spacing.x = 4.0;
    let index = *chosen;
    if step_button(ui, "‹", &format!("Previous {one}"), index > 0).clicked() {
        *chosen -= 1;
    }
    if step_button(ui, "›", &format!("Next {one}"), index < last).clicked() {
        *chosen += 1;
    }
}

/// How far values may lie from 0: as far as numbers of 32 bits go, or as the data do.
fn greatest_value(statistics: &Statistics) -> f64 {
    f64::from(f32::MAX).max(-statistics.min).max(statistics.max)
}

/// A value in the data's own units.
pub(super) fn value_ui(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    statistics: &Statistics,
) -> Response {
    let most = greatest_value(statistics);
    value_within_ui(ui, name, value, -most..=most, statistics)
}

/// The same within a range.
fn value_within_ui(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: RangeInclusive<f64>,
    statistics: &Statistics,
) -> Response {
    let width = statistics.max / 2.0 - statistics.min / 2.0;
    let speed = if width > 0.0 { width / 150.0 } else { 0.01 };
    let drag = typed::number(ui, name, value, range).speed(speed);
    number_ui(ui, name, drag.custom_formatter(|v, _| words::value(v)))
}

/// An opacity, 0 to 1.
pub(super) fn opacity_ui(ui: &mut Ui, name: &str, opacity: &mut f64) -> Response {
    let drag = typed::number(ui, name, opacity, 0.0..=1.0).speed(0.005).max_decimals(4);
    wide_number_ui(ui, name, OPACITY_WIDTH, drag)
}

/// What the graph shows of the values, and how.
fn view_ui(ui: &mut Ui, view: &mut GraphView) {
    row_ui(ui, "Graph", |ui| {
        let label = |extent: Extent| match extent {
            Extent::All => "All values",
            Extent::Colours => "Colour range",
            Extent::Percentiles => "Between percentiles",
        };
        let combo = ComboBox::from_id_salt("graph").selected_text(label(view.extent));
        let shown = combo.show_ui(ui, |ui| {
            for (extent, help) in [
                (Extent::All, "From the least to the greatest value"),
                (Extent::Colours, "Only the values that the colours span"),
                (Extent::Percentiles, "Only what lies between the percentiles chosen below"),
            ] {
                ui.choice_of(&mut view.extent, extent, label(extent)).on_hover_text(help);
            }
        });
        shown.response.accessible_name("Graph").on_hover_text("Which values the graph shows");
        ui.checkbox(&mut view.log, "Log").on_hover_text(
            "Show the histogram on a logarithmic axis, so that rare values are seen",
        );
    });
    row_ui(ui, "Percentiles", |ui| {
        let [low, high] = &mut view.percentiles;
        let number = |ui: &mut Ui, name, percent, range| {
            let drag = typed::number(ui, name, percent, range).speed(0.05).max_decimals(1);
            number_ui(ui, name, drag.suffix(" %"))
        };
        let help =
            "The part of the values that the graph, or Percentiles below, leaves out at either end";
        number(ui, "Low percentile", low, 0.0..=49.0).on_hover_text(help);
        name_ui(ui, "to");
        number(ui, "High percentile", high, 51.0..=100.0).on_hover_text(help);
    });
}

/// Opacity and colour of NaN.
fn no_data_ui(ui: &mut Ui, no_data: &mut NoData) {
    row_ui(ui, "No data", |ui| {
        opacity_ui(ui, "Opacity of NaN", &mut no_data.opacity).on_hover_text(
            "Opacity where the file has no value (NaN), 0 to 1. At 0 nothing is drawn there; above, each \
             such voxel is a box of its own size",
        );
        let colour = &mut no_data.colour.0;
        ui.color_edit_button_srgb(colour)
            .accessible_name("Colour of NaN")
            .on_hover_text("Its colour; no light falls on it");
    });
}

fn range_ui(ui: &mut Ui, transfer: &mut TransferFunction, statistics: &Statistics) {
    let mut range = transfer.colour.range();
    let help = "The values that take the first and the last colour; the opacities stay. Rescale to and Window and level \
                move these along";
    row_ui(ui, "Range", |ui| {
        let [low, high] = &mut range;
        let low = value_ui(ui, "Range low", low, statistics).on_hover_text(help);
        name_ui(ui, "to");
        let high = value_ui(ui, "Range high", high, statistics).on_hover_text(help);
        if low.changed() || high.changed() {
            match range[0] == range[1] && statistics.min < statistics.max {
                true => typed::say(ui.ctx(), "A range has two ends that differ: nothing changed"),
                false => stretch_colours(transfer, range),
            }
        }
    });
    let [first, last] = transfer.colour.range();
    if first > last {
        note_ui(ui, "Reversed: the first colour belongs to the greater value");
    }
}

/// Colours and opacities over a range of the data at once.
fn stretch_ui(
    ui: &mut Ui,
    view: &GraphView,
    transfer: &mut TransferFunction,
    gaussians: &mut [Gaussian],
    statistics: &Statistics,
) {
    row_ui(ui, "Rescale to", |ui| {
        let help = "Stretch colours and opacities over all values, from the least to the greatest";
        if ui.button("Full range").on_hover_text(help).clicked() {
            stretch(transfer, gaussians, presets::range(statistics, RangeRule::MinMax));
        }
        let [low, high] = view.percentile_range(statistics);
        let help = "Stretch colours and opacities between the percentiles above, so that a few \
                    outliers do not spoil the rest";
        let button = ui.add_enabled(low < high, Button::new("Percentiles")).on_hover_text(help);
        if button.on_disabled_hover_text("Both percentiles are one value here").clicked() {
            stretch(transfer, gaussians, [low, high]);
        }
    });
}

/// To and from the clipboard and files; what was chosen.
fn exchange_ui(ui: &mut Ui) -> Option<Action> {
    let mut chosen = None;
    row_ui(ui, "Copy, save", |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.spacing_mut().button_padding.x = 6.0;
        for (label, action) in [
            ("Copy", Action::CopyTransfer),
            ("Paste", Action::PasteTransfer),
            ("Load…", Action::LoadTransfer),
            ("Save…", Action::SaveTransfer),
        ] {
            let entry = entry_of(action);
            let button = ui.button(label).accessible_name(entry.name);
            if button.on_hover_text(entry.help).clicked() {
                chosen = Some(action);
            }
        }
    });
    chosen
}
