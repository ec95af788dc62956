//! The cells of an octree cut: found beside the drawing, and drawn into a finished picture.

use std::sync::Arc;

use glam::DVec2;

use super::draw::cut_limits;
use crate::core::Srgb8;
use crate::hierarchy::{Cut, CutLimits, Pyramid};
use crate::kernel::RadialKernel;
use crate::scene::{Cells, Scene, View, level_colour};
use crate::transfer::{Table, TransferFunction};
use crate::volume::ScalarVolume;

/// Opacity of the lines.
const LINE_OPACITY: f64 = 0.6;

/// What cuts of one scene's octree are found in; shared, so that a cut can be found while another is
/// drawn.
#[derive(Debug, Clone)]
pub(super) struct CutSource {
    pub(super) volume: Arc<ScalarVolume>,
    pub(super) transfer: TransferFunction,
    pub(super) unit_distance: f64,
    pub(super) table: Arc<Table>,
    pub(super) pyramid: Arc<Pyramid>,
}

impl CutSource {
    /// Whether it is that of a scene.
    pub(super) fn is_for(&self, scene: &Scene) -> bool {
        Arc::ptr_eq(&self.volume, &scene.volume)
            && self.transfer == scene.transfer
            && self.unit_distance == scene.opacity_unit_distance()
    }

    /// The cut that a view asks for.
    pub(super) fn cut(&self, scene: &Scene, view: &View, limits: CutLimits) -> Cut {
        let radius = RadialKernel::new(scene.splat.kernel.splatted(), scene.splat.extent)
            .map_or(0.5, |k| k.radius());
        let samples = &self.volume.samples;
        Cut::of(&self.pyramid, limits, view.visit_order(), &view.visibility(radius), |index| {
            self.table.lookup(samples.get(index))
        })
    }

    /// The cells of the cut of an error, at most so many of them.
    pub(super) fn cells(
        &self,
        scene: &Scene,
        size: [u32; 2],
        max_error: f32,
        most: usize,
    ) -> Cells {
        let limits = cut_limits(scene, max_error);
        Cells::of(&self.cut(scene, &View::new(scene, size), limits), &limits, most)
    }
}

/// Draws the edges of cells over a picture of straight sRGB bytes, one pixel wide.
pub fn draw_edges(rgba: &mut [u8], view: &View, cells: &Cells) {
    for edge in &cells.edges {
        if let Some(ends) = view.edge_on_picture(edge) {
            draw_line(rgba, view.size, ends, level_colour(edge.level));
        }
    }
}

/// A smooth line: at each step along its longer axis, two pixels share it across.
fn draw_line(rgba: &mut [u8], size: [u32; 2], [a, b]: [DVec2; 2], colour: Srgb8) {
    let along = (b - a).abs();
    let (main, cross) = if along.x >= along.y { (0, 1) } else { (1, 0) };
    let (first, last) = if a[main] <= b[main] { (a, b) } else { (b, a) };
    let length = last[main] - first[main];
    let slope = if length > 0.0 { (last[cross] - first[cross]) / length } else { 0.0 };
    let [begin, end] = [first[main], last[main]].map(|x| x.floor().max(0.0));
    let mut step = begin;
    while step <= end && step < f64::from(size[main]) {
        // The share of this pixel that the line crosses: its ends are not longer than they are.
        let share = (last[main].min(step + 1.0) - first[main].max(step)).clamp(0.0, 1.0);
        let middle = (step + 0.5).clamp(first[main], last[main]);
        let centre = first[cross] + slope * (middle - first[main]) - 0.5;
        let below = centre.floor();
        for (at, weight) in [(below, 1.0 - (centre - below)), (below + 1.0, centre - below)] {
            if at < 0.0 || at >= f64::from(size[cross]) {
                continue;
            }
            let mut pixel = [0.0; 2];
            (pixel[main], pixel[cross]) = (step, at);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole, within the picture"
            )]
            let index = (pixel[1] as usize * size[0] as usize + pixel[0] as usize) * 4;
            if let Some(pixel) = rgba.get_mut(index..index + 4) {
                lay_over(pixel, colour, LINE_OPACITY * weight * share);
            }
        }
        step += 1.0;
    }
}

/// Lays a colour over a pixel of straight alpha, as screens do: in sRGB.
fn lay_over(pixel: &mut [u8], colour: Srgb8, opacity: f64) {
    let behind = f64::from(pixel[3]) / 255.0 * (1.0 - opacity);
    let alpha = opacity + behind;
    if alpha <= 0.0 {
        return;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let byte = |value: f64| value.round().clamp(0.0, 255.0) as u8;
    for (channel, line) in pixel.iter_mut().zip(colour.0) {
        *channel = byte((f64::from(line) * opacity + f64::from(*channel) * behind) / alpha);
    }
    pixel[3] = byte(alpha * 255.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(size: [u32; 2], a: [f64; 2], b: [f64; 2]) -> Vec<[u8; 4]> {
        let mut rgba = [0, 0, 0, 255].repeat((size[0] * size[1]) as usize);
        draw_line(&mut rgba, size, [a.into(), b.into()], Srgb8([200, 100, 50]));
        rgba.chunks(4).map(|p| [p[0], p[1], p[2], p[3]]).collect()
    }

    #[test]
    fn a_line_through_pixel_middles_is_one_pixel_wide_and_one_between_two_is_shared() {
        let row = line([5, 3], [0.0, 1.5], [4.0, 1.5]);
        let full = [120, 60, 30, 255];
        assert_eq!(row[5..9], [full; 4], "0.6 of the colour");
        assert!(row[..5].iter().chain(&row[9..]).all(|p| *p == [0, 0, 0, 255]), "{row:?}");
        let between = line([3, 4], [1.0, 0.0], [1.0, 4.0]);
        let half = [60, 30, 15, 255];
        assert!(between.chunks(3).all(|row| row == [half, half, [0, 0, 0, 255]]), "{between:?}");
        // A diagonal of three pixels lights each of them as much as a straight line would.
        let diagonal = line([3, 3], [0.0, 0.0], [3.0, 3.0]);
        assert_eq!([diagonal[0], diagonal[4], diagonal[8]], [full; 3]);
    }

    #[test]
    fn a_line_over_nothing_has_its_own_colour_and_opacity() {
        let mut rgba = vec![0; 4];
        draw_line(&mut rgba, [1, 1], [DVec2::new(0.0, 0.5), DVec2::new(1.0, 0.5)], Srgb8::WHITE);
        assert_eq!(rgba, [255, 255, 255, 153]);
    }
}
