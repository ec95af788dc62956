//! Saving a picture at any size.

use std::path::PathBuf;

use eframe::egui::{
    Button, Checkbox, Context, DragValue, Grid, Id, Key, Label, RichText, TextEdit, Ui,
};

use super::{Outcome, buttons_ui, modal};
use crate::app::file_dialog::FileDialog;
use crate::app::panels::name_ui;
use crate::app::panels::typed;
use crate::app::{theme, words};
use crate::task::loop_file::{Cycle, MOST_FRAMES};

/// Greatest side of a saved picture, pixels.
const MAX_SIDE: u32 = 16_384;
/// What is said of other sizes.
const BEYOND_SIZES: &str =
    "Pictures are from 1 to 16384 pixels wide and high: the size stays as it was";

/// What a picture is to be.
#[derive(Debug, Clone, PartialEq)]
pub struct SaveChoice {
    /// Size in pixels.
    pub size: [u32; 2],
    /// Draw the background, or keep the picture's transparency.
    pub with_background: bool,
    /// Write over it what is written over the view.
    pub with_annotations: bool,
    /// Where to.
    pub path: PathBuf,
    /// A whole cycle of the animation rather than one picture.
    pub cycle: Option<Cycle>,
}

/// A choice being made.
pub struct SaveDialog {
    viewport: [u32; 2],
    size: [u32; 2],
    keep_shape: bool,
    with_background: bool,
    /// Whether anything is written over the view, and is to be over the picture.
    is_annotated: bool,
    with_annotations: bool,
    path: String,
    cycle: Option<Cycle>,
    /// What a pixel of the picture on screen took, milliseconds.
    pixel_ms: Option<f64>,
    browser: Option<FileDialog>,
    trouble: Option<&'static str>,
    /// The field of the path, once it was shown.
    file_field: Option<Id>,
    /// What is at the path, once that was looked at.
    found: Found,
    /// The folder that is made where there is none: the one that the dialog came with.
    own_folder: Option<PathBuf>,
}

/// What is at a path.
#[derive(Debug, Default)]
struct Found {
    path: String,
    /// There is a file, which would be replaced.
    is_there: bool,
    /// There is no such folder to write it into.
    lacks_folder: bool,
}

impl SaveDialog {
    /// Twice the viewport, saved at `path`. `is_annotated`: whether anything is written over the view.
    pub fn new(
        viewport: [u32; 2],
        with_background: bool,
        is_annotated: bool,
        path: &std::path::Path,
    ) -> Self {
        Self {
            viewport,
            size: viewport.map(|n| n.saturating_mul(2).clamp(1, MAX_SIDE)),
            keep_shape: true,
            with_background,
            is_annotated,
            with_annotations: is_annotated,
            path: path.display().to_string(),
            cycle: None,
            pixel_ms: None,
            browser: None,
            trouble: None,
            file_field: None,
            found: Found::default(),
            own_folder: path.parent().map(std::path::Path::to_owned),
        }
    }

    /// A cycle of the animation at the viewport's size.
    pub fn of_cycle(
        viewport: [u32; 2],
        with_background: bool,
        is_annotated: bool,
        path: &std::path::Path,
    ) -> Self {
        let dialog = Self::new(viewport, with_background, is_annotated, path);
        Self { size: viewport, cycle: Some(Cycle::default()), ..dialog }
    }

    /// The same, with what a pixel took of the last picture on screen that was drawn in full.
    #[must_use]
    pub fn with_pixel_ms(self, pixel_ms: Option<f64>) -> Self {
        Self { pixel_ms, ..self }
    }

    /// Milliseconds that saving is thought to take.
    fn expected_ms(&self) -> Option<f64> {
        let pixels = self.size.iter().map(|n| f64::from(*n)).product::<f64>();
        let pictures = self.cycle.map_or(1.0, |cycle| f64::from(cycle.frames));
        self.pixel_ms.map(|ms| ms * pixels * pictures)
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context) -> Outcome<SaveChoice> {
        FileDialog::take_path(&mut self.browser, &mut self.path, &mut self.trouble);
        let title = if self.cycle.is_some() { "Save loop" } else { "Save picture" };
        modal(ctx, "save picture", title, 480.0, |ui| {
            // Of a number that is typed it is the end.
            let typed = ui.memory(|memory| memory.focused());
            Grid::new("save fields").num_columns(2).spacing([14.0, 8.0]).show(ui, |ui| {
                name_ui(ui, "Size");
                self.size_ui(ui);
                ui.end_row();
                name_ui(ui, "Background");
                ui.checkbox(&mut self.with_background, "Draw the background")
                    .on_hover_text("Without it the picture keeps its transparency");
                ui.end_row();
                name_ui(ui, "Annotations");
                self.annotations_ui(ui);
                ui.end_row();
                if let Some(cycle) = &mut self.cycle {
                    name_ui(ui, "Cycle");
                    cycle_ui(ui, cycle);
                    ui.end_row();
                }
                name_ui(ui, "File");
                self.path_ui(ui);
                ui.end_row();
            });
            if let Some(ms) = self.expected_ms() {
                let text = format!(
                    "Drawing takes up to {}; getting ready and writing the file, a few seconds more",
                    words::roughly(ms)
                );
                ui.add(Label::new(RichText::new(text).color(theme::TEXT_FAINT))).on_hover_text(
                    "From what the view on screen took, by the number of pixels. The window stays free, and the \
                     bar over the view tells how much is left",
                );
            }
            if let Some(trouble) = self.trouble {
                ui.label(trouble);
            }
            self.look();
            let refusal = self.refusal();
            let replaces =
                self.found.is_there.then_some("There is a file of that name: it will be replaced");
            if let Some(text) = refusal.or(replaces) {
                ui.add(Label::new(RichText::new(text).color(theme::NOTE)).wrap());
            }
            let verb = if self.found.is_there { "Replace" } else { "Save" };
            let is_free = typed.is_none() || typed == self.file_field;
            let enter = is_free && ui.input(|input| input.key_pressed(Key::Enter));
            buttons_ui(ui, verb, refusal, enter, || SaveChoice {
                size: self.size,
                with_background: self.with_background,
                with_annotations: self.with_annotations && self.takes_annotations().is_ok(),
                path: PathBuf::from(self.path.trim()),
                cycle: self.cycle,
            })
        })
    }

