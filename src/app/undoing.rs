//! Undo and redo in the window: what a state is, what is called what, and when a step ends.
//!
//! Everything that changes the picture, or what lies over it, belongs to a state: which file is open and
//! which of its fields is drawn, the transfer function and how its graph shows it, the mode, the
//! comparison, the background and the other display settings, by what streamlines would be made, and the
//! speed of an animation. What does not: which panels and tools are open, time as it passes, and the list
//! of recent files. The camera has steps of its own (*previous view*), so that whoever has turned the volume since still takes
//! back the last edit; another file, or another axis that is up, brings the camera that belongs to it. Volumes of earlier steps stay in memory for as long as they take little of what is
//! free; else the oldest steps are forgotten, and that is said.

use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

use eframe::egui::{Context, Event};
use glam::DVec3;

use super::compare::{Compare, Display};
use super::document::Document;
use super::flow::FlowChoice;
use super::panels::Sections;
use super::panels::transfer::CurveView;
use super::settings::Settings;
use super::window::Window;
use crate::core::Camera;
use crate::scene::{Sampled, Scene, SplatSettings};
use crate::transfer::{Gaussian, TransferFunction};
use crate::volume::Samples;

/// Seconds within which a second press of the key takes the open file away.
const AGAIN_SECS: f64 = 8.0;
/// Seconds that the key has to rest before a second press counts.
const BURST_SECS: f64 = 0.6;

/// Everything that can be undone, as plain data; the volume is shared.
#[derive(Debug, Clone)]
pub(super) struct State {
    document: Document,
    /// Seen from nowhere in particular.
    scene: Scene,
    /// Where it was seen from last.
    camera: Camera,
    gaussians: Vec<Gaussian>,
    settings: Settings,
    compare: Comparison,
    cells: (bool, f64),
    curve: CurveView,
    flow: FlowChoice,
    /// Cycles a second.
    speed: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Comparison {
    on: bool,
    second: SplatSettings,
    display: Display,
    fits: bool,
    doublings: u32,
    divider: f32,
    edits_second: bool,
}

impl Comparison {
    fn of(compare: &Compare) -> Self {
        let Compare { on, second, display, fits, doublings, divider, edits_second, .. } = *compare;
        Self { on, second, display, fits, doublings, divider, edits_second }
    }

    fn give_to(self, compare: &mut Compare) {
        let Self { on, second, display, fits, doublings, divider, edits_second } = self;
        (compare.on, compare.second, compare.display) = (on, second, display);
        compare.fits = fits;
        (compare.doublings, compare.divider, compare.edits_second) =
            (doublings, divider, edits_second);
    }
}

impl PartialEq for State {
    fn eq(&self, other: &Self) -> bool {
        // Taken apart, so that a new part cannot be forgotten here.
        let Self {
            document,
            scene,
            camera: _,
            gaussians,
            settings,
            compare,
            cells,
            curve,
            flow,
            speed,
        } = self;
        Arc::ptr_eq(&document.volume, &other.document.volume)
            && scene.makes_same_picture(&other.scene)
            && scene.splat == other.scene.splat
            && scene.up == other.scene.up
            && *gaussians == other.gaussians
            && *settings == other.settings
            && *compare == other.compare
            && *cells == other.cells
            && *curve == other.curve
            && *flow == other.flow
            && *speed == other.speed
    }
}

impl State {
    /// What is different after a step, in a few words.
    fn change_to(&self, after: &Self) -> String {
        match self.is_of_another_file(after) {
            true => format!("opening {}", after.document.source.name()),
            false => self.change_within_file(after).to_owned(),
        }
    }

    fn change_within_file(&self, after: &Self) -> &'static str {
        let (a, b) = (&self.scene, &after.scene);
        let of = |scene: &Scene| scene.transfer().cloned();
        let (before, now) = (of(a), of(b));
        let differ = |what: fn(&TransferFunction) -> &Vec<(f64, f64)>| {
            before.as_ref().map(what) != now.as_ref().map(what)
        };
        let opacity = differ(|f| &f.opacity) || self.gaussians != after.gaussians;
        let colour = before.as_ref().map(|f| &f.colour) != now.as_ref().map(|f| &f.colour);
        let no_data = before.as_ref().map(|f| f.no_data) != now.as_ref().map(|f| f.no_data);
        let vectors = a.vectors() != b.vectors() || a.shows_field() != b.shows_field();
        let background = |s: &Settings| (s.background, s.transparent_background);
        match () {
            () if !a.has_same_volume(b) => "another field",
            () if a.shading.regions != b.shading.regions && !opacity && !colour => "regions",
            () if opacity && colour => "transfer function",
            () if no_data => "no data",
            () if opacity => "opacities",
            () if colour => "colours",
            () if vectors => "vectors",
            () if !a.has_same_layers(b) => "polygons",
            () if a.splat.opacity_unit_distance != b.splat.opacity_unit_distance => "unit distance",
            () if a.splat != b.splat => "splat settings",
            () if a.shading != b.shading => "shading",
            () if a.inside.clip != b.inside.clip => "clip",
            () if a.inside.slices != b.inside.slices => "slices",
            () if a.inside.isosurfaces != b.inside.isosurfaces => "isosurfaces",
            () if a.inside.is_faded != b.inside.is_faded => "fading the volume",
            () if a.inside != b.inside => "rendering",
            () if a.up != b.up => "up axis",
            () if self.compare != after.compare => "comparison",
            () if self.cells != after.cells => "octree cells",
            () if self.settings.annotations != after.settings.annotations => "annotations",
            () if background(&self.settings) != background(&after.settings) => "background",
            () if self.curve != after.curve => "graph",
            () if self.flow != after.flow => "streamlines and arrows",
            () if self.speed != after.speed => "speed",
            () => "display settings",
        }
    }

