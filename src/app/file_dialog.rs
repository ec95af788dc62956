//! The system's file dialog, off the window's thread.
//!
//! On Linux it is a service (the desktop portal) that may be missing. Then the answer comes back
//! empty at once, faster than a hand could cancel.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use eframe::egui::Context;

use super::job::{Ended, Job};
use crate::io::mesh::MeshFormat;
use crate::task::transfer_file::EXTENSION;

/// An empty answer within this time means that no dialog ever appeared.
const FASTER_THAN_A_HAND: Duration = Duration::from_millis(700);

/// What came of asking.
#[derive(Debug, PartialEq, Eq)]
pub enum Answer {
    /// A file was chosen.
    Chosen(PathBuf),
    /// The dialog was closed without a choice.
    Cancelled,
    /// There was no dialog.
    Unavailable,
}

/// A dialog on screen, or on its way there.
pub struct FileDialog {
    job: Job<(Option<PathBuf>, Duration)>,
}

impl FileDialog {
    /// Asks for a file to open.
    pub fn open(ctx: &Context) -> Self {
        let extensions = [
            "nrrd", "nhdr", "mha", "mhd", "vti", "vtr", "vts", "vtu", "vtp", "pvtu", "pvtp", "vtk",
            "nc", "ex2", "exo", "e", "g", "nii", "gz", "hdr", "img", "npy", "npz", "dcm", "tif",
            "tiff", "h5", "hdf5", "nc4", "mrc", "map", "ccp4", "rec", "st", "xyz", "x", "q", "p3d",
            "grd", "f", "fun", "fn", "bin", "txt", "csv", "tsv", "asc", "stl", "ply", "obj",
            "vrbf", "raw",
        ];
        let dialog = rfd::AsyncFileDialog::new()
            .set_title("Open a volume")
            .add_filter("Volumes", &extensions)
            .add_filter("All files", &["*"]);
        // The future is made here because some systems insist on the window's thread.
        Self::wait_for(ctx, dialog.pick_file())
    }

    /// Asks for a folder to open: of a DICOM series, of Zarr, or of pictures.
    pub fn open_folder(ctx: &Context) -> Self {
        let dialog = rfd::AsyncFileDialog::new().set_title("Open a folder");
        Self::wait_for(ctx, dialog.pick_folder())
    }

    /// Asks for polygons to embed.
    pub fn open_mesh(ctx: &Context) -> Self {
        let dialog = rfd::AsyncFileDialog::new()
            .set_title("Add polygons")
            .add_filter("Polygons", &MeshFormat::EXTENSIONS)
            .add_filter("All files", &["*"]);
        Self::wait_for(ctx, dialog.pick_file())
    }

    /// Asks where to save a picture, with a suggested name.
    pub fn save(ctx: &Context, suggestion: &str) -> Self {
        let dialog = rfd::AsyncFileDialog::new()
            .set_title("Save the picture")
            .set_file_name(suggestion)
            .add_filter("PNG picture", &["png"])
            .add_filter("OpenEXR picture, linear", &["exr"]);
        Self::wait_for(ctx, dialog.save_file())
    }

    /// Asks for a transfer function to load.
    pub fn open_transfer(ctx: &Context) -> Self {
        let dialog = transfer_dialog("Load a transfer function");
        Self::wait_for(ctx, dialog.pick_file())
    }

    /// Asks where to save a transfer function; `suggestion` has a name, and perhaps a folder.
    pub fn save_transfer(ctx: &Context, suggestion: &Path) -> Self {
        let dialog = transfer_dialog("Save the transfer function");
        Self::wait_for(ctx, named_so(dialog, suggestion).save_file())
    }

    /// Asks where to save basis functions; `suggestion` has a name, and perhaps a folder.
    pub fn save_encoding(ctx: &Context, suggestion: &Path) -> Self {
        let dialog = rfd::AsyncFileDialog::new()
            .set_title("Save the basis functions")
            .add_filter("Basis functions", &["vrbf"]);
        Self::wait_for(ctx, named_so(dialog, suggestion).save_file())
    }

    /// A dialog that gives this answer at once, for tests of whoever asks.
    pub fn answering(ctx: &Context, path: Option<PathBuf>) -> Self {
        Self::wait_for_path(ctx, std::future::ready(path))
    }

    fn wait_for(
        ctx: &Context,
        answer: impl Future<Output = Option<rfd::FileHandle>> + Send + 'static,
    ) -> Self {
        Self::wait_for_path(ctx, async { answer.await.map(|handle| handle.path().to_owned()) })
    }

    fn wait_for_path(
        ctx: &Context,
        answer: impl Future<Output = Option<PathBuf>> + Send + 'static,
    ) -> Self {
        let job = Job::start("file-dialog", "Choosing a file", ctx, move |_| {
            let start = Instant::now();
            let chosen = pollster::block_on(answer);
            (chosen, start.elapsed())
        });
        Self { job }
    }

    /// Puts the answer of a dialog where paths are typed, once there is one, and lets go of it.
    pub fn take_path(
        asked: &mut Option<Self>,
        path: &mut String,
        trouble: &mut Option<&'static str>,
    ) {
        let Some(answer) = asked.as_ref().and_then(Self::poll) else { return };
        *asked = None;
        match answer {
            Answer::Chosen(chosen) => *path = chosen.display().to_string(),
            Answer::Cancelled => {}
            Answer::Unavailable => {
                *trouble = Some("The file dialog could not open; type the path instead");
            }
        }
    }

    /// The answer, once there is one.
    pub fn poll(&self) -> Option<Answer> {
        Some(match self.job.poll()? {
            Ended::Finished((path, after)) => interpret(path, after),
            Ended::Lost => Answer::Unavailable,
        })
    }
}

/// A dialog that suggests a name, and perhaps a folder.
fn named_so(dialog: rfd::AsyncFileDialog, suggestion: &Path) -> rfd::AsyncFileDialog {
    let name = suggestion.file_name().unwrap_or_default().to_string_lossy();
    let dialog = dialog.set_file_name(name);
    match suggestion.parent() {
        Some(folder) => dialog.set_directory(folder),
        None => dialog,
    }
}

fn transfer_dialog(title: &str) -> rfd::AsyncFileDialog {
    let dialog = rfd::AsyncFileDialog::new().set_title(title);
    dialog.add_filter("Transfer functions", &[EXTENSION]).add_filter("All files", &["*"])
}

fn interpret(path: Option<PathBuf>, after: Duration) -> Answer {
    match path {
        Some(path) => Answer::Chosen(path),
        None if after < FASTER_THAN_A_HAND => Answer::Unavailable,
        None => Answer::Cancelled,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_answer_that_no_hand_could_give_means_there_was_no_dialog() {
        assert_eq!(interpret(None, Duration::from_millis(30)), Answer::Unavailable);
        assert_eq!(interpret(None, Duration::from_secs(4)), Answer::Cancelled);
        let path = PathBuf::from("a");
        assert_eq!(interpret(Some(path.clone()), Duration::ZERO), Answer::Chosen(path));
    }
}
