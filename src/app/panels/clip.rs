//! What is cut away of the volume: a box along its own axes, and planes.

use eframe::egui::{Button, ComboBox, Ui};
use glam::DVec3;

use super::inside::{listed_ui, note_ui, remove_ui};
use super::lists::ListUi;
use super::range::{Numbers, range_ui};
use super::{row_ui, slider_ui, switch_ui, typed};
use crate::app::modes;
use crate::core::Camera;
use crate::scene::{
    AlongRay, Clip, ClipBox, CutFaces, Effect, Inside, MOST_CLIP_PLANES, Plane, Scene,
    SplatSettings, box_of_all_that_shows, plane_names,
};
use crate::volume::Lattice;

/// The box keeps at least this share of the volume along each axis.
pub const LEAST: f64 = 0.005;

/// What the section remembers: what was switched off.
#[derive(Debug, Clone)]
pub struct ClipEditor {
    /// The box, for when it is switched on again.
    kept: Option<ClipBox>,
    /// Whether the box and the planes are drawn over the picture, with their handles.
    pub is_on_picture: bool,
}

impl Default for ClipEditor {
    fn default() -> Self {
        Self { kept: None, is_on_picture: true }
    }
}

impl ClipEditor {
    /// Forgets what belongs to one volume.
    pub fn start_over(&mut self) {
        self.kept = None;
    }
}

/// The section. `second` is the mode that the scene's is compared with, and `space` what the file calls its space.
pub fn clip_ui(
    ui: &mut Ui,
    editor: &mut ClipEditor,
    scene: &mut Scene,
    second: Option<&SplatSettings>,
    space: Option<&str>,
) {
    mode_ui(ui, scene, second);
    let lattice = scene.lattice();
    box_ui(ui, editor, scene);
    let Scene { inside, camera, .. } = scene;
    let Inside { clip, along, .. } = inside;
    planes_ui(ui, clip, &normals(&lattice, camera, space), &lattice);
    let mut coloured = clip.faces == CutFaces::Coloured;
    ui.horizontal(|ui| {
        let has_faces = clip.cuts() && *along == AlongRay::Composite;
        let faces = ui.add_enabled_ui(has_faces || coloured, |ui| {
            switch_ui(ui, &mut coloured, "Coloured faces")
                .on_hover_text(
                    "Where matter is cut, show its value in its colour instead of what lies behind",
                )
                .on_disabled_hover_text(
                    "Nothing is cut, or Rendering is not Volume, which alone has faces",
                )
        });
        if faces.inner.changed() {
            clip.faces = if coloured { CutFaces::Coloured } else { CutFaces::Through };
        }
        let reset = ui.add_enabled(*clip != Clip::default(), Button::new("Reset"));
        let reset = reset
            .accessible_name("Reset clip")
            .on_hover_text("Back to all of the volume")
            .on_disabled_hover_text("Nothing is cut");
        if reset.clicked() {
            *clip = Clip::default();
            editor.start_over();
        }
    });
}

/// What modes do not show it, and the way out.
fn mode_ui(ui: &mut Ui, scene: &mut Scene, second: Option<&SplatSettings>) {
    if scene.inside.is_plain() {
        return;
    }
    if !scene.shows_field() {
        let text = match scene.refusal_of(Effect::Clip) {
            Some(_) => {
                "Vectors without their field are drawn whole: show that under Vectors, to see inside"
            }
            None => {
                "A surface by itself is cut, and has neither slices nor isosurfaces: show its points under Data for these"
            }
        };
        note_ui(ui, text);
    }
    if !Inside::is_shown_by(&scene.splat) {
        note_ui(
            ui,
            "This mode cannot cut matter, nor show isosurfaces and slices: it draws all of the volume",
        );
        let button =
            ui.button("Use the exact mode").accessible_name("Use the exact mode to see inside");
        if button
            .on_hover_text("Values are interpolated first, and coloured then: those can be cut")
            .clicked()
        {
            scene.splat = modes::with_unit_distance_of(SplatSettings::EXACT, &scene.splat);
        }
    } else if second.is_some_and(|mode| !Inside::is_shown_by(mode)) {
        note_ui(ui, "The second mode cannot cut matter: it shows all of the volume");
    }
}

