//! What people choose about vector splats.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Design;
use crate::core::{Srgb8, names, plain_number};
use crate::transfer::{ColourMap, ColourSource, TransferError, TransferFunction};
use crate::volume::{Places, ScalarVolume, Statistics, VectorField};

/// The longest that splats are stretched along the flow, times their width.
pub const MOST_STRETCH: f64 = 8.0;
/// The largest radius of a splat, in steps of its grid.
pub const MOST_VECTOR_EXTENT: f64 = 8.0;
/// Radius of a splat without other wishes, in steps of its grid (Crawfis–Max: "an extent of 1.6").
const NATURAL_EXTENT: f64 = 1.6;

/// How a splat's texture meets its colour (Crawfis–Max, after the GL's texture environments).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VectorMode {
    /// Colour and opacity times the intensity of the marks: the marks alone are seen.
    #[default]
    Modulate,
    /// A dissolve from the splat's colour to that of the marks by their intensity, and the footprint's
    /// opacity: matter with marks in it.
    Blend,
}

impl VectorMode {
    /// Radius of the ellipse that is drawn of a kernel of a radius: that of the marks' window, but for BLEND.
    pub fn drawn_radius(self, radius: f64) -> f64 {
        radius * if self == Self::Blend { 1.0 } else { super::WINDOW }
    }
}

names!(VectorMode[2] { Modulate => "modulate", Blend => "blend" });

/// How marks look when a vector points towards the eye or away (Crawfis–Max's three ways).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Foreshortening {
    /// From the table: the particles as seen from there.
    #[default]
    Table,
    /// The splat itself is shortened.
    Polygon,
    /// The texture's coordinates are stretched, within the same window.
    Coordinates,
}

names!(Foreshortening[3] { Table => "table", Polygon => "polygon", Coordinates => "coordinates" });

/// What a colour or an opacity is looked up by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourBy {
    /// The length of the vector.
    #[default]
    Magnitude,
    /// World position along x.
    X,
    /// World position along y.
    Y,
    /// World position along z.
    Z,
    /// The scalar field beside it, where the vector stands.
    Scalar,
}

names!(ColourBy[5] { Magnitude => "magnitude", X => "x", Y => "y", Z => "z", Scalar => "scalar" });

impl ColourBy {
    /// Least and greatest of what is looked up by; `scalar` is the field beside the vectors. Two zeros where there
    /// is none.
    pub fn range(self, field: &VectorField, scalar: Option<&ScalarVolume>) -> [f64; 2] {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |[low, high]: [f64; 2], v: f64| [low.min(v), high.max(v)];
        let along = |axis: usize| match &field.places {
            // The corners are farthest.
            Places::Lattice(lattice) => (0..8).fold(none, |range, corner| {
                let last = lattice.dims.map(|n| n as f64 - 1.0);
                let at = std::array::from_fn(|a| if corner >> a & 1 == 1 { last[a] } else { 0.0 });
                wider(range, lattice.world_from_index(DVec3::from_array(at))[axis])
            }),
            Places::Points { points, .. } => {
                points.iter().fold(none, |range, point| wider(range, point[axis]))
            }
        };
        let of = |statistics: &Statistics| [statistics.min, statistics.max];
        match self {
            Self::Magnitude => of(&field.statistics),
            Self::X => along(0),
            Self::Y => along(1),
            Self::Z => along(2),
            Self::Scalar => scalar.map_or([0.0; 2], |scalar| of(&scalar.statistics)),
        }
    }
}

/// Everything about vector splats but the field and the phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VectorSettings {
    /// MODULATE or BLEND.
    pub mode: VectorMode,
    /// What opacities and colours are looked up by.
    pub opacity_by: ColourBy,
    /// See [`VectorSettings::opacity_by`]: of the colours.
    pub colour_by: ColourBy,
    /// Opacity per unit distance, and colour, of the quantities above.
    pub transfer: TransferFunction,
    /// BLEND's constant colour, that of the marks; `None`: that of the transfer function, over a body
    /// that is grey.
    pub marks: Option<Srgb8>,
    /// What the marks look like.
    pub design: Design,
    /// How they are foreshortened.
    pub foreshortening: Foreshortening,
    /// Length along the flow over width, 1..=[`MOST_STRETCH`].
    pub stretch: f64,
    /// Radius of a splat in steps of its grid, at most [`MOST_VECTOR_EXTENT`]; `None`: 1.6.
    pub extent: Option<f64>,
    /// How often the field is halved before it is drawn: each splat stands for 8 to the power of it.
    pub coarser: u32,
    /// Of the splats' own phases.
    pub seed: u64,
}

/// Settings that mean nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VectorSettingsError {
    /// A stretch outside its range.
    #[error("expected a stretch of vector splats from 1 to {MOST_STRETCH}, found {}", plain_number(*.0))]
    Stretch(f64),
    /// An extent outside its range.
    #[error(
        "expected an extent of vector splats over 0 and at most {MOST_VECTOR_EXTENT}, found {}",
        plain_number(*.0)
    )]
    Extent(f64),
    /// Means of more than there is.
    #[error("expected vectors to be halved 0 to {MOST_COARSER} times, found {0}")]
    Coarser(u32),
    /// A transfer function that is none.
    #[error("for vectors: {0}")]
    Transfer(#[from] TransferError),
}

