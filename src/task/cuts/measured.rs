//! What stands in for a field in quick pictures, a cut of it or the other field, costs a picture: found at some of its pixels.
//!
//! Errors of bricks say how cuts compare, and not what is seen of them. That differs from scan to scan and from limit to limit by
//! 20 dB, so it is measured: a small picture of each beside one of all of the field. From these on, what is thought of another
//! view or transfer function follows the errors of bricks.

use super::candidate::Candidate;
use super::{CutNumber, FieldCuts};
use crate::core::enlarge::{Taps, held};
use crate::core::{LinearRgb, Projection};
use crate::plan::{Plan, SlabField, Way};
use crate::task::draw::{DrawError, Drawer, Drawn, Observer};
use crate::task::estimate::field_rmse;
use crate::task::previews::{Reduction, is_of_few_cells};
use crate::task::remaining::Every;

/// Pixels of each picture, at most about: an eightieth of a window's. Of 2000, what only edges lose was missed.
const PIXELS: f64 = 20_480.0;
/// Cosine of the angle by which a view turns before it is looked at again.
const SAME_VIEW: f64 = 0.87;
/// Of a picture's square error, the least that says what part of it is.
const LEAST_REST: f64 = 0.2;
/// A pixel is covered where it hides so much of what lies behind.
const COVERED: f32 = 1.0 / 255.0;

/// A picture's RMSE as a share of what its bricks' errors would come to if nothing hid them, until it is found in the picture
/// (`measured`): it differs from scan to scan, and the least errors add up along rays, so that this alone is 20 dB too good to 12
/// too bad (`benches/results/cuts.md`).
const SEEN_SHARE: f64 = 0.5;

/// What was found in a view.
#[derive(Debug)]
pub(super) struct Measured {
    plan: Plan,
    /// By [`SlabField`]: RMSE of all of it, then of each cut; nothing where it was not at hand.
    rmse: [Vec<f64>; 2],
    /// By cut, what its bricks' errors come to.
    of_bricks: Vec<f64>,
    /// Share of the picture on which anything shows.
    covered: f64,
    /// Which of its pixels were drawn, and their light, premultiplied.
    exact: (Every, Vec<[f32; 4]>),
}

/// Root of the share of a plan's picture that a brick covers.
fn spread(plan: &Plan) -> f64 {
    let pixels = f64::from(plan.size[0]) * f64::from(plan.size[1]);
    4.0 * plan.view().voxel_pixels() / pixels.max(1.0).sqrt()
}

fn of_bricks(candidate: &Candidate) -> f64 {
    candidate.squares.sqrt()
}

impl Measured {
    /// Whether it holds for a plan's picture, but for where that is seen from by a little.
    fn is_of(&self, plan: &Plan, cuts: usize) -> bool {
        let own = &self.plan;
        let [a, b] = [own, plan].map(|plan| &plan.camera);
        let is_parallel = |of: Projection| matches!(of, Projection::Orthographic);
        let moved = Plan {
            camera: own.camera,
            size: own.size,
            enlarged: own.enlarged,
            way: own.way,
            left_out: own.left_out.clone(),
            ..plan.clone()
        };
        self.of_bricks.len() == cuts
            && a.direction.dot(b.direction) > SAME_VIEW
            && is_parallel(a.projection) == is_parallel(b.projection)
            && moved == *own
    }

    /// What a picture of a size is off by that is to be enlarged, where it is of the very view that was looked at: RMSE over what
    /// lies behind. `None` too where pixels are means of what triangles cover.
    fn rmse_of(&self, plan: &Plan, light: &[[f32; 4]], size: [u32; 2]) -> Option<f64> {
        let pixels = size[0] as usize * size[1] as usize;
        if *plan != self.plan || !plan.surfaces.is_empty() || light.len() != pixels || pixels == 0 {
            return None;
        }
        let (every, exact) = &self.exact;
        let taps = |axis: usize| Taps::all(size[axis] as usize, plan.size[axis] as usize);
        let (columns, rows) = (taps(0), taps(1));
        let (width, row) = (plan.size[0] as usize, size[0] as usize);
        let shown = every.indices().map(|at| {
            let (across, down) = (columns[at % width], rows[at / width]);
            let along = |y: usize| across.sum(across.at.map(|x| light[y * row + x]));
            held(down.sum(down.at.map(along)))
        });
        let shown: Vec<[f32; 4]> = shown.collect();
        Some(off(&shown, exact, behind(plan)))
    }

