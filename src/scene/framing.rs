//! What a view shows: all that can be seen of a scene fills the frame.

use std::sync::Arc;

use glam::DVec3;

use super::{ClipBox, Scene, Slice, framing_camera};
use crate::core::parallel;
use crate::core::{Camera, Projection};
use crate::polygons::Mesh;
use crate::transfer::TransferFunction;
use crate::volume::{Lattice, ScalarVolume};

/// Samples that are looked at to find what of a volume shows, at most.
const MOST_LOOKED_AT: usize = 1 << 19;
/// Bins of what shows along a direction.
const BINS: usize = 1024;
/// The part of what shows that may lie beyond the frame at either side: single voxels of noise.
const BEYOND: f64 = 5e-4;
/// How many times wider a view becomes at most so that surfaces about a field are in it: those that are larger are walls, or in
/// another unit.
const MOST_WIDER: f64 = 16.0;
/// Opacity from which matter counts as seen in full.
const SEEN: f64 = 0.05;

/// Whether no value of a range is hidden.
fn shows_all(transfer: &TransferFunction, [low, high]: [f64; 2]) -> bool {
    let within = transfer.breakpoints().into_iter().filter(|value| (low..=high).contains(value));
    within.chain([low, high]).all(|value| transfer.opacity_at(value) > 0.0)
}

/// Every which sample along each axis is looked at.
fn step_between_looked_at(lattice: &Lattice) -> usize {
    (lattice.len() as f64 / MOST_LOOKED_AT as f64).cbrt().ceil().max(1.0) as usize
}

/// Where what shows of a volume lies along three unit directions, from the lattice's middle, world units; `None` where
/// nothing does. Opacities are those of a transfer function, and single voxels apart do not count.
fn shown(
    volume: &ScalarVolume,
    transfer: &TransferFunction,
    along: [DVec3; 3],
) -> Option<[[f64; 2]; 3]> {
    let lattice = volume.lattice;
    let step = step_between_looked_at(&lattice);
    let [nx, ny, nz] = lattice.dims;
    let (centre, reach) = (lattice.centre(), lattice.bounding_radius());
    // The first of each row, column and layer that is looked at, so that what is left out is shared by both ends.
    let first = lattice.dims.map(|n| ((n - 1) % step) / 2);
    let bins_of_layer = |z: usize| {
        let mut bins = vec![[0.0_f64; 3]; BINS];
        for y in (first[1]..ny).step_by(step) {
            for x in (first[0]..nx).step_by(step) {
                let alpha = transfer.opacity_at(volume.samples.get((z * ny + y) * nx + x));
                if alpha > 0.0 {
                    let at = lattice.world_from_index(DVec3::new(x as f64, y as f64, z as f64));
                    for (axis, along) in along.iter().enumerate() {
                        let place = 0.5 + 0.5 * along.dot(at - centre) / reach;
                        #[expect(
                            clippy::cast_possible_truncation,
                            clippy::cast_sign_loss,
                            reason = "within the bins"
                        )]
                        let bin = (place * BINS as f64).clamp(0.0, BINS as f64 - 1.0) as usize;
                        bins[bin][axis] += (alpha / SEEN).min(1.0);
                    }
                }
            }
        }
        bins
    };
    let layers: Vec<usize> = (first[2]..nz).step_by(step).collect();
    let add = |mut sum: Vec<[f64; 3]>, layer: Vec<[f64; 3]>| {
        let both = sum.iter_mut().flatten().zip(layer.into_iter().flatten());
        both.for_each(|(sum, more)| *sum += more);
        sum
    };
    let of_layer = |i: usize| bins_of_layer(layers[i]);
    let bins = parallel::merged(layers.len(), || vec![[0.0; 3]; BINS], of_layer, add);
    // A sample stands for those that were left out about it, as far as the ends of the outermost one's box.
    let axes = lattice.axes();
    let ends = [0, 1, 2].map(|axis| {
        let all: f64 = bins.iter().map(|bin| bin[axis]).sum();
        let end = |bins: &mut dyn Iterator<Item = (usize, &[f64; 3])>| {
            let mut sum = 0.0;
            let mut beyond = bins.skip_while(|(_, bin)| {
                sum += bin[axis];
                sum <= BEYOND * all
            });
            beyond.next().map(|(bin, _)| bin as f64)
        };
        let [low, high] =
            [end(&mut bins.iter().enumerate())?, end(&mut bins.iter().enumerate().rev())? + 1.0];
        let half = (step as f64 - 0.5) * (axes.transpose() * along[axis]).abs().element_sum();
        let from_middle = |bin: f64| (2.0 * bin / BINS as f64 - 1.0) * reach;
        Some([from_middle(low) - half, from_middle(high) + half])
    });
    let [Some(x), Some(y), Some(z)] = ends else { return None };
    Some([x, y, z])
}

