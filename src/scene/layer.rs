//! What a scene is made of, one thing a layer: what it is called in the store, whether it is drawn, where, and how
//! it looks.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::store::{SampleSource, Sampled};
use super::{ModeError, PolygonLayer, PolygonLook, Scene};
use crate::kernel::Kernel;
use crate::transfer::{ColourMap, ColourSource, TransferFunction};
use crate::vector::VectorSettings;
use crate::volume::{Lattice, Places, ScalarVolume, VectorField};

/// Of colours for lines, the share of the range that is too dark for these.
const DARK_SHARE: f64 = 0.6;

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
    /// Whether rays meet it at places, rather than pass through it.
    pub fn is_surface(&self) -> bool {
        matches!(self, Self::Polygons(_))
    }

    /// The opacity of surfaces.
    pub fn opacity_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Polygons(look) => Some(&mut look.opacity),
            Self::Field(_) | Self::Vectors(_) => None,
        }
    }

    /// What such a layer is, in a word.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Field(_) => "field",
            Self::Vectors(_) => "vectors",
            Self::Polygons(_) => "polygons",
        }
    }
}

impl Layer {
    fn is_field(&self) -> bool {
        matches!(self.look, Look::Field(_))
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

    /// A field as it is first seen where it flows from the start.
    pub fn flowing(field: Arc<VectorField>) -> Self {
        Self { settings: VectorSettings::flowing(&field), field }
    }

    /// In colours that nothing else has that is seen with it.
    #[must_use]
    pub fn unlike<'a>(mut self, others: impl IntoIterator<Item = &'a TransferFunction>) -> Self {
        let taken: Vec<_> = others.into_iter().filter_map(|other| other.colour.map()).collect();
        if let ColourSource::Map { map, .. } = self.settings.transfer.colour
            && taken.contains(&map)
        {
            let free = [ColourMap::Viridis, ColourMap::Plasma, ColourMap::Oslo];
            let own = free.into_iter().find(|own| !taken.contains(own)).unwrap_or(map);
            let transfer = &mut self.settings.transfer;
            transfer.colour = match map {
                ColourMap::CoolWarm => brighter(transfer, own),
                // Its range leaves out what is dark already.
                _ => ColourSource::Map { map: own, range: transfer.colour.range() },
            };
        }
        self
    }

    /// Whether its vectors are seen as splats.
    pub fn shows_splats(&self) -> bool {
        self.settings.transfer.most_opacity() > 0.0
    }

    /// Shows its vectors as splats, as opaque as at first, or shows none, where lines stand for them.
    pub fn show_splats(&mut self, are_shown: bool) {
        let first = VectorSettings::for_field(&self.field).transfer.most_opacity();
        let opacity = &mut self.settings.transfer.opacity;
        match (opacity.last_mut(), are_shown) {
            (Some(last), true) => last.1 = first,
            _ => opacity.iter_mut().for_each(|point| point.1 = 0.0),
        }
    }

    /// The colours of lines along the vectors: those of their lengths. Lines would be lost among splats in the same colours: there
    /// they go from blue over green to yellow, or by plasma where splats do so.
    pub fn colours_of_lines(&self) -> TransferFunction {
        let mut transfer = self.settings.transfer.clone();
        if self.shows_splats() {
            let is_taken = transfer.colour.map() == Some(ColourMap::Viridis);
            let map = if is_taken { ColourMap::Plasma } else { ColourMap::Viridis };
            transfer.colour = brighter(&transfer, map);
        }
        transfer
    }

    /// A field as it is first seen beside another: in colours of its own, and out of step with it.
    pub fn beside_another(field: Arc<VectorField>) -> Self {
        let mut settings = VectorSettings { seed: 1, ..VectorSettings::for_field(&field) };
        settings.transfer.colour = brighter(&settings.transfer, ColourMap::Plasma);
        Self { field, settings }
    }
}

