//! Every flag once: its name, its value, its help.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use serde::Serialize;

use super::Failure;
use super::encode::{ConvertFlags, EncodeFlags};
use super::flow::FlowFlags;
use super::inside::InsideFlags;
use super::polygons::PolygonFlags;
use super::shading::ShadingFlags;
use super::values::{self, Stop};
use super::vectors::VectorFlags;
use crate::core::Srgb8;
use crate::io::Endian;
use crate::kernel::Kernel;
use crate::rbf::Limits;
use crate::scene::{
    Annotations, Backend, Classify, CutSettings, ErrorMeasure, ModeChoice, ModeError, Moving,
    OpacityModel, Order, Reconstruction, SplatSettings, UpAxis, Visibility,
};
use crate::task::engine::{AdapterChoice, Choice, EngineChoice};
use crate::transfer::ColourMap;
use crate::transfer::presets::Preset;
use crate::volume::{Component, ScalarType};

/// Draws volume data by splatting, and shows what accuracy costs in time
#[derive(Debug, Parser)]
#[command(name = "voxsplat", version, propagate_version = true,
    args_conflicts_with_subcommands = true, after_help = EXIT_CODES)]
pub struct Arguments {
    /// What to do; without one, the window.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// The window's flags.
    #[command(flatten)]
    pub window: WindowFlags,
}

/// The codes that scripts depend on.
const EXIT_CODES: &str = "\
Exit codes: 0 success; 1 failure, with one line on stderr; 2 wrong usage. A name that the program has
never heard of (demo:nothing, --kernel sinc) is wrong usage; one that only the file or the machine can
tell to be wrong (--field, --component, --adapter) is a failure.";

/// Which of the flags of `accuracy` hold for everything that is measured.
const SWEEP: &str = "\
Scene: these flags hold for every picture, and so does --opacity-unit-distance. Those of octree cuts
hold for each of these.
Mode: the other flags of that list describe one way of drawing, which is measured first and stands in
the table and the chart beside the rest; without them it is the mode of `render` without flags. The
rest does not follow them. It is always the same some fifty ways: kernels, visibility, classification,
reconstruction, opacity models, 1/2 to 4 slabs per voxel, octree cuts, and smaller pictures enlarged.
Vectors: a field of three components is measured as scalars unless --vector or --vectors-only asks for
its vectors. Beside vectors or polygons there are no octree cuts and no triangles, which show none; of
vectors alone slabs and sizes are compared.
All are held to one exact picture: interpolating B-splines, pre-integrated, in ever thinner slabs.";

/// What else than the window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Draw a picture without a window
    #[command(after_help = EXIT_CODES)]
    Render(Box<RenderFlags>),
    /// Say what is in a file
    #[command(after_help = EXIT_CODES)]
    Info(InfoFlags),
    /// Say what a pixel shows: the first visible point of its ray, and the field there; or the field at a place
    #[command(after_help = EXIT_CODES)]
    Probe(Box<ProbeFlags>),
    /// Measure what each way of drawing costs, and how far from the exact picture it is
    #[command(after_help = format!("{SWEEP}\n\n{EXIT_CODES}"))]
    Accuracy(Box<AccuracyFlags>),
    /// Encode a field as radial basis functions
    #[command(after_help = EXIT_CODES)]
    Encode(Box<EncodeFlags>),
    /// Write a field as NRRD; of basis functions the values of their sum
    #[command(after_help = EXIT_CODES)]
    Convert(ConvertFlags),
}

/// What draws.
#[derive(Debug, Args)]
pub struct EngineFlags {
    /// Engine to draw with: native (the processor), gpu (a graphics adapter), or auto: gpu where a graphics processor is
    /// there or --adapter names one, else native
    #[arg(long, value_parser = values::engine, default_value = "auto", value_name = "ENGINE",
        help_heading = "Options")]
    pub engine: EngineChoice,
    /// Adapter to draw with: auto, software, or part of a name
    #[arg(long, value_parser = values::adapter, default_value = "auto", value_name = "NAME",
        help_heading = "Options")]
    pub adapter: AdapterChoice,
}

