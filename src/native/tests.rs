//! Against arithmetic done another way.

use std::sync::Arc;

use fearless_simd::{Level, prelude::*};
use glam::{DMat3, DVec3};

use super::composite::{Gathered, Rule};
use super::kernels::Kernels;
use super::landed::Landed;
use super::lanes::{Lanes, Mask, Vec3, all, dispatched};
use super::lattice::Lattice;
use super::masks::Masks;
use super::nodes::Nodes;
use super::own::Own;
use super::polygons::Polygons;
use super::rays::{Rays, TILE};
use super::table::Table;
use crate::cells::{CellField, Cells, On};
use crate::core::{Camera, Cancelled, Projection, Ticket};
use crate::kernel::{Bounds, Kernel, Separable, coefficients};
use crate::plan::{KernelSlabs, Plan, SlabField};
use crate::polygons::Mesh;
use crate::rbf::{Basis, Encoding, Function};
use crate::scene::{self, PolygonLayer, SampleSource, Scene, SplatSettings, VectorLayer};
use crate::transfer::{Cumulative, Weight};
use crate::volume::{Lattice as Grid, Places, Samples, ScalarVolume, Scattered, VectorField};

/// Values that differ everywhere, of odd dimensions.
fn volume(dims: [usize; 3]) -> Arc<ScalarVolume> {
    let count = dims.iter().product::<usize>();
    let value = |i: usize| ((i * 2_654_435_761) % 1009) as f32;
    let samples = Samples::Float32((0..count).map(value).collect());
    Arc::new(ScalarVolume::from_samples("noise", Grid::unit(dims), samples).expect("a volume"))
}

fn lattice(volume: &Arc<ScalarVolume>, kernel: Kernel) -> Lattice {
    lattice_of(volume, kernel, None)
}

pub(super) fn lattice_of(
    volume: &Arc<ScalarVolume>,
    kernel: Kernel,
    extent: Option<f64>,
) -> Lattice {
    lattice_for(volume, kernel, extent, false)
}

/// For quick pictures, or not.
fn lattice_for(
    volume: &Arc<ScalarVolume>,
    kernel: Kernel,
    extent: Option<f64>,
    is_quick: bool,
) -> Lattice {
    let ticket = Ticket::new();
    let mode = SplatSettings { kernel, extent, ..SplatSettings::EXACT };
    let made = coefficients(volume, kernel, extent, true, &ticket).expect("they fit");
    Lattice::new(volume, (&mode, is_quick), made, &ticket).expect("not cancelled")
}

/// Calls `visit` with places all over a volume's lattice, where each is in the world, its value less the lattice's bias, and
/// what that grows by.
fn each_place(
    volume: &ScalarVolume,
    lattice: &Lattice,
    mut visit: impl FnMut([f32; 3], DVec3, f32, DVec3),
) {
    // Eight at a time.
    let places: Vec<[f32; 3]> = places(lattice.dims).collect();
    for eight in places.chunks_exact(8) {
        let (values, growth) = asked(lattice, eight);
        for (i, place) in eight.iter().enumerate() {
            let world = volume.lattice.world_from_index(DVec3::from(place.map(f64::from)));
            visit(*place, world, values[i], DVec3::from(growth.map(|g| f64::from(g[i]))));
        }
    }
}

/// Places all over a lattice, its borders among them.
fn places(dims: [usize; 3]) -> impl Iterator<Item = [f32; 3]> {
    (0..4000_usize).map(move |i| {
        [0, 1, 2].map(|axis: usize| {
            let share = ((i * [7919, 104_729, 1_299_709][axis]) % 1000) as f32 / 999.0;
            share * dims[axis] as f32 - 0.5
        })
    })
}

#[test]
fn no_value_lies_beyond_the_bounds_of_its_brick() {
    for dims in [[1, 1, 1], [5, 1, 9], [7, 12, 10], [16, 17, 18]] {
        for (kernel, extent) in [
            (Kernel::Nearest, None),
            (Kernel::Linear, None),
            (Kernel::Linear, Some(0.5)),
            (Kernel::Linear, Some(1.7)),
            (Kernel::Cubic, None),
            (Kernel::BSpline, None),
            (Kernel::BSpline, Some(0.5)),
            (Kernel::BSpline, Some(1.3)),
            (Kernel::BSpline, Some(3.0)),
        ] {
            let lattice = lattice_of(&volume(dims), kernel, extent);
            let (level, method) = (Level::new(), lattice.method());
            let bricks = &lattice.bricks;
            for place in places(dims) {
                let found = dispatched!(level, simd => {
                    lattice.value(simd, method, Vec3::splat(simd, place))[0]
                });
                let [low, high] = range_about(bricks, place);
                let slack = 1e-3;
                assert!(
                    found >= low - slack && found <= high + slack,
                    "{kernel:?} {dims:?} {place:?}: {found} in {low}..{high}"
                );
            }
        }
    }
}

