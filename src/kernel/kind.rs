//! The kernels there are.

use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{MOST_EXTENT, MOST_TENT_EXTENT, RadialKernel, Separable};
use crate::core::names;
use crate::core::progress::{Cancelled, Ticket};
use crate::rbf::Encoding;
use crate::volume::ScalarVolume;

/// The least splat radius, voxels, of kernels that are products. At half the distance between samples the last digit would
/// decide which of two counts half-way between them.
const LEAST_SEPARABLE_EXTENT: f64 = 0.6;

/// A reconstruction kernel, in units of one voxel: radial, a box, or on lattices separable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kernel {
    /// One pixel a voxel (Westover's "single point").
    Point,
    /// The voxel's box, its chord taken exactly.
    Nearest,
    /// A Gaussian of σ 0.6, cut at 0.004 (Westover).
    Gaussian,
    /// The optimal cubic's footprint as a mesh of triangles, their opacities linear between the corners
    /// (Laur–Hanrahan's polygon splats; see [`super::SplatMesh`]). Shaded first, every sample.
    ///
    /// Theirs stood for a Gaussian-like footprint. Both are approximated about equally well, but the
    /// cubic is nearer to the exact picture: RMSE 0.022, 0.0052 and 0.048 against 0.031, 0.0084 and
    /// 0.054 (demo head 64³, blobs 32³ and Marschner–Lobb 40³, 8 × 4), on three fifths of the area.
    Gouraud,
    /// The separable tent: trilinear interpolation (Westover §2.7.3). On lattices only.
    Linear,
    /// The optimal piecewise cubic of radius 1.556 (Crawfis–Max).
    Cubic,
    /// The separable cubic B-spline. On lattices only.
    #[serde(rename = "bspline")]
    BSpline,
    /// No kernel of the samples: the basis functions of an encoding themselves, wherever they lie (Jang). Of volumes
    /// that have some.
    Functions,
    /// No kernel of the samples: the cells of an unstructured or curvilinear grid themselves, by their shape functions. Of
    /// volumes that are sampled from some.
    Cells,
    /// No kernel of the samples: the mean of ellipsoids about scattered points, or the points of cells, each as wide as its
    /// neighbours lie apart. Of volumes that have such points.
    Ellipsoids,
}

names!(
    /// The cheapest first.
    Kernel[10] {
        Point => "point",
        Nearest => "nearest",
        Linear => "linear",
        Gouraud => "gouraud",
        Gaussian => "gaussian",
        Cubic => "cubic",
        BSpline => "bspline",
        Functions => "functions",
        Cells => "cells",
        Ellipsoids => "ellipsoids",
    }
);

impl Kernel {
    /// The splat radius in voxels at which the kernel is as published; `None` where extent does
    /// not apply.
    pub fn natural_extent(self) -> Option<f64> {
        match self {
            Self::Point | Self::Nearest | Self::Functions | Self::Cells | Self::Ellipsoids => None,
            Self::Linear => Some(1.0),
            Self::Gaussian | Self::BSpline => Some(2.0),
            Self::Cubic | Self::Gouraud => Some(1.556),
        }
    }

    /// The splat radii, voxels, that it is drawn with where it has one. Products of narrower kernels would leave
    /// gaps; tents of a wider one have more than four samples an axis in reach.
    pub fn extents(self) -> RangeInclusive<f64> {
        match self {
            Self::Linear => LEAST_SEPARABLE_EXTENT..=MOST_TENT_EXTENT,
            Self::BSpline => LEAST_SEPARABLE_EXTENT..=MOST_EXTENT,
            _ => f64::MIN_POSITIVE..=f64::MAX,
        }
    }

    /// s = E/E₀: how much wider than natural it is at a splat radius of `extent`; 1 where extent does
    /// not apply.
    pub fn scale(self, extent: Option<f64>) -> f64 {
        match (extent, self.natural_extent()) {
            (Some(extent), Some(natural)) => extent / natural,
            _ => 1.0,
        }
    }

    /// How much wider than natural the kernels are by which engines weigh its coefficients at a splat radius of
    /// `extent`: wide B-splines are brought back to natural ones (see `kernel::coefficients`).
    pub fn stretch(self, extent: Option<f64>) -> f64 {
        let scale = self.scale(extent);
        if self == Self::BSpline { scale.min(1.0) } else { scale }
    }

    /// Samples to either side of a place, along each axis, that engines weigh there.
    pub fn window(self, extent: Option<f64>) -> usize {
        match self {
            Self::Point | Self::Nearest | Self::Functions | Self::Cells | Self::Ellipsoids => 1,
            Self::Linear if self.stretch(extent) == 1.0 => 1,
            Self::Linear | Self::BSpline => 2,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=16")]
            Self::Gaussian | Self::Cubic | Self::Gouraud => RadialKernel::new(self, extent)
                .map_or(2.0, |radial| radial.radius().ceil().clamp(1.0, 16.0))
                as usize,
        }
    }

    /// How far it reaches along an axis, voxels, at a splat radius of `extent`; of a point and a box
    /// half a voxel, and of what is no kernel of the samples a whole one.
    pub fn reach(self, extent: Option<f64>) -> f64 {
        match self {
            Self::Point | Self::Nearest => 0.5,
            Self::Functions | Self::Cells | Self::Ellipsoids => 1.0,
            Self::Linear | Self::BSpline => {
                Separable::new(self, extent).map_or(1.0, Separable::radius)
            }
            Self::Gaussian | Self::Cubic | Self::Gouraud => {
                RadialKernel::new(self, extent).map_or(1.0, RadialKernel::radius)
            }
        }
    }

    /// Whether it is a product of one-dimensional kernels along the lattice's axes.
    pub fn is_separable(self) -> bool {
        matches!(self, Self::Linear | Self::BSpline)
    }

    /// Whether it weighs samples: basis functions, cells and points are drawn themselves.
    pub fn is_of_samples(self) -> bool {
        !matches!(self, Self::Functions | Self::Cells | Self::Ellipsoids)
    }

    /// The functions of a volume that it draws: of an encoding, or the ellipsoids about points. Others draw none.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn functions_of(
        self,
        volume: &ScalarVolume,
        ticket: &Ticket,
    ) -> Result<Option<Arc<Encoding>>, Cancelled> {
        match (self, &volume.functions, &volume.scattered) {
            (Self::Functions, Some(functions), _) => Ok(Some(Arc::clone(functions))),
            (Self::Ellipsoids, _, Some(scattered)) => scattered.ellipsoids(ticket).map(Some),
            _ => Ok(None),
        }
    }

    /// Whether it has a footprint of its own: the separable ones project to no ellipse, and what is not of samples has none.
    fn has_footprint(self) -> bool {
        !self.is_separable() && self.is_of_samples()
    }

    /// The kernel that footprints stand in with where this one has none: the optimal cubic.
    pub fn splatted(self) -> Self {
        if self.has_footprint() { self } else { Self::Cubic }
    }

    /// The splat radius at which [`Kernel::splatted`] is as much wider than natural as this is at `extent`.
    pub fn splatted_extent(self, extent: Option<f64>) -> Option<f64> {
        if self.has_footprint() {
            return extent;
        }
        extent.and(self.splatted().natural_extent()).map(|natural| natural * self.scale(extent))
    }
}
