//! One whole cycle of animated vectors as a file: it runs on without a seam, because phase is cyclic.

use std::path::{Path, PathBuf};

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};

use super::annotations;
use super::engine::Engine;
use super::output_file::OutputFile;
use super::picture_file::{self, PictureFormat};
use super::still::{Refine, Still, StillError, StillRequest};
use crate::core::memory;
use crate::core::{Ticket, plain_number};
use crate::scene::Scene;
use crate::scene::annotations::Primitive;

/// Most pictures of a cycle.
pub const MOST_FRAMES: u32 = 999;
/// Speed of the search for 256 colours, 1 (best) to 30: at 10 a picture takes about as long as drawing it.
const GIF_SPEED: i32 = 10;
/// What memory holds of a loop.
const PICTURES: &str = "the pictures of the loop";

/// How a cycle becomes pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Pictures, 2 to [`MOST_FRAMES`].
    pub frames: u32,
    /// Seconds that all of them are shown.
    pub seconds: f64,
}

impl Default for Cycle {
    /// Two pictures a phase of the table, in 3 s.
    fn default() -> Self {
        Self { frames: 32, seconds: 3.0 }
    }
}

/// A loop's format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopFormat {
    /// Animated, with 256 colours a picture.
    Gif,
    /// Numbered pictures: NAME-000.png, NAME-001.png, …
    Pngs,
}

impl LoopFormat {
    /// The format that a file name's extension asks for.
    ///
    /// # Errors
    /// One sentence for any other extension.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("gif") => Ok(Self::Gif),
            Some("png") => Ok(Self::Pngs),
            _ => Err(format!(
                "expected a loop's name that ends in .gif, or in .png for numbered pictures, found \
                 another; choose such a name: {}",
                path.display()
            )),
        }
    }
}

/// The files that a loop will be: one, or one a picture.
pub fn paths(path: &Path, format: LoopFormat, cycle: Cycle) -> Vec<PathBuf> {
    match format {
        LoopFormat::Gif => vec![path.to_owned()],
        LoopFormat::Pngs => {
            // Names need not be text.
            let named = |i: u32| {
                let mut name = path.file_stem().unwrap_or_default().to_owned();
                name.push(format!("-{i:03}.png"));
                path.with_file_name(name)
            };
            (0..cycle.frames).map(named).collect()
        }
    }
}

/// Why there is no loop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopError {
    /// The ticket.
    #[error("cancelled")]
    Cancelled,
    /// One sentence, with the path last.
    #[error("{0}")]
    File(String),
    /// A picture that could not be drawn.
    #[error(transparent)]
    Still(StillError),
}

impl From<StillError> for LoopError {
    fn from(error: StillError) -> Self {
        match error {
            StillError::Cancelled => Self::Cancelled,
            other => Self::Still(other),
        }
    }
}

/// Draws a cycle that begins at the scene's phase, `written` over each of its pictures, and writes it;
/// nothing is written of one that is cancelled. Returns the milliseconds of each picture.
///
/// # Errors
/// See [`LoopError`].
pub fn write(
    engine: &Engine,
    scene: &Scene,
    (size, written): ([u32; 2], &[Primitive]),
    cycle: Cycle,
    path: &Path,
    ticket: &Ticket,
) -> Result<Vec<f64>, LoopError> {
    let format = LoopFormat::of(path).map_err(LoopError::File)?;
    let is_sound = (2..=MOST_FRAMES).contains(&cycle.frames) && cycle.seconds > 0.0;
    if !is_sound {
        return Err(LoopError::File(format!(
            "expected a loop of 2 to {MOST_FRAMES} pictures in more than 0 seconds, found {} in {}: {}",
            cycle.frames,
            plain_number(cycle.seconds),
            path.display()
        )));
    }
    if format == LoopFormat::Gif {
        check_gif(size, cycle)
            .map_err(|sentence| LoopError::File(format!("{sentence}: {}", path.display())))?;
        // All of them are kept until the last one is drawn; numbered ones are packed.
        let each = u64::from(size[0]) * u64::from(size[1]) * 4;
        let needed = each.saturating_mul(u64::from(cycle.frames));
        memory::require(PICTURES, needed, memory::free_bytes()).map_err(StillError::TooLarge)?;
    }
    // Places that cannot be written to are found before anything is drawn.
    let places: Vec<OutputFile> = paths(path, format, cycle)
        .iter()
        .map(|path| OutputFile::check(path, "the loop"))
        .collect::<Result<_, _>>()
        .map_err(LoopError::File)?;
    let mut pictures = Vec::new();
    let mut frame_ms = Vec::new();
    for i in 0..cycle.frames {
        let mut still = frame(engine, scene, size, (i, cycle.frames), ticket)?;
        frame_ms.extend(still.frame_ms.first());
        annotations::draw(&mut still.rgba, size, written);
        pictures.push(match format {
            LoopFormat::Gif => still.rgba,
            LoopFormat::Pngs => {
                picture_file::bytes(&still, PictureFormat::Png).map_err(LoopError::File)?
            }
        });
    }
    match format {
        LoopFormat::Pngs => {
            for (place, bytes) in places.iter().zip(&pictures) {
                place.write(bytes).map_err(LoopError::File)?;
            }
        }
        LoopFormat::Gif => {
            let bytes = gif(pictures, size, cycle).map_err(|error| {
                LoopError::File(format!(
                    "the loop could not be encoded: {error}: {}",
                    path.display()
                ))
            })?;
            if let Some(place) = places.first() {
                place.write(&bytes).map_err(LoopError::File)?;
            }
        }
    }
    Ok(frame_ms)
}

