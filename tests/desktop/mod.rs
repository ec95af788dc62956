//! A display of our own (Xvfb), the real program on it, a hand (xdotool) and an eye (GetImage).

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};
use tempfile::TempDir;
use voxsplat::app::trace::PassLine;
use x11rb::connection::Connection as _;
use x11rb::protocol::xproto::{ConnectionExt as _, CreateWindowAux, ImageFormat, WindowClass};
use x11rb::rust_connection::RustConnection;
use x11rb::{COPY_DEPTH_FROM_PARENT, COPY_FROM_PARENT};

/// Size of the display, which is also the window's own.
pub(crate) const DISPLAY_SIZE: [u16; 2] = [1280, 800];
/// Between two looks at the trace.
const LOOK_EVERY: Duration = Duration::from_millis(10);

/// Ends a process when the test does, however it does.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// An X server that nobody looks at.
pub(crate) struct Display {
    // Closed before the server ends.
    connection: RustConnection,
    root: u32,
    name: String,
    _server: Running,
}

impl Display {
    /// Starts a server on a free display; or says what is missing.
    pub(crate) fn start() -> Result<Self, String> {
        let nothing = || Stdio::null();
        let mut xdotool = Command::new("xdotool");
        xdotool.arg("version").stdout(nothing()).stderr(nothing());
        // It wants a display even for that; all that counts is that it is there.
        xdotool.status().map_err(|error| format!("xdotool does not run: {error}"))?;
        let [width, height] = DISPLAY_SIZE;
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{width}x{height}x24"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("Xvfb does not run: {error}"))?;
        let mut server = Running(server);
        let mut number = String::new();
        let mut stdout = BufReader::new(server.0.stdout.take().unwrap());
        stdout.read_line(&mut number).unwrap();
        let name = format!(":{}", number.trim());
        let (connection, screen) = x11rb::connect(Some(&name)).unwrap();
        let root = connection.setup().roots[screen].root;
        Ok(Self { connection, root, name, _server: server })
    }

    /// What the display shows in an area: left, top, width, height.
    pub(crate) fn shot(&self, [left, top, width, height]: [u32; 4]) -> RgbImage {
        let [x, y] = [left, top].map(|n| i16::try_from(n).unwrap());
        let [w, h] = [width, height].map(|n| u16::try_from(n).unwrap());
        let cookie =
            self.connection.get_image(ImageFormat::Z_PIXMAP, self.root, x, y, w, h, u32::MAX);
        let bytes = cookie.unwrap().reply().unwrap().data;
        assert_eq!(bytes.len(), (width * height * 4) as usize, "32 bits a pixel");
        // Blue, green, red, nothing.
        let pixels = bytes.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect();
        RgbImage::from_raw(width, height, pixels).unwrap()
    }

    /// Has a window of nobody's over all that is shown; it is gone once it is closed.
    pub(crate) fn cover(&self) -> Cover<'_> {
        let window = self.connection.generate_id().unwrap();
        let [width, height] = DISPLAY_SIZE;
        let how = CreateWindowAux::new().override_redirect(1).background_pixel(0);
        let (depth, visual, class) =
            (COPY_DEPTH_FROM_PARENT, COPY_FROM_PARENT, WindowClass::INPUT_OUTPUT);
        let made = self
            .connection
            .create_window(depth, window, self.root, 0, 0, width, height, 0, class, visual, &how);
        made.unwrap().check().unwrap();
        self.connection.map_window(window).unwrap().check().unwrap();
        Cover { display: self, window }
    }

    /// Moves the mouse or presses keys: the words of one xdotool call.
    pub(crate) fn hand(&self, words: &[&str]) {
        let status = Command::new("xdotool").args(words).env("DISPLAY", &self.name).status();
        assert!(status.unwrap().success(), "xdotool {words:?}");
    }
}

/// A window over all others.
pub(crate) struct Cover<'a> {
    display: &'a Display,
    window: u32,
}

impl Drop for Cover<'_> {
    fn drop(&mut self) {
        // Where the server is gone, so is the window.
        if let Ok(gone) = self.display.connection.destroy_window(self.window) {
            gone.check().unwrap_or_default();
        }
    }
}

