//! The chart of time against error, as a PNG.

use std::io::Cursor;

use image::{ExtendedColorType, ImageEncoder};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::report::Report;
use crate::accuracy::sweep::{Detail, Measured, Point, Setting};
use crate::scene::{Classify, Visibility};
use crate::task::sweep::Sweep;

/// Pixels of the chart, and of the list beside it.
const SIZE: [u32; 2] = [1640, 920];
const LIST_FROM: u32 = 1080;
/// Rows of the list that leave room for what the colours mean.
const LIST_ROWS: usize = 18;
/// Room for a name in the list, before the milliseconds.
const LIST_NAME_WIDTH: i32 = 345;
/// Of a dot on the front, with its rim.
const FRONT_RADIUS: i32 = 10;
const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(32, 36, 40);
const FAINT: RGBColor = RGBColor(150, 155, 160);
const GRID: RGBColor = RGBColor(226, 229, 232);

/// Ways of drawing that share a colour, told apart also by those who see few colours (Okabe and Ito).
const FAMILIES: [(&str, RGBColor); 6] = [
    ("every sample", RGBColor(230, 159, 0)),
    ("octree cuts", RGBColor(0, 158, 115)),
    ("sheets", RGBColor(204, 121, 167)),
    ("slabs, classified before", RGBColor(213, 94, 0)),
    ("slabs, classified after", RGBColor(86, 180, 233)),
    ("slabs, pre-integrated", RGBColor(0, 90, 160)),
];

fn family(setting: &Setting) -> usize {
    match (setting.detail, setting.splat.visibility, setting.splat.classify) {
        (Detail::Octree { .. }, ..) => 1,
        (_, Visibility::EverySample, _) => 0,
        (_, Visibility::Sheets, _) => 2,
        (_, Visibility::Slabs, Classify::Before) => 3,
        (_, Visibility::Slabs, Classify::After | Classify::Mean) => 4,
        (_, Visibility::Slabs, Classify::PreIntegrated) => 5,
    }
}

/// A point that was drawn, with its place on the chart.
struct Mark<'a> {
    setting: &'a Setting,
    found: &'a Measured,
    /// Milliseconds and dB.
    at: (f64, f64),
    /// Its number in the list, from 1, where it is on the front.
    number: Option<usize>,
}

type Outcome = Result<(), String>;
type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

/// The chart of a finished sweep of `file`.
///
/// # Errors
/// One sentence.
pub(super) fn png_bytes(sweep: &Sweep, file: &str) -> Result<Vec<u8>, String> {
    // The interface's own: charts look alike on every machine, and need no system font.
    register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| failed("the font cannot be read"))?;
    let [width, height] = SIZE;
    let mut rgb = vec![255; (width * height * 3) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
        draw(&root, sweep, file)?;
        root.present().map_err(failed)?;
    }
    let mut bytes = Cursor::new(Vec::new());
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(failed)?;
    Ok(bytes.into_inner())
}

fn failed(error: impl std::fmt::Display) -> String {
    format!("the plot could not be drawn: {error}; try without --plot")
}

fn draw(root: &Area<'_>, sweep: &Sweep, file: &str) -> Outcome {
    root.fill(&WHITE).map_err(failed)?;
    let marks = marks(sweep.points(), &sweep.front());
    let (left, right) = root.split_horizontally(LIST_FROM);
    chart(&left, &marks, sweep, file)?;
    list(&right, &marks, sweep)
}

/// Points that were drawn; without any error at all they are put above the rest.
fn marks<'a>(points: &'a [Point], front: &[usize]) -> Vec<Mark<'a>> {
    let finite = points
        .iter()
        .filter_map(|point| point.outcome.as_ref().ok())
        .map(|found| found.sampled.psnr_db)
        .filter(|db| db.is_finite());
    let top = finite.fold(20.0, f64::max) + 10.0;
    points
        .iter()
        .enumerate()
        .filter_map(|(i, point)| {
            let found = point.outcome.as_ref().ok()?;
            Some(Mark {
                setting: &point.setting,
                found,
                at: (found.median_ms(), found.sampled.psnr_db.min(top)),
                number: front.iter().position(|&on| on == i).map(|at| at + 1),
            })
        })
        .collect()
}

