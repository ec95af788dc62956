//! The pyramid and its cuts, against sums over every voxel.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::hierarchy::{Cut, CutLimits, CutNode, Node, Pyramid, Visibility, VisitOrder};
use voxsplat::transfer::{ColourMap, ColourSource, Table, TransferFunction};
use voxsplat::volume::{Lattice, Samples, ScalarVolume};

const DIMS: [[usize; 3]; 5] = [[16, 16, 16], [19, 9, 10], [1, 1, 7], [1, 1, 1], [33, 2, 5]];

/// Uniform in 0..1 by index (SplitMix64, seed 3).
fn random(index: usize) -> f64 {
    let mut z = (3_u64 << 32 ^ index as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A transfer function over offset..offset + 1: clear below 0.4.
fn transfer(offset: f64) -> TransferFunction {
    TransferFunction {
        opacity: vec![(offset + 0.4, 0.0), (offset + 1.0, 0.95)],
        colour: ColourSource::Stops(vec![
            (offset + 0.4, Srgb8([250, 20, 10])),
            (offset + 1.0, Srgb8([20, 90, 255])),
        ]),
    }
}

struct Built {
    volume: Arc<ScalarVolume>,
    table: Table,
    pyramid: Pyramid,
}

fn built(dims: [usize; 3], samples: Samples, transfer: &TransferFunction) -> Built {
    let volume = ScalarVolume::from_samples("test", Lattice::unit(dims), samples).expect("sound");
    let table = Table::new(transfer, volume.samples.scalar_type());
    let pyramid = Pyramid::build(&volume, &table, 1.0, &Ticket::new()).expect("not cancelled");
    Built { volume: Arc::new(volume), table, pyramid }
}

/// Smooth with noise, so that errors differ from node to node.
fn values(dims: [usize; 3]) -> Vec<f64> {
    (0..dims.iter().product())
        .map(|i| {
            let z = (i / (dims[0] * dims[1])) as f64;
            0.5 + 0.4 * (z * 0.4).sin() * ((i % dims[0]) as f64 * 0.3).cos() + 0.1 * random(i)
        })
        .collect()
}

fn mixed(dims: [usize; 3]) -> Built {
    built(dims, Samples::Float64(values(dims)), &transfer(0.0))
}

impl Built {
    /// Linear colour and extinction of a voxel.
    fn voxel(&self, at: [usize; 3]) -> [f64; 4] {
        let [x, y, _] = self.volume.lattice.dims;
        self.table.lookup(self.volume.samples.get((at[2] * y + at[1]) * x + at[0])).map(f64::from)
    }

    fn cut(&self, limits: CutLimits, order: VisitOrder) -> Vec<CutNode> {
        // All of it in view.
        let visibility = Visibility {
            view_from_index: DMat3::IDENTITY,
            view_origin: DVec3::ZERO,
            half_size: DVec2::splat(1e6),
            eye_distance: None,
            kernel_radius: 1.5,
        };
        Cut::of(&self.pyramid, limits, order, &visibility, |index| {
            self.table.lookup(self.volume.samples.get(index))
        })
        .nodes
    }
}

fn limits(max_error: f32, finest_level: usize) -> CutLimits {
    CutLimits { max_error, finest_level, min_radius_px: 0.0 }
}

/// Every voxel of a box.
fn voxels(low: [usize; 3], size: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let count = size.iter().product();
    (0..count).map(move |i| {
        [low[0] + i % size[0], low[1] + i / size[0] % size[1], low[2] + i / (size[0] * size[1])]
    })
}

/// Extinction-weighted mean colour and rms deviation of a box, in float64, in two passes.
fn brute_force(built: &Built, low: [usize; 3], size: [usize; 3]) -> ([f64; 3], f64) {
    let all: Vec<[f64; 4]> = voxels(low, size).map(|at| built.voxel(at)).collect();
    let weight: f64 = all.iter().map(|v| v[3]).sum();
    let colour =
        std::array::from_fn(|c| all.iter().map(|v| v[3] * v[c]).sum::<f64>() / weight.max(1e-300));
    let seen: Vec<[f64; 4]> = all
        .iter()
        .map(|&[r, g, b, extinction]| {
            let alpha = -(-extinction).exp_m1();
            [alpha, alpha * r, alpha * g, alpha * b]
        })
        .collect();
    let n = seen.len() as f64;
    let deviation: f64 = (0..4)
        .map(|c| {
            let mean = seen.iter().map(|v| v[c]).sum::<f64>() / n;
            seen.iter().map(|v| (v[c] - mean).powi(2)).sum::<f64>()
        })
        .sum();
    (colour, (deviation / n).sqrt())
}

/// Each node of each level with its box of real voxels.
fn nodes(pyramid: &Pyramid) -> Vec<(usize, [usize; 3], [usize; 3], Node)> {
    let mut all = Vec::new();
    for (i, level) in pyramid.levels.iter().enumerate() {
        let edge = 2 << i;
        for (at, &node) in voxels([0; 3], level.dims).zip(&level.nodes) {
            let low = at.map(|n| n * edge);
            let size = std::array::from_fn(|a| edge.min(pyramid.dims[a] - low[a]));
            all.push((i + 1, low, size, node));
        }
    }
    all
}

#[test]
fn nodes_are_the_means_and_deviations_of_their_real_voxels() {
    for dims in DIMS {
        let built = mixed(dims);
        let mut greatest = vec![0.0_f64; built.pyramid.height() + 1];
        let mut checked = 0;
        for (level, low, size, node) in nodes(&built.pyramid) {
            let (colour, rms) = brute_force(&built, low, size);
            if !node.is_active() {
                assert!(voxels(low, size).all(|at| built.voxel(at)[3] == 0.0), "{dims:?} {low:?}");
                continue;
            }
            for (found, expected) in node.colour.iter().zip(colour) {
                let found = f64::from(*found) / 65535.0;
                assert!((found - expected).abs() < 2e-5, "{dims:?} {low:?}: {found} {expected}");
            }
            // An error counts by its node's edge, and is never less than a child's.
            let own = rms * f64::from(1_u32 << (level - 1));
            assert!(f64::from(node.error) > own - 1e-5 * own.max(1.0), "{dims:?} {low:?}");
            if level == 1 {
                assert!((f64::from(node.error) - rms).abs() < 1e-5, "{dims:?} {low:?}");
            }
            greatest[level] = greatest[level].max(own);
            assert!(
                f64::from(node.error)
                    <= greatest.iter().copied().fold(0.0, f64::max) * 1.0001 + 1e-6
            );
            checked += 1;
        }
        assert!(checked > 0, "{dims:?}");
    }
}

/// −ln⟨exp(−column depth)⟩ / size, averaged over the axes.
#[test]
fn whole_nodes_of_level_1_keep_the_mean_transmittance_of_their_columns() {
    let built = mixed([16, 16, 16]);
    for (_, low, _, node) in nodes(&built.pyramid).into_iter().filter(|n| n.0 == 1) {
        let mut mean = 0.0;
        for axis in 0..3 {
            let columns = voxels(low, [2; 3]).filter(|at| at[axis] == low[axis]).map(|near| {
                let mut far = near;
                far[axis] += 1;
                (-built.voxel(near)[3] - built.voxel(far)[3]).exp()
            });
            mean -= (columns.sum::<f64>() / 4.0).ln() / 2.0 / 3.0;
        }
        assert!((f64::from(node.extinction) - mean).abs() < 1e-5 * mean.max(0.1), "{low:?}");
    }
}

#[test]
fn large_values_of_small_spread_give_the_same_pyramid() {
    let dims = [19, 9, 10];
    let near = mixed(dims);
    let far = values(dims).into_iter().map(|v| v + 1e6).collect();
    let far = built(dims, Samples::Float64(far), &transfer(1e6));
    assert_eq!(near.pyramid.active, far.pyramid.active);
    for (a, b) in nodes(&near.pyramid).into_iter().zip(nodes(&far.pyramid)) {
        let (a, b) = (a.3, b.3);
        assert!((a.extinction - b.extinction).abs() < 1e-4, "{a:?} {b:?}");
        assert!((a.error - b.error).abs() < 1e-3 * a.error.max(0.1), "{a:?} {b:?}");
    }
}

/// A phantom voxel beyond an odd border would be transparent, and thin its node out.
#[test]
fn a_constant_volume_is_constant_at_every_level_whatever_its_size() {
    for dims in DIMS {
        let count = dims.iter().product();
        let built = built(dims, Samples::UInt8(vec![1; count]), &transfer(0.0));
        let voxel = built.voxel([0; 3]);
        for (level, low, _, node) in nodes(&built.pyramid) {
            assert_eq!(f64::from(node.extinction), voxel[3], "{dims:?} level {level} {low:?}");
            assert!(node.error < 1e-6, "{dims:?} level {level} {low:?}: {}", node.error);
            for (found, expected) in node.colour.iter().zip(voxel) {
                assert!((f64::from(*found) / 65535.0 - expected).abs() < 1e-5);
            }
        }
        assert_eq!(built.pyramid.active.total, count as u64);
    }
}

#[test]
fn one_bright_voxel_among_nothing_is_in_every_cut() {
    let dims = [33, 17, 20];
    let count = dims.iter().product();
    for bright in [0, count - 1, (7 * 17 + 5) * 33 + 31] {
        let mut samples = vec![0; count];
        samples[bright] = 255_u8;
        let mut transfer = transfer(0.0);
        transfer.opacity = vec![(100.0, 0.0), (255.0, 0.9)];
        let built = built(dims, Samples::UInt8(samples), &transfer);
        assert_eq!(built.pyramid.active.total, 1);
        let at = [bright % 33, bright / 33 % 17, bright / (33 * 17)];
        for level in 0..=built.pyramid.height() {
            let cut = built.cut(limits(0.0, level), VisitOrder::Along(DVec3::Z));
            assert_eq!(cut.len(), 1, "level {level}");
            assert!(holds(&cut[0], at) && cut[0].node.extinction > 0.0, "level {level}");
        }
        let coarsest = built.cut(limits(1e9, 0), VisitOrder::Along(DVec3::Z));
        assert_eq!((coarsest.len(), coarsest[0].size), (1, [33, 17, 20]));
    }
}

#[test]
fn nothing_opaque_has_no_node_and_everything_opaque_has_every_voxel() {
    let dims = [19, 9, 10];
    let count = 19 * 9 * 10;
    let clear = built(dims, Samples::UInt8(vec![0; count]), &transfer(0.0));
    assert_eq!(clear.cut(limits(0.0, 0), VisitOrder::Along(DVec3::Z)), []);
    assert_eq!((clear.pyramid.active.total, clear.pyramid.error_for_count(100)), (0, 0.0));
    let opaque = TransferFunction {
        opacity: vec![(0.0, 1.0)],
        colour: ColourSource::Map { map: ColourMap::Gray, range: [0.0, 1.0] },
    };
    let full = built(dims, Samples::Float64(values(dims)), &opaque);
    assert_eq!(full.cut(limits(0.0, 0), VisitOrder::Along(DVec3::Z)).len(), count);
    assert!(nodes(&full.pyramid).iter().all(|n| n.3.extinction.is_finite()));
}

/// The transmittance of a large opaque node is below the least number there is.
#[test]
fn large_nodes_of_nearly_equal_opaque_voxels_stay_as_opaque_as_those() {
    let dims = [64, 64, 64];
    let opaque = TransferFunction { opacity: vec![(0.0, 0.99), (1.0, 1.0)], ..transfer(0.0) };
    let samples = (0..64 * 64 * 64).map(random).collect();
    let built = built(dims, Samples::Float64(samples), &opaque);
    for (level, low, _, node) in nodes(&built.pyramid) {
        let [least, most] = [0.01_f32, 1e-4].map(|transmittance| -transmittance.ln());
        let kept = node.extinction >= least * 0.999 && node.extinction <= most * 1.001;
        assert!(kept, "level {level} {low:?}: {}", node.extinction);
    }
}

fn holds(node: &CutNode, at: [usize; 3]) -> bool {
    (0..3).all(|a| (node.low[a]..node.low[a] + node.size[a]).contains(&(at[a] as u32)))
}

/// Orders that look along and across every axis, from outside and within.
fn orders() -> Vec<VisitOrder> {
    vec![
        VisitOrder::Along(DVec3::new(0.2, -0.9, 0.4)),
        VisitOrder::Along(DVec3::new(-0.8, 0.1, -0.6)),
        VisitOrder::Along(DVec3::Z),
        VisitOrder::From(DVec3::new(-30.0, 4.0, 8.0)),
        VisitOrder::From(DVec3::new(9.3, 4.2, 5.1)),
        // In the box of voxel 8, and so beyond the first split, which lies at 7.5.
        VisitOrder::From(DVec3::new(7.7, 4.2, 5.1)),
    ]
}

#[test]
fn every_cut_covers_each_active_voxel_once_and_no_parent_with_its_child() {
    for dims in DIMS {
        let built = mixed(dims);
        for order in orders() {
            for limits in [
                limits(0.0, 0),
                limits(0.05, 0),
                limits(0.3, 0),
                limits(1e9, 0),
                limits(0.0, 2),
                limits(0.2, 1),
                CutLimits { min_radius_px: 2.0, ..limits(0.0, 0) },
            ] {
                let cut = built.cut(limits, order);
                for at in voxels([0; 3], dims) {
                    let covering = cut.iter().filter(|n| holds(n, at)).count();
                    let active = built.voxel(at)[3] > 0.0;
                    assert!(
                        covering == 1 || (covering == 0 && !active),
                        "{dims:?} {limits:?} {at:?}"
                    );
                }
                if limits.max_error == 0.0
                    && limits.finest_level + limits.min_radius_px as usize == 0
                {
                    assert_eq!(cut.len() as u64, built.pyramid.active.total);
                }
            }
        }
    }
}

/// Whether `a` must be drawn before `b`: they overlap across one axis and `a` is farther along it.
fn must_precede(a: &CutNode, b: &CutNode, order: VisitOrder) -> bool {
    let span = |n: &CutNode, axis: usize| (n.low[axis], n.low[axis] + n.size[axis]);
    (0..3).any(|axis| {
        let overlap = (0..3).filter(|&other| other != axis).all(|other| {
            let ((a0, a1), (b0, b1)) = (span(a, other), span(b, other));
            a0 < b1 && b0 < a1
        });
        let ((a0, a1), (b0, b1)) = (span(a, axis), span(b, axis));
        let farther = match order {
            VisitOrder::Along(direction) if direction[axis] > 0.0 => a0 >= b1,
            VisitOrder::Along(direction) if direction[axis] < 0.0 => a1 <= b0,
            VisitOrder::Along(_) => false,
            // Box faces lie half a voxel below the index.
            VisitOrder::From(eye) => {
                let eye = eye[axis] + 0.5;
                (a0 >= b1 && f64::from(b1) > eye) || (a1 <= b0 && f64::from(b0) < eye)
            }
        };
        overlap && farther
    })
}

#[test]
fn cuts_are_drawn_far_before_near() {
    let built = mixed([19, 9, 10]);
    let mut pairs = 0;
    for order in orders() {
        for limits in [limits(0.3, 0), limits(0.6, 0), limits(0.0, 1), limits(0.0, 2)] {
            let cut = built.cut(limits, order);
            for (i, early) in cut.iter().enumerate() {
                for late in &cut[i + 1..] {
                    assert!(
                        !must_precede(late, early, order),
                        "{order:?}: {late:?} after {early:?}"
                    );
                    pairs += usize::from(must_precede(early, late, order));
                }
            }
        }
    }
    assert!(pairs > 1000, "{pairs} pairs with an order");
}

#[test]
fn the_error_for_a_count_falls_with_it_and_its_cut_is_near_it() {
    let built = mixed([32, 30, 28]);
    let active = built.pyramid.active.total;
    let mut last = f32::INFINITY;
    for count in [1, 2, 5, 20, 100, 400, 1000, 3000, active - 1, active, 2 * active] {
        let error = built.pyramid.error_for_count(count);
        assert!(error <= last, "{count}: {error} after {last}");
        last = error;
        let nodes = |e: f32| built.cut(limits(e, 0), VisitOrder::Along(DVec3::Z)).len() as u64;
        assert!(nodes(error) <= count, "{count}: {}", nodes(error));
        if error > 0.0 {
            // Errors are kept in bins of 1.1 %: a little less error would not have fitted.
            assert!(nodes(error * 0.985) > count, "{count}: {} at less", nodes(error * 0.985));
        }
    }
    assert_eq!(last, 0.0);
}

/// −ln⟨exp(−column depth)⟩ / depth of the columns, at every level and for thin voxels.
#[test]
fn whole_nodes_of_every_level_keep_the_mean_transmittance_of_their_children() {
    const VOXEL_DEPTH: f64 = 0.37;
    let Built { volume, table, .. } = mixed([16, 16, 16]);
    let pyramid = Pyramid::build(&volume, &table, VOXEL_DEPTH, &Ticket::new()).expect("built");
    let built = Built { volume, table, pyramid };
    for (level, low, size, node) in nodes(&built.pyramid) {
        let edge = size[0] / 2;
        let child = |at: [usize; 3]| match level {
            1 => built.voxel(at)[3],
            _ => {
                let fine = &built.pyramid.levels[level - 2];
                let [x, y, z] = at.map(|n| n / edge);
                f64::from(fine.nodes[(z * fine.dims[1] + y) * fine.dims[0] + x].extinction)
            }
        };
        let thickness = edge as f64 * VOXEL_DEPTH;
        let mut mean = 0.0;
        for axis in 0..3 {
            let columns = voxels([0; 3], [2; 3]).filter(|bits| bits[axis] == 0).map(|bits| {
                let near: [usize; 3] = std::array::from_fn(|a| low[a] + bits[a] * edge);
                let mut far = near;
                far[axis] += edge;
                (-(child(near) + child(far)) * thickness).exp()
            });
            mean -= (columns.sum::<f64>() / 4.0).ln() / (2.0 * thickness) / 3.0;
        }
        // Measured: 2e-7.
        let difference = (f64::from(node.extinction) - mean).abs();
        assert!(difference < 1e-5 * mean.max(0.1), "level {level} {low:?}: {difference:e}");
        if level == 1 {
            let seen: Vec<[f64; 4]> = voxels(low, size)
                .map(|at| {
                    let [r, g, b, extinction] = built.voxel(at);
                    let alpha = -(-extinction * VOXEL_DEPTH).exp_m1();
                    [alpha, alpha * r, alpha * g, alpha * b]
                })
                .collect();
            let squares: f64 = (0..4)
                .map(|c| {
                    let mean = seen.iter().map(|v| v[c]).sum::<f64>() / 8.0;
                    seen.iter().map(|v| (v[c] - mean).powi(2)).sum::<f64>()
                })
                .sum();
            let rms = (squares / 8.0).sqrt();
            assert!((f64::from(node.error) - rms).abs() < 1e-5, "{low:?}: {} {rms}", node.error);
        }
    }
}

/// One noisy corner in a flat volume: the deviation of its parents is less than its own.
#[test]
fn no_nodes_error_is_less_than_a_childs() {
    let dims = [32; 3];
    let samples = (0..32_usize.pow(3))
        .map(|i| if i % 32 > 29 && i / 32 % 32 > 29 && i / 1024 > 29 { random(i) } else { 0.0 })
        .collect();
    let built = built(dims, Samples::Float64(samples), &transfer(0.0));
    let corner: Vec<f32> =
        built.pyramid.levels.iter().map(|l| l.nodes[l.nodes.len() - 1].error).collect();
    assert!(corner[0] > 0.1, "{corner:?}");
    assert!(corner.windows(2).all(|w| w[0] <= w[1]), "{corner:?}");
}

/// Border nodes of bricks that cannot show count the voxels that exist.
#[test]
fn clear_borders_of_odd_sizes_weigh_as_many_voxels_as_they_have() {
    let dims = [9, 8, 8];
    let samples = (0..9 * 64).map(|i| if i % 9 == 8 { 0.0 } else { 0.8 }).collect();
    let built = built(dims, Samples::Float64(samples), &transfer(0.0));
    let root = built.pyramid.levels[3].nodes[0];
    let (_, rms) = brute_force(&built, [0; 3], dims);
    // Measured: 1e-7; eight for one would give 1.5 times as much.
    assert!((f64::from(root.error) - rms * 8.0).abs() < 1e-5, "{} {}", root.error, rms * 8.0);
}

/// Siblings are drawn in two layers across the axis along which the view runs most.
#[test]
fn the_far_half_along_the_main_axis_is_drawn_before_the_near_half() {
    let built = built([16; 3], Samples::Float64(vec![0.8; 4096]), &transfer(0.0));
    for (direction, axis) in
        [(DVec3::new(0.9, 0.2, -0.4), 0), (DVec3::new(0.2, -0.9, 0.4), 1), (DVec3::Z, 2)]
    {
        let cut = built.cut(limits(0.0, 3), VisitOrder::Along(direction));
        let far = if direction[axis] > 0.0 { 8 } else { 0 };
        let lows: Vec<u32> = cut.iter().map(|node| node.low[axis]).collect();
        assert_eq!((lows.len(), &lows[..4]), (8, &[far; 4][..]), "{direction}: {lows:?}");
    }
}

#[test]
fn flat_regions_are_drawn_voxel_by_voxel_where_no_error_is_allowed() {
    let built = built([8; 3], Samples::Float64(vec![0.8; 512]), &transfer(0.0));
    let along = VisitOrder::Along(DVec3::Z);
    assert_eq!(built.cut(limits(0.0, 0), along).len(), 512);
    assert_eq!(built.cut(limits(1e-3, 0), along).len(), 1);
    // Kernels of nodes of 2 voxels have a radius of 3 pixels here, their children's of 1.5.
    let by_radius = |min_radius_px| built.cut(CutLimits { min_radius_px, ..limits(0.0, 0) }, along);
    assert_eq!((by_radius(1.4).len(), by_radius(1.6).len()), (512, 64));
}

/// Every voxel of which some direction's rim lands on the picture is drawn; what lies far beside
/// it or behind the eye is not.
#[test]
fn a_cut_leaves_out_only_what_cannot_be_seen() {
    let dims = [32; 3];
    let built = built(dims, Samples::Float64(vec![0.8; 32 * 32 * 32]), &transfer(0.0));
    let kernel_radius = 1.5;
    let turn = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.3);
    let rims: Vec<DVec3> = (0..64)
        .map(|i| {
            let (z, angle) = (f64::from(i) / 31.5 - 1.0, f64::from(i) * 2.4);
            let across = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(across * angle.cos(), across * angle.sin(), z) * kernel_radius
        })
        .collect();
    for eye_distance in [None, Some(40.0)] {
        let visibility = Visibility {
            view_from_index: turn * 2.0,
            // In perspective the eye is inside.
            view_origin: turn * DVec3::splat(-32.0) + DVec3::new(1.0, 2.0, 8.0),
            half_size: DVec2::new(9.0, 7.0),
            eye_distance,
            kernel_radius,
        };
        let order = VisitOrder::Along(DVec3::Z);
        // With a limit, nodes about the eye are still to be split: none is under it.
        for min_radius_px in [0.0, 7.0] {
            let limits = CutLimits { min_radius_px, ..limits(0.0, 0) };
            let cut = Cut::of(&built.pyramid, limits, order, &visibility, |index| {
                built.table.lookup(built.volume.samples.get(index))
            })
            .nodes;
            let mut drawn = vec![0_usize; 32 * 32 * 32];
            for node in &cut {
                for [x, y, z] in voxels(node.low.map(|n| n as usize), node.size.map(|n| n as usize))
                {
                    drawn[(z * 32 + y) * 32 + x] = node.size[0] as usize;
                }
            }
            let mut seen = 0;
            for (i, at) in voxels([0; 3], dims).enumerate() {
                let at = DVec3::from_array(at.map(|n| n as f64));
                let view = |p: DVec3| visibility.view_origin + visibility.view_from_index * p;
                let on_picture = rims.iter().any(|&rim| {
                    let v = view(at + rim);
                    let shrink = eye_distance.map_or(1.0, |d| d / v.z);
                    shrink > 0.0
                        && (v.x * shrink).abs() < visibility.half_size.x
                        && (v.y * shrink).abs() < visibility.half_size.y
                });
                seen += usize::from(on_picture);
                assert!(drawn[i] > 0 || !on_picture, "{at} {eye_distance:?} is missing");
                let centre = view(at);
                if let Some(distance) = eye_distance {
                    // The sphere of a voxel's kernel has a radius of 3 in view space.
                    assert!(drawn[i] != 1 || centre.z > -3.0 * 1.8, "{at} is behind the eye");
                    let half_radius_px = 1.5 * drawn[i] as f64 * distance / centre.z;
                    assert!(
                        drawn[i] <= 1 || centre.z <= 0.0 || half_radius_px < 2.0 * min_radius_px,
                        "{at} in a node of {} has {half_radius_px} pixels",
                        drawn[i]
                    );
                    assert!(centre.length() > 3.0 || drawn[i] <= 1, "{at} is at the eye");
                }
            }
            assert!(seen > 500 && cut.len() < 20_000, "{seen} seen, {} drawn", cut.len());
        }
    }
}
