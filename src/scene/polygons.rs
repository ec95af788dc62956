//! Polygons in a scene, embedded in the volume.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Look, Sampled, Scene};
use crate::core::{Srgb8, plain_number};
use crate::polygons::{Mesh, Triangle, between_levels};
use crate::transfer::{ColourMap, ColourSource, colour_of_label};

/// What polygons look like that say nothing of it.
pub const POLYGON_COLOUR: Srgb8 = Srgb8([225, 225, 225]);

/// Levels between the ends of colours. What engines mix between two is within 0.015 of any map's linear light, of 1; with half as many
/// it was off by 0.024.
const LEVELS: usize = 64;
/// Triangles that are cut for their colours are no more than so many with their parts.
const MOST_PARTS: usize = 1 << 18;

/// What to say of surfaces that a volume does not reach ([`Scene::may_reach`]).
pub const BESIDE: &str =
    "these surfaces lie beside the volume, whose world may have another origin or unit";

/// What polygons look like: lit from both sides, before and behind matter, vectors and other polygons.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PolygonLook {
    /// Of all of them; `None` is the corners' own colours, and [`POLYGON_COLOUR`] where they have none.
    pub colour: Option<Srgb8>,
    /// By numbers on the mesh, in place of other colours.
    #[serde(default)]
    pub by: Option<ByArray>,
    /// By the values of the field that it lies in, in the field's own colours, in place of others: [`POLYGON_COLOUR`] at corners
    /// where the field has none.
    #[serde(default)]
    pub by_field: bool,
    /// 0..=1, of each triangle, however it is turned.
    pub opacity: f64,
    /// Whether it is lit by the corners' normals (means of the triangles' about them where they have none),
    /// rather than each triangle by its own.
    pub is_smooth: bool,
}

/// Colours of the numbers on a mesh: at a place those of its number, which is linear between the corners.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ByArray {
    /// Which of the mesh's arrays.
    pub array: usize,
    /// Which colours.
    pub map: ColourMap,
    /// The numbers that take its first and its last colour.
    pub range: [f64; 2],
}

impl ByArray {
    /// The colours that nobody has chosen yet: neither end is dark on a dark ground, nor in the shade of a light.
    pub const FIRST_MAP: ColourMap = ColourMap::CoolWarm;
}

/// A mesh at its place in the world.
#[derive(Debug, Clone)]
pub struct PolygonLayer {
    /// The triangles.
    pub mesh: Arc<Mesh>,
    /// What they look like.
    pub look: PolygonLook,
    /// The colours of the numbers of the mesh's first array, in place of others, where these are values of the scene's field.
    pub field_colours: Option<ColourSource>,
}

/// What cannot be drawn of polygons.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// An opacity that is none.
    #[error("expected the opacity of a mesh from 0 to 1, found {}", plain_number(*found))]
    Opacity {
        /// The offending number.
        found: f64,
    },
}

impl Scene {
    /// Whether the sphere about a box, low and high corner, world, meets that about the volume.
    pub fn may_reach(&self, [low, high]: [DVec3; 2]) -> bool {
        let lattice = self.lattice();
        let between = ((low + high) / 2.0 - lattice.centre()).length();
        between <= (high - low).length() / 2.0 + lattice.bounding_radius()
    }
}

impl PolygonLook {
    /// # Errors
    /// An opacity that is none.
    pub fn check(&self) -> Result<(), PolygonError> {
        match (0.0..=1.0).contains(&self.opacity) {
            true => Ok(()),
            false => Err(PolygonError::Opacity { found: self.opacity }),
        }
    }
}

impl PolygonLayer {
    /// A mesh as it is first seen: opaque, in its own colours, smooth where its edges are blunt or its normals say so.
    pub fn new(mesh: Arc<Mesh>) -> Self {
        let is_smooth = mesh.is_smooth();
        let look = PolygonLook { colour: None, by: None, by_field: false, opacity: 1.0, is_smooth };
        Self { mesh, look, field_colours: None }
    }

    /// A surface as it is first seen that is all there is of its file: by the numbers of this name, over a range or all of
    /// theirs, else in its own colours.
    pub fn of_surface(
        mesh: Arc<Mesh>,
        name: Option<&str>,
        map: ColourMap,
        range: Option<[f64; 2]>,
    ) -> Self {
        let array = mesh.arrays().iter().position(|array| Some(&*array.name) == name);
        let own = array.and_then(|at| Some((at, mesh.arrays()[at].range()?)));
        let by = own.map(|(array, own)| ByArray { array, map, range: range.unwrap_or(own) });
        let layer = Self::new(mesh);
        Self { look: PolygonLook { by, ..layer.look }, ..layer }
    }

