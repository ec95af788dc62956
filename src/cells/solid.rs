//! One solid cell: its shape functions, and where a place lies in it.

use glam::{DMat3, DVec3};

use super::On;

/// What a solid is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Kind {
    /// Four points: r, s, t ≥ 0, r + s + t ≤ 1.
    Tetrahedron,
    /// Five: a square, and the point above it where t = 1.
    Pyramid,
    /// Six: two triangles, at t = 0 and t = 1; r, s ≥ 0, r + s ≤ 1.
    Wedge,
    /// Eight: two rings of four, at t = 0 and t = 1.
    Hexahedron,
}

impl Kind {
    /// How many points.
    pub fn points(self) -> usize {
        match self {
            Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
        }
    }

    /// Pairs of corners that an edge joins.
    pub fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Tetrahedron => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
            Self::Pyramid => &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
            Self::Wedge => {
                &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]]
            }
            Self::Hexahedron => &[
                [0, 1],
                [1, 2],
                [2, 3],
                [3, 0],
                [4, 5],
                [5, 6],
                [6, 7],
                [7, 4],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
            ],
        }
    }

    /// The corners of each face, around it, all the same way as seen from outside.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
            Self::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
            Self::Hexahedron => &[
                &[0, 3, 2, 1],
                &[4, 5, 6, 7],
                &[0, 1, 5, 4],
                &[1, 2, 6, 5],
                &[2, 3, 7, 6],
                &[3, 0, 4, 7],
            ],
        }
    }

    /// The shape function of each corner at (r, s, t); the rest are 0.
    pub fn weights(self, DVec3 { x: r, y: s, z: t }: DVec3) -> [f64; 8] {
        let mut weights = [0.0; 8];
        match self {
            Self::Tetrahedron => weights[..4].copy_from_slice(&[1.0 - r - s - t, r, s, t]),
            Self::Wedge => {
                let below = [1.0 - r - s, r, s];
                for (i, share) in below.into_iter().enumerate() {
                    (weights[i], weights[i + 3]) = (share * (1.0 - t), share * t);
                }
            }
            Self::Pyramid | Self::Hexahedron => {
                let ring = [(1.0 - r) * (1.0 - s), r * (1.0 - s), r * s, (1.0 - r) * s];
                for (i, share) in ring.into_iter().enumerate() {
                    weights[i] = share * (1.0 - t);
                    match self {
                        Self::Pyramid => weights[4] += share * t,
                        _ => weights[i + 4] = share * t,
                    }
                }
            }
        }
        weights
    }

    /// How far (r, s, t) lies beyond the solid's own region, in units of it; negative or 0 inside.
    pub fn beyond(self, DVec3 { x: r, y: s, z: t }: DVec3) -> f64 {
        let below = (-r).max(-s).max(-t);
        match self {
            Self::Tetrahedron => below.max(r + s + t - 1.0),
            Self::Wedge => below.max(r + s - 1.0).max(t - 1.0),
            Self::Pyramid | Self::Hexahedron => below.max(r - 1.0).max(s - 1.0).max(t - 1.0),
        }
    }

    /// The middle of its region.
    pub fn middle(self) -> DVec3 {
        match self {
            Self::Tetrahedron => DVec3::splat(0.25),
            Self::Pyramid => DVec3::new(0.5, 0.5, 0.25),
            Self::Wedge => DVec3::new(1.0 / 3.0, 1.0 / 3.0, 0.5),
            Self::Hexahedron => DVec3::splat(0.5),
        }
    }

    /// By how much squares of distances to neighbours are greater than those from its middle to its corners, where the samples are
    /// the middles, or the points, of a lattice of its like. Its neighbours are taken for those of cubes as large as its share of
    /// space, stretched as it is. (The corners of a cube lie half an edge away along each axis, the 18 nearest of a lattice 0.75
    /// edges; a cube has a point, and is two wedges, three pyramids or six tetrahedra.)
    pub(super) fn neighbours_spread(self, on: On) -> f64 {
        let (of_middles, cells_a_point) = match self {
            Self::Tetrahedron => (1.0817, 6.0_f64),
            Self::Pyramid => (1.449, 3.0),
            Self::Wedge => (1.6875, 2.0),
            Self::Hexahedron => (2.25, 1.0),
        };
        match on {
            On::Cells => of_middles,
            On::Points => of_middles * cells_a_point.cbrt().powi(2),
        }
    }

    /// Numbers at the corners as the factors of 1, r, s, t, rs, st, rt and rst, which is what all four kinds' shape
    /// functions are made of.
    pub fn polynomial<T>(self, at: [T; 8]) -> [T; 8]
    where
        T: Copy + Default + std::ops::Add<Output = T> + std::ops::Sub<Output = T>,
    {
        let none = T::default();
        let [p0, p1, p2, p3, p4, p5, p6, p7] = at;
        match self {
            Self::Tetrahedron => [p0, p1 - p0, p2 - p0, p3 - p0, none, none, none, none],
            Self::Wedge => {
                let (rt, st) = (p4 - p1 - p3 + p0, p5 - p2 - p3 + p0);
                [p0, p1 - p0, p2 - p0, p3 - p0, none, st, rt, none]
            }
            Self::Pyramid => {
                let rs = p2 - p1 - p3 + p0;
                [p0, p1 - p0, p3 - p0, p4 - p0, rs, p0 - p3, p0 - p1, none - rs]
            }
            Self::Hexahedron => {
                let (rs, st, rt) = (p2 - p1 - p3 + p0, p7 - p3 - p4 + p0, p5 - p1 - p4 + p0);
                let rst = (p6 - p5 - p7 + p4) - rs;
                [p0, p1 - p0, p3 - p0, p4 - p0, rs, st, rt, rst]
            }
        }
    }
}

