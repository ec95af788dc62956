//! Entries of drop-down lists.

use eframe::egui::{IntoAtoms, Response, Ui};

/// Adds entries that close their list once they are chosen: egui closes lists for the pointer alone, and Enter would leave them open.
pub(in crate::app) trait ListUi {
    /// One entry, and whether it is what is chosen now.
    fn choice<'a>(&mut self, is_chosen: bool, text: impl IntoAtoms<'a>) -> Response;

    /// One entry that sets `value` to `one`.
    fn choice_of<'a, T: PartialEq>(
        &mut self,
        value: &mut T,
        one: T,
        text: impl IntoAtoms<'a>,
    ) -> Response {
        let mut response = self.choice(*value == one, text);
        if response.clicked() && *value != one {
            *value = one;
            response.mark_changed();
        }
        response
    }
}

impl ListUi for Ui {
    fn choice<'a>(&mut self, is_chosen: bool, text: impl IntoAtoms<'a>) -> Response {
        let response = self.selectable_label(is_chosen, text);
        if response.clicked() {
            self.close();
        }
        response
    }
}