    /// Shapes of vectors as they are first seen: in a map's colours by the lengths that are their first numbers, which have a bar
    /// then; in their own colours where these are no map's.
    pub fn of_vectors(mesh: Arc<Mesh>, colours: &ColourSource) -> Self {
        let layer = Self::new(mesh);
        let by = match *colours {
            ColourSource::Map { map, range } => Some(ByArray { array: 0, map, range }),
            ColourSource::Stops(_) => None,
        };
        Self { look: PolygonLook { by, ..layer.look }, ..layer }
    }

    /// Which of the mesh's arrays colours it.
    pub fn array(&self) -> Option<usize> {
        match self.field_colours {
            Some(_) => Some(0),
            None => self.look.by.map(|by| by.array),
        }
    }

    /// Every triangle, with normals and colours as it looks; none of bodies about points without the number that colours others.
    ///
    /// Engines mix the colours of corners, and the middle of two colours is seldom the colour of the middle number. So triangles
    /// that numbers colour are cut at levels of these, close enough for colours to be as good as straight between two.
    pub fn triangles(&self) -> impl Iterator<Item = (Triangle, [Srgb8; 3])> + '_ {
        let PolygonLook { colour, by, is_smooth, .. } = self.look;
        let colours = self.colours();
        let levels = colours.as_ref().map(|colours| self.levels(colours)).unwrap_or_default();
        let values = self.mesh.values(self.array().unwrap_or(usize::MAX));
        let has_holes = self.mesh.is_of_points() && self.field_colours.is_none() && by.is_some();
        let is_there = move |values: &[f32; 3]| !has_holes || values.iter().any(|v| !v.is_nan());
        let there = self.mesh.triangles(is_smooth).zip(values);
        let there = there.filter(move |(_, values)| is_there(values));
        let parts = there.flat_map(move |whole| {
            let (first, rest) = between_levels(whole, &levels);
            std::iter::once(first).chain(rest)
        });
        parts.map(move |(triangle, values)| {
            let colours = match (&colours, colour, triangle.colours) {
                (Some(colours), ..) => values.map(|value| match value.is_nan() {
                    true => POLYGON_COLOUR,
                    false => colours.srgb_at(f64::from(value)),
                }),
                (None, Some(colour), _) => [colour; 3],
                (None, None, Some(own)) => own,
                (None, None, None) => [POLYGON_COLOUR; 3],
            };
            (triangle, colours)
        })
    }

    /// The colours of its numbers, where these colour it.
    pub fn colours(&self) -> Option<ColourSource> {
        let by = || self.look.by.map(|ByArray { map, range, .. }| ColourSource::Map { map, range });
        self.field_colours.clone().or_else(by)
    }

    /// The numbers, rising, at which triangles are cut: the stops of the colours and levels evenly between their ends, so many
    /// that the parts of all are no more than a mesh of many triangles has, which are small.
    fn levels(&self, colours: &ColourSource) -> Vec<f32> {
        let [a, b] = colours.range();
        let (low, high) = (a.min(b), a.max(b));
        let step = (high - low) / LEVELS as f64;
        let room = MOST_PARTS.saturating_sub(self.mesh.len()) as f64;
        if !(step > 0.0 && step.is_finite() && room > 0.0) {
            return Vec::new();
        }
        // How many levels triangles pass, in all.
        let passed = |values: [f32; 3]| {
            let within = values.map(|value| f64::from(value).clamp(low, high));
            let [least, most] =
                [f64::min, f64::max].map(|end| within.into_iter().fold(within[0], end));
            // Of what has no number, none.
            if most > least { (most - least) / step } else { 0.0 }
        };
        let array = self.array().unwrap_or(usize::MAX);
        let passed: f64 = self.mesh.values(array).map(passed).sum();
        // Each makes two parts more of its triangle, about.
        let share = if passed > 0.0 { room / (2.0 * passed) } else { 1.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=LEVELS")]
        let count = (LEVELS as f64 * share.min(1.0)) as usize;
        if count < 2 {
            return Vec::new();
        }
        let even = (0..=count).map(|i| low + (high - low) * i as f64 / count as f64);
        let stops = match colours {
            ColourSource::Stops(stops) => &stops[..],
            ColourSource::Map { .. } => &[],
        };
        #[expect(clippy::cast_possible_truncation, reason = "numbers of meshes have 32 bits")]
        let mut levels: Vec<f32> =
            even.chain(stops.iter().map(|(value, _)| *value)).map(|level| level as f32).collect();
        levels.sort_unstable_by(f32::total_cmp);
        levels.dedup();
        levels
    }

    /// The surface of a label as it is first seen: in the file's colour, or that of its number among the others.
    pub fn of_label(mesh: Arc<Mesh>, number: usize, colour: Option<Srgb8>) -> Self {
        let colour = Some(colour.unwrap_or_else(|| colour_of_label(number)));
        let look = PolygonLook { colour, by: None, by_field: false, opacity: 1.0, is_smooth: true };
        Self { mesh, look, field_colours: None }
    }
}

