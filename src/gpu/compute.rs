//! Encodes one compute pass.

use super::context::Context;
use super::frame::Pass;
use super::timing::Timestamps;

/// Workgroups across and down for `threads`, `size` to a workgroup: more than 65535 along one axis
/// are not allowed, so they stand in rows of 2^15.
pub(super) fn groups_of(threads: u32, size: u32) -> [u32; 3] {
    let groups = threads.div_ceil(size).max(1);
    let across = groups.min(1 << 15);
    [across, groups.div_ceil(across), 1]
}

/// Threads that a software adapter has.
pub(super) fn adapter_threads() -> u32 {
    #[expect(clippy::cast_possible_truncation, reason = "16 at most")]
    std::thread::available_parallelism().map_or(1, |n| n.get().min(16) as u32)
}

/// Workgroups across and down for a tile each, in columns: neighbouring tiles stand in different
/// rows.
///
/// A software adapter deals out its workgroups, row after row, in one equal run to each of its
/// threads, one for each processor. So every thread has tiles from all over the picture, whose middle
/// costs more than its edges: 1134 -> 959 ms for the exact picture of a scan with 2 threads.
pub(super) fn groups_of_tiles(tiles: u32) -> [u32; 2] {
    // More than 65535 along one axis are not allowed.
    let down = adapter_threads().max(tiles.div_ceil(1 << 15)).min(tiles.max(1));
    [tiles.div_ceil(down), down]
}

/// Encodes a pass over `bound`, binding by binding.
pub(super) fn compute(
    context: &Context,
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::ComputePipeline,
    pass: Pass,
    bound: &[wgpu::BindingResource<'_>],
    groups: [u32; 3],
    clock: Option<&Timestamps>,
) {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0_u32..)
        .zip(bound)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(pass.name()),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(pass.name()),
        timestamp_writes: clock.map(|c| c.compute(0)),
    });
    compute.set_pipeline(pipeline);
    compute.set_bind_group(0, &group, &[]);
    compute.dispatch_workgroups(groups[0], groups[1], groups[2]);
}
