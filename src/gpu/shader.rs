//! The shaders, each with the library pieces it needs in front.

const FRAME: &str = include_str!("../../shaders/lib/frame.wgsl");
const TRAVERSAL: &str = include_str!("../../shaders/lib/traversal.wgsl");

/// A pass's shader: its name is the file's, the pass's label and the timing row's.
#[derive(Debug, Clone, Copy)]
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
shader!(SPLAT, "splat", FRAME);
shader!(PRESENT, "present",);
shader!(PICTURE, "picture",);
shader!(RECONSTRUCT_SLABS, "reconstruct_slabs",);

/// Every shader there is.
pub const ALL: [Shader; 7] =
    [COUNT_SEGMENTS, SCAN_SEGMENTS, EMIT_KERNELS, SPLAT, PRESENT, PICTURE, RECONSTRUCT_SLABS];

impl Shader {
    /// The stitched source.
    pub fn source(&self) -> String {
        self.parts.concat()
    }

    /// The module on a device.
    pub(super) fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.source().into()),
        })
    }

    /// The module where the picture under way is stored in 16-bit floats (`half_target`) or in
    /// 32-bit ones, as written. Shaders name the format of what they store.
    pub(super) fn module_for(
        &self,
        device: &wgpu::Device,
        half_target: bool,
    ) -> wgpu::ShaderModule {
        if !half_target {
            return self.module(device);
        }
        let source = self.source().replace("rgba32float", "rgba16float");
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }
}
