//! What is cut away of a volume: what lies outside a box along its own axes, and behind planes.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::InsideError;
use crate::rbf::Region;
use crate::volume::Lattice;

/// Free clip planes in a scene at most.
pub const MOST_CLIP_PLANES: usize = 6;

/// A part of a volume along its own axes, in shares of its extent: 0 where the boxes of its first
/// samples begin, 1 where those of its last end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClipBox {
    /// Where it begins along x, y, z.
    pub low: [f64; 3],
    /// Where it ends, more than `low`.
    pub high: [f64; 3],
}

/// A plane in the world, and a side of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Any point on it, world units.
    pub point: DVec3,
    /// Towards the side that is kept; of any length but 0.
    pub normal: DVec3,
}

/// What is seen of matter where it is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CutFaces {
    /// What lies behind, as everywhere.
    #[default]
    Through,
    /// The value there in its colour, opaque where it has any opacity, and not lit.
    Coloured,
}

/// What is kept of a volume. By default all of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Clip {
    /// What lies outside is cut away.
    pub bounds: Option<ClipBox>,
    /// What lies behind any of them is cut away; at most [`MOST_CLIP_PLANES`].
    pub planes: Vec<Plane>,
    /// What is seen of the faces of both.
    pub faces: CutFaces,
}

/// The points p of index space with normal · p ≥ least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// Of length 1.
    pub normal: DVec3,
    /// Samples.
    pub least: f64,
}

impl HalfSpace {
    /// The same in the index space of a lattice halved so many times (see `View::halved`).
    pub fn halved(&self, level: u32) -> Self {
        let times = f64::from(1_u32 << level);
        // A sample i of it is at (i + ½) · times − ½.
        let shift = self.normal.element_sum() * (times - 1.0) / 2.0;
        Self { normal: self.normal, least: (self.least - shift) / times }
    }
}

impl ClipBox {
    /// All of a volume.
    pub const WHOLE: Self = Self { low: [0.0; 3], high: [1.0; 3] };

    /// Where it begins and ends in index space.
    pub fn in_index(&self, dims: [usize; 3]) -> [DVec3; 2] {
        let size = DVec3::from(dims.map(|n| n as f64));
        [self.low, self.high].map(|share| DVec3::from(share) * size - 0.5)
    }

    /// The same part of the world.
    pub fn region(&self, lattice: &Lattice) -> Region {
        let [low, high] = self.in_index(lattice.dims);
        let sides = lattice.axes() * DMat3::from_diagonal(high - low);
        Region { corner: lattice.world_from_index(low), sides }
    }
}

impl Clip {
    /// Whether anything can be cut away by it.
    pub fn cuts(&self) -> bool {
        self.bounds.is_some_and(|bounds| bounds != ClipBox::WHOLE) || !self.planes.is_empty()
    }

    /// What is kept of a lattice, as the part that all of these have in common. Faces of the box that
    /// are the lattice's own cut nothing, and are left out.
    pub fn half_spaces(&self, lattice: &Lattice) -> Vec<HalfSpace> {
        let mut kept = Vec::new();
        if let Some(bounds) = self.bounds {
            let [low, high] = bounds.in_index(lattice.dims);
            for (axis, normal) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
                if bounds.low[axis] > 0.0 {
                    kept.push(HalfSpace { normal, least: low[axis] });
                }
                if bounds.high[axis] < 1.0 {
                    kept.push(HalfSpace { normal: -normal, least: -high[axis] });
                }
            }
        }
        kept.extend(self.planes.iter().map(|plane| plane.in_index(lattice)));
        kept
    }

    pub(super) fn check(&self) -> Result<(), InsideError> {
        if let Some(ClipBox { low, high }) = self.bounds {
            for (a, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
                let (low, high) = (low[a], high[a]);
                if !(0.0 <= low && low < high && high <= 1.0) {
                    return Err(InsideError::Box { axis, low, high });
                }
            }
        }
        let found = self.planes.len();
        if found > MOST_CLIP_PLANES {
            return Err(InsideError::Planes { found });
        }
        self.planes.iter().try_for_each(Plane::check)
    }
}

impl Plane {
    /// The same in a lattice's index space.
    pub fn in_index(&self, lattice: &Lattice) -> HalfSpace {
        // By its greatest part first: squares of tiny ones are 0.
        let normal = self.normal / self.normal.abs().max_element();
        let across = lattice.axes().transpose() * normal;
        let length = across.length();
        let least = (self.point - lattice.origin).dot(normal);
        HalfSpace { normal: across / length, least: least / length }
    }

    /// The share of a lattice's extent along an axis at which it lies across it; `None` where it lies
    /// obliquely.
    pub fn share_across(&self, lattice: &Lattice, axis: usize) -> Option<f64> {
        let half = self.in_index(lattice);
        let along = half.normal[axis];
        let share = (half.least / along + 0.5) / lattice.dims[axis] as f64;
        (along.abs() > 1.0 - 1e-9).then_some(share)
    }

    /// The axis of a lattice that it lies across.
    pub fn axis_across(&self, lattice: &Lattice) -> Option<usize> {
        (0..3).find(|&axis| self.share_across(lattice, axis).is_some())
    }

    pub(super) fn check(&self) -> Result<(), InsideError> {
        let Self { point, normal } = *self;
        let is_sound = point.is_finite() && normal.is_finite() && normal != DVec3::ZERO;
        if is_sound { Ok(()) } else { Err(InsideError::Plane { point, normal }) }
    }