/// A map that begins in the dark, over the range that a function's colours have, without its darkest colours.
fn brighter(transfer: &TransferFunction, map: ColourMap) -> ColourSource {
    let [low, high] = transfer.colour.range();
    ColourSource::Map { map, range: [low - DARK_SHARE * (high - low), high] }
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

/// What rays meet at places.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// Triangles.
    Polygons(PolygonLayer),
}

impl Surface {
    /// Its name, for people.
    pub fn name(&self) -> &str {
        match self {
            Self::Polygons(layer) => layer.mesh.name(),
        }
    }
}

/// Whether a volume can be drawn with a kernel: one of its samples, or what it has besides.
pub fn offers(volume: &ScalarVolume, kernel: Kernel) -> bool {
    match kernel {
        Kernel::Functions => volume.functions.is_some(),
        Kernel::Cells => volume.cells.is_some(),
        Kernel::Ellipsoids => volume.scattered.is_some(),
        _ => true,
    }
}

impl Scene {
    /// Adds a layer that is drawn, at its own place.
    pub fn add(&mut self, source: SampleSource, layer: impl Into<(Sampled, Look)>) {
        let (samples, look) = layer.into();
        let source = self.store.insert(source, samples);
        self.layers.push(Layer { source, is_shown: true, placement: DAffine3::IDENTITY, look });
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
        let refuse = |expected, found, advice| Err(ModeError { expected, found, advice });
        let shown = || self.layers.iter().filter(|layer| layer.is_shown);
        let fields = shown().filter(|layer| layer.is_field()).count();
        if fields > 1 {
            return refuse("one field of values at most", fields.to_string(), "hide the others");
        }
        let kernel = self.splat.kernel;
        if fields == 1
            && let Some(volume) = self.volume().filter(|volume| !offers(volume, kernel))
        {
            let found = format!("\"{}\", which has none", volume.name);
            let (expected, advice) = match kernel {
                Kernel::Functions => (
                    "a field that is encoded as basis functions, with --kernel functions",
                    "encode it (voxsplat encode), or choose another --kernel",
                ),
                Kernel::Ellipsoids => (
                    "a field of scattered points, or on cells, with --kernel ellipsoids",
                    "choose another --kernel",
                ),
                _ => (
                    "a field on the cells of an unstructured or curvilinear grid, with --kernel cells",
                    "choose another --kernel",
                ),
            };
            return refuse(expected, found, advice);
        }
        for layer in shown() {
            let name = format!("{} \"{}\"", layer.look.kind(), layer.source.field);
            if layer.placement != DAffine3::IDENTITY {
                let (expected, found) = ("every layer where its file says", " moved elsewhere");
                return refuse(expected, name + found, "leave its placement out");
            }
            if self.store.get(&layer.source).is_none() {
                let (expected, found) = ("samples of every layer that is drawn", " without any");
                return refuse(expected, name + found, "open its file, or hide the layer");
            }
        }
        Ok(())
    }

    /// Takes a layer away.
    pub fn remove(&mut self, index: usize) {
        if index < self.layers.len() {
            self.layers.remove(index);
        }
        self.keep(|_| true);
    }

    /// Leaves only the layers that are wanted, and lets go of the samples of the others.
    pub fn keep(&mut self, is_wanted: impl FnMut(&Layer) -> bool) {
        self.layers.retain(is_wanted);
        let layers = &self.layers;
        self.store.retain(|source| layers.iter().any(|layer| layer.source == *source));
    }

    /// The layer of the field that panels, clips and opacities speak of: the first that is drawn, else the first.
    fn field_index(&self) -> Option<usize> {
        let shown = self.layers.iter().position(|layer| layer.is_field() && layer.is_shown);
        shown.or_else(|| self.layers.iter().position(Layer::is_field))
    }

    /// The samples of the field that is drawn, or was hidden.
    pub fn volume(&self) -> Option<&Arc<ScalarVolume>> {
        match self.store.get(&self.layers[self.field_index()?].source)? {
            Sampled::Volume(volume) => Some(volume),
            _ => None,
        }
    }