/// The box along a volume's own axes that holds what shows of it under a transfer function; where nothing does, all of it. Where
/// samples lie on a lattice that was made over a mesh or points, its sides are those of all of these where nothing of them is hidden.
pub fn box_of_what_shows(volume: &ScalarVolume, transfer: &TransferFunction) -> ClipBox {
    let lattice = &volume.lattice;
    let index_from_world = lattice.axes().inverse();
    let rows = [0, 1, 2].map(|axis| index_from_world.row(axis));
    let Some(ends) = shown(volume, transfer, rows.map(DVec3::normalize_or_zero)) else {
        return ClipBox::WHOLE;
    };
    let is_there = TransferFunction { opacity: vec![(0.0, 1.0)], ..transfer.clone() };
    let own = volume.own_bounds.and_then(|_| shown(volume, &is_there, DVec3::AXES));
    let share = |axis: usize, end: usize| {
        // Made lattices lie along the axes of the world. What is thin counts less, which moves an end a little.
        let inset = own.map(|own| (ends[axis][end] - own[axis][end]) * [1.0, -1.0][end]);
        if inset.is_some_and(|inset| inset < 2.0 * lattice.spacing[axis]) {
            return [0.0, 1.0][end];
        }
        let samples = ends[axis][end] * rows[axis].length();
        (0.5 + samples / lattice.dims[axis] as f64).clamp(0.0, 1.0)
    };
    ClipBox {
        low: [0, 1, 2].map(|axis| share(axis, 0)),
        high: [0, 1, 2].map(|axis| share(axis, 1)),
    }
}

/// The box along a volume's own axes that holds every sample of it that shows, and what lies up to the next ones, as far as few of many
/// samples tell; where nothing shows, and about a mesh or points, all of it.
pub fn box_of_all_that_shows(volume: &ScalarVolume, transfer: &TransferFunction) -> ClipBox {
    if volume.own_bounds.is_some() {
        return ClipBox::WHOLE;
    }
    let lattice = &volume.lattice;
    let step = step_between_looked_at(lattice);
    let [nx, ny, nz] = lattice.dims;
    let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
    for z in (0..nz).step_by(step) {
        for y in (0..ny).step_by(step) {
            for x in (0..nx).step_by(step) {
                let value = volume.samples.get((z * ny + y) * nx + x);
                if transfer.opacity_at(value) > 0.0 {
                    for (axis, at) in [x, y, z].into_iter().enumerate() {
                        low[axis] = low[axis].min(at);
                        high[axis] = high[axis].max(at);
                    }
                }
            }
        }
    }
    if low[0] == usize::MAX {
        return ClipBox::WHOLE;
    }
    let share = |at: f64, axis: usize| (at / lattice.dims[axis] as f64).clamp(0.0, 1.0);
    ClipBox {
        low: [0, 1, 2].map(|axis| share(low[axis] as f64 - step as f64, axis)),
        high: [0, 1, 2].map(|axis| share((high[axis] + step + 1) as f64, axis)),
    }
}

