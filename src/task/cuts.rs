//! Cuts of a field for quick pictures. Bricks that look alike when drawn from means of their samples are drawn from the means,
//! in slabs as thick as these are wide. The time saved goes to more pixels.
//!
//! The error of each brick is found on a thread of its own when the transfer function changes (`hierarchy::BrickErrors`).
//! No one limit on it serves all data. So a few limits are compared, each with the size of picture that it affords, and the
//! one that is thought to lose least is drawn.

mod arrived;
mod by_engine;
mod measured;

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use super::draw::{CutLevels, DrawError, Drawer, Observer, Rung, background_light};
use super::engines::{Canvas, EngineKind};
use super::estimate::Coarseness;
use super::job::Job;
use super::previews::{Reduction, is_scaled};
use super::still::{enlarged, widened};
use crate::accuracy;
use crate::core::{Cancelled, Ticket};
use crate::gpu::GpuError;
use crate::hierarchy::{BrickErrors, Means, MeansOfLevel, ScalarPyramidError};
use crate::kernel::{Averaged, Coefficients, Kernel};
use crate::native::StoredLevels;
use crate::plan::{COARSER, EMPTY, Field, FieldCut, Plan, SlabField};
use crate::scene::{
    AlongRay, Cell, Cells, Classify, Colours, Index, Moving, OpacityModel, Reconstruction, Scene,
    Visibility, WhyWhole,
};
use crate::transfer::{Cumulative, Table, TransferFunction, Weight};
use crate::volume::ScalarVolume;
use arrived::Arrived;
pub use arrived::{BrickSource, InMemory, Wanted};
use by_engine::Stored;
use measured::Measured;

/// Errors of bricks that are tried, the least first.
const ERRORS: [f32; 5] = [0.001, 0.002, 0.004, 0.008, 0.016];
/// Time that a brick of each level takes, as a share of one of the whole field: where that is B-splines, and where it is
/// tents. Looking up the level is in it. By engine: of the native one fitted to three scans (`benches/results/cuts.md`); of the GPU
/// engine fitted to shells and two scans on an H200 (`benches/results/gpu-NVIDIA-H200--vulkan-.md`), where a third scan, of thin
/// vessels, gains a tenth at most; its tents are a guess. What pictures take moves either (`FieldCuts::learn`).
const WORK: [[[f64; COARSER + 1]; 2]; 2] =
    [[[0.95, 0.4, 0.18], [1.05, 0.5, 0.27]], [[1.0, 0.7, 0.35], [1.05, 0.9, 0.6]]];
/// A picture's RMSE as a share of what its bricks' errors would come to if nothing hid them, until it is found in the picture
/// (`measured`): it differs from scan to scan, and the least errors add up along rays, so that this alone is 20 dB too good to 12
/// too bad (`benches/results/cuts.md`).
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
/// That of the cut of an error that somebody asked for.
const ASKED: CutNumber = CutNumber::MAX;

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
    /// Which bricks there are.
    arrived: Arrived,
    /// What pictures of cuts were found to be off by.
    measured: Option<Measured>,
}

/// What cuts are of.
#[derive(Debug, Clone)]
struct Key {
    volume: Arc<ScalarVolume>,
    transfer: TransferFunction,
    /// Of a sample, in unit distances.
    thickness: f64,
    /// Of isosurfaces.
    levels: Vec<f64>,
}

/// Cuts that may be drawn; none where a volume is too small, or memory is short.
#[derive(Debug)]
struct Ready {
    key: Key,
    candidates: Vec<Candidate>,
    /// The cut of an error that somebody asked for.
    asked: Option<Candidate>,
    bricks: Option<Arc<Bricks>>,
}

/// What cuts of a field are found in; shared, so that cells can be found while a cut is drawn.
#[derive(Debug)]
pub(super) struct Bricks {
    key: Key,
    means: Arc<Means>,
    /// Along each axis.
    dims: [usize; 3],
    /// Those in which anything can show.
    shown: Vec<u32>,
    /// Of bricks drawn from means of either level.
    errors: Vec<[f32; COARSER]>,
}

/// What comes of looking for cuts; nothing where a volume is too small.
type Outcome = Result<Option<Found>, ScalarPyramidError>;
/// Means of 2³ and of 4³ samples, as engines have samples.
type MeansOfLevels = [Coefficients; COARSER];

