//! A grid as kernels, from back to front.

use glam::{DMat3, DVec3};

use super::shading::SampleShader;
use crate::core::Camera;
use crate::scene::{OpacityModel, Scene};
use crate::transfer::extinction_from_opacity;
use crate::volume::Lattice;

/// One kernel of a picture, in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefKernel {
    /// Its middle.
    pub centre: DVec3,
    /// World from kernel space, where 1 is a voxel; for a grid the lattice's steps as columns.
    pub map: DMat3,
    /// Extinction κ per world unit where h is 1; ≥ 0 and finite.
    pub extinction: f64,
    /// Linear light.
    pub colour: [f64; 3],
}

/// The kernels of a scene's volume that can be seen, in the order of [`traversal`].
///
/// The function is asked for each value itself, not tabulated. Samples are shaded where the scene's mode
/// does that first.
pub fn grid_kernels(scene: &Scene) -> Vec<RefKernel> {
    let Some((volume, transfer)) = scene.volume().zip(scene.drawn_transfer()) else {
        return Vec::new();
    };
    let shader = SampleShader::of(scene, false);
    let published = scene.splat.opacity_model == OpacityModel::Published;
    let transfer = match &shader {
        Some(_) => scene.shading.by_value(&transfer),
        None => transfer.into_owned(),
    };
    let lattice = volume.lattice;
    let map = lattice.axes();
    let unit = scene.opacity_unit_distance();
    traversal(&lattice, &scene.camera)
        .into_iter()
        .filter_map(|[x, y, z]| {
            let sample = (z * lattice.dims[1] + y) * lattice.dims[0] + x;
            let value = volume.samples.get(sample);
            let mut depth = extinction_from_opacity(transfer.opacity_at(value));
            let mut colour = transfer.colour_at(value).0;
            if let Some(shader) = &shader {
                // Tables multiply opacities where those are what is published.
                let weight = if published { -(-depth).exp_m1() } else { depth };
                let [r, g, b] = colour.map(|c| c * weight);
                let [weight, rgb @ ..] = shader.shaded([weight, r, g, b], [x, y, z]);
                depth = if published { -(-weight.min(1.0)).ln_1p() } else { weight };
                colour = rgb.map(|c| if weight > 0.0 { c / weight } else { 0.0 });
            }
            (depth > 0.0).then(|| RefKernel {
                centre: lattice.world_from_index(DVec3::new(x as f64, y as f64, z as f64)),
                map,
                extinction: depth / unit,
                colour,
            })
        })
        .collect()
}

/// Every sample of a lattice from back to front (Westover §3.6): the axis most along the view is the
/// outermost loop, then the second, then the third, each from far to near. Axes whose cosines to
/// the view agree in nine digits tie, and keep their order.
///
/// In perspective far to near runs along each axis from both ends towards the eye: first the side of
/// the higher indices, then the other.
pub fn traversal(lattice: &Lattice, camera: &Camera) -> Vec<[usize; 3]> {
    let (order, runs) = loops(lattice, camera);
    let mut visited = Vec::with_capacity(lattice.len());
    for &outer in &runs[0] {
        for &middle in &runs[1] {
            for &inner in &runs[2] {
                let mut index = [0; 3];
                index[order[0]] = outer;
                index[order[1]] = middle;
                index[order[2]] = inner;
                visited.push(index);
            }
        }
    }
    visited
}

/// The loops of [`traversal`]: axes, outermost first, and the indices along each as they come.
pub(super) fn loops(lattice: &Lattice, camera: &Camera) -> ([usize; 3], [Vec<usize>; 3]) {
    let axes = lattice.axes();
    let along = [axes.x_axis, axes.y_axis, axes.z_axis]
        .map(|step| step.normalize_or_zero().dot(camera.direction));
    let steepness = along.map(|cosine| (cosine.abs() * 1e9).round());
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| steepness[b].total_cmp(&steepness[a]));
    let eye = camera.eye_distance().map(|_| lattice.index_from_world(camera.view_origin()));
    let runs = order.map(|axis| {
        let count = lattice.dims[axis];
        match eye {
            Some(eye) => towards(count, eye[axis]),
            None if along[axis] > 0.0 => (0..count).rev().collect(),
            None => (0..count).collect(),
        }
    });
    (order, runs)
}

/// 0..count from both ends towards `eye`, the higher side first.
fn towards(count: usize, eye: f64) -> Vec<usize> {
    let above = (0..count).rev().filter(|&i| i as f64 > eye);
    let below = (0..count).filter(|&i| i as f64 <= eye);
    above.chain(below).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Projection;

    fn lattice() -> Lattice {
        Lattice {
            spacing: DVec3::new(1.0, -2.0, 0.5),
            origin: DVec3::new(-2.0, 3.0, 0.0),
            ..Lattice::unit([5, 4, 6])
        }
    }

    #[test]
    fn every_sample_is_visited_once_from_anywhere() {
        for projection in [Projection::Orthographic, Projection::Perspective { view_angle: 0.9 }] {
            for direction in [DVec3::Z, DVec3::NEG_X, DVec3::new(0.4, -0.5, 0.3)] {
                let mut camera = Camera::new(lattice().centre(), direction, DVec3::Y, 0.7);
                camera.projection = projection;
                let mut visited = traversal(&lattice(), &camera);
                assert_eq!(visited.len(), 120);
                visited.sort_unstable();
                visited.dedup();
                assert_eq!(visited.len(), 120);
            }
        }
    }

    #[test]
    fn along_every_axis_the_far_comes_before_the_near() {
        let lattice = lattice();
        for projection in [Projection::Orthographic, Projection::Perspective { view_angle: 1.2 }] {
            for direction in [DVec3::new(0.1, 0.2, -0.9), DVec3::new(-0.7, 0.6, 0.2)] {
                // The eye is inside the volume in perspective.
                let mut camera = Camera::new(lattice.centre(), direction, DVec3::Y, 0.4);
                camera.projection = projection;
                let visited = traversal(&lattice, &camera);
                let place = |index: [usize; 3]| visited.iter().position(|v| *v == index).unwrap();
                let eye = lattice.index_from_world(camera.view_origin());
                for &index in &visited {
                    for axis in 0..3 {
                        let mut next = index;
                        next[axis] += 1;
                        if next[axis] == lattice.dims[axis] {
                            continue;
                        }
                        let step = lattice.axes().col(axis);
                        let next_is_far = match projection {
                            Projection::Orthographic => step.dot(camera.direction) > 0.0,
                            Projection::Perspective { .. } if index[axis] as f64 > eye[axis] => {
                                true
                            }
                            Projection::Perspective { .. } if next[axis] as f64 <= eye[axis] => {
                                false
                            }
                            Projection::Perspective { .. } => continue,
                        };
                        assert_eq!(place(next) < place(index), next_is_far, "{index:?} {axis}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_axis_most_along_the_view_is_outermost_whatever_its_spacing() {
        let camera = Camera::new(DVec3::ZERO, DVec3::new(0.5, 0.3, 0.8), DVec3::Y, 1.0);
        let visited = traversal(&lattice(), &camera);
        assert!(visited[..20].iter().all(|v| v[2] == 5), "{:?}", &visited[..20]);
    }
}
