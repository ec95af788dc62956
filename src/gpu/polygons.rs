//! Polygons on the device: the fragments that each pixel sees of them, sorted by depth
//! (`count_polygons.wgsl`, `place_polygons.wgsl`, `write_polygons.wgsl`, `sort_polygons.wgsl`), which the
//! walks along rays lay down among what else they meet (`lib/polygons.wgsl`).
//!
//! They are made once a view. How many there are is known before room is taken for them, so that none is
//! lost: the counting pass runs again once there is more room.

use glam::DVec3;

use super::GpuError;
use super::buffers::Growing;
use super::clock::Timestamps;
use super::compute::{bind_group, buffers, render_pass};
use super::context::Context;
use super::layout::{self, narrow4};
use super::shader::{self, Shader};
use crate::core::Srgb8;
use crate::plan::Plan;
use crate::scene::{Lighting, PolygonLayer, View};

/// What is nearer to the eye than this share of its distance to the focal plane is left out.
const NEAREST: f64 = 1e-4;
/// Places farther than this from the middle of the volume, in its radii, have no digits left.
const MOST_RADII: f64 = 1e15;

/// What polygons keep on the device.
#[derive(Debug)]
pub(super) struct DevicePolygons {
    /// What the corners are of.
    pub(super) layers: Vec<PolygonLayer>,
    pub(super) centre: DVec3,
    /// World length of a unit of the corners' places.
    pub(super) radius: f64,
    pub(super) corners: wgpu::Buffer,
    pub(super) triangles: u32,
    pub(super) constants: wgpu::Buffer,
    pub(super) words: Growing,
    pub(super) sums: wgpu::Buffer,
    /// What samples are counted on; nothing is written to it.
    pub(super) samples: Option<wgpu::Texture>,
    pub(super) pipelines: [Option<wgpu::RenderPipeline>; 2],
    pub(super) made: Option<MadeOf>,
}

/// Everything that the fragments depend on beside the corners.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MadeOf {
    pub(super) view: View,
    pub(super) axes: [DVec3; 3],
    pub(super) lighting: Lighting,
    /// Whether opaque ones hide what is behind them.
    pub(super) hides: bool,
}

/// Three corners of every triangle, about a centre.
fn corners(
    layers: &[PolygonLayer],
    centre: DVec3,
    radius: f64,
) -> Result<Vec<layout::PolygonCorner>, GpuError> {
    let mut found = Vec::new();
    let mut farthest = 0.0_f64;
    for layer in layers {
        let from_centre = layer.mesh.origin() - centre;
        for (triangle, colours) in layer.triangles() {
            for (i, Srgb8([r, g, b])) in colours.into_iter().enumerate() {
                let place = (triangle.corners[i].as_dvec3() + from_centre) / radius;
                farthest = farthest.max(place.abs().max_element());
                let bits = f32::from_bits(u32::from_le_bytes([r, g, b, 0]));
                found.push(layout::PolygonCorner {
                    place: narrow4(place, layer.look.opacity),
                    normal: triangle.normals[i].extend(bits).to_array(),
                });
            }
        }
    }
    if farthest > MOST_RADII {
        return Err(GpuError::TooLarge {
            what: "polygons about the volume",
            limit: format!("{MOST_RADII:.0e} of its radii"),
            found: format!("{farthest:.1e}"),
            advice: "give the mesh in the volume's own units, or leave it out",
        });
    }
    Ok(found)
}

