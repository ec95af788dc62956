//! How bare samples lie in a file: asked with a live preview of one slice.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::{
    ColorImage, ComboBox, Context, DragValue, Grid, RichText, Slider, TextureHandle,
    TextureOptions, Ui, Vec2, vec2,
};

use super::{Outcome, buttons_ui, modal};
use crate::app::document::{Library, RawLayout, Slice, Source};
use crate::app::job::{Ended, Job};
use crate::app::panels::lists::ListUi;
use crate::app::panels::name_ui;
use crate::app::panels::typed;
use crate::app::sentences::without_flags;
use crate::app::{theme, words};
use crate::volume::ScalarType;

/// Side of the square that the preview fits in, points.
const PREVIEW: f32 = 250.0;

/// A layout being chosen.
pub struct RawDialog {
    path: PathBuf,
    reason: Option<String>,
    found_bytes: u64,
    layout: RawLayout,
    z: u64,
    asked: Option<(RawLayout, u64)>,
    slice: Option<Job<Result<Slice, String>>>,
    preview: Option<Result<TextureHandle, String>>,
}

impl RawDialog {
    /// Starts from `layout`, or from what the file's name and length tell; `reason` says why it is
    /// asked for.
    ///
    /// # Errors
    /// One sentence when the file cannot even be measured.
    pub fn new(
        library: &dyn Library,
        path: &Path,
        layout: Option<RawLayout>,
        reason: Option<String>,
    ) -> Result<Self, String> {
        let found_bytes = library.file_bytes(path)?;
        let layout = layout.unwrap_or_else(|| library.guess_raw(path));
        Ok(Self {
            path: path.to_owned(),
            reason: reason.map(|reason| without_flags(&reason)),
            found_bytes,
            layout,
            z: layout.dims[2] / 2,
            asked: None,
            slice: None,
            preview: None,
        })
    }

    /// Shows the dialog.
    pub fn show(&mut self, ctx: &Context, library: &Arc<dyn Library>) -> Outcome<Source> {
        let name = Source::File(self.path.clone()).name();
        let refusal = self.layout.refusal(self.found_bytes);
        self.update_preview(ctx, library, refusal.is_none());
        modal(ctx, "raw", "Raw file layout", 590.0, |ui| {
            ui.label(RichText::new(name).color(theme::TEXT_FAINT));
            if let Some(reason) = &self.reason {
                ui.label(RichText::new(reason).color(theme::TEXT_FAINT));
            }
            ui.add_space(4.0);
            ui.horizontal_top(|ui| {
                ui.vertical(|ui| {
                    ui.set_width(300.0);
                    self.fields_ui(ui);
                    ui.add_space(6.0);
                    self.bytes_ui(ui, refusal.as_deref());
                });
                ui.vertical(|ui| self.preview_ui(ui));
            });
            let (path, layout) = (self.path.clone(), self.layout);
            buttons_ui(ui, "Open", refusal.as_deref(), false, || Source::Raw(path, layout))
        })
    }

    fn fields_ui(&mut self, ui: &mut Ui) {
        let layout = &mut self.layout;
        Grid::new("raw fields").num_columns(2).spacing([14.0, 7.0]).show(ui, |ui| {
            name_ui(ui, "Dimensions").on_hover_text("Samples along x (fastest), y and z");
            ui.horizontal(|ui| {
                for (n, axis) in layout.dims.iter_mut().zip(["x", "y", "z"]) {
                    let name = format!("Dimension {axis}");
                    let drag = typed::number(ui, &name, n, 1..=1_000_000_u64).speed(0.5);
                    ui.add(drag).accessible_name(name);
                }
            });
            ui.end_row();

            let suggestions = layout.suggestions(self.found_bytes);
            let name = name_ui(ui, "Suggested")
                .on_hover_text("Usual shapes of volumes that fill the file exactly");
            ui.add_enabled_ui(!suggestions.is_empty(), |ui| {
                let told = |layout: &RawLayout| {
                    let [x, y, z] = layout.dims;
                    format!("{x} × {y} × {z}, {}", layout.scalar_type.name())
                };
                let text = match suggestions.iter().find(|one| *one == layout) {
                    Some(chosen) => told(chosen),
                    None if suggestions.is_empty() => "None fits".to_owned(),
                    None => "Choose…".to_owned(),
                };
                ComboBox::from_id_salt("raw suggestions")
                    .selected_text(text)
                    .show_ui(ui, |ui| {
                        for suggestion in &suggestions {
                            ui.choice_of(layout, *suggestion, told(suggestion));
                        }
                    })
                    .response
                    .labelled_by(name.id);
            });
            ui.end_row();

            let name = name_ui(ui, "Type").on_hover_text("How each sample is stored");
            ComboBox::from_id_salt("raw type")
                .selected_text(layout.scalar_type.name())
                .show_ui(ui, |ui| {
                    for t in ScalarType::ALL {
                        ui.choice_of(&mut layout.scalar_type, t, t.name());
                    }
                })
                .response
                .labelled_by(name.id);
            ui.end_row();

            name_ui(ui, "Byte order").on_hover_text(
                "Which byte of a sample comes first: the wrong one looks like coarse noise",
            );
            ui.horizontal(|ui| {
                let matters = layout.scalar_type.size_bytes() > 1;
                ui.add_enabled_ui(matters, |ui| {
                    ui.radio_value(&mut layout.big_endian, false, "Little-endian");
                    ui.radio_value(&mut layout.big_endian, true, "Big-endian");
                });
            });
            ui.end_row();

            name_ui(ui, "Skip").on_hover_text("Bytes of header before the samples");
            ui.add(DragValue::new(&mut layout.skip_bytes).suffix(" bytes"))
                .accessible_name("Bytes to skip");
            ui.end_row();

            name_ui(ui, "Spacing").on_hover_text("Distance between samples along x, y and z");
            ui.horizontal(|ui| {
                for (s, axis) in layout.spacing.iter_mut().zip(["x", "y", "z"]) {
                    let drag = DragValue::new(s).speed(0.01).max_decimals(6);
                    ui.add(drag).accessible_name(format!("Spacing {axis}"));
                }
            });
            ui.end_row();
        });
    }

