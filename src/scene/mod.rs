//! What is to be seen, as plain data: everything a picture depends on except its size.
//!
//! Owns [`Scene`], the layers it is made of, the store of their samples, and the settings people change. Refuses drawing,
//! files and widgets. The GPU's whole state can be rebuilt from it. Imports `core`, `volume`, `transfer`, `kernel`, `hierarchy`,
//! `vector`, `polygons`.

pub mod annotations;
mod cells;
mod effect;
mod field_on_mesh;
mod first_look;
mod framing;
mod inside;
mod layer;
mod mode;
mod orientation;
mod placing;
mod polygons;
mod refusals;
mod saved;
mod shading;
mod store;
mod upright;
mod view;

pub use crate::hierarchy::ErrorMeasure;
pub use annotations::{Annotation, Annotations, lay_out as lay_out_annotations};
pub use cells::{Cell, Cells, Edge, IndexRay, WhyWhole, level_colour};
pub use effect::Effect;
pub use field_on_mesh::{FieldOnMesh, MeshInField};
pub use first_look::FirstLook;
pub use framing::{
    among_axes, among_surfaces, box_of_all_that_shows, box_of_what_shows, framing_all,
    framing_surfaces, framing_what_shows, in_perspective,
};
use inside::FADED;
pub use inside::{
    AlongRay, Clip, ClipBox, CutFaces, HalfSpace, Inside, InsideError, Isosurface,
    MOST_CLIP_PLANES, MOST_ISOSURFACES, MOST_SLICES, Plane, Slice, edge_colour, projected_range,
};
pub use layer::{Layer, Look, Surface, VectorLayer, offers};
pub use mode::{
    Backend, Classify, CutSettings, LEAST_SLABS_PER_VOXEL, MOST_GATHERED_EXTENT,
    MOST_SHEETS_PER_KERNEL, MOST_SLABS_PER_VOXEL, ModeChoice, ModeError, Moving, OpacityModel,
    Order, Reconstruction, SplatSettings, Visibility,
};
pub use orientation::{NamedView, Orientation, UpAxis, axis_letters, plane_names};
pub use placing::place_over;
pub use polygons::{BESIDE, ByArray, POLYGON_COLOUR, PolygonError, PolygonLayer, PolygonLook};
pub use refusals::{Ground, Refusal};
pub use saved::{SAVED_VERSION, SavedError};
pub use shading::{
    Amounts, Attached, BASE_OPACITY, Colours, Index, LEAST_STRENGTH, Light, Lighting, MOST_LIGHTS,
    NAMES_REACH, Shading, ShadingError, ShadingPreset, ShadingSpace, strong_gradient,
};
pub use store::{SampleSource, Sampled, Store};
pub use view::{MOST_RAYS, Traversal, View};

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::core::{Camera, LinearRgb, Srgb8};
use crate::transfer::{ColourMap, ColourSource, TransferFunction, presets};
use crate::volume::{Lattice, ScalarVolume};

/// What lies behind the volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Background {
    /// One opaque colour.
    Colour(Srgb8),
    /// Nothing: pictures keep their alpha.
    Transparent,
}

impl Background {
    /// Its linear colour, if any.
    pub fn light(self) -> Option<LinearRgb> {
        match self {
            Self::Colour(colour) => Some(colour.to_linear()),
            Self::Transparent => None,
        }
    }
}

/// Everything a picture depends on except its size. Cheap to clone: samples are shared.
///
/// All but the samples can be saved ([`Scene::to_json`]); layers name these, and [`Scene::store`] holds them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Scene {
    /// What is drawn together. Where one lies behind another is up to their places, not to this order.
    pub layers: Vec<Layer>,
    /// How far the marks of vectors have moved, in cycles: 0 and 1 are the same.
    pub phase: f64,
    /// How it is splatted.
    pub splat: SplatSettings,
    /// How it is lit, and what colours and opacities are looked up by beside the value.
    pub shading: Shading,
    /// What lets its inside be seen.
    pub inside: Inside,
    /// Where it is seen from.
    pub camera: Camera,
    /// The axis of the world that was chosen to point up; `None` as the file has it. Views that have names and the
    /// hand go by it, and no picture.
    #[serde(default)]
    pub up: Option<UpAxis>,
    /// What lies behind it.
    pub background: Background,
    /// The samples that the layers name.
    #[serde(skip)]
    pub store: Store,
}

