//! What is drawn while the view moves, beside the picture that it stands for.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::gpu::{PictureConstants, Renderer, SlabField, Wishes, tile_count};
use voxsplat::kernel::{Kernel, coefficients};
use voxsplat::plan::Plan;
use voxsplat::reference::Rays;
use voxsplat::scene::{Moving, Reconstruction, Scene, SplatSettings, View};
use voxsplat::task::cost::Costs;
use voxsplat::task::draw::{Drawer, Drawn, Rung};
use voxsplat::transfer::presets;
use voxsplat::volume::{Component, Lattice, Samples, demo};

use crate::support::{
    Light, context, drawn, reference, scene, transfer_of, volume, volume_of, wide, with_field,
    with_transfer,
};

const SIZE: [u32; 2] = [240, 200];

/// A smooth volume as the window opens it.
fn exact() -> Scene {
    let grid = demo::open("head:48", None).expect("a demo");
    let volume =
        grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).expect("a volume");
    let base = scene(volume.lattice, DVec3::new(0.4, 0.9, -0.3));
    let transfer = presets::default_for(&volume.statistics);
    let scene = with_transfer(with_field(base, volume.into()), transfer);
    Scene { splat: SplatSettings::EXACT, ..scene }
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
    assert!(hasty.is_reduced, "{hasty:?}");
    assert_eq!(hasty.size, [58, 48], "never fewer pixels, whatever the budget");

    // Measured: twice smaller 0.0107, bias 3e-5; the finest octree cut 0.0273, bias 0.0049.
    let against = |light: &Light| Difference::between(light, &full).expect("one size");
    let (light, reduced) =
        drawn(&mut drawer, &scene, SIZE, Rung::Reduced { field: SlabField::Own, shrink: 2.0 });
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
    transfer_of(&mut scene).opacity.iter_mut().for_each(|(_, alpha)| *alpha *= 0.5);
    let budget_ms = 1e9;
    let plan = Plan::of(&scene, SIZE);
    drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
    assert_eq!((drawer.active_count(), drawer.hierarchy_bytes()), (None, 0));
    let preview = drawer.draw(&plan, Rung::Coarse { budget_ms }, &mut ()).expect("drawn");
    let preview = (
        preview.is_reduced,
        wide(&drawer.engines.gpu().expect("a device").read_light().expect("read")),
    );
    let (full, _) = drawn(&mut drawer, &scene, SIZE, Rung::Full);
    assert_eq!(preview, (true, full), "of the transfer function as it is now");
    assert!(drawer.active_count().is_some_and(|count| count > 0), "at rest they are counted");
    transfer_of(&mut scene).opacity.iter_mut().for_each(|(_, alpha)| *alpha *= 0.5);
    drawer.prepare_preview(&Plan::of(&scene, SIZE), 1e-6, &ticket).expect("prepared");
    assert_eq!(drawer.hierarchy_bytes(), 0, "however little time there is");
    scene.splat = SplatSettings::SHADE_FIRST;
    drawer.prepare_preview(&Plan::of(&scene, SIZE), 1e-6, &ticket).expect("prepared");
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
        let (spacing, unit) = (scene.lattice().smallest_spacing(), scene.opacity_unit_distance());
        let renderer = drawer.engines.gpu().expect("a device");
        renderer.begin(&view, scene.splat.kernel, None, unit).expect("begun");
        let tiles = 0..tile_count(size);
        let constants =
            PictureConstants { unit_distance: unit, smallest_spacing: spacing, stop_below: 5e-4 };
        let drawn = renderer.draw_slab_tiles(SlabField::Own, &view, &scene.splat, constants, tiles);
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
    // Measured: 3.5e-7 rms and 2.2e-5 at most, and 0.31 where they are averaged.
    assert!(spread.rmse < 2e-6 && spread.max_abs < 1e-4, "{spread:?}");
    assert!(averaged.max_abs > 0.1, "{averaged:?}");
}

const TENTS: SplatSettings = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };

