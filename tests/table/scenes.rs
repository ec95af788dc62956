//! Every scene of the table. No other file of this binary names what a scene is made of.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use voxsplat::core::{LinearRgb, Projection, Srgb8, Ticket};
use voxsplat::hierarchy::Cut;
use voxsplat::polygons::Mesh;
use voxsplat::rbf::{Basis, Encoding, Function};
use voxsplat::reference::RefKernel;
use voxsplat::scene::{
    AlongRay, Amounts, Attached, Background, ClipBox, Colours, CutFaces, Effect, Index, Isosurface,
    Light, Lighting, Plane, PolygonLayer, PolygonLook, SampleSource, Scene, Slice, SplatSettings,
    VectorLayer, framing_camera, opening,
};
use voxsplat::transfer::{ColourSource, NoData, Region, RegionShape, TransferFunction};
use voxsplat::vector::{Design, Foreshortening, VectorMode, VectorSettings};
use voxsplat::volume::{Lattice, Places, Samples, ScalarVolume, VectorField};

use crate::cells::{cells_of, samples_of};
use crate::points;

/// The scalar field: what its values are, and where they stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Field {
    /// Neighbours have nothing in common, so that every mistake in order shows. Of 8 bits.
    Noise,
    /// The same of 16 bits.
    Noise16,
    /// The same in floats about 0.
    NoiseFloat,
    /// The same over so wide a range that a field's coefficients take 32 bits.
    NoiseWide,
    /// Noise whose voxels are longer along one axis than along another.
    Stretched,
    /// The same on axes that are turned.
    Turned,
    /// The same on axes that are not square to each other.
    Sheared,
    /// Noise with single samples and a block without data.
    Holed,
    /// Smooth: coarse nodes stand for it well.
    Waves,
    /// Ellipsoids of all sizes, some narrower than a voxel, with samples of their sum, on axes that are not square to each
    /// other.
    Ellipsoids,
    /// The same as wide in every direction.
    Gaussians,
    /// Inverse multiquadrics.
    Multiquadrics,
    /// Noise on the points of tetrahedra, with a gap in them, on axes that are not square to each other.
    Tetrahedra,
    /// The same of hexahedra, wedges, pyramids and tetrahedra.
    MixedCells,
    /// The same, a value for each cell.
    CellValues,
    /// Scattered points.
    Points,
}

/// What a scene has beside its scalar field, or does to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Part {
    /// NaN has a look of its own.
    NoData,
    /// No value has any opacity.
    Clear,
    /// No background.
    Transparent,
    Lights,
    Regions,
    OpacityBy(Index),
    ModulationBy(Index),
    ReflectionBy(Index),
    EmissionBy(Index),
    /// A box and a plane.
    Clip,
    /// The same with coloured faces.
    CutFaces,
    Slices,
    /// The same without what has no opacity.
    SlicesOfWhatShows,
    /// With edges of cells.
    SlicesWithEdges,
    Isosurfaces,
    Along(AlongRay),
    /// What is projected has its colours in a range of its own.
    ColourRange,
    Vectors(VectorMode),
    /// Other vectors among the first.
    SecondVectors(VectorMode),
    /// Vectors without the scalar field.
    Alone,
    /// A smooth body that nothing shines through.
    OpaquePolygons,
    /// Flat triangles that others shine through.
    TranslucentPolygons,
}

/// Where a scene is seen from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Eye {
    Parallel,
    Perspective,
    /// In perspective, from a place within the volume.
    Within,
}

/// The scene of a row.
pub(crate) fn scene(field: Field, parts: &[Part], eye: Eye, mode: SplatSettings) -> Scene {
    let mut scene = scalar(field, eye);
    scene.splat = mode;
    // Some say more of others: they come in this order, too.
    parts.iter().for_each(|&part| add(&mut scene, part));
    scene
}

/// The same scene in another mode.
pub(crate) fn in_mode(scene: &Scene, mode: SplatSettings) -> Scene {
    let mut scene = scene.clone();
    scene.splat = mode;
    scene
}

