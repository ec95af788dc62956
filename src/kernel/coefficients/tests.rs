use proptest::prelude::*;

use super::*;
use crate::core::assert_stops;
use crate::kernel::{RadialKernel, Separable};
use crate::volume::{Lattice, Samples};

fn volume(dims: [usize; 3], samples: Samples) -> ScalarVolume {
    ScalarVolume::from_samples("test", Lattice::unit(dims), samples).unwrap()
}

fn made(volume: &ScalarVolume, kernel: Kernel, interpolating: bool) -> Coefficients {
    coefficients(volume, kernel, None, interpolating, &Ticket::new()).unwrap()
}

fn mirrored(index: i64, n: usize) -> usize {
    let last = n as i64 - 1;
    let mut index = index;
    while index < 0 || index > last {
        index = if last == 0 {
            0
        } else if index < 0 {
            -index
        } else {
            2 * last - index
        };
    }
    usize::try_from(index).unwrap()
}

/// Σ cᵢ hᵢ / Σ hᵢ at a point of index space, by brute force over the mirrored lattice.
fn reconstructed(c: &Coefficients, kernel: Kernel, at: [f64; 3]) -> f64 {
    let h = |o: [f64; 3]| match (Separable::new(kernel, None), RadialKernel::new(kernel, None)) {
        (Some(k), _) => o.iter().map(|&x| k.value(x)).product(),
        (_, Some(k)) => k.value(o.iter().map(|x| x * x).sum::<f64>().sqrt()),
        _ => panic!("{kernel:?} reconstructs nothing between samples"),
    };
    let base = at.map(|x| x.floor() as i64);
    let (mut sum, mut weights) = (0.0, 0.0);
    let near = -2..=3_i64;
    for z in near.clone().map(|k| base[2] + k) {
        for y in near.clone().map(|k| base[1] + k) {
            for x in near.clone().map(|k| base[0] + k) {
                let weight = h([at[0] - x as f64, at[1] - y as f64, at[2] - z as f64]);
                let [nx, ny, nz] = c.dims;
                let index = (mirrored(z, nz) * ny + mirrored(y, ny)) * nx + mirrored(x, nx);
                sum += weight * c.get(index);
                weights += weight;
            }
        }
    }
    sum / weights
}

/// What float64 loses of a volume's values in the sums here, relative to nothing.
fn rounding(volume: &ScalarVolume) -> f64 {
    1e-14 * volume.statistics.max.abs().max(volume.statistics.min.abs())
}

fn points(dims: [usize; 3]) -> impl Iterator<Item = (usize, [f64; 3])> {
    let [nx, ny, nz] = dims;
    (0..nx * ny * nz).map(move |i| (i, [i % nx, i / nx % ny, i / (nx * ny)].map(|x| x as f64)))
}

/// (rms, max) of sample − reconstruction, in units of the samples.
fn left_over(volume: &ScalarVolume, c: &Coefficients, kernel: Kernel) -> (f64, f64) {
    let (mut squares, mut greatest, mut count) = (0.0, 0.0_f64, 0.0);
    for (i, at) in points(c.dims) {
        let s = volume.samples.get(i);
        if !s.is_nan() {
            let difference = s - reconstructed(c, kernel, at);
            squares += difference * difference;
            greatest = greatest.max(difference.abs());
            count += 1.0;
        }
    }
    ((squares / count).sqrt(), greatest)
}

fn small_volume() -> impl Strategy<Value = ScalarVolume> {
    let dims = prop_oneof![
        Just([1, 1, 1]),
        (2_usize..50).prop_map(|n| [1, 1, n]),
        (2_usize..50).prop_map(|n| [n, 1, 1]),
        (2_usize..50).prop_map(|n| [1, n, 1]),
        Just([2, 3, 5]),
        (1_usize..9, 1_usize..9, 1_usize..9).prop_map(|(x, y, z)| [x, y, z]),
    ];
    let scale =
        prop_oneof![Just((0.0, 1.0)), Just((1e6, 1.0)), Just((-3e-7, 1e-9)), Just((0., 1e30))];
    (dims, scale).prop_flat_map(|(dims, (offset, spread))| {
        prop::collection::vec(0.0..1.0_f64, dims.iter().product::<usize>()).prop_map(
            move |values| {
                volume(dims, Samples::Float64(values.iter().map(|v| offset + spread * v).collect()))
            },
        )
    })
}

