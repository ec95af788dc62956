//! What the splat pass is told of a picture: the view and the kernel as 32-bit numbers.

use super::layout::{self, LEAST_HALF_AXIS};
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
    let column = |v: glam::DVec3| v.as_vec3().extend(0.0).to_array();
    let half = [f64::from(view.size[0]) / 2.0, f64::from(view.size[1]) / 2.0];
    #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
    layout::Frame {
        view_x: column(m.x_axis),
        view_y: column(m.y_axis),
        view_z: column(m.z_axis),
        view_centre: view
            .view_centre
            .as_vec3()
            .extend(view.eye_distance.unwrap_or(0.0) as f32)
            .to_array(),
        lattice_centre: view
            .lattice_centre
            .as_vec3()
            .extend(m.determinant().abs() as f32)
            .to_array(),
        footprint: one_footprint(m, radius),
        half_size: half.map(|h| h as f32),
        radius: radius as f32,
        // Capped where a voxel is 1e20 unit distances thick: beyond, 32 bits would overflow.
        extinction_scale: (1.0 / (unit_distance * view.pixels_per_unit)).min(1e20) as f32,
        footprint_scale: stretch.powi(-2) as f32,
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
    [k.x_axis.x, k.x_axis.y, k.y_axis.y, projected.depth_per_unit].map(|v| v as f32)
}