    /// How much larger errors are in a plan's picture for being seen nearer; no picture is more than covered.
    fn nearer(&self, plan: &Plan) -> f64 {
        let most = if self.covered > 0.0 { self.covered.sqrt().recip() } else { f64::INFINITY };
        (spread(plan) / spread(&self.plan)).min(most)
    }

    /// The cut among those found whose limit is nearest.
    fn index(&self, number: CutNumber, max_error: f32, limits: impl Iterator<Item = f32>) -> usize {
        if usize::from(number) < self.of_bricks.len() {
            return usize::from(number);
        }
        let off = |limit: f32| (limit / max_error.max(f32::MIN_POSITIVE)).ln().abs();
        let nearest = limits.map(off).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.map_or(0, |(index, _)| index)
    }

    /// What it is thought to cost a plan's picture to be of a field, or of a cut of it: RMSE. `None` of what was not at hand.
    fn rmse(&self, plan: &Plan, field: SlabField, cut: Option<(usize, f64)>) -> Option<f64> {
        let found = &self.rmse[field as usize];
        let nearer = self.nearer(plan);
        let Some((index, of_bricks)) = cut else { return Some(found.first()? * nearer) };
        let then = *self.of_bricks.get(index)?;
        if then <= 0.0 {
            return None;
        }
        let grown = of_bricks / then;
        let own = *self.rmse[SlabField::Own as usize].get(index + 1)?;
        let rmse = match field {
            SlabField::Own => own * grown,
            SlabField::Preview => {
                let (whole, of_cut) = (*found.first()?, *found.get(index + 1)?);
                let both = whole.hypot(own);
                if both > 0.0 { of_cut * whole.hypot(own * grown) / both } else { of_cut }
            }
        };
        Some(rmse * nearer)
    }
}

impl FieldCuts {
    /// What it is thought to cost a plan's picture to be of a field, or of a cut of it, in the place of all of its own: RMSE.
    pub(in crate::task) fn stand_in_rmse(
        &self,
        plan: &Plan,
        field: SlabField,
        cut: Option<CutNumber>,
    ) -> f64 {
        let is_of_samples = |of: &&Measured| of.plan.has_same_samples(plan);
        let measured = self.measured.as_ref().filter(is_of_samples);
        let found = cut.and_then(|number| Some((number, self.candidate(number)?)));
        let index = |of: &Measured, (number, cut): (CutNumber, &Candidate)| {
            let limits = self.ready.iter().flat_map(|ready| &ready.candidates);
            let limits = limits.map(|cut| cut.max_error);
            (of.index(number, cut.max_error, limits), of_bricks(cut))
        };
        let known = |of: &Measured| of.rmse(plan, field, found.map(|found| index(of, found)));
        measured.and_then(known).unwrap_or_else(|| {
            let of_field = measured.and_then(|of| of.rmse(plan, field, None));
            let of_cut = found.map_or(0.0, |(_, cut)| SEEN_SHARE * of_bricks(cut) * spread(plan));
            of_field.unwrap_or_else(|| field_rmse(plan, field)).hypot(of_cut)
        })
    }
}

