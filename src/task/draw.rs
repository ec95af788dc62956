//! Draws one rung of a scene's ladder, in pieces that can be interrupted.

use std::sync::Arc;
use std::time::Instant;

use crate::core::Pace;
use crate::gpu::layout::Record;
use crate::gpu::{GpuError, Renderer, Scattered};
use crate::hierarchy::{Cut, CutLimits, CutNode, Pyramid};
use crate::kernel::{Kernel, RadialKernel};
use crate::native::Node;
use crate::plan::{Plan, SlabField, Way};
use crate::scene::{
    Backend, Cells, Classify, CutSettings, OpacityModel, SplatSettings, View, Visibility,
};
use crate::transfer::TransferFunction;
use crate::volume::ScalarVolume;

pub use super::rung::{CutLevels, DrawError, Drawn, Observer, PIECE_MS, Rung};

use super::classified::Classified;
use super::cost::Costs;
use super::cuts::{CutNumber, FieldCuts};
use super::engines::{EngineKind, Engines};
use super::previews::Reduction;
use super::rows::RowPlan;
use super::slabs;
use super::vectors::VectorJob;

/// Front to back, a pixel is done once less than this of what lies behind shows through: the least
/// step of 8-bit sRGB is 3e-4 in linear light.
const STOP_BELOW: f32 = 2e-4;
/// A coarse picture is at least this many pixels wide and high, whatever the budget.
pub(super) const LEAST_SIDE: f64 = 48.0;
/// A large one is at least so many, or this many times smaller than it is shown: a mosaic of sixty blocks across comes hardly sooner
/// on a slow machine, and says less.
const LEAST_SIDE_OF_LARGE: f64 = 128.0;
const MOST_SHRINK: f64 = 6.0;
/// Whole pictures of fewer pixels than of a square of so many say nothing of what larger ones take.
pub(super) const LEAST_WHOLE: f64 = 160.0;
/// How much smaller vectors are drawn where an octree cut was asked for.
const AT_ONCE_SHRINK: f64 = 4.0;

/// The engines, with what was classified for them and learnt of them.
#[derive(Debug)]
pub struct Drawer {
    /// What draws.
    pub engines: Engines,
    /// Measured prices, of the engine that draws now.
    pub costs: Costs,
    /// That engine, and the prices of the other one.
    engine: EngineKind,
    other_costs: Costs,
    pub(super) classified: Option<Classified>,
    /// Voxels with opacity of a volume under a function, where they were counted without an octree.
    pub(super) counted: Option<(Arc<ScalarVolume>, TransferFunction, u64)>,
    /// How much smaller the last coarse picture was drawn than shown.
    last_shrink: f64,
    /// Nodes that the last coarse cut was to have, and the error that it was fitted to.
    last_fit: Option<(u64, f32)>,
    /// The field and the size of the last coarse picture, where it was of one.
    pub(super) last_reduction: Option<Reduction>,
    /// Cuts of the scene's field.
    pub(super) cuts: FieldCuts,
    /// What reconstructs the scene's field, on its way to the device.
    pub(super) field: slabs::FieldJob,
    /// The scene's vectors.
    pub(super) vectors: VectorJob,
    /// Whether the cuts that are drawn are to be kept for [`Drawer::take_cut`].
    pub keeps_cut: bool,
    kept_cut: Option<(Cut, CutLimits)>,
    /// The same of a cut of the field.
    pub(super) kept_bricks: Option<CutNumber>,
}

impl Drawer {
    /// The GPU engine alone; nothing classified, nothing learnt.
    pub fn new(renderer: Renderer) -> Self {
        Self::with(Engines::of_gpu(renderer))
    }

