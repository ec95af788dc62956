//! Lights, and the tables that opacities and colours are looked up in beside the value.

use std::sync::Arc;

use eframe::egui::{Button, ComboBox, Ui};

use super::inside::note_ui;
use super::light::{self, lighting_ui};
use super::lists::ListUi;
use super::shading_table::{Entry, TableEditor, table_ui};
use super::splat::combo_ui;
use super::{name_ui, row_ui};
use crate::app::actions::{Action, entry_of};
use crate::app::modes;
use crate::core::Srgb8;
use crate::scene::{
    Amounts, Colours, Index, Lighting, Scene, Shading, ShadingPreset, SplatSettings,
    strong_gradient,
};
use crate::volume::ScalarVolume;

/// Times [`strong_gradient`] that a table of gradient strengths goes.
const STRENGTHS: f64 = 2.0;

/// What the section remembers: what was switched off, and what the hand is doing.
#[derive(Debug, Clone, Default)]
pub struct ShadingEditor {
    /// Parts that were switched off, for when they are switched on again.
    kept: Shading,
    /// Opacity, modulation, reflection, emission.
    tables: [TableEditor; 4],
}

impl ShadingEditor {
    /// Forgets what belongs to one volume; lights are a habit.
    pub fn start_over(&mut self) {
        let lighting = self.kept.lighting.take();
        *self = Self { kept: Shading { lighting, ..Shading::default() }, ..Self::default() };
    }

    /// Switches the lights on or off.
    pub fn toggle_lights(&mut self, shading: &mut Shading) {
        let on = shading.lighting.is_none();
        switch(on, &mut shading.lighting, &mut self.kept.lighting, Lighting::default);
    }

    /// One more light beside those there are, which are switched on.
    pub fn add_light(&mut self, shading: &mut Shading) {
        if shading.lighting.is_none() {
            self.toggle_lights(shading);
        }
        shading.lighting.iter_mut().for_each(light::add);
    }
}

/// The section. `second` is the mode that the scene's is compared with.
pub fn shading_ui(
    ui: &mut Ui,
    editor: &mut ShadingEditor,
    scene: &mut Scene,
    second: Option<&SplatSettings>,
) {
    preset_ui(ui, scene);
    mode_ui(ui, scene, second);
    let Some(volume) = scene.volume().map(Arc::clone) else { return };
    let Scene { shading, camera, .. } = scene;
    let kept = &mut editor.kept;
    let key = entry_of(Action::ToggleLights).shortcut;
    let key = key.map_or_else(String::new, |key| ui.ctx().format_shortcut(&key));
    let help = format!(
        "Surfaces brighten towards lights and darken away from them: what makes shape visible (key \
         {key})"
    );
    part_ui(ui, ("Lights", &help), &mut shading.lighting, &mut kept.lighting, Lighting::default);
    if let Some(lighting) = &mut shading.lighting {
        ui.indent("lights", |ui| lighting_ui(ui, lighting, camera));
    }
    let strong = strong_gradient(&volume);
    let by_strength = |points: [(f64, f64); 2]| Amounts {
        index: Index::GradientStrength,
        points: points.map(|(share, amount)| (share * strong, amount)).to_vec(),
    };
    let [opacity, modulation, reflection, emission] = &mut editor.tables;
    ui.add_space(2.0);
    name_ui(ui, "By gradient strength or depth");
    amounts_ui(
        ui,
        (
            "Opacity",
            "Look opacities up by another quantity, such as gradient strength or depth, in place of the \
             transfer function's curve",
        ),
        opacity,
        (&mut shading.opacity, &mut kept.opacity),
        (|| by_strength([(0.25, 0.0), (1.0, 0.8)]), &volume),
    );
    amounts_ui(
        ui,
        (
            "Opacity factor",
            "Modulation: the transfer function's opacity is multiplied by a factor, which depends on another quantity. By \
             gradient strength, soft matter fades and boundaries stay",
        ),
        modulation,
        (&mut shading.modulation, &mut kept.modulation),
        (|| by_strength([(0.0, 0.0), (1.0, 1.0)]), &volume),
    );
    colours_ui(
        ui,
        (
            "Reflection",
            "Look colours up by another quantity, such as depth, in place of the transfer function's",
        ),
        reflection,
        (&mut shading.reflection, &mut kept.reflection),
        (
            || Colours {
                index: Index::ViewDepth,
                stops: vec![(0.25, Srgb8([255, 246, 224])), (0.75, Srgb8([46, 62, 104]))],
            },
            &volume,
        ),
    );
    colours_ui(
        ui,
        (
            "Emission",
            "Let matter glow: light of its own, by another quantity, added to what it reflects",
        ),
        emission,
        (&mut shading.emission, &mut kept.emission),
        (
            || Colours {
                index: Index::GradientStrength,
                stops: vec![(0.0, Srgb8::BLACK), (strong, Srgb8([120, 60, 10]))],
            },
            &volume,
        ),
    );
}

