//! `voxsplat render`.

use std::path::Path;
use std::time::Instant;

use glam::DVec3;

use super::flags::{RefineFlag, RenderFlags, SceneFlags};
use super::flow::FlowFlags;
use super::notes::{self, Causes, did_not_converge, is_one_colour, no_room};
use super::polygons::PolygonFlags;
use super::progress::Progress;
use super::stats::{LeftOutRow, Stats, asked_of};
use super::vectors::{VectorFlags, Vectors};
use super::{Destination, Failure, note, open, refuse_one_place};
use crate::core::{Srgb8, Ticket, counted, plain_number};
use crate::kernel::Kernel;
use crate::rbf::few_digits;
use crate::scene::annotations::Layout;
use crate::scene::{
    Annotation, BESIDE, Background, Classify, CutSettings, Effect, Ground, Inside,
    MOST_SLABS_PER_VOXEL, PolygonLayer, SampleSource, Scene, SplatSettings, VectorLayer, View,
    Visibility, among_axes, among_surfaces,
};
use crate::task::cuts::why_no_cut_of;
use crate::task::engine::{Engine, EngineChoice};
use crate::task::field_on_mesh::{Found, field_on_meshes};
use crate::task::loop_file::{self, Cycle, LoopFormat, MOST_FRAMES};
use crate::task::picture_file::{self, PictureFormat};
use crate::task::still::{Refine, StillRequest};
use crate::task::{annotations, cells};

/// A picture that takes so many times its budget is told of.
const MUCH_LONGER: f64 = 2.0;

/// What is behind a picture unless flags say otherwise.
const BLACK: Srgb8 = Srgb8([0; 3]);

