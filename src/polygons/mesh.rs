//! Triangles that share their corners.

use glam::{DVec3, Vec3};

use super::doubles::are_first;
use super::shorten;
use super::soft::{MOST_SOFTENED, soft_normals};
use crate::core::{Srgb8, plain_numbers};

/// Triangles in world space. Positions are finite and every index is that of a position: only
/// [`Mesh::new`] makes one. Triangles without area are there, and drawn by nobody.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    name: String,
    /// What positions are counted from, world: coordinates far from 0 keep their digits.
    origin: DVec3,
    positions: Vec<Vec3>,
    /// As long as `positions` or empty; not of length 1, and perhaps zero.
    normals: Vec<Vec3>,
    /// As long as `positions` or empty.
    colours: Vec<Srgb8>,
    triangles: Vec<[u32; 3]>,
    arrays: Vec<MeshArray>,
    /// As long as `triangles` or empty.
    triangle_colours: Vec<Srgb8>,
    /// At the corners of each triangle where corners have none of their own: as long as `triangles` or empty.
    soft_normals: Vec<[Vec3; 3]>,
    /// What is framed at first, world; `None` where it is all.
    frame: Option<[DVec3; 2]>,
    /// It is bodies about points: those that an array has no number of are not there where that colours them.
    is_of_points: bool,
}

/// Numbers on a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshArray {
    /// What it is called.
    pub name: String,
    /// NaN where there is none.
    pub values: MeshValues,
}

/// What the numbers of a [`MeshArray`] stand on.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshValues {
    /// One a corner.
    Corners(Vec<f32>),
    /// One a triangle.
    Triangles(Vec<f32>),
}

impl MeshValues {
    fn all(&self) -> &[f32] {
        match self {
            Self::Corners(values) | Self::Triangles(values) => values,
        }
    }
}

impl MeshArray {
    /// Least and greatest finite number; `None` without any.
    pub fn range(&self) -> Option<[f64; 2]> {
        let finite = self.values.all().iter().map(|v| f64::from(*v)).filter(|v| v.is_finite());
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = finite.fold(none, |[a, b], v| [a.min(v), b.max(v)]);
        (low <= high).then_some([low, high])
    }
}

/// Of positions that are so many times farther from 0 than they extend, single precision keeps 18 bits or fewer of that.
const FAR: f64 = 64.0;

/// What is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// Nothing to draw.
    #[error("expected at least one triangle, found none; give a mesh with faces")]
    Empty,
    /// A place that is nowhere.
    #[error(
        "expected finite positions, found {} at corner {corner}; write the file again",
        plain_numbers(found.to_array())
    )]
    NotFinite {
        /// Which, from 0.
        corner: usize,
        /// Its position.
        found: Vec3,
    },
    /// A corner that is not there.
    #[error(
        "expected corners numbered below {corners}, found {found} in triangle {triangle}; write the \
         file again"
    )]
    Index {
        /// Which triangle, from 0.
        triangle: usize,
        /// What it names.
        found: u32,
        /// How many corners there are.
        corners: usize,
    },
    /// Some corners have what others lack.
    #[error(
        "expected {what} of all {corners} corners or of none, found {found}; write the file again"
    )]
    Uneven {
        /// Normals or colours.
        what: &'static str,
        /// How many corners there are.
        corners: usize,
        /// How many have it.
        found: usize,
    },
}

/// A triangle, its corners in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Offsets from the mesh's origin, world.
    pub corners: [Vec3; 3],
    /// Unit normals at the corners.
    pub normals: [Vec3; 3],
    /// The corners' own colours.
    pub colours: Option<[Srgb8; 3]>,
}

