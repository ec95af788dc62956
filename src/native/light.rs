//! Lights, shading tables and regions (`scene::shading` has the equations).

use fearless_simd::{Simd, prelude::*};
use glam::DVec3;

use super::lanes::{LANES, Lanes, Vec3, all, any, choose, power};
use super::rays::{Packet, Rays};
use super::table::Halves;
use crate::plan::Plan;
use crate::scene::{Index, OpacityModel, Shading, ShadingSpace};
use crate::transfer::regions;

/// What shades the slabs of a field.
#[derive(Debug, Clone)]
pub(super) struct Light {
    /// Slabs are shaded, rather than isosurfaces alone.
    pub is_of_slabs: bool,
    shading: Shading,
    pub uses_gradient: bool,
    /// It falls on the border of cells (`Shading::lights_borders`).
    pub is_of_borders: bool,
    published: bool,
    /// Rows of the map from growth per index, in stored values, to the world.
    world: [[f32; 3]; 3],
    /// 1 over the strength below which a gradient has no direction.
    per_strength: f32,
    right: [f32; 3],
    up: [f32; 3],
    forward: [f32; 3],
    /// Ambient, diffuse, specular, exponent, where there are lights or their ambient share.
    material: Option<[f32; 4]>,
    /// Unit vectors towards the lights, and their colours.
    lights: Vec<([f32; 3], [f32; 3])>,
    /// Pixels of view depth that the volume's sphere reaches to.
    radius_px: f64,
    /// Colours and opacities are by more than the lights: of each ray by itself.
    has_tables: bool,
}

/// Where a value lies on a scale of its own: `of_zero` + `per_value` · value.
#[derive(Debug, Clone, Copy)]
pub(super) struct ValueScale {
    pub of_zero: f64,
    pub per_value: f64,
}

impl ValueScale {
    /// Values as they are.
    pub(super) const VALUES: Self = Self { of_zero: 0.0, per_value: 1.0 };
}

/// What a gradient says of a surface.
struct Facing<S: Simd> {
    strength: Lanes<S>,
    /// Of the lights that falls on it.
    share: Lanes<S>,
    /// Down the gradient; 0 where it has no direction.
    normal: Vec3<S>,
}

impl Light {
    /// `None` where a plan asks for none, or has no field.
    #[expect(clippy::cast_possible_truncation, reason = "rays have 32 bits, as the device's")]
    pub(super) fn of(plan: &Plan) -> Option<Self> {
        let field = plan.field()?;
        let shading = &plan.shading;
        let has_surfaces = plan.inside.has_isosurfaces();
        if shading.is_plain() && !has_surfaces {
            return None;
        }
        let space = ShadingSpace::of(&plan.frame.lattice, Some(&field.volume));
        let rows = space.world_from_gradient.transpose();
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let camera = &plan.camera;
        let lighting = shading.surface_lighting(&plan.inside);
        let lights = lighting.as_ref().filter(|lighting| lighting.uses_lights());
        let lights = lights.iter().flat_map(|lighting| &lighting.lights);
        let radius_px = space.radius * plan.view().pixels_per_unit;
        Some(Self {
            is_of_slabs: !shading.is_plain(),
            shading: shading.clone(),
            uses_gradient: shading.uses_gradient() || has_surfaces,
            is_of_borders: shading.lights_borders(),
            published: plan.mode.opacity_model == OpacityModel::Published,
            world: [rows.x_axis, rows.y_axis, rows.z_axis].map(narrow),
            per_strength: (1.0 / space.least_strength).min(f64::from(f32::MAX)) as f32,
            right: narrow(camera.right()),
            up: narrow(camera.up),
            forward: narrow(camera.direction),
            material: lighting
                .as_ref()
                .map(|l| [l.ambient, l.diffuse, l.specular, l.exponent].map(|share| share as f32)),
            lights: lights
                .map(|l| (narrow(l.towards(camera)), l.colour.to_linear().0.map(|c| c as f32)))
                .collect(),
            radius_px,
            has_tables: shading.opacity.is_some()
                || shading.modulation.is_some()
                || shading.reflection.is_some()
                || shading.emission.is_some()
                || !shading.painted().is_empty(),
        })
    }

