//! Small pictures that explain the terms of a mode, drawn by the formulas that draw the volume where there are any.

use std::sync::LazyLock;

use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2,
    pos2, vec2,
};

use super::{name_column_ui, show_sought};
use crate::app::theme;
use crate::core::{Srgb8, Ticket};
use crate::kernel::{Kernel, RadialKernel, Separable, SplatMesh, Subdivisions, coefficients};
use crate::scene::{Backend, Classify, OpacityModel, Order, Reconstruction, Visibility};
use crate::transfer::{ColourSource, TransferFunction, extinction_from_opacity};
use crate::volume::{Lattice, Samples, ScalarVolume};

/// Size of a picture, and room at its edges, points.
const SIZE: Vec2 = vec2(264.0, 84.0);
const INSET: f32 = 9.0;
/// Points that a curve is drawn through.
const STEPS: u16 = 160;
/// How far a kernel's picture goes from its middle, voxels.
const REACH: f64 = 2.6;
/// Turn of the lattice against the view, in the pictures that show both.
const TURN_RAD: f32 = 0.32;
/// Opacity of each of the samples that overlap.
const OPACITY: f64 = 0.6;

/// A row whose name is explained by a picture and a sentence while the pointer rests on it.
pub(super) fn explained_row_ui<R>(
    ui: &mut Ui,
    name: &str,
    (help, paint): (&str, impl FnOnce(&Painter, Rect)),
    add: impl FnOnce(&mut Ui) -> R,
) -> R {
    let row = ui.horizontal(|ui| {
        name_column_ui(ui, name).on_hover_ui(|ui| explained_ui(ui, help, paint));
        add(ui)
    });
    show_sought(ui, name, &row.response);
    row.inner
}

/// A picture and the sentence under it.
pub(super) fn explained_ui(ui: &mut Ui, help: &str, paint: impl FnOnce(&Painter, Rect)) {
    let (rect, _) = ui.allocate_exact_size(SIZE, Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, CornerRadius::same(4), theme::WELL);
    paint(&painter, rect.shrink(INSET));
    ui.label(help);
}

/// A graph over a range: x to the right, 0..=1 upwards.
#[derive(Clone, Copy)]
struct Graph {
    rect: Rect,
    from: f64,
    to: f64,
}

impl Graph {
    fn at(self, x: f64, y: f64) -> Pos2 {
        let share = (x - self.from) / (self.to - self.from);
        pos2(
            self.rect.left() + self.rect.width() * share as f32,
            self.rect.bottom() - self.rect.height() * y as f32,
        )
    }

    fn places(self, f: impl Fn(f64) -> f64) -> Vec<Pos2> {
        let x = |i: u16| self.from + (self.to - self.from) * f64::from(i) / f64::from(STEPS);
        (0..=STEPS).map(|i| self.at(x(i), f(x(i)))).collect()
    }

    fn line(self, painter: &Painter, stroke: Stroke, f: impl Fn(f64) -> f64) {
        painter.add(Shape::line(self.places(f), stroke));
    }

    /// The line, and what lies under it.
    fn hill(self, painter: &Painter, colour: Color32, f: impl Fn(f64) -> f64) {
        let places = self.places(f);
        let mut mesh = Mesh::default();
        for place in &places {
            mesh.colored_vertex(*place, colour.gamma_multiply(0.45));
            mesh.colored_vertex(pos2(place.x, self.rect.bottom()), colour.gamma_multiply(0.1));
        }
        for i in 0..u32::from(STEPS) {
            mesh.add_triangle(2 * i, 2 * i + 1, 2 * i + 2);
            mesh.add_triangle(2 * i + 1, 2 * i + 2, 2 * i + 3);
        }
        painter.add(Shape::mesh(mesh));
        painter.add(Shape::line(places, Stroke::new(1.6, colour)));
    }

    /// Dots of samples along the lower edge.
    fn samples(self, painter: &Painter, last: i32) {
        for i in -last..=last {
            painter.circle_filled(self.at(f64::from(i), 0.0), 2.2, theme::TEXT_FAINT);
        }
    }
}

fn faint() -> Stroke {
    Stroke::new(1.0, theme::TEXT_FAINT.gamma_multiply(0.55))
}

