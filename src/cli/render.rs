//! `voxsplat render`.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use super::flags::{RefineFlag, RenderFlags};
use super::stats::Stats;
use super::{Failure, open};
use crate::core::Ticket;
use crate::scene::{Background, MOST_SLABS_PER_VOXEL, Scene, Visibility};
use crate::task::engine::Engine;
use crate::task::picture_file::{self, PictureFormat};
use crate::task::still::{Refine, StillRequest};

pub(super) fn run(flags: &RenderFlags) -> Result<(), Failure> {
    let refine = refine(flags)?;
    let format = format(&flags.output)?;
    let splat = flags.mode.choice().resolve().map_err(|error| Failure::Usage(error.to_string()))?;
    if flags.refine == RefineFlag::Converged && splat.visibility != Visibility::Slabs {
        return Err(Failure::Usage(format!(
            "expected --refine converged with --visibility slabs, which it doubles, found \
             --visibility {}; choose --visibility slabs, or --refine full",
            splat.visibility.name()
        )));
    }
    if flags.stats.as_ref() == Some(&flags.output) {
        return Err(Failure::Usage(format!(
            "expected --stats and --output to name two files, found one; rename one of them: {}",
            flags.output.display()
        )));
    }
    let start = Instant::now();
    let input = open::grid(&flags.input)?;
    for warning in &input.warnings {
        eprintln!("voxsplat: note: {warning}");
    }
    let background = if flags.no_background {
        Background::Transparent
    } else {
        Background::Colour(flags.background)
    };
    let scene = Scene { background, ..open::scene(&input, &flags.scene, splat)? };
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let kernels_total = scene.volume.lattice.len() as u64;
    let engine = Engine::start(flags.adapter.clone(), || ());
    let request = StillRequest {
        scene,
        size: flags.resolution,
        refine,
        repeat: flags.repeat,
        time_passes: flags.stats.is_some(),
    };
    let still = engine.still(request, &Ticket::new()).map_err(Failure::failed)?;
    // Less than half a step of an 8-bit channel everywhere: nobody would see anything.
    if still.light.iter().all(|pixel| pixel[3] < 1.0 / 512.0) {
        eprintln!(
            "voxsplat: note: nothing can be seen in the picture, though {} voxels have opacity; \
             look at the opacities, the extent and the camera",
            still.kernels_active
        );
    }
    if let Some(convergence) = &still.convergence
        && !convergence.is_reached()
    {
        eprintln!(
            "voxsplat: note: the picture did not converge: with {} slabs per voxel, the most \
             there are, it still changed by {:.1e}",
            convergence.slabs_per_voxel,
            convergence.last_difference.unwrap_or(1.0)
        );
    }
    match format {
        None => {
            let bytes = picture_file::png_bytes(&still).map_err(Failure::Failed)?;
            match std::io::stdout().write_all(&bytes) {
                // Whoever reads has seen enough.
                Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {}
                Err(error) => {
                    return Err(Failure::Failed(format!(
                        "the picture could not be written to standard output: {error}; \
                         name a file with --output"
                    )));
                }
                Ok(()) => {}
            }
        }
        Some(format) => {
            picture_file::write(&still, format, &flags.output).map_err(Failure::Failed)?;
        }
    }
    if let Some(path) = &flags.stats {
        let stats = Stats::of(&still, splat, kernels_total, load_ms);
        let text = serde_json::to_string_pretty(&stats).map_err(Failure::failed)?;
        std::fs::write(path, text + "\n").map_err(|error| {
            Failure::Failed(format!(
                "the statistics could not be written: {error}; choose another place: {}",
                path.display()
            ))
        })?;
    }
    Ok(())
}

/// What the output's name asks for; `None` is PNG on stdout.
fn format(output: &Path) -> Result<Option<PictureFormat>, Failure> {
    if output == Path::new("-") {
        return Ok(None);
    }
    PictureFormat::of(output).map(Some).map_err(Failure::Usage)
}

fn refine(flags: &RenderFlags) -> Result<Refine, Failure> {
    let usage = |sentence: &str| Err(Failure::Usage(sentence.to_owned()));
    match (flags.refine, flags.budget_ms, flags.max_error) {
        (RefineFlag::Full, None, None) => Ok(Refine::Full),
        (RefineFlag::Converged, None, None) => {
            Ok(Refine::Converged { most_slabs: MOST_SLABS_PER_VOXEL })
        }
        (RefineFlag::Full | RefineFlag::Converged, ..) => usage(
            "expected --refine coarse with --budget-ms or --max-error, found another --refine; \
             add --refine coarse",
        ),
        (RefineFlag::Coarse, Some(budget_ms), None) => Ok(Refine::Budget { budget_ms }),
        (RefineFlag::Coarse, None, Some(max_error)) => Ok(Refine::Error { max_error }),
        (RefineFlag::Coarse, None, None) => usage(
            "expected --budget-ms or --max-error with --refine coarse, found neither; give one",
        ),
        (RefineFlag::Coarse, Some(_), Some(_)) => {
            usage("expected one of --budget-ms and --max-error, found both; leave one out")
        }
    }
}
