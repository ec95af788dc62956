//! What drawing costs on this adapter, learnt while it runs.

use crate::plan::SlabField;

/// Milliseconds per thing drawn: first guesses, replaced by measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// Per octree splat, whatever its size.
    pub splat_ms: f64,
    /// Per pixel that a splat covers.
    pub fragment_ms: f64,
    /// Per voxel of `full`, at its present size on the picture.
    pub voxel_ms: f64,
    /// Per row looked at.
    pub row_ms: f64,
    /// Per ray of `full` in slabs.
    pub ray_ms: f64,
    /// Per ray of a smaller picture in slabs of each [`SlabField`]: rays farther apart share less.
    pub reduced_ray_ms: [f64; 2],
    /// Per smaller picture in slabs, however few its rays: the device is woken, and in a window whose
    /// interface is painted by the same processor it waits for that.
    pub reduced_start_ms: f64,
    /// Making the lists of vectors of a smaller picture, which few rays do not shorten; 0 without any.
    pub lists_ms: f64,
    /// Per pixel that a splat of a smaller picture's vectors is looked at in (`task::vectors`).
    pub visit_ms: f64,
}

impl Default for Costs {
    /// A software adapter on two cores; others correct it within a few pictures.
    fn default() -> Self {
        Self {
            splat_ms: 0.45e-3,
            fragment_ms: 4e-6,
            voxel_ms: 0.7e-3,
            row_ms: 0.2e-3,
            ray_ms: 2e-3,
            reduced_ray_ms: [2e-3, 0.7e-3],
            reduced_start_ms: 1.0,
            lists_ms: 0.0,
            visit_ms: 4e-6,
        }
    }
}

impl Costs {
    /// The native engine on two cores: see `benches/results/native.md`.
    pub fn native() -> Self {
        let reduced_ray_ms = [0.2e-3, 0.1e-3];
        Self { ray_ms: 0.2e-3, reduced_ray_ms, visit_ms: 1e-6, ..Self::default() }
    }
}

/// Weight of a new measurement against what was known.
const TRUST: f64 = 0.3;
/// The same for rays: whole pictures are measured, and few.
const RAY_TRUST: f64 = 0.7;
/// A smaller picture is believed to be cheaper than was thought by no more than this share at once,
const MOST_FALL: f64 = 0.8;
/// and dearer by no more than so many times what was thought.
const MOST_LONGER: f64 = 3.0;
/// Visits are believed to be dearer by no more than this at once.
const MOST_RISE: f64 = 4.0;
/// How many times more a ray of a smaller picture costs than one of `full`, at most: its neighbours
/// cross other voxels, and what they fetch is in no cache. 2.9 to 3.7 on scans, 8 times smaller; a ray
/// of tents, 5 times smaller, 0.5 of one of `full` through B-splines. By [`SlabField`].
const MOST_SPREAD_COST: [f64; 2] = [4.0, 1.0];
/// And at least, by [`SlabField`]. Whole pictures of three scans by the native engine: tents take 0.49 to 0.78 of what B-splines do;
/// smaller ones, lit, 0.17 and more: a picture too small is followed by larger ones, one too large keeps a hand waiting.
const LEAST_SPREAD_COST: [f64; 2] = [1.0, 0.3];
/// How many times more a ray through B-splines costs than one through tents, at most. Smaller pictures by the native engine: 1.3 to
/// 2.0 on three scans, and up to 6.6 lit, where derivatives of B-splines are 16 times 3 rows.
const MOST_OWN_OVER_PREVIEW: f64 = 8.0;
/// Share of a smaller picture's budget that goes to its rays at least.
const LEAST_RAY_SHARE: f64 = 0.4;
/// Share of a coarse picture's budget that goes to splats as such; the rest to their pixels.
const SPLAT_SHARE: f64 = 0.6;

impl Costs {
    /// Splats that a budget affords.
    pub fn splats_within(&self, budget_ms: f64) -> u64 {
        (budget_ms * SPLAT_SHARE / self.splat_ms).max(64.0) as u64
    }

    /// Pixels of a splat that cost as much as the splat as such.
    pub fn splat_pixels(&self) -> f64 {
        self.splat_ms / self.fragment_ms
    }

    /// Pixels that a budget affords once its splats are paid.
    pub fn fragments_within(&self, budget_ms: f64, splats: u64) -> f64 {
        let left = budget_ms - splats as f64 * self.splat_ms;
        left.max(budget_ms * 0.2) / self.fragment_ms
    }

