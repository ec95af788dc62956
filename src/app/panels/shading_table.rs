//! A shading table for the hand to pull at: amounts or colours over what they are looked up by.

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Color32, CornerRadius, CursorIcon, DragValue, PointerButton, Pos2, Rect, Response, Sense,
    Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use super::curve::{GRAB, clicks, insert_point, move_point, nearest, remove_point};
use super::graph::{Axes, ribbon};
use super::{number_ui, row_ui, typed};
use crate::app::{theme, words};
use crate::core::Srgb8;

/// A press this close to the line adds a point there, points.
const NEAR_LINE: f32 = 6.0;
/// Room around the graph for points at its edges, points.
const INSET: Vec2 = vec2(7.0, 6.0);
/// Samples across the graph.
const COLUMNS: u16 = 96;

/// What a table holds.
pub(super) trait Entry: Copy {
    /// Height of its graph, points.
    const HEIGHT: f32;
    /// What one of them is called.
    const NAME: &'static str;
    /// How high it stands in the graph, 0..=1; `None` where all stand alike.
    fn height(self) -> Option<f64>;
    /// The same at another height.
    fn lifted(self, height: f64) -> Self;
    /// A share of the way to another.
    fn between(self, other: Self, share: f64) -> Self;
    /// How it is painted.
    fn colour(self) -> Color32;
    /// What changes it by itself; whether it did.
    fn edit_ui(&mut self, ui: &mut Ui, name: &str) -> bool;
}

impl Entry for f64 {
    const HEIGHT: f32 = 68.0;
    const NAME: &'static str = "point";

    fn height(self) -> Option<f64> {
        Some(self)
    }

    fn lifted(self, height: f64) -> Self {
        height.clamp(0.0, 1.0)
    }

    fn between(self, other: Self, share: f64) -> Self {
        self + (other - self) * share
    }

    fn colour(self) -> Color32 {
        theme::HISTOGRAM
    }

    fn edit_ui(&mut self, ui: &mut Ui, name: &str) -> bool {
        let name = format!("{name} amount");
        let drag = typed::number(ui, &name, self, 0.0..=1.0).speed(0.005).max_decimals(4);
        let response = number_ui(ui, &name, drag);
        response.on_hover_text("The amount at the chosen point, 0 to 1").changed()
    }
}

impl Entry for Srgb8 {
    const HEIGHT: f32 = 26.0;
    const NAME: &'static str = "colour";

    fn height(self) -> Option<f64> {
        None
    }

    fn lifted(self, _: f64) -> Self {
        self
    }

    fn between(self, other: Self, share: f64) -> Self {
        Self(std::array::from_fn(|c| {
            let (a, b) = (f64::from(self.0[c]), f64::from(other.0[c]));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let byte = (a + (b - a) * share).round() as u8;
            byte
        }))
    }

    fn colour(self) -> Color32 {
        let [r, g, b] = self.0;
        Color32::from_rgb(r, g, b)
    }

    fn edit_ui(&mut self, ui: &mut Ui, name: &str) -> bool {
        let response = ui.color_edit_button_srgb(&mut self.0);
        let response = response.accessible_name(format!("{name} colour"));
        response.on_hover_text("The colour at the chosen point").changed()
    }
}

/// What the hand is doing with one table.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TableEditor {
    /// The point whose numbers are shown.
    selected: usize,
    /// The point in the hand, and where it is from the pointer.
    held: Option<(usize, Vec2)>,
}

/// Where an entry stands in the graph; in its middle, where all stand alike.
fn position<T: Entry>(axes: Axes, (index, entry): (f64, T)) -> Pos2 {
    axes.position((index, entry.height().unwrap_or(0.5)))
}

