//! Walks eight rays from slab face to slab face of a field, classifies what lies between, and composites.

use fearless_simd::{Simd, prelude::*};

use super::kernels::Kernels;
use super::lanes::{LANES, Lanes, Look, Mask, Vec3, all, any, choose, opacity};
use super::lattice::{Lattice, Method};
use super::light::{self, Light};
use super::masks::Masks;
use super::passing::{EVERY_SLAB, Passing, Sum, Tile};
use super::rays::{Packet, Rays, TILE};
use super::surfaces::{Ahead, Surfaces};
use super::table::{Halves, Table};

/// Least depth of three slabs together, in slabs, for all three to be whole: at the borders of the
/// lattice they are clipped.
const WHOLE_SLABS: f32 = 2.99;

/// What a picture is drawn from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub rays: &'a Rays,
    pub masks: &'a Masks,
    pub lattice: &'a Lattice,
    pub table: &'a Table,
    pub light: Option<&'a Light>,
    pub surfaces: Option<&'a Surfaces>,
    pub kernels: Option<&'a Kernels>,
    /// The value in the middle of a slab is classified, rather than all between its faces.
    pub middle: bool,
    /// Opacity is weight times length, capped, rather than 1 − exp(−depth).
    pub published: bool,
    /// Transmittance at which rays end.
    pub stop_below: f32,
}

/// A pixel: premultiplied linear colour, opacity.
pub(super) type Pixel = [f32; 4];

/// What a scene asks for beside its field and table: what it does not ask for is not compiled into its loop.
pub(super) trait Wants {
    /// Lights, tables, surfaces, kernels of lists, samples without data, another order, published opacities, values in
    /// the middle.
    const MORE: bool;
}

/// Nothing.
pub(super) struct Plain;
/// Something.
pub(super) struct Rich;

impl Wants for Plain {
    const MORE: bool = false;
}

impl Wants for Rich {
    const MORE: bool = true;
}