/// A kernel's weight at a distance along an axis of the lattice, 1 in its middle; at a splat radius of `extent`.
fn weight(kernel: Kernel, extent: Option<f64>, x: f64) -> f64 {
    if let Some(separable) = Separable::new(kernel, extent) {
        return separable.value(x) / separable.value(0.0);
    }
    match RadialKernel::new(kernel, extent) {
        Some(radial) => radial.value(x.abs()) / radial.value(0.0),
        // A box, and a point of no width, which is drawn a pixel wide.
        None => {
            let half = if kernel == Kernel::Nearest { 0.5 } else { 0.02 };
            f64::from(u8::from(x.abs() <= half))
        }
    }
}

/// A kernel among its neighbours; a mesh from the front.
pub(super) fn kernel(painter: &Painter, rect: Rect, kernel: Kernel) {
    if kernel == Kernel::Gouraud {
        return mesh(painter, rect);
    }
    if matches!(kernel, Kernel::Functions | Kernel::Ellipsoids) {
        return functions(painter, rect, kernel == Kernel::Ellipsoids);
    }
    if kernel == Kernel::Cells {
        return cells(painter, rect);
    }
    let graph = Graph { rect, from: -REACH, to: REACH };
    for neighbour in [-2.0, -1.0, 1.0, 2.0] {
        graph.line(painter, faint(), |x| weight(kernel, None, x - neighbour));
    }
    graph.hill(painter, theme::ACCENT, |x| weight(kernel, None, x));
    graph.samples(painter, 2);
}

/// Values at points that lie anywhere, straight in between.
fn cells(painter: &Painter, rect: Rect) {
    // Place, value.
    const POINTS: [(f64, f64); 6] =
        [(-REACH, 0.2), (-1.7, 0.75), (-1.2, 0.5), (0.3, 0.9), (0.7, 0.35), (REACH, 0.6)];
    let graph = Graph { rect, from: -REACH, to: REACH };
    for (place, value) in POINTS {
        graph.line(painter, faint(), |x| if (x - place).abs() < 0.04 { value } else { 0.0 });
    }
    graph.hill(painter, theme::ACCENT, |x| {
        let piece = POINTS.windows(2).find(|pair| x <= pair[1].0).unwrap_or(&POINTS[4..]);
        let [(a, from), (b, to)] = [piece[0], piece[1]];
        from + (to - from) * (x - a) / (b - a)
    });
}

/// Functions of several widths, wherever they lie, and their sum.
fn functions(painter: &Painter, rect: Rect, are_weighed: bool) {
    // Middle, width, height.
    const FUNCTIONS: [(f64, f64, f64); 4] =
        [(-1.6, 0.5, 0.5), (-0.4, 1.1, 0.55), (0.9, 0.35, 0.35), (1.8, 0.6, 0.25)];
    let graph = Graph { rect, from: -REACH, to: REACH };
    let one = |(middle, width, height): (f64, f64, f64), x: f64| {
        height * (-0.5 * ((x - middle) / width).powi(2)).exp()
    };
    for function in FUNCTIONS {
        graph.line(painter, faint(), |x| one(function, x));
    }
    let sum = |x| FUNCTIONS.iter().map(|f| one(*f, x)).sum::<f64>();
    let total = |x| {
        FUNCTIONS
            .iter()
            .map(|&(at, width, height)| one((at, width, height), x) / height)
            .sum::<f64>()
    };
    graph.hill(painter, theme::ACCENT, |x| if are_weighed { sum(x) / total(x) } else { sum(x) });
}

/// The triangles that stand for a Gouraud splat, lighter the more they weigh.
fn mesh(painter: &Painter, rect: Rect) {
    static MESH: LazyLock<SplatMesh> =
        LazyLock::new(|| SplatMesh::of(RadialKernel::CUBIC, Subdivisions::default()));
    let most = MESH.vertices.first().map_or(1.0, |vertex| vertex.factor);
    let radius = rect.height() / 2.0;
    let mut drawn = Mesh::default();
    for vertex in &MESH.vertices {
        let [x, y, share] =
            [vertex.position.x, vertex.position.y, vertex.factor / most].map(|v| v as f32);
        let colour = theme::ACCENT.gamma_multiply(share.clamp(0.0, 1.0));
        drawn.colored_vertex(rect.center() + vec2(x, y) * radius, colour);
    }
    for corners in &MESH.triangles {
        let [a, b, c] = corners.map(u32::from);
        drawn.add_triangle(a, b, c);
    }
    let places: Vec<Pos2> = drawn.vertices.iter().map(|vertex| vertex.pos).collect();
    painter.add(Shape::mesh(drawn));
    for corners in &MESH.triangles {
        let edges = corners.map(|i| places[usize::from(i)]).to_vec();
        painter.add(Shape::closed_line(edges, faint()));
    }
}

