//! Walks eight rays from slab face to slab face of a field, classifies what lies between, and composites.

use fearless_simd::{Simd, prelude::*};

use super::along_solids::AlongSolids;
use super::composite::{Gathered, Rule};
use super::kernels::Kernels;
use super::lanes::{LANES, Lanes, Look, Mask, Vec3, all, any, choose};
use super::lattice::{CellBorder, Finds, Lattice, Method};
use super::levels::{Faces, Levels, Next, segments_of};
use super::light::{self, Growth, Light};
use super::lit_cells::Growths;
use super::masks::Masks;
use super::own::{Found, Own, OwnAlong, OwnLanded};
use super::passing::{EVERY_SLAB, Kept, Passing, Sum};
use super::polygons::{Fragments, Polygons};
use super::rays::{Packet, Rays, TILE};
use super::sums::{Asked, Sums};
use super::surfaces::{Ahead, Surfaces};
use super::table::{Halves, Table};
use crate::plan::{EMPTY, SEGMENT};

/// Least depth of three slabs together, in slabs, for all three to be whole: at the borders of the
/// lattice they are clipped.
const WHOLE_SLABS: f32 = 2.99;

/// What a picture is drawn from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub rays: &'a Rays,
    pub masks: &'a Masks,
    pub lattice: &'a Lattice,
    /// Of basis functions and of cells, where they land, and what of a slab is asked for.
    pub landed: Option<(&'a OwnLanded, Asked)>,
    /// A cut of the field, where it is drawn from one.
    pub levels: Option<Levels<'a>>,
    pub table: &'a Table,
    pub light: Option<&'a Light>,
    pub surfaces: Option<&'a Surfaces>,
    pub kernels: Option<&'a Kernels>,
    pub polygons: Option<&'a Polygons>,
    pub rule: Rule,
}

/// A pixel: premultiplied linear colour, opacity.
pub(super) type Pixel = [f32; 4];

/// What a scene asks for beside its field and table: what it does not ask for is not compiled into its loop.
pub(super) trait Wants {
    /// Lights and shading tables of slabs.
    const LIT: bool;
    /// Surfaces, kernels of lists, samples without data, another order, published opacities, values in the middle.
    const MORE: bool;
    /// Several levels of the field.
    const CUT: bool;
}

macro_rules! asked {
    ($(#[$doc:meta] $name:ident: $lit:literal, $more:literal, $cut:literal;)*) => { $(
        #[$doc]
        pub(super) struct $name;
        impl Wants for $name {
            const LIT: bool = $lit;
            const MORE: bool = $more;
            const CUT: bool = $cut;
        }
    )* };
}

asked! {
    /// Nothing.
    Plain: false, false, false;
    /// Lights alone, as most scans open.
    Lit: true, false, false;
    /// Anything.
    Rich: true, true, false;
    /// Levels of the field, and nothing else.
    PlainCut: false, false, true;
    /// Levels, and lights.
    LitCut: true, false, true;
    /// Levels, and anything.
    RichCut: true, true, true;
}

