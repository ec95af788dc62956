//! Fields on cells that lie anywhere: tetrahedra, hexahedra, wedges, pyramids, and what is split into these.
//!
//! Owns the cells of unstructured and curvilinear grids ([`Cells`]), the shape functions between their points
//! ([`Solid`]), which of them lie near a place ([`Listed`]) or hold it ([`Finder`]), their outer faces ([`Cells::surface`]), one number on
//! them ([`CellField`]), and what light takes for its growth ([`ShadingNormals`]). Refuses files, lattices of samples and drawing. Imports `core`.

mod depths;
mod field;
mod finder;
mod listed;
mod normals;
mod solid;
mod split;
mod surface;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::core::parallel;
use crate::core::{Cancelled, Ticket};

pub use depths::Depths;
pub use field::{CellField, On};
pub use finder::Finder;
pub use listed::Listed;
pub use normals::{LitFace, ShadingNormal, ShadingNormals};
pub use solid::{Kind, Placed, Rim, Solid};
pub use split::{has_extent, has_volume, is_flat};
pub use surface::{Face, Surface};

/// Triangles of less area beside their longer sides' square are lines.
const FLATTEST: f64 = 1e-9;

/// Cells that cannot be: what was expected, and what was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found}")]
pub struct CellsError {
    /// In words.
    pub expected: String,
    /// In words.
    pub found: String,
    /// What to try.
    pub advice: &'static str,
}

impl CellsError {
    /// Advice where the lists of a file contradict one another.
    const COPY: &str = "the file was altered, or its writer is at fault: copy it again";
    /// Advice where a type of cell is valid, but not read here.
    const SPLIT: &str =
        "split such cells into tetrahedra first (ParaView's Tetrahedralize), or leave them out";
    /// The same of polygons.
    const SPLIT_FLAT: &str =
        "split such cells into triangles first (ParaView's Tetrahedralize), or leave them out";
}

/// Cells as a file lists them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Listing {
    /// World positions of the points.
    pub points: Vec<DVec3>,
    /// What each cell is, by VTK's numbers (`vtkCellType.h`).
    pub types: Vec<u8>,
    /// Where the corners of each begin, and where the last one's end: one more than there are cells.
    pub starts: Vec<usize>,
    /// Numbers of points.
    pub corners: Vec<u32>,
    /// The faces of each polyhedron, by the number of its cell: lists of points' numbers.
    pub faces: BTreeMap<usize, Vec<Vec<u32>>>,
}

/// A point that a split adds: a mean of others.
#[derive(Debug, Clone, PartialEq)]
struct Blend {
    /// Numbers of points, and what each weighs.
    of: Vec<(u32, f64)>,
}

/// What is known of the cells of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Census {
    /// How many cells there are of each of VTK's types.
    pub by_type: BTreeMap<u8, usize>,
    /// Cells that were split into simpler ones.
    pub split: usize,
    /// Pieces without volume.
    pub flat: usize,
    /// Pieces whose points go round the other way.
    pub inverted: usize,
    /// Cells of points that are not finite, which are left out.
    pub not_finite: usize,
}

/// Cells and the points they stand on.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// World positions: of the file's points, then of those that splits add.
    points: Arc<[DVec3]>,
    /// How many of them are the file's.
    own_points: usize,
    /// How many cells the file has.
    own_cells: usize,
    blends: Vec<Blend>,
    solids: Vec<Solid>,
    /// Which of the file's cells each solid is of.
    sources: Vec<u32>,
    /// Of the file's polygons.
    triangles: Vec<[u32; 3]>,
    /// Which of the file's cells each of these is of.
    triangle_sources: Vec<u32>,
    /// Where no cell has volume, where the corners of each begin, and the last end; and these. Empty elsewhere.
    lists: (Vec<usize>, Vec<u32>),
    census: Census,
    /// Once someone has asked: each picture does.
    median_edge: OnceLock<f64>,
    bounds: OnceLock<[DVec3; 2]>,
    /// The first point at the place of each, where some are at one place; once someone has asked.
    places: OnceLock<Option<Box<[u32]>>>,
}

