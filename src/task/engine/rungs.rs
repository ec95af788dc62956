//! One frame: the way up from the coarse picture to the finished one, rung by rung.

use std::sync::Arc;

use super::converge::Doublings;
use super::next::LastDrawn;
use super::report::picture;
use super::watch::{Manner, Watch};
use super::worker::Worker;
use super::{Effort, EngineState, FrameRequest, Ladder, Picture};
use crate::core::Ticket;
use crate::gpu::GpuError;
use crate::kernel::Kernel;
use crate::plan::{Plan, Way};
use crate::scene::{Backend, Scene, SplatSettings};
use crate::task::draw::{DrawError, Drawer, Drawn, Rung};
use crate::task::engines::{Canvas, EngineKind};
use crate::task::estimate::{self, Checked, Coarseness};
use crate::task::level::LevelOfDetail;
use crate::task::previews::Reduction;
use crate::task::remaining::Told;
use crate::task::smooth;

/// A middle rung may take this share of what `full` takes.
const MIDDLE_SHARE: f64 = 0.1;
/// The first of two middle rungs may take this share.
const FIRST_SHARE: f64 = 0.03;
/// `full` follows the coarse picture at once where it takes no longer than this.
const MIDDLE_WORTH_MS: f64 = 700.0;
/// Two middle rungs come before a `full` that takes longer than this.
const SEVERAL_WORTH_MS: f64 = 3000.0;
/// Share of the whole way that `full` is, where slabs are doubled after it.
const FULL_SHARE: f64 = 0.5;
/// What can be drawn five times a second (Laur–Hanrahan, figure 6): a budget beyond it is a pause of
/// the hand, before which and after every movement there is a picture of this budget.
const QUICK_MS: f64 = 200.0;
/// Cuts of a field come before a `full` that takes longer than this,
const CUTS_WORTH_MS: f64 = 200.0;
/// the last of them in this share of its time,
const CUT_SHARE: f64 = 0.2;
/// each of the others in a quarter of the next one's,
const CUT_STEP: f64 = 4.0;
/// and none in less than this: a moving hand has seen what that allows.
const LEAST_CUT_MS: f64 = 40.0;
/// And none that is not thought to be off by this share at most of what the one before it is.
const NEARER: f64 = 0.8;
/// Share of the whole way, at most, that is done while bricks have not come.
const WITHOUT_ALL_BRICKS: f64 = 0.99;
/// A rung that is not so many times sharper than what is on the screen is left out.
const WORTH_SHARPENING: f64 = 1.5;

