//! What the window remembers between runs: habits, never data.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::camera_control::Turning;
use super::panels::Sections;
use super::vectors::MOST_FPS;
use crate::core::Srgb8;
use crate::scene;
use crate::scene::{Annotations, Background};
use crate::task::engine::{Effort, Ladder};

/// How many recent files are kept.
pub const RECENT_LIMIT: usize = 10;
/// The frame budgets on offer, milliseconds.
pub const BUDGET_MS: std::ops::RangeInclusive<f64> = 1.0..=10_000.0;
/// Milliseconds of drawing that doubling the slabs may add each time that the view comes to rest,
/// unless it is asked for: a laptop is not kept busy by a picture that nobody waits for.
pub const CONVERGE_WITHIN_MS: f64 = 3000.0;
/// The full vertical angles of view on offer in perspective, degrees.
pub const VIEW_ANGLE_DEG: std::ops::RangeInclusive<f64> = 5.0..=120.0;

/// What a picture may cost while the view moves, as a choice of few: Laur–Hanrahan's three pictures
/// (figure 6), and what follows the hand closely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BudgetPreset {
    /// Thirty pictures a second and more, with what the window itself takes.
    Interactive,
    /// Five pictures a second.
    FifthOfASecond,
    /// What a pause of the hand allows.
    FiveSeconds,
    /// Every voxel, however long that takes.
    Full,
}

impl BudgetPreset {
    /// All of them, the quickest first.
    pub const ALL: [Self; 4] =
        [Self::Interactive, Self::FifthOfASecond, Self::FiveSeconds, Self::Full];

    /// Milliseconds; `None` where there is no limit.
    pub fn budget_ms(self) -> Option<f64> {
        match self {
            Self::Interactive => Some(25.0),
            Self::FifthOfASecond => Some(200.0),
            Self::FiveSeconds => Some(5000.0),
            Self::Full => None,
        }
    }
}

/// Persisted choices. Unknown entries of an older or newer file are passed over, missing ones take
/// their default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Files opened before, newest first, each once.
    pub recent: Vec<PathBuf>,
    /// Milliseconds that a picture may take while the view moves.
    pub budget_ms: f64,
    /// The colour behind the volume.
    pub background: Srgb8,
    /// Nothing behind the volume: the viewport shows a checkerboard instead.
    pub transparent_background: bool,
    /// Ask for `full` even while the view moves.
    pub full_quality_while_moving: bool,
    /// Show pictures whose last rung is still being drawn.
    pub show_partial: bool,
    /// The way from coarse to `full`.
    #[serde(with = "ladder_name")]
    pub ladder: Ladder,
    /// Double the slabs after `full` where that takes no more than [`CONVERGE_WITHIN_MS`].
    pub converge: bool,
    /// Smooth what ends within a pixel once a view rests, and in saved pictures.
    pub smooth_edges: bool,
    /// Let each picture of a resting view give way to the next little by little.
    pub fade: bool,
    /// How a drag turns the view.
    pub turning: Turning,
    /// Full vertical angle of view that the perspective camera takes, degrees.
    pub view_angle_deg: f64,
    /// Animated pictures a second, at most.
    pub animation_fps: u32,
    /// Whether the side panel is open.
    pub side_panel: bool,
    /// Which of its sections were opened or closed.
    pub sections: Sections,
    /// What is written over the picture.
    pub annotations: Annotations,
    /// Somebody has dragged the view: nobody needs to be told that this turns it.
    pub knows_drag: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            recent: Vec::new(),
            budget_ms: 25.0,
            background: scene::BACKGROUND,
            transparent_background: false,
            full_quality_while_moving: false,
            show_partial: false,
            ladder: Ladder::default(),
            converge: true,
            smooth_edges: true,
            fade: false,
            turning: Turning::default(),
            view_angle_deg: 30.0,
            animation_fps: MOST_FPS,
            side_panel: true,
            sections: Sections::new(),
            annotations: Annotations { trihedron: true, ..Annotations::NONE },
            knows_drag: false,
        }
    }
}

impl Settings {
    /// Puts `path` first among the recent files.
    pub fn remember(&mut self, path: PathBuf) {
        self.recent.retain(|known| *known != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT_LIMIT);
    }

    /// Brings values that a hand-edited file may hold back into their ranges.
    pub fn sanitised(mut self) -> Self {
        let default = Self::default();
        let inside = |value: f64, range: &std::ops::RangeInclusive<f64>, fallback: f64| {
            if value.is_nan() { fallback } else { value.clamp(*range.start(), *range.end()) }
        };
        self.budget_ms = inside(self.budget_ms, &BUDGET_MS, default.budget_ms);
        self.view_angle_deg = inside(self.view_angle_deg, &VIEW_ANGLE_DEG, default.view_angle_deg);
        self.animation_fps = self.animation_fps.clamp(1, 60);
        self.recent.truncate(RECENT_LIMIT);
        self
    }

