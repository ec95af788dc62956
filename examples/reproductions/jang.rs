//! Jang and others: fields as basis functions, their tables and figures 7 to 13 in kind.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use voxsplat::accuracy::psnr_from_rmse;
use voxsplat::core::{Camera, Srgb8, Ticket};
use voxsplat::io::{self, Encoded, OpenOptions};
use voxsplat::rbf::{Basis, Encoding, Errors, Goal, Points, encode};
use voxsplat::scene::{
    Classify, Isosurface, Lighting, SampleSource, Scene, Slice, SplatSettings, framing_camera,
    opening,
};
use voxsplat::task::encode::{Asked, Wanted, encode_field, residual};
use voxsplat::task::still::{Refine, Still};
use voxsplat::transfer::{ColourMap, ColourSource, TransferFunction, presets};
use voxsplat::volume::{
    Association, Component, Field, Grid, Lattice, Samples, ScalarVolume, Shape,
};

use crate::support::{
    Light, Page, compare, db, demo_grid, least_ms, on_black, scalar, short, subsampled, wide, with,
    with_transfer,
};

/// The paper's pictures, pixels.
const SIZE: u32 = 400;
/// Pixels of the pictures here: one to a figure, and two.
const PANEL: usize = 240;
const HALF: usize = 176;
/// Of neghip and of the blunt fin, in the paper (sections 7.4 and 7.5).
const PRINTED: [usize; 2] = [812, 695];
/// Of the shock and of the oil reservoir (figures 1a and 11).
const PRINTED_ELSEWHERE: [usize; 2] = [2932, 458];
/// Of the shock in figure 8, and of the density about the same body in figure 9.
const FEWER_AND_MORE: [usize; 2] = [855, 1147];
const OF_DENSITY: usize = 1611;
/// Where the fin meets the shock, in the world, half the height that is seen of it, and a density that the flow reaches there.
const SHOCK: (DVec3, f64) = (DVec3::new(2.0, 2.2, 0.1), 2.6);
const IN_THE_SHOCK: f64 = 1.2;
/// Densities between which it is coloured.
const ABOUT_THE_SHOCK: [f64; 2] = [0.75, 2.25];
/// What is asked for, of the range of values, %: ε is 0.02 of it, so that functions reach 4 widths rather than 8.
const GREATEST: f64 = 1.0;
/// What the paper calls interactive is a few pictures a second.
const AIM: f64 = 30.0;
/// Of isosurfaces.
const SURFACE: Srgb8 = Srgb8([226, 196, 150]);
const FRAMES: u32 = 8;

pub(crate) fn write(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say("## Jang: basis functions");
    stand_ins(page);
    table_of_fits(page, data)?;
    let neghip = halved(&neghip(data)?)?;
    let (_, encoded) = fitted(&neghip, PRINTED[0])?;
    let scene = scene_of(scalar(&neghip)?.as_ref(), &neghip, &encoded);
    modes(page, &scene)?;
    unseen(page, &scene)?;
    figures(page, data, &scene)
}

/// What the paper has and this machine does not.
fn stand_ins(page: &mut Page<'_>) {
    page.say(
        "Two of the paper's data sets are not at hand. *For the shock about the X 38* (1 943 483 tetrahedra, section 7.1) stands \
         the density of the blunt fin on 187 395 tetrahedra: it is supersonic flow onto a body, too, whose bow shock is as steep \
         as its cells allow; it has fewer points, 40 960, and no normal Mach number to be clipped at. *For the black-oil \
         reservoir* (156 642 tetrahedra, section 7.3) stands a formula at the 27 744 points of the demo mesh's 147 456 \
         tetrahedra: the pressure between an injection and a production well in steady flow, ln r₂ − ln r₁, which is smooth but \
         for the wells, as theirs is about its one. *The convection in a box* (48 000 tetrahedra, section 7.2) is a formula, too, \
         on as many cubes as six tetrahedra each would make of it: warm below, cold above, linear at the sides, and a \
         roll between.",
    );
}

