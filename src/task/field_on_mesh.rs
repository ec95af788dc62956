//! The field's values at the corners of polygons that are drawn in its colours (Jang, section 6: "mapping of the reconstructed
//! data onto the surface of a related geometry").

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::probe::probe_of;
use crate::core::memory::TooLarge;
use crate::core::{Cancelled, Ticket, counted, mapped};
use crate::polygons::{Mesh, MeshArray, MeshError, MeshValues};
use crate::reference::Probe;
use crate::scene::{FieldOnMesh, MeshInField, Scene};
use crate::volume::Lattice;

/// Triangles at most that a mesh is cut into.
const MOST: usize = 1 << 19;
/// How much longer edges may be where those of a sample's length would make more triangles, again and again.
const COARSER: f64 = 1.5;
/// How far beside a corner its value is looked for where none is in its place, as a part of the distance of samples: on the
/// border of the field corners lie beside it by rounding.
const NUDGE: f64 = 1e-3;
/// Corners that are valued between two looks at the ticket.
const A_PART: usize = 4096;

/// Why there are no values.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FieldOnMeshError {
    /// The field does not fit into memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// It was told to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Values are not as many as corners: a bug of ours.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// What was found for a mesh.
#[derive(Debug)]
pub struct Found {
    /// To be given to the scene.
    pub values: FieldOnMesh,
    /// What of it people are to know, in one sentence.
    pub told: Option<String>,
}

/// The values that polygons of a scene lack ([`Scene::lacking_field_values`]). Their triangles are cut first until no edge in the
/// field's box is longer than the smallest distance of samples, or than so many triangles allow, which is told.
///
/// # Errors
/// See [`FieldOnMeshError`].
pub fn field_on_meshes(scene: &Scene, ticket: &Ticket) -> Result<Vec<Found>, FieldOnMeshError> {
    let lacking = scene.lacking_field_values();
    let Some(volume) = scene.volume().filter(|_| !lacking.is_empty()) else {
        return Ok(Vec::new());
    };
    let Some(probe) = probe_of(scene)? else { return Ok(Vec::new()) };
    let area = Area::of(&volume.lattice);
    let found = lacking.into_iter().filter_map(|of| {
        let mesh = of.mesh()?;
        Some(on_mesh(&probe, &volume.name, (&area, &*mesh, of), ticket))
    });
    found.collect()
}

fn on_mesh(
    probe: &Probe,
    name: &str,
    (area, mesh, of): (&Area, &Mesh, MeshInField),
    ticket: &Ticket,
) -> Result<Found, FieldOnMeshError> {
    let mut longest = area.finest;
    let cut = loop {
        if ticket.is_cancelled() {
            return Err(Cancelled.into());
        }
        match mesh.with_short_edges(|ends| area.is_long(ends, longest), MOST) {
            Some(cut) => break cut,
            None => longest *= COARSER,
        }
    };
    let told = (longest > area.finest).then(|| {
        format!(
            "{}: its colours are of the field at corners up to {} samples apart; finer ones would make more than {}",
            mesh.name(),
            (longest / area.finest * 10.0).round() / 10.0,
            counted(MOST, "triangle"),
        )
    });
    let places = cut.places();
    let value = |i: usize| value_at(probe, places[i], area.finest * NUDGE);
    let values = mapped(places.len(), A_PART, value, ticket)?;
    let array = MeshArray { name: name.to_owned(), values: MeshValues::Corners(values) };
    let mesh = Arc::new(cut.with_arrays(vec![array])?);
    Ok(Found { values: FieldOnMesh { of, mesh }, told })
}

/// The value at a place, or as near to it as makes no difference; NaN without any.
#[expect(clippy::cast_possible_truncation, reason = "colours have 8 bits")]
fn value_at(probe: &Probe, place: DVec3, nudge: f64) -> f32 {
    let beside = DVec3::AXES.into_iter().flat_map(|axis| [axis * nudge, -axis * nudge]);
    let mut places = std::iter::once(place).chain(beside.map(|by| place + by));
    places.find_map(|place| probe.value(place)).unwrap_or(f64::NAN) as f32
}

/// Where a field has values.
struct Area {
    lattice: Lattice,
    axes: DMat3,
    inverse: DMat3,
    /// The smallest distance of samples.
    finest: f64,
}

impl Area {
    fn of(lattice: &Lattice) -> Self {
        let (axes, finest) = (lattice.axes(), lattice.smallest_spacing());
        Self { lattice: *lattice, axes, inverse: axes.inverse(), finest }
    }

    /// Whether an edge is longer than this, and a triangle of which it is the longest may reach the box of the samples: no place
    /// in that is farther from the edge's middle than the edge is long.
    fn is_long(&self, [from, to]: [DVec3; 2], longest: f64) -> bool {
        let length = (to - from).length();
        length > longest && self.beside((from + to) / 2.0) < length
    }