    /// Expected against found, and the reason where they do not fit.
    fn bytes_ui(&self, ui: &mut Ui, refusal: Option<&str>) {
        let expected =
            self.layout.expected_bytes().map_or("beyond 64 bits".to_owned(), words::count);
        Grid::new("raw bytes").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
            for (name, bytes) in [("Expected", expected), ("Found", words::count(self.found_bytes))]
            {
                name_ui(ui, name);
                ui.label(if bytes == "1" { "1 byte".to_owned() } else { format!("{bytes} bytes") });
                ui.end_row();
            }
        });
        let (text, colour) = match refusal {
            Some(reason) => (format!("This does not fit: {reason}"), theme::ERROR),
            None if self.layout.expected_bytes() == Some(self.found_bytes) => {
                ("The file is filled exactly".to_owned(), theme::NOTE)
            }
            None => ("The file holds more than that; the rest is left out".to_owned(), theme::TEXT),
        };
        ui.label(RichText::new(text).color(colour));
    }

    fn preview_ui(&mut self, ui: &mut Ui) {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(PREVIEW), eframe::egui::Sense::hover());
        ui.painter().rect_filled(rect, 4.0, theme::WELL);
        match &self.preview {
            Some(Ok(texture)) => {
                let (size, spacing) = (texture.size_vec2(), self.layout.spacing);
                #[expect(clippy::cast_possible_truncation, reason = "a shape on screen")]
                let aspect = (spacing[0] / spacing[1]).abs() as f32;
                let shape = vec2(size.x * aspect, size.y);
                let fitted = shape * (PREVIEW / shape.max_elem().max(1.0));
                let place = eframe::egui::Rect::from_center_size(rect.center(), fitted);
                eframe::egui::Image::from_texture(texture).paint_at(ui, place);
            }
            Some(Err(reason)) => centred(ui, rect, reason),
            None => centred(ui, rect, "No preview"),
        }
        let last = self.layout.dims[2].saturating_sub(1);
        self.z = self.z.min(last);
        ui.spacing_mut().slider_width = PREVIEW - 90.0;
        ui.add_enabled(last > 0, Slider::new(&mut self.z, 0..=last.max(1)).text("Slice"))
            .on_hover_text("Which slice across z the preview shows");
        self.z = self.z.min(last);
    }

    /// Asks for a new slice when the layout changed, and takes one that has come.
    fn update_preview(&mut self, ctx: &Context, library: &Arc<dyn Library>, fits: bool) {
        let wanted = (self.layout, self.z);
        if !fits {
            self.preview = Some(Err("The layout does not fit the file".to_owned()));
            (self.slice, self.asked) = (None, None);
        } else if self.asked != Some(wanted) {
            let (library, path) = (Arc::clone(library), self.path.clone());
            let (layout, z) = wanted;
            self.slice = Some(Job::start("raw-preview", "Reading a slice", ctx, move |_| {
                library.raw_slice(&path, &layout, z)
            }));
            self.asked = Some(wanted);
        }
        let ended = self.slice.as_ref().and_then(Job::poll);
        let Some(ended) = ended else { return };
        self.slice = None;
        self.preview = Some(match ended {
            Ended::Finished(Ok(slice)) => {
                let image = ColorImage::from_gray(slice.size, &slice.grey);
                Ok(ctx.load_texture("raw preview", image, TextureOptions::NEAREST))
            }
            Ended::Finished(Err(reason)) => Err(reason),
            Ended::Lost => Err("The slice could not be read".to_owned()),
        });
    }
}

fn centred(ui: &Ui, rect: eframe::egui::Rect, text: &str) {
    let font = eframe::egui::FontId::proportional(12.0);
    let galley = ui.painter().layout(text.to_owned(), font, theme::TEXT_FAINT, rect.width() - 24.0);
    ui.painter().galley(rect.center() - galley.size() / 2.0, galley, theme::TEXT_FAINT);
}
