//! Cuts of a field for quick pictures. Bricks that look alike when drawn from means of their samples are drawn from the means,
//! in slabs as thick as these are wide. The time saved goes to more pixels.
//!
//! The error of each brick is found on a thread of its own when the transfer function changes (`hierarchy::BrickErrors`).
//! No one limit on it serves all data. So a few limits are compared, each with the size of picture that it affords, and the
//! one that is thought to lose least is drawn.

use std::sync::Arc;
use std::time::Duration;

use super::draw::{DrawError, Drawer, Observer};
use super::engines::EngineKind;
use super::estimate::field_rmse;
use super::job::Job;
use super::previews::{Reduction, is_scaled};
use crate::core::{Cancelled, Ticket};
use crate::gpu::{GpuError, Renderer, draws_cut};
use crate::hierarchy::{BrickErrors, Means, MeansOfLevel, ScalarPyramidError};
use crate::kernel::{Averaged, Coefficients, Kernel};
use crate::native::StoredLevels;
use crate::plan::{COARSER, EMPTY, Field, FieldCut, Plan, SlabField};
use crate::scene::{
    AlongRay, Cell, Cells, Classify, OpacityModel, Order, Reconstruction, Visibility, WhyWhole,
};
use crate::transfer::{Cumulative, Table, TransferFunction, Weight};
use crate::volume::ScalarVolume;

/// Errors of bricks that are tried, the least first.
const ERRORS: [f32; 5] = [0.001, 0.002, 0.004, 0.008, 0.016];
/// Time that a brick of each level takes, as a share of one of the whole field: where that is B-splines, and where it is
/// tents. Looking up the level is in it. By engine: of the native one fitted to three scans (`benches/results/cuts.md`); of the GPU
/// engine a guess from what its rays fetch, 32 words a face of B-splines and 4 one of tents or means, with as much again for rays
/// that wait for those beside them: not measured on any device. What pictures take moves either (`FieldCuts::learn`).
const WORK: [[[f64; COARSER + 1]; 2]; 2] =
    [[[0.95, 0.4, 0.18], [1.05, 0.5, 0.27]], [[1.0, 0.4, 0.25], [1.05, 0.7, 0.4]]];
/// A picture's RMSE as a share of what its bricks' errors would come to if nothing hid them. A guess: not yet fitted.
const SEEN_SHARE: f64 = 0.5;
/// What is lost by leaving out pixels grows with the distance between them, as this power of it: 1.2 to 1.4 on three scans.
const SAMPLING_GROWTH: f64 = 1.35;
/// RMSE of a picture drawn twice smaller before any was seen: 36 to 53 dB on three scans.
const UNSEEN_SAMPLING: f64 = 8e-3;
/// A cut that was drawn last is kept where another one is thought to be nearer by less than this.
const WORTH_CHANGING: f64 = 0.9;
/// How far a measured picture moves what cuts are known to cost, as a share of the difference: one that took less time than
/// thought, and one that took more, for which a hand waits.
const TRUST: [f64; 2] = [0.5, 0.8];
/// Share of what was learnt that is left after each picture that is not of a cut: the machine may have been busy.
const KEPT: f64 = 0.9;
/// Cuts are never taken to need more, or less, time than thought by more than this factor.
const MOST_LONGER: f64 = 4.0;

/// The cut that a quick picture is drawn from: its number among those of [`FieldCuts`].
pub(super) type CutNumber = u8;

/// What is known of cuts of the field that is drawn.
#[derive(Debug, Default)]
pub(super) struct FieldCuts {
    means: Option<(Arc<ScalarVolume>, Arc<Means>)>,
    under_way: Option<(Key, Job<Outcome>)>,
    ready: Option<Ready>,
    /// How many times smaller the last quick picture was drawn, and what is thought to be lost for it: RMSE.
    sampling: Option<(f64, f64)>,
    /// log₂ of how many times longer cuts take than their bricks say, by [`SlabField`].
    longer: [f64; 2],
    /// Whose prices these are.
    engine: EngineKind,
}

/// What cuts are of.
#[derive(Debug, Clone)]
struct Key {
    volume: Arc<ScalarVolume>,
    transfer: TransferFunction,
    /// Of a sample, in unit distances.
    thickness: f64,
}

