//! The window's part in effects: which run, what asked for them, and what finished pictures with and
//! without them took.

use std::collections::VecDeque;
use std::sync::Arc;

use eframe::egui::Context;

use super::actions::{Action, entry_of};
use super::drawer::Drawer;
use super::panels::effects::{Change, Cost, Row, Run, Time, effects_ui};
use super::window::Window;
use crate::scene::{AlongRay, Clip, Effect, Scene, Shading};
use crate::task::engine::{Picture, SecondPicture, SecondRequest};

/// Finished pictures that are remembered, and changes.
const MOST_REMEMBERED: usize = 24;
/// A picture that a shader was made for is drawn once more, and then taken as it is.
const MOST_TRIES: u32 = 2;

/// The panel, and what finished pictures of one volume took.
#[derive(Debug, Default)]
pub struct Effects {
    /// Whether the panel is shown.
    pub open: bool,
    finished: VecDeque<Finished>,
    left_out: VecDeque<LeftOut>,
    asked: Option<Asked>,
}

#[derive(Debug)]
struct Finished {
    scene: Scene,
    size: [u32; 2],
    ms: f64,
}

/// How far a scene's picture is from that of the scene without an effect.
#[derive(Debug)]
struct LeftOut {
    scene: Scene,
    other: Scene,
    size: [u32; 2],
    rmse: Option<f64>,
}

/// A picture that is drawn to be measured.
#[derive(Debug)]
struct Asked {
    scene: Scene,
    /// What is drawn: it without an effect, or as it is.
    other: Scene,
    first: Arc<Picture>,
    tries: u32,
}

impl Effects {
    /// Takes in what the `full` picture of a scene took.
    pub fn note(&mut self, scene: &Scene, size: [u32; 2], ms: f64) {
        self.finished.retain(|one| {
            Arc::ptr_eq(&one.scene.volume, &scene.volume)
                && !(one.size == size && one.scene.makes_same_picture(scene))
        });
        self.finished.push_front(Finished { scene: scene.clone(), size, ms });
        self.finished.truncate(MOST_REMEMBERED);
    }

    fn ms_of(&self, scene: &Scene, size: [u32; 2]) -> Option<f64> {
        let same = |one: &&Finished| one.size == size && one.scene.makes_same_picture(scene);
        self.finished.iter().find(same).map(|one| one.ms)
    }

    /// What the scene's picture took, and what it took without a part of what it asks for.
    pub fn cost(&self, scene: &Scene, size: [u32; 2], effect: Effect) -> Option<Cost> {
        let other = effect.left_out_of(scene)?;
        let [with_ms, without_ms] = [self.ms_of(scene, size)?, self.ms_of(&other, size)?];
        Some(Cost { with_ms, without_ms })
    }

    /// How far the picture without an effect is from the scene's, where that was measured.
    fn change(&self, scene: &Scene, size: [u32; 2], effect: Effect) -> Option<Option<f64>> {
        let other = effect.left_out_of(scene)?;
        let same = |one: &&LeftOut| {
            one.size == size
                && one.other.makes_same_picture(&other)
                && one.scene.makes_same_picture(scene)
        };
        self.left_out.iter().find(same).map(|one| one.rmse)
    }

    /// Whether a picture that came was asked for by this, and what it says.
    pub(super) fn accept(&mut self, drawer: &dyn Drawer, drawn: &SecondPicture) -> bool {
        let is_it = |asked: &mut Asked| Arc::ptr_eq(&asked.first, &drawn.first);
        let Some(asked) = self.asked.take_if(is_it) else { return false };
        if drawn.picture.report.made_pipelines && asked.tries < MOST_TRIES {
            self.ask(drawer, Asked { tries: asked.tries + 1, ..asked });
            return true;
        }
        let Asked { scene, other, first, .. } = asked;
        let size = first.requested_size;
        self.note(&other, size, drawn.picture.report.frame_ms);
        if !other.makes_same_picture(&scene) {
            self.left_out.push_front(LeftOut { scene, other, size, rmse: drawn.rmse });
            self.left_out.truncate(MOST_REMEMBERED);
        }
        true
    }

    /// Has one picture after the other drawn without an effect that runs, while the panel is open and
    /// `first` stands finished; `None` while there is none such, or it is compared with another mode.
    pub(super) fn pace(
        &mut self,
        drawer: &dyn Drawer,
        scene: &Scene,
        first: Option<&Arc<Picture>>,
    ) {
        let Some(first) = first.filter(|_| self.open) else {
            if self.asked.take().is_some() {
                drawer.request_second(None);
            }
            return;
        };
        if self.asked.as_ref().is_some_and(|asked| Arc::ptr_eq(&asked.first, first)) {
            return;
        }
        if let Some(other) = self.next(scene, first) {
            let (scene, first) = (scene.clone(), Arc::clone(first));
            self.ask(drawer, Asked { scene, other, first, tries: 1 });
        }
    }

