//! Surfaces inside a volume: slices, and where values pass a level.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::super::POLYGON_COLOUR;
use super::{InsideError, Plane};
use crate::core::Srgb8;
use crate::transfer::TransferFunction;
use crate::volume::{Lattice, Statistics};

/// Where the first isosurface lies, as a part of the greatest opacity: where matter becomes dense.
const DENSE: f64 = 0.4;

/// Slices in a scene at most.
pub const MOST_SLICES: usize = 6;
/// Isosurfaces in a scene at most.
pub const MOST_ISOSURFACES: usize = 6;

/// Values on a plane, in their colours and not lit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slice {
    /// Which; of the side that its normal points to nothing depends.
    pub plane: Plane,
    /// 0..=1, whatever the values.
    pub opacity: f64,
    /// Leaves out what has no opacity by the transfer function, so that it is no wall before what lies behind.
    #[serde(default)]
    pub only_shown: bool,
    /// Draws where it cuts from one cell of the file into another, where cells are drawn ([`edge_colour`]).
    #[serde(default)]
    pub edges: bool,
}

/// The greatest luminance, linear light, of what is dark: edges of cells on it are white rather than black, and no surface has it
/// that nobody chose.
const DARK: f64 = 0.08;

fn is_dark([r, g, b]: [f64; 3]) -> bool {
    0.2126 * r + 0.7152 * g + 0.0722 * b < DARK
}

/// A colour of a slice, linear, where `share` of the places half a pixel beside it lie in another cell.
pub fn edge_colour(colour: [f64; 3], share: f64) -> [f64; 3] {
    let edge = if is_dark(colour) { 1.0 } else { 0.0 };
    colour.map(|c| c + (edge - c) * share)
}

/// Where values pass a level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Isosurface {
    /// The level, data units.
    pub value: f64,
    /// 0..=1.
    pub opacity: f64,
    /// Its colour; `None` is the transfer function's of the level.
    pub colour: Option<Srgb8>,
}

impl Isosurface {
    /// One that nobody has chosen yet: opaque, where opacities have risen to two fifths of the greatest, or at the ninth of ten
    /// values where they never do between the least and the greatest; in the colour there, or a light one where that is dark.
    pub fn first(transfer: &TransferFunction, statistics: &Statistics) -> Self {
        let dense = DENSE * transfer.most_opacity();
        let rises = transfer.opacity.windows(2).find_map(|ends| {
            let [(from, below), (to, above)] = [ends[0], ends[1]];
            let share = (dense - below) / (above - below);
            (below < dense && above >= dense).then_some(from + share * (to - from))
        });
        let is_within = |value: &f64| statistics.min < *value && *value < statistics.max;
        let value = rises.filter(is_within).unwrap_or(statistics.quantile(0.9));
        let colour = is_dark(transfer.colour_at(value).0).then_some(POLYGON_COLOUR);
        Self { value, opacity: 1.0, colour }
    }

    /// Its colour in linear light.
    #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
    pub fn linear_colour(&self, transfer: &TransferFunction) -> [f32; 3] {
        let colour = self.colour.map_or_else(|| transfer.colour_at(self.value), Srgb8::to_linear);
        colour.0.map(|c| c as f32)
    }

    pub(super) fn check(&self) -> Result<(), InsideError> {
        if !self.value.is_finite() {
            return Err(InsideError::Level { found: self.value });
        }
        check_opacity("an isosurface", self.opacity)
    }
}

impl Slice {
    /// Across one of a lattice's own axes, at a share of its extent.
    pub fn across(lattice: &Lattice, axis: usize, share: f64, opacity: f64) -> Self {
        let mut index = DVec3::from(lattice.dims.map(|n| n as f64)) / 2.0 - 0.5;
        index[axis] = share * lattice.dims[axis] as f64 - 0.5;
        // Square to the other two axes, which the plane runs along.
        let mut normal = DVec3::ZERO;
        normal[axis] = 1.0;
        let normal = (lattice.axes().inverse().transpose() * normal).normalize_or_zero();
        let plane = Plane { point: lattice.world_from_index(index), normal };
        Self { plane, opacity, only_shown: false, edges: false }
    }

