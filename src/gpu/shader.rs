//! The shaders, each with the library pieces it needs in front.
//!
//! What a scene does not ask for is left out by overrides, which a compiler takes for constants. Only what has
//! bindings of its own, lights, vectors and polygons, is a piece that is there or is not: 40 shaders in all.

use std::borrow::Cow;

use super::context::Context;
use super::folding::folded;

macro_rules! piece {
    ($($name:ident $file:literal),* $(,)?) => {
        $(const $name: &str = include_str!(concat!("../../shaders/lib/", $file, ".wgsl"));)*
    };
}

piece!(
    ALONE "alone",
    BLOCKS "blocks",
    CELLS "cells",
    CLASSIFY "classify",
    CUT "cut",
    EMPTY "empty",
    ENTRIES "entries",
    FACES "faces",
    FIELD "field",
    FOOTPRINT "footprint",
    FRAME "frame",
    GATHER "gather",
    GATHERED_AMONG "gathered_among",
    GATHERED_LIGHT "gathered_light",
    LEVELS "levels",
    LIGHT "light",
    LIGHT_OF_SAMPLES "light_of_samples",
    LISTS "lists",
    NO_POLYGONS "no_polygons",
    NO_VECTORS "no_vectors",
    OPACITY "opacity",
    POLYGONS "polygons",
    POLYGON_CORNERS "polygon_corners",
    PROJECT "project",
    RAYS "rays",
    SAMPLES "samples",
    SHADE "shade",
    SHADED_SAMPLES "shaded_samples",
    SHARE "share",
    SLABS "slabs",
    SORT "sort",
    SPECKS "specks",
    SURFACES "surfaces",
    TOTALS "totals",
    TRAVERSAL "traversal",
    UNLIT "unlit",
    VECTORS "vectors",
    VECTOR_FRAME "vector_frame",
);

/// Before the pieces of vectors, whose kernel may be another than the pass's: it has names of its own there.
const OF_MARKS: &str = "// Of the splats of vectors:\n";
/// What those names begin with.
const MARKS_PREFIX: &str = "marks_";

/// Whether a name is of one radial kernel: its footprint, its shares, and their coefficients.
fn is_of_a_kernel(word: &str) -> bool {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    matches!(word, "footprint" | "share" | "rim_root")
        || word.strip_prefix(['c', 's']).is_some_and(is_number)
}

/// A piece with names of its own for what is of a kernel.
fn of_marks(piece: &str) -> String {
    let is_in_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut renamed = String::with_capacity(piece.len());
    let mut rest = piece;
    while let Some(start) = rest.find(is_in_word) {
        let end = rest[start..].find(|c| !is_in_word(c)).map_or(rest.len(), |n| start + n);
        let word = &rest[start..end];
        renamed.push_str(&rest[..start]);
        renamed.push_str(if is_of_a_kernel(word) { MARKS_PREFIX } else { "" });
        renamed.push_str(word);
        rest = &rest[end..];
    }
    renamed + rest
}

/// The most pieces that a shader is stitched of.
const MOST_PIECES: usize = 21;

/// A pass's shader: its name is the file's, the pass's label and the timing row's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shader {
    /// Name of the pass.
    pub name: &'static str,
    /// What the pass has beside what it always has; empty where there is but one.
    pub options: &'static str,
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
    Shader { name, options: "", pieces: all }
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
shader!(SUM_COUNTS, "sum_counts", BLOCKS);
shader!(SCAN_COUNTS, "scan_counts", BLOCKS);
shader!(EMIT_KERNELS, "emit_kernels", TRAVERSAL);
shader!(MERGE_BRICKS, "merge_bricks", TRAVERSAL, OPACITY);
shader!(SPLAT, "splat", FRAME, PROJECT, FOOTPRINT, OPACITY);
shader!(COUNT_ENTRIES, "count_entries", FRAME, PROJECT, FOOTPRINT, OPACITY, LISTS, ENTRIES);
shader!(
    COUNT_VECTORS,
    "count_vectors",
    FRAME,
    PROJECT,
    FOOTPRINT,
    OPACITY,
    LISTS,
    ENTRIES,
    VECTOR_FRAME
);
shader!(WRITE_ENTRIES, "write_entries", LISTS);
shader!(COUNT_DIGITS, "count_digits", SORT);
shader!(SCATTER_DIGITS, "scatter_digits", SORT);
shader!(FIND_RANGES, "find_ranges", LISTS);
shader!(
    COMPOSITE_LISTS,
    "composite_lists",
    FRAME,
    PROJECT,
    FOOTPRINT,
    SHARE,
    OPACITY,
    LISTS,
    TOTALS
);
shader!(COUNT_POLYGONS, "count_polygons", POLYGON_CORNERS);
shader!(PLACE_POLYGONS, "place_polygons",);
shader!(WRITE_POLYGONS, "write_polygons", POLYGON_CORNERS);
shader!(SORT_POLYGONS, "sort_polygons",);
shader!(
    SHADE_SAMPLES,
    "shade_samples",
    TRAVERSAL,
    OPACITY,
    GATHER,
    GATHERED_LIGHT,
    TOTALS,
    SHADED_SAMPLES,
    SHADE
);
shader!(PROJECT_VALUES, "project_values", SLABS, FIELD, CELLS, CLASSIFY, EMPTY, RAYS, TOTALS);
shader!(PRESENT, "present",);
shader!(PICTURE, "picture",);

