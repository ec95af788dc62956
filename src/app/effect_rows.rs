//! The rows of the effects panel: what runs, what asked for it, and what it was found to cost.

use eframe::egui::Context;

use super::actions::{Action, entry_of};
use super::panels::effects::{Change, Row, Run, Time, effects_ui};
use super::window::Window;
use crate::scene::Effect;

impl Window {
    /// The panel over the viewport.
    pub(super) fn effects_panel_ui(&mut self, ctx: &Context) {
        if self.effects.open {
            let rows = self.effect_rows(ctx);
            let picture = self.viewport.picture();
            let held = picture.as_ref().and_then(|picture| picture.report.held);
            let progress = self.scene.as_ref().zip(picture.as_ref());
            let progress = progress.and_then(|(scene, first)| self.effects.progress(scene, first));
            self.effects.open = effects_ui(ctx, &rows, held.map(|held| held.all), progress);
        }
    }

    fn effect_rows(&self, ctx: &Context) -> Vec<Row> {
        let Some(scene) = &self.scene else { return Vec::new() };
        let picture = self.viewport.picture();
        let shown = picture.as_ref().map_or(&[][..], |picture| &picture.report.effects);
        let (size, costs) = (self.viewport_size, &self.effects);
        let parts = scene.shading.effects();
        let is_one = parts.iter().filter(|part| **part != Effect::Gradients).count() == 1;
        let row = |effect: Effect| {
            let asked_by = effect.asked_by(scene);
            let runs = match effect {
                Effect::Shading => scene.shading.effects().iter().all(|part| shown.contains(part)),
                effect => shown.contains(&effect),
            };
            let About { name, help, place, hint } = about(effect);
            let key = if effect == Effect::Lights {
                key(ctx, Action::ToggleLights)
            } else {
                String::new()
            };
            // Of one effect the sum, and what it needs, are the effect itself.
            let is_told_below = is_one && matches!(effect, Effect::Shading | Effect::Gradients);
            let costs = (!is_told_below).then_some(costs);
            let change = costs.and_then(|costs| costs.change(scene, size, effect));
            Row {
                name,
                help,
                run: Run::of(asked_by.is_some(), runs),
                why: match (asked_by, place) {
                    (None, _) if key.is_empty() => hint.to_owned(),
                    (None, _) => format!("{hint}, {key}"),
                    (Some(words), "") => words,
                    (Some(words), place) => format!("{place}, {words}"),
                },
                time: costs
                    .and_then(|costs| costs.added(scene, size, effect))
                    .map_or(Time::Unknown, Time::Added),
                change: change.map_or(Change::Unknown, Change::of),
                bytes: costs.and_then(|costs| costs.bytes(scene, size, effect)),
            }
        };
        Effect::ALL.iter().copied().map(row).chain(self.other_rows(ctx)).collect()
    }

    /// What is beside the picture, or follows it.
    fn other_rows(&self, ctx: &Context) -> [Row; 5] {
        let row = |name, help, run, why, time| Row {
            name,
            help,
            run,
            why,
            time,
            change: Change::Unknown,
            bytes: None,
        };
        let scene = self.scene.as_ref();
        let cells = scene.is_some_and(|scene| self.cells.shown(scene).is_some());
        let second = self.beside();
        let second_ms = second.as_ref().map(|(second, _)| second.picture.report.frame_ms);
        let refined = self.viewport.picture().and_then(|picture| picture.report.refined);
        let refines = refined.is_some_and(|r| r.convergence.last_difference.is_some());
        let fades = self.viewport.is_fading(ctx.time());
        [
            row(
                "Octree cells",
                "The edges of the octree's cells over the picture",
                Run::of(self.cells.on, cells),
                format!("View in the side panel, {}", key(ctx, Action::ToggleCells)),
                Time::Unknown,
            ),
            row(
                "Second picture",
                "The view in another mode, drawn once the first is finished",
                Run::of(self.compare.on, second.is_some()),
                format!("Comparison, {}", key(ctx, Action::ToggleCompare)),
                second_ms.map_or(Time::Unknown, Time::Own),
            ),
            row(
                "Refining",
                "After the full picture ever thinner steps along the rays (slabs), until nothing changes",
                Run::of(refined.is_some(), refines),
                format!("Go on refining at rest, or {}", key(ctx, Action::Converge)),
                Time::Unknown,
            ),
            row(
                "Fading",
                "A picture gives way to the next within a sixth of a second",
                Run::of(self.settings.fade, fades),
                "Fade between pictures, in View".to_owned(),
                Time::Unknown,
            ),
            row(
                "Measuring modes",
                "Time and error of other modes, while nothing moves",
                Run::of(self.accuracy.open, self.measuring.is_running()),
                format!("Accuracy panel, {}", key(ctx, Action::ToggleAccuracy)),
                Time::Unknown,
            ),
        ]
    }
}

