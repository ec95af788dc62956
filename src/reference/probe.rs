//! What a pixel shows: the first point of its ray that can be seen, and the field there.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::classes::Classes;
use super::field::{Field, Shape};
use super::inside::{Met, Opening, Part};
use super::projection;
use super::quadrature::Light;
use super::shading::{RayShader, Shader, gradient};
use super::sources::Line;
use super::truth;
use crate::kernel::Kernel;
use crate::scene::{
    AlongRay, Classify, Reconstruction, Scene, Shading, ShadingSpace, SplatSettings,
};
use crate::volume::ScalarVolume;

/// Error allowed in the opacity that a ray gathers.
const TOLERANCE: f64 = 1e-6;
/// Halvings of the part of the ray in which its point lies: to the last bits of its place.
const HALVINGS: u32 = 48;

/// The field at a point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// In or on what it is.
    pub met: Met,
    /// World position.
    pub world: DVec3,
    /// Index-space position: whole numbers at samples.
    pub index: DVec3,
    /// The value, in the data's units.
    pub value: f64,
    /// Its growth in the world, data units per world unit along x, y, z.
    pub gradient: DVec3,
    /// Opacity there over the scene's unit distance, 0..=1, shading tables included.
    pub opacity: f64,
}

/// What a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    let (kernel, extent, reconstruction) = match splat.classify {
        Classify::Before => (Kernel::BSpline, None, Reconstruction::Interpolating),
        _ => (splat.kernel, splat.extent, splat.reconstruction),
    };
    // Points leave nothing between them, and are never classified after.
    (Shape::new(kernel, extent).unwrap_or(Shape::Nearest), reconstruction)
}

impl Probe {
    /// Of a scene's volume: 8 bytes a sample, and some seconds for hundreds of millions of them.
    pub fn new(scene: &Scene) -> Self {
        let (shape, reconstruction) = field_of(&scene.splat);
        let field = Field::new(&scene.volume, shape, reconstruction);
        Self { volume: Arc::clone(&scene.volume), shape, reconstruction, field }
    }

    /// Whether it is that of a scene.
    pub fn suits(&self, scene: &Scene) -> bool {
        Arc::ptr_eq(&self.volume, &scene.volume)
            && field_of(&scene.splat) == (self.shape, self.reconstruction)
    }

    /// Where the ray through a place of the picture, in pixels, first has gathered an opacity of
    /// `share`, in 0..1: continuous, without slabs, on what is kept of the volume and with the surfaces
    /// that lie there. Where values are projected it is where the one is that stands for the ray.
    pub fn look(&self, scene: &Scene, size: [u32; 2], at: DVec2, share: f64) -> Seen {
        let opening = Opening::as_shown(scene);
        if opening.projects() == Some(AlongRay::Average) {
            return Seen::Average;
        }
        let lattice = &self.volume.lattice;
        let (start, step) = scene.camera.ray(at, size.map(f64::from));
        let from = scene.camera.eye_distance().map_or(f64::NEG_INFINITY, |_| 0.0);
        let world = Line { start, step, from };
        let index = world.mapped(lattice.axes().inverse(), lattice.origin);
        let plain = Shading::default();
        let shading = if Shading::is_shown_by(&scene.splat) { &scene.shading } else { &plain };
        let unit = scene.opacity_unit_distance();
        let classes = Classes::new(&shading.by_value(&scene.transfer), unit, false);
        let Some(part) = opening.part((&self.field, &classes), &world, &index) else {
            return Seen::Beside;
        };
        let shader = match shading.is_plain() {
            true => None,
            false => Shader::of(scene, true),
        };
        let shade =
            RayShader { shader: shader.as_ref(), field: &self.field, world: &world, index: &index };
        let found = match opening.projects() {
            Some(along) => self.extreme(&index, along, part.ends),
            None => {
                self.first_seen((&classes, scene.transfer.no_data.shows()), shade, &part, share)
            }
        };
        let (t, met) = match found {
            Ok(found) => found,
            Err(nothing) => return nothing,
        };
        let place = index.at(t);
        let is_hole = self.field.is_hole(place);
        let density = match self.field.value(place) {
            _ if is_hole => classes.at(f64::NAN),
            Some(value) => shade.shaded(classes.at(value), t, value),
            None => [0.0; 4],
        };
        let inverse = ShadingSpace::of(scene).world_from_gradient;
        // No data have no value, whatever stands in for them beside others.
        let value = self.field.value(place).filter(|_| !is_hole);
        let gradient = value.map_or(DVec3::NAN, |_| inverse * gradient(&self.field, place));
        Seen::Point(Point {
            met,
            world: world.at(t),
            index: place,
            value: value.unwrap_or(f64::NAN),
            gradient,
            opacity: -(-density[0] * unit).exp_m1(),
        })
    }

