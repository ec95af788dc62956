//! Triangles cut into smaller ones where their edges are long.

use std::collections::HashMap;

use glam::Vec3;

/// A corner of a triangle: the number of its position, and its normal.
pub(super) type Corner = (u32, Vec3);

/// How often an edge is halved at most: to the last bit of a single-precision number.
const ROUNDS: u32 = 24;

/// The edges of one round, each judged once.
struct Edges<F> {
    positions: Vec<Vec3>,
    /// The number of the position in the middle, where an edge is long; by the numbers of its ends.
    middles: HashMap<[u32; 2], Option<u32>>,
    is_long: F,
}

impl<F: Fn([Vec3; 2]) -> bool> Edges<F> {
    /// The corner in the middle of an edge that is long.
    fn middle(&mut self, a: Corner, b: Corner) -> Option<Corner> {
        let Self { positions, middles, is_long } = self;
        let key = [a.0.min(b.0), a.0.max(b.0)];
        let number = *middles.entry(key).or_insert_with(|| {
            let ends = key.map(|number| positions[number as usize]);
            let number = u32::try_from(positions.len()).ok().filter(|_| is_long(ends))?;
            positions.push(ends[0] * 0.5 + ends[1] * 0.5);
            Some(number)
        });
        number.map(|number| (number, (a.1 + b.1).normalize_or_zero()))
    }
}

/// Halves all edges that are long until none is: positions, of which those that there were come first, and triangles. An edge is
/// judged by its ends alone, so that triangles on both sides of it stay joined. `None` where there would be more triangles than
/// `most`.
pub(super) fn with_short_edges(
    positions: Vec<Vec3>,
    triangles: Vec<[Corner; 3]>,
    is_long: impl Fn([Vec3; 2]) -> bool,
    most: usize,
) -> Option<(Vec<Vec3>, Vec<[Corner; 3]>)> {
    let mut edges = Edges { positions, middles: HashMap::new(), is_long };
    let (mut done, mut waiting) = (Vec::new(), triangles);
    for _ in 0..ROUNDS {
        edges.middles.clear();
        let mut parts = Vec::new();
        for triangle in waiting {
            let [a, b, c] = triangle;
            let middles = [(a, b), (b, c), (c, a)].map(|(from, to)| edges.middle(from, to));
            if middles.iter().all(Option::is_none) {
                done.push(triangle);
            } else {
                cut(triangle, middles, &mut parts);
            }
            if done.len() + parts.len() > most {
                return None;
            }
        }
        waiting = parts;
        if waiting.is_empty() {
            break;
        }
    }
    // Edges that are left are as short as numbers allow.
    done.append(&mut waiting);
    Some((edges.positions, done))
}

/// Cuts a triangle at the middles that its edges ab, bc and ca have.
fn cut([a, b, c]: [Corner; 3], middles: [Option<Corner>; 3], parts: &mut Vec<[Corner; 3]>) {
    match middles {
        [None, None, None] => parts.push([a, b, c]),
        [Some(ab), None, None] => parts.extend([[a, ab, c], [ab, b, c]]),
        [Some(ab), Some(bc), None] => parts.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
        [Some(ab), Some(bc), Some(ca)] => {
            parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        // The same from the next corner on.
        [first, second, third] => cut([b, c, a], [second, third, first], parts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area that triangles cover together.
    fn area(positions: &[Vec3], triangles: &[[Corner; 3]]) -> f32 {
        let own = |triangle: &[Corner; 3]| {
            let [a, b, c] = triangle.map(|(number, _)| positions[number as usize]);
            (b - a).cross(c - a).length()
        };
        triangles.iter().map(own).sum()
    }

    /// Two triangles with a common edge, one of them large.
    fn two() -> (Vec<Vec3>, Vec<[Corner; 3]>) {
        let positions = vec![Vec3::ZERO, Vec3::X * 8.0, Vec3::Y * 5.0, Vec3::new(8.0, 5.0, 1.0)];
        let triangles = [[0, 1, 2], [2, 1, 3]].map(|t| t.map(|number| (number, Vec3::Z)));
        (positions, triangles.to_vec())
    }

    #[test]
    fn no_edge_stays_long_nothing_is_lost_and_neighbours_share_their_edge() {
        let (positions, triangles) = two();
        let whole = area(&positions, &triangles);
        let is_long = |[a, b]: [Vec3; 2]| (b - a).length() > 1.0;
        let (positions, cut) = with_short_edges(positions, triangles, is_long, 1000).unwrap();
        assert!((area(&positions, &cut) - whole).abs() < 1e-4 * whole, "{}", cut.len());
        // How many triangles each edge is of.
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for [a, b, c] in &cut {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let ends = [from, to].map(|(number, _)| positions[*number as usize]);
                assert!(!is_long(ends), "{ends:?}");
                *edges.entry([from.0.min(to.0), from.0.max(to.0)]).or_default() += 1;
            }
        }
        // The outer sides, 8, 5, √65 and √26 long, are halved to 8, 8, 16 and 8 parts; what is not on them is shared by two.
        let alone = edges.values().filter(|count| **count == 1).count();
        assert!(edges.values().all(|count| *count <= 2) && alone == 40, "{alone}");
        assert!(cut.iter().flatten().all(|(_, normal)| *normal == Vec3::Z));
    }

    #[test]
    fn more_triangles_than_wanted_are_none_and_short_edges_stay() {
        let (positions, triangles) = two();
        let cut = |length: f32, most| {
            let is_long = move |[a, b]: [Vec3; 2]| (b - a).length() > length;
            with_short_edges(positions.clone(), triangles.clone(), is_long, most)
        };
        assert!(cut(1.0, 50).is_none());
        assert_eq!(cut(10.0, 2).unwrap(), (positions.clone(), triangles.clone()));
        // Lengths that numbers cannot reach end all the same.
        assert!(cut(0.0, 1 << 12).is_none());
    }
}
