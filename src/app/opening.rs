//! The window's part in opening files, and in what is seen of them first.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::{Context, ViewportCommand};
use glam::DVec3;

use super::actions::Action;
use super::dialogs::open_path::OpenPath;
use super::dialogs::raw::RawDialog;
use super::document::{Document, RawLayout, ReadFailure, Source};
use super::file_dialog::{Answer, FileDialog};
use super::history::History;
use super::job::{Ended, Job};
use super::modes;
use super::panels::data::FieldChoice;
use super::panels::{DATA, POLYGONS, is_open};
use super::vectors::Vectors;
use super::window::{Dialog, Window};
use crate::core::{Camera, Projection};
use crate::io::Series;
use crate::io::mesh::MeshFormat;
use crate::scene::{
    ByArray, CutSettings, Inside, Layer, Look, PolygonLayer, SampleSource, Sampled, Scene, Shading,
    SplatSettings, VectorLayer, offers, projected_range,
};
use crate::task::transfer_file;
use crate::transfer::ColourSource;
use crate::transfer::presets::{self, RangeRule};

/// A volume being read, or another field of one being made ready.
pub(super) struct Loading {
    pub(super) job: Job<Result<Document, ReadFailure>>,
    source: Source,
    /// Another field of what is open: the view stays.
    keep_view: bool,
    /// Files that were named with it and belong into it: polygons, and a transfer function.
    companions: Vec<PathBuf>,
    /// Names of other volumes that were named with it.
    others: Vec<String>,
}

/// Puts the surface that a file is into its scene: where it is there already, for another field, it looks as before but for its
/// colours.
fn show_surface(scene: &mut Scene, source: SampleSource, layer: PolygonLayer) {
    let is_it =
        |old: &Layer| (&old.source.path, &old.source.field) == (&source.path, &source.field);
    match scene.layers.iter().position(is_it) {
        Some(at) => {
            let (old, is_shown) = (scene.layers[at].look.clone(), scene.layers[at].is_shown);
            let mut look = layer.look;
            if let Look::Polygons(old) = old {
                let map = old.by.map(|by| by.map);
                look.by = look.by.map(|by| ByArray { map: map.unwrap_or(by.map), ..by });
                (look.opacity, look.is_smooth) = (old.opacity, old.is_smooth);
            }
            scene.replace(at, source, PolygonLayer { look, ..layer });
            scene.layers[at].is_shown = is_shown;
        }
        None => {
            scene.add(source, layer);
            scene.show_field(false);
        }
    }
}

/// Whether a source is no volume and belongs into one.
fn is_companion(source: &Source) -> bool {
    let is_of_transfer = matches!(source, Source::File(path) if transfer_file::is_named_so(path));
    is_of_transfer || is_of_polygons(source)
}

fn is_of_polygons(source: &Source) -> bool {
    matches!(source, Source::File(path) if MeshFormat::of(path).is_some())
}

impl Window {
    /// Starts to read a source; what is open stays until it has been read.
    pub fn open(&mut self, ctx: &Context, source: Source) {
        let name = source.name();
        self.read(ctx, source, &name, |document| document);
    }

    /// Starts to open another of the series among which the open one was chosen. The choice stays, wherever the files of
    /// each lie.
    pub(super) fn choose_series(&mut self, ctx: &Context, index: usize) {
        let Some(document) = &self.document else { return };
        let mut series = document.series.clone();
        for (at, one) in series.iter_mut().enumerate() {
            one.is_open = at == index;
        }
        let Some(Series { name, path, .. }) = series.get(index).cloned() else { return };
        let among = move |document| Document { series, ..document };
        self.read(ctx, Source::File(path), &name, among);
    }

    /// Starts to read what is called so, and makes of it the document that opens.
    fn read(
        &mut self,
        ctx: &Context,
        source: Source,
        name: &str,
        made: impl FnOnce(Document) -> Document + Send + 'static,
    ) {
        let library = Arc::clone(&self.parts.library);
        let reading = source.clone();
        let job = Job::start("load", format!("Opening {name}"), ctx, move |ticket| {
            Document::read(&*library, reading, ticket).map(made)
        });
        self.loading = Some(Loading {
            job,
            source,
            keep_view: false,
            companions: Vec::new(),
            others: Vec::new(),
        });
        self.undescribed = None;
    }

