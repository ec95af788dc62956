//! Points of Lagrange's cells of any order, as VTK numbers them: corners, then those on edges, on faces and inside.

use std::collections::HashMap;

/// The corners that edges of a tetrahedron go between.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// The corners about its faces.
const FACES: [[usize; 3]; 4] = [[0, 1, 3], [2, 3, 1], [0, 3, 2], [0, 2, 1]];

/// The points of a triangle, each by what its corners weigh, of `order` in all (`vtkHigherOrderTriangle::Index`).
fn triangle(order: usize) -> Vec<[usize; 3]> {
    if order == 0 {
        return vec![[0; 3]];
    }
    let mut points: Vec<[usize; 3]> = (0..3).map(|corner| weighing([(corner, order)])).collect();
    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
        points.extend((1..order).map(|i| weighing([(a, order - i), (b, i)])));
    }
    if order >= 3 {
        points.extend(triangle(order - 3).into_iter().map(|weights| weights.map(|w| w + 1)));
    }
    points
}

/// The same of a tetrahedron (`vtkHigherOrderTetra::Index`).
pub(in crate::cells) fn tetrahedron(order: usize) -> Vec<[usize; 4]> {
    if order == 0 {
        return vec![[0; 4]];
    }
    let mut points: Vec<[usize; 4]> = (0..4).map(|corner| weighing([(corner, order)])).collect();
    for [a, b] in EDGES {
        points.extend((1..order).map(|i| weighing([(a, order - i), (b, i)])));
    }
    if order >= 3 {
        for corners in FACES {
            points.extend(
                triangle(order - 3)
                    .into_iter()
                    .map(|own| weighing([0, 1, 2].map(|i| (corners[i], own[i] + 1)))),
            );
        }
    }
    if order >= 4 {
        points.extend(tetrahedron(order - 4).into_iter().map(|weights| weights.map(|w| w + 1)));
    }
    points
}

/// Weights of which some corners have these, and others none.
fn weighing<const N: usize, const M: usize>(of: [(usize, usize); M]) -> [usize; N] {
    let mut weights = [0; N];
    of.into_iter().for_each(|(corner, weight)| weights[corner] = weight);
    weights
}

/// The points of a wedge by where they lie along two edges of the triangle, and between the triangles
/// (`vtkHigherOrderWedge::PointIndexFromIJK`).
pub(in crate::cells) fn wedge(order: usize) -> Vec<[usize; 3]> {
    let n = order;
    // Along the edges of the triangle, but for its corners.
    let edge = |side: usize| (1..n).map(move |i| [[i, 0], [n - i, i], [0, n - i]][side]);
    let corners = [[0, 0], [n, 0], [0, n]];
    let inner: Vec<[usize; 2]> = (1..n).flat_map(|j| (1..n - j).map(move |i| [i, j])).collect();
    let at = |[i, j]: [usize; 2], k: usize| [i, j, k];
    let mut points = Vec::new();
    for k in [0, n] {
        points.extend(corners.map(|corner| at(corner, k)));
    }
    for k in [0, n] {
        points.extend((0..3).flat_map(edge).map(|place| at(place, k)));
    }
    for corner in corners {
        points.extend((1..n).map(|k| at(corner, k)));
    }
    for k in [0, n] {
        points.extend(inner.iter().map(|place| at(*place, k)));
    }
    for side in 0..3 {
        points.extend((1..n).flat_map(|k| edge(side).map(move |place| at(place, k))));
    }
    points.extend((1..n).flat_map(|k| inner.iter().map(move |place| at(*place, k))));
    points
}

/// Which number each of some points has.
fn numbers<const N: usize>(points: Vec<[usize; N]>) -> HashMap<[usize; N], usize> {
    points.into_iter().enumerate().map(|(number, point)| (point, number)).collect()
}

/// The tetrahedra that a tetrahedron of an order is split into, by the numbers of its points: the cubes of a lattice are split into
/// six each along a diagonal, and of these those count where order ≥ x ≥ y ≥ z ≥ 0. Their faces on its own are the
/// triangles into which lines along its edges cut these, so that neighbours meet in them.
pub(super) fn tetrahedra(order: usize) -> Vec<[usize; 4]> {
    const WAYS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let number = numbers(tetrahedron(order));
    let of = |[x, y, z]: [usize; 3]| {
        let is_in = order >= x && x >= y && y >= z;
        is_in.then(|| number[&[order - x, x - y, y - z, z]])
    };
    let mut parts = Vec::new();
    for low in (0..order).flat_map(|x| (0..=x).flat_map(move |y| (0..=y).map(move |z| [x, y, z]))) {
        for (way, axes) in WAYS.iter().enumerate() {
            let mut at = low;
            let mut part = [of(low); 4];
            for (corner, axis) in part[1..].iter_mut().zip(axes) {
                at[*axis] += 1;
                *corner = of(at);
            }
            let [Some(a), Some(b), Some(c), Some(d)] = part else { continue };
            // The last three ways go round the other way.
            parts.push(if way < 3 { [a, b, c, d] } else { [a, c, b, d] });
        }
    }
    parts
}