    fn is_of_another_file(&self, other: &Self) -> bool {
        !self.document.is_same_file(&other.document)
    }

    /// The arrays that it holds: where each lies, and its bytes.
    fn arrays(&self) -> impl Iterator<Item = (*const (), usize)> {
        let Document { grid, volume, vectors, .. } = &self.document;
        let samples = |samples: &Arc<Samples>| (Arc::as_ptr(samples).cast(), samples.size_bytes());
        let stored = self.scene.store.samples().filter_map(|samples| match samples {
            Sampled::Vectors(field) => Some(field),
            _ => None,
        });
        let fields = vectors.iter().chain(stored);
        let fields = fields.flat_map(move |field| {
            let vectors = Arc::as_ptr(&field.vectors).cast();
            [(vectors, size_of_val(&*field.vectors)), samples(&field.magnitudes)]
        });
        let scalars = grid.fields.iter().map(|field| &field.samples).chain([&volume.samples]);
        scalars.map(samples).chain(fields)
    }
}

/// Bytes of the arrays that only these states hold, and not the present one.
fn bytes_held_by(past: &VecDeque<State>, present: &State) -> u64 {
    let mut counted: HashSet<_> = present.arrays().map(|(place, _)| place).collect();
    let new = past.iter().flat_map(State::arrays).filter(|(place, _)| counted.insert(*place));
    new.map(|(_, bytes)| bytes as u64).sum()
}

impl Window {
    /// Everything that can be undone, once something is open.
    fn state(&self) -> Option<State> {
        let (document, mut scene) = (self.document.clone()?, self.scene.clone()?);
        // Time passes by itself, and what was made of a state is no part of it.
        scene.phase = 0.0;
        scene.forget_field_values();
        let nowhere = Camera::new(DVec3::ZERO, DVec3::Y, DVec3::Z, 1.0);
        let camera = std::mem::replace(&mut scene.camera, nowhere);
        Some(State {
            document,
            scene,
            camera,
            gaussians: self.gaussians.clone(),
            settings: Settings {
                recent: Vec::new(),
                side_panel: true,
                knows_drag: false,
                sections: Sections::new(),
                ..self.settings.clone()
            },
            compare: Comparison::of(&self.compare),
            cells: (self.cells.on, self.cells.max_error),
            curve: self.transfer.curve_view(),
            flow: self.flow.choice,
            speed: self.vectors.clock.speed(),
        })
    }

    /// Takes note of what has changed, unless something is still being held or typed.
    pub(super) fn record_step(&mut self, ctx: &Context) {
        let is_held = ctx.input(|input| input.pointer.any_down()) || ctx.dragged_id().is_some();
        if !is_held && !ctx.text_edit_focused() {
            self.record_now(ctx);
        }
    }

    /// Takes note of what has changed, be it still in the hand.
    pub(super) fn record_now(&mut self, ctx: &Context) {
        let Some(state) = self.state() else { return };
        let is_wheel = |event: &Event| matches!(event, Event::MouseWheel { .. } | Event::Zoom(_));
        let notch_secs = ctx.input(|i| i.events.iter().any(is_wheel).then_some(i.time));
        if self.history.record(&state, notch_secs) {
            self.limit_memory(&state);
        }
        if let Some(present) = self.history.present_mut() {
            present.camera = state.camera;
        }
        self.views.record(&state.camera, notch_secs);
    }

    /// Another camera for the view that steps go on from.
    pub(super) fn amend_view(&mut self) {
        let camera = self.scene.as_ref().map(|scene| scene.camera);
        if let Some((present, camera)) = self.views.present_mut().zip(camera) {
            *present = camera;
        }
    }