proptest! {
    /// Expected on noise, not measured: 1.6e-6 of the range, from storing 32 bits between the axes.
    #[test]
    fn the_prefiltered_b_spline_passes_through_every_sample(volume in small_volume()) {
        let c = made(&volume, Kernel::BSpline, true);
        let range = volume.statistics.max - volume.statistics.min;
        let (rms, max) = left_over(&volume, &c, Kernel::BSpline);
        let lost = rounding(&volume);
        prop_assert!(max <= 1e-5 * range + lost, "{:?}: {max} of {range}", c.dims);
        prop_assert!((c.residual().unwrap().max * range - max).abs() <= 1e-6 * range + lost);
        prop_assert!((c.residual().unwrap().rms * range - rms).abs() <= 1e-6 * range + lost);
    }

    #[test]
    fn recorded_residuals_are_what_is_left_of_the_samples(
        volume in small_volume(),
        kernel in prop_oneof![Just(Kernel::Cubic), Just(Kernel::Gaussian)],
        interpolating: bool,
    ) {
        let c = made(&volume, kernel, interpolating);
        let range = volume.statistics.max - volume.statistics.min;
        let (rms, max) = left_over(&volume, &c, kernel);
        let lost = rounding(&volume);
        prop_assert!((c.residual().unwrap().max * range - max).abs() <= 1e-6 * range + lost, "{max}");
        prop_assert!((c.residual().unwrap().rms * range - rms).abs() <= 1e-6 * range + lost, "{rms}");
        prop_assert_eq!(c.residuals.len(), if interpolating { 3 } else { 1 });
        for pair in c.residuals.windows(2) {
            prop_assert!(pair[1].rms <= pair[0].rms * 1.000_001 + 1e-7, "{:?}", c.residuals);
        }
    }

    #[test]
    fn extremes_bound_every_coefficient_and_smooth_ones_are_the_samples(
        volume in small_volume(),
        interpolating: bool,
    ) {
        for kernel in Kernel::ALL {
            let c = made(&volume, kernel, interpolating);
            let all: Vec<f64> = (0..c.values.len()).map(|i| c.get(i)).collect();
            prop_assert_eq!(c.min, all.iter().copied().fold(f64::INFINITY, f64::min));
            prop_assert_eq!(c.max, all.iter().copied().fold(f64::NEG_INFINITY, f64::max));
            prop_assert_eq!(&c.holes, &None);
            let range = volume.statistics.max - volume.statistics.min;
            let is_sharp = matches!(kernel, Kernel::Point | Kernel::Nearest | Kernel::Linear);
            if !interpolating || is_sharp {
                for (i, value) in all.iter().enumerate() {
                    let s = volume.samples.get(i);
                    prop_assert!((value - s).abs() <= 1e-7 * range + 1e-15 * s.abs());
                }
            }
        }
    }
}