    /// Puts other samples, or functions beside them, in the place of [`Scene::volume`]'s. All else stays.
    pub fn set_volume(&mut self, volume: Arc<ScalarVolume>) {
        if let Some(index) = self.field_index() {
            let source = self.layers[index].source.clone();
            self.store.retain(|held| *held != source);
            self.layers[index].source = self.store.insert(source, Sampled::Volume(volume));
        }
    }

    /// What the mode draws in the place of samples, where it does, and how many there are.
    pub fn own_kernels(&self) -> Option<(Kernel, u64)> {
        let (volume, kernel) = (self.volume()?, self.splat.kernel);
        let count = match kernel {
            Kernel::Functions => volume.functions.as_ref()?.functions().len(),
            Kernel::Cells => volume.cells.as_ref()?.cells().solids().len(),
            Kernel::Ellipsoids => volume.scattered.as_ref()?.count(),
            _ => return None,
        };
        Some((kernel, count as u64))
    }

    /// How many of the functions that it is drawn from are left out everywhere, and what they are thought to be, rms, in the
    /// units of values; `None` where none may be.
    pub fn left_out_functions(&self) -> Option<(u64, f64)> {
        Some(self.splat.limits().max_rms).filter(|rms| *rms > 0.0).and_then(|rms| self.without(rms))
    }

    /// The same of its quick pictures, where these are of functions.
    pub fn left_out_of_quick(&self) -> Option<(u64, f64)> {
        self.splat.quick_limits().and_then(|limits| self.without(limits.max_rms))
    }

    fn without(&self, max_rms: f64) -> Option<(u64, f64)> {
        let (count, rms) = self.volume()?.functions.as_ref()?.left_out(max_rms);
        Some((count as u64, rms))
    }

    /// Its samples; 0 where there is none.
    pub fn voxel_count(&self) -> u64 {
        self.volume().map_or(0, |volume| volume.lattice.len() as u64)
    }

    /// Whether both are of the same volume, rather than of equal ones.
    pub fn has_same_volume(&self, other: &Self) -> bool {
        self.volume().map(Arc::as_ptr) == other.volume().map(Arc::as_ptr)
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
        self.layers.iter().any(|layer| layer.is_field() && layer.is_shown)
    }

    /// Draws the fields of values, or leaves them out.
    pub fn show_field(&mut self, is_shown: bool) {
        let fields = self.layers.iter_mut().filter(|layer| layer.is_field());
        fields.for_each(|layer| layer.is_shown = is_shown);
    }

    /// The vectors that are drawn.
    pub fn vectors(&self) -> Vec<VectorLayer> {
        let shown = self.sampled().filter(|(layer, _)| layer.is_shown);
        let vectors = |(layer, samples): (&Layer, &Sampled)| match (&layer.look, samples) {
            (Look::Vectors(settings), Sampled::Vectors(field)) => {
                Some(VectorLayer { field: Arc::clone(field), settings: settings.clone() })
            }
            _ => None,
        };
        shown.filter_map(vectors).collect()
    }

    /// The layers whose samples are there, with these.
    fn sampled(&self) -> impl Iterator<Item = (&Layer, &Sampled)> {
        self.layers.iter().filter_map(|layer| Some((layer, self.store.get(&layer.source)?)))
    }

    /// The same, to be changed.
    fn sampled_mut(&mut self) -> impl Iterator<Item = (&mut Layer, &Sampled)> {
        let Self { layers, store, .. } = self;
        layers.iter_mut().filter_map(|layer| {
            let samples = store.get(&layer.source)?;
            Some((layer, samples))
        })
    }

    /// The vectors that are drawn, and what they look like, to be changed.
    pub fn vectors_mut(&mut self) -> Vec<(Arc<VectorField>, &mut VectorSettings)> {
        let shown = self.sampled_mut().filter(|(layer, _)| layer.is_shown);
        let vectors = shown.filter_map(|(layer, samples)| match (&mut layer.look, samples) {
            (Look::Vectors(settings), Sampled::Vectors(field)) => {
                Some((Arc::clone(field), settings))
            }
            _ => None,
        });
        vectors.collect()
    }

