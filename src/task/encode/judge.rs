//! What a fit is held against: the errors and the bytes that were asked for, and an earlier fit.

use std::cell::Cell;
use std::ops::ControlFlow;

use glam::DVec3;

use super::{FINEST_PERCENT, FieldError};
use crate::core::{Cancelled, Ticket};
use crate::io::vrbf::{self, Precision};
use crate::io::{Encoded, Ended, Source};
use crate::rbf::{
    Encoding, Errors, Goal, Points, Step, encode, extend, few_digits, resume, reweighted,
};

/// Where the goal is not reached, rounding may make errors so many times as large.
const MOST_BY_ROUNDING: f64 = 1.01;

/// The errors that a file tells of its functions, and those found again, are the same up to this part of them: another build
/// may sum up in another order.
const SAME_ERROR: f64 = 0.01;
/// Where they are but rounding: this part of the samples' range.
const ROUNDING: f64 = 1e-9;
/// The same of the boxes' corners, as a part of their diagonal.
const SAME_PLACE: f64 = 1e-6;

/// How often a fit that is not near enough goes on, at most, and how much nearer than that it aims.
const NEARER: usize = 6;
const ENOUGH: f64 = 0.98;
/// How often a fit goes on to fill a file, at most.
const FILLINGS: usize = 6;
/// It is full where less than one part in so many is free.
const UNFILLED: u64 = 50;
/// The size of a number with as many letters as any.
const LONGEST_OVERSHOOT: f64 = 1.234_567_890_123_456_7e-300;
/// The same of a number that is told to four digits.
const LONGEST_OF_FOUR: f64 = 1.234e-300;

/// What sums are held against.
pub(super) struct Judge<'a> {
    pub(super) points: &'a Points,
    /// And fitted to: the same, and of meshes places between them.
    pub(super) fitted_to: &'a Points,
    pub(super) goal: Goal,
    /// That were asked for, where the goal has fewer for the bytes that there are.
    pub(super) most_functions: usize,
    /// Of each point, where some are.
    pub(super) favoured: Option<Vec<bool>>,
    pub(super) source: Source,
    /// Whether it is known what lies between its points.
    pub(super) is_mesh: bool,
    /// Whether who is told of its rounds broke the fit off.
    pub(super) is_broken_off: Cell<bool>,
    pub(super) ticket: &'a Ticket,
}

