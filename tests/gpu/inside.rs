//! Volumes that are cut open, against the float64 reference's same mode and its limit.

use glam::{DMat3, DVec3};
use voxsplat::core::Camera;
use voxsplat::gpu::{Renderer, SlabField, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    AlongRay, Classify, Clip, ClipBox, CutFaces, Inside, Isosurface, Lighting, OpacityModel, Order,
    Plane, Scene, Shading, Slice, SplatSettings,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Lattice, Samples};

use crate::support::{
    Light, Within, context, drawer, drawn, fault, in_perspective, print_measured, scene,
    transfer_of, volume, volume_of, with_field,
};

const SIZE: [u32; 2] = [36, 30];

/// As without a cut (`reconstructed`). Measured: max 2.8e-4 to 1.4e-3, rmse to 1.6e-4, bias to 2.4e-5.
const WITHIN: Within = Within { max_abs: 2e-3, rmse: 2.2e-4, bias: 5e-5 };

fn lattice() -> Lattice {
    Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([11, 9, 13]) }
}

fn sheared() -> Lattice {
    Lattice {
        direction: DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.4, 0.9, 0.0).normalize(),
            DVec3::new(0.2, -0.1, -0.9).normalize(),
        ),
        ..lattice()
    }
}

fn exact(lattice: Lattice) -> Scene {
    Scene { splat: SplatSettings::EXACT, ..scene(lattice, DVec3::new(0.4, 0.9, -0.5)) }
}

/// A box of which no face is the lattice's own but one.
fn bounds() -> ClipBox {
    ClipBox { low: [0.2, 0.13, 0.0], high: [0.83, 0.7, 0.61] }
}

/// A plane near the middle that cuts obliquely.
fn plane(lattice: &Lattice) -> Plane {
    let point = lattice.world_from_index(DVec3::new(4.6, 4.1, 6.3));
    Plane { point, normal: DVec3::new(0.5, -0.8, 0.6) }
}

fn clipped(scene: Scene, clip: Clip) -> Scene {
    Scene { inside: Inside { clip, ..Inside::default() }, ..scene }
}

fn both(scene: Scene, faces: CutFaces) -> Scene {
    let planes = vec![plane(&scene.lattice())];
    clipped(scene, Clip { bounds: Some(bounds()), planes, faces })
}

fn expected(scene: &Scene) -> Light {
    Reference::new(scene, SIZE.map(|n| n as usize)).expect("a mode with meaning").picture()
}

