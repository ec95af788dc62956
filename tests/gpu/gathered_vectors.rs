//! Vector splats among kernels that are shaded first, in every mode, against the float64 reference, which
//! seats what a slab has of them in its middle, or puts it into the slabs of the kernels.

use voxsplat::core::Ticket;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    Backend, Lighting, OpacityModel, Order, Scene, Shading, SplatSettings, Visibility,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::vector::VectorMode;

use Visibility::{EverySample, Sheets, Slabs};

use crate::polygons::{compares, layer, squares};
use crate::support::{context, drawer, drawn, in_perspective};
use crate::vectors::{CLOSE, PICTURE, alone, expected, holds, with};

fn beside(kernel: Kernel, visibility: Visibility) -> Scene {
    embedded(with(alone(), |layer| layer.alone = false), kernel, visibility)
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

/// In both orders and projections.
#[track_caller]
fn holds_every_way(name: &str, scene: Scene) {
    holds(name, &scene, CLOSE);
    holds(&format!("{name}, back to front"), &back_to_front(scene.clone()), CLOSE);
    let perspective = in_perspective(scene, 60.0);
    holds(&format!("{name}, perspective"), &perspective, CLOSE);
    holds(&format!("{name}, perspective, back"), &back_to_front(perspective), CLOSE);
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
        holds(&name, &in_perspective(scene.clone(), 50.0), CLOSE);
        holds(&format!("{name}, back to front"), &back_to_front(scene), CLOSE);
    }
}

/// Slabs of another thickness than the slices', of two fields and with each field's own looks.
#[test]
fn two_fields_lie_among_kernels() {
    for (visibility, sheets) in [(EverySample, 1), (Sheets, 2), (Slabs, 1)] {
        let both = with(crate::two_vectors::both(), |layer| layer.alone = false);
        let mut scene = embedded(both, Kernel::Gaussian, visibility);
        (scene.splat.sheets_per_kernel, scene.splat.slabs_per_voxel) = (sheets, 1.7);
        let name = format!("two fields, {visibility:?} {sheets}");
        holds(&name, &in_perspective(scene.clone(), 60.0), CLOSE);
        holds(&format!("{name}, back"), &back_to_front(scene), CLOSE);
    }
}

/// Where nothing of the scalar field shows, its vectors do; and from among both, with slices on each side
/// of the eye.
#[test]
fn vectors_are_seen_where_no_sample_shows_and_from_within() {
    for visibility in [EverySample, Slabs] {
        let clear = crate::polygons::clear(beside(Kernel::Cubic, visibility));
        holds(&format!("nothing else, {visibility:?}"), &clear, CLOSE);
        for way in [1.0, -1.0] {
            let mut scene = in_perspective(beside(Kernel::Gaussian, visibility), 80.0);
            scene.camera.parallel_scale = 0.9;
            scene.camera.direction *= way;
            holds(&format!("within, {visibility:?}, {way}"), &scene, CLOSE);
            holds(&format!("within, {visibility:?}, {way}, back"), &back_to_front(scene), CLOSE);
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
        holds(&format!("published, {visibility:?}"), &scene, CLOSE);
        scene.splat.opacity_model = OpacityModel::OpticalDepth;
        scene.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
        holds(&format!("lit, {visibility:?}"), &scene, CLOSE);
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
            scene.polygons = vec![layer(squares(&scene, 3, &[-1.1, -0.3, 0.17, 0.9]), 0.4)];
            let expected = expected(&scene, PICTURE);
            let (found, _) = drawn(&mut drawer, &scene, PICTURE, Rung::Full);
            compares(&format!("all three, {visibility:?}, {order:?}"), &found, &expected, CLOSE);
        }
    }
}

/// Bits of rays that are walked in parts.
#[test]
fn rays_in_parts_meet_the_same_vectors() {
    for (kernel, visibility, turns) in [
        (Kernel::Cubic, EverySample, 13_500),
        (Kernel::Nearest, EverySample, 13_500),
        (Kernel::Cubic, Slabs, 13_500),
    ] {
        for order in [Order::FrontToBack, Order::BackToFront] {
            let mut scene = beside(kernel, visibility);
            scene.splat.order = order;
            scene.polygons = vec![layer(squares(&scene, 3, &[-0.3, 0.9]), 0.4)];
            let light = |most_turns| {
                let mut context = context(Wishes::default())?;
                context.most_turns = most_turns;
                let mut drawer = Drawer::new(Renderer::new(context));
                drawer.renderer.time_passes().expect("it times");
                let light = drawn(&mut drawer, &scene, PICTURE, Rung::Full).0;
                let times = drawer.renderer.times();
                let parts = times.iter().filter(|pass| pass.name.starts_with("gather_")).count();
                Some((light, parts, drawer.renderer.size_bytes()))
            };
            let (Some(whole), Some(parts)) = (light(None), light(Some(turns))) else { return };
            let name = format!("{kernel:?} {visibility:?} {order:?}");
            println!("{name}: {} {} passes, {} {} bytes", whole.1, parts.1, whole.2, parts.2);
            assert!(parts.2 > whole.2, "{name}: something is kept between parts");
            assert_eq!(whole.0, parts.0, "{name}");
        }
    }
}

/// Without vectors the kernels are drawn as before they were seen.
#[test]
fn kernels_without_vectors_are_drawn_as_before() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let embedded = beside(Kernel::Cubic, Slabs);
    let plain = Scene { vectors: None, ..embedded.clone() };
    let (before, _) = drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    let bytes = drawer.renderer.size_bytes();
    let (shown, _) = drawn(&mut drawer, &embedded, PICTURE, Rung::Full);
    assert!(shown != before && drawer.renderer.vector_bytes() > 0);
    let (after, _) = drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    assert_eq!(after, before, "the same bits");
    assert_eq!(drawer.renderer.size_bytes() - drawer.renderer.list_bytes(), bytes);
    drawer.renderer.time_passes().expect("it times");
    drawn(&mut drawer, &plain, PICTURE, Rung::Full);
    let names: Vec<&str> = drawer.renderer.times().iter().map(|pass| pass.name).collect();
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
        drawer.prepare(&scene, &Ticket::new()).expect("prepared");
        let refused = drawer.draw(&scene, PICTURE, Rung::Full, &mut ()).unwrap_err().to_string();
        assert!(refused.contains(found) && refused.contains("show the vectors alone"), "{refused}");
    }
}