    /// The preset that the budget is, if it is one.
    pub fn preset(&self) -> Option<BudgetPreset> {
        let budget_ms = (!self.full_quality_while_moving).then_some(self.budget_ms);
        BudgetPreset::ALL.into_iter().find(|preset| preset.budget_ms() == budget_ms)
    }

    /// Takes a preset's budget.
    pub fn set_preset(&mut self, preset: BudgetPreset) {
        self.full_quality_while_moving = preset == BudgetPreset::Full;
        if let Some(budget_ms) = preset.budget_ms() {
            self.budget_ms = budget_ms;
        }
    }

    /// What the scene has behind it.
    pub fn scene_background(&self) -> Background {
        if self.transparent_background {
            Background::Transparent
        } else {
            Background::Colour(self.background)
        }
    }

    /// The effort of a view at rest.
    pub fn effort_at_rest(&self) -> Effort {
        Effort::Rest {
            budget_ms: self.budget_ms,
            ladder: self.ladder,
            show_partial: self.show_partial,
            converge_ms: if self.converge { CONVERGE_WITHIN_MS } else { 0.0 },
            smooth_edges: self.smooth_edges,
        }
    }

    /// The effort of a moving view.
    pub fn effort_while_moving(&self) -> Effort {
        if self.full_quality_while_moving {
            self.effort_at_rest()
        } else {
            Effort::Moving { budget_ms: self.budget_ms }
        }
    }
}

/// The ladders with their names in the interface and in the settings file.
pub const LADDERS: [(Ladder, &str, &str); 4] = [
    (
        Ladder::Octree,
        "Larger splats",
        "Fewer, larger splats (octree cuts), whose error falls step by step",
    ),
    (
        Ladder::Subsampling,
        "Every fourth voxel",
        "Every fourth voxel, then every second, then every one",
    ),
    (Ladder::CheaperKernels, "Simpler splats", "Points, then boxes, then the chosen kernel"),
    (Ladder::AtOnce, "Nothing", "No coarser picture before the full one"),
];

/// A ladder as its name, so that the file stays readable.
mod ladder_name {
    use serde::{Deserialize, Deserializer, Serializer};

    use super::{LADDERS, Ladder};

    pub(super) fn serialize<S: Serializer>(ladder: &Ladder, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str(super::ladder_label(*ladder))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Ladder, D::Error> {
        let name = String::deserialize(d)?;
        let known = LADDERS.iter().find(|(_, label, _)| *label == name);
        Ok(known.map_or_else(Ladder::default, |(ladder, _, _)| *ladder))
    }
}

/// The name of a ladder in the interface.
pub fn ladder_label(ladder: Ladder) -> &'static str {
    LADDERS.iter().find(|(known, _, _)| *known == ladder).map_or("", |(_, label, _)| label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_opened_again_moves_to_the_front_and_is_listed_once() {
        let mut settings = Settings::default();
        for name in ["a", "b", "c", "a"] {
            settings.remember(name.into());
        }
        assert_eq!(settings.recent, ["a", "c", "b"].map(PathBuf::from));
    }

    #[test]
    fn only_the_newest_files_are_kept() {
        let mut settings = Settings::default();
        for i in 0..RECENT_LIMIT + 5 {
            settings.remember(PathBuf::from(i.to_string()));
        }
        assert_eq!(settings.recent.len(), RECENT_LIMIT);
        assert_eq!(settings.recent[0], PathBuf::from((RECENT_LIMIT + 4).to_string()));
    }

    #[test]
    fn settings_survive_being_written_and_read() {
        let settings = Settings {
            ladder: Ladder::CheaperKernels,
            budget_ms: 50.0,
            show_partial: false,
            ..Settings::default()
        };
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(serde_json::from_str::<Settings>(&text).unwrap(), settings);
    }

    #[test]
    fn a_preset_is_known_again_and_any_other_budget_is_none() {
        let mut settings = Settings::default();
        assert_eq!(settings.preset(), Some(BudgetPreset::Interactive));
        for preset in BudgetPreset::ALL {
            settings.set_preset(preset);
            assert_eq!(settings.preset(), Some(preset));
            assert!(preset.budget_ms().is_none_or(|ms| BUDGET_MS.contains(&ms)));
        }
        // From full back to what it was before: the slider keeps its value.
        assert_eq!(settings.budget_ms, 5000.0);
        settings.full_quality_while_moving = false;
        settings.budget_ms = 33.0;
        assert_eq!(settings.preset(), None);
    }

    #[test]
    fn strange_values_in_the_file_are_brought_back_into_range() {
        let text = r#"{"budget_ms": -3.0, "view_angle_deg": 1e9, "ladder": "none such"}"#;
        let settings = serde_json::from_str::<Settings>(text).unwrap().sanitised();
        assert_eq!(settings.budget_ms, *BUDGET_MS.start());
        assert_eq!(settings.view_angle_deg, *VIEW_ANGLE_DEG.end());
        assert_eq!(settings.ladder, Ladder::default());
    }
}
