//! Vectors in the window: which field, and the animation's clock.

use std::sync::Arc;
use std::time::Duration;

use eframe::egui::Context;

use super::actions::Action;
use super::document::Document;
use super::job::{Ended, Job};
use super::window::Window;
use crate::core::Ticket;
use crate::scene::{Layer, Look, SampleSource, VectorLayer};
use crate::vector::{self, PhaseClock, VectorSettings};
use crate::volume::{Grid, VectorField, VolumeError};

/// Cycles a second when an animation is first started.
const FIRST_SPEED: f64 = 0.4;
/// Animated pictures a second at most, unless someone chooses otherwise: enough for motion, and sparing
/// of a battery.
pub(super) const MOST_FPS: u32 = 20;

/// The longest vectors of which it is asked whether the field hides them.
const PLACES: usize = 64;

/// What is said where the field was faded for what lies in it.
pub(super) fn faded_for(name: &str) -> String {
    format!("The volume would hide the {name}, so it was faded")
}

/// Which fields of the open file are drawn as vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VectorSource {
    /// The one of this number, of three components.
    Field(usize),
    /// The ones of these numbers, of one component each: along x, y and z.
    Triple([usize; 3]),
}

/// Three scalar fields that a person is putting together. What they make is a part of the picture once
/// it is drawn, and this is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Triple {
    fields: Option<[usize; 3]>,
}

impl Triple {
    /// Begins with these fields, or goes on with those there are.
    pub fn open(&mut self, fields: [usize; 3]) {
        self.fields.get_or_insert(fields);
    }

    /// Nothing is put together any more.
    pub fn close(&mut self) {
        self.fields = None;
    }

    /// Whether one is being put together.
    pub fn is_open(&self) -> bool {
        self.fields.is_some()
    }

    /// The fields along x, y and z.
    pub fn fields(&self) -> Option<[usize; 3]> {
        self.fields
    }

    /// Another field along an axis.
    pub fn choose(&mut self, axis: usize, field: usize) {
        if let Some(chosen) = self.fields.as_mut().and_then(|fields| fields.get_mut(axis)) {
            *chosen = field;
        }
    }
}

/// The vectors of fields of a grid.
fn vectors_of(
    grid: &Grid,
    source: VectorSource,
    ticket: &Ticket,
) -> Result<VectorField, VolumeError> {
    let field = |index: usize| {
        grid.fields.get(index).ok_or_else(|| VolumeError::NoSuchField {
            asked: format!("number {index}"),
            available: grid.fields.iter().map(|field| field.name.clone()).collect(),
        })
    };
    match source {
        VectorSource::Field(index) => grid.vectors(field(index)?, ticket),
        VectorSource::Triple([u, v, w]) => {
            grid.vectors_of([field(u)?, field(v)?, field(w)?], ticket)
        }
    }
}

/// Another field keeps what was chosen, but for what belongs to its lengths.
fn kept(chosen: VectorSettings, opening: &VectorSettings) -> VectorSettings {
    VectorSettings {
        transfer: opening.transfer.clone(),
        opacity_by: opening.opacity_by,
        colour_by: opening.colour_by,
        coarser: opening.coarser,
        ..chosen
    }
}

/// The window's side of vectors.
#[derive(Debug)]
pub(super) struct Vectors {
    pub(super) clock: PhaseClock,
    /// Fields that are being put together, for the first vectors and for the second.
    pub(super) triples: [Triple; 2],
    /// Vectors of fields that were chosen, on their way; whether they are second ones.
    job: Option<(bool, Job<Result<VectorField, VolumeError>>)>,
    /// What is asked of vectors that are on their way: done once they are there.
    then: Option<Action>,
    /// When the phase was last moved on, seconds.
    moved_at: f64,
}

impl Default for Vectors {
    fn default() -> Self {
        let clock = PhaseClock::new(0.0, FIRST_SPEED);
        Self { clock, triples: Default::default(), job: None, then: None, moved_at: 0.0 }
    }
}

impl Window {
    /// Starts to make the vectors of fields of the open file ready, or takes those there are away: all of
    /// them, or the second ones.
    pub(super) fn choose_vectors(
        &mut self,
        ctx: &Context,
        is_second: bool,
        source: Option<VectorSource>,
    ) {
        (self.vectors.job, self.vectors.then) = (None, None);
        let Some(source) = source else {
            if let Some(scene) = &mut self.scene {
                scene.keep_vectors(usize::from(is_second));
            }
            return;
        };
        let Some(grid) = self.document.as_ref().map(|document| Arc::clone(&document.grid)) else {
            return;
        };
        let job = Job::start("vectors", "Preparing the vectors", ctx, move |ticket| {
            vectors_of(&grid, source, ticket)
        });
        self.vectors.job = Some((is_second, job));
    }

    /// Starts to make the first vectors of the open file ready.
    pub(super) fn show_first_vectors(&mut self, ctx: &Context) {
        match self.document.as_ref().and_then(Document::first_vectors) {
            Some(index) => self.choose_vectors(ctx, false, Some(VectorSource::Field(index))),
            None => self.notices.hint("There are no vectors in what is open"),
        }
    }

