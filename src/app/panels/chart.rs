//! The chart of time against error, mode by mode.

use eframe::egui::accesskit::Role;
use eframe::egui::{
    CornerRadius, CursorIcon, FontId, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape,
    Stroke, Tooltip, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use super::axes::{AROUND, Axes, paint_axes};
use super::legend::{Mark, legend_ui};
use crate::app::measuring::{ChartPoint, front, is_of};
use crate::app::{theme, words};
use crate::scene::SplatSettings;
use crate::task::remaining::WITHIN_DB;

/// Room for the numbers left of and below the graph, and around it, points.
const LEFT: f32 = 40.0;
const BELOW: f32 = 22.0;
/// A pointer this close to a point means it, points.
const NEAR: f32 = 12.0;
/// The graph is never made lower than this for the legend, points.
const LEAST_HEIGHT: f32 = 96.0;
/// The smallest chart that can be read, points.
pub const LEAST_SIZE: Vec2 = vec2(116.0, 74.0);
/// What the chart shows beside the points.
#[derive(Debug, Clone, Copy)]
pub struct Marks<'a> {
    /// The mode on screen.
    pub first: &'a SplatSettings,
    /// The mode it is compared with.
    pub second: Option<&'a SplatSettings>,
    /// The mode that files of the kind open in.
    pub default: SplatSettings,
    /// Whether the points are of an earlier view.
    pub is_old: bool,
    /// What the picture on screen was found to have, dB, where that is known.
    pub picture_db: Option<f64>,
}

/// A point that was clicked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Picked {
    /// Which one.
    pub index: usize,
    /// With Shift: to be compared with.
    pub as_second: bool,
}

/// The chart, as large as the room there is; the point that was clicked.
pub fn chart_ui(
    ui: &mut Ui,
    size: Vec2,
    points: &[ChartPoint],
    marks: Marks<'_>,
) -> Option<Picked> {
    let (outer, response) = ui.allocate_exact_size(size, Sense::click());
    let picture = marks.picture_db.map(|db| words::decibels_within(db, WITHIN_DB));
    let label = match &picture {
        Some(level) => format!("Time against error; picture on screen: {level}"),
        None => "Time against error".to_owned(),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, label.clone()));
    let painter = ui.painter_at(outer);
    painter.rect_filled(outer, CornerRadius::same(5), theme::WELL);
    let front = front(points);
    let legend = legend_marks(points, &front, marks);
    let room = Rect::from_min_max(outer.min + vec2(LEFT, 0.0), outer.max - vec2(AROUND, 4.0));
    let legend_height = legend_ui(ui, room, LEAST_HEIGHT + BELOW + AROUND, &legend);
    let corner = vec2(AROUND + 4.0, BELOW + legend_height);
    let rect = Rect::from_min_max(outer.min + vec2(LEFT, AROUND), outer.max - corner);
    if size.x < LEAST_SIZE.x || size.y < LEAST_SIZE.y {
        return None;
    }
    let axes = Axes::around(rect, points);
    let mut taken = Vec::new();
    paint_axes(&painter, axes, &mut taken);
    if let Some((db, level)) = marks.picture_db.filter(|db| db.is_finite()).zip(picture) {
        picture_ui(&painter, axes, (db, &level), &mut taken);
    }
    if points.is_empty() {
        let font = FontId::proportional(12.5);
        let text = "Points appear here as modes are measured";
        let galley = painter.layout(text.to_owned(), font, theme::TEXT_FAINT, rect.width());
        painter.galley(rect.center() - galley.size() / 2.0, galley, theme::TEXT_FAINT);
        return None;
    }
    let places: Vec<(usize, Pos2)> = points
        .iter()
        .enumerate()
        .filter(|(_, point)| point.failed.is_none())
        .map(|(index, point)| (index, axes.at(point.ms, point.db)))
        .collect();
    // The points' own places must not hide the pointer from the chart.
    let pointer = ui.input(|input| input.pointer.hover_pos());
    let near = pointer.filter(|_| response.contains_pointer()).and_then(|at| nearest(&places, at));
    let mut picked = near.filter(|_| response.clicked());
    let mut focused = None;
    for &(index, place) in &places {
        let named = named_point_ui(ui, &response, index, &points[index], place);
        if named.clicked() {
            // By hand the nearest is meant, by key this one.
            let by_hand = named.clicked_by(PointerButton::Primary);
            picked = if by_hand { near } else { Some(index) };
        }
        if named.has_focus() {
            focused = Some(index);
        }
    }
    let shown = near.or(focused);
    paint_front(&painter, front.iter().map(|&i| axes.at(points[i].ms, points[i].db)), marks.is_old);
    for &(index, place) in &places {
        let look = Look { is_best: front.contains(&index), is_shown: shown == Some(index) };
        paint_point(&painter, axes, &points[index], place, marks, look);
    }
    let is_default = |&&(index, _): &&(usize, Pos2)| is_of(&points[index], &marks.default);
    for &(_, place) in places.iter().filter(is_default) {
        default_ui(&painter, axes, place, &taken);
    }
    if let Some(index) = shown {
        let point = &points[index];
        if near.is_some() && point.settings.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
        }
        let place = axes.at(point.ms, point.db);
        let tooltip_id = response.id.with("tooltip");
        Tooltip::always_open(ui.ctx().clone(), ui.layer_id(), tooltip_id, place).gap(12.0).show(
            |ui| ui.label(hover_words(point, front.contains(&index), is_of(point, &marks.default))),
        );
    }
    let as_second = ui.input(|input| input.modifiers.shift);
    picked
        .filter(|&index| points[index].settings.is_some())
        .map(|index| Picked { index, as_second })
}

