//! What the picture shows under the cursor: the first visible point of its ray, and the field there.

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Color32, CornerRadius, FontId, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2,
    vec2,
};
use glam::{DVec2, DVec3};

use super::viewport::PixelArea;
use super::{theme, words};
use crate::scene::annotations::Area;
use crate::scene::{AlongRay, Scene, axis_letters};
use crate::task::probe::{
    Answer, FIRST_SEEN, Look, Met, Point, ProbedVector, Prober, Seen, VectorPlace,
};
use crate::transfer::Kind;

/// Distance of the words from the viewport's left and top edges, and around them, points.
const INSET: f32 = 12.0;
const PADDING: f32 = 8.0;
const FONT: f32 = 12.0;
const LINE: f32 = 17.0;
/// Width of the column of names, points.
const NAMES: f32 = 66.0;
/// Half the length of the mark's arms, and of the gap in its middle, points.
const ARM: f32 = 9.0;
const GAP: f32 = 3.0;

/// The tool: whether it is chosen, what it was asked last and what it found.
#[derive(Default)]
pub struct Probing {
    prober: Option<Prober>,
    asked: Option<Look>,
    answer: Option<Answer>,
}

impl Probing {
    /// Whether it is chosen.
    pub fn is_on(&self) -> bool {
        self.prober.is_some()
    }

    /// Chooses it, or lets go of it and of the memory that it holds. `wake` is called when an answer
    /// has come.
    ///
    /// # Errors
    /// One sentence.
    pub fn toggle(&mut self, wake: impl Fn() + Send + 'static) -> Result<(), String> {
        if self.is_on() {
            *self = Self::default();
            return Ok(());
        }
        let refused = |error| format!("the probe cannot be started: {error}; close other programs");
        self.prober = Some(Prober::start(wake).map_err(refused)?);
        Ok(())
    }

    /// What was found last, if it is of what was asked last.
    pub fn answer(&self) -> Option<&Answer> {
        let answer = self.answer.as_ref()?;
        self.asked.as_ref().filter(|asked| asked.is_same(&answer.look)).map(|_| answer)
    }

    /// The world point that was found last, of the field that is shown, wherever the cursor went since.
    pub fn last_point(&self, scene: &Scene) -> Option<DVec3> {
        let answer = self.answer.as_ref()?;
        let is_of = answer.look.scene.has_same_volume(scene);
        match &answer.seen {
            Ok(Seen::Point(point)) if is_of => Some(point.world),
            _ => None,
        }
    }

    /// Asks about the pixel under the cursor while the view `rests`, and says what is there, `top`
    /// points below the viewport's upper edge, and beside what annotations have taken of the picture.
    pub fn show(
        &mut self,
        ui: &Ui,
        area: PixelArea,
        scene: &Scene,
        space: Option<&str>,
        (viewport, rests): (&Response, bool),
        (top, taken): (f32, &[Area]),
    ) {
        let Some(prober) = &self.prober else { return };
        let points_per_pixel = area.rect.width() / area.size[0] as f32;
        let at =
            |pixel: DVec2| area.rect.min + points_per_pixel * vec2(pixel.x as f32, pixel.y as f32);
        let taken = taken.iter().map(|taken| Rect::from_min_max(at(taken.low), at(taken.high)));
        let mut room = Room {
            rect: Rect::from_min_max(area.rect.min + vec2(0.0, top), area.rect.max),
            taken: taken.collect(),
            pointer: None,
        };
        if let Some(answer) = prober.take() {
            self.answer = Some(answer);
        }
        let pointer = viewport.hover_pos().filter(|_| rests && !viewport.dragged());
        let Some(pointer) = pointer else {
            self.asked = None;
            let hint = if rests { "Point at the picture" } else { "Once the view rests" };
            says(ui, &room, &[("Probe", hint.to_owned())]);
            return;
        };
        room.pointer = Some(pointer);
        let pixel = pixel_under(pointer, area);
        // Marks may move, and would be asked about in every pass; vectors stay where they are.
        let still = Scene { phase: 0.0, ..scene.clone() };
        let look = Look { scene: still, size: area.size, pixel, share: FIRST_SEEN };
        if !self.asked.as_ref().is_some_and(|asked| asked.is_same(&look)) {
            prober.ask(look.clone());
            self.asked = Some(look);
        }
        // Until the answer has come, that of the pixel before stays: words that blink cannot be read.
        let is_of_volume = |answer: &&Answer| answer.look.scene.has_same_volume(scene);
        let Some(answer) = self.answer.as_ref().filter(is_of_volume) else {
            says(ui, &room, &[("Probe", "Preparing the field…".to_owned())]);
            return;
        };
        says(ui, &room, &answer_words(answer, space));
        if matches!(answer.seen, Ok(Seen::Point(_))) {
            mark(ui, pointer);
        }
    }
}

