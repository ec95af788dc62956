//! Scattered kernels by lists, held to the float64 reference, to triangles, and to themselves.

use glam::{DMat3, DVec2, DVec3};
use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{GpuError, ListTotals, Renderer, Scattered, Wishes};
use voxsplat::kernel::{Kernel, RadialKernel, perspective_jacobian};
use voxsplat::reference::{Rays, RefKernel, every_sample};
use voxsplat::scene::{Backend, OpacityModel, Order, Scene, SplatSettings, View, Visibility};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::volume::Lattice;

use crate::support::*;

const SPACING: DVec3 = DVec3::new(1.0, 1.3, 0.8);

/// A scene whose volume stands for the lattice alone: what is drawn are [`records`].
pub(crate) fn parallel() -> Scene {
    let lattice = Lattice { spacing: SPACING, ..Lattice::unit([16; 3]) };
    scene(lattice, DVec3::new(0.5, -0.4, 0.7))
}

pub(crate) fn views() -> [(&'static str, Scene); 2] {
    [("parallel", parallel()), ("perspective", in_perspective(parallel(), 30.0))]
}

/// Boxes of many sides and places, back to front by their centres' depth.
pub(crate) fn records(scene: &Scene, count: usize, seed: u64) -> Vec<Record> {
    let mut records: Vec<Record> = (0..count)
        .map(|i| {
            let any = |k: usize, n: u32| (random(seed, 8 * i + k) * f64::from(n)) as u32;
            let size = [1 + any(0, 4), 1 + any(1, 4), 1 + any(2, 4)];
            let low = [any(3, 12), any(4, 12), any(5, 12)];
            let shade = random(seed, 8 * i + 6);
            let colour =
                [shade, 1.0 - shade, random(seed, 8 * i + 7)].map(|c| (c * 65535.0) as u16);
            Record::new(low, size, (0.02 + 0.6 * shade * shade) as f32, colour)
        })
        .collect();
    let depth = |r: &Record| scene.camera.to_view(world(scene, r)).z;
    records.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
    records
}

/// The same, six times as deep: what overlaps hides what is behind.
pub(crate) fn dense(scene: &Scene, count: usize, seed: u64) -> Vec<Record> {
    let mut records = records(scene, count, seed);
    records.iter_mut().for_each(|r| r.extinction *= 6.0);
    records
}

fn world(scene: &Scene, record: &Record) -> DVec3 {
    let centre = DVec3::from_array(record.centre.map(f64::from));
    scene.lattice().world_from_index(centre)
}

/// What records are to the reference.
pub(crate) fn kernels(scene: &Scene, records: &[Record]) -> Vec<RefKernel> {
    let unit = scene.opacity_unit_distance();
    let parts = |r: &Record| {
        let [xy, zr, gb] = r.packed;
        let size = DVec3::from([xy & 0xffff, xy >> 16, zr & 0xffff].map(f64::from));
        (size, [zr >> 16, gb & 0xffff, gb >> 16].map(|c| f64::from(c) / 65535.0))
    };
    records
        .iter()
        .map(|r| RefKernel {
            centre: world(scene, r),
            map: scene.lattice().axes() * DMat3::from_diagonal(parts(r).0),
            extinction: f64::from(r.extinction) / unit,
            colour: parts(r).1,
        })
        .collect()
}

pub(crate) fn begun(renderer: &mut Renderer, scene: &Scene) -> View {
    let view = View::new(scene, SIZE);
    let SplatSettings { kernel, extent, .. } = scene.splat;
    renderer.begin(&view, kernel, extent, scene.opacity_unit_distance()).expect("it begins");
    view
}

pub(crate) fn by_raster(renderer: &mut Renderer, scene: &Scene, records: &[Record]) -> Light {
    begun(renderer, scene);
    renderer.draw_records(records).expect("it draws");
    wide(&renderer.read_light().expect("it reads back"))
}

pub(crate) fn drawn_as(
    renderer: &mut Renderer,
    scene: &Scene,
    what: &Scattered<'_>,
) -> (Light, ListTotals) {
    let view = begun(renderer, scene);
    let totals = renderer.draw_scattered(&view, what, &mut |_, _| true).expect("it draws");
    assert!(totals.finished);
    (wide(&renderer.read_light().expect("it reads back")), totals)
}

pub(crate) fn by_lists(renderer: &mut Renderer, scene: &Scene, records: &[Record]) -> Light {
    drawn_as(renderer, scene, &Scattered::new(records, &scene.splat)).0
}

pub(crate) fn in_slabs(scene: &Scene, slabs_per_voxel: f64, order: Order) -> Scene {
    let visibility = Visibility::Slabs;
    let splat = SplatSettings { visibility, slabs_per_voxel, order, ..scene.splat };
    Scene { splat, ..scene.clone() }
}

fn in_order(scene: &Scene, order: Order) -> Scene {
    Scene { splat: SplatSettings { order, ..scene.splat }, ..scene.clone() }
}

const ORDERS: [Order; 2] = [Order::BackToFront, Order::FrontToBack];
/// Against double precision. Measured: max 3.6e-4, rmse 2.7e-5, bias 2.2e-6 (the cubic's polynomial).
const EXACT: Within = Within { max_abs: 1e-3, rmse: 1e-4, bias: 2e-5 };
/// The same for [`dense`] kernels in slabs. Measured: max 1.1e-3, rmse 9.6e-5, bias 6.7e-6 (the
/// polynomials of footprint and share; slabs a tenth thinner are rmse 1.3e-4 apart).
const DENSE: Within = Within { max_abs: 2.5e-3, rmse: 1.2e-4, bias: 2e-5 };
/// Each splat's own rounding, and of the sum.
const ROUNDING: Within = Within { max_abs: 2e-5, rmse: 2e-6, bias: 1e-6 };

#[test]
fn every_sample_is_the_references_picture_and_the_triangles() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = records(&base, 60, 3);
        for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest, Kernel::Point] {
            let base = with_kernel(base.clone(), kernel);
            let pixels = SIZE.map(|n| n as usize);
            let expected = every_sample(
                &kernels(&base, &records),
                kernel,
                None,
                &base.camera,
                pixels,
                Rays::Local,
            );
            let raster = by_raster(drawer.engines.gpu().expect("a device"), &base, &records);
            for order in ORDERS {
                let name = format!("lists {}, {name}, {}", kernel.name(), order.name());
                let found = by_lists(
                    drawer.engines.gpu().expect("a device"),
                    &in_order(&base, order),
                    &records,
                );
                print_measured(&name, &found, &expected);
                print_measured(&format!("{name}, to triangles"), &found, &raster);
                // The reference's boxes have their exact chord in perspective; ours are seen as in
                // their middle, as the triangles are.
                if kernel != Kernel::Nearest || base.camera.eye_distance().is_none() {
                    assert_eq!(fault(&found, &expected, EXACT), None, "{name}");
                }
                let within = ROUNDING.of_triangles();
                assert_eq!(fault(&found, &raster, within), None, "{name}, to triangles");
            }
        }
        let backwards: Vec<Record> = records.iter().rev().copied().collect();
        let raster = by_raster(drawer.engines.gpu().expect("a device"), &base, &records);
        let found = by_lists(drawer.engines.gpu().expect("a device"), &base, &backwards);
        assert!(fault(&found, &raster, ROUNDING).is_some(), "the order matters");
    }
}

