//! Small things of a field, which rays that are far apart may miss.

use super::EMPTY_BRICK;

/// Voxels about a brick that its bounds hold for, beside the samples of the kernel.
const REACH: f32 = 1.0;
/// Small things are looked at up to so many bricks.
const MOST_BRICKS: usize = 1 << 14;

/// A group of bricks that show, touch one another, and are small together.
#[derive(Debug, Clone, PartialEq)]
pub struct Speck {
    /// It touches nothing that is large.
    pub is_apart: bool,
    /// For each brick, the least and the greatest position at which something can show, in index space.
    pub boxes: Vec<[[f32; 3]; 2]>,
}

/// Bricks along x, y, z, and which of them show.
struct Bricks<'a> {
    dims: [usize; 3],
    shows: &'a [bool],
}

/// What of the bricks that show lies in no plate of `side` × `side` × 1 of them along any two axes:
/// vessels and single voxels rather than skins and bodies. Those that stand apart come first, the smallest
/// of them first.
///
/// `shows` are the bricks of a field (`kernel::Bounds`) in which something can show within a
/// voxel of them, x fastest. Something of w voxels shows in 1 + (w + 2) / 4 bricks to 2 + (w + 2) / 4,
/// rounded down.
pub fn specks(dims: [usize; 3], shows: &[bool], side: usize) -> Vec<Speck> {
    let bricks = Bricks { dims, shows };
    let mut is_large = vec![false; shows.len()];
    for [first, second] in [[0, 1], [0, 2], [1, 2]] {
        let begins = bricks.run(&bricks.run(shows, first, side, true), second, side, true);
        let ends = bricks.run(&bricks.run(&begins, first, side, false), second, side, false);
        is_large.iter_mut().zip(ends).for_each(|(is_large, is_in)| *is_large |= is_in);
    }
    let mut specks = bricks.groups(&is_large);
    specks.sort_by_key(|speck| (!speck.is_apart, speck.boxes.len()));
    specks
}

