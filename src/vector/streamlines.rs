//! Lines along a field of vectors, by an adaptive Runge–Kutta method of fifth order.
//!
//! Lengths are steps of the grid: a line is followed in index space, at unit speed, so that how closely
//! it is followed does not depend on how long the vectors are. Between the grid's points vectors are
//! linear along each axis of it, and so are the places of grids that are not evenly spaced. Of cells that lie anywhere it is
//! the lattice's index space that their vectors were sampled on, and the vectors are the cells' own.

use glam::DVec3;

use super::grid_map::GridMap;
use crate::core::memory::{self, human_bytes};
use crate::core::{Cancelled, Looks, Ticket};
use crate::volume::VectorField;

/// How lines are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Following {
    /// How far a step may be off, steps of the grid.
    pub tolerance: f64,
    /// How long a line may be to either side of its seed, steps of the grid.
    pub most_length: f64,
    /// The longest step, steps of the grid: how far apart places of a line are.
    pub most_step: f64,
    /// Share of the greatest length below which a vector counts as zero: measured flows are noise where they are slow.
    pub least_speed: f64,
}

impl Default for Following {
    fn default() -> Self {
        Self { tolerance: 1e-4, most_length: 200.0, most_step: 0.5, least_speed: 0.02 }
    }
}

/// Why a line ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At the border of the grid.
    Border,
    /// Where vectors are zero, or there are none.
    Still,
    /// It is as long as it may be.
    Length,
    /// It winds about one place, no farther than a tenth of its way: more of it would lie where it lies.
    Winding,
}

/// Steps of the grid that a line goes on for before it is asked how far it has come, and once more for lines that
/// wind more widely.
const WINDING: [f64; 2] = [10.0, 40.0];
/// A line winds where it has come no farther along any axis than this share of its way: on circles of a radius of
/// half a step, and of two steps. Where noise flows most lines would, thousands of times over one pixel.
const LEAST_WAY: f64 = 0.1;

/// A line along the vectors.
#[derive(Debug, Clone, PartialEq)]
pub struct Streamline {
    /// World positions along the flow.
    pub places: Vec<DVec3>,
    /// Lengths of the vectors there.
    pub speeds: Vec<f64>,
    /// Why it ends against the flow, and along it.
    pub ends: [End; 2],
}

/// What has no lines.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamlineError {
    /// See [`Cancelled`].
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// More than memory holds.
    #[error(
        "expected streamlines that fit in memory, found that they take more than the {} that are free; ask for fewer, or for \
         shorter ones",
        human_bytes(*free_bytes)
    )]
    TooLong {
        /// Bytes that may be taken.
        free_bytes: u64,
    },
}

/// Bytes that a place of a line takes, together with what is made of it: rings of tubes' corners and the triangles between.
const BYTES_A_PLACE: u64 = 1536;
/// Places between two looks at the ticket.
const BETWEEN_LOOKS: usize = 1 << 10;

/// Coefficients of Dormand and Prince (1980), RK5(4)7M: nodes are not needed where nothing depends on
/// time.
const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// What the step of fifth order differs by from that of fourth.
const E: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// One step, and by how much it is thought to be off; `None` where the field ends on the way.
fn step(at: DVec3, h: f64, velocity: &impl Fn(DVec3) -> Option<DVec3>) -> Option<(DVec3, f64)> {
    let mut k = [DVec3::ZERO; 7];
    k[0] = velocity(at)?;
    let mut to = at;
    for (i, row) in A.iter().enumerate() {
        to = at + row.iter().zip(&k).map(|(a, k)| *k * (*a * h)).sum::<DVec3>();
        k[i + 1] = velocity(to)?;
    }
    let off: DVec3 = E.iter().zip(&k).map(|(e, k)| *k * (*e * h)).sum();
    Some((to, off.length()))
}

/// Why a line is not followed to its end.
enum FollowError {
    Cancelled(Cancelled),
    /// More places than there may be.
    Many,
}

impl From<Cancelled> for FollowError {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

/// Vectors on a grid, as they are followed.
struct Flow<'a> {
    field: &'a VectorField,
    map: GridMap<'a>,
    least_speed: f64,
}