pub(super) fn run(flags: &RenderFlags) -> Result<(), Failure> {
    let refine = refine(flags)?;
    flags.shading.refuse_lights_put_out()?;
    let has_slices = !flags.inside.slice.is_empty() || !flags.inside.slice_plane.is_empty();
    for (flag, is_given) in [
        ("--slice-only-shown", flags.inside.slice_only_shown),
        ("--slice-edges", flags.inside.slice_edges),
    ] {
        if is_given && !has_slices {
            note(&format!("no slice is asked for, so {flag} changes nothing; add --slice"));
        }
    }
    let seconds = flags.vectors.loop_seconds(&flags.output)?;
    if let Some(frames) = flags.vectors.cycle {
        return run_loop(flags, frames, seconds);
    }
    let format = format(&flags.output)?;
    if format == PictureFormat::Exr && flags.background.is_some() {
        // Not refused: scripts say it of pictures of either kind.
        note("an EXR is light with alpha: --background changes nothing in it");
    }
    if flags.cells {
        refuse_cells(flags, format)?;
    }
    if flags.annotations.is_some() && format == PictureFormat::Exr {
        return Err(Failure::Usage(
            "expected a PNG with --annotations, found an EXR, which holds light alone; write to a \
             name that ends in .png, or leave --annotations out"
                .to_owned(),
        ));
    }
    let splat = flags.mode.resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    let cut = CutSettings { moving: flags.moving.unwrap_or_default(), ..flags.cut.settings() };
    let splat = SplatSettings { cut, ..splat };
    refuse_among_triangles(&splat, &flags.vectors, &flags.polygons, &flags.flow)?;
    if flags.refine == Some(RefineFlag::Converged) && splat.visibility != Visibility::Slabs {
        return Err(Failure::Usage(format!(
            "expected --refine converged with --visibility slabs, which it doubles, found \
             --visibility {}; choose --visibility slabs, or --refine full",
            splat.visibility.name()
        )));
    }
    let stats = flags.stats.as_deref();
    open::check_name(&flags.input.file)?;
    let mut places = vec![
        ("FILE", Some(flags.input.file.as_path())),
        ("--transfer", flags.scene.transfer.as_deref()),
        ("--output", Some(&flags.output)),
        ("--stats", stats),
    ];
    refuse_one_place(&places)?;
    // One mesh may be embedded twice.
    places.swap_remove(0);
    for (flag, path) in flags.polygons.files() {
        places.push((flag, Some(path)));
        refuse_one_place(&places)?;
        places.pop();
    }
    // Drawing may take long: places that cannot be written to are found before it.
    let picture_to = Destination::check(&flags.output, "the picture")?;
    let stats_to = stats.map(|path| Destination::check(path, "the statistics")).transpose()?;
    let start = Instant::now();
    let Meant { scene, mut effects, space } = scene(flags, splat)?;
    let splat = scene.splat;
    let asked = asked_of(&scene);
    let background = scene.background;
    let causes = Causes::of(&scene);
    let alone = !scene.shows_field();
    let has_vectors = !scene.vectors().is_empty();
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let kernels_total = scene.own_kernels().map_or(scene.voxel_count(), |(_, count)| count);
    let kernels_total = (kernels_total, LeftOutRow::of(&scene));
    let all_left_out = all_left_out(&scene);
    let engine = Engine::start(flags.engine.choice()?, || ());
    let view = View::new(&scene, flags.resolution);
    let annotated = flags.annotations.map(|annotations| {
        annotations::laid_out(annotations, &scene, space.as_deref(), flags.resolution)
    });
    let request = StillRequest {
        scene,
        size: flags.resolution,
        refine,
        repeat: flags.repeat,
        time_passes: flags.stats.is_some(),
        smooth_edges: !flags.no_smooth_edges,
    };
    let ticket = Ticket::new();
    let progress = Progress::of(&ticket, "drawing");
    let mut still = if flags.cells {
        let mut still = engine.still_with_cells(request, &ticket).map_err(Failure::failed)?;
        let cells = still.cells.take().ok_or_else(|| Failure::Failed(no_cut(refine)))?;
        cells::draw_edges(&mut still.rgba, &view, &cells);
        still
    } else {
        engine.still(request, &ticket).map_err(Failure::failed)?
    };
    drop(progress);
    if flags.engine.engine == EngineChoice::Native
        && let Some(reason) = &still.not_native
    {
        note(&format!("the native engine does not draw {reason}; {} drew this", still.adapter));
    }
    // Less than half a step of an 8-bit channel everywhere: nobody would see anything.
    if still.light.iter().all(|pixel| pixel[3] < 1.0 / 512.0) {
        note(&match alone {
            true if !has_vectors => causes.no_surface_seen(),
            true => "nothing can be seen in the picture; look at --vector-opacity and at the lengths of the \
                     vectors, and at the camera"
                .to_owned(),
            false => causes.nothing_seen(still.kernels_active),
        });
    } else if is_one_colour(&still.rgba, background) {
        note(&causes.one_colour(still.kernels_active));
    }
    let are_vectors = |effect: &Effect| matches!(effect, Effect::Vectors | Effect::SecondVectors);
    let needs_lights = !effects.iter().all(are_vectors);
    if needs_lights && !still.drawn.is_shaded && !alone {
        effects.retain(are_vectors);
        note(
            "the picture that fits is an octree cut, which shows no lights and no shading tables: it is \
             of the transfer function alone; give --budget-ms, or a smaller --max-error",
        );
    }
    if let Some(why) = still.why_not_octree {
        note(&format!("--moving octree: this picture is of no cut: {why}"));
    }
    if still.drawn.vectors_halved > 0 {
        note(&format!(
            "so many vectors lie over one place that means of {} are drawn; --vector-coarser draws means by \
             choice, and a larger --resolution shows more of them",
            8_u64.pow(still.drawn.vectors_halved)
        ));
    }
    if let Some(convergence) = &still.convergence
        && !convergence.is_reached()
    {
        note(&did_not_converge(convergence));
    }
    if let Some(cut_flags) = flags.cut.given()
        && still.drawn.nodes == 0
    {
        note(&format!(
            "the picture that fits is no octree cut of classified voxels, so {cut_flags} changed nothing in it"
        ));
    }
    // Prices are guesses until the first picture of a kind has been drawn.
    let first_ms = still.drawn.wall_ms;
    if let Refine::Budget { budget_ms } = refine
        && first_ms > MUCH_LONGER * budget_ms
    {
        note(&format!(
            "the picture took {first_ms:.0} ms of the {} ms asked for: what rays cost is learnt from \
             pictures that were drawn before, and no picture is less than 48 pixels high, or a sixth of what was asked for, up to 128; --repeat draws more",
            plain_number(budget_ms)
        ));
    }
    if let Some(Layout { primitives, left_out, .. }) = annotated {
        annotations::draw(&mut still.rgba, still.size, &primitives);
        if !left_out.is_empty() {
            note(&no_room(&left_out));
        }
    }
    if let Some(told) = all_left_out {
        note(&told);
    }
    picture_to.write(&picture_file::bytes(&still, format).map_err(Failure::Failed)?)?;
    if let Some(stats_to) = stats_to {
        let stats = Stats::of(&still, splat, (asked, &effects), refine, kernels_total, load_ms);
        let text = serde_json::to_string_pretty(&stats).map_err(Failure::failed)? + "\n";
        stats_to.write(text.as_bytes())?;
    }
    Ok(())
}

