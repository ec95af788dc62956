//! Cells that lie anywhere, in index space, eight places at a time (`cells` has the definitions).

use std::sync::{Arc, OnceLock};

use fearless_simd::{Simd, i32x8, prelude::*};
use glam::{DMat3, DVec3};

use super::functions::Left;
use super::in_order::look;
use super::landed::{Extent, Landed};
use super::lanes::{LANES, Lanes, Mask, Vec3, all, any, choose};
use super::lattice::NOTHING;
use super::lit_cells::{Growths, Lit, LitFace, Seen};
use super::rays::Rays;
use super::shapes::{BEYOND, Bent, Straight, clamped, narrow, of_solid, of_tetrahedron, weights};
use super::sums::Asked;
use super::supports::NotBegun;
use super::window::Here;
use crate::cells::{self, CellField, Kind, Listed, On, Rim};
use crate::core::parallel;
use crate::core::{Cancelled, Looks, Ticket, mapped};
use crate::kernel::Bounds;
use crate::volume::Lattice;

/// Solids that are made between two looks at the ticket: those with curved faces take microseconds.
const A_PART: usize = 1 << 11;
/// And numbers, or places, that are found.
const A_RUN: usize = 1 << 14;
/// A solid.
#[derive(Debug, Clone, Copy)]
pub(super) enum Solid {
    /// Its number among the tetrahedra.
    Straight(u32),
    /// Its number among the others.
    Bent(u32),
    /// Without volume, or without a value.
    Nothing,
}

/// The same before it has its number.
enum Made {
    Straight(Straight),
    Bent(Bent),
    Nothing,
}

/// An outer face of the cells: a triangle, or bilinear between four corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outer {
    pub origin: [f32; 3],
    /// Factors of u, v and u v of its places.
    pub places: [[f32; 3]; 3],
    /// Factors of 1, u, v and u v of its values.
    pub values: [f32; 4],
    pub is_triangle: bool,
    corners: [u32; 4],
    solid: u32,
}

/// The cells of a field, over a lattice.
#[derive(Debug)]
pub(super) struct Solids {
    field: Arc<CellField>,
    /// World steps of the lattice, and where it begins.
    axes: DMat3,
    origin: DVec3,
    listed: Listed,
    pub solids: Vec<Solid>,
    pub straight: Vec<Straight>,
    pub bent: Vec<Bent>,
    pub outer: Vec<Outer>,
    /// Growth of the value per index at the points; made once someone has asked.
    growths: OnceLock<Vec<[f32; 3]>>,
    /// What light takes for it; made once a picture is lit.
    lit: OnceLock<Lit>,
}

