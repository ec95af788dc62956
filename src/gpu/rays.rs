//! How many slabs a ray passes at most, and whether they can be told apart.

use glam::DVec3;

use super::GpuError;
use super::layout;
use crate::scene::View;

/// Slabs are counted in 32-bit floats.
const MOST_SLABS: f64 = 16_777_216.0;

/// # Errors
/// One sentence, where so many slabs cannot be told apart.
pub(super) fn check(slabs: f64) -> Result<(), GpuError> {
    if slabs <= MOST_SLABS {
        return Ok(());
    }
    Err(GpuError::TooLarge {
        what: "slabs along a ray",
        limit: format!("{MOST_SLABS}"),
        found: format!("up to {slabs:.1e}"),
        advice: "choose fewer --slabs-per-voxel, --visibility every-sample, or correct a spacing that is \
                 far less than the others",
    })
}

/// Slabs of a reconstructed field of `dims` samples, each so many pixels of view depth thick.
pub(super) fn slabs_of_field(view: &View, dims: [usize; 3], thickness: f64) -> f64 {
    let m = view.view_from_index;
    let dims = DVec3::from(dims.map(|n| n as f64));
    DVec3::new(m.x_axis.z, m.y_axis.z, m.z_axis.z).abs().dot(dims) / thickness
}

/// Slabs that gathered kernels lie in, or sheets, which stand across the traversal's first axis.
pub(super) fn layers_of_kernels(gather: &layout::Gather, are_sheets: bool) -> f64 {
    let xyz = |[x, y, z, _]: [f32; 4]| DVec3::new(x.into(), y.into(), z.into());
    let ends = [gather.low, gather.high];
    let [low, high] = ends.map(|[a, b, c, _]| DVec3::new(a.into(), b.into(), c.into()));
    let sides = high - low + 2.0 * xyz(gather.reach);
    let depth =
        DVec3::new(gather.view_a[2].into(), gather.view_b[2].into(), gather.view_c[2].into());
    let extent = if are_sheets { sides.x } else { depth.abs().dot(sides) };
    extent / f64::from(gather.layers[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Camera;
    use crate::volume::Lattice;

    #[test]
    fn slabs_are_counted_along_the_view() {
        let lattice = Lattice::unit([10, 20, 400]);
        for (direction, voxels) in [(DVec3::Y, 20.0), (DVec3::Z, 400.0)] {
            let camera = Camera::new(lattice.centre(), direction, DVec3::X, 40.0);
            let view = View::of(&camera, &lattice, [40, 40]);
            let slabs = slabs_of_field(&view, lattice.dims, 0.5 * view.pixels_per_unit);
            assert!((slabs - 2.0 * voxels).abs() < 1e-6, "{slabs}");
        }
    }

    #[test]
    fn sheets_stand_across_the_first_axis_and_slabs_across_the_view() {
        let gather = layout::Gather {
            low: [2, 0, 0, 8],
            high: [11, 30, 20, 8],
            reach: [1.5, 1.0, 1.0, 0.0],
            view_a: [1.0, 0.0, 0.0, 0.0],
            view_b: [0.0, 0.0, -2.0, 0.0],
            layers: [0.5, 0.0, 0.0, 0.0],
            ..bytemuck::Zeroable::zeroed()
        };
        assert_eq!(layers_of_kernels(&gather, true), 24.0);
        assert_eq!(layers_of_kernels(&gather, false), 128.0);
    }

    #[test]
    fn more_slabs_than_can_be_told_apart_are_refused() {
        assert_eq!(check(MOST_SLABS), Ok(()));
        for slabs in [MOST_SLABS + 2.0, f64::INFINITY, f64::NAN] {
            let refused = check(slabs).expect_err("too many").to_string();
            assert!(
                refused.starts_with("expected slabs along a ray of at most 16777216"),
                "{refused}"
            );
        }
    }
}