/// Slabs in double precision: each kernel's integral between two depths by Simpson's rule along the
/// pixel's ray, in the projection linearised at its centre.
fn slabs(scene: &Scene, kernels: &[RefKernel], published: bool) -> (Light, u64) {
    let camera = &scene.camera;
    let scale = camera.pixels_per_unit(f64::from(SIZE[1]));
    let eye = camera.eye_distance();
    let rotation = camera.view_from_world_rotation();
    let unit = scene.opacity_unit_distance();
    let middle = camera.to_view(scene.lattice().centre()).z;
    let thickness = scene.lattice().smallest_spacing() / scene.splat.slabs_per_voxel;
    let shape = RadialKernel::new(scene.splat.kernel, scene.splat.extent).expect("radial");
    struct Seen {
        at: DVec2,
        depth: f64,
        inverse: DMat3,
        reach: DVec3,
    }
    let seen: Vec<Seen> = kernels
        .iter()
        .map(|k| {
            let view = camera.to_view(k.centre);
            let jacobian =
                eye.map_or(DMat3::IDENTITY, |d| perspective_jacobian(view, d).expect("in front"));
            let map = jacobian * rotation * k.map;
            let rows = map.transpose();
            Seen {
                at: view.truncate() * eye.map_or(1.0, |d| d / view.z),
                depth: view.z,
                inverse: map.inverse(),
                reach: shape.radius()
                    * DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()),
            }
        })
        .collect();
    let ends =
        |sign: f64| seen.iter().map(move |s| (s.depth + sign * s.reach.z - middle) / thickness);
    let first = ends(-1.0).fold(f64::INFINITY, f64::min).floor() as i64;
    let last = ends(1.0).fold(f64::NEG_INFINITY, f64::max).floor() as i64;
    let mut capped = 0;
    let picture = (0..SIZE[0] * SIZE[1])
        .map(|i| {
            let pixel = [i % SIZE[0], i / SIZE[0]].map(|p| f64::from(p) + 0.5);
            let screen = DVec2::new(
                pixel[0] - f64::from(SIZE[0]) / 2.0,
                f64::from(SIZE[1]) / 2.0 - pixel[1],
            ) / scale;
            let slant = eye.map_or(1.0, |d| (screen / d).extend(1.0).length());
            let mut sums = vec![[0.0; 4]; (last - first + 1) as usize];
            for (k, s) in kernels.iter().zip(&seen) {
                let p = screen - s.at;
                if p.x.abs() > s.reach.x || p.y.abs() > s.reach.y {
                    continue;
                }
                let opacity =
                    if published { -(-k.extinction * unit).exp_m1() / unit } else { k.extinction };
                let h = |z: f64| shape.value((s.inverse * p.extend(z - s.depth)).length());
                let low = ((s.depth - s.reach.z - middle) / thickness).floor() as i64;
                let high = ((s.depth + s.reach.z - middle) / thickness).floor() as i64;
                for slab in low..=high {
                    const STEPS: u32 = 24;
                    let (z, step) =
                        (middle + slab as f64 * thickness, thickness / f64::from(STEPS));
                    let sum: f64 = (0..STEPS)
                        .map(|j| z + f64::from(j) * step)
                        .map(|a| h(a) + 4.0 * h(a + step / 2.0) + h(a + step))
                        .sum();
                    let amount = opacity * slant * sum * step / 6.0;
                    let into = &mut sums[(slab - first) as usize];
                    (0..3).for_each(|c| into[c] += amount * k.colour[c]);
                    into[3] += amount;
                }
            }
            let mut out = [0.0; 4];
            for sum in sums.iter().rev().filter(|s| s[3] > 0.0) {
                capped += u64::from(published && sum[3] > 1.0);
                let alpha = if published { sum[3].min(1.0) } else { -(-sum[3]).exp_m1() };
                for c in 0..3 {
                    out[c] = sum[c] / sum[3] * alpha + (1.0 - alpha) * out[c];
                }
                out[3] = alpha + (1.0 - alpha) * out[3];
            }
            out
        })
        .collect();
    (picture, capped)
}

