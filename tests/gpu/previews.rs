//! What is drawn while the view moves, beside the picture that it stands for.

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::{Renderer, SlabField, Wishes, tile_count};
use voxsplat::scene::{Scene, SplatSettings, View};
use voxsplat::task::draw::{Drawer, Drawn, Rung};
use voxsplat::transfer::presets;
use voxsplat::volume::{Component, demo};

use crate::support::{Light, context, drawn, scene, wide};

const SIZE: [u32; 2] = [240, 200];

/// A smooth volume as the window opens it.
fn exact() -> Scene {
    let grid = demo::open("head:48", None).expect("a demo");
    let volume =
        grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).expect("a volume");
    let base = scene(volume.lattice, DVec3::new(0.4, 0.9, -0.3));
    let transfer = presets::default_for(&volume.statistics);
    Scene { volume: volume.into(), transfer, splat: SplatSettings::EXACT, ..base }
}

/// The picture of `drawn`, enlarged as it is shown.
fn shown(light: Light, drawn: &Drawn) -> Light {
    let [w, h] = drawn.size.map(|n| n as usize);
    let place = |i: u32, to: u32, from: usize| {
        let x = ((f64::from(i) + 0.5) * from as f64 / f64::from(to) - 0.5)
            .clamp(0.0, (from - 1) as f64);
        (x as usize, (x as usize + 1).min(from - 1), x.fract())
    };
    let pixel = |x: u32, y: u32| -> [f64; 4] {
        let ((left, right, fx), (top, bottom, fy)) = (place(x, SIZE[0], w), place(y, SIZE[1], h));
        std::array::from_fn(|c| {
            let row = |y: usize| light[y * w + left][c] * (1.0 - fx) + light[y * w + right][c] * fx;
            row(top) * (1.0 - fy) + row(bottom) * fy
        })
    };
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

#[test]
fn a_reconstructed_field_is_previewed_in_its_own_mode_once_it_is_there() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = exact();
    let lavish = Rung::Coarse { budget_ms: 1e9 };
    let (_, before) = drawn(&mut drawer, &scene, SIZE, lavish);
    assert!(!before.is_reduced && before.nodes > 0, "no field yet: an octree cut, {before:?}");
    let (full, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let (preview, whole) = drawn(&mut drawer, &scene, SIZE, lavish);
    assert!(whole.is_reduced && whole.size == SIZE && whole.nodes == 0, "{whole:?}");
    assert_eq!(preview, full, "with all the time there is, the same bits");
    let (_, hasty) = drawn(&mut drawer, &scene, SIZE, Rung::Coarse { budget_ms: 1e-3 });
    assert!(!hasty.is_reduced, "a thousandth of a millisecond affords no rays: {hasty:?}");

    // Measured: twice smaller 0.0107, bias 3e-5; the finest octree cut 0.0273, bias 0.0049.
    let against = |light: &Light| Difference::between(light, &full).expect("one size");
    let (light, reduced) = drawn(&mut drawer, &scene, SIZE, Rung::Reduced { shrink: 2.0 });
    assert_eq!(reduced.size, [120, 100]);
    let reduced = against(&shown(light, &reduced));
    let (octree, _) = drawn(&mut drawer, &scene, SIZE, Rung::Octree { max_error: 0.0 });
    let octree = against(&octree);
    println!("measured reduced {reduced:?}\noctree {octree:?}");
    assert!(reduced.rmse < 0.5 * octree.rmse, "{reduced:?} {octree:?}");
    assert!(reduced.mean_brightness.abs() < 1.0 / 255.0, "{reduced:?}");
}

/// While a hand moves a transfer function, nothing is averaged that no preview needs.
#[test]
fn a_preview_in_the_own_mode_waits_for_no_hierarchy() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let (mut scene, ticket) = (exact(), Ticket::new());
    let (_, full) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    assert_eq!(drawer.active_count(), Some(full.kernels));
    scene.transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha *= 0.5);
    let budget_ms = 1e9;
    drawer.prepare_preview(&scene, SIZE, budget_ms, &ticket).expect("prepared");
    assert_eq!((drawer.active_count(), drawer.hierarchy_bytes()), (None, 0));
    let preview = drawer.draw(&scene, SIZE, Rung::Coarse { budget_ms }, &mut ()).expect("drawn");
    let preview = (preview.is_reduced, wide(&drawer.renderer.read_light().expect("read")));
    let (full, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    assert_eq!(preview, (true, full), "of the transfer function as it is now");
    assert!(drawer.active_count().is_some_and(|count| count > 0), "at rest they are counted");
    drawer.prepare_preview(&scene, SIZE, 1e-6, &ticket).expect("prepared");
    scene.transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha *= 0.5);
    drawer.prepare_preview(&scene, SIZE, 1e-6, &ticket).expect("prepared");
    assert!(drawer.hierarchy_bytes() > 0, "an octree cut needs its tree");
}

#[test]
fn shade_first_modes_are_previewed_by_octree_cuts() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = Scene { splat: SplatSettings::SHADE_FIRST, ..exact() };
    drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let (_, preview) = drawn(&mut drawer, &scene, SIZE, Rung::Coarse { budget_ms: 20.0 });
    assert!(!preview.is_reduced && preview.nodes > 0, "{preview:?}");
}

/// Kernels that are smaller than a pixel of what is drawn, but not of what is shown, are not
/// averaged: that would cost as much as the whole picture.
#[test]
fn a_smaller_picture_has_one_ray_a_pixel() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let scene = exact();
    let (small, large) = ([20, 18], [60, 54]);
    drawn(&mut drawer, &scene, large, Rung::Full);
    let mut light = |size: [u32; 2], enlarged: f64| {
        let view = View { enlarged, ..View::new(&scene, size) };
        let (spacing, unit) =
            (scene.volume.lattice.smallest_spacing(), scene.opacity_unit_distance());
        let renderer = &mut drawer.renderer;
        renderer.begin(&view, scene.splat.kernel, None, unit).expect("begun");
        let tiles = 0..tile_count(size);
        let drawn = renderer.draw_slab_tiles(
            SlabField::Own,
            &view,
            &scene.splat,
            unit,
            spacing,
            5e-4,
            tiles,
        );
        drawn.expect("drawn");
        wide(&renderer.read_light().expect("read"))
    };
    let radius = |size| 2.0 * View::new(&scene, size).voxel_pixels();
    assert!(radius(small) < 1.0 && radius(large) >= 1.0, "kernels are {} pixels", radius(small));
    // The middle one of every three pixels looks along the same ray.
    let all = light(large, 1.0);
    let middles: Light = (0..small[1] * small[0])
        .map(|i| all[((3 * (i / small[0]) + 1) * large[0] + 3 * (i % small[0]) + 1) as usize])
        .collect();
    let difference = |light: &Light| Difference::between(light, &middles).expect("one size");
    let (spread, averaged) = (difference(&light(small, 3.0)), difference(&light(small, 1.0)));
    println!("measured spread {spread:?}\naveraged {averaged:?}");
    // Measured: 2.4e-7, and 0.35 where they are averaged.
    assert!(spread.max_abs < 2e-6, "{spread:?}");
    assert!(averaged.max_abs > 0.1, "{averaged:?}");
}
