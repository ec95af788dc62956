//! Octrees on their way: on a thread of the host, or on the device in pieces between those of a picture.
//!
//! Which of the two is up to the adapter ([`OctreeBuilder`]). Whoever waits may leave; dropping an octree that is
//! on its way cancels it.

use std::sync::Arc;
use std::time::Duration;

use super::draw::{DrawError, PIECE_MS};
use super::engines::Engines;
use super::job::Job;
use crate::core::{Pace, Ticket};
use crate::gpu::{BrickRows, GpuError, OctreeBuilder, Renderer};
use crate::hierarchy::{ErrorMeasure, Pyramid, PyramidError, PyramidParts};
use crate::transfer::Table;
use crate::volume::ScalarVolume;

/// Bricks of the first piece on a device,
const FIRST_BRICKS: u32 = 1 << 9;
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
    Thread(Job<Result<Pyramid, PyramidError>>),
    Pieces(Pieces),
    /// Nothing more comes of it.
    Ended,
}

/// Begins to build on a thread of its own.
fn start(
    source: &Source,
    build: impl FnOnce(&Source, &Ticket) -> Result<Pyramid, PyramidError> + Send + 'static,
) -> Result<Work, DrawError> {
    let source = source.clone();
    let work = move |ticket: &Ticket| build(&source, ticket);
    Ok(Work::Thread(Job::start(("voxsplat-octree", "the octree"), work)?))
}

/// What the device has merged so far.
#[derive(Debug)]
struct Pieces {
    parts: PyramidParts,
    /// In bricks.
    pace: Pace,
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
        Ok(parts.map(|parts| Self { parts, pace: Pace::new(FIRST_BRICKS, 1) }))
    }

    /// Merges a piece; whether there is nothing more.
    fn step(&mut self, renderer: &mut Renderer) -> Result<bool, DrawError> {
        let (is_coarse, measure) = (self.parts.is_coarse(), self.parts.measure());
        let most = if is_coarse { MOST_COARSE_BRICKS } else { MOST_BRICKS };
        let bricks = most.min(self.pace.piece() as usize);
        let Some([y, z]) = self.parts.next_rows(bricks) else { return Ok(true) };
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of order 1")]
        let voxel_depth = self.parts.voxel_depth() as f32;
        let rows = BrickRows { y, z, voxel_depth, measure, has_nodes: !is_coarse };
        let merged = renderer.merge_bricks(&rows)?;
        let done = merged.bricks.len();
        self.parts.take([rows.y, rows.z], &merged.bricks, &merged.nodes);
        self.pace.learn(done as f64, merged.wall_ms, PIECE_MS);
        Ok(self.parts.next_rows(1).is_none())
    }
}

impl Octree {
    pub(super) fn begin(source: Source, engines: &Engines) -> Result<Self, DrawError> {
        let (work, builder) = match Pieces::begin(&source, engines, false)? {
            Some(pieces) => (Work::Pieces(pieces), OctreeBuilder::Device),
            None => {
                let work = start(&source, |source, ticket| {
                    let Source { volume, table, voxel_depth, measure, .. } = source;
                    Pyramid::build(volume, table, *voxel_depth, *measure, ticket)
                })?;
                (work, OctreeBuilder::Host)
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
                        start(&self.source, |source, ticket| {
                            Ok(pieces.parts.finish(&source.volume, &source.table, ticket)?)
                        })?
                    }
                };
                Ok(None)
            }
            Work::Thread(job) => {
                let built = job.look(patience)?;
                if built.is_none() {
                    self.work = Work::Thread(job);
                }
                Ok(built.transpose()?)
            }
            Work::Ended => Err(GpuError::Device("building the octree failed".to_owned()).into()),
        }
    }
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