impl Flow<'_> {
    /// The vector at a place of index space; `None` beyond the outermost points, and where one of those
    /// about it is none.
    fn vector(&self, at: DVec3) -> Option<DVec3> {
        if let Some(cells) = &self.field.on_cells {
            return cells.at(self.map.world(at)).map(|(vector, _)| vector);
        }
        let cell = self.map.cell(at)?;
        let mut sum = DVec3::ZERO;
        for (i, weight) in self.map.weights(&cell) {
            let vector = self.field.vectors[i].as_dvec3();
            if !vector.is_finite() {
                return None;
            }
            sum += vector * weight;
        }
        Some(sum)
    }

    /// Unit direction in index space along the flow, or against it.
    fn direction(&self, at: DVec3, way: f64) -> Option<DVec3> {
        let vector = self.vector(at)?;
        match vector.length() > self.least_speed {
            true => {
                let steps = self.map.index_vector(&self.map.cell(at)?, vector);
                steps.try_normalize().map(|v| v * way)
            }
            false => None,
        }
    }

    /// Whether a place of index space lies in none of the cells that the vectors are on.
    fn is_beyond_cells(&self, at: DVec3) -> bool {
        self.field.on_cells.as_ref().is_some_and(|cells| cells.at(self.map.world(at)).is_none())
    }

    /// Distance to the border along a direction.
    fn to_border(&self, at: DVec3, direction: DVec3) -> f64 {
        let dims = self.field.places.dims();
        let distance = |axis: usize| {
            let (last, along) = (dims[axis] as f64 - 1.0, direction[axis]);
            let reach = if dims[axis] == 1 { 0.5 } else { 0.0 };
            match along {
                _ if along > 0.0 => (last + reach - at[axis]) / along,
                _ if along < 0.0 => (-reach - at[axis]) / along,
                _ => f64::INFINITY,
            }
        };
        (0..3).map(distance).fold(f64::INFINITY, f64::min).max(0.0)
    }

    /// How far it is along a direction to a little before the next face of a cell, or from there to a little
    /// behind it: where a grid is not evenly spaced, directions of index space jump there, and a step that
    /// looks at both sides has an error that nothing tells of.
    fn to_face(&self, at: DVec3, direction: DVec3) -> f64 {
        const NEAR: f64 = 1e-3;
        if self.map.is_even() {
            return f64::INFINITY;
        }
        let distance = |axis: usize| {
            let (place, along) = (at[axis], direction[axis]);
            match along {
                _ if along > 0.0 => (place.floor() + 1.0 - place) / along,
                _ if along < 0.0 => (place.ceil() - 1.0 - place) / along,
                _ => f64::INFINITY,
            }
        };
        let face = (0..3).map(distance).fold(f64::INFINITY, f64::min);
        if face > 2.0 * NEAR { face - NEAR } else { face + NEAR }
    }

    /// Places of index space from a seed on, without it, `most` of them, and why they end.
    ///
    /// # Errors
    /// More than that, or cancelled.
    fn follow(
        &self,
        seed: DVec3,
        way: f64,
        (how, most): (&Following, usize),
        ticket: &Ticket,
    ) -> Result<(Vec<DVec3>, End), FollowError> {
        /// Steps shorter than this end at the border, or nowhere.
        const LEAST_STEP: f64 = 1e-4;
        let velocity = |at: DVec3| self.direction(at, way);
        let (mut at, mut length, mut h) = (seed, 0.0, 0.1 * how.most_step);
        let mut places = Vec::new();
        let mut lengths = Vec::new();
        let mut looks = Looks::every(ticket, BETWEEN_LOOKS);
        // Each step is tried a few times at most: their number is bound by the length.
        loop {
            let left = how.most_length - length;
            if left <= LEAST_STEP {
                return Ok((places, End::Length));
            }
            let Some(direction) = velocity(at) else { return Ok((places, End::Still)) };
            h = h.min(left).min(how.most_step);
            let tried = h.min(self.to_face(at, direction));
            match step(at, tried, &velocity) {
                Some((to, off)) if off <= how.tolerance || tried <= LEAST_STEP => {
                    at = to;
                    length += tried;
                    if places.len() == most {
                        return Err(FollowError::Many);
                    }
                    places.push(at);
                    lengths.push(length);
                    looks.after(1)?;
                    if winds(&places, &lengths) {
                        return Ok((places, End::Winding));
                    }
                    let next = (0.9 * (how.tolerance / off.max(1e-300)).powf(0.2)).clamp(0.2, 5.0);
                    // A step that ended at a face says nothing against longer ones.
                    h = if tried < h { h.max(tried * next) } else { tried * next };
                }
                Some((_, off)) => {
                    h = tried * (0.9 * (how.tolerance / off).powf(0.2)).clamp(0.2, 0.9);
                    h = h.max(LEAST_STEP);
                }
                None if tried > LEAST_STEP => h = (0.5 * tried).max(LEAST_STEP),
                None => {
                    let border = self.to_border(at, direction);
                    if self.is_beyond_cells(at + direction * (2.0 * LEAST_STEP)) {
                        return Ok((places, End::Border));
                    }
                    if border > 2.0 * LEAST_STEP {
                        return Ok((places, End::Still));
                    }
                    if border > 0.0 {
                        places.push(at + direction * border);
                    }
                    return Ok((places, End::Border));
                }
            }
        }
    }
}

