//! Laur and Hanrahan, figures 3 to 6: opacity correction, oct-trees at falling errors, refinement.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, anyhow};
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::gpu::layout::Record;
use voxsplat::gpu::{AdapterChoice, Context, Renderer, SlabField, Wishes};
use voxsplat::hierarchy::Means;
use voxsplat::io::{self, OpenOptions};
use voxsplat::kernel::{Kernel, RadialKernel};
use voxsplat::plan::{COARSER, FieldCut, Plan, bricks_of_cut};
use voxsplat::scene::{
    self, Moving, NamedView, OpacityModel, Orientation, SampleSource, Scene, SplatSettings, View,
};
use voxsplat::task::cells;
use voxsplat::task::cuts::stored_levels;
use voxsplat::task::draw::{Drawer, Rung};
use voxsplat::task::engine::EngineChoice;
use voxsplat::task::engines::Engines;
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::transfer::{ColourSource, TransferFunction};
use voxsplat::volume::{Lattice, Samples, ScalarVolume};

use crate::support::{
    Page, compare, crop, db, demo_grid, least_ms, of_field, on_black, scalar, short, wide, with,
};

/// Levels of the pyramid: nodes of 1, 2, 4 and 8 voxels along an edge.
const LEVELS: [usize; 4] = [0, 1, 2, 3];
/// Samples along an edge of the cube, pixels of its picture, and pixels a voxel.
const CUBE: usize = 64;
const CUBE_SIZE: u32 = 216;
const CUBE_PIXELS: f64 = 3.0;
/// Opacity of a voxel of the cube: 0.73 through all of it.
const CUBE_OPACITY: f64 = 0.02;
/// Pixels of figure 3's pictures and a voxel there, and the voxel's opacity.
const SPLAT_SIZE: u32 = 160;
const SPLAT_PIXELS: f64 = 6.0;
const SPLAT_OPACITY: f64 = 0.3;
/// Errors that figure 5's cuts of the head and of the scan are within, RMSE to `full`, and pixels of its
/// pictures.
const CUT_ERRORS: [[f64; 4]; 2] = [[0.2, 0.14, 0.1, 0.05], [0.05, 0.03, 0.02, 0.01]];
const CUT_SIZE: u32 = 320;
/// Figure 6: pixels, samples of the head, and the times: this program's own while something moves, "5
/// times a second", "5 seconds".
const FRAMES_SIZE: u32 = 512;
const FRAMES_HEAD: usize = 256;
const BUDGETS_MS: [f64; 3] = [20.0, 200.0, 5000.0];
/// Pixels of its panels, cut from the pictures.
const FRAMES_PANEL: usize = 340;
/// Nearer than a scene opens, for pictures in which there is more to be seen.
const ZOOM: f64 = 0.65;
/// The scan whose numbers stand beside the head's.
const SCAN: &str = "scalar/LIDC2.vti";

/// Samples along an edge of the field in which figure 3's blocks lie: from the middle on, so that means of their width meet them.
const BLOCK_FIELD: usize = 32;
/// Errors that cuts of the field are within in figure 5.
const FIELD_ERRORS: [[f64; 4]; 2] = [[0.02, 0.01, 0.005, 0.0025], [0.02, 0.01, 0.005, 0.0025]];

/// Splats as the paper draws them: Gouraud-shaded polygons of the printed opacity.
const PRINTED: SplatSettings = SplatSettings {
    kernel: Kernel::Gouraud,
    opacity_model: OpacityModel::Published,
    ..SplatSettings::SHADE_FIRST
};

pub(crate) fn write(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say("## Laur–Hanrahan: figures 3 to 6");
    let context = Context::new(&AdapterChoice::Auto, Wishes::default())?;
    let mut drawer = Drawer::new(Renderer::new(context));
    figure_3(page, &mut drawer)?;
    figure_4(page, &mut drawer)?;
    figure_5(page, data)?;
    figure_6(page, data)
}