/// Whether a scene is drawn as the reference does, and not as if nothing were asked for.
#[track_caller]
fn agrees(name: &str, scene: &Scene, within: Within) {
    let Some(mut drawer) = drawer() else { return };
    let expected = expected(scene);
    let plain = Scene { inside: Inside::default(), ..scene.clone() };
    let (plain, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(fault(&plain, &expected, within).is_some(), "{name} changes nothing");
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    assert_eq!(fault(&found, &expected, within), None, "{name}");
}

#[test]
fn boxes_and_planes_cut_where_the_reference_does() {
    let one = |clip: Clip| clipped(exact(lattice()), clip);
    agrees("box", &one(Clip { bounds: Some(bounds()), ..Clip::default() }), WITHIN);
    let planes = vec![plane(&lattice())];
    agrees("plane", &one(Clip { planes, ..Clip::default() }), WITHIN);
    agrees("both", &both(exact(lattice()), CutFaces::Through), WITHIN);
    agrees("sheared", &both(exact(sheared()), CutFaces::Through), WITHIN);
    let tiny = Lattice {
        spacing: DVec3::splat(1e-6),
        origin: DVec3::splat(1e-3),
        ..Lattice::unit([8, 8, 8])
    };
    agrees("tiny", &both(exact(tiny), CutFaces::Through), WITHIN);
    let mut perspective = in_perspective(exact(lattice()), 70.0);
    agrees("perspective", &both(perspective.clone(), CutFaces::Through), WITHIN);
    // The eye between two faces of the box.
    perspective.camera.focal_point += perspective.camera.direction * 6.0;
    agrees("from within", &both(perspective, CutFaces::Coloured), WITHIN);
}

#[test]
fn cut_faces_are_the_references_in_every_mode() {
    for (name, change) in [
        ("exact", (|_| ()) as fn(&mut SplatSettings)),
        ("back to front", |s| s.order = Order::BackToFront),
        ("published", |s| s.opacity_model = OpacityModel::Published),
        ("in the middle", |s| s.classify = Classify::After),
        ("tents", |s| s.kernel = Kernel::Linear),
        ("radial", |s| s.kernel = Kernel::Cubic),
    ] {
        let mut scene = both(exact(lattice()), CutFaces::Coloured);
        change(&mut scene.splat);
        agrees(name, &scene, WITHIN);
    }
    let mut lit = both(exact(sheared()), CutFaces::Coloured);
    lit.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
    agrees("lit", &lit, WITHIN);
}

/// What a mode converges to is cut as the mode is.
#[test]
fn fine_slabs_come_to_the_continuous_integral_of_what_is_kept() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = both(exact(lattice()), CutFaces::Coloured);
    let exact = Reference::exact(&scene, SIZE.map(|n| n as usize)).expect("a mode with meaning");
    let exact = exact.picture();
    scene.splat.slabs_per_voxel = 16.0;
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    print_measured("16 slabs a voxel", &found, &exact);
    assert_eq!(fault(&found, &exact, WITHIN), None);
}

/// A scene that asks for nothing is drawn with the passes, pipelines and bytes that it had before, and
/// after something was cut, as before, to the bit.
#[test]
fn what_is_not_cut_costs_nothing_and_changes_no_bit() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let plain = exact(lattice());
    let (before, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    let held = |drawer: &Drawer| {
        (
            drawer.engines.made_gpu().expect("a device").pipeline_count(),
            drawer.engines.made_gpu().expect("a device").size_bytes(),
        )
    };
    let (pipelines, bytes) = held(&drawer);
    drawn(&mut drawer, &both(plain.clone(), CutFaces::Coloured), SIZE, Rung::Full);
    assert_eq!(held(&drawer), (pipelines + 1, bytes));
    let whole = Clip { bounds: Some(ClipBox::WHOLE), ..Clip::default() };
    let (after, _) = drawn(&mut drawer, &clipped(plain, whole), SIZE, Rung::Full);
    assert_eq!(after, before, "a box about all of it cuts nothing");
    assert_eq!(held(&drawer).1, bytes, "let go of");
}

