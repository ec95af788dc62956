//! Encodes one pass.

use super::clock::Timestamps;
use super::context::Context;

/// Workgroups across and down for `threads`, `size` to a workgroup ([`rows_of`]).
pub(super) fn groups_of(threads: u32, size: u32) -> [u32; 3] {
    rows_of(threads.div_ceil(size))
}

/// So many workgroups, one at least: more than 65535 along one axis are not allowed, so they stand in rows of 2^15.
pub(super) fn rows_of(groups: u32) -> [u32; 3] {
    let groups = groups.max(1);
    let across = groups.min(1 << 15);
    [across, groups.div_ceil(across), 1]
}

/// A buffer by the number that its shader knows it by.
pub(super) fn buffer(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}

/// Buffers whose numbers follow one another.
pub(super) fn buffers<'a>(
    first: u32,
    of: impl IntoIterator<Item = &'a wgpu::Buffer>,
) -> impl Iterator<Item = wgpu::BindGroupEntry<'a>> {
    (first..).zip(of).map(|(binding, of)| buffer(binding, of))
}

/// A picture by the number that its shader knows it by.
pub(super) fn view(binding: u32, view: &wgpu::TextureView) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) }
}

/// What a pass is bound to: all in one group.
pub(super) fn bind_group(
    context: &Context,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    entries: &[wgpu::BindGroupEntry<'_>],
) -> wgpu::BindGroup {
    let label = Some(label);
    context.device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries })
}

/// Encodes a pass of so many workgroups.
pub(super) fn dispatch(
    context: &Context,
    encoder: &mut wgpu::CommandEncoder,
    label: &str,
    pipeline: &wgpu::ComputePipeline,
    entries: &[wgpu::BindGroupEntry<'_>],
    [across, down, deep]: [u32; 3],
    clock: Option<&Timestamps>,
) {
    let group = bind_group(context, label, &pipeline.get_bind_group_layout(0), entries);
    let mut compute = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: clock.map(|c| c.compute(0)),
    });
    compute.set_pipeline(pipeline);
    compute.set_bind_group(0, &group, &[]);
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