/// Whether a line of places, at such lengths, winds about one place (see [`LEAST_WAY`]).
fn winds(places: &[DVec3], lengths: &[f64]) -> bool {
    let (Some(&last), Some(&before)) = (lengths.last(), lengths.iter().rev().nth(1)) else {
        return false;
    };
    WINDING.iter().any(|way| {
        // Once every such way, so that each place is looked at once a way.
        if (last / way).floor() <= (before / way).floor() {
            return false;
        }
        let first = lengths.partition_point(|length| *length < last - way);
        let recent = &places[first..];
        let [low, high] = [DVec3::min, DVec3::max]
            .map(|of| recent.iter().copied().reduce(of).unwrap_or_default());
        (high - low).max_element() < LEAST_WAY * way
    })
}

/// Where lines begin.
#[derive(Debug, Clone, PartialEq)]
pub enum Seeds {
    /// About so many, evenly, on the plane of the grid across its axis of this number (0..=2) at a share of
    /// its extent, 0..=1. At least one.
    OnPlane {
        /// The axis.
        axis: usize,
        /// Where along it.
        share: f64,
        /// How many, about.
        count: usize,
    },
    /// World points.
    At(Vec<DVec3>),
}

/// The lines through seeds, in the world, in their order. Seeds beyond the grid, or where nothing flows,
/// have none. The same seeds make the same lines.
///
/// # Errors
/// More than fits in memory, or cancelled.
pub fn streamlines(
    field: &VectorField,
    seeds: &Seeds,
    how: &Following,
    ticket: &Ticket,
) -> Result<Vec<Streamline>, StreamlineError> {
    streamlines_within(field, seeds, how, memory::free_bytes(), ticket)
}

/// The same where so many bytes are free.
fn streamlines_within(
    field: &VectorField,
    seeds: &Seeds,
    how: &Following,
    free_bytes: u64,
    ticket: &Ticket,
) -> Result<Vec<Streamline>, StreamlineError> {
    if let Some(cells) = &field.on_cells {
        cells.prepare(ticket)?;
    }
    let map = GridMap::new(&field.places);
    let mut left = usize::try_from(free_bytes / BYTES_A_PLACE).unwrap_or(usize::MAX);
    let failed = |error| match error {
        FollowError::Cancelled(cancelled) => StreamlineError::Cancelled(cancelled),
        FollowError::Many => StreamlineError::TooLong { free_bytes },
    };
    let flow = Flow { field, map, least_speed: how.least_speed * field.statistics.max };
    let on_plane = match seeds {
        Seeds::OnPlane { axis, share, count } => {
            seeds_on_plane(&flow.map, field.places.dims(), *axis, *share, *count)
        }
        Seeds::At(_) => Vec::new(),
    };
    let count = match seeds {
        Seeds::OnPlane { .. } => on_plane.len(),
        Seeds::At(points) => points.len(),
    };
    let mut lines = Vec::new();
    for i in 0..count {
        ticket.checkpoint(i as u64, count as u64)?;
        let seed = match seeds {
            Seeds::OnPlane { .. } => Some(on_plane[i]),
            Seeds::At(points) => flow.map.index_of(points[i]),
        };
        let Some(seed) = seed.filter(|seed| flow.direction(*seed, 1.0).is_some()) else { continue };
        let (mut places, before) = flow.follow(seed, -1.0, (how, left), ticket).map_err(failed)?;
        left = left.saturating_sub(places.len());
        places.reverse();
        places.push(seed);
        let (ahead, after) = flow.follow(seed, 1.0, (how, left), ticket).map_err(failed)?;
        left = left.saturating_sub(ahead.len());
        places.extend(ahead);
        let speeds = places.iter().map(|at| flow.vector(*at).map_or(0.0, DVec3::length)).collect();
        let places = places.into_iter().map(|at| flow.map.world(at)).collect();
        lines.push(Streamline { places, speeds, ends: [before, after] });
    }
    Ok(lines)
}