    /// Opens the first volume of several sources, without any the first file of polygons, or the first demo for none, and puts
    /// polygons and a transfer function among them into it; the other volumes are remembered.
    pub fn open_all(&mut self, ctx: &Context, sources: Vec<Source>) {
        let (mut companions, mut volumes): (Vec<_>, Vec<_>) =
            sources.into_iter().partition(is_companion);
        if let Some(at) = companions.iter().position(is_of_polygons).filter(|_| volumes.is_empty())
        {
            volumes.push(companions.remove(at));
        }
        for other in volumes.iter().skip(1).rev() {
            self.remember(other);
        }
        let others: Vec<String> = volumes.iter().skip(1).map(Source::name).collect();
        let demo = || Some(Source::Demo(self.parts.library.demos().first()?.0.to_owned()));
        if let Some(first) = volumes.first().cloned().or_else(demo) {
            self.open(ctx, first);
        }
        if let Some(loading) = &mut self.loading {
            let paths = companions.iter().filter_map(Source::path);
            loading.companions = paths.map(Path::to_owned).collect();
            loading.others = others;
        }
    }

    /// Starts to make another field of the open file ready.
    pub(super) fn choose_field(&mut self, ctx: &Context, choice: FieldChoice) {
        let Some(document) = self.document.clone() else { return };
        let source = document.source.clone();
        let library = Arc::clone(&self.parts.library);
        let job = Job::start("field", "Preparing the field", ctx, move |ticket| {
            document.with_field(&*library, choice.field, choice.component, ticket)
        });
        self.loading = Some(Loading {
            job,
            source,
            keep_view: true,
            companions: Vec::new(),
            others: Vec::new(),
        });
    }

    /// The scene in which a newly opened document is seen.
    fn show_document(&mut self, ctx: &Context, document: Document, keep_view: bool) {
        // What is still in the hand is a step of its own.
        self.record_now(ctx);
        let volume = Arc::clone(&document.volume);
        let look = document.first_look.clone();
        // What nobody changed is the next file's to choose.
        let last = self.document.as_ref().map(|document| document.first_look.clone());
        let before = self.scene.take();
        let projection =
            before.as_ref().map_or(Projection::Orthographic, |scene| scene.camera.projection);
        let splat = match &before {
            Some(scene) if keep_view => scene.splat,
            Some(scene)
                if !last.as_ref().is_some_and(|last| {
                    // What quick pictures are of is kept in any case, and an extent in none.
                    let SplatSettings { cut, extent, .. } = scene.splat;
                    let before = SplatSettings { cut, extent, ..last.splat };
                    modes::same_mode(&before, &scene.splat)
                }) =>
            {
                // The kernel is a habit; a unit distance and an extent belong to their data.
                SplatSettings { opacity_unit_distance: None, extent: None, ..scene.splat }
            }
            Some(scene) => SplatSettings { cut: scene.splat.cut, ..look.splat },
            None => {
                let cut = CutSettings { moving: self.moving, ..look.splat.cut };
                SplatSettings { cut, ..look.splat }
            }
        };
        let splat = if offers(&volume, splat.kernel) { splat } else { look.splat };
        let shading = match &before {
            Some(scene) if keep_view => scene.shading.clone(),
            // So are the lights; tables belong to their data.
            Some(scene) if last.is_none_or(|last| last.lighting != scene.shading.lighting) => {
                Shading { lighting: scene.shading.lighting.clone(), ..Shading::default() }
            }
            _ => Shading { lighting: look.lighting, ..Shading::default() },
        };
        // What was cut away of another volume is not of this one.
        let inside = match &before {
            Some(scene) if keep_view => {
                let projected_range = projected_range(&volume, scene.inside.along);
                Inside { projected_range, ..scene.inside.clone() }
            }
            _ => Inside::default(),
        };
        let background = self.settings.scene_background();
        let path = document.source.key();
        let name = document.grid.fields.get(document.field).map_or("", |field| &field.name);
        let source = SampleSource::component(&path, name, document.component);
        let map = match look.transfer.colour {
            ColourSource::Map { map, .. } => map,
            ColourSource::Stops(_) => ByArray::FIRST_MAP,
        };
        // No outlier decides their colours.
        let range = presets::range(&volume.statistics, RangeRule::Percentiles);
        let field = (Sampled::Volume(volume), Look::Field(look.transfer));
        let camera = before.as_ref().filter(|_| keep_view).map(|scene| scene.camera);
        let unframed = Camera { projection, ..Camera::new(DVec3::ZERO, DVec3::Y, DVec3::Z, 1.0) };
        let seen_by = Scene::seen_by(camera.unwrap_or(unframed));
        // The axis that was chosen to be up stays so for the session.
        let up = before.as_ref().and_then(|scene| scene.up);
        let opening = Scene { splat, shading, inside, background, up, ..seen_by };
        // Vectors and polygons are in the world of their file.
        let kept = before.filter(|_| keep_view);
        let has_vectors = kept.as_ref().is_some_and(|scene| !scene.vectors().is_empty());
        let mut scene = match kept {
            Some(before) => before.with_other_field(opening, source, field),
            None => {
                let mut scene = opening;
                scene.add(source, field);
                scene
            }
        };
        if let Some(field) = document.vectors.as_ref().filter(|_| !has_vectors) {
            let source = SampleSource::whole(&path, &field.name);
            let field = Arc::clone(field);
            let layer = match document.flows {
                true => VectorLayer::flowing(field),
                false => VectorLayer::new(field),
            };
            scene.add(source, layer);
            scene.show_field(false);
        }
        if let Some((mesh, name)) = &document.surface {
            let source = SampleSource::whole(&path, mesh.name());
            let layer =
                PolygonLayer::of_surface(Arc::clone(mesh), name.as_deref(), map, Some(range));
            show_surface(&mut scene, source, layer);
            // Its colours are there, unless somebody closed the section.
            self.settings.sections.entry(POLYGONS.to_owned()).or_insert(true);
        }
        if !keep_view {
            self.leave_file(ctx, &document);
            // Points of another file's world.
            self.flow.choice.ends = None;
            self.vectors.clock.set_running(document.flows, ctx.time());
        }
        self.scene = Some(scene);
        self.gaussians.clear();
        self.transfer.start_over();
        self.shading.start_over();
        self.clip.start_over();
        self.tell_of_file(&document, keep_view);
        self.document = Some(document);
        if camera.is_none() {
            self.fit(look.view);
        }
    }

