//! Elements of Exodus II as VTK's cells, whose points come in another order where they are quadratic.

use super::super::super::error::Problem;
use super::super::super::unstructured;
use crate::cells::Listing;

/// What the elements of a block are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Element {
    /// VTK's number.
    kind: u8,
    /// Which node each of VTK's points is.
    order: &'static [usize],
}

/// As many as anything here has, in their own order.
const PLAIN: [usize; 13] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
/// Edges below, above, upright; Exodus has those upright before those above.
const HEX20: [usize; 20] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15];
/// Then faces at x low and high, y, z, and the middle, which Exodus has first, with z before x and y.
const HEX27: [usize; 27] = [
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15, 23, 24, 25, 26, 21, 22,
    20,
];
const WEDGE15: [usize; 15] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11];

impl Element {
    /// The elements of a name, in capitals, with so many nodes; `None` of others. Nodes beyond those that are known are left
    /// out.
    pub(super) fn of(name: &str, nodes: usize) -> Option<Self> {
        let is = |names: &[&str]| names.iter().any(|known| name.starts_with(known));
        let plain = |kind, points| Some(Self { kind, order: &PLAIN[..points] });
        if is(&["HEX"]) {
            return match nodes {
                27.. => Some(Self { kind: 29, order: &HEX27 }),
                20.. => Some(Self { kind: 25, order: &HEX20 }),
                8.. => plain(12, 8),
                _ => None,
            };
        }
        if is(&["TET"]) {
            return match nodes {
                10.. => plain(24, 10),
                4.. => plain(10, 4),
                _ => None,
            };
        }
        if is(&["WED"]) {
            return match nodes {
                15.. => Some(Self { kind: 26, order: &WEDGE15 }),
                6.. => plain(13, 6),
                _ => None,
            };
        }
        if is(&["PYR"]) {
            return match nodes {
                13.. => plain(27, 13),
                5.. => plain(14, 5),
                _ => None,
            };
        }
        let is_flat = is(&["QUAD", "SHE", "TRI"]);
        let is_triangle = is(&["TRI"]) || (is_flat && matches!(nodes, 3 | 6));
        match nodes {
            6.. if is_triangle => plain(22, 6),
            3.. if is_triangle => plain(5, 3),
            9.. if is_flat => plain(28, 9),
            8.. if is_flat => plain(23, 8),
            4.. if is_flat => plain(9, 4),
            3.. if is(&["BAR", "BEA", "TRU", "ROD", "EDG"]) => plain(21, 3),
            2.. if is(&["BAR", "BEA", "TRU", "ROD", "EDG"]) => plain(3, 2),
            1.. if is(&["SPH", "CIR", "NOD", "POI"]) => plain(1, 1),
            _ => None,
        }
    }

    /// How many of the nodes are used.
    pub(super) fn corners(self) -> usize {
        self.order.len()
    }

    /// Adds elements of so many nodes each.
    ///
    /// # Errors
    /// Nodes that are no points.
    pub(super) fn add(
        self,
        listing: &mut Listing,
        numbers: &[i64],
        nodes: usize,
    ) -> Result<(), Problem> {
        let points = listing.points.len();
        let corners = unstructured::corners(numbers, points)?;
        for element in corners.chunks_exact(nodes.max(1)) {
            listing.corners.extend(self.order.iter().map(|node| element[*node]));
            listing.types.push(self.kind);
            listing.starts.push(listing.corners.len());
        }
        Ok(())
    }
}

