//! Basis functions as words on the device, in the place of a field's coefficients (`shaders/lib/field.wgsl`).

use super::GpuError;
use crate::core::Ticket;
use crate::core::parallel;
use crate::hierarchy::EMPTY_BRICK;
use crate::kernel::Bounds;
use crate::rbf::{Blend, Listed};
use glam::DVec3;

/// Words before the lists: where these and the functions begin, and the range of a mean.
const HEAD: usize = 3;

/// Functions as words: where the lists and the functions begin, and the range of a mean; where the list of each cell begins, and the last ends; where
/// something is added for functions that cells leave out, that at the corners of each; the lists; of each function its centre, the upper triangle of its shape by rows, its weight, its
/// reach and its height.
pub(super) fn words(listed: &Listed) -> Vec<u32> {
    let Listed { starts, lists, functions, reaches, .. } = listed;
    let corners = listed.left_out.as_ref().map_or(&[][..], |left_out| &left_out.corners);
    let lists_at = HEAD + starts.len() + corners.as_flattened().len();
    let functions_at = lists_at + lists.len();
    #[expect(
        clippy::cast_possible_truncation,
        reason = "32-bit places, checked by who stores them"
    )]
    let head = [lists_at as u32, functions_at as u32, (listed.range as f32).to_bits()];
    let records = functions.iter().zip(reaches).enumerate().flat_map(|(i, (function, reach))| {
        let height = listed.heights.get(i).copied().unwrap_or(1.0);
        let rows = function.shape.transpose();
        let [x, y, z] = [rows.x_axis, rows.y_axis, rows.z_axis];
        let [cx, cy, cz] = function.centre.to_array();
        #[expect(clippy::cast_possible_truncation, reason = "shaders have 32 bits")]
        let record = [cx, cy, cz, x.x, x.y, x.z, y.y, y.z, z.z, function.weight, *reach, height]
            .map(|number| (number as f32).to_bits());
        record
    });
    #[expect(clippy::cast_possible_truncation, reason = "shaders have 32 bits")]
    let corners = corners.as_flattened().iter().map(|value| (*value as f32).to_bits());
    head.into_iter()
        .chain(starts.iter().copied())
        .chain(corners)
        .chain(lists.iter().copied())
        .chain(records)
        .collect()
}

/// The sums at the samples, x fastest.
pub(super) fn sums(listed: &Listed, ticket: &Ticket) -> Result<Vec<f32>, GpuError> {
    let [nx, ny, nz] = listed.dims;
    let mut sums = vec![0.0_f32; nx * ny * nz];
    parallel::try_each(sums.chunks_mut(nx).enumerate(), |(i, row)| {
        if ticket.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        let (y, z) = ((i % ny) as f64, (i / ny) as f64);
        for (x, sum) in row.iter_mut().enumerate() {
            #[expect(clippy::cast_possible_truncation, reason = "bounds have 32 bits")]
            let value = listed.value(DVec3::new(x as f64, y, z)) as f32;
            *sum = value;
        }
        Ok(())
    })?;
    Ok(sums)
}

/// Takes bounds of the sums at samples to those of the values between these, and `beyond` steps about each brick; bricks that
/// no function of a mean reaches have `nothing`.
pub(super) fn bound(
    bounds: &mut Bounds,
    (listed, beyond): (&Listed, f64),
    nothing: f32,
    ticket: &Ticket,
) -> Result<(), GpuError> {
    if listed.blend == Blend::Mean {
        let set = bounds.set_to_boxes(listed.boxes(), (-0.5, beyond), nothing, ticket);
        return set.map_err(|_| GpuError::Cancelled);
    }
    let [bx, by, _] = bounds.dims;
    let end = DVec3::from(listed.dims.map(|n| n as f64 - 0.5));
    parallel::try_each(bounds.ranges.iter_mut().enumerate(), |(i, range)| {
        if ticket.is_cancelled() {
            return Err(GpuError::Cancelled);
        }
        let at = [i % bx, i / bx % by, i / (bx * by)];
        let low = DVec3::from(at.map(|b| (b * EMPTY_BRICK) as f64 - 0.5));
        let high = (low + EMPTY_BRICK as f64 + beyond).min(end);
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let slack = (listed.slack((low - beyond).max(DVec3::splat(-0.5)), high) as f32).next_up();
        *range = [range[0] - slack, range[1] + slack];
        Ok(())
    })
}
