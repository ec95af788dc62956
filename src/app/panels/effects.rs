//! Every effect in a row: whether it runs, what asked for it, what it costs as far as that was measured.

use eframe::egui::{
    Context, Frame, Grid, Label, Margin, RichText, ScrollArea, Ui, Vec2, Window as Floating, pos2,
    vec2,
};

use crate::app::{theme, words};
use crate::core::memory::human_bytes;
use crate::task::effect_costs::AddedTime;

/// Width of the reasons, points: where there is little room they are cut short, and the other columns seen.
const WHY_WIDTH: [f32; 2] = [90.0, 250.0];
const OTHER_COLUMNS: f32 = 400.0;
/// How much of the window the rows may cover, as parts of its width and height, and what they are not made
/// smaller than, points: what is left shows what they change.
const MOST: Vec2 = vec2(0.68, 0.35);
const LEAST: Vec2 = vec2(120.0, 60.0);
/// Height of the menus, and width of the bar by which the rows are scrolled, points.
const MENUS: f32 = 28.0;
const BAR: i8 = 14;

/// Whether an effect runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Run {
    /// Nobody asks for it.
    Off,
    /// It is on the picture, or runs beside it.
    On,
    /// It is asked for, and not on the picture that is shown.
    NotShown,
}

impl Run {
    /// Of what is asked for or not, and shown or not.
    pub fn of(is_asked: bool, is_shown: bool) -> Self {
        match (is_asked, is_shown) {
            (false, _) => Self::Off,
            (true, true) => Self::On,
            (true, false) => Self::NotShown,
        }
    }
}

/// Milliseconds, as far as they were measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Time {
    /// Nobody has measured.
    Unknown,
    /// Of a picture of its own.
    Own(f64),
    /// Of pictures with and without it.
    Added(AddedTime),
}

/// How far the picture without an effect is from the one with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// Nobody has measured.
    Unknown,
    /// RMSE in linear light.
    Rmse(f64),
}

impl Change {
    /// Of a measured one; two pictures that cannot be compared say nothing.
    pub fn of(rmse: Option<f64>) -> Self {
        rmse.map_or(Self::Unknown, Self::Rmse)
    }
}

/// One effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it is called.
    pub name: &'static str,
    /// What it does, one line.
    pub help: &'static str,
    /// Whether it runs.
    pub run: Run,
    /// What asked for it, or could.
    pub why: String,
    /// What it took.
    pub time: Time,
    /// What it changes.
    pub change: Change,
    /// Bytes on the device, more than without it; `None` where nobody has counted.
    pub bytes: Option<i64>,
}

/// The panel; whether it is to stay open. `all_bytes` is what the device holds in all, and `progress` how many of how many pictures
/// were drawn to measure it.
pub fn effects_ui(
    ctx: &Context,
    rows: &[Row],
    all_bytes: Option<u64>,
    progress: Option<[usize; 2]>,
) -> bool {
    let mut open = true;
    // Below the menus, which it is not to cover.
    let mut place = ctx.content_rect();
    place.min.y += MENUS;
    let room = (place.size() * MOST).max(LEAST);
    let why_width = (room.x - OTHER_COLUMNS).clamp(WHY_WIDTH[0], WHY_WIDTH[1]);
    let frame = ctx.global_style().spacing.window_margin.sum() + Vec2::splat(2.0);
    let panel = Floating::new("Effects").open(&mut open).resizable(false).collapsible(true);
    let panel = panel.constrain_to(place).default_pos(pos2(16.0, 48.0));
    panel.max_width(room.x + frame.x).show(ctx, |ui| {
        // As large as the rows up to that, whatever size the panel had before.
        let scroll = ScrollArea::both().max_width(room.x).max_height(room.y);
        let scroll = scroll.min_scrolled_width(room.x).min_scrolled_height(room.y);
        let beside_bar = Frame::new().inner_margin(Margin { right: BAR, ..Margin::ZERO });
        scroll.show(ui, |ui| beside_bar.show(ui, |ui| rows_ui(ui, rows, why_width)));
        let all = all_bytes.map_or_else(|| "–".to_owned(), human_bytes);
        let text = format!("Memory for drawing in all: {all}");
        ui.label(RichText::new(text).size(12.0).color(theme::TEXT_FAINT)).on_hover_text(
            "Samples, fields, tables and pictures, as this program allocates them, when the picture \
             on screen was finished",
        );
        if let Some([drawn, all]) = progress {
            let text = format!("Measuring: {drawn} of {all} pictures drawn");
            ui.label(RichText::new(text).size(12.0).color(theme::TEXT_FAINT));
        }
    });
    open
}

