//! Pictures of meshes of triangles.

use super::Renderer;
use crate::gpu::GpuError;
use crate::gpu::meshes::MeshTable;
use crate::kernel::Kernel;
use crate::scene::{OpacityModel, SplatSettings, View};

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
