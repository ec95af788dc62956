//! A file named on the command line.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::Failure;
use super::flags::{InputFlags, SceneFlags};
use crate::core::{Camera, Projection, Ticket};
use crate::io::{self, OpenOptions, RawOverrides};
use crate::scene::{self, Scene, SplatSettings};
use crate::transfer::ColourSource;
use crate::volume::{Component, Grid, ScalarVolume, VolumeError, demo};

/// What was opened: the grid, and where the file says so, its format.
pub(super) struct Input {
    pub grid: Grid,
    pub format: String,
    pub warnings: Vec<String>,
    path: PathBuf,
}

pub(super) fn grid(flags: &InputFlags) -> Result<Input, Failure> {
    if let Some(name) = flags.file.to_str().and_then(|f| f.strip_prefix("demo:")) {
        let grid = demo::open(name, None).ok_or_else(|| {
            Failure::Failed(format!(
                "expected one of the demos {} (and at most a size, as in demo:shells:64), \
                 found demo:{name}",
                demo::NAMES.join(", ")
            ))
        })?;
        return Ok(Input {
            grid,
            format: "demo".to_owned(),
            warnings: Vec::new(),
            path: flags.file.clone(),
        });
    }
    let raw = RawOverrides {
        dims: flags.raw_dims,
        scalar_type: flags.raw_type,
        endian: flags.raw_endian,
        skip_bytes: flags.raw_skip,
        spacing: flags.raw_spacing.map(DVec3::from),
    };
    let options = OpenOptions {
        raw: (raw != RawOverrides::default()).then_some(raw),
        memory_limit_bytes: None,
    };
    let opened = io::open(&flags.file, &options, &Ticket::new()).map_err(Failure::failed)?;
    Ok(Input {
        grid: opened.grid,
        format: opened.format.name().to_owned(),
        warnings: opened.warnings,
        path: flags.file.clone(),
    })
}

/// The scalar that is drawn: the named field or the active one, a component or the magnitude.
fn scalar(
    input: &Input,
    field: Option<&str>,
    component: Option<usize>,
) -> Result<Arc<ScalarVolume>, Failure> {
    let failed = |error: VolumeError| {
        let path = input.path.display();
        Failure::Failed(format!("{error}; `voxsplat info` tells what is there: {path}"))
    };
    let field = input.grid.field(field).map_err(failed)?;
    let component = match component {
        Some(index) => Component::Index(index),
        None if field.components == 1 => Component::Index(0),
        None => Component::Magnitude,
    };
    let volume = input.grid.scalar(field, component, &Ticket::new()).map_err(failed)?;
    Ok(Arc::new(volume))
}

/// The scene as it opens, changed by the flags.
pub(super) fn scene(
    input: &Input,
    flags: &SceneFlags,
    splat: SplatSettings,
) -> Result<Scene, Failure> {
    let volume = scalar(input, flags.field.as_deref(), flags.component)?;
    let opening = scene::opening(volume, input.grid.space.as_deref());
    let camera = camera(flags, &opening.camera);
    let mut transfer = opening.transfer.clone();
    if let Some(points) = &flags.opacity {
        transfer.opacity = points.0.clone();
    }
    if let Some(stops) = &flags.color {
        transfer.colour = ColourSource::Stops(stops.0.clone());
    } else if let ColourSource::Map { map, range } = &mut transfer.colour {
        *map = flags.colormap.unwrap_or(*map);
        *range = flags.color_range.unwrap_or(*range);
    }
    Ok(Scene { camera, transfer, splat, ..opening })
}

fn camera(flags: &SceneFlags, opening: &Camera) -> Camera {
    let vector = |given: Option<[f64; 3]>, own: DVec3| given.map_or(own, DVec3::from);
    let mut camera = Camera::new(
        vector(flags.camera_focal_point, opening.focal_point),
        vector(flags.camera_direction, opening.direction),
        vector(flags.camera_view_up, opening.up),
        flags.parallel_scale.unwrap_or(opening.parallel_scale),
    );
    if let Some(degrees) = flags.camera_view_angle {
        camera.projection = Projection::Perspective { view_angle: degrees.to_radians() };
    }
    camera
}
