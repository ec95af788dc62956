//! Whole pictures of every kind: by any number of threads, and by the narrowest instructions as by the widest.

use std::sync::Arc;

use fearless_simd::Level;
use glam::DVec3;

use super::renderer::{Renderer, Stored, StoredLevels, tile_count};
use super::tests::{scene, shard, volume_of_cells, volume_of_functions, winds};
use super::walk::Pixel;
use super::{Node, slab_thickness};
use crate::cells::On;
use crate::core::{Projection, Ticket};
use crate::kernel::{Averaged, Coefficients, Kernel, coefficients};
use crate::plan::{EMPTY, FieldCut, KernelSlabs, Plan, SlabField};
use crate::rbf::Basis;
use crate::scene::{
    AlongRay, Amounts, ClipBox, Index, Isosurface, Lighting, OpacityModel, Order, SampleSource,
    Scene, Slice, SplatSettings, Visibility, framing_camera, opening,
};
use crate::transfer::{Cumulative, Weight};
use crate::volume::{Lattice as Grid, Samples, ScalarVolume};

/// What a picture is drawn from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Source {
    /// All that its scene has.
    Scene,
    /// A cut of the scene's field.
    Cut,
    /// Boxes of the scene's voxels.
    Nodes,
}

/// Samples over a range, which what is drawn in their place has its table over.
fn over(lattice: Grid, [low, high]: [f32; 2]) -> ScalarVolume {
    let last = lattice.len() as f32 - 1.0;
    let samples = (0..lattice.len()).map(|i| low + (high - low) * i as f32 / last).collect();
    ScalarVolume::from_samples("range", lattice, Samples::Float32(samples)).expect("a volume")
}

/// All of a volume, with opacities at values.
fn seen(volume: ScalarVolume, opacity: [(f64, f64); 2], splat: SplatSettings) -> Scene {
    let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
    scene.transfer_mut().expect("a field").opacity = opacity.to_vec();
    let camera = framing_camera(&scene.lattice(), DVec3::new(0.5, 0.7, -0.4), DVec3::Z);
    Scene { splat, camera, ..scene }
}