impl Scene {
    /// World length ℓ over which opacities are given.
    pub fn opacity_unit_distance(&self) -> f64 {
        self.splat.opacity_unit_distance.unwrap_or_else(|| self.own_unit_distance())
    }

    /// The same where nobody chose one: the median edge of cells, how far points lie apart, else the smallest spacing.
    pub fn own_unit_distance(&self) -> f64 {
        // The samples of cells and points are as fine as quick pictures want them.
        let found = self.volume().and_then(|volume| match (&volume.cells, &volume.scattered) {
            (Some(field), _) => Some(field.cells().median_edge()),
            (None, Some(scattered)) => scattered.spacing(),
            (None, None) => None,
        });
        found.filter(|own| *own > 0.0).unwrap_or_else(|| self.lattice().smallest_spacing())
    }

    /// The transfer function that its field is drawn with: projected values have their colours in a range of their own, or
    /// are grey, where that is chosen; a field that is faded has a small part of its opacities.
    pub fn drawn_transfer(&self) -> Option<Cow<'_, TransferFunction>> {
        let transfer = self.transfer()?;
        let inside = self.inside_in_place().shown_by(&self.splat);
        let projects = inside.along != AlongRay::Composite;
        let range = inside.projected_range.filter(|_| projects);
        if self.inside.is_faded && !projects {
            return Some(Cow::Owned(transfer.thinned(FADED)));
        }
        let colour = match (inside.projected_grey && projects, range) {
            (false, None) => return Some(Cow::Borrowed(transfer)),
            (false, Some(range)) => transfer.colour.stretched(range),
            (true, range) => {
                let range = range.unwrap_or_else(|| transfer.colour.range());
                ColourSource::Map { map: ColourMap::Gray, range }
            }
        };
        Some(Cow::Owned(TransferFunction { colour, ..transfer.clone() }))
    }

    /// What it asks for beside the transfer function and the mode.
    pub fn effects(&self) -> Vec<Effect> {
        let projects = self.inside.along != AlongRay::Composite;
        let is_shown = |effect: &Effect| match effect {
            // The whole of what follows it.
            Effect::Shading => false,
            // Values that are projected have no opacity, nothing falls on them, and there are no surfaces; but beside
            // vectors nothing is projected.
            _ if effect.is_of_shading() => {
                self.shows_field() && (!projects || !self.vectors().is_empty())
            }
            Effect::Isosurfaces | Effect::Slices => !projects,
            _ => true,
        };
        let asked = Effect::ALL.iter().copied().filter(|effect| effect.asked_by(self).is_some());
        asked.filter(is_shown).filter(|effect| self.refusal_of(*effect).is_none()).collect()
    }

    /// What is seen inside its field, and of surfaces by themselves: nothing where vectors alone are shown, nor where values
    /// are to be projected beside vectors; what cuts surfaces, where they are alone.
    pub fn inside_in_place(&self) -> Inside {
        match (self.refusal_of(Effect::Clip), self.shows_field()) {
            (Some(_), _) => Inside::default(),
            (None, true) => self.inside.clone(),
            (None, false) => {
                let clip = Clip { faces: CutFaces::Through, ..self.inside.clip.clone() };
                Inside { clip, ..Inside::default() }
            }
        }
    }

    /// Whether two scenes make the same picture at the same size.
    pub fn makes_same_picture(&self, other: &Self) -> bool {
        self.phase == other.phase && self.differs_by_phase_alone(other)
    }

    /// Whether they do but for how far marks have moved.
    pub fn differs_by_phase_alone(&self, other: &Self) -> bool {
        // Taken apart, so that a new field cannot be forgotten here.
        let Self {
            layers: _,
            phase: _,
            splat,
            shading,
            inside,
            camera,
            up: _,
            background,
            store: _,
        } = self;
        self.has_same_layers(other)
            && splat.makes_same_picture(&other.splat)
            && *shading == other.shading
            && *inside == other.inside
            && *camera == other.camera
            && *background == other.background
    }

    /// Whether both show the same samples in the same way.
    pub fn has_same_layers(&self, other: &Self) -> bool {
        let is_same = |layer: &Layer| {
            self.store.get(&layer.source) == other.store.get(&layer.source)
                && self.mesh_with_values(layer) == other.mesh_with_values(layer)
        };
        self.layers == other.layers && self.layers.iter().all(is_same)
    }
}

