//! Pixels of a smaller picture that have more rays than one, so that small things are met.

use glam::DVec3;

use crate::hierarchy::Speck;
use crate::scene::View;

/// A small thing is not looked for in more pixels than this along either side: rays meet it.
pub(super) const MOST_PIXELS: f64 = 8.0;
/// The same of means, where rays that pass through it may find nothing unless they look for it.
pub(super) const MOST_PIXELS_OF_MEANS: f64 = 64.0;

/// Rays of marked pixels for the length of a sample: with one, what shows of a single voxel is met or
/// missed as a whole.
pub(super) const RAYS_A_SAMPLE: f64 = 2.0;
/// Pixels across and down that adapters walk together, about.
const BLOCK: [u32; 2] = [4, 2];
pub(super) const LANES: u32 = BLOCK[0] * BLOCK[1];
/// Bits of `Slabs::more` that say at which word marks begin; above them, how many rays they stand for.
pub(super) const WORD_BITS: u32 = 28;

/// Marks on the device.
#[derive(Debug)]
pub(super) struct Marked {
    pub(super) view: View,
    pub(super) word: u32,
    pub(super) side: u32,
}

impl Marked {
    /// What `Slabs::more` says of them in a picture of a view: 0 where they are of another.
    pub(super) fn word_of(&self, view: &View) -> u32 {
        match self.view == *view {
            true => self.word | self.side << WORD_BITS,
            false => 0,
        }
    }
}

/// Which pixels are marked.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Marks {
    /// A bit for each pixel, row by row from the top.
    pub words: Vec<u32>,
    /// Blocks of pixels ([`BLOCK`]) that have marks.
    pub blocks: u64,
}

/// The pixels that specks lie in, but those that are seen across more of them than `most_pixels`, unless
/// these are in more than `most` blocks; `view` is of the lattice that they were found in.
pub(super) fn marks(
    specks: &[Speck],
    view: &View,
    (most_pixels, most): (f64, u64),
) -> Option<Marks> {
    let [width, height] = view.size;
    let words = (u64::from(width) * u64::from(height)).div_ceil(32);
    let [across, down] = [width.div_ceil(BLOCK[0]), height.div_ceil(BLOCK[1])];
    let mut is_met = vec![false; across as usize * down as usize];
    let mut marks = Marks { words: vec![0; words as usize], blocks: 0 };
    for bounds in specks.iter().flat_map(|speck| &speck.boxes) {
        let Some([[left, top], [right, bottom]]) = pixels(bounds, view, most_pixels) else {
            continue;
        };
        for y in top..bottom {
            for x in left..right {
                let at = y as usize * width as usize + x as usize;
                marks.words[at / 32] |= 1 << (at % 32);
                let block = &mut is_met[(y / BLOCK[1] * across + x / BLOCK[0]) as usize];
                marks.blocks += u64::from(!std::mem::replace(block, true));
            }
        }
        if marks.blocks > most {
            return None;
        }
    }
    Some(marks)
}