impl DevicePolygons {
    pub(super) fn new(
        context: &Context,
        layers: Vec<PolygonLayer>,
        plan: &Plan,
    ) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as Usage;
        let lattice = &plan.frame.lattice;
        let (centre, radius) = (lattice.centre(), lattice.bounding_radius());
        let triangles: usize = layers.iter().map(|layer| layer.mesh.len()).sum();
        let bytes = 3 * (size_of::<layout::PolygonCorner>() * triangles) as u64;
        let most = context.limits.max_storage_buffer_binding_size.min(u64::from(u32::MAX) << 2);
        // Triangles are numbered in 28 bits.
        if bytes > most || triangles >= 1 << 28 {
            return Err(GpuError::TooLarge {
                what: "polygons",
                limit: format!(
                    "{} triangles",
                    (most / (3 * size_of::<layout::PolygonCorner>() as u64)).min(1 << 28)
                ),
                found: triangles.to_string(),
                advice: "simplify the mesh, or leave one out",
            });
        }
        let placed = corners(&layers, centre, radius)?;
        let storage = Usage::STORAGE | Usage::COPY_DST;
        let corners = Growing::make(context, "polygon corners", storage, bytes);
        context.queue.write_buffer(&corners, 0, bytemuck::cast_slice(&placed));
        let constants = Growing::make(
            context,
            "polygons",
            Usage::UNIFORM | Usage::COPY_DST,
            size_of::<layout::Polygons>() as u64,
        );
        Ok(Self {
            layers,
            centre,
            radius,
            corners,
            triangles: triangles as u32,
            constants,
            words: Growing::new(context, "polygons of pixels", storage | Usage::COPY_SRC),
            sums: Growing::make(context, "polygon sums", storage | Usage::COPY_SRC, 32),
            samples: None,
            pipelines: [None, None],
            made: None,
        })
    }

    pub(super) fn size_bytes(&self) -> u64 {
        let samples = self.samples.as_ref().map_or(0, |s| 4 * s.width() * s.height());
        self.corners.size() + self.words.buffer.size() + u64::from(samples)
    }

    /// The fragments of pixels.
    pub(super) fn words(&self) -> &wgpu::Buffer {
        &self.words.buffer
    }

    fn constants(&self, view: &View, made: &MadeOf) -> layout::Polygons {
        let mut constants: layout::Polygons = bytemuck::Zeroable::zeroed();
        let [right, up, forward] = made.axes;
        let scale = view.pixels_per_unit * self.radius;
        constants.right = narrow4(right * scale, view.view_centre.x);
        constants.up = narrow4(up * scale, view.view_centre.y);
        constants.forward = narrow4(forward * scale, view.view_centre.z);
        let [width, height] = view.size.map(f64::from);
        let eye = view.eye_distance.unwrap_or(0.0);
        constants.picture = narrow4(DVec3::new(width / 2.0, height / 2.0, eye), eye * NEAREST);
        let lighting = &made.lighting;
        let Lighting { ambient, diffuse, specular, exponent, .. } = *lighting;
        constants.material = narrow4(DVec3::new(ambient, diffuse, specular), exponent);
        let pixels = view.size[0] * view.size[1];
        let words = u32::try_from(self.words.buffer.size() / 4).unwrap_or(u32::MAX);
        constants.counts = [view.size[0], pixels, words, 0];
        constants
    }

    pub(super) fn write_constants(
        &self,
        context: &Context,
        plan: &Plan,
        view: &View,
        made: &MadeOf,
    ) {
        let mut constants = self.constants(view, made);
        if made.lighting.uses_lights() {
            let lights = made.lighting.lights.iter().take(layout::MOST_LIGHTS);
            for (i, light) in lights.enumerate() {
                constants.towards[i] = narrow4(light.towards(&plan.camera), 0.0);
                constants.colours[i] = narrow4(DVec3::from(light.colour.to_linear().0), 0.0);
                constants.counts[3] += 1;
            }
        }
        context.queue.write_buffer(&self.constants, 0, bytemuck::bytes_of(&constants));
    }

    /// The pass that rasterises the triangles once more.
    pub(super) fn rasterise(
        &mut self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        which: Shader,
        clock: Option<&Timestamps>,
    ) {
        let pipeline = self.pipelines[usize::from(which == shader::WRITE_POLYGONS)]
            .get_or_insert_with(|| pipeline(context, which));
        let Some(samples) = &self.samples else { return };
        let bound = [&self.constants, &self.corners, &self.words.buffer];
        let entries: Vec<_> = buffers(0, bound).collect();
        let layout = pipeline.get_bind_group_layout(0);
        let group = bind_group(context, which.name, &layout, &entries);
        let view = samples.create_view(&Default::default());
        let ops = wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Discard,
        };
        let mut render = render_pass(encoder, which.name, &view, ops, clock);
        render.set_pipeline(pipeline);
        render.set_bind_group(0, &group, &[]);
        render.draw(0..3 * self.triangles, 0..1);
    }
}

/// What samples are counted on.
const SAMPLES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

fn pipeline(context: &Context, shader: Shader) -> wgpu::RenderPipeline {
    let (module, _) = shader.module(context, &[]);
    context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count: 4, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: SAMPLES_FORMAT,
                blend: None,
                write_mask: wgpu::ColorWrites::empty(),
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

pub(super) fn samples(context: &Context, size: [u32; 2]) -> wgpu::Texture {
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("samples of polygons"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 4,
        dimension: wgpu::TextureDimension::D2,
        format: SAMPLES_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    })
}
