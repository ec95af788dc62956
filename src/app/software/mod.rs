//! The window where there is no graphics processor: egui's meshes painted by the processor, into the screen's memory.
//!
//! A graphics driver that draws by the processor takes 14 to 30 ms of two cores for a frame of the window, whatever
//! changed in it. Here a frame costs what changed. No driver is needed.

mod canvas;
mod picture;
mod sight;
mod storage;
mod triangle;

use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context as _, anyhow};
use eframe::egui::{Context, Event, ViewportBuilder, ViewportId, ViewportInfo};
use eframe::{Storage, egui};
use egui_winit::winit::application::ApplicationHandler;
use egui_winit::winit::event::{StartCause, WindowEvent};
use egui_winit::winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use egui_winit::winit::window::{Window as ScreenWindow, WindowId};
use egui_winit::{ActionRequested, WindowGeometry, WindowSettings, accesskit_winit};

pub use canvas::{Canvas, Damage};
use sight::Sight;
use storage::FileStorage;

use super::{APP_ID, Content, display, theme};

/// Least time between two frames: no screen shows more.
const FRAME: Duration = Duration::from_micros(16_600);
/// From a pass of the interface until settings are written down: a window may go without being closed.
const SAVE_AFTER: Duration = Duration::from_secs(5);
/// Textures that egui may ask for, pixels.
const LARGEST_TEXTURE: usize = 16_384;
/// Names in the storage, as `eframe` has them.
const MEMORY_KEY: &str = "egui";
const WINDOW_KEY: &str = "window";

/// What wakes the window.
#[derive(Debug)]
enum Wake {
    /// A thread asks for a frame, who saw so many passes finished.
    Repaint { at: Instant, pass: u64 },
    /// A screen reader asks.
    Reader(accesskit_winit::Event),
}

impl From<accesskit_winit::Event> for Wake {
    fn from(event: accesskit_winit::Event) -> Self {
        Self::Reader(event)
    }
}

/// Makes what the window shows, from what earlier ones left.
type Make = Box<dyn FnOnce(&Context, Option<&dyn Storage>) -> Box<dyn Content>>;

/// Opens the window and returns when it is closed.
///
/// # Errors
/// Where there is no display, or it takes no pixels from memory.
pub(super) fn run(builder: ViewportBuilder, make: Make) -> anyhow::Result<()> {
    let mut events = EventLoop::<Wake>::with_user_event();
    display::choose(&mut events);
    let events = events.build().map_err(|e| no_display(&e))?;
    let ctx = Context::default();
    let storage = FileStorage::open(APP_ID);
    let kept = storage.as_ref().map(|storage| storage as &dyn Storage);
    if let Some(memory) = kept.and_then(|kept| eframe::get_value(kept, MEMORY_KEY)) {
        ctx.memory_mut(|there| *there = memory);
    }
    ctx.options_mut(|options| options.max_passes = NonZeroPasses::MIN.saturating_add(1));
    let proxy = events.create_proxy();
    let waker = proxy.clone();
    ctx.set_request_repaint_callback(move |wish| {
        let at = Instant::now() + wish.delay.min(Duration::from_secs(3600));
        // A loop that has ended paints no more.
        drop(waker.send_event(Wake::Repaint { at, pass: wish.current_cumulative_pass_nr }));
    });
    let mut host = Host {
        ctx,
        storage,
        make: Some((builder, make)),
        proxy,
        screen: None,
        wake_at: None,
        painted_at: None,
        save_at: None,
        failure: None,
    };
    let ended = events.run_app(&mut host);
    ended.map_err(|error| if host.make.is_none() { lost(&error) } else { no_display(&error) })?;
    host.failure.map_or(Ok(()), Err)
}

/// There is nothing to open a window on. The error's own words are places in its source.
fn no_display(error: &dyn std::fmt::Display) -> anyhow::Error {
    log::debug!("{error}");
    anyhow!(
        "expected a display to open a window on, found none that answers; try `voxsplat render`, which needs none"
    )
}

