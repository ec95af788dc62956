//! Flags of streamlines and arrows: polygons made of vectors.

use std::sync::Arc;

use clap::Args;

use super::{Failure, values};
use crate::core::Ticket;
use crate::scene::{PolygonLayer, VectorLayer};
use crate::vector::{self, Following};
use crate::volume::Places;

/// More lines than anybody can tell apart.
const MOST_STREAMLINES: usize = 100_000;

/// Streamlines and arrows of the vectors.
#[derive(Debug, Args)]
#[command(next_help_heading = "Streamlines and arrows")]
pub struct FlowFlags {
    /// Draw tubes along about N streamlines of the vectors, in the colours of their lengths. They are
    /// seeded evenly on the plane across an axis of the vectors' grid, V% along it [default: z=50%]; the
    /// tubes' radius and the longest way to either side are in steps of that grid [defaults: 0.15, 200]
    #[arg(long, value_name = "N[,x|y|z=V%][,radius=R][,length=L]", value_parser = streamlines)]
    pub streamlines: Option<Streamlines>,
    /// Draw an arrow at every Nth of the vectors along each axis, in the colour of its length; the longest
    /// is S times as long as these are apart [default: 0.9]
    #[arg(long, value_name = "N[,size=S]", value_parser = arrows)]
    pub arrows: Option<Arrows>,
    /// Draw the streamlines or arrows without the vectors' splats
    #[arg(long)]
    pub no_vector_splats: bool,
}

/// Streamlines that were asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Streamlines {
    count: usize,
    axis: usize,
    share: f64,
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
    /// What they make of vectors; those are left without splats where that was asked for.
    ///
    /// # Errors
    /// No vectors, or none that any could be made of.
    pub(super) fn layers(
        &self,
        vectors: &mut Option<VectorLayer>,
    ) -> Result<Vec<PolygonLayer>, Failure> {
        if self.no_vector_splats && self.streamlines.is_none() && self.arrows.is_none() {
            return Err(Failure::Usage(
                "expected --streamlines or --arrows with --no-vector-splats, found neither; leave all three \
                 out, and --vector too, to draw the field alone"
                    .to_owned(),
            ));
        }
        let asked = [
            (self.streamlines.is_some(), "--streamlines"),
            (self.arrows.is_some(), "--arrows"),
            (self.no_vector_splats, "--no-vector-splats"),
        ];
        let Some((_, flag)) = asked.into_iter().find(|(is_asked, _)| *is_asked) else {
            return Ok(Vec::new());
        };
        let Some(layer) = vectors else {
            return Err(Failure::Usage(format!(
                "expected vectors with {flag}, found none; name a field of three components with --vector, \
                 which `voxsplat info` tells"
            )));
        };
        let (field, transfer) = (&layer.field, &layer.settings.transfer);
        let ticket = Ticket::new();
        let mut found = Vec::new();
        if let Some(Streamlines { count, axis, share, radius, length }) = self.streamlines {
            let Places::Lattice(lattice) = field.places else {
                return Err(Failure::failed(vector::StreamlineError::Uneven));
            };
            let seeds = vector::seeds_on_plane(&lattice, axis, share, count);
            let how = Following { most_length: length, ..Following::default() };
            let lines = vector::streamlines(field, &seeds, &how, &ticket);
            let lines = lines.map_err(Failure::failed)?;
            let radius = radius * lattice.smallest_spacing();
            found.push(vector::tubes(&lines, transfer, radius).map_err(Failure::failed)?);
        }
        if let Some(Arrows { every, size }) = self.arrows {
            let arrows = vector::arrows(field, transfer, every, size, &ticket);
            found.push(arrows.map_err(Failure::failed)?);
        }
        if self.no_vector_splats {
            match layer.alone {
                // Still in place of the field.
                true => layer.settings.transfer.opacity = vec![(0.0, 0.0)],
                false => *vectors = None,
            }
        }
        Ok(found.into_iter().map(|mesh| PolygonLayer::new(Arc::new(mesh))).collect())
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
    Ok((count, named.collect::<Result<_, _>>()?))
}

fn unknown(name: &str, names: &str) -> String {
    format!("expected {names}, found {}", values::found(name))
}

fn streamlines(text: &str) -> Result<Streamlines, String> {
    let (count, named) = parts(text)?;
    if count > MOST_STREAMLINES {
        return Err(format!("expected at most {MOST_STREAMLINES} streamlines, found {count}"));
    }
    let mut asked = Streamlines { count, axis: 2, share: 0.5, radius: 0.15, length: 200.0 };
    for (name, value) in named {
        match name {
            "radius" => asked.radius = values::positive(value)?,
            "length" => asked.length = values::positive(value)?,
            _ => {
                let axis = ["x", "y", "z"].iter().position(|axis| *axis == name);
                asked.axis = axis.ok_or_else(|| unknown(name, "x, y, z, radius or length"))?;
                let percent = value.strip_suffix('%').unwrap_or(value);
                let share = values::number(percent)? / 100.0;
                if !(0.0..=1.0).contains(&share) {
                    return Err(format!(
                        "expected a place from 0% to 100%, found {}",
                        values::found(value)
                    ));
                }
                asked.share = share;
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
            "size" => asked.size = values::positive(value)?,
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
        let plain = Streamlines { count: 30, axis: 2, share: 0.5, radius: 0.15, length: 200.0 };
        assert_eq!(streamlines("30"), Ok(plain));
        let said = Streamlines { axis: 0, share: 0.2, radius: 0.3, length: 40.0, ..plain };
        assert_eq!(streamlines("30,radius=0.3,x=20%,length=40"), Ok(said));
        assert_eq!(arrows("4,size=2"), Ok(Arrows { every: 4, size: 2.0 }));
        for refused in [
            streamlines("0").unwrap_err(),
            streamlines("9,w=3").unwrap_err(),
            streamlines("9,x=130%").unwrap_err(),
            streamlines("9,radius=0").unwrap_err(),
            streamlines("9,30").unwrap_err(),
            arrows("2,length=3").unwrap_err(),
            arrows("").unwrap_err(),
        ] {
            assert!(refused.contains("expected") && refused.contains("found"), "{refused}");
        }
    }
}