impl Scene<'_> {
    /// Whether it asks for nothing but its field, its table and lights.
    pub(super) fn has_no_more(&self) -> bool {
        self.surfaces.is_none()
            && self.kernels.is_none()
            && self.polygons.is_none()
            && !self.lattice.ends_within()
            && !self.rule.middle
            && !self.rule.published
            && !self.rule.back_to_front
    }

    /// Whether anything can be seen in a tile.
    fn is_empty(&self, corner: [u32; 2]) -> bool {
        !self.masks.shows(corner) && !self.surfaces.is_some_and(Surfaces::are_everywhere)
    }

    /// Draws a tile; opacities that were over 1, and lowered to it.
    #[inline(always)]
    pub(super) fn tile<S: Simd, W: Wants, F: Finds>(
        &self,
        simd: S,
        tile: usize,
        out: &mut [Pixel],
    ) -> u64 {
        out.fill([0.0; 4]);
        let corner = corner_of(self.rays, tile);
        let fragments = self.polygons.filter(|_| W::MORE).and_then(|p| p.seen_in(corner));
        let kernels = self.kernels.filter(|_| W::MORE);
        let kernels = kernels.map(|kernels| (kernels, Kept::new(simd, kernels, corner)));
        let mut kernels = kernels.filter(|(_, kept)| !kept.is_empty());
        if self.is_empty(corner) && kernels.is_none() && fragments.is_none() {
            return 0;
        }
        let side = self.rays.side;
        let share = 1.0 / (side * side) as f32;
        let mut capped = 0;
        for block in 0..TILE * TILE / LANES as u32 {
            let Some(at) = block_of(self.rays, corner, block) else { continue };
            let mut sum = Look::splat(simd, [0.0; 4]);
            for i in 0..side * side {
                let part = [i % side, i / side].map(|n| (n as f32 + 0.5) / side as f32);
                let packet = self.rays.packet(simd, at, part);
                let others = (kernels.as_mut(), fragments.as_deref().map(|f| (f, block)));
                let light = self.walk::<S, W, F>(simd, (at, others), &packet, &mut capped);
                sum.colour = sum.colour.add(light.colour);
                sum.weight += light.weight;
            }
            write_block(block, sum, share, out);
        }
        capped
    }

    #[inline(always)]
    fn walk<S: Simd, W: Wants, F: Finds>(
        &self,
        simd: S,
        (at, (kernels, fragments)): ([u32; 2], Others<'_, '_, S>),
        packet: &Packet<S>,
        capped: &mut u64,
    ) -> Look<S> {
        let method = F::METHOD;
        let has_triangles = W::MORE && fragments.is_some();
        // Kernels and triangles reach beyond the lattice.
        let reach_beyond = W::MORE && (kernels.is_some() || has_triangles);
        let is_there = if reach_beyond { packet.in_picture } else { packet.is_there };
        let mut light = Gathered::none(simd, is_there, has_triangles);
        if !any(is_there) {
            return light.light(simd);
        }
        let kept = if reach_beyond { self.rays.kept(simd, packet) } else { [packet.enter; 2] };
        let mut passing = match kernels {
            Some((kernels, of_tile)) if W::MORE => {
                Some(Passing::new(simd, kernels, of_tile, (self.rays, packet), kept))
            }
            _ => None,
        };
        let mut ahead = None;
        if W::MORE && (self.surfaces.is_some() || has_triangles) {
            let first = fragments.map_or(0, |(_, block)| first_of(block));
            let fragments = fragments.map(|(fragments, _)| fragments);
            let mut met = Ahead::new(simd, fragments, first, kept, self.rule.back_to_front);
            if let Some(surfaces) = self.surfaces {
                let field = (self.lattice, method, self.table);
                surfaces.ahead(simd, field, (self.rays, packet), &mut met);
            }
            ahead = Some(met);
        }
        let lit = self.light.filter(|light| W::LIT && light.is_of_slabs && light.uses_gradient);
        let mut own = self.own_along(simd, method, at, lit);
        let slabs = packet.slabs(simd, self.rays.step);
        let mut runs = self.masks.runs(at, slabs);
        // Up to which slab a cut was walked.
        let mut walked = i32::MIN;
        loop {
            let run =
                if W::MORE && self.rule.back_to_front { runs.next_back() } else { runs.next() };
            let Some(run) = run else { break };
            let run = if W::CUT {
                // Whole segments, each once: two runs may lie in one.
                let [first, last] = segments_of(run);
                let first = first.max(walked);
                if first > last {
                    continue;
                }
                walked = last + 1;
                [first, last]
            } else {
                run
            };
            if W::MORE && self.rule.middle {
                let state = (&mut light, &mut ahead, &mut passing, &mut *capped);
                self.middles(simd, (method, &mut own), packet, run, state);
            } else {
                let state = (&mut light, &mut ahead, &mut passing, &mut *capped);
                self.slabs::<S, W, F>(simd, &mut own, packet, run, state);
            }
            if !light.goes_on(simd, self.rule.stop_below) {
                break;
            }
        }
        if let Some(passing) = passing.as_mut().filter(|_| W::MORE)
            && light.goes_on(simd, self.rule.stop_below)
        {
            *capped +=
                self.rule.lay_kernels(simd, packet, passing, EVERY_SLAB, (&mut light, &mut ahead));
        }
        if let Some(ahead) = ahead.as_mut().filter(|_| W::MORE) {
            self.rule.lay_rest(&mut light, ahead);
        }
        light.light(simd)
    }

    /// What eight rays have of what is drawn in the place of samples, as `lit` asks for it.
    #[inline(always)]
    pub(super) fn own_along<S: Simd>(
        &self,
        simd: S,
        method: Method,
        at: [u32; 2],
        lit: Option<&Light>,
    ) -> Option<OwnAlong<'_, S>> {
        match (self.landed?, &self.lattice.own) {
            ((OwnLanded::Functions(landed), asked), Some(Own::Functions(functions)))
                if method == Method::Functions =>
            {
                let sums = Sums::new(simd, (functions, landed), (self.rays, at), asked);
                Some(OwnAlong::Functions(sums))
            }
            ((OwnLanded::Cells(landed), asked), Some(Own::Cells(cells)))
                if method == Method::Cells =>
            {
                let growths = match lit {
                    Some(light) => cells.growths(light.is_of_borders),
                    None => Growths::None,
                };
                let (cells, asked) = (&**cells, (asked, growths));
                let along = AlongSolids::new(simd, (cells, landed), (self.rays, at), asked);
                Some(OwnAlong::Cells(along))
            }
            _ => None,
        }
    }

    /// Slabs between faces, of a run of them.
    #[inline(always)]
    fn slabs<S: Simd, W: Wants, F: Finds>(
        &self,
        simd: S,
        own: &mut Option<OwnAlong<'_, S>>,
        packet: &Packet<S>,
        [first, last]: [i32; 2],
        (light, ahead, passing, capped): State<'_, '_, S>,
    ) {
        let Self { rays, lattice, table, .. } = self;
        let method = F::METHOD;
        let step = rays.step;
        let back = W::MORE && self.rule.back_to_front;
        // Faces in the order of compositing: one before the run, and one behind it, say how the field bends.
        let way = if back { -1 } else { 1 };
        let mut k = if back { last + 2 } else { first - 1 };
        let nothing = Face {
            t: all(simd, 0.0),
            u: all(simd, 0.0),
            growth: Vec3::splat(simd, [0.0; 3]),
            has_growth: false,
            level: EMPTY,
            is_there: Mask::splat(simd, false),
        };
        let (mut before, mut near, mut far) = (nothing, nothing, nothing);
        // What belongs to the slabs behind them, of what is no lattice.
        let (mut border_near, mut border_far) = (None, None);
        let is_shaded =
            W::LIT && self.light.is_some_and(|light| light.is_of_slabs && light.uses_gradient);
        let of_borders = self.light.is_some_and(|light| light.is_of_borders);
        // Beside the border of cells light falls on this, too.
        let is_plain = !(of_borders && lattice.border.is_some());
        let grows_with_value = is_plain && lattice.grows_with_value(method);
        let shader = self.light.filter(|light| W::LIT && light.is_of_slabs);
        let eye = shader.map(|shader| shader.towards_eye(simd, rays, packet));
        let depth_of = |k: i32| all(simd, k as f32 * step).max(packet.enter).min(packet.leave);
        let mut faces = Faces::new([first, last]);
        // Where a slab was lit the next faces are likely to be asked for their growth, which costs less with the value.
        let mut was_lit = false;
        let mut have = -1;
        loop {
            have += 1;
            let mut border_here = None;
            let here = if W::CUT
                && let Some(levels) = &self.levels
            {
                let open = light.is_open(simd, self.rule.stop_below) & packet.is_there;
                let level_of = |k: i32| {
                    let ends = [depth_of(k), depth_of(k + SEGMENT)];
                    let open = open & ends[0].simd_lt(ends[1]);
                    levels.finest(simd, (packet.origin, packet.direction), ends, open)
                };
                match faces.next(level_of) {
                    None => break,
                    Some(Next::Gap) => nothing,
                    Some(Next::Face(at, level)) => {
                        k = at + 1;
                        let t = depth_of(at);
                        let place = packet.at(t);
                        let has_growth = was_lit && (level > 0 || grows_with_value);
                        let (stored, growth) = match (level, has_growth) {
                            (0, true) => lattice.value_with_growth(simd, method, place),
                            (_, true) => levels.value_with_growth(simd, level, place),
                            (0, false) => (lattice.value(simd, method, place), nothing.growth),
                            (_, false) => (levels.value(simd, level, place), nothing.growth),
                        };
                        let u = table.cell(simd, stored);
                        Face { t, u, growth, has_growth, level, is_there: packet.is_there }
                    }
                }
            } else {
                if have > last - first + 3 {
                    break;
                }
                let t = depth_of(k);
                let end = if back { first - 1 } else { last + 2 };
                let found = match own {
                    Some(own) if method.is_own() => own.at(simd, packet, (k, way, end), t),
                    _ if was_lit && grows_with_value => {
                        let (value, growth) = lattice.value_with_growth(simd, method, packet.at(t));
                        Found { growth: Some(growth), ..Found::of(simd, value) }
                    }
                    _ => Found::of(simd, lattice.value(simd, method, packet.at(t))),
                };
                k += way;
                if method.is_own() {
                    border_here =
                        Some(Border { places: found.border, growths: found.border_growths });
                }
                Face {
                    t,
                    u: table.cell(simd, found.value),
                    growth: found.growth.unwrap_or(nothing.growth),
                    has_growth: found.growth.is_some(),
                    level: 0,
                    is_there: !Lattice::is_nothing(simd, method, found.value),
                }
            };
            if W::CUT || have >= 3 {
                let are_there = near.is_there & far.is_there;
                // What a lattice grows by at a face is asked for by both slabs that meet there; of all else the faces of this slab
                // alone are moved to its border.
                let mut moved;
                let [near, far] = if method.is_own() {
                    moved = [near, far];
                    let [near, far] = &mut moved;
                    // Nearer to the eye, whatever comes first.
                    let of = (*lattice, *table, packet, (method, is_shaded, of_borders));
                    match back {
                        true => trim(simd, of, border_far, [far, near]),
                        false => trim(simd, of, border_near, [near, far]),
                    }
                    [near, far]
                } else if W::MORE
                    && let Some(border) = &lattice.border
                {
                    moved = [near, far];
                    self.cut_off(simd, border, packet, method, &mut moved);
                    let [near, far] = &mut moved;
                    [near, far]
                } else {
                    [&mut near, &mut far]
                };
                // The parabola has the mean of the cubic through four faces.
                let is_whole = (here.t - before.t).abs().simd_ge(all(simd, WHOLE_SLABS * step));
                let is_whole = is_whole & before.is_there & are_there & here.is_there;
                // Where values are straight between the points of cells there is nothing that bends.
                let is_whole = is_whole & Mask::splat(simd, method != Method::Cells);
                let is_fine = !W::CUT || (before.level | near.level | far.level | here.level) == 0;
                let bend = ((near.u - before.u) + (far.u - here.u)) * (1.0 / 24.0);
                let bend =
                    if is_fine { choose(is_whole, bend, all(simd, 0.0)) } else { all(simd, 0.0) };
                let is_slab =
                    near.is_there & far.is_there & light.is_open(simd, self.rule.stop_below);
                let shows = table.may_show(simd, [near.u, far.u], bend) & is_slab;
                let ts = [near.t, far.t];
                was_lit = false;
                // No `Option` of all this: it is copied about, and not in whole vectors.
                let mut is_found = any(shows);
                let mut found = Halves::none(simd);
                if is_found {
                    let slab = if W::CUT && far.level > 0 {
                        table.whole(simd, [near.u, far.u])
                    } else {
                        table.between(simd, [near.u, far.u], bend)
                    };
                    found = slab.without(simd, !shows);
                }
                if let (true, Some(shader), Some(eye)) = (is_found, shader, eye)
                    && light::shows(simd, &found)
                {
                    let half = all(simd, 0.5);
                    was_lit = is_shaded;
                    // No closure: those that are not inlined know no wide instructions.
                    let growth = if is_shaded {
                        let of = (*lattice, method, &self.levels, of_borders);
                        let a = near.growth(simd, of, packet);
                        let b = far.growth(simd, of, packet);
                        Some(Growth::Between([a, b]))
                    } else {
                        None
                    };
                    let middle = ((near.u + far.u) * half, growth, (near.t + far.t) * half);
                    shader.shade(simd, (eye, table.values), &mut found, middle);
                }
                if W::MORE {
                    if self.lattice.has_holes() {
                        let known = is_found.then_some(found);
                        if let Some(known) = self.without_holes(simd, packet, ts, known, false) {
                            (is_found, found) = (true, known);
                        }
                    }
                    if let (Some(surfaces), Some(shader), Some(ahead)) =
                        (self.surfaces, self.light, ahead.as_mut())
                        && surfaces.has_levels()
                        && !(W::CUT && far.level > 0)
                    {
                        let field = (*lattice, method, *table, shader);
                        let cells = [near.u, far.u];
                        let seen = (*rays, packet);
                        let slabs = (is_slab, W::CUT && near.level > 0);
                        is_found |=
                            surfaces.meet_levels(simd, field, seen, (cells, ts), slabs, ahead);
                    }
                }
                if is_found {
                    let (mut ts, mut beside) = (ts, None);
                    if let Some(passing) = passing.as_mut().filter(|_| W::MORE) {
                        // The face behind is two further on.
                        let slab = if back { k + 2 } else { k - 3 };
                        let state = (&mut *light, &mut *ahead);
                        let at = (slab, &mut found, &mut ts);
                        beside = self.lay_before(simd, packet, passing, at, state, capped);
                    }
                    let what = (&found, beside);
                    *capped += self.rule.lay::<S, W>(simd, packet, what, ts, (light, ahead));
                    if !light.goes_on(simd, self.rule.stop_below) {
                        return;
                    }
                }
            }
            (before, near, far) = (near, far, here);
            if method.is_own() {
                (border_near, border_far) = (border_far, border_here);
            }
        }
    }

    /// Slabs of which the value in the middle counts. Not inlined: it would be compiled into every loop, and goes through a
    /// whole run.
    #[inline(never)]
    fn middles<S: Simd>(
        &self,
        simd: S,
        field: (Method, &mut Option<OwnAlong<'_, S>>),
        packet: &Packet<S>,
        run: [i32; 2],
        state: State<'_, '_, S>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || self.middles_here(simd, field, packet, run, state),
        );
    }

    #[inline(always)]
    fn middles_here<S: Simd>(
        &self,
        simd: S,
        (method, own): (Method, &mut Option<OwnAlong<'_, S>>),
        packet: &Packet<S>,
        [first, last]: [i32; 2],
        (light, ahead, passing, capped): State<'_, '_, S>,
    ) {
        let Self { rays, lattice, table, .. } = self;
        let back = self.rule.back_to_front;
        for i in 0..=last - first {
            let slab = if back { last - i } else { first + i };
            let face = |k: i32| all(simd, k as f32 * rays.step).max(packet.enter).min(packet.leave);
            let ts = if back { [face(slab + 1), face(slab)] } else { [face(slab), face(slab + 1)] };
            let t = (ts[0] + ts[1]) * 0.5;
            let (way, end) = if back { (-1, first) } else { (1, last) };
            let stored = match own {
                Some(own) if method.is_own() => own.at(simd, packet, (slab, way, end), t),
                _ => Found::of(simd, lattice.value(simd, method, packet.at(t))),
            };
            let cell = table.cell(simd, stored.value);
            let is_slab = !Lattice::is_nothing(simd, method, stored.value);
            let shows = table.may_show(simd, [cell; 2], all(simd, 0.0)) & is_slab;
            let mut found = None;
            if any(shows) {
                let mut slab =
                    Halves { near: table.look(simd, cell), far: Look::splat(simd, [0.0; 4]) };
                slab = slab.without(simd, !shows);
                if let Some(shader) = self.light.filter(|light| light.is_of_slabs)
                    && light::shows(simd, &slab)
                {
                    let growth = match stored.growth {
                        None if let Some(range) = shader.of_names => {
                            Some(Growth::At(lattice.end_of_name(simd, packet.at(t), range)))
                        }
                        Some(growth) if shader.uses_gradient => Some(Growth::At(growth)),
                        None if shader.uses_gradient => {
                            let of_borders = shader.is_of_borders;
                            Some(Growth::At(lattice.lit_growth(
                                simd,
                                method,
                                packet.at(t),
                                of_borders,
                            )))
                        }
                        _ => None,
                    };
                    let eye = shader.towards_eye(simd, rays, packet);
                    shader.shade(simd, (eye, table.values), &mut slab, (cell, growth, t));
                }
                found = Some(slab);
            }
            if self.lattice.ends_within() {
                found = self.without_holes(simd, packet, ts, found, true);
            }
            if let Some(mut found) = found {
                let (mut ts, mut beside) = (ts, None);
                if let Some(passing) = passing.as_mut() {
                    let state = (&mut *light, &mut *ahead);
                    let at = (slab, &mut found, &mut ts);
                    beside = self.lay_before(simd, packet, passing, at, state, capped);
                }
                let what = (&found, beside);
                *capped += self.rule.lay::<S, Rich>(simd, packet, what, ts, (light, ahead));
                if !light.goes_on(simd, self.rule.stop_below) {
                    return;
                }
            }
        }
    }

    /// Takes the faces of a slab of a lattice over cells to where it enters and leaves these. Not inlined, as few lattices are.
    #[inline(never)]
    fn cut_off<S: Simd>(
        &self,
        simd: S,
        border: &CellBorder,
        packet: &Packet<S>,
        method: Method,
        faces: &mut [Face<S>; 2],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let [a, b] = *faces;
                let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
                let at_a = self.lattice.depth(simd, border, packet.at(a.t));
                let at_b = self.lattice.depth(simd, border, packet.at(b.t));
                let (a_is_out, b_is_out) = (at_a.simd_lt(zero), at_b.simd_lt(zero));
                if !any(a_is_out | b_is_out) {
                    return;
                }
                // Between two faces outside may lie an edge of the cells.
                let middle = (a.t + b.t) * 0.5;
                let at_middle = self.lattice.depth(simd, border, packet.at(middle));
                let is_edge = a_is_out & b_is_out & at_middle.simd_ge(zero);
                let is_some = !(a_is_out & b_is_out) | is_edge;
                let ends = [(a_is_out, at_a, [b.t, at_b]), (b_is_out, at_b, [a.t, at_a])];
                for (face, (is_out, depth, [other, other_depth])) in faces.iter_mut().zip(ends) {
                    // Its other end lies inside.
                    let is_moved = is_out & is_some;
                    let to = choose(is_edge, middle, other);
                    let rise = choose(is_edge, at_middle, other_depth) - depth;
                    let share = zero - depth / choose(is_moved, rise, one);
                    face.t = choose(is_moved, (to - face.t).mul_add(share, face.t), face.t);
                    let value = self.lattice.value(simd, method, packet.at(face.t));
                    face.u = choose(is_moved, self.table.cell(simd, value), face.u);
                    face.has_growth &= !any(is_moved);
                }
                faces.iter_mut().for_each(|face| face.is_there &= is_some);
            },
        );
    }

    /// Samples without data are boxes: nothing is interpolated there, nor lit. Not inlined: it would be compiled into every loop.
    #[inline(never)]
    fn without_holes<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        ts: [Lanes<S>; 2],
        found: Option<Halves<S>>,
        middle: bool,
    ) -> Option<Halves<S>> {
        simd.vectorize(
            #[inline(always)]
            || self.without_holes_here(simd, packet, ts, found, middle),
        )
    }

    #[inline(always)]
    fn without_holes_here<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        ts: [Lanes<S>; 2],
        found: Option<Halves<S>>,
        middle: bool,
    ) -> Option<Halves<S>> {
        let holes = self.lattice.is_outside(simd, packet.at((ts[0] + ts[1]) * 0.5));
        if !any(holes) {
            return found;
        }
        // Outside of cells nothing is, not even what has no data.
        let shows = self.table.no_data[3] > 0.0 && self.lattice.has_holes();
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

    /// Lays down what kernels have before a slab of the field; returns what they have in it. Rays that find nothing of
    /// the field there meet that between the faces of the slab, wherever the lattice ends. Not inlined, as few scenes
    /// have kernels: it would be compiled into every loop.
    #[inline(never)]
    fn lay_before<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        passing: &mut Passing<'_, S>,
        (slab, found, ts): (i32, &mut Halves<S>, &mut [Lanes<S>; 2]),
        state: (&mut Gathered<S>, &mut Option<Ahead<'_, S>>),
        capped: &mut u64,
    ) -> Option<Sum<S>> {
        simd.vectorize(
            #[inline(always)]
            || {
                let of_kernels = passing.slab_of(slab);
                *capped += self.rule.lay_kernels(simd, packet, passing, of_kernels, state);
                let beside = passing.take(simd, of_kernels)?;
                // Beyond the lattice a slab has no length.
                *found = found.without(simd, ts[0].simd_eq(ts[1]));
                let shows = found.weight().simd_gt(all(simd, 0.0));
                let whole = passing.ends_of(simd, slab, self.rays.step);
                *ts = [choose(shows, ts[0], whole[0]), choose(shows, ts[1], whole[1])];
                Some(beside)
            },
        )
    }
}