/// What a fit is to reach, said once for all of them.
fn goal(basis: Basis, max_error: f64, functions: usize) -> Goal {
    Goal { basis, max_error, mean_error: f64::INFINITY, functions }
}

/// A scan as it opens, at 64³.
fn neghip(data: &Path) -> Result<Grid> {
    opened(&data.join("scalar/neghip/neghip_64x64x64_uint8.raw"))
}

fn opened(path: &Path) -> Result<Grid> {
    Ok(io::open(path, &OpenOptions::default(), &Ticket::new())?.grid)
}

/// Every other sample along each axis: the paper's neghip has 32³.
fn halved(grid: &Grid) -> Result<Grid> {
    let volume = subsampled(scalar(grid)?.as_ref(), [2; 3])?;
    Ok(grid_of(&volume.name, volume.lattice, &volume.samples))
}

fn grid_of(name: &str, lattice: Lattice, samples: &Arc<Samples>) -> Grid {
    Grid::of(lattice, vec![field_of(name, Arc::clone(samples))])
}

/// One number a point.
fn field_of(name: &str, samples: Arc<Samples>) -> Field {
    Field { name: name.to_owned(), components: 1, association: Association::Point, samples }
}

/// Temperatures in a box that is heated from below, 1 there and 0 above, with a roll between: 20³ cubes.
fn convection() -> Grid {
    use std::f64::consts::{PI, TAU};
    const SIDE: usize = 21;
    let lattice = Lattice::unit([SIDE; 3]);
    let value = |i: usize| {
        let at = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
        let [x, y, z] = at.map(|n| n as f64 / (SIDE - 1) as f64);
        1.0 - z + 0.3 * (PI * z).sin() * (TAU * x).sin() * (PI * y).sin()
    };
    let samples = Samples::Float64((0..lattice.len()).map(value).collect());
    grid_of("temperature", lattice, &Arc::new(samples))
}

/// The pressure between two wells through the demo mesh.
fn reservoir() -> Result<Grid> {
    const WELLS: [f64; 2] = [0.66, -0.66];
    const RADIUS: f64 = 0.02;
    let grid = demo_grid("mesh", 16)?;
    let Shape::Unstructured(cells) = &grid.shape else {
        bail!("the demo mesh is {}", grid.shape.name())
    };
    let pressure = |at: &DVec3| {
        let [near, far] = WELLS.map(|x| (at.x - x).hypot(at.y).max(RADIUS).ln());
        far - near
    };
    let samples = Samples::Float64(cells.points().iter().map(pressure).collect());
    let fields = vec![field_of("pressure", Arc::new(samples))];
    Ok(Grid { fields, label_names: Vec::new(), ..grid })
}

/// The density of the blunt fin on tetrahedra.
fn blunt_fin_tets(data: &Path) -> Result<Grid> {
    let grid = opened(&data.join("unstructured/derived/bluntfin_tets.vtu"))?;
    let density = grid.field(Some("Density"))?.clone();
    Ok(Grid { fields: vec![density], ..grid })
}

/// Functions of a grid's first field, so many, and the seconds that took.
fn fitted(grid: &Grid, functions: usize) -> Result<(f64, Encoded)> {
    let asked = Asked {
        basis: Basis::Ellipsoid,
        max_error: Some(Wanted::Percent(GREATEST)),
        mean_error: None,
        bytes: None,
        functions,
        favour: None,
    };
    let what = (grid, grid.field(None)?, Component::Index(0));
    let start = Instant::now();
    let go_on = |_| ControlFlow::Continue(());
    let encoded = encode_field(what, "field", asked, None, &Ticket::new(), go_on)?;
    Ok((start.elapsed().as_secs_f64(), encoded))
}

/// A field with its functions, as it opens, in these.
fn scene_of(volume: &ScalarVolume, grid: &Grid, encoded: &Encoded) -> Scene {
    let functions = Some(Arc::new(encoded.encoding.clone()));
    let volume = ScalarVolume { functions, ..volume.clone() };
    let scene = opening(SampleSource::default(), Arc::new(volume), grid.space.as_deref());
    with(&scene, SplatSettings::FUNCTIONS)
}

