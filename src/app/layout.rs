//! Where things stand in the window: menus, side panel, viewport, status line.

use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::style::ScrollStyle;
use eframe::egui::{
    Align, Align2, Atom, Button, CentralPanel, Color32, Context, CornerRadius, FontId, Frame, Id,
    IdSalt, Key, Label, Layout, Margin, MenuBar, Painter, Panel, ProgressBar, Rect, RichText,
    ScrollArea, Sense, Shape, Stroke, StrokeKind, Ui, UiBuilder, Vec2, WidgetInfo, pos2, vec2,
};

use super::actions::{ACTIONS, Action, Entry, Menu, entry_of};
use super::camera_control;
use super::commands::told_of;
use super::document::Source;
use super::notices::text_and_button_ui;
use super::panels::data::DataChoice;
use super::panels::vectors::VectorRequest;
use super::panels::{
    CLIP, DATA, FUNCTIONS, INSIDE, ON_TOP, POLYGONS, SHADING, SPLATS, Sections, TRANSFER, VECTORS,
    VIEW, accuracy, clip, compare, data, encoding, in_section_ui, inside, polygons, section_ui,
    shading, splat, status, titled_section_ui, transfer, vectors, view,
};
use super::trihedron::trihedron_ui;
use super::viewport::PixelArea;
use super::window::{JobView, Window};
use super::{annotations, modes, theme, words};
use crate::scene::{AlongRay, Inside, axis_letters, offers};
use crate::task::annotations::laid_out;
use crate::volume::Statistics;

/// Narrowest side panel, and what is left beside it of the window at least, points: in narrower windows it
/// waits.
const SIDE_LEAST: f32 = 336.0;
const BESIDE_LEAST: f32 = 200.0;
/// Why the side panel is not there.
pub(super) const NO_SIDE_ROOM: &str = "The window is too narrow for the side panel: make it wider";
/// Height that the accuracy panel leaves over itself at least, points.
const ABOVE_LEAST: f32 = 60.0;
/// Room that the buttons beside the menus ask for, points.
const SIDE_BUTTON: f32 = 150.0;
/// Width of the side panel before anyone resizes it, points.
const SIDE_WIDTH: f32 = 336.0;
/// Side of the square that menus have for a tick, points.
const TICK: f32 = 11.0;
/// Distance of the bars over the viewport from its edges, points.
const OVERLAY_INSET: f32 = 12.0;
/// Size of what stands where nothing is open, points.
const WELCOME: Vec2 = vec2(320.0, 140.0);
/// Twice the seconds after which it is said that there is no picture yet.
const WAIT_SECS: f32 = 0.6;
/// Greatest width of the bars over the viewport, points.
const OVERLAY_WIDTH: f32 = 640.0;

impl Window {
    /// One pass of everything but the dialogs.
    pub(super) fn layout_ui(&mut self, ui: &mut Ui) {
        // No panel is filled: the window is cleared to their colour, and on a software adapter each
        // filled layer of that size takes as long as a coarse picture.
        let bar = Frame::new().inner_margin(Margin::symmetric(8, 3));
        Panel::top("menus").frame(bar).show(ui, |ui| self.menus_ui(ui));
        let line = bar.inner_margin(Margin::symmetric(12, 4));
        Panel::bottom("status").frame(line).exact_size(28.0).show(ui, |ui| self.status_ui(ui));
        if self.settings.side_panel && has_side_room(ui.ctx()) {
            Panel::right("side")
                .frame(Frame::NONE)
                .resizable(true)
                .default_size(SIDE_WIDTH)
                .size_range(SIDE_LEAST..=560.0)
                .show(ui, |ui| self.side_ui(ui));
        }
        if self.accuracy.open && ui.available_height() >= accuracy::LEAST_HEIGHT + ABOVE_LEAST {
            let frame =
                Frame::new().inner_margin(Margin { left: 12, right: 12, top: 8, bottom: 6 });
            Panel::bottom("accuracy")
                .frame(frame)
                .resizable(true)
                .default_size(accuracy::HEIGHT)
                .size_range(accuracy::LEAST_HEIGHT..=420.0)
                .show(ui, |ui| self.accuracy_panel_ui(ui));
        }
        CentralPanel::no_frame().show(ui, |ui| self.viewport_ui(ui));
        self.effects_panel_ui(ui.ctx());
    }

