//! What a pixel shows: the first point of its ray that can be seen, and the field there.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::classes::Classes;
use super::field::{Field, Shape};
use super::inside::{Met, Opening, Part};
use super::polygons;
use super::probed_vectors::{self, ProbedVector};
use super::projection;
use super::quadrature::Light;
use super::shading::{RayShader, Shader, gradient};
use super::sources::Line;
use super::truth;
use crate::kernel::Kernel;
use crate::scene::{
    AlongRay, Classify, Reconstruction, Scene, Shading, ShadingSpace, SplatSettings,
};
use crate::transfer::TransferFunction;
use crate::volume::ScalarVolume;

/// Error allowed in the opacity that a ray gathers.
const TOLERANCE: f64 = 1e-6;
/// Halvings of the part of the ray in which its point lies: to the last bits of its place.
const HALVINGS: u32 = 48;

/// The field at a point. Beside the field's grid, and where vectors or surfaces are shown without it, value and gradient are
/// NaN, and the opacity is 0; but on a polygon that is coloured by numbers the value is that of these.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// In or on what it is.
    pub met: Met,
    /// World position.
    pub world: DVec3,
    /// Index-space position: whole numbers at samples.
    pub index: DVec3,
    /// Which of the file's cells it lies in, where the field is drawn on its cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell: Option<u32>,
    /// The value, in the data's units.
    pub value: f64,
    /// Its growth in the world, data units per world unit along x, y, z.
    pub gradient: DVec3,
    /// Opacity there over the scene's unit distance, 0..=1, shading tables included.
    pub opacity: f64,
    /// Of each vector field of the scene the vector nearest to it, where the field's grid is.
    pub vectors: [Option<ProbedVector>; 2],
}

/// What a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one for each question")]
pub enum Seen {
    /// It passes by what is kept of the volume; where values are projected, by all that has any.
    Beside,
    /// The mean of its values, which lies at no one point.
    Average,
    /// It goes through and gathers less opacity than was asked for: this much, 0..1.
    TooLittle {
        /// Opacity of the whole ray.
        gathered: f64,
    },
    /// Here it first has gathered so much.
    Point(Point),
}

/// A volume's values between its samples, kept to be looked at along many rays.
///
/// Values are reconstructed as the scene's mode does; modes that colour samples first have no values
/// between them, and are probed as the exact mode reconstructs: by interpolating B-splines.
pub struct Probe {
    volume: Arc<ScalarVolume>,
    shape: Shape,
    reconstruction: Reconstruction,
    field: Field,
}

/// What reconstructs the values that a mode is probed for.
fn field_of(splat: &SplatSettings) -> (Shape, Reconstruction) {
    let (shape, reconstruction) = match splat.classify {
        Classify::Before => (Shape::new(Kernel::BSpline, None), Reconstruction::Interpolating),
        _ => (Shape::of(splat), splat.reconstruction),
    };
    // Points leave nothing between them, and are never classified after.
    (shape.unwrap_or(Shape::Nearest), reconstruction)
}

impl Probe {
    /// Of a scene's volume, if it has one: 8 bytes a sample, and some seconds for hundreds of millions of them.
    pub fn new(scene: &Scene) -> Option<Self> {
        let volume = scene.volume()?;
        let (shape, reconstruction) = field_of(&scene.splat);
        let field = Field::new(volume, shape, reconstruction);
        Some(Self { volume: Arc::clone(volume), shape, reconstruction, field })
    }

    /// Whether it is that of a scene.
    pub fn suits(&self, scene: &Scene) -> bool {
        scene.volume().is_some_and(|volume| Arc::ptr_eq(&self.volume, volume))
            && field_of(&scene.splat) == (self.shape, self.reconstruction)
    }

    /// Where the ray through a place of the picture, in pixels, first has gathered an opacity of
    /// `share`, in 0..1: continuous, without slabs, on what is kept of the volume and with the surfaces
    /// that lie there. Where values are projected it is where the one is that stands for the ray.
    pub fn look(&self, scene: &Scene, size: [u32; 2], at: DVec2, share: f64) -> Seen {
        let Some(transfer) = scene.drawn_transfer().filter(|_| scene.shows_field()) else {
            return seen_alone(scene, size, at, share);
        };
        let opening = Opening::as_shown(scene);
        if opening.projects() == Some(AlongRay::Average) {
            return Seen::Average;
        }
        let lattice = &self.volume.lattice;
        let world = Line::through(&scene.camera, at, size.map(f64::from));
        let index = world.mapped(lattice.axes().inverse(), lattice.origin);
        let (classes, shader) = classified(scene, &transfer);
        let polygons = polygons::met_by(scene, &world);
        let part = opening.part((&self.field, &classes), (&world, &index), &[]);
        if part.is_none() && polygons.is_empty() {
            return Seen::Beside;
        }
        let part = Part::among(part, polygons);
        let shade = RayShader {
            shader: shader.as_ref(),
            field: &self.field,
            world: &world,
            index: &index,
            beside: &[],
        };
        let found = match opening.projects() {
            Some(along) => self.extreme(&index, along, part.ends).ok_or(Seen::Beside),
            None => {
                let classes = (&classes, transfer.no_data.shows());
                let found = self.first_seen(classes, shade, &part, share);
                found.map_err(|gathered| Seen::TooLittle { gathered })
            }
        };
        let (t, met) = match found {
            Ok(found) => found,
            Err(nothing) => return nothing,
        };
        Seen::Point(self.point(scene, &classes, shade, (t, met)))
    }

