//! What the window has to say: one sentence each. Hints and news are quiet lines that go by themselves, what did not work is a
//! bar that stays until it is dismissed; older ones fold, so that the picture stays in sight.

use std::sync::Arc;
use std::time::Duration;

use eframe::egui::accesskit::Role;
use eframe::egui::text::LayoutJob;
use eframe::egui::{
    Align, Button, Color32, CornerRadius, FontSelection, Frame, Label, Layout, Margin, RichText,
    Sense, Stroke, Ui, Vec2, WidgetInfo, WidgetText, vec2,
};

use super::actions::{Action, entry_of};
use super::sentences::without_flags;
use super::theme;
use crate::core::counted;

/// How many are kept; older ones make room.
const LIMIT: usize = 12;
/// How many are shown at once; older ones fold into one line.
const MOST_SHOWN: usize = 2;
/// Size of the words of news, points, and how dark what they lie on is, 0..=255.
const QUIET_SIZE: f32 = 13.0;
const QUIET_SHADE: u8 = 170;
/// Between them and its edge, points.
const QUIET_MARGIN: Vec2 = vec2(10.0, 4.0);
/// Room for the button at the right of a bar, points.
const BUTTON_WIDTH: f32 = 76.0;

/// Seconds that a hint is shown, longer while the pointer is on it.
const HINT_SECONDS: f64 = 6.0;
/// The same of news, which may be longer to read.
const NOTE_SECONDS: f64 = 12.0;
/// And news with a button.
const OFFER_SECONDS: f64 = 20.0;
/// An error stays for so many seconds, whatever succeeds meanwhile.
const LEAST_ERROR_SECONDS: f64 = 6.0;

/// Bad news or news.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Something did not work.
    Error,
    /// Something to know.
    Note,
    /// Something to know now: why a key did nothing, or that something is done.
    Hint,
}

/// One sentence.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// Bad news or news.
    pub kind: Kind,
    /// The sentence.
    pub text: String,
    /// A command that it offers.
    pub offer: Option<Action>,
    /// When it was first shown, seconds on the interface's clock.
    shown_at: Option<f64>,
}

impl Notice {
    /// How many rows of it lie over the picture.
    fn most_rows(&self) -> usize {
        match self.kind {
            Kind::Error => 4,
            Kind::Note | Kind::Hint => 2,
        }
    }

    /// Seconds that are left at a time; no end for what has to be dismissed.
    fn left(&self, now: f64) -> f64 {
        match (self.kind, self.shown_at) {
            (Kind::Hint, Some(since)) => since + HINT_SECONDS - now,
            (Kind::Note, Some(since)) if self.offer.is_some() => since + OFFER_SECONDS - now,
            (Kind::Note, Some(since)) => since + NOTE_SECONDS - now,
            _ => f64::INFINITY,
        }
    }
}

/// What is shown, oldest first.
#[derive(Debug, Default)]
pub struct Notices {
    shown: Vec<Notice>,
    /// Whether the older ones are shown, too.
    unfolded: bool,
    /// Time of the last pass, seconds on the interface's clock.
    now: f64,
    /// What was offered and taken.
    taken: Option<Action>,
}

impl Notices {
    /// What is shown, oldest first.
    pub fn shown(&self) -> &[Notice] {
        &self.shown
    }

    /// Shows bad news.
    pub fn error(&mut self, text: impl Into<String>) {
        self.push(Kind::Error, text.into(), None);
    }

    /// Shows news.
    pub fn note(&mut self, text: impl Into<String>) {
        self.push(Kind::Note, text.into(), None);
    }

    /// Shows news with a button for a command.
    pub fn offer(&mut self, action: Action, text: impl Into<String>) {
        self.push(Kind::Note, text.into(), Some(action));
    }

    /// Takes away what offers a command that has nothing to do any more.
    pub fn withdraw(&mut self, action: Action) {
        self.shown.retain(|notice| notice.offer != Some(action));
    }

    /// The command that was offered, once its button was pressed.
    pub fn take_offer(&mut self) -> Option<Action> {
        self.taken.take()
    }

    /// Shows news that go by themselves.
    pub fn hint(&mut self, text: impl Into<String>) {
        self.push(Kind::Hint, text.into(), None);
    }

