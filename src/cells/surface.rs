//! The outer faces of cells.

use std::collections::HashSet;
use std::ops::Range;

use rayon::slice::ParallelSliceMut;

use super::{Cells, Kind, Solid};
use crate::core::parallel;
use crate::core::{Cancelled, Ticket, mapped};

/// Solids whose faces are found between two looks at the ticket.
const A_PART: usize = 1 << 12;
/// And points, or faces, that are looked at.
const A_RUN: usize = 1 << 14;
/// Faces that are sorted together, about.
const A_BUCKET: usize = 1 << 14;
/// The volume of a solid beside the product of its edges, at least, for its points to go one way round.
const LEAST_VOLUME: f64 = 1e-12;

/// A face that cells lie on one side of, and none on the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Face {
    /// Numbers of its points, around it; of a triangle the last is the third again.
    pub corners: [u32; 4],
    /// Whose it is: the first of several.
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

/// What several solids leave of each other's faces.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Surface {
    /// The outer faces, in the order of their solids.
    pub faces: Vec<Face>,
    /// Solids with all of their points where an earlier one has its own, so that nothing of them is seen; rising.
    pub twins: Vec<u32>,
}

/// What tells a solid's face from others, whichever of its points comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Half {
    /// Its points' places, rising, two in a number; of a triangle the last is [`u32::MAX`].
    places: [u64; 2],
    solid: u32,
    number: u8,
    /// Whether it goes from its first place to the lesser of the two beside that.
    is_turned: bool,
}

impl Cells {
    /// The outer faces of the solids that are `there`, in these solids' order.
    ///
    /// Solids share a face where its points lie at the same places, whatever their numbers: pieces and blocks that were joined
    /// have points of their own. A face is an outer one where all solids that share it lie on one side of it, as one does, and the
    /// same cell twice: where their points go round alike, and so do those of the face in each. It is the first one's. Twins are
    /// found among solids that share a face on one side of it, or are three or more at it.
    ///
    /// # Errors
    /// [`Cancelled`].
    #[expect(clippy::cast_possible_truncation, reason = "memory holds fewer faces than 2^32")]
    pub fn surface(
        &self,
        is_there: impl Fn(usize) -> bool + Sync,
        ticket: &Ticket,
    ) -> Result<Surface, Cancelled> {
        let places = self.places(ticket)?;
        let place = |point: u32| places.map_or(point, |places| places[point as usize]);
        let solids = self.solids();
        // The same face twice has the same least place: sorted are only those whose least places are near each other, so that
        // nobody waits for all of them.
        let buckets = (solids.len() * 4).div_ceil(A_BUCKET).max(1);
        let width = self.points().len().div_ceil(buckets).max(1);
        let halves_of = |part: Range<usize>| -> Result<Vec<Vec<Half>>, Cancelled> {
            ticket.look()?;
            let mut found = vec![Vec::new(); buckets];
            for i in part.filter(|i| is_there(*i)) {
                let solid = &solids[i];
                for (number, face) in solid.kind().faces().iter().enumerate() {
                    let Some(ring) = ring_of(face, solid, place) else { continue };
                    let half = Half::of(ring.map(place), (i as u32, number as u8));
                    found[(half.places[0] >> 32) as usize / width].push(half);
                }
            }
            Ok(found)
        };
        let parts: Vec<Vec<Vec<Half>>> =
            parallel::try_list(solids.len().div_ceil(A_PART), |part| {
                halves_of(parallel::part(solids.len(), A_PART, part))
            })?;
        // What tells a solid from others at the same places: tetrahedra are the same in any order of their points.
        let places_of = |half: &Half| {
            let solid = &solids[half.solid as usize];
            let mut own = [u32::MAX; 8];
            own.iter_mut().zip(solid.corners()).for_each(|(to, corner)| *to = place(*corner));
            if solid.kind() == Kind::Tetrahedron {
                own.sort_unstable();
            }
            (own, half.solid)
        };
        let outer_of = |bucket: usize| -> Result<(Vec<[u32; 2]>, Vec<u32>), Cancelled> {
            ticket.look()?;
            let mut own: Vec<Half> = Vec::new();
            parts.iter().for_each(|part| own.extend(&part[bucket]));
            own.sort_unstable();
            let (mut outer, mut twins) = (Vec::new(), Vec::new());
            for alike in own.chunk_by(|a, b| a.places == b.places) {
                let is_outer = self.are_on_one_side(alike);
                if is_outer {
                    outer.push([alike[0].solid, u32::from(alike[0].number)]);
                }
                if alike.len() > if is_outer { 1 } else { 2 } {
                    let mut all: Vec<_> = alike.iter().map(places_of).collect();
                    all.sort_unstable();
                    let same = all.chunk_by(|a, b| a.0 == b.0);
                    twins.extend(same.flat_map(|same| &same[1..]).map(|(_, solid)| *solid));
                }
            }
            Ok((outer, twins))
        };
        let (outer, twins): (Vec<_>, Vec<_>) =
            parallel::try_list(buckets, outer_of)?.into_iter().unzip();
        drop(parts);
        let (mut outer, mut twins) = (outer.concat(), twins.concat());
        outer.par_sort_unstable();
        twins.sort_unstable();
        twins.dedup();
        let face = |i: usize| {
            let [solid, number] = outer[i];
            let own = &solids[solid as usize];
            let ring = ring_of(own.kind().faces()[number as usize], own, place);
            Face { corners: ring.unwrap_or_default(), solid, number: number as u8 }
        };
        Ok(Surface { faces: mapped(outer.len(), A_RUN, face, ticket)?, twins })
    }

