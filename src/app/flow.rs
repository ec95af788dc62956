//! Streamlines and arrows in the window: made of the scene's vectors on a thread of their own, and then
//! polygons like others.

use std::sync::Arc;

use eframe::egui::Context;
use glam::DVec3;

use super::actions::Action;
use super::job::{Ended, Job};
use super::vectors::faded_for;
use super::window::Window;
use crate::core::Ticket;
use crate::polygons::Mesh;
use crate::scene::{Layer, Look, PolygonLayer, SampleSource, VectorLayer};
use crate::transfer::ColourSource;
use crate::vector::{self, Following, GlyphError, Seeds, StreamlineError};

/// Where streamlines begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeedPlace {
    /// At vectors, the more the longer these are.
    Vectors,
    /// Evenly on a plane of the grid.
    Plane,
    /// Evenly from one world point to another.
    Line,
    /// At a world point and within a step of the grid about it.
    Point,
}

/// What lines and arrows are made by; not a part of the picture until they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowChoice {
    /// Streamlines, about.
    pub seeds: u32,
    /// Where they begin.
    pub place: SeedPlace,
    /// World points: those that a line goes between, or the one about which; none until they were first
    /// asked for.
    pub ends: Option<[DVec3; 2]>,
    /// The axis of the grid across which their seeds lie, and where along it.
    pub axis: usize,
    /// See `axis`; 0..=1.
    pub share: f64,
    /// Of the tubes, steps of the grid.
    pub radius: f64,
    /// An arrow at every so many vectors along each axis.
    pub every: u32,
}

impl Default for FlowChoice {
    fn default() -> Self {
        Self {
            seeds: 60,
            place: SeedPlace::Vectors,
            ends: None,
            axis: 2,
            share: 0.5,
            radius: 0.25,
            every: 4,
        }
    }
}

/// Which of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowShape {
    /// Tubes about lines along the vectors.
    Streamlines,
    /// Vectors themselves.
    Arrows,
}

/// What is being made, and the colours of the lengths on it.
type Made = Result<(Mesh, ColourSource), Option<String>>;

/// The window's side of them.
#[derive(Debug, Default)]
pub(super) struct Flow {
    pub(super) choice: FlowChoice,
    pub(super) job: Option<Job<Made>>,
}

/// Makes shapes of vectors; `None` where that was cancelled.
fn made(layer: &VectorLayer, choice: FlowChoice, shape: FlowShape, ticket: &Ticket) -> Made {
    let (field, transfer) = (&layer.field, &layer.settings.transfer);
    let refused = |error: GlyphError| match error {
        GlyphError::Cancelled(_) => None,
        other => Some(other.to_string()),
    };
    match shape {
        FlowShape::Arrows => {
            let every = choice.every as usize;
            let arrows = vector::arrows(field, transfer, every, 0.9, ticket).map_err(refused)?;
            Ok((arrows, transfer.colour.clone()))
        }
        FlowShape::Streamlines => {
            let FlowChoice { seeds, place, ends, axis, share, radius, .. } = choice;
            let (count, step) = (seeds as usize, vector::typical_step(&field.places));
            let seeds = match (place, ends) {
                (SeedPlace::Line, Some([first, last])) => {
                    Seeds::At(vector::seeds_on_line(first, last, count))
                }
                (SeedPlace::Point, Some([point, _])) => {
                    Seeds::At(vector::seeds_about(point, step, count))
                }
                (SeedPlace::Vectors, _) => Seeds::At(vector::seeds_at_vectors(field, count)),
                _ => Seeds::OnPlane { axis, share, count },
            };
            let lines = vector::streamlines(field, &seeds, &Following::default(), ticket);
            let lines = lines.map_err(|error| match error {
                StreamlineError::Cancelled(_) => None,
                refused => Some(refused.to_string()),
            })?;
            let colours = layer.colours_of_lines();
            let tubes = vector::tubes(&lines, &colours, radius * step).map_err(refused)?;
            Ok((tubes, colours.colour))
        }
    }
}

impl Window {
    /// Starts to make lines or arrows of the scene's vectors.
    pub(super) fn start_flow(&mut self, ctx: &Context, shape: FlowShape) {
        let vectors = self.scene.as_ref().and_then(|scene| scene.vectors().into_iter().next());
        let Some(layer) = vectors else {
            return;
        };
        let choice = self.flow.choice;
        let title = match shape {
            FlowShape::Streamlines => "Following the vectors",
            FlowShape::Arrows => "Making arrows",
        };
        let job = Job::start("flow", title, ctx, move |ticket| made(&layer, choice, shape, ticket));
        self.flow.job = Some(job);
    }

    /// Puts what was made into the scene, in place of what was made so before.
    pub(super) fn take_flow(&mut self) {
        let Some(ended) = self.flow.job.as_ref().and_then(Job::poll) else { return };
        let was_cancelled = self.flow.job.take().is_some_and(|job| job.is_cancelled());
        let Some(scene) = self.scene.as_mut().filter(|_| !was_cancelled) else { return };
        match ended {
            Ended::Finished(Ok((mesh, colours))) => {
                self.notices.settle();
                let source = SampleSource::made(mesh.name());
                let (places, name) = (mesh.spread_places(), mesh.name().to_owned());
                let mut layer = PolygonLayer::of_vectors(Arc::new(mesh), &colours);
                let is_of_name = |old: &Layer| {
                    (&old.source.path, &old.source.field) == (&source.path, &source.field)
                };
                match scene.layers.iter().position(is_of_name) {
                    Some(at) => {
                        if let Look::Polygons(old) = &scene.layers[at].look {
                            (layer.look.opacity, layer.look.colour) = (old.opacity, old.colour);
                        }
                        scene.replace(at, source, layer);
                    }
                    None => scene.add(source, layer),
                }
                if scene.uncover(places.iter().copied()) {
                    self.notices.offer(Action::ShowFaded, faded_for(&name));
                }
            }
            Ended::Finished(Err(None)) => {}
            Ended::Finished(Err(Some(reason))) => self.notices.error(reason),
            Ended::Lost => {
                self.notices.error("Following the vectors stopped on a bug of the program")
            }
        }
    }
}
