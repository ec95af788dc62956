//! Grids without lists: each pixel gathers the lattice's kernels along its own ray, shaded first.

mod constants;

use std::ops::Range;

use constants::Constants;

use super::GpuError;
use super::buffers::{Growing, read_words};
use super::compute::{buffer, buffers, dispatch, rows_of, view as picture_at};
use super::context::Context;
use super::frame::Pass;
use super::layout::{self, TILE};
use super::pipelines::{Program, flag, footprint_constants, share_constants, vector_constants};
use super::rays;
use super::renderer::Renderer;
use super::shade::Shade;
use super::shader::{self, Among};
use super::timing::Timestamps;
use super::vectors::DeviceVectors;
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{OpacityModel, Order, SplatSettings, View, Visibility};

/// Tiles of a picture, numbered along its rows from the top left.
pub fn tile_count(size: [u32; 2]) -> u32 {
    size[0].div_ceil(TILE) * size[1].div_ceil(TILE)
}

/// What is composited at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Layering {
    /// Each sample.
    Sample,
    /// Each slice of the lattice's outermost axis, footprints whole.
    Slice,
    /// Layers perpendicular to that axis, which cut kernels.
    Sheets,
    /// Layers perpendicular to the view.
    Slabs,
}

/// What a pipeline is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    kernel: Kernel,
    layering: Layering,
    opacity_model: OpacityModel,
    order: Order,
    perspective: bool,
    /// Whether samples were shaded ([`super::shaded_samples`]), rather than what their values are classified as.
    are_shaded: bool,
    among: Among,
}

impl Variant {
    fn new(view: &View, settings: &SplatSettings) -> Self {
        let whole = settings.sheets_per_kernel == 1 || settings.kernel == Kernel::Point;
        Self {
            kernel: settings.kernel,
            layering: match settings.visibility {
                Visibility::EverySample => Layering::Sample,
                Visibility::Sheets if whole => Layering::Slice,
                Visibility::Sheets => Layering::Sheets,
                Visibility::Slabs => Layering::Slabs,
            },
            opacity_model: settings.opacity_model,
            order: settings.order,
            perspective: view.eye_distance.is_some(),
            are_shaded: false,
            among: Among::default(),
        }
    }

    fn is_of_cells(self) -> bool {
        matches!(self.kernel, Kernel::Nearest | Kernel::Linear | Kernel::BSpline)
    }

    /// The pass's name.
    fn pass(self) -> &'static str {
        shader::gather(self.is_of_cells(), self.among).name
    }

    fn program(self) -> Program {
        let shader = shader::gather(self.is_of_cells(), self.among);
        Program { shader, constants: self.constants() }
    }

    fn constants(self) -> Vec<(&'static str, f64)> {
        let layering = match self.layering {
            Layering::Sample => 0.0,
            Layering::Slice => 1.0,
            Layering::Sheets | Layering::Slabs => 2.0,
        };
        let mut constants = vec![
            ("layering", layering),
            ("sheets", flag(self.layering == Layering::Sheets)),
            ("published", flag(self.opacity_model == OpacityModel::Published)),
            ("front_to_back", flag(self.order == Order::FrontToBack)),
            ("perspective", flag(self.perspective)),
            ("are_shaded", flag(self.are_shaded)),
        ];
        if self.among != Among::default() {
            constants.push(("back_to_front", flag(self.order == Order::BackToFront)));
        }
        if self.among.vectors {
            constants.extend(vector_constants());
        }
        match self.kernel {
            Kernel::Nearest => constants.push(("support", 1.0)),
            Kernel::Linear => constants.push(("support", 2.0)),
            Kernel::BSpline => constants.push(("support", 4.0)),
            Kernel::Point | Kernel::Gaussian | Kernel::Cubic | Kernel::Gouraud => {
                constants.push(("points", flag(self.kernel == Kernel::Point)));
                if let Some(radial) = RadialKernel::new(self.kernel, None) {
                    constants.extend(footprint_constants(self.kernel));
                    constants.extend(share_constants(radial));
                }
            }
        }
        constants
    }
}