    /// Goes one view back, or forward again.
    pub(super) fn step_view(&mut self, ctx: &Context, back: bool) {
        // What is still in the hand is a step, too.
        self.record_now(ctx);
        let camera = if back { self.views.undo() } else { self.views.redo() };
        match self.scene.as_mut().zip(camera) {
            Some((scene, camera)) => scene.camera = camera,
            None if back => self.notices.hint("There is no earlier view"),
            None => self.notices.hint("There is no later view"),
        }
    }

    /// Forgets the oldest steps where the last one brought another volume and theirs take too much.
    fn limit_memory(&mut self, present: &State) {
        let same_volume = |[before, after]: [&State; 2]| {
            Arc::ptr_eq(&before.document.volume, &after.document.volume)
        };
        if self.history.last_step().is_none_or(same_volume) {
            return;
        }
        let most = (self.parts.bytes_for_steps)();
        if self.history.forget_while(|past| bytes_held_by(past, present) > most) {
            self.notices.note(
                "The oldest steps can no longer be undone: what was open then would take too much of the \
                 free memory",
            );
        }
    }

    /// Goes one step back by the key. Where that would take the open file away, it says so first, and does it only
    /// when the key is pressed again: opening a file is a step, but nobody expects to lose what was opened last.
    pub(super) fn step_back_by_key(&mut self, ctx: &Context) {
        self.record_now(ctx);
        let now_secs = ctx.time();
        let since_asked = self.undo_asked_secs.take().map(|at| now_secs - at);
        // Keys of one burst are meant for what was changed, and not for the file.
        if since_asked.is_some_and(|secs| secs < BURST_SECS) {
            self.undo_asked_secs = Some(now_secs);
            return;
        }
        let was_asked = since_asked.is_some_and(|secs| secs < AGAIN_SECS);
        let leaves =
            self.history.last_step().filter(|[before, after]| before.is_of_another_file(after));
        if let Some([before, after]) = leaves.filter(|_| !was_asked) {
            let [before, after] = [before, after].map(|state| state.document.source.name());
            self.undo_asked_secs = Some(now_secs);
            self.notices.hint(format!(
                "Nothing was changed since {after} was opened. Undo once more to go back to {before}, which was \
                 open before"
            ));
            return;
        }
        self.step(ctx, true);
    }

    /// Goes one step back, or forward again.
    pub(super) fn step(&mut self, ctx: &Context, back: bool) {
        // What is still in the hand is a step, too.
        self.record_now(ctx);
        let state = if back { self.history.undo() } else { self.history.redo() };
        match state {
            Some(state) => self.return_to(ctx, state),
            None if back => self.notices.hint("There is nothing to undo"),
            None => self.notices.hint("There is nothing to redo"),
        }
    }

    fn return_to(&mut self, ctx: &Context, state: State) {
        let State {
            document,
            scene,
            camera,
            gaussians,
            settings,
            compare,
            cells,
            curve,
            flow,
            speed,
        } = state;
        let is_same = self.document.as_ref().is_some_and(|now| now.is_same_file(&document));
        if !is_same {
            // They are of the file that is left.
            self.notices.clear();
            self.leave_file(ctx, &document);
        }
        self.document = Some(document);
        // The view is as it is now, but where it belongs to what comes back.
        let now = self.scene.take().filter(|now| is_same && now.up == scene.up);
        self.scene = Some(Scene { camera: now.map_or(camera, |now| now.camera), ..scene });
        self.gaussians = gaussians;
        let recent = std::mem::take(&mut self.settings.recent);
        let sections = std::mem::take(&mut self.settings.sections);
        let Settings { side_panel, knows_drag, .. } = self.settings;
        self.settings = Settings { recent, sections, side_panel, knows_drag, ..settings };
        compare.give_to(&mut self.compare);
        (self.cells.on, self.cells.max_error) = cells;
        self.transfer.let_go();
        self.transfer.set_curve_view(curve);
        self.flow.choice = flow;
        self.vectors.clock.set_speed(speed, ctx.time());
    }

    /// What undo and redo would do now, for people: the step in a few words, and a sentence. `None` where they would do
    /// nothing.
    pub(super) fn step_words(&self) -> [Option<(String, String)>; 2] {
        let words = |verb: &str, [before, after]: [&State; 2], to: &State| {
            let change = before.change_to(after);
            let sentence = match before.is_of_another_file(after) {
                true => format!("Show {} again, as it was", to.document.source.name()),
                false => format!("{verb} the last change of: {change}"),
            };
            (change, sentence)
        };
        let undo = self.history.last_step().map(|step| words("Take back", step, step[0]));
        let redo = self.history.next_step().map(|step| words("Do again", step, step[1]));
        [undo, redo]
    }
}
