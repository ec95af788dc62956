//! What a file of basis functions holds: an encoding, what it was made of, and how far it is from that.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::vrbf::Cover;
use crate::core::counted;
use crate::rbf::{Encoding, Errors, Favour, few_digits};
use crate::volume::Lattice;

/// Functions, and what is known of them.
#[derive(Debug, Clone)]
pub struct Encoded {
    /// The functions.
    pub encoding: Encoding,
    /// How far their sum is from the samples, all of which count the same here.
    pub errors: Errors,
    /// The same of those that were favoured, where some were.
    pub favoured: Option<Errors>,
    /// What they were fitted to.
    pub source: Source,
    /// How far their sum goes beyond the range of the samples, in the middles between these; 0 where it stays within.
    pub overshoot: f64,
    /// Of a mesh, how far their sum is from what lies between its points by straight lines, in the middles of cells and edges and
    /// halfway to corners; `None` of other sources, where nothing is known between samples.
    pub between: Option<Errors>,
    /// Why there are fewer functions than were allowed; `None` where there are as many, where an error that was asked for ended
    /// the fit, or somebody did.
    pub ended: Option<Ended>,
}

/// Why a fit ended with fewer functions than it was allowed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// More of them brought the sum no nearer.
    NoNearer {
        /// As many as were allowed, where that was a number.
        allowed: Option<usize>,
    },
    /// Nobody asked for an error, and the sum is as near as is aimed at then.
    Finest {
        /// As many as were allowed, where that was a number.
        allowed: Option<usize>,
        /// The greatest error that is aimed at then, % of the values' range.
        percent: f64,
    },
}

/// What functions were fitted to.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// The file's name.
    pub name: String,
    /// What was encoded of it.
    pub field: String,
    /// How many samples were finite.
    pub samples: usize,
    /// How many were not, and are nowhere in the sum.
    pub left_out: usize,
    /// The greatest error that was asked for, in the samples' units, if one was.
    pub wanted: Option<f64>,
    /// The mean error that was asked for, likewise.
    pub wanted_mean: Option<f64>,
    /// The most bytes that a file of them was to have, if that was asked for.
    pub wanted_bytes: Option<u64>,
    /// Which samples counted more, if some did.
    pub favour: Option<Favour>,
    /// Where the samples lie; of what is not evenly spaced, as many over the same box.
    pub lattice: Lattice,
    /// Whether samples lie all over their box. Those of meshes, of bent grids and of points may not.
    pub fills_box: bool,
    /// The least and the greatest of the samples' values, where they are known.
    pub range: Option<[f64; 2]>,
    /// Where the source has values, where that is known and is not the whole box.
    pub cover: Option<Cover>,
    /// What the file calls its space.
    pub space: Option<String>,
    /// What lengths are given in.
    pub unit: Option<String>,
}

/// What `info` tells of an encoding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// How many functions.
    pub functions: usize,
    /// What they look like.
    pub basis: &'static str,
    /// The greatest difference from the source's samples.
    pub max_error: f64,
    /// The mean of the differences' sizes.
    pub mean_error: f64,
    /// The root of the mean of their squares.
    pub rms_error: f64,
    /// How far the sum goes beyond the range of the source's samples between these.
    pub overshoot: f64,
    /// Of a mesh, the greatest difference from what lies between its points by straight lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_max_error: Option<f64>,
    /// The mean of the differences' sizes there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub between_mean_error: Option<f64>,
    /// Which samples counted more, if some did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub favour: Option<Favour>,
    /// The greatest difference from the samples that were favoured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub favoured_max_error: Option<f64>,
    /// The mean of the differences' sizes there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub favoured_mean_error: Option<f64>,
    /// Samples that they were fitted to.
    pub samples: usize,
    /// Samples that are not finite, and that no function was fitted to.
    pub left_out: usize,
    /// Why there are fewer functions than were allowed, if there are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended: Option<Ended>,
    /// The file that was encoded.
    pub source: String,
}

