//! Jang and others: fields as basis functions, their tables and figures 7 to 13 in kind.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use voxsplat::accuracy::psnr_from_rmse;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::io::{self, Encoded, OpenOptions};
use voxsplat::rbf::{Basis, Encoding, Errors, Goal, Points, encode};
use voxsplat::scene::{
    Classify, Isosurface, Lighting, SampleSource, Scene, Slice, SplatSettings, opening,
};
use voxsplat::task::encode::{Asked, Wanted, encode_field, residual};
use voxsplat::task::still::Refine;
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction, presets};
use voxsplat::volume::{Component, Grid, ScalarVolume, Shape};

use crate::support::{
    Page, compare, crop, db, demo_grid, least_ms, on_black, scalar, short, subsampled, wide, with,
    with_transfer,
};

/// The paper's pictures, pixels.
const SIZE: u32 = 400;
/// Pixels of the pictures here.
const PANEL: usize = 240;
/// Of neghip and of the blunt fin, in the paper.
const PRINTED: [usize; 2] = [812, 695];
/// What figure 10 in kind is encoded by.
const FEW: [usize; 3] = [30, 120, 480];
const FRAMES: u32 = 8;

pub(crate) fn write(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say("## Jang: basis functions");
    table_of_fits(page, data)?;
    let neghip = neghip(data)?;
    let (_, encoded) = fitted(&neghip, PRINTED[0])?;
    modes(page, &scene_of(&neghip, &encoded)?)?;
    unseen(page, &scene_of(&neghip, &encoded)?)?;
    figures(page)
}

/// A scan as it opens.
fn neghip(data: &Path) -> Result<Grid> {
    let path = data.join("scalar/neghip/neghip_64x64x64_uint8.raw");
    let opened = io::open(&path, &OpenOptions::default(), &Ticket::new())?;
    Ok(opened.grid)
}

/// Functions of a grid's first field, so many, and the seconds that took.
fn fitted(grid: &Grid, functions: usize) -> Result<(f64, Encoded)> {
    let asked = Asked {
        basis: Basis::Ellipsoid,
        max_error: Some(Wanted::Percent(0.01)),
        mean_error: None,
        bytes: None,
        functions,
        favour: None,
    };
    let what = (grid, grid.field(None)?, Component::Index(0));
    let start = Instant::now();
    let go_on = |_| ControlFlow::Continue(());
    let encoded = encode_field(what, "neghip", asked, None, &Ticket::new(), go_on)?;
    Ok((start.elapsed().as_secs_f64(), encoded))
}

/// A field with its functions, as it opens, in these.
fn scene_of(grid: &Grid, encoded: &Encoded) -> Result<Scene> {
    let functions = Some(Arc::new(encoded.encoding.clone()));
    let volume = ScalarVolume { functions, ..(*scalar(grid)?).clone() };
    let scene = opening(SampleSource::default(), Arc::new(volume), grid.space.as_deref());
    Ok(with(&scene, SplatSettings::FUNCTIONS))
}

/// One line of the table of fits.
fn fit(points: &Points, basis: Basis, functions: usize) -> Result<(Encoding, Errors, f64)> {
    let start = Instant::now();
    let goal = Goal { basis, max_error: 0.0, mean_error: f64::INFINITY, functions };
    let encoding = encode(points, goal, &Ticket::new(), |_| ControlFlow::Continue(()))?;
    let took = start.elapsed().as_secs_f64();
    let errors = encoding.errors(points, &Ticket::new())?;
    Ok((encoding, errors, took))
}

/// Places and values of a volume's samples.
fn points_of(volume: &ScalarVolume) -> Points {
    let [nx, ny, _] = volume.lattice.dims;
    Points::new((0..volume.samples.len()).map(|i| {
        let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
        (volume.lattice.world_from_index(DVec3::from(at)), volume.samples.get(i))
    }))
}

/// The density of the blunt fin at the points of its curvilinear grid.
fn blunt_fin(data: &Path) -> Result<Points> {
    let path = data.join("unstructured/bluntfin/bluntfinxyz.bin");
    let grid = io::open(&path, &OpenOptions::default(), &Ticket::new())?.grid;
    let density = Arc::clone(&grid.field(Some("Density"))?.samples);
    let Shape::Curvilinear(places) = grid.shape else {
        bail!("the blunt fin's grid is {}", grid.shape.name())
    };
    Ok(Points::new(places.iter().enumerate().map(|(i, place)| (*place, density.get(i)))))
}

