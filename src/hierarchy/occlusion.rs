//! What still shows through what lies in front, while a cut is fitted front to back.

use glam::{DMat3, DVec2, DVec3};

use super::cut::Visibility;

/// Rays along the longer side of the picture.
const RAYS: f64 = 96.0;

/// The transmittance along a coarse raster of rays, in front of what was not visited yet.
///
/// Each node that was passed is its box, all through of its own extinction. Rays are points: a node
/// is taken for as visible as along the clearest ray within reach of its kernel, or the nearest one, and
/// a gap in front of it that falls between all rays is not seen.
#[derive(Debug, Clone)]
pub(super) struct Occlusion {
    /// Corner of the raster on the picture, pixels from its middle: the part that the volume covers.
    low: DVec2,
    eye_distance: Option<f64>,
    /// Side of a ray's square, pixels.
    step: f64,
    size: [usize; 2],
    transmittance: Vec<f32>,
    index_from_view: DMat3,
    index_origin: DVec3,
    /// Depth of a pixel's length of unit extinction.
    depth_per_pixel: f64,
}

impl Occlusion {
    /// Nothing in front. `dims` are the volume's voxels, `voxel_depth` their thickness in opacity unit
    /// distances.
    pub(super) fn new(visibility: &Visibility, dims: [usize; 3], voxel_depth: f64) -> Self {
        let [low, high] = on_screen(visibility, dims);
        let size = high - low;
        let step = (size.max_element() / RAYS).max(1e-9);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=96")]
        let rays = [size.x, size.y].map(|n| ((n / step).ceil() as usize).max(1));
        let index_from_view = visibility.view_from_index.inverse();
        let voxel_pixels = visibility.view_from_index.determinant().abs().cbrt();
        Self {
            low,
            eye_distance: visibility.eye_distance,
            step,
            size: rays,
            transmittance: vec![1.0; rays[0] * rays[1]],
            index_from_view,
            index_origin: -(index_from_view * visibility.view_origin),
            depth_per_pixel: voxel_depth / voxel_pixels,
        }
    }

    /// The rays, along x or y, that pass within `reach` of `at`; clipped to the raster.
    fn span(&self, at: f64, reach: f64, axis: usize) -> std::ops::Range<usize> {
        let from = at - self.low[axis];
        let low = ((from - reach) / self.step).floor().max(0.0);
        let high = ((from + reach) / self.step).ceil().min(self.size[axis] as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=96")]
        let (low, high) = (low as usize, high.max(0.0) as usize);
        low..high
    }

    /// The greatest transmittance of rays within `reach` of a point at the view-space position
    /// `view`, all in pixels; at least that of the nearest. 1 about the eye.
    pub(super) fn in_front(&self, view: DVec3, reach: f64) -> f64 {
        let Some((at, reach)) = self.on_picture(view, reach) else { return 1.0 };
        let mut clearest = -1.0_f32;
        for y in self.span(at.y, reach + self.step, 1) {
            for x in self.span(at.x, reach + self.step, 0) {
                clearest = clearest.max(self.transmittance[y * self.size[0] + x]);
            }
        }
        // Beside the raster nothing is known.
        if clearest < 0.0 { 1.0 } else { f64::from(clearest) }
    }

    /// Where a ball lands on the picture, and how large it is there at most; `None` where it reaches
    /// the eye's plane.
    fn on_picture(&self, view: DVec3, radius: f64) -> Option<(DVec2, f64)> {
        let Some(distance) = self.eye_distance else { return Some((view.truncate(), radius)) };
        let nearest = view.z - radius;
        if nearest <= 0.0 {
            return None;
        }
        // The ball lies within the rectangle of its corners at the nearest and the middle depth.
        let at = view.truncate() * (distance / view.z);
        let off = view.truncate().abs() * (distance / nearest - distance / view.z);
        Some((at, radius * distance / nearest + off.max_element()))
    }

    /// A node that everything behind it is seen through: a box in index space, its middle and half its
    /// sides, the same middle in view space and a radius about it that holds the box, pixels.
    pub(super) fn pass(
        &mut self,
        centre: DVec3,
        half: DVec3,
        extinction: f64,
        view: DVec3,
        radius: f64,
    ) {
        let [columns, rows] = match self.on_picture(view, radius) {
            Some((at, reach)) => [self.span(at.x, reach, 0), self.span(at.y, reach, 1)],
            None => [0..self.size[0], 0..self.size[1]],
        };
        for y in rows {
            for x in columns.clone() {
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * self.step + self.low;
                // Parallel rays run along z from the picture; others from the eye at 0.
                let (start, direction, from) = match self.eye_distance {
                    None => (pixel.extend(0.0), DVec3::Z, f64::NEG_INFINITY),
                    Some(distance) => (DVec3::ZERO, pixel.extend(distance).normalize(), 0.0),
                };
                let start = self.index_origin + self.index_from_view * start;
                let direction = self.index_from_view * direction;
                let (mut enter, mut leave) = (from, f64::INFINITY);
                for a in 0..3 {
                    let (low, high) = (centre[a] - half[a], centre[a] + half[a]);
                    if direction[a] == 0.0 {
                        if start[a] < low || start[a] >= high {
                            leave = f64::NEG_INFINITY;
                        }
                        continue;
                    }
                    let (t0, t1) =
                        ((low - start[a]) / direction[a], (high - start[a]) / direction[a]);
                    enter = enter.max(t0.min(t1));
                    leave = leave.min(t0.max(t1));
                }
                if leave > enter {
                    let depth = extinction * (leave - enter) * self.depth_per_pixel;
                    #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
                    let through = (-depth).exp() as f32;
                    self.transmittance[y * self.size[0] + x] *= through;
                }
            }
        }
    }
}

/// The least and greatest corner of the rectangle, in pixels from the picture's middle, that a volume
/// covers of it.
fn on_screen(visibility: &Visibility, dims: [usize; 3]) -> [DVec2; 2] {
    let half = visibility.half_size;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for corner in 0..8 {
        let at: [f64; 3] =
            std::array::from_fn(|a| if corner >> a & 1 == 1 { dims[a] as f64 - 0.5 } else { -0.5 });
        let view = visibility.view(DVec3::from(at));
        let shrink = match visibility.eye_distance {
            None => 1.0,
            // The eye may be among it.
            Some(_) if view.z <= 0.0 => return [-half, half],
            Some(distance) => distance / view.z,
        };
        low = low.min(view.truncate() * shrink);
        high = high.max(view.truncate() * shrink);
    }
    let low = low.clamp(-half, half);
    [low, high.clamp(low, half)]
}
