//! Splats as meshes of triangles (Laur–Hanrahan §2): barycentric coordinates at every pixel.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::RefKernel;
use super::picture::View;
use crate::core::Camera;
use crate::kernel::{RadialKernel, SplatMesh};
use crate::scene::OpacityModel;
use crate::transfer::TRANSMITTANCE_FLOOR;

/// How far beyond an edge, as a part of its triangle, a pixel on the edge may come to lie.
const ROUNDING: f64 = 1e-12;

/// Kernels as meshes on one picture, from back to front.
///
/// Each mesh lies in the picture, on the ellipse of the projection linearised at its kernel's centre,
/// with the premultiplied light of 1 − exp(−depth) at its corners, or of the published opacity α·F;
/// between corners light is linear on the screen, as hardware of constant depth shades it. A corner's
/// depth is along its own ray, as long as 1/cos θ in perspective.
pub(super) struct Meshes {
    size: [usize; 2],
    splats: Vec<Splat>,
    /// Splats that may touch each row.
    rows: Vec<Vec<usize>>,
    triangles: Vec<[u16; 3]>,
}

struct Splat {
    /// Screen positions, and premultiplied light.
    corners: Vec<(DVec2, [f64; 4])>,
    columns: [usize; 2],
    rows: [usize; 2],
}

impl Meshes {
    /// Kernels given from back to front. `unit` is the world length over which opacities hold. Those
    /// centred at or behind the eye are not drawn.
    pub(super) fn new(
        kernels: &[RefKernel],
        mesh: SplatMesh,
        shape: RadialKernel,
        camera: &Camera,
        size: [usize; 2],
        (model, unit): (OpacityModel, f64),
    ) -> Self {
        let view = View::new(camera, size);
        let splat = |k: &RefKernel| Splat::new(k, &mesh, shape, &view, (model, unit));
        let splats: Vec<Splat> = kernels.par_iter().filter_map(splat).collect();
        let mut rows = vec![Vec::new(); size[1]];
        for (i, splat) in splats.iter().enumerate() {
            rows[splat.rows[0]..splat.rows[1]].iter_mut().for_each(|row| row.push(i));
        }
        Self { size, splats, rows, triangles: mesh.triangles }
    }

    /// The pixel at [column, row], through a camera that sees as the one before.
    pub(super) fn pixel(&self, camera: &Camera, [x, y]: [usize; 2]) -> [f64; 4] {
        let at = View::new(camera, self.size).screen([x, y]);
        let mut pixel = [0.0; 4];
        for &i in &self.rows[y] {
            let splat = &self.splats[i];
            if !(splat.columns[0]..splat.columns[1]).contains(&x) {
                continue;
            }
            if let Some(mut light) = splat.light(&self.triangles, at) {
                let most = light[3].max(1.0);
                light.iter_mut().for_each(|c| *c /= most);
                let left = 1.0 - light[3];
                pixel.iter_mut().zip(light).for_each(|(p, c)| *p = c + left * *p);
            }
        }
        pixel
    }
}

impl Splat {
    fn new(
        k: &RefKernel,
        mesh: &SplatMesh,
        shape: RadialKernel,
        view: &View,
        (model, unit): (OpacityModel, f64),
    ) -> Option<Self> {
        let centre = view.camera.to_view(k.centre);
        let seen = view.eye_distance.is_none() || centre.z > 0.0;
        let sound = k.extinction > 0.0 && k.extinction.is_finite() && k.map.determinant() != 0.0;
        if !(seen && sound) {
            return None;
        }
        let (at, screen_from_kernel) = view.linearised(k, centre);
        let across = screen_from_kernel.transpose();
        let unit_from = triangle(across);
        // View depth per voxel of the kernel along a line of depth.
        let depth = 1.0 / (screen_from_kernel.inverse() * DVec3::Z).length();
        // α·F in the published form, with F over the unit distance.
        let weight = match model {
            OpacityModel::OpticalDepth => k.extinction,
            OpacityModel::Published => {
                (-(-k.extinction * unit).exp_m1()).min(1.0 - TRANSMITTANCE_FLOOR) / unit
            }
        };
        let [r, g, b] = k.colour;
        let corners: Vec<(DVec2, [f64; 4])> = mesh
            .vertices
            .iter()
            .map(|vertex| {
                let screen = at + unit_from * vertex.position * shape.radius();
                let length = vertex.factor / shape.scale().powi(2) * depth * view.stretch(screen);
                let alpha = match model {
                    OpacityModel::OpticalDepth => -(-weight * length).exp_m1(),
                    OpacityModel::Published => weight * length,
                };
                (screen, [alpha * r, alpha * g, alpha * b, alpha])
            })
            .collect();
        let (low, high) = corners
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), (screen, _)| {
                (low.min(*screen), high.max(*screen))
            });
        let columns = view.pixels(0, low.x, high.x);
        let rows = view.pixels(1, low.y, high.y);
        Some(Self { corners, columns, rows })
    }

    /// Light at a place on the screen, by the first triangle that holds it.
    fn light(&self, triangles: &[[u16; 3]], at: DVec2) -> Option<[f64; 4]> {
        triangles.iter().find_map(|corners| {
            let [a, b, c] = corners.map(|i| &self.corners[usize::from(i)]);
            let whole = (b.0 - a.0).perp_dot(c.0 - a.0);
            let part = |p: DVec2, q: DVec2| (p - at).perp_dot(q - at) / whole;
            let (u, v, w) = (part(b.0, c.0), part(c.0, a.0), part(a.0, b.0));
            let inside = u.min(v).min(w) >= -ROUNDING;
            inside.then(|| std::array::from_fn(|i| u * a.1[i] + v * b.1[i] + w * c.1[i]))
        })
    }
}

/// The lower triangular map from the kernel's unit disc to the screen: Cholesky's factor of the Gram
/// matrix of the first two rows, whose transposed matrix is given.
fn triangle(rows: DMat3) -> glam::DMat2 {
    let (x, y) = (rows.x_axis, rows.y_axis);
    let along = y.dot(x) / x.length();
    let rest = (y.length_squared() - along * along).max(0.0).sqrt();
    glam::DMat2::from_cols(DVec2::new(x.length(), along), DVec2::new(0.0, rest))
}
