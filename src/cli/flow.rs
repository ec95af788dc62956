//! Flags of streamlines and arrows: polygons made of vectors.

use std::sync::Arc;

use clap::Args;
use glam::DVec3;

use super::progress::Progress;
use super::vectors::Vectors;
use super::{Failure, values};
use crate::core::Ticket;
use crate::scene::{PolygonLayer, SampleSource};
use crate::vector::{self, Following, MOST_ARROW_SIZE, Seeds};

/// More lines than anybody can tell apart.
const MOST_STREAMLINES: usize = 100_000;

/// Streamlines and arrows of the vectors.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Streamlines and arrows")]
pub struct FlowFlags {
    /// Draw tubes along about N streamlines of the vectors, in the colours of their lengths, among splats by another map. They are
    /// seeded at vectors, the more the longer these are, or evenly on the plane across an axis of the vectors' grid, V% along it;
    /// the tubes' radius and the longest way to either side are in steps of that grid [defaults: 0.25, 200]
    #[arg(long, value_name = "N[,x|y|z=V%][,radius=R][,length=L]", value_parser = streamlines)]
    pub streamlines: Option<Streamlines>,
    /// Seed the streamlines at a world point and within a step of the grid about it, or evenly on the line
    /// from one point to another, instead of on a plane
    #[arg(long, value_name = "X,Y,Z[,X,Y,Z]", value_parser = ends, allow_hyphen_values = true)]
    pub streamline_seeds: Option<Ends>,
    /// Draw an arrow at every Nth of the vectors along each axis, in the colour of its length; the longest
    /// is S times as long as these are apart, at most 100 [default: 0.9]
    #[arg(long, value_name = "N[,size=S]", value_parser = arrows)]
    pub arrows: Option<Arrows>,
    /// Draw the streamlines or arrows without the vectors' splats
    #[arg(long)]
    pub no_vector_splats: bool,
}

/// A world point, or two that a line goes between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    first: DVec3,
    last: Option<DVec3>,
}

fn ends(text: &str) -> Result<Ends, String> {
    match text.split(',').count() {
        6 => {
            let [a, b, c, d, e, f] = values::numbers(text, "six numbers X,Y,Z,X,Y,Z")?;
            Ok(Ends { first: DVec3::new(a, b, c), last: Some(DVec3::new(d, e, f)) })
        }
        _ => {
            let point = values::numbers(text, "one point X,Y,Z or two X,Y,Z,X,Y,Z")?;
            Ok(Ends { first: DVec3::from(point), last: None })
        }
    }
}

/// Streamlines that were asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Streamlines {
    count: usize,
    /// The axis across which the plane of the seeds lies, and where along it.
    plane: Option<(usize, f64)>,
    radius: f64,
    length: f64,
}

/// Arrows that were asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrows {
    every: usize,
    size: f64,
}

impl FlowFlags {
    /// The first flag that was given and asks for polygons.
    pub(super) fn given(&self) -> Option<&'static str> {
        let streamlines = self.streamlines.is_some().then_some("--streamlines");
        streamlines.or(self.arrows.is_some().then_some("--arrows"))
    }

    /// What they make of vectors; those are left without splats where that was asked for.
    ///
    /// # Errors
    /// No vectors, or none that any could be made of.
    pub(super) fn layers(
        &self,
        vectors: &mut Option<Vectors>,
    ) -> Result<Vec<(SampleSource, PolygonLayer)>, Failure> {
        if self.no_vector_splats && self.streamlines.is_none() && self.arrows.is_none() {
            return Err(Failure::Usage(
                "expected --streamlines or --arrows with --no-vector-splats, found neither; leave all three \
                 out, and --vector too, to draw the field alone"
                    .to_owned(),
            ));
        }
        if self.streamline_seeds.is_some() && self.streamlines.is_none_or(|s| s.plane.is_some()) {
            let found = match self.streamlines {
                Some(_) => "a plane, too",
                None => "no --streamlines",
            };
            return Err(Failure::Usage(format!(
                "expected --streamlines N with --streamline-seeds, found {found}; say how many, and seed them \
                 in one way"
            )));
        }
        let asked = [
            (self.streamlines.is_some(), "--streamlines"),
            (self.arrows.is_some(), "--arrows"),
            (self.no_vector_splats, "--no-vector-splats"),
        ];
        let Some((_, flag)) = asked.into_iter().find(|(is_asked, _)| *is_asked) else {
            return Ok(Vec::new());
        };
        let Some(Vectors { layers, alone, .. }) = vectors else {
            return Err(Failure::Usage(format!(
                "expected vectors with {flag}, found none; name a field of three components with --vector, \
                 where `voxsplat info` tells of one, or leave {flag} out"
            )));
        };
        if self.no_vector_splats && layers.len() > 1 {
            return Err(Failure::Usage(
                "expected --second-vector with splats, which is all that is drawn of it, found \
                 --no-vector-splats; leave one of the two out"
                    .to_owned(),
            ));
        }
        let Some((_, layer)) = layers.first_mut() else { return Ok(Vec::new()) };
        let (field, transfer) = (&layer.field, &layer.settings.transfer);
        let ticket = Ticket::new();
        let mut found = Vec::new();
        if let Some(Streamlines { count, plane, radius, length }) = self.streamlines {
            let step = vector::typical_step(&field.places);
            let seeds = match self.streamline_seeds {
                Some(Ends { first, last: Some(last) }) => {
                    Seeds::At(vector::seeds_on_line(first, last, count))
                }
                Some(Ends { first, last: None }) => {
                    Seeds::At(vector::seeds_about(first, step, count))
                }
                None => match plane {
                    Some((axis, share)) => Seeds::OnPlane { axis, share, count },
                    None => Seeds::At(vector::seeds_at_vectors(field, count)),
                },
            };
            let how = Following { most_length: length, ..Following::default() };
            let progress = Progress::of(&ticket, "following streamlines");
            let lines = vector::streamlines(field, &seeds, &how, &ticket);
            drop(progress);
            let lines = lines.map_err(Failure::failed)?;
            let radius = radius * step;
            let colours = match self.no_vector_splats {
                true => transfer.clone(),
                false => layer.colours_of_lines(),
            };
            let tubes = vector::tubes(&lines, &colours, radius).map_err(Failure::failed)?;
            found.push(PolygonLayer::of_vectors(Arc::new(tubes), &colours.colour));
        }
        if let Some(Arrows { every, size }) = self.arrows {
            let arrows = vector::arrows(field, transfer, every, size, &ticket);
            let arrows = Arc::new(arrows.map_err(Failure::failed)?);
            found.push(PolygonLayer::of_vectors(arrows, &transfer.colour));
        }
        if self.no_vector_splats {
            match *alone {
                // Still in place of the field.
                true => layer.settings.transfer.opacity = vec![(0.0, 0.0)],
                false => *vectors = None,
            }
        }
        let of = |layer: PolygonLayer| (SampleSource::made(layer.mesh.name()), layer);
        Ok(found.into_iter().map(of).collect())
    }
}