    /// Bytes of memory, but for the points of tables.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of::<Self>() + size_of_val(&self.lights[..])) as u64
    }

    /// The looks of slabs, or samples, whose middles are `t` pixels deep, of coordinate `u` on a scale of values and
    /// growth `g` of the value there. `eye` is a unit vector towards the eye, in the world. Not inlined: it would be
    /// compiled into every loop, and takes much longer than a call.
    #[inline(never)]
    pub(super) fn shaded<S: Simd>(
        &self,
        simd: S,
        eye: (Vec3<S>, ValueScale),
        found: Halves<S>,
        place: (Lanes<S>, Option<Vec3<S>>, Lanes<S>),
    ) -> Halves<S> {
        simd.vectorize(
            #[inline(always)]
            || self.shaded_here(simd, eye, found, place),
        )
    }

    #[inline(always)]
    fn shaded_here<S: Simd>(
        &self,
        simd: S,
        (eye, scale): (Vec3<S>, ValueScale),
        found: Halves<S>,
        (u, g, t): (Lanes<S>, Option<Vec3<S>>, Lanes<S>),
    ) -> Halves<S> {
        let facing = g.map(
            #[inline(always)]
            |g| self.facing(simd, g),
        );
        let mut found = found;
        let mut emission = None;
        if self.has_tables {
            (found, emission) = self.by_tables(simd, scale, found, (u, facing.as_ref(), t));
        }
        if self.shading.lighting.is_some() {
            let lit = match &facing {
                Some(facing) => self.lit(simd, facing, eye),
                None => (
                    Vec3::splat(simd, [self.material.map_or(1.0, |m| m[0]); 3]),
                    Vec3::splat(simd, [0.0; 3]),
                ),
            };
            let (factor, mirrored) = lit;
            for half in [&mut found.near, &mut found.far] {
                half.colour = Vec3 {
                    x: half.colour.x.mul_add(factor.x, mirrored.x),
                    y: half.colour.y.mul_add(factor.y, mirrored.y),
                    z: half.colour.z.mul_add(factor.z, mirrored.z),
                };
            }
        }
        if let Some(emitted) = emission {
            found.near.colour = found.near.colour.add(emitted);
            found.far.colour = found.far.colour.add(emitted);
        }
        found
    }

    /// The colour of isosurfaces, of growth `g` of the stored value there.
    #[inline(always)]
    pub(super) fn of_surface<S: Simd>(
        &self,
        simd: S,
        (rays, packet): (&Rays, &Packet<S>),
        g: Vec3<S>,
        colour: [f32; 3],
    ) -> Vec3<S> {
        let facing = self.facing(simd, g);
        let (factor, mirrored) = self.lit(simd, &facing, self.towards_eye(simd, rays, packet));
        Vec3 {
            x: factor.x.mul_add(all(simd, colour[0]), mirrored.x),
            y: factor.y.mul_add(all(simd, colour[1]), mirrored.y),
            z: factor.z.mul_add(all(simd, colour[2]), mirrored.z),
        }
    }

    /// Unit vectors towards the eye, in the world.
    #[inline(always)]
    pub(super) fn towards_eye<S: Simd>(&self, simd: S, rays: &Rays, packet: &Packet<S>) -> Vec3<S> {
        let splat = |v| Vec3::splat(simd, v);
        let [x, y] = packet.screen;
        let across = splat(self.right).scaled(x * rays.growth);
        let along = splat(self.forward).add(across).add(splat(self.up).scaled(y * rays.growth));
        along.scaled(all(simd, -1.0) / along.length())
    }

    #[inline(always)]
    fn facing<S: Simd>(&self, simd: S, g: Vec3<S>) -> Facing<S> {
        let row = |i: usize| Vec3::splat(simd, self.world[i]).dot(g);
        let world = Vec3 { x: row(0), y: row(1), z: row(2) };
        // By its greatest part: squares of tiny ones are 0.
        let most = world.x.abs().max(world.y.abs()).max(world.z.abs());
        let scaled = world.scaled(all(simd, 1.0) / most.max(all(simd, 1e-37)));
        let length = scaled.length();
        let strength = most * length;
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let share = (strength * self.per_strength - 1.0).max(zero).min(one);
        let down = all(simd, -1.0) / length.max(all(simd, 1e-6));
        let normal = scaled.scaled(choose(share.simd_gt(zero), down, zero));
        Facing { strength, share, normal }
    }

    /// What lights make of surfaces: the factor of their colour, and what they mirror.
    #[inline(always)]
    fn lit<S: Simd>(&self, simd: S, facing: &Facing<S>, eye: Vec3<S>) -> (Vec3<S>, Vec3<S>) {
        let [ambient, diffuse, specular, exponent] = self.material.unwrap_or([1.0, 0.0, 0.0, 1.0]);
        let zero = all(simd, 0.0);
        let mut factor = Vec3::splat(simd, [ambient; 3]);
        let mut mirrored = Vec3::splat(simd, [0.0; 3]);
        // Turned to the eye: what faces away shows its back.
        let away = facing.normal.dot(eye).simd_lt(zero);
        let turned = facing.normal.scaled(choose(away, all(simd, -1.0), all(simd, 1.0)));
        for &(towards, colour) in &self.lights {
            let towards = Vec3::splat(simd, towards);
            let cosine = turned.dot(towards);
            let light = Vec3::splat(simd, colour);
            let falls = light.scaled(facing.share);
            // The rest falls on what scatters it to all sides, as faces turned every way do in the mean.
            let evenly = (all(simd, 1.0) - facing.share) * 0.5;
            let scattered = cosine.max(zero).mul_add(facing.share, evenly);
            factor = factor.add(light.scaled(scattered * diffuse));
            if specular > 0.0 {
                let reflected = turned.scaled(cosine * 2.0).add(towards.scaled(all(simd, -1.0)));
                let along = reflected.dot(eye).max(all(simd, 1e-6)).min(all(simd, 1.0));
                let mirror = power(simd, along, all(simd, exponent));
                let mirror = choose(cosine.simd_gt(zero), mirror, zero);
                mirrored = mirrored.add(falls.scaled(mirror * specular));
            }
        }
        (factor, mirrored)
    }

    /// Regions and tables, ray by ray: few scenes have them.
    fn by_tables<S: Simd>(
        &self,
        simd: S,
        scale: ValueScale,
        mut found: Halves<S>,
        (u, facing, t): (Lanes<S>, Option<&Facing<S>>, Lanes<S>),
    ) -> (Halves<S>, Option<Vec3<S>>) {
        let Shading { opacity, modulation, reflection, emission, .. } = &self.shading;
        let mut emitted = Vec3::splat(simd, [0.0; 3]);
        let shows = found.weight();
        for i in 0..LANES {
            if shows[i] <= 0.0 {
                continue;
            }
            let value = (f64::from(u[i]) - scale.of_zero) / scale.per_value;
            let (strength, normal) = match facing {
                Some(facing) => {
                    (f64::from(facing.strength[i]), facing.normal.lane(i).map(f64::from))
                }
                None => (0.0, [0.0; 3]),
            };
            let index = |by: Index| match by {
                Index::Value => value,
                Index::GradientStrength => strength,
                Index::GradientElevation => normal[2].clamp(-1.0, 1.0).asin().to_degrees(),
                Index::GradientAzimuth => normal[1].atan2(normal[0]).to_degrees(),
                Index::ViewDepth => 0.5 + 0.5 * f64::from(t[i]) / self.radius_px,
            };
            let mut factor = 1.0;
            let painted = self.shading.painted();
            for half in [&mut found.near, &mut found.far] {
                if !painted.is_empty() {
                    let by_value = half.colour.lane(i).map(f64::from);
                    let look = regions::painted(painted, value, strength, by_value);
                    let alpha = -(-look.extinction).exp_m1();
                    let weight = if self.published { alpha } else { look.extinction };
                    set(&mut half.colour, i, look.colour);
                    half.weight[i] *=
                        (weight * Shading::opacity_factor_of_one(self.published)) as f32;
                }
            }
            if let Some(amounts) = opacity {
                factor = Shading::opacity_factor(amounts.at(index(amounts.index)), self.published);
            }
            if let Some(amounts) = modulation {
                factor *= amounts.at(index(amounts.index));
            }
            if let Some(colours) = reflection {
                let colour = colours.at(index(colours.index));
                set(&mut found.near.colour, i, colour);
                set(&mut found.far.colour, i, colour);
            }
            if let Some(colours) = emission {
                set(&mut emitted, i, colours.at(index(colours.index)));
            }
            found.near.weight[i] *= factor as f32;
            found.far.weight[i] *= factor as f32;
        }
        (found, emission.is_some().then_some(emitted))
    }
}

fn set<S: Simd>(to: &mut Vec3<S>, lane: usize, colour: [f64; 3]) {
    [to.x[lane], to.y[lane], to.z[lane]] = colour.map(|c| c as f32);
}

/// Whether any ray has weight.
#[inline(always)]
pub(super) fn shows<S: Simd>(simd: S, found: &Halves<S>) -> bool {
    any(found.weight().simd_gt(all(simd, 0.0)))
}
