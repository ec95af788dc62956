//! What rays meet beside the matter of a field: faces where it is cut, slices, isosurfaces.

use fearless_simd::{Simd, prelude::*};

use super::lanes::{LANES, Lanes, Mask, Vec3, all, any, choose};
use super::lattice::{Lattice, Method};
use super::light::Light;
use super::own::Own;
use super::polygons::{Fragment, Fragments};
use super::rays::{Packet, Rays, TILE};
use super::solids::Solids;
use super::table::Table;
use crate::kernel::Kernel;
use crate::plan::Plan;
use crate::scene::{AlongRay, CutFaces, edge_colour};

/// Of a ray, at most: a cut face, six slices, and six levels within a slab.
const MOST_MET: usize = 13;
/// Times that the field is asked where it passes a level: by the secant, of whose ends the older counts for half
/// once the other was moved twice (the Illinois rule).
const ROOT_STEPS: usize = 7;
/// Times that a slab is halved then, of cells, where the field does not have the level at the place that was found.
const HALVINGS: usize = 20;
/// Cells of the table by which single precision may be off.
const ROUNDING: f32 = 1e-3;

/// The surfaces of a scene, in the index space of a field.
#[derive(Debug, Clone, Default)]
pub(super) struct Surfaces {
    /// Matter where it is cut shows its value.
    cut_faces: bool,
    slices: Vec<Sliced>,
    /// Values, linear colours, opacities.
    levels: Vec<(f64, [f32; 3], f32)>,
}

/// A slice.
#[derive(Debug, Clone, Copy)]
struct Sliced {
    /// A normal, and the product with it.
    plane: [f32; 4],
    opacity: f32,
    /// Leaves out what has no opacity by the table.
    only_shown: bool,
    /// Shows edges of cells.
    edges: bool,
}

/// What one ray meets at a depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met {
    pub t: f32,
    pub colour: [f32; 3],
    pub opacity: f32,
    /// A bit for each sample of the pixel that it covers.
    pub samples: u8,
}

/// All samples of a pixel.
pub(super) const EVERY_SAMPLE: u8 = 15;