impl Source {
    /// Whether it has values about a place, as far as is known.
    pub fn has(&self, at: DVec3) -> bool {
        self.cover.as_ref().is_none_or(|cover| cover.has(self.lattice.nearest(at)))
    }
}

impl Encoded {
    /// Whether a value where the source may have some can be the sum's in there. Where that is known by cubes of many samples
    /// these hold places outside of it, too: a value that is further from the range than any between samples is of those.
    pub fn may_be_of_source(&self, value: f64) -> bool {
        let is_coarse = self.source.cover.as_ref().is_some_and(|cover| cover.edge() > 1);
        let Some([low, high]) = self.source.range.filter(|_| is_coarse) else { return true };
        let beyond = self.overshoot.max(self.errors.max);
        (low - beyond..=high + beyond).contains(&value)
    }

    /// Whether its errors are as small as was asked for.
    pub fn is_as_near_as_asked_for(&self) -> bool {
        let Source { wanted, wanted_mean, .. } = self.source;
        let is_within = |error: f64, wanted: Option<f64>| wanted.is_none_or(|most| error <= most);
        is_within(self.errors.max, wanted) && is_within(self.errors.mean, wanted_mean)
    }

    /// How many samples have no part in the sum since they are not finite, for people; `None` where there are none.
    pub fn told_left_out(&self) -> Option<String> {
        let Source { left_out, cover, .. } = &self.source;
        // Of what tells where it has values the sum ends there.
        let while_it_goes_on = if cover.is_none() { ", while the sum goes on there" } else { "" };
        let samples = counted(*left_out, "sample");
        (*left_out > 0)
            .then(|| format!("not finite in the source, and left out{while_it_goes_on}: {samples}"))
    }

    /// Why there are fewer functions than were allowed, for people; `None` where there are as many, or as near as asked for.
    pub fn told_ended(&self) -> Option<String> {
        let (allowed, why) = match self.ended? {
            Ended::NoNearer { allowed } => {
                (allowed, "more of them brought the sum no nearer".to_owned())
            }
            Ended::Finest { allowed, percent } => {
                let why = format!(
                    "their sum is within {percent} % of the values' range, the least that is aimed at where no error is asked for"
                );
                (allowed, why)
            }
        };
        let count = self.encoding.functions().len();
        Some(match allowed {
            Some(allowed) => {
                format!("the fit ended with {count} of {}: {why}", counted(allowed, "function"))
            }
            None => format!("the fit ended with {}: {why}", counted(count, "function")),
        })
    }

    /// What errors at the samples do not tell of the sum, a sentence each, for people.
    pub fn told_beyond_samples(&self) -> Vec<String> {
        let mut told: Vec<String> = self.told_ended().into_iter().collect();
        if !self.source.fills_box && self.source.cover.is_none() {
            told.push(
                "the sum goes on in the whole box about the source, also where that has no cells or points"
                    .to_owned(),
            );
        }
        if let Some(errors) = self.between.filter(|between| between.max > self.errors.max) {
            told.push(format!("from values between the mesh's points by straight lines: {errors}"));
        }
        if self.overshoot > self.errors.max {
            told.push(format!(
                "between samples the sum goes up to {} beyond the range of their values",
                few_digits(self.overshoot)
            ));
        }
        told
    }

    /// What `info` tells of it.
    pub fn facts(&self) -> Facts {
        Facts {
            functions: self.encoding.functions().len(),
            basis: self.encoding.basis().name(),
            max_error: self.errors.max,
            mean_error: self.errors.mean,
            rms_error: self.errors.rms,
            overshoot: self.overshoot,
            between_max_error: self.between.map(|errors| errors.max),
            between_mean_error: self.between.map(|errors| errors.mean),
            favour: self.source.favour,
            favoured_max_error: self.favoured.map(|errors| errors.max),
            favoured_mean_error: self.favoured.map(|errors| errors.mean),
            samples: self.source.samples,
            left_out: self.source.left_out,
            ended: self.ended,
            source: self.source.name.clone(),
        }
    }
}
