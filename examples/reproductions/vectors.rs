//! Crawfis and Max, figures 3 and 5 to 8: vectors as moving marks.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::polygons::{Paint, Shapes};
use voxsplat::scene::{
    self, Backend, Classify, PolygonLayer, Reconstruction, SampleSource, Scene, SplatSettings,
    VectorLayer,
};
use voxsplat::task::still::Refine;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction};
use voxsplat::vector::{
    ColourBy, Design, FORESHORTENINGS, Marks, Seen, VectorMode, VectorSettings,
};
use voxsplat::volume::{Grid, VectorField};
use voxsplat::{core::Camera, io};

use crate::support::{Page, demo_grid, least_ms, of_field, on_black, scalar, short, with_transfer};

/// Pixels a side of a figure's panel, and of a picture of the table.
const PANEL: u32 = 300;
const TILE: usize = 48;
/// Pictures a second that an animation aims at.
const AIM: f64 = 20.0;

pub(crate) fn write(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say("## Crawfis–Max: vectors, figures 3 and 5 to 8");
    figure_3(page)?;
    figures(page)?;
    climate(page, data)?;
    costs(page, data)
}

/// Portions of the table: twelve foreshortenings across, every fourth phase down.
fn figure_3(page: &mut Page<'_>) -> Result<()> {
    let kernel = voxsplat::kernel::RadialKernel::new(voxsplat::kernel::Kernel::Cubic, None)
        .context("the cubic is radial")?;
    let rows: Vec<Vec<Vec<u8>>> = Design::ALL
        .iter()
        .flat_map(|&design| {
            let marks = Marks::new(design);
            [0, 4, 8].map(|phase| {
                let panel = |column: usize| {
                    let across = column as f64 / (FORESHORTENINGS - 1) as f64;
                    let pixels = (0..TILE * TILE).flat_map(|i| {
                        let place = [i % TILE, i / TILE]
                            .map(|n| (2.0 * n as f64 + 1.0) / TILE as f64 - 1.0);
                        let l = place[0].hypot(place[1]) * kernel.radius();
                        let window = kernel.footprint(l) / kernel.footprint(0.0);
                        let phase = f64::from(phase) / 16.0;
                        let light = marks.intensity(0, place, phase, Seen::Across(across));
                        let byte = (255.0 * (light * window).clamp(0.0, 1.0)).round() as u8;
                        [byte, byte, byte, 255]
                    });
                    pixels.collect()
                };
                (0..FORESHORTENINGS).rev().map(panel).collect()
            })
        })
        .collect();
    page.mosaic("marks.png", &rows, TILE)?;
    page.figure(
        "marks.png",
        "Figure 3 in kind: the intensities of streaks, dots and comets, three rows each a quarter of a \
         cycle apart; from left to right across the view to straight at the eye, windowed by the kernel",
    );
    Ok(())
}

fn vectors(grid: &Grid, name: &str) -> Result<Arc<VectorField>> {
    Ok(Arc::new(grid.vectors(grid.field(Some(name))?, &Ticket::new())?))
}

/// The tornado with its condensation, seen a little from above.
fn tornado(size: usize) -> Result<Scene> {
    let grid = demo_grid("tornado", size)?;
    let volume = scalar(&grid)?;
    let field = vectors(&grid, "velocity")?;
    let mut scene = scene::opening(SampleSource::default(), volume, None);
    let lattice = scene.lattice();
    let camera = scene::framing_camera(&lattice, DVec3::new(-0.4, 0.9, -0.25), DVec3::Z);
    scene.camera = Camera { parallel_scale: 0.95 * camera.parallel_scale, ..camera };
    Ok(alone(scene.with(VectorLayer::new(field))))
}

/// Vectors without the field.
fn alone(mut scene: Scene) -> Scene {
    scene.show_field(false);
    scene
}

/// Vectors beside the field.
fn beside(mut scene: Scene) -> Scene {
    scene.show_field(true);
    scene
}

fn with(scene: &Scene, change: impl Fn(&mut VectorSettings)) -> Scene {
    let mut scene = scene.clone();
    scene.vectors_mut().into_iter().for_each(|(_, settings)| change(settings));
    scene
}

fn map(opacity: Vec<(f64, f64)>, map: ColourMap, range: [f64; 2]) -> TransferFunction {
    TransferFunction::of(opacity, ColourSource::Map { map, range })
}

