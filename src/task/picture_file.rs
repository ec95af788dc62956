//! Still pictures as files: PNG as a display shows them, EXR as light.

use std::io::Cursor;
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder, ImageFormat};

use super::still::Still;

/// A picture file's format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8-bit sRGB with straight alpha.
    Png,
    /// 32-bit float, linear premultiplied RGBA, without the background.
    Exr,
}

impl PictureFormat {
    /// The format that a file name's extension asks for.
    ///
    /// # Errors
    /// One sentence for any other extension.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(format!(
                "expected a picture name that ends in .png or .exr, found another; \
                 rename it: {}",
                path.display()
            )),
        }
    }
}

/// A still picture as the bytes of a PNG file.
///
/// # Errors
/// One sentence.
pub fn png_bytes(still: &Still) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let [width, height] = still.size;
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&still.rgba, width, height, ExtendedColorType::Rgba8)
        .map_err(|error| format!("the picture could not be encoded: {error}"))?;
    Ok(bytes.into_inner())
}

/// A still picture as the bytes of an EXR file.
fn exr_bytes(still: &Still) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let [width, height] = still.size;
    image::write_buffer_with_format(
        &mut bytes,
        bytemuck::cast_slice(&still.light),
        width,
        height,
        ExtendedColorType::Rgba32F,
        ImageFormat::OpenExr,
    )
    .map_err(|error| format!("the picture could not be encoded: {error}"))?;
    Ok(bytes.into_inner())
}

/// Writes a still picture; a failed write leaves no half of a file behind.
///
/// # Errors
/// One sentence with the path last.
pub fn write(still: &Still, format: PictureFormat, path: &Path) -> Result<(), String> {
    let bytes = match format {
        PictureFormat::Png => png_bytes(still)?,
        PictureFormat::Exr => exr_bytes(still)?,
    };
    std::fs::write(path, bytes).map_err(|error| {
        format!(
            "the picture could not be written: {error}; choose another place: {}",
            path.display()
        )
    })
}