    fn ask(&mut self, drawer: &dyn Drawer, asked: Asked) {
        drawer.request_second(Some(SecondRequest {
            scene: asked.other.clone(),
            size: asked.first.requested_size,
            first: Arc::clone(&asked.first),
        }));
        self.asked = Some(asked);
    }

    /// Whether a picture is drawn to be measured.
    pub(super) fn is_measuring(&self) -> bool {
        self.asked.is_some()
    }

    /// What is to be drawn for what is not known yet of the scene's picture: its own time first.
    fn next(&self, scene: &Scene, first: &Picture) -> Option<Scene> {
        let size = first.requested_size;
        let is_shown = |effect: &Effect| match effect {
            Effect::Shading => !scene.shading.is_plain() && !first.report.effects.is_empty(),
            effect => first.report.effects.contains(&effect.name()),
        };
        let is_unknown = |effect: &Effect| self.change(scene, size, *effect).is_none();
        let mut left = Effect::ALL.iter().filter(|e| is_shown(e)).filter(|e| is_unknown(e));
        let other = left.find_map(|effect| effect.left_out_of(scene))?;
        match self.ms_of(scene, size) {
            None => Some(scene.clone()),
            Some(_) => Some(other),
        }
    }
}

impl Window {
    /// Takes in a picture that has come, as the scene stands before this pass changes it.
    pub(super) fn note_effects(&mut self, picture: &Picture) {
        let Some(scene) = &self.scene else { return };
        let shows_all = picture.report.effects == scene.effects();
        // Shaders that were made meanwhile are no cost of the effect's.
        let is_full = picture.report.rung == "full"
            && !picture.report.made_pipelines
            && !self.pacing.is_moving();
        if shows_all && is_full && picture.requested_size == self.viewport_size {
            self.effects.note(scene, self.viewport_size, picture.report.frame_ms);
        }
    }

    /// Switches the lights on or off, and says so where that cannot be seen.
    pub(super) fn toggle_lights(&mut self) {
        let Some(scene) = &mut self.scene else { return };
        self.shading.toggle_lights(&mut scene.shading);
        if scene.shading.lighting.is_some() && !Shading::is_shown_by(&scene.splat) {
            self.notices.hint(
                "This mode is drawn as triangles, which show no lights: tiles do (see Splats)",
            );
        }
    }

    /// The panel over the viewport.
    pub(super) fn effects_panel_ui(&mut self, ctx: &Context) {
        if self.effects.open {
            let rows = self.effect_rows(ctx);
            let held = self.viewport.picture().and_then(|picture| picture.report.held);
            self.effects.open = effects_ui(ctx, &rows, held.map(|held| held.all));
        }
    }