    /// Shows vectors as splats, where none of their layers does.
    pub fn show_vector_splats(&mut self) {
        let shown = self.vectors();
        if shown.iter().any(VectorLayer::shows_splats) {
            return;
        }
        for ((_, settings), mut layer) in self.vectors_mut().into_iter().zip(shown) {
            layer.show_splats(true);
            *settings = layer.settings;
        }
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
        match scene.layers.iter().position(Layer::is_field) {
            Some(at) => {
                let is_shown = scene.layers[at].is_shown;
                scene.replace(at, source, field);
                scene.layers[at].is_shown = is_shown;
            }
            None => scene.add(source, field),
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

    /// The polygons that are drawn.
    pub fn polygons(&self) -> Vec<PolygonLayer> {
        let shown = self.sampled().filter(|(layer, _)| layer.is_shown);
        let polygons = |(layer, samples): (&Layer, &Sampled)| match (&layer.look, samples) {
            (Look::Polygons(look), Sampled::Mesh(mesh)) => Some(self.in_field_colours(mesh, *look)),
            _ => None,
        };
        shown.filter_map(polygons).filter(|layer| layer.look.opacity > 0.0).collect()
    }

    /// What rays meet at places, of all kinds, whether its mode has a place for that or not.
    pub fn surfaces(&self) -> Vec<Surface> {
        self.polygons().into_iter().map(Surface::Polygons).collect()
    }

    /// The lattice that slabs, clips and opacities go by: that of [`Scene::volume`], drawn or not; without one, of
    /// the first vectors that stand on one; else one sample in the box about all that there is.
    pub fn lattice(&self) -> Lattice {
        if let Some(volume) = self.volume() {
            return volume.lattice;
        }
        let own = self.sampled().find_map(|(_, samples)| match samples {
            Sampled::Vectors(field) => match field.places {
                Places::Lattice(lattice) => Some(lattice),
                Places::Points { .. } => None,
            },
            _ => None,
        });
        own.unwrap_or_else(|| box_about(self.sampled().flat_map(|(_, samples)| corners(samples))))
    }
}

/// Two corners of the box about samples.
fn corners(samples: &Sampled) -> Vec<DVec3> {
    match samples {
        Sampled::Volume(volume) => vec![volume.lattice.centre()],
        Sampled::Vectors(field) => {
            (0..field.vectors.len()).map(|index| field.places.at(index).0).collect()
        }
        Sampled::Mesh(mesh) => mesh.bounds().to_vec(),
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::core::Ticket;

    #[test]
    fn lines_have_the_colours_of_their_splats_but_among_these() {
        let places = Places::Lattice(Lattice::unit([2; 3]));
        let vectors = (1..9).map(|i| Vec3::X * i as f32).collect();
        let field = VectorField::new("wind", places, vectors, &Ticket::new()).expect("a field");
        let mut layer = VectorLayer::new(Arc::new(field));
        let own = |map| ColourSource::Map { map, range: [1.0, 6.0] };
        layer.settings.transfer.colour = own(ColourMap::Plasma);
        let among = |layer: &VectorLayer| layer.colours_of_lines().colour;
        let brighter = |map| ColourSource::Map { map, range: [-2.0, 6.0] };
        assert_eq!(among(&layer), brighter(ColourMap::Viridis));
        layer.settings.transfer.colour = own(ColourMap::Viridis);
        assert_eq!(among(&layer), brighter(ColourMap::Plasma));
        let before = layer.settings.transfer.clone();
        layer.show_splats(false);
        assert!(!layer.shows_splats());
        assert_eq!(layer.colours_of_lines(), layer.settings.transfer, "alone they have their own");
        layer.show_splats(true);
        assert_eq!(layer.settings.transfer, before);
    }
}
