//! Lights and shading tables in float64 (`scene::shading` has the equations).

use std::sync::Arc;

use glam::DVec3;

use super::field::{Basis, Field, Shape};
use super::quadrature::Density;
use super::sources::Line;
use super::vectors::{OnRay, density_of};
use crate::core::Camera;
use crate::scene::{Index, Lighting, OpacityModel, Scene, Shading, ShadingSpace};
use crate::transfer::regions;
use crate::volume::ScalarVolume;

/// Half a step, voxels, between the two values whose difference is the derivative of a B-spline, of
/// which it is off by less than 1e-7; other fields' derivatives jump, and half a voxel to either side is
/// their definition.
const SMOOTH_STEP: f64 = 1e-4;

/// What shading does to densities along rays.
pub(super) struct Shader {
    shading: Shading,
    space: ShadingSpace,
    /// Of numbers that name things, on whose ends light falls: their range.
    of_names: Option<f64>,
    published: bool,
    /// Unit vectors towards the lights, and their linear colours.
    lights: Vec<(DVec3, [f64; 3])>,
    centre: DVec3,
    /// Unit vector into the picture.
    forward: DVec3,
}

/// What is done to the densities of one ray, if anything.
#[derive(Clone, Copy)]
pub(super) struct RayShader<'a> {
    pub(super) shader: Option<&'a Shader>,
    pub(super) field: &'a Field,
    /// The ray in the world, and in index space.
    pub(super) world: &'a Line,
    pub(super) index: &'a Line,
    /// Splats of vectors that lie there, too: not lit.
    pub(super) beside: &'a [&'a OnRay],
}

impl RayShader<'_> {
    /// A density at t, of this value and the gradient there.
    pub(super) fn shaded(&self, density: Density, t: f64, value: f64) -> Density {
        self.shaded_by(density, t, value, [t; 2])
    }

    /// The same with what lies beside it.
    pub(super) fn among(&self, density: Density, t: f64) -> Density {
        let mut sum = density_of(self.beside, t);
        sum.iter_mut().zip(density).for_each(|(s, d)| *s += d);
        sum
    }

    /// The same of a slab, lit by the gradients at two places of the ray.
    pub(super) fn shaded_by(
        &self,
        density: Density,
        t: f64,
        value: f64,
        [near, far]: [f64; 2],
    ) -> Density {
        let lights_borders = self.shader.is_some_and(|shader| shader.shading.lights_borders());
        let growth = |t: f64| {
            let place = self.index.at(t);
            let of_borders =
                lights_borders.then(|| self.field.growth_for_light(place, self.index.step));
            let of_borders = of_borders.flatten();
            let of_names = self.shader.and_then(|shader| shader.of_names);
            let of_names = of_names.map(|range| self.field.end_of_name(place, range));
            of_borders.or(of_names).unwrap_or_else(|| gradient(self.field, place))
        };
        self.shaded_with(density, t, value, || {
            let first = growth(near);
            [first, if far == near { first } else { growth(far) }]
        })
    }

    /// The same of gradients per index.
    pub(super) fn shaded_with(
        &self,
        density: Density,
        t: f64,
        value: f64,
        growths: impl FnOnce() -> [DVec3; 2],
    ) -> Density {
        let Some(shader) = self.shader.filter(|_| density[0] > 0.0) else { return density };
        let seen = Seen {
            value,
            growths: growths(),
            place: self.world.at(t),
            eye: -self.world.step.normalize(),
        };
        shader.shaded(density, &seen)
    }
}

/// A point that is shaded.
struct Seen {
    value: f64,
    /// Growth per index, where it begins and where it ends.
    growths: [DVec3; 2],
    /// World space.
    place: DVec3,
    /// Unit vector towards the eye.
    eye: DVec3,
}

/// What shading does to samples, where a mode shades first.
pub(super) struct SampleShader {
    shader: Shader,
    volume: Arc<ScalarVolume>,
    camera: Camera,
}

impl SampleShader {
    /// `None` where a scene asks for none, or its mode shades reconstructed values. `exact` pictures have
    /// no published opacities.
    pub(super) fn of(scene: &Scene, exact: bool) -> Option<Self> {
        let shader =
            Shader::of(scene, exact).filter(|_| scene.shading.is_of_samples(&scene.splat))?;
        Some(Self { shader, volume: Arc::clone(scene.volume()?), camera: scene.camera })
    }