#[test]
fn slabs_are_each_kernels_integral_between_their_faces() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = dense(&base, 50, 11);
        for (kernel, extent) in
            [(Kernel::Cubic, None), (Kernel::Gaussian, None), (Kernel::Cubic, Some(2.5))]
        {
            let mut base = with_kernel(base.clone(), kernel);
            base.splat.extent = extent;
            for slabs_per_voxel in [0.5, 1.0, 4.0] {
                let scene = in_slabs(&base, slabs_per_voxel, Order::FrontToBack);
                let (expected, _) = slabs(&scene, &kernels(&scene, &records), false);
                let name = format!("{} {extent:?}, {slabs_per_voxel}, {name}", kernel.name());
                for order in ORDERS {
                    let scene = in_order(&scene, order);
                    let found = by_lists(drawer.engines.gpu().expect("a device"), &scene, &records);
                    print_measured(&format!("slabs {name}, {}", order.name()), &found, &expected);
                    assert_eq!(fault(&found, &expected, DENSE), None, "{name}");
                }
            }
        }
        // Slabs twice as thick are found.
        let mut moved = in_slabs(&base, 1.0, Order::FrontToBack);
        let expected = slabs(&moved, &kernels(&moved, &records), false).0;
        moved.splat.slabs_per_voxel = 0.5;
        let found = by_lists(drawer.engines.gpu().expect("a device"), &moved, &records);
        print_measured(&format!("slabs of another thickness, {name}"), &found, &expected);
        assert!(fault(&found, &expected, DENSE).is_some(), "{name}: slabs of another thickness");
    }
}

