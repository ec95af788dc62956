//! One basis function.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// What functions look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// exp(−r²/2σ²), as wide in every direction (Jang, section 4).
    Gaussian,
    /// The same by |S (x − c)|, as wide as it has to be in each direction.
    #[default]
    Ellipsoid,
    /// 1/√(1 + r²/σ²), as wide in every direction (Jang, section 6).
    Multiquadric,
}

impl Basis {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Gaussian, Self::Ellipsoid, Self::Multiquadric];

    /// The word that scripts and files use.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Ellipsoid => "ellipsoid",
            Self::Multiquadric => "multiquadric",
        }
    }

    /// The one that a word means.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|basis| basis.name() == name)
    }

    /// φ of the squared distance from the centre, in widths.
    pub fn of_square(self, square: f64) -> f64 {
        match self {
            Self::Gaussian | Self::Ellipsoid => (-0.5 * square).exp(),
            Self::Multiquadric => (1.0 + square).sqrt().recip(),
        }
    }

    /// Its derivative by that square.
    pub(super) fn slope(self, square: f64) -> f64 {
        let phi = self.of_square(square);
        match self {
            Self::Gaussian | Self::Ellipsoid => -0.5 * phi,
            Self::Multiquadric => -0.5 * phi.powi(3),
        }
    }

    /// The squared distance, in widths, beyond which a function of this weight is below ε; none at all where it never
    /// is more. Of Gaussians 2 ln(|w|/ε) (Jang, section 5).
    pub fn reach_square(self, weight: f64, epsilon: f64) -> Option<f64> {
        let ratio = weight.abs() / epsilon;
        if ratio.is_nan() || ratio <= 1.0 {
            return None;
        }
        Some(match self {
            Self::Gaussian | Self::Ellipsoid => 2.0 * ratio.ln(),
            Self::Multiquadric => ratio * ratio - 1.0,
        })
    }
}

/// A weighted basis function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Function {
    /// Where it is greatest, world.
    pub centre: DVec3,
    /// From a world offset to one in widths; upper triangular, of one width 1/σ times the identity.
    pub shape: DMat3,
    /// What it is at its centre.
    pub weight: f64,
}

impl Function {
    /// The squared distance of a place, in widths.
    pub fn square(&self, at: DVec3) -> f64 {
        (self.shape * (at - self.centre)).length_squared()
    }

    /// Half the sides of the box about all places of a squared distance, world: of |S d| ≤ r it is r times the lengths of
    /// the rows of S⁻¹.
    pub fn half_box(&self, square: f64) -> DVec3 {
        let inverse = self.shape.inverse();
        let rows = inverse.transpose();
        DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()) * square.sqrt()
    }
}
