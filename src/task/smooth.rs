//! Smooth edges: a picture is drawn again through four more places of its pixels, and the mean of the five is shown.
//!
//! Each ray goes through the middle of its pixel, so that what ends within one, as an isosurface, a slice, a cut or a named thing
//! does, ends in steps. The five places lie on a turned grid, no two of them in one row or column (the rotated grid of graphics
//! processors: edges that are nearly upright or level, whose steps are the longest, gain most). Kernels have no such edges.

use super::draw::{DrawError, Drawer, Observer, Rung};
use super::engines::Canvas;
use crate::core::Camera;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::Inside;

/// Where else in a pixel rays go, from its middle to the right and up, pixels.
pub(super) const PLACES: [[f64; 2]; 4] = [[-0.4, -0.2], [-0.2, 0.4], [0.2, -0.4], [0.4, 0.2]];

/// Rays a pixel of a picture whose edges are smooth.
#[expect(clippy::cast_possible_truncation, reason = "5")]
pub const RAYS: u32 = PLACES.len() as u32 + 1;

/// Whether something on the picture of a plan ends within a pixel. Vectors' marks and polygons do not: both are averaged over each
/// pixel as they are drawn.
pub fn has_edges(plan: &Plan) -> bool {
    let Inside { clip, slices, isosurfaces, .. } = &plan.inside;
    let has_border =
        matches!(plan.mode.kernel, Kernel::Nearest | Kernel::Cells | Kernel::Ellipsoids);
    let is_looked_into = !slices.is_empty() || !isosurfaces.is_empty() || clip.cuts();
    plan.field().is_some() && plan.reconstructs() && (has_border || is_looked_into)
}

/// What sees a picture of so many rows through another place of its pixels.
pub(super) fn shifted(camera: &Camera, [right, up]: [f64; 2], rows: u32) -> Camera {
    let pixel = 2.0 * camera.parallel_scale / f64::from(rows.max(1));
    let by = camera.right() * (right * pixel) + camera.up * (up * pixel);
    Camera { focal_point: camera.focal_point + by, ..*camera }
}

/// A picture that is averaged with others of its size: premultiplied linear RGBA.
#[derive(Debug)]
pub(super) struct Mean {
    sum: Vec<[f32; 4]>,
    count: u16,
}

impl Mean {
    /// Of one.
    pub(super) fn of(light: Vec<[f32; 4]>) -> Self {
        Self { sum: light, count: 1 }
    }

    /// And another one.
    pub(super) fn add(&mut self, light: &[[f32; 4]]) {
        debug_assert_eq!(self.sum.len(), light.len(), "pictures of one size");
        for (sum, pixel) in self.sum.iter_mut().zip(light) {
            *sum = std::array::from_fn(|c| sum[c] + pixel[c]);
        }
        self.count += 1;
    }

    pub(super) fn light(self) -> Vec<[f32; 4]> {
        let share = 1.0 / f32::from(self.count);
        self.sum.into_iter().map(|sum| sum.map(|channel| channel * share)).collect()
    }
}

/// One of several pictures, of which an observer is told how far all of them are.
struct Part<'a> {
    observer: &'a mut dyn Observer,
    before: f64,
    share: f64,
}

impl Observer for Part<'_> {
    fn piece_done(&mut self, picture: &mut dyn Canvas, done: f64) -> bool {
        self.observer.piece_done(picture, self.before + self.share * done)
    }

    fn is_overtaken(&mut self) -> bool {
        self.observer.is_overtaken()
    }

    fn piece_ms(&self) -> f64 {
        self.observer.piece_ms()
    }
}

impl Drawer {
    /// The finished picture of a plan with smooth edges, from its light through the middles of its pixels. The engine's picture is
    /// another one afterwards.
    ///
    /// # Errors
    /// Interrupted by the observer, or the device.
    pub(super) fn smoothed(
        &mut self,
        plan: &Plan,
        light: Vec<[f32; 4]>,
        observer: &mut dyn Observer,
    ) -> Result<Vec<[f32; 4]>, DrawError> {
        self.aside(|drawer| {
            let mut mean = Mean::of(light);
            let share = 1.0 / PLACES.len() as f64;
            for (i, place) in PLACES.into_iter().enumerate() {
                let camera = shifted(&plan.camera, place, plan.size[1]);
                let plan = Plan { camera, ..plan.clone() };
                let mut part = Part { observer: &mut *observer, before: i as f64 * share, share };
                drawer.draw(&plan, Rung::Full, &mut part)?;
                mean.add(&drawer.engines.read_light()?);
            }
            Ok(mean.light())
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;

    /// No two places are in one row or column, the mean of all is the middle, and each is √0.2 from four others, those of the
    /// neighbouring pixels counted: a square grid, turned.
    #[test]
    fn places_are_a_turned_grid() {
        let mut places = vec![DVec2::ZERO];
        places.extend(PLACES.map(DVec2::from_array));
        assert_eq!(places.len(), RAYS as usize);
        let sum: DVec2 = places.iter().sum();
        assert!(sum.length() < 1e-12, "{sum}");
        for axis in 0..2 {
            let mut along: Vec<f64> = places.iter().map(|place| place[axis]).collect();
            along.sort_by(f64::total_cmp);
            assert_eq!(along, [-0.4, -0.2, 0.0, 0.2, 0.4]);
        }
        for place in &places {
            let mut near = 0;
            for other in &places {
                for pixel in 0..9 {
                    let pixel = DVec2::new(f64::from(pixel % 3 - 1), f64::from(pixel / 3 - 1));
                    let distance = (*other + pixel - *place).length();
                    near += i32::from((distance - 0.2_f64.sqrt()).abs() < 1e-12);
                }
            }
            assert_eq!(near, 4, "{place}");
        }
    }

    #[test]
    fn a_shifted_camera_sees_the_middle_elsewhere_in_its_pixel() {
        let camera = Camera::new(DVec3::new(1.0, 2.0, 3.0), DVec3::NEG_Z, DVec3::Y, 5.0);
        // Ten units over a hundred rows.
        let seen = shifted(&camera, [0.4, -0.2], 100).focal_point - camera.focal_point;
        assert!((seen - DVec3::new(0.04, -0.02, 0.0)).length() < 1e-12, "{seen}");
    }

    #[test]
    fn a_mean_is_of_all_channels_of_all_pictures() {
        let mut mean = Mean::of(vec![[1.0, 0.0, 0.5, 1.0], [0.0; 4]]);
        mean.add(&[[0.0, 0.0, 0.5, 0.0], [1.0; 4]]);
        assert_eq!(mean.light(), [[0.5, 0.0, 0.5, 0.5], [0.5; 4]]);
    }
}
