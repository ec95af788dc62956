//! Layers in float64: each kernel integrated along each pixel's ray, layer by layer, and composited.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use voxsplat::kernel::{Kernel, RadialKernel};
use voxsplat::reference::grid_kernels;
use voxsplat::scene::{OpacityModel, Scene, SplatSettings, View, Visibility};

use crate::support::Light;

fn over(sum: [f64; 4], published: bool, behind: [f64; 4]) -> [f64; 4] {
    if sum[3] <= 0.0 {
        return behind;
    }
    let alpha = if published { sum[3].min(1.0) } else { -(-sum[3]).exp_m1() };
    let front = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], 1.0];
    std::array::from_fn(|c| alpha * front[c] + (1.0 - alpha) * behind[c])
}

/// h at a point of kernel space; a box owns its lower faces.
fn density(kernel: Kernel, radial: Option<RadialKernel>, at: DVec3) -> f64 {
    let separable = |h: fn(f64) -> f64| h(at.x.abs()) * h(at.y.abs()) * h(at.z.abs());
    match kernel {
        Kernel::Nearest => {
            let inside = at.to_array().iter().all(|x| (-0.5..0.5).contains(x));
            f64::from(u8::from(inside))
        }
        Kernel::Linear => separable(|x| (1.0 - x).max(0.0)),
        Kernel::BSpline => separable(|x| {
            let (outer, inner) = ((2.0 - x).max(0.0), (1.0 - x).max(0.0));
            (outer.powi(3) - 4.0 * inner.powi(3)) / 6.0
        }),
        _ => radial.map_or(0.0, |k| k.value(at.length())),
    }
}

/// Points and weights of Gauss–Legendre quadrature on −1..=1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// The longest panel, voxels: the rule is off by 3e-9 at most on so much of a Gaussian's middle.
const PANEL: f64 = 0.75;

/// The integral of `f`, which is smooth over voxels; a unit of its argument is `step` of them.
fn integral(from: f64, to: f64, step: f64, f: impl Fn(f64) -> f64) -> f64 {
    let panels = ((to - from) * step / PANEL).ceil().max(1.0) as u32;
    let half = (to - from) / f64::from(2 * panels);
    let panel = |i: u32| {
        let middle = from + half * f64::from(2 * i + 1);
        GAUSS.iter().map(|(x, w)| w * f(middle + half * x)).sum::<f64>()
    };
    half * (0..panels).map(panel).sum::<f64>()
}

/// The picture in float64: each kernel integrated along a pixel's rays, layer by layer; as many of them
/// as its kernels take in this view.
pub(crate) fn expected(scene: &Scene, size: [u32; 2]) -> Light {
    let SplatSettings { kernel, extent, .. } = scene.splat;
    let view = View::new(scene, size);
    let outer = view.traversal.axes[0];
    let lattice = scene.lattice();
    let camera = &scene.camera;
    let published = scene.splat.opacity_model == OpacityModel::Published;
    let unit = scene.opacity_unit_distance();
    let radial = RadialKernel::new(kernel, extent);
    let half = match kernel {
        Kernel::Nearest => 0.5,
        Kernel::Linear => 1.0,
        Kernel::BSpline => 2.0,
        _ => radial.expect("points are compared otherwise").radius(),
    };
    let kernels = grid_kernels(scene);
    let slabs = scene.splat.visibility == Visibility::Slabs;
    let layered = slabs || scene.splat.sheets_per_kernel > 1;
    let whole = scene.splat.visibility == Visibility::EverySample;
    let index = DMat3::inverse(&lattice.axes());
    let middle = camera.to_view(lattice.centre()).z;
    let size = size.map(|n| n as usize);
    let side = view.rays_per_side(kernel, extent);
    let ray_light = |at: DVec2| {
        let (origin, direction) = camera.ray(at, size.map(|n| n as f64));
        let begin = camera.eye_distance().map_or(f64::NEG_INFINITY, |_| 0.0);
        // Layer coordinate along the ray: at its origin, and per world length.
        let (layer, slope) = if slabs {
            let thickness = lattice.smallest_spacing() / scene.splat.slabs_per_voxel;
            let depth = camera.to_view(origin).z - middle;
            (depth / thickness, direction.dot(camera.direction) / thickness)
        } else {
            let thickness = 2.0 * half / f64::from(scene.splat.sheets_per_kernel);
            let depth = (index * (origin - lattice.centre()))[outer] / thickness;
            let slope = (index * direction)[outer] / thickness;
            (depth * slope.signum(), slope.abs())
        };
        let mut layers: BTreeMap<i64, [f64; 4]> = BTreeMap::new();
        let mut light = [0.0; 4];
        let mut slice = (f64::NAN, [0.0; 4]);
        for k in &kernels {
            let start = index * (origin - k.centre);
            let step = index * direction;
            // A ball about the kernel's support.
            let reach = if radial.is_some() { half } else { half * 3.0_f64.sqrt() };
            let nearest = -start.dot(step) / step.length_squared();
            let l2 = (start + step * nearest).length_squared();
            if l2 >= reach * reach {
                continue;
            }
            let chord = (reach * reach - l2).sqrt() / step.length();
            let (from, to) = ((nearest - chord).max(begin), nearest + chord);
            if from >= to {
                continue;
            }
            let mut cuts = vec![from, to];
            let lines = (layer + slope * from).ceil() as i64..=(layer + slope * to).floor() as i64;
            if layered {
                cuts.extend(lines.map(|line| (line as f64 - layer) / slope));
            }
            if radial.is_none() {
                for face in -2..=2 {
                    for axis in 0..3 {
                        let face = f64::from(face);
                        let shift = if kernel == Kernel::Nearest { 0.5 } else { 0.0 };
                        cuts.push((face + shift - start[axis]) / step[axis]);
                    }
                }
            }
            cuts.retain(|t| (from..=to).contains(t));
            cuts.sort_by(f64::total_cmp);
            let mut whole_sum = [0.0; 4];
            for pair in cuts.windows(2) {
                let sum = integral(pair[0], pair[1], step.length(), |t| {
                    density(kernel, radial, start + step * t)
                });
                let matter =
                    if published { -(-k.extinction * unit).exp_m1() / unit } else { k.extinction };
                let depth = matter * sum;
                let number = (layer + slope * 0.5 * (pair[0] + pair[1])).floor() as i64;
                let place =
                    if layered { layers.entry(number).or_default() } else { &mut whole_sum };
                let [red, green, blue] = k.colour;
                for (sum, c) in place.iter_mut().zip([red, green, blue, 1.0]) {
                    *sum += depth * c;
                }
            }
            if layered {
                continue;
            }
            let place = lattice.index_from_world(k.centre)[outer].round();
            if whole || slice.0 != place {
                light = over(slice.1, published, light);
                slice = (place, [0.0; 4]);
            }
            (0..4).for_each(|c| slice.1[c] += whole_sum[c]);
        }
        light = over(slice.1, published, light);
        for sum in layers.into_values().rev() {
            light = over(sum, published, light);
        }
        light
    };
    let pixel_light = |pixel: usize| {
        let corner = DVec2::new((pixel % size[0]) as f64, (pixel / size[0]) as f64);
        let mut light = [0.0; 4];
        for ray in 0..side * side {
            let part = DVec2::new(f64::from(ray % side), f64::from(ray / side)) + 0.5;
            let of_ray = ray_light(corner + part / f64::from(side));
            (0..4).for_each(|c| light[c] += of_ray[c] / f64::from(side * side));
        }
        light
    };
    (0..size[0] * size[1]).into_par_iter().map(pixel_light).collect()
}
