//! Basis functions: what a field is encoded by, how far that came, and what to do with them.

use eframe::egui::{Align2, Button, FontId, Pos2, Rect, Sense, Shape, Stroke, Ui, pos2, vec2};

use super::splat::{choice_ui, slider_row};
use super::{facts_ui, number_ui, row_ui, typed};
use crate::app::document::Document;
use crate::app::encoding::{EncodeChoice, EncodeGoal, Encoding, EncodingRequest, LEAST_FUNCTIONS};
use crate::app::{theme, words};
use crate::rbf::Basis;

/// Height of the curve of errors, points.
const CURVE_HEIGHT: f32 = 64.0;
/// Errors that may be asked for, % of the range.
const PERCENT: std::ops::RangeInclusive<f64> = 0.05..=20.0;
/// The most functions that may be asked for.
const MOST_FUNCTIONS: u32 = 20_000;
/// Sizes of files that may be asked for, kB.
const KILOBYTES: std::ops::RangeInclusive<u32> = 2..=1000;
/// How many times as much samples may count.
const TIMES: std::ops::RangeInclusive<f64> = 1.0..=1000.0;
/// Where the curve of errors ends when none is asked for, as a share of the range.
const LEAST_SHOWN: f64 = 1e-3;

/// The choices, a fit under way, and the functions that there are; what a person asks for.
pub(in crate::app) fn encoding_ui(
    ui: &mut Ui,
    document: &Document,
    (choice, has_clip_box): (&mut EncodeChoice, bool),
    running: Option<&Encoding>,
) -> Option<EncodingRequest> {
    let found = functions_ui(ui, document);
    match running {
        Some(encoding) => running_ui(ui, encoding, choice.percent / 100.0),
        None => start_ui(ui, document, choice, has_clip_box),
    }
    .or(found)
}

/// What is known of the functions of the field on screen.
fn functions_ui(ui: &mut Ui, document: &Document) -> Option<EncodingRequest> {
    let functions = document.volume.functions.as_ref()?;
    let of_field = document.encoded_here();
    let statistics = &document.volume.statistics;
    let range = statistics.max - statistics.min;
    let mut rows = vec![(
        "Functions",
        format!(
            "{}, {}",
            words::count(functions.functions().len() as u64),
            basis(functions.basis()).0.to_lowercase()
        ),
        "How many functions the field is the sum of, and what they look like",
    )];
    if let Some(facts) = of_field.map(|of_field| of_field.facts()).or(document.encoding.clone()) {
        let of_range =
            |error: f64| format!("{} ({:.2} %)", words::value(error), 100.0 * error / range);
        rows.push((
            "Greatest error",
            of_range(facts.max_error),
            "How far their sum is from a sample at most, and as a part of the values' range",
        ));
        rows.push(("Mean error", of_range(facts.mean_error), "The mean over all samples"));
        if let Some((greatest, mean)) = facts.favoured_max_error.zip(facts.favoured_mean_error) {
            rows.push((
                "Favoured",
                format!("{}, mean {}", of_range(greatest), words::value(mean)),
                "How far their sum is from a favoured sample at most, and in the mean over these",
            ));
        }
    }
    facts_ui(ui, &rows);
    let mut asked = None;
    row_ui(ui, "", |ui| {
        let help = "Functions and samples side by side, by a divider that can be dragged";
        if ui.button("Compare").on_hover_text(help).clicked() {
            asked = Some(EncodingRequest::Compare);
        }
        if of_field.is_some() {
            let help = "What the functions leave of the samples, as a field: with a histogram of its own, in space and on \
                        slices";
            if ui.button("Residual").on_hover_text(help).clicked() {
                asked = Some(EncodingRequest::Residual);
            }
            let help = "The functions as a .vrbf file";
            if ui.button("Save…").on_hover_text(help).clicked() {
                asked = Some(EncodingRequest::Save);
            }
        }
    });
    asked
}

/// What basis functions are called, and what that means.
fn basis(basis: Basis) -> (&'static str, &'static str) {
    match basis {
        Basis::Ellipsoid => (
            "Ellipsoids",
            "Gaussians as wide as they have to be in each direction: the fewest for an error",
        ),
        Basis::Gaussian => ("Spheres", "Gaussians as wide in every direction, as published"),
        Basis::Multiquadric => ("Multiquadrics", "1/√(1 + r²), which end far out, as published"),
    }
}

