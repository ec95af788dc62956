//! What is to be seen, as plain data: everything a picture depends on except its size.
//!
//! Owns [`Scene`] and the settings people change. Refuses drawing, files and widgets. The GPU's
//! whole state can be rebuilt from it. Imports `core`, `volume`, `transfer`, `kernel`, `hierarchy`,
//! `vector`, `polygons`.

pub mod annotations;
mod cells;
mod effect;
mod framing;
mod inside;
mod mode;
mod polygons;
mod shading;
mod vectors;
mod view;

pub use crate::hierarchy::ErrorMeasure;
pub use annotations::{Annotation, Annotations, lay_out as lay_out_annotations};
pub use cells::{Cell, Cells, Edge, IndexRay, WhyWhole, level_colour};
pub use effect::Effect;
pub use framing::{NamedView, axis_letters, is_anterior_y};
pub use inside::{
    AlongRay, Clip, ClipBox, CutFaces, HalfSpace, Inside, InsideError, Isosurface,
    MOST_CLIP_PLANES, MOST_ISOSURFACES, MOST_SLICES, Plane, Slice,
};
pub use mode::{
    Backend, Classify, CutSettings, LEAST_SLABS_PER_VOXEL, MOST_GATHERED_EXTENT,
    MOST_SHEETS_PER_KERNEL, MOST_SLABS_PER_VOXEL, ModeChoice, ModeError, OpacityModel, Order,
    Reconstruction, SplatSettings, Visibility,
};
pub use polygons::{POLYGON_COLOUR, PolygonError, PolygonLayer};
pub use shading::{
    Amounts, Attached, BASE_OPACITY, Colours, Index, LEAST_STRENGTH, Light, Lighting, MOST_LIGHTS,
    Shading, ShadingError, ShadingPreset, ShadingSpace, strong_gradient,
};
pub use vectors::{SecondVectors, VectorLayer, vector_range};
pub use view::{MOST_RAYS, Traversal, View};

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::core::{Camera, Srgb8};
use crate::transfer::{TransferFunction, presets};
use crate::volume::{Lattice, ScalarVolume};

/// What lies behind the volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Background {
    /// One opaque colour.
    Colour(Srgb8),
    /// Nothing: pictures keep their alpha.
    Transparent,
}

/// Everything a picture depends on except its size. Cheap to clone: the volume is shared.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The field that is drawn.
    pub volume: Arc<ScalarVolume>,
    /// Its opacity and colour.
    pub transfer: TransferFunction,
    /// How it is splatted.
    pub splat: SplatSettings,
    /// How it is lit, and what colours and opacities are looked up by beside the value.
    pub shading: Shading,
    /// What lets its inside be seen.
    pub inside: Inside,
    /// A vector field beside it, or instead.
    pub vectors: Option<VectorLayer>,
    /// Polygons among all of it.
    pub polygons: Vec<PolygonLayer>,
    /// Where it is seen from.
    pub camera: Camera,
    /// What lies behind it.
    pub background: Background,
}

impl Scene {
    /// World length ℓ over which opacities are given.
    pub fn opacity_unit_distance(&self) -> f64 {
        self.splat.opacity_unit_distance.unwrap_or_else(|| self.volume.lattice.smallest_spacing())
    }

    /// What surfaces are lit by: the scene's lights, or where there are none the usual ones for
    /// isosurfaces, which would be flat.
    pub fn surface_lighting(&self) -> Option<Lighting> {
        let usual = || self.inside.has_isosurfaces().then(Lighting::default);
        self.shading.lighting.clone().or_else(usual)
    }

    /// Whether vectors are drawn and nothing of the scalar field.
    pub fn hides_field(&self) -> bool {
        self.vectors.as_ref().is_some_and(|layer| layer.alone)
    }

    /// Whether two vector fields are drawn.
    pub fn has_second_vectors(&self) -> bool {
        self.vectors.as_ref().is_some_and(|layer| layer.second.is_some())
    }

