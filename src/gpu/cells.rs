//! Cells as words on the device, in the place of a field's coefficients (`shaders/lib/cells.wgsl`).

use glam::DVec3;

use super::GpuError;
use crate::cells::{CellField, Kind, Listed, Placed, Rim};
use crate::core::Ticket;
use crate::kernel::Bounds;
use crate::volume::Lattice;

/// Words before the lists: where the lists begin, and what points' values grow by; boxes along each axis, and the edge of
/// one; where what light takes for the growth begins.
const HEAD: usize = 7;
/// The rim of a solid without volume: nothing lies so far inside it.
const NO_PLACE: f64 = -1.0;
/// Cells as words. Behind the head: where the list of each box begins, and the last ends; the lists, of the words at which
/// records begin; three numbers a point, what values grow by per index; four numbers a shading normal, what light takes for
/// that, and 1 on the border; and the records. Of each: its kind, and above two bits which of the file's cells it is of, how
/// far outside counts as inside, its first corner; of a tetrahedron the three rows that lead from an offset to (r, s, t) and
/// four factors of its value, of others 21 factors of its place and eight of its value; the numbers of its corners; how many
/// outer faces its cell has, and of each a unit vector inwards, its product with places on the face, and the numbers of its corners' normals. Where it is not
/// `is_lit` there are no normals, and records have no outer faces.
///
/// # Errors
/// A cancelled ticket, and words that 32-bit places cannot tell apart.
pub(super) fn words(
    field: &CellField,
    lattice: &Lattice,
    (bias, is_lit): (f64, bool),
    ticket: &Ticket,
) -> Result<(Vec<u32>, Listed), GpuError> {
    let cells = field.cells();
    let axes = lattice.axes();
    let index_from_world = axes.inverse();
    let place = |world: DVec3| index_from_world * (world - lattice.origin);
    let is_there = field.drawn(ticket).map_err(|_| GpuError::Cancelled)?;
    let listed = Listed::new(cells, (lattice.dims, place), |i| is_there[i], ticket)
        .map_err(|_| GpuError::Cancelled)?;
    let growths = field.growths(ticket).map_err(|_| GpuError::Cancelled)?;
    let lit = is_lit.then(|| field.shading_normals(ticket)).transpose();
    let lit = lit.map_err(|_| GpuError::Cancelled)?;
    let normals = lit.as_ref().map_or(&[][..], |lit| lit.normals());
    let faces_of = |solid: usize| lit.as_ref().map_or(&[][..], |lit| lit.faces_of(solid));
    let lists_at = HEAD + listed.starts.len();
    let growths_at = lists_at + listed.lists.len();
    let normals_at = growths_at + 3 * growths.len();
    let records_at = normals_at + 4 * normals.len();
    let mut ends = Vec::with_capacity(cells.solids().len() + 1);
    let mut end = records_at;
    for (i, solid) in cells.solids().iter().enumerate() {
        end += box_words(solid.kind());
        ends.push(end);
        end += record_words(solid.kind(), faces_of(i).len());
    }
    if u32::try_from(end).is_err() {
        return Err(GpuError::TooLarge {
            what: "a mesh",
            limit: format!("{} numbers for its cells", u32::MAX),
            found: end.to_string(),
            advice: "choose --engine native",
        });
    }
    #[expect(clippy::cast_possible_truncation, reason = "looked at above")]
    let short = |n: usize| n as u32;
    let mut words = Vec::with_capacity(end);
    words.extend([short(lists_at), short(growths_at)]);
    words.extend(listed.boxes.map(short));
    words.extend([bits(listed.edge), short(normals_at)]);
    words.extend(&listed.starts);
    words.extend(listed.lists.iter().map(|solid| short(ends[*solid as usize])));
    let index = axes.transpose();
    let rim = Rim::of(lattice.dims);
    words.extend(growths.iter().flat_map(|growth| (index * *growth).to_array().map(bits)));
    words.extend(normals.iter().flat_map(|normal| {
        let [x, y, z] = (index * normal.growth).to_array().map(bits);
        [x, y, z, f32::from(u8::from(normal.is_on_border)).to_bits()]
    }));
    for (i, solid) in cells.solids().iter().enumerate() {
        if i.is_multiple_of(1 << 12) && ticket.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        let placed = solid.placed(&listed.points);
        let values = solid.kind().polynomial(field.at_corners(i).map(|value| value - bias));
        let rows = placed.rows();
        let widest = rows.iter().fold(0.0_f64, |most, row| most.max(rim.along(*row)));
        let (rim, factors) = match solid.kind() {
            Kind::Tetrahedron if widest < Rim::WIDEST => (widest, &rows[..]),
            Kind::Tetrahedron => (NO_PLACE, &[DVec3::ZERO; 3][..]),
            _ if placed.is_flat() => (NO_PLACE, &placed.factors()[1..]),
            _ => (widest.min(Rim::WIDEST / 10.0), &placed.factors()[1..]),
        };
        if box_words(solid.kind()) > 0 {
            words.extend(reach(&placed, rim).iter().flat_map(|at| at.to_array().map(bits)));
        }
        words.extend([solid.kind() as u32 | cells.sources()[i] << 2, bits(rim)]);
        words.extend(placed.corners()[0].to_array().map(bits));
        words.extend(factors.iter().flat_map(|by| by.to_array().map(bits)));
        let count = if solid.kind() == Kind::Tetrahedron { 4 } else { 8 };
        words.extend(values[..count].iter().map(|value| bits(*value)));
        words.extend(solid.corners());
        words.push(short(faces_of(i).len()));
        for face in faces_of(i) {
            let inwards = (index * face.inwards).normalize_or_zero();
            words.extend(inwards.to_array().map(bits));
            words.push(bits(inwards.dot(place(face.on))));
            words.extend(&face.corners[..solid.kind().points()]);
        }
    }
    Ok((words, listed))
}