impl Mesh {
    /// A mesh of positions, of normals and colours as many or none, and of triangles: three indices of
    /// positions each.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn new(
        name: impl Into<String>,
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        colours: Vec<Srgb8>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        let corners = positions.len();
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(corner) = positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { corner, found: positions[corner] });
        }
        for (what, found) in [("normals", normals.len()), ("colours", colours.len())] {
            if found != 0 && found != corners {
                return Err(MeshError::Uneven { what, corners, found });
            }
        }
        for (triangle, indices) in triangles.iter().enumerate() {
            if let Some(&found) = indices.iter().find(|&&i| i as usize >= corners) {
                return Err(MeshError::Index { triangle, found, corners });
            }
        }
        let normals = normals.into_iter().map(sound).collect();
        let origin = DVec3::ZERO;
        let (name, arrays) = (name.into(), Vec::new());
        let (triangle_colours, soft_normals) = (Vec::new(), Vec::new());
        Ok(Self {
            name,
            origin,
            positions,
            normals,
            colours,
            triangles,
            arrays,
            triangle_colours,
            soft_normals,
            frame: None,
            is_of_points: false,
        })
    }

    /// The same of which nothing outside a box, low and high corner, world, is looked at to frame it. What lies there is drawn
    /// all the same.
    #[must_use]
    pub fn framed_by(self, frame: Option<[DVec3; 2]>) -> Self {
        Self { frame, ..self }
    }

    /// The same as bodies about points.
    #[must_use]
    pub fn of_points(self) -> Self {
        Self { is_of_points: true, ..self }
    }

    /// Whether it is bodies about points, of which those without a number are not drawn where numbers colour them.
    pub fn is_of_points(&self) -> bool {
        self.is_of_points
    }

    /// The places, world, that are to be in the picture where it is framed.
    pub fn framed_places(&self) -> impl Iterator<Item = DVec3> + '_ {
        let is_framed =
            |place: &DVec3| self.frame.is_none_or(|[low, high]| place.clamp(low, high) == *place);
        let place = |corner: u32| self.origin + self.positions[corner as usize].as_dvec3();
        self.triangles.as_flattened().iter().map(move |corner| place(*corner)).filter(is_framed)
    }

    /// The same with numbers on it.
    ///
    /// # Errors
    /// An array that is longer or shorter than what it stands on.
    pub fn with_arrays(self, arrays: Vec<MeshArray>) -> Result<Self, MeshError> {
        for MeshArray { values, .. } in &arrays {
            let (what, corners) = match values {
                MeshValues::Corners(_) => ("numbers", self.positions.len()),
                MeshValues::Triangles(_) => ("numbers of triangles", self.triangles.len()),
            };
            let found = values.all().len();
            if found != corners {
                return Err(MeshError::Uneven { what, corners, found });
            }
        }
        Ok(Self { arrays, ..self })
    }

    /// The same with a colour for each triangle, in place of the corners'.
    ///
    /// # Errors
    /// More or fewer of them than triangles.
    pub fn with_triangle_colours(self, triangle_colours: Vec<Srgb8>) -> Result<Self, MeshError> {
        let (corners, found) = (self.triangles.len(), triangle_colours.len());
        match found == corners {
            true => Ok(Self { triangle_colours, ..self }),
            false => Err(MeshError::Uneven { what: "colours of triangles", corners, found }),
        }
    }

    /// The same with normals that are smooth where triangles meet at a blunt edge, of a mesh without any: at each corner the
    /// mean of those about its place that are turned by less than [`SOFT_DEGREES`](super::SOFT_DEGREES), by area. Meshes of
    /// millions of triangles stay flat.
    #[must_use]
    pub fn softened(self) -> Self {
        if self.has_normals() || self.len() > MOST_SOFTENED {
            return self;
        }
        let flat: Vec<Vec3> = self.triangles.iter().map(|t| self.flat_normal(*t)).collect();
        let soft_normals = soft_normals(&self.positions, &self.triangles, &flat);
        Self { soft_normals, ..self }
    }

    /// Whether it is smooth at first.
    pub fn is_smooth(&self) -> bool {
        self.has_normals() || !self.soft_normals.is_empty()
    }

    /// The same without the triangles that lie exactly on others, of which the first stays; and how many these were. Nobody
    /// sees them but by the time that they take.
    pub fn without_doubles(self) -> (Self, usize) {
        let is_first = are_first(&self.positions, &self.triangles);
        let doubles = is_first.iter().filter(|is_first| !**is_first).count();
        if doubles == 0 {
            return (self, 0);
        }
        let firsts = || is_first.iter().copied();
        let kept = |array: MeshArray| {
            let values = match array.values {
                MeshValues::Triangles(values) => MeshValues::Triangles(
                    values
                        .into_iter()
                        .zip(firsts())
                        .filter_map(|(v, first)| first.then_some(v))
                        .collect(),
                ),
                corners => corners,
            };
            MeshArray { values, ..array }
        };
        let triangles = self.triangles.iter().zip(firsts());
        let triangles = triangles.filter_map(|(t, first)| first.then_some(*t)).collect();
        let arrays = self.arrays.into_iter().map(kept).collect();
        let colours = self.triangle_colours.iter().zip(firsts());
        let triangle_colours = colours.filter_map(|(c, first)| first.then_some(*c)).collect();
        let normals = self.soft_normals.iter().zip(firsts());
        let soft_normals = normals.filter_map(|(n, first)| first.then_some(*n)).collect();
        (Self { triangles, arrays, triangle_colours, soft_normals, ..self }, doubles)
    }

    /// The same surface with all edges halved until none is long, lit as it was; numbers and colours on it are left out. An
    /// edge is judged by its ends alone, world, so that triangles on both sides of it stay joined. `None` where there would be
    /// more triangles than `most`, unless there are already.
    pub fn with_short_edges(
        &self,
        is_long: impl Fn([DVec3; 2]) -> bool,
        most: usize,
    ) -> Option<Self> {
        let world = |place: Vec3| self.origin + place.as_dvec3();
        let lit = |(numbers, triangle): (&[u32; 3], Triangle)| -> [(u32, Vec3); 3] {
            std::array::from_fn(|i| (numbers[i], triangle.normals[i]))
        };
        let triangles = self.triangles.iter().zip(self.triangles(true)).map(lit).collect();
        let (positions, triangles) = shorten::with_short_edges(
            self.positions.clone(),
            triangles,
            |ends| is_long(ends.map(world)),
            most.max(self.len()),
        )?;
        Some(Self {
            name: self.name.clone(),
            origin: self.origin,
            positions,
            normals: Vec::new(),
            colours: Vec::new(),
            soft_normals: triangles.iter().map(|t| t.map(|(_, normal)| normal)).collect(),
            triangles: triangles.iter().map(|t| t.map(|(number, _)| number)).collect(),
            arrays: Vec::new(),
            triangle_colours: Vec::new(),
            frame: self.frame,
            is_of_points: self.is_of_points,
        })
    }

    /// Where its corners are, world.
    pub fn places(&self) -> Vec<DVec3> {
        self.positions.iter().map(|place| self.origin + place.as_dvec3()).collect()
    }

    /// Places all over it, world: along the longest edge of each triangle, about as far apart as an eighth of the longest of all.
    /// Of long triangles, as along a straight tube, the corners alone would say little.
    pub fn spread_places(&self) -> Vec<DVec3> {
        const ALONG_LONGEST: f64 = 8.0;
        let longest = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
            let edges = [(a, b), (b, c), (c, a)].map(|(a, b)| (a.distance(b), a, b));
            edges.into_iter().fold(edges[0], |most, edge| if edge.0 > most.0 { edge } else { most })
        };
        let most = self.triangles.iter().map(|t| longest(t).0).fold(0.0, f64::max);
        let along = self.triangles.iter().map(longest).flat_map(|(length, a, b)| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=8")]
            let count = (ALONG_LONGEST * length / most).ceil().max(1.0) as u32;
            let share = move |i: u32| (f64::from(i) + 0.5) / f64::from(count);
            (0..count).map(move |i| self.origin + a.lerp(b, share(i)))
        });
        along.collect()
    }

    /// Numbers on it.
    pub fn arrays(&self) -> &[MeshArray] {
        &self.arrays
    }

    /// Whether numbers of this name are on it.
    pub fn has_array(&self, name: &str) -> bool {
        self.arrays.iter().any(|array| array.name == name)
    }

    /// The numbers of an array at the corners of each triangle, in the order of [`Mesh::triangles`]; NaN where there is no
    /// such array.
    pub fn values(&self, array: usize) -> impl Iterator<Item = [f32; 3]> + '_ {
        let array = self.arrays.get(array).map(|array| &array.values);
        self.triangles.iter().enumerate().map(move |(triangle, corners)| match array {
            Some(MeshValues::Corners(values)) => corners.map(|i| values[i as usize]),
            Some(MeshValues::Triangles(values)) => [values[triangle]; 3],
            None => [f32::NAN; 3],
        })
    }

    /// The same of positions in double precision: those that lie far from 0 for their extent are counted from their middle.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn of_places(
        name: impl Into<String>,
        places: &[DVec3],
        normals: Vec<Vec3>,
        colours: Vec<Srgb8>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, MeshError> {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = places.iter().fold(none, |[low, high], p| [low.min(*p), high.max(*p)]);
        let farthest = low.abs().max(high.abs()).max_element();
        let is_far = farthest > FAR * (high - low).max_element();
        let origin = if is_far && farthest.is_finite() { (low + high) / 2.0 } else { DVec3::ZERO };
        let positions = places.iter().map(|place| (*place - origin).as_vec3()).collect();
        Ok(Self { origin, ..Self::new(name, positions, normals, colours, triangles)? })
    }

    /// What corners are counted from, world.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How many triangles there are, at least 1.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Never.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Whether corners have normals of their own.
    pub fn has_normals(&self) -> bool {
        !self.normals.is_empty()
    }

    /// Whether corners or triangles have colours of their own.
    pub fn has_colours(&self) -> bool {
        !self.colours.is_empty() || !self.triangle_colours.is_empty()
    }

    /// Triangles without area.
    pub fn degenerate(&self) -> usize {
        self.triangles.iter().filter(|t| self.flat_normal(**t) == Vec3::ZERO).count()
    }

    /// Least and greatest coordinates of the corners, world.
    pub fn bounds(&self) -> [DVec3; 2] {
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let wider = |[low, high]: [Vec3; 2], p: &Vec3| [low.min(*p), high.max(*p)];
        self.positions.iter().fold(none, wider).map(|corner| self.origin + corner.as_dvec3())
    }

    fn flat_normal(&self, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
        // In double precision, in which no product of these underflows or overflows.
        (b - a).cross(c - a).normalize_or_zero().as_vec3()
    }

    /// Unit normals of all corners: their own, or where they have none means of the triangles about
    /// them, by area. Zero where those cancel out.
    fn smooth_normals(&self) -> Vec<Vec3> {
        if self.has_normals() {
            return self.normals.clone();
        }
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
            let area = (b - a).cross(c - a);
            triangle.iter().for_each(|&i| sums[i as usize] += area);
        }
        sums.into_iter().map(|sum| sum.normalize_or_zero().as_vec3()).collect()
    }

    /// Every triangle, with the corners' normals where it is to be smooth, and its own else and where
    /// those are zero.
    pub fn triangles(&self, is_smooth: bool) -> impl Iterator<Item = Triangle> + '_ {
        let is_soft = is_smooth && !self.soft_normals.is_empty();
        let normals = if is_smooth && !is_soft { self.smooth_normals() } else { Vec::new() };
        self.triangles.iter().enumerate().map(move |(at, &indices)| {
            let flat = self.flat_normal(indices);
            let soft = self.soft_normals.get(at).filter(|_| is_soft);
            let normal = |i: u32| match normals.get(i as usize) {
                Some(&normal) if normal != Vec3::ZERO => normal,
                _ => flat,
            };
            Triangle {
                corners: indices.map(|i| self.positions[i as usize]),
                normals: soft.copied().unwrap_or_else(|| indices.map(normal)),
                colours: match self.triangle_colours.get(at) {
                    Some(own) => Some([*own; 3]),
                    None if self.colours.is_empty() => None,
                    None => Some(indices.map(|i| self.colours[i as usize])),
                },
            }
        })
    }
}

