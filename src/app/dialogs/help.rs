//! The cheat-sheet: every key and every gesture.

use eframe::egui::scroll_area::ScrollBarVisibility;
use eframe::egui::style::ScrollStyle;
use eframe::egui::{Context, Grid, Label, RichText, ScrollArea, Ui};

use super::{BESIDE, sheet};
use crate::app::actions::{ACTIONS, Entry, GESTURES};
use crate::app::theme;

/// What of the window's height is left to the title, the button and a margin, points.
const AROUND: f32 = 150.0;
/// Width of the sheet with the mouse beside the keys, and with one below the other, points.
const WIDE: f32 = 1180.0;
const NARROW: f32 = 560.0;
/// Width of the longest gesture with its distance, points.
const GESTURE_WIDTH: f32 = 230.0;
/// The same of a key, points.
const KEY_WIDTH: f32 = 90.0;

/// Shows the sheet; true once it was closed.
pub fn help_ui(ctx: &Context) -> bool {
    let window = ctx.content_rect().size();
    let keys: Vec<_> = ACTIONS.iter().filter(|entry| entry.shortcut.is_some()).collect();
    let is_wide = window.x >= WIDE + BESIDE;
    let width = if is_wide { WIDE } else { NARROW };
    sheet(ctx, "help", "Keys and mouse", width, |ui| {
        // A small window scrolls, and shows that there is more.
        let room = (window.y - AROUND).max(120.0);
        ui.spacing_mut().scroll = ScrollStyle::solid();
        let list = ScrollArea::vertical().max_height(room).auto_shrink([false, true]);
        list.scroll_bar_visibility(ScrollBarVisibility::VisibleWhenNeeded).show(ui, |ui| {
            ui.spacing_mut().interact_size.y = 17.0;
            if is_wide {
                // Both sides are about as long.
                let (first, last) = keys.split_at(keys.len().saturating_sub(GESTURES.len()) / 2);
                ui.columns(2, |sides| {
                    gestures_ui(&mut sides[0]);
                    sides[0].separator();
                    keys_ui(&mut sides[0], "first keys", first);
                    keys_ui(&mut sides[1], "last keys", last);
                });
            } else {
                gestures_ui(ui);
                ui.separator();
                keys_ui(ui, "keys", &keys);
            }
        });
    })
}

/// Two columns, the first one so wide, of which the second one wraps.
fn grid(ui: &Ui, id: &str, first: f32) -> Grid {
    let grid = Grid::new(id).num_columns(2).spacing([24.0, 3.0]);
    grid.max_col_width((ui.available_width() - first).max(120.0))
}

fn gestures_ui(ui: &mut Ui) {
    grid(ui, "gestures", GESTURE_WIDTH).show(ui, |ui| {
        for (gesture, effect) in GESTURES {
            row_ui(ui, gesture, effect);
        }
    });
}

/// Those of some of the commands.
fn keys_ui(ui: &mut Ui, id: &str, entries: &[&Entry]) {
    grid(ui, id, KEY_WIDTH).show(ui, |ui| {
        for entry in entries {
            if let Some(shortcut) = &entry.shortcut {
                row_ui(ui, &ui.ctx().format_shortcut(shortcut), entry.help);
            }
        }
    });
}

fn row_ui(ui: &mut Ui, what: &str, effect: &str) {
    ui.label(RichText::new(what).color(theme::ACCENT));
    ui.add(Label::new(effect).wrap());
    ui.end_row();
}