/// What is said where nothing is left of a sum of functions.
fn all_left_out(scene: &Scene) -> Option<String> {
    let (left_out, rms) = scene.left_out_functions()?;
    let all = scene.volume()?.functions.as_ref()?.functions().len();
    (all > 0 && left_out == all as u64).then(|| {
        format!(
            "all basis functions are left out (rms {}), so that one value is everywhere; give a smaller --functions-error",
            few_digits(rms)
        )
    })
}

/// `--loop`: one whole cycle of the vectors.
fn run_loop(flags: &RenderFlags, frames: u32, seconds: f64) -> Result<(), Failure> {
    let path = &flags.output;
    if path == Path::new("-") {
        return Err(Failure::Usage(
            "expected a file for --loop, found - for standard output, which takes one picture; name a file \
             that ends in .gif, or in .png for numbered pictures"
                .to_owned(),
        ));
    }
    LoopFormat::of(path).map_err(Failure::Usage)?;
    if !(2..=MOST_FRAMES).contains(&frames) {
        return Err(Failure::Usage(format!(
            "expected --loop with 2 to {MOST_FRAMES} pictures, found {frames}; choose another number"
        )));
    }
    let given = [
        ("--stats", flags.stats.is_some()),
        ("--repeat", flags.repeat > 0),
        ("--cells", flags.cells),
        ("--refine", flags.refine.is_some()),
    ];
    if let Some((flag, _)) = given.into_iter().find(|(_, given)| *given) {
        return Err(Failure::Usage(format!(
            "expected --loop without {flag}, which is of one picture, found both; leave one out"
        )));
    }
    let splat = flags.mode.resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    refuse_among_triangles(&splat, &flags.vectors, &flags.polygons, &flags.flow)?;
    let Meant { scene, space, .. } = scene(flags, splat)?;
    let annotations = flags.annotations.unwrap_or_default();
    let layout = annotations::laid_out(annotations, &scene, space.as_deref(), flags.resolution);
    if !layout.left_out.is_empty() {
        note(&no_room(&layout.left_out));
    }
    let cycle = Cycle { frames, seconds };
    let engine = Engine::start(flags.engine.choice()?, || ());
    let ticket = Ticket::new();
    let written = &layout.primitives;
    let _progress = Progress::of(&ticket, "drawing the loop");
    loop_file::write(&engine, &scene, (flags.resolution, written), cycle, path, &ticket)
        .map(drop)
        .map_err(Failure::failed)
}

/// What flags mean.
struct Meant {
    scene: Scene,
    /// What it asks for beside the transfer function.
    effects: Vec<Effect>,
    /// What the file calls its space.
    space: Option<String>,
}

