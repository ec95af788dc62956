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
    /// Of numbers that name things, on whose ends it falls: their range.
    pub of_names: Option<f32>,
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
    /// Nearer to the mirrored light than this cosine, anything of it is seen.
    least_mirrored: f32,
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

/// How the stored value grows, per index, where something is lit.
#[derive(Clone, Copy)]
pub(super) enum Growth<S: Simd> {
    /// At the one place that is looked at.
    At(Vec3<S>),
    /// On both faces of a slab.
    Between([Vec3<S>; 2]),
}

/// Faces that a part of a slab is lit by, turned to the eye.
struct Faces<S: Simd> {
    normals: [Vec3<S>; 3],
    /// How much of the lights falls on each.
    falls: [Lanes<S>; 3],
    /// How much they scatter to all sides.
    scattered: Lanes<S>,
}

/// What a gradient says of a surface.
struct Facing<S: Simd> {
    strength: Lanes<S>,
    /// Of the lights that falls on it.
    share: Lanes<S>,
    /// Down the gradient; 0 where it has no direction.
    normal: Vec3<S>,
}

/// Less than 1 in 2 to this power of a mirrored light is none.
const LEAST_MIRRORED_BITS: f64 = 16.0;

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
            of_names: shading.lights_names(&plan.mode, &field.volume).then(|| {
                let statistics = &field.volume.statistics;
                (statistics.max - statistics.min) as f32
            }),
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
            least_mirrored: lighting
                .map_or(1.0, |l| (-LEAST_MIRRORED_BITS / l.exponent).exp2() as f32),
        })
    }

    /// Bytes of memory, but for the points of tables.
    pub(super) fn size_bytes(&self) -> u64 {
        (size_of::<Self>() + size_of_val(&self.lights[..])) as u64
    }

    /// Shades the looks of slabs, or samples, whose middles are `t` pixels deep, of coordinate `u` on a scale of values. `eye` is a
    /// unit vector towards the eye, in the world. Not inlined: it would be compiled into every loop, and takes much longer than a
    /// call.
    #[inline(never)]
    pub(super) fn shade<S: Simd>(
        &self,
        simd: S,
        eye: (Vec3<S>, ValueScale),
        looks: &mut Halves<S>,
        place: (Lanes<S>, Option<Growth<S>>, Lanes<S>),
    ) {
        simd.vectorize(
            #[inline(always)]
            || self.shade_here(simd, eye, looks, place),
        );
    }

    #[inline(always)]
    fn shade_here<S: Simd>(
        &self,
        simd: S,
        (eye, scale): (Vec3<S>, ValueScale),
        looks: &mut Halves<S>,
        (u, growth, t): (Lanes<S>, Option<Growth<S>>, Lanes<S>),
    ) {
        let mut emission = None;
        if self.has_tables {
            // Tables look up one growth of a slab: the mean.
            let facing = match growth {
                Some(Growth::At(growth)) => Some(self.facing(simd, growth)),
                Some(Growth::Between([near, far])) => {
                    Some(self.facing(simd, near.add(far).scaled(all(simd, 0.5))))
                }
                None => None,
            };
            (*looks, emission) = self.by_tables(simd, scale, *looks, (u, facing.as_ref(), t));
        }
        if self.shading.lighting.is_some() {
            let (factor, mirrored) = match growth {
                Some(Growth::At(growth)) => self.lit(simd, &self.facing(simd, growth), eye),
                Some(Growth::Between(growths)) => self.lit_between(simd, growths, eye),
                None => (
                    Vec3::splat(simd, [self.material.map_or(1.0, |m| m[0]); 3]),
                    Vec3::splat(simd, [0.0; 3]),
                ),
            };
            for half in [&mut looks.near, &mut looks.far] {
                half.colour = Vec3 {
                    x: half.colour.x.mul_add(factor.x, mirrored.x),
                    y: half.colour.y.mul_add(factor.y, mirrored.y),
                    z: half.colour.z.mul_add(factor.z, mirrored.z),
                };
            }
        }
        if let Some(emitted) = emission {
            looks.near.colour = looks.near.colour.add(emitted);
            looks.far.colour = looks.far.colour.add(emitted);
        }
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
    fn in_world<S: Simd>(&self, simd: S, growth: Vec3<S>) -> Vec3<S> {
        let [x, y, z] = self.world;
        Vec3 {
            x: Vec3::splat(simd, x).dot(growth),
            y: Vec3::splat(simd, y).dot(growth),
            z: Vec3::splat(simd, z).dot(growth),
        }
    }

    #[inline(always)]
    fn facing<S: Simd>(&self, simd: S, g: Vec3<S>) -> Facing<S> {
        let world = self.in_world(simd, g);
        // By its greatest part: squares of tiny ones are 0.
        let most = world.greatest();
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
        // Turned to the eye: what faces away shows its back.
        let away = facing.normal.dot(eye).simd_lt(all(simd, 0.0));
        let turned = facing.normal.scaled(choose(away, all(simd, -1.0), all(simd, 1.0)));
        let (normals, falls) = ([turned], [facing.share]);
        // The rest falls on what scatters it to all sides, as faces turned every way do in the mean.
        let scattered = (all(simd, 1.0) - facing.share) * 0.5;
        self.lit_faces(simd, (&normals, &falls), scattered, eye)
    }

    /// The same of slabs, of the growths on their faces (`scene::shading` has the rule).
    #[inline(always)]
    fn lit_between<S: Simd>(
        &self,
        simd: S,
        [near, far]: [Vec3<S>; 2],
        eye: Vec3<S>,
    ) -> (Vec3<S>, Vec3<S>) {
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let (near, far) = (self.in_world(simd, near), self.in_world(simd, far));
        // By their greatest part: squares of tiny ones are 0.
        let most = near.greatest().max(far.greatest());
        let scale = one / most.max(all(simd, 1e-37));
        let (near, far) = (near.scaled(scale), far.scaled(scale));
        let (near_way, far_way) = (near.dot(eye), far.dot(eye));
        let (is_away, ends_away) = (near_way.simd_lt(zero), far_way.simd_lt(zero));
        let side = choose(is_away, all(simd, -1.0), one);
        let turns = is_away ^ ends_away;
        let strength = most * self.per_strength;
        if !any(turns) {
            let Faces { normals, falls, scattered } =
                faces(simd, [near, far], (side, one), strength);
            return self.lit_faces(simd, (&normals, &falls), scattered, eye);
        }
        let (near_way, far_way) = (near_way.abs(), far_way.abs());
        let share = near_way / (near_way + far_way).max(all(simd, 1e-37));
        let share = choose(turns, share, one);
        let back = far.add(near.scaled(all(simd, -1.0)));
        let edge = near.at(back, share);
        let first = faces(simd, [near, edge], (side, share), strength);
        let second = faces(simd, [edge, far], (zero - side, one - share), strength);
        let [a, b, c] = first.normals;
        let [d, e, f] = second.normals;
        let normals = [a, b, c, d, e, f];
        let [a, b, c] = first.falls;
        let [d, e, f] = second.falls;
        let falls = [a, b, c, d, e, f];
        self.lit_faces(simd, (&normals, &falls), first.scattered + second.scattered, eye)
    }

    /// What lights make of faces turned to the eye, each of which so much falls on.
    #[inline(always)]
    fn lit_faces<S: Simd, const N: usize>(
        &self,
        simd: S,
        (normals, falls): (&[Vec3<S>; N], &[Lanes<S>; N]),
        scattered: Lanes<S>,
        eye: Vec3<S>,
    ) -> (Vec3<S>, Vec3<S>) {
        let [ambient, diffuse, specular, exponent] = self.material.unwrap_or([1.0, 0.0, 0.0, 1.0]);
        let zero = all(simd, 0.0);
        let mut factor = Vec3::splat(simd, [ambient; 3]);
        let mut mirrored = Vec3::splat(simd, [0.0; 3]);
        for &(towards, colour) in &self.lights {
            let towards = Vec3::splat(simd, towards);
            let light = Vec3::splat(simd, colour);
            let ahead = towards.dot(eye);
            let (mut falling, mut mirror) = (scattered, zero);
            for (normal, fall) in normals.iter().zip(falls) {
                let cosine = normal.dot(towards);
                falling = cosine.max(zero).mul_add(*fall, falling);
                if specular > 0.0 {
                    // R·V of the reflection R = 2(N·L)N − L.
                    let along = (cosine * 2.0).mul_add(normal.dot(eye), zero - ahead);
                    let is_seen =
                        cosine.simd_gt(zero) & along.simd_gt(all(simd, self.least_mirrored));
                    if any(is_seen) {
                        let along = along.max(all(simd, 1e-6)).min(all(simd, 1.0));
                        let seen = power(simd, along, all(simd, exponent));
                        mirror = choose(is_seen, seen, zero).mul_add(*fall, mirror);
                    }
                }
            }
            factor = factor.add(light.scaled(falling * diffuse));
            mirrored = mirrored.add(light.scaled(mirror * specular));
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

/// What a part of a slab is lit by, along which the growth goes straight from one to another and faces have one side to the
/// eye: the faces at its ends, and the one halfway in direction, which parts its length as theirs are. Each end is weighed by its
/// length. Growths may be on any scale; `strength` is 1 where the least that has a direction begins.
#[inline(always)]
fn faces<S: Simd>(
    simd: S,
    [near, far]: [Vec3<S>; 2],
    (side, weight): (Lanes<S>, Lanes<S>),
    strength: Lanes<S>,
) -> Faces<S> {
    let (zero, one, tiny) = (all(simd, 0.0), all(simd, 1.0), all(simd, 1e-30));
    let (near_length, far_length) = (near.length(), far.length());
    let sum = near_length + far_length;
    // As long as the one halfway times both lengths.
    let middle = near.scaled(far_length).add(far.scaled(near_length));
    let long = middle.length();
    let share = one / sum.max(tiny);
    let (middle, length) = (middle.scaled(share), long * share);
    // Each quotient takes as long as a dozen products, so that one serves two, or three.
    let (of_near, of_far) =
        (sum.mul_add(near_length, long).max(tiny), sum.mul_add(far_length, long).max(tiny));
    let both = one / (of_near * of_far).max(tiny);
    let near_weight = near_length * near_length * (of_far * both);
    let far_weight = far_length * far_length * (of_near * both);
    let lengths = [near_length, length, far_length];
    let weights = [near_weight, one - near_weight - far_weight, far_weight];
    let least = all(simd, 1e-6);
    let (n, m, f) = (near_length.max(least), length.max(least), far_length.max(least));
    let each = side / (n * m * f);
    let towards = [m * f * each, n * f * each, n * m * each];
    let mut normals = [near, middle, far];
    let mut falls = [zero; 3];
    let mut scattered = zero;
    for i in 0..3 {
        let share = (lengths[i].mul_add(strength, all(simd, -1.0))).max(zero).min(one);
        let weight = weights[i] * weight;
        falls[i] = weight * share;
        scattered += (weight - falls[i]) * 0.5;
        normals[i] = normals[i].scaled(towards[i]);
    }
    Faces { normals, falls, scattered }
}

fn set<S: Simd>(to: &mut Vec3<S>, lane: usize, colour: [f64; 3]) {
    [to.x[lane], to.y[lane], to.z[lane]] = colour.map(|c| c as f32);
}

/// Whether any ray has weight.
#[inline(always)]
pub(super) fn shows<S: Simd>(simd: S, found: &Halves<S>) -> bool {
    any(found.weight().simd_gt(all(simd, 0.0)))
}
