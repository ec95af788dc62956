//! Vector splats come to the device, with the lists of where they lie, and are composited alone.

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffer, dispatch, rows_of, view as picture_at};
use crate::gpu::frame::Pass;
use crate::gpu::inside::in_view;
use crate::gpu::layout::{self, TILE, narrow};
use crate::gpu::list_plan::{MOST_LAYER_BITS, Plan, Rectangle};
use crate::gpu::pipelines::{ListVariant, Program, flag, vector_constants};
use crate::gpu::scattered::{ListTotals, Lists, ListsOf};
use crate::gpu::shader::{self, Among};
use crate::gpu::vectors::frame::VectorFrame;
use crate::gpu::vectors::{
    DeviceVectors, MOST_VECTOR_ENTRIES, MadeOf, VectorLook, VectorSplats, designs_of,
};
use crate::kernel::Kernel;
use crate::plan::Plan as FramePlan;
use crate::scene::{OpacityModel, Order, SplatSettings, View};
use std::ops::Range;
use std::sync::Arc;

impl Renderer {
    /// Brings splats and their marks to the device, where they are not there yet.
    ///
    /// # Errors
    /// Too many of them, or an adapter that binds too few buffers.
    pub fn set_vectors(&mut self, looks: &[VectorLook<'_>]) -> Result<(), GpuError> {
        let offered = self.context.limits.max_storage_buffers_per_shader_stage;
        if offered < crate::gpu::context::VECTOR_BUFFERS {
            return Err(GpuError::TooLarge {
                what: "buffers of vectors and a field in one pass",
                limit: format!("{offered} buffers"),
                found: crate::gpu::context::VECTOR_BUFFERS.to_string(),
                advice: "choose another --adapter",
            });
        }
        let is_there = self.vectors.as_ref().is_some_and(|held| {
            let both = held.splats.iter().zip(looks);
            held.splats.len() == looks.len()
                && both.into_iter().all(|(held, look)| Arc::ptr_eq(held, look.splats))
                && held.designs == designs_of(looks)
        });
        if !is_there {
            self.vectors = None;
            self.vectors = Some(DeviceVectors::new(&self.context, looks)?);
            self.upload_count += 1;
            self.note_bytes();
        }
        self.context.check()
    }

    /// Lets go of vectors that are not drawn any more.
    pub fn clear_vectors(&mut self) {
        self.vectors = None;
    }

    /// Makes the lists of some rows of tiles, or as many of the first of them as fit; returns these.
    ///
    /// # Errors
    /// More layers or splats over a tile than can be told apart, or a failing device.
    pub fn make_vector_lists(
        &mut self,
        view: &View,
        what: &VectorSplats<'_>,
        mut rows: Range<u32>,
    ) -> Result<Range<u32>, GpuError> {
        let published = what.splat.opacity_model == OpacityModel::Published;
        let made_of = |rows: &Range<u32>| MadeOf {
            view: *view,
            looks: what
                .looks
                .iter()
                .map(|l| (l.settings.mode, l.settings.foreshortening))
                .collect(),
            slab: what.slab,
            published,
            order: what.splat.order,
            rows: rows.clone(),
        };
        let are_there = matches!(&self.lists, Some(lists) if lists.of == ListsOf::Vectors);
        if let Some(vectors) = self.vectors.as_mut() {
            match &vectors.made {
                // Those of the first rows, if they were not enough for all.
                Some(made)
                    if are_there
                        && made.rows.start == rows.start
                        && made.rows.end <= rows.end
                        && *made == made_of(&made.rows) =>
                {
                    let made = made.rows.clone();
                    self.write_vectors(what);
                    return Ok(made);
                }
                _ => vectors.made = None,
            }
        }
        let Some(vectors) = &self.vectors else { return Ok(rows) };
        let record_vec4s = vectors.record_vec4s;
        let total: usize = vectors.splats.iter().map(|splats| splats.list.len()).sum();
        let too_many = |most: u64, found: u64| GpuError::TooManyVectors { most, found };
        let Some(frame) = VectorFrame::new(view, what) else { return Ok(rows) };
        let layers = frame
            .layers(what.slab)
            .ok_or_else(|| too_many(1 << MOST_LAYER_BITS, frame.layer_count(what.slab)))?;
        #[expect(clippy::cast_possible_truncation, reason = "bound by what one buffer holds")]
        let count = total as u32;
        let front_to_back = what.splat.order == Order::FrontToBack;
        let lists = self.lists.get_or_insert_with(|| Lists::new(&self.context));
        lists.reserve(&self.context, u64::from(count))?;
        lists.of = ListsOf::Vectors;
        lists.variant = ListVariant {
            kernel: Kernel::Cubic,
            perspective: view.eye_distance.is_some(),
            slabs: true,
            front_to_back,
            published,
        };
        let constants = frame.constants();
        self.context.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&constants));
        let columns = view.size[0].div_ceil(TILE);
        let vectors = self.vectors.as_mut().ok_or(GpuError::Cancelled)?;
        vectors.constants = frame.vectors(view, what, record_vec4s, layers, columns);
        vectors.constants.blur = vectors.blur;
        self.write_vectors(what);
        loop {
            let plan = Plan {
                rectangle: Rectangle([0, rows.start, columns, rows.end - rows.start]),
                layers,
                count,
                stop_below: what.stop_below,
                half_size: view.size.map(|n| n as f32 / 2.0),
            };
            let room = (u32::MAX, MOST_VECTOR_ENTRIES);
            if self.make_lists(&plan, room, &mut ListTotals::default())?.is_none() {
                if rows.len() < 2 {
                    let found = u64::from(count) * u64::from(layers.count);
                    return Err(too_many(u64::from(MOST_VECTOR_ENTRIES), found));
                }
                rows.end = rows.start + (rows.end - rows.start).div_ceil(2);
                continue;
            }
            let vectors = self.vectors.as_mut().ok_or(GpuError::Cancelled)?;
            vectors.constants.layers[2] = rows.start.cast_signed();
            vectors.made = Some(made_of(&rows));
            self.write_vectors(what);
            return Ok(rows);
        }
    }

    /// What changes with the phase alone, and which rows the lists are for.
    fn write_vectors(&mut self, what: &VectorSplats<'_>) {
        let Some(vectors) = self.vectors.as_mut() else { return };
        #[expect(clippy::cast_possible_truncation, reason = "the device has 32 bits")]
        let phase = what.phase.rem_euclid(1.0) as f32;
        vectors.constants.depth[3] = phase;
        self.context.queue.write_buffer(
            &vectors.settings,
            0,
            bytemuck::bytes_of(&vectors.constants),
        );
    }

    /// Draws tiles of what there is without a field, vectors and polygons whose lists were made, and waits; returns
    /// milliseconds.
    ///
    /// # Errors
    /// A failing device.
    pub fn draw_tiles_without_field(
        &mut self,
        view: &View,
        plan: &FramePlan,
        tiles: Range<u32>,
    ) -> Result<f64, GpuError> {
        self.slab_settings = plan.mode;
        let (scale, growth) = match view.eye_distance {
            None => (1.0, 0.0),
            Some(distance) => (narrow(view.view_centre.z / distance), narrow(1.0 / distance)),
        };
        let [width, height] = view.size;
        let kept = plan.inside.clip.half_spaces(&plan.frame.lattice);
        let mut clip = [[0.0; 4]; layout::MOST_CLIPS];
        for (to, half) in clip.iter_mut().zip(&kept) {
            *to = in_view(half, view);
        }
        let constants = layout::VectorTiles {
            tiles: [tiles.start, width.div_ceil(TILE), width, height],
            more: [tiles.len() as u32, kept.len().min(layout::MOST_CLIPS) as u32, 0, 0],
            rays: [growth, scale, 0.0, 0.0],
            clip,
        };
        self.context.queue.write_buffer(&self.tiles, 0, bytemuck::bytes_of(&constants));
        let wall_ms = self.run(&[Pass::CompositeVectors { tiles: tiles.len() as u32 }])?;
        self.check_loops()?;
        Ok(wall_ms)
    }

    pub(super) fn composite_vectors(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        tiles: u32,
        clock: Option<&Timestamps>,
    ) {
        let Some(target) = &self.target else { return };
        let vectors = self.vectors.as_ref().zip(self.lists.as_ref());
        let vectors = vectors.filter(|_| self.slabs_have_vectors);
        let light = target.light.create_view(&Default::default());
        let among = Among { polygons: self.polygons.is_some(), vectors: vectors.is_some() };
        let SplatSettings { opacity_model, order, .. } = self.slab_settings;
        let mut constants = vec![
            ("published", flag(opacity_model == OpacityModel::Published)),
            ("back_to_front", flag(order == Order::BackToFront)),
        ];
        if among.vectors {
            constants.extend(vector_constants());
        }
        let shader = shader::alone(among);
        let pipeline = self.pipelines.compute(&self.context, &Program { shader, constants });
        let marks = vectors.map(|(vectors, _)| vectors.marks());
        let mut entries =
            vec![buffer(0, &self.tiles), picture_at(1, &light), buffer(8, &self.totals)];
        entries.extend(self.polygons.as_ref().map(|polygons| buffer(14, polygons.words())));
        if let (Some((vectors, lists)), Some(marks)) = (vectors, &marks) {
            entries.extend(vectors.entries(lists, marks));
        }
        dispatch(&self.context, encoder, shader.name, &pipeline, &entries, rows_of(tiles), clock);
    }
}