    fn menus_ui(&mut self, ui: &mut Ui) {
        let mut chosen = None;
        let mut source = None;
        MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| {
                let opens =
                    |action| matches!(action, Action::Open | Action::OpenFolder | Action::OpenPath);
                self.menu_entries_ui(ui, Menu::File, opens, &mut chosen);
                source = self.open_menus_ui(ui);
                self.menu_entries_ui(ui, Menu::File, |action| !opens(action), &mut chosen);
            });
            let steps = self.step_words();
            ui.menu_button("Edit", |ui| edit_menu_ui(ui, &steps, &mut chosen));
            ui.menu_button("Add", |ui| self.menu_entries_ui(ui, Menu::Add, |_| true, &mut chosen));
            ui.menu_button("View", |ui| {
                let is_faded = self.scene.as_ref().is_some_and(|scene| scene.inside.is_faded);
                let is_there = |action| match action {
                    Action::ShowVectors => self.has_hidden_vectors(),
                    Action::ShowFaded => is_faded,
                    _ => true,
                };
                self.menu_entries_ui(ui, Menu::View, is_there, &mut chosen);
            });
            ui.menu_button("Camera", |ui| self.camera_menu_ui(ui, &mut chosen));
            ui.menu_button("Help", |ui| {
                self.menu_entries_ui(ui, Menu::Help, |_| true, &mut chosen);
            });
            if ui.available_width() < SIDE_BUTTON {
                return;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let find = entry_of(Action::Find);
                if ui.button(find.name).on_hover_text(hint(ui.ctx(), find)).clicked() {
                    chosen = Some(Action::Find);
                }
                let side = entry_of(Action::ToggleSidePanel);
                let has_room = has_side_room(ui.ctx());
                let button = Button::selectable(self.settings.side_panel && has_room, side.name);
                let button = ui.add_enabled(has_room, button).on_disabled_hover_text(NO_SIDE_ROOM);
                if button.on_hover_text(hint(ui.ctx(), side)).clicked() {
                    chosen = Some(Action::ToggleSidePanel);
                }
            });
        });
        if let Some(action) = chosen {
            self.perform(ui.ctx(), action);
        }
        if let Some(source) = source {
            self.open(ui.ctx(), source);
        }
    }

    /// Recent files and demos; what was chosen.
    fn open_menus_ui(&self, ui: &mut Ui) -> Option<Source> {
        let mut chosen = None;
        ui.add_enabled_ui(!self.settings.recent.is_empty(), |ui| {
            ui.menu_button("Open recent", |ui| {
                for path in &self.settings.recent {
                    let source = Source::File(path.clone());
                    let entry = ui.button(source.name());
                    if entry.on_hover_text(path.display().to_string()).clicked() {
                        chosen = Some(source);
                    }
                }
            });
        });
        let demos = self.parts.library.demos();
        ui.add_enabled_ui(!demos.is_empty(), |ui| {
            ui.menu_button("Open demo", |ui| {
                for (name, help) in demos {
                    if ui.button(name).on_hover_text(help).clicked() {
                        chosen = Some(Source::Demo(name.to_owned()));
                    }
                }
            });
        });
        ui.separator();
        chosen
    }

    /// Where the picture is looked at from, and which axis is up.
    fn camera_menu_ui(&mut self, ui: &mut Ui, chosen: &mut Option<Action>) {
        self.menu_entries_ui(ui, Menu::Camera, |_| true, chosen);
        let told = self.document.as_ref().map(view::Told::of).unwrap_or_default();
        if let Some(scene) = &mut self.scene {
            ui.separator();
            view::up_menu_ui(ui, indented("Up axis"), scene, told);
        }
    }

    /// The commands of one menu that `stands` there, ticked where they are on; `chosen` is the one that was
    /// clicked.
    fn menu_entries_ui(
        &self,
        ui: &mut Ui,
        menu: Menu,
        stands: impl Fn(Action) -> bool,
        chosen: &mut Option<Action>,
    ) {
        let tick = IdSalt::new("tick");
        for entry in ACTIONS.iter().filter(|entry| entry.menu == menu && stands(entry.action)) {
            let name = shown_name(entry);
            if entry.action.begins_group() {
                ui.separator();
            }
            let is_on = self.is_on(entry.action);
            let reason = self.why_not(entry.action);
            // Menus with ticks have room for one before each name.
            let mut button = match menu {
                Menu::Add | Menu::View | Menu::Camera => {
                    Button::new((Atom::custom(tick, vec2(TICK, TICK)), name))
                }
                _ => Button::new(entry.name),
            };
            if let Some(shortcut) = &entry.shortcut {
                button = button.shortcut_text(ui.ctx().format_shortcut(shortcut));
            }
            let shown = ui.add_enabled_ui(reason.is_none(), |ui| button.atom_ui(ui)).inner;
            if let Some(rect) = shown.rect(tick).filter(|_| is_on == Some(true)) {
                paint_tick(ui.painter(), rect);
            }
            let mut response = shown.response;
            if let Some(is_on) = is_on {
                let is_enabled = reason.is_none();
                response.widget_info(|| {
                    WidgetInfo::selected(Role::Button, is_enabled, is_on, entry.name)
                });
            }
            response = response.on_hover_text(entry.help);
            if let Some(reason) = reason {
                response = response.on_disabled_hover_text(reason);
            }
            if response.clicked() {
                *chosen = Some(entry.action);
            }
        }
    }

    fn status_ui(&mut self, ui: &mut Ui) {
        let drawer = &self.parts.drawer;
        let shown = self.viewport.picture().zip(self.scene.as_ref()).map(|(picture, scene)| {
            let mut report = picture.report.clone();
            if let Some(refined) = report.refined.as_mut().filter(|_| self.pacing.is_judging()) {
                // Modes that are judged go no further.
                refined.left_ms = 0.0;
            }
            let mode = self.shown_mode(scene);
            let measured = self.measuring.point_of(scene, &mode);
            status::Shown {
                report,
                mode,
                has_splats: scene.shows_field() || !scene.vectors().is_empty(),
                measured,
            }
        });
        let (state, adapter) = (drawer.state(), drawer.adapter_name());
        let engine = drawer.engine_choice();
        let now = status::Now {
            shown: shown.as_ref(),
            state: &state,
            is_moving: self.pacing.is_moving(),
            rate: self.rate.per_second(ui.ctx().time()),
            adapter: adapter.as_deref(),
            engine,
        };
        let chosen = status::status_ui(ui, &now);
        if let Some(chosen) = chosen.filter(|chosen| *chosen != engine) {
            drawer.choose_engine(chosen);
        }
    }

    fn side_ui(&mut self, ui: &mut Ui) {
        // A child of its own, so that a row that is too wide is cut off and never widens the panel:
        // the viewport would change its size under the hand.
        let rect = ui.max_rect();
        let mut inside = ui.new_child(UiBuilder::new().max_rect(rect));
        inside.shrink_clip_rect(rect);
        // Always there, so that it is seen that more lies below.
        inside.spacing_mut().scroll = ScrollStyle::thin();
        ScrollArea::vertical().auto_shrink(false).show(&mut inside, |ui| {
            let mut sections = std::mem::take(&mut self.settings.sections);
            Frame::new()
                .inner_margin(theme::PANEL_MARGIN)
                .show(ui, |ui| self.sections_ui(ui, &mut sections));
            self.settings.sections = sections;
        });
        ui.advance_cursor_after_rect(rect);
    }

    fn sections_ui(&mut self, ui: &mut Ui, sections: &mut Sections) {
        let (Some(document), Some(scene)) = (&self.document, &mut self.scene) else {
            ui.add_space(8.0);
            ui.label(RichText::new("Nothing is open").color(theme::TEXT_FAINT));
            return;
        };
        let space = document.grid.space.as_deref();
        in_section_ui(ui, ON_TOP, |ui| {
            inside::rendering_ui(ui, scene, &document.first_look.transfer.colour);
        });
        ui.add_space(4.0);
        let choice = section_ui(ui, sections, DATA, |ui| {
            let choice = data::data_ui(ui, document);
            data::drawn_as_ui(ui, &document.volume, &mut scene.splat);
            let showed = scene.shows_field();
            if document.surface.is_some() {
                data::points_ui(ui, scene);
            }
            (choice, scene.shows_field() != showed)
        });
        let (choice, is_larger) = choice.unwrap_or_default();
        let vector_request = document.has_vectors().then(|| {
            section_ui(ui, sections, VECTORS, |ui| {
                let (clock, fps) = (&mut self.vectors.clock, &mut self.settings.animation_fps);
                let now = ui.ctx().time();
                // Other sections have colours, too.
                ui.push_id("vectors", |ui| {
                    let probed = self.probing.last_point(scene);
                    let choices = (&mut self.flow.choice, &mut self.vectors.triples, probed);
                    vectors::vectors_ui(ui, document, scene, (clock, now), fps, choices)
                })
                .inner
            })
        });
        let action = section_ui(ui, sections, TRANSFER, |ui| {
            if document.surface.is_some() && !scene.shows_field() {
                let text = "The transfer function is for its points as a volume, which Data can draw; the colours of what is seen are under Polygons and labels";
                inside::note_ui(ui, text);
                return None;
            }
            let default = document.first_look.transfer.clone();
            let (editor, bells) = (&mut self.transfer, &mut self.gaussians);
            let names = document.label_names();
            transfer::transfer_ui(ui, editor, scene, bells, (|_: &Statistics| default, &names))
        });
        section_ui(ui, sections, SHADING, |ui| {
            let second = self.compare.on.then_some(&self.compare.second);
            shading::shading_ui(ui, &mut self.shading, scene, second);
        });
        let inside_before = told_of(&scene.inside);
        section_ui(ui, sections, INSIDE, |ui| {
            inside::inside_ui(ui, scene, space);
        });
        let embeds = section_ui(ui, sections, POLYGONS, |ui| polygons::polygons_ui(ui, scene));
        section_ui(ui, sections, CLIP, |ui| {
            let second = self.compare.on.then_some(&self.compare.second);
            clip::clip_ui(ui, &mut self.clip, scene, second, space);
        });
        let compare = &mut self.compare;
        let name = (SPLATS, modes::section(&scene.splat));
        titled_section_ui(ui, sections, name, |ui| {
            compare::compare_ui(ui, compare, &mut scene.splat, &scene.inside);
            let volume = scene.volume().map(Arc::clone);
            let is_offered = move |kernel| volume.as_ref().is_some_and(|v| offers(v, kernel));
            let slabs = document.first_look.splat.slabs_per_voxel;
            let of_field = (scene.own_unit_distance(), slabs, is_offered);
            if compare.on && compare.edits_second {
                // The unit distance is one for both.
                let mut second = modes::with_unit_distance_of(compare.second, &scene.splat);
                splat::splat_ui(ui, &mut second, of_field);
                scene.splat.opacity_unit_distance = second.opacity_unit_distance;
                compare.second = second;
            } else {
                splat::splat_ui(ui, &mut scene.splat, of_field);
            }
        });
        let encoding_request = section_ui(ui, sections, FUNCTIONS, |ui| {
            let running = self.encoding.as_ref();
            let has_clip_box = scene.inside.clip.bounds.is_some();
            let choice = (&mut self.encode_choice, has_clip_box);
            let second =
                (self.compare.on && self.compare.edits_second).then_some(&mut self.compare.second);
            splat::limits_ui(ui, second.unwrap_or(&mut scene.splat));
            encoding::encoding_ui(ui, document, choice, running)
        });
        section_ui(ui, sections, VIEW, |ui| {
            let (settings, cells) = (&mut self.settings, &mut self.cells);
            let told = view::Told::of(document);
            view::view_ui(ui, (scene, told), settings, cells, &self.left_out);
        });
        if is_larger && let Some(view) = self.unmoved_view() {
            // What is seen now may reach farther.
            self.fit(view);
        }
        self.tell_of_inside(inside_before);
        match vector_request.flatten().flatten() {
            Some(VectorRequest::Field(source)) => self.choose_vectors(ui.ctx(), false, source),
            Some(VectorRequest::Second(source)) => self.choose_vectors(ui.ctx(), true, source),
            Some(VectorRequest::SaveLoop) => self.ask_to_save_loop(),
            Some(VectorRequest::Flow(shape)) => self.start_flow(ui.ctx(), shape),
            None => {}
        }
        match choice {
            Some(DataChoice::Field(choice)) => self.choose_field(ui.ctx(), choice),
            Some(DataChoice::Series(index)) => self.choose_series(ui.ctx(), index),
            None => {}
        }
        if let Some(request) = encoding_request.flatten() {
            self.encode(ui.ctx(), request);
        }
        if let Some(action) = action.flatten() {
            self.perform(ui.ctx(), action);
        }
        if let Some(action) = embeds.flatten() {
            self.perform(ui.ctx(), action);
        }
    }

    fn viewport_ui(&mut self, ui: &mut Ui) {
        let area = PixelArea::covering(ui.max_rect(), ui.pixels_per_point());
        self.resize(area.size);
        self.viewport_pixels = area.pixels(ui.pixels_per_point());
        let response = ui.allocate_rect(area.rect, Sense::drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, "Viewport"));
        if response.drag_started() {
            self.notices.give_way();
            if self.scene.is_some() {
                self.first_hint.taken(&mut self.settings.knows_drag, ui.ctx().time());
            }
            // Keys are for the view again.
            ui.ctx().memory_mut(|memory| {
                memory.focused().inspect(|id| memory.surrender_focus(*id));
            });
        }
        let orientation = self.orientation();
        let beside = self.beside();
        let second = beside.as_ref().map(|(second, how)| (second, *how));
        let now_secs = ui.ctx().time();
        self.viewport.paint(ui.painter(), area, second, now_secs);
        if self.viewport.fade(now_secs).is_some() {
            ui.ctx().request_repaint();
        }
        let mut turned = None;
        if let Some(scene) = &mut self.scene {
            let (volume, bells) = (scene.volume().map(Arc::clone), &mut self.gaussians);
            let projects = scene.inside.along != AlongRay::Composite;
            let mut range = scene.inside.projected_range.filter(|_| projects);
            let levels = match volume.zip(scene.transfer_mut()) {
                Some((volume, _)) if let Some(range) = &mut range => {
                    self.leveling.drag_range(&response, range, &volume.statistics)
                }
                Some((volume, transfer)) => {
                    self.leveling.drag(&response, transfer, bells, &volume.statistics)
                }
                None => false,
            };
            if !levels {
                let turning = (self.settings.turning, orientation.up.vector());
                scene.camera =
                    camera_control::steered(&scene.camera, &response, &scene.lattice(), turning);
            }
            if projects && range.is_some() {
                scene.inside.projected_range = range;
            }
            if let Some(transfer) = scene.drawn_transfer() {
                self.leveling.caption_ui(ui, area.rect, &transfer);
            }
            let space = self.document.as_ref().and_then(|d| d.grid.space.as_deref());
            let layout = laid_out(self.settings.annotations, scene, space, area.size);
            annotations::paint(ui.painter(), area, &layout.primitives);
            self.left_out = layout.left_out;
            let (letters, seen) = (axis_letters(space), (&scene.camera, orientation));
            turned = trihedron_ui(ui, area, &layout.axis_ends, letters, seen);
            self.cells.show(ui, area, scene, &response);
            if Inside::is_shown_by(&scene.splat) {
                let shows_clip = self.clip.is_on_picture;
                if shows_clip {
                    self.box_handles.show(ui, area, scene);
                }
                let shows_slices = !projects && scene.shows_field();
                self.plane_handles.show(ui, area, scene, [shows_slices, shows_clip]);
            }
            let rests = !self.pacing.is_moving();
            let beside = (self.cells.height(), &layout.taken[..]);
            self.probing.show(ui, area, scene, space, (&response, rests), beside);
        } else if !self.is_loading() {
            match welcome_ui(ui, area.rect) {
                Some(Welcome::Open) => self.perform(ui.ctx(), Action::Open),
                Some(Welcome::Demo) => {
                    let first = self.parts.library.demos().first().map(|(name, _)| *name);
                    first
                        .into_iter()
                        .for_each(|name| self.open(ui.ctx(), Source::Demo(name.into())));
                }
                None => {}
            }
        }
        if let Some(view) = turned {
            self.fit(view);
        }
        if self.shows_nothing() {
            nothing_ui(ui, area.rect);
        }
        let is_open = self.scene.is_some() && !self.is_loading();
        waiting_ui(ui, area.rect, is_open && self.viewport.picture().is_none());
        // The probe has notices where the hint would lie.
        if self.scene.is_some() && !self.is_loading() && !self.probing.is_on() {
            self.first_hint.show(ui, area.rect, self.settings.knows_drag);
        }
        self.comparison_ui(ui, area, beside.as_ref());
        self.overlays_ui(ui, area.rect);
        if ui.input(|input| !input.raw.hovered_files.is_empty()) {
            drop_hint_ui(ui, area.rect);
        }
    }

    /// Notices at the top of the viewport, jobs under them; in its middle while the first file is read, and at its bottom while the probe
    /// tells at the top what is under the hand, which may be on the way to one of them.
    fn overlays_ui(&mut self, ui: &mut Ui, viewport: Rect) {
        let width = (viewport.width() - 2.0 * OVERLAY_INSET).clamp(0.0, OVERLAY_WIDTH);
        if width < 40.0 {
            return;
        }
        let room = viewport.height() - 2.0 * OVERLAY_INSET;
        let free = (room - self.overlays_height).max(0.0);
        let lower = match () {
            () if self.scene.is_none() && self.is_loading() => free / 2.0,
            () if self.probing.is_on() => free,
            () => 0.0,
        };
        let top = viewport.top() + OVERLAY_INSET + lower;
        let top = pos2(viewport.center().x - width / 2.0, top);
        let rect = Rect::from_min_size(top, vec2(width, room));
        if self.scene.as_ref().is_none_or(|scene| !scene.inside.is_faded) {
            self.notices.withdraw(Action::ShowFaded);
        }
        let shown = ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            self.notices.bars_ui(ui);
            for job in self.jobs() {
                job_ui(ui, &job);
            }
            ui.min_rect().height()
        });
        if let Some(action) = self.notices.take_offer() {
            self.perform(ui.ctx(), action);
        }
        if (shown.inner - self.overlays_height).abs() > 0.5 {
            self.overlays_height = shown.inner;
            // They were laid out for another height.
            ui.ctx().request_repaint();
        }
    }
}

