//! Pictures to files: the one on screen at once, or one drawn anew at any size.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui::Context;
use image::{ImageFormat, RgbaImage};

use super::job::Job;
use crate::core::Ticket;
use crate::scene::annotations::Primitive;
use crate::scene::{Annotations, Scene};
use crate::task::annotations;
use crate::task::engine::{Choice, Engine, Picture};
use crate::task::loop_file::{self, Cycle, LoopError, LoopFormat};
use crate::task::output_file::OutputFile;
use crate::task::picture_file::{self, PictureFormat};
use crate::task::still::{Refine, StillError, StillRequest};
use crate::task::transfer_file;

/// A picture to be drawn and saved.
#[derive(Debug, Clone)]
pub struct SaveRequest {
    /// What is to be seen, its background included.
    pub scene: Scene,
    /// Size in pixels, each at least 1.
    pub size: [u32; 2],
    /// What is written over it, where it is a PNG.
    pub annotations: Annotations,
    /// What the file calls its space, for the axes.
    pub space: Option<String>,
    /// Where to; the extension (`png` or `exr`) names the format.
    pub path: PathBuf,
    /// A whole cycle of the animation rather than one picture.
    pub cycle: Option<Cycle>,
    /// Whether to smooth the edges of one picture.
    pub smooth_edges: bool,
}

/// Draws and saves pictures away from the screen, or a stand-in for that in tests.
///
/// It runs on a job's thread, reports to the ticket, and returns a sentence for people when it
/// fails. A cancelled one writes nothing.
pub type Renderer = Arc<dyn Fn(&SaveRequest, &Ticket) -> Result<(), String> + Send + Sync>;

/// Pictures from an engine of its own, so that the one on screen goes on undisturbed.
pub fn engine_renderer(choice: Choice) -> Renderer {
    Arc::new(move |request, ticket| {
        if let Some(cycle) = request.cycle {
            let engine = Engine::start(choice.clone(), || ());
            let SaveRequest { scene, size, annotations: chosen, space, path, .. } = request;
            let written = annotations::laid_out(*chosen, scene, space.as_deref(), *size).primitives;
            let pictures = (*size, &written[..]);
            return match loop_file::write(&engine, scene, pictures, cycle, path, ticket) {
                Ok(_) | Err(LoopError::Cancelled) => Ok(()),
                Err(error) => Err(error.to_string()),
            };
        }
        let format = PictureFormat::of(&request.path)?;
        let engine = Engine::start(choice.clone(), || ());
        let still = StillRequest {
            scene: request.scene.clone(),
            size: request.size,
            refine: Refine::Full,
            repeat: 0,
            time_passes: false,
            smooth_edges: request.smooth_edges,
        };
        match engine.still(still, ticket) {
            Ok(mut still) => {
                let SaveRequest { scene, size, annotations: chosen, space, .. } = request;
                if format == PictureFormat::Png {
                    let layout = annotations::laid_out(*chosen, scene, space.as_deref(), *size);
                    annotations::draw(&mut still.rgba, *size, &layout.primitives);
                }
                picture_file::write(&still, format, &request.path)
            }
            Err(StillError::Cancelled) => Ok(()),
            Err(error) => Err(error.to_string()),
        }
    })
}

/// The files that a job has written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The first of them.
    pub first: PathBuf,
    /// Numbered ones after it.
    pub others: usize,
}

impl Written {
    pub(super) fn of(path: &Path, cycle: Option<Cycle>) -> Self {
        let numbered = cycle.and_then(|cycle| Some((LoopFormat::of(path).ok()?, cycle)));
        let mut paths = match numbered {
            Some((format, cycle)) => loop_file::paths(path, format, cycle).into_iter(),
            None => vec![path.to_owned()].into_iter(),
        };
        let first = paths.next().unwrap_or_else(|| path.to_owned());
        Self { first, others: paths.len() }
    }
}

impl std::fmt::Display for Written {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.first.display(), self.others) {
            (first, 0) => write!(f, "{first}"),
            (first, others) => write!(f, "{first} and {others} more after it"),
        }
    }
}

/// What a job has written, or one sentence why there is nothing.
pub type Saved = Result<Written, String>;