impl Scene<'_> {
    /// Whether it asks for nothing but its field and its table.
    pub(super) fn is_plain(&self) -> bool {
        self.light.is_none()
            && self.surfaces.is_none()
            && self.kernels.is_none()
            && !self.lattice.has_holes()
            && !self.middle
            && !self.published
            && !self.rays.back_to_front
    }

    /// Whether anything can be seen in a tile.
    fn is_empty(&self, tile: usize) -> bool {
        !self.masks.shows(tile) && !self.surfaces.is_some_and(Surfaces::are_everywhere)
    }

    /// Draws a tile; opacities that were over 1, and lowered to it.
    #[inline(always)]
    pub(super) fn tile<S: Simd, W: Wants>(
        &self,
        simd: S,
        method: Method,
        tile: usize,
        out: &mut [Pixel],
    ) -> u64 {
        out.fill([0.0; 4]);
        let corner = corner_of(self.rays, tile);
        let kernels = self.kernels.filter(|_| W::MORE);
        let mut of_tile = kernels.map(|kernels| Tile::new(simd, kernels, corner));
        if self.is_empty(tile) && of_tile.as_ref().is_none_or(Tile::is_empty) {
            return 0;
        }
        let side = self.rays.side;
        let share = 1.0 / (side * side) as f32;
        let mut capped = 0;
        for block in 0..TILE * TILE / LANES as u32 {
            let Some(at) = block_of(self.rays, corner, block) else { continue };
            let mut sum = Gathered::none(simd, Mask::splat(simd, true));
            for i in 0..side * side {
                let part = [i % side, i / side].map(|n| (n as f32 + 0.5) / side as f32);
                let packet = self.rays.packet(simd, at, part);
                let what = (tile, &mut of_tile);
                let light = self.walk::<S, W>(simd, method, what, &packet, &mut capped);
                sum.colour = sum.colour.add(light.colour);
                sum.alpha += light.alpha;
            }
            write_block(block, sum, share, out);
        }
        capped
    }

    #[inline(always)]
    fn walk<S: Simd, W: Wants>(
        &self,
        simd: S,
        method: Method,
        (tile, of_tile): (usize, &mut Option<Tile<S>>),
        packet: &Packet<S>,
        capped: &mut u64,
    ) -> Gathered<S> {
        let mut passing = match (self.kernels, of_tile) {
            (Some(kernels), Some(of_tile)) if W::MORE && !of_tile.is_empty() => {
                let kept = self.rays.kept(simd, packet);
                Some(Passing::new(simd, kernels, of_tile, (self.rays, packet), kept))
            }
            _ => None,
        };
        // Kernels reach beyond the lattice.
        let is_there = packet.is_there | Mask::splat(simd, passing.is_some());
        let mut light = Gathered::none(simd, is_there);
        if !any(is_there) {
            return light;
        }
        let mut ahead = match self.surfaces {
            Some(surfaces) if W::MORE => {
                let field = (self.lattice, method, self.table);
                Some(surfaces.ahead(simd, field, self.rays, packet))
            }
            _ => None,
        };
        let slabs = packet.slabs(simd, self.rays.step);
        let mut runs = self.masks.runs(tile, slabs);
        loop {
            let run =
                if W::MORE && self.rays.back_to_front { runs.next_back() } else { runs.next() };
            let Some(run) = run else { break };
            if W::MORE && self.middle {
                let state = (&mut light, &mut ahead, &mut passing, &mut *capped);
                self.middles(simd, method, packet, run, state);
            } else {
                let state = (&mut light, &mut ahead, &mut passing, &mut *capped);
                self.slabs::<S, W>(simd, method, packet, run, state);
            }
            if !light.goes_on(simd, self.stop_below) {
                break;
            }
        }
        if let Some(passing) = passing.as_mut().filter(|_| W::MORE)
            && light.goes_on(simd, self.stop_below)
        {
            *capped +=
                self.lay_kernels(simd, packet, passing, EVERY_SLAB, (&mut light, &mut ahead));
        }
        if let Some(ahead) = ahead.as_mut().filter(|_| W::MORE) {
            for lane in 0..LANES {
                while let Some(met) = ahead.peek(lane) {
                    light.cover_ray(lane, met.colour, met.opacity, self.rays.back_to_front);
                    ahead.pass(lane);
                }
            }
        }
        light
    }

    /// Slabs between faces, of a run of them.
    #[inline(always)]
    fn slabs<S: Simd, W: Wants>(
        &self,
        simd: S,
        method: Method,
        packet: &Packet<S>,
        [first, last]: [i32; 2],
        (light, ahead, passing, capped): State<'_, '_, S>,
    ) {
        let Self { rays, lattice, table, .. } = self;
        let step = rays.step;
        let back = W::MORE && rays.back_to_front;
        // Faces in the order of compositing: one before the run, and one behind it, say how the field bends.
        let way = if back { -1 } else { 1 };
        let mut k = if back { last + 2 } else { first - 1 };
        let nothing = Face {
            t: all(simd, 0.0),
            u: all(simd, 0.0),
            growth: None,
            is_there: Mask::splat(simd, false),
        };
        let (mut before, mut near, mut far) = (nothing, nothing, nothing);
        let is_shaded =
            W::MORE && self.light.is_some_and(|light| light.is_of_slabs && light.uses_gradient);
        for have in 0..=last - first + 3 {
            let t = (all(simd, k as f32 * step)).max(packet.enter).min(packet.leave);
            let stored = lattice.value(simd, method, packet.at(t));
            let here = Face {
                t,
                u: table.cell(simd, stored),
                growth: None,
                is_there: !Lattice::is_nothing(simd, method, stored),
            };
            k += way;
            if have >= 3 {
                // The parabola has the mean of the cubic through four faces.
                let is_whole = (here.t - before.t).abs().simd_ge(all(simd, WHOLE_SLABS * step));
                let is_whole = is_whole & before.is_there & here.is_there;
                let bend = ((near.u - before.u) + (far.u - here.u)) * (1.0 / 24.0);
                let bend = choose(is_whole, bend, all(simd, 0.0));
                let is_slab = near.is_there & far.is_there & light.is_open(simd, self.stop_below);
                let shows = table.may_show(simd, [near.u, far.u], bend) & is_slab;
                let ts = [near.t, far.t];
                let mut found = None;
                if any(shows) {
                    let slab = table.between(simd, [near.u, far.u], bend);
                    found = Some(slab.without(simd, !shows));
                }
                if W::MORE {
                    if let (Some(slab), Some(shader)) = (found, self.light)
                        && shader.is_of_slabs
                        && light::shows(simd, &slab)
                    {
                        let half = all(simd, 0.5);
                        // No closure: those that are not inlined know no wide instructions.
                        let growth = if is_shaded {
                            let a = near.growth(simd, lattice, method, packet);
                            let b = far.growth(simd, lattice, method, packet);
                            Some(a.add(b).scaled(half))
                        } else {
                            None
                        };
                        let middle = ((near.u + far.u) * half, growth, (near.t + far.t) * half);
                        found = Some(shader.shaded(simd, (rays, packet, table), slab, middle));
                    }
                    found = self.with_holes(simd, packet, ts, found, false);
                    if let (Some(surfaces), Some(shader), Some(ahead)) =
                        (self.surfaces, self.light, ahead.as_mut())
                        && surfaces.has_levels()
                    {
                        let field = (*lattice, method, *table, shader);
                        let cells = [near.u, far.u];
                        let seen = (*rays, packet);
                        if surfaces.meet_levels(simd, field, seen, (cells, ts), is_slab, ahead) {
                            found = Some(found.unwrap_or_else(|| Halves::none(simd)));
                        }
                    }
                }
                if let Some(found) = found {
                    let mut beside = None;
                    if let Some(passing) = passing.as_mut().filter(|_| W::MORE) {
                        // The face behind is two further on.
                        let slab = if back { k + 2 } else { k - 3 };
                        let state = (&mut *light, &mut *ahead);
                        *capped += self.lay_before(simd, packet, passing, slab, state, &mut beside);
                    }
                    let what = (&found, beside);
                    *capped += self.lay::<S, W>(simd, packet, what, ts, (light, ahead));
                    if !light.goes_on(simd, self.stop_below) {
                        return;
                    }
                }
            }
            (before, near, far) = (near, far, here);
        }
    }

    /// Slabs of which the value in the middle counts.
    #[inline(always)]
    fn middles<S: Simd>(
        &self,
        simd: S,
        method: Method,
        packet: &Packet<S>,
        [first, last]: [i32; 2],
        (light, ahead, passing, capped): State<'_, '_, S>,
    ) {
        let Self { rays, lattice, table, .. } = self;
        let back = rays.back_to_front;
        for i in 0..=last - first {
            let slab = if back { last - i } else { first + i };
            let face = |k: i32| all(simd, k as f32 * rays.step).max(packet.enter).min(packet.leave);
            let ts = if back { [face(slab + 1), face(slab)] } else { [face(slab), face(slab + 1)] };
            let t = (ts[0] + ts[1]) * 0.5;
            let stored = lattice.value(simd, method, packet.at(t));
            let cell = table.cell(simd, stored);
            let is_slab = !Lattice::is_nothing(simd, method, stored);
            let shows = table.may_show(simd, [cell; 2], all(simd, 0.0)) & is_slab;
            let mut found = None;
            if any(shows) {
                let mut slab =
                    Halves { near: table.look(simd, cell), far: Look::splat(simd, [0.0; 4]) };
                slab = slab.without(simd, !shows);
                if let Some(shader) = self.light.filter(|light| light.is_of_slabs)
                    && light::shows(simd, &slab)
                {
                    let growth = if shader.uses_gradient {
                        Some(lattice.gradient(simd, method, packet.at(t)))
                    } else {
                        None
                    };
                    slab = shader.shaded(simd, (rays, packet, table), slab, (cell, growth, t));
                }
                found = Some(slab);
            }
            found = self.with_holes(simd, packet, ts, found, true);
            if let Some(found) = found {
                let mut beside = None;
                if let Some(passing) = passing.as_mut() {
                    let state = (&mut *light, &mut *ahead);
                    *capped += self.lay_before(simd, packet, passing, slab, state, &mut beside);
                }
                let what = (&found, beside);
                *capped += self.lay::<S, Rich>(simd, packet, what, ts, (light, ahead));
                if !light.goes_on(simd, self.stop_below) {
                    return;
                }
            }
        }
    }

    /// Samples without data are boxes: nothing is interpolated there, nor lit.
    #[inline(always)]
    fn with_holes<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        ts: [Lanes<S>; 2],
        found: Option<Halves<S>>,
        middle: bool,
    ) -> Option<Halves<S>> {
        if !self.lattice.has_holes() {
            return found;
        }
        let holes = self.lattice.holes_at(simd, packet.at((ts[0] + ts[1]) * 0.5));
        if !any(holes) {
            return found;
        }
        let shows = self.table.no_data[3] > 0.0;
        if !shows {
            return found.map(|found| found.without(simd, holes));
        }
        let look = Look::splat(simd, self.table.no_data);
        let none = Look::splat(simd, [0.0; 4]);
        let Halves { near, far } = found.unwrap_or_else(|| Halves::none(simd));
        Some(Halves {
            near: Look::choose(holes, look, near),
            far: Look::choose(holes, if middle { none } else { look }, far),
        })
    }

    /// Lays down what kernels have before a slab of the field; what they have in it is laid beside that.
    #[inline(always)]
    fn lay_before<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        passing: &mut Passing<'_, S>,
        slab: i32,
        state: (&mut Gathered<S>, &mut Option<Ahead<S>>),
        beside: &mut Option<Sum<S>>,
    ) -> u64 {
        let slab = passing.slab_of(slab);
        let capped = self.lay_kernels(simd, packet, passing, slab, state);
        *beside = passing.take(simd, slab);
        capped
    }

    /// Lays down what kernels have before one of their slabs.
    #[inline(always)]
    fn lay_kernels<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        passing: &mut Passing<'_, S>,
        slab: i32,
        (light, ahead): (&mut Gathered<S>, &mut Option<Ahead<S>>),
    ) -> u64 {
        let mut capped = 0;
        while let Some((at, sum)) = passing.before(simd, slab) {
            let ts = passing.ends(simd, at);
            let none = Halves::none(simd);
            capped += self.lay::<S, Rich>(simd, packet, (&none, Some(sum)), ts, (light, ahead));
            if !light.goes_on(simd, self.stop_below) {
                break;
            }
        }
        capped
    }

    /// Lays a slab down, with what kernels have beside it and the surfaces in it; opacities that were lowered to 1.
    #[inline(always)]
    fn lay<S: Simd, W: Wants>(
        &self,
        simd: S,
        packet: &Packet<S>,
        (found, beside): (&Halves<S>, Option<Sum<S>>),
        ts: [Lanes<S>; 2],
        (light, ahead): (&mut Gathered<S>, &mut Option<Ahead<S>>),
    ) -> u64 {
        let mut length = (ts[1] - ts[0]).abs() * packet.stretch;
        let mut beside = beside.filter(|_| W::MORE);
        let back = W::MORE && self.rays.back_to_front;
        if W::MORE
            && let Some(ahead) = ahead
        {
            let is_met = match back {
                true => ahead.next.simd_ge(ts[1]),
                false => ahead.next.simd_le(ts[1]),
            };
            if any(is_met) {
                let what = (found, beside.as_ref());
                let capped = self.lay_split(what, (length, ts), (light, ahead), is_met);
                ahead.passed(simd, back);
                let zero = all(simd, 0.0);
                length = choose(is_met, zero, length);
                if let Some(beside) = &mut beside {
                    *beside = Look::choose(is_met, Look::splat(simd, [0.0; 4]), *beside);
                }
                return capped + self.composite::<S, W>(simd, found, (length, beside), light);
            }
        }
        self.composite::<S, W>(simd, found, (length, beside), light)
    }

    /// Composites a slab of so many unit distances, with what kernels have beside.
    #[inline(always)]
    fn composite<S: Simd, W: Wants>(
        &self,
        simd: S,
        found: &Halves<S>,
        (length, beside): (Lanes<S>, Option<Sum<S>>),
        light: &mut Gathered<S>,
    ) -> u64 {
        let back = W::MORE && self.rays.back_to_front;
        if W::MORE && self.published {
            // Opacities are given to slabs: the mean of the two halves.
            let weight = found.weight();
            let share = all(simd, 1.0) / weight.max(all(simd, 1e-30));
            let near = found.near.colour.scaled(found.near.weight);
            let colour = near.add(found.far.colour.scaled(found.far.weight)).scaled(share);
            let halves = if self.middle { 1.0 } else { 0.5 };
            let (colour, amount) = with(simd, colour, weight * halves * length, beside, 1.0);
            return light.cover_capped(simd, colour, amount, back);
        }
        if W::MORE && self.middle {
            let (colour, depth) = (found.near.colour, found.near.weight * length);
            let (colour, depth) = with(simd, colour, depth, beside, 1.0);
            light.cover(simd, colour, opacity(simd, depth), back);
            return 0;
        }
        let half = length * 0.5;
        for look in [&found.near, &found.far] {
            let (colour, depth) = (look.colour, look.weight * half);
            let (colour, depth) =
                if W::MORE { with(simd, colour, depth, beside, 0.5) } else { (colour, depth) };
            light.cover(simd, colour, opacity(simd, depth), back);
        }
        0
    }

    /// The same of rays that meet surfaces in it, one by one.
    fn lay_split<S: Simd>(
        &self,
        (found, beside): (&Halves<S>, Option<&Sum<S>>),
        (length, ts): (Lanes<S>, [Lanes<S>; 2]),
        (light, ahead): (&mut Gathered<S>, &mut Ahead<S>),
        is_met: Mask<S>,
    ) -> u64 {
        let back = self.rays.back_to_front;
        let mut capped = 0;
        for lane in 0..LANES {
            if !is_met.test(lane) {
                continue;
            }
            let (begin_t, end_t) = (ts[0][lane], ts[1][lane]);
            let span = if end_t == begin_t { 1.0 } else { end_t - begin_t };
            let (near, far) = (found.near.colour.lane(lane), found.far.colour.lane(lane));
            let (near_weight, far_weight) = (found.near.weight[lane], found.far.weight[lane]);
            let kernels = beside.map_or([0.0; 4], |beside| {
                let [r, g, b] = beside.colour.lane(lane);
                [r, g, b, beside.weight[lane]]
            });
            // A part of the field, and a share of what is beside.
            let mut layer = |light: &mut Gathered<S>, colour: [f32; 3], amount: f32, share: f32| {
                let [r, g, b, more] = kernels.map(|v| v * share);
                let sum = amount + more;
                let (colour, amount) = if more > 0.0 {
                    let mixed = |c: usize, light: f32| (colour[c] * amount + light) / sum;
                    ([mixed(0, r), mixed(1, g), mixed(2, b)], sum)
                } else {
                    (colour, amount)
                };
                let alpha = if self.published { amount.min(1.0) } else { -(-amount).exp_m1() };
                capped += u64::from(self.published && amount > 1.0);
                light.cover_ray(lane, colour, alpha, back);
            };
            // Shares of the slab: what is laid down ends here.
            let mut begin = 0.0_f32;
            loop {
                let is_in = |t: f32| if back { t >= end_t } else { t <= end_t };
                let next = ahead.peek(lane).filter(|met| is_in(met.t));
                let end = next.map_or(1.0, |met| ((met.t - begin_t) / span).clamp(begin, 1.0));
                let (length, share) = (length[lane], end - begin);
                if self.middle {
                    layer(light, near, near_weight * length * share, share);
                } else if self.published {
                    let weight = near_weight + far_weight;
                    let mean = |c: usize| {
                        (near[c] * near_weight + far[c] * far_weight) / weight.max(1e-30)
                    };
                    let amount = 0.5 * weight * length * share;
                    layer(light, [mean(0), mean(1), mean(2)], amount, share);
                } else {
                    let in_near = (end.min(0.5) - begin).max(0.0);
                    let in_far = (end - begin.max(0.5)).max(0.0);
                    layer(light, near, near_weight * length * in_near, in_near);
                    layer(light, far, far_weight * length * in_far, in_far);
                }
                let Some(met) = next else { break };
                light.cover_ray(lane, met.colour, met.opacity, back);
                ahead.pass(lane);
                begin = end;
            }
        }
        capped
    }
}