/// What eight rays meet, each in the order of compositing.
pub(super) struct Ahead<'a, S: Simd> {
    rays: [Way; LANES],
    /// What the pixel of each sees of triangles, and how many are laid down.
    triangles: [(&'a [Fragment], usize); LANES],
    /// Triangles between these depths are kept.
    kept: [Lanes<S>; 2],
    back_to_front: bool,
    /// Where each meets the next: beyond everything where there is none.
    pub next: Lanes<S>,
}

/// What a ray meets, from `done` on not yet laid down.
#[derive(Clone, Copy)]
struct Way {
    met: [Met; MOST_MET],
    count: usize,
    done: usize,
}

impl Surfaces {
    /// `None` where a plan has none.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn of(plan: &Plan) -> Option<Self> {
        let (field, lattice, inside) = (plan.field()?, &plan.frame.lattice, &plan.inside);
        if inside.along != AlongRay::Composite {
            // Values that are projected have neither faces nor surfaces.
            return None;
        }
        let slices = inside.slices.iter().map(|slice| {
            let half = slice.plane.in_index(lattice);
            let plane = half.normal.as_vec3().extend(half.least as f32).to_array();
            let edges = slice.edges && plan.mode.kernel == Kernel::Cells;
            let (opacity, only_shown) = (slice.opacity as f32, slice.only_shown);
            Sliced { plane, opacity, only_shown, edges }
        });
        let levels = inside
            .isosurfaces
            .iter()
            .map(|iso| (iso.value, iso.linear_colour(&field.transfer), iso.opacity as f32));
        let cuts = !inside.clip.half_spaces(lattice).is_empty();
        let found = Self {
            cut_faces: inside.clip.faces == CutFaces::Coloured && cuts,
            slices: slices.collect(),
            levels: levels.collect(),
        };
        let is_none = !found.cut_faces && found.slices.is_empty() && found.levels.is_empty();
        (!is_none).then_some(found)
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> u64 {
        let (slices, levels) = (size_of_val(&self.slices[..]), size_of_val(&self.levels[..]));
        (size_of::<Self>() + slices + levels) as u64
    }

    /// Whether there are isosurfaces.
    pub(super) fn has_levels(&self) -> bool {
        !self.levels.is_empty()
    }

    /// Whether rays may meet something where no matter shows.
    pub(super) fn are_everywhere(&self) -> bool {
        self.cut_faces || !self.slices.is_empty()
    }

    /// Cut faces and slices on the way of eight rays. Not inlined: it would be compiled into every loop.
    #[inline(never)]
    pub(super) fn ahead<S: Simd>(
        &self,
        simd: S,
        field: (&Lattice, Method, &Table),
        seen: (&Rays, &Packet<S>),
        ahead: &mut Ahead<'_, S>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || self.ahead_here(simd, field, seen, ahead),
        );
    }

    #[inline(always)]
    fn ahead_here<S: Simd>(
        &self,
        simd: S,
        (lattice, method, table): (&Lattice, Method, &Table),
        (rays, packet): (&Rays, &Packet<S>),
        ahead: &mut Ahead<'_, S>,
    ) {
        let faces = self.cut_faces.then_some((packet.enter, packet.is_cut, (1.0, true), None));
        let slices = self.slices.iter().map(|slice| {
            let Sliced { plane: [nx, ny, nz, product], opacity, only_shown, edges } = *slice;
            let normal = Vec3::splat(simd, [nx, ny, nz]);
            let growth = normal.dot(packet.direction);
            let is_along = growth.abs().simd_lt(all(simd, 1e-20));
            let one = all(simd, 1.0);
            let t =
                (all(simd, product) - normal.dot(packet.origin)) / choose(is_along, one, growth);
            let is_in = !is_along & t.simd_gt(packet.enter) & t.simd_lt(packet.leave);
            let edges = edges.then_some(slice.plane);
            (t, is_in & packet.is_there, (opacity, only_shown), edges)
        });
        for (t, is_met, (opacity, only_shown), edges) in faces.into_iter().chain(slices) {
            if !any(is_met) {
                continue;
            }
            let place = packet.at(t);
            let stored = lattice.value(simd, method, place);
            let look = table.look(simd, table.cell(simd, stored));
            let nothing = Lattice::is_nothing(simd, method, stored);
            let share = match (edges, &lattice.own) {
                (Some(plane), Some(Own::Cells(cells))) => {
                    edge_share(simd, cells, (rays, packet), plane, place)
                }
                _ => all(simd, 0.0),
            };
            let outside = lattice.is_outside(simd, place);
            for i in 0..LANES {
                if !is_met.test(i) {
                    continue;
                }
                let in_hole = outside.test(i);
                let (mut colour, mut weight) = (look.colour.lane(i), look.weight[i]);
                let holes_show = lattice.has_holes() && table.no_data[3] > 0.0;
                if in_hole && holes_show {
                    let [r, g, b, w] = table.no_data;
                    (colour, weight) = ([r, g, b], w);
                }
                let is_there = if in_hole { holes_show } else { !nothing.test(i) };
                let is_there = is_there && (weight > 0.0 || !only_shown);
                if is_there && opacity > 0.0 {
                    if share[i] > 0.0 {
                        let edged = edge_colour(colour.map(f64::from), f64::from(share[i]));
                        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
                        let edged = edged.map(|c| c as f32);
                        colour = edged;
                    }
                    ahead.insert(i, Met { t: t[i], colour, opacity, samples: EVERY_SAMPLE });
                }
            }
        }
        ahead.look(simd);
    }

    /// Notes the levels that the field passes between two depths at which it has these cells. What passes one twice
    /// between them is not met; more slabs meet it. Where the first cells are of means those of the field are found. Whether any
    /// is met. Not inlined: it would be compiled into every loop.
    #[inline(never)]
    pub(super) fn meet_levels<S: Simd>(
        &self,
        simd: S,
        field: (&Lattice, Method, &Table, &Light),
        seen: (&Rays, &Packet<S>),
        ends: ([Lanes<S>; 2], [Lanes<S>; 2]),
        slabs: (Mask<S>, bool),
        ahead: &mut Ahead<'_, S>,
    ) -> bool {
        simd.vectorize(
            #[inline(always)]
            || self.meet_levels_here(simd, field, seen, ends, slabs, ahead),
        )
    }

    #[inline(always)]
    fn meet_levels_here<S: Simd>(
        &self,
        simd: S,
        (lattice, method, table, light): (&Lattice, Method, &Table, &Light),
        (rays, packet): (&Rays, &Packet<S>),
        (mut cells, ts): ([Lanes<S>; 2], [Lanes<S>; 2]),
        (is_slab, begins_with_means): (Mask<S>, bool),
        ahead: &mut Ahead<'_, S>,
    ) -> bool {
        let mut is_met = false;
        if begins_with_means {
            cells[0] = table.cell(simd, lattice.value(simd, method, packet.at(ts[0])));
        }
        for &(value, colour, opacity) in &self.levels {
            #[expect(clippy::cast_possible_truncation, reason = "a cell")]
            let level = all(simd, (table.values.of_zero + table.values.per_value * value) as f32);
            let passes = cells[0].simd_lt(level) ^ cells[1].simd_lt(level);
            let passes = passes & is_slab;
            if !any(passes) {
                continue;
            }
            let zero = all(simd, 0.0);
            let (mut t0, mut u0) = (ts[0], cells[0] - level);
            let (mut t1, mut u1) = (ts[1], cells[1] - level);
            // 1 and −1 where the beginning, or the end, was moved last.
            let mut side = zero;
            let mut t = t0;
            for _ in 0..ROOT_STEPS {
                let rise = u1 - u0;
                let flat = rise.simd_eq(zero);
                // Where it was found the ends meet in it.
                let found = t;
                t = t0 - u0 * (t1 - t0) / choose(flat, all(simd, 1.0), rise);
                t = choose(flat, found, t);
                let stored = lattice.value(simd, method, packet.at(t));
                let off = table.cell(simd, stored) - level;
                let before = !(off.simd_lt(zero) ^ u0.simd_lt(zero));
                let half = all(simd, 0.5);
                u1 = choose(before & side.simd_gt(zero), u1 * half, u1);
                u0 = choose(!before & side.simd_lt(zero), u0 * half, u0);
                t0 = choose(before, t, t0);
                u0 = choose(before, off, u0);
                t1 = choose(before, t1, t);
                u1 = choose(before, u1, off);
                side = choose(before, all(simd, 1.0), all(simd, -1.0));
                if !any(passes & off.simd_ne(zero)) {
                    break;
                }
            }
            let mut passes = passes;
            if method == Method::Cells
                && let Some(Own::Cells(solids)) = &lattice.own
                && solids.may_jump()
            {
                let of = (level, cells[0].simd_lt(level), passes);
                (t, passes) = where_had(simd, (solids, table), packet, of, (ts, t));
                if !any(passes) {
                    continue;
                }
            }
            is_met = true;
            let place = packet.at(t);
            let growth = lattice.gradient(simd, method, place);
            let seen = light.of_surface(simd, (rays, packet), growth, colour);
            let outside = lattice.is_outside(simd, place);
            for i in 0..LANES {
                let in_hole = outside.test(i);
                if passes.test(i) && !in_hole && opacity > 0.0 {
                    let (t, colour) = (t[i], seen.lane(i));
                    ahead.insert(i, Met { t, colour, opacity, samples: EVERY_SAMPLE });
                }
            }
            ahead.look(simd);
        }
        is_met
    }
}

