//! The plane of value and gradient strength: its axes, counts, and what the hand does there.

use std::sync::{Arc, Weak};

use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Color32, Context, CursorIcon, Painter, PointerButton, Pos2, Rect, Response, Shape, Stroke,
    StrokeKind, Ui, Vec2, pos2,
};

use super::super::curve::{GRAB, LINE, clicks, nearest};
use super::super::graph::{Axes, to_screen};
use super::{Held, RegionEditor, region_at};
use crate::app::job::{Ended, Job};
use crate::app::theme;
use crate::core::{Cancelled, LinearRgb};
use crate::scene::Scene;
use crate::transfer::{MOST_REGIONS, Region, RegionShape};
use crate::volume::{JOINT_BINS, JointHistogram, ScalarVolume};

/// No region is pulled to less than this part of the plane.
const LEAST_SIZE: f64 = 1.0 / 200.0;
/// Where values and gradients occur together most often.
const FREQUENT: Color32 = Color32::from_rgb(190, 200, 214);
/// Corners of an ellipse as it is painted.
const CORNERS: u8 = 48;

/// How often values and gradient strengths occur together in a volume, once that is asked for.
#[derive(Default)]
pub(super) struct Counted {
    of: Weak<ScalarVolume>,
    job: Option<Job<Result<JointHistogram, Cancelled>>>,
    counts: Option<JointHistogram>,
}

impl Counted {
    fn is_of(&self, volume: &Arc<ScalarVolume>) -> bool {
        std::ptr::eq(self.of.as_ptr(), Arc::as_ptr(volume))
    }

    /// Where the axis of strengths ends, if a volume was counted.
    pub(super) fn strongest(&self, volume: &Arc<ScalarVolume>) -> Option<f64> {
        let counts = self.counts.as_ref().filter(|_| self.is_of(volume))?;
        Some(counts.strongest)
    }

    /// Counts a volume on a thread of its own, unless that is done or under way.
    pub(super) fn count(&mut self, ctx: &Context, volume: &Arc<ScalarVolume>) {
        if !self.is_of(volume) {
            // A job that is dropped is cancelled.
            *self = Self { of: Arc::downgrade(volume), ..Self::default() };
            let volume = Arc::clone(volume);
            let count = move |ticket: &_| JointHistogram::of(&volume, ticket);
            self.job = Some(Job::start("gradients", "Counting gradients", ctx, count));
        }
        if let Some(ended) = self.job.as_ref().and_then(Job::poll) {
            self.job = None;
            if let Ended::Finished(Ok(counts)) = ended {
                self.counts = Some(counts);
            }
        }
    }

    pub(super) fn is_under_way(&self) -> bool {
        self.job.is_some()
    }

    /// What was counted, once it is there.
    pub(super) fn counts(&self) -> Option<&JointHistogram> {
        self.counts.as_ref()
    }
}

/// Where values and strengths lie in the plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneAxes {
    across: Axes,
    /// The strength at the upper end, > 0.
    top: f64,
}

impl PlaneAxes {
    pub(super) fn new(rect: Rect, [low, high]: [f64; 2], top: f64) -> Self {
        Self { across: Axes { rect, low, high }, top }
    }

    pub(super) fn rect(&self) -> Rect {
        self.across.rect
    }

    fn y(&self, strength: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "a position on screen")]
        let share = (strength / self.top).clamp(-10.0, 10.0) as f32;
        self.across.rect.bottom() - share * self.across.rect.height()
    }

    fn position(&self, [value, strength]: [f64; 2]) -> Pos2 {
        pos2(self.across.x(value), self.y(strength))
    }

    /// Value and strength at a place on screen.
    pub(super) fn place(&self, at: Pos2) -> [f64; 2] {
        [self.across.value(at.x), self.across.opacity(at.y) * self.top]
    }

    /// Width of the values shown; finite even where those are ±1e308.
    fn width(&self) -> f64 {
        ((self.across.high / 2.0 - self.across.low / 2.0) * 2.0).min(f64::MAX)
    }

    fn box_of(&self, region: &Region) -> Rect {
        let [[low, high], [weak, strong]] = [region.values, region.strengths];
        Rect::from_two_pos(self.position([low, weak]), self.position([high, strong]))
    }
}

/// Where a region is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Grip {
    Middle,
    Left,
    Right,
    Top,
    Bottom,
}

/// The middles of the sides of a region's box.
fn sides(axes: PlaneAxes, region: &Region) -> [(Grip, Pos2); 4] {
    let rect = axes.box_of(region);
    [
        (Grip::Left, rect.left_center()),
        (Grip::Right, rect.right_center()),
        (Grip::Top, rect.center_top()),
        (Grip::Bottom, rect.center_bottom()),
    ]
}