#[test]
fn alpha_is_the_same_in_every_mode_and_order() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = records(&base, 80, 5);
        for kernel in [Kernel::Cubic, Kernel::Gaussian, Kernel::Nearest, Kernel::Point] {
            let base = with_kernel(base.clone(), kernel);
            let every = by_lists(drawer.engines.gpu().expect("a device"), &base, &records);
            for slabs_per_voxel in [0.25, 1.0, 3.0, 16.0] {
                for order in ORDERS {
                    let scene = in_slabs(&base, slabs_per_voxel, order);
                    let found = by_lists(drawer.engines.gpu().expect("a device"), &scene, &records);
                    let most = every.iter().zip(&found).map(|(a, b)| (a[3] - b[3]).abs());
                    let most = most.fold(0.0, f64::max);
                    println!(
                        "measured alpha {name} {} {slabs_per_voxel} {}: {most:.1e}",
                        kernel.name(),
                        order.name()
                    );
                    assert!(most <= 1e-5, "{name} {}: {most:e}", kernel.name());
                }
            }
        }
    }
}

#[test]
fn published_opacity_is_opacity_times_footprint_and_sums_are_capped_at_one_and_counted() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = dense(&base, 24, 17);
        let mut scene = in_slabs(&base, 0.5, Order::FrontToBack);
        scene.splat.opacity_model = OpacityModel::Published;
        let (expected, caps) = slabs(&scene, &kernels(&scene, &records), true);
        let what = Scattered::new(&records, &scene.splat);
        let renderer = drawer.engines.gpu().expect("a device");
        let (found, _) = drawn_as(renderer, &scene, &what);
        let counted = renderer.capped_sums().expect("counted");
        print_measured(&format!("published slabs, {name}"), &found, &expected);
        let within = Within { max_abs: 2e-3, rmse: 2e-4, bias: 5e-5 };
        assert_eq!(fault(&found, &expected, within), None, "{name}");
        let (caps, counted) = (caps as f64, counted as f64);
        println!("measured caps, {name}: {counted} for {caps}");
        assert!(caps > 0.0 && (counted / caps - 1.0).abs() < 0.01, "{counted} {caps}");

        // One kernel alone: its opacity is alpha times footprint.
        let one = &records[records.len() / 2..=records.len() / 2];
        scene.splat.visibility = Visibility::EverySample;
        let found = by_lists(drawer.engines.gpu().expect("a device"), &scene, one);
        let pixels = SIZE.map(|n| n as usize);
        let (kernel, camera) = (scene.splat.kernel, &scene.camera);
        let mut weak = kernels(&scene, one);
        let unit = scene.opacity_unit_distance();
        weak[0].extinction = -(-weak[0].extinction * unit).exp_m1() / unit;
        let depth: Light = every_sample(&weak, kernel, None, camera, pixels, Rays::Local)
            .iter()
            .map(|p| {
                let depth = -(-p[3]).ln_1p();
                [p[0], p[1], p[2], p[3]]
                    .map(|c| if p[3] > 0.0 { c / p[3] * depth.min(1.0) } else { 0.0 })
            })
            .collect();
        assert_eq!(fault(&found, &depth, within), None, "{name}, one kernel");
    }
}

/// Bits of a picture.
pub(crate) fn bits(light: &Light) -> Vec<u64> {
    light.iter().flatten().map(|c| c.to_bits()).collect()
}