    /// Takes away errors that have been on screen for a while: something that was asked for since has succeeded.
    pub fn settle(&mut self) {
        let is_read = |notice: &Notice| {
            notice.kind == Kind::Error
                && notice.shown_at.is_some_and(|since| self.now - since >= LEAST_ERROR_SECONDS)
        };
        self.shown.retain(|notice| !is_read(notice));
    }

    /// Whether an error is on screen.
    pub fn has_errors(&self) -> bool {
        self.shown.iter().any(|notice| notice.kind == Kind::Error)
    }

    /// Takes errors off the screen.
    pub fn dismiss_errors(&mut self) {
        self.shown.retain(|notice| notice.kind != Kind::Error);
    }

    /// Takes off the picture what has been there long enough to be read, but for what did not work: the hand turns the picture.
    pub fn give_way(&mut self) {
        let is_read = |notice: &Notice| {
            notice.kind != Kind::Error
                && notice.shown_at.is_some_and(|since| self.now - since >= HINT_SECONDS)
        };
        self.shown.retain(|notice| !is_read(notice));
    }

    /// Takes everything off the screen.
    pub fn clear(&mut self) {
        self.shown.clear();
    }

    fn push(&mut self, kind: Kind, text: String, offer: Option<Action>) {
        let text = sentence_case(&without_flags(&one_line(&text)));
        // Of the same news with other numbers the last ones are enough.
        let says_the_same = |other: &str| words_of(other).eq(words_of(&text));
        self.shown.retain(|notice| !says_the_same(&notice.text));
        if self.shown.len() == LIMIT {
            self.shown.remove(0);
        }
        self.shown.push(Notice { kind, text, offer, shown_at: None });
    }

    /// Draws the bars, newest at the bottom, and asks to be drawn again when one has to go.
    pub fn bars_ui(&mut self, ui: &mut Ui) {
        let now = ui.input(|input| input.time);
        self.now = now;
        self.shown.retain(|notice| notice.left(now) > 0.0);
        let older = self.shown.len().saturating_sub(MOST_SHOWN);
        if older > 0 {
            self.fold_ui(ui, older);
        } else {
            self.unfolded = false;
        }
        let folded = if self.unfolded { 0 } else { self.shown.len().saturating_sub(MOST_SHOWN) };
        let mut dismissed = None;
        for (index, notice) in self.shown.iter_mut().enumerate() {
            if index < folded {
                // What is folded away goes on waiting for its end.
                notice.shown_at.get_or_insert(now);
                continue;
            }
            let bar = match notice.kind {
                Kind::Error => bar_ui(ui, notice),
                Kind::Note | Kind::Hint => quiet_ui(ui, notice),
            };
            if notice.shown_at.is_none() || bar.is_pointed_at {
                notice.shown_at = Some(now);
            }
            if bar.is_dismissed || bar.is_taken {
                dismissed = Some(index);
            }
            if bar.is_taken {
                self.taken = notice.offer;
            }
            if let Ok(left) = Duration::try_from_secs_f64(notice.left(now)) {
                ui.ctx().request_repaint_after(left);
            }
        }
        if let Some(index) = dismissed {
            self.shown.remove(index);
        }
    }
}

impl Notices {
    /// The line that older ones are folded into.
    fn fold_ui(&mut self, ui: &mut Ui, older: usize) {
        let words = RichText::new(counted(older, "older message")).color(theme::TEXT_FAINT);
        let mut is_cleared = false;
        frame(theme::PANEL, theme::LINE).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label(words);
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    is_cleared = ui.button("Dismiss all").clicked();
                    let label = if self.unfolded { "Hide" } else { "Show" };
                    let name = format!("{label} older messages");
                    if ui.button(label).accessible_name(name).clicked() {
                        self.unfolded = !self.unfolded;
                    }
                });
            });
        });
        if is_cleared {
            self.clear();
        }
    }
}

/// What a bar lies on.
fn frame(fill: Color32, line: Color32) -> Frame {
    Frame::new()
        .fill(fill)
        .stroke(Stroke::new(1.0, line))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin::symmetric(10, 6))
}

/// A text without its numbers.
fn words_of(text: &str) -> impl Iterator<Item = &str> {
    let is_number =
        |word: &str| word.trim_matches(|c: char| !c.is_ascii_alphanumeric()).parse::<f64>().is_ok();
    text.split(' ').filter(move |word| !is_number(word))
}