/// The triangles that a triangle of an order is split into.
pub(super) fn triangles(order: usize) -> Vec<[usize; 3]> {
    let number = numbers(triangle(order));
    let of = |[i, j]: [usize; 2]| number[&[order - i - j, i, j]];
    let mut parts = Vec::new();
    for (i, j) in (0..order).flat_map(|j| (0..order - j).map(move |i| (i, j))) {
        parts.push([[i, j], [i + 1, j], [i, j + 1]].map(of));
        if i + j + 2 <= order {
            parts.push([[i + 1, j], [i + 1, j + 1], [i, j + 1]].map(of));
        }
    }
    parts
}

/// The number that VTK gives a point of a quadrilateral of an order (`vtkHigherOrderQuadrilateral::PointIndexFromIJK`).
pub(super) fn of_quadrilateral([i, j]: [usize; 2], order: usize) -> usize {
    let inner = order - 1;
    match [i, j].map(|x| x == 0 || x == order) {
        [true, true] => match (i > 0, j > 0) {
            (false, false) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, true) => 3,
        },
        [false, true] => 4 + (i - 1) + if j > 0 { 2 * inner } else { 0 },
        [true, false] => 4 + (j - 1) + if i > 0 { inner } else { 3 * inner },
        [false, false] => 4 + 4 * inner + (i - 1) + inner * (j - 1),
    }
}

/// The wedges that a wedge of an order is split into.
pub(super) fn wedges(order: usize) -> Vec<[usize; 6]> {
    let number = numbers(wedge(order));
    let mut parts = Vec::new();
    for k in 0..order {
        for (i, j) in (0..order).flat_map(|j| (0..order - j).map(move |i| (i, j))) {
            let mut push = |triangle: [[usize; 2]; 3]| {
                let [a, b, c] = triangle.map(|[i, j]| [0, 1].map(|up| number[&[i, j, k + up]]));
                parts.push([a[0], b[0], c[0], a[1], b[1], c[1]]);
            };
            push([[i, j], [i + 1, j], [i, j + 1]]);
            if i + j + 2 <= order {
                push([[i + 1, j], [i + 1, j + 1], [i, j + 1]]);
            }
        }
    }
    parts
}