/// The same scene with its opacities over distances so many times as long.
pub(crate) fn thinner(scene: &Scene, times: f64) -> Scene {
    let mut scene = scene.clone();
    scene.splat.opacity_unit_distance = Some(times * scene.opacity_unit_distance());
    scene
}

/// What is laid behind it.
pub(crate) fn background(scene: &Scene) -> Option<LinearRgb> {
    scene.background.light()
}

/// Why it cannot be drawn, where that is known before.
pub(crate) fn refusal(scene: &Scene) -> Option<String> {
    let splat = &scene.splat;
    let refusals = [
        splat.check().map_err(|error| error.to_string()),
        scene.shading.check(splat).map_err(|error| error.to_string()),
        scene.inside.check(splat).map_err(|error| error.to_string()),
        scene.check_layers().map_err(|error| error.to_string()),
    ];
    let parts = [Effect::Polygons, Effect::Vectors];
    let refused = scene.refusals().into_iter().find(|refusal| parts.contains(&refusal.part));
    let beside = refused.map(|refusal| refusal.to_string());
    refusals.into_iter().find_map(Result::err).or(beside)
}

/// The kernels of a cut as the reference takes them.
pub(crate) fn kernels_of(cut: &Cut, scene: &Scene) -> Vec<RefKernel> {
    let (lattice, unit) = (scene.lattice(), scene.opacity_unit_distance());
    let kernel = |cut: &voxsplat::hierarchy::CutNode| {
        let [low, size] = [cut.low, cut.size].map(|box_| DVec3::from(box_.map(f64::from)));
        RefKernel {
            centre: lattice.world_from_index(low + (size - 1.0) / 2.0),
            map: lattice.axes() * DMat3::from_diagonal(size),
            extinction: f64::from(cut.node.extinction) / unit,
            colour: cut.node.colour.map(|c| f64::from(c) / f64::from(u16::MAX)),
        }
    };
    cut.nodes.iter().map(kernel).collect()
}

/// A scalar field alone, seen askew and so near that its corners are beside the picture.
fn scalar(field: Field, eye: Eye) -> Scene {
    let (lattice, samples, [scale, offset]) = values(field);
    let mut volume = ScalarVolume::from_samples("table", lattice, samples).expect("a sound volume");
    volume.functions = basis_of(field).map(|basis| Arc::new(encoding(basis, &lattice)));
    volume.cells = cells_of(field, &lattice);
    volume.scattered = (field == Field::Points).then(|| points::points(&lattice));
    let mut scene = opening(SampleSource::made("table"), Arc::new(volume), None);
    *scene.transfer_mut().expect("a field") = transfer(scale, offset);
    scene.background = Background::Colour(Srgb8([12, 20, 40]));
    let mut camera =
        framing_camera(&lattice, DVec3::new(0.35, -0.52, 0.78), DVec3::new(0.1, 0.9, 0.3));
    camera.parallel_scale *= 0.65;
    camera.focal_point += camera.up * (0.013 * camera.parallel_scale);
    let through = |degrees: f64| Projection::Perspective { view_angle: degrees.to_radians() };
    match eye {
        Eye::Parallel => {}
        Eye::Perspective => camera.projection = through(40.0),
        Eye::Within => {
            camera.projection = through(70.0);
            camera.parallel_scale = 3.0;
        }
    }
    scene.camera = camera;
    scene
}

