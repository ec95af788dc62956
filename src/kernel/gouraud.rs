//! Footprints as meshes of triangles with a value at each vertex, linear between (Laur–Hanrahan §2).

use std::f64::consts::PI;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::RadialKernel;

/// Places along the distance from the middle at which a mesh is fitted.
const PLACES: usize = 480;
/// Places along half of a ring's edge between two corners.
const EDGE_PLACES: usize = 12;
/// Rounds in which every ring's radius is moved to where it serves best, at most,
const ROUNDS: usize = 24;
/// each by so many steps of a golden section,
const STEPS: usize = 14;
/// while a round takes off at least this part of the squared error.
const WORTH: f64 = 1e-6;

/// How finely a footprint is cut into triangles: "the number of angular subdivisions" and "of radial
/// subdivisions".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(default)]
pub struct Subdivisions {
    /// Corners of each ring.
    pub angles: u32,
    /// Rings about the middle; the outermost is where the footprint is 0.
    pub rings: u32,
}

impl Subdivisions {
    /// Angles on offer.
    pub const ANGLES: std::ops::RangeInclusive<u32> = 3..=64;
    /// Rings on offer.
    pub const RINGS: std::ops::RangeInclusive<u32> = 1..=16;

    /// Triangles of a splat: a fan, and a band of two a corner for each further ring.
    pub fn triangles(self) -> u32 {
        self.angles * (2 * self.rings).saturating_sub(1)
    }
}

impl Default for Subdivisions {
    /// 56 triangles, 3.7 % off the footprint (root mean square): see [`SplatMesh`].
    fn default() -> Self {
        Self { angles: 8, rings: 4 }
    }
}

/// A corner of a [`SplatMesh`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshVertex {
    /// Offset from the middle on the kernel's unit disc, in radii of the kernel. Corners may lie a
    /// little beyond 1, where their ring's edges lie within.
    pub position: DVec2,
    /// Length in voxels for which the kernel's full density stands there, as F: at its natural extent.
    pub factor: f64,
}

/// A footprint F(l) as triangles: the middle, and rings of equally many corners about it, the first
/// of them half a sector from the x axis.
///
/// The radii of its rings and the values there are those nearest to F in the root mean square over the
/// plane that a descent finds, among meshes that hold as much as the kernel does
/// ([`RadialKernel::energy`]): so it keeps mean depth. (Values *of* F at even radii are twice as far
/// off, and hold 5 % too little at 8 × 4.) Off by, as a part of F's own root mean square, for the
/// cubic: 5.0 % at 8 × 2, 3.7 % at 8 × 4, 2.0 % at 12 × 4, 1.1 % at 16 × 6, and a quarter of it
/// where both are doubled.
///
/// What is drawn has its *opacity* linear between corners, and so less of it than the footprint where
/// splats are dense: at 8 × 4, along lines through the middle of a voxel of opacity 0.1, 0.5 and 0.9,
/// 0.3, 2.1 and 5.1 % less over the plane, and 3.7, 4.5 and 7.4 % off. Linear on the screen, also in
/// perspective: a mesh lies on the ellipse of the projection linearised at the kernel's middle, which
/// has one depth, so there is nothing to correct.
///
/// A ring's edges run parallel to those of its neighbours, with equal values at their ends: which
/// diagonal cuts the band between into triangles makes no difference while these are equal.
#[derive(Debug, Clone, PartialEq)]
pub struct SplatMesh {
    /// The middle, then each ring from the inside out.
    pub vertices: Vec<MeshVertex>,
    /// Indices of vertices, three a triangle.
    pub triangles: Vec<[u16; 3]>,
    /// Root of ∫(mesh − F)² over ∫F² over the plane.
    pub rms_error: f64,
}

