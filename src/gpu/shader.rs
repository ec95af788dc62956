//! The shaders, each with the library pieces it needs in front.

const FRAME: &str = include_str!("../../shaders/lib/frame.wgsl");
const PROJECT: &str = include_str!("../../shaders/lib/project.wgsl");
const LISTS: &str = include_str!("../../shaders/lib/lists.wgsl");
const SORT: &str = include_str!("../../shaders/lib/sort.wgsl");
const TRAVERSAL: &str = include_str!("../../shaders/lib/traversal.wgsl");
const FOOTPRINT: &str = include_str!("../../shaders/lib/footprint.wgsl");
const SHARE: &str = include_str!("../../shaders/lib/share.wgsl");
const OPACITY: &str = include_str!("../../shaders/lib/opacity.wgsl");
const GATHER: &str = include_str!("../../shaders/lib/gather.wgsl");
const GATHERED_LIGHT: &str = include_str!("../../shaders/lib/gathered_light.wgsl");
const GATHERED_AMONG: &str = include_str!("../../shaders/lib/gathered_among.wgsl");
const PLAIN_SAMPLES: &str = include_str!("../../shaders/lib/plain_samples.wgsl");
const SHADED_SAMPLES: &str = include_str!("../../shaders/lib/shaded_samples.wgsl");
const FOUND_SAMPLES: &str = include_str!("../../shaders/lib/found_samples.wgsl");
const WHOLE: &str = include_str!("../../shaders/lib/whole.wgsl");
const UNLIT: &str = include_str!("../../shaders/lib/unlit.wgsl");
const SHADE: &str = include_str!("../../shaders/lib/shade.wgsl");
const REGIONS: &str = include_str!("../../shaders/lib/regions.wgsl");
const UNPAINTED: &str = include_str!("../../shaders/lib/unpainted.wgsl");
const FACE_BSPLINE: &str = include_str!("../../shaders/lib/face_bspline.wgsl");
const FACE_TENTS: &str = include_str!("../../shaders/lib/face_tents.wgsl");
const FACE_DIFFERENCES: &str = include_str!("../../shaders/lib/face_differences.wgsl");
const PARTS: &str = include_str!("../../shaders/lib/parts.wgsl");

const SLABS: &str = include_str!("../../shaders/lib/slabs.wgsl");
const FIELD: &str = include_str!("../../shaders/lib/field.wgsl");
const CLASSIFY: &str = include_str!("../../shaders/lib/classify.wgsl");
const SPECKS: &str = include_str!("../../shaders/lib/specks.wgsl");
const NO_SPECKS: &str = include_str!("../../shaders/lib/no_specks.wgsl");
const EMPTY: &str = include_str!("../../shaders/lib/empty.wgsl");
const LIGHT: &str = include_str!("../../shaders/lib/light.wgsl");
const NO_POLYGONS: &str = include_str!("../../shaders/lib/no_polygons.wgsl");
const POLYGONS: &str = include_str!("../../shaders/lib/polygons.wgsl");
const POLYGON_CORNERS: &str = include_str!("../../shaders/lib/polygon_corners.wgsl");
const LIGHT_OF_SAMPLES: &str = include_str!("../../shaders/lib/light_of_samples.wgsl");
const KEPT_LIGHT: &str = include_str!("../../shaders/lib/kept_light.wgsl");
const KEPT_SAMPLES: &str = include_str!("../../shaders/lib/kept_samples.wgsl");
const ALONE: &str = include_str!("../../shaders/lib/alone.wgsl");
const ALONE_WITH_POLYGONS: &str = include_str!("../../shaders/lib/alone_with_polygons.wgsl");
const RAYS: &str = include_str!("../../shaders/lib/rays.wgsl");
const INSIDE: &str = include_str!("../../shaders/lib/inside.wgsl");
const UNCLIPPED: &str = include_str!("../../shaders/lib/unclipped.wgsl");
const CLIPPED: &str = include_str!("../../shaders/lib/clipped.wgsl");
const MATTER: &str = include_str!("../../shaders/lib/matter.wgsl");
const SURFACES: &str = include_str!("../../shaders/lib/surfaces.wgsl");
const MET: &str = include_str!("../../shaders/lib/met.wgsl");
const NO_MET: &str = include_str!("../../shaders/lib/no_met.wgsl");
const NO_LEVELS: &str = include_str!("../../shaders/lib/no_levels.wgsl");
const LEVELS: &str = include_str!("../../shaders/lib/levels.wgsl");
const NO_VECTORS: &str = include_str!("../../shaders/lib/no_vectors.wgsl");
const VECTOR_FRAME: &str = include_str!("../../shaders/lib/vector_frame.wgsl");
const VECTORS: &str = include_str!("../../shaders/lib/vectors.wgsl");

