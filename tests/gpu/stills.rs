//! Still pictures: how far they are refined, and what they say of themselves.

use std::sync::OnceLock;

use glam::DVec3;
use voxsplat::accuracy::rmse;
use voxsplat::accuracy::sweep::Detail;
use voxsplat::core::colour::srgb_bytes;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::gpu::Wishes;
use voxsplat::reference::Reference;
use voxsplat::scene::{
    Backend, Background, Classify, Isosurface, OpacityModel, Scene, SplatSettings, Visibility,
};
use voxsplat::task::engine::Engine;
use voxsplat::task::still::{Refine, Still, StillError, StillRequest};
use voxsplat::volume::{Lattice, Samples};

use crate::support::*;

fn engine() -> Option<&'static Engine> {
    static ENGINE: OnceLock<Option<Engine>> = OnceLock::new();
    context(Wishes::default())?;
    ENGINE.get_or_init(|| Some(Engine::start(adapter(), || ()))).as_ref()
}

/// Smooth blobs: coarse nodes stand for them well.
fn blobs() -> Scene {
    let lattice = Lattice::unit([40, 36, 44]);
    let scene = scene(lattice, DVec3::new(0.35, -0.52, 0.78));
    let value = |i: usize| {
        let [x, y, z] = [i % 40, i / 40 % 36, i / 1440].map(|n| n as f64);
        let wave = (x * 0.3).sin() + (y * 0.25).sin() + (z * 0.35).sin();
        (100.0 + 50.0 * wave) as u8
    };
    with_field(scene, volume(lattice, Samples::UInt8((0..lattice.len()).map(value).collect())))
}

fn request(refine: Refine) -> StillRequest {
    StillRequest {
        scene: blobs(),
        size: [128, 96],
        refine,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    }
}

fn draw(engine: &Engine, request: StillRequest) -> Still {
    engine.still(request, &Ticket::new()).expect("a still")
}

#[test]
fn an_error_asked_for_is_kept_and_measured_with_fewer_kernels_for_greater_ones() {
    let Some(engine) = engine() else { return };
    let full = draw(engine, request(Refine::Full));
    let mut kernels = Vec::new();
    for max_error in [0.1, 0.03, 0.01, 1e-9] {
        let still = draw(engine, request(Refine::Error { max_error, of_voxels: true }));
        let told = still.measured_rmse.expect("it was asked for");
        let found = rmse(&wide(&still.light), &wide(&full.light)).expect("comparable");
        assert!(told <= max_error && (found - told).abs() < 1e-6, "{max_error}: {found} {told}");
        println!("measured rmse {found:.4} with {} kernels for {max_error}", still.drawn.kernels);
        kernels.push(still.drawn.kernels);
    }
    assert!(
        kernels.windows(2).all(|w| w[0] <= w[1]) && kernels[0] < kernels[3] / 10,
        "{kernels:?}"
    );
    assert_eq!(kernels[3], full.drawn.kernels);
}

#[test]
fn a_budget_gives_a_smaller_coarser_picture_of_the_size_asked_for() {
    let Some(engine) = engine() else { return };
    let mut large = request(Refine::Budget { budget_ms: 2.0 });
    large.size = [640, 480];
    let still = draw(engine, large);
    assert!(still.drawn.size[0] < 640 && still.drawn.size[1] < 480, "{:?}", still.drawn);
    assert!(still.drawn.kernels < still.kernels_active / 2, "{:?}", still.drawn);
    assert_eq!((still.light.len(), still.rgba.len()), (640 * 480, 640 * 480 * 4));
    let mut whole = request(Refine::Full);
    whole.size = [640, 480];
    let error = rmse(&wide(&still.light), &wide(&draw(engine, whole).light)).expect("comparable");
    println!("measured 2 ms of 640 × 480: rmse {error:.3}");
    assert!(error < 0.2, "it is the same scene: {error}");
}

#[test]
fn repeats_are_timed_and_change_nothing() {
    let Some(engine) = engine() else { return };
    let once = draw(engine, request(Refine::Full));
    let often =
        draw(engine, StillRequest { repeat: 3, time_passes: true, ..request(Refine::Full) });
    assert_eq!((once.frame_ms.len(), often.frame_ms.len()), (1, 4));
    assert!(often.frame_ms.iter().all(|&ms| ms > 0.0));
    assert!(once.light == often.light && once.rgba == often.rgba, "another picture");
    assert_eq!((once.passes.len(), once.timer), (0, None));
    let names: Vec<&str> = often.passes.iter().map(|p| p.name).collect();
    assert_eq!(names, ["count_segments", "scan_counts", "emit_kernels", "splat", "present"]);
    assert!(often.passes.iter().all(|p| p.runs > 0 && p.gpu_ms >= 0.0));
    assert!(often.timer.is_some());
}

#[test]
fn a_still_says_truly_what_was_drawn() {
    let Some(engine) = engine() else { return };
    let still = draw(engine, request(Refine::Full));
    let scene = blobs();
    let with_opacity = (0..volume_of(&scene).samples.len())
        .filter(|&i| {
            scene.transfer().expect("a field").opacity_at(volume_of(&scene).samples.get(i)) > 0.0
        })
        .count() as u64;
    assert_eq!((still.drawn.kernels, still.kernels_active), (with_opacity, with_opacity));
    assert!(with_opacity > 1000 && with_opacity < scene.lattice().len() as u64);
    assert_eq!((still.drawn.nodes, still.drawn.size, still.size), (0, [128, 96], [128, 96]));
    assert!(!still.adapter.is_empty() && still.pipelines >= 5);
    // The volume and the light at least.
    assert!(still.peak_gpu_bytes > 40 * 36 * 44 + 128 * 96 * 16, "{}", still.peak_gpu_bytes);
    assert_eq!(still.capped_opacities, 0);
}

