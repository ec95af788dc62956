//! Shapes made of triangles: tubes about lines, and arrows.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::{Mesh, MeshArray, MeshError, MeshValues};
use crate::core::Srgb8;

/// Sides of a tube, a shaft, a cone.
const SIDES: u32 = 8;
/// How far a tube may leave its line, in radii of the tube, and its colours those of the line, in steps of 255.
const BESIDE: f64 = 0.4;
const OTHER_COLOUR: f64 = 8.0;
/// Places of a line that one piece of a tube passes, at most.
const MOST_PASSED: usize = 64;
/// Of an arrow's length, its head's; of the head's length, its radius; of that, the shaft's.
const HEAD: f64 = 0.35;
const HEAD_RADIUS: f64 = 0.4;
const SHAFT_RADIUS: f64 = 0.4;

/// What a shape has at a place: a colour, and the number that it stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// The colour.
    pub colour: Srgb8,
    /// The number.
    pub number: f32,
}

/// Shapes one after another, all of one mesh.
#[derive(Debug, Clone, Default)]
pub struct Shapes {
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    colours: Vec<Srgb8>,
    numbers: Vec<f32>,
    triangles: Vec<[u32; 3]>,
}

impl Shapes {
    /// How many triangles there are so far.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// All of them, with their numbers as an array of a name.
    ///
    /// # Errors
    /// None, or one that reaches beyond 32-bit floats.
    pub fn mesh(self, name: impl Into<String>, of: impl Into<String>) -> Result<Mesh, MeshError> {
        let Self { positions, normals, colours, numbers, triangles } = self;
        let numbers = MeshArray { name: of.into(), values: MeshValues::Corners(numbers) };
        Mesh::of_places(name, &positions, normals, colours, triangles)?.with_arrays(vec![numbers])
    }

    fn corner(&mut self, place: DVec3, normal: DVec3, paint: Paint) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(place);
        self.normals.push(normal.as_vec3());
        self.colours.push(paint.colour);
        self.numbers.push(paint.number);
        index
    }

    /// A ring about a place, square to the plane of two directions; its first corner. Normals lean by
    /// `lean` along the ring's axis.
    fn ring(
        &mut self,
        (place, radius): (DVec3, f64),
        (across, beside): (DVec3, DVec3),
        lean: DVec3,
        paint: Paint,
    ) -> u32 {
        let first = self.positions.len() as u32;
        for i in 0..SIDES {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            let out = across * cos + beside * sin;
            self.corner(place + out * radius, (out + lean).normalize_or_zero(), paint);
        }
        first
    }

    /// The sides between two rings.
    fn join(&mut self, a: u32, b: u32) {
        for i in 0..SIDES {
            let next = (i + 1) % SIDES;
            self.triangles.extend([[a + i, a + next, b + i], [b + i, a + next, b + next]]);
        }
    }

    /// The disc of a ring, about its middle.
    fn cap(&mut self, ring: u32, middle: u32) {
        for i in 0..SIDES {
            self.triangles.push([middle, ring + i, ring + (i + 1) % SIDES]);
        }
    }

    /// A tube about a line of places, each with its colour, closed at both ends. Places that follow one
    /// another at no distance are one; fewer than two make no tube. Those that lie as good as straight between others are passed.
    pub fn tube(&mut self, line: &[(DVec3, Paint)], radius: f64) {
        let mut places: Vec<(DVec3, Paint)> = Vec::with_capacity(line.len());
        for &(place, paint) in line {
            if places.last().is_none_or(|(last, _)| (place - *last).length() > 1e-6 * radius) {
                places.push((place, paint));
            }
        }
        let places = bends(&places, radius);
        let count = places.len();
        if count < 2 {
            return;
        }
        let along = |i: usize| {
            let (from, to) = (i.saturating_sub(1), (i + 1).min(count - 1));
            let both = (places[to].0 - places[from].0).normalize_or_zero();
            // Back where it came from: the next piece alone.
            match both == DVec3::ZERO {
                true => (places[to].0 - places[i].0).normalize_or_zero(),
                false => both,
            }
        };
        let mut across = along(0).any_orthonormal_vector();
        let mut last = None;
        for (i, &(place, paint)) in places.iter().enumerate() {
            let ahead = along(i);
            // Carried along without a twist.
            let carried = across - ahead * across.dot(ahead);
            across = carried.try_normalize().unwrap_or_else(|| ahead.any_orthonormal_vector());
            let axes = (across, ahead.cross(across));
            let ring = self.ring((place, radius), axes, DVec3::ZERO, paint);
            match last {
                Some(last) => self.join(last, ring),
                None => {
                    let middle = self.corner(place, -ahead, paint);
                    self.cap(ring, middle);
                }
            }
            if i + 1 == count {
                let middle = self.corner(place, ahead, paint);
                self.cap(ring, middle);
            }
            last = Some(ring);
        }
    }

    /// An arrow from a place: a shaft and a cone. One without length is none.
    pub fn arrow(&mut self, from: DVec3, by: DVec3, paint: Paint) {
        let length = by.length();
        let Some(ahead) = by.try_normalize() else { return };
        let across = ahead.any_orthonormal_vector();
        let axes = (across, ahead.cross(across));
        let head_length = HEAD * length;
        let radius = HEAD_RADIUS * head_length;
        let neck = from + ahead * (length - head_length);
        let shaft = SHAFT_RADIUS * radius;
        let begin = self.ring((from, shaft), axes, DVec3::ZERO, paint);
        let end = self.ring((neck, shaft), axes, DVec3::ZERO, paint);
        self.join(begin, end);
        let middle = self.corner(from, -ahead, paint);
        self.cap(begin, middle);
        // The cone leans back by its slope; its rim has a normal of each side.
        let lean = ahead * HEAD_RADIUS;
        let rim = self.ring((neck, radius), axes, lean, paint);
        let tip = self.ring((from + by, 0.0), axes, lean, paint);
        for i in 0..SIDES {
            self.triangles.push([rim + i, rim + (i + 1) % SIDES, tip + i]);
        }
        let back = self.ring((neck, radius), axes, -ahead * 1e6, paint);
        let middle = self.corner(neck, -ahead, paint);
        self.cap(back, middle);
    }
}

