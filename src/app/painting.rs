//! The one bridge between the engine's pictures and the screen: a texture, and the pipeline that paints it.
//!
//! A pipeline of our own (`shaders/picture.wgsl`), so that every byte arrives on screen as the engine
//! wrote it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use eframe::egui::{PaintCallback, PaintCallbackInfo, Rect};
use eframe::egui_wgpu;
pub use wgpu::TextureFormat as ScreenFormat;

use crate::gpu::shader;
use crate::task::engine::{Picture, SecondPicture};

/// A picture, and what painting it needs to know.
#[derive(Clone)]
pub(super) struct Shown {
    pub(super) picture: Arc<Picture>,
    pub(super) has_holes: bool,
    /// The colour of all of its pixels but specks, where they have one.
    pub(super) only_colour: Option<[u8; 4]>,
}

/// One painting of a picture, whoever paints it.
#[derive(Clone)]
pub(super) struct Painted {
    pub(super) picture: Arc<Picture>,
    /// What is painted with it: subtracted from it, or the one before it.
    pub(super) other: Option<Arc<Picture>>,
    pub(super) entry: Entry,
    /// How much larger the difference is shown, or the share of the other.
    pub(super) amount: f32,
    /// Over what is there, rather than instead of it.
    pub(super) blended: bool,
}

impl std::fmt::Debug for Painted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Painted").field("entry", &self.entry).finish_non_exhaustive()
    }
}

impl Painted {
    /// Numbers that two paintings share only if they are the same, as long as the pictures of both live.
    pub(super) fn identity(&self) -> [u64; 5] {
        let address = |picture: &Arc<Picture>| Arc::as_ptr(picture).addr() as u64;
        [
            address(&self.picture),
            self.other.as_ref().map_or(0, address),
            self.entry as u64,
            u64::from(self.amount.to_bits()),
            u64::from(self.blended),
        ]
    }
}

/// What of two pictures is painted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    First,
    Second,
    /// This many times as large.
    Difference(f32),
    /// The first, and this share of the one before it.
    Fade(f32),
}

/// Which pipeline paints a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Variant {
    format: wgpu::TextureFormat,
    entry: Entry,
    /// Over what is there, rather than instead of it.
    blended: bool,
}

/// How pictures become pixels: the fragment shader, and with it what is bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Entry {
    /// Pixel for pixel.
    Exact,
    /// Enlarged smoothly.
    Enlarged,
    /// Two pictures, pixel for pixel.
    Difference,
    /// Two pictures over each other, both enlarged smoothly.
    Faded,
}

impl Entry {
    fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Enlarged => "enlarged",
            Self::Difference => "difference",
            Self::Faded => "faded",
        }
    }
}

/// One painting of one picture, as egui's renderer runs it.
pub(super) struct PaintPicture {
    pub(super) shown: Arc<Mutex<Option<Shown>>>,
    pub(super) second: Option<Arc<SecondPicture>>,
    /// What gives way to the first.
    pub(super) from: Option<Arc<Picture>>,
    pub(super) part: Part,
    /// What the adapter that paints the window holds; `None` where the processor paints it.
    pub(super) format: Option<ScreenFormat>,
    /// Size of the place on screen, physical pixels.
    pub(super) area: [u32; 2],
}

/// What is kept on the window's device between paintings.
#[derive(Default)]
struct Kept {
    first: Uploaded,
    /// Only while two pictures are shown.
    second: Uploaded,
    pipelines: HashMap<Variant, wgpu::RenderPipeline>,
    /// What is bound for the first picture, the second, and both.
    bound: [Option<(Variant, wgpu::BindGroup)>; 3],
    /// How much larger the difference is shown, or the share of the second.
    amount: Option<wgpu::Buffer>,
}

/// A picture on the window's device.
#[derive(Default)]
struct Uploaded {
    texture: Option<wgpu::Texture>,
    /// What the texture holds.
    picture: Option<Arc<Picture>>,
}

impl Uploaded {
    /// Uploads a picture unless it is there already; the texture is kept while its size fits.
    /// Whether there is another texture now.
    fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        picture: &Arc<Picture>,
    ) -> bool {
        if self.picture.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, picture)) {
            return false;
        }
        let [width, height] = picture.size;
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let is_new = self.texture.as_ref().is_none_or(|texture| texture.size() != size);
        if is_new {
            self.texture = Some(device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            }));
        }
        let Some(texture) = &self.texture else { return is_new };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * width),
            rows_per_image: None,
        };
        queue.write_texture(texture.as_image_copy(), &picture.rgba, layout, size);
        self.picture = Some(Arc::clone(picture));
        is_new
    }
}

impl Kept {
    /// Brings the textures up to what is shown; bind groups of others are let go.
    fn upload(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        first: &Arc<Picture>,
        second: Option<&Arc<Picture>>,
    ) {
        let mut stale = self.first.upload(device, queue, first);
        match second {
            Some(second) => stale |= self.second.upload(device, queue, second),
            None => {
                stale |= self.second.texture.is_some();
                self.second = Uploaded::default();
            }
        }
        if stale {
            self.bound = Default::default();
        }
    }

