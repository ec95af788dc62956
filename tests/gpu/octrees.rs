//! Octrees that the device builds, held to float64 sums over every voxel and to those of the host.

use std::sync::Arc;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{BrickRows, OctreeBuilder, Renderer, Wishes};
use voxsplat::hierarchy::{CutNode, ErrorMeasure, Node, Pyramid, PyramidParts};
use voxsplat::plan::Plan;
use voxsplat::scene::{SampleSource, Scene, SplatSettings, View, opening};
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::Effort;
use voxsplat::transfer::{ColourSource, NoData, Table, TransferFunction};
use voxsplat::volume::{Component, Lattice, Samples, ScalarVolume, demo};

use crate::engine::{Bench, rest};
use crate::support::{
    ON_HOST, Within, context, drawn, fault, noise, random, scene, volume, volume_of, wide,
    with_field, with_transfer,
};

const ON_DEVICE: Wishes = Wishes { octrees: Some(OctreeBuilder::Device), ..ON_HOST };

/// A node in float64.
#[derive(Debug, Clone, Copy, Default)]
struct Exact {
    extinction: f64,
    colour: [f64; 3],
    error: f64,
    active: u16,
}

/// Every level in float64: means and deviations by two passes over the voxels of each node, extinctions
/// from children to parents.
fn exact(
    volume: &ScalarVolume,
    table: &Table,
    depth: f64,
    measure: ErrorMeasure,
) -> Vec<Vec<Exact>> {
    let dims = volume.lattice.dims;
    let [low, high] = [volume.statistics.min, volume.statistics.max];
    let index = |[x, y, z]: [usize; 3]| (z * dims[1] + y) * dims[0] + x;
    let voxels: Vec<[f64; 4]> = (0..volume.lattice.len())
        .map(|i| table.lookup(volume.samples.get(i)).map(f64::from))
        .collect();
    // What errors are of: a row a voxel, `None` where it does not count.
    let rows: Vec<Option<[f64; 4]>> = (0..voxels.len())
        .map(|i| match measure {
            ErrorMeasure::Scalar => {
                let value = volume.samples.get(i).clamp(low, high);
                let part = if high > low { (value - low) / (high - low) } else { 0.0 };
                (!value.is_nan()).then_some([part, 0.0, 0.0, 0.0])
            }
            _ => {
                let [r, g, b, extinction] = voxels[i];
                let alpha = -(-extinction * depth).exp_m1();
                Some([alpha, alpha * r, alpha * g, alpha * b])
            }
        })
        .collect();
    let (mut finer_dims, mut finer): (_, Vec<Exact>) =
        (dims, voxels.iter().map(|v| Exact { extinction: v[3], ..Exact::default() }).collect());
    let (mut levels, mut edge) = (Vec::new(), 1);
    loop {
        let coarser = finer_dims.map(|n| n.div_ceil(2));
        let size = depth * f64::from(edge);
        edge *= 2;
        let nodes = (0..coarser.iter().product::<usize>()).map(|i| {
            let at = [i % coarser[0], i / coarser[0] % coarser[1], i / (coarser[0] * coarser[1])];
            let child = |bit: usize| {
                let at: [usize; 3] = std::array::from_fn(|a| 2 * at[a] + (bit >> a & 1));
                let is_real = (0..3).all(|a| at[a] < finer_dims[a]);
                is_real.then(|| finer[(at[2] * finer_dims[1] + at[1]) * finer_dims[0] + at[0]])
            };
            let children: [Option<Exact>; 8] = std::array::from_fn(child);
            let mut axes = 0.0;
            for axis in 0..3 {
                let columns = (0..8).filter(|bit| bit >> axis & 1 == 0).filter_map(|bit| {
                    let first = children[bit]?;
                    let both = [Some(first), children[bit | 1 << axis]];
                    let both = both.into_iter().flatten();
                    Some((both.clone().map(|c| c.extinction * size).sum(), both.count()))
                });
                let columns: Vec<(f64, usize)> = columns.collect();
                let mean = columns.iter().map(|(depth, _)| (-depth).exp()).sum::<f64>();
                axes += -(mean / columns.len() as f64).ln() / (columns[0].1 as f64 * size);
            }
            // One minus what is nearly one keeps few digits even here.
            let total: f64 = children.iter().flatten().map(|c| c.extinction).sum();
            let real = children.iter().flatten().count() as f64;
            let extinction = if total * size < 1e-5 { total / real } else { axes / 3.0 };
            let active = children.iter().flatten().filter(|c| c.extinction > 0.0).count() as u16;
            let edge_voxels = edge as usize;
            let inside = |a: usize| {
                let low = at[a] * edge_voxels;
                low..(low + edge_voxels).min(dims[a])
            };
            let all: Vec<usize> = inside(2)
                .flat_map(|z| inside(1).flat_map(move |y| inside(0).map(move |x| [x, y, z])))
                .map(index)
                .collect();
            let light: f64 = all.iter().map(|&i| voxels[i][3]).sum();
            let colour = std::array::from_fn(|c| {
                all.iter().map(|&i| voxels[i][3] * voxels[i][c]).sum::<f64>() / light.max(1e-300)
            });
            let counted: Vec<[f64; 4]> = all.iter().filter_map(|&i| rows[i]).collect();
            let n = counted.len().max(1) as f64;
            let squares: f64 = (0..4)
                .map(|c| {
                    let mean = counted.iter().map(|row| row[c]).sum::<f64>() / n;
                    counted.iter().map(|row| (row[c] - mean).powi(2)).sum::<f64>()
                })
                .sum();
            let own = (squares / n).sqrt() * f64::from(edge / 2);
            let below = children.iter().flatten().map(|c| c.error).fold(0.0, f64::max);
            let error = if active > 0 { own.max(below) } else { 0.0 };
            Exact { extinction: if active > 0 { extinction } else { 0.0 }, colour, error, active }
        });
        let nodes: Vec<Exact> = nodes.collect();
        (finer_dims, finer) = (coarser, nodes.clone());
        levels.push(nodes);
        if coarser == [1; 3] {
            return levels;
        }
    }
}

