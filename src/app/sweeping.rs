//! The accuracy panel's real measurer: the engine's sweep on a device of its own, so that the
//! picture on screen is never kept waiting.

use std::sync::Arc;

use super::measuring::{ChartPoint, Measurer, StartMeasuring, Stepped};
use super::modes;
use super::sentences::without_flags;
use crate::accuracy::sweep::{Detail, Point, Setting};
use crate::core::Ticket;
use crate::task::engine::{Choice, Engine};
use crate::task::sweep::{MakeTruth, Step, Sweep, SweepError, SweepOptions};

/// Pixels compared with the exact picture: a confidence interval of a few tenths of a dB, soon.
const PIXELS: usize = 1000;
/// A mode's frames are not repeated once they have taken this long together, milliseconds.
const REPEAT_WITHIN_MS: f64 = 1000.0;

/// Sweeps drawn by `choice`, held to the truth that `make_truth` makes.
pub fn engine_measurer(choice: Choice, make_truth: MakeTruth) -> StartMeasuring {
    Arc::new(move |scene, size| {
        let options = SweepOptions {
            pixels: PIXELS,
            repeat_within_ms: REPEAT_WITHIN_MS,
            // The sampled pixels say it sooner.
            whole_picture: false,
            ..SweepOptions::new(scene)
        };
        let sweep = Sweep::new(scene.clone(), size, options, make_truth);
        Box::new(EngineSweep { choice: choice.clone(), engine: None, sweep })
    })
}

struct EngineSweep {
    choice: Choice,
    /// Started on the job's thread.
    engine: Option<Engine>,
    sweep: Sweep,
}

impl Measurer for EngineSweep {
    fn step(&mut self, ticket: &Ticket) -> Stepped {
        let engine = self.engine.get_or_insert_with(|| Engine::start(self.choice.clone(), || ()));
        match self.sweep.step(engine, ticket) {
            Err(SweepError::Cancelled) => Stepped::Stopped,
            Err(error) => Stepped::Failed(without_flags(&error.to_string())),
            Ok(()) if self.sweep.next_step() == Step::Done => Stepped::Done,
            Ok(()) => Stepped::More,
        }
    }

    fn points(&self) -> Vec<ChartPoint> {
        let front = self.sweep.front();
        let points = self.sweep.points().iter().enumerate();
        points.map(|(index, point)| chart_point(point, front.contains(&index))).collect()
    }

    fn fraction(&self) -> f32 {
        self.sweep.fraction()
    }
}

fn chart_point(point: &Point, on_front: bool) -> ChartPoint {
    let Setting { splat, detail, scale, .. } = &point.setting;
    let is_mode = *detail == Detail::Full && *scale == 1.0;
    let (ms, db, ci, failed) = match &point.outcome {
        Ok(found) => {
            // NaN: how sure it is, is not known.
            let ci =
                found.sampled.psnr_interval_db.map_or(f64::NAN, |[low, high]| (high - low) / 2.0);
            (found.median_ms(), found.sampled.psnr_db, ci, None)
        }
        Err(reason) => (0.0, 0.0, 0.0, Some(without_flags(reason))),
    };
    ChartPoint {
        name: name(&point.setting),
        ms,
        db,
        ci,
        settings: is_mode.then_some(*splat),
        on_front,
        failed,
    }
}

/// What a setting is called in the window.
fn name(setting: &Setting) -> String {
    let mode = modes::name(&setting.splat);
    let what = match setting.detail {
        Detail::Full => mode,
        Detail::Octree { max_error } => format!("Octree error {max_error}, {mode}"),
    };
    if setting.scale == 1.0 {
        what
    } else {
        format!("{what}, at {:.0} % of the size", setting.scale * 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SplatSettings;

    #[test]
    fn only_whole_modes_can_be_chosen_and_failures_are_told() {
        let whole = Setting::full(SplatSettings::EXACT);
        let failed = Point { setting: whole.clone(), outcome: Err("no device".into()) };
        let point = chart_point(&failed, false);
        assert_eq!(point.settings, Some(SplatSettings::EXACT));
        assert_eq!(point.failed.as_deref(), Some("no device"));
        for setting in [
            Setting { scale: 0.5, ..whole.clone() },
            Setting { detail: Detail::Octree { max_error: 0.1 }, ..whole.clone() },
        ] {
            let point = chart_point(&Point { setting: setting.clone(), ..failed.clone() }, false);
            assert_eq!(point.settings, None, "{setting:?}");
            assert_ne!(point.name, name(&whole));
        }
    }
}
