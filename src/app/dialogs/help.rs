//! The cheat-sheet: every key and every gesture.

use eframe::egui::{Context, Grid, RichText, ScrollArea, Ui};

use super::{Outcome, modal};
use crate::app::actions::{ACTIONS, GESTURES};
use crate::app::theme;

/// What of the window's height is left to the title, the button and a margin, points.
const AROUND: f32 = 150.0;

/// Shows the sheet; true once it was closed.
pub fn help_ui(ctx: &Context) -> bool {
    let outcome = modal(ctx, "help", "Keys and mouse", 560.0, |ui| {
        // A small window scrolls.
        let room = (ctx.content_rect().height() - AROUND).max(120.0);
        ScrollArea::vertical().max_height(room).show(ui, |ui| {
            ui.spacing_mut().interact_size.y = 18.0;
            Grid::new("gestures").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
                for (gesture, effect) in GESTURES {
                    row_ui(ui, gesture, effect);
                }
            });
            ui.separator();
            Grid::new("keys").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
                for entry in &ACTIONS {
                    if let Some(shortcut) = &entry.shortcut {
                        row_ui(ui, &ctx.format_shortcut(shortcut), entry.help);
                    }
                }
            });
        });
        ui.add_space(6.0);
        if ui.button("Close").clicked() { Outcome::Done(()) } else { Outcome::Open }
    });
    outcome != Outcome::Open
}

fn row_ui(ui: &mut Ui, what: &str, effect: &str) {
    ui.label(RichText::new(what).color(theme::ACCENT));
    ui.label(effect);
    ui.end_row();
}
