//! The axes of the chart: where times and levels lie, and their numbers.

use eframe::egui::{Align2, CornerRadius, FontId, Painter, Pos2, Rect, Stroke, Vec2, pos2, vec2};

use crate::app::measuring::ChartPoint;
use crate::app::{theme, words};

/// Room around the graph that numbers may reach into, points.
pub const AROUND: f32 = 12.0;
/// A decade at least this wide has steps of its own, points.
const POINTS_FOR_STEPS: f64 = 130.0;
/// Numbers within a decade: as few of them as tell how wide it is.
const STEPS: [&[f64]; 3] = [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]];
/// Least distance of two numbers along the axes, points.
const BETWEEN_NUMBERS: f32 = 8.0;
/// What the numbers at the left are, and in graphs at least so wide what they are in the percent that the window tells elsewhere.
const LEVEL: &str = "dB: higher is better";
const LEVEL_AND_ERROR: &str =
    "dB: higher is better; at 20 the error is 10 %, at 40 1 %, at 60 0.1 %";
const WIDE: f32 = 480.0;
/// A graph smaller than this has no words in its corners, points.
const LEAST_FOR_WORDS: Vec2 = vec2(230.0, 84.0);

/// Where times and levels lie: decades across, dB upwards.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    /// The graph.
    pub rect: Rect,
    /// log₁₀ of milliseconds at the left and right edge.
    time: [f64; 2],
    /// dB at the lower and upper edge.
    level: [f64; 2],
}

impl Axes {
    /// Room for all points and a margin, whole steps of 5 dB. Points of no error at all, which no level
    /// is high enough for, lie at the upper edge.
    pub fn around(rect: Rect, points: &[ChartPoint]) -> Self {
        let drawn = || points.iter().filter(|point| point.failed.is_none());
        let bounds = |values: &mut dyn Iterator<Item = f64>| {
            values
                .filter(|v| v.is_finite())
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
        };
        let mut time = bounds(&mut drawn().map(|point| point.ms.max(0.01).log10()));
        let mut level = bounds(&mut drawn().map(|point| point.db));
        if time[0] > time[1] || level[0] > level[1] {
            (time, level) = ([0.0, 3.0], [20.0, 60.0]);
        }
        let spare = (0.06 * (time[1] - time[0])).max(0.15);
        let step = |db: f64, round: fn(f64) -> f64| round(db / 5.0) * 5.0;
        Self {
            rect,
            time: [time[0] - spare, time[1] + spare],
            level: [step(level[0] - 1.0, f64::floor), step(level[1] + 1.0, f64::ceil)],
        }
    }

    /// Where a time, in milliseconds, and a level, in dB, lie.
    #[expect(clippy::cast_possible_truncation, reason = "positions on screen")]
    pub fn at(&self, ms: f64, db: f64) -> Pos2 {
        let share = |value: f64, [low, high]: [f64; 2]| ((value - low) / (high - low)) as f32;
        pos2(
            self.rect.left() + share(ms.max(0.01).log10(), self.time) * self.rect.width(),
            self.rect.bottom() - share(db.min(self.level[1]), self.level) * self.rect.height(),
        )
    }
}

/// Numbers and faint lines: 1-2-5 steps of time, every 5 or 10 dB. Where words stand in the graph now is added to `taken`.
pub fn paint_axes(painter: &Painter, axes: Axes, taken: &mut Vec<Rect>) {
    let font = FontId::proportional(11.0);
    let line = Stroke::new(1.0, theme::LINE);
    let Rect { min, max } = axes.rect;
    let height = axes.level[1] - axes.level[0];
    let room = f64::from(axes.rect.height());
    // As many numbers as have room.
    let step = [5.0, 10.0, 20.0, 50.0]
        .into_iter()
        .find(|step| height <= 7.0 * step && room * step / height > 11.0 + 4.0)
        .unwrap_or(100.0);
    let mut db = (axes.level[0] / step).ceil() * step;
    while db <= axes.level[1] + 1e-9 {
        let y = axes.at(1.0, db).y;
        painter.hline(min.x..=max.x, y, line);
        let text = format!("{db:.0}");
        painter.text(
            pos2(min.x - 6.0, y),
            Align2::RIGHT_CENTER,
            text,
            font.clone(),
            theme::TEXT_FAINT,
        );
        db += step;
    }
    let mut free_from = f32::NEG_INFINITY;
    for ms in times(axes) {
        let x = axes.at(ms, 0.0).x;
        painter.vline(x, min.y..=max.y, line);
        let galley = painter.layout_no_wrap(time_words(ms), font.clone(), theme::TEXT_FAINT);
        let width = galley.size().x;
        let left = (x - width / 2.0).min(max.x + AROUND - width);
        if left >= free_from {
            painter.galley(pos2(left, max.y + 4.0), galley, theme::TEXT_FAINT);
            free_from = left + width + BETWEEN_NUMBERS;
        }
    }
    if axes.rect.width() < LEAST_FOR_WORDS.x || axes.rect.height() < LEAST_FOR_WORDS.y {
        return;
    }
    let quiet = theme::TEXT_FAINT.gamma_multiply(0.8);
    let of_level = if axes.rect.width() < WIDE { LEVEL } else { LEVEL_AND_ERROR };
    for (corner, align, words) in [
        (pos2(max.x - 6.0, max.y - 4.0), Align2::RIGHT_BOTTOM, "time to draw a picture"),
        (pos2(min.x + 6.0, min.y + 4.0), Align2::LEFT_TOP, of_level),
    ] {
        let galley = painter.layout_no_wrap(words.to_owned(), font.clone(), quiet);
        let place = align.anchor_size(corner, galley.size());
        taken.push(place);
        // No line goes through the words.
        painter.rect_filled(place.expand2(vec2(2.0, 0.0)), CornerRadius::ZERO, theme::WELL);
        painter.galley(place.min, galley, quiet);
    }
}

