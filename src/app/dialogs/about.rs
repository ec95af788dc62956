//! What this program is, and whose ideas it draws by.

use eframe::egui::{Context, Grid, Label, RichText, Ui};

use super::sheet;
use crate::app::theme;

/// Width of the sheet, points.
const WIDTH: f32 = 520.0;
/// What it draws, and who described that.
const SYSTEMS: [(&str, &str); 4] = [
    ("Splatting", "Westover, A parallel, feed-forward volume rendering algorithm, 1991"),
    (
        "Octree cuts",
        "Laur and Hanrahan, A progressive refinement algorithm for volume rendering, 1991",
    ),
    (
        "Vector splats",
        "Crawfis and Max, Texture splats for 3D scalar and vector field visualization, 1993",
    ),
    (
        "Basis functions",
        "Jang and others, Interactively visualizing procedurally encoded scalar fields, 2004",
    ),
];

/// Shows it, with what draws; true once it was closed.
pub fn about_ui(ctx: &Context, engine: Option<&str>) -> bool {
    sheet(ctx, "about", "Voxsplat", WIDTH, |ui| {
        ui.label("Draws volumes by splatting, and shows what accuracy costs in time.");
        ui.add_space(8.0);
        Grid::new("about").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
            fact_ui(ui, "Version", env!("CARGO_PKG_VERSION"));
            fact_ui(ui, "Drawn by", engine.unwrap_or("nothing yet"));
            fact_ui(ui, "Licence", "MIT or Apache 2.0, as you like");
            for (system, paper) in SYSTEMS {
                fact_ui(ui, system, paper);
            }
        });
    })
}

fn fact_ui(ui: &mut Ui, name: &str, fact: &str) {
    ui.label(RichText::new(name).color(theme::TEXT_FAINT));
    ui.add(Label::new(fact).wrap());
    ui.end_row();
}
