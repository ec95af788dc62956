//! Basis functions as a picture has them: where they land, and what each is along its rays.

use super::functions::{Functions, Summand};
use super::landed::Landed;
use super::rays::Rays;
use super::supports::NotBegun;
use crate::core::{Ticket, mapped};
use crate::rbf::{Basis, Function};
use crate::scene::View;

/// Functions that are placed between two looks at the ticket.
const A_RUN: usize = 1 << 13;

/// A function as a picture has it: right, up and depth, in pixels, from the middle of the picture. What parallel rays ask for lies
/// in one line of a cache.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Seen {
    pub centre: [f32; 3],
    /// What takes an offset (x, y, z) to one in widths, turned so that rays along z change its last part alone: the first is
    /// `across[0]` x + `across[1]` y, the second `across[2]` y, the last `deep[0]` x + `deep[1]` y + `deep[2]` z.
    pub across: [f32; 3],
    /// Of parallel rays: how the depth of the nearest place grows along x and y, and a, in steps.
    pub tilt: [f32; 2],
    pub a: f32,
    /// exp(−a/2): what φ falls by in a step from the nearest place.
    pub fall: f32,
    /// The squared distance in widths at which it ends, and φ there.
    pub reach: f32,
    pub end: f32,
    pub weight: f32,
    /// How far from the nearest place a ray through the centre meets it, in steps, and how far the rays of a block see that place
    /// from each other's.
    pub half: f32,
    pub spread: f32,
    pub height: f32,
    pub deep: [f32; 3],
}

impl Seen {
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
    fn new(function: &Function, summand: &Summand, basis: Basis, rays: &Rays) -> Self {
        let view: &View = &rays.view;
        let middle = view.view_centre.truncate().extend(0.0);
        let centre = middle + view.view_from_index * (function.centre - view.lattice_centre);
        let widths = function.shape * view.view_from_index.inverse();
        let depth = widths.z_axis.length();
        let along = widths.z_axis.normalize_or_zero();
        let [x, y] = [widths.x_axis, widths.y_axis].map(|axis| (axis, along.dot(axis)));
        let [right, up] = [x, y].map(|(axis, share)| axis - along * share);
        let first = right.normalize_or_zero();
        let sideways = first.dot(up);
        let step = f64::from(rays.step);
        let a = (depth * step).powi(2);
        let reach = f64::from(summand.reach);
        let end = match basis {
            Basis::Gaussian | Basis::Ellipsoid => (-reach / 2.0).exp(),
            Basis::Multiquadric => 1.0 / (1.0 + reach).sqrt(),
        };
        let tilt = [x.1, y.1].map(|share| -share / depth / step);
        // The block's rays are 4 × 2, a pixel apart.
        let spread = 1.5 * tilt[0].abs() + 0.5 * tilt[1].abs();
        let narrow = |parts: [f64; 3]| parts.map(|part| part as f32);
        Self {
            centre: narrow(centre.to_array()),
            across: narrow([right.length(), sideways, (up - first * sideways).length()]),
            tilt: tilt.map(|part| part as f32),
            a: a as f32,
            fall: (-a / 2.0).exp() as f32,
            reach: summand.reach,
            end: end as f32,
            weight: summand.weight,
            half: (reach / a).sqrt() as f32,
            spread: spread as f32,
            height: summand.height,
            deep: narrow([x.1, y.1, depth]),
        }
    }

    /// How far on either side of its nearest place any ray of a block meets it, in steps, if none comes nearer than `near`; at most
    /// an eighth of the greatest distance more. √(1 − s) lies below its tangents at 0 and at ¾, and no long chain of quotients and
    /// roots stands before a loop that goes so far.
    #[inline(always)]
    pub(super) fn reaches(&self, near: f32) -> f32 {
        let share = near / self.reach;
        self.half * (1.0 - 0.5 * share).min(1.25 - share) + self.spread
    }
}

/// Where functions land in a picture, and what they look like there.
#[derive(Debug)]
pub(super) struct Landing {
    pub landed: Landed,
    pub seen: Vec<Seen>,
}

impl Landing {
    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        self.landed.size_bytes() + size_of_val(&self.seen[..]) as u64
    }
}

/// Where the functions land in a picture.
///
/// # Errors
/// More than lists have room for, and a cancelled ticket.
pub(super) fn landed(
    functions: &Functions,
    rays: &Rays,
    ticket: &Ticket,
) -> Result<Landing, NotBegun> {
    let listed = &functions.listed;
    let seen =
        |i: usize| Seen::new(&listed.functions[i], &functions.all[i], functions.basis(), rays);
    let seen = mapped(listed.functions.len(), A_RUN, seen, ticket)?;
    let extent = |i: usize| {
        let (function, reach): (&Function, f64) = (&listed.functions[i], listed.reaches[i]);
        let view: &View = &rays.view;
        let middle = view.view_from_index * (function.centre - view.lattice_centre);
        let rows = (view.view_from_index * function.shape.inverse()).transpose();
        let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(glam::DVec3::length);
        Some([middle, glam::DVec3::from(lengths) * reach.sqrt()])
    };
    let extents = mapped(listed.functions.len(), A_RUN, extent, ticket)?;
    let landed = Landed::new((&extents, "basis functions"), (rays, None), ticket)?;
    Ok(Landing { landed, seen })
}
