//! Letting go of the tools in the viewport.

use eframe::egui::{Context, Popup};

use super::modes;
use super::window::Window;

impl Window {
    /// Whether Escape would end a tool or take an error away: nothing else is there that it closes or leaves first.
    pub(super) fn escape_ends_tools(&self, ctx: &Context) -> bool {
        let has_tool = self.leveling.on || self.probing.is_on() || self.cells.on;
        let has_any = has_tool || self.effects.open || self.notices.has_errors();
        let is_held = ctx.input(|input| input.pointer.any_down());
        has_any && self.dialog.is_none() && !self.had_focus && !is_held && !Popup::is_any_open(ctx)
    }

    /// Takes note of whether something has the keyboard, which Escape takes from it before anyone is asked.
    pub(super) fn note_focus(&mut self, ctx: &Context) {
        self.had_focus = ctx.memory(|memory| memory.focused().is_some());
    }

    /// Shows or hides the octree's cells. Over a mesh or points that are drawn as they are they would say nothing.
    pub(super) fn toggle_cells(&mut self) {
        let has_none =
            self.scene.as_ref().is_some_and(|scene| modes::is_of_cells_or_points(&scene.splat));
        if has_none && !self.cells.on {
            self.notices.hint(
                "Cells and points that are drawn as they are have no octree: other kernels, under Drawing, draw samples \
                 that have one",
            );
        } else {
            self.cells.on = !self.cells.on;
        }
    }

    /// Ends window and level, the probe and the octree's cells, and takes errors and the panel of effects off the picture.
    pub(super) fn end_tools(&mut self, ctx: &Context) {
        self.notices.dismiss_errors();
        self.leveling.on = false;
        self.cells.on = false;
        self.effects.open = false;
        if self.probing.is_on() {
            self.toggle_probe(ctx);
        }
    }
}