/// What goals are called, and what they mean.
fn goal(goal: EncodeGoal) -> (&'static str, &'static str) {
    match goal {
        EncodeGoal::Greatest => {
            ("Greatest error", "Functions are added until no sample is further off")
        }
        EncodeGoal::Mean => {
            ("Mean error", "Functions are added until the mean over all samples is less")
        }
        EncodeGoal::Bytes => ("Size of the file", "As many functions as a file of that size holds"),
    }
}

fn goal_ui(ui: &mut Ui, choice: &mut EncodeChoice) {
    if let Some(chosen) = choice_ui(ui, "Goal", &EncodeGoal::ALL, choice.goal, goal) {
        choice.goal = chosen;
    }
    let (name, help) = match choice.goal {
        EncodeGoal::Greatest => (
            "Greatest error",
            "No sample may be further from the sum than this part of the values' range",
        ),
        EncodeGoal::Mean => (
            "Mean error",
            "The mean of how far samples are from the sum, as a part of the values' range",
        ),
        EncodeGoal::Bytes => {
            let slider = typed::slider(ui, "Most kilobytes", &mut choice.kilobytes, KILOBYTES)
                .logarithmic(true);
            let help = "The saved file is no longer";
            slider_row(ui, "Size", "Most kilobytes", slider.suffix(" kB"), help);
            return;
        }
    };
    let slider =
        typed::slider(ui, name, &mut choice.percent, PERCENT).logarithmic(true).suffix(" %");
    slider_row(ui, "Error", name, slider.max_decimals(2), help);
}

/// Which samples count more, and how much.
fn favour_ui(ui: &mut Ui, document: &Document, choice: &mut EncodeChoice, has_clip_box: bool) {
    let statistics = &document.volume.statistics;
    let (min, max) = (statistics.min, statistics.max);
    let mut on = choice.favoured.is_some();
    let help = "Samples of some values count more, so that the sum comes nearer there and is further off elsewhere; errors \
                that are asked for are of all samples alike";
    if ui.checkbox(&mut on, "Favour values").on_hover_text(help).changed() {
        choice.favoured = on.then_some([0.5 * (min + max), max]);
    }
    if let Some(range) = &mut choice.favoured {
        row_ui(ui, "Between", |ui| {
            for (end, name) in range.iter_mut().zip(["Favoured from", "Favoured to"]) {
                let drag = typed::number(ui, name, end, min..=max).speed(0.002 * (max - min));
                let help = "Samples between these two values count more";
                number_ui(ui, name, drag.max_decimals(3)).on_hover_text(help);
            }
        });
    }
    if has_clip_box {
        let help = "Samples in the clip box count more; with values those that are of both";
        ui.checkbox(&mut choice.favours_clip_box, "Favour the clip box").on_hover_text(help);
    }
    if choice.favoured.is_some() || (has_clip_box && choice.favours_clip_box) {
        let slider = typed::slider(ui, "Favoured times", &mut choice.times, TIMES)
            .logarithmic(true)
            .max_decimals(1);
        let help = "How many times as much as the others these samples count";
        slider_row(ui, "Times", "Favoured times", slider, help);
    }
}

fn start_ui(
    ui: &mut Ui,
    document: &Document,
    choice: &mut EncodeChoice,
    has_clip_box: bool,
) -> Option<EncodingRequest> {
    goal_ui(ui, choice);
    let mut functions = choice.most_functions(document);
    let before = functions;
    let range = LEAST_FUNCTIONS..=MOST_FUNCTIONS;
    let slider = typed::slider(ui, "Most functions", &mut functions, range).logarithmic(true);
    let help = "Functions, however far they are then. At first as many as suit the number of samples, 2000 at most";
    slider_row(ui, "At most", "Most functions", slider, help);
    if functions != before {
        choice.functions = Some(functions);
    }
    if let Some(chosen) = choice_ui(ui, "Shape", &Basis::ALL, choice.basis, basis) {
        choice.basis = chosen;
    }
    favour_ui(ui, document, choice, has_clip_box);
    let is_file_of_functions = document.grid.functions.is_some();
    row_ui(ui, "", |ui| {
        let button = Button::new("Encode");
        let help = "Fits functions to the samples. Their sum is drawn by itself then, without samples, by whatever curve and \
                    light";
        let encode = ui
            .add_enabled(!is_file_of_functions, button)
            .on_hover_text(help)
            .on_disabled_hover_text("These samples are the sum of functions already");
        // Functions of a file have no samples that they could be fitted to further.
        let is_continued = document.encoded_here().is_some_and(|encoded| {
            let earlier = &encoded.encoding;
            let is_of_shape = earlier.basis() == choice.basis;
            let may_go_on = is_of_shape && earlier.functions().len() <= functions as usize;
            let help =
                "Keeps the functions that there are, with what they favoured, refines them and adds others. The greatest error \
                 never grows";
            let not = "Goes on with functions of the same shape, and with no fewer than there are";
            ui.add_enabled(may_go_on, Button::new("Continue"))
                .on_hover_text(help)
                .on_disabled_hover_text(not)
                .clicked()
        });
        match () {
            () if encode.clicked() => Some(EncodingRequest::Encode),
            () if is_continued => Some(EncodingRequest::Continue),
            () => None,
        }
    })
}

