//! Small things in pictures with few rays: single voxels beside large bodies must not vanish.

use glam::DVec3;
use voxsplat::core::{Camera, Ticket};
use voxsplat::gpu::{PictureConstants, Renderer, SlabField, Wishes, tile_count};
use voxsplat::kernel::{Kernel, nearest_tents};
use voxsplat::plan::Plan;
use voxsplat::scene::{AlongRay, Scene, SplatSettings, View};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::preview_field;
use voxsplat::volume::{Lattice, Samples};

use crate::support::{
    Light, context, drawn, random, scene, transfer_of, volume, volume_of, wide, with_field,
};

const N: usize = 120;
/// Of whole pictures.
const SIZE: [u32; 2] = [160, 160];
const TENTS: SplatSettings = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };

/// Voxels that are set, beside a ball if there is one.
fn scene_of(has_ball: bool, voxels: &[[usize; 3]]) -> Scene {
    scene_among(0, has_ball, voxels)
}

/// The same where all else is `back`.
fn scene_among(back: u8, has_ball: bool, voxels: &[[usize; 3]]) -> Scene {
    let is_set = |i: usize| {
        let at = [i % N, i / N % N, i / (N * N)];
        let off = DVec3::from_array(at.map(|n| n as f64)) - DVec3::new(36.0, 60.0, 60.0);
        (has_ball && off.length() < 30.0) || voxels.contains(&at)
    };
    let values = (0..N * N * N).map(|i| if is_set(i) { 255 } else { back }).collect();
    let base = scene(Lattice::unit([N; 3]), DVec3::Y);
    let volume = volume(base.lattice(), Samples::UInt8(values));
    Scene { splat: SplatSettings::EXACT, ..with_field(base, volume) }
}

fn seen_along(scene: &Scene, direction: DVec3) -> Scene {
    let Camera { focal_point, parallel_scale, projection, .. } = scene.camera;
    let camera = Camera::new(focal_point, direction, DVec3::Z, parallel_scale);
    Scene { camera: Camera { projection, ..camera }, ..scene.clone() }
}

/// A drawer that has both fields of a scene.
fn drawer_of(scene: &Scene) -> Option<Drawer> {
    let mut drawer = Drawer::new(Renderer::new(context(Wishes::default())?));
    drawn(&mut drawer, scene, SIZE, Rung::Full);
    let ticket = Ticket::new();
    let tents = nearest_tents(volume_of(scene), &ticket).expect("made");
    let set = drawer.engines.gpu().expect("a device").set_field(
        SlabField::Preview,
        volume_of(scene),
        &TENTS,
        tents,
        &ticket,
    );
    set.expect("set");
    Some(drawer)
}

/// Light within so many voxels of one of a picture in parallel, in squares of a voxel's edge.
fn light_about(light: &Light, size: [u32; 2], scene: &Scene, at: [usize; 3], reach: f64) -> f64 {
    let view = View::new(scene, size);
    let index = DVec3::from_array(at.map(|n| n as f64));
    let place = view.view_from_index * (index - view.lattice_centre) + view.view_centre;
    let half = size.map(|n| f64::from(n) / 2.0);
    let middle = [half[0] + place.x, half[1] - place.y];
    let reach = reach * view.voxel_pixels();
    let mut sum = 0.0;
    for (i, pixel) in light.iter().enumerate() {
        let at = [i as u32 % size[0], i as u32 / size[0]].map(|n| f64::from(n) + 0.5);
        if (at[0] - middle[0]).abs().max((at[1] - middle[1]).abs()) < reach {
            sum += pixel[3];
        }
    }
    sum / view.voxel_pixels().powi(2)
}

/// Rays 1 to 3.3 voxels apart; a voxel far from a ball, and one whose bricks touch the ball's.
#[test]
fn a_bright_voxel_beside_a_body_keeps_its_light_in_every_preview() {
    let voxels = [[100, 70, 50], [69, 50, 90]];
    let plain = scene_of(true, &voxels);
    let Some(mut drawer) = drawer_of(&plain) else { return };
    let (own, preview) = (SlabField::Own, SlabField::Preview);
    let (mut off, mut exact) = (Vec::new(), Vec::new());
    for turn in 0..4 {
        let turn = f64::from(turn);
        let direction = DVec3::new(0.1 * turn - 0.2, 1.0, 0.07 * turn - 0.1);
        let scene = seen_along(&plain, direction);
        // From near by, five pixels a voxel.
        let whole = voxels.map(|at| {
            let mut near = scene.clone();
            near.camera.focal_point = plain.lattice().world_from_index(at.map(|n| n as f64).into());
            near.camera.parallel_scale = 8.0;
            [own, preview].map(|field| {
                let rung = Rung::Reduced { field, shrink: 1.0 };
                let (light, found) = drawn(&mut drawer, &near, [80, 80], rung);
                light_about(&light, found.size, &near, at, 7.0)
            })
        });
        for field in [own, preview] {
            for shrink in [3.0, 6.5, 10.0] {
                let rung = Rung::Reduced { field, shrink };
                let (light, found) = drawn(&mut drawer, &scene, [480, 480], rung);
                for (at, whole) in voxels.into_iter().zip(whole) {
                    if field == own && at == voxels[1] {
                        // Sharpened splines reach further: what is near a body is a part of it.
                        continue;
                    }
                    let found = light_about(&light, found.size, &scene, at, 7.0);
                    let name = format!("{at:?} {turn} {field:?} {shrink}");
                    off.push((found / whole[field as usize], name.clone()));
                    exact.push((found / whole[0], name));
                }
            }
        }
    }
    // Measured: 0.59 to 1.50 of the same field's, 0.66 to 1.36 of the exact one's; without marks, 0 and more.
    let most = 2.0;
    for ratios in [&mut off, &mut exact] {
        ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
        println!("measured {:?} to {:?}", &ratios[0], &ratios[ratios.len() - 1]);
        let is_kept = |ratio: f64| ratio > 1.0 / most && ratio < most;
        assert!(ratios.iter().all(|(ratio, _)| is_kept(*ratio)));
    }
}