/// Of rays that pass a level between two depths, those on which the field has it rather than jumps past it
/// (`cells::CellField::slack`), and where: at `found`, or else where halving the slab comes to it. Not inlined: few ask.
#[inline(never)]
fn where_had<S: Simd>(
    simd: S,
    (cells, table): (&Solids, &Table),
    packet: &Packet<S>,
    (level, begins_below, passes): (Lanes<S>, Mask<S>, Mask<S>),
    (ends, found): ([Lanes<S>; 2], Lanes<S>),
) -> (Lanes<S>, Mask<S>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let [mut begin, mut end] = ends;
            let (mut t, mut at) = (found, found);
            let mut is_had = Mask::splat(simd, false);
            for turn in 0..=HALVINGS {
                let open = passes & !is_had;
                let (stored, slack) = cells.with_slack(simd, (packet.at(at), open));
                let off = table.cell(simd, stored) - level;
                let slack = slack * table.scale.abs() + ROUNDING;
                let here = open & off.abs().simd_le(slack);
                t = choose(here, at, t);
                is_had |= here;
                if !any(open & !here) {
                    break;
                }
                // What the secant found may lie anywhere: where cells leave a gap there is no value.
                if turn > 0 {
                    let before = !(off.simd_lt(all(simd, 0.0)) ^ begins_below);
                    begin = choose(before, at, begin);
                    end = choose(before, end, at);
                }
                at = (begin + end) * 0.5;
            }
            (t, is_had)
        },
    )
}

