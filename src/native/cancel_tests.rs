//! Every phase of a picture looks at its ticket between pieces of a millisecond or two, and ends where that says so.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::kernels::Kernels;
use super::masks::Masks;
use super::nodes::{Node, Nodes};
use super::polygons::Polygons;
use super::rays::Rays;
use super::samples::samples_bytes;
use super::seen;
use super::solids::Solids;
use super::sums::Asked;
use super::table::Table;
use super::tests::{lattice_of, of_field, scene, winds};
use super::{Renderer, Stored, functions::Functions, tile_count};
use crate::cells::{CellField, Cells, On};
use crate::core::{Camera, Cancelled, Ticket, assert_stops};
use crate::kernel::{BOUND_BRICK, Bounds, Kernel, coefficients};
use crate::plan::{KernelSlabs, Plan, SlabField};
use crate::polygons::Mesh;
use crate::rbf::{Basis, Encoding, Function, Limits};
use crate::scene::{
    self, Lighting, PolygonLayer, SampleSource, Scene, Shading, SplatSettings, VectorLayer,
};
use crate::transfer::{Cumulative, Weight};
use crate::vector::{Design, Marks};
use crate::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

/// Samples along an axis.
const SIDE: usize = 96;
/// Of what is drawn in the place of samples.
const FEWER: usize = 48;

/// A ball that falls off from its middle; a smaller one in it may have no data.
fn ball(side: usize, hollow: bool) -> Arc<ScalarVolume> {
    let value = |i: usize| {
        let at = [i % side, i / side % side, i / (side * side)];
        let off = at.map(|n| 2.0 * n as f32 / side as f32 - 1.0);
        let from_middle = off.iter().map(|x| x * x).sum::<f32>().sqrt();
        if hollow && from_middle < 0.2 { f32::NAN } else { 1000.0 - 600.0 * from_middle }
    };
    let samples = Samples::Float32((0..side.pow(3)).map(value).collect());
    let volume = ScalarVolume::from_samples("ball", Lattice::unit([side; 3]), samples);
    Arc::new(volume.expect("a volume"))
}

fn scene_of(volume: &Arc<ScalarVolume>) -> Scene {
    let mut scene = scene::opening(SampleSource::default(), Arc::clone(volume), None);
    scene.transfer_mut().expect("a field").opacity = vec![(400.0, 0.0), (500.0, 0.7)];
    scene.splat = SplatSettings::EXACT;
    let half = 0.9 * volume.lattice.dims[0] as f64;
    let direction = DVec3::new(0.5, 0.7, -0.4);
    scene.camera = Camera::new(scene.lattice().centre(), direction, DVec3::Z, half);
    scene
}

fn table_of(volume: &ScalarVolume, plan: &Plan) -> Cumulative {
    let transfer = &plan.field().expect("a field").transfer;
    let scalar_type = volume.samples.scalar_type();
    Cumulative::new(transfer, scalar_type, &volume.statistics, Weight::Extinction)
}

/// Bounds of a lattice of so many samples a side, to be set.
fn unbounded(side: usize) -> Bounds {
    let dims = [(side + 1).div_ceil(BOUND_BRICK); 3];
    Bounds { dims, ranges: vec![[0.0; 2]; dims.iter().product()] }
}

#[test]
fn a_field_is_stored_plane_by_plane_and_bounded_in_three_passes() {
    let volume = ball(SIDE, false);
    let bricks = (SIDE + 1).div_ceil(BOUND_BRICK);
    for kernel in [Kernel::Linear, Kernel::BSpline] {
        let mode = SplatSettings { kernel, ..SplatSettings::EXACT };
        let made = coefficients(&volume, kernel, None, true, &Ticket::new()).expect("they fit");
        assert_stops(&format!("storing, {kernel:?}"), SIDE + 2 * SIDE + bricks, |ticket| {
            Stored::new(SlabField::Own, &volume, &mode, made.clone(), ticket)
        });
    }
}