    /// The field at a place of the world, whatever hides it and whether or not it is cut away; `None` beside the data.
    pub fn at(&self, scene: &Scene, world: DVec3) -> Option<Point> {
        let lattice = &self.volume.lattice;
        let place = lattice.index_from_world(world);
        // Samples of a lattice that was made over cells or points have no value where these end.
        let is_missing = self.volume.own_bounds.is_some() && self.field.is_hole(place);
        if !is_in(self.field.dims, place) || is_missing || self.field.value(place).is_none() {
            return None;
        }
        let transfer = scene.drawn_transfer()?;
        let (classes, shader) = classified(scene, &transfer);
        // Along the view, so that tables by depth have theirs.
        let from = f64::NEG_INFINITY;
        let world = Line { start: world, step: scene.camera.direction, from };
        let index = world.mapped(lattice.axes().inverse(), lattice.origin);
        let shade = RayShader {
            shader: shader.as_ref(),
            field: &self.field,
            world: &world,
            index: &index,
            beside: &[],
        };
        Some(self.point(scene, &classes, shade, (0.0, Met::Asked)))
    }

    /// The value at a place of the world; `None` beside the data, and where samples have none.
    pub fn value(&self, world: DVec3) -> Option<f64> {
        let place = self.volume.lattice.index_from_world(world);
        let is_there = is_in(self.field.dims, place) && !self.field.is_hole(place);
        if is_there { self.field.value(place) } else { None }
    }

    /// What is told of a place of a ray, and of what is met there.
    fn point(
        &self,
        scene: &Scene,
        classes: &Classes,
        shade: RayShader<'_>,
        (t, met): (f64, Met),
    ) -> Point {
        let world = shade.world.at(t);
        let place = shade.index.at(t);
        // Polygons are met there, too.
        let is_beside = met == Met::Polygon && !is_in(self.field.dims, place);
        let is_hole = !is_beside && self.field.is_hole(place);
        let density = match self.field.value(place) {
            _ if is_beside => [0.0; 4],
            _ if is_hole => classes.at(f64::NAN),
            Some(value) => shade.shaded(classes.at(value), t, value),
            None => [0.0; 4],
        };
        let lattice = &self.volume.lattice;
        let inverse = ShadingSpace::of(lattice, Some(&self.volume)).world_from_gradient;
        // No data have no value, whatever stands in for them beside others.
        let value = self.field.value(place).filter(|_| !is_hole && !is_beside);
        let gradient = value.map_or(DVec3::NAN, |_| inverse * gradient(&self.field, place));
        let unit = scene.opacity_unit_distance();
        Point {
            met,
            world,
            index: place,
            cell: self.field.cell_at(place),
            value: value.unwrap_or(f64::NAN),
            gradient,
            opacity: -(-density[0] * unit).exp_m1(),
            vectors: vectors_at(scene, world),
        }
    }

    /// Where a part of a ray has its greatest or its least value.
    fn extreme(&self, index: &Line, along: AlongRay, ends: [f64; 2]) -> Option<(f64, Met)> {
        let met = if along == AlongRay::Maximum { Met::Maximum } else { Met::Minimum };
        let found = projection::extreme(&self.field, index, along, ends);
        found.map(|found| (found.t, met))
    }

    /// Where a part of a ray first has gathered so much, and in or on what; else all that it gathers.
    fn first_seen(
        &self,
        (classes, shows_holes): (&Classes, bool),
        shade: RayShader<'_>,
        part: &Part,
        share: f64,
    ) -> Result<(f64, Met), f64> {
        let [a, b] = part.ends;
        let visible =
            self.field.bricks_where(shows_holes, |low, high| !classes.is_clear(low, high));
        let mut light = Light::new(TOLERANCE, b - a);
        let gather = |until: [f64; 2], light: &mut Light| {
            truth::gather(&self.field, classes, &visible, shade, until, light);
        };
        let mut surfaces = part.surfaces.iter().peekable();
        let mut meet = |light: &mut Light, until: f64| {
            while let Some(surface) = surfaces.next_if(|surface| surface.t <= until) {
                light.cover(surface.opacity, surface.colour);
                if 1.0 - light.transmittance >= share {
                    return Some((surface.t, surface.of));
                }
            }
            None
        };
        for [from, to] in self.parts(shade.index, part) {
            if let Some(found) = meet(&mut light, from) {
                return Ok(found);
            }
            let before = light;
            gather([from, to], &mut light);
            if 1.0 - light.transmittance < share {
                continue;
            }
            let (mut near, mut far) = (from, to);
            for _ in 0..HALVINGS {
                let place = f64::midpoint(near, far);
                let mut until = before;
                gather([from, place], &mut until);
                if 1.0 - until.transmittance < share { near = place } else { far = place }
            }
            return Ok((far, Met::Matter));
        }
        // Polygons behind all of it.
        if let Some(found) = meet(&mut light, f64::INFINITY) {
            return Ok(found);
        }
        Err(1.0 - light.transmittance)
    }