#[test]
fn too_little_room_and_halved_rectangles_give_the_same_bits_as_room_for_all() {
    let Some(mut drawer) = drawer() else { return };
    for (name, base) in views() {
        let records = records(&base, 80, 5);
        for scene in [base.clone(), in_slabs(&base, 2.0, Order::FrontToBack)] {
            let all = Scattered::new(&records, &scene.splat);
            // Makes room, where no test before has.
            drawn_as(drawer.engines.gpu().expect("a device"), &scene, &all);
            let (expected, totals) =
                drawn_as(drawer.engines.gpu().expect("a device"), &scene, &all);
            assert_eq!((totals.rectangles, totals.rewritten), (1, 0), "{name}: room from before");
            let (again, _) = drawn_as(drawer.engines.gpu().expect("a device"), &scene, &all);
            assert_eq!(bits(&again), bits(&expected), "{name}: twice");
            let (found, totals) = drawn_as(
                drawer.engines.gpu().expect("a device"),
                &scene,
                &Scattered { room: 1, ..all },
            );
            assert_eq!(totals.rewritten, 1, "{name}");
            assert_eq!(bits(&found), bits(&expected), "{name}: grown from room for one");
            let few = Scattered { most_entries: 150, room: 100, ..all };
            let (found, totals) = drawn_as(drawer.engines.gpu().expect("a device"), &scene, &few);
            assert!(totals.rectangles > 3, "{name}: {totals:?}");
            assert_eq!(bits(&found), bits(&expected), "{name}: in {} parts", totals.rectangles);
            // Shorter by one entry shows.
            let fewer = Scattered::new(&records[1..], &scene.splat);
            let (found, _) = drawn_as(drawer.engines.gpu().expect("a device"), &scene, &fewer);
            assert_ne!(bits(&found), bits(&expected), "{name}: one kernel less");
        }
    }
}

#[test]
fn kernels_larger_than_the_picture_smaller_than_a_pixel_and_about_the_eye_are_the_triangles() {
    let Some(mut drawer) = drawer() else { return };
    let base = parallel();
    let mut close = base.clone();
    close.camera.parallel_scale /= 40.0;
    let mut far = base.clone();
    far.camera.parallel_scale *= 200.0;
    let mut around = in_perspective(base.clone(), 60.0);
    around.camera.parallel_scale = 0.4;
    let mut behind = in_perspective(base, 60.0);
    behind.camera.focal_point += behind.camera.direction * 3000.0;
    for (name, scene) in [("close", close), ("far", far), ("around", around), ("behind", behind)] {
        let records = records(&scene, 60, 23);
        let raster = by_raster(drawer.engines.gpu().expect("a device"), &scene, &records);
        let most = raster.iter().map(|p| p[3]).fold(0.0, f64::max);
        assert_eq!(most > 0.0, name != "behind", "{name}: {most}");
        for order in ORDERS {
            let found = by_lists(
                drawer.engines.gpu().expect("a device"),
                &in_order(&scene, order),
                &records,
            );
            print_measured(&format!("{name}, {}", order.name()), &found, &raster);
            let within = Within { max_abs: 1e-4, rmse: 1e-5, bias: 5e-6 };
            assert_eq!(fault(&found, &raster, within), None, "{name}");
            let slabs = by_lists(
                drawer.engines.gpu().expect("a device"),
                &in_slabs(&scene, 1.0, order),
                &records,
            );
            let most = slabs.iter().zip(&found).map(|(a, b)| (a[3] - b[3]).abs());
            let most = most.fold(0.0, f64::max);
            println!("measured alpha of slabs, {name}: {most:.1e}");
            assert!(most <= 1e-5, "{name}: {most:e}");
            assert!(slabs.iter().flatten().all(|c| c.is_finite()), "{name}");
        }
    }
}