fn table_of_fits(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say(
        "The paper encodes neghip by 812 functions, and the blunt fin's curvilinear grid by 695, and prints no error beside \
         them. Ours by as many, spheres as printed and ellipsoids; errors are at all samples, in % of the range of values. \
         Its shock and oil reservoir are not at hand: nothing stands for them here.",
    );
    let neghip = scalar(&neghip(data)?)?;
    let halved = subsampled(&neghip, [2; 3])?;
    let fields = [
        ("neghip, 32³", points_of(&halved), PRINTED[0]),
        ("neghip, 64³", points_of(&neghip), PRINTED[0]),
        ("blunt fin, 40 × 32 × 32 curvilinear", blunt_fin(data)?, PRINTED[1]),
    ];
    let mut rows = Vec::new();
    for (name, points, printed) in &fields {
        let values = points.values();
        let [low, high] = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
        for basis in [Basis::Gaussian, Basis::Ellipsoid] {
            let (encoding, errors, took) = fit(points, basis, *printed)?;
            let percent = |error: f64| short(100.0 * error / (high - low));
            rows.push(vec![
                (*name).to_owned(),
                basis.name().to_owned(),
                encoding.functions().len().to_string(),
                encoding.cells().to_string(),
                percent(errors.max),
                percent(errors.mean),
                short(took),
            ]);
        }
    }
    let head = ["field", "functions", "number", "cells", "greatest, %", "mean, %", "encoded in, s"];
    page.table(&head, &rows);
    Ok(())
}

/// Slices, slabs and splats of the functions: errors to their limit, and times.
fn modes(page: &mut Page<'_>, scene: &Scene) -> Result<()> {
    page.say(&format!(
        "Drawing modes: neghip by {} ellipsoids at {SIZE} × {SIZE} as in the paper, against the limit that all of them have, \
         each as dB and as pictures a second. *Slices* colour the value in the middle of each slab, as the paper does; *splats* \
         add each function's integral to the slabs that it reaches, and colour the mean: what the paper thought impossible \
         for functions that overlap; *slabs* colour all values between their faces. The paper had 0.4 to 3.7 pictures a second \
         of volumes. Below, the order of each: by how much the error falls where slabs are halved.",
        PRINTED[0]
    ));
    let limit_mode = SplatSettings { slabs_per_voxel: 32.0, ..scene.splat };
    let limit = wide(&page.draw(&with(scene, limit_mode), SIZE, Refine::Full, 0)?.light);
    let ways = [
        ("slices", Classify::After),
        ("splats", Classify::Mean),
        ("slabs", Classify::PreIntegrated),
    ];
    let counts = [0.5, 1.0, 2.0, 4.0, 8.0];
    let mut rows = Vec::new();
    let mut errors = vec![Vec::new(); ways.len()];
    for slabs_per_voxel in counts {
        let mut row = vec![slabs_per_voxel.to_string()];
        for ((_, classify), errors) in ways.iter().zip(&mut errors) {
            let mode = SplatSettings { slabs_per_voxel, classify: *classify, ..scene.splat };
            let still = page.draw(&with(scene, mode), SIZE, Refine::Full, FRAMES)?;
            let rmse = compare(&still, &limit)?.rmse;
            errors.push(rmse);
            row.push(format!("{} · {}", db(psnr_from_rmse(rmse)), short(1e3 / least_ms(&still))));
        }
        rows.push(row);
    }
    let mut orders = vec!["order".to_owned()];
    orders.extend(errors.iter().map(|errors| {
        let halvings: Vec<String> =
            errors.windows(2).map(|pair| format!("{:.1}", (pair[0] / pair[1]).log2())).collect();
        halvings.join(", ")
    }));
    rows.push(orders);
    let mut head = vec!["slabs a voxel"];
    head.extend(ways.iter().map(|(name, _)| *name));
    page.table(&head, &rows);
    Ok(())
}

/// Transfer functions that the encoder has not seen.
fn unseen(page: &mut Page<'_>, scene: &Scene) -> Result<()> {
    page.say(
        "The encoder knows nothing of transfer functions: functions are summed up first, and coloured afterwards. Ten that no \
         fit has seen, thin layers and ramps; dB of the functions' picture to that of the samples by interpolating splines.",
    );
    let volume = scene.volume().context("a field")?;
    let (low, high) = (volume.statistics.min, volume.statistics.max);
    let at = |share: f64| low + share * (high - low);
    let mut row = Vec::new();
    for i in 0..10 {
        let middle = 0.08 + 0.09 * f64::from(i);
        let width = if i % 2 == 0 { 0.04 } else { 0.15 };
        let opacity = match i % 3 {
            0 => vec![(at(middle - width), 0.0), (at(middle), 0.6), (at(middle + width), 0.0)],
            1 => vec![(at(middle), 0.0), (at(middle + width), 0.3), (at(1.0), 0.3)],
            _ => vec![(at(0.05), 0.0), (at(middle), 0.05), (at(1.0), 0.4)],
        };
        let colour = ColourSource::Map { map: ColourMap::Viridis, range: [low, high] };
        let scene = with_transfer(scene.clone(), TransferFunction::of(opacity, colour));
        let found = page.draw(&scene, SIZE, Refine::Full, 0)?;
        let samples = with(&scene, SplatSettings::EXACT);
        let truth = wide(&page.draw(&samples, SIZE, Refine::Full, 0)?.light);
        row.push(db(psnr_from_rmse(compare(&found, &truth)?.rmse)));
    }
    let head: Vec<String> = (1..=10).map(|i| i.to_string()).collect();
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &[row]);
    Ok(())
}

