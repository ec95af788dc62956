//! Surfaces in the window: files of polygons, and of labels, read beside the volume that they are embedded in.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::Context;
use glam::DVec3;

use super::actions::Action;
use super::dialogs::named_file::Purpose;
use super::document::Source;
use super::file_dialog::{Answer, FileDialog};
use super::job::{Ended, Job};
use super::panels::POLYGONS;
use super::window::Window;
use crate::core::counted;
use crate::io::ReadError;
use crate::io::labels::{self, OpenedLabels};
use crate::io::mesh::{self, OpenedMesh};
use crate::scene::{BESIDE, PolygonLayer, SampleSource, Scene, place_over};
use crate::volume::Lattice;

/// What a file's surfaces are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surfaces {
    /// Its triangles.
    Polygons,
    /// What its samples are labelled with.
    Labels,
}

/// A file that was read.
pub(super) enum Embedded {
    /// Triangles.
    Mesh(Box<OpenedMesh>),
    /// Labels.
    Labels(OpenedLabels),
}

/// The window's side of polygons.
#[derive(Default)]
pub(super) struct Polygons {
    /// Files being read, in the order of asking.
    pub(super) reading: Vec<Job<Result<Embedded, ReadError>>>,
    chooser: Option<FileDialog>,
}

impl Polygons {
    /// Whether the desktop's dialog for a file of them is open, or on its way.
    pub(super) fn is_choosing(&self) -> bool {
        self.chooser.is_some()
    }
}

impl Window {
    /// Asks for a file of surfaces.
    pub(super) fn choose_surfaces(&mut self, ctx: &Context, of: Surfaces) {
        match of {
            _ if self.scene.is_none() => self.notices.hint(no_volume(of)),
            Surfaces::Polygons => self.polygons.chooser = Some(FileDialog::open_mesh(ctx)),
            Surfaces::Labels => {
                let source = self.document.as_ref().map(|document| &document.source);
                let folder = source.and_then(Source::path).and_then(Path::parent);
                // With what stands between a folder and a file's name.
                let folder = folder.map(|folder| folder.join("")).unwrap_or_default();
                self.ask_for_file(Purpose::AddLabels, &folder);
            }
        }
    }

    /// Starts to read a file of surfaces into the scene.
    pub(super) fn embed(&mut self, ctx: &Context, of: Surfaces, path: PathBuf) {
        if self.scene.is_none() {
            self.notices.hint(no_volume(of));
            return;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let grid = self.document.as_ref().map(|document| &document.grid);
        let space = grid.and_then(|grid| grid.space.clone());
        let lattice = grid.map_or_else(|| Lattice::unit([1; 3]), |grid| grid.lattice);
        let job = Job::start("surfaces", format!("Opening {name}"), ctx, move |ticket| match of {
            Surfaces::Polygons => {
                mesh::open(&path, None, ticket).map(|mesh| Embedded::Mesh(Box::new(mesh)))
            }
            Surfaces::Labels => {
                let over = (&lattice, space.as_deref());
                let place =
                    |theirs: &Lattice, space: Option<&str>| place_over((theirs, space), over);
                labels::open(&path, None, place, ticket).map(Embedded::Labels)
            }
        });
        self.polygons.reading.push(job);
    }

    /// Takes in what was chosen and read since the last pass.
    pub(super) fn take_surfaces(&mut self, ctx: &Context) {
        if let Some(answer) = self.polygons.chooser.as_ref().and_then(FileDialog::poll) {
            self.polygons.chooser = None;
            match answer {
                Answer::Chosen(path) => self.embed(ctx, Surfaces::Polygons, path),
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
                Some(Ended::Finished(Ok(Embedded::Mesh(opened)))) => self.add_mesh(*opened),
                Some(Ended::Finished(Ok(Embedded::Labels(opened)))) => self.add_labels(opened),
                Some(Ended::Finished(Err(error))) if error.is_cancelled() => {}
                Some(Ended::Finished(Err(error))) => self.notices.error(error.to_string()),
                Some(Ended::Lost) => {
                    self.notices.error("Reading the surfaces stopped on a bug of the program");
                }
                None => self.polygons.reading.push(job),
            }
        }
    }

    fn add_mesh(&mut self, opened: OpenedMesh) {
        let name = opened.mesh.name().to_owned();
        self.tell_of_surfaces(&name, &opened.warnings, opened.mesh.bounds());
        let source = SampleSource::whole(&opened.path, &name);
        let places = opened.mesh.spread_places();
        let add = |scene: &mut Scene| scene.add(source, PolygonLayer::new(Arc::new(opened.mesh)));
        self.add_surfaces((&name, &places), add);
    }

    fn add_labels(&mut self, opened: OpenedLabels) {
        self.unfinished.remove(&Purpose::AddLabels);
        let name = opened.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = opened.labels.iter().map(|label| label.mesh.bounds());
        let bounds = bounds.fold(none, |[low, high], [from, to]| [low.min(from), high.max(to)]);
        self.tell_of_surfaces(&name, &opened.warnings, bounds);
        let count = counted(opened.labels.len(), "label");
        self.notices.hint(format!("{count} shown as surfaces: {name}"));
        let places: Vec<DVec3> =
            opened.labels.iter().flat_map(|label| label.mesh.spread_places()).collect();
        self.add_surfaces((&name, &places), |scene| {
            for (number, label) in opened.labels.into_iter().enumerate() {
                let source = SampleSource::whole(&opened.path, label.mesh.name());
                let layer = PolygonLayer::of_label(Arc::new(label.mesh), number, label.colour);
                scene.add(source, layer);
            }
        });
    }

    /// Adds surfaces of a file of this name, whose corners are there, to the scene. A view that nobody has moved since the file was
    /// opened shows them, too. Where matter hides them it is said.
    fn add_surfaces(&mut self, (name, places): (&str, &[DVec3]), add: impl FnOnce(&mut Scene)) {
        let view = self.unmoved_view();
        let Some(scene) = &mut self.scene else { return };
        add(scene);
        if let Some(view) = view {
            self.fit(view);
        }
        let scene = self.scene.as_ref();
        if scene.is_some_and(|scene| scene.little_seen_of_places(places.iter().copied()).is_some())
        {
            self.notices.offer(
                Action::ToggleFade,
                format!(
                    "The volume hides most of this: fade it, or cut it open under Clip: {name}"
                ),
            );
        }
    }

    fn tell_of_surfaces(&mut self, name: &str, warnings: &[String], [low, high]: [DVec3; 2]) {
        let Some(scene) = &self.scene else { return };
        self.notices.settle();
        // What was added is in sight, unless somebody closed its section.
        self.settings.sections.entry(POLYGONS.to_owned()).or_insert(true);
        for warning in warnings {
            self.notices.note(format!("{warning}: {name}"));
        }
        if !scene.may_reach([low, high]) {
            self.notices.note(format!("{BESIDE}: {name}"));
        }
    }
}

/// Why surfaces alone are not shown.
fn no_volume(of: Surfaces) -> &'static str {
    match of {
        Surfaces::Polygons => "Polygons are embedded in a volume: open one first",
        Surfaces::Labels => {
            "Labels are laid over a volume: open their scan first, or open their file as a volume"
        }
    }
}