#[test]
fn constants_stay_constant_and_ramps_are_met_away_from_the_border() {
    let dims = [40, 9, 70];
    let constant = volume(dims, Samples::UInt8(vec![77; dims.iter().product()]));
    let value = |p: [f64; 3]| 3.0 * p[0] - 2.0 * p[1] + 0.5 * p[2];
    let ramp = Samples::Float64(points(dims).map(|(_, p)| value(p)).collect());
    let ramp = volume(dims, ramp);
    for kernel in [Kernel::Linear, Kernel::Gaussian, Kernel::Cubic, Kernel::BSpline] {
        let c = made(&constant, kernel, true);
        assert!(c.values.iter().all(|&v| v == 0.0) && c.bias == 77.0, "{kernel:?}");
        let c = made(&ramp, kernel, true);
        let range = ramp.statistics.max - ramp.statistics.min;
        for at in [[20.3, 4.5, 35.7], [18.0, 4.0, 33.0], [19.5, 4.25, 36.5]] {
            let error = (reconstructed(&c, kernel, at) - value(at)).abs() / range;
            // The radial kernels' lattice sum ripples, and their sweeps reach 6 samples from the
            // border: 3.2e-4 of the range. The spline's border dies away by 0.27 a sample.
            let bound = match kernel {
                Kernel::BSpline => 2e-4,
                Kernel::Linear => 1e-6,
                _ => 5e-3,
            };
            assert!(error < bound, "{kernel:?} {at:?}: {error}");
        }
    }
    // Far from every border the ramp's own coefficients are the ramp.
    let line = [200, 1, 1];
    let ramp = volume(line, Samples::Float64((0..200).map(f64::from).collect()));
    let c = made(&ramp, Kernel::BSpline, true);
    for i in 40..160 {
        assert!((c.get(i) - i as f64).abs() < 1e-5 * 200.0, "{i}: {}", c.get(i));
    }
}

/// Samples that alternate along every axis: the highest frequency there is.
fn checkerboard(dims: [usize; 3]) -> ScalarVolume {
    let sign = |p: [f64; 3]| if p.iter().sum::<f64>() % 2.0 == 0.0 { 1.0 } else { -1.0 };
    volume(dims, Samples::Float32(points(dims).map(|(_, p)| sign(p) as f32).collect()))
}

#[test]
fn what_two_sweeps_leave_at_the_highest_frequency_is_recorded() {
    let checkerboard = checkerboard([8, 9, 10]);
    let left = |response: f64| [1, 2, 3].map(|power| (1.0 - response).powi(power));
    // The response at that frequency is Σ ± h, and each sweep takes that part off what is left.
    for (kernel, response, recorded) in [
        (Kernel::Cubic, 0.166_316, [0.834, 0.695, 0.579]),
        (Kernel::Gaussian, 0.037_423, [0.963, 0.927, 0.892]),
    ] {
        let c = made(&checkerboard, kernel, true);
        assert_eq!(c.residuals.len(), 3);
        for ((r, expected), recorded) in c.residuals.iter().zip(left(response)).zip(recorded) {
            // The range is 2 where the samples' magnitude is 1.
            assert!((2.0 * r.max - expected).abs() < 1e-5, "{kernel:?}: {r:?} {expected}");
            assert!((2.0 * r.rms - expected).abs() < 1e-5, "{kernel:?}: {r:?} {expected}");
            assert!((expected - recorded).abs() < 6e-4, "{kernel:?}: {expected}");
        }
    }
    // The spline leaves nothing of what it smoothes to a twenty-seventh.
    let c = made(&checkerboard, Kernel::BSpline, true);
    assert!((2.0 * c.residuals[0].max - 26.0 / 27.0).abs() < 1e-6, "{:?}", c.residuals);
    assert!(c.residual().unwrap().max < 1e-6, "{:?}", c.residuals);
}

#[test]
fn samples_without_data_are_bridged_and_infinities_are_the_ends() {
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let volume = volume([3, 2, 1], Samples::Float64(vec![1.0, nan, 5.0, -inf, inf, 3.0]));
    for interpolating in [false, true] {
        for kernel in Kernel::ALL {
            let c = made(&volume, kernel, interpolating);
            assert!(c.values.iter().all(|v| v.is_finite()), "{kernel:?}");
            assert!((0..6).all(|i| c.is_hole(i) == (i == 1)));
        }
    }
    let c = made(&volume, Kernel::Linear, false);
    let all: Vec<f64> = (0..6).map(|i| c.get(i)).collect();
    // The hole's neighbours are 1, 5 and the infinity below it, which counts as 5.
    let filled = 11.0 / 3.0;
    assert!((all[1] - filled).abs() < 1e-6);
    assert_eq!([all[0], all[2], all[3], all[4], all[5]], [1.0, 5.0, 1.0, 5.0, 3.0]);
    let c = made(&volume, Kernel::BSpline, true);
    assert!(c.residual().unwrap().max < 1e-6, "{:?}", c.residual());
}