/// Cuts that may be drawn; none where a volume is too small, or memory is short.
#[derive(Debug)]
struct Ready {
    key: Key,
    candidates: Vec<Candidate>,
    /// Of bricks drawn from means of either level.
    errors: Vec<[f32; COARSER]>,
}

/// What comes of looking for cuts; nothing where a volume is too small.
type Outcome = Result<Option<Found>, ScalarPyramidError>;

/// Cuts that were found.
#[derive(Debug)]
struct Found {
    means: Arc<Means>,
    /// What the engine draws means from, where it has none yet.
    levels: Option<Stored>,
    candidates: Vec<Candidate>,
    errors: Vec<[f32; COARSER]>,
}

/// What an engine takes means in from.
#[derive(Debug)]
enum Stored {
    Native(StoredLevels),
    /// The GPU engine, which uploads them.
    Means([Coefficients; COARSER]),
}

/// A cut that may be drawn.
#[derive(Debug)]
struct Candidate {
    max_error: f32,
    cut: Arc<FieldCut>,
    /// Σ e² over its bricks: e the error of a brick a sample thick times the samples through it.
    squares: f64,
    /// What a ray costs, of what one of all of the field does, by engine and [`SlabField`].
    shares: [[f64; 2]; 2],
}

/// Whether quick pictures of a plan may be of cuts of its field.
fn has_cuts(plan: &Plan) -> bool {
    let mode = &plan.mode;
    let is_sharp = match mode.kernel {
        Kernel::Linear => true,
        Kernel::BSpline => mode.reconstruction == Reconstruction::Interpolating,
        _ => false,
    };
    let shading = &plan.shading;
    let is_by_value = shading.opacity.is_none()
        && shading.modulation.is_none()
        && shading.reflection.is_none()
        && shading.emission.is_none()
        && shading.painted().is_empty();
    // What kernels have in a slab is shared out among slabs of one thickness, and isosurfaces lie in the field itself.
    let is_alone = plan.kernels.is_empty() && !plan.inside.has_isosurfaces();
    mode.visibility == Visibility::Slabs
        && mode.classify == Classify::PreIntegrated
        && mode.opacity_model == OpacityModel::OpticalDepth
        && mode.order == Order::FrontToBack
        && plan.inside.along == AlongRay::Composite
        && is_sharp
        && !is_scaled(mode)
        && is_by_value
        && is_alone
}

/// Of a plan's sample, in unit distances.
fn thickness(plan: &Plan) -> f64 {
    plan.frame.lattice.smallest_spacing() / plan.frame.unit_distance
}

impl Key {
    fn of(plan: &Plan, Field { volume, transfer, .. }: &Field) -> Self {
        let (volume, transfer) = (Arc::clone(volume), transfer.clone());
        Self { volume, transfer, thickness: thickness(plan) }
    }

    /// Whether it is that of a plan: asked of every quick picture, and so without a copy.
    fn is_of(&self, plan: &Plan) -> bool {
        let is_same = |field: &Field| {
            Arc::ptr_eq(&self.volume, &field.volume) && self.transfer == field.transfer
        };
        plan.field().is_some_and(is_same) && self.thickness == thickness(plan)
    }

    /// Finds the cuts, on whatever thread.
    fn find(
        &self,
        means: Option<Arc<Means>>,
        stores: Option<EngineKind>,
        (bricks, shown): ([usize; 3], &[u32]),
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
            Some(EngineKind::Native) => {
                Some(Stored::Native(stored_levels(volume, &means, ticket)?))
            }
            Some(EngineKind::Gpu) => Some(Stored::Means(means_of(volume, &means, ticket)?)),
            None => None,
        };
        let function = Cumulative::new(
            &self.transfer,
            volume.samples.scalar_type(),
            &volume.statistics,
            Weight::Extinction,
        );
        let function = (&function, self.thickness);
        let errors = BrickErrors::of(volume, &means, function, (bricks, shown), ticket)?.errors;
        let candidates = ERRORS.map(|max_error| Candidate::of(max_error, bricks, shown, &errors));
        Ok(Some(Found { means, levels, candidates: candidates.into(), errors }))
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
) -> Result<[Coefficients; COARSER], Cancelled> {
    let of = |level: usize| {
        let MeansOfLevel { dims, values } = &means.levels[level];
        let volume_dims = volume.lattice.dims;
        #[expect(clippy::cast_possible_truncation, reason = "0 or 1")]
        let averaged = Averaged { level: level as u32 + 1, volume_dims, half_widths: Vec::new() };
        Coefficients::of_means(*dims, values.clone(), means.bias, averaged, ticket)
    };
    Ok([of(0)?, of(1)?])
}