/// As the task builds it, in pieces of about so many bricks.
fn on_device(
    renderer: &mut Renderer,
    volume: &Arc<ScalarVolume>,
    table: &Table,
    (depth, measure, is_coarse): (f64, ErrorMeasure, bool),
    bricks: usize,
) -> Option<Pyramid> {
    renderer.set_volume(volume, &Ticket::new()).expect("it fits");
    renderer.set_table(table).expect("it fits");
    let mut parts = PyramidParts::new(volume, depth, measure, is_coarse).expect("it fits")?;
    while let Some([y, z]) = parts.next_rows(bricks) {
        let voxel_depth = depth as f32;
        let rows = BrickRows { y, z, voxel_depth, measure, has_nodes: !is_coarse };
        let merged = renderer.merge_bricks(&rows).expect("a sound device");
        parts.take([rows.y, rows.z], &merged.bricks, &merged.nodes);
    }
    Some(parts.finish(volume, table, &Ticket::new()).expect("nobody cancels"))
}

/// The greatest differences: of opacities of a node's thickness, as parts of them (a thousandth at least: of thinner
/// hazes single precision has few digits), of colours, and of errors by the greatest of them.
#[derive(Debug, Clone, Copy, Default)]
struct Off {
    opacity: f64,
    colour: f64,
    error: f64,
}

impl std::fmt::Display for Off {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { opacity, colour, error } = self;
        write!(f, "opacity {opacity:.1e}, colour {colour:.1e}, error {error:.1e}")
    }
}

impl Off {
    /// Of nodes that show; of others everything is 0 on both sides.
    fn of(found: &Pyramid, expected: &[Vec<Exact>], depth: f64, finest: usize) -> Self {
        let mut off = Self::default();
        assert_eq!(found.levels.len(), expected.len());
        let greatest = expected.iter().flatten().map(|n| n.error).fold(1e-3, f64::max);
        for (index, (found, expected)) in found.levels.iter().zip(expected).enumerate() {
            if index + 1 < finest {
                assert!(found.nodes.is_empty());
                continue;
            }
            assert_eq!(found.nodes.len(), expected.len());
            for (found, expected) in found.nodes.iter().zip(expected) {
                if index + 1 > finest || finest == 0 {
                    assert_eq!(found.active_children, expected.active, "level {}", index + 1);
                }
                if expected.active == 0 {
                    assert_eq!(*found, Node::default());
                    continue;
                }
                let thickness = depth * f64::from(2 << index);
                let [a, b] = [f64::from(found.extinction), expected.extinction]
                    .map(|e| -(-e * thickness).exp_m1());
                off.opacity = off.opacity.max((a - b).abs() / (1e-3 + b));
                for (a, b) in found.colour.iter().zip(expected.colour) {
                    off.colour = off.colour.max((f64::from(*a) / 65535.0 - b).abs());
                }
                let error = (f64::from(found.error) - expected.error).abs() / greatest;
                off.error = off.error.max(error);
            }
        }
        off
    }
}

