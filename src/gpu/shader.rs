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
const WHOLE: &str = include_str!("../../shaders/lib/whole.wgsl");
const UNLIT: &str = include_str!("../../shaders/lib/unlit.wgsl");
const SHADE: &str = include_str!("../../shaders/lib/shade.wgsl");
const FACE_BSPLINE: &str = include_str!("../../shaders/lib/face_bspline.wgsl");
const FACE_TENTS: &str = include_str!("../../shaders/lib/face_tents.wgsl");
const FACE_DIFFERENCES: &str = include_str!("../../shaders/lib/face_differences.wgsl");
const PARTS: &str = include_str!("../../shaders/lib/parts.wgsl");

/// A pass's shader: its name is the file's, the pass's label and the timing row's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shader {
    /// Name of the pass.
    pub name: &'static str,
    parts: &'static [&'static str],
}

macro_rules! shader {
    ($name:ident, $file:literal, $($library:expr),*) => {
        #[doc = concat!("`shaders/", $file, ".wgsl`.")]
        pub const $name: Shader = Shader {
            name: $file,
            parts: &[$($library,)* include_str!(concat!("../../shaders/", $file, ".wgsl"))],
        };
    };
}

shader!(COUNT_SEGMENTS, "count_segments", TRAVERSAL);
shader!(SCAN_SEGMENTS, "scan_segments",);
shader!(EMIT_KERNELS, "emit_kernels", TRAVERSAL);
shader!(SPLAT, "splat", FRAME, PROJECT, FOOTPRINT, OPACITY);
shader!(COUNT_ENTRIES, "count_entries", FRAME, PROJECT, FOOTPRINT, OPACITY, LISTS);
shader!(WRITE_ENTRIES, "write_entries", LISTS);
shader!(COUNT_DIGITS, "count_digits", SORT);
shader!(SCATTER_DIGITS, "scatter_digits", SORT);
shader!(FIND_RANGES, "find_ranges", LISTS);
shader!(COMPOSITE_LISTS, "composite_lists", FRAME, PROJECT, FOOTPRINT, SHARE, OPACITY, LISTS);
shader!(GATHER_KERNELS, "gather_kernels", TRAVERSAL, FOOTPRINT, SHARE, OPACITY, WHOLE, GATHER);
shader!(GATHER_CELLS, "gather_cells", TRAVERSAL, OPACITY, WHOLE, GATHER);
shader!(PRESENT, "present",);
shader!(PICTURE, "picture",);
shader!(RECONSTRUCT_SLABS, "reconstruct_slabs", WHOLE, UNLIT);
// With lights or shading tables.
shader!(SHADE_BSPLINES, "reconstruct_slabs", WHOLE, SHADE, FACE_BSPLINE);
shader!(SHADE_TENTS, "reconstruct_slabs", WHOLE, SHADE, FACE_TENTS);
shader!(SHADE_SLABS, "reconstruct_slabs", WHOLE, SHADE, FACE_DIFFERENCES);
// The same where an adapter's loops end too soon for a whole ray.
shader!(
    GATHER_KERNELS_IN_PARTS,
    "gather_kernels",
    TRAVERSAL,
    FOOTPRINT,
    SHARE,
    OPACITY,
    PARTS,
    GATHER
);
shader!(GATHER_CELLS_IN_PARTS, "gather_cells", TRAVERSAL, OPACITY, PARTS, GATHER);
shader!(RECONSTRUCT_SLABS_IN_PARTS, "reconstruct_slabs", PARTS, UNLIT);
shader!(SHADE_BSPLINES_IN_PARTS, "reconstruct_slabs", PARTS, SHADE, FACE_BSPLINE);
shader!(SHADE_TENTS_IN_PARTS, "reconstruct_slabs", PARTS, SHADE, FACE_TENTS);
shader!(SHADE_SLABS_IN_PARTS, "reconstruct_slabs", PARTS, SHADE, FACE_DIFFERENCES);

/// Every shader there is.
pub const ALL: [Shader; 24] = [
    COUNT_SEGMENTS,
    SCAN_SEGMENTS,
    EMIT_KERNELS,
    SPLAT,
    GATHER_KERNELS,
    GATHER_CELLS,
    COUNT_ENTRIES,
    WRITE_ENTRIES,
    COUNT_DIGITS,
    SCATTER_DIGITS,
    FIND_RANGES,
    COMPOSITE_LISTS,
    PRESENT,
    PICTURE,
    RECONSTRUCT_SLABS,
    GATHER_KERNELS_IN_PARTS,
    GATHER_CELLS_IN_PARTS,
    RECONSTRUCT_SLABS_IN_PARTS,
    SHADE_BSPLINES,
    SHADE_TENTS,
    SHADE_SLABS,
    SHADE_BSPLINES_IN_PARTS,
    SHADE_TENTS_IN_PARTS,
    SHADE_SLABS_IN_PARTS,
];

impl Shader {
    /// The stitched source.
    pub fn source(&self) -> String {
        self.parts.concat()
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
