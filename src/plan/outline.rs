//! What a plan holds, in a few words and numbers for statistics.

use serde::Serialize;

use super::Plan;

/// A plan at a glance.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Outline {
    /// How it comes to be a picture.
    pub way: &'static str,
    /// Names of the fields.
    pub fields: Vec<String>,
    /// Names of the kernel lists.
    pub kernels: Vec<String>,
    /// What surfaces there are, a name each.
    pub surfaces: Vec<String>,
    /// World distance between slab faces along the view; `null` without slabs.
    pub slab_thickness: Option<f64>,
    /// What the scene asks for and the picture has no place for: why, a sentence each.
    pub left_out: Vec<String>,
}

impl Plan {
    /// What it holds.
    pub fn outline(&self) -> Outline {
        let inside = &self.inside;
        let several = |count: usize, name: &str| (0..count).map(|_| name.to_owned()).collect();
        let mut surfaces: Vec<String> = several(inside.isosurfaces.len(), "isosurface");
        surfaces.extend::<Vec<_>>(several(inside.slices.len(), "slice"));
        surfaces.extend(self.surfaces.iter().map(|surface| surface.name().to_owned()));
        let has_slabs = self.mode.visibility == crate::scene::Visibility::Slabs;
        Outline {
            way: self.way.name(),
            fields: self.fields.iter().map(|field| field.volume.name.clone()).collect(),
            kernels: self.kernels.iter().map(|list| list.field.name.clone()).collect(),
            surfaces,
            slab_thickness: has_slabs
                .then(|| self.frame.lattice.smallest_spacing() / self.mode.slabs_per_voxel),
            left_out: self.left_out.iter().map(ToString::to_string).collect(),
        }
    }
}
