//! The opacity curve as Gaussian bells: pull at a peak or at its sides.

use eframe::egui::{CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Stroke, Ui, Vec2};

use super::curve::{GRAB, LINE, clicks, nearest};
use super::graph::Axes;
use crate::app::theme;
use crate::transfer::{Gaussian, MOST_GAUSSIANS, TransferFunction, points_of};

/// Height of a bell at its standard deviation, of that of its peak.
const SHOULDER: f64 = 0.606_530_66;
/// A new bell is this part of the graph wide.
const NEW_WIDTH: f64 = 1.0 / 16.0;
/// No bell is pulled to less than this part of the graph.
const LEAST_WIDTH: f64 = 1.0 / 2000.0;

/// What the hand is doing with the bells. Only the selection outlives a drag.
#[derive(Debug, Clone, Default)]
pub struct BellEditor {
    /// The bell whose numbers are shown.
    pub selected: usize,
    held: Option<(Grip, Vec2)>,
}

impl BellEditor {
    /// Lets go of what is held.
    pub fn let_go(&mut self) {
        self.held = None;
    }
}

/// Where a bell is held.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grip {
    Peak(usize),
    Side(usize),
}

/// A bell for a curve of points: as high as that is, in the middle of what it shows.
pub(super) fn first_bell(transfer: &TransferFunction, [low, high]: [f64; 2]) -> Gaussian {
    let centre = low / 2.0 + high / 2.0;
    let most = transfer.opacity.iter().map(|p| p.1).fold(0.0, f64::max);
    let height = if most > 0.0 { most } else { 0.5 };
    Gaussian { centre, height, width: (high / 2.0 - low / 2.0) / 8.0 }
}

/// Changes a bell, if it still is one then; the curve follows.
pub(super) fn change_bell(
    transfer: &mut TransferFunction,
    bells: &mut [Gaussian],
    index: usize,
    bell: Gaussian,
) {
    if bell.validate().is_ok()
        && let Some(known) = bells.get_mut(index)
    {
        *known = bell;
        transfer.opacity = points_of(bells);
    }
}

/// Takes a bell out, unless it is the last one.
pub(super) fn remove_bell(
    transfer: &mut TransferFunction,
    bells: &mut Vec<Gaussian>,
    index: usize,
) {
    if bells.len() > 1 && index < bells.len() {
        bells.remove(index);
        transfer.opacity = points_of(bells);
    }
}

/// Adds a bell, unless it is none or there are as many as there may be; whether it was added.
pub(super) fn add_bell(
    transfer: &mut TransferFunction,
    bells: &mut Vec<Gaussian>,
    bell: Gaussian,
) -> bool {
    let fits = bells.len() < MOST_GAUSSIANS && bell.validate().is_ok();
    if fits {
        bells.push(bell);
        transfer.opacity = points_of(bells);
    }
    fits
}

/// A new bell at a place of the graph.
pub(super) fn bell_at(axes: Axes, value: f64, height: f64) -> Gaussian {
    let width = (axes.high / 2.0 - axes.low / 2.0) * 2.0 * NEW_WIDTH;
    Gaussian { centre: value, height, width }
}

/// The places where a bell is held: its peak, and both sides.
fn grips(axes: Axes, bell: &Gaussian) -> [Pos2; 3] {
    let side = |value: f64| axes.position((value, bell.height * SHOULDER));
    [
        axes.position((bell.centre, bell.height)),
        side(bell.centre - bell.width),
        side(bell.centre + bell.width),
    ]
}

/// What is within reach, nearest first.
fn grip_near(axes: Axes, bells: &[Gaussian], at: Pos2) -> Option<Grip> {
    let all = bells.iter().enumerate().flat_map(|(i, bell)| {
        let kinds = [Grip::Peak(i), Grip::Side(i), Grip::Side(i)];
        kinds.into_iter().zip(grips(axes, bell))
    });
    nearest(all.map(|(grip, place)| (grip, place.distance(at))), GRAB)
}

/// What the hand did with the bells since the last pass.
pub(super) fn handle_bells(
    ui: &Ui,
    response: &Response,
    editor: &mut BellEditor,
    transfer: &mut TransferFunction,
    bells: &mut Vec<Gaussian>,
    axes: Axes,
) {
    editor.selected = editor.selected.min(bells.len().saturating_sub(1));
    let [double, right_click] = clicks(ui);
    if let Some(at) = response.hover_pos() {
        let near = grip_near(axes, bells, at);
        match near {
            Some(Grip::Peak(_)) => ui.ctx().set_cursor_icon(CursorIcon::PointingHand),
            Some(Grip::Side(_)) => ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal),
            None => {}
        }
        if right_click && let Some(Grip::Peak(index) | Grip::Side(index)) = near {
            remove_bell(transfer, bells, index);
            editor.held = None;
        } else if double && near.is_none() {
            let bell = bell_at(axes, axes.value(at.x), axes.opacity(at.y));
            if add_bell(transfer, bells, bell) {
                editor.selected = bells.len() - 1;
            }
        }
    }
    let Some(at) = response.interact_pointer_pos() else { return };
    if response.drag_started_by(PointerButton::Primary) {
        editor.held = grip_near(axes, bells, at).map(|grip| {
            let (Grip::Peak(index) | Grip::Side(index)) = grip;
            editor.selected = index;
            (grip, axes.position((bells[index].centre, bells[index].height)) - at)
        });
    }
    if response.dragged_by(PointerButton::Primary)
        && response.drag_delta() != Vec2::ZERO
        && let Some((grip, offset)) = editor.held
    {
        let (Grip::Peak(index) | Grip::Side(index)) = grip;
        if let Some(&bell) = bells.get(index) {
            change_bell(transfer, bells, index, pulled(bell, grip, axes, at, offset));
        }
    }
    if response.drag_stopped() {
        editor.held = None;
    }
}

