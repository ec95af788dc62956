//! What effects cost in the window: finished pictures with and without them, drawn while nothing else is
//! asked for.

use std::collections::VecDeque;
use std::sync::Arc;

use eframe::egui::Context;

use super::drawer::Drawer;
use super::panels::SHADING;
use super::panels::shading::ShadingEditor;
use super::window::Window;
use crate::scene::{Effect, Scene, Shading};
use crate::task::effect_costs::{AddedTime, ROUNDS};
use crate::task::engine::{Picture, SecondPicture, SecondRequest};

/// Finished pictures that are remembered, and changes.
const MOST_REMEMBERED: usize = 24;
/// A picture that a shader was made for is drawn once more, and then taken as it is.
const MOST_TRIES: u32 = 2;

/// The panel, and what finished pictures of one volume took.
#[derive(Debug, Default)]
pub struct Effects {
    /// Whether the panel is shown.
    pub open: bool,
    finished: VecDeque<Finished>,
    left_out: VecDeque<LeftOut>,
    asked: Option<Asked>,
}

/// What the `full` picture of a scene took.
#[derive(Debug)]
struct Finished {
    scene: Scene,
    size: [u32; 2],
    /// Of one picture each, the newest last; at most [`ROUNDS`].
    ms: Vec<f64>,
    /// On the device, where that is known.
    bytes: Option<u64>,
}

/// How far a scene's picture is from that of the scene without an effect.
#[derive(Debug)]
struct LeftOut {
    scene: Scene,
    other: Scene,
    size: [u32; 2],
    rmse: Option<f64>,
}

/// A picture that is drawn to be measured.
#[derive(Debug)]
struct Asked {
    scene: Scene,
    /// What is drawn: it without an effect, or as it is.
    other: Scene,
    first: Arc<Picture>,
    tries: u32,
}

impl Effects {
    /// Takes in what a `full` picture of a scene took, in milliseconds and in bytes on the device.
    pub fn note(&mut self, scene: &Scene, size: [u32; 2], took_ms: f64, bytes: Option<u64>) {
        self.finished.retain(|one| one.scene.has_same_volume(scene));
        let is_same = |one: &Finished| one.size == size && one.scene.makes_same_picture(scene);
        let known = self.finished.iter().position(is_same);
        let known = known.and_then(|index| self.finished.remove(index)).map(|one| one.ms);
        let mut ms = known.unwrap_or_default();
        ms.push(took_ms);
        ms.drain(..ms.len().saturating_sub(ROUNDS));
        self.finished.push_front(Finished { scene: scene.clone(), size, ms, bytes });
        self.finished.truncate(MOST_REMEMBERED);
    }

    fn finished(&self, scene: &Scene, size: [u32; 2]) -> Option<&Finished> {
        self.finished.iter().find(|one| one.size == size && one.scene.makes_same_picture(scene))
    }

    /// What the scene's picture took, and what it took without a part of what it asks for.
    fn both(&self, scene: &Scene, size: [u32; 2], effect: Effect) -> Option<[&Finished; 2]> {
        let other = effect.left_out_of(scene)?;
        Some([self.finished(scene, size)?, self.finished(&other, size)?])
    }

    /// How much longer the scene's picture takes than without a part of what it asks for.
    pub fn added(&self, scene: &Scene, size: [u32; 2], effect: Effect) -> Option<AddedTime> {
        let [with, without] = self.both(scene, size, effect)?;
        AddedTime::of(&with.ms, &without.ms)
    }

    /// How many more bytes the device holds with it than without.
    pub fn bytes(&self, scene: &Scene, size: [u32; 2], effect: Effect) -> Option<i64> {
        let [with, without] = self.both(scene, size, effect)?;
        Some(with.bytes? as i64 - without.bytes? as i64)
    }

    /// What was found of a scene and another without something of it.
    fn left_out(&self, scene: &Scene, other: &Scene, size: [u32; 2]) -> Option<&LeftOut> {
        self.left_out.iter().find(|one| {
            one.size == size
                && one.other.makes_same_picture(other)
                && one.scene.makes_same_picture(scene)
        })
    }