/// What lies among what a pass along rays composites.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Among {
    /// Polygons.
    pub polygons: bool,
    /// Vector splats.
    pub vectors: bool,
}

impl Among {
    /// Every one there is.
    const ALL: [Self; 4] = [
        Self { polygons: false, vectors: false },
        Self { polygons: true, vectors: false },
        Self { polygons: false, vectors: true },
        Self { polygons: true, vectors: true },
    ];

    const fn options(self) -> &'static str {
        match (self.polygons, self.vectors) {
            (false, false) => "",
            (true, false) => "polygons",
            (false, true) => "vectors",
            (true, true) => "polygons, vectors",
        }
    }

    /// A ray's light, and polygons. Of those, light lies on four samples of a pixel.
    const fn light(self) -> [&'static str; 2] {
        if self.polygons { [LIGHT_OF_SAMPLES, POLYGONS] } else { [LIGHT, NO_POLYGONS] }
    }

    const fn vectors(self) -> [&'static str; 5] {
        if self.vectors {
            [OF_MARKS, FOOTPRINT, SHARE, VECTOR_FRAME, VECTORS]
        } else {
            [NO_VECTORS, "", "", "", ""]
        }
    }
}

/// Gathers boxes and separable kernels, cell by cell (`gather_cells`), or radial kernels and points, slice by slice
/// (`gather_kernels`).
pub const fn gather(cells: bool, among: Among) -> Shader {
    let [name, footprint, share, walk] = if cells {
        ["gather_cells", "", "", include_str!("../../shaders/gather_cells.wgsl")]
    } else {
        ["gather_kernels", FOOTPRINT, SHARE, include_str!("../../shaders/gather_kernels.wgsl")]
    };
    let alone = !among.polygons && !among.vectors;
    let [light, polygons] = if alone { [GATHERED_LIGHT, ""] } else { among.light() };
    // Of both, light lies on four samples.
    let light = if alone { light } else { LIGHT_OF_SAMPLES };
    let gathered = if alone { "" } else { GATHERED_AMONG };
    let [marks, others, parts, frame, vectors] = if alone { [""; 5] } else { among.vectors() };
    let pieces = &[
        TRAVERSAL, footprint, share, OPACITY, TOTALS, GATHER, light, gathered, SAMPLES, polygons,
        walk, marks, others, parts, frame, vectors,
    ];
    Shader { options: among.options(), ..stitched(name, pieces) }
}

/// Composites slabs of a reconstructed field (`reconstruct_slabs`), lit or by value alone.
pub const fn slabs(lit: bool, among: Among) -> Shader {
    let [shade, faces, levels] = if lit { [SHADE, FACES, LEVELS] } else { [UNLIT, "", ""] };
    let [light, polygons] = among.light();
    let [marks, others, parts, frame, vectors] = among.vectors();
    let walk = include_str!("../../shaders/reconstruct_slabs.wgsl");
    let pieces = &[
        SLABS, FIELD, CELLS, CLASSIFY, SPECKS, EMPTY, light, TOTALS, RAYS, SURFACES, levels, shade,
        faces, polygons, CUT, walk, marks, others, parts, frame, vectors,
    ];
    let options = match (lit, among.polygons, among.vectors) {
        (false, ..) => among.options(),
        (true, false, false) => "lit",
        (true, true, false) => "lit, polygons",
        (true, false, true) => "lit, vectors",
        (true, true, true) => "lit, polygons, vectors",
    };
    Shader { options, ..stitched(RECONSTRUCT_SLABS, pieces) }
}

/// Composites what there is without a field (`composite_vectors`): slabs of vectors, polygons, or both.
pub const fn alone(among: Among) -> Shader {
    let [light, polygons] = among.light();
    let [marks, others, parts, frame, vectors] = among.vectors();
    let walk = include_str!("../../shaders/composite_vectors.wgsl");
    let pieces = &[light, TOTALS, polygons, ALONE, walk, marks, others, parts, frame, vectors];
    Shader { options: among.options(), ..stitched(COMPOSITE_VECTORS, pieces) }
}

/// Name of the pass that composites slabs of a reconstructed field.
pub const RECONSTRUCT_SLABS: &str = "reconstruct_slabs";

/// Name of the pass that composites slabs of vectors, and polygons, without a field.
pub const COMPOSITE_VECTORS: &str = "composite_vectors";