impl Worker {
    /// Draws a request as far as it goes.
    pub(super) fn refine(
        &mut self,
        request: &FrameRequest,
        ticket: &Ticket,
    ) -> Result<(), DrawError> {
        self.announce(EngineState::Drawing(0.0));
        let (scene, size, plan) = (&request.scene, request.size, request.plan());
        match request.effort {
            Effort::Moving { budget_ms } => self.follow(request, budget_ms, ticket),
            Effort::Rest { budget_ms, ladder, show_partial, .. } => {
                let is_first = ladder != Ladder::AtOnce && self.preview_of(request).is_none();
                if is_first && self.prepare_first(request, ticket)? {
                    let budget_ms = budget_ms.min(QUICK_MS);
                    self.rung(request, Rung::Coarse { budget_ms }, Manner::Whole, None)?;
                }
                let has_octree = self.prepare(request, ticket)?;
                self.last_ladder = Some(ladder);
                let makes_same =
                    |seen: &FrameRequest| seen.size == size && seen.scene.makes_same_picture(scene);
                let finished = self.finished.take().filter(|(seen, full)| {
                    makes_same(seen) && (full.report.smoothed_ms.is_none() || smooths(request))
                });
                // Only how far to go has changed, or more bricks have come: nothing coarse is shown again, and nothing drawn
                // that is there already.
                let goes_on = self.lacking.take().is_some_and(|seen| makes_same(&seen));
                let goes_on = goes_on || finished.is_some();
                let ladder = if goes_on { Ladder::AtOnce } else { ladder };
                if let Some((seen, full)) = finished
                    && ends_in_full(request, full.report.frame_ms)
                {
                    if seen.effort == request.effort && full.report.remaining_rmse.is_none() {
                        // A still came while it was looked at for what it is off by.
                        self.finished = Some((seen, full));
                        return self.end_in_full();
                    }
                    let mut again = (*full).clone();
                    note_refined(request, &mut again);
                    let again = Arc::new(again);
                    self.finished = Some((request.clone(), Arc::clone(&again)));
                    self.publish(again);
                    return self.end_in_full();
                }
                // A moving hand has seen it, or it was drawn before a still interrupted.
                let seen = self.preview_of(request).is_some();
                let budget_ms_now = budget_ms.min(QUICK_MS);
                if self.device()?.lacks_bricks(&plan) {
                    // What has come is drawn by cuts alone.
                    self.prepare_preview_field(request)?;
                }
                let drawer = self.device()?;
                // Cuts have no vectors, which nobody wants to see vanish: while there is no field to draw
                // them beside, the picture before stays.
                let has_cut = has_octree && plan.kernels.is_empty();
                let has_preview = has_cut || drawer.reduction(&plan, budget_ms_now).is_some();
                if !seen && has_preview && ladder != Ladder::AtOnce {
                    let budget_ms = budget_ms_now;
                    self.rung(request, Rung::Coarse { budget_ms }, Manner::Whole, None)?;
                }
                // What was finished before has been taken above.
                let whole = self.finished.as_ref().map(|(_, full)| full.report.frame_ms);
                let cuts = self.device()?.cut_source();
                self.find_cells(cuts.as_ref());
                let spent = self.preview_of(request).and_then(|c| c.picture.report.budget_ms);
                let unspent_ms = if spent == Some(budget_ms) { 0.0 } else { budget_ms };
                self.prepare_preview_field(request)?;
                let mut rungs = match whole {
                    Some(_) => Vec::new(),
                    None => self.ladder(&plan, ladder, unspent_ms)?,
                };
                // A preview in the scene's own mode may have been as sharp as the next rung.
                let sharpness = self.preview_reduction().unwrap_or(f64::INFINITY);
                rungs.retain(|rung| is_worth_it(*rung, sharpness));
                let share = if doublings(request, 0.0).is_some() { FULL_SHARE } else { 1.0 };
                let step = share / rungs.len() as f64;
                let mut full_ms = whole.unwrap_or(0.0);
                for (i, rung) in rungs.iter().copied().enumerate() {
                    if self.newer_came() {
                        return Err(DrawError::Interrupted);
                    }
                    let show_partial = show_partial && rung == Rung::Full;
                    let (before, mut after) = (i as f64 * step, (i + 1) as f64 * step);
                    if let Rung::Bricks { .. } = rung {
                        after = after.min(WITHOUT_ALL_BRICKS);
                    }
                    let manner = Manner::InPieces { show_partial, before, after };
                    full_ms = self.rung(request, rung, manner, rungs.get(i + 1).copied())?;
                    if self.finished.is_some() {
                        // By a budget that affords every ray.
                        break;
                    }
                }
                if self.finished.is_none() {
                    // Not of all bricks: it is drawn on when more come.
                    self.lacking = Some(request.clone());
                    return Ok(());
                }
                if let Some(doublings) = doublings(request, full_ms)
                    && let Some(last) = self.converge(request, doublings, share)?
                {
                    return self.end(last);
                }
                self.end_in_full()
            }
        }
    }

