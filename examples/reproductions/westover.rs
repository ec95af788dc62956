//! Westover's Table 4.01 and figures 4.02 and 4.03: three resolutions by three kernels.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use voxsplat::core::Ticket;
use voxsplat::io::{self, OpenOptions};
use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    self, Classify, NamedView, OpacityModel, Orientation, SampleSource, Scene, SplatSettings,
    Visibility,
};
use voxsplat::task::still::Refine;
use voxsplat::transfer::presets;
use voxsplat::volume::ScalarVolume;

use crate::support::{Light, Page, compare, crop, db, demo_grid, least_ms, scalar, short};
use crate::support::{of_field, subsampled, wide, with};

const SIZE: u32 = 512;
/// Pixels of the figures' panels, cut from the pictures.
const PANEL: usize = 288;
/// Every 4th sample along each axis, every 2nd, all: §4.2.3.
const STEPS: [usize; 3] = [4, 2, 1];
const KERNELS: [Kernel; 3] = [Kernel::Point, Kernel::Nearest, Kernel::Gaussian];
/// Seconds printed in Table 4.01, by resolution and kernel.
const PRINTED: [[f64; 3]; 3] = [[0.6, 4.1, 36.9], [1.2, 7.0, 49.6], [4.0, 20.2, 109.2]];
const FOOTPRINTS: [&str; 3] = ["1×1", "3×5", "9×17"];
/// Slabs per voxel beyond which the truth is not refined.
const MOST_SLABS: f64 = 4.0;

/// One of the nine pictures.
struct Cell {
    ms: f64,
    rmse: f64,
    own_db: f64,
    exact_db: f64,
    light: Vec<[f32; 4]>,
}

/// The nine pictures by one opacity model.
struct Nine {
    cells: Vec<Vec<Cell>>,
    active: Vec<u64>,
}

pub(crate) fn write(page: &mut Page<'_>) -> Result<()> {
    page.say("## Westover: Table 4.01, figures 4.02 and 4.03");
    page.say(
        "Westover renders a CT study of a head, 256 × 256 × 93 samples with spacing 1:1:2, into \
         512 × 512 pixels at a scale factor of two, from every fourth, every second and every sample \
         along each axis and with three kernels. (His table calls the three resolutions 32, 64 and \
         128, the text speaks of 256: the two cannot both be right, and the shape does not depend on \
         it.) Here the scan is `demo:head:256`, a head made of formulas, every second slice of it: \
         256 × 256 × 128 with spacing 1:1:2. It is seen from the front at two pixels per voxel, with the \
         bone transfer function.",
    );
    page.say(
        "*Published* is his method: sheets along the axis nearest to the view, opacity α·F, and no \
         correction when samples are left out. *Optical depth* keeps opacity per unit distance, 1 mm, at every resolution.",
    );
    let grid = demo_grid("head", 256)?;
    let volume = subsampled(&*scalar(&grid)?, [1, 1, 2])?;
    let anterior = Orientation::of(grid.space.as_deref());
    let (direction, up) = NamedView::Front.direction_and_up(anterior);
    let seen = Scene::seen_by(scene::framing_camera(&volume.lattice, direction, up));
    let mut scene = of_field(seen, volume, presets::ct_bone());
    two_pixels_a_voxel(&mut scene);
    let published = table(page, &scene, true)?;
    figures(page, &published)?;

    Ok(())
}

/// The same table on a real scan, where the data pack is there.
pub(crate) fn write_scan(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say("## Westover's Table 4.01 on a patient's scan");
    match real_scan(data) {
        Ok(mut scene) => {
            page.say(
                "`scalar/LIDC2.vti` of the data pack: 256 × 256 × 133 samples, spacing 1 : 1 : 1.78, a \
                 chest, with the transfer function it opens with. Numbers alone: no pictures of patients are \
                 published here.",
            );
            two_pixels_a_voxel(&mut scene);
            table(page, &scene, false)?;
        }
        Err(error) => page.say(&format!(
            "Left out: the data pack's `scalar/LIDC2.vti` was not there when this page was made ({error})."
        )),
    }
    Ok(())
}