fn frame(
    engine: &Engine,
    scene: &Scene,
    size: [u32; 2],
    (i, frames): (u32, u32),
    ticket: &Ticket,
) -> Result<Still, StillError> {
    let mut scene = scene.clone();
    scene.phase += f64::from(i) / f64::from(frames);
    let request = StillRequest {
        scene,
        size,
        refine: Refine::Full,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    };
    engine.still(request, &ticket.part(i, frames))
}

/// Refuses what a GIF cannot be: sizes of more than two bytes, and pictures that are shown for none of its hundredths of a second,
/// or for more than two bytes of them.
fn check_gif(size: [u32; 2], cycle: Cycle) -> Result<(), String> {
    const MOST: u32 = u16::MAX as u32;
    if let Some(found) = size.into_iter().find(|side| *side > MOST) {
        return Err(format!(
            "expected at most {MOST} pixels along a side of a GIF, found {found}; choose a smaller --resolution, or write to a \
             name that ends in .png"
        ));
    }
    let each = cycle.seconds / f64::from(cycle.frames);
    if (1.0..=f64::from(MOST)).contains(&(100.0 * each)) {
        return Ok(());
    }
    let [least, most] = [0.01, 655.35].map(|each| plain_number(each * f64::from(cycle.frames)));
    Err(format!(
        "expected {least} to {most} seconds for {} pictures of a GIF, which are shown for 0.01 to 655.35 each, found {}; choose \
         another --loop-seconds or another number",
        cycle.frames,
        plain_number(cycle.seconds)
    ))
}

fn gif(
    pictures: Vec<Vec<u8>>,
    [width, height]: [u32; 2],
    cycle: Cycle,
) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut bytes, GIF_SPEED);
    encoder.set_repeat(Repeat::Infinite)?;
    // Hundredths of a second is what the format counts in: the rest is carried on.
    let hundredths = |i: u32| {
        let share = f64::from(i) / f64::from(cycle.frames);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 999 times 65 535: checked"
        )]
        let time = (cycle.seconds * 100.0 * share).round() as u32;
        time
    };
    for (i, rgba) in (0..).zip(pictures) {
        let Some(image) = RgbaImage::from_raw(width, height, rgba) else { continue };
        let shown = hundredths(i + 1) - hundredths(i);
        let delay = Delay::from_numer_denom_ms(shown * 10, 1);
        encoder.encode_frame(Frame::from_parts(image, 0, 0, delay))?;
    }
    drop(encoder);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use image::AnimationDecoder;

    use super::*;

    #[test]
    fn a_gif_has_every_picture_and_takes_as_long_as_asked() {
        let cycle = Cycle { frames: 7, seconds: 1.0 };
        let picture = |i: u8| [i * 30, 0, 255 - i * 30, 255].repeat(6);
        let bytes = gif((0..7).map(picture).collect(), [3, 2], cycle).unwrap();
        let decoder = image::codecs::gif::GifDecoder::new(std::io::Cursor::new(bytes)).unwrap();
        let frames = decoder.into_frames().collect_frames().unwrap();
        assert_eq!(frames.len(), 7);
        let ms: u32 = frames.iter().map(|f| f.delay().numer_denom_ms().0).sum();
        assert_eq!(ms, 1000);
        assert!(frames[6].buffer().get_pixel(0, 0).0[0] > 150);
    }

    #[test]
    fn a_gif_is_refused_where_it_would_be_another_than_asked_for() {
        let check = |frames, seconds| check_gif([3, 2], Cycle { frames, seconds });
        assert_eq!((check(200, 2.0), check(2, 1310.7), check(32, 3.0)), (Ok(()), Ok(()), Ok(())));
        for (frames, seconds) in [(200, 1.99), (2, 1310.8), (2, 1e300), (2, 1e-320)] {
            let said = check(frames, seconds).unwrap_err();
            assert!(said.contains("expected ") && said.contains("--loop-seconds"), "{said}");
            assert!(said.len() < 220, "{said}");
        }
        let wide = check_gif([65_536, 1], Cycle::default()).unwrap_err();
        assert!(wide.contains("at most 65535 pixels") && wide.contains("found 65536"), "{wide}");
    }

    #[cfg(unix)]
    #[test]
    fn numbered_pictures_keep_a_name_that_is_no_text() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;

        let path = Path::new(OsStr::from_bytes(b"a/w\xffd.png"));
        let found = paths(path, LoopFormat::Pngs, Cycle { frames: 2, seconds: 1.0 });
        assert_eq!(found[1].as_os_str().as_bytes(), b"a/w\xffd-001.png");
    }

    #[test]
    fn numbered_pictures_keep_the_name() {
        let cycle = Cycle { frames: 2, seconds: 1.0 };
        let found = paths(Path::new("a/wind.png"), LoopFormat::Pngs, cycle);
        assert_eq!(found, [PathBuf::from("a/wind-000.png"), PathBuf::from("a/wind-001.png")]);
        assert!(LoopFormat::of(Path::new("a.webp")).unwrap_err().contains(".gif"));
    }
}