    /// Nothing classified, nothing learnt.
    pub fn with(engines: Engines) -> Self {
        let engine = engines.kind();
        let (native, gpu) = (Costs::native(), Costs::default());
        let (costs, other_costs) = match engine {
            EngineKind::Native => (native, gpu),
            EngineKind::Gpu => (gpu, native),
        };
        let mut cuts = FieldCuts::default();
        cuts.turn_to(engine);
        Self {
            engines,
            costs,
            engine,
            other_costs,
            classified: None,
            counted: None,
            last_shrink: 2.0,
            last_fit: None,
            last_reduction: None,
            cuts,
            field: slabs::FieldJob::default(),
            vectors: VectorJob::default(),
            keeps_cut: false,
            kept_cut: None,
            kept_bricks: None,
        }
    }

    /// The cut of the last picture, where [`Drawer::keeps_cut`] asked for it and it was one.
    pub fn take_cut(&mut self) -> Option<(Cut, CutLimits)> {
        self.kept_cut.take()
    }

    /// The cells of the cut of the last picture, at most so many, where it was one and [`Drawer::keeps_cut`] asked for it.
    pub(super) fn take_cells(&mut self, most: usize) -> Option<Cells> {
        if let Some((cut, limits)) = self.take_cut() {
            return Some(Cells::of(&cut, &limits, most));
        }
        let number = self.kept_bricks.take()?;
        self.cuts.cells(number, most)
    }

    /// Published opacities, and sums of them, that were over 1 in the last picture and lowered to it.
    ///
    /// # Errors
    /// A failing device.
    pub fn capped_sums(&mut self) -> Result<u64, GpuError> {
        match self.engines.drew() {
            EngineKind::Native => Ok(self.engines.native.capped()),
            EngineKind::Gpu => self.engines.gpu()?.capped_sums(),
        }
    }

    /// Draws one rung of the plan prepared last; the picture is then the renderer's.
    ///
    /// # Errors
    /// Interrupted by the observer, or the device.
    pub fn draw(
        &mut self,
        plan: &Plan,
        rung: Rung,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        (self.kept_cut, self.kept_bricks) = (None, None);
        self.turn_to(plan);
        if self.engine_of(plan, rung) == EngineKind::Native {
            self.engines.note(EngineKind::Native);
            let is_of_samples = matches!(rung, Rung::Coarse { .. })
                && self.begins_with_samples(plan)
                && self.is_at_hand(plan, SlabField::Preview);
            if !is_of_samples {
                self.prepare_native(plan, observer)?;
            }
            return self.draw_rung(plan, rung, observer);
        }
        if self.engine == EngineKind::Native {
            self.prepare_octree(plan, true, observer)?;
        }
        self.engines.note(EngineKind::Gpu);
        self.within(plan, |drawer| drawer.draw_rung(plan, rung, observer))
    }

    /// A picture of one field, or cut, and size, whatever would be chosen.
    pub(super) fn draw_reduced(
        &mut self,
        plan: &Plan,
        reduction: Reduction,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        if self.engines.of_plan(plan) == EngineKind::Native {
            self.engines.note(EngineKind::Native);
            self.prepare_native(plan, observer)?;
            return self.reduced(plan, reduction, observer);
        }
        self.engines.note(EngineKind::Gpu);
        self.within(plan, |drawer| drawer.reduced(plan, reduction, observer))
    }

    /// Which engine draws a rung of a plan: triangles, of which octree cuts are where a mode asks for them, are the GPU
    /// engine's.
    pub fn engine_of(&self, plan: &Plan, rung: Rung) -> EngineKind {
        let is_of_octree = match rung {
            Rung::Octree { .. } | Rung::Subsampled { .. } | Rung::Cheaper(_) => {
                plan.kernels.is_empty() && plan.field().is_some()
            }
            Rung::Coarse { .. } | Rung::Reduced { .. } | Rung::Bricks { .. } | Rung::Full => false,
        };
        match is_of_octree && !draws_nodes(&plan.mode, rung) {
            true => EngineKind::Gpu,
            false => self.engines.of_plan(plan),
        }
    }

