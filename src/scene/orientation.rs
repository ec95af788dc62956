//! The views that have names, and which way round the space of a file is.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::Slice;
use crate::core::{Camera, names};
use crate::volume::Lattice;

/// A named direction to look along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it all")]
pub enum NamedView {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
    Isometric,
}

/// An axis of the world that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it all")]
pub enum UpAxis {
    #[default]
    PlusZ,
    MinusZ,
    PlusY,
    MinusY,
    PlusX,
    MinusX,
}

names!(UpAxis[6] {
    PlusZ => "+z" | "z",
    MinusZ => "-z",
    PlusY => "+y" | "y",
    MinusY => "-y",
    PlusX => "+x" | "x",
    MinusX => "-x",
});

impl UpAxis {
    /// The unit vector that points up.
    pub fn vector(self) -> DVec3 {
        match self {
            Self::PlusX => DVec3::X,
            Self::MinusX => DVec3::NEG_X,
            Self::PlusY => DVec3::Y,
            Self::MinusY => DVec3::NEG_Y,
            Self::PlusZ => DVec3::Z,
            Self::MinusZ => DVec3::NEG_Z,
        }
    }

    /// The opposite one.
    #[must_use]
    pub fn flipped(self) -> Self {
        match self {
            Self::PlusX => Self::MinusX,
            Self::MinusX => Self::PlusX,
            Self::PlusY => Self::MinusY,
            Self::MinusY => Self::PlusY,
            Self::PlusZ => Self::MinusZ,
            Self::MinusZ => Self::PlusZ,
        }
    }
}

/// Which way round things are in the world of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Orientation {
    /// In a patient's space what points to the patient's right: sides are then the patient's.
    pub right: Option<UpAxis>,
    /// And what points to the patient's front.
    pub anterior: Option<UpAxis>,
    /// What points up.
    pub up: UpAxis,
}

impl Orientation {
    /// Of a space as a file names it.
    pub fn of(space: Option<&str>) -> Self {
        let letters = axis_letters(space);
        let axes = [UpAxis::PlusX, UpAxis::PlusY, UpAxis::PlusZ];
        // The axis that goes from one side to the other, turned so that it points to the first.
        let towards = |[to, from]: [&str; 2]| {
            letters.iter().zip(axes).find_map(|(letter, axis)| match *letter {
                letter if letter == to => Some(axis),
                letter if letter == from => Some(axis.flipped()),
                _ => None,
            })
        };
        let other = if is_left_handed(space) { UpAxis::MinusZ } else { UpAxis::PlusZ };
        Self {
            right: towards(["R", "L"]),
            anterior: towards(["A", "P"]),
            up: towards(["S", "I"]).unwrap_or(other),
        }
    }

    /// The same with another axis up, where one was chosen.
    #[must_use]
    pub fn with_up(self, chosen: Option<UpAxis>) -> Self {
        Self { up: chosen.unwrap_or(self.up), ..self }
    }

    /// What lies ahead, up and to the right of who looks at the front.
    fn ahead_up_right(self) -> [DVec3; 3] {
        let up = self.up.vector();
        let anterior = self.anterior.map(UpAxis::vector).filter(|front| front.dot(up) == 0.0);
        let ahead = match (anterior, self.up) {
            (Some(front), _) => -front,
            (None, UpAxis::PlusY) => DVec3::NEG_Z,
            (None, UpAxis::MinusY) => DVec3::Z,
            (None, _) => DVec3::Y,
        };
        [ahead, up, ahead.cross(up)]
    }

    /// A camera that sees things in this way round as another saw them in its own.
    pub fn turned_from(self, other: Self, camera: &Camera) -> Camera {
        let axes = |orientation: Self| {
            let [ahead, up, right] = orientation.ahead_up_right();
            DMat3::from_cols(right, up, ahead)
        };
        // Both are of the same handedness, so that one is the other turned.
        camera.rotated(DQuat::from_mat3(&(axes(self) * axes(other).transpose())))
    }