impl PartialEq for PolygonLayer {
    /// The same mesh, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
            && self.look == other.look
            && self.field_colours == other.field_colours
    }
}

impl From<PolygonLayer> for (Sampled, Look) {
    fn from(PolygonLayer { mesh, look, .. }: PolygonLayer) -> Self {
        (Sampled::Mesh(mesh), Look::Polygons(look))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::polygons::{MeshArray, MeshValues};

    fn mesh(colours: Vec<Srgb8>) -> Arc<Mesh> {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh::new("m", corners, Vec::new(), colours, vec![[0, 1, 2]]).unwrap();
        let array = |name: &str, values: Vec<f32>| MeshArray {
            name: name.into(),
            values: MeshValues::Corners(values),
        };
        let arrays = vec![array("a", vec![0.0; 3]), array("T", vec![1.0, 3.0, f32::NAN])];
        Arc::new(mesh.with_arrays(arrays).unwrap())
    }

    fn colours(layer: &PolygonLayer) -> [Srgb8; 3] {
        layer.triangles().next().unwrap().1
    }

    #[test]
    fn numbers_colour_corners_by_the_map_between_the_ends_of_its_range() {
        let (range, gray) = ([1.0, 5.0], ColourMap::Gray);
        let mut layer = PolygonLayer::of_surface(mesh(Vec::new()), Some("T"), gray, Some(range));
        assert_eq!(layer.look.by, Some(ByArray { array: 1, map: gray, range }));
        // Half of the way is half of 255 as encoded.
        assert_eq!(colours(&layer), [Srgb8([0; 3]), Srgb8([128; 3]), POLYGON_COLOUR]);
        layer.look.by = layer.look.by.map(|by| ByArray { range: [3.0, 1.0], ..by });
        assert_eq!(colours(&layer)[..2], [Srgb8([255; 3]), Srgb8([0; 3])]);
        layer.look.by = None;
        assert_eq!(colours(&layer), [POLYGON_COLOUR; 3]);
        // Unless another was asked for, the numbers' own range.
        let by = PolygonLayer::of_surface(mesh(Vec::new()), Some("T"), gray, None).look.by;
        assert_eq!(by.map(|by| by.range), Some([1.0, 3.0]));
    }

    /// Of one large triangle, whose engines mix the colours of corners as light.
    #[test]
    fn the_colour_of_a_place_is_that_of_its_number() {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh::new("m", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
        let values = [-0.5, 1.7, 0.2];
        let array = MeshArray { name: "T".into(), values: MeshValues::Corners(values.to_vec()) };
        let mesh = Arc::new(mesh.with_arrays(vec![array]).unwrap());
        let steps = ColourSource::Stops(vec![
            (0.0, Srgb8([0, 0, 0])),
            (0.41, Srgb8([255, 255, 255])),
            (1.0, Srgb8([0, 0, 255])),
        ]);
        let maps = ColourMap::ALL.map(|map| ColourSource::Map { map, range: [0.0, 1.0] });
        let mut worst = 0.0_f64;
        for colours in maps.into_iter().chain([steps]) {
            let mut layer = PolygonLayer::new(Arc::clone(&mesh));
            layer.field_colours = Some(colours.clone());
            let parts: Vec<_> = layer.triangles().collect();
            for i in 0..3000 {
                let (r, s) = (f64::from(i % 55) / 54.0, f64::from(i / 55) / 54.0);
                if r + s > 1.0 {
                    continue;
                }
                let value =
                    values[0] as f64 * (1.0 - r - s) + values[1] as f64 * r + values[2] as f64 * s;
                let expected = colours.srgb_at(value).to_linear().0;
                let place = DVec3::new(r, s, 0.0);
                let found = parts.iter().find_map(|(part, own)| {
                    let [a, b, c] = part.corners.map(|corner| corner.as_dvec3());
                    let whole = (b - a).cross(c - a).z;
                    let weights = [
                        (c - b).cross(place - b).z,
                        (a - c).cross(place - c).z,
                        (b - a).cross(place - a).z,
                    ];
                    let is_in = whole > 1e-12 && weights.iter().all(|w| *w >= -1e-6 * whole);
                    let mixed = || {
                        let linear = own.map(|colour| DVec3::from(colour.to_linear().0));
                        (0..3).map(|i| linear[i] * weights[i] / whole).sum::<DVec3>()
                    };
                    is_in.then(mixed)
                });
                let off = (found.expect("in a part") - DVec3::from(expected)).abs().max_element();
                worst = worst.max(off);
            }
        }
        // With half as many levels 0.024; the colours of corners alone are off by up to 1 (of black, white and blue).
        assert!(worst < 0.015, "{worst}");
    }

    #[test]
    fn many_small_triangles_are_not_cut_and_some_of_many_levels_by_fewer() {
        let noisy = |count: u32| {
            let corners =
                (0..3 * count).map(|i| Vec3::new(i as f32, (i % 3) as f32, 0.0)).collect();
            let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let mesh = Mesh::new("m", corners, Vec::new(), Vec::new(), triangles).unwrap();
            let values = (0..3 * count).map(|i| [0.0, 1.0, 0.5][i as usize % 3]).collect();
            let array = MeshArray { name: "T".into(), values: MeshValues::Corners(values) };
            let mesh = Arc::new(mesh.with_arrays(vec![array]).unwrap());
            let layer = PolygonLayer::of_surface(mesh, Some("T"), ColourMap::Viridis, None);
            layer.triangles().count() / count as usize
        };
        assert!((100..160).contains(&noisy(10)), "{}", noisy(10));
        assert!((5..40).contains(&noisy(10_000)), "{}", noisy(10_000));
        assert_eq!(noisy(300_000), 1);
    }

    #[test]
    fn bodies_about_points_without_the_number_that_colours_them_are_not_drawn() {
        let corners = (0..6).map(|i| Vec3::new((i % 3 / 2) as f32, (i % 3 % 2) as f32, i as f32));
        let triangles = vec![[0, 1, 2], [3, 4, 5]];
        let mesh = Mesh::new("m", corners.collect(), Vec::new(), Vec::new(), triangles).unwrap();
        let values = MeshValues::Corners([1.0, 2.0, f32::NAN].repeat(2));
        let holed = MeshValues::Corners([[1.0; 3], [f32::NAN; 3]].as_flattened().to_vec());
        for (values, bodies) in [(values, 2), (holed, 1)] {
            let array = MeshArray { name: "T".into(), values };
            let mesh = mesh.clone().with_arrays(vec![array]).unwrap();
            let drawn = |mesh: Mesh, is_coloured: bool| {
                let mesh = Arc::new(mesh);
                let mut layer = PolygonLayer::of_surface(mesh, Some("T"), ColourMap::Gray, None);
                layer.look.by = layer.look.by.filter(|_| is_coloured);
                layer.triangles().count()
            };
            assert_eq!(drawn(mesh.clone(), true), 2, "surfaces stay whole");
            assert_eq!(drawn(mesh.clone().of_points(), true), bodies);
            assert_eq!(drawn(mesh.of_points(), false), 2, "in one colour");
        }
    }

    #[test]
    fn surfaces_whose_own_colours_are_drawn_or_without_the_numbers_are_not_coloured_by_them() {
        let gray = ColourMap::Gray;
        let own = [[1, 2, 3], [4, 5, 6], [7, 8, 9]].map(Srgb8);
        let layer = PolygonLayer::of_surface(mesh(own.to_vec()), None, gray, None);
        assert_eq!((layer.look.by, colours(&layer)), (None, own));
        // Where numbers are asked for they are shown.
        assert!(
            PolygonLayer::of_surface(mesh(own.to_vec()), Some("T"), gray, None).look.by.is_some()
        );
        assert_eq!(PolygonLayer::of_surface(mesh(Vec::new()), Some("U"), gray, None).look.by, None);
    }

    #[test]
    fn looks_that_were_saved_before_numbers_coloured_are_read() {
        let old = r#"{"colour":null,"opacity":0.5,"is_smooth":true}"#;
        let look: PolygonLook = serde_json::from_str(old).unwrap();
        assert_eq!((look.by, look.by_field, look.opacity), (None, false, 0.5));
    }
}
