//! How a field's coefficients are stored: 16 bits with their neighbour, 16 bits alone, or 32 bits,
//! in one buffer or in several. A device whose buffers are small makes small volumes take every way.

use glam::DVec3;
use voxsplat::core::Ticket;
use voxsplat::gpu::{GpuError, Renderer};
use voxsplat::kernel::Kernel;
use voxsplat::plan::Plan;
use voxsplat::scene::{Classify, Scene, SplatSettings};
use voxsplat::task::draw::{DrawError, Drawer, Rung};
use voxsplat::task::engines::Canvas as _;
use voxsplat::volume::{Lattice, Samples};

use crate::hard_scenes::{EXACT, SMALL, held};
use crate::support::*;

/// With two mirrored samples about it, as B-splines need them: 15 · 13 · 17 = 3315.
const DIMS: [usize; 3] = [11, 9, 13];
const COUNT: usize = 11 * 9 * 13;

/// A drawer of its own with buffers of at most so many bytes.
fn limited(bytes: u64) -> Option<Drawer> {
    let mut context = context(ON_HOST)?;
    context.limits.max_storage_buffer_binding_size = bytes;
    Some(Drawer::new(Renderer::new(context)))
}

fn with_samples(samples: Samples, scale: f64, offset: f64) -> Scene {
    let lattice = Lattice::unit(DIMS);
    let scene = scene(lattice, DVec3::new(-0.6, 0.3, -0.7));
    let scene = with_transfer(with_field(scene, volume(lattice, samples)), moved(scale, offset));
    Scene { splat: SplatSettings::EXACT, ..scene }
}

/// 0..256, one a sample.
fn values() -> impl Iterator<Item = f64> {
    (0..COUNT).map(|i| random(11, i) * 256.0)
}

/// The pictures of B-splines and tents, with buffers of at most so many bytes.
fn pictures(scene: &Scene, bytes: u64) -> Option<(Vec<Light>, u64)> {
    let mut drawer = limited(bytes)?;
    let tents =
        SplatSettings { kernel: Kernel::Linear, classify: Classify::After, ..SplatSettings::EXACT };
    let pictures = [SplatSettings::EXACT, tents].map(|splat| {
        let scene = Scene { splat, ..scene.clone() };
        drawn(&mut drawer, &scene, SMALL, Rung::Full).0
    });
    Some((pictures.to_vec(), drawer.engines.gpu().expect("a device").peak_bytes()))
}

#[track_caller]
fn is_refused(scene: &Scene, bytes: u64) {
    let Some(mut drawer) = limited(bytes) else { return };
    let plan = Plan::of(scene, SMALL);
    let refused = drawer
        .prepare(&plan, &Ticket::new())
        .and_then(|_| drawer.draw(&plan, Rung::Full, &mut ()).map(drop));
    let is_too_large = matches!(
        refused,
        Err(DrawError::Gpu(GpuError::TooLarge { what: "a volume to reconstruct", .. }))
    );
    assert!(is_too_large, "{refused:?}");
}

/// A picture is read back some rows at a time, the last time fewer.
#[test]
fn a_picture_of_more_than_one_band_is_read_back_whole() {
    let Some(mut context) = context(ON_HOST) else { return };
    // Texels of 16 bytes, rows of 1024 bytes, sixteen of them at a time.
    let size = [61, 50];
    context.limits.max_buffer_size = 16 * 1024 + 512;
    let mut banded = Drawer::new(Renderer::new(context));
    let scene = scene(Lattice::unit([9, 8, 10]), DVec3::new(-0.6, 0.3, -0.7));
    let (in_bands, _) = drawn(&mut banded, &scene, size, Rung::Full);
    let Some(mut drawer) = drawer() else { return };
    let (whole, _) = drawn(&mut drawer, &scene, size, Rung::Full);
    assert!(in_bands == whole, "another picture");
    let shown = |drawer: &mut Drawer| drawer.engines.present(None).expect("it reads back");
    assert_eq!(shown(&mut banded), shown(&mut drawer));
    assert!(whole.iter().any(|p| p[3] > 0.5));
}

/// Without a count of turns in every loop, as modules are made for hardware: the same bits.
#[test]
fn shaders_whose_loops_nobody_bounds_draw_the_same_picture() {
    let Some(mut unbounded) = context(ON_HOST) else { return };
    let Some(mut drawer) = drawer() else { return };
    unbounded.ends_loops = false;
    let mut unbounded = Drawer::new(Renderer::new(unbounded));
    let bytes = Samples::UInt8(values().map(|v| v as u8).collect());
    let scene = with_samples(bytes, 1.0, 0.0);
    let raster =
        SplatSettings { backend: voxsplat::scene::Backend::Raster, ..SplatSettings::SHADE_FIRST };
    let vectors = crate::vectors::alone();
    let modes = [SplatSettings::EXACT, SplatSettings::SHADE_FIRST, raster];
    let scenes = modes.map(|splat| Scene { splat, ..scene.clone() });
    for (i, scene) in scenes.iter().chain([&vectors]).enumerate() {
        let [one, other] =
            [&mut unbounded, &mut *drawer].map(|drawer| drawn(drawer, scene, SMALL, Rung::Full).0);
        assert!(one == other && one.iter().any(|p| p[3] > 0.1), "scene {i}");
    }
}

