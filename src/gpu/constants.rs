//! What the splat pass is told of a picture: the view and the kernel as 32-bit numbers.

use super::layout::{self, LEAST_HALF_AXIS, narrow, narrow4};
use crate::kernel::{Kernel, ProjectedKernel, RadialKernel};
use crate::scene::View;

pub(super) fn frame_constants(
    view: &View,
    kernel: Kernel,
    extent: Option<f64>,
    unit_distance: f64,
) -> layout::Frame {
    let m = view.view_from_index;
    let radial = RadialKernel::new(kernel, extent);
    let radius = radial.map_or(0.5, RadialKernel::radius);
    let stretch = radial.map_or(1.0, RadialKernel::scale);
    let column = |v| narrow4(v, 0.0);
    let half = [f64::from(view.size[0]) / 2.0, f64::from(view.size[1]) / 2.0];
    layout::Frame {
        view_x: column(m.x_axis),
        view_y: column(m.y_axis),
        view_z: column(m.z_axis),
        view_centre: narrow4(view.view_centre, view.eye_distance.unwrap_or(0.0)),
        lattice_centre: narrow4(view.lattice_centre, m.determinant().abs()),
        footprint: one_footprint(m, radius),
        half_size: half.map(narrow),
        radius: narrow(radius),
        // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
        extinction_scale: narrow((1.0 / (unit_distance * view.pixels_per_unit)).min(1e20)),
        footprint_scale: narrow(stretch.powi(-2)),
        padding0: 0.0,
        padding1: 0.0,
        padding2: 0.0,
    }
}

/// The footprint of one voxel seen in parallel: `Frame::footprint`, in double precision.
fn one_footprint(view_from_index: glam::DMat3, radius: f64) -> [f32; 4] {
    let Some(projected) = ProjectedKernel::new(view_from_index) else { return [0.0; 4] };
    let projected = projected.widened(LEAST_HALF_AXIS / radius);
    let k = projected.screen_from_unit;
    [k.x_axis.x, k.x_axis.y, k.y_axis.y, projected.depth_per_unit].map(narrow)
}
