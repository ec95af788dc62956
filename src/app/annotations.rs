//! Annotations painted over the picture on screen.

use eframe::egui::{
    Checkbox, Color32, CornerRadius, FontId, Painter, Pos2, Rect, Stroke, Ui, Vec2, vec2,
};
use glam::DVec2;

use super::actions::{Action, entry_of};
use super::viewport::PixelArea;
use crate::scene::annotations::{Area, Ink, Primitive};
use crate::scene::{Annotation, Annotations};
use crate::task::annotations::halo_reach;

/// Places around words from which their halo is made, and how much of it each lays down: some of them
/// overlap everywhere.
const AROUND: usize = 8;
const HALO_SHARE: f64 = 0.4;

/// Paints annotations that were laid out for the pixels of `area`.
pub fn paint(painter: &Painter, area: PixelArea, primitives: &[Primitive]) {
    let painter = painter.with_clip_rect(area.rect.intersect(painter.clip_rect()));
    let points_per_pixel = area.rect.width() / area.size[0] as f32;
    let screen = Screen { painter, corner: area.rect.min, points_per_pixel };
    primitives.iter().for_each(|primitive| screen.paint(primitive));
}

struct Screen {
    painter: Painter,
    /// Of the picture, points.
    corner: Pos2,
    points_per_pixel: f32,
}

impl Screen {
    fn at(&self, pixel: DVec2) -> Pos2 {
        let pixel = pixel.as_vec2();
        self.corner + vec2(pixel.x, pixel.y) * self.points_per_pixel
    }

    #[expect(clippy::cast_possible_truncation, reason = "lengths on screen")]
    fn length(&self, pixels: f64) -> f32 {
        pixels as f32 * self.points_per_pixel
    }

    fn paint(&self, primitive: &Primitive) {
        match primitive {
            Primitive::Line { ends, width, ink } => {
                let stroke = Stroke::new(self.length(*width), colour(*ink, 1.0));
                self.painter.line_segment(ends.map(|end| self.at(end)), stroke);
            }
            Primitive::Dot { centre, radius, ink } => {
                let (at, radius) = (self.at(*centre), self.length(*radius));
                self.painter.circle_filled(at, radius, colour(*ink, 1.0));
            }
            Primitive::Rectangle { area: Area { low, high }, ink } => {
                let rect = Rect::from_min_max(self.at(*low), self.at(*high));
                self.painter.rect_filled(rect, CornerRadius::ZERO, colour(*ink, 1.0));
            }
            Primitive::Text { at, size, text, ink, halo } => {
                self.text(*at, *size, text, *ink, *halo);
            }
        }
    }

    fn text(&self, at: DVec2, size: f64, text: &str, ink: Ink, halo: Ink) {
        let font = FontId::proportional(self.length(size));
        let galley = self.painter.layout_no_wrap(text.to_owned(), font, Color32::PLACEHOLDER);
        // From the upper left corner of the words to their baseline.
        let baseline = galley.rows.first().map_or(Vec2::ZERO, |row| {
            vec2(0.0, row.pos.y + row.glyphs.first().map_or(0.0, |glyph| glyph.pos.y))
        });
        let corner = self.at(at) - baseline;
        let reach = self.length(halo_reach(size));
        for i in 0..AROUND {
            let angle = i as f32 / AROUND as f32 * std::f32::consts::TAU;
            let place = corner + Vec2::angled(angle) * reach;
            self.painter.galley(place, std::sync::Arc::clone(&galley), colour(halo, HALO_SHARE));
        }
        self.painter.galley(corner, galley, colour(ink, 1.0));
    }
}

fn colour(Ink { colour, opacity }: Ink, share: f64) -> Color32 {
    let [r, g, b] = colour.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let alpha = (opacity * share * 255.0).round().clamp(0.0, 255.0) as u8;
    Color32::from_rgba_unmultiplied(r, g, b, alpha)
}

/// Their names in the window, and what each is, one line.
pub const NAMES: [(Annotation, &str, &str); 4] = [
    (Annotation::ScalarBar, "Scalar bar", "Which colour is which value, and how opaque"),
    (
        Annotation::ScaleBar,
        "Scale bar",
        "A round length in the file's units; in perspective as it is at the focal plane",
    ),
    (Annotation::Axes, "Axes", "The box around the volume, with where it lies in the world"),
    (Annotation::Trihedron, "Trihedron", "The directions of the world's axes, in the corner"),
];

/// The action that switches one of them.
fn action_of(which: Annotation) -> Action {
    match which {
        Annotation::ScalarBar => Action::ToggleScalarBar,
        Annotation::ScaleBar => Action::ToggleScaleBar,
        Annotation::Axes => Action::ToggleAxes,
        Annotation::Trihedron => Action::ToggleTrihedron,
    }
}

/// A switch for each; those `left_out` say that the view has no room for them.
pub fn switches_ui(ui: &mut Ui, annotations: &mut Annotations, left_out: &[Annotation]) {
    ui.horizontal_wrapped(|ui| {
        for (which, name, help) in NAMES {
            let key = entry_of(action_of(which)).shortcut;
            let key = key.map(|key| format!(" (key {})", ui.ctx().format_shortcut(&key)));
            let has_no_room = annotations.has(which) && left_out.contains(&which);
            let words = if has_no_room { format!("{name} (no room)") } else { name.to_owned() };
            let switch = ui.add(Checkbox::new(annotations.switch(which), words));
            let room = if has_no_room { ". The viewport is too small for it" } else { "" };
            switch.accessible_name(name).on_hover_text(format!(
                "{help}{}{room}. Saved pictures have it, too, where that is wanted",
                key.unwrap_or_default()
            ));
        }
    });
}
