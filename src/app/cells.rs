//! The octree's cells over the picture, and what the one under the cursor is.

use std::sync::Arc;

use eframe::egui::{
    Color32, CornerRadius, FontId, Painter, Rect, Response, Sense, Stroke, Ui, Vec2, pos2, vec2,
};
use glam::DVec2;

use super::drawer::Drawer;
use super::viewport::{Overlay, PixelArea};
use super::{theme, words};
use crate::core::Camera;
use crate::core::colour::srgb_from_linear;
use crate::scene::{Cell, Cells, Scene, View, WhyWhole, level_colour};
use crate::task::cells::draw_edges;
use crate::task::engine::{CellsRequest, FoundCells};

/// The errors on offer.
pub const OCTREE_ERROR: std::ops::RangeInclusive<f64> = 0.01..=30.0;
/// Distance of the caption from the viewport's left and top edges, points.
const INSET: f32 = 12.0;
/// Height of the caption with its distance from the edge, points.
const CAPTION: f32 = 52.0;
/// Side of a swatch, points.
const SWATCH: f32 = 10.0;

/// The overlay: whether it is shown, of what, and what was found.
#[derive(Debug)]
pub struct CellsOverlay {
    /// Whether it is shown.
    pub on: bool,
    /// The error whose cut is shown at rest.
    pub max_error: f64,
    /// What was asked for last: nothing while the view moves, or the overlay is hidden.
    asked: Option<CellsRequest>,
    /// Whether the engine was told that cells are wanted.
    wanted: bool,
    found: Option<Arc<FoundCells>>,
    /// Their lines, and what they were drawn of.
    image: Overlay,
    painted: Option<(Arc<FoundCells>, Camera, [u32; 2])>,
    /// Whether some of the lines were drawn fainter.
    is_faint: bool,
}

impl Default for CellsOverlay {
    fn default() -> Self {
        Self {
            on: false,
            max_error: 1.0,
            asked: None,
            wanted: false,
            found: None,
            image: Overlay::default(),
            painted: None,
            is_faint: false,
        }
    }
}

impl CellsOverlay {
    /// Room that its caption takes at the top of the viewport, points.
    pub fn height(&self) -> f32 {
        if self.on { CAPTION } else { 0.0 }
    }

    /// Posts what is missing: the cells of a view at rest. Those of a moving one come by themselves.
    pub fn pace(&mut self, drawer: &dyn Drawer, scene: &Scene, size: [u32; 2], is_moving: bool) {
        if !self.on {
            if std::mem::take(&mut self.wanted) {
                drawer.request_cells(None);
            }
            (self.asked, self.found, self.painted) = (None, None, None);
            self.image = Overlay::default();
            return;
        }
        if is_moving && self.wanted {
            self.asked = None;
            return;
        }
        #[expect(clippy::cast_possible_truncation, reason = "within the slider's range")]
        let max_error = self.max_error as f32;
        let is_asked = |asked: &CellsRequest| {
            asked.size == size
                && asked.max_error == max_error
                && asked.scene.makes_same_picture(scene)
                && asked.scene.splat.cut == scene.splat.cut
        };
        if self.asked.as_ref().is_some_and(is_asked) {
            return;
        }
        let request = CellsRequest { scene: scene.clone(), size, max_error };
        drawer.request_cells(Some(request.clone()));
        self.wanted = true;
        self.asked = Some(request);
    }

    /// Takes what was found since the last pass; whether there was anything.
    pub fn take(&mut self, drawer: &dyn Drawer) -> bool {
        let Some(found) = drawer.take_cells().filter(|_| self.on) else { return false };
        self.found = Some(found);
        true
    }

    /// The cells on screen.
    pub fn shown(&self, scene: &Scene) -> Option<&Arc<FoundCells>> {
        let volume = scene.volume()?;
        let is_of = |found: &&Arc<FoundCells>| Arc::ptr_eq(&found.volume, volume);
        self.found.as_ref().filter(|_| self.on).filter(is_of)
    }

