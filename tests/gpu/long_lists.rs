//! Lists longer than a software adapter's loops: it ends them after 65535 turns.

use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{ListTotals, Scattered};
use voxsplat::scene::{OpacityModel, Order, Scene, SplatSettings, View};

use crate::scattered::{bits, by_raster, dense, drawn_as, in_slabs, parallel, records, views};
use crate::support::*;

/// The most turns.
const TURNS: usize = 65_535;

/// Greatest difference of alpha.
fn apart(a: &Light, b: &Light) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a[3] - b[3]).abs()).fold(0.0, f64::max)
}

#[test]
fn lists_in_parts_give_the_bits_of_lists_in_one() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = dense(&base, 80, 5);
        for order in [Order::BackToFront, Order::FrontToBack] {
            let splat = SplatSettings { order, ..base.splat };
            let published = SplatSettings { opacity_model: OpacityModel::Published, ..splat };
            let every = Scene { splat, ..base.clone() };
            let published = in_slabs(&Scene { splat: published, ..base.clone() }, 0.5, order);
            for scene in [every, in_slabs(&base, 2.0, order), published] {
                let all = Scattered::new(&records, &scene.splat);
                let (expected, totals) =
                    drawn_as(drawer.engines.gpu().expect("a device"), &scene, &all);
                assert_eq!(totals.parts, 1, "{name}");
                for most_of_a_tile in [1, 7] {
                    let few = Scattered { most_of_a_tile, ..all };
                    let (found, in_parts) =
                        drawn_as(drawer.engines.gpu().expect("a device"), &scene, &few);
                    assert!(in_parts.parts > 3, "{name}: {in_parts:?}");
                    assert_eq!(in_parts.capped, totals.capped, "{name}");
                    let parts = in_parts.parts;
                    assert_eq!(bits(&found), bits(&expected), "{name}: in {parts} parts");
                }
            }
        }
    }
}

#[test]
fn more_kernels_on_a_tile_than_a_loop_has_turns() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = parallel();
    scene.camera.parallel_scale *= 200.0;
    let mut many = records(&scene, TURNS + 10_000, 29);
    many.iter_mut().for_each(|r| r.extinction *= 1e-3);
    let raster = by_raster(drawer.engines.gpu().expect("a device"), &scene, &many);
    let (found, totals) = drawn_as(
        drawer.engines.gpu().expect("a device"),
        &scene,
        &Scattered::new(&many, &scene.splat),
    );
    println!("measured long lists: {:.1e}, {totals:?}", apart(&found, &raster));
    assert!(totals.parts > 2, "{totals:?}");
    // Each of them rounds: measured 8.4e-9, in slabs 2.3e-6.
    assert!(apart(&found, &raster) < 1e-5);
    let fewer = by_raster(drawer.engines.gpu().expect("a device"), &scene, &many[..TURNS]);
    assert!(apart(&fewer, &raster) > 1e-3, "what a loop leaves out would be seen");
    for order in [Order::BackToFront, Order::FrontToBack] {
        let slabs = in_slabs(&scene, 1.0, order);
        let (found, totals) = drawn_as(
            drawer.engines.gpu().expect("a device"),
            &slabs,
            &Scattered::new(&many, &slabs.splat),
        );
        println!("measured long lists in slabs: {:.1e}, {totals:?}", apart(&found, &raster));
        assert!(totals.parts > 2 && apart(&found, &raster) < 1e-5, "{totals:?}");
    }
}

#[test]
fn kernels_that_touch_more_tiles_and_layers_than_a_loop_has_turns() {
    let Some(mut drawer) = drawer() else { return };
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
    assert!(totals.rectangles > 1, "{totals:?}");
    let (slabs, totals) = drawn(&in_slabs(&scene, 4.0, Order::FrontToBack));
    println!("measured many tiles: {:.1e}, {totals:?}", apart(&slabs, &every));
    assert!(totals.entries as usize > 4 * TURNS, "{totals:?}");
    assert!(apart(&slabs, &every) < 1e-5);
    let least = every.iter().map(|p| p[3]).fold(1.0, f64::min);
    assert!(least > 1e-3, "a tile left out would be seen: {least}");
}
