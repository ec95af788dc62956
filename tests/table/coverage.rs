//! That the table has a row for everything there is.

use std::collections::BTreeSet;

use voxsplat::kernel::Kernel;
use voxsplat::scene::{
    AlongRay, Backend, Classify, Effect, Index, OpacityModel, Order, Reconstruction, SplatSettings,
    Visibility,
};
use voxsplat::vector::VectorMode;

use crate::rows::{Judged, Row, rows};
use crate::scenes::Part;

/// Rows that are drawn.
fn drawn() -> Vec<Row> {
    rows().into_iter().filter(|row| row.judged != Judged::Refused).collect()
}

#[test]
fn every_row_has_a_name_of_its_own() {
    let mut names = BTreeSet::new();
    let twice: Vec<String> =
        rows().iter().map(Row::name).filter(|name| !names.insert(name.clone())).collect();
    assert!(twice.is_empty(), "{}", twice.join("\n"));
}

#[test]
fn every_effect_of_a_scene_has_a_row() {
    let scenes: Vec<_> = drawn().iter().map(Row::scene).collect();
    for effect in Effect::ALL {
        let is_asked = scenes.iter().any(|scene| effect.asked_by(scene).is_some());
        assert!(is_asked, "no row shows {effect:?}");
    }
}

#[test]
fn every_choice_of_a_mode_has_a_row() {
    let rows = drawn();
    let has = |what: &str, is: &dyn Fn(&SplatSettings) -> bool| {
        assert!(rows.iter().any(|row| is(&row.mode)), "no row is drawn by {what}");
    };
    Kernel::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.kernel == one));
    Visibility::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.visibility == one));
    Classify::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.classify == one));
    Reconstruction::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.reconstruction == one));
    OpacityModel::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.opacity_model == one));
    Order::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.order == one));
    Backend::ALL.iter().for_each(|&one| has(one.name(), &|mode| mode.backend == one));
}

#[test]
fn every_choice_of_a_part_has_a_row() {
    let rows = drawn();
    let has = |part: Part| {
        assert!(rows.iter().any(|row| row.parts.contains(&part)), "no row has {part:?}");
    };
    for &index in Index::ALL {
        has(Part::OpacityBy(index));
        has(Part::ModulationBy(index));
        has(Part::ReflectionBy(index));
        has(Part::EmissionBy(index));
    }
    for mode in VectorMode::ALL {
        has(Part::Vectors(mode));
        has(Part::SecondVectors(mode));
    }
    let along = AlongRay::ALL.iter().filter(|&&along| along != AlongRay::Composite);
    along.for_each(|&along| has(Part::Along(along)));
}
