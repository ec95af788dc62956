//! Vector splats along a ray, straight from their definition.
//!
//! Knows of a field its vectors, what was chosen about them, and h(r). What its splats are is found beside
//! it, in [`super::splats`] and [`super::marks`]; their footprints on the picture, and what each slab has of
//! them, along the pixel's own ray in kernel space.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};

use super::inside::Slice;
use super::layers::Planes;
use super::line;
use super::marks::{LEVELS, Pictures};
use super::quadrature::Density;
use super::sources::{Line, nearest};
use super::splats::{self, Asked, Splat};
use crate::core::Camera;
use crate::kernel::{Kernel, RadialKernel};
use crate::scene::{OpacityModel, Scene, VectorLayer};
use crate::vector::{Foreshortening, MARK_SIDE, VectorMode, VectorSettings, WINDOW};
use crate::volume::VectorField;

/// Splats are not shortened, nor coordinates stretched, beyond this.
const LEAST_ACROSS: f64 = 0.1;

/// One of a scene's vector fields.
pub(super) struct Vectors {
    settings: VectorSettings,
    phase: f64,
    marks: &'static Pictures,
    camera: Camera,
    /// World lengths to pixels at the focal plane.
    pixels_per_unit: f64,
    published: bool,
    kernel: RadialKernel,
    window: RadialKernel,
    splats: Vec<Seat>,
    step: f64,
}

/// A splat in the world.
struct Seat {
    splat: Splat,
    /// Kernel space from the world.
    inverse: DMat3,
    /// Of the marks' pictures.
    level: usize,
    /// No point of it is farther from its centre, world units.
    reach: f64,
}

/// A splat as a ray meets it: a density that is smooth between its ends but for where its kernel bends.
pub(super) struct OnRay {
    kernel: RadialKernel,
    /// Kernel space about its middle.
    start: DVec3,
    step: DVec3,
    pub(super) enter: f64,
    pub(super) leave: f64,
    /// Per unit of the ray, where its kernel is 1.
    weight: Density,
}

impl OnRay {
    /// Per unit of the ray.
    pub(super) fn density(&self, t: f64) -> Density {
        let h = self.kernel.value((self.start + self.step * t).length());
        self.weight.map(|w| w * h)
    }

    /// Where it begins, bends and ends.
    pub(super) fn places(&self) -> impl Iterator<Item = f64> {
        let (at, l) = nearest(self.start, self.step);
        let knot = self.kernel.knot().and_then(|r| line::half_chord(r, l));
        let half = knot.map(|half| half / self.step.length());
        let bends = half.map(|half| [at - half, at + half]).into_iter().flatten();
        bends.chain([self.enter, self.leave])
    }
}

/// What several splats have at a place of a ray.
pub(super) fn density_of(splats: &[&OnRay], t: f64) -> Density {
    let mut sum = [0.0; 4];
    for splat in splats {
        sum.iter_mut().zip(splat.density(t)).for_each(|(s, d)| *s += d);
    }
    sum
}

impl Vectors {
    /// The fields of a scene, none where it has no vectors. `height` of the picture in pixels; `exact`, by
    /// optical depth in any case.
    pub(super) fn of(scene: &Scene, height: f64, exact: bool) -> Vec<Self> {
        let of = |VectorLayer { field, settings }: VectorLayer| {
            Self::of_field(scene, &field, &settings, scene.phase, (height, exact))
        };
        scene.vectors().into_iter().filter_map(of).collect()
    }

    fn of_field(
        scene: &Scene,
        field: &VectorField,
        settings: &VectorSettings,
        phase: f64,
        (height, exact): (f64, bool),
    ) -> Option<Self> {
        let published = !exact && scene.splat.opacity_model == OpacityModel::Published;
        let unit_distance = scene.opacity_unit_distance();
        let scalar = scene.volume().map(|volume| &**volume);
        let asked = Asked { field, settings, scalar, unit_distance, published };
        let (splats, size) = asked.splats();
        let kernel = RadialKernel::new(Kernel::Cubic, None)?;
        // h(r / WINDOW), as it is as high in the middle.
        let window = RadialKernel::new(Kernel::Cubic, Some(kernel.radius() * WINDOW))?;
        let mut vectors = Self {
            phase,
            marks: Pictures::of(settings.design),
            settings: settings.clone(),
            camera: scene.camera,
            pixels_per_unit: scene.camera.pixels_per_unit(height),
            published,
            kernel,
            window,
            splats: Vec::new(),
            step: splats::step(&field.places) * size as f64,
        };
        let scale = asked.wider() * size as f64;
        vectors.splats = splats.into_iter().map(|splat| vectors.seat(splat, scale)).collect();
        Some(vectors)
    }