/// Draws and saves in the background.
pub fn save_picture(ctx: &Context, renderer: &Renderer, request: SaveRequest) -> Job<Saved> {
    let renderer = Arc::clone(renderer);
    let times = request.cycle.map_or(String::new(), |cycle| format!("{} times ", cycle.frames));
    let title = format!("Drawing {times}{} × {} pixels", request.size[0], request.size[1]);
    Job::start("save-picture", title, ctx, move |ticket| {
        make_folder_of(&request.path)?;
        renderer(&request, ticket)?;
        Ok(Written::of(&request.path, request.cycle))
    })
}

/// Saves a picture as it is, with what is written over it, under the next free name in `folder`.
pub fn save_screenshot(
    ctx: &Context,
    picture: Arc<Picture>,
    written: Vec<Primitive>,
    folder: &Path,
    name: &str,
) -> Job<Saved> {
    let (folder, name) = (folder.to_owned(), file_stem(name));
    Job::start("save-screenshot", "Saving the screenshot", ctx, move |_| {
        let path = next_free(&folder, &name, "png");
        make_folder_of(&path)?;
        write_png(&picture, &written, &path).map(|()| Written { first: path, others: 0 })
    })
}

/// Writes a picture as PNG, with annotations over it.
///
/// # Errors
/// One sentence for people.
pub fn write_png(picture: &Picture, written: &[Primitive], path: &Path) -> Result<(), String> {
    let [width, height] = picture.size;
    let mut rgba = picture.rgba.clone();
    annotations::draw(&mut rgba, picture.size, written);
    let image = RgbaImage::from_raw(width, height, rgba)
        .ok_or_else(|| format!("a picture of {width} × {height} pixels came incomplete"))?;
    let place = OutputFile::check(path, "the picture")?;
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).map_err(|error| {
        format!("the picture could not be encoded: {error}: {}", path.display())
    })?;
    place.write(bytes.get_ref())
}

/// The default name of a saved picture or loop: `{folder}/{name}.{extension}`, and with the first free number where that is taken.
pub fn suggested_path(folder: &Path, name: &str, extension: &str) -> PathBuf {
    let stem = file_stem(name);
    let plain = folder.join(format!("{stem}.{extension}"));
    if plain.exists() { next_free(folder, &stem, extension) } else { plain }
}

/// The default name of a saved transfer function: `{folder}/{name}_transfer.json`.
pub fn suggested_transfer_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{}_transfer.{}", file_stem(name), transfer_file::EXTENSION))
}

fn make_folder_of(path: &Path) -> Result<(), String> {
    let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|error| {
        format!(
            "expected a folder to save into, found that it cannot be made ({error}); choose \
                 another place: {}",
            folder.display()
        )
    })
}

/// The first of `{folder}/{stem}_{n}.{extension}`, n = 1, 2, …, that does not exist.
fn next_free(folder: &Path, stem: &str, extension: &str) -> PathBuf {
    let candidates = (1_u32..).map(|n| folder.join(format!("{stem}_{n}.{extension}")));
    // Four thousand million screenshots of one file are not expected.
    candidates.into_iter().find(|path| !path.exists()).unwrap_or_default()
}

/// A file name made of a volume's name: no extension, no separators.
pub(super) fn file_stem(name: &str) -> String {
    let stem = match name.strip_prefix(super::document::DEMO_PREFIX) {
        Some(demo) => demo,
        None => {
            // What a file is compressed with stands behind what it is.
            let plain = [".gz", ".bz2"].iter().find_map(|end| name.strip_suffix(end));
            let plain = plain.unwrap_or(name);
            plain.rsplit_once('.').map_or(plain, |(stem, _)| stem)
        }
    };
    let safe = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let stem: String = stem.chars().map(safe).collect();
    if stem.trim_matches(['_', '.']).is_empty() { "volume".to_owned() } else { stem }
}

/// `voxsplat` in the person's pictures folder.
///
/// # Errors
/// One sentence when there is no home folder.
pub fn pictures_folder() -> Result<PathBuf, String> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
    let home = variable("HOME").or_else(|| variable("USERPROFILE")).map(PathBuf::from);
    let pictures = variable("XDG_PICTURES_DIR")
        .map(PathBuf::from)
        .or_else(|| {
            let home = home.as_ref()?;
            let config = variable("XDG_CONFIG_HOME").map_or(home.join(".config"), PathBuf::from);
            let dirs = std::fs::read_to_string(config.join("user-dirs.dirs")).ok()?;
            pictures_in_user_dirs(&dirs, home)
        })
        .or_else(|| Some(home.as_ref()?.join("Pictures")))
        .ok_or("no home folder is known; set XDG_PICTURES_DIR to a folder for pictures")?;
    Ok(pictures.join("voxsplat"))
}

