//! What was opened.

use eframe::egui::{Button, CollapsingHeader, ComboBox, RichText, Ui};

use super::inside::note_ui;
use super::lists::ListUi;
use super::view::Told;
use super::{facts_ui, row_ui};
use crate::app::document::Document;
use crate::app::sentences::without_flags;
use crate::app::{theme, words};
use crate::core::memory::human_bytes;
use crate::io::Series;
use crate::scene::{Scene, SplatSettings};
use crate::transfer::Kind;
use crate::volume::{Component, Field, Grid, ScalarVolume, Shape};

/// So many notes on a file need no click.
const NOTES_IN_SIGHT: usize = 2;

/// Another number of the file that a person wants to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldChoice {
    /// Index into the grid's fields.
    pub field: usize,
    /// Which number of it.
    pub component: Component,
}

/// What else a person wants to see of what was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataChoice {
    /// Another field of the file, or component of it.
    Field(FieldChoice),
    /// Another series, by its index.
    Series(usize),
}

/// The facts, and the choice of series and field where there is one.
pub fn data_ui(ui: &mut Ui, document: &Document) -> Option<DataChoice> {
    let volume = &document.volume;
    let statistics = &volume.statistics;
    let lattice = &volume.lattice;
    let spacing = lattice.spacing.abs().to_array().map(words::value);
    // Where the file has one.
    let with_unit = |length: String| match &volume.unit {
        Some(unit) => format!("{length} {unit}"),
        None => length,
    };
    let space = document.grid.space.as_deref();
    let (space, space_help) = match space {
        Some(space) => (space, "What the file calls the directions of its axes"),
        None if Told::of(document).is_by_shape() => (
            "not stated",
            "The file does not say which way its axes point, so its shape does: things stand on their heavy end, and patients \
             lie on the scanner's table. Key 8 turns it upside down, and Up under View chooses another axis",
        ),
        None => (
            "not stated",
            "The file does not say which way its axes point, so z is taken to point up: key 8 turns it upside down, and Up \
             under View chooses another axis",
        ),
    };
    let (hounsfield, range_help) = match Kind::of(statistics) {
        Kind::Ct { zero: 0.0 } => (
            " HU",
            "The least and the greatest finite value; they are such as Hounsfield units are, and are taken for these",
        ),
        _ => ("", "The least and the greatest finite value"),
    };
    let range_help = format!(
        "{range_help}: {} and {}",
        words::value(statistics.min),
        words::value(statistics.max)
    );
    let shape = &document.grid.shape;
    let lattice_rows = [
        (
            "Dimensions",
            lattice.dims.map(|n| n.to_string()).join(" × "),
            "Samples along the three axes of the volume",
        ),
        (
            "Spacing",
            with_unit(spacing.join(" × ")),
            "Distance between neighbouring samples, in the file's units",
        ),
    ];
    let mut rows = vec![("Name", document.source.name(), "What was opened")];
    let mesh = mesh_rows(&document.grid, volume, with_unit);
    let is_mesh = mesh.is_some();
    rows.extend(mesh.unwrap_or_else(|| lattice_rows.into()));
    rows.extend([
        ("Type", volume.samples.scalar_type().name().to_owned(), "How each number is stored"),
        (
            "Range",
            format!("{}{hounsfield}", words::range([statistics.min, statistics.max])),
            &range_help,
        ),
        match shape {
            Shape::Affine => ("Mean", words::value(statistics.mean), "Of the finite values"),
            Shape::Unstructured(_) if volume.cells.is_none() => (
                "Mean",
                words::value(statistics.mean),
                "Of the finite values, each of which counts once",
            ),
            _ => (
                "Mean",
                format!("{} by volume", words::value(statistics.mean)),
                "Of the finite values, each weighing as much as the space that it fills; that of voxsplat info is over the \
                 file's points or cells, each of which counts once there",
            ),
        },
        ("Space", space.to_owned(), space_help),
        (
            "Memory",
            human_bytes(volume.samples.size_bytes() as u64),
            "What the samples on screen take in main memory",
        ),
    ]);
    match shape {
        _ if is_mesh => {
            let samples = lattice.dims.map(|n| n.to_string()).join(" × ");
            let help = "Evenly spaced samples of the cells, which other kernels than Cells and Ellipsoids draw, and quick \
                        pictures of very many cells";
            rows.push(("Sampled", samples, help));
        }
        Shape::Affine => {}
        _ => {
            let points = document.grid.lattice.dims.map(|n| n.to_string()).join(" × ");
            let text = format!("{points} points, {}", shape.name());
            let help =
                "The grid of the file; the dimensions above are of the regular one that is drawn";
            rows.push(("In the file", text, help));
        }
    }
    let odd = statistics.nan_count + statistics.infinite_count;
    if odd > 0 {
        let text = format!(
            "{} NaN, {} infinite{}",
            words::count(statistics.nan_count),
            words::count(statistics.infinite_count),
            // Lengths of finite components may be, too.
            match document.component {
                Component::Magnitude =>
                    format!(" or beyond {}", volume.samples.scalar_type().name()),
                _ => String::new(),
            }
        );
        rows.push(("Not finite", text, "NaN is drawn fully transparent"));
    }
    facts_ui(ui, &rows);
    notes_ui(ui, &document.warnings);
    let series = series_ui(ui, &document.series).map(DataChoice::Series);
    let field = choice_ui(ui, document).map(DataChoice::Field);
    series.or(field)
}