/// Where what shows of a volume lies along three unit directions, from the lattice's middle; `None` where nothing does.
fn ends_of_field(
    volume: &ScalarVolume,
    transfer: &TransferFunction,
    along: [DVec3; 3],
) -> Option<[[f64; 2]; 3]> {
    let corners = || {
        let cells = volume.cells.as_ref()?;
        // Samples miss the corners of cells, which are known where nothing of these is hidden.
        shows_all(transfer, cells.range()?).then(|| cells.ends(along, volume.lattice.centre()))?
    };
    corners().or_else(|| shown(volume, transfer, along))
}

/// A camera that shows in perspective what it shows in parallel rays: what is nearer to the eye than the focal point looks larger, so
/// that it takes a wider view. One of parallel rays is as it was.
///
/// What lies `h` nearer than the focal point is seen in a part (d − h)/d of the view's half height s there, with d = s/tan(α/2): it
/// shows where s is wider by h tan(α/2). No more is asked for than a sphere about all of the lattice takes, s/cos(α/2).
pub fn in_perspective(scene: &Scene, camera: Camera) -> Camera {
    let Projection::Perspective { view_angle } = camera.projection else { return camera };
    let along = [camera.right(), camera.up, camera.direction];
    let focal = camera.direction.dot(camera.focal_point);
    let lattice = scene.lattice();
    let field = scene.volume().zip(scene.transfer()).filter(|_| scene.shows_field());
    let of_field = field.and_then(|(volume, transfer)| ends_of_field(volume, transfer, along));
    let of_field = of_field.map(|ends| ends[2][0] + camera.direction.dot(lattice.centre()));
    let of_surfaces = ends_of_surfaces(scene, along, |mesh| scene.may_reach(mesh.bounds()));
    let nearest = of_field.into_iter().chain(of_surfaces.map(|ends| ends[2][0]));
    let nearest = nearest.fold(focal, f64::min);
    let whole = lattice.bounding_radius() + lattice.centre().distance(camera.focal_point);
    let wide = camera.parallel_scale + (focal - nearest) * (view_angle / 2.0).tan();
    let sphere = whole.max(camera.parallel_scale) / (view_angle / 2.0).cos();
    let parallel_scale = if of_surfaces.is_none() { wide.min(sphere) } else { wide };
    Camera { parallel_scale, ..camera }
}

/// Of half of a picture, the part that the box with its axes takes, so that there is room for their numbers.
const AXES_WITHIN: f64 = 0.84;

/// A camera that shows the box that axes are drawn about, with room for their numbers.
pub fn among_axes(scene: &Scene, camera: Camera) -> Camera {
    let ends = scene.lattice().world_bounds();
    let corner = |i: usize| DVec3::from([0, 1, 2].map(|axis| ends[i >> axis & 1][axis]));
    let is_within = |camera: &Camera| {
        (0..8).all(|i| {
            let pixel = camera.pixel_from_view(camera.to_view(corner(i)), [2.0; 2]);
            pixel.is_some_and(|pixel| (pixel - 1.0).abs().max_element() <= AXES_WITHIN)
        })
    };
    // In small steps, since in perspective the eye moves, too.
    let mut found = camera;
    while !is_within(&found) && found.parallel_scale < 100.0 * camera.parallel_scale {
        found.parallel_scale *= 1.01;
    }
    found
}