/// The number that VTK gives a point of a hexahedron of an order (`vtkHigherOrderHexahedron::PointIndexFromIJK`).
pub(super) fn of_hexahedron([i, j, k]: [usize; 3], order: usize) -> usize {
    let at_end = |x: usize| x == 0 || x == order;
    let ends = [i, j, k].map(at_end);
    let inner = order - 1;
    let ring = |i: usize, j: usize| match (i > 0, j > 0) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    };
    match ends {
        [true, true, true] => ring(i, j) + if k > 0 { 4 } else { 0 },
        // Twelve edges: four below, four above, four upright.
        [false, true, true] => {
            (i - 1) + if j > 0 { 2 * inner } else { 0 } + if k > 0 { 4 * inner } else { 0 } + 8
        }
        [true, false, true] => {
            (j - 1) + if i > 0 { inner } else { 3 * inner } + if k > 0 { 4 * inner } else { 0 } + 8
        }
        [true, true, false] => (k - 1) + inner * ring(i, j) + 8 * inner + 8,
        // Six faces.
        [true, false, false] => {
            8 + 12 * inner + (j - 1) + inner * (k - 1) + if i > 0 { inner * inner } else { 0 }
        }
        [false, true, false] => {
            8 + 12 * inner
                + 2 * inner * inner
                + (i - 1)
                + inner * (k - 1)
                + if j > 0 { inner * inner } else { 0 }
        }
        [false, false, true] => {
            8 + 12 * inner
                + 4 * inner * inner
                + (i - 1)
                + inner * (j - 1)
                + if k > 0 { inner * inner } else { 0 }
        }
        [false, false, false] => {
            8 + 12 * inner + 6 * inner * inner + (i - 1) + inner * ((j - 1) + inner * (k - 1))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As VTK numbers them: corners, edges around the third one's far side backwards, and rows within.
    #[test]
    fn points_of_polygons_are_numbered_as_vtk_does() {
        let third: Vec<[usize; 2]> = triangle(3).iter().map(|of| [of[1], of[2]]).collect();
        let corners = [[0, 0], [3, 0], [0, 3]];
        let edges = [[1, 0], [2, 0], [2, 1], [1, 2], [0, 2], [0, 1]];
        assert_eq!(third, [&corners[..], &edges, &[[1, 1]]].concat());
        let rows = |order: usize| -> Vec<Vec<usize>> {
            let row = |j| (0..=order).map(move |i| of_quadrilateral([i, j], order)).collect();
            (0..=order).map(row).collect()
        };
        assert_eq!(rows(1), [[0, 1], [3, 2]]);
        assert_eq!(rows(2), [[0, 4, 1], [7, 8, 5], [3, 6, 2]]);
        let third = [[0, 4, 5, 1], [10, 12, 13, 6], [11, 14, 15, 7], [3, 8, 9, 2]];
        assert_eq!(rows(3), third);
        for order in 1..=10 {
            assert_eq!(triangles(order).len(), order * order);
        }
    }

    /// As VTK 9.7 numbers them.
    #[test]
    fn points_are_numbered_as_vtk_does() {
        let of = |point: &[usize; 4]| [point[1], point[2], point[3]];
        let fifth: Vec<[usize; 3]> = tetrahedron(5).iter().map(of).collect();
        assert_eq!(fifth.len(), 56);
        let faces = [
            [1, 0, 1],
            [3, 0, 1],
            [1, 0, 3],
            [2, 0, 1],
            [2, 0, 2],
            [1, 0, 2],
            [1, 3, 1],
            [1, 1, 3],
            [3, 1, 1],
            [1, 2, 2],
            [2, 1, 2],
            [2, 2, 1],
            [0, 1, 1],
            [0, 1, 3],
            [0, 3, 1],
            [0, 1, 2],
            [0, 2, 2],
            [0, 2, 1],
            [1, 1, 0],
            [1, 3, 0],
            [3, 1, 0],
            [1, 2, 0],
            [2, 2, 0],
            [2, 1, 0],
            [1, 1, 1],
            [2, 1, 1],
            [1, 2, 1],
            [1, 1, 2],
        ];
        assert_eq!(fifth[28..], faces);
        assert_eq!(
            fifth[4..12],
            [
                [1, 0, 0],
                [2, 0, 0],
                [3, 0, 0],
                [4, 0, 0],
                [4, 1, 0],
                [3, 2, 0],
                [2, 3, 0],
                [1, 4, 0]
            ]
        );
        assert_eq!(fifth[24..28], [[0, 4, 1], [0, 3, 2], [0, 2, 3], [0, 1, 4]]);
        let third = wedge(3);
        let expected = [
            [0, 0, 0],
            [3, 0, 0],
            [0, 3, 0],
            [0, 0, 3],
            [3, 0, 3],
            [0, 3, 3],
            [1, 0, 0],
            [2, 0, 0],
            [2, 1, 0],
            [1, 2, 0],
            [0, 2, 0],
            [0, 1, 0],
            [1, 0, 3],
            [2, 0, 3],
            [2, 1, 3],
            [1, 2, 3],
            [0, 2, 3],
            [0, 1, 3],
            [0, 0, 1],
            [0, 0, 2],
            [3, 0, 1],
            [3, 0, 2],
            [0, 3, 1],
            [0, 3, 2],
            [1, 1, 0],
            [1, 1, 3],
            [1, 0, 1],
            [2, 0, 1],
            [1, 0, 2],
            [2, 0, 2],
            [2, 1, 1],
            [1, 2, 1],
            [2, 1, 2],
            [1, 2, 2],
            [0, 2, 1],
            [0, 1, 1],
            [0, 2, 2],
            [0, 1, 2],
            [1, 1, 1],
            [1, 1, 2],
        ];
        assert_eq!(third, expected);
        let fifth = wedge(5);
        assert_eq!(
            (fifth.len(), fifth[42..48].to_vec()),
            (126, vec![[1, 1, 0], [2, 1, 0], [3, 1, 0], [1, 2, 0], [2, 2, 0], [1, 3, 0]])
        );
        assert_eq!(fifth[86..90], [[0, 4, 1], [0, 3, 1], [0, 2, 1], [0, 1, 1]]);
    }
}
