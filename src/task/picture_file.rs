//! Still pictures as files: PNG as a display shows them, EXR as light.

use std::io::Cursor;
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder, ImageFormat};

use super::output_file::OutputFile;
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
                 choose such a name: {}",
                path.display()
            )),
        }
    }
}

/// A still picture as the bytes of a PNG file.
fn png_bytes(still: &Still) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let [width, height] = still.size;
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(&still.rgba, width, height, ExtendedColorType::Rgba8)
        .map_err(|error| format!("the picture could not be encoded: {error}"))?;
    Ok(bytes.into_inner())
}

/// A still picture as the bytes of a file of this format.
///
/// # Errors
/// One sentence.
pub fn bytes(still: &Still, format: PictureFormat) -> Result<Vec<u8>, String> {
    match format {
        PictureFormat::Png => png_bytes(still),
        PictureFormat::Exr => exr_bytes(still),
    }
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

/// Writes a still picture; a failed write leaves what was there before.
///
/// # Errors
/// One sentence with the path last.
pub fn write(still: &Still, format: PictureFormat, path: &Path) -> Result<(), String> {
    OutputFile::check(path, "the picture")?.write(&bytes(still, format)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::draw::Drawn;
    use crate::task::engine::HeldBytes;

    #[test]
    fn exr_holds_the_premultiplied_light_and_png_the_bytes() {
        let light = vec![[0.25, 0.5, 0.125, 0.5], [0.0; 4], [2.0, 1.0, 0.5, 1.0]];
        let rgba = vec![1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 128];
        let drawn = Drawn { size: [3, 1], ..Drawn::default() };
        let still = Still {
            engine: crate::task::engines::EngineKind::Gpu,
            not_native: None,
            is_full: true,
            why_not_octree: None,
            size: [3, 1],
            outline: crate::plan::Outline::default(),
            light: light.clone(),
            rgba: rgba.clone(),
            drawn,
            kernels_active: 0,
            octree: None,
            native_loop: None,
            native_stages: Vec::new(),
            adapter: String::new(),
            frame_ms: Vec::new(),
            smoothed_ms: None,
            field: None,
            estimated_rmse: None,
            estimated_within_db: crate::task::remaining::WITHIN_DB,
            passes: Vec::new(),
            timed_frame_ms: None,
            timer: None,
            effects: Vec::new(),
            held: HeldBytes::default(),
            peak_gpu_bytes: 0,
            backend: crate::scene::Backend::Raster,
            capped_sums: 0,
            pipelines: 0,
            uploads: 0,
            measured_rmse: None,
            convergence: None,
            cells: None,
            capped_opacities: 0,
        };
        let exr = image::load_from_memory(&exr_bytes(&still).unwrap()).unwrap().into_rgba32f();
        assert_eq!(exr.dimensions(), (3, 1));
        assert_eq!(exr.pixels().map(|p| p.0).collect::<Vec<_>>(), light);
        let png = image::load_from_memory(&png_bytes(&still).unwrap()).unwrap().into_rgba8();
        assert_eq!(png.into_raw(), rgba);
    }
}