    /// Paints the cells as `scene`'s camera sees them now, and tells of the one under the cursor.
    pub fn show(&mut self, ui: &Ui, area: PixelArea, scene: &Scene, viewport: &Response) {
        let Some(found) = self.shown(scene).map(Arc::clone) else { return };
        let view = View::new(scene, area.size);
        let is_same = |(of, camera, size): &(Arc<FoundCells>, Camera, [u32; 2])| {
            Arc::ptr_eq(of, &found) && *camera == scene.camera && *size == area.size
        };
        if !self.painted.as_ref().is_some_and(is_same) {
            // By hand and as one image: a hundred thousand lines as triangles take a software adapter
            // a quarter of a second in every pass.
            let mut rgba = vec![0; area.size.iter().map(|&n| n as usize).product::<usize>() * 4];
            self.is_faint = draw_edges(&mut rgba, &view, &found.cells);
            self.image.set(ui.ctx(), area.size, &rgba);
            self.painted = Some((Arc::clone(&found), scene.camera, area.size));
        }
        let painter = ui.painter_at(area.rect);
        self.image.paint(&painter, area);
        caption_ui(&painter, area.rect, caption_words(&found, self.is_faint), &found.cells);
        let pointer = viewport.hover_pos().filter(|_| !viewport.dragged());
        let Some(pointer) = pointer else { return };
        let points_per_pixel = area.rect.width() / area.size[0] as f32;
        let pixel = (pointer - area.rect.min) / points_per_pixel;
        let ray = view.index_ray(DVec2::new(f64::from(pixel.x), f64::from(pixel.y)));
        let Some(cell) = found.cells.first_met(&ray) else { return };
        let stroke = Stroke::new(2.0 * points_per_pixel, swatch_colour(cell.level));
        for ends in view.cell_on_picture(cell) {
            let ends = ends.map(|pixel| {
                let pixel = pixel.as_vec2();
                area.rect.min + vec2(pixel.x, pixel.y) * points_per_pixel
            });
            painter.line_segment(ends, stroke);
        }
        viewport.clone().on_hover_ui_at_pointer(|ui| cell_ui(ui, cell, &found.cells));
    }
}

fn swatch_colour(level: u8) -> Color32 {
    let [r, g, b] = level_colour(level).0;
    Color32::from_rgb(r, g, b)
}

/// What is shown, and which colour is which size of cell.
fn caption_ui(painter: &Painter, viewport: Rect, words: String, cells: &Cells) {
    let font = FontId::proportional(12.0);
    let text = painter.layout_no_wrap(words, font.clone(), theme::TEXT);
    let levels: Vec<_> = cells
        .levels()
        .into_iter()
        .map(|(level, _)| {
            let edge = 1_u64 << level.min(63);
            (level, painter.layout_no_wrap(format!("{edge}³"), font.clone(), theme::TEXT_FAINT))
        })
        .collect();
    let step = |label: f32| SWATCH + 4.0 + label + 10.0;
    let legend: f32 = levels.iter().map(|(_, label)| step(label.size().x)).sum();
    let size = vec2(text.size().x.max(legend - 10.0), 2.0 * text.size().y + 4.0);
    let at = viewport.min + vec2(INSET + 6.0, INSET + 3.0);
    if size.x + 2.0 * INSET + 12.0 > viewport.width() || size.y + 2.0 * INSET > viewport.height() {
        return;
    }
    let ground = Rect::from_min_size(at, size).expand2(vec2(6.0, 3.0));
    painter.rect_filled(ground, CornerRadius::same(4), Color32::from_black_alpha(170));
    let mut swatch = at + vec2(0.0, text.size().y + 4.0);
    painter.galley(at, text, theme::TEXT);
    for (level, label) in levels {
        let middle = pos2(swatch.x + SWATCH / 2.0, swatch.y + label.size().y / 2.0);
        let square = Rect::from_center_size(middle, Vec2::splat(SWATCH));
        painter.rect_filled(square, CornerRadius::same(2), swatch_colour(level));
        let width = label.size().x;
        painter.galley(swatch + vec2(SWATCH + 4.0, 0.0), label, theme::TEXT_FAINT);
        swatch.x += step(width);
    }
}