/// What there is to know of the file: in sight, where it is little.
fn notes_ui(ui: &mut Ui, notes: &[String]) {
    if notes.is_empty() {
        return;
    }
    let title = format!("Notes on the file ({})", notes.len());
    let title = RichText::new(title).size(12.5).color(theme::NOTE);
    CollapsingHeader::new(title)
        .id_salt("notes")
        .default_open(notes.len() <= NOTES_IN_SIGHT)
        .show_unindented(ui, |ui| {
            for note in notes {
                note_ui(ui, &without_flags(note));
            }
        });
}

/// What a mesh is drawn as, where that can be chosen: its cells, or ellipsoids about its points or cells. Other kernels draw its
/// samples.
pub fn drawn_as_ui(ui: &mut Ui, volume: &ScalarVolume, splat: &mut SplatSettings) {
    let Some(cells) = SplatSettings::of_cells_or_points(volume).filter(|_| volume.cells.is_some())
    else {
        return;
    };
    row_ui(ui, "Drawn as", |ui| {
        for (name, own, help) in [
            (
                "Cells",
                cells,
                "The cells as they are: values run through each by its shape functions",
            ),
            (
                "Ellipsoids",
                SplatSettings::ELLIPSOIDS,
                "An ellipsoid about each point, or about each cell where there is one number a cell, as large as its \
                 neighbourhood",
            ),
        ] {
            let button = Button::new(name).selected(splat.kernel == own.kernel);
            if ui.add(button).on_hover_text(help).clicked() {
                let SplatSettings { opacity_unit_distance, cut, .. } = *splat;
                *splat = SplatSettings { opacity_unit_distance, cut, ..own };
            }
        }
    });
}

/// Whether the points of a file that opens as a surface, or as bodies, are drawn beside it as a field.
pub fn points_ui(ui: &mut Ui, scene: &mut Scene) {
    row_ui(ui, "Also draw", |ui| {
        let mut are_shown = scene.shows_field();
        let shown = ui.checkbox(&mut are_shown, "Its points as a volume");
        let help = "Fill the space about its points, too, as the transfer function says: each is a soft ellipsoid, as wide as \
                    its neighbours lie apart (of a surface of more than 10 000 points, evenly spaced samples). Slices and \
                    isosurfaces are of this. Hide what is under Polygons and labels to see it alone";
        if shown.on_hover_text(help).changed() {
            scene.show_field(are_shown);
        }
    });
}

/// What there is in the place of a lattice's samples, where a mesh, points, or the cells of a grid that is not evenly spaced are
/// drawn as they are.
fn mesh_rows(
    grid: &Grid,
    volume: &ScalarVolume,
    with_unit: impl Fn(String) -> String,
) -> Option<Vec<(&'static str, String, &'static str)>> {
    let cells = match &grid.shape {
        Shape::Unstructured(cells) => cells,
        _ => volume.cells.as_ref()?.cells(),
    };
    let [points, own] = [cells.own_points(), cells.own_cells()].map(|n| words::count(n as u64));
    let [low, high] = cells.bounds();
    let points = match &grid.shape {
        Shape::Unstructured(_) => ("Points", points, "How many the file has"),
        shape => {
            let along = grid.lattice.dims.map(|n| n.to_string()).join(" × ");
            let help = "Those of the file's grid along its three directions, and how it is spaced";
            ("Points", format!("{along}, {}", shape.name()), help)
        }
    };
    let mut rows = vec![points];
    if !grid.are_points_alone() {
        rows.push(("Cells", own, "How many the file has, those without volume among them"));
    }
    let size = (high - low).to_array().map(words::value).join(" × ");
    rows.push(("Size", with_unit(size), "Of the box about it, in the file's units"));
    if cells.median_edge() > 0.0 {
        let help = "The median length of the cells' edges, over which opacities are given";
        rows.push(("Median edge", with_unit(words::value(cells.median_edge())), help));
    }
    Some(rows)
}

