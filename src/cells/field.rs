//! One number on cells: on their points, or one a cell.

use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3};

use super::{Cells, Face, Finder, ShadingNormals, Surface};
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket, mapped};

/// Solids between two looks at the ticket: finding a volume takes a microsecond.
const A_PART: usize = 1 << 12;
/// And points.
const A_RUN: usize = 1 << 16;
/// A mean ends about where cells do if the holes beyond their faces lie so many times farther than their likes would.
const BEYOND: f64 = 1.2;
/// Solids whose growths are found before they are summed up.
const A_SUM: usize = 1 << 16;

/// What the numbers of a field stand on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum On {
    /// The points: shape functions lead from one to the next.
    Points,
    /// The cells: each has one number throughout.
    Cells,
}

/// Numbers on cells.
#[derive(Debug, Clone)]
pub struct CellField {
    cells: Arc<Cells>,
    on: On,
    /// Of every point, those that splits add among them; or of each of the file's cells.
    values: Vec<f64>,
    /// The outer faces of the solids that are there, once someone has asked: what draws them, and light.
    surface: OnceLock<Surface>,
}

impl CellField {
    /// Of one number for each of the file's points or cells.
    pub fn new(cells: Arc<Cells>, on: On, own: Vec<f64>) -> Self {
        let values = match on {
            On::Points => cells.with_added(own),
            On::Cells => own,
        };
        Self { cells, on, values, surface: OnceLock::new() }
    }

    /// The cells.
    pub fn cells(&self) -> &Arc<Cells> {
        &self.cells
    }

    /// What the numbers stand on.
    pub fn on(&self) -> On {
        self.on
    }

    /// The numbers at the corners of a solid; the rest are 0.
    pub fn at_corners(&self, solid: usize) -> [f64; 8] {
        let mut values = [0.0; 8];
        let corners = self.cells.solids()[solid].corners();
        for (value, corner) in values.iter_mut().zip(corners) {
            *value = self.at_corner(solid, *corner);
        }
        values
    }

    /// The number of a solid at a point of it.
    pub(super) fn at_corner(&self, solid: usize, corner: u32) -> f64 {
        match self.on {
            On::Points => self.values[corner as usize],
            On::Cells => self.values[self.cells.sources()[solid] as usize],
        }
    }

    /// Whether a solid has a finite number at each corner: others are nowhere.
    pub fn is_there(&self, solid: usize) -> bool {
        self.at_corners(solid).iter().all(|value| value.is_finite())
    }

