//! The table: which scene, in which mode, seen from where, what is drawn of it, and what it is held to.

use voxsplat::gpu::SlabField;
use voxsplat::hierarchy::ErrorMeasure;
use voxsplat::kernel::Kernel;
use voxsplat::rbf::Limits;
use voxsplat::scene::{
    AlongRay, Backend, Classify, CutSettings, Index, OpacityModel, Order, Reconstruction, Scene,
    SplatSettings, Visibility,
};
use voxsplat::task::draw::Rung;
use voxsplat::vector::VectorMode;

use crate::scenes::{self, Eye, Field, Part};

/// Of most rows, pixels.
const SIZE: [u32; 2] = [32, 26];
/// Of those whose rays cost the reference most.
const LESS: [u32; 2] = [24, 20];
/// So few that kernels are smaller than a pixel.
const FEW: [u32; 2] = [12, 9];
/// So many that a picture at half the size has every splat of a field of vectors.
const MANY: [u32; 2] = [64, 52];

/// What a picture is held to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Judged {
    /// The scene's picture in a mode, mostly its own.
    In(SplatSettings),
    /// The kernels of the cut that it was drawn from.
    AsCut,
    /// The cut of its field that it was drawn from.
    AsBricks,
    /// Nothing: it is not drawn, and a sentence says why.
    Refused,
}

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    pub(crate) field: Field,
    pub(crate) parts: Vec<Part>,
    pub(crate) eye: Eye,
    pub(crate) mode: SplatSettings,
    pub(crate) size: [u32; 2],
    pub(crate) rung: Rung,
    pub(crate) judged: Judged,
}

impl Row {
    fn new(field: Field, parts: &[Part], mode: SplatSettings) -> Self {
        Self {
            field,
            parts: parts.to_vec(),
            eye: Eye::Parallel,
            mode,
            size: if parts.iter().any(|&part| is_slow(part)) { LESS } else { SIZE },
            rung: Rung::Full,
            judged: Judged::In(mode),
        }
    }

    fn from(self, eye: Eye) -> Self {
        Self { eye, ..self }
    }

    fn of(self, rung: Rung) -> Self {
        Self { rung, ..self }
    }

    /// Held to the cut it is drawn from, rather than to the scene.
    fn by_cut(self) -> Self {
        Self { judged: Judged::AsCut, ..self }
    }

    /// Whether it is drawn by splats as triangles, which the native engine leaves to an adapter.
    pub(crate) fn is_of_triangles(&self) -> bool {
        let kernel = if let Rung::Cheaper(kernel) = self.rung { kernel } else { self.mode.kernel };
        self.mode.backend == Backend::Raster || kernel == Kernel::Gouraud
    }

    pub(crate) fn scene(&self) -> Scene {
        scenes::scene(self.field, &self.parts, self.eye, self.mode)
    }

    /// The name, of all that makes it: no two are alike unless they are the same picture.
    pub(crate) fn name(&self) -> String {
        let Self { field, parts, eye, mode, size, rung, judged } = self;
        let mut scene = vec![format!("{field:?}").to_lowercase()];
        scene.extend(parts.iter().map(|&part| part_name(part)));
        let mut words = vec![scene.join("+")];
        words.extend(mode_names(mode));
        let eye = match eye {
            Eye::Parallel => "parallel",
            Eye::Perspective => "perspective",
            Eye::Within => "within",
        };
        words.push(match *size {
            FEW => format!("{eye} small"),
            MANY => format!("{eye} large"),
            _ => eye.to_owned(),
        });
        words.push(match rung {
            Rung::Full => "full".to_owned(),
            Rung::Octree { max_error } => format!("octree {max_error}"),
            Rung::Bricks { max_error } => format!("bricks {max_error}"),
            Rung::Subsampled { level } => format!("subsampled {level}"),
            Rung::Cheaper(kernel) => format!("cheaper {}", kernel.name()),
            Rung::Reduced { field: SlabField::Own, shrink } => format!("reduced {shrink}"),
            Rung::Reduced { field: SlabField::Preview, shrink } => format!("preview {shrink}"),
            Rung::Coarse { .. } => "coarse".to_owned(),
        });
        match judged {
            Judged::In(_) => {}
            Judged::AsCut | Judged::AsBricks => words.push("as cut".to_owned()),
            Judged::Refused => words.push("refused".to_owned()),
        }
        words.join("/")
    }
}

/// Whether the reference takes long for it.
fn is_slow(part: Part) -> bool {
    let is_vectors = matches!(part, Part::Vectors(_));
    is_vectors || matches!(part, Part::Along(_) | Part::Isosurfaces | Part::TranslucentPolygons)
}

fn part_name(part: Part) -> String {
    match part {
        Part::NoData => "no-data".to_owned(),
        Part::Clear => "clear".to_owned(),
        Part::Transparent => "transparent".to_owned(),
        Part::Lights => "lit".to_owned(),
        Part::Regions => "regions".to_owned(),
        Part::OpacityBy(index) => format!("opacity by {}", index.name()),
        Part::ModulationBy(index) => format!("modulation by {}", index.name()),
        Part::ReflectionBy(index) => format!("reflection by {}", index.name()),
        Part::EmissionBy(index) => format!("emission by {}", index.name()),
        Part::Clip => "clip".to_owned(),
        Part::CutFaces => "cut-faces".to_owned(),
        Part::Slices => "slices".to_owned(),
        Part::SlicesOfWhatShows => "slices of what shows".to_owned(),
        Part::SlicesWithEdges => "slices with edges".to_owned(),
        Part::ColourRange => "a range".to_owned(),
        Part::Isosurfaces => "isosurfaces".to_owned(),
        Part::Along(along) => along.name().to_owned(),
        Part::Vectors(mode) => format!("vectors {}", mode.name()),
        Part::SecondVectors(mode) => format!("second vectors {}", mode.name()),
        Part::Alone => "alone".to_owned(),
        Part::OpaquePolygons => "opaque".to_owned(),
        Part::TranslucentPolygons => "translucent".to_owned(),
    }
}