impl EngineFlags {
    /// What they choose.
    ///
    /// # Errors
    /// An adapter beside the engine that has none.
    pub fn choice(&self) -> Result<Choice, Failure> {
        if self.engine == EngineChoice::Native && self.adapter != AdapterChoice::Auto {
            return Err(Failure::Usage(
                "expected --adapter with --engine gpu or auto, found --engine native, which draws on the processor; \
                 leave one of them out"
                    .to_owned(),
            ));
        }
        Ok(Choice { engine: self.engine, adapter: self.adapter.clone() })
    }
}

/// `voxsplat [FILE]…`.
#[derive(Debug, Args)]
pub struct WindowFlags {
    /// Volumes to open, demo:NAME or demo:NAME:SIZE (2 to 512): the first is shown, the others wait among
    /// the recent files. STL, PLY and OBJ files are shown within it; a transfer function that the window
    /// saved is loaded
    /// [default: the built-in demo]
    pub files: Vec<PathBuf>,
    /// What draws.
    #[command(flatten)]
    pub engine: EngineFlags,
    /// What is drawn while the view moves: octree (a cut of the field, wherever there is one), subsampled (all of the field in
    /// fewer pixels), or auto: whichever is thought to be nearer to the finished picture
    #[arg(long, value_parser = values::moving, default_value = "auto", value_name = "WHAT")]
    pub moving: Moving,
    /// Write down what the window showed and when: a line of JSON for every pass
    #[arg(long, value_name = "T.jsonl")]
    pub trace: Option<PathBuf>,
}

/// Which file, and how to read it.
#[derive(Debug, Args)]
pub struct InputFlags {
    /// A volume, demo:NAME or demo:NAME:SIZE, SIZE samples along each axis (2 to 512)
    pub file: PathBuf,
    /// Dimensions of a raw file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::dims, allow_hyphen_values = true)]
    pub raw_dims: Option<[usize; 3]>,
    /// Scalar type of a raw file: uint8, int16, float32, …
    #[arg(long, value_name = "TYPE", value_parser = values::scalar_type)]
    pub raw_type: Option<ScalarType>,
    /// Byte order of a raw file: little or big
    #[arg(long, value_name = "ORDER", value_parser = values::endian)]
    pub raw_endian: Option<Endian>,
    /// Bytes before the samples of a raw file
    #[arg(long, value_name = "BYTES", value_parser = values::count, allow_hyphen_values = true)]
    pub raw_skip: Option<u64>,
    /// World distance between the samples of a raw file
    #[arg(long, value_name = "X,Y,Z", value_parser = values::spacing, allow_hyphen_values = true)]
    pub raw_spacing: Option<[f64; 3]>,
}

/// `voxsplat info`.
#[derive(Debug, Args)]
pub struct InfoFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// `voxsplat probe`.
#[derive(Debug, Args)]
pub struct ProbeFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// Column and row of the pixel, from 0,0 at the upper left; this or --point
    #[arg(long, value_name = "X,Y", value_parser = values::pixel, allow_hyphen_values = true)]
    pub at: Option<[u32; 2]>,
    /// World point whose values are told, whether or not it can be seen
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true,
        conflicts_with_all = ["resolution", "share", "clip_box", "clip_plane", "cut_faces", "slice",
        "slice_plane", "slice_only_shown", "slice_edges", "iso", "projection", "mesh", "labels"])]
    pub point: Option<[f64; 3]>,
    /// Size in pixels of the picture that it is a pixel of, as of `render`
    #[arg(long, value_name = "W,H", value_parser = values::resolution, default_value = "1280,800",
        allow_hyphen_values = true)]
    pub resolution: [u32; 2],
    /// Opacity that the ray is to have gathered, above 0 and below 1; not with --projection, where no
    /// opacity counts [default: 0.1]
    #[arg(long, value_name = "A", value_parser = values::inner_share, allow_hyphen_values = true)]
    pub share: Option<f64>,
    /// As JSON
    #[arg(long)]
    pub json: bool,
    /// What is seen, from where.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// What reconstructs the field.
    #[command(flatten)]
    pub mode: ModeFlags,
    /// How it is lit, and what opacities are looked up by.
    #[command(flatten)]
    pub shading: ShadingFlags,
    /// What is cut away, and so not seen; and the surfaces that are seen before all else, if any.
    #[command(flatten)]
    pub inside: InsideFlags,
    /// Vectors, of which the nearest is told; the file's own where it opens with some.
    #[command(flatten)]
    pub vectors: VectorFlags,
    /// Polygons, which are met before what is behind them.
    #[command(flatten)]
    pub polygons: PolygonFlags,
}