/// A table over a range of its index, as far as its points go at least. `called` is what the table is
/// called, `unit` follows a number.
pub(super) fn table_ui<T: Entry>(
    ui: &mut Ui,
    called: &str,
    editor: &mut TableEditor,
    points: &mut Vec<(f64, T)>,
    (range, unit): ([f64; 2], &str),
) {
    let ends = [points.first(), points.last()].map(|end| end.map_or(range[0], |(at, _)| *at));
    let (low, high) = (range[0].min(ends[0]), range[1].max(ends[1]));
    let (low, high) = if low < high { (low, high) } else { (low - 0.5, low + 0.5) };
    let size = vec2(ui.available_width(), T::HEIGHT);
    let (outer, response) = ui.allocate_exact_size(size, Sense::drag());
    let name = format!("{called} table");
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), &name));
    let axes = Axes { rect: outer.shrink2(INSET), low, high };
    editor.selected = editor.selected.min(points.len().saturating_sub(1));
    hand(ui, &response, editor, points, axes);
    paint(ui, outer, axes, points, editor);
    response.on_hover_text(
        "Drag a point; double click for a new one (of a line, press it); right-click to remove",
    );
    point_ui(ui, called, editor, points, (axes, unit));
}

/// The range in words and the chosen point in numbers.
fn point_ui<T: Entry>(
    ui: &mut Ui,
    called: &str,
    editor: &TableEditor,
    points: &mut Vec<(f64, T)>,
    (axes, unit): (Axes, &str),
) {
    let range = [axes.low, axes.high].map(words::value);
    let words = format!("{} to {}{unit}", range[0], range[1]);
    ui.label(eframe::egui::RichText::new(words).size(11.0).color(theme::TEXT_FAINT));
    let Some(&(mut at, mut entry)) = points.get(editor.selected) else { return };
    let row = format!("{called} {}", T::NAME);
    row_ui(ui, if T::NAME == "colour" { "Colour" } else { "Point" }, |ui| {
        let speed = (axes.high / 2.0 - axes.low / 2.0) / 75.0;
        let drag = DragValue::new(&mut at).speed(speed).custom_formatter(|v, _| words::value(v));
        let moved = number_ui(ui, &format!("{row} index"), drag);
        let moved = moved.on_hover_text("Where the chosen point lies").changed();
        if entry.edit_ui(ui, called) || moved {
            pull_point(points, editor.selected, at, entry);
        }
        let button = eframe::egui::Button::new("×").small();
        let remove = ui.add_enabled(points.len() > 1, button);
        let remove =
            remove.accessible_name(format!("Remove {} {}", called.to_lowercase(), T::NAME));
        if remove.on_hover_text("Remove the chosen point").clicked() {
            remove_point(points, editor.selected);
        }
    });
}

/// The table's entry at an index.
fn entry_at<T: Entry>(points: &[(f64, T)], index: f64) -> Option<T> {
    let after = points.partition_point(|(at, _)| *at <= index);
    match (after.checked_sub(1).and_then(|i| points.get(i)), points.get(after)) {
        (Some((low, a)), Some((high, b))) => Some(a.between(*b, (index - low) / (high - low))),
        (Some((_, only)), None) | (None, Some((_, only))) => Some(*only),
        (None, None) => None,
    }
}

/// Moves a point, and makes it another entry.
fn pull_point<T>(points: &mut [(f64, T)], index: usize, at: f64, entry: T) {
    if let Some(there) = move_point(points, index, at) {
        *there = entry;
    }
}

fn point_near<T: Entry>(points: &[(f64, T)], axes: Axes, pointer: Pos2) -> Option<usize> {
    let distances = points.iter().map(|&point| position(axes, point).distance(pointer));
    nearest(distances.enumerate(), GRAB)
}

/// Whether a press there is on the line between points; colours have none.
fn near_line<T: Entry>(points: &[(f64, T)], axes: Axes, pointer: Pos2) -> bool {
    let height = entry_at(points, axes.value(pointer.x)).and_then(T::height);
    let is_near = |height| (axes.y(height) - pointer.y).abs() <= NEAR_LINE;
    axes.rect.x_range().contains(pointer.x) && height.is_some_and(is_near)
}

