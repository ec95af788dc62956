//! Grids without lists: the pictures of [`Gathering`](crate::gpu::gather::Gathering).

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::buffers::read_words;
use crate::gpu::clock::Timestamps;
use crate::gpu::compute::{buffer, buffers, dispatch, rows_of, view as picture_at};
use crate::gpu::frame::Pass;
use crate::gpu::gather::constants::Constants;
use crate::gpu::gather::{Layering, Variant, tile_count};
use crate::gpu::layout::{self};
use crate::gpu::rays;
use crate::gpu::shade::Shade;
use crate::gpu::shader::Among;
use crate::gpu::vectors::DeviceVectors;
use crate::scene::{SplatSettings, View};
use std::ops::Range;

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
        self.write_traversal(view, &(0..0), 0);
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
        let shade =
            shade.map(|shade| shade.constants(values, (0, None), view.pixels_per_unit, growth));
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