/// The display went away from under the window. X ends the program by itself, in words of its own.
fn lost(error: &dyn std::fmt::Display) -> anyhow::Error {
    log::debug!("{error}");
    anyhow!(
        "expected the display to stay, found that it went away; open the window again where one is there"
    )
}

/// How many passes egui may take for a frame.
type NonZeroPasses = std::num::NonZeroUsize;

/// The window, and when it is to be painted.
struct Host {
    ctx: Context,
    storage: Option<FileStorage>,
    /// Until the window is there.
    make: Option<(ViewportBuilder, Make)>,
    proxy: EventLoopProxy<Wake>,
    screen: Option<Screen>,
    /// When the next frame is due.
    wake_at: Option<Instant>,
    painted_at: Option<Instant>,
    /// When settings are written down next.
    save_at: Option<Instant>,
    failure: Option<anyhow::Error>,
}

/// A window on the screen.
struct Screen {
    window: Arc<ScreenWindow>,
    surface: softbuffer::Surface<Arc<ScreenWindow>, Arc<ScreenWindow>>,
    state: egui_winit::State,
    info: ViewportInfo,
    canvas: Canvas,
    content: Box<dyn Content>,
    /// Where it stood when it was closed last.
    settings: Option<WindowSettings>,
    geometry: Option<WindowGeometry>,
    is_shown: bool,
    sight: Sight,
}

impl Host {
    /// A frame is wanted at a time.
    fn wake(&mut self, at: Instant) {
        let earliest = self.painted_at.map_or(at, |painted| at.max(painted + FRAME));
        self.wake_at = Some(self.wake_at.map_or(earliest, |there| there.min(earliest)));
    }

    fn open(&mut self, events: &ActiveEventLoop) -> anyhow::Result<()> {
        let Some((mut builder, make)) = self.make.take() else { return Ok(()) };
        let kept = self.storage.as_ref().map(|storage| storage as &dyn Storage);
        let mut settings: Option<WindowSettings> =
            kept.and_then(|kept| eframe::get_value(kept, WINDOW_KEY));
        let zoom = self.ctx.zoom_factor();
        if let Some(settings) = &mut settings {
            let sides = events.available_monitors().map(|monitor| {
                let size =
                    monitor.size().to_logical::<f32>(f64::from(zoom) * monitor.scale_factor());
                egui::vec2(size.width, size.height)
            });
            let largest = sides.reduce(egui::Vec2::max).filter(|size| size.min_elem() > 0.0);
            settings.clamp_size_to_sane_values(largest.unwrap_or(egui::Vec2::splat(16_000.0)));
            settings.clamp_position_to_monitors(zoom, events);
            builder = settings.initialize_viewport_builder(zoom, builder);
        }
        let refused = "expected a screen that takes pictures from memory, found that it refuses";
        // Until something is painted there is nothing to be seen.
        let builder = builder.with_visible(false);
        let window = egui_winit::create_window(&self.ctx, events, &builder).context(refused)?;
        let window = Arc::new(window);
        if let Some(settings) = &settings {
            settings.initialize_window(&window);
        }
        let context = softbuffer::Context::new(Arc::clone(&window))
            .map_err(|error| anyhow!("{refused} ({error})"))?;
        let surface = softbuffer::Surface::new(&context, Arc::clone(&window))
            .map_err(|error| anyhow!("{refused} ({error})"))?;
        #[expect(clippy::cast_possible_truncation, reason = "a small factor")]
        let scale = window.scale_factor() as f32;
        let mut state = egui_winit::State::new(
            self.ctx.clone(),
            ViewportId::ROOT,
            events,
            Some(scale),
            window.theme(),
            Some(LARGEST_TEXTURE),
        );
        state.init_accesskit(events, &window, self.proxy.clone());
        let mut info = ViewportInfo::default();
        egui_winit::update_viewport_info(&mut info, &self.ctx, &window, true);
        let content = make(&self.ctx, kept);
        self.screen = Some(Screen {
            window,
            surface,
            state,
            info,
            canvas: Canvas::default(),
            content,
            geometry: settings.map(|settings| settings.normal_geometry()),
            settings,
            is_shown: false,
            sight: Sight::new(),
        });
        self.wake(Instant::now());
        Ok(())
    }

