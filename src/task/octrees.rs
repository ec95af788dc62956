//! Octrees on their way: on a thread of the host, or on the device in pieces between those of a picture.
//!
//! Which of the two is up to the adapter ([`OctreeBuilder`]). Whoever waits may leave; dropping an octree that is
//! on its way cancels it.

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use super::draw::{DrawError, PIECE_MS};
use super::engines::Engines;
use crate::core::Ticket;
use crate::gpu::{BrickRows, GpuError, OctreeBuilder, Renderer};
use crate::hierarchy::{ErrorMeasure, Pyramid, PyramidError, PyramidParts};
use crate::transfer::Table;
use crate::volume::ScalarVolume;

/// Bricks of the first piece on a device,
const FIRST_BRICKS: usize = 1 << 9;
/// and the most of any: with their nodes, of 20 MB.
const MOST_BRICKS: usize = 1 << 14;
/// The same of coarse levels, which no newer request stops within a piece.
const MOST_COARSE_BRICKS: usize = 1 << 17;

/// What an octree is of.
#[derive(Debug, Clone)]
pub(super) struct Source {
    pub volume: Arc<ScalarVolume>,
    pub table: Arc<Table>,
    /// Thickness of a voxel in opacity unit distances.
    pub voxel_depth: f64,
    pub measure: ErrorMeasure,
    /// Whether the table on the device is this one.
    pub is_on_device: bool,
}

/// All of an octree, on its way; dropping it cancels.
#[derive(Debug)]
pub(super) struct Octree {
    source: Source,
    pub builder: OctreeBuilder,
    work: Work,
}

#[derive(Debug)]
enum Work {
    Thread(Thread),
    Pieces(Pieces),
    /// Nothing more comes of it.
    Ended,
}

/// On a thread of its own.
#[derive(Debug)]
struct Thread {
    ticket: Ticket,
    result: Receiver<Result<Pyramid, PyramidError>>,
}

impl Drop for Thread {
    fn drop(&mut self) {
        self.ticket.cancel();
    }
}

impl Thread {
    fn start(
        source: &Source,
        build: impl FnOnce(&Source, &Ticket) -> Result<Pyramid, PyramidError> + Send + 'static,
    ) -> Result<Self, DrawError> {
        let ticket = Ticket::new();
        let (sender, result) = mpsc::sync_channel(1);
        let job = {
            let (source, ticket) = (source.clone(), ticket.clone());
            // Whoever asked may be gone.
            move || drop(sender.send(build(&source, &ticket)))
        };
        let thread = std::thread::Builder::new().name("voxsplat-octree".to_owned()).spawn(job);
        thread.map_err(|error| {
            GpuError::Device(format!("the octree's thread did not start: {error}"))
        })?;
        Ok(Self { ticket, result })
    }
}

/// What the device has merged so far.
#[derive(Debug)]
struct Pieces {
    parts: PyramidParts,
    /// Bricks of the next piece, about.
    bricks: usize,
}

impl Pieces {
    /// Where the device is to build an octree of a volume, and has levels to.
    fn begin(
        source: &Source,
        engines: &Engines,
        is_coarse: bool,
    ) -> Result<Option<Self>, DrawError> {
        let Source { volume, voxel_depth, measure, is_on_device, .. } = source;
        let builder = engines.made_gpu().filter(|_| *is_on_device);
        if !builder.is_some_and(|renderer| renderer.builds_octree(volume, *measure)) {
            return Ok(None);
        }
        let parts = PyramidParts::new(volume, *voxel_depth, *measure, is_coarse)?;
        Ok(parts.map(|parts| Self { parts, bricks: FIRST_BRICKS }))
    }