/// What rays have come to: their light, the surfaces and the kernels ahead, and opacities that were lowered to 1.
type State<'a, 'k, S> = (
    &'a mut Gathered<S>,
    &'a mut Option<Ahead<'k, S>>,
    &'a mut Option<Passing<'k, S>>,
    &'a mut u64,
);

/// What a tile has beside a field: kernels of lists, and triangles with the number of the block.
type Others<'a, 'k, S> = (Option<&'a mut (&'k Kernels, Kept<S>)>, Option<(&'k Fragments, u32)>);

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

/// The number in its tile of a block's first pixel.
pub(super) fn first_of(block: u32) -> usize {
    let [x, y] = [block % 2 * 4, block / 2 * 2].map(|n| n as usize);
    y * TILE as usize + x
}

/// Writes a share of what a block has gathered into its tile.
#[inline(always)]
pub(super) fn write_block<S: Simd>(block: u32, sum: Look<S>, share: f32, out: &mut [Pixel]) {
    for lane in 0..LANES {
        let at = first_of(block) + lane / 4 * TILE as usize + lane % 4;
        let [r, g, b] = sum.colour.lane(lane);
        out[at] = [r * share, g * share, b * share, sum.weight[lane] * share];
    }
}

/// What a face of a slab is known to have.
#[derive(Clone, Copy)]
struct Face<S: Simd> {
    t: Lanes<S>,
    /// Cell of the value.
    u: Lanes<S>,
    /// Growth of the stored value per index, once someone has asked.
    growth: Vec3<S>,
    has_growth: bool,
    /// Of the field that it was found in.
    level: u8,
    is_there: Mask<S>,
}

/// The border of cells or means in the slab behind a face: see [`Found`]. Lattices have none, and no room for it: copying that
/// from face to face took a twentieth of a lit picture.
#[derive(Clone, Copy)]
struct Border<S: Simd> {
    places: [Lanes<S>; 4],
    growths: Option<[Vec3<S>; 2]>,
}

/// Takes the faces of a slab that lie outside all cells, or beside all points, to where it enters and leaves these: the one nearer to the eye comes
/// first, whatever is drawn first.
#[inline(always)]
fn trim<S: Simd>(
    simd: S,
    (lattice, table, packet, (method, is_shaded, of_borders)): (
        &Lattice,
        &Table,
        &Packet<S>,
        (Method, bool, bool),
    ),
    border: Option<Border<S>>,
    [near, far]: [&mut Face<S>; 2],
) {
    let (begins, ends) = (!near.is_there, !far.is_there);
    let Some(Border { places, growths: known }) = border.filter(|_| any(begins | ends)) else {
        return;
    };
    let [nearest, farthest, near_value, far_value] = places;
    let is_within = nearest.simd_ge(near.t) & farthest.simd_le(far.t) & nearest.simd_le(farthest);
    let (begins, ends) = (begins & is_within, ends & is_within);
    if is_shaded {
        let of = (lattice, method, &None, of_borders);
        let none = Vec3::splat(simd, [0.0; 3]);
        let at_near = if any(near.is_there) { near.growth(simd, of, packet) } else { none };
        let at_far = if any(far.is_there) { far.growth(simd, of, packet) } else { none };
        // Cells know them.
        let [first, last] = match known {
            Some(growths) => growths,
            None => {
                let mut found = [none; 2];
                if any(begins) {
                    let place = packet.at(nearest);
                    found[0] = lattice.lit_growth(simd, method, place, of_borders);
                }
                if any(ends) {
                    let place = packet.at(farthest);
                    found[1] = lattice.lit_growth(simd, method, place, of_borders);
                }
                found
            }
        };
        let of_near = Vec3::choose(begins, first, at_near);
        let of_far = Vec3::choose(ends, last, at_far);
        (near.growth, far.growth) = (of_near, of_far);
        (near.has_growth, far.has_growth) = (true, true);
    }
    for (face, is_moved, t, value) in
        [(near, begins, nearest, near_value), (far, ends, farthest, far_value)]
    {
        face.t = choose(is_moved, t, face.t);
        face.u = choose(is_moved, table.cell(simd, value), face.u);
        face.is_there |= is_moved;
    }
}

impl<S: Simd> Face<S> {
    #[inline(always)]
    fn growth(
        &mut self,
        simd: S,
        (lattice, method, levels, of_borders): (&Lattice, Method, &Option<Levels<'_>>, bool),
        packet: &Packet<S>,
    ) -> Vec3<S> {
        if !self.has_growth {
            let place = packet.at(self.t);
            self.growth = match levels {
                Some(levels) if self.level > 0 => levels.gradient(simd, self.level, place),
                _ => lattice.lit_growth(simd, method, place, of_borders),
            };
            self.has_growth = true;
        }
        self.growth
    }
}