/// Clear below a third of a range; red to blue.
fn ramp(low: f64, high: f64, opacity: f64) -> TransferFunction {
    let third = low + (high - low) / 3.0;
    TransferFunction::of(
        vec![(third, 0.0), (high, opacity)],
        ColourSource::Stops(vec![(low, Srgb8([250, 20, 10])), (high, Srgb8([20, 90, 255]))]),
    )
}

fn cases() -> Vec<(&'static str, Arc<ScalarVolume>, TransferFunction)> {
    let of = |dims: [usize; 3], samples: Samples| volume(Lattice::unit(dims), samples);
    let count = |dims: [usize; 3]| 0..dims.iter().product::<usize>();
    let bytes = |dims: [usize; 3]| of(dims, noise(dims, 3));
    let near_a_million = |dims: [usize; 3], holes: bool| {
        let value = |i: usize| match holes && i % 13 == 5 {
            true => f64::NAN,
            false => 1e6 + random(5, i),
        };
        count(dims).map(value).collect::<Vec<f64>>()
    };
    // Blocks, so that bricks are clear, full and between.
    let blocks = |dims: [usize; 3]| {
        let value = |i: usize| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let block = at.map(|n| n / 9).iter().sum::<usize>() % 3;
            (random(9, i) * 80.0 + 80.0 * block as f64) as i16 - 100
        };
        of(dims, Samples::Int16(count(dims).map(value).collect()))
    };
    let shown = TransferFunction {
        no_data: NoData { colour: Srgb8([0, 255, 0]), opacity: 0.4 },
        ..ramp(1e6, 1e6 + 1.0, 0.9)
    };
    let step =
        |at: f64| TransferFunction { opacity: vec![(at, 0.0), (at, 1.0)], ..ramp(0.0, 255.0, 1.0) };
    vec![
        ("noise, odd", bytes([19, 33, 20]), ramp(0.0, 255.0, 0.9)),
        ("noise, whole bricks", bytes([24, 16, 16]), ramp(0.0, 255.0, 0.2)),
        ("blocks, int16", blocks([43, 25, 18]), ramp(-100.0, 140.0, 0.97)),
        ("a sheet", bytes([1, 21, 60]), ramp(0.0, 255.0, 0.9)),
        ("a row", bytes([70, 1, 1]), ramp(0.0, 255.0, 0.9)),
        ("holes", of([24, 17, 9], Samples::Float64(near_a_million([24, 17, 9], true))), shown),
        (
            "floats, holes left out",
            of(
                [17, 9, 24],
                Samples::Float32(
                    near_a_million([17, 9, 24], true).iter().map(|&v| (v - 1e6) as f32).collect(),
                ),
            ),
            ramp(0.0, 1.0, 0.9),
        ),
        ("opaque steps", bytes([16, 17, 9]), step(128.0)),
        (
            "all opaque",
            of([9; 3], Samples::Int8(vec![-3; 729])),
            TransferFunction { opacity: vec![(-10.0, 1.0), (10.0, 1.0)], ..ramp(-10.0, 10.0, 1.0) },
        ),
        ("a haze", bytes([16; 3]), ramp(0.0, 255.0, 1e-6)),
        ("nothing", bytes([16; 3]), ramp(300.0, 400.0, 1.0)),
        (
            "a bright voxel",
            of(
                [17; 3],
                Samples::UInt16((0..4913).map(|i| if i == 2000 { 60_000 } else { 7 }).collect()),
            ),
            ramp(0.0, 65_535.0, 1.0),
        ),
    ]
}

