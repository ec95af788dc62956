//! The cells of an octree cut: found beside the drawing, and drawn into a finished picture.

use std::sync::Arc;

use glam::DVec2;

use super::annotations::lay_over;
use super::cuts::Bricks;
use super::draw::cut_limits;
use crate::core::Srgb8;
use crate::hierarchy::{Cut, CutLimits, Pyramid};
use crate::kernel::RadialKernel;
use crate::scene::{Cells, Scene, SplatSettings, View, level_colour};
use crate::transfer::{Table, TransferFunction};
use crate::volume::ScalarVolume;

/// Nodes that a cut may have to be found for the window, about: it cannot be stopped, and a hand may begin to move meanwhile.
const MOST_IN_CUT: u64 = 1_000_000;
/// Opacity of the lines.
const LINE_OPACITY: f64 = 0.6;
/// Greatest share of the picture that lines cover, at that opacity.
const MOST_COVERED: f32 = 0.4;
/// Side of the blocks that this holds in, pixels.
const BLOCK: u32 = 32;

/// What cuts of one scene's octree are found in; shared, so that a cut can be found while another is
/// drawn.
#[derive(Debug, Clone)]
pub(super) struct CutSource {
    pub(super) volume: Arc<ScalarVolume>,
    pub(super) transfer: TransferFunction,
    pub(super) unit_distance: f64,
    pub(super) table: Arc<Table>,
    pub(super) pyramid: Arc<Pyramid>,
    /// Of cuts of the field, where it has some.
    pub(super) bricks: Option<Arc<Bricks>>,
}

impl CutSource {
    /// Whether it is that of a scene.
    pub(super) fn is_for(&self, scene: &Scene) -> bool {
        scene.volume().is_some_and(|volume| Arc::ptr_eq(&self.volume, volume))
            && scene.drawn_transfer().as_deref() == Some(&self.transfer)
            && self.unit_distance == scene.opacity_unit_distance()
    }

    /// The cut that a view asks for.
    pub(super) fn cut(&self, mode: &SplatSettings, view: &View, limits: CutLimits) -> Cut {
        let radius = RadialKernel::new(mode.kernel.splatted(), mode.splatted_extent());
        let radius = radius.map_or(0.5, |k| k.radius());
        let samples = &self.volume.samples;
        Cut::of(&self.pyramid, limits, view.visit_order(), &view.visibility(radius), |index| {
            self.table.lookup(samples.get(index))
        })
    }

    /// The cells of the cut of an error, at most so many of them: of the field, where moving views show cuts of it.
    pub(super) fn cells(
        &self,
        scene: &Scene,
        size: [u32; 2],
        max_error: f32,
        most: usize,
    ) -> Cells {
        if let Some(bricks) = self.bricks.as_ref().filter(|bricks| bricks.are_for(scene, size)) {
            return bricks.cells_within(max_error, most);
        }
        let max_error = max_error.max(self.pyramid.error_for_count(MOST_IN_CUT));
        let limits = cut_limits(&scene.splat, max_error);
        let cut = self.cut(&scene.splat, &View::new(scene, size), limits);
        Cells::of(&cut, &limits, most)
    }
}

/// Draws the edges of cells over a picture of straight sRGB bytes, one pixel wide, and fainter where
/// they would cover it; whether any are.
pub fn draw_edges(rgba: &mut [u8], view: &View, cells: &Cells) -> bool {
    let lines: Vec<_> = cells
        .edges
        .iter()
        .filter_map(|edge| Some((edge.level, view.edge_on_picture(edge)?)))
        .collect();
    let mut room = LineRoom::new(view.size);
    for &(level, ends) in &lines {
        walk_line(view.size, ends, |pixel, weight| room.note(level, pixel, weight));
    }
    let is_faint = room.share_out();
    for (level, ends) in lines {
        let colour = level_colour(level);
        walk_line(view.size, ends, |pixel, weight| {
            draw_pixel(rgba, view.size, pixel, colour, weight * room.strength(level, pixel));
        });
    }
    is_faint
}

/// Lays a share of a line over one pixel.
fn draw_pixel(rgba: &mut [u8], size: [u32; 2], [x, y]: [u32; 2], colour: Srgb8, weight: f64) {
    let index = (y as usize * size[0] as usize + x as usize) * 4;
    if let Some(pixel) = rgba.get_mut(index..index + 4) {
        lay_over(pixel, colour, LINE_OPACITY * weight);
    }
}

/// Visits the pixels of a smooth line with their shares of it: at each step along its longer axis, two
/// share it across.
fn walk_line(size: [u32; 2], [a, b]: [DVec2; 2], mut visit: impl FnMut([u32; 2], f64)) {
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
            let mut pixel = [0; 2];
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole, within the picture"
            )]
            {
                (pixel[main], pixel[cross]) = (step as u32, at as u32);
            }
            visit(pixel, weight * share);
        }
        step += 1.0;
    }
}

/// How much of the picture lines may cover, block by block: of what is left of [`MOST_COVERED`], each
/// level takes half at most, the coarsest first, so that a few large cells stay clear among many small
/// ones and the picture between them.
#[derive(Debug)]
struct LineRoom {
    /// Blocks across and down.
    blocks: [usize; 2],
    /// Of each level: first the pixels that its lines are long in each block, then their strength.
    levels: Vec<Vec<f32>>,
}

impl LineRoom {
    fn new(size: [u32; 2]) -> Self {
        Self { blocks: size.map(|n| n.div_ceil(BLOCK) as usize), levels: Vec::new() }
    }

