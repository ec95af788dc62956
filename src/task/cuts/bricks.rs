//! The bricks of a field, and what each is off by where means of its samples stand for them: what cuts are found in.

use std::collections::HashSet;
use std::sync::Arc;

use super::by_engine::Stored;
use super::candidate::{Candidate, ERRORS};
use super::why_no_cut;
use crate::core::{Cancelled, Ticket};
use crate::hierarchy::{BrickErrors, Means, MeansOfLevel, ScalarPyramidError};
use crate::kernel::{Averaged, Coefficients};
use crate::native::StoredLevels;
use crate::plan::{COARSER, EMPTY, Field, Plan};
use crate::scene::{Cell, Cells, Moving, Scene, WhyWhole};
use crate::task::engines::EngineKind;
use crate::transfer::{Cumulative, Table, TransferFunction, Weight};
use crate::volume::ScalarVolume;

/// What cuts are of.
#[derive(Debug, Clone)]
pub(super) struct Key {
    pub(super) volume: Arc<ScalarVolume>,
    pub(super) transfer: TransferFunction,
    /// Of a sample, in unit distances.
    pub(super) thickness: f64,
    /// Of isosurfaces.
    pub(super) levels: Vec<f64>,
}

/// What cuts of a field are found in; shared, so that cells can be found while a cut is drawn.
#[derive(Debug)]
pub(in crate::task) struct Bricks {
    pub(super) key: Key,
    pub(super) means: Arc<Means>,
    /// Along each axis.
    pub(super) dims: [usize; 3],
    /// Those in which anything can show.
    pub(super) shown: Vec<u32>,
    /// Of bricks drawn from means of either level.
    pub(super) errors: Vec<[f32; COARSER]>,
}

/// What comes of looking for cuts; nothing where a volume is too small.
pub(super) type Outcome = Result<Option<Found>, ScalarPyramidError>;

/// Means of 2³ and of 4³ samples, as engines have samples.
pub(super) type MeansOfLevels = [Coefficients; COARSER];

/// Cuts that were found.
#[derive(Debug)]
pub(super) struct Found {
    /// What the engine draws means from, where it has none yet.
    pub(super) levels: Option<Stored>,
    pub(super) candidates: Vec<Candidate>,
    pub(super) bricks: Bricks,
}

/// The bricks of a field as an engine knows them: how many along each axis, those in which anything can show, and those that
/// an isosurface passes, or comes near.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) dims: [usize; 3],
    pub(super) shown: Vec<u32>,
    pub(super) passed: Vec<u32>,
}

/// Of a plan's sample, in unit distances.
fn thickness(plan: &Plan) -> f64 {
    plan.frame.lattice.smallest_spacing() / plan.frame.unit_distance
}

/// Values of a plan's isosurfaces.
fn isosurfaces(plan: &Plan) -> impl Iterator<Item = f64> + '_ {
    plan.inside.isosurfaces.iter().map(|iso| iso.value)
}

impl Key {
    pub(super) fn of(plan: &Plan, Field { volume, transfer, .. }: &Field) -> Self {
        let (volume, transfer) = (Arc::clone(volume), transfer.clone());
        let levels = isosurfaces(plan).collect();
        Self { volume, transfer, thickness: thickness(plan), levels }
    }

    /// Whether it is that of a plan: asked of every quick picture, and so without a copy.
    pub(super) fn is_of(&self, plan: &Plan) -> bool {
        let is_same = |field: &Field| {
            Arc::ptr_eq(&self.volume, &field.volume) && self.transfer == field.transfer
        };
        plan.field().is_some_and(is_same)
            && self.thickness == thickness(plan)
            && isosurfaces(plan).eq(self.levels.iter().copied())
    }

    /// Finds the cuts, on whatever thread.
    pub(super) fn find(
        &self,
        means: Option<Arc<Means>>,
        stores: Option<EngineKind>,
        Known { dims, mut shown, passed }: Known,
        ticket: &Ticket,
    ) -> Outcome {
        let volume = &self.volume;
        let means = match means {
            Some(means) => means,
            None => match Means::of(volume, ticket)? {
                Some(means) => Arc::new(means),
                None => return Ok(None),
            },
        };
        let levels = match stores {
            Some(engine) => {
                let means = means_of(volume, &means, ticket)?;
                Some(Stored::new(engine, volume, means, ticket)?)
            }
            None => None,
        };
        let function = Cumulative::new(
            &self.transfer,
            volume.samples.scalar_type(),
            &volume.statistics,
            Weight::Extinction,
        );
        let function = (&function, self.thickness);
        let mut errors = BrickErrors::of(volume, &means, function, (dims, &shown), ticket)?.errors;
        // Means have their isosurfaces elsewhere. Beside these nothing else need show in a brick.
        passed.iter().for_each(|&brick| errors[brick as usize] = [f32::INFINITY; COARSER]);
        shown.extend(passed);
        shown.sort_unstable();
        shown.dedup();
        let bricks = Bricks { key: self.clone(), means, dims, shown, errors };
        let candidates = bricks.candidates(None);
        Ok(Some(Found { levels, candidates, bricks }))
    }
}