    fn set_amount(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, amount: f32) {
        let buffer = self.amount.get_or_insert_with(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("amount"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        queue.write_buffer(buffer, 0, bytemuck::bytes_of(&[amount, 0.0, 0.0, 0.0]));
    }

    fn bind(&mut self, device: &wgpu::Device, variant: Variant, place: usize) {
        let shown = if place == 1 { &self.second } else { &self.first };
        let Some(texture) = &shown.texture else { return };
        if self.bound[place].as_ref().is_some_and(|(bound, _)| *bound == variant) {
            return;
        }
        let pipeline = self.pipelines.entry(variant).or_insert_with(|| pipeline(device, variant));
        let view = texture.create_view(&Default::default());
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries = vec![entry(0, wgpu::BindingResource::TextureView(&view))];
        let other = self.second.texture.as_ref().map(|t| t.create_view(&Default::default()));
        match (variant.entry, &other, &self.amount) {
            (Entry::Exact | Entry::Enlarged, ..) => {}
            (Entry::Difference | Entry::Faded, Some(other), Some(amount)) => {
                entries.push(entry(1, wgpu::BindingResource::TextureView(other)));
                entries.push(entry(2, amount.as_entire_binding()));
            }
            (Entry::Difference | Entry::Faded, ..) => return,
        }
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        self.bound[place] = Some((variant, group));
    }
}

fn pipeline(device: &wgpu::Device, variant: Variant) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader::PICTURE.name),
        source: wgpu::ShaderSource::Wgsl(shader::PICTURE.source().into()),
    });
    let linear = f64::from(u8::from(variant.format.is_srgb()));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(shader::PICTURE.name),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(variant.entry.name()),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[("linear_target", linear)],
                ..Default::default()
            },
            targets: &[Some(wgpu::ColorTargetState {
                format: variant.format,
                blend: variant.blended.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

impl egui_wgpu::CallbackTrait for PaintPicture {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &egui_wgpu::ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut egui_wgpu::CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let (Some(shown), Some(format)) = (lock(&self.shown).clone(), self.format) else {
            return Vec::new();
        };
        let picture = &shown.picture;
        let kept = resources.entry::<Kept>().or_insert_with(Kept::default);
        let second = self.other_of(picture);
        kept.upload(device, queue, picture, second);
        let (entry, amount) = self.entry(picture);
        if matches!(entry, Entry::Difference | Entry::Faded) {
            kept.set_amount(device, queue, amount);
        }
        let blended = shown.has_holes && entry != Entry::Difference;
        let variant = Variant { format, entry, blended };
        kept.bind(device, variant, self.place(picture));
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &egui_wgpu::CallbackResources,
    ) {
        let Some(kept) = resources.get::<Kept>() else { return };
        let Some(place) = lock(&self.shown).as_ref().map(|shown| self.place(&shown.picture)) else {
            return;
        };
        let Some((variant, group)) = &kept.bound[place] else { return };
        let Some(pipeline) = kept.pipelines.get(variant) else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl PaintPicture {
    /// What egui hands to whoever paints the window.
    pub(super) fn callback(self, rect: Rect) -> PaintCallback {
        match self.format {
            Some(_) => egui_wgpu::Callback::new_paint_callback(rect, self),
            None => PaintCallback { rect, callback: Arc::new(self) },
        }
    }

    /// What the processor paints; `None` before the first picture.
    pub(super) fn painted(&self) -> Option<Painted> {
        let shown = lock(&self.shown).clone()?;
        let (entry, amount) = self.entry(&shown.picture);
        let other = self.other_of(&shown.picture).cloned();
        let blended = shown.has_holes && entry != Entry::Difference;
        let picture = match (self.part, &other) {
            (Part::Second, Some(second)) => Arc::clone(second),
            _ => shown.picture,
        };
        Some(Painted { picture, other, entry, amount, blended })
    }

    /// How the first picture is painted, with how much of the other.
    fn entry(&self, picture: &Arc<Picture>) -> (Entry, f32) {
        let has_other = self.other_of(picture).is_some();
        let exact = picture.size == self.area && picture.requested_size == self.area;
        match self.part {
            Part::Difference(gain) if has_other => (Entry::Difference, gain),
            Part::Fade(share) if has_other => (Entry::Faded, share),
            _ if exact => (Entry::Exact, 0.0),
            _ => (Entry::Enlarged, 0.0),
        }
    }

    /// The second picture, unless a newer first one came in the pass that queued this.
    fn second_of(&self, first: &Arc<Picture>) -> Option<&Arc<SecondPicture>> {
        self.second.as_ref().filter(|second| Arc::ptr_eq(&second.first, first))
    }

    /// What is painted beside the first picture, or over it.
    fn other_of(&self, first: &Arc<Picture>) -> Option<&Arc<Picture>> {
        match self.part {
            Part::Fade(_) => self.from.as_ref(),
            _ => self.second_of(first).map(|second| &second.picture),
        }
    }

    /// Where in [`Kept::bound`] what is painted stands.
    fn place(&self, first: &Arc<Picture>) -> usize {
        match (self.part, self.other_of(first)) {
            (Part::First, _) | (_, None) => 0,
            (Part::Second, Some(_)) => 1,
            (Part::Difference(_) | Part::Fade(_), Some(_)) => 2,
        }
    }
}

pub(super) fn lock(shown: &Mutex<Option<Shown>>) -> MutexGuard<'_, Option<Shown>> {
    // Replaced in one step: a panic elsewhere leaves it whole.
    shown.lock().unwrap_or_else(PoisonError::into_inner)
}