/// Before pieces that are of another kernel than those before: their names are the vectors' own.
const MARKS_OWN: &str = "// Of the splats of vectors:\n";
/// What those names begin with.
const OWN_PREFIX: &str = "marks_";

/// Whether a name is of one radial kernel: its footprint, its shares, and their coefficients.
fn is_of_a_kernel(word: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    matches!(word, "footprint" | "share" | "rim_root")
        || word.strip_prefix(['c', 's']).is_some_and(is_number)
}

/// What pieces after [`MARKS_OWN`] call something.
pub(super) fn own_name(word: &str) -> String {
    let prefix = if is_of_a_kernel(word) { OWN_PREFIX } else { "" };
    format!("{prefix}{word}")
}

/// A piece with names of its own for what is of a kernel.
fn with_own_names(piece: &str) -> String {
    let is_in_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut renamed = String::with_capacity(piece.len());
    let mut rest = piece;
    while let Some(start) = rest.find(is_in_word) {
        let end = rest[start..].find(|c| !is_in_word(c)).map_or(rest.len(), |n| start + n);
        renamed.push_str(&rest[..start]);
        renamed.push_str(&own_name(&rest[start..end]));
        rest = &rest[end..];
    }
    renamed + rest
}

/// What pieces call the group of their own bindings.
const OWN_GROUP: &str = "@group(1)";

/// The most pieces that a shader is stitched of.
const MOST_PIECES: usize = 24;

/// A pass's shader: its name is the file's, the pass's label and the timing row's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shader {
    /// Name of the pass.
    pub name: &'static str,
    /// Filled up with nothing.
    pieces: [&'static str; MOST_PIECES],
}

/// A pass of these pieces.
const fn stitched(name: &'static str, pieces: &[&'static str]) -> Shader {
    let mut all = [""; MOST_PIECES];
    let mut i = 0;
    while i < pieces.len() {
        all[i] = pieces[i];
        i += 1;
    }
    Shader { name, pieces: all }
}

macro_rules! shader {
    ($name:ident, $file:literal, $($library:expr),*) => {
        #[doc = concat!("`shaders/", $file, ".wgsl`.")]
        pub const $name: Shader = stitched(
            $file,
            &[$($library,)* include_str!(concat!("../../shaders/", $file, ".wgsl"))],
        );
    };
}