/// What the gathering passes keep on the device.
#[derive(Debug)]
pub(super) struct Gathering {
    constants: wgpu::Buffer,
    /// Of scenes that shade samples; else it is not there.
    shade: Option<wgpu::Buffer>,
    /// What it holds.
    looks: Vec<u8>,
    /// Of the pass that shades samples.
    pub(super) shading: layout::Gather,
    variant: Option<Variant>,
}

impl Gathering {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let size = size_of::<layout::Gather>() as u64;
        Self {
            constants: Growing::make(context, "gather", Usage::UNIFORM | Usage::COPY_DST, size),
            shade: None,
            looks: Vec::new(),
            shading: bytemuck::Zeroable::zeroed(),
            variant: None,
        }
    }

    /// Bytes that lights, tables and regions take.
    pub(super) fn shading_bytes(&self) -> u64 {
        self.shade.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// What samples are shaded by, byte for byte.
    pub(super) fn looks_bytes(&self) -> &[u8] {
        &self.looks
    }

    /// The same on the device.
    pub(super) fn looks(&self) -> Option<&wgpu::Buffer> {
        self.shade.as_ref()
    }

    /// What passes are given.
    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.constants
    }

    pub(super) fn write(&self, context: &Context, constants: &layout::Gather) {
        context.queue.write_buffer(&self.constants, 0, bytemuck::bytes_of(constants));
    }

    /// Brings what samples are shaded by to the device, or lets it go.
    fn write_shade(&mut self, context: &Context, shade: Option<layout::Shade>) {
        self.looks.clear();
        let Some(shade) = shade else {
            self.shade = None;
            return;
        };
        self.looks.extend_from_slice(bytemuck::bytes_of(&shade));
        let made = || {
            use wgpu::BufferUsages as Usage;
            let size = size_of::<layout::Shade>() as u64;
            Growing::make(context, "shade", Usage::UNIFORM | Usage::COPY_DST, size)
        };
        context.queue.write_buffer(self.shade.get_or_insert_with(made), 0, &self.looks);
    }
}

impl Renderer {
    /// Draws some tiles of a picture that [`Renderer::begin`] began, whole: samples classified
    /// first ([`crate::scene::Classify::Before`]), in the mode that `settings` name, and the polygons and
    /// vectors that were set, whose lists were made for this view. Tiles are numbered as [`tile_count`] counts them.
    /// Returns wall milliseconds.
    ///
    /// Samples and whole slices stay whole: a polygon has its turn in the traversal's order between two
    /// slices, as a sample would where the ray meets it, and so has a slab of vectors in its middle. Sheets
    /// that cut kernels, and slabs, are split: what is in one, vectors and all, is taken to be as dense
    /// everywhere between its two planes.
    ///
    /// `unit_distance` is the world length over which the table's extinctions are given. Front to
    /// back, a pixel ends where its transmittance is under `stop_below`.
    ///
    /// # Errors
    /// More slabs than can be told apart, or a failing device.
    pub fn draw_gathered(
        &mut self,
        view: &View,
        settings: &SplatSettings,
        unit_distance: f64,
        stop_below: f64,
        tiles: Range<u32>,
    ) -> Result<f64, GpuError> {
        let tiles = tiles.start..tiles.end.min(tile_count(view.size));
        let lengths = (unit_distance, stop_below);
        let Some(constants) = self.gather_constants(view, settings, lengths, tiles.clone()) else {
            return Ok(0.0);
        };
        // Nothing to draw leaves the picture clear, as it was begun.
        if tiles.is_empty() {
            return Ok(0.0);
        }
        let mut variant = Variant::new(view, settings);
        variant.are_shaded = self.sample_shade().is_some();
        let vectors = self.slabs_have_vectors && self.vectors.is_some();
        variant.among = Among { polygons: self.polygons.is_some(), vectors };
        if variant.are_shaded && self.shaded.whole().is_none() {
            return Err(GpuError::Device("kernels came before their samples".to_owned()));
        }
        match variant.layering {
            Layering::Sample | Layering::Slice => {}
            Layering::Sheets => rays::check(rays::layers_of_kernels(&constants, true))?,
            Layering::Slabs => rays::check(rays::layers_of_kernels(&constants, false))?,
        }
        self.write_traversal(view, &(0..0), 0, 0);
        self.gathering.variant = Some(variant);
        self.gathering.write(&self.context, &constants);
        let pass = Pass::Gather { pass: variant.pass(), tiles: tiles.len() as u32 };
        let wall_ms = self.run(&[pass])?;
        self.check_loops()?;
        Ok(wall_ms)
    }

