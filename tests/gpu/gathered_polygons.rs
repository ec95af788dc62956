//! Polygons among kernels that are shaded first, in every mode, against the float64 reference, which seats
//! them by their places in the lattice and splits what lies between two planes by its length.

use glam::{DVec3, Vec3};
use voxsplat::core::Camera;
use voxsplat::gpu::{Renderer, Wishes};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::polygons::Mesh;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Backend, Lighting, OpacityModel, Order, Scene, Shading, SplatSettings, View, Visibility,
};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::{Lattice, Samples};

use crate::polygons::{
    SIZE, WITHIN, agrees, both, clear, coloured, compares, exact, layer, shards,
};
use crate::support::{
    context, drawer, drawn, in_perspective, random, volume, with_field, with_polygons,
};

fn first(kernel: Kernel, visibility: Visibility, sheets: u32) -> Scene {
    let splat = SplatSettings {
        kernel,
        visibility,
        sheets_per_kernel: sheets,
        order: Order::FrontToBack,
        ..SplatSettings::SHADE_FIRST
    };
    with_polygons(Scene { splat, ..exact() }, both())
}

fn back_to_front(mut scene: Scene) -> Scene {
    scene.splat.order = Order::BackToFront;
    scene
}

use Visibility::{EverySample, Sheets, Slabs};

/// Every kind of layer, both orders and both projections.
#[test]
fn polygons_among_kernels_are_the_references_in_every_mode() {
    for (name, visibility, sheets) in [
        ("every sample", EverySample, 1),
        ("sheets", Sheets, 1),
        ("3 sheets", Sheets, 3),
        ("slabs", Slabs, 1),
    ] {
        let scene = first(Kernel::Cubic, visibility, sheets);
        agrees(&format!("{name}, front to back"), &scene, WITHIN);
        agrees(&format!("{name}, back to front"), &back_to_front(scene.clone()), WITHIN);
        let perspective = in_perspective(scene, 60.0);
        agrees(&format!("{name}, perspective"), &perspective, WITHIN);
        agrees(&format!("{name}, perspective, back"), &back_to_front(perspective), WITHIN);
    }
}

/// Boxes of less than a pixel are the mean of several rays.
#[track_caller]
fn by_rays(name: &str, scene: &Scene) {
    let Some(mut drawer) = drawer() else { return };
    let rays = View::new(scene, SIZE).rays_per_side(scene.splat.kernel, scene.splat.extent);
    let size = SIZE.map(|n| n as usize);
    let expected = Reference::supersampled(scene, size, rays as usize, false);
    let (found, _) = drawn(&mut drawer, scene, SIZE, Rung::Full);
    compares(name, &found, &expected.expect("a mode").picture(), WITHIN);
}

#[test]
fn polygons_among_boxes_and_separable_kernels_are_the_references() {
    for (kernel, visibility) in [
        (Kernel::Nearest, EverySample),
        (Kernel::Nearest, Sheets),
        (Kernel::Linear, Slabs),
        (Kernel::BSpline, Slabs),
    ] {
        let scene = first(kernel, visibility, 1);
        let name = format!("{} {}", kernel.name(), visibility.name());
        by_rays(&name, &in_perspective(scene.clone(), 50.0));
        by_rays(&format!("{name}, back to front"), &back_to_front(scene));
    }
    agrees("points", &first(Kernel::Point, EverySample, 1), WITHIN);
}

#[test]
fn published_opacities_are_split_at_polygons_on_all_samples_alike() {
    for (visibility, order) in [
        (EverySample, Order::BackToFront),
        (Slabs, Order::FrontToBack),
        (Slabs, Order::BackToFront),
    ] {
        let mut scene = first(Kernel::Gaussian, visibility, 1);
        scene.splat.opacity_model = OpacityModel::Published;
        scene.splat.order = order;
        agrees(&format!("published {visibility:?} {order:?}"), &scene, WITHIN);
    }
}

/// Lights shade the samples once for all rays, and fall on polygons too; where nothing of the field shows,
/// polygons do.
#[test]
fn lit_samples_and_fields_that_do_not_show_have_polygons_among_them() {
    let mut lit = first(Kernel::Cubic, Slabs, 1);
    lit.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
    agrees("lit", &lit, WITHIN);
    agrees("nothing shows", &clear(first(Kernel::Cubic, EverySample, 1)), WITHIN);
    let far = with_polygons(first(Kernel::Cubic, Slabs, 1), [layer(shards(10, 11, 3.0), 0.5)]);
    agrees("far beyond", &far, WITHIN);
}

/// From among the kernels, with slices on both sides of the eye.
#[test]
fn polygons_are_seen_from_within_the_volume() {
    for visibility in [EverySample, Slabs] {
        for way in [1.0, -1.0] {
            let mut scene = in_perspective(first(Kernel::Gaussian, visibility, 1), 80.0);
            scene.camera.parallel_scale = 0.9;
            scene.camera.direction *= way;
            let scene = with_polygons(scene, [layer(shards(30, 4, 0.9), 0.5)]);
            agrees(&format!("within, {visibility:?}, {way}"), &scene, WITHIN);
            agrees(&format!("within, {visibility:?}, {way}, back"), &back_to_front(scene), WITHIN);
        }
    }
}

