//! Finding a command or a setting by its name, or by what other programs call it.

use eframe::egui::{
    Align, Button, Context, Id, Key, Label, Layout, Modifiers, RichText, ScrollArea, Sense, Ui,
    UiBuilder, vec2,
};

use super::{Outcome, TextLine, modal};
use crate::app::theme;

/// What other programs call things, and what they are called here.
const ALSO_CALLED: [(&str, &str); 49] = [
    ("3d", "rendering"),
    ("alpha", "opacity"),
    ("ambient", "lights"),
    ("axial", "slice"),
    ("bookmark", "view"),
    ("brightness", "window and level"),
    ("center", "reset view"),
    ("color", "colour"),
    ("colormap", "colours"),
    ("compress", "basis functions"),
    ("contour", "isosurface"),
    ("contrast", "window and level"),
    ("coronal", "slice"),
    ("crop", "clip"),
    ("cut", "clip"),
    ("edges", "slice"),
    ("export", "save"),
    ("fit", "reset view"),
    ("fps", "pictures a second"),
    ("glyph", "marks"),
    ("gray", "grey"),
    ("histogram", "transfer"),
    ("hotkeys", "keys"),
    ("import", "open"),
    ("info", "dimensions"),
    ("interpolation", "kernel"),
    ("legend", "scalar bar"),
    ("lookup", "colours"),
    ("loop", "animation"),
    ("lut", "colours"),
    ("mesh", "polygons"),
    ("movie", "animation"),
    ("mpr", "slice"),
    ("orthogonal", "slice"),
    ("palette", "colours"),
    ("property", "transfer"),
    ("resample", "slabs"),
    ("ruler", "scale bar"),
    ("sagittal", "slice"),
    ("sampling", "slabs"),
    ("segmentation", "labels"),
    ("shortcuts", "keys"),
    ("snapshot", "screenshot"),
    ("step", "slabs"),
    ("threshold", "isosurface"),
    ("threshold", "opacity"),
    ("tracer", "streamlines"),
    ("transparent", "opacity"),
    ("wireframe", "slice"),
];
/// Height of the list, and what of the window's height is left to the rest, points.
const LIST: f32 = 380.0;
const AROUND: f32 = 220.0;
/// Width of what stands at the right of a row, points.
const AT_RIGHT: f32 = 130.0;

/// Something that can be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Findable<T> {
    /// Its name on the screen.
    pub name: String,
    /// Where it stands: a menu, or a section of the side panel.
    pub place: &'static str,
    /// What it is for, one line.
    pub help: &'static str,
    /// Its key, as it is written here.
    pub key: Option<String>,
    /// Why it can do nothing now, if so.
    pub refusal: Option<&'static str>,
    /// What is answered where it is chosen.
    pub what: T,
}

impl<T> Findable<T> {
    /// How far it is from a word that was asked for, of lower case; `None` where it is something else.
    fn distance(&self, word: &str) -> Option<usize> {
        let name = self.name.to_lowercase();
        let place = self.place.to_lowercase();
        let texts = [&name, &place, &self.help.to_lowercase()];
        let begins = |text: &str, word: &str| {
            text.split(|c: char| !c.is_alphanumeric()).any(|part| part.starts_with(word))
        };
        let of_one = |word: &str| match () {
            () if name.starts_with(word) => Some(0),
            () if begins(&name, word) => Some(1),
            () if begins(&place, word) => Some(2),
            () => texts.iter().position(|text| text.contains(word)).map(|which| which + 3),
        };
        let called = ALSO_CALLED.iter().filter(|(other, _)| other.starts_with(word));
        let called = called.filter(|_| word.len() > 2).filter_map(|(_, ours)| of_one(ours));
        of_one(word).into_iter().chain(called.map(|found| found + 1)).min()
    }

    /// How many of several words it has nothing of, and how far it is from the others; `None` where it has nothing of any.
    fn distance_to_some(&self, words: &[String]) -> Option<(usize, usize)> {
        let found: Vec<usize> = words.iter().filter_map(|word| self.distance(word)).collect();
        (!found.is_empty()).then(|| (words.len() - found.len(), found.iter().sum()))
    }
}

/// The places in a list of those that were asked for, nearest first.
fn found<T>(all: &[Findable<T>], asked: &str) -> Vec<usize> {
    let words: Vec<String> = asked.to_lowercase().split_whitespace().map(str::to_owned).collect();
    let places = all.iter().enumerate();
    // What can do nothing now comes last.
    let key = |(i, one): (usize, &Findable<T>)| {
        let distance = match words.is_empty() {
            true => (0, 0),
            false => one.distance_to_some(&words)?,
        };
        Some((one.refusal.is_some() && !words.is_empty(), distance, i))
    };
    let mut found: Vec<(bool, (usize, usize), usize)> = places.filter_map(key).collect();
    // What has all words, or as many as anything has.
    let least = found.iter().map(|(_, (missing, _), _)| *missing).min();
    found.retain(|(_, (missing, _), _)| Some(*missing) == least);
    found.sort_unstable();
    found.into_iter().map(|(_, _, i)| i).collect()
}

/// Something being looked for.
#[derive(Debug, Default)]
pub struct Find {
    asked: TextLine,
    /// The row that Enter takes.
    row: usize,
}

