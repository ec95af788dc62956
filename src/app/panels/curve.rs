//! The opacity curve over the histogram, and the colours under it, for the hand to pull at.

use eframe::egui::accesskit::Role;
use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Color32, CornerRadius, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape,
    Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use crate::app::theme;
use crate::core::LinearRgb;
use crate::core::colour::srgb_from_linear;
use crate::transfer::TransferFunction;
use crate::volume::Statistics;

/// Height of the graph, points.
const GRAPH_HEIGHT: f32 = 132.0;
/// Height of the colour bar, points.
const BAR_HEIGHT: f32 = 12.0;
/// A press this close to a point takes it, points.
const GRAB: f32 = 9.0;
/// A press this close to the curve adds a point there, points.
const NEAR_CURVE: f32 = 6.0;
/// A point pulled this far out of the graph is removed, points.
const PULL_OUT: f32 = 28.0;
/// Colour samples across the graph.
const COLUMNS: u16 = 128;

/// What the hand is doing with the curve. Only the selection outlives a drag.
#[derive(Debug, Clone, Default)]
pub struct CurveEditor {
    /// The point whose numbers are shown, an index into the opacities.
    pub selected: usize,
    /// Show only the range of the colours, not the whole range of the data.
    pub zoomed: bool,
    held: Option<Held>,
}

impl CurveEditor {
    /// Lets go of what is held.
    pub fn let_go(&mut self) {
        self.held = None;
    }

    /// Lets go of everything that belongs to one curve.
    pub fn start_over(&mut self) {
        (self.selected, self.held) = (0, None);
    }
}

/// A point in the hand.
#[derive(Debug, Clone, Copy)]
struct Held {
    index: usize,
    /// From the pointer to the point when it was taken.
    offset: eframe::egui::Vec2,
    /// Far enough out to be removed when let go.
    pulled_out: bool,
}

/// Where values and opacities lie in the graph.
#[derive(Debug, Clone, Copy)]
struct Axes {
    rect: Rect,
    low: f64,
    high: f64,
}

impl Axes {
    fn x(&self, value: f64) -> f32 {
        // Halved, so that a range of ±1e308 does not overflow.
        let fraction = (value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0);
        #[expect(clippy::cast_possible_truncation, reason = "a position on screen")]
        let fraction = fraction.clamp(-10.0, 10.0) as f32;
        self.rect.left() + fraction * self.rect.width()
    }

    fn value(&self, x: f32) -> f64 {
        let fraction = f64::from((x - self.rect.left()) / self.rect.width()).clamp(0.0, 1.0);
        self.low * (1.0 - fraction) + self.high * fraction
    }

    fn y(&self, opacity: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        let opacity = opacity.clamp(0.0, 1.0) as f32;
        self.rect.bottom() - opacity * self.rect.height()
    }

    fn opacity(&self, y: f32) -> f64 {
        f64::from((self.rect.bottom() - y) / self.rect.height()).clamp(0.0, 1.0)
    }

    fn position(&self, (value, opacity): (f64, f64)) -> Pos2 {
        pos2(self.x(value), self.y(opacity))
    }
}

/// The range of values that the graph shows.
fn shown_range(editor: &CurveEditor, statistics: &Statistics, colours: [f64; 2]) -> (f64, f64) {
    let whole = (statistics.min, statistics.max);
    let (low, high) = if editor.zoomed {
        (colours[0].min(colours[1]), colours[0].max(colours[1]))
    } else {
        whole
    };
    if low < high { (low, high) } else { (low - 0.5, low + 0.5) }
}