/// A mode's words: what is usual beside the others is left out.
fn mode_names(mode: &SplatSettings) -> Vec<String> {
    let extent = mode.extent.map_or(String::new(), |extent| format!(" {extent}"));
    let mut words = vec![format!("{}{extent}", mode.kernel.name())];
    let smooth = mode.classify != Classify::Before && mode.reconstruction == Reconstruction::Smooth;
    let smooth = if smooth { " smooth" } else { "" };
    words.push(format!("{}{smooth}", mode.classify.name()));
    words.push(match mode.visibility {
        Visibility::Sheets => format!("sheets {}", mode.sheets_per_kernel),
        Visibility::Slabs => format!("slabs {}", mode.slabs_per_voxel),
        Visibility::EverySample => mode.visibility.name().to_owned(),
    });
    if mode.opacity_model == OpacityModel::Published {
        words.push(mode.opacity_model.name().to_owned());
    }
    if mode.order != usual_order(mode.visibility) {
        words.push(mode.order.name().to_owned());
    }
    if mode.backend != Backend::Auto {
        words.push(mode.backend.name().to_owned());
    }
    let CutSettings { measure, view_dependent, balanced, .. } = mode.cut;
    if measure != ErrorMeasure::Classified {
        words.push(format!("by {}", measure.name()));
    }
    words.extend(view_dependent.then(|| "view-dependent".to_owned()));
    words.extend(balanced.then(|| "balanced".to_owned()));
    let Limits { per_cell, corrects, max_rms } = mode.limits();
    let corrected = if corrects { "" } else { " uncorrected" };
    words.extend(per_cell.map(|most| format!("{most} a cell{corrected}")));
    words.extend((max_rms > 0.0).then(|| format!("functions to {max_rms}")));
    words
}

fn usual_order(visibility: Visibility) -> Order {
    match visibility {
        Visibility::EverySample => Order::BackToFront,
        Visibility::Sheets | Visibility::Slabs => Order::FrontToBack,
    }
}

const EXACT: SplatSettings = SplatSettings::EXACT;
const EVERY_SAMPLE: SplatSettings = SplatSettings::SHADE_FIRST;
const TILES: SplatSettings = SplatSettings { backend: Backend::Tiles, ..EVERY_SAMPLE };
const RASTER: SplatSettings = SplatSettings { backend: Backend::Raster, ..EVERY_SAMPLE };
/// Kernels between planes, shaded first.
const SLABS: SplatSettings = SplatSettings {
    visibility: Visibility::Slabs,
    order: Order::FrontToBack,
    ..SplatSettings::SHADE_FIRST
};
const SHEETS: SplatSettings = SplatSettings { visibility: Visibility::Sheets, ..SLABS };
const MESH: SplatSettings = SplatSettings { kernel: Kernel::Gouraud, ..EVERY_SAMPLE };

fn with(kernel: Kernel, mode: SplatSettings) -> SplatSettings {
    SplatSettings { kernel, ..mode }
}

fn after(kernel: Kernel) -> SplatSettings {
    SplatSettings { classify: Classify::After, ..with(kernel, EXACT) }
}

fn published(mode: SplatSettings) -> SplatSettings {
    SplatSettings { opacity_model: OpacityModel::Published, ..mode }
}

fn turned(mode: SplatSettings) -> SplatSettings {
    let order = match mode.order {
        Order::BackToFront => Order::FrontToBack,
        Order::FrontToBack => Order::BackToFront,
    };
    SplatSettings { order, ..mode }
}

fn slabs(slabs_per_voxel: f64, mode: SplatSettings) -> SplatSettings {
    SplatSettings { slabs_per_voxel, ..mode }
}

fn sheets(sheets_per_kernel: u32, kernel: Kernel) -> SplatSettings {
    SplatSettings { sheets_per_kernel, ..with(kernel, SHEETS) }
}

/// Each from one of both, so that what comes in pairs is seen from either.
fn either_eye(rows: Vec<Row>) -> impl Iterator<Item = Row> {
    use Eye::{Parallel, Perspective};
    let eyes = [Parallel, Perspective, Perspective, Parallel].into_iter().cycle();
    rows.into_iter().zip(eyes).map(|(row, eye)| row.from(eye))
}

/// Each from either eye.
fn both_eyes(rows: Vec<Row>) -> impl Iterator<Item = Row> {
    rows.into_iter().flat_map(|row| [row.clone(), row.from(Eye::Perspective)])
}

/// A scene in several modes.
fn in_modes<const N: usize>(field: Field, parts: &[Part], modes: [SplatSettings; N]) -> Vec<Row> {
    modes.map(|mode| Row::new(field, parts, mode)).to_vec()
}

/// `I/N` has this process draw one row in N alone, from the I-th on: others draw the rest beside it.
const SHARE: &str = "VOXSPLAT_TABLE_SHARE";

/// Every row, or those of this process.
pub(crate) fn rows() -> Vec<Row> {
    let all = all();
    let Some(share) = std::env::var_os(SHARE) else { return all };
    let numbers = share.to_str().and_then(|share| share.split_once('/'));
    let numbers = numbers.and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    let (first, step): (usize, usize) = numbers.expect("I/N");
    println!("skipped all but one row in {step} of {}, for other processes", all.len());
    all.into_iter().skip(first).step_by(step).collect()
}

