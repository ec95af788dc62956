//! The frame as data: which passes, in which order, over what.
//!
//! Nothing here holds a device object, so a frame can be counted and compared before anything is
//! drawn. [`super::Renderer`] runs it.

/// One pass over the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    /// Counts the active voxels of each segment of the piece's rows.
    CountSegments {
        /// Segments, one thread each.
        segments: u32,
    },
    /// Sums the counts into offsets and the draw's arguments.
    ScanSegments,
    /// Writes a record for each active voxel.
    EmitKernels {
        /// Segments, one thread each.
        segments: u32,
    },
    /// Draws records as footprints over the target.
    Splat(Source),
    /// Composites the slabs of a reconstructed field.
    ReconstructSlabs {
        /// Tiles of the picture, a workgroup each.
        tiles: u32,
    },
    /// Projects a field's values along rays.
    ProjectValues {
        /// Tiles of the picture, a workgroup each.
        tiles: u32,
    },
    /// Shades samples that kernels are gathered of.
    ShadeSamples {
        /// Bricks of the volume, a workgroup each.
        bricks: u32,
    },
    /// Gathers a grid's kernels for some tiles of the picture.
    Gather {
        /// The pass that does: of kernels, or of cells.
        pass: &'static str,
        /// Tiles, one workgroup each.
        tiles: u32,
    },
    /// Projects records and counts the tiles and layers that they touch.
    CountEntries {
        /// Records, one thread each.
        records: u32,
    },
    /// Projects vector splats and counts the tiles and layers that they touch.
    CountVectors {
        /// Splats, one thread each.
        splats: u32,
    },
    /// Composites the slabs of vectors alone.
    CompositeVectors {
        /// Tiles of the picture, a workgroup each.
        tiles: u32,
    },
    /// Sums those counts into offsets.
    ScanEntries,
    /// Writes each record's entries.
    WriteEntries {
        /// Records, one thread each.
        records: u32,
    },
    /// Counts one digit of keys that are sorted.
    CountDigits(Digit),
    /// Sums those counts into offsets.
    ScanDigits,
    /// Moves keys by one digit.
    ScatterDigits(Digit),
    /// Finds where each tile's entries are.
    FindRanges {
        /// Entries, one thread each.
        entries: u32,
    },
    /// Composites tiles' lists.
    CompositeLists {
        /// Tiles across and down.
        tiles: [u32; 2],
    },
    /// Merges the classified voxels of bricks into nodes of an octree.
    MergeBricks {
        /// Bricks along x, y, z, a workgroup each.
        bricks: [u32; 3],
    },
    /// Counts the polygons that each pixel sees.
    CountPolygons {
        /// Triangles.
        triangles: u32,
    },
    /// Gives every pixel room for its polygons.
    PlacePolygons {
        /// Pixels, one thread each.
        pixels: u32,
    },
    /// Writes each pixel's polygons.
    WritePolygons {
        /// Triangles.
        triangles: u32,
    },
    /// Sorts each pixel's polygons.
    SortPolygons {
        /// Pixels, one thread each.
        pixels: u32,
    },
    /// Background and sRGB.
    Present,
}

/// One digit of a sort.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digit {
    /// Which, from the lowest.
    pub round: u32,
    /// Threads, each with its run of keys.
    pub threads: u32,
}

/// Where a splat pass reads its records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// What [`Pass::EmitKernels`] wrote, as many as it counted.
    Emitted,
    /// This many that the host uploaded.
    Uploaded(u32),
}

