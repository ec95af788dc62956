//! Polygons come to the device, and the lists of what each pixel sees of them are made.

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::buffers::{Growing, read_words};
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffers, dispatch, groups_of};
use crate::gpu::context::{POLYGON_BUFFERS, VECTOR_AND_POLYGON_BUFFERS};
use crate::gpu::frame::Pass;
use crate::gpu::layout::{FRAGMENT_WORDS, POLYGON_THREADS};
use crate::gpu::pipelines::Program;
use crate::gpu::polygons::{DevicePolygons, MadeOf, samples};
use crate::gpu::shader::{self};
use crate::plan::Plan;
use crate::scene::{OpacityModel, View};

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