/// What becomes of a voxel's opacity α when n of them along each axis are drawn as one splat.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Correction {
    /// Nothing: a large splat has the opacity of a small one.
    None,
    /// 1 − (1 − α)^n, as printed for n = 2 and repeated.
    Printed,
    /// n times the optical depth, or with published opacity n·α: what nodes get in this program.
    Proportional,
}

impl Correction {
    /// The extinction of a record of `edge` voxels, which the renderer takes `edge` times as deep
    /// as a voxel's (published: as opaque).
    fn extinction(self, model: OpacityModel, opacity: f64, edge: usize) -> f32 {
        let n = edge as f64;
        let of = |opacity: f64| -(-opacity).ln_1p();
        let extinction = match (self, model) {
            (Self::Proportional, _) => of(opacity),
            (Self::None, OpacityModel::Published) => of(opacity / n),
            (Self::None, OpacityModel::OpticalDepth) => of(opacity) / n,
            (Self::Printed, OpacityModel::Published) => of((1.0 - (1.0 - opacity).powf(n)) / n),
            // Of n layers the depths add up.
            (Self::Printed, OpacityModel::OpticalDepth) => of(opacity),
        };
        #[expect(clippy::cast_possible_truncation, reason = "a number of order 1")]
        let extinction = extinction as f32;
        extinction
    }
}

/// A constant cube, white, seen from the front at so many pixels a voxel.
fn constant(samples: usize, opacity: f64, pixels: f64, size: u32) -> Result<Scene> {
    let grid = demo_grid("constant", samples)?;
    let volume = scalar(&grid)?;
    let (direction, up) = NamedView::Front.direction_and_up(Orientation::default());
    let mut camera = scene::framing_camera(&volume.lattice, direction, up);
    camera.parallel_scale = f64::from(size) / 2.0 / pixels * volume.lattice.smallest_spacing();
    let value = volume.statistics.min;
    let colour = ColourSource::Stops(vec![(value, Srgb8::WHITE)]);
    let transfer = TransferFunction::new(vec![(value, opacity)], colour)?;
    Ok(of_field(Scene::seen_by(camera), volume, transfer))
}

/// White splats alone.
fn draw_records(
    drawer: &mut Drawer,
    scene: &Scene,
    size: u32,
    records: &[Record],
) -> Result<Vec<[f32; 4]>> {
    drawer.prepare(&Plan::of(scene, [size; 2]), &Ticket::new())?;
    let view = View::new(scene, [size; 2]);
    let (splat, unit) = (&scene.splat, scene.opacity_unit_distance());
    match splat.kernel {
        Kernel::Gouraud => {
            drawer.engines.gpu().expect("a device").begin_meshes(&view, splat, unit)?
        }
        kernel => {
            drawer.engines.gpu().expect("a device").begin(&view, kernel, splat.extent, unit)?
        }
    }
    drawer.engines.gpu().expect("a device").draw_records(records)?;
    Ok(drawer.engines.gpu().expect("a device").read_light()?)
}

/// A white splat of `edge` voxels along each axis.
fn record(low: [usize; 3], edge: usize, extinction: f32) -> Result<Record> {
    let [x, y, z] = low;
    let low = [u32::try_from(x)?, u32::try_from(y)?, u32::try_from(z)?];
    Ok(Record::new(low, [u32::try_from(edge)?; 3], extinction, [u16::MAX; 3]))
}