#[test]
fn huge_values_stay_finite_and_narrow_ranges_keep_their_digits() {
    let huge = volume([2, 2, 2], Samples::Float64([1e308, -1e308].repeat(4)));
    for kernel in Kernel::ALL {
        let c = made(&huge, kernel, true);
        assert!(c.values.iter().all(|v| v.is_finite()), "{kernel:?}");
        assert!(c.residuals.iter().all(|r| r.rms.is_finite() && r.max.is_finite()), "{c:?}");
    }
    let high = volume([4, 1, 1], Samples::Float64(vec![1e6, 1e6 + 0.25, 1e6 + 1.0, 1e6]));
    let c = made(&high, Kernel::BSpline, true);
    assert_eq!(c.bias, 1e6);
    let (_, max) = left_over(&high, &c, Kernel::BSpline);
    assert!(max < 1e-6, "{max}");
}

#[test]
fn too_wide_kernels_and_cancelled_work_are_refused() {
    let volume = checkerboard([3, 3, 3]);
    let wide = coefficients(&volume, Kernel::Cubic, Some(8.5), false, &Ticket::new()).unwrap_err();
    assert_eq!(
        wide.to_string(),
        "expected an extent of at most 8 voxels, found 8.5; choose a smaller extent"
    );
    let most = coefficients(&volume, Kernel::Cubic, Some(8.0), true, &Ticket::new()).unwrap();
    assert!(most.values.iter().all(|v| v.is_finite()));
    let wide = coefficients(&volume, Kernel::Linear, Some(2.5), false, &Ticket::new()).unwrap_err();
    assert_eq!(
        wide.to_string(),
        "expected an extent of at most 2 voxels, found 2.5; choose a smaller extent"
    );
    assert!(coefficients(&volume, Kernel::BSpline, Some(99.0), true, &Ticket::new()).is_err());
    let ticket = Ticket::new();
    ticket.cancel();
    for kernel in Kernel::ALL {
        let stopped = coefficients(&volume, kernel, None, true, &ticket);
        assert_eq!(stopped, Err(CoefficientsError::Cancelled(Cancelled)));
    }
}

/// Σ cᵢ h((x − i)/s) / Σ h((x − i)/s) at a point of index space, from the coefficients of the natural width.
fn widened(natural: &Coefficients, kernel: Separable, at: [f64; 3]) -> f64 {
    let [nx, ny, nz] = natural.dims;
    let [(x0, wx), (y0, wy), (z0, wz)] = at.map(|x| kernel.weights(x));
    let mut sum = 0.0;
    for (z, wz) in (z0..).zip(&wz) {
        for (y, wy) in (y0..).zip(&wy) {
            for (x, wx) in (x0..).zip(&wx) {
                let index = (mirrored(z, nz) * ny + mirrored(y, ny)) * nx + mirrored(x, nx);
                sum += wx * wy * wz * natural.get(index);
            }
        }
    }
    sum
}