shader!(COUNT_SEGMENTS, "count_segments", TRAVERSAL);
shader!(SCAN_SEGMENTS, "scan_segments",);
shader!(EMIT_KERNELS, "emit_kernels", TRAVERSAL);
shader!(MERGE_BRICKS, "merge_bricks", TRAVERSAL, OPACITY);
shader!(SPLAT, "splat", FRAME, PROJECT, FOOTPRINT, OPACITY);
shader!(COUNT_ENTRIES, "count_entries", FRAME, PROJECT, FOOTPRINT, OPACITY, LISTS);
shader!(COUNT_VECTORS, "count_vectors", FRAME, PROJECT, FOOTPRINT, OPACITY, LISTS, VECTOR_FRAME);
shader!(
    COMPOSITE_VECTORS,
    "composite_vectors",
    LIGHT,
    WHOLE,
    KEPT_LIGHT,
    FOOTPRINT,
    SHARE,
    VECTOR_FRAME,
    VECTORS,
    ALONE
);
shader!(
    COMPOSITE_VECTORS_IN_PARTS,
    "composite_vectors",
    LIGHT,
    PARTS,
    KEPT_LIGHT,
    FOOTPRINT,
    SHARE,
    VECTOR_FRAME,
    VECTORS,
    ALONE
);
shader!(
    COMPOSITE_VECTORS_AND_POLYGONS,
    "composite_vectors",
    LIGHT_OF_SAMPLES,
    WHOLE,
    KEPT_SAMPLES,
    FOOTPRINT,
    SHARE,
    VECTOR_FRAME,
    VECTORS,
    POLYGONS,
    ALONE_WITH_POLYGONS
);
shader!(
    COMPOSITE_VECTORS_AND_POLYGONS_IN_PARTS,
    "composite_vectors",
    LIGHT_OF_SAMPLES,
    PARTS,
    KEPT_SAMPLES,
    FOOTPRINT,
    SHARE,
    VECTOR_FRAME,
    VECTORS,
    POLYGONS,
    ALONE_WITH_POLYGONS
);
shader!(COUNT_POLYGONS, "count_polygons", POLYGON_CORNERS);
shader!(PLACE_POLYGONS, "place_polygons",);
shader!(WRITE_POLYGONS, "write_polygons", POLYGON_CORNERS);
shader!(SORT_POLYGONS, "sort_polygons",);
shader!(WRITE_ENTRIES, "write_entries", LISTS);
shader!(COUNT_DIGITS, "count_digits", SORT);
shader!(SCATTER_DIGITS, "scatter_digits", SORT);
shader!(FIND_RANGES, "find_ranges", LISTS);
shader!(COMPOSITE_LISTS, "composite_lists", FRAME, PROJECT, FOOTPRINT, SHARE, OPACITY, LISTS);
shader!(PRESENT, "present",);
shader!(PICTURE, "picture",);
/// What a sample is when kernels are shaded first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleLooks {
    /// What its value is classified as.
    Plain,
    /// With lights or shading tables.
    Shaded,
    /// The same, with opacities by regions of value and gradient strength.
    Painted,
    /// As `shade_samples` left it, whatever it is.
    Kept,
}

/// What `shaders/gather_kernels.wgsl` and `shaders/gather_cells.wgsl` are stitched of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GatherPieces {
    /// Boxes and separable kernels, cell by cell, rather than radial ones and points.
    pub cells: bool,
    /// Rays are walked in several dispatches.
    pub in_parts: bool,
    /// What samples are.
    pub looks: SampleLooks,
    /// Polygons lie among them.
    pub polygons: bool,
    /// Vector splats do.
    pub vectors: bool,
}

impl GatherPieces {
    /// Every one there is.
    pub const ALL: [Self; 60] = {
        use SampleLooks::{Kept, Painted, Plain, Shaded};
        let looks = [Plain, Shaded, Painted, Kept];
        let plain =
            Self { cells: false, in_parts: false, looks: Plain, polygons: false, vectors: false };
        let mut all = [plain; 60];
        let mut i = 0;
        while i < all.len() {
            all[i] = Self {
                cells: i % 2 == 1,
                in_parts: i / 2 % 2 == 1,
                // Samples that are shaded already have a group of bindings more than is left beside both.
                looks: looks[i / 4 % 4],
                polygons: i / 16 % 2 == 1,
                vectors: i / 32 == 1,
            };
            i += 1;
        }
        all
    };