impl Find {
    /// Shows the dialog over all that can be found.
    pub fn show<T: Clone>(&mut self, ctx: &Context, all: &[Findable<T>]) -> Outcome<T> {
        modal(ctx, "find", "Find a command or a setting", 520.0, |ui| {
            let step =
                |key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key));
            let (up, down) = (step(Key::ArrowUp), step(Key::ArrowDown));
            let enter = ui.input(|input| input.key_pressed(Key::Enter));
            let line = self.asked.show(ui, "Slice, crop, colour map, screenshot…");
            if line.accessible_name("What is looked for").changed() {
                self.row = 0;
            }
            let found = found(all, &self.asked.text);
            self.row = (self.row + down).saturating_sub(up).min(found.len().saturating_sub(1));
            ui.add_space(6.0);
            // As high whatever was found: what is typed stays where it is.
            let room = (ui.ctx().content_rect().height() - AROUND).clamp(80.0, LIST);
            let size = vec2(ui.available_width(), room);
            let list = ui.allocate_ui(size, |ui| {
                ui.set_min_size(size);
                list_ui(ui, all, &found, (self.row, up + down > 0))
            });
            let taken = list.inner.or_else(|| found.get(self.row).copied().filter(|_| enter));
            match taken.map(|i| &all[i]).filter(|one| one.refusal.is_none()) {
                Some(one) => Outcome::Done(one.what.clone()),
                None => Outcome::Open,
            }
        })
    }
}

/// The rows that were found, scrolled to the next one where that has `moved`; which was clicked.
fn list_ui<T>(
    ui: &mut Ui,
    all: &[Findable<T>],
    found: &[usize],
    (next, moved): (usize, bool),
) -> Option<usize> {
    if found.is_empty() {
        let text = "Nothing is called that. Another word may find it, or Help, Keys and mouse";
        ui.label(RichText::new(text).color(theme::TEXT_FAINT));
        return None;
    }
    let list = ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        let taken = found.iter().enumerate().filter_map(|(row, &i)| {
            let shown = row_ui(ui, &all[i], row == next);
            if row == next && moved {
                shown.scroll_to_me(None);
            }
            shown.clicked().then_some(i)
        });
        // All rows are drawn, whichever was clicked.
        taken.last()
    });
    list.inner
}

/// One row: its name, where it stands and its key, over what it is for or why it can do nothing.
fn row_ui<T>(ui: &mut Ui, one: &Findable<T>, is_next: bool) -> eframe::egui::Response {
    let size = vec2(ui.available_width(), 38.0);
    let button = Button::selectable(is_next, "").min_size(size).sense(Sense::click());
    let shown = ui.add_enabled(one.refusal.is_none(), button).accessible_name(&one.name);
    let inside = shown.rect.shrink2(vec2(8.0, 2.0));
    let strong = if one.refusal.is_none() { theme::TEXT } else { theme::TEXT_FAINT };
    let words = |text: &str, size, colour| {
        Label::new(RichText::new(text).size(size).color(colour)).selectable(false).truncate()
    };
    let rows =
        UiBuilder::new().max_rect(inside).id_salt(Id::unique(("found", one.place, &one.name)));
    ui.scope_builder(rows, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        ui.horizontal(|ui| {
            ui.scope(|ui| {
                ui.set_max_width((ui.available_width() - AT_RIGHT).max(80.0));
                ui.add(words(&one.name, 14.0, strong));
            });
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if let Some(key) = &one.key {
                    ui.add(words(key, 12.0, theme::ACCENT));
                }
                ui.add(words(one.place, 12.0, theme::TEXT_FAINT));
            });
        });
        ui.add(words(one.refusal.unwrap_or(one.help), 12.0, theme::TEXT_FAINT));
    });
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findable(name: &str, place: &'static str, help: &'static str) -> Findable<()> {
        Findable { name: name.to_owned(), place, help, key: None, refusal: None, what: () }
    }

    #[test]
    fn the_nearest_name_comes_first_and_other_programs_words_are_known() {
        let all = [
            findable("Axes", "View", "Show the box around the volume"),
            findable("Clip box", "Add", "Keep a part of the volume"),
            findable("Add clip plane", "Clip", "Cut along a plane"),
            findable("Isosurface", "Add", "A surface where the values pass a level"),
            findable("Colours", "Transfer function", "Which colour is which value"),
        ];
        let names = |asked: &str| -> Vec<&str> {
            found(&all, asked).into_iter().map(|i| &*all[i].name).collect()
        };
        assert_eq!(names("clip"), ["Clip box", "Add clip plane"]);
        assert_eq!(names("box"), ["Clip box", "Axes"]);
        assert_eq!(names("Crop"), ["Clip box", "Add clip plane"]);
        assert_eq!(names("contour"), ["Isosurface"]);
        // Where nothing has all words, what has most of them.
        assert_eq!(names("color map"), ["Colours"]);
        assert_eq!(names("volume clip property"), ["Clip box"]);
        assert_eq!(names("color value"), ["Colours"]);
        assert_eq!(names("add plane"), ["Add clip plane"]);
        assert_eq!(names("colormap"), ["Colours"]);
        assert_eq!(names("").len(), all.len());
        assert!(names("zzz").is_empty());
        let mut refused = all.clone();
        refused[1].refusal = Some("Nothing is open");
        let nearest = found(&refused, "clip").into_iter().map(|i| &*refused[i].name);
        assert_eq!(nearest.collect::<Vec<_>>(), ["Add clip plane", "Clip box"]);
    }

    #[test]
    fn words_of_other_programs_are_in_order_and_are_none_of_ours() {
        assert!(ALSO_CALLED.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(ALSO_CALLED.iter().all(|(other, ours)| !ours.contains(other)));
    }
}