    /// Whether every voxel lies on one side of it, whole.
    pub(super) fn is_beside(&self, lattice: &Lattice) -> bool {
        let half = self.plane.in_index(lattice);
        let dims = lattice.dims.map(|n| n as f64);
        // How far the corners reach to either side of the middle.
        let reach: f64 = (0..3).map(|axis| half.normal[axis].abs() * dims[axis] / 2.0).sum();
        let middle = (DVec3::from(dims) - 1.0) / 2.0;
        (half.normal.dot(middle) - half.least).abs() > reach
    }

    pub(super) fn check(&self) -> Result<(), InsideError> {
        self.plane.check()?;
        check_opacity("a slice", self.opacity)
    }
}

fn check_opacity(of: &'static str, found: f64) -> Result<(), InsideError> {
    if (0.0..=1.0).contains(&found) { Ok(()) } else { Err(InsideError::Opacity { of, found }) }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::core::Ticket;
    use crate::transfer::{ColourMap, ColourSource};
    use crate::volume::Samples;

    #[test]
    fn a_first_isosurface_lies_where_matter_becomes_dense_and_is_never_dark() {
        let statistics = |values: Vec<f64>| {
            Statistics::of(&Samples::Float64(values), &Ticket::new()).expect("values")
        };
        let values = statistics((0..=100).map(f64::from).collect());
        let map = |range| ColourSource::Map { map: ColourMap::Gray, range };
        let first = |opacity: &[(f64, f64)], range| {
            Isosurface::first(&TransferFunction::of(opacity.to_vec(), map(range)), &values)
        };
        let rising = [(20.0, 0.0), (40.0, 0.1), (60.0, 0.5), (100.0, 0.5)];
        let bright = first(&rising, [-50.0, 60.0]);
        // A fifth, of a half.
        assert!((bright.value - 45.0).abs() < 1e-9, "{bright:?}");
        assert_eq!((bright.opacity, bright.colour), (1.0, None));
        assert_eq!(first(&rising, [40.0, 200.0]).colour, Some(POLYGON_COLOUR));
        // As dense everywhere, and only beyond all values.
        assert_eq!(first(&[(0.0, 0.5), (100.0, 0.5)], [0.0, 100.0]).value, 90.0);
        assert_eq!(first(&[(150.0, 0.0), (200.0, 1.0)], [0.0, 100.0]).value, 90.0);
    }

    #[test]
    fn a_slice_across_an_axis_holds_what_lies_there_and_knows_where_it_is() {
        let lattice = Lattice {
            spacing: DVec3::new(1.0, 2.0, 0.5),
            origin: DVec3::new(5.0, -7.0, 1.0),
            direction: DMat3::from_cols(
                DVec3::X,
                DVec3::new(0.4, 0.9, 0.0).normalize(),
                DVec3::new(0.2, -0.1, -0.9).normalize(),
            ),
            ..Lattice::unit([8, 6, 10])
        };
        for axis in 0..3 {
            let slice = Slice::across(&lattice, axis, 0.3, 0.5);
            let mut index = DVec3::new(1.0, 5.0, 2.0);
            index[axis] = 0.3 * lattice.dims[axis] as f64 - 0.5;
            let off = (lattice.world_from_index(index) - slice.plane.point).dot(slice.plane.normal);
            assert!(off.abs() < 1e-12, "{axis}: {off}");
            for other in 0..3 {
                let share = slice.plane.share_across(&lattice, other);
                assert_eq!(share.is_some(), other == axis, "{axis} {other}");
                assert!(share.is_none_or(|share| (share - 0.3).abs() < 1e-12));
            }
            for (share, is_beside) in [(-0.01, true), (0.01, false), (0.99, false), (1.01, true)] {
                let slice = Slice::across(&lattice, axis, share, 0.5);
                assert_eq!(slice.is_beside(&lattice), is_beside, "{axis} {share}");
            }
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        let iso = |value, opacity| Isosurface { value, opacity, colour: None };
        assert!(iso(1.0, 0.0).check().is_ok() && iso(1.0, 1.0).check().is_ok());
        for wrong in [iso(f64::NAN, 1.0), iso(0.0, 1.5), iso(0.0, f64::NAN)] {
            let found = wrong.check().unwrap_err().to_string();
            assert!(found.contains("expected") && found.contains("found"), "{found}");
        }
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::ZERO };
        assert!(Slice { plane, opacity: 1.0, only_shown: false, edges: false }.check().is_err());
    }
}