/// Every shader there is.
pub static ALL: [Shader; 40] = {
    let single = [
        COUNT_SEGMENTS,
        SUM_COUNTS,
        SCAN_COUNTS,
        EMIT_KERNELS,
        MERGE_BRICKS,
        SPLAT,
        COUNT_ENTRIES,
        COUNT_VECTORS,
        WRITE_ENTRIES,
        COUNT_DIGITS,
        SCATTER_DIGITS,
        FIND_RANGES,
        COMPOSITE_LISTS,
        COUNT_POLYGONS,
        PLACE_POLYGONS,
        WRITE_POLYGONS,
        SORT_POLYGONS,
        SHADE_SAMPLES,
        PROJECT_VALUES,
        PRESENT,
        PICTURE,
        alone(Among::ALL[1]),
        alone(Among::ALL[2]),
        alone(Among::ALL[3]),
    ];
    let mut all = [PRESENT; 40];
    let mut i = 0;
    while i < single.len() {
        all[i] = single[i];
        i += 1;
    }
    let mut k = 0;
    while k < 4 {
        let (among, at) = (Among::ALL[k], i + 4 * k);
        all[at] = gather(false, among);
        all[at + 1] = gather(true, among);
        all[at + 2] = slabs(false, among);
        all[at + 3] = slabs(true, among);
        k += 1;
    }
    all
};

impl Shader {
    /// Whether a file's text is part of it.
    pub fn has_piece(&self, text: &str) -> bool {
        self.pieces.contains(&text)
    }

    /// The stitched source.
    pub fn source(&self) -> String {
        let mut are_of_marks = false;
        let pieces = self.pieces.iter().map(|piece| {
            are_of_marks |= *piece == OF_MARKS;
            if are_of_marks { of_marks(piece) } else { (*piece).to_owned() }
        });
        pieces.collect()
    }

    /// The module on a device, with the values of its overrides, and those that a pipeline is still to be told: none, but of a
    /// text that does not hold, about which the device says more. Where the adapter does not end loops by itself, nothing else
    /// counts their turns.
    #[expect(
        unsafe_code,
        reason = "counting the turns of every loop takes registers and time, and ends none here"
    )]
    pub(super) fn module<'a>(
        &self,
        context: &Context,
        constants: &'a [(&'static str, f64)],
    ) -> (wgpu::ShaderModule, &'a [(&'static str, f64)]) {
        let source = self.source();
        let (source, constants) = match folded(&source, constants) {
            Some(module) => (wgpu::ShaderSource::Naga(Cow::Owned(module)), &constants[..0]),
            None => (wgpu::ShaderSource::Wgsl(source.into()), constants),
        };
        let described = wgpu::ShaderModuleDescriptor { label: Some(self.name), source };
        if context.ends_loops {
            return (context.device.create_shader_module(described), constants);
        }
        let checks = wgpu::ShaderRuntimeChecks {
            force_loop_bounding: false,
            ..wgpu::ShaderRuntimeChecks::checked()
        };
        // SAFETY: all of a module's other checks are on, that of bounds among them. What is asked for beside them is
        // that no loop is endless. The text is this program's own, no part of it comes from a file that is opened. In
        // each of its loops a turn takes a counter towards an end that was known before the loop, a list's, a ray's or
        // a tree's, or the loop ends; conditions of numbers that are none are false, and end it, too.
        let module = unsafe { context.device.create_shader_module_trusted(described, checks) };
        (module, constants)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_is_folded_for_every_kernel() {
        for shader in &ALL {
            assert!(folded(&shader.source(), &[]).is_some(), "{} {}", shader.name, shader.options);
        }
        for kernel in 0..10 {
            for (lit, among) in [(false, Among::ALL[0]), (true, Among::ALL[3])] {
                let shader = slabs(lit, among);
                let constants = [("kernel", f64::from(kernel))];
                let module = folded(&shader.source(), &constants).expect("a module");
                let has = |name: &str| {
                    let names = || module.functions.iter().filter_map(|(_, f)| f.name.as_deref());
                    names().any(|own| own == name)
                };
                assert_eq!(
                    (has("cell_at"), has("radial_mean")),
                    (kernel == 8, matches!(kernel, 2 | 3))
                );
            }
        }
    }

    #[test]
    fn pictures_have_what_a_cut_asks_for_only_where_they_are_of_one() {
        for lit in [false, true] {
            let source = slabs(lit, Among::ALL[1]).source();
            for (constant, walks) in [(0.0, [true, false, false]), (1.0, [false, true, true])] {
                let module = folded(&source, &[("of_cut", constant)]).expect("a module");
                let names: Vec<_> =
                    module.functions.iter().filter_map(|(_, f)| f.name.as_deref()).collect();
                let has = ["ray", "ray_of_cut", "cut_word"].map(|name| names.contains(&name));
                assert_eq!(has, walks, "{lit} {names:?}");
            }
        }
    }
}