    fn effect_rows(&self, ctx: &Context) -> Vec<Row> {
        let Some(scene) = &self.scene else { return Vec::new() };
        let picture = self.viewport.picture();
        let report = picture.as_ref().map(|picture| &picture.report);
        let shown = report.map_or(&[][..], |report| &report.effects);
        let asked = scene.effects();
        let run = |name: &str| match (asked.contains(&name), shown.contains(&name)) {
            (false, _) => Run::Off,
            (true, true) => Run::On,
            (true, false) => Run::NotShown,
        };
        let size = self.viewport_size;
        let added = |effect: Effect| {
            self.effects.cost(scene, size, effect).map_or(Time::Unknown, Time::Added)
        };
        let change = |effect: Effect| match self.effects.change(scene, size, effect) {
            None => Change::Unknown,
            Some(rmse) => Change::of(rmse),
        };
        let part = |name: &'static str, help, why: String| {
            let effect = Effect::ALL.iter().copied().find(|effect| effect.name() == name);
            Row {
                name: label_of(name),
                help,
                run: run(name),
                why,
                time: effect.map_or(Time::Unknown, added),
                change: effect.map_or(Change::Unknown, change),
                bytes: None,
            }
        };
        let Shading { opacity, modulation, reflection, emission, lighting, regions } =
            &scene.shading;
        let by = |index: Option<crate::scene::Index>| match index {
            Some(index) => format!("Shading, by {}", index.name().replace('-', " ")),
            None => "Shading in the side panel".to_owned(),
        };
        let lights = match lighting {
            Some(lighting) if lighting.lights.len() == 1 => "Shading, 1 light".to_owned(),
            Some(lighting) => format!("Shading, {} lights", lighting.lights.len()),
            None => format!("Shading in the side panel, {}", key(ctx, Action::ToggleLights)),
        };
        let shaded = scene.shading.effects();
        let any = if shaded.is_empty() { Run::Off } else { all_of(&shaded, shown) };
        let mut rows = vec![
            Row {
                name: "All shading",
                help: "The parts below together: they share one buffer",
                run: any,
                why: if shaded.is_empty() { "Nobody" } else { "What runs below" }.to_owned(),
                time: added(Effect::Shading),
                change: change(Effect::Shading),
                bytes: report.and_then(|report| report.held).map(|held| held.shading),
            },
            part(
                "gradients",
                "How values change about each point: found while drawing, and kept nowhere",
                gradient_words(&scene.shading),
            ),
            part("lights", "Surfaces lit from somewhere", lights),
            part(
                "regions",
                "Opacities and colours by value and gradient strength together",
                match regions.len() {
                    0 => "Transfer function, By gradient".to_owned(),
                    count => format!("Transfer function, {count} of them"),
                },
            ),
            part(
                "opacity table",
                "Opacities looked up by something else than the value",
                by(opacity.as_ref().map(|table| table.index)),
            ),
            part(
                "modulation table",
                "What opacities are multiplied by",
                by(modulation.as_ref().map(|table| table.index)),
            ),
            part(
                "reflection table",
                "Colours looked up by something else than the value",
                by(reflection.as_ref().map(|table| table.index)),
            ),
            part(
                "emission table",
                "Light that matter gives off by itself",
                by(emission.as_ref().map(|table| table.index)),
            ),
        ];
        let bytes = report.and_then(|report| report.held).map(|held| held.inside);
        let clip =
            part("clip", "Parts of the volume that are cut away", clip_words(&scene.inside.clip));
        rows.push(Row { bytes, ..clip });
        rows.push(part(
            "projection",
            "The greatest, least or mean value of each ray in place of its light",
            match scene.inside.along {
                AlongRay::Composite => "Inside in the side panel".to_owned(),
                along => format!("Inside, {}", along.name()),
            },
        ));
        let listed = |count: usize| match count {
            0 => "Inside in the side panel".to_owned(),
            count => format!("Inside, {count} of them"),
        };
        rows.push(part(
            "isosurfaces",
            "Surfaces where the values pass a level, lit",
            listed(scene.inside.isosurfaces.len()),
        ));
        rows.push(part(
            "slices",
            "Planes that show the values on them",
            listed(scene.inside.slices.len()),
        ));
        let vectors = part(
            "vectors",
            "A splat for each vector, with marks that move along the flow",
            match &scene.vectors {
                None => "Vectors in the side panel".to_owned(),
                Some(layer) => format!("Vectors, {}", layer.field.name),
            },
        );
        let bytes = report.and_then(|report| report.held).map(|held| held.vectors);
        rows.push(Row { bytes, ..vectors });
        rows.push(part(
            "second vectors",
            "Those of another field among them, with a look of their own",
            match scene.vectors.as_ref().and_then(|layer| layer.second.as_ref()) {
                None => "Vectors in the side panel".to_owned(),
                Some(second) => format!("Vectors, {}", second.field.name),
            },
        ));
        let polygons = part(
            "polygons",
            "Triangles of files, lit, among all else that is seen",
            match scene.polygons.len() {
                0 => "Polygons in the side panel".to_owned(),
                count => format!("Polygons, {count} of them"),
            },
        );
        let bytes = report.and_then(|report| report.held).map(|held| held.polygons);
        rows.push(Row { bytes, ..polygons });
        rows.extend(self.other_rows(ctx));
        rows
    }

    /// What is beside the picture, or follows it.
    fn other_rows(&self, ctx: &Context) -> [Row; 5] {
        let on = |on: bool, shows: bool| match (on, shows) {
            (false, _) => Run::Off,
            (true, true) => Run::On,
            (true, false) => Run::NotShown,
        };
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
                on(self.cells.on, cells),
                format!("View in the side panel, {}", key(ctx, Action::ToggleCells)),
                Time::Unknown,
            ),
            row(
                "Second picture",
                "The view in another mode, drawn once the first is finished",
                on(self.compare.on, second.is_some()),
                format!("Comparison, {}", key(ctx, Action::ToggleCompare)),
                second_ms.map_or(Time::Unknown, Time::Own),
            ),
            row(
                "Convergence",
                "Slabs doubled after the full picture, until nothing changes",
                on(refined.is_some(), refines),
                format!("Refine until converged, {}", key(ctx, Action::Converge)),
                Time::Unknown,
            ),
            row(
                "Fading",
                "A picture gives way to the next within a sixth of a second",
                on(self.settings.fade, fades),
                "Fade between pictures, in View".to_owned(),
                Time::Unknown,
            ),
            row(
                "Measuring modes",
                "Time and error of other modes, while nothing moves",
                on(self.accuracy.open, self.measuring.is_running()),
                format!("Accuracy panel, {}", key(ctx, Action::ToggleAccuracy)),
                Time::Unknown,
            ),
        ]
    }
}

