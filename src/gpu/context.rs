//! The device: which adapter, which limits and features, and what happens when it fails.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::GpuError;
use crate::core::panics;

/// Storage buffers that a pass over a field with vectors in it binds.
pub(super) const VECTOR_BUFFERS: u32 = 13;
/// The same with polygons in it.
pub(super) const POLYGON_BUFFERS: u32 = 9;
/// The same with both.
pub(super) const VECTOR_AND_POLYGON_BUFFERS: u32 = 14;

/// Which adapter to draw with.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AdapterChoice {
    /// The fastest there is.
    #[default]
    Auto,
    /// A CPU adapter.
    Software,
    /// The first whose name contains this, ignoring case.
    Named(String),
}

/// Who classifies and merges the finest levels of octrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OctreeBuilder {
    /// The host's processors: the faster where they are the adapter, too (`benches/results/octree.md`).
    Host,
    /// The device, from the samples that it holds.
    Device,
}

/// What is asked of the device beyond WebGPU's defaults; each is used only where it is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wishes {
    /// Blend in 32-bit floats rather than 16-bit ones: 2⁻²⁴ instead of 2⁻¹¹ a layer.
    pub float32_blending: bool,
    /// Time passes on the device's own clock.
    pub timestamps: bool,
    /// Who builds octrees; `None`: the host for software adapters, and else the device.
    pub octrees: Option<OctreeBuilder>,
    /// The most bytes that a pass is bound to in one buffer, where fewer than the adapter allows are to do, as they must
    /// on lesser ones; `None`: as many as it allows.
    pub most_binding_bytes: Option<u64>,
}

impl Default for Wishes {
    fn default() -> Self {
        Self { float32_blending: true, timestamps: true, octrees: None, most_binding_bytes: None }
    }
}

/// A device of our own, on whose queue nothing else draws.
#[derive(Debug)]
pub struct Context {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter's name and backend, for people and statistics.
    pub adapter_name: String,
    /// What was granted of what was wished.
    pub granted: Wishes,
    /// What the device may hold.
    pub limits: wgpu::Limits,
    /// Whether the adapter may end an invocation's loops before their conditions do, as software adapters do:
    /// passes then say so (`shaders/lib/totals.wgsl`), and the picture is refused.
    pub ends_loops: bool,
    /// Who builds octrees here.
    pub octrees: OctreeBuilder,
    lost: Arc<AtomicBool>,
    loses_in_wait: AtomicBool,
    first_error: Arc<Mutex<Option<GpuError>>>,
}

impl Context {
    /// Opens the adapter and a device on it, with both error callbacks installed.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`], or the driver's refusal.
    pub fn new(choice: &AdapterChoice, wishes: Wishes) -> Result<Self, GpuError> {
        let adapter = pick(choice)?;
        let info = adapter.get_info();
        let offered = adapter.features();
        let granted = Wishes {
            float32_blending: wishes.float32_blending
                && offered.contains(wgpu::Features::FLOAT32_BLENDABLE),
            timestamps: wishes.timestamps && offered.contains(wgpu::Features::TIMESTAMP_QUERY),
            ..wishes
        };
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        let builder = if is_software { OctreeBuilder::Host } else { OctreeBuilder::Device };
        let mut features = wgpu::Features::empty();
        features.set(wgpu::Features::FLOAT32_BLENDABLE, granted.float32_blending);
        features.set(wgpu::Features::TIMESTAMP_QUERY, granted.timestamps);
        // WebGPU's defaults, and the adapter's own for few things only: large volumes (both
        // buffer limits), large pictures, and vectors and polygons beside a field.
        let most = adapter.limits();
        let limits = wgpu::Limits {
            max_buffer_size: most.max_buffer_size,
            max_storage_buffer_binding_size: most
                .max_storage_buffer_binding_size
                .min(wishes.most_binding_bytes.unwrap_or(u64::MAX)),
            max_texture_dimension_2d: most.max_texture_dimension_2d,
            // Vectors and polygons beside a field; without, there are none (`Renderer::set_vectors`,
            // `Renderer::set_polygons`).
            max_storage_buffers_per_shader_stage: most
                .max_storage_buffers_per_shader_stage
                .min(VECTOR_AND_POLYGON_BUFFERS),
            ..wgpu::Limits::defaults()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("voxsplat engine"),
            required_features: features,
            required_limits: limits.clone(),
            ..Default::default()
        }))
        .map_err(|error| GpuError::NoDevice {
            adapter: info.name.clone(),
            found: error.to_string(),
        })?;

        let lost = Arc::new(AtomicBool::new(false));
        let first_error = Arc::new(Mutex::new(None));
        device.set_device_lost_callback({
            let (lost, first_error) = (Arc::clone(&lost), Arc::clone(&first_error));
            move |_reason, message| {
                keep_first(&first_error, GpuError::Lost(message));
                lost.store(true, Ordering::Release);
            }
        });
        device.on_uncaptured_error({
            let first_error = Arc::clone(&first_error);
            Arc::new(move |error: wgpu::Error| {
                let error = match error {
                    wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory,
                    other => GpuError::Device(other.to_string()),
                };
                keep_first(&first_error, error);
            })
        });
        Ok(Self {
            device,
            queue,
            adapter_name: format!("{} ({})", info.name, info.backend),
            granted,
            limits,
            ends_loops: is_software,
            octrees: wishes.octrees.unwrap_or(builder),
            lost,
            loses_in_wait: AtomicBool::new(false),
            first_error,
        })
    }

    /// Waits until everything submitted is done, then reports what went wrong meanwhile.
    ///
    /// # Errors
    /// [`GpuError::Lost`] or [`GpuError::Device`].
    pub fn finish(&self) -> Result<(), GpuError> {
        // It panics where the driver says that the device is gone.
        let wait = || {
            let loses = self.loses_in_wait.swap(false, Ordering::AcqRel);
            assert!(!loses, "a test asked for this loss");
            self.device.poll(wgpu::PollType::wait_indefinitely())
        };
        let polled = panics::caught(wait);
        self.check()?;
        match polled {
            Ok(polled) => polled.map(drop).map_err(|error| GpuError::Device(error.to_string())),
            Err(words) => {
                self.lost.store(true, Ordering::Release);
                Err(GpuError::Lost(words))
            }
        }
    }

    /// What has gone wrong since the last look.
    ///
    /// # Errors
    /// [`GpuError::Lost`] or [`GpuError::Device`].
    pub fn check(&self) -> Result<(), GpuError> {
        let error = self.first_error.lock().unwrap_or_else(PoisonError::into_inner).take();
        match (self.lost.load(Ordering::Acquire), error) {
            (true, Some(GpuError::Lost(message))) => Err(GpuError::Lost(message)),
            (true, error) => Err(GpuError::Lost(error.map_or_else(String::new, |e| e.to_string()))),
            (false, Some(error)) => Err(error),
            (false, None) => Ok(()),
        }
    }

    /// Loses the device on purpose, for the test of what happens then.
    pub fn lose(&self) {
        self.device.destroy();
        self.lost.store(true, Ordering::Release);
    }

    /// Has the next wait panic as `wgpu` does where a driver loses the device meanwhile, for the test of what happens
    /// then.
    pub fn lose_in_wait(&self) {
        self.loses_in_wait.store(true, Ordering::Release);
    }
}

