//! What no scene asks for takes no bytes and no stages, whatever the scene before it asked for.

use voxsplat::scene::{AlongRay, Amounts, ClipBox, Colours, Effect, Index, Inside};
use voxsplat::task::engine::HeldBytes;
use voxsplat::transfer::{Region, RegionShape};

use super::*;

/// A scene that asks for an effect beside all that another has. Values are 0..=1, and grow by 0.2 at most.
fn asking(effect: Effect, plain: &Scene) -> Scene {
    let mut scene = plain.clone();
    let lattice = scene.lattice();
    let amounts = |index, end| Amounts { index, points: vec![(0.0, 0.1), (end, 0.9)] };
    let stops = vec![(0.0, Srgb8([250, 30, 10])), (1.0, Srgb8([10, 60, 250]))];
    let colours = Colours { index: Index::Value, stops };
    let Scene { shading, inside, .. } = &mut scene;
    match effect {
        Effect::Shading => {
            shading.lighting = Some(Lighting::default());
            shading.modulation = Some(amounts(Index::Value, 1.0));
        }
        Effect::Gradients => shading.opacity = Some(amounts(Index::GradientStrength, 0.2)),
        Effect::Lights => shading.lighting = Some(Lighting::default()),
        Effect::Regions => {
            shading.regions = vec![Region {
                shape: RegionShape::Ellipse,
                values: [0.2, 0.9],
                strengths: [0.0, 0.2],
                softness: 0.6,
                opacity: 0.5,
                colour: None,
            }];
        }
        Effect::OpacityTable => shading.opacity = Some(amounts(Index::ViewDepth, 1.0)),
        Effect::ModulationTable => shading.modulation = Some(amounts(Index::Value, 1.0)),
        Effect::ReflectionTable => shading.reflection = Some(colours),
        Effect::EmissionTable => shading.emission = Some(colours),
        Effect::Clip => {
            inside.clip.bounds = Some(ClipBox { low: [0.0; 3], high: [0.5, 1.0, 1.0] });
        }
        Effect::Projection => inside.along = AlongRay::Maximum,
        Effect::Isosurfaces => {
            inside.isosurfaces = vec![Isosurface { value: 0.6, opacity: 0.5, colour: None }];
        }
        Effect::Slices => inside.slices = vec![Slice::across(&lattice, 2, 0.4, 0.8)],
        Effect::Vectors => scene = scene.with(winds(plain, Design::default())),
        Effect::SecondVectors => {
            scene = scene.with(winds(plain, Design::default()));
            scene.add(SampleSource::made("other"), winds(plain, Design::Comets));
        }
        Effect::Polygons => scene = scene.with(triangles(plain, &[SHARD], &[])),
    }
    scene
}

/// What a picture took: its light, the bytes that the engine held, and the names of its stages.
fn cost(engine: &Engine, scene: &Scene) -> (Vec<[f32; 4]>, HeldBytes, Vec<&'static str>) {
    let still = still(engine, scene).unwrap();
    let stages = still.passes.iter().map(|pass| pass.name).collect();
    (still.light, still.held, stages)
}

#[test]
fn effects_that_are_asked_for_no_more_leave_the_bits_the_bytes_and_the_stages_of_before() {
    let values = waves([13, 12, 14]);
    let exact = scene_of(values, &[(0.3, 0.0), (0.9, 0.6)]);
    let first = Scene { splat: SplatSettings::SHADE_FIRST, ..exact.clone() };
    let mut tried = 0;
    for plain in [exact, first] {
        let shows_inside = Inside::is_shown_by(&plain.splat);
        let engine = alone();
        let before = cost(&engine, &plain);
        for &effect in Effect::ALL {
            let asked = asking(effect, &plain);
            assert!(effect.asked_by(&asked).is_some(), "{effect:?} is not asked for");
            let is_inside = [Effect::Clip, Effect::Projection, Effect::Isosurfaces, Effect::Slices]
                .contains(&effect);
            if is_inside && !shows_inside {
                continue;
            }
            let with = drawn(&engine, &asked, [96, 64]);
            assert_eq!(with.not_native, None, "{effect:?}");
            assert!(with.light != before.0, "{effect:?} does not show");
            let again = cost(&engine, &plain);
            assert!(again.0 == before.0, "{effect:?} leaves other bits");
            assert_eq!((again.1, &again.2), (before.1, &before.2), "{effect:?} leaves something");
            tried += 1;
        }
        let HeldBytes { shading, inside, vectors, polygons, .. } = before.1;
        assert_eq!([shading, inside, vectors, polygons], [0; 4], "unasked parts take none");
    }
    // All of them in the exact mode, and all but what lets the inside be seen where samples are shaded first.
    assert_eq!(tried, 2 * Effect::ALL.len() - 4);
}
