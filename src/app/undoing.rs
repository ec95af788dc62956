//! Undo and redo in the window: what a state is, what is called what, and when a step ends.
//!
//! Everything that changes the picture, or what lies over it, belongs to a state: the transfer
//! function, the mode, the view, the comparison, the background and the other display settings, and
//! which field of the file is drawn. What does not: which panels are open, how the graph of the
//! transfer function is zoomed, and the list of recent files. Another file begins a new history,
//! since two files might not fit into memory.

use std::sync::Arc;

use eframe::egui::{Context, Event};

use super::compare::{Compare, Display};
use super::document::Document;
use super::settings::Settings;
use super::window::Window;
use crate::scene::{Scene, SplatSettings};
use crate::transfer::Gaussian;

/// Seconds within which one notch of the wheel goes on with the step of the one before.
const WHEEL_SECS: f64 = 0.6;

/// Everything that can be undone, as plain data; the volume is shared.
#[derive(Debug, Clone)]
pub(super) struct State {
    document: Document,
    scene: Scene,
    gaussians: Vec<Gaussian>,
    settings: Settings,
    compare: Comparison,
    cells: (bool, f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Comparison {
    on: bool,
    second: SplatSettings,
    display: Display,
    doublings: u32,
    divider: f32,
    edits_second: bool,
}

impl Comparison {
    fn of(compare: &Compare) -> Self {
        let Compare { on, second, display, doublings, divider, edits_second, .. } = *compare;
        Self { on, second, display, doublings, divider, edits_second }
    }

    fn give_to(self, compare: &mut Compare) {
        let Self { on, second, display, doublings, divider, edits_second } = self;
        (compare.on, compare.second, compare.display) = (on, second, display);
        (compare.doublings, compare.divider, compare.edits_second) =
            (doublings, divider, edits_second);
    }
}

impl PartialEq for State {
    fn eq(&self, other: &Self) -> bool {
        // Taken apart, so that a new part cannot be forgotten here.
        let Self { document, scene, gaussians, settings, compare, cells } = self;
        Arc::ptr_eq(&document.volume, &other.document.volume)
            && scene.makes_same_picture(&other.scene)
            && *gaussians == other.gaussians
            && *settings == other.settings
            && *compare == other.compare
            && *cells == other.cells
    }
}

impl State {
    /// What is different after a step, in a few words.
    fn change_to(&self, after: &Self) -> &'static str {
        let (a, b) = (&self.scene, &after.scene);
        let opacity = a.transfer.opacity != b.transfer.opacity || self.gaussians != after.gaussians;
        let colour = a.transfer.colour != b.transfer.colour;
        let background = |s: &Settings| (s.background, s.transparent_background);
        match () {
            () if !Arc::ptr_eq(&a.volume, &b.volume) => "another field",
            () if a.shading.regions != b.shading.regions && !opacity && !colour => "regions",
            () if opacity && colour => "transfer function",
            () if a.transfer.no_data != b.transfer.no_data => "no data",
            () if opacity => "opacities",
            () if colour => "colours",
            () if a.vectors != b.vectors => "vectors",
            () if a.polygons != b.polygons => "polygons",
            () if a.splat.opacity_unit_distance != b.splat.opacity_unit_distance => "unit distance",
            () if a.splat != b.splat => "splat settings",
            () if a.shading != b.shading => "shading",
            () if a.inside.clip != b.inside.clip => "clip",
            () if a.inside != b.inside => "inside",
            () if a.camera.projection != b.camera.projection => "projection",
            () if a.camera != b.camera => "view",
            () if self.compare != after.compare => "comparison",
            () if self.cells != after.cells => "octree cells",
            () if self.settings.annotations != after.settings.annotations => "annotations",
            () if background(&self.settings) != background(&after.settings) => "background",
            () => "display settings",
        }
    }
}

/// What the wheel did last, for notches that go on with a step.
#[derive(Debug, Default)]
pub(super) struct Wheel {
    /// When the last step was recorded, if it was one of the wheel.
    last_secs: Option<f64>,
}

impl Window {
    /// Everything that can be undone, once something is open.
    fn state(&self) -> Option<State> {
        let (document, mut scene) = (self.document.clone()?, self.scene.clone()?);
        if let Some(layer) = &mut scene.vectors {
            // Time passes by itself.
            layer.phase = 0.0;
        }
        Some(State {
            document,
            scene,
            gaussians: self.gaussians.clone(),
            settings: Settings { recent: Vec::new(), side_panel: true, ..self.settings.clone() },
            compare: Comparison::of(&self.compare),
            cells: (self.cells.on, self.cells.max_error),
        })
    }

    /// Begins a new history.
    pub(super) fn forget_steps(&mut self) {
        self.wheel = Wheel::default();
        if let Some(state) = self.state() {
            self.history.start(state);
        }
    }

    /// Takes note of what has changed, unless something is still being held or typed.
    pub(super) fn record_step(&mut self, ctx: &Context) {
        let is_held = ctx.input(|input| input.pointer.any_down()) || ctx.dragged_id().is_some();
        if !is_held && !ctx.text_edit_focused() {
            self.record_now(ctx);
        }
    }

    fn record_now(&mut self, ctx: &Context) {
        let Some(state) = self.state() else { return };
        let is_wheel = |event: &Event| matches!(event, Event::MouseWheel { .. } | Event::Zoom(_));
        let (now_secs, wheel) = ctx.input(|i| (i.time, i.events.iter().any(is_wheel)));
        let goes_on = self.wheel.last_secs.is_some_and(|last| now_secs - last < WHEEL_SECS);
        if self.history.record(&state, wheel && goes_on) {
            self.wheel.last_secs = wheel.then_some(now_secs);
        }
    }

    /// Goes one step back, or forward again.
    pub(super) fn step(&mut self, ctx: &Context, back: bool) {
        // What is still in the hand is a step, too.
        self.record_now(ctx);
        self.wheel = Wheel::default();
        let state = if back { self.history.undo() } else { self.history.redo() };
        match state {
            Some(state) => self.return_to(state),
            None if back => self.notices.hint("There is nothing to undo"),
            None => self.notices.hint("There is nothing to redo"),
        }
    }

    fn return_to(&mut self, state: State) {
        let State { document, scene, gaussians, settings, compare, cells } = state;
        self.document = Some(document);
        self.scene = Some(scene);
        self.gaussians = gaussians;
        let recent = std::mem::take(&mut self.settings.recent);
        self.settings = Settings { recent, side_panel: self.settings.side_panel, ..settings };
        compare.give_to(&mut self.compare);
        (self.cells.on, self.cells.max_error) = cells;
        self.transfer.let_go();
    }

    /// What undo and redo would do now, for people: `None` where they would do nothing.
    pub(super) fn step_words(&self) -> [Option<String>; 2] {
        let words = |verb: &str, [before, after]: [&State; 2]| {
            format!("{verb} the last change of: {}", before.change_to(after))
        };
        let undo = self.history.last_step().map(|step| words("Take back", step));
        let redo = self.history.next_step().map(|step| words("Do again", step));
        [undo, redo]
    }
}
