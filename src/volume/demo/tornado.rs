//! A standing vortex: swirl about a leaning, wandering axis, inflow along the ground, and updraught.

use glam::{DVec2, DVec3};

use super::{centred, each_of, field, index_of};
use crate::core::{Cancelled, Ticket};
use crate::volume::{Grid, Samples};

/// Circulation: swirl times radius far out.
const CIRCULATION: f64 = 0.5;

/// `condensation`, `speed`, then the three components of `velocity`.
pub(super) fn grid(size: usize, ticket: &Ticket) -> Result<Grid, Cancelled> {
    let lattice = centred(size);
    let at = |i| lattice.world_from_index(DVec3::from(index_of(lattice.dims, i).map(|j| j as f64)));
    let wind = |i| velocity(at(i)).to_array().map(|v| v as f32);
    let velocities: Vec<[f32; 3]> = each_of(lattice.len(), wind, &ticket.part(0, 2))?;
    let cloud = |i| condensation(at(i)) as f32;
    let condensation = each_of(lattice.len(), cloud, &ticket.part(1, 2))?;
    let speed = velocities.iter().map(|v| v.iter().map(|c| c * c).sum::<f32>().sqrt());
    let fields = vec![
        field("condensation", 1, Samples::Float32(condensation)),
        field("speed", 1, Samples::Float32(speed.collect())),
        field("velocity", 3, Samples::Float32(velocities.into_flattened())),
    ];
    Ok(Grid::of(lattice, fields))
}

/// Where the axis stands at a height −1..=1, and its slope.
fn axis(z: f64) -> (DVec2, DVec2) {
    let reach = 0.12 + 0.1 * z;
    let (sin, cos) = (2.2 * z).sin_cos();
    (
        DVec2::new(reach * cos, reach * sin),
        DVec2::new(0.1 * cos - 2.2 * reach * sin, 0.1 * sin + 2.2 * reach * cos),
    )
}

/// Radius of the core: narrow at the ground, wide aloft.
fn core_radius(z: f64) -> f64 {
    let height = (z + 1.0) / 2.0;
    0.05 + 0.22 * height * height
}

/// Air velocity: Burgers' vortex about the axis, carried along its slope.
fn velocity(p: DVec3) -> DVec3 {
    let (centre, slope) = axis(p.z);
    let from_axis = p.truncate() - centre;
    let r = from_axis.length();
    let core = core_radius(p.z);
    // (1 − exp(−r²/c²))/r², which tends to 1/c² at the axis.
    let swirl = if r > 1e-9 { -(-(r / core).powi(2)).exp_m1() / (r * r) } else { core.powi(-2) };
    let around = from_axis.perp() * (CIRCULATION * swirl);
    let height = (p.z + 1.0) / 2.0;
    let updraught = (0.2 + 1.3 * height) * (-(r / (1.6 * core)).powi(2)).exp();
    // Air is drawn in along the ground and spreads aloft.
    let inward = -from_axis * (0.9 * (0.6 - height) / (0.3 + r));
    (around + inward + slope * updraught).extend(updraught)
}

/// Cloud water, 0..=1: where the pressure drop of the core condenses it.
fn condensation(p: DVec3) -> f64 {
    let (centre, _) = axis(p.z);
    let r = (p.truncate() - centre).length() / core_radius(p.z);
    let height = (p.z + 1.0) / 2.0;
    let funnel = (-(r / 0.9).powi(2)).exp() * (0.35 + 0.65 * height);
    // The cloud that it hangs from.
    let ceiling = 1.0 / (1.0 + (-(p.z - 0.82) * 28.0).exp());
    let cloud = 0.5 * ceiling * (-(p.truncate().length() / 0.95).powi(4)).exp();
    (funnel + cloud).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wind_turns_left_about_the_axis_and_rises_in_it() {
        for z in [-0.9, -0.2, 0.6] {
            let (centre, slope) = axis(z);
            let step = 1.5 * core_radius(z);
            for angle in [0.0, 1.0, 2.5, 4.0] {
                let out = DVec2::from_angle(angle);
                let v = velocity((centre + out * step).extend(z));
                assert!((v.truncate() - slope * v.z).dot(out.perp()) > 0.1, "{z} {angle}: {v}");
            }
            let up = velocity(centre.extend(z));
            assert!(
                up.is_finite() && up.z > 0.2 && up.z > velocity((centre + DVec2::ONE).extend(z)).z
            );
        }
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_axis() {
        for z in [-0.8, 0.0, 0.7] {
            let numeric = (axis(z + 1e-6).0 - axis(z - 1e-6).0) / 2e-6;
            assert!((axis(z).1 - numeric).length() < 1e-7);
        }
    }

    #[test]
    fn the_speed_is_the_length_of_the_velocity() {
        let grid = grid(9, &Ticket::new()).unwrap();
        let (speed, velocity) = (&grid.fields[1].samples, &grid.fields[2].samples);
        for i in 0..speed.len() {
            let length = (0..3).map(|c| velocity.get(3 * i + c).powi(2)).sum::<f64>().sqrt();
            assert!((speed.get(i) - length).abs() < 1e-5 * (1.0 + length));
        }
    }
}