fn scene(flags: &RenderFlags, splat: SplatSettings) -> Result<Meant, Failure> {
    let input = open::grid(&flags.input, flags.scene.field.as_deref())?;
    for warning in &input.warnings {
        note(warning);
    }
    let background = if flags.no_background {
        Background::Transparent
    } else {
        Background::Colour(flags.background.unwrap_or(BLACK))
    };
    let mode = open::Mode::of(&flags.mode, splat, flags.mode.are_given());
    let mode = mode.with_levels(flags.inside.asks_for_levels());
    let mut scene = Scene { background, ..open::scene(&input, &flags.scene, mode)? };
    let of_voxels = of_classified_voxels(flags, &scene);
    if of_voxels
        || flags.refine == Some(RefineFlag::Coarse) && scene.splat.classify == Classify::Before
    {
        // Octree cuts of classified voxels show no lights, and nobody asked for any.
        scene.shading.lighting = None;
    }
    let splat = scene.splat;
    let shading = flags.shading.resolve(&scene, &splat);
    let shading = shading.map_err(|error| Failure::Usage(error.to_string()))?;
    let volume = open::volume(&scene)?;
    let inside = flags.inside.resolve_in(&flags.scene, volume, &splat);
    let inside = inside.map_err(Failure::Usage)?;
    let of_voxels = of_voxels || flags.refine == Some(RefineFlag::Coarse) && !reconstructs(&splat);
    if of_voxels {
        refuse_coarse(&inside)?;
    }
    inside.beside(volume).iter().for_each(|what| note(what));
    let hiding = flags.mode.of_hiding();
    let hiding_is_left_open = hiding.is_empty();
    let idle = notes::idle_beside_projection(&inside, &flags.scene, &flags.shading, hiding);
    idle.iter().for_each(|what| note(what));
    let opens_with_scalar = flags.scene.field.is_some() || flags.scene.component.is_some();
    let is_plain = !opens_with_scalar
        && flags.scene.of_colours().is_none()
        && flags.mode.of_field().is_none()
        && hiding_is_left_open
        && flags.shading.given().is_empty()
        && flags.refine != Some(RefineFlag::Coarse)
        && inside == Inside::default();
    let mut vectors = flags.vectors.layer(&input, &scene, opens_with_scalar, is_plain)?;
    let flow = flags.flow.layers(&mut vectors)?;
    if let Some(Vectors { alone, .. }) = vectors {
        if let Some(flag) = flags.scene.of_colours().filter(|_| alone) {
            return Err(Failure::Usage(format!(
                "expected no {flag} with vectors alone, which it changes nothing of, found both; say it of \
                 the vectors, as with --vector-opacity and --vector-colormap, or show them beside the field"
            )));
        }
        if let Some(flag) = flags.mode.of_field().filter(|_| alone) {
            return Err(Failure::Usage(format!(
                "expected no {flag} with vectors alone, which it changes nothing of, found both; leave it out \
                 (--vector-extent and the like shape their splats), or show them beside the field"
            )));
        }
        if flags.max_error.is_some() {
            return Err(Failure::Usage(
                "expected --budget-ms with vectors, found --max-error, which finds octree cuts, and these \
                 have no vectors; give --budget-ms, or leave --refine out"
                    .to_owned(),
            ));
        }
    }
    let mut polygons = flags.polygons.layers((&input.grid.lattice, input.grid.space.as_deref()))?;
    let lines: Vec<DVec3> = flow.iter().flat_map(|(_, layer)| layer.mesh.spread_places()).collect();
    let surfaces: Vec<DVec3> =
        polygons.iter().flat_map(|(_, layer)| layer.mesh.spread_places()).collect();
    polygons.extend(flow);
    if scene.shows_field() && flags.polygons.embeds_opaque(&input.path) {
        note(&format!(
            "the surface of the file hides its own field; add an opacity, as --mesh FILE,opacity=0.3: {}",
            input.path.display()
        ));
    }
    if !polygons.is_empty() && of_voxels {
        return Err(Failure::Usage(
            "expected --refine full or converged with polygons, found --refine coarse, whose pictures may \
             be octree cuts that do not show it; leave --refine out"
                .to_owned(),
        ));
    }
    let scene = Scene { shading, inside, ..scene };
    let mut scene = with_layers(scene, &flags.scene, vectors, polygons)?;
    let written = flags.annotations.unwrap_or_default();
    if flags.scene.camera_focal_point.is_none() && flags.scene.parallel_scale.is_none() {
        if written.has(Annotation::Axes) {
            scene.camera = among_axes(&scene, scene.camera);
        }
        let [width, height] = flags.resolution.map(f64::from);
        let beside = annotations::beside_bars(written, &scene, flags.resolution);
        scene.camera.parallel_scale *= (height / beside[0]).max(1.0) / (height / width).max(1.0);
    }
    if let Some(refusal) = scene.refusals().first() {
        return Err(Failure::Usage(refusal.to_string()));
    }
    let hides = |places: &[DVec3]| scene.little_seen_of_places(places.iter().copied()).is_some();
    let hides_vectors = |VectorLayer { field, .. }: &VectorLayer| {
        let places = (0..field.vectors.len()).map(|i| field.places.at(i).0);
        scene.little_seen_of_places(places).is_some()
    };
    for (what, is_hidden, leave_out) in [
        ("vectors", scene.vectors().iter().any(hides_vectors), "--vectors-only"),
        ("streamlines or arrows", hides(&lines), "--vectors-only"),
        ("labels or meshes", hides(&surfaces), "--opacity 0:0"),
    ] {
        if is_hidden {
            note(&format!(
                "the {what} lie in opaque matter, which hides them: leave it out ({leave_out}), lower its --opacity, or \
                 cut it open (--clip-box)"
            ));
        }
    }
    let points = scene.volume().and_then(|volume| volume.scattered.as_ref());
    let strays = points.filter(|_| scene.splat.kernel == Kernel::Ellipsoids);
    if let Some(count) = strays.map(|points| points.strays()).filter(|count| *count > 0) {
        let (lie, are) = if count == 1 { ("lies", "is") } else { ("lie", "are") };
        note(&format!("{} {lie} far from all others, and {are} left out", counted(count, "point")));
    }
    let has_values_of_cells = scene.volume().is_some_and(|volume| volume.has_values_of_cells());
    if has_values_of_cells && scene.splat.kernel == Kernel::Cells && scene.inside.has_isosurfaces()
    {
        note(
            "each cell has one value: isosurfaces are the faces between cells below and above theirs, in steps; --kernel \
             ellipsoids has smooth ones",
        );
    }
    let effects = scene.effects();
    Ok(Meant { scene, effects, space: input.grid.space })
}

