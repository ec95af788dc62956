//! The picture under way: its light, its encoding, and bringing both back.

use super::context::Context;

/// The picture under way.
#[derive(Debug)]
pub(super) struct Target {
    pub(super) size: [u32; 2],
    pub(super) light: wgpu::Texture,
    pub(super) encoded: Option<wgpu::Texture>,
    pub(super) staging: Option<wgpu::Buffer>,
}

/// What light is kept as that passes write themselves.
pub(super) const WRITTEN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// What light is kept as that is blended.
pub(super) fn blended_format(context: &Context) -> wgpu::TextureFormat {
    if context.granted.float32_blending { WRITTEN } else { wgpu::TextureFormat::Rgba16Float }
}