    /// What a picture's samples are gathered with; `None` where nothing can show, nor anything lies among
    /// them. Of the lengths, the first is that over which the table's extinctions are given, the second
    /// the transmittance at which rays end.
    pub(super) fn gather_constants(
        &self,
        view: &View,
        settings: &SplatSettings,
        (unit_distance, stop_below): (f64, f64),
        tiles: Range<u32>,
    ) -> Option<layout::Gather> {
        let volume = self.volume.as_ref()?;
        let table = volume.table.as_ref()?;
        let lattice = volume.source.lattice;
        let shows = table.showing[0][0] <= table.showing[1][0];
        // Any brick, which is known to show nothing.
        let showing = if shows { table.showing } else { [[0; 3]; 2] };
        (shows || self.polygons.is_some() || self.slabs_have_vectors).then(|| {
            Constants {
                view,
                settings,
                unit_distance,
                stop_below,
                dims: lattice.dims,
                bricks: volume.source.bricks.dims,
                smallest_spacing: lattice.smallest_spacing(),
                showing,
                tiles,
            }
            .gather()
        })
    }

    /// What samples are shaded by, where a scene shades any.
    pub(super) fn sample_shade(&self) -> Option<&Shade> {
        self.shade.as_ref().filter(|shade| !shade.is_of_surfaces)
    }

    /// Brings what a scene's samples are shaded by to the device, or lets it go.
    pub(super) fn write_looks(&mut self, view: &View) {
        let shade = self.sample_shade();
        let values = self.volume.as_ref().map_or_else(Default::default, |v| v.samples.values());
        let growth = view.eye_distance.map_or(0.0, |eye| (1.0 / eye) as f32);
        let shade = shade.map(|shade| shade.constants(values, 0, view.pixels_per_unit, growth));
        self.gathering.write_shade(&self.context, shade);
    }

    /// Sums of published opacities that were over 1 since [`Renderer::begin`], and were capped.
    ///
    /// # Errors
    /// A failing device.
    pub fn capped_sums(&mut self) -> Result<u64, GpuError> {
        let words = read_words(&self.context, &self.totals, 16)?;
        Ok(u64::from(words[2]) | u64::from(words[3]) << 32)
    }

    pub(super) fn gather(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let Some(variant) = self.gathering.variant else { return };
        let (Some(target), Some(volume)) = (&self.target, &self.volume) else { return };
        let Some(table) = &volume.table else { return };
        let program = variant.program();
        let pipeline = self.pipelines.compute(&self.context, &program);
        let light = target.light.create_view(&Default::default());
        let mut entries = vec![
            buffer(0, &self.traversal),
            buffer(5, &table.entries),
            buffer(6, &table.visible),
            buffer(7, &self.gathering.constants),
            buffer(8, &self.totals),
            picture_at(11, &light),
        ];
        match self.shaded.whole().filter(|_| variant.are_shaded) {
            // In their place; no index leads beyond the second.
            Some([slots, samples]) => entries.extend(buffers(1, [samples, slots, slots, slots])),
            None => entries.extend(buffers(1, volume.samples.bound())),
        }
        let polygons = self.polygons.as_ref().filter(|_| variant.among.polygons);
        entries.extend(polygons.map(|polygons| buffer(14, polygons.words())));
        let vectors = self.vectors.as_ref().filter(|_| variant.among.vectors);
        let marks = vectors.map(DeviceVectors::marks);
        if let (Some(vectors), Some(lists), Some(marks)) = (vectors, &self.lists, &marks) {
            entries.extend(vectors.entries(lists, marks));
        }
        let name = program.shader.name;
        dispatch(&self.context, encoder, name, &pipeline, &entries, rows_of(tiles), clock);
    }
}