    /// A sample's density; what has no data stays as it is.
    pub(super) fn shaded(&self, density: Density, index: [usize; 3]) -> Density {
        let lattice = &self.volume.lattice;
        let dims = lattice.dims;
        let value =
            |i: [usize; 3]| self.volume.samples.get((i[2] * dims[1] + i[1]) * dims[0] + i[0]);
        let here = value(index);
        if density[0] <= 0.0 || here.is_nan() {
            return density;
        }
        // To the neighbours that are there, whichever they are.
        let growth = |axis: usize| {
            let known = |i: [usize; 3]| Some(value(i)).filter(|v| !v.is_nan());
            let moved = |to: usize| {
                let mut i = index;
                i[axis] = to;
                known(i)
            };
            let before = index[axis].checked_sub(1).and_then(moved);
            let after = Some(index[axis] + 1).filter(|&i| i < dims[axis]).and_then(moved);
            match (before, after) {
                (Some(before), Some(after)) => (after - before) / 2.0,
                (Some(before), None) => here - before,
                (None, Some(after)) => after - here,
                (None, None) => 0.0,
            }
        };
        let place = lattice.world_from_index(DVec3::from(index.map(|i| i as f64)));
        let eye = match self.camera.eye_distance() {
            Some(_) => (self.camera.view_origin() - place).normalize_or_zero(),
            None => -self.camera.direction,
        };
        let gradient = DVec3::new(growth(0), growth(1), growth(2));
        self.shader.shaded(density, &Seen { value: here, growths: [gradient; 2], place, eye })
    }
}

impl Shader {
    /// `None` where a scene asks for none. `exact` pictures have no published opacities.
    pub(super) fn of(scene: &Scene, exact: bool) -> Option<Self> {
        if scene.shading.is_plain() {
            return None;
        }
        let lights = scene.shading.lighting.as_ref().map_or(&[][..], |lighting| &lighting.lights);
        let light = |l: &crate::scene::Light| (l.towards(&scene.camera), l.colour.to_linear().0);
        Some(Self {
            shading: scene.shading.clone(),
            space: ShadingSpace::of(&scene.lattice(), scene.volume().map(|volume| &**volume)),
            of_names: scene
                .volume()
                .filter(|volume| scene.shading.lights_names(&scene.splat, volume))
                .map(|volume| volume.statistics.max - volume.statistics.min),
            published: !exact && scene.splat.opacity_model == OpacityModel::Published,
            lights: lights.iter().map(light).collect(),
            centre: scene.lattice().centre(),
            forward: scene.camera.direction,
        })
    }

    /// What surfaces of a scene are lit by, if by anything.
    pub(super) fn of_surfaces(scene: &Scene) -> Option<Self> {
        let lighting = Some(scene.shading.surface_lighting(&scene.inside)?);
        let scene = Scene { shading: Shading { lighting, ..Shading::default() }, ..scene.clone() };
        Self::of(&scene, true)
    }

    /// What polygons of a scene are lit by.
    pub(super) fn of_polygons(scene: &Scene) -> Self {
        let lighting = scene.shading.polygon_lighting();
        let lights = lighting.lights.iter();
        let lights = lights.map(|l| (l.towards(&scene.camera), l.colour.to_linear().0)).collect();
        Self {
            shading: Shading { lighting: Some(lighting), ..Shading::default() },
            space: ShadingSpace::of(&scene.lattice(), scene.volume().map(|volume| &**volume)),
            of_names: None,
            published: false,
            lights,
            centre: scene.lattice().centre(),
            forward: scene.camera.direction,
        }
    }

    /// The colour of a surface with a normal, seen along a ray.
    pub(super) fn of_side(&self, colour: [f64; 3], normal: DVec3, ray: &Line) -> [f64; 3] {
        match &self.shading.lighting {
            Some(lighting) => {
                let eye = -ray.step.normalize();
                self.lit(colour, lighting, turned(normal, eye), eye, 1.0)
            }
            None => colour,
        }
    }

    /// The colour of a surface across the gradient at a place of a field, seen along a ray.
    pub(super) fn surface(
        &self,
        field: &Field,
        place: DVec3,
        ray: &Line,
        colour: [f64; 3],
    ) -> [f64; 3] {
        let down = -(self.space.world_from_gradient * gradient(field, place));
        let strength = down.length();
        let share = self.space.lit_share(strength);
        let normal = if share > 0.0 { down / strength } else { DVec3::ZERO };
        match &self.shading.lighting {
            Some(lighting) => {
                let eye = -ray.step.normalize();
                self.lit(colour, lighting, turned(normal, eye), eye, share)
            }
            None => colour,
        }
    }

