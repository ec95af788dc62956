//! The kernels there are.

use serde::{Deserialize, Serialize};

use super::RadialKernel;
use crate::core::names;

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
}

names!(
    /// The cheapest first.
    Kernel[7] {
        Point => "point",
        Nearest => "nearest",
        Linear => "linear",
        Gouraud => "gouraud",
        Gaussian => "gaussian",
        Cubic => "cubic",
        BSpline => "bspline",
    }
);

impl Kernel {
    /// The splat radius in voxels at which the kernel is as published; `None` where extent does
    /// not apply.
    pub fn natural_extent(self) -> Option<f64> {
        match self {
            Self::Point | Self::Nearest | Self::Linear | Self::BSpline => None,
            Self::Gaussian => Some(2.0),
            Self::Cubic | Self::Gouraud => Some(1.556),
        }
    }

    /// How far it reaches along an axis, voxels, at a splat radius of `extent`; of a point and a box
    /// half a voxel.
    pub fn reach(self, extent: Option<f64>) -> f64 {
        match self {
            Self::Point | Self::Nearest => 0.5,
            Self::Linear => 1.0,
            Self::BSpline => 2.0,
            Self::Gaussian | Self::Cubic | Self::Gouraud => {
                RadialKernel::new(self, extent).map_or(1.0, RadialKernel::radius)
            }
        }
    }

    /// Whether it is a product of one-dimensional kernels along the lattice's axes.
    pub fn is_separable(self) -> bool {
        matches!(self, Self::Linear | Self::BSpline)
    }

    /// The kernel that footprints stand in with where this one has none: the optimal cubic for the
    /// separable ones, which project to no ellipse.
    pub fn splatted(self) -> Self {
        if self.is_separable() { Self::Cubic } else { self }
    }
}
