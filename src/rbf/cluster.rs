//! Clusters of points, split along their principal axis (Jang, section 4; Co and others 2003).

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, SymmetricEigen};

use super::points::Points;
use crate::core::parallel;
use crate::core::progress::{Cancelled, Ticket};

/// Points that lie together, and their residuals by the roots of how much they count.
#[derive(Debug, Clone)]
pub(super) struct Cluster {
    pub(super) points: Vec<u32>,
    /// Sum of squared residuals.
    pub(super) energy: f64,
    /// The greatest residual by its size, and whose it is.
    pub(super) worst: (f64, u32),
}

/// Where residuals of one sign lie, and how they spread.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    pub(super) mean: DVec3,
    /// Variances and covariances, world.
    pub(super) covariance: DMat3,
}

impl Cluster {
    pub(super) fn of(points: Vec<u32>, residual: &[f64]) -> Self {
        let mut cluster = Self { points, energy: 0.0, worst: (0.0, 0) };
        cluster.measure(residual);
        cluster
    }

    pub(super) fn measure(&mut self, residual: &[f64]) {
        (self.energy, self.worst) = (0.0, (0.0, self.points.first().copied().unwrap_or_default()));
        for &point in &self.points {
            let value = residual[point as usize];
            self.energy += value * value;
            if value.abs() > self.worst.0.abs() {
                self.worst = (value, point);
            }
        }
    }

    /// Mean and covariance of the points whose residual has the sign of the worst one, weighted by its square, as often as each
    /// counts. The mean is the value-weighted one of the paper.
    pub(super) fn spread(&self, points: &Points, residual: &[f64]) -> Spread {
        let origin = points.positions()[self.worst.1 as usize];
        let (mut sum, mut mean, mut square) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for &point in &self.points {
            let value = residual[point as usize];
            if value * self.worst.0 > 0.0 {
                let weight = (value / self.worst.0).powi(2);
                let offset = points.positions()[point as usize] - origin;
                sum += weight;
                mean += offset * weight;
                square += DMat3::from_cols(offset * offset.x, offset * offset.y, offset * offset.z)
                    * weight;
            }
        }
        if sum <= 0.0 {
            return Spread { mean: origin, covariance: DMat3::ZERO };
        }
        mean /= sum;
        let outer = DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z);
        Spread { mean: origin + mean, covariance: square * sum.recip() - outer }
    }

    /// Splits a cluster by the plane through its middle, across the axis along which it is longest.
    ///
    /// # Errors
    /// The cluster itself, if all of its points lie at one place.
    pub(super) fn split(self, points: &Points, residual: &[f64]) -> Result<[Self; 2], Self> {
        let count = self.points.len() as f64;
        let at = |point: &u32| points.positions()[*point as usize];
        let Some(first) = self.points.first().map(at) else { return Err(self) };
        let mean = self.points.iter().map(|p| at(p) - first).sum::<DVec3>() / count + first;
        let covariance = self.points.iter().fold(DMat3::ZERO, |sum, point| {
            let offset = at(point) - mean;
            sum + DMat3::from_cols(offset * offset.x, offset * offset.y, offset * offset.z)
        });
        let (_, axes) = principal(covariance * count.recip());
        let axis = axes.z_axis;
        let (below, above): (Vec<u32>, Vec<u32>) =
            self.points.iter().partition(|point| (at(point) - mean).dot(axis) < 0.0);
        if below.is_empty() || above.is_empty() {
            return Err(self);
        }
        Ok([Self::of(below, residual), Self::of(above, residual)])
    }
}

/// So many clusters, fewer only where the samples of each lie at one place. Those with the most squared error are split first.
pub(super) fn split_into(
    count: usize,
    all: Cluster,
    (points, residual): (&Points, &[f64]),
    ticket: &Ticket,
) -> Result<Vec<Cluster>, Cancelled> {
    // Those that cannot be split are put aside: others still can.
    let (mut whole, mut clusters) = (Vec::new(), vec![all]);
    while whole.len() + clusters.len() < count && !clusters.is_empty() {
        if ticket.is_cancelled() {
            return Err(Cancelled);
        }
        // Half of them at a time, so that no long list is sorted for each.
        let missing = count - whole.len() - clusters.len();
        let wanted = missing.min(clusters.len().div_ceil(2));
        clusters.sort_by(|a, b| b.energy.total_cmp(&a.energy));
        let others = clusters.split_off(wanted);
        let chosen = std::mem::replace(&mut clusters, others);
        let mut parts = Vec::new();
        parts.resize_with(chosen.len(), || None);
        parallel::each(chosen.into_iter().zip(&mut parts), |(cluster, part)| {
            *part = Some(cluster.split(points, residual));
        });
        for part in parts.into_iter().flatten() {
            match part {
                Ok(halves) => clusters.extend(halves),
                Err(one) => whole.push(one),
            }
        }
    }
    clusters.append(&mut whole);
    Ok(clusters)
}

/// Variances along the principal axes, least first, and these as columns.
pub(super) fn principal(covariance: DMat3) -> (DVec3, DMat3) {
    let matrix = Matrix3::from_column_slice(&covariance.to_cols_array());
    if !matrix.iter().all(|v| v.is_finite()) {
        return (DVec3::ZERO, DMat3::IDENTITY);
    }
    let eigen = SymmetricEigen::new(matrix);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let axis = |i: usize| DVec3::from_slice(eigen.eigenvectors.column(order[i]).as_slice());
    let values = order.map(|i| eigen.eigenvalues[i].max(0.0));
    (DVec3::from(values), DMat3::from_cols(axis(0), axis(1), axis(2)))
}
