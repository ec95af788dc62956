//! What slabs have of the kernels of lists that eight rays pass.
//!
//! All rays of a packet walk one list, in the order in which its kernels begin, so that nothing is fetched ray by ray
//! but marks. What kernels give to slabs is summed up in a ring of these, from the next one to be composited on; a
//! kernel is added before the first of its slabs is.

use fearless_simd::{Simd, prelude::*};

use super::composite::{Gathered, Rule};
use super::kernels::{Footprint, Kernels};
use super::lanes::{LANES, Lanes, Look, Vec3, all, any, choose};
use super::polygons::Polygons;
use super::rays::{Packet, Rays, TILE};
use super::surfaces::Ahead;
use super::walk::{Pixel, block_of, corner_of, first_of, write_block};
use crate::kernel::{FootprintPolynomial, Rim, SlabShare};

/// Less depth than this changes no picture.
const LEAST_AMOUNT: f32 = 1e-7;
/// After all slabs.
pub(super) const EVERY_SLAB: i32 = i32::MAX;

/// What a slab has of kernels: light, and depth or opacity.
pub(super) type Sum<S> = Look<S>;

/// What the packets of a tile share, and what is kept of slabs until they have passed them.
pub(super) struct Kept<S: Simd> {
    /// Kernels that touch it.
    list: Vec<u32>,
    /// Sums of slabs, by their numbers modulo its length, a power of two.
    ring: Vec<Sum<S>>,
}

impl<S: Simd> Kept<S> {
    /// Of the tile whose first pixel is `corner`.
    pub(super) fn new(simd: S, kernels: &Kernels, corner: [u32; 2]) -> Self {
        let mut list = Vec::new();
        kernels.touching(corner, &mut list);
        let slabs = if list.is_empty() { 1 } else { kernels.most_slabs.next_power_of_two() };
        Self { list, ring: vec![Look::splat(simd, [0.0; 4]); slabs as usize] }
    }

    /// Whether no kernel touches it.
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

/// Eight rays among kernels. Slabs are counted in the order of compositing.
pub(super) struct Passing<'a, S: Simd> {
    kernels: &'a Kernels,
    tile: &'a mut Kept<S>,
    /// The next kernel of the list.
    entry: usize,
    /// The next slab to be composited, and the one after the last that any kernel was added to.
    next: i32,
    end: i32,
    /// How many slabs of the field have taken their share of the next one.
    taken: i32,
    /// What lies between these depths is kept.
    kept: [Lanes<S>; 2],
    screen: [Lanes<S>; 2],
    slant: Lanes<S>,
}

impl<'a, S: Simd> Passing<'a, S> {
    /// Before the first slab.
    #[inline(always)]
    pub(super) fn new(
        simd: S,
        kernels: &'a Kernels,
        tile: &'a mut Kept<S>,
        (rays, packet): (&Rays, &Packet<S>),
        kept: [Lanes<S>; 2],
    ) -> Self {
        tile.ring.fill(Look::splat(simd, [0.0; 4]));
        let [x, y] = packet.screen;
        let (x, y) = (x * rays.growth, y * rays.growth);
        let slant = x.mul_add(x, y.mul_add(y, all(simd, 1.0))).sqrt();
        let screen = packet.screen;
        // Of nothing, one place.
        let kept = [kept[0], kept[0].max(kept[1])];
        let (next, end) = (i32::MIN, i32::MIN);
        Self { kernels, tile, entry: 0, next, end, taken: 0, kept, screen, slant }
    }

    /// Distance between the faces of the slabs of kernels.
    #[inline(always)]
    pub(super) fn thickness(&self) -> f32 {
        self.kernels.thickness
    }

    /// The slab of kernels that one of the field lies in, as it is counted from near to far.
    #[inline(always)]
    pub(super) fn slab_of(&self, slab: i32) -> i32 {
        let slab = slab.div_euclid(self.kernels.field_slabs);
        if self.kernels.back_to_front { -slab } else { slab }
    }