/// A solid cell, by the numbers of its points: in VTK's order, of a tetrahedron, pyramid, wedge or hexahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solid {
    kind: Kind,
    corners: [u32; 8],
}

impl Solid {
    /// Corners beyond the kind's number are not looked at.
    pub fn new(kind: Kind, corners: [u32; 8]) -> Self {
        Self { kind, corners }
    }

    /// The hexahedra between so many points along x, y and z, of the numbers that `at` gives these.
    pub(super) fn hexahedra(
        [nx, ny, nz]: [usize; 3],
        at: impl Fn(usize, usize, usize) -> u32,
    ) -> Vec<Self> {
        let cubes = |n: usize| n.saturating_sub(1);
        let mut found = Vec::with_capacity(cubes(nx) * cubes(ny) * cubes(nz));
        for z in 0..cubes(nz) {
            for y in 0..cubes(ny) {
                for x in 0..cubes(nx) {
                    let ring =
                        |z| [at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z)];
                    let ([a, b, c, d], [e, f, g, h]) = (ring(z), ring(z + 1));
                    found.push(Self::new(Kind::Hexahedron, [a, b, c, d, e, f, g, h]));
                }
            }
        }
        found
    }

    /// Of the first of a list; there are enough.
    pub(super) fn of(kind: Kind, list: &[u32]) -> Self {
        let mut corners = [0; 8];
        corners[..kind.points()].copy_from_slice(&list[..kind.points()]);
        Self { kind, corners }
    }

    /// What it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Numbers of its points.
    pub fn corners(&self) -> &[u32] {
        &self.corners[..self.kind.points()]
    }

    /// With its corners' places.
    pub fn placed(&self, points: &[DVec3]) -> Placed {
        let mut places = [DVec3::ZERO; 8];
        for (place, corner) in places.iter_mut().zip(self.corners()) {
            *place = points[*corner as usize];
        }
        Placed::new(self.kind, places)
    }
}

/// A solution is found once a step is no longer than this, in units of the solid.
const EXACT: f64 = 1e-9;
/// Slopes shorter than this share of the solid's diagonal lead nowhere.
const COLLAPSED: f64 = 1e-12;
/// Beside squares of unit slopes.
const DAMPING: f64 = 1e-14;
const MOST_STEPS: usize = 30;
/// Solids are flat whose volume is no greater than what moving their corners by so many units in the last place of the greatest
/// coordinate along each axis can make of none.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// How far outside a solid a place still counts as inside, in single precision, in the index space of a lattice: no seam
/// opens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim {
    /// Samples.
    samples: f64,
}