    /// Tells what there is to know of a file, of another field of it what is new, where no list of it is in sight.
    fn tell_of_file(&mut self, document: &Document, is_same_file: bool) {
        let told = self.document.as_ref().filter(|_| is_same_file);
        let told = told.map_or(&[][..], |document| &document.warnings[..]);
        let mut news = document.warnings.iter().filter(|note| !told.contains(note));
        let are_listed = self.settings.side_panel && is_open(&self.settings.sections, DATA);
        if let Some(first) = news.next().filter(|_| !are_listed) {
            let others = news.count();
            let rest = if others == 0 {
                String::new()
            } else {
                format!(". And {others} more, under Data")
            };
            self.notices.note(format!("{first}{rest}"));
        }
        let vectors = document.first_vectors().and_then(|at| document.grid.fields.get(at));
        let is_news = !is_same_file && document.vectors.is_none() && document.surface.is_none();
        if let Some(vectors) = vectors.filter(|_| is_news) {
            let name = &vectors.name;
            self.notices.offer(Action::ShowVectors, format!("This file has vectors, too: {name}"));
        }
    }

    /// Lets go of what belongs to the file that was open, before another is shown.
    pub(super) fn leave_file(&mut self, ctx: &Context, other: &Document) {
        self.views = History::default();
        self.vectors = Vectors::default();
        self.flow.job = None;
        self.encoding = None;
        self.unfinished.clear();
        self.shading.start_over();
        self.clip.start_over();
        let title = format!("{} – Voxsplat", other.source.name());
        ctx.send_viewport_cmd(ViewportCommand::Title(title));
    }

