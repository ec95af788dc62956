//! The outer faces of cells.

use super::{Cells, Solid};
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket};

/// Solids, or faces, between two looks at the ticket.
const A_PART: usize = 1 << 14;
/// Solids that a thread takes at a time.
const A_RUN: usize = 1 << 9;
/// Faces that are sorted together, about.
const A_BUCKET: usize = 1 << 12;

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
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "memory holds fewer faces than 2^32")]
    pub fn surface(
        &self,
        is_there: impl Fn(usize) -> bool + Sync,
        ticket: &Ticket,
    ) -> Result<Vec<Face>, Cancelled> {
        let faces_of = |(i, solid): (usize, &Solid)| {
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
        let mut faces: Vec<([u32; 4], Face)> = Vec::new();
        for (part, solids) in self.solids().chunks(A_PART).enumerate() {
            ticket.look()?;
            let runs: Vec<_> = solids.chunks(A_RUN).collect();
            let found = parallel::list(runs.len(), |run| {
                let solids = runs[run].iter().enumerate();
                let solids = solids.map(|(i, solid)| (part * A_PART + run * A_RUN + i, solid));
                solids.flat_map(faces_of).collect::<Vec<_>>()
            });
            faces.extend(found.into_iter().flatten());
        }
        // The same face twice has the same least point: sorted are only those whose least points are near each other, so that
        // nobody waits for all of them.
        let mut looks = Looks::every(ticket, A_PART);
        let points = self.points().len();
        let buckets = faces.len().div_ceil(A_BUCKET).max(1);
        let width = points.div_ceil(buckets).max(1);
        let bucket_of = |key: &[u32; 4]| key[0] as usize / width;
        let mut begins = vec![0_usize; points.div_ceil(width) + 1];
        for (key, _) in &faces {
            looks.after(1)?;
            begins[bucket_of(key) + 1] += 1;
        }
        for bucket in 1..begins.len() {
            begins[bucket] += begins[bucket - 1];
        }
        let mut next = begins.clone();
        let mut order = vec![0_u32; faces.len()];
        for (i, (key, _)) in faces.iter().enumerate() {
            looks.after(1)?;
            let at = &mut next[bucket_of(key)];
            order[*at] = i as u32;
            *at += 1;
        }
        let mut rest = &mut order[..];
        let split = begins.windows(2).map(|ends| {
            let (own, others) = std::mem::take(&mut rest).split_at_mut(ends[1] - ends[0]);
            rest = others;
            own
        });
        let split: Vec<&mut [u32]> = split.collect();
        let key = |i: u32| faces[i as usize].0;
        let mut lonely = Vec::new();
        lonely.resize_with(split.len(), Vec::new);
        parallel::try_each(split.into_iter().zip(&mut lonely), |(own, lonely)| {
            ticket.look()?;
            own.sort_unstable_by_key(|i| key(*i));
            let alike = own.chunk_by(|a, b| key(*a) == key(*b));
            *lonely = alike.filter(|part| part.len() == 1).map(|part| part[0]).collect();
            Ok::<(), Cancelled>(())
        })?;
        let mut is_outer = vec![false; faces.len()];
        for i in lonely.iter().flatten() {
            looks.after(1)?;
            is_outer[*i as usize] = true;
        }
        let mut found = Vec::with_capacity(lonely.iter().map(Vec::len).sum());
        for ((_, face), is_outer) in faces.iter().zip(is_outer) {
            looks.after(1)?;
            if is_outer {
                found.push(*face);
            }
        }
        Ok(found)
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