    /// The faces of all solids whose points lie at three places or more, those at the same places once: what there is to be seen of
    /// solids without volume.
    #[expect(clippy::cast_possible_truncation, reason = "memory holds fewer faces than 2^32")]
    pub(super) fn faces_of_flat(&self) -> Vec<Face> {
        // Nobody cancels a fresh ticket.
        let places = self.places(&Ticket::new()).unwrap_or_default();
        let place = |point: u32| places.map_or(point, |places| places[point as usize]);
        let mut seen = HashSet::new();
        let mut found = Vec::new();
        for (i, solid) in self.solids().iter().enumerate() {
            for (number, face) in solid.kind().faces().iter().enumerate() {
                let Some(corners) = ring_of(face, solid, place) else { continue };
                if seen.insert(Half::of(corners.map(place), (0, 0)).places) {
                    found.push(Face { corners, solid: i as u32, number: number as u8 });
                }
            }
        }
        found
    }

    /// Whether all solids of a face lie on one side of it.
    fn are_on_one_side(&self, own: &[Half]) -> bool {
        let [first, others @ ..] = own else { return false };
        let way = |half: &Half| self.way_round(half.solid as usize);
        others.is_empty()
            || (others.iter().all(|other| other.is_turned == first.is_turned)
                && way(first).is_some()
                && others.iter().all(|other| way(other) == way(first)))
    }

    /// Whether the points of a solid go round as those of its kind do; `None` of one without volume.
    fn way_round(&self, solid: usize) -> Option<bool> {
        let placed = self.placed(solid);
        let slopes = placed.at(placed.kind().middle()).1;
        let [x, y, z] = [slopes.x_axis, slopes.y_axis, slopes.z_axis];
        let volume = slopes.determinant();
        let is_flat = volume.abs() <= LEAST_VOLUME * x.length() * y.length() * z.length();
        (!is_flat).then_some(volume > 0.0)
    }

    /// The first point at the place of each; `None` where no two are at one place.
    #[expect(clippy::cast_possible_truncation, reason = "points have 32 bits")]
    pub(super) fn places(&self, ticket: &Ticket) -> Result<Option<&[u32]>, Cancelled> {
        if let Some(known) = self.places.get() {
            return Ok(known.as_deref());
        }
        let points = self.points();
        // By a mixture of the bits, so that few comparisons are of places.
        let mixed = |i: usize| {
            let bits = points[i].to_array().map(|x| (x + 0.0).to_bits());
            let mixed = bits.into_iter().fold(0_u64, |sum, bits| {
                (sum ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            });
            (mixed, i as u32)
        };
        let mut order = mapped(points.len(), A_RUN, mixed, ticket)?;
        order.par_sort_unstable();
        ticket.look()?;
        let mut found: Option<Box<[u32]>> = None;
        for alike in order.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
            for (at, (_, point)) in alike.iter().enumerate() {
                let is_here =
                    |other: &&(u64, u32)| points[other.1 as usize] == points[*point as usize];
                if let Some((_, first)) = alike[..at].iter().find(is_here) {
                    let found = found.get_or_insert_with(|| (0..points.len() as u32).collect());
                    found[*point as usize] = *first;
                }
            }
        }
        Ok(self.places.get_or_init(|| found).as_deref())
    }
}

impl Half {
    /// Of the places around a face, and whose it is; of a triangle the last is the third again.
    fn of(ring: [u32; 4], (solid, number): (u32, u8)) -> Self {
        let [a, b, c, d] = ring;
        let (count, mut sorted) = match c == d {
            true => (3, [a, b, c, u32::MAX]),
            false => (4, ring),
        };
        sorted.sort_unstable();
        let first = ring.iter().position(|place| *place == sorted[0]).unwrap_or_default();
        let is_turned = ring[(first + count - 1) % count] < ring[(first + 1) % count];
        let places = [0, 2].map(|i| u64::from(sorted[i]) << 32 | u64::from(sorted[i + 1]));
        Self { places, solid, number, is_turned }
    }
}

/// The numbers of a face's points, around it, of a triangle the last twice; `None` where it is a line. Corners at one place are
/// one, as in hexahedra that stand for wedges.
fn ring_of(face: &[usize], solid: &Solid, place: impl Fn(u32) -> u32) -> Option<[u32; 4]> {
    let corners = solid.corners();
    let mut own = [u32::MAX; 4];
    let mut count = 0;
    for &i in face {
        if count == 0 || place(own[count - 1]) != place(corners[i]) {
            own[count] = corners[i];
            count += 1;
        }
    }
    if count > 1 && place(own[0]) == place(own[count - 1]) {
        count -= 1;
    }
    match count {
        3 => Some([own[0], own[1], own[2], own[2]]),
        4 => Some(own),
        _ => None,
    }
}