/// Values along a line of samples, and the coefficients of their blends: as they are, and interpolating.
static BLENDS: LazyLock<[Vec<f64>; 2]> = LazyLock::new(|| {
    let values = SAMPLES.map(|value| value as f32).to_vec();
    let lattice = Lattice::unit([SAMPLES.len(), 1, 1]);
    let volume = ScalarVolume::from_samples("samples", lattice, Samples::Float32(values));
    let plain = || SAMPLES.to_vec();
    let sharpened = volume.ok().and_then(|volume| {
        let found = coefficients(&volume, Kernel::BSpline, None, true, &Ticket::new()).ok()?;
        Some((0..SAMPLES.len()).map(|i| found.get(i)).collect())
    });
    [plain(), sharpened.unwrap_or_else(plain)]
});
const SAMPLES: [f64; 9] = [0.2, 0.25, 0.8, 0.3, 0.35, 0.75, 0.7, 0.2, 0.3];

/// The blend of B-splines at a place among the samples, which are mirrored at both ends.
fn blend(reconstruction: Reconstruction, x: f64) -> f64 {
    let all = &BLENDS[usize::from(reconstruction == Reconstruction::Interpolating)];
    let last = all.len() as i64 - 1;
    let near = x.floor() as i64;
    let at = |i: i64| {
        let mirrored = if i < 0 {
            -i
        } else if i > last {
            2 * last - i
        } else {
            i
        };
        all.get(usize::try_from(mirrored).unwrap_or_default()).copied().unwrap_or_default()
    };
    let spline =
        |x: f64| Separable::new(Kernel::BSpline, None).map_or(0.0, |spline| spline.value(x));
    (near - 1..=near + 2).map(|i| at(i) * spline(x - i as f64)).sum()
}

/// Samples, and the curve that is drawn of them.
pub(super) fn reconstruction(painter: &Painter, rect: Rect, chosen: Reconstruction) {
    let graph = Graph { rect, from: 0.0, to: SAMPLES.len() as f64 - 1.0 };
    let other = match chosen {
        Reconstruction::Smooth => Reconstruction::Interpolating,
        Reconstruction::Interpolating => Reconstruction::Smooth,
    };
    graph.line(painter, faint(), |x| blend(other, x));
    graph.hill(painter, theme::ACCENT, |x| blend(chosen, x));
    for (i, value) in SAMPLES.into_iter().enumerate() {
        painter.circle_filled(graph.at(i as f64, value), 2.6, theme::TEXT);
    }
}

/// Values along a ray, at whole voxels.
const RAY: [f64; 6] = [0.1, 0.2, 0.44, 0.9, 0.85, 0.8];
/// Slabs a voxel in the picture.
const SLABS: f64 = 2.0;
/// Where the first begins, voxels: samples lie within slabs, so that values bend there.
const FIRST_SLAB: f64 = 0.25;

fn ray_value(x: f64) -> f64 {
    let last = RAY.len() - 1;
    let before = (x.max(0.0).floor() as usize).min(last - 1);
    let share = (x - before as f64).clamp(0.0, 1.0);
    RAY[before] * (1.0 - share) + RAY[before + 1] * share
}

/// Opacity of one narrow range of values alone: a thin layer.
fn thin_layer() -> TransferFunction {
    let opacity = vec![(0.4, 0.0), (0.52, 1.0), (0.64, 0.0)];
    TransferFunction::of(opacity, ColourSource::Stops(vec![(0.0, Srgb8::WHITE)]))
}

/// What opacity a ray meets at a place, by the time at which values are classified.
fn classified(layer: &TransferFunction, chosen: Classify, x: f64) -> f64 {
    let slab = ((x - FIRST_SLAB) * SLABS).floor() / SLABS + FIRST_SLAB;
    match chosen {
        Classify::Before => {
            let before = x.floor();
            let share = x - before;
            let opacity = |x: f64| layer.opacity_at(ray_value(x));
            opacity(before) * (1.0 - share) + opacity(before + 1.0) * share
        }
        Classify::After => layer.opacity_at(ray_value(slab + 0.5 / SLABS)),
        Classify::Mean => {
            let within = (0..32).map(|i| slab + (f64::from(i) + 0.5) / 32.0 / SLABS);
            layer.opacity_at(within.map(ray_value).sum::<f64>() / 32.0)
        }
        Classify::PreIntegrated => {
            let within = (0..32).map(|i| slab + (f64::from(i) + 0.5) / 32.0 / SLABS);
            within.map(|x| layer.opacity_at(ray_value(x))).sum::<f64>() / 32.0
        }
    }
}

