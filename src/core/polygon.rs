//! Polygons as triangles.

use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::DVec3;

/// The triangles of a polygon by the numbers of its corners, two fewer than these: of a convex one all from its first corner; of one
/// with notches they fill what it encloses, seen across its mean plane. Of one that encloses nothing there all are from the first
/// corner, too.
pub fn triangles_of(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let count = corners.len();
    match count {
        0..3 => return Vec::new(),
        3 => return vec![[0, 1, 2]],
        _ => {}
    }
    let fan = || (1..count - 1).map(|i| [0, i, i + 1]).collect();
    if is_convex(corners) {
        return fan();
    }
    let (mut flat, mut found) = (Vec::new(), Vec::<usize>::new());
    // From the first corner on: squares of coordinates far from the origin have few digits.
    let offsets: Vec<[f64; 3]> =
        corners.iter().map(|corner| (*corner - corners[0]).to_array()).collect();
    if !project3d_to_2d(&offsets, count, &mut flat) {
        return fan();
    }
    Earcut::new().earcut(flat, &[], &mut found);
    let (triangles, rest) = found.as_chunks::<3>();
    match triangles.len() == count - 2 && rest.is_empty() {
        true => triangles.to_vec(),
        false => fan(),
    }
}

/// Whether all corners turn to one side about the mean of their normals, or one of them is not finite.
fn is_convex(corners: &[DVec3]) -> bool {
    let count = corners.len();
    let turn = |i: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| corners[(i + k) % count]);
        (b - a).cross(c - b)
    };
    let from = |i: usize| corners[i] - corners[0];
    let normal: DVec3 = (1..count - 1).map(|i| from(i).cross(from(i + 1))).sum();
    // Rounding makes notches of corners on a straight edge.
    let least = -1e-9 * normal.length_squared();
    !(0..count).any(|i| turn(i).dot(normal) < least)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas by the triangles, each counted as positive.
    fn area(corners: &[DVec3]) -> f64 {
        let of = |[a, b, c]: [usize; 3]| {
            0.5 * (corners[b] - corners[a]).cross(corners[c] - corners[a]).length()
        };
        triangles_of(corners).into_iter().map(of).sum()
    }

    /// In a plane that is across no axis, far from the origin.
    fn placed(corners: &[[f64; 2]]) -> Vec<DVec3> {
        let (u, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.48, 0.8, -0.36));
        corners.iter().map(|[x, y]| DVec3::new(1e5, -2e5, 3e5) + u * *x + v * *y).collect()
    }

    #[test]
    fn notches_are_left_out_however_the_corners_run_and_from_whichever_on() {
        let arrow = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]];
        let dart = [[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]];
        for (corners, expected) in [(&arrow[..], 2.5), (&dart[..], 1.5)] {
            for first in 0..corners.len() {
                let mut placed = placed(corners);
                placed.rotate_left(first);
                assert!((area(&placed) - expected).abs() < 1e-6, "{first}: {}", area(&placed));
                placed.reverse();
                assert!((area(&placed) - expected).abs() < 1e-6, "{first}: {}", area(&placed));
            }
        }
        // As it was: a fan from there covers the notch.
        let fan = |corners: &[DVec3]| -> f64 {
            let of = |i: usize| {
                0.5 * (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]).length()
            };
            (1..corners.len() - 1).map(of).sum()
        };
        assert!(fan(&placed(&arrow)) > 2.9);
    }

    #[test]
    fn convex_ones_are_fans_and_what_encloses_nothing_is_no_fewer_triangles() {
        let hexagon = [[1.0, 0.0], [2.0, 0.0], [3.0, 1.0], [2.0, 2.0], [1.0, 2.0], [0.0, 1.0]];
        let fan = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        assert_eq!(triangles_of(&placed(&hexagon)), fan);
        let line = [[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [2.0, 0.0]];
        assert_eq!(triangles_of(&placed(&line)).len(), 2);
        assert_eq!(triangles_of(&placed(&line[..2])), Vec::<[usize; 3]>::new());
        let nowhere = [DVec3::ZERO, DVec3::NAN, DVec3::ONE, DVec3::X, DVec3::Y];
        assert_eq!(triangles_of(&nowhere).len(), 3);
    }
}