/// A camera along `direction` that shows all that can be seen of a volume under a transfer function, with a margin of a
/// twentieth, in any picture at least as wide as it is high; where nothing shows, the whole lattice.
pub fn framing_what_shows(
    volume: &ScalarVolume,
    transfer: &TransferFunction,
    direction: DVec3,
    up: DVec3,
) -> Camera {
    let whole = framing_camera(&volume.lattice, direction, up);
    let along = [whole.right(), whole.up, whole.direction];
    let Some(ends) = ends_of_field(volume, transfer, along) else { return whole };
    let halves = ends.map(|[low, high]| 0.5 * (high - low));
    let offset: DVec3 =
        along.iter().zip(ends).map(|(&axis, [low, high])| axis * (0.5 * (low + high))).sum();
    let parallel_scale = 1.05 * halves[0].max(halves[1]);
    Camera {
        focal_point: volume.lattice.centre() + offset,
        parallel_scale: parallel_scale.min(whole.parallel_scale),
        ..whole
    }
}

/// The same of all that is seen of a scene: of its field, or of the whole lattice where there are vectors in its place, and of
/// the surfaces among them; of surfaces by themselves all of these.
pub fn framing_all(scene: &Scene, direction: DVec3, up: DVec3) -> Camera {
    let field = scene.volume().zip(scene.transfer()).filter(|_| scene.shows_field());
    let whole = || framing_camera(&scene.lattice(), direction, up);
    match field {
        Some((volume, transfer)) => {
            among_surfaces(scene, framing_what_shows(volume, transfer, direction, up))
        }
        None if scene.vectors().is_empty() => {
            framing_surfaces(scene, direction, up).unwrap_or_else(whole)
        }
        None => among_surfaces(scene, whole()),
    }
}

/// A camera that shows the surfaces of a scene, too: as it is where they are in its picture, otherwise about them and what it
/// showed. Those that lie beside the volume ([`Scene::may_reach`]) or reach very far beyond it are left where they are: with all of
/// them in sight little could be made out.
pub fn among_surfaces(scene: &Scene, camera: Camera) -> Camera {
    let along = [camera.right(), camera.up, camera.direction];
    let reaches = |mesh: &Mesh| scene.may_reach(mesh.bounds());
    let Some(ends) = ends_of_surfaces(scene, along, reaches) else { return camera };
    let middle = along.map(|axis| axis.dot(camera.focal_point));
    let is_within = |half: f64, axis: usize| {
        ends[axis][0] >= middle[axis] - half && ends[axis][1] <= middle[axis] + half
    };
    if [0, 1].iter().all(|axis| is_within(camera.parallel_scale, *axis)) {
        return camera;
    }
    let own = camera.parallel_scale / 1.05;
    let ends = [0, 1, 2]
        .map(|axis| [ends[axis][0].min(middle[axis] - own), ends[axis][1].max(middle[axis] + own)]);
    let (focal_point, parallel_scale) = about(along, ends);
    if parallel_scale > MOST_WIDER * camera.parallel_scale {
        return camera;
    }
    Camera { focal_point, parallel_scale, ..camera }
}

/// Where surfaces lie along three axes, of meshes those that `counts`, and of slices those that show more than the field does;
/// `None` without any.
fn ends_of_surfaces(
    scene: &Scene,
    along: [DVec3; 3],
    counts: impl Fn(&Mesh) -> bool,
) -> Option<[[f64; 2]; 3]> {
    let meshes = scene.polygons().into_iter().map(|layer| layer.mesh);
    let meshes: Vec<Arc<Mesh>> = meshes.filter(|mesh| counts(mesh.as_ref())).collect();
    let of_meshes = meshes.iter().flat_map(|mesh| mesh.framed_places());
    let lattice = scene.lattice();
    let inside = scene.inside_in_place().shown_by(&scene.splat);
    let is_seen = |slice: &&Slice| slice.opacity > 0.0 && !slice.only_shown && scene.shows_field();
    let of_slices = inside.slices.iter().filter(is_seen).flat_map(|slice| {
        let outline = slice.plane.outline(&lattice).into_iter();
        outline.map(|corner| lattice.world_from_index(corner))
    });
    let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for place in of_meshes.chain(of_slices) {
        for (ends, along) in ends.iter_mut().zip(along) {
            let at = along.dot(place);
            *ends = [ends[0].min(at), ends[1].max(at)];
        }
    }
    ends.iter().all(|[low, high]| low <= high).then_some(ends)
}

