//! What a scene may ask for beside its transfer function and its mode, part by part.

use super::{AlongRay, Clip, Index, Lighting, Scene, Shading, Surface};
use crate::core::{counted, names};

/// A part that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Every shading table, region and light together.
    Shading,
    /// How values change about each point; they come and go with what asks for them.
    Gradients,
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

names!(Effect {
    Shading => "shading",
    Gradients => "gradients",
    Lights => "lights",
    Regions => "regions",
    OpacityTable => "opacity table",
    ModulationTable => "modulation table",
    ReflectionTable => "reflection table",
    EmissionTable => "emission table",
    Clip => "clip",
    Projection => "projection",
    Isosurfaces => "isosurfaces",
    Slices => "slices",
    Vectors => "vectors",
    SecondVectors => "second vectors",
    Polygons => "polygons",
});

impl Effect {
    /// Names one after the other; `None` where there are none.
    fn listed(effects: &[Self]) -> Option<String> {
        let names: Vec<_> = effects.iter().map(|effect| effect.name()).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }

    /// What of a scene asks for it, in a few words; `None` where nothing does.
    pub fn asked_by(self, scene: &Scene) -> Option<String> {
        let Scene { shading, inside, .. } = scene;
        let Shading { opacity, modulation, reflection, emission, lighting, regions } = shading;
        let by = |index: Index| format!("by {}", index.name().replace('-', " "));
        let counted = |count: usize, one: &str| (count > 0).then(|| counted(count, one));
        match self {
            Self::Shading => Self::listed(&shading.effects()),
            Self::Gradients => Self::listed(&askers_of_gradients(shading)),
            Self::Lights if lighting.as_ref().is_some_and(Lighting::is_first_look) => {
                Some("first look".to_owned())
            }
            Self::Lights => lighting.as_ref().map(|lighting| {
                counted(lighting.lights.len(), "light")
                    .unwrap_or_else(|| "ambient light".to_owned())
            }),
            Self::Regions if shading.painted().is_empty() => None,
            Self::Regions => counted(regions.len(), "region"),
            Self::OpacityTable => opacity.as_ref().map(|table| by(table.index)),
            Self::ModulationTable => modulation.as_ref().map(|table| by(table.index)),
            Self::ReflectionTable => reflection.as_ref().map(|table| by(table.index)),
            Self::EmissionTable => emission.as_ref().map(|table| by(table.index)),
            Self::Clip if !inside.clip.cuts() => None,
            Self::Clip => {
                let Clip { bounds, planes, .. } = &inside.clip;
                let parts = bounds.map(|_| "a box".to_owned()).into_iter();
                let parts: Vec<_> = parts.chain(counted(planes.len(), "plane")).collect();
                Some(parts.join(" and "))
            }
            Self::Projection => {
                (inside.along != AlongRay::Composite).then(|| inside.along.name().to_owned())
            }
            Self::Isosurfaces => counted(inside.isosurfaces.len(), "level"),
            Self::Slices => counted(inside.slices.len(), "plane"),
            Self::Vectors => scene.vectors().first().map(|layer| layer.field.name.clone()),
            Self::SecondVectors => scene.vectors().get(1).map(|layer| layer.field.name.clone()),
            Self::Polygons => {
                let surfaces = scene.surfaces();
                let names: Vec<_> = surfaces.iter().map(Surface::name).collect();
                Some(names.join(", ")).filter(|_| !names.is_empty())
            }
        }
    }

    /// Whether it is a table or a light.
    pub fn is_of_shading(self) -> bool {
        use Effect::*;
        let tables = [OpacityTable, ModulationTable, ReflectionTable, EmissionTable];
        matches!(self, Gradients | Lights | Regions) || tables.contains(&self)
    }