/// The coarsest cut of `bricks` along each axis whose bricks are off by no more than an error; those that are not `shown`
/// are empty. `errors` are those of means by brick (`hierarchy::BrickErrors`).
pub fn cut_within(
    max_error: f32,
    bricks: [usize; 3],
    shown: &[u32],
    errors: &[[f32; COARSER]],
) -> FieldCut {
    let mut levels = vec![EMPTY; errors.len()];
    for &brick in shown {
        let [second, fourth] = errors[brick as usize];
        levels[brick as usize] = match () {
            () if fourth <= max_error => 2,
            () if second <= max_error => 1,
            () => 0,
        };
    }
    FieldCut::new(bricks, levels)
}

impl Candidate {
    fn of(max_error: f32, bricks: [usize; 3], shown: &[u32], errors: &[[f32; COARSER]]) -> Self {
        let cut = cut_within(max_error, bricks, shown, errors);
        let error_of = |brick: usize| match cut.levels()[brick] {
            0 => 0.0,
            level => f64::from(errors[brick][usize::from(level) - 1]),
        };
        let squares = shown.iter().map(|&brick| (4.0 * error_of(brick as usize)).powi(2)).sum();
        let counts = cut.counts().map(|n| n as f64);
        let total = counts.iter().sum::<f64>().max(1.0);
        let share = |work: [f64; COARSER + 1]| {
            counts.iter().zip(work).map(|(n, work)| n * work).sum::<f64>() / total
        };
        Self { max_error, cut: Arc::new(cut), squares, shares: WORK.map(|work| work.map(share)) }
    }
}

impl FieldCuts {
    /// Those of a plan.
    fn of(&self, plan: &Plan) -> &[Candidate] {
        match &self.ready {
            Some(ready) if ready.key.is_of(plan) => &ready.candidates,
            _ => &[],
        }
    }

    /// The cut of a number, and the greatest error of its bricks.
    pub(super) fn numbered(&self, number: CutNumber) -> Option<(&Arc<FieldCut>, f32)> {
        let found = self.candidate(number)?;
        Some((&found.cut, found.max_error))
    }

    fn candidate(&self, number: CutNumber) -> Option<&Candidate> {
        self.ready.as_ref()?.candidates.get(usize::from(number))
    }

