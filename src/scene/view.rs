//! Where a lattice lands on a picture of a given size.

use glam::{DMat3, DVec2, DVec3};

use super::Scene;
use crate::core::Camera;
use crate::hierarchy::{Visibility, VisitOrder};
use crate::kernel::Kernel;
use crate::volume::Lattice;

/// The camera and the lattice brought together, in pixels: view space scaled so that one unit is
/// one pixel at the focal plane. Neither huge origins nor tiny spacings survive into it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Picture size, pixels.
    pub size: [u32; 2],
    /// View-space steps of one index along x, y, z (columns), pixels.
    pub view_from_index: DMat3,
    /// View-space position of the middle of the lattice, pixels.
    pub view_centre: DVec3,
    /// The middle of the lattice in index space.
    pub lattice_centre: DVec3,
    /// Distance from the eye to the focal plane, pixels; `None` when orthographic.
    pub eye_distance: Option<f64>,
    /// World units to pixels at the focal plane.
    pub pixels_per_unit: f64,
    /// The order in which the lattice's samples are drawn.
    pub traversal: Traversal,
    /// How many times larger the picture is shown than it is drawn, ≥ 1: kernels smaller than a
    /// pixel of what is shown are averaged, and no others.
    pub enlarged: f64,
}

/// Far-to-near order of a lattice's samples: nested loops over its axes, with no sort.
///
/// The axis most parallel to the view direction is outermost (the first of those that tie), so that
/// what overlaps on the picture is in depth order (Westover's traversal). Along each axis, indices at and beyond
/// `split` come first, from the last one down; then those before it, from 0 up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traversal {
    /// Lattice axes, outermost first.
    pub axes: [usize; 3],
    /// For each of `axes`, the number of indices at or before the eye.
    pub splits: [usize; 3],
}

/// The most rays along the side of a pixel.
pub const MOST_RAYS: f64 = 8.0;

impl View {
    /// Brings a scene's camera and lattice together.
    pub fn new(scene: &Scene, size: [u32; 2]) -> Self {
        Self::of(&scene.camera, &scene.lattice(), size)
    }

    /// The same from its parts.
    pub fn of(camera: &Camera, lattice: &Lattice, size: [u32; 2]) -> Self {
        let pixels_per_unit = camera.pixels_per_unit(f64::from(size[1]));
        let rotation = camera.view_from_world_rotation();
        let view_from_index = rotation * lattice.axes() * pixels_per_unit;
        let view_centre = camera.to_view(lattice.centre()) * pixels_per_unit;
        let lattice_centre = (DVec3::from(lattice.dims.map(|n| n as f64)) - DVec3::ONE) / 2.0;
        let eye_distance = camera.eye_distance().map(|d| d * pixels_per_unit);
        let traversal = traversal(view_from_index, view_centre, lattice, eye_distance.is_some());
        Self {
            size,
            view_from_index,
            view_centre,
            lattice_centre,
            eye_distance,
            pixels_per_unit,
            traversal,
            enlarged: 1.0,
        }
    }

    /// The same of a lattice halved so many times, whose sample i is in the middle of 2^level
    /// samples along each axis; but for the order of traversal, which stays that of the samples.
    pub fn halved(&self, level: u32) -> Self {
        let times = f64::from(1_u32 << level);
        Self {
            view_from_index: self.view_from_index * times,
            lattice_centre: (self.lattice_centre + 0.5) / times - 0.5,
            ..*self
        }
    }

    /// Far-to-near order for the octree.
    pub fn visit_order(&self) -> VisitOrder {
        let index_from_view = self.view_from_index.inverse();
        match self.eye_distance {
            None => VisitOrder::Along(index_from_view * DVec3::Z),
            Some(_) => VisitOrder::From(self.lattice_centre - index_from_view * self.view_centre),
        }
    }