    /// How far a place lies from the box of the samples.
    fn beside(&self, place: DVec3) -> f64 {
        let index = self.inverse * (place - self.lattice.origin);
        let last = DVec3::from(self.lattice.dims.map(|n| n as f64)) - 0.5;
        (self.axes * (index - index.clamp(DVec3::splat(-0.5), last))).length()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{PolygonLayer, SampleSource, opening};
    use crate::volume::{Samples, ScalarVolume};

    /// Values that no spline bends: x + 2 y − z of the world.
    fn ramp(world: DVec3) -> f64 {
        world.dot(DVec3::new(1.0, 2.0, -1.0))
    }

    /// A plane through a field of 8³ samples half a unit apart, far larger than this.
    fn scene() -> Scene {
        let spacing = DVec3::splat(0.5);
        let lattice =
            Lattice { spacing, origin: DVec3::new(10.0, -3.0, 2.0), ..Lattice::unit([8; 3]) };
        let at = |i: usize| DVec3::from([i % 8, i / 8 % 8, i / 64].map(|n| n as f64));
        let samples = (0..lattice.len()).map(|i| ramp(lattice.world_from_index(at(i)))).collect();
        let volume = ScalarVolume::from_samples("v", lattice, Samples::Float64(samples)).unwrap();
        let mut scene = opening(SampleSource::made("v"), Arc::new(volume), None);
        let corner = |x: f32, y: f32| Vec3::new(11.0 + x, -2.0 + y, 3.0 + 0.1 * x);
        let corners = vec![corner(-40.0, -40.0), corner(60.0, -40.0), corner(0.0, 70.0)];
        let mesh = Mesh::new("plane", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]);
        let mut layer = PolygonLayer::new(Arc::new(mesh.unwrap()));
        layer.look.by_field = true;
        scene.add(SampleSource::made("plane"), layer);
        scene
    }

    #[test]
    fn corners_are_a_sample_apart_in_the_field_and_have_its_value_there() {
        let scene = scene();
        let found = field_on_meshes(&scene, &Ticket::new()).unwrap();
        let [Found { values, told: None }] = &found[..] else { panic!("{found:?}") };
        let mesh = &values.mesh;
        let volume = scene.volume().unwrap();
        let area = Area::of(&volume.lattice);
        assert_eq!(mesh.arrays()[0].name, "v");
        let (mut inside, mut beside) = (0, 0);
        for (triangle, values) in mesh.triangles(false).zip(mesh.values(0)) {
            let corners = triangle.corners.map(|corner| mesh.origin() + corner.as_dvec3());
            for (i, (corner, value)) in corners.into_iter().zip(values).enumerate() {
                assert!(!area.is_long([corner, corners[(i + 1) % 3]], area.finest));
                // Half a sample is kept from the border, where splines are bent.
                let index = volume.lattice.index_from_world(corner);
                if index.cmpge(DVec3::splat(-0.49)).all() && index.cmple(DVec3::splat(7.49)).all() {
                    assert!(!value.is_nan(), "{corner}");
                }
                if index.cmpge(DVec3::splat(1.5)).all() && index.cmple(DVec3::splat(5.5)).all() {
                    inside += 1;
                    // Mirrored borders bend the splines, less by a factor of 0.27 with each sample;
                    // the values themselves are up to 10.
                    let off = (f64::from(value) - ramp(corner)).abs();
                    assert!(off < 0.1, "{corner}: {value}");
                }
                beside += usize::from(value.is_nan());
            }
        }
        assert!(inside > 50 && beside > 0, "{inside} {beside}");
        // What lies beside the field is not cut as finely: a plane of 100 units would be some 40 000 triangles.
        assert!(mesh.len() < 3000, "{}", mesh.len());
    }

    #[test]
    fn a_mesh_that_would_be_too_many_triangles_is_cut_more_coarsely_and_that_is_told() {
        let lattice = Lattice::unit([2048, 2048, 1]);
        let area = Area::of(&lattice);
        let corners = vec![Vec3::ZERO, Vec3::X * 2047.0, Vec3::Y * 2047.0];
        let mesh = Mesh::new("plane", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]).unwrap();
        assert!(mesh.with_short_edges(|ends| area.is_long(ends, area.finest), MOST).is_none());
        let scene = scene();
        let probe = probe_of(&scene).unwrap().expect("a field");
        let of = scene.lacking_field_values().remove(0);
        let found = on_mesh(&probe, "density", (&area, &mesh, of), &Ticket::new()).unwrap();
        let count = found.values.mesh.len();
        assert!((MOST / 8..=MOST).contains(&count), "{count}");
        let told = found.told.expect("it is coarser");
        assert!(told.starts_with("plane: ") && told.contains("samples apart"), "{told}");
    }

    #[test]
    fn a_cancelled_search_gives_nothing() {
        let ticket = Ticket::new();
        ticket.cancel();
        let refused = field_on_meshes(&scene(), &ticket);
        assert!(matches!(refused, Err(FieldOnMeshError::Cancelled(_))), "{refused:?}");
    }
}
