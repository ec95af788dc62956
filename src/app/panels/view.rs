//! How the view is drawn: background, projection, and what moving may cost.

use eframe::egui::{CollapsingHeader, ComboBox, IntoAtoms, Label, RichText, Ui};

use super::lists::ListUi;
use super::{row_ui, slider_ui, switch_ui, typed};
use crate::app::actions::{Action, entry_of};
use crate::app::annotations::switches_ui;
use crate::app::camera_control::Turning;
use crate::app::cells::{CellsOverlay, OCTREE_ERROR};
use crate::app::document::Document;
use crate::app::modes;
use crate::app::settings::{
    BUDGET_MS, BudgetPreset, LADDERS, Settings, VIEW_ANGLE_DEG, ladder_label,
};
use crate::app::theme;
use crate::core::{Projection, Srgb8};
use crate::scene::{Annotation, Moving, Orientation, Scene, UpAxis};
use crate::task::cuts::why_no_cut_of;

/// Background, projection, frame budget, the switches of refinement, and what lies over the picture.
/// `told` is which way round the file's volume is. `left_out`: annotations that the view has no room for.
pub fn view_ui(
    ui: &mut Ui,
    (scene, told): (&mut Scene, Told),
    settings: &mut Settings,
    cells: &mut CellsOverlay,
    left_out: &[Annotation],
) {
    row_ui(ui, "Background", |ui| background_ui(ui, settings));
    projection_ui(ui, scene, settings);
    up_ui(ui, scene, told);
    turning_ui(ui, scene, told, settings);
    row_ui(ui, "Annotations", |ui| switches_ui(ui, &mut settings.annotations, left_out));
    refinement_ui(ui, settings);
    let title = RichText::new("Advanced refinement").size(12.5).color(theme::TEXT_FAINT);
    CollapsingHeader::new(title).default_open(false).show_unindented(ui, |ui| {
        moving_ui(ui, scene);
        steps_ui(ui, settings);
    });
    // The octree is of samples, and would be taken for the cells of a mesh.
    if cells.on || !modes::is_of_cells_or_points(&scene.splat) {
        cells_ui(ui, cells);
    }
}

fn cells_ui(ui: &mut Ui, cells: &mut CellsOverlay) {
    let key = entry_of(Action::ToggleCells).shortcut;
    let key = key.map_or_else(String::new, |key| ui.ctx().format_shortcut(&key));
    ui.checkbox(&mut cells.on, "Show octree cells").on_hover_text(format!(
        "Where the octree is fine and where coarse, coloured by level: for the picture while it moves, \
         where that is an octree cut, and for the error chosen here at rest. Rest on a cell to see why \
         it is not split (key {key})"
    ));
    if cells.on {
        row_ui(ui, "Octree error", |ui| {
            let error = typed::slider(ui, "Octree error", &mut cells.max_error, OCTREE_ERROR)
                .logarithmic(true);
            slider_ui(ui, "Octree error", true, error.max_decimals(3)).on_hover_text(
                "Nodes with less error than this are not split: the less of it, the more cells. It \
                 changes the cells that are shown at rest, and no picture",
            );
        });
    }
}

fn background_ui(ui: &mut Ui, settings: &mut Settings) {
    ui.add_enabled_ui(!settings.transparent_background, |ui| {
        let Srgb8(mut colour) = settings.background;
        ui.color_edit_button_srgb(&mut colour)
            .accessible_name("Background colour")
            .on_hover_text("The colour behind the volume");
        settings.background = Srgb8(colour);
    });
    ui.checkbox(&mut settings.transparent_background, "Transparent")
        .on_hover_text("Nothing behind the volume: saved pictures keep their transparency");
}

fn projection_ui(ui: &mut Ui, scene: &mut Scene, settings: &mut Settings) {
    let mut perspective = matches!(scene.camera.projection, Projection::Perspective { .. });
    row_ui(ui, "Projection", |ui| {
        ui.selectable_value(&mut perspective, false, "Orthographic")
            .on_hover_text("Parallel rays: lengths can be compared, and splats are exact (key 5)");
        ui.selectable_value(&mut perspective, true, "Perspective")
            .on_hover_text("What is near looks larger (key 5)");
    });
    row_ui(ui, "View angle", |ui| {
        let angle = typed::slider(ui, "View angle", &mut settings.view_angle_deg, VIEW_ANGLE_DEG);
        slider_ui(ui, "View angle", perspective, angle.suffix("°").fixed_decimals(0))
            .on_hover_text("How much the eye takes in from top to bottom: wider is more dramatic")
            .on_disabled_hover_text("Only a perspective view has an angle");
    });
    scene.camera.projection = if perspective {
        Projection::Perspective { view_angle: settings.view_angle_deg.to_radians() }
    } else {
        Projection::Orthographic
    };
}

/// Which axis of the world points up.
fn up_ui(ui: &mut Ui, scene: &mut Scene, told: Told) {
    row_ui(ui, "Up", |ui| {
        let shown = up_name(scene.up, told);
        let combo = ComboBox::from_id_salt("up axis").selected_text(shown);
        let combo = combo.show_ui(ui, |ui| up_choices_ui(ui, scene, told));
        combo.response.accessible_name("Up axis").on_hover_text(UP);
    });
}

