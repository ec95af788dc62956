//! Scenes for the reference's own tests.

use std::sync::Arc;

use glam::DVec3;

use crate::core::{Camera, Projection};
use crate::scene::{Look, Sampled, Scene, SplatSettings};
use crate::transfer::{ColourMap, ColourSource, TransferFunction};
use crate::volume::{Lattice, Samples, ScalarVolume};

/// A scene of values f(x, y, z) on a lattice, seen so that its middle fills the picture.
pub(super) fn scene(
    lattice: Lattice,
    f: impl Fn(DVec3) -> f64,
    opacity: Vec<(f64, f64)>,
    splat: SplatSettings,
    direction: DVec3,
) -> Scene {
    let [nx, ny, nz] = lattice.dims;
    let place = |i: usize| DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|i| i as f64));
    let values = (0..nx * ny * nz).map(|i| f(place(i))).collect();
    let samples = Samples::Float64(values);
    let volume = Arc::new(ScalarVolume::from_samples("t", lattice, samples).unwrap());
    let colour = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] };
    let camera = Camera::new(lattice.centre(), direction, DVec3::Y, 2.0);
    let field = (Sampled::Volume(volume), Look::Field(TransferFunction::of(opacity, colour)));
    Scene { splat, ..Scene::seen_by(camera) }.with(field)
}

pub(super) fn in_perspective(mut scene: Scene, view_angle: f64) -> Scene {
    scene.camera.projection = Projection::Perspective { view_angle };
    scene
}

/// A smooth bump of values 0..1 in the middle of `dims`.
pub(super) fn bump(dims: [usize; 3], width: f64) -> impl Fn(DVec3) -> f64 {
    let centre = DVec3::from(dims.map(|n| (n as f64 - 1.0) / 2.0));
    move |p| (-(p - centre).length_squared() / (2.0 * width * width)).exp()
}

/// Values without any smoothness, 0..1.
pub(super) fn rough(p: DVec3) -> f64 {
    let i = p.x + 31.0 * p.y + 977.0 * p.z;
    (i * 7919.0 + 13.0).rem_euclid(101.0) / 101.0
}

/// Greatest difference of any channel.
pub(super) fn difference(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

/// −10 log₁₀ of the mean squared difference of RGB.
pub(super) fn decibels(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    let squares: f64 =
        a.iter().zip(b).flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2))).sum();
    -10.0 * (squares / (3 * a.len()) as f64).log10()
}
