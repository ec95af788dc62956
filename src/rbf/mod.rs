//! Fields as sums of a few hundred radial basis functions (Jang): s(x) = b + Σ wᵢ φ(|Sᵢ (x − cᵢ)|).
//!
//! Owns the functions, the tree in which a sum of them is evaluated, what of them is left out as it is drawn, and the encoder
//! that fits them to samples from anywhere: grids, meshes, points. All of it is in double precision. Refuses files and drawing. Imports `core`.

mod cluster;
mod encode;
mod encoding;
mod favour;
mod function;
mod limits;
mod listed;
mod neighbours;
mod points;
mod refine;
mod solve;
#[cfg(test)]
mod tests;

pub use encode::{EncodeError, Goal, Step, encode, extend, resume, reweighted};
pub use encoding::{Blend, Encoding, Errors, LIT};
pub(crate) use encoding::{few_digits, four_digits};
pub use favour::{Favour, FavourError, Region};
pub use function::{Basis, Function};
pub use limits::Limits;
pub use listed::{LeftOut, Listed};
pub use neighbours::{log_densities, log_spread, next_distance};
pub use points::Points;
