//! Polygons on the device: the fragments that each pixel sees of them, sorted by depth
//! (`count_polygons.wgsl`, `place_polygons.wgsl`, `write_polygons.wgsl`, `sort_polygons.wgsl`), which the
//! walks along rays lay down among what else they meet (`lib/polygons.wgsl`).
//!
//! They are made once a view. How many there are is known before room is taken for them, so that none is
//! lost: the counting pass runs again once there is more room.

use glam::DVec3;

use super::GpuError;
use super::buffers::{Growing, read_words};
use super::compute::{bind_group, buffers, dispatch, groups_of, render_pass};
use super::context::{Context, POLYGON_BUFFERS, VECTOR_AND_POLYGON_BUFFERS};
use super::frame::Pass;
use super::layout::{self, FRAGMENT_WORDS, POLYGON_THREADS};
use super::pipelines::Program;
use super::renderer::Renderer;
use super::shade::with;
use super::shader::{self, Shader};
use super::timing::Timestamps;
use crate::core::Srgb8;
use crate::plan::Plan;
use crate::scene::{Lighting, OpacityModel, POLYGON_COLOUR, PolygonLayer, View};

/// What is nearer to the eye than this share of its distance to the focal plane is left out.
const NEAREST: f64 = 1e-4;
/// Places farther than this from the middle of the volume, in its radii, have no digits left.
const MOST_RADII: f64 = 1e15;

/// What polygons keep on the device.
#[derive(Debug)]
pub(super) struct DevicePolygons {
    /// What the corners are of.
    layers: Vec<PolygonLayer>,
    centre: DVec3,
    /// World length of a unit of the corners' places.
    radius: f64,
    corners: wgpu::Buffer,
    triangles: u32,
    constants: wgpu::Buffer,
    words: Growing,
    sums: wgpu::Buffer,
    /// What samples are counted on; nothing is written to it.
    samples: Option<wgpu::Texture>,
    pipelines: [Option<wgpu::RenderPipeline>; 2],
    made: Option<MadeOf>,
}