/// The graph with its colour bar; changes the opacities as the hand says.
pub fn curve_ui(
    ui: &mut Ui,
    editor: &mut CurveEditor,
    transfer: &mut TransferFunction,
    statistics: &Statistics,
    colours: [f64; 2],
) -> Response {
    let width = ui.available_width();
    let (outer, response) =
        ui.allocate_exact_size(vec2(width, GRAPH_HEIGHT + BAR_HEIGHT + 4.0), Sense::drag());
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), "Opacity curve over the histogram")
    });
    let graph = Rect::from_min_size(outer.min, vec2(width, GRAPH_HEIGHT));
    let bar = Rect::from_min_max(pos2(outer.left(), graph.bottom() + 4.0), outer.max);
    let (low, high) = shown_range(editor, statistics, colours);
    let axes = Axes { rect: graph.shrink2(vec2(7.0, 7.0)), low, high };

    editor.selected = editor.selected.min(transfer.opacity.len().saturating_sub(1));
    handle_hand(ui, &response, editor, transfer, axes);

    let painter = ui.painter_at(outer.expand(2.0));
    painter.rect_filled(graph, CornerRadius::same(5), theme::WELL);
    let inside = painter.with_clip_rect(graph.shrink(1.0));
    paint_histogram(&inside, axes, statistics);
    paint_under_curve(&inside, axes, transfer);
    paint_curve(&inside, axes, transfer, editor, response.hover_pos());
    let bar_axes = Axes { rect: Rect::from_x_y_ranges(axes.rect.x_range(), bar.y_range()), ..axes };
    paint_colours(&painter, bar_axes, transfer);
    painter.rect_stroke(bar_axes.rect, 2.0, Stroke::new(1.0, theme::LINE), StrokeKind::Outside);
    response
}

/// Points of the curve nearest first within reach of `at`.
fn point_near(transfer: &TransferFunction, axes: Axes, at: Pos2) -> Option<usize> {
    let distances =
        transfer.opacity.iter().enumerate().map(|(i, &p)| (i, axes.position(p).distance(at)));
    distances
        .filter(|(_, distance)| *distance <= GRAB)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(index, _)| index)
}

/// Puts a point in its place among the others and returns its index.
pub(super) fn insert_point(transfer: &mut TransferFunction, value: f64, opacity: f64) -> usize {
    let index = transfer.opacity.partition_point(|(v, _)| *v <= value);
    transfer.opacity.insert(index, (value, opacity));
    index
}

/// Takes a point out, unless it is the last one.
pub(super) fn remove_point(transfer: &mut TransferFunction, index: usize) {
    if transfer.opacity.len() > 1 && index < transfer.opacity.len() {
        transfer.opacity.remove(index);
    }
}

/// Moves a point, kept between its neighbours, so that the order stays.
pub(super) fn move_point(transfer: &mut TransferFunction, index: usize, value: f64, opacity: f64) {
    let value_of = |i: usize| transfer.opacity.get(i).map(|(v, _)| *v);
    let low = index.checked_sub(1).and_then(value_of).unwrap_or(f64::MIN);
    let high = value_of(index + 1).unwrap_or(f64::MAX);
    if value.is_finite()
        && opacity.is_finite()
        && let Some(point) = transfer.opacity.get_mut(index)
    {
        *point = (value.max(low).min(high), opacity.clamp(0.0, 1.0));
    }
}

fn handle_hand(
    ui: &Ui,
    response: &Response,
    editor: &mut CurveEditor,
    transfer: &mut TransferFunction,
    axes: Axes,
) {
    let (double, right_click) = ui.input(|input| {
        let pointer = &input.pointer;
        (
            pointer.button_double_clicked(PointerButton::Primary),
            pointer.button_clicked(PointerButton::Secondary),
        )
    });
    if let Some(at) = response.hover_pos() {
        let near = point_near(transfer, axes, at);
        if right_click && let Some(index) = near {
            remove_point(transfer, index);
            editor.held = None;
        } else if double && near.is_none() {
            editor.selected = insert_point(transfer, axes.value(at.x), axes.opacity(at.y));
        }
        if near.is_some() || near_curve(transfer, axes, at) {
            ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
        }
    }
    let Some(at) = response.interact_pointer_pos() else { return };
    if response.drag_started_by(PointerButton::Primary) {
        editor.held = take_point(transfer, axes, at);
        editor.selected = editor.held.map_or(editor.selected, |held| held.index);
    }
    let Some(held) = &mut editor.held else { return };
    if response.dragged_by(PointerButton::Primary) {
        let to = at + held.offset;
        held.pulled_out = !axes.rect.expand(PULL_OUT).contains(to) && transfer.opacity.len() > 1;
        if !held.pulled_out && response.drag_delta() != eframe::egui::Vec2::ZERO {
            move_point(transfer, held.index, axes.value(to.x), axes.opacity(to.y));
        }
    }
    if response.drag_stopped() {
        if held.pulled_out {
            remove_point(transfer, held.index);
        }
        editor.held = None;
    }
}