/// Whether the window is wide enough for the side panel.
pub(super) fn has_side_room(ctx: &Context) -> bool {
    ctx.content_rect().width() >= SIDE_LEAST + BESIDE_LEAST
}

/// Undo and redo, each with what it would do; `chosen` is the one that was clicked.
/// The name of a command in its menu: *Add* says what those in it do.
fn shown_name(entry: &Entry) -> String {
    let rest = entry.name.strip_prefix("Add ").filter(|_| entry.menu == Menu::Add);
    let Some(rest) = rest else { return entry.name.to_owned() };
    let mut letters = rest.chars();
    letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect()
}

fn edit_menu_ui(ui: &mut Ui, steps: &[Option<(String, String)>; 2], chosen: &mut Option<Action>) {
    for (action, words) in [Action::Undo, Action::Redo].into_iter().zip(steps) {
        let entry = entry_of(action);
        let name = match words {
            Some((change, _)) => format!("{}: {change}", entry.name),
            None => entry.name.to_owned(),
        };
        let mut button = Button::new(name);
        if let Some(shortcut) = &entry.shortcut {
            button = button.shortcut_text(ui.ctx().format_shortcut(shortcut));
        }
        let shown = ui.add_enabled(words.is_some(), button);
        let shown = shown.on_disabled_hover_text("There is nothing to go back or forward to");
        let shown = shown.accessible_name(entry.name);
        let sentence = words.as_ref().map_or("", |(_, sentence)| sentence);
        if shown.on_hover_text(sentence).clicked() {
            *chosen = Some(action);
        }
    }
    ui.separator();
    for action in [Action::CopyTransfer, Action::PasteTransfer] {
        let entry = entry_of(action);
        if ui.button(entry.name).on_hover_text(entry.help).clicked() {
            *chosen = Some(action);
        }
    }
}