    /// The bricks of a cut as cells, at most so many of them. They are drawn half a voxel aside: a brick begins between
    /// two samples, and a cell with a voxel.
    pub(super) fn cells(&self, number: CutNumber, most: usize) -> Option<Cells> {
        let Ready { key, errors, .. } = self.ready.as_ref()?;
        let Candidate { cut, max_error, .. } = self.candidate(number)?;
        let Key { volume, transfer, .. } = key;
        let table = Table::new(transfer, volume.samples.scalar_type());
        let dims = volume.lattice.dims;
        let means = &self.means.as_ref()?.1;
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
                why: if level == 0 { WhyWhole::Samples } else { WhyWhole::ErrorSmallEnough },
            }
        };
        let cells = shown.iter().step_by(step).map(cell).collect();
        Some(Cells::from_cells(cells, shown.len() as u64, *max_error))
    }

    /// Turns to another engine, whose prices are its own, and which has means of its own.
    pub(super) fn turn_to(&mut self, engine: EngineKind) {
        if self.engine != engine {
            *self = Self { means: self.means.take(), engine, ..Self::default() };
        }
    }

    /// What a ray through a cut costs, of what one through all of a field does.
    pub(super) fn share(&self, number: CutNumber, field: SlabField) -> f64 {
        let longer = self.longer[field as usize].exp2();
        let engine = usize::from(self.engine == EngineKind::Gpu);
        self.candidate(number).map_or(1.0, |found| found.shares[engine][field as usize] * longer)
    }

    /// Takes in a picture: of a cut of which field, if of any, and how many times longer than was thought that took. Whether
    /// cuts can be so much dearer, or cheaper: else it is the field itself that costs another price.
    pub(super) fn learn(&mut self, drawn: Option<(SlabField, f64)>) -> bool {
        let most = MOST_LONGER.log2();
        let mut is_likely = true;
        for field in [SlabField::Own, SlabField::Preview] {
            let known = &mut self.longer[field as usize];
            let found = match drawn {
                Some((of, longer)) if of == field => {
                    is_likely = (*known + longer.log2()).abs() <= most;
                    *known + TRUST[usize::from(longer > 1.0)] * longer.log2()
                }
                _ => *known * KEPT,
            };
            *known = found.clamp(-most, most);
        }
        is_likely
    }

    /// Takes in what leaving out pixels is thought to have cost a picture that was drawn so many times smaller.
    pub(super) fn note_sampling(&mut self, shrink: f64, rmse: f64) {
        if shrink > 1.0 && rmse > 0.0 {
            self.sampling = Some((shrink, rmse));
        }
    }

    /// What it is thought to cost to draw a picture so many times smaller: RMSE.
    fn sampling_rmse(&self, shrink: f64) -> f64 {
        if shrink <= 1.0 {
            return 0.0;
        }
        let (at, rmse) = self.sampling.unwrap_or((2.0, UNSEEN_SAMPLING));
        rmse * (shrink / at).powf(SAMPLING_GROWTH)
    }

    /// What a cut in the place of the whole field is thought to cost: RMSE.
    pub(super) fn cut_rmse(&self, number: CutNumber, plan: &Plan) -> f64 {
        let Some(found) = self.candidate(number) else { return 0.0 };
        let brick = 4.0 * plan.view().voxel_pixels();
        let pixels = f64::from(plan.size[0]) * f64::from(plan.size[1]);
        SEEN_SHARE * (found.squares * brick * brick / pixels.max(1.0)).sqrt()
    }
}

impl Drawer {
    /// Begins to look for cuts of a plan's field, where there are none yet, and takes in what came of it.
    ///
    /// # Errors
    /// A thread that does not start, or fails.
    pub(super) fn advance_cuts(&mut self, plan: &Plan) -> Result<(), DrawError> {
        if !self.draws_cuts(plan) {
            // A device's memory is short.
            if let Some(renderer) = self.engines.made_gpu_mut() {
                renderer.clear_levels();
            }
            return Ok(());
        }
        let Some(field) = plan.field() else { return Ok(()) };
        let holds_levels = self.holds_levels(&field.volume);
        if holds_levels && self.cuts.ready.as_ref().is_some_and(|ready| ready.key.is_of(plan)) {
            return Ok(());
        }
        // What is looked for of another transfer function is told to stop.
        drop(self.cuts.under_way.take_if(|(of, _)| !of.is_of(plan)));
        if let Some((of, job)) = self.cuts.under_way.take() {
            match job.look(Duration::ZERO)? {
                None => self.cuts.under_way = Some((of, job)),
                Some(found) => self.take_cuts(of, found)?,
            }
            return Ok(());
        }
        if !self.holds_field(SlabField::Own, &field.volume, &plan.mode) {
            return Ok(());
        }
        let shown = match self.is_native() {
            true => {
                let found = self.engines.native.shown_bricks();
                found.map(|(bricks, shown)| (bricks, shown.to_vec()))
            }
            false => {
                // What shows is of the function that is drawn now, and quick pictures may have been of the other field.
                self.prepare_field(plan, SlabField::Own, &mut ())?;
                self.engines.made_gpu().and_then(Renderer::shown_bricks)
            }
        };
        let Some((bricks, shown)) = shown else { return Ok(()) };
        let engine = self.cuts.engine;
        let stores = (!holds_levels).then_some(engine);
        drop(self.cuts.means.take_if(|(of, _)| !Arc::ptr_eq(of, &field.volume)));
        let means = self.cuts.means.as_ref().map(|(_, means)| Arc::clone(means));
        let key = Key::of(plan, field);
        let of = key.clone();
        let work = move |ticket: &Ticket| of.find(means, stores, (bricks, &shown), ticket);
        let job = Job::start(("voxsplat-cuts", "cuts of the field"), work)?;
        self.cuts.under_way = Some((key, job));
        Ok(())
    }