/// The level that the picture on screen was found to have, and within what, across the graph.
fn picture_ui(painter: &Painter, axes: Axes, (db, level): (f64, &str), taken: &mut Vec<Rect>) {
    let height = |db: f64| axes.at(1.0, db).y.clamp(axes.rect.top(), axes.rect.bottom());
    let (low, high) = (height(db - WITHIN_DB), height(db + WITHIN_DB));
    let band = Rect::from_x_y_ranges(axes.rect.x_range(), high..=low);
    painter.rect_filled(band, CornerRadius::ZERO, theme::TEXT.gamma_multiply(0.08));
    let y = height(db);
    painter.hline(axes.rect.x_range(), y, Stroke::new(1.0, theme::TEXT.gamma_multiply(0.5)));
    let font = FontId::proportional(11.0);
    let words = format!("picture on screen, {level}");
    let words = painter.layout_no_wrap(words, font, theme::TEXT_FAINT);
    let [left, right] = [axes.rect.left() + 6.0, axes.rect.right() - 6.0 - words.size().x];
    let [over, under] = [y - 2.0 - words.size().y, y + 2.0];
    let places = [pos2(right, over), pos2(right, under), pos2(left, over), pos2(left, under)];
    if let Some(place) = free_place(axes, words.size(), places, taken) {
        // No line goes through the words.
        painter.rect_filled(place.expand2(vec2(2.0, 0.0)), CornerRadius::ZERO, theme::WELL);
        painter.galley(place.min, words, theme::TEXT_FAINT);
        taken.push(place);
    }
}

/// The first of the places for words of a size that lies in the graph, on no other words.
fn free_place(axes: Axes, size: Vec2, places: [Pos2; 4], taken: &[Rect]) -> Option<Rect> {
    let places = places.into_iter().map(|place| Rect::from_min_size(place, size));
    places
        .filter(|place| axes.rect.contains_rect(*place))
        .find(|place| !taken.iter().any(|taken| taken.intersects(*place)))
}

/// What of the marks there is to be explained.
fn legend_marks(points: &[ChartPoint], front: &[usize], marks: Marks<'_>) -> Vec<Mark> {
    let drawn = |index: &usize| points[*index].failed.is_none();
    let mut found = Vec::new();
    for index in (0..points.len()).filter(drawn) {
        let point = &points[index];
        found.push(mark_of(point, front.contains(&index)));
        found.extend(is_of(point, marks.first).then_some(Mark::OnScreen));
        let is_second = marks.second.is_some_and(|second| is_of(point, second));
        found.extend(is_second.then_some(Mark::Compared));
    }
    let all = [Mark::Best, Mark::Beaten, Mark::Aside, Mark::OnScreen, Mark::Compared];
    all.into_iter().filter(|mark| found.contains(mark)).collect()
}

/// How a point is painted.
fn mark_of(point: &ChartPoint, is_best: bool) -> Mark {
    match point.settings {
        None => Mark::Aside,
        Some(_) if point.on_front || is_best => Mark::Best,
        Some(_) => Mark::Beaten,
    }
}

