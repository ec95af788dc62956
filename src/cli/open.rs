//! A file named on the command line.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::flags::{InputFlags, ModeFlags, SceneFlags};
use super::progress::Progress;
use super::{Failure, note, notes, surface};
use crate::core::{Camera, Projection, Ticket, plain_number, plain_numbers};
use crate::io::{self, Facts, OpenOptions, RawOverrides, Series};
use crate::kernel::Kernel;
use crate::rbf::{few_digits, four_digits};
use crate::scene::{
    self, FirstLook, SampleSource, Scene, Shading, SplatSettings, Visibility, framing_what_shows,
};
use crate::task::transfer_file;
use crate::transfer::presets::Preset;
use crate::transfer::{ColourSource, NoData, Region, TransferFunction};
use crate::volume::{
    Component, Field, Grid, ScalarVolume, Statistics, VolumeError, demo, demo::DemoError,
};

/// What was opened: the grid, and where the file says so, its format.
pub(super) struct Input {
    pub grid: Grid,
    pub format: String,
    pub warnings: Vec<String>,
    /// The series that lie at its place, where there are several.
    pub series: Vec<Series>,
    /// Of basis functions.
    pub encoding: Option<Facts>,
    pub(super) path: PathBuf,
}

/// The field of a scene, which every scene of the command line opens with.
pub(super) fn volume(scene: &Scene) -> Result<&Arc<ScalarVolume>, Failure> {
    scene
        .volume()
        .ok_or_else(|| Failure::Failed("expected a field of values, found none".to_owned()))
}

impl Input {
    /// The field of this name, or the active one; also where a series is called so.
    pub(super) fn field(&self, name: Option<&str>) -> Result<&Field, VolumeError> {
        let is_series =
            |name: &&str| self.series.iter().any(|one| one.is_open && one.name == **name);
        self.grid.field(name.filter(|name| !is_series(name)))
    }

    /// The file's name without its folder.
    pub(super) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// What a scene calls all of a field.
    pub(super) fn source(&self, field: &str) -> SampleSource {
        SampleSource::whole(&self.path, field)
    }

    /// The field of a demo that is first seen flowing.
    pub(super) fn flowing_field(&self) -> Option<&'static str> {
        demo_name(&self.path).and_then(demo::flowing_field)
    }

    /// A sentence about what is in the file, with its path last.
    pub(super) fn about(&self, sentence: &str) -> String {
        format!("{sentence}; `voxsplat info` tells what is there: {}", self.path.display())
    }
}

/// NAME of `demo:NAME`.
fn demo_name(file: &Path) -> Option<&str> {
    file.to_str().and_then(|file| file.strip_prefix("demo:"))
}

/// Refuses what no volume is called, whatever files there are: a demo that there is not, and
/// standard input.
pub(super) fn check_name(file: &Path) -> Result<(), Failure> {
    if file == Path::new("-") {
        return Err(Failure::Usage(
            "expected a file, found - for standard input, which is not read; write the volume to a \
             file first, and name a file that is called so as ./-"
                .to_owned(),
        ));
    }
    let checked = demo_name(file).map_or(Ok(()), demo::check);
    checked.map_err(|error| Failure::Usage(error.to_string()))
}

/// A file, and in it or beside it the series that a field is named by.
pub(super) fn grid(flags: &InputFlags, field: Option<&str>) -> Result<Input, Failure> {
    grid_at(flags, field, None)
}

