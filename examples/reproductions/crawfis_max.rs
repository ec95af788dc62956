//! Crawfis and Max, figures 2 and 4: how even the optimal kernel is, and what it looks like.

use anyhow::{Result, anyhow};
use voxsplat::kernel::{Kernel, RadialKernel, Subdivisions};
use voxsplat::scene::{
    self, Backend, NamedView, OpacityModel, Orientation, SampleSource, Scene, SplatSettings, View,
};
use voxsplat::task::still::Refine;

use crate::support::{Curve, Page, charts, compare, crop, db, demo_grid, least_ms, scalar, short};
use crate::support::{wide, with, write_png};

/// Pixels a panel of figure 2, of 2 × 2 periods; how much deviations are magnified, as printed.
const PANEL: usize = 240;
const GAIN: f64 = 250.0;
/// The grey of 1, at which the printed extremes of the cubic just fit.
const EVEN: f64 = 0.39;
/// Their splat size, voxels.
const SPLAT: f64 = 1.6;
/// "The polygonal mesh with 3 radial samples and seven azimuth samples": the middle and two rings.
const PRINTED_MESH: Subdivisions = Subdivisions { angles: 7, rings: 2 };

pub(crate) fn write(page: &mut Page<'_>) -> Result<()> {
    page.say("## Crawfis–Max: figures 2 and 4");
    figure_2(page)?;
    figure_4(page)
}

fn radial(kernel: Kernel, extent: Option<f64>) -> Result<RadialKernel> {
    RadialKernel::new(kernel, extent).ok_or_else(|| anyhow!("{} is not radial", kernel.name()))
}

/// The projection of one layer of a unit lattice along z, at a place.
fn layer(kernel: RadialKernel, x: f64, y: f64) -> f64 {
    let mut sum = 0.0;
    for i in -4_i32..=4 {
        for j in -4_i32..=4 {
            sum += kernel.footprint((x - f64::from(i)).hypot(y - f64::from(j)));
        }
    }
    sum
}

/// Relative root mean square deviation of Σ h over space.
fn lattice_deviation(kernel: RadialKernel) -> f64 {
    let steps = 24;
    let place = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
    for i in 0..steps {
        for j in 0..steps {
            for k in 0..steps {
                let mut value = 0.0;
                for n in 0..343 {
                    let at = [n % 7 - 3, n / 7 % 7 - 3, n / 49 - 3].map(f64::from);
                    let d = [place(i) - at[0], place(j) - at[1], place(k) - at[2]];
                    value += kernel.value((d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt());
                }
                sum += value;
                squares += value * value;
                count += 1.0;
            }
        }
    }
    let mean: f64 = sum / count;
    (squares / count - mean * mean).max(0.0).sqrt() / mean
}

fn figure_2(page: &mut Page<'_>) -> Result<()> {
    let kernels = [
        ("optimal cubic, radius 1.556", radial(Kernel::Cubic, None)?),
        ("Gaussian σ 0.6, cut at 2", radial(Kernel::Gaussian, None)?),
        ("the same Gaussian shrunk to radius 1.6", radial(Kernel::Gaussian, Some(SPLAT))?),
    ];
    let gap = 4;
    let width = kernels.len() * (PANEL + gap) - gap;
    let mut rgb = vec![255_u8; width * PANEL * 3];
    let mut rows = Vec::new();
    for (k, (name, kernel)) in kernels.iter().enumerate() {
        let mut least = (f64::INFINITY, [0.0; 2]);
        let mut most = (f64::NEG_INFINITY, [0.0; 2]);
        for row in 0..PANEL {
            for column in 0..PANEL {
                // Two periods; the first and the 1/2 and 1/4 places are met exactly.
                let [x, y] = [column, row].map(|p| p as f64 * 2.0 / PANEL as f64);
                let value = layer(*kernel, x.fract(), y.fract());
                if value < least.0 - 1e-9 {
                    least = (value, [x, y]);
                }
                if value > most.0 + 1e-9 {
                    most = (value, [x, y]);
                }
                let grey = (EVEN + GAIN * (value - 1.0)).clamp(0.0, 1.0);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "0..=1"
                )]
                let byte = (grey * 255.0).round() as u8;
                let at = (row * width + k * (PANEL + gap) + column) * 3;
                rgb[at..at + 3].fill(byte);
            }
        }
        rows.push(vec![
            (*name).to_owned(),
            format!("{:.5} at ({:.2}, {:.2})", most.0, most.1[0], most.1[1]),
            format!("{:.5} at ({:.2}, {:.2})", least.0, least.1[0], least.1[1]),
            format!("{:.5}", lattice_deviation(*kernel)),
        ]);
    }
    rows.push(vec![
        "printed, for the optimal cubic".to_owned(),
        "1.00249 at (.5, .5)".to_owned(),
        "0.99845 at (.25, .25)".to_owned(),
        "0.00119".to_owned(),
    ]);
    write_png(&page.pictures.join("crawfis-max-2.png"), &rgb, [width, PANEL])?;
    page.say(
        "One layer of splats that glow and hide nothing, projected along z: perfectly even would be 1. \
         The last column is the relative root mean square deviation of Σ h in space.",
    );
    page.table(&["kernel", "greatest", "least", "rms deviation in space"], &rows);
    page.figure(
        "crawfis-max-2.png",
        "Crawfis–Max figure 2: 2 × 2 periods of that layer, deviations from 1 magnified 250 times \
         (1 is a grey of 39 %, encoded). Left to right: optimal cubic, Gaussian cut at two voxels, the same Gaussian shrunk to \
         their splat size of 1.6. The last leaves the scale, and the middle one \
         just: black and white are clipped.",
    );
    Ok(())
}

