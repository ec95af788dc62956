//! Vectors as polygons: tubes about streamlines, and arrows.

use crate::core::colour::srgb_from_linear;
use crate::core::{Cancelled, Srgb8, Ticket};
use crate::polygons::{Mesh, MeshError, Paint, Shapes};
use crate::transfer::TransferFunction;
use crate::volume::{Places, VectorField};

use super::Streamline;

/// Arrows at most: some five hundred million bytes of triangles.
pub const MOST_ARROWS: usize = 100_000;
/// How many times as long as arrows are apart the longest may be: beyond, they would hide everything.
pub const MOST_ARROW_SIZE: f64 = 100.0;

/// What makes no polygons of vectors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GlyphError {
    /// Nothing that could be drawn.
    #[error("expected {what}, found none; {advice}")]
    None {
        /// Of what there is none.
        what: &'static str,
        /// What to try.
        advice: &'static str,
    },
    /// More than anybody could tell apart.
    #[error("expected at most {MOST_ARROWS} arrows, found {found}; draw fewer of the vectors")]
    TooMany {
        /// How many.
        found: usize,
    },
    /// Beyond 32-bit floats.
    #[error(transparent)]
    Mesh(MeshError),
    /// See [`Cancelled`].
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The numbers on shapes of vectors.
const LENGTH: &str = "length";

/// What shapes have where vectors are so long.
fn paint(transfer: &TransferFunction, length: f64) -> Paint {
    #[expect(clippy::cast_possible_truncation, reason = "vectors have 32 bits")]
    let number = length as f32;
    Paint { colour: colour(transfer, length), number }
}

/// The colour of a length by a map.
fn colour(transfer: &TransferFunction, length: f64) -> Srgb8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let bytes = transfer
        .colour_at(length)
        .0
        .map(|c| (srgb_from_linear(c).clamp(0.0, 1.0) * 255.0).round() as u8);
    Srgb8(bytes)
}

/// Tubes of a radius, world units, about lines, in the colours of the vectors' lengths along them.
///
/// # Errors
/// No line of any length.
pub fn tubes(
    lines: &[Streamline],
    transfer: &TransferFunction,
    radius: f64,
) -> Result<Mesh, GlyphError> {
    let mut shapes = Shapes::default();
    for line in lines {
        let places = line.places.iter().zip(&line.speeds);
        let places: Vec<_> = places.map(|(p, speed)| (*p, paint(transfer, *speed))).collect();
        shapes.tube(&places, radius);
    }
    let none = GlyphError::None {
        what: "streamlines",
        advice: match lines.iter().any(|line| line.places.len() > 1) {
            true => {
                "their tubes are so wide that their length is nothing beside it: choose a smaller radius"
            }
            false => "seed them where the vectors are not zero, within their grid",
        },
    };
    match shapes.is_empty() {
        true => Err(none),
        false => shapes.mesh("streamlines", LENGTH).map_err(GlyphError::Mesh),
    }
}