/// Quick pictures are cut at the same places: half a sample more would be seen.
#[test]
fn previews_are_cut_as_the_exact_picture_is() {
    // Of its own: a field that is set by hand would be taken for another test's.
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = both(exact(lattice()), CutFaces::Coloured);
    let (exact, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let ticket = voxsplat::core::Ticket::new();
    let tents = voxsplat::kernel::nearest_tents(volume_of(&scene), &ticket).expect("made");
    let splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(SlabField::Preview, volume_of(&scene), &splat, tents, &ticket)
        .expect("set");
    let rung = Rung::Reduced { field: SlabField::Preview, shrink: 1.0 };
    let (quick, drawn) = drawn(&mut drawer, &scene, SIZE, rung);
    assert_eq!(drawn.field, SlabField::Preview);
    let outline = |light: &Light| light.iter().map(|p| p[3] > 0.02).collect::<Vec<bool>>();
    let (quick, exact) = (outline(&quick), outline(&exact));
    let differ = quick.iter().zip(&exact).filter(|(a, b)| a != b).count();
    println!("measured {differ} of {} pixels", quick.len());
    // Measured: 6 of 1080.
    let covered = exact.iter().filter(|is| **is).count();
    assert!(covered > 80 && differ < 12, "{covered} {differ}");
}

/// Of noise that nothing smooths, at two faces a voxel: what lies between two may have a top that no
/// parabola tells of. Measured: max 0.057 and rmse 3.3e-3 of the greatest values, 0.092 and 5.7e-3 of
/// their means, bias to 1.4e-4; with four times as many faces 3.5e-3 and 2.0e-4.
const PROJECTED: Within = Within { max_abs: 0.15, rmse: 6e-3, bias: 3e-4 };
/// With 16 faces a voxel, as much as values and colours are off by elsewhere. Measured: max 1.2e-3, rmse
/// 1.3e-4.
const PROJECTED_FINELY: Within = Within { max_abs: 2e-3, rmse: 2.2e-4, bias: 5e-5 };

fn projected(along: AlongRay) -> Scene {
    let mut scene = exact(lattice());
    scene.inside = Inside { along, ..Inside::default() };
    scene
}

#[test]
fn projections_are_the_references_extremes_and_means() {
    for along in [AlongRay::Maximum, AlongRay::Minimum, AlongRay::Average] {
        let name = |what: &str| format!("{} {what}", along.name());
        let base = || projected(along);
        agrees(&name("exact"), &base(), PROJECTED);
        agrees(&name("perspective"), &in_perspective(base(), 60.0), PROJECTED);
        let mut cut = base();
        cut.inside.clip = both(exact(lattice()), CutFaces::Through).inside.clip;
        agrees(&name("cut"), &cut, PROJECTED);
        let mut fine = base();
        fine.splat.slabs_per_voxel = 8.0;
        agrees(&name("in fine slabs"), &fine, PROJECTED_FINELY);
        // Each takes seconds to compile: one of the three is enough.
        let kernels = [Kernel::Nearest, Kernel::Linear, Kernel::Cubic];
        for kernel in kernels.into_iter().filter(|_| along == AlongRay::Maximum) {
            let mut other = fine.clone();
            other.splat.kernel = kernel;
            let within = match kernel {
                // A box that a ray only grazes may lie between two faces: one pixel in 400. Measured:
                // max 0.71, rmse 0.014.
                Kernel::Nearest => Within { max_abs: 1.0, rmse: 0.02, ..PROJECTED },
                _ => PROJECTED,
            };
            agrees(&name(kernel.name()), &other, within);
        }
    }
}

/// Values that rise slowly along the rays: each brick holds a little more than all before it, and none may be leapt over.
/// Measured: max 3.2e-3, rmse 2.8e-4, bias 3.7e-5.
#[test]
fn greatest_values_that_rise_slowly_are_followed_to_the_last() {
    const RISING: Within = Within { max_abs: 6e-3, rmse: 6e-4, bias: 1e-4 };
    let dims = [21, 18, 40];
    let rising = |i: usize| (90 + i / (dims[0] * dims[1]) * 4 + i * 7 % 5) as u8;
    let samples = Samples::UInt8((0..dims.into_iter().product()).map(rising).collect());
    for along in [AlongRay::Maximum, AlongRay::Minimum] {
        for direction in [DVec3::Z, -DVec3::Z, DVec3::new(0.2, -0.3, 0.9)] {
            let lattice = Lattice::unit(dims);
            let mut scene = scene(lattice, direction);
            scene = with_field(scene, volume(lattice, samples.clone()));
            scene.splat = SplatSettings::EXACT;
            scene.inside = Inside { along, ..Inside::default() };
            agrees(&format!("{} rising along {direction}", along.name()), &scene, RISING);
        }
    }
}

/// Opacities, lights and the order of layers have no part in a projection, and neither have parts.
#[test]
fn a_projection_is_of_values_alone() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = projected(AlongRay::Maximum);
    let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let mut other = scene.clone();
    transfer_of(&mut other)
        .opacity
        .iter_mut()
        .for_each(|(_, alpha)| *alpha = (*alpha * 0.1).max(0.01));
    other.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
    other.splat.order = Order::BackToFront;
    let (same, _) = drawn(&mut drawer, &other, SIZE, Rung::Full);
    let off = found.iter().flatten().zip(same.iter().flatten()).map(|(a, b)| (a - b).abs());
    // Cells mix their colours by the opacities within.
    assert!(off.fold(0.0, f64::max) < 2e-3);
    assert_eq!(drawer.engines.gpu().expect("a device").shading_bytes(), 0);
    assert!(found.iter().filter(|p| p[3] == 1.0).count() > 300, "whatever is met is opaque");
}