/// Words of the box in front of a record: tetrahedra are looked into as quickly as a box.
fn box_words(kind: Kind) -> usize {
    if kind == Kind::Tetrahedron { 0 } else { 6 }
}

/// Least and greatest coordinates of what counts as inside a solid, a little outside of it, and more by what single precision
/// may be off by.
fn reach(placed: &Placed, rim: f64) -> [DVec3; 2] {
    let ends = [-rim.max(0.0), 1.0 + rim.max(0.0)];
    // Places are linear along each of r, s and t, and so farthest at the ends of all three.
    let corner = |i: usize| DVec3::new(ends[i & 1], ends[i >> 1 & 1], ends[i >> 2 & 1]);
    let places = (0..8).map(|i| placed.at(corner(i)).0);
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = places.fold(none, |[low, high], at| [low.min(at), high.max(at)]);
    let off = DVec3::splat(1e-4) + low.abs().max(high.abs()) * 1e-6;
    [low - off, high + off]
}

/// Words of the record of a solid with so many outer faces.
fn record_words(kind: Kind, outer: usize) -> usize {
    let numbers = if kind == Kind::Tetrahedron { 9 + 4 } else { 21 + 8 };
    5 + numbers + kind.points() + 1 + outer * (4 + kind.points())
}

#[expect(clippy::cast_possible_truncation, reason = "shaders have 32 bits")]
fn bits(number: f64) -> u32 {
    (number as f32).to_bits()
}

/// Least and greatest value in each of a lattice's bricks, and `beyond` steps about it, of the cells that reach there;
/// where there are none nothing shows.
pub(super) fn bound(
    bounds: &mut Bounds,
    (field, listed): (&CellField, &Listed),
    (bias, beyond): (f64, f64),
    nothing: f32,
    ticket: &Ticket,
) -> Result<(), GpuError> {
    let solids = field.cells().solids();
    let boxes = (0..solids.len()).filter(|i| field.is_there(*i)).map(|i| {
        let [least, most] = field.range_in(i);
        (solids[i].placed(&listed.points).bounds(), [least - bias, most - bias])
    });
    // A little more, as faces are found a rim beyond. Brick b has the places 4b − 1/2 to 4b + 7/2.
    let set = bounds.set_to_boxes(boxes, (-0.5, beyond + 1e-3), nothing, ticket);
    set.map_err(|_| GpuError::Cancelled)
}