fn all() -> Vec<Row> {
    [
        fields(),
        reconstructed(),
        extents(),
        functions(),
        cells(),
        points(),
        shaded_first(),
        effects(),
        vectors(),
        polygons(),
        from_within(),
        smaller_than_a_pixel(),
        cuts(),
        bricks(),
        other_rungs(),
        refused(),
    ]
    .concat()
}

/// Values of every kind, on lattices of every kind.
fn fields() -> Vec<Row> {
    let mut rows = Vec::new();
    for field in [
        Field::Noise16,
        Field::NoiseFloat,
        Field::NoiseWide,
        Field::Stretched,
        Field::Turned,
        Field::Sheared,
    ] {
        rows.extend(either_eye(in_modes(field, &[], [EXACT, EVERY_SAMPLE])));
    }
    rows.extend(in_modes(Field::Sheared, &[], [after(Kernel::Cubic), with(Kernel::Linear, SLABS)]));
    rows.extend(in_modes(Field::Holed, &[], [EXACT, EVERY_SAMPLE]));
    let modes = [EXACT, after(Kernel::Linear), EVERY_SAMPLE, with(Kernel::Linear, SLABS), SHEETS];
    rows.extend(either_eye(in_modes(Field::Holed, &[Part::NoData], modes)));
    rows.extend(in_modes(Field::Noise, &[Part::Transparent], [EXACT]));
    rows
}

/// Fields that are reconstructed before they are classified.
fn reconstructed() -> Vec<Row> {
    let mut modes = Vec::new();
    for kernel in
        [Kernel::Nearest, Kernel::Linear, Kernel::Gaussian, Kernel::Cubic, Kernel::BSpline]
    {
        for &reconstruction in Reconstruction::ALL {
            let passes_through = matches!(kernel, Kernel::Nearest | Kernel::Linear);
            if passes_through && reconstruction == Reconstruction::Smooth {
                continue;
            }
            for classify in [Classify::After, Classify::PreIntegrated] {
                modes.push(SplatSettings { reconstruction, classify, ..with(kernel, EXACT) });
            }
        }
    }
    let all = |modes: &[SplatSettings]| {
        modes.iter().map(|&mode| Row::new(Field::Noise, &[], mode)).collect::<Vec<_>>()
    };
    let mut rows: Vec<Row> = either_eye(all(&modes)).collect();
    let middles = after(Kernel::BSpline);
    for mode in [EXACT, middles] {
        rows.extend(either_eye(all(&[slabs(0.5, mode), slabs(2.0, mode)])));
    }
    rows.extend(all(&[turned(EXACT), published(EXACT), turned(published(middles))]));
    rows
}

/// Products of another than their natural width, from a fourth of it on, on a lattice of unequal spacing.
fn extents() -> Vec<Row> {
    let wide = |extent: f64, mode: SplatSettings| SplatSettings { extent: Some(extent), ..mode };
    let mut rows = Vec::new();
    for part in [&[][..], &[Part::Lights]] {
        let splines = [0.6, 1.0, 1.6, 3.0, 6.0].map(|extent| wide(extent, EXACT));
        rows.extend(either_eye(in_modes(Field::Stretched, part, splines)));
        let tents = with(Kernel::Linear, EXACT);
        let tents = [0.6, 0.8, 1.5, 2.0].map(|extent| wide(extent, tents));
        rows.extend(either_eye(in_modes(Field::Stretched, part, tents)));
    }
    let splines = with(Kernel::BSpline, SLABS);
    let smooth = SplatSettings { reconstruction: Reconstruction::Smooth, ..EXACT };
    let modes = [
        wide(1.0, smooth),
        wide(3.0, smooth),
        wide(1.0, after(Kernel::BSpline)),
        wide(3.0, after(Kernel::BSpline)),
        wide(1.5, after(Kernel::Linear)),
        wide(0.6, splines),
        wide(1.6, splines),
        wide(3.0, splines),
        wide(0.6, with(Kernel::Linear, SLABS)),
        wide(1.5, with(Kernel::Linear, SLABS)),
    ];
    rows.extend(either_eye(in_modes(Field::Noise, &[], modes)));
    rows.push(Row::new(Field::Noise, &[], wide(3.0, published(splines))));
    rows.push(Row::new(Field::Stretched, &[Part::Lights], wide(3.0, splines)));
    rows.push(Row::new(Field::Holed, &[Part::NoData], wide(3.0, EXACT)));
    rows.push(Row::new(Field::Holed, &[Part::NoData], wide(1.0, EXACT)));
    for shrink in [1.0, 2.0] {
        let quick = Rung::Reduced { field: SlabField::Own, shrink };
        rows.push(Row::new(Field::Noise, &[], wide(3.0, EXACT)).of(quick));
    }
    rows
}