/// The same; of basis functions, so many samples along each axis.
pub(super) fn grid_at(
    flags: &InputFlags,
    field: Option<&str>,
    dims: Option<[usize; 3]>,
) -> Result<Input, Failure> {
    check_name(&flags.file)?;
    let raw = RawOverrides {
        dims: flags.raw_dims,
        scalar_type: flags.raw_type,
        endian: flags.raw_endian,
        skip_bytes: flags.raw_skip,
        spacing: flags.raw_spacing.map(DVec3::from),
    };
    let is_raw = raw != RawOverrides::default();
    if let Some(name) = demo_name(&flags.file) {
        if is_raw {
            return Err(Failure::Usage(format!(
                "expected --raw-dims and the like with a file, found a demo; leave them out: \
                 demo:{name}"
            )));
        }
        let grid = demo::open(name, None).map_err(|error| match error {
            DemoError::TooLarge(_) => Failure::failed(error),
            error => Failure::Usage(error.to_string()),
        })?;
        return Ok(Input {
            grid,
            format: "demo".to_owned(),
            warnings: Vec::new(),
            series: Vec::new(),
            encoding: None,
            path: flags.file.clone(),
        });
    }
    let series = field.map(str::to_owned);
    let options =
        OpenOptions { raw: is_raw.then_some(raw), series, dims, ..OpenOptions::default() };
    let ticket = Ticket::new();
    let progress = Progress::of(&ticket, "reading");
    let opened = io::open(&flags.file, &options, &ticket).map_err(Failure::failed)?;
    drop(progress);
    Ok(Input {
        grid: opened.grid,
        format: opened.format.name().to_owned(),
        warnings: opened.warnings,
        series: opened.series,
        encoding: opened.encoding,
        path: flags.file.clone(),
    })
}

/// The scalar that is drawn: the named field or the active one, a component or the magnitude.
fn scalar(
    input: &Input,
    field: Option<&str>,
    component: Option<Component>,
) -> Result<(SampleSource, Arc<ScalarVolume>), Failure> {
    let failed = |error: VolumeError| Failure::Failed(input.about(&error.to_string()));
    let field = input.field(field).map_err(failed)?;
    let component = component.unwrap_or(Component::usual(field.components));
    let source = SampleSource::component(&input.path, &field.name, component);
    let volume = input.grid.scalar(field, component, &Ticket::new()).map_err(failed)?;
    let holes = notes::without_value(&input.grid, field, component).map_err(failed)?;
    holes.iter().for_each(|what| note(what));
    match reach(&volume.statistics) {
        Reach::All => {}
        Reach::Some => {
            let range = range_words(&volume.statistics);
            note(&format!(
                "field \"{}\" reaches beyond the 32-bit floats that pictures are \
                 drawn with ({range}): values more than {:.1e} from the rest count as that far",
                volume.name,
                f32::MAX
            ));
        }
        Reach::None => {
            return Err(Failure::Failed(format!(
                "expected values within {:.1e} of each other, as pictures are drawn with 32-bit \
                 floats, found {} in field \"{}\"; divide them by a power of ten: {}",
                f32::MAX,
                range_words(&volume.statistics),
                volume.name,
                input.path.display()
            )));
        }
    }
    Ok((source, Arc::new(volume)))
}

/// How much of a field 32-bit floats can hold.
#[derive(Debug, PartialEq)]
enum Reach {
    All,
    Some,
    None,
}

/// Devices hold 64-bit values as 32-bit differences from the one nearest to zero. Values further than
/// a 32-bit float from it are all the same to them.
fn reach(statistics: &Statistics) -> Reach {
    let nearest = 0.0_f64.clamp(statistics.min, statistics.max);
    let is_held = |value: f64| (value - nearest).abs() <= f64::from(f32::MAX);
    if is_held(statistics.min) && is_held(statistics.max) {
        return Reach::All;
    }
    let mut held = statistics.quantiles.iter().filter(|value| is_held(**value));
    let first = held.next();
    if held.any(|value| Some(value) != first) { Reach::Some } else { Reach::None }
}

fn range_words(statistics: &Statistics) -> String {
    format!("{:e} to {:e}", statistics.min, statistics.max)
}