/// What is seen, and from where.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneFlags {
    /// From the eye into the scene
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub camera_direction: Option<[f64; 3]>,
    /// Up in the picture; replaced where it is parallel to the direction
    #[arg(long, value_name = "X,Y,Z", value_parser = values::direction, allow_hyphen_values = true)]
    pub camera_view_up: Option<[f64; 3]>,
    /// Axis of the world that points up, as in the window: +z, -z, +y, -y, +x or -x. Views without
    /// --camera-direction look from the front, the right and above at once [default: as the file says, else as its shape tells, else +z]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis, allow_hyphen_values = true,
        conflicts_with = "camera_view_up")]
    pub camera_up_axis: Option<UpAxis>,
    /// World point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub camera_focal_point: Option<[f64; 3]>,
    /// Half the height of the view, world units; in perspective that at the focal point, and so how
    /// far the eye is from it: S / tan(angle / 2) [default: all that is seen fits, polygons among it]
    #[arg(long, value_name = "S", value_parser = values::positive, allow_hyphen_values = true)]
    pub parallel_scale: Option<f64>,
    /// Perspective with this full vertical angle, degrees; --parallel-scale says how far the eye is
    /// [default: orthographic]
    #[arg(long, value_name = "DEG", value_parser = values::view_angle, allow_hyphen_values = true)]
    pub camera_view_angle: Option<f64>,
    /// Field to draw, or the series of a DICOM folder by its name [default: the active one; the series with most pixels]
    #[arg(long, value_name = "NAME")]
    pub field: Option<String>,
    /// Component of the field, from 0; or magnitude, and of vectors vorticity, divergence or helicity
    /// [default: magnitude, where there is more than one]
    #[arg(long, value_name = "N", value_parser = values::component, allow_hyphen_values = true)]
    pub component: Option<Component>,
    /// A look that many data call for: default, ct-bone, ct-skin, ct-vessels, mr or simulation; those
    /// of CT in Hounsfield units where the data are, all others by percentiles [default: default]
    #[arg(long, value_name = "NAME", value_parser = values::preset)]
    pub preset: Option<Preset>,
    /// A transfer function saved in the window; the flags below change it
    #[arg(long, value_name = "FILE", conflicts_with = "preset")]
    pub transfer: Option<PathBuf>,
    /// Opacities at data values, the least first; linear between, held beyond, a step where a value is
    /// given twice
    #[arg(long, value_name = "V:A,…", value_parser = values::opacity, allow_hyphen_values = true)]
    pub opacity: Option<values::Points>,
    /// Colours at data values, the least first; a step where a value is given twice
    #[arg(long, value_name = "V:RRGGBB,…", value_parser = values::colours,
        allow_hyphen_values = true, conflicts_with_all = ["colormap", "color_range"])]
    pub color: Option<values::List<Stop>>,
    /// Named colour map: viridis, cividis, inferno, …
    #[arg(long, value_name = "NAME", value_parser = values::colour_map)]
    pub colormap: Option<ColourMap>,
    /// Data values of the map's ends, two different ones; the greater first reverses the map
    #[arg(long, value_name = "LO,HI", value_parser = values::unequal, allow_hyphen_values = true)]
    pub color_range: Option<[f64; 2]>,
    /// Opacity where the file has no value (NaN), 0 to 1: a box of a voxel's size each [default: 0, left out]
    #[arg(long, value_name = "A", value_parser = values::share, allow_hyphen_values = true)]
    pub nan_opacity: Option<f64>,
    /// Colour of NaN, which no light falls on [default: a0a0a0]
    #[arg(long, value_name = "RRGGBB", value_parser = values::colour)]
    pub nan_color: Option<Srgb8>,
}

