//! *Composite every sample* (Westover §3.5): each kernel's optical depth, laid over what is behind.

use glam::{DMat3, DVec2, DVec3};

use super::RefKernel;
use super::line;
use crate::core::Camera;
use crate::core::parallel;
use crate::kernel::{Kernel, RadialKernel};

/// Pixels before an edge that a point already counts to the pixel behind it.
const POINT_TIE: f64 = 1.0 / 1024.0;

/// Which line a kernel is integrated along in perspective. Orthographic pictures do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rays {
    /// Depth lines of the projection linearised at the kernel's centre: the model that is drawn.
    Local,
    /// The pixel's own ray from the eye: what the model approximates.
    Exact,
}

/// The picture of kernels given from back to front: linear premultiplied RGBA at the centres of
/// `size` [width, height] pixels, top row first.
///
/// Opacity is 1 − exp(−τ). Radial kernels have `extent` voxels of splat radius. [`Kernel::Nearest`]
/// is the chord of the pixel's own ray in the voxel's box for both kinds of rays. [`Kernel::Point`]
/// is the one pixel that holds the centre, with F ≡ 1: pixels own their left and upper edges, and what
/// lies within 1/1024 of a pixel before them, so that voxels on edges are not left to rounding. [`Kernel::Gouraud`] is the footprint that its
/// mesh approximates; [`super::Reference`] draws the mesh. Linearised kernels centred at or behind the
/// eye are not drawn; exact rays begin at the eye.
pub fn every_sample(
    kernels: &[RefKernel],
    kernel: Kernel,
    extent: Option<f64>,
    camera: &Camera,
    size: [usize; 2],
    rays: Rays,
) -> Vec<[f64; 4]> {
    let [width, height] = size;
    let view = View::new(camera, size);
    let shape = RadialKernel::new(kernel, extent);
    let splats =
        parallel::list(kernels.len(), |i| Splat::new(&kernels[i], kernel, shape, &view, rays));
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); height];
    for (i, splat) in splats.iter().enumerate() {
        rows[splat.rows[0]..splat.rows[1]].iter_mut().for_each(|row| row.push(i));
    }
    let mut picture = vec![[0.0; 4]; width * height];
    let rows = picture.chunks_mut(width.max(1)).zip(rows);
    parallel::each(rows.enumerate(), |(y, (pixels, row))| {
        for i in row {
            let (splat, kernel) = (&splats[i], &kernels[i]);
            let [left, right] = splat.columns;
            for (x, pixel) in pixels.iter_mut().enumerate().take(right).skip(left) {
                let depth = kernel.extinction * splat.length(&view, [x, y]);
                *pixel = over(-(-depth).exp_m1(), kernel.colour, *pixel);
            }
        }
    });
    picture
}

/// One more layer in front: α·c + (1 − α)·behind, premultiplied.
fn over(alpha: f64, [r, g, b]: [f64; 3], behind: [f64; 4]) -> [f64; 4] {
    let front = [r, g, b, 1.0];
    std::array::from_fn(|i| alpha * front[i] + (1.0 - alpha) * behind[i])
}

/// A camera with its numbers worked out. Screen units are world units at the focal plane, y up.
pub(super) struct View<'a> {
    pub(super) camera: &'a Camera,
    size: [f64; 2],
    pixels_per_unit: f64,
    pub(super) eye_distance: Option<f64>,
    rotation: DMat3,
}

impl<'a> View<'a> {
    pub(super) fn new(camera: &'a Camera, size: [usize; 2]) -> Self {
        let size = size.map(|n| n as f64);
        Self {
            camera,
            size,
            pixels_per_unit: camera.pixels_per_unit(size[1]),
            eye_distance: camera.eye_distance(),
            rotation: camera.view_from_world_rotation(),
        }
    }

    /// Screen position of a pixel's centre.
    pub(super) fn screen(&self, [x, y]: [usize; 2]) -> DVec2 {
        let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        DVec2::new(pixel.x - self.size[0] / 2.0, self.size[1] / 2.0 - pixel.y)
            / self.pixels_per_unit
    }

    /// Length of a pixel's ray per view depth: 1/cos θ.
    pub(super) fn stretch(&self, screen: DVec2) -> f64 {
        self.eye_distance.map_or(1.0, |d| (screen / d).extend(1.0).length())
    }

    /// Screen position of a kernel's centre, given in view space before the eye, and the projection
    /// linearised there: (screen x, y, view depth) from kernel space.
    pub(super) fn linearised(&self, k: &RefKernel, centre: DVec3) -> (DVec2, DMat3) {
        let shrink = self.eye_distance.map_or(1.0, |d| d / centre.z);
        let at = centre.truncate() * shrink;
        // ∂(d·x/z, d·y/z, z)/∂(x, y, z), written out by rows.
        let lean = self.eye_distance.map_or(DVec2::ZERO, |_| -at / centre.z);
        let jacobian =
            DMat3::from_cols(DVec3::X * shrink, DVec3::Y * shrink, DVec3::new(lean.x, lean.y, 1.0));
        (at, jacobian * self.rotation * k.map)
    }

    /// Rows or columns whose centres lie between two screen positions, as a half-open range.
    pub(super) fn pixels(&self, axis: usize, low: f64, high: f64) -> [usize; 2] {
        let to_pixel = |s: f64| {
            let s = if axis == 0 { s } else { -s };
            s * self.pixels_per_unit + self.size[axis] / 2.0 - 0.5
        };
        let (a, b) = (to_pixel(low), to_pixel(high));
        let last = self.size[axis];
        [
            a.min(b).ceil().clamp(0.0, last) as usize,
            (a.max(b).floor() + 1.0).clamp(0.0, last) as usize,
        ]
    }
}

