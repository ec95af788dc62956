//! Normals that are smooth across blunt edges and not across sharp ones.

use glam::{DVec3, Vec3};
use rayon::slice::ParallelSliceMut;

/// Edges at which triangles are turned by less than this are smooth.
pub const SOFT_DEGREES: f32 = 30.0;
/// Of more triangles each is hardly more than a pixel, and flat.
pub(super) const MOST_SOFTENED: usize = 1 << 21;
/// Triangles about a place of which each is compared with all: beyond, corners there are flat.
const MOST_ABOUT: usize = 256;

/// The normals at the corners of each triangle, from those of the triangles. Corners at one place are one, whatever their
/// numbers; zero where triangles have no area.
pub(super) fn soft_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    flat: &[Vec3],
) -> Vec<[Vec3; 3]> {
    let least = SOFT_DEGREES.to_radians().cos();
    let area = |triangle: usize| {
        let [a, b, c] = triangles[triangle].map(|i| positions[i as usize].as_dvec3());
        (b - a).cross(c - a).length()
    };
    let mut soft: Vec<[Vec3; 3]> = flat.iter().map(|normal| [*normal; 3]).collect();
    let about = by_place(positions, triangles);
    for own in about.chunk_by(|a, b| a.0 == b.0).filter(|own| own.len() <= MOST_ABOUT) {
        for &(_, triangle, corner) in own {
            let normal = flat[triangle];
            // Neighbours may go round the other way: both sides are lit.
            let sum: DVec3 = own
                .iter()
                .map(|&(_, other, _)| (other, flat[other].dot(normal)))
                .filter(|(_, cosine)| cosine.abs() > least)
                .map(|(other, cosine)| {
                    flat[other].as_dvec3() * area(other) * f64::from(cosine.signum())
                })
                .sum();
            let mean = sum.normalize_or_zero().as_vec3();
            if mean != Vec3::ZERO {
                soft[triangle][corner] = mean;
            }
        }
    }
    soft
}

/// The corners of all triangles by their places: the place's bits, the triangle, and which of its corners.
fn by_place(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<([u32; 3], usize, usize)> {
    let bits = |i: u32| positions[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let corners = triangles.iter().enumerate();
    let mut all: Vec<_> =
        corners.flat_map(|(at, t)| [0, 1, 2].map(|corner| (bits(t[corner]), at, corner))).collect();
    all.par_sort_unstable();
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygons::Mesh;

    /// Two triangles at an edge, the second turned by so many degrees, with corners of its own.
    fn folded(degrees: f32) -> [[Vec3; 3]; 2] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let far = Vec3::new(0.5, cos, sin);
        let positions = vec![Vec3::ZERO, Vec3::X, -Vec3::Y, Vec3::X, Vec3::ZERO, far];
        let triangles = vec![[1, 0, 2], [4, 3, 5]];
        let mesh = Mesh::new("", positions, Vec::new(), Vec::new(), triangles).unwrap().softened();
        let normals: Vec<_> = mesh.triangles(true).map(|t| t.normals).collect();
        [normals[0], normals[1]]
    }

    #[test]
    fn blunt_edges_are_smooth_and_sharp_ones_are_not() {
        let [a, b] = folded(20.0);
        assert!((a[0] - b[1]).length() < 1e-6 && (a[0] - a[2]).length() > 0.1, "{a:?} {b:?}");
        let [a, b] = folded(40.0);
        assert!(a == [a[0]; 3] && b == [b[0]; 3] && a[0] != b[0], "{a:?} {b:?}");
    }
}