/// What is said of an effect whatever the scene.
struct About {
    name: &'static str,
    help: &'static str,
    /// Where it was asked for; empty where other effects do.
    place: &'static str,
    /// Where it could be.
    hint: &'static str,
}

fn about(effect: Effect) -> About {
    let (name, help, place, hint) = match effect {
        Effect::Shading => (
            "All shading",
            "Lights, regions and lookups by another quantity, together",
            "",
            "Nothing asks for it",
        ),
        Effect::Gradients => (
            "Gradients",
            "How sharply values change at each point, and in which direction: what lights, regions and \
             some lookups need. Found while drawing, and kept nowhere",
            "",
            "Nothing asks for it",
        ),
        Effect::Lights => ("Lights", "Surfaces lit from somewhere", "Shading", IN_SHADING),
        Effect::Regions => (
            "Regions by gradient",
            "Opacities and colours by value and gradient strength together",
            "Transfer function",
            "Transfer function, Boundaries",
        ),
        Effect::OpacityTable => (
            "Opacity lookup",
            "Opacities looked up by another quantity than the value",
            "Shading",
            IN_SHADING,
        ),
        Effect::ModulationTable => (
            "Opacity factor",
            "Modulation: opacities multiplied by a factor",
            "Shading",
            IN_SHADING,
        ),
        Effect::ReflectionTable => (
            "Reflection lookup",
            "Colours looked up by another quantity than the value",
            "Shading",
            IN_SHADING,
        ),
        Effect::EmissionTable => {
            ("Emission", "Light that matter gives off by itself", "Shading", IN_SHADING)
        }
        Effect::Clip => {
            ("Clip", "Parts of the volume that are cut away", "Clip", "Clip in the side panel")
        }
        Effect::Projection => (
            "Rendering",
            "The greatest, least or mean value along each line of sight, rather than the volume",
            "Rendering",
            "Rendering in the side panel",
        ),
        Effect::Isosurfaces => {
            ("Isosurfaces", "Surfaces where the values pass a level, lit", INSIDE, IN_INSIDE)
        }
        Effect::Slices => ("Slices", "Planes that show the values on them", INSIDE, IN_INSIDE),
        Effect::Vectors => (
            "Vectors",
            "A splat for each vector, with marks that move along the flow",
            "Vectors",
            IN_VECTORS,
        ),
        Effect::SecondVectors => (
            "Second vectors",
            "Those of another field among them, with a look of their own",
            "Vectors",
            IN_VECTORS,
        ),
        Effect::Polygons => (
            "Polygons",
            "Triangles of files and surfaces of labels, lit, among all else that is seen",
            "Polygons and labels",
            "Polygons and labels in the side panel",
        ),
    };
    About { name, help, place, hint }
}

const IN_SHADING: &str = "Shading in the side panel";
const INSIDE: &str = "Surfaces and slices";
const IN_INSIDE: &str = "Surfaces and slices in the side panel";
const IN_VECTORS: &str = "Vectors in the side panel";

fn key(ctx: &Context, action: Action) -> String {
    let shortcut = entry_of(action).shortcut;
    shortcut.map_or_else(String::new, |key| format!("key {}", ctx.format_shortcut(&key)))
}
