//! Polygons in a scene, embedded in the volume.

use std::sync::Arc;

use crate::core::Srgb8;
use crate::polygons::Mesh;

use super::{AlongRay, Lighting, Scene};

/// What polygons look like that say nothing of it.
pub const POLYGON_COLOUR: Srgb8 = Srgb8([225, 225, 225]);

/// A mesh among what else is seen: at its place in the world, before and behind matter, vectors and other
/// polygons, lit from both sides.
#[derive(Debug, Clone)]
pub struct PolygonLayer {
    /// The triangles.
    pub mesh: Arc<Mesh>,
    /// Of all of them; `None` is the corners' own colours, and [`POLYGON_COLOUR`] where they have none.
    pub colour: Option<Srgb8>,
    /// 0..=1, of each triangle, however it is turned.
    pub opacity: f64,
    /// Whether it is drawn.
    pub is_shown: bool,
    /// Whether it is lit by the corners' normals (means of the triangles' about them where they have none),
    /// rather than each triangle by its own.
    pub is_smooth: bool,
}

/// What cannot be drawn of polygons.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonError {
    /// An opacity that is none.
    #[error("expected the opacity of a mesh from 0 to 1, found {found}")]
    Opacity {
        /// The offending number.
        found: f64,
    },
    /// A mode whose kernels are triangles themselves.
    #[error(
        "expected a mode that tiles draw with polygons, found {found}; choose --backend auto and another \
         kernel than gouraud, no wider than 8 voxels, or leave the polygons out"
    )]
    Mode {
        /// Of the mode, what only triangles draw.
        found: String,
    },
    /// A projection of values.
    #[error(
        "expected --projection composite with polygons, found {along}, which is of values and shows no \
         surfaces; leave one of the two out"
    )]
    Projected {
        /// The projection.
        along: &'static str,
    },
}

impl PolygonLayer {
    /// A mesh as it is first seen: opaque, in its own colours, smooth if it has normals.
    pub fn new(mesh: Arc<Mesh>) -> Self {
        let is_smooth = mesh.has_normals();
        Self { mesh, colour: None, opacity: 1.0, is_shown: true, is_smooth }
    }

    /// # Errors
    /// An opacity that is none.
    pub fn check(&self) -> Result<(), PolygonError> {
        match (0.0..=1.0).contains(&self.opacity) {
            true => Ok(()),
            false => Err(PolygonError::Opacity { found: self.opacity }),
        }
    }
}

impl PartialEq for PolygonLayer {
    /// The same mesh, not an equal one.
    fn eq(&self, other: &Self) -> bool {
        let Self { mesh, colour, opacity, is_shown, is_smooth } = self;
        Arc::ptr_eq(mesh, &other.mesh)
            && *colour == other.colour
            && *opacity == other.opacity
            && *is_shown == other.is_shown
            && *is_smooth == other.is_smooth
    }
}

impl Scene {
    /// The layers of polygons that are drawn, where its mode draws any.
    pub fn drawn_polygons(&self) -> impl Iterator<Item = &PolygonLayer> {
        let can = self.check_polygons().is_ok();
        self.polygons.iter().filter(move |layer| can && layer.is_shown && layer.opacity > 0.0)
    }

    /// Whether polygons are drawn.
    pub fn has_polygons(&self) -> bool {
        self.drawn_polygons().next().is_some()
    }

    /// What polygons are lit by: the scene's lights, or where there are none the usual ones.
    pub fn polygon_lighting(&self) -> Lighting {
        self.shading.lighting.clone().unwrap_or_default()
    }

    /// Whether its mode can draw its polygons.
    ///
    /// # Errors
    /// See [`PolygonError`]; never where it has none.
    pub fn check_polygons(&self) -> Result<(), PolygonError> {
        if self.polygons.is_empty() {
            return Ok(());
        }
        self.polygons.iter().try_for_each(PolygonLayer::check)?;
        let along = self.inside.along;
        if along != AlongRay::Composite && !self.hides_field() {
            return Err(PolygonError::Projected { along: along.name() });
        }
        match self.splat.lacks_room_for_others() {
            Some(found) if !self.hides_field() => Err(PolygonError::Mode { found }),
            _ => Ok(()),
        }
    }
}
