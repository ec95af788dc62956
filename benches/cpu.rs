//! What the host does before and beside drawing: `cargo bench --bench cpu`.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use voxsplat::core::Ticket;
use voxsplat::hierarchy::{Cut, CutLimits, ErrorMeasure, Pyramid, ScalarPyramid};
use voxsplat::kernel::{FootprintPolynomial, Kernel, RadialKernel, SlabShare, coefficients};
use voxsplat::scene::{self, SampleSource, Scene, View};
use voxsplat::transfer::Table;
use voxsplat::volume::{
    Bricks, Component, Lattice, Samples, ScalarType, ScalarVolume, Statistics, demo,
};

fn head() -> Scene {
    let grid = demo::open("head", Some(128)).expect("a demo there is");
    let field = &grid.fields[0];
    let volume = grid.scalar(field, Component::Index(0), &Ticket::new()).expect("finite values");
    scene::opening(SampleSource::default(), Arc::new(volume), None)
}

fn volume_of(scene: &Scene) -> &Arc<ScalarVolume> {
    scene.volume().expect("a field")
}

fn statistics(c: &mut Criterion) {
    let scene = head();
    let ScalarVolume { samples, lattice, .. } = &**volume_of(&scene);
    let ticket = Ticket::new();
    c.bench_function("statistics of 128³ int16", |b| {
        b.iter(|| Statistics::of(black_box(samples), &ticket));
    });
    c.bench_function("bricks of 128³ int16", |b| {
        b.iter(|| Bricks::of(black_box(samples), lattice.dims, &ticket));
    });
}

fn classification(c: &mut Criterion) {
    let scene = head();
    for scalar_type in [ScalarType::UInt8, ScalarType::Int16, ScalarType::Float32] {
        c.bench_function(&format!("table for {}", scalar_type.name()), |b| {
            b.iter(|| Table::new(black_box(scene.transfer().expect("a field")), scalar_type));
        });
    }
    let table = Table::new(scene.transfer().expect("a field"), ScalarType::Int16);
    let build = |measure| {
        let volume = black_box(volume_of(&scene));
        Pyramid::build(volume, &table, 1.0, measure, &Ticket::new()).expect("nobody cancels")
    };
    for &measure in ErrorMeasure::ALL {
        c.bench_function(&format!("pyramid of 128³ int16, {}", measure.name()), |b| {
            b.iter(|| build(measure));
        });
    }
    c.bench_function("coarse levels of the pyramid of 128³ int16", |b| {
        let (volume, measure) = (black_box(volume_of(&scene)), ErrorMeasure::Classified);
        b.iter(|| Pyramid::coarse(volume, &table, 1.0, measure, &Ticket::new()));
    });
    let pyramid = build(ErrorMeasure::Classified);
    let view = View::new(&scene, [944, 743]);
    let visibility = view.visibility(1.556);
    c.bench_function("octree cut of 20 000 nodes", |b| {
        let limits = CutLimits::of_error(pyramid.error_for_count(20_000));
        b.iter(|| Cut::of(&pyramid, limits, view.visit_order(), &visibility, |_| [0.0; 4]));
    });
}

fn scalar_pyramid(c: &mut Criterion) {
    let codes = (0..1_usize << 24).map(|i| (i.wrapping_mul(i) >> 9) as u8).collect();
    let volume =
        ScalarVolume::from_samples("codes", Lattice::unit([256; 3]), Samples::UInt8(codes))
            .expect("sound");
    let mut group = c.benchmark_group("pyramid of values");
    group.sample_size(10);
    group.bench_function("256³ uint8", |b| {
        b.iter(|| ScalarPyramid::build(black_box(&volume), &Ticket::new()));
    });
}

fn kernels(c: &mut Criterion) {
    let cubic = RadialKernel::new(Kernel::Cubic, None).expect("radial");
    c.bench_function("cubic footprint in closed form", |b| {
        b.iter(|| cubic.footprint(black_box(0.7)));
    });
    let polynomial = FootprintPolynomial::of(cubic);
    c.bench_function("cubic footprint as a polynomial", |b| {
        b.iter(|| polynomial.evaluate(black_box(0.7)));
    });
    let share = SlabShare::of(cubic);
    c.bench_function("cubic slab integral in closed form", |b| {
        b.iter(|| cubic.cumulative(black_box(0.7), black_box(0.4)));
    });
    c.bench_function("cubic slab integral from polynomials", |b| {
        b.iter(|| {
            let l = black_box(0.7);
            polynomial.evaluate(l) * share.share(l, black_box(0.4))
        });
    });
    let gaussian = RadialKernel::new(Kernel::Gaussian, None).expect("radial");
    c.bench_function("gaussian slab integral in closed form", |b| {
        b.iter(|| gaussian.cumulative(black_box(0.7), black_box(0.4)));
    });
}

fn reconstruction(c: &mut Criterion) {
    let scene = head();
    let volume = volume_of(&scene);
    let mut group = c.benchmark_group("coefficients of 128³ int16");
    for (kernel, interpolating) in [
        (Kernel::Linear, false),
        (Kernel::BSpline, true),
        (Kernel::Cubic, true),
        (Kernel::Gaussian, true),
    ] {
        let word = if interpolating { "interpolating" } else { "smooth" };
        group.bench_function(format!("{}, {word}", kernel.name()), |b| {
            b.iter(|| coefficients(black_box(volume), kernel, None, interpolating, &Ticket::new()));
        });
    }
    group.finish();
}

criterion_group!(benches, statistics, classification, scalar_pyramid, kernels, reconstruction);
criterion_main!(benches);