/// The values of a field at eight places, and what they grow by along x, y and z.
fn asked(lattice: &Lattice, eight: &[[f32; 3]]) -> ([f32; 8], [[f32; 8]; 3]) {
    let along = |axis: usize| std::array::from_fn::<f32, 8, _>(|i| eight[i][axis]);
    let [x, y, z] = [along(0), along(1), along(2)];
    let (level, method) = (Level::new(), lattice.method());
    dispatched!(level, simd => {
        let place = Vec3 {
            x: Lanes::load_array(simd, x),
            y: Lanes::load_array(simd, y),
            z: Lanes::load_array(simd, z),
        };
        let growth = lattice.gradient(simd, method, place);
        let growth = [growth.x, growth.y, growth.z].map(|g| g.to_array());
        (lattice.value(simd, method, place).to_array(), growth)
    })
}

/// Least and greatest value in the brick that a place lies in.
fn range_about(bricks: &Bounds, place: [f32; 3]) -> [f32; 2] {
    let at = place.map(|x| ((x + 1.0) / 4.0) as usize);
    bricks.ranges[(at[2] * bricks.dims[1] + at[1]) * bricks.dims[0] + at[0]]
}

/// Noise, with functions that have nothing to do with it.
pub(super) fn volume_of_functions(dims: [usize; 3], basis: Basis) -> Arc<ScalarVolume> {
    let noise = volume(dims);
    let lattice = Grid {
        spacing: DVec3::new(1.0, 0.7, 1.3),
        origin: DVec3::new(-3.0, 2.0, 5.0),
        ..noise.lattice
    };
    let any = |i: usize| ((i * 40_503 + 17) % 1009) as f64 / 1009.0;
    let function = |i: usize| {
        let share = DVec3::new(any(8 * i), any(8 * i + 1), any(8 * i + 2));
        let at = share * DVec3::from(dims.map(|n| n as f64));
        let width = 0.5 + 3.0 * any(8 * i + 3);
        let skew = if basis == Basis::Ellipsoid { any(8 * i + 4) } else { 0.0 };
        let x = DVec3::new(1.0, 0.0, 0.0);
        let y = DVec3::new(skew, 1.0 + skew, 0.0);
        let z = DVec3::new(-skew, 0.5 * skew, 1.0);
        let shape = DMat3::from_cols(x, y, z) * (1.0 / width);
        let weight = 2.0 * any(8 * i + 5) - 0.6;
        Function { centre: lattice.world_from_index(at), shape, weight }
    };
    let bounds = [lattice.origin - 9.0, lattice.origin + 60.0];
    let encoding = Encoding::new(basis, -0.4, 0.01, (0..50).map(function), bounds);
    let functions = Some(Arc::new(encoding));
    Arc::new(ScalarVolume { lattice, functions, ..(*noise).clone() })
}

#[test]
fn sums_of_functions_and_their_growth_are_those_of_float64_and_lie_in_their_bounds() {
    for dims in [[1, 1, 1], [5, 1, 9], [16, 37, 18]] {
        for basis in Basis::ALL {
            let volume = volume_of_functions(dims, basis);
            let encoding = volume.functions.as_ref().expect("it has some");
            let lattice = lattice(&volume, Kernel::Functions);
            let bricks = &lattice.bricks;
            let (mut worst, mut steepest) = (0.0_f64, 0.0_f64);
            each_place(&volume, &lattice, |place, world, value, growth| {
                let found = f64::from(value) + lattice.bias;
                worst = worst.max((found - encoding.value(world)).abs());
                let expected = volume.lattice.axes().transpose() * encoding.gradient(world);
                steepest = steepest.max((growth - expected).length());
                let [low, high] = range_about(bricks, place);
                assert!((low..=high).contains(&value), "{basis:?} {dims:?} {place:?}");
            });
            // Sums of up to 40 in 32 bits: measured 1.2e-5 and 2.4e-6.
            assert!(worst < 3e-5 && steepest < 1e-4, "{basis:?} {dims:?}: {worst} {steepest}");
        }
    }
}

#[test]
fn what_sums_lose_of_large_opposite_weights_is_within_what_is_told_of_them() {
    let dims = [16, 37, 18];
    for basis in Basis::ALL {
        let plain = volume_of_functions(dims, basis);
        let own = plain.functions.as_ref().expect("it has some");
        let ends = [[-0.5; 3], dims.map(|n| n as f64 - 0.5)];
        let bounds = ends.map(|end| plain.lattice.world_from_index(DVec3::from(end)));
        let pair = |i: usize| {
            let place = DVec3::new(3.3, 7.1, 4.7) + DVec3::new(2.1, 5.3, 2.3) * i as f64;
            let centre = plain.lattice.world_from_index(place);
            let shape = DMat3::from_diagonal(DVec3::splat(0.5));
            let one = |offset: f64, weight: f64| Function {
                centre: centre + DVec3::X * offset,
                shape,
                weight,
            };
            [one(0.0, 1e6), one(1e-6, -1e6)]
        };
        for pairs in [0, 5] {
            let functions = own.functions().iter().copied().chain((0..pairs).flat_map(pair));
            let encoding = Encoding::new(basis, own.bias(), 0.01, functions, bounds);
            let (told, functions) = (encoding.rounding(), Some(Arc::new(encoding.clone())));
            let volume = Arc::new(ScalarVolume { functions, ..(*plain).clone() });
            let lattice = lattice(&volume, Kernel::Functions);
            let mut worst = 0.0_f64;
            each_place(&volume, &lattice, |_, world, value, _| {
                worst = worst.max((f64::from(value) + lattice.bias - encoding.value(world)).abs());
            });
            println!("measured {basis:?} {pairs}: {worst:.1e}, told {told:.1e}");
            assert!(worst <= told, "{basis:?} {pairs}: {worst} {told}");
            // It is no idle warning: of their difference, some tenths, much is wrong.
            assert_eq!(worst > 0.03, pairs > 0, "{basis:?} {pairs}: {worst}");
        }
    }
}