fn running_ui(ui: &mut Ui, encoding: &Encoding, wanted: f64) -> Option<EncodingRequest> {
    let steps = encoding.steps();
    let is_paused = encoding.is_paused();
    curve_ui(ui, &steps, (encoding.goal(), wanted), is_paused);
    row_ui(ui, "", |ui| {
        let pause = if is_paused { "Go on" } else { "Pause" };
        let pause = ui.button(pause).on_hover_text("Waits once the step that it is in is done");
        let help = "Ends with the nearest functions that it has";
        let enough = ui.button("Enough").on_hover_text(help);
        let cancel = ui.button("Cancel").on_hover_text("Forgets them");
        match () {
            () if pause.clicked() => Some(EncodingRequest::Pause(!is_paused)),
            () if enough.clicked() => Some(EncodingRequest::Enough),
            () if cancel.clicked() => Some(EncodingRequest::Cancel),
            () => None,
        }
    })
}

/// The greatest or mean error by how many functions there are, both by their logarithms, and the error that is asked for.
fn curve_ui(
    ui: &mut Ui,
    steps: &[(usize, f64)],
    (goal, wanted): (EncodeGoal, f64),
    is_paused: bool,
) {
    let (error, wanted) = match goal {
        EncodeGoal::Greatest => ("greatest", Some(wanted)),
        EncodeGoal::Mean => ("mean", Some(wanted)),
        EncodeGoal::Bytes => ("greatest", None),
    };
    let least = wanted.unwrap_or(LEAST_SHOWN);
    let size = vec2(ui.available_width(), CURVE_HEIGHT);
    let (response, painter) = ui.allocate_painter(size, Sense::hover());
    let rect = response.rect;
    painter.rect_filled(rect, 3.0, theme::WELL);
    let inner = rect.shrink(6.0);
    let most = steps.last().map_or(1, |(count, _)| *count).max(10);
    let place =
        |count: usize, error: f64| place(inner, (count as f64, most as f64), (error, least));
    let level = place(1, least).y;
    let dashes = Shape::dashed_line(
        &[pos2(inner.left(), level), pos2(inner.right(), level)],
        Stroke::new(1.0, theme::TEXT_FAINT),
        4.0,
        4.0,
    );
    if wanted.is_some() {
        painter.extend(dashes);
    }
    let points: Vec<Pos2> = steps.iter().map(|(count, error)| place(*count, *error)).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, theme::ACCENT)));
    let told = match steps.last() {
        Some((count, error)) => {
            let plural = if *count == 1 { "" } else { "s" };
            format!("{} function{plural}, {:.2} %", words::count(*count as u64), 100.0 * error)
        }
        None => "Sorting the samples".to_owned(),
    };
    let told = if is_paused { format!("Paused · {told}") } else { told };
    // Above the line of the wanted error, where the curve comes last.
    let corner = pos2(inner.left(), level - 3.0);
    painter.text(corner, Align2::LEFT_BOTTOM, told, FontId::proportional(12.0), theme::TEXT);
    let line = match wanted {
        Some(_) => "; the broken line is the error that is asked for",
        None => "",
    };
    response.on_hover_text(format!(
        "The {error} error, as a part of the values' range, falls as functions are added{line}"
    ));
}

/// Where a number of functions and an error lie: errors from a half of the wanted one at the bottom to all at the top.
fn place(rect: Rect, (count, most): (f64, f64), (error, wanted): (f64, f64)) -> Pos2 {
    let share = |value: f64, low: f64, high: f64| {
        ((value.max(low).ln() - low.ln()) / (high.ln() - low.ln())).clamp(0.0, 1.0)
    };
    let x = share(count, 1.0, most);
    let y = share(error, wanted / 2.0, 1.0);
    rect.left_bottom() + vec2(x as f32 * rect.width(), -(y as f32) * rect.height())
}