impl SceneFlags {
    /// The flags that were given of opacities alone, and of NaN, which have no part in some pictures.
    pub(super) fn of_opacities(&self) -> Vec<&'static str> {
        let given = [
            ("--opacity", self.opacity.is_some()),
            ("--nan-opacity", self.nan_opacity.is_some()),
            ("--nan-color", self.nan_color.is_some()),
        ];
        given.into_iter().filter_map(|(flag, given)| given.then_some(flag)).collect()
    }

    /// Whether flags say themselves what is seen, and how densely.
    pub(super) fn say_what_is_seen(&self) -> bool {
        self.opacity.is_some() || self.color.is_some() || self.transfer.is_some()
    }

    /// Whether flags say which colours values have.
    pub(super) fn chooses_colours(&self) -> bool {
        let looks = self.preset.is_some() || self.transfer.is_some();
        looks || self.color.is_some() || self.color_range.is_some()
    }

    /// The first flag that was given of the scalar field's opacities and colours.
    pub(super) fn of_colours(&self) -> Option<&'static str> {
        [
            ("--preset", self.preset.is_some()),
            ("--transfer", self.transfer.is_some()),
            ("--opacity", self.opacity.is_some()),
            ("--color", self.color.is_some()),
            ("--colormap", self.colormap.is_some()),
            ("--color-range", self.color_range.is_some()),
            ("--nan-opacity", self.nan_opacity.is_some()),
            ("--nan-color", self.nan_color.is_some()),
        ]
        .into_iter()
        .find_map(|(flag, given)| given.then_some(flag))
    }
}

/// How kernels become a picture. What is left open follows from what is chosen.
#[derive(Debug, Args)]
#[command(next_help_heading = "Mode")]
pub struct ModeFlags {
    /// Reconstruction kernel: point, nearest, linear, gaussian, cubic, bspline, gouraud: the cubic's splat as a mesh of
    /// triangles, functions: the basis functions of an encoding themselves, cells: those of an unstructured or
    /// curvilinear grid themselves, or ellipsoids: about scattered points, or those of cells [default: bspline; functions
    /// of a .vrbf file, cells where there are some, ellipsoids of points alone, unless other flags ask for another]
    #[arg(long, value_name = "KERNEL", value_parser = values::kernel)]
    pub kernel: Option<Kernel>,
    /// Splat radius in voxels, of every kernel but point and nearest: linear 0.6 to 2, bspline 0.6 to 8 [default: the
    /// kernel's own, where it passes through the samples or is as published]
    #[arg(long, value_name = "E", value_parser = values::positive, allow_hyphen_values = true)]
    pub extent: Option<f64>,
    /// smooth, or interpolating: values sharpened so that the kernels pass through them [default:
    /// interpolating, unless other flags ask for another]
    #[arg(long, value_name = "HOW", value_parser = values::reconstruction)]
    pub reconstruction: Option<Reconstruction>,
    /// How kernels hide one another: every-sample, sheets or slabs [default: slabs, unless other
    /// flags ask for another]
    #[arg(long, value_name = "HOW", value_parser = values::visibility)]
    pub visibility: Option<Visibility>,
    /// Slabs per smallest voxel spacing, with --visibility slabs [default: 1]
    #[arg(long, value_name = "N", value_parser = values::positive, allow_hyphen_values = true)]
    pub slabs_per_voxel: Option<f64>,
    /// Sheets each kernel is cut into, with --visibility sheets [default: 1]
    #[arg(long, value_name = "N", value_parser = values::sheets, allow_hyphen_values = true)]
    pub sheets_per_kernel: Option<u32>,
    /// optical-depth, or published: opacity times footprint, capped [default: optical-depth]
    #[arg(long, value_name = "MODEL", value_parser = values::opacity_model)]
    pub opacity_model: Option<OpacityModel>,
    /// When values become colour: before reconstruction, after, pre-integrated, or mean: the mean value of each slab,
    /// of basis functions [default: pre-integrated, unless other flags ask for another]
    #[arg(long, value_name = "WHEN", value_parser = values::classify)]
    pub classify: Option<Classify>,
    /// back-to-front or front-to-back [default: front-to-back, unless other flags ask for another]
    #[arg(long, value_name = "ORDER", value_parser = values::order)]
    pub order: Option<Order>,
    /// raster (triangles), tiles (compute), or auto: triangles for every sample by optical depth and
    /// back to front, tiles for all else [default: auto]
    #[arg(long, value_name = "BACKEND", value_parser = values::backend)]
    pub backend: Option<Backend>,
    /// Corners about the middle of a splat, with --kernel gouraud [default: 8]
    #[arg(long, value_name = "N", value_parser = values::natural, allow_hyphen_values = true)]
    pub gouraud_angles: Option<u32>,
    /// Rings of corners of a splat, with --kernel gouraud [default: 4]
    #[arg(long, value_name = "N", value_parser = values::natural, allow_hyphen_values = true)]
    pub gouraud_rings: Option<u32>,
    /// Basis functions that each cell of their lists keeps at most, those that are greatest in it [default: all that reach it]
    #[arg(long, value_name = "N", value_parser = values::natural, allow_hyphen_values = true)]
    pub functions_per_cell: Option<u32>,
    /// With --functions-per-cell: add nothing for the functions that a cell leaves out, rather than what is interpolated
    /// between its corners
    #[arg(long)]
    pub no_cell_correction: bool,
    /// Leave out the least basis functions as long as the field is off by no more than E, rms, in the units of values; 0
    /// keeps all [default: 0]
    #[arg(long, value_name = "E", value_parser = values::number, allow_hyphen_values = true)]
    pub functions_error: Option<f64>,
    /// With --refine coarse: quick pictures of basis functions, without the least as by --functions-error E, rather than of
    /// linear kernels through their samples, wherever these are drawn less small
    #[arg(long, value_name = "E", value_parser = values::positive, allow_hyphen_values = true)]
    pub quick_functions_error: Option<f64>,
    /// World length over which opacities are given [default: the smallest voxel spacing]
    #[arg(long, value_name = "D", value_parser = values::positive, allow_hyphen_values = true)]
    pub opacity_unit_distance: Option<f64>,
}