    /// A moving view: a quick picture, and where the budget is longer than that, the one that it
    /// affords for as long as the hand pauses.
    fn follow(
        &mut self,
        request: &FrameRequest,
        budget_ms: f64,
        ticket: &Ticket,
    ) -> Result<(), DrawError> {
        self.lacking = None;
        let (scene, plan) = (&request.scene, request.plan());
        let quick_ms = budget_ms.min(QUICK_MS);
        let longer = (budget_ms > QUICK_MS).then_some(Rung::Coarse { budget_ms });
        self.finished = None;
        // It is there already where a still interrupted the longer one.
        if longer.is_none() || self.preview_of(request).is_none() {
            self.device()?.prepare_preview(&plan, quick_ms, ticket)?;
            // Bounded by its budget, and not interrupted by a view that moves on: a hand that moves faster than
            // pictures are drawn still sees every one of them.
            let quick = Rung::Coarse { budget_ms: quick_ms };
            self.rung(request, quick, Manner::Whole, longer)?;
            self.complete_octree(scene, &plan)?;
        }
        let is_short_of = |c: &Unchecked| match c.coarseness {
            Coarseness::Octree { max_error, .. } => max_error > 0.0 || c.picture.shrink() > 1.0,
            _ => c.picture.shrink() > 1.0,
        };
        let Some(longer) = longer.filter(|_| self.preview_of(request).is_some_and(is_short_of))
        else {
            return Ok(());
        };
        if self.newer_came() {
            return Err(DrawError::Interrupted);
        }
        self.device()?.prepare_preview(&plan, budget_ms, ticket)?;
        let manner = Manner::InPieces { show_partial: false, before: 0.0, after: 0.0 };
        self.rung(request, longer, manner, None)?;
        Ok(())
    }