/// The times that have a number and a line: as fine as there is room for, and two at least where
/// steps of a decade can be divided so.
fn times(axes: Axes) -> Vec<f64> {
    let [low, high] = axes.time;
    #[expect(clippy::cast_possible_truncation, reason = "decades of milliseconds")]
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    let within = |steps: &[f64]| -> Vec<f64> {
        let of_decade = |decade: i32| steps.iter().map(move |step| step * 10.0_f64.powi(decade));
        let all = (first..=last).flat_map(of_decade);
        all.filter(|ms| (low..=high).contains(&ms.log10())).collect()
    };
    let has_room = f64::from(axes.rect.width()) / (high - low) > POINTS_FOR_STEPS;
    let coarsest = usize::from(has_room);
    let enough = STEPS[coarsest..].iter().map(|steps| within(steps)).find(|all| all.len() >= 2);
    enough.unwrap_or_else(|| within(STEPS[STEPS.len() - 1]))
}

fn time_words(ms: f64) -> String {
    if ms >= 1000.0 {
        format!("{} s", words::value(ms / 1000.0))
    } else {
        format!("{} ms", words::value(ms))
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart::tests::point;
    use super::*;

    #[test]
    fn every_point_is_inside_the_graph_whatever_its_numbers() {
        let rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(410.0, 220.0));
        for points in [
            vec![],
            vec![point(5.0, 30.0)],
            vec![point(0.0, f64::INFINITY), point(1e7, -3.0), point(7.0, 200.0)],
        ] {
            let axes = Axes::around(rect, &points);
            for p in &points {
                let at = axes.at(p.ms, p.db);
                assert!(rect.expand(0.1).contains(at), "{p:?} at {at} of {rect}");
            }
        }
    }

    #[test]
    fn levels_are_told_apart_as_high_as_they_go() {
        let rect = Rect::from_min_max(Pos2::ZERO, pos2(300.0, 200.0));
        let levels = [30.0, 89.0, 95.0, 118.0, f64::INFINITY];
        let points = levels.map(|db| point(10.0, db));
        let axes = Axes::around(rect, &points);
        let heights = levels.map(|db| axes.at(10.0, db).y);
        assert!(heights.windows(2).all(|pair| pair[0] > pair[1]), "{heights:?}");
        assert_eq!(heights[4], rect.top());
        let alone = Axes::around(rect, &points[4..]);
        assert_eq!(alone.at(10.0, f64::INFINITY).y, rect.top());
    }

    #[test]
    fn more_time_is_to_the_right_and_a_higher_level_is_up() {
        let rect = Rect::from_min_max(Pos2::ZERO, pos2(100.0, 100.0));
        let axes = Axes::around(rect, &[point(10.0, 20.0), point(1000.0, 40.0)]);
        let (a, b) = (axes.at(10.0, 20.0), axes.at(1000.0, 40.0));
        assert!(b.x > a.x && b.y < a.y);
        let middle = axes.at(100.0, 30.0);
        assert!((middle.x - (a.x + b.x) / 2.0).abs() < 0.01, "logarithmic");
    }

    #[test]
    fn there_are_as_many_times_as_there_is_room_for_and_one_at_least() {
        let of = |width: f32, time| {
            let rect = Rect::from_min_size(Pos2::ZERO, vec2(width, 100.0));
            times(Axes { rect, time, level: [0.0, 10.0] })
        };
        assert_eq!(of(200.0, [0.9, 3.1]), [10.0, 100.0, 1000.0]);
        assert_eq!(of(400.0, [0.9, 2.1]), [10.0, 20.0, 50.0, 100.0]);
        assert_eq!(of(60.0, [1.1, 2.1]), [20.0, 50.0, 100.0]);
        assert_eq!(of(60.0, [1.05, 1.25]), [15.0]);
        assert_eq!(time_words(0.3), "0.3 ms");
        assert_eq!(time_words(3.0 * 0.1), "0.3 ms");
        assert_eq!(time_words(1500.0), "1.5 s");
    }
}
