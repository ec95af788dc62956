//! What is drawn in the place of samples: basis functions, or cells.

use fearless_simd::{Simd, prelude::*};

use super::along_solids::AlongSolids;
use super::functions::Functions;
use super::landed::Landed;
use super::lanes::{Lanes, Mask, Vec3, all, choose};
use super::rays::{Packet, Rays};
use super::seen::{self, Landing};
use super::solids::Solids;
use super::sums::{Asked, Sums};
use super::supports::NotBegun;
use crate::core::{Cancelled, Ticket};
use crate::kernel::{Bounds, Kernel};
use crate::rbf::Limits;
use crate::volume::ScalarVolume;

/// What a field is of.
#[derive(Debug)]
pub(super) enum Own {
    Functions(Box<Functions>),
    Cells(Box<Solids>),
}

/// Where it lands in a picture.
#[derive(Debug)]
pub(super) enum OwnLanded {
    Functions(Landing),
    /// Solids, and outer faces.
    Cells([Landed; 2]),
}

/// The same along eight rays.
pub(super) enum OwnAlong<'a, S: Simd> {
    Functions(Sums<'a, S>),
    Cells(AlongSolids<'a, S>),
}

/// What lies at the face of a slab.
#[derive(Clone, Copy)]
pub(super) struct Found<S: Simd> {
    pub value: Lanes<S>,
    /// Of the value per index, where it came with it.
    pub growth: Option<Vec3<S>>,
    /// Of cells and means, in the slab behind the face: the nearest and the farthest place where the ray passes their border,
    /// and the values there.
    pub border: [Lanes<S>; 4],
    /// Of cells that are lit, the growths there.
    pub border_growths: Option<[Vec3<S>; 2]>,
}

impl<S: Simd> Found<S> {
    /// A value, and nothing else.
    #[inline(always)]
    pub(super) fn of(simd: S, value: Lanes<S>) -> Self {
        Self { value, growth: None, border: no_border(simd), border_growths: None }
    }
}

/// Takes a border to a place that some rays pass, and the value there, where it lies beyond what is known; of which rays its
/// nearest and its farthest place were moved.
#[inline(always)]
pub(super) fn widen_border<S: Simd>(
    border: &mut [Lanes<S>; 4],
    here: Mask<S>,
    (t, value): (Lanes<S>, Lanes<S>),
) -> [Mask<S>; 2] {
    let [nearest, farthest, near_value, far_value] = *border;
    let is_nearer = here & t.simd_lt(nearest);
    let is_farther = here & t.simd_gt(farthest);
    *border = [
        choose(is_nearer, t, nearest),
        choose(is_farther, t, farthest),
        choose(is_nearer, value, near_value),
        choose(is_farther, value, far_value),
    ];
    [is_nearer, is_farther]
}

/// The border of what has none.
#[inline(always)]
pub(super) fn no_border<S: Simd>(simd: S) -> [Lanes<S>; 4] {
    [all(simd, 1e30), all(simd, -1e30), all(simd, 0.0), all(simd, 0.0)]
}

impl Own {
    /// What a kernel asks for of a volume, if it does, less what is left out; values are less `bias`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn of(
        volume: &ScalarVolume,
        (kernel, limits): (Kernel, &Limits),
        bias: f64,
        ticket: &Ticket,
    ) -> Result<Option<Self>, Cancelled> {
        if let Some(encoding) = kernel.functions_of(volume, ticket)? {
            let found = Functions::new(&encoding, limits, &volume.lattice, ticket)?;
            return Ok(Some(Self::Functions(Box::new(found))));
        }
        Ok(match &volume.cells {
            Some(field) if kernel == Kernel::Cells => {
                let found = Solids::new(field, &volume.lattice, bias, ticket)?;
                Some(Self::Cells(Box::new(found)))
            }
            _ => None,
        })
    }

    /// Takes bounds of samples to what lies between these.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn bound(
        &self,
        bounds: &mut Bounds,
        bias: f64,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        match self {
            Self::Functions(functions) => functions.bound(bounds, ticket),
            Self::Cells(cells) => cells.bound(bounds, bias, ticket),
        }
    }

    /// Whether it lands on the tiles of a picture: what cells of functions leave out is found place by place.
    pub(super) fn lands(&self) -> bool {
        match self {
            Self::Functions(functions) => !functions.is_limited(),
            Self::Cells(_) => true,
        }
    }

    /// Where it lands in a picture that asks for something of its slabs.
    ///
    /// # Errors
    /// More than lists have room for, and a cancelled ticket.
    pub(super) fn land(
        &self,
        (rays, asked): (&Rays, Asked),
        ticket: &Ticket,
    ) -> Result<OwnLanded, NotBegun> {
        Ok(match self {
            Self::Functions(functions) => {
                OwnLanded::Functions(seen::landed(functions, rays, ticket)?)
            }
            Self::Cells(cells) => OwnLanded::Cells(cells.land((rays, asked), ticket)?),
        })
    }

    /// The values at places.
    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        match self {
            Self::Functions(functions) => functions.value(simd, place),
            Self::Cells(cells) => cells.value(simd, place),
        }
    }

    /// The values' growth per index at places.
    #[inline(always)]
    pub(super) fn gradient<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        match self {
            Self::Functions(functions) => functions.gradient(simd, place),
            Self::Cells(cells) => cells.gradient(simd, place),
        }
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> usize {
        match self {
            Self::Functions(functions) => functions.size_bytes(),
            Self::Cells(cells) => cells.size_bytes(),
        }
    }
}

impl OwnLanded {
    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        match self {
            Self::Functions(landed) => landed.size_bytes(),
            Self::Cells(landed) => landed.iter().map(Landed::size_bytes).sum(),
        }
    }
}

impl<S: Simd> OwnAlong<'_, S> {
    /// What lies at face `k`; see [`Sums::at`] and [`AlongSolids::at`].
    #[inline(always)]
    pub(super) fn at(
        &mut self,
        simd: S,
        packet: &Packet<S>,
        which: (i32, i32, i32),
        t: Lanes<S>,
    ) -> Found<S> {
        match self {
            Self::Functions(sums) => sums.at(simd, packet, which, t),
            Self::Cells(cells) => cells.at(simd, packet, which, t),
        }
    }
}
