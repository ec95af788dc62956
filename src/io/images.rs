//! A folder of pictures (TIFF, PNG, JPEG) as the slices of a volume, in the order of their names.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use super::error::{Problem, corrupt, quoted, unsupported};
use super::files;
use super::tiff::{self, Form, append};
use super::{Format, Opened};
use crate::core::memory;
use crate::core::panics::caught;
use crate::core::progress::Ticket;
use crate::volume::{Association, Field, Grid, Lattice, Samples, ScalarType};

/// More slices than this are no volume.
const MOST_FILES: usize = 1 << 16;
const EXTENSIONS: [&str; 5] = ["tif", "tiff", "png", "jpg", "jpeg"];

/// The pictures of a folder, as a person would count them: `slice9` before `slice10`.
pub(super) fn pictures(folder: &Path) -> Result<Vec<PathBuf>, Problem> {
    let entries = std::fs::read_dir(folder).map_err(Problem::from_opening)?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .map(|entry| entry.path())
        .filter(|path| {
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            let is_hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
            !is_hidden && EXTENSIONS.iter().any(|known| extension == *known) && path.is_file()
        })
        .collect();
    found.sort_by_cached_key(|path| {
        natural(&path.file_name().unwrap_or_default().to_string_lossy())
    });
    Ok(found)
}

/// A name in parts: words, and numbers by their value.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = Vec::new();
    let mut word = String::new();
    let mut characters = name.chars().peekable();
    while let Some(c) = characters.next() {
        let Some(digit) = c.to_digit(10) else {
            word.extend(c.to_lowercase());
            continue;
        };
        let mut number = u64::from(digit);
        while let Some(digit) = characters.peek().and_then(|c| c.to_digit(10)) {
            number = number.saturating_mul(10).saturating_add(u64::from(digit));
            characters.next();
        }
        parts.push((std::mem::take(&mut word), number));
    }
    parts.push((word, 0));
    parts
}

pub(super) fn read(folder: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let paths = pictures(folder)?;
    if paths.len() > MOST_FILES {
        return Err(unsupported(
            format!("a folder of at most {MOST_FILES} pictures"),
            paths.len().to_string(),
            "move some of them elsewhere",
        ));
    }
    let mut warnings = Vec::new();
    let mut whole: Option<(Form, Samples)> = None;
    let mut slices = 0;
    let mut others = Vec::new();
    for (index, path) in paths.iter().enumerate() {
        ticket.checkpoint(index as u64, paths.len() as u64)?;
        let (form, samples) = picture(path, free_bytes)?;
        match &mut whole {
            None => {
                let all = (samples.len() * form.scalar_type.size_bytes()) as u64;
                memory::require(
                    "the pictures",
                    all.saturating_mul(paths.len() as u64),
                    free_bytes,
                )?;
                whole = Some((form, samples));
                slices = 1;
            }
            Some((first, joined)) if *first == form => {
                append(joined, &samples)?;
                slices += 1;
            }
            Some(_) => {
                others.push(path.file_name().unwrap_or_default().to_string_lossy().into_owned())
            }
        }
    }
    let Some((form, samples)) = whole else {
        return Err(unsupported("a folder of pictures", "none", "choose the folder that has them"));
    };
    if others.len() >= slices {
        return Err(unsupported(
            "a folder of slices: pictures of one size and type",
            format!("{slices} of {} pictures like the first", paths.len()),
            "put the slices into a folder of their own",
        ));
    }
    if let Some(first) = others.first() {
        let (count, first) = (others.len(), quoted(first));
        let noun = if count == 1 { "picture" } else { "pictures" };
        warnings.push(format!(
            "{count} {noun} of another size or type than the first are left out ({first}, …)"
        ));
    }
    warnings.push(match slices {
        1 => "one picture is one slice".to_owned(),
        _ => format!("{slices} pictures are stacked in the order of their names, 1 apart"),
    });
    let name = folder.file_name().map_or_else(|| "slices".into(), |name| name.to_string_lossy());
    let field = Field {
        name: name.into_owned(),
        components: form.components,
        association: Association::Point,
        samples: samples.into(),
    };
    let grid = Grid::of(Lattice::unit([form.width, form.height, slices]), vec![field]);
    Ok(Opened::of(grid, Format::Images, warnings))
}

