//! Dialogs: what is asked before something is done, one file each.
//!
//! Each holds its own state, shows itself as a modal, and says what came of it.

pub mod help;
pub mod open_path;
pub mod raw;
pub mod save;
pub mod transfer_file;

use eframe::egui::{Button, Context, Frame, Id, Modal, RichText, Ui};

/// What came of a dialog in one pass.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome<T> {
    /// It stays open.
    Open,
    /// It was closed without an answer.
    Cancelled,
    /// It was closed with this answer.
    Done(T),
}

/// A modal with a title; closing it by Escape or a click beside it cancels.
fn modal<T>(
    ctx: &Context,
    id: &str,
    title: &str,
    width: f32,
    add: impl FnOnce(&mut Ui) -> Outcome<T>,
) -> Outcome<T> {
    let frame = Frame::popup(&ctx.global_style()).inner_margin(18).corner_radius(10);
    let modal = Modal::new(Id::unique(id)).frame(frame).show(ctx, |ui| {
        ui.set_width(width);
        ui.label(RichText::new(title).heading().strong());
        ui.add_space(6.0);
        add(ui)
    });
    let closed = modal.should_close();
    match modal.inner {
        Outcome::Open if closed => Outcome::Cancelled,
        outcome => outcome,
    }
}

/// Cancel and the button that does it, pressed too when `enter`; `refusal` says why it cannot be.
fn buttons_ui<T>(
    ui: &mut Ui,
    verb: &str,
    refusal: Option<&str>,
    enter: bool,
    answer: impl FnOnce() -> T,
) -> Outcome<T> {
    ui.add_space(10.0);
    ui.horizontal(|ui| {
        let fill = ui.visuals().selection.bg_fill;
        let go = ui.add_enabled(refusal.is_none(), Button::new(verb).fill(fill));
        let go = go.on_disabled_hover_text(refusal.unwrap_or_default());
        let cancel = ui.button("Cancel").clicked();
        if go.clicked() || (enter && refusal.is_none() && !cancel) {
            Outcome::Done(answer())
        } else if cancel {
            Outcome::Cancelled
        } else {
            Outcome::Open
        }
    })
    .inner
}
