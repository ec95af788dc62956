//! Two settings side by side: which, how they are shown, and when the second picture is asked for.

use std::sync::Arc;

use super::drawer::Drawer;
use super::modes;
use crate::scene::{Classify, Inside, Scene, SplatSettings};
use crate::task::engine::{Picture, SecondPicture, SecondRequest};

/// The amplifications of a difference on offer are 1, 2, 4 … 2 to this power.
pub const MOST_DOUBLINGS: u32 = 6;

/// How two pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Display {
    /// The first left of a divider, the second right of it.
    Split,
    /// How far they are apart, amplified.
    Difference,
}

/// The comparison: a second mode beside the scene's own.
#[derive(Debug)]
pub struct Compare {
    /// Whether it is shown.
    pub on: bool,
    /// The second mode; its unit distance is the scene's.
    pub second: SplatSettings,
    /// How both are shown.
    pub display: Display,
    /// Whether the greatest difference is shown as bright as can be.
    pub fits: bool,
    /// Else the difference is shown 2 to this power times as large, at most [`MOST_DOUBLINGS`].
    pub doublings: u32,
    /// Where the divider is: 0 at the left edge, 1 at the right.
    pub divider: f32,
    /// Whether the controls of modes change the second one.
    pub edits_second: bool,
    asked: Option<Asked>,
    drawn: Option<Arc<SecondPicture>>,
}

/// What was asked for last.
#[derive(Debug)]
struct Asked {
    mode: SplatSettings,
    first: Arc<Picture>,
}

impl Default for Compare {
    fn default() -> Self {
        Self {
            on: false,
            second: SplatSettings::SHADE_FIRST,
            display: Display::Split,
            fits: true,
            doublings: 4,
            divider: 0.5,
            edits_second: false,
            asked: None,
            drawn: None,
        }
    }
}

impl Compare {
    /// Shows or hides the comparison. A second mode that is the first one says nothing: it becomes
    /// another preset. One that cannot show what lies `inside` is replaced, too, unless somebody chose it.
    pub fn toggle(&mut self, first: &SplatSettings, inside: &Inside) {
        self.on = !self.on;
        self.edits_second = false;
        let exact = SplatSettings::EXACT;
        if self.on && modes::same_mode(&self.second, first) {
            let is_exact = modes::same_mode(first, &exact);
            self.second = if is_exact { SplatSettings::SHADE_FIRST } else { exact };
        }
        // Two modes of which only one shows what is cut or laid into the volume show two scenes.
        let is_untouched = modes::same_mode(&self.second, &SplatSettings::SHADE_FIRST);
        if self.on && is_untouched && !inside.is_plain() && Inside::is_shown_by(first) {
            self.second = SplatSettings { classify: Classify::After, ..exact };
        }
    }

    /// Shows `mode` as the second.
    pub fn with(&mut self, mode: SplatSettings) {
        (self.on, self.second) = (true, mode);
    }

    /// How much larger a difference is shown.
    #[expect(clippy::cast_possible_truncation, reason = "1 to 64")]
    pub fn gain(&self) -> f32 {
        let of_doublings = |doublings: u32| 2.0_f32.powi(doublings.cast_signed());
        let most = of_doublings(MOST_DOUBLINGS);
        match self.drawn.as_ref().and_then(|drawn| drawn.greatest).filter(|_| self.fits) {
            Some(greatest) => (1.0 / greatest as f32).clamp(1.0, most),
            None => of_doublings(self.doublings.min(MOST_DOUBLINGS)),
        }
    }

    /// Posts what is missing: the second picture, once `first` is finished and at rest. `first` is
    /// `None` while there is none such.
    pub fn pace(&mut self, drawer: &dyn Drawer, scene: &Scene, first: Option<&Arc<Picture>>) {
        if !self.on {
            if self.asked.take().is_some() {
                drawer.request_second(None);
            }
            self.drawn = None;
            return;
        }
        let Some(first) = first else { return };
        let mode = modes::with_unit_distance_of(self.second, &scene.splat);
        let is_asked = |asked: &Asked| asked.mode == mode && Arc::ptr_eq(&asked.first, first);
        if self.asked.as_ref().is_some_and(is_asked) {
            return;
        }
        let request = SecondRequest {
            scene: Scene { splat: mode, ..scene.clone() },
            size: first.requested_size,
            first: Arc::clone(first),
        };
        drawer.request_second(Some(request));
        self.asked = Some(Asked { mode, first: Arc::clone(first) });
    }

    /// Takes a second picture that was drawn.
    pub fn accept(&mut self, drawn: Arc<SecondPicture>) {
        self.drawn = self.on.then_some(drawn);
    }

    /// The second picture, if it belongs to the one on screen.
    pub fn beside(&self, first: &Arc<Picture>) -> Option<&Arc<SecondPicture>> {
        self.drawn.as_ref().filter(|drawn| self.on && Arc::ptr_eq(&drawn.first, first))
    }

    /// Whether the second picture on screen, or to come, is not the one that is chosen.
    pub fn is_waiting(&self, first: Option<&Arc<Picture>>) -> bool {
        self.on && first.is_none_or(|first| self.beside(first).is_none())
    }

    /// Changes places.
    pub fn swap(&mut self, first: &mut SplatSettings) {
        let second = modes::with_unit_distance_of(self.second, first);
        (self.second, *first) = (*first, second);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comparison_never_begins_with_a_mode_beside_itself() {
        for first in [SplatSettings::EXACT, SplatSettings::SHADE_FIRST] {
            let mut compare = Compare { second: first, ..Compare::default() };
            compare.toggle(&first, &Inside::default());
            assert!(compare.on && !modes::same_mode(&compare.second, &first));
            compare.toggle(&first, &Inside::default());
            assert!(!compare.on);
        }
    }

    #[test]
    fn what_is_cut_is_cut_in_both_modes_unless_another_was_chosen() {
        let mut cut = Inside::default();
        cut.clip.bounds = Some(crate::scene::ClipBox { low: [0.5; 3], high: [1.0; 3] });
        let toggled = |second: SplatSettings| {
            let mut compare = Compare { second, ..Compare::default() };
            compare.toggle(&SplatSettings::EXACT, &cut);
            compare.second
        };
        assert!(Inside::is_shown_by(&toggled(SplatSettings::SHADE_FIRST)));
        assert!(!Inside::is_shown_by(&SplatSettings::SHADE_FIRST), "which shows nothing of it");
        let chosen = SplatSettings { slabs_per_voxel: 4.0, ..SplatSettings::EXACT };
        assert_eq!(toggled(chosen), chosen);
    }

    #[test]
    fn swapping_keeps_the_unit_distance_with_the_scene() {
        let mut first = SplatSettings { opacity_unit_distance: Some(2.0), ..SplatSettings::EXACT };
        let mut compare = Compare::default();
        compare.swap(&mut first);
        let unit = first.opacity_unit_distance;
        assert!(modes::same_mode(&first, &SplatSettings::SHADE_FIRST) && unit == Some(2.0));
        compare.swap(&mut first);
        assert!(modes::same_mode(&first, &SplatSettings::EXACT));
    }

    #[test]
    fn differences_are_amplified_up_to_64_times() {
        let mut compare = Compare { fits: false, doublings: 0, ..Compare::default() };
        assert_eq!(compare.gain(), 1.0);
        compare.doublings = 60;
        assert_eq!(compare.gain(), 64.0);
    }
}