/// Cuts that were found.
#[derive(Debug)]
struct Found {
    /// What the engine draws means from, where it has none yet.
    levels: Option<Stored>,
    candidates: Vec<Candidate>,
    bricks: Bricks,
}

/// The bricks of a field as an engine knows them: how many along each axis, those in which anything can show, and those that
/// an isosurface passes, or comes near.
#[derive(Debug)]
struct Known {
    dims: [usize; 3],
    shown: Vec<u32>,
    passed: Vec<u32>,
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
    /// Bricks that are coarser than they should be, those with the greatest errors first: theirs have not come.
    waiting: Vec<Wanted>,
}

/// Why pictures of a plan are never of cuts of its field, in words that follow "there is no cut: "; `None`
/// where they may be.
///
/// A cut is of values, and classified after they are reconstructed. What is right beside any such field is right beside a cut:
/// lights, clips, slices, isosurfaces (bricks that one passes are drawn from the samples), polygons. Left out is what
/// depends on how thick slabs are, what no mean can tell, and what the errors of bricks know nothing of.
pub fn why_no_cut(plan: &Plan) -> Option<&'static str> {
    let (mode, shading) = (&plan.mode, &plan.shading);
    let is_of_strength = |index: Option<Index>| index == Some(Index::GradientStrength);
    let colours = |of: &Option<Colours>| is_of_strength(of.as_ref().map(|of| of.index));
    let reasons = [
        (plan.field().is_none(), "no field of values is shown"),
        (
            mode.visibility != Visibility::Slabs || mode.classify == Classify::Before,
            "samples are classified before they are reconstructed, and a cut is of values",
        ),
        (
            !matches!(mode.kernel, Kernel::Linear | Kernel::BSpline),
            "only fields of linear kernels and of B-splines have one",
        ),
        (
            mode.kernel == Kernel::BSpline && mode.reconstruction != Reconstruction::Interpolating,
            "the field is smoothed, and means are of the samples as they are",
        ),
        (is_scaled(mode), "its kernels are wider or narrower than natural"),
        (
            mode.classify != Classify::PreIntegrated,
            "one value stands for each slab, so that thicker ones would be another picture",
        ),
        (
            mode.opacity_model != OpacityModel::OpticalDepth,
            "published opacities do not add up to those of thicker slabs",
        ),
        (
            plan.inside.along != AlongRay::Composite,
            "a projection looks for single values, which means do not keep",
        ),
        (
            // What kernels have in a slab is shared out among slabs of one thickness.
            !plan.kernels.is_empty(),
            "vectors are composited in slabs of one thickness",
        ),
        (
            shading.opacity.is_some() || !shading.painted().is_empty(),
            "opacities are by gradient or by a table of their own, and the errors of its nodes are of the transfer function",
        ),
        (
            is_of_strength(shading.modulation.as_ref().map(|of| of.index))
                || colours(&shading.reflection)
                || colours(&shading.emission),
            "a table is by gradient strength, which means make smaller",
        ),
    ];
    reasons.into_iter().find_map(|(is_so, why)| is_so.then_some(why))
}