/// So many places of a field's vectors, in their order: each stands for as much of the sum of all squared lengths, so that
/// there are more where vectors are long. A place may come twice where one vector is as long as many others. None of a field
/// without any length.
pub fn seeds_at_vectors(field: &VectorField, count: usize) -> Vec<DVec3> {
    let square = |i: usize| {
        let length = field.magnitudes.get(i);
        if length.is_finite() { length * length } else { 0.0 }
    };
    let all: f64 = (0..field.vectors.len()).map(square).sum();
    if !(all > 0.0 && all.is_finite()) {
        return Vec::new();
    }
    let mut seeds = Vec::with_capacity(count);
    let mut passed = 0.0;
    for i in 0..field.vectors.len() {
        passed += square(i);
        while seeds.len() < count && passed > all * (seeds.len() as f64 + 0.5) / count as f64 {
            seeds.push(field.places.at(i).0);
        }
    }
    seeds
}

/// Places of index space on a plane: see [`Seeds::OnPlane`].
fn seeds_on_plane(
    map: &GridMap<'_>,
    dims: [usize; 3],
    axis: usize,
    share: f64,
    count: usize,
) -> Vec<DVec3> {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let last = DVec3::from(dims.map(|n| n as f64 - 1.0));
    // As long as the grid is in its middle: curvilinear ones differ from place to place.
    let extent = |along: usize| {
        let mut ends = [last * 0.5; 2];
        (ends[0][along], ends[1][along]) = (0.0, last[along]);
        let pieces = 16;
        let at = |i: i32| map.world(ends[0].lerp(ends[1], f64::from(i) / f64::from(pieces)));
        let length: f64 = (0..pieces).map(|i| (at(i + 1) - at(i)).length()).sum();
        length.max(f64::MIN_POSITIVE)
    };
    let columns = (count as f64 * extent(u) / extent(v)).sqrt();
    let columns = columns.round().clamp(1.0, count.max(1) as f64);
    let rows = (count as f64 / columns).round().max(1.0);
    let mut seeds = Vec::new();
    for row in 0..rows as usize {
        for column in 0..columns as usize {
            let mut index = DVec3::ZERO;
            index[axis] = share * last[axis];
            index[u] = (column as f64 + 0.5) / columns * last[u];
            index[v] = (row as f64 + 0.5) / rows * last[v];
            seeds.push(index);
        }
    }
    seeds
}

/// So many seeds at a world point and about it, evenly within a radius; the first one there.
pub fn seeds_about(point: DVec3, radius: f64, count: usize) -> Vec<DVec3> {
    // Turned by the golden angle from one to the next, so that no direction is left out.
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|i| {
            let (share, turn) = (i as f64 / last, golden * i as f64);
            let height = 1.0 - 2.0 * (i as f64 * 0.754_877_666_246_693).fract();
            let across = (1.0 - height * height).max(0.0).sqrt();
            let unit = DVec3::new(across * turn.cos(), across * turn.sin(), height);
            point + unit * (radius * share.cbrt())
        })
        .collect()
}