    /// Merges a piece; whether there is nothing more.
    fn step(&mut self, renderer: &mut Renderer) -> Result<bool, DrawError> {
        let Some([y, z]) = self.parts.next_rows(self.bricks) else { return Ok(true) };
        let (is_coarse, measure) = (self.parts.is_coarse(), self.parts.measure());
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let voxel_depth = self.parts.voxel_depth() as f32;
        let rows = BrickRows { y, z, voxel_depth, measure, has_nodes: !is_coarse };
        let merged = renderer.merge_bricks(&rows)?;
        let done = merged.bricks.len();
        self.parts.take([rows.y, rows.z], &merged.bricks, &merged.nodes);
        let most = if is_coarse { MOST_COARSE_BRICKS } else { MOST_BRICKS };
        let rate = done as f64 / merged.wall_ms.max(0.01);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let fitting = (rate * PIECE_MS).clamp(1.0, (4 * self.bricks).min(most) as f64) as usize;
        self.bricks = fitting;
        Ok(self.parts.next_rows(1).is_none())
    }
}

impl Octree {
    pub(super) fn begin(source: Source, engines: &Engines) -> Result<Self, DrawError> {
        let (work, builder) = match Pieces::begin(&source, engines, false)? {
            Some(pieces) => (Work::Pieces(pieces), OctreeBuilder::Device),
            None => {
                let thread = Thread::start(&source, |source, ticket| {
                    let Source { volume, table, voxel_depth, measure, .. } = source;
                    Pyramid::build(volume, table, *voxel_depth, *measure, ticket)
                })?;
                (Work::Thread(thread), OctreeBuilder::Host)
            }
        };
        Ok(Self { source, builder, work })
    }

    pub(super) fn measure(&self) -> ErrorMeasure {
        self.source.measure
    }

    /// Whether a piece of it is to be merged on the device.
    pub(super) fn has_pieces(&self) -> bool {
        matches!(self.work, Work::Pieces(_))
    }

    /// All of it, if it is there within `patience`. With any, a piece is merged where the device builds it.
    pub(super) fn step(
        &mut self,
        engines: &mut Engines,
        patience: Duration,
    ) -> Result<Option<Pyramid>, DrawError> {
        if self.has_pieces() && patience.is_zero() {
            return Ok(None);
        }
        match std::mem::replace(&mut self.work, Work::Ended) {
            Work::Pieces(mut pieces) => {
                let renderer = engines.gpu()?;
                self.work = match pieces.step(renderer)? {
                    false => Work::Pieces(pieces),
                    true => {
                        renderer.drop_bricks();
                        // What lies above needs no device, and takes no picture's time.
                        Work::Thread(Thread::start(&self.source, |source, ticket| {
                            Ok(pieces.parts.finish(&source.volume, &source.table, ticket)?)
                        })?)
                    }
                };
                Ok(None)
            }
            Work::Thread(thread) => match thread.result.recv_timeout(patience) {
                Ok(built) => Ok(Some(built?)),
                Err(RecvTimeoutError::Timeout) => {
                    self.work = Work::Thread(thread);
                    Ok(None)
                }
                Err(RecvTimeoutError::Disconnected) => Err(failed()),
            },
            Work::Ended => Err(failed()),
        }
    }
}

fn failed() -> DrawError {
    GpuError::Device("building the octree failed".to_owned()).into()
}

/// Level 3 and up, for a quick picture; and who made them.
pub(super) fn coarse(
    source: &Source,
    engines: &mut Engines,
    ticket: &Ticket,
) -> Result<(Pyramid, OctreeBuilder), DrawError> {
    let Source { volume, table, voxel_depth, measure, .. } = source;
    let Some(mut pieces) = Pieces::begin(source, engines, true)? else {
        let built = Pyramid::coarse(volume, table, *voxel_depth, *measure, ticket)?;
        return Ok((built, OctreeBuilder::Host));
    };
    let renderer = engines.gpu()?;
    while !pieces.step(renderer)? {
        ticket.checkpoint(1, 1)?;
    }
    renderer.drop_bricks();
    Ok((pieces.parts.finish(volume, table, ticket)?, OctreeBuilder::Device))
}
