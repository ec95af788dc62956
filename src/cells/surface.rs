//! The outer faces of cells.

use rayon::prelude::*;

use super::{Cells, Solid};

/// A face that one solid alone has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Numbers of its points, around it; of a triangle the last is the third again.
    pub corners: [u32; 4],
    /// Whose it is.
    pub solid: u32,
    /// Its number in [`Kind::faces`](super::Kind::faces) of that.
    pub number: u8,
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
    pub fn surface(&self, is_there: impl Fn(usize) -> bool + Sync) -> Vec<Face> {
        let faces_of = |(i, solid): (usize, &Solid)| {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "files have fewer solids than 2^32"
            )]
            let own = i as u32;
            let is_there = is_there(i);
            let faces = solid.kind().faces().iter().enumerate().filter(move |_| is_there);
            let solid = *solid;
            faces.filter_map(move |(number, face)| {
                let (corners, key) = corners_of(face, solid.corners())?;
                let number = number as u8;
                Some((key, Face { corners, solid: own, number }))
            })
        };
        let mut faces: Vec<_> =
            self.solids().par_iter().enumerate().flat_map_iter(faces_of).collect();
        faces.par_sort_unstable_by_key(|(key, _)| *key);
        let mut found: Vec<Face> = faces
            .chunk_by(|a, b| a.0 == b.0)
            .filter_map(|part| (part.len() == 1).then_some(part[0].1))
            .collect();
        found.sort_unstable_by_key(|face| (face.solid, face.number));
        found
    }
}

/// The numbers of a face's points, and what tells it from others, whichever of them comes first; `None` where it is a line.
/// Corners that fall together are one, as in hexahedra that stand for wedges.
fn corners_of(face: &[usize], solid: &[u32]) -> Option<([u32; 4], [u32; 4])> {
    let mut own = [u32::MAX; 4];
    let mut count = 0;
    for &i in face {
        if count == 0 || own[count - 1] != solid[i] {
            own[count] = solid[i];
            count += 1;
        }
    }
    if count > 1 && own[0] == own[count - 1] {
        count -= 1;
    }
    let [a, b, c, d] = own;
    let (corners, mut key) = match count {
        3 => ([a, b, c, c], [a, b, c, u32::MAX]),
        4 => (own, [a, b, c, d]),
        _ => return None,
    };
    key.sort_unstable();
    Some((corners, key))
}