    /// The parts of a ray within one brick each and between two surfaces, in their order.
    fn parts(&self, index: &Line, part: &Part) -> Vec<[f64; 2]> {
        let [a, b] = part.ends;
        let mut cuts = vec![a, b];
        for axis in 0..3 {
            cuts.extend(index.crossings(axis, self.field.brick_faces(axis), [a, b]));
        }
        // Polygons may lie before and behind.
        let is_within = |t: &f64| *t > a && *t < b;
        cuts.extend(part.surfaces.iter().map(|surface| surface.t).filter(is_within));
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2).filter(|w| w[1] > w[0]).map(|w| [w[0], w[1]]).collect()
    }
}

/// What a scene's values are classified by, and what shades them, if anything.
fn classified(scene: &Scene, transfer: &TransferFunction) -> (Classes, Option<Shader>) {
    let plain = Shading::default();
    let shading = if Shading::is_shown_by(&scene.splat) { &scene.shading } else { &plain };
    let unit = scene.opacity_unit_distance();
    let classes = Classes::new(&shading.by_value(transfer), unit, false);
    let shader = if shading.is_plain() { None } else { Shader::of(scene, true) };
    (classes, shader)
}

/// Whether a place of index space is in the box in which values are defined.
fn is_in(dims: [usize; 3], place: DVec3) -> bool {
    (0..3).all(|axis| (-0.5..=dims[axis] as f64 - 0.5).contains(&place[axis]))
}

/// The nearest vector of each of a scene's fields.
fn vectors_at(scene: &Scene, world: DVec3) -> [Option<ProbedVector>; 2] {
    let mut found = [None; 2];
    for (found, layer) in found.iter_mut().zip(scene.vectors()) {
        *found = probed_vectors::nearest(&layer.field, world);
    }
    found
}