/// What is within reach: a side of the selected region, or any region itself.
fn grip_near(
    axes: PlaneAxes,
    regions: &[Region],
    selected: usize,
    at: Pos2,
) -> Option<(Grip, usize)> {
    let chosen = regions.get(selected)?;
    let sides = sides(axes, chosen).into_iter();
    if let Some(grip) = nearest(sides.map(|(grip, place)| (grip, place.distance(at))), GRAB) {
        return Some((grip, selected));
    }
    let is_in = |region: &Region| axes.box_of(region).contains(at);
    if is_in(chosen) {
        return Some((Grip::Middle, selected));
    }
    // Later ones are painted over earlier ones.
    regions.iter().rposition(is_in).map(|index| (Grip::Middle, index))
}

/// What the hand did with the regions since the last pass.
pub(super) fn handle(
    ui: &Ui,
    response: &Response,
    editor: &mut RegionEditor,
    regions: &mut Vec<Region>,
    axes: PlaneAxes,
) {
    let [double, right_click] = clicks(ui);
    if let Some(at) = response.hover_pos() {
        let near = grip_near(axes, regions, editor.selected, at);
        if let Some((grip, _)) = near {
            ui.ctx().set_cursor_icon(match grip {
                Grip::Middle => CursorIcon::Move,
                Grip::Left | Grip::Right => CursorIcon::ResizeHorizontal,
                Grip::Top | Grip::Bottom => CursorIcon::ResizeVertical,
            });
        }
        match near {
            Some((_, index)) if right_click => {
                regions.remove(index);
                editor.selected = editor.selected.min(regions.len().saturating_sub(1));
                editor.held = None;
            }
            None if double && regions.len() < MOST_REGIONS => {
                let shown = [axes.across.low, axes.across.high];
                let new = region_at(axes.place(at), shown, axes.top);
                if new.validate().is_ok() {
                    regions.push(new);
                    editor.selected = regions.len() - 1;
                }
            }
            _ => {}
        }
    }
    let Some(at) = response.interact_pointer_pos() else { return };
    if response.drag_started_by(PointerButton::Primary) {
        editor.held = grip_near(axes, regions, editor.selected, at).map(|(grip, index)| {
            editor.selected = index;
            Held { grip, index, region: regions[index], at: axes.place(at) }
        });
    }
    if response.dragged_by(PointerButton::Primary)
        && response.drag_delta() != Vec2::ZERO
        && let Some(held) = editor.held
        && let Some(region) = regions.get_mut(held.index)
    {
        let new = pulled(&held.region, held.grip, held.at, axes.place(at), axes);
        if new.validate().is_ok() {
            // What is typed meanwhile stays.
            (region.values, region.strengths) = (new.values, new.strengths);
        }
    }
    if response.drag_stopped() {
        editor.held = None;
    }
}

/// A region after the hand pulled at it from a place of the plane to another.
pub(super) fn pulled(
    region: &Region,
    grip: Grip,
    start: [f64; 2],
    to: [f64; 2],
    axes: PlaneAxes,
) -> Region {
    let ([mut low, mut high], [mut weak, mut strong]) = (region.values, region.strengths);
    let least = [axes.width() * LEAST_SIZE, axes.top * LEAST_SIZE];
    let [across, up] = [to[0] - start[0], to[1] - start[1]];
    match grip {
        Grip::Middle => {
            // Its lower side stops at 0, and its size stays.
            let up = up.max(-weak);
            (low, high, weak, strong) = (low + across, high + across, weak + up, strong + up);
        }
        Grip::Left => low = (low + across).min(high - least[0]),
        Grip::Right => high = (high + across).max(low + least[0]),
        Grip::Top => strong = (strong + up).max(weak + least[1]),
        Grip::Bottom => weak = (weak + up).min(strong - least[1]).max(0.0),
    }
    Region { values: [low, high], strengths: [weak, strong], ..*region }
}

/// Logarithms of the counts as greys, so that thin arches beside much air are seen.
pub(super) fn paint_counts(painter: &Painter, axes: PlaneAxes, counts: &JointHistogram) {
    let [across, up] = JOINT_BINS;
    let [low, high] = counts.values;
    let value = |i: usize| {
        let share = i as f64 / across as f64;
        low * (1.0 - share) + high * share
    };
    let strength = |i: usize| counts.strongest * i as f64 / up as f64;
    let most = counts.counts.iter().copied().max().unwrap_or(0).max(1) as f32;
    let mut mesh = Mesh::default();
    for (i, &n) in counts.counts.iter().enumerate().filter(|(_, n)| **n > 0) {
        let (x, y) = (i % across, i / across);
        let rect = Rect::from_two_pos(
            axes.position([value(x), strength(y)]),
            axes.position([value(x + 1), strength(y + 1)]),
        );
        if rect.intersects(axes.rect()) {
            let share = (n as f32).ln_1p() / most.ln_1p();
            let grey = theme::WELL.lerp_to_gamma(FREQUENT, share);
            mesh.add_colored_rect(rect.intersect(axes.rect()), grey);
        }
    }
    painter.add(Shape::mesh(mesh));
}

