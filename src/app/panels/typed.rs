//! Numbers that are typed: one that a field does not take changes nothing and is said, rather than moved to the nearest one.

use std::ops::RangeInclusive;

use eframe::egui::emath::Numeric;
use eframe::egui::{Context, DragValue, Id, Slider, SliderClamping, Ui};

use crate::app::words;

/// A slider called `name`. What it stands at is left alone until it is moved, also where that is beyond its ends.
pub(in crate::app) fn slider<'a, N: Numeric>(
    ui: &Ui,
    name: &str,
    value: &'a mut N,
    range: RangeInclusive<N>,
) -> Slider<'a> {
    let parser = parser(ui, name, *value, &range, from_text);
    Slider::new(value, range)
        .clamping(SliderClamping::Edits)
        .custom_parser(parser)
        // Of a number only all of it says whether it is one.
        .update_while_editing(false)
}

/// A number called `name` that can be dragged or typed.
pub(in crate::app) fn number<'a, N: Numeric>(
    ui: &Ui,
    name: &str,
    value: &'a mut N,
    range: RangeInclusive<N>,
) -> DragValue<'a> {
    let parser = parser(ui, name, *value, &range, from_text);
    DragValue::new(value)
        .range(range)
        .clamp_existing_to_range(false)
        .custom_parser(parser)
        .update_while_editing(false)
}

/// What takes the number in a text, as `read` finds it there, where a field at `now` takes it.
pub(super) fn parser<N: Numeric, F: Fn(&str) -> Option<f64>>(
    ui: &Ui,
    name: &str,
    now: N,
    range: &RangeInclusive<N>,
    read: F,
) -> impl Fn(&str) -> Option<f64> + use<N, F> {
    let (ctx, name) = (ui.ctx().clone(), name.to_owned());
    let (now, least, most) = (now.to_f64(), range.start().to_f64(), range.end().to_f64());
    move |text| {
        let Some(typed) = read(text) else {
            if !text.contains(|c: char| c.is_ascii_digit()) {
                say(&ctx, &format!("{name} takes a number: {:?} changes nothing", text.trim()));
            }
            return None;
        };
        if (least..=most).contains(&typed) {
            return Some(typed);
        }
        // What stands there may be rounded over its end, and was not typed then: to two digits at least.
        let is_rounded = (typed - now).abs() <= now.abs() / 50.0;
        if !is_rounded {
            say(&ctx, &refusal(&name, typed, [least, most]));
        }
        None
    }
}

/// Has the window say why what was typed changes nothing.
pub(super) fn say(ctx: &Context, why: &str) {
    ctx.data_mut(|data| data.insert_temp(id(), why.to_owned()));
    ctx.request_repaint();
}

/// What was typed last that a field does not take: once, in a sentence.
pub(in crate::app) fn take_refusal(ctx: &Context) -> Option<String> {
    ctx.data_mut(|data| data.remove_temp(id()))
}

fn id() -> Id {
    Id::unique("number that was not taken")
}

fn refusal(name: &str, typed: f64, [least, most]: [f64; 2]) -> String {
    let typed = words::value(typed);
    let (low, high) = (words::value(least), words::value(most));
    // Ends that only the numbers themselves have are not told.
    let most_told = f64::from(f32::MAX);
    match (least > -most_told, most < most_told) {
        (true, false) => format!("{name} takes {low} or more: {typed} changes nothing"),
        (false, true) => format!("{name} takes {high} or less: {typed} changes nothing"),
        _ => format!("{name} takes {low} to {high}: {typed} changes nothing"),
    }
}

/// As the interface reads numbers: spaces part thousands, and a long minus is one, too.
pub(super) fn from_text(text: &str) -> Option<f64> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    text.replace('\u{2212}', "-").parse().ok().filter(|typed: &f64| !typed.is_nan())
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Context, RawInput};

    use super::*;

    /// What comes of a text in a field at `now`, and what is said.
    fn typed(text: &str, now: f64, range: RangeInclusive<f64>) -> (Option<f64>, Option<String>) {
        let ctx = Context::default();
        let mut found = None;
        let mut output = ctx.run_ui(RawInput::default(), |ui| {
            found = parser(ui, "High percentile", now, &range, from_text)(text);
        });
        output.textures_delta.clear();
        let said = take_refusal(&ctx);
        assert_eq!(take_refusal(&ctx), None, "said once");
        (found, said)
    }

    #[test]
    fn a_number_beyond_its_ends_changes_nothing_and_is_said() {
        let said = |text: &str| Some(text.to_owned());
        assert_eq!(typed("75", 99.5, 51.0..=100.0), (Some(75.0), None));
        let found = typed("200", 99.5, 51.0..=100.0);
        let words = "High percentile takes 51 to 100: 200 changes nothing";
        assert_eq!(found, (None, said(words)));
        let found = typed("\u{2212}1", 0.0, 0.0..=f64::MAX);
        assert_eq!(found, (None, said("High percentile takes 0 or more: -1 changes nothing")));
        let found = typed("1e99", 0.0, f64::MIN..=1e30);
        assert_eq!(found, (None, said("High percentile takes 1e30 or less: 1e99 changes nothing")));
        assert_eq!(typed("99 percent", 99.5, 51.0..=100.0), (None, None), "no number");
        let words = "High percentile takes a number: \"banana\" changes nothing";
        assert_eq!(typed("banana ", 99.5, 51.0..=100.0), (None, said(words)));
        assert!(typed("nan", 99.5, 51.0..=100.0).1.is_some());
        assert_eq!(typed("1 000.5", 0.0, 0.0..=1e4), (Some(1000.5), None));
    }

    #[test]
    fn what_is_only_rounded_over_its_end_was_not_typed() {
        assert_eq!(typed("2.5", 2.46, 0.0..=2.46), (None, None));
        assert!(typed("2.6", 2.46, 0.0..=2.46).1.is_some());
    }
}
