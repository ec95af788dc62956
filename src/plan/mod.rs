//! What one picture is made of, as plain data: derived from a scene and a size, without a device, and drawn by
//! whichever engine supports it.
//!
//! Owns [`Plan`] and the long work that it asks for ([`Classification::levels`]). Refuses drawing, and whatever a scene
//! holds that no picture of this size and mode shows: that is named in [`Plan::left_out`]. Imports `scene` and what
//! lies below it.
//!
//! One rule for all of it: a ray is cut into slabs of the frame's thickness. In each, every field gives the optical
//! depth τ and the colour c of what lies between its faces, every kernel list the share of its kernels there (of a
//! kernel, the integral between the faces), and surfaces split the slab. What has no surface between shares its part
//! evenly: τ = Σ τᵢ, c = Σ τᵢ cᵢ / τ, α = 1 − exp(−τ); surfaces have their own α. Parts are composited in their
//! order, front to back: C ← C + (1 − A) α c, A ← A + (1 − A) α.

mod cut;
mod kernels;
mod outline;

pub use cut::{COARSER, EMPTY, FieldCut, LOOKS, SEGMENT, bricks_of_cut};
pub use kernels::{Classification, KernelList, KernelSlabs};
pub use outline::Outline;

use std::borrow::Cow;
use std::sync::Arc;

use crate::core::Camera;
use crate::kernel::RadialKernel;
use crate::scene::{
    Backend, Background, Classify, Effect, Ground, Inside, ModeError, PolygonLayer, Refusal, Scene,
    Shading, SplatSettings, Surface, View, Visibility,
};
use crate::transfer::TransferFunction;
use crate::volume::{Lattice, ScalarVolume};

/// What one picture is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Size of the picture, pixels.
    pub size: [u32; 2],
    /// How many times larger it is shown than it is drawn, ≥ 1.
    pub enlarged: f64,
    /// Where it is seen from.
    pub camera: Camera,
    /// What lies behind.
    pub background: Background,
    /// Where slabs lie, and how thick they are.
    pub frame: Frame,
    /// The mode: what reconstructs values, when they are classified, how parts hide one another.
    pub mode: SplatSettings,
    /// Values at places, and what classifies them.
    pub fields: Vec<Field>,
    /// Kernels that are classified one by one.
    pub kernels: Vec<KernelList>,
    /// How far the marks of kernels have moved, in cycles.
    pub phase: f64,
    /// Which level each brick of the field is drawn from; without it, all from the field itself.
    pub cut: Option<Arc<FieldCut>>,
    /// What rays meet at places, beside what is seen inside a field.
    pub surfaces: Vec<Surface>,
    /// What is cut away, slices, isosurfaces, and what stands for a ray.
    pub inside: Inside,
    /// Lights, and the tables that shade the fields.
    pub shading: Shading,
    /// How it comes to be a picture.
    pub way: Way,
    /// What the scene asks for and this picture has no place for.
    pub left_out: Vec<Refusal>,
    /// Why it would be no picture of the scene, if so: a layer that was moved, or has no samples.
    pub fault: Option<ModeError>,
}

/// Values on a lattice, and what classifies them.
#[derive(Debug, Clone)]
pub struct Field {
    /// The samples.
    pub volume: Arc<ScalarVolume>,
    /// Opacities and colours.
    pub transfer: TransferFunction,
    /// Whether something asks how values change about each point.
    pub has_gradient: bool,
}

impl PartialEq for Field {
    /// The same samples, not equal ones.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.volume, &other.volume)
            && self.transfer == other.transfer
            && self.has_gradient == other.has_gradient
    }
}

/// Which of the fields that an engine holds slabs are made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlabField {
    /// The scene's own.
    #[default]
    Own,
    /// One that is quicker to evaluate.
    Preview,
}

/// Where slabs lie, and how thick they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Slabs are anchored at its centre, and are so many to the smallest of its spacings as the mode says
    /// ([`SplatSettings::slabs_per_voxel`]); clips are shares of it.
    pub lattice: Lattice,
    /// World length over which opacities are given.
    pub unit_distance: f64,
}

/// How the parts of a picture come to be one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Neither a field nor kernels are there: the background, and surfaces alone.
    Nothing,
    /// Rays go from slab to slab of a reconstructed field, of kernel lists, or of both.
    Slabs,
    /// Rays gather samples that are shaded first.
    Gathered,
    /// Samples that are shaded first are drawn one by one as triangles.
    Triangles,
    /// The same of the finest nodes of the octree that are no less than a pixel wide.
    Nodes,
}

impl Way {
    /// Its name in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Slabs => "slabs",
            Self::Gathered => "gathered",
            Self::Triangles => "triangles",
            Self::Nodes => "nodes",
        }
    }
}

