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
        (_, Visibility::Slabs, Classify::After) => 4,
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
    let words = format!(
        "Error at {} pixels (bars: 95 %) against the exact integral in float64 ({})",
        sweep.pixel_count(),
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
    if let Some(Ok(converged)) = sweep.converged() {
        let db = converged.sampled.psnr_db;
        if (bottom..top).contains(&db) {
            let dashes = DashedLineSeries::new([(from, db), (to, db)], 6, 6, FAINT.into());
            chart.draw_series(dashes).map_err(failed)?;
            let (x, y) = chart.backend_coord(&(from, db));
            let words = format!("converged, {} slabs", converged.convergence.slabs_per_voxel);
            area.draw(&Text::new(words, (x + 10, y - 20), style(16, FAINT))).map_err(failed)?;
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
        let [low, high] = mark.found.sampled.psnr_interval_db.map(|db| db.clamp(bottom, top));
        let bar = [(mark.at.0, low), (mark.at.0, high)];
        chart.draw_series(LineSeries::new(bar, colour.mix(0.5))).map_err(failed)?;
        let radius = if mark.number.is_some() { 8 } else { 5 };
        let dot = |radius: u32, colour: RGBColor| Circle::new(mark.at, radius, colour.filled());
        if mark.number.is_some() {
            chart.draw_series([dot(radius + 2, INK)]).map_err(failed)?;
        }
        chart.draw_series([dot(radius, colour)]).map_err(failed)?;
        if mark.setting.scale < 1.0 {
            chart.draw_series([dot(radius - 3, WHITE)]).map_err(failed)?;
        }
        if let Some(number) = mark.number {
            let (x, y) = chart.backend_coord(&mark.at);
            let right = style(20, INK).pos(Pos::new(HPos::Right, VPos::Bottom));
            area.draw(&Text::new(number.to_string(), (x - 8, y - 6), right)).map_err(failed)?;
        }
    }
    Ok(())
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
    for mark in &front {
        let found = mark.found;
        let number = mark.number.unwrap_or_default().to_string();
        text(number, 28, y, right(17))?;
        text(mark.setting.name.clone(), 38, y, style(17, INK))?;
        let digits = usize::from(found.median_ms() < 10.0);
        text(format!("{:.digits$}", found.median_ms()), 450, y, right(17))?;
        text(format!("{:.1}", found.sampled.psnr_db), 530, y, right(17))?;
        y += 26;
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
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(3.0, 60.0), [5.0, 10.0, 20.0, 50.0]);
        assert_eq!([0.9, 1.0, 4.9, 70.0].map(below), [0.5, 1.0, 2.0, 50.0]);
        assert_eq!(extremes([].into_iter()), (1.0, 10.0));
    }
}
