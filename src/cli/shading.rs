//! Flags of lights and shading tables.

use clap::Args;
use glam::DVec3;

use super::Failure;
use super::values::{self, List, Stop};
use crate::core::{Srgb8, plain_number};
use crate::scene::{
    Amounts, Attached, Colours, Index, Light, Lighting, Scene, Shading, ShadingError,
    ShadingPreset, SplatSettings,
};

/// How it is lit, and what opacities and colours are looked up by beside the value.
#[derive(Debug, Args)]
#[command(next_help_heading = "Shading")]
pub struct ShadingFlags {
    /// Begin with none, lights, cloud, surface, depth-cue or gradient-colour; the flags below change it
    /// [default: none, but where no flag of this section and none of --opacity, --color and --transfer is
    /// given, the light of the first look, if the values have faces that light makes visible: steep, and
    /// no noise]
    #[arg(long, value_name = "NAME", value_parser = shading_choice)]
    pub shading: Option<ShadingChoice>,
    /// A light, towards which X,Y,Z points: right, up and to the eye, or with :data in the world;
    /// white, unless a colour is given. May be given several times
    #[arg(long, value_name = "X,Y,Z[:RRGGBB][:data]", value_parser = light,
        allow_hyphen_values = true)]
    pub light: Vec<Light>,
    /// Share of the colours that is seen without light, 0 to 1 [default: 0.25, with lights]
    #[arg(long, value_name = "A", value_parser = values::share, allow_hyphen_values = true)]
    pub ambient: Option<f64>,
    /// Share that scatters light evenly, 0 to 1 [default: 0.85, with lights]
    #[arg(long, value_name = "D", value_parser = values::share, allow_hyphen_values = true)]
    pub diffuse: Option<f64>,
    /// Share of the light that is mirrored, 0 to 1 [default: 0.2, with lights]
    #[arg(long, value_name = "S", value_parser = values::share, allow_hyphen_values = true)]
    pub specular: Option<f64>,
    /// How narrowly it is mirrored: the exponent, 0 to 1000 [default: 20, with lights]
    #[arg(long, value_name = "N", value_parser = values::exponent, allow_hyphen_values = true)]
    pub specular_power: Option<f64>,
    /// Opacities looked up by another quantity, in place of --opacity: value, gradient-strength (data units
    /// per world unit), gradient-elevation or gradient-azimuth (degrees), view-depth (0 to 1)
    #[arg(long, value_name = "INDEX:I:A,…", value_parser = amounts, allow_hyphen_values = true,
        conflicts_with = "opacity")]
    pub opacity_by: Option<Amounts>,
    /// Multiply the density of matter by a factor from 0 to 1, looked up by one of these quantities
    #[arg(long, value_name = "INDEX:I:A,…", value_parser = amounts, allow_hyphen_values = true)]
    pub modulation: Option<Amounts>,
    /// Colours looked up by one of these quantities, in place of --color and --colormap
    #[arg(long, value_name = "INDEX:I:RRGGBB,…", value_parser = colours,
        allow_hyphen_values = true, conflicts_with_all = ["color", "colormap", "color_range"])]
    pub reflection: Option<Colours>,
    /// Light that matter gives off by itself, looked up by one of these quantities
    #[arg(long, value_name = "INDEX:I:RRGGBB,…", value_parser = colours,
        allow_hyphen_values = true)]
    pub emission: Option<Colours>,
}

/// What to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadingChoice {
    /// No lights and no tables, whatever the first look would have.
    None,
    /// A preset.
    Preset(ShadingPreset),
}

fn shading_choice(text: &str) -> Result<ShadingChoice, String> {
    match text {
        "none" => Ok(ShadingChoice::None),
        text => match values::shading_preset(text) {
            Ok(preset) => Ok(ShadingChoice::Preset(preset)),
            Err(refused) => Err(refused.replacen("expected one of ", "expected one of none, ", 1)),
        },
    }
}

