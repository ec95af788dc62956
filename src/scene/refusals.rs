//! What cannot be drawn beside what, in one table: what the mathematics of a mode leaves no place for.
//!
//! `render` refuses such a scene with the sentence; the window leaves the part out and says so. What a single part
//! may be by itself, and in which modes, says the part ([`SplatSettings::check`], [`super::Shading::check`],
//! [`super::Inside::check`]).

use super::{AlongRay, Classify, Effect, Scene, SplatSettings};

/// What leaves no place for a part.
#[derive(Debug, Clone, PartialEq)]
pub enum Ground {
    /// Kernels that are shaded first and drawn as triangles alone, one by one: what of the mode makes them so.
    Triangles(String),
    /// A projection of values, which has no slabs and no opacities.
    Projection(AlongRay),
    /// Vectors, which values that are projected have no place for.
    Vectors,
    /// The field is hidden, of which it would be a part.
    Hidden,
}

/// A part of a scene that is not drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// Which.
    pub part: Effect,
    /// Why.
    pub ground: Ground,
}

type Rule = fn(&Scene) -> Option<Ground>;

/// What is seen inside a field.
const INSIDE: &[Effect] = &[Effect::Clip, Effect::Projection, Effect::Isosurfaces, Effect::Slices];
/// What of it is of values.
const OF_VALUES: &[Effect] = &[Effect::Projection, Effect::Isosurfaces, Effect::Slices];

/// Who may not stand where, and why.
const RULES: &[(&[Effect], Rule)] = &[
    (&[Effect::Vectors, Effect::SecondVectors], beside_triangles),
    (&[Effect::Polygons], |scene| beside_projection(scene).or_else(|| beside_triangles(scene))),
    (&[Effect::Clip], |scene| {
        (!scene.shows_field() && !shows_surfaces_alone(scene)).then_some(Ground::Hidden)
    }),
    (OF_VALUES, |scene| (!scene.shows_field()).then_some(Ground::Hidden)),
    (INSIDE, |scene| {
        let projects = scene.inside.along != AlongRay::Composite && scene.shows_field();
        (projects && !scene.vectors().is_empty()).then_some(Ground::Vectors)
    }),
];

/// Surfaces by themselves are cut, though what would be of a field is not there.
fn shows_surfaces_alone(scene: &Scene) -> bool {
    !scene.shows_field() && scene.vectors().is_empty() && !scene.polygons().is_empty()
}

fn beside_triangles(scene: &Scene) -> Option<Ground> {
    Ground::of_mode(&scene.splat).filter(|_| scene.shows_field())
}

fn beside_projection(scene: &Scene) -> Option<Ground> {
    let along = scene.inside.along;
    (along != AlongRay::Composite && scene.shows_field()).then_some(Ground::Projection(along))
}

impl Ground {
    /// What of a mode leaves no place for anything beside its field.
    pub fn of_mode(splat: &SplatSettings) -> Option<Self> {
        let is_shaded_first = splat.classify == Classify::Before;
        splat.drawn_by_triangles_alone().filter(|_| is_shaded_first).map(Self::Triangles)
    }
}

impl Scene {
    /// What of it cannot be drawn beside the rest, by the table.
    pub fn refusals(&self) -> Vec<Refusal> {
        let parts =
            RULES.iter().flat_map(|(parts, rule)| parts.iter().map(move |part| (part, rule)));
        let asked = parts.filter(|(part, _)| part.asked_by(self).is_some());
        asked
            .filter_map(|(part, rule)| Some(Refusal { part: *part, ground: rule(self)? }))
            .collect()
    }

    /// Why a part of it cannot be drawn, asked for or not.
    pub fn refusal_of(&self, part: Effect) -> Option<Ground> {
        let mut rules = RULES.iter().filter(|(parts, _)| parts.contains(&part));
        rules.find_map(|(_, rule)| rule(self))
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let part = self.part.name();
        match &self.ground {
            Ground::Triangles(found) => write!(
                f,
                "expected a mode that tiles draw with {part}, found {found}, which only triangles draw; choose \
                 --backend auto and another kernel than gouraud, no wider than 8 voxels, or {}",
                match self.part {
                    Effect::Polygons => "leave the polygons out",
                    _ => "show the vectors alone",
                }
            ),
            Ground::Projection(along) => write!(
                f,
                "expected --projection composite with {part}, found {}, which is of values and shows no \
                 surfaces; leave one of the two out",
                along.name()
            ),
            Ground::Vectors => write!(
                f,
                "expected no {part} with vectors, which has no slabs that they could lie in, found both; leave \
                 one of the two out"
            ),
            Ground::Hidden if self.part == Effect::Clip => write!(
                f,
                "expected no {part} where the field is not drawn, as vectors by themselves are drawn whole, found both; \
                 show the field, too, or leave one of the two out"
            ),
            Ground::Hidden => write!(
                f,
                "expected a field that is drawn with {part}, found none; show the field (that of a file of polygons or \
                 points by --kernel ellipsoids), or leave the {part} out"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_has_parts_that_can_be_asked_for_and_a_sentence_of_its_own() {
        let grounds = [
            Ground::Triangles("--kernel gouraud".to_owned()),
            Ground::Projection(AlongRay::Maximum),
            Ground::Vectors,
            Ground::Hidden,
        ];
        let sentences =
            grounds.map(|ground| Refusal { part: Effect::Polygons, ground }.to_string());
        for (i, sentence) in sentences.iter().enumerate() {
            assert!(
                sentence.starts_with("expected ") && sentence.contains(", found "),
                "{sentence}"
            );
            assert!(sentence.contains("; ") && !sentence.ends_with('.'), "{sentence}");
            assert!(sentences[..i].iter().all(|other| other != sentence));
        }
        for (parts, _) in RULES {
            assert!(parts.iter().all(|part| Effect::ALL.contains(part)));
        }
    }

    #[test]
    fn triangles_are_what_gouraud_and_wide_kernels_shaded_first_are_drawn_as() {
        let first = SplatSettings::SHADE_FIRST;
        assert_eq!(Ground::of_mode(&SplatSettings::EXACT), None);
        assert_eq!(Ground::of_mode(&first), None, "tiles can");
        let wide = SplatSettings { extent: Some(12.0), ..first };
        assert_eq!(Ground::of_mode(&wide), Some(Ground::Triangles("--extent 12".to_owned())));
    }
}
