//! Scenes as text: what is saved comes back, samples are found again by name, and the rest is refused.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use proptest::prelude::*;

use voxsplat::core::{Camera, Projection, Srgb8};
use voxsplat::scene::{
    AlongRay, Background, ByArray, ClipBox, Colours, Index, Isosurface, Layer, Lighting, Look,
    PolygonLook, SampleSource, Sampled, SavedError, Scene, Slice, SplatSettings,
};
use voxsplat::transfer::{ColourMap, ColourSource, NoData, TransferFunction};
use voxsplat::vector::{ColourBy, VectorMode, VectorSettings};
use voxsplat::volume::{Component, Lattice, Samples, ScalarVolume, Statistics};

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-1e3..1e3, Just(1e300), Just(-1e-300), Just(0.1), Just(f64::MIN_POSITIVE)]
}

fn source() -> impl Strategy<Value = SampleSource> {
    let part = prop_oneof![
        Just(None),
        Just(Some(Component::Magnitude)),
        (0_usize..9).prop_map(|i| Some(Component::Index(i)))
    ];
    (".{0,12}", "[^\0]{0,12}", part, 0_u32..3).prop_map(|(field, path, component, copy)| {
        SampleSource { path: PathBuf::from(path), field, component, copy }
    })
}

fn transfer() -> impl Strategy<Value = TransferFunction> {
    let points = prop::collection::vec((number(), 0.0..1.0), 1..5);
    (points, number(), number()).prop_map(|(opacity, low, high)| {
        let colour = ColourSource::Map { map: ColourMap::Viridis, range: [low, high] };
        let no_data = NoData { opacity: 0.5, colour: Srgb8([1, 2, 3]) };
        TransferFunction { no_data, ..TransferFunction::of(opacity, colour) }
    })
}

fn look() -> impl Strategy<Value = Look> {
    let vectors = (transfer(), 1.0..8.0, any::<u64>()).prop_map(|(transfer, stretch, seed)| {
        let samples = Samples::UInt8(vec![1, 2]);
        let lengths = Statistics::of(&samples, &Default::default()).expect("sound");
        let settings = VectorSettings::for_lengths(&lengths);
        let (colour_by, mode, marks) = (ColourBy::Scalar, VectorMode::Blend, Some(Srgb8([9; 3])));
        Look::Vectors(VectorSettings {
            transfer,
            stretch,
            seed,
            colour_by,
            mode,
            marks,
            ..settings
        })
    });
    let by = any::<Option<usize>>().prop_map(|array| {
        array.map(|array| ByArray { array, map: ColourMap::Batlow, range: [-1.5, 1e300] })
    });
    let flags = any::<[bool; 2]>();
    let polygons = (0.0..1.0, flags, any::<Option<[u8; 3]>>(), by).prop_map(
        |(opacity, [is_smooth, by_field], colour, by)| {
            let colour = colour.map(Srgb8);
            Look::Polygons(PolygonLook { colour, by, by_field, opacity, is_smooth })
        },
    );
    prop_oneof![transfer().prop_map(Look::Field), vectors, polygons]
}

fn layer() -> impl Strategy<Value = Layer> {
    (source(), any::<bool>(), look(), number()).prop_map(|(source, is_shown, look, x)| {
        let placement = DAffine3::from_axis_angle(DVec3::Y, 0.3);
        let placement = DAffine3::from_translation(DVec3::X * x) * placement;
        Layer { source, is_shown, placement, look }
    })
}

fn scene() -> impl Strategy<Value = Scene> {
    let layers = prop::collection::vec(layer(), 0..4);
    (layers, number(), number(), any::<bool>()).prop_map(|(layers, phase, at, lit)| {
        let camera = Camera::new(DVec3::splat(at), DVec3::new(0.3, 0.4, -0.5), DVec3::Y, 2.0);
        let mut scene = Scene { layers, phase, ..Scene::seen_by(camera) };
        scene.shading.lighting = lit.then(Lighting::default);
        scene.inside.along = AlongRay::Minimum;
        scene.inside.isosurfaces = vec![Isosurface { value: at, opacity: 0.5, colour: None }];
        scene.inside.slices = vec![Slice::across(&Lattice::unit([2; 3]), 0, 0.5, 1.0)];
        scene.inside.clip.bounds = Some(ClipBox { low: [0.25; 3], ..ClipBox::WHOLE });
        let stops = vec![(at, Srgb8([1, 2, 3]))];
        scene.shading.emission = Some(Colours { index: Index::ViewDepth, stops });
        scene.splat = SplatSettings { extent: Some(2.5), ..SplatSettings::SHADE_FIRST };
        scene.camera.projection = Projection::Perspective { view_angle: 0.7 };
        let grey = Background::Colour(Srgb8([7; 3]));
        scene.background = if lit { grey } else { Background::Transparent };
        scene
    })
}

proptest! {
    #[test]
    fn a_scene_comes_back_as_it_was_saved(scene in scene()) {
        let text = scene.to_json().expect("sound");
        let back = Scene::from_json(&text).expect("sound");
        prop_assert!(back.makes_same_picture(&scene), "{text}");
        prop_assert_eq!(&back.layers, &scene.layers);
        prop_assert_eq!(back.splat, scene.splat);
        prop_assert_eq!(back.to_json().expect("sound"), text);
    }
}

#[test]
fn samples_are_not_saved_and_are_found_again_by_name() {
    let samples = Samples::UInt8(vec![7; 8]);
    let volume = ScalarVolume::from_samples("v", Lattice::unit([2; 3]), samples).expect("sound");
    let volume = Sampled::Volume(Arc::new(volume));
    let source = SampleSource::component("a/b.vti".as_ref(), "v", Component::Index(0));
    let camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0);
    let transfer = TransferFunction::of(vec![(0.0, 0.5)], ColourSource::Stops(Vec::new()));
    let mut scene = Scene::seen_by(camera);
    scene.add(source.clone(), (volume.clone(), Look::Field(transfer)));
    let text = scene.to_json().expect("sound");
    assert!(text.contains("a/b.vti") && text.len() < 4000, "{text}");
    let mut back = Scene::from_json(&text).expect("sound");
    assert!(back.volume().is_none() && !back.makes_same_picture(&scene));
    assert_eq!(back.store.insert(source, volume), scene.layers[0].source);
    assert!(back.volume().is_some() && back.makes_same_picture(&scene));
}

#[test]
fn other_versions_other_texts_and_numbers_without_a_word_are_refused_in_a_sentence() {
    let camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Y, 1.0);
    let mut scene = Scene::seen_by(camera);
    let text = scene.to_json().expect("sound");
    let newer = text.replacen("\"version\": 1", "\"version\": 2", 1);
    for (text, said) in [
        (newer.as_str(), "found version 2"),
        ("{\"version\": 1}", "missing field `scene`"),
        ("{", "found text that is none"),
        ("", "expected a saved scene"),
    ] {
        let refused = Scene::from_json(text).expect_err("refused").to_string();
        assert!(refused.contains(said) && !refused.contains('\n'), "{refused}");
    }
    scene.phase = f64::NAN;
    assert!(matches!(scene.to_json(), Err(SavedError::NotFinite)));
}