/// Basis functions, by every way of colouring slabs, and among all else.
fn functions() -> Vec<Row> {
    use Part::{
        Along, Clip, CutFaces, Isosurfaces, Lights, OpacityBy, OpaquePolygons, Slices, Vectors,
    };
    let by = |classify| SplatSettings { classify, ..with(Kernel::Functions, EXACT) };
    let exact = by(Classify::PreIntegrated);
    let mut rows = Vec::new();
    for field in [Field::Ellipsoids, Field::Gaussians, Field::Multiquadrics] {
        let modes = [exact, by(Classify::After), by(Classify::Mean)];
        rows.extend(both_eyes(in_modes(field, &[], modes)));
    }
    for classify in [Classify::PreIntegrated, Classify::After, Classify::Mean] {
        let mode = by(classify);
        let modes = [slabs(0.5, mode), slabs(4.0, mode), turned(mode), published(mode)];
        rows.extend(either_eye(in_modes(Field::Ellipsoids, &[], modes)));
        rows.push(Row::new(Field::Ellipsoids, &[Lights], mode));
        rows.push(Row::new(Field::Multiquadrics, &[Lights, Clip], mode).from(Eye::Perspective));
    }
    rows.push(Row::new(Field::Ellipsoids, &[CutFaces, Slices], exact));
    rows.push(Row::new(Field::Ellipsoids, &[OpacityBy(Index::GradientStrength)], exact));
    rows.push(Row::new(Field::Ellipsoids, &[Lights, Isosurfaces], slabs(4.0, exact)));
    for along in [AlongRay::Maximum, AlongRay::Average] {
        rows.push(Row::new(Field::Ellipsoids, &[Along(along)], exact));
    }
    rows.push(Row::new(Field::Ellipsoids, &[OpaquePolygons], exact));
    rows.push(Row::new(Field::Ellipsoids, &[Vectors(VectorMode::Modulate)], exact));
    let small = Row::new(Field::Ellipsoids, &[], exact);
    rows.push(Row { size: FEW, ..small.clone() });
    rows.push(small.clone().of(Rung::Reduced { field: SlabField::Own, shrink: 2.0 }));
    rows.push(small.of(Rung::Reduced { field: SlabField::Preview, shrink: 1.0 }));
    rows.extend(limited_functions(exact));
    // What has no functions has none to be drawn.
    rows.push(Row { judged: Judged::Refused, ..Row::new(Field::Noise, &[], exact) });
    rows
}

/// Basis functions of which some are left out: the picture is of what is left, and of what is added for them.
fn limited_functions(exact: SplatSettings) -> Vec<Row> {
    use Part::{Along, Isosurfaces, Lights, Slices};
    let of = |functions| SplatSettings { functions, ..exact };
    let few = |most, corrects| of(Limits { per_cell: Some(most), corrects, ..Limits::NONE });
    let to = |max_rms| Limits { max_rms, ..Limits::NONE };
    let mut rows = Vec::new();
    for field in [Field::Ellipsoids, Field::Multiquadrics] {
        rows.extend(both_eyes(in_modes(field, &[], [few(6, true), few(2, true)])));
        rows.push(Row::new(field, &[Lights], few(6, true)));
    }
    // Sums of wide functions that nothing corrects jump at every cell's face by more than their range, and slabs that a face
    // cuts know nothing of it: 12 dB, of both engines.
    rows.extend(both_eyes(in_modes(Field::Ellipsoids, &[], [few(6, false)])));
    let after = SplatSettings { classify: Classify::After, ..few(6, true) };
    rows.push(Row::new(Field::Ellipsoids, &[], after));
    rows.push(Row::new(Field::Ellipsoids, &[Slices], few(6, true)));
    rows.push(Row::new(Field::Ellipsoids, &[Along(AlongRay::Maximum)], few(6, true)));
    rows.push(Row::new(Field::Ellipsoids, &[Lights, Isosurfaces], slabs(4.0, few(6, true))));
    // Of fewer functions everywhere, by every way of colouring slabs.
    for classify in [Classify::PreIntegrated, Classify::After, Classify::Mean] {
        let mode = SplatSettings { classify, ..of(to(8.0)) };
        rows.push(Row::new(Field::Ellipsoids, &[], mode));
    }
    rows.push(Row::new(Field::Gaussians, &[Lights], of(Limits { per_cell: Some(6), ..to(4.0) })));
    rows
}

/// Cells themselves, of every kind, and among all else.
fn cells() -> Vec<Row> {
    use Part::{
        Along, Clip, CutFaces, Isosurfaces, Lights, OpacityBy, OpaquePolygons, Slices,
        SlicesWithEdges, Vectors,
    };
    let by = |classify| SplatSettings { classify, ..with(Kernel::Cells, EXACT) };
    let [exact, after] = [by(Classify::PreIntegrated), by(Classify::After)];
    let mut rows = Vec::new();
    for field in [Field::Tetrahedra, Field::MixedCells, Field::CellValues] {
        rows.extend(both_eyes(in_modes(field, &[], [exact, after])));
    }
    for mode in [exact, after] {
        let modes = [slabs(0.5, mode), slabs(4.0, mode), turned(mode), published(mode)];
        rows.extend(either_eye(in_modes(Field::MixedCells, &[], modes)));
        rows.push(Row::new(Field::Tetrahedra, &[Lights], mode));
        rows.push(Row::new(Field::MixedCells, &[Lights, Clip], mode).from(Eye::Perspective));
    }
    rows.push(Row::new(Field::MixedCells, &[CutFaces, Slices], exact));
    rows.push(Row::new(Field::CellValues, &[Lights, Slices], exact));
    for eye in [Eye::Parallel, Eye::Perspective] {
        rows.push(Row::new(Field::MixedCells, &[SlicesWithEdges], exact).from(eye));
    }
    rows.push(Row::new(Field::Tetrahedra, &[SlicesWithEdges], exact));
    rows.push(Row::new(Field::Tetrahedra, &[OpacityBy(Index::GradientStrength)], exact));
    // Faces of cells of several kinds do not quite match.
    for field in [Field::Tetrahedra, Field::MixedCells] {
        rows.push(Row::new(field, &[Lights, Isosurfaces], slabs(4.0, exact)));
    }
    for along in [AlongRay::Maximum, AlongRay::Average] {
        rows.push(Row::new(Field::MixedCells, &[Along(along)], slabs(4.0, exact)));
    }
    rows.push(Row::new(Field::MixedCells, &[OpaquePolygons], exact));
    rows.push(Row::new(Field::Tetrahedra, &[Vectors(VectorMode::Modulate)], exact));
    rows.push(Row::new(Field::MixedCells, &[], exact).from(Eye::Within));
    let small = Row::new(Field::MixedCells, &[], exact);
    rows.push(Row { size: FEW, ..small.clone() });
    rows.push(small.clone().of(Rung::Reduced { field: SlabField::Own, shrink: 2.0 }));
    rows.push(small.of(Rung::Reduced { field: SlabField::Preview, shrink: 1.0 }));
    // What has no cells has none to be drawn.
    rows.push(Row { judged: Judged::Refused, ..Row::new(Field::Noise, &[], exact) });
    rows
}