fn hand<T: Entry>(
    ui: &Ui,
    response: &Response,
    editor: &mut TableEditor,
    points: &mut Vec<(f64, T)>,
    axes: Axes,
) {
    let [double, right_click] = clicks(ui);
    if let Some(pointer) = response.hover_pos() {
        let near = point_near(points, axes, pointer);
        if right_click && let Some(index) = near {
            remove_point(points, index);
            editor.held = None;
        } else if double && near.is_none() {
            add(editor, points, axes, pointer, Some(axes.opacity(pointer.y)));
        }
        if near.is_some() || near_line(points, axes, pointer) {
            ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
        }
    }
    let Some(pointer) = response.interact_pointer_pos() else { return };
    if response.drag_started_by(PointerButton::Primary) {
        let near = point_near(points, axes, pointer);
        if near.is_none() && near_line(points, axes, pointer) {
            add(editor, points, axes, pointer, None);
        }
        let taken = near.or_else(|| point_near(points, axes, pointer));
        editor.held = taken.map(|index| (index, position(axes, points[index]) - pointer));
        editor.selected = taken.unwrap_or(editor.selected);
    }
    if let Some((index, offset)) = editor.held
        && response.dragged_by(PointerButton::Primary)
        && response.drag_delta() != Vec2::ZERO
        && let Some(&(_, entry)) = points.get(index)
    {
        let to = pointer + offset;
        pull_point(points, index, axes.value(to.x), entry.lifted(axes.opacity(to.y)));
    }
    if response.drag_stopped() {
        editor.held = None;
    }
}

/// A new point under the pointer: on the line, or at a height.
fn add<T: Entry>(
    editor: &mut TableEditor,
    points: &mut Vec<(f64, T)>,
    axes: Axes,
    pointer: Pos2,
    height: Option<f64>,
) {
    let at = axes.value(pointer.x);
    if let Some(entry) = entry_at(points, at) {
        let entry = height.map_or(entry, |height| entry.lifted(height));
        editor.selected = insert_point(points, at, entry);
    }
}

fn paint<T: Entry>(ui: &Ui, outer: Rect, axes: Axes, points: &[(f64, T)], editor: &TableEditor) {
    let painter = ui.painter_at(outer.expand(2.0));
    painter.rect_filled(outer, CornerRadius::same(5), theme::WELL);
    let places = points.iter().map(|(at, _)| *at);
    let ribbon = ribbon(axes, COLUMNS, places, |index| {
        let entry = entry_at(points, index)?;
        Some((entry.height().map_or(axes.rect.top(), |height| axes.y(height)), entry.colour()))
    });
    let Some(ribbon) = ribbon else { return };
    painter.add(Shape::mesh(ribbon));
    let places: Vec<Pos2> = points.iter().map(|&point| position(axes, point)).collect();
    let has_line = points.first().is_some_and(|(_, entry)| entry.height().is_some());
    if let (Some(first), Some(last)) = (places.first(), places.last())
        && has_line
    {
        let mut path = vec![pos2(axes.rect.left(), first.y)];
        path.extend(&places);
        path.push(pos2(axes.rect.right(), last.y));
        painter.line(path, Stroke::new(1.5, theme::TEXT));
    }
    for (index, &at) in places.iter().enumerate() {
        let is_chosen = editor.selected == index;
        let fill = match (has_line, is_chosen) {
            (false, _) => points[index].1.colour(),
            (true, true) => theme::ACCENT,
            (true, false) => theme::WELL,
        };
        let line = if is_chosen { Color32::WHITE } else { theme::TEXT };
        let radius = if is_chosen { 5.0 } else { 4.0 };
        if !has_line {
            // Told from its own colour behind it.
            painter.circle_filled(at, radius + 2.0, Color32::from_black_alpha(150));
        }
        painter.circle(at, radius, fill, Stroke::new(1.5, line));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_points_amounts_and_colours_are_interpolated() {
        let amounts = [(0.0, 0.2), (100.0, 0.6)];
        for (index, amount) in [(-9.0, 0.2), (25.0, 0.3), (100.0, 0.6), (900.0, 0.6)] {
            let found: f64 = entry_at(&amounts, index).unwrap();
            assert!((found - amount).abs() < 1e-12, "{index}: {found}");
        }
        let colours = [(0.0, Srgb8([0, 100, 250])), (1.0, Srgb8([100, 0, 250]))];
        assert_eq!(entry_at(&colours, 0.25), Some(Srgb8([25, 75, 250])));
        assert_eq!(entry_at::<f64>(&[], 0.0), None);
    }
}