/// One line of the table of fits.
fn fit(points: &Points, basis: Basis, functions: usize) -> Result<(Encoding, Errors, f64)> {
    let start = Instant::now();
    let goal = goal(basis, GREATEST / 100.0 * range_of(points), functions);
    let encoding = encode(points, goal, &Ticket::new(), |_| ControlFlow::Continue(()))?;
    let took = start.elapsed().as_secs_f64();
    let errors = encoding.errors(points, &Ticket::new())?;
    Ok((encoding, errors, took))
}

/// Greatest less least value.
fn range_of(points: &Points) -> f64 {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let wider = |[low, high]: [f64; 2], value: &f64| [low.min(*value), high.max(*value)];
    let [low, high] = points.values().iter().fold(none, wider);
    high - low
}

/// Places and values of a volume's samples.
fn points_of(volume: &ScalarVolume) -> Points {
    let [nx, ny, _] = volume.lattice.dims;
    Points::new((0..volume.samples.len()).map(|i| {
        let at = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
        (volume.lattice.world_from_index(DVec3::from(at)), volume.samples.get(i))
    }))
}

/// The first field of a grid of cells, at its points.
fn points_of_cells(grid: &Grid) -> Result<Points> {
    let Shape::Unstructured(cells) = &grid.shape else {
        bail!("expected cells, found {}", grid.shape.name())
    };
    let samples = &grid.field(None)?.samples;
    Ok(Points::new(cells.points().iter().enumerate().map(|(i, at)| (*at, samples.get(i)))))
}

/// The density of the blunt fin at the points of its curvilinear grid.
fn blunt_fin(data: &Path) -> Result<Points> {
    let grid = opened(&data.join("unstructured/bluntfin/bluntfinxyz.bin"))?;
    let density = Arc::clone(&grid.field(Some("Density"))?.samples);
    let Shape::Curvilinear(places) = grid.shape else {
        bail!("the blunt fin's grid is {}", grid.shape.name())
    };
    Ok(Points::new(places.iter().enumerate().map(|(i, place)| (*place, density.get(i)))))
}

fn table_of_fits(page: &mut Page<'_>, data: &Path) -> Result<()> {
    page.say(&format!(
        "Ours by as many functions, spheres as printed and ellipsoids; errors are at all samples, in % of the range of values. A \
         fit ends early at a greatest error of {GREATEST} %, and functions are cut off at ε, 0.02 of that. *Cells* are the \
         tree's that are not split, and the most functions that one lists. Under *printed* is what the paper says: functions, \
         cells and the most functions a cell may have, pictures a second of the volume and by how many slices. It prints no \
         errors but the mean of the density about the X 38, *just under* 2 % by {OF_DENSITY} functions, and no seconds of encoding.",
    ));
    let neghip = scalar(&neghip(data)?)?;
    let smaller = points_of(subsampled(&neghip, [2; 3])?.as_ref());
    let of_neghip = "812; 126 cells of ≤ 100; 2.6 by 32";
    let fields = [
        ("neghip, 32³", smaller, PRINTED[0], of_neghip),
        ("neghip, 64³", points_of(&neghip), PRINTED[0], "–"),
        (
            "blunt fin, 40 × 32 × 32 curvilinear",
            blunt_fin(data)?,
            PRINTED[1],
            "695; 238 cells of ≤ 60; 3.7 by 64",
        ),
        (
            "blunt fin, tetrahedra, for the shock",
            points_of_cells(&blunt_fin_tets(data)?)?,
            PRINTED_ELSEWHERE[0],
            "2 932; –; 0.33",
        ),
        (
            "two wells, for the reservoir",
            points_of_cells(&reservoir()?)?,
            PRINTED_ELSEWHERE[1],
            "458; –; 1.8 by 64",
        ),
    ];
    let mut rows = Vec::new();
    for (name, points, functions, printed) in &fields {
        let range = range_of(points);
        for basis in [Basis::Gaussian, Basis::Ellipsoid] {
            let (encoding, errors, took) = fit(points, basis, *functions)?;
            let percent = |error: f64| short(100.0 * error / range);
            let leaves = encoding.leaves();
            let longest = leaves.iter().map(|(_, functions)| *functions).max().unwrap_or(0);
            rows.push(vec![
                (*name).to_owned(),
                basis.name().to_owned(),
                encoding.functions().len().to_string(),
                format!("{} of ≤ {longest}", leaves.len()),
                percent(errors.max),
                percent(errors.mean),
                format!("{:.3}", 100.0 * encoding.epsilon() / range),
                short(took),
                (*printed).to_owned(),
            ]);
        }
    }
    let head = [
        "field",
        "basis",
        "functions",
        "cells",
        "greatest, %",
        "mean, %",
        "ε, %",
        "encoded in, s",
        "printed",
    ];
    page.table(&head, &rows);
    Ok(())
}