fn figure_3(page: &mut Page<'_>, drawer: &mut Drawer) -> Result<()> {
    // As many samples along each axis as voxels of the largest splat: all have one middle.
    let largest = 1 << LEVELS[LEVELS.len() - 1];
    let scene = constant(largest, SPLAT_OPACITY, SPLAT_PIXELS, SPLAT_SIZE)?;
    let kernel = radial()?;
    let rows = [
        ("published, uncorrected", PRINTED, Correction::None),
        ("published, 1 − (1 − α)ⁿ", PRINTED, Correction::Printed),
        ("optical depth, uncorrected", SplatSettings::SHADE_FIRST, Correction::None),
        ("optical depth, n times as deep", SplatSettings::SHADE_FIRST, Correction::Proportional),
    ];
    let (mut pictures, mut table) = (Vec::new(), Vec::new());
    for (name, splat, correction) in rows {
        let scene = with(&scene, splat);
        let (mut panels, mut cells) = (Vec::new(), vec![name.to_owned()]);
        for level in LEVELS {
            let edge = 1 << level;
            let extinction = correction.extinction(splat.opacity_model, SPLAT_OPACITY, edge);
            let mut one = record([0; 3], edge, extinction)?;
            one.centre = [(largest as f32 - 1.0) / 2.0; 3];
            let light = draw_records(drawer, &scene, SPLAT_SIZE, &[one])?;
            // The four pixels around the middle are half a pixel's diagonal from it.
            let found = light.iter().map(|pixel| pixel[3]).fold(0.0, f32::max);
            let off = 0.5_f64.sqrt() / (SPLAT_PIXELS * edge as f64);
            let (kappa, n) = (f64::from(extinction), edge as f64);
            let expected = match splat.opacity_model {
                OpacityModel::Published => n * -(-kappa).exp_m1() * kernel.footprint(off),
                OpacityModel::OpticalDepth => -(-kappa * n * kernel.footprint(off)).exp_m1(),
            };
            cells.push(format!("{found:.3} ({expected:.3})"));
            panels.push(on_black(&light));
        }
        pictures.push(panels);
        table.push(cells);
    }
    let (mut panels, mut cells) = (Vec::new(), vec!["a cut of the field".to_owned()]);
    for level in LEVELS {
        let edge = 1 << level;
        let scene = block(edge)?;
        let light = uniform_cut(&scene, SPLAT_SIZE, level.min(COARSER))?;
        let found = light.iter().map(|pixel| pixel[3]).fold(0.0, f32::max);
        let n = i32::try_from(edge)?;
        cells.push(format!("{found:.3} ({:.3})", 1.0 - (1.0 - SPLAT_OPACITY).powi(n)));
        panels.push(on_black(&light));
    }
    pictures.push(panels);
    table.push(cells);
    page.mosaic("laur-hanrahan-3.png", &pictures, SPLAT_SIZE as usize)?;
    page.say(&format!(
        "**Figure 3: one splat.** A voxel of opacity α = {SPLAT_OPACITY}, and what stands for 2, 4 and 8 of them \
         along each axis, drawn with and without the correction of its opacity. *Published* is the paper's \
         way: Gouraud meshes of opacity α·F, and 1 − (1 − α)ⁿ for the larger. By *optical depth* footprints \
         are evaluated, and a splat n times as large is n times as deep, which would be the same correction in \
         the middle if F were 1 there, and leaves the rim clear, where the printed derivation (transparency times a \
         Gaussian) would make it opaque. Opacity at the middle, and in brackets from the closed form of F in float64, \
         above which meshes stand a little there, as they are fitted to all of it:",
    ));
    page.table(&["opacity in the middle", "1 voxel", "2³", "4³", "8³"], &table);
    page.figure(
        "laur-hanrahan-3.png",
        "After Laur–Hanrahan figure 3: a single splat at four powers of two. From above: published, uncorrected \
         and corrected; optical depth, uncorrected and corrected; a block of as many voxels by a cut of the field. Without the \
         correction a large splat is as clear as a small one.",
    );
    page.say(&format!(
"*A cut of the field* is what the exact mode's quick pictures are drawn from: here a field of {BLOCK_FIELD}³ samples, all 0 \
         but for a block of n³ of opacity α, by the samples, by tents through means of 2³ and of 4³ (which is the coarsest there \
         is: the last block is of eight of them). What is in brackets there is 1 − (1 − α)ⁿ. Values are classified after \
         they are reconstructed, and rays are integrated through them, so that nothing is to be corrected: what is n voxels wide is about n \
         times as deep. It is a little less in the middle of a tent, since opacity rather than depth runs straight from sample to sample, \
         and pixels lie beside the tent's edge. A single sample has rings: the spline through it is below 0 next to it, where nothing shows, and \
         above it again farther off.",
    ));
    Ok(())
}