proptest! {
    #[test]
    fn wide_splines_are_at_the_samples_what_they_are_defined_as(
        volume in small_volume(),
        extent in 2.0..8.0_f64,
        interpolating: bool,
    ) {
        let natural = made(&volume, Kernel::BSpline, interpolating);
        let wide =
            coefficients(&volume, Kernel::BSpline, Some(extent), interpolating, &Ticket::new());
        let wide = wide.unwrap();
        let kernel = Separable::new(Kernel::BSpline, Some(extent)).unwrap();
        let range = volume.statistics.max - volume.statistics.min;
        // Of sums of up to 17³ products.
        let lost = 100.0 * rounding(&volume);
        let (mut squares, mut count) = (0.0, 0.0);
        for (i, at) in points(wide.dims) {
            let expected = widened(&natural, kernel, at);
            let found = reconstructed(&wide, Kernel::BSpline, at);
            prop_assert!((found - expected).abs() <= 2e-5 * range + lost, "{at:?}: {found} {expected}");
            squares += (volume.samples.get(i) - expected).powi(2);
            count += 1.0;
        }
        let rms = f64::sqrt(squares / count);
        prop_assert!((wide.residual().unwrap().rms * range - rms).abs() <= 2e-5 * range + lost);
        prop_assert!(wide.min <= wide.max && wide.values.iter().all(|v| v.is_finite()));
    }
}

/// Between the samples, where what is drawn is the natural spline through the wide one's samples.
#[test]
fn wide_splines_are_nearly_what_they_are_defined_as_between_the_samples() {
    let dims = [23, 21, 24];
    let noise =
        |[x, y, z]: [f64; 3]| ((x * 7919.0 + y * 104_729.0 + z * 1_299_709.0) % 101.0) / 100.0;
    let waves =
        |[x, y, z]: [f64; 3]| 0.5 + 0.25 * ((0.8 * x + 0.3 * y).sin() + (0.5 * z - 0.6 * y).cos());
    for (name, value, bounds) in [
        // Measured, rms as parts of the range, at 1.1, 1.25, 1.5 times the natural width: 1.3e-2, 1.1e-2, 3.0e-3, and
        // 8.2e-4, 1.1e-3, 7.9e-4. Splines of whole multiples of it are sums of natural ones: 2e-8.
        ("noise", &noise as &dyn Fn([f64; 3]) -> f64, [1.6e-2, 1.4e-2, 4e-3, 1e-6, 1e-6, 1e-6]),
        ("waves of 8 to 13 samples", &waves, [1.1e-3, 1.4e-3, 1e-3, 1e-6, 1e-6, 1e-6]),
    ] {
        let samples = points(dims).map(|(_, p)| value(p)).collect();
        let volume = volume(dims, Samples::Float64(samples));
        let natural = made(&volume, Kernel::BSpline, true);
        let range = volume.statistics.max - volume.statistics.min;
        for (scale, bound) in [1.1, 1.25, 1.5, 2.0, 3.0, 4.0].into_iter().zip(bounds) {
            let extent = Some(2.0 * scale);
            let wide =
                coefficients(&volume, Kernel::BSpline, extent, true, &Ticket::new()).unwrap();
            let kernel = Separable::new(Kernel::BSpline, extent).unwrap();
            let (mut squares, mut greatest, mut count) = (0.0, 0.0_f64, 0.0);
            for i in 0..1500_u32 {
                let part = |k: u32| f64::from(i.wrapping_mul(k) % 997) / 997.0;
                let place = [part(389), part(211), part(677)];
                let at: [f64; 3] = std::array::from_fn(|a| place[a] * (dims[a] as f64 - 1.0));
                let off = widened(&natural, kernel, at) - reconstructed(&wide, Kernel::BSpline, at);
                squares += off * off;
                greatest = greatest.max(off.abs());
                count += 1.0;
            }
            let rms = f64::sqrt(squares / count) / range;
            println!("measured {name}, {scale} wide: rms {rms:.1e}, max {:.1e}", greatest / range);
            assert!(rms < bound, "{name} {scale}: {rms}");
        }
    }
}