/// What one way to draw volumes comes to, at each number of slabs.
struct Way {
    name: &'static str,
    classify: Classify,
    /// To the limit.
    rmse: Vec<f64>,
    ms: Vec<f64>,
}

impl Way {
    fn new(name: &'static str, classify: Classify) -> Self {
        Self { name, classify, rmse: Vec::new(), ms: Vec::new() }
    }

    /// The milliseconds of an error, between rows by logarithms; `None` where no two rows are on both sides of it.
    fn ms_at(&self, wanted: f64) -> Option<f64> {
        let mut pairs = self.rmse.windows(2).zip(self.ms.windows(2));
        pairs.find_map(|(rmse, ms)| {
            let [coarse, fine] = [rmse[0], rmse[1]].map(f64::ln);
            let share = (wanted.ln() - coarse) / (fine - coarse);
            let ms = ms[0].ln() + share * (ms[1].ln() - ms[0].ln());
            (0.0..=1.0).contains(&share).then(|| ms.exp())
        })
    }
}

/// Slices, slabs and splats of the functions: errors to their limit, and times; planes and isosurfaces.
fn modes(page: &mut Page<'_>, scene: &Scene) -> Result<()> {
    const COUNTS: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];
    let limit_mode = SplatSettings { slabs_per_voxel: 32.0, ..scene.splat };
    let limit = page.draw(&with(scene, limit_mode), SIZE, Refine::Full, 0)?;
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    page.say(&format!(
        "Drawing modes: neghip, 32³, by {} ellipsoids at {SIZE} × {SIZE} as in the paper, against the limit that all of them \
         have, each as dB and as pictures a second, by the {} engine ({}) on {cores} threads. *Slices* colour the value in the \
         middle of each slab, as the paper does; *splats* add each function's integral to the slabs that it reaches, and colour \
         the mean: what the paper thought impossible for functions that overlap; *slabs* colour all values between their faces. \
         One slab a voxel is 32 along an axis, as many as the paper's slices.",
        scene.own_kernels().map_or(0, |(_, count)| count),
        limit.engine.name(),
        limit.adapter,
    ));
    let limit = wide(&limit.light);
    let mut ways = [
        Way::new("slices", Classify::After),
        Way::new("splats", Classify::Mean),
        Way::new("slabs", Classify::PreIntegrated),
    ];
    let mut rows = Vec::new();
    for slabs_per_voxel in COUNTS {
        let mut row = vec![slabs_per_voxel.to_string()];
        for way in &mut ways {
            let mode = SplatSettings { slabs_per_voxel, classify: way.classify, ..scene.splat };
            let still = page.draw(&with(scene, mode), SIZE, Refine::Full, FRAMES)?;
            way.rmse.push(compare(&still, &limit)?.rmse);
            way.ms.push(least_ms(&still));
            row.push(row_of(&still, &limit)?);
        }
        rows.push(row);
    }
    let names = ways.iter().map(|way| way.name);
    let head: Vec<&str> = std::iter::once("slabs a voxel").chain(names).collect();
    page.table(&head, &rows);
    let told = ways.iter().map(|way| {
        // The second row.
        let rate = 1e3 / way.ms[1];
        format!("{} {} ({})", way.name, short(rate), if rate >= AIM { "met" } else { "missed" })
    });
    page.say(&format!(
        "The aim is {AIM} pictures a second of volume for {} functions by as many slabs as the paper has slices, where it has \
         2.6: {}.",
        PRINTED[0],
        told.collect::<Vec<_>>().join(", ")
    ));
    orders(page, &ways, &COUNTS);
    at_equal_error(page, &ways, &COUNTS);
    surfaces(page, scene)
}