/// A block of `edge` voxels along each axis of white matter in a field of nothing, seen from the front about its middle.
fn block(edge: usize) -> Result<Scene> {
    let n = BLOCK_FIELD;
    let (low, high) = (n / 2, n / 2 + edge);
    let is_in =
        |i: usize| [i % n, i / n % n, i / (n * n)].iter().all(|at| (low..high).contains(at));
    let samples = (0..n.pow(3)).map(|i| f32::from(u8::from(is_in(i)))).collect();
    let lattice = Lattice::unit([n; 3]);
    let volume = ScalarVolume::from_samples("block", lattice, Samples::Float32(samples))?;
    let (direction, up) = NamedView::Front.direction_and_up(Orientation::default());
    let mut camera = scene::framing_camera(&volume.lattice, direction, up);
    camera.parallel_scale = f64::from(SPLAT_SIZE) / 2.0 / SPLAT_PIXELS;
    let middle = (low + high - 1) as f64 / 2.0;
    camera.focal_point = volume.lattice.world_from_index(glam::DVec3::splat(middle));
    let colour = ColourSource::Stops(vec![(0.0, Srgb8::WHITE)]);
    let transfer = TransferFunction::new(vec![(0.0, 0.0), (1.0, SPLAT_OPACITY)], colour)?;
    let scene = of_field(Scene::seen_by(camera), Arc::new(volume), transfer);
    Ok(with(&scene, SplatSettings::EXACT))
}

/// A scene by a cut of its field that is of one level throughout, by the native engine.
fn uniform_cut(scene: &Scene, size: u32, level: usize) -> Result<Vec<[f32; 4]>> {
    let mut drawer = Drawer::with(Engines::new(EngineChoice::Native.into(), Wishes::default())?);
    let (plan, ticket) = (Plan::of(scene, [size; 2]), Ticket::new());
    drawer.prepare(&plan, &ticket)?;
    drawer.draw(&plan, Rung::Full, &mut ())?;
    let volume = scene.volume().ok_or_else(|| anyhow!("a field"))?;
    let means = Means::of(volume, &ticket)?.ok_or_else(|| anyhow!("too small for means"))?;
    drawer.engines.native.set_levels(stored_levels(volume, &means, &ticket)?);
    let dims = bricks_of_cut(volume.lattice.dims);
    let levels = vec![u8::try_from(level)?; dims.iter().product()];
    let cut = Some(Arc::new(FieldCut::new(dims, levels)));
    drawer.draw(&Plan { cut, ..plan }, Rung::Full, &mut ())?;
    Ok(drawer.engines.native.light().0)
}

fn radial() -> Result<RadialKernel> {
    RadialKernel::new(Kernel::Cubic, None).ok_or_else(|| anyhow!("the cubic is not radial"))
}

/// Mean and greatest deviation of opacity inside the cube's silhouette, by 1.56 widths of a node.
fn inside(light: &[[f32; 4]], edge: usize, exact: f64) -> Result<[f64; 2]> {
    let (middle, reach) = (f64::from(CUBE_SIZE) / 2.0, radial()?.radius());
    let half = (CUBE as f64 / 2.0 - reach * edge as f64) * CUBE_PIXELS;
    let is_inside = |p: usize| (p as f64 + 0.5 - middle).abs() <= half;
    let side = CUBE_SIZE as usize;
    let opacities: Vec<f64> = (0..side * side)
        .filter(|i| is_inside(i % side) && is_inside(i / side))
        .map(|i| f64::from(light[i][3]))
        .collect();
    let mean = opacities.iter().sum::<f64>() / opacities.len() as f64;
    Ok([mean, opacities.iter().map(|o| (o - exact).abs()).fold(0.0, f64::max)])
}