/// One of every kind that there are loops, or ways through them, for.
fn pictures() -> Vec<(&'static str, Scene, Source)> {
    let plain = scene();
    let (exact, first) = (SplatSettings::EXACT, SplatSettings::SHADE_FIRST);
    let in_mode = |splat: SplatSettings| Scene { splat, ..plain.clone() };
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = plain.clone();
        change(&mut scene);
        scene
    };
    let lit = |scene: Scene| {
        let mut scene = scene;
        scene.shading.lighting = Some(Lighting::default());
        scene
    };
    let mut alone = plain.clone().with(winds());
    alone.show_field(false);
    let mut polygons_alone = plain.clone().with(shard());
    polygons_alone.show_field(false);
    let cells = volume_of_cells([16, 14, 15], On::Points, DVec3::splat(0.7));
    let cells = ScalarVolume { cells: cells.cells.clone(), ..over(cells.lattice, [0.0, 100.0]) };
    let cells = seen(cells, [(30.0, 0.0), (70.0, 0.4)], SplatSettings::CELLS);
    let functions = volume_of_functions([16, 14, 15], Basis::Gaussian);
    let functions = ScalarVolume {
        functions: functions.functions.clone(),
        ..over(functions.lattice, [-1.0, 3.0])
    };
    let functions = seen(functions, [(0.0, 0.0), (2.0, 0.4)], SplatSettings::FUNCTIONS);
    let table = |scene: &mut Scene| {
        let points = vec![(0.0, 0.0), (100.0, 0.4)];
        scene.shading.opacity = Some(Amounts { index: Index::GradientStrength, points });
    };
    let surfaces = |scene: &mut Scene| {
        let high = [0.9, 1.0, 0.8];
        scene.inside.clip.bounds = Some(ClipBox { low: [0.1, 0.0, 0.2], high });
        scene.inside.slices = vec![Slice::across(&scene.lattice(), 2, 0.4, 0.8)];
        scene.inside.isosurfaces = vec![Isosurface { value: 450.0, opacity: 0.5, colour: None }];
    };
    let perspective =
        |scene: &mut Scene| scene.camera.projection = Projection::Perspective { view_angle: 0.9 };
    let sheets = SplatSettings { visibility: Visibility::Sheets, sheets_per_kernel: 3, ..first };
    let slabs = SplatSettings { visibility: Visibility::Slabs, ..first };
    let published = SplatSettings {
        opacity_model: OpacityModel::Published,
        order: Order::BackToFront,
        ..exact
    };
    let linear = SplatSettings { kernel: Kernel::Linear, ..exact };
    let tents_published = SplatSettings { kernel: Kernel::Linear, ..published };
    vec![
        ("exact", plain.clone(), Source::Scene),
        ("exact, in perspective", with(&perspective), Source::Scene),
        ("tents", in_mode(linear), Source::Scene),
        ("wide splines", in_mode(SplatSettings { extent: Some(1.6), ..exact }), Source::Scene),
        ("published, back to front", in_mode(published), Source::Scene),
        ("lit", lit(plain.clone()), Source::Scene),
        ("a table by gradients", with(&table), Source::Scene),
        ("clipped, with surfaces", with(&surfaces), Source::Scene),
        ("the greatest value", with(&|s| s.inside.along = AlongRay::Maximum), Source::Scene),
        ("vectors and polygons", plain.clone().with(winds()).with(shard()), Source::Scene),
        ("vectors alone", alone, Source::Scene),
        ("polygons alone", polygons_alone, Source::Scene),
        ("every sample", in_mode(first), Source::Scene),
        ("every sample, lit", lit(in_mode(first)), Source::Scene),
        ("samples in sheets", in_mode(sheets), Source::Scene),
        (
            "splines in slabs",
            in_mode(SplatSettings { kernel: Kernel::BSpline, ..slabs }),
            Source::Scene,
        ),
        ("polygons among samples", in_mode(first).with(shard()), Source::Scene),
        ("nodes", in_mode(first), Source::Nodes),
        ("functions", functions.clone(), Source::Scene),
        ("functions, lit", lit(functions), Source::Scene),
        ("cells", cells.clone(), Source::Scene),
        ("cells, lit", lit(cells), Source::Scene),
        ("tents, lit", lit(in_mode(linear)), Source::Scene),
        ("tents, lit and published", lit(in_mode(tents_published)), Source::Scene),
        ("a cut of splines", plain.clone(), Source::Cut),
        ("a cut of splines, lit", lit(plain.clone()), Source::Cut),
        ("a cut of splines, with surfaces", with(&surfaces), Source::Cut),
        ("a cut of tents", in_mode(linear), Source::Cut),
        ("a cut of tents, lit", lit(in_mode(linear)), Source::Cut),
        ("a cut of tents, back to front", in_mode(tents_published), Source::Cut),
    ]
}

/// An engine with the field, or the samples, of a plan.
fn prepared(level: Level, threads: usize, plan: &Plan) -> Renderer {
    let mut renderer = Renderer::with(level, threads);
    let Some(field) = plan.field() else { return renderer };
    if !plan.reconstructs() {
        renderer.make_samples(plan, &Ticket::new()).expect("not cancelled");
        return renderer;
    }
    let (volume, mode, ticket) = (&field.volume, &plan.mode, Ticket::new());
    let made = coefficients(volume, mode.kernel, mode.extent, true, &ticket).expect("they fit");
    let which = SlabField::Own;
    let stored = Stored::new(which, volume, mode, made, &ticket).expect("not cancelled");
    renderer.set_field(which, stored);
    let weight = match mode.opacity_model {
        OpacityModel::OpticalDepth => Weight::Extinction,
        OpacityModel::Published => Weight::Opacity,
    };
    let transfer = plan.shading.by_value(&field.transfer);
    let scalar_type = volume.samples.scalar_type();
    let table = Cumulative::new(&transfer, scalar_type, &volume.statistics, weight);
    let levels: Vec<f64> = plan.inside.isosurfaces.iter().map(|surface| surface.value).collect();
    renderer.set_table(which, &table, &levels, &ticket).expect("not cancelled");
    renderer
}

