//! The corners of a splat's mesh, on the device from the first time that meshes are drawn.

use super::context::Context;
use super::layout::Corner;
use super::renderer::Renderer;
use super::{GpuError, buffers::Growing};
use crate::kernel::{Kernel, RadialKernel, SplatMesh, Subdivisions};
use crate::scene::{OpacityModel, SplatSettings, View};

/// One mesh, which every kernel is drawn with.
#[derive(Debug)]
pub(super) struct MeshTable {
    subdivisions: Subdivisions,
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

impl Renderer {
    /// [`Renderer::begin`] for meshes of triangles in place of footprints ([`Kernel::Gouraud`]), of
    /// the settings' subdivisions, extent and opacity model.
    ///
    /// # Errors
    /// As there.
    pub fn begin_meshes(
        &mut self,
        view: &View,
        splat: &SplatSettings,
        unit_distance: f64,
    ) -> Result<(), GpuError> {
        if self.mesh.as_ref().is_none_or(|mesh| mesh.subdivisions != splat.gouraud) {
            self.mesh = MeshTable::new(&self.context, splat.gouraud);
        }
        self.begin(view, Kernel::Gouraud, splat.extent, unit_distance)?;
        self.variant.published = splat.opacity_model == OpacityModel::Published;
        self.note_bytes();
        Ok(())
    }

    /// Vertices of a splat, or of a mesh the indices.
    pub(super) fn corner_count(&self) -> u32 {
        match (&self.mesh, self.variant.kernel) {
            (Some(mesh), Kernel::Gouraud) => mesh.index_count,
            _ => self.variant.vertices(),
        }
    }
}
