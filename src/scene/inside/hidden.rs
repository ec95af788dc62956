//! How much of a slice, an isosurface or anything else is seen through the matter before it.

use glam::DVec3;

use super::{AlongRay, HalfSpace, Inside, Isosurface, Slice};
use crate::core::Camera;
use crate::scene::Scene;
use crate::transfer::TransferFunction;
use crate::volume::ScalarVolume;

/// A surface of which this share is seen is not hidden.
const SEEN: f64 = 0.25;
/// Places of a slice that are looked at, along each side of the square about it, of which a part lies within the volume.
const PLACES: usize = 16;
/// Samples between which an isosurface is looked for, along each axis, and places of it at most.
const SAMPLES: usize = 24;
const MOST_PLACES: usize = 64;
/// Steps of a ray at most.
const MOST_STEPS: f64 = 128.0;
/// Optical depth behind which nothing is seen.
const OPAQUE: f64 = 5.0;
/// What is left of opacities where the field is faded: a hundred voxels of matter hide a fifth of what is behind.
pub(in crate::scene) const FADED: f64 = 0.002;
/// The least opacity, over the edge of a cell, of a mesh that is a body rather than a cloud.
const OPAQUE_BODY: f64 = 0.5;
/// The least opacity of a field that can be faded.
const LEAST_TO_FADE: f64 = 0.01;

impl Scene {
    /// About how much of a slice the camera sees through the field, where that is less than a quarter: so dense is what lies
    /// before it. `None` where it is more, where no slice is shown, and where opacities are told in ways that take long to follow.
    pub fn little_seen_of_slice(&self, slice: &Slice) -> Option<f64> {
        let places = |matter: &Matter<'_>| matter.places_of_slice(slice);
        self.little_seen(places).filter(|_| slice.opacity > 0.0)
    }

    /// The same of an isosurface.
    pub fn little_seen_of_isosurface(&self, iso: &Isosurface) -> Option<f64> {
        let places = |matter: &Matter<'_>| matter.places_of_isosurface(iso.value);
        self.little_seen(places).filter(|_| iso.opacity > 0.0)
    }

    /// The same of something else by its places in the world, few of many.
    pub fn little_seen_of_places(
        &self,
        world: impl ExactSizeIterator<Item = DVec3>,
    ) -> Option<f64> {
        let every = world.len().div_ceil(MOST_PLACES).max(1);
        let world: Vec<DVec3> = world.step_by(every).collect();
        let places = |matter: &Matter<'_>| {
            let some = world.iter().map(|place| matter.volume.lattice.index_from_world(*place));
            some.filter(|at| matter.is_kept(*at)).collect()
        };
        self.little_seen(places)
    }

    /// Fades the field where its matter hides places of the world, or is a body that these lie in; whether it did.
    pub fn uncover(&mut self, world: impl ExactSizeIterator<Item = DVec3>) -> bool {
        let is_hidden = self.can_fade()
            && (self.is_opaque_body() || self.little_seen_of_places(world).is_some());
        if is_hidden {
            self.fade(true);
        }
        is_hidden
    }

    /// Whether the field is so dense that it can be faded.
    pub fn can_fade(&self) -> bool {
        let most = self.transfer().map_or(0.0, TransferFunction::most_opacity);
        !self.inside.is_faded && most > LEAST_TO_FADE
    }

    /// Whether it is a mesh whose cells nobody sees into: what lies within it, and in its own colours, is not told from it. Walls of
    /// cells are often thinner than the steps of the other ways to tell.
    pub fn is_opaque_body(&self) -> bool {
        let is_of_cells = self.volume().is_some_and(|volume| volume.cells.is_some());
        let most = self.transfer().map_or(0.0, TransferFunction::most_opacity);
        is_of_cells && self.shows_surfaces() && !self.inside.is_faded && most >= OPAQUE_BODY
    }

    /// Draws the field with a small part of its opacities, so that what lies in it is seen, or with all of them.
    pub fn fade(&mut self, is_faded: bool) {
        self.inside.is_faded = is_faded;
    }

    /// Whether slices and isosurfaces are drawn among the field.
    fn shows_surfaces(&self) -> bool {
        self.shows_field()
            && self.inside.along == AlongRay::Composite
            && Inside::is_shown_by(&self.splat)
    }

    fn little_seen(&self, places: impl Fn(&Matter<'_>) -> Vec<DVec3>) -> Option<f64> {
        let (volume, transfer) = self.volume().zip(self.drawn_transfer())?;
        let shading = &self.shading;
        let is_by_value =
            shading.opacity.is_none() && shading.modulation.is_none() && shading.regions.is_empty();
        if !is_by_value || !self.shows_surfaces() {
            return None;
        }
        let kept = self.inside.clip.half_spaces(&volume.lattice);
        let unit_distance = self.opacity_unit_distance();
        let matter =
            Matter { volume, transfer: &transfer, kept, unit_distance, camera: &self.camera };
        let places = places(&matter);
        let most = SEEN * places.len() as f64;
        let mut seen = 0.0;
        for place in &places {
            seen += matter.seen(*place);
            if seen >= most {
                return None;
            }
        }
        (!places.is_empty()).then(|| seen / places.len() as f64)
    }
}