/// Ellipsoids about points, and among all else.
fn points() -> Vec<Row> {
    use Part::{
        Along, Clip, CutFaces, Isosurfaces, Lights, OpacityBy, OpaquePolygons, Slices, Vectors,
    };
    let by = |classify| SplatSettings { classify, ..with(Kernel::Ellipsoids, EXACT) };
    let [exact, after] = [by(Classify::PreIntegrated), by(Classify::After)];
    let row = |parts: &[Part], mode| Row::new(Field::Points, parts, mode);
    let mut rows: Vec<Row> = both_eyes(in_modes(Field::Points, &[], [exact, after])).collect();
    for mode in [exact, after] {
        let modes = [slabs(0.5, mode), slabs(4.0, mode), turned(mode), published(mode)];
        rows.extend(either_eye(in_modes(Field::Points, &[], modes)));
        rows.extend([row(&[Lights], mode), row(&[Lights, Clip], mode).from(Eye::Perspective)]);
    }
    rows.push(row(&[CutFaces, Slices], exact));
    rows.push(row(&[OpacityBy(Index::GradientStrength)], exact));
    rows.push(row(&[Lights, Isosurfaces], slabs(4.0, exact)));
    rows.push(row(&[Along(AlongRay::Maximum)], slabs(4.0, exact)));
    rows.push(row(&[OpaquePolygons], exact));
    rows.push(row(&[Vectors(VectorMode::Modulate)], exact));
    rows.push(row(&[], exact).from(Eye::Within));
    rows.push(Row { size: FEW, ..row(&[], exact) });
    // What has no points has none to be drawn.
    rows.push(Row { judged: Judged::Refused, ..Row::new(Field::Noise, &[], exact) });
    rows
}

/// Samples that are classified before they are put together.
fn shaded_first() -> Vec<Row> {
    let all = |modes: Vec<SplatSettings>| {
        modes.into_iter().map(|mode| Row::new(Field::Noise, &[], mode)).collect::<Vec<_>>()
    };
    let whole = [Kernel::Point, Kernel::Nearest, Kernel::Gaussian, Kernel::Cubic];
    let back_ends = whole.iter().flat_map(|&kernel| [RASTER, TILES].map(|mode| with(kernel, mode)));
    let mut rows: Vec<Row> = both_eyes(all(back_ends.collect())).collect();
    rows.extend(both_eyes(all(vec![MESH, published(MESH)])));
    let wide = SplatSettings { extent: Some(2.2), ..EVERY_SAMPLE };
    rows.extend(all(vec![
        turned(TILES),
        published(TILES),
        turned(published(TILES)),
        published(with(Kernel::Nearest, TILES)),
        SplatSettings { backend: Backend::Tiles, ..wide },
        SplatSettings { backend: Backend::Raster, ..wide },
        SplatSettings { extent: Some(2.2), ..MESH },
    ]));
    let in_sheets = whole.iter().flat_map(|&kernel| [1, 3].map(|count| sheets(count, kernel)));
    rows.extend(either_eye(all(in_sheets.collect())));
    rows.extend(all(vec![turned(SHEETS), published(sheets(3, Kernel::Gaussian))]));
    let is_of_lattice = |kernel: &Kernel| kernel.is_of_samples() && *kernel != Kernel::Gouraud;
    let in_slabs = Kernel::ALL.into_iter().filter(is_of_lattice);
    rows.extend(either_eye(all(in_slabs.map(|kernel| with(kernel, SLABS)).collect())));
    for mode in [SLABS, with(Kernel::BSpline, SLABS)] {
        rows.extend(all(vec![slabs(0.5, mode), slabs(2.0, mode), turned(published(mode))]));
    }
    rows
}