    /// How far the picture without an effect is from the scene's, where that was measured.
    pub(super) fn change(
        &self,
        scene: &Scene,
        size: [u32; 2],
        effect: Effect,
    ) -> Option<Option<f64>> {
        let other = effect.left_out_of(scene)?;
        self.left_out(scene, &other, size).map(|one| one.rmse)
    }

    /// Whether a picture that came was asked for by this, and what it says.
    pub(super) fn accept(&mut self, drawer: &dyn Drawer, drawn: &SecondPicture) -> bool {
        let is_it = |asked: &mut Asked| Arc::ptr_eq(&asked.first, &drawn.first);
        let Some(asked) = self.asked.take_if(is_it) else { return false };
        if drawn.picture.report.made_pipelines && asked.tries < MOST_TRIES {
            self.ask(drawer, Asked { tries: asked.tries + 1, ..asked });
            return true;
        }
        let Asked { scene, other, first, .. } = asked;
        let size = first.requested_size;
        let report = &drawn.picture.report;
        self.note(&other, size, report.frame_ms, report.held.map(|held| held.all));
        if !other.makes_same_picture(&scene) && self.left_out(&scene, &other, size).is_none() {
            self.left_out.push_front(LeftOut { scene, other, size, rmse: drawn.rmse });
            self.left_out.truncate(MOST_REMEMBERED);
        }
        true
    }

    /// Has one picture after the other drawn without an effect that runs, while the panel is open and
    /// `first` stands finished; `None` while there is none such, or it is compared with another mode.
    pub(super) fn pace(
        &mut self,
        drawer: &dyn Drawer,
        scene: &Scene,
        first: Option<&Arc<Picture>>,
    ) {
        let Some(first) = first.filter(|_| self.open) else {
            if self.asked.take().is_some() {
                drawer.request_second(None);
            }
            return;
        };
        if self.asked.as_ref().is_some_and(|asked| Arc::ptr_eq(&asked.first, first)) {
            return;
        }
        if let Some(other) = self.next(scene, first) {
            let (scene, first) = (scene.clone(), Arc::clone(first));
            self.ask(drawer, Asked { scene, other, first, tries: 1 });
        }
    }

    fn ask(&mut self, drawer: &dyn Drawer, asked: Asked) {
        drawer.request_second(Some(SecondRequest {
            scene: asked.other.clone(),
            size: asked.first.requested_size,
            first: Arc::clone(&asked.first),
        }));
        self.asked = Some(asked);
    }

    /// Whether a picture is drawn to be measured.
    pub(super) fn is_measuring(&self) -> bool {
        self.asked.is_some()
    }

    /// How many of the pictures that are drawn to measure a scene's effects are there, and how many there are to be, while
    /// one of them is drawn.
    pub(super) fn progress(&self, scene: &Scene, first: &Picture) -> Option<[usize; 2]> {
        if !self.is_measuring() {
            return None;
        }
        let counted = self.counted(scene, first);
        let drawn = counted.iter().map(|(count, _)| *count).sum();
        Some([drawn, counted.len() * ROUNDS])
    }

    /// What is to be drawn next: the scene or it without an effect, whichever was drawn least often.
    fn next(&self, scene: &Scene, first: &Picture) -> Option<Scene> {
        let counted = self.counted(scene, first);
        let (count, next) = counted.into_iter().min_by_key(|(count, _)| *count)?;
        (count < ROUNDS).then_some(next)
    }

    /// A scene and it without each effect that is shown, and how often each was drawn; none without an effect.
    fn counted(&self, scene: &Scene, first: &Picture) -> Vec<(usize, Scene)> {
        let size = first.requested_size;
        let is_shown = |effect: &Effect| match effect {
            Effect::Shading => !scene.shading.is_plain() && !first.report.effects.is_empty(),
            effect => first.report.effects.contains(effect),
        };
        let shown = Effect::ALL.iter().filter(|effect| is_shown(effect));
        let others: Vec<Scene> = shown.filter_map(|effect| effect.left_out_of(scene)).collect();
        if others.is_empty() {
            return Vec::new();
        }
        let all = std::iter::once(scene.clone()).chain(others);
        let count = |one: &Scene| self.finished(one, size).map_or(0, |f| f.ms.len());
        all.map(|one| (count(&one), one)).collect()
    }
}

