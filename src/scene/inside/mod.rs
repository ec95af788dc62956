//! What lets people see inside a volume, as plain data: a part that is cut away, slices,
//! isosurfaces, and what stands for a ray in place of the light along it.
//!
//! Slabs of a reconstructed field show it. Pictures of other modes do not, and refuse it rather than
//! pass over it ([`Inside::check`]).

mod clip;
mod hidden;
mod projected;
mod surfaces;

pub(super) use hidden::FADED;

pub use clip::{Clip, ClipBox, CutFaces, HalfSpace, MOST_CLIP_PLANES, Plane};
pub use projected::projected_range;
pub use surfaces::{Isosurface, MOST_ISOSURFACES, MOST_SLICES, Slice, edge_colour};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Classify, Effect, SplatSettings, Visibility};
use crate::core::{names, plain_number, plain_numbers};
use crate::volume::{ScalarVolume, Statistics};

/// What of a volume is looked into. By default nothing: all of it is seen from outside.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Inside {
    /// What is kept of it.
    pub clip: Clip,
    /// Planes that show values; at most [`MOST_SLICES`].
    pub slices: Vec<Slice>,
    /// Where values pass levels; at most [`MOST_ISOSURFACES`].
    pub isosurfaces: Vec<Isosurface>,
    /// What stands for a ray.
    pub along: AlongRay,
    /// The values that the first and the last colour of projected values belong to; `None` as the transfer function
    /// has it.
    pub projected_range: Option<[f64; 2]>,
    /// Whether projected values are grey, from black to white, rather than in the colours of the transfer function.
    pub projected_grey: bool,
    /// Whether the field is drawn with a small part of its opacities, so that what lies in it is seen.
    pub is_faded: bool,
}

/// What stands for a ray of the values it meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlongRay {
    /// The light of all of them, each hiding what is behind by its opacity.
    #[default]
    Composite,
    /// The greatest, in its colour, whatever the opacities.
    Maximum,
    /// The least.
    Minimum,
    /// Their mean over the ray's length in the volume.
    Average,
}

names!(AlongRay {
    Composite => "composite" | "volume",
    Maximum => "maximum" | "mip",
    Minimum => "minimum" | "minip",
    Average => "average",
});

/// What is no way to look inside.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InsideError {
    /// A box without an inside, or beyond the volume.
    #[error(
        "expected a clip box that begins before it ends, within the volume, found {} to {} along \
         {axis} (shares of the volume); give places within it, the lesser first",
        plain_number(*low), plain_number(*high)
    )]
    Box {
        /// x, y or z.
        axis: char,
        /// Where it begins.
        low: f64,
        /// Where it ends.
        high: f64,
    },
    /// A range of projected values that is none.
    #[error(
        "expected a range of projected values between two different finite ones, found {} to {}",
        plain_number(*low), plain_number(*high)
    )]
    Range {
        /// Where it begins.
        low: f64,
        /// Where it ends.
        high: f64,
    },
    /// A plane that faces nowhere.
    #[error(
        "expected a plane through a finite point with a finite normal other than 0, found {} and {}",
        plain_numbers(point.to_array()), plain_numbers(normal.to_array())
    )]
    Plane {
        /// A point on it.
        point: DVec3,
        /// The offending normal, or that of an offending point.
        normal: DVec3,
    },
    /// A level that is none.
    #[error("expected a finite value of an isosurface, found {found}")]
    Level {
        /// The offending number.
        found: f64,
    },
    /// An opacity that is none.
    #[error("expected the opacity of {of} from 0 to 1, found {}", plain_number(*found))]
    Opacity {
        /// Of what.
        of: &'static str,
        /// The offending number.
        found: f64,
    },
    /// Too many surfaces.
    #[error("expected at most {most} {of}, found {found}; leave some out")]
    Surfaces {
        /// Of which.
        of: &'static str,
        /// How many there may be.
        most: usize,
        /// How many.
        found: usize,
    },
    /// Values that are known in the middles of slabs alone.
    #[error(
        "expected --classify pre-integrated with an isosurface, which lies between the values on two \
         slab faces, found --classify {classify}; leave one of the two out"
    )]
    Middle {
        /// When the mode classifies.
        classify: &'static str,
    },
    /// Too many planes.
    #[error("expected at most {MOST_CLIP_PLANES} clip planes, found {found}; leave some out")]
    Planes {
        /// How many.
        found: usize,
    },
    /// What hides, where nothing hides anything.
    #[error(
        "expected --projection composite with {what}, found {along}, which is of values and shows no \
         surfaces; leave one of the two out"
    )]
    Projected {
        /// What was asked for.
        what: &'static str,
        /// The projection.
        along: &'static str,
    },
    /// A mode that cannot show it.
    #[error(
        "expected slabs classified after reconstruction with {what}, found --visibility {visibility} \
         --classify {classify}; leave the mode's flags out, which is the exact mode, or leave {what} out"
    )]
    Mode {
        /// What was asked for.
        what: &'static str,
        /// The mode's visibility.
        visibility: &'static str,
        /// When it classifies.
        classify: &'static str,
    },
}

