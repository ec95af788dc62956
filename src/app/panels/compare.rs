//! The comparison of two modes: how it is shown.

use eframe::egui::{Slider, Ui};

use super::{row_ui, slider_ui, typed};
use crate::app::compare::{Compare, Display, MOST_DOUBLINGS};
use crate::app::words;
use crate::scene::{Inside, SplatSettings};

/// The rows under the presets while two modes are compared; `first` is the scene's mode.
pub fn compare_ui(ui: &mut Ui, compare: &mut Compare, first: &mut SplatSettings, inside: &Inside) {
    let mut on = compare.on;
    ui.horizontal(|ui| {
        ui.checkbox(&mut on, "Compare two modes").on_hover_text(
            "Show the view in a second mode beside the first, once it rests (key C)",
        );
    });
    if on != compare.on {
        compare.toggle(first, inside);
    }
    if !compare.on {
        return;
    }
    row_ui(ui, "Show", |ui| {
        ui.selectable_value(&mut compare.display, Display::Split, "Split").on_hover_text(
            "The first mode left of a line, the second right of it; drag the line (key D)",
        );
        ui.selectable_value(&mut compare.display, Display::Difference, "Difference").on_hover_text(
            "How far the two are apart in linear light, amplified; black where they agree (key D)",
        );
    });
    row_ui(ui, "Amplify", |ui| {
        // As it is shown, also where Fit chooses it.
        let gain = f64::from(compare.gain());
        let fits = compare.fits && compare.display == Display::Difference;
        let shown = move |doublings: f64| if fits { gain } else { 2.0_f64.powf(doublings) };
        let ctx = ui.ctx().clone();
        let slider = Slider::new(&mut compare.doublings, 0..=MOST_DOUBLINGS)
            .custom_formatter(move |doublings, _| {
                format!("×{}", words::value((shown(doublings) * 10.0).round() / 10.0))
            })
            .custom_parser(move |text| {
                let times = typed::from_text(text.trim().trim_start_matches('×'))?;
                let doublings = times.log2();
                let is_taken = doublings.fract() == 0.0
                    && (0.0..=f64::from(MOST_DOUBLINGS)).contains(&doublings);
                if !is_taken {
                    let (times, most) = (words::value(times), 1_u32 << MOST_DOUBLINGS);
                    let why = format!(
                        "Amplify takes 1, 2, 4 and so on to {most}: {times} changes nothing"
                    );
                    typed::say(&ctx, &why);
                }
                is_taken.then_some(doublings)
            })
            .update_while_editing(false);
        let is_difference = compare.display == Display::Difference;
        slider_ui(ui, "Amplify", is_difference && !compare.fits, slider)
            .on_hover_text("How much brighter than it is the difference is shown")
            .on_disabled_hover_text("Only a difference is amplified, and Fit does it by itself");
    });
    row_ui(ui, "", |ui| {
        ui.checkbox(&mut compare.fits, "Fit")
            .accessible_name("Fit the amplification")
            .on_hover_text("Show the greatest difference as bright as can be, up to 64 times");
    });
    row_ui(ui, "Settings of", |ui| {
        ui.selectable_value(&mut compare.edits_second, false, "First")
            .on_hover_text("The rows below change the first mode, left of the line");
        ui.selectable_value(&mut compare.edits_second, true, "Second")
            .on_hover_text("The rows below change the second mode, right of the line");
        if ui.button("Swap").on_hover_text("Let the two modes change places").clicked() {
            compare.swap(first);
        }
    });
}

/// One line on what is compared, under the picture's upper edge.
pub fn verdict_words(rmse: Option<f64>) -> String {
    match rmse {
        Some(0.0) => "no difference".to_owned(),
        Some(rmse) => {
            format!("{} between the two", words::decibels(crate::accuracy::psnr_from_rmse(rmse)))
        }
        None => String::new(),
    }
}