/// A lattice, its samples, and the scale and offset that take 0..=255 to their values.
fn values(field: Field) -> (Lattice, Samples, [f64; 2]) {
    let unit = Lattice::unit([12, 11, 13]);
    let spacing = DVec3::new(1.0, 1.3, 0.7);
    let stretched = Lattice { spacing, ..Lattice::unit([11, 9, 14]) };
    let turned = Lattice {
        origin: DVec3::new(7.0, -3.0, 11.0),
        direction: DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(-0.3),
        ..stretched
    };
    let direction = DMat3::from_cols(
        DVec3::X,
        DVec3::new(0.4, 0.9, 0.0).normalize(),
        DVec3::new(0.2, -0.1, -0.9).normalize(),
    );
    let sheared = Lattice { direction, ..stretched };
    let noise = |lattice: &Lattice| (0..lattice.len()).map(|i| random(7, i) * 255.99);
    let bytes = |lattice: Lattice| {
        (lattice, Samples::UInt8(noise(&lattice).map(|v| v as u8).collect()), [1.0, 0.0])
    };
    match field {
        Field::Noise => bytes(unit),
        Field::Stretched => bytes(stretched),
        Field::Turned => bytes(turned),
        Field::Sheared => bytes(sheared),
        Field::Noise16 => {
            let samples = noise(&unit).map(|v| (v * 30.0 - 2000.0) as i16).collect();
            (unit, Samples::Int16(samples), [30.0, -2000.0])
        }
        Field::NoiseFloat => {
            let samples = noise(&unit).map(|v| (v / 255.0 - 0.4) as f32).collect();
            (unit, Samples::Float32(samples), [1.0 / 255.0, -0.4])
        }
        Field::NoiseWide => {
            let samples = noise(&unit).map(|v| 3_000_000_000 + (v * 1e4) as u32).collect();
            (unit, Samples::UInt32(samples), [1e4, 3e9])
        }
        Field::Holed => {
            let [nx, ny, _] = stretched.dims;
            let sample = |(i, value): (usize, f64)| {
                let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
                let is_block = x < 4 && y < 4;
                let is_hole = if is_block { (4..8).contains(&z) } else { i.is_multiple_of(7) };
                match is_hole {
                    true => f32::NAN,
                    false if is_block => 10.0,
                    false => value as f32,
                }
            };
            let samples = noise(&stretched).enumerate().map(sample).collect();
            (stretched, Samples::Float32(samples), [1.0, 0.0])
        }
        Field::Waves => {
            let lattice = Lattice::unit([18, 17, 16]);
            let [nx, ny, _] = lattice.dims;
            let value = |i: usize| {
                let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)].map(|n| n as f64);
                (105.0 + 45.0 * ((0.6 * x).sin() + (0.5 * y).sin() + (0.7 * z).sin())) as u8
            };
            let samples = (0..lattice.len()).map(value).collect();
            (lattice, Samples::UInt8(samples), [1.0, 0.0])
        }
        Field::Ellipsoids | Field::Gaussians | Field::Multiquadrics => {
            let basis = basis_of(field).expect("functions");
            let places: Vec<DVec3> =
                (0..sheared.len()).map(|i| Places::Lattice(sheared).at(i).0).collect();
            let sums = encoding(basis, &sheared).values(&places, &Ticket::new());
            let sums = sums.expect("not cancelled").into_iter().map(|v| v as f32).collect();
            (sheared, Samples::Float32(sums), [1.0, 0.0])
        }
        Field::Points => {
            (sheared, points::samples_of(&points::points(&sheared), &sheared), [1.0, 0.0])
        }
        Field::Tetrahedra | Field::MixedCells | Field::CellValues => {
            let cells = cells_of(field, &sheared).expect("cells");
            (sheared, samples_of(&cells, &sheared), [1.0, 0.0])
        }
    }
}

fn basis_of(field: Field) -> Option<Basis> {
    match field {
        Field::Ellipsoids => Some(Basis::Ellipsoid),
        Field::Gaussians => Some(Basis::Gaussian),
        Field::Multiquadrics => Some(Basis::Multiquadric),
        _ => None,
    }
}

