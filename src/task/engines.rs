//! The two engines: which of them draws a plan, and which of them has the picture.
//!
//! The rule is fixed: discrete, integrated and virtual GPUs draw by themselves; where there is only the processor, or
//! nothing, the native engine draws. What it does not draw, splats as triangles and fields of more samples than it counts
//! (`native::supports`), goes to the adapter that there is, which is made then. What is wrong with a scene, neither draws.

use std::path::Path;
use std::sync::LazyLock;

use serde::Serialize;

use super::engine::HeldBytes;
use crate::core::LinearRgb;
use crate::gpu::{AdapterChoice, Context, GpuError, Renderer, Wishes, has_hardware};
use crate::native;
use crate::plan::Plan;

/// Which engine is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EngineChoice {
    /// By the rule.
    #[default]
    Auto,
    /// The processor's own.
    Native,
    /// A graphics adapter's.
    Gpu,
}

/// Which engine draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EngineKind {
    /// The processor's own.
    Native,
    /// A graphics adapter's.
    #[default]
    Gpu,
}

impl EngineKind {
    /// Its name in flags and statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Gpu => "gpu",
        }
    }
}

/// What is to draw.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Choice {
    /// The engine. Who names an adapter means the GPU engine.
    pub engine: EngineChoice,
    /// The adapter, where one is needed.
    pub adapter: AdapterChoice,
}

impl From<AdapterChoice> for Choice {
    fn from(adapter: AdapterChoice) -> Self {
        Self { engine: EngineChoice::Auto, adapter }
    }
}

impl From<EngineChoice> for Choice {
    fn from(engine: EngineChoice) -> Self {
        Self { engine, adapter: AdapterChoice::Auto }
    }
}

impl Choice {
    /// The engine that a choice leads to here. Drivers are asked only where that decides.
    pub fn kind(&self) -> EngineKind {
        match self.engine {
            EngineChoice::Native => EngineKind::Native,
            EngineChoice::Gpu => EngineKind::Gpu,
            EngineChoice::Auto if self.adapter != AdapterChoice::Auto => EngineKind::Gpu,
            EngineChoice::Auto if has_hardware_node() => EngineKind::Gpu,
            EngineChoice::Auto => EngineKind::Native,
        }
    }

    /// Whether a graphics adapter paints the window: the one that the GPU engine is asked to draw with, or any graphics
    /// processor. A processor in disguise would paint it more slowly than the processor does.
    pub fn wants_adapter(&self) -> bool {
        self.kind() == EngineKind::Gpu || has_hardware_node()
    }
}

/// Whether there is a graphics processor with a driver that answers.
fn has_hardware_node() -> bool {
    static FOUND: LazyLock<bool> = LazyLock::new(|| has_nodes() && has_hardware());
    *FOUND
}

/// A picture that is being drawn, or was.
pub trait Canvas {
    /// Its sRGB bytes with straight alpha, over a background.
    ///
    /// # Errors
    /// A failing device.
    fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError>;
}

impl Canvas for Renderer {
    fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError> {
        Self::present(self, background)
    }
}

impl Canvas for native::Renderer {
    fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError> {
        Ok(self.srgb_bytes(background))
    }
}

/// Whether the system has a node of any graphics processor. Where Linux has none, no driver's library is loaded to look
/// for one: some write to standard error.
fn has_nodes() -> bool {
    const NODES: [&str; 5] = ["/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/kfd", "/dev/mali0"];
    !cfg!(target_os = "linux") || NODES.iter().any(|node| Path::new(node).exists())
}

/// Both engines, as far as they were needed.
#[derive(Debug)]
pub struct Engines {
    kind: EngineKind,
    choice: Choice,
    wishes: Wishes,
    gpu: Option<Renderer>,
    /// The processor's.
    pub native: native::Renderer,
    /// Which has the picture.
    drew: EngineKind,
}

impl Engines {
    /// What a choice leads to here. An adapter is looked for only where the choice asks for one.
    ///
    /// # Errors
    /// No adapter, where one was asked for, or its driver's refusal.
    pub fn new(choice: Choice, wishes: Wishes) -> Result<Self, GpuError> {
        let kind = choice.kind();
        let native = native::Renderer::new();
        let mut engines = Self { kind, choice, wishes, gpu: None, native, drew: kind };
        if kind == EngineKind::Gpu {
            engines.gpu()?;
        }
        Ok(engines)
    }

    /// The GPU engine alone.
    pub fn of_gpu(renderer: Renderer) -> Self {
        let (kind, choice) = (EngineKind::Gpu, EngineChoice::Gpu.into());
        let native = native::Renderer::new();
        Self { kind, choice, wishes: Wishes::default(), gpu: Some(renderer), native, drew: kind }
    }

    /// The engine that the rule or the choice leads to.
    pub fn kind(&self) -> EngineKind {
        self.kind
    }

    /// Which engine draws a plan.
    pub fn of_plan(&self, plan: &Plan) -> EngineKind {
        match native::supports(plan) {
            Ok(()) => self.kind,
            Err(_) => EngineKind::Gpu,
        }
    }