/// A point for those who do not see it: its name and numbers, and a click without a pointer.
fn named_point_ui(
    ui: &Ui,
    chart: &Response,
    index: usize,
    point: &ChartPoint,
    place: Pos2,
) -> Response {
    let area = Rect::from_center_size(place, Vec2::ZERO);
    let response = ui.interact(area, chart.id.with(("point", index)), Sense::click());
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Button, point.settings.is_some(), point_words(point))
    });
    response
}

/// A point's name and numbers in one line.
pub fn point_words(point: &ChartPoint) -> String {
    format!("{}: {}", point.name, number_words(point))
}

/// A point's numbers: `412 ms, 41.2 ± 0.3 dB`.
pub fn number_words(point: &ChartPoint) -> String {
    let time = words::milliseconds(point.ms);
    let level = match point.db {
        db if db.is_finite() => format!("{db:.1} dB"),
        db => words::decibels(db),
    };
    match point.ci {
        ci if ci.is_finite() && ci >= 0.05 && point.db.is_finite() => {
            format!("{time}, {:.1} ± {ci:.1} dB", point.db)
        }
        _ => format!("{time}, {level}"),
    }
}

fn hover_words(point: &ChartPoint, is_best: bool, is_default: bool) -> String {
    let what = match (&point.settings, point.on_front, is_best) {
        (None, ..) => "Not a mode of its own, for comparison only",
        (Some(_), true, _) => "Nothing is both quicker and better",
        (Some(_), false, true) => "No other mode is both quicker and better",
        (Some(_), false, false) => "Another mode is both quicker and better",
    };
    let how = match point.settings {
        Some(_) => "\nClick to use it, Shift+click to compare with it",
        None => "",
    };
    let default = if is_default { ", the default" } else { "" };
    format!("{}{default}\n{}\n{what}{how}", point.name, number_words(point))
}

/// The point nearest to `at`, within reach.
fn nearest(places: &[(usize, Pos2)], at: Pos2) -> Option<usize> {
    super::curve::nearest(places.iter().map(|&(index, place)| (index, place.distance(at))), NEAR)
}

/// Steps along what can be had for each time, quickest first.
fn paint_front(painter: &Painter, front: impl Iterator<Item = Pos2>, is_old: bool) {
    let mut line: Vec<Pos2> = Vec::new();
    for place in front {
        line.extend(line.last().map(|last| pos2(place.x, last.y)));
        line.push(place);
    }
    let strength = if is_old { 0.25 } else { 0.55 };
    painter.add(Shape::line(line, Stroke::new(1.5, theme::ACCENT.gamma_multiply(strength))));
}

/// What is special about a point.
#[derive(Debug, Clone, Copy)]
struct Look {
    /// No other mode is both quicker and better.
    is_best: bool,
    /// It is pointed at.
    is_shown: bool,
}

fn paint_point(
    painter: &Painter,
    axes: Axes,
    point: &ChartPoint,
    place: Pos2,
    marks: Marks<'_>,
    look: Look,
) {
    let colour = match (marks.is_old, point.on_front || look.is_best) {
        (true, _) => theme::TEXT_FAINT.gamma_multiply(0.45),
        (false, true) => theme::ACCENT,
        (false, false) => theme::TEXT_FAINT,
    };
    if point.ci.is_finite() && point.db.is_finite() {
        let (low, high) =
            (axes.at(point.ms, point.db - point.ci), axes.at(point.ms, point.db + point.ci));
        if low.y - high.y > 2.0 {
            let stroke = Stroke::new(1.0, colour.gamma_multiply(0.6));
            painter.line_segment([low, high], stroke);
        }
    }
    mark_of(point, look.is_best).paint(painter, place, look.is_shown, marks.is_old);
    if is_of(point, marks.first) {
        Mark::OnScreen.paint(painter, place, false, false);
    }
    if marks.second.is_some_and(|second| is_of(point, second)) {
        Mark::Compared.paint(painter, place, false, false);
    }
}

