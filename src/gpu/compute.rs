//! Encodes one pass.

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
    let layout = pipeline.get_bind_group_layout(0);
    let group = bind_group(context, pass.name(), &layout, bound.iter().cloned());
    dispatch(encoder, pass.name(), pipeline, &[group], groups, clock);
}

/// A group of bindings, numbered from 0.
pub(super) fn bind_group<'a>(
    context: &Context,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    bound: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entries = (0_u32..).zip(bound);
    let entries: Vec<_> =
        entries.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    context.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// Encodes a pass over groups of bindings, numbered from 0.
pub(super) fn dispatch(
    encoder: &mut wgpu::CommandEncoder,
    label: &str,
    pipeline: &wgpu::ComputePipeline,
    bound: &[wgpu::BindGroup],
    [across, down, deep]: [u32; 3],
    clock: Option<&Timestamps>,
) {
    let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: clock.map(|c| c.compute(0)),
    });
    compute.set_pipeline(pipeline);
    for (at, group) in (0..).zip(bound) {
        compute.set_bind_group(at, group, &[]);
    }
    compute.dispatch_workgroups(across, down, deep);
}

/// Begins a pass that draws on a view.
pub(super) fn render_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
    view: &wgpu::TextureView,
    ops: wgpu::Operations<wgpu::Color>,
    clock: Option<&Timestamps>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops,
        })],
        timestamp_writes: clock.map(|c| c.render(0)),
        ..Default::default()
    })
}