    fn shaded(&self, density: Density, seen: &Seen) -> Density {
        let &Seen { value, growths, place, eye } = seen;
        let downs = growths.map(|growth| -(self.space.world_from_gradient * growth));
        let down = downs[0].midpoint(downs[1]);
        let strength = down.length();
        let share = self.space.lit_share(strength);
        let normal = if share > 0.0 { down / strength } else { DVec3::ZERO };
        let depth = (place - self.centre).dot(self.forward);
        let index = |by: Index| match by {
            Index::Value => value,
            Index::GradientStrength => strength,
            Index::GradientElevation => normal.z.clamp(-1.0, 1.0).asin().to_degrees(),
            Index::GradientAzimuth => normal.y.atan2(normal.x).to_degrees(),
            Index::ViewDepth => 0.5 + 0.5 * depth / self.space.radius,
        };
        let Shading { opacity, modulation, reflection, emission, lighting, .. } = &self.shading;
        let mut factor = 1.0;
        if let Some(table) = opacity {
            factor *= Shading::opacity_factor(table.at(index(table.index)), self.published);
        }
        if let Some(table) = modulation {
            factor *= table.at(index(table.index));
        }
        let [weight, r, g, b] = density;
        let mut colour = [r, g, b].map(|c| c / weight);
        if !self.shading.painted().is_empty() {
            let regions = self.shading.painted();
            let painted = regions::painted(regions, value, strength, colour);
            let alpha = -(-painted.extinction).exp_m1();
            let weight = if self.published { alpha } else { painted.extinction };
            factor *= weight * Shading::opacity_factor_of_one(self.published);
            colour = painted.colour;
        }
        if let Some(table) = reflection {
            colour = table.at(index(table.index));
        }
        if let Some(lighting) = lighting {
            colour = self.lit_between(colour, lighting, downs, eye);
        }
        if let Some(table) = emission {
            let emitted = table.at(index(table.index));
            colour.iter_mut().zip(emitted).for_each(|(c, e)| *c += e);
        }
        let weight = weight * factor;
        [weight, weight * colour[0], weight * colour[1], weight * colour[2]]
    }

    /// The mean colour of a slab, down whose gradients on either side these vectors point (`scene::shading` has the rule).
    fn lit_between(
        &self,
        colour: [f64; 3],
        lighting: &Lighting,
        [first, last]: [DVec3; 2],
        eye: DVec3,
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut add = |weight: f64, down: DVec3, side: f64| {
            let strength = down.length();
            let share = self.space.lit_share(strength);
            let normal = if share > 0.0 { side * down / strength } else { DVec3::ZERO };
            let lit = self.lit(colour, lighting, normal, eye, share);
            sum.iter_mut().zip(lit).for_each(|(s, c)| *s += weight * c);
        };
        let mut part = |weight: f64, [first, last]: [DVec3; 2], side: f64| {
            let [begin, end] = [first.length(), last.length()];
            if begin + end == 0.0 {
                return add(weight, first, side);
            }
            // Halfway in direction, which parts the length as the two ends are long.
            let before = begin / (begin + end);
            let middle = first.lerp(last, before);
            let halfway = middle.length();
            let of_end = |end: f64| if end > 0.0 { end / (end + halfway) } else { 0.0 };
            let weights = [before * of_end(begin), (1.0 - before) * of_end(end)];
            add(weight * weights[0], first, side);
            add(weight * (1.0 - weights[0] - weights[1]), middle, side);
            add(weight * weights[1], last, side);
        };
        let ways = [first, last].map(|down| down.dot(eye));
        let [begins, ends] = ways.map(|way| if way < 0.0 { -1.0 } else { 1.0 });
        if begins == ends {
            part(1.0, [first, last], begins);
        } else {
            let share = ways[0].abs() / (ways[0].abs() + ways[1].abs());
            let edge = first.lerp(last, share);
            part(share, [first, edge], begins);
            part(1.0 - share, [edge, last], ends);
        }
        sum
    }

    /// What lights make of a face whose normal is on the side of the eye.
    fn lit(
        &self,
        colour: [f64; 3],
        lighting: &Lighting,
        normal: DVec3,
        eye: DVec3,
        share: f64,
    ) -> [f64; 3] {
        let Lighting { ambient, diffuse, specular, exponent, .. } = *lighting;
        let mut lit = colour.map(|c| c * ambient);
        for &(towards, light) in &self.lights {
            // What has no face scatters light to all sides, as faces turned every way do in the mean: half of it.
            for c in 0..3 {
                lit[c] += (1.0 - share) * light[c] * diffuse * 0.5 * colour[c];
            }
            let cosine = normal.dot(towards);
            if cosine <= 0.0 {
                continue;
            }
            let mirror = (2.0 * cosine * normal - towards).dot(eye).max(0.0).powf(exponent);
            for c in 0..3 {
                lit[c] += share * light[c] * (diffuse * cosine * colour[c] + specular * mirror);
            }
        }
        lit
    }
}

