//! The camera, and the three spaces between a world point and a pixel.
//!
//! *World* is the file's physical space. *View* has x to the right, y up and z away from the eye
//! (depth); its origin is the focal point when orthographic and the eye when in perspective.
//! *Pixel* has x to the right and y **down**, in pixels, with (0, 0) the top left corner of the
//! top left pixel, so that pixel (i, j) is sampled at (i + ½, j + ½).

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Sines of angles below this are none: what rounding leaves of a level horizon.
const LEVEL: f64 = 1e-6;
/// A turntable ends so far before the pole, radians: at the pole itself rounding would tell which way is up.
const POLE: f64 = 5e-7;

/// How view space is flattened onto the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Projection {
    /// Parallel rays.
    Orthographic,
    /// Rays through one eye; the full vertical angle of view in radians, in 0..π.
    Perspective {
        /// Full vertical angle of view, radians.
        view_angle: f64,
    },
}

/// Where the scene is seen from. All lengths are world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// The world point in the middle of the picture.
    pub focal_point: DVec3,
    /// Unit vector from the eye into the scene.
    pub direction: DVec3,
    /// Unit vector that points up in the picture, perpendicular to `direction`.
    pub up: DVec3,
    /// Half the height of what is seen at the focal point, world units, > 0.
    pub parallel_scale: f64,
    /// Orthographic or perspective.
    pub projection: Projection,
}

impl Camera {
    /// A camera that looks along `direction` at `focal_point`.
    ///
    /// `up` need not be perpendicular; one that is parallel to the direction (or zero) is replaced
    /// by the world axis least aligned with it. A zero or non-finite direction becomes −z.
    pub fn new(focal_point: DVec3, direction: DVec3, up: DVec3, parallel_scale: f64) -> Self {
        let direction = direction.try_normalize().unwrap_or(DVec3::NEG_Z);
        Self {
            focal_point,
            direction,
            up: perpendicular_up(direction, up),
            parallel_scale,
            projection: Projection::Orthographic,
        }
    }

    /// The unit vector that points right in the picture.
    pub fn right(&self) -> DVec3 {
        self.direction.cross(self.up)
    }

    /// Rotation whose rows are the view axes: view direction vectors from world ones.
    pub fn view_from_world_rotation(&self) -> DMat3 {
        DMat3::from_cols(self.right(), self.up, self.direction).transpose()
    }

    /// Distance from the eye to the focal point in perspective; `None` when orthographic.
    pub fn eye_distance(&self) -> Option<f64> {
        match self.projection {
            Projection::Orthographic => None,
            Projection::Perspective { view_angle } => {
                Some(self.parallel_scale / (view_angle / 2.0).tan())
            }
        }
    }

    /// The world point that is the origin of view space (see the module's words).
    pub fn view_origin(&self) -> DVec3 {
        self.focal_point - self.direction * self.eye_distance().unwrap_or(0.0)
    }

    /// View space from world space.
    pub fn to_view(&self, world: DVec3) -> DVec3 {
        self.view_from_world_rotation() * (world - self.view_origin())
    }

    /// Pixels per world unit at the focal point, for a picture `height` pixels high.
    pub fn pixels_per_unit(&self, height: f64) -> f64 {
        height / (2.0 * self.parallel_scale)
    }

    /// Pixel position of a view-space point; `None` at or behind the eye.
    pub fn pixel_from_view(&self, view: DVec3, size: [f64; 2]) -> Option<DVec2> {
        let scale = self.pixels_per_unit(size[1]);
        let shrink = match self.eye_distance() {
            None => 1.0,
            Some(_) if view.z <= 0.0 => return None,
            Some(distance) => distance / view.z,
        };
        Some(DVec2::new(
            size[0] / 2.0 + view.x * shrink * scale,
            size[1] / 2.0 - view.y * shrink * scale,
        ))
    }

    /// The world ray through a pixel position: origin and unit direction.
    ///
    /// Orthographic rays start on the plane through the focal point.
    pub fn ray(&self, pixel: DVec2, size: [f64; 2]) -> (DVec3, DVec3) {
        let units_per_pixel = 1.0 / self.pixels_per_unit(size[1]);
        let x = (pixel.x - size[0] / 2.0) * units_per_pixel;
        let y = (size[1] / 2.0 - pixel.y) * units_per_pixel;
        let offset = self.right() * x + self.up * y;
        match self.eye_distance() {
            None => (self.focal_point + offset, self.direction),
            Some(distance) => {
                (self.view_origin(), (self.direction * distance + offset).normalize())
            }
        }
    }

    /// Turns the camera about its focal point by a world-space rotation.
    pub fn rotated(&self, rotation: DQuat) -> Self {
        let direction = (rotation * self.direction).normalize();
        Self { direction, up: perpendicular_up(direction, rotation * self.up), ..*self }
    }