/// Pictures of a field made in code: the samples, fewer and more functions; what these leave; planes and isosurfaces.
fn figures(page: &mut Page<'_>) -> Result<()> {
    let grid = demo_grid("blobs", 48)?;
    let what = (&grid, grid.field(None)?, Component::Index(0));
    let volume = scalar(&grid)?;
    let mut plain = opening(SampleSource::default(), Arc::clone(&volume), grid.space.as_deref());
    plain.camera.parallel_scale *= 0.8;
    let middle = f64::midpoint(volume.statistics.min, volume.statistics.max);
    // As volume, lit; as an isosurface with its analytic normals; and on planes.
    let lit = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.shading.lighting = Some(Lighting::first_look());
        scene
    };
    let surface = |scene: &Scene| {
        let mut scene = lit(scene);
        if let Some(transfer) = scene.transfer_mut() {
            transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
        }
        let colour = Some(Srgb8([226, 196, 150]));
        scene.inside.isosurfaces = vec![Isosurface { value: middle, opacity: 1.0, colour }];
        scene
    };
    let planes = |scene: &Scene| {
        let mut scene = scene.clone();
        let lattice = scene.lattice();
        if let Some(transfer) = scene.transfer_mut() {
            transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
        }
        let slice = |axis| Slice::across(&lattice, axis, 0.5, 1.0);
        scene.inside.slices = [0, 1, 2].map(slice).to_vec();
        scene
    };
    let mut scenes = vec![plain.clone()];
    let mut told = Vec::new();
    let mut left = None;
    for count in FEW {
        let (_, encoded) = fitted(&grid, count)?;
        let range = volume.statistics.max - volume.statistics.min;
        told.push(format!(
            "{} ({:.1} %)",
            encoded.encoding.functions().len(),
            100.0 * encoded.errors.max / range
        ));
        let functions = Some(Arc::new(encoded.encoding.clone()));
        let volume = Arc::new(ScalarVolume { functions, ..(*volume).clone() });
        let mut scene = with(&plain, SplatSettings::FUNCTIONS);
        scene.set_volume(volume);
        scenes.push(scene);
        if count == FEW[1] {
            left = Some(residual(what, &encoded.encoding, &Ticket::new())?);
        }
    }
    let mut rows = Vec::new();
    for look in [&lit as &dyn Fn(&Scene) -> Scene, &surface, &planes] {
        let mut row = Vec::new();
        for scene in &scenes {
            let still = page.draw(&look(scene), SIZE, Refine::Full, 0)?;
            row.push(on_black(&crop(&still.light, SIZE as usize, PANEL, [0.5; 2])));
        }
        rows.push(row);
    }
    page.mosaic("jang_figures.png", &rows, PANEL)?;
    page.figure(
        "jang_figures.png",
        &format!(
            "blobs, 48³: the samples by splines, and {} ellipsoids, with their greatest error; lit volumes, an isosurface with \
             analytic normals, and cutting planes.",
            told.join(", ")
        ),
    );
    let left = left.context("a residual")?;
    let grid = Grid { fields: vec![left], ..grid };
    let volume = scalar(&grid)?;
    let differences = presets::of_differences(&volume.statistics);
    let mut scene = plain;
    scene.set_volume(volume);
    let scene = with_transfer(scene, differences);
    let panels: Vec<Vec<[f32; 4]>> = [scene.clone(), planes(&scene)]
        .iter()
        .map(|scene| {
            let still = page.draw(scene, SIZE, Refine::Full, 0)?;
            Ok(crop(&still.light, SIZE as usize, PANEL, [0.5; 2]))
        })
        .collect::<Result<_>>()?;
    let panels: Vec<&[[f32; 4]]> = panels.iter().map(Vec::as_slice).collect();
    page.strip("jang_residual.png", &panels, PANEL)?;
    page.figure(
        "jang_residual.png",
        &format!(
            "What {} functions leave of it, in space and on planes: blue where they are too much.",
            told[1]
        ),
    );
    Ok(())
}