impl Pass {
    /// The pass's one name: its shader's file, its label, its row in the statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::CountSegments { .. } => super::shader::COUNT_SEGMENTS.name,
            Self::ScanSegments | Self::ScanEntries | Self::ScanDigits => {
                super::shader::SCAN_COUNTS.name
            }
            Self::EmitKernels { .. } => super::shader::EMIT_KERNELS.name,
            Self::Splat(_) => super::shader::SPLAT.name,
            Self::ReconstructSlabs { .. } => super::shader::RECONSTRUCT_SLABS,
            Self::ProjectValues { .. } => super::shader::PROJECT_VALUES.name,
            Self::ShadeSamples { .. } => super::shader::SHADE_SAMPLES.name,
            Self::Gather { pass, .. } => pass,
            Self::CountEntries { .. } => super::shader::COUNT_ENTRIES.name,
            Self::CountVectors { .. } => super::shader::COUNT_VECTORS.name,
            Self::CompositeVectors { .. } => super::shader::COMPOSITE_VECTORS,
            Self::WriteEntries { .. } => super::shader::WRITE_ENTRIES.name,
            Self::CountDigits(_) => super::shader::COUNT_DIGITS.name,
            Self::ScatterDigits(_) => super::shader::SCATTER_DIGITS.name,
            Self::FindRanges { .. } => super::shader::FIND_RANGES.name,
            Self::CompositeLists { .. } => super::shader::COMPOSITE_LISTS.name,
            Self::MergeBricks { .. } => super::shader::MERGE_BRICKS.name,
            Self::CountPolygons { .. } => super::shader::COUNT_POLYGONS.name,
            Self::PlacePolygons { .. } => super::shader::PLACE_POLYGONS.name,
            Self::WritePolygons { .. } => super::shader::WRITE_POLYGONS.name,
            Self::SortPolygons { .. } => super::shader::SORT_POLYGONS.name,
            Self::Present => super::shader::PRESENT.name,
        }
    }
}

/// A piece of `full`: some rows of the grid, classified, compacted and drawn.
pub fn grid_piece(segments: u32) -> [Pass; 4] {
    [
        Pass::CountSegments { segments },
        Pass::ScanSegments,
        Pass::EmitKernels { segments },
        Pass::Splat(Source::Emitted),
    ]
}

/// A piece of an octree cut.
pub fn node_piece(records: u32) -> [Pass; 1] {
    [Pass::Splat(Source::Uploaded(records))]
}

/// A piece of a picture in slabs, or of values projected along them.
pub fn slab_piece(tiles: u32, projects: bool) -> [Pass; 1] {
    [if projects { Pass::ProjectValues { tiles } } else { Pass::ReconstructSlabs { tiles } }]
}

/// The lists of scattered kernels, before they are sorted.
pub fn list_entries(records: u32) -> [Pass; 3] {
    [Pass::CountEntries { records }, Pass::ScanEntries, Pass::WriteEntries { records }]
}

/// The lists of vector splats, before they are sorted.
pub fn vector_entries(splats: u32) -> [Pass; 3] {
    [Pass::CountVectors { splats }, Pass::ScanEntries, Pass::WriteEntries { records: splats }]
}

/// A sort by so many digits.
pub fn sort(rounds: u32, threads: u32) -> Vec<Pass> {
    (0..rounds)
        .map(|round| Digit { round, threads })
        .flat_map(|digit| [Pass::CountDigits(digit), Pass::ScanDigits, Pass::ScatterDigits(digit)])
        .collect()
}

/// What a pass took, summed over the pieces of a frame.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Milliseconds by the timer in use.
    pub gpu_ms: f64,
    /// How often it ran.
    pub runs: u32,
}

/// Adds a pass's time to its row, which keep the order of first appearance.
pub fn add_time(rows: &mut Vec<PassTime>, pass: Pass, gpu_ms: f64) {
    match rows.iter_mut().find(|row| row.name == pass.name()) {
        Some(row) => {
            row.gpu_ms += gpu_ms;
            row.runs += 1;
        }
        None => rows.push(PassTime { name: pass.name(), gpu_ms, runs: 1 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_one_pass_share_a_row() {
        let mut rows = Vec::new();
        add_time(&mut rows, Pass::ScanSegments, 1.0);
        add_time(&mut rows, Pass::Splat(Source::Emitted), 2.0);
        add_time(&mut rows, Pass::Splat(Source::Uploaded(3)), 4.0);
        assert_eq!(rows[1], PassTime { name: "splat", gpu_ms: 6.0, runs: 2 });
        assert_eq!(rows.len(), 2);
    }
}
