//! What a file of basis functions holds: an encoding, what it was made of, and how far it is from that.

use serde::Serialize;

use crate::rbf::{Encoding, Errors, four_digits};
use crate::volume::Lattice;

/// Functions, and what is known of them.
#[derive(Debug, Clone)]
pub struct Encoded {
    /// The functions.
    pub encoding: Encoding,
    /// How far their sum is from the samples.
    pub errors: Errors,
    /// What they were fitted to.
    pub source: Source,
    /// How far their sum goes beyond the range of the samples, in the middles between these; 0 where it stays within.
    pub overshoot: f64,
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
    /// The greatest error that was asked for, in the samples' units.
    pub wanted: f64,
    /// Where the samples lie; of what is not evenly spaced, as many over the same box.
    pub lattice: Lattice,
    /// Whether samples lie all over their box. Those of meshes, of bent grids and of points may not.
    pub fills_box: bool,
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
    /// The file that was encoded.
    pub source: String,
}

impl Encoded {
    /// What errors at the samples do not tell of the sum, a sentence each, for people.
    pub fn told_beyond_samples(&self) -> Vec<String> {
        let mut told = Vec::new();
        if !self.source.fills_box {
            told.push(
                "the sum goes on in the whole box about the source, also where that has no cells or points"
                    .to_owned(),
            );
        }
        if self.overshoot > self.errors.max {
            told.push(format!(
                "between samples the sum goes up to {} beyond the range of their values",
                four_digits(self.overshoot)
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
            source: self.source.name.clone(),
        }
    }
}