/// A menu's name below the names that have room for a tick.
fn indented(name: &'static str) -> (Atom<'static>, &'static str) {
    (Atom::custom(IdSalt::new("no tick"), vec2(TICK, TICK)), name)
}

/// A tick in a square.
fn paint_tick(painter: &Painter, square: Rect) {
    let at = |x: f32, y: f32| square.min + square.size() * vec2(x, y);
    let line = vec![at(0.15, 0.55), at(0.4, 0.8), at(0.88, 0.22)];
    painter.add(Shape::line(line, Stroke::new(1.6, theme::ACCENT)));
}

/// An action's help with its key.
fn hint(ctx: &Context, entry: &Entry) -> String {
    match &entry.shortcut {
        Some(shortcut) => format!("{} ({})", entry.help, ctx.format_shortcut(shortcut)),
        None => entry.help.to_owned(),
    }
}

/// Progress and cancel of one job.
fn job_ui(ui: &mut Ui, job: &JobView<'_>) {
    let JobView { title, fraction, left_ms, cancel, is_cancelled, is_paused } = job;
    let frame = Frame::new()
        .fill(Color32::from_rgb(32, 36, 43))
        .stroke(Stroke::new(1.0, theme::LINE))
        .corner_radius(CornerRadius::same(6))
        .inner_margin(Margin::symmetric(10, 6));
    frame.show(ui, |ui| {
        let left = left_ms.map(|ms| format!(" · about {} left", words::roughly(ms)));
        let words = match (is_cancelled, is_paused) {
            (true, _) => "Stopping…".to_owned(),
            (false, true) => format!("{title} · paused"),
            (false, false) => format!("{title}{}", left.unwrap_or_default()),
        };
        if text_and_button_ui(ui, (RichText::new(words), 2), "Cancel", !is_cancelled) {
            cancel();
        }
        let bar = ProgressBar::new(*fraction).desired_height(5.0);
        ui.add(bar.fill(theme::ACCENT)).accessible_name(format!("{title}, progress"));
    });
}