    /// Whether the engine that draws now draws cuts of a plan's field.
    fn draws_cuts(&self, plan: &Plan) -> bool {
        has_cuts(plan)
            && match self.is_native() {
                true => self.engines.native.draws_cuts(),
                false => draws_cut(plan),
            }
    }

    /// Whether it has the means of a volume.
    fn holds_levels(&self, volume: &Arc<ScalarVolume>) -> bool {
        match self.is_native() {
            true => self.engines.native.holds_levels(volume),
            false => self.engines.made_gpu().is_some_and(|gpu| gpu.holds_levels(volume)),
        }
    }

    /// Whether it draws cuts of a field that it has.
    fn takes_cuts(&self, field: SlabField) -> bool {
        self.is_native() || self.engines.made_gpu().is_some_and(|gpu| gpu.takes_cuts(field))
    }

    /// # Errors
    /// A failing device.
    fn take_cuts(&mut self, key: Key, found: Outcome) -> Result<(), DrawError> {
        let (candidates, errors) = match found {
            Ok(Some(Found { means, levels, candidates, errors })) => {
                self.cuts.means = Some((Arc::clone(&key.volume), means));
                let set = match levels {
                    None => Ok(()),
                    Some(Stored::Native(levels)) => {
                        self.engines.native.set_levels(levels);
                        Ok(())
                    }
                    Some(Stored::Means(means)) => {
                        let (gpu, ticket) = (self.engines.gpu()?, Ticket::new());
                        gpu.set_levels(&key.volume, &means, &ticket)
                    }
                };
                match set {
                    Ok(()) => (candidates, errors),
                    Err(error @ GpuError::TooLarge { .. }) => {
                        log::warn!("quick pictures are of all of the field: {error}");
                        Default::default()
                    }
                    Err(error) => return Err(error.into()),
                }
            }
            Ok(None) => Default::default(),
            Err(ScalarPyramidError::Cancelled(_)) => return Ok(()),
            Err(ScalarPyramidError::TooLarge(error)) => {
                log::warn!("quick pictures are of all of the field: {error}");
                Default::default()
            }
        };
        self.cuts.ready = Some(Ready { key, candidates, errors });
        Ok(())
    }

    /// Has the cuts of a plan's field at hand, unless something newer comes.
    ///
    /// # Errors
    /// Interrupted, and as [`Self::advance_cuts`].
    pub(super) fn prepare_cuts(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        self.advance_cuts(plan)?;
        let Some((key, job)) = self.cuts.under_way.take() else { return Ok(()) };
        match job.wait(&mut self.engines, observer)? {
            Some(found) => self.take_cuts(key, found),
            None => {
                self.cuts.under_way = Some((key, job));
                Err(DrawError::Interrupted)
            }
        }
    }

