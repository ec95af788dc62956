//! Polygons in the window: files of them, read beside the volume that they are embedded in.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui::Context;

use super::file_dialog::{Answer, FileDialog};
use super::job::{Ended, Job};
use super::window::Window;
use crate::io::ReadError;
use crate::io::mesh::{self, OpenedMesh};
use crate::scene::{PolygonLayer, SampleSource};

/// The window's side of polygons.
#[derive(Default)]
pub(super) struct Polygons {
    /// Files being read, in the order of asking.
    pub(super) reading: Vec<Job<Result<OpenedMesh, ReadError>>>,
    chooser: Option<FileDialog>,
}

impl Window {
    /// Asks for a file of polygons.
    pub(super) fn choose_mesh(&mut self, ctx: &Context) {
        match self.scene.is_some() {
            true => self.polygons.chooser = Some(FileDialog::open_mesh(ctx)),
            false => self.notices.hint(NO_VOLUME),
        }
    }

    /// Starts to read a file of polygons into the scene.
    pub(super) fn open_mesh(&mut self, ctx: &Context, path: PathBuf) {
        if self.scene.is_none() {
            self.notices.hint(NO_VOLUME);
            return;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let job = Job::start("mesh", format!("Opening {name}"), ctx, move |ticket| {
            mesh::open(&path, None, ticket)
        });
        self.polygons.reading.push(job);
    }

    /// Takes in what was chosen and read since the last pass.
    pub(super) fn take_meshes(&mut self, ctx: &Context) {
        if let Some(answer) = self.polygons.chooser.as_ref().and_then(FileDialog::poll) {
            self.polygons.chooser = None;
            match answer {
                Answer::Chosen(path) => self.open_mesh(ctx, path),
                Answer::Cancelled => {}
                Answer::Unavailable => self.notices.error(
                    "The file dialog could not open because no desktop portal answered; \
                     drop the file on the window",
                ),
            }
        }
        let reading = std::mem::take(&mut self.polygons.reading);
        for job in reading {
            match job.poll() {
                // A cancel that came too late still is one.
                Some(_) if job.is_cancelled() => {}
                Some(Ended::Finished(Ok(opened))) => self.embed(opened),
                Some(Ended::Finished(Err(error))) if error.is_cancelled() => {}
                Some(Ended::Finished(Err(error))) => self.notices.error(error.to_string()),
                Some(Ended::Lost) => {
                    self.notices.error("Reading the polygons stopped on a bug of the program");
                }
                None => self.polygons.reading.push(job),
            }
        }
    }

    fn embed(&mut self, opened: OpenedMesh) {
        let Some(scene) = &mut self.scene else { return };
        for warning in &opened.warnings {
            self.notices.note(format!("{warning}: {}", opened.mesh.name()));
        }
        let [low, high] = opened.mesh.bounds();
        let lattice = scene.lattice();
        let middle = (low + high) / 2.0;
        let reach = (high - low).length() / 2.0;
        if (middle - lattice.centre()).length() > reach + lattice.bounding_radius() {
            self.notices.note(format!(
                "These polygons lie beside the volume, whose world may have another origin or unit: {}",
                opened.mesh.name()
            ));
        }
        let source = SampleSource::whole(&opened.path, opened.mesh.name());
        scene.add(source, PolygonLayer::new(Arc::new(opened.mesh)));
    }
}

/// Why polygons alone are not shown.
const NO_VOLUME: &str = "Polygons are embedded in a volume: open one first";