impl ShadingFlags {
    /// Refuses lights together with `--shading none`, which puts them out.
    pub(super) fn refuse_lights_put_out(&self) -> Result<(), Failure> {
        let lights = ["--light", "--ambient", "--diffuse", "--specular", "--specular-power"];
        let given = self.given().into_iter().find(|flag| lights.contains(flag));
        match (self.shading, given) {
            (Some(ShadingChoice::None), Some(flag)) => Err(Failure::Usage(format!(
                "expected --shading none by itself, as it puts the lights out, found {flag}; leave one of the two out"
            ))),
            _ => Ok(()),
        }
    }

    /// The flags that were given.
    pub(super) fn given(&self) -> Vec<&'static str> {
        let given = [
            ("--shading", self.shading.is_some()),
            ("--light", !self.light.is_empty()),
            ("--ambient", self.ambient.is_some()),
            ("--diffuse", self.diffuse.is_some()),
            ("--specular", self.specular.is_some()),
            ("--specular-power", self.specular_power.is_some()),
            ("--opacity-by", self.opacity_by.is_some()),
            ("--modulation", self.modulation.is_some()),
            ("--reflection", self.reflection.is_some()),
            ("--emission", self.emission.is_some()),
        ];
        given.into_iter().filter_map(|(flag, given)| given.then_some(flag)).collect()
    }

    /// The shading that they mean for a scene, whose regions stay; where none was given its light, too, if the mode shows
    /// any.
    ///
    /// # Errors
    /// Where a mode cannot be shaded, or a table means nothing.
    pub fn resolve(&self, scene: &Scene, splat: &SplatSettings) -> Result<Shading, ShadingError> {
        if self.given().is_empty() && scene.shading.check(splat).is_ok() {
            return Ok(scene.shading.clone());
        }
        let preset = self.shading.zip(scene.volume()).and_then(|(choice, volume)| match choice {
            ShadingChoice::None => None,
            ShadingChoice::Preset(preset) => Some(preset.shading(volume)),
        });
        // The regions are the transfer function's.
        let mut shading =
            Shading { regions: scene.shading.regions.clone(), ..preset.unwrap_or_default() };
        let Self { ambient, diffuse, specular, specular_power, .. } = *self;
        let shares = [ambient, diffuse, specular, specular_power];
        if !self.light.is_empty() || shares.iter().any(Option::is_some) {
            let lighting = shading.lighting.get_or_insert_with(Lighting::default);
            if !self.light.is_empty() {
                lighting.lights.clone_from(&self.light);
            }
            let Lighting { ambient, diffuse, specular, exponent, .. } = lighting;
            for (share, given) in [ambient, diffuse, specular, exponent].into_iter().zip(shares) {
                *share = given.unwrap_or(*share);
            }
        }
        take_given(&mut shading.opacity, &self.opacity_by);
        take_given(&mut shading.modulation, &self.modulation);
        take_given(&mut shading.reflection, &self.reflection);
        take_given(&mut shading.emission, &self.emission);
        shading.check(splat)?;
        Ok(shading)
    }
}

/// Puts what was given, if it was, in the place of what there is.
fn take_given<T: Clone>(there: &mut Option<T>, given: &Option<T>) {
    if given.is_some() {
        there.clone_from(given);
    }
}

/// The index that a table's text begins with, and the rest.
fn index(text: &str) -> Result<(Index, &str), String> {
    let (name, rest) = text.split_once(':').unwrap_or((text, ""));
    Ok((values::index(name)?, rest))
}

/// The points that follow the index, if there are any.
fn points<'a>(text: &str, rest: &'a str, expected: &str) -> Result<&'a str, String> {
    if rest.contains(':') {
        return Ok(rest);
    }
    Err(format!("expected {expected}, found {}", values::found(text)))
}

/// Refuses places along an index that nothing in any picture has.
fn check_reach<T>(index: Index, points: &[(f64, T)]) -> Result<(), String> {
    let (range, words) = match index {
        Index::Value => return Ok(()),
        Index::GradientStrength => (0.0..=f64::INFINITY, "of at least 0"),
        Index::GradientElevation => (-90.0..=90.0, "from -90 to 90"),
        Index::GradientAzimuth => (-180.0..=180.0, "from -180 to 180"),
        Index::ViewDepth => (0.0..=1.0, "from 0 to 1"),
    };
    match points.iter().find(|(at, _)| !range.contains(at)) {
        Some((found, _)) => Err(format!(
            "expected {} {words}, found {}; give its table points that lie there",
            index.name(),
            plain_number(*found)
        )),
        None => Ok(()),
    }
}

