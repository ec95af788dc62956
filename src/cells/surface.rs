//! The outer faces of cells.

use rayon::prelude::*;

use super::Cells;

/// A face that one solid alone has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Numbers of its points, around it; of a triangle the last is the third again.
    pub corners: [u32; 4],
    /// Whose it is.
    pub solid: u32,
}

impl Face {
    /// Its triangles: one, or two.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let [a, b, c, d] = self.corners;
        [[a, b, c], [a, c, d]].into_iter().take(if c == d { 1 } else { 2 })
    }
}

impl Cells {
    /// The faces that belong to one solid of those that are `there`, in the solids' order.
    pub fn surface(&self, is_there: impl Fn(usize) -> bool) -> Vec<Face> {
        let count = self.solids().len();
        let mut faces: Vec<([u32; 4], u32, Face)> = Vec::with_capacity(count * 4);
        for (i, solid) in self.solids().iter().enumerate().filter(|(i, _)| is_there(*i)) {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "files have fewer solids than 2^32"
            )]
            let own = i as u32;
            for face in solid.kind().faces() {
                // Corners that fall together are one, as in hexahedra that stand for wedges.
                let mut own_corners: Vec<u32> = face.iter().map(|i| solid.corners()[*i]).collect();
                own_corners.dedup();
                if own_corners.len() > 1 && own_corners.first() == own_corners.last() {
                    own_corners.pop();
                }
                let (corners, mut key) = match own_corners[..] {
                    [a, b, c] => ([a, b, c, c], [a, b, c, u32::MAX]),
                    [a, b, c, d] => ([a, b, c, d], [a, b, c, d]),
                    _ => continue,
                };
                key.sort_unstable();
                #[expect(clippy::cast_possible_truncation, reason = "six a solid")]
                let order = faces.len() as u32;
                faces.push((key, order, Face { corners, solid: own }));
            }
        }
        faces.par_sort_unstable_by_key(|(key, order, _)| (*key, *order));
        let alone =
            |part: &[([u32; 4], u32, Face)]| (part.len() == 1).then_some((part[0].1, part[0].2));
        let mut found: Vec<(u32, Face)> =
            faces.chunk_by(|a, b| a.0 == b.0).filter_map(alone).collect();
        found.sort_unstable_by_key(|(order, _)| *order);
        found.into_iter().map(|(_, face)| face).collect()
    }
}