/// The scene as it opens, changed by the flags: in the mode of its first look unless `mode` says another.
pub(super) fn scene(input: &Input, flags: &SceneFlags, mode: Mode) -> Result<Scene, Failure> {
    let (source, volume) = scalar(input, flags.field.as_deref(), flags.component)?;
    let space = input.grid.space.as_deref();
    let surface = if mode.draws_points { None } else { surface::of(input, flags)? };
    let look = FirstLook::of(&volume, space);
    let orientation = look.orientation.with_up(flags.camera_up_axis);
    let look = if surface.is_some() { look.of_surface() } else { look };
    let unlit = look.unlit_mode();
    let mut opening = scene::seen_first(source, Arc::clone(&volume), look);
    if let Some(up) = flags.camera_up_axis {
        let (direction, shown_up) = orientation.first_view().direction_and_up(orientation);
        if let Some(transfer) = opening.transfer() {
            opening.camera = framing_what_shows(&volume, transfer, direction, shown_up);
        }
        opening.up = Some(up);
    }
    let is_surface = surface.is_some();
    if let Some(mesh) = surface {
        surface::show(&mut opening, input, mesh);
    }
    if flags.camera_direction.is_some() || flags.camera_up_axis.is_some() {
        // Up as the world has it, whatever direction is looked along, not as the first view happens to be tilted.
        opening.camera.up = orientation.up.vector();
    }
    let mut camera = camera(flags, &opening.camera);
    if flags.parallel_scale.is_none() {
        camera = scene::in_perspective(&opening, camera);
    }
    check_scale(flags, volume.lattice.bounding_radius())?;
    no_up(flags, &camera).iter().for_each(|what| note(what));
    let mut regions = Vec::new();
    if let Some(function) = opening.transfer_mut() {
        (*function, regions) = transfer(flags, &volume.statistics, function)?;
    }
    if is_surface {
        surface::colour(&mut opening, input, flags)?;
    }
    // Who says what is seen, and how densely, says whether it is lit, too.
    let lighting = opening.shading.lighting.take().filter(|_| !flags.say_what_is_seen());
    let splat = mode.beside(if lighting.is_some() { opening.splat } else { unlit });
    let shading = Shading { regions, lighting, ..Shading::default() };
    let spacing = volume.lattice.smallest_spacing();
    if let Some(sentence) = splat.opacity_unit_distance.and_then(|unit| all_opaque(unit, spacing)) {
        note(&sentence);
    }
    Ok(Scene { camera, splat, shading, ..opening })
}

/// The mode by the flags.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    /// What they mean.
    splat: SplatSettings,
    /// What they mean of a field that is encoded as basis functions, of one on cells and of one of points, where these can be
    /// drawn so.
    of_functions: Option<SplatSettings>,
    of_cells: Option<SplatSettings>,
    of_points: Option<SplatSettings>,
    /// Whether one of them names a kernel.
    names_kernel: bool,
    /// Whether one of them says how thick slabs are.
    names_slabs: bool,
    /// The first that says how a field is drawn.
    first: Option<&'static str>,
    /// Whether any of them says how a field is drawn; else that is up to the first look.
    is_asked_for: bool,
    /// Whether a file that is a surface is drawn as its points.
    draws_points: bool,
}

impl Mode {
    /// By the flags, which mean `splat`.
    pub(super) fn of(flags: &ModeFlags, splat: SplatSettings, is_asked_for: bool) -> Self {
        let of = |kernel| flags.of_source(kernel, splat.cut);
        Self {
            splat,
            of_functions: of(Kernel::Functions),
            of_cells: of(Kernel::Cells),
            of_points: of(Kernel::Ellipsoids),
            names_kernel: flags.kernel.is_some(),
            names_slabs: flags.slabs_per_voxel.is_some(),
            first: flags.of_field(),
            is_asked_for,
            draws_points: is_asked_for,
        }
    }

    /// The same where isosurfaces may be asked for, which only some modes have.
    pub(super) fn with_levels(self, are_asked_for: bool) -> Self {
        Self { is_asked_for: self.is_asked_for || are_asked_for, ..self }
    }