#[test]
fn constants_stay_constant_at_every_extent() {
    let dims = [9, 1, 12];
    let constant = volume(dims, Samples::UInt8(vec![77; dims.iter().product()]));
    for extent in [0.5, 1.0, 2.0, 3.0, 7.3, 8.0] {
        let ticket = Ticket::new();
        let c = coefficients(&constant, Kernel::BSpline, Some(extent), true, &ticket).unwrap();
        assert!(c.values.iter().all(|&v| v == 0.0) && c.bias == 77.0, "{extent}");
        assert_eq!(c.residual().unwrap().max, 0.0);
    }
    // Without a bias: the weights themselves sum to one.
    let line = volume([40, 1, 1], Samples::Float64((0..40).map(|i| f64::from(i >= 39)).collect()));
    for extent in [2.5, 3.0, 6.0, 8.0] {
        let c = coefficients(&line, Kernel::BSpline, Some(extent), false, &Ticket::new()).unwrap();
        assert!(c.get(0).abs() < 1e-6, "{extent}: far from the only sample that differs");
        assert!(c.get(39) < 1.0 && c.get(39) > 0.1, "{extent}: {}", c.get(39));
    }
}

#[test]
fn natural_extents_make_the_same_bits_as_none() {
    let volume = checkerboard([7, 8, 9]);
    for (kernel, natural) in [(Kernel::Linear, 1.0), (Kernel::BSpline, 2.0), (Kernel::Cubic, 1.556)]
    {
        for interpolating in [false, true] {
            let given = coefficients(&volume, kernel, Some(natural), interpolating, &Ticket::new());
            assert_eq!(given.unwrap(), made(&volume, kernel, interpolating), "{kernel:?}");
        }
    }
}

#[test]
fn means_without_data_are_bridged_and_marked_and_their_widths_kept() {
    let averaged =
        Averaged { level: 1, volume_dims: [7, 2, 2], half_widths: vec![0.5, 0.0, 2.0, 1.0] };
    let values = vec![1.0, f32::NAN, 4.0, -2.0];
    let made = |values: Vec<f32>, ticket: &Ticket| {
        Coefficients::of_means([4, 1, 1], values, 1e6, averaged.clone(), ticket)
    };
    let c = made(values.clone(), &Ticket::new()).unwrap();
    assert_eq!(c.values, [1.0, 2.5, 4.0, -2.0], "between its neighbours");
    assert_eq!(c.holes, Some(vec![0b10]));
    assert_eq!((c.min, c.max, c.bias, c.get(2)), (1e6 - 2.0, 1e6 + 4.0, 1e6, 1e6 + 4.0));
    assert_eq!(c.averaged.as_ref(), Some(&averaged));
    assert_eq!(c.residual(), None, "nothing was to be passed through");
    let none = made(vec![f32::NAN; 4], &Ticket::new()).unwrap();
    assert_eq!((none.values, none.holes), (vec![0.0; 4], Some(vec![0b1111])));
    let whole = made(vec![3.0; 4], &Ticket::new()).unwrap();
    assert_eq!((whole.holes, whole.min, whole.max), (None, 1e6 + 3.0, 1e6 + 3.0));
    let ticket = Ticket::new();
    ticket.cancel();
    assert!(made(values, &ticket).is_err());
}

/// Each has samples stored, its range found and its residuals taken; splines are filtered along three axes, and others swept over
/// twice.
#[test]
fn coefficients_of_every_kernel_are_left_off_where_a_ticket_says_so() {
    let dims = [96, 90, 92];
    let count: usize = dims.iter().product();
    let samples = (0..count).map(|i| ((i * 2_654_435_761) % 1009) as f32).collect();
    let volume = volume(dims, Samples::Float32(samples));
    let rows = dims[1] * dims[2];
    for (kernel, extent, least) in [
        (Kernel::Linear, None, 2 * count.div_ceil(CHUNK)),
        (Kernel::BSpline, None, 2 * count.div_ceil(CHUNK) + rows / 32),
        (Kernel::BSpline, Some(3.0), 2 * count.div_ceil(CHUNK) + rows / 32),
        (Kernel::Cubic, None, SWEEPS * rows),
    ] {
        assert_stops(&format!("{kernel:?} {extent:?}"), least, |ticket| {
            coefficients(&volume, kernel, extent, true, ticket)
        });
    }
    assert_stops("the nearest tents", 3 * count.div_ceil(CHUNK), |ticket| {
        nearest_tents(&volume, ticket)
    });
}
