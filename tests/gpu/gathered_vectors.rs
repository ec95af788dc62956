//! Vector splats among kernels that are shaded first, in every mode, against the float64 reference, which
//! seats what a slab has of them in its middle, or puts it into the slabs of the kernels.

use glam::DVec3;
use voxsplat::core::{Camera, Srgb8, Ticket};
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{
    Backend, Lighting, OpacityModel, Order, Scene, Shading, SplatSettings, Visibility,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::transfer::ColourSource;
use voxsplat::vector::{VectorMode, VectorSettings};
use voxsplat::volume::{Lattice, Places, Samples};

use Visibility::{EverySample, Sheets, Slabs};

use crate::polygons::{compares, layer, squares};
use crate::support::*;
use crate::vectors::{PICTURE, alone, expected, holds, with};

/// As with the splats alone (`vectors::CLOSE`). Measured on llvmpipe (LLVM 15, Mesa 22.3.6): 2.2e-3, 7.3e-5 and
/// 1.8e-5.
const AMONG: Within = Within { max_abs: 4e-3, rmse: 1.2e-4, bias: 2e-5 };
/// The linearised projection's error. Measured: 4.0e-3, 4.6e-4 and 6.5e-5.
const SEEN: Within = Within { max_abs: 6e-3, rmse: 6e-4, bias: 1e-4 };
/// Many faint splats. Measured: 2.9e-5, 8.2e-6 and 3.6e-6; 0.12 and more where loops end unseen.
const LONG: Within = Within { max_abs: 6e-5, rmse: 2e-5, bias: 1e-5 };

fn beside(kernel: Kernel, visibility: Visibility) -> Scene {
    embedded(beside_field(alone()), kernel, visibility)
}

fn embedded(scene: Scene, kernel: Kernel, visibility: Visibility) -> Scene {
    let order = Order::FrontToBack;
    let splat = SplatSettings { kernel, visibility, order, ..SplatSettings::SHADE_FIRST };
    Scene { splat, ..scene }
}

fn back_to_front(mut scene: Scene) -> Scene {
    scene.splat.order = Order::BackToFront;
    scene
}

/// Of one colour without marks, so that what is seen of a splat does not change within a pixel: in perspective
/// splats are seen as in their middles.
fn smooth(scene: Scene) -> Scene {
    let colour = Srgb8([30, 200, 255]);
    with(scene, |layer| {
        layer.settings.mode = VectorMode::Blend;
        layer.settings.transfer.colour = ColourSource::Stops(vec![(0.0, colour), (10.0, colour)]);
        layer.settings.marks = Some(colour);
    })
}

/// In both orders and projections.
#[track_caller]
fn holds_every_way(name: &str, scene: Scene) {
    holds(name, &scene, AMONG);
    holds(&format!("{name}, back to front"), &back_to_front(scene.clone()), AMONG);
    let perspective = in_perspective(smooth(scene), 3.0);
    holds(&format!("{name}, perspective"), &perspective, SEEN);
}

#[test]
fn vectors_among_kernels_are_the_references_in_every_mode() {
    // Another kernel than the splats' own, which share their names of a kernel.
    for (kernel, visibility, sheets) in [
        (Kernel::Gaussian, EverySample, 1),
        (Kernel::Cubic, Sheets, 1),
        (Kernel::Gaussian, Sheets, 3),
        (Kernel::Gaussian, Slabs, 1),
    ] {
        let mut scene = beside(kernel, visibility);
        scene.splat.sheets_per_kernel = sheets;
        let name = format!("vectors among {} {} {sheets}", kernel.name(), visibility.name());
        holds_every_way(&name, scene);
    }
}

#[test]
fn vectors_among_boxes_and_separable_kernels_and_points_are_the_references() {
    for (kernel, visibility) in [
        (Kernel::Nearest, EverySample),
        (Kernel::Nearest, Sheets),
        (Kernel::BSpline, Slabs),
        (Kernel::Point, EverySample),
    ] {
        let scene = beside(kernel, visibility);
        let name = format!("vectors among {} {}", kernel.name(), visibility.name());
        holds(&format!("{name}, back to front"), &back_to_front(scene.clone()), AMONG);
        holds(&format!("{name}, perspective"), &in_perspective(smooth(scene), 3.0), SEEN);
    }
}

/// Slabs of another thickness than the slices', of two fields and with each field's own looks.
#[test]
fn two_fields_lie_among_kernels() {
    for (visibility, sheets) in [(EverySample, 1), (Sheets, 2), (Slabs, 1)] {
        let both = beside_field(crate::two_vectors::both());
        let mut scene = embedded(both, Kernel::Gaussian, visibility);
        (scene.splat.sheets_per_kernel, scene.splat.slabs_per_voxel) = (sheets, 1.7);
        let name = format!("two fields, {visibility:?} {sheets}");
        holds(&name, &if visibility == Sheets { back_to_front(scene) } else { scene }, AMONG);
    }
}

#[test]
fn vectors_are_seen_where_no_sample_shows() {
    for visibility in [EverySample, Slabs] {
        let clear = crate::polygons::clear(beside(Kernel::Cubic, visibility));
        holds(&format!("nothing else, {visibility:?}"), &clear, AMONG);
    }
}

/// From among the kernels, with slices on both sides of the eye; small splats some way before it.
#[test]
fn vectors_are_seen_from_within_the_kernels() {
    for (visibility, sheets) in [(EverySample, 1), (Sheets, 2), (Slabs, 1)] {
        for way in [1.0, -1.0] {
            let mut scene = in_perspective(smooth(beside(Kernel::Gaussian, visibility)), 80.0);
            scene.splat.sheets_per_kernel = sheets;
            scene.camera.parallel_scale = 0.9;
            scene.camera.direction *= way;
            let middle = scene.camera.focal_point + scene.camera.direction * 0.8;
            let spacing = DVec3::splat(0.15);
            let origin = middle - spacing * DVec3::new(3.0, 2.5, 2.0);
            let lattice = Lattice { spacing, origin, ..Lattice::unit([7, 6, 5]) };
            scene = with(scene, |l| l.field = crate::vectors::field(Places::Lattice(lattice), 3));
            let scene = if way < 0.0 { back_to_front(scene) } else { scene };
            holds(&format!("within, {visibility:?}, {way}"), &scene, SEEN);
        }
    }
}

#[test]
fn vectors_among_published_and_lit_samples_are_the_references() {
    for visibility in [EverySample, Slabs] {
        let mut scene = with(beside(Kernel::Cubic, visibility), |layer| {
            layer.settings.mode = VectorMode::Blend;
        });
        scene.splat.opacity_model = OpacityModel::Published;
        holds(&format!("published, {visibility:?}"), &scene, AMONG);
        scene.splat.opacity_model = OpacityModel::OpticalDepth;
        scene.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
        holds(&format!("lit, {visibility:?}"), &scene, AMONG);
    }
}

#[test]
fn polygons_vectors_and_kernels_lie_at_their_depths() {
    let Some(mut drawer) = drawer() else { return };
    for (visibility, is_lit) in [(EverySample, false), (Slabs, true)] {
        for order in [Order::FrontToBack, Order::BackToFront] {
            let mut scene = beside(Kernel::Gaussian, visibility);
            scene.splat.order = order;
            if is_lit {
                let lighting = Some(Lighting::default());
                scene.shading = Shading { lighting, ..Shading::default() };
            }
            let squares = layer(squares(&scene, 3, &[-1.1, -0.3, 0.17, 0.9]), 0.4);
            let scene = with_polygons(scene, [squares]);
            let expected = expected(&scene, PICTURE);
            let (found, _) = drawn(&mut drawer, &scene, PICTURE, Rung::Full);
            compares(&format!("all three, {visibility:?}, {order:?}"), &found, &expected, AMONG);
        }
    }
}

/// Without vectors the kernels are drawn as before they were seen.
#[test]
fn kernels_without_vectors_are_drawn_as_before() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let embedded = beside(Kernel::Cubic, Slabs);
    let plain = with_vectors(embedded.clone(), []);
    let (before, _) = drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    let bytes = drawer.engines.gpu().expect("a device").size_bytes();
    let (shown, _) = drawn(&mut drawer, &embedded, PICTURE, Rung::Full);
    assert!(shown != before && drawer.engines.gpu().expect("a device").vector_bytes() > 0);
    let (after, _) = drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    assert_eq!(after, before, "the same bits");
    assert_eq!(
        drawer.engines.gpu().expect("a device").size_bytes()
            - drawer.engines.gpu().expect("a device").list_bytes(),
        bytes
    );
    drawer.engines.gpu().expect("a device").time_passes();
    drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    let names: Vec<&str> =
        drawer.engines.gpu().expect("a device").times().iter().map(|pass| pass.name).collect();
    assert_eq!(names, ["gather_kernels"]);
}