impl Drawer {
    /// Finds what a plan's quick pictures lose by what they are of, where that is not known yet: by as many small pictures as
    /// there are things that they may be of. The engine's picture is another one afterwards.
    ///
    /// # Errors
    /// Interrupted by the observer, or the device.
    pub(in crate::task) fn measure_stand_ins(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let may_tell = plan.way == Way::Slabs
            && plan.kernels.is_empty()
            && plan.field().is_some()
            && !is_of_few_cells(plan)
            && self.is_at_hand(plan, SlabField::Own);
        let cuts = if self.has_cuts(plan) { self.cuts.of(plan).len() } else { 0 };
        if !may_tell {
            return Ok(());
        }
        if self.cuts.measured.as_ref().is_some_and(|of| of.is_of(plan, cuts)) {
            return Ok(());
        }
        let (longer, keeps, kept) = (self.cuts.longer, self.keeps_cut, self.kept_bricks);
        self.keeps_cut = false;
        let found = self.aside(|drawer| drawer.measured(plan, cuts, observer));
        (self.cuts.longer, self.keeps_cut, self.kept_bricks) = (longer, keeps, kept);
        match found {
            Ok(found) => self.cuts.measured = Some(found),
            Err(DrawError::Interrupted) => return Err(DrawError::Interrupted),
            // Quick pictures are there all the same.
            Err(error) if error.is_refusal() => {
                log::warn!("what quick pictures are off by was not found: {error}");
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// What the quick picture that was drawn last, of a size, is off by against the finished one, where some pixels of that are known
    /// (see [`Self::measure_stand_ins`]).
    ///
    /// # Errors
    /// The device.
    pub(in crate::task) fn known_rmse(
        &mut self,
        plan: &Plan,
        drawn: &Drawn,
    ) -> Result<Option<f64>, DrawError> {
        let is_known = self.cuts.measured.as_ref().is_some_and(|of| of.plan == *plan);
        if !is_known || !drawn.is_reduced {
            return Ok(None);
        }
        let light = self.engines.read_light()?;
        Ok(self.cuts.measured.as_ref().and_then(|of| of.rmse_of(plan, &light, drawn.size)))
    }

    /// Takes in what leaving out pixels cost the quick picture that was drawn last: by what it is known to be off by, and what it is
    /// of, or else by what was estimated.
    pub(in crate::task) fn note_sampling(
        &mut self,
        shrink: f64,
        drawn: &Drawn,
        (known, estimated): (Option<f64>, f64),
    ) {
        let of_stand_in = drawn.field_rmse.hypot(drawn.cut.map_or(0.0, |cut| cut.rmse));
        // Where nearly all of it is what the picture is of, the rest is lost among it.
        let rest = |rmse: f64| {
            let square = rmse * rmse - of_stand_in * of_stand_in;
            (square > LEAST_REST * rmse * rmse).then(|| square.sqrt())
        };
        self.cuts.note_sampling(shrink, known.and_then(rest).unwrap_or(estimated));
    }

    fn measured(
        &mut self,
        plan: &Plan,
        cuts: usize,
        observer: &mut dyn Observer,
    ) -> Result<Measured, DrawError> {
        let every = Every::of(plan.size, PIXELS);
        let seen = Plan { camera: every.camera(plan), ..plan.clone() };
        let seen = seen.at_size(every.small, f64::from(every.step));
        let behind = behind(plan);
        let mut light = |drawer: &mut Self, field, cut| {
            drawer.draw_reduced(&seen, Reduction { field, shrink: 1.0, cut }, observer)?;
            Ok::<_, DrawError>(drawer.engines.read_light()?)
        };
        let exact = light(self, SlabField::Own, None)?;
        let mut rmse = [vec![0.0], Vec::new()];
        for field in [SlabField::Own, SlabField::Preview] {
            let found = &mut rmse[field as usize];
            if !self.is_at_hand(plan, field) {
                continue;
            }
            if field == SlabField::Preview {
                found.push(off(&light(self, field, None)?, &exact, behind));
            }
            let cuts = if self.has_room_for_means(field) { cuts } else { 0 };
            for number in (0..).take(cuts) {
                found.push(off(&light(self, field, Some(number))?, &exact, behind));
            }
        }
        let covered = exact.iter().filter(|pixel| pixel[3] > COVERED).count();
        let of_bricks = self.cuts.of(plan).iter().take(cuts).map(of_bricks).collect();
        let covered = covered as f64 / exact.len().max(1) as f64;
        let exact = (every, exact);
        Ok(Measured { plan: plan.clone(), rmse, of_bricks, covered, exact })
    }
}

fn behind(plan: &Plan) -> LinearRgb {
    plan.background.light().unwrap_or_default()
}

/// RMSE between two pictures over RGB, linear light, over what lies behind them.
fn off(found: &[[f32; 4]], exact: &[[f32; 4]], LinearRgb(behind): LinearRgb) -> f64 {
    let square = |(a, b): (&[f32; 4], &[f32; 4])| {
        let clearer = f64::from(b[3] - a[3]);
        let off = [0, 1, 2].map(|c| f64::from(a[c] - b[c]) + clearer * behind[c]);
        off.iter().map(|off| off * off).sum::<f64>()
    };
    let squares: f64 = found.iter().zip(exact).map(square).sum();
    (squares / (3.0 * exact.len().max(1) as f64)).sqrt()
}