/// The middle of what lies between ends along three axes, and half the height of a view that shows all of it, with a margin of
/// a twentieth.
fn about(along: [DVec3; 3], ends: [[f64; 2]; 3]) -> (DVec3, f64) {
    let halves = ends.map(|[low, high]| 0.5 * (high - low));
    let middle = along.iter().zip(ends).map(|(&axis, [low, high])| axis * (0.5 * (low + high)));
    (middle.sum(), 1.05 * halves[0].max(halves[1]))
}

/// The same of the surfaces that are drawn, for scenes of nothing else; `None` without any.
pub fn framing_surfaces(scene: &Scene, direction: DVec3, up: DVec3) -> Option<Camera> {
    let whole = framing_camera(&scene.lattice(), direction, up);
    let along = [whole.right(), whole.up, whole.direction];
    let ends = ends_of_surfaces(scene, along, |_| true)?;
    let (focal_point, parallel_scale) = about(along, ends);
    (parallel_scale > 0.0).then_some(Camera { focal_point, parallel_scale, ..whole })
}

#[cfg(test)]
mod tests {
    use crate::scene::PolygonLayer;
    use std::sync::Arc;

    use super::*;
    use crate::core::Ticket;
    use crate::scene::{NamedView, Orientation, SampleSource, opening};
    use crate::transfer::{ColourMap, ColourSource};
    use crate::volume::{Association, Component, Field, Grid, Samples, Shape};

