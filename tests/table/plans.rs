//! Plans of many scenes, compared without a device.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use voxsplat::core::{Projection, Srgb8, Ticket};
use voxsplat::gpu;
use voxsplat::kernel::Kernel;
use voxsplat::native;
use voxsplat::plan::{Plan, Way};
use voxsplat::polygons::Mesh;
use voxsplat::scene::{
    AlongRay, Amounts, Backend, Background, ClipBox, Colours, Effect, Index, Isosurface, Lighting,
    Look, OpacityModel, PolygonLayer, SampleSource, Sampled, Scene, Slice, SplatSettings, Store,
    VectorLayer, Visibility, framing_camera,
};
use voxsplat::transfer::{ColourMap, ColourSource, Region, RegionShape, TransferFunction};
use voxsplat::vector::ColourBy;
use voxsplat::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

const SIZE: [u32; 2] = [40, 30];

fn field() -> Scene {
    let lattice = Lattice::unit([8; 3]);
    let samples = Samples::UInt8((0..512).map(|i| (i % 251) as u8).collect());
    let volume = Arc::new(ScalarVolume::from_samples("field", lattice, samples).expect("sound"));
    let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 255.0] };
    let transfer = TransferFunction::of(vec![(0.0, 0.0), (255.0, 0.5)], colour);
    let camera = framing_camera(&lattice, DVec3::new(0.3, -0.5, 0.8), DVec3::Y);
    Scene::seen_by(camera).with((Sampled::Volume(volume), Look::Field(transfer)))
}

fn wind(name: &str) -> Arc<VectorField> {
    let places = Places::Lattice(Lattice { spacing: DVec3::splat(2.0), ..Lattice::unit([4; 3]) });
    let vectors = (0..64).map(|i| Vec3::X * (1 + i) as f32).collect::<Vec<_>>();
    Arc::new(VectorField::new(name, places, vectors.into(), &Ticket::new()).expect("sound"))
}

fn vectors(scene: Scene) -> Scene {
    scene.with(VectorLayer::new(wind("wind")))
}

fn alone(scene: Scene) -> Scene {
    let mut scene = vectors(scene);
    scene.show_field(false);
    scene
}

fn polygons(scene: Scene) -> Scene {
    let corners = vec![Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0];
    let mesh = Mesh::new("mesh", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).expect("sound");
    scene.with(PolygonLayer::new(Arc::new(mesh)))
}

fn first(scene: Scene) -> Scene {
    Scene { splat: SplatSettings::SHADE_FIRST, ..scene }
}

fn slabs_first(scene: Scene) -> Scene {
    let mut scene = first(scene);
    scene.splat.visibility = Visibility::Slabs;
    scene
}

fn lit(mut scene: Scene) -> Scene {
    scene.shading.lighting = Some(Lighting::default());
    scene
}

fn opened(mut scene: Scene) -> Scene {
    let lattice = scene.lattice();
    scene.inside.clip.bounds = Some(ClipBox { high: [0.5, 1.0, 1.0], ..ClipBox::WHOLE });
    scene.inside.isosurfaces = vec![Isosurface { value: 90.0, opacity: 1.0, colour: None }];
    scene.inside.slices = vec![Slice::across(&lattice, 0, 0.5, 1.0)];
    scene
}

fn projected(mut scene: Scene) -> Scene {
    scene.inside.along = AlongRay::Maximum;
    scene
}

fn raster(mut scene: Scene) -> Scene {
    scene.splat.backend = Backend::Raster;
    scene
}

fn gouraud(mut scene: Scene) -> Scene {
    scene.splat.kernel = Kernel::Gouraud;
    scene
}

fn far(mut scene: Scene) -> Scene {
    scene.camera.parallel_scale *= 40.0;
    scene
}

fn near(mut scene: Scene) -> Scene {
    scene.camera.projection = Projection::Perspective { view_angle: 1.0 };
    scene.camera.parallel_scale = 1.0;
    scene
}