/// The field's growth per index at a place; 0 along axes where it has no value to either side.
pub(super) fn gradient(field: &Field, place: DVec3) -> DVec3 {
    if let Some(growth) = field.growth(place) {
        return growth;
    }
    let step = match field.shape {
        Shape::Separable(Basis::CubicBSpline) => SMOOTH_STEP,
        Shape::Scaled(Basis::CubicBSpline, scale) if scale > 1.0 => SMOOTH_STEP,
        _ => 0.5,
    };
    let along =
        |axis: DVec3| match (field.value(place + axis * step), field.value(place - axis * step)) {
            (Some(past), Some(before)) => (past - before) / (2.0 * step),
            _ => 0.0,
        };
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

/// A normal on the side of the eye.
fn turned(normal: DVec3, eye: DVec3) -> DVec3 {
    if normal.dot(eye) < 0.0 { -normal } else { normal }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    /// Lit as usual, from beside the eye.
    fn shader(lighting: &Lighting) -> Shader {
        Shader {
            shading: Shading { lighting: Some(lighting.clone()), ..Shading::default() },
            space: ShadingSpace {
                world_from_gradient: DMat3::IDENTITY,
                least_strength: 1e-4,
                radius: 1.0,
            },
            of_names: None,
            published: false,
            lights: vec![(DVec3::new(-0.3, 0.4, 1.0).normalize(), [1.0; 3])],
            centre: DVec3::ZERO,
            forward: DVec3::NEG_Z,
        }
    }

    /// Whichever way the growth turns between two faces, and however little is left of it on the way: where one light for the
    /// mean growth may be off by all of it.
    #[test]
    fn a_slab_is_lit_as_all_that_lies_between_its_faces_is_in_the_mean() {
        let lighting = Lighting::default();
        let shader = shader(&lighting);
        let mut seed = 12_345_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let lit = |down: DVec3| {
            let strength = down.length();
            let share = shader.space.lit_share(strength);
            shader.lit([1.0; 3], &lighting, turned(down / strength, DVec3::Z), DVec3::Z, share)[0]
        };
        let (mut ours, mut of_one) = ([0.0_f64; 2], [0.0_f64; 2]);
        const PAIRS: usize = 2000;
        for i in 0..PAIRS {
            let mut vector = || DVec3::new(random(), random(), random()) * 10.0;
            let first = vector();
            let last = match i % 2 {
                0 => vector(),
                // Nearly to the other side of where it began.
                _ => vector() * 0.01 - first * (0.2 + i as f64 / PAIRS as f64),
            };
            let steps = 4000;
            let all = (0..steps).map(|k| lit(first.lerp(last, (k as f64 + 0.5) / steps as f64)));
            let truth = all.sum::<f64>() / steps as f64;
            let found = shader.lit_between([1.0; 3], &lighting, [first, last], DVec3::Z)[0];
            for (sums, value) in [(&mut ours, found), (&mut of_one, lit(first.midpoint(last)))] {
                let off = (value - truth).abs();
                *sums = [sums[0].max(off), sums[1] + off * off];
            }
        }
        let [ours, of_one] = [ours, of_one].map(|[most, sum]| [most, (sum / PAIRS as f64).sqrt()]);
        println!("measured: {ours:.4?}, one light {of_one:.4?}");
        assert!(ours[0] < 0.15 && ours[1] < 0.02, "{ours:?}");
        assert!(of_one[0] > 0.5 && of_one[1] > 0.1, "{of_one:?}");
    }

    /// Neither a length of 0 nor one that nothing is a part of is divided by.
    #[test]
    fn slabs_without_any_growth_are_lit_from_all_sides() {
        let lighting = Lighting::default();
        let shader = shader(&lighting);
        for ends in [[DVec3::ZERO; 2], [DVec3::ZERO, DVec3::X], [DVec3::Z, DVec3::ZERO]] {
            let lit = shader.lit_between([1.0; 3], &lighting, ends, DVec3::Z);
            assert!(lit.iter().all(|c| c.is_finite() && *c > 0.2), "{ends:?}: {lit:?}");
        }
    }
}