    /// The view that things are first seen in: patients from the front, all else from a corner.
    pub fn first_view(self) -> NamedView {
        if self.right.is_some() { NamedView::Front } else { NamedView::Isometric }
    }
}

impl NamedView {
    /// Every one.
    pub const ALL: [Self; 7] = [
        Self::Front,
        Self::Back,
        Self::Left,
        Self::Right,
        Self::Top,
        Self::Bottom,
        Self::Isometric,
    ];

    /// (direction, up) in world space, both unit.
    ///
    /// The front is seen along +y with z up, the posterior direction of left-posterior-superior
    /// space; where y points to the front, it is seen along −y. With y up it is seen along −z. The sides are those on
    /// the left and the right of that view, but of a patient the patient's own.
    pub fn direction_and_up(self, orientation: Orientation) -> (DVec3, DVec3) {
        let [ahead, up, right] = orientation.ahead_up_right();
        // Of a patient who lies on a side, or is seen from there, the sides are those of the picture.
        let own_right = orientation.right.map(UpAxis::vector);
        let own_right = own_right.filter(|own| own.cross(right) == DVec3::ZERO).unwrap_or(right);
        match self {
            Self::Front => (ahead, up),
            Self::Back => (-ahead, up),
            Self::Left => (own_right, up),
            Self::Right => (-own_right, up),
            Self::Top => (-up, ahead),
            Self::Bottom => (up, -ahead),
            Self::Isometric => {
                let direction = (ahead - own_right - up).normalize();
                (direction, Camera::new(DVec3::ZERO, direction, up, 1.0).up)
            }
        }
    }

    /// The view of those along the axes that looks from where a unit axis of the world points to.
    pub fn from_axis(axis: DVec3, orientation: Orientation) -> Option<Self> {
        Self::ALL.into_iter().find(|view| view.direction_and_up(orientation).0.dot(axis) < -0.99)
    }
}

/// What the ends of the three world axes are called: letters of a patient space, or x y z.
pub fn axis_letters(space: Option<&str>) -> [&'static str; 3] {
    let name = space.unwrap_or_default().to_ascii_lowercase();
    let name = name.trim_end_matches("-time");
    let words: Vec<&str> = match name.contains('-') {
        true => name.split('-').collect(),
        // Three letters, and perhaps a fourth for time.
        false => (0..name.trim_end_matches('t').len()).filter_map(|i| name.get(i..=i)).collect(),
    };
    let letter = |word: &&str| match *word {
        "left" | "l" => Some("L"),
        "right" | "r" => Some("R"),
        "anterior" | "a" => Some("A"),
        "posterior" | "p" => Some("P"),
        "superior" | "s" => Some("S"),
        "inferior" | "i" => Some("I"),
        _ => None,
    };
    let letters: Option<Vec<&'static str>> = words.iter().map(letter).collect();
    let axes = [["L", "R"], ["A", "P"], ["S", "I"]];
    match letters.as_deref() {
        Some(&[x, y, z]) if axes.iter().all(|ends| [x, y, z].iter().any(|l| ends.contains(l))) => {
            [x, y, z]
        }
        _ => ["x", "y", "z"],
    }
}

/// What planes across a lattice's own axes are called: those of a patient as radiologists call what they come nearest to.
pub fn plane_names(lattice: &Lattice, space: Option<&str>) -> [&'static str; 3] {
    let letters = axis_letters(space);
    let names = [0, 1, 2].map(|axis| {
        let normal = Slice::across(lattice, axis, 0.5, 1.0).plane.normal;
        match letters[normal.abs().max_position()] {
            "L" | "R" => "Sagittal",
            "A" | "P" => "Coronal",
            "S" | "I" => "Axial",
            axis => axis,
        }
    });
    let [a, b, c] = names;
    // Two of a lattice that lies very obliquely may be nearest to the same.
    let are_of_a_patient = letters != ["x", "y", "z"] && a != b && b != c && c != a;
    if are_of_a_patient { names } else { ["Across x", "Across y", "Across z"] }
}