/// A picture's dB and pictures a second.
fn row_of(still: &Still, limit: &Light) -> Result<String> {
    let error = db(psnr_from_rmse(compare(still, limit)?.rmse));
    Ok(format!("{error} · {}", short(1e3 / least_ms(still))))
}

/// The order of convergence of each way.
fn orders(page: &mut Page<'_>, ways: &[Way], counts: &[f64]) {
    page.say(
        "The order of each: the binary logarithm of how many times the error falls where slabs are halved. In theory it is 2 for \
         slices and splats; slabs begin higher and end where their limit is no nearer.",
    );
    let rows: Vec<Vec<String>> = counts
        .windows(2)
        .enumerate()
        .map(|(i, pair)| {
            let order = |way: &Way| format!("{:.2}", (way.rmse[i] / way.rmse[i + 1]).log2());
            let name = format!("{} to {}", pair[0], pair[1]);
            std::iter::once(name).chain(ways.iter().map(order)).collect()
        })
        .collect();
    let names = ways.iter().map(|way| way.name);
    page.table(&std::iter::once("slabs a voxel").chain(names).collect::<Vec<_>>(), &rows);
}

/// What splats and slabs take for the error of slices.
fn at_equal_error(page: &mut Page<'_>, ways: &[Way], counts: &[f64]) {
    page.say(
        "At equal error: the milliseconds that each takes for the error of so many slices, between the rows above by logarithms; \
         – where that lies beyond them.",
    );
    let slices = &ways[0];
    let rows: Vec<Vec<String>> = counts
        .iter()
        .enumerate()
        .map(|(i, count)| {
            let error = slices.rmse[i];
            let ms = |way: &Way| way.ms_at(error).map_or("–".to_owned(), short);
            let own = [count.to_string(), db(psnr_from_rmse(error)), short(slices.ms[i])];
            own.into_iter().chain(ways[1..].iter().map(ms)).collect()
        })
        .collect();
    let own = ["slices a voxel", "dB", "slices, ms"].into_iter().map(str::to_owned);
    let head: Vec<String> =
        own.chain(ways[1..].iter().map(|way| format!("{}, ms", way.name))).collect();
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
}