/// What the hand does with a bar.
struct Bar {
    is_dismissed: bool,
    is_pointed_at: bool,
    is_taken: bool,
}

/// Bad news, with a button.
fn bar_ui(ui: &mut Ui, notice: &Notice) -> Bar {
    let frame = frame(Color32::from_rgb(58, 34, 34), theme::ERROR.gamma_multiply(0.5));
    let words = RichText::new(&notice.text).color(theme::ERROR.lerp_to_gamma(theme::TEXT, 0.45));
    let shown =
        frame.show(ui, |ui| text_and_button_ui(ui, (words, notice.most_rows()), "Dismiss", true));
    let is_pointed_at = shown.response.contains_pointer();
    Bar { is_dismissed: shown.inner, is_pointed_at, is_taken: false }
}

/// News: words on a shade no wider than they are, gone with a click, over the button of what they offer.
fn quiet_ui(ui: &mut Ui, notice: &Notice) -> Bar {
    let words = RichText::new(&notice.text).size(QUIET_SIZE).color(theme::TEXT);
    let mut job = wrapped(ui, words, notice.most_rows());
    job.wrap.max_width = (ui.available_width() - 2.0 * QUIET_MARGIN.x).max(1.0);
    let galley = ui.painter().layout_job(job);
    let line = ui.vertical_centered(|ui| {
        let size = galley.size() + 2.0 * QUIET_MARGIN;
        let (rect, line) = ui.allocate_exact_size(size, Sense::click());
        line.widget_info(|| WidgetInfo::labeled(Role::Label, true, &notice.text));
        let shade = Color32::from_black_alpha(QUIET_SHADE);
        ui.painter().rect_filled(rect, CornerRadius::same(8), shade);
        ui.painter().galley(rect.min + QUIET_MARGIN, galley, theme::TEXT);
        let offered = notice.offer.map(entry_of);
        (line, offered.map(|entry| ui.button(entry.name).on_hover_text(entry.help)))
    });
    let (line, button) = line.inner;
    // Words that offer something do it, like their button: who clicks them means that.
    let help = notice.offer.map_or("Click to take it away", |offer| entry_of(offer).help);
    let line = line.on_hover_text(help);
    let is_offer = notice.offer.is_some();
    Bar {
        is_dismissed: line.clicked() && !is_offer,
        is_pointed_at: line.contains_pointer()
            || button.as_ref().is_some_and(|button| button.contains_pointer()),
        is_taken: button.is_some_and(|button| button.clicked()) || line.clicked() && is_offer,
    }
}

/// Text that wraps into so many rows at most.
fn wrapped(ui: &Ui, text: RichText, most_rows: usize) -> LayoutJob {
    let text = WidgetText::from(text);
    let job = text.into_layout_job(ui.style(), FontSelection::Default, Align::Center);
    let mut job = Arc::unwrap_or_clone(job);
    job.wrap.max_rows = most_rows;
    job
}

/// Text that wraps into so many rows at most, whole while the pointer rests on it, and a button at its right; true once that
/// was clicked.
pub(super) fn text_and_button_ui(
    ui: &mut Ui,
    (text, most_rows): (RichText, usize),
    button: &str,
    enabled: bool,
) -> bool {
    let job = wrapped(ui, text, most_rows);
    ui.horizontal(|ui| {
        // As high as the button from the start: one line stands beside it, more go below.
        let height = ui.spacing().interact_size.y;
        let room = vec2((ui.available_width() - BUTTON_WIDTH).max(40.0), height);
        ui.allocate_ui_with_layout(room, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(room.x);
            ui.add(Label::new(job).wrap().selectable(true));
        });
        ui.add_enabled(enabled, Button::new(button)).clicked()
    })
    .inner
}

/// A sentence begins with a capital letter, but where it begins with the name of a file.
fn sentence_case(text: &str) -> String {
    let is_word = text.split(' ').next().is_some_and(|word| word.chars().all(char::is_alphabetic));
    let mut letters = text.chars();
    match letters.next().filter(|_| is_word) {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => text.to_owned(),
    }
}