/// Refuses what needs rays beside a field that only triangles draw. Vectors alone have no such field.
pub(super) fn refuse_among_triangles(
    splat: &SplatSettings,
    vectors: &VectorFlags,
    polygons: &PolygonFlags,
    flow: &FlowFlags,
) -> Result<(), Failure> {
    let ground = Ground::of_mode(splat).filter(|_| !vectors.vectors_only);
    let Some(Ground::Triangles(found)) = ground else { return Ok(()) };
    let given = [vectors.named(), polygons.given(), flow.given()];
    match given.into_iter().flatten().next() {
        Some(flag) => Err(Failure::Usage(format!(
            "expected a mode that tiles draw with {flag}, found {found}, which only triangles draw; choose \
             --backend auto, a smaller --extent or another --kernel, or leave {flag} out"
        ))),
        None => Ok(()),
    }
}

/// A scene with vectors and polygons in it, all in the picture unless the flags say what is.
///
/// # Errors
/// What its mode has no place for.
pub(super) fn with_layers(
    mut scene: Scene,
    flags: &SceneFlags,
    vectors: Option<Vectors>,
    polygons: Vec<(SampleSource, PolygonLayer)>,
) -> Result<Scene, Failure> {
    if let Some(vectors) = vectors {
        vectors.add_to(&mut scene);
    }
    tell_of_those_beside(&scene, &polygons);
    let is_open = flags.camera_focal_point.is_none() && flags.parallel_scale.is_none();
    let is_framed = is_open && !polygons.is_empty();
    for (source, layer) in polygons {
        scene.add(source, layer);
    }
    if is_framed {
        scene.camera = among_surfaces(&scene, scene.camera);
    }
    // Of vectors beside values that are projected a probe tells all the same.
    let refusal = scene.refusals().into_iter().find(|refusal| refusal.ground != Ground::Vectors);
    match refusal {
        Some(refusal) => Err(Failure::Usage(refusal.to_string())),
        None => coloured_by_field(scene),
    }
}

