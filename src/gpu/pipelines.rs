//! Pipelines, each compiled when it is first needed and kept.

use std::collections::HashMap;

use super::context::Context;
use super::layout::{Corner, RECORD_WORDS};
use super::shader::{self, Shader};
use super::target::blended_format;
use crate::kernel::{
    COEFFICIENTS, FootprintPolynomial, Kernel, RadialKernel, Rim, SHARE_FACTORS, SHARE_POWERS,
    SlabShare,
};

/// Which variant of the splat pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct SplatVariant {
    pub kernel: Kernel,
    pub perspective: bool,
    /// Every kernel is one voxel large (and the projection parallel).
    pub one_footprint: bool,
    /// Published opacities; of meshes alone.
    pub published: bool,
}

/// Which variant of the passes over lists of scattered kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct ListVariant {
    pub kernel: Kernel,
    pub perspective: bool,
    pub slabs: bool,
    pub front_to_back: bool,
    pub published: bool,
}

/// A shader and its overrides: a pipeline each.
pub(super) struct Program {
    pub shader: Shader,
    /// Of each name the last counts.
    pub constants: Vec<(&'static str, f64)>,
}

impl Program {
    /// Without overrides.
    pub(super) fn plain(shader: Shader) -> Self {
        Self { shader, constants: Vec::new() }
    }
}

/// What tells a pipeline from others: its shader, and the bits of its overrides.
type Key = (&'static str, &'static str, Vec<(&'static str, u64)>);

/// All pipelines of one device, and how many were ever compiled.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    compute: HashMap<Key, wgpu::ComputePipeline>,
    splat: HashMap<SplatVariant, wgpu::RenderPipeline>,
    present: Option<wgpu::RenderPipeline>,
}

impl SplatVariant {
    /// Vertices of one splat but a mesh: a triangle about the ellipse of a voxel, a strip of two else.
    pub(super) fn vertices(self) -> u32 {
        match self.kernel {
            // Small ellipses cost their set-up, large ones their pixels.
            Kernel::Gaussian | Kernel::Cubic if self.one_footprint => 3,
            _ => 4,
        }
    }
}

impl Pipelines {
    /// How many are compiled.
    pub(super) fn len(&self) -> usize {
        self.compute.len() + self.splat.len() + usize::from(self.present.is_some())
    }

    /// A compute pass.
    pub(super) fn compute(
        &mut self,
        context: &Context,
        Program { shader, constants }: &Program,
    ) -> wgpu::ComputePipeline {
        let bits = constants.iter().map(|(name, value)| (*name, value.to_bits())).collect();
        let made = self.compute.entry((shader.name, shader.options, bits)).or_insert_with(|| {
            let (module, constants) = shader.module(context, constants);
            context.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(shader.name),
                layout: None,
                module: &module,
                entry_point: Some(shader.name),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    ..Default::default()
                },
                cache: None,
            })
        });
        made.clone()
    }

    pub(super) fn splat(
        &mut self,
        context: &Context,
        variant: SplatVariant,
    ) -> &wgpu::RenderPipeline {
        self.splat.entry(variant).or_insert_with(|| splat(context, variant))
    }

    pub(super) fn present(&mut self, context: &Context) -> &wgpu::RenderPipeline {
        self.present.get_or_insert_with(|| {
            let (module, _) = shader::PRESENT.module(context, &[]);
            context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(shader::PRESENT.name),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment"),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        })
    }
}

impl ListVariant {
    /// A pass over lists of kernels that are composited so.
    pub(super) fn program(self, shader: Shader) -> Program {
        let shape = match self.kernel {
            Kernel::Gaussian
            | Kernel::Cubic
            | Kernel::Gouraud
            | Kernel::Linear
            | Kernel::BSpline
            | Kernel::Functions
            | Kernel::Cells
            | Kernel::Ellipsoids => 0.0,
            Kernel::Nearest => 1.0,
            Kernel::Point => 2.0,
        };
        let mut constants = vec![
            ("slabs", flag(self.slabs)),
            ("front_to_back", flag(self.front_to_back)),
            ("published", flag(self.published)),
            ("shape", shape),
        ];
        // That pass has what was projected.
        if shader != shader::WRITE_ENTRIES {
            constants.extend(kernel_constants(self.kernel, self.perspective));
        }
        if shader == shader::COMPOSITE_LISTS
            && let Some(radial) = RadialKernel::new(self.kernel, None)
        {
            constants.extend(share_constants(radial));
        }
        Program { shader, constants }
    }
}

/// An override that is on or off.
pub(super) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

/// What `shaders/lib/vectors.wgsl` is told of the kernel of vectors, by names of their own ([`shader`]).
pub(super) fn vector_constants() -> impl Iterator<Item = (&'static str, f64)> {
    let shares = RadialKernel::new(Kernel::Cubic, None).map(share_values);
    let footprint = MARKS_FOOTPRINT.into_iter().zip(footprint_values(Kernel::Cubic));
    footprint.chain(MARKS_SHARE.into_iter().flatten().zip(shares.into_iter().flatten()))
}

/// What `shaders/lib/project.wgsl` and `footprint.wgsl` are told.
fn kernel_constants(kernel: Kernel, perspective: bool) -> Vec<(&'static str, f64)> {
    let perspective = ("perspective", flag(perspective));
    footprint_constants(kernel).chain([perspective]).collect()
}

/// What `shaders/lib/footprint.wgsl` is told.
pub(super) fn footprint_constants(kernel: Kernel) -> impl Iterator<Item = (&'static str, f64)> {
    FOOTPRINT.into_iter().zip(footprint_values(kernel))
}

/// What `shaders/lib/share.wgsl` is told.
pub(super) fn share_constants(kernel: RadialKernel) -> impl Iterator<Item = (&'static str, f64)> {
    SHARE.into_iter().flatten().zip(share_values(kernel))
}

/// Whether the rim is a root, and the coefficients where the kernel is radial.
fn footprint_values(kernel: Kernel) -> impl Iterator<Item = f64> {
    let polynomial = RadialKernel::new(kernel, None).map(FootprintPolynomial::of);
    let rim_root = polynomial.is_some_and(|p| p.rim == Rim::Root);
    let coefficients = polynomial.map(|p| p.coefficients.map(f64::from));
    std::iter::once(flag(rim_root)).chain(coefficients.into_iter().flatten())
}

fn share_values(kernel: RadialKernel) -> impl Iterator<Item = f64> {
    SlabShare::of(kernel).factors.into_iter().flatten().map(f64::from)
}

macro_rules! kernel_names {
    ($footprint:ident, $share:ident, $prefix:literal) => {
        const $footprint: [&str; COEFFICIENTS + 1] = [
            concat!($prefix, "rim_root"),
            concat!($prefix, "c0"),
            concat!($prefix, "c1"),
            concat!($prefix, "c2"),
            concat!($prefix, "c3"),
            concat!($prefix, "c4"),
            concat!($prefix, "c5"),
            concat!($prefix, "c6"),
            concat!($prefix, "c7"),
        ];
        const $share: [[&str; SHARE_POWERS]; SHARE_FACTORS] = [
            kernel_names!($prefix, "s0"),
            kernel_names!($prefix, "s1"),
            kernel_names!($prefix, "s2"),
            kernel_names!($prefix, "s3"),
            kernel_names!($prefix, "s4"),
            kernel_names!($prefix, "s5"),
            kernel_names!($prefix, "s6"),
        ];
    };
    ($prefix:literal, $factor:literal) => {
        [
            concat!($prefix, $factor, "0"),
            concat!($prefix, $factor, "1"),
            concat!($prefix, $factor, "2"),
            concat!($prefix, $factor, "3"),
        ]
    };
}

kernel_names!(FOOTPRINT, SHARE, "");
kernel_names!(MARKS_FOOTPRINT, MARKS_SHARE, "marks_");

fn splat(context: &Context, variant: SplatVariant) -> wgpu::RenderPipeline {
    let mut constants = kernel_constants(variant.kernel, variant.perspective);
    constants.push(("one_footprint", flag(variant.one_footprint)));
    constants.push(("published", flag(variant.published)));
    let (module, constants) = shader::SPLAT.module(context, &constants);
    let options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
    let (vertex, fragment) = match variant.kernel {
        Kernel::Gouraud => ("vertex_gouraud", "fragment_gouraud"),
        Kernel::Gaussian
        | Kernel::Cubic
        | Kernel::Linear
        | Kernel::BSpline
        | Kernel::Functions
        | Kernel::Cells
        | Kernel::Ellipsoids => ("vertex_radial", "fragment_radial"),
        Kernel::Nearest => ("vertex_box", "fragment_box"),
        Kernel::Point => ("vertex_point", "fragment_point"),
    };
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32, 2 => Uint32x3];
    let corner_attributes = wgpu::vertex_attr_array![3 => Float32x2, 4 => Float32];
    let buffers = [
        Some(wgpu::VertexBufferLayout {
            array_stride: RECORD_WORDS as u64 * 4,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        }),
        Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Corner>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &corner_attributes,
        }),
    ];
    let is_mesh = variant.kernel == Kernel::Gouraud;
    context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader::SPLAT.name),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: options.clone(),
            buffers: if is_mesh { &buffers } else { &buffers[..1] },
        },
        primitive: wgpu::PrimitiveState {
            topology: if is_mesh {
                wgpu::PrimitiveTopology::TriangleList
            } else {
                wgpu::PrimitiveTopology::TriangleStrip
            },
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: options,
            targets: &[Some(wgpu::ColorTargetState {
                format: blended_format(context),
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