#[test]
fn means_of_ellipsoids_and_their_growth_are_those_of_float64_and_lie_in_their_bounds() {
    let dims = [16, 37, 18];
    let noise = volume(dims);
    // Not in a lattice, whose points would lie on lines.
    let any = |i: usize| {
        let mixed = (i as u32 + 17).wrapping_mul(0x9e37_79b1);
        let mixed = (mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca77);
        f64::from(mixed ^ mixed >> 13) / f64::from(u32::MAX)
    };
    let last = DVec3::from(dims.map(|n| n as f64 - 1.0));
    let sample = |i: usize| {
        // In two corners, so that some of it is near none.
        let share = 0.45 * DVec3::new(any(3 * i), any(3 * i + 1), any(3 * i + 2));
        let share = if i.is_multiple_of(2) { share } else { 1.0 - share };
        (noise.lattice.world_from_index(share * last), 500.0 + 100.0 * any(7 * i))
    };
    let scattered = Scattered::new((0..120).map(sample).collect());
    let scattered = scattered.map(Arc::new);
    let volume = Arc::new(ScalarVolume { scattered, ..(*noise).clone() });
    let scattered = volume.scattered.as_ref().expect("it has some");
    let encoding = scattered.ellipsoids(&Ticket::new()).expect("not cancelled");
    let lattice = lattice(&volume, Kernel::Ellipsoids);
    let (mut inside, mut outside) = (0, 0);
    let (mut worst, mut steepest) = (0.0_f64, 0.0_f64);
    each_place(&volume, &lattice, |place, world, value, growth| {
        let expected = encoding.value(world);
        let is_there = value > super::lattice::NOTHING;
        let is_at_border = (encoding.coverage(world) - 1.0).abs() < 1e-4;
        assert!(is_at_border || is_there != expected.is_nan(), "{place:?}");
        if !is_there || is_at_border {
            outside += 1;
            return;
        }
        inside += 1;
        worst = worst.max((f64::from(value) + lattice.bias - expected).abs());
        let expected = volume.lattice.axes().transpose() * encoding.gradient(world);
        steepest = steepest.max((growth - expected).length());
        let [low, high] = range_about(&lattice.bricks, place);
        assert!((low..=high).contains(&value), "{place:?}");
    });
    assert!(inside > 300 && outside > 300, "{inside} {outside}");
    println!("measured {worst} {steepest}");
    // Of values of 500 to 600.
    assert!(worst < 1e-3 && steepest < 1e-2, "{worst} {steepest}");
}

/// Hexahedra about most of a lattice, bent, with values of their own; the middle one is not there.
pub(super) fn volume_of_cells(dims: [usize; 3], on: On, spacing: DVec3) -> Arc<ScalarVolume> {
    let noise = volume(dims);
    let lattice = Grid { spacing, origin: DVec3::new(-3.0, 2.0, 5.0), ..noise.lattice };
    let any = |i: usize| ((i * 40_503 + 17) % 1009) as f64 / 1009.0;
    let sides = [4, 4, 4];
    let last = DVec3::from(dims.map(|n| n as f64 - 1.0));
    let place = |i: usize| {
        let at = DVec3::from([i % 4, i / 4 % 4, i / 16].map(|n| n as f64));
        let shaken = DVec3::new(any(3 * i), any(3 * i + 1), any(3 * i + 2)) - 0.5;
        lattice.world_from_index((at + 0.5 * shaken) / 3.0 * last)
    };
    let points: Arc<[DVec3]> = (0..64).map(place).collect();
    let cells = Arc::new(Cells::of_grid(&points, sides));
    let count = if on == On::Points { 64 } else { 27 };
    let mut values: Vec<f64> = (0..count).map(|i| 100.0 * any(7 * i)).collect();
    if on == On::Cells {
        values[13] = f64::NAN;
    }
    let cells = Some(Arc::new(CellField::new(cells, on, values)));
    Arc::new(ScalarVolume { lattice, cells, ..(*noise).clone() })
}