    /// Why a plan goes to a graphics adapter, where the native engine was to draw: words that stand after "the native
    /// engine does not draw".
    pub fn why_not_native(&self, plan: &Plan) -> Option<String> {
        let refused = native::supports(plan).err().filter(|_| self.kind == EngineKind::Native);
        refused.map(|reason| reason.to_string())
    }

    /// Has the engine that draws a plan at hand.
    ///
    /// # Errors
    /// One sentence, where the native engine does not draw it and no adapter is there.
    pub fn ready(&mut self, plan: &Plan) -> Result<(), GpuError> {
        if self.of_plan(plan) == EngineKind::Native {
            return Ok(());
        }
        let reason = self.why_not_native(plan);
        let is_named = self.choice.adapter != AdapterChoice::Auto;
        match (self.gpu(), reason) {
            (Err(GpuError::NoAdapter { .. }), Some(reason)) if !is_named => {
                Err(GpuError::Unsupported(format!(
                    "expected a plan that the native engine draws, or a graphics adapter, found neither: the native \
                 engine does not draw {reason}; leave that out, or install a Vulkan driver (on Debian and Ubuntu: \
                 mesa-vulkan-drivers)"
                )))
            }
            (Err(error), _) => Err(error),
            (Ok(_), _) => Ok(()),
        }
    }

    /// The GPU engine, made where there is none yet.
    ///
    /// # Errors
    /// No adapter, or its driver's refusal.
    pub fn gpu(&mut self) -> Result<&mut Renderer, GpuError> {
        if self.gpu.is_none() {
            let context = Context::new(&self.choice.adapter, self.wishes)?;
            self.gpu = Some(Renderer::new(context));
        }
        self.gpu.as_mut().ok_or_else(|| GpuError::Device("no device".to_owned()))
    }

    /// The GPU engine, if it was made.
    pub fn made_gpu(&self) -> Option<&Renderer> {
        self.gpu.as_ref()
    }

    /// The same, to be changed.
    pub(super) fn made_gpu_mut(&mut self) -> Option<&mut Renderer> {
        self.gpu.as_mut()
    }

    /// The GPU engine, for work that is watched meanwhile, until [`Engines::put_gpu`].
    ///
    /// # Errors
    /// See [`Engines::gpu`].
    pub(super) fn take_gpu(&mut self) -> Result<Renderer, GpuError> {
        self.gpu()?;
        self.gpu.take().ok_or_else(|| GpuError::Device("no device".to_owned()))
    }

    /// Puts it back.
    pub(super) fn put_gpu(&mut self, renderer: Renderer) {
        self.gpu = Some(renderer);
    }

    /// Notes which engine has the picture.
    pub(super) fn note(&mut self, drew: EngineKind) {
        self.drew = drew;
    }

    /// Which engine has the picture.
    pub fn drew(&self) -> EngineKind {
        self.drew
    }

    /// The name of what has the picture, for people and statistics: an adapter, or the processor's instructions.
    pub fn name(&self) -> String {
        match (self.drew, &self.gpu) {
            (EngineKind::Gpu, Some(renderer)) => renderer.context().adapter_name.clone(),
            _ => format!("native ({})", self.native.name()),
        }
    }

    /// The picture: premultiplied linear RGBA, rows from the top.
    ///
    /// # Errors
    /// A failing device.
    pub fn read_light(&mut self) -> Result<Vec<[f32; 4]>, GpuError> {
        match self.drew {
            EngineKind::Native => Ok(self.native.light().0),
            EngineKind::Gpu => self.gpu()?.read_light(),
        }
    }

    /// The native engine's loop that drew the picture; `None` where the other did, or nothing was to be drawn.
    pub fn native_loop(&self) -> Option<&'static str> {
        self.native.loop_name().filter(|_| self.drew == EngineKind::Native)
    }

    /// Bytes that the engine with the picture holds.
    pub fn held(&self) -> HeldBytes {
        match (self.drew, &self.gpu) {
            (EngineKind::Gpu, Some(renderer)) => HeldBytes::of(renderer),
            _ => {
                let [shading, inside] = self.native.effect_bytes();
                HeldBytes {
                    all: self.native.size_bytes(),
                    shading,
                    inside,
                    vectors: self.native.kernel_bytes(),
                    polygons: self.native.polygon_bytes(),
                }
            }
        }
    }

    /// The most bytes that the engine with the picture held.
    pub fn peak_bytes(&self) -> u64 {
        match (self.drew, &self.gpu) {
            (EngineKind::Gpu, Some(renderer)) => renderer.peak_bytes(),
            _ => self.native.peak_bytes(),
        }
    }
}

impl Canvas for Engines {
    fn present(&mut self, background: Option<LinearRgb>) -> Result<Vec<u8>, GpuError> {
        match self.drew {
            EngineKind::Native => Canvas::present(&mut self.native, background),
            EngineKind::Gpu => self.gpu()?.present(background),
        }
    }
}
