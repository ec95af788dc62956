//! What the splats of a vector field look like, as flags.

use clap::Args;

use super::values::{self, List, Points};
use crate::core::Srgb8;
use crate::transfer::{ColourMap, ColourSource};
use crate::vector::{ColourBy, Design, Foreshortening, VectorMode, VectorSettings};

/// What splats look like, as far as that was said.
#[derive(Debug, Clone, Default, PartialEq, Args)]
#[command(next_help_heading = "Vectors")]
pub struct LookFlags {
    /// How marks meet the colour of a splat: modulate (the marks alone) or blend (matter with marks in
    /// it) [default: modulate]
    #[arg(long, value_name = "MODE", value_parser = values::vector_mode)]
    pub vector_mode: Option<VectorMode>,
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
    #[arg(long, value_name = "LO,HI", value_parser = values::unequal, allow_hyphen_values = true)]
    pub vector_color_range: Option<[f64; 2]>,
    /// What colours are by: magnitude, x, y, z or scalar
    #[arg(long, value_name = "BY", value_parser = values::colour_by)]
    pub vector_color_by: Option<ColourBy>,
    /// One colour for all vectors: of all marks with modulate, of the matter with blend
    #[arg(long, value_name = "RRGGBB", value_parser = values::colour)]
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
    #[arg(long, value_name = "N", value_parser = values::halvings, allow_hyphen_values = true)]
    pub vector_coarser: Option<u32>,
    /// What the marks look like: streaks, dots or comets [default: streaks]
    #[arg(long, value_name = "NAME", value_parser = values::design)]
    pub vector_design: Option<Design>,
    /// How vectors towards the eye are shown: table, polygon or coordinates [default: table]
    #[arg(long, value_name = "WAY", value_parser = values::foreshortening)]
    pub vector_foreshortening: Option<Foreshortening>,
    /// Another whole number from 0 shuffles the marks, which do not move in step [default: 0]; of accuracy, it
    /// says which pixels are compared, too [default: 1]
    #[arg(long, value_name = "N", value_parser = values::count, allow_hyphen_values = true)]
    pub seed: Option<u64>,
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

/// What is said of a second field by name, as the flags of the first after their `--vector-`.
const NAMES: &str = "mode, opacity, opacity-by, colormap, color-range, color-by, color, marks, stretch, \
                     extent, coarser, design, foreshortening or seed";

/// One thing that is said of a second field's look.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    name: String,
    value: String,
}

/// # Errors
/// A name that means nothing, or a value that it does not take.
pub(super) fn said(text: &str) -> Result<Said, String> {
    let Some((name, value)) = text.split_once('=') else {
        return Err(format!(
            "expected a name and a value such as mode=blend, found {}",
            values::found(text)
        ));
    };
    LookFlags::default().set(name, value)?;
    Ok(Said { name: name.to_owned(), value: value.to_owned() })
}

impl LookFlags {
    /// The look that is said one by one.
    ///
    /// # Errors
    /// The same thing said twice.
    pub(super) fn of(said: &[Said]) -> Result<Self, String> {
        let mut look = Self::default();
        for (i, Said { name, value }) in said.iter().enumerate() {
            if said[..i].iter().any(|before| before.name == *name) {
                return Err(format!(
                    "expected --second-look {name} once, found it again; leave one of the two out"
                ));
            }
            look.set(name, value)?;
        }
        Ok(look)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        match name {
            "mode" => self.vector_mode = Some(values::vector_mode(value)?),
            "opacity" => self.vector_opacity = Some(values::opacity(value)?),
            "opacity-by" => self.vector_opacity_by = Some(values::colour_by(value)?),
            "colormap" => self.vector_colormap = Some(values::colour_map(value)?),
            "color-range" => self.vector_color_range = Some(values::unequal(value)?),
            "color-by" => self.vector_color_by = Some(values::colour_by(value)?),
            "color" => self.vector_color = Some(values::colour(value)?),
            "marks" => self.vector_marks = Some(marks(value)?),
            "stretch" => self.vector_stretch = Some(values::positive(value)?),
            "extent" => self.vector_extent = Some(values::positive(value)?),
            "coarser" => self.vector_coarser = Some(values::halvings(value)?),
            "design" => self.vector_design = Some(values::design(value)?),
            "foreshortening" => self.vector_foreshortening = Some(values::foreshortening(value)?),
            "seed" => self.seed = Some(values::count(value)?),
            _ => return Err(format!("expected {NAMES}, found {}", values::found(name))),
        }
        Ok(())
    }