/// Boxes of every third of a lattice's pairs of voxels along each axis, far to near.
fn nodes(plan: &Plan) -> Vec<Node> {
    let lattice = &plan.frame.lattice;
    let [nx, ny, nz] = lattice.dims.map(|n| n as u32 / 2);
    let node = |i: u32| {
        let any = |k: u32| (i.wrapping_mul(k) % 997) as f32 / 997.0;
        let low = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| 2 * n);
        let (extinction, colour) = (0.3 * any(389), [any(211), any(677), 0.5]);
        Node { low, size: [2; 3], extinction, colour }
    };
    let depth = |node: &Node| {
        let middle = DVec3::from(node.low.map(f64::from)) + 0.5;
        plan.camera.direction.dot(lattice.world_from_index(middle))
    };
    let mut nodes: Vec<Node> = (0..nx * ny * nz).step_by(3).map(node).collect();
    nodes.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
    nodes
}

/// Means of 2^level samples a side.
fn means(volume: &ScalarVolume, level: u32) -> Coefficients {
    let (step, all) = (1_usize << level, volume.lattice.dims);
    let dims = all.map(|n| n.div_ceil(step));
    let mean = |i: usize| {
        let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let along = |axis: usize| step * at[axis]..all[axis].min(step * (at[axis] + 1));
        let (mut sum, mut count) = (0.0, 0.0);
        for z in along(2) {
            for y in along(1) {
                for x in along(0) {
                    sum += volume.samples.get((z * all[1] + y) * all[0] + x);
                    count += 1.0;
                }
            }
        }
        (sum / count) as f32
    };
    let values = (0..dims.iter().product()).map(mean).collect();
    let averaged = Averaged { level, volume_dims: all, half_widths: Vec::new() };
    Coefficients::of_means(dims, values, 0.0, averaged, &Ticket::new()).expect("not cancelled")
}

/// A cut of all three levels of the field that an engine holds, which has their means then.
fn cut(renderer: &mut Renderer, plan: &Plan) -> FieldCut {
    let volume = &plan.field().expect("a field").volume;
    let levels = [1, 2].map(|level| means(volume, level));
    let levels = StoredLevels::new(volume, levels, &Ticket::new()).expect("not cancelled");
    renderer.set_levels(levels);
    let (bricks, shown) = renderer.shown_bricks().expect("a table");
    let mut levels = vec![EMPTY; bricks.iter().product::<usize>()];
    for &brick in shown {
        levels[brick as usize] = (brick % 3) as u8;
    }
    FieldCut::new(bricks, levels)
}

/// A picture that was begun.
fn begun(
    (level, threads): (Level, usize),
    (scene, from): (&Scene, Source),
    size: [u32; 2],
) -> Renderer {
    const STOP_BELOW: f64 = 5e-4;
    let (mut plan, ticket) = (Plan::of(scene, size), Ticket::new());
    let mut renderer = prepared(level, threads, &plan);
    if from == Source::Nodes {
        let begun = renderer.begin_nodes(&plan, &nodes(&plan), STOP_BELOW, &ticket);
        begun.expect("few slabs");
        return renderer;
    }
    if from == Source::Cut {
        plan.cut = Some(Arc::new(cut(&mut renderer, &plan)));
    }
    let splats = plan.kernels.iter().map(|list| {
        let levels = list.classification.levels(&ticket).expect("not cancelled");
        Arc::clone(&levels[0])
    });
    let (splats, thickness): (Vec<_>, _) = (splats.collect(), slab_thickness(&plan));
    let slabs = KernelSlabs { splats, thickness, field_slabs: 1 };
    let slabs = Some(&slabs).filter(|slabs| !slabs.splats.is_empty());
    let begun = renderer.begin(&plan, SlabField::Own, slabs, STOP_BELOW, &ticket);
    begun.expect("few slabs");
    renderer
}

#[test]
fn pictures_have_the_same_bits_for_any_number_of_threads() {
    let size = [61, 45];
    let tiles = tile_count(size);
    for (name, scene, from) in pictures() {
        let draw = |threads: usize| {
            let mut renderer = begun((Level::new(), threads), (&scene, from), size);
            let ticket = Ticket::new();
            let mut some = |tiles: std::ops::Range<u32>, most_ms: f64| {
                renderer.draw_tiles(tiles, most_ms, &ticket).expect("not cancelled")
            };
            assert_eq!(some(0..tiles / 2, f64::INFINITY), tiles / 2, "{name}");
            // Where there is no time each thread draws one, and what was left out is drawn later.
            let next = some(tiles / 2..tiles, 0.0);
            assert!((1..=threads).contains(&((next - tiles / 2) as usize)), "{name}: {next}");
            assert_eq!(some(next..tiles, f64::INFINITY), tiles, "{name}");
            renderer.light()
        };
        let (one, drawn) = draw(1);
        assert_eq!(drawn, size);
        let seen = one.iter().filter(|pixel| pixel[3] > 0.02).count();
        assert!(seen > 200, "{name}: {seen}");
        for threads in [2, 16] {
            assert!(draw(threads).0 == one, "{name}: {threads} threads");
        }
    }
}