    /// Depths between which a slab lies, the first on the way first.
    #[inline(always)]
    pub(super) fn ends(&self, simd: S, slab: i32) -> [Lanes<S>; 2] {
        let slab = if self.kernels.back_to_front { -slab } else { slab };
        self.ends_of(simd, slab, self.kernels.thickness)
    }

    /// The same of a slab of some thickness, as it is counted from near to far.
    #[inline(always)]
    pub(super) fn ends_of(&self, simd: S, slab: i32, thickness: f32) -> [Lanes<S>; 2] {
        let [low, high] = self.kept;
        let nearer = slab as f32 * thickness;
        let at = |t: f32| all(simd, t).max(low).min(high);
        let ends = [at(nearer), at(nearer + thickness)];
        if self.kernels.back_to_front { [ends[1], ends[0]] } else { ends }
    }

    /// The next slab before one in which kernels are, and what they have of it; what of it the field has taken is not
    /// in it. `None` where no such is left.
    #[inline(always)]
    pub(super) fn before(&mut self, simd: S, slab: i32) -> Option<(i32, Sum<S>)> {
        if self.next >= slab {
            return None;
        }
        self.seek(simd, slab);
        (self.next < slab && self.next < self.end).then(|| {
            let parts = self.kernels.field_slabs;
            let left = (parts - self.taken) as f32 / parts as f32;
            let (at, sum) = (self.next, self.pop(simd));
            (at, Look { colour: sum.colour.scaled(all(simd, left)), weight: sum.weight * left })
        })
    }

    /// The share of a slab of the field in what kernels have there, before which all is composited.
    #[inline(always)]
    pub(super) fn take(&mut self, simd: S, slab: i32) -> Option<Sum<S>> {
        if self.next > slab {
            return None;
        }
        self.seek(simd, slab);
        if self.next != slab || slab >= self.end {
            return None;
        }
        let parts = self.kernels.field_slabs;
        let mut sum = self.tile.ring[self.place(slab)];
        if parts > 1 {
            let share = 1.0 / parts as f32;
            sum = Look { colour: sum.colour.scaled(all(simd, share)), weight: sum.weight * share };
        }
        self.taken += 1;
        if self.taken == parts {
            self.pop(simd);
        }
        Some(sum)
    }

    /// Goes to the first slab up to `slab` that has anything, with all that it has; beyond it where none does.
    #[inline(always)]
    fn seek(&mut self, simd: S, slab: i32) {
        loop {
            if self.next >= self.end {
                // Nothing is in the ring: on to where the next kernel begins.
                let Some(&kernel) = self.tile.list.get(self.entry) else {
                    return;
                };
                let (_, [first, _]) = self.kernels.get(kernel);
                if first > slab {
                    return;
                }
                // A kernel may begin before the last slab that was composited, by rounding.
                self.next = self.next.max(first);
                self.taken = 0;
            }
            while let Some(&kernel) = self.tile.list.get(self.entry) {
                let (footprint, slabs) = self.kernels.get(kernel);
                if slabs[0] > self.next {
                    break;
                }
                self.entry += 1;
                self.add(simd, footprint, slabs);
            }
            if self.next < self.end {
                return;
            }
        }
    }

    /// Takes the next slab out of the ring.
    #[inline(always)]
    fn pop(&mut self, simd: S) -> Sum<S> {
        let place = self.place(self.next);
        self.next += 1;
        self.taken = 0;
        std::mem::replace(&mut self.tile.ring[place], Look::splat(simd, [0.0; 4]))
    }

    #[inline(always)]
    #[expect(clippy::cast_sign_loss, reason = "a remainder")]
    fn place(&self, slab: i32) -> usize {
        (slab as usize) & (self.tile.ring.len() - 1)
    }