fn constants(scene: &Scene) -> PictureConstants {
    PictureConstants {
        unit_distance: scene.opacity_unit_distance(),
        smallest_spacing: scene.lattice().smallest_spacing(),
        stop_below: 5e-4,
    }
}

/// One ray a pixel, and more where a picture is marked; how many more.
fn rays(drawer: &mut Drawer, scene: &Scene, size: [u32; 2], most: Option<u64>) -> (Light, u64) {
    let view = View { enlarged: 16.0, ..View::new(scene, size) };
    let (field, constants) = (SlabField::Preview, constants(scene));
    let scene = &Scene { splat: TENTS, ..scene.clone() };
    let renderer = drawer.engines.gpu().expect("a device");
    renderer.begin_plan(&Plan::of(scene, size)).expect("begun");
    let more = most.map_or(0, |most| renderer.mark_specks(field, &view, &scene.splat, most));
    renderer.begin(&view, scene.splat.kernel, None, constants.unit_distance).expect("begun");
    let tiles = 0..tile_count(size);
    renderer.draw_slab_tiles(field, &view, &scene.splat, constants, tiles).expect("drawn");
    (wide(&renderer.read_light().expect("read")), more)
}

/// Light of a lone voxel of 255 among `back`, in squares of a voxel's edge, where opacities rise from 0 at
/// `first` to 0.9 at 255: of the interpolating spline about it, whose coefficients are √3 zᵏ along each
/// axis, along parallel rays a 20th of a voxel apart in steps as long. In float64, and by nothing of the program's.
fn true_light(back: f64, first: f64) -> f64 {
    const STEPS: i32 = 40;
    let pole = 3.0_f64.sqrt() - 2.0;
    let bspline = |x: f64| match x.abs() {
        x if x < 1.0 => 2.0 / 3.0 - x * x + x * x * x / 2.0,
        x if x < 2.0 => (2.0 - x).powi(3) / 6.0,
        _ => 0.0,
    };
    let through: Vec<f64> = (-STEPS..STEPS)
        .map(|i| (f64::from(i) + 0.5) / 20.0)
        .map(|x| {
            let share = |k: i32| 3.0_f64.sqrt() * pole.powi(k.abs()) * bspline(x - f64::from(k));
            (-12..=12).map(share).sum()
        })
        .collect();
    let extinction = |part: f64| {
        let above = (back + (255.0 - back) * part - first) / (255.0 - first);
        -(-0.9 * above.clamp(0.0, 1.0)).ln_1p()
    };
    let ray = |x: f64, y: f64| {
        let depth: f64 = through.iter().map(|z| extinction(x * y * z)).sum();
        -(-depth / 20.0).exp_m1() / 400.0
    };
    through.iter().flat_map(|&x| through.iter().map(move |&y| (x, y))).map(|(x, y)| ray(x, y)).sum()
}

/// Of volumes of more than 21 million samples previews show means: of 8 voxels each, or of 64. However late opacities begin,
/// and whatever all else is, the voxel stays: rays 0.7 to 10 voxels apart.
#[test]
fn a_bright_voxel_among_means_stays_however_late_opacities_begin() {
    let ticket = Ticket::new();
    for (back, first, has_ball) in
        [(0, 60.0, true), (0, 150.0, true), (0, 200.0, true), (199, 200.0, false)]
    {
        let truth = true_light(f64::from(back), first);
        let at = [101, 70, 51];
        let mut scene = seen_along(&scene_among(back, has_ball, &[at]), DVec3::new(0.1, 1.0, 0.2));
        transfer_of(&mut scene).opacity = vec![(first, 0.0), (255.0, 0.9)];
        let Some(mut drawer) = drawer_of(&scene) else { return };
        for level in 1..3 {
            let means = preview_field(volume_of(&scene), level, &ticket).expect("made");
            let (volume, renderer) = (volume_of(&scene), drawer.engines.gpu().expect("a device"));
            let field = SlabField::Preview;
            renderer.set_field(field, volume, &TENTS, means, &ticket).expect("set");
            for shrink in [1.5, 6.5, 24.0] {
                let rung = Rung::Reduced { field, shrink };
                let (light, drawn) = drawn(&mut drawer, &scene, [480, 480], rung);
                let found = light_about(&light, drawn.size, &scene, at, 14.0) / truth;
                let name = format!("{back}, from {first}, means of {}³, {shrink}", 1 << level);
                println!("measured {name}: {found:.3} of {truth:.3}");
                // Measured: 0.91 to 2.34; but of 64 among 199, whose mean is hardly less than what shows, 8.9 to 9.3.
                let most = if (back, level) == (199, 2) { 11.0 } else { 2.8 };
                assert!(found > 0.7 && found < most, "{name}: {found}");
            }
        }
    }
}

