//! What accuracy costs here: the chart, the walk along its front, and how good estimates were.

use eframe::egui::{
    Align, FontId, Label, Layout, ProgressBar, RichText, Slider, Ui, UiBuilder, vec2,
};

use super::chart::{LEAST_SIZE, Marks, Picked, chart_ui, number_words};
use super::name_ui;
use crate::app::measuring::{
    ChartPoint, EstimateRecord, State, best_within, front, is_of, quickest_with,
};
use crate::app::settings::CONVERGE_WITHIN_MS;
use crate::app::{modes, theme, words};
use crate::scene::SplatSettings;

/// Width of the column beside the chart, points: the first where there is room for it.
const COLUMN: [f32; 2] = [312.0, 220.0];
/// Share of the panel that the column takes where there is not.
const COLUMN_SHARE: f32 = 0.55;
/// Height of the row that says how the job stands, points.
const ROW: f32 = 20.0;

/// Size of what is said of it, and height that it leaves to the line below, points.
const DEFAULT_SIZE: f32 = 12.0;
const BELOW_DEFAULT: f32 = 19.0;

/// What the slider gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Walk {
    /// The best picture within a time.
    #[default]
    Time,
    /// The quickest picture with a level.
    Level,
}

/// What the panel remembers of itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AccuracyPanel {
    /// Whether it is shown.
    pub open: bool,
    /// What the slider gives.
    pub walk: Walk,
    /// Where the slider stands, milliseconds or dB; `None` until it is touched.
    pub stands_at: Option<f64>,
}

/// What is shown.
pub struct Shown<'a> {
    /// The chart's points.
    pub points: &'a [ChartPoint],
    /// How they are marked.
    pub marks: Marks<'a>,
    /// How the job stands.
    pub state: &'a State,
    /// Share done.
    pub fraction: f32,
    /// The size they are measured at, pixels.
    pub size: [u32; 2],
    /// How good estimates were.
    pub record: &'a EstimateRecord,
    /// Whether a view at rest is refined further by itself, once the panel is closed.
    pub refines: bool,
}

/// What the hand did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Done {
    /// The mode to draw with.
    pub first: Option<SplatSettings>,
    /// The mode to compare with.
    pub second: Option<SplatSettings>,
    /// Measure again from the start.
    pub again: bool,
}

/// The panel, as large as the room there is.
pub fn accuracy_ui(ui: &mut Ui, panel: &mut AccuracyPanel, shown: &Shown<'_>) -> Done {
    let mut done = Done::default();
    let room = ui.available_rect_before_wrap();
    let mut chart_room = room;
    let column = (room.width() * COLUMN_SHARE).clamp(COLUMN[1], COLUMN[0]);
    chart_room.max.x = (room.max.x - column - 14.0).max(room.min.x);
    let mut column_room = room;
    // A well without a chart in it would be of no use to anybody.
    let has_chart = chart_room.width() >= LEAST_SIZE.x;
    if has_chart {
        column_room.min.x = (chart_room.max.x + 14.0).min(room.max.x);
        ui.scope_builder(UiBuilder::new().max_rect(chart_room), |ui| {
            let picked = chart_ui(ui, chart_room.size(), shown.points, shown.marks);
            if let Some(Picked { index, as_second }) = picked {
                let mode = shown.points[index].settings;
                *(if as_second { &mut done.second } else { &mut done.first }) = mode;
                if !as_second {
                    panel.stands_at = None;
                }
            }
        });
    }
    let mut column = ui.new_child(UiBuilder::new().max_rect(column_room));
    column.shrink_clip_rect(column_room);
    column.set_min_width(column_room.width());
    state_ui(&mut column, shown, &mut done);
    walk_ui(&mut column, panel, shown, &mut done);
    chosen_ui(&mut column, shown);
    default_ui(&mut column, shown);
    record_ui(&mut column, shown.record);
    if !has_chart {
        let text = RichText::new("The chart needs a wider window, or no side panel (F9)");
        column.add(Label::new(text.color(theme::TEXT_FAINT).size(12.0)).wrap());
    }
    ui.advance_cursor_after_rect(room);
    done
}

/// So many modes.
fn modes(count: usize) -> String {
    if count == 1 { "1 mode".to_owned() } else { format!("{count} modes") }
}