/// The least and greatest of some numbers; (1, 10) for none.
fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low <= high { (low, high) } else { (1.0, 10.0) }
}

/// The next 1, 2 or 5 times a power of ten at or below a number above 0.
fn below(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|v| *v <= value).unwrap_or(power)
}

/// 1, 2 and 5 times powers of ten from `low` to `high`.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let mut ticks = Vec::new();
    for exponent in -4..8 {
        ticks.extend([1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(exponent)));
    }
    ticks.retain(|t| (low..=high).contains(t));
    ticks
}

fn style(size: u32, colour: RGBColor) -> TextStyle<'static> {
    (FONT, size).into_font().color(&colour)
}

fn chart(area: &Area<'_>, marks: &[Mark<'_>], sweep: &Sweep, file: &str) -> Outcome {
    let [width, height] = sweep.size();
    area.draw(&Text::new("Accuracy against time", (84, 22), style(32, INK))).map_err(failed)?;
    let words =
        format!("{file}, {width} × {height} pixels, on {}", sweep.adapter().unwrap_or("nothing"));
    area.draw(&Text::new(words, (84, 62), style(18, INK))).map_err(failed)?;
    let (count, plural) = (sweep.pixel_count(), if sweep.pixel_count() == 1 { "" } else { "s" });
    let has_bars = marks.iter().any(|mark| mark.found.sampled.psnr_interval_db.is_some());
    let bars = if has_bars { " (bars: 95 %)" } else { "" };
    let words = format!(
        "Error at {count} pixel{plural}{bars} against the exact integral in float64 ({})",
        Report::truth_words(sweep)
    );
    area.draw(&Text::new(words, (84, 84), style(18, INK))).map_err(failed)?;

    let (quickest, slowest) = extremes(marks.iter().map(|mark| mark.at.0.max(1e-3)));
    let (least, most) = extremes(marks.iter().map(|mark| mark.at.1));
    let (from, to) = (below(quickest * 0.8), slowest * 1.4);
    let (bottom, top) = ((least / 5.0).floor() * 5.0 - 2.5, (most / 5.0).ceil() * 5.0 + 2.5);
    let mut chart = ChartBuilder::on(area)
        .margin_top(112)
        .margin_right(24)
        .margin_bottom(12)
        .margin_left(8)
        .x_label_area_size(58)
        .y_label_area_size(72)
        .build_cartesian_2d((from..to).log_scale(), bottom..top)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .y_labels(((top - bottom) / 5.0) as usize + 1)
        .x_label_formatter(&|_| String::new())
        .bold_line_style(GRID)
        .light_line_style(WHITE)
        .axis_style(FAINT)
        .x_desc("Time of one picture, ms")
        .y_desc("PSNR, dB (up is better)")
        .axis_desc_style(style(20, INK))
        .y_label_style(style(17, INK))
        .y_label_formatter(&|db| format!("{db:.0}"))
        .draw()
        .map_err(failed)?;
    // Ticks of a logarithmic axis by hand: 1, 2, 5, 10, …
    for tick in ticks(from, to) {
        let line = [(tick, bottom), (tick, top)];
        chart.draw_series(LineSeries::new(line, GRID)).map_err(failed)?;
        let (x, y) = chart.backend_coord(&(tick, bottom));
        let centred = style(17, INK).pos(Pos::new(HPos::Center, VPos::Top));
        area.draw(&Text::new(format!("{tick}"), (x, y + 8), centred)).map_err(failed)?;
    }
    let mut taken = Vec::new();
    if let Some(Ok(converged)) = sweep.converged() {
        let db = converged.sampled.psnr_db;
        if (bottom..top).contains(&db) {
            let dashes = DashedLineSeries::new([(from, db), (to, db)], 6, 6, FAINT.into());
            chart.draw_series(dashes).map_err(failed)?;
            let (x, y) = chart.backend_coord(&(from, db));
            let slabs = converged.convergence.slabs_per_voxel;
            let words = match converged.convergence.is_reached() {
                true => format!("converged, {slabs} slabs"),
                false => format!("{slabs} slabs, not converged"),
            };
            let style = style(16, FAINT);
            let [width, height] = text_size(area, &words, &style)?;
            taken.push(Rectangle::at([x + 10, y - 20], [width, height]));
            area.draw(&Text::new(words, (x + 10, y - 20), style)).map_err(failed)?;
        }
    }
    let mut front: Vec<&Mark<'_>> = marks.iter().filter(|mark| mark.number.is_some()).collect();
    front.sort_by_key(|mark| mark.number);
    // Until something slower is better, the error stays what it is: the front is a staircase.
    let mut stairs: Vec<(f64, f64)> = Vec::new();
    for mark in &front {
        stairs.extend(stairs.last().map(|last| (mark.at.0, last.1)));
        stairs.push(mark.at);
    }
    chart.draw_series(LineSeries::new(stairs, INK.stroke_width(2))).map_err(failed)?;
    let plain = marks.iter().filter(|mark| mark.number.is_none());
    for mark in plain.chain(front.iter().copied()) {
        let colour = FAMILIES[family(mark.setting)].1;
        if let Some(ends) = mark.found.sampled.psnr_interval_db {
            let bar = ends.map(|db| (mark.at.0, db.clamp(bottom, top)));
            chart.draw_series(LineSeries::new(bar, colour.mix(0.5))).map_err(failed)?;
        }
        let radius = if mark.number.is_some() { FRONT_RADIUS - 2 } else { 5 };
        let dot = |radius: i32, colour: RGBColor| Circle::new(mark.at, radius, colour.filled());
        if mark.number.is_some() {
            chart.draw_series([dot(FRONT_RADIUS, INK)]).map_err(failed)?;
        }
        chart.draw_series([dot(radius, colour)]).map_err(failed)?;
        if mark.setting.scale < 1.0 {
            chart.draw_series([dot(radius - 3, WHITE)]).map_err(failed)?;
        }
    }
    // Numbers last: over the dots. One that fits nowhere is left out; the list has it.
    let place = |mark: &Mark<'_>| <[i32; 2]>::from(chart.backend_coord(&mark.at));
    taken.extend(front.iter().map(|mark| Rectangle::around(place(mark), FRONT_RADIUS)));
    for mark in front {
        let number = mark.number.unwrap_or_default().to_string();
        let style = style(20, INK);
        let size = text_size(area, &number, &style)?;
        if let Some(corner) = label_corner(place(mark), size, &mut taken) {
            area.draw(&Text::new(number, corner.into(), style)).map_err(failed)?;
        }
    }
    Ok(())
}