#[test]
fn a_table_looks_for_what_shows_some_bricks_at_a_time_holes_among_them() {
    let volume = ball(SIDE, true);
    let plan = Plan::of(&scene_of(&volume), [32; 2]);
    let mut of = table_of(&volume, &plan);
    let bricks = unbounded(SIDE).ranges.len();
    for (no_data, least) in [(0.0, bricks >> 12), (0.5, (bricks >> 12) + (bricks >> 11))] {
        of.no_data = [no_data; 4];
        assert_stops("a table", least, |ticket| {
            // A new one each time: where there are no data is found once.
            let lattice = lattice_of(&volume, Kernel::Linear, None);
            Table::new(&lattice, &of, &[700.0], ticket)
        });
    }
}

/// A plan whose samples are shaded first, by a light.
fn lit_samples(volume: &Arc<ScalarVolume>) -> Plan {
    let mut scene = scene_of(volume);
    scene.splat = SplatSettings::SHADE_FIRST;
    scene.shading = Shading { lighting: Some(Lighting::default()), ..Shading::default() };
    Plan::of(&scene, [48; 2])
}

#[test]
fn samples_are_shaded_some_bricks_at_a_time() {
    let volume = ball(SIDE, false);
    let plan = lit_samples(&volume);
    // Most bricks of 8³ samples show; each of two threads has sixteen between two looks.
    let least = (SIDE / 8).pow(3) / 2 / 32;
    assert_stops("samples", least, |ticket| Renderer::with_threads(2).make_samples(&plan, ticket));
    assert_stops("what samples take", 1, |ticket| samples_bytes(&plan, ticket));
}

#[test]
fn samples_that_were_left_off_go_on_where_they_were() {
    let volume = ball(SIDE / 2, false);
    let plan = lit_samples(&volume);
    let drawn = |mut renderer: Renderer| {
        let (which, ticket) = (SlabField::Own, Ticket::new());
        renderer.begin(&plan, which, None, 5e-4, &ticket).expect("it is drawn");
        let tiles = 0..tile_count(plan.size);
        renderer.draw_tiles(tiles, f64::INFINITY, &ticket).expect("not cancelled");
        renderer.light().0
    };
    let mut at_once = Renderer::with_threads(2);
    assert_eq!(at_once.make_samples(&plan, &Ticket::new()), Ok(()));
    let mut left_off = Renderer::with_threads(2);
    assert_eq!(left_off.make_samples(&plan, &Ticket::tripping_at(4)), Err(Cancelled));
    assert!(left_off.begun_samples(&plan) && !left_off.holds_samples(&plan));
    let rest = Ticket::new();
    assert_eq!(left_off.make_samples(&plan, &rest), Ok(()));
    assert!(left_off.holds_samples(&plan) && rest.asked() > 0);
    let again = Ticket::new();
    assert_eq!((left_off.make_samples(&plan, &again), again.asked()), (Ok(()), 0));
    let expected = drawn(at_once);
    assert!(expected.iter().any(|pixel| pixel[3] > 0.5));
    assert!(drawn(left_off) == expected);
}

#[test]
fn masks_of_depth_are_of_one_brick_after_the_other() {
    let volume = ball(SIDE, false);
    let plan = Plan::of(&scene_of(&volume), [640, 480]);
    let lattice = lattice_of(&volume, Kernel::Linear, None);
    let of = table_of(&volume, &plan);
    let table = Table::new(&lattice, &of, &[], &Ticket::new()).expect("not cancelled");
    let rays = Rays::new(&plan, lattice.dims.map(|n| n as f64 - 0.5), &[]);
    let shown = table.visible.len();
    assert!(shown > 5000, "{shown}");
    // Each is placed, and put into bands, of which there are four a thread.
    assert_stops("masks", shown + 8 * (shown >> 8), |ticket| {
        Masks::new(&rays, &lattice.bricks, (lattice.dims, &table.visible), ticket)
    });
}

/// Many vectors about a volume.
fn many_winds(side: usize, spacing: f64) -> VectorLayer {
    let vectors = (0..side.pow(3)).map(|i| {
        let angle = 0.7 * (i % 997) as f32;
        glam::Vec3::new(angle.cos(), angle.sin(), 0.3) * (1 + i % 5) as f32
    });
    let lattice = Lattice { spacing: DVec3::splat(spacing), ..Lattice::unit([side; 3]) };
    let (places, ticket) = (Places::Lattice(lattice), Ticket::new());
    let field = VectorField::new("winds", places, vectors.collect(), &ticket).expect("a field");
    VectorLayer::new(Arc::new(field))
}

