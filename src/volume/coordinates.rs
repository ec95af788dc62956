//! Places along the axes of what lies on no lattice of its own: coordinates, as the file has them.

use glam::DVec3;

use super::{Lattice, ScalarVolume};

/// The coordinates of a volume along one axis of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// The least and the greatest of the file's own places.
    pub ends: [f64; 2],
    /// Where the lattice that was made over these begins and ends, its outermost samples' boxes with it.
    extent: [f64; 2],
}

impl Coordinates {
    fn of(lattice: &Lattice, [low, high]: [DVec3; 2], axis: usize) -> Self {
        // Made lattices lie along the axes of the world.
        let (first, step) = (lattice.origin[axis], lattice.spacing[axis]);
        let extent = [first - 0.5 * step, first + (lattice.dims[axis] as f64 - 0.5) * step];
        Self { ends: [low[axis], high[axis]], extent }
    }

    /// The share of the volume's extent at which a coordinate lies, beyond 0..=1 outside it.
    pub fn share(&self, coordinate: f64) -> f64 {
        let [low, high] = self.extent;
        (coordinate - low) / (high - low)
    }

    /// The coordinate at a share of the extent.
    pub fn at(&self, share: f64) -> f64 {
        let [low, high] = self.extent;
        low + share * (high - low)
    }

    /// How many decimals tell a thousandth of the extent from the next.
    pub fn decimals(&self) -> usize {
        let [low, high] = self.extent;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let decimals = (3.0 - (high - low).log10()).ceil().clamp(0.0, 300.0) as usize;
        decimals
    }

    /// A coordinate with so many decimals, and no zeros behind.
    pub fn words(&self, coordinate: f64) -> String {
        let words = format!("{coordinate:.*}", self.decimals());
        let trimmed = match words.contains('.') {
            true => words.trim_end_matches('0').trim_end_matches('.'),
            false => &words,
        };
        if trimmed == "-0" { "0".to_owned() } else { trimmed.to_owned() }
    }
}

impl ScalarVolume {
    /// Coordinates along an axis, where the samples lie on a lattice that was made for them; `None` where they are the file's own,
    /// which have numbers.
    pub fn coordinates(&self, axis: usize) -> Option<Coordinates> {
        self.own_bounds.map(|bounds| Coordinates::of(&self.lattice, bounds, axis))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coordinate_lies_at_its_share_of_the_samples_boxes() {
        let lattice = Lattice {
            origin: DVec3::new(-6.0, 0.0, 10.0),
            spacing: DVec3::splat(0.5),
            ..Lattice::unit([24, 2, 3])
        };
        let bounds = [DVec3::new(-5.9, 0.1, 10.5), DVec3::new(5.4, 0.4, 10.5)];
        let along = |axis| Coordinates::of(&lattice, bounds, axis);
        for axis in 0..3 {
            for coordinate in [-3.25, 0.0, 11.0] {
                let share = along(axis).share(coordinate);
                assert!((along(axis).at(share) - coordinate).abs() < 1e-12);
                let sample = share * lattice.dims[axis] as f64 - 0.5;
                let place = lattice.world_from_index(DVec3::splat(sample));
                assert!((place[axis] - coordinate).abs() < 1e-12, "{axis} {coordinate}");
            }
        }
        assert_eq!(along(2).ends, [10.5, 10.5]);
    }

    #[test]
    fn a_coordinate_has_as_many_digits_as_tell_thousandths_of_the_extent() {
        let words = |step: f64, coordinate: f64| {
            let lattice = Lattice { spacing: DVec3::splat(step), ..Lattice::unit([20; 3]) };
            Coordinates::of(&lattice, [DVec3::ZERO; 2], 0).words(coordinate)
        };
        assert_eq!(words(1.0, 10.159_999_847), "10.16");
        assert_eq!((words(1.0, -10.0), words(1.0, -1e-9)), ("-10".to_owned(), "0".to_owned()));
        assert_eq!(words(1e-6, 1.234_567_89e-5), "0.00001235");
        assert_eq!(words(500.0, 4_649_770.3), "4649770");
    }
}
