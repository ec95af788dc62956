//! Flags of vector splats.

use std::path::Path;
use std::sync::Arc;

use clap::Args;

use super::open::Input;
use super::vector_look::{self, LookFlags, Said};
use super::{Failure, note, values};
use crate::core::Ticket;
use crate::scene::{SampleSource, Scene, VectorLayer};
use crate::task::loop_file::LoopFormat;
use crate::transfer::TransferFunction;
use crate::vector::ColourBy;
use crate::volume::{Field, Shape, VectorField, VolumeError};

/// Seconds that a loop takes unless flags say otherwise.
const LOOP_SECONDS: f64 = 3.0;

/// A vector field, and what its splats look like.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Vectors")]
pub struct VectorFlags {
    /// Draw this field of three components as vectors, beside the scalar field [default: one that opens first, alone]
    #[arg(long, value_name = "NAME")]
    pub vector: Option<String>,
    /// Draw three scalar fields as the components of vectors, along x, y and z
    #[arg(long, num_args = 3, value_names = ["U", "V", "W"], conflicts_with = "vector")]
    pub vector_components: Option<Vec<String>>,
    /// Draw vectors and no scalar field beside them
    #[arg(long)]
    pub vectors_only: bool,
    /// How far the marks have moved, in cycles; 0 and 1 are the same
    #[arg(long, value_name = "P", value_parser = values::number, default_value_t = 0.0,
        allow_hyphen_values = true)]
    pub phase: f64,
    /// Draw one whole cycle of N pictures: --output X.gif, or X.png for X-000.png and so on
    #[arg(long = "loop", value_name = "N", value_parser = values::natural,
        allow_hyphen_values = true)]
    pub cycle: Option<u32>,
    /// Seconds that --loop takes in a GIF [default: 3]
    #[arg(long, value_name = "S", value_parser = values::positive, allow_hyphen_values = true)]
    pub loop_seconds: Option<f64>,
    /// What the splats look like.
    #[command(flatten)]
    pub look: LookFlags,
    /// Draw this field of three components as vectors, too, among those of --vector
    #[arg(long, value_name = "NAME")]
    pub second_vector: Option<String>,
    /// Draw three scalar fields as the components of second vectors, along x, y and z
    #[arg(long, num_args = 3, value_names = ["U", "V", "W"], conflicts_with = "second_vector")]
    pub second_vector_components: Option<Vec<String>>,
    /// What the second vectors look like: mode, opacity, opacity-by, colormap, color-range, color-by,
    /// color, marks, stretch, extent, coarser, design, foreshortening or seed, as the --vector- flags;
    /// once for each
    #[arg(long, value_name = "WHAT=VALUE", value_parser = vector_look::said)]
    pub second_look: Vec<Said>,
}

/// Vectors that flags ask for.
pub(super) struct Vectors {
    /// One field, or two.
    pub layers: Vec<(SampleSource, VectorLayer)>,
    /// Without the scalar field.
    pub alone: bool,
    /// In cycles.
    pub phase: f64,
}

impl Vectors {
    /// Puts them into a scene.
    pub(super) fn add_to(self, scene: &mut Scene) {
        for (source, layer) in self.layers {
            scene.add(source, layer);
        }
        scene.phase = self.phase;
        if self.alone {
            scene.show_field(false);
        }
    }
}

impl VectorFlags {
    /// The vectors of a scene, where there are any.
    ///
    /// # Errors
    /// Flags of vectors without any, fields that are none, and settings that mean nothing.
    pub(super) fn layer(
        &self,
        input: &Input,
        scene: &Scene,
        opens_with_scalar: bool,
        nothing_is_asked_of_the_field: bool,
    ) -> Result<Option<Vectors>, Failure> {
        let failed = |error: VolumeError| Failure::Failed(input.about(&error.to_string()));
        let active = input.grid.fields.first();
        // Of a mesh its matter is seen first.
        let is_mesh = matches!(input.grid.shape, Shape::Unstructured(_));
        let opens_as_vectors =
            !opens_with_scalar && !is_mesh && active.is_some_and(|f| f.components == 3);
        let flows_by_itself = nothing_is_asked_of_the_field
            && !self.vectors_only
            && self.named().is_none()
            && self.given().is_none()
            && input.flowing_field().is_some();
        let ticket = Ticket::new();
        let of = |field: &Field| input.grid.vectors(field, &ticket).map_err(failed);
        let named = |name: &str| input.grid.field(Some(name)).map_err(failed);
        let (vectors, alone) = match (&self.vector, self.vector_components.as_deref()) {
            (_, Some([u, v, w])) => {
                let fields = [named(u)?, named(v)?, named(w)?];
                let vectors = input.grid.vectors_of(fields, &ticket).map_err(failed)?;
                (vectors, self.vectors_only)
            }
            (Some(name), _) => {
                let field = named(name)?;
                // The length of the same vectors would only stand in their way.
                let is_same = opens_as_vectors && active.is_some_and(|a| a.name == field.name);
                (of(field)?, self.vectors_only || is_same)
            }
            (None, _) if opens_as_vectors || self.vectors_only => {
                let found = input.grid.fields.iter().find(|field| field.components == 3);
                let field = found.ok_or_else(|| {
                    Failure::Failed(input.about(
                        "expected a field of three components for --vectors-only, found none; leave \
                         it out, or name three fields with --vector-components",
                    ))
                })?;
                (of(field)?, true)
            }
            (None, _) if flows_by_itself => {
                let name = input.flowing_field().unwrap_or_default();
                (of(named(name)?)?, true)
            }
            (None, _) => {
                return match self.given() {
                    None => Ok(None),
                    Some(flag) => Err(Failure::Usage(format!(
                        "expected --vector NAME with {flag}, found no field named; name a field of three \
                         components, which `voxsplat info` tells, or add --vectors-only"
                    ))),
                };
            }
        };
        // On the lattice of a mesh what lies outside is no hole.
        if !is_mesh {
            note_holes(&vectors);
        }
        let mut layer = match flows_by_itself {
            true => VectorLayer::flowing(Arc::new(vectors)),
            false => VectorLayer::new(Arc::new(vectors)),
        };
        let field = scene.transfer().filter(|_| !alone);
        layer = layer.unlike(field);
        let beside = scene.volume().map(|volume| &**volume);
        let range = |by: ColourBy| by.range(&layer.field, beside);
        let settings = self.look.settings(&layer.settings, range, |name| match name {
            "mode blend" => "--vector-mode blend".to_owned(),
            name => format!("--vector-{name}"),
        });
        layer.settings = settings.map_err(Failure::Usage)?;
        let mut layers = vec![layer];
        let others = field.into_iter().chain([&layers[0].settings.transfer]);
        let second = self.second(input, scene, others)?;
        layers.extend(second);
        let of = |layer: VectorLayer| (input.source(&layer.field.name), layer);
        Ok(Some(Vectors { layers: layers.into_iter().map(of).collect(), alone, phase: self.phase }))
    }