/// What it is for.
const UP: &str = "The axis of the world that points up: views that have names, and turning by hand, go by it. It stays \
                  chosen for files opened after this one";

/// Which way round a file's volume is, and who says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Told {
    /// As it was first seen.
    pub orientation: Orientation,
    /// Whether the file says so.
    pub is_by_file: bool,
}

impl Told {
    /// Of an open file.
    pub fn of(document: &Document) -> Self {
        let orientation = document.first_look.orientation;
        Self { orientation, is_by_file: document.grid.space.is_some() }
    }

    /// Whether what is seen says so.
    pub fn is_by_shape(self) -> bool {
        !self.is_by_file && self.orientation != Orientation::default()
    }
}

/// What a choice of it is called.
fn up_name(chosen: Option<UpAxis>, told: Told) -> String {
    let name = |up: UpAxis| up.name().replace('-', "−");
    let first = || {
        let by = match told.is_by_file {
            true => "As in the file",
            false if told.is_by_shape() => "By its shape",
            false => "Not stated",
        };
        format!("{by} ({})", name(told.orientation.up))
    };
    chosen.map_or_else(first, name)
}

/// The same as a part of a menu.
pub fn up_menu_ui<'a>(ui: &mut Ui, name: impl IntoAtoms<'a>, scene: &mut Scene, told: Told) {
    let menu = ui.menu_button(name, |ui| up_choices_ui(ui, scene, told));
    menu.response.on_hover_text(UP);
}

/// All that can be chosen; what is seen keeps its place in the picture.
fn up_choices_ui(ui: &mut Ui, scene: &mut Scene, told: Told) {
    let mut chosen = scene.up;
    for choice in std::iter::once(None).chain(UpAxis::ALL.map(Some)) {
        ui.choice_of(&mut chosen, choice, up_name(choice, told));
    }
    if chosen != scene.up {
        let own = told.orientation;
        let (before, after) = (own.with_up(scene.up), own.with_up(chosen));
        scene.up = chosen;
        scene.camera = after.turned_from(before, &scene.camera);
    }
}

/// How a drag turns the view.
fn turning_ui(ui: &mut Ui, scene: &mut Scene, told: Told, settings: &mut Settings) {
    row_ui(ui, "Turning", |ui| {
        let before = settings.turning;
        ui.selectable_value(&mut settings.turning, Turning::Turntable, "Turntable").on_hover_text(
            "A drag turns the volume about the axis that is up, and tilts it: what is up stays up",
        );
        ui.selectable_value(&mut settings.turning, Turning::Trackball, "Trackball")
            .on_hover_text("A drag turns the volume as a ball under the hand, any way round");
        if before != settings.turning && settings.turning == Turning::Turntable {
            let up = told.orientation.with_up(scene.up).up;
            scene.camera = scene.camera.leveled(up.vector());
        }
    });
}

/// What a preset is called, and what it means, one line.
fn preset_words(preset: BudgetPreset) -> (&'static str, &'static str) {
    match preset {
        BudgetPreset::Interactive => {
            ("Interactive (25 ms)", "Follows the hand closely, at the price of detail")
        }
        BudgetPreset::FifthOfASecond => (
            "A fifth of a second",
            "What can be drawn five times a second: more detail, and the hand waits a little",
        ),
        BudgetPreset::FiveSeconds => (
            "5 seconds",
            "A fifth of a second while the hand moves, and what five seconds allow whenever it pauses",
        ),
        BudgetPreset::Full => (
            "Full",
            "Up to full quality whenever the hand pauses; while it moves on, quick pictures",
        ),
    }
}

/// What a choice of what is drawn while the view moves is called, and what it means.
fn moving_words(moving: Moving) -> (&'static str, &'static str) {
    match moving {
        Moving::Octree => (
            "Octree cut",
            "The field itself, but bricks that look alike are drawn from means of 2³ or 4³ samples, in slabs as thick as \
             these: the time saved goes to more pixels. The octree cells (key G) show which",
        ),
        Moving::Subsampled => (
            "Fewer pixels",
            "All samples of the field, in as many pixels as the time allows, enlarged: blurred, and nothing else",
        ),
        Moving::Auto => (
            "Whichever is nearer",
            "A cut of the octree or fewer pixels, whichever is thought to lose less for the time that a picture may \
             take: mostly the cut",
        ),
    }
}

/// What is drawn while the view moves.
fn moving_ui(ui: &mut Ui, scene: &mut Scene) {
    let moving = &mut scene.splat.cut.moving;
    row_ui(ui, "Moving picture", |ui| {
        let combo = ComboBox::from_id_salt("moving picture").selected_text(moving_words(*moving).0);
        let shown = combo.show_ui(ui, |ui| {
            for choice in Moving::ALL {
                let (label, help) = moving_words(choice);
                ui.choice_of(moving, choice, label).on_hover_text(help);
            }
        });
        shown.response.accessible_name("Moving picture").on_hover_text(
            "What quick pictures leave out of the field while the view moves: detail where it matters least, or pixels. \
             The finished picture does not depend on it",
        );
    });
    if *moving == Moving::Octree
        && let Some(why) = why_no_cut_of(scene)
    {
        let told = RichText::new(format!("Fewer pixels here: {why}")).size(12.0);
        row_ui(ui, "", |ui| ui.add(Label::new(told.color(theme::TEXT_FAINT)).wrap()));
    }
}