    /// What the octree needs to leave out what is beside the picture.
    pub fn visibility(&self, kernel_radius: f64) -> Visibility {
        Visibility {
            view_from_index: self.view_from_index,
            view_origin: self.view_centre - self.view_from_index * self.lattice_centre,
            half_size: DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) / 2.0,
            eye_distance: self.eye_distance,
            kernel_radius,
        }
    }

    /// Radius in pixels that a kernel of unit radius has, along its longest axis, at the corner of
    /// the lattice that is farthest from the eye: nowhere is it less.
    pub fn voxel_pixels(&self) -> f64 {
        let m = self.view_from_index;
        let longest = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
        let shrink = match self.eye_distance {
            None => 1.0,
            Some(distance) => {
                let reach = (m.abs_columns() * (self.lattice_centre + DVec3::splat(0.5))).z;
                distance / (self.view_centre.z + reach).max(distance * 1e-3)
            }
        };
        longest * shrink
    }

    /// The same along the shorter axis of the kernel's ellipse on the picture: much less where spacings
    /// differ, as between slices far apart.
    pub fn narrowest_voxel_pixels(&self) -> f64 {
        let rows = self.view_from_index.transpose();
        let (x, y) = (rows.x_axis, rows.y_axis);
        // The lesser eigenvalue of the ellipse's matrix.
        let (half_sum, half_difference) =
            ((x.dot(x) + y.dot(y)) / 2.0, (x.dot(x) - y.dot(y)) / 2.0);
        let greater = half_sum + half_difference.hypot(x.dot(y));
        if greater <= 0.0 {
            return 0.0;
        }
        let m = self.view_from_index;
        let longest = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
        // By their product: their difference would have no digits left.
        let shorter = x.cross(y).length() / greater.sqrt();
        shorter * self.voxel_pixels() / longest
    }

    /// Whether the eye is among the lattice's samples, or within this many voxels of them: kernels there
    /// cannot be seen as from their middles.
    pub fn has_eye_within(&self, reach: f64) -> bool {
        let from_centre = self.view_from_index.inverse() * self.view_centre;
        let half = self.lattice_centre + DVec3::splat(0.5 + reach);
        self.eye_distance.is_some() && from_centre.abs().cmple(half).all()
    }

    /// Rays along the side of a pixel, 1 to 8: 1 while the kernel's radius is a pixel of what is shown
    /// at least, and so many below that it is as much as the rays are apart. Points are a pixel each,
    /// whatever their size.
    pub fn rays_per_side(&self, kernel: Kernel, extent: Option<f64>) -> u32 {
        let pixels = match kernel {
            Kernel::Point => return 1,
            // Boxes have edges at any size: they are averaged by their longest axis, as elsewhere.
            Kernel::Nearest => self.voxel_pixels(),
            _ => self.narrowest_voxel_pixels(),
        };
        let radius = kernel.reach(extent);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=8")]
        let side = (1.0 / (radius * pixels * self.enlarged)).ceil().clamp(1.0, MOST_RAYS) as u32;
        side
    }
}

/// A matrix of absolute values.
trait AbsColumns {
    fn abs_columns(&self) -> DMat3;
}

impl AbsColumns for DMat3 {
    fn abs_columns(&self) -> DMat3 {
        DMat3::from_cols(self.x_axis.abs(), self.y_axis.abs(), self.z_axis.abs())
    }
}

/// Axes whose cosines to the view differ by less than about one part of this tie.
const TIE: f64 = 1e9;