/// Pixels of the chart, from the upper left corner to before the lower right one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rectangle {
    low: [i32; 2],
    high: [i32; 2],
}

impl Rectangle {
    fn at(low: [i32; 2], size: [i32; 2]) -> Self {
        Self { low, high: [0, 1].map(|axis| low[axis] + size[axis]) }
    }

    fn around(centre: [i32; 2], radius: i32) -> Self {
        Self::at(centre.map(|c| c - radius), [2 * radius; 2])
    }

    fn meets(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] < other.high[axis] && other.low[axis] < self.high[axis])
    }
}

/// The upper left corner of a label beside a dot on the front, where it covers nothing that is
/// taken; it then is taken, too.
fn label_corner(dot: [i32; 2], size: [i32; 2], taken: &mut Vec<Rectangle>) -> Option<[i32; 2]> {
    let [x, y] = dot;
    let [width, height] = size;
    let (left, right) = (x - FRONT_RADIUS - width, x + FRONT_RADIUS);
    let (above, below) = (y - FRONT_RADIUS / 2 - height, y + FRONT_RADIUS / 2);
    let corners = [[left, above], [right, below], [right, above], [left, below]];
    let corner = corners.into_iter().find(|&corner| {
        let label = Rectangle::at(corner, size);
        taken.iter().all(|other| !label.meets(other))
    })?;
    taken.push(Rectangle::at(corner, size));
    Some(corner)
}

fn text_size(area: &Area<'_>, words: &str, style: &TextStyle<'_>) -> Result<[i32; 2], String> {
    let (width, height) = area.estimate_text_size(words, style).map_err(failed)?;
    Ok([width, height].map(|pixels| i32::try_from(pixels).unwrap_or(i32::MAX / 2)))
}