/// The scene with the field's values on polygons that are to have its colours.
fn coloured_by_field(mut scene: Scene) -> Result<Scene, Failure> {
    let is_asked = scene.polygons().iter().any(|layer| layer.look.by_field);
    if is_asked && scene.volume().is_none() {
        return Err(Failure::Usage(
            "expected a field of values with by=field, found none; name an array of the file, or leave by= out"
                .to_owned(),
        ));
    }
    for Found { values, told } in
        field_on_meshes(&scene, &Ticket::new()).map_err(Failure::failed)?
    {
        told.iter().for_each(|told| note(told));
        scene.give_field_values(values);
    }
    Ok(scene)
}

/// Notes the files whose surfaces lie beside the volume, all of a file's together.
fn tell_of_those_beside(scene: &Scene, polygons: &[(SampleSource, PolygonLayer)]) {
    for of_file in polygons.chunk_by(|(a, _), (b, _)| a.path == b.path) {
        let boxes = of_file.iter().map(|(_, layer)| layer.mesh.bounds());
        let whole = boxes.reduce(|[low, high], [from, to]| [low.min(from), high.max(to)]);
        if whole.is_some_and(|whole| !scene.may_reach(whole)) {
            note(&format!("{BESIDE}: {}", of_file[0].0.path.display()));
        }
    }
}

/// Whether the values that a mode classifies are those of a reconstructed field.
fn reconstructs(splat: &SplatSettings) -> bool {
    splat.visibility == Visibility::Slabs && splat.classify != Classify::Before
}

/// Whether an error asks for the octree cut of classified voxels, which shows nothing beside these: by flags, or because the
/// field has no cuts.
fn of_classified_voxels(flags: &RenderFlags, scene: &Scene) -> bool {
    let has_none = || why_no_cut_of(scene).is_some();
    flags.refine == Some(RefineFlag::Coarse)
        && flags.max_error.is_some()
        && (flags.cut.given().is_some() || has_none())
}

/// Refuses pictures that may be of an octree cut of classified voxels, which shows nothing of the inside.
fn refuse_coarse(inside: &Inside) -> Result<(), Failure> {
    match inside.effects().first().map(|effect| effect.name()) {
        Some(what) => Err(Failure::Usage(format!(
            "expected --refine full or converged with {what}, found --refine coarse, whose pictures may \
             be octree cuts that do not show it; leave --refine out"
        ))),
        None => Ok(()),
    }
}

/// Refuses `--cells` where flags alone say that there will be none to draw, or nowhere to draw them.
fn refuse_cells(flags: &RenderFlags, format: PictureFormat) -> Result<(), Failure> {
    if flags.refine != Some(RefineFlag::Coarse) {
        // A budget is kept, though only drawing tells whether what fits it is a cut.
        let add = match (flags.budget_ms, flags.max_error) {
            (None, None) => "--refine coarse with --max-error",
            _ => "--refine coarse",
        };
        return Err(Failure::Usage(format!(
            "expected --refine coarse with --cells, as only octree cuts have cells, found {}; add {add}",
            RefineFlag::found(flags.refine)
        )));
    }
    if format == PictureFormat::Exr {
        return Err(Failure::Usage(
            "expected a PNG with --cells, found an EXR, which holds light and no lines; write to a \
             name that ends in .png"
                .to_owned(),
        ));
    }
    Ok(())
}