fn traversal(
    view_from_index: DMat3,
    view_centre: DVec3,
    lattice: &Lattice,
    perspective: bool,
) -> Traversal {
    let columns = [view_from_index.x_axis, view_from_index.y_axis, view_from_index.z_axis];
    // Rounded, so that axes which tie keep their order however they were computed.
    let along = columns.map(|c| (c.z.abs() / c.length() * TIE).round());
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| along[b].total_cmp(&along[a]));
    let eye = perspective.then(|| {
        let centre = (DVec3::from(lattice.dims.map(|n| n as f64)) - DVec3::ONE) / 2.0;
        centre - view_from_index.inverse() * view_centre
    });
    let splits = axes.map(|axis| {
        let n = lattice.dims[axis];
        match eye {
            None if columns[axis].z > 0.0 => 0,
            None => n,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            Some(eye) => (eye[axis].floor() + 1.0).clamp(0.0, n as f64) as usize,
        }
    });
    Traversal { axes, splits }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Projection;

    fn camera(direction: DVec3) -> Camera {
        Camera::new(DVec3::splat(3.5), direction, DVec3::Y, 10.0)
    }

    #[test]
    fn the_most_parallel_axis_is_outermost_and_far_comes_first() {
        let view = View::of(&camera(DVec3::new(0.2, -0.9, 0.4)), &Lattice::unit([8; 3]), [64, 64]);
        assert_eq!(view.traversal.axes, [1, 2, 0]);
        // Along −y the far end is index 0; along +z and +x it is the last.
        assert_eq!(view.traversal.splits, [8, 0, 0]);
    }

    #[test]
    fn in_perspective_both_sides_run_towards_the_eye() {
        let mut camera = camera(DVec3::Z);
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        let view = View::of(&camera, &Lattice::unit([8; 3]), [64, 64]);
        // The eye is at x = y = 3.5, before z = 0.
        assert_eq!(view.traversal, Traversal { axes: [2, 0, 1], splits: [0, 4, 4] });
    }

    #[test]
    fn a_far_origin_costs_no_precision() {
        let near = Lattice::unit([8; 3]);
        let far = Lattice { origin: DVec3::splat(1e7), ..near };
        let mut camera = camera(DVec3::new(0.3, 0.4, 0.5));
        let a = View::of(&camera, &near, [100, 80]);
        camera.focal_point += DVec3::splat(1e7);
        let b = View::of(&camera, &far, [100, 80]);
        assert!((a.view_centre - b.view_centre).length() < 1e-6);
    }

    #[test]
    fn the_octree_is_visited_from_the_eye_and_the_farthest_voxel_is_the_smallest() {
        let mut camera = camera(DVec3::new(0.2, -0.9, 0.4));
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        let lattice = Lattice { spacing: DVec3::new(1.0, 2.0, 0.5), ..Lattice::unit([8; 3]) };
        let view = View::of(&camera, &lattice, [64, 64]);
        let eye = lattice.index_from_world(camera.view_origin());
        let VisitOrder::From(found) = view.visit_order() else { panic!("{view:?}") };
        assert!((found - eye).length() < 1e-9, "{found} {eye}");
        // The least that any corner's longest step is seen as.
        let distance = view.eye_distance.unwrap();
        let least = (0..8)
            .map(|corner: u32| {
                let at = DVec3::from([0, 1, 2].map(|a| f64::from(corner >> a & 1) * 8.0 - 0.5));
                let z = camera.to_view(lattice.world_from_index(at)).z * view.pixels_per_unit;
                2.0 * view.pixels_per_unit * distance / z
            })
            .fold(f64::INFINITY, f64::min);
        assert!((view.voxel_pixels() / least - 1.0).abs() < 1e-9, "{least}");
    }

    #[test]
    fn a_halved_lattice_lies_in_the_middle_of_what_it_stands_for() {
        let mut camera = camera(DVec3::new(0.2, -0.9, 0.4));
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        let spacing = DVec3::new(1.0, 2.0, 0.5);
        let lattice = Lattice { spacing, ..Lattice::unit([13, 9, 2]) };
        let view = View { enlarged: 3.0, ..View::of(&camera, &lattice, [64, 64]) };
        assert_eq!(view.halved(0), view);
        for level in 1..4 {
            let halved = view.halved(level);
            let side: i32 = 1 << level;
            for node in [[0, 0, 0], [3, 1, 0], [1, 7, 2]] {
                // The mean position of the voxels it stands for, were they all there.
                let mut mean = DVec3::ZERO;
                for i in 0..side * side * side {
                    let within = [i % side, i / side % side, i / (side * side)];
                    let voxel = [0, 1, 2].map(|a| f64::from(node[a] * side + within[a]));
                    mean += lattice.world_from_index(DVec3::from(voxel)) / f64::from(side.pow(3));
                }
                let expected = camera.to_view(mean) * view.pixels_per_unit;
                let index = DVec3::from(node.map(f64::from));
                let found =
                    halved.view_centre + halved.view_from_index * (index - halved.lattice_centre);
                assert!((found - expected).length() < 1e-9, "{level} {node:?}: {found} {expected}");
            }
            assert_eq!((halved.size, halved.enlarged), (view.size, 3.0));
            assert_eq!(halved.pixels_per_unit, view.pixels_per_unit);
        }
    }

    #[test]
    fn rays_are_for_pixels_as_they_are_shown_and_by_the_axis_that_counts() {
        let mut camera = camera(DVec3::Y);
        camera.parallel_scale = 64.0;
        let lattice = Lattice { spacing: DVec3::new(1.0, 1.0, 4.0), ..Lattice::unit([8; 3]) };
        let view = View::of(&camera, &lattice, [64, 64]);
        let rays = |view: &View, kernel| view.rays_per_side(kernel, None);
        // Voxels are two pixels long, by which boxes go, and half a pixel wide, by which kernels go.
        assert_eq!([Kernel::Nearest, Kernel::Linear].map(|kernel| rays(&view, kernel)), [1, 2]);
        let shown = View { enlarged: 2.0, ..view };
        assert_eq!(rays(&shown, Kernel::Linear), 1);
    }

    #[test]
    fn an_eye_as_near_as_kernels_reach_is_among_them() {
        let mut camera = camera(DVec3::Z);
        camera.projection = Projection::Perspective { view_angle: 1.0 };
        camera.focal_point.z += camera.view_origin().z.abs() - 1.0;
        let view = View::of(&camera, &Lattice::unit([8; 3]), [64, 64]);
        assert!(view.has_eye_within(1.0) && !view.has_eye_within(0.25));
    }

    #[test]
    fn the_shorter_axis_of_a_kernel_is_that_of_its_ellipse() {
        let camera = camera(DVec3::new(0.2, -0.9, 0.4));
        let lattice = Lattice { spacing: DVec3::new(1.0, 2.0, 500.0), ..Lattice::unit([8; 3]) };
        let view = View::of(&camera, &lattice, [64, 64]);
        // The shadow of the unit sphere's image: least over all directions on the picture.
        let rows = view.view_from_index.transpose();
        let width = |angle: f64| (rows.x_axis * angle.cos() + rows.y_axis * angle.sin()).length();
        let least = (0..100_000).map(|i| width(f64::from(i) * 1e-5 * std::f64::consts::PI));
        let least = least.fold(f64::INFINITY, f64::min);
        assert!((view.narrowest_voxel_pixels() / least - 1.0).abs() < 1e-3, "{least}");
        let cubes = View::of(&camera, &Lattice::unit([8; 3]), [64, 64]);
        assert!((cubes.narrowest_voxel_pixels() / cubes.voxel_pixels() - 1.0).abs() < 1e-9);
    }
}