impl Solids {
    /// Of a field, over a lattice; values are less `bias`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        field: &Arc<CellField>,
        lattice: &Lattice,
        bias: f64,
        ticket: &Ticket,
    ) -> Result<Self, Cancelled> {
        let cells = field.cells();
        let index_from_world = lattice.axes().inverse();
        let place = |world: DVec3| index_from_world * (world - lattice.origin);
        let is_there = field.drawn(ticket)?;
        let listed = Listed::new(cells, (lattice.dims, place), |i| is_there[i], ticket)?;
        let rim = Rim::of(lattice.dims);
        let made = |(i, solid): (usize, &cells::Solid)| {
            let values = field.at_corners(i).map(|value| narrow(value - bias));
            let placed = solid.placed(&listed.points);
            if !is_there[i] || placed.is_flat() {
                Made::Nothing
            } else if solid.kind() == Kind::Tetrahedron {
                of_tetrahedron(&placed, values, rim).map_or(Made::Nothing, Made::Straight)
            } else {
                Made::Bent(of_solid(&placed, values, rim))
            }
        };
        let (mut straight, mut bent) = (Vec::new(), Vec::new());
        let mut solids = Vec::with_capacity(is_there.len());
        // Part by part, so that all of them are not held twice.
        for (part, own) in cells.solids().chunks(A_PART).enumerate() {
            look(ticket)?;
            let first = part * A_PART;
            for one in parallel::list(own.len(), |i| made((first + i, &own[i]))) {
                solids.push(match one {
                    Made::Nothing => Solid::Nothing,
                    Made::Straight(own) => {
                        straight.push(own);
                        Solid::Straight(straight.len() as u32 - 1)
                    }
                    Made::Bent(own) => {
                        bent.push(own);
                        Solid::Bent(bent.len() as u32 - 1)
                    }
                });
            }
        }
        let mut outer = Vec::new();
        let mut looks = Looks::every(ticket, A_PART);
        for face in &field.surface(ticket)?.faces {
            looks.after(1)?;
            let solid = face.solid as usize;
            let corners = cells.solids()[solid].corners();
            let values = field.at_corners(solid);
            let value = |point: u32| {
                let at = corners.iter().position(|corner| *corner == point).unwrap_or_default();
                values[at] - bias
            };
            let is_triangle = face.corners[2] == face.corners[3];
            let [a, b, c, d] = face.corners.map(|point| listed.points[point as usize]);
            let [va, vb, vc, vd] = face.corners.map(value);
            let (places, values) = match is_triangle {
                true => ([b - a, c - a, DVec3::ZERO], [va, vb - va, vc - va, 0.0]),
                false => ([b - a, d - a, c - b - d + a], [va, vb - va, vd - va, vc - vb - vd + va]),
            };
            outer.push(Outer {
                origin: a.as_vec3().to_array(),
                places: places.map(|by| by.as_vec3().to_array()),
                values: values.map(narrow),
                is_triangle,
                corners: face.corners,
                solid: face.solid,
            });
        }
        let (growths, lit) = (OnceLock::new(), OnceLock::new());
        let (field, axes, origin) = (Arc::clone(field), lattice.axes(), lattice.origin);
        Ok(Self { field, axes, origin, listed, solids, straight, bent, outer, growths, lit })
    }

    /// Least and greatest value in each of a lattice's bricks, of the cells that reach into it; where there are none nothing
    /// shows.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn bound(
        &self,
        bounds: &mut Bounds,
        bias: f64,
        ticket: &Ticket,
    ) -> Result<(), Cancelled> {
        let cells = self.field.cells();
        let there =
            (0..cells.solids().len()).filter(|i| !matches!(self.solids[*i], Solid::Nothing));
        let boxes = there.map(|i| {
            let [least, most] = self.field.range_in(i);
            (cells.solids()[i].placed(&self.listed.points).bounds(), [least - bias, most - bias])
        });
        // A little more, as faces are found a rim beyond. Brick b has the places 4b − 1 to 4b + 3.
        bounds.set_to_boxes(boxes, (-1.0, BEYOND), NOTHING, ticket)
    }

    /// Where the solids land in a picture that asks for something of its slabs, and the outer faces.
    ///
    /// # Errors
    /// More than lists have room for, and a cancelled ticket.
    pub(super) fn land(
        &self,
        (rays, asked): (&Rays, Asked),
        ticket: &Ticket,
    ) -> Result<[Landed; 2], NotBegun> {
        let view = &rays.view;
        let points = &self.listed.points;
        let see = |i: usize| view.view_from_index * (points[i] - view.lattice_centre);
        let seen = mapped(points.len(), A_RUN, see, ticket)?;
        let extent = |corners: &[u32]| -> Extent {
            let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            let [low, high] = corners.iter().fold(none, |[low, high], corner| {
                let point = seen[*corner as usize];
                [low.min(point), high.max(point)]
            });
            [(low + high) / 2.0, (high - low) / 2.0]
        };
        let all = self.field.cells().solids();
        let of_solid = |i: usize| {
            let is_there = !matches!(self.solids[i], Solid::Nothing);
            is_there.then(|| extent(all[i].corners()))
        };
        let solids = mapped(all.len(), A_RUN, of_solid, ticket)?;
        let of_outer = |i: usize| Some(extent(&self.outer[i].corners));
        let outer = mapped(self.outer.len(), A_RUN, of_outer, ticket)?;
        Ok([
            Landed::new((&solids, "cells"), (rays, Some(asked)), ticket)?,
            Landed::new((&outer, "outer faces of cells"), (rays, None), ticket)?,
        ])
    }

    /// The growth of the value per index, or what light that falls on borders takes for it.
    pub(super) fn growths(&self, for_light: bool) -> Growths<'_> {
        // Nobody cancels a fresh ticket; rays ask here, so there is none where they are made.
        if for_light {
            let made = || self.made_for_light(&Ticket::new()).unwrap_or_default();
            return Growths::ForLight(self.lit.get_or_init(made));
        }
        let made = || self.made_growths(&Ticket::new()).unwrap_or_default();
        Growths::Own(self.growths.get_or_init(made))
    }

    /// Makes these before rays ask for them, where it can be cancelled and all threads take part.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn make_growths(&self, for_light: bool, ticket: &Ticket) -> Result<(), Cancelled> {
        if for_light && self.lit.get().is_none() {
            let made = self.made_for_light(ticket)?;
            self.lit.get_or_init(|| made);
        }
        if !for_light && self.growths.get().is_none() {
            let made = self.made_growths(ticket)?;
            self.growths.get_or_init(|| made);
        }
        Ok(())
    }

    /// Lets go of those that nobody asks for: with `asked`, whether for light, of the others.
    pub(super) fn forget_growths(&mut self, asked: Option<bool>) {
        if asked != Some(false) {
            self.growths.take();
        }
        if asked != Some(true) {
            self.lit.take();
        }
    }

    fn made_growths(&self, ticket: &Ticket) -> Result<Vec<[f32; 3]>, Cancelled> {
        let (world, index) = (self.field.growths(ticket)?, self.axes.transpose());
        mapped(world.len(), A_RUN, |i| (index * world[i]).as_vec3().to_array(), ticket)
    }

    fn made_for_light(&self, ticket: &Ticket) -> Result<Lit, Cancelled> {
        let (of, index) = (self.field.shading_normals(ticket)?, self.axes.transpose());
        let world = of.normals();
        let normal = |i: usize| {
            let [x, y, z] = (index * world[i].growth).as_vec3().to_array();
            [x, y, z, f32::from(u8::from(world[i].is_on_border))]
        };
        let face = |i: usize| {
            let face = &of.faces()[i];
            let inwards = (index * face.inwards).normalize_or_zero();
            let on = inwards.dot(self.axes.inverse() * (face.on - self.origin));
            let [x, y, z] = inwards.as_vec3().to_array();
            LitFace { plane: [x, y, z, narrow(on)], corners: face.corners }
        };
        let faces = mapped(of.faces().len(), A_RUN, face, ticket)?;
        let normals = mapped(world.len(), A_RUN, normal, ticket)?;
        Ok(Lit { normals, faces, starts: of.starts().to_vec() })
    }

    /// Bytes of memory.
    pub(super) fn size_bytes(&self) -> usize {
        self.listed.size_bytes()
            + size_of_val(&self.solids[..])
            + size_of_val(&self.straight[..])
            + size_of_val(&self.bent[..])
            + size_of_val(&self.outer[..])
            + self.growths.get().map_or(0, |growths| size_of_val(&growths[..]))
            + self.lit.get().map_or(0, Lit::size_bytes)
    }

    /// The boxes that places are listed in.
    #[inline(always)]
    fn boxes_of<S: Simd>(&self, simd: S, place: Vec3<S>) -> [i32; LANES] {
        #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits")]
        let scale = 1.0 / self.listed.edge as f32;
        let along = |p: Lanes<S>, n: i32| {
            let at = ((p + 0.5) * scale).floor();
            at.max(all(simd, 0.0)).min(all(simd, (n - 1) as f32)).to_int::<i32x8<S>>()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            reason = "256 at most"
        )]
        let [nx, ny, nz] = self.listed.boxes.map(|n| n as i32);
        let (x, y, z) = (along(place.x, nx), along(place.y, ny), along(place.z, nz));
        let at = (z * i32x8::splat(simd, ny) + y) * i32x8::splat(simd, nx) + x;
        at.to_array()
    }

    /// Calls `visit` with each solid that holds some of the places that count, which of them, and where they lie in it: the
    /// first solid of several.
    #[inline(always)]
    fn each<S: Simd>(
        &self,
        simd: S,
        (place, counts): (Vec3<S>, Mask<S>),
        mut visit: impl FnMut(u32, Mask<S>, Vec3<S>),
    ) {
        let boxes = self.boxes_of(simd, place);
        let mut left = Left::all();
        while let Some((at, here)) = left.next(simd, &boxes) {
            let mut open = here & counts;
            if !any(open) {
                continue;
            }
            #[expect(clippy::cast_sign_loss, reason = "clamped")]
            let at = at as usize;
            let Listed { starts, lists, .. } = &self.listed;
            for &solid in &lists[starts[at] as usize..starts[at + 1] as usize] {
                let (unit, within) = match self.solids[solid as usize] {
                    Solid::Straight(i) => self.straight[i as usize].unit(simd, place),
                    Solid::Bent(i) => {
                        let bent = &self.bent[i as usize];
                        // Many are listed where cells are small beside their neighbours, and Newton's method takes long.
                        let asks = bent.is_about(simd, place) & open;
                        if !any(asks) {
                            continue;
                        }
                        bent.unit(simd, (place, asks), bent.middle(simd))
                    }
                    Solid::Nothing => continue,
                };
                let within = within & open;
                if any(within) {
                    visit(solid, within, unit);
                    open &= !within;
                    if !any(open) {
                        break;
                    }
                }
            }
        }
    }

    /// The values at places; [`NOTHING`] outside all cells.
    #[inline(always)]
    pub(super) fn value<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        let nowhere = Vec3::splat(simd, [0.0; 3]);
        self.here(simd, (place, Mask::splat(simd, true)), (Growths::None, nowhere)).value
    }

    /// The values at places that count, [`NOTHING`] outside all cells; and their growth per index, where that is asked for: light's
    /// for rays in a direction. Not inlined: its loop is long, and many ask.
    #[inline(never)]
    pub(super) fn here<S: Simd>(
        &self,
        simd: S,
        of: (Vec3<S>, Mask<S>),
        (growths, direction): (Growths<'_>, Vec3<S>),
    ) -> Here<S> {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut value = all(simd, NOTHING);
                let mut growth = growths.are_asked_for().then(|| Vec3::splat(simd, [0.0; 3]));
                self.each(
                    simd,
                    of,
                    #[inline(always)]
                    |solid, within, unit| {
                        let own = match self.solids[solid as usize] {
                            Solid::Straight(i) => self.straight[i as usize].value(simd, unit),
                            Solid::Bent(i) => self.bent[i as usize].value(simd, unit),
                            Solid::Nothing => value,
                        };
                        value = choose(within, own, value);
                        if let Some(growth) = &mut growth {
                            let ray = (of.0, direction);
                            let own = self.growth_in(simd, growths, (solid, unit), ray);
                            *growth = Vec3::choose(within, own, *growth);
                        }
                    },
                );
                Here { value, growth }
            },
        )
    }

    /// Whether values may jump past a level that they have nowhere: those on points, where cells overlap. Values of cells jump
    /// at every face, where their isosurfaces are.
    pub(super) fn may_jump(&self) -> bool {
        self.field.on() == On::Points
    }

    /// The values at places that count, and how far they may be off a level that the field has there ([`CellField::slack`]).
    #[inline(never)]
    pub(super) fn with_slack<S: Simd>(
        &self,
        simd: S,
        of: (Vec3<S>, Mask<S>),
    ) -> (Lanes<S>, Lanes<S>) {
        let widest = |rims: &[f32]| rims.iter().fold(0.0_f32, |most, rim| most.max(*rim));
        simd.vectorize(
            #[inline(always)]
            || {
                let (mut found, mut slack) = (all(simd, NOTHING), all(simd, 0.0));
                self.each(
                    simd,
                    of,
                    #[inline(always)]
                    |solid, within, unit| {
                        let (value, rim) = match self.solids[solid as usize] {
                            Solid::Straight(i) => {
                                let own = &self.straight[i as usize];
                                (own.value(simd, unit), widest(&own.rims))
                            }
                            Solid::Bent(i) => {
                                let own = &self.bent[i as usize];
                                (own.value(simd, unit), widest(&own.rims))
                            }
                            Solid::Nothing => (found, 0.0),
                        };
                        let own = self.field.slack(solid as usize, f64::from(rim));
                        found = choose(within, value, found);
                        slack = choose(within, all(simd, narrow(own)), slack);
                    },
                );
                (found, slack)
            },
        )
    }

    /// Which of the file's cells places lie in; −1 outside all of them. Of numbers that single precision does not tell apart
    /// the rest of a division: neighbours differ.
    #[inline(never)]
    pub(super) fn sources<S: Simd>(&self, simd: S, place: Vec3<S>) -> Lanes<S> {
        let sources = self.field.cells().sources();
        simd.vectorize(
            #[inline(always)]
            || {
                let mut found = all(simd, -1.0);
                self.each(
                    simd,
                    (place, Mask::splat(simd, true)),
                    #[inline(always)]
                    |solid, within, _| {
                        let source = sources[solid as usize] % (1 << 24);
                        found = choose(within, all(simd, source as f32), found);
                    },
                );
                found
            },
        )
    }

    /// The values' growth per index at places; 0 outside all cells.
    #[inline(always)]
    pub(super) fn gradient<S: Simd>(&self, simd: S, place: Vec3<S>) -> Vec3<S> {
        let nowhere = Vec3::splat(simd, [0.0; 3]);
        let asked = (self.growths(false), nowhere);
        let here = self.here(simd, (place, Mask::splat(simd, true)), asked);
        here.growth.unwrap_or_else(|| Vec3::splat(simd, [0.0; 3]))
    }

    /// Growth at places of a solid, of rays through a place in a direction; 0 where none is asked for.
    #[inline(always)]
    pub(super) fn growth_in<S: Simd>(
        &self,
        simd: S,
        growths: Growths<'_>,
        (solid, unit): (u32, Vec3<S>),
        (place, direction): (Vec3<S>, Vec3<S>),
    ) -> Vec3<S> {
        let own = &self.field.cells().solids()[solid as usize];
        let unit = clamped(simd, unit);
        let weights = || weights(simd, own.kind(), unit);
        match growths {
            Growths::None => Vec3::splat(simd, [0.0; 3]),
            Growths::Own(growths) => {
                let mut sum = Vec3::splat(simd, [0.0; 3]);
                for (corner, weight) in own.corners().iter().zip(weights()) {
                    sum = sum.at(Vec3::splat(simd, growths[*corner as usize]), weight);
                }
                sum
            }
            Growths::ForLight(lit) => {
                let seen = Seen { place, direction, weights: &weights() };
                lit.growth_in(simd, (solid, own.corners()), seen)
            }
        }
    }
}