/// What rays have come to: their light, the surfaces and the kernels ahead, and opacities that were lowered to 1.
type State<'a, 'k, S> =
    (&'a mut Gathered<S>, &'a mut Option<Ahead<S>>, &'a mut Option<Passing<'k, S>>, &'a mut u64);

/// A colour and a depth (or opacity), with a share of what kernels have beside.
#[inline(always)]
fn with<S: Simd>(
    simd: S,
    colour: Vec3<S>,
    amount: Lanes<S>,
    beside: Option<Sum<S>>,
    share: f32,
) -> (Vec3<S>, Lanes<S>) {
    let Some(beside) = beside else { return (colour, amount) };
    let sum = beside.weight.mul_add(all(simd, share), amount);
    let light = colour.scaled(amount).add(beside.colour.scaled(all(simd, share)));
    (light.scaled(all(simd, 1.0) / sum.max(all(simd, 1e-30))), sum)
}

/// The first pixel of a tile.
pub(super) fn corner_of(rays: &Rays, tile: usize) -> [u32; 2] {
    let across = rays.tiles()[0] as usize;
    #[expect(clippy::cast_possible_truncation, reason = "a picture's tiles")]
    let corner = [tile % across, tile / across].map(|n| n as u32 * TILE);
    corner
}

/// The first pixel of a block of 4 × 2 of a tile, where it is in the picture.
#[inline(always)]
pub(super) fn block_of(rays: &Rays, corner: [u32; 2], block: u32) -> Option<[u32; 2]> {
    let at = [corner[0] + block % 2 * 4, corner[1] + block / 2 * 2];
    (at[0] < rays.size[0] && at[1] < rays.size[1]).then_some(at)
}

/// Writes a share of what a block has gathered into its tile.
#[inline(always)]
pub(super) fn write_block<S: Simd>(block: u32, sum: Gathered<S>, share: f32, out: &mut [Pixel]) {
    let [x, y] = [block % 2 * 4, block / 2 * 2].map(|n| n as usize);
    for lane in 0..LANES {
        let at = (y + lane / 4) * TILE as usize + x + lane % 4;
        let [r, g, b] = sum.colour.lane(lane);
        out[at] = [r, g, b, sum.alpha[lane]].map(|v| v * share);
    }
}

/// What a face of a slab is known to have.
#[derive(Clone, Copy)]
struct Face<S: Simd> {
    t: Lanes<S>,
    /// Cell of the value.
    u: Lanes<S>,
    /// Growth of the stored value per index, once someone has asked.
    growth: Option<Vec3<S>>,
    is_there: Mask<S>,
}

impl<S: Simd> Face<S> {
    #[inline(always)]
    fn growth(
        &mut self,
        simd: S,
        lattice: &Lattice,
        method: Method,
        packet: &Packet<S>,
    ) -> Vec3<S> {
        match self.growth {
            Some(growth) => growth,
            None => {
                let growth = lattice.gradient(simd, method, packet.at(self.t));
                self.growth = Some(growth);
                growth
            }
        }
    }
}

/// What eight rays have gathered so far.
#[derive(Clone, Copy)]
pub(super) struct Gathered<S: Simd> {
    /// Premultiplied.
    colour: Vec3<S>,
    transmittance: Lanes<S>,
    /// Added up: 1 − transmittance has no digits left where opacities are small.
    alpha: Lanes<S>,
}

impl<S: Simd> Gathered<S> {
    /// Nothing, of the rays that are there; of others nothing will be.
    #[inline(always)]
    pub(super) fn none(simd: S, is_there: Mask<S>) -> Self {
        let zero = all(simd, 0.0);
        Self {
            colour: Vec3::splat(simd, [0.0; 3]),
            transmittance: choose(is_there, all(simd, 1.0), zero),
            alpha: zero,
        }
    }

    /// The rays behind which more can be seen.
    #[inline(always)]
    fn is_open(&self, simd: S, stop_below: f32) -> Mask<S> {
        self.transmittance.simd_ge(all(simd, stop_below))
    }

    #[inline(always)]
    pub(super) fn goes_on(&self, simd: S, stop_below: f32) -> bool {
        any(self.is_open(simd, stop_below))
    }

    /// What a slab has of kernels alone; opacities that were lowered to 1.
    #[inline(always)]
    pub(super) fn cover_sum(
        &mut self,
        simd: S,
        sum: Sum<S>,
        published: bool,
        back_to_front: bool,
    ) -> u64 {
        let share = all(simd, 1.0) / sum.weight.max(all(simd, 1e-30));
        let colour = sum.colour.scaled(share);
        if published {
            return self.cover_capped(simd, colour, sum.weight, back_to_front);
        }
        self.cover(simd, colour, opacity(simd, sum.weight), back_to_front);
        0
    }

    /// One layer more, of an opacity that may be over 1; how many were.
    #[inline(always)]
    fn cover_capped(
        &mut self,
        simd: S,
        colour: Vec3<S>,
        amount: Lanes<S>,
        back_to_front: bool,
    ) -> u64 {
        let one = all(simd, 1.0);
        self.cover(simd, colour, amount.min(one), back_to_front);
        amount.simd_gt(one).to_bitmask().count_ones().into()
    }

    /// One layer more, of an opacity.
    #[inline(always)]
    fn cover(&mut self, _: S, colour: Vec3<S>, opacity: Lanes<S>, back_to_front: bool) {
        let shown = opacity * self.transmittance;
        if back_to_front {
            let mix = |behind: Lanes<S>, front: Lanes<S>| (front - behind).mul_add(opacity, behind);
            self.colour = Vec3 {
                x: mix(self.colour.x, colour.x),
                y: mix(self.colour.y, colour.y),
                z: mix(self.colour.z, colour.z),
            };
        } else {
            self.colour = self.colour.at(colour, shown);
        }
        self.alpha += shown;
        self.transmittance -= shown;
    }

    /// The same of one ray.
    fn cover_ray(&mut self, lane: usize, colour: [f32; 3], opacity: f32, back_to_front: bool) {
        let shown = opacity * self.transmittance[lane];
        let Vec3 { x, y, z } = &mut self.colour;
        for (sum, front) in [x, y, z].into_iter().zip(colour) {
            if back_to_front {
                sum[lane] += (front - sum[lane]) * opacity;
            } else {
                sum[lane] += front * shown;
            }
        }
        self.alpha[lane] += shown;
        self.transmittance[lane] -= shown;
    }
}