    /// The pass of these pieces.
    pub const fn shader(self) -> Shader {
        let rays = if self.in_parts { PARTS } else { WHOLE };
        let [samples, shade, painted] = match self.looks {
            SampleLooks::Plain => [PLAIN_SAMPLES, "", ""],
            SampleLooks::Shaded => [SHADED_SAMPLES, SHADE, UNPAINTED],
            SampleLooks::Painted => [SHADED_SAMPLES, SHADE, REGIONS],
            SampleLooks::Kept => [FOUND_SAMPLES, "", ""],
        };
        let [name, footprint, share, walk] = match self.cells {
            false => {
                let walk = include_str!("../../shaders/gather_kernels.wgsl");
                [GATHER_KERNELS, FOOTPRINT, SHARE, walk]
            }
            true => [GATHER_CELLS, "", "", include_str!("../../shaders/gather_cells.wgsl")],
        };
        let [light, gathered, kept_light] = match self.polygons || self.vectors {
            false => ["", GATHERED_LIGHT, ""],
            true => [LIGHT_OF_SAMPLES, GATHERED_AMONG, KEPT_SAMPLES],
        };
        let polygons = match (self.polygons, self.vectors) {
            (true, _) => POLYGONS,
            (false, true) => NO_POLYGONS,
            (false, false) => "",
        };
        let vectors = match (self.vectors, self.polygons) {
            (true, _) => [MARKS_OWN, FOOTPRINT, SHARE, VECTOR_FRAME, VECTORS],
            (false, true) => [NO_VECTORS, "", "", "", ""],
            (false, false) => [""; 5],
        };
        let [marks, others, parts, frame, vectors] = vectors;
        let pieces = &[
            TRAVERSAL, footprint, share, OPACITY, rays, GATHER, light, gathered, kept_light,
            samples, painted, shade, polygons, walk, marks, others, parts, frame, vectors,
        ];
        stitched(name, pieces)
    }
}

/// The pass that shades samples once for all rays, with regions or without.
pub const fn shading_samples(painted: bool) -> Shader {
    let painted = if painted { REGIONS } else { UNPAINTED };
    let walk = include_str!("../../shaders/shade_samples.wgsl");
    stitched(
        SHADE_SAMPLES,
        // Before the gathering, whose own group has no part in this.
        &[walk, TRAVERSAL, OPACITY, WHOLE, GATHER, GATHERED_LIGHT, SHADED_SAMPLES, painted, SHADE],
    )
}

/// Name of the pass that shades samples.
pub const SHADE_SAMPLES: &str = "shade_samples";

/// Name of the pass that gathers radial kernels and points.
pub const GATHER_KERNELS: &str = "gather_kernels";

/// Name of the pass that gathers boxes and separable kernels.
pub const GATHER_CELLS: &str = "gather_cells";

/// What has the values, and growth, of a field on the faces of slabs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Faces {
    /// Values alone: colours shine by themselves, and opacities are by value.
    Unlit,
    /// With lights or shading tables, of B-splines.
    BSplines,
    /// The same of tents, quickly.
    Tents,
    /// The same of any field, by differences.
    Differences,
}

/// What `shaders/reconstruct_slabs.wgsl` is stitched of beside what every scene needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlabPieces {
    /// Rays are walked in several dispatches.
    pub in_parts: bool,
    /// What finds values and growth.
    pub faces: Faces,
    /// Something is cut away.
    pub clipped: bool,
    /// Faces where it is cut, slices or isosurfaces lie among the matter.
    pub surfaces: bool,
    /// Isosurfaces among them, which only faces with growth have.
    pub levels: bool,
    /// Vector splats lie in the same slabs.
    pub vectors: bool,
    /// Opacities are by regions of value and gradient strength, on faces with growth.
    pub regions: bool,
    /// Polygons lie among all of it.
    pub polygons: bool,
    /// The field is of means, with the width of the values about them.
    pub means: bool,
}