#[test]
fn lists_of_kernels_are_placed_sorted_and_taken_some_at_a_time() {
    let volume = ball(FEWER, false);
    let side = 40;
    let winds = many_winds(side, (FEWER - 1) as f64 / (side - 1) as f64);
    let plan = Plan::of(&scene_of(&volume).with(winds), [320, 240]);
    let levels = plan.kernels[0].classification.levels(&Ticket::new()).expect("not cancelled");
    let count = levels[0].list.len();
    assert!(count > side.pow(3) / 4, "{count}");
    let slabs = KernelSlabs {
        splats: vec![Arc::clone(&levels[0])],
        thickness: super::slab_thickness(&plan),
        field_slabs: 1,
    };
    // The table of marks, which is made once a process, is looked at by itself.
    Marks::new(Design::default());
    // Five passes in their order, after they were placed.
    assert_stops("kernels", (count >> 13) + 5 * (count >> 14), |ticket| {
        Kernels::new(&plan, &slabs, &[], ticket)
    });
    let mut scene = scene_of(&volume);
    scene.splat = SplatSettings::SHADE_FIRST;
    let plan = Plan::of(&scene, [320, 240]);
    let node = |i: usize| {
        let low = [i % FEWER, i / FEWER % FEWER, i / (FEWER * FEWER)].map(|n| n as u32);
        Node { low, size: [1; 3], extinction: 0.5, colour: [1.0; 3] }
    };
    let nodes: Vec<Node> = (0..FEWER.pow(3)).map(node).collect();
    let least = (nodes.len() >> 13) + 3 * (nodes.len() >> 14);
    assert_stops("nodes", least, |ticket| Nodes::new(&plan, &nodes, ticket));
}

#[test]
fn polygons_are_placed_bounded_and_taken_some_at_a_time() {
    let volume = ball(FEWER, false);
    let side = 200_usize;
    let corner = |i: usize| {
        let [x, y] = [i % side, i / side].map(|n| (n * FEWER) as f32 / side as f32);
        glam::Vec3::new(x, y, 20.0 + (0.3 * x).sin())
    };
    let triangles = (0..side * side).filter(|i| i % side < side - 1 && i / side < side - 1);
    let triangles = triangles.flat_map(|i| {
        let [a, b, c, d] = [i, i + 1, i + side, i + side + 1].map(|i| i as u32);
        [[a, b, c], [b, d, c]]
    });
    let triangles: Vec<[u32; 3]> = triangles.collect();
    let count = triangles.len();
    let corners = (0..side * side).map(corner).collect();
    let mesh = Mesh::new("sheet", corners, Vec::new(), Vec::new(), triangles).expect("a mesh");
    let layer = PolygonLayer::new(Arc::new(mesh));
    let plan = Plan::of(&scene_of(&volume).with(layer), [320, 240]);
    assert_stops("polygons", 2 * (count >> 12), |ticket| Polygons::renew(&mut None, &plan, ticket));
    // A view that something newer takes over leaves what lies in the world.
    let mut polygons = None;
    Polygons::renew(&mut polygons, &plan, &Ticket::new()).expect("not cancelled");
    let mut turned = plan.clone();
    turned.camera = turned.camera.orbited(0.3, 0.1);
    let cancelled = Ticket::new();
    cancelled.cancel();
    assert!(Polygons::renew(&mut polygons, &turned, &cancelled).is_err());
    assert!(polygons.is_some());
}

/// Hexahedra all over a lattice of so many samples a side, and numbers on their points.
fn field_of_cells(lattice: &Lattice, sides: usize) -> Arc<CellField> {
    let last = lattice.dims[0] as f64 - 1.0;
    let place = |i: usize| {
        let at = [i % sides, i / sides % sides, i / (sides * sides)].map(|n| n as f64);
        lattice.world_from_index(DVec3::from(at) / (sides - 1) as f64 * last)
    };
    let points: Arc<[DVec3]> = (0..sides.pow(3)).map(place).collect();
    let cells = Arc::new(Cells::of_grid(&points, [sides; 3]));
    let values = (0..points.len()).map(|i| (i % 977) as f64).collect();
    Arc::new(CellField::new(cells, On::Points, values))
}