/// Lights, tables, and what lets the inside be seen.
fn effects() -> Vec<Row> {
    use Part::{
        Along, Clip, ColourRange, CutFaces, EmissionBy, Isosurfaces, Lights, ModulationBy,
        OpacityBy, ReflectionBy, Regions, Slices, SlicesOfWhatShows,
    };
    let mut rows = Vec::new();
    let first = [EVERY_SAMPLE, SHEETS, with(Kernel::BSpline, SLABS)];
    for part in [Lights, Regions] {
        let row = |mode: &SplatSettings| Row::new(Field::Stretched, &[part], *mode);
        rows.extend(both_eyes(vec![row(&EXACT)]));
        rows.extend(either_eye(first.iter().map(row).collect()));
    }
    rows.push(Row::new(Field::Stretched, &[Lights], after(Kernel::Linear)));
    rows.extend(in_modes(Field::Turned, &[Lights], [EXACT, published(EXACT)]));
    // Each table by each index, all four at a time; and one of them among lights.
    for turn in 0..Index::ALL.len() {
        let by = |table: usize| Index::ALL[(turn + table) % Index::ALL.len()];
        let tables =
            [OpacityBy(by(0)), ModulationBy(by(1)), ReflectionBy(by(2)), EmissionBy(by(3))];
        rows.push(Row::new(Field::Stretched, &tables, EXACT));
        if let (Some(&table), Some(&mode)) = (tables.get(turn), first.get(turn)) {
            rows.push(Row::new(Field::Stretched, &[table, Lights], mode));
        }
    }
    for part in [Clip, CutFaces, Slices, SlicesOfWhatShows] {
        rows.extend(both_eyes(vec![Row::new(Field::Stretched, &[part], EXACT)]));
    }
    rows.push(Row::new(Field::Stretched, &[Clip], with(Kernel::Linear, EXACT)));
    rows.push(Row::new(Field::Stretched, &[CutFaces, Slices], after(Kernel::BSpline)));
    // Surfaces are found to a slab: near their rims these are to be thin.
    let fine = slabs(4.0, EXACT);
    rows.extend(both_eyes(vec![Row::new(Field::Waves, &[Isosurfaces], fine)]));
    let all = [Lights, CutFaces, Slices, Isosurfaces];
    rows.push(Row::new(Field::Sheared, &all, fine).from(Eye::Perspective));
    for along in AlongRay::ALL.iter().filter(|&&along| along != AlongRay::Composite) {
        let parts = [Along(*along)];
        rows.extend(both_eyes(vec![Row::new(Field::Stretched, &parts, EXACT)]));
        rows.push(Row::new(Field::Holed, &parts, slabs(4.0, after(Kernel::Linear))));
    }
    rows.push(Row::new(Field::Stretched, &[Clip, Along(AlongRay::Maximum)], EXACT));
    rows.push(Row::new(Field::Stretched, &[Along(AlongRay::Maximum), ColourRange], EXACT));
    rows.push(Row::new(Field::Holed, &[Part::NoData, CutFaces, Slices], EXACT));
    rows
}

/// Vectors alone, beside a field and among kernels, and two fields of them.
fn vectors() -> Vec<Row> {
    use Part::{Alone, Clip, Lights, SecondVectors, Vectors};
    use VectorMode::{Blend, Modulate};
    let mut rows = Vec::new();
    for (mode, other) in [(Modulate, Blend), (Blend, Modulate)] {
        let [one, two] = [Vectors(mode), SecondVectors(other)];
        rows.extend(either_eye(vec![
            Row::new(Field::Noise, &[one, Alone], EXACT),
            Row::new(Field::Noise, &[one], EXACT),
        ]));
        rows.push(Row::new(Field::Turned, &[one, two, Alone], EXACT));
        rows.push(Row::new(Field::Stretched, &[one, two], EXACT));
    }
    let [modulate, blend] = [Vectors(Modulate), Vectors(Blend)];
    rows.push(Row::new(Field::Noise, &[modulate, Alone], turned(published(EXACT))));
    rows.push(Row::new(Field::Noise, &[blend, Alone], EXACT).from(Eye::Perspective));
    let two = [blend, SecondVectors(Modulate)];
    rows.push(Row::new(Field::Noise, &[&two[..], &[Alone]].concat(), published(EXACT)));
    let modes = [turned(published(after(Kernel::Linear))), slabs(2.0, EXACT)];
    rows.extend(in_modes(Field::Noise, &[blend], modes));
    let modes = [
        with(Kernel::Point, EVERY_SAMPLE),
        with(Kernel::Nearest, EVERY_SAMPLE),
        EVERY_SAMPLE,
        turned(published(EVERY_SAMPLE)),
        sheets(1, Kernel::Cubic),
        sheets(3, Kernel::Gaussian),
        SLABS,
        with(Kernel::BSpline, SLABS),
    ];
    rows.extend(in_modes(Field::Noise, &[modulate], modes));
    rows.push(Row::new(Field::Noise, &[modulate], SLABS).from(Eye::Perspective));
    rows.push(Row::new(Field::Noise, &two, SLABS));
    rows.extend(in_modes(Field::Noise, &[Lights, blend], [EXACT, EVERY_SAMPLE]));
    rows.push(Row::new(Field::Noise, &[Clip, modulate], EXACT));
    rows
}

/// Polygons alone, in a field, among kernels and vectors.
fn polygons() -> Vec<Row> {
    use Part::{
        Alone, Clear, Clip, CutFaces, Isosurfaces, Lights, OpaquePolygons, TranslucentPolygons,
        Vectors,
    };
    let mut rows = vec![Row::new(Field::Noise, &[Clear, TranslucentPolygons], EXACT)];
    let both = [OpaquePolygons, TranslucentPolygons];
    let without_field = Row::new(Field::Noise, &[&both[..], &[Alone]].concat(), EXACT);
    rows.extend(both_eyes(vec![without_field]));
    let cut = Row::new(Field::Noise, &[&both[..], &[Alone, Clip]].concat(), EXACT);
    rows.extend(both_eyes(vec![cut]));
    rows.push(Row::new(Field::Noise, &[TranslucentPolygons, Alone], turned(published(EXACT))));
    for part in [OpaquePolygons, TranslucentPolygons] {
        rows.extend(both_eyes(vec![Row::new(Field::Noise, &[part], EXACT)]));
        let modes = [EVERY_SAMPLE, sheets(1, Kernel::Cubic), with(Kernel::BSpline, SLABS)];
        rows.extend(either_eye(in_modes(Field::Noise, &[part], modes)));
    }
    let modes = [
        published(EXACT),
        after(Kernel::Linear),
        turned(EVERY_SAMPLE),
        sheets(3, Kernel::Gaussian),
        turned(published(SLABS)),
    ];
    rows.extend(in_modes(Field::Stretched, &both, modes));
    let among = |parts: &[Part]| [parts, &both].concat();
    let all = among(&[Lights, CutFaces, Isosurfaces]);
    rows.push(Row::new(Field::Waves, &all, slabs(4.0, EXACT)));
    let vectors = Vectors(VectorMode::Modulate);
    rows.push(Row::new(Field::Noise, &among(&[vectors, Alone]), EXACT));
    let modes = [EXACT, EVERY_SAMPLE, with(Kernel::Gaussian, SLABS)];
    rows.extend(in_modes(Field::Noise, &among(&[vectors]), modes));
    rows
}