/// What a preset is called, and what it is for, one line.
fn preset_words(preset: Option<ShadingPreset>) -> (&'static str, &'static str) {
    match preset {
        None => ("None", "No lights: the colours are those of the transfer function"),
        Some(ShadingPreset::Lights) => ("Lights", "One light over the shoulder"),
        Some(ShadingPreset::Cloud) => {
            ("Cloud", "No lights; thins out where values change sharply, so that soft matter stays")
        }
        Some(ShadingPreset::Surface) => (
            "Surface",
            "Lights, and opacity only where values change: boundaries without what is between them",
        ),
        Some(ShadingPreset::DepthCue) => {
            ("Depth cue", "Lights, and colours that cool and darken with depth")
        }
        Some(ShadingPreset::GradientColour) => {
            ("Colour by gradient", "Lights, and colours by how sharply values change")
        }
    }
}

fn preset_ui(ui: &mut Ui, scene: &mut Scene) {
    let Some(volume) = scene.volume().map(Arc::clone) else { return };
    let shading = &mut scene.shading;
    let all = || std::iter::once(None).chain(ShadingPreset::ALL.iter().copied().map(Some));
    let made = |preset: Option<ShadingPreset>| {
        preset.map_or_else(Shading::default, |preset| preset.shading(&volume))
    };
    // They are the transfer function's.
    let regions = std::mem::take(&mut shading.regions);
    let now = all().find(|&preset| made(preset) == *shading);
    row_ui(ui, "Preset", |ui| {
        let first_look = Shading { lighting: Some(Lighting::first_look()), ..Shading::default() };
        let (name, help) = match now {
            Some(preset) => preset_words(preset),
            None if *shading == first_look => {
                ("First look", "The light that a volume with faces opens with, and no tables")
            }
            None => ("Custom", "The parts below, chosen one by one"),
        };
        let combo = ComboBox::from_id_salt("shading preset").selected_text(name);
        let mut chosen = None;
        let shown = combo.show_ui(ui, |ui| {
            for preset in all() {
                let (name, help) = preset_words(preset);
                let label = ui.choice(now == Some(preset), name);
                if label.on_hover_text(help).clicked() {
                    chosen = Some(preset);
                }
            }
        });
        shown.response.accessible_name("Shading preset").on_hover_text(help);
        if let Some(preset) = chosen {
            *shading = made(preset);
        }
        let reset = ui.add_enabled(!shading.is_plain(), Button::new("Reset"));
        let reset = reset
            .accessible_name("Reset shading")
            .on_hover_text("Back to the transfer function alone: no lights, and nothing looked up by another quantity")
            .on_disabled_hover_text("The transfer function is alone already");
        if reset.clicked() {
            *shading = Shading::default();
        }
    });
    shading.regions = regions;
}

/// What modes do not show it, and the way out.
fn mode_ui(ui: &mut Ui, scene: &mut Scene, second: Option<&SplatSettings>) {
    if !Shading::is_shown_by(&scene.splat) {
        note_ui(
            ui,
            "This mode draws splats as triangles, which cannot be lit: the picture shows the transfer function alone",
        );
        let button = ui.button("Use the exact mode");
        if button.on_hover_text("Interpolate first, then colour and light the slabs").clicked() {
            scene.splat = modes::with_unit_distance_of(SplatSettings::EXACT, &scene.splat);
        }
    } else if !scene.shading.is_plain() && second.is_some_and(|mode| !Shading::is_shown_by(mode)) {
        note_ui(
            ui,
            "The second mode draws splats as triangles, which cannot be lit: it shows the transfer function alone",
        );
    }
}

/// Puts a part in or takes it out, and remembers it.
fn switch<T>(on: bool, part: &mut Option<T>, kept: &mut Option<T>, fresh: impl FnOnce() -> T) {
    if on {
        *part = Some(kept.take().unwrap_or_else(fresh));
    } else {
        *kept = part.take();
    }
}

fn part_ui<T>(
    ui: &mut Ui,
    (name, help): (&str, &str),
    part: &mut Option<T>,
    kept: &mut Option<T>,
    fresh: impl FnOnce() -> T,
) {
    let mut on = part.is_some();
    if ui.checkbox(&mut on, name).on_hover_text(help).changed() {
        switch(on, part, kept, fresh);
    }
}

