//! Cells as words on the device, in the place of a field's coefficients (`shaders/lib/cells.wgsl`).

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::GpuError;
use crate::cells::{CellField, Kind, Listed};
use crate::core::Ticket;
use crate::hierarchy::EMPTY_BRICK;
use crate::kernel::Bounds;
use crate::volume::Lattice;

/// Words before the lists: where the lists begin, and what points' values grow by; boxes along each axis, and the edge of
/// one.
const HEAD: usize = 6;
/// A place is in a cell up to so far outside it, samples: what single precision leaves of a place; and more where a lattice
/// is longer than 256 samples.
const RIM: f64 = 3e-5;
/// The same for each sample of the longest axis.
const RIM_A_SAMPLE: f64 = 2.4e-7;
/// And so far in units of the cell.
const UNIT_RIM: f64 = 2e-5;
/// Cells so thin that the rim is greater than this part of them are nothing that single precision can tell.
const WIDEST_RIM: f64 = 0.5;

/// Cells as words. Behind the head: where the list of each box begins, and the last ends; the lists, of the words at which
/// records begin; three numbers a point, what values grow by per index; and the records. Of each: its kind, how far outside
/// counts as inside, its first corner; of a tetrahedron the three rows that lead from an offset to (r, s, t) and four
/// factors of its value, of others 21 factors of its place and eight of its value; the numbers of its corners.
///
/// # Errors
/// A cancelled ticket, and words that 32-bit places cannot tell apart.
pub(super) fn words(
    field: &CellField,
    lattice: &Lattice,
    bias: f64,
    ticket: &Ticket,
) -> Result<(Vec<u32>, Listed), GpuError> {
    let cells = field.cells();
    let axes = lattice.axes();
    let index_from_world = axes.inverse();
    let place = |world: DVec3| index_from_world * (world - lattice.origin);
    let is_there: Vec<bool> =
        (0..cells.solids().len()).into_par_iter().map(|solid| field.is_there(solid)).collect();
    let listed = Listed::new(cells, (lattice.dims, place), |i| is_there[i], ticket)
        .map_err(|_| GpuError::Cancelled)?;
    let growths = field.growths(ticket).map_err(|_| GpuError::Cancelled)?;
    let lists_at = HEAD + listed.starts.len();
    let growths_at = lists_at + listed.lists.len();
    let records_at = growths_at + 3 * growths.len();
    let mut ends = Vec::with_capacity(cells.solids().len() + 1);
    let mut end = records_at;
    for solid in cells.solids() {
        ends.push(end);
        end += record_words(solid.kind());
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
    words.push(bits(listed.edge));
    words.extend(&listed.starts);
    words.extend(listed.lists.iter().map(|solid| short(ends[*solid as usize])));
    let index = axes.transpose();
    let longest = lattice.dims.into_iter().max().unwrap_or(1) as f64;
    let own_rim = RIM.max(RIM_A_SAMPLE * longest);
    words.extend(growths.iter().flat_map(|growth| (index * *growth).to_array().map(bits)));
    for (i, solid) in cells.solids().iter().enumerate() {
        if i.is_multiple_of(1 << 12) && ticket.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        let placed = solid.placed(&listed.points);
        let mut corners = [DVec3::ZERO; 8];
        for (to, from) in corners.iter_mut().zip(placed.corners()) {
            *to = *from - placed.corners()[0];
        }
        let values = field.at_corners(i).map(|value| value - bias);
        let (places, values) = (solid.kind().polynomial(corners), solid.kind().polynomial(values));
        let first = placed.corners()[0];
        if solid.kind() == Kind::Tetrahedron {
            let slopes = DMat3::from_cols(places[1], places[2], places[3]);
            let rows = slopes.inverse().transpose();
            let rows = [rows.x_axis, rows.y_axis, rows.z_axis];
            let steepest = rows.iter().fold(0.0_f64, |most, row| most.max(row.length()));
            // Without volume it holds no place: nothing lies so far inside it.
            let rim = UNIT_RIM + own_rim * steepest;
            let is_sound = rim < WIDEST_RIM;
            let rim = if is_sound { rim } else { -1.0 };
            let rows = if is_sound { rows } else { [DVec3::ZERO; 3] };
            words.extend([solid.kind() as u32, bits(rim)]);
            words.extend(first.to_array().map(bits));
            words.extend(rows.into_iter().flat_map(|row| row.to_array().map(bits)));
            words.extend(values[..4].iter().map(|value| bits(*value)));
        } else {
            let steepest = placed.at(solid.kind().middle()).1.inverse().transpose();
            let rows = [steepest.x_axis, steepest.y_axis, steepest.z_axis];
            let steepest = rows.iter().fold(0.0_f64, |most, row| most.max(row.length()));
            let rim = (UNIT_RIM + own_rim * steepest).min(WIDEST_RIM / 10.0);
            let rim = if placed.is_flat() { -1.0 } else { rim };
            words.extend([solid.kind() as u32, bits(rim)]);
            words.extend(first.to_array().map(bits));
            words.extend(places[1..].iter().flat_map(|by| by.to_array().map(bits)));
            words.extend(values.map(bits));
        }
        words.extend(solid.corners());
    }
    Ok((words, listed))
}

/// Words of a record.
fn record_words(kind: Kind) -> usize {
    let numbers = if kind == Kind::Tetrahedron { 9 + 4 } else { 21 + 8 };
    5 + numbers + kind.points()
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
) {
    bounds.ranges.fill([f32::INFINITY, f32::NEG_INFINITY]);
    let [nx, ny, nz] = bounds.dims;
    for (i, solid) in field.cells().solids().iter().enumerate().filter(|(i, _)| field.is_there(*i))
    {
        let own = &field.at_corners(i)[..solid.corners().len()];
        let least = own.iter().fold(f64::INFINITY, |a, b| a.min(*b)) - bias;
        let most = own.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - bias;
        #[expect(clippy::cast_possible_truncation, reason = "rounded outwards")]
        let [least, most] = [(least as f32).next_down(), (most as f32).next_up()];
        let [low, high] = solid.placed(&listed.points).bounds();
        let brick = |place: f64, n: usize| {
            let at = ((place + 0.5) / EMPTY_BRICK as f64).floor();
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let at = at.clamp(0.0, (n - 1) as f64) as usize;
            at
        };
        // A little more, as faces are found a rim beyond.
        let beyond = beyond + 1e-3;
        let span =
            |axis: usize, n: usize| brick(low[axis] - beyond, n)..=brick(high[axis] + beyond, n);
        for z in span(2, nz) {
            for y in span(1, ny) {
                for x in span(0, nx) {
                    let range = &mut bounds.ranges[(z * ny + y) * nx + x];
                    *range = [range[0].min(least), range[1].max(most)];
                }
            }
        }
    }
    for range in bounds.ranges.iter_mut().filter(|range| range[0] > range[1]) {
        *range = [nothing; 2];
    }
}