#[test]
fn values_of_cells_and_their_growth_are_those_of_float64_and_lie_in_their_bounds() {
    for on in [On::Points, On::Cells] {
        let dims = [16, 21, 18];
        let volume = volume_of_cells(dims, on, DVec3::new(1.0, 0.7, 1.3));
        let field = volume.cells.as_ref().expect("it has some");
        let lattice = lattice(&volume, Kernel::Cells);
        let bricks = &lattice.bricks;
        let growths = field.growths(&Ticket::new()).expect("not cancelled");
        let (mut inside, mut near_faces) = (0, 0);
        let (mut worst, mut steepest) = (0.0_f64, 0.0_f64);
        each_place(&volume, &lattice, |place, world, value, growth| {
            let cells = field.cells();
            let holds = |solid: &usize| {
                let unit = cells.placed(*solid).unit_from(world);
                field.is_there(*solid) && unit.is_some()
            };
            let solid = (0..27).find(holds);
            let is_there = value > super::lattice::NOTHING;
            let Some(solid) = solid.filter(|_| is_there) else {
                // Single precision tells sides of faces apart where nobody sees it.
                near_faces += usize::from(solid.is_some() != is_there);
                return;
            };
            inside += 1;
            let unit = cells.placed(solid).unit_from(world).expect("it holds it");
            let found = f64::from(value) + lattice.bias;
            let off = (found - field.value(solid, unit)).abs();
            let weights = cells.solids()[solid].kind().weights(unit);
            let corners = cells.solids()[solid].corners().iter().zip(weights);
            let world: DVec3 = corners.map(|(c, w)| growths[*c as usize] * w).sum();
            let expected = volume.lattice.axes().transpose() * world;
            // At the face of two cells values of cells jump, and either is right.
            if on == On::Points || off < 1e-3 {
                worst = worst.max(off);
                steepest = steepest.max((growth - expected).length());
            } else {
                near_faces += 1;
            }
            let [low, high] = range_about(bricks, place);
            assert!((low..=high).contains(&value), "{on:?} {place:?}");
        });
        assert!(inside > 1500 && near_faces < 4, "{on:?}: {inside} {near_faces}");
        // Of 100, in 32 bits.
        assert!(worst < 5e-3 && steepest < 5e-3, "{on:?}: {worst} {steepest}");
    }
}

#[test]
fn light_has_the_border_of_cells_as_float64_has_it() {
    let volume = volume_of_cells([16, 21, 18], On::Points, DVec3::splat(0.7));
    let field = volume.cells.as_ref().expect("it has some");
    let lattice = lattice(&volume, Kernel::Cells);
    let Some(Own::Cells(own)) = &lattice.own else { panic!("cells") };
    let lit = field.shading_normals(&Ticket::new()).expect("not cancelled");
    let strength = lit.normals().iter().map(|normal| normal.growth.length()).fold(0.0, f64::max);
    let (mut several, mut worst, mut count) = (0, 0.0_f64, 0);
    for i in 0..20_000_u32 {
        let part = |k: u32| f64::from(i.wrapping_mul(k) % 9973) / 9973.0;
        let place = DVec3::new(part(389) * 15.0, part(211) * 20.0, part(677) * 17.0);
        let world = volume.lattice.world_from_index(place);
        let holds = |solid: &usize| {
            field.is_there(*solid) && field.cells().placed(*solid).unit_from(world).is_some()
        };
        let Some(solid) = (0..27).find(holds) else { continue };
        let unit = field.cells().placed(solid).unit_from(world).expect("it holds it");
        let at = (solid, &field.cells().solids()[solid]);
        let direction = DVec3::new(part(131) - 0.5, part(523) - 0.5, part(811) - 0.5);
        let axes = volume.lattice.axes();
        let along = axes * direction;
        let growth = |by: DVec3| lit.growth(at, unit + by, (world + axes * by, along));
        let expected = axes.transpose() * growth(DVec3::ZERO);
        let found = dispatched!(Level::new(), simd => {
            let [x, y, z] = place.as_vec3().to_array();
            let of = (Vec3::splat(simd, [x, y, z]), Mask::splat(simd, true));
            let direction = Vec3::splat(simd, direction.as_vec3().to_array());
            own.here(simd, of, (own.growths(true), direction)).growth.expect("asked for").lane(3)
        });
        let off = (DVec3::from(found.map(f64::from)) - expected).length();
        // Where two cells meet, where a ray has passed two outer faces at once, and where the border is turned across what
        // grows, single precision may choose the other.
        let beside = (0..6).map(|i| {
            let mut by = DVec3::ZERO;
            by[i / 2] = if i % 2 == 0 { 1e-3 } else { -1e-3 };
            growth(by)
        });
        if at.1.kind().beyond(unit) > -1e-3
            || beside.into_iter().any(|b| (b - growth(DVec3::ZERO)).length() > 0.1 * strength)
        {
            continue;
        }
        count += 1;
        several += usize::from(lit.faces_of(solid).len() > 1);
        worst = worst.max(off / strength);
    }
    assert!(count > 5000 && several > 1000, "{count} {several}");
    assert!(worst < 1e-3, "{worst}");
}