/// Functions about a lattice and a little beyond it, of both signs.
fn encoding(basis: Basis, lattice: &Lattice) -> Encoding {
    let last = DVec3::from(lattice.dims.map(|n| n as f64 - 1.0));
    let any = |i: usize| random(31, i);
    let function = |i: usize| {
        let at = 12 * i;
        let share = DVec3::new(any(at), any(at + 1), any(at + 2)) * 1.2 - 0.1;
        // From two thirds of a voxel to five of them.
        let width = 0.6 * 8_f64.powf(any(at + 3));
        let shape = match basis {
            Basis::Ellipsoid => {
                let skew = |j: usize| 0.8 * (any(at + j) - 0.5);
                let stretch = |j: usize| 0.5 + any(at + j);
                let x = DVec3::new(stretch(4), 0.0, 0.0);
                let y = DVec3::new(skew(5), stretch(6), 0.0);
                let z = DVec3::new(skew(7), skew(8), stretch(9));
                DMat3::from_cols(x, y, z) * (1.0 / width)
            }
            Basis::Gaussian | Basis::Multiquadric => {
                DMat3::from_diagonal(DVec3::splat(1.0 / width))
            }
        };
        let weight = (30.0 + 130.0 * any(at + 10)) * if i.is_multiple_of(4) { -0.7 } else { 1.0 };
        Function { centre: lattice.world_from_index(share * last), shape, weight }
    };
    let corners = (0..8).map(|i| {
        let at = DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        lattice.world_from_index(at * last)
    });
    let bounds = corners
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
    Encoding::new(basis, 40.0, 0.3, (0..60).map(function), bounds)
}

/// Clear below 90, then ever more opaque; red, green, blue. Of values v that became v · scale + offset.
fn transfer(scale: f64, offset: f64) -> TransferFunction {
    let at = |v: f64| v * scale + offset;
    let stops = [(90.0, [255, 20, 0]), (170.0, [30, 240, 60]), (255.0, [10, 40, 255])];
    TransferFunction::of(
        [(90.0, 0.0), (160.0, 0.3), (255.0, 0.9)].map(|(v, alpha)| (at(v), alpha)).to_vec(),
        ColourSource::Stops(stops.map(|(v, colour)| (at(v), Srgb8(colour))).to_vec()),
    )
}

/// Indices, parts of scenes, are those of fields of 0..=255.
fn add(scene: &mut Scene, part: Part) {
    let lattice = scene.lattice();
    let (shading, inside) = (&mut scene.shading, &mut scene.inside);
    match part {
        Part::NoData => {
            scene.transfer_mut().expect("a field").no_data =
                NoData { opacity: 0.6, colour: Srgb8([250, 0, 200]) };
        }
        Part::Clear => {
            let transfer = scene.transfer_mut().expect("a field");
            transfer.opacity.iter_mut().for_each(|(_, alpha)| *alpha = 0.0);
        }
        Part::Transparent => scene.background = Background::Transparent,
        Part::Lights => shading.lighting = Some(lights()),
        Part::Regions => shading.regions = regions(),
        Part::OpacityBy(index) => shading.opacity = Some(amounts(index)),
        Part::ModulationBy(index) => shading.modulation = Some(amounts(index)),
        Part::ReflectionBy(index) => shading.reflection = Some(colours(index)),
        Part::EmissionBy(index) => shading.emission = Some(colours(index)),
        Part::Clip | Part::CutFaces => {
            let clip = &mut inside.clip;
            clip.bounds = Some(ClipBox { low: [0.2, 0.13, 0.0], high: [0.83, 0.9, 0.71] });
            clip.planes = vec![oblique(&lattice, -0.1)];
            if part == Part::CutFaces {
                clip.faces = CutFaces::Coloured;
            }
        }
        Part::Slices | Part::SlicesOfWhatShows | Part::SlicesWithEdges => {
            let only_shown = part == Part::SlicesOfWhatShows;
            let edges = part == Part::SlicesWithEdges;
            inside.slices = vec![
                Slice { plane: oblique(&lattice, 0.1), opacity: 0.6, only_shown, edges },
                Slice { only_shown, edges, ..Slice::across(&lattice, 2, 0.4, 1.0) },
            ];
        }
        Part::Isosurfaces => {
            let surface = |value, opacity, colour| Isosurface { value, opacity, colour };
            inside.isosurfaces =
                vec![surface(130.0, 0.5, None), surface(180.0, 1.0, Some(Srgb8([230, 210, 180])))];
        }
        Part::Along(along) => inside.along = along,
        Part::ColourRange => inside.projected_range = Some([60.0, 190.0]),
        Part::Vectors(mode) => {
            let field = vectors(Places::Lattice(coarser(&lattice, 0.0)), 3);
            let mut settings = vector_settings(&field);
            settings.mode = mode;
            scene.phase = 0.3;
            scene.add(SampleSource::made("wind"), VectorLayer { field, settings });
        }
        Part::SecondVectors(mode) => {
            let field = vectors(Places::Lattice(coarser(&lattice, 0.5)), 21);
            let mut settings = VectorSettings {
                mode,
                design: Design::Comets,
                foreshortening: Foreshortening::Coordinates,
                stretch: 2.5,
                seed: 4,
                marks: Some(Srgb8([40, 255, 90])),
                ..vector_settings(&field)
            };
            settings.transfer.opacity = vec![(2.0, 0.0), (9.0, 0.4)];
            scene.add(SampleSource::made("wind"), VectorLayer { field, settings });
        }
        Part::Alone => scene.show_field(false),
        Part::OpaquePolygons => {
            let mut body = PolygonLayer::new(Arc::new(octahedron(&lattice)));
            let colour = Some(Srgb8([240, 200, 90]));
            body.look = PolygonLook { colour, is_smooth: true, ..body.look };
            scene.add(SampleSource::made("body"), body);
        }
        Part::TranslucentPolygons => {
            let mut layer = PolygonLayer::new(Arc::new(shards(&lattice, 14)));
            layer.look.opacity = 0.45;
            scene.add(SampleSource::made("shards"), layer);
        }
    }
}