impl Window {
    /// Takes in a picture that has come, as the scene stands before this pass changes it.
    pub(super) fn note_effects(&mut self, picture: &Picture) {
        let Some(scene) = &self.scene else { return };
        let shows_all = picture.report.effects == scene.effects();
        // Shaders that were made meanwhile are no cost of the effect's.
        let is_full = picture.report.level.is_full()
            && !picture.report.made_pipelines
            && !self.pacing.is_moving();
        if shows_all && is_full && picture.requested_size == self.viewport_size {
            let report = &picture.report;
            let bytes = report.held.map(|held| held.all);
            self.effects.note(scene, self.viewport_size, report.frame_ms, bytes);
        }
    }

    /// Switches the lights on or off, and says so where that cannot be seen.
    pub(super) fn toggle_lights(&mut self) {
        self.change_lights(ShadingEditor::toggle_lights);
    }

    /// Adds a light, which is in sight in the side panel then.
    pub(super) fn add_light(&mut self, ctx: &Context) {
        self.change_lights(ShadingEditor::add_light);
        self.show_section(ctx, SHADING);
    }

    fn change_lights(&mut self, change: fn(&mut ShadingEditor, &mut Shading)) {
        let Some(scene) = &mut self.scene else { return };
        change(&mut self.shading, &mut scene.shading);
        if scene.shading.lighting.is_some() && !Shading::is_shown_by(&scene.splat) {
            self.notices.hint(
                "This mode draws splats as triangles, which cannot be lit: choose the exact mode under Splats",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Amounts, Index, Lighting};
    use crate::volume::{Lattice, Samples, ScalarVolume};

    #[test]
    fn a_cost_is_of_two_pictures_that_differ_in_one_effect_alone() {
        let samples = Samples::UInt8((0..8).collect());
        let volume = ScalarVolume::from_samples("ramp", Lattice::unit([2; 3]), samples).unwrap();
        let plain = crate::scene::opening(Default::default(), Arc::new(volume), None);
        let table = || Some(Amounts { index: Index::Value, points: vec![(0.0, 0.5)] });
        let both = Scene {
            shading: Shading {
                lighting: Some(Lighting::default()),
                modulation: table(),
                ..Shading::default()
            },
            ..plain.clone()
        };
        let lit = Scene {
            shading: Shading { modulation: None, ..both.shading.clone() },
            ..plain.clone()
        };
        let size = [10, 10];
        let mut effects = Effects::default();
        effects.note(&plain, size, 10.0, Some(900));
        effects.note(&both, size, 40.0, Some(1000));
        let without_table = Effect::ModulationTable;
        assert_eq!(effects.added(&both, size, without_table), None, "nobody drew that");
        let whole = effects.added(&both, size, Effect::Shading);
        assert_eq!(whole, AddedTime::of(&[40.0], &[10.0]));
        assert_eq!(effects.bytes(&both, size, Effect::Shading), Some(100));
        effects.note(&lit, size, 25.0, None);
        let table = effects.added(&both, size, without_table);
        assert_eq!(table, AddedTime::of(&[40.0], &[25.0]));
        assert_eq!(effects.bytes(&both, size, without_table), None, "of one it is not known");
        assert_eq!(effects.added(&both, [10, 11], without_table), None, "of another size");
        let turned = Scene { camera: both.camera.orbited(0.1, 0.0), ..both.clone() };
        assert_eq!(effects.added(&turned, size, without_table), None, "of another view");
        assert_eq!(effects.added(&lit, size, without_table), None, "it is not there");
        for ms in [44.0, 48.0, 52.0] {
            effects.note(&both, size, ms, None);
        }
        let newest = AddedTime::of(&[44.0, 48.0, 52.0], &[25.0]);
        assert_eq!(effects.added(&both, size, without_table), newest);
    }
}
