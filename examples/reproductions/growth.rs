//! How time grows with kernels, pixels and slabs.

use anyhow::Result;
use voxsplat::kernel::Kernel;
use voxsplat::scene::{self, SampleSource, Scene, SplatSettings, Visibility};
use voxsplat::task::still::Refine;
use voxsplat::transfer::presets;

use crate::support::{
    Curve, Page, Straight, charts, demo_grid, least_ms, scalar, short, with, with_transfer,
};

/// Frames of which the least counts.
const REPEAT: u32 = 2;

fn head(size: usize) -> Result<Scene> {
    let grid = demo_grid("head", size)?;
    let source = SampleSource::default();
    let scene = scene::opening(source, scalar(&grid)?, grid.space.as_deref());
    Ok(with_transfer(scene, presets::ct_bone()))
}

pub(crate) fn write(page: &mut Page<'_>) -> Result<()> {
    page.say("## How cost grows");
    page.say(
        "`demo:head` with the bone transfer function from its opening view, milliseconds, the least of \
         three frames each. *Splatted*: every sample by optical depth, the optimal cubic. *Slabs, shaded \
         first*: the same kernels in image-aligned slabs. *Exact mode*: interpolating B-splines, \
         pre-integrated.",
    );
    let splatted = SplatSettings::SHADE_FIRST;
    let before = SplatSettings { visibility: Visibility::Slabs, kernel: Kernel::Cubic, ..splatted };
    let modes = [
        ("splatted", splatted),
        ("slabs, shaded first", before),
        ("exact mode", SplatSettings::EXACT),
    ];
    let mut kernels: Vec<Curve> = modes.map(|m| (m.0.to_owned(), Vec::new())).to_vec();
    let mut pixels = kernels.clone();
    let mut slabs = kernels[1..].to_vec();
    let time = |scene: &Scene, splat, size| -> Result<(f64, f64)> {
        let still = page.draw(&with(scene, splat), size, Refine::Full, REPEAT)?;
        Ok((still.kernels_active as f64, least_ms(&still)))
    };
    for size in [48, 64, 80, 96, 112] {
        let scene = head(size)?;
        for (curve, (_, splat)) in kernels.iter_mut().zip(modes) {
            let (active, ms) = time(&scene, splat, 384)?;
            curve.1.push((active / 1e3, ms));
        }
    }
    let scene = head(80)?;
    for size in [128, 192, 256, 384, 512] {
        for (curve, (_, splat)) in pixels.iter_mut().zip(modes) {
            let (_, ms) = time(&scene, splat, size)?;
            curve.1.push((f64::from(size * size) / 1e3, ms));
        }
    }
    for slabs_per_voxel in [0.5, 1.0, 2.0, 3.0, 4.0] {
        for (curve, (_, splat)) in slabs.iter_mut().zip(&modes[1..]) {
            let (_, ms) = time(&scene, SplatSettings { slabs_per_voxel, ..*splat }, 256)?;
            curve.1.push((slabs_per_voxel, ms));
        }
    }
    let panels = [
        ("Time against kernels (384²)", "active kernels, thousands", "ms", &kernels[..]),
        ("Time against pixels (head:80)", "pixels, thousands", "ms", &pixels[..]),
        ("Time against slabs (head:80, 256²)", "slabs per voxel", "ms", &slabs[..]),
    ];
    charts(&page.pictures.join("growth.png"), &panels, true)?;
    let mut rows = Vec::new();
    for (_, across, _, curves) in panels {
        for (name, points) in curves {
            let line = Straight::through(points);
            let list: Vec<String> =
                points.iter().map(|&(x, ms)| format!("{}: {}", short(x), short(ms))).collect();
            rows.push(vec![
                across.to_owned(),
                name.clone(),
                list.join("; "),
                format!("{} + {:.4}·x", short(line.fixed), line.slope),
                format!("{:.3}", line.explained(points)),
            ]);
        }
    }
    page.table(&["x", "mode", "x: ms", "straight line, ms", "variance it explains"], &rows);
    page.figure("growth.png", "Measured times and straight lines through them (least squares).");
    page.say(
        "**Bends, and what to expect.** Where the machine was busy, points scatter about their line: the \
         last column says how much of what is seen the line explains, and a low number there is no bend. \
         Along the first axis the picture keeps its size while the grid gets finer: kernels shrink on the \
         screen as they grow in number, and slabs, and with them the exact mode's work per pixel, grow with \
         the grid's edge alone, so no proportionality to kernels is expected of slabs. Along the second, \
         what remains at 0 pixels belongs to the kernels; along the third, what remains at 0 slabs is paid \
         once a picture. These are expectations: none of them was measured apart.",
    );
    Ok(())
}