    /// The scene without it; `None` where that would make the same picture, or none.
    pub fn left_out_of(self, scene: &Scene) -> Option<Scene> {
        if self == Self::Vectors && !scene.shows_field() {
            return None;
        }
        let mut other = scene.clone();
        let (shading, inside) = (&mut other.shading, &mut other.inside);
        match self {
            Self::Shading => *shading = Shading::default(),
            Self::Gradients => {
                shading.lighting.take_if(|lighting| lighting.uses_lights());
                shading.regions.clear();
                shading.opacity.take_if(|table| table.index.is_of_gradient());
                shading.modulation.take_if(|table| table.index.is_of_gradient());
                shading.reflection.take_if(|table| table.index.is_of_gradient());
                shading.emission.take_if(|table| table.index.is_of_gradient());
            }
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
            // The field takes their place where they had its.
            Self::Vectors => other.keep_vectors(0),
            Self::SecondVectors => other.keep_vectors(1),
            Self::Polygons => other.keep(|layer| !layer.look.is_surface()),
        }
        (!other.makes_same_picture(scene)).then_some(other)
    }
}

/// What of a scene's shading looks at gradients.
fn askers_of_gradients(shading: &Shading) -> Vec<Effect> {
    let Shading { opacity, modulation, reflection, emission, lighting, .. } = shading;
    let of = |index: Option<Index>| index.is_some_and(Index::is_of_gradient);
    let askers = [
        (lighting.as_ref().is_some_and(Lighting::uses_lights), Effect::Lights),
        (!shading.painted().is_empty(), Effect::Regions),
        (of(opacity.as_ref().map(|table| table.index)), Effect::OpacityTable),
        (of(modulation.as_ref().map(|table| table.index)), Effect::ModulationTable),
        (of(reflection.as_ref().map(|table| table.index)), Effect::ReflectionTable),
        (of(emission.as_ref().map(|table| table.index)), Effect::EmissionTable),
    ];
    askers.into_iter().filter_map(|(asks, effect)| asks.then_some(effect)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::core::Ticket;
    use crate::scene::{Amounts, ClipBox, Index, Lighting, SampleSource, VectorLayer, opening};
    use crate::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

    #[test]
    fn every_effect_that_a_scene_names_can_be_left_out_and_no_other() {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let plain = opening(SampleSource::default(), Arc::new(volume), None);
        assert!(Effect::ALL.iter().all(|effect| effect.asked_by(&plain).is_none()));
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
        let first = VectorLayer::new(Arc::clone(&field));
        let scene = scene.with(first).with(VectorLayer::beside_another(field));
        let named = scene.effects();
        let names: Vec<_> = named.iter().map(|effect| effect.name()).collect();
        assert_eq!(
            names,
            ["gradients", "lights", "modulation table", "clip", "vectors", "second vectors"]
        );
        for effect in Effect::ALL {
            let is_named = named.contains(effect) || *effect == Effect::Shading;
            let without = effect.left_out_of(&scene);
            assert_eq!(without.is_some(), is_named, "{effect:?}");
            assert_eq!(effect.asked_by(&scene).is_some(), is_named, "{effect:?}");
            assert!(without.is_none_or(|other| !other.effects().contains(effect)));
        }
    }

    #[test]
    fn what_asks_is_said_in_words() {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
        let by = |effect: Effect, scene: &Scene| effect.asked_by(scene).unwrap_or_default();
        let amounts = |index| Some(Amounts { index, points: vec![(0.0, 0.5)] });
        scene.shading.modulation = amounts(Index::ViewDepth);
        assert_eq!(by(Effect::Gradients, &scene), "");
        assert_eq!(Effect::Gradients.left_out_of(&scene).map(drop), None);
        assert_eq!(by(Effect::ModulationTable, &scene), "by view depth");
        scene.shading.opacity = amounts(Index::GradientElevation);
        scene.shading.lighting = Some(Lighting::default());
        assert_eq!(by(Effect::Gradients, &scene), "lights, opacity table");
        assert_eq!(by(Effect::Lights, &scene), "1 light");
        scene.shading.lighting = Some(Lighting::first_look());
        assert_eq!(by(Effect::Lights, &scene), "first look");
        let without = Effect::Gradients.left_out_of(&scene).expect("they are asked for");
        assert_eq!(without.shading.effects(), [Effect::ModulationTable]);
        let plane = crate::scene::Plane { point: glam::DVec3::ZERO, normal: glam::DVec3::X };
        scene.inside.clip.planes = vec![plane; 2];
        assert_eq!(by(Effect::Clip, &scene), "2 planes");
        scene.inside.clip.bounds = Some(ClipBox { low: [0.0; 3], high: [0.5; 3] });
        assert_eq!(by(Effect::Clip, &scene), "a box and 2 planes");
    }
}