/// Measured on llvmpipe: opacities within 1.1e-5, colours within half a step of 16 bits, errors within 1.3e-6; the
/// host's within 5.3e-5, as much, and 1.3e-7. Children that show, and voxels of each slice, are exact.
#[test]
fn what_the_device_merges_is_what_every_voxel_comes_to_in_float64() {
    let Some(context) = context(ON_DEVICE) else { return };
    let mut renderer = Renderer::new(context);
    let depth = 0.8;
    for (name, volume, transfer) in cases() {
        let table = Table::new(&transfer, volume.samples.scalar_type());
        for measure in [ErrorMeasure::Classified, ErrorMeasure::Scalar] {
            assert!(renderer.builds_octree(&volume, measure));
            let expected = exact(&volume, &table, depth, measure);
            let host = Pyramid::build(&volume, &table, depth, measure, &Ticket::new());
            let host = host.expect("it fits");
            let how = (depth, measure, false);
            let device = on_device(&mut renderer, &volume, &table, how, 1 << 20).expect("levels");
            // In pieces of a row of bricks: the same bits.
            let pieces = on_device(&mut renderer, &volume, &table, how, 1).expect("levels");
            for (a, b) in device.levels.iter().zip(&pieces.levels) {
                assert!(a.nodes == b.nodes, "{name}: other bits in pieces");
            }
            assert_eq!(device.active, host.active, "{name}");
            assert_eq!(pieces.active, host.active, "{name}");
            assert!(device.is_whole());
            let off = Off::of(&device, &expected, depth, 0);
            let of_host = Off::of(&host, &expected, depth, 0);
            println!("measured {name}, {}: {off}; host {of_host}", measure.name());
            assert!(off.opacity < 3e-5, "{name}: {off:?}");
            assert!(off.colour < 1.7e-5, "{name}: {off:?}");
            assert!(off.error < 5e-6, "{name}: {off:?}");

            let how = (depth, measure, true);
            let coarse = on_device(&mut renderer, &volume, &table, how, 2).expect("levels");
            assert!(!coarse.is_whole() && coarse.active.total == host.active.total);
            assert!(coarse.active.per_slice.iter().all(Vec::is_empty));
            for (coarse, whole) in coarse.levels.iter().zip(&device.levels).skip(2) {
                let seen = |n: &Node| (n.extinction.to_bits(), n.error.to_bits(), n.colour);
                let [a, b] = [coarse, whole].map(|l| l.nodes.iter().map(seen).collect::<Vec<_>>());
                assert!(a == b, "{name}: coarse levels are those of all of it");
            }
        }
    }
}

/// A picture within a budget is its cut, thinned: the same bits as the cut's nodes drawn by themselves with the
/// factor that belongs to them.
#[test]
fn quick_pictures_of_cuts_are_thinned() {
    let Some(context) = context(Wishes::default()) else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let grid = demo::open("head", Some(40)).expect("a demo there is");
    let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new()).expect("finite");
    let scene = opening(SampleSource::default(), Arc::new(volume), None);
    let scene = Scene { splat: SplatSettings::SHADE_FIRST, ..scene };
    drawer.keeps_cut = true;
    let (found, coarse) = drawn(&mut drawer, &scene, FRAME, Rung::Coarse { budget_ms: 2.0 });
    let (cut, _) = drawer.take_cut().expect("it was kept");
    assert!(cut.nodes.len() > 50 && cut.nodes.len() as u64 == coarse.nodes);
    let table =
        Table::new(scene.transfer().expect("a field"), volume_of(&scene).samples.scalar_type());
    let unit = scene.opacity_unit_distance();
    let depth = scene.lattice().axes().determinant().abs().cbrt() / unit;
    let measure = ErrorMeasure::Classified;
    let pyramid = Pyramid::build(volume_of(&scene), &table, depth, measure, &Ticket::new());
    let factor = pyramid.expect("not cancelled").thinning.factor(&cut.nodes);
    println!("measured {factor} of {} nodes", cut.nodes.len());
    assert!(factor < 0.97, "{factor}");
    let mut by_hand = |factor: f32| {
        let record =
            |n: &CutNode| Record::new(n.low, n.size, n.node.extinction * factor, n.node.colour);
        let records: Vec<Record> = cut.nodes.iter().map(record).collect();
        let view = View::new(&scene, coarse.size);
        drawer
            .engines
            .gpu()
            .expect("a device")
            .begin(&view, scene.splat.kernel, None, unit)
            .expect("begun");
        drawer.engines.gpu().expect("a device").draw_records(&records).expect("drawn");
        wide(&drawer.engines.gpu().expect("a device").read_light().expect("read"))
    };
    // A device that built its own octree rounded otherwise than the host's pyramid.
    let within = if voxsplat::gpu::has_hardware() { 1e-4 } else { 0.0 };
    let within = Within { max_abs: within, rmse: within, bias: within };
    assert_eq!(
        fault(&by_hand(factor), &found, within),
        None,
        "another picture than its cut, thinned"
    );
    assert!(fault(&by_hand(1.0), &found, within).is_some());
}

