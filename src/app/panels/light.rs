//! Lights for the hand: each a lit ball with a dot where it stands, turned like a trackball.

use eframe::egui::accesskit::Role;
use eframe::egui::epaint::Mesh;
use eframe::egui::{
    Color32, CursorIcon, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, vec2,
};
use glam::{DQuat, DVec3, dvec3};

use super::inside::{listed_ui, remove_ui};
use super::splat::slider_row;
use super::{row_ui, slider_ui, typed};
use crate::app::theme;
use crate::core::colour::srgb_from_linear;
use crate::core::{Camera, Srgb8};
use crate::scene::{Attached, Light, Lighting, MOST_LIGHTS};

/// The specular exponents on offer.
const EXPONENT: std::ops::RangeInclusive<f64> = 1.0..=1000.0;
/// Side of the square that the ball lies in, points.
const SIDE: f32 = 58.0;
/// Rings and sectors that the ball is painted by.
const RINGS: u32 = 7;
const SECTORS: u32 = 28;

/// One more light, from the right.
pub(super) fn add(lighting: &mut Lighting) {
    let direction = DVec3::new(0.9, 0.1, 0.4);
    lighting.lights.push(Light { direction, ..Light::HEADLIGHT });
}

/// Every light, and what matter makes of them.
pub(super) fn lighting_ui(ui: &mut Ui, lighting: &mut Lighting, camera: &Camera) {
    let material = lighting.clone();
    let more = ["Add light", "lights", "One more light, from the right; each adds to the others"];
    let one = |ui: &mut Ui, i, light: &mut _| {
        light_ui(ui, &format!("Light {}", i + 1), light, &material, camera)
    };
    if listed_ui(ui, &mut lighting.lights, MOST_LIGHTS, more, one) {
        add(lighting);
    }
    let shares = [
        ("Ambient", &mut lighting.ambient, "Share of the colours that is seen without any light"),
        (
            "Diffuse",
            &mut lighting.diffuse,
            "Share that scatters light evenly, brighter the more a \
          surface faces a light",
        ),
        (
            "Specular",
            &mut lighting.specular,
            "Share of the light that is mirrored: highlights in \
          the light's own colour",
        ),
    ];
    for (name, share, help) in shares {
        let slider = typed::slider(ui, name, share, 0.0..=1.0);
        slider_row(ui, name, name, slider.max_decimals(2), help);
    }
    row_ui(ui, "Specular power", |ui| {
        let slider = typed::slider(ui, "Specular power", &mut lighting.exponent, EXPONENT);
        let slider = slider.logarithmic(true).max_decimals(0);
        slider_ui(ui, "Specular power", lighting.specular > 0.0, slider)
            .on_hover_text("How small highlights are: the more, the smoother it looks")
            .on_disabled_hover_text("Nothing is mirrored: specular is 0");
    });
}

/// One light; whether it is to be removed.
fn light_ui(
    ui: &mut Ui,
    name: &str,
    light: &mut Light,
    material: &Lighting,
    camera: &Camera,
) -> bool {
    let mut removed = false;
    ui.horizontal(|ui| {
        ball_ui(ui, name, light, material, camera);
        ui.vertical(|ui| {
            ui.horizontal(|ui| {
                ui.label(name);
                let Srgb8(colour) = &mut light.colour;
                ui.color_edit_button_srgb(colour)
                    .accessible_name(format!("{name} colour"))
                    .on_hover_text("The light's colour");
                removed = remove_ui(ui, name, "Remove this light");
            });
            ui.horizontal(|ui| {
                let choices = [
                    (Attached::Camera, "With the camera", "It stays where it is on the picture"),
                    (Attached::Data, "With the data", "It turns with what is seen"),
                ];
                for (to, label, help) in choices {
                    let button = ui.selectable_label(light.attached == to, label);
                    let button = button.accessible_name(format!("{name} {}", label.to_lowercase()));
                    if button.on_hover_text(help).clicked() && light.attached != to {
                        attach(light, to, camera);
                    }
                }
            });
        });
    });
    removed
}

/// Unit vector towards a light: right, up, and from the scene to the eye.
fn in_view(light: &Light, camera: &Camera) -> DVec3 {
    let world = light.towards(camera);
    dvec3(world.dot(camera.right()), world.dot(camera.up), -world.dot(camera.direction))
}

/// Puts a light where a vector points: right, up, and from the scene to the eye.
fn put_in_view(light: &mut Light, to: DVec3, camera: &Camera) {
    light.direction = match light.attached {
        Attached::Camera => to,
        Attached::Data => camera.right() * to.x + camera.up * to.y - camera.direction * to.z,
    };
}

/// Lets a light turn with something else from where it is.
fn attach(light: &mut Light, to: Attached, camera: &Camera) {
    let from_view = in_view(light, camera);
    light.attached = to;
    put_in_view(light, from_view, camera);
}

/// A direction of the view turned as a ball of this radius would be by a hand, points.
fn turned(from_view: DVec3, by: Vec2, radius: f32) -> DVec3 {
    let (right, down) = (f64::from(by.x / radius), f64::from(by.y / radius));
    let axis = dvec3(down, right, 0.0);
    match axis.try_normalize() {
        Some(unit) => (DQuat::from_axis_angle(unit, axis.length()) * from_view).normalize(),
        None => from_view,
    }
}

