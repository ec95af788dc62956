//! The graph under the transfer function's editors: its axes, the histogram, and the colours.

use eframe::egui::epaint::Mesh;
use eframe::egui::{Color32, Painter, Pos2, Rect, Shape, pos2};

use crate::app::{theme, words};
use crate::core::LinearRgb;
use crate::core::colour::srgb_from_linear;
use crate::transfer::{Kind, TransferFunction};
use crate::volume::Statistics;

/// Colour samples across the graph.
const COLUMNS: u16 = 128;

/// Which values the graph shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extent {
    /// All of the data.
    #[default]
    All,
    /// What the colours span.
    Colours,
    /// What lies between the chosen percentiles.
    Percentiles,
}

/// How the histogram is shown; none of it changes a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraphView {
    /// Which values it shows.
    pub extent: Extent,
    /// Counts on a logarithmic axis.
    pub log: bool,
    /// The percentiles chosen, 0..=100, low to high.
    pub percentiles: [f64; 2],
}

impl Default for GraphView {
    fn default() -> Self {
        Self { extent: Extent::All, log: true, percentiles: [0.5, 99.5] }
    }
}

impl GraphView {
    /// The values of the chosen percentiles.
    pub fn percentile_range(&self, statistics: &Statistics) -> [f64; 2] {
        self.percentiles.map(|percent| statistics.quantile(percent / 100.0))
    }

    /// The range of values that is shown, of some width.
    pub fn range(&self, statistics: &Statistics, colours: [f64; 2]) -> [f64; 2] {
        let [a, b] = match self.extent {
            // A name takes half a number on either side.
            Extent::All if Kind::of(statistics) == Kind::Labels => {
                [statistics.min - 0.5, statistics.max + 0.5]
            }
            Extent::All => [statistics.min, statistics.max],
            Extent::Colours => colours,
            Extent::Percentiles => self.percentile_range(statistics),
        };
        let (low, high) = (a.min(b), a.max(b));
        if low < high { [low, high] } else { [low - 0.5, low + 0.5] }
    }
}