    /// Takes another size, or says why not.
    fn resize(&mut self, size: [u32; 2]) {
        if !size.iter().all(|side| (1..=MAX_SIDE).contains(side)) {
            self.trouble = Some(BEYOND_SIZES);
            return;
        }
        self.trouble = None;
        self.size = if self.keep_shape { in_shape(self.size, size) } else { size };
    }

    fn size_ui(&mut self, ui: &mut Ui) {
        ui.vertical(|ui| {
            ui.horizontal(|ui| {
                let mut size = self.size;
                let width = drag(&mut size[0]);
                let width = ui.add(width).accessible_name("Width in pixels");
                ui.label("×");
                let height = drag(&mut size[1]);
                let height = ui.add(height).accessible_name("Height in pixels");
                ui.label("pixels");
                if width.changed() || height.changed() {
                    self.resize(size);
                }
            });
            ui.horizontal(|ui| {
                ui.checkbox(&mut self.keep_shape, "Keep shape")
                    .on_hover_text("Change width and height together");
                for (label, factor) in [("1×", 1), ("2×", 2), ("4×", 4)] {
                    let size = self.viewport.map(|n| n.saturating_mul(factor).min(MAX_SIDE));
                    let chosen = Button::new(label).selected(size == self.size);
                    if ui.add(chosen).on_hover_text("Times the viewport's size").clicked() {
                        self.size = size;
                    }
                }
            });
        });
    }

    fn annotations_ui(&mut self, ui: &mut Ui) {
        let takes = self.takes_annotations();
        let mut never = false;
        let value = if takes.is_ok() { &mut self.with_annotations } else { &mut never };
        let switch = Checkbox::new(value, "Include annotations");
        let shown = ui.add_enabled(takes.is_ok(), switch);
        let shown =
            shown.on_hover_text("Scalar bar, scale bar, axes, trihedron: those that are on");
        shown.on_disabled_hover_text(takes.err().unwrap_or_default());
    }

    /// Whether the picture can have annotations, or why not.
    fn takes_annotations(&self) -> Result<(), &'static str> {
        if self.path.trim().to_ascii_lowercase().ends_with(".exr") {
            return Err("An EXR holds light alone: save as .png to have annotations");
        }
        if !self.is_annotated {
            return Err("Nothing is written over the view: switch it on under View, Annotations");
        }
        Ok(())
    }

    fn path_ui(&mut self, ui: &mut Ui) {
        ui.vertical(|ui| {
            let help = match self.cycle {
                None => {
                    "Ends in .png for a picture to look at, or .exr for linear light and \
                     premultiplied alpha in full precision"
                }
                Some(_) => {
                    "Ends in .gif for an animation, or .png for numbered pictures in full colour"
                }
            };
            let field = ui
                .add(TextEdit::singleline(&mut self.path).desired_width(360.0))
                .accessible_name("File to save")
                .on_hover_text(help);
            self.file_field = Some(field.id);
            let asking = self.browser.is_some();
            if ui.add_enabled(!asking, Button::new("Browse…")).clicked() {
                let path = PathBuf::from(&self.path);
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                self.browser = Some(FileDialog::save(ui.ctx(), &name));
            }
        });
    }

    /// Looks at what is at the path, once for each that is typed.
    fn look(&mut self) {
        let path = self.path.trim();
        if path == self.found.path {
            return;
        }
        let file = std::path::Path::new(path);
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let is_own = folder == self.own_folder.as_deref();
        self.found = Found {
            path: path.to_owned(),
            is_there: file.is_file(),
            lacks_folder: !is_own && folder.is_some_and(|folder| !folder.is_dir()),
        };
    }

    /// Why the picture cannot be saved like this.
    fn refusal(&self) -> Option<&'static str> {
        let path = self.path.trim().to_ascii_lowercase();
        match () {
            () if path.is_empty() => Some("Type where to save the picture"),
            () if self.found.lacks_folder => {
                Some("There is no such folder: make it, or choose another place")
            }
            () if self.cycle.is_some() => match path.ends_with(".gif") || path.ends_with(".png") {
                true => None,
                false => Some("The file's name must end in .gif or .png"),
            },
            () if !path.ends_with(".png") && !path.ends_with(".exr") => {
                Some("The file's name must end in .png or .exr")
            }
            () => None,
        }
    }
}