    /// What a piece of the grid is thought to take.
    pub fn grid_ms(&self, kernels: u64, rows: u64) -> f64 {
        kernels as f64 * self.voxel_ms + rows as f64 * self.row_ms
    }

    /// Takes in a picture in slabs.
    pub fn learn_rays(&mut self, rays: f64, wall_ms: f64) {
        if rays > 0.0 && wall_ms > 0.0 {
            self.ray_ms += (wall_ms / rays - self.ray_ms) * RAY_TRUST;
            // The price of a smaller picture's rays may be old, or a guess: that of the whole picture says within what it
            // lies. Without the lower bound the first picture of a drag took many times its budget.
            let bounds = LEAST_SPREAD_COST.into_iter().zip(MOST_SPREAD_COST);
            for (ms, (least, most)) in self.reduced_ray_ms.iter_mut().zip(bounds) {
                *ms = ms.clamp(least * self.ray_ms, most * self.ray_ms);
            }
        }
    }

    /// Takes in a smaller picture in slabs. One that took far longer than thought may have had a
    /// pipeline to compile, and is not believed at once.
    ///
    /// One measurement does not tell what belongs to the picture and what to its rays: both prices
    /// change by as little as explains it, each as far as it took part. Pictures of different sizes
    /// then settle both (Kaczmarz's projections).
    pub fn learn_reduced(&mut self, field: SlabField, rays: f64, wall_ms: f64) {
        let thought = self.reduced_ms(field, rays);
        if rays <= 0.0 || wall_ms <= 0.0 {
            return;
        }
        let ray_ms = &mut self.reduced_ray_ms[field as usize];
        let (start, drawn) = (self.reduced_start_ms, rays * *ray_ms);
        let off =
            (wall_ms - thought).clamp(-MOST_FALL * thought, MOST_LONGER * thought) * RAY_TRUST;
        let a_share = off / (start * start + drawn * drawn);
        self.reduced_start_ms += start * start * a_share;
        *ray_ms += *ray_ms * drawn * a_share;
    }

    /// Limits the price of the field that was not drawn by that of the one that was `drawn`, and so measured.
    pub fn hold_fields_together(&mut self, drawn: SlabField) {
        let [own, preview] = &mut self.reduced_ray_ms;
        match drawn {
            SlabField::Own => *preview = preview.clamp(*own / MOST_OWN_OVER_PREVIEW, *own),
            SlabField::Preview => *own = own.clamp(*preview, MOST_OWN_OVER_PREVIEW * *preview),
        }
    }

    /// Takes in how long the lists of vectors of a smaller picture were made.
    pub fn learn_lists(&mut self, wall_ms: f64) {
        self.lists_ms += (wall_ms - self.lists_ms) * RAY_TRUST;
    }

    /// Takes in a smaller picture of so many rays of a field, 0 for vectors alone, and of so many visits, without its
    /// lists. What rays cost is learnt from pictures without vectors.
    pub fn learn_visits(&mut self, field: SlabField, rays: f64, visits: f64, wall_ms: f64) {
        if visits <= 0.0 || wall_ms <= 0.0 {
            return;
        }
        let thought = visits * self.visit_ms;
        let others = self.reduced_ms(field, rays);
        // Never for nothing; and what took far longer than thought is not believed at once.
        let found = (wall_ms - others).clamp((1.0 - MOST_FALL) * thought, MOST_RISE * thought);
        self.visit_ms *= 1.0 + (found / thought - 1.0) * RAY_TRUST;
    }

    /// What a smaller picture with so many visits is thought to take.
    pub fn among_vectors_ms(&self, field: SlabField, rays: f64, visits: f64) -> f64 {
        self.lists_ms + self.reduced_ms(field, rays) + visits * self.visit_ms
    }

    /// What a smaller picture in slabs is thought to take.
    pub fn reduced_ms(&self, field: SlabField, rays: f64) -> f64 {
        self.reduced_start_ms + rays * self.reduced_ray_ms[field as usize]
    }

    /// Rays that a budget affords in a smaller picture in slabs, 1 at least. Where beginning the picture
    /// takes the budget up, as beside other programs, fewer rays would hardly be quicker.
    pub fn reduced_rays_within(&self, field: SlabField, budget_ms: f64) -> f64 {
        let left_ms = (budget_ms - self.reduced_start_ms).max(budget_ms * LEAST_RAY_SHARE);
        (left_ms / self.reduced_ray_ms[field as usize]).max(1.0)
    }