    /// What draws a field in triangles alone, among which there is no room for its vectors.
    pub fn lacks_room_for_vectors(&self) -> Option<String> {
        let is_beside = self.vectors.is_some() && !self.hides_field();
        self.splat.lacks_room_for_others().filter(|_| is_beside)
    }

    /// Whether lights or tables shade its samples, before kernels are put together.
    pub fn shades_samples(&self) -> bool {
        !self.shading.is_plain()
            && self.splat.classify == Classify::Before
            && Shading::is_shown_by(&self.splat)
    }

    /// Whether only rays through samples that are shaded first show all of it: lights or tables shade
    /// these, or polygons or vectors lie among them.
    pub fn needs_gathering(&self) -> bool {
        let has_vectors = self.vectors.is_some() && self.lacks_room_for_vectors().is_none();
        let has_others = (self.has_polygons() || has_vectors) && !self.hides_field();
        self.shades_samples() || self.splat.classify == Classify::Before && has_others
    }

    /// What draws every voxel in a view where nobody chose and nothing was measured: as
    /// [`SplatSettings::backend_in`], and tiles where only these show all of it.
    pub fn backend_in(&self, view: &View) -> Backend {
        if self.needs_gathering() { Backend::Tiles } else { self.splat.backend_in(view) }
    }

    /// Whether nobody chose what draws it, and both can.
    pub fn is_backend_open(&self, view: &View) -> bool {
        !self.needs_gathering() && self.splat.is_backend_open(view)
    }

    /// What it asks for beside the transfer function and the mode.
    pub fn effects(&self) -> Vec<Effect> {
        // Values that are projected have no opacity, and nothing falls on them.
        let is_lit = self.inside.along == AlongRay::Composite;
        let mut effects = if is_lit { self.shading.effects() } else { Vec::new() };
        if self.vectors.is_some() {
            // They have the stage to themselves: see `Inside`'s effects.
            effects = if self.hides_field() { Vec::new() } else { self.shading.effects() };
            if is_lit && !self.hides_field() {
                effects.extend(self.inside.effects());
            }
            effects.push(Effect::Vectors);
            if self.has_second_vectors() {
                effects.push(Effect::SecondVectors);
            }
        } else {
            effects.extend(self.inside.effects());
        }
        if self.has_polygons() {
            effects.push(Effect::Polygons);
        }
        effects
    }

    /// Whether two scenes make the same picture at the same size.
    pub fn makes_same_picture(&self, other: &Self) -> bool {
        // Taken apart, so that a new field cannot be forgotten here.
        let Self {
            volume,
            transfer,
            splat,
            shading,
            inside,
            vectors,
            polygons,
            camera,
            background,
        } = self;
        Arc::ptr_eq(volume, &other.volume)
            && *transfer == other.transfer
            && splat.makes_same_picture(&other.splat)
            && *shading == other.shading
            && *inside == other.inside
            && *vectors == other.vectors
            && *polygons == other.polygons
            && *camera == other.camera
            && *background == other.background
    }
}

/// What lies behind a volume until someone chooses otherwise, in the window and in `render`.
pub const BACKGROUND: Srgb8 = Srgb8::BLACK;

/// What a newly opened volume is seen as: a transfer function from its histogram, the whole
/// lattice in the isometric view, black behind. `space` is what the file calls its space.
pub fn opening(volume: Arc<ScalarVolume>, space: Option<&str>) -> Scene {
    let (direction, up) = NamedView::Isometric.direction_and_up(is_anterior_y(space));
    Scene {
        transfer: presets::default_for(&volume.statistics),
        camera: framing_camera(&volume.lattice, direction, up),
        splat: SplatSettings::default(),
        shading: Shading::default(),
        inside: Inside::default(),
        vectors: None,
        polygons: Vec::new(),
        background: Background::Colour(BACKGROUND),
        volume,
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