/// The places of a line that a tube needs: both ends, and where the line turns or its colour changes more than evenly.
fn bends(places: &[(DVec3, Paint)], radius: f64) -> Vec<(DVec3, Paint)> {
    let is_passed = |i: usize, from: usize, to: usize| {
        let ((place, paint), (a, first), (b, last)) = (places[i], places[from], places[to]);
        let way = b - a;
        let share = (place - a).dot(way) / way.length_squared();
        let beside = (a + way * share).distance(place);
        let is_even = |channel: usize| {
            let [own, first, last] = [paint, first, last].map(|of| f64::from(of.colour.0[channel]));
            (first + (last - first) * share - own).abs() <= OTHER_COLOUR
        };
        (0.0..=1.0).contains(&share) && beside <= BESIDE * radius && (0..3).all(is_even)
    };
    let mut kept: Vec<(DVec3, Paint)> = places.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < places.len() {
        let farthest = (from + MOST_PASSED).min(places.len() - 1);
        let is_straight = |to: &usize| (from + 1..*to).all(|i| is_passed(i, from, *to));
        from = (from + 2..=farthest).take_while(is_straight).last().unwrap_or(from + 1);
        kept.push(places[from]);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Paint = Paint { colour: Srgb8::WHITE, number: 0.0 };

    /// Twice the area of all triangles, and six times the volume that they enclose.
    fn measures(mesh: &Mesh) -> (f64, f64) {
        mesh.triangles(false).fold((0.0, 0.0), |(area, volume), t| {
            let [a, b, c] = t.corners.map(|p| p.as_dvec3());
            (area + (b - a).cross(c - a).length(), volume + a.dot(b.cross(c)).abs())
        })
    }

    #[test]
    fn a_straight_tube_is_a_closed_prism_whose_normals_point_outwards() {
        let line = [0.0, 1.0, 1.0, 3.0].map(|x| (DVec3::new(x, 0.5, 0.0), WHITE));
        let mut shapes = Shapes::default();
        shapes.tube(&line, 0.2);
        let mesh = shapes.mesh("tube", "speed").unwrap();
        // Two places at no distance are one, and on a straight line.
        assert_eq!(mesh.len(), 16 + 2 * 8);
        assert_eq!(mesh.degenerate(), 0);
        let side = 2.0 * 0.2 * (std::f64::consts::PI / 8.0).sin();
        let disc = 8.0 * 0.5 * side * 0.2 * (std::f64::consts::PI / 8.0).cos();
        let (area, _) = measures(&mesh);
        assert!((area / 2.0 - (8.0 * side * 3.0 + 2.0 * disc)).abs() < 1e-5, "{area}");
        for t in mesh.triangles(true) {
            for (corner, normal) in t.corners.into_iter().zip(t.normals) {
                let out = corner - Vec3::new(corner.x, 0.5, 0.0);
                assert!(out.length() < 1e-6 || normal.dot(out) >= -1e-6, "{corner} {normal}");
            }
        }
    }

    #[test]
    fn places_of_a_line_are_passed_where_it_is_straight_and_grows_evenly_in_colour() {
        let circle = |i: usize| {
            let (sin, cos) = (i as f64 * TAU / 400.0).sin_cos();
            DVec3::new(cos, sin, 0.0)
        };
        let line: Vec<_> = (0..=400).map(|i| (circle(i), WHITE)).collect();
        let kept = bends(&line, 0.05);
        assert!((12..30).contains(&kept.len()), "{}", kept.len());
        assert_eq!([kept[0], kept[kept.len() - 1]], [line[0], line[400]]);
        for (place, _) in &line {
            let near = kept.windows(2).map(|ends| {
                let (a, way) = (ends[0].0, ends[1].0 - ends[0].0);
                let share = ((*place - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                (a + way * share).distance(*place)
            });
            assert!(near.fold(f64::INFINITY, f64::min) <= BESIDE * 0.05 * (1.0 + 1e-9));
        }
        let grown = |colour: fn(usize) -> u8| {
            let at = |i: usize| {
                (DVec3::X * i as f64, Paint { colour: Srgb8([colour(i); 3]), number: 0.0 })
            };
            bends(&(0..50).map(at).collect::<Vec<_>>(), 0.1).len()
        };
        assert_eq!(grown(|i| 5 * i as u8), 2);
        assert_eq!(grown(|i| if i == 20 { 30 } else { 0 }), 5, "a spot has both of its neighbours");
        // Back where it came from.
        let back: Vec<_> = [0.0, 2.0, 1.0].map(|x| (DVec3::X * x, WHITE)).to_vec();
        assert_eq!(bends(&back, 0.1).len(), 3);
    }

    #[test]
    fn a_tube_round_a_corner_keeps_its_width() {
        let line: Vec<_> = (0..60)
            .map(|i| {
                let angle = f64::from(i) * 0.1;
                (DVec3::new(angle.cos(), angle.sin(), 0.1 * angle), WHITE)
            })
            .collect();
        let mut shapes = Shapes::default();
        shapes.tube(&line, 0.05);
        let mesh = shapes.mesh("helix", "speed").unwrap();
        for t in mesh.triangles(true) {
            for corner in t.corners {
                let place = corner.as_dvec3();
                let near = line.iter().map(|(p, _)| (*p - place).length());
                let near = near.fold(f64::INFINITY, f64::min);
                assert!(near < 0.0501, "{near}");
            }
        }
    }

    #[test]
    fn arrows_reach_from_a_place_by_their_vector_and_none_is_none() {
        let mut shapes = Shapes::default();
        shapes.arrow(DVec3::ZERO, DVec3::ZERO, WHITE);
        assert!(shapes.is_empty());
        shapes.arrow(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.0, 2.0), WHITE);
        assert!(shapes.mesh("one place", "speed").is_ok_and(|mesh| {
            let [low, high] = mesh.bounds();
            (low.z, high.z) == (3.0, 5.0) && (high.x - low.x - 2.0 * 0.28).abs() < 1e-6
        }));
        let mut line = Shapes::default();
        line.tube(&[(DVec3::ZERO, WHITE)], 1.0);
        assert_eq!(line.mesh("one place", "speed"), Err(MeshError::Empty));
    }
}