fn figures(page: &mut Page<'_>) -> Result<()> {
    let opening = tornado(64)?;
    let fifth = with(&opening, |s| {
        s.transfer = map(vec![(0.5, 0.0), (2.2, 0.9)], ColourMap::Lajolla, [-1.0, 3.0]);
    });
    let sixth = with(&opening, |s| {
        s.stretch = 6.0;
        s.design = Design::Comets;
    });
    let seventh = with(&opening, |s| {
        s.mode = VectorMode::Blend;
        s.marks = Some(Srgb8::WHITE);
        s.transfer = map(vec![(0.6, 0.0), (2.5, 0.12)], ColourMap::Viridis, [0.4, 2.4]);
    });
    let fibres = fibres(&seventh)?;
    let seventh = seventh.with(fibres);
    let eighth = with(&opening, |s| {
        s.opacity_by = ColourBy::Scalar;
        s.colour_by = ColourBy::Z;
        s.transfer = map(vec![(0.15, 0.0), (0.5, 0.9)], ColourMap::Roma, [-1.0, 1.0]);
    });
    let cloud = map(vec![(0.1, 0.0), (1.0, 0.06)], ColourMap::Gray, [-0.5, 0.8]);
    let eighth = with_transfer(beside(eighth), cloud);
    let scenes = [
        ("5", "tornado: length of the wind as opacity, browns", fifth),
        ("6", "stretched comets, opacity and colour by length", sixth),
        ("7", "BLEND: white marks in matter coloured by length, and polygons in it", seventh),
        ("8", "cloud, and its winds alone, coloured by height", eighth),
    ];
    let (mut panels, mut rows) = (Vec::new(), Vec::new());
    for (figure, words, scene) in &scenes {
        let still = page.draw(scene, PANEL, Refine::Full, 0)?;
        panels.push(on_black(&still.light));
        rows.push(vec![
            (*figure).to_owned(),
            (*words).to_owned(),
            still.drawn.kernels.to_string(),
            format!("{} ms", short(least_ms(&still))),
        ]);
    }
    page.mosaic("vectors.png", &[panels], PANEL as usize)?;
    page.figure(
        "vectors.png",
        "Figures 5 to 8 in kind, of a tornado made in code: dummy data and climate were the paper's",
    );
    page.table(&["figure", "what", "splats (and voxels)", "300 × 300"], &rows);
    Ok(())
}

/// Winds of a reanalysis, as theirs were of a climate's model, seen from above.
const CLIMATE: &str = "vector/eraint_uvz.nc";

/// Figures 6 and 8 of real winds: numbers, and what draws them.
fn climate(page: &mut Page<'_>, data: &Path) -> Result<()> {
    let path = data.join(CLIMATE);
    if !path.exists() {
        page.say(&format!("(`{CLIMATE}` is not here, and so not drawn.)"));
        return Ok(());
    }
    let opened = io::open(&path, &io::OpenOptions::default(), &Ticket::new())?;
    let grid = &opened.grid;
    let field = grid.field(Some("z[month=1]"))?;
    let volume = grid.scalar(field, voxsplat::volume::Component::Index(0), &Ticket::new())?;
    let mut scene = scene::opening(SampleSource::default(), Arc::new(volume), None);
    let camera = scene::framing_camera(&scene.lattice(), -DVec3::Z, DVec3::Y);
    scene.camera = Camera { parallel_scale: 92.0, ..camera };
    let mut layer = VectorLayer::new(vectors(grid, "(u, v)[month=1]")?);
    layer.settings.stretch = 3.0;
    let range = [0.0, 80.0];
    layer.settings.transfer = map(vec![(15.0, 0.0), (45.0, 0.9)], ColourMap::Viridis, range);
    let sixth = alone(scene.with(layer));
    let eighth = with(&sixth, |s| {
        s.colour_by = ColourBy::Z;
        s.transfer = map(vec![(15.0, 0.0), (45.0, 0.9)], ColourMap::Roma, [-1.0, 1.0]);
    });
    let matter = map(vec![(4e4, 0.05), (1.2e5, 0.0)], ColourMap::Gray, [0.0, 8e4]);
    let mut eighth = with_transfer(beside(eighth), matter);
    // Levels are 30 steps of the grid apart: each splat lies in many slabs, more than software adapters walk.
    eighth.splat.slabs_per_voxel = 0.5;
    let mut rows = Vec::new();
    for (figure, words, scene) in [
        ("6", "jet streams of January, stretched, opacity and colour by length", sixth),
        (
            "8",
            "geopotential as matter, the same winds coloured by level, slabs of two steps",
            eighth,
        ),
    ] {
        let still = page.draw_sized(&scene, [600, 310], Refine::Full, 1)?;
        let light = still.light.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
        rows.push(vec![
            figure.to_owned(),
            words.to_owned(),
            still.drawn.kernels.to_string(),
            format!("{:.0} %", 100.0 * light / still.light.len() as f64),
            format!("{} ms", short(least_ms(&still))),
        ]);
    }
    page.say(
        "Figures 6 and 8 of real winds, ERA-Interim's at 200, 500 and 850 millibars (`eraint_uvz.nc`, \
         480 × 241 × 3, whose licence its source does not state: numbers alone). `voxsplat render \
         eraint_uvz.nc --vector \"(u, v)[month=1]\" --vectors-only --vector-stretch 3 --vector-opacity \
         15:0,45:0.9 --camera-direction 0,0,-1 --camera-view-up 0,1,0 --parallel-scale 92 --resolution \
         1200,620 --output jets.png` draws the first: jet streams that meander over Asia and the Pacific.",
    );
    page.table(&["figure", "what", "splats (and voxels)", "opacity", "600 × 310"], &rows);
    Ok(())
}