impl SplatMesh {
    /// The mesh of a kernel's footprint, the same at every extent. Subdivisions beyond what is on
    /// offer are brought into it. Takes milliseconds.
    pub fn of(kernel: RadialKernel, subdivisions: Subdivisions) -> Self {
        let clamped = |n: u32, range: std::ops::RangeInclusive<u32>| -> usize {
            n.clamp(*range.start(), *range.end()) as usize
        };
        let angles = clamped(subdivisions.angles, Subdivisions::ANGLES);
        let rings = clamped(subdivisions.rings, Subdivisions::RINGS);
        let target = Target::new(RadialKernel::natural_of(kernel.shape), angles);
        let (radii, factors, error) = target.fitted(rings);
        let unit = 1.0 / RadialKernel::natural_of(kernel.shape).radius();
        let mut vertices = vec![MeshVertex { position: DVec2::ZERO, factor: factors[0] }];
        for (ring, radius) in radii.iter().enumerate() {
            let factor = factors.get(ring + 1).copied().unwrap_or(0.0);
            vertices.extend((0..angles).map(|corner| {
                let angle = (corner as f64 + 0.5) * 2.0 * PI / angles as f64;
                MeshVertex { position: DVec2::from_angle(angle) * (radius * unit), factor }
            }));
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most 1025 vertices")]
        let at = |ring: usize, corner: usize| (1 + ring * angles + corner % angles) as u16;
        let fan = (0..angles).map(|corner| [0, at(0, corner), at(0, corner + 1)]);
        let bands = (1..rings).flat_map(|ring| {
            (0..angles).flat_map(move |corner| {
                let [a, b] = [at(ring - 1, corner), at(ring - 1, corner + 1)];
                let [c, d] = [at(ring, corner), at(ring, corner + 1)];
                [[a, c, d], [a, d, b]]
            })
        });
        Self { vertices, triangles: fan.chain(bands).collect(), rms_error: error }
    }
}

/// What a mesh of some angles is fitted to: F along its rings.
///
/// On such a mesh the value depends on ρ alone, the circumradius of the ring through a place. So the
/// squared error over the plane is ∫(g(ρ) − F̄(ρ))² dA, F̄ the mean of F along the edges of a ring,
/// and, whatever the mesh's values, what F varies along them.
struct Target {
    /// Angles of the mesh.
    angles: f64,
    /// ∫F over the plane.
    energy: f64,
    /// Voxels.
    places: Vec<f64>,
    /// F̄ there.
    means: Vec<f64>,
    /// Area of the ring of each place.
    areas: Vec<f64>,
    /// ∫ of F's variance along rings, and ∫F².
    varying: f64,
    squares: f64,
}

impl Target {
    fn new(kernel: RadialKernel, angles: usize) -> Self {
        let half = PI / angles as f64;
        // Rings further out meet nothing of the kernel.
        let end = kernel.radius() / half.cos();
        let step = end / PLACES as f64;
        let places: Vec<f64> = (0..PLACES).map(|i| (i as f64 + 0.5) * step).collect();
        let areas: Vec<f64> =
            places.iter().map(|rho| angles as f64 * (2.0 * half).sin() * rho * step).collect();
        let (mut means, mut varying, mut squares) = (Vec::new(), 0.0, 0.0);
        for (rho, area) in places.iter().zip(&areas) {
            let along = (0..EDGE_PLACES).map(|i| {
                let side = (i as f64 + 0.5) / EDGE_PLACES as f64 * half.tan();
                kernel.footprint(rho * half.cos() * 1.0_f64.hypot(side))
            });
            let (sum, square) = along.fold((0.0, 0.0), |(s, q), f| (s + f, q + f * f));
            let (mean, square) = (sum / EDGE_PLACES as f64, square / EDGE_PLACES as f64);
            means.push(mean);
            varying += area * (square - mean * mean).max(0.0);
            squares += area * square;
        }
        let energy = kernel.energy();
        Self { angles: angles as f64, energy, places, means, areas, varying, squares }
    }

    /// Circumradii, values from the middle outwards but for the last, which is 0, and the error.
    fn fitted(&self, rings: usize) -> (Vec<f64>, Vec<f64>, f64) {
        let end = self.places[PLACES - 1];
        // Fewer rings do better with one near the middle, whatever is best for many.
        let inward = (1..=rings).map(|ring| end * (ring as f64 / rings as f64).powf(1.5)).collect();
        let [a, b] = [self.bent_radii(rings), inward].map(|radii| self.descended(radii));
        let (radii, best) = if a.1 <= b.1 { a } else { b };
        let mut values = self.values(&radii);
        let kept = self.energy / self.held(&radii, &values);
        values.iter_mut().for_each(|value| *value *= kept);
        (radii, values, (best / self.squares).sqrt())
    }

    /// Moves one ring after the other to where it serves best; the radii, and their squared error.
    fn descended(&self, mut radii: Vec<f64>) -> (Vec<f64>, f64) {
        let rings = radii.len();
        let mut best = self.error(&radii);
        for _ in 0..ROUNDS {
            let before = best;
            for ring in 0..rings {
                let inner = if ring > 0 { radii[ring - 1] } else { 0.0 };
                let last = self.places[PLACES - 1] * 1.1;
                let outer = radii.get(ring + 1).copied().unwrap_or(last);
                let margin = 0.02 * (outer - inner);
                let mut moved = radii.clone();
                let found = golden([inner + margin, outer - margin], |radius| {
                    moved[ring] = radius;
                    self.error(&moved)
                });
                if found.1 < best {
                    (radii[ring], best) = found;
                }
            }
            if before - best < WORTH * before {
                break;
            }
        }
        (radii, best)
    }