    /// Orbits without a pole: the scene follows a drag of `right` and `down` radians.
    pub fn orbited(&self, right: f64, down: f64) -> Self {
        let axis = self.up * -right + self.right() * -down;
        let angle = axis.length();
        if angle == 0.0 {
            return *self;
        }
        self.rotated(DQuat::from_axis_angle(axis / angle, angle))
    }

    /// Orbits about a unit axis of the world that is to stay upright: the scene follows a drag of `right` and `down`
    /// radians, and where the horizon is level the view ends above and below.
    pub fn turned_about(&self, axis: DVec3, right: f64, down: f64) -> Self {
        let is_upside_down = self.up.dot(axis) < 0.0;
        let is_level = self.right().dot(axis).abs() < LEVEL;
        // From the axis to where the eye looks; a drag down looks farther away from it.
        let polar = self.direction.dot(axis).clamp(-1.0, 1.0).acos();
        let away = match (is_level, is_upside_down) {
            (false, _) => down,
            (true, false) => (polar + down).clamp(POLE, PI - POLE) - polar,
            (true, true) => polar - (polar - down).clamp(POLE, PI - POLE),
        };
        let tilted = self.rotated(DQuat::from_axis_angle(self.right(), -away));
        let turn = if is_upside_down { right } else { -right };
        tilted.rotated(DQuat::from_axis_angle(axis, turn))
    }

    /// Turns about the line of sight: the scene turns clockwise by so many radians.
    pub fn rolled(&self, clockwise: f64) -> Self {
        self.rotated(DQuat::from_axis_angle(self.direction, -clockwise))
    }

    /// The same view with a level horizon: the axis points up in the picture as far as it can. Along the axis itself
    /// nothing changes.
    pub fn leveled(&self, axis: DVec3) -> Self {
        if self.direction.cross(axis).length() < LEVEL {
            return *self;
        }
        Self { up: perpendicular_up(self.direction, axis), ..*self }
    }

    /// Shifts the focal point so that the scene follows a drag of `pixels` (x right, y down).
    pub fn panned(&self, pixels: DVec2, height: f64) -> Self {
        let units = 1.0 / self.pixels_per_unit(height);
        let shift = self.right() * (-pixels.x * units) + self.up * (pixels.y * units);
        Self { focal_point: self.focal_point + shift, ..*self }
    }

    /// Zooms by `factor` (> 1 comes closer) about the given pixel, which keeps its focal-plane point.
    pub fn zoomed(&self, factor: f64, about: DVec2, size: [f64; 2]) -> Self {
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        let units = 1.0 / self.pixels_per_unit(size[1]);
        let x = (about.x - size[0] / 2.0) * units;
        let y = (size[1] / 2.0 - about.y) * units;
        let kept = 1.0 - 1.0 / factor;
        Self {
            focal_point: self.focal_point + (self.right() * x + self.up * y) * kept,
            parallel_scale: self.parallel_scale / factor,
            ..*self
        }
    }
}