/// Cutting planes and an isosurface of the same functions.
fn surfaces(page: &mut Page<'_>, scene: &Scene) -> Result<()> {
    page.say(&format!(
        "The same functions, one slab a voxel, at {SIZE} × {SIZE}: opaque planes through the middle, and the isosurface of the \
         middle value, lit by analytic gradients."
    ));
    let volume = scene.volume().context("a field")?;
    let middle = f64::midpoint(volume.statistics.min, volume.statistics.max);
    let scenes = [
        ("one cutting plane", on_planes(scene, &[(2, 0.5)]), "7 to 75, over its data sets"),
        ("three cutting planes", on_planes(scene, &[(0, 0.5), (1, 0.5), (2, 0.5)]), "–"),
        ("isosurface", on_isosurface(scene, middle), "0.4, of the convection"),
    ];
    let mut rows = Vec::new();
    for (name, scene, printed) in scenes {
        let still = page.draw(&scene, SIZE, Refine::Full, FRAMES)?;
        rows.push(vec![name.to_owned(), short(1e3 / least_ms(&still)), printed.to_owned()]);
    }
    page.table(&["mode", "pictures a second", "printed"], &rows);
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

/// The scene without any matter.
fn cleared(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let Some(transfer) = scene.transfer_mut() {
        transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
    }
    scene
}

/// Opaque planes alone: across which axis, and where, as a share.
fn on_planes(scene: &Scene, planes: &[(usize, f64)]) -> Scene {
    let mut scene = cleared(scene);
    let lattice = scene.lattice();
    let across = |(axis, share): &(usize, f64)| Slice::across(&lattice, *axis, *share, 1.0);
    scene.inside.slices = planes.iter().map(across).collect();
    scene
}

/// A lit isosurface alone.
fn on_isosurface(scene: &Scene, value: f64) -> Scene {
    let mut scene = cleared(scene);
    scene.shading.lighting = Some(Lighting::first_look());
    scene.inside.isosurfaces = vec![Isosurface { value, opacity: 1.0, colour: Some(SURFACE) }];
    scene
}

/// Opacities and colours of values.
fn coloured(scene: Scene, opacity: &[(f64, f64)], map: ColourMap, range: [f64; 2]) -> Scene {
    let colour = ColourSource::Map { map, range };
    with_transfer(scene, TransferFunction::of(opacity.to_vec(), colour))
}

/// All of the field from a direction, a little smaller than its frame.
fn seen_from(scene: Scene, direction: DVec3, up: DVec3) -> Scene {
    let camera: Camera = framing_camera(&scene.lattice(), direction, up);
    Scene { camera, ..scene }
}

/// The same from where it is looked at.
fn whole(scene: Scene) -> Scene {
    let Camera { direction, up, .. } = scene.camera;
    seen_from(scene, direction, up)
}

/// A scene as bytes over black, so many pixels wide and high.
fn panel(page: &Page<'_>, scene: &Scene, size: usize) -> Result<Vec<u8>> {
    let still = page.draw(scene, u32::try_from(size)?, Refine::Full, 0)?;
    Ok(on_black(&still.light))
}

/// A figure of panels side by side.
fn figure(
    page: &mut Page<'_>,
    number: &str,
    panels: Vec<Vec<u8>>,
    size: usize,
    words: &str,
) -> Result<()> {
    let name = format!("jang-{number}.png");
    page.mosaic(&name, &[panels], size)?;
    page.figure(&name, words);
    Ok(())
}

/// `812 functions, greatest error 5.3 %, mean 0.42 %`.
fn told(encoded: &Encoded, volume: &ScalarVolume) -> String {
    let range = volume.statistics.max - volume.statistics.min;
    let percent = |error: f64| short(100.0 * error / range);
    let Errors { max, mean, .. } = encoded.errors;
    let count = encoded.encoding.functions().len();
    format!("{count} functions, greatest error {} %, mean {} %", percent(max), percent(mean))
}

/// Figures 7 to 13 in kind.
fn figures(page: &mut Page<'_>, data: &Path, neghip: &Scene) -> Result<()> {
    page.say(
        "Figures 7 to 13 in kind, all by ellipsoids, with the greatest and the mean error at the samples in % of their range.",
    );
    of_density(page, &blunt_fin_tets(data)?)?;
    of_convection(page)?;
    of_reservoir(page)?;
    let volume = neghip.volume().context("a field")?;
    let range = [volume.statistics.min, volume.statistics.max];
    let at = |share: f64| range[0] + share * (range[1] - range[0]);
    let opacity = [(at(0.08), 0.0), (at(0.3), 0.06), (at(1.0), 0.35)];
    let scene = coloured(neghip.clone(), &opacity, ColourMap::Turbo, range);
    let panels = vec![panel(page, &scene, PANEL)?];
    let words = format!(
        "Figure 12: neghip at 32³, semi-transparent, by {} functions.",
        scene.own_kernels().map_or(0, |(_, count)| count)
    );
    figure(page, "12", panels, PANEL, &words)?;
    left_over(page)
}

/// Figures 7 to 9 and 13: the blunt fin, for the shock, for the density about the same body, and as itself.
fn of_density(page: &mut Page<'_>, grid: &Grid) -> Result<()> {
    let volume = scalar(grid)?;
    let range = [volume.statistics.min, volume.statistics.max];
    let clear = [(range[0], 0.0), (range[1], 0.0)];
    let by = |functions: usize| -> Result<(Scene, Encoded)> {
        let (_, encoded) = fitted(grid, functions)?;
        let scene = scene_of(&volume, grid, &encoded);
        Ok((coloured(scene, &clear, ColourMap::Turbo, range), encoded))
    };
    // Along the fin, so far beside the plane of symmetry.
    let plane = |scene: &Scene, share: f64, colours: [f64; 2]| {
        let scene = on_planes(scene, &[(2, share)]);
        let scene = coloured(scene, &clear, ColourMap::Turbo, colours);
        seen_from(scene, DVec3::NEG_Z, DVec3::Y)
    };
    let (scene, encoded) = by(PRINTED_ELSEWHERE[0])?;
    let panels = vec![panel(page, &plane(&scene, 0.04, [range[0], ABOUT_THE_SHOCK[1]]), PANEL)?];
    let words = format!(
        "Figure 7: a cutting plane through the blunt fin's bow shock, which stands for the X 38's, by {}.",
        told(&encoded, &volume)
    );
    figure(page, "7", panels, PANEL, &words)?;
    let mut panels = Vec::new();
    let mut counts = Vec::new();
    for functions in FEWER_AND_MORE {
        let (scene, encoded) = by(functions)?;
        // A narrow range of values about the shock, as there.
        let mut scene = plane(&scene, 0.35, ABOUT_THE_SHOCK);
        (scene.camera.focal_point, scene.camera.parallel_scale) = SHOCK;
        panels.push(panel(page, &scene, HALF)?);
        counts.push(told(&encoded, &volume));
    }
    let words = format!(
        "Figure 8: a plane beside it, colours over a narrow range: by {}.",
        counts.join("; by ")
    );
    figure(page, "8", panels, HALF, &words)?;
    let (scene, encoded) = by(OF_DENSITY)?;
    let surface = on_isosurface(&scene, IN_THE_SHOCK);
    let surface = seen_from(surface, DVec3::new(0.55, -0.35, -0.75), DVec3::Y);
    let panels = vec![panel(page, &surface, PANEL)?];
    let words = format!(
        "Figure 9: the isosurface of the density {IN_THE_SHOCK}, about the shock, by {}. The paper's mean error is just under 2 %.",
        told(&encoded, &volume)
    );
    figure(page, "9", panels, PANEL, &words)?;
    let (scene, encoded) = by(PRINTED[1])?;
    let at = |share: f64| range[0] + share * (range[1] - range[0]);
    let opacity = [(at(0.2), 0.0), (at(0.45), 0.08), (at(1.0), 0.4)];
    let scene = whole(coloured(scene, &opacity, ColourMap::Turbo, range));
    let mut bytes = panel(page, &scene, PANEL)?;
    let leaves = encoded.encoding.leaves();
    // All of them would hide the field.
    let middle = scene.lattice().centre().z;
    let cut = leaves.iter().map(|(own, _)| *own).filter(|[l, h]| l.z <= middle && middle < h.z);
    let cut: Vec<[DVec3; 2]> = cut.collect();
    draw_boxes(&mut bytes, &scene.camera, &cut);
    let words = format!(
        "Figure 13: the blunt fin by {}, with its hierarchy: those of the tree's {} cells that the middle plane cuts, {}.",
        told(&encoded, &volume),
        leaves.len(),
        cut.len()
    );
    figure(page, "13", vec![bytes], PANEL, &words)
}

/// Figure 10.
fn of_convection(page: &mut Page<'_>) -> Result<()> {
    let grid = convection();
    let volume = scalar(&grid)?;
    let (_, encoded) = fitted(&grid, 400)?;
    let scene = scene_of(&volume, &grid, &encoded);
    let scene = seen_from(scene, DVec3::new(-0.5, 0.75, -0.4), DVec3::Z);
    let opacity = [(0.0, 0.08), (0.5, 0.01), (1.0, 0.08)];
    let scene = coloured(scene, &opacity, ColourMap::CoolWarm, [0.0, 1.0]);
    let panels = vec![panel(page, &scene, HALF)?, panel(page, &on_isosurface(&scene, 0.5), HALF)?];
    let words = format!(
        "Figure 10: temperatures of a convection in a box by a formula, semi-transparent, and the isosurface 0.5, by {}.",
        told(&encoded, &volume)
    );
    figure(page, "10", panels, HALF, &words)
}

/// Figure 11.
fn of_reservoir(page: &mut Page<'_>) -> Result<()> {
    let grid = reservoir()?;
    let volume = scalar(&grid)?;
    let (_, encoded) = fitted(&grid, PRINTED_ELSEWHERE[1])?;
    let scene = scene_of(&volume, &grid, &encoded);
    let most = volume.statistics.max.abs().max(volume.statistics.min.abs());
    let opacity = [(-most, 0.5), (-0.3 * most, 0.06), (0.0, 0.01), (0.3 * most, 0.06), (most, 0.5)];
    let scene = whole(coloured(scene, &opacity, ColourMap::CoolWarm, [-0.6 * most, 0.6 * most]));
    let words = format!(
        "Figure 11: a volume from 147 456 tetrahedra, the pressure between two wells, which stands for the reservoir's, by {}.",
        told(&encoded, &volume)
    );
    let panels = vec![panel(page, &scene, PANEL)?];
    figure(page, "11", panels, PANEL, &words)
}

/// What functions leave of a field made in code, in space and on planes.
fn left_over(page: &mut Page<'_>) -> Result<()> {
    let grid = demo_grid("blobs", 48)?;
    let what = (&grid, grid.field(None)?, Component::Index(0));
    let (_, encoded) = fitted(&grid, 120)?;
    let words = format!(
        "What {} leave of blobs at 48³, in space and on planes: blue where they are too much.",
        told(&encoded, scalar(&grid)?.as_ref())
    );
    let left = residual(what, &encoded.encoding, &Ticket::new())?;
    let grid = Grid { fields: vec![left], ..grid };
    let volume = scalar(&grid)?;
    let differences = presets::of_differences(&volume.statistics);
    let scene = opening(SampleSource::default(), volume, grid.space.as_deref());
    let scene = with_transfer(scene, differences);
    let planes = on_planes(&scene, &[(0, 0.5), (1, 0.5), (2, 0.5)]);
    let panels = vec![panel(page, &scene, HALF)?, panel(page, &planes, HALF)?];
    figure(page, "residual", panels, HALF, &words)
}

/// Lays the edges of boxes over a square picture of bytes, each pixel once however many cover it.
fn draw_boxes(rgba: &mut [u8], camera: &Camera, boxes: &[[DVec3; 2]]) {
    const SHARE: f64 = 0.45;
    let side = (rgba.len() / 4).isqrt();
    let mut covered = vec![false; side * side];
    let corner = |[low, high]: [DVec3; 2], which: usize| {
        let at = |axis: usize| if which >> axis & 1 == 1 { high[axis] } else { low[axis] };
        camera.pixel_from_view(camera.to_view(DVec3::from([0, 1, 2].map(at))), [side as f64; 2])
    };
    for own in boxes {
        let edges = (0..8).flat_map(|from| (0..3).map(move |axis| (from, from | 1 << axis)));
        for (from, to) in edges.filter(|(from, to)| from != to) {
            let Some((from, to)) = corner(*own, from).zip(corner(*own, to)) else { continue };
            let steps = (2.0 * (to - from).length()).ceil().max(1.0) as usize;
            for step in 0..=steps {
                let at = from.lerp(to, step as f64 / steps as f64).floor();
                let is_in = at.min_element() >= 0.0 && at.max_element() < side as f64;
                if is_in {
                    covered[at.y as usize * side + at.x as usize] = true;
                }
            }
        }
    }
    for (pixel, _) in rgba.chunks_exact_mut(4).zip(&covered).filter(|(_, covered)| **covered) {
        for byte in &mut pixel[..3] {
            *byte = (f64::from(*byte) + SHARE * (255.0 - f64::from(*byte))).round() as u8;
        }
    }
}