/// What is shown, in words. `is_faint`: whether some of the lines are.
pub fn caption_words(found: &FoundCells, is_faint: bool) -> String {
    let Cells { cells, total, max_error, .. } = &found.cells;
    let drawn = cells.len() as u64;
    let counts = if drawn < *total {
        let [drawn, total] = [drawn, *total].map(words::count);
        format!("{drawn} of {total} cells drawn, largest first")
    } else if *total == 1 {
        "1 cell".to_owned()
    } else {
        format!("{} cells", words::count(*total))
    };
    let of = if found.is_drawn { "This picture's octree" } else { "Octree" };
    let why = if *max_error > found.asked_error { ", the least for a million cells" } else { "" };
    let faint = if is_faint { ", faint where they crowd" } else { "" };
    format!("{of}, error {}{why} · {counts}{faint}", error_words(f64::from(*max_error)))
}

/// An error with two digits that matter.
fn error_words(error: f64) -> String {
    match error {
        0.0 => "0".to_owned(),
        e if e < 0.01 => format!("{e:.4}"),
        e if e < 1.0 => format!("{e:.3}"),
        e => format!("{e:.1}"),
    }
}

/// What a cell is, and why it is not split.
fn cell_ui(ui: &mut Ui, cell: &Cell, cells: &Cells) {
    for line in cell_words(cell, cells.max_error) {
        ui.label(line);
    }
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(SWATCH + 2.0), Sense::hover());
        ui.painter().rect_filled(rect, CornerRadius::same(2), shown_colour(cell));
        ui.label(format!("Opacity {} a unit distance", percent(cell.opacity())));
    });
}

/// Level and voxels; its error against the one asked for; why it is whole.
pub fn cell_words(cell: &Cell, max_error: f32) -> [String; 3] {
    let voxels = match cell.voxels() {
        1 => "1 voxel".to_owned(),
        n => {
            let [x, y, z] = cell.size;
            format!("{x} × {y} × {z} = {} voxels", words::count(n))
        }
    };
    let [error, asked] = [cell.error, max_error].map(|e| error_words(f64::from(e)));
    let why = match cell.why {
        WhyWhole::Voxel => "Not split: a single voxel",
        WhyWhole::ErrorSmallEnough => "Not split: its error is small enough",
        WhyWhole::UnderAPixel => "Not split: its parts would be under a pixel",
        WhyWhole::LevelAskedFor => "Not split: this level was asked for",
        WhyWhole::Samples => "Not split: drawn from the samples themselves",
        WhyWhole::NotCome => "Not split: its parts have not come yet",
    };
    [
        format!("Level {}: {voxels}", cell.level),
        format!("Error {error}, asked for {asked}"),
        why.to_owned(),
    ]
}

fn percent(share: f64) -> String {
    match share * 100.0 {
        p if p < 0.1 => "under 0.1 %".to_owned(),
        p if p < 10.0 => format!("{p:.1} %"),
        p => format!("{p:.0} %"),
    }
}

/// A cell's mean colour as a screen shows it.
fn shown_colour(cell: &Cell) -> Color32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let [r, g, b] = cell
        .colour
        .map(|c| (srgb_from_linear(f64::from(c) / f64::from(u16::MAX)) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(why: WhyWhole) -> Cell {
        Cell {
            low: [0; 3],
            size: [8, 8, 4],
            level: 3,
            error: 0.0312,
            extinction: 0.1,
            colour: [u16::MAX, 0, 14_000],
            why,
        }
    }

    #[test]
    fn a_cell_tells_its_level_its_voxels_its_error_and_why_it_is_whole() {
        let [level, error, why] = cell_words(&cell(WhyWhole::ErrorSmallEnough), 0.5);
        assert_eq!(level, "Level 3: 8 × 8 × 4 = 256 voxels");
        assert_eq!(error, "Error 0.031, asked for 0.500");
        assert_eq!(why, "Not split: its error is small enough");
        let voxel = Cell { size: [1; 3], level: 0, error: 0.0, ..cell(WhyWhole::Voxel) };
        let [level, error, why] = cell_words(&voxel, 2.0);
        assert_eq!(
            (level.as_str(), error.as_str()),
            ("Level 0: 1 voxel", "Error 0, asked for 2.0")
        );
        assert!(why.ends_with("single voxel"));
        assert_eq!(shown_colour(&voxel), Color32::from_rgb(255, 0, 127));
        assert_eq!(percent(0.0952), "9.5 %");
        assert_eq!(percent(1e-9), "under 0.1 %");
    }
}