impl Cells {
    /// Those of a listing: cells with volume become solids, others are counted.
    ///
    /// # Errors
    /// Corners that are no points, too few or too many of them, and types that are not known.
    pub fn new(listing: Listing) -> Result<Self, CellsError> {
        let Listing { points, types, starts, corners, faces } = listing;
        if starts.len() != types.len() + 1 || starts.last() != Some(&corners.len()) {
            return Err(CellsError {
                expected: format!("corners for {} cells", types.len()),
                found: format!("{} in {} lists", corners.len(), starts.len().saturating_sub(1)),
                advice: CellsError::COPY,
            });
        }
        let count = points.len();
        let all = corners.iter().chain(faces.values().flatten().flatten());
        if let Some(corner) = all.into_iter().find(|corner| **corner as usize >= count) {
            return Err(CellsError {
                expected: format!("corners from 0 to {}", count as i64 - 1),
                found: corner.to_string(),
                advice: CellsError::COPY,
            });
        }
        let (own_points, own_cells) = (count, types.len());
        let mut census = Census::default();
        let mut split = split::Split::new(&points);
        let mut sources = Vec::new();
        for (cell, kind) in types.iter().enumerate() {
            *census.by_type.entry(*kind).or_default() += 1;
            let (begin, end) = (starts[cell], starts[cell + 1]);
            let own = corners.get(begin..end).ok_or_else(|| CellsError {
                expected: "offsets that rise from cell to cell".into(),
                found: format!("{end} after {begin} for cell {cell}"),
                advice: CellsError::COPY,
            })?;
            let none = Vec::new();
            let faces = faces.get(&cell).unwrap_or(&none);
            let mut all = own.iter().chain(faces.iter().flatten());
            if all.any(|corner| !points[*corner as usize].is_finite()) {
                census.not_finite += 1;
                continue;
            }
            if split.push(*kind, own, faces, cell)? {
                census.split += 1;
            }
            #[expect(
                clippy::cast_possible_truncation,
                reason = "files have fewer cells than 2^32"
            )]
            sources.resize(split.solids.len(), cell as u32);
        }
        let split::Split { solids, blends, added, triangles, triangle_sources, .. } = split;
        let points: Arc<[DVec3]> = points.into_iter().chain(added).collect();
        let lists = (starts, corners);
        let cells = Self {
            points,
            own_points,
            own_cells,
            blends,
            solids,
            sources,
            triangles,
            triangle_sources,
            lists,
            census,
            median_edge: OnceLock::new(),
            bounds: OnceLock::new(),
            places: OnceLock::new(),
        };
        Ok(cells.measured().or_flat())
    }

    /// The same, or, where no cell has volume, the faces of all of them as polygons. Lists of corners are kept in that case alone.
    fn or_flat(mut self) -> Self {
        let cells = self.sources.chunk_by(|a, b| a == b).count();
        if self.census.flat < cells {
            self.lists = Default::default();
            return self;
        }
        for face in self.faces_of_flat() {
            let source = self.sources[face.solid as usize];
            let area = |[a, b, c]: [u32; 3]| {
                let [a, b, c] = [a, b, c].map(|point| self.points[point as usize]);
                (b - a).cross(c - a).length()
                    / (b - a).length_squared().max((c - a).length_squared())
            };
            for triangle in face.triangles().filter(|triangle| area(*triangle) > FLATTEST) {
                self.triangles.push(triangle);
                self.triangle_sources.push(source);
            }
        }
        (self.solids, self.sources) = Default::default();
        self
    }

    /// The same with its cells without volume and those that go round the other way counted, by cells of the file, whatever they
    /// were split into.
    fn measured(mut self) -> Self {
        let measured = |solid: usize| {
            let placed = self.placed(solid);
            (placed.volume(), placed.is_flat())
        };
        let measured = parallel::list(self.solids.len(), measured);
        let mut rest = &measured[..];
        let [mut flat, mut inverted] = [0; 2];
        for own in self.sources.chunk_by(|a, b| a == b) {
            let (own, behind) = rest.split_at(own.len());
            rest = behind;
            let volume: f64 = own.iter().map(|(volume, _)| volume).sum();
            let is_flat = own.iter().all(|(_, is_flat)| *is_flat);
            flat += usize::from(is_flat);
            inverted += usize::from(volume < 0.0 && !is_flat);
        }
        self.census = Census { flat, inverted, ..self.census };
        self
    }

    /// The hexahedra between the points of a curvilinear grid, x fastest; two points or more along each axis. Those without volume and
    /// those that go round the other way are not counted, which drawing does not ask for ([`Cells::of_grid_measured`]).
    pub fn of_grid(points: &Arc<[DVec3]>, [nx, ny, nz]: [usize; 3]) -> Self {
        let at = |x: usize, y: usize, z: usize| {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "grids have fewer than 2^32 points"
            )]
            let at = ((z * ny + y) * nx + x) as u32;
            at
        };
        let solids = Solid::hexahedra([nx, ny, nz], at);
        let count = solids.len();
        #[expect(clippy::cast_possible_truncation, reason = "grids have fewer than 2^32 cells")]
        let sources = (0..count as u32).collect();
        let by_type = BTreeMap::from([(split::HEXAHEDRON, count)]);
        Self {
            points: Arc::clone(points),
            own_points: points.len(),
            own_cells: count,
            blends: Vec::new(),
            solids,
            sources,
            triangles: Vec::new(),
            triangle_sources: Vec::new(),
            lists: (Vec::new(), Vec::new()),
            census: Census { by_type, ..Census::default() },
            median_edge: OnceLock::new(),
            bounds: OnceLock::new(),
            places: OnceLock::new(),
        }
    }

    /// [`Cells::of_grid`] with all that is counted of others.
    pub fn of_grid_measured(points: &Arc<[DVec3]>, dims: [usize; 3]) -> Self {
        Self::of_grid(points, dims).measured()
    }

    /// World positions: of the file's points, then of those that splits add.
    pub fn points(&self) -> &Arc<[DVec3]> {
        &self.points
    }

    /// How many points the file has.
    pub fn own_points(&self) -> usize {
        self.own_points
    }

    /// How many cells the file has, those without volume among them.
    pub fn own_cells(&self) -> usize {
        self.own_cells
    }

    /// The cells with volume, as they are drawn.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// Which of the file's cells each solid is of.
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    /// The middle of each of the file's cells, as the mean of its solids' corners; not a number where a cell has no solid and
    /// others have.
    pub fn middles(&self) -> Arc<[DVec3]> {
        if self.solids.is_empty() {
            let (starts, corners) = &self.lists;
            let middle = |own: &[usize]| {
                let own = &corners[own[0]..own[1]];
                let sum: DVec3 = own.iter().map(|corner| self.points[*corner as usize]).sum();
                sum / own.len() as f64
            };
            return starts.windows(2).map(middle).collect();
        }
        let mut sums = vec![(DVec3::ZERO, 0.0); self.own_cells];
        for (solid, cell) in self.solids.iter().zip(&self.sources) {
            for corner in solid.corners() {
                let (sum, count) = &mut sums[*cell as usize];
                *sum += self.points[*corner as usize];
                *count += 1.0;
            }
        }
        let mean = |(sum, count): (DVec3, f64)| if count > 0.0 { sum / count } else { DVec3::NAN };
        sums.into_iter().map(mean).collect()
    }

    /// Triangles of the file's polygons, and of the solids' outer faces, each with the file's cell that it is of.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn triangles(&self, ticket: &Ticket) -> Result<Vec<([u32; 3], u32)>, Cancelled> {
        let faces = self.surface(|_| true, ticket)?.faces;
        let outer = faces.iter().flat_map(|face| {
            let source = self.sources[face.solid as usize];
            face.triangles().map(move |triangle| (triangle, source))
        });
        let own = self.triangles.iter().copied().zip(self.triangle_sources.iter().copied());
        Ok(own.chain(outer).collect())
    }

    /// Whether it is a surface: polygons, and no cell with volume.
    pub fn is_surface(&self) -> bool {
        self.solids.is_empty() && !self.triangles.is_empty()
    }

    /// Whether no cell joins points: there are none, or each is of points by themselves.
    pub fn join_nothing(&self) -> bool {
        self.census.by_type.keys().all(|kind| !split::joins(*kind))
    }

    /// What is known of the file's cells.
    pub fn census(&self) -> &Census {
        &self.census
    }

    /// A solid with its corners' places.
    pub fn placed(&self, solid: usize) -> Placed {
        self.solids[solid].placed(&self.points)
    }

    /// Least and greatest coordinates of a solid.
    pub fn bounds_of(&self, solid: usize) -> [DVec3; 2] {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.solids[solid].corners().iter().fold(none, |[low, high], corner| {
            let point = self.points[*corner as usize];
            [low.min(point), high.max(point)]
        })
    }

    /// Least and greatest coordinates of the solids; of all points where there is no solid.
    pub fn bounds(&self) -> [DVec3; 2] {
        *self.bounds.get_or_init(|| self.measured_bounds())
    }

    fn measured_bounds(&self) -> [DVec3; 2] {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let wider = |[low, high]: [DVec3; 2], point: &DVec3| [low.min(*point), high.max(*point)];
        if self.solids.is_empty() {
            return self.points.iter().filter(|point| point.is_finite()).fold(none, wider);
        }
        let corners = self.solids.iter().flat_map(Solid::corners);
        corners.map(|corner| &self.points[*corner as usize]).fold(none, wider)
    }

    /// The median length of the solids' edges; of many, of some thousands of them. 0 where there is none.
    pub fn median_edge(&self) -> f64 {
        *self.median_edge.get_or_init(|| self.measured_edge())
    }

    fn measured_edge(&self) -> f64 {
        const MOST: usize = 20_000;
        let every = self.solids.len().div_ceil(MOST).max(1);
        let mut lengths: Vec<f64> = Vec::new();
        for solid in self.solids.iter().step_by(every) {
            let corners = solid.corners();
            lengths.extend(solid.kind().edges().iter().filter_map(|[a, b]| {
                let [a, b] = [a, b].map(|i| self.points[corners[*i] as usize]);
                let length = a.distance(b);
                (length > 0.0).then_some(length)
            }));
        }
        if lengths.is_empty() {
            return 0.0;
        }
        let middle = lengths.len() / 2;
        *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Numbers on the file's points with those of the points that splits add.
    pub(crate) fn with_added(&self, mut own: Vec<f64>) -> Vec<f64> {
        own.reserve(self.blends.len());
        for blend in &self.blends {
            let value = blend.of.iter().map(|(point, weight)| own[*point as usize] * weight).sum();
            own.push(value);
        }
        own
    }
}

#[cfg(test)]
mod tests;