#[test]
fn every_loop_draws_one_of_the_pictures_that_are_compared() {
    let mut names = std::collections::BTreeSet::new();
    for (_, scene, from) in pictures() {
        let mut renderer = begun((Level::new(), 2), (&scene, from), [16, 16]);
        assert_eq!(renderer.loop_name(), None, "nothing is drawn yet");
        renderer.draw_tiles(0..1, f64::INFINITY, &Ticket::new()).expect("not cancelled");
        names.extend(renderer.loop_name());
    }
    for one in ["slabs of B-splines", "slabs of tents", "slabs of any kernel", "slabs of functions"]
    {
        assert!(names.iter().any(|name| name.starts_with(one)), "{one}: {names:?}");
    }
    for one in ["lists alone", "kernels shaded first", "values along rays"] {
        assert!(names.contains(one), "{one}: {names:?}");
    }
    // Where instructions are narrow there are no cuts, and loops with effects draw plain and lit pictures, too.
    let draws_cuts = Renderer::new().draws_cuts();
    let plain = ["slabs of B-splines", "slabs of tents", "slabs of functions", "slabs of cells"];
    let cuts = ["a cut of B-splines", "a cut of tents"];
    let lit = ["slabs of B-splines", "slabs of tents"].into_iter().chain(cuts);
    let wide = plain.into_iter().chain(cuts).map(|one| format!("{one}, plain"));
    for name in wide.chain(lit.map(|one| format!("{one}, lit"))) {
        assert_eq!(names.contains(&*name), draws_cuts, "{name}: {names:?}");
    }
    for (one, is_there) in
        plain.map(|one| (one, true)).into_iter().chain(cuts.map(|one| (one, draws_cuts)))
    {
        let name = format!("{one}, with effects");
        assert_eq!(names.contains(&*name), is_there, "{name}: {names:?}");
    }
    assert_eq!(names.iter().any(|name| name.starts_with("a cut")), draws_cuts, "{names:?}");
}

/// How near two pictures are, dB.
fn decibels(one: &[Pixel], other: &[Pixel]) -> f64 {
    let pairs = one.as_flattened().iter().zip(other.as_flattened());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    -10.0 * (squares / (4 * one.len()) as f64).log10()
}

/// By whichever instructions pictures are at least so near to each other, dB.
// Measured: 112.3 (wide splines), 121 and more of the others.
const LEAST_NEAR: f64 = 105.0;

/// What processors of this kind have at least (on x86-64 SSE2, without FMA) against the best that this one has.
#[test]
fn the_narrowest_instructions_draw_what_the_widest_do() {
    let (narrow, wide) = (Level::baseline(), Level::new());
    let names = [narrow, wide].map(|level| Renderer::with(level, 2).name());
    if names[0] == names[1] {
        println!("skipped other instructions: this processor draws with {} alone", names[0]);
        return;
    }
    let size = [64, 64];
    let mut faults = Vec::new();
    for (name, scene, from) in pictures() {
        // Where instructions are narrow all of a field is drawn in the place of a cut.
        if from == Source::Cut {
            continue;
        }
        let draw = |level: Level| {
            let mut renderer = begun((level, 2), (&scene, from), size);
            let tiles = tile_count(size);
            let drawn = renderer.draw_tiles(0..tiles, f64::INFINITY, &Ticket::new());
            assert_eq!(drawn.expect("not cancelled"), tiles, "{name}");
            renderer.light().0
        };
        let [narrow, wide] = [narrow, wide].map(draw);
        let near = decibels(&narrow, &wide);
        println!("measured {name}, {} and {}: {near:.1} dB", names[0], names[1]);
        faults.extend((near < LEAST_NEAR).then(|| format!("{name}: {near:.1} dB")));
        let nothing = decibels(&vec![[0.0; 4]; wide.len()], &wide);
        faults.extend((nothing > 30.0).then(|| format!("{name}: hardly seen")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