/// The pictures folder that a `user-dirs.dirs` file names.
fn pictures_in_user_dirs(text: &str, home: &Path) -> Option<PathBuf> {
    let value = text.lines().find_map(|line| line.trim().strip_prefix("XDG_PICTURES_DIR="))?;
    let value = value.trim().trim_matches('"');
    match value.strip_prefix("$HOME") {
        Some(rest) => Some(home.join(rest.trim_start_matches('/'))),
        None => value.starts_with('/').then(|| PathBuf::from(value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_volumes_become_names_of_files() {
        assert_eq!(file_stem("tooth.nrrd"), "tooth");
        assert_eq!(file_stem("CT_pitch.nii.gz"), "CT_pitch");
        assert_eq!(file_stem("scan.gz"), "scan");
        assert_eq!(file_stem("demo:tornado"), "tornado");
        assert_eq!(file_stem("a b/c.raw"), "a_b_c");
        assert_eq!(file_stem("..."), "volume");
        assert_eq!(file_stem(""), "volume");
    }

    #[test]
    fn screenshots_never_overwrite_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let first = next_free(folder.path(), "tooth", "png");
        assert_eq!(first, folder.path().join("tooth_1.png"));
        std::fs::write(&first, b"").unwrap();
        assert_eq!(next_free(folder.path(), "tooth", "png"), folder.path().join("tooth_2.png"));
    }

    #[test]
    fn a_saved_picture_has_the_files_name_and_a_number_where_that_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let suggested = |extension| suggested_path(folder.path(), "can.vtu", extension);
        for name in ["can.png", "can_1.png", "can_2.png"] {
            assert_eq!(suggested("png"), folder.path().join(name));
            std::fs::write(suggested("png"), b"").unwrap();
        }
        assert_eq!(suggested("gif"), folder.path().join("can.gif"), "which is free");
    }

    #[test]
    fn what_was_saved_is_told_by_the_names_that_it_has() {
        let told = |path: &str, cycle| Written::of(Path::new(path), cycle).to_string();
        let cycle = Some(Cycle { frames: 32, seconds: 3.0 });
        assert_eq!(told("/a/p.png", None), "/a/p.png");
        assert_eq!(told("/a/loop.gif", cycle), "/a/loop.gif");
        assert_eq!(told("/a/loop.png", cycle), "/a/loop-000.png and 31 more after it");
    }

    #[test]
    fn the_pictures_folder_is_read_from_the_desktops_own_file() {
        let home = Path::new("/home/someone");
        let text = "# made by xdg\nXDG_MUSIC_DIR=\"$HOME/M\"\nXDG_PICTURES_DIR=\"$HOME/Bilder\"\n";
        assert_eq!(pictures_in_user_dirs(text, home), Some(home.join("Bilder")));
        let absolute = "XDG_PICTURES_DIR=\"/data/p\"";
        assert_eq!(pictures_in_user_dirs(absolute, home), Some("/data/p".into()));
        assert_eq!(pictures_in_user_dirs("XDG_PICTURES_DIR=\"relative\"", home), None);
    }

    #[test]
    fn a_saved_picture_holds_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.png");
        let rgba: Vec<u8> = (0..2 * 3 * 4).map(|i| (i * 10) as u8).collect();
        let level = crate::task::level::LevelOfDetail::FULL;
        let backend = crate::scene::Backend::Raster;
        let report = crate::task::engine::FrameReport::last(level, 1, backend, 1.0);
        let picture = Picture { size: [2, 3], requested_size: [2, 3], rgba: rgba.clone(), report };
        write_png(&picture, &[], &path).unwrap();
        assert_eq!(image::open(&path).unwrap().to_rgba8().into_raw(), rgba);
        assert!(write_png(&picture, &[], &folder.path().join("none/p.png")).is_err());
    }
}