/// What lies before a surface. Places are in index space.
struct Matter<'a> {
    volume: &'a ScalarVolume,
    transfer: &'a TransferFunction,
    kept: Vec<HalfSpace>,
    /// World length over which opacities are given.
    unit_distance: f64,
    camera: &'a Camera,
}

impl Matter<'_> {
    fn is_kept(&self, at: DVec3) -> bool {
        let most = DVec3::from(self.volume.lattice.dims.map(|n| n as f64)) - 0.5;
        let is_within = at.cmpge(DVec3::splat(-0.5)).all() && at.cmple(most).all();
        is_within && self.kept.iter().all(|half| half.normal.dot(at) >= half.least)
    }

    /// Opacity over a unit distance.
    fn opacity(&self, at: DVec3) -> f64 {
        let value = self.volume.value_at(self.volume.lattice.world_from_index(at));
        // Beside a mesh or points there is nothing; samples of the file that are missing may have an opacity.
        match value.is_nan() && self.volume.own_bounds.is_some() {
            true => 0.0,
            false => self.transfer.opacity_at(value),
        }
    }

    /// Places evenly over a slice, where it cuts matter: what it shows beside that hides nothing from anybody.
    fn places_of_slice(&self, slice: &Slice) -> Vec<DVec3> {
        let lattice = &self.volume.lattice;
        let half = slice.plane.in_index(lattice);
        let dims = DVec3::from(lattice.dims.map(|n| n as f64));
        let middle = (dims - 1.0) / 2.0;
        let middle = middle + half.normal * (half.least - half.normal.dot(middle));
        let (u, v) = half.normal.any_orthonormal_pair();
        let along = |i: usize| ((i as f64 + 0.5) / PLACES as f64 - 0.5) * dims.length();
        let all =
            (0..PLACES * PLACES).map(|i| middle + u * along(i % PLACES) + v * along(i / PLACES));
        let shows = |at: &DVec3| {
            let value = self.volume.value_at(lattice.world_from_index(*at));
            self.is_kept(*at) && !value.is_nan() && self.transfer.opacity_at(value) > 0.0
        };
        all.filter(shows).collect()
    }

    /// Places of an isosurface between samples, few of many.
    fn places_of_isosurface(&self, level: f64) -> Vec<DVec3> {
        let dims = self.volume.lattice.dims;
        let steps = dims.map(|n| n.div_ceil(SAMPLES));
        let strides = [1, dims[0], dims[0] * dims[1]];
        let mut found = Vec::new();
        for z in (0..dims[2]).step_by(steps[2]) {
            for y in (0..dims[1]).step_by(steps[1]) {
                for x in (0..dims[0]).step_by(steps[0]) {
                    let at = [x, y, z];
                    let value = |sample: usize| self.volume.samples.get(sample);
                    let sample: usize = (0..3).map(|axis| at[axis] * strides[axis]).sum();
                    let here = value(sample);
                    for axis in (0..3).filter(|axis| at[*axis] + steps[*axis] < dims[*axis]) {
                        let there = value(sample + steps[axis] * strides[axis]);
                        let share = (level - here) / (there - here);
                        if (0.0..=1.0).contains(&share) {
                            let mut place = DVec3::from(at.map(|i| i as f64));
                            place[axis] += share * steps[axis] as f64;
                            found.push(place);
                        }
                    }
                }
            }
        }
        let every = found.len().div_ceil(MOST_PLACES).max(1);
        found.into_iter().step_by(every).filter(|at| self.is_kept(*at)).collect()
    }

    /// How much of the light of a place comes to the eye, 0..=1.
    fn seen(&self, at: DVec3) -> f64 {
        let lattice = &self.volume.lattice;
        let place = lattice.world_from_index(at);
        let (way, mut left) = match self.camera.eye_distance() {
            None => (-self.camera.direction, f64::INFINITY),
            Some(_) => {
                let way = self.camera.view_origin() - place;
                (way.normalize_or_zero(), way.length())
            }
        };
        let step = lattice.smallest_spacing().max(2.0 * lattice.bounding_radius() / MOST_STEPS);
        let step_in_index = lattice.index_from_world(place + way * step) - at;
        let (mut at, mut depth) = (at, 0.0);
        loop {
            // The matter that touches the surface hides nothing of it.
            at += step_in_index;
            left -= step;
            if left <= 0.0 || depth > OPAQUE || !self.is_kept(at) {
                return if depth > OPAQUE { 0.0 } else { (-depth).exp() };
            }
            depth -= (1.0 - self.opacity(at)).max(0.0).ln() * step / self.unit_distance;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::{Clip, ClipBox, CutFaces};
    use std::borrow::Cow;

    use super::*;
    use crate::scene::{SampleSource, opening};
    use crate::transfer::{ColourMap, ColourSource};
    use crate::volume::{Lattice, Samples};

    /// A ball whose values fall from 1 in its middle to 0 at the ends of the axes, as opaque as said from 0.1 on.
    fn scene(opacity: f64) -> Scene {
        let lattice = Lattice::unit([33; 3]);
        let value = |i: usize| {
            let at = DVec3::from([i % 33, i / 33 % 33, i / 33 / 33].map(|n| n as f64 - 16.0));
            1.0 - at.length() / 16.0
        };
        let samples = Samples::Float64((0..lattice.len()).map(value).collect());
        let volume = ScalarVolume::from_samples("ball", lattice, samples).expect("sound");
        let mut scene = opening(SampleSource::default(), Arc::new(volume), None);
        *scene.transfer_mut().expect("a field") = TransferFunction::of(
            vec![(0.1, 0.0), (0.1, opacity)],
            ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] },
        );
        scene
    }

    #[test]
    fn a_mesh_is_a_body_as_long_as_its_cells_are_opaque_and_it_is_not_faded() {
        let mesh = crate::volume::demo::open("demo:mesh:6", None).expect("a demo");
        let field = mesh.field(None).expect("a field");
        let ticket = crate::core::Ticket::new();
        let volume = mesh.scalar(field, crate::volume::Component::Index(0), &ticket).expect("room");
        let mut body = opening(SampleSource::default(), Arc::new(volume), None);
        let opacities = |scene: &mut Scene, most: f64| {
            let transfer = scene.transfer_mut().expect("a field");
            transfer.opacity = vec![(0.0, most)];
            scene.is_opaque_body()
        };
        assert!(opacities(&mut body, 0.9) && !opacities(&mut body, 0.1));
        assert!(!opacities(&mut scene(0.9), 0.9), "a volume of samples is looked through");
        body.inside.along = AlongRay::Maximum;
        assert!(!opacities(&mut body, 0.9), "nothing of a slice is shown");
        body.inside.along = AlongRay::Composite;
        assert!(opacities(&mut body, 0.9) && body.uncover([DVec3::ZERO].into_iter()));
        assert!(!opacities(&mut body, 0.9), "it was faded already");
        assert!(!body.uncover([DVec3::ZERO].into_iter()), "and is not faded again");
    }

    #[test]
    fn what_lies_in_opaque_matter_is_hidden_until_it_is_cut_open_or_clear() {
        let lattice = Lattice::unit([33; 3]);
        let slice = Slice::across(&lattice, 2, 0.5, 1.0);
        let inner = Isosurface { value: 0.6, opacity: 1.0, colour: None };
        let outer = Isosurface { value: 0.05, ..inner };
        let mut scene = scene(1.0);
        let hides = |scene: &Scene, slice: &Slice| scene.little_seen_of_slice(slice);
        assert!(hides(&scene, &slice).is_some_and(|seen| seen < 0.15));
        assert!(scene.little_seen_of_isosurface(&inner).is_some_and(|seen| seen < 1e-3));
        assert_eq!(scene.little_seen_of_isosurface(&outer), None, "it lies about the matter");
        let edge = Slice::across(&lattice, 2, 0.02, 1.0);
        assert_eq!(hides(&scene, &edge), None, "it cuts no matter");
        let dense = scene.drawn_transfer().map(Cow::into_owned);
        assert!(scene.can_fade());
        scene.fade(true);
        assert_eq!(hides(&scene, &slice), None, "faded");
        assert!(!scene.can_fade() && scene.transfer() == dense.as_ref(), "the curve stays");
        let faded = scene.drawn_transfer().map(|transfer| transfer.most_opacity());
        assert_eq!(faded, dense.as_ref().map(|transfer| FADED * transfer.most_opacity()));
        scene.fade(false);
        assert_eq!(scene.drawn_transfer().map(Cow::into_owned), dense);
        let beside = Slice::across(&lattice, 2, 3.0, 1.0);
        let clear = Slice { opacity: 0.0, ..slice };
        let both = [beside, clear].map(|slice| hides(&scene, &slice));
        assert_eq!(both, [None; 2], "for other reasons");
        // Clipped from above to less than a sample from the slice, and seen from there.
        scene.camera.direction = DVec3::NEG_Z;
        let bounds = Some(ClipBox { high: [1.0, 1.0, 0.52], ..ClipBox::WHOLE });
        scene.inside.clip = Clip { bounds, planes: Vec::new(), faces: CutFaces::Through };
        assert_eq!(hides(&scene, &slice), None);
        scene.camera.direction = DVec3::Z;
        assert!(hides(&scene, &slice).is_some(), "from below");
        scene.show_field(false);
        assert_eq!(hides(&scene, &slice), None, "no field");
        let thin = self::scene(0.05);
        assert_eq!(hides(&thin, &slice), None);
        assert_eq!(thin.little_seen_of_isosurface(&inner), None);
    }
}