/// Why a picture has no cells.
fn no_cut(refine: Refine) -> String {
    let expected = "expected a picture of an octree cut for --cells, found";
    match refine {
        Refine::Budget { budget_ms } => format!(
            "{expected} the mode itself, perhaps at a smaller size, which is the best picture within \
             {} ms; choose --moving octree, or --visibility every-sample, whose pictures within a time \
             are octree cuts, or leave --budget-ms out and say with --max-error how coarse a cut is to be",
            plain_number(budget_ms)
        ),
        _ => format!(
            "{expected} the full picture, as no octree cut is within this error of it; give a larger \
             --max-error"
        ),
    }
}

/// What the output's name asks for: PNG on stdout.
fn format(output: &Path) -> Result<PictureFormat, Failure> {
    if output == Path::new("-") {
        return Ok(PictureFormat::Png);
    }
    PictureFormat::of(output).map_err(Failure::Usage)
}

fn refine(flags: &RenderFlags) -> Result<Refine, Failure> {
    let usage = |sentence: &str| Err(Failure::Usage(sentence.to_owned()));
    if let Some(cut_flags) = flags.cut.given()
        && flags.refine != Some(RefineFlag::Coarse)
    {
        return Err(Failure::Usage(format!(
            "expected {cut_flags} with --refine coarse, found a picture of every voxel, in which there \
             is no cut; add --refine coarse, or leave {cut_flags} out"
        )));
    }
    if flags.mode.quick_functions_error.is_some() && flags.refine != Some(RefineFlag::Coarse) {
        return Err(Failure::Usage(format!(
            "expected --quick-functions-error with --refine coarse, found {}; add --refine coarse, or choose \
             --functions-error",
            RefineFlag::found(flags.refine)
        )));
    }
    if flags.moving.is_some()
        && (flags.refine != Some(RefineFlag::Coarse) || flags.max_error.is_some())
    {
        let found = match flags.max_error {
            Some(_) => "--max-error",
            None => RefineFlag::found(flags.refine),
        };
        return Err(Failure::Usage(format!(
            "expected --moving with --refine coarse and --budget-ms, found {found}; give these, or leave --moving out"
        )));
    }
    let of_voxels = flags.cut.given().is_some();
    match (flags.refine.unwrap_or(RefineFlag::Full), flags.budget_ms, flags.max_error) {
        (RefineFlag::Full, None, None) => Ok(Refine::Full),
        (RefineFlag::Converged, None, None) => {
            Ok(Refine::Converged { most_slabs: MOST_SLABS_PER_VOXEL })
        }
        (RefineFlag::Full | RefineFlag::Converged, budget_ms, _) => {
            let flag = if budget_ms.is_some() { "--budget-ms" } else { "--max-error" };
            let found = RefineFlag::found(flags.refine);
            let advice = match flags.refine {
                None => "add --refine coarse".to_owned(),
                Some(_) => format!("choose --refine coarse, or leave {flag} out"),
            };
            usage(&format!("expected --refine coarse with {flag}, found {found}; {advice}"))
        }
        (RefineFlag::Coarse, Some(budget_ms), None) => Ok(Refine::Budget { budget_ms }),
        (RefineFlag::Coarse, None, Some(max_error)) => Ok(Refine::Error { max_error, of_voxels }),
        (RefineFlag::Coarse, None, None) => usage(
            "expected --budget-ms or --max-error with --refine coarse, found neither; give one",
        ),
        (RefineFlag::Coarse, Some(_), Some(_)) => {
            usage("expected one of --budget-ms and --max-error, found both; leave one out")
        }
    }
}