/// A box that nobody has moved yet: about all that shows, so that nothing of it is cut and the handles lie at its sides.
fn fresh_box(scene: &Scene) -> ClipBox {
    let field = scene.volume().zip(scene.transfer()).filter(|_| scene.shows_field());
    field.map_or(ClipBox::WHOLE, |(volume, transfer)| box_of_all_that_shows(volume, transfer))
}

impl ClipEditor {
    /// Switches the box on, where it was or about all that shows, or off.
    pub fn toggle_box(&mut self, scene: &mut Scene) {
        match scene.inside.clip.bounds.take() {
            Some(bounds) => self.kept = Some(bounds),
            None => {
                let bounds = self.kept.take().unwrap_or_else(|| fresh_box(scene));
                scene.inside.clip.bounds = Some(bounds);
            }
        }
    }
}

fn box_ui(ui: &mut Ui, editor: &mut ClipEditor, scene: &mut Scene) {
    let clip = &scene.inside.clip;
    let mut on = clip.bounds.is_some();
    ui.horizontal(|ui| {
        let switch = ui.checkbox(&mut on, "Clip box");
        if switch.on_hover_text("Keep a part of the volume along its own axes").changed() {
            editor.toggle_box(scene);
        }
        if scene.inside.clip.cuts() || scene.inside.clip.bounds.is_some() {
            ui.checkbox(&mut editor.is_on_picture, "On the picture").on_hover_text(
                "Draw the box and the planes over the picture: handles on the box's faces and on each plane move them",
            );
        }
    });
    let volume = scene.volume().cloned();
    if let Some(ClipBox { low, high }) = &mut scene.inside.clip.bounds {
        for (a, name) in ["Along x", "Along y", "Along z"].into_iter().enumerate() {
            let along = volume.as_deref().and_then(|volume| volume.coordinates(a));
            let unit = volume.as_deref().and_then(|volume| volume.unit.as_deref());
            let (numbers, help) = match along {
                Some(along) => (
                    Numbers::Coordinates(along, unit),
                    "Where the box begins and ends along this axis: coordinates as the file has them",
                ),
                None => (
                    Numbers::Percent,
                    "Where the box begins and ends along this axis of the volume: 0% is its first sample, 100% its last",
                ),
            };
            range_ui(ui, (name, &numbers), [&mut low[a], &mut high[a]], LEAST, help);
        }
    }
}

fn planes_ui(ui: &mut Ui, clip: &mut Clip, offered: &Normals, lattice: &Lattice) {
    let help =
        "Cut away what lies between the eye and the middle of the volume; then turn and move it";
    let more = ["Add clip plane", "planes", help];
    let one = |ui: &mut Ui, i, plane: &mut _| {
        plane_ui(ui, &format!("Plane {}", i + 1), plane, lattice, offered)
    };
    if listed_ui(ui, &mut clip.planes, MOST_CLIP_PLANES, more, one) {
        let (_, normal) = offered[3];
        clip.planes.push(plane_through_middle(lattice, normal));
    }
}

fn plane_through_middle(lattice: &Lattice, normal: DVec3) -> Plane {
    Plane { point: lattice.centre(), normal }
}

/// A plane through the middle that cuts away what lies before it.
pub fn add_plane(scene: &mut Scene) {
    let plane = plane_through_middle(&scene.lattice(), scene.camera.direction);
    scene.inside.clip.planes.push(plane);
}

