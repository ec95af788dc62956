//! Where the samples of another file lie in the world that is shown.

use glam::{DAffine3, DMat3, DVec3};

use super::axis_letters;
use crate::volume::Lattice;

/// Where samples of another file lie in the world of what is shown: what takes their index to it, and what is said of it.
///
/// Patients' spaces are turned into one another. Samples that no place is stated of lie on the shown lattice, where that
/// has as many: their file has but numbers.
pub fn place_over(
    (theirs, their_space): (&Lattice, Option<&str>),
    (ours, our_space): (&Lattice, Option<&str>),
) -> (DAffine3, Option<&'static str>) {
    let affine =
        |lattice: &Lattice| DAffine3 { matrix3: lattice.axes(), translation: lattice.origin };
    let has_place = their_space.is_some() || *theirs != Lattice::unit(theirs.dims);
    let other = (theirs.dims != ours.dims).then_some(
        "they are of another grid than the volume, and lie where their own coordinates say",
    );
    match has_place || theirs.dims != ours.dims || theirs == ours {
        true => (DAffine3::from_mat3(turn_between(their_space, our_space)) * affine(theirs), other),
        false => (affine(ours), Some("they state no place, and lie on the volume's own samples")),
    }
}

/// What turns the world of one patient's space into that of another: the same place of the body. The identity where either
/// is none.
fn turn_between(from: Option<&str>, to: Option<&str>) -> DMat3 {
    let opposite = |letter| match letter {
        "L" => "R",
        "R" => "L",
        "A" => "P",
        "P" => "A",
        "S" => "I",
        "I" => "S",
        other => other,
    };
    let (theirs, ours) = (axis_letters(from), axis_letters(to));
    if theirs.contains(&"x") || ours.contains(&"x") {
        return DMat3::IDENTITY;
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    DMat3::from_cols_array_2d(&theirs.map(|letter| {
        let sum = |sum: DVec3, (axis, our): (DVec3, &str)| match our {
            our if our == letter => sum + axis,
            our if our == opposite(letter) => sum - axis,
            _ => sum,
        };
        axes.into_iter().zip(ours).fold(DVec3::ZERO, sum).to_array()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_of_a_body_is_the_same_in_every_space() {
        let place = DVec3::new(1.0, 2.0, 3.0);
        let turned = |from, to| turn_between(Some(from), Some(to)) * place;
        assert_eq!(turned("left-posterior-superior", "RAS"), DVec3::new(-1.0, -2.0, 3.0));
        assert_eq!(turned("LPS", "left-posterior-superior-time"), place);
        // Its first axis is their second, turned round.
        assert_eq!(turned("PIR", "LPS"), DVec3::new(-3.0, 1.0, -2.0));
        assert_eq!(turned("3D-right-handed", "LPS"), place);
        assert_eq!(turn_between(None, Some("LPS")), DMat3::IDENTITY);
    }

    #[test]
    fn samples_without_a_place_over_others_without_one_are_not_remarked_on() {
        let unit = Lattice::unit([3, 4, 5]);
        assert_eq!(place_over((&unit, None), (&unit, None)).1, None);
    }

    #[test]
    fn samples_without_a_place_lie_on_those_that_are_shown() {
        let scan = Lattice {
            origin: DVec3::new(-5.0, 2.0, 7.0),
            spacing: DVec3::new(0.5, 0.5, 2.0),
            ..Lattice::unit([3, 4, 5])
        };
        let at = DVec3::new(1.0, 2.0, 3.0);
        let placed = |theirs: &Lattice, space| place_over((theirs, space), (&scan, Some("LPS")));
        let (on, said) = placed(&Lattice::unit([3, 4, 5]), None);
        assert_eq!(on.transform_point3(at), scan.world_from_index(at));
        assert!(said.is_some());
        // Of another size, or of a stated place, they lie where they are.
        let moved = Lattice { origin: DVec3::X, ..Lattice::unit([3, 4, 5]) };
        for (theirs, space, expected) in [
            (moved, None, at + DVec3::X),
            (Lattice::unit([3, 4, 5]), Some("RAS"), DVec3::new(-1.0, -2.0, 3.0)),
        ] {
            let (place, said) = placed(&theirs, space);
            assert_eq!((place.transform_point3(at), said), (expected, None));
        }
        let (place, said) = placed(&Lattice::unit([3, 4, 6]), None);
        assert_eq!(place.transform_point3(at), at);
        assert!(said.is_some_and(|said| said.contains("another grid")));
    }
}