/// Values along a ray through a thin layer, and the opacity that is made of them.
pub(super) fn classify(painter: &Painter, rect: Rect, chosen: Classify) {
    let graph = Graph { rect, from: 0.0, to: RAY.len() as f64 - 1.0 };
    if chosen != Classify::Before {
        let mut x = FIRST_SLAB;
        while x < graph.to {
            painter
                .line_segment([graph.at(x, 0.0), graph.at(x, 1.0)], Stroke::new(0.7, theme::LINE));
            x += 1.0 / SLABS;
        }
    }
    let layer = thin_layer();
    // What there truly is, and what is drawn of it.
    graph.line(painter, faint(), |x| layer.opacity_at(ray_value(x)));
    graph.hill(painter, theme::ACCENT, |x| classified(&layer, chosen, x));
    graph.line(painter, Stroke::new(1.2, theme::NOTE), ray_value);
    for (i, value) in RAY.into_iter().enumerate() {
        painter.circle_filled(graph.at(i as f64, value), 2.2, theme::NOTE);
    }
}

/// An eye at the left, looking right.
fn eye(painter: &Painter, rect: Rect) {
    let at = rect.left_center();
    let stroke = Stroke::new(1.4, theme::TEXT);
    let lid = |down: f32| vec![at, at + vec2(7.0, 6.0 * down), at + vec2(15.0, 0.0)];
    for down in [-1.0, 1.0] {
        painter.add(Shape::line(lid(down), stroke));
    }
    painter.circle_filled(at + vec2(8.0, 0.0), 2.4, theme::TEXT);
    painter.arrow(at + vec2(19.0, 0.0), vec2(16.0, 0.0), stroke);
}

/// Where the samples of a turned lattice lie in the picture's right part, column by column, those near the eye
/// first.
fn turned_lattice(rect: Rect) -> Vec<Vec<Pos2>> {
    let middle = pos2(rect.left() + rect.width() * 0.6, rect.center().y);
    let step = rect.height() / 4.6;
    let (along, across) = (Vec2::angled(TURN_RAD) * step, Vec2::angled(TURN_RAD).rot90() * step);
    let column = |i: i8| {
        (-2..=2_i8).map(|j| middle + along * f32::from(i) + across * f32::from(j)).collect()
    };
    (-4..=4_i8).map(column).collect()
}

/// What is put together before it is laid over what is behind it.
pub(super) fn visibility(painter: &Painter, rect: Rect, chosen: Visibility) {
    eye(painter, rect);
    let columns = turned_lattice(rect);
    let lattice = painter.with_clip_rect(rect.with_min_x(rect.left() + 44.0));
    let band = Stroke::new(1.4, theme::ACCENT);
    match chosen {
        Visibility::EverySample => {
            for place in columns.iter().rev().flatten() {
                lattice.circle(*place, 10.0, theme::ACCENT.gamma_multiply(0.16), faint());
            }
        }
        Visibility::Sheets => {
            for column in &columns {
                if let [first, .., last] = column.as_slice() {
                    let beyond = (*last - *first) * 0.4;
                    lattice.line_segment([*first - beyond, *last + beyond], band);
                }
            }
        }
        Visibility::Slabs => {
            let step = rect.height() / 4.6;
            let mut x = rect.left() + 44.0;
            while x < rect.right() {
                lattice.line_segment([pos2(x, rect.top()), pos2(x, rect.bottom())], band);
                x += step;
            }
        }
    }
    for place in columns.iter().flatten() {
        lattice.circle_filled(*place, 2.2, theme::TEXT);
    }
}

/// What three samples side by side hide together.
fn hidden(model: OpacityModel, x: f64) -> f64 {
    let kernel = RadialKernel::CUBIC;
    let weights: f64 = [-1.0, 0.0, 1.0].iter().map(|at| kernel.footprint((x - at).abs())).sum();
    match model {
        OpacityModel::OpticalDepth => 1.0 - (-extinction_from_opacity(OPACITY) * weights).exp(),
        OpacityModel::Published => (OPACITY * weights).min(1.0),
    }
}