    /// What draws a plan at full quality in the window: what was chosen, or can. The native engine has tiles alone.
    pub fn window_backend(&self, plan: &Plan) -> Backend {
        match self.engines.of_plan(plan) {
            EngineKind::Native => Backend::Tiles,
            EngineKind::Gpu => plan.backend(),
        }
    }

    /// Has the prices of the engine that draws a plan at hand.
    pub(super) fn turn_to(&mut self, plan: &Plan) {
        let engine = self.engines.of_plan(plan);
        if self.engine != engine {
            std::mem::swap(&mut self.costs, &mut self.other_costs);
            self.cuts.turn_to(engine);
            (self.engine, self.last_reduction) = (engine, None);
        }
    }

    /// Draws what nobody waits for: what that costs says nothing of the pictures that somebody does.
    pub(super) fn aside<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let prices = (self.engine, self.costs, self.other_costs);
        let (shrink, reduction) = (self.last_shrink, self.last_reduction);
        let done = work(self);
        (self.engine, self.costs, self.other_costs) = prices;
        (self.last_shrink, self.last_reduction) = (shrink, reduction);
        self.cuts.turn_to(self.engine);
        done
    }

    /// Whether the native engine draws the plan that was prepared or drawn last.
    pub(super) fn is_native(&self) -> bool {
        self.engine == EngineKind::Native
    }

    /// Does work for which the device has what a plan says; nothing of the plan is left after it.
    pub(super) fn within<T>(
        &mut self,
        plan: &Plan,
        work: impl FnOnce(&mut Self) -> Result<T, DrawError>,
    ) -> Result<T, DrawError> {
        let begun = self.engines.gpu()?.begin_plan(plan).map_err(DrawError::from);
        let done = begun.and_then(|()| work(self));
        if let Some(renderer) = self.engines.made_gpu_mut() {
            renderer.end_plan();
        }
        done
    }

    fn draw_rung(
        &mut self,
        plan: &Plan,
        rung: Rung,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        match rung {
            // Vectors and polygons have no octree of kernels: what comes before `full` is smaller.
            Rung::Octree { .. } | Rung::Subsampled { .. } | Rung::Cheaper(_)
                if !plan.kernels.is_empty() || plan.field().is_none() =>
            {
                let reduction =
                    Reduction { field: SlabField::Own, shrink: AT_ONCE_SHRINK, cut: None };
                self.reduced(plan, reduction, observer)
            }
            Rung::Coarse { budget_ms } => {
                // How many there are says how small a picture must be.
                self.classify_vectors(plan, observer)?;
                self.advance_cuts(plan)?;
                match self.reduction(plan, budget_ms) {
                    Some(reduction) => {
                        self.last_reduction = Some(reduction);
                        let drawn = self.reduced(plan, reduction, observer)?;
                        reduction.cut.into_iter().for_each(|number| self.cuts.tell_missing(number));
                        Ok(drawn)
                    }
                    None => {
                        self.last_reduction = None;
                        self.coarse(plan, budget_ms, observer)
                    }
                }
            }
            Rung::Octree { max_error } => {
                self.cut(plan, cut_limits(&plan.mode, max_error), observer)
            }
            Rung::Subsampled { level } => {
                let limits = CutLimits { finest_level: level, ..cut_limits(&plan.mode, 0.0) };
                self.cut(plan, limits, observer)
            }
            Rung::Cheaper(kernel) if self.engines.drew() == EngineKind::Native => {
                // Voxel by voxel, as triangles would be.
                let mode =
                    SplatSettings { kernel, backend: Backend::Tiles, ..plan.mode.previewed() };
                self.natively(&plan.in_mode(mode), SlabField::Own, observer)
            }
            Rung::Cheaper(kernel) => self.grid(plan, kernel, observer),
            Rung::Reduced { field, shrink } => {
                self.reduced(plan, Reduction { field, shrink, cut: None }, observer)
            }
            Rung::Bricks { max_error } => {
                let cut = self.cuts.ask(plan, max_error);
                let whole = Reduction { field: SlabField::Own, shrink: 1.0, cut };
                let drawn = self.reduced(plan, whole, observer)?;
                cut.into_iter().for_each(|number| self.cuts.tell_missing(number));
                Ok(drawn)
            }
            Rung::Full => self.full(plan, observer),
        }
    }

    /// The finished picture, the way that its plan says.
    pub(super) fn full(
        &mut self,
        plan: &Plan,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        if self.engines.of_plan(plan) == EngineKind::Native && plan.way != Way::Nodes {
            return self.natively(plan, SlabField::Own, observer);
        }
        match plan.way {
            Way::Nothing if plan.surfaces.is_empty() => self.nothing(plan),
            Way::Nothing | Way::Slabs => self.slabs(plan, SlabField::Own, observer),
            Way::Gathered => self.gathered(plan, observer),
            Way::Triangles => self.grid(plan, plan.mode.kernel.splatted(), observer),
            Way::Nodes => self.cut(plan, cut_limits(&plan.mode, 0.0), observer),
        }
    }

    /// The background alone.
    fn nothing(&mut self, plan: &Plan) -> Result<Drawn, DrawError> {
        let start = Instant::now();
        self.begin(plan, &plan.view(), Kernel::Point)?;
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(Drawn { size: plan.size, wall_ms, ..Drawn::default() })
    }

    /// The cut and the size that fit a budget, from the costs measured so far.
    fn coarse(
        &mut self,
        plan: &Plan,
        budget_ms: f64,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let is_native = self.engines.drew() == EngineKind::Native;
        let has_octree = |pyramid: &Pyramid| pyramid.measure == plan.mode.cut.measure;
        if is_native && !self.pyramid().is_some_and(has_octree) {
            self.prepare_octree(plan, false, observer)?;
        }
        let start = Instant::now();
        let count = self.costs.splats_within(budget_ms);
        let (size, view) = (plan.size, plan.view());
        // The error that the last cut of as many nodes was fitted to is the nearer guess.
        let is_like = |(of, error): &(u64, f32)| of / 2 <= count && count <= 2 * of && *error > 0.0;
        let known = self.last_fit.filter(is_like).map(|(_, error)| error);
        let limits = CutLimits {
            // Nodes that would be under a pixel at the size drawn last are not split further.
            min_radius_px: self.last_shrink.max(1.0),
            // At the size drawn last, too.
            splat_px: Some(self.costs.splat_pixels() * self.last_shrink * self.last_shrink),
            minds_edges: true,
            ..cut_limits(&plan.mode, known.unwrap_or_else(|| self.error_for_count(count)))
        };
        let (cut, limits) = Cut::of_count(limits, count, |limits| self.cut_of(plan, &view, limits));
        self.last_fit = Some((count, limits.max_error));
        // Coarse levels have no finer nodes, and those under a pixel are not split, whatever their error.
        let reached = cut.nodes.iter().map(|node| node.node.error).fold(0.0, f32::max);
        let max_error = limits.max_error.max(reached);
        let fragments = fragments(&cut, &plan.mode, &view);
        let affordable = self.costs.fragments_within(budget_ms, cut.nodes.len() as u64);
        // Smooth pictures lose little at a smaller size, which is enlarged when shown; those of a few
        // nodes that each fill the picture, next to nothing.
        let shrink = (fragments / affordable).sqrt().clamp(1.0, most_shrink(size));
        self.last_shrink = shrink;
        let smaller = shrunk(size, shrink);
        let missing_rmse = match plan.mode.kernel {
            Kernel::Point => missing_rmse(&cut, f64::from(size[0]) * f64::from(size[1])),
            _ => 0.0,
        };
        let smaller_plan = plan.at_size(smaller, 1.0);
        if !is_native {
            self.begin(plan, &smaller_plan.view(), plan.mode.kernel.splatted())?;
        }
        // So that it hides as much as what follows it: nobody wants to see a flash.
        let factor = match (RadialKernel::new(plan.mode.kernel.splatted(), None), self.pyramid()) {
            (Some(_), Some(pyramid)) => pyramid.thinning.factor(&cut.nodes),
            _ => 1.0,
        };
        let (count, levels) = (cut.nodes.len() as u64, levels(&cut));
        if is_native {
            let thinner = |node: Node| Node { extinction: node.extinction * factor, ..node };
            let nodes: Vec<Node> = cut.nodes.iter().map(node).map(thinner).collect();
            self.native_nodes(&smaller_plan, &nodes, observer)?;
        } else {
            let thinner =
                |record: Record| Record { extinction: record.extinction * factor, ..record };
            let records: Vec<Record> = cut.nodes.iter().map(record).map(thinner).collect();
            // A preview: triangles draw large splats quicker, unless someone asked for tiles.
            if previews_by_lists(&plan.mode) {
                self.draw_lists(plan, &smaller_plan.view(), &records, observer)?;
            } else {
                self.draw_records(&records, observer)?;
            }
        }
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        self.costs.learn(count, fragments / (shrink * shrink), wall_ms);
        self.keep(cut, limits);
        Ok(Drawn {
            size: smaller,
            kernels: count,
            nodes: count,
            levels,
            max_error,
            missing_rmse,
            wall_ms,
            ..Drawn::default()
        })
    }

    pub(super) fn begin(
        &mut self,
        plan: &Plan,
        view: &View,
        kernel: Kernel,
    ) -> Result<(), DrawError> {
        let unit_distance = plan.frame.unit_distance;
        let renderer = self.engines.gpu()?;
        if kernel == Kernel::Gouraud {
            return Ok(renderer.begin_meshes(view, &plan.mode, unit_distance)?);
        }
        Ok(renderer.begin(view, kernel, plan.mode.splatted_extent(), unit_distance)?)
    }

    fn cut_of(&self, plan: &Plan, view: &View, limits: CutLimits) -> Cut {
        let source = self.coarse_cut_source();
        source.map_or_else(Cut::default, |source| source.cut(&plan.mode, view, limits))
    }

    fn keep(&mut self, cut: Cut, limits: CutLimits) {
        self.kept_cut = self.keeps_cut.then_some((cut, limits));
    }

    fn cut(
        &mut self,
        plan: &Plan,
        limits: CutLimits,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let is_native = self.engines.drew() == EngineKind::Native;
        if is_native {
            self.prepare_octree(plan, false, observer)?;
        }
        let start = Instant::now();
        let (size, view) = (plan.size, plan.view());
        let cut = self.cut_of(plan, &view, limits);
        let (count, levels) = (cut.nodes.len() as u64, levels(&cut));
        // Of a level that was asked for, whatever the errors.
        let reached = match limits.finest_level {
            0 => limits.max_error,
            _ => cut.nodes.iter().map(|node| node.node.error).fold(limits.max_error, f32::max),
        };
        if is_native {
            let nodes: Vec<Node> = cut.nodes.iter().map(node).collect();
            self.native_nodes(plan, &nodes, observer)?;
        } else {
            let records: Vec<Record> = cut.nodes.iter().map(record).collect();
            self.begin(plan, &view, plan.mode.kernel.splatted())?;
            if lists_cut(&plan.mode) {
                self.draw_lists(plan, &view, &records, observer)?;
            } else {
                self.draw_records(&records, observer)?;
            }
        }
        self.keep(cut, limits);
        Ok(Drawn {
            size,
            kernels: count,
            nodes: count,
            levels,
            max_error: reached,
            wall_ms: start.elapsed().as_secs_f64() * 1e3,
            ..Drawn::default()
        })
    }

    /// An octree cut by lists of scattered kernels (see [`Renderer::draw_scattered`]).
    fn draw_lists(
        &mut self,
        plan: &Plan,
        view: &View,
        records: &[Record],
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let mut splat = plan.mode;
        if splat.visibility == Visibility::Sheets {
            // Nodes lie in no sheet of the lattice: they are composited one by one.
            splat.visibility = Visibility::EverySample;
        }
        let what = Scattered { stop_below: STOP_BELOW, ..Scattered::new(records, &splat) };
        let what = Scattered { piece_ms: PIECE_MS, ..what };
        let mut observed = |renderer: &mut Renderer, done| !observer.piece_done(renderer, done);
        let totals = self.engines.gpu()?.draw_scattered(view, &what, &mut observed)?;
        if totals.finished { Ok(()) } else { Err(DrawError::Interrupted) }
    }

    fn draw_records(
        &mut self,
        records: &[Record],
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let total = records.len();
        let mut done = 0;
        let first = u32::try_from(self.costs.splats_within(PIECE_MS)).unwrap_or(u32::MAX);
        let mut pace = Pace::new(first, 256);
        while done < total {
            let end = (done + pace.piece() as usize).min(total);
            let wall_ms = self.engines.gpu()?.draw_records(&records[done..end])?;
            pace.learn((end - done) as f64, wall_ms, PIECE_MS);
            done = end;
            if observer.piece_done(&mut self.engines, done as f64 / total as f64) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(())
    }

    /// Every voxel with opacity, a few rows of the traversal at a time.
    fn grid(
        &mut self,
        plan: &Plan,
        kernel: Kernel,
        observer: &mut dyn Observer,
    ) -> Result<Drawn, DrawError> {
        let start = Instant::now();
        let (size, view) = (plan.size, plan.view());
        // The device rounds 32-bit samples, and may find a few more with opacity than the host
        // did. A picture with too little room in a piece is drawn again with more, never short.
        let mut slack = 0;
        loop {
            self.begin(plan, &view, kernel)?;
            self.grid_pieces(&view, slack, observer)?;
            let totals = self.engines.gpu()?.grid_totals()?;
            if totals.most_missing == 0 {
                return Ok(Drawn {
                    size,
                    kernels: totals.kernels,
                    wall_ms: start.elapsed().as_secs_f64() * 1e3,
                    ..Drawn::default()
                });
            }
            slack = 2 * (slack + totals.most_missing);
        }
    }

    fn grid_pieces(
        &mut self,
        view: &View,
        slack: u64,
        observer: &mut dyn Observer,
    ) -> Result<(), DrawError> {
        let Some(pyramid) = self.classified.as_ref().and_then(Classified::whole) else {
            return Err(GpuError::Device("nothing was prepared".to_owned()).into());
        };
        let (dims, active) = (pyramid.dims, &pyramid.active);
        let mut rows = RowPlan::new(dims, active, view);
        let total = rows.total.max(1) as f64;
        let mut kernels = 0;
        while let Some(piece) = rows.next(&self.costs) {
            let row_count = piece.rows.len() as u64;
            let wall_ms = self.engines.gpu()?.draw_rows(view, piece.rows, piece.most + slack)?;
            kernels += piece.expected;
            self.costs.learn_grid(piece.expected, row_count, wall_ms);
            let done = (kernels as f64 / total).min(1.0);
            if observer.piece_done(&mut self.engines, done) {
                return Err(DrawError::Interrupted);
            }
        }
        Ok(())
    }
}