fn series_ui(ui: &mut Ui, series: &[Series]) -> Option<usize> {
    let open = series.iter().position(|one| one.is_open)?;
    let mut chosen = open;
    row_ui(ui, "Series", |ui| {
        let combo = ComboBox::from_id_salt("series").selected_text(&series[open].name).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for (index, one) in series.iter().enumerate() {
                let noun = if one.slices == 1 { "slice" } else { "slices" };
                let label = format!("{} ({} {noun})", one.name, one.slices);
                ui.choice_of(&mut chosen, index, label)
                    .on_hover_text(one.path.display().to_string());
            }
        });
        shown
            .response
            .accessible_name("Series")
            .on_hover_text("Which of the scans in the folder is open");
    });
    (chosen != open).then_some(chosen)
}

fn choice_ui(ui: &mut Ui, document: &Document) -> Option<FieldChoice> {
    let fields = &document.grid.fields;
    let current = fields.get(document.field)?;
    let mut choice = FieldChoice { field: document.field, component: document.component };
    if fields.len() > 1 {
        row_ui(ui, "Field", |ui| {
            let combo = ComboBox::from_id_salt("field").selected_text(&current.name).truncate();
            let shown = combo.show_ui(ui, |ui| {
                for (index, field) in fields.iter().enumerate() {
                    let label = field_label(field);
                    if ui.choice(index == document.field, label).clicked() {
                        let component = Component::usual(field.components);
                        choice = FieldChoice { field: index, component };
                    }
                }
            });
            shown
                .response
                .accessible_name("Field")
                .on_hover_text("Which of the file's arrays is drawn");
        });
    }
    if current.components > 1 {
        row_ui(ui, "Component", |ui| {
            let combo = ComboBox::from_id_salt("component")
                .selected_text(component_label(document.component));
            let shown = combo.show_ui(ui, |ui| {
                let indices = (0..current.components).map(Component::Index);
                let derived = Component::DERIVED.into_iter().filter(|_| current.components == 3);
                let all = std::iter::once(Component::Magnitude).chain(indices).chain(derived);
                for component in all {
                    let selected = component == document.component;
                    if ui.choice(selected, component_label(component)).clicked() {
                        choice.component = component;
                    }
                }
            });
            shown.response.accessible_name("Component").on_hover_text(
                "Which number of each sample is drawn. Of vectors also what their changes in \
                     space say: how they turn (vorticity), spread out (divergence), or turn about \
                     their own direction (helicity)",
            );
        });
    }
    let unchanged = FieldChoice { field: document.field, component: document.component };
    (choice != unchanged).then_some(choice)
}

fn field_label(field: &Field) -> String {
    let association = field.association.name();
    match field.components {
        1 => format!("{} ({association})", field.name),
        _ if field.is_vectors() => format!("{} ({association}, vectors)", field.name),
        n => format!("{} ({association}, {n} components)", field.name),
    }
}

fn component_label(component: Component) -> String {
    match component {
        Component::Magnitude => "Magnitude".to_owned(),
        Component::Index(index @ 0..3) => ["x", "y", "z"][index].to_owned(),
        Component::Index(index) => format!("Number {index}"),
        Component::Vorticity => "Vorticity".to_owned(),
        Component::Divergence => "Divergence".to_owned(),
        Component::Helicity => "Helicity".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::volume::{Association, Samples};

    #[test]
    fn vectors_are_named_as_such_and_colours_are_not() {
        let label = |components: usize, samples: Samples| {
            let association = Association::Cell;
            let samples = Arc::new(samples);
            field_label(&Field { name: "f".into(), components, association, samples })
        };
        assert_eq!(label(3, Samples::Float32(vec![0.0; 3])), "f (cell, vectors)");
        assert_eq!(label(3, Samples::UInt8(vec![0; 3])), "f (cell, 3 components)");
        assert_eq!(label(6, Samples::Float32(vec![0.0; 6])), "f (cell, 6 components)");
        assert_eq!(label(1, Samples::Float32(vec![0.0])), "f (cell)");
    }
}