/// A scale factor of two, with samples over the middles of pixels, where points meet no edge.
fn two_pixels_a_voxel(scene: &mut Scene) {
    let spacing = scene.lattice().smallest_spacing();
    scene.camera.parallel_scale = f64::from(SIZE) / 4.0 * spacing;
    let (right, up) = (scene.camera.right(), scene.camera.up);
    scene.camera.focal_point += (right + up) * (0.25 * spacing);
}

fn real_scan(data: &Path) -> Result<Scene> {
    let path = data.join("scalar/LIDC2.vti");
    let grid = io::open(&path, &OpenOptions::default(), &Ticket::new())
        // Its place on this machine is nobody's business.
        .map_err(|_| anyhow::anyhow!("it could not be opened"))?
        .grid;
    let volume = scalar(&grid)?;
    let source = SampleSource::default();
    let mut scene = scene::opening(source, Arc::clone(&volume), grid.space.as_deref());
    let (direction, up) = NamedView::Front.direction_and_up(Orientation::of(grid.space.as_deref()));
    scene.camera = scene::framing_camera(&volume.lattice, direction, up);
    Ok(scene)
}

/// The table, and where asked for the nine pictures by the published method.
fn table(page: &mut Page<'_>, scene: &Scene, first: bool) -> Result<Vec<Vec<Cell>>> {
    let unit = scene.lattice().smallest_spacing();
    // What his method approximates: the same Gaussians, shaded first; and the exact picture.
    let own = SplatSettings {
        kernel: Kernel::Gaussian,
        visibility: Visibility::Slabs,
        opacity_unit_distance: Some(unit),
        ..SplatSettings::SHADE_FIRST
    };
    let exact = SplatSettings { opacity_unit_distance: Some(unit), ..SplatSettings::EXACT };
    let mut truths = Vec::new();
    let mut words = Vec::new();
    for splat in [own, exact] {
        let still =
            page.draw(&with(scene, splat), SIZE, Refine::Converged { most_slabs: MOST_SLABS }, 0)?;
        if let Some(reached) = &still.convergence {
            words.push(format!(
                "{} slabs per voxel, last change {:.1e}",
                reached.slabs_per_voxel,
                reached.last_difference.unwrap_or(1.0)
            ));
        }
        truths.push(wide(&still.light));
    }
    let whole = scene.volume().context("it has a field")?;
    let volumes: Vec<Arc<ScalarVolume>> =
        STEPS.iter().map(|&s| subsampled(whole, [s; 3])).collect::<Result<_>>()?;
    let nine = |opacity_model| nine(page, scene, &volumes, opacity_model, &truths);
    let published = nine(OpacityModel::Published)?;
    let optical = nine(OpacityModel::OpticalDepth)?;
    let mut rows = Vec::new();
    for (r, step) in STEPS.iter().enumerate() {
        for (k, kernel) in KERNELS.iter().enumerate() {
            let (a, b) = (&published.cells[r][k], &optical.cells[r][k]);
            let whole = &published.cells[2][2];
            rows.push(vec![
                format!("1/{step}"),
                kernel.name().to_owned(),
                FOOTPRINTS[k].to_owned(),
                format!("{:.1} ({:.3})", PRINTED[r][k], PRINTED[r][k] / PRINTED[2][2]),
                format!("{} ({:.3})", short(a.ms), a.ms / whole.ms),
                format!("{:.4}", a.rmse),
                db(a.own_db),
                db(a.exact_db),
                short(b.ms),
                format!("{:.4}", b.rmse),
                db(b.own_db),
                db(b.exact_db),
            ]);
        }
    }
    page.table(
        &[
            "resolution",
            "kernel",
            "his footprint at full resolution, pixels",
            "his seconds (÷ last)",
            "published: ms (÷ last)",
            "RMSE, own",
            "dB, own",
            "dB, exact",
            "optical depth: ms",
            "RMSE, own",
            "dB, own",
            "dB, exact",
        ],
        &rows,
    );
    let active: Vec<String> = published.active.iter().map(u64::to_string).collect();
    let share = 100.0 * published.active[2] as f64 / scene.lattice().len() as f64;
    page.say(&format!(
        "*own*: against the picture, refined as far as stated, of his own model, Gaussians shaded first, every sample \
         ({}). *exact*: against the like picture of values interpolated by cubic B-splines and \
         classified after that ({}). Kernels drawn at the three resolutions: {}; {share:.1} % of \
         the full scan have opacity (his head: 8.8 %). Times are the lesser of two frames.",
        words[0],
        words[1],
        active.join(", "),
    ));
    if first {
        let t = |r: usize, k: usize| published.cells[r][k].ms;
        let most = |row: usize| t(row, 2) / t(row, 0);
        page.say(&format!(
            "**The shape.** Down the table (more samples) and along it (larger footprints) both cost and \
             quality are meant to rise. His Gaussian costs {:.0} times his point at full resolution, ours \
             {:.1} times; his full resolution costs {:.1} times the quarter's with the Gaussian, ours \
             {:.1} times. His renderer pays for every pixel of every footprint in turn. Ours gathers each \
             pixel's kernels from the lattice, sheet by sheet, so that part of its time goes with pixels \
             and sheets whatever the kernel, which flattens the range between kernels. Where thinned scans \
             are drawn, each kernel covers four or two times as many pixels across (his 9×17 stands in all \
             three rows of his table, which cannot be so if the picture keeps its size), so eight times \
             fewer samples are not eight times cheaper: in his table neither.",
            PRINTED[2][2] / PRINTED[2][0],
            most(2),
            PRINTED[2][2] / PRINTED[0][2],
            t(2, 2) / t(0, 2),
        ));
    }
    Ok(published.cells)
}