fn keep_first(slot: &Mutex<Option<GpuError>>, error: GpuError) {
    slot.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

/// The program's one connection to the graphics drivers. It is never closed: a driver's library that is unloaded leaves
/// what it registered for the ends of threads behind, and the next thread that ends falls into it (NVIDIA 580, libEGL).
static DRIVERS: LazyLock<wgpu::Instance> =
    LazyLock::new(|| instance(allowed_backends() & wgpu::Backends::PRIMARY));
/// The same by OpenGL, where nothing else is there: its loader is slow, and writes to standard error.
static OPENGL: LazyLock<wgpu::Instance> =
    LazyLock::new(|| instance(allowed_backends() - wgpu::Backends::PRIMARY));

fn allowed_backends() -> wgpu::Backends {
    wgpu::InstanceDescriptor::new_without_display_handle_from_env().backends
}

fn instance(backends: wgpu::Backends) -> wgpu::Instance {
    let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    wgpu::Instance::new(wgpu::InstanceDescriptor { backends, ..descriptor })
}

/// Every adapter.
fn adapters() -> Vec<wgpu::Adapter> {
    let of = |instance: &wgpu::Instance| {
        pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
    };
    let found = of(&DRIVERS);
    if found.is_empty() { of(&OPENGL) } else { found }
}

/// Whether a GPU is there: discrete, integrated or virtual. One that only OpenGL knows does not count: its loader
/// writes to standard error where there is none.
pub fn has_hardware() -> bool {
    pollster::block_on(DRIVERS.enumerate_adapters(wgpu::Backends::all())).iter().any(|adapter| {
        use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};
        matches!(adapter.get_info().device_type, DiscreteGpu | IntegratedGpu | VirtualGpu)
    })
}

fn pick(choice: &AdapterChoice) -> Result<wgpu::Adapter, GpuError> {
    let adapters = adapters();
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    let is_software = |a: &wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
    // Discrete before integrated before the rest; the CPU last.
    let rank = |a: &wgpu::Adapter| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    let (wanted, found) = match choice {
        AdapterChoice::Auto => {
            ("a graphics adapter".to_owned(), adapters.into_iter().min_by_key(rank))
        }
        AdapterChoice::Software => {
            ("a software adapter".to_owned(), adapters.into_iter().find(is_software))
        }
        AdapterChoice::Named(name) => {
            let lower = name.to_lowercase();
            let matches = |a: &wgpu::Adapter| a.get_info().name.to_lowercase().contains(&lower);
            (
                format!("a graphics adapter with {name:?} in its name"),
                adapters.into_iter().find(matches),
            )
        }
    };
    found.ok_or(GpuError::NoAdapter { wanted, found: names })
}
