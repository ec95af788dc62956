//! The corners of a splat's mesh, on the device from the first time that meshes are drawn.

use super::buffers::Growing;
use super::context::Context;
use super::layout::Corner;
use crate::kernel::{Kernel, RadialKernel, SplatMesh, Subdivisions};

/// One mesh, which every kernel is drawn with.
#[derive(Debug)]
pub(super) struct MeshTable {
    pub(super) subdivisions: Subdivisions,
    pub(super) corners: wgpu::Buffer,
    /// 16 bits each.
    pub(super) indices: wgpu::Buffer,
    pub(super) index_count: u32,
}

impl MeshTable {
    pub(super) fn new(context: &Context, subdivisions: Subdivisions) -> Option<Self> {
        use wgpu::BufferUsages as Usage;
        let mesh = SplatMesh::of(RadialKernel::new(Kernel::Gouraud, None)?, subdivisions);
        let corner = |v: &crate::kernel::MeshVertex| Corner {
            position: v.position.as_vec2().to_array(),
            factor: v.factor as f32,
        };
        let corners: Vec<Corner> = mesh.vertices.iter().map(corner).collect();
        let mut indices: Vec<u16> = mesh.triangles.concat();
        let index_count = u32::try_from(indices.len()).ok()?;
        // Copies are of whole words.
        indices.resize(indices.len().next_multiple_of(2), 0);
        let filled = |label, usage, bytes: &[u8]| {
            let buffer = Growing::make(context, label, usage | Usage::COPY_DST, bytes.len() as u64);
            context.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        Some(Self {
            subdivisions,
            corners: filled("corners", Usage::VERTEX, bytemuck::cast_slice(&corners)),
            indices: filled("mesh indices", Usage::INDEX, bytemuck::cast_slice(&indices)),
            index_count,
        })
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.corners.size() + self.indices.size()
    }
}