/// Everything that the fragments depend on beside the corners.
#[derive(Debug, Clone, PartialEq)]
struct MadeOf {
    view: View,
    axes: [DVec3; 3],
    lighting: Lighting,
    /// Whether opaque ones hide what is behind them.
    hides: bool,
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
        for triangle in layer.mesh.triangles(layer.look.is_smooth) {
            let colours = match (layer.look.colour, triangle.colours) {
                (Some(colour), _) => [colour; 3],
                (None, Some(own)) => own,
                (None, None) => [POLYGON_COLOUR; 3],
            };
            for (i, Srgb8([r, g, b])) in colours.into_iter().enumerate() {
                let place = (triangle.corners[i].as_dvec3() - centre) / radius;
                farthest = farthest.max(place.abs().max_element());
                let bits = f32::from_bits(u32::from_le_bytes([r, g, b, 0]));
                found.push(layout::PolygonCorner {
                    place: with(place, layer.look.opacity),
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
    fn new(context: &Context, layers: Vec<PolygonLayer>, plan: &Plan) -> Result<Self, GpuError> {
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

    fn size_bytes(&self) -> u64 {
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
        constants.right = with(right * scale, view.view_centre.x);
        constants.up = with(up * scale, view.view_centre.y);
        constants.forward = with(forward * scale, view.view_centre.z);
        let [width, height] = view.size.map(f64::from);
        let eye = view.eye_distance.unwrap_or(0.0);
        constants.picture = with(DVec3::new(width / 2.0, height / 2.0, eye), eye * NEAREST);
        let lighting = &made.lighting;
        let Lighting { ambient, diffuse, specular, exponent, .. } = *lighting;
        constants.material = with(DVec3::new(ambient, diffuse, specular), exponent);
        let pixels = view.size[0] * view.size[1];
        let words = u32::try_from(self.words.buffer.size() / 4).unwrap_or(u32::MAX);
        constants.counts = [view.size[0], pixels, words, 0];
        constants
    }

    fn write_constants(&self, context: &Context, plan: &Plan, view: &View, made: &MadeOf) {
        let mut constants = self.constants(view, made);
        if made.lighting.uses_lights() {
            let lights = made.lighting.lights.iter().take(layout::MOST_LIGHTS);
            for (i, light) in lights.enumerate() {
                constants.towards[i] = with(light.towards(&plan.camera), 0.0);
                constants.colours[i] = with(DVec3::from(light.colour.to_linear().0), 0.0);
                constants.counts[3] += 1;
            }
        }
        context.queue.write_buffer(&self.constants, 0, bytemuck::bytes_of(&constants));
    }

    /// The pass that rasterises the triangles once more.
    fn rasterise(
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
    let module = shader.module(&context.device);
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

fn samples(context: &Context, size: [u32; 2]) -> wgpu::Texture {
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

impl Renderer {
    /// Brings a plan's polygons to the device, or lets go of those that are not drawn any more.
    ///
    /// # Errors
    /// Too many of them, or too far away, or an adapter that binds too few buffers.
    pub(super) fn set_polygons(&mut self, plan: &Plan) -> Result<(), GpuError> {
        let layers = plan.polygons();
        if layers.is_empty() {
            (self.polygons, self.polygons_before) = (None, None);
            return Ok(());
        }
        let needed = match !plan.kernels.is_empty() {
            true => VECTOR_AND_POLYGON_BUFFERS,
            false => POLYGON_BUFFERS,
        };
        let offered = self.context.limits.max_storage_buffers_per_shader_stage;
        if offered < needed {
            return Err(GpuError::TooLarge {
                what: "buffers of polygons and a field in one pass",
                limit: format!("{offered} buffers"),
                found: needed.to_string(),
                advice: "choose another --adapter",
            });
        }
        let lattice = &plan.frame.lattice;
        let is_there = self.polygons.as_ref().is_some_and(|held| {
            held.layers == layers
                && held.centre == lattice.centre()
                && held.radius == lattice.bounding_radius()
        });
        if !is_there {
            // What was compiled stays.
            let old = self.polygons.take();
            let mut new = DevicePolygons::new(&self.context, layers, plan)?;
            if let Some(old) = old {
                (new.pipelines, new.samples, new.words) = (old.pipelines, old.samples, old.words);
            }
            self.polygons = Some(new);
            self.upload_count += 1;
            self.note_bytes();
        }
        self.context.check()
    }

    /// Makes the lists of what each pixel of a view sees of the polygons that were set, unless they are
    /// there.
    ///
    /// # Errors
    /// More of them over a pixel, or over all, than there is room or time for; a failing device.
    pub fn make_polygon_lists(&mut self, plan: &Plan, view: &View) -> Result<(), GpuError> {
        let camera = &plan.camera;
        let made = MadeOf {
            view: *view,
            axes: [camera.right(), camera.up, camera.direction],
            lighting: plan.shading.polygon_lighting(),
            // What is cut away hides nothing; and published opacities do not add up, so that matter is divided
            // wherever any sample of a pixel has a polygon.
            hides: !plan.inside.clip.cuts()
                && plan.mode.opacity_model == OpacityModel::OpticalDepth,
        };
        let most_side = self.context.limits.max_texture_dimension_2d;
        let Some(polygons) = self.polygons.as_mut() else { return Ok(()) };
        // Pictures that are too large are refused when they are begun.
        if polygons.made.as_ref() == Some(&made) || view.size.iter().any(|&n| n > most_side) {
            return Ok(());
        }
        polygons.made = None;
        let pixels = view.size[0] * view.size[1];
        let size = polygons.samples.as_ref().map(|s| [s.width(), s.height()]);
        if size != Some(view.size) {
            polygons.samples = Some(samples(&self.context, view.size));
        }
        let heads = 8 * u64::from(pixels);
        polygons.words.reserve(&self.context, heads)?;
        let triangles = polygons.triangles;
        loop {
            let Some(polygons) = self.polygons.as_mut() else { return Ok(()) };
            polygons.write_constants(&self.context, plan, view, &made);
            let asked = 2 * u32::from(self.context.ends_loops);
            let sums = [0, 0, pixels, u32::from(made.hides), 0, asked, 0, 0];
            self.context.queue.write_buffer(&polygons.sums, 0, bytemuck::cast_slice(&sums));
            let mut encoder = self.context.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(&polygons.words.buffer, 0, Some(heads));
            self.context.queue.submit([encoder.finish()]);
            self.run_before(&[Pass::CountPolygons { triangles }, Pass::PlacePolygons { pixels }])?;
            let Some(polygons) = self.polygons.as_mut() else { return Ok(()) };
            let found = read_words(&self.context, &polygons.sums, 8)?;
            let (mut count, longest) = (u64::from(found[0]), found[1]);
            if u64::from(longest) * u64::from(pixels) > u64::from(u32::MAX) {
                // The device's own sum may have gone round.
                let counts = read_words(&self.context, &polygons.words.buffer, heads)?;
                count = counts.chunks_exact(2).map(|head| u64::from(head[1])).sum();
            }
            let words = 2 * u64::from(pixels) + u64::from(FRAGMENT_WORDS) * count;
            let most = self.context.limits.max_storage_buffer_binding_size / 4;
            if words > most.min(u64::from(u32::MAX)) {
                return Err(GpuError::TooLarge {
                    what: "polygons over all pixels",
                    limit: format!("{} times a pixel", most / u64::from(FRAGMENT_WORDS)),
                    found: format!("{count} times"),
                    advice: "choose a smaller picture, or leave a mesh out",
                });
            }
            if 4 * words > polygons.words.buffer.size() {
                let room = (4 * words).max(1);
                let most_bytes = self.context.limits.max_storage_buffer_binding_size;
                let usage = polygons.words.buffer.usage();
                // Half as much again where that may be.
                let size = (room + room / 2).min(most_bytes);
                polygons.words.buffer =
                    Growing::make(&self.context, "polygons of pixels", usage, size);
                self.note_bytes();
                continue;
            }
            self.run_before(&[Pass::WritePolygons { triangles }, Pass::SortPolygons { pixels }])?;
            let Some(polygons) = self.polygons.as_mut() else { return Ok(()) };
            if self.context.ends_loops && read_words(&self.context, &polygons.sums, 20)?[4] > 0 {
                return Err(GpuError::EndedLoops);
            }
            polygons.made = Some(made);
            return self.context.check();
        }
    }

    /// Bytes that polygons take on the device: nothing once a picture without was drawn.
    pub fn polygon_bytes(&self) -> u64 {
        let held = self.polygons.as_ref().or(self.polygons_before.as_ref());
        held.map_or(0, DevicePolygons::size_bytes)
    }

    pub(super) fn encode_polygons(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        clock: Option<&Timestamps>,
    ) {
        let Some(polygons) = self.polygons.as_mut() else { return };
        let context = &self.context;
        let (shader, pixels) = match pass {
            Pass::CountPolygons { .. } => {
                return polygons.rasterise(context, encoder, shader::COUNT_POLYGONS, clock);
            }
            Pass::WritePolygons { .. } => {
                return polygons.rasterise(context, encoder, shader::WRITE_POLYGONS, clock);
            }
            Pass::PlacePolygons { pixels } => (shader::PLACE_POLYGONS, pixels),
            Pass::SortPolygons { pixels } => (shader::SORT_POLYGONS, pixels),
            _ => return,
        };
        let pipeline = self.pipelines.compute(context, &Program::plain(shader));
        let entries: Vec<_> = buffers(0, [&polygons.words.buffer, &polygons.sums]).collect();
        let groups = groups_of(pixels, POLYGON_THREADS);
        dispatch(context, encoder, shader.name, &pipeline, &entries, groups, clock);
    }
}