/// The eye within the volume.
fn from_within() -> Vec<Row> {
    use Part::{Alone, CutFaces, Lights, TranslucentPolygons, Vectors};
    let modes = [
        EXACT,
        after(Kernel::Linear),
        EVERY_SAMPLE,
        RASTER,
        with(Kernel::Nearest, TILES),
        MESH,
        sheets(1, Kernel::Cubic),
        sheets(3, Kernel::Gaussian),
        SLABS,
        with(Kernel::BSpline, SLABS),
    ];
    let mut rows = in_modes(Field::Noise, &[], modes);
    let vectors = Vectors(VectorMode::Blend);
    for parts in [&[Lights][..], &[CutFaces], &[vectors], &[vectors, Alone], &[TranslucentPolygons]]
    {
        rows.push(Row::new(Field::Noise, parts, EXACT));
    }
    rows.push(Row::new(Field::Noise, &[vectors, TranslucentPolygons], SLABS));
    rows.into_iter().map(|row| row.from(Eye::Within)).collect()
}

fn smaller_than_a_pixel() -> Vec<Row> {
    let modes = [
        EXACT,
        EVERY_SAMPLE,
        RASTER,
        TILES,
        with(Kernel::Nearest, EVERY_SAMPLE),
        with(Kernel::Point, EVERY_SAMPLE),
        with(Kernel::Gaussian, TILES),
        MESH,
        SHEETS,
        SLABS,
        // With gaps between them.
        SplatSettings { extent: Some(0.4), ..EVERY_SAMPLE },
    ];
    let mut rows = in_modes(Field::Waves, &[], modes);
    let parts = [Part::Vectors(VectorMode::Modulate), Part::OpaquePolygons];
    rows.extend(in_modes(Field::Waves, &parts, [EXACT, EVERY_SAMPLE]));
    rows.into_iter().map(|row| Row { size: FEW, ..row }).collect()
}

/// Octree cuts as triangles and by lists, held to the cut and to the scene.
fn cuts() -> Vec<Row> {
    let (every, some) = (Rung::Octree { max_error: 0.0 }, Rung::Octree { max_error: 0.3 });
    let row = |mode: &SplatSettings| Row::new(Field::Waves, &[], *mode);
    let modes = [
        EVERY_SAMPLE,
        TILES,
        turned(with(Kernel::Gaussian, TILES)),
        published(EVERY_SAMPLE),
        with(Kernel::Nearest, EVERY_SAMPLE),
        with(Kernel::Point, EVERY_SAMPLE),
        MESH,
        SHEETS,
        SLABS,
    ];
    let seen: Vec<Row> = either_eye(modes.iter().map(row).collect()).collect();
    let mut rows: Vec<Row> = seen.iter().map(|row| row.clone().of(some).by_cut()).collect();
    rows.extend(seen.into_iter().take(3).map(|row| row.of(every).by_cut()));
    let near = Rung::Octree { max_error: 0.1 };
    rows.extend([EXACT, EVERY_SAMPLE, TILES, MESH].iter().map(|mode| row(mode).of(near)));
    let subsampled = Rung::Subsampled { level: 1 };
    rows.extend([RASTER, TILES].iter().map(|mode| row(mode).of(subsampled).by_cut()));
    rows.extend([EXACT, EVERY_SAMPLE].iter().map(|mode| row(mode).of(subsampled)));
    let uniform = CutSettings::UNIFORM;
    for cut in [
        CutSettings { measure: ErrorMeasure::Scalar, ..uniform },
        CutSettings { measure: ErrorMeasure::OpticalDepth, ..uniform },
        CutSettings { view_dependent: true, ..uniform },
        CutSettings { balanced: true, ..uniform },
    ] {
        rows.push(row(&SplatSettings { cut, ..EVERY_SAMPLE }).of(some).by_cut());
    }
    rows
}

/// Cuts of a field beside what they can stand with, held to the reference's picture of the same cut, and to the scene. Isosurfaces
/// pass every brick of so small a field, and noise has no means: `tests/cuts.rs` has those.
fn bricks() -> Vec<Row> {
    use Part::{Clip, CutFaces, Lights, OpaquePolygons, Slices, TranslucentPolygons};
    let of = |parts: &[Part], mode: SplatSettings, max_error: f32| {
        Row::new(Field::Waves, parts, mode).of(Rung::Bricks { max_error })
    };
    let by_cut = |row: Row| Row { judged: Judged::AsBricks, ..row };
    let mut rows = vec![
        of(&[], EXACT, 0.05),
        of(&[Lights], EXACT, 0.05),
        of(&[Clip, CutFaces], EXACT, 0.05),
        of(&[Slices, Lights], EXACT, 0.05),
        of(&[OpaquePolygons, TranslucentPolygons], EXACT, 0.05),
        of(&[], with(Kernel::Linear, EXACT), 0.05),
        of(&[], EXACT, 0.05).from(Eye::Within),
    ];
    rows = rows.into_iter().map(by_cut).collect();
    rows.extend([of(&[], EXACT, 0.01), of(&[Lights], EXACT, 0.01)]);
    rows
}