    /// What is said, on top of what the field opens with. `range_of` tells what there is of what colours
    /// may be by, and `called` how a flag was called.
    ///
    /// # Errors
    /// What changes nothing.
    pub(super) fn settings(
        &self,
        opening: &VectorSettings,
        range_of: impl Fn(ColourBy) -> [f64; 2],
        called: impl Fn(&str) -> String,
    ) -> Result<VectorSettings, String> {
        let mode = self.vector_mode.unwrap_or(opening.mode);
        if mode == VectorMode::Modulate && self.vector_marks.is_some() {
            return Err(format!(
                "expected {} with {}, as modulate has no colour of marks, found modulate; add {}, or say \
                 their colour with {}",
                called("mode blend"),
                called("marks"),
                called("mode blend"),
                called("color"),
            ));
        }
        if self.vector_color.is_some() {
            let mapped = [
                ("colormap", self.vector_colormap.is_some()),
                ("color-range", self.vector_color_range.is_some()),
                ("color-by", self.vector_color_by.is_some()),
            ];
            if let Some((other, _)) = mapped.into_iter().find(|(_, given)| *given) {
                return Err(format!(
                    "expected one colour or a map of them, found {} and {}; leave one of the two out",
                    called("color"),
                    called(other)
                ));
            }
        }
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
                None => range_of(colour_by),
            };
        }
        if let Some(colour) = self.vector_color {
            transfer.colour = ColourSource::Stops(vec![(0.0, colour)]);
        }
        let settings = VectorSettings {
            mode,
            opacity_by: self.vector_opacity_by.unwrap_or(opening.opacity_by),
            colour_by,
            transfer,
            marks: self.vector_marks.map_or(opening.marks, |Marks(marks)| marks),
            design: self.vector_design.unwrap_or(opening.design),
            foreshortening: self.vector_foreshortening.unwrap_or(opening.foreshortening),
            stretch: self.vector_stretch.unwrap_or(opening.stretch),
            extent: self.vector_extent.or(opening.extent),
            coarser: self.vector_coarser.unwrap_or(opening.coarser),
            seed: self.seed.unwrap_or(opening.seed),
        };
        settings.check().map_err(|error| error.to_string())?;
        Ok(settings)
    }

    /// The first flag that was given and changes nothing without vectors.
    pub(super) fn given(&self) -> Option<&'static str> {
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
            ("--seed", self.seed.is_some()),
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
        let refused = marks("whitish").unwrap_err();
        assert!(refused.contains("found") && refused.contains("mapped"), "{refused}");
    }

    #[test]
    fn a_second_look_is_said_by_name_each_once() {
        let names = NAMES.replace(" or ", ", ");
        for name in names.split(", ") {
            let found = said(&format!("{name}=@")).unwrap_err();
            assert!(!found.contains("foreshortening or seed"), "{name} is not known: {found}");
        }
        let all: Vec<Said> =
            ["mode=blend", "opacity=0:0,5:1", "seed=7"].map(|text| said(text).unwrap()).into();
        let look = LookFlags::of(&all).unwrap();
        assert_eq!((look.vector_mode, look.seed), (Some(VectorMode::Blend), Some(7)));
        assert_eq!(look.vector_opacity, Some(List(vec![(0.0, 0.0), (5.0, 1.0)])));
        let twice = [all[0].clone(), all[0].clone()];
        assert!(LookFlags::of(&twice).unwrap_err().contains("once"));
        for refused in ["blend", "modes=blend", "mode=mixed", "seed=-1", "color-range=3,3"] {
            let message = said(refused).unwrap_err();
            assert!(message.contains("expected") && message.contains("found"), "{message}");
        }
    }
}