impl Inside {
    /// Whether nothing is asked for.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// Whether pictures of a mode show it.
    pub fn is_shown_by(splat: &SplatSettings) -> bool {
        splat.visibility == Visibility::Slabs && splat.classify != Classify::Before
    }

    /// What pictures of a mode show of it: nothing where they are of shaded samples, isosurfaces where
    /// values are pre-integrated, surfaces where values are not projected.
    pub fn shown_by(&self, splat: &SplatSettings) -> Self {
        if !Self::is_shown_by(splat) {
            return Self::default();
        }
        let mut shown = self.clone();
        if splat.classify != Classify::PreIntegrated {
            shown.isosurfaces.clear();
        }
        if shown.along != AlongRay::Composite {
            shown.isosurfaces.clear();
            shown.slices.clear();
            shown.clip.faces = CutFaces::Through;
        }
        shown
    }

    /// Whether isosurfaces are to be seen.
    pub fn has_isosurfaces(&self) -> bool {
        !self.isosurfaces.is_empty() && self.along == AlongRay::Composite
    }

    /// What of it can show nothing of a volume since it lies beside it, a sentence each.
    pub fn beside(&self, volume: &ScalarVolume) -> Vec<String> {
        let Statistics { min, max, .. } = volume.statistics;
        let levels = self.isosurfaces.iter().map(|iso| iso.value);
        let levels = levels.filter(|value| !(min..=max).contains(value)).map(|value| {
            // Kernels that pass through the samples go a little beyond them in between.
            format!(
                "no sample of the field reaches {}, where an isosurface is asked for: they go from {} \
                 to {}, and it shows at most where the field between them goes beyond",
                plain_number(value),
                plain_number(min),
                plain_number(max)
            )
        });
        let is_beside = |slice: &&Slice| slice.is_beside(&volume.lattice);
        let slices = self.slices.iter().filter(is_beside).map(|slice| {
            let point = plain_numbers(slice.plane.point.to_array());
            format!(
                "the slice through {point} (world) lies beside the volume, and shows nothing of it"
            )
        });
        let clear = |(of, opacity): (&str, f64)| {
            (opacity == 0.0)
                .then(|| format!("{of} of opacity 0 shows nothing; give it another, up to 1"))
        };
        let isosurfaces = self.isosurfaces.iter().map(|iso| ("an isosurface", iso.opacity));
        let opacities =
            isosurfaces.chain(self.slices.iter().map(|slice| ("a slice", slice.opacity)));
        levels.chain(slices).chain(opacities.filter_map(clear)).collect()
    }

    /// What it asks for.
    pub fn effects(&self) -> Vec<Effect> {
        let projects = self.along != AlongRay::Composite;
        let asked = [
            (self.clip.cuts(), Effect::Clip),
            (projects, Effect::Projection),
            (!self.isosurfaces.is_empty() && !projects, Effect::Isosurfaces),
            (!self.slices.is_empty() && !projects, Effect::Slices),
        ];
        asked.into_iter().filter_map(|(is_asked, effect)| is_asked.then_some(effect)).collect()
    }