/// The cut of an error, down to nodes whose kernels are a pixel wide.
pub(super) fn cut_limits(mode: &SplatSettings, max_error: f32) -> CutLimits {
    let CutSettings { view_dependent, balanced, .. } = mode.cut;
    CutLimits { view_dependent, balanced, ..CutLimits::of_error(max_error) }
}

/// Whether a coarse picture within a budget is drawn by lists rather than triangles.
pub(super) fn previews_by_lists(splat: &SplatSettings) -> bool {
    splat.backend == Backend::Tiles && splat.visibility != Visibility::Sheets
}

/// Whether an octree cut is drawn by lists rather than triangles.
pub(super) fn lists_cut(splat: &SplatSettings) -> bool {
    match splat.visibility {
        // Triangles know no published opacity, but for meshes.
        Visibility::EverySample | Visibility::Sheets => {
            let published = splat.opacity_model == OpacityModel::Published;
            splat.backend == Backend::Tiles || published && splat.kernel != Kernel::Gouraud
        }
        // Shaded first, nodes are a stand-in for a reconstructed field, and triangles do.
        Visibility::Slabs => splat.classify == Classify::Before,
    }
}

/// A size so many times smaller, a pixel at least.
/// How many times smaller a coarse picture of a size is at most.
pub(super) fn most_shrink(size: [u32; 2]) -> f64 {
    let side = f64::from(size[0].min(size[1]));
    (side / (side / MOST_SHRINK).clamp(LEAST_SIDE, LEAST_SIDE_OF_LARGE)).max(1.0)
}