/// Every voxel with a cheaper kernel, and fields at a smaller size.
fn other_rungs() -> Vec<Row> {
    use Part::{Alone, Lights, OpaquePolygons, Vectors};
    let kernels = [Kernel::Point, Kernel::Nearest, Kernel::Gaussian, Kernel::Gouraud];
    let cheaper = kernels.map(|kernel| {
        let row = Row::new(Field::Waves, &[], EVERY_SAMPLE).of(Rung::Cheaper(kernel));
        Row { judged: Judged::In(with(kernel, EVERY_SAMPLE)), ..row }
    });
    let mut rows: Vec<Row> = either_eye(cheaper.to_vec()).collect();
    let vectors = Vectors(VectorMode::Modulate);
    let of = |parts: &[Part], mode: SplatSettings| Row::new(Field::Waves, parts, mode);
    let large = |row: Row| Row { size: MANY, ..row };
    let half = Rung::Reduced { field: SlabField::Own, shrink: 2.0 };
    rows.extend([
        of(&[], EXACT).of(half),
        of(&[], RASTER).of(half),
        of(&[], TILES).of(half),
        of(&[Lights], SLABS).of(half),
        of(&[OpaquePolygons], EXACT).of(half),
        large(of(&[vectors], EXACT)).of(half),
        large(of(&[vectors], EVERY_SAMPLE)).of(half),
        large(of(&[vectors, Alone], EXACT)).of(half),
        // Vectors have no octree: a smaller picture of their means stands in.
        large(of(&[vectors], EXACT)).of(Rung::Octree { max_error: 0.1 }),
    ]);
    // Samples that are shaded first have a field to stand in for them.
    let tents = with(Kernel::Linear, EXACT);
    for (row, judged) in [
        (of(&[], EXACT), EXACT),
        (of(&[], slabs(2.0, EXACT)), EXACT),
        (of(&[Lights], EVERY_SAMPLE), tents),
        (large(of(&[vectors], EXACT)), EXACT),
        (of(&[OpaquePolygons], SLABS), tents),
    ] {
        let row = row.of(Rung::Reduced { field: SlabField::Preview, shrink: 2.0 });
        rows.push(Row { judged: Judged::In(judged), ..row });
    }
    let whole = Rung::Reduced { field: SlabField::Preview, shrink: 1.0 };
    rows.push(of(&[], EXACT).of(whole));
    rows
}

/// What means nothing, or what nothing can draw.
fn refused() -> Vec<Row> {
    use Part::{
        Along, Clip, CutFaces, Isosurfaces, Lights, OpaquePolygons, Regions, Slices, Vectors,
    };
    let vectors = Vectors(VectorMode::Modulate);
    let wide = SplatSettings { extent: Some(12.0), ..EVERY_SAMPLE };
    [
        (&[][..], SplatSettings { visibility: Visibility::EverySample, ..EXACT }),
        (&[], SplatSettings { visibility: Visibility::Sheets, ..after(Kernel::Cubic) }),
        (&[], SplatSettings { reconstruction: Reconstruction::Interpolating, ..SLABS }),
        (&[], with(Kernel::Linear, SHEETS)),
        (&[], with(Kernel::BSpline, EVERY_SAMPLE)),
        (&[], with(Kernel::Point, EXACT)),
        (&[], with(Kernel::Gouraud, SLABS)),
        (&[], with(Kernel::Gouraud, TILES)),
        (&[], turned(MESH)),
        (&[], turned(RASTER)),
        (&[], published(RASTER)),
        (&[], slabs(0.0, EXACT)),
        (&[], SplatSettings { sheets_per_kernel: 0, ..SHEETS }),
        (&[], SplatSettings { backend: Backend::Tiles, ..wide }),
        (&[], SplatSettings { extent: Some(2.0), ..with(Kernel::Nearest, EVERY_SAMPLE) }),
        (&[], SplatSettings { extent: Some(0.4), ..EXACT }),
        (&[], SplatSettings { extent: Some(9.0), ..EXACT }),
        (&[], SplatSettings { extent: Some(1e6), ..with(Kernel::Linear, EXACT) }),
        (&[], SplatSettings { extent: Some(1e-6), ..with(Kernel::Linear, EXACT) }),
        (&[Lights], RASTER),
        (&[Lights], MESH),
        (&[Regions], wide),
        (&[Clip], EVERY_SAMPLE),
        (&[Slices], SLABS),
        (&[Isosurfaces], after(Kernel::BSpline)),
        (&[Isosurfaces, Along(AlongRay::Maximum)], EXACT),
        (&[CutFaces, Along(AlongRay::Average)], EXACT),
        (&[Along(AlongRay::Minimum)], SHEETS),
        (&[OpaquePolygons], MESH),
        (&[OpaquePolygons], RASTER),
        (&[OpaquePolygons, Along(AlongRay::Maximum)], EXACT),
        (&[vectors], MESH),
        (&[vectors], wide),
        (&[vectors], RASTER),
    ]
    .map(|(parts, mode)| Row { judged: Judged::Refused, ..Row::new(Field::Noise, parts, mode) })
    .to_vec()
}
