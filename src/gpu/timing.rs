//! Pass times: the device's own clock where it tells the truth, wall time where it does not.

use std::time::Instant;

use super::GpuError;
use super::buffers::Growing;
use super::clock::Timestamps;
use super::compute::{buffer, dispatch};
use super::context::Context;

/// Where pass times come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Timer {
    /// Timestamps on the device.
    Device,
    /// A submit of its own for every pass, waited for.
    Wall,
}

/// Greatest relative difference at which the device's clock is believed.
const BELIEF: f64 = 0.2;
/// A probe has to run this long before the submit's own cost is small beside it.
const PROBE_MS: f64 = 20.0;

const PROBE: &str = "
@group(0) @binding(0) var<storage, read_write> cell: array<u32>;
override rounds: u32 = 1u;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    var x = id.x + cell[0];
    for (var i = 0u; i < rounds; i++) { x = x * 1664525u + 1013904223u; }
    cell[id.x] = x;
}";

/// Times a known compute pass by both clocks and says which to use.
///
/// Some software adapters report compute passes in a fraction of the time they take.
///
/// # Errors
/// Where the device fails.
pub fn choose(context: &Context) -> Result<Timer, GpuError> {
    if !context.granted.timestamps {
        return Ok(Timer::Wall);
    }
    let mut rounds = 2000.0;
    loop {
        let (wall_ms, device_ms) = probe(context, rounds)?;
        if wall_ms >= PROBE_MS || rounds > 1e9 {
            return Ok(believe(wall_ms, device_ms));
        }
        rounds *= (1.5 * PROBE_MS / wall_ms.max(0.05)).clamp(2.0, 100.0);
    }
}

fn believe(wall_ms: f64, device_ms: f64) -> Timer {
    let agrees = (device_ms - wall_ms).abs() <= BELIEF * wall_ms;
    if agrees { Timer::Device } else { Timer::Wall }
}

/// Wall and device milliseconds of one dispatch of the probe.
fn probe(context: &Context, rounds: f64) -> Result<(f64, f64), GpuError> {
    const THREADS: u32 = 1 << 14;
    let device = &context.device;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("timer probe"),
        source: wgpu::ShaderSource::Wgsl(PROBE.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("timer probe"),
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &[("rounds", rounds.round())],
            ..Default::default()
        },
        cache: None,
    });
    let usage = wgpu::BufferUsages::STORAGE;
    let cells = Growing::make(context, "timer probe", usage, u64::from(THREADS) * 4);
    let entries = [buffer(0, &cells)];
    let clock = Timestamps::new(context, 1);
    // Once unmeasured, so that neither compiling nor zeroing the buffer is timed.
    let mut wall_ms = 0.0;
    for _ in 0..2 {
        let mut encoder = device.create_command_encoder(&Default::default());
        let groups = [THREADS / 64, 1, 1];
        dispatch(context, &mut encoder, "timer probe", &pipeline, &entries, groups, Some(&clock));
        clock.resolve(&mut encoder);
        let start = Instant::now();
        context.queue.submit([encoder.finish()]);
        context.finish()?;
        wall_ms = start.elapsed().as_secs_f64() * 1e3;
    }
    Ok((wall_ms, clock.read_ms(context)?[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_is_off_by_more_than_a_fifth_is_not_believed() {
        assert_eq!(believe(80.0, 4.0), Timer::Wall);
        assert_eq!(believe(80.0, 0.0), Timer::Wall);
        assert_eq!(believe(20.0, 25.0), Timer::Wall);
        assert_eq!(believe(20.0, 17.0), Timer::Device);
    }
}