    /// The mode beside a first look: how thick slabs are is the volume's affair, where no flag says it.
    fn beside(self, first_look: SplatSettings) -> SplatSettings {
        let found = self.beside_whole(first_look);
        let has_slabs = |mode: &SplatSettings| mode.visibility == Visibility::Slabs;
        match !self.names_slabs && has_slabs(&found) && has_slabs(&first_look) {
            true => SplatSettings { slabs_per_voxel: first_look.slabs_per_voxel, ..found },
            false => found,
        }
    }

    fn beside_whole(self, first_look: SplatSettings) -> SplatSettings {
        let SplatSettings { opacity_unit_distance, cut, .. } = self.splat;
        let (own, what) = match first_look.kernel {
            Kernel::Functions => (self.of_functions, "basis functions"),
            Kernel::Cells => (self.of_cells, "cells"),
            Kernel::Ellipsoids => (self.of_points, "points"),
            _ => (Some(self.splat), ""),
        };
        match self.is_asked_for {
            true => own.unwrap_or_else(|| {
                if !self.names_kernel {
                    let asked = self.first.unwrap_or("what the flags ask for");
                    note(&format!(
                        "{asked} needs evenly spaced samples: the field is drawn as interpolated on such a lattice, not from its own {what}"
                    ));
                }
                self.splat
            }),
            false => SplatSettings { opacity_unit_distance, cut, ..first_look },
        }
    }
}

/// What NaN looks like by the flags.
fn no_data(
    no_data: &mut NoData,
    flags: &SceneFlags,
    statistics: &Statistics,
) -> Result<(), Failure> {
    no_data.opacity = flags.nan_opacity.unwrap_or(no_data.opacity);
    no_data.colour = flags.nan_color.unwrap_or(no_data.colour);
    if statistics.nan_count == 0 {
        if flags.nan_opacity.is_some() || flags.nan_color.is_some() {
            note("nothing that is drawn is NaN, so --nan-opacity and --nan-color change nothing");
        }
        return Ok(());
    }
    if flags.nan_color.is_some() && flags.nan_opacity.is_none() && !no_data.shows() {
        return Err(Failure::Failed(
            "expected an opacity of NaN with --nan-color, found none, so that nothing of it would be \
             seen; add --nan-opacity 1"
                .to_owned(),
        ));
    }
    Ok(())
}

/// The transfer function of the flags, and its regions: a whole one first, then what changes it.
fn transfer(
    flags: &SceneFlags,
    statistics: &Statistics,
    opening: &TransferFunction,
) -> Result<(TransferFunction, Vec<Region>), Failure> {
    let mut regions = Vec::new();
    let mut transfer = match (&flags.transfer, flags.preset) {
        (Some(path), _) => {
            let design = transfer_file::read(path).map_err(Failure::Failed)?;
            regions = design.regions;
            design.function
        }
        (None, Some(preset)) if preset != Preset::Default => preset.function(statistics),
        (None, _) => opening.clone(),
    };
    if let Some(preset) = flags.preset.filter(|preset| preset.lacks_hounsfield_units(statistics)) {
        note(&by_percentiles(preset));
    }
    no_data(&mut transfer.no_data, flags, statistics)?;
    if let Some(points) = &flags.opacity {
        transfer.opacity = points.0.clone();
        // Opacities by value, in place of any others.
        regions.clear();
    }
    if let Some(stops) = &flags.color {
        transfer.colour = ColourSource::Stops(stops.0.clone());
        return Ok((transfer, regions));
    }
    transfer.colour = match (transfer.colour, flags.colormap, flags.color_range) {
        (ColourSource::Map { map, range }, new_map, new_range) => {
            ColourSource::Map { map: new_map.unwrap_or(map), range: new_range.unwrap_or(range) }
        }
        (ColourSource::Stops(_), Some(map), Some(range)) => ColourSource::Map { map, range },
        (stops @ ColourSource::Stops(_), Some(map), None) => {
            ColourSource::Map { map, range: stops.range() }
        }
        (ColourSource::Stops(_), None, Some(_)) => {
            return Err(Failure::Failed(
                "expected --color-range with a colour map, found that the colours of --transfer are \
                 stops; add --colormap, or leave --color-range out"
                    .to_owned(),
            ));
        }
        (stops, None, None) => stops,
    };
    Ok((transfer, regions))
}