/// So many seeds from one world point to another, both with one where there are two or more.
pub fn seeds_on_line(from: DVec3, to: DVec3, count: usize) -> Vec<DVec3> {
    let last = count.saturating_sub(1).max(1) as f64;
    let share = |i: usize| if count == 1 { 0.5 } else { i as f64 / last };
    (0..count).map(|i| from.lerp(to, share(i))).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DMat3, Vec3};

    use super::*;
    use crate::volume::{Lattice, Places};

    fn field(lattice: Lattice, of: impl Fn(DVec3) -> DVec3) -> VectorField {
        let places = Places::Lattice(lattice);
        let vectors: Arc<[Vec3]> =
            (0..lattice.len()).map(|i| of(places.at(i).0).as_vec3()).collect();
        VectorField::new("flow", places, vectors, &Ticket::new()).unwrap()
    }

    fn lines(field: &VectorField, seeds: &[DVec3], how: Following) -> Vec<Streamline> {
        streamlines(field, &Seeds::At(seeds.into()), &how, &Ticket::new()).unwrap()
    }

    /// Linear along each axis, and so between the points what it is on them.
    fn rotation() -> VectorField {
        let lattice = Lattice { origin: DVec3::splat(-10.0), ..Lattice::unit([21; 3]) };
        field(lattice, |p| DVec3::new(-p.y, p.x, 0.0))
    }

    #[test]
    fn seeds_at_vectors_are_the_more_the_longer_these_are_and_none_where_they_are_no_numbers() {
        let lattice = Lattice::unit([10; 3]);
        let field = field(lattice, |p| match p.x {
            x if x < 1.0 => DVec3::splat(f64::NAN),
            x if x < 5.0 => DVec3::X,
            _ => DVec3::Y * 3.0,
        });
        let seeds = seeds_at_vectors(&field, 98);
        let slow = seeds.iter().filter(|at| at.x < 5.0).count();
        // 400 squares of 1, and 500 of 9; none of 100.
        assert_eq!((seeds.len(), slow), (98, 8));
        assert!(seeds.iter().all(|at| at.x >= 1.0));
        let layers: Vec<usize> =
            (0..10).map(|z| seeds.iter().filter(|at| at.z == f64::from(z)).count()).collect();
        assert!(layers.iter().all(|n| (9..=10).contains(n)), "all parts have some: {layers:?}");
        let still = self::field(lattice, |_| DVec3::ZERO);
        assert_eq!(seeds_at_vectors(&still, 5), []);
    }

    #[test]
    fn lines_of_a_rotation_are_circles() {
        let seed = DVec3::new(6.0, 0.0, 1.25);
        let how = Following { most_length: 12.0 * std::f64::consts::PI, ..Following::default() };
        let [line] = &lines(&rotation(), &[seed], how)[..] else { panic!("one line") };
        assert_eq!(line.ends, [End::Length; 2]);
        for (place, speed) in line.places.iter().zip(&line.speeds) {
            let radius = place.truncate().length();
            // 150 steps of an error below 1e-4 each; measured 9e-6.
            assert!((radius - 6.0).abs() < 1e-4 && place.z == 1.25, "{place}");
            assert!((speed - radius).abs() < 1e-6);
        }
        // Once round to either side.
        let (first, last) = (line.places[0], line.places[line.places.len() - 1]);
        assert!((first - seed).length() < 1e-2 && (last - seed).length() < 1e-2, "{first} {last}");
    }

    /// A rotation on cells in [−12, 12]³; on a lattice beside them another wind blows.
    fn on_cells() -> VectorField {
        let on_cells = Some(Arc::new(crate::volume::rotation_on_wedges()));
        let lattice = Lattice { origin: DVec3::splat(-12.0), ..Lattice::unit([25; 3]) };
        VectorField { on_cells, ..field(lattice, |_| DVec3::new(0.0, 0.0, 14.0)) }
    }

    #[test]
    fn lines_on_cells_follow_the_cells_own_vectors_and_end_where_these_do() {
        let seed = DVec3::new(6.0, 0.0, 1.25);
        let how = Following { most_length: 12.0 * std::f64::consts::PI, ..Following::default() };
        let [line] = &lines(&on_cells(), &[seed], how)[..] else { panic!("one line") };
        assert_eq!(line.ends, [End::Length; 2]);
        for (place, speed) in line.places.iter().zip(&line.speeds) {
            let radius = place.truncate().length();
            // Measured: 5e-5.
            assert!((radius - 6.0).abs() < 2e-4 && (place.z - 1.25).abs() < 1e-6, "{place}");
            assert!((speed - radius).abs() < 1e-6);
        }
        // Circles that leave the cube end at its border.
        let far = DVec3::new(9.5, 5.0, 1.25);
        let [line] = &lines(&on_cells(), &[far], how)[..] else { panic!("one line") };
        assert_eq!(line.ends, [End::Border; 2]);
        assert!(lines(&on_cells(), &[DVec3::splat(11.9)], how).is_empty(), "beside the cells");
    }

    /// What Dormand and Prince's conditions (Butcher's, to fifth order) ask of the coefficients, and their second
    /// solution as printed. These, too, are what the step is made of.
    #[test]
    fn coefficients_meet_the_conditions_of_their_order() {
        let c: Vec<f64> =
            std::iter::once(0.0).chain(A.iter().map(|row| row.iter().sum())).collect();
        for (c, printed) in c.iter().zip([0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0]) {
            assert!((c - printed).abs() < 1e-14, "{c} {printed}");
        }
        let fifth: Vec<f64> = A[5].into_iter().chain([0.0]).collect();
        let fourth = [
            5179.0 / 57600.0,
            0.0,
            7571.0 / 16695.0,
            393.0 / 640.0,
            -92097.0 / 339_200.0,
            187.0 / 2100.0,
            1.0 / 40.0,
        ];
        for ((fifth, fourth), off) in fifth.iter().zip(fourth).zip(E) {
            assert!((fifth - fourth - off).abs() < 1e-14, "{fifth} {fourth} {off}");
        }
        // Of each stage, what the stages before have of cᵏ.
        let inner = |k: i32, i: usize| -> f64 {
            let row = i.checked_sub(1).map_or([0.0; 6], |i| A[i]);
            row.iter().zip(&c).map(|(a, c)| a * c.powi(k)).sum()
        };
        for (solution, order) in [(&fifth[..], 5), (&fourth[..], 4)] {
            let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
                solution.iter().enumerate().map(|(i, b)| b * of(i)).sum()
            };
            for k in 0..order {
                let found = sum(&|i| c[i].powi(k)) * f64::from(k + 1);
                assert!((found - 1.0).abs() < 1e-13, "{order} {k}: {found}");
            }
            // Σ b cʲ a cᵏ = 1 / ((k + 1) (j + k + 2)).
            for (j, k) in (0..3).flat_map(|j| (1..4).map(move |k| (j, k))) {
                if j + k + 2 <= order {
                    let found = sum(&|i| c[i].powi(j) * inner(k, i));
                    let expected = 1.0 / f64::from((k + 1) * (j + k + 2));
                    assert!((found - expected).abs() < 1e-14, "{order} {j} {k}: {found}");
                }
            }
        }
    }

    #[test]
    fn lines_that_wind_about_one_place_end_there() {
        let ends = |radius: f64| {
            let seed = DVec3::new(radius, 0.0, 1.25);
            let [line] = &lines(&rotation(), &[seed], Following::default())[..] else { panic!() };
            let ways = line.places.windows(2).map(|pair| (pair[1] - pair[0]).length());
            (line.ends, ways.sum::<f64>())
        };
        // Chords are shorter than arcs, and a way ends with the step that passes it.
        for (radius, way) in [(0.45, 10.0), (0.55, 40.0), (1.9, 40.0)] {
            let (found, length) = ends(radius);
            assert_eq!(found, [End::Winding; 2], "{radius}");
            assert!((0.95 * 2.0 * way..2.0 * way + 1.1).contains(&length), "{radius}: {length}");
        }
        assert_eq!(ends(2.1).0, [End::Length; 2], "wider circles may be a vortex to be looked at");
    }

    /// Halving the step divides the error of a step by 2⁶, and so that of a line by 2⁵.
    #[test]
    fn the_method_is_of_fifth_order() {
        let velocity = |p: DVec3| Some(DVec3::new(-p.y, p.x, 0.0));
        let error = |steps: u32| {
            let h = 1.0 / f64::from(steps);
            let end = (0..steps).fold(DVec3::X, |at, _| step(at, h, &velocity).unwrap().0);
            (end - DVec3::new(1.0_f64.cos(), 1.0_f64.sin(), 0.0)).length()
        };
        let ratios = [error(4) / error(8), error(8) / error(16)];
        assert!(ratios.iter().all(|ratio| (26.0..40.0).contains(ratio)), "{ratios:?}");
        // And what a step is thought to be off by is of the fourth's.
        let off = |h: f64| step(DVec3::X, h, &velocity).unwrap().1;
        let ratio = off(0.2) / off(0.1);
        assert!((26.0..40.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn lines_end_at_the_border_where_nothing_flows_and_where_there_is_nothing() {
        let lattice = Lattice {
            spacing: DVec3::new(0.5, 2.0, 1.0),
            origin: DVec3::new(3.0, 0.0, 0.0),
            ..Lattice::unit([9, 5, 4])
        };
        let straight = field(lattice, |_| DVec3::new(1.0, 2.0, 0.0));
        let seed = DVec3::new(5.0, 3.9, 1.3);
        let [line] = &lines(&straight, &[seed], Following::default())[..] else { panic!() };
        assert_eq!(line.ends, [End::Border; 2]);
        // x from 3 to 7, y from 0 to 8.
        let (first, last) = (line.places[0], line.places[line.places.len() - 1]);
        assert!((first - DVec3::new(3.05, 0.0, 1.3)).length() < 1e-6, "{first}");
        assert!((last - DVec3::new(7.0, 7.9, 1.3)).length() < 1e-6, "{last}");
        // Towards x = 5 from both sides, where it comes to rest.
        let sink = field(lattice, |p| DVec3::new(5.0 - p.x, 0.0, 0.0));
        // Or, of 2 at most, where it is as slow as is asked for.
        for (least_speed, off) in [(Following::default().least_speed, 0.04), (1e-5, 2e-5)] {
            let how = Following { least_speed, ..Following::default() };
            let [line] = &lines(&sink, &[DVec3::new(3.3, 4.0, 1.0)], how)[..] else { panic!() };
            assert_eq!(line.ends, [End::Border, End::Still]);
            let last = line.places[line.places.len() - 1];
            assert!((0.9 * off..off + 1e-3).contains(&(5.0 - last.x)), "{last}");
        }
        let hole = field(lattice, |p| if p.x > 6.2 { DVec3::NAN } else { DVec3::X });
        let [line] = &lines(&hole, &[DVec3::new(4.0, 4.0, 1.0)], Following::default())[..] else {
            panic!()
        };
        assert_eq!(line.ends, [End::Border, End::Still]);
        assert!(line.places.iter().all(|place| place.x <= 6.0 + 1e-3));
        // A grid of one layer is half a step thick to either side: no border where a line is within it.
        let layer = Lattice { dims: [9, 5, 1], ..lattice };
        let hole =
            field(layer, |p| if p.x > 6.2 { DVec3::NAN } else { DVec3::new(1.0, 0.0, 0.01) });
        let [line] = &lines(&hole, &[DVec3::new(4.0, 4.0, 0.0)], Following::default())[..] else {
            panic!()
        };
        assert_eq!(line.ends, [End::Border, End::Still]);
        let outside = DVec3::new(0.0, 4.0, 1.0);
        assert!(lines(&straight, &[outside, DVec3::NAN], Following::default()).is_empty());
    }

    /// Axes that are askew and spacings that differ change nothing in the world.
    #[test]
    fn lines_are_of_the_world_whatever_the_grid() {
        let askew = Lattice {
            direction: DMat3::from_rotation_z(0.3),
            spacing: DVec3::new(0.5, 0.8, 1.0),
            origin: DVec3::new(-1.0, -9.0, -2.0),
            ..Lattice::unit([40, 30, 5])
        };
        let flow = |p: DVec3| DVec3::new(1.0, 0.2 * p.x, 0.0);
        let field = field(askew, flow);
        let seed = DVec3::new(6.0, 1.0, 0.3);
        let [line] = &lines(&field, &[seed], Following::default())[..] else { panic!() };
        for place in &line.places {
            // y − 0.1 x² is the same everywhere on it.
            let found = place.y - 0.1 * place.x * place.x;
            assert!((found - (1.0 - 3.6)).abs() < 1e-4, "{place} {found}");
        }
        assert!(line.places.len() > 20);
    }

    /// A flow on points of their own: x, y, z fastest first.
    fn uneven(
        dims: [usize; 3],
        at: impl Fn(DVec3) -> DVec3,
        of: impl Fn(DVec3) -> DVec3,
    ) -> VectorField {
        let [nx, ny, _] = dims;
        let count = dims.iter().product::<usize>();
        let index = |i: usize| DVec3::from([i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64));
        let points: Vec<DVec3> = (0..count).map(|i| at(index(i))).collect();
        let vectors = points.iter().map(|point| of(*point).as_vec3()).collect();
        let axes = vec![DMat3::IDENTITY; count].into();
        let places = Places::Points { dims, points: points.into(), axes };
        VectorField::new("flow", places, vectors, &Ticket::new()).unwrap()
    }

    #[test]
    fn lines_on_a_rectilinear_grid_are_those_of_the_world() {
        // Linear in the world, and so linear between any coordinates.
        let flow = |p: DVec3| DVec3::new(1.0, 0.2 * p.x, 0.0);
        let steps = |i: DVec3| DVec3::new(0.02 * i.x * i.x, 0.5 * i.y - 4.0, (0.3 * i.z).exp());
        let field = uneven([24, 30, 4], steps, flow);
        let seed = DVec3::new(6.0, 1.0, 1.7);
        let mut worst = 0.0_f64;
        let [line] = &lines(&field, &[seed], Following::default())[..] else { panic!() };
        assert_eq!(line.ends, [End::Border; 2]);
        for place in &line.places {
            let found = place.y - 0.1 * place.x * place.x;
            worst = worst.max((found - (1.0 - 3.6)).abs());
            assert!((place.z - 1.7).abs() < 1e-6, "{place}");
        }
        println!("measured on a rectilinear grid: {worst:.1e}");
        // Measured 1.2e-5; 1.6e-3 where steps look at both sides of a face.
        assert!(worst < 2e-4 && line.places.len() > 20, "{worst}");
    }

    #[test]
    fn lines_on_a_ring_go_round_it() {
        let ring = |i: DVec3| {
            let angle = 0.05 * i.y;
            DVec3::new((3.0 + i.x) * angle.cos(), (3.0 + i.x) * angle.sin(), i.z)
        };
        let field = uneven([5, 100, 3], ring, |p| DVec3::new(-p.y, p.x, 0.0));
        let seed = ring(DVec3::new(1.5, 40.0, 1.0));
        let mut worst = 0.0_f64;
        let [line] = &lines(&field, &[seed], Following::default())[..] else { panic!() };
        assert_eq!(line.ends, [End::Border; 2]);
        for place in &line.places {
            let radius = place.truncate().length();
            worst = worst.max((radius - 4.5).abs());
        }
        println!("measured on a ring: {worst:.1e}");
        // Between points the grid is straight: its chords are 1.4e-3 within the circle, and vectors between
        // them point out of them as far. Measured 8.6e-5; 2.3e-2 where
        // steps look at both sides of a face.
        assert!(worst < 1e-3, "{worst}");
        let ends = [line.places[0], line.places[line.places.len() - 1]];
        assert!((ends[0] - ring(DVec3::new(1.5, 0.0, 1.0))).length() < 4e-3, "{}", ends[0]);
        assert!((ends[1] - ring(DVec3::new(1.5, 99.0, 1.0))).length() < 4e-3, "{}", ends[1]);
    }

    #[test]
    fn seeds_are_as_many_as_asked_for_about_and_the_same_each_time() {
        let lattice = Lattice::unit([41, 11, 21]);
        let places = Places::Lattice(lattice);
        let map = GridMap::new(&places);
        let seeds_on_plane =
            |axis, share, count| seeds_on_plane(&map, lattice.dims, axis, share, count);
        let seeds = seeds_on_plane(1, 0.25, 50);
        assert!((40..=60).contains(&seeds.len()), "{}", seeds.len());
        assert!(seeds.iter().all(|seed| seed.y == 2.5 && seed.x > 0.0 && seed.x < 40.0));
        assert_eq!(seeds, seeds_on_plane(1, 0.25, 50));
        assert_eq!(seeds_on_plane(2, 0.5, 1).len(), 1);
        // As far apart along one side as along the other: 10 × 5 on 40 × 20.
        let apart = |of: fn(&DVec3) -> f64| {
            let mut places: Vec<f64> = seeds.iter().map(of).collect();
            places.sort_by(f64::total_cmp);
            places.dedup_by(|a, b| *a - *b < 1e-9);
            places[1] - places[0]
        };
        let apart = [apart(|seed| seed.x), apart(|seed| seed.z)];
        assert!((apart[0] / apart[1] - 1.0).abs() < 1e-9, "{apart:?}");
        let line = seeds_on_line(DVec3::ZERO, DVec3::X, 3);
        assert_eq!(line, [DVec3::ZERO, DVec3::X * 0.5, DVec3::X]);
        assert_eq!(seeds_on_line(DVec3::ZERO, DVec3::X, 1), [DVec3::X * 0.5]);
        let about = seeds_about(DVec3::Y, 2.0, 200);
        assert_eq!(about[0], DVec3::Y);
        let mean = about.iter().map(|seed| *seed - DVec3::Y).sum::<DVec3>() / 200.0;
        assert!(about.iter().all(|seed| (*seed - DVec3::Y).length() <= 2.0 + 1e-12));
        assert!(mean.length() < 0.1, "evenly: {mean}");
        // As many in each part of the ball as it is large: an eighth within half its radius.
        let near = about.iter().filter(|seed| (**seed - DVec3::Y).length() < 1.0).count();
        assert!((20..=30).contains(&near), "{near} of 200");
    }

    #[test]
    fn lines_longer_than_memory_are_refused() {
        let seeds = Seeds::At(vec![DVec3::X * 5.0]);
        let how = Following { most_length: 1e12, ..Following::default() };
        let found = streamlines_within(&rotation(), &seeds, &how, 1 << 20, &Ticket::new());
        assert_eq!(found, Err(StreamlineError::TooLong { free_bytes: 1 << 20 }));
        let said = found.map(drop).unwrap_err().to_string();
        assert!(said.contains("1.0 MB") && said.contains("shorter"), "{said}");
    }

    #[test]
    fn following_stops_when_cancelled() {
        let ticket = Ticket::new();
        ticket.cancel();
        let seeds = Seeds::At(vec![DVec3::X]);
        let found = streamlines(&rotation(), &seeds, &Following::default(), &ticket);
        assert_eq!(found, Err(StreamlineError::Cancelled(Cancelled)));
    }
}