/// What lies behind a volume until someone chooses otherwise, in the window and in `render`.
pub const BACKGROUND: Srgb8 = Srgb8::BLACK;

/// What a newly opened volume is seen as ([`FirstLook`]): what of it shows fills the view, black behind. `space` is what
/// the file calls its space.
pub fn first_look(source: SampleSource, volume: Arc<ScalarVolume>, space: Option<&str>) -> Scene {
    seen_first(source, Arc::clone(&volume), FirstLook::of(&volume, space))
}

/// A volume as a first look says.
pub fn seen_first(source: SampleSource, volume: Arc<ScalarVolume>, look: FirstLook) -> Scene {
    let FirstLook { transfer, lighting, splat, orientation, view } = look;
    let (direction, up) = view.direction_and_up(orientation);
    let seen_by = Scene::seen_by(framing_what_shows(&volume, &transfer, direction, up));
    let shading = Shading { lighting, ..Shading::default() };
    let mut scene = Scene { splat, shading, ..seen_by };
    scene.add(source, (Sampled::Volume(volume), Look::Field(transfer)));
    scene
}

/// A volume in the exact mode, unlit, in the isometric view: what is compared begins with it. Its transfer function is
/// that of a first look.
pub fn opening(source: SampleSource, volume: Arc<ScalarVolume>, space: Option<&str>) -> Scene {
    let (direction, up) = NamedView::Isometric.direction_and_up(Orientation::of(space));
    let transfer = presets::default_for(&volume.statistics);
    let mut scene = Scene::seen_by(framing_what_shows(&volume, &transfer, direction, up));
    scene.add(source, (Sampled::Volume(volume), Look::Field(transfer)));
    scene
}

impl Scene {
    /// Nothing, black behind, in the exact mode.
    pub fn seen_by(camera: Camera) -> Self {
        Self {
            layers: Vec::new(),
            phase: 0.0,
            splat: SplatSettings::default(),
            shading: Shading::default(),
            inside: Inside::default(),
            camera,
            up: None,
            background: Background::Colour(BACKGROUND),
            store: Store::default(),
        }
    }
}

/// A camera along `direction` that shows the whole lattice, every voxel's box, with a margin of a
/// twentieth, in any picture at least as wide as it is high.
pub fn framing_camera(lattice: &Lattice, direction: DVec3, up: DVec3) -> Camera {
    let mut camera = Camera::new(lattice.centre(), direction, up, 1.0);
    let reach = |axis: DVec3| {
        let half = DVec3::from(lattice.dims.map(|n| n as f64)) / 2.0;
        // Half the extent of a box along an axis is the sum over its edges.
        (lattice.axes().transpose() * axis).abs().dot(half)
    };
    camera.parallel_scale = 1.05 * reach(camera.up).max(reach(camera.right()));
    camera
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_framing_camera_shows_every_corner_and_little_more() {
        let spacing = DVec3::new(1.0, 2.0, 0.5);
        let lattice = Lattice { spacing, ..Lattice::unit([30, 10, 50]) };
        for direction in [DVec3::Y, DVec3::new(-1.0, 1.0, -1.0), DVec3::new(0.1, 0.3, 2.0)] {
            let camera = framing_camera(&lattice, direction, DVec3::Z);
            let size = [100.0, 100.0];
            let corners = (0..8).map(|corner| {
                let bit = |axis: usize| f64::from(corner >> axis & 1);
                let dims = lattice.dims.map(|n| n as f64);
                let index = std::array::from_fn(|a| bit(a) * dims[a] - 0.5);
                let view = camera.to_view(lattice.world_from_index(DVec3::from_array(index)));
                camera.pixel_from_view(view, size).expect("orthographic")
            });
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for pixel in corners {
                least = least.min(pixel.min_element());
                most = most.max(pixel.max_element());
            }
            assert!((2.0..2.8).contains(&least) && (97.2..98.0).contains(&most), "{least} {most}");
        }
    }
}