/// How many of the four places half a pixel beside one on a plane lie in another of the file's cells. Not inlined: few ask.
#[inline(never)]
fn edge_share<S: Simd>(
    simd: S,
    cells: &Solids,
    (rays, packet): (&Rays, &Packet<S>),
    [nx, ny, nz, product]: [f32; 4],
    place: Vec3<S>,
) -> Lanes<S> {
    simd.vectorize(
        #[inline(always)]
        || {
            let own = cells.sources(simd, place);
            let normal = Vec3::splat(simd, [nx, ny, nz]);
            let mut share = all(simd, 0.0);
            for side in [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]] {
                let [origin, direction] = rays.beside(simd, packet, side);
                let growth = normal.dot(direction);
                let is_along = growth.abs().simd_lt(all(simd, 1e-20));
                let growth = choose(is_along, all(simd, 1e-20), growth);
                let t = (all(simd, product) - normal.dot(origin)) / growth;
                let other = cells.sources(simd, origin.at(direction, t));
                share += choose(other.simd_ne(own), all(simd, 0.25), all(simd, 0.0));
            }
            share
        },
    )
}

impl<'a, S: Simd> Ahead<'a, S> {
    /// Triangles alone, if any are in the tile: those that lie between the depths that are kept of rays. `first` is the
    /// number in its tile of the block's first pixel.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        fragments: Option<&'a Fragments>,
        first: usize,
        kept: [Lanes<S>; 2],
        back_to_front: bool,
    ) -> Self {
        let none = Met { t: 0.0, colour: [0.0; 3], opacity: 0.0, samples: 0 };
        let way = Way { met: [none; MOST_MET], count: 0, done: 0 };
        let mut triangles: [(&[Fragment], usize); LANES] = [(&[], 0); LANES];
        if let Some(fragments) = fragments {
            for (lane, (seen, _)) in triangles.iter_mut().enumerate() {
                *seen = fragments.of(first + lane / 4 * TILE as usize + lane % 4);
            }
        }
        let next = all(simd, f32::INFINITY);
        let mut ahead = Self { rays: [way; LANES], triangles, kept, back_to_front, next };
        ahead.look(simd);
        ahead
    }

    /// Adds what a ray meets, behind what it meets before.
    fn insert(&mut self, lane: usize, met: Met) {
        let way = &mut self.rays[lane];
        if way.count == MOST_MET {
            // What was laid down makes room.
            way.met.copy_within(way.done.., 0);
            way.count -= way.done;
            way.done = 0;
        }
        let back = self.back_to_front;
        let is_before = |a: f32, b: f32| if back { a > b } else { a < b };
        let mut at = way.count.min(MOST_MET - 1);
        while at > way.done && is_before(met.t, way.met[at - 1].t) {
            way.met[at] = way.met[at - 1];
            at -= 1;
        }
        way.met[at] = met;
        way.count = (way.count + 1).min(MOST_MET);
    }

    /// Finds where each ray meets the next.
    fn look(&mut self, simd: S) {
        let beyond = if self.back_to_front { f32::NEG_INFINITY } else { f32::INFINITY };
        self.next = Lanes::from_fn(simd, |i| self.peek(i).map_or(beyond, |met| met.t));
    }

    /// What a ray meets next.
    pub(super) fn peek(&self, lane: usize) -> Option<Met> {
        match self.next_triangle(lane) {
            Some(&Fragment { t, colour, opacity, samples, .. }) => {
                let [low, high] = self.kept;
                let is_kept = t >= low[lane] && t <= high[lane];
                Some(Met { t, colour, opacity: if is_kept { opacity } else { 0.0 }, samples })
            }
            None => self.next_surface(lane).copied(),
        }
    }

    fn next_surface(&self, lane: usize) -> Option<&Met> {
        let way = &self.rays[lane];
        (way.done < way.count).then(|| &way.met[way.done])
    }

    /// The next triangle, where it comes before the next surface: from the eye it is behind one of the same depth.
    fn next_triangle(&self, lane: usize) -> Option<&'a Fragment> {
        let (seen, done) = self.triangles[lane];
        let left = seen.len().checked_sub(done + 1)?;
        let next = &seen[if self.back_to_front { left } else { done }];
        let is_first = self.next_surface(lane).is_none_or(|met| match self.back_to_front {
            true => next.t >= met.t,
            false => next.t < met.t,
        });
        is_first.then_some(next)
    }

    /// What a ray meets next is laid down now.
    pub(super) fn pass(&mut self, lane: usize) {
        match self.next_triangle(lane) {
            Some(_) => self.triangles[lane].1 += 1,
            None => self.rays[lane].done += 1,
        }
    }

    /// Looks again, after something was laid down.
    pub(super) fn passed(&mut self, simd: S) {
        self.look(simd);
    }
}