    /// Brings the device and the octree up to a request, unless something newer comes; whether there is
    /// an octree. Fields that are reconstructed are drawn without one where memory is short.
    fn prepare(&mut self, request: &FrameRequest, ticket: &Ticket) -> Result<bool, DrawError> {
        let prepare = |drawer: &mut Drawer, watch: &mut Watch<'_>| {
            drawer.prepare_watched(&request.plan(), ticket, watch)
        };
        match self.watched(request, prepare) {
            Ok(()) => Ok(true),
            Err(DrawError::TooLarge(error)) if request.plan().reconstructs() => {
                log::warn!("no octree for quick pictures: {error}");
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// Brings the device up to the first quick picture of a request that needs nothing else, unless something newer comes; whether
    /// there is one.
    fn prepare_first(
        &mut self,
        request: &FrameRequest,
        ticket: &Ticket,
    ) -> Result<bool, DrawError> {
        self.watched(request, |drawer, watch| drawer.prepare_first(&request.plan(), ticket, watch))
    }

    /// Work of the drawer for a request that shows no picture, while something newer is watched for.
    fn watched<T>(
        &mut self,
        request: &FrameRequest,
        work: impl FnOnce(&mut Drawer, &mut Watch<'_>) -> Result<T, DrawError>,
    ) -> Result<T, DrawError> {
        self.device()?;
        let Some(mut drawer) = self.drawer.take() else { return Err(no_device()) };
        let manner = Manner::InPieces { show_partial: false, before: 0.0, after: 0.0 };
        let mut watch = Watch::new(self, request, manner, &drawer);
        let done = work(&mut drawer, &mut watch);
        self.drawer = Some(drawer);
        done
    }

    /// Has the finer levels of the octree built beside what is drawn next, where a quick picture was drawn
    /// without them and the next is of the same transfer function.
    fn complete_octree(&mut self, scene: &Scene, plan: &Plan) -> Result<(), DrawError> {
        let is_of_another = |next: &FrameRequest| {
            !next.scene.has_same_volume(scene)
                || next.scene.drawn_transfer() != scene.drawn_transfer()
        };
        if self.shared.lock().frame.as_ref().is_some_and(is_of_another) {
            return Ok(());
        }
        if self.device()?.has_coarse_octree() {
            self.device()?.begin_octree(plan)?;
            // On the device at least one piece, so that a hand that never stops gets there.
            while self.device()?.advance_octree()? && !self.newer_came() {}
        }
        Ok(())
    }

    /// The coarse picture of a request's view, where it is the one that was drawn last.
    fn preview_of(&self, request: &FrameRequest) -> Option<&Unchecked> {
        self.coarse.iter().find(|c| {
            c.is_preview
                && c.request.size == request.size
                && c.request.scene.makes_same_picture(&request.scene)
        })
    }

    /// The coarse picture of a request's view that is thought to be nearest.
    pub(super) fn nearest_of(&self, request: &FrameRequest) -> Option<&Picture> {
        let of_view = self.coarse.iter().filter(|c| {
            c.request.size == request.size && c.request.scene.makes_same_picture(&request.scene)
        });
        let rmse = |picture: &Picture| picture.report.estimated_rmse.unwrap_or(f64::INFINITY);
        let pictures = of_view.map(|c| &*c.picture);
        pictures.min_by(|a, b| rmse(a).total_cmp(&rmse(b)))
    }

    /// The rungs after the coarse picture. Of a budget beyond a quick picture's, `unspent_ms` is left
    /// to be drawn in.
    pub(super) fn ladder(
        &mut self,
        plan: &Plan,
        ladder: Ladder,
        unspent_ms: f64,
    ) -> Result<Vec<Rung>, DrawError> {
        let drawer = self.device()?;
        let budgeted = |full_ms: f64| {
            let is_worth_it = unspent_ms > QUICK_MS && full_ms > unspent_ms;
            is_worth_it.then(|| vec![Rung::Coarse { budget_ms: unspent_ms }])
        };
        let mut rungs = match ladder {
            // Samples that are shaded first have fields before them, and cost about as much a ray.
            Ladder::Octree
                if matches!(plan.way, Way::Nothing | Way::Slabs) || plan.is_gathered() =>
            {
                let rays = f64::from(plan.size[0]) * f64::from(plan.size[1]);
                let full_ms = rays * drawer.costs.ray_ms;
                let reduced = |shares: &[f64]| {
                    let within = |share| drawer.reduction(plan, full_ms * share);
                    let rung = |Reduction { field, shrink, .. }| Rung::Reduced { field, shrink };
                    shares.iter().copied().filter_map(within).map(rung).collect()
                };
                budgeted(full_ms).unwrap_or_else(|| match full_ms {
                    _ if drawer.has_cuts(plan) => nearer(drawer, plan, &cut_budgets(full_ms)),
                    quick if quick < MIDDLE_WORTH_MS => Vec::new(),
                    slow if slow < SEVERAL_WORTH_MS => reduced(&[MIDDLE_SHARE]),
                    _ => reduced(&[FIRST_SHARE, MIDDLE_SHARE]),
                })
            }
            Ladder::Octree => {
                let full_ms = drawer.active_count().unwrap_or(0) as f64 * drawer.costs.voxel_ms;
                budgeted(full_ms).unwrap_or_else(|| match full_ms < MIDDLE_WORTH_MS {
                    true => Vec::new(),
                    false => vec![Rung::Coarse { budget_ms: full_ms * MIDDLE_SHARE }],
                })
            }
            // What kernels of the field alone would show hides the vectors.
            Ladder::Subsampling | Ladder::CheaperKernels if !plan.kernels.is_empty() => Vec::new(),
            Ladder::Subsampling => {
                vec![Rung::Subsampled { level: 2 }, Rung::Subsampled { level: 1 }]
            }
            Ladder::AtOnce => Vec::new(),
            Ladder::CheaperKernels => {
                vec![Rung::Cheaper(Kernel::Point), Rung::Cheaper(Kernel::Nearest)]
            }
        };
        rungs.retain(|rung| *rung != Rung::Cheaper(plan.mode.kernel));
        if !plan.inside.is_plain() || !plan.surfaces.is_empty() {
            // Nobody wants to see flash up again what was cut away, nor what is embedded vanish.
            rungs.retain(|rung| !matches!(rung, Rung::Subsampled { .. } | Rung::Cheaper(_)));
        }
        // The finished picture is of all bricks, and until all have come there is one of those that have.
        rungs.push(match drawer.lacks_bricks(plan) {
            true => Rung::Bricks { max_error: 0.0 },
            false => Rung::Full,
        });
        Ok(rungs)
    }

    /// Draws and publishes one rung; what it took, milliseconds. `following` is the one after it,
    /// where that is known better than by the way up.
    fn rung(
        &mut self,
        request: &FrameRequest,
        rung: Rung,
        manner: Manner,
        following: Option<Rung>,
    ) -> Result<f64, DrawError> {
        let plan = request.plan();
        let (drawn, backend) = self.drawn(request, rung, manner)?;
        // Where a budget affords every ray, nothing is left to be drawn after it.
        let rung = if drawn.is_whole(request.size) { Rung::Full } else { rung };
        let progress = match manner {
            Manner::Whole => 0.0,
            Manner::InPieces { after, .. } => after,
        };
        let level = LevelOfDetail::of(rung, &drawn);
        let mut picture = self.presented(request, level, progress, &drawn)?;
        picture.report.backend = backend;
        let coarseness = Coarseness::of(&plan, rung, &drawn, picture.shrink(), &picture.rgba);
        if drawn.is_reduced && picture.shrink() > 1.0 {
            self.last_reduced = Some(LastDrawn::of(request, drawn.wall_ms));
        }
        let known = self.device()?.known_rmse(&plan, &drawn)?;
        if let Some(Coarseness::Reduced { sampling_rmse, .. }) = coarseness {
            let shrink = picture.shrink();
            self.device()?.note_sampling(shrink, &drawn, (known, sampling_rmse));
        }
        if let Some(coarseness) = coarseness {
            let estimated_rmse = self.estimator.rmse(&plan, coarseness, picture.shrink());
            if let Some(measured_rmse) = known {
                // A view at rest teaches what is thought of those that move.
                let checked = Checked { estimated_rmse, measured_rmse };
                self.estimator.learn(&plan, coarseness, &checked);
            }
            let rmse = known.unwrap_or(estimated_rmse);
            picture.report.estimated_rmse = Some(rmse);
            if let Rung::Coarse { budget_ms } = rung {
                picture.report.budget_ms = Some(budget_ms);
            }
            let sharpness = match coarseness {
                // Marks are finer than the field: each larger picture shows more of them.
                Coarseness::Reduced { field, .. } => {
                    Reduction { field, shrink: picture.shrink(), cut: None }.own_shrink()
                }
                _ => f64::INFINITY,
            };
            let following = following.or_else(|| self.next_at_rest(request, sharpness));
            let next = following.and_then(|rung| self.next_of(request, rung, &picture, coarseness));
            picture.report.next = next;
        }
        if rung == Rung::Full || coarseness.is_some() {
            let thought = Told::thought(&plan, self.last_told.as_ref());
            picture.report.remaining_thought = Some(thought);
        }
        if rung == Rung::Full {
            self.check(request, &mut picture);
            note_refined(request, &mut picture);
        }
        let picture = Arc::new(picture);
        if let Some(coarseness) = coarseness {
            let is_preview = matches!(rung, Rung::Coarse { .. });
            self.coarse.retain(|other| other.is_preview != is_preview);
            let picture = Arc::clone(&picture);
            self.coarse.push(Unchecked {
                request: request.clone(),
                picture,
                coarseness,
                is_preview,
            });
        }
        if rung == Rung::Full {
            self.last_full = Some(LastDrawn::of(request, drawn.wall_ms));
            self.finished = Some((request.clone(), Arc::clone(&picture)));
        }
        // Before it, so that nobody sees the cells of the picture before over this one.
        self.publish_drawn_cells(request);
        self.publish(Arc::clone(&picture));
        // Nobody waits for it while a view rests.
        let is_at_rest = matches!(request.effort, Effort::Rest { .. }) && !self.newer_came();
        if rung == Rung::Full && is_at_rest {
            self.estimator.see(&plan, picture.size, &picture.rgba);
        }
        Ok(drawn.wall_ms)
    }

    /// Draws one rung; what it is, and what drew it.
    pub(super) fn drawn(
        &mut self,
        request: &FrameRequest,
        rung: Rung,
        manner: Manner,
    ) -> Result<(Drawn, Backend), DrawError> {
        self.device()?;
        // Taken out while it draws, so that pieces can announce themselves through `self`.
        let Some(mut drawer) = self.drawer.take() else { return Err(no_device()) };
        let mut watch = Watch::new(self, request, manner, &drawer);
        let (learnt, plan) = (drawer.costs, request.plan());
        drawer.keeps_cut = self.wants_cut_of(request);
        let in_own_mode = match rung {
            Rung::Full | Rung::Reduced { .. } | Rung::Bricks { .. } => true,
            Rung::Coarse { budget_ms } => drawer.reduction(&plan, budget_ms).is_some(),
            _ => false,
        };
        let plan = match in_own_mode {
            true => {
                let backend = drawer.window_backend(&plan);
                plan.in_mode(SplatSettings { backend, ..plan.mode })
            }
            false => {
                let previewed = plan.previewed();
                match drawer.engines.of_plan(&plan) {
                    EngineKind::Native => {
                        let mode = SplatSettings { backend: Backend::Tiles, ..previewed.mode };
                        previewed.in_mode(mode)
                    }
                    EngineKind::Gpu => previewed,
                }
            }
        };
        let drawn = drawer.draw(&plan, rung, &mut watch);
        let is_whole = |drawn: &Drawn| rung == Rung::Full || drawn.is_whole(request.size);
        self.holds_finished = drawn.as_ref().is_ok_and(is_whole);
        if matches!((rung, manner), (Rung::Coarse { .. }, Manner::InPieces { .. })) {
            // A picture that may take far longer has other prices than those the hand needs.
            drawer.costs = learnt;
        }
        self.drawer = Some(drawer);
        Ok((drawn?, plan.mode.backend))
    }

    /// The picture on the device, with what is known of it.
    pub(super) fn presented(
        &mut self,
        request: &FrameRequest,
        level: LevelOfDetail,
        progress: f64,
        drawn: &Drawn,
    ) -> Result<Picture, DrawError> {
        let drawer = self.device()?;
        let rgba = drawer.engines.present(request.scene.background.light())?;
        let (held, engine) = (drawer.engines.held(), drawer.engines.drew());
        let name = drawer.engines.name();
        let not_native = drawer.engines.why_not_native(&request.plan());
        let native_loop = drawer.engines.native_loop();
        #[expect(clippy::cast_possible_truncation, reason = "0..=1")]
        let level = (level, progress as f32);
        let mut picture =
            picture((&request.scene, request.size), level, drawn, rgba, drawer.active_count());
        picture.report.held = Some(held);
        (picture.report.engine, picture.report.not_native) = (engine, not_native);
        picture.report.native_loop = native_loop;
        picture.report.octree = self.device()?.octree_builder();
        self.shared.lock().adapter_name = Some(name);
        Ok(picture)
    }

    /// Has what quick pictures of the volume are drawn from at hand before a hand asks for one.
    fn prepare_preview_field(&mut self, request: &FrameRequest) -> Result<(), DrawError> {
        let Some(mut drawer) = self.drawer.take() else { return Err(no_device()) };
        let manner = Manner::InPieces { show_partial: false, before: 0.0, after: 0.0 };
        let mut watch = Watch::new(self, request, manner, &drawer);
        let plan = request.plan();
        let result = drawer
            .prepare_preview_field(&plan, &mut watch)
            .and_then(|()| drawer.prepare_cuts(&plan, &mut watch))
            .and_then(|()| drawer.measure_stand_ins(&plan, &mut watch));
        self.drawer = Some(drawer);
        if plan.way == Way::Slabs {
            // Small pictures may have been drawn since.
            self.holds_finished = false;
        }
        result
    }

    pub(super) fn publish(&self, picture: Arc<Picture>) {
        self.shared.lock().picture = Some(picture);
        (self.wake)();
    }

    /// How many times smaller than shown the own field would have been drawn to be as near to the exact
    /// picture as the preview, where that was of a field.
    fn preview_reduction(&self) -> Option<f64> {
        let preview = self.coarse.iter().find(|c| c.is_preview)?;
        match preview.coarseness {
            Coarseness::Reduced { field, .. } => {
                Some(Reduction { field, shrink: preview.picture.shrink(), cut: None }.own_shrink())
            }
            _ => None,
        }
    }

    /// Holds the coarse pictures against the finished one of the same view, and learns from them.
    fn check(&mut self, request: &FrameRequest, picture: &mut Picture) {
        for coarse in std::mem::take(&mut self.coarse) {
            let Unchecked { request: seen, picture: shown, coarseness, is_preview } = coarse;
            let same = seen.size == request.size && seen.scene.makes_same_picture(&request.scene);
            let Some(estimated_rmse) = shown.report.estimated_rmse.filter(|_| same) else {
                continue;
            };
            if let Ok(measured_rmse) = estimate::shown_rmse(&shown, picture) {
                let checked = Checked { estimated_rmse, measured_rmse };
                self.estimator.learn(&request.plan(), coarseness, &checked);
                // The preview is the one that the hand saw.
                if is_preview {
                    picture.report.checked = Some(checked);
                }
            }
        }
    }
}

/// Whether edges are to be smooth once a view rests.
pub(super) fn smooths(request: &FrameRequest) -> bool {
    matches!(request.effort, Effort::Rest { smooth_edges: true, .. })
}

/// What is to be done beyond a `full` that took `full_ms`.
fn doublings(request: &FrameRequest, full_ms: f64) -> Option<Doublings> {
    match request.effort {
        Effort::Rest { converge_ms, .. } => {
            let smooths = smooths(request) && smooth::has_edges(&request.plan());
            let each = if smooths { f64::from(smooth::RAYS) } else { 1.0 };
            Doublings::after_full(&request.scene.splat, full_ms, (converge_ms, each))
        }
        Effort::Moving { .. } => None,
    }
}

/// Whether nothing is to be done beyond it.
fn ends_in_full(request: &FrameRequest, full_ms: f64) -> bool {
    doublings(request, full_ms).is_none_or(|doublings| !doublings.goes_on())
}

/// Notes on `full` what is to be done beyond it.
fn note_refined(request: &FrameRequest, full: &mut Picture) {
    let full_ms = full.report.frame_ms;
    if ends_in_full(request, full_ms) {
        full.report.progress = 1.0;
    }
    full.report.refined = doublings(request, full_ms).map(|doublings| doublings.report());
}

pub(super) fn no_device() -> DrawError {
    GpuError::Device("no device".to_owned()).into()
}

/// Milliseconds of the cuts of a field before a `full` of so many, the quickest first.
fn cut_budgets(full_ms: f64) -> Vec<f64> {
    if full_ms <= CUTS_WORTH_MS {
        return Vec::new();
    }
    let from_last = std::iter::successors(Some(full_ms * CUT_SHARE), |ms| Some(ms / CUT_STEP));
    let mut budgets: Vec<f64> = from_last.take_while(|ms| *ms >= LEAST_CUT_MS).collect();
    budgets.reverse();
    budgets
}

/// The rungs of some budgets, without those that are not thought to be nearer to `full` than the one before, the first of
/// them than what was drawn last.
fn nearer(drawer: &Drawer, plan: &Plan, budgets: &[f64]) -> Vec<Rung> {
    let rmse = |of: Reduction| drawer.thought_rmse(plan, &of);
    let mut last = drawer.last_reduction.map_or(f64::INFINITY, rmse);
    let is_nearer = |&budget_ms: &f64| {
        let thought = drawer.reduction(plan, budget_ms).map_or(f64::INFINITY, rmse);
        let is_nearer = thought < NEARER * last;
        if is_nearer {
            last = thought;
        }
        is_nearer
    };
    let budgets = budgets.iter().copied().filter(is_nearer);
    budgets.map(|budget_ms| Rung::Coarse { budget_ms }).collect()
}

/// Whether a rung shows more than a picture in the scene's own mode that is so many times smaller than
/// shown.
pub(super) fn is_worth_it(rung: Rung, sharpness: f64) -> bool {
    match rung {
        Rung::Reduced { field, shrink } => {
            Reduction { field, shrink, cut: None }.own_shrink() * WORTH_SHARPENING <= sharpness
        }
        _ => true,
    }
}

/// A coarse picture that was published, until a finished one of its view has checked it.
#[derive(Debug)]
pub(super) struct Unchecked {
    request: FrameRequest,
    picture: Arc<Picture>,
    coarseness: Coarseness,
    /// Drawn within a budget, rather than on the way up.
    is_preview: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_before_a_finished_picture_take_a_fifth_of_its_time_and_a_quarter_of_each_other() {
        assert_eq!(cut_budgets(200.0), [0.0; 0], "it is there at once");
        assert_eq!(cut_budgets(250.0), [50.0]);
        assert_eq!(cut_budgets(800.0), [40.0, 160.0]);
        assert_eq!(cut_budgets(4000.0), [50.0, 200.0, 800.0]);
        let spent: f64 = cut_budgets(1e6).iter().sum();
        assert!(spent < 0.27 * 1e6, "they put off the finished picture by {spent}");
    }
}