/// Messages of libraries may hold line breaks; a bar holds a sentence.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Context, RawInput, Shape, ViewportId};

    use super::*;

    #[test]
    fn the_same_sentence_is_shown_once_and_old_ones_make_room() {
        let mut notices = Notices::default();
        for text in ["a", "b", "a", "c", "d", "e"] {
            notices.error(text);
        }
        let texts = |notices: &Notices| -> Vec<String> {
            notices.shown().iter().map(|n| n.text.clone()).collect()
        };
        assert_eq!(texts(&notices), ["B", "A", "C", "D", "E"]);
        for letter in 'f'..='o' {
            notices.error(letter.to_string());
        }
        assert_eq!((notices.shown().len(), &*texts(&notices)[0]), (LIMIT, "D"));
    }

    #[test]
    fn notices_fold_so_that_a_few_lie_over_the_picture_however_many_there_are() {
        let ctx = Context::default();
        let mut notices = Notices::default();
        let height = |notices: &mut Notices| {
            let mut height = 0.0;
            for _ in 0..3 {
                let mut output = ctx.run_ui(RawInput::default(), |ui| {
                    notices.bars_ui(ui);
                    height = ui.min_rect().height();
                });
                output.textures_delta.clear();
            }
            height
        };
        for text in ["a", "b", "c"] {
            notices.error(text);
        }
        let of_three = height(&mut notices);
        for text in ["d", "e", "f", "g", "h"] {
            notices.error(text);
        }
        assert_eq!(height(&mut notices), of_three, "two and a line for the others");
        notices.unfolded = true;
        assert!(height(&mut notices) > 2.0 * of_three, "all of them once that is wanted");
    }

    #[test]
    fn long_news_cover_two_rows_of_the_picture_and_bad_ones_four() {
        let ctx = Context::default();
        let height = |kind: Kind, text: &str| {
            let mut notices = Notices::default();
            notices.push(kind, text.to_owned(), None);
            let mut height = 0.0;
            for _ in 0..3 {
                let mut output = ctx.run_ui(RawInput::default(), |ui| {
                    ui.set_max_width(400.0);
                    notices.bars_ui(ui);
                    height = ui.min_rect().height();
                });
                output.textures_delta.clear();
            }
            height
        };
        let long = "word ".repeat(400);
        let [one, two, four] = [(Kind::Note, "one"), (Kind::Note, &*long), (Kind::Error, &*long)]
            .map(|(k, t)| height(k, t));
        assert!(one < two && two < four, "{one} {two} {four}");
        assert!(two < 3.0 * one && four < 5.0 * one, "{one} {two} {four}");
    }

    #[test]
    fn of_the_same_news_with_other_numbers_the_last_are_shown() {
        let mut notices = Notices::default();
        for text in
            ["found more (1.5e9)", "opened scan 3: a1", "found more (2e7)", "opened scan 3: a2"]
        {
            notices.error(text);
        }
        let texts: Vec<_> = notices.shown().iter().map(|n| n.text.as_str()).collect();
        assert_eq!(texts, ["Opened scan 3: a1", "Found more (2e7)", "Opened scan 3: a2"]);
    }

    /// Draws the bars at a time, and tells when they are to be drawn again.
    fn drawn(notices: &mut Notices, ctx: &Context, time: f64) -> Duration {
        let input = RawInput { time: Some(time), ..RawInput::default() };
        let mut output = ctx.run_ui(input, |ui| notices.bars_ui(ui));
        // Nobody paints them.
        output.textures_delta.clear();
        output.viewport_output[&ViewportId::ROOT].repaint_delay
    }

    #[test]
    fn bad_news_that_were_read_go_once_something_went_well() {
        let ctx = Context::default();
        let mut notices = Notices::default();
        notices.error("old");
        notices.note("note");
        drawn(&mut notices, &ctx, 1.0);
        notices.error("new");
        drawn(&mut notices, &ctx, 5.0);
        drawn(&mut notices, &ctx, 8.0);
        notices.settle();
        let texts: Vec<_> = notices.shown().iter().map(|n| n.text.as_str()).collect();
        assert_eq!(texts, ["Note", "New"]);
    }

    #[test]
    fn one_line_stands_beside_its_button() {
        let ctx = Context::default();
        let mut notices = Notices::default();
        notices.error("News");
        let mut shapes = Vec::new();
        for _ in 0..3 {
            let mut output = ctx.run_ui(RawInput::default(), |ui| notices.bars_ui(ui));
            output.textures_delta.clear();
            shapes = output.shapes;
        }
        let middle = |words: &str| {
            shapes.iter().find_map(|clipped| match &clipped.shape {
                Shape::Text(text) if text.galley.text() == words => {
                    Some(text.visual_bounding_rect().center().y)
                }
                _ => None,
            })
        };
        let [news, button] = ["News", "Dismiss"].map(|words| middle(words).expect("painted"));
        // The descender of neither counts for more than this.
        assert!((news - button).abs() < 3.0, "words at {news}, the button's at {button}");
    }

    #[test]
    fn news_are_lines_without_a_button_no_wider_than_their_words() {
        let ctx = Context::default();
        let mut notices = Notices::default();
        notices.note("News");
        let mut shapes = Vec::new();
        for _ in 0..3 {
            let mut output = ctx.run_ui(RawInput::default(), |ui| notices.bars_ui(ui));
            output.textures_delta.clear();
            shapes = output.shapes;
        }
        let says = |words: &str| {
            shapes
                .iter()
                .any(|one| matches!(&one.shape, Shape::Text(text) if text.galley.text() == words))
        };
        assert!(says("News") && !says("Dismiss"));
        let widest = shapes.iter().filter_map(|one| match &one.shape {
            Shape::Rect(rect) => Some(rect.rect.width()),
            _ => None,
        });
        let widest = widest.fold(0.0, f32::max);
        // Four letters and the margin: 56 points, of a window of thousands.
        assert!((30.0..90.0).contains(&widest), "{widest}");
    }

    #[test]
    fn hints_and_news_go_by_themselves_and_what_did_not_work_stays() {
        let mut notices = Notices::default();
        notices.error("bad");
        let ctx = Context::default();
        // The first passes settle where things are.
        for _ in 0..3 {
            drawn(&mut notices, &ctx, 100.0);
        }
        assert_eq!(drawn(&mut notices, &ctx, 101.0), Duration::MAX, "nothing to come");
        notices.hint("by the way");
        for _ in 0..3 {
            drawn(&mut notices, &ctx, 102.0);
        }
        let again = drawn(&mut notices, &ctx, 103.0).as_secs_f64();
        assert!((HINT_SECONDS - 1.5..HINT_SECONDS).contains(&again), "{again} s");
        assert_eq!(notices.shown().len(), 2);
        drawn(&mut notices, &ctx, 102.0 + HINT_SECONDS - 0.1);
        assert_eq!(notices.shown().len(), 2);
        drawn(&mut notices, &ctx, 102.0 + HINT_SECONDS);
        let left: Vec<_> = notices.shown().iter().map(|n| n.text.as_str()).collect();
        assert_eq!(left, ["Bad"]);
        notices.note("News");
        drawn(&mut notices, &ctx, 200.0);
        drawn(&mut notices, &ctx, 200.0 + NOTE_SECONDS - 0.1);
        assert_eq!(notices.shown().len(), 2, "news may be longer to read");
        drawn(&mut notices, &ctx, 200.0 + NOTE_SECONDS);
        drawn(&mut notices, &ctx, 1e6);
        assert_eq!(notices.shown().len(), 1);
    }

    #[test]
    fn what_has_been_read_goes_once_the_picture_is_turned_and_what_did_not_work_stays() {
        let mut notices = Notices::default();
        let ctx = Context::default();
        notices.error("bad");
        notices.offer(Action::ShowFaded, "read");
        drawn(&mut notices, &ctx, 10.0);
        notices.note("new");
        drawn(&mut notices, &ctx, 9.9 + HINT_SECONDS);
        notices.give_way();
        assert_eq!(notices.shown().len(), 3, "none has been there for long");
        drawn(&mut notices, &ctx, 10.1 + HINT_SECONDS);
        notices.give_way();
        let left: Vec<_> = notices.shown().iter().map(|n| n.text.as_str()).collect();
        assert_eq!(left, ["Bad", "New"]);
    }

    #[test]
    fn a_message_of_several_lines_becomes_one() {
        let mut notices = Notices::default();
        notices.note("one\n  two\tthree");
        assert_eq!(notices.shown()[0].text, "One two three");
        notices.note("a.png is no picture");
        assert_eq!(notices.shown()[1].text, "a.png is no picture", "the name of a file");
    }
}
