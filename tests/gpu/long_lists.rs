//! Lists longer than a software adapter's loops, which it ends after 65535 turns: told, and never drawn short.

use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{GpuError, ListTotals, Scattered};
use voxsplat::scene::{Order, Scene, SplatSettings, View};

use crate::scattered::{begun, by_raster, in_slabs, parallel, records};
use crate::support::*;

/// The most turns.
const TURNS: usize = 65_535;

/// Greatest difference of alpha.
fn apart(a: &Light, b: &Light) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a[3] - b[3]).abs()).fold(0.0, f64::max)
}

#[test]
fn more_kernels_on_a_tile_than_a_loop_has_turns() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = parallel();
    scene.camera.parallel_scale *= 200.0;
    let mut many = records(&scene, TURNS + 10_000, 29);
    many.iter_mut().for_each(|r| r.extinction *= 1e-3);
    let raster = by_raster(drawer.engines.gpu().expect("a device"), &scene, &many);
    for order in [Order::BackToFront, Order::FrontToBack] {
        for scene in [
            Scene { splat: SplatSettings { order, ..scene.splat }, ..scene.clone() },
            in_slabs(&scene, 1.0, order),
        ] {
            let renderer = drawer.engines.gpu().expect("a device");
            let view = begun(renderer, &scene);
            let what = Scattered::new(&many, &scene.splat);
            match renderer.draw_scattered(&view, &what, &mut |_, _| true) {
                Err(error) => {
                    assert!(
                        renderer.context().ends_loops && error == GpuError::EndedLoops,
                        "{error}"
                    );
                }
                // Each of them rounds: measured 8.4e-9, in slabs 2.3e-6.
                Ok(_) => {
                    let found = wide(&renderer.read_light().expect("it reads back"));
                    assert!(apart(&found, &raster) < 1e-5, "{order:?}");
                }
            }
        }
    }
    let fewer = by_raster(drawer.engines.gpu().expect("a device"), &scene, &many[..TURNS]);
    assert!(apart(&fewer, &raster) > 1e-3, "what a loop leaves out would be seen");
}

#[test]
fn kernels_that_touch_more_tiles_and_layers_than_a_loop_has_turns() {
    let Some(mut drawer) = drawer() else { return };
    let ends_loops = drawer.engines.gpu().expect("a device").context().ends_loops;
    let mut scene = parallel();
    scene.camera.parallel_scale /= 8.0;
    // Over 2^15 tiles.
    let size = [2048, 1100];
    let kernels =
        [([5, 5, 5], 0.02, 65_535), ([8, 7, 6], 0.01, 9_000)].map(|(low, extinction, red)| {
            Record::new(low, [6, 7, 5], extinction, [red, 30_000, 10_000])
        });
    let mut drawn = |scene: &Scene| -> (Light, ListTotals) {
        let view = View::new(scene, size);
        let SplatSettings { kernel, extent, .. } = scene.splat;
        let unit = scene.opacity_unit_distance();
        drawer
            .engines
            .gpu()
            .expect("a device")
            .begin(&view, kernel, extent, unit)
            .expect("it begins");
        let what = Scattered::new(&kernels, &scene.splat);
        let totals =
            drawer.engines.gpu().expect("a device").draw_scattered(&view, &what, &mut |_, _| true);
        let light = drawer.engines.gpu().expect("a device").read_light().expect("it reads back");
        (wide(&light), totals.expect("it draws"))
    };
    let (every, totals) = drawn(&scene);
    // Only where loops are ended is the picture drawn in parts.
    assert_eq!(totals.rectangles > 1, ends_loops, "{totals:?}");
    let (slabs, totals) = drawn(&in_slabs(&scene, 4.0, Order::FrontToBack));
    println!("measured many tiles: {:.1e}, {totals:?}", apart(&slabs, &every));
    assert!(totals.entries as usize > 4 * TURNS, "{totals:?}");
    assert!(apart(&slabs, &every) < 1e-5);
    let least = every.iter().map(|p| p[3]).fold(1.0, f64::min);
    assert!(least > 1e-3, "a tile left out would be seen: {least}");
}