/// Names and their values.
type Named<'a> = Vec<(&'a str, &'a str)>;

/// A count, and after it what is said by name.
fn parts(text: &str) -> Result<(usize, Named<'_>), String> {
    let mut parts = text.split(',');
    let count = values::pixels(parts.next().unwrap_or_default())? as usize;
    let named = parts.map(|part| {
        part.split_once('=')
            .ok_or_else(|| format!("expected a name and a value, found {}", values::found(part)))
    });
    let named: Named<'_> = named.collect::<Result<_, _>>()?;
    let twin = named.iter().enumerate().find(|(i, one)| named[..*i].iter().any(|at| at.0 == one.0));
    match twin {
        Some((_, (name, _))) => {
            Err(format!("expected {name}= once, found it twice; leave one of the two out"))
        }
        None => Ok((count, named)),
    }
}

fn unknown(name: &str, names: &str) -> String {
    format!("expected {names}, found {}", values::found(name))
}

fn streamlines(text: &str) -> Result<Streamlines, String> {
    let (count, named) = parts(text)?;
    if count > MOST_STREAMLINES {
        return Err(format!("expected at most {MOST_STREAMLINES} streamlines, found {count}"));
    }
    let mut asked = Streamlines { count, plane: None, radius: 0.25, length: 200.0 };
    for (name, value) in named {
        match name {
            "radius" => asked.radius = values::positive(value)?,
            "length" => asked.length = values::positive(value)?,
            _ => {
                let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
                let axis = axis.ok_or_else(|| unknown(name, "x, y, z, radius or length"))?;
                let percent = value.strip_suffix('%').unwrap_or(value);
                let share = values::number(percent)? / 100.0;
                if !(0.0..=1.0).contains(&share) {
                    return Err(format!(
                        "expected a place from 0% to 100%, found {}",
                        values::found(value)
                    ));
                }
                if asked.plane.is_some() {
                    return Err(
                        "expected one plane of seeds, found two; leave one of them out".to_owned()
                    );
                }
                asked.plane = Some((axis, share));
            }
        }
    }
    Ok(asked)
}

fn arrows(text: &str) -> Result<Arrows, String> {
    let (every, named) = parts(text)?;
    let mut asked = Arrows { every, size: 0.9 };
    for (name, value) in named {
        match name {
            "size" => match values::positive(value)? {
                size if size <= MOST_ARROW_SIZE => asked.size = size,
                _ => {
                    return Err(format!(
                        "expected a size of arrows of at most {MOST_ARROW_SIZE}, found {}",
                        values::found(value)
                    ));
                }
            },
            _ => return Err(unknown(name, "size")),
        }
    }
    Ok(asked)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streamlines_and_arrows_are_a_count_and_what_is_said_of_them() {
        let plain = Streamlines { count: 30, plane: None, radius: 0.25, length: 200.0 };
        assert_eq!(streamlines("30"), Ok(plain));
        let plane = Some((0, 0.2));
        let said = Streamlines { plane, radius: 0.3, length: 40.0, ..plain };
        assert_eq!(streamlines("30,radius=0.3,x=20%,length=40"), Ok(said));
        assert_eq!(arrows("4,size=2"), Ok(Arrows { every: 4, size: 2.0 }));
        let point = Ends { first: DVec3::new(1.0, -2.0, 3.0), last: None };
        assert_eq!(ends("1,-2,3"), Ok(point));
        assert_eq!(
            ends("1,-2,3,4,5,6"),
            Ok(Ends { last: Some(DVec3::new(4.0, 5.0, 6.0)), ..point })
        );
        for refused in [
            streamlines("0").unwrap_err(),
            streamlines("9,w=3").unwrap_err(),
            streamlines("9,x=130%").unwrap_err(),
            streamlines("9,radius=0").unwrap_err(),
            streamlines("9,30").unwrap_err(),
            streamlines("9,radius=1,radius=2").unwrap_err(),
            streamlines("9,x=1%,y=2%").unwrap_err(),
            arrows("1,size=1,size=2").unwrap_err(),
            arrows("2,length=3").unwrap_err(),
            arrows("1,size=1e9").unwrap_err(),
            ends("1,2").unwrap_err(),
            ends("1,2,3,4").unwrap_err(),
            ends("1,2,3,4,5,x").unwrap_err(),
            arrows("").unwrap_err(),
        ] {
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }
}