/// The program, its window on a display, and what it writes down.
pub(crate) struct Program {
    running: Running,
    folder: TempDir,
    /// What it was told to draw with.
    engine: [&'static str; 2],
}

impl Program {
    /// Opens the window on a file (or `demo:NAME`).
    pub(crate) fn start(display: &Display, file: &str, engine: [&'static str; 2]) -> Self {
        Self::start_in(display, file, engine, &[])
    }

    /// The same with variables of the environment, by name and value.
    pub(crate) fn start_in(
        display: &Display,
        file: &str,
        engine: [&'static str; 2],
        variables: &[(&str, &str)],
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let stderr = fs::File::create(folder.path().join("stderr")).unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_voxsplat"))
            .args(engine)
            .arg("--trace")
            .arg(folder.path().join("trace"))
            .arg(file)
            .env("DISPLAY", &display.name)
            // Of a server that is not there: X is used.
            .env("WAYLAND_DISPLAY", "voxsplat-no-server")
            .env("WINIT_X11_SCALE_FACTOR", "1")
            // Nobody's settings but its own.
            .env("HOME", folder.path())
            .env("XDG_DATA_HOME", folder.path().join("data"))
            .env("XDG_CONFIG_HOME", folder.path().join("config"))
            .env("XDG_RUNTIME_DIR", folder.path())
            .envs(variables.iter().copied())
            .stderr(stderr)
            .spawn()
            .unwrap();
        Self { running: Running(child), folder, engine }
    }

    /// A path in a folder of the program's own.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Resident memory, bytes; 0 where the system does not say.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.running.0.id()));
        let status = status.unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.and_then(|l| l.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok());
        kib.unwrap_or(0) * 1024
    }

    /// What it wrote to standard error.
    pub(crate) fn said(&self) -> String {
        fs::read_to_string(self.path("stderr")).unwrap_or_default()
    }

    /// Every pass so far.
    pub(crate) fn passes(&self) -> Vec<PassLine> {
        let text = fs::read_to_string(self.path("trace")).unwrap_or_default();
        // The last line may be half written.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        whole.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// Waits for a pass that is as wanted, among those after the first `after`.
    pub(crate) fn wait(
        &mut self,
        what: &str,
        after: usize,
        wanted: impl Fn(&PassLine) -> bool,
    ) -> PassLine {
        let start = Instant::now();
        loop {
            let passes = self.passes();
            if let Some(pass) = passes.iter().skip(after).find(|pass| wanted(pass)) {
                return pass.clone();
            }
            let ended = self.running.0.try_wait().unwrap();
            if ended.is_some() || start.elapsed() > Duration::from_secs(120) {
                let (last, said) = (passes.last(), self.said());
                panic!("no {what}; ended: {ended:?}; last: {last:?}; {said}");
            }
            sleep(LOOK_EVERY);
        }
    }

    /// Waits until the picture is exact and the window has nothing more to do.
    pub(crate) fn wait_for_rest(&mut self, after: usize) -> PassLine {
        self.wait("finished picture", after, is_finished);
        loop {
            let passes = self.passes();
            sleep(Duration::from_millis(700));
            let now = self.passes();
            if now.len() == passes.len() {
                let last = now.last().unwrap();
                assert!(is_finished(last), "it stopped before the end: {last:?}");
                return last.clone();
            }
            assert!(now.len() < 20_000, "it never rests");
        }
    }

    /// Waits for the program to end by itself; whether it was content.
    pub(crate) fn wait_for_end(&mut self) -> bool {
        let start = Instant::now();
        loop {
            if let Some(status) = self.running.0.try_wait().unwrap() {
                return status.success();
            }
            assert!(start.elapsed() < Duration::from_secs(30), "the program does not end");
            sleep(LOOK_EVERY);
        }
    }
}

fn is_finished(pass: &PassLine) -> bool {
    let [_, _, width, height] = pass.viewport;
    !pass.loading
        && !pass.held
        && pass.picture.as_ref().is_some_and(|picture| {
            picture.progress >= 1.0 && picture.requested_size == [width, height]
        })
}

/// What `render` draws of a file with a program's engine, seen as in a pass.
pub(crate) fn rendered(program: &Program, file: &str, pass: &PassLine) -> RgbImage {
    let output = &program.path("rendered.png");
    let camera = pass.camera.unwrap();
    let [_, _, width, height] = pass.viewport;
    let [r, g, b] = pass.background.unwrap();
    // A machine quick enough to double the slabs in time shows more of them.
    let rung = pass.picture.as_ref().and_then(|picture| picture.rung.split_once(", "));
    let slabs = rung.and_then(|(_, slabs)| slabs.strip_suffix(" slabs per voxel"));
    let vector = |v: glam::DVec3| format!("{},{},{}", v.x, v.y, v.z);
    let outcome = Command::new(env!("CARGO_BIN_EXE_voxsplat"))
        .args(["render", file])
        .args(program.engine)
        .arg("--output")
        .arg(output)
        .args(["--resolution", &format!("{width},{height}")])
        .args(["--camera-direction", &vector(camera.direction)])
        .args(["--camera-view-up", &vector(camera.up)])
        .args(["--camera-focal-point", &vector(camera.focal_point)])
        .args(["--parallel-scale", &camera.parallel_scale.to_string()])
        .args(slabs.into_iter().flat_map(|slabs| ["--slabs-per-voxel", slabs]))
        .args(["--background", &format!("{r:02x}{g:02x}{b:02x}")])
        .output()
        .unwrap();
    assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stderr));
    image::open(output).unwrap().to_rgb8()
}

/// How two pictures of one size differ where `counts` says that a pixel counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Greatest difference of any channel, of 255.
    pub(crate) greatest: u8,
    /// Pixels that differ by more than 1 of 255.
    pub(crate) pixels: usize,
    /// Pixels that counted.
    pub(crate) of: usize,
}

pub(crate) fn difference(
    first: &RgbImage,
    second: &RgbImage,
    counts: impl Fn(u32, u32) -> bool,
) -> Difference {
    assert_eq!(first.dimensions(), second.dimensions());
    let apart = |a: &Rgb<u8>, b: &Rgb<u8>| {
        a.0.iter().zip(b.0).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0)
    };
    let mut found = Difference { greatest: 0, pixels: 0, of: 0 };
    for (x, y, pixel) in first.enumerate_pixels().filter(|(x, y, _)| counts(*x, *y)) {
        let apart = apart(pixel, second.get_pixel(x, y));
        found.greatest = found.greatest.max(apart);
        found.pixels += usize::from(apart > 1);
        found.of += 1;
    }
    found
}