/// Opacities of an octree cut are capped by lists, and those of the grid by gathering: both count.
/// Seen from a corner, kernels in one slab add up to more than 1.
#[test]
fn what_is_capped_is_counted_whatever_drew_it() {
    let Some(engine) = engine() else { return };
    let cut = Refine::Reduced { detail: Detail::Octree { max_error: 0.02 }, scale: 1.0 };
    for visibility in [Visibility::EverySample, Visibility::Sheets, Visibility::Slabs] {
        for (refine, backend) in [(Refine::Full, Backend::Tiles), (cut, Backend::Tiles)] {
            let still = |opacity_model, unit| {
                let mut request = request(refine);
                let splat = &mut request.scene.splat;
                (splat.visibility, splat.classify) = (visibility, Classify::Before);
                (splat.opacity_model, splat.opacity_unit_distance) = (opacity_model, Some(unit));
                draw(engine, request)
            };
            let capped = still(OpacityModel::Published, 0.2);
            let what = format!("{visibility:?} {refine:?}");
            println!("measured {what}: {} capped", capped.capped_sums);
            assert_eq!(capped.backend, backend, "{what}");
            assert!(capped.capped_sums > 100, "{what}: {}", capped.capped_sums);
            assert_eq!(still(OpacityModel::Published, 50.0).capped_sums, 0, "{what}");
            let depth = still(OpacityModel::OpticalDepth, 0.2);
            assert_eq!(depth.capped_sums, 0, "{what}");
            // A model that is ignored would draw the same.
            let apart = rmse(&wide(&depth.light), &wide(&capped.light)).expect("comparable");
            assert!(apart > 1e-3, "{what}: {apart}");
        }
    }
}

#[test]
fn a_cancelled_still_is_cancelled() {
    let Some(engine) = engine() else { return };
    let ticket = Ticket::new();
    ticket.cancel();
    let outcome = engine.still(request(Refine::Full), &ticket);
    assert_eq!(outcome.err(), Some(StillError::Cancelled));
    draw(engine, request(Refine::Full));
}

/// The bytes are the light over the background, by the device's arithmetic and by the host's.
#[test]
fn the_bytes_of_a_still_are_its_light_over_its_background() {
    let Some(engine) = engine() else { return };
    for background in [
        Background::Colour(Srgb8([3, 5, 9])),
        Background::Colour(Srgb8([250, 128, 20])),
        Background::Transparent,
    ] {
        for refine in [Refine::Full, Refine::Budget { budget_ms: 2.0 }] {
            let mut asked = request(refine);
            asked.scene.background = background;
            let still = draw(engine, asked);
            let expected = srgb_bytes(&still.light, background.light());
            assert_eq!(still.rgba.len(), expected.len());
            let most = still.rgba.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
            println!("measured bytes over {background:?}, {refine:?}: {most:?} apart");
            assert!(most <= Some(1), "{background:?} {refine:?}: {most:?}");
        }
    }
}

/// An opaque surface, whose silhouette ends within pixels: the mean of the reference at five places of each.
#[test]
fn edges_within_pixels_are_averaged_over_them() {
    let Some(engine) = engine() else { return };
    let mut asked = StillRequest { size: [48, 36], smooth_edges: true, ..request(Refine::Full) };
    asked.scene.splat = SplatSettings::EXACT;
    let surface = Isosurface { value: 110.0, opacity: 1.0, colour: None };
    asked.scene.inside.isosurfaces.push(surface);
    let found = draw(engine, asked.clone());
    assert!(found.smoothed_ms.is_some());
    let pixel = 2.0 * asked.scene.camera.parallel_scale / 36.0;
    let five = [[0.0, 0.0], [-0.4, -0.2], [-0.2, 0.4], [0.2, -0.4], [0.4, 0.2]];
    let truths = five.map(|[x, y]| {
        let mut scene = asked.scene.clone();
        let (right, up) = (scene.camera.right(), scene.camera.up);
        scene.camera.focal_point += (right * x + up * y) * pixel;
        Reference::new(&scene, asked.size.map(|n| n as usize)).expect("a mode").picture()
    });
    let mean =
        |i: usize| std::array::from_fn(|c| truths.iter().map(|t| t[i][c]).sum::<f64>() / 5.0);
    let mean: Vec<[f64; 4]> = (0..truths[0].len()).map(mean).collect();
    let plain = draw(engine, StillRequest { smooth_edges: false, ..asked });
    let plain = wide(&plain.light);
    let off = |one: &[[f64; 4]], other: &[[f64; 4]]| rmse(one, other).expect("comparable");
    let found = wide(&found.light);
    let [smooth, one] = [off(&found, &mean), off(&plain, &truths[0])];
    let [stepped, swapped] = [off(&plain, &mean), off(&found, &truths[0])];
    println!(
        "measured five rays {smooth:.1e}, one {one:.1e}, crosswise {stepped:.1e} {swapped:.1e}"
    );
    assert!(smooth < 1.1 * one.max(1e-4) && smooth < 0.75 * stepped.min(swapped));
}