fn figure_4(page: &mut Page<'_>, drawer: &mut Drawer) -> Result<()> {
    let scene = constant(CUBE, CUBE_OPACITY, CUBE_PIXELS, CUBE_SIZE)?;
    let exact = 1.0 - (1.0 - CUBE_OPACITY).powi(i32::try_from(CUBE)?);
    let columns = [
        ("published, uncorrected", PRINTED, Correction::None),
        ("published, 1 − (1 − α)ⁿ", PRINTED, Correction::Printed),
        ("published, n·α", PRINTED, Correction::Proportional),
        ("optical depth, uncorrected", SplatSettings::SHADE_FIRST, Correction::None),
        ("optical depth, n times as deep", SplatSettings::SHADE_FIRST, Correction::Proportional),
    ];
    let mut table: Vec<Vec<String>> = LEVELS
        .iter()
        .map(|level| vec![format!("{}³ nodes of {}³ voxels", CUBE >> level, 1 << level)])
        .collect();
    let mut pictures = Vec::new();
    let mut most_off = 0.0_f64;
    let mut coarsest = Vec::new();
    for (_, splat, correction) in columns {
        let scene = with(&scene, splat);
        let mut panels = Vec::new();
        let mut last = [0.0; 2];
        for (level, cells) in LEVELS.into_iter().zip(&mut table) {
            let edge = 1 << level;
            let extinction = correction.extinction(splat.opacity_model, CUBE_OPACITY, edge);
            let across = CUBE / edge;
            let records: Vec<Record> = (0..across.pow(3))
                .map(|i| {
                    let at = [i % across, i / across % across, i / (across * across)];
                    record(at.map(|i| i * edge), edge, extinction)
                })
                .collect::<Result<_>>()?;
            let light = draw_records(drawer, &scene, CUBE_SIZE, &records)?;
            if correction == Correction::Proportional {
                // What these records stand for, by way of the pyramid and a cut.
                let plan = Plan::of(&scene, [CUBE_SIZE; 2]);
                drawer.draw(&plan, Rung::Subsampled { level }, &mut ())?;
                let cut = drawer.engines.gpu().expect("a device").read_light()?;
                let off = cut.iter().zip(&light).map(|(a, b)| f64::from((a[3] - b[3]).abs()));
                most_off = off.fold(most_off, f64::max);
            }
            last = inside(&light, edge, exact)?;
            cells.push(format!("{:.4} ({:.4})", last[0], last[1]));
            panels.push(on_black(&light));
        }
        coarsest.push(last);
        pictures.push(panels);
    }
    // The printed and the proportional one look alike here.
    pictures.remove(2);
    let mut panels = Vec::new();
    let of_field = with(&scene, SplatSettings::EXACT);
    let mut field_off = 0.0_f64;
    for (level, cells) in LEVELS.into_iter().zip(&mut table) {
        if level > COARSER {
            cells.push("–".to_owned());
            continue;
        }
        let light = uniform_cut(&of_field, CUBE_SIZE, level)?;
        let [mean, most] = inside(&light, 1 << level, exact)?;
        cells.push(format!("{mean:.4} ({most:.4})"));
        field_off = field_off.max(most);
        panels.push(on_black(&light));
    }
    pictures.push(panels);
    page.mosaic("laur-hanrahan-4.png", &pictures, CUBE_SIZE as usize)?;
    page.say(&format!(
        "**Figure 4: a constant cube.** `demo:constant:{CUBE}`, voxels of opacity {CUBE_OPACITY}, seen along an axis at \
         four levels of the octree; ideally, they write, changing the resolution should have no effect. Exactly, \
         1 − (1 − α)^{CUBE} = {exact:.4} of what lies behind is hidden everywhere inside. Mean opacity \
         1.56 node widths inside the silhouette, where every kernel that reaches a pixel is whole, and in \
         brackets the worst deviation of a pixel there from the exact value:",
    ));
    let head: Vec<&str> = std::iter::once("level")
        .chain(columns.iter().map(|column| column.0))
        .chain(["a cut of the field"])
        .collect();
    page.table(&head, &table);
    page.figure(
        "laur-hanrahan-4.png",
        "After Laur–Hanrahan figure 4: a constant cube as nodes of 1, 2, 4 and 8 voxels along an edge, left to right. \
         From above: published, uncorrected and corrected as printed; optical depth, uncorrected and corrected; cuts of the field, of \
         which the coarsest is of 4.",
    );
    let off = |column: usize| coarsest[column][0] - exact;
    page.say(&format!(
        "Without the correction each level is clearer than the one before. With it they are alike inside but for what the \
         table says; at the silhouette large nodes end softly in either case. By optical depth the mean does not change, and what \
         is left is the kernel's unevenness. By the published opacity it does, since the correction is of a whole splat's opacity \
         and not of its rim's: as printed the coarsest level is off by {:+.4}, and by {:+.4} with n·α, which is what \
         a node gets in this program's octree cuts (as its optical depth, opacity adds up along it), and which is capped where \
         it exceeds 1. The columns of n·α and of n times the depth were also drawn as cuts of the pyramid: no opacity differed by more \
         than {most_off:.0e}.",
        off(1),
        off(2),
    ));
    page.say(&format!(
        "*A cut of the field* (the last column) has no splats: of every level, no pixel inside the silhouette differs by more than \
         {field_off:.0e} from the exact value, and the silhouette keeps its place.",
    ));
    page.say(&format!(
        "The meshes have {} triangles a splat and are fitted to the optimal cubic; which mesh, which Gaussian and which \
         opacity the paper's figures have it does not say.",
        PRINTED.gouraud.triangles(),
    ));
    Ok(())
}