/// Which field is drawn within a budget, and how many times smaller, by made-up prices.
#[test]
fn tents_are_taken_where_the_own_field_would_be_much_smaller() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let mut scene = exact();
    scene.splat.cut.moving = Moving::Subsampled;
    let size = [480, 400];
    drawn(&mut drawer, &scene, size, Rung::Full);
    // Sizes change by eighths: the sixth roots of 2.
    let steps = |n: i32| (f64::from(n) / 6.0).exp2();
    let chosen_of = |drawer: &mut Drawer, scene: &Scene, size: [u32; 2], own: f64, tents: f64| {
        // Prices at which a millisecond affords a picture so many times smaller.
        let rays = f64::from(size[0]) * f64::from(size[1]);
        drawer.costs.reduced_start_ms = 0.0;
        drawer.costs.reduced_ray_ms = [own, tents].map(|shrink| shrink * shrink / rays);
        let plan = Plan::of(scene, size);
        drawer.prepare(&plan, &Ticket::new()).expect("prepared");
        let drawn = drawer.draw(&plan, Rung::Coarse { budget_ms: 1.0 }, &mut ());
        let Drawn { size: at, field, is_reduced, .. } = drawn.expect("drawn");
        is_reduced.then(|| (field, (f64::from(size[0]) / f64::from(at[0])).log2() * 6.0))
    };
    // In whole steps, as far as whole pixels allow.
    let chosen = |drawer: &mut Drawer, scene: &Scene, own: f64, tents: f64| {
        let (field, taken) = chosen_of(drawer, scene, size, own, tents)?;
        assert!((taken - taken.round()).abs() < 0.05, "{taken}");
        Some((field, taken.round()))
    };
    let (own, preview) = (SlabField::Own, SlabField::Preview);
    // Only the scene's own field is there.
    assert_eq!(chosen(&mut drawer, &scene, steps(13), 1.0), Some((own, 13.0)));
    let ticket = Ticket::new();
    let tents = coefficients(volume_of(&scene), Kernel::Linear, None, true, &ticket).expect("made");
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(preview, volume_of(&scene), &TENTS, tents, &ticket)
        .expect("set");

    assert_eq!(chosen(&mut drawer, &scene, 1.0, 1.0), Some((own, 0.0)), "whole");
    assert_eq!(chosen(&mut drawer, &scene, steps(8), steps(7)), Some((own, 8.0)));
    assert_eq!(chosen(&mut drawer, &scene, steps(9), steps(7)), Some((preview, 7.0)));
    // What was tents stays so for longer, and what was not, not.
    assert_eq!(chosen(&mut drawer, &scene, steps(8), steps(7)), Some((preview, 7.0)));
    assert_eq!(chosen(&mut drawer, &scene, steps(7), steps(7)), Some((own, 7.0)));
    assert_eq!(chosen(&mut drawer, &scene, steps(8), steps(7)), Some((own, 8.0)));
    // A size stays while it takes up to a tenth too long, or leaves a tenth of the next larger one's.
    let tents_at = |drawer: &mut Drawer, tents: f64| chosen(drawer, &scene, 40.0, tents);
    assert_eq!(tents_at(&mut drawer, steps(12)), Some((preview, 12.0)));
    assert_eq!(tents_at(&mut drawer, steps(12) * 1.09_f64.sqrt()), Some((preview, 12.0)));
    assert_eq!(tents_at(&mut drawer, steps(11) * 0.96_f64.sqrt()), Some((preview, 12.0)));
    assert_eq!(tents_at(&mut drawer, steps(11) * 0.89_f64.sqrt()), Some((preview, 11.0)));
    assert_eq!(tents_at(&mut drawer, steps(11) * 1.11_f64.sqrt()), Some((preview, 12.0)));
    // None is more than six times smaller, and then the cheaper one is taken.
    let least = |chosen: Option<(SlabField, f64)>| {
        let (field, steps) = chosen.expect("a field");
        assert!((steps - 6.0_f64.log2() * 6.0).abs() < 0.1, "{steps}");
        field
    };
    assert_eq!(least(chosen_of(&mut drawer, &scene, size, 100.0, 90.0)), preview);
    assert_eq!(least(chosen_of(&mut drawer, &scene, size, 90.0, 100.0)), own);
    // Another kernel's field is not there, but its tents are the same ones.
    scene.splat.kernel = Kernel::Cubic;
    assert_eq!(chosen(&mut drawer, &scene, 1.0, steps(9)), Some((preview, 9.0)));
    scene.splat.reconstruction = Reconstruction::Smooth;
    assert_eq!(chosen(&mut drawer, &scene, 1.0, 3.0), None, "a smooth field is not like them");
    // Another volume's are not.
    let copied = Arc::new((**volume_of(&scene)).clone());
    scene = Scene { splat: SplatSettings::EXACT, ..with_field(scene, copied) };
    assert_eq!(chosen(&mut drawer, &scene, 1.0, 1.0), None);
}