/// The stem of the vector whose components the first names are, and how many: names that differ in their last letter alone,
/// X, Y and Z in either case (of flat meshes, X and Y).
pub(super) fn vector_of<'a>(names: &[&'a str], is_flat: bool) -> Option<(&'a str, usize)> {
    let parts = |name: &'a str| {
        let last = name.chars().last().filter(char::is_ascii)?;
        Some((&name[..name.len() - 1], last.to_ascii_uppercase()))
    };
    let (stem, _) = parts(names.first()?)?;
    let is = |at: usize, letter: char| {
        names.get(at).and_then(|name| parts(name)) == Some((stem, letter))
    };
    let shown = stem.trim_end_matches(['_', ' ', '-']);
    if shown.is_empty() || !(is(0, 'X') && is(1, 'Y')) {
        return None;
    }
    match (is(2, 'Z'), is_flat) {
        (true, _) => Some((shown, 3)),
        (false, true) => Some((shown, 2)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::cells::Cells;

    #[test]
    fn elements_are_known_by_name_and_nodes() {
        for (name, nodes, kind) in [
            ("HEX8", 8, 12),
            ("HEX", 20, 25),
            ("HEXAHEDRON", 27, 29),
            ("TETRA", 4, 10),
            ("TET10", 10, 24),
            ("WEDGE", 15, 26),
            ("PYRAMID13", 13, 27),
            ("SHELL4", 4, 9),
            ("SHELL", 3, 5),
            ("TRI6", 6, 22),
            ("QUAD9", 9, 28),
            ("BEAM", 2, 3),
            ("SPHERE", 1, 1),
        ] {
            assert_eq!(Element::of(name, nodes).map(|e| e.kind), Some(kind), "{name} {nodes}");
        }
        assert_eq!(Element::of("HEX", 4), None);
        assert_eq!(Element::of("SUPER", 8), None);
        assert_eq!(Element::of("TETRA", 8).map(Element::corners), Some(4));
    }

    /// Exodus' nodes of a hexahedron from 0 to 2: corners, edges below, upright and above, the middle, faces at z, x and y.
    fn hexahedron() -> Vec<DVec3> {
        let [a, b, c, d] = [[0, 0], [2, 0], [2, 2], [0, 2]];
        let [ab, bc, cd, da] = [[1, 0], [2, 1], [1, 2], [0, 1]];
        let at = |[x, y]: [i32; 2], z: i32| DVec3::new(f64::from(x), f64::from(y), f64::from(z));
        let mut nodes = Vec::new();
        nodes.extend([a, b, c, d].map(|p| at(p, 0)));
        nodes.extend([a, b, c, d].map(|p| at(p, 2)));
        nodes.extend([ab, bc, cd, da].map(|p| at(p, 0)));
        nodes.extend([a, b, c, d].map(|p| at(p, 1)));
        nodes.extend([ab, bc, cd, da].map(|p| at(p, 2)));
        nodes.extend([([1, 1], 1), ([1, 1], 0), ([1, 1], 2)].map(|(p, z)| at(p, z)));
        nodes.extend([([0, 1], 1), ([2, 1], 1), ([1, 0], 1), ([1, 2], 1)].map(|(p, z)| at(p, z)));
        nodes
    }

    fn wedge() -> Vec<DVec3> {
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0];
        let middles = [DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let above = |z: f64, list: [DVec3; 3]| list.map(|p| p + DVec3::Z * z);
        [
            above(0.0, corners),
            above(2.0, corners),
            middles,
            above(1.0, corners),
            above(2.0, middles),
        ]
        .concat()
    }

    #[test]
    fn quadratic_elements_are_straight_in_vtks_order() {
        for (name, points, volume, solids) in [
            ("HEX", hexahedron(), 8.0, 8),
            ("HEX", hexahedron()[..20].to_vec(), 8.0, 8),
            ("WEDGE", wedge(), 4.0, 8),
        ] {
            let nodes = points.len();
            let mut listing = Listing { points, starts: vec![0], ..Listing::default() };
            let numbers: Vec<i64> = (0..nodes as i64).collect();
            Element::of(name, nodes).unwrap().add(&mut listing, &numbers, nodes).unwrap();
            let cells = Cells::new(listing).unwrap();
            let volumes: Vec<f64> =
                (0..cells.solids().len()).map(|solid| cells.placed(solid).volume()).collect();
            assert_eq!(volumes.len(), solids);
            // Each piece the same: of a wrong order some would be turned or empty.
            for found in volumes {
                assert!((found - volume / solids as f64).abs() < 1e-12, "{name} {nodes}: {found}");
            }
        }
    }

    #[test]
    fn components_are_joined_by_their_last_letter() {
        let names = |text: &'static str| text.split(' ').collect::<Vec<_>>();
        assert_eq!(vector_of(&names("VX VY VZ P"), false), Some(("V", 3)));
        assert_eq!(vector_of(&names("disp_x disp_y disp_z"), false), Some(("disp", 3)));
        assert_eq!(vector_of(&names("VX VY P"), false), None);
        assert_eq!(vector_of(&names("VX VY P"), true), Some(("V", 2)));
        assert_eq!(vector_of(&names("X Y Z"), false), None);
        assert_eq!(vector_of(&names("VX WY VZ"), false), None);
        assert_eq!(vector_of(&["é"], false), None);
    }
}