    /// Which solids are drawn: those that are there, but for twins of earlier ones.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn drawn(&self, ticket: &Ticket) -> Result<Vec<bool>, Cancelled> {
        let count = self.cells.solids().len();
        let mut drawn = mapped(count, A_RUN, |solid| self.is_there(solid), ticket)?;
        self.surface(ticket)?.twins.iter().for_each(|twin| drawn[*twin as usize] = false);
        Ok(drawn)
    }

    /// The number at (r, s, t) of a solid.
    pub fn value(&self, solid: usize, unit: DVec3) -> f64 {
        if self.on == On::Cells {
            return self.values[self.cells.sources()[solid] as usize];
        }
        let weights = self.cells.solids()[solid].kind().weights(unit);
        self.at_corners(solid).iter().zip(weights).map(|(value, weight)| value * weight).sum()
    }

    /// Places with a number each: the points of solids that are there, or these solids' middles. With the mean, over the solids there,
    /// of what `of` makes of how far their like lie apart: of the mean of the products of offsets, in squares of `unit`. Beyond
    /// the outer faces of these solids are places without a number, so that a mean ends about where the cells do.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn samples(
        &self,
        unit: f64,
        of: impl Fn(DMat3) -> DMat3 + Sync,
        ticket: &Ticket,
    ) -> Result<Vec<(DVec3, f64, DMat3)>, Cancelled> {
        let points = self.cells.points();
        let solids: Vec<usize> = self.solids_there().collect();
        let spread = |i: usize| of(self.spread(solids[i], unit));
        let spreads = mapped(solids.len(), A_PART, spread, ticket)?;
        let mut looks = Looks::every(ticket, A_RUN);
        if self.on == On::Cells {
            let mut samples = Vec::with_capacity(solids.len());
            for (solid, spread) in solids.iter().zip(spreads) {
                looks.after(1)?;
                let middle = self.cells.solids()[*solid].kind().middle();
                let place = self.cells.placed(*solid).at(middle).0;
                samples.push((place, self.value(*solid, middle), spread));
            }
            let of_face = |face: &Face| of(self.spread(face.solid as usize, unit));
            samples.extend(self.beyond_faces(of_face, ticket)?);
            return Ok(samples);
        }
        let mut sums = vec![(DMat3::ZERO, 0.0); points.len()];
        for (solid, spread) in solids.iter().zip(spreads) {
            looks.after(1)?;
            for corner in self.cells.solids()[*solid].corners() {
                let (sum, count) = &mut sums[*corner as usize];
                *sum += spread;
                *count += 1.0;
            }
        }
        let used = sums.iter().enumerate().filter(|(_, (_, count))| *count > 0.0);
        let sample =
            |(i, (sum, count)): (usize, &(DMat3, f64))| (points[i], self.values[i], *sum / *count);
        let mut samples: Vec<(DVec3, f64, DMat3)> = used.map(sample).collect();
        // Points at one place have one spread there, as they will have among the samples.
        if let Some(places) = self.cells.places(ticket)? {
            for i in (0..sums.len()).filter(|i| places[*i] as usize != *i) {
                let (sum, count) = std::mem::take(&mut sums[i]);
                let at = &mut sums[places[i] as usize];
                *at = (at.0 + sum, at.1 + count);
            }
            for i in 0..sums.len() {
                sums[i] = sums[places[i] as usize];
            }
        }
        let of_face = |face: &Face| {
            let at = |corner: &u32| sums[*corner as usize];
            face.corners.iter().map(|corner| at(corner).0 / (4.0 * at(corner).1)).sum()
        };
        samples.extend(self.beyond_faces(of_face, ticket)?);
        Ok(samples)
    }

    /// The mean of the products of offsets to a solid's like beside it, in squares of `unit`.
    fn spread(&self, solid: usize, unit: f64) -> DMat3 {
        let own = self.cells.solids()[solid];
        let (kind, corners) = (own.kind(), own.corners());
        let middle = self.cells.placed(solid).at(kind.middle()).0;
        let products = corners.iter().map(|corner| {
            let offset = (self.cells.points()[*corner as usize] - middle) / unit;
            DMat3::from_cols(offset * offset.x, offset * offset.y, offset * offset.z)
        });
        let share = kind.neighbours_spread(self.on) / corners.len() as f64;
        products.fold(DMat3::ZERO, |sum, product| sum + product) * share
    }

    /// Places beyond the outer faces without a number, each with a spread of its face: somewhat farther from a face than the
    /// solid's other points, or than twice as far as its middle. None lies in a solid.
    fn beyond_faces(
        &self,
        spread: impl Fn(&Face) -> DMat3 + Sync,
        ticket: &Ticket,
    ) -> Result<Vec<(DVec3, f64, DMat3)>, Cancelled> {
        let (points, faces) = (self.cells.points(), &self.surface(ticket)?.faces);
        let finder = Finder::new(&self.cells, |solid| self.is_there(solid), ticket)?;
        let beyond = |i: usize| {
            let face = &faces[i];
            let number = face.solid as usize;
            let solid = &self.cells.solids()[number];
            let outwards = self.cells.area(face).normalize_or_zero();
            let count = if face.corners[2] == face.corners[3] { 3 } else { 4 };
            let on_face = face.corners[..count].iter().map(|corner| points[*corner as usize]);
            let centre = on_face.clone().sum::<DVec3>() / on_face.len() as f64;
            let depth = |at: DVec3| (centre - at).dot(outwards);
            let far = match self.on {
                On::Points => {
                    let others = solid.corners().iter().filter(|c| !face.corners.contains(c));
                    let depths: Vec<f64> = others.map(|c| depth(points[*c as usize])).collect();
                    depths.iter().sum::<f64>() / depths.len().max(1) as f64
                }
                On::Cells => 2.0 * depth(self.cells.placed(number).at(solid.kind().middle()).0),
            };
            let place = centre + outwards * (BEYOND * far);
            let is_free = far > 0.0 && !finder.holds(place);
            is_free.then(|| (place, f64::NAN, spread(face)))
        };
        let found = mapped(faces.len(), A_PART, beyond, ticket)?;
        Ok(found.into_iter().flatten().collect())
    }

    /// How many [`CellField::samples`] have a number.
    pub fn sample_count(&self) -> usize {
        if self.on == On::Cells {
            return self.solids_there().count();
        }
        let mut is_used = vec![false; self.values.len()];
        let corners = self.solids_there().flat_map(|solid| self.cells.solids()[solid].corners());
        corners.for_each(|corner| is_used[*corner as usize] = true);
        is_used.into_iter().filter(|is_used| *is_used).count()
    }

    /// The outer faces of the solids that are there: see [`Cells::surface`].
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn surface(&self, ticket: &Ticket) -> Result<&Surface, Cancelled> {
        if let Some(known) = self.surface.get() {
            return Ok(known);
        }
        let found = self.cells.surface(|solid| self.is_there(solid), ticket)?;
        Ok(self.surface.get_or_init(|| found))
    }

    /// What light takes for the field's growth. Found anew at each call.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn shading_normals(&self, ticket: &Ticket) -> Result<ShadingNormals, Cancelled> {
        ShadingNormals::new(self, &self.growths(ticket)?, ticket)
    }

    fn solids_there(&self) -> impl Iterator<Item = usize> {
        (0..self.cells.solids().len()).filter(|solid| self.is_there(*solid))
    }

    /// Least and greatest number in a solid: those of its corners, as shape functions are not negative.
    pub fn range_in(&self, solid: usize) -> [f64; 2] {
        let count = self.cells.solids()[solid].corners().len();
        let own = &self.at_corners(solid)[..count];
        own.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)])
    }

    /// How far a number found in a solid may lie from a level and still count as it, as a share of the numbers' range in
    /// that solid: see [`Self::slack`].
    pub const LEVEL_SLACK: f64 = 1.0 / 16.0;

    /// How far a number at a place of a solid may be off a level that is passed there, for the field to have that level
    /// rather than jump past it. `rim` is how far outside the solid counts as inside, in units of it.
    ///
    /// An isosurface is where the field has its level. Where cells overlap the field jumps: a ray finds a number below the level,
    /// and behind it one above, however close together it looks. What runs on has numbers as near to the level as anybody
    /// looks; what jumps has those of its two sides. So a number counts as the level where it is no further off than a share
    /// of its range in the solid about it. Neighbours whose faces are not quite the same then leave no slits in a surface,
    /// and what a jump adds to one is no longer than that share of a cell. Within the rim numbers are those of the border,
    /// which of thin solids is a good part of them.
    pub fn slack(&self, solid: usize, rim: f64) -> f64 {
        let [least, most] = self.range_in(solid);
        (Self::LEVEL_SLACK + rim) * (most - least)
    }

    /// Least and greatest number of the solids that are there; `None` where none is.
    pub fn range(&self) -> Option<[f64; 2]> {
        let none = || [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.min(c), b.max(d)];
        let of = |solid: usize| match self.is_there(solid) {
            true => self.range_in(solid),
            false => none(),
        };
        let all = parallel::merged(self.cells.solids().len(), none, of, wider);
        (all[0] <= all[1]).then_some(all)
    }

    /// Least and greatest offset of the corners of the solids that are there from a place, along three directions; `None`
    /// where none is.
    pub fn ends(&self, along: [DVec3; 3], from: DVec3) -> Option<[[f64; 2]; 3]> {
        let none = || [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let wider = |a: [[f64; 2]; 3], b: [[f64; 2]; 3]| {
            [0, 1, 2].map(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
        };
        let points = self.cells.points();
        let of = |solid: usize| match self.is_there(solid) {
            true => self.cells.solids()[solid].corners().iter().fold(none(), |ends, corner| {
                let offset = points[*corner as usize] - from;
                wider(ends, along.map(|along| [along.dot(offset); 2]))
            }),
            false => none(),
        };
        let all = parallel::merged(self.cells.solids().len(), none, of, wider);
        (all[0][0] <= all[0][1]).then_some(all)
    }

    /// What the field grows by per unit of the world at each point, as recovered: the mean of what it grows by in the
    /// middles of the solids about the point, by their volumes. Numbers of cells are taken to their points first, alike.
    /// Found anew at each call.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn growths(&self, ticket: &Ticket) -> Result<Vec<DVec3>, Cancelled> {
        let (cells, points) = (&self.cells, self.cells.points().len());
        let mut looks = Looks::every(ticket, A_PART);
        let volume_of = |solid: usize| {
            if self.is_there(solid) { cells.placed(solid).volume().abs() } else { 0.0 }
        };
        let volumes = mapped(cells.solids().len(), A_PART, volume_of, ticket)?;
        let mut weights = vec![0.0; points];
        for (solid, volume) in cells.solids().iter().zip(&volumes) {
            looks.after(1)?;
            solid.corners().iter().for_each(|corner| weights[*corner as usize] += volume);
        }
        let at_points = match self.on {
            On::Points => None,
            On::Cells => {
                let mut sums = vec![0.0; points];
                for (i, (solid, volume)) in cells.solids().iter().zip(&volumes).enumerate() {
                    looks.after(1)?;
                    let value = self.values[cells.sources()[i] as usize];
                    let share = if *volume > 0.0 { value * volume } else { 0.0 };
                    solid.corners().iter().for_each(|corner| sums[*corner as usize] += share);
                }
                let mean =
                    |(sum, weight): (f64, &f64)| if *weight > 0.0 { sum / weight } else { 0.0 };
                Some(sums.into_iter().zip(&weights).map(mean).collect::<Vec<_>>())
            }
        };
        let growth_of = |i: usize| {
            if volumes[i] <= 0.0 {
                return DVec3::ZERO;
            }
            let solid = &cells.solids()[i];
            let own = match &at_points {
                None => self.at_corners(i),
                Some(values) => {
                    let mut own = [0.0; 8];
                    for (value, corner) in own.iter_mut().zip(solid.corners()) {
                        *value = values[*corner as usize];
                    }
                    own
                }
            };
            cells.placed(i).gradient(own, solid.kind().middle()) * volumes[i]
        };
        let mut sums = vec![DVec3::ZERO; points];
        // Part by part, so that those of all are not held; summed up in their order.
        for first in (0..cells.solids().len()).step_by(A_SUM) {
            let some = first..(first + A_SUM).min(cells.solids().len());
            let growths = mapped(some.len(), A_PART, |i| growth_of(first + i), ticket)?;
            for (solid, growth) in cells.solids()[some].iter().zip(growths) {
                solid.corners().iter().for_each(|corner| sums[*corner as usize] += growth);
            }
        }
        let mean = |i: usize| match weights[i] {
            weight if weight > 0.0 => sums[i] / weight,
            _ => DVec3::ZERO,
        };
        mapped(points, A_RUN, mean, ticket)
    }
}
