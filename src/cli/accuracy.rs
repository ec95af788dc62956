//! `voxsplat accuracy`.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use super::flags::AccuracyFlags;
use super::plot;
use super::render::{refuse_among_triangles, with_layers};
use super::report::Report;
use super::{Destination, Failure, note, open, refuse_one_place};
use crate::core::{Ticket, plain_number};
use crate::scene::{MOST_SLABS_PER_VOXEL, Scene, SplatSettings};
use crate::task::engine::Engine;
use crate::task::still::{Refine, StillRequest};
use crate::task::sweep::{Step, Sweep, SweepOptions, exact_truth};

pub(super) fn run(flags: &AccuracyFlags) -> Result<(), Failure> {
    let usage = |sentence: String| Err(Failure::Usage(sentence));
    if let Some(plot) = &flags.plot {
        let extension = plot.extension().map(|e| e.to_string_lossy().to_lowercase());
        if extension.as_deref() != Some("png") {
            return usage(format!(
                "expected a plot's name that ends in .png, found another; choose such a name: {}",
                plot.display()
            ));
        }
    }
    if flags.max_slabs > MOST_SLABS_PER_VOXEL {
        return usage(format!(
            "expected --max-slabs up to {MOST_SLABS_PER_VOXEL}, found {}; choose a number in \
             that range",
            plain_number(flags.max_slabs)
        ));
    }
    let splat = flags.mode.resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    let splat = SplatSettings { cut: flags.cut.settings(), ..splat };
    refuse_among_triangles(&splat, &flags.vectors, &flags.polygons, &flags.flow)?;
    flags.vectors.refuse_loop("accuracy")?;
    let plot = flags.plot.as_deref();
    open::check_name(&flags.input.file)?;
    refuse_one_place(&[
        ("FILE", Some(&flags.input.file)),
        ("--transfer", flags.scene.transfer.as_deref()),
        ("--output", Some(&flags.output)),
        ("--plot", plot),
    ])?;
    for mesh in &flags.polygons.mesh {
        let written = [("--output", Some(flags.output.as_path())), ("--plot", plot)];
        for place in written {
            refuse_one_place(&[("--mesh", Some(mesh.path())), place])?;
        }
    }
    // A sweep takes minutes: places that cannot be written to are found before it.
    let table_to = Destination::check(&flags.output, "the table")?;
    let plot_to = plot.map(|path| Destination::file(path, "the plot")).transpose()?;
    let input = open::grid(&flags.input, flags.scene.field.as_deref())?;
    for warning in &input.warnings {
        note(warning);
    }
    // Rows are of modes that show no lights, too; and it is by them that modes are compared.
    let mut scene = open::scene(&input, &flags.scene, open::Mode::of(&flags.mode, splat, true))?;
    scene.shading.lighting = None;
    let mut asked = flags.vectors.clone();
    if asked.named().is_none() && !asked.vectors_only {
        // It chooses pixels, too.
        asked.look.seed = None;
    }
    let mut vectors = asked.layer(&input, &scene, true, false)?;
    let flow = flags.flow.layers(&mut vectors)?;
    let mut polygons = flags.polygons.layers((&input.grid.lattice, input.grid.space.as_deref()))?;
    polygons.extend(flow);
    let scene = with_layers(scene, &flags.scene, vectors, polygons)?;
    if !scene.shading.is_plain() {
        note(
            "triangles (--backend raster, --kernel gouraud) show no regions by gradient strength: their \
             rows are of the transfer function alone, and so far off",
        );
    }
    let options = SweepOptions {
        pixels: flags.pixels as usize,
        seed: flags.vectors.look.seed.unwrap_or(1),
        repeat: flags.repeat,
        most_slabs: flags.max_slabs,
        ..SweepOptions::new(&scene)
    };
    let engine = Engine::start(flags.engine.choice()?, || ());
    // A machine that cannot draw, or not at this size, says so before the work.
    let [width, height] = flags.resolution;
    for size in [[width, 1], [1, height]] {
        let sliver = StillRequest {
            scene: Scene { splat: SplatSettings::SHADE_FIRST, ..scene.clone() },
            size,
            refine: Refine::Full,
            repeat: 0,
            time_passes: false,
            smooth_edges: false,
        };
        engine.still(sliver, &Ticket::new()).map_err(Failure::failed)?;
    }
    let mut sweep = Sweep::new(scene, flags.resolution, options, exact_truth);
    let is_terminal = std::io::stderr().is_terminal();
    let mut told = Instant::now();
    let outcome = sweep.run(&engine, &Ticket::new(), &mut |sweep| {
        if is_terminal {
            // One line, written over again and again. A terminal that has gone away needs no progress.
            drop(write!(std::io::stderr(), "\r\x1b[2K{}", progress(sweep)));
        } else if told.elapsed() >= TELL_EVERY && sweep.next_step() != Step::Done {
            drop(writeln!(std::io::stderr(), "voxsplat: {}", progress(sweep)));
            told = Instant::now();
        }
    });
    outcome.map_err(Failure::failed)?;
    if let Some(error) = nothing_drawn(&sweep) {
        return Err(Failure::Failed(error));
    }
    if sweep.sees_nothing() {
        note(
            "nothing can be seen in the exact picture, and so nothing is wrong in \
             any; look at the opacities and the camera",
        );
    }
    if let Some(Ok(converged)) = sweep.converged()
        && !converged.convergence.is_reached()
    {
        note(&format!(
            "the picture that whole pictures are compared with did not converge up \
             to --max-slabs {}: the table says by how much it still changed",
            plain_number(flags.max_slabs)
        ));
    }
    let report = Report::of(&sweep, flags.input.file.display().to_string());
    let text = serde_json::to_string_pretty(&report).map_err(Failure::failed)? + "\n";
    table_to.write(text.as_bytes())?;
    if let Some(plot_to) = plot_to {
        let file = flags.input.file.display().to_string();
        plot_to.write(&plot::png_bytes(&sweep, &file).map_err(Failure::Failed)?)?;
    }
    Ok(())
}

/// Where not a single setting could be drawn, why the first could not.
fn nothing_drawn(sweep: &Sweep) -> Option<String> {
    if sweep.points().iter().any(|point| point.outcome.is_ok()) {
        return None;
    }
    sweep.points().first().and_then(|point| point.outcome.as_ref().err().cloned())
}

/// How often a log is told how far a long measurement is.
const TELL_EVERY: Duration = Duration::from_secs(15);

/// How far a measurement is; nothing once it is done.
fn progress(sweep: &Sweep) -> String {
    let settings = &sweep.options().settings;
    let words = match sweep.next_step() {
        Step::Truth => "the exact picture in float64".to_owned(),
        Step::Converged => "the converged picture".to_owned(),
        Step::Setting(index) => {
            format!("{} of {}: {}", index + 1, settings.len(), settings[index].name)
        }
        Step::Done => String::new(),
    };
    let percent = if words.is_empty() {
        String::new()
    } else {
        format!("{:3.0} % ", 100.0 * sweep.fraction())
    };
    percent + &words
}