/// The ball; the light is where the hand has turned it.
fn ball_ui(
    ui: &mut Ui,
    name: &str,
    light: &mut Light,
    lighting: &Lighting,
    camera: &Camera,
) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Canvas, ui.is_enabled(), name));
    let radius = SIDE / 2.0 - 4.0;
    if response.dragged() && response.drag_delta() != Vec2::ZERO {
        let to = turned(in_view(light, camera), response.drag_delta(), radius);
        put_in_view(light, to, camera);
    }
    if response.hovered() || response.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
    }
    let towards = in_view(light, camera);
    paint(ui, rect, radius, towards, light, lighting, response.hovered());
    response.on_hover_text(
        "Drag to turn the light about what is seen; the dot is where it stands, hollow where that \
         is behind",
    )
}

fn paint(
    ui: &Ui,
    rect: Rect,
    radius: f32,
    towards: DVec3,
    light: &Light,
    lighting: &Lighting,
    is_hovered: bool,
) {
    let painter = ui.painter_at(rect);
    let centre = rect.center();
    let tint = light.colour.to_linear().0;
    // As the picture lights white matter, by this light alone; a little at least, so that the ball
    // is seen.
    let lit = |normal: DVec3| {
        let falls = lighting.diffuse * normal.dot(towards).max(0.0);
        let [r, g, b] = tint.map(|channel| {
            let linear = (lighting.ambient.max(0.03) * 0.6 + falls * channel).clamp(0.0, 1.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
            let byte = (srgb_from_linear(linear) * 255.0).round() as u8;
            byte
        });
        Color32::from_rgb(r, g, b)
    };
    let mut mesh = Mesh::default();
    mesh.colored_vertex(centre, lit(DVec3::Z));
    for ring in 1..=RINGS {
        let tilt = std::f64::consts::FRAC_PI_2 * f64::from(ring) / f64::from(RINGS);
        for sector in 0..SECTORS {
            let turn = std::f64::consts::TAU * f64::from(sector) / f64::from(SECTORS);
            let normal = dvec3(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
            mesh.colored_vertex(on_ball(centre, radius, normal), lit(normal));
            let next = (sector + 1) % SECTORS;
            let outer = 1 + (ring - 1) * SECTORS;
            match ring.checked_sub(2) {
                None => mesh.add_triangle(0, outer + sector, outer + next),
                Some(before) => {
                    let inner = 1 + before * SECTORS;
                    mesh.add_triangle(inner + sector, outer + sector, outer + next);
                    mesh.add_triangle(inner + sector, outer + next, inner + next);
                }
            }
        }
    }
    painter.add(Shape::mesh(mesh));
    let edge = if is_hovered { theme::ACCENT } else { theme::LINE };
    painter.circle_stroke(centre, radius, Stroke::new(1.0, edge));
    let dot = on_ball(centre, radius, towards);
    let fill = if towards.z >= 0.0 { light_colour(light) } else { Color32::TRANSPARENT };
    painter.circle(dot, 4.0, fill, Stroke::new(2.5, Color32::from_black_alpha(170)));
    painter.circle_stroke(dot, 4.0, Stroke::new(1.2, theme::ACCENT));
}

fn light_colour(light: &Light) -> Color32 {
    let [r, g, b] = light.colour.0;
    Color32::from_rgb(r, g, b)
}

fn on_ball(centre: Pos2, radius: f32, normal: DVec3) -> Pos2 {
    #[expect(clippy::cast_possible_truncation, reason = "a place on screen")]
    let (x, y) = (normal.x as f32, normal.y as f32);
    centre + radius * vec2(x, -y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::new(DVec3::ZERO, dvec3(1.0, 2.0, -0.5), DVec3::Z, 10.0)
    }

    #[test]
    fn a_light_stays_where_it_is_when_it_turns_with_something_else() {
        let camera = camera();
        let mut light = Light::HEADLIGHT;
        let before = light.towards(&camera);
        attach(&mut light, Attached::Data, &camera);
        assert!((light.towards(&camera) - before).length() < 1e-12);
        let turned = camera.orbited(0.7, 0.2);
        assert!((light.towards(&turned) - before).length() < 1e-12, "it turns with the data");
        attach(&mut light, Attached::Camera, &turned);
        assert!((light.towards(&turned) - before).length() < 1e-12);
        assert!((light.towards(&camera) - before).length() > 0.1, "and now with the camera");
    }

    #[test]
    fn the_dot_follows_the_hand_and_a_quarter_turn_is_a_quarter_turn() {
        let right = turned(DVec3::Z, vec2(3.0, 0.0), 30.0);
        assert!(right.x > 0.09 && right.y.abs() < 1e-12, "{right}");
        let up = turned(DVec3::Z, vec2(0.0, -3.0), 30.0);
        assert!(up.y > 0.09 && up.x.abs() < 1e-12, "{up}");
        let quarter = turned(DVec3::Z, vec2(30.0 * std::f32::consts::FRAC_PI_2, 0.0), 30.0);
        assert!((quarter - DVec3::X).length() < 1e-6, "{quarter}");
        assert_eq!(turned(DVec3::X, Vec2::ZERO, 30.0), DVec3::X);
    }
}