impl ModeFlags {
    /// Those given that say how matter hides what is behind it.
    pub(super) fn of_hiding(&self) -> Vec<&'static str> {
        let given = [
            (self.opacity_model.is_some(), "--opacity-model"),
            (self.classify.is_some(), "--classify"),
            (self.order.is_some(), "--order"),
            (self.opacity_unit_distance.is_some(), "--opacity-unit-distance"),
        ];
        given.into_iter().filter_map(|(is_given, flag)| is_given.then_some(flag)).collect()
    }

    /// The first that was given and says how the scalar field is drawn, of which vectors have nothing: these
    /// are splats of their own, laid into slabs in an order, with opacities by a model and over a distance.
    pub(super) fn of_field(&self) -> Option<&'static str> {
        [
            ("--kernel", self.kernel.is_some()),
            ("--extent", self.extent.is_some()),
            ("--reconstruction", self.reconstruction.is_some()),
            ("--visibility", self.visibility.is_some()),
            ("--sheets-per-kernel", self.sheets_per_kernel.is_some()),
            ("--classify", self.classify.is_some()),
            ("--backend", self.backend.is_some()),
            ("--gouraud-angles", self.gouraud_angles.is_some()),
            ("--gouraud-rings", self.gouraud_rings.is_some()),
            ("--functions-per-cell", self.functions_per_cell.is_some()),
            ("--functions-error", self.functions_error.is_some()),
            ("--quick-functions-error", self.quick_functions_error.is_some()),
        ]
        .into_iter()
        .find_map(|(flag, given)| given.then_some(flag))
    }

    /// Whether any says how the field is drawn, but for the distance that opacities are given over.
    pub(super) fn are_given(&self) -> bool {
        let Self {
            kernel,
            extent,
            reconstruction,
            visibility,
            slabs_per_voxel,
            sheets_per_kernel,
            opacity_model,
            classify,
            order,
            backend,
            gouraud_angles,
            gouraud_rings,
            functions_per_cell,
            // It is refused without that.
            no_cell_correction: _,
            functions_error,
            quick_functions_error,
            opacity_unit_distance: _,
        } = self;
        kernel.is_some()
            || extent.is_some()
            || reconstruction.is_some()
            || visibility.is_some()
            || slabs_per_voxel.is_some()
            || sheets_per_kernel.is_some()
            || opacity_model.is_some()
            || classify.is_some()
            || order.is_some()
            || backend.is_some()
            || gouraud_angles.is_some()
            || gouraud_rings.is_some()
            || functions_per_cell.is_some()
            || functions_error.is_some()
            || quick_functions_error.is_some()
    }

    /// What of the basis functions they leave out, if they say so.
    fn limits(&self) -> Option<Limits> {
        let is_given = self.functions_per_cell.is_some()
            || self.no_cell_correction
            || self.functions_error.is_some();
        is_given.then(|| Limits {
            per_cell: self.functions_per_cell,
            corrects: !self.no_cell_correction,
            max_rms: self.functions_error.unwrap_or_default(),
        })
    }

    /// The mode that they mean.
    ///
    /// # Errors
    /// Where they contradict one another, or one has no effect.
    pub fn resolve(&self) -> Result<SplatSettings, ModeError> {
        self.choice().resolve_strictly()
    }

    /// The mode that they mean of what is no kernel of samples, where they leave the kernel open and it can be drawn so.
    pub fn of_source(&self, kernel: Kernel, cut: CutSettings) -> Option<SplatSettings> {
        let kernel = self.kernel.is_none().then_some(kernel)?;
        let choice = ModeChoice { kernel: Some(kernel), cut: Some(cut), ..self.choice() };
        choice.resolve_strictly().ok()
    }

    fn choice(&self) -> ModeChoice {
        ModeChoice {
            kernel: self.kernel,
            extent: self.extent,
            opacity_unit_distance: self.opacity_unit_distance,
            visibility: self.visibility,
            slabs_per_voxel: self.slabs_per_voxel,
            sheets_per_kernel: self.sheets_per_kernel,
            opacity_model: self.opacity_model,
            classify: self.classify,
            reconstruction: self.reconstruction,
            order: self.order,
            backend: self.backend,
            gouraud_angles: self.gouraud_angles,
            gouraud_rings: self.gouraud_rings,
            cut: None,
            functions: self.limits(),
            quick_functions: self.quick_functions_error,
        }
    }
}

