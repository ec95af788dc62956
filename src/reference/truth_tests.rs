//! The continuous integral held to answers that can be written down, and to brute force.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::field::{Field, Shape};
use super::support::*;
use super::{RefKernel, Reference, TOLERANCE};
use crate::core::Ticket;
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{Classify, Reconstruction, Scene, SplatSettings, Visibility};
use crate::transfer::extinction_from_opacity;
use crate::volume::Lattice;

const SIZE: [usize; 2] = [6, 5];
const RECONSTRUCTING: [Kernel; 5] =
    [Kernel::Nearest, Kernel::Linear, Kernel::Gaussian, Kernel::Cubic, Kernel::BSpline];

/// Products of another than their natural width.
const SCALED: [(Kernel, Option<f64>); 4] = [
    (Kernel::Linear, Some(0.6)),
    (Kernel::Linear, Some(1.7)),
    (Kernel::BSpline, Some(0.9)),
    (Kernel::BSpline, Some(3.4)),
];

fn after(kernel: Kernel, reconstruction: Reconstruction) -> SplatSettings {
    SplatSettings { kernel, reconstruction, classify: Classify::After, ..SplatSettings::EXACT }
}

fn before(kernel: Kernel) -> SplatSettings {
    let visibility = Visibility::Slabs;
    SplatSettings { kernel, visibility, ..SplatSettings::SHADE_FIRST }
}

/// Where a pixel's ray is at world length t, in index space.
fn along(scene: &Scene, [x, y]: [usize; 2]) -> impl Fn(f64) -> DVec3 {
    let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
    let (origin, direction) = scene.camera.ray(at, SIZE.map(|n| n as f64));
    let lattice = scene.lattice();
    move |t| lattice.index_from_world(origin + direction * t)
}

/// ∫ q·exp(−∫κ) by very many small steps of a density by place in index space.
fn brute_force(
    scene: &Scene,
    pixel: [usize; 2],
    density: impl Fn(DVec3) -> Option<(f64, [f64; 3])>,
) -> [f64; 4] {
    let (near, far, steps) = (-40.0, 40.0, 80_000);
    let near = if scene.camera.eye_distance().is_some() { 0.0 } else { near };
    let step = (far - near) / f64::from(steps);
    let place = along(scene, pixel);
    let (mut left, mut light) = (1.0, [0.0; 3]);
    for i in 0..steps {
        let Some((extinction, colour)) = density(place(near + (f64::from(i) + 0.5) * step)) else {
            continue;
        };
        let alpha = -(-extinction * step).exp_m1();
        light.iter_mut().zip(colour).for_each(|(l, c)| *l += left * alpha * c);
        left *= 1.0 - alpha;
    }
    [light[0], light[1], light[2], 1.0 - left]
}

fn inside(place: DVec3, dims: [usize; 3]) -> bool {
    let high = DVec3::from(dims.map(|n| n as f64)) - 0.5;
    place.cmpge(DVec3::splat(-0.5)).all() && place.cmplt(high).all()
}