#[test]
fn modes_of_triangles_refuse_vectors_in_a_sentence() {
    let Some(mut drawer) = drawer() else { return };
    for (change, found) in [
        ((|s| s.backend = Backend::Raster) as fn(&mut SplatSettings), "found --backend raster,"),
        (|s| s.kernel = Kernel::Gouraud, "found --kernel gouraud,"),
        (|s| s.extent = Some(12.0), "found --extent 12,"),
    ] {
        let mut scene = beside(Kernel::Cubic, EverySample);
        change(&mut scene.splat);
        let plan = Plan::of(&scene, PICTURE);
        let [refusal] = &plan.left_out[..] else { panic!("{:?}", plan.left_out) };
        let refused = refusal.to_string();
        assert!(refused.contains(found) && refused.contains("show the vectors alone"), "{refused}");
        // What is drawn is the field, as it is without them.
        let mut plain = scene.clone();
        plain.keep_vectors(0);
        let [without, alone] =
            [&scene, &plain].map(|scene| drawn(&mut drawer, scene, PICTURE, Rung::Full).0);
        assert_eq!(without, alone);
    }
}

/// Software adapters end loops after so many turns: what lies along a ray is then walked in more parts, and
/// never is anything left out, nor are means drawn.
#[test]
fn no_splat_of_a_long_list_is_left_out() {
    let deep = |count: usize, direction: DVec3| {
        let spacing = DVec3::splat(0.1);
        let lattice = Lattice { spacing, ..Lattice::unit([14, 14, count]) };
        let field = crate::vectors::field(Places::Lattice(lattice), 5);
        let mut scene = with(alone(), |layer| {
            layer.settings =
                VectorSettings { mode: VectorMode::Blend, ..crate::vectors::settings(&field) };
            layer.settings.transfer.opacity = vec![(0.0, 2e-3)];
            layer.field = field;
        });
        // Steps of 1.2 pixels, so that all are drawn.
        scene.camera = Camera::new(lattice.centre(), direction.normalize(), DVec3::Y, 0.4 / 1.2);
        let lattice = Lattice { spacing: spacing * 2.0, ..Lattice::unit([7, 7, count / 2]) };
        let values = (0..lattice.len()).map(|i| (random(7, i) * 255.99) as u8).collect();
        let mut scene = with_field(scene, volume(lattice, Samples::UInt8(values)));
        transfer_of(&mut scene).opacity = vec![(0.0, 0.0), (255.0, 0.02)];
        scene
    };
    let askew = beside_field(deep(90, DVec3::new(0.5, 0.4, -1.0)));
    let mut field = Scene { splat: SplatSettings::EXACT, ..askew.clone() };
    let mut slabs = embedded(askew, Kernel::Cubic, Slabs);
    (field.splat.slabs_per_voxel, slabs.splat.slabs_per_voxel) = (3.0, 3.0);
    for (name, scene) in
        [("alone", deep(200, DVec3::NEG_Z)), ("beside a field", field), ("among slabs", slabs)]
    {
        let Some(mut drawer) = drawer() else { return };
        const SIZE: [u32; 2] = [8, 8];
        drawer.prepare(&Plan::of(&scene, SIZE), &Ticket::new()).expect("prepared");
        let (found, how) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        assert_eq!(how.vectors_halved, 0, "{name}");
        let expected = expected(&scene, SIZE);
        let name = format!("long lists {name}");
        print_measured(&name, &found, &expected);
        assert_eq!(fault(&found, &expected, LONG), None, "{name}");
    }
}