/// A scan of the data pack in the mode and view it opens with.
fn scan(data: &Path, name: &str) -> Result<Scene> {
    // Its place on this machine is nobody's business.
    let grid = io::open(&data.join(name), &OpenOptions::default(), &Ticket::new())
        .map_err(|_| anyhow!("{name} could not be opened"))?
        .grid;
    Ok(scene::opening(SampleSource::default(), scalar(&grid)?, grid.space.as_deref()))
}

/// What is drawn: a head, which may be published, and a patient's scan where the data pack is there.
fn subjects(page: &mut Page<'_>, data: &Path, samples: usize) -> Result<Vec<(String, Scene)>> {
    let grid = demo_grid("head", samples)?;
    let mut head = scene::opening(SampleSource::default(), scalar(&grid)?, grid.space.as_deref());
    head.camera.parallel_scale *= ZOOM;
    let mut subjects = vec![(format!("`demo:head:{samples}`"), head)];
    match scan(data, SCAN) {
        Ok(scene) => subjects.push((format!("`{SCAN}`"), scene)),
        Err(error) => page.say(&format!("Left out when this page was made: {error}.")),
    }
    Ok(subjects)
}

/// A picture that is within an error, and its cells.
fn cut(page: &Page<'_>, scene: &Scene, refine: Refine) -> Result<Still> {
    let size = [CUT_SIZE; 2];
    let request = StillRequest {
        scene: scene.clone(),
        size,
        refine,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    };
    Ok(page.engine.still_with_cells(request, &Ticket::new())?)
}

