//! `voxsplat accuracy`.

use std::fs::OpenOptions;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use super::flags::AccuracyFlags;
use super::plot;
use super::report::Report;
use super::{Failure, open};
use crate::core::Ticket;
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
                "expected a plot's name that ends in .png, found another; rename it: {}",
                plot.display()
            ));
        }
        if *plot == flags.output {
            return usage(format!(
                "expected --plot and --output to name two files, found one; rename one of \
                 them: {}",
                plot.display()
            ));
        }
    }
    if flags.max_slabs > MOST_SLABS_PER_VOXEL {
        return usage(format!(
            "expected --max-slabs up to {MOST_SLABS_PER_VOXEL}, found {}; choose a number in \
             that range",
            flags.max_slabs
        ));
    }
    let splat = flags.mode.choice().resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    let input = open::grid(&flags.input)?;
    for warning in &input.warnings {
        eprintln!("voxsplat: note: {warning}");
    }
    let scene = open::scene(&input, &flags.scene, splat)?;
    // A sweep takes minutes: places that cannot be written to are found before it.
    let table = match flags.output.as_path() {
        output if output == Path::new("-") => None,
        output => Some(Place::reserve(output, "the table")?),
    };
    let chart = flags.plot.as_ref().map(|plot| Place::reserve(plot, "the plot")).transpose()?;
    let options = SweepOptions {
        pixels: flags.pixels as usize,
        seed: flags.seed,
        repeat: flags.repeat,
        most_slabs: flags.max_slabs,
        ..SweepOptions::new(&scene)
    };
    let engine = Engine::start(flags.adapter.clone(), || ());
    // A machine that cannot draw says so before the work.
    let speck = StillRequest {
        scene: Scene { splat: SplatSettings::SHADE_FIRST, ..scene.clone() },
        size: [1, 1],
        refine: Refine::Full,
        repeat: 0,
        time_passes: false,
    };
    engine.still(speck, &Ticket::new()).map_err(Failure::failed)?;
    let mut sweep = Sweep::new(scene, flags.resolution, options, exact_truth);
    let shows = std::io::stderr().is_terminal();
    let outcome = sweep.run(&engine, &Ticket::new(), &mut |sweep| {
        if shows {
            show(sweep);
        }
    });
    outcome.map_err(Failure::failed)?;
    if let Some(error) = nothing_drawn(&sweep) {
        return Err(Failure::Failed(error));
    }
    if sweep.sees_nothing() {
        eprintln!(
            "voxsplat: note: nothing can be seen in the exact picture, and so nothing is wrong in \
             any; look at the opacities and the camera"
        );
    }
    let report = Report::of(&sweep, flags.input.file.display().to_string());
    let text = serde_json::to_string_pretty(&report).map_err(Failure::failed)? + "\n";
    match table {
        Some(place) => place.write(text.as_bytes())?,
        None => match std::io::stdout().write_all(text.as_bytes()) {
            // Whoever reads has seen enough.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {}
            Err(error) => {
                return Err(Failure::Failed(format!(
                    "the table could not be written to standard output: {error}; name a file \
                     with --output"
                )));
            }
            Ok(()) => {}
        },
    }
    if let Some(place) = chart {
        let bytes = plot::png_bytes(&sweep, &flags.input.file.display().to_string())
            .map_err(Failure::Failed)?;
        place.write(&bytes)?;
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

/// One line on a terminal, written over again and again.
fn show(sweep: &Sweep) {
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
    // A terminal that has gone away needs no progress.
    drop(write!(std::io::stderr(), "\r\x1b[2K{percent}{words}"));
}

/// A file that will be written. One that was not there before is taken away again where it is not.
struct Place {
    path: PathBuf,
    what: &'static str,
    is_new: bool,
    is_written: bool,
}

impl Place {
    fn reserve(path: &Path, what: &'static str) -> Result<Self, Failure> {
        let is_new = !path.exists();
        let opened = OpenOptions::new().write(true).create(true).truncate(false).open(path);
        let place = Self { path: path.to_owned(), what, is_new, is_written: opened.is_err() };
        opened.map_err(|error| place.failure(&error))?;
        Ok(place)
    }

    fn write(mut self, bytes: &[u8]) -> Result<(), Failure> {
        std::fs::write(&self.path, bytes).map_err(|error| self.failure(&error))?;
        self.is_written = true;
        Ok(())
    }

    fn failure(&self, error: &std::io::Error) -> Failure {
        Failure::Failed(format!(
            "{} could not be written: {error}; choose another place: {}",
            self.what,
            self.path.display()
        ))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        if self.is_new && !self.is_written {
            // What cannot be taken away again is an empty file, and no more.
            drop(std::fs::remove_file(&self.path));
        }
    }
}
