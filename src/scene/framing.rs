//! The views that have names, and which way round a patient's space is.

use glam::DVec3;

use crate::core::Camera;

/// A named direction to look along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it all")]
pub enum NamedView {
    Front,
    Right,
    Top,
    Isometric,
}

impl NamedView {
    /// (direction, up) in world space, both unit.
    ///
    /// The front is seen along +y with z up, the posterior direction of left-posterior-superior
    /// space; in `anterior_y` spaces, whose y points forward, it is seen along −y.
    pub fn direction_and_up(self, anterior_y: bool) -> (DVec3, DVec3) {
        let ahead = if anterior_y { DVec3::NEG_Y } else { DVec3::Y };
        let right = ahead.cross(DVec3::Z);
        match self {
            Self::Front => (ahead, DVec3::Z),
            Self::Right => (-right, DVec3::Z),
            Self::Top => (DVec3::NEG_Z, ahead),
            Self::Isometric => {
                let direction = (ahead - right - DVec3::Z).normalize();
                (direction, Camera::new(DVec3::ZERO, direction, DVec3::Z, 1.0).up)
            }
        }
    }
}

/// Whether a space as a file names it has its y axis pointing to the front of a patient.
pub fn is_anterior_y(space: Option<&str>) -> bool {
    axis_letters(space)[1] == "A"
}

/// What the ends of the three world axes are called: letters of a patient space, or x y z.
pub fn axis_letters(space: Option<&str>) -> [&'static str; 3] {
    let name = space.unwrap_or_default().to_ascii_lowercase();
    match name.trim_end_matches("-time").trim_end_matches('t') {
        "left-posterior-superior" | "lps" => ["L", "P", "S"],
        "right-anterior-superior" | "ras" => ["R", "A", "S"],
        "left-anterior-superior" | "las" => ["L", "A", "S"],
        _ => ["x", "y", "z"],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_of_a_patient_is_seen_whatever_the_space() {
        // In LPS the face looks along −y, in RAS along +y: the eye is on that side.
        assert_eq!(NamedView::Front.direction_and_up(is_anterior_y(Some("LPS"))).0, DVec3::Y);
        let ras = is_anterior_y(Some("right-anterior-superior"));
        assert_eq!(NamedView::Front.direction_and_up(ras).0, DVec3::NEG_Y);
    }

    #[test]
    fn letters_follow_the_space() {
        assert_eq!(axis_letters(Some("left-posterior-superior")), ["L", "P", "S"]);
        assert_eq!(axis_letters(Some("RAST")), ["R", "A", "S"]);
        assert_eq!(axis_letters(Some("right-anterior-superior-time")), ["R", "A", "S"]);
        assert_eq!(axis_letters(Some("scanner-xyz")), ["x", "y", "z"]);
        assert_eq!(axis_letters(None), ["x", "y", "z"]);
    }
}
