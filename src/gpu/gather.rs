//! Grids without lists: each pixel gathers the lattice's kernels along its own ray, shaded first.

pub(super) mod constants;

use super::buffers::Growing;
use super::context::Context;
use super::layout::{self, TILE};
use super::pipelines::{Program, flag, footprint_constants, share_constants, vector_constants};
use super::shader::{self, Among};
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{OpacityModel, Order, SplatSettings, View, Visibility};

/// Tiles of a picture, numbered along its rows from the top left.
pub fn tile_count(size: [u32; 2]) -> u32 {
    size[0].div_ceil(TILE) * size[1].div_ceil(TILE)
}

/// What is composited at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Layering {
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
pub(super) struct Variant {
    pub(super) kernel: Kernel,
    /// Of products, samples of an axis in reach of a place; and whether they are of another than their natural width.
    pub(super) support: u32,
    pub(super) is_scaled: bool,
    pub(super) layering: Layering,
    pub(super) opacity_model: OpacityModel,
    pub(super) order: Order,
    pub(super) perspective: bool,
    /// Whether samples were shaded ([`super::shaded_samples`]), rather than what their values are classified as.
    pub(super) are_shaded: bool,
    pub(super) among: Among,
}

impl Variant {
    pub(super) fn new(view: &View, settings: &SplatSettings) -> Self {
        let whole = settings.sheets_per_kernel == 1 || settings.kernel == Kernel::Point;
        Self {
            kernel: settings.kernel,
            support: support(settings),
            is_scaled: settings.kernel.is_separable()
                && settings.kernel.scale(settings.extent) != 1.0,
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
    pub(super) fn pass(self) -> &'static str {
        shader::gather(self.is_of_cells(), self.among).name
    }

    pub(super) fn program(self) -> Program {
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
            Kernel::Nearest | Kernel::Linear | Kernel::BSpline => {
                constants.push(("support", f64::from(self.support)));
                constants.push(("tents", flag(self.kernel == Kernel::Linear)));
                constants.push(("is_scaled", flag(self.is_scaled)));
            }
            Kernel::Point
            | Kernel::Gaussian
            | Kernel::Cubic
            | Kernel::Gouraud
            | Kernel::Functions
            | Kernel::Cells
            | Kernel::Ellipsoids => {
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

/// Samples that a cell has along each axis; 1 of kernels that are not gathered cell by cell.
fn support(settings: &SplatSettings) -> u32 {
    if !settings.kernel.is_separable() {
        return 1;
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "2..=16")]
    let side = settings.kernel.reach(settings.extent).ceil().clamp(1.0, 8.0) as u32;
    2 * side
}

/// What the gathering passes keep on the device.
#[derive(Debug)]
pub(super) struct Gathering {
    pub(super) constants: wgpu::Buffer,
    /// Of scenes that shade samples; else it is not there.
    pub(super) shade: Option<wgpu::Buffer>,
    /// What it holds.
    pub(super) looks: Vec<u8>,
    /// Of the pass that shades samples.
    pub(super) shading: layout::Gather,
    pub(super) variant: Option<Variant>,
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
    pub(super) fn write_shade(&mut self, context: &Context, shade: Option<layout::Shade>) {
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