/// Two samples a word, and words in up to four buffers, hold the same codes.
#[test]
fn sixteen_bits_are_the_same_bits_in_pairs_in_halves_and_in_four_buffers() {
    let bytes = values().map(|v| v as u8).collect();
    let scene = with_samples(Samples::UInt8(bytes), 1.0, 0.0);
    // 4096 words: a word for every sample fits.
    let Some((pairs, most)) = pictures(&scene, 1 << 14) else { return };
    assert!(pairs.iter().all(|picture| picture.iter().any(|p| p[3] > 0.1)));
    // 2048 words hold 4096 halves; 512 in each of four buffers, 3315 of 4096.
    for bytes in [1 << 13, 1 << 11] {
        let Some((halves, fewer)) = pictures(&scene, bytes) else { return };
        assert!(fewer < most, "as many bytes as pairs take");
        for (i, (a, b)) in halves.iter().zip(&pairs).enumerate() {
            assert!(a == b, "another picture in buffers of {bytes} bytes ({i})");
        }
    }
    is_refused(&scene, 1 << 10);
}

/// Whole numbers over a range of more than 2¹⁴ take 32 bits: 16 have no four codes for each.
/// Measured: max 2.1e-4, rmse 2.2e-5, bias 1.8e-6.
#[test]
fn thirty_two_bits_are_the_references_picture_and_the_same_bits_in_four_buffers() {
    let Some(mut shared) = drawer() else { return };
    let wide = values().map(|v| 3_000_000_000 + (v * 1e4) as u32).collect();
    let scene = with_samples(Samples::UInt32(wide), 1e4, 3e9);
    for (name, kernel) in [("B-splines", Kernel::BSpline), ("tents", Kernel::Linear)] {
        let mut scene = scene.clone();
        scene.splat.kernel = kernel;
        let faults = held(&mut shared, &format!("32 bits, {name}"), &scene, EXACT);
        assert!(faults.is_empty(), "{faults:?}");
    }
    let (Some((one, _)), Some((four, _))) = (pictures(&scene, 1 << 14), pictures(&scene, 1 << 12))
    else {
        return;
    };
    assert!(one == four, "another picture in four buffers");
    // A word for every sample does not fit, though two samples a word would.
    is_refused(&scene, 1 << 11);
}

/// Two storages of one field. Measured: max 3.1e-4, rmse 2.5e-5, bias 3e-7; of tents, whose values have finer
/// steps, none.
const WHOLE: Within = Within { max_abs: 6e-4, rmse: 5e-5, bias: 2e-6 };

/// Whole numbers whose coefficients take steps of more than a quarter stand in 32 bits where those fit,
/// and in 16 where they do not, off by half of one at most. Measured against the
/// reference: max 1.9e-4, rmse 2.5e-5, bias 1.1e-6.
#[test]
fn whole_numbers_that_do_not_fit_in_thirty_two_bits_are_rounded_to_steps_of_less_than_one() {
    // As a CT scan's: B-splines through them span some 33 000.
    let spread = 20.0;
    let shorts = values().map(|v| (v * spread) as i16).collect();
    let scene = with_samples(Samples::Int16(shorts), spread, 0.0);
    let (Some((floats, _)), Some((halves, _))) =
        (pictures(&scene, 1 << 14), pictures(&scene, 1 << 11))
    else {
        return;
    };
    // 3315 samples of 32 bits take more than four buffers of 512 words.
    for (name, found, expected) in
        [("B-splines", &halves[0], &floats[0]), ("tents", &halves[1], &floats[1])]
    {
        print_measured(name, found, expected);
        assert_eq!(fault(found, expected, WHOLE), None, "{name}");
    }
    assert!(halves != floats, "16 bits that are the same bits as 32");
    let Some(mut halved) = limited(1 << 11) else { return };
    let faults = held(&mut halved, "whole numbers in 16 bits", &scene, EXACT);
    assert!(faults.is_empty(), "{faults:?}");
    is_refused(&scene, 1 << 10);
}

/// Two samples far from all others would leave these a few codes of 16 bits. Measured: max 3.3e-4,
/// rmse 1.9e-5, bias 1.6e-6.
#[test]
fn a_few_values_far_from_all_others_cost_them_nothing() {
    let Some(mut shared) = drawer() else { return };
    let far = |(i, v): (usize, f64)| match i {
        500 => 1e6_f32,
        900 => -1e6,
        _ => v as f32,
    };
    let mut scene =
        with_samples(Samples::Float32(values().enumerate().map(far).collect()), 1.0, 0.0);
    // Nothing is sharpened, so that what is far away stays where it is.
    scene.splat.kernel = Kernel::Linear;
    let faults = held(&mut shared, "values far away", &scene, EXACT);
    assert!(faults.is_empty(), "{faults:?}");
}
