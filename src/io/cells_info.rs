//! What is told of cells that lie in no order.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use serde::Serialize;

use crate::cells::{Cells, Finder};
use crate::core::parallel;
use crate::core::{Cancelled, Ticket, plain_number};

/// The cells of an unstructured or curvilinear grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellsInfo {
    /// How many cells, those without volume among them.
    pub cells: usize,
    /// How many there are of each kind.
    pub cell_kinds: BTreeMap<String, usize>,
    /// Cells that are drawn as several simpler ones.
    pub split_cells: usize,
    /// Pieces of cells that have no volume to speak of.
    pub flat_cells: usize,
    /// Pieces of cells whose points go round the other way.
    pub inverted_cells: usize,
    /// Cells whose middle, or that of one of their pieces, lies inside another cell.
    pub overlapping_cells: usize,
    /// Cells with corners that lie nowhere, which are left out.
    pub left_out_cells: usize,
    /// The volume of all solid cells; what is inverted counts as negative.
    pub total_volume: f64,
}

impl CellsInfo {
    /// What is told of cells; which of them overlap takes lists of all.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn of(cells: &Arc<Cells>, ticket: &Ticket) -> Result<Self, Cancelled> {
        let census = cells.census();
        let mut cell_kinds = BTreeMap::new();
        for (kind, count) in &census.by_type {
            *cell_kinds.entry(kind_name(*kind)).or_default() += count;
        }
        Ok(Self {
            cells: cells.own_cells(),
            cell_kinds,
            split_cells: census.split,
            flat_cells: census.flat,
            inverted_cells: census.inverted,
            overlapping_cells: overlapping(cells, ticket)?,
            left_out_cells: census.not_finite,
            total_volume: total_volume(cells),
        })
    }
}

/// How many cells overlap others. Nothing but `info` asks, as lists of a million cells take a good part of a second.
fn overlapping(cells: &Arc<Cells>, ticket: &Ticket) -> Result<usize, Cancelled> {
    if cells.solids().len() < 2 {
        return Ok(0);
    }
    Finder::new(cells, |_| true, ticket)?.overlapping(ticket)
}

/// Volumes summed up in a fixed order.
fn total_volume(cells: &Cells) -> f64 {
    let volumes = parallel::list(cells.solids().len(), |solid| cells.placed(solid).volume());
    // An empty sum is -0.
    volumes.into_iter().sum::<f64>() + 0.0
}

/// What people call the cells of one of VTK's types.
fn kind_name(kind: u8) -> String {
    let name = match kind {
        0 => "empty cells",
        1 => "vertices",
        2 => "polyvertices",
        3 => "lines",
        4 => "polylines",
        5 => "triangles",
        6 => "triangle strips",
        7 => "polygons",
        8 => "pixels",
        9 => "quadrilaterals",
        10 => "tetrahedra",
        11 => "voxels",
        12 => "hexahedra",
        13 => "wedges",
        14 => "pyramids",
        15 => "pentagonal prisms",
        16 => "hexagonal prisms",
        21 => "quadratic lines",
        22 => "quadratic triangles",
        23 => "quadratic quadrilaterals",
        24 => "quadratic tetrahedra",
        25 => "quadratic hexahedra",
        26 => "quadratic wedges",
        27 => "quadratic pyramids",
        28 => "biquadratic quadrilaterals",
        29 => "triquadratic hexahedra",
        30 => "quadratic linear quadrilaterals",
        31 => "quadratic linear wedges",
        32 => "biquadratic quadratic wedges",
        34 => "biquadratic triangles",
        36 => "quadratic polygons",
        42 => "polyhedra",
        69 => "Lagrange triangles",
        70 => "Lagrange quadrilaterals",
        71 => "Lagrange tetrahedra",
        72 => "Lagrange hexahedra",
        73 => "Lagrange wedges",
        other => return format!("cells of VTK's type {other}"),
    };
    name.to_owned()
}

/// What people call one of them.
fn one_of(kinds: &str) -> String {
    for (many, one) in [("hedra", "hedron"), ("vertices", "vertex"), ("s", "")] {
        if let Some(stem) = kinds.strip_suffix(many) {
            return format!("{stem}{one}");
        }
    }
    // Of a type without a name.
    kinds.replacen("cells", "cell", 1)
}

impl fmt::Display for CellsInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let told = |(kind, count): (&String, &usize)| match count {
            1 => format!("1 {}", one_of(kind)),
            _ => format!("{count} {kind}"),
        };
        let kinds: Vec<String> = self.cell_kinds.iter().map(told).collect();
        let kinds = if kinds.is_empty() { "none".to_owned() } else { kinds.join(", ") };
        writeln!(f, "{:<11}{kinds}", "cells")?;
        let told = [
            (self.split_cells, "split into simpler ones, within which what is curved is straight"),
            (self.flat_cells, "without volume"),
            (self.inverted_cells, "inverted"),
            (
                self.overlapping_cells,
                "with their middle inside another: where cells overlap, the first one is drawn",
            ),
            (self.left_out_cells, "left out, with corners that lie nowhere"),
        ];
        for (count, what) in told.into_iter().filter(|(count, _)| *count > 0) {
            writeln!(f, "{:<11}{count} {what}", "")?;
        }
        if self.total_volume != 0.0 {
            writeln!(f, "{:<11}{}", "volume", plain_number(self.total_volume))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_a_kind_is_no_plural() {
        let one = |kind: u8| one_of(&kind_name(kind));
        let named = [0, 1, 2, 6, 10, 13, 25, 42, 81].map(one);
        let expected = [
            "empty cell",
            "vertex",
            "polyvertex",
            "triangle strip",
            "tetrahedron",
            "wedge",
            "quadratic hexahedron",
            "polyhedron",
            "cell of VTK's type 81",
        ];
        assert_eq!(named, expected);
    }
}
