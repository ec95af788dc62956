//! The constants of passes that gather a lattice's kernels, in double precision until the last.

use std::ops::Range;

use glam::DVec3;

use super::{Layering, Variant};
use crate::gpu::layout::{self, POINT_TIE, TILE, narrow4};
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{SplatSettings, View};
use crate::volume::BRICK;

/// How much farther than their kernels rays look, voxels: roundings must not lose a sample.
const MARGIN: f64 = 2e-3;

/// What the constants of a piece are made of.
pub(in crate::gpu) struct Constants<'a> {
    pub view: &'a View,
    pub settings: &'a SplatSettings,
    pub unit_distance: f64,
    pub stop_below: f64,
    pub dims: [usize; 3],
    /// Bricks along x, y, z.
    pub bricks: [usize; 3],
    /// World units.
    pub smallest_spacing: f64,
    /// First and last brick that can show.
    pub showing: [[usize; 3]; 2],
    pub tiles: Range<u32>,
}

impl Constants<'_> {
    /// The same for the device, computed in double precision.
    pub(in crate::gpu) fn gather(self) -> layout::Gather {
        let Self { view, settings, dims, bricks, .. } = self;
        let axes = view.traversal.axes;
        // Vectors over lattice axes, in the traversal's order.
        let turned = |v: DVec3| DVec3::from(axes.map(|axis| v[axis]));
        let index_from_view = view.view_from_index.inverse();
        let radial = RadialKernel::new(settings.kernel, settings.extent);
        let radius = radial.map_or(0.5, RadialKernel::radius);
        let eye = view.eye_distance.unwrap_or(0.0);
        // The plane of reference passes the lattice's middle, or lies close before the eye.
        let reference = match view.eye_distance {
            None => view.view_centre.z,
            Some(eye) => view.view_centre.z.max(1e-3 * eye),
        };
        let shrink = view.eye_distance.map_or(1.0, |eye| reference / eye);
        let from_centre =
            DVec3::new(-view.view_centre.x, -view.view_centre.y, reference - view.view_centre.z);
        let base = view.lattice_centre + index_from_view * from_centre;
        let ahead = index_from_view.z_axis * view.eye_distance.unwrap_or(1.0);
        let reach = match settings.kernel {
            Kernel::Point => {
                // Half a pixel, and what counts to it, at the far end.
                let m = view.view_from_index;
                let half = view.lattice_centre + DVec3::splat(0.5);
                let depth = DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z).abs().dot(half);
                let most = view
                    .eye_distance
                    .map_or(1.0, |eye| (view.view_centre.z + depth).max(0.0) / eye);
                (index_from_view.x_axis.abs() + index_from_view.y_axis.abs())
                    * ((0.5 + POINT_TIE) * most)
            }
            Kernel::Nearest => DVec3::splat(0.5),
            Kernel::Linear | Kernel::BSpline => {
                DVec3::splat(settings.kernel.reach(settings.extent))
            }
            Kernel::Gaussian
            | Kernel::Cubic
            | Kernel::Gouraud
            | Kernel::Functions
            | Kernel::Cells
            | Kernel::Ellipsoids => DVec3::splat(radius),
        };
        let thickness = match Variant::new(view, settings).layering {
            Layering::Sheets => 2.0 * radius / f64::from(settings.sheets_per_kernel),
            _ => self.smallest_spacing / settings.slabs_per_voxel * view.pixels_per_unit,
        };
        // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
        let extinction = (1.0 / (self.unit_distance * view.pixels_per_unit)).min(1e20);
        let stretch = radial.map_or(1.0, RadialKernel::scale);
        let along = |axis: usize| view.view_from_index.col(axis);
        let strides = [1, dims[0], dims[0] * dims[1]];
        let brick_strides = [1, bricks[0], bricks[0] * bricks[1]];
        let first = axes.map(|axis| (self.showing[0][axis] * BRICK) as i32);
        let last =
            axes.map(|axis| (dims[axis] - 1).min(self.showing[1][axis] * BRICK + BRICK - 1) as i32);
        let splits = view.traversal.splits.map(|split| split as i32);
        let counts = |v: [usize; 3], w: u32| {
            let [a, b, c] = axes.map(|axis| v[axis] as u32);
            [a, b, c, w]
        };
        layout::Gather {
            base: narrow4(turned(base), shrink),
            right: narrow4(turned(index_from_view.x_axis), 0.0),
            up: narrow4(turned(index_from_view.y_axis), 0.0),
            ahead: narrow4(turned(ahead), 0.0),
            reach: narrow4(turned(reach) + DVec3::splat(MARGIN), self.stop_below),
            scale: narrow4(DVec3::new(radius, extinction, extinction * stretch.powi(-2)), eye),
            layers: narrow4(
                DVec3::new(
                    thickness,
                    reference - view.view_centre.z,
                    settings.kernel.scale(settings.extent),
                ),
                0.0,
            ),
            centre: narrow4(turned(view.lattice_centre), view.view_from_index.determinant().abs()),
            view_a: narrow4(along(axes[0]), 0.0),
            view_b: narrow4(along(axes[1]), 0.0),
            view_c: narrow4(along(axes[2]), 0.0),
            view_centre: narrow4(view.view_centre, 0.0),
            low: [first[0], first[1], first[2], view.size[0] as i32],
            high: [last[0], last[1], last[2], view.size[1] as i32],
            splits: [splits[0], splits[1], splits[2], self.tiles.start as i32],
            strides: counts(strides, self.tiles.end),
            bricks: counts(brick_strides, view.size[0].div_ceil(TILE)),
            piece: [view.rays_per_side(settings.kernel, settings.extent), 0, 0, 0],
        }
    }
}