/// As much of some words as is at most so wide.
fn shortened(
    area: &Area<'_>,
    words: &str,
    style: &TextStyle<'_>,
    width: i32,
) -> Result<String, String> {
    let mut short = words.to_owned();
    let mut kept = words.chars().count();
    while text_size(area, &short, style)?[0] > width && kept > 1 {
        kept -= 1;
        short = words.chars().take(kept).chain(['…']).collect();
    }
    Ok(short)
}

/// The front by name, and what the colours mean.
fn list(area: &Area<'_>, marks: &[Mark<'_>], sweep: &Sweep) -> Outcome {
    let text = |words: String, x: i32, y: i32, style: TextStyle<'static>| {
        area.draw(&Text::new(words, (x, y), style)).map_err(failed)
    };
    let right = |size| style(size, INK).pos(Pos::new(HPos::Right, VPos::Top));
    text("The front: no other is as quick and as good".to_owned(), 8, 114, style(20, INK))?;
    text("ms".to_owned(), 450, 146, right(16))?;
    text("dB".to_owned(), 530, 146, right(16))?;
    let mut front: Vec<&Mark<'_>> = marks.iter().filter(|mark| mark.number.is_some()).collect();
    front.sort_by_key(|mark| mark.number);
    let mut y = 170;
    let rows = front.len().min(LIST_ROWS);
    for mark in &front[..rows] {
        let found = mark.found;
        let number = mark.number.unwrap_or_default().to_string();
        text(number, 28, y, right(17))?;
        let name = shortened(area, &mark.setting.name, &style(17, INK), LIST_NAME_WIDTH)?;
        text(name, 38, y, style(17, INK))?;
        let digits = usize::from(found.median_ms() < 10.0);
        text(format!("{:.digits$}", found.median_ms()), 450, y, right(17))?;
        text(format!("{:.1}", found.sampled.psnr_db), 530, y, right(17))?;
        y += 26;
    }
    if rows < front.len() {
        text(format!("and {} more: see the table", front.len() - rows), 38, y, style(17, INK))?;
    }
    y = (y + 24).max(560);
    for (name, colour) in FAMILIES {
        area.draw(&Circle::new((18, y + 7), 6, colour.filled())).map_err(failed)?;
        text(name.to_owned(), 38, y, style(17, INK))?;
        y += 25;
    }
    area.draw(&Circle::new((18, y + 7), 6, FAINT.filled())).map_err(failed)?;
    area.draw(&Circle::new((18, y + 7), 3, WHITE.filled())).map_err(failed)?;
    text("drawn smaller and enlarged".to_owned(), 38, y, style(17, INK))?;
    let undrawn = sweep.points().len() - marks.len();
    if undrawn > 0 {
        text(format!("{undrawn} could not be drawn: see the table"), 8, y + 34, style(17, INK))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_beside_their_dots_and_never_on_one_another() {
        let size = [11, 20];
        // Dots that are all but one: four corners, and no more.
        let mut taken = Vec::new();
        let corners: Vec<_> =
            (0..6).map(|i| label_corner([100 + i / 3, 100], size, &mut taken)).collect();
        assert_eq!(corners.iter().flatten().count(), 4, "{corners:?}");
        for (i, label) in taken.iter().enumerate() {
            assert!(taken[..i].iter().all(|other| !label.meets(other)), "{taken:?}");
        }
        // Alone it is above, to the left; other dots are not covered either.
        let alone = label_corner([100, 100], size, &mut Vec::new());
        assert_eq!(alone, Some([79, 75]));
        let mut dots = vec![Rectangle::around([85, 85], FRONT_RADIUS)];
        assert_eq!(label_corner([100, 100], size, &mut dots), Some([110, 105]));
        let [a, b] = [[0, 0], [10, 0]].map(|low| Rectangle::at(low, [10, 10]));
        assert!(!a.meets(&b) && a.meets(&Rectangle::at([9, 9], [5, 5])), "edges may touch");
    }

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(3.0, 60.0), [5.0, 10.0, 20.0, 50.0]);
        assert_eq!([0.9, 1.0, 4.9, 70.0].map(below), [0.5, 1.0, 2.0, 50.0]);
        assert_eq!(extremes([].into_iter()), (1.0, 10.0));
    }
}