/// Of another than the natural width: coefficients weighed by h((x − i)/s) / Σ h((x − i)/s), axis by axis.
#[test]
fn narrow_splines_and_tents_of_any_width_are_weighed_as_they_are_defined() {
    for dims in [[9, 8, 11], [1, 7, 2]] {
        let volume = volume(dims);
        for (kernel, extent) in [
            (Kernel::Linear, 0.5),
            (Kernel::Linear, 0.7),
            (Kernel::Linear, 1.5),
            (Kernel::Linear, 2.0),
            (Kernel::BSpline, 0.5),
            (Kernel::BSpline, 0.9),
            (Kernel::BSpline, 1.6),
        ] {
            let lattice = lattice_of(&volume, kernel, Some(extent));
            let natural = coefficients(&volume, kernel, None, true, &Ticket::new()).expect("made");
            let weights = Separable::new(kernel, Some(extent)).expect("a product");
            let (level, method) = (Level::new(), lattice.method());
            let mut squares = 0.0;
            for place in places(dims).step_by(5) {
                let found = dispatched!(level, simd => {
                    lattice.value(simd, method, Vec3::splat(simd, place))[3]
                });
                let of = place.map(|x| weights.weights(f64::from(x)));
                let mut expected = 0.0;
                let index = |i: i64, n: usize| {
                    let period = 2 * (n as i64 - 1).max(1);
                    let i = i.rem_euclid(period);
                    if n == 1 { 0 } else { i.min(period - i) as usize }
                };
                for (z, wz) in (of[2].0..).zip(&of[2].1) {
                    for (y, wy) in (of[1].0..).zip(&of[1].1) {
                        for (x, wx) in (of[0].0..).zip(&of[0].1) {
                            let row = index(z, dims[2]) * dims[1] + index(y, dims[1]);
                            let value = natural.values[row * dims[0] + index(x, dims[0])];
                            expected += wx * wy * wz * f64::from(value);
                        }
                    }
                }
                squares += (f64::from(found) - expected).powi(2);
            }
            // Of values up to 1009; where narrow kernels hardly meet, places in single precision decide.
            let rms = (squares / 800.0).sqrt();
            assert!(rms < 0.2, "{kernel:?} {extent}: {rms}");
        }
    }
}

#[test]
fn gradients_are_differences_of_values() {
    let dims = [9, 8, 11];
    for (kernel, extent, is_quick) in [
        (Kernel::Linear, None, false),
        (Kernel::Linear, None, true),
        (Kernel::Linear, Some(1.5), false),
        (Kernel::BSpline, None, false),
        (Kernel::BSpline, Some(1.6), false),
        (Kernel::BSpline, Some(3.0), false),
    ] {
        let lattice = lattice_for(&volume(dims), kernel, extent, is_quick);
        let (level, method) = (Level::new(), lattice.method());
        let is_smooth = kernel == Kernel::BSpline && extent.is_none_or(|extent| extent >= 2.0);
        // Derivatives, of tents within their cell.
        let step = if is_smooth || is_quick { 1.0 / 64.0 } else { 0.5 };
        let is_inner = |x: f32| (0.05..0.95).contains(&x.fract()) || !is_quick;
        let is_asked = |x: f32| x > 1.0 && x < 6.0 && is_inner(x);
        for place in places(dims).filter(|p| p.iter().all(|x| is_asked(*x))).take(300) {
            let value = |offset: [f32; 3]| {
                let at = [0, 1, 2].map(|a| place[a] + offset[a]);
                dispatched!(level, simd => lattice.value(simd, method, Vec3::splat(simd, at))[5])
            };
            let found = dispatched!(level, simd => {
                lattice.gradient(simd, method, Vec3::splat(simd, place)).lane(5)
            });
            for axis in 0..3 {
                let mut offset = [0.0; 3];
                offset[axis] = step;
                let growth = (value(offset) - value(offset.map(|x| -x))) / (2.0 * step);
                let off = (found[axis] - growth).abs();
                assert!(
                    off < 0.02 * growth.abs().max(50.0),
                    "{kernel:?} {place:?}: {found:?} {growth}"
                );
            }
        }
    }
}

/// A scene of a ball in a field that falls off around it, less than half of which shows.
pub(super) fn scene() -> Scene {
    let dims = [21, 18, 25];
    let value = |i: usize| {
        let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
        let off = [0, 1, 2].map(|a| at[a] as f32 - (dims[a] as f32 - 1.0) / 2.0);
        1000.0 - 80.0 * off.iter().map(|x| x * x).sum::<f32>().sqrt()
    };
    let samples = Samples::Float32((0..dims.iter().product()).map(value).collect());
    let volume = ScalarVolume::from_samples("ball", Grid::unit(dims), samples).expect("a volume");
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    scene.transfer_mut().expect("a field").opacity = vec![(400.0, 0.0), (500.0, 0.7)];
    scene.splat = SplatSettings::EXACT;
    scene.camera =
        Camera::new(scene.lattice().centre(), DVec3::new(0.5, 0.7, -0.4), DVec3::Z, 14.0);
    scene
}