    /// Shows the first vectors of the open file, and then does what follows vectors that are shown.
    pub(super) fn show_vectors_first(&mut self, ctx: &Context, then: Action) {
        self.show_first_vectors(ctx);
        self.vectors.then = Some(then);
    }

    /// Whether vectors are not shown but could be without further choice.
    pub(super) fn can_show_vectors(&self) -> bool {
        self.has_hidden_vectors()
            && self.document.as_ref().is_some_and(|document| document.first_vectors().is_some())
    }

    /// Whether the file has vectors that are not shown.
    pub(super) fn has_hidden_vectors(&self) -> bool {
        let has_any = self.document.as_ref().is_some_and(Document::has_vectors);
        has_any && self.scene.as_ref().is_some_and(|scene| scene.vectors().is_empty())
    }

    /// Puts vectors that are ready into the scene, and does what was asked of them meanwhile.
    pub(super) fn take_vectors(&mut self, ctx: &Context) {
        let Some((is_second, ended)) =
            self.vectors.job.as_ref().and_then(|(second, job)| Some((*second, job.poll()?)))
        else {
            return;
        };
        let then = self.vectors.then.take();
        self.vectors.job = None;
        let Some(scene) = &mut self.scene else { return };
        match ended {
            Ended::Finished(Ok(field)) => {
                self.notices.settle();
                self.notices.withdraw(Action::ShowVectors);
                let path = self.document.as_ref().map(|document| document.source.key());
                let source = SampleSource::whole(&path.unwrap_or_default(), &field.name);
                let field = Arc::new(field);
                let opening = match is_second {
                    true => VectorLayer::beside_another(field),
                    false => VectorLayer::new(field),
                };
                let index = usize::from(is_second);
                let vectors = scene.vectors();
                let others = vectors.iter().enumerate().filter(|(i, _)| *i != index);
                let others = others.map(|(_, other)| &other.settings.transfer);
                let field = scene.transfer().filter(|_| scene.shows_field());
                let opening = opening.unlike(others.chain(field));
                match scene.vectors().into_iter().nth(index) {
                    Some(before) => {
                        let settings = kept(before.settings, &opening.settings);
                        let is_one = |layer: &&Layer| {
                            layer.is_shown && matches!(layer.look, Look::Vectors(_))
                        };
                        let layers = scene.layers.iter().enumerate();
                        let mut shown = layers.filter(|(_, layer)| is_one(layer));
                        if let Some((at, _)) = shown.nth(index) {
                            scene.replace(at, source, VectorLayer { settings, ..opening });
                        }
                    }
                    None if then == Some(Action::MakeStreamlines) => {
                        // Who asks for lines means to see these.
                        let mut alone = opening;
                        alone.show_splats(false);
                        scene.add(source, alone);
                        self.notices.hint(
                            "The vectors are shown as lines alone: more Opacity, under Vectors, shows their splats, too",
                        );
                    }
                    None => {
                        let field = Arc::clone(&opening.field);
                        scene.add(source, opening);
                        // Who asks for them means to see them: all of them, and the longest above all.
                        let longest = vector::seeds_at_vectors(&field, PLACES);
                        if scene.uncover((0..field.vectors.len()).map(|i| field.places.at(i).0))
                            || scene.uncover(longest.into_iter())
                        {
                            self.notices.offer(Action::ShowFaded, faded_for("vectors"));
                        }
                    }
                }
                if let Some(action) = then {
                    self.perform(ctx, action);
                }
            }
            Ended::Finished(Err(VolumeError::Cancelled(_))) => {}
            Ended::Finished(Err(error)) => self.notices.error(error.to_string()),
            Ended::Lost => {
                self.notices.error("Preparing the vectors stopped on a bug of the program")
            }
        }
    }

    /// Starts or stops the animation.
    pub(super) fn toggle_animation(&mut self, ctx: &Context) {
        let runs = self.vectors.clock.is_running();
        self.vectors.clock.set_running(!runs, ctx.time());
        // What plays is seen.
        if let Some(scene) = self.scene.as_mut().filter(|_| !runs) {
            scene.show_vector_splats();
        }
    }

    /// Moves the marks on, as often as asked for.
    pub(super) fn pace_animation(&mut self, ctx: &Context) {
        let now = ctx.time();
        let scene = self.scene.as_mut().filter(|scene| !scene.vectors().is_empty());
        let Some(scene) = scene else {
            self.vectors.clock.set_running(false, now);
            self.pacing.set_animation(None);
            return;
        };
        let clock = &self.vectors.clock;
        if !clock.is_moving() {
            scene.phase = clock.phase(now);
            self.pacing.set_animation(None);
            return;
        }
        let every = 1.0 / f64::from(self.settings.animation_fps.max(1));
        self.pacing.set_animation(Some(every * 1000.0));
        let waited = now - self.vectors.moved_at;
        // Passes come a little early or late.
        if waited >= 0.9 * every || waited < 0.0 {
            scene.phase = clock.phase(now);
            self.vectors.moved_at = now;
            ctx.request_repaint_after(Duration::from_secs_f64(every));
        } else {
            ctx.request_repaint_after(Duration::from_secs_f64(every - waited));
        }
    }
}