/// The point under the pointer, or a new one where the pointer is on the curve.
fn take_point(transfer: &mut TransferFunction, axes: Axes, at: Pos2) -> Option<Held> {
    let index = match point_near(transfer, axes, at) {
        Some(index) => index,
        None if near_curve(transfer, axes, at) => {
            let value = axes.value(at.x);
            let opacity = transfer.opacity_at(value);
            insert_point(transfer, value, opacity)
        }
        None => return None,
    };
    let offset = axes.position(transfer.opacity[index]) - at;
    Some(Held { index, offset, pulled_out: false })
}

fn near_curve(transfer: &TransferFunction, axes: Axes, at: Pos2) -> bool {
    let y = axes.y(transfer.opacity_at(axes.value(at.x)));
    axes.rect.x_range().contains(at.x) && (y - at.y).abs() <= NEAR_CURVE
}

/// Bars of the logarithm of the counts.
fn paint_histogram(painter: &Painter, axes: Axes, statistics: &Statistics) {
    let bins = statistics.histogram.len();
    let most = statistics.histogram.iter().copied().max().unwrap_or(0);
    if most == 0 || bins == 0 {
        return;
    }
    let scale = 1.0 / (most as f64).ln_1p();
    let mut mesh = Mesh::default();
    for (bin, &n) in statistics.histogram.iter().enumerate().filter(|(_, n)| **n > 0) {
        let edge = |i: usize| axes.x(statistics.value_at(i as f64 / bins as f64));
        let (left, right) = (edge(bin), edge(bin + 1));
        if right < axes.rect.left() || left > axes.rect.right() {
            continue;
        }
        // At least a sliver, so that rare values show.
        let top = axes.y(((n as f64).ln_1p() * scale).max(0.02));
        let right = right.max(left + 1.0);
        let bar = Rect::from_min_max(pos2(left, top), pos2(right, axes.rect.bottom()));
        mesh.add_colored_rect(bar.intersect(axes.rect), theme::HISTOGRAM);
    }
    painter.add(Shape::mesh(mesh));
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

/// A ribbon from `top` to `bottom` across the graph, coloured by value.
fn ribbon(axes: Axes, transfer: &TransferFunction, alpha: f32, top: impl Fn(f64) -> f32) -> Mesh {
    let mut xs: Vec<f32> = (0..=COLUMNS)
        .map(|i| axes.rect.left() + axes.rect.width() * f32::from(i) / f32::from(COLUMNS))
        .collect();
    xs.extend(transfer.opacity.iter().map(|(v, _)| axes.x(*v)));
    xs.retain(|x| axes.rect.x_range().contains(*x));
    xs.sort_by(f32::total_cmp);
    let mut mesh = Mesh::default();
    for (i, &x) in xs.iter().enumerate() {
        let value = axes.value(x);
        let colour = to_screen(transfer.colour_at(value)).gamma_multiply(alpha);
        mesh.colored_vertex(pos2(x, top(value)), colour);
        mesh.colored_vertex(pos2(x, axes.rect.bottom()), colour);
        if let (Some(next), Ok(at)) = (xs.get(i + 1), u32::try_from(2 * i))
            && *next > x
        {
            mesh.add_triangle(at, at + 1, at + 2);
            mesh.add_triangle(at + 1, at + 2, at + 3);
        }
    }
    mesh
}

fn paint_under_curve(painter: &Painter, axes: Axes, transfer: &TransferFunction) {
    let mesh = ribbon(axes, transfer, 0.55, |value| axes.y(transfer.opacity_at(value)));
    painter.add(Shape::mesh(mesh));
}

/// The colours alone, over the whole height.
fn paint_colours(painter: &Painter, axes: Axes, transfer: &TransferFunction) {
    painter.add(Shape::mesh(ribbon(axes, transfer, 1.0, |_| axes.rect.top())));
}

fn paint_curve(
    painter: &Painter,
    axes: Axes,
    transfer: &TransferFunction,
    editor: &CurveEditor,
    hover: Option<Pos2>,
) {
    let line = Color32::from_rgb(222, 228, 236);
    let points: Vec<Pos2> = transfer.opacity.iter().map(|&p| axes.position(p)).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return };
    let mut path = vec![pos2(axes.rect.left() - 8.0, first.y)];
    path.extend(&points);
    path.push(pos2(axes.rect.right() + 8.0, last.y));
    painter.line(path, Stroke::new(1.5, line));
    let near = hover.and_then(|at| point_near(transfer, axes, at));
    for (index, &at) in points.iter().enumerate() {
        let held = editor.held.filter(|held| held.index == index);
        let selected = editor.selected == index;
        let fill = if selected { theme::ACCENT } else { theme::WELL };
        let (radius, colour) = match held {
            Some(Held { pulled_out: true, .. }) => (4.0, theme::ERROR),
            Some(_) => (6.0, line),
            None if near == Some(index) => (6.0, line),
            None => (4.5, line),
        };
        painter.circle(at, radius, fill, Stroke::new(1.5, colour));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::{ColourMap, ColourSource};

    fn transfer() -> TransferFunction {
        TransferFunction {
            opacity: vec![(0.0, 0.0), (50.0, 0.2), (100.0, 1.0)],
            colour: ColourSource::Map { map: ColourMap::Gray, range: [0.0, 100.0] },
        }
    }

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
    fn a_point_cannot_pass_its_neighbours() {
        let mut t = transfer();
        move_point(&mut t, 1, 500.0, 2.0);
        assert_eq!(t.opacity[1], (100.0, 1.0));
        move_point(&mut t, 1, -500.0, -1.0);
        assert_eq!(t.opacity[1], (0.0, 0.0));
        move_point(&mut t, 1, f64::NAN, 0.5);
        assert_eq!(t.opacity[1], (0.0, 0.0), "NaN moves nothing");
        move_point(&mut t, 9, 1.0, 0.5);
        assert_eq!(t.opacity.len(), 3);
    }

    #[test]
    fn a_press_on_the_curve_adds_a_point_that_changes_nothing_yet() {
        let (mut t, a) = (transfer(), axes());
        let before: Vec<f64> = (0..100).map(|v| t.opacity_at(f64::from(v))).collect();
        let held = take_point(&mut t, a, a.position((75.0, 0.6)) + vec2(0.0, 3.0)).unwrap();
        assert_eq!((held.index, t.opacity.len()), (2, 4));
        for (v, b) in (0..100).zip(before) {
            assert!((t.opacity_at(f64::from(v)) - b).abs() < 1e-6, "{v}");
        }
        let elsewhere = take_point(&mut t, a, a.position((20.0, 0.9)));
        assert!(elsewhere.is_none() && t.opacity.len() == 4);
    }

    #[test]
    fn the_last_point_stays() {
        let mut t = transfer();
        for _ in 0..5 {
            remove_point(&mut t, 0);
        }
        assert_eq!(t.opacity, [(100.0, 1.0)]);
    }

    #[test]
    fn screen_colours_are_srgb() {
        assert_eq!(to_screen(LinearRgb([0.0, 0.215_861, 1.0])), Color32::from_rgb(0, 128, 255));
    }
}
