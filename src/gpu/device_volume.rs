//! A volume and its classification on the device.

use std::sync::Arc;

use super::samples::DeviceSamples;
use crate::volume::ScalarVolume;

/// A volume and its classification on the device.
#[derive(Debug)]
pub(super) struct DeviceVolume {
    pub(super) source: Arc<ScalarVolume>,
    pub(super) samples: DeviceSamples,
    pub(super) table: Option<DeviceTable>,
}

#[derive(Debug)]
pub(super) struct DeviceTable {
    pub(super) entries: wgpu::Buffer,
    pub(super) visible: wgpu::Buffer,
    /// The same here: a bit for each brick.
    pub(super) visible_bits: Vec<u32>,
    /// First and last brick along x, y, z that can show; the first beyond the last where none can.
    pub(super) showing: [[usize; 3]; 2],
    /// `Traversal::table`: span, entries per unit, last entry.
    pub(super) span: [f32; 4],
    /// The entry of samples without data; 0 where they are left out.
    pub(super) no_data: u32,
}