/// The pixel under a position on screen.
fn pixel_under(pointer: Pos2, area: PixelArea) -> [u32; 2] {
    let pixels_per_point = area.size[0] as f32 / area.rect.width();
    let at = (pointer - area.rect.min) * pixels_per_point;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "≥ 0, cut off")]
    let pixel = |at: f32, size: u32| (at.max(0.0) as u32).min(size.saturating_sub(1));
    [pixel(at.x, area.size[0]), pixel(at.y, area.size[1])]
}

/// An answer as rows of a name and what it names.
pub fn answer_words(answer: &Answer, space: Option<&str>) -> Vec<(&'static str, String)> {
    let percent = |share: f64| format!("{} %", words::value((share * 1000.0).round() / 10.0));
    let nothing = |what: String| vec![("Probe", what)];
    match &answer.seen {
        Err(reason) => nothing(reason.clone()),
        Ok(Seen::Average) => nothing(
            "The average of a ray lies at no one point: choose Maximum or Minimum along the ray"
                .to_owned(),
        ),
        Ok(Seen::Beside) if answer.look.along() != AlongRay::Composite => {
            nothing("Nothing: the ray meets no value".to_owned())
        }
        Ok(Seen::Beside) => nothing("Nothing: beside the volume".to_owned()),
        Ok(Seen::TooLittle { gathered }) => nothing(format!(
            "Nothing: {} opacity along the ray, under {}",
            percent(*gathered),
            percent(answer.look.share)
        )),
        Ok(Seen::Point(point)) => {
            let volume = answer.look.scene.volume();
            let kind = volume.map(|volume| Kind::of(&volume.statistics));
            let unit = kind.and_then(Kind::unit).map(|unit| format!(" {unit}")).unwrap_or_default();
            let is_name = kind == Some(Kind::Labels);
            let length = volume.and_then(|volume| volume.unit.as_deref());
            let over = answer.look.scene.opacity_unit_distance();
            let lengths = length.unwrap_or(if over == 1.0 { "unit" } else { "units" });
            let Point { met, world, index, cell, value, gradient, opacity, vectors } = *point;
            let gathered = percent(answer.look.share);
            let mut rows = vec![("World", named(world, axis_letters(space)))];
            if answer.look.scene.shows_field() {
                rows.extend([
                    match cell {
                        Some(cell) => ("Cell", cell.to_string()),
                        None => ("Index", named(index, ["i", "j", "k"])),
                    },
                    (
                        if is_name { "Label" } else { "Value" },
                        format!("{}{unit}", words::value(value)),
                    ),
                ]);
                if !is_name {
                    let slope = words::value(gradient.length());
                    rows.extend([
                        ("Gradient", format!("{slope}{unit} per {}", length.unwrap_or("unit"))),
                        ("", named(gradient, axis_letters(space))),
                    ]);
                }
                let over = format!("{} over {} {lengths}", percent(opacity), words::value(over));
                rows.push(("Opacity", over));
            }
            if !answer.look.scene.shows_field() && value.is_finite() {
                rows.push(("Value", words::value(value)));
            }
            rows.push(("", met_words(met, &gathered)));
            for ProbedVector { place, vector, length, .. } in vectors.into_iter().flatten() {
                let length = words::value(length);
                let place = match place {
                    VectorPlace::Index([i, j, k]) => format!("nearest at i {i}   j {j}   k {k}"),
                    VectorPlace::Cell(cell) => format!("in cell {cell}"),
                };
                rows.push(("Vector", format!("{length} long, {place}")));
                rows.push(("", named(vector, axis_letters(space))));
            }
            rows
        }
    }
}

/// In or on what a point is, and why it is this one.
fn met_words(met: Met, gathered: &str) -> String {
    let where_gathered = |on: &str| format!("{on} opacity along the ray reaches {gathered}");
    match met {
        Met::Matter => where_gathered("Where"),
        Met::Vectors => where_gathered("Among vectors, where"),
        Met::Maximum => "The greatest value along the ray".to_owned(),
        Met::Minimum => "The least value along the ray".to_owned(),
        surface => where_gathered(&format!("On {}, where", surface.name())),
    }
}

/// Three numbers with the names of their axes.
fn named(vector: DVec3, names: [&str; 3]) -> String {
    let number = |axis: usize| format!("{} {}", names[axis], words::value(vector[axis]));
    [0, 1, 2].map(number).join("   ")
}

/// Where words may stand.
struct Room {
    rect: Rect,
    /// What they cover last of all.
    pointer: Option<Pos2>,
    /// What they leave free if they can.
    taken: Vec<Rect>,
}