pub(super) fn shrunk(size: [u32; 2], shrink: f64) -> [u32; 2] {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1..=size")]
    let smaller = size.map(|n| (f64::from(n) / shrink).round().max(1.0) as u32);
    smaller
}

/// Whether the native engine draws the kernels of an octree, or voxel by voxel: all but triangles.
fn draws_nodes(mode: &SplatSettings, rung: Rung) -> bool {
    let kernel = if let Rung::Cheaper(kernel) = rung { kernel } else { mode.kernel };
    mode.backend != Backend::Raster && kernel != Kernel::Gouraud
}

/// Of how many levels the nodes of a cut are.
fn levels(cut: &Cut) -> usize {
    let side = |node: &CutNode| node.size.iter().fold(1, |most, &side| most.max(side));
    let sides = cut.nodes.iter().fold(0_u64, |seen, node| {
        seen | 1 << u64::from(side(node).next_power_of_two().trailing_zeros())
    });
    sides.count_ones() as usize
}

fn node(CutNode { low, size, node, .. }: &CutNode) -> Node {
    let colour = node.colour.map(|c| f32::from(c) / f32::from(u16::MAX));
    Node { low: *low, size: *size, extinction: node.extinction, colour }
}

fn record(node: &CutNode) -> Record {
    Record::new(node.low, node.size, node.node.extinction, node.node.colour)
}