impl Bricks<'_> {
    fn stride(&self, axis: usize) -> usize {
        [1, self.dims[0], self.dims[0] * self.dims[1]][axis]
    }

    /// Whether all of the `side` bricks from one on are set, or any of those up to it.
    fn run(&self, of: &[bool], axis: usize, side: usize, all: bool) -> Vec<bool> {
        let (stride, n) = (self.stride(axis), self.dims[axis]);
        // Where an axis has fewer bricks, all of them are as long as it gets.
        let side = side.min(n);
        // For each line along the axis, how many in a row are set, or for how many more the last counts.
        let mut counts = vec![0; stride];
        let (next, least): (fn(usize, bool, usize) -> usize, _) = match all {
            true => (|count, is_set, _| if is_set { count + 1 } else { 0 }, side),
            false => (|count, is_set, side| if is_set { side } else { count.saturating_sub(1) }, 1),
        };
        let mut found = vec![false; of.len()];
        for (of, found) in of.chunks(stride * n).zip(found.chunks_mut(stride * n)) {
            counts.fill(0);
            for step in 0..n {
                let from = stride * if all { n - 1 - step } else { step };
                let row = from..from + stride;
                for ((count, &is_set), found) in
                    counts.iter_mut().zip(&of[row.clone()]).zip(&mut found[row])
                {
                    *count = next(*count, is_set, side);
                    *found = *count >= least;
                }
            }
        }
        found
    }

    fn place(&self, i: usize) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        [i % nx, i / nx % ny, i / (nx * ny)]
    }

    /// The bricks about one, itself among them.
    fn about(&self, i: usize) -> impl Iterator<Item = usize> {
        let at = self.place(i);
        let dims = self.dims;
        let span = move |axis: usize| at[axis].saturating_sub(1)..(at[axis] + 2).min(dims[axis]);
        span(2).flat_map(move |z| {
            span(1).flat_map(move |y| span(0).map(move |x| (z * dims[1] + y) * dims[0] + x))
        })
    }

    fn groups(&self, is_large: &[bool]) -> Vec<Speck> {
        let mut is_left: Vec<bool> =
            self.shows.iter().zip(is_large).map(|(&shows, &is_large)| shows && !is_large).collect();
        let mut groups = Vec::new();
        let mut seen = 0;
        for start in 0..is_left.len() {
            if !is_left[start] {
                continue;
            }
            is_left[start] = false;
            let mut group = vec![start];
            let (mut done, mut is_apart) = (0, true);
            while let Some(&brick) = group.get(done) {
                done += 1;
                for other in self.about(brick) {
                    is_apart &= !is_large[other];
                    if std::mem::take(&mut is_left[other]) {
                        group.push(other);
                    }
                }
            }
            seen += group.len();
            // A net of vessels through all of the volume is not small.
            if group.len() <= MOST_BRICKS {
                let boxes = group.iter().map(|&brick| self.bounds(brick, is_large)).collect();
                groups.push(Speck { is_apart, boxes });
            }
            if seen > 4 * MOST_BRICKS {
                break;
            }
        }
        groups
    }

    /// Where what makes a brick show can be seen: what is within reach of a neighbour would show there too.
    fn bounds(&self, brick: usize, is_large: &[bool]) -> [[f32; 3]; 2] {
        let place = self.place(brick);
        let mut found = [[0.0; 3]; 2];
        for axis in 0..3 {
            let (at, n, stride) = (place[axis], self.dims[axis], self.stride(axis));
            let first = (at * EMPTY_BRICK) as f32;
            let last = first + (EMPTY_BRICK - 1) as f32;
            // Inward of a neighbour that does not show; outward into one that is no part of a speck.
            let inward = |other: Option<usize>| match other {
                Some(other) if !self.shows[other] => REACH,
                Some(other) if is_large[other] => -2.0 - REACH,
                _ => -0.5,
            };
            found[0][axis] = first + inward((at > 0).then(|| brick - stride));
            found[1][axis] = last - inward((at + 1 < n).then(|| brick + stride));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIMS: [usize; 3] = [48, 44, 41];

    /// The specks of a field of 0 and 1 through tents.
    fn of(is_set: impl Fn([usize; 3]) -> bool, side: usize) -> Vec<Speck> {
        let [nx, ny, nz] = DIMS;
        let bricks = DIMS.map(|n| n.div_ceil(EMPTY_BRICK));
        let mut shows = vec![false; bricks.iter().product()];
        for i in 0..nx * ny * nz {
            let at = [i % nx, i / nx % ny, i / (nx * ny)];
            if !is_set(at) {
                continue;
            }
            // The bricks from which a voxel, and the kernel's own sample, lead there.
            let [x, y, z] = [0, 1, 2].map(|a| {
                at[a].saturating_sub(2) / EMPTY_BRICK
                    ..=((at[a] + 2) / EMPTY_BRICK).min(bricks[a] - 1)
            });
            for brick in z.flat_map(|z| y.clone().map(move |y| (z * bricks[1] + y) * bricks[0])) {
                x.clone().for_each(|x| shows[brick + x] = true);
            }
        }
        specks(bricks, &shows, side)
    }

    #[test]
    fn a_single_voxel_is_a_speck_wherever_it_lies_and_its_boxes_hold_it() {
        for at in [[20, 21, 22], [23, 24, 19], [0, 0, 0], [47, 43, 40], [17, 3, 40]] {
            let found = of(|p| p == at, 3);
            assert_eq!(found.len(), 1, "{at:?}");
            assert!(found[0].is_apart && found[0].boxes.len() <= 8, "{found:?}");
            for axis in 0..3 {
                let low = found[0].boxes.iter().map(|b| b[0][axis]).fold(f32::INFINITY, f32::min);
                let high = found[0].boxes.iter().map(|b| b[1][axis]).fold(0.0, f32::max);
                // Tents reach a voxel to either side, as far as there is one.
                let at = at[axis] as f32;
                let last = DIMS[axis] as f32 - 1.0;
                assert!(low <= (at - 1.0).max(0.0) && high >= (at + 1.0).min(last), "{low} {high}");
                assert!(high - low <= 6.5, "no wider than need be: {low} {high}");
            }
        }
    }

    #[test]
    fn bodies_and_skins_are_none_and_what_is_near_them_is() {
        let is_body = |p: [usize; 3]| p[0] < 24;
        assert_eq!(of(is_body, 3), []);
        let is_skin = |p: [usize; 3]| p[0].abs_diff(30) == 0;
        assert_eq!(of(is_skin, 3), []);
        assert_eq!(of(|_| true, 3), []);
        assert_eq!(of(|_| false, 3), []);
        // Two voxels, one of them so near the body that their bricks touch.
        let (near, far) = ([27, 20, 20], [40, 30, 9]);
        let found = of(|p| is_body(p) || p == near || p == far, 3);
        let holds = |speck: &Speck, at: [usize; 3]| {
            let is_in = |b: &[[f32; 3]; 2]| {
                (0..3).all(|a| b[0][a] <= at[a] as f32 && at[a] as f32 <= b[1][a])
            };
            speck.boxes.iter().any(is_in)
        };
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].is_apart && holds(&found[0], far), "what stands apart comes first");
        assert!(!found[1].is_apart && holds(&found[1], near));
    }

    #[test]
    fn how_wide_is_small_is_up_to_who_asks() {
        let is_cube =
            |side: usize| move |p: [usize; 3]| p.iter().all(|&n| (17..17 + side).contains(&n));
        // 1 + (w + 2) / 4 bricks a side at least, 2 + (w + 2) / 4 at most.
        assert_eq!(of(is_cube(1), 3).len(), 1);
        assert_eq!(of(is_cube(12), 3).len(), 0);
        assert_eq!(of(is_cube(5), 4).len(), 1);
        // A vessel, from border to border.
        let vessel = of(|p| p[1] == 20 && p[2] == 20, 3);
        assert_eq!((vessel.len(), vessel[0].boxes.len()), (1, 12 * 4));
    }

    #[test]
    fn runs_are_what_they_are_counted_to_be() {
        let dims = [7, 5, 6];
        let shows: Vec<bool> = (0..210_usize).map(|i| i * i % 11 < 6 || i % 13 < 4).collect();
        let bricks = Bricks { dims, shows: &shows };
        for (axis, side) in [(0, 1), (0, 3), (1, 2), (1, 5), (2, 4), (2, 9)] {
            let (stride, n) = (bricks.stride(axis), dims[axis]);
            let side_here = side.min(n);
            for i in 0..shows.len() {
                let at = bricks.place(i)[axis];
                let all = at + side_here <= n && (0..side_here).all(|s| shows[i + s * stride]);
                let any = (0..side_here.min(at + 1)).any(|s| shows[i - s * stride]);
                assert_eq!(bricks.run(&shows, axis, side, true)[i], all, "{axis} {side} {i}");
                assert_eq!(bricks.run(&shows, axis, side, false)[i], any, "{axis} {side} {i}");
            }
        }
    }

    #[test]
    fn the_smallest_come_first() {
        let is_set =
            |p: [usize; 3]| p == [5, 5, 5] || (p[1] == 30 && p[2] == 20 && p[0] > 8 && p[0] < 40);
        let found = of(is_set, 3);
        let counts: Vec<usize> = found.iter().map(|speck| speck.boxes.len()).collect();
        assert_eq!(counts.len(), 2);
        assert!(counts[0] < counts[1], "{counts:?}");
    }
}