    /// Rings as dense as asymptotically best for the least squared error over the plane: the fifth
    /// root of ρ·F̄″².
    fn bent_radii(&self, rings: usize) -> Vec<f64> {
        let bend = |i: usize| {
            let i = i.clamp(1, PLACES - 2);
            self.means[i - 1] - 2.0 * self.means[i] + self.means[i + 1]
        };
        let density = (0..PLACES).map(|i| (self.places[i] * bend(i).powi(2)).powf(0.2));
        let sums: Vec<f64> = density
            .scan(0.0, |sum, d| {
                *sum += d;
                Some(*sum)
            })
            .collect();
        let total = sums[PLACES - 1];
        (1..=rings)
            .map(|ring| {
                let wanted = total * ring as f64 / rings as f64;
                self.places[sums.partition_point(|&sum| sum < wanted).min(PLACES - 1)]
            })
            .collect()
    }

    /// The hat functions at each place: the ring outside of it, and how near that is in 0..=1.
    fn hats(&self, radii: &[f64]) -> impl Iterator<Item = (usize, usize, f64)> {
        let mut ring = 0;
        let count = radii.len();
        self.places.iter().enumerate().filter_map(move |(i, &rho)| {
            while ring < count && rho > radii[ring] {
                ring += 1;
            }
            (ring < count).then(|| {
                let inner = if ring > 0 { radii[ring - 1] } else { 0.0 };
                (i, ring, (rho - inner) / (radii[ring] - inner))
            })
        })
    }

    /// The values of the least squared error among those that hold the kernel's energy.
    fn values(&self, radii: &[f64]) -> Vec<f64> {
        let n = radii.len();
        // Normal equations of hat functions: three diagonals, the outer two alike.
        let (mut middle, mut beside) = (vec![0.0; n], vec![0.0; n]);
        let (mut wanted, mut held) = (vec![0.0; n], vec![0.0; n]);
        for (i, ring, outer) in self.hats(radii) {
            let (area, mean) = (self.areas[i], self.means[i]);
            let inner = 1.0 - outer;
            middle[ring] += area * inner * inner;
            wanted[ring] += area * inner * mean;
            held[ring] += area * inner;
            if ring + 1 < n {
                middle[ring + 1] += area * outer * outer;
                beside[ring] += area * inner * outer;
                wanted[ring + 1] += area * outer * mean;
                held[ring + 1] += area * outer;
            }
        }
        let free = tridiagonal(&middle, &beside, &wanted);
        let push = tridiagonal(&middle, &beside, &held);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let more = (self.energy - dot(&held, &free)) / dot(&held, &push);
        free.iter().zip(&push).map(|(free, push)| free + more * push).collect()
    }

    /// ∫(mesh − F)² over the plane, with the best values for these radii.
    fn error(&self, radii: &[f64]) -> f64 {
        let values = self.values(radii);
        let mut error = self.varying;
        let mut done = 0;
        for (i, ring, outer) in self.hats(radii) {
            let next = values.get(ring + 1).copied().unwrap_or(0.0);
            let value = values[ring] + (next - values[ring]) * outer;
            error += self.areas[i] * (value - self.means[i]).powi(2);
            done = i + 1;
        }
        let beyond = self.means[done..].iter().zip(&self.areas[done..]);
        error + beyond.map(|(mean, area)| area * mean * mean).sum::<f64>()
    }

    /// ∫ of the mesh over the plane, exactly.
    fn held(&self, radii: &[f64], values: &[f64]) -> f64 {
        let turn = self.angles * (2.0 * PI / self.angles).sin();
        let mut sum = 0.0;
        for (ring, &outer) in radii.iter().enumerate() {
            let inner = if ring > 0 { radii[ring - 1] } else { 0.0 };
            let (a, b) = (values[ring], values.get(ring + 1).copied().unwrap_or(0.0));
            // ∫ρ(a + (b − a)(ρ − inner)/(outer − inner)) dρ.
            let width = outer - inner;
            sum += width * (inner * (a + b) / 2.0 + width * (a + 2.0 * b) / 6.0);
        }
        turn * sum
    }
}

/// The least of `f` between two places, and where, if it falls and then rises.
fn golden([mut low, mut high]: [f64; 2], mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    let share = (3.0 - 5.0_f64.sqrt()) / 2.0;
    let mut left = low + share * (high - low);
    let mut right = high - share * (high - low);
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..STEPS {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = low + share * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = high - share * (high - low);
            at_right = f(right);
        }
    }
    if at_left < at_right { (left, at_left) } else { (right, at_right) }
}

