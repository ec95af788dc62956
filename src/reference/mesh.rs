//! Splats as meshes of triangles (Laur–Hanrahan §2): barycentric coordinates at every pixel.

use glam::{DMat3, DVec2, DVec3};

use super::RefKernel;
use super::picture::View;
use crate::core::Camera;
use crate::core::parallel;
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
        let splats = parallel::list(kernels.len(), |i| splat(&kernels[i]));
        let splats: Vec<Splat> = splats.into_iter().flatten().collect();
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

#[cfg(test)]
mod tests {
    use super::super::support::{bump, difference, in_perspective, scene};
    use super::super::{Rays, Reference, every_sample, grid_kernels};
    use super::*;
    use crate::kernel::{Kernel, Subdivisions};
    use crate::scene::{Scene, SplatSettings};
    use crate::volume::Lattice;

    const SIZE: [usize; 2] = [40, 36];

    fn meshes(angles: u32, rings: u32) -> SplatSettings {
        let gouraud = Subdivisions { angles, rings };
        SplatSettings { kernel: Kernel::Gouraud, gouraud, ..SplatSettings::SHADE_FIRST }
    }

    fn one(opacity: f64, splat: SplatSettings) -> Scene {
        let lattice = Lattice::unit([1, 1, 1]);
        scene(lattice, |_| 1.0, vec![(0.0, opacity)], splat, DVec3::NEG_Z)
    }

    /// Where rings are circles of so many corners, the picture is linear in the circumradius of the
    /// ring through a pixel: no triangles are needed to say so.
    #[test]
    fn one_round_mesh_is_linear_from_ring_to_ring() {
        for (angles, rings) in [(3, 1), (7, 2), (8, 4)] {
            for model in [OpacityModel::OpticalDepth, OpacityModel::Published] {
                let splat = SplatSettings { opacity_model: model, ..meshes(angles, rings) };
                let scene = one(0.7, splat);
                let picture = Reference::new(&scene, SIZE).unwrap().picture();
                let shape = RadialKernel::new(Kernel::Gouraud, None).unwrap();
                let mesh = SplatMesh::of(shape, splat.gouraud);
                let knots: Vec<(f64, f64)> = (0..=rings)
                    .map(|ring| {
                        let first = if ring > 0 { 1 + (ring - 1) * angles } else { 0 };
                        let vertex = mesh.vertices[first as usize];
                        let alpha = match model {
                            OpacityModel::OpticalDepth => 1.0 - 0.3_f64.powf(vertex.factor),
                            OpacityModel::Published => 0.7 * vertex.factor,
                        };
                        (vertex.position.length() * shape.radius(), alpha)
                    })
                    .collect();
                let sector = 2.0 * std::f64::consts::PI / f64::from(angles);
                let mut seen = 0;
                for (i, pixel) in picture.iter().enumerate() {
                    // Four world units down the picture, and the middle of each pixel.
                    let [x, y] = [i % SIZE[0], i / SIZE[0]].map(|p| p as f64 + 0.5);
                    let at = DVec2::new(x - 20.0, 18.0 - y) * (4.0 / 36.0);
                    // From the nearest edge's middle: corners are half a sector from the x axis.
                    let turn = (at.y.atan2(at.x) / sector).round() * sector;
                    let ring = at.dot(DVec2::from_angle(turn)) / (sector / 2.0).cos();
                    let band = knots.windows(2).find(|k| ring <= k[1].0);
                    let alpha = band.map_or(0.0, |k| {
                        k[0].1 + (k[1].1 - k[0].1) * (ring - k[0].0) / (k[1].0 - k[0].0)
                    });
                    assert!((pixel[3] - alpha).abs() < 1e-12, "{angles} {i}: {pixel:?} {alpha}");
                    seen += usize::from(alpha > 0.0);
                }
                assert!(seen > 150, "{seen} pixels");
            }
        }
    }

    /// Measured, the greatest difference to footprints at each doubling: 1.6e-2, 4.1e-3, 1.3e-3.
    #[test]
    fn meshes_converge_to_footprints_in_perspective_on_sheared_axes() {
        let direction =
            DMat3::from_cols(DVec3::X, DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.4, 1.0));
        let dims = [4, 3, 5];
        let lattice =
            Lattice { direction, spacing: DVec3::new(1.0, 1.0, 2.0), ..Lattice::unit(dims) };
        let opacity = vec![(0.2, 0.0), (1.0, 0.4)];
        let view = DVec3::new(0.4, -0.3, 0.8);
        let draw = |splat| {
            in_perspective(scene(lattice, bump(dims, 2.0), opacity.clone(), splat, view), 0.5)
        };
        let scene = draw(meshes(8, 4));
        let kernels = grid_kernels(&scene);
        let even = every_sample(&kernels, Kernel::Cubic, None, &scene.camera, SIZE, Rays::Local);
        let errors = [(8, 4), (16, 8), (32, 16)].map(|(angles, rings)| {
            let picture = Reference::new(&draw(meshes(angles, rings)), SIZE).unwrap().picture();
            difference(&picture, &even)
        });
        println!("measured meshes to footprints: {errors:?}");
        assert!(errors[0] < 0.03 && errors[2] > 1e-5, "{errors:?}");
        for pair in errors.windows(2) {
            assert!((2.5..6.5).contains(&(pair[0] / pair[1])), "{errors:?}");
        }
    }

    #[test]
    fn published_opacities_end_at_1_and_what_cannot_be_seen_is_left_out() {
        let mut published = one(0.999, meshes(8, 4));
        published.splat.opacity_model = OpacityModel::Published;
        published.splat.opacity_unit_distance = Some(0.4);
        let picture = Reference::new(&published, SIZE).unwrap().picture();
        let most = picture.iter().map(|p| p[3]).fold(0.0, f64::max);
        assert_eq!(most, 1.0);
        let behind = RefKernel {
            centre: DVec3::Z * 50.0,
            map: DMat3::IDENTITY,
            extinction: 1.0,
            colour: [1.0; 3],
        };
        let flat = RefKernel {
            centre: DVec3::ZERO,
            map: DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)),
            ..behind
        };
        let clear = RefKernel { centre: DVec3::ZERO, extinction: f64::NAN, ..behind };
        let scene = in_perspective(one(0.5, meshes(8, 4)), 0.6);
        let nothing = Reference::of_kernels(vec![behind, flat, clear], &scene, SIZE, false);
        assert!(nothing.unwrap().picture().iter().all(|p| *p == [0.0; 4]));
    }
}