/// A smooth hill of values to 200 about the middle, so that levels are closed surfaces about it.
pub(crate) fn hill(lattice: Lattice) -> Scene {
    hill_without(lattice, |_| false)
}

/// The same where samples are without data.
fn hill_without(lattice: Lattice, is_missing: impl Fn(usize) -> bool) -> Scene {
    let base = exact(lattice);
    let [nx, ny, _] = lattice.dims;
    let middle = (DVec3::from(lattice.dims.map(|n| n as f64)) - 1.0) / 2.0;
    let value = |i: usize| {
        let at = DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as f64));
        let off = (at - middle) / middle;
        200.0 * (-1.5 * off.length_squared()).exp() + 6.0 * (1.7 * at.x + at.z).sin()
    };
    let value = |i| if is_missing(i) { f64::NAN } else { value(i) };
    let samples = Samples::Float32((0..lattice.len()).map(|i| value(i) as f32).collect());
    with_field(base, volume(lattice, samples))
}

fn iso(value: f64, opacity: f64) -> Isosurface {
    Isosurface { value, opacity, colour: None }
}

fn with_levels(mut scene: Scene, isosurfaces: Vec<Isosurface>) -> Scene {
    scene.inside.isosurfaces = isosurfaces;
    scene.splat.slabs_per_voxel = 2.0;
    scene
}

/// Measured: max 2.5e-5 to 6.4e-4, rmse 1.3e-6 to 6e-5, bias to 2e-6.
const SURFACES: Within = Within { max_abs: 2e-3, rmse: 2.2e-4, bias: 5e-5 };
/// Pixels at the edges of surfaces, of 1080, that pass a level twice between two slab faces.
const MOST_GRAZING: usize = 3;

