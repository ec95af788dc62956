//! The opacity curve over the histogram as points, for the hand to pull at.

use eframe::egui::{Color32, CursorIcon, Painter, PointerButton, Pos2, Response, Stroke, Ui, pos2};

use super::graph::Axes;
use crate::app::theme;
use crate::transfer::TransferFunction;

/// A press this close to a point takes it, points.
pub(super) const GRAB: f32 = 9.0;
/// A press this close to the curve adds a point there, points.
const NEAR_CURVE: f32 = 6.0;
/// A point pulled this far out of the graph is removed, points.
pub(super) const PULL_OUT: f32 = 28.0;
/// The curve itself.
pub(super) const LINE: Color32 = Color32::from_rgb(222, 228, 236);

/// What the hand is doing with the points. Only the selection outlives a drag.
#[derive(Debug, Clone, Default)]
pub struct PointEditor {
    /// The point whose numbers are shown, an index into the opacities.
    pub selected: usize,
    held: Option<Held>,
}

impl PointEditor {
    /// Lets go of what is held.
    pub fn let_go(&mut self) {
        self.held = None;
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

/// Whether a double click ended in this pass, and one of the right button.
pub(super) fn clicks(ui: &Ui) -> [bool; 2] {
    ui.input(|input| {
        let pointer = &input.pointer;
        let double = pointer.button_double_clicked(PointerButton::Primary);
        [double, pointer.button_clicked(PointerButton::Secondary)]
    })
}

/// Which of several has the least distance, if it is within reach.
pub(super) fn nearest<T>(all: impl Iterator<Item = (T, f32)>, reach: f32) -> Option<T> {
    let near = all.filter(|(_, distance)| *distance <= reach);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(one, _)| one)
}

fn point_near(transfer: &TransferFunction, axes: Axes, at: Pos2) -> Option<usize> {
    let distances = transfer.opacity.iter().map(|&point| axes.position(point).distance(at));
    nearest(distances.enumerate(), GRAB)
}

/// Puts a point in its place among the others and returns its index.
pub(super) fn insert_point<T>(points: &mut Vec<(f64, T)>, at: f64, entry: T) -> usize {
    let index = points.partition_point(|(other, _)| *other <= at);
    points.insert(index, (at, entry));
    index
}

/// Puts a point on the curve, or beside it, and returns its index. Beyond the first point and the last one the curve is
/// level: there the new point gets a foot on it, as far from it as its neighbour is and no further than `ends`, so that
/// it changes the curve about itself alone.
pub(super) fn insert_on_curve(
    points: &mut Vec<(f64, f64)>,
    (at, opacity): (f64, f64),
    ends: [f64; 2],
) -> usize {
    let [first, last] = [points.first().copied(), points.last().copied()];
    let index = insert_point(points, at, opacity);
    match (first, last) {
        (Some((neighbour, held)), _) if at < neighbour => {
            let foot = (at - (neighbour - at)).max(ends[0]);
            if foot < at {
                points.insert(0, (foot, held));
                return index + 1;
            }
        }
        (_, Some((neighbour, held))) if at > neighbour => {
            let foot = (at + (at - neighbour)).min(ends[1]);
            if foot > at {
                points.push((foot, held));
            }
        }
        _ => {}
    }
    index
}

/// The values at the graph's ends.
fn ends(axes: Axes) -> [f64; 2] {
    [axes.rect.left(), axes.rect.right()].map(|x| axes.value(x))
}

/// Takes a point out, unless it is the last one.
pub(super) fn remove_point<T>(points: &mut Vec<(f64, T)>, index: usize) {
    if points.len() > 1 && index < points.len() {
        points.remove(index);
    }
}

/// Moves a point, kept between its neighbours, so that the order stays; what is there, if it could be moved.
pub(super) fn move_point<T>(points: &mut [(f64, T)], index: usize, at: f64) -> Option<&mut T> {
    let place = |i: usize| points.get(i).map(|(at, _)| *at);
    let low = index.checked_sub(1).and_then(place).unwrap_or(f64::MIN);
    let high = place(index + 1).unwrap_or(f64::MAX);
    let (place, entry) = points.get_mut(index).filter(|_| at.is_finite())?;
    *place = at.max(low).min(high);
    Some(entry)
}

/// Moves a point of the curve to another opacity, too.
pub(super) fn pull_point(transfer: &mut TransferFunction, index: usize, value: f64, opacity: f64) {
    if opacity.is_finite()
        && let Some(there) = move_point(&mut transfer.opacity, index, value)
    {
        *there = opacity.clamp(0.0, 1.0);
    }
}

/// What the hand did with the points since the last pass.
pub(super) fn handle_points(
    ui: &Ui,
    response: &Response,
    editor: &mut PointEditor,
    transfer: &mut TransferFunction,
    axes: Axes,
) {
    editor.selected = editor.selected.min(transfer.opacity.len().saturating_sub(1));
    let [double, right_click] = clicks(ui);
    if let Some(at) = response.hover_pos() {
        let near = point_near(transfer, axes, at);
        if right_click && let Some(index) = near {
            remove_point(&mut transfer.opacity, index);
            editor.held = None;
        } else if double && near.is_none() {
            let (value, opacity) = (axes.value(at.x), axes.opacity(at.y));
            let point = (value, opacity);
            editor.selected = insert_on_curve(&mut transfer.opacity, point, ends(axes));
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
            pull_point(transfer, held.index, axes.value(to.x), axes.opacity(to.y));
        }
    }
    if response.drag_stopped() {
        if held.pulled_out {
            remove_point(&mut transfer.opacity, held.index);
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
            insert_on_curve(&mut transfer.opacity, (value, opacity), ends(axes))
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

/// The line through all points.
pub(super) fn paint_curve(painter: &Painter, axes: Axes, transfer: &TransferFunction) {
    let points: Vec<Pos2> = transfer.opacity.iter().map(|&p| axes.position(p)).collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return };
    let mut path = vec![pos2(axes.rect.left() - 8.0, first.y)];
    path.extend(&points);
    path.push(pos2(axes.rect.right() + 8.0, last.y));
    painter.line(path, Stroke::new(1.5, LINE));
}

/// The points themselves.
pub(super) fn paint_points(
    painter: &Painter,
    axes: Axes,
    transfer: &TransferFunction,
    editor: &PointEditor,
    hover: Option<Pos2>,
) {
    let near = hover.and_then(|at| point_near(transfer, axes, at));
    for (index, &point) in transfer.opacity.iter().enumerate() {
        let held = editor.held.filter(|held| held.index == index);
        let selected = editor.selected == index;
        let fill = if selected { theme::ACCENT } else { theme::WELL };
        let (radius, colour) = match held {
            Some(Held { pulled_out: true, .. }) => (4.0, theme::ERROR),
            Some(_) => (6.0, LINE),
            None if near == Some(index) => (6.0, LINE),
            None => (4.5, LINE),
        };
        painter.circle(axes.position(point), radius, fill, Stroke::new(1.5, colour));
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Rect, vec2};

    use super::*;
    use crate::transfer::{ColourMap, ColourSource};

    fn transfer() -> TransferFunction {
        TransferFunction::of(
            vec![(0.0, 0.0), (50.0, 0.2), (100.0, 1.0)],
            ColourSource::Map { map: ColourMap::Gray, range: [0.0, 100.0] },
        )
    }

    fn axes() -> Axes {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 100.0));
        Axes { rect, low: -50.0, high: 150.0 }
    }

    #[test]
    fn a_point_cannot_pass_its_neighbours() {
        let mut t = transfer();
        pull_point(&mut t, 1, 500.0, 2.0);
        assert_eq!(t.opacity[1], (100.0, 1.0));
        pull_point(&mut t, 1, -500.0, -1.0);
        assert_eq!(t.opacity[1], (0.0, 0.0));
        pull_point(&mut t, 1, f64::NAN, 0.5);
        assert_eq!(t.opacity[1], (0.0, 0.0), "NaN moves nothing");
        pull_point(&mut t, 9, 1.0, 0.5);
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
    fn a_new_point_left_of_the_first_opens_nothing_but_what_lies_about_it() {
        let mut points = vec![(20.0, 0.0), (30.0, 0.5)];
        let index = insert_on_curve(&mut points, (15.0, 0.8), [0.0, 40.0]);
        assert_eq!((index, points[0], points[1]), (1, (10.0, 0.0), (15.0, 0.8)));
        // Right of the last one, no further than the graph goes.
        let index = insert_on_curve(&mut points, (36.0, 0.1), [0.0, 40.0]);
        assert_eq!((index, &points[4..]), (4, &[(36.0, 0.1), (40.0, 0.5)][..]));
        let index = insert_on_curve(&mut points, (17.0, 0.3), [0.0, 40.0]);
        assert_eq!((index, points.len()), (2, 7), "between two there is no foot");
        // By hand: from the level part of the curve upwards.
        let (mut transfer, axes) = (transfer(), axes());
        let value = axes.value(axes.rect.left()) / 2.0 + transfer.opacity[0].0 / 2.0;
        let before = transfer.opacity_at(axes.value(axes.rect.left()));
        let at = axes.position((value, before));
        let held = take_point(&mut transfer, axes, at).expect("on the curve");
        pull_point(&mut transfer, held.index, value, 1.0);
        assert_eq!(transfer.opacity_at(value), 1.0);
        assert_eq!(transfer.opacity_at(axes.value(axes.rect.left())), before);
    }

    #[test]
    fn points_are_put_where_they_belong_and_the_last_one_stays() {
        let mut t = transfer();
        assert_eq!(insert_point(&mut t.opacity, 25.0, 0.1), 1);
        for _ in 0..5 {
            remove_point(&mut t.opacity, 0);
        }
        assert_eq!(t.opacity, [(100.0, 1.0)]);
    }
}