fn state_ui(ui: &mut Ui, shown: &Shown<'_>, done: &mut Done) {
    let failed = shown.points.iter().filter(|point| point.failed.is_some()).count();
    let drawn = shown.points.len() - failed;
    let [width, height] = shown.size;
    let size = format!("{width} × {height} pixels");
    let (words, detail) = match shown.state {
        State::Waiting if shown.points.is_empty() => {
            ("Waits until the view rests".to_owned(), size)
        }
        State::Waiting => ("Paused until the view rests".to_owned(), size),
        State::Measuring if drawn == 0 || shown.marks.is_old => {
            ("Working out the exact picture".to_owned(), size)
        }
        State::Measuring => (format!("Measuring, {} so far", modes(drawn)), size),
        State::Done => (format!("{} measured", modes(drawn)), size),
        State::Failed(reason) => ("Cannot measure here".to_owned(), reason.clone()),
    };
    // What is at the right comes first: the words have the room that it leaves.
    let row = Layout::right_to_left(Align::Center);
    ui.allocate_ui_with_layout(vec2(ui.available_width(), ROW), row, |ui| {
        match shown.state {
            State::Measuring | State::Waiting => {
                let bar = ProgressBar::new(shown.fraction.clamp(0.0, 1.0)).desired_height(5.0);
                ui.add(bar.desired_width(64.0).fill(theme::ACCENT.gamma_multiply(0.8)))
                    .accessible_name("Modes measured")
                    .on_hover_text("Measuring goes on only while nothing moves");
            }
            State::Done | State::Failed(_) => {
                let button = ui.small_button("Again").accessible_name("Measure again");
                if button.on_hover_text("Measure every mode once more").clicked() {
                    done.again = true;
                }
            }
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.add(Label::new(RichText::new(words).strong()).truncate()).on_hover_text(&detail);
        });
    });
    if let State::Failed(reason) = shown.state {
        ui.add(Label::new(RichText::new(reason).color(theme::TEXT_FAINT)).truncate());
    } else if failed > 0 {
        let first = shown.points.iter().find_map(|point| point.failed.as_deref());
        let words = match failed {
            1 => "One mode could not be drawn".to_owned(),
            n => format!("{n} modes could not be drawn"),
        };
        ui.label(RichText::new(words).color(theme::TEXT_FAINT).size(12.0))
            .on_hover_text(first.unwrap_or_default());
    }
}

fn walk_ui(ui: &mut Ui, panel: &mut AccuracyPanel, shown: &Shown<'_>, done: &mut Done) {
    ui.horizontal(|ui| {
        name_ui(ui, "Choose by");
        let before = panel.walk;
        ui.selectable_value(&mut panel.walk, Walk::Time, "Time")
            .on_hover_text("The slider says what a picture may take; the best mode for it is used");
        ui.selectable_value(&mut panel.walk, Walk::Level, "Error")
            .on_hover_text("The slider says how good a picture must be; the quickest mode is used");
        if panel.walk != before {
            panel.stands_at = None;
        }
    });
    let points = shown.points;
    let finite = points.iter().map(|point| point.db).filter(|db| db.is_finite());
    let highest = finite.fold(0.0, f64::max);
    let value_of = |index: usize| match panel.walk {
        Walk::Time => points[index].ms,
        // What has no error at all is as good as the best that has some.
        Walk::Level => points[index].db.min(highest),
    };
    let values: Vec<f64> = front(points).into_iter().map(value_of).collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let usable = low < high && !shown.marks.is_old;
    let current = points.iter().position(|p| is_of(p, shown.marks.first));
    let (low, high) = if low < high { (low, high) } else { (1.0, 2.0) };
    let mut value = panel.stands_at.or(current.map(value_of)).unwrap_or(low).clamp(low, high);
    let slider = Slider::new(&mut value, low..=high);
    let number = |words: fn(f64) -> String| {
        move |value: f64, _: std::ops::RangeInclusive<usize>| {
            if usable { words(value) } else { "–".to_owned() }
        }
    };
    let (name, help, slider) = match panel.walk {
        Walk::Time => (
            "Time for a picture",
            "What a picture may take: the best mode within it is used",
            slider.logarithmic(true).custom_formatter(number(words::milliseconds)),
        ),
        Walk::Level => (
            "Level of a picture",
            "How near a picture must be to the exact one: the quickest such mode is used",
            slider.custom_formatter(number(|db| format!("{db:.1} dB"))),
        ),
    };
    ui.spacing_mut().slider_width = (ui.available_width() - 84.0).max(60.0);
    let response = ui.name_inputs(name, |ui| ui.add_enabled(usable, slider));
    let response =
        response.on_hover_text(help).on_disabled_hover_text("Once some modes are measured");
    if response.changed() && usable {
        panel.stands_at = Some(value);
        let index = match panel.walk {
            Walk::Time => best_within(points, value),
            Walk::Level => quickest_with(points, value),
        };
        done.first = index.and_then(|index| points[index].settings);
    }
}