impl Bricks {
    /// The cut of an error, of what has come (see [`super::arrived::BrickSource::finest`]).
    pub(super) fn candidate(&self, max_error: f32, finest: Option<&[u8]>) -> Candidate {
        Candidate::of(max_error, self.dims, (&self.shown, &self.errors), finest)
    }

    /// Those that are compared.
    pub(super) fn candidates(&self, finest: Option<&[u8]>) -> Vec<Candidate> {
        ERRORS.map(|max_error| self.candidate(max_error, finest)).into()
    }

    /// Whether pictures of a scene may be of cuts that are found in it.
    pub(in crate::task) fn are_for(&self, scene: &Scene, size: [u32; 2]) -> bool {
        let plan = Plan::of(scene, size);
        let asks_for_others = plan.mode.cut.are_of_voxels()
            || plan.mode.cut.moving == Moving::Subsampled
            || why_no_cut(&plan).is_some();
        !asks_for_others && self.key.is_of(&plan)
    }

    /// The cells of the cut of an error, at most so many of them.
    pub(in crate::task) fn cells_within(&self, max_error: f32, most: usize) -> Cells {
        self.cells(&self.candidate(max_error, None), most)
    }

    /// The bricks of a cut as cells. They are drawn half a voxel aside: a brick begins between two samples, and a cell with a
    /// voxel.
    pub(super) fn cells(
        &self,
        Candidate { cut, max_error, waiting, .. }: &Candidate,
        most: usize,
    ) -> Cells {
        let waiting: HashSet<u32> = waiting.iter().map(|of| of.brick).collect();
        let Self { key: Key { volume, transfer, .. }, means, errors, .. } = self;
        let table = Table::new(transfer, volume.samples.scalar_type());
        let dims = volume.lattice.dims;
        let [nx, ny, _] = cut.dims;
        let bricks = cut.levels().iter().zip(errors).enumerate();
        let shown: Vec<_> = bricks.filter(|(_, (level, _))| **level != EMPTY).collect();
        let step = shown.len().div_ceil(most.max(1)).max(1);
        let cell = |&(brick, (&level, errors)): &(usize, (&u8, &[f32; COARSER]))| {
            let at = [brick % nx, brick / nx % ny, brick / (nx * ny)];
            let low = [0, 1, 2].map(|a| (at[a] * 4).min(dims[a] - 1));
            let size = [0, 1, 2].map(|a| (dims[a] - low[a]).min(4));
            let [r, g, b, extinction] = table.lookup(means.of_block(low));
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0..=65535"
            )]
            let unorm = |x: f32| (x.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16;
            #[expect(clippy::cast_possible_truncation, reason = "of a lattice that is drawn")]
            Cell {
                low: low.map(|n| n as u32),
                size: size.map(|n| n as u32),
                level,
                error: if level == 0 { 0.0 } else { errors[usize::from(level) - 1] },
                extinction,
                colour: [r, g, b].map(unorm),
                why: match level {
                    0 => WhyWhole::Samples,
                    #[expect(clippy::cast_possible_truncation, reason = "bricks have 32 bits")]
                    _ if waiting.contains(&(brick as u32)) => WhyWhole::NotCome,
                    _ => WhyWhole::ErrorSmallEnough,
                },
            }
        };
        let cells = shown.iter().step_by(step).map(cell).collect();
        Cells::from_cells(cells, shown.len() as u64, *max_error)
    }

    /// The greatest error of a brick that means stand for in any cut, and the least above 0: those between which a limit
    /// makes a difference. `None` where all are the same.
    pub(super) fn limits(&self) -> Option<[f32; 2]> {
        let errors = self.shown.iter().flat_map(|&brick| self.errors[brick as usize]);
        let errors = errors.filter(|error| *error > 0.0 && error.is_finite());
        let of = |ends: Option<[f32; 2]>, error: f32| {
            let [least, most] = ends.unwrap_or([error; 2]);
            Some([least.min(error), most.max(error)])
        };
        errors.fold(None, of)
    }
}

/// Means of a volume as the native engine takes them.
///
/// # Errors
/// Cancelled.
pub fn stored_levels(
    volume: &Arc<ScalarVolume>,
    means: &Means,
    ticket: &Ticket,
) -> Result<StoredLevels, Cancelled> {
    StoredLevels::new(volume, means_of(volume, means, ticket)?, ticket)
}

/// The same as the GPU engine does.
///
/// # Errors
/// Cancelled.
pub fn means_of(
    volume: &ScalarVolume,
    means: &Means,
    ticket: &Ticket,
) -> Result<MeansOfLevels, Cancelled> {
    let of = |level: usize| {
        let MeansOfLevel { dims, values } = &means.levels[level];
        let volume_dims = volume.lattice.dims;
        #[expect(clippy::cast_possible_truncation, reason = "0 or 1")]
        let averaged = Averaged { level: level as u32 + 1, volume_dims, half_widths: Vec::new() };
        Coefficients::of_means(*dims, values.clone(), means.bias, averaged, ticket)
    };
    Ok([of(0)?, of(1)?])
}