/// Two coloured lights, of which one turns with the eye.
fn lights() -> Lighting {
    let light = |direction, colour, attached| Light { direction, colour: Srgb8(colour), attached };
    Lighting {
        ambient: 0.2,
        diffuse: 0.6,
        specular: 0.5,
        exponent: 8.0,
        lights: vec![
            light(DVec3::new(-0.5, 0.6, 1.0), [255, 240, 200], Attached::Camera),
            light(DVec3::new(3.0, -2.0, 0.5), [40, 90, 255], Attached::Data),
        ],
    }
}

/// One of each shape, over most of what noise has of values and strengths; two of them overlap.
fn regions() -> Vec<Region> {
    let of = |shape, values, strengths, opacity, colour| Region {
        shape,
        values,
        strengths,
        softness: 0.6,
        opacity,
        colour,
    };
    let red = Some(Srgb8([255, 40, 10]));
    vec![
        of(RegionShape::Ellipse, [60.0, 190.0], [10.0, 130.0], 0.5, red),
        of(RegionShape::Triangle, [120.0, 250.0], [0.0, 160.0], 0.9, None),
        of(RegionShape::Rectangle, [20.0, 100.0], [0.0, 60.0], 0.5, None),
    ]
}

/// The ends of what an index takes in noise.
fn range(index: Index) -> [f64; 2] {
    match index {
        Index::Value => [0.0, 255.0],
        Index::GradientStrength => [0.0, 160.0],
        Index::GradientElevation => [-90.0, 90.0],
        Index::GradientAzimuth => [-180.0, 180.0],
        Index::ViewDepth => [0.1, 0.8],
    }
}

fn amounts(index: Index) -> Amounts {
    let [low, high] = range(index);
    let points = [(0.0, 0.1), (0.3, 0.9), (0.6, 0.2), (1.0, 0.6)];
    Amounts { index, points: points.map(|(at, y)| (low + (high - low) * at, y)).to_vec() }
}