/// Solves a symmetric tridiagonal system; `beside[i]` couples i and i + 1.
fn tridiagonal(middle: &[f64], beside: &[f64], right: &[f64]) -> Vec<f64> {
    let n = middle.len();
    let (mut pivot, mut solution) = (middle.to_vec(), right.to_vec());
    for i in 1..n {
        let share = beside[i - 1] / pivot[i - 1];
        pivot[i] -= share * beside[i - 1];
        solution[i] -= share * solution[i - 1];
    }
    for i in (0..n).rev() {
        let next = if i + 1 < n { beside[i] * solution[i + 1] } else { 0.0 };
        solution[i] = (solution[i] - next) / pivot[i];
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    fn cubic() -> RadialKernel {
        RadialKernel::new(Kernel::Cubic, None).unwrap()
    }

    fn mesh(kernel: RadialKernel, angles: u32, rings: u32) -> SplatMesh {
        SplatMesh::of(kernel, Subdivisions { angles, rings })
    }

    /// The mesh's value at an offset in radii, from its triangles alone; `None` beyond them.
    fn value(mesh: &SplatMesh, at: DVec2) -> Option<f64> {
        mesh.triangles.iter().find_map(|corners| {
            let [a, b, c] = corners.map(|i| mesh.vertices[usize::from(i)]);
            let whole = (b.position - a.position).perp_dot(c.position - a.position);
            let part = |p: DVec2, q: DVec2| (p - at).perp_dot(q - at) / whole;
            let weights = [
                part(b.position, c.position),
                part(c.position, a.position),
                part(a.position, b.position),
            ];
            let inside = weights.iter().all(|w| *w >= -1e-12);
            inside.then(|| weights[0] * a.factor + weights[1] * b.factor + weights[2] * c.factor)
        })
    }

    /// [`compared`] with a kernel's footprint.
    fn measured(mesh: &SplatMesh, kernel: RadialKernel) -> [f64; 3] {
        compared(mesh, kernel.radius(), |l| kernel.footprint(l))
    }

    /// ∫ of the mesh and its root mean square difference to a function of the distance, both as parts
    /// of the function's own, and the greatest as a part of its peak: by the midpoint rule over a
    /// square.
    fn compared(mesh: &SplatMesh, radius: f64, wanted: impl Fn(f64) -> f64) -> [f64; 3] {
        const SIDE: i32 = 240;
        let (mut held, mut whole) = (0.0, 0.0);
        let (mut error, mut squares, mut most) = (0.0, 0.0, 0.0_f64);
        let step = 2.4 / f64::from(SIDE);
        for i in 0..SIDE * SIDE {
            let at = DVec2::new(f64::from(i % SIDE) + 0.5, f64::from(i / SIDE) + 0.5) * step - 1.2;
            let found = value(mesh, at).unwrap_or(0.0);
            let expected = wanted(at.length() * radius);
            held += found;
            whole += expected;
            error += (found - expected).powi(2);
            squares += expected * expected;
            most = most.max((found - expected).abs());
        }
        [held / whole, (error / squares).sqrt(), most / wanted(0.0)]
    }

    #[test]
    fn a_mesh_holds_what_its_kernel_does_and_is_as_far_off_as_it_says() {
        for kernel in [cubic(), RadialKernel::new(Kernel::Gaussian, None).unwrap()] {
            for (angles, rings) in [(3, 1), (5, 2), (7, 2), (8, 3), (8, 4), (12, 4), (16, 6)] {
                let mesh = mesh(kernel, angles, rings);
                let [held, rms, most] = measured(&mesh, kernel);
                println!("measured {angles} × {rings}: holds {held:.5}, rms {rms:.4}, {most:.3}");
                // Measured: 3e-5 and 2e-4, of this quadrature.
                assert!((held - 1.0).abs() < 2e-4, "{angles} × {rings}: {held}");
                assert!((rms - mesh.rms_error).abs() < 1e-3, "{rms} is not {}", mesh.rms_error);
                let [a, t] = [mesh.vertices.len(), mesh.triangles.len()].map(|n| n as u32);
                assert_eq!(a, 1 + angles * rings);
                assert_eq!(t, Subdivisions { angles, rings }.triangles());
            }
        }
    }

    #[test]
    fn dense_splats_have_a_little_less_opacity_than_their_footprints() {
        let (kernel, usual) = (cubic(), mesh(cubic(), 8, 4));
        for (alpha, less, off) in [(0.1, 0.003, 0.037), (0.5, 0.021, 0.045), (0.9, 0.051, 0.074)] {
            let opacity = |f: f64| 1.0 - (1.0_f64 - alpha).powf(f);
            let mut shaded = usual.clone();
            shaded.vertices.iter_mut().for_each(|v| v.factor = opacity(v.factor));
            let [held, rms, _] =
                compared(&shaded, kernel.radius(), |l| opacity(kernel.footprint(l)));
            println!("measured opacities of {alpha}: {held:.4} of them, rms {rms:.4}");
            assert!((1.0 - held - less).abs() < 1e-3 && (rms - off).abs() < 1e-3, "{held} {rms}");
        }
    }

    #[test]
    fn errors_are_those_stated_and_fall_with_the_square_of_the_subdivisions() {
        let error = |angles, rings| mesh(cubic(), angles, rings).rms_error;
        for (angles, rings, stated) in
            [(8, 2, 0.0499), (8, 4, 0.0372), (12, 4, 0.0198), (16, 6, 0.0112)]
        {
            let found = error(angles, rings);
            assert!((found - stated).abs() < 2e-4, "{angles} × {rings}: {found}");
        }
        let errors = [(8, 3), (16, 6), (32, 12)].map(|(a, r)| error(a, r));
        println!("measured errors, doubling: {errors:?}");
        for pair in errors.windows(2) {
            let gain = pair[0] / pair[1];
            assert!((3.6..4.8).contains(&gain), "{errors:?}");
        }
        assert_eq!(Subdivisions::default(), Subdivisions { angles: 8, rings: 4 });
    }

    #[test]
    fn fitted_rings_are_nearer_than_even_ones_with_values_of_the_footprint() {
        let kernel = cubic();
        for (angles, rings) in [(7, 2), (8, 4), (12, 4)] {
            let fitted = mesh(kernel, angles, rings);
            let mut even = fitted.clone();
            for (i, vertex) in even.vertices.iter_mut().enumerate() {
                let ring = i.div_ceil(angles as usize) as f64 / f64::from(rings);
                vertex.position = vertex.position.normalize_or_zero() * ring;
                vertex.factor = kernel.footprint(ring * kernel.radius());
            }
            let [[_, near, _], [held, far, _]] = [&fitted, &even].map(|m| measured(m, kernel));
            println!("measured {angles} × {rings}: {near:.4}, even {far:.4} and holds {held:.4}");
            assert!(near < 0.9 * far, "{near} {far}");
            assert!((held - 1.0).abs() > 3e-3, "{held}");
        }
    }

    #[test]
    fn rings_lie_within_one_another_and_fall_to_nothing() {
        for angles in [3, 4, 7, 8, 31, 64] {
            for rings in 1..=16 {
                let mesh = mesh(cubic(), angles, rings);
                let at = |ring: u32| mesh.vertices[(1 + ring * angles) as usize];
                for ring in 0..rings {
                    let inner = if ring > 0 { at(ring - 1) } else { mesh.vertices[0] };
                    let case = format!("{angles} × {rings}, ring {ring}");
                    assert!(at(ring).position.length() > inner.position.length(), "{case}");
                    assert!(at(ring).factor < inner.factor, "{case}");
                    assert!(at(ring).factor >= 0.0, "{case}: {}", at(ring).factor);
                }
                assert_eq!(at(rings - 1).factor, 0.0);
                let reach = at(rings - 1).position.length() * (PI / f64::from(angles)).cos();
                assert!(reach < 1.1, "{reach}");
            }
        }
    }

    #[test]
    fn extents_do_not_change_it_and_numbers_beyond_the_offer_are_brought_into_it() {
        let wide = RadialKernel::new(Kernel::Cubic, Some(7.0)).unwrap();
        assert_eq!(mesh(wide, 8, 3), mesh(cubic(), 8, 3));
        assert_eq!(mesh(cubic(), 0, 0), mesh(cubic(), 3, 1));
        assert_eq!(mesh(cubic(), 99, 2), mesh(cubic(), 64, 2));
    }
}