/// Where an error counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CutWeighting {
    /// Everywhere alike, in every view
    Uniform,
    /// As far as it shows: less behind opaque matter, more near the eye
    View,
}

/// How octree cuts are fitted.
#[derive(Debug, Args)]
#[command(next_help_heading = "Octree cuts: quick pictures of fewer, larger splats")]
pub struct CutFlags {
    /// Draw boxes of voxels as one splat where these differ little: scalar (values), classified (opacity
    /// and colour) or optical-depth (matter along lines through the box) [default: classified]
    #[arg(long, value_name = "WHAT", value_parser = values::cut_error)]
    pub cut_error: Option<ErrorMeasure>,
    /// Where such a difference counts [default: uniform]
    #[arg(long, value_enum, value_name = "HOW")]
    pub cut_weighting: Option<CutWeighting>,
    /// Let boxes that share a face differ by at most a factor of two in size
    #[arg(long)]
    pub cut_balanced: bool,
}

impl CutFlags {
    /// The settings that they mean.
    pub fn settings(&self) -> CutSettings {
        CutSettings {
            measure: self.cut_error.unwrap_or_default(),
            view_dependent: self.cut_weighting == Some(CutWeighting::View),
            balanced: self.cut_balanced,
            moving: Moving::default(),
        }
    }

    /// Those that were given, as one says them in a sentence; `None` where none was.
    pub fn given(&self) -> Option<String> {
        let given = [
            (self.cut_error.is_some(), "--cut-error"),
            (self.cut_weighting.is_some(), "--cut-weighting"),
            (self.cut_balanced, "--cut-balanced"),
        ];
        let given: Vec<_> = given.iter().filter_map(|&(is, name)| is.then_some(name)).collect();
        let (last, others) = given.split_last()?;
        Some(if others.is_empty() {
            (*last).to_owned()
        } else {
            format!("{} and {last}", others.join(", "))
        })
    }
}

/// How far `render` refines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RefineFlag {
    /// The best picture within --budget-ms or --max-error
    Coarse,
    /// Every voxel's full kernel
    Full,
    /// Full, with slabs doubled until two pictures differ by less than 1/512 anywhere
    Converged,
}

impl RefineFlag {
    /// What was found of the flag, for refusals.
    pub fn found(flag: Option<Self>) -> &'static str {
        match flag {
            None => "no --refine, which means full",
            Some(Self::Coarse) => "--refine coarse",
            Some(Self::Full) => "--refine full",
            Some(Self::Converged) => "--refine converged",
        }
    }
}

