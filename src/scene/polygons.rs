//! Polygons in a scene, embedded in the volume.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Look, Sampled, Scene};
use crate::core::Srgb8;
use crate::polygons::{Mesh, Triangle};
use crate::transfer::{ColourMap, ColourSource, colour_of_label};

/// What polygons look like that say nothing of it.
pub const POLYGON_COLOUR: Srgb8 = Srgb8([225, 225, 225]);

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

/// Colours of the numbers on a mesh: at each corner, and between corners a mean of theirs.
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

    /// The colour of a number; [`POLYGON_COLOUR`] where there is none.
    pub fn colour(&self, value: f64) -> Srgb8 {
        match value.is_nan() {
            true => POLYGON_COLOUR,
            false => ColourSource::Map { map: self.map, range: self.range }.srgb_at(value),
        }
    }
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
    #[error("expected the opacity of a mesh from 0 to 1, found {found}")]
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

    /// Which of the mesh's arrays colours it.
    pub fn array(&self) -> Option<usize> {
        match self.field_colours {
            Some(_) => Some(0),
            None => self.look.by.map(|by| by.array),
        }
    }

    /// Every triangle, with normals and colours as it looks; none of bodies about points without the number that colours others.
    pub fn triangles(&self) -> impl Iterator<Item = (Triangle, [Srgb8; 3])> + '_ {
        let PolygonLook { colour, by, is_smooth, .. } = self.look;
        let of_field = self.field_colours.as_ref();
        let values = self.mesh.values(self.array().unwrap_or(usize::MAX));
        let has_holes = self.mesh.is_of_points() && of_field.is_none() && by.is_some();
        let is_there = move |values: &[f32; 3]| !has_holes || values.iter().any(|v| !v.is_nan());
        let there = self.mesh.triangles(is_smooth).zip(values);
        let there = there.filter(move |(_, values)| is_there(values));
        there.map(move |(triangle, values)| {
            let values = values.map(f64::from);
            let colours = match (of_field, by, colour, triangle.colours) {
                (Some(field), ..) => values.map(|value| match value.is_nan() {
                    true => POLYGON_COLOUR,
                    false => field.srgb_at(value),
                }),
                (None, Some(by), ..) => values.map(|value| by.colour(value)),
                (None, None, Some(colour), _) => [colour; 3],
                (None, None, None, Some(own)) => own,
                (None, None, None, None) => [POLYGON_COLOUR; 3],
            };
            (triangle, colours)
        })
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