/// What pictures may cost while the view moves, and how far they go at rest.
fn refinement_ui(ui: &mut Ui, settings: &mut Settings) {
    row_ui(ui, "While moving", |ui| {
        let preset = settings.preset();
        let label = preset.map_or("Custom", |preset| preset_words(preset).0);
        let combo = ComboBox::from_id_salt("budget preset").selected_text(label);
        let mut chosen = preset;
        let shown = combo.show_ui(ui, |ui| {
            for preset in BudgetPreset::ALL {
                let (label, help) = preset_words(preset);
                ui.choice_of(&mut chosen, Some(preset), label).on_hover_text(help);
            }
        });
        shown
            .response
            .accessible_name("While moving")
            .on_hover_text("How long a picture may take while the view moves");
        if let Some(chosen) = chosen.filter(|_| chosen != preset) {
            settings.set_preset(chosen);
        }
    });
    row_ui(ui, "Frame budget", |ui| {
        let enabled = !settings.full_quality_while_moving;
        let read = typed::parser(ui, "Frame budget", settings.budget_ms, &BUDGET_MS, milliseconds);
        let budget = typed::slider(ui, "Frame budget", &mut settings.budget_ms, BUDGET_MS);
        let budget = budget.logarithmic(true).suffix(" ms").fixed_decimals(0).custom_parser(read);
        slider_ui(ui, "Frame budget", enabled, budget)
            .on_hover_text(
                "What a picture may cost while the view moves: more time shows finer detail, \
                 less time follows the hand more closely. What goes beyond a fifth of a second is \
                 spent whenever the hand pauses",
            )
            .on_disabled_hover_text("Full quality takes the time it needs");
    });
    switch_ui(ui, &mut settings.converge, "Go on refining at rest").on_hover_text(
        "Once the full picture is there, draw it in ever thinner steps along the rays (slabs) until nothing changes any more: at most \
         3 s more work each time the view comes to rest, and none that would take longer; \
         key R refines the view on screen however long that takes",
    );
    switch_ui(ui, &mut settings.smooth_edges, "Smooth edges at rest").on_hover_text(
        "Once the full picture is there, draw it through four more places of each pixel and show the mean, so that isosurfaces, \
         slices, cuts, labels and the borders of meshes end without steps: four times the work again, beside which the view can be \
         turned at once. Other pictures have no such edges, and take no longer. Saved pictures are smoothed, too; saved loops, comparisons \
         and the accuracy panel are not",
    );
    switch_ui(ui, &mut settings.full_quality_while_moving, "Full quality while moving")
        .on_hover_text(
            "Draw each view up to full quality, by the same steps as at rest, even with the button held: a hand \
             that moves on sees the quick pictures that they begin with",
        );
}

/// How pictures follow each other at rest.
fn steps_ui(ui: &mut Ui, settings: &mut Settings) {
    row_ui(ui, "Coarse first", |ui| {
        let combo = ComboBox::from_id_salt("ladder").selected_text(ladder_label(settings.ladder));
        let shown = combo.show_ui(ui, |ui| {
            for (ladder, label, help) in LADDERS {
                ui.choice_of(&mut settings.ladder, ladder, label).on_hover_text(help);
            }
        });
        shown
            .response
            .accessible_name("Coarse first")
            .on_hover_text("The way from the first coarse picture to the full one, once at rest");
    });
    ui.checkbox(&mut settings.show_partial, "Show partial pictures")
        .on_hover_text("Show a picture while it is still being drawn, or only once it is complete");
    ui.checkbox(&mut settings.fade, "Fade between pictures").on_hover_text(
        "At rest, let a picture give way to a finer one within a sixth of a second rather than at once",
    );
}

/// What is typed for a time: milliseconds, or seconds where it says so.
fn milliseconds(typed: &str) -> Option<f64> {
    let typed = typed.trim();
    let (number, times) = match typed.strip_suffix("ms") {
        Some(number) => (number, 1.0),
        None => typed.strip_suffix('s').map_or((typed, 1.0), |number| (number, 1e3)),
    };
    Some(number.trim().parse::<f64>().ok()? * times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_typed_in_either_unit() {
        let cases =
            [("20", 20.0), (" 3 s", 3000.0), ("0.5s", 500.0), ("57 ms", 57.0), ("1e2", 100.0)];
        for (typed, expected) in cases {
            assert_eq!(milliseconds(typed), Some(expected), "{typed}");
        }
        for typed in ["", "s", "3 m", "ms 3"] {
            assert_eq!(milliseconds(typed), None, "{typed}");
        }
    }
}