/// An arrow at every so many points along each axis of the grid, in the colour of its length. The longest
/// vector's is `size` times as long as such arrows are apart, and the others' in proportion.
///
/// # Errors
/// Too many, or none with a length, or cancelled.
pub fn arrows(
    field: &VectorField,
    transfer: &TransferFunction,
    every: usize,
    size: f64,
    ticket: &Ticket,
) -> Result<Mesh, GlyphError> {
    let every = every.max(1);
    let dims = field.places.dims();
    let found = dims.iter().map(|n| n.div_ceil(every)).product();
    if found > MOST_ARROWS {
        return Err(GlyphError::TooMany { found });
    }
    let most = field.statistics.max;
    let mut shapes = Shapes::default();
    // Half of what is left over to either side, so that they stand evenly.
    let first = dims.map(|n| (n - 1) % every / 2);
    for z in (first[2]..dims[2]).step_by(every) {
        ticket.checkpoint(z as u64, dims[2] as u64)?;
        for y in (first[1]..dims[1]).step_by(every) {
            for x in (first[0]..dims[0]).step_by(every) {
                let index = (z * dims[1] + y) * dims[0] + x;
                let vector = field.vectors[index].as_dvec3();
                let length = vector.length();
                if !length.is_finite() || length <= 0.0 || most <= 0.0 {
                    continue;
                }
                let (place, axes) = field.places.at(index);
                let step = match &field.places {
                    Places::Lattice(lattice) => lattice.smallest_spacing(),
                    Places::Points { .. } => axes.determinant().abs().cbrt(),
                };
                let by = vector / length * (length / most * size * step * every as f64);
                shapes.arrow(place - by / 2.0, by, paint(transfer, length));
            }
        }
    }
    let none = GlyphError::None { what: "vectors other than zero", advice: "show another field" };
    match shapes.is_empty() {
        true => Err(none),
        false => shapes.mesh("arrows", LENGTH).map_err(GlyphError::Mesh),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::transfer::{ColourMap, ColourSource};
    use crate::vector::{Following, Seeds, streamlines};
    use crate::volume::Lattice;

    fn wind() -> VectorField {
        let lattice = Lattice::unit([9, 9, 3]);
        let places = Places::Lattice(lattice);
        let of = |i: usize| Vec3::new(1.0, 0.0, 0.0) * (1 + i % 9) as f32;
        let vectors: Arc<[Vec3]> = (0..lattice.len()).map(of).collect();
        VectorField::new("wind", places, vectors, &Ticket::new()).unwrap()
    }

    fn map() -> TransferFunction {
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [1.0, 9.0] };
        TransferFunction::of(vec![(0.0, 0.0), (9.0, 1.0)], colour)
    }

    #[test]
    fn tubes_are_coloured_by_speed_along_them() {
        let seeds = [DVec3::new(4.0, 4.0, 1.0)];
        let seeds = Seeds::At(seeds.into());
        let lines = streamlines(&wind(), &seeds, &Following::default(), &Ticket::new()).unwrap();
        let mesh = tubes(&lines, &map(), 0.1).unwrap();
        let [low, high] = mesh.bounds();
        assert!((low.x, high.x) == (0.0, 8.0) && (high.z - 1.1).abs() < 1e-6, "{low} {high}");
        for t in mesh.triangles(true) {
            for (corner, Srgb8([r, ..])) in t.corners.iter().zip(t.colours.unwrap()) {
                let expected = colour(&map(), f64::from(corner.x) + 1.0).0[0];
                assert!(r.abs_diff(expected) <= 1, "{corner} {r} {expected}");
            }
        }
        let [low, high] = mesh.arrays()[0].range().unwrap();
        assert!(mesh.arrays()[0].name == "length" && low >= 1.0 && high <= 9.0 && high - low > 7.0);
        assert!(tubes(&[], &map(), 0.1).unwrap_err().to_string().contains("streamlines"));
    }

    #[test]
    fn arrows_stand_evenly_and_are_as_long_as_their_vectors() {
        let mesh = arrows(&wind(), &map(), 4, 0.5, &Ticket::new()).unwrap();
        // 3 × 3 of each layer that has any: of three, the middle one.
        assert_eq!(mesh.len() % 9, 0);
        let each = mesh.len() / 9;
        let all: Vec<_> = mesh.triangles(false).collect();
        for (i, arrow) in all.chunks(each).enumerate() {
            let xs = || arrow.iter().flat_map(|t| t.corners.map(|c| c.x));
            let (low, high) =
                (xs().fold(f32::INFINITY, f32::min), xs().fold(f32::NEG_INFINITY, f32::max));
            let x = (4 * (i % 3)) as f32;
            let length = (x + 1.0) / 9.0 * 0.5 * 4.0;
            assert!((high - low - length).abs() < 1e-5 && (0.5 * (high + low) - x).abs() < 1e-5);
            assert!(arrow.iter().all(|t| t.corners.iter().all(|c| (c.z - 1.0).abs() < 0.4)));
        }
        let still = Arc::from(vec![Vec3::ZERO; 8]);
        let places = Places::Lattice(Lattice::unit([2; 3]));
        let still = VectorField::new("still", places, still, &Ticket::new()).unwrap();
        assert!(arrows(&still, &map(), 1, 1.0, &Ticket::new()).is_err());
        let ticket = Ticket::new();
        ticket.cancel();
        let cancelled = arrows(&wind(), &map(), 1, 1.0, &ticket);
        assert_eq!(cancelled, Err(GlyphError::Cancelled(Cancelled)));
    }
}