/// By the prices that a drawer begins with.
#[test]
fn a_thousandth_of_a_second_affords_the_smallest_picture_and_ten_seconds_the_whole_one() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let (mut scene, ticket) = (exact(), Ticket::new());
    scene.splat.cut.moving = Moving::Subsampled;
    drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let tents = coefficients(volume_of(&scene), Kernel::Linear, None, true, &ticket).expect("made");
    let preview = SlabField::Preview;
    drawer
        .engines
        .gpu()
        .expect("a device")
        .set_field(preview, volume_of(&scene), &TENTS, tents, &ticket)
        .expect("set");
    let costs = Costs::default();
    let mut coarse = |size: [u32; 2], budget_ms: f64| {
        drawer.costs = costs;
        drawer.draw(&Plan::of(&scene, size), Rung::Coarse { budget_ms }, &mut ()).expect("drawn")
    };
    // Less than waking the device takes: as few pixels as there may be.
    let least = coarse(SIZE, 1.0);
    assert_eq!((least.is_reduced, least.field, least.size[1]), (true, preview, 48));
    let whole = coarse(SIZE, 10_000.0);
    assert_eq!((whole.is_reduced, whole.field, whole.size), (true, SlabField::Own, SIZE));
    // A picture 48 pixels high is not drawn smaller: the field that is quicker where the own is not
    // affordable, as 2880 rays at 2 µs are 5.8 ms, and 1 ms for the picture.
    let small = coarse([60, 48], 4.0);
    assert_eq!((small.is_reduced, small.field, small.size), (true, preview, [60, 48]));
    let small = coarse([60, 48], 7.0);
    assert_eq!((small.is_reduced, small.field, small.size), (true, SlabField::Own, [60, 48]));
}

/// A single bright voxel among zeros, with prices at which rays are far apart: every view shows it.
#[test]
fn a_single_bright_voxel_is_in_every_preview() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let (n, at) = (160_usize, [51, 100, 74]);
    let mut values = vec![0_u8; n * n * n];
    values[(at[2] * n + at[1]) * n + at[0]] = 255;
    let base = scene(Lattice::unit([n; 3]), DVec3::new(0.4, 0.9, -0.3));
    let volume = volume(base.lattice(), Samples::UInt8(values));
    let transfer = presets::default_for(&volume.statistics);
    let mut scene = with_transfer(with_field(base, volume), transfer);
    scene.splat = SplatSettings::EXACT;
    drawer.prepare(&Plan::of(&scene, SIZE), &Ticket::new()).expect("prepared");
    drawn(&mut drawer, &scene, SIZE, Rung::Full);
    let mut reduced = 0;
    for turn in 0..24 {
        let angle = 0.05 * f64::from(turn);
        scene.camera.direction = DVec3::new(angle.cos(), 0.3, angle.sin()).normalize();
        for shrink in [1.2, 1.9, 3.5] {
            let budget_ms = 20.0;
            let rays = f64::from(SIZE[0] * SIZE[1]) / (shrink * shrink);
            drawer.costs = Costs {
                reduced_ray_ms: [budget_ms / rays; 2],
                reduced_start_ms: 0.0,
                ..Costs::default()
            };
            let (light, found) = drawn(&mut drawer, &scene, SIZE, Rung::Coarse { budget_ms });
            let brightest = light.iter().map(|p| p[3]).fold(0.0, f64::max);
            // Measured: 0.033 and more.
            assert!(brightest > 0.02, "{turn} {shrink}: {brightest} {found:?}");
            reduced += u32::from(found.is_reduced);
        }
    }
    assert_eq!(reduced, 48, "rays close to one another find it by themselves");
}

/// A solid box, opaque and not: within nodes nothing differs, and one of them would do but for its kernel, which is
/// as wide as the box.
#[test]
fn quick_pictures_of_a_solid_body_are_no_blur() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let n = 32;
    let base = scene(Lattice::unit([n; 3]), DVec3::new(0.4, 0.9, -0.3));
    let volume = volume(base.lattice(), Samples::UInt8(vec![255; n * n * n]));
    for opacity in [0.02, 0.3, 1.0] {
        let mut scene = with_field(base.clone(), volume.clone());
        scene.splat = SplatSettings::SHADE_FIRST;
        transfer_of(&mut scene).opacity = vec![(0.0, opacity)];
        let truth = reference(&scene, SIZE, Rays::Local);
        let mut rmse = |budget_ms| {
            drawer.costs = Costs::default();
            let (quick, found) = drawn(&mut drawer, &scene, SIZE, Rung::Coarse { budget_ms });
            let off = Difference::between(&shown(quick, &found), &truth).expect("one size");
            println!("measured {opacity} {budget_ms} ms: {} nodes, {off:?}", found.nodes);
            (off.rmse, found)
        };
        let (few, found) = rmse(0.5);
        assert!(found.nodes > 50, "{found:?}");
        let (many, _) = rmse(8.0);
        // Measured: 0.011 to 0.124 and 0.006 to 0.016, llvmpipe; one node for all of it 0.16.
        assert!(few < 0.14 && many < 0.02, "{opacity}: {few} {many}");
    }
}