    #[test]
    fn all_of_a_range_shows_where_no_value_has_no_opacity() {
        let shows = |opacity: &[(f64, f64)], range| {
            let colour = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] };
            shows_all(&TransferFunction::of(opacity.to_vec(), colour), range)
        };
        let dip = [(0.0, 1.0), (1.0, 0.0), (2.0, 1.0)];
        assert!(shows(&[(0.0, 0.5), (2.0, 0.1)], [0.0, 2.0]));
        assert!(!shows(&dip, [0.5, 1.5]) && shows(&dip, [1.1, 2.0]) && !shows(&dip, [1.0, 2.0]));
    }

    #[test]
    fn all_corners_of_cells_are_framed() {
        let places = (0..8).map(|i| DVec3::from([i & 1, i >> 1 & 1, i >> 2].map(f64::from)));
        let leaning = |p: DVec3| DVec3::new(p.x + 0.5 * p.y, p.y, 3.0 * p.z);
        let shape = Shape::Curvilinear(places.clone().map(leaning).collect());
        let samples = Arc::new(Samples::Float64((1..=8).map(f64::from).collect()));
        let field =
            Field { name: "v".to_owned(), components: 1, association: Association::Point, samples };
        let grid = Grid::shaped([2; 3], shape, vec![field]).expect("a grid");
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
        let volume = volume.expect("a volume");
        let colour = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] };
        let transfer = TransferFunction::of(vec![(0.0, 1.0)], colour);
        for view in NamedView::ALL {
            let (direction, up) = view.direction_and_up(Orientation::of(None));
            let camera = framing_what_shows(&volume, &transfer, direction, up);
            let pixel = |p: DVec3| camera.pixel_from_view(camera.to_view(leaning(p)), [100.0; 2]);
            let pixels: Vec<_> = places.clone().filter_map(pixel).collect();
            let all = pixels.iter().flat_map(|pixel| pixel.to_array());
            let [least, most] =
                all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
            assert!(
                (2.0..2.8).contains(&least) && (97.2..98.0).contains(&most),
                "{view:?}: {least} {most}"
            );
            // In perspective, too, whatever its angle, and not much smaller.
            let source = SampleSource::default();
            let mut scene = opening(source, Arc::new(volume.clone()), None);
            *scene.transfer_mut().expect("a field") = transfer.clone();
            for degrees in [5.0_f64, 40.0, 60.0, 90.0] {
                let projection = Projection::Perspective { view_angle: degrees.to_radians() };
                let wider = in_perspective(&scene, Camera { projection, ..camera });
                let offset = |p: DVec3| {
                    let pixel = wider.pixel_from_view(wider.to_view(leaning(p)), [100.0; 2]);
                    let pixel = pixel.expect("before the eye");
                    (pixel.x - 50.0).abs().max((pixel.y - 50.0).abs())
                };
                let most = places.clone().map(offset).fold(0.0, f64::max);
                assert!((28.0..50.0).contains(&most), "{view:?} {degrees}: {most}");
            }
            assert_eq!(in_perspective(&scene, camera), camera);
            // The box goes around the corners, which lean to one side.
            let wide = among_axes(&scene, camera);
            assert!((1.0..1.9).contains(&(wide.parallel_scale / camera.parallel_scale)));
            for place in scene.lattice().world_bounds() {
                let pixel = wide.pixel_from_view(wide.to_view(place), [100.0; 2]);
                let off = (pixel.expect("before the eye") - 50.0).abs().max_element();
                assert!(off <= 42.001, "{view:?}: {off}");
            }
        }
    }

    /// Axes are drawn about the box along the world's axes, which holds a tilted lattice and more.
    #[test]
    fn the_axes_of_a_tilted_scan_lie_within_the_view() {
        let tilt = glam::DMat3::from_rotation_z(0.5) * glam::DMat3::from_rotation_x(0.7);
        let lattice = Lattice { direction: tilt, ..Lattice::unit([60, 20, 20]) };
        let samples = Samples::UInt8(vec![1; lattice.len()]);
        let volume = ScalarVolume::from_samples("tilted", lattice, samples).expect("sound");
        let scene = opening(SampleSource::default(), Arc::new(volume), None);
        for view in NamedView::ALL {
            let (direction, up) = view.direction_and_up(Orientation::default());
            let camera = among_axes(&scene, framing_all(&scene, direction, up));
            let [low, high] = lattice.world_bounds();
            let most = (0..8).map(|i| {
                let corner = [0, 1, 2].map(|axis| [low, high][i >> axis & 1][axis]);
                let view = camera.to_view(DVec3::from(corner));
                let pixel = camera.pixel_from_view(view, [100.0; 2]).expect("before the eye");
                (pixel - 50.0).abs().max_element()
            });
            let most = most.fold(0.0, f64::max);
            assert!((35.0..42.001).contains(&most), "{view:?}: {most}");
        }
    }

    #[test]
    fn surfaces_that_reach_beyond_a_field_are_framed_with_it() {
        let lattice = Lattice::unit([10; 3]);
        let samples = Samples::UInt8((0..1000).map(|i| (i % 251) as u8).collect());
        let volume =
            Arc::new(ScalarVolume::from_samples("block", lattice, samples).expect("sound"));
        let alone = opening(Default::default(), volume, None);
        let (direction, up) = NamedView::Front.direction_and_up(Orientation::default());
        let own = framing_all(&alone, direction, up);
        let triangle = |at: DVec3, size: f64| {
            let corners = [at, at + DVec3::X * size, at + DVec3::Z * size];
            let corners = corners.map(|corner| corner.as_vec3()).to_vec();
            let mesh = Mesh::new("t", corners, Vec::new(), Vec::new(), vec![[0, 1, 2]]);
            PolygonLayer::new(Arc::new(mesh.expect("a triangle")))
        };
        let with = |at: DVec3, size: f64| {
            framing_all(&alone.clone().with(triangle(at, size)), direction, up)
        };
        assert_eq!(with(DVec3::splat(3.0), 2.0), own, "within it");
        // Near enough for both to be in a view that is not too wide.
        assert_eq!(with(DVec3::splat(40.0), 2.0), own, "beside it");
        assert_eq!(with(DVec3::splat(-500.0), 1000.0), own, "a wall");
        let camera = with(DVec3::splat(4.0), 30.0);
        // From the block's lower end to the triangle's upper one, along x and z.
        let low = own.focal_point - own.parallel_scale / 1.05;
        let (middle, half) = ((low + 34.0) / 2.0, (DVec3::splat(34.0) - low) / 2.0);
        assert!((camera.parallel_scale - 1.05 * half.x.max(half.z)).abs() < 1e-4, "{camera:?}");
        let off = camera.focal_point - middle;
        assert!(off.x.abs() < 1e-4 && off.z.abs() < 1e-4, "{camera:?}");
        assert_eq!(among_surfaces(&alone, camera), camera, "there are none");
    }

    /// A ball of some radius about a place fills the frame, wherever and however small it is, and single voxels far
    /// from it change nothing.
    #[test]
    fn the_frame_is_filled_by_what_shows() {
        let spacing = DVec3::new(1.0, 1.0, 1.6);
        let lattice = Lattice { spacing, ..Lattice::unit([90, 80, 50]) };
        let transfer = TransferFunction::of(
            vec![(100.0, 0.0), (101.0, 0.5)],
            ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 255.0] },
        );
        for (middle, radius) in [([45.0, 40.0, 25.0], 30.0), ([25.0, 52.0, 20.0], 12.0)] {
            let middle = lattice.world_from_index(DVec3::from(middle));
            let value = |i: usize| {
                let at = [i % 90, i / 90 % 80, i / 7200].map(|n| n as f64);
                let far = (lattice.world_from_index(DVec3::from(at)) - middle).length();
                if far <= radius || i == 3 || i == lattice.len() - 5 { 200 } else { 10 }
            };
            let samples = Samples::UInt8((0..lattice.len()).map(value).collect());
            let volume = ScalarVolume::from_samples("ball", lattice, samples).expect("sound");
            for view in NamedView::ALL {
                let (direction, up) = view.direction_and_up(Orientation::default());
                let camera = framing_what_shows(&volume, &transfer, direction, up);
                let off = (camera.focal_point - middle).length();
                assert!(off < 1.6, "{view:?}: off by {off}");
                let filled = radius / camera.parallel_scale;
                assert!((0.86..1.0).contains(&filled), "{view:?}: {filled}");
            }
            // Where nothing shows, all of it is framed.
            let nothing = TransferFunction { opacity: vec![(0.0, 0.0)], ..transfer.clone() };
            let whole = framing_what_shows(&volume, &nothing, DVec3::Y, DVec3::Z);
            assert_eq!(whole, framing_camera(&lattice, DVec3::Y, DVec3::Z));
        }
    }

    /// The frame cut labels off where not every sample was looked at, and boxes of thick slices with them.
    #[test]
    fn the_box_of_all_that_shows_cuts_no_sample_that_shows() {
        let lattice = Lattice::unit([12, 10, 8]);
        let mut values = vec![0.0_f32; lattice.len()];
        // One far from all others.
        for [x, y, z] in [[3, 4, 2], [4, 4, 2], [9, 5, 6]] {
            values[(z * 10 + y) * 12 + x] = 1.0;
        }
        let samples = Samples::Float32(values);
        let volume = ScalarVolume::from_samples("specks", lattice, samples).expect("sound");
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 1.0] };
        let transfer = TransferFunction::of(vec![(0.5, 0.0), (1.0, 0.5)], colour.clone());
        let ClipBox { low, high } = box_of_all_that_shows(&volume, &transfer);
        let samples =
            |share: [f64; 3]| [0, 1, 2].map(|a| (share[a] * lattice.dims[a] as f64).round());
        // From the middle of the sample before the first, to that of the one after the last, and half a sample more.
        assert_eq!((samples(low), samples(high)), ([2.0, 3.0, 1.0], [11.0, 7.0, 8.0]));
        let nothing = TransferFunction::of(vec![(0.0, 0.0), (1.0, 0.0)], colour);
        assert_eq!(box_of_all_that_shows(&volume, &nothing), ClipBox::WHOLE);
    }

    #[test]
    fn boxes_of_samples_that_were_not_looked_at_lie_within_the_frame_and_the_box() {
        let lattice =
            Lattice { spacing: DVec3::new(1.0, 1.0, 8.0), ..Lattice::unit([200, 200, 25]) };
        let inside = |at: [usize; 3]| {
            (61..=139).contains(&at[0]) && (61..=139).contains(&at[1]) && (5..=19).contains(&at[2])
        };
        let value = |i: usize| u8::from(inside([i % 200, i / 200 % 200, i / 40_000]));
        let samples = Samples::UInt8((0..lattice.len()).map(value).collect());
        assert!(lattice.len() > MOST_LOOKED_AT);
        let volume = ScalarVolume::from_samples("box", lattice, samples).expect("sound");
        let transfer = TransferFunction::of(
            vec![(0.4, 0.0), (0.6, 0.9)],
            ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 1.0] },
        );
        let camera = framing_what_shows(&volume, &transfer, DVec3::Y, DVec3::Z);
        for z in [4.5, 19.5] {
            let corner = lattice.world_from_index(DVec3::new(100.0, 100.0, z));
            let height = (corner - camera.focal_point).dot(camera.up).abs();
            assert!(height < camera.parallel_scale, "{z}: {height} of {}", camera.parallel_scale);
        }
        let bounds = box_of_what_shows(&volume, &transfer);
        let [low, high] = bounds.in_index(lattice.dims);
        let [from, to] = [DVec3::new(60.5, 60.5, 4.5), DVec3::new(139.5, 139.5, 19.5)];
        assert!(low.cmple(from).all() && high.cmpge(to).all(), "{low} to {high}");
        assert!(
            (from - low).max_element() < 2.0 && (high - to).max_element() < 2.0,
            "{low} to {high}"
        );
    }

    /// Half a sample of the lattice that was made over a mesh was hidden at each side before anybody had cut anything.
    #[test]
    fn the_box_of_a_mesh_of_which_nothing_is_hidden_is_all_of_it() {
        let lattice = Lattice::unit([60, 40, 30]);
        let middle = DVec3::new(29.5, 19.5, 14.5);
        // A ball of the mesh, and nothing about it.
        let value = |i: usize| {
            let at = DVec3::from([i % 60, i / 60 % 40, i / 2400].map(|n| n as f64));
            let far = ((at - middle) / DVec3::new(29.5, 19.5, 14.5)).length();
            if far < 1.0 { at.x as f32 } else { f32::NAN }
        };
        let samples = Samples::Float32((0..lattice.len()).map(value).collect());
        let volume = ScalarVolume::from_samples("ball", lattice, samples).expect("sound");
        let own_bounds = Some([DVec3::ZERO, middle * 2.0]);
        let mesh = ScalarVolume { own_bounds, ..volume.clone() };
        let map = ColourSource::Map { map: ColourMap::Viridis, range: [0.0, 60.0] };
        let all = TransferFunction::of(vec![(0.0, 0.02), (60.0, 1.0)], map.clone());
        assert_eq!(box_of_what_shows(&mesh, &all), ClipBox::WHOLE);
        assert_ne!(box_of_what_shows(&volume, &all), ClipBox::WHOLE, "what is missing may be cut");
        let half = TransferFunction::of(vec![(29.5, 0.0), (29.5, 1.0)], map);
        let ClipBox { low, high } = box_of_what_shows(&mesh, &half);
        assert_eq!(([low[1], low[2]], high), ([0.0; 2], [1.0; 3]));
        assert!((low[0] - 0.5).abs() < 0.05, "{low:?}");
    }
}