/// Pixels from the left and the top that a box lies in, from the first to the one after the last;
/// `None` where there are none, or more than `most` along either side.
fn pixels([low, high]: &[[f32; 3]; 2], view: &View, most: f64) -> Option<[[u32; 2]; 2]> {
    let (mut first, mut last) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for corner in 0..8 {
        let at = [0, 1, 2].map(|a| f64::from(if corner >> a & 1 == 0 { low[a] } else { high[a] }));
        let at =
            view.view_from_index * (DVec3::from_array(at) - view.lattice_centre) + view.view_centre;
        let scale = match view.eye_distance {
            None => 1.0,
            Some(_) if at.z <= 0.0 => return None,
            Some(distance) => distance / at.z,
        };
        let place = [scale * at.x, -scale * at.y];
        for axis in 0..2 {
            let place = place[axis] + f64::from(view.size[axis]) / 2.0;
            (first[axis], last[axis]) = (first[axis].min(place), last[axis].max(place));
        }
    }
    let mut found = [[0; 2]; 2];
    for axis in 0..2 {
        let size = f64::from(view.size[axis]);
        let is_seen = last[axis] >= 0.0 && first[axis] < size;
        if !is_seen || last[axis] - first[axis] > most {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "in the picture"
        )]
        let ends = [first[axis].max(0.0) as u32, (last[axis] + 1.0).min(size) as u32];
        (found[0][axis], found[1][axis]) = (ends[0], ends[1]);
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Camera, Projection};
    use crate::volume::Lattice;

    /// Boxes are found on the picture where the camera says, in parallel and in perspective.
    #[test]
    fn pixels_are_those_that_a_box_is_seen_in() {
        let lattice = Lattice { spacing: DVec3::new(1.0, 2.0, 0.5), ..Lattice::unit([40, 30, 50]) };
        let camera = Camera::new(lattice.centre(), DVec3::new(0.4, 0.9, -0.3), DVec3::Z, 40.0);
        let size = [60, 50];
        for angle in [None, Some(40.0)] {
            let camera = match angle {
                None => camera,
                Some(degrees) => {
                    let view_angle = f64::to_radians(degrees);
                    Camera { projection: Projection::Perspective { view_angle }, ..camera }
                }
            };
            let view = View::of(&camera, &lattice, size);
            let mut seen = 0;
            for at in [[3.0, 4.0, 5.0], [20.0, 10.0, 30.0], [39.0, 29.0, 0.0]] {
                let point = [at, at];
                let Some([first, beyond]) = pixels(&point, &view, MOST_PIXELS) else { continue };
                assert_eq!([beyond[0] - first[0], beyond[1] - first[1]], [1, 1], "one pixel");
                // The ray through its middle passes within a pixel of it.
                let middle = first.map(|n| f64::from(n) + 0.5);
                let (start, direction) = camera.ray(middle.into(), size.map(f64::from));
                let world = lattice.world_from_index(DVec3::from_array(at.map(f64::from)));
                let off = (world - start) - direction * (world - start).dot(direction);
                assert!(off.length() * view.pixels_per_unit < 1.2, "{off} {angle:?}");
                seen += 1;
            }
            assert!(seen >= 2, "{angle:?}");
        }
    }

    #[test]
    fn all_small_things_are_marked_or_none() {
        let lattice = Lattice::unit([64; 3]);
        let camera = Camera::new(lattice.centre(), DVec3::Y, DVec3::Z, 32.0);
        // Two voxels a pixel.
        let view = View::of(&camera, &lattice, [32, 32]);
        let cube = |at: f32| Speck {
            is_apart: true,
            boxes: vec![[[at + 0.1; 3], [at + 3.5; 3]], [[at + 0.1; 3], [at + 5.5; 3]]],
        };
        let specks = [cube(8.0), cube(20.0), cube(40.0)];
        let within = |specks: &[Speck], most| marks(specks, &view, (MOST_PIXELS, most));
        let all = within(&specks, u64::MAX).unwrap();
        let bits: u32 = all.words.iter().map(|w| w.count_ones()).sum();
        // 5.4 voxels are 3 or 4 pixels: in one block or two across, and in two or three down.
        assert!((27..=48).contains(&bits), "{bits}");
        assert!((6..=18).contains(&all.blocks), "{}", all.blocks);
        assert_eq!(within(&specks, all.blocks), Some(all.clone()));
        assert_eq!(within(&specks, all.blocks - 1), None);
        let none = Marks { words: vec![0; 32], blocks: 0 };
        assert_eq!(within(&[], 100), Some(none));
        // What covers many pixels is met without marks, unless it has to be looked for.
        let wide = |most| marks(&specks, &view, (most, u64::MAX)).unwrap().blocks;
        assert!(wide(1.5) == 0 && wide(64.0) == all.blocks);
    }
}