    /// Counts a pixel's share of a line.
    fn note(&mut self, level: u8, [x, y]: [u32; 2], weight: f64) {
        let level = usize::from(level);
        if self.levels.len() <= level {
            self.levels.resize_with(level + 1, Vec::new);
        }
        let lengths = &mut self.levels[level];
        if lengths.is_empty() {
            *lengths = vec![0.0; self.blocks[0] * self.blocks[1]];
        }
        let block = (y / BLOCK) as usize * self.blocks[0] + (x / BLOCK) as usize;
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        if let Some(length) = lengths.get_mut(block) {
            *length += weight as f32;
        }
    }

    /// Turns lengths into strengths of 0..=1; whether any is below 1.
    fn share_out(&mut self) -> bool {
        let mut is_faint = false;
        let pixels = (BLOCK * BLOCK) as f32;
        let mut left = vec![MOST_COVERED; self.blocks[0] * self.blocks[1]];
        for lengths in self.levels.iter_mut().rev() {
            for (length, left) in lengths.iter_mut().zip(&mut left) {
                let covered = *length / pixels;
                let strength = if covered > 0.0 { (*left / 2.0 / covered).min(1.0) } else { 1.0 };
                *left -= covered * strength;
                is_faint |= strength < 1.0;
                *length = strength;
            }
        }
        is_faint
    }

    /// The strength of a level's lines at a pixel: smooth between the middles of blocks.
    fn strength(&self, level: u8, pixel: [u32; 2]) -> f64 {
        let Some(strengths) = self.levels.get(usize::from(level)) else { return 1.0 };
        let [x, y] = [0, 1].map(|axis| {
            let last = (self.blocks[axis] - 1) as f32;
            ((pixel[axis] as f32 + 0.5) / BLOCK as f32 - 0.5).clamp(0.0, last)
        });
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "blocks")]
        let (column, row) = (x as usize, y as usize);
        let (across, down) = (x - x.floor(), y - y.floor());
        let at = |column: usize, row: usize| {
            let column = column.min(self.blocks[0] - 1);
            strengths.get(row.min(self.blocks[1] - 1) * self.blocks[0] + column).map_or(1.0, |s| *s)
        };
        let mix = |row| at(column, row) + (at(column + 1, row) - at(column, row)) * across;
        f64::from(mix(row) + (mix(row + 1) - mix(row)) * down)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::core::Camera;
    use crate::scene::{Cell, WhyWhole};
    use crate::volume::Lattice;

    fn line(size: [u32; 2], a: [f64; 2], b: [f64; 2]) -> Vec<[u8; 4]> {
        let mut rgba = [0, 0, 0, 255].repeat((size[0] * size[1]) as usize);
        walk_line(size, [a.into(), b.into()], |pixel, weight| {
            draw_pixel(&mut rgba, size, pixel, Srgb8([200, 100, 50]), weight);
        });
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
        walk_line([1, 1], [DVec2::new(0.0, 0.5), DVec2::new(1.0, 0.5)], |pixel, weight| {
            draw_pixel(&mut rgba, [1, 1], pixel, Srgb8::WHITE, weight);
        });
        assert_eq!(rgba, [255, 255, 255, 153]);
    }

    /// Cubes of so many voxels along each edge that fill 64 × 64 × `depth` of them.
    fn filling(edge: u32, depth: u32, level: u8) -> Vec<Cell> {
        let corners = |n: u32| (0..n).step_by(edge as usize);
        let cell = |low| Cell {
            low,
            size: [edge; 3],
            level,
            error: 0.0,
            extinction: 1.0,
            colour: [0; 3],
            why: WhyWhole::Voxel,
        };
        corners(64)
            .flat_map(|x| corners(64).flat_map(move |y| corners(depth).map(move |z| [x, y, z])))
            .map(cell)
            .collect()
    }

    /// Mean opacity of what lines lay over a picture of so many pixels a voxel, seen from one side.
    fn covered(cells: Vec<Cell>, pixels_per_voxel: u32) -> (f64, bool) {
        let size = [64 * pixels_per_voxel; 2];
        let camera = Camera::new(DVec3::splat(31.5), DVec3::new(0.2, 0.3, 1.0), DVec3::Y, 32.0);
        let view = View::of(&camera, &Lattice::unit([64; 3]), size);
        let total = cells.len() as u64;
        let mut rgba = vec![0; (size[0] * size[1] * 4) as usize];
        let is_faint = draw_edges(&mut rgba, &view, &Cells::from_cells(cells, total, 1.0));
        let sum: f64 = rgba.chunks(4).map(|pixel| f64::from(pixel[3]) / 255.0).sum();
        (sum / (f64::from(size[0]) * f64::from(size[1])), is_faint)
    }

    #[test]
    fn many_cells_leave_the_picture_to_be_seen_and_a_few_are_as_clear_as_ever() {
        let (few, is_faint) = covered(filling(32, 32, 5), 4);
        assert!(!is_faint && (0.005..0.06).contains(&few), "{few}");
        for (edge, depth) in [(1, 1), (2, 16), (4, 64)] {
            let (many, is_faint) = covered(filling(edge, depth, 0), 4);
            assert!(is_faint && (0.04..0.2).contains(&many), "{edge}: {many}");
        }
        // A few large ones are as strong among many small ones as by themselves.
        let size = [256; 2];
        let mut room = LineRoom::new(size);
        for y in 0..256 {
            for x in 0..256 {
                room.note(0, [x, y], 1.0);
                room.note(3, [x, y], if x % 16 == 0 { 1.0 } else { 0.0 });
            }
        }
        assert!(room.share_out());
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-6;
        assert!(near(room.strength(3, [77, 130]), 1.0), "a sixteenth is covered");
        let rest = f64::from(MOST_COVERED) - 1.0 / 16.0;
        assert!(near(room.strength(0, [77, 130]), rest / 2.0));
        assert!(near(room.strength(200, [0, 0]), 1.0), "of a level without lines");
    }
}