    /// Where a part of a ray has its greatest or its least value.
    fn extreme(&self, index: &Line, along: AlongRay, ends: [f64; 2]) -> Result<(f64, Met), Seen> {
        let met = if along == AlongRay::Maximum { Met::Maximum } else { Met::Minimum };
        let found = projection::extreme(&self.field, index, along, ends);
        found.map(|found| (found.t, met)).ok_or(Seen::Beside)
    }

    /// Where a part of a ray first has gathered so much, and in or on what.
    fn first_seen(
        &self,
        (classes, shows_holes): (&Classes, bool),
        shade: RayShader<'_>,
        part: &Part,
        share: f64,
    ) -> Result<(f64, Met), Seen> {
        let [a, b] = part.ends;
        let visible =
            self.field.bricks_where(shows_holes, |low, high| !classes.is_clear(low, high));
        let mut light = Light::new(TOLERANCE, b - a);
        let gather = |until: [f64; 2], light: &mut Light| {
            truth::gather(&self.field, classes, &visible, shade, until, light);
        };
        let mut surfaces = part.surfaces.iter().peekable();
        for [from, to] in self.parts(shade.index, part) {
            while let Some(surface) = surfaces.next_if(|surface| surface.t <= from) {
                light.cover(surface.opacity, surface.colour);
                if 1.0 - light.transmittance >= share {
                    return Ok((surface.t, surface.of));
                }
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
        Err(Seen::TooLittle { gathered: 1.0 - light.transmittance })
    }

    /// The parts of a ray within one brick each and between two surfaces, in their order.
    fn parts(&self, index: &Line, part: &Part) -> Vec<[f64; 2]> {
        let [a, b] = part.ends;
        let mut cuts = vec![a, b];
        for axis in 0..3 {
            cuts.extend(index.crossings(axis, self.field.brick_faces(axis), [a, b]));
        }
        // All lie before the part's end, so that each has a part behind it.
        cuts.extend(part.surfaces.iter().map(|surface| surface.t));
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2).filter(|w| w[1] > w[0]).map(|w| [w[0], w[1]]).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::reference::Reference;
    use crate::reference::support::{in_perspective, rough, scene};
    use crate::scene::{Amounts, ClipBox, CutFaces, Index, Isosurface, Slice};
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
            let probe = Probe::new(&scene);
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
    fn rays_that_see_nothing_say_so_and_how_much_there_was() {
        let mut scene = ramp(0.01);
        let probe = Probe::new(&scene);
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
        scene.transfer.opacity.clear();
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
                let probe = Probe::new(&scene);
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
        let found = point(Probe::new(scene).look(scene, SIZE, at, share));
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
        let thin = Probe::new(&scene).look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1);
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
        let probe = Probe::new(&scene);
        assert_eq!(probe.look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1), Seen::Average);
        scene.inside.along = AlongRay::Minimum;
        scene.camera.focal_point.y += 500.0;
        assert_eq!(probe.look(&scene, SIZE, DVec2::new(20.5, 15.5), 0.1), Seen::Beside);
    }

    #[test]
    fn a_probe_is_of_its_volume_and_its_reconstruction() {
        let scene = ramp(0.5);
        let probe = Probe::new(&scene);
        assert!(probe.suits(&scene));
        let mut other = scene.clone();
        other.camera.parallel_scale = 9.0;
        other.transfer.opacity.clear();
        other.splat = SplatSettings::SHADE_FIRST;
        assert!(probe.suits(&other), "colours first: as the exact mode");
        other.splat = SplatSettings { kernel: Kernel::Linear, ..SplatSettings::EXACT };
        assert!(!probe.suits(&other));
        let samples = Samples::Float64(vec![0.0; lattice().len()]);
        let volume = Arc::new(ScalarVolume::from_samples("t", lattice(), samples).unwrap());
        assert!(!probe.suits(&Scene { volume, ..scene }));
    }
}