/// How a kernel's length of unit density is found at a pixel.
enum Method {
    /// Kernel space from (screen offset, view depth), about this screen position.
    Local { shape: RadialKernel, kernel_from_screen: DMat3, at: DVec2 },
    /// Kernel space from the world, about this point; a box for `None`.
    Exact { shape: Option<RadialKernel>, kernel_from_world: DMat3, centre: DVec3 },
    /// The same everywhere.
    Point { depth: f64 },
}

/// A kernel on the picture: the pixels it may touch, and how.
pub(super) struct Splat {
    method: Option<Method>,
    pub(super) columns: [usize; 2],
    pub(super) rows: [usize; 2],
}

impl Splat {
    const NOTHING: Self = Self { method: None, columns: [0; 2], rows: [0; 2] };

    pub(super) fn new(
        k: &RefKernel,
        kind: Kernel,
        shape: Option<RadialKernel>,
        view: &View,
        rays: Rays,
    ) -> Self {
        let centre = view.camera.to_view(k.centre);
        let in_front = view.eye_distance.is_none() || centre.z > 0.0;
        if !(k.extinction > 0.0 && k.extinction.is_finite() && k.map.determinant() != 0.0) {
            return Self::NOTHING;
        }
        let exact = kind == Kernel::Nearest || (rays == Rays::Exact && kind != Kernel::Point);
        if exact {
            return Self::exact(k, shape, centre, view);
        }
        if !in_front {
            return Self::NOTHING;
        }
        let (at, screen_from_kernel) = view.linearised(k, centre);
        let across = screen_from_kernel.transpose();
        let Some(shape) = shape else {
            let depth = screen_from_kernel.determinant().abs()
                / across.x_axis.cross(across.y_axis).length();
            return Self::point(at, depth, view);
        };
        let half = DVec2::new(across.x_axis.length(), across.y_axis.length()) * shape.radius();
        let kernel_from_screen = screen_from_kernel.inverse();
        Self {
            method: Some(Method::Local { shape, kernel_from_screen, at }),
            columns: view.pixels(0, at.x - half.x, at.x + half.x),
            rows: view.pixels(1, at.y - half.y, at.y + half.y),
        }
    }

    fn point(at: DVec2, depth: f64, view: &View) -> Self {
        let pixel = DVec2::new(at.x, -at.y) * view.pixels_per_unit + DVec2::from(view.size) / 2.0;
        let pixel = pixel + POINT_TIE;
        let inside = |p: f64, n: f64| (0.0..n).contains(&p);
        if !(inside(pixel.x, view.size[0]) && inside(pixel.y, view.size[1])) {
            return Self::NOTHING;
        }
        let (x, y) = (pixel.x as usize, pixel.y as usize);
        Self { method: Some(Method::Point { depth }), columns: [x, x + 1], rows: [y, y + 1] }
    }

    fn exact(k: &RefKernel, shape: Option<RadialKernel>, centre: DVec3, view: &View) -> Self {
        // A sphere about the ellipsoid, or about the box.
        let reach = shape.map_or(0.75_f64.sqrt(), RadialKernel::radius);
        let m = k.map;
        let norm =
            (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared())
                .sqrt();
        let radius = reach * norm;
        let bound = |x: f64, axis: usize| -> [f64; 2] {
            let Some(d) = view.eye_distance else { return [x - radius, x + radius] };
            let (near, far) = (centre.z - radius, centre.z + radius);
            if near <= 0.0 {
                let all = view.size[axis] / view.pixels_per_unit;
                return [-all, all];
            }
            let low = (x - radius) * d;
            let high = (x + radius) * d;
            [(low / near).min(low / far), (high / near).max(high / far)]
        };
        if view.eye_distance.is_some() && centre.z + radius <= 0.0 {
            return Self::NOTHING;
        }
        let ([left, right], [low, high]) = (bound(centre.x, 0), bound(centre.y, 1));
        let kernel_from_world = k.map.inverse();
        Self {
            method: Some(Method::Exact { shape, kernel_from_world, centre: k.centre }),
            columns: view.pixels(0, left, right),
            rows: view.pixels(1, low, high),
        }
    }

    /// ∫ H along a pixel's ray, world units.
    pub(super) fn length(&self, view: &View, pixel: [usize; 2]) -> f64 {
        let screen = view.screen(pixel);
        match self.method {
            None => 0.0,
            Some(Method::Point { depth }) => depth * view.stretch(screen),
            Some(Method::Local { shape, kernel_from_screen, at }) => {
                let start = kernel_from_screen * (screen - at).extend(0.0);
                let step = kernel_from_screen.z_axis;
                line::radial(shape, start, step, line::ENDLESS) * view.stretch(screen)
            }
            Some(Method::Exact { shape, kernel_from_world, centre }) => {
                let pixel = DVec2::new(pixel[0] as f64 + 0.5, pixel[1] as f64 + 0.5);
                let (origin, direction) = view.camera.ray(pixel, view.size);
                let start = kernel_from_world * (origin - centre);
                let step = kernel_from_world * direction;
                let from = view.eye_distance.map_or(f64::NEG_INFINITY, |_| 0.0);
                match shape {
                    Some(shape) => line::radial(shape, start, step, [from, f64::INFINITY]),
                    None => line::voxel_chord(start, step, [from, f64::INFINITY]),
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