/// What to do when nothing is open.
fn welcome_ui(ui: &mut Ui, rect: Rect) -> Option<Welcome> {
    let open = entry_of(Action::Open);
    let key = open.shortcut.map(|shortcut| ui.ctx().format_shortcut(&shortcut));
    let help = ui.ctx().format_shortcut(&eframe::egui::KeyboardShortcut::new(
        eframe::egui::Modifiers::NONE,
        Key::H,
    ));
    let lines = [
        ("Drop a volume here".to_owned(), 20.0, theme::TEXT),
        (
            format!("Press {} to open one, {help} for all keys", key.unwrap_or_default()),
            13.0,
            theme::TEXT_FAINT,
        ),
    ];
    let mut chosen = None;
    let place = Rect::from_center_size(rect.center(), WELCOME);
    let middle = Layout::top_down(Align::Center);
    ui.scope_builder(UiBuilder::new().max_rect(place).layout(middle), |ui| {
        ui.spacing_mut().item_spacing.y = 10.0;
        for (text, size, colour) in lines {
            ui.label(RichText::new(text).size(size).color(colour));
        }
        if ui.button(open.name).on_hover_text(open.help).clicked() {
            chosen = Some(Welcome::Open);
        }
        if ui.button("Open the demo").on_hover_text("A head, made in code").clicked() {
            chosen = Some(Welcome::Demo);
        }
    });
    chosen
}