    /// `scale` of the splat's axes, beside its stretch along the flow.
    fn seat(&self, splat: Splat, scale: f64) -> Seat {
        let flow = splat.flow;
        let along = DMat3::from_cols(flow * flow.x, flow * flow.y, flow * flow.z);
        let stretched = DMat3::IDENTITY + along * (self.settings.stretch - 1.0);
        let map = stretched * splat.axes * scale;
        let longest = map.to_cols_array().map(|m| m * m).iter().sum::<f64>().sqrt();
        Seat {
            inverse: map.inverse(),
            level: self.level(map, splat.centre),
            reach: longest * self.window.radius().max(self.kernel.radius()),
            splat,
        }
    }

    /// The size of the table whose texels are about as large as pixels, across the splat's window where
    /// it is narrowest.
    fn level(&self, map: DMat3, centre: DVec3) -> usize {
        let shrink = self.camera.eye_distance().map_or(1.0, |distance| {
            distance / (centre - self.camera.view_origin()).dot(self.camera.direction)
        });
        let rows = map.transpose();
        let (right, up) = (rows * self.camera.right(), rows * self.camera.up);
        let narrowest = (0..720)
            .map(|i| {
                let angle = std::f64::consts::PI * f64::from(i) / 720.0;
                (right * angle.cos() + up * angle.sin()).length()
            })
            .fold(f64::INFINITY, f64::min);
        let radius = narrowest * self.kernel.radius() * WINDOW * self.pixels_per_unit * shrink;
        let level = (0.5 * MARK_SIDE as f64 / radius.max(1e-3)).log2().round();
        (level.max(0.0) as usize).min(LEVELS - 1)
    }

    /// World distance between the faces of slabs that hold nothing else: a step of the vectors, of
    /// several fields the least of one that shows.
    pub(super) fn step(fields: &[Self]) -> f64 {
        let shown = fields.iter().filter(|field| !field.splats.is_empty());
        let least = shown.map(|field| field.step).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { fields.first().map_or(1.0, |field| field.step) }
    }

    /// What each slab has of the splats of all fields that a ray meets between two places, by the slab's
    /// number: depth (or opacity) and its products with red, green and blue.
    pub(super) fn sums(
        fields: &[Self],
        ray: &Line,
        planes: &Planes,
        kept: [f64; 2],
    ) -> Vec<(i64, Density)> {
        let mut sums = BTreeMap::new();
        for field in fields {
            field.add_to(&mut sums, ray, planes, kept);
        }
        sums.into_iter().collect()
    }

    /// The splats of all fields that a ray meets within what is kept of it, nearest first: what slabs of
    /// them converge to.
    pub(super) fn on_ray(fields: &[Self], ray: &Line, kept: [f64; 2]) -> Vec<OnRay> {
        let found = fields.iter().flat_map(|field| field.splats.iter().map(move |s| (field, s)));
        let mut all: Vec<OnRay> = found
            .filter_map(|(field, seat)| {
                let Touch { start, step, kernel, amount, colour } = field.touch(seat, ray)?;
                let whole = line::radial(kernel, start, step, line::ENDLESS);
                let (at, l) = nearest(start, step);
                let half = line::half_chord(kernel.radius(), l)? / step.length();
                let enter = (at - half).max(kept[0]).max(ray.from);
                let leave = (at + half).min(kept[1]);
                let weight = [1.0, colour.x, colour.y, colour.z].map(|c| c * amount / whole);
                let is_there = enter < leave && amount > 0.0 && whole > 0.0;
                is_there.then_some(OnRay { kernel, start, step, enter, leave, weight })
            })
            .collect();
        all.sort_by(|p, q| p.enter.total_cmp(&q.enter));
        all
    }

    fn add_to(
        &self,
        sums: &mut BTreeMap<i64, Density>,
        ray: &Line,
        planes: &Planes,
        kept: [f64; 2],
    ) {
        for seat in &self.splats {
            let Some(touch) = self.touch(seat, ray) else { continue };
            let Touch { start, step, kernel, amount, colour } = touch;
            let whole = line::radial(kernel, start, step, line::ENDLESS);
            let (at, l) = nearest(start, step);
            let Some(half) = line::half_chord(kernel.radius(), l) else { continue };
            let half = half / step.length();
            for slab in planes.layer_of(at - half)..=planes.layer_of(at + half) {
                let part = [planes.face(slab).max(kept[0]), planes.face(slab + 1).min(kept[1])];
                if part[0] >= part[1] {
                    continue;
                }
                let share = line::radial(kernel, start, step, part) / whole;
                let depth = amount * share;
                let sum = sums.entry(slab).or_insert([0.0; 4]);
                for (s, v) in sum.iter_mut().zip([1.0, colour.x, colour.y, colour.z]) {
                    *s += depth * v;
                }
            }
        }
    }

