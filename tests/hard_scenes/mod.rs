//! Scenes that are hard to draw, each held to the float64 reference: one list for both engines.
//!
//! Tests of an engine include this folder, and have a module `support` that says what draws: `drawer`, `drawn`,
//! `drawn_or_refused`, and whether it draws triangles (`DRAWS_TRIANGLES`). Bounds are those of the GPU engine, on
//! llvmpipe (Mesa 22.3.6, LLVM 15, 256 bits), Vulkan, 2026-11-21. The native engine keeps to the same ones: by pictures
//! of the command line, 2026-11-27, it is within 1e-6 of that engine where samples are shaded first (5e-4 where rays end
//! early), and within 7e-4 in the exact mode (1.8e-3 at steps), whose values have 16 bits on the device.
//! 2026-11-27: all of them natively, at most 1.8e-3 rmse (4096 solid layers shaded first).

mod geometry;
mod kernels;
mod mode_values;
mod quick;
pub(crate) mod scenes;
mod values;

use voxsplat::kernel::Kernel;
use voxsplat::reference::{Rays, Reference};
use voxsplat::scene::{Backend, Order, Scene, SplatSettings, View, Visibility};
use voxsplat::task::draw::Drawer;

use crate::support::{DRAWS_TRIANGLES, drawn_or_refused};
use scenes::{Light, Within, fault, print_measured, reference};

/// Small: what is hard here is not the number of pixels. Tiles hang over one edge.
pub(crate) const SMALL: [u32; 2] = [24, 20];
/// The exact mode: 16-bit values, classified in cells of 1/4096 of the range. Measured here and in
/// `mode_values`: max 8.7e-4, rmse 9.1e-5, bias 1.2e-5.
pub(crate) const EXACT: Within = Within { max_abs: 1.8e-3, rmse: 1.8e-4, bias: 2.5e-5 };
/// Shade first with the cubic's polynomial. Measured: max 8.3e-4, rmse 5.7e-5, bias 1.3e-5 (2050
/// samples nearly in a row; else 4.6e-4, 4.6e-5, 6e-6).
pub(crate) const SHADED: Within = Within { max_abs: 1.8e-3, rmse: 1e-4, bias: 2.5e-5 };

/// The modes that matter, with the scene's own extent and unit distance.
pub(crate) fn modes(scene: &Scene) -> Vec<(&'static str, Scene, Within)> {
    let shaded = SplatSettings::SHADE_FIRST;
    let layered = |visibility, sheets_per_kernel| SplatSettings {
        visibility,
        sheets_per_kernel,
        order: Order::FrontToBack,
        ..shaded
    };
    [
        ("exact", SplatSettings::EXACT, EXACT),
        ("every sample", shaded, SHADED.of_triangles()),
        ("sheets", layered(Visibility::Sheets, 1), SHADED),
        ("3 sheets a kernel", layered(Visibility::Sheets, 3), SHADED),
        ("slabs shaded first", layered(Visibility::Slabs, 1), SHADED),
    ]
    .into_iter()
    .map(|(name, splat, within)| {
        let SplatSettings { extent, opacity_unit_distance, .. } = scene.splat;
        let extent = extent.filter(|_| splat.kernel != Kernel::BSpline);
        let splat = SplatSettings { extent, opacity_unit_distance, ..splat };
        (name, Scene { splat, ..scene.clone() }, within)
    })
    .collect()
}

/// The reference's picture of the scene's own mode; triangles, where the engine draws any, linearise perspective, and
/// tiles take several rays a pixel where kernels are narrower than one.
pub(crate) fn truth(scene: &Scene, size: [u32; 2]) -> Light {
    let view = View::new(scene, size);
    if DRAWS_TRIANGLES && scene.splat.backend_in(&view) == Backend::Raster {
        return reference(scene, size, Rays::Local);
    }
    let side = view.rays_per_side(scene.splat.kernel, scene.splat.extent) as usize;
    let rays = Reference::supersampled(scene, size.map(|n| n as usize), side, false);
    rays.expect("a mode that means something").picture()
}

/// Draws one scene in its own mode; says what is out of bounds.
pub(crate) fn held(drawer: &mut Drawer, name: &str, scene: &Scene, within: Within) -> Vec<String> {
    let expected = truth(scene, SMALL);
    let (found, _) = drawn_or_refused(drawer, scene, SMALL);
    print_measured(name, &found, &expected);
    let mut faults = Vec::new();
    if !expected.iter().any(|p| p[3] > 0.01) {
        faults.push(format!("{name}: nothing to see"));
    }
    faults.extend(fault(&found, &expected, within).map(|f| format!("{name}: {f}")));
    faults
}

/// Draws a scene in every mode that matters.
pub(crate) fn in_modes(drawer: &mut Drawer, name: &str, scene: &Scene) -> Vec<String> {
    modes(scene)
        .iter()
        .flat_map(|(mode, scene, within)| held(drawer, &format!("{name}, {mode}"), scene, *within))
        .collect()
}

#[track_caller]
pub(crate) fn assert_none(faults: Vec<String>) {
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
