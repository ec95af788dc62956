//! Pipelines, each compiled when it is first needed and kept.

use std::collections::HashMap;

use super::context::Context;
use super::layout::{Corner, RECORD_WORDS};
use super::shader::{self, Shader};
use super::target::light_format;
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

/// Which variant of the pass over vectors alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) struct VectorVariant {
    pub published: bool,
    pub back_to_front: bool,
    pub polygons: bool,
    /// Rays are walked in several dispatches.
    pub in_parts: bool,
}

/// All pipelines of one device, and how many were ever compiled.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    compute: HashMap<&'static str, wgpu::ComputePipeline>,
    lists: HashMap<(&'static str, ListVariant), wgpu::ComputePipeline>,
    vectors: HashMap<VectorVariant, wgpu::ComputePipeline>,
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
        let compute = self.compute.len() + self.lists.len() + self.vectors.len();
        compute + self.splat.len() + usize::from(self.present.is_some())
    }

    pub(super) fn compute(&mut self, context: &Context, shader: Shader) -> &wgpu::ComputePipeline {
        self.compute.entry(shader.name).or_insert_with(|| {
            compute_pipeline(context, shader, &shader.module(&context.device), &[])
        })
    }

    /// A pass over lists that depends on how they are composited.
    pub(super) fn lists(
        &mut self,
        context: &Context,
        shader: Shader,
        variant: ListVariant,
    ) -> &wgpu::ComputePipeline {
        self.lists.entry((shader.name, variant)).or_insert_with(|| {
            let shape = match variant.kernel {
                Kernel::Gaussian
                | Kernel::Cubic
                | Kernel::Gouraud
                | Kernel::Linear
                | Kernel::BSpline => 0.0,
                Kernel::Nearest => 1.0,
                Kernel::Point => 2.0,
            };
            let mut constants = vec![
                ("slabs", flag(variant.slabs)),
                ("front_to_back", flag(variant.front_to_back)),
                ("published", flag(variant.published)),
                ("shape", shape),
            ];
            // That pass has what was projected.
            if shader != shader::WRITE_ENTRIES {
                constants.extend(kernel_constants(variant.kernel, variant.perspective));
            }
            if shader == shader::COMPOSITE_LISTS
                && let Some(radial) = RadialKernel::new(variant.kernel, None)
            {
                constants.extend(share_constants(radial));
            }
            let module = shader.module_writing(&context.device, light_format(context));
            compute_pipeline(context, shader, &module, &constants)
        })
    }

    /// The pass over vectors alone.
    pub(super) fn vectors(
        &mut self,
        context: &Context,
        variant: VectorVariant,
        format: wgpu::TextureFormat,
    ) -> &wgpu::ComputePipeline {
        self.vectors.entry(variant).or_insert_with(|| {
            let mut constants = vector_constants();
            constants.push(("published", flag(variant.published)));
            constants.push(("back_to_front", flag(variant.back_to_front)));
            let shader = match (variant.polygons, variant.in_parts) {
                (true, false) => shader::COMPOSITE_VECTORS_AND_POLYGONS,
                (true, true) => shader::COMPOSITE_VECTORS_AND_POLYGONS_IN_PARTS,
                (false, false) => shader::COMPOSITE_VECTORS,
                (false, true) => shader::COMPOSITE_VECTORS_IN_PARTS,
            };
            let module = shader.module_writing(&context.device, format);
            compute_pipeline(context, shader, &module, &constants)
        })
    }

    pub(super) fn splat(
        &mut self,
        context: &Context,
        format: wgpu::TextureFormat,
        variant: SplatVariant,
    ) -> &wgpu::RenderPipeline {
        self.splat.entry(variant).or_insert_with(|| splat(context, format, variant))
    }

    pub(super) fn present(&mut self, context: &Context) -> &wgpu::RenderPipeline {
        self.present.get_or_insert_with(|| {
            let module = shader::PRESENT.module(&context.device);
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

/// A pipeline of a shader's module with its overrides.
pub(super) fn compute_pipeline(
    context: &Context,
    shader: Shader,
    module: &wgpu::ShaderModule,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    context.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        module,
        entry_point: Some(shader.name),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    })
}

/// An override that is on or off.
pub(super) fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

/// What `shaders/lib/vectors.wgsl` is told of the kernel of vectors (`footprint.wgsl`, `share.wgsl`).
pub(super) fn vector_constants() -> Vec<(&'static str, f64)> {
    let mut constants = footprint_constants(Kernel::Cubic);
    if let Some(radial) = RadialKernel::new(Kernel::Cubic, None) {
        constants.extend(share_constants(radial));
    }
    constants
}

/// What `shaders/lib/project.wgsl` and `footprint.wgsl` are told.
fn kernel_constants(kernel: Kernel, perspective: bool) -> Vec<(&'static str, f64)> {
    let mut constants = footprint_constants(kernel);
    constants.push(("perspective", flag(perspective)));
    constants
}

pub(super) fn footprint_constants(kernel: Kernel) -> Vec<(&'static str, f64)> {
    const NAMES: [&str; COEFFICIENTS] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];
    let polynomial = RadialKernel::new(kernel, None).map(FootprintPolynomial::of);
    let rim_root = polynomial.is_some_and(|p| p.rim == Rim::Root);
    let mut constants = vec![("rim_root", flag(rim_root))];
    if let Some(polynomial) = polynomial {
        constants.extend(NAMES.into_iter().zip(polynomial.coefficients.map(f64::from)));
    }
    constants
}

/// What `shaders/lib/share.wgsl` is told.
pub(super) fn share_constants(kernel: RadialKernel) -> impl Iterator<Item = (&'static str, f64)> {
    const NAMES: [[&str; SHARE_POWERS]; SHARE_FACTORS] = [
        ["s00", "s01", "s02", "s03"],
        ["s10", "s11", "s12", "s13"],
        ["s20", "s21", "s22", "s23"],
        ["s30", "s31", "s32", "s33"],
        ["s40", "s41", "s42", "s43"],
        ["s50", "s51", "s52", "s53"],
        ["s60", "s61", "s62", "s63"],
    ];
    let factors = SlabShare::of(kernel).factors;
    NAMES.into_iter().flatten().zip(factors.into_iter().flatten().map(f64::from))
}

fn splat(
    context: &Context,
    format: wgpu::TextureFormat,
    variant: SplatVariant,
) -> wgpu::RenderPipeline {
    let module = shader::SPLAT.module(&context.device);
    let mut constants = kernel_constants(variant.kernel, variant.perspective);
    constants.push(("one_footprint", flag(variant.one_footprint)));
    constants.push(("published", flag(variant.published)));
    let options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
    let (vertex, fragment) = match variant.kernel {
        Kernel::Gouraud => ("vertex_gouraud", "fragment_gouraud"),
        Kernel::Gaussian | Kernel::Cubic | Kernel::Linear | Kernel::BSpline => {
            ("vertex_radial", "fragment_radial")
        }
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
                format,
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