impl Plan {
    /// The finished picture of a scene at a size.
    pub fn of(scene: &Scene, size: [u32; 2]) -> Self {
        let left_out = scene.refusals();
        let has_no = |part: Effect| left_out.iter().any(|refusal| refusal.part == part);
        let fields = scene.volume().zip(scene.drawn_transfer()).filter(|_| scene.shows_field());
        let field = |(volume, transfer): (&Arc<ScalarVolume>, Cow<'_, TransferFunction>)| Field {
            volume: Arc::clone(volume),
            transfer: transfer.into_owned(),
            has_gradient: scene.shading.uses_gradient() || scene.inside.has_isosurfaces(),
        };
        let plan = Self {
            size,
            enlarged: 1.0,
            camera: scene.camera,
            background: scene.background,
            frame: Frame { lattice: scene.lattice(), unit_distance: scene.opacity_unit_distance() },
            mode: scene.splat,
            fields: fields.map(field).into_iter().collect(),
            kernels: if has_no(Effect::Vectors) { Vec::new() } else { KernelList::all_of(scene) },
            phase: scene.phase,
            cut: None,
            surfaces: if has_no(Effect::Polygons) { Vec::new() } else { scene.surfaces() },
            inside: scene.inside_in_place().shown_by(&scene.splat),
            shading: scene.shading.clone(),
            way: Way::Nothing,
            left_out,
            fault: scene.check_layers().err(),
        };
        plan.with_way()
    }

    /// The same picture in another mode.
    #[must_use]
    pub fn in_mode(&self, mode: SplatSettings) -> Self {
        Self { mode, ..self.clone() }.with_way()
    }

    /// The same picture, of another size, and shown so many times larger.
    #[must_use]
    pub fn at_size(&self, size: [u32; 2], enlarged: f64) -> Self {
        Self { size, enlarged, ..self.clone() }.with_way()
    }

    /// What stands for it while there are no fields yet: the field alone, as triangles, shaded first; kernels where
    /// there is no field.
    #[must_use]
    pub fn previewed(&self) -> Self {
        let mut plan = self.in_mode(self.mode.previewed());
        if !plan.fields.is_empty() {
            let parts = [Effect::Vectors, Effect::SecondVectors].into_iter();
            let ground = Ground::Triangles("--backend raster".to_owned());
            let refused = |part| Refusal { part, ground: ground.clone() };
            plan.left_out.extend(parts.take(plan.kernels.len()).map(refused));
            plan.kernels.clear();
        }
        plan.with_way()
    }

    /// The lattice and the camera brought together, in pixels.
    pub fn view(&self) -> View {
        View { enlarged: self.enlarged, ..View::of(&self.camera, &self.frame.lattice, self.size) }
    }

    /// The field of values, if one is drawn.
    pub fn field(&self) -> Option<&Field> {
        self.fields.first()
    }

    /// Whether both are of the same samples, rather than equal ones.
    pub fn has_same_samples(&self, other: &Self) -> bool {
        let same_field = |(a, b): (&Field, &Field)| Arc::ptr_eq(&a.volume, &b.volume);
        let same_list = |(a, b): (&KernelList, &KernelList)| Arc::ptr_eq(&a.field, &b.field);
        self.fields.len() == other.fields.len()
            && self.kernels.len() == other.kernels.len()
            && self.fields.iter().zip(&other.fields).all(same_field)
            && self.kernels.iter().zip(&other.kernels).all(same_list)
    }

    /// Whether kernel lists have the stage to themselves.
    pub fn is_of_kernels_alone(&self) -> bool {
        self.fields.is_empty() && !self.kernels.is_empty()
    }

    /// Whether values are reconstructed before they are classified.
    pub fn reconstructs(&self) -> bool {
        self.mode.visibility == Visibility::Slabs && self.mode.classify != Classify::Before
    }

    /// Whether lights or tables shade samples, before kernels are put together.
    pub fn shades_samples(&self) -> bool {
        !self.fields.is_empty() && self.shading.is_of_samples(&self.mode)
    }

    /// Its triangles.
    pub fn polygons(&self) -> Vec<PolygonLayer> {
        self.surfaces.iter().map(|Surface::Polygons(layer)| layer.clone()).collect()
    }

    /// Whether only rays through samples that are shaded first show all of it: lights or tables shade these, or
    /// polygons or kernels lie among them.
    pub fn is_gathered(&self) -> bool {
        let has_others = !self.surfaces.is_empty() || !self.kernels.is_empty();
        let is_among = self.mode.classify == Classify::Before && has_others;
        !self.fields.is_empty() && (self.shades_samples() || is_among)
    }

    /// What draws samples that are shaded first, where nobody chose and nothing was measured.
    pub fn backend(&self) -> Backend {
        if self.is_gathered() { Backend::Tiles } else { self.mode.backend_in(&self.view()) }
    }

    /// Whether nobody chose what draws it, and both back ends can.
    pub fn is_backend_open(&self) -> bool {
        !self.is_gathered() && self.mode.is_backend_open(&self.view())
    }

    /// With the way that there is to it.
    fn with_way(mut self) -> Self {
        self.way = match () {
            () if self.fields.is_empty() && self.kernels.is_empty() => Way::Nothing,
            () if self.fields.is_empty() || self.reconstructs() => Way::Slabs,
            () => self.way_of_samples(),
        };
        self
    }

    /// Of samples that are shaded first.
    fn way_of_samples(&self) -> Way {
        let view = self.view();
        let radial = RadialKernel::new(self.mode.kernel.splatted(), self.mode.splatted_extent());
        // Splats are nowhere under a pixel: the pyramid level whose nodes are not.
        let is_small = radial.is_some_and(|k| k.radius() * view.voxel_pixels() < 1.0);
        let takes_rays = self.mode.takes_several_rays(&view) || self.is_gathered();
        match self.backend() {
            Backend::Tiles if !is_small || takes_rays => Way::Gathered,
            // Larger nodes stand in for kernels that lie side by side, and not for others; and they are unlit.
            Backend::Raster if !is_small || !self.mode.covers() => Way::Triangles,
            _ => Way::Nodes,
        }
    }
}
