//! Flags of vector splats.

use std::sync::Arc;

use clap::Args;

use super::open::Input;
use super::values::{self, List, Points};
use super::{Failure, note};
use crate::core::{Srgb8, Ticket};
use crate::scene::{Scene, VectorLayer};
use crate::transfer::{ColourMap, ColourSource};
use crate::vector::{ColourBy, Design, Foreshortening, VectorMode, VectorSettings};
use crate::volume::{Field, VolumeError};

/// A vector field, and what its splats look like.
#[derive(Debug, Args)]
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
    /// How marks meet the colour of a splat: modulate (the marks alone) or blend (matter with marks in
    /// it) [default: modulate]
    #[arg(long, value_name = "MODE", value_parser = values::vector_mode)]
    pub vector_mode: Option<VectorMode>,
    /// How far the marks have moved, in cycles; 0 and 1 are the same
    #[arg(long, value_name = "P", value_parser = values::number, default_value_t = 0.0,
        allow_hyphen_values = true)]
    pub phase: f64,
    /// Draw one whole cycle of N pictures: --output X.gif, or X.png for X-000.png and so on
    #[arg(long = "loop", value_name = "N")]
    pub cycle: Option<u32>,
    /// Seconds that --loop takes in a GIF
    #[arg(long, value_name = "S", value_parser = values::positive, default_value_t = 3.0,
        allow_hyphen_values = true)]
    pub loop_seconds: f64,
    /// Of the splats' own phases
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Opacity per unit distance by the length of the vector (or by --vector-opacity-by)
    #[arg(long, value_name = "V:A,…", value_parser = values::opacity, allow_hyphen_values = true)]
    pub vector_opacity: Option<Points>,
    /// What opacities are by: magnitude, x, y, z (world position) or scalar (the field beside)
    #[arg(long, value_name = "BY", value_parser = values::colour_by)]
    pub vector_opacity_by: Option<ColourBy>,
    /// Colours of vectors: a map
    #[arg(long, value_name = "NAME", value_parser = values::colour_map)]
    pub vector_colormap: Option<ColourMap>,
    /// The values that take its first and its last colour
    #[arg(long, value_name = "LO,HI", value_parser = values::range, allow_hyphen_values = true)]
    pub vector_color_range: Option<[f64; 2]>,
    /// What colours are by: magnitude, x, y, z or scalar
    #[arg(long, value_name = "BY", value_parser = values::colour_by)]
    pub vector_color_by: Option<ColourBy>,
    /// One colour for all vectors: of all marks with modulate, of the matter with blend
    #[arg(long, value_name = "RRGGBB", value_parser = values::colour,
        conflicts_with_all = ["vector_colormap", "vector_color_range", "vector_color_by"])]
    pub vector_color: Option<Srgb8>,
    /// With blend: the colour of the marks, or mapped for that of the map over grey matter [default:
    /// ffffff]
    #[arg(long, value_name = "RRGGBB|mapped", value_parser = marks)]
    pub vector_marks: Option<Marks>,
    /// Length of a splat along the flow over its width, 1 to 8 [default: 1.5]
    #[arg(long, value_name = "S", value_parser = values::positive, allow_hyphen_values = true)]
    pub vector_stretch: Option<f64>,
    /// Radius of a splat in steps of its grid [default: 1.6]
    #[arg(long, value_name = "E", value_parser = values::positive, allow_hyphen_values = true)]
    pub vector_extent: Option<f64>,
    /// Draw means of 2 × 2 × 2 vectors, and of these again, so many times [default: as often as leaves
    /// 40 along the longest side]
    #[arg(long, value_name = "N")]
    pub vector_coarser: Option<u32>,
    /// What the marks look like: streaks, dots or comets [default: streaks]
    #[arg(long, value_name = "NAME", value_parser = values::design)]
    pub vector_design: Option<Design>,
    /// How vectors towards the eye are shown: table, polygon or coordinates [default: table]
    #[arg(long, value_name = "WAY", value_parser = values::foreshortening)]
    pub vector_foreshortening: Option<Foreshortening>,
}

/// The colour of BLEND's marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Marks(Option<Srgb8>);

