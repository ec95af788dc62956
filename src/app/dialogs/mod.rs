//! Dialogs: what is asked before something is done, one file each.
//!
//! Each holds its own state, shows itself as a modal, and says what came of it.

pub mod about;
pub mod find;
pub mod help;
pub mod named_file;
pub mod open_path;
pub mod raw;
pub mod save;

use eframe::egui::text::{CCursor, CCursorRange};
use eframe::egui::{
    Button, Context, Event, Frame, Id, Key, Modal, Modifiers, Response, RichText, TextEdit, Ui,
};

/// What is left to the window beside a dialog, and the narrowest dialog, points.
const BESIDE: f32 = 60.0;
const NARROWEST: f32 = 200.0;

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

/// One line of text that has the keyboard from the first pass of its dialog on. What it begins with is selected: what is typed takes its place.
#[derive(Debug, Default)]
struct TextLine {
    text: String,
    has_begun: bool,
}

impl TextLine {
    fn new(text: String) -> Self {
        Self { text, has_begun: false }
    }

    fn show(&mut self, ui: &mut Ui, hint: &str) -> Response {
        let begins = !std::mem::replace(&mut self.has_begun, true);
        // Typed in the pass that brought the dialog, before the field could take it.
        let typed = if begins { typed_text(ui) } else { String::new() };
        let is_typed = !typed.is_empty();
        if is_typed {
            self.text = typed;
        }
        let edit = TextEdit::singleline(&mut self.text);
        let shown = edit.desired_width(f32::INFINITY).hint_text(hint).show(ui);
        let response = shown.response.response;
        if begins {
            let mut state = shown.state;
            let end = CCursor::new(self.text.chars().count());
            let begin = if is_typed { end } else { CCursor::new(0) };
            state.cursor.set_char_range(Some(CCursorRange::two(begin, end)));
            state.store(ui.ctx(), response.id);
            response.request_focus();
        }
        response
    }
}

/// What was typed and pasted in this pass.
fn typed_text(ui: &Ui) -> String {
    let text = |event: &Event| match event {
        Event::Text(text) | Event::Paste(text) => Some(text.clone()),
        _ => None,
    };
    ui.input(|input| input.events.iter().filter_map(text).collect())
}

/// A modal with a title; Escape cancels it. A click beside it does nothing: it would lose what was typed.
fn modal<T>(
    ctx: &Context,
    id: &str,
    title: &str,
    width: f32,
    add: impl FnOnce(&mut Ui) -> Outcome<T>,
) -> Outcome<T> {
    shown_modal(ctx, id, title, width, add).0
}

/// The same; and whether there was a click beside it.
fn shown_modal<T>(
    ctx: &Context,
    id: &str,
    title: &str,
    width: f32,
    add: impl FnOnce(&mut Ui) -> Outcome<T>,
) -> (Outcome<T>, bool) {
    let frame = Frame::popup(&ctx.global_style()).inner_margin(18).corner_radius(10);
    let modal = Modal::new(Id::unique(id)).frame(frame).show(ctx, |ui| {
        // No wider than the window.
        ui.set_width(width.min(ui.ctx().content_rect().width() - BESIDE).max(NARROWEST));
        ui.label(RichText::new(title).heading().strong());
        ui.add_space(6.0);
        add(ui)
    });
    let beside = modal.backdrop_response.clicked();
    let is_asked = modal.is_top_modal && !modal.any_popup_open;
    let closed = is_asked && ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
    match modal.inner {
        Outcome::Open if closed => (Outcome::Cancelled, beside),
        outcome => (outcome, beside),
    }
}

/// A sheet to be read; true once it was closed, by its button, Enter, Escape or a click beside it: nothing is typed here that could
/// be lost.
fn sheet(ctx: &Context, id: &str, title: &str, width: f32, add: impl FnOnce(&mut Ui)) -> bool {
    let (outcome, beside) = shown_modal(ctx, id, title, width, |ui| {
        add(ui);
        ui.add_space(6.0);
        let enter = ui.input(|input| input.key_pressed(Key::Enter));
        if ui.button("Close").clicked() || enter { Outcome::Done(()) } else { Outcome::Open }
    });
    beside || outcome != Outcome::Open
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