/// The mode on screen with its numbers, and the one it is compared with.
fn chosen_ui(ui: &mut Ui, shown: &Shown<'_>) {
    let mut row = |mode: &SplatSettings, colour| {
        let point = shown.points.iter().find(|p| is_of(p, mode));
        let numbers = match point {
            Some(point) if point.failed.is_some() => "cannot be drawn".to_owned(),
            Some(point) if !shown.marks.is_old => number_words(point),
            _ => "not measured yet".to_owned(),
        };
        let name = modes::name(mode);
        ui.spacing_mut().item_spacing.y = 2.0;
        ui.add(Label::new(RichText::new(&name).color(colour)).truncate());
        ui.label(RichText::new(numbers).color(theme::TEXT_FAINT).size(12.0));
    };
    row(shown.marks.first, theme::TEXT);
    if let Some(second) = shown.marks.second {
        row(second, theme::NOTE);
    }
}

/// What is the default, and why it is not the point above it: in one line where there is no room for all of it.
fn default_ui(ui: &mut Ui, shown: &Shown<'_>) {
    if shown.marks.is_old {
        return;
    }
    let Some(text) = default_words(shown.points, shown.refines, &shown.marks.default) else {
        return;
    };
    ui.add_space(2.0);
    let words = RichText::new(&text).color(theme::TEXT_FAINT).size(DEFAULT_SIZE);
    let font = FontId::proportional(DEFAULT_SIZE);
    let whole = ui.painter().layout(text.clone(), font, theme::TEXT_FAINT, ui.available_width());
    let has_room = whole.size().y + BELOW_DEFAULT <= ui.available_height();
    let label = if has_room { Label::new(words).wrap() } else { Label::new(words).truncate() };
    ui.add(label).on_hover_text(&text);
}

/// What the default costs and is worth here, and what the next better mode would; nothing before it is measured.
fn default_words(points: &[ChartPoint], refines: bool, own: &SplatSettings) -> Option<String> {
    let is_default = |point: &&ChartPoint| point.failed.is_none() && is_of(point, own);
    let default = points.iter().find(is_default)?;
    let here = format!("The default is marked: {}", number_words(default));
    let better = front(points).into_iter().map(|index| &points[index]);
    let Some(better) = better.into_iter().find(|point| point.db > default.db) else {
        return Some(format!("{here}. No mode measured so far is nearer to the exact picture"));
    };
    if better.ms <= default.ms {
        return Some(format!(
            "{here}. Here another mode is both quicker and nearer: {}",
            better.name
        ));
    }
    let times = better.ms / default.ms;
    let gain = match better.db - default.db {
        gain if gain.is_finite() => format!("{gain:.0} dB more"),
        _ => "a picture without error".to_owned(),
    };
    let finer = better.settings.filter(|mode| {
        modes::same_mode(&SplatSettings { slabs_per_voxel: own.slabs_per_voxel, ..*mode }, own)
    });
    let what = match finer {
        Some(mode) => format!("{} slabs a voxel", words::value(mode.slabs_per_voxel)),
        None => better.name.clone(),
    };
    let whether = match (finer.is_some(), refines) {
        (true, true) if better.ms <= CONVERGE_WITHIN_MS => {
            "a view at rest goes on to it by itself while this panel is closed"
        }
        (true, _) => "key R goes on to it while this panel is closed",
        (false, _) => "click it to draw with it",
    };
    Some(format!(
        "{here}; it comes first because the point above, {what}, takes {times:.1} times as long for {gain}: {whether}"
    ))
}

/// How good the estimates of coarse pictures were.
fn record_ui(ui: &mut Ui, record: &EstimateRecord) {
    let text = record_words(record);
    ui.add_space(2.0);
    let words = Label::new(RichText::new(text).color(theme::TEXT_FAINT).size(12.0));
    // Two rows, where there is room for them.
    let has_room = ui.available_height() >= 2.0 * 15.0;
    ui.add(if has_room { words.wrap() } else { words.truncate() }).on_hover_text(
        "Each coarse picture says how far it is thought to be from the finished one. Once that \
             is there, the two are compared: mean and spread of estimate minus truth",
    );
}