impl Judge<'_> {
    /// Functions that aim at a goal by rounds that are `told`, or the `earlier` ones gone on from, of samples of a range.
    pub(super) fn fitted(
        &self,
        (aim, range): (Goal, f64),
        earlier: Option<&Encoded>,
        mut told: impl FnMut(Step) -> ControlFlow<()>,
    ) -> Result<Encoded, FieldError> {
        let is_ended = &self.is_broken_off;
        let mut told = |step: Step| {
            let flow = told(step);
            is_ended.set(is_ended.get() || flow.is_break());
            flow
        };
        let Some(earlier) = earlier else {
            let found = encode(self.fitted_to, aim, self.ticket, &mut told)?;
            let rounded = self.rounded(&found, f64::INFINITY)?;
            let rounded = rounded.ok_or_else(|| self.no_room(&found))?;
            return if is_ended.get() {
                Ok(rounded)
            } else {
                self.filled(aim, (found, rounded), f64::INFINITY, told)
            };
        };
        check_place(earlier, &self.source, self.points.bounds())?;
        let before = self.measured(earlier.encoding.clone())?;
        check_errors(earlier, before.errors, range)?;
        let is_there = earlier.encoding.basis() == self.goal.basis
            && self.goal.is_met(&before.errors)
            && self.fits(&before)?;
        if is_there {
            return Ok(before);
        }
        let found = resume(self.fitted_to, &earlier.encoding, aim, self.ticket, &mut told)?;
        // What was written once is written again; rounding may take back what little was gained.
        let is_as_it_was =
            found.functions() == earlier.encoding.functions() && self.fits(&before)?;
        if !is_as_it_was && let Some(rounded) = self.rounded(&found, before.errors.max)? {
            return if is_ended.get() {
                Ok(rounded)
            } else {
                self.filled(aim, (found, rounded), before.errors.max, told)
            };
        }
        match self.fits(&before)? {
            true => Ok(before),
            false => Err(self.no_room(&earlier.encoding)),
        }
    }

    /// Goes on from a fit, and what a file holds of it, as long as the bytes that were asked for have room for more functions.
    /// How long a file is shows when it is written: numbers have as many digits as they need, and what is deflated is shorter.
    /// Where no greatest error was asked for it may grow as it is filled, but not above `most`: few functions more seldom make the
    /// worst sample better, and a file that waits for that stays empty.
    fn filled(
        &self,
        aim: Goal,
        (mut found, mut best): (Encoding, Encoded),
        most_error: f64,
        mut told: impl FnMut(Step) -> ControlFlow<()>,
    ) -> Result<Encoded, FieldError> {
        let Some(most) = self.source.wanted_bytes else {
            return self.reached(aim, (found, best), told);
        };
        let minds = self.source.wanted.is_some();
        // So many are too many.
        let mut beyond = self.most_functions.saturating_add(1);
        for _ in 0..FILLINGS {
            let (count, free) = (found.functions().len(), most.saturating_sub(self.bytes(&best)?));
            let room = free / vrbf::bytes_a_function(self.goal.basis);
            let room = usize::try_from(room).unwrap_or(usize::MAX);
            let more = room.min(beyond.saturating_sub(count + 1));
            if more == 0 || free * UNFILLED < most || self.goal.is_met(&best.errors) {
                break;
            }
            let aim = Goal { functions: count + more, ..aim };
            let further = self.further(&found, (aim, minds), &mut told)?;
            let Some((next, is_ended)) = further else { break };
            match self.rounded(&next, if minds { best.errors.max } else { most_error })? {
                Some(rounded) if minds || rank(&rounded) < rank(&best) => {
                    (found, best) = (next, rounded);
                }
                Some(_) => break,
                None => beyond = next.functions().len(),
            }
            if is_ended {
                break;
            }
        }
        Ok(best)
    }

    /// Goes on from a fit that has come as near as it aimed, where what a file holds of it is not as near as asked for: it is held
    /// against the samples alone, after rounding, and fitted to places between those of meshes, too.
    fn reached(
        &self,
        mut aim: Goal,
        (mut found, mut best): (Encoding, Encoded),
        mut told: impl FnMut(Step) -> ControlFlow<()>,
    ) -> Result<Encoded, FieldError> {
        for _ in 0..NEARER {
            let has_room = found.functions().len() < aim.functions;
            let is_reached = self.goal.is_met(&best.errors);
            if is_reached || !has_room || !aim.is_met(&found.errors(self.fitted_to, self.ticket)?) {
                break;
            }
            let share =
                |goal: f64, error: f64| if error > goal { ENOUGH * goal / error } else { 1.0 };
            aim.max_error *= share(self.goal.max_error, best.errors.max);
            aim.mean_error *= share(self.goal.mean_error, best.errors.mean);
            let further = self.further(&found, (aim, true), &mut told)?;
            let Some((next, is_ended)) = further else { break };
            // Who asks for a mean does not mind one sample.
            let minds = self.goal.max_error.is_finite();
            let most = if minds { best.errors.max } else { f64::INFINITY };
            match self.rounded(&next, most)? {
                Some(rounded) => (found, best) = (next, rounded),
                None => break,
            }
            if is_ended {
                break;
            }
        }
        Ok(best)
    }

    /// A fit that a fit becomes by functions added, and whether who is told ended it; `None` where none were. Its greatest error
    /// is no greater than it was where that `minds`.
    fn further(
        &self,
        found: &Encoding,
        (aim, minds): (Goal, bool),
        told: &mut impl FnMut(Step) -> ControlFlow<()>,
    ) -> Result<Option<(Encoding, bool)>, FieldError> {
        let mut is_ended = false;
        let told = |step: Step| {
            let flow = told(step);
            is_ended |= flow.is_break();
            flow
        };
        let next = match minds {
            true => resume(self.fitted_to, found, aim, self.ticket, told)?,
            false => extend(self.fitted_to, found, aim, self.ticket, told)?,
        };
        Ok((next.functions() != found.functions()).then_some((next, is_ended)))
    }

    /// With the errors of all samples, and of those that are favoured.
    fn measured(&self, encoding: Encoding) -> Result<Encoded, Cancelled> {
        let left = encoding.differences(self.points, self.ticket)?;
        let favoured = self.favoured.as_ref().map(|favoured| {
            let own = left.iter().zip(favoured).filter(|(_, is_favoured)| **is_favoured);
            Errors::of(&own.map(|(left, _)| *left).collect::<Vec<_>>())
        });
        let errors = Errors::of(&left);
        let source = self.source.clone();
        Ok(Encoded {
            encoding,
            errors,
            favoured,
            source,
            overshoot: 0.0,
            between: None,
            ended: None,
        })
    }

    /// Why a fit that nobody broke off has fewer functions than were allowed; `None` where it has as many, is as near as
    /// asked for, or where there is no room for more in the bytes that were asked for.
    pub(super) fn ended(&self, fit: &Encoded) -> Result<Option<Ended>, FieldError> {
        if fit.encoding.functions().len() >= self.most_functions {
            return Ok(None);
        }
        let allowed = (self.most_functions < usize::MAX).then_some(self.most_functions);
        let is_asked = self.source.wanted.is_some() || self.source.wanted_mean.is_some();
        let ended = match (self.goal.is_met(&fit.errors), is_asked) {
            (true, true) => return Ok(None),
            (true, false) => Ended::Finest { allowed, percent: FINEST_PERCENT },
            (false, _) => Ended::NoNearer { allowed },
        };
        let Some(most) = self.source.wanted_bytes else { return Ok(Some(ended)) };
        // What is told of it takes bytes, too.
        let told = self.bytes(&Encoded { ended: Some(ended), ..fit.clone() })?;
        let free = most.saturating_sub(told);
        let has_room = free >= vrbf::bytes_a_function(self.goal.basis) && free * UNFILLED >= most;
        Ok(has_room.then_some(ended))
    }

    /// Whether a file of them is as short as asked for.
    fn fits(&self, encoded: &Encoded) -> Result<bool, FieldError> {
        let Some(most) = self.source.wanted_bytes else { return Ok(true) };
        Ok(self.bytes(encoded)? <= most)
    }

    /// Of a file of them, at most: how far the sum goes beyond, and is off between points, is found last, and may have the most
    /// letters.
    fn bytes(&self, encoded: &Encoded) -> Result<u64, FieldError> {
        let of_four = Errors { max: LONGEST_OF_FOUR, mean: LONGEST_OF_FOUR, rms: LONGEST_OF_FOUR };
        let between = self.is_mesh.then_some(of_four);
        let longest = Encoded { overshoot: LONGEST_OVERSHOOT, between, ..encoded.clone() };
        Ok(vrbf::bytes(&longest).map_err(FieldError::Unwritable)?.len() as u64)
    }

    /// What is said where the shortest file of some functions is too long.
    fn no_room(&self, encoding: &Encoding) -> FieldError {
        let found = self.source.wanted_bytes.unwrap_or_default();
        let functions = encoding.functions().len();
        let shortest = self.measured(vrbf::rounded(encoding, Precision::Bits16));
        match shortest.map_err(FieldError::from).and_then(|shortest| self.bytes(&shortest)) {
            Ok(least) => FieldError::TooFewBytes { least, functions, found },
            Err(error) => error,
        }
    }

    /// The same functions as a file holds them: by the fewest digits that keep the goal reached, or where it is not, that add
    /// little to the errors; else by those that come nearest. Weights are found anew for centres and widths as they are then.
    /// `None` where the file would be longer than asked for, or the greatest error above `most`.
    fn rounded(&self, found: &Encoding, most: f64) -> Result<Option<Encoded>, FieldError> {
        let exact = self.measured(found.clone())?;
        let is_met = self.goal.is_met(&exact.errors);
        let is_kept = |own: &Errors, exact: &Errors| {
            own.max <= MOST_BY_ROUNDING * exact.max && own.rms <= MOST_BY_ROUNDING * exact.rms
        };
        let is_enough = |own: &Encoded| {
            let favoured = own.favoured.zip(exact.favoured);
            let is_as_asked_for = match is_met {
                true => self.goal.is_met(&own.errors),
                false => is_kept(&own.errors, &exact.errors),
            };
            is_as_asked_for && favoured.is_none_or(|(own, exact)| is_kept(&own, &exact))
        };
        let order = |own: &Encoded| (!is_enough(own), rank(own));
        let mut best: Option<Encoded> = None;
        for precision in Precision::ALL {
            let first = vrbf::rounded(found, precision);
            let second = vrbf::rounded(&reweighted(self.fitted_to, &first)?, precision);
            for encoding in [first, second] {
                let encoded = self.measured(encoding)?;
                let may_be = encoded.errors.max <= most && self.fits(&encoded)?;
                if may_be && best.as_ref().is_none_or(|best| order(&encoded) < order(best)) {
                    best = Some(encoded);
                }
            }
            if best.as_ref().is_some_and(is_enough) {
                break;
            }
        }
        Ok(best)
    }
}