/// In the plane of a slice, seen along its axis: it lies before that slice in every pixel.
#[test]
fn a_polygon_in_a_slice_lies_before_all_of_it() {
    let lattice = Lattice::unit([11, 9, 13]);
    let values = (0..lattice.len()).map(|i| (random(7, i) * 255.99) as u8).collect();
    let values = volume(lattice, Samples::UInt8(values));
    let mut scene = with_field(first(Kernel::Cubic, EverySample, 1), values);
    for direction in [DVec3::NEG_Z, DVec3::Z] {
        scene.camera = Camera::new(lattice.centre(), direction, DVec3::Y, 6.37);
        // Two slices beyond the middle, and one before it.
        let at = |depth: f64, [x, y]: [f64; 2]| {
            let across = DVec3::new(x, y, 0.0) * 5.0;
            (lattice.centre() + across + direction * depth).as_vec3()
        };
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let positions: Vec<Vec3> =
            [2.0, -1.0].into_iter().flat_map(|d| corners.map(|c| at(d, c))).collect();
        let triangles = [0, 4].into_iter().flat_map(|i| [[i, i + 1, i + 2], [i, i + 2, i + 3]]);
        let mesh =
            Mesh::new("flat", positions, Vec::new(), Vec::new(), triangles.collect::<Vec<_>>());
        let flat = coloured(layer(mesh.expect("a mesh"), 0.7), [250, 220, 30]);
        scene = with_polygons(scene, [flat]);
        for visibility in [EverySample, Sheets] {
            scene.splat.visibility = visibility;
            agrees(&format!("in a slice along {direction}, {visibility:?}"), &scene, WITHIN);
        }
    }
}

/// What the mode converges to meets them too.
#[test]
fn fine_slabs_of_kernels_come_to_the_continuous_integral_with_polygons() {
    let Some(mut drawer) = drawer() else { return };
    for kernel in [Kernel::Gaussian, Kernel::Linear] {
        let mut scene = first(kernel, Slabs, 1);
        let limit = Reference::exact(&scene, SIZE.map(|n| n as usize)).expect("a mode").picture();
        scene.splat.slabs_per_voxel = 16.0;
        let (found, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
        compares(&format!("16 slabs a voxel, {}", kernel.name()), &found, &limit, WITHIN);
    }
}

/// Without polygons everything is as before they were seen; who draws is not asked for beside them.
#[test]
fn kernels_without_polygons_are_drawn_as_before() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    for visibility in [EverySample, Slabs] {
        let embedded = first(Kernel::Cubic, visibility, 1);
        let plain = with_polygons(embedded.clone(), []);
        let held = |drawer: &Drawer| {
            (
                drawer.engines.made_gpu().expect("a device").pipeline_count(),
                drawer.engines.made_gpu().expect("a device").size_bytes(),
            )
        };
        let (before, _) = drawn(&mut drawer, &plain, SIZE, Rung::Full);
        let (pipelines, bytes) = held(&drawer);
        let (shown, _) = drawn(&mut drawer, &embedded, SIZE, Rung::Full);
        assert!(shown != before && drawer.engines.gpu().expect("a device").polygon_bytes() > 0);
        let more = drawer.engines.gpu().expect("a device").pipeline_count() - pipelines;
        // The walk, and once the two passes over pixels.
        assert_eq!(more, if visibility == EverySample { 3 } else { 1 });
        let mut hidden = embedded;
        hidden.layers.iter_mut().filter(|l| l.look.is_surface()).for_each(|l| l.is_shown = false);
        let (after, _) = drawn(&mut drawer, &hidden, SIZE, Rung::Full);
        assert_eq!(after, before, "the same bits");
        assert_eq!(held(&drawer).1, bytes, "let go of");
    }
}

/// What only triangles draw has none.
#[test]
fn modes_of_triangles_refuse_polygons_in_a_sentence() {
    let scene = first(Kernel::Cubic, EverySample, 1);
    assert_eq!(scene.refusals(), []);
    for (change, found) in [
        ((|s| s.backend = Backend::Raster) as fn(&mut SplatSettings), "found --backend raster,"),
        (|s| s.kernel = Kernel::Gouraud, "found --kernel gouraud,"),
        (|s| s.extent = Some(12.0), "found --extent 12,"),
    ] {
        let mut scene = scene.clone();
        change(&mut scene.splat);
        let refused = scene.refusals().first().expect("triangles").to_string();
        assert!(refused.contains(found) && refused.contains("leave the polygons out"), "{refused}");
        assert_eq!(Plan::of(&scene, SIZE).surfaces, []);
    }
}
