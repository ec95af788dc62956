//! Polygons in the colours of the field that they lie in: the field's values at their corners, which are found elsewhere, kept
//! beside the samples, and let go of where the field or the mesh is another.

use std::sync::{Arc, Weak};

use super::{
    Classify, Layer, Look, PolygonLayer, PolygonLook, Reconstruction, Sampled, Scene,
    SplatSettings, Store,
};
use crate::kernel::Kernel;
use crate::polygons::Mesh;
use crate::rbf::Limits;
use crate::volume::ScalarVolume;

/// Values of one mesh that are kept at most: in two modes that are compared.
const MOST_KEPT: usize = 2;

/// What reconstructs values: a kernel, its extent, whether samples are sharpened first, and what of basis functions is left out.
type Between = (Kernel, Option<f64>, Reconstruction, Limits);

/// Which values are at a mesh's corners: of which field, reconstructed how.
#[derive(Debug, Clone)]
pub struct MeshInField {
    volume: Weak<ScalarVolume>,
    mesh: Weak<Mesh>,
    between: Between,
}

impl PartialEq for MeshInField {
    /// The same field and mesh, not equal ones.
    fn eq(&self, other: &Self) -> bool {
        self.is_of_same(other) && self.between == other.between
    }
}

impl MeshInField {
    fn of(volume: &Arc<ScalarVolume>, mesh: &Arc<Mesh>, splat: &SplatSettings) -> Self {
        let (volume, mesh) = (Arc::downgrade(volume), Arc::downgrade(mesh));
        Self { volume, mesh, between: splat.values_between() }
    }

    /// Whether both are of the same field on the same mesh.
    fn is_of_same(&self, other: &Self) -> bool {
        self.volume.ptr_eq(&other.volume) && self.mesh.ptr_eq(&other.mesh)
    }

    /// The mesh as it was given, if it is still there.
    pub fn mesh(&self) -> Option<Arc<Mesh>> {
        self.mesh.upgrade()
    }
}

/// A mesh whose first array is the field's values at its corners, NaN where it has none, and which mesh of a scene it stands for.
#[derive(Debug, Clone)]
pub struct FieldOnMesh {
    /// What it stands for.
    pub of: MeshInField,
    /// The same surface, cut as finely as the field asks for.
    pub mesh: Arc<Mesh>,
}

impl SplatSettings {
    /// What reconstructs values between samples: modes that colour samples first have none, and are asked as the exact mode
    /// reconstructs, by interpolating B-splines.
    fn values_between(&self) -> Between {
        match self.classify {
            Classify::Before => {
                (Kernel::BSpline, None, Reconstruction::Interpolating, Limits::NONE)
            }
            _ => (self.kernel, self.extent, self.reconstruction, self.limits()),
        }
    }
}

impl Store {
    /// Takes in values of the field on a mesh, in the place of such as nobody asks for any more.
    fn insert_values(&mut self, values: FieldOnMesh) {
        let kept = |one: &FieldOnMesh| {
            let is_there = one.of.volume.strong_count() > 0 && one.of.mesh.strong_count() > 0;
            is_there && one.of != values.of
        };
        self.on_meshes.retain(kept);
        self.on_meshes.push(values);
        let newest = self.on_meshes.len() - 1;
        let is_same = |at: &usize| self.on_meshes[*at].of.is_of_same(&self.on_meshes[newest].of);
        let of_same: Vec<usize> = (0..=newest).filter(is_same).collect();
        if of_same.len() > MOST_KEPT {
            self.on_meshes.remove(of_same[0]);
        }
    }
}

impl Scene {
    /// The meshes that are drawn in the field's colours and lack its values.
    pub fn lacking_field_values(&self) -> Vec<MeshInField> {
        let Some(volume) = self.volume() else { return Vec::new() };
        let shown = self.layers.iter().filter(|layer| layer.is_shown);
        let wanted =
            shown.filter_map(|layer| match (&layer.look, self.store.get(&layer.source)?) {
                (Look::Polygons(PolygonLook { by_field: true, .. }), Sampled::Mesh(mesh)) => {
                    Some(MeshInField::of(volume, mesh, &self.splat))
                }
                _ => None,
            });
        let is_there = |of: &MeshInField| self.store.on_meshes.iter().any(|one| one.of == *of);
        wanted.filter(|of| !is_there(of)).collect()
    }

    /// Takes in values that it lacked.
    pub fn give_field_values(&mut self, values: FieldOnMesh) {
        self.store.insert_values(values);
    }

    /// Lets go of the field's values on all meshes.
    pub fn forget_field_values(&mut self) {
        self.store.on_meshes.clear();
    }

    /// Polygons as they look: in the field's colours where they are to be, and its values are known, if only of another mode.
    pub(super) fn in_field_colours(&self, mesh: &Arc<Mesh>, look: PolygonLook) -> PolygonLayer {
        // The function as it was chosen: where values are projected there are no surfaces.
        let coloured = self.values_on(mesh, look).zip(self.transfer());
        match coloured {
            Some((values, transfer)) => PolygonLayer {
                mesh: Arc::clone(&values.mesh),
                look,
                field_colours: Some(transfer.colour.clone()),
            },
            None => PolygonLayer { mesh: Arc::clone(mesh), look, field_colours: None },
        }
    }