/// The opacity of samples that overlap, by either model.
pub(super) fn opacity_model(painter: &Painter, rect: Rect, chosen: OpacityModel) {
    let graph = Graph { rect, from: -REACH, to: REACH };
    for model in OpacityModel::ALL.iter().filter(|model| **model != chosen) {
        graph.line(painter, faint(), |x| hidden(*model, x));
    }
    graph.hill(painter, theme::ACCENT, |x| hidden(chosen, x));
    graph.samples(painter, 1);
}

/// Which of four things behind each other is drawn first.
pub(super) fn order(painter: &Painter, rect: Rect, chosen: Order) {
    eye(painter, rect);
    for i in 0..4_u8 {
        let at = pos2(rect.left() + 72.0 + 52.0 * f32::from(i), rect.center().y);
        // The second hides all that is behind it.
        let is_left_out = chosen == Order::FrontToBack && i > 1;
        let fill = if i == 1 { theme::ACCENT } else { theme::ACCENT.gamma_multiply(0.3) };
        let fill = if is_left_out { Color32::TRANSPARENT } else { fill };
        painter.circle(at, 17.0, fill, faint());
        let turn = match chosen {
            Order::BackToFront => Some(4 - i),
            Order::FrontToBack => (!is_left_out).then_some(i + 1),
        };
        let (words, colour) = turn
            .map_or(("–".to_owned(), theme::TEXT_FAINT), |turn| (turn.to_string(), theme::TEXT));
        painter.text(at, Align2::CENTER_CENTER, words, FontId::proportional(13.0), colour);
    }
}

/// A splat as triangles, a screen in tiles.
pub(super) fn backend(painter: &Painter, rect: Rect, chosen: Backend) {
    let triangles = |rect: Rect| {
        let side = rect.height() * 0.72;
        for (dx, dy) in [(-0.35, 0.08), (0.3, -0.1)] {
            let square =
                Rect::from_center_size(rect.center() + vec2(dx, dy) * side, Vec2::splat(side));
            painter.circle_filled(square.center(), side / 2.0, theme::ACCENT.gamma_multiply(0.4));
            painter.rect_stroke(square, 0.0, faint(), eframe::egui::StrokeKind::Middle);
            painter.line_segment([square.left_top(), square.right_bottom()], faint());
        }
    };
    let tiles = |rect: Rect| {
        let step = rect.height() / 4.0;
        for place in [vec2(1.4, 1.6), vec2(2.7, 2.4)] {
            painter.circle_filled(
                rect.min + place * step,
                step * 1.2,
                theme::ACCENT.gamma_multiply(0.4),
            );
        }
        for i in 0..=4_u8 {
            let at = step * f32::from(i);
            painter.hline(rect.left()..=rect.left() + 4.0 * step, rect.top() + at, faint());
            painter.vline(rect.left() + at, rect.top()..=rect.top() + 4.0 * step, faint());
        }
        let one = Rect::from_min_size(rect.min + vec2(2.0, 1.0) * step, Vec2::splat(step));
        painter.rect_stroke(
            one,
            0.0,
            Stroke::new(1.6, theme::TEXT),
            eframe::egui::StrokeKind::Middle,
        );
    };
    let square = |share: f32| {
        let at = pos2(rect.left() + rect.width() * share, rect.center().y);
        Rect::from_center_size(at, Vec2::splat(rect.height()))
    };
    match chosen {
        Backend::Raster => triangles(square(0.5)),
        Backend::Tiles => tiles(square(0.5)),
        Backend::Auto => {
            triangles(square(0.25));
            tiles(square(0.75));
        }
    }
}

/// A kernel as wide as was chosen, over the same at its natural width.
pub(super) fn extent(painter: &Painter, rect: Rect, kernel: Kernel, chosen: Option<f64>) {
    let shown = if kernel.natural_extent().is_some() { kernel } else { Kernel::Gaussian };
    let natural = shown.natural_extent().unwrap_or(1.0);
    let wide = chosen.filter(|_| shown == kernel).unwrap_or(natural * 1.5);
    let graph = Graph { rect, from: -REACH, to: REACH };
    // Of the same mass: the wider, the lower.
    let height = |extent: f64| (natural / extent).min(1.0);
    graph.line(painter, faint(), |x| height(natural) * weight(shown, None, x));
    graph.hill(painter, theme::ACCENT, |x| height(wide) * weight(shown, Some(wide), x));
    graph.samples(painter, 2);
}