/// Names the default beside its point, where there is room for it.
fn default_ui(painter: &Painter, axes: Axes, at: Pos2, taken: &[Rect]) {
    let font = FontId::proportional(11.0);
    let words = painter.layout_no_wrap("Default".to_owned(), font, theme::TEXT_FAINT);
    let size = words.size();
    let [left, right] = [at.x - 11.0 - size.x, at.x + 11.0];
    let [over, under] = [at.y - 3.0 - size.y, at.y + 3.0];
    let places = [pos2(right, under), pos2(left, under), pos2(right, over), pos2(left, over)];
    if let Some(place) = free_place(axes, size, places, taken) {
        painter.galley(place.min, words, theme::TEXT_FAINT);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeSet;

    use eframe::egui::epaint::ClippedShape;
    use eframe::egui::{Context, RawInput};

    use super::*;

    pub(crate) fn point(ms: f64, db: f64) -> ChartPoint {
        ChartPoint {
            name: "mode".into(),
            ms,
            db,
            ci: 0.25,
            settings: None,
            on_front: false,
            failed: None,
        }
    }

    /// What is painted of a chart of this size, each shape with what it is cut off at.
    fn painted(size: Vec2, points: &[ChartPoint], second: bool) -> Vec<ClippedShape> {
        painted_beside(size, points, second, None)
    }

    /// The same of a picture on screen of such a level.
    fn painted_beside(
        size: Vec2,
        points: &[ChartPoint],
        second: bool,
        picture_db: Option<f64>,
    ) -> Vec<ClippedShape> {
        let (exact, classic) = (SplatSettings::EXACT, SplatSettings::SHADE_FIRST);
        let second = second.then_some(&classic);
        let marks = Marks { first: &exact, second, default: exact, is_old: false, picture_db };
        let ctx = Context::default();
        let pass = || {
            let input = RawInput {
                screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(900.0, 500.0))),
                ..RawInput::default()
            };
            let mut output = ctx.run_ui(input, |ui| {
                chart_ui(ui, size, points, marks);
            });
            // Nobody paints them.
            output.textures_delta.clear();
            output.shapes
        };
        drop(pass());
        pass()
    }

    fn texts(shapes: &[ClippedShape]) -> Vec<String> {
        let text = |shape: &ClippedShape| match &shape.shape {
            Shape::Text(text) => Some(text.galley.text().to_owned()),
            _ => None,
        };
        shapes.iter().filter_map(text).collect()
    }

    /// Modes that differ little or much in time and level.
    fn sets_of_points() -> Vec<Vec<ChartPoint>> {
        let (exact, classic) = (SplatSettings::EXACT, SplatSettings::SHADE_FIRST);
        let of = |settings, ms, db| ChartPoint { settings, ..point(ms, db) };
        vec![
            vec![of(Some(exact), 14.1, 42.0)],
            vec![of(Some(exact), 320.0, 41.0), of(Some(classic), 240.0, 41.5)],
            vec![of(Some(exact), 980.0, 88.0), of(Some(classic), 0.2, 9.0), of(None, 0.1, 5.0)],
            vec![of(Some(exact), 0.3, 36.0), of(Some(classic), 4000.0, 44.0)],
        ]
    }

    #[test]
    fn a_chart_of_any_size_has_a_number_at_each_axis() {
        for (set, points) in sets_of_points().into_iter().enumerate() {
            for width in [116.0, 120.0, 150.0, 300.0, 700.0] {
                for height in [74.0, 90.0, 130.0, 170.0, 300.0] {
                    let found = texts(&painted(vec2(width, height), &points, true));
                    let times = found.iter().filter(|t| t.ends_with(" ms") || t.ends_with(" s"));
                    let levels = found.iter().filter(|t| t.parse::<f64>().is_ok());
                    let (times, levels) = (times.count(), levels.count());
                    let at = format!("{set}: {width} × {height}: {found:?}");
                    assert!(times >= 1 && levels >= 1, "{at}");
                    assert!(times >= 2 && levels >= 2 || width < 300.0 || height < 300.0, "{at}");
                }
            }
        }
        let too_small = texts(&painted(LEAST_SIZE - vec2(1.0, 0.0), &sets_of_points()[2], true));
        assert!(too_small.is_empty(), "{too_small:?}");
    }

    #[test]
    fn words_in_the_graph_lie_on_no_others_and_are_there_where_there_is_room() {
        let is_in_graph = |text: &str| {
            ["Default", "time to draw a picture"].contains(&text)
                || ["picture on screen", "dB: higher is better"].iter().any(|t| text.starts_with(t))
        };
        let mut found = BTreeSet::new();
        for points in sets_of_points() {
            for db in [9.0, 12.0, 20.0, 36.5, 41.0, 43.9, 87.0] {
                for size in
                    [vec2(150.0, 90.0), vec2(300.0, 150.0), vec2(454.0, 204.0), vec2(700.0, 204.0)]
                {
                    let shapes = painted_beside(size, &points, false, Some(db));
                    let words = shapes.iter().filter_map(|shape| match &shape.shape {
                        Shape::Text(text) if is_in_graph(text.galley.text()) => {
                            Some((text.galley.text().to_owned(), text.visual_bounding_rect()))
                        }
                        _ => None,
                    });
                    let words: Vec<(String, Rect)> = words.collect();
                    for (i, (one, at)) in words.iter().enumerate() {
                        for (other, there) in &words[..i] {
                            assert!(!at.intersects(*there), "{size} {db}: {one} on {other}");
                        }
                    }
                    if size.x > 400.0 {
                        assert!(words.len() >= 3, "{size} {db}: {words:?}");
                        found.extend(words.into_iter().map(|(words, _)| words));
                    }
                }
            }
        }
        assert!(found.contains("Default") && found.len() > 8, "{found:?}");
    }

    #[test]
    fn no_word_and_no_mark_of_the_legend_is_cut_off() {
        let points = sets_of_points().swap_remove(2);
        let mut rows = BTreeSet::new();
        for width in [150.0, 200.0, 254.0, 294.0, 374.0, 454.0, 700.0] {
            for height in [90.0, 170.0, 190.0, 204.0, 260.0, 400.0] {
                let outer = Rect::from_min_size(Pos2::ZERO, vec2(width, height)).expand(8.0);
                let shapes = painted(vec2(width, height), &points, true);
                let legend: Vec<_> =
                    shapes.iter().filter(|s| s.clip_rect.left() > LEFT - 1.0).collect();
                let mut lines = BTreeSet::new();
                for ClippedShape { clip_rect, shape, .. } in legend {
                    let is_whole = clip_rect.contains_rect(shape.visual_bounding_rect());
                    assert!(is_whole, "{width} × {height}: {shape:?} in {clip_rect}");
                    assert!(outer.contains_rect(*clip_rect), "{clip_rect} of {outer}");
                    if let Shape::Text(text) = shape {
                        lines.insert(text.pos.y as i32);
                    }
                }
                rows.insert(lines.len());
            }
        }
        assert!(rows.contains(&0) && rows.contains(&1) && rows.len() > 3, "{rows:?}");
    }

    #[test]
    fn the_legend_explains_what_there_is_and_nothing_else() {
        let (exact, classic) = (SplatSettings::EXACT, SplatSettings::SHADE_FIRST);
        let marks = |second| Marks {
            first: &exact,
            second,
            default: exact,
            is_old: false,
            picture_db: None,
        };
        let of = |settings, ms, db| ChartPoint { settings, ..point(ms, db) };
        let points = [of(Some(exact), 10.0, 40.0), of(Some(classic), 20.0, 30.0)];
        let front = front(&points);
        assert_eq!(
            legend_marks(&points, &front, marks(None)),
            [Mark::Best, Mark::Beaten, Mark::OnScreen]
        );
        assert!(legend_marks(&points, &front, marks(Some(&classic))).contains(&Mark::Compared));
        let aside = [of(None, 5.0, 20.0)];
        assert_eq!(legend_marks(&aside, &[], marks(None)), [Mark::Aside]);
        let failed = [ChartPoint { failed: Some("no".into()), ..points[0].clone() }];
        assert_eq!(legend_marks(&failed, &[], marks(None)), []);
    }

    #[test]
    fn numbers_are_given_with_what_they_are_worth() {
        assert_eq!(number_words(&point(412.0, 41.234)), "412 ms, 41.2 ± 0.2 dB");
        assert_eq!(number_words(&point(8.0, f64::INFINITY)), "8.0 ms, more than 99 dB");
        let high = ChartPoint { ci: 0.01, ..point(8.0, 118.32) };
        assert_eq!(number_words(&high), "8.0 ms, 118.3 dB");
        let sure = ChartPoint { ci: 0.01, ..point(2000.0, 30.0) };
        assert_eq!(number_words(&sure), "2.0 s, 30.0 dB");
    }

    #[test]
    fn the_nearest_point_within_reach_is_meant() {
        let places = [(3, pos2(10.0, 10.0)), (7, pos2(18.0, 10.0))];
        assert_eq!(nearest(&places, pos2(15.0, 10.0)), Some(7));
        assert_eq!(nearest(&places, pos2(13.0, 10.0)), Some(3));
        assert_eq!(nearest(&places, pos2(60.0, 10.0)), None);
    }
}
