use proptest::prelude::*;

use super::*;
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
    let h = |o: [f64; 3]| match (Separable::new(kernel), RadialKernel::new(kernel, None)) {
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
            if !interpolating || kernel.natural_extent().is_none() && kernel != Kernel::BSpline {
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
    // Extent means nothing to a spline.
    let spline = coefficients(&volume, Kernel::BSpline, Some(99.0), true, &Ticket::new()).unwrap();
    assert!(spline.residual().unwrap().max < 1e-6);
    let ticket = Ticket::new();
    ticket.cancel();
    for kernel in Kernel::ALL {
        let stopped = coefficients(&volume, kernel, None, true, &ticket);
        assert_eq!(stopped, Err(CoefficientsError::Cancelled(Cancelled)));
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