fn rows_ui(ui: &mut Ui, rows: &[Row], why_width: f32) {
    Grid::new("effects").num_columns(6).spacing([14.0, 4.0]).striped(true).show(ui, |ui| {
        for (title, help) in [
            ("Effect", ""),
            ("On", "Whether the picture shown now has it"),
            ("Switched on by", "What switched it on; of an effect that is off, where to switch it on"),
            (
                "Adds",
                "How much longer the finished picture of this view takes than one without it, between \
                 medians of three each. They are drawn while this panel is open and nothing moves",
            ),
            (
                "Changes",
                "How far the picture without it is from this one, in percent of the brightest light",
            ),
            ("Memory", "How much more memory drawing takes with it than without"),
        ] {
            let title = ui.label(RichText::new(title).size(12.0).color(theme::TEXT_FAINT));
            if !help.is_empty() {
                title.on_hover_text(help);
            }
        }
        ui.end_row();
        for row in rows {
            row_ui(ui, row, why_width);
        }
    });
}

fn row_ui(ui: &mut Ui, row: &Row, why_width: f32) {
    let colour = match row.run {
        Run::Off => theme::TEXT_FAINT,
        Run::On => theme::TEXT,
        Run::NotShown => theme::NOTE,
    };
    ui.label(RichText::new(row.name).color(colour)).on_hover_text(row.help);
    let runs = match row.run {
        Run::Off => "No",
        Run::On => "Yes",
        Run::NotShown => "Not shown",
    };
    let runs = ui.label(RichText::new(runs).color(colour));
    if row.run == Run::NotShown {
        runs.on_hover_text(
            "It is switched on, but the picture on screen does not show it: another mode would",
        );
    }
    ui.scope(|ui| {
        ui.set_min_width(why_width);
        ui.set_max_width(why_width);
        ui.add(Label::new(RichText::new(&row.why).color(colour)).truncate());
    });
    let (time, detail) = time_words(row.time);
    let time = ui.label(RichText::new(time).color(colour));
    if let Some(detail) = detail {
        time.on_hover_text(detail);
    }
    let (change, detail) = match row.change {
        Change::Unknown => ("–".to_owned(), None),
        Change::Rmse(0.0) => ("the same".to_owned(), None),
        Change::Rmse(rmse) => {
            let detail = format!(
                "RMSE {rmse:.2e} in linear light, {}",
                words::decibels(-20.0 * rmse.log10())
            );
            (words::share_of_light(rmse), Some(detail))
        }
    };
    let change = ui.label(RichText::new(change).color(colour));
    if let Some(detail) = detail {
        change.on_hover_text(detail);
    }
    let bytes = row.bytes.map_or_else(
        || "–".to_owned(),
        |bytes| {
            let sign = if bytes < 0 { "−" } else { "" };
            format!("{sign}{}", human_bytes(bytes.unsigned_abs()))
        },
    );
    ui.label(RichText::new(bytes).color(colour));
    ui.end_row();
}

/// The time in the column, and what it is made of.
fn time_words(time: Time) -> (String, Option<String>) {
    match time {
        Time::Unknown => ("–".to_owned(), None),
        Time::Own(ms) => (words::milliseconds(ms), Some("A picture of its own".to_owned())),
        Time::Added(added) => {
            let AddedTime { ms, least_ms, most_ms, pictures } = added;
            let text = match added.is_within_noise() {
                true => format!("< {}", words::milliseconds(most_ms.max(-least_ms))),
                false => signed(ms),
            };
            let pictures =
                if pictures == 1 { "1 picture".to_owned() } else { format!("{pictures} pictures") };
            let [least, most] = [least_ms, most_ms].map(signed);
            (text, Some(format!("{least} to {most}, of {pictures} with it and without")))
        }
    }
}

fn signed(ms: f64) -> String {
    format!("{}{}", if ms < 0.0 { "−" } else { "+" }, words::milliseconds(ms.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_said_as_they_were_measured_or_not_at_all() {
        let words = |time| time_words(time).0;
        assert_eq!(words(Time::Unknown), "–");
        assert_eq!(words(Time::Own(84.0)), "84 ms");
        let added =
            |with: &[f64], without: &[f64]| Time::Added(AddedTime::of(with, without).unwrap());
        assert_eq!(words(added(&[210.0], &[84.0])), "+126 ms");
        assert_eq!(words(added(&[80.0], &[84.0])), "−4.0 ms");
        let several = added(&[200.0, 210.0, 230.0], &[80.0, 90.0, 84.0]);
        assert_eq!(words(several), "+126 ms");
        let detail = "+110 ms to +150 ms, of 3 pictures with it and without";
        assert_eq!(time_words(several).1.unwrap(), detail);
        assert_eq!(words(added(&[80.0, 90.0], &[84.0, 84.0])), "< 6.0 ms", "it may take nothing");
    }
}