impl Rim {
    /// Solids so thin that the rim is greater than this part of them are nothing that single precision can tell.
    pub const WIDEST: f64 = 0.5;
    /// Samples, at least: of lattices of 128 along an axis; of longer ones two units in the last place of the last sample.
    const LEAST: f64 = 3e-5;
    const A_SAMPLE: f64 = 2.4e-7;
    /// In units of the solid.
    const OF_UNIT: f64 = 2e-5;

    /// In the index space of a lattice of `dims` samples.
    pub fn of(dims: [usize; 3]) -> Self {
        let longest = dims.into_iter().max().unwrap_or(1) as f64;
        Self { samples: Self::LEAST.max(Self::A_SAMPLE * longest) }
    }

    /// In units of a solid, along a coordinate that grows so fast.
    pub fn along(self, row: DVec3) -> f64 {
        Self::OF_UNIT + self.samples * row.length()
    }
}

/// A solid's corners in a space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    kind: Kind,
    corners: [DVec3; 8],
    factors: [DVec3; 8],
    size: f64,
}

impl Placed {
    /// A point is inside a solid up to so far outside its own region: rounding must not open seams.
    pub const RIM: f64 = 1e-6;

    /// Of a kind, with its corners in VTK's order; others are not looked at.
    pub fn new(kind: Kind, corners: [DVec3; 8]) -> Self {
        let own = &corners[..kind.points()];
        let [low, high] = own
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[a, b], p| [a.min(*p), b.max(*p)]);
        let size = (high - low).length();
        // From the first corner, so that coordinates far from 0 keep their digits.
        let factors = kind.polynomial(corners.map(|corner| corner - corners[0]));
        Self { kind, corners, factors, size }
    }

    /// What it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Places of its corners.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..self.kind.points()]
    }

    /// What its places are made of, from its first corner: see [`Kind::polynomial`].
    pub fn factors(&self) -> [DVec3; 8] {
        self.factors
    }

    /// What r, s and t grow by per unit of the space, in its middle; of a tetrahedron everywhere.
    pub fn rows(&self) -> [DVec3; 3] {
        let rows = self.at(self.kind.middle()).1.inverse().transpose();
        [rows.x_axis, rows.y_axis, rows.z_axis]
    }

    /// Least and greatest coordinates: no place of it lies beyond its corners.
    pub fn bounds(&self) -> [DVec3; 2] {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        self.corners().iter().fold(none, |[low, high], p| [low.min(*p), high.max(*p)])
    }

    /// A place of (r, s, t), and its derivatives as columns.
    pub fn at(&self, unit: DVec3) -> (DVec3, DMat3) {
        let (offset, slopes) = self.offset_at(unit);
        (self.corners[0] + offset, slopes)
    }

    /// The same, from the first corner on.
    fn offset_at(&self, unit: DVec3) -> (DVec3, DMat3) {
        let DVec3 { x: r, y: s, z: t } = unit;
        let [_, cr, cs, ct, crs, cst, crt, crst] = self.factors;
        let by_r = cr + crs * s + crt * t + crst * (s * t);
        let by_s = cs + crs * r + cst * t + crst * (r * t);
        let by_t = ct + cst * s + crt * r + crst * (r * s);
        let offset = cr * r
            + cs * s
            + ct * t
            + crs * (r * s)
            + cst * (s * t)
            + crt * (r * t)
            + crst * (r * s * t);
        (offset, DMat3::from_cols(by_r, by_s, by_t))
    }

    /// Its volume, negative where its points go round the other way: exact of tetrahedra; of others that of the
    /// parallelepiped at three quadrature points along each axis.
    pub fn volume(&self) -> f64 {
        let [volume] = self.integrated(|slopes| [slopes.determinant()]);
        volume
    }

    /// Numbers of its slopes, summed up over it.
    fn integrated<const N: usize>(&self, numbers: impl Fn(DMat3) -> [f64; N]) -> [f64; N] {
        let of = |unit| numbers(self.at(unit).1);
        if self.kind == Kind::Tetrahedron {
            return of(DVec3::ZERO).map(|number| number / 6.0);
        }
        // Gauss's rule of three points: determinants are of the fourth degree along an axis at most.
        let root = (0.6_f64).sqrt() / 2.0;
        let rule = [(0.5 - root, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + root, 5.0 / 18.0)];
        let mut sums = [0.0; N];
        for (t, wt) in rule {
            for (s, ws) in rule {
                for (r, wr) in rule {
                    let (unit, shrunk) = match self.kind {
                        // A triangle as a square of which one side is a point.
                        Kind::Wedge => (DVec3::new(r * (1.0 - s), s, t), 1.0 - s),
                        _ => (DVec3::new(r, s, t), 1.0),
                    };
                    for (sum, number) in sums.iter_mut().zip(of(unit)) {
                        *sum += wr * ws * wt * shrunk * number;
                    }
                }
            }
        }
        sums
    }

    /// Whether it has no volume beside the rounding of its coordinates, however long and thin it is.
    pub fn is_flat(&self) -> bool {
        let reach = self.corners().iter().fold(DVec3::ZERO, |reach, at| reach.max(at.abs()));
        // A determinant's terms with no two of them cancelling, of which one factor is rounding.
        let across = |a: DVec3, b: DVec3| {
            let (a, b) = (a.abs(), b.abs());
            DVec3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x)
        };
        let doubt = |DMat3 { x_axis: r, y_axis: s, z_axis: t }: DMat3| {
            reach.dot(across(r, s) + across(s, t) + across(t, r))
        };
        let [volume, doubt] = self.integrated(|slopes| [slopes.determinant(), doubt(slopes)]);
        volume.abs() <= ROUNDING * doubt
    }

    /// Where a place lies in it, as (r, s, t), if it does: by Newton's method, which is exact at once in tetrahedra.
    pub fn unit_from(&self, place: DVec3) -> Option<DVec3> {
        // Far from 0 the sum of a corner and an offset has few digits of the offset, and steps would never end.
        let aim = place - self.corners[0];
        let mut unit = self.kind.middle();
        for _ in 0..MOST_STEPS {
            let (here, slopes) = self.offset_at(unit);
            let off = aim - here;
            // Newton's step in the least squares, of slopes scaled to unit length (solids may be flat by any factor) and
            // damped by so little that only collapsed ones feel it, whose slopes have no inverse.
            let [x, y, z] = [slopes.x_axis, slopes.y_axis, slopes.z_axis]
                .map(|slope| slope.length().max(COLLAPSED * self.size));
            let units = DMat3::from_cols(slopes.x_axis / x, slopes.y_axis / y, slopes.z_axis / z);
            let square = units.transpose() * units + DMat3::from_diagonal(DVec3::splat(DAMPING));
            let step = square.inverse() * (units.transpose() * off) / DVec3::new(x, y, z);
            if !step.is_finite() {
                return None;
            }
            // What leaves the region by more than another one does not come back.
            unit = (unit + step).clamp(DVec3::splat(-1.0), DVec3::splat(2.0));
            if step.abs().max_element() <= EXACT {
                // Where slopes have no inverse, no step is left beside the solid, too.
                let is_inside = self.kind.beyond(unit) <= Self::RIM;
                let is_there = off.length() <= Self::RIM * self.size;
                return (is_inside && is_there).then(|| unit.clamp(DVec3::ZERO, DVec3::ONE));
            }
        }
        None
    }

    /// The same, at once, of a tetrahedron whose [`Placed::rows`] are known.
    pub fn unit_by(&self, rows: &[DVec3; 3], place: DVec3) -> Option<DVec3> {
        let unit = DVec3::from(rows.map(|row| row.dot(place - self.corners[0])));
        let is_inside = self.kind.beyond(unit) <= Self::RIM;
        is_inside.then(|| unit.clamp(DVec3::ZERO, DVec3::ONE))
    }

    /// What a number at the corners grows by per unit of the space, at (r, s, t); zero where the solid has collapsed.
    pub fn gradient(&self, numbers: [f64; 8], unit: DVec3) -> DVec3 {
        let DVec3 { x: r, y: s, z: t } = unit;
        let [_, cr, cs, ct, crs, cst, crt, crst] = self.kind.polynomial(numbers);
        let by_unit = DVec3::new(
            cr + crs * s + crt * t + crst * (s * t),
            cs + crs * r + cst * t + crst * (r * t),
            ct + cst * s + crt * r + crst * (r * s),
        );
        let slopes = self.at(unit).1;
        let gradient = slopes.transpose().inverse() * by_unit;
        if gradient.is_finite() { gradient } else { DVec3::ZERO }
    }
}