/// The normals on offer: what planes across them are called, and towards where. The last is the view's.
type Normals = [(&'static str, DVec3); 4];

fn normals(lattice: &Lattice, camera: &Camera, space: Option<&str>) -> Normals {
    let axes = lattice.axes();
    let across = |a: DVec3, b: DVec3| a.cross(b).normalize_or_zero();
    let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis];
    // Faces of the lattice, which need not be square to its axes; towards growing indices.
    let towards = |normal: DVec3, axis: DVec3| normal * normal.dot(axis).signum();
    let called = plane_names(lattice, space);
    [
        (called[0], towards(across(y, z), x)),
        (called[1], towards(across(z, x), y)),
        (called[2], towards(across(x, y), z)),
        ("Across the view", camera.direction),
    ]
}

/// Half of what a lattice extends along a unit vector, world units.
fn half_extent(lattice: &Lattice, along: DVec3) -> f64 {
    let half = DVec3::from(lattice.dims.map(|n| n as f64)) / 2.0;
    (lattice.axes().transpose() * along).abs().dot(half)
}

/// One plane; whether it is to be removed.
fn plane_ui(
    ui: &mut Ui,
    name: &str,
    plane: &mut Plane,
    lattice: &Lattice,
    offered: &Normals,
) -> bool {
    let normal = plane.normal.normalize_or_zero();
    let removed = row_ui(ui, name, |ui| {
        let is_along = |other: DVec3| normal.dot(other).abs() > 1.0 - 1e-9;
        let now = offered.iter().find(|(_, other)| is_along(*other));
        let combo = ComboBox::from_id_salt(("normal of", name)).width(112.0);
        let shown =
            combo.selected_text(now.map_or("Oblique", |(label, _)| label)).show_ui(ui, |ui| {
                for &(label, other) in offered {
                    if ui.choice(is_along(other), label).clicked() {
                        plane.normal = other;
                        plane.point = lattice.centre();
                    }
                }
            });
        let help = "What it lies across: an axis of the volume, or the view as it is now";
        shown.response.accessible_name(format!("{name} lies")).on_hover_text(help);
        let flip = ui.small_button("Flip").accessible_name(format!("Flip {}", name.to_lowercase()));
        if flip.on_hover_text("Keep the other side").clicked() {
            plane.normal = -plane.normal;
        }
        remove_ui(ui, name, "Remove this plane")
    });
    row_ui(ui, "Position", |ui| offset_ui(ui, &format!("{name} offset"), plane, lattice));
    removed
}

/// Where a plane lies along its normal.
pub(super) fn offset_ui(ui: &mut Ui, label: &str, plane: &mut Plane, lattice: &Lattice) {
    let normal = plane.normal.normalize_or_zero();
    let half = half_extent(lattice, normal);
    let middle = lattice.centre();
    let mut share = (plane.point - middle).dot(normal) / half * 100.0;
    if share.abs() < 0.05 {
        // Not as −0.
        share = 0.0;
    }
    let slider = typed::slider(ui, label, &mut share, -100.0..=100.0);
    let moved = slider_ui(ui, label, true, slider.suffix("%").max_decimals(1));
    let help = "How far it lies from the middle of the volume, of the way to its end";
    if moved.on_hover_text(help).changed() {
        plane.point = middle + normal * (share / 100.0 * half);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stand_on_the_lattices_faces_and_planes_reach_its_ends() {
        let lattice = Lattice {
            spacing: DVec3::new(1.0, 2.0, 0.5),
            direction: glam::DMat3::from_cols(
                DVec3::X,
                DVec3::new(0.4, 0.9, 0.0).normalize(),
                DVec3::NEG_Z,
            ),
            ..Lattice::unit([8, 6, 10])
        };
        let camera = Camera::new(DVec3::ZERO, DVec3::new(0.3, 0.4, 0.5), DVec3::Z, 1.0);
        let axes = lattice.axes();
        for (i, (name, normal)) in normals(&lattice, &camera, None).into_iter().take(3).enumerate()
        {
            assert!((normal.length() - 1.0).abs() < 1e-12, "{name}");
            for j in 0..3 {
                let along = normal.dot(axes.col(j));
                assert!(if i == j { along > 0.1 } else { along.abs() < 1e-12 }, "{name} {j}");
            }
            // From one face of the lattice to the other.
            let thick = axes.col(i).dot(normal) * lattice.dims[i] as f64;
            assert!((2.0 * half_extent(&lattice, normal) - thick).abs() < 1e-9, "{name}");
        }
    }
}
