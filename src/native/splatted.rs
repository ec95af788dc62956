//! A tile of kernels that are shaded first: a lattice's samples, or those of lists, and what lies among them.

use fearless_simd::Simd;

use super::among::Among;
use super::composite::{Gathered, Rule};
use super::gather::Walk;
use super::grid::{Faces, Grid, Layering};
use super::kernels::Kernels;
use super::lanes::{LANES, Look, all, any};
use super::laying::{Layers, Laying};
use super::nodes::Nodes;
use super::passing::{EVERY_SLAB, Kept, Passing, Sum};
use super::polygons::Polygons;
use super::rays::{Packet, Rays, TILE};
use super::samples::Samples;
use super::surfaces::Ahead;
use super::walk::{Pixel, block_of, corner_of, first_of, write_block};

/// Kernels, and what lies among them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Splatted<'a> {
    pub rays: &'a Rays,
    pub splats: Splats<'a>,
    pub kernels: Option<&'a Kernels>,
    pub polygons: Option<&'a Polygons>,
    pub rule: Rule,
}

/// What is splatted.
#[derive(Debug, Clone, Copy)]
pub(super) enum Splats<'a> {
    /// Nothing that can show.
    Nothing,
    /// Samples, and where their kernels lie.
    Samples(&'a Grid, &'a Samples),
    /// Kernels of lists.
    Nodes(&'a Nodes),
}

/// What the packets of a tile share.
struct OfTile<S: Simd> {
    /// Kernels of lists that touch it.
    list: Vec<u32>,
    ring: Vec<Sum<S>>,
}

impl Splatted<'_> {
    /// Draws a tile; opacities that were over 1, and lowered to it.
    #[inline(always)]
    pub(super) fn tile<S: Simd>(&self, simd: S, tile: usize, out: &mut [Pixel]) -> u64 {
        out.fill([0.0; 4]);
        let corner = corner_of(self.rays, tile);
        let fragments = self.polygons.and_then(|polygons| polygons.seen_in(corner));
        let kernels = self.kernels.map(|kernels| (kernels, Kept::new(simd, kernels, corner)));
        let mut kernels = kernels.filter(|(_, kept)| !kept.is_empty());
        let mut of_tile = OfTile { list: Vec::new(), ring: Vec::new() };
        if let Splats::Nodes(nodes) = self.splats {
            nodes.touching(corner, &mut of_tile.list);
            if of_tile.list.is_empty() && fragments.is_none() && kernels.is_none() {
                return 0;
            }
        }
        // Kernels of lists are a pixel wide at least.
        let side = if matches!(self.splats, Splats::Nodes(_)) { 1 } else { self.rays.side };
        let share = 1.0 / (side * side) as f32;
        let mut capped = 0;
        for block in 0..TILE * TILE / LANES as u32 {
            let Some(at) = block_of(self.rays, corner, block) else { continue };
            let mut sum = Look::splat(simd, [0.0; 4]);
            for i in 0..side * side {
                let part = [i % side, i / side].map(|n| (n as f32 + 0.5) / side as f32);
                let packet = self.rays.packet(simd, at, part);
                let (eye, far) = (all(simd, self.rays.eye), all(simd, 1e30));
                let mut light = Gathered::none(simd, packet.in_picture, fragments.is_some());
                let back = self.rule.back_to_front;
                let ahead = fragments.as_deref().map(|fragments| {
                    Ahead::new(simd, Some(fragments), first_of(block), [eye, far], back)
                });
                let passing = kernels.as_mut().map(|(kernels, of_tile)| {
                    Passing::new(simd, kernels, of_tile, (self.rays, &packet), [-far, far])
                });
                let mut among = Among::new(ahead, passing);
                let state = (&mut light, &mut among, &mut of_tile);
                capped += self.pass(simd, &packet, state);
                let light = light.light(simd);
                sum.colour = sum.colour.add(light.colour);
                sum.weight += light.weight;
            }
            write_block(block, sum, share, out);
        }
        capped
    }

    /// Eight rays, from one end to the other.
    #[inline(always)]
    fn pass<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        (light, among, of_tile): (&mut Gathered<S>, &mut Among<'_, S>, &mut OfTile<S>),
    ) -> u64 {
        let mut capped = 0;
        let mut in_slabs = false;
        let OfTile { list, ring } = of_tile;
        let layers = Layers { ring, next: i32::MIN, end: i32::MIN };
        let sum = Look::splat(simd, [0.0; 4]);
        match self.splats {
            Splats::Nothing => {}
            Splats::Samples(grid, samples) => {
                in_slabs = grid.layering == Layering::Slabs;
                let line = grid.line(simd, packet, self.rays.eye);
                if any(line.is_in) {
                    let laying = Laying {
                        simd,
                        rule: self.rule,
                        shape: &grid.shape,
                        layering: grid.layering,
                        packet,
                        eye: grid.is_perspective.then(|| all(simd, self.rays.eye)),
                        faces: grid.faces(simd, &line),
                        sum,
                        layers,
                        light: &mut *light,
                        among: &mut *among,
                        capped: 0,
                    };
                    let samples = samples.along(grid.axes);
                    let mut walk = Walk { laying, grid, samples, line };
                    walk.along();
                    capped += walk.laying.capped;
                }
            }
            Splats::Nodes(nodes) => {
                in_slabs = nodes.thickness.is_some();
                let step = all(simd, nodes.thickness.unwrap_or(1.0));
                let mut laying = Laying {
                    simd,
                    rule: self.rule,
                    shape: &nodes.shape,
                    layering: if in_slabs { Layering::Slabs } else { Layering::Sample },
                    packet,
                    eye: None,
                    faces: Faces { begin: all(simd, 0.0), step },
                    sum,
                    layers,
                    light: &mut *light,
                    among: &mut *among,
                    capped: 0,
                };
                laying.lay_nodes(nodes, list);
                capped += laying.capped;
            }
        }
        if among.is_none() || !light.goes_on(simd, self.rule.stop_below) {
            return capped;
        }
        if !in_slabs {
            return capped + among.lay_rest(simd, &self.rule, light);
        }
        if let Some(passing) = &mut among.passing {
            let state = (&mut *light, &mut among.ahead);
            capped += self.rule.lay_kernels(simd, packet, passing, EVERY_SLAB, state);
        }
        if let Some(ahead) = &mut among.ahead {
            self.rule.lay_rest(light, ahead);
        }
        capped
    }
}
