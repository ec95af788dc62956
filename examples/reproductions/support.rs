//! What every part of the page needs: drawing, comparing, small pictures, charts.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow};
use image::{ExtendedColorType, ImageEncoder};
use plotters::prelude::*;
use plotters::style::register_font;
use voxsplat::accuracy::Difference;
use voxsplat::core::Ticket;
use voxsplat::core::colour::srgb_bytes;
use voxsplat::gpu::AdapterChoice;
use voxsplat::scene::{Look, Sampled, Scene, SplatSettings};
use voxsplat::task::engine::Engine;
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::transfer::TransferFunction;
use voxsplat::volume::{Component, Grid, Lattice, Samples, ScalarVolume, demo};

/// Linear premultiplied RGBA, rows from the top.
pub(crate) type Light = Vec<[f64; 4]>;

/// The engine that draws everything, the page so far, and where its pictures go.
pub(crate) struct Page<'a> {
    pub(crate) engine: Engine,
    pub(crate) text: String,
    pub(crate) pictures: &'a Path,
}

impl<'a> Page<'a> {
    pub(crate) fn new(pictures: &'a Path) -> Self {
        let engine = Engine::start(AdapterChoice::Auto, || ());
        Self { engine, text: String::new(), pictures }
    }

    /// One more paragraph, heading or table.
    pub(crate) fn say(&mut self, words: &str) {
        self.text.push_str(words.trim_end());
        self.text.push_str("\n\n");
    }

    /// A Markdown table.
    pub(crate) fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
        self.text.push_str(&line(head.to_vec()));
        self.text.push_str(&line(head.iter().map(|_| "---").collect()));
        for row in rows {
            self.text.push_str(&line(row.iter().map(String::as_str).collect()));
        }
        self.text.push('\n');
    }

    /// A picture already written under `name`.
    pub(crate) fn figure(&mut self, name: &str, words: &str) {
        self.say(&format!("![{words}](reproductions/{name})\n\n*{words}*"));
    }

    /// Draws `scene` and `repeat` more frames, each turned by a degree.
    pub(crate) fn draw(
        &self,
        scene: &Scene,
        size: u32,
        refine: Refine,
        repeat: u32,
    ) -> Result<Still> {
        self.draw_sized(scene, [size; 2], refine, repeat)
    }

    /// The same at another shape than a square's.
    pub(crate) fn draw_sized(
        &self,
        scene: &Scene,
        size: [u32; 2],
        refine: Refine,
        repeat: u32,
    ) -> Result<Still> {
        let request = StillRequest {
            scene: scene.clone(),
            size,
            refine,
            repeat,
            time_passes: false,
            smooth_edges: false,
        };
        Ok(self.engine.still(request, &Ticket::new())?)
    }

    /// Square panels side by side over black, as PNG.
    pub(crate) fn strip(&self, name: &str, panels: &[&[[f32; 4]]], size: usize) -> Result<()> {
        let row = panels.iter().map(|panel| on_black(panel)).collect();
        self.mosaic(name, &[row], size)
    }

    /// Rows of square panels of opaque sRGB bytes with alpha, as PNG.
    pub(crate) fn mosaic(&self, name: &str, rows: &[Vec<Vec<u8>>], size: usize) -> Result<()> {
        let gap = 4;
        let across = rows.iter().map(Vec::len).max().unwrap_or(0);
        let [width, height] = [across, rows.len()].map(|count| count * (size + gap) - gap);
        let mut rgb = vec![255_u8; width * height * 3];
        for (r, row) in rows.iter().enumerate() {
            for (p, panel) in row.iter().enumerate() {
                for (i, pixel) in panel.chunks_exact(4).enumerate() {
                    let down = r * (size + gap) + i / size;
                    let at = down * width + p * (size + gap) + i % size;
                    rgb[at * 3..at * 3 + 3].copy_from_slice(&pixel[..3]);
                }
            }
        }
        write_png(&self.pictures.join(name), &rgb, [width, height])
    }
}