/// Wherever the field shows anything on a ray, its tile's mask has that slab.
#[test]
fn masks_leave_out_nothing_that_shows_and_much_that_does_not() {
    for angle in [None, Some(0.9)] {
        let mut scene = scene();
        if let Some(view_angle) = angle {
            scene.camera.projection = Projection::Perspective { view_angle };
        }
        let plan = Plan::of(&scene, [53, 47]);
        let field = plan.field().expect("a field");
        let lattice = lattice(&field.volume, Kernel::BSpline);
        let statistics = &field.volume.statistics;
        let scalar_type = field.volume.samples.scalar_type();
        let of = Cumulative::new(&field.transfer, scalar_type, statistics, Weight::Extinction);
        let table = Table::new(&lattice, &of, &[], &Ticket::new()).expect("not cancelled");
        let rays = Rays::new(&plan, lattice.dims.map(|n| n as f64 - 0.5), &[]);
        let masks =
            Masks::new(&rays, &lattice.bricks, (lattice.dims, &table.visible), &Ticket::new())
                .expect("not cancelled");
        let (mut shown, mut looked, mut all_of_them) = (0, 0, 0);
        for y in (0..47).step_by(2) {
            for x in (0..53).step_by(4) {
                let (level, method) = (Level::new(), lattice.method());
                dispatched!(level, simd => {
                    let packet = rays.packet(simd, [x, y], [0.5; 2]);
                    if !packet.is_there.any_true() {
                        return;
                    }
                    let [first, last] = packet.slabs(simd, rays.step);
                    let runs: Vec<[i32; 2]> = masks.runs([x, y], [first, last]).collect();
                    let tile = [x, y].map(|n| n / TILE * TILE);
                    assert!(masks.shows(tile) || runs.is_empty(), "pixel {x} {y}: its tile");
                    for slab in first..=last {
                        let has = runs.iter().any(|run| (run[0]..=run[1]).contains(&slab));
                        all_of_them += 1;
                        looked += usize::from(has);
                        let middle = all(simd, (slab as f32 + 0.5) * rays.step);
                        let middle = middle.max(packet.enter).min(packet.leave);
                        let cell = table.cell(simd, lattice.value(simd, method, packet.at(middle)));
                        let look = table.look(simd, cell);
                        for lane in 0..8 {
                            let shows = packet.is_there.test(lane) && look.weight[lane] > 0.0;
                            shown += usize::from(shows);
                            assert!(has || !shows, "pixel {x} {y}, slab {slab}");
                        }
                    }
                });
            }
        }
        assert!(shown > 500, "{shown}");
        assert!(looked < all_of_them * 9 / 10, "{looked} of {all_of_them}");
    }
}

/// From within, bricks about the eye are everywhere on the picture.
#[test]
fn masks_about_the_eye_leave_out_nothing_that_shows() {
    let mut scene = scene();
    scene.camera.projection = Projection::Perspective { view_angle: 1.6 };
    scene.camera.parallel_scale = 2.0;
    let plan = Plan::of(&scene, [24, 20]);
    let field = plan.field().expect("a field");
    let lattice = lattice(&field.volume, Kernel::BSpline);
    let bricks: Vec<u32> = (0..lattice.bricks.ranges.len() as u32).collect();
    let rays = Rays::new(&plan, lattice.dims.map(|n| n as f64 - 0.5), &[]);
    let masks = Masks::new(&rays, &lattice.bricks, (lattice.dims, &bricks), &Ticket::new());
    let masks = masks.expect("not cancelled");
    for y in (0..20).step_by(2) {
        for x in (0..24).step_by(4) {
            dispatched!(Level::new(), simd => {
                let packet = rays.packet(simd, [x, y], [0.5; 2]);
                let slabs = packet.slabs(simd, rays.step);
                let runs: Vec<[i32; 2]> = masks.runs([x, y], slabs).collect();
                assert_eq!(runs, [slabs], "pixel {x} {y}");
            });
        }
    }
}

/// Opacities over 1 are lowered to it, and counted: of eight rays at once, and of one.
#[test]
fn opacities_over_one_are_lowered_and_counted() {
    let rule = Rule { middle: false, published: true, back_to_front: false, stop_below: 0.0 };
    dispatched!(Level::new(), simd => {
        let some = Mask::splat(simd, true);
        let mut light = Gathered::none(simd, some, false);
        let amounts = Lanes::from_fn(simd, |i| if i < 3 { 1.5 } else { 0.25 });
        let red = Vec3::splat(simd, [1.0, 0.0, 0.0]);
        assert_eq!(rule.cover_with(simd, red, amounts, &mut light), 3);
        let weight = light.light(simd).weight;
        assert_eq!([weight[0], weight[7]], [1.0, 0.25]);
        assert_eq!(rule.cover_ray(7, ([0.0, 1.0, 0.0], 2.0), &mut light), 1);
        assert_eq!(rule.cover_ray(6, ([0.0, 1.0, 0.0], 1.0), &mut light), 0);
        let seen = light.light(simd);
        assert_eq!((seen.weight[7], seen.colour.lane(7)), (1.0, [0.25, 0.75, 0.0]));
        let rule = Rule { published: false, ..rule };
        assert_eq!(rule.cover_ray(5, ([0.0; 3], 2.0), &mut light), 0, "depths may be any");
    });
}