    /// The cut and the size of a picture of a budget that are thought to lose least: those given, of all of a field, or a
    /// cut of one of the fields that are at hand.
    pub(super) fn with_cut(&self, plan: &Plan, whole: Reduction, budget_ms: f64) -> Reduction {
        let candidates = self.cuts.of(plan);
        let has_levels = plan.field().is_some_and(|field| self.holds_levels(&field.volume));
        if candidates.is_empty() || !self.draws_cuts(plan) || !has_levels {
            return whole;
        }
        let loss = |of: &Reduction| {
            let field = field_rmse(plan, of.field);
            let cut = of.cut.map_or(0.0, |number| self.cuts.cut_rmse(number, plan));
            self.cuts.sampling_rmse(of.shrink).hypot(field).hypot(cut)
        };
        let mut best = (loss(&whole), whole);
        for field in [SlabField::Own, SlabField::Preview] {
            if !self.is_at_hand(plan, field) || !self.takes_cuts(field) {
                continue;
            }
            for number in 0..candidates.len() {
                #[expect(clippy::cast_possible_truncation, reason = "a handful")]
                let cut = Some(number as CutNumber);
                let share = self.cuts.share(number as CutNumber, field);
                let shrink = self.affordable_at(field, share, plan.size, budget_ms);
                let found = Reduction { field, shrink, cut };
                let mut lost = loss(&found);
                // What was drawn last stays where another is hardly better.
                if self.last_reduction.is_some_and(|last| (last.field, last.cut) == (field, cut)) {
                    lost *= WORTH_CHANGING;
                }
                if lost < best.0 {
                    best = (lost, found);
                }
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(errors: &[[f32; COARSER]]) -> Vec<Candidate> {
        #[expect(clippy::cast_possible_truncation, reason = "a few")]
        let shown: Vec<u32> = (0..errors.len() as u32 - 1).collect();
        let of = |most| Candidate::of(most, [errors.len(), 1, 1], &shown, errors);
        ERRORS.map(of).into()
    }

    #[test]
    fn bricks_are_drawn_from_the_coarsest_means_that_an_error_allows() {
        // The last brick does not show.
        let errors = [[0.5, 0.7], [0.003, 0.006], [0.0, 0.0005], [0.0, 0.0], [0.0, 0.0]];
        let found = candidates(&errors);
        let counts: Vec<[u64; 3]> = found.iter().map(|c| c.cut.counts()).collect();
        assert_eq!(counts, [[2, 0, 2], [2, 0, 2], [1, 1, 2], [1, 0, 3], [1, 0, 3]]);
        let squares: Vec<f64> = found.iter().map(|c| c.squares / 16.0).collect();
        let small = 0.0005_f64.powi(2);
        for (found, expected) in squares.iter().zip([0.0, 0.0, 9e-6, 36e-6, 36e-6]) {
            assert!((found - expected - small).abs() < 1e-9, "{found} {expected}");
        }
        // Coarser ones cost less.
        for pair in found.windows(2) {
            assert!(
                pair[1]
                    .shares
                    .as_flattened()
                    .iter()
                    .zip(pair[0].shares.as_flattened())
                    .all(|(b, a)| b <= a)
            );
        }
        assert!(found[4].shares[0][0] < 0.5 * WORK[0][0][0]);
        assert!(found[4].shares[1][0] > found[4].shares[0][0], "each engine has its own");
    }

    #[test]
    fn a_cut_that_took_long_is_dearer_and_is_tried_again_after_others() {
        let mut cuts = FieldCuts::default();
        let longer = |cuts: &FieldCuts| cuts.longer[SlabField::Own as usize].exp2();
        assert!(cuts.learn(Some((SlabField::Own, 4.0))));
        assert!((longer(&cuts).log2() - 1.6).abs() < 1e-12, "most of the way");
        assert!(cuts.learn(Some((SlabField::Own, 1.2))), "as dear as cuts may be");
        for _ in 0..9 {
            assert!(!cuts.learn(Some((SlabField::Own, 4.0))), "the field is dearer");
        }
        assert!((longer(&cuts) - MOST_LONGER).abs() < 1e-12, "no more than that");
        assert_eq!(cuts.longer[SlabField::Preview as usize], 0.0);
        for _ in 0..20 {
            cuts.learn(None);
        }
        assert!(longer(&cuts) < 1.2, "{}", longer(&cuts));
    }

    #[test]
    fn what_leaving_out_pixels_costs_grows_from_what_was_seen_last() {
        let mut cuts = FieldCuts::default();
        assert_eq!(cuts.sampling_rmse(1.0), 0.0);
        assert_eq!(cuts.sampling_rmse(2.0), UNSEEN_SAMPLING);
        cuts.note_sampling(1.5, 0.02);
        cuts.note_sampling(1.0, 0.5);
        assert_eq!(cuts.sampling_rmse(1.5), 0.02, "a picture of every pixel says nothing of it");
        assert!(cuts.sampling_rmse(3.0) > 2.0 * 0.02 && cuts.sampling_rmse(3.0) < 4.0 * 0.02);
    }
}