/// What of the lengths' range is left transparent, and where opacity reaches its greatest.
const FAINT: f64 = 0.5;
const FULL: f64 = 0.98;
/// Greatest opacity without other wishes.
const OPACITY: f64 = 0.95;
/// Lengths beyond so many times that have the last colour.
const OUTLIER: f64 = 2.0;
/// Splats along the longest side of a field, at most, as it is first seen.
const MOST_ACROSS: usize = 40;
/// The same of those that flow from the start.
const FLOWING_ACROSS: usize = 10;
/// Fields are halved no more often than this.
pub const MOST_COARSER: u32 = 8;

impl VectorSettings {
    /// What vectors of such lengths are first seen as: the longer the more opaque and the brighter.
    ///
    /// Of a fine grid, means are drawn: marks of splats that are a few pixels wide cannot be made out.
    pub fn for_field(field: &VectorField) -> Self {
        let longest = field.places.dims().into_iter().max().unwrap_or(1);
        let coarser =
            (0..u32::BITS - 1).find(|&level| longest >> level <= MOST_ACROSS).unwrap_or(0);
        Self { coarser, ..Self::for_lengths(&field.statistics) }
    }

    /// What vectors are seen as where they are all that is to be seen, from the back of a room: few long marks, brighter
    /// than black however short their vectors, of the longer half.
    pub fn flowing(field: &VectorField) -> Self {
        let longest = field.places.dims().into_iter().max().unwrap_or(1);
        let coarser = (0..MOST_COARSER).find(|&level| longest >> level <= FLOWING_ACROSS);
        let lengths = &field.statistics;
        let [half, most, top] = [0.5, 0.75, 0.9].map(|share| lengths.quantile(share));
        let mut settings = Self::for_lengths(lengths);
        if most > half {
            settings.transfer.opacity = vec![(half, 0.0), (most, 1.0)];
        }
        if top > half {
            // What shows begins in the brighter half of the map, where no length less than the least is needed for that, and
            // ends before its brightest, on which no mark is seen.
            let range = [(half - 0.8 * (top - half)).max(lengths.min), top + 0.6 * (top - half)];
            settings.transfer.colour = ColourSource::Map { map: ColourMap::Plasma, range };
        }
        Self {
            coarser: coarser.unwrap_or(MOST_COARSER),
            extent: Some(1.0),
            stretch: 3.0,
            mode: VectorMode::Blend,
            ..settings
        }
    }

    /// The same by the lengths alone, of every vector.
    pub fn for_lengths(lengths: &Statistics) -> Self {
        let quantile = |share: f64| {
            let last = lengths.quantiles.len().saturating_sub(1) as f64;
            let found = lengths.quantiles.get((share * last).round() as usize);
            found.copied().unwrap_or(lengths.max)
        };
        let (low, high) = (quantile(FAINT), quantile(FULL));
        let opacity = match high > low {
            true => vec![(low, 0.0), (high, OPACITY)],
            // All of one length; of none, there is nothing to show a direction of.
            false => vec![(low, if lengths.max > 0.0 { OPACITY } else { 0.0 })],
        };
        // Up to the longest, unless that is an outlier.
        let top = lengths.max.min(OUTLIER * high);
        let range = if top > 0.0 { [0.0, top] } else { [0.0, 1.0] };
        // None of its colours is so dark that short vectors are lost on black.
        let colour = ColourSource::Map { map: ColourMap::CoolWarm, range };
        Self {
            mode: VectorMode::default(),
            opacity_by: ColourBy::Magnitude,
            colour_by: ColourBy::Magnitude,
            transfer: TransferFunction::of(opacity, colour),
            marks: Some(Srgb8::WHITE),
            design: Design::default(),
            foreshortening: Foreshortening::default(),
            stretch: 1.5,
            extent: None,
            coarser: 0,
            seed: 0,
        }
    }

    /// # Errors
    /// See [`VectorSettingsError`].
    pub fn check(&self) -> Result<(), VectorSettingsError> {
        self.transfer.validate()?;
        if !(1.0..=MOST_STRETCH).contains(&self.stretch) {
            return Err(VectorSettingsError::Stretch(self.stretch));
        }
        if self.coarser > MOST_COARSER {
            return Err(VectorSettingsError::Coarser(self.coarser));
        }
        match self.extent {
            Some(extent) if !(extent > 0.0 && extent <= MOST_VECTOR_EXTENT) => {
                Err(VectorSettingsError::Extent(extent))
            }
            _ => Ok(()),
        }
    }

    /// Radius of a splat in steps of its grid.
    pub fn radius(&self) -> f64 {
        self.extent.unwrap_or(NATURAL_EXTENT)
    }
}