/// `voxsplat render`.
#[derive(Debug, Args)]
pub struct RenderFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// Where to: X.png, X.exr (linear premultiplied float RGBA), or - for PNG on stdout
    #[arg(long, short, value_name = "FILE")]
    pub output: PathBuf,
    /// Picture size in pixels
    #[arg(long, value_name = "W,H", value_parser = values::resolution, default_value = "1280,800",
        allow_hyphen_values = true)]
    pub resolution: [u32; 2],
    /// What is seen, from where.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// Background colour of a PNG; an EXR has none [default: 000000]
    #[arg(long, value_name = "RRGGBB", value_parser = values::colour)]
    pub background: Option<Srgb8>,
    /// Keep the picture's alpha, as an EXR always does
    #[arg(long, conflicts_with = "background")]
    pub no_background: bool,
    /// How coarse pictures are fitted.
    #[command(flatten)]
    pub cut: CutFlags,
    /// How the kernels become a picture.
    #[command(flatten)]
    pub mode: ModeFlags,
    /// How it is lit.
    #[command(flatten)]
    pub shading: ShadingFlags,
    /// What is cut away.
    #[command(flatten)]
    pub inside: InsideFlags,
    /// Vectors beside it, or instead.
    #[command(flatten)]
    pub vectors: VectorFlags,
    /// Polygons among all of it.
    #[command(flatten)]
    pub polygons: PolygonFlags,
    /// What vectors become beside splats.
    #[command(flatten)]
    pub flow: FlowFlags,
    /// How far to refine [default: full]
    #[arg(long, value_enum)]
    pub refine: Option<RefineFlag>,
    /// Draw isosurfaces, slices, cuts, labels and the borders of cells with the steps of their pixels, one ray each, rather
    /// than with smooth edges, five rays each; --refine coarse and --loop do so in any case
    #[arg(long)]
    pub no_smooth_edges: bool,
    /// With --refine coarse: greatest RMSE against `full`, linear light, of the coarsest octree cut within it: of the field,
    /// where the mode has such cuts and no --cut flag asks for those of classified voxels. Finding such a picture draws
    /// `full` first, and the picture may take longer than `full`: compare them with --stats
    #[arg(long, value_name = "E", value_parser = values::positive, allow_hyphen_values = true)]
    pub max_error: Option<f64>,
    /// With --refine coarse: milliseconds the picture may take
    #[arg(long, value_name = "T", value_parser = values::positive, allow_hyphen_values = true)]
    pub budget_ms: Option<f64>,
    /// With --refine coarse and --budget-ms: what is drawn in that time, as while the view moves in the window: octree (a cut
    /// of the field, wherever there is one), subsampled (all of the field in fewer pixels), or auto: whichever is thought to
    /// be nearer to `full` [default: auto]
    #[arg(long, value_name = "WHAT", value_parser = values::moving)]
    pub moving: Option<Moving>,
    /// With --refine coarse: draw the edges of the octree's cells over the PNG, coloured by level
    #[arg(long)]
    pub cells: bool,
    /// Write over the PNG: scalar-bar, scale-bar, axes, trihedron, or all
    #[arg(long, value_name = "NAME,…", value_parser = values::annotations)]
    pub annotations: Option<Annotations>,
    /// More frames for timing, each with the camera turned by 1°
    #[arg(long, value_name = "N", value_parser = values::frames, default_value_t = 0,
        allow_hyphen_values = true)]
    pub repeat: u32,
    /// Write what was drawn and what it cost, as JSON; - for stdout
    #[arg(long, value_name = "S.json")]
    pub stats: Option<PathBuf>,
    /// What draws.
    #[command(flatten)]
    pub engine: EngineFlags,
}

