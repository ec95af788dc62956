//! What a scene is made of, one thing a layer: what it is called in the store, whether it is drawn, where, and how
//! it looks.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::store::{SampleSource, Sampled};
use super::{Effect, ModeError, PolygonLayer, PolygonLook, Scene};
use crate::polygons::Mesh;
use crate::transfer::{ColourMap, ColourSource, TransferFunction};
use crate::vector::VectorSettings;
use crate::volume::{Lattice, Places, ScalarVolume, VectorField};

/// One thing among those that are drawn together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// What its samples are called in the scene's store.
    pub source: SampleSource,
    /// Whether it is drawn.
    pub is_shown: bool,
    /// World from the samples' own world: the identity where it lies as its file says.
    #[serde(default)]
    pub placement: DAffine3,
    /// What it is, and what it looks like.
    pub look: Look,
}

/// What a layer is, and what it looks like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Look {
    /// Values on a lattice, with their opacities and colours.
    Field(TransferFunction),
    /// Vectors as splats.
    Vectors(VectorSettings),
    /// Triangles.
    Polygons(PolygonLook),
}

impl Look {
    /// What such a layer is, in a word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Field(_) => "field",
            Self::Vectors(_) => "vectors",
            Self::Polygons(_) => "polygons",
        }
    }
}

/// Vectors as splats, beside the field or without it.
#[derive(Debug, Clone)]
pub struct VectorLayer {
    /// The vectors.
    pub field: Arc<VectorField>,
    /// What they look like.
    pub settings: VectorSettings,
}

impl VectorLayer {
    /// A field as it is first seen.
    pub fn new(field: Arc<VectorField>) -> Self {
        Self { settings: VectorSettings::for_field(&field), field }
    }

    /// A field as it is first seen beside another: in colours of its own, and out of step with it.
    pub fn beside_another(field: Arc<VectorField>) -> Self {
        let mut settings = VectorSettings { seed: 1, ..VectorSettings::for_field(&field) };
        if let ColourSource::Map { map, .. } = &mut settings.transfer.colour {
            *map = ColourMap::Inferno;
        }
        Self { field, settings }
    }
}

impl PartialEq for VectorLayer {
    /// The same field, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.field, &other.field) && self.settings == other.settings
    }
}

impl From<VectorLayer> for (Sampled, Look) {
    fn from(VectorLayer { field, settings }: VectorLayer) -> Self {
        (Sampled::Vectors(field), Look::Vectors(settings))
    }
}

impl Scene {
    /// Adds a layer that is drawn, at its own place; where it is among the layers.
    pub fn add(&mut self, source: SampleSource, layer: impl Into<(Sampled, Look)>) -> usize {
        let (samples, look) = layer.into();
        let source = self.store.insert(source, samples);
        self.layers.push(Layer { source, is_shown: true, placement: DAffine3::IDENTITY, look });
        self.layers.len() - 1
    }

    /// The scene with one more layer, of samples that no file holds.
    #[must_use]
    pub fn with(mut self, layer: impl Into<(Sampled, Look)>) -> Self {
        self.add(SampleSource::default(), layer);
        self
    }