fn bare(mut scene: Scene) -> Scene {
    scene.keep(|layer| !matches!(layer.look, Look::Field(_)));
    scene
}

fn sparse(mut scene: Scene) -> Scene {
    scene.splat.extent = Some(0.4);
    scene
}

/// Lights, regions, and every table that may stand beside them.
fn shaded(scene: Scene) -> Scene {
    let mut scene = lit(scene);
    let colours = |index| Some(Colours { index, stops: vec![(0.0, Srgb8([9; 3]))] });
    let points = vec![(0.0, 0.5)];
    scene.shading.modulation = Some(Amounts { index: Index::GradientStrength, points });
    scene.shading.reflection = colours(Index::Value);
    scene.shading.emission = colours(Index::ViewDepth);
    let (values, strengths, colour) = ([60.0, 190.0], [10.0, 130.0], Some(Srgb8([9; 3])));
    let (shape, softness, opacity) = (RegionShape::Ellipse, 0.6, 0.5);
    let region = Region { shape, values, strengths, softness, opacity, colour };
    scene.shading.regions = vec![region; 2];
    scene
}

fn second(scene: Scene) -> Scene {
    scene.with(VectorLayer::beside_another(wind("other")))
}

/// Of each scene the way, how many fields, kernel lists and polygons there are, how many surfaces inside, and what
/// is left out.
#[test]
fn thirty_scenes_have_the_plans_they_should() {
    use Effect as E;
    use Way::*;
    type Change = fn(Scene) -> Scene;
    type Row = (&'static str, &'static [Change], Way, [usize; 4], &'static [Effect]);
    let rows: &[Row] = &[
        ("field", &[], Slabs, [1, 0, 0, 0], &[]),
        ("lit", &[lit], Slabs, [1, 0, 0, 0], &[]),
        ("opened", &[opened], Slabs, [1, 0, 0, 2], &[]),
        ("projected", &[projected], Slabs, [1, 0, 0, 0], &[]),
        ("vectors", &[vectors], Slabs, [1, 1, 0, 0], &[]),
        ("two fields of vectors", &[vectors, second], Slabs, [1, 2, 0, 0], &[]),
        ("vectors alone", &[alone], Slabs, [0, 1, 0, 0], &[]),
        ("vectors without any field", &[vectors, bare], Slabs, [0, 1, 0, 0], &[]),
        ("polygons", &[polygons], Slabs, [1, 0, 1, 0], &[]),
        ("polygons among vectors alone", &[alone, polygons], Slabs, [0, 1, 1, 0], &[]),
        ("all", &[lit, opened, vectors, polygons], Slabs, [1, 1, 1, 2], &[]),
        ("shaded first", &[first], Triangles, [1, 0, 0, 0], &[]),
        ("slabs shaded first", &[slabs_first], Gathered, [1, 0, 0, 0], &[]),
        ("shaded first and lit", &[first, lit], Gathered, [1, 0, 0, 0], &[]),
        ("shaded first, vectors", &[first, vectors], Gathered, [1, 1, 0, 0], &[]),
        ("shaded first, polygons", &[first, polygons], Gathered, [1, 0, 1, 0], &[]),
        // Modes that shade first show nothing of the inside; the mode's own check refuses that.
        ("shaded first, opened", &[first, opened], Triangles, [1, 0, 0, 0], &[]),
        ("from afar", &[first, far], Gathered, [1, 0, 0, 0], &[]),
        ("from afar, as triangles", &[first, far, raster], Nodes, [1, 0, 0, 0], &[]),
        ("gaps from afar", &[first, far, raster, sparse], Triangles, [1, 0, 0, 0], &[]),
        ("from within", &[first, near], Gathered, [1, 0, 0, 0], &[]),
        ("meshes", &[first, gouraud], Triangles, [1, 0, 0, 0], &[]),
        ("meshes, vectors", &[first, gouraud, vectors], Triangles, [1, 0, 0, 0], &[E::Vectors]),
        (
            "triangles, two vectors",
            &[first, raster, vectors, second],
            Triangles,
            [1, 0, 0, 0],
            &[E::Vectors, E::SecondVectors],
        ),
        (
            "triangles, polygons",
            &[first, raster, polygons],
            Triangles,
            [1, 0, 0, 0],
            &[E::Polygons],
        ),
        ("triangles, vectors alone", &[first, raster, alone], Slabs, [0, 1, 0, 0], &[]),
        ("projected, polygons", &[projected, polygons], Slabs, [1, 0, 0, 0], &[E::Polygons]),
        ("projected, vectors", &[projected, vectors], Slabs, [1, 1, 0, 0], &[E::Projection]),
        (
            "projected, vectors alone, polygons",
            &[projected, alone, polygons],
            Slabs,
            [0, 1, 1, 0],
            &[E::Projection],
        ),
        (
            "opened, projected, vectors",
            &[opened, projected, vectors],
            Slabs,
            [1, 1, 0, 0],
            &[E::Clip, E::Projection, E::Isosurfaces, E::Slices],
        ),
        (
            "opened, vectors alone",
            &[opened, alone],
            Slabs,
            [0, 1, 0, 0],
            &[E::Clip, E::Isosurfaces, E::Slices],
        ),
        ("nothing", &[bare], Nothing, [0, 0, 0, 0], &[]),
        ("polygons alone", &[bare, polygons], Nothing, [0, 0, 1, 0], &[]),
    ];
    assert!(rows.len() >= 30);
    let mut plans: Vec<Plan> = Vec::new();
    for &(name, changes, way, counts, left_out) in rows {
        let scene = changes.iter().fold(field(), |scene, change| change(scene));
        let plan = Plan::of(&scene, SIZE);
        let surfaces = plan.inside.isosurfaces.len() + plan.inside.slices.len();
        let found = [plan.fields.len(), plan.kernels.len(), plan.surfaces.len(), surfaces];
        let refused: Vec<_> = plan.left_out.iter().map(|refusal| refusal.part).collect();
        assert_eq!((plan.way, found, &refused[..]), (way, counts, left_out), "{name}");
        assert_eq!(plan, Plan::of(&scene.clone(), SIZE), "{name}: the same scene, the same plan");
        // The native engine has no triangles, but draws what nobody wants to be such; the other draws everything.
        let SplatSettings { backend, kernel, .. } = scene.splat;
        let wants_triangles = backend == Backend::Raster || kernel == Kernel::Gouraud;
        let has_triangles = wants_triangles && matches!(way, Triangles | Nodes);
        assert_eq!(native::supports(&plan).is_ok(), !has_triangles, "{name}");
        assert_eq!(gpu::supports(&plan), Ok(()), "{name}");
        let outline = plan.outline();
        assert_eq!(outline.way, way.name());
        assert_eq!(outline.kernels.len(), counts[1]);
        assert_eq!(outline.surfaces.len(), counts[2] + counts[3], "{name}");
        assert_eq!(outline.left_out.len(), left_out.len());
        plans.push(plan);
    }
    for (i, plan) in plans.iter().enumerate() {
        let twin = plans[..i].iter().position(|other| other == plan);
        assert_eq!(twin, None, "{} is another picture", rows[i].0);
    }
}

#[test]
fn an_outline_names_what_there_is_and_says_how_thick_slabs_are() {
    let mut scene = polygons(vectors(opened(field())));
    scene.splat.slabs_per_voxel = 4.0;
    let outline = Plan::of(&scene, SIZE).outline();
    assert_eq!(
        (&outline.fields[..], &outline.kernels[..]),
        (&["field".into()][..], &["wind".into()][..])
    );
    assert_eq!(outline.surfaces, ["isosurface", "slice", "mesh"]);
    assert_eq!(outline.slab_thickness, Some(0.25));
    assert_eq!(Plan::of(&first(field()), SIZE).outline().slab_thickness, None);
    let refused = Plan::of(&polygons(raster(first(field()))), SIZE).outline().left_out;
    assert!(refused[0].ends_with("or leave the polygons out"), "{refused:?}");
}

/// A scene that no engine can draw is refused by both; what is hidden is nobody's fault.
#[test]
fn faults_of_layers_are_refused_unless_they_are_hidden() {
    type Change = fn(&mut Scene);
    let faults: [(Change, &str); 3] = [
        (|s| s.layers.push(s.layers[0].clone()), "found 2; hide the others"),
        (|s| s.layers[0].placement.translation = DVec3::X, "moved elsewhere"),
        (|s| s.store = Store::default(), "without any"),
    ];
    for (change, said) in faults {
        let mut scene = field();
        change(&mut scene);
        let plan = Plan::of(&scene, SIZE);
        let by_gpu = gpu::supports(&plan).map_err(|error| error.to_string());
        let native = native::supports(&plan).map_err(|error| error.to_string());
        for refused in [by_gpu, native] {
            assert!(refused.as_ref().is_err_and(|error| error.contains(said)), "{refused:?}");
        }
        scene.layers.last_mut().expect("one").is_shown = false;
        assert_eq!(Plan::of(&scene, SIZE).fault, None, "{said}");
    }
    let three = Plan::of(&second(second(vectors(field()))), SIZE);
    assert!(gpu::supports(&three).is_err_and(|error| error.to_string().contains("found 3")));
    assert_eq!(native::supports(&three), Ok(()));
}

#[test]
fn hidden_layers_are_neither_drawn_nor_changed() {
    let mut scene = second(vectors(field()));
    scene.layers[1].is_shown = false;
    assert_eq!(Plan::of(&scene, SIZE).outline().kernels, ["other"]);
    let changed: Vec<_> = scene.vectors_mut().iter().map(|(field, _)| field.name.clone()).collect();
    assert_eq!(changed, ["other"]);
    // Nor does a hidden field stand for one that is drawn.
    let mut other = field();
    other.layers[0].is_shown = false;
    let drawn = field();
    let volume = drawn.volume().expect("a field");
    let look = drawn.layers[0].look.clone();
    let mut other = other.with((Sampled::Volume(Arc::clone(volume)), look));
    assert!(Plan::of(&other, SIZE).has_same_samples(&Plan::of(&drawn, SIZE)));
    other.show_field(false);
    assert!(Plan::of(&other, SIZE).fields.is_empty());
}

#[test]
fn layers_are_exchanged_taken_away_and_brought_back() {
    let mut scene = vectors(field());
    scene.phase = 0.4;
    scene.show_field(false);
    let new = || {
        let other = field();
        (
            Sampled::Volume(Arc::clone(other.volume().expect("a field"))),
            other.layers[0].look.clone(),
        )
    };
    let exchanged = scene.clone().with_other_field(field(), SampleSource::made("new"), new());
    assert_eq!((exchanged.phase, exchanged.shows_field()), (0.4, false));
    assert!(!exchanged.has_same_volume(&scene));
    let samples = |scene: &Scene| scene.store.samples().count();
    assert_eq!((samples(&scene), samples(&exchanged)), (2, 2));
    let mut replaced = scene.clone();
    replaced.replace(0, SampleSource::made("new"), new());
    assert!(replaced.shows_field());
    scene.keep_vectors(0);
    assert!(scene.shows_field() && samples(&scene) == 1);
}

#[test]
fn a_second_field_of_vectors_looks_otherwise_than_the_first() {
    let scene = second(vectors(field()));
    let [one, two] = &scene.vectors()[..] else { panic!("two") };
    let map = |layer: &VectorLayer| match layer.settings.transfer.colour {
        ColourSource::Map { map, .. } => map,
        _ => panic!("a map"),
    };
    assert!(one.settings.seed != two.settings.seed && map(one) != map(two));
}

/// What is not on the picture is no effect of it.
#[test]
fn effects_are_those_that_are_in_place() {
    use Effect::*;
    let of = |changes: &[fn(Scene) -> Scene]| {
        changes.iter().fold(field(), |scene, change| change(scene)).effects()
    };
    assert_eq!(of(&[lit, opened]), [Gradients, Lights, Clip, Isosurfaces, Slices]);
    assert_eq!(of(&[lit, opened, projected]), [Clip, Projection]);
    assert_eq!(of(&[lit, opened, projected, vectors]), [Gradients, Lights, Vectors]);
    assert_eq!(of(&[lit, opened, alone]), [Vectors]);
}

#[test]
fn an_effect_is_left_out_and_no_other() {
    use Effect::*;
    let scene = second(vectors(polygons(projected(opened(shaded(field()))))));
    let asked = |scene: &Scene| {
        Effect::ALL.iter().copied().filter(|one| one.asked_by(scene).is_some()).collect::<Vec<_>>()
    };
    let mut all = Effect::ALL.to_vec();
    all.retain(|effect| *effect != OpacityTable);
    assert_eq!(asked(&scene), all);
    assert_eq!(Regions.asked_by(&scene).as_deref(), Some("2 regions"));
    for &effect in &all {
        let left = asked(&effect.left_out_of(&scene).expect("asked for"));
        let lost: Vec<_> = all.iter().filter(|one| !left.contains(one)).copied().collect();
        match effect {
            Shading => assert!(
                lost.contains(&Shading)
                    && lost.iter().all(|one| one.is_of_shading() || *one == Shading)
            ),
            Gradients => assert_eq!(lost, [Gradients, Lights, Regions, ModulationTable]),
            Vectors => assert_eq!(lost, [Vectors, SecondVectors]),
            _ => assert_eq!(lost, [effect]),
        }
    }
    assert!(Vectors.left_out_of(&alone(field())).is_none(), "nothing would be left");
}

/// A change that shows makes another plan; what does not show makes none.
#[test]
fn plans_differ_where_pictures_do() {
    let scene = vectors(polygons(field()));
    let plan = Plan::of(&scene, SIZE);
    let changes: [fn(&mut Scene); 7] = [
        |s| s.transfer_mut().expect("sound").opacity[0].1 = 0.25,
        |s| s.phase = 0.5,
        |s| s.camera.parallel_scale *= 2.0,
        |s| s.splat.opacity_model = OpacityModel::Published,
        |s| s.vectors_mut()[0].1.stretch = 2.0,
        |s| *s.layers[1].look.opacity_mut().expect("sound") = 0.5,
        |s| s.background = Background::Transparent,
    ];
    for (i, change) in changes.iter().enumerate() {
        let mut other = scene.clone();
        change(&mut other);
        assert_ne!(Plan::of(&other, SIZE), plan, "change {i}");
        assert!(!scene.makes_same_picture(&other), "change {i}");
    }
    assert_ne!(Plan::of(&scene, [41, 30]), plan);
    // A mesh that is hidden, and one of no opacity.
    let mut hidden = scene.clone();
    hidden.layers[1].is_shown = false;
    let mut clear = scene;
    *clear.layers[1].look.opacity_mut().expect("sound") = 0.0;
    assert_eq!(Plan::of(&hidden, SIZE), Plan::of(&clear, SIZE));
    assert!(Plan::of(&hidden, SIZE).surfaces.is_empty());
}

/// How kernels are drawn is no reason to classify them anew.
#[test]
fn kernels_are_classified_by_what_decides_them() {
    let of = |scene: &Scene| Plan::of(scene, SIZE).kernels.remove(0).classification;
    let scene = vectors(field());
    let before = of(&scene);
    let mut other = scene.clone();
    other.vectors_mut()[0].1.coarser = 1;
    other.phase = 0.3;
    other.camera.parallel_scale *= 2.0;
    assert_eq!(of(&other), before);
    other.vectors_mut()[0].1.seed += 1;
    assert_ne!(of(&other), before);
    let mut other = scene;
    other.splat.opacity_unit_distance = Some(3.0);
    assert_ne!(of(&other), before);
    // By opacities, or by the samples of another field.
    let mut other = vectors(field());
    other.vectors_mut()[0].1.colour_by = ColourBy::Scalar;
    let by_scalar = of(&other);
    other.splat.opacity_model = OpacityModel::Published;
    assert_ne!(of(&other), by_scalar);
    other.splat = SplatSettings::EXACT;
    assert_eq!(of(&other), by_scalar);
    let volume = Arc::clone(field().volume().expect("a field"));
    let look = other.layers[0].look.clone();
    other.replace(0, SampleSource::made("new"), (Sampled::Volume(volume), look));
    assert_ne!(of(&other), by_scalar);
    let levels = before.levels(&Ticket::new()).expect("sound");
    assert!(levels.len() > 1 && levels[0].list.len() > levels[1].list.len());
}

#[test]
fn a_preview_is_of_the_field_alone_and_of_kernels_where_there_is_none() {
    let plan = Plan::of(&second(vectors(field())), SIZE).previewed();
    assert!(plan.kernels.is_empty() && plan.way == Way::Triangles);
    let left_out: Vec<_> = plan.left_out.iter().map(|refusal| refusal.part).collect();
    assert_eq!(left_out, [Effect::Vectors, Effect::SecondVectors]);
    let plan = Plan::of(&alone(field()), SIZE).previewed();
    assert!(plan.kernels.len() == 1 && plan.way == Way::Slabs && plan.left_out.is_empty());
}

#[test]
fn a_plan_of_another_size_or_mode_has_the_way_and_the_back_end_of_that() {
    let plan = Plan::of(&first(field()), SIZE);
    assert_eq!(plan.in_mode(SplatSettings::EXACT).way, Way::Slabs);
    let small = plan.at_size([4, 3], 1.0);
    assert_eq!([plan.way, small.way], [Way::Triangles, Way::Gathered]);
    let larger = plan.at_size([4, 3], 100.0).view();
    let kernel = plan.mode.kernel;
    assert!(larger.rays_per_side(kernel, None) < small.view().rays_per_side(kernel, None));
    assert!(plan.is_backend_open() && !small.is_backend_open());
    assert!(!Plan::of(&first(polygons(field())), SIZE).is_backend_open());
}

#[test]
fn plans_of_the_same_samples_are_told_from_others() {
    let plan = |scene: &Scene| Plan::of(scene, SIZE);
    let scene = field();
    let [one, two] = [vectors(scene.clone()), vectors(scene.clone())];
    assert!(plan(&one).has_same_samples(&plan(&lit(one.clone()))));
    assert!(
        !plan(&one).has_same_samples(&plan(&two)) && !plan(&one).has_same_samples(&plan(&scene))
    );
    assert!(!plan(&scene).has_same_samples(&plan(&field())));
    assert!(plan(&opened(field())).field().expect("one").has_gradient, "isosurfaces are lit");
}

/// Slabs, clips and opacities go by the field whether it is drawn or not; without one, by what there is.
#[test]
fn the_frame_is_of_the_field_and_without_one_of_the_rest() {
    let frame = |scene: &Scene| Plan::of(scene, SIZE).frame;
    assert_eq!(frame(&vectors(field())), frame(&field()));
    assert_eq!(frame(&alone(field())), frame(&field()));
    let mut bare_wind = bare(vectors(field()));
    bare_wind.layers[0].is_shown = false;
    assert_eq!(frame(&bare_wind).lattice.spacing, DVec3::splat(2.0));
    assert_eq!(frame(&bare_wind).unit_distance, 2.0);
    let mesh = frame(&bare(polygons(field()))).lattice;
    assert_eq!(mesh.centre(), DVec3::new(2.5, 2.5, 0.0));
    assert_eq!(mesh.spacing, DVec3::new(5.0, 5.0, 5e-3));
    assert_eq!(frame(&bare(field())).lattice, Lattice::unit([1; 3]));
    let source = SampleSource::made("none");
    assert!(field().store.get(&source).is_none());
}