    /// Adds what slabs have of a kernel. Not inlined: it is called from several loops.
    #[inline(never)]
    fn add(&mut self, simd: S, kernel: &Footprint, slabs: [i32; 2]) {
        simd.vectorize(
            #[inline(always)]
            || self.add_inlined(simd, kernel, slabs),
        );
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    fn add_inlined(&mut self, simd: S, kernel: &Footprint, [first, last]: [i32; 2]) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let Kernels { looks, thickness, .. } = self.kernels;
        let right = self.screen[0] - kernel.middle[0];
        let up = self.screen[1] - kernel.middle[1];
        let [a, b, c] = kernel.to_circle;
        let unit = [right * a, right.mul_add(all(simd, b), up * c)];
        let q = unit[0].mul_add(unit[0], unit[1] * unit[1]);
        let is_in = q.simd_lt(one);
        if !any(is_in) {
            return;
        }
        let look = &looks[usize::from(kernel.list)];
        let window = all(simd, look.window);
        let [cos, sin] = kernel.turn;
        let turned = [
            unit[0].mul_add(all(simd, cos), unit[1] * sin) * window,
            unit[1].mul_add(all(simd, cos), unit[0] * -sin) * window,
        ];
        let polynomial = &self.kernels.footprint;
        // Of a line through the middle 1.
        let windowed = footprint(simd, polynomial, q * window * window);
        let windowed = windowed * (1.0 / polynomial.evaluate(0.0));
        let how = (self.kernels.phase, look.foreshortening);
        let (mark, lost) = look.marks.at(simd, kernel, how, turned);
        let intensity = mark * windowed;
        let (colour, texture) = if look.is_blend {
            // The colour is mixed, the opacity is the splat's own.
            let mix =
                |body: f32, marks: f32| intensity.mul_add(all(simd, marks - body), all(simd, body));
            let [body, marks] = [kernel.body, kernel.marks];
            let x = mix(body[0], marks[0]);
            let y = mix(body[1], marks[1]);
            let z = mix(body[2], marks[2]);
            (Vec3 { x, y, z }, footprint(simd, polynomial, q))
        } else {
            let light = (one - mark).mul_add(all(simd, lost), mark) * windowed;
            (Vec3::splat(simd, kernel.body).scaled(light), intensity)
        };
        let amount = texture * self.slant * kernel.amount;
        let shows = is_in & amount.simd_gt(all(simd, LEAST_AMOUNT));
        if !any(shows) {
            return;
        }
        let amount = choose(shows, amount, zero);
        let [x, y] = kernel.tilt;
        let middle =
            right.mul_add(all(simd, x), up.mul_add(all(simd, y), all(simd, kernel.middle[2])));
        let half = (one - q).max(all(simd, 1e-12)).sqrt();
        let per_depth = all(simd, kernel.per_depth) / half;
        // The slabs that any of these rays meets it in.
        let reach = one / per_depth;
        let far = all(simd, 3e38);
        let nearest = choose(shows, middle - reach, far).reduce_min() / thickness;
        let farthest = choose(shows, middle + reach, -far).reduce_max() / thickness;
        let (near, deep) = (nearest.floor() as i32, farthest.floor() as i32);
        let back = self.kernels.back_to_front;
        let [near_slab, far_slab] = if back { [-last, -first] } else { [first, last] };
        let (near, deep) = (near.clamp(near_slab, far_slab), deep.clamp(near_slab, far_slab));
        // Of what is cut away nothing.
        let low = ((self.kept[0] - middle) * per_depth).max(-one).min(one);
        let high = ((self.kept[1] - middle) * per_depth).max(-one).min(one);
        let factors = factors(simd, &self.kernels.share, q);
        let step = per_depth * *thickness;
        let mut place = (all(simd, near as f32 * thickness) - middle) * per_depth;
        let mut before = share(simd, &factors, place.max(low).min(high));
        let light = colour.scaled(amount);
        for slab in near..=deep {
            place += step;
            let behind = share(simd, &factors, place.max(low).min(high));
            // Rounding must not take anything away: what is divided by later would be of either sign.
            let part = (behind - before).max(zero);
            before = behind;
            let at = self.place(if back { -slab } else { slab });
            let sum = &mut self.tile.ring[at];
            sum.colour = sum.colour.at(light, part);
            sum.weight = amount.mul_add(part, sum.weight);
        }
        let (begins, ends) = if back { (-deep, -near) } else { (near, deep) };
        assert!(!cfg!(test) || begins >= self.next);
        self.end = self.end.max(ends + 1);
    }
}