fn amounts(text: &str) -> Result<Amounts, String> {
    let (index, rest) = index(text)?;
    let rest = points(text, rest, "an index and points I:A such as value:0:0,100:0.5")?;
    let List(points) = values::opacity(rest)?;
    check_reach(index, &points)?;
    Ok(Amounts { index, points })
}

fn colours(text: &str) -> Result<Colours, String> {
    let (index, rest) = index(text)?;
    let rest = points(text, rest, "an index and stops I:RRGGBB such as value:0:000000,100:ff8000")?;
    let List(stops): List<Stop> = values::colours(rest)?;
    check_reach(index, &stops)?;
    Ok(Colours { index, stops })
}

fn light(text: &str) -> Result<Light, String> {
    let mut parts = text.split(':');
    let direction = DVec3::from(values::direction(parts.next().unwrap_or_default())?);
    let (mut colour, mut attached) = (None, None);
    for part in parts {
        let is_first = match part {
            "data" => attached.replace(Attached::Data).is_none(),
            "camera" => attached.replace(Attached::Camera).is_none(),
            text => colour.replace(values::colour(text)?).is_none(),
        };
        if !is_first {
            return Err(format!(
                "expected one colour, and one of data and camera, found two in {}; leave one out",
                values::found(text)
            ));
        }
    }
    Ok(Light {
        direction,
        colour: colour.unwrap_or(Srgb8([255; 3])),
        attached: attached.unwrap_or(Attached::Camera),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_and_tables_are_read_as_they_are_written() {
        let one = light("1,-2,0.5:ff8000:data").unwrap();
        assert_eq!(one.direction, DVec3::new(1.0, -2.0, 0.5));
        assert_eq!((one.colour, one.attached), (Srgb8([255, 128, 0]), Attached::Data));
        assert_eq!(light("0,0,1").unwrap().attached, Attached::Camera);
        let table = amounts("gradient-strength:0:0,12.5:1").unwrap();
        assert_eq!(table.index, Index::GradientStrength);
        assert_eq!(table.points, [(0.0, 0.0), (12.5, 1.0)]);
        let table = colours("view-depth:0:ffffff,1:000040").unwrap();
        assert_eq!(table.stops[1], (1.0, Srgb8([0, 0, 64])));
        for ends in ["value:-5:0", "gradient-elevation:-90:0,90:1", "gradient-azimuth:-180:0,180:1"]
        {
            assert!(amounts(ends).is_ok(), "{ends}");
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_what_was_found() {
        for refused in [
            light("0,0,0").unwrap_err(),
            light("1,2").unwrap_err(),
            light("0,0,1:green").unwrap_err(),
            light("0,0,1:ff0000:00ff00").unwrap_err(),
            light("0,0,1:data:camera").unwrap_err(),
            amounts("gradient:0:1").unwrap_err(),
            amounts("view-depth").unwrap_err(),
            amounts("view-depth:0:1.5").unwrap_err(),
            amounts("view-depth:-5:1").unwrap_err(),
            amounts("view-depth:0:1,1.5:0").unwrap_err(),
            amounts("gradient-strength:-1:0,1:1").unwrap_err(),
            colours("gradient-azimuth:0:ffffff,360:000000").unwrap_err(),
            colours("gradient-elevation:-91:ffffff").unwrap_err(),
            amounts("value:5:0.1,2:0.3").unwrap_err(),
            colours("value:1").unwrap_err(),
        ] {
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
        for text in ["value", "value:", "value:1"] {
            let refused = amounts(text).unwrap_err();
            let words = format!("such as value:0:0,100:0.5, found {text:?}");
            assert!(refused.ends_with(&words), "{refused}");
            assert!(colours(text).unwrap_err().contains("value:0:000000,100:ff8000"), "{text}");
        }
    }
}
