//! What each effect of a full picture costs and changes: the picture drawn with it and without.

use serde::Serialize;

use super::draw::{Drawer, Observer, Rung};
use super::still::{StillError, widened};
use crate::accuracy::Difference;
use crate::accuracy::sweep::median;
use crate::core::Ticket;
use crate::gpu::GpuError;
use crate::plan::Plan;
use crate::scene::{Effect, Scene};

/// Pictures of each kind, as far as time allows: of one alone nobody knows by how much its time varies.
pub const ROUNDS: usize = 3;
/// Milliseconds after which a still begins no further round.
const ROUNDS_MS: f64 = 10_000.0;

/// How much longer pictures with something take than pictures without.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AddedTime {
    /// Between the medians, wall milliseconds.
    pub ms: f64,
    /// Between the quickest with it and the slowest without.
    pub least_ms: f64,
    /// Between the slowest with it and the quickest without.
    pub most_ms: f64,
    /// Pictures of each kind.
    pub pictures: usize,
}

impl AddedTime {
    /// Of wall milliseconds of each kind; `None` where there are none of one.
    pub fn of(with_ms: &[f64], without_ms: &[f64]) -> Option<Self> {
        let [with, without] = [sorted(with_ms)?, sorted(without_ms)?];
        Some(Self {
            ms: median(&with) - median(&without),
            least_ms: with[0] - without[without.len() - 1],
            most_ms: with[with.len() - 1] - without[0],
            pictures: with.len().min(without.len()),
        })
    }

    /// Whether pictures vary by as much as it takes: it may take nothing.
    pub fn is_within_noise(&self) -> bool {
        self.least_ms <= 0.0 && self.most_ms >= 0.0
    }
}

fn sorted(values: &[f64]) -> Option<Vec<f64>> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    (!sorted.is_empty()).then_some(sorted)
}

/// What leaving an effect out of a full picture changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// It.
    pub effect: Effect,
    /// How much longer the picture takes with it, once every pipeline is there.
    pub added: AddedTime,
    /// How many more bytes the device holds with it; fewer where what it takes the place of takes more.
    pub bytes: i64,
    /// Root mean square of the change over pixels and RGB, linear light.
    pub rmse: f64,
    /// What its mean brightness is greater by without it, linear light.
    pub mean_brightness: f64,
}

/// Draws a full picture, whose light is given, once more and more without each of its effects in turn.
pub(super) fn left_out(
    drawer: &mut Drawer,
    scene: &Scene,
    (size, light): ([u32; 2], &[[f32; 4]]),
    watch: &mut dyn Observer,
    ticket: &Ticket,
) -> Result<Vec<LeftOut>, StillError> {
    let parts = Effect::ALL.iter().filter(|effect| **effect != Effect::Shading);
    let others: Vec<_> =
        parts.filter_map(|effect| Some((*effect, effect.left_out_of(scene)?))).collect();
    if others.is_empty() {
        return Ok(Vec::new());
    }
    let full = widened(light);
    let mut with = Vec::new();
    let mut without = vec![Vec::new(); others.len()];
    let mut found = Vec::new();
    let start = std::time::Instant::now();
    for round in 0..ROUNDS {
        if round > 0 && start.elapsed().as_secs_f64() * 1e3 > ROUNDS_MS {
            break;
        }
        with.push(full_ms(drawer, scene, size, watch, ticket)?);
        // Read as the others are below, since reading takes a buffer.
        drawer.engines.read_light()?;
        let held = drawer.engines.held().all;
        for (index, (effect, other)) in others.iter().enumerate() {
            without[index].push(full_ms(drawer, other, size, watch, ticket)?);
            if round == 0 {
                let light = widened(&drawer.engines.read_light()?);
                let difference = Difference::between(&light, &full).map_err(|error| {
                    GpuError::Device(format!("two pictures of one size: {error}"))
                })?;
                let bytes = held as i64 - drawer.engines.held().all as i64;
                found.push((*effect, bytes, difference));
            }
        }
    }
    let rows =
        found.into_iter().zip(&without).filter_map(|((effect, bytes, difference), without)| {
            let Difference { rmse, mean_brightness, .. } = difference;
            Some(LeftOut {
                effect,
                added: AddedTime::of(&with, without)?,
                bytes,
                rmse,
                mean_brightness,
            })
        });
    Ok(rows.collect())
}

/// What a full picture takes once every pipeline is there.
fn full_ms(
    drawer: &mut Drawer,
    scene: &Scene,
    size: [u32; 2],
    watch: &mut dyn Observer,
    ticket: &Ticket,
) -> Result<f64, StillError> {
    let plan = Plan::of(scene, size);
    drawer.prepare(&plan, ticket)?;
    let drawn = drawer.draw(&plan, Rung::Full, watch)?;
    match drawn.made_pipelines {
        true => Ok(drawer.draw(&plan, Rung::Full, watch)?.wall_ms),
        false => Ok(drawn.wall_ms),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn added_time_is_between_medians_and_its_range_between_extremes() {
        let added = AddedTime::of(&[30.0, 10.0, 20.0], &[5.0, 4.0, 12.0, 6.0]).unwrap();
        assert_eq!(added, AddedTime { ms: 14.5, least_ms: -2.0, most_ms: 26.0, pictures: 3 });
        assert!(added.is_within_noise());
        assert!(!AddedTime::of(&[30.0], &[12.0]).unwrap().is_within_noise());
        assert!(!AddedTime::of(&[2.0], &[12.0]).unwrap().is_within_noise(), "quicker with it");
        assert_eq!(AddedTime::of(&[], &[1.0]), None);
        assert_eq!(AddedTime::of(&[1.0], &[]), None);
    }
}