/// What a line at a squared distance of the middle, of the radius', has of a kernel.
#[inline(always)]
pub(super) fn footprint<S: Simd>(
    simd: S,
    polynomial: &FootprintPolynomial,
    q: Lanes<S>,
) -> Lanes<S> {
    let q = q.min(all(simd, 1.0));
    let u = q * 2.0 - 1.0;
    let mut sum = all(simd, 0.0);
    for c in polynomial.coefficients.into_iter().rev() {
        sum = sum.mul_add(u, all(simd, c));
    }
    let inside = all(simd, 1.0) - q;
    let rim = match polynomial.rim {
        Rim::Square => inside * inside,
        Rim::Root => inside.sqrt(),
    };
    // The polynomial may fall a little below 0 at its rim.
    (sum * rim).max(all(simd, 0.0))
}

/// The factors of a share (`kernel::SlabShare`) at a squared distance.
#[inline(always)]
fn factors<S: Simd>(simd: S, share: &SlabShare, q: Lanes<S>) -> [Lanes<S>; 6] {
    let mut found = [all(simd, 0.0); 6];
    for (found, [a, b, c, _]) in found.iter_mut().zip(share.factors) {
        *found = q.mul_add(q.mul_add(all(simd, c), all(simd, b)), all(simd, a));
    }
    found
}

/// The part of a kernel that lies before a place, in half chords of the line, −1..=1.
#[inline(always)]
fn share<S: Simd>(simd: S, factors: &[Lanes<S>; 6], place: Lanes<S>) -> Lanes<S> {
    let x = place * place;
    let mut sum = factors[5];
    for factor in [factors[4], factors[3], factors[2], factors[1], factors[0]] {
        sum = sum.mul_add(x, factor);
    }
    sum.mul_add(place, all(simd, 0.5))
}

/// Kernels and triangles without a field.
#[derive(Debug, Clone, Copy)]
pub(super) struct Alone<'a> {
    pub rays: &'a Rays,
    pub kernels: Option<&'a Kernels>,
    pub polygons: Option<&'a Polygons>,
    pub rule: Rule,
}

impl Alone<'_> {
    /// Draws a tile; opacities that were over 1, and lowered to it.
    #[inline(always)]
    pub(super) fn tile<S: Simd>(&self, simd: S, tile: usize, out: &mut [Pixel]) -> u64 {
        out.fill([0.0; 4]);
        let corner = corner_of(self.rays, tile);
        let fragments = self.polygons.and_then(|polygons| polygons.seen_in(corner));
        let kernels = self.kernels.map(|kernels| (kernels, Kept::new(simd, kernels, corner)));
        let mut kernels = kernels.filter(|(_, kept)| !kept.is_empty());
        if kernels.is_none() && fragments.is_none() {
            return 0;
        }
        let back = self.rule.back_to_front;
        let mut capped = 0;
        for block in 0..TILE * TILE / LANES as u32 {
            let Some(at) = block_of(self.rays, corner, block) else { continue };
            let packet = self.rays.packet(simd, at, [0.5; 2]);
            let kept = self.rays.kept(simd, &packet);
            let mut light = Gathered::none(simd, packet.in_picture, fragments.is_some());
            let mut ahead = fragments
                .as_deref()
                .map(|fragments| Ahead::new(simd, Some(fragments), first_of(block), kept, back));
            if let Some((kernels, of_tile)) = &mut kernels {
                let seen = (self.rays, &packet);
                let mut passing = Passing::new(simd, kernels, of_tile, seen, kept);
                let state = (&mut light, &mut ahead);
                capped += self.rule.lay_kernels(simd, &packet, &mut passing, EVERY_SLAB, state);
            }
            if let Some(ahead) = &mut ahead {
                self.rule.lay_rest(&mut light, ahead);
            }
            write_block(block, light.light(simd), 1.0, out);
        }
        capped
    }
}
