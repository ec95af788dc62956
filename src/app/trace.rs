//! What the window showed and when, pass by pass, as lines of JSON: for measuring the window from
//! outside, and for tests that drive it.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::anyhow;
use eframe::egui::{self, Ui};
use serde::{Deserialize, Serialize};

use super::Content;
use super::notices::Kind;
use super::window::Window;
use super::words;
use crate::core::Camera;
use crate::scene::Background;
use crate::task::engine::{KernelCounts, OctreeBuilder, Picture};
use crate::task::output_file::OutputFile;

/// One pass of the interface.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PassLine {
    /// Counts up from 0.
    pub pass: u64,
    /// End of the pass, milliseconds since 1970.
    pub at_ms: f64,
    /// The viewport on the window: left, top, width, height in physical pixels.
    pub viewport: [u32; 4],
    /// Where the scene is seen from; `None` while nothing is open.
    pub camera: Option<Camera>,
    /// The colour behind the volume, sRGB; `None` where there is none.
    pub background: Option<[u8; 3]>,
    /// Whether a mouse button is down.
    pub held: bool,
    /// Whether a file is being read.
    pub loading: bool,
    /// Bad news on screen.
    pub errors: Vec<String>,
    /// Whether the picture was not there in the pass before.
    pub picture_is_new: bool,
    /// The picture on screen.
    pub picture: Option<PictureLine>,
}

/// The picture that a pass showed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PictureLine {
    /// Its size in pixels.
    pub size: [u32; 2],
    /// The size that was asked for.
    pub requested_size: [u32; 2],
    /// What it is, in words for people.
    pub rung: String,
    /// Kernels on it and those that `full` draws, where they were counted.
    pub kernels: Option<KernelCounts>,
    /// Who built the octree that was there when it was drawn; `None` where none was.
    pub octree: Option<OctreeBuilder>,
    /// Wall milliseconds that it took.
    pub frame_ms: f64,
    /// Share of the way to `full`; 1 once nothing more will be drawn.
    pub progress: f32,
}

/// The file to write to, replacing one that is there.
///
/// # Errors
/// Where it cannot be written.
pub(super) fn create(path: &Path) -> anyhow::Result<File> {
    // Held until the file is open: a pipe's reader would think that this was all.
    let _fit = OutputFile::check(path, "the trace").map_err(|error| anyhow!(error))?;
    // The trace is begun before any file is opened: a wrong name would empty the volume that is to be shown.
    let mut first = [b'{'];
    if path.is_file()
        && File::open(path).and_then(|mut file| file.read(&mut first)).is_ok()
        && first != [b'{']
    {
        return Err(anyhow!(
            "expected a new file for the trace, or an earlier trace, found another file; choose another place: {}",
            path.display()
        ));
    }
    File::create(path).map_err(|error| {
        anyhow!(
            "expected a place that the trace can be written to, found that the system refuses \
             ({error}); choose another place: {}",
            path.display()
        )
    })
}

/// A window whose passes are written down.
pub(super) struct Traced {
    window: Window,
    file: File,
    pass: u64,
    shown: Option<Arc<Picture>>,
    has_failed: bool,
}

impl Traced {
    pub(super) fn new(window: Window, file: File) -> Self {
        Self { window, file, pass: 0, shown: None, has_failed: false }
    }

    fn line(&mut self, ctx: &egui::Context) -> PassLine {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let picture = self.window.viewport.picture();
        let is_same =
            |shown: &Arc<Picture>| picture.as_ref().is_some_and(|p| Arc::ptr_eq(p, shown));
        let picture_is_new = picture.is_some() && !self.shown.as_ref().is_some_and(is_same);
        let picture_line = picture.as_deref().map(|picture| PictureLine {
            size: picture.size,
            requested_size: picture.requested_size,
            rung: words::level_in_full(&picture.report.level),
            kernels: picture.report.kernels,
            octree: picture.report.octree,
            frame_ms: picture.report.frame_ms,
            progress: picture.report.progress,
        });
        self.shown = picture;
        let scene = self.window.scene();
        let errors = self.window.notices().shown().iter().filter(|n| n.kind == Kind::Error);
        let line = PassLine {
            pass: self.pass,
            at_ms: since_1970.as_secs_f64() * 1e3,
            viewport: self.window.viewport_pixels,
            camera: scene.map(|scene| scene.camera),
            background: scene.and_then(|scene| match scene.background {
                Background::Colour(colour) => Some(colour.0),
                Background::Transparent => None,
            }),
            held: ctx.input(|input| input.pointer.any_down()),
            loading: self.window.is_loading(),
            errors: errors.map(|notice| notice.text.clone()).collect(),
            picture_is_new,
            picture: picture_line,
        };
        self.pass += 1;
        line
    }

    fn write(&mut self, line: &PassLine) -> std::io::Result<()> {
        let mut text = serde_json::to_string(line)?;
        text.push('\n');
        // At once: whoever reads along waits for it.
        self.file.write_all(text.as_bytes())
    }
}

impl Content for Traced {
    fn pass(&mut self, ui: &mut Ui) {
        self.window.pass(ui);
        let line = self.line(ui.ctx());
        let outcome = self.write(&line);
        if let Err(error) = outcome
            && !std::mem::replace(&mut self.has_failed, true)
        {
            log::error!("the trace could not be written: {error}");
        }
    }

    fn save(&mut self, storage: &mut dyn eframe::Storage) {
        Content::save(&mut self.window, storage);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_takes_the_place_of_a_trace_and_of_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path().join("a.nrrd");
        std::fs::write(&at, b"NRRD0004").expect("a file");
        let refused = create(&at).expect_err("it is no trace").to_string();
        assert!(refused.contains("an earlier trace") && refused.ends_with("a.nrrd"), "{refused}");
        assert_eq!(std::fs::read(&at).expect("it is there"), b"NRRD0004");
        for earlier in [&b"{}"[..], b""] {
            std::fs::write(&at, earlier).expect("a file");
            assert!(create(&at).is_ok());
        }
        assert!(create(&folder.path().join("new.jsonl")).is_ok());
    }
}