/// One picture of a folder; the path is told where it fails.
fn picture(path: &Path, free_bytes: u64) -> Result<(Form, Samples), Problem> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let read = if extension == "png" {
        png(path, free_bytes)
    } else if extension == "jpg" || extension == "jpeg" {
        jpeg(path, free_bytes)
    } else {
        tiff::Reader::open(path, free_bytes).and_then(|mut reader| reader.page())
    };
    read.map_err(|problem| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        corrupt(
            "pictures that decode in the folder",
            format!("that {} does not ({problem})", quoted(&name)),
            "move it elsewhere, or save it again",
        )
    })
}

fn undecodable(words: &str) -> Problem {
    corrupt("a picture that decodes", quoted(words), "save it again")
}

fn opened(path: &Path) -> Result<BufReader<File>, Problem> {
    Ok(files::buffered(files::open_file(path)?.0))
}

fn png(path: &Path, free_bytes: u64) -> Result<(Form, Samples), Problem> {
    use image::DynamicImage;
    let mut reader = image::ImageReader::with_format(opened(path)?, image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(free_bytes);
    reader.limits(limits);
    let decoded = caught(|| reader.decode()).map_err(|words| undecodable(&words))?;
    let decoded = decoded.map_err(|error| undecodable(&error.to_string()))?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let components = usize::from(decoded.color().channel_count());
    let samples = match decoded {
        DynamicImage::ImageLuma16(image) => Samples::UInt16(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => Samples::UInt16(image.into_raw()),
        DynamicImage::ImageRgb16(image) => Samples::UInt16(image.into_raw()),
        DynamicImage::ImageRgba16(image) => Samples::UInt16(image.into_raw()),
        other => Samples::UInt8(other.into_bytes()),
    };
    let scalar_type = samples.scalar_type();
    Ok((Form { width, height, components, scalar_type }, samples))
}

fn jpeg(path: &Path, free_bytes: u64) -> Result<(Form, Samples), Problem> {
    use jpeg_decoder::{Decoder, PixelFormat};
    let failed = |error: jpeg_decoder::Error| undecodable(&error.to_string());
    let mut decoder = Decoder::new(opened(path)?);
    caught(|| decoder.read_info()).map_err(|words| undecodable(&words))?.map_err(failed)?;
    let info = decoder.info().ok_or_else(|| undecodable("no picture"))?;
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    memory::require("a picture", (width * height * 4) as u64, free_bytes)?;
    let components = match info.pixel_format {
        PixelFormat::L8 => 1,
        PixelFormat::RGB24 => 3,
        PixelFormat::L16 | PixelFormat::CMYK32 => {
            return Err(unsupported(
                "grey or RGB pictures of 8 bits",
                "others",
                "save them as PNG",
            ));
        }
    };
    let made = caught(|| decoder.decode()).map_err(|words| undecodable(&words))?.map_err(failed)?;
    Ok((Form { width, height, components, scalar_type: ScalarType::UInt8 }, Samples::UInt8(made)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_that_a_person_counts_in() {
        let mut names = ["s10.png", "s9.png", "S1.png", "s9b.png", "s009.png", "a.png"];
        names.sort_by_cached_key(|name| natural(name));
        assert_eq!(names, ["a.png", "S1.png", "s9.png", "s009.png", "s9b.png", "s10.png"]);
    }

    #[test]
    fn a_folder_of_strays_is_refused_and_a_few_are_left_out() {
        let folder = tempfile::tempdir().expect("a folder");
        let save = |name: &str, side: u32| {
            let picture = image::GrayImage::from_pixel(side, 4, image::Luma([7]));
            picture.save(folder.path().join(name)).expect("written");
        };
        let read = || read(folder.path(), 1 << 30, &Ticket::new());
        save("a.png", 5);
        assert!(read().expect("one slice").warnings.join("").contains("one picture is one slice"));
        save("b.png", 6);
        let refused = read().expect_err("two strays").to_string();
        assert!(refused.contains("found 1 of 2 pictures like the first"), "{refused}");
        save("c.png", 5);
        let opened = read().expect("two slices and a stray");
        assert_eq!(opened.grid.lattice.dims, [5, 4, 2]);
        let said = opened.warnings.join("; ");
        assert!(
            said.contains("1 picture of another size") && said.contains("2 pictures are stacked")
        );
    }
}