/// Of noise, more voxels can show than are classified at once before a quick picture.
const HEAVY: [usize; 3] = [104; 3];
const FRAME: [u32; 2] = [96, 80];

fn plan_of(scene: &Scene) -> Plan {
    Plan::of(scene, FRAME)
}

fn heavy(colour: Srgb8, opacity: f64) -> Scene {
    let scene = scene(Lattice::unit(HEAVY), DVec3::new(0.3, -0.5, 0.8));
    recoloured(&scene, colour, opacity)
}

fn recoloured(scene: &Scene, colour: Srgb8, opacity: f64) -> Scene {
    let transfer = TransferFunction::of(
        vec![(90.0, 0.0), (160.0, 0.1 * opacity), (255.0, opacity)],
        ColourSource::Stops(vec![(0.0, colour), (255.0, colour)]),
    );
    with_transfer(scene.clone(), transfer)
}

const RED: Srgb8 = Srgb8([255, 0, 0]);
const GREEN: Srgb8 = Srgb8([0, 255, 0]);

/// Coarse levels stand before a quick picture, and all of it comes piece by piece; another function drops what
/// was merged for the one before, and nothing is left on the device in the end.
#[test]
fn a_drag_is_seen_from_coarse_levels_and_pieces_follow_until_all_of_it_is_there() {
    let [Some(device), Some(host)] = [ON_DEVICE, ON_HOST].map(context) else { return };
    let [mut drawer, mut other] = [device, host].map(|c| Drawer::new(Renderer::new(c)));
    let first = heavy(RED, 0.7);
    let (ticket, budget_ms) = (Ticket::new(), 15.0);
    let plan = plan_of(&first);
    drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
    assert!(drawer.has_coarse_octree());
    assert_eq!(drawer.octree_builder(), Some(OctreeBuilder::Device));
    let uploads = drawer.engines.gpu().expect("a device").upload_count();
    assert!(!drawer.advance_octree().expect("a device"), "nobody began it");
    drawer.begin_octree(&plan).expect("begun");
    assert!(drawer.advance_octree().expect("a device"), "not all of it at once");

    let moved = recoloured(&first, GREEN, 0.02);
    let plan = plan_of(&moved);
    drawer.prepare_preview(&plan, budget_ms, &ticket).expect("prepared");
    assert!(!drawer.advance_octree().expect("a device"), "that of the function before");
    let coarse = drawer.draw(&plan, Rung::Coarse { budget_ms }, &mut ()).expect("drawn");
    assert!(coarse.nodes > 0 && coarse.max_error > 0.0);
    let seen = wide(&drawer.engines.gpu().expect("a device").read_light().expect("read"));
    assert!(seen.iter().all(|p| p[0] == 0.0) && seen.iter().any(|p| p[1] > 0.0));
    let held = drawer.engines.gpu().expect("a device").size_bytes();
    drawer.begin_octree(&plan).expect("begun");
    let mut pieces = 1;
    while drawer.advance_octree().expect("a device") {
        assert!(drawer.has_coarse_octree(), "the coarse one stays until then");
        pieces += 1;
    }
    assert!(pieces > 2, "{pieces} pieces");
    drawer.prepare(&plan, &ticket).expect("prepared");
    assert!(!drawer.has_coarse_octree());
    assert_eq!(drawer.octree_builder(), Some(OctreeBuilder::Device));
    assert_eq!(
        drawer.engines.gpu().expect("a device").upload_count(),
        uploads,
        "the samples were there"
    );

    other.prepare(&plan, &ticket).expect("prepared");
    assert_eq!(other.octree_builder(), Some(OctreeBuilder::Host));
    assert_eq!(drawer.active_count(), other.active_count());
    assert_eq!(drawer.engines.gpu().expect("a device").size_bytes(), held, "bricks are let go");
    let max_error = other.error_for_count(1000);
    let [a, b] =
        [&mut drawer, &mut other].map(|d| drawn(d, &moved, FRAME, Rung::Octree { max_error }));
    assert!(a.1.nodes.abs_diff(b.1.nodes) <= 2, "{} {}", a.1.nodes, b.1.nodes);
    let most = a.0.iter().zip(&b.0).flat_map(|(a, b)| (0..4).map(|c| (a[c] - b[c]).abs()));
    let most = most.fold(0.0, f64::max);
    println!("measured {pieces} pieces, {} nodes, {most:.1e} apart", a.1.nodes);
    // Rows are planned by counts of the slices: the same voxels, the same bits.
    let [a, b] = [&mut drawer, &mut other].map(|d| drawn(d, &moved, FRAME, Rung::Full));
    assert!(a.0 == b.0 && a.1.kernels == b.1.kernels);
    assert!(most < 2e-3, "{most}");
}