fn figure_5(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say(&format!(
        "**Figure 5: oct-trees at falling errors.** Their lines alone are printed; here the cells' edges lie over the picture, \
         coloured by their level, as `voxsplat render --refine coarse --max-error E --cells` draws them. The error is measured: \
         nodes are doubled until the picture's RMSE to `full` is within E ({CUT_SIZE} × {CUT_SIZE} pixels, every sample). \
         No pictures of patients are published here, so their scans have numbers alone.",
    ));
    let subjects = subjects(page, data, 128)?;
    let (mut table, mut pictures) = (Vec::new(), Vec::new());
    for (s, ((name, scene), errors)) in subjects.iter().zip(CUT_ERRORS).enumerate() {
        let scene = with(scene, SplatSettings::SHADE_FIRST);
        let view = View::new(&scene, [CUT_SIZE; 2]);
        let mut panels = Vec::new();
        for max_error in errors {
            let mut still = cut(page, &scene, Refine::Error { max_error, of_voxels: true })?;
            let mut row = vec![name.clone(), max_error.to_string()];
            match &still.cells {
                Some(cells) => {
                    cells::draw_edges(&mut still.rgba, &view, cells);
                    let levels: Vec<String> = cells
                        .levels()
                        .iter()
                        .rev()
                        .map(|(level, count)| format!("{}³: {count}", 1_u32 << level))
                        .collect();
                    row.extend([
                        format!("{:.4}", still.measured_rmse.unwrap_or(0.0)),
                        format!("{:.3}", cells.max_error),
                        cells.total.to_string(),
                        levels.join(", "),
                    ]);
                }
                None => row.extend([
                    "0".to_owned(),
                    "–".to_owned(),
                    "every voxel".to_owned(),
                    String::new(),
                ]),
            }
            table.push(row);
            panels.push(still.rgba);
        }
        if s == 0 {
            pictures.push(panels);
        }
    }
    page.table(
        &["volume", "RMSE asked for", "RMSE", "greatest error of a node", "cells", "edge: cells"],
        &table,
    );
    let mut table = Vec::new();
    for (s, ((name, scene), errors)) in subjects.iter().zip(FIELD_ERRORS).enumerate() {
        let scene = with(scene, SplatSettings::EXACT);
        let view = View::new(&scene, [CUT_SIZE; 2]);
        let mut panels = Vec::new();
        for max_error in errors {
            let mut still = cut(page, &scene, Refine::Error { max_error, of_voxels: false })?;
            let mut row = vec![name.clone(), max_error.to_string()];
            row.extend(match (&still.cells, still.drawn.cut) {
                (Some(cells), Some(cut)) => {
                    cells::draw_edges(&mut still.rgba, &view, cells);
                    let [fine, second, fourth] = cut.bricks.map(|bricks| bricks.to_string());
                    let rmse = still.measured_rmse.unwrap_or(0.0);
                    let error = format!("{:.4}", cut.max_error);
                    [format!("{rmse:.4}"), error, cells.total.to_string(), fine, second, fourth]
                }
                _ => {
                    let none = || "–".to_owned();
                    ["0".to_owned(), none(), "every voxel".to_owned(), none(), none(), none()]
                }
            });
            table.push(row);
            panels.push(still.rgba);
        }
        if s == 0 {
            pictures.push(panels);
        }
    }
    page.say(
        "*Cuts of the field*, as the exact mode has them: the coarsest whose picture is within E, found by halving the range of \
         limits on the errors of bricks. A cell is a brick of 4³ cells between samples, and its colour says from which level it is drawn.",
    );
    page.table(
        &[
            "volume",
            "RMSE asked for",
            "RMSE",
            "limit on a brick's error",
            "bricks",
            "from samples",
            "from means of 2³",
            "of 4³",
        ],
        &table,
    );
    page.mosaic("laur-hanrahan-5.png", &pictures, CUT_SIZE as usize)?;
    let list = |errors: [f64; 4]| {
        let [a, b, c, d] = errors.map(|error| error.to_string());
        format!("{a}, {b}, {c} and {d}")
    };
    page.figure(
        "laur-hanrahan-5.png",
        &format!(
            "After Laur–Hanrahan figure 5: above, the octree's cells over the head within an RMSE of {}; below, bricks of cuts of \
             the field within {}. Where nothing shows there are no cells.",
            list(CUT_ERRORS[0]),
            list(FIELD_ERRORS[0]),
        ),
    );
    page.say(
        "As printed, the lower the error the more nodes, small where the data change quickly and large where they are flat. \
         Nodes in which nothing shows are left out here; the error is of classified voxels (colour and opacity) rather than of scalar \
         values, which `--cut-error scalar` chooses.",
    );
    Ok(())
}