/// How much opacity a length of matter has, of one that has it over a unit distance.
pub(super) fn unit_distance(painter: &Painter, rect: Rect) {
    let graph = Graph { rect, from: 0.0, to: 4.0 };
    graph.hill(painter, theme::ACCENT, |lengths| 1.0 - (1.0 - OPACITY).powf(lengths));
    let at = graph.at(1.0, OPACITY);
    painter.line_segment([graph.at(1.0, 0.0), at], faint());
    painter.circle_filled(at, 2.6, theme::TEXT);
    let words = "this thick";
    let place = at + vec2(8.0, 6.0);
    painter.text(place, Align2::LEFT_TOP, words, FontId::proportional(11.0), theme::TEXT_FAINT);
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Context, RawInput};

    use super::*;

    #[test]
    fn the_interpolating_curve_goes_through_every_sample_and_the_smooth_one_does_not() {
        let mut farthest = 0.0_f64;
        for (i, value) in SAMPLES.into_iter().enumerate() {
            let at = |r| blend(r, i as f64);
            assert!((at(Reconstruction::Interpolating) - value).abs() < 1e-4, "{i}");
            farthest = farthest.max((at(Reconstruction::Smooth) - value).abs());
        }
        assert!(farthest > 0.1, "{farthest}");
    }

    #[test]
    fn a_thin_layer_is_whole_where_it_is_pre_integrated_alone() {
        let layer = thin_layer();
        let last = RAY.len() as f64 - 1.0;
        let mass = |f: &dyn Fn(f64) -> f64| -> f64 {
            (0..5000).map(|i| f((f64::from(i) + 0.5) / 5000.0 * last)).sum::<f64>() / 5000.0
        };
        let truth = mass(&|x| layer.opacity_at(ray_value(x)));
        let off = |chosen| (mass(&|x| classified(&layer, chosen, x)) / truth - 1.0).abs();
        assert!(off(Classify::PreIntegrated) < 0.03, "{}", off(Classify::PreIntegrated));
        for chosen in [Classify::Before, Classify::After] {
            assert!(off(chosen) > 0.1, "{chosen:?} {}", off(chosen));
        }
    }

    #[test]
    fn every_choice_has_a_picture_of_its_own_and_none_leaves_its_frame() {
        let mut seen: Vec<(String, String)> = Vec::new();
        let mut look = |name: String, paint: &dyn Fn(&Painter, Rect)| {
            let ctx = Context::default();
            let pass = || {
                let mut output = ctx.run_ui(RawInput::default(), |ui| {
                    explained_ui(ui, "help", |painter, rect| paint(painter, rect));
                });
                // Nobody paints them.
                output.textures_delta.clear();
                output.shapes
            };
            drop(pass());
            let shapes = pass();
            let shown: Vec<_> = shapes.iter().map(|shape| format!("{:?}", shape.shape)).collect();
            for shape in shapes.iter().filter(|shape| !matches!(shape.shape, Shape::Noop)) {
                let bounds = shape.shape.visual_bounding_rect();
                let inside = bounds.intersect(shape.clip_rect);
                assert!(!inside.any_nan() && bounds.is_finite(), "{name}: {bounds}");
            }
            let shown = shown.concat();
            for (other, its) in &seen {
                assert!(*its != shown, "{name} looks like {other}");
            }
            seen.push((name, shown));
        };
        for one in Kernel::ALL {
            look(format!("{one:?}"), &|p, r| kernel(p, r, one));
        }
        for &one in Reconstruction::ALL {
            look(format!("{one:?}"), &|p, r| reconstruction(p, r, one));
        }
        for &one in Classify::ALL {
            look(format!("{one:?}"), &|p, r| classify(p, r, one));
        }
        for &one in Visibility::ALL {
            look(format!("{one:?}"), &|p, r| visibility(p, r, one));
        }
        for &one in OpacityModel::ALL {
            look(format!("{one:?}"), &|p, r| opacity_model(p, r, one));
        }
        for &one in Order::ALL {
            look(format!("{one:?}"), &|p, r| order(p, r, one));
        }
        for &one in Backend::ALL {
            look(format!("{one:?}"), &|p, r| backend(p, r, one));
        }
        for one in [Kernel::Cubic, Kernel::BSpline] {
            look(format!("extent of {one:?}"), &|p, r| extent(p, r, one, Some(2.5)));
        }
        look("unit distance".to_owned(), &unit_distance);
    }
}
