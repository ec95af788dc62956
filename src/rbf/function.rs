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

    /// The most that ∫ φ² can be over so large a part of space, in widths, of a function that ends at a squared distance: φ is
    /// greatest in a ball about the centre.
    pub(super) fn square_integral(self, reach: f64, volume: f64) -> f64 {
        use std::f64::consts::PI;
        let end = reach.sqrt().min((volume * 0.75 / PI).cbrt());
        match self {
            // Over all space, or of no more than 1 in the ball.
            Self::Gaussian | Self::Ellipsoid => PI.powf(1.5).min(4.0 / 3.0 * PI * end.powi(3)),
            // ∫ 4π r²/(1 + r²) dr.
            Self::Multiquadric => 4.0 * PI * (end - end.atan()),
        }
    }

    /// The greatest that the first and the second derivative along any direction can be beyond a distance, all in widths.
    pub(super) fn steepest(self, nearest: f64) -> [f64; 2] {
        let square = nearest * nearest;
        match self {
            Self::Gaussian | Self::Ellipsoid => {
                let phi = self.of_square(square);
                // r φ is greatest at 1, r² φ at √2; the second derivative is no more than φ or r² φ.
                let first = if nearest < 1.0 { (-0.5_f64).exp() } else { nearest * phi };
                let second = if square < 2.0 { 2.0 * (-1.0_f64).exp() } else { square * phi };
                [first, second.max(phi)]
            }
            Self::Multiquadric => {
                let cube = self.of_square(square).powi(3);
                // r φ³ is greatest at 1/√2; the second derivative is no more than 2 φ³.
                let first = if square < 0.5 { 2.0 / 27.0_f64.sqrt() } else { nearest * cube };
                [first, 2.0 * cube]
            }
        }
    }

    /// The squared distance, in widths, beyond which a function of this weight is below ε; `None` if it is nowhere above ε.
    /// Of Gaussians 2 ln(|w|/ε) (Jang, section 5).
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
    /// S, which takes a world offset to one in widths. It is upper triangular; of a function as wide in every direction it is
    /// 1/σ times the identity.
    pub shape: DMat3,
    /// What it is at its centre.
    pub weight: f64,
}

impl Function {
    /// About a centre, where `shape` takes an offset to one in widths, turned anyhow.
    pub fn about(centre: DVec3, shape: DMat3, weight: f64) -> Self {
        Self { centre, shape: triangular(shape), weight }
    }

    /// The geometric mean of its widths, world.
    pub(super) fn width(&self) -> f64 {
        self.shape.determinant().abs().cbrt().recip()
    }

    /// The squared distance of a place, in widths.
    pub fn square(&self, at: DVec3) -> f64 {
        (self.shape * (at - self.centre)).length_squared()
    }

    /// The same function of places in another space, which `axes` and an origin take to its own. Lengths in widths stay.
    #[must_use]
    pub fn seen_from(&self, axes: DMat3, origin: DVec3) -> Self {
        let centre = axes.inverse() * (self.centre - origin);
        Self::about(centre, self.shape * axes, self.weight)
    }

    /// Half the sides of the box about all places within a squared distance, world. For |S d| ≤ r these are r times the lengths
    /// of the rows of S⁻¹.
    pub fn half_box(&self, square: f64) -> DVec3 {
        let inverse = self.shape.inverse();
        let rows = inverse.transpose();
        DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()) * square.sqrt()
    }
}

/// The upper triangular matrix with which vectors come to the same lengths (Gram and Schmidt's).
fn triangular(shape: DMat3) -> DMat3 {
    let [a, b, c] = [shape.x_axis, shape.y_axis, shape.z_axis];
    let x = a.normalize_or_zero();
    let (xy, xz) = (x.dot(b), x.dot(c));
    let b = b - x * xy;
    let y = b.normalize_or_zero();
    let yz = y.dot(c);
    let c = c - x * xz - y * yz;
    DMat3::from_cols(
        DVec3::new(a.length(), 0.0, 0.0),
        DVec3::new(xy, b.length(), 0.0),
        DVec3::new(xz, yz, c.length()),
    )
}