    /// Takes in a coarse picture's measurement: both prices move by the same ratio.
    pub fn learn(&mut self, splats: u64, fragments: f64, wall_ms: f64) {
        let thought = splats as f64 * self.splat_ms + fragments * self.fragment_ms;
        if thought <= 0.0 || wall_ms <= 0.0 {
            return;
        }
        let correction = (wall_ms / thought).clamp(0.2, 5.0).powf(TRUST);
        self.splat_ms *= correction;
        self.fragment_ms *= correction;
    }

    /// Takes in a piece of the grid.
    pub fn learn_grid(&mut self, kernels: u64, rows: u64, wall_ms: f64) {
        let thought = self.grid_ms(kernels, rows);
        if thought <= 0.0 || wall_ms <= 0.0 {
            return;
        }
        let correction = (wall_ms / thought).clamp(0.2, 5.0).powf(TRUST);
        // What dominates the piece learns; the other price stays.
        if kernels as f64 * self.voxel_ms > rows as f64 * self.row_ms {
            self.voxel_ms *= correction;
        } else {
            self.row_ms *= correction;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_has_a_price_of_its_own() {
        let mut costs = Costs::default();
        let before = costs.reduced_ray_ms;
        for _ in 0..20 {
            costs.learn_reduced(SlabField::Preview, 1000.0, 4.0);
        }
        assert_eq!(costs.reduced_ray_ms[0], before[0]);
        assert!((costs.reduced_ms(SlabField::Preview, 1000.0) - 4.0).abs() < 0.01, "{costs:?}");
        // Full's rays, at 0.1 µs: both fields' are tried again.
        costs.learn_rays(1e6, 100.0);
        for _ in 0..20 {
            costs.learn_rays(1e6, 100.0);
        }
        assert!(costs.reduced_ray_ms.iter().all(|&ms| ms < 0.5e-3), "{costs:?}");
    }

    #[test]
    fn the_first_smaller_picture_is_as_dear_as_the_finished_one_was() {
        let mut costs = Costs { reduced_ray_ms: [1e-5, 1e-5], ..Costs::native() };
        for _ in 0..20 {
            costs.learn_rays(1e6, 500.0);
        }
        let [own, tents] = costs.reduced_ray_ms;
        assert!(
            (own / 5e-4 - 1.0).abs() < 1e-6 && (tents / 1.5e-4 - 1.0).abs() < 1e-6,
            "{costs:?}"
        );
    }

    #[test]
    fn a_price_that_nobody_measures_is_held_to_that_of_the_field_that_was_drawn() {
        let held = |prices: [f64; 2], drawn| {
            let mut costs = Costs { reduced_ray_ms: prices, ..Costs::native() };
            costs.hold_fields_together(drawn);
            costs.reduced_ray_ms
        };
        assert_eq!(held([16.0, 1.0], SlabField::Own), [16.0, 2.0], "what was measured stays");
        assert_eq!(held([16.0, 1.0], SlabField::Preview), [8.0, 1.0]);
        assert_eq!(held([1.5, 4.0], SlabField::Own), [1.5, 1.5]);
        assert_eq!(held([1.5, 4.0], SlabField::Preview), [4.0, 4.0]);
        for drawn in [SlabField::Own, SlabField::Preview] {
            assert_eq!(held([1.5, 1.0], drawn), [1.5, 1.0], "what is likely stays");
        }
    }

    #[test]
    fn prices_move_towards_what_was_measured_and_come_to_it() {
        let start = Costs::default();
        for factor in [0.1, 8.0] {
            let wall_ms = factor * (1000.0 * start.splat_ms + 1e5 * start.fragment_ms);
            let mut costs = start;
            costs.learn(1000, 1e5, wall_ms);
            let moved = costs.splat_ms / start.splat_ms;
            assert!(moved > factor.min(1.0) && moved < factor.max(1.0), "{moved} of {factor}");
            for _ in 0..40 {
                costs.learn(1000, 1e5, wall_ms);
            }
            assert!((costs.splat_ms / start.splat_ms / factor - 1.0).abs() < 0.01, "{costs:?}");
            assert!((costs.fragment_ms / start.fragment_ms / factor - 1.0).abs() < 0.01);
            assert_eq!((costs.voxel_ms, costs.row_ms), (start.voxel_ms, start.row_ms));
        }
    }

    #[test]
    fn pictures_of_two_sizes_tell_what_a_picture_costs_from_what_its_rays_do() {
        let mut costs = Costs::default();
        let (start_ms, ray_ms) = (6.0, 1.5e-3);
        for _ in 0..100 {
            for rays in [2e3, 4e4] {
                costs.learn_reduced(SlabField::Preview, rays, start_ms + rays * ray_ms);
            }
        }
        assert!((costs.reduced_start_ms / start_ms - 1.0).abs() < 0.01, "{costs:?}");
        assert!((costs.reduced_ray_ms[1] / ray_ms - 1.0).abs() < 0.01, "{costs:?}");
        let rays = costs.reduced_rays_within(SlabField::Preview, 20.0);
        assert!((rays * ray_ms - 14.0).abs() < 0.2, "{rays}");
        // What no budget can pay is not saved by drawing next to nothing.
        let rays = costs.reduced_rays_within(SlabField::Preview, 5.0);
        assert!((rays * ray_ms - 2.0).abs() < 0.02, "{rays}");
    }

    #[test]
    fn visits_cost_what_rays_and_lists_do_not() {
        let mut costs = Costs::default();
        let own = SlabField::Own;
        let before = costs;
        let wall_ms = costs.reduced_ms(own, 1000.0) + 1e6 * 3e-5;
        costs.learn_visits(own, 1000.0, 1e6, wall_ms);
        assert!(costs.visit_ms > before.visit_ms && costs.visit_ms < 3e-5, "{costs:?}");
        for _ in 0..20 {
            costs.learn_visits(own, 1000.0, 1e6, wall_ms);
        }
        assert!((costs.visit_ms / 3e-5 - 1.0).abs() < 1e-3, "{costs:?}");
        assert_eq!(costs.reduced_ray_ms, before.reduced_ray_ms);
        costs.learn_lists(5.0);
        costs.learn_lists(5.0);
        let thought = costs.among_vectors_ms(own, 1000.0, 2e6);
        assert!((thought - (wall_ms + 30.0 + 0.91 * 5.0)).abs() < 0.01, "{thought}");
        // Quicker than its rays were thought to be: cheap, but never for nothing.
        for _ in 0..100 {
            costs.learn_visits(own, 1000.0, 1e6, 0.1);
        }
        assert!(costs.visit_ms > 0.0 && costs.visit_ms < 1e-9, "{costs:?}");
    }

    #[test]
    fn rays_too_dear_to_be_drawn_are_tried_again() {
        let mut costs = Costs::default();
        let own = SlabField::Own;
        let before = costs.reduced_ray_ms;
        costs.learn_reduced(own, 1000.0, 1e6);
        assert!(costs.reduced_ray_ms[0] < 4.0 * before[0], "a pipeline was compiled: {costs:?}");
        for _ in 0..20 {
            costs.learn_reduced(own, 1000.0, 1.0);
        }
        assert!((costs.reduced_ms(own, 1000.0) - 1.0).abs() < 0.01, "{costs:?}");
        costs.learn_reduced(own, 1.0, 1e9);
        costs.learn_rays(1000.0, 1.0);
        costs.learn_rays(1000.0, 1.0);
        costs.learn_rays(1000.0, 1.0);
        costs.learn_rays(1000.0, 1.0);
        assert!(
            costs.reduced_rays_within(own, 50.0) > 12_000.0,
            "full says how dear at most: {costs:?}"
        );
    }

    #[test]
    fn what_dominates_a_piece_of_the_grid_is_what_learns() {
        let start = Costs::default();
        let mut costs = start;
        costs.learn_grid(10_000, 10, 2.0 * start.grid_ms(10_000, 10));
        assert!(costs.voxel_ms > start.voxel_ms && costs.row_ms == start.row_ms, "{costs:?}");
        let mut costs = start;
        costs.learn_grid(10, 10_000, 0.5 * start.grid_ms(10, 10_000));
        assert!(costs.voxel_ms == start.voxel_ms && costs.row_ms < start.row_ms, "{costs:?}");
    }

    #[test]
    fn a_budget_is_shared_between_splats_and_their_pixels() {
        let costs = Costs::default();
        let splats = costs.splats_within(20.0);
        let fragments = costs.fragments_within(20.0, splats);
        let spent = splats as f64 * costs.splat_ms + fragments * costs.fragment_ms;
        assert!((spent - 20.0).abs() < 0.01, "{spent}");
        assert!((splats as f64 * costs.splat_ms - 12.0).abs() < 0.01, "60 % for splats: {splats}");
        // Splats that eat the budget up leave a fifth of it, or nothing would be drawn.
        let least = costs.fragments_within(20.0, 1_000_000) * costs.fragment_ms;
        assert!((least - 4.0).abs() < 0.01, "{least}");
    }
}