#[test]
fn cells_are_made_bounded_landed_and_lit_some_at_a_time() {
    let volume = ball(FEWER, false);
    let lattice = &volume.lattice;
    let field = field_of_cells(lattice, 41);
    let (count, points) = (field.cells().solids().len(), field.cells().points().len());
    // Which are there, and what they are; and what lists and the surface take (see there).
    let least = (count >> 14) + (count >> 11) + 160;
    assert_stops("cells", least, |ticket| Solids::new(&field, lattice, 0.0, ticket));
    let solids = Solids::new(&field, lattice, 0.0, &Ticket::new()).expect("not cancelled");
    assert_stops("bounds of cells", (32 * count) >> 16, |ticket| {
        solids.bound(&mut unbounded(FEWER), 0.0, ticket)
    });
    let plan = Plan::of(&scene_of(&volume), [640, 480]);
    let rays = Rays::new(&plan, lattice.dims.map(|n| n as f64 - 0.5), &[]);
    // They are projected, placed, and counted and listed in eight bands.
    let least = (points >> 14) + (count >> 14) + (count >> 12) + 16 * ((count / 2) >> 6);
    assert_stops("cells that land", least, |ticket| {
        solids.land((&rays, Asked::of(plan.mode.classify)), ticket)
    });
    // Volumes, weights and growths of cells; numbers per index; and the surface, where light falls on it.
    let growths = 3 * (count >> 12) - 1 + (points >> 14);
    for (for_light, least) in [(false, growths), (true, growths + 40)] {
        assert_stops(&format!("growths for light: {for_light}"), least, |ticket| {
            // New ones each time: growths are found once.
            let field = field_of_cells(lattice, 41);
            let solids = Solids::new(&field, lattice, 0.0, &Ticket::new())?;
            solids.make_growths(for_light, ticket)
        });
    }
}

#[test]
fn functions_are_made_summed_up_bounded_and_landed_some_at_a_time() {
    let volume = ball(FEWER, false);
    let lattice = &volume.lattice;
    let any = |i: usize| ((i * 40_503 + 17) % 1009) as f64 / 1009.0;
    let function = |i: usize| Function {
        centre: DVec3::new(any(3 * i), any(3 * i + 1), any(7 * i + 2)) * (FEWER - 1) as f64,
        shape: DMat3::from_diagonal(DVec3::splat(1.5)),
        weight: 0.5 + any(5 * i),
    };
    let count = 30_000;
    let bounds = [DVec3::splat(-3.0), DVec3::splat(FEWER as f64 + 3.0)];
    let functions = (0..count).map(function);
    let encoding = Encoding::new(Basis::Gaussian, 0.0, 0.05, functions, bounds);
    // Lists of them take more (see there).
    let least = (3 * 16 * count) >> 14;
    assert_stops("functions", least, |ticket| {
        Functions::new(&encoding, &Limits::NONE, lattice, ticket)
    });
    let functions =
        Functions::new(&encoding, &Limits::NONE, lattice, &Ticket::new()).expect("not cancelled");
    let rows = FEWER * FEWER;
    assert_stops("sums at samples", rows, |ticket| functions.at_samples(ticket));
    let bricks = unbounded(FEWER).ranges.len();
    assert_stops("bounds of sums", bricks, |ticket| functions.bound(&mut unbounded(FEWER), ticket));
    let plan = Plan::of(&scene_of(&volume), [320, 240]);
    let rays = Rays::new(&plan, lattice.dims.map(|n| n as f64 - 0.5), &[]);
    let least = (count >> 13) + (count >> 12) + 16 * ((count / 2) >> 6);
    assert_stops("functions that land", least, |ticket| seen::landed(&functions, &rays, ticket));
}

/// Each thread is at a tile of its own.
#[test]
fn no_tile_is_begun_once_a_ticket_says_so() {
    let plan = Plan::of(&scene().with(winds()), [240, 200]);
    let tiles = tile_count(plan.size);
    assert_stops("tiles", tiles as usize, |ticket| {
        let (mut renderer, slabs) = of_field(&plan, 2);
        renderer.begin(&plan, SlabField::Own, Some(&slabs), 5e-4, &Ticket::new())?;
        renderer.draw_tiles(0..tiles, f64::INFINITY, ticket)?;
        Ok::<(), super::NotBegun>(())
    });
}
