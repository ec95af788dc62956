//! The kernels there are.

use serde::{Deserialize, Serialize};

/// A radial (or box) reconstruction kernel, in units of one voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kernel {
    /// One pixel a voxel (Westover's "single point").
    Point,
    /// The voxel's box, its chord taken exactly.
    Nearest,
    /// A Gaussian of σ 0.6, cut at 0.004 (Westover).
    Gaussian,
    /// The optimal piecewise cubic of radius 1.556 (Crawfis–Max).
    Cubic,
}

impl Kernel {
    /// Every kernel, cheapest first.
    pub const ALL: [Self; 4] = [Self::Point, Self::Nearest, Self::Gaussian, Self::Cubic];

    /// The name scripts use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Nearest => "nearest",
            Self::Gaussian => "gaussian",
            Self::Cubic => "cubic",
        }
    }

    /// The kernel of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kernel| kernel.name() == name)
    }

    /// The splat radius in voxels at which the kernel is as published; `None` where extent does
    /// not apply.
    pub fn natural_extent(self) -> Option<f64> {
        match self {
            Self::Point | Self::Nearest => None,
            Self::Gaussian => Some(2.0),
            Self::Cubic => Some(1.556),
        }
    }
}