    pub(super) fn take_document(&mut self, ctx: &Context) {
        let Some(ended) = self.loading.as_ref().and_then(|loading| loading.job.poll()) else {
            return;
        };
        let Some(loading) = self.loading.take() else { return };
        match ended {
            // A cancel that came too late still is one.
            _ if loading.job.is_cancelled() => {}
            Ended::Finished(Ok(document)) => {
                self.unopened = None;
                if !loading.keep_view {
                    self.notices.clear();
                    self.remember(&loading.source);
                }
                if !loading.others.is_empty() {
                    self.notices.note(format!(
                        "Only one volume can be open. Not opened: {} (see File, Open recent). To lay a segmentation over \
                         the volume, choose Add labels…",
                        loading.others.join(", ")
                    ));
                }
                self.show_document(ctx, document, loading.keep_view);
                for path in loading.companions {
                    self.open_any(ctx, path);
                }
                return;
            }
            Ended::Finished(Err(ReadFailure::Cancelled)) => {}
            Ended::Finished(Err(ReadFailure::Refused(reason))) => {
                self.notices.error(reason);
                self.unopened = Some(loading.source);
            }
            Ended::Finished(Err(ReadFailure::NotRecognised(reason))) => {
                match loading.source.path() {
                    Some(path) => self.ask_raw_layout(path, None, Some(reason)),
                    None => self.notices.error(reason),
                }
            }
            Ended::Finished(Err(ReadFailure::Foreign(what))) => {
                let name = loading.source.name();
                self.notices.error(format!(
                    "This is {what}; Voxsplat cannot read it. If it holds bare samples, say how they lie \
                     under File, Raw layout…: {name}"
                ));
                self.undescribed = loading.source.path().map(Path::to_owned);
                self.unopened = Some(loading.source);
            }
            Ended::Lost => {
                let name = loading.source.name();
                self.notices.error(format!("Reading stopped on a bug of the program: {name}"));
            }
        }
        for path in loading.companions {
            let path = path.display();
            self.notices.note(format!("Left out, as there is no volume to put it into: {path}"));
        }
    }

    fn remember(&mut self, source: &Source) {
        if let Some(path) = source.path() {
            let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
            self.settings.remember(path);
        }
    }

    /// Asks for a path, beginning with the one that could not be opened.
    pub(super) fn ask_for_path(&mut self) {
        let text = self.unopened.as_ref().map(|source| source.key().display().to_string());
        self.dialog = Some(Dialog::OpenPath(OpenPath::new(text.unwrap_or_default())));
    }

    pub(super) fn take_chosen_file(&mut self, ctx: &Context) {
        let Some(answer) = self.file_dialog.as_ref().and_then(FileDialog::poll) else { return };
        self.file_dialog = None;
        match answer {
            Answer::Chosen(path) => self.open_any(ctx, path),
            Answer::Cancelled => {}
            Answer::Unavailable => {
                self.notices.error(
                    "The file dialog could not open because no desktop portal answered; \
                     type the path, or drop the file on the window",
                );
                self.ask_for_path();
            }
        }
    }

    pub(super) fn take_dropped_files(&mut self, ctx: &Context) {
        let dropped: Vec<PathBuf> = ctx.input(|input| {
            input.raw.dropped_files.iter().map(|file| file.path().to_owned()).collect()
        });
        if let Some(path) = dropped.first() {
            if dropped.len() > 1 {
                let more = dropped.len() - 1;
                self.notices.hint(format!("One file opens at a time; {more} more were left out"));
            }
            self.open_any(ctx, path.clone());
        }
    }

    fn ask_raw_layout(&mut self, path: &Path, layout: Option<RawLayout>, reason: Option<String>) {
        match RawDialog::new(&*self.parts.library, path, layout, reason) {
            Ok(dialog) => self.dialog = Some(Dialog::Raw(Box::new(dialog))),
            Err(reason) => self.notices.error(reason),
        }
    }

    pub(super) fn ask_raw_layout_again(&mut self) {
        if let Some(path) = self.undescribed.take() {
            self.ask_raw_layout(&path, None, None);
            return;
        }
        let source = self.document.as_ref().map(|document| document.source.clone());
        match source {
            Some(Source::Raw(path, layout)) => self.ask_raw_layout(&path, Some(layout), None),
            Some(Source::File(path)) => self.ask_raw_layout(&path, None, None),
            Some(Source::Demo(_)) | None => {
                self.notices.hint("Only a file has a layout to describe: open one first");
            }
        }
    }
}