fn costs(page: &mut Page<'_>, data: &Path) -> Result<()> {
    let mut rows = Vec::new();
    for size in [32, 64, 128] {
        let scene = with(&tornado(size)?, |s| s.coarser = 0);
        rows.push(timed(page, &format!("tornado {size}³"), &scene)?);
    }
    for (file, name) in [("vector/office.binary.vtk", "vectors"), ("vector/carotid.vtk", "vectors")]
    {
        let path = data.join(file);
        if !path.exists() {
            page.say(&format!("(`{file}` is not here, and so not in the table.)"));
            continue;
        }
        let opened = io::open(&path, &io::OpenOptions::default(), &Ticket::new())?;
        let volume = scalar(&opened.grid)?;
        let scene = scene::opening(SampleSource::default(), volume, None);
        let scene = alone(scene.with(VectorLayer::new(vectors(&opened.grid, name)?)));
        rows.push(timed(page, file, &scene)?);
    }
    page.say(&format!(
        "Vectors alone at 1280 × 800 pixels: every one of the tornado's, the files' as they open (fine \
         grids as means of eight), and what is drawn within {:.0} ms, \
         enlarged, while they move ({AIM} pictures a second). The difference is to the full picture.",
        1000.0 / AIM
    ));
    page.table(
        &["vectors", "that show", "full", "quick at", "quick", "RMSE of 255", "PSNR"],
        &rows,
    );
    // The paper's penalty of a vector splat: half as much again.
    let winds = with(&tornado(32)?, |s| s.coarser = 0);
    let marked = page.draw(&winds, 512, Refine::Full, 2)?;
    let layer = winds.vectors().into_iter().next().context("it has vectors")?;
    let magnitude = demo_grid("tornado", 32)?;
    let field = magnitude.field(Some("speed"))?;
    let volume = magnitude.scalar(field, voxsplat::volume::Component::Index(0), &Ticket::new())?;
    let mut shaded = of_field(winds, Arc::new(volume), layer.settings.transfer);
    shaded.splat = SplatSettings {
        kernel: voxsplat::kernel::Kernel::Cubic,
        classify: Classify::Before,
        reconstruction: Reconstruction::Smooth,
        backend: Backend::Tiles,
        ..SplatSettings::EXACT
    };
    let plain = page.draw(&shaded, 512, Refine::Full, 2)?;
    page.say(&format!(
        "A vector splat against a scalar one, the same 32³ grid and opacities in slabs of 512 × 512 pixels: \
         {} ms with lists and marks, {} ms gathered without ({:+.0} %; the paper: +50 % for its matrices).",
        short(least_ms(&marked)),
        short(least_ms(&plain)),
        (least_ms(&marked) / least_ms(&plain) - 1.0) * 100.0
    ));
    Ok(())
}

/// Fibres through a scene, as the paper's gel has them, from side to side.
fn fibres(scene: &Scene) -> Result<PolygonLayer> {
    let (centre, reach) = (scene.lattice().centre(), scene.lattice().bounding_radius());
    let mut shapes = Shapes::default();
    for i in 0..12 {
        // Any angles that are not alike.
        let (a, b) = (f64::from(i) * 2.4, f64::from(i) * 1.7 + 0.9);
        let off = DVec3::new(b.cos(), b.sin(), 0.8 * (3.1 * b).sin()) * (0.3 * reach);
        let along =
            DVec3::new(a.cos(), a.sin(), 0.4 * (2.3 * a).cos()).normalize() * (0.65 * reach);
        let fibre = [centre + off - along, centre + off + along];
        let paint = Paint { colour: Srgb8([240, 190, 120]), number: 0.0 };
        shapes.tube(&fibre.map(|place| (place, paint)), 0.02 * reach);
    }
    Ok(PolygonLayer::new(Arc::new(shapes.mesh("fibres", "number")?)))
}

/// A row of the table of costs.
fn timed(page: &Page<'_>, name: &str, scene: &Scene) -> Result<Vec<String>> {
    let size = [1280, 800];
    let full = page.draw_sized(scene, size, Refine::Full, 1)?;
    let quick = page.draw_sized(scene, size, Refine::Budget { budget_ms: 1000.0 / AIM }, 2)?;
    let difference = crate::support::compare(&quick, &crate::support::wide(&full.light))?;
    let [width, height] = quick.drawn.size;
    Ok(vec![
        name.to_owned(),
        full.drawn.kernels.to_string(),
        format!("{} ms", short(least_ms(&full))),
        format!("{width} × {height}"),
        format!("{} ms", short(least_ms(&quick))),
        short(difference.rmse * 255.0),
        format!("{} dB", crate::support::db(-20.0 * difference.rmse.log10())),
    ])
}
