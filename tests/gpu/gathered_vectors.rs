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
    let scene = with(alone(), |layer| layer.alone = false);
    let order = Order::FrontToBack;
    let splat = SplatSettings { kernel, visibility, order, ..SplatSettings::SHADE_FIRST };
    Scene { splat, ..scene }
}

fn back_to_front(mut scene: Scene) -> Scene {
    scene.splat.order = Order::BackToFront;
    scene
}

#[test]
fn vectors_among_kernels_are_the_references_in_every_mode() {
    // Another kernel than the splats' own, which share their names of a kernel.
    for (kernel, visibility) in [
        (Kernel::Gaussian, EverySample),
        (Kernel::Cubic, Sheets),
        (Kernel::Gaussian, Slabs),
        (Kernel::Nearest, EverySample),
        (Kernel::BSpline, Slabs),
    ] {
        let name = format!("vectors among {} {}", kernel.name(), visibility.name());
        let scene = beside(kernel, visibility);
        holds(&name, &scene, CLOSE);
        holds(&format!("{name}, back to front"), &back_to_front(scene.clone()), CLOSE);
        let perspective = in_perspective(scene, 60.0);
        holds(&format!("{name}, perspective"), &perspective, CLOSE);
        holds(&format!("{name}, perspective, back"), &back_to_front(perspective), CLOSE);
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
    for visibility in [EverySample, Slabs] {
        for order in [Order::FrontToBack, Order::BackToFront] {
            let mut scene = beside(Kernel::Cubic, visibility);
            scene.splat.order = order;
            let light = |most_turns| {
                let mut context = context(Wishes::default())?;
                context.most_turns = most_turns;
                let mut drawer = Drawer::new(Renderer::new(context));
                // Lists are limited beside the rest of a ray.
                let light = drawn(&mut drawer, &scene, PICTURE, Rung::Full).0;
                Some((light, drawer.renderer.size_bytes()))
            };
            let (Some(whole), Some(parts)) = (light(None), light(Some(13_500))) else { return };
            println!("bytes {} {}", whole.1, parts.1);
            assert_eq!(whole.0, parts.0, "{visibility:?} {order:?}");
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
fn modes_without_room_for_vectors_are_refused_in_a_sentence() {
    let Some(mut drawer) = drawer() else { return };
    let change: [fn(&mut SplatSettings); 3] = [
        |s| s.backend = Backend::Raster,
        |s| s.kernel = Kernel::Gouraud,
        |s| (s.visibility, s.sheets_per_kernel) = (Sheets, 3),
    ];
    for change in change {
        let mut scene = beside(Kernel::Cubic, EverySample);
        change(&mut scene.splat);
        drawer.prepare(&scene, &Ticket::new()).expect("prepared");
        let refused = drawer.draw(&scene, PICTURE, Rung::Full, &mut ()).unwrap_err().to_string();
        assert!(refused.contains("found one of triangles or of several sheets"), "{refused}");
    }
}