    /// How a ray meets a splat: `None` where it passes beside it.
    fn touch(&self, seat: &Seat, ray: &Line) -> Option<Touch> {
        let splat = &seat.splat;
        let (_, beside) = nearest(ray.start - splat.centre, ray.step);
        if beside > seat.reach {
            return None;
        }
        let start = seat.inverse * (ray.start - splat.centre);
        let step = seat.inverse * ray.step;
        let along = step.normalize();
        let across = |v: DVec3| v - along * v.dot(along);
        // The plane in which the ray is a point: where screen right and up lie in it.
        let right = across(seat.inverse * self.camera.right());
        let up = across(seat.inverse * self.camera.up);
        let towards = match self.camera.eye_distance() {
            None => self.camera.direction,
            Some(_) => (splat.centre - self.camera.view_origin()).normalize(),
        };
        let part = (splat.flow - towards * splat.flow.dot(towards)).length().min(1.0);
        let flow = across(seat.inverse * splat.flow);
        let x_axis = match flow.length() > 1e-12 * right.length() && part > 1e-9 {
            true => flow.normalize(),
            // No flow to turn to: what moves up on the screen moves along y.
            false => (right - up * (right.dot(up) / up.length_squared())).normalize(),
        };
        // Counter-clockwise from it, as the picture is seen.
        let turned = along.cross(x_axis);
        let seen = right.cross(up).dot(along);
        let y_axis = if seen > 0.0 { turned } else { -turned };
        let point = across(start);
        let mut place = DVec2::new(point.dot(x_axis), point.dot(y_axis));
        if self.settings.foreshortening == Foreshortening::Polygon {
            place.x /= part.max(LEAST_ACROSS);
        }
        let l = place.length();
        let is_blend = self.settings.mode == VectorMode::Blend;
        let kernel = if is_blend { self.kernel } else { self.window };
        if l >= kernel.radius() {
            return None;
        }
        let mut texture = place / (self.kernel.radius() * WINDOW);
        let round = self.settings.foreshortening == Foreshortening::Coordinates;
        if round {
            texture.x /= part.max(LEAST_ACROSS);
        }
        let windowed = self.footprint(l / WINDOW) / self.footprint(0.0);
        let phase = self.phase + splat.phase;
        let across = (!round).then_some(part);
        let [intensity, light] = self.marks.at(seat.level, texture.to_array(), phase, across);
        let [intensity, light] = [intensity, light].map(|mark| mark * windowed);
        // Crawfis–Max: of the colour, then of the opacity.
        let (colour, opacity) = if is_blend {
            (splat.colour.lerp(splat.marks, intensity), self.footprint(l))
        } else {
            (splat.colour * light, intensity)
        };
        let length = match self.published {
            true => 1.0,
            // World length of a step of kernel space along the ray.
            false => ray.step.length() / step.length(),
        };
        // The line that is drawn passes the middle at the distance of its place on the splat.
        let (at, _) = nearest(start, step);
        let perpendicular = if place.length() > 0.0 {
            (x_axis * place.x + y_axis * place.y) / place.length() * l
        } else {
            DVec3::ZERO
        };
        let start = perpendicular - step * at;
        Some(Touch { start, step, kernel, amount: splat.amount * length * opacity, colour })
    }

    /// ∫ h along a line at a distance from the middle, by quadrature.
    fn footprint(&self, l: f64) -> f64 {
        line::radial(self.kernel, DVec3::new(l, 0.0, 0.0), DVec3::Z, line::ENDLESS)
    }
}

/// A ray through a splat.
struct Touch {
    /// Kernel space about the splat's middle.
    start: DVec3,
    step: DVec3,
    kernel: RadialKernel,
    amount: f64,
    colour: DVec3,
}

/// Pieces of a field with the sums of vectors in the same slabs, front to back: what a slab has of
/// vectors is shared evenly by the field's pieces there, or where there are none fills what is kept of it.
pub(super) fn merged(
    mut field: Vec<Slice>,
    vectors: &[(i64, Density)],
    planes: &Planes,
    kept: [f64; 2],
) -> Vec<Slice> {
    let mut alone = Vec::new();
    for &(slab, sum) in vectors {
        let parts = field.iter().filter(|piece| piece.slab == slab).count();
        for piece in field.iter_mut().filter(|piece| piece.slab == slab) {
            let share = 1.0 / (parts as f64 * (piece.ends[1] - piece.ends[0]));
            piece.density.iter_mut().zip(sum).for_each(|(p, d)| *p += d * share);
        }
        if parts == 0 {
            let ends = [planes.face(slab).max(kept[0]), planes.face(slab + 1).min(kept[1])];
            alone.push(Slice { slab, ends, density: sum.map(|d| d / (ends[1] - ends[0])) });
        }
    }
    field.extend(alone);
    // Stable: the pieces of a slab stay as they are.
    field.sort_by_key(|piece| piece.slab);
    field
}