/// What the device does not build, the host does; and no scene that needs no octree pays for either.
#[test]
fn only_who_asks_for_an_octree_has_the_device_build_one() {
    let [Some(device), Some(host)] = [ON_DEVICE, ON_HOST].map(context) else { return };
    let mut drawers = [device, host].map(|c| Drawer::new(Renderer::new(c)));
    let base = scene(Lattice::unit([24; 3]), DVec3::new(0.3, -0.5, 0.8));
    let exact = plan_of(&Scene { splat: SplatSettings::EXACT, ..base.clone() });
    let ticket = Ticket::new();
    let seen = drawers.each_mut().map(|drawer| {
        drawer.prepare_preview(&exact, 15.0, &ticket).expect("prepared");
        drawer.draw(&exact, Rung::Full, &mut ()).expect("drawn");
        let light = drawer.engines.gpu().expect("a device").read_light().expect("read");
        (
            light,
            drawer.engines.gpu().expect("a device").size_bytes(),
            drawer.engines.gpu().expect("a device").pipeline_count(),
        )
    });
    assert!(seen[0] == seen[1]);
    let [device, _] = &mut drawers;
    let volume = volume_of(&base);
    assert!(
        !device
            .engines
            .made_gpu()
            .expect("a device")
            .builds_octree(volume, ErrorMeasure::OpticalDepth)
    );
    let mut deep = base.clone();
    deep.splat.cut.measure = ErrorMeasure::OpticalDepth;
    device.prepare(&plan_of(&deep), &ticket).expect("prepared");
    assert_eq!(device.octree_builder(), Some(OctreeBuilder::Host));
    // No level 3, and values that 32 bits have no room for.
    for (dims, samples, measure) in [
        ([1; 3], Samples::UInt8(vec![200]), ErrorMeasure::Classified),
        ([4, 3, 1], noise([4, 3, 1], 2), ErrorMeasure::Scalar),
        (
            [9; 3],
            Samples::Float64((0..729).map(|i| if i % 2 == 0 { 1e308 } else { -1e308 }).collect()),
            ErrorMeasure::Scalar,
        ),
    ] {
        let mut odd = with_field(base.clone(), unit_volume(dims, samples));
        odd.splat.cut.measure = measure;
        device.prepare(&plan_of(&odd), &ticket).expect("prepared");
        assert_eq!(device.octree_builder(), Some(OctreeBuilder::Host), "{dims:?}");
        assert!(device.active_count().is_some());
    }
    device.prepare(&plan_of(&base), &ticket).expect("prepared");
    assert_eq!(device.octree_builder(), Some(OctreeBuilder::Device));
}

fn unit_volume(dims: [usize; 3], samples: Samples) -> Arc<ScalarVolume> {
    volume(Lattice::unit(dims), samples)
}

/// The engine's thread merges a piece at least between two pictures of a drag, and ends in the picture that the host's
/// octree leads to.
#[test]
fn the_engine_draws_the_same_in_the_end_whoever_builds() {
    let [Some(device), Some(host)] = [ON_DEVICE, ON_HOST].map(Bench::with) else {
        return;
    };
    let base = heavy(RED, 0.4);
    let last = recoloured(&base, GREEN, 0.8);
    for bench in [&device, &host] {
        for step in 0..6 {
            let scene = recoloured(&base, RED, 0.1 + 0.1 * f64::from(step));
            bench.request(&scene, FRAME, Effort::Moving { budget_ms: 15.0 });
            std::thread::sleep(std::time::Duration::from_millis(40));
        }
        bench.request(&last, FRAME, rest());
    }
    let [a, b] = [&device, &host].map(|bench| bench.until_full(FRAME));
    let [a, b] = [&a[a.len() - 1], &b[b.len() - 1]];
    assert!(a.rgba == b.rgba && a.report.kernels == b.report.kernels);
    assert_eq!(
        [a, b].map(|picture| picture.report.octree),
        [Some(OctreeBuilder::Device), Some(OctreeBuilder::Host)]
    );
}
