//! A stable radix sort of 32-bit keys, each with a word, on the device.
//!
//! Lowest digit first, 4 bits a round (Satish, Harris and Garland 2009, without their shared
//! memory). Each thread takes a run of neighbours, counts
//! their digits, and after the sum over all threads moves its run in its order. So equal keys keep
//! their order, whatever the device.

use super::GpuError;
use super::buffers::Growing;
use super::clock::Timestamps;
use super::compute::{buffers, dispatch, groups_of};
use super::context::Context;
use super::frame::{self, Digit, Pass};
use super::layout::{self, DIGIT_BITS, DIGITS, SORT_THREADS};
use super::pipelines::{Pipelines, Program};
use super::scan::Scan;
use super::shader;

/// The most keys that are sorted at once.
pub const MOST_KEYS: u32 = 1 << 24;
/// Keys in a thread's run: enough of them that its counts are few beside them.
const RUN: u32 = 256;
/// Rounds that 32 bits take.
const ROUNDS: u64 = (32 / DIGIT_BITS) as u64;
/// Bytes from one round's constants to the next's, by WebGPU's default alignment.
const ROUND_STRIDE: u64 = 256;

/// Keys and words on the device, twice: each round moves them from one side to the other.
#[derive(Debug)]
pub(super) struct Sorter {
    pub(super) keys: [Growing; 2],
    pub(super) words: [Growing; 2],
    pub(super) rounds: wgpu::Buffer,
    pub(super) scan: Scan,
    pub(super) totals: wgpu::Buffer,
}

impl Sorter {
    pub(super) fn new(context: &Context) -> Self {
        use wgpu::BufferUsages as Usage;
        let pair = |label| {
            [0, 1].map(|_| {
                let usage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
                Growing::new(context, label, usage)
            })
        };
        let uniform =
            |label, size| Growing::make(context, label, Usage::UNIFORM | Usage::COPY_DST, size);
        Self {
            keys: pair("sorted keys"),
            words: pair("sorted words"),
            rounds: uniform("sort", ROUNDS * ROUND_STRIDE),
            scan: Scan::new(context),
            totals: Growing::make(context, "digit totals", Usage::STORAGE, 16),
        }
    }

    /// Keys there is room for.
    pub(super) fn capacity(&self) -> u32 {
        let bytes = self.keys.iter().chain(&self.words).map(|g| g.buffer.size()).min();
        u32::try_from(bytes.unwrap_or(0) / 4).unwrap_or(u32::MAX)
    }

    pub(super) fn reserve(&mut self, context: &Context, keys: u32) -> Result<(), GpuError> {
        let sides = self.keys.iter_mut().chain(&mut self.words);
        sides.into_iter().try_for_each(|side| side.reserve(context, u64::from(keys) * 4))
    }

    pub(super) fn size_bytes(&self) -> u64 {
        let sides = self.keys.iter().chain(&self.words).map(|g| g.buffer.size()).sum::<u64>();
        sides + self.scan.size_bytes()
    }

    /// Makes ready to sort the first `count` keys, of at most `bits` bits; the passes that do, and
    /// the side that then holds them.
    pub(super) fn prepare(
        &mut self,
        context: &Context,
        count: u32,
        bits: u32,
    ) -> Result<(Vec<Pass>, usize), GpuError> {
        let rounds = bits.div_ceil(DIGIT_BITS);
        let threads = count.div_ceil(RUN);
        self.scan.prepare(context, DIGITS * threads, u32::MAX, 0)?;
        for round in 0..rounds {
            let settings = layout::Sort { counts: [count, round * DIGIT_BITS, RUN, threads] };
            let offset = u64::from(round) * ROUND_STRIDE;
            context.queue.write_buffer(&self.rounds, offset, bytemuck::bytes_of(&settings));
        }
        if count < 2 {
            return Ok((Vec::new(), 0));
        }
        Ok((frame::sort(rounds, threads), rounds as usize % 2))
    }

    pub(super) fn encode(
        &self,
        context: &Context,
        pipelines: &mut Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        pass: Pass,
        clock: Option<&Timestamps>,
    ) {
        let counts = &self.scan.counts.buffer;
        let settings = |digit: Digit| wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &self.rounds,
                offset: u64::from(digit.round) * ROUND_STRIDE,
                size: wgpu::BufferSize::new(size_of::<layout::Sort>() as u64),
            }),
        };
        let side = |buffers: &'_ [Growing; 2], round: u32| -> wgpu::Buffer {
            buffers[(round % 2) as usize].buffer.clone()
        };
        let (shader, first, bound, groups) = match pass {
            Pass::CountDigits(digit) => (
                shader::COUNT_DIGITS,
                Some(settings(digit)),
                vec![side(&self.keys, digit.round), counts.clone()],
                groups_of(digit.threads, SORT_THREADS),
            ),
            Pass::ScanDigits => {
                return self.scan.encode((context, pipelines), encoder, &self.totals, clock);
            }
            Pass::ScatterDigits(digit) => (
                shader::SCATTER_DIGITS,
                Some(settings(digit)),
                vec![
                    side(&self.keys, digit.round),
                    side(&self.words, digit.round),
                    counts.clone(),
                    side(&self.keys, digit.round + 1),
                    side(&self.words, digit.round + 1),
                ],
                groups_of(digit.threads, SORT_THREADS),
            ),
            _ => return,
        };
        let at = u32::from(first.is_some());
        let entries: Vec<_> = first.into_iter().chain(buffers(at, &bound)).collect();
        let pipeline = pipelines.compute(context, &Program::plain(shader));
        dispatch(context, encoder, pass.name(), &pipeline, &entries, groups, clock);
    }
}
