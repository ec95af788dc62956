//! What a scene may ask for beside its transfer function and its mode, part by part.

use super::{AlongRay, Clip, Scene, Shading};

/// A part that can be left out. Gradients are none: they come and go with what asks for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Every shading table, region and light together.
    Shading,
    /// Lights.
    Lights,
    /// Regions of value and gradient strength.
    Regions,
    /// Opacities by another index than the value.
    OpacityTable,
    /// What extinctions are multiplied by.
    ModulationTable,
    /// Colours by another index than the value.
    ReflectionTable,
    /// Light that is there without lights.
    EmissionTable,
    /// Parts that are cut away.
    Clip,
    /// A value of each ray in place of its light.
    Projection,
    /// Surfaces where values pass a level.
    Isosurfaces,
    /// Planes that show the values on them.
    Slices,
    /// Vector splats.
    Vectors,
    /// Those of the second field among them.
    SecondVectors,
    /// Triangles of files, streamlines and arrows.
    Polygons,
}

impl Effect {
    /// Every one.
    pub const ALL: &[Self] = &[
        Self::Shading,
        Self::Lights,
        Self::Regions,
        Self::OpacityTable,
        Self::ModulationTable,
        Self::ReflectionTable,
        Self::EmissionTable,
        Self::Clip,
        Self::Projection,
        Self::Isosurfaces,
        Self::Slices,
        Self::Vectors,
        Self::SecondVectors,
        Self::Polygons,
    ];

    /// The name of [`Scene::effects`] and scripts; that of the shading as a whole is none of those.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shading => "shading",
            Self::Lights => "lights",
            Self::Regions => "regions",
            Self::OpacityTable => "opacity table",
            Self::ModulationTable => "modulation table",
            Self::ReflectionTable => "reflection table",
            Self::EmissionTable => "emission table",
            Self::Clip => "clip",
            Self::Projection => "projection",
            Self::Isosurfaces => "isosurfaces",
            Self::Slices => "slices",
            Self::Vectors => "vectors",
            Self::SecondVectors => "second vectors",
            Self::Polygons => "polygons",
        }
    }

    /// The scene without it; `None` where that would make the same picture, or none.
    pub fn left_out_of(self, scene: &Scene) -> Option<Scene> {
        if self == Self::Vectors && scene.hides_field() {
            return None;
        }
        let mut other = scene.clone();
        let (shading, inside) = (&mut other.shading, &mut other.inside);
        match self {
            Self::Shading => *shading = Shading::default(),
            Self::Lights => shading.lighting = None,
            Self::Regions => shading.regions.clear(),
            Self::OpacityTable => shading.opacity = None,
            Self::ModulationTable => shading.modulation = None,
            Self::ReflectionTable => shading.reflection = None,
            Self::EmissionTable => shading.emission = None,
            Self::Clip => inside.clip = Clip::default(),
            Self::Projection => inside.along = AlongRay::Composite,
            Self::Isosurfaces => inside.isosurfaces.clear(),
            Self::Slices => inside.slices.clear(),
            Self::Vectors => other.vectors = None,
            Self::SecondVectors => {
                if let Some(layer) = &mut other.vectors {
                    layer.second = None;
                }
            }
            Self::Polygons => other.polygons.clear(),
        }
        (!other.makes_same_picture(scene)).then_some(other)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::core::Ticket;
    use crate::scene::{Amounts, ClipBox, Index, Lighting, SecondVectors, VectorLayer, opening};
    use crate::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

    #[test]
    fn every_effect_that_a_scene_names_can_be_left_out_and_no_other() {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let plain = opening(Arc::new(volume), None);
        assert!(Effect::ALL.iter().all(|effect| effect.left_out_of(&plain).is_none()));
        let mut scene = plain;
        scene.shading.lighting = Some(Lighting::default());
        let points = vec![(0.0, 0.5)];
        scene.shading.modulation = Some(Amounts { index: Index::Value, points });
        scene.inside.clip.bounds = Some(ClipBox { low: [0.0; 3], high: [0.5; 3] });
        let vectors = vec![glam::Vec3::X; 8].into();
        let places = Places::Lattice(Lattice::unit([2; 3]));
        let field = VectorField::new("v", places, vectors, &Ticket::new()).unwrap();
        let field = Arc::new(field);
        let mut layer = VectorLayer::new(Arc::clone(&field), false);
        layer.second = Some(SecondVectors::new(field));
        scene.vectors = Some(layer);
        let named = scene.effects();
        assert_eq!(
            named,
            ["gradients", "lights", "modulation table", "clip", "vectors", "second vectors"]
        );
        for effect in Effect::ALL {
            let is_named = named.contains(&effect.name()) || *effect == Effect::Shading;
            let without = effect.left_out_of(&scene);
            assert_eq!(without.is_some(), is_named, "{effect:?}");
            assert!(without.is_none_or(|other| !other.effects().contains(&effect.name())));
        }
    }
}
