//! A volume and its classification come to the device.

use super::Renderer;
use crate::core::Ticket;
use crate::gpu::GpuError;
use crate::gpu::buffers::Growing;
use crate::gpu::device_volume::{DeviceTable, DeviceVolume};
use crate::gpu::layout::narrow;
use crate::gpu::samples::DeviceSamples;
use crate::gpu::slabs::SlabPass;
use crate::transfer::Table;
use crate::volume::ScalarVolume;
use std::sync::Arc;

impl Renderer {
    /// Uploads a volume unless it is there already.
    ///
    /// # Errors
    /// Too large, cancelled, or a failing device.
    pub fn set_volume(
        &mut self,
        volume: &Arc<ScalarVolume>,
        ticket: &Ticket,
    ) -> Result<(), GpuError> {
        if self.volume.as_ref().is_some_and(|held| Arc::ptr_eq(&held.source, volume)) {
            return Ok(());
        }
        // The old one goes first: two need not fit.
        self.volume = None;
        drop(self.levels.take_if(|levels| !levels.are_of(volume)));
        self.shaded.clear();
        self.slabs.iter_mut().for_each(SlabPass::clear);
        if volume.lattice.dims.iter().any(|&n| n > 0xffff) {
            return Err(GpuError::TooLarge {
                what: "an axis",
                limit: "65535 voxels".to_owned(),
                found: format!("{:?}", volume.lattice.dims),
                advice: "open a subsampled copy",
            });
        }
        let samples = DeviceSamples::upload(&self.context, volume, ticket)?;
        self.volume = Some(DeviceVolume { source: Arc::clone(volume), samples, table: None });
        self.upload_count += 1;
        self.note_bytes();
        Ok(())
    }

    /// Sets the classification of the volume that was set last.
    ///
    /// # Errors
    /// A failing device.
    pub fn set_table(&mut self, table: &Table) -> Result<(), GpuError> {
        self.shaded.clear();
        let Some(volume) = &mut self.volume else {
            return Err(GpuError::Device("a table came before its volume".to_owned()));
        };
        let storage = |label, bytes: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer = Growing::make(&self.context, label, usage, bytes.len() as u64);
            self.context.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let held = &volume.source.bricks;
        let (ranges, bricks) = (&held.ranges, held.dims);
        let mut visible = vec![0_u32; ranges.len().div_ceil(32)];
        let mut showing = [[usize::MAX; 3], [0; 3]];
        for (index, &range) in ranges.iter().enumerate() {
            let shows = table.shows(range, held.has_holes(index));
            visible[index / 32] |= u32::from(shows) << (index % 32);
            if shows {
                let at = [
                    index % bricks[0],
                    index / bricks[0] % bricks[1],
                    index / bricks[0] / bricks[1],
                ];
                for axis in 0..3 {
                    showing[0][axis] = showing[0][axis].min(at[axis]);
                    showing[1][axis] = showing[1][axis].max(at[axis]);
                }
            }
        }
        let last = table.entries.len() - 1;
        let coordinate = table.coordinate;
        let samples = &volume.samples;
        let span = [
            samples.stored(coordinate.offset),
            samples.stored(coordinate.offset + last as f64 / coordinate.scale),
            narrow(coordinate.scale / samples.unit),
            narrow(last as f64),
        ];
        let mut entries = bytemuck::cast_slice(&table.entries).to_vec();
        let has_holes = volume.source.statistics.nan_count > 0;
        let mut no_data = 0;
        if has_holes && table.no_data[3] > 0.0 {
            no_data = table.entries.len() as u32;
            entries.extend_from_slice(bytemuck::bytes_of(&table.no_data));
        }
        volume.table = Some(DeviceTable {
            entries: storage("table", &entries),
            visible: storage("visible bricks", bytemuck::cast_slice(&visible)),
            visible_bits: visible,
            showing,
            span,
            no_data,
        });
        self.note_bytes();
        self.context.check()
    }
}