fn figure_6(page: &mut Page<'_>, data: &Path) -> Result<()> {
    let subjects = subjects(page, data, FRAMES_HEAD)?;
    page.say(&format!(
        "**Figure 6: what can be drawn five times a second, in 5 seconds, and at full resolution.** Theirs is a CT scan of an \
         engine block on a Silicon Graphics workstation; ours are a head made of formulas and a patient's scan, {FRAMES_SIZE} × \
         {FRAMES_SIZE} pixels, on a processor. *Octree* is the paper's mode: shaded first, every sample, octree cuts fitted to the \
         time, but footprints evaluated rather than meshes. *Exact* is this program's own: *cuts* are quick pictures of cuts of its field, \
         as fine and as large as is thought to lose least in the time, *fewer pixels* those of all of it, drawn smaller. A fiftieth of a second was added: what this program takes while something moves.",
    ));
    let moving = |moving| {
        let mut splat = SplatSettings::EXACT;
        splat.cut.moving = moving;
        splat
    };
    let modes = [
        ("exact, cuts", moving(Moving::Auto)),
        ("exact, fewer pixels", moving(Moving::Subsampled)),
        ("octree", SplatSettings::SHADE_FIRST),
    ];
    let (mut table, mut pictures) = (Vec::new(), Vec::new());
    let mut longest_ms = 0.0_f64;
    for (s, (name, scene)) in subjects.iter().enumerate() {
        let mut exact = None;
        for (mode, splat) in modes {
            let scene = with(scene, splat);
            let full = page.draw(&scene, FRAMES_SIZE, Refine::Full, 1)?;
            let truth = wide(&full.light);
            let exact = exact.get_or_insert_with(|| truth.clone());
            let mut row = |time: String, still: &Still, drawn: String| -> Result<()> {
                let (own, exact) = (compare(still, &truth)?, compare(still, exact)?);
                let ms = short(least_ms(still));
                let [own, exact] = [own, exact].map(|off| db(off.psnr()));
                table.push(vec![name.clone(), mode.to_owned(), time, ms, drawn, own, exact]);
                Ok(())
            };
            let mut panels = Vec::new();
            for budget_ms in BUDGETS_MS {
                let still = page.draw(&scene, FRAMES_SIZE, Refine::Budget { budget_ms }, 1)?;
                row(format!("{} s", budget_ms / 1e3), &still, what(&still))?;
                panels.push(panel(&still));
            }
            row("full".to_owned(), &full, format!("{} active voxels", full.kernels_active))?;
            longest_ms = longest_ms.max(least_ms(&full));
            panels.push(panel(&full));
            if s == 0 {
                pictures.push(panels);
            }
        }
    }
    page.table(
        &["volume", "mode", "time", "ms", "drawn", "dB to full", "dB to exact full"],
        &table,
    );
    // The paper's mode above.
    pictures.reverse();
    page.mosaic("laur-hanrahan-6.png", &pictures, FRAMES_PANEL)?;
    page.figure(
        "laur-hanrahan-6.png",
        "After Laur–Hanrahan figure 6, cut from the pictures: the head within a fiftieth and a fifth of a second, within 5 seconds, and in full; above \
         octree cuts of every sample, then the exact mode by fewer pixels, and below by cuts of its field.",
    );
    let within = match longest_ms < BUDGETS_MS[BUDGETS_MS.len() - 1] {
        true => "less than the 5 seconds, so that the third picture is the last or nearly so",
        false => "more than the 5 seconds",
    };
    page.say(&format!(
        "The slowest `full` picture of the table took {} s: {within}. That \"the highest resolution pictures do not look as good \
         as the very best\" is the last column of the octree's `full`. Cuts within a short time are blurred outwards, \
         since a node's kernel reaches beyond its box.",
        short(longest_ms / 1e3),
    ));
    Ok(())
}

fn panel(still: &Still) -> Vec<u8> {
    on_black(&crop(&still.light, FRAMES_SIZE as usize, FRAMES_PANEL, [0.5, 0.45]))
}

/// What a coarse picture is made of.
fn what(still: &Still) -> String {
    let [width, height] = still.drawn.size;
    let of = match (still.drawn.is_reduced, still.drawn.field) {
        (false, _) => format!("{} nodes", still.drawn.nodes),
        (true, SlabField::Own) => "the field".to_owned(),
        (true, SlabField::Preview) => "the nearest tents".to_owned(),
    };
    match still.drawn.cut {
        Some(cut) => {
            let [fine, second, fourth] = cut.bricks;
            format!("a cut of {of}, {fine} + {second} + {fourth} bricks, at {width} × {height}")
        }
        None => format!("{of} at {width} × {height}"),
    }
}