#[test]
fn nothing_is_an_empty_picture_sheets_are_refused_and_the_observer_stops_it() {
    let Some(mut drawer) = drawer() else { return };
    let mut scene = parallel();
    let (light, totals) = drawn_as(
        drawer.engines.gpu().expect("a device"),
        &scene,
        &Scattered::new(&[], &scene.splat),
    );
    assert!(light.iter().flatten().all(|&c| c == 0.0));
    assert_eq!(totals, ListTotals { finished: true, ..ListTotals::default() });
    let clear = [Record::new([3; 3], [2; 3], 0.0, [65_535; 3])];
    let (light, _) = drawn_as(
        drawer.engines.gpu().expect("a device"),
        &scene,
        &Scattered::new(&clear, &scene.splat),
    );
    assert!(light.iter().flatten().all(|&c| c == 0.0));

    let records = records(&scene, 20, 2);
    let view = begun(drawer.engines.gpu().expect("a device"), &scene);
    let what = Scattered { piece_ms: 0.0, ..Scattered::new(&records, &scene.splat) };
    let mut seen = Vec::new();
    let stopped =
        drawer.engines.gpu().expect("a device").draw_scattered(&view, &what, &mut |_, done| {
            seen.push(done);
            seen.len() < 3
        });
    assert!(!stopped.expect("it draws").finished);
    assert!(seen.len() == 3 && seen.is_sorted() && seen[2] < 1.0, "{seen:?}");

    scene.splat.visibility = Visibility::Sheets;
    let what = Scattered::new(&records, &scene.splat);
    let refused =
        drawer.engines.gpu().expect("a device").draw_scattered(&view, &what, &mut |_, _| true);
    assert_eq!(refused, Err(GpuError::NoSheets));
}

#[test]
fn stopping_early_leaves_out_no_more_than_it_says() {
    let Some(mut drawer) = drawer() else { return };
    for mut scene in [parallel(), in_slabs(&parallel(), 1.0, Order::FrontToBack)] {
        scene.splat.order = Order::FrontToBack;
        let records = dense(&scene, 80, 5);
        let all = Scattered::new(&records, &scene.splat);
        let (expected, _) = drawn_as(drawer.engines.gpu().expect("a device"), &scene, &all);
        let (found, _) = drawn_as(
            drawer.engines.gpu().expect("a device"),
            &scene,
            &Scattered { stop_below: 0.01, ..all },
        );
        let most = found.iter().flatten().zip(expected.iter().flatten());
        let most = most.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("measured stop below 0.01: {most:.1e}");
        assert!(most > 0.0 && most <= 0.01, "{most}");
    }
}

#[test]
fn sixteen_bit_light_is_the_same_picture_less_exactly() {
    let wishes = Wishes { float32_blending: false, ..Wishes::default() };
    let Some(context) = context(wishes) else { return };
    let Some(mut exact) = drawer() else { return };
    let scene = in_slabs(&parallel(), 1.0, Order::FrontToBack);
    let records = records(&scene, 40, 9);
    let found = by_lists(&mut Renderer::new(context), &scene, &records);
    let expected = by_lists(exact.engines.gpu().expect("a device"), &scene, &records);
    // The light is rounded once: 2^-11.
    let within = Within { max_abs: 5e-4, rmse: 2e-4, bias: 1e-4 };
    assert_eq!(fault(&found, &expected, within), None);
}

#[test]
fn a_cut_is_drawn_by_lists_where_the_scene_says_so() {
    let Some(mut drawer) = drawer() else { return };
    let coarse = Rung::Subsampled { level: 1 };
    let base = scene(Lattice::unit([16; 3]), DVec3::new(0.5, -0.4, 0.7));
    let passes = |drawer: &mut Drawer, scene: &Scene| {
        drawer.engines.gpu().expect("a device").time_passes();
        let (light, _) = drawn(drawer, scene, SIZE, coarse);
        drawer.engines.gpu().expect("a device").stop_timing();
        (
            light,
            drawer
                .engines
                .gpu()
                .expect("a device")
                .times()
                .iter()
                .map(|t| t.name)
                .collect::<Vec<_>>(),
        )
    };
    let (raster, names) = passes(&mut drawer, &base);
    assert_eq!(names, ["splat"]);
    let mut tiles = base.clone();
    tiles.splat.backend = Backend::Tiles;
    let (lists, names) = passes(&mut drawer, &tiles);
    let expected = [
        "count_entries",
        "scan_counts",
        "write_entries",
        "count_digits",
        "scatter_digits",
        "find_ranges",
        "composite_lists",
    ];
    assert_eq!(names, expected);
    assert_eq!(fault(&lists, &raster, ROUNDING.of_triangles()), None);
    let (slabs, names) = passes(&mut drawer, &in_slabs(&base, 1.0, Order::FrontToBack));
    assert_eq!(names, expected);
    assert!(fault(&slabs, &raster, ROUNDING.of_triangles()).is_some(), "slabs are another picture");
}