    /// Runs a pass of the interface and shows it.
    fn paint(&mut self, events: &ActiveEventLoop) -> anyhow::Result<()> {
        let Some(screen) = &mut self.screen else { return Ok(()) };
        self.wake_at = None;
        self.painted_at = Some(Instant::now());
        let size = screen.window.inner_size();
        let (Some(width), Some(height)) =
            (NonZeroU32::new(size.width), NonZeroU32::new(size.height))
        else {
            return Ok(());
        };
        egui_winit::update_viewport_info(&mut screen.info, &self.ctx, &screen.window, false);
        if !screen.sight.is_open(screen.info.minimized) {
            return Ok(());
        }
        let mut input = screen.state.take_egui_input(&screen.window);
        input.viewports.insert(ViewportId::ROOT, screen.info.clone());
        screen.info.events.clear();
        let mut output = self.ctx.run_ui(input, |ui| screen.content.pass(ui));
        screen.state.handle_platform_output_with_event_loop(
            &screen.window,
            events,
            output.platform_output,
        );
        let begun = Instant::now();
        let primitives = self.ctx.tessellate(output.shapes, output.pixels_per_point);
        let tessellated = begun.elapsed();
        screen.canvas.set_textures(&mut output.textures_delta);
        let size = [width, height].map(|side| side.get() as usize);
        let damage = screen.canvas.paint(size, output.pixels_per_point, theme::PANEL, &primitives);
        screen.canvas.free_textures(output.textures_delta.free.drain());
        let painted = begun.elapsed();
        screen.present(width, height, &damage)?;
        log::debug!(
            "frame: pass {:?}, tessellated {tessellated:?}, painted {painted:?}, shown {:?}, {} parts",
            begun.duration_since(self.painted_at.unwrap_or(begun)),
            begun.elapsed(),
            damage.len()
        );
        let mut actions = Vec::new();
        let mut repaint_after = Duration::MAX;
        if let Some(viewport) = output.viewport_output.get(&ViewportId::ROOT) {
            let commands = viewport.commands.iter().cloned();
            let (info, window) = (&mut screen.info, &screen.window);
            egui_winit::process_viewport_commands(&self.ctx, info, commands, window, &mut actions);
            repaint_after = viewport.repaint_delay;
        }
        let wishes_more = !actions.is_empty();
        for action in actions {
            screen.act(action);
        }
        let closes = screen.info.close_requested();
        if wishes_more {
            self.wake(Instant::now());
        }
        if repaint_after < Duration::from_secs(3600) {
            self.wake(Instant::now() + repaint_after);
        }
        if closes {
            self.close(events);
        } else {
            self.save_at.get_or_insert(Instant::now() + SAVE_AFTER);
        }
        Ok(())
    }

    fn save(&mut self) {
        self.save_at = None;
        let (Some(screen), Some(storage)) = (&mut self.screen, &mut self.storage) else { return };
        let zoom = self.ctx.zoom_factor();
        let settings = WindowSettings::from_window(zoom, &screen.window, screen.geometry);
        screen.geometry = Some(settings.normal_geometry());
        eframe::set_value(storage, WINDOW_KEY, &settings);
        self.ctx.memory(|memory| eframe::set_value(storage, MEMORY_KEY, memory));
        screen.content.save(storage);
        storage.flush();
    }

    fn close(&mut self, events: &ActiveEventLoop) {
        self.save();
        // The engine's threads end with what they draw for.
        self.screen = None;
        events.exit();
    }

    fn fail(&mut self, events: &ActiveEventLoop, error: anyhow::Error) {
        self.failure = Some(error);
        events.exit();
    }
}

