//! What can be found by name: every command, and every setting of the side panel.

use eframe::egui::Context;

use super::actions::{ACTIONS, Action, Menu};
use super::dialogs::find::Findable;
use super::layout::{NO_SIDE_ROOM, has_side_room};
use super::modes;
use super::panels::flow::FLOW;
use super::panels::places::{PLACES, Place, SAVE_LOOP};
use super::panels::{self, ON_TOP, SPLATS, VECTORS};
use super::window::Window;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found {
    Command(Action),
    Setting(Place),
}

/// What a menu is called.
fn title(menu: Menu) -> &'static str {
    match menu {
        Menu::File => "File",
        Menu::Edit => "Edit",
        Menu::Add => "Add",
        Menu::View => "View menu",
        Menu::Camera => "Camera",
        Menu::Help => "Help",
    }
}

impl Window {
    /// All of it, with what each is for and why it can do nothing now, if so.
    pub(super) fn findables(&self, ctx: &Context) -> Vec<Findable<Found>> {
        let commands = ACTIONS.iter().filter(|entry| entry.action != Action::Find);
        let commands = commands.map(|entry| Findable {
            name: entry.name.to_owned(),
            place: title(entry.menu),
            help: entry.help,
            key: entry.shortcut.map(|key| ctx.format_shortcut(&key)),
            refusal: self.why_not(entry.action),
            what: Found::Command(entry.action),
        });
        let settings = PLACES.iter().map(|place| Findable {
            name: place.name.to_owned(),
            place: match (place.section, &self.scene) {
                (SPLATS, Some(scene)) => modes::section(&scene.splat),
                (section, _) => section,
            },
            help: place.help,
            key: None,
            refusal: self.why_not_there(ctx, place),
            what: Found::Setting(*place),
        });
        commands.chain(settings).collect()
    }

    /// Why a setting is not in the side panel, if so.
    fn why_not_there(&self, ctx: &Context, place: &Place) -> Option<&'static str> {
        let has_vectors = self.document.as_ref().is_some_and(|document| document.has_vectors());
        match () {
            () if self.scene.is_none() => Some("Nothing is open"),
            () if !has_side_room(ctx) => Some(NO_SIDE_ROOM),
            () if place.section == VECTORS && !has_vectors => Some("This file has no vectors"),
            () => None,
        }
    }

    /// Does what a command says, or shows where a setting is.
    pub(super) fn go_to(&mut self, ctx: &Context, found: Found) {
        match found {
            Found::Command(action) => self.perform(ctx, action),
            Found::Setting(place) => {
                self.settings.side_panel = true;
                if place.section != ON_TOP {
                    self.show_section(ctx, place.section);
                }
                panels::seek_row(ctx, place.section, place.name);
                if place.name == FLOW {
                    panels::seek(ctx, FLOW);
                }
                if place.name == SAVE_LOOP {
                    self.ask_to_save_loop();
                }
            }
        }
    }
}