#[test]
fn a_constant_slab_is_its_closed_form_for_every_kernel_and_both_projections() {
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([17, 15, 5]) };
    for kernel in RECONSTRUCTING {
        for reconstruction in [Reconstruction::Smooth, Reconstruction::Interpolating] {
            let splat = after(kernel, reconstruction);
            let direction = DVec3::new(0.2, -0.1, 1.0);
            let parallel = scene(lattice, |_| 0.7, vec![(0.0, 0.2)], splat, direction);
            for scene in [parallel.clone(), in_perspective(parallel, 0.3)] {
                let picture = Reference::exact(&scene, SIZE).unwrap().picture();
                let colour = scene.transfer().expect("a field").colour_at(0.7).0;
                for (i, pixel) in picture.iter().enumerate() {
                    let place = along(&scene, [i % SIZE[0], i / SIZE[0]]);
                    // World length per slice of index space.
                    let length = 5.0 / (place(1.0) - place(0.0)).z.abs();
                    let alpha = 1.0 - (-extinction_from_opacity(0.2) / 0.7 * length).exp();
                    // Expected, not measured: 3e-13.
                    assert!((pixel[3] - alpha).abs() < 1e-10, "{kernel:?} {pixel:?} {alpha}");
                    for c in 0..3 {
                        assert!((pixel[c] - colour[c] * alpha).abs() < 1e-9, "{kernel:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_slab_shaded_first_is_as_deep_as_it_is_thick_for_every_kernel() {
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.3, 0.7), ..Lattice::unit([25, 21, 5]) };
    for kernel in [Kernel::Nearest, Kernel::Linear, Kernel::BSpline, Kernel::Cubic] {
        let direction = DVec3::new(0.2, -0.1, 1.0);
        let scene = scene(lattice, |_| 0.7, vec![(0.0, 0.2)], before(kernel), direction);
        let depth = extinction_from_opacity(0.2) / 0.7 * 3.5 / scene.camera.direction.z;
        // One layer of the cubic ripples by a quarter per cent; the others are exact.
        let tolerance = if kernel == Kernel::Cubic { 3e-3 } else { 1e-9 };
        for pixel in Reference::exact(&scene, SIZE).unwrap().picture() {
            let found = -(-pixel[3]).ln_1p();
            assert!((found / depth - 1.0).abs() < tolerance, "{kernel:?}: {found} {depth}");
        }
    }
}

#[test]
fn gaussian_blobs_have_their_closed_optical_depth_and_hide_one_another() {
    let mut splat = before(Kernel::Gaussian);
    splat.opacity_unit_distance = Some(1.0);
    let scene = scene(Lattice::unit([3; 3]), rough, vec![], splat, DVec3::Z);
    let turned = DMat3::from_rotation_y(0.7) * DMat3::from_diagonal(DVec3::new(1.4, 0.6, 0.9));
    let blob = |z: f64, extinction, colour| RefKernel {
        centre: DVec3::new(1.2, 0.9, z),
        map: turned,
        extinction,
        colour,
    };
    let (red, blue) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    // Back to front along +z: the far one first.
    let kernels = vec![blob(9.0, 3.0, blue), blob(1.0, 1.5, red)];
    let picture = Reference::of_kernels(kernels.clone(), &scene, SIZE, true).unwrap().picture();
    let shape = RadialKernel::new(Kernel::Gaussian, None).unwrap();
    let mut seen = 0;
    for (i, pixel) in picture.iter().enumerate() {
        let at = DVec2::new((i % SIZE[0]) as f64 + 0.5, (i / SIZE[0]) as f64 + 0.5);
        let (origin, direction) = scene.camera.ray(at, SIZE.map(|n| n as f64));
        let depth = |k: &RefKernel| {
            let inverse = k.map.inverse();
            let (start, step) = (inverse * (origin - k.centre), inverse * direction);
            let near = start.cross(step).length() / step.length();
            k.extinction * shape.footprint(near) / step.length()
        };
        let (far, near) = (depth(&kernels[0]), depth(&kernels[1]));
        let expected = [
            1.0 - (-near).exp(),
            0.0,
            (-near).exp() * (1.0 - (-far).exp()),
            1.0 - (-near - far).exp(),
        ];
        seen += usize::from(near > 0.01);
        // Expected, not measured: 2e-10.
        assert!(difference(&[*pixel], &[expected]) < 1e-8, "{pixel:?} {expected:?}");
    }
    assert!(seen > 4, "{seen}");
}

/// ∫ −ln(1 − α) dα.
fn antiderivative(alpha: f64) -> f64 {
    (1.0 - alpha) * (-alpha).ln_1p() + alpha
}

#[test]
fn a_ramp_under_a_ramp_is_its_closed_form() {
    let lattice = Lattice { spacing: DVec3::new(0.5, 1.0, 1.0), ..Lattice::unit([61, 9, 9]) };
    // Values rise by 1 a voxel; opacity from 25 to 35, then nothing.
    let opacity = vec![(25.0, 0.0), (35.0, 0.8), (35.0, 0.0)];
    for (kernel, how) in [
        (Kernel::Linear, Reconstruction::Smooth),
        (Kernel::BSpline, Reconstruction::Interpolating),
        (Kernel::BSpline, Reconstruction::Smooth),
    ] {
        for direction in [DVec3::X, DVec3::new(-1.0, 0.02, 0.01)] {
            let parallel = scene(lattice, |p| p.x, opacity.clone(), after(kernel, how), direction);
            for mut scene in [parallel.clone(), in_perspective(parallel, 0.05)] {
                scene.camera.parallel_scale = 0.5;
                let picture = Reference::exact(&scene, SIZE).unwrap().picture();
                for (i, pixel) in picture.iter().enumerate() {
                    let place = along(&scene, [i % SIZE[0], i / SIZE[0]]);
                    let per_voxel = 1.0 / (place(1.0) - place(0.0)).x.abs();
                    let depth = antiderivative(0.8) / 0.08 * per_voxel / 0.5;
                    let found = -(-pixel[3]).ln_1p();
                    // Expected, not measured: 2e-9, where the tolerance is spent.
                    assert!((found - depth).abs() < 1e-6, "{kernel:?}: {found} {depth}");
                }
            }
        }
    }
}

#[test]
fn a_step_on_a_ramp_is_entered_where_it_is() {
    let opacity = vec![(4.3, 0.0), (4.3, 0.5)];
    let lattice = Lattice::unit([12, 9, 9]);
    let splat = after(Kernel::Linear, Reconstruction::Smooth);
    for direction in [DVec3::X, DVec3::new(-1.0, 0.05, 0.1)] {
        let parallel = scene(lattice, |p| p.x, opacity.clone(), splat, direction);
        for scene in [parallel.clone(), in_perspective(parallel, 0.2)] {
            let picture = Reference::exact(&scene, SIZE).unwrap().picture();
            for (i, pixel) in picture.iter().enumerate() {
                let place = along(&scene, [i % SIZE[0], i / SIZE[0]]);
                // Beyond the last sample at 11 the mirrored ramp stays above the step to 11.5.
                let length = (11.5 - 4.3) / (place(1.0) - place(0.0)).x.abs();
                let alpha = 1.0 - (-(2.0_f64.ln()) * length).exp();
                // Expected, not measured: 1e-14.
                assert!((pixel[3] - alpha).abs() < 1e-11, "{pixel:?} {alpha}");
            }
        }
    }
}

#[test]
fn values_after_reconstruction_agree_with_brute_force() {
    let lattice = Lattice { spacing: DVec3::new(1.0, -1.2, 0.8), ..Lattice::unit([11, 10, 9]) };
    let opacity = vec![(0.3, 0.0), (0.5, 0.6), (0.6, 0.1), (0.6, 0.3), (0.8, 0.0)];
    for (kernel, extent) in RECONSTRUCTING.map(|kernel| (kernel, None)).into_iter().chain(SCALED) {
        for how in [Reconstruction::Smooth, Reconstruction::Interpolating] {
            let direction = DVec3::new(0.4, 0.5, -0.8);
            // One hole.
            let f = |p: DVec3| if p == DVec3::new(5.0, 5.0, 4.0) { f64::NAN } else { rough(p) };
            let parallel = scene(lattice, f, opacity.clone(), after(kernel, how), direction);
            let splat = SplatSettings { extent, ..parallel.splat };
            let parallel = Scene { splat, ..parallel };
            // The eye is inside the volume in perspective.
            for scene in [parallel.clone(), in_perspective(parallel, 2.0)] {
                let shape = Shape::new(kernel, extent).unwrap();
                let field = Field::new(scene.volume().expect("a field"), shape, how);
                let exact = Reference::exact(&scene, SIZE).unwrap();
                for pixel in [[2, 2], [4, 1]] {
                    let found = exact.pixel(pixel);
                    let expected = brute_force(&scene, pixel, |place| {
                        if !inside(place, lattice.dims) || field.is_hole(place) {
                            return None;
                        }
                        let value = field.value(place)?;
                        let alpha = scene.transfer().expect("a field").opacity_at(value);
                        let extinction = extinction_from_opacity(alpha) / 0.8;
                        Some((extinction, scene.transfer().expect("a field").colour_at(value).0))
                    });
                    let error = difference(&[found], &[expected]);
                    let case = format!("{kernel:?} {extent:?} {how:?}");
                    assert!(error < 1e-3, "{case} {error}: {found:?} {expected:?}");
                    // Wide ones leave little of values without any smoothness.
                    assert!(found[3] > 0.05, "{case}: {found:?}");
                }
            }
        }
    }
}

#[test]
fn kernels_shaded_first_agree_with_brute_force() {
    let lattice = Lattice { spacing: DVec3::new(1.0, -1.2, 0.8), ..Lattice::unit([9, 8, 7]) };
    let opacity = vec![(0.3, 0.0), (0.5, 0.6), (0.6, 0.1), (0.6, 0.3), (0.8, 0.0)];
    for (kernel, extent) in RECONSTRUCTING.map(|kernel| (kernel, None)).into_iter().chain(SCALED) {
        let direction = DVec3::new(0.4, 0.5, -0.8);
        let splat = SplatSettings { extent, ..before(kernel) };
        let parallel = scene(lattice, rough, opacity.clone(), splat, direction);
        for scene in [parallel.clone(), in_perspective(parallel, 2.0)] {
            let exact = Reference::exact(&scene, SIZE).unwrap();
            let scale = kernel.scale(extent);
            let h = |offset: DVec3| match Shape::new(kernel, None).unwrap() {
                Shape::Radial(k) => k.value(offset.length()),
                Shape::Nearest => f64::from(u8::from(offset.abs().max_element() < 0.5)),
                Shape::Scaled(..) => panic!("that is its natural width"),
                Shape::Functions(_) | Shape::Ellipsoids | Shape::Cells => {
                    panic!("no kernel of samples")
                }
                Shape::Separable(basis) => {
                    let one = |x: f64| {
                        let x = x / scale;
                        let cell = x.floor();
                        let at = -cell + 1.0;
                        let weights = basis.weights(x - cell);
                        if (0.0..4.0).contains(&at) { weights[at as usize] } else { 0.0 }
                    };
                    one(offset.x) * one(offset.y) * one(offset.z) / scale.powi(3)
                }
            };
            let pixel = [3, 2];
            let expected = brute_force(&scene, pixel, |place| {
                let mut sums = [0.0; 4];
                let near = place.round();
                for i in 0..9 * 9 * 9 {
                    let step =
                        DVec3::new(f64::from(i % 9), f64::from(i / 9 % 9), f64::from(i / 81));
                    let index = near + step - 4.0;
                    if !inside(index, lattice.dims) {
                        continue;
                    }
                    let value = rough(index);
                    let alpha = scene.transfer().expect("a field").opacity_at(value);
                    let weight = h(place - index) * extinction_from_opacity(alpha) / 0.8;
                    let [r, g, b] = scene.transfer().expect("a field").colour_at(value).0;
                    for (sum, c) in sums.iter_mut().zip([1.0, r, g, b]) {
                        *sum += weight * c;
                    }
                }
                let [k, r, g, b] = sums;
                (k > 0.0).then(|| (k, [r / k, g / k, b / k]))
            });
            let found = exact.pixel(pixel);
            let error = difference(&[found], &[expected]);
            assert!(error < 1e-3, "{kernel:?} {extent:?} {error}: {found:?} {expected:?}");
            assert!(found[3] > 0.2, "{found:?}");
        }
    }
}

#[test]
fn a_hundredth_of_the_tolerance_finds_the_same() {
    let lattice = Lattice::unit([12, 11, 10]);
    let opacity = vec![(0.3, 0.0), (0.5, 1.0), (0.6, 0.1), (0.6, 0.3), (0.8, 0.0)];
    let direction = DVec3::new(0.4, 0.5, -0.8);
    for kernel in RECONSTRUCTING {
        for splat in [after(kernel, Reconstruction::Interpolating), before(kernel)] {
            let scene = scene(lattice, rough, opacity.clone(), splat, direction);
            let usual = Reference::exact(&scene, SIZE).unwrap();
            let found = usual.picture();
            let finer = usual.with_tolerance(TOLERANCE / 100.0).picture();
            let error = difference(&found, &finer);
            assert!(error < TOLERANCE, "{kernel:?} {:?}: {error}", splat.classify);
            let coarse = Reference::exact(&scene, SIZE).unwrap().with_tolerance(1.0).picture();
            assert!(difference(&coarse, &finer) > error, "{kernel:?}: nothing to adapt");
        }
    }
}

/// Some vectors of every direction, beside a field or alone.
fn with_vectors(alone: bool) -> Scene {
    let lattice = Lattice { spacing: DVec3::new(1.0, 1.3, 0.8), ..Lattice::unit([4, 3, 4]) };
    let vectors: Vec<glam::Vec3> = (0..48)
        .map(|i| {
            let turn = 2.4 * i as f32;
            glam::Vec3::new(turn.cos(), turn.sin(), (0.7 * turn).sin()) * (2.0 + (i % 5) as f32)
        })
        .collect();
    let places = crate::volume::Places::Lattice(lattice);
    let field = crate::volume::VectorField::new("v", places, vectors.into(), &Ticket::new());
    let mut layer = crate::scene::VectorLayer::new(Arc::new(field.unwrap()));
    layer.settings.transfer.opacity = vec![(0.0, 0.6)];
    let opacity = vec![(0.1, 0.0), (0.6, 0.3)];
    let direction = DVec3::new(0.3, -0.5, 0.8);
    let field = bump([4, 3, 4], 1.2);
    let mut scene = scene(lattice, field, opacity, SplatSettings::EXACT, direction).with(layer);
    scene.show_field(!alone);
    scene
}

/// Greatest difference of slabs so many times thinner from the continuous integral.
fn apart(scene: &Scene, slabs_per_voxel: f64) -> f64 {
    let size = [16, 12];
    let splat = SplatSettings { slabs_per_voxel, ..scene.splat };
    let slabs = Reference::new(&Scene { splat, ..scene.clone() }, size).unwrap().picture();
    let truth = Reference::exact(scene, size).unwrap().picture();
    assert!(truth.iter().map(|p| p[3]).fold(0.0, f64::max) > 0.3);
    let pairs = slabs.iter().zip(&truth);
    pairs.flat_map(|(a, b)| (0..4).map(|c| (a[c] - b[c]).abs())).fold(0.0, f64::max)
}

/// Measured at 8 and 32 slabs a voxel: see the assertions' bounds, twice as large.
#[test]
fn thinner_slabs_of_vectors_come_to_where_the_splats_lie() {
    for alone in [true, false] {
        for scene in [with_vectors(alone), in_perspective(with_vectors(alone), 0.6)] {
            let [coarse, fine] = [8.0, 32.0].map(|slabs| apart(&scene, slabs));
            println!("measured slabs of vectors, alone {alone}: {coarse:.1e}, {fine:.1e}");
            // Each slab is as dense everywhere: of the first order in its thickness at the worst.
            assert!(fine < 0.4 * coarse && fine < 3e-3, "{alone}: {coarse} {fine}");
        }
    }
    // Without the field's part, or the vectors', it is another picture.
    let both = Reference::exact(&with_vectors(false), [16, 12]).unwrap().pixel([8, 6]);
    let alone = Reference::exact(&with_vectors(true), [16, 12]).unwrap().pixel([8, 6]);
    let mut plain = with_vectors(false);
    plain.keep_vectors(0);
    let plain = Reference::exact(&plain, [16, 12]).unwrap().pixel([8, 6]);
    assert!((both[3] - alone[3]).abs() > 1e-3 && (both[3] - plain[3]).abs() > 1e-3);
    // Optical depths of both add up.
    let product = (1.0 - alone[3]) * (1.0 - plain[3]);
    assert!((1.0 - both[3] - product).abs() < 1e-6, "{} {product}", 1.0 - both[3]);
}

/// A splat alone is of one colour, and so the same in slabs of any thickness.
#[test]
fn a_single_splat_is_as_deep_in_slabs_as_it_is() {
    let mut scene = with_vectors(true);
    let mut layer = scene.vectors().remove(0);
    let mut vectors = vec![glam::Vec3::ZERO; 48];
    vectors[21] = glam::Vec3::new(1.0, 0.5, 0.2);
    let places = layer.field.places.clone();
    let field = crate::volume::VectorField::new("v", places, vectors.into(), &Ticket::new());
    layer.field = Arc::new(field.unwrap());
    layer.settings.transfer.opacity = vec![(0.5, 0.0), (0.6, 0.9)];
    scene.keep_vectors(0);
    let mut scene = scene.with(layer);
    scene.show_field(false);
    // Measured: 4.2e-8.
    assert!(apart(&scene, 1.0) < 1e-6, "{}", apart(&scene, 1.0));
}