/// `up` made perpendicular to the unit `direction`, replaced where it is parallel or degenerate.
fn perpendicular_up(direction: DVec3, up: DVec3) -> DVec3 {
    let across = |candidate: DVec3| {
        let candidate = candidate.try_normalize()?;
        let rejected = candidate - direction * candidate.dot(direction);
        (rejected.length() > 1e-6).then(|| rejected.normalize())
    };
    across(up).unwrap_or_else(|| {
        let a = direction.abs();
        let axis = if a.z <= a.x && a.z <= a.y {
            DVec3::Z
        } else if a.y <= a.x {
            DVec3::Y
        } else {
            DVec3::X
        };
        across(axis).expect("the least aligned axis is never parallel")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [f64; 2] = [640.0, 480.0];

    fn cameras() -> [Camera; 2] {
        let mut camera =
            Camera::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.3, -0.5, 0.8), DVec3::Z, 2.5);
        let orthographic = camera;
        camera.projection = Projection::Perspective { view_angle: 0.6 };
        [orthographic, camera]
    }

    #[test]
    fn the_view_axes_are_a_right_handed_set_when_z_points_at_the_viewer() {
        for camera in cameras() {
            let (right, up) = (camera.right(), camera.up);
            assert!((right.cross(up) + camera.direction).length() < 1e-12);
        }
    }

    #[test]
    fn every_point_of_a_pixels_ray_projects_to_that_pixel() {
        for camera in cameras() {
            let pixel = DVec2::new(123.5, 77.5);
            let (origin, direction) = camera.ray(pixel, SIZE);
            for t in [0.5, 3.0, 40.0] {
                let view = camera.to_view(origin + direction * t);
                let back = camera.pixel_from_view(view, SIZE).expect("before the eye");
                assert!((back - pixel).length() < 1e-9, "{back} {pixel}");
            }
        }
    }

    #[test]
    fn zooming_keeps_the_point_under_the_cursor() {
        for camera in cameras() {
            let about = DVec2::new(500.0, 40.0);
            let on_focal_plane = |c: &Camera| {
                let (origin, direction) = c.ray(about, SIZE);
                let t = (c.focal_point - origin).dot(c.direction) / direction.dot(c.direction);
                origin + direction * t
            };
            let zoomed = camera.zoomed(1.7, about, SIZE);
            assert!((on_focal_plane(&camera) - on_focal_plane(&zoomed)).length() < 1e-9);
        }
    }

    #[test]
    fn a_drag_to_the_right_turns_the_front_of_the_scene_right() {
        for camera in cameras() {
            let front = camera.focal_point - camera.direction * 0.1;
            let turned = camera.orbited(0.2, 0.0);
            assert!(turned.to_view(front).x > 0.0);
            let turned = camera.orbited(0.0, 0.2);
            assert!(turned.to_view(front).y < 0.0, "down in the picture is −y in view space");
        }
    }

    #[test]
    fn a_pan_moves_the_focal_point_with_the_hand() {
        for camera in cameras() {
            let panned = camera.panned(DVec2::new(10.0, 4.0), SIZE[1]);
            let pixel = panned.pixel_from_view(panned.to_view(camera.focal_point), SIZE);
            let pixel = pixel.expect("before the eye");
            assert!((pixel - DVec2::new(330.0, 244.0)).length() < 1e-9, "{pixel}");
        }
    }

    #[test]
    fn an_up_parallel_to_the_direction_is_replaced() {
        let camera = Camera::new(DVec3::ZERO, DVec3::Z, DVec3::Z, 1.0);
        assert!(camera.up.dot(camera.direction).abs() < 1e-12);
        assert!((camera.up.length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_turn_about_the_line_of_sight_turns_up_with_it() {
        for camera in cameras() {
            let quarter = DQuat::from_axis_angle(camera.direction, std::f64::consts::FRAC_PI_2);
            let turned = camera.rotated(quarter);
            assert!((turned.up - camera.right()).length() < 1e-12, "{}", turned.up);
            assert!((turned.direction - camera.direction).length() < 1e-12);
        }
    }

    #[test]
    fn a_turntable_keeps_the_horizon_level_and_ends_above_and_below() {
        for camera in cameras() {
            let mut camera = camera.leveled(DVec3::Z);
            for (right, down) in [(0.3, 0.2), (-1.0, 0.9), (0.7, 3.0), (0.4, 0.0), (0.0, 1.0)] {
                camera = camera.turned_about(DVec3::Z, right, down);
                assert!(camera.right().z.abs() < 1e-9, "level: {}", camera.right());
                assert!(camera.up.z > -1e-7, "never upside down: {}", camera.up);
            }
            assert!((camera.direction + DVec3::Z).length() < 1e-6, "from above, and no further");
            let back = camera.turned_about(DVec3::Z, 0.0, -1.0);
            assert!((back.direction.z + 1.0_f64.cos()).abs() < 1e-6, "{}", back.direction);
            // What is in front follows the hand, upside down as well.
            for camera in [back, back.rolled(PI)] {
                let front = camera.focal_point - camera.direction * 0.1;
                assert!(camera.turned_about(DVec3::Z, 0.2, 0.0).to_view(front).x > 0.0);
                assert!(camera.turned_about(DVec3::Z, 0.0, 0.1).to_view(front).y < 0.0);
            }
        }
    }

    #[test]
    fn a_roll_turns_the_scene_clockwise_and_levelling_takes_it_back() {
        for camera in cameras() {
            let camera = camera.leveled(DVec3::Z);
            let top = camera.focal_point + camera.up * 0.1;
            let rolled = camera.rolled(PI / 2.0);
            let seen = rolled.to_view(top);
            assert!(seen.x > 0.09 && seen.y.abs() < 1e-9, "the top went to the right: {seen}");
            assert!((rolled.leveled(DVec3::Z).up - camera.up).length() < 1e-9);
            let above = Camera::new(DVec3::ZERO, DVec3::NEG_Z, DVec3::X, 1.0);
            assert_eq!(above.leveled(DVec3::Z), above, "there is no horizon");
        }
    }

    #[test]
    fn a_zoom_by_no_factor_changes_nothing() {
        for camera in cameras() {
            for factor in [0.0, -2.0, f64::NAN, f64::INFINITY] {
                assert_eq!(camera.zoomed(factor, DVec2::ZERO, SIZE), camera, "{factor}");
            }
        }
    }
}