/// As [`agrees`], but for the few pixels in which a surface is grazed.
#[track_caller]
fn agrees_but_for_edges(name: &str, scene: &Scene) {
    let Some(mut drawer) = drawer() else { return };
    let expected = expected(scene);
    let plain = Scene { inside: Inside::default(), ..scene.clone() };
    let (plain, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
    assert!(fault(&plain, &expected, SURFACES).is_some(), "{name} changes nothing");
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    print_measured(name, &found, &expected);
    let is_near = |(a, b): &(&[f64; 4], &[f64; 4])| (0..4).all(|c| (a[c] - b[c]).abs() < 0.02);
    let near: Vec<_> = found.iter().zip(&expected).filter(is_near).collect();
    let grazing = found.len() - near.len();
    assert!(grazing <= MOST_GRAZING, "{name}: {grazing} pixels");
    let (found, expected): (Light, Light) = near.into_iter().map(|(a, b)| (*a, *b)).unzip();
    print_measured(&format!("{name}, but for {grazing} pixels"), &found, &expected);
    assert_eq!(fault(&found, &expected, SURFACES), None, "{name}");
}

#[test]
fn isosurfaces_are_the_references() {
    let levels = || vec![iso(60.0, 0.4), iso(150.0, 1.0)];
    let clear = |mut scene: Scene| {
        transfer_of(&mut scene).opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
        scene
    };
    agrees("alone", &clear(with_levels(hill(lattice()), levels())), SURFACES);
    agrees_but_for_edges("in matter", &with_levels(hill(sheared()), levels()));
    let perspective = in_perspective(hill(lattice()), 60.0);
    agrees_but_for_edges("perspective", &with_levels(perspective, levels()));
    let mut backwards = with_levels(hill(lattice()), levels());
    backwards.splat.order = Order::BackToFront;
    agrees_but_for_edges("back to front", &backwards);
    let mut published = with_levels(hill(lattice()), levels());
    published.splat.opacity_model = OpacityModel::Published;
    agrees_but_for_edges("published", &published);
    let mut lit = with_levels(hill(lattice()), levels());
    let lights = Lighting { ambient: 0.1, specular: 0.6, ..Lighting::default() };
    lit.shading = Shading { lighting: Some(lights), ..Shading::default() };
    lit.inside.isosurfaces[1].colour = Some(voxsplat::core::Srgb8([40, 90, 220]));
    agrees_but_for_edges("lit", &lit);
    let mut other = with_levels(hill(lattice()), levels());
    other.splat.kernel = Kernel::Cubic;
    agrees_but_for_edges("radial", &other);
    let mut cut = both(with_levels(hill(lattice()), levels()), CutFaces::Coloured);
    cut.inside.isosurfaces = levels();
    agrees_but_for_edges("cut", &cut);
}

#[test]
fn slices_are_the_references_at_their_depth() {
    let slices = |lattice: &Lattice| {
        let across = Plane {
            point: lattice.world_from_index(DVec3::new(5.2, 0.0, 0.0)),
            normal: lattice.axes().inverse().transpose() * DVec3::X,
        };
        vec![
            Slice { plane: plane(lattice), opacity: 0.6, only_shown: false, edges: false },
            Slice { plane: across, opacity: 1.0, only_shown: false, edges: false },
        ]
    };
    for (name, change) in [
        ("exact", (|_| ()) as fn(&mut SplatSettings)),
        ("back to front", |s| s.order = Order::BackToFront),
        ("published", |s| s.opacity_model = OpacityModel::Published),
        ("in the middle", |s| s.classify = Classify::After),
    ] {
        let mut scene = exact(sheared());
        scene.inside.slices = slices(&scene.lattice());
        change(&mut scene.splat);
        agrees(name, &scene, WITHIN);
    }
    let mut all = both(in_perspective(hill(lattice()), 50.0), CutFaces::Coloured);
    all.inside.slices = slices(&lattice());
    all.inside.isosurfaces = vec![iso(110.0, 0.7)];
    all.splat.slabs_per_voxel = 2.0;
    all.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
    agrees_but_for_edges("with all else", &all);
}

/// Where there are no data, nothing is met and nothing projected.
#[test]
fn samples_without_data_have_no_surface_no_slice_and_no_value() {
    let holed = || hill_without(lattice(), |i| i % 11 == 5);
    let mut surfaces = with_levels(holed(), vec![iso(60.0, 0.4), iso(150.0, 1.0)]);
    transfer_of(&mut surfaces).opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
    agrees_but_for_edges("levels among holes", &surfaces);
    let mut sliced = holed();
    sliced.inside.slices =
        vec![Slice { plane: plane(&lattice()), opacity: 0.6, only_shown: false, edges: false }];
    transfer_of(&mut sliced).opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
    agrees_but_for_edges("a slice among holes", &sliced);
    for along in [AlongRay::Maximum, AlongRay::Average] {
        let mut projected = holed();
        projected.inside.along = along;
        projected.splat.slabs_per_voxel = 8.0;
        agrees(&format!("{} among holes", along.name()), &projected, PROJECTED);
    }
}

/// Rays along the faces of a box are on one side of them or on the other, and meet none.
#[test]
fn rays_along_the_faces_of_a_clip_are_kept_or_cut_whole() {
    let lattice = Lattice::unit([11, 9, 13]);
    let mut scene = exact(lattice);
    scene.camera = Camera::new(lattice.centre(), DVec3::NEG_Z, DVec3::Y, 6.37);
    let clip = Clip { bounds: Some(bounds()), ..Clip::default() };
    agrees("along an axis", &clipped(scene, clip), WITHIN);
}