/// The record in one line.
fn record_words(record: &EstimateRecord) -> String {
    match (record.count, record.spread_db()) {
        (0, _) => "Quick pictures guess their own error: none checked yet".to_owned(),
        (1, _) | (_, None) => {
            format!(
                "Quick pictures guess their own error: 1 checked, {}",
                off_words(record.mean_db)
            )
        }
        (count, Some(spread)) => format!(
            "Quick pictures guess their own error: {count} checked, {} ± {spread:.1} dB",
            off_words(record.mean_db)
        ),
    }
}

/// How far estimates were off: above 0 where pictures were worse than they said.
fn off_words(db: f64) -> String {
    match db {
        _ if db.abs() < 0.05 => "right".to_owned(),
        _ if db > 0.0 => format!("{db:.1} dB too hopeful"),
        _ => format!("{:.1} dB too cautious", -db),
    }
}

/// The least height at which everything has room, points.
pub const LEAST_HEIGHT: f32 = 190.0;
/// The height before anyone resizes the panel, points.
pub const HEIGHT: f32 = 220.0;

#[cfg(test)]
mod tests {
    use super::*;

    const DEFAULT: SplatSettings = SplatSettings::EXACT;

    #[test]
    fn one_mode_is_called_a_mode() {
        assert_eq!([0, 1, 2].map(modes), ["0 modes", "1 mode", "2 modes"]);
    }

    #[test]
    fn the_panel_says_what_the_default_is_and_why_it_is_not_the_point_above_it() {
        assert_eq!(SplatSettings::default(), DEFAULT);
        let point = |ms, db, settings: SplatSettings| ChartPoint {
            name: modes::name(&settings),
            ms,
            db,
            ci: f64::NAN,
            settings: Some(settings),
            on_front: true,
            failed: None,
        };
        let slabs = |slabs_per_voxel| SplatSettings { slabs_per_voxel, ..DEFAULT };
        let default = point(416.0, 43.7, DEFAULT);
        let finer = point(824.0, 63.0, slabs(2.0));
        let finest = point(4800.0, 74.4, slabs(4.0));
        let classic = point(608.0, 29.7, SplatSettings::SHADE_FIRST);
        let told = |points: &[&ChartPoint], refines| {
            let points: Vec<_> = points.iter().map(|point| (*point).clone()).collect();
            default_words(&points, refines, &DEFAULT).unwrap_or_default()
        };
        assert_eq!(told(&[&finer, &classic], true), "", "not measured yet");
        let words = told(&[&default, &classic, &finest, &finer], true);
        assert!(
            words.starts_with("The default is marked: 416 ms, 43.7 dB; it comes first"),
            "{words}"
        );
        assert!(
            words.contains("2 slabs a voxel, takes 2.0 times as long for 19 dB more"),
            "{words}"
        );
        assert!(
            words.ends_with("a view at rest goes on to it by itself while this panel is closed")
        );
        assert!(told(&[&default, &finer], false).contains("key R goes on to it"), "switched off");
        assert!(told(&[&default, &finest], true).contains("key R goes on to it"), "beyond 3 s");
        assert!(told(&[&default, &classic], true).ends_with("nearer to the exact picture"));
        // Of a mesh it is its cells, whatever splines do there.
        let cells = point(90.0, 40.7, SplatSettings::CELLS);
        let points = [default.clone(), cells];
        let words = default_words(&points, true, &SplatSettings::CELLS).unwrap_or_default();
        assert!(words.starts_with("The default is marked: 90 ms, 40.7 dB"), "{words}");
        let quicker = point(100.0, 50.0, SplatSettings::SHADE_FIRST);
        assert!(told(&[&default, &quicker], true).contains("both quicker and nearer: Cubic"));
        let other = point(900.0, 50.0, SplatSettings::SHADE_FIRST);
        assert!(told(&[&default, &other], true).ends_with("click it to draw with it"));
    }

    #[test]
    fn the_record_says_how_many_and_how_far() {
        let mut record = EstimateRecord::default();
        assert_eq!(record_words(&record), "Quick pictures guess their own error: none checked yet");
        record.add(-0.01);
        let one = "Quick pictures guess their own error: 1 checked, right";
        assert_eq!(record_words(&record), one);
        record.add(3.0);
        assert_eq!(
            record_words(&record),
            "Quick pictures guess their own error: 2 checked, 1.5 dB too hopeful ± 2.1 dB"
        );
    }
}