/// Vectors about the middle of the scene, to all sides.
pub(super) fn winds() -> VectorLayer {
    let vectors = (0..6 * 6 * 6_u32).map(|i| {
        let angle = 0.7 * i as f32;
        glam::Vec3::new(angle.cos(), angle.sin(), 0.3) * (1 + i % 5) as f32
    });
    let lattice = Grid { spacing: DVec3::splat(4.0), ..Grid::unit([6; 3]) };
    let (places, ticket) = (Places::Lattice(lattice), Ticket::new());
    let field = VectorField::new("winds", places, vectors.collect(), &ticket).expect("a field");
    VectorLayer::new(Arc::new(field))
}

/// A translucent triangle across the scene.
pub(super) fn shard() -> PolygonLayer {
    let corners = vec![
        glam::Vec3::new(-3.0, 2.0, 4.0),
        glam::Vec3::new(25.0, 5.0, 9.0),
        glam::Vec3::new(9.0, 20.0, 22.0),
    ];
    let mesh = Mesh::new("shard", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]);
    let mut layer = PolygonLayer::new(Arc::new(mesh.expect("a mesh")));
    layer.look.opacity = 0.5;
    layer
}

/// An engine with a plan's field, and the kernels of its first list.
pub(super) fn of_field(plan: &Plan, threads: usize) -> (super::Renderer, KernelSlabs) {
    let field = plan.field().expect("a field");
    let splats = plan.kernels[0].classification.levels(&Ticket::new()).expect("not cancelled");
    let slabs = KernelSlabs {
        splats: vec![Arc::clone(&splats[0])],
        thickness: super::slab_thickness(plan),
        field_slabs: 1,
    };
    let mut renderer = super::Renderer::with_threads(threads);
    let made = coefficients(&field.volume, Kernel::BSpline, None, true, &Ticket::new());
    let (volume, made, ticket) = (&field.volume, made.expect("they fit"), Ticket::new());
    let which = SlabField::Own;
    let stored = super::Stored::new(which, volume, &plan.mode, made, &ticket);
    renderer.set_field(which, stored.expect("not cancelled"));
    let (scalar_type, weight) = (volume.samples.scalar_type(), Weight::Extinction);
    let of = Cumulative::new(&field.transfer, scalar_type, &volume.statistics, weight);
    renderer.set_table(which, &of, &[], &ticket).expect("not cancelled");
    (renderer, slabs)
}

/// Each room that lists asks the ticket itself: told to stop before it begins, none makes anything.
#[test]
fn a_cancelled_ticket_begins_no_picture_and_leaves_the_engine_well() {
    let plan = Plan::of(&scene().with(winds()).with(shard()), [61, 45]);
    let (mut renderer, slabs) = of_field(&plan, 2);
    let cancelled = Ticket::new();
    cancelled.cancel();
    let mut draw = |ticket: &Ticket| {
        renderer.begin(&plan, SlabField::Own, Some(&slabs), 5e-4, ticket)?;
        renderer.draw_tiles(0..super::tile_count(plan.size), f64::INFINITY, ticket)?;
        Ok(renderer.light())
    };
    let first = draw(&Ticket::new());
    assert!(first.as_ref().is_ok_and(|(light, _)| light.iter().any(|pixel| pixel[3] > 0.1)));
    assert_eq!(draw(&cancelled), Err(super::NotBegun::Cancelled(Cancelled)));
    assert_eq!(draw(&Ticket::new()), first);

    let rays = Rays::new(&plan, [0.0; 3], &[]);
    let field = plan.field().expect("a field");
    let looks = Kernels::new(&plan, &slabs, &[], &cancelled);
    assert_eq!(looks.err(), Some(Cancelled));
    assert_eq!(Polygons::renew(&mut None, &plan, &cancelled).err(), Some(Cancelled));
    let lattice = lattice(&field.volume, plan.mode.kernel);
    let masks = Masks::new(&rays, &lattice.bricks, (lattice.dims, &[0]), &cancelled);
    assert_eq!(masks, Err(Cancelled));
    let node = super::Node { low: [0; 3], size: [1; 3], extinction: 1.0, colour: [1.0; 3] };
    let nodes = Nodes::new(&plan, &[node], &cancelled).err();
    assert_eq!(nodes, Some(super::NotBegun::Cancelled(Cancelled)));
}