/// The regions in their colours; that which is selected with its grips.
pub(super) fn paint(
    painter: &Painter,
    axes: PlaneAxes,
    scene: &Scene,
    selected: usize,
    hover: Option<Pos2>,
) {
    let regions = &scene.shading.regions;
    let near = hover.and_then(|at| grip_near(axes, regions, selected, at));
    for (index, region) in regions.iter().enumerate() {
        let middle = region.values[0] / 2.0 + region.values[1] / 2.0;
        let transfer = scene.transfer();
        let by_value = transfer.map_or(LinearRgb([0.0; 3]), |f| f.colour_at(middle));
        let colour = region.colour.map_or(by_value, |colour| LinearRgb(colour.to_linear().0));
        #[expect(clippy::cast_possible_truncation, reason = "0.15..=0.6")]
        let alpha = (0.15 + 0.45 * region.opacity) as f32;
        let fill = to_screen(colour).gamma_multiply(alpha);
        let width = if index == selected { 1.6 } else { 1.0 };
        let outline = outline(axes, region);
        painter.add(Shape::convex_polygon(outline, fill, Stroke::new(width, LINE)));
    }
    let Some(region) = regions.get(selected) else { return };
    for (grip, place) in sides(axes, region) {
        let size = if near == Some((grip, selected)) { 8.0 } else { 6.0 };
        let rect = Rect::from_center_size(place, Vec2::splat(size));
        painter.rect(rect, 1.0, theme::ACCENT, Stroke::new(1.2, LINE), StrokeKind::Middle);
    }
}

/// The border of a region on screen.
fn outline(axes: PlaneAxes, region: &Region) -> Vec<Pos2> {
    let rect = axes.box_of(region);
    match region.shape {
        RegionShape::Rectangle => {
            vec![rect.left_top(), rect.right_top(), rect.right_bottom(), rect.left_bottom()]
        }
        RegionShape::Ellipse => {
            let corner = |i: u8| {
                let angle = std::f32::consts::TAU * f32::from(i) / f32::from(CORNERS);
                rect.center() + Vec2::angled(angle) * rect.size() / 2.0
            };
            (0..CORNERS).map(corner).collect()
        }
        RegionShape::Triangle => vec![rect.left_top(), rect.right_top(), rect.center_bottom()],
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::vec2;

    use super::*;

    fn axes() -> PlaneAxes {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 100.0));
        PlaneAxes::new(rect, [-50.0, 150.0], 40.0)
    }

    fn region() -> Region {
        Region {
            values: [0.0, 50.0],
            strengths: [10.0, 20.0],
            ..region_at([0.0; 2], [0.0, 1.0], 1.0)
        }
    }

    #[test]
    fn places_and_positions_undo_each_other() {
        let axes = axes();
        assert_eq!(axes.position([-50.0, 40.0]), pos2(10.0, 20.0));
        assert_eq!(axes.place(pos2(110.0, 70.0)), [50.0, 20.0]);
        assert_eq!(axes.place(pos2(-99.0, 999.0)), [-50.0, 0.0], "beyond is the border");
    }

    #[test]
    fn sides_are_taken_before_what_they_enclose() {
        let (axes, regions) = (axes(), [region(), Region { values: [20.0, 90.0], ..region() }]);
        let near = |place, selected| grip_near(axes, &regions, selected, axes.position(place));
        assert_eq!(near([0.0, 15.0], 0), Some((Grip::Left, 0)));
        assert_eq!(near([25.0, 20.0], 0), Some((Grip::Top, 0)));
        assert_eq!(
            near([30.0, 15.0], 0),
            Some((Grip::Middle, 0)),
            "both hold it: the selected one"
        );
        assert_eq!(near([30.0, 15.0], 1), Some((Grip::Middle, 1)));
        assert_eq!(near([80.0, 15.0], 0), Some((Grip::Middle, 1)));
        assert_eq!(near([120.0, 35.0], 0), None);
    }

    #[test]
    fn what_is_pulled_keeps_its_size_or_its_other_sides_and_stays_a_region() {
        let (axes, region) = (axes(), region());
        let pull = |grip, by: [f64; 2]| pulled(&region, grip, [0.0; 2], by, axes);
        let moved = pull(Grip::Middle, [30.0, -15.0]);
        assert_eq!((moved.values, moved.strengths), ([30.0, 80.0], [0.0, 10.0]), "down to 0");
        assert_eq!(pull(Grip::Left, [10.0, 9.0]).values, [10.0, 50.0]);
        assert_eq!(pull(Grip::Left, [99.0, 0.0]).values, [49.0, 50.0], "a sliver is left");
        assert_eq!(pull(Grip::Bottom, [0.0, -99.0]).strengths, [0.0, 20.0]);
        assert_eq!(pull(Grip::Top, [0.0, -99.0]).strengths, [10.0, 10.2]);
        assert_eq!(pull(Grip::Right, [5.0, 5.0]).strengths, region.strengths);
    }

    #[test]
    fn new_regions_come_down_to_gradient_0_where_they_are_near_it() {
        let low = region_at([7.0, 5.0], [-50.0, 150.0], 40.0);
        assert_eq!((low.values, low.strengths), ([-18.0, 32.0], [0.0, 10.0]));
        let high = region_at([7.0, 20.0], [-50.0, 150.0], 40.0);
        assert_eq!((high.strengths, high.validate()), ([15.0, 25.0], Ok(())));
    }
}