/// What to say of a unit distance so short that hardly any opacities can be told apart.
fn all_opaque(unit: f64, spacing: f64) -> Option<String> {
    // 1 − 0.99¹⁰⁰⁰ is 1 but for 4e-5: opaque to any display.
    (unit < spacing / 1000.0).then(|| {
        format!(
            "--opacity-unit-distance {unit:e} is less than a thousandth of the smallest voxel spacing \
             ({spacing}): whatever has an opacity of 1 % over it is opaque within a voxel; from a hundredth \
             of the spacing on they are told apart"
        )
    })
}

fn by_percentiles(preset: Preset) -> String {
    format!(
        "the values are no Hounsfield units (whole numbers from about -1000, or from 0 with 1024 added), so --preset {} goes by \
         their percentiles",
        preset.name()
    )
}

/// Vectors whose angle has a lesser sine than this are parallel: what is left of one across the other is rounding.
const PARALLEL: f64 = 1e-6;
/// Half heights of the view, in radii of the volume, within which a view has numbers.
const SCALES: RangeInclusive<f64> = 1e-9..=1e9;

/// What to say of an up that is none in the picture.
fn no_up(flags: &SceneFlags, camera: &Camera) -> Option<String> {
    let given = DVec3::from(flags.camera_view_up?);
    let is_parallel = given.normalize_or_zero().cross(camera.direction).length() < PARALLEL;
    let [x, y, z] = camera.up.to_array().map(|v| if v == 0.0 { 0.0 } else { v });
    is_parallel.then(|| {
        let [given, taken] = [given.to_array(), [x, y, z].map(four_digits)].map(|at| plain_numbers(at).replace(' ', ""));
        format!(
            "--camera-view-up {given} is parallel to the direction of the view, so it says nothing of what is up in \
             the picture: {taken} is taken"
        )
    })
}

/// Refuses a half height of the view in which nothing of a volume could be told from nothing.
fn check_scale(flags: &SceneFlags, radius: f64) -> Result<(), Failure> {
    let times = flags.parallel_scale.map(|scale| scale / radius);
    match flags.parallel_scale.filter(|_| times.is_some_and(|times| !SCALES.contains(&times))) {
        None => Ok(()),
        Some(found) => Err(Failure::Failed(format!(
            "expected --parallel-scale, half the height of the view, within a billion times and a billionth of this volume's \
             radius ({}), found {}; give the height that is to be seen",
            few_digits(radius),
            plain_number(found)
        ))),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Samples;

    #[test]
    fn unit_distances_over_which_all_is_opaque_are_told() {
        assert!(
            all_opaque(1e-30, 0.5)
                .is_some_and(|said| said.contains("1e-30") && said.contains("(0.5)"))
        );
        assert!(all_opaque(0.4e-3, 0.5).is_some() && all_opaque(0.6e-3, 0.5).is_none());
    }

    #[test]
    fn what_32_bit_floats_cannot_tell_apart_is_out_of_reach() {
        let of = |values: &[f64]| {
            let samples = Samples::Float64(values.to_vec());
            reach(&Statistics::of(&samples, &Ticket::new()).expect("never cancelled"))
        };
        assert_eq!(of(&[-3e38, 0.0, 1.0, 3e38]), Reach::All);
        assert_eq!(of(&[7.0, 7.0]), Reach::All);
        // Only differences count.
        assert_eq!(of(&[1e300, 1e300]), Reach::All);
        assert_eq!(of(&[0.0, 1.0, 1e300]), Reach::Some);
        assert_eq!(of(&[1e39, 2e39, 3e39]), Reach::None);
        assert_eq!(of(&[-1e308, 1e308]), Reach::None);
    }
}