    /// Whether it means something, and a mode can draw it.
    ///
    /// # Errors
    /// See [`InsideError`].
    pub fn check(&self, splat: &SplatSettings) -> Result<(), InsideError> {
        self.clip.check()?;
        self.slices.iter().try_for_each(Slice::check)?;
        self.isosurfaces.iter().try_for_each(Isosurface::check)?;
        if let Some([low, high]) = self.projected_range
            && !(low.is_finite() && high.is_finite() && low != high)
        {
            return Err(InsideError::Range { low, high });
        }
        for (of, most, found) in [
            ("slices", MOST_SLICES, self.slices.len()),
            ("isosurfaces", MOST_ISOSURFACES, self.isosurfaces.len()),
        ] {
            if found > most {
                return Err(InsideError::Surfaces { of, most, found });
            }
        }
        let hidden = [
            (self.clip.faces == CutFaces::Coloured, "coloured cut faces"),
            (!self.slices.is_empty(), "slices"),
            (!self.isosurfaces.is_empty(), "isosurfaces"),
        ];
        let hidden = hidden.into_iter().find(|(is_asked, _)| *is_asked);
        if let Some((_, what)) = hidden.filter(|_| self.along != AlongRay::Composite) {
            return Err(InsideError::Projected { what, along: self.along.name() });
        }
        let what = self.effects().first().map(|effect| effect.name());
        match what.filter(|_| !Self::is_shown_by(splat)) {
            None if self.has_isosurfaces() && splat.classify.takes_one_value() => {
                Err(InsideError::Middle { classify: splat.classify.name() })
            }
            None => Ok(()),
            Some(what) => Err(InsideError::Mode {
                what,
                visibility: splat.visibility.name(),
                classify: splat.classify.name(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_that_cannot_show_it_are_refused_only_where_something_is_asked_for() {
        let plain = Inside::default();
        let clipped = Inside {
            clip: Clip {
                bounds: Some(ClipBox { high: [0.5, 1.0, 1.0], ..ClipBox::WHOLE }),
                ..Clip::default()
            },
            ..Inside::default()
        };
        assert!(plain.is_plain() && !clipped.is_plain());
        assert_eq!(plain.check(&SplatSettings::SHADE_FIRST), Ok(()));
        assert_eq!(clipped.check(&SplatSettings::EXACT), Ok(()));
        let refused = clipped.check(&SplatSettings::SHADE_FIRST).unwrap_err().to_string();
        assert!(refused.contains("with clip, found --visibility every-sample"), "{refused}");
        assert_eq!((plain.effects(), clipped.effects()), (vec![], vec![Effect::Clip]));
        let mut both = Inside { along: AlongRay::Maximum, ..clipped.clone() };
        assert_eq!(both.effects(), [Effect::Clip, Effect::Projection]);
        assert_eq!(both.check(&SplatSettings::EXACT), Ok(()));
        both.clip.faces = CutFaces::Coloured;
        let refused = both.check(&SplatSettings::EXACT).unwrap_err().to_string();
        assert!(
            refused.contains("--projection composite") && refused.contains("maximum"),
            "{refused}"
        );
        let iso = Isosurface { value: 1.0, opacity: 1.0, colour: None };
        let mut all = Inside { isosurfaces: vec![iso], ..clipped.clone() };
        assert_eq!(all.shown_by(&SplatSettings::EXACT), all);
        let after = SplatSettings { classify: Classify::After, ..SplatSettings::EXACT };
        assert_eq!(all.shown_by(&after), clipped, "values in the middles of slabs pass no level");
        assert!(all.shown_by(&SplatSettings::SHADE_FIRST).is_plain());
        (all.along, all.clip.faces) = (AlongRay::Minimum, CutFaces::Coloured);
        let projected = Inside { along: AlongRay::Minimum, ..clipped };
        assert_eq!(all.shown_by(&SplatSettings::EXACT), projected);
    }

    #[test]
    fn what_is_asked_for_and_cannot_be_seen_is_told() {
        let samples = crate::volume::Samples::UInt8((0..8).collect());
        let lattice = crate::volume::Lattice::unit([2; 3]);
        let slice = |share| Slice::across(&lattice, 0, share, 0.5);
        let volume = ScalarVolume::from_samples("ramp", lattice, samples).unwrap();
        let iso = Isosurface { value: 3.5, opacity: 0.5, colour: None };
        let mut inside =
            Inside { isosurfaces: vec![iso], slices: vec![slice(0.5)], ..Inside::default() };
        assert!(inside.beside(&volume).is_empty(), "both are seen");
        inside.isosurfaces[0].opacity = 0.0;
        inside.slices[0].opacity = 0.0;
        let told = inside.beside(&volume);
        assert_eq!(told.len(), 2);
        assert!(
            told[0].starts_with("an isosurface of opacity 0") && told[1].starts_with("a slice of")
        );
        inside.isosurfaces[0] = Isosurface { value: 9.0, ..iso };
        inside.slices[0] = slice(3.0);
        assert_eq!(inside.beside(&volume).len(), 2);
    }
}