/// Where values and opacities lie in the graph.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    pub(super) rect: Rect,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Axes {
    pub(super) fn x(&self, value: f64) -> f32 {
        // Halved, so that a range of ±1e308 does not overflow.
        let fraction = (value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0);
        #[expect(clippy::cast_possible_truncation, reason = "a position on screen")]
        let fraction = fraction.clamp(-10.0, 10.0) as f32;
        self.rect.left() + fraction * self.rect.width()
    }

    pub(super) fn value(&self, x: f32) -> f64 {
        let fraction = f64::from((x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        self.low * (1.0 - fraction) + self.high * fraction
    }

    pub(super) fn y(&self, opacity: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        let opacity = opacity.clamp(0.0, 1.0) as f32;
        self.rect.bottom() - opacity * self.rect.height()
    }

    pub(super) fn opacity(&self, y: f32) -> f64 {
        f64::from((self.rect.bottom() - y) / self.rect.height()).clamp(0.0, 1.0)
    }

    pub(super) fn position(&self, (value, opacity): (f64, f64)) -> Pos2 {
        pos2(self.x(value), self.y(opacity))
    }
}

/// Fewer bins of the histogram than this across the graph tell too little.
const LEAST_BINS: f64 = 48.0;
/// Bars that are drawn from the quantiles instead.
const ESTIMATED_BARS: f64 = 64.0;

/// What the graph shows of the values' distribution: equal bars from low to high.
struct Bars {
    low: f64,
    high: f64,
    counts: Vec<f64>,
}

impl Bars {
    /// The histogram, where the range that is shown has enough of its bins; `None` otherwise.
    fn counted(axes: Axes, statistics: &Statistics) -> Option<Self> {
        let (min, max) = (statistics.min, statistics.max);
        let part = (axes.high / 2.0 - axes.low / 2.0) / (max / 2.0 - min / 2.0);
        let counts: Vec<f64> = statistics.histogram.iter().map(|&n| n as f64).collect();
        // Of a single value no finer picture can be had.
        let enough = max <= min || part * counts.len() as f64 >= LEAST_BINS;
        enough.then_some(Self { low: min, high: max, counts })
    }

    /// What the quantiles, which no outlier spoils, say about the range that is shown.
    fn estimated(axes: Axes, statistics: &Statistics) -> Self {
        let quantiles = &statistics.quantiles;
        let whole = quantiles.iter().all(|v| v.fract() == 0.0);
        let width = axes.high - axes.low;
        // No more bars than there are whole numbers, or some would have to be empty.
        let bars = if whole { ESTIMATED_BARS.min(width.floor()).max(1.0) } else { ESTIMATED_BARS };
        let each = statistics.finite_count as f64 / quantiles.len().max(1) as f64;
        let below = |i: f64| {
            let f = i / bars;
            let edge = axes.low * (1.0 - f) + axes.high * f;
            quantiles.partition_point(|v| *v < edge)
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 64")]
        let counts = (0..bars as u32)
            .map(|i| (below(f64::from(i) + 1.0) - below(f64::from(i))) as f64 * each)
            .collect();
        Self { low: axes.low, high: axes.high, counts }
    }

    fn edge(&self, i: usize) -> f64 {
        let f = i as f64 / self.counts.len() as f64;
        self.low * (1.0 - f) + self.high * f
    }

    /// The count of the bar that a value is in; 0 outside.
    fn at(&self, value: f64) -> f64 {
        let inside =
            (0..self.counts.len()).find(|&i| (self.edge(i)..self.edge(i + 1)).contains(&value));
        inside.and_then(|i| self.counts.get(i)).copied().unwrap_or(0.0)
    }
}

/// The height of a bar, as part of the highest one's.
fn bar_height(count: f64, most: f64, log: bool) -> f64 {
    let part = if log { count.ln_1p() / most.ln_1p() } else { count / most };
    // At least a sliver, so that rare values show.
    part.max(0.02)
}

/// Bars of the counts, or of their logarithm.
pub(super) fn paint_histogram(painter: &Painter, axes: Axes, statistics: &Statistics, log: bool) {
    let bars = Bars::counted(axes, statistics).unwrap_or_else(|| Bars::estimated(axes, statistics));
    let most = bars.counts.iter().copied().fold(0.0, f64::max);
    let mut mesh = Mesh::default();
    for (bar, &n) in bars.counts.iter().enumerate().filter(|(_, n)| **n > 0.0) {
        let (left, right) = (axes.x(bars.edge(bar)), axes.x(bars.edge(bar + 1)));
        if right < axes.rect.left() || left > axes.rect.right() {
            continue;
        }
        let top = axes.y(bar_height(n, most, log));
        let right = right.max(left + 1.0);
        let rect = Rect::from_min_max(pos2(left, top), pos2(right, axes.rect.bottom()));
        mesh.add_colored_rect(rect.intersect(axes.rect), theme::HISTOGRAM);
    }
    painter.add(Shape::mesh(mesh));
}

/// What is known of the values under the pointer: the value there, and how many samples share its
/// bar.
pub(super) fn readout(axes: Axes, at: Pos2, statistics: &Statistics) -> String {
    let value = axes.value(at.x);
    let name = words::value(value);
    if Bars::counted(axes, statistics).is_some() {
        let count = statistics.count_near(value);
        let samples = if count == 1 { "sample" } else { "samples" };
        return format!("{name}: {} {samples} in its bin", words::count(count));
    }
    let count = Bars::estimated(axes, statistics).at(value).round();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let count = count as u64;
    let samples = if count == 1 { "sample" } else { "samples" };
    format!("{name}: about {} {samples} in its bar", words::count(count))
}

/// A colour in linear light as the screen shows it.
pub(super) fn to_screen(LinearRgb(rgb): LinearRgb) -> Color32 {
    let [r, g, b] = rgb.map(|c| {
        let byte = (srgb_from_linear(c.clamp(0.0, 1.0)) * 255.0).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
        let byte = byte as u8;
        byte
    });
    Color32::from_rgb(r, g, b)
}

/// A ribbon from the bottom up across the graph, by its upper edge and its colour at each value: evenly, and at some
/// places besides.
pub(super) fn ribbon(
    axes: Axes,
    columns: u16,
    places: impl Iterator<Item = f64>,
    look: impl Fn(f64) -> Option<(f32, Color32)>,
) -> Option<Mesh> {
    let mut xs: Vec<f32> = (0..=columns)
        .map(|i| axes.rect.left() + axes.rect.width() * f32::from(i) / f32::from(columns))
        .collect();
    xs.extend(places.map(|value| axes.x(value)));
    xs.retain(|x| axes.rect.x_range().contains(*x));
    xs.sort_by(f32::total_cmp);
    let mut mesh = Mesh::default();
    for (i, &x) in xs.iter().enumerate() {
        let (top, colour) = look(axes.value(x))?;
        mesh.colored_vertex(pos2(x, top), colour);
        mesh.colored_vertex(pos2(x, axes.rect.bottom()), colour);
        if let (Some(next), Ok(at)) = (xs.get(i + 1), u32::try_from(2 * i))
            && *next > x
        {
            mesh.add_triangle(at, at + 1, at + 2);
            mesh.add_triangle(at + 1, at + 2, at + 3);
        }
    }
    Some(mesh)
}

fn paint_ribbon(
    painter: &Painter,
    axes: Axes,
    transfer: &TransferFunction,
    alpha: f32,
    top: impl Fn(f64) -> f32,
) {
    let places = transfer.opacity.iter().map(|(value, _)| *value);
    let colour = |value| to_screen(transfer.colour_at(value)).gamma_multiply(alpha);
    let mesh = ribbon(axes, COLUMNS, places, |value| Some((top(value), colour(value))));
    painter.extend(mesh.map(Shape::mesh));
}

pub(super) fn paint_under_curve(painter: &Painter, axes: Axes, transfer: &TransferFunction) {
    paint_ribbon(painter, axes, transfer, 0.55, |value| axes.y(transfer.opacity_at(value)));
}

/// The colours alone, over the whole height.
pub(super) fn paint_colours(painter: &Painter, axes: Axes, transfer: &TransferFunction) {
    paint_ribbon(painter, axes, transfer, 1.0, |_| axes.rect.top());
}

#[cfg(test)]
mod tests {
    use eframe::egui::vec2;

    use super::*;
    use crate::core::Ticket;
    use crate::volume::Samples;

    fn axes() -> Axes {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 100.0));
        Axes { rect, low: -50.0, high: 150.0 }
    }

    #[test]
    fn positions_and_values_undo_each_other_even_for_the_widest_range() {
        let a = axes();
        assert_eq!(a.position((-50.0, 1.0)), pos2(10.0, 20.0));
        assert_eq!(a.position((150.0, 0.0)), pos2(210.0, 120.0));
        for value in [-50.0, 0.0, 33.0, 150.0] {
            assert!((a.value(a.x(value)) - value).abs() < 1e-4);
        }
        let wide = Axes { low: f64::MIN, high: f64::MAX, ..a };
        assert!((wide.x(0.0) - 110.0).abs() < 1e-3);
        assert!(wide.value(60.0).is_finite());
    }

    #[test]
    fn the_graph_shows_what_was_chosen_and_never_nothing() {
        let of = |values: Vec<f64>| {
            Statistics::of(&Samples::Float64(values), &Ticket::new()).expect("never cancelled")
        };
        let statistics = of((0..=1000).map(f64::from).collect());
        let view = GraphView { percentiles: [10.0, 75.0], ..GraphView::default() };
        let shown = |extent| GraphView { extent, ..view }.range(&statistics, [700.0, 300.0]);
        assert_eq!(shown(Extent::All), [0.0, 1000.0]);
        assert_eq!(shown(Extent::Colours), [300.0, 700.0]);
        let [low, high] = shown(Extent::Percentiles);
        assert!((low - 100.0).abs() < 2.0 && (high - 750.0).abs() < 2.0, "{low} {high}");
        let [low, high] = view.range(&of(vec![7.0; 9]), [7.0, 7.0]);
        assert!(low < 7.0 && 7.0 < high);
    }

    #[test]
    fn the_readout_counts_the_samples_of_the_bin_under_the_pointer() {
        let samples = Samples::UInt8((0..300).map(|i| if i < 100 { 9 } else { 200 }).collect());
        let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
        let axes = Axes { low: 9.0, high: 200.0, ..axes() };
        assert_eq!(readout(axes, pos2(10.0, 40.0), &statistics), "9: 100 samples in its bin");
        assert_eq!(readout(axes, pos2(110.0, 40.0), &statistics), "104.5: 0 samples in its bin");
        assert_eq!(readout(axes, pos2(210.0, 40.0), &statistics), "200: 200 samples in its bin");
    }

    #[test]
    fn one_outlier_leaves_a_histogram_to_be_seen() {
        let mut values: Vec<f64> = (0..100_000).map(|i| f64::from(i % 1000) / 10.0).collect();
        values[7] = 1e9;
        let samples = Samples::Float64(values);
        let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
        let axes = Axes { low: 0.0, high: 100.0, ..axes() };
        assert!(Bars::counted(axes, &statistics).is_none(), "one bin would hold them all");
        let bars = Bars::estimated(axes, &statistics);
        assert_eq!(bars.counts.len(), 64);
        for &count in &bars.counts {
            assert!((count - 100_000.0 / 64.0).abs() < 250.0, "{count}");
        }
        assert!(readout(axes, pos2(110.0, 40.0), &statistics).starts_with("50: about 1"));
        let all = Axes { low: statistics.min, high: statistics.max, ..axes };
        assert!(Bars::counted(all, &statistics).is_some());
        // Whole numbers have no bars between them.
        let samples =
            Samples::Int32((0..9999).map(|i| if i == 0 { 1 << 30 } else { i % 8 }).collect());
        let statistics = Statistics::of(&samples, &Ticket::new()).expect("never cancelled");
        let bars = Bars::estimated(Axes { low: 0.0, high: 8.0, ..axes }, &statistics);
        assert!(bars.counts.len() == 8 && bars.counts.iter().all(|n| *n > 1000.0));
    }

    #[test]
    fn heights_are_of_the_counts_or_of_their_logarithms() {
        assert_eq!(bar_height(50.0, 100.0, false), 0.5);
        assert!((bar_height(9.0, 99.0, true) - 0.5).abs() < 1e-12);
        assert_eq!([bar_height(1.0, 1e9, false), bar_height(7.0, 7.0, true)], [0.02, 1.0]);
    }

    #[test]
    fn screen_colours_are_srgb() {
        assert_eq!(to_screen(LinearRgb([0.0, 0.215_861, 1.0])), Color32::from_rgb(0, 128, 255));
    }
}