/// The same as [`Probe::look`] where vectors are shown without the field, of which nothing is needed: where
/// what there is of vectors, each in the box about it and without marks, and of polygons has gathered so much.
pub fn seen_alone(scene: &Scene, size: [u32; 2], at: DVec2, share: f64) -> Seen {
    let ray = Line::through(&scene.camera, at, size.map(f64::from));
    let surfaces = polygons::met_by(scene, &ray);
    match probed_vectors::first_seen(scene, &ray, &surfaces, share) {
        Err(gathered) => Seen::TooLittle { gathered },
        Ok((t, met)) => Seen::Point(Point {
            met,
            world: ray.at(t),
            index: scene.lattice().index_from_world(ray.at(t)),
            cell: None,
            value: polygons::value_on(scene, &ray, t)
                .filter(|_| met == Met::Polygon)
                .unwrap_or(f64::NAN),
            gradient: DVec3::NAN,
            opacity: 0.0,
            vectors: vectors_at(scene, ray.at(t)),
        }),
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::kernel::Kernel;
    use crate::reference::support::{in_perspective, rough, scene};
    use crate::reference::{Reference, VectorPlace};
    use crate::scene::{Amounts, Classify, ClipBox, CutFaces, Index, Isosurface, Slice};
    use crate::vector::ColourBy;
    use crate::volume::{Lattice, Samples};

    const SIZE: [u32; 2] = [40, 30];

    /// Anisotropic, far from the origin, and turned: its z axis is the world's −x.
    fn lattice() -> Lattice {
        Lattice {
            dims: [25, 25, 31],
            spacing: DVec3::new(1.0, 2.0, 0.5),
            origin: DVec3::new(300.0, -40.0, 7.0),
            direction: DMat3::from_cols(DVec3::Z, DVec3::Y, DVec3::NEG_X),
        }
    }

    /// Values grow along z of the lattice by 3 a sample; opaque from 40 on.
    fn ramp(opacity: f64) -> Scene {
        let step = vec![(40.0, 0.0), (40.0, opacity)];
        let exact = SplatSettings::EXACT;
        let mut scene = scene(lattice(), |p| 3.0 * p.z, step, exact, DVec3::NEG_X);
        scene.camera.parallel_scale = 3.0;
        scene
    }

    fn point(seen: Seen) -> Point {
        let Seen::Point(point) = seen else { panic!("{seen:?}") };
        point
    }

    #[test]
    fn the_face_of_a_ramp_is_where_it_is_and_its_gradient_is_the_worlds() {
        let parallel = ramp(0.6);
        let share = 0.1;
        for scene in [parallel.clone(), in_perspective(parallel, 0.7)] {
            let probe = Probe::new(&scene).unwrap();
            for at in [DVec2::new(20.5, 15.5), DVec2::new(3.5, 28.5)] {
                let found = point(probe.look(&scene, SIZE, at, share));
                let (start, step) = scene.camera.ray(at, SIZE.map(f64::from));
                // Value 40 lies at index 40/3, so at x = 300 − 0.5 · 40/3, and opacity 0.6 is of the
                // smallest spacing, 0.5.
                let face = (300.0 - 20.0 / 3.0 - start.x) / step.x;
                let kappa = -(0.4_f64.ln()) / 0.5;
                let expected = start + step * (face - (1.0 - share).ln() / kappa);
                // Measured: 3.5e-9, of the borders, which sharpening mirrors the ramp about.
                assert!((found.world - expected).length() < 1e-7, "{} {expected}", found.world);
                let index = lattice().index_from_world(expected);
                assert!((found.index - index).length() < 1e-4 && index.z > 40.0 / 3.0);
                assert!((found.value - 3.0 * index.z).abs() < 1e-3, "{}", found.value);
                // 3 a sample, half a world unit apart, against x.
                // Measured: 2.4e-8.
                assert!((found.gradient - DVec3::new(-6.0, 0.0, 0.0)).length() < 1e-6);
                assert!((found.opacity - 0.6).abs() < 1e-12, "{}", found.opacity);
            }
        }
    }

    #[test]
    fn a_place_is_told_whatever_hides_it_and_none_beside_the_data() {
        let mut scene = ramp(0.6);
        let probe = Probe::new(&scene).unwrap();
        let index = DVec3::new(11.25, 12.5, 20.75);
        let world = lattice().world_from_index(index);
        // Not to be seen from anywhere: behind a wall, and cut away.
        scene.inside.clip.bounds = Some(ClipBox { high: [1.0, 1.0, 0.2], ..ClipBox::WHOLE });
        let scene = scene.with(across(299.0, 1.0));
        let found = probe.at(&scene, world).expect("within");
        assert_eq!((found.met, found.cell, found.vectors), (Met::Asked, None, [None; 2]));
        assert!((found.world - world).length() < 1e-12 && (found.index - index).length() < 1e-9);
        assert!((found.value - 62.25).abs() < 1e-4, "{found:?}");
        assert!((found.gradient - DVec3::new(-6.0, 0.0, 0.0)).length() < 1e-4, "{found:?}");
        assert!((found.opacity - 0.6).abs() < 1e-12, "{found:?}");
        let before = probe.at(&scene, lattice().world_from_index(DVec3::new(11.25, 12.5, 5.0)));
        assert_eq!(before.map(|found| found.opacity), Some(0.0), "where nothing shows");
        // Up to the ends of the samples' boxes.
        for (z, is_in) in [(30.4, true), (30.6, false), (-0.4, true), (-0.6, false)] {
            let at = lattice().world_from_index(DVec3::new(12.0, 12.0, z));
            assert_eq!(probe.at(&scene, at).is_some(), is_in, "{z}");
        }
    }

    #[test]
    fn rays_that_see_nothing_say_so_and_how_much_there_was() {
        let mut scene = ramp(0.01);
        let probe = Probe::new(&scene).unwrap();
        let middle = DVec2::new(20.5, 15.5);
        // From index 40/3 to 30.5, half a world unit apart, by 0.01 every half unit.
        let Seen::TooLittle { gathered } = probe.look(&scene, SIZE, middle, 0.5) else { panic!() };
        let expected = 1.0 - 0.99_f64.powf(30.5 - 40.0 / 3.0);
        assert!((gathered - expected).abs() < 1e-5, "{gathered} {expected}");
        assert!(matches!(probe.look(&scene, SIZE, middle, 0.9 * expected), Seen::Point(_)));
        scene.camera.focal_point.y += 500.0;
        assert_eq!(probe.look(&scene, SIZE, middle, 0.1), Seen::Beside);
        // The eye has passed it.
        let mut behind = in_perspective(ramp(0.6), 0.7);
        behind.camera.focal_point.x -= 400.0;
        assert_eq!(probe.look(&behind, SIZE, middle, 0.1), Seen::Beside);
        // Nothing has any opacity.
        scene = ramp(0.01);
        scene.transfer_mut().expect("a field").opacity.clear();
        assert_eq!(probe.look(&scene, SIZE, middle, 0.1), Seen::TooLittle { gathered: 0.0 });
    }

    #[test]
    fn what_a_ray_gathers_is_the_opacity_of_the_exact_picture() {
        let opacity = vec![(0.1, 0.0), (0.6, 0.2), (0.9, 0.02)];
        let lattice = Lattice { spacing: DVec3::new(1.0, 1.5, 0.7), ..Lattice::unit([9, 8, 10]) };
        let direction = DVec3::new(0.3, -0.5, 0.8);
        let with_holes = |p: DVec3| {
            if (p - DVec3::splat(4.0)).length() < 1.5 { f64::NAN } else { rough(p) }
        };
        let kernels = [
            SplatSettings::EXACT,
            SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT },
            SplatSettings { kernel: Kernel::Cubic, ..SplatSettings::EXACT },
        ];
        for splat in kernels {
            let plain = scene(lattice, with_holes, opacity.clone(), splat, direction);
            let thinned =
                Amounts { index: Index::GradientStrength, points: vec![(0.0, 1.0), (0.6, 0.1)] };
            let shading = Shading { modulation: Some(thinned), ..Shading::default() };
            for scene in [plain.clone(), Scene { shading, ..plain }] {
                let probe = Probe::new(&scene).unwrap();
                let exact = Reference::exact(&scene, SIZE.map(|n| n as usize)).unwrap();
                for pixel in [[20, 15], [12, 9], [30, 20]] {
                    let at = DVec2::from(pixel.map(|p| p as f64 + 0.5));
                    let expected = exact.pixel(pixel)[3];
                    let Seen::TooLittle { gathered } = probe.look(&scene, SIZE, at, 1.0) else {
                        panic!("an opacity of 1");
                    };
                    // By the same quadrature to another tolerance. Measured: 3.6e-10.
                    assert!((gathered - expected).abs() < 1e-8, "{gathered} {expected}");
                    assert!(expected > 0.05, "{expected}");
                }
            }
        }
    }

    /// What a ray through the middle of a ramp meets, in perspective and not.
    fn met(scene: &Scene, share: f64) -> Point {
        let at = DVec2::new(20.5, 15.5);
        let found = point(Probe::new(scene).unwrap().look(scene, SIZE, at, share));
        let index = lattice().index_from_world(found.world);
        assert!((found.index - index).length() < 1e-9);
        found
    }

    #[test]
    fn surfaces_before_matter_are_met_where_they_are_and_thin_ones_add_up() {
        // Along the lattice's z; matter begins at index 40/3 and takes little to be opaque.
        let mut scene = ramp(0.6);
        scene.camera.direction = DVec3::new(-1.0, 0.1, 0.05).normalize();
        let iso = |value, opacity| Isosurface { value, opacity, colour: None };
        scene.inside.isosurfaces = vec![iso(36.0, 0.4), iso(33.0, 0.06)];
        let found = met(&scene, 0.1);
        assert_eq!(found.met, Met::Isosurface);
        // The thin one alone is too little.
        assert!((found.index.z - 12.0).abs() < 1e-5, "{found:?}");
        assert!((found.value - 36.0).abs() < 1e-9 && found.opacity == 0.0, "{found:?}");
        assert!((met(&scene, 0.05).index.z - 11.0).abs() < 1e-5);
        // 1 − 0.94 · 0.6 of both is 0.436, and the rest is the matter's.
        let found = met(&scene, 0.44);
        assert!(found.met == Met::Matter && found.index.z > 40.0 / 3.0, "{found:?}");
        assert_eq!(met(&scene, 0.43).met, Met::Isosurface);
        // A slice in front of all that; behind it, and in the matter, it is not the first.
        scene.inside.slices = vec![Slice::across(&lattice(), 2, 10.0 / 31.0, 0.5)];
        let found = met(&scene, 0.1);
        assert_eq!(found.met, Met::Slice);
        assert!(
            (found.index.z - 9.5).abs() < 1e-9 && (found.value - 28.5).abs() < 1e-4,
            "{found:?}"
        );
        scene.inside.slices = vec![Slice::across(&lattice(), 2, 20.0 / 31.0, 0.5)];
        assert_eq!(met(&scene, 0.1).met, Met::Isosurface);
        scene.inside.isosurfaces.clear();
        assert_eq!(met(&scene, 0.1).met, Met::Matter);
        // Modes that show no isosurfaces have none to be met.
        scene.inside.isosurfaces = vec![iso(36.0, 1.0)];
        assert_eq!(met(&scene, 0.1).met, Met::Isosurface);
        scene.splat.classify = Classify::After;
        assert_eq!(met(&scene, 0.1).met, Met::Matter);
        scene.splat = SplatSettings::SHADE_FIRST;
        assert_eq!(met(&scene, 0.1).met, Met::Matter);
    }

    #[test]
    fn a_cut_face_is_met_where_the_matter_is_cut() {
        let mut scene = ramp(0.001);
        let bounds = ClipBox { low: [0.0, 0.0, 0.6], ..ClipBox::WHOLE };
        scene.inside.clip.bounds = Some(bounds);
        let thin = Probe::new(&scene).unwrap().look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1);
        assert!(matches!(thin, Seen::TooLittle { .. }), "{thin:?}");
        scene.inside.clip.faces = CutFaces::Coloured;
        let found = met(&scene, 0.1);
        assert_eq!(found.met, Met::CutFace);
        assert!((found.index.z - (0.6 * 31.0 - 0.5)).abs() < 1e-9, "{found:?}");
        assert!((found.opacity - 0.001).abs() < 1e-12, "of the matter: {found:?}");
    }

    #[test]
    fn of_projected_values_the_extreme_is_met_and_the_mean_lies_nowhere() {
        let mut scene = ramp(0.6);
        scene.inside.along = AlongRay::Maximum;
        scene.inside.isosurfaces = vec![Isosurface { value: 36.0, opacity: 1.0, colour: None }];
        let found = met(&scene, 0.1);
        // The field is mirrored about its last sample, where it is greatest.
        assert!(found.met == Met::Maximum && (found.index.z - 30.0).abs() < 1e-5, "{found:?}");
        assert!((found.value - 90.0).abs() < 1e-6, "{found:?}");
        scene.inside.along = AlongRay::Minimum;
        let found = met(&scene, 0.1);
        assert!(found.met == Met::Minimum && found.index.z.abs() < 1e-5, "{found:?}");
        let bounds = ClipBox { low: [0.0, 0.0, 0.5], ..ClipBox::WHOLE };
        scene.inside.clip.bounds = Some(bounds);
        assert!((met(&scene, 0.1).index.z - 15.0).abs() < 1e-6, "of what is kept");
        scene.inside.along = AlongRay::Average;
        let probe = Probe::new(&scene).unwrap();
        assert_eq!(probe.look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1), Seen::Average);
        scene.inside.along = AlongRay::Minimum;
        scene.camera.focal_point.y += 500.0;
        assert_eq!(probe.look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1), Seen::Beside);
    }

    /// A triangle across the world's x axis there, far larger than the picture.
    fn across(x: f32, opacity: f64) -> crate::scene::PolygonLayer {
        let corners = [[-90.0, -90.0], [90.0, -90.0], [0.0, 120.0]];
        let corner = |[y, z]: [f32; 2]| glam::Vec3::new(x, y - 16.0, z + 19.0);
        let positions = corners.map(corner).to_vec();
        let triangles = vec![[0, 1, 2]];
        let mesh = crate::polygons::Mesh::new("t", positions, Vec::new(), Vec::new(), triangles);
        let mut layer = crate::scene::PolygonLayer::new(Arc::new(mesh.unwrap()));
        layer.look.opacity = opacity;
        layer
    }

    #[test]
    fn polygons_are_met_before_within_and_behind_the_volume() {
        // Index z of the lattice is (300 − x) / 0.5; matter begins at 40/3.
        let at = |index: f64| 300.0 - 0.5 * index as f32;
        for perspective in [false, true] {
            let see = |scene: Scene, share: f64| {
                let scene = if perspective { in_perspective(scene, 0.7) } else { scene };
                met(&scene, share)
            };
            let with = |opacity: f64, layers: Vec<crate::scene::PolygonLayer>| {
                layers.into_iter().fold(ramp(opacity), Scene::with)
            };
            // In the matter, and behind where it is opaque.
            let found = see(with(0.001, vec![across(at(20.0), 0.5)]), 0.1);
            assert_eq!(found.met, Met::Polygon);
            assert!((found.index.z - 20.0).abs() < 1e-4, "{found:?}");
            assert!((found.value - 60.0).abs() < 1e-2 && found.opacity > 0.0, "{found:?}");
            assert_eq!(see(with(0.6, vec![across(at(20.0), 0.5)]), 0.1).met, Met::Matter);
            // Too thin a polygon before it adds to what is gathered.
            let thin = see(with(0.6, vec![across(at(10.0), 0.06)]), 0.1);
            let alone = see(with(0.6, vec![]), 0.1);
            assert!(thin.met == Met::Matter && thin.index.z < alone.index.z - 1e-3, "{thin:?}");
            assert_eq!(see(with(0.6, vec![across(at(10.0), 0.2)]), 0.1).met, Met::Polygon);
            // Before the volume and behind it, where there is no value.
            for index in [-0.9, 60.0] {
                let found = see(with(0.001, vec![across(at(index), 0.5)]), 0.1);
                assert_eq!(found.met, Met::Polygon, "{index}");
                assert!((found.index.z - index).abs() < 1e-4, "{found:?}");
                assert!(found.value.is_nan() && found.opacity == 0.0, "{found:?}");
            }
        }
        // Beside the volume, and cut away.
        let mut scene = ramp(0.001).with(across(at(20.0), 1.0));
        let bounds = ClipBox { low: [0.0, 0.0, 0.8], ..ClipBox::WHOLE };
        scene.inside.clip.bounds = Some(bounds);
        let probe = Probe::new(&scene).unwrap();
        let middle = DVec2::new(20.5, 15.5);
        assert!(matches!(probe.look(&scene, SIZE, middle, 0.1), Seen::TooLittle { .. }));
        scene.inside.clip.bounds = None;
        scene.camera.focal_point.y += 50.0;
        let beside = point(probe.look(&scene, SIZE, middle, 0.1));
        assert!(beside.met == Met::Polygon && beside.value.is_nan(), "{beside:?}");
        scene.remove(scene.layers.len() - 1);
        assert_eq!(probe.look(&scene, SIZE, middle, 0.1), Seen::Beside);
    }

    /// Vectors twice as far apart as the samples, each with its number as its length.
    fn numbered(alone: bool) -> Scene {
        let base = lattice();
        let vectors: Vec<glam::Vec3> =
            (0..13 * 13 * 16).map(|i| glam::Vec3::new(0.0, 0.0, (i + 1) as f32)).collect();
        let grid = Lattice { dims: [13, 13, 16], spacing: base.spacing * 2.0, ..base };
        let places = crate::volume::Places::Lattice(grid);
        let ticket = crate::core::Ticket::new();
        let field = crate::volume::VectorField::new("v", places, vectors.into(), &ticket).unwrap();
        let layer = crate::scene::VectorLayer::new(Arc::new(field));
        let mut scene = ramp(0.6).with(layer);
        scene.show_field(!alone);
        scene
    }

    #[test]
    fn the_vector_nearest_to_a_point_is_told() {
        let scene = numbered(false);
        let found = met(&scene, 0.1);
        let [Some(vector), None] = found.vectors else { panic!("{found:?}") };
        let expected = (found.index / 2.0).round().to_array().map(|n| n as usize);
        let number = (expected[2] * 13 + expected[1]) * 13 + expected[0] + 1;
        assert_eq!(vector.place, VectorPlace::Index(expected));
        assert_eq!(vector.length, number as f64);
        assert_eq!(vector.vector, DVec3::new(0.0, 0.0, number as f64));
        let off = lattice().index_from_world(found.world - vector.world);
        let origin = lattice().index_from_world(DVec3::ZERO);
        assert!((off - origin).abs().max_element() <= 1.0 + 1e-9, "within half a step of it");
        // The same where each point is told by itself, but beyond half a step of the grid none.
        let layer = scene.vectors().remove(0);
        let places = &layer.field.places;
        let count = 13 * 13 * 16;
        let points = crate::volume::Places::Points {
            dims: [13, 13, 16],
            points: (0..count).map(|i| places.at(i).0).collect(),
            axes: (0..count).map(|i| places.at(i).1).collect(),
        };
        let field = crate::volume::VectorField { places: points, ..(*layer.field).clone() };
        assert_eq!(probed_vectors::nearest(&field, found.world), Some(vector));
        // Cells that differ leave gaps between the boxes of points: a step of them is within the grid.
        let before = [-1.6, -2.4].map(|z| lattice().world_from_index(DVec3::new(12.0, 12.0, z)));
        let [within, beside] = before.map(|place| probed_vectors::nearest(&field, place));
        assert!(
            within.is_some_and(|vector| vector.place == VectorPlace::Index([6, 6, 0]))
                && beside.is_none()
        );
        let far = lattice().world_from_index(DVec3::new(12.0, 12.0, -1.1));
        assert_eq!(probed_vectors::nearest(&layer.field, far), None);
        let near = lattice().world_from_index(DVec3::new(12.0, 12.0, -0.9));
        assert!(probed_vectors::nearest(&layer.field, near).is_some());
    }

    #[test]
    fn vectors_alone_are_seen_in_boxes_of_their_opacity() {
        let mut scene = numbered(true);
        // From the sixth layer on: 13 · 13 · 5 and more.
        scene.vectors_mut()[0].1.transfer.opacity = vec![(845.5, 0.0), (845.5, 0.3)];
        let middle = DVec2::new(20.5, 15.5);
        let found = point(seen_alone(&scene, SIZE, middle, 0.1));
        // Boxes of the sixth layer, index 5, begin at 4.5 steps, 9 samples; opacities are of 0.5 world units,
        // a sample.
        let deep = 0.9_f64.ln() / 0.7_f64.ln();
        assert_eq!(found.met, Met::Vectors);
        assert!((found.index.z - (9.0 + deep)).abs() < 1e-9, "{found:?}");
        let place = found.vectors[0].map(|vector| vector.place);
        assert!(matches!(place, Some(VectorPlace::Index([_, _, 5]))), "{place:?}");
        let Seen::TooLittle { gathered } = seen_alone(&scene, SIZE, middle, 0.999_999) else {
            panic!()
        };
        let expected = 1.0 - 0.7_f64.powf(2.0 * 11.0);
        assert!((gathered - expected).abs() < 1e-9, "{gathered} {expected}");
        // A polygon before them, and one too thin among them.
        let mut scene = scene.with(across(300.0 - 0.5 * 8.0, 0.5));
        assert_eq!(point(seen_alone(&scene, SIZE, middle, 0.1)).met, Met::Polygon);
        scene.remove(scene.layers.len() - 1);
        let scene = scene.with(across(300.0 - 0.5 * 9.1, 0.05));
        let thinner = point(seen_alone(&scene, SIZE, middle, 0.1));
        let deep = (0.9_f64 / 0.95).ln() / 0.7_f64.ln();
        assert!((thinner.index.z - (9.0 + deep)).abs() < 1e-9, "{thinner:?}");
    }

    /// Opacities by place, by the scalar field and by both fields, from either side, and about the eye.
    #[test]
    fn vectors_alone_are_met_where_their_boxes_begin() {
        let middle = DVec2::new(20.5, 15.5);
        let deep = |share: f64, left: f64| (1.0 - share).ln() / left.ln();
        let with = |by: ColourBy, opacity: Vec<(f64, f64)>| {
            let mut scene = numbered(true);
            let settings = scene.vectors_mut().remove(0).1;
            (settings.opacity_by, settings.transfer.opacity) = (by, opacity);
            scene
        };
        let depth = |scene: &Scene| {
            let found = point(seen_alone(scene, SIZE, middle, 0.1));
            assert_eq!(found.met, Met::Vectors);
            found.index.z
        };
        // Sample 10 has a value of 30, and lies at 300 − 5 along the world's x axis.
        let by_value = with(ColourBy::Scalar, vec![(29.0, 0.0), (29.0, 0.3)]);
        assert!((depth(&by_value) - (9.0 + deep(0.1, 0.7))).abs() < 1e-9);
        let by_place = with(ColourBy::X, vec![(295.5, 0.3), (295.5, 0.0)]);
        assert!((depth(&by_place) - (9.0 + deep(0.1, 0.7))).abs() < 1e-9);
        // The other way round: boxes that come last in the grid are met first.
        let mut behind = by_value.clone();
        let lattice = behind.lattice();
        behind.camera = crate::core::Camera::new(lattice.centre(), DVec3::X, DVec3::Y, 3.0);
        assert!((depth(&behind) - (31.0 - deep(0.1, 0.7))).abs() < 1e-9);
        // Two fields in the same place hide together, and each box only where it is.
        let mut second = by_value.vectors().remove(0);
        second.settings.transfer.opacity = vec![(41.0, 0.0), (41.0, 0.2)];
        let mut both = by_value.clone().with(second);
        both.vectors_mut()[0].1.transfer.opacity =
            vec![(0.0, 0.05), (20.0, 0.05), (20.0, 0.0), (41.0, 0.0), (41.0, 0.3)];
        // Boxes of indices 0 to 3 reach from −1 to 7, those from 7 on begin at 13.
        let left = 0.95_f64.powf(8.0);
        let found = point(seen_alone(&both, SIZE, middle, 0.5)).index.z;
        let expected = 13.0 + (0.5 / left).ln() / (0.7_f64 * 0.8).ln();
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        // Missing vectors show nothing, wherever they are.
        let mut holed = by_value.clone();
        let mut layer = holed.vectors().remove(0);
        let mut field = (*layer.field).clone();
        let sixth = |(i, v): (usize, &glam::Vec3)| if i / 169 == 5 { glam::Vec3::NAN } else { *v };
        field.vectors = field.vectors.iter().enumerate().map(sixth).collect();
        layer.field = Arc::new(field);
        holed.keep_vectors(0);
        let mut holed = holed.with(layer);
        holed.show_field(false);
        assert!((depth(&holed) - (11.0 + deep(0.1, 0.7))).abs() < 1e-9);
        // From an eye in the midst of them nothing behind it is seen.
        let mut within = in_perspective(by_value, 0.5);
        let eye = within.camera.view_origin();
        let from = lattice.world_from_index(DVec3::new(12.0, 12.0, 17.3));
        within.camera.focal_point += from - eye;
        let found = point(seen_alone(&within, SIZE, DVec2::new(20.0, 15.0), 0.5));
        assert!((found.index.z - (17.3 + deep(0.5, 0.7))).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_probe_is_of_its_volume_and_its_reconstruction() {
        let mut scene = ramp(0.5);
        let probe = Probe::new(&scene).unwrap();
        assert!(probe.suits(&scene));
        let mut other = scene.clone();
        other.camera.parallel_scale = 9.0;
        other.transfer_mut().unwrap().opacity.clear();
        other.splat = SplatSettings::SHADE_FIRST;
        assert!(probe.suits(&other), "colours first: as the exact mode");
        other.splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
        assert!(!probe.suits(&other));
        let samples = Samples::Float64(vec![0.0; lattice().len()]);
        let volume = Arc::new(ScalarVolume::from_samples("t", lattice(), samples).unwrap());
        let look = scene.layers[0].look.clone();
        scene.replace(0, Default::default(), (crate::scene::Sampled::Volume(volume), look));
        assert!(!probe.suits(&scene));
    }
}