impl SlabPieces {
    /// Every one there is.
    pub const ALL: [Self; 76] = {
        let faces = [Faces::Unlit, Faces::BSplines, Faces::Tents, Faces::Differences];
        let mut all = [Self::PLAIN; 76];
        let mut i = 0;
        while i < all.len() {
            all[i] = if i < 32 {
                Self {
                    in_parts: i % 2 == 1,
                    faces: faces[i / 2 % 4],
                    clipped: i / 8 % 2 == 1,
                    surfaces: i / 16 == 1,
                    levels: i / 16 == 1 && i / 2 % 4 > 0,
                    ..Self::PLAIN
                }
            } else if i >= 72 {
                // Means are a piece beside any other, and always of tents.
                let faces = [Faces::Unlit, Faces::Tents][(i - 72) / 2];
                Self { in_parts: i % 2 == 1, faces, means: true, ..Self::PLAIN }
            } else if i >= 62 {
                // Rays among vectors that are walked in parts: by how they are lit alone, among all else,
                // and among polygons and nothing else.
                let faces = faces[(i - 62) % 4];
                let with = (i - 62) / 4;
                Self {
                    faces,
                    in_parts: true,
                    vectors: true,
                    clipped: with == 1,
                    surfaces: with == 1,
                    levels: with == 1 && !matches!(faces, Faces::Unlit),
                    polygons: with >= 1,
                    ..Self::PLAIN
                }
            } else if i >= 42 {
                // Polygons beside all else: by how they are lit alone, in parts, cut, with surfaces, and
                // with vectors; and vectors among what is cut, and surfaces.
                let faces = faces[(i - 42) % 4];
                let with = (i - 42) / 4;
                Self {
                    faces,
                    in_parts: with == 1,
                    clipped: with == 1 || with == 4,
                    surfaces: with == 2 || with == 4,
                    levels: (with == 2 || with == 4) && !matches!(faces, Faces::Unlit),
                    vectors: with >= 3,
                    polygons: with < 4,
                    ..Self::PLAIN
                }
            } else if i >= 36 {
                // Regions are a piece beside any other.
                let faces = faces[1 + (i - 36) / 2];
                Self { in_parts: i % 2 == 1, faces, regions: true, ..Self::PLAIN }
            } else {
                Self { faces: faces[i - 32], vectors: true, ..Self::PLAIN }
            };
            i += 1;
        }
        all
    };

    /// What nobody asked for anything with.
    pub const PLAIN: Self = Self {
        in_parts: false,
        faces: Faces::Unlit,
        clipped: false,
        surfaces: false,
        levels: false,
        vectors: false,
        regions: false,
        polygons: false,
        means: false,
    };

    /// The pass that projects values along rays, of these pieces: of the faces, values alone.
    pub const fn projecting(self) -> Shader {
        let [inside, clip] = if self.clipped { [INSIDE, CLIPPED] } else { ["", UNCLIPPED] };
        let rays = if self.in_parts { PARTS } else { WHOLE };
        let walk = include_str!("../../shaders/project_values.wgsl");
        let pieces = &[SLABS, FIELD, CLASSIFY, EMPTY, RAYS, inside, clip, rays, walk];
        stitched(PROJECT_VALUES, pieces)
    }

    /// The pass of these pieces.
    pub const fn shader(self) -> Shader {
        let painted = match (self.faces, self.regions) {
            (Faces::Unlit, _) => "",
            (_, true) => REGIONS,
            (_, false) => UNPAINTED,
        };
        let [shade, face] = match self.faces {
            Faces::Unlit => [UNLIT, ""],
            Faces::BSplines => [SHADE, FACE_BSPLINE],
            Faces::Tents => [SHADE, FACE_TENTS],
            Faces::Differences => [SHADE, FACE_DIFFERENCES],
        };
        let rays = if self.in_parts { PARTS } else { WHOLE };
        let inside = if self.clipped || self.surfaces { INSIDE } else { "" };
        let clip = if self.clipped { CLIPPED } else { UNCLIPPED };
        let layers = if self.surfaces || self.polygons { SURFACES } else { MATTER };
        let met = match (self.surfaces, self.polygons) {
            (true, _) => MET,
            (false, true) => NO_MET,
            (false, false) => "",
        };
        let [light, kept_light, polygons] = match self.polygons {
            false => [LIGHT, KEPT_LIGHT, NO_POLYGONS],
            true => [LIGHT_OF_SAMPLES, KEPT_SAMPLES, POLYGONS],
        };
        let levels = if self.levels { LEVELS } else { NO_LEVELS };
        let specks = if self.means { SPECKS } else { NO_SPECKS };
        let walk = include_str!("../../shaders/reconstruct_slabs.wgsl");
        let [footprint, share, frame, vectors] = match self.vectors {
            false => ["", "", "", NO_VECTORS],
            true => [FOOTPRINT, SHARE, VECTOR_FRAME, VECTORS],
        };
        stitched(
            RECONSTRUCT_SLABS,
            &[
                SLABS, FIELD, CLASSIFY, specks, EMPTY, light, RAYS, inside, clip, layers, met,
                levels, rays, kept_light, painted, shade, face, footprint, share, frame, vectors,
                polygons, walk,
            ],
        )
    }
}