/// What may be chosen where nothing is open.
enum Welcome {
    Open,
    Demo,
}

/// What to try where a picture shows nothing. The hand goes through it.
fn nothing_ui(ui: &mut Ui, rect: Rect) {
    let reset = entry_of(Action::ResetView);
    let key = reset.shortcut.map(|shortcut| ui.ctx().format_shortcut(&shortcut));
    let key = key.map(|key| format!(" ({key})")).unwrap_or_default();
    let lines = [
        ("Next to nothing shows in this view".to_owned(), 17.0, theme::TEXT),
        (
            format!(
                "{}{key} shows all that can be seen. If there is nothing, look at the opacities, the ranges and the clip box; what is \
                 thinner than a pixel shows from nearer.",
                reset.name
            ),
            13.0,
            theme::TEXT_FAINT,
        ),
    ];
    let size = WELCOME.min(rect.size());
    let place = Rect::from_center_size(rect.center(), size);
    let middle = Layout::top_down(Align::Center);
    ui.scope_builder(UiBuilder::new().max_rect(place).layout(middle), |ui| {
        for (text, size, colour) in lines {
            ui.add(Label::new(RichText::new(text).size(size).color(colour)).selectable(false));
        }
    });
}

/// What is said where a first picture is still to come: by and by, so that a short wait says nothing.
fn waiting_ui(ui: &mut Ui, rect: Rect, waits: bool) {
    let shown = ui.ctx().animate_bool_with_time(Id::unique("first picture"), waits, WAIT_SECS);
    if waits && shown > 0.5 {
        let words = RichText::new("Drawing the first picture…").color(theme::TEXT_FAINT);
        ui.put(Rect::from_center_size(rect.center(), WELCOME), Label::new(words).selectable(false));
    }
}

/// What will happen when the file over the window is let go.
fn drop_hint_ui(ui: &Ui, rect: Rect) {
    let painter = ui.painter();
    painter.rect_filled(rect, 0.0, Color32::from_black_alpha(120));
    let stroke = Stroke::new(2.0, theme::ACCENT);
    painter.rect_stroke(rect.shrink(14.0), 10.0, stroke, StrokeKind::Inside);
    let font = FontId::proportional(20.0);
    painter.text(rect.center(), Align2::CENTER_CENTER, "Drop to open", font, theme::TEXT);
}