/// A ray that asks a hundred thousand cells takes as long as a picture should. Pictures of few pixels have few lists.
#[test]
fn what_lies_on_each_other_by_the_thousands_is_refused_before_it_is_listed() {
    let landed = |count: usize, size: [u32; 2]| {
        let rays = Rays::new(&Plan::of(&scene(), size), [0.0; 3], &[]);
        let everywhere = Some([DVec3::ZERO, DVec3::splat(1e6)]);
        Landed::new((&vec![everywhere; count], "cells"), (&rays, None), &Ticket::new())
    };
    let refused = landed(70_000, [160, 120]).expect_err("too many");
    assert_eq!(refused.to_string(), "cells that lie on each other, 70000 before a pixel");
    assert!(landed(70_000, [24, 16]).is_ok());
    let few = landed(60, [160, 120]).expect("few");
    assert_eq!(few.on([159, 119]).len(), 60);
}

/// Of thousands of triangles the near ones are looked at first, and nothing more where they hide the rest: that leaves out what nobody
/// sees, and nothing else.
#[test]
fn what_is_hidden_is_left_out_of_many_triangles_and_nothing_else() {
    let share = |i: usize, by: f64| (i as f64 * by).fract();
    let corner = |i: usize| {
        let at = [0.754_877_7, 0.569_840_3, 0.323_45].map(|by| 28.0 * share(i / 3 + 1, by));
        let beside = [0.819_17, 0.247_1, 0.618_03].map(|by| 5.0 * share(i + 1, by));
        DVec3::new(at[0] + beside[0], at[1] + beside[1], at[2] + beside[2]).as_vec3()
    };
    let count = 4000_u32;
    let corners = (0..3 * count as usize).map(corner).collect();
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::new("shards", corners, Vec::new(), Vec::new(), triangles).expect("a mesh");
    let mut cluttered = scene().with(PolygonLayer::new(Arc::new(mesh)));
    let seen = |scene: &Scene| {
        let (mut polygons, plan) = (None, Plan::of(scene, [61, 45]));
        Polygons::renew(&mut polygons, &plan, &Ticket::new()).expect("not cancelled");
        let polygons = polygons.expect("some");
        let tiles = (0..6).flat_map(|y| (0..8).map(move |x| [8 * x, 8 * y]));
        let pixels = tiles.flat_map(|tile| {
            let found = polygons.seen_in(tile);
            (0..64).map(move |pixel| found.as_ref().map_or(Vec::new(), |f| f.of(pixel).to_vec()))
        });
        pixels.collect::<Vec<_>>()
    };
    let hidden_left_out = seen(&cluttered);
    // What is cut away hides nothing, so that all of them are there.
    cluttered.inside.clip.bounds =
        Some(scene::ClipBox { high: [1.0, 1.0, 0.999], ..scene::ClipBox::WHOLE });
    let all = seen(&cluttered);
    let mut left_out = 0;
    for (all, found) in all.into_iter().zip(hidden_left_out) {
        let mut covered = 0_u8;
        let mut visible = all.clone();
        visible.retain(|fragment| {
            let is_seen = fragment.samples & !covered != 0;
            covered |= fragment.samples;
            is_seen
        });
        left_out += all.len() - visible.len();
        assert_eq!(found, visible);
    }
    assert!(left_out > 10_000, "{left_out}");
}

#[test]
fn the_nearest_opaque_triangle_is_seen_in_whatever_order_they_come() {
    let towards = -scene().camera.direction;
    let layer = |nearer: f64| {
        let shift = (towards * nearer).as_vec3();
        let corners = [[-3.0, 2.0, 4.0], [25.0, 5.0, 9.0], [9.0, 20.0, 22.0]];
        let corners = corners.map(|corner| glam::Vec3::from(corner) + shift).to_vec();
        let mesh = Mesh::new("shard", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]);
        PolygonLayer::new(Arc::new(mesh.expect("a mesh")))
    };
    let seen = |layers: &[f64]| {
        let scene = layers.iter().fold(scene(), |scene, nearer| scene.with(layer(*nearer)));
        let (mut polygons, plan) = (None, Plan::of(&scene, [61, 45]));
        Polygons::renew(&mut polygons, &plan, &Ticket::new()).expect("not cancelled");
        let polygons = polygons.expect("some");
        let tiles = (0..6).flat_map(|y| (0..8).map(move |x| [8 * x, 8 * y]));
        let nearest = tiles.flat_map(|corner| {
            let found = polygons.seen_in(corner);
            (0..64).map(move |pixel| found.as_ref()?.of(pixel).first().map(|first| first.t))
        });
        nearest.collect::<Vec<Option<f32>>>()
    };
    let (near, both) = (seen(&[3.0]), seen(&[0.0, 3.0]));
    assert_eq!(both, seen(&[3.0, 0.0]));
    let hidden = near.iter().zip(&both).filter(|(near, both)| near.is_some() && near == both);
    assert!(hidden.count() > 100 && both != seen(&[0.0]));
}
