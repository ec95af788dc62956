//! Plans of many scenes, compared without a device.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use voxsplat::core::{Projection, Ticket};
use voxsplat::kernel::Kernel;
use voxsplat::plan::{Plan, Way};
use voxsplat::polygons::Mesh;
use voxsplat::scene::{
    AlongRay, Backend, Background, ClipBox, Effect, Isosurface, Lighting, Look, OpacityModel,
    PolygonLayer, SampleSource, Sampled, Scene, Slice, SplatSettings, VectorLayer, Visibility,
    framing_camera,
};
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
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
    let levels = before.levels(&Ticket::new()).expect("sound");
    assert!(levels.len() > 1 && levels[0].list.len() > levels[1].list.len());
}

#[test]
fn a_preview_is_of_the_field_alone_and_of_kernels_where_there_is_none() {
    let plan = Plan::of(&vectors(field()), SIZE).previewed();
    assert!(plan.kernels.is_empty() && plan.way == Way::Triangles);
    assert_eq!(plan.left_out.iter().map(|r| r.part).collect::<Vec<_>>(), [Effect::Vectors]);
    let plan = Plan::of(&alone(field()), SIZE).previewed();
    assert!(plan.kernels.len() == 1 && plan.way == Way::Slabs && plan.left_out.is_empty());
}

/// Slabs, clips and opacities go by the field whether it is drawn or not; without one, by what there is.
#[test]
fn the_frame_is_of_the_field_and_without_one_of_the_rest() {
    let frame = |scene: &Scene| Plan::of(scene, SIZE).frame;
    assert_eq!(frame(&vectors(field())), frame(&field()));
    assert_eq!(frame(&alone(field())), frame(&field()));
    let bare_wind = bare(vectors(field()));
    assert_eq!(frame(&bare_wind).lattice.spacing, DVec3::splat(2.0));
    assert_eq!(frame(&bare_wind).unit_distance, 2.0);
    let mesh = frame(&bare(polygons(field()))).lattice;
    assert_eq!(mesh.centre(), DVec3::new(2.5, 2.5, 0.0));
    assert_eq!(mesh.spacing, DVec3::new(5.0, 5.0, 5e-3));
    assert_eq!(frame(&bare(field())).lattice, Lattice::unit([1; 3]));
    let source = SampleSource::made("none");
    assert!(field().store.get(&source).is_none());
}
