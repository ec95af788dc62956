//! Lists of kernels that are classified one by one.

use std::sync::Arc;

use crate::core::{Cancelled, Ticket};
use crate::scene::{OpacityModel, Scene, VectorLayer};
use crate::vector::{ColourBy, Design, Foreshortening, Splats, VectorPyramid, VectorSettings};
use crate::volume::{ScalarVolume, VectorField};

/// One list: what its kernels are of, and how they look. The kernels themselves (a centre, a 3 × 3 shape, an amount,
/// colours, a phase each) are long work ([`Classification::levels`]).
#[derive(Debug, Clone)]
pub struct KernelList {
    /// One kernel a vector, or for several.
    pub field: Arc<VectorField>,
    /// What they look like.
    pub settings: VectorSettings,
    /// What they are classified by.
    pub classification: Classification,
}

impl PartialEq for KernelList {
    fn eq(&self, other: &Self) -> bool {
        self.settings == other.settings && self.classification == other.classification
    }
}

impl KernelList {
    /// Those of a scene.
    pub(super) fn all_of(scene: &Scene) -> Vec<Self> {
        let list = |layer: VectorLayer| Self {
            classification: Classification::of(scene, &layer.field, &layer.settings),
            field: layer.field,
            settings: layer.settings,
        };
        scene.vectors().into_iter().filter(VectorLayer::shows_splats).map(list).collect()
    }
}

/// The kernels that are drawn of each list of a plan, and the slabs that they are cut into.
#[derive(Debug, Clone)]
pub struct KernelSlabs {
    /// Of each list, the level that is drawn.
    pub splats: Vec<Arc<Splats>>,
    /// Distance between the faces of slabs, pixels of view depth. One is at the frame's centre.
    pub thickness: f64,
    /// How many slabs of the field lie in each: 1, but where a quick picture may share them out.
    pub field_slabs: u32,
}

impl PartialEq for KernelSlabs {
    /// Of the same kernels, not of equal ones.
    fn eq(&self, other: &Self) -> bool {
        let splats = |one: &Self| one.splats.iter().map(Arc::as_ptr).collect::<Vec<_>>();
        (self.thickness, self.field_slabs) == (other.thickness, other.field_slabs)
            && splats(self) == splats(other)
    }
}

/// What kernels are made of; how they are drawn besides does not count.
#[derive(Debug, Clone)]
pub struct Classification {
    field: Arc<VectorField>,
    scalar: Option<Arc<ScalarVolume>>,
    settings: VectorSettings,
    unit_distance: f64,
    published: bool,
}

impl Classification {
    fn of(scene: &Scene, field: &Arc<VectorField>, settings: &VectorSettings) -> Self {
        let by_scalar = [settings.opacity_by, settings.colour_by];
        let needs_scalar = by_scalar.contains(&ColourBy::Scalar);
        Self {
            field: Arc::clone(field),
            scalar: scene.volume().filter(|_| needs_scalar).map(Arc::clone),
            settings: VectorSettings {
                coarser: 0,
                design: Design::default(),
                foreshortening: Foreshortening::default(),
                ..settings.clone()
            },
            unit_distance: scene.opacity_unit_distance(),
            published: scene.splat.opacity_model == OpacityModel::Published,
        }
    }

    /// Whether they are of a field.
    pub fn is_of(&self, field: &Arc<VectorField>) -> bool {
        Arc::ptr_eq(&self.field, field)
    }

    /// The kernels, the finest level first: one a vector, then one for eight, and so on. A second of work a million.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn levels(&self, ticket: &Ticket) -> Result<Vec<Arc<Splats>>, Cancelled> {
        let Self { field, scalar, settings, unit_distance, published } = self;
        let scalar = scalar.as_deref();
        let splats = Splats::new(field, settings, scalar, *unit_distance, *published, ticket)?;
        let pyramid = VectorPyramid::new(splats, settings, *published, ticket)?;
        Ok(pyramid.levels.into_iter().map(Arc::new).collect())
    }
}

impl PartialEq for Classification {
    /// Of the same samples, not of equal ones.
    fn eq(&self, other: &Self) -> bool {
        let scalar = |one: &Self| one.scalar.as_ref().map(Arc::as_ptr);
        scalar(self) == scalar(other)
            && Arc::ptr_eq(&self.field, &other.field)
            && self.settings == other.settings
            && self.unit_distance == other.unit_distance
            && self.published == other.published
    }
}