/// `voxsplat accuracy`.
#[derive(Debug, Args)]
pub struct AccuracyFlags {
    /// The file.
    #[command(flatten)]
    pub input: InputFlags,
    /// Where to: JSON, or - for stdout
    #[arg(long, short, value_name = "T.json")]
    pub output: PathBuf,
    /// Chart of time against error
    #[arg(long, value_name = "P.png")]
    pub plot: Option<PathBuf>,
    /// Picture size in pixels
    #[arg(long, value_name = "W,H", value_parser = values::resolution, default_value = "512,512",
        allow_hyphen_values = true)]
    pub resolution: [u32; 2],
    /// Pixels compared with the exact picture, at least (all where there are no more)
    #[arg(long, value_name = "N", value_parser = values::pixels, default_value_t = 2000,
        allow_hyphen_values = true)]
    pub pixels: u32,
    /// More frames of each mode; its time is their median
    #[arg(long, value_name = "N", value_parser = values::frames, default_value_t = 2,
        allow_hyphen_values = true)]
    pub repeat: u32,
    /// Slabs per voxel that `converged` may go to
    #[arg(long, value_name = "N", value_parser = values::positive, default_value = "16",
        allow_hyphen_values = true)]
    pub max_slabs: f64,
    /// What is seen, from where.
    #[command(flatten)]
    pub scene: SceneFlags,
    /// How the octree cuts among the others are fitted.
    #[command(flatten)]
    pub cut: CutFlags,
    /// A mode to compare with the others.
    #[command(flatten)]
    pub mode: ModeFlags,
    /// Vectors beside the field, or instead.
    #[command(flatten)]
    pub vectors: VectorFlags,
    /// Polygons among all of it.
    #[command(flatten)]
    pub polygons: PolygonFlags,
    /// What vectors become beside splats.
    #[command(flatten)]
    pub flow: FlowFlags,
    /// What draws.
    #[command(flatten)]
    pub engine: EngineFlags,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// Names of the mode's flags, and what each is.
    fn values(settings: &SplatSettings) -> [(&'static str, String); 10] {
        [
            ("kernel", settings.kernel.name().to_owned()),
            ("reconstruction", settings.reconstruction.name().to_owned()),
            ("visibility", settings.visibility.name().to_owned()),
            ("slabs_per_voxel", settings.slabs_per_voxel.to_string()),
            ("sheets_per_kernel", settings.sheets_per_kernel.to_string()),
            ("opacity_model", settings.opacity_model.name().to_owned()),
            ("classify", settings.classify.name().to_owned()),
            ("order", settings.order.name().to_owned()),
            ("gouraud_angles", settings.gouraud.angles.to_string()),
            ("gouraud_rings", settings.gouraud.rings.to_string()),
        ]
    }

    #[test]
    fn help_says_what_each_part_of_a_mode_is_by_default_and_whether_other_flags_change_that() {
        let none = ModeChoice::default();
        let mut others = vec![
            ModeChoice { sheets_per_kernel: Some(2), ..none },
            ModeChoice { extent: Some(2.0), ..none },
            ModeChoice { backend: Some(Backend::Raster), ..none },
        ];
        others.extend(Visibility::ALL.iter().map(|&v| ModeChoice { visibility: Some(v), ..none }));
        others.extend(Classify::ALL.iter().map(|&c| ModeChoice { classify: Some(c), ..none }));
        let given = |choice: &ModeChoice, flag: &str| match flag {
            "visibility" => choice.visibility.is_some(),
            "classify" => choice.classify.is_some(),
            "sheets_per_kernel" => choice.sheets_per_kernel.is_some(),
            _ => false,
        };
        let command = Arguments::command();
        for name in ["render", "accuracy"] {
            let subcommand = command.find_subcommand(name).expect("a subcommand");
            let help = |flag: &str| {
                let arguments = subcommand.get_arguments();
                let found = arguments.filter(|a| a.get_id() == flag).find_map(|a| a.get_help());
                found.unwrap_or_else(|| panic!("no help for {flag}")).to_string()
            };
            let exact = values(&none.resolve().expect("a mode"));
            for (i, (flag, default)) in exact.iter().enumerate() {
                let help = help(flag);
                assert!(help.contains(&format!("[default: {default}")), "{name} {flag}: {help}");
                let follows = others
                    .iter()
                    .filter(|choice| !given(choice, flag))
                    .any(|choice| values(&choice.resolve().expect("a mode"))[i].1 != *default);
                assert_eq!(help.contains("unless other flags ask"), follows, "{name} {flag}");
            }
            for flag in ["extent", "backend", "opacity_unit_distance"] {
                assert!(help(flag).contains("[default: "), "{name} {flag}");
            }
        }
    }
}