fn figure_4(page: &mut Page<'_>) -> Result<()> {
    const SIZE: u32 = 384;
    const CUT: usize = 300;
    let grid = demo_grid("blobs", 16)?;
    let volume = scalar(&grid)?;
    let opening = scene::opening(SampleSource::default(), volume, grid.space.as_deref());
    // Along an axis, where the lattice shows most.
    let (direction, up) = NamedView::Front.direction_and_up(Orientation::default());
    let mut camera = scene::framing_camera(&opening.lattice(), direction, up);
    camera.parallel_scale *= 0.9;
    let scene = Scene { camera, ..opening };
    let cubic = SplatSettings {
        extent: Some(SPLAT),
        opacity_model: OpacityModel::Published,
        ..SplatSettings::SHADE_FIRST
    };
    let gaussian = SplatSettings { kernel: Kernel::Gaussian, ..cubic };
    let uncut = SplatSettings { extent: None, ..gaussian };
    let exact = page.draw(
        &with(&scene, SplatSettings::EXACT),
        SIZE,
        Refine::Converged { most_slabs: 8.0 },
        0,
    )?;
    let truth = wide(&exact.light);
    let (mut rows, mut panels) = (Vec::new(), Vec::new());
    let named = [
        ("Gouraud mesh, 3 × 7 samples, splat size 1.6", meshed(cubic, PRINTED_MESH)),
        ("Gouraud mesh, 5 × 8 samples, splat size 1.6", meshed(cubic, Subdivisions::default())),
        ("Gaussian splats, splat size 1.6", gaussian),
        ("Gaussian splats as Westover cuts them, 2", uncut),
        ("optimal cubic, splat size 1.6", cubic),
    ];
    for (name, splat) in named {
        let still = page.draw(&with(&scene, splat), SIZE, Refine::Full, 1)?;
        let found = compare(&still, &truth)?;
        rows.push(vec![
            name.to_owned(),
            short(least_ms(&still)),
            format!("{:.4}", found.rmse),
            db(found.psnr()),
        ]);
        panels.push(crop(&still.light, SIZE as usize, CUT, [0.5, 0.5]));
    }
    let panels: Vec<&[[f32; 4]]> = panels.iter().map(Vec::as_slice).collect();
    page.strip("crawfis-max-4.png", &panels, CUT)?;
    page.table(&["splats", "ms", "RMSE to exact", "dB"], &rows);
    page.figure(
        "crawfis-max-4.png",
        "After Crawfis–Max figure 4: `demo:blobs:16`, every sample composited by the published opacity. \
         Of splat size 1.6: the optimal cubic as a Gouraud mesh of as many samples as printed (21 triangles), \
         as the viewer's usual one (56), and a Gaussian; then a Gaussian cut at two voxels, and the optimal \
         cubic of splat size 1.6.",
    );
    let curve = |name: &str, kernel: RadialKernel| -> Curve {
        let points = (0..=180).map(|i| f64::from(i) / 80.0);
        (name.to_owned(), points.map(|l| (l, kernel.footprint(l))).collect())
    };
    let profiles = [
        curve("optimal cubic", radial(Kernel::Cubic, Some(SPLAT))?),
        curve("Gaussian, splat size 1.6", radial(Kernel::Gaussian, Some(SPLAT))?),
        curve("Gaussian, cut at 2", radial(Kernel::Gaussian, None)?),
    ];
    let title = "Footprints";
    let axes = (title, "distance from the middle, voxels", "F");
    charts(
        &page.pictures.join("crawfis-max-profiles.png"),
        &[(axes.0, axes.1, axes.2, &profiles)],
        false,
    )?;
    page.figure("crawfis-max-profiles.png", "The footprints F(l) of the three.");
    page.say(
        "Meshes show their seven-sided outlines and Mach bands, as printed. Theirs took its opacities from a \
         Gaussian; ours are fitted to the cubic's footprint, rings and values, so that they hold as much and lie as \
         near to it as so many triangles can, and only the Gaussian splats show the \"rapid cutoff\". A Gaussian that \
         ends at the splat size of the cubic is uneven (figure 2), \
         and the cubic is not; in pictures of soft blobs a few per cent are hard to see, and the error of all \
         is that of 16³ samples and published opacity. Their data set (a sample of IBM's Data Explorer) is \
         not at hand; the scene is ours. Splats here are evaluated from a polynomial in place of a texture.",
    );
    small_and_large(page)
}