/// A bell after the hand pulled at it.
fn pulled(bell: Gaussian, grip: Grip, axes: Axes, at: Pos2, offset: Vec2) -> Gaussian {
    match grip {
        Grip::Peak(_) => {
            let to = at + offset;
            Gaussian { centre: axes.value(to.x), height: axes.opacity(to.y), ..bell }
        }
        Grip::Side(_) => {
            let least = (axes.high / 2.0 - axes.low / 2.0) * 2.0 * LEAST_WIDTH;
            Gaussian { width: (axes.value(at.x) - bell.centre).abs().max(least), ..bell }
        }
    }
}

/// Peaks as circles, sides as small squares; those of the chosen bell filled.
pub(super) fn paint_bells(
    painter: &Painter,
    axes: Axes,
    bells: &[Gaussian],
    editor: &BellEditor,
    hover: Option<Pos2>,
) {
    let near = hover.and_then(|at| grip_near(axes, bells, at));
    for (index, bell) in bells.iter().enumerate() {
        let selected = editor.selected == index;
        let fill = if selected { theme::ACCENT } else { theme::WELL };
        let [peak, left, right] = grips(axes, bell);
        let radius = if near == Some(Grip::Peak(index)) { 6.0 } else { 4.5 };
        painter.circle(peak, radius, fill, Stroke::new(1.5, LINE));
        let side = if near == Some(Grip::Side(index)) { 8.0 } else { 6.0 };
        for place in [left, right] {
            let rect = Rect::from_center_size(place, Vec2::splat(side));
            painter.rect(rect, 1.0, fill, Stroke::new(1.2, LINE), eframe::egui::StrokeKind::Middle);
        }
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{pos2, vec2};

    use super::*;
    use crate::transfer::{ColourMap, ColourSource};

    fn axes() -> Axes {
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(200.0, 100.0));
        Axes { rect, low: 0.0, high: 200.0 }
    }

    fn transfer() -> TransferFunction {
        TransferFunction::of(
            vec![(0.0, 0.0), (100.0, 0.6)],
            ColourSource::Map { map: ColourMap::Gray, range: [0.0, 100.0] },
        )
    }

    #[test]
    fn a_peak_moves_the_bell_and_a_side_its_width() {
        let bell = Gaussian { centre: 50.0, height: 0.5, width: 20.0 };
        assert_eq!(grip_near(axes(), &[bell], pos2(52.0, 48.0)), Some(Grip::Peak(0)));
        let [_, left, right] = grips(axes(), &bell);
        assert!((left.x - 30.0).abs() < 1e-3 && (right.x - 70.0).abs() < 1e-3);
        assert_eq!(grip_near(axes(), &[bell], left), Some(Grip::Side(0)));
        assert_eq!(grip_near(axes(), &[bell], pos2(150.0, 10.0)), None);
        let moved = pulled(bell, Grip::Peak(0), axes(), pos2(60.0, 20.0), vec2(0.0, 5.0));
        assert!((moved.centre - 60.0).abs() < 1e-4, "{moved:?}");
        assert_eq!((moved.height, moved.width), (0.75, bell.width));
        let wider = pulled(bell, Grip::Side(0), axes(), pos2(10.0, 90.0), vec2(0.0, 5.0));
        assert!((wider.width - 40.0).abs() < 1e-4 && wider.centre == bell.centre, "{wider:?}");
        let least = pulled(bell, Grip::Side(0), axes(), pos2(50.0, 90.0), Vec2::ZERO);
        assert!(least.width >= 0.1 && least.validate().is_ok(), "{least:?}");
    }

    #[test]
    fn the_curve_follows_and_the_last_bell_stays() {
        let mut t = transfer();
        let mut bells = vec![first_bell(&t, [0.0, 100.0])];
        assert_eq!(bells[0], Gaussian { centre: 50.0, height: 0.6, width: 6.25 });
        assert!(add_bell(&mut t, &mut bells, bell_at(axes(), 150.0, 0.25)));
        assert_eq!((t.opacity_at(150.0), t.opacity_at(50.0)), (0.25, 0.6));
        let wild = Gaussian { width: f64::NAN, ..bells[0] };
        assert!(!add_bell(&mut t, &mut bells, wild));
        change_bell(&mut t, &mut bells, 0, wild);
        assert_eq!(t.opacity_at(50.0), 0.6, "what is no bell changes nothing");
        remove_bell(&mut t, &mut bells, 0);
        assert_eq!((t.opacity_at(150.0), t.opacity_at(50.0)), (0.25, 0.0));
        remove_bell(&mut t, &mut bells, 0);
        assert_eq!(bells.len(), 1);
        while add_bell(&mut t, &mut bells, bell_at(axes(), 20.0, 0.1)) {}
        assert_eq!(bells.len(), MOST_GAUSSIANS);
    }
}