/// How many pictures a cycle has, and how long it takes.
fn cycle_ui(ui: &mut Ui, cycle: &mut Cycle) {
    ui.horizontal(|ui| {
        let name = "Pictures of the loop";
        ui.add(typed::number(ui, name, &mut cycle.frames, 2..=MOST_FRAMES))
            .accessible_name(name)
            .on_hover_text("32 are two a step of the marks: more are smoother and larger");
        ui.label("pictures in");
        let name = "Seconds of the loop";
        let seconds = typed::number(ui, name, &mut cycle.seconds, 0.1..=60.0);
        ui.add(seconds.speed(0.05).max_decimals(2)).accessible_name(name);
        ui.label("seconds");
    });
}

fn drag(side: &mut u32) -> DragValue<'_> {
    // Whoever types what no picture can have is told.
    DragValue::new(side).range(0..=u32::MAX).speed(4.0).update_while_editing(false)
}

/// `after` with the side that was left alone brought into the shape of `before`.
fn in_shape(before: [u32; 2], after: [u32; 2]) -> [u32; 2] {
    let follow = |changed: usize| {
        let factor = f64::from(after[changed]) / f64::from(before[changed].max(1));
        let other = (f64::from(before[1 - changed]) * factor).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let other = other.clamp(1.0, f64::from(MAX_SIDE)) as u32;
        other
    };
    if after[0] != before[0] { [after[0], follow(0)] } else { [follow(1), after[1]] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_side_follows_in_shape() {
        assert_eq!(in_shape([800, 600], [1600, 600]), [1600, 1200]);
        assert_eq!(in_shape([800, 600], [800, 300]), [400, 300]);
        assert_eq!(in_shape([1, 16_384], [2, 16_384]), [2, MAX_SIDE]);
    }

    #[test]
    fn sizes_that_no_picture_can_have_are_refused_and_change_nothing() {
        let path = std::path::Path::new("a.png");
        let mut dialog = SaveDialog::new([640, 480], true, false, path);
        for beyond in [[0, 960], [1280, MAX_SIDE + 1], [u32::MAX, 1]] {
            dialog.resize(beyond);
            assert_eq!((dialog.size, dialog.trouble), ([1280, 960], Some(BEYOND_SIZES)));
        }
        dialog.resize([MAX_SIDE, 960]);
        assert_eq!((dialog.size, dialog.trouble), ([MAX_SIDE, 12_288], None));
    }

    #[test]
    fn the_time_of_saving_is_told_before_by_the_pixels_and_pictures() {
        let path = std::path::Path::new("a.png");
        let dialog = SaveDialog::new([100, 50], true, true, path).with_pixel_ms(Some(0.5));
        assert_eq!(
            dialog.expected_ms(),
            Some(0.5 * 20_000.0),
            "twice the size, four times as long"
        );
        let cycle = SaveDialog::of_cycle([100, 50], true, true, path).with_pixel_ms(Some(0.5));
        assert_eq!(cycle.expected_ms(), Some(0.5 * 5000.0 * f64::from(Cycle::default().frames)));
        assert_eq!(SaveDialog::new([100, 50], true, true, path).expected_ms(), None);
    }

    #[test]
    fn the_default_is_twice_the_viewport_and_only_known_formats_are_taken() {
        let mut dialog = SaveDialog::new([640, 480], true, true, std::path::Path::new("a.png"));
        assert_eq!(dialog.size, [1280, 960]);
        assert_eq!(dialog.refusal(), None);
        assert!(dialog.takes_annotations().is_ok());
        dialog.path = "a.EXR".into();
        assert_eq!(dialog.refusal(), None);
        assert!(dialog.takes_annotations().is_err_and(|why| why.contains("light alone")));
        for bad in ["", "  ", "a", "a.jpg"] {
            dialog.path = bad.into();
            assert!(dialog.refusal().is_some(), "{bad}");
        }
    }

    #[test]
    fn a_file_that_is_replaced_and_a_folder_that_is_missing_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name).display().to_string();
        std::fs::write(at("old.png"), b"a picture").expect("a file");
        let own = folder.path().join("pictures/a.png");
        let mut dialog = SaveDialog::new([64, 48], true, true, &own);
        let mut told = |path: String| {
            dialog.path = path;
            dialog.look();
            (dialog.found.is_there, dialog.refusal())
        };
        assert_eq!(told(at("old.png")), (true, None));
        assert_eq!(told(at("new.png")), (false, None));
        assert!(told(at("none/new.png")).1.is_some_and(|why| why.contains("no such folder")));
        assert_eq!(told(at("pictures/b.png")), (false, None), "its own folder is made");
        assert_eq!(told("c.png".to_owned()), (false, None), "beside the program");
    }
}