/// A marked pixel is the mean of rays, all others are the ray through their middle.
#[test]
fn marked_pixels_are_means_of_rays_and_others_are_what_they_were() {
    let at = [100, 70, 50];
    let mut plain = seen_along(&scene_of(true, &[at]), DVec3::new(0.1, 1.0, 0.2));
    plain.camera.parallel_scale = 55.0;
    let Some(mut drawer) = drawer_of(&plain) else { return };
    let mut greatest = plain.clone();
    greatest.inside.along = AlongRay::Maximum;
    for scene in [plain, greatest] {
        // 1.375 voxels a pixel.
        let (small, fine) = ([80, 80], [240, 240]);
        drawn(&mut drawer, &scene, small, Rung::Reduced { field: SlabField::Preview, shrink: 2.0 });
        let (unmarked, none) = rays(&mut drawer, &scene, small, None);
        let (all, _) = rays(&mut drawer, &scene, fine, None);
        let (marked, more) = rays(&mut drawer, &scene, small, Some(4000));
        assert!(none == 0 && more > 0 && more % 64 == 0 && more <= 60 * 64, "{more}");
        let (mut changed, mut most) = (0, 0.0_f64);
        for (i, (marked, unmarked)) in marked.iter().zip(&unmarked).enumerate() {
            let [x, y] = [i % 80, i / 80];
            if marked == unmarked {
                continue;
            }
            changed += 1;
            for c in 0..4 {
                let block = (0..9).map(|k| all[(3 * y + k / 3) * 240 + 3 * x + k % 3][c]);
                most = most.max((block.sum::<f64>() / 9.0 - marked[c]).abs());
            }
        }
        println!("measured {most:e} in {changed} pixels of {}", more / 8);
        // Measured: 2.9e-8.
        assert!(most < 2e-6, "{most}");
        assert!(changed > 0 && changed <= more / 8, "{changed} {more}");
        // Nor are marks drawn with another picture than the one they were made for.
        let (after, _) = rays(&mut drawer, &scene, [79, 80], None);
        drawer.engines.gpu().expect("a device").mark_specks(
            SlabField::Preview,
            &View::new(&scene, small),
            &TENTS,
            4000,
        );
        assert_eq!(rays(&mut drawer, &scene, [79, 80], None).0, after);
    }
}

/// What has nothing small in it is drawn, and stored, as before; and what is nothing but specks gets
/// no more rays than it may.
#[test]
fn bodies_get_no_more_rays_and_dust_beyond_what_is_allowed_neither() {
    let direction = DVec3::new(0.3, 1.0, 0.2);
    let body = seen_along(&scene_of(true, &[]), direction);
    let Some(mut drawer) = drawer_of(&body) else { return };
    drawn(&mut drawer, &body, SIZE, Rung::Reduced { field: SlabField::Preview, shrink: 6.0 });
    let size = [24, 24];
    let (before, _) = rays(&mut drawer, &body, size, None);
    let bytes = drawer.engines.gpu().expect("a device").size_bytes();
    let (after, more) = rays(&mut drawer, &body, size, Some(u64::MAX));
    assert_eq!((more, drawer.engines.gpu().expect("a device").size_bytes()), (0, bytes));
    assert!(before == after && before.iter().any(|p| p[3] > 0.5));

    let dust = |i: usize| if random(9, i) < 1e-4 { 255 } else { 0 };
    let samples = Samples::UInt8((0..N * N * N).map(dust).collect());
    let dusty = with_field(body.clone(), volume(body.lattice(), samples));
    let Some(mut drawer) = drawer_of(&dusty) else { return };
    let rung = Rung::Reduced { field: SlabField::Preview, shrink: 6.0 };
    let (light, _) = drawn(&mut drawer, &dusty, SIZE, rung);
    assert!(light.iter().any(|p| p[3] > 0.0));
    // Of dust, rays meet what they meet: more of them for a part of it would be of no use.
    let (_, more) = rays(&mut drawer, &dusty, size, Some(24 * 24 / 2));
    assert_eq!(more, 0);
    let (_, more) = rays(&mut drawer, &dusty, size, Some(u64::MAX));
    assert!(more > 24 * 24, "{more}");
}