    /// The second field, where one was asked for, in colours that nothing beside it has.
    fn second<'a>(
        &self,
        input: &Input,
        scene: &Scene,
        others: impl IntoIterator<Item = &'a TransferFunction>,
    ) -> Result<Option<VectorLayer>, Failure> {
        let failed = |error: VolumeError| Failure::Failed(input.about(&error.to_string()));
        let named = |name: &str| input.grid.field(Some(name)).map_err(failed);
        let ticket = Ticket::new();
        let vectors = match (&self.second_vector, self.second_vector_components.as_deref()) {
            (_, Some([u, v, w])) => {
                input.grid.vectors_of([named(u)?, named(v)?, named(w)?], &ticket)
            }
            (Some(name), _) => input.grid.vectors(named(name)?, &ticket),
            (None, _) if self.second_look.is_empty() => return Ok(None),
            (None, _) => {
                return Err(Failure::Usage(
                    "expected --second-vector NAME with --second-look, found no second field; name one, or \
                     leave it out"
                        .to_owned(),
                ));
            }
        };
        let vectors = vectors.map_err(failed)?;
        if !matches!(input.grid.shape, Shape::Unstructured(_)) {
            note_holes(&vectors);
        }
        let opening = VectorLayer::beside_another(Arc::new(vectors)).unlike(others);
        let beside = scene.volume().map(|volume| &**volume);
        let range = |by: ColourBy| by.range(&opening.field, beside);
        let look = LookFlags::of(&self.second_look).map_err(Failure::Usage)?;
        let settings = look.settings(&opening.settings, range, |name| match name {
            "mode blend" => "--second-look mode=blend".to_owned(),
            name => format!("--second-look {name}"),
        });
        let settings = settings.map_err(Failure::Usage)?;
        Ok(Some(VectorLayer { settings, ..opening }))
    }

    /// Seconds that a loop takes.
    ///
    /// # Errors
    /// Seconds without a loop that has any.
    pub(super) fn loop_seconds(&self, output: &Path) -> Result<f64, Failure> {
        let is_gif = matches!(LoopFormat::of(output), Ok(LoopFormat::Gif));
        match self.loop_seconds {
            Some(_) if self.cycle.is_none() => Err(Failure::Usage(
                "expected --loop with --loop-seconds, found one picture; add --loop N, or leave it out"
                    .to_owned(),
            )),
            Some(_) if !is_gif => Err(Failure::Usage(
                "expected a GIF with --loop-seconds, found pictures, which have no speed; write to a name \
                 that ends in .gif, or leave it out"
                    .to_owned(),
            )),
            seconds => Ok(seconds.unwrap_or(LOOP_SECONDS)),
        }
    }

    /// # Errors
    /// A loop asked of a command that draws none.
    pub(super) fn refuse_loop(&self, command: &str) -> Result<(), Failure> {
        let seconds = self.loop_seconds.map(|_| "--loop-seconds");
        match self.cycle.map(|_| "--loop").or(seconds) {
            Some(flag) => Err(Failure::Usage(format!(
                "expected {flag} with render, found it with {command}, which writes no pictures; leave it out"
            ))),
            None => Ok(()),
        }
    }

    /// The flag that names vectors, if one was given.
    pub(super) fn named(&self) -> Option<&'static str> {
        let components = self.vector_components.is_some().then_some("--vector-components");
        self.vector.is_some().then_some("--vector").or(components)
    }

    /// The first flag that was given and changes nothing without vectors.
    fn given(&self) -> Option<&'static str> {
        self.look.given().or_else(|| {
            [
                ("--second-vector", self.second_vector.is_some()),
                ("--second-vector-components", self.second_vector_components.is_some()),
                ("--second-look", !self.second_look.is_empty()),
                ("--phase", self.phase != 0.0),
                ("--loop", self.cycle.is_some()),
            ]
            .into_iter()
            .find_map(|(flag, given)| given.then_some(flag))
        })
    }
}

fn note_holes(vectors: &VectorField) {
    let statistics = &vectors.statistics;
    let holes = statistics.nan_count + statistics.infinite_count;
    if holes > 0 {
        note(&format!(
            "{holes} of {} vectors of \"{}\" have no length that is finite and within 3.4e38, and are not \
             drawn",
            vectors.vectors.len(),
            vectors.name
        ));
    }
}