fn meshed(splat: SplatSettings, gouraud: Subdivisions) -> SplatSettings {
    SplatSettings { kernel: Kernel::Gouraud, gouraud, ..splat }
}

/// "For many small scalar texture splats the algorithm is actually faster … As the amount of screen
/// space the splats occupy increases, the performance reverses."
fn small_and_large(page: &mut Page<'_>) -> Result<()> {
    const SIZE: u32 = 512;
    let mut rows = Vec::new();
    for samples in [64, 32, 16, 8, 4] {
        let grid = demo_grid("blobs", samples)?;
        let scene = scene::opening(SampleSource::default(), scalar(&grid)?, grid.space.as_deref());
        let backend = Backend::Raster;
        let splat = SplatSettings { backend, ..SplatSettings::SHADE_FIRST };
        let view = View::new(&with(&scene, splat), [SIZE; 2]);
        let radius = radial(Kernel::Cubic, None)?.radius() * view.voxel_pixels();
        let even = page.draw(&with(&scene, splat), SIZE, Refine::Full, 4)?;
        let mut row = vec![format!("{samples}³"), short(radius), short(least_ms(&even))];
        for gouraud in [PRINTED_MESH, Subdivisions::default()] {
            let mesh = page.draw(&with(&scene, meshed(splat, gouraud)), SIZE, Refine::Full, 4)?;
            row.push(short(least_ms(&mesh)));
            row.push(format!("{:.4}", compare(&mesh, &wide(&even.light))?.rmse));
        }
        rows.push(row);
    }
    page.say(&format!(
        "Small splats against large ones: `demo:blobs` of several sizes, {SIZE} × {SIZE} pixels, every sample \
         by optical depth as triangles. Footprints are evaluated at every pixel; meshes have their opacity at \
         the corners alone, and RMSE is to the picture of footprints.",
    ));
    page.table(
        &[
            "samples",
            "radius, pixels",
            "footprints, ms",
            "mesh 3 × 7, ms",
            "RMSE",
            "mesh 5 × 8, ms",
            "RMSE",
        ],
        &rows,
    );
    page.say(
        "They found meshes slower where splats are many and small, and faster where they are few and large, \
         never by very much. Here the smallest are up to six times slower as meshes, since each triangle has to be set up: \
         `benches/results/splats.md` has the radius at which they catch up.",
    );
    Ok(())
}