/// Pixels that a cut's quads cover, overlaps counted each time, none more than the picture has; in
/// perspective as at the middle.
fn fragments(cut: &Cut, mode: &SplatSettings, view: &View) -> f64 {
    let radius = RadialKernel::new(mode.kernel.splatted(), mode.splatted_extent())
        .map_or(0.5, |k| k.radius());
    let rows = view.view_from_index.transpose();
    let area = rows.x_axis.cross(rows.y_axis).length() * 4.0 * radius * radius;
    let picture = f64::from(view.size[0]) * f64::from(view.size[1]);
    cut.nodes
        .iter()
        .map(|n| area * f64::from(n.size[0] * n.size[1] * n.size[2]).powf(2.0 / 3.0))
        .map(|covered| covered.min(picture))
        .sum()
}

/// What a cut of points leaves dark in a picture of so many pixels: a node of many voxels is one
/// pixel, where each of its voxels would have been one. Root mean square over RGB, linear light.
fn missing_rmse(cut: &Cut, pixels: f64) -> f64 {
    let (mut energy, mut covered) = (0.0, 0.0);
    for CutNode { size, node, .. } in &cut.nodes {
        let voxels = f64::from(size[0] * size[1] * size[2]);
        let opacity = -(-f64::from(node.extinction)).exp_m1();
        let light = node.colour.map(|c| f64::from(c) / f64::from(u16::MAX));
        let square = light.iter().map(|c| c * c).sum::<f64>() / 3.0;
        energy += (voxels - 1.0) * opacity * opacity * square;
        covered += voxels * opacity;
    }
    // Where points lie over each other, only those in front would have been seen.
    let layers = covered / pixels;
    let seen = if layers > 0.0 { -(-layers).exp_m1() / layers } else { 1.0 };
    (energy * seen / pixels).sqrt()
}