    /// Whether its layers are what the reference and the engines know to draw: one field of values at most, every
    /// layer where its file says, with its samples.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check_layers(&self) -> Result<(), ModeError> {
        let is_field = |layer: &&Layer| layer.is_shown && matches!(layer.look, Look::Field(_));
        let fields = self.layers.iter().filter(is_field).count();
        if fields > 1 {
            return Err(ModeError {
                expected: "one field of values at most",
                found: fields.to_string(),
                advice: "hide the others",
            });
        }
        for layer in self.layers.iter().filter(|layer| layer.is_shown) {
            let name = format!("{} \"{}\"", layer.look.kind(), layer.source.field);
            if layer.placement != DAffine3::IDENTITY {
                return Err(ModeError {
                    expected: "every layer where its file says",
                    found: format!("{name} moved elsewhere"),
                    advice: "leave its placement out",
                });
            }
            if self.store.get(&layer.source).is_none() {
                return Err(ModeError {
                    expected: "samples of every layer that is drawn",
                    found: format!("none of {name}"),
                    advice: "open its file, or hide the layer",
                });
            }
        }
        Ok(())
    }

    /// Leaves only the layers that are wanted, and lets go of the samples of the others.
    pub fn keep(&mut self, is_wanted: impl FnMut(&Layer) -> bool) {
        self.layers.retain(is_wanted);
        let layers = &self.layers;
        self.store.retain(|source| layers.iter().any(|layer| layer.source == *source));
    }

    /// The layer of the field that panels, clips and opacities speak of: the first that is drawn, else the first.
    fn field_index(&self) -> Option<usize> {
        let is_field = |layer: &&Layer| matches!(layer.look, Look::Field(_));
        let of = |is_one: &dyn Fn(&Layer) -> bool| {
            self.layers.iter().position(|layer| is_field(&layer) && is_one(layer))
        };
        of(&|layer| layer.is_shown).or_else(|| of(&|_| true))
    }

    /// The samples of the field that is drawn, or was hidden.
    pub fn volume(&self) -> Option<&Arc<ScalarVolume>> {
        match self.store.get(&self.layers[self.field_index()?].source)? {
            Sampled::Volume(volume) => Some(volume),
            _ => None,
        }
    }

    /// Its samples; 0 where there is none.
    pub fn voxel_count(&self) -> u64 {
        self.volume().map_or(0, |volume| volume.lattice.len() as u64)
    }

    /// Whether both are of the same volume, rather than of equal ones.
    pub fn has_same_volume(&self, other: &Self) -> bool {
        match (self.volume(), other.volume()) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        }
    }

    /// Opacities and colours of [`Scene::volume`].
    pub fn transfer(&self) -> Option<&TransferFunction> {
        match &self.layers[self.field_index()?].look {
            Look::Field(transfer) => Some(transfer),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn transfer_mut(&mut self) -> Option<&mut TransferFunction> {
        let index = self.field_index()?;
        match &mut self.layers[index].look {
            Look::Field(transfer) => Some(transfer),
            _ => None,
        }
    }

    /// Whether a field of values is drawn.
    pub fn shows_field(&self) -> bool {
        let is_field = |layer: &&Layer| matches!(layer.look, Look::Field(_));
        self.layers.iter().filter(is_field).any(|layer| layer.is_shown)
    }

    /// Draws the fields of values, or leaves them out.
    pub fn show_field(&mut self, is_shown: bool) {
        for layer in &mut self.layers {
            if matches!(layer.look, Look::Field(_)) {
                layer.is_shown = is_shown;
            }
        }
    }

    /// The vectors that are drawn.
    pub fn vectors(&self) -> Vec<VectorLayer> {
        let shown = self.layers.iter().filter(|layer| layer.is_shown);
        let vectors = |layer: &Layer| match (&layer.look, self.store.get(&layer.source)?) {
            (Look::Vectors(settings), Sampled::Vectors(field)) => {
                Some(VectorLayer { field: Arc::clone(field), settings: settings.clone() })
            }
            _ => None,
        };
        shown.filter_map(vectors).collect()
    }

    /// The vectors that are drawn, and what they look like, to be changed.
    pub fn vectors_mut(&mut self) -> Vec<(Arc<VectorField>, &mut VectorSettings)> {
        let Self { layers, store, .. } = self;
        let shown = layers.iter_mut().filter(|layer| layer.is_shown);
        let both = shown.filter_map(|layer| Some((store.get(&layer.source)?, layer)));
        both.filter_map(|(samples, layer)| match (&mut layer.look, samples) {
            (Look::Vectors(settings), Sampled::Vectors(field)) => {
                Some((Arc::clone(field), settings))
            }
            _ => None,
        })
        .collect()
    }

    /// Its layers, seen as another scene is, with another field in the place of the first.
    #[must_use]
    pub fn with_other_field(
        self,
        seen_as: Self,
        source: SampleSource,
        field: impl Into<(Sampled, Look)>,
    ) -> Self {
        let Self { layers, store, phase, .. } = self;
        let mut scene = Self { layers, store, phase, ..seen_as };
        let is_field = |layer: &Layer| matches!(layer.look, Look::Field(_));
        match scene.layers.iter().position(is_field) {
            Some(at) => {
                let is_shown = scene.layers[at].is_shown;
                scene.replace(at, source, field);
                scene.layers[at].is_shown = is_shown;
            }
            None => drop(scene.add(source, field)),
        }
        scene
    }

    /// Puts other samples and another look in the place of a layer, which is drawn from now on.
    pub fn replace(
        &mut self,
        index: usize,
        source: SampleSource,
        layer: impl Into<(Sampled, Look)>,
    ) {
        let (samples, look) = layer.into();
        let source = self.store.insert(source, samples);
        if let Some(old) = self.layers.get_mut(index) {
            (old.source, old.look, old.is_shown) = (source, look, true);
        }
        self.keep(|_| true);
    }

    /// Leaves the first so many layers of vectors. Without any, the field is drawn that they may have hidden.
    pub fn keep_vectors(&mut self, count: usize) {
        let mut seen = 0;
        self.keep(|layer| {
            let is_one = matches!(layer.look, Look::Vectors(_));
            seen += usize::from(is_one);
            !is_one || seen <= count
        });
        if count == 0 {
            self.show_field(true);
        }
    }

    /// The scene without its vectors, where its mode has no place for them.
    pub fn without_vectors_refused(&self) -> Option<Self> {
        self.refusal_of(Effect::Vectors).filter(|_| !self.vectors().is_empty())?;
        let mut without = self.clone();
        without.keep_vectors(0);
        Some(without)
    }

    /// The polygons that are drawn.
    pub fn polygons(&self) -> Vec<PolygonLayer> {
        let shown = self.layers.iter().filter(|layer| layer.is_shown);
        let polygons = |layer: &Layer| match (&layer.look, self.store.get(&layer.source)?) {
            (Look::Polygons(look), Sampled::Mesh(mesh)) => {
                Some(PolygonLayer { mesh: Arc::clone(mesh), look: *look })
            }
            _ => None,
        };
        shown.filter_map(polygons).filter(|layer| layer.look.opacity > 0.0).collect()
    }

    /// All polygons, what they look like and whether they are drawn, to be changed.
    pub fn polygons_mut(&mut self) -> Vec<(Arc<Mesh>, &mut PolygonLook, &mut bool)> {
        let Self { layers, store, .. } = self;
        let both = layers.iter_mut().filter_map(|layer| Some((store.get(&layer.source)?, layer)));
        both.filter_map(|(samples, layer)| match (&mut layer.look, samples) {
            (Look::Polygons(look), Sampled::Mesh(mesh)) => {
                Some((Arc::clone(mesh), look, &mut layer.is_shown))
            }
            _ => None,
        })
        .collect()
    }

    /// Whether there are polygons, drawn or not.
    pub fn has_polygons(&self) -> bool {
        self.layers.iter().any(|layer| matches!(layer.look, Look::Polygons(_)))
    }

    /// Removes the layer of polygons of this number.
    pub fn remove_polygons(&mut self, number: usize) {
        let mut seen = 0;
        self.keep(|layer| {
            let is_one = matches!(layer.look, Look::Polygons(_));
            seen += usize::from(is_one);
            !is_one || seen != number + 1
        });
    }

    /// Those of them that its mode has a place for.
    pub fn drawn_polygons(&self) -> Vec<PolygonLayer> {
        match self.refusal_of(Effect::Polygons) {
            Some(_) => Vec::new(),
            None => self.polygons(),
        }
    }

    /// The lattice that slabs, clips and opacities go by: that of [`Scene::volume`], drawn or not; without one, of
    /// the first vectors that stand on one; else one sample in the box about all that there is.
    pub fn lattice(&self) -> Lattice {
        if let Some(volume) = self.volume() {
            return volume.lattice;
        }
        let samples = || self.layers.iter().filter_map(|layer| self.store.get(&layer.source));
        let own = samples().find_map(|samples| match samples {
            Sampled::Vectors(field) => match field.places {
                Places::Lattice(lattice) => Some(lattice),
                Places::Points { .. } => None,
            },
            _ => None,
        });
        own.unwrap_or_else(|| box_about(samples().flat_map(corners)))
    }
}

/// Two corners of the box about samples.
fn corners(samples: &Sampled) -> Vec<DVec3> {
    match samples {
        Sampled::Volume(volume) => vec![volume.lattice.centre()],
        Sampled::Vectors(field) => {
            (0..field.vectors.len()).map(|index| field.places.at(index).0).collect()
        }
        Sampled::Mesh(mesh) => mesh.bounds().map(|corner| corner.as_dvec3()).to_vec(),
    }
}

/// One sample in the box about some points, no side of which is less than a thousandth of the longest; of unit
/// size about none.
fn box_about(points: impl Iterator<Item = DVec3>) -> Lattice {
    let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = points.fold(empty, |[low, high], p| [low.min(p), high.max(p)]);
    let size = high - low;
    if !size.is_finite() {
        return Lattice::unit([1; 3]);
    }
    let least = match size.max_element() * 1e-3 {
        0.0 => 1.0,
        least => least,
    };
    let spacing = size.max(DVec3::splat(least));
    Lattice { spacing, origin: (low + high) / 2.0, ..Lattice::unit([1; 3]) }
}