    /// The field's values on the mesh of a layer, where it is drawn by them: which, rather than what they are.
    pub(super) fn mesh_with_values(&self, layer: &Layer) -> Option<*const Mesh> {
        match (&layer.look, self.store.get(&layer.source)?) {
            (Look::Polygons(look), Sampled::Mesh(mesh)) => {
                self.values_on(mesh, *look).map(|values| Arc::as_ptr(&values.mesh))
            }
            _ => None,
        }
    }

    fn values_on(&self, mesh: &Arc<Mesh>, look: PolygonLook) -> Option<&FieldOnMesh> {
        let volume = self.volume().filter(|_| look.by_field)?;
        let wanted = MeshInField::of(volume, mesh, &self.splat);
        let of_both = || self.store.on_meshes.iter().rev().filter(|one| one.of.is_of_same(&wanted));
        of_both().find(|one| one.of == wanted).or_else(|| of_both().next())
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::core::Srgb8;
    use crate::polygons::{MeshArray, MeshValues};
    use crate::scene::{POLYGON_COLOUR, SampleSource, opening};
    use crate::transfer::{ColourMap, ColourSource};
    use crate::volume::{Lattice, Samples};

    fn volume() -> Arc<ScalarVolume> {
        let samples = Samples::Float32((0..8).map(|i| i as f32).collect());
        Arc::new(ScalarVolume::from_samples("v", Lattice::unit([2; 3]), samples).unwrap())
    }

    fn triangle() -> Mesh {
        let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        Mesh::new("m", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap()
    }

    /// A triangle in the field's colours, black to white from 0 to 7.
    fn scene() -> Scene {
        let mut scene = opening(SampleSource::made("v"), volume(), None);
        scene.transfer_mut().unwrap().colour =
            ColourSource::Map { map: ColourMap::Gray, range: [0.0, 7.0] };
        let mut layer = PolygonLayer::new(Arc::new(triangle()));
        layer.look.by_field = true;
        scene.add(SampleSource::made("m"), layer);
        scene
    }

    fn values(of: MeshInField) -> FieldOnMesh {
        let values = MeshValues::Corners(vec![0.0, 7.0, f32::NAN]);
        let array = MeshArray { name: "v".into(), values };
        FieldOnMesh { of, mesh: Arc::new(triangle().with_arrays(vec![array]).unwrap()) }
    }

    fn colours(scene: &Scene) -> [Srgb8; 3] {
        scene.polygons()[0].triangles().next().unwrap().1
    }

    #[test]
    fn values_colour_corners_by_the_transfer_function_and_where_there_are_none_plainly() {
        let mut scene = scene();
        assert_eq!(colours(&scene), [POLYGON_COLOUR; 3], "not known yet");
        let [of] = &scene.lacking_field_values()[..] else { panic!("one mesh") };
        let before = scene.clone();
        scene.give_field_values(values(of.clone()));
        assert!(scene.lacking_field_values().is_empty());
        assert!(!scene.makes_same_picture(&before), "it is to be drawn again");
        assert_eq!(colours(&scene), [Srgb8([0; 3]), Srgb8([255; 3]), POLYGON_COLOUR]);
        // The function alone asks for no other values.
        let coloured = scene.polygons();
        scene.transfer_mut().unwrap().colour =
            ColourSource::Map { map: ColourMap::Gray, range: [7.0, 0.0] };
        assert!(scene.lacking_field_values().is_empty() && scene.polygons() != coloured);
        assert_eq!(colours(&scene)[..2], [Srgb8([255; 3]), Srgb8([0; 3])]);
        scene.forget_field_values();
        assert_eq!(colours(&scene), [POLYGON_COLOUR; 3]);
    }

    #[test]
    fn another_field_has_other_values_and_another_mode_shows_the_last_ones_until_it_has_its_own() {
        let mut scene = scene();
        let of = scene.lacking_field_values().remove(0);
        scene.give_field_values(values(of.clone()));
        scene.splat = SplatSettings { kernel: Kernel::Linear, ..scene.splat };
        let linear = scene.lacking_field_values();
        assert!(linear.len() == 1 && linear[0] != of);
        assert_eq!(colours(&scene)[0], Srgb8([0; 3]));
        scene.give_field_values(values(linear[0].clone()));
        assert_eq!(scene.store.on_meshes.len(), 2, "both may be compared");
        // Modes that colour samples first are asked as the exact one is.
        scene.splat = SplatSettings::SHADE_FIRST;
        assert!(scene.lacking_field_values().is_empty());
        scene.set_volume(volume());
        assert_eq!((colours(&scene), scene.lacking_field_values().len()), ([POLYGON_COLOUR; 3], 1));
        let of = scene.lacking_field_values().remove(0);
        scene.give_field_values(values(of));
        assert_eq!(scene.store.on_meshes.len(), 1, "those of the old field are let go of");
    }
}