/// How far a fit is from the samples that count more, or from all.
fn rank(fit: &Encoded) -> f64 {
    fit.favoured.unwrap_or(fit.errors).rms
}

/// Whether an earlier fit was made of as many samples, in the same box.
fn check_place(earlier: &Encoded, source: &Source, bounds: [DVec3; 2]) -> Result<(), FieldError> {
    let own = earlier.encoding.bounds();
    let far = SAME_PLACE * (bounds[1] - bounds[0]).length();
    let is_there = own.iter().zip(&bounds).all(|(a, b)| a.distance(*b) <= far);
    let counts = |source: &Source| (source.samples, source.left_out);
    if is_there && counts(&earlier.source) == counts(source) {
        return Ok(());
    }
    Err(FieldError::OtherSamples {
        expected: format!("{} {}", described(source), between(bounds)),
        found: format!("{} {}", described(&earlier.source), between(own)),
    })
}

/// Whether an earlier fit is as far from the samples as it was from those that it was made of. `range` is that of the values.
fn check_errors(earlier: &Encoded, found: Errors, range: f64) -> Result<(), FieldError> {
    let told = earlier.errors;
    let is_same =
        |a: f64, b: f64| (a - b).abs() <= SAME_ERROR * a.max(b) + ROUNDING * range.max(0.0);
    if is_same(told.max, found.max) && is_same(told.rms, found.rms) {
        return Ok(());
    }
    Err(FieldError::OtherValues { told, found, whose: described(&earlier.source) })
}

/// `8000 samples of density in scan.nrrd`.
fn described(source: &Source) -> String {
    let left_out = match source.left_out {
        0 => String::new(),
        count => format!(" and {count} that are not finite"),
    };
    format!("{} samples{left_out} of {} in {}", source.samples, source.field, source.name)
}

/// `between (0, 0, 0) and (19, 19, 19)`, the corners of a box.
fn between([low, high]: [DVec3; 2]) -> String {
    let corner = |at: DVec3| at.to_array().map(few_digits).join(", ");
    format!("between ({}) and ({})", corner(low), corner(high))
}