/// A picture as sRGB bytes, black behind.
pub(crate) fn on_black(light: &[[f32; 4]]) -> Vec<u8> {
    srgb_bytes(light, Some(voxsplat::core::LinearRgb::default()))
}

pub(crate) fn write_png(path: &Path, rgb: &[u8], [width, height]: [usize; 2]) -> Result<()> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut bytes,
        image::codecs::png::CompressionType::Best,
        image::codecs::png::FilterType::Adaptive,
    );
    encoder.write_image(
        rgb,
        u32::try_from(width)?,
        u32::try_from(height)?,
        ExtendedColorType::Rgb8,
    )?;
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The least of a picture's frame times: what other work on the machine disturbed least.
pub(crate) fn least_ms(still: &Still) -> f64 {
    still.frame_ms.iter().copied().fold(f64::INFINITY, f64::min)
}

pub(crate) fn wide(light: &[[f32; 4]]) -> Light {
    light.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// How far a drawn picture is from another.
pub(crate) fn compare(still: &Still, truth: &[[f64; 4]]) -> Result<Difference> {
    Ok(Difference::between(&wide(&still.light), truth)?)
}

/// The square middle part of a picture, `size` pixels wide, its middle at a place in 0..=1.
pub(crate) fn crop(light: &[[f32; 4]], width: usize, size: usize, at: [f64; 2]) -> Vec<[f32; 4]> {
    let from = at.map(|p| ((p * width as f64) as usize).saturating_sub(size / 2).min(width - size));
    (0..size * size).map(|i| light[(from[1] + i / size) * width + from[0] + i % size]).collect()
}

/// A demo's first field.
pub(crate) fn demo_grid(name: &str, size: usize) -> Result<Grid> {
    Ok(demo::open(name, Some(size))?)
}

pub(crate) fn scalar(grid: &Grid) -> Result<Arc<ScalarVolume>> {
    let field = grid.field(None)?;
    Ok(Arc::new(grid.scalar(field, Component::Index(0), &Ticket::new())?))
}

/// Every `steps`-th sample along each axis, from the first; the world stays where it is.
pub(crate) fn subsampled(volume: &ScalarVolume, steps: [usize; 3]) -> Result<Arc<ScalarVolume>> {
    let from = volume.lattice;
    let dims: [usize; 3] = std::array::from_fn(|a| from.dims[a].div_ceil(steps[a]));
    let spacing = from.spacing * glam::DVec3::from(steps.map(|s| s as f64));
    let values = (0..dims.iter().product())
        .map(|i: usize| {
            let at = [i % dims[0], i / dims[0] % dims[1], i / (dims[0] * dims[1])];
            let [x, y, z]: [usize; 3] = std::array::from_fn(|a| at[a] * steps[a]);
            #[expect(clippy::cast_possible_truncation, reason = "scans of 8 and 16 bits")]
            let value = volume.samples.get((z * from.dims[1] + y) * from.dims[0] + x) as f32;
            value
        })
        .collect();
    let lattice = Lattice { dims, spacing, ..from };
    Ok(Arc::new(ScalarVolume::from_samples(&volume.name, lattice, Samples::Float32(values))?))
}

/// The scene drawn another way.
pub(crate) fn with(scene: &Scene, splat: SplatSettings) -> Scene {
    Scene { splat, ..scene.clone() }
}

/// Seen as a scene is, a field of values alone.
pub(crate) fn of_field(
    mut scene: Scene,
    volume: Arc<ScalarVolume>,
    transfer: TransferFunction,
) -> Scene {
    scene.keep(|_| false);
    scene.with((Sampled::Volume(volume), Look::Field(transfer)))
}

/// The scene with other opacities and colours of its field.
pub(crate) fn with_transfer(mut scene: Scene, transfer: TransferFunction) -> Scene {
    if let Some(own) = scene.transfer_mut() {
        *own = transfer;
    }
    scene
}

/// Decibels as they stand in tables.
pub(crate) fn db(value: f64) -> String {
    if value.is_finite() { format!("{value:.1}") } else { "∞".to_owned() }
}

/// A number with three digits that count.
pub(crate) fn short(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// A named curve: its points.
pub(crate) type Curve = (String, Vec<(f64, f64)>);

/// Charts side by side, each with its title, axis and curves from 0; a straight line a curve where
/// `fit`.
pub(crate) fn charts(
    path: &Path,
    panels: &[(&str, &str, &str, &[Curve])],
    fit: bool,
) -> Result<()> {
    const COLOURS: [RGBColor; 4] = [
        RGBColor(0, 90, 160),
        RGBColor(213, 94, 0),
        RGBColor(0, 158, 115),
        RGBColor(204, 121, 167),
    ];
    let [width, height] = [400 * panels.len(), 320];
    // The interface's own: charts look alike on every machine, and need no system font.
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the font cannot be read"))?;
    let mut rgb = vec![255; width * height * 3];
    {
        let size = (u32::try_from(width)?, u32::try_from(height)?);
        let root = BitMapBackend::with_buffer(&mut rgb, size).into_drawing_area();
        root.fill(&WHITE)?;
        for (area, (title, across, up, curves)) in
            root.split_evenly((1, panels.len())).iter().zip(panels)
        {
            let points = || curves.iter().flat_map(|(_, points)| points.iter());
            let right = points().map(|p| p.0).fold(0.0, f64::max) * 1.04;
            let top = points().map(|p| p.1).fold(0.0, f64::max) * if fit { 1.45 } else { 1.12 };
            let bottom = points().map(|p| p.1).fold(0.0, f64::min) * 1.1;
            let mut chart = ChartBuilder::on(area)
                .caption(title, ("sans-serif", 18))
                .margin(10)
                .x_label_area_size(40)
                .y_label_area_size(56)
                .build_cartesian_2d(0.0..right, bottom..top)?;
            chart
                .configure_mesh()
                .x_desc(*across)
                .y_desc(*up)
                .x_labels(6)
                .y_labels(6)
                .light_line_style(WHITE)
                .label_style(("sans-serif", 14))
                .draw()?;
            for (i, (name, points)) in curves.iter().enumerate() {
                // A curve keeps the colour of its name from the first chart on.
                let known = panels[0].3.iter().position(|(first, _)| first == name).unwrap_or(i);
                let colour = COLOURS[known % COLOURS.len()];
                let line: Vec<(f64, f64)> = if fit {
                    chart
                        .draw_series(points.iter().map(|&p| Circle::new(p, 3, colour.filled())))?;
                    let line = Straight::through(points);
                    [0.0, right].map(|x| (x, line.at(x))).to_vec()
                } else {
                    points.clone()
                };
                let line: Vec<_> = line.into_iter().filter(|p| p.1.is_finite()).collect();
                chart
                    .draw_series(LineSeries::new(line, colour.stroke_width(2)))?
                    .label(name.clone())
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour));
            }
            chart
                .configure_series_labels()
                .position(if fit {
                    SeriesLabelPosition::UpperLeft
                } else {
                    SeriesLabelPosition::UpperRight
                })
                .background_style(WHITE.mix(0.8))
                .label_font(("sans-serif", 13))
                .draw()?;
        }
        root.present()?;
    }
    write_png(path, &rgb, [width, height])
}

/// A least-squares line.
pub(crate) struct Straight {
    pub(crate) fixed: f64,
    pub(crate) slope: f64,
}

impl Straight {
    pub(crate) fn through(points: &[(f64, f64)]) -> Self {
        let n = points.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
        Self { fixed: y - slope * x, slope }
    }

    pub(crate) fn at(&self, x: f64) -> f64 {
        self.fixed + self.slope * x
    }

    /// Share of the variance that the line explains.
    pub(crate) fn explained(&self, points: &[(f64, f64)]) -> f64 {
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
        let left: f64 = points.iter().map(|p| (p.1 - self.at(p.0)).powi(2)).sum();
        1.0 - left / points.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>()
    }
}