    /// The corners of what a plane cuts out of a volume, one after the other around it, index space.
    pub fn outline(&self, lattice: &Lattice) -> Vec<DVec3> {
        let half = self.in_index(lattice);
        let size = DVec3::from(lattice.dims.map(|n| n as f64));
        let corner = |bits: usize| {
            DVec3::from([0, 1, 2].map(|axis| (bits >> axis & 1) as f64 * size[axis])) - 0.5
        };
        let mut found: Vec<DVec3> = Vec::new();
        for axis in 0..3 {
            for bits in (0..8).filter(|bits| bits >> axis & 1 == 0) {
                let (a, b) = (corner(bits), corner(bits | 1 << axis));
                let [at_a, at_b] = [a, b].map(|end| half.normal.dot(end) - half.least);
                if (at_a <= 0.0) != (at_b <= 0.0) {
                    found.push(a.lerp(b, at_a / (at_a - at_b)));
                }
            }
        }
        let middle = found.iter().sum::<DVec3>() / found.len().max(1) as f64;
        let first = half.normal.any_orthonormal_vector();
        let second = half.normal.cross(first);
        let angle = |at: &DVec3| (*at - middle).dot(second).atan2((*at - middle).dot(first));
        found.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        found
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    fn lattice() -> Lattice {
        Lattice {
            spacing: DVec3::new(1.0, 2.0, 0.5),
            origin: DVec3::new(7.0, -3.0, 11.0),
            direction: DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7),
            ..Lattice::unit([8, 6, 10])
        }
    }

    #[test]
    fn a_plane_keeps_what_lies_on_the_side_of_its_normal() {
        let lattice = lattice();
        let plane = Plane {
            point: lattice.world_from_index(DVec3::new(3.0, 2.0, 5.0)),
            normal: DVec3::new(0.3, -0.5, 2.0),
        };
        let clip = Clip { planes: vec![plane], ..Clip::default() };
        let [half] = clip.half_spaces(&lattice)[..] else { panic!("one plane") };
        let mut sides = [0, 0];
        for i in 0..480_usize {
            let index = DVec3::from([i % 8, i / 8 % 6, i / 48].map(|i| i as f64 + 0.1));
            let above = (lattice.world_from_index(index) - plane.point).dot(plane.normal) >= 0.0;
            assert_eq!(half.normal.dot(index) >= half.least, above, "{index}");
            sides[usize::from(above)] += 1;
        }
        assert!(sides[0] > 100 && sides[1] > 100, "{sides:?}");
        assert!((half.normal.length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_box_cuts_where_its_shares_say_and_not_at_the_lattices_own_faces() {
        let bounds = ClipBox { low: [0.25, 0.0, 0.1], high: [1.0, 0.5, 1.0] };
        let clip = Clip { bounds: Some(bounds), ..Clip::default() };
        let kept = clip.half_spaces(&lattice());
        let expected = [(DVec3::X, 1.5), (-DVec3::Y, -2.5), (DVec3::Z, 0.5)];
        assert_eq!(kept.len(), expected.len());
        for (half, (normal, least)) in kept.iter().zip(expected) {
            assert!(half.normal == normal && (half.least - least).abs() < 1e-12, "{half:?}");
        }
        let whole = Clip { bounds: Some(ClipBox::WHOLE), ..Clip::default() };
        assert!(!whole.cuts() && whole.half_spaces(&lattice()).is_empty());
        assert!(clip.cuts() && !Clip::default().cuts());
    }

    #[test]
    fn means_of_samples_are_cut_where_their_samples_are() {
        let half = HalfSpace { normal: DVec3::new(0.6, 0.0, -0.8), least: 1.75 };
        for level in 0..4 {
            let times = f64::from(1_u32 << level);
            let found = half.halved(level);
            for index in [DVec3::new(3.0, 1.0, 2.0), DVec3::new(-0.5, 8.0, 0.25)] {
                let fine = (index + 0.5) * times - 0.5;
                let [coarse, fine] =
                    [found.normal.dot(index) - found.least, half.normal.dot(fine) - half.least];
                assert!((coarse * times - fine).abs() < 1e-12, "{level} {index}");
            }
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        let bounds = |low: [f64; 3], high: [f64; 3]| Clip {
            bounds: Some(ClipBox { low, high }),
            ..Clip::default()
        };
        assert!(bounds([0.0; 3], [1.0; 3]).check().is_ok());
        for wrong in [
            bounds([0.5; 3], [0.5, 1.0, 1.0]),
            bounds([-0.1, 0.0, 0.0], [1.0; 3]),
            bounds([0.0; 3], [1.0, 1.0, 1.1]),
            bounds([f64::NAN, 0.0, 0.0], [1.0; 3]),
        ] {
            let found = wrong.check().unwrap_err().to_string();
            assert!(found.contains("expected") && found.contains("found"), "{found}");
        }
        let plane =
            |point, normal| Clip { planes: vec![Plane { point, normal }], ..Clip::default() };
        assert!(plane(DVec3::ZERO, DVec3::X).check().is_ok());
        assert!(plane(DVec3::ZERO, DVec3::ZERO).check().is_err());
        assert!(plane(DVec3::NAN, DVec3::X).check().is_err());
        let sound = Plane { point: DVec3::ZERO, normal: DVec3::X };
        let many = Clip { planes: vec![sound; MOST_CLIP_PLANES + 1], ..Clip::default() };
        assert!(many.check().unwrap_err().to_string().contains("at most"));
    }
}