/// The same of the plan of a scene, whatever its size.
pub fn why_no_cut_of(scene: &Scene) -> Option<&'static str> {
    why_no_cut(&Plan::of(scene, [1, 1]))
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
    fn of(plan: &Plan, Field { volume, transfer, .. }: &Field) -> Self {
        let (volume, transfer) = (Arc::clone(volume), transfer.clone());
        let levels = isosurfaces(plan).collect();
        Self { volume, transfer, thickness: thickness(plan), levels }
    }

    /// Whether it is that of a plan: asked of every quick picture, and so without a copy.
    fn is_of(&self, plan: &Plan) -> bool {
        let is_same = |field: &Field| {
            Arc::ptr_eq(&self.volume, &field.volume) && self.transfer == field.transfer
        };
        plan.field().is_some_and(is_same)
            && self.thickness == thickness(plan)
            && isosurfaces(plan).eq(self.levels.iter().copied())
    }

    /// Finds the cuts, on whatever thread.
    fn find(
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
    /// The cut of an error, of what has come (see [`BrickSource::finest`]).
    fn candidate(&self, max_error: f32, finest: Option<&[u8]>) -> Candidate {
        Candidate::of(max_error, self.dims, (&self.shown, &self.errors), finest)
    }

    /// Those that are compared.
    fn candidates(&self, finest: Option<&[u8]>) -> Vec<Candidate> {
        ERRORS.map(|max_error| self.candidate(max_error, finest)).into()
    }

    /// Whether pictures of a scene may be of cuts that are found in it.
    pub(super) fn are_for(&self, scene: &Scene, size: [u32; 2]) -> bool {
        let plan = Plan::of(scene, size);
        let asks_for_others = plan.mode.cut.are_of_voxels()
            || plan.mode.cut.moving == Moving::Subsampled
            || why_no_cut(&plan).is_some();
        !asks_for_others && self.key.is_of(&plan)
    }

    /// The cells of the cut of an error, at most so many of them.
    pub(super) fn cells_within(&self, max_error: f32, most: usize) -> Cells {
        self.cells(&self.candidate(max_error, None), most)
    }

    /// The bricks of a cut as cells. They are drawn half a voxel aside: a brick begins between two samples, and a cell with a
    /// voxel.
    fn cells(&self, Candidate { cut, max_error, waiting, .. }: &Candidate, most: usize) -> Cells {
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
    fn limits(&self) -> Option<[f32; 2]> {
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

/// The coarsest cut of `bricks` along each axis whose bricks are off by no more than an error; those that are not `shown`
/// are empty. `errors` are those of means by brick (`hierarchy::BrickErrors`).
pub fn cut_within(
    max_error: f32,
    bricks: [usize; 3],
    shown: &[u32],
    errors: &[[f32; COARSER]],
) -> FieldCut {
    FieldCut::new(bricks, levels_within(max_error, shown, errors))
}

/// Its levels.
fn levels_within(max_error: f32, shown: &[u32], errors: &[[f32; COARSER]]) -> Vec<u8> {
    let mut levels = vec![EMPTY; errors.len()];
    for &brick in shown {
        let [second, fourth] = errors[brick as usize];
        levels[brick as usize] = match () {
            () if fourth <= max_error => 2,
            () if second <= max_error => 1,
            () => 0,
        };
    }
    levels
}

impl Candidate {
    fn of(
        max_error: f32,
        bricks: [usize; 3],
        (shown, errors): (&[u32], &[[f32; COARSER]]),
        finest: Option<&[u8]>,
    ) -> Self {
        let mut levels = levels_within(max_error, shown, errors);
        let mut waiting = arrived::of_what_came(&mut levels, finest);
        // Of bricks of which nothing has come, and of those that no mean stands for, nobody knows more than that.
        let worst = match waiting.is_empty() {
            true => 0.0,
            false => {
                let all = shown.iter().flat_map(|&brick| errors[brick as usize]);
                all.filter(|error| error.is_finite()).fold(0.0, f32::max)
            }
        };
        let error_of = |brick: usize| {
            let of_means = |level: u8| errors[brick].get(usize::from(level) - 1);
            match levels[brick] {
                0 => 0.0,
                level => of_means(level).copied().filter(|e| e.is_finite()).unwrap_or(worst),
            }
        };
        let squares =
            shown.iter().map(|&brick| (4.0 * f64::from(error_of(brick as usize))).powi(2)).sum();
        waiting.sort_by(|a, b| error_of(b.brick as usize).total_cmp(&error_of(a.brick as usize)));
        let cut = FieldCut::new(bricks, levels);
        let counts = cut.counts().map(|n| n as f64);
        let total = counts.iter().sum::<f64>().max(1.0);
        let share = |work: [f64; COARSER + 1]| {
            counts.iter().zip(work).map(|(n, work)| n * work).sum::<f64>() / total
        };
        let shares = WORK.map(|work| work.map(share));
        Self { max_error, cut: Arc::new(cut), squares, shares, waiting }
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

    /// The cut of a number, and what is known of it before a plan.
    pub(super) fn numbered(&self, number: CutNumber) -> Option<(Arc<FieldCut>, CutLevels)> {
        let Candidate { cut, max_error, waiting, .. } = self.candidate(number)?;
        let (max_error, bricks, waiting) = (*max_error, cut.counts(), waiting.len() as u64);
        Some((Arc::clone(cut), CutLevels { max_error, rmse: 0.0, bricks, waiting }))
    }

    /// Takes in what has come since the last time: cuts are found anew of it.
    fn take_arrived(&mut self) {
        if self.arrived.look() {
            self.find_again();
        }
    }

    /// Finds cuts of what has come.
    fn find_again(&mut self) {
        let finest = self.arrived.finest();
        if let Some(Ready { candidates, asked, bricks: Some(bricks), .. }) = &mut self.ready {
            *candidates = bricks.candidates(finest);
            *asked = asked.take().map(|asked| bricks.candidate(asked.max_error, finest));
        }
    }

    /// Says what a picture of a cut lacked.
    pub(super) fn tell_missing(&self, number: CutNumber) {
        if let Some(found) = self.candidate(number) {
            self.arrived.want(&found.waiting);
        }
    }

    fn candidate(&self, number: CutNumber) -> Option<&Candidate> {
        let ready = self.ready.as_ref()?;
        if number == ASKED {
            return ready.asked.as_ref();
        }
        ready.candidates.get(usize::from(number))
    }

    /// The bricks of a cut as cells, at most so many of them.
    pub(super) fn cells(&self, number: CutNumber, most: usize) -> Option<Cells> {
        Some(self.bricks()?.cells(self.candidate(number)?, most))
    }

    /// What cuts are found in.
    pub(super) fn bricks(&self) -> Option<&Arc<Bricks>> {
        self.ready.as_ref()?.bricks.as_ref()
    }

    /// Finds the cut of a plan's field whose bricks are off by no more than an error.
    pub(super) fn ask(&mut self, plan: &Plan, max_error: f32) -> Option<CutNumber> {
        self.take_arrived();
        let ready = self.ready.as_mut().filter(|ready| ready.key.is_of(plan))?;
        if ready.asked.as_ref().is_none_or(|asked| asked.max_error != max_error) {
            ready.asked = Some(ready.bricks.as_ref()?.candidate(max_error, self.arrived.finest()));
        }
        Some(ASKED)
    }

    /// Turns to another engine, whose prices are its own, and which has means of its own.
    pub(super) fn turn_to(&mut self, engine: EngineKind) {
        if self.engine != engine {
            let (means, arrived) = (self.means.take(), std::mem::take(&mut self.arrived));
            *self = Self { means, engine, arrived, ..Self::default() };
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
}

impl Drawer {
    /// From now on bricks of fields come from a source; without one all are there.
    pub fn take_bricks_from(&mut self, source: Arc<dyn BrickSource>) {
        self.cuts.arrived = Arrived::from(source);
        self.cuts.take_arrived();
    }

    /// Begins to look for cuts of a plan's field, where there are none yet, and takes in what came of it.
    ///
    /// # Errors
    /// A thread that does not start, or fails; a failing device.
    pub(super) fn advance_cuts(&mut self, plan: &Plan) -> Result<(), DrawError> {
        if !self.may_cut(plan) {
            return Ok(());
        }
        let Some(field) = plan.field() else { return Ok(()) };
        let holds_levels = self.holds_levels(&field.volume);
        let is_known =
            |ready: &Ready| ready.key.is_of(plan) && (holds_levels || ready.candidates.is_empty());
        if self.cuts.ready.as_ref().is_some_and(is_known) {
            self.cuts.take_arrived();
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
        let holds_field = self.holds_field(SlabField::Own, &field.volume, &plan.mode);
        if !holds_field || !self.has_room_for_means(SlabField::Own) {
            return Ok(());
        }
        let key = Key::of(plan, field);
        let Some(known) = self.known_bricks(plan, &key.levels)? else { return Ok(()) };
        let stores = (!holds_levels).then_some(self.cuts.engine);
        drop(self.cuts.means.take_if(|(of, _)| !Arc::ptr_eq(of, &field.volume)));
        let means = self.cuts.means.as_ref().map(|(_, means)| Arc::clone(means));
        let of = key.clone();
        let work = move |ticket: &Ticket| of.find(means, stores, known, ticket);
        let job = Job::start(("voxsplat-cuts", "cuts of the field"), work)?;
        self.cuts.under_way = Some((key, job));
        Ok(())
    }

    /// # Errors
    /// A failing device.
    fn take_cuts(&mut self, key: Key, found: Outcome) -> Result<(), DrawError> {
        let (candidates, bricks) = match found {
            Ok(Some(Found { levels, candidates, bricks })) => {
                self.cuts.means = Some((Arc::clone(&key.volume), Arc::clone(&bricks.means)));
                match levels.map_or(Ok(()), |levels| self.take_levels(&key.volume, levels)) {
                    Ok(()) => (candidates, Some(Arc::new(bricks))),
                    Err(DrawError::Gpu(error @ GpuError::TooLarge { .. })) => {
                        log::warn!("quick pictures are of all of the field: {error}");
                        Default::default()
                    }
                    Err(error) => return Err(error),
                }
            }
            Ok(None) => Default::default(),
            Err(ScalarPyramidError::Cancelled(_)) => return Ok(()),
            Err(ScalarPyramidError::TooLarge(error)) => {
                log::warn!("quick pictures are of all of the field: {error}");
                Default::default()
            }
        };
        self.cuts.ready = Some(Ready { key, candidates, asked: None, bricks });
        self.cuts.arrived.look();
        if self.cuts.arrived.finest().is_some() {
            self.cuts.find_again();
        }
        Ok(())
    }

    /// Has a plan's field and the cuts of it at hand, as quick pictures do by and by; and the one of an error.
    ///
    /// # Errors
    /// As of any picture.
    pub fn find_cut(
        &mut self,
        plan: &Plan,
        max_error: f32,
    ) -> Result<Option<Arc<FieldCut>>, DrawError> {
        self.prepare_field(plan, SlabField::Own, &mut ())?;
        self.prepare_cuts(plan, &mut ())?;
        let number = self.cuts.ask(plan, max_error);
        Ok(number.and_then(|number| self.cuts.numbered(number)).map(|(cut, _)| cut))
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

    /// Whether cuts of a plan's field are at hand.
    pub(super) fn has_cuts(&self, plan: &Plan) -> bool {
        self.may_cut(plan)
            && self.has_room_for_means(SlabField::Own)
            && plan.field().is_some_and(|field| self.holds_levels(&field.volume))
            && !self.cuts.of(plan).is_empty()
    }

    /// Whether cuts of a plan's field are being looked for, and are not there yet.
    pub(super) fn awaits_cuts(&self, plan: &Plan) -> bool {
        self.cuts.under_way.as_ref().is_some_and(|(key, _)| key.is_of(plan))
            && plan.mode.cut.moving != Moving::Subsampled
    }

    /// Why quick pictures of a plan are not of cuts of its field though these were asked for; `None` where they are, or nobody
    /// did.
    pub(super) fn why_not_octree(&self, plan: &Plan) -> Option<&'static str> {
        if plan.mode.cut.moving != Moving::Octree || self.has_cuts(plan) {
            return None;
        }
        let has_none = || match () {
            () if let Some(why) = self.why_engine_has_none(plan) => why,
            () if self.cuts.ready.as_ref().is_some_and(|ready| ready.key.is_of(plan)) => {
                "the volume is too small for means, or memory for them is short"
            }
            () => "its nodes are still being looked at",
        };
        Some(why_no_cut(plan).unwrap_or_else(has_none))
    }

    /// Limits on the errors of bricks between which cuts of a plan's field differ: the least, and the most.
    pub(super) fn cut_limits_of(&self, plan: &Plan) -> Option<[f32; 2]> {
        self.cuts.bricks().filter(|_| self.has_cuts(plan))?.limits()
    }

    /// What a quick picture is thought to lose: RMSE.
    pub(super) fn thought_rmse(&self, plan: &Plan, of: &Reduction) -> f64 {
        self.cuts.sampling_rmse(of.shrink).hypot(self.cuts.stand_in_rmse(plan, of.field, of.cut))
    }

    /// The cut and the size of a picture of a budget that are thought to lose least: those given, of all of a field, or a
    /// cut of one of the fields that are at hand. Where people chose one of both, that one.
    pub(super) fn with_cut(&self, plan: &Plan, whole: Reduction, budget_ms: f64) -> Reduction {
        let moving = plan.mode.cut.moving;
        if moving == Moving::Subsampled || !self.has_cuts(plan) {
            return whole;
        }
        let of_whole = match moving {
            Moving::Octree => f64::INFINITY,
            _ => self.thought_rmse(plan, &whole),
        };
        let mut best = (of_whole, whole);
        for field in [SlabField::Own, SlabField::Preview] {
            if !self.is_at_hand(plan, field) || !self.has_room_for_means(field) {
                continue;
            }
            // All of a field as well, where what it loses was measured: in light more than fewer pixels do.
            let is_told = moving != Moving::Octree && self.cuts.measured.is_some();
            let numbers = (0..).take(self.cuts.of(plan).len()).map(Some);
            for cut in is_told.then_some(None).into_iter().chain(numbers) {
                let share = cut.map_or(1.0, |number| self.cuts.share(number, field));
                let shrink = self.affordable_at(field, share, plan.size, budget_ms);
                let found = Reduction { field, shrink, cut };
                let mut lost = self.thought_rmse(plan, &found);
                // What was drawn last stays where another is hardly better.
                if self.last_reduction.is_some_and(|l| (l.field, l.cut) == (field, found.cut)) {
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

/// A quick picture that might have been drawn within a time; for measurements of what the choice is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    /// Of which field.
    pub field: SlabField,
    /// The greatest error of its bricks; `None` where it is of all of the field.
    pub max_error: Option<f32>,
    /// Pixels.
    pub size: [u32; 2],
    /// What it was thought to be off by, and was: RMSE in linear light.
    pub rmse: [f64; 2],
    /// Whether it is the one that a moving view would have shown.
    pub is_chosen: bool,
}

impl Drawer {
    /// Draws every quick picture of a plan that is compared for a budget, each of the size that it is thought to afford.
    /// `full` is the finished one, premultiplied linear light.
    ///
    /// # Errors
    /// As of any picture.
    pub fn try_cuts(
        &mut self,
        plan: &Plan,
        budget_ms: f64,
        full: &[[f64; 4]],
    ) -> Result<Vec<Tried>, DrawError> {
        self.prepare_field(plan, SlabField::Own, &mut ())?;
        self.prepare_preview_field(plan, &mut ())?;
        self.prepare_cuts(plan, &mut ())?;
        self.measure_stand_ins(plan, &mut ())?;
        let rung = Rung::Coarse { budget_ms };
        // What leaving out pixels costs is learnt from pictures, as it is from those of a hand.
        for _ in 0..3 {
            let drawn = self.draw(plan, rung, &mut ())?;
            let shrink = f64::from(plan.size[1]) / f64::from(drawn.size[1]);
            let shown = self.engines.present(background_light(plan.background))?;
            if let Some(Coarseness::Reduced { sampling_rmse, .. }) =
                Coarseness::of(plan, rung, &drawn, shrink, &shown)
            {
                let known = self.known_rmse(plan, &drawn)?;
                self.note_sampling(shrink, &drawn, (known, sampling_rmse));
            }
        }
        let chosen = self.reduction(plan, budget_ms);
        let (costs, longer, last) = (self.costs, self.cuts.longer, self.last_reduction);
        let mut found = Vec::new();
        for field in [SlabField::Own, SlabField::Preview] {
            if !self.is_at_hand(plan, field) {
                continue;
            }
            let has_room = self.has_room_for_means(field);
            let cuts = if has_room { self.cuts.of(plan).len() } else { 0 };
            let numbers = (0..).take(cuts).map(Some);
            for cut in std::iter::once(None).chain(numbers) {
                let share = cut.map_or(1.0, |number| self.cuts.share(number, field));
                let shrink = self.affordable_at(field, share, plan.size, budget_ms);
                let tried = Reduction { field, shrink, cut };
                let thought_rmse = self.thought_rmse(plan, &tried);
                let drawn = self.draw_reduced(plan, tried, &mut ())?;
                let light = enlarged(self.engines.read_light()?, drawn.size, plan.size);
                let rmse = accuracy::rmse(&widened(&light), full).map_err(|error| {
                    GpuError::Device(format!("two pictures of one size: {error}"))
                })?;
                // The next one is to be fitted by the same prices.
                (self.costs, self.cuts.longer, self.last_reduction) = (costs, longer, last);
                found.push(Tried {
                    field,
                    max_error: drawn.cut.map(|cut| cut.max_error),
                    size: drawn.size,
                    rmse: [thought_rmse, rmse],
                    is_chosen: chosen.is_some_and(|c| (c.field, c.cut) == (field, cut)),
                });
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates(errors: &[[f32; COARSER]]) -> Vec<Candidate> {
        #[expect(clippy::cast_possible_truncation, reason = "a few")]
        let shown: Vec<u32> = (0..errors.len() as u32 - 1).collect();
        let of = |most| Candidate::of(most, [errors.len(), 1, 1], (&shown, errors), None);
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