impl Room {
    /// Where words of a size stand: in the upper left corner, but for what they would cover there.
    fn place(&self, size: Vec2) -> Rect {
        let inner = self.rect.shrink(INSET);
        let free = (inner.size() - size).max(Vec2::ZERO);
        let places = [(0.0, 0.0), (1.0, 0.0), (0.0, 0.5), (1.0, 0.5)];
        let places = places.map(|(x, y)| Rect::from_min_size(inner.min + free * vec2(x, y), size));
        let covers = |place: &Rect| {
            let pointer = self.pointer.is_some_and(|at| place.expand(2.0 * ARM).contains(at));
            (pointer, self.taken.iter().filter(|taken| place.intersects(**taken)).count())
        };
        places.into_iter().min_by_key(covers).unwrap_or(inner)
    }
}

/// Rows of words beside what is pointed at.
fn says(ui: &Ui, room: &Room, rows: &[(&str, String)]) {
    let viewport = room.rect;
    let painter = ui.painter_at(viewport);
    let font = FontId::proportional(FONT);
    let lay = |text: &str, colour: Color32| {
        painter.layout(text.to_owned(), font.clone(), colour, viewport.width() * 0.6)
    };
    let galleys: Vec<_> = rows
        .iter()
        .map(|(name, text)| (lay(name, theme::TEXT_FAINT), lay(text, theme::TEXT)))
        .collect();
    let width = galleys.iter().map(|(_, text)| text.size().x).fold(0.0, f32::max) + NAMES;
    let heights = galleys.iter().map(|(_, text)| text.size().y.max(LINE)).sum::<f32>();
    let ground = room.place(vec2(width, heights) + vec2(2.0, 1.0) * PADDING);
    painter.rect_filled(ground, CornerRadius::same(5), theme::PANEL.gamma_multiply(0.9));
    let mut at = ground.min + vec2(PADDING, PADDING / 2.0);
    for (name, text) in galleys {
        let height = text.size().y.max(LINE);
        painter.galley(at, name, theme::TEXT_FAINT);
        painter.galley(pos2(at.x + NAMES, at.y), text, theme::TEXT);
        at.y += height;
    }
    let response = ui.interact(ground, ui.scope_id().with("probe"), Sense::empty());
    let words: Vec<_> = rows.iter().map(|(name, text)| format!("{name} {text}")).collect();
    let words = words.join(", ");
    response.widget_info(move || WidgetInfo::labeled(Role::Label, true, format!("Probe: {words}")));
}

/// A mark around the pixel, which itself stays free.
fn mark(ui: &Ui, at: Pos2) {
    for (width, colour) in [(3.0, Color32::from_black_alpha(160)), (1.0, Color32::WHITE)] {
        for direction in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            let ends = [at + direction * GAP, at + direction * ARM];
            ui.painter().line_segment(ends, Stroke::new(width, colour));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pixel_under_the_pointer_is_found_at_any_scale() {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(100.0, 50.0));
        let area = PixelArea { rect, size: [200, 100] };
        assert_eq!(pixel_under(pos2(10.0, 20.0), area), [0, 0]);
        assert_eq!(pixel_under(pos2(60.4, 45.0), area), [100, 50]);
        assert_eq!(pixel_under(pos2(110.0, 70.0), area), [199, 99], "the last one");
    }

    #[test]
    fn words_stand_beside_what_is_pointed_at_and_what_annotations_have_taken() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let size = vec2(200.0, 100.0);
        let place =
            |pointer, taken: &[Rect]| Room { rect, pointer, taken: taken.to_vec() }.place(size).min;
        let (left, right) = (pos2(INSET, INSET), pos2(800.0 - 200.0 - INSET, INSET));
        let far = Some(pos2(400.0, 300.0));
        assert_eq!(place(far, &[]), left);
        assert_eq!(place(Some(pos2(50.0, 50.0)), &[]), right);
        let at = |x: f32, y: f32| Rect::from_min_size(pos2(x, y), vec2(30.0, 10.0));
        assert_eq!(place(far, &[at(100.0, 60.0)]), right);
        let both = [at(100.0, 60.0), at(700.0, 60.0)];
        assert_eq!(place(far, &both), pos2(INSET, 250.0));
        // Where something has to be covered it is not the place itself.
        let all = [both[0], both[1], at(100.0, 300.0), at(700.0, 300.0)];
        assert_eq!(place(Some(pos2(50.0, 50.0)), &all), right);
    }

    #[test]
    fn vectors_have_the_letters_of_the_space() {
        let vector = DVec3::new(1.5, -2.0, 0.0);
        assert_eq!(named(vector, axis_letters(Some("LPS"))), "L 1.5   P -2   S 0");
        assert_eq!(named(vector, axis_letters(None)), "x 1.5   y -2   z 0");
    }
}
