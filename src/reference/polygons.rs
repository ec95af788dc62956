//! Triangles that rays meet, one by one and in float64.
//!
//! A pixel sees each triangle at four places, the standard ones of four samples, and has one depth,
//! normal and colour of it: those where its own ray meets the triangle's plane, or if that is beside the
//! triangle of the place on it whose barycentric coordinates are those with the negative ones set to 0.

use glam::{DVec2, DVec3};

use super::inside::{Met, Surface};
use super::shading::Shader;
use super::sources::Line;
use crate::core::Camera;
use crate::scene::{Clip, Effect, Inside, PolygonLayer, Scene};
use crate::volume::Lattice;

/// Where the samples of a pixel are, from its upper left.
const SAMPLES: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// What is nearer to the eye than this share of its distance to the focal plane is left out.
const NEAREST: f64 = 1e-4;

struct Corner {
    place: DVec3,
    normal: DVec3,
    colour: [f64; 3],
}

struct Triangle {
    corners: [Corner; 3],
    opacity: f64,
}

/// A scene's polygons.
pub(super) struct Polygons {
    triangles: Vec<Triangle>,
    lights: Shader,
    camera: Camera,
    /// Of the picture.
    size: [f64; 2],
    clip: Option<(Clip, Lattice)>,
}

/// Barycentric coordinates of where a line meets a triangle's plane, and how far along it.
fn meet(line: &Line, [a, b, c]: [DVec3; 3]) -> Option<(DVec3, f64)> {
    let normal = (b - a).cross(c - a);
    let along = line.step.dot(normal);
    if along == 0.0 {
        return None;
    }
    let t = (a - line.start).dot(normal) / along;
    let place = line.start + line.step * t;
    let part = |p: DVec3, q: DVec3| (p - place).cross(q - place).dot(normal);
    let shares = DVec3::new(part(b, c), part(c, a), part(a, b));
    Some((shares / shares.element_sum(), t))
}

/// The triangles that a ray itself meets, from where it begins and as far as they are kept, nearest first;
/// of no colour, which nobody asks for.
pub(super) fn met_by(scene: &Scene, ray: &Line) -> Vec<Surface> {
    let clip = clip_of(scene);
    let mut met = Vec::new();
    for layer in drawn(scene) {
        let origin = layer.mesh.origin();
        for triangle in layer.mesh.triangles(false) {
            let found = meet(ray, triangle.corners.map(|corner| origin + corner.as_dvec3()));
            let inside = found.filter(|(shares, _)| shares.min_element() >= 0.0);
            let Some((_, t)) = inside else { continue };
            if t >= ray.from && is_kept(clip.as_ref(), ray.at(t)) {
                let (of, opacity) = (Met::Polygon, layer.look.opacity);
                met.push(Surface { of, t, opacity, colour: [0.0; 3] });
            }
        }
    }
    met.sort_by(|p, q| p.t.total_cmp(&q.t));
    met
}

/// The number that colours the polygon which a ray meets at `t`; `None` of polygons without any.
pub(super) fn value_on(scene: &Scene, ray: &Line, t: f64) -> Option<f64> {
    drawn(scene).into_iter().find_map(|layer| {
        let origin = layer.mesh.origin();
        let mut all = layer.mesh.triangles(false).zip(layer.mesh.values(layer.array()?));
        all.find_map(|(triangle, values)| {
            let corners = triangle.corners.map(|corner| origin + corner.as_dvec3());
            let (shares, at) = meet(ray, corners)?;
            let is_it = at == t && shares.min_element() >= 0.0;
            is_it.then(|| shares.dot(DVec3::from(values.map(f64::from))))
        })
    })
}

/// The polygons that a scene's mode has a place for.
fn drawn(scene: &Scene) -> Vec<PolygonLayer> {
    match scene.refusal_of(Effect::Polygons) {
        Some(_) => Vec::new(),
        None => scene.polygons(),
    }
}

/// What a scene's polygons are cut by.
fn clip_of(scene: &Scene) -> Option<(Clip, Lattice)> {
    let Inside { clip, .. } = scene.inside_in_place().shown_by(&scene.splat);
    clip.cuts().then(|| (clip, scene.lattice()))
}

