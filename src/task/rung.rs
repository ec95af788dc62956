//! One rung of a scene's ladder: what is asked for, what was drawn, why it was not, and who watches.

use crate::core::Cancelled;
use crate::core::memory::TooLarge;
use crate::gpu::GpuError;
use crate::kernel::Kernel;
use crate::plan::{COARSER, SlabField};

use super::engines::Canvas;

/// A piece should not keep the device from a newer request for longer than this.
pub const PIECE_MS: f64 = 10.0;

/// What to draw of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rung {
    /// The picture with the least error within a time: the scene's own mode at a smaller size where
    /// its field is on the device and affordable, else an octree cut.
    Coarse {
        /// Milliseconds it may take.
        budget_ms: f64,
    },
    /// The octree cut of an error, at full size.
    Octree {
        /// Greatest error of a node (see `hierarchy::Node::error`).
        max_error: f32,
    },
    /// The cut of the reconstructed field of an error, at full size; all of the field where it has no cuts.
    Bricks {
        /// Greatest error of a brick (see `hierarchy::BrickErrors`).
        max_error: f32,
    },
    /// Every 2^level-th sample along each axis, averaged.
    Subsampled {
        /// Level of the pyramid.
        level: usize,
    },
    /// Every voxel with a cheaper kernel.
    Cheaper(Kernel),
    /// The scene's own mode at a smaller size, to be enlarged.
    Reduced {
        /// Of which field.
        field: SlabField,
        /// How many times smaller, > 1.
        shrink: f64,
    },
    /// Every voxel's full kernel, in the scene's own mode.
    Full,
}

/// A cut of a field, of which a picture was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutLevels {
    /// Greatest error of a brick (see `hierarchy::BrickErrors`).
    pub max_error: f32,
    /// What it is thought to cost to draw it in the place of the whole field: RMSE, linear light.
    pub rmse: f64,
    /// Bricks of 4³ cells that were drawn from the samples themselves, from means of 2³, and of 4³.
    pub bricks: [u64; COARSER + 1],
    /// Bricks among them, and others that are left out, whose own level has not come yet: they are coarser than the cut asks for.
    pub waiting: u64,
}

impl CutLevels {
    /// Its bricks.
    pub fn nodes(&self) -> u64 {
        self.bricks.iter().sum()
    }

    /// How many levels they are of.
    pub fn levels(&self) -> usize {
        self.bricks.iter().filter(|&&bricks| bricks > 0).count()
    }
}

/// What a finished rung is; but for what it says, nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// Size it was drawn at.
    pub size: [u32; 2],
    /// Kernels drawn.
    pub kernels: u64,
    /// Octree nodes among them.
    pub nodes: u64,
    /// How many levels of the octree these are of: sizes, of boxes that the volume's border does not cut.
    pub levels: usize,
    /// The error of the cut; 0 for `full`.
    pub max_error: f32,
    /// What pixels that points leave out are thought to cost, RMSE in linear light; else 0.
    pub missing_rmse: f64,
    /// Slabs of every voxel, or of the field for previews, to be enlarged.
    pub is_reduced: bool,
    /// Which field of those on the device it shows, where it shows one.
    pub field: SlabField,
    /// What it is thought to cost that this is another than the scene's own: RMSE of a quick picture.
    pub field_rmse: f64,
    /// A cut of that, where it shows one.
    pub cut: Option<CutLevels>,
    /// Whether it might have been of a cut, which was still being looked for.
    pub awaits_cut: bool,
    /// Slabs of a reconstructed field, or gathered samples, which lights and shading tables reach.
    pub is_shaded: bool,
    /// Times that vectors were halved beyond what was asked for, as too many lay over one tile.
    pub vectors_halved: u32,
    /// Times that vectors were halved beyond what a full picture of the size shown would have them, at most.
    pub vectors_averaged: usize,
    /// Pipelines of slabs were made for it: the next such picture takes less.
    pub made_pipelines: bool,
    /// Wall milliseconds of the drawing, without preparation and reading back.
    pub wall_ms: f64,
    /// Of it, making lists of vectors.
    pub lists_ms: f64,
}

impl Drawn {
    /// Whether it is the scene's own field, with vectors as they are: only pixels can be missing.
    pub(super) fn is_of_own(&self) -> bool {
        self.is_reduced
            && self.field == SlabField::Own
            && self.cut.is_none()
            && self.vectors_averaged == 0
    }

    /// Whether it is that at a size, and so the finished picture, by whatever way it came.
    pub fn is_whole(&self, size: [u32; 2]) -> bool {
        self.is_of_own() && self.size == size
    }
}

/// Why a rung was not finished.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// Something newer came.
    #[error("interrupted")]
    Interrupted,
    /// The host's memory.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl DrawError {
    /// Whether it says what cannot be drawn, of a device that is well.
    pub(super) fn is_refusal(&self) -> bool {
        match self {
            Self::Interrupted | Self::TooLarge(_) => true,
            Self::Gpu(error) => error.is_refusal(),
        }
    }
}

impl From<Cancelled> for DrawError {
    fn from(_: Cancelled) -> Self {
        Self::Interrupted
    }
}

/// Told how far a rung is, after each piece; says whether to stop.
pub trait Observer {
    /// `done` of 1 is drawn. True stops the rung.
    fn piece_done(&mut self, picture: &mut dyn Canvas, done: f64) -> bool;

    /// Whether something newer came, asked while a piece is under way and there is no picture to look at.
    fn is_overtaken(&mut self) -> bool {
        false
    }

    /// How long a piece should take, milliseconds.
    fn piece_ms(&self) -> f64 {
        PIECE_MS
    }
}

/// Never stops.
impl Observer for () {
    fn piece_done(&mut self, _: &mut dyn Canvas, _: f64) -> bool {
        false
    }
}