/// What runs of several.
fn all_of(asked: &[&str], shown: &[&str]) -> Run {
    match asked.iter().all(|name| shown.contains(name)) {
        true => Run::On,
        false => Run::NotShown,
    }
}

/// What asks for gradients.
fn gradient_words(shading: &Shading) -> String {
    let mut askers = Vec::new();
    if shading.lighting.as_ref().is_some_and(crate::scene::Lighting::uses_lights) {
        askers.push("lights");
    }
    if !shading.painted().is_empty() {
        askers.push("regions");
    }
    let Shading { opacity, modulation, reflection, emission, .. } = shading;
    let amounts = [("opacity", opacity), ("modulation", modulation)];
    let colours = [("reflection", reflection), ("emission", emission)];
    let amounts = amounts.map(|(name, t)| (name, t.as_ref().map(|t| t.index)));
    let colours = colours.map(|(name, t)| (name, t.as_ref().map(|t| t.index)));
    for (name, index) in amounts.into_iter().chain(colours) {
        if index.is_some_and(crate::scene::Index::is_of_gradient) {
            askers.push(name);
        }
    }
    match askers.is_empty() {
        true => "Nobody".to_owned(),
        false => askers.join(", "),
    }
}

/// What cuts.
fn clip_words(clip: &Clip) -> String {
    let planes = match clip.planes.len() {
        0 => None,
        1 => Some("1 plane".to_owned()),
        n => Some(format!("{n} planes")),
    };
    let parts: Vec<String> =
        clip.bounds.map(|_| "a box".to_owned()).into_iter().chain(planes).collect();
    match parts.is_empty() {
        true => "Clip in the side panel".to_owned(),
        false => format!("Clip, {}", parts.join(" and ")),
    }
}

/// An effect's name as a label.
fn label_of(name: &str) -> &'static str {
    match name {
        "gradients" => "Gradients",
        "lights" => "Lights",
        "regions" => "Regions by gradient",
        "opacity table" => "Opacity table",
        "modulation table" => "Modulation table",
        "reflection table" => "Reflection table",
        "clip" => "Clip",
        "projection" => "Projection",
        "isosurfaces" => "Isosurfaces",
        "slices" => "Slices",
        "vectors" => "Vectors",
        "second vectors" => "Second vectors",
        "polygons" => "Polygons",
        _ => "Emission table",
    }
}

fn key(ctx: &Context, action: Action) -> String {
    let shortcut = entry_of(action).shortcut;
    shortcut.map_or_else(String::new, |key| format!("key {}", ctx.format_shortcut(&key)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Amounts, Index, Lighting};
    use crate::volume::{Lattice, Samples, ScalarVolume};

    #[test]
    fn a_cost_is_of_two_pictures_that_differ_in_one_effect_alone() {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let plain = crate::scene::opening(Arc::new(volume), None);
        let table = || Some(Amounts { index: Index::Value, points: vec![(0.0, 0.5)] });
        let both = Scene {
            shading: Shading {
                lighting: Some(Lighting::default()),
                modulation: table(),
                ..Shading::default()
            },
            ..plain.clone()
        };
        let lit = Scene {
            shading: Shading { modulation: None, ..both.shading.clone() },
            ..plain.clone()
        };
        let size = [10, 10];
        let mut effects = Effects::default();
        effects.note(&plain, size, 10.0);
        effects.note(&both, size, 40.0);
        let without_table = Effect::ModulationTable;
        assert_eq!(effects.cost(&both, size, without_table), None, "nobody drew that");
        let whole = effects.cost(&both, size, Effect::Shading);
        assert_eq!(whole, Some(Cost { with_ms: 40.0, without_ms: 10.0 }));
        effects.note(&lit, size, 25.0);
        let table = effects.cost(&both, size, without_table);
        assert_eq!(table, Some(Cost { with_ms: 40.0, without_ms: 25.0 }));
        assert_eq!(effects.cost(&both, [10, 11], without_table), None, "of another size");
        let turned = Scene { camera: both.camera.orbited(0.1, 0.0), ..both.clone() };
        assert_eq!(effects.cost(&turned, size, without_table), None, "of another view");
        assert_eq!(effects.cost(&lit, size, without_table), None, "it is not there");
        effects.note(&both, size, 44.0);
        assert_eq!(effects.cost(&both, size, without_table).map(|c| c.with_ms), Some(44.0));
    }

    #[test]
    fn gradients_are_asked_for_by_what_needs_them() {
        let amounts = |index| Some(Amounts { index, points: vec![(0.0, 0.5)] });
        let mut shading = Shading { modulation: amounts(Index::ViewDepth), ..Shading::default() };
        assert_eq!(gradient_words(&shading), "Nobody");
        shading.opacity = amounts(Index::GradientElevation);
        shading.lighting = Some(Lighting::default());
        assert_eq!(gradient_words(&shading), "lights, opacity");
    }
}