/// What an index is called, what it means, and what follows its numbers.
fn index_words(index: Index) -> (&'static str, &'static str, &'static str) {
    match index {
        Index::Value => ("Value", "The value itself, in the data's units", ", data units"),
        Index::GradientStrength => (
            "Gradient strength",
            "How sharply values change, data units per world unit: much at boundaries, little within matter",
            " data units per world unit",
        ),
        Index::GradientElevation => (
            "Gradient elevation",
            "How far boundaries face upwards: their angle above the world's x–y plane, degrees",
            "°",
        ),
        Index::GradientAzimuth => (
            "Gradient azimuth",
            "Which way boundaries face about the world's z axis, from x towards y, degrees",
            "°",
        ),
        Index::ViewDepth => (
            "View depth",
            "How deep in the view: 0 where the sphere around the volume begins, 1 where it ends",
            " of the way through",
        ),
    }
}

/// The indices on offer.
fn index_range(index: Index, volume: &ScalarVolume) -> [f64; 2] {
    match index {
        Index::Value => [volume.statistics.min, volume.statistics.max],
        Index::GradientStrength => [0.0, STRENGTHS * strong_gradient(volume)],
        Index::GradientElevation => [-90.0, 90.0],
        Index::GradientAzimuth => [-180.0, 180.0],
        Index::ViewDepth => [0.0, 1.0],
    }
}

/// A part's switch with what it is looked up by; where that is another, its points are laid out over
/// the other's range as they were over the one's.
fn table_part_ui<T, E: Entry>(
    ui: &mut Ui,
    words: (&str, &str),
    editor: &mut TableEditor,
    (part, kept): (&mut Option<T>, &mut Option<T>),
    (fresh, volume): (impl FnOnce() -> T, &ScalarVolume),
    parts_of: impl Fn(&mut T) -> (&mut Index, &mut Vec<(f64, E)>),
) {
    let name = words.0;
    ui.horizontal(|ui| {
        part_ui(ui, words, part, kept, fresh);
        let Some(table) = part else { return };
        let (index, points) = parts_of(table);
        name_ui(ui, "by");
        let combo = ComboBox::from_id_salt(("index of", name)).width(150.0);
        let words = |index| (index_words(index).0, index_words(index).1);
        let chosen = combo_ui(ui, &format!("{name} by"), combo, Index::ALL, *index, words);
        if let Some(one) = chosen.filter(|one| one != index) {
            let [from, to] = [*index, one].map(|index| index_range(index, volume));
            stretch(points, from, to);
            *index = one;
        }
    });
    if let Some(table) = part {
        let (index, points) = parts_of(table);
        let (range, unit) = (index_range(*index, volume), index_words(*index).2);
        table_ui(ui, name, editor, points, (range, unit));
    }
}

fn amounts_ui(
    ui: &mut Ui,
    words: (&str, &str),
    editor: &mut TableEditor,
    part: (&mut Option<Amounts>, &mut Option<Amounts>),
    fresh: (impl FnOnce() -> Amounts, &ScalarVolume),
) {
    table_part_ui(ui, words, editor, part, fresh, |table| (&mut table.index, &mut table.points));
}

fn colours_ui(
    ui: &mut Ui,
    words: (&str, &str),
    editor: &mut TableEditor,
    part: (&mut Option<Colours>, &mut Option<Colours>),
    fresh: (impl FnOnce() -> Colours, &ScalarVolume),
) {
    table_part_ui(ui, words, editor, part, fresh, |table| (&mut table.index, &mut table.stops));
}

/// Lays points of one range out over another.
fn stretch<T>(points: &mut [(f64, T)], from: [f64; 2], to: [f64; 2]) {
    let width = from[1] / 2.0 - from[0] / 2.0;
    for (at, _) in points {
        let share = if width > 0.0 { (*at / 2.0 - from[0] / 2.0) / width } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        *at = to[0] * (1.0 - share) + to[1] * share;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_keep_their_place_in_another_range() {
        let mut points = [(0.0, 'a'), (5.0, 'b'), (10.0, 'c')];
        stretch(&mut points, [0.0, 10.0], [-180.0, 180.0]);
        assert_eq!(points, [(-180.0, 'a'), (0.0, 'b'), (180.0, 'c')]);
        stretch(&mut points, [3.0, 3.0], [0.0, 1.0]);
        assert!(points.iter().all(|(at, _)| *at == 0.0), "one place has no others");
    }

    #[test]
    fn what_was_switched_off_comes_back_as_it_was() {
        let (mut editor, mut shading) = (ShadingEditor::default(), Shading::default());
        editor.toggle_lights(&mut shading);
        assert_eq!(shading.lighting, Some(Lighting::default()));
        let chosen = Lighting { ambient: 0.5, ..Lighting::default() };
        shading.lighting = Some(chosen.clone());
        editor.toggle_lights(&mut shading);
        assert!(shading.is_plain());
        editor.start_over();
        editor.toggle_lights(&mut shading);
        assert_eq!(shading.lighting, Some(chosen));
    }
}