/// Whether a file calls its space left-handed, as of slices that are stacked downwards: with x to the right and y away from
/// who looks, z points down.
fn is_left_handed(space: Option<&str>) -> bool {
    let name = space.unwrap_or_default().to_ascii_lowercase();
    matches!(name.trim_end_matches("-time").trim_end_matches('t'), "3d-left-handed" | "3dlh")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_of_a_patient_is_seen_whatever_the_space() {
        // In LPS the face looks along −y, in RAS along +y: the eye is on that side.
        let front = |space| NamedView::Front.direction_and_up(Orientation::of(Some(space))).0;
        assert_eq!(front("LPS"), DVec3::Y);
        assert_eq!(front("right-anterior-superior"), DVec3::NEG_Y);
    }

    #[test]
    fn sides_of_patients_are_their_own_and_of_all_else_those_of_the_picture() {
        let right = |space| NamedView::Right.direction_and_up(Orientation::of(space)).0;
        // The eye is where the right side is: at −x in LPS, at +x in RAS, at −x in LAS.
        assert_eq!(right(Some("left-posterior-superior")), DVec3::X);
        assert_eq!(right(Some("RAS")), DVec3::NEG_X);
        assert_eq!(right(Some("LAS")), DVec3::X);
        assert_eq!(right(None), DVec3::NEG_X);
        for space in [None, Some("LPS"), Some("RAS")] {
            let of = |view: NamedView| view.direction_and_up(Orientation::of(space)).0;
            assert_eq!(of(NamedView::Left), -of(NamedView::Right));
            assert_eq!(of(NamedView::Back), -of(NamedView::Front));
            assert_eq!(of(NamedView::Bottom), -of(NamedView::Top));
        }
    }

    #[test]
    fn whatever_axis_is_up_points_up_in_every_view_and_turns_with_the_choice() {
        for space in [None, Some("LPS"), Some("RAS")] {
            let own = Orientation::of(space);
            for up in UpAxis::ALL {
                let chosen = own.with_up(Some(up));
                let of = |view: NamedView| view.direction_and_up(chosen);
                for view in [NamedView::Front, NamedView::Back, NamedView::Left, NamedView::Right] {
                    assert_eq!(of(view).1, up.vector(), "{view:?}");
                    assert_eq!(of(view).0.dot(up.vector()), 0.0, "{view:?}");
                }
                assert_eq!(of(NamedView::Top).0, -up.vector());
                assert!(of(NamedView::Isometric).1.dot(up.vector()) > 0.5);
                // Each axis has a view from either end.
                for axis in UpAxis::ALL.map(UpAxis::vector) {
                    let view = NamedView::from_axis(axis, chosen).expect("one of the six");
                    assert_eq!(of(view).0, -axis);
                }
                // What is seen keeps its place in the picture.
                let askew = |orientation: Orientation| {
                    let along = |view: NamedView| view.direction_and_up(orientation).0;
                    let direction = 3.0 * along(NamedView::Front) + along(NamedView::Top);
                    Camera::new(DVec3::ONE, direction.normalize(), orientation.up.vector(), 2.0)
                };
                let (turned, expected) = (chosen.turned_from(own, &askew(own)), askew(chosen));
                assert!((turned.direction - expected.direction).length() < 1e-12);
                assert!((turned.up - expected.up).length() < 1e-12);
                assert_eq!(chosen.with_up(Some(up.flipped().flipped())), chosen);
                assert_eq!(up.flipped().vector(), -up.vector());
            }
        }
    }

    #[test]
    fn named_views_have_unit_perpendicular_axes_in_every_space() {
        for view in NamedView::ALL {
            for space in [None, Some("LPS"), Some("RAS")] {
                let (direction, up) = view.direction_and_up(Orientation::of(space));
                assert!((direction.length() - 1.0).abs() < 1e-12, "{view:?}");
                assert!((up.length() - 1.0).abs() < 1e-12, "{view:?}");
                assert!(direction.dot(up).abs() < 1e-12, "{view:?}");
            }
        }
    }

    #[test]
    fn what_a_file_calls_up_is_up() {
        let up = |space| Orientation::of(Some(space)).up;
        assert_eq!(up("left-posterior-superior"), UpAxis::PlusZ);
        assert_eq!(up("left-posterior-inferior"), UpAxis::MinusZ);
        assert_eq!(up("right-superior-anterior"), UpAxis::PlusY);
        assert_eq!(up("3D-left-handed"), UpAxis::MinusZ);
        assert_eq!(up("3D-right-handed"), UpAxis::PlusZ);
        // Wherever the axes point, the face is looked at, and sides are the patient's own.
        for space in ["LPS", "RAS", "RSA", "RSP", "ASL", "PIR", "ILA"] {
            let front = NamedView::Front.direction_and_up(Orientation::of(Some(space)));
            let at = |letters: [&str; 2]| {
                let found = axis_letters(Some(space));
                let axis = found.iter().position(|letter| letters.contains(letter)).unwrap();
                let sign = if found[axis] == letters[0] { 1.0 } else { -1.0 };
                DVec3::AXES[axis] * sign
            };
            assert_eq!(front, (-at(["A", "P"]), at(["S", "I"])), "{space}");
            let right = NamedView::Right.direction_and_up(Orientation::of(Some(space))).0;
            assert_eq!(right, -at(["R", "L"]), "{space}");
        }
        // Patients are seen from the front, all else from a corner.
        assert_eq!(Orientation::of(Some("RAS")).first_view(), NamedView::Front);
        assert_eq!(Orientation::of(Some("3D-left-handed")).first_view(), NamedView::Isometric);
    }

    #[test]
    fn planes_of_patients_are_called_as_radiologists_do_whatever_axes_slices_were_stored_along() {
        let named = |axes: [DVec3; 3], space| {
            let [x, y, z] = axes.map(DVec3::normalize);
            let direction = DMat3::from_cols(x, y, z);
            plane_names(&Lattice { direction, ..Lattice::unit([4; 3]) }, space)
        };
        let whole = DVec3::AXES;
        for space in ["LPS", "RAS", "left-posterior-inferior"] {
            assert_eq!(named(whole, Some(space)), ["Sagittal", "Coronal", "Axial"], "{space}");
        }
        assert_eq!(named(whole, Some("RSA")), ["Sagittal", "Axial", "Coronal"]);
        // Slices stacked from front to back, a little tilted.
        let stacked = [DVec3::X, DVec3::new(0.0, 0.1, -1.0), DVec3::new(0.0, 1.0, 0.1)];
        assert_eq!(named(stacked, Some("LPS")), ["Sagittal", "Axial", "Coronal"]);
        let across = ["Across x", "Across y", "Across z"];
        assert_eq!(named(stacked, None), across);
        let oblique =
            [DVec3::new(1.0, 1.0, -1.0), DVec3::new(-1.0, 1.0, 0.9), DVec3::new(0.9, 0.0, 1.0)];
        assert_eq!(named(oblique, Some("LPS")), across, "two are nearest to the same");
    }

    #[test]
    fn letters_follow_the_space() {
        assert_eq!(axis_letters(Some("left-posterior-superior")), ["L", "P", "S"]);
        assert_eq!(axis_letters(Some("RAST")), ["R", "A", "S"]);
        assert_eq!(axis_letters(Some("right-anterior-superior-time")), ["R", "A", "S"]);
        assert_eq!(axis_letters(Some("lpi")), ["L", "P", "I"]);
        for none in ["scanner-xyz", "lls", "left-posterior", "3D-right-handed", "é"] {
            assert_eq!(axis_letters(Some(none)), ["x", "y", "z"], "{none}");
        }
        assert_eq!(axis_letters(None), ["x", "y", "z"]);
    }
}