impl Screen {
    /// Copies what was painted to the screen.
    fn present(
        &mut self,
        width: NonZeroU32,
        height: NonZeroU32,
        damage: &[Damage],
    ) -> anyhow::Result<()> {
        let refused = |error| {
            anyhow!("expected a screen that takes pictures, found that it refuses ({error})")
        };
        self.surface.resize(width, height).map_err(refused)?;
        let mut buffer = self.surface.buffer_mut().map_err(refused)?;
        let pixels = self.canvas.pixels();
        let whole = self.sight.take_stale() || buffer.age() != 1;
        if whole {
            buffer.copy_from_slice(pixels);
            self.window.pre_present_notify();
            buffer.present().map_err(refused)?;
        } else if !damage.is_empty() {
            let across = self.canvas.size()[0];
            for part in damage {
                let (x, width) = (part.x as usize, part.width as usize);
                for y in part.y as usize..(part.y + part.height) as usize {
                    let row = y * across + x..y * across + x + width;
                    buffer[row.clone()].copy_from_slice(&pixels[row]);
                }
            }
            let parts: Vec<softbuffer::Rect> = damage
                .iter()
                .filter_map(|part| {
                    let (width, height) =
                        (NonZeroU32::new(part.width)?, NonZeroU32::new(part.height)?);
                    Some(softbuffer::Rect { x: part.x, y: part.y, width, height })
                })
                .collect();
            self.window.pre_present_notify();
            buffer.present_with_damage(&parts).map_err(refused)?;
        }
        if !std::mem::replace(&mut self.is_shown, true) {
            if let Some(settings) = &self.settings {
                settings.before_first_show(&self.window);
            }
            self.window.set_visible(true);
            if let Some(settings) = &self.settings {
                settings.after_first_show(&self.window);
            }
            // What was shown while hidden may be lost.
            self.sight.lose();
        }
        Ok(())
    }

    fn act(&mut self, action: ActionRequested) {
        match action {
            ActionRequested::Cut => self.state.egui_input_mut().events.push(Event::Cut),
            ActionRequested::Copy => self.state.egui_input_mut().events.push(Event::Copy),
            ActionRequested::Paste => {
                if let Some(text) = self.state.clipboard_text() {
                    let text = text.replace("\r\n", "\n");
                    self.state.egui_input_mut().events.push(Event::Paste(text));
                }
            }
            // Nothing here asks for them: pictures are saved by the engine, and nothing is drawn while hidden.
            ActionRequested::Screenshot(_) | ActionRequested::PaintWhileHidden => {}
        }
    }
}

impl ApplicationHandler<Wake> for Host {
    fn new_events(&mut self, _events: &ActiveEventLoop, _cause: StartCause) {}

    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.fail(events, error);
        }
    }

    fn user_event(&mut self, _events: &ActiveEventLoop, wake: Wake) {
        match wake {
            // What was asked for before or during a pass that has ended is in its output.
            Wake::Repaint { pass, .. }
                if pass < self.ctx.cumulative_pass_nr_for(ViewportId::ROOT) => {}
            Wake::Repaint { at, .. } => self.wake(at),
            Wake::Reader(event) => {
                let Some(screen) = &mut self.screen else { return };
                match event.window_event {
                    accesskit_winit::WindowEvent::InitialTreeRequested => {
                        self.ctx.enable_accesskit()
                    }
                    accesskit_winit::WindowEvent::ActionRequested(request) => {
                        screen.state.on_accesskit_action_request(request);
                    }
                    accesskit_winit::WindowEvent::AccessibilityDeactivated => {
                        self.ctx.disable_accesskit();
                    }
                }
                self.wake(Instant::now());
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let Some(screen) = &mut self.screen else { return };
        let response = screen.state.on_window_event(&screen.window, &event);
        if matches!(event, WindowEvent::CloseRequested) {
            return self.close(events);
        }
        if screen.sight.note(&event) || response.repaint {
            self.wake(Instant::now());
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.wake_at.is_some_and(|at| at <= Instant::now())
            && let Err(error) = self.paint(events)
        {
            return self.fail(events, error);
        }
        if self.save_at.is_some_and(|at| at <= Instant::now()) {
            self.save();
        }
        let next = [self.wake_at, self.save_at].into_iter().flatten().min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }

    fn exiting(&mut self, _events: &ActiveEventLoop) {
        // Surfaces go before the display does.
        self.screen = None;
    }
}