/// A unit normal, or zero for what is none.
fn sound(normal: Vec3) -> Vec3 {
    let normal = normal.as_dvec3().normalize_or_zero().as_vec3();
    if normal.is_finite() { normal } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<Vec3> {
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]
    }

    fn mesh(triangles: Vec<[u32; 3]>) -> Result<Mesh, MeshError> {
        Mesh::new("test", corners(), Vec::new(), Vec::new(), triangles)
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_what_was_found() {
        assert_eq!(mesh(vec![]), Err(MeshError::Empty));
        let refused = mesh(vec![[0, 1, 2], [1, 4, 2]]);
        assert_eq!(refused, Err(MeshError::Index { triangle: 1, found: 4, corners: 4 }));
        let mut positions = corners();
        positions[2].y = f32::NAN;
        let refused = Mesh::new("", positions, Vec::new(), Vec::new(), vec![[0, 1, 3]]);
        assert!(matches!(refused, Err(MeshError::NotFinite { corner: 2, .. })), "{refused:?}");
        let refused = Mesh::new("", corners(), vec![Vec3::X], Vec::new(), vec![[0, 1, 3]]);
        assert!(refused.unwrap_err().to_string().contains("normals of all 4 corners"));
    }

    #[test]
    fn numbers_stand_on_corners_or_triangles_and_are_as_many() {
        let array = |values| vec![MeshArray { name: "T".into(), values }];
        let two = || mesh(vec![[0, 1, 2], [3, 1, 0]]).unwrap();
        let corners = two().with_arrays(array(MeshValues::Corners(vec![1.0, 2.0, f32::NAN, 8.0])));
        let corners = corners.unwrap();
        let found: Vec<[f32; 3]> = corners.values(0).collect();
        assert_eq!((found[0][..2].to_vec(), found[1]), (vec![1.0, 2.0], [8.0, 2.0, 1.0]));
        assert!(found[0][2].is_nan() && corners.values(1).flatten().all(f32::is_nan));
        assert_eq!(corners.arrays()[0].range(), Some([1.0, 8.0]));
        let own = two().with_arrays(array(MeshValues::Triangles(vec![5.0, 7.0]))).unwrap();
        assert_eq!(own.values(0).collect::<Vec<_>>(), [[5.0; 3], [7.0; 3]]);
        for wrong in [MeshValues::Corners(vec![1.0; 3]), MeshValues::Triangles(vec![1.0; 4])] {
            let refused = two().with_arrays(array(wrong)).unwrap_err().to_string();
            assert!(refused.contains("numbers"), "{refused}");
        }
        let none = array(MeshValues::Triangles(vec![f32::NAN, f32::INFINITY]));
        assert_eq!(two().with_arrays(none).unwrap().arrays()[0].range(), None);
    }

    #[test]
    fn of_triangles_that_lie_on_one_another_the_first_stays() {
        let mut positions = corners();
        // Another number of the place of corner 0.
        positions.push(-Vec3::ZERO);
        let triangles = vec![[0, 1, 2], [0, 1, 3], [2, 4, 1], [1, 2, 0], [1, 2, 3]];
        let mesh = Mesh::new("", positions, Vec::new(), Vec::new(), triangles).unwrap();
        let values = MeshValues::Triangles(vec![0.0, 1.0, 2.0, 3.0, 4.0]);
        let mesh = mesh.with_arrays(vec![MeshArray { name: "T".into(), values }]).unwrap();
        let (mesh, doubles) = mesh.without_doubles();
        assert_eq!((mesh.len(), doubles), (3, 2));
        let left: Vec<f32> = mesh.values(0).map(|values| values[0]).collect();
        assert_eq!(left, [0.0, 1.0, 4.0]);
        let again = mesh.clone().without_doubles();
        assert_eq!(again, (mesh, 0));
    }

    #[test]
    fn flat_normals_are_the_triangles_and_smooth_ones_their_means() {
        let mesh = mesh(vec![[0, 1, 2], [0, 3, 1]]).unwrap();
        let flat: Vec<_> = mesh.triangles(false).map(|t| t.normals).collect();
        assert_eq!(flat, [[Vec3::Z; 3], [Vec3::Y; 3]]);
        let smooth: Vec<_> = mesh.triangles(true).map(|t| t.normals).collect();
        let both = (Vec3::Y + Vec3::Z).normalize();
        let near = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
        // The two share corners 0 and 1, and 2 and 3 are of one alone.
        assert!(near(smooth[0][0], both) && near(smooth[1][2], both), "{smooth:?}");
        assert!(near(smooth[0][2], Vec3::Z) && near(smooth[1][1], Vec3::Y), "{smooth:?}");
    }

    #[test]
    fn triangles_without_area_are_counted_and_tiny_ones_have_a_normal() {
        let tiny = |p: &Vec3| *p * 1e-30;
        let positions: Vec<Vec3> = corners().iter().map(tiny).collect();
        let triangles = vec![[0, 1, 2], [0, 1, 1], [2, 2, 2]];
        let mesh = Mesh::new("", positions, Vec::new(), Vec::new(), triangles).unwrap();
        assert_eq!(mesh.degenerate(), 2);
        assert_eq!(mesh.triangles(false).next().unwrap().normals[0], Vec3::Z);
        assert_eq!(mesh.bounds(), [DVec3::ZERO, Vec3::splat(1e-30).as_dvec3()]);
    }

    #[test]
    fn own_normals_are_made_unit_and_those_that_are_none_give_way() {
        let normals = vec![Vec3::Z * 5.0, Vec3::ZERO, Vec3::splat(f32::NAN), -Vec3::Z];
        let mesh = Mesh::new("", corners(), normals, Vec::new(), vec![[0, 1, 2]]).unwrap();
        assert_eq!(mesh.triangles(true).next().unwrap().normals, [Vec3::Z; 3]);
        assert!(mesh.has_normals() && !mesh.has_colours());
    }

    #[test]
    fn places_are_spread_along_what_is_long() {
        // A strip of two long triangles, and a small one beside it.
        let corners =
            [[0.0, 0.0], [8.0, 0.0], [0.0, 0.1], [8.0, 0.1], [9.0, 0.0], [9.0, 0.5], [9.2, 0.0]];
        let corners = corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let triangles = vec![[0, 1, 2], [2, 1, 3], [4, 5, 6]];
        let mesh = Mesh::new("m", corners, Vec::new(), Vec::new(), triangles).expect("a mesh");
        let places = mesh.spread_places();
        assert_eq!(places.len(), 17);
        assert!(places[..16].iter().all(|at| at.x > 0.3 && at.x < 7.7), "{places:?}");
        assert!((places[16].y - 0.25).abs() < 1e-6 && (places[16].x - 9.1).abs() < 1e-6);
    }

    #[test]
    fn places_far_from_0_keep_their_digits_and_others_are_as_they_were() {
        let far = DVec3::new(1e7, -2e7, 3e7);
        let places = |about: DVec3| {
            corners().iter().map(|p| about + p.as_dvec3() * 1e-3).collect::<Vec<_>>()
        };
        let of = |places: &[DVec3]| {
            Mesh::of_places("", places, Vec::new(), Vec::new(), vec![[0, 1, 2], [0, 2, 3]]).unwrap()
        };
        let mesh = of(&places(far));
        assert!((mesh.origin() - far).length() < 1e-2);
        for (triangle, expected) in mesh.triangles(false).zip([[0, 1, 2], [0, 2, 3]]) {
            for (corner, i) in triangle.corners.iter().zip(expected) {
                let found = mesh.origin() + corner.as_dvec3();
                assert!((found - places(far)[i]).length() < 1e-8, "{found}");
            }
        }
        let [low, high] = mesh.bounds();
        assert!(((high - low) - 1e-3).length() < 1e-8, "{low} {high}");
        assert_eq!(of(&places(DVec3::ZERO)).origin(), DVec3::ZERO);
    }
}