fn colours(index: Index) -> Colours {
    let [low, high] = range(index);
    let stops = [(0.0, [250, 30, 10]), (0.4, [20, 200, 90]), (1.0, [10, 60, 250])];
    let stops = stops.map(|(at, colour)| (low + (high - low) * at, Srgb8(colour)));
    Colours { index, stops: stops.to_vec() }
}

/// A plane that cuts askew, beside the middle by a share of the lattice's radius.
fn oblique(lattice: &Lattice, beside: f64) -> Plane {
    let normal = DVec3::new(0.5, -0.8, 0.6).normalize();
    Plane { point: lattice.centre() + normal * (beside * lattice.bounding_radius()), normal }
}

/// A lattice about the same middle of fewer, larger steps, turned by an angle.
fn coarser(lattice: &Lattice, angle: f64) -> Lattice {
    let dims = [5, 4, 5];
    let spacing = std::array::from_fn(|axis| {
        lattice.spacing[axis] * (lattice.dims[axis] as f64 - 1.0) / dims[axis] as f64
    });
    let direction = DMat3::from_rotation_z(angle) * lattice.direction;
    let there = Lattice { dims, spacing: DVec3::from_array(spacing), direction, ..*lattice };
    Lattice { origin: there.origin + lattice.centre() - there.centre(), ..there }
}

/// Directions all about, of lengths 0..=10.
fn vectors(places: Places, seed: u64) -> Arc<VectorField> {
    let count = places.dims().iter().product();
    let vector = |i: usize| {
        let part = |c: usize| random(seed, 3 * i + c) as f32 * 2.0 - 1.0;
        let direction = Vec3::new(part(0), part(1), part(2)).normalize_or_zero();
        direction * (10.0 * random(seed + 1, i) as f32)
    };
    let vectors = (0..count).map(vector).collect();
    Arc::new(VectorField::new("wind", places, vectors, &Ticket::new()).expect("a sound field"))
}

fn vector_settings(field: &VectorField) -> VectorSettings {
    let stops = vec![(0.0, Srgb8([255, 60, 0])), (10.0, Srgb8([20, 120, 255]))];
    let transfer = TransferFunction::of(vec![(1.0, 0.0), (10.0, 0.5)], ColourSource::Stops(stops));
    VectorSettings { transfer, coarser: 0, ..VectorSettings::for_field(field) }
}

/// Triangles of random corners about a lattice, some beyond it, none sharing any.
fn shards(lattice: &Lattice, count: usize) -> Mesh {
    let half = lattice.bounding_radius() * 0.9;
    let corner = |i: usize| {
        let part = |axis: usize| 2.0 * random(3, 3 * i + axis) - 1.0;
        (lattice.centre() + DVec3::new(part(0), part(1), part(2)) * half).as_vec3()
    };
    let colour = |i: usize| Srgb8([0, 1, 2].map(|c| (random(4, 3 * i + c) * 255.0) as u8));
    let positions = (0..3 * count).map(corner).collect();
    let colours = (0..3 * count).map(colour).collect();
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new("shards", positions, Vec::new(), colours, triangles).expect("a mesh")
}

/// A closed body about the middle, with shared corners.
fn octahedron(lattice: &Lattice) -> Mesh {
    let middle = lattice.centre().as_vec3() + Vec3::new(0.3, -0.2, 0.4);
    let axes = Vec3::AXES.map(|axis| axis * (0.3 * lattice.bounding_radius()) as f32);
    let positions = axes.iter().flat_map(|&axis| [middle + axis, middle - axis]).collect();
    let side = |corner: u32, axis: u32| 2 * axis + (corner >> axis & 1);
    let triangles = (0..8).map(|i| [side(i, 0), side(i, 1), side(i, 2)]).collect();
    Mesh::new("octahedron", positions, Vec::new(), Vec::new(), triangles).expect("a mesh")
}

/// Uniform in 0..1, the same on every machine (SplitMix64, by index).
pub(crate) fn random(seed: u64, index: usize) -> f64 {
    let mut z = (seed << 32 ^ index as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}