/// Whether a place is in what is kept of the scene.
fn is_kept(clip: Option<&(Clip, Lattice)>, place: DVec3) -> bool {
    let Some((clip, lattice)) = clip else { return true };
    let is_above = |plane: &crate::scene::Plane| (place - plane.point).dot(plane.normal) >= 0.0;
    let size = DVec3::from(lattice.dims.map(|n| n as f64));
    let share = ((lattice.index_from_world(place) + 0.5) / size).to_array();
    let in_box = clip.bounds.is_none_or(|bounds| {
        (0..3).all(|a| {
            let is_above = bounds.low[a] <= 0.0 || share[a] >= bounds.low[a];
            is_above && (bounds.high[a] >= 1.0 || share[a] <= bounds.high[a])
        })
    });
    in_box && clip.planes.iter().all(is_above)
}

impl Polygons {
    /// `None` for a scene without any.
    pub(super) fn of(scene: &Scene, size: [usize; 2]) -> Option<Self> {
        let mut triangles = Vec::new();
        for layer in drawn(scene) {
            for (triangle, colours) in layer.triangles() {
                let corner = |i: usize| Corner {
                    place: layer.mesh.origin() + triangle.corners[i].as_dvec3(),
                    normal: triangle.normals[i].as_dvec3(),
                    colour: colours[i].to_linear().0,
                };
                let corners = [corner(0), corner(1), corner(2)];
                triangles.push(Triangle { corners, opacity: layer.look.opacity });
            }
        }
        (!triangles.is_empty()).then(|| Self {
            triangles,
            lights: Shader::of_polygons(scene),
            camera: scene.camera,
            size: size.map(|n| n as f64),
            clip: clip_of(scene),
        })
    }

    fn ray(&self, at: DVec2) -> Line {
        let (start, step) = self.camera.ray(at, self.size);
        Line { start, step, from: f64::NEG_INFINITY }
    }

    /// What each sample of a pixel sees, from the eye inwards, with places along `ray`.
    pub(super) fn seen_by(&self, pixel: [usize; 2], ray: &Line) -> [Vec<Surface>; 4] {
        let corner = DVec2::new(pixel[0] as f64, pixel[1] as f64);
        let middle = self.ray(corner + 0.5);
        let forward = self.camera.direction;
        let nearest = self
            .camera
            .eye_distance()
            .map_or(f64::NEG_INFINITY, |d| forward.dot(self.camera.view_origin()) + NEAREST * d);
        let mut seen: [Vec<Surface>; 4] = Default::default();
        for triangle in &self.triangles {
            let places = [0, 1, 2].map(|i: usize| triangle.corners[i].place);
            let covered = SAMPLES.map(|[x, y]| {
                let line = self.ray(corner + DVec2::new(x, y));
                meet(&line, places).is_some_and(|(shares, t)| {
                    let depth = forward.dot(line.start + line.step * t);
                    shares.min_element() >= 0.0 && depth >= nearest
                })
            });
            if !covered.contains(&true) {
                continue;
            }
            let shares = meet(&middle, places).map_or(DVec3::ONE, |(shares, _)| shares);
            let shares = shares.max(DVec3::ZERO);
            let shares = (shares / shares.element_sum()).to_array();
            let of = |value: &dyn Fn(&Corner) -> DVec3| -> DVec3 {
                triangle.corners.iter().zip(shares).map(|(corner, s)| value(corner) * s).sum()
            };
            let depth = forward.dot(of(&|corner| corner.place));
            let at = (depth - forward.dot(middle.start)) / forward.dot(middle.step);
            if !is_kept(self.clip.as_ref(), middle.start + middle.step * at) {
                continue;
            }
            let normal = of(&|corner| corner.normal).normalize_or_zero();
            let colour = of(&|corner| DVec3::from(corner.colour)).to_array();
            let surface = Surface {
                of: Met::Polygon,
                t: (depth - forward.dot(ray.start)) / forward.dot(ray.step),
                opacity: triangle.opacity,
                colour: self.lights.of_side(colour, normal, &middle),
            };
            // What lies about a polygon is divided there for the whole pixel, which published opacities,
            // that do not add up, are not indifferent to.
            for (seen, covered) in seen.iter_mut().zip(covered) {
                let opacity = if covered { surface.opacity } else { 0.0 };
                seen.push(Surface { opacity, ..surface });
            }
        }
        // Stable: those at one depth stay in the order of their triangles.
        seen.iter_mut().for_each(|seen| seen.sort_by(|p, q| p.t.total_cmp(&q.t)));
        seen
    }
}
