//! The window's part in comparing and measuring modes: what is shown beside the picture, and when
//! the engine and the accuracy job are asked for it.

use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{
    Align, Align2, Color32, Context, CornerRadius, CursorIcon, FontId, Painter, Pos2, Rect, Sense,
    Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::compare::Display;
use super::measuring::{Now, is_of};
use super::panels::accuracy::{Shown, accuracy_ui};
use super::panels::chart::Marks;
use super::panels::compare::verdict_words;
use super::viewport::{Beside, PixelArea, divider_x};
use super::window::Window;
use super::{modes, theme};
use crate::accuracy::psnr_from_rmse;
use crate::core::colour::srgb_encoder;
use crate::kernel::Kernel;
use crate::scene::{Effect, Scene, SplatSettings, Visibility};
use crate::task::engine::{EngineState, Picture, SecondPicture};
use crate::task::remaining::WITHIN_DB;

/// Half the width of what takes hold of the divider, points.
const DIVIDER_REACH: f32 = 6.0;
/// Distance of captions from the edges of the room they have, points.
const CAPTION_INSET: f32 = 12.0;
/// Captions are broken into no shorter lines than this, points.
const LEAST_CAPTION: f32 = 60.0;

impl Window {
    /// The chart and what belongs to it, along the lower edge.
    pub(super) fn accuracy_panel_ui(&mut self, ui: &mut Ui) {
        let Some(scene) = &self.scene else {
            ui.label("Open a volume first: there is nothing to measure yet");
            return;
        };
        let (points, is_old) = self.measuring.points();
        let state = self.measuring.state();
        let second = modes::with_unit_distance_of(self.compare.second, &scene.splat);
        let first_look = self.document.as_ref().map(|document| document.first_look.splat);
        let default = match scene.splat.kernel {
            Kernel::Functions => SplatSettings::FUNCTIONS,
            _ => first_look.unwrap_or_default(),
        };
        // Once the mode on screen has a point of its own, that tells its level: a line at another level would contradict it.
        let is_plain =
            self.finished_picture().is_some_and(|picture| picture.report.refined.is_none());
        let is_measured =
            is_plain && !is_old && points.iter().any(|point| is_of(point, &scene.splat));
        let marks = Marks {
            default,
            first: &scene.splat,
            second: self.compare.on.then_some(&second),
            is_old: is_old && !points.is_empty(),
            picture_db: self.remaining_db(&scene.splat).filter(|_| !is_measured),
        };
        let shown = Shown {
            points: &points,
            marks,
            state: &state,
            fraction: self.measuring.fraction(),
            size: self.viewport_size,
            record: &self.estimates,
            refines: self.settings.converge,
        };
        let done = accuracy_ui(ui, &mut self.accuracy, &shown);
        if let Some(mode) = done.first {
            self.set_mode(mode);
        }
        if let Some(mode) = done.second {
            self.compare.with(mode);
        }
        if done.again {
            self.measuring.start_over();
        }
    }

    /// How near the picture on screen is to the exact one, dB, where that was found: what has slabs of another mode is held to
    /// another picture.
    fn remaining_db(&self, mode: &SplatSettings) -> Option<f64> {
        let is_to_exact = mode.visibility != Visibility::Slabs || modes::is_exact(mode);
        let picture = self.finished_picture().filter(|_| is_to_exact)?;
        let report = &picture.report;
        let is_measured = report.remaining_within_db <= WITHIN_DB;
        report.remaining_rmse.filter(|_| is_measured).map(psnr_from_rmse)
    }

    /// Draws with a mode from now on.
    fn set_mode(&mut self, mode: SplatSettings) {
        if let Some(scene) = &mut self.scene {
            scene.splat = modes::with_unit_distance_of(mode, &scene.splat);
        }
    }

    /// The picture on screen, once nothing more will be drawn of it and nothing moves.
    fn finished_picture(&self) -> Option<Arc<Picture>> {
        let picture = self.viewport.picture()?;
        let is_finished = picture.report.progress >= 1.0
            && picture.requested_size == self.viewport_size
            && !self.pacing.is_moving();
        is_finished.then_some(picture)
    }

    /// Whether the finished picture is the background and nothing else, or specks.
    pub(super) fn shows_nothing(&self) -> bool {
        let Some(scene) = self.scene.as_ref().filter(|_| !self.is_loading()) else { return false };
        let background = srgb_encoder(scene.background.light())(&[0.0; 4]);
        self.finished_picture().is_some() && self.viewport.only_colour() == Some(background)
    }

    /// The second picture, if it belongs to the first, and how both are shown.
    pub(super) fn beside(&self) -> Option<(Arc<SecondPicture>, Beside)> {
        let first = self.finished_picture()?;
        let second = self.compare.beside(&first)?;
        let how = match self.compare.display {
            Display::Split => Beside::Split(self.compare.divider),
            Display::Difference => Beside::Difference(self.compare.gain()),
        };
        Some((Arc::clone(second), how))
    }

    /// The divider and the captions over the picture.
    pub(super) fn comparison_ui(
        &mut self,
        ui: &mut Ui,
        area: PixelArea,
        beside: Option<&(Arc<SecondPicture>, Beside)>,
    ) {
        let Some(scene) = &self.scene else { return };
        if !self.compare.on {
            return;
        }
        let names = [scene.splat, self.compare.second].map(|mode| modes::name(&mode));
        let rect = area.rect;
        let bottom = rect.bottom() - 12.0;
        let painter = ui.painter_at(rect);
        match beside {
            None if self.pacing.is_moving() => {}
            None => {
                let at = pos2(rect.center().x, bottom);
                let failed = matches!(self.parts.drawer.state(), EngineState::Failed(_));
                let words = if failed { "No second picture" } else { "Drawing the second picture" };
                caption(&painter, at, Align2::CENTER_BOTTOM, words, theme::TEXT_FAINT);
            }
            Some((second, Beside::Difference(gain))) => {
                let verdict = verdict_words(second.rmse);
                let times = (10.0 * gain).round() / 10.0;
                let text = format!("Difference ×{times} · {verdict}");
                let at = pos2(rect.center().x, bottom);
                caption(&painter, at, Align2::CENTER_BOTTOM, &text, theme::TEXT);
            }
            Some((second, Beside::Split(share))) => {
                let share = divider_ui(ui, area, *share);
                self.compare.divider = share;
                let x = divider_x(area, share);
                let verdict = verdict_words(second.rmse);
                let lacks = lacking(scene, self.compare.second);
                let texts = [names[0].clone(), format!("{}{lacks} · {verdict}", names[1])];
                let aligns = [Align2::RIGHT_BOTTOM, Align2::LEFT_BOTTOM];
                let sides = [pos2(x - 10.0, bottom), pos2(x + 10.0, bottom)];
                let halves = [
                    Rect::from_min_max(rect.min, pos2(x, rect.bottom())),
                    Rect::from_min_max(pos2(x, rect.top()), rect.max),
                ];
                let colours = [theme::TEXT, theme::NOTE];
                for side in 0..2 {
                    let painter = painter.with_clip_rect(halves[side]);
                    caption(&painter, sides[side], aligns[side], &texts[side], colours[side]);
                }
            }
        }
    }

    /// Asks for the second picture and runs the accuracy job, as things stand after this pass.
    pub(super) fn pace_judging(&mut self, ctx: &Context) {
        let finished = self.finished_picture();
        let Some(scene) = &self.scene else { return };
        let drawer = &*self.parts.drawer;
        if let Some(second) = drawer.take_second() {
            if !self.effects.accept(drawer, &second) {
                self.compare.accept(second);
            }
            // The pass that is being made has been laid out without it.
            ctx.request_repaint();
        }
        // Both have the engine's one second picture: whoever has no use for it takes its hands off first.
        if self.compare.on {
            self.effects.pace(drawer, scene, None);
            self.compare.pace(drawer, scene, finished.as_ref());
        } else {
            self.compare.pace(drawer, scene, None);
            self.effects.pace(drawer, scene, finished.as_ref());
        }
        let idle = matches!(drawer.state(), EngineState::Idle);
        let waiting = self.compare.is_waiting(finished.as_ref());
        let now = Now {
            open: self.accuracy.open,
            // Marks that move make another picture each time.
            quiet: finished.is_some()
                && (scene.vectors().is_empty() || !self.vectors.clock.is_running())
                && idle
                && !waiting
                && !self.effects.is_measuring()
                && !ctx.input(|input| input.pointer.any_down()),
            scene,
            size: self.viewport_size,
            secs: ctx.time(),
        };
        self.measuring.pace(ctx, &now, &self.parts.measure);
    }

    /// Takes in how good the estimate before a finished picture was.
    pub(super) fn record_estimate(&mut self, picture: &Picture) {
        let report = &picture.report;
        // Refined pictures keep what the full one before them found.
        let is_refined =
            report.refined.is_some_and(|refined| refined.convergence.last_difference.is_some());
        // And so do those that come once more, with what they are off by.
        if is_refined || report.remaining_rmse.is_some() {
            return;
        }
        if let Some(off_db) = report.checked.and_then(|checked| checked.off_db()) {
            self.estimates.add(off_db);
        }
    }

    /// Takes a mode that means nothing back, so that it never reaches the engine.
    pub(super) fn keep_mode_valid(&mut self) {
        let Some(scene) = &mut self.scene else { return };
        match scene.splat.check() {
            Ok(()) => self.last_valid_mode = scene.splat,
            Err(error) => {
                log::error!("a mode that means nothing was chosen: {error}");
                scene.splat = modes::with_unit_distance_of(self.last_valid_mode, &scene.splat);
            }
        }
        if self.compare.second.check().is_err() {
            self.compare.second = SplatSettings::SHADE_FIRST;
        }
    }
}

/// What a scene shows and another mode of it does not: `, without isosurfaces and slices`.
fn lacking(scene: &Scene, mode: SplatSettings) -> String {
    let effects = |mode: &SplatSettings| {
        let of_mode = Scene { splat: *mode, ..scene.clone() };
        let inside = of_mode.inside_in_place();
        let shown = inside.shown_by(mode).effects();
        let is_shown =
            |effect: &Effect| shown.contains(effect) || !inside.effects().contains(effect);
        of_mode.effects().into_iter().filter(is_shown).collect::<Vec<_>>()
    };
    let shown = effects(&mode);
    let lacks = effects(&scene.splat).into_iter().filter(|effect| !shown.contains(effect));
    let names: Vec<String> = lacks.map(|effect| effect.name().to_lowercase()).collect();
    match names.split_last() {
        None => String::new(),
        Some((last, [])) => format!(", without {last}"),
        Some((last, others)) => format!(", without {} and {last}", others.join(", ")),
    }
}

/// The line between two pictures; where it is after the hand had its way.
fn divider_ui(ui: &Ui, area: PixelArea, share: f32) -> f32 {
    let rect = area.rect;
    let x = divider_x(area, share);
    let reach = Rect::from_min_max(
        pos2(x - DIVIDER_REACH, rect.top()),
        pos2(x + DIVIDER_REACH, rect.bottom()),
    );
    let response = ui.interact(reach, ui.scope_id().with("divider"), Sense::drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Line between two modes"));
    let active = response.hovered() || response.dragged();
    if active {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let colour = if active { theme::ACCENT } else { Color32::from_white_alpha(150) };
    let painter = ui.painter_at(rect);
    painter.vline(x, rect.y_range(), Stroke::new(1.0, colour));
    let grip = Rect::from_center_size(pos2(x, rect.center().y), vec2(5.0, 34.0));
    painter.rect_filled(grip, CornerRadius::same(2), colour);
    if response.dragged() && rect.width() > 0.0 {
        // By the pointer's way, so that the line stays where it was taken.
        return (share + response.drag_delta().x / rect.width()).clamp(0.02, 0.98);
    }
    share
}

/// Words on a dark ground, readable over any picture: on one line, or as many as the room asks for that
/// `painter` may paint in.
fn caption(painter: &Painter, at: Pos2, align: Align2, text: &str, colour: Color32) {
    // Left of it, right of it, or both, as far as the words may go from where they stand.
    let room = painter.clip_rect();
    let width = match align.x() {
        Align::Min => room.right() - at.x,
        Align::Max => at.x - room.left(),
        Align::Center => 2.0 * (at.x - room.left()).min(room.right() - at.x),
    };
    let width = (width - CAPTION_INSET).max(LEAST_CAPTION);
    let galley = painter.layout(text.to_owned(), FontId::proportional(12.0), colour, width);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(
        rect.expand2(vec2(6.0, 3.0)),
        CornerRadius::same(4),
        Color32::from_black_alpha(150),
    );
    painter.galley(rect.min, galley, colour);
}

#[cfg(test)]
mod tests {
    use eframe::egui::{RawInput, Shape};

    use super::*;
    use crate::core::Ticket;
    use crate::scene::{self, Classify, Isosurface, SampleSource, Slice};
    use crate::volume::{Component, demo};

    #[test]
    fn a_second_mode_says_what_it_does_not_show_of_the_scene() {
        let grid = demo::open("shells", Some(8)).expect("a demo");
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
        let volume = Arc::new(volume.expect("values"));
        let mut scene = scene::opening(SampleSource::default(), volume, None);
        assert_eq!(lacking(&scene, SplatSettings::SHADE_FIRST), "");
        scene.inside.slices = vec![Slice::across(&scene.lattice(), 2, 0.5, 1.0)];
        assert_eq!(lacking(&scene, SplatSettings::SHADE_FIRST), ", without slices");
        scene.inside.isosurfaces = vec![Isosurface { value: 9.0, opacity: 1.0, colour: None }];
        let both = ", without isosurfaces and slices";
        assert_eq!(lacking(&scene, SplatSettings::SHADE_FIRST), both);
        let after = SplatSettings { classify: Classify::After, ..SplatSettings::EXACT };
        assert_eq!(lacking(&scene, after), ", without isosurfaces");
        assert_eq!(lacking(&scene, SplatSettings::EXACT), "");
    }

    #[test]
    fn captions_are_whole_beside_a_line_in_the_middle_of_a_narrow_window() {
        let text =
            "B-spline, interpolating, pre-integrated, 1 slab a voxel · 23.8 dB between the two";
        let half = Rect::from_min_max(pos2(0.0, 0.0), pos2(182.0, 700.0));
        for (at, align, room) in [
            (pos2(172.0, 688.0), Align2::RIGHT_BOTTOM, half),
            (pos2(192.0, 688.0), Align2::LEFT_BOTTOM, half.translate(vec2(182.0, 0.0))),
            (pos2(91.0, 688.0), Align2::CENTER_BOTTOM, half),
            (pos2(640.0, 688.0), Align2::RIGHT_BOTTOM, half.with_max_x(650.0)),
        ] {
            let ctx = Context::default();
            let pass = || {
                let screen = Rect::from_min_size(Pos2::ZERO, vec2(700.0, 700.0));
                let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
                let mut output = ctx.run_ui(input, |ui| {
                    caption(&ui.painter().with_clip_rect(room), at, align, text, theme::TEXT);
                });
                // Nobody paints them.
                output.textures_delta.clear();
                output.shapes
            };
            drop(pass());
            let painted = pass();
            let lines = painted.iter().find_map(|shape| match &shape.shape {
                Shape::Text(text) => Some(text.galley.rows.len()),
                _ => None,
            });
            assert_eq!(lines.is_some_and(|lines| lines > 1), room.width() < 400.0, "{lines:?}");
            for shape in painted {
                let place = shape.shape.visual_bounding_rect();
                assert!(room.contains_rect(place), "{align:?}: {place} in {room}");
            }
        }
    }
}