fn nine(
    page: &Page<'_>,
    scene: &Scene,
    volumes: &[Arc<ScalarVolume>],
    opacity_model: OpacityModel,
    truths: &[Light],
) -> Result<Nine> {
    let unit = scene.lattice().smallest_spacing();
    let transfer = scene.transfer().context("it has a field")?;
    let (mut cells, mut active) = (Vec::new(), Vec::new());
    for volume in volumes {
        let mut row = Vec::new();
        let mut count = 0;
        for kernel in KERNELS {
            let splat = SplatSettings {
                kernel,
                visibility: Visibility::Sheets,
                classify: Classify::Before,
                opacity_model,
                // Published opacities belong to samples, however far apart.
                opacity_unit_distance: (opacity_model == OpacityModel::OpticalDepth)
                    .then_some(unit),
                ..SplatSettings::SHADE_FIRST
            };
            let scene = of_field(with(scene, splat), Arc::clone(volume), transfer.clone());
            let still = page.draw(&scene, SIZE, Refine::Full, 1)?;
            count = still.kernels_active;
            let own = compare(&still, &truths[0])?;
            row.push(Cell {
                ms: least_ms(&still),
                rmse: own.rmse,
                own_db: own.psnr(),
                exact_db: compare(&still, &truths[1])?.psnr(),
                light: still.light,
            });
        }
        cells.push(row);
        active.push(count);
    }
    Ok(Nine { cells, active })
}

fn figures(page: &mut Page<'_>, cells: &[Vec<Cell>]) -> Result<()> {
    let panels = |places: [(usize, usize); 3]| {
        places.map(|(r, k)| crop(&cells[r][k].light, SIZE as usize, PANEL, [0.5, 0.45]))
    };
    let write = |name: &str, panels: &[Vec<[f32; 4]>; 3]| {
        let panels: Vec<&[[f32; 4]]> = panels.iter().map(Vec::as_slice).collect();
        page.strip(name, &panels, PANEL)
    };
    write("westover-4.02.png", &panels([(2, 0), (2, 1), (2, 2)]))?;
    write("westover-4.03.png", &panels([(0, 2), (1, 2), (2, 2)]))?;
    page.figure(
        "westover-4.02.png",
        "Westover's figure 4.02, cut from the pictures pixel for pixel: single point, nearest \
         neighbour, Gaussian, by the published method. At a scale factor of two points leave holes \
         between them (one pixel of two across, one of four up), boxes are blocks, Gaussians are neither.",
    );
    page.figure(
        "westover-4.03.png",
        "Westover's figure 4.03: every fourth sample, every second, every sample, Gaussians, by the \
         published method. Thinning turns fine detail into rings and blotches: aliases.",
    );
    Ok(())
}