fn marks(text: &str) -> Result<Marks, String> {
    match text {
        "mapped" => Ok(Marks(None)),
        colour => values::colour(colour)
            .map(|colour| Marks(Some(colour)))
            .map_err(|error| format!("{error}; or say mapped for the colours of the map")),
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
    ) -> Result<Option<VectorLayer>, Failure> {
        let failed = |error: VolumeError| Failure::Failed(input.about(&error.to_string()));
        let active = input.grid.fields.first();
        let opens_as_vectors = !opens_with_scalar && active.is_some_and(|f| f.components == 3);
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
            (None, _) => {
                return match self.given() {
                    None => Ok(None),
                    Some(flag) => Err(Failure::Usage(format!(
                        "expected --vector NAME with {flag}, found no field named; name one of three \
                         components, which `voxsplat info` tells, or add --vectors-only"
                    ))),
                };
            }
        };
        let holes = vectors.vectors.iter().filter(|v| !v.is_finite()).count();
        if holes > 0 {
            note(&format!(
                "{holes} of {} vectors of \"{}\" have no finite length and are not drawn",
                vectors.vectors.len(),
                vectors.name
            ));
        }
        let layer = VectorLayer::new(Arc::new(vectors), alone);
        let settings = self.settings(&layer.settings, &layer, scene);
        settings.check().map_err(|error| Failure::Usage(error.to_string()))?;
        Ok(Some(VectorLayer { settings, phase: self.phase, ..layer }))
    }

    fn settings(
        &self,
        opening: &VectorSettings,
        layer: &VectorLayer,
        scene: &Scene,
    ) -> VectorSettings {
        let mut transfer = opening.transfer.clone();
        if let Some(List(points)) = &self.vector_opacity {
            transfer.opacity.clone_from(points);
        }
        let colour_by = self.vector_color_by.unwrap_or(opening.colour_by);
        if let ColourSource::Map { map, range } = &mut transfer.colour {
            *map = self.vector_colormap.unwrap_or(*map);
            *range = match self.vector_color_range {
                Some(range) => range,
                None if colour_by == opening.colour_by => *range,
                None => layer.range_of(colour_by, &scene.volume),
            };
        }
        if let Some(colour) = self.vector_color {
            transfer.colour = ColourSource::Stops(vec![(0.0, colour)]);
        }
        VectorSettings {
            mode: self.vector_mode.unwrap_or(opening.mode),
            opacity_by: self.vector_opacity_by.unwrap_or(opening.opacity_by),
            colour_by,
            transfer,
            marks: self.vector_marks.map_or(opening.marks, |Marks(marks)| marks),
            design: self.vector_design.unwrap_or(opening.design),
            foreshortening: self.vector_foreshortening.unwrap_or(opening.foreshortening),
            stretch: self.vector_stretch.unwrap_or(opening.stretch),
            extent: self.vector_extent.or(opening.extent),
            coarser: self.vector_coarser.unwrap_or(opening.coarser),
            seed: self.seed,
        }
    }

    /// The first flag that was given and changes nothing without vectors.
    fn given(&self) -> Option<&'static str> {
        [
            ("--vector-mode", self.vector_mode.is_some()),
            ("--vector-opacity", self.vector_opacity.is_some()),
            ("--vector-opacity-by", self.vector_opacity_by.is_some()),
            ("--vector-colormap", self.vector_colormap.is_some()),
            ("--vector-color-range", self.vector_color_range.is_some()),
            ("--vector-color-by", self.vector_color_by.is_some()),
            ("--vector-color", self.vector_color.is_some()),
            ("--vector-marks", self.vector_marks.is_some()),
            ("--vector-stretch", self.vector_stretch.is_some()),
            ("--vector-extent", self.vector_extent.is_some()),
            ("--vector-coarser", self.vector_coarser.is_some()),
            ("--vector-design", self.vector_design.is_some()),
            ("--vector-foreshortening", self.vector_foreshortening.is_some()),
            ("--phase", self.phase != 0.0),
            ("--loop", self.cycle.is_some()),
        ]
        .into_iter()
        .find_map(|(flag, given)| given.then_some(flag))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_a_colour_or_mapped() {
        assert_eq!(marks("mapped"), Ok(Marks(None)));
        assert_eq!(marks("ff8000"), Ok(Marks(Some(Srgb8([255, 128, 0])))));
        let refused = marks("white").unwrap_err();
        assert!(refused.contains("found") && refused.contains("mapped"), "{refused}");
    }
}