/// Name of the pass that composites slabs of a reconstructed field.
pub const RECONSTRUCT_SLABS: &str = "reconstruct_slabs";

/// Name of the pass that projects values along rays.
pub const PROJECT_VALUES: &str = "project_values";

/// Projecting passes: whole or in parts, with and without a clip.
const PROJECTING: [Shader; 4] = {
    let mut all = [SINGLE[0]; 4];
    let mut i = 0;
    while i < all.len() {
        let pieces = SlabPieces { in_parts: i % 2 == 1, clipped: i / 2 == 1, ..SlabPieces::PLAIN };
        all[i] = pieces.projecting();
        i += 1;
    }
    all
};

/// Passes that are stitched in one way only.
const SINGLE: [Shader; 24] = [
    COUNT_SEGMENTS,
    SCAN_SEGMENTS,
    EMIT_KERNELS,
    MERGE_BRICKS,
    SPLAT,
    COUNT_ENTRIES,
    WRITE_ENTRIES,
    COUNT_DIGITS,
    SCATTER_DIGITS,
    FIND_RANGES,
    COMPOSITE_LISTS,
    COUNT_VECTORS,
    COMPOSITE_VECTORS,
    COMPOSITE_VECTORS_IN_PARTS,
    COMPOSITE_VECTORS_AND_POLYGONS,
    COMPOSITE_VECTORS_AND_POLYGONS_IN_PARTS,
    COUNT_POLYGONS,
    PLACE_POLYGONS,
    WRITE_POLYGONS,
    SORT_POLYGONS,
    PRESENT,
    PICTURE,
    shading_samples(false),
    shading_samples(true),
];

/// How many of each family there are, in the order of [`ALL`].
const COUNTS: [usize; 4] =
    [SINGLE.len(), PROJECTING.len(), GatherPieces::ALL.len(), SlabPieces::ALL.len()];

/// Every shader there is.
pub static ALL: [Shader; COUNTS[0] + COUNTS[1] + COUNTS[2] + COUNTS[3]] = {
    let projecting = COUNTS[0];
    let gathering = projecting + COUNTS[1];
    let slabs = gathering + COUNTS[2];
    let mut all = [SINGLE[0]; COUNTS[0] + COUNTS[1] + COUNTS[2] + COUNTS[3]];
    let mut i = 0;
    while i < all.len() {
        all[i] = match i {
            _ if i < projecting => SINGLE[i],
            _ if i < gathering => PROJECTING[i - projecting],
            _ if i < slabs => GatherPieces::ALL[i - gathering].shader(),
            _ => SlabPieces::ALL[i - slabs].shader(),
        };
        i += 1;
    }
    all
};

impl Shader {
    /// The stitched source. Pieces with bindings of their own have them in a group of their own, which
    /// they call the first: they are numbered in the order of the pieces.
    pub fn source(&self) -> String {
        let (mut groups, mut have_own_names) = (0, false);
        let numbered = self.pieces.iter().map(|piece| {
            groups += u32::from(piece.contains(OWN_GROUP));
            let mut numbered = piece.replace(OWN_GROUP, &format!("@group({groups})"));
            if self.name == COMPOSITE_VECTORS.name && (*piece == PARTS || *piece == WHOLE) {
                // Bindings count up, and few are before it there.
                numbered = numbered.replace("@binding(8)", "@binding(2)");
            }
            have_own_names |= *piece == MARKS_OWN;
            if have_own_names { with_own_names(&numbered) } else { numbered }
        });
        numbered.collect()
    }

    /// The module on a device.
    pub(super) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        self.module_of(device, self.source())
    }

    /// The module whose picture is a storage texture of a format: WGSL has no override for it.
    pub(super) fn module_writing(
        &self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
    ) -> wgpu::ShaderModule {
        let source = self.source();
        self.module_of(
            device,
            match format {
                wgpu::TextureFormat::Rgba16Float => source.replace("rgba32float", "rgba16float"),
                _ => source,
            },
        )
    }

    fn module_of(&self, device: &wgpu::Device, source: String) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }
}