impl Solids {
    /// Growth at a place (u, v) of an outer face, of rays through this place in a direction.
    #[inline(always)]
    pub(super) fn growth_on<S: Simd>(
        &self,
        simd: S,
        growths: Growths<'_>,
        (outer, [u, v]): (u32, [Lanes<S>; 2]),
        (place, direction): (Vec3<S>, Vec3<S>),
    ) -> Vec3<S> {
        let own = &self.outer[outer as usize];
        let one = all(simd, 1.0);
        let zero = all(simd, 0.0);
        let (u, v) = (u.max(zero).min(one), v.max(zero).min(one));
        let on_face = match own.is_triangle {
            true => [one - u - v, u, v, zero],
            false => [(one - u) * (one - v), u * (one - v), u * v, (one - u) * v],
        };
        match growths {
            Growths::None => Vec3::splat(simd, [0.0; 3]),
            Growths::Own(growths) => {
                let mut sum = Vec3::splat(simd, [0.0; 3]);
                for (corner, weight) in own.corners.iter().zip(on_face) {
                    sum = sum.at(Vec3::splat(simd, growths[*corner as usize]), weight);
                }
                sum
            }
            Growths::ForLight(lit) => {
                let corners = self.field.cells().solids()[own.solid as usize].corners();
                let mut weights = [zero; 8];
                for (weight, corner) in weights.iter_mut().zip(corners) {
                    for (on_face, at) in on_face.iter().zip(own.corners) {
                        if at == *corner {
                            *weight += *on_face;
                        }
                    }
                }
                let seen = Seen { place, direction, weights: &weights };
                lit.growth_in(simd, (own.solid, corners), seen)
            }
        }
    }
}
