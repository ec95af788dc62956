//! Polygons in the side panel: dropped, shown, changed, removed, taken back; and those made of vectors.

use std::sync::Arc;

use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use voxsplat::app::document::Source;
use voxsplat::app::settings::Settings;
use voxsplat::core::Srgb8;
use voxsplat::polygons::{Mesh, MeshValues};
use voxsplat::scene::{Layer, Look, PolygonLook, Sampled, Scene};
use voxsplat::transfer::{ColourMap, ColourSource, Design, TransferFunction};

use super::press;
use crate::ui_support::Bench;

/// A mesh of the scene, drawn or not.
#[derive(Debug)]
struct Shown {
    mesh: Arc<Mesh>,
    look: PolygonLook,
    is_shown: bool,
}

/// A mesh that is made again is another one, though its triangles are the same.
impl PartialEq for Shown {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
            && (self.look, self.is_shown) == (other.look, other.is_shown)
    }
}

impl Shown {
    fn all_of(scene: &Scene) -> Vec<Self> {
        let mesh = |layer: &Layer| match (&layer.look, scene.store.get(&layer.source)?) {
            (Look::Polygons(look), Sampled::Mesh(mesh)) => {
                Some(Self { mesh: Arc::clone(mesh), look: *look, is_shown: layer.is_shown })
            }
            _ => None,
        };
        scene.layers.iter().filter_map(mesh).collect()
    }
}

/// What the engine is asked to draw.
fn layers(bench: &Bench) -> Vec<Shown> {
    let scene = bench.window().scene().expect("something is open");
    assert!(bench.last_request().scene.makes_same_picture(scene), "what is chosen is asked for");
    Shown::all_of(scene)
}

fn dropped(bench: &mut Bench, name: &str, text: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    let before = (layers(bench).len(), bench.window().notices().shown().len());
    bench.drop_file(path.to_str().expect("UTF-8"));
    bench.wait_until(|window| {
        let count = window.scene().map_or(0, |scene| Shown::all_of(scene).len());
        (count, window.notices().shown().len()) != before
    });
    bench.settle();
}

const FILE_OF_LABELS: &str = "A segmentation of this volume, in any format that volumes have";
const TRIANGLE: &str = "v 1 1 1\nv 3 1 1\nv 1 3 2\nf 1 2 3\n";

#[test]
fn a_dropped_mesh_is_embedded_changed_and_taken_back() {
    let mut bench = Bench::opened();
    dropped(&mut bench, "fibre.obj", TRIANGLE);
    let document = bench.window().document().expect("still open").source.name();
    assert_ne!(document, "fibre.obj", "the volume stays");
    let [layer] = &layers(&bench)[..] else { panic!("one mesh") };
    assert_eq!((layer.mesh.name(), layer.mesh.len(), layer.look.opacity), ("fibre.obj", 1, 1.0));
    bench.set_slider("Mesh 1 opacity", 0.5);
    bench.harness.get_by_role_and_label(Role::CheckBox, "Mesh 1 one colour").click();
    bench.settle();
    bench.harness.get_by_role_and_label(Role::CheckBox, "Mesh 1 shown").click();
    bench.settle();
    let found = &layers(&bench)[0];
    assert!(found.look.opacity == 0.5 && found.look.colour.is_some() && !found.is_shown);
    bench.harness.check_accessibility();
    press(&mut bench, "Remove mesh 1");
    assert!(layers(&bench).is_empty());
    for _ in 0..2 {
        bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        bench.settle();
    }
    assert!(layers(&bench)[0].is_shown, "each change was a step");
    dropped(&mut bench, "broken.obj", "v 1 1 1\n");
    let said = bench.window().notices().shown().last().expect("an error").text.clone();
    assert!(said.contains("at least one triangle") && said.contains("broken.obj"), "{said}");
    assert_eq!(layers(&bench).len(), 1);
}

#[test]
fn a_mesh_takes_the_colours_of_the_field_that_it_lies_in() {
    let mut bench = Bench::opened();
    dropped(&mut bench, "fibre.obj", TRIANGLE);
    bench.choose("Mesh 1 colour by", "The field");
    let is_coloured = |scene: &Scene| scene.polygons()[0].field_colours.is_some();
    bench.wait_until(|window| window.scene().is_some_and(is_coloured));
    bench.settle();
    assert!(layers(&bench)[0].look.by_field && !bench.shows("Mesh 1 one colour"));
    let scene = bench.last_request().scene;
    let layer = scene.polygons().remove(0);
    let volume = scene.volume().expect("a field");
    assert_eq!(layer.field_colours.as_ref(), scene.transfer().map(|transfer| &transfer.colour));
    assert_eq!(layer.mesh.arrays()[0].name, volume.name);
    // Its corners are samples, through which splines pass.
    let MeshValues::Corners(values) = &layer.mesh.arrays()[0].values else { panic!("at corners") };
    let most = 1e-4 * (volume.statistics.max - volume.statistics.min);
    for (place, value) in layer.mesh.places().into_iter().zip(values).take(3) {
        let off = (volume.value_at(place) - f64::from(*value)).abs();
        assert!(off <= most, "{place}: {value}");
    }
    assert!(layer.mesh.len() > 1, "its edges were longer than a sample");
    // What was found is no step of its own.
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert!(!layers(&bench)[0].look.by_field);
    assert!(bench.last_request().scene.polygons()[0].field_colours.is_none());
    bench.choose("Mesh 1 colour by", "The field");
    bench.wait_until(|window| window.scene().is_some_and(is_coloured));
    bench.choose("Mesh 1 colour by", "Nothing");
    bench.settle();
    assert!(!layers(&bench)[0].look.by_field && bench.shows("Mesh 1 one colour"));
}

#[test]
fn a_first_view_takes_in_what_reaches_beyond_the_volume_and_a_moved_one_stays() {
    let mut bench = Bench::opened();
    let first = bench.camera();
    dropped(&mut bench, "fibre.obj", TRIANGLE);
    assert_eq!(bench.camera(), first, "it is in sight");
    dropped(&mut bench, "large.obj", "v 1 1 1\nv 60 1 1\nv 1 60 2\nf 1 2 3\n");
    let wide = bench.camera();
    assert!(wide.parallel_scale > 2.0 * first.parallel_scale, "{wide:?}");
    assert_eq!(wide.direction, first.direction);
    bench.drag(PointerButton::Primary, Modifiers::NONE, vec2(40.0, 30.0));
    bench.settle();
    let turned = bench.camera();
    assert_ne!(turned, wide);
    dropped(&mut bench, "larger.obj", "v 1 1 1\nv 90 1 1\nv 1 90 2\nf 1 2 3\n");
    assert_eq!(bench.camera(), turned, "the view is the hand's");
}

/// As `voxsplat fibre.obj good.nrrd other.nrrd` begins.
#[test]
fn a_mesh_that_the_window_starts_with_is_embedded_in_the_volume() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fibre.obj");
    std::fs::write(&path, TRIANGLE).expect("written");
    let start = |volume: &str| {
        let mut bench = Bench::empty();
        let ctx = bench.harness.ctx.clone();
        let sources = [path.clone(), volume.into(), "other.nrrd".into()].map(Source::File);
        bench.harness.state_mut().open_all(&ctx, sources.into());
        bench.wait_until(|window| !window.is_loading());
        bench
    };
    let mut bench = start("good.nrrd");
    bench.wait_until(|window| window.scene().is_some_and(|scene| !scene.polygons().is_empty()));
    bench.settle();
    assert_eq!(layers(&bench)[0].mesh.name(), "fibre.obj");
    assert_eq!(bench.window().document().expect("open").source.name(), "good.nrrd");
    let said: Vec<&str> =
        bench.window().notices().shown().iter().map(|notice| notice.text.as_str()).collect();
    let is_told = said.iter().any(|text| text.contains("Not opened: other.nrrd"));
    let is_hidden = said.iter().any(|text| text.starts_with("The volume hides"));
    assert!(said.len() == 2 && is_told && is_hidden, "{said:?}");
    let bench = start("bad.nrrd");
    let said = bench.window().notices().shown().last().expect("a note").text.clone();
    assert!(said.starts_with("Left out") && said.ends_with("fibre.obj"), "{said}");
}

#[test]
fn streamlines_and_arrows_of_vectors_become_meshes() {
    let mut bench = Bench::empty();
    bench.open("vector.nrrd");
    bench.settle();
    bench.harness.get_by_label("Streamlines and arrows").click();
    bench.settle();
    for (button, name, count) in [
        ("Make arrows", "arrows", 1),
        ("Make streamlines", "streamlines", 2),
        ("Make arrows", "arrows", 2),
    ] {
        let before = layers(&bench);
        press(&mut bench, button);
        bench.wait_until(|window| {
            window.scene().is_some_and(|scene| Shown::all_of(scene) != before)
        });
        bench.settle();
        let names: Vec<_> = layers(&bench).iter().map(|l| l.mesh.name().to_owned()).collect();
        assert!(names.len() == count && names.iter().any(|n| n == name), "{names:?}");
    }
}

/// In matter that hides them nothing would be seen of what was just made.
#[test]
fn streamlines_and_arrows_in_opaque_matter_fade_it_and_say_so() {
    let made_in = |opacity: f64, button: &str| {
        let mut bench = Bench::with_wind();
        let colour = ColourSource::Map { map: ColourMap::Gray, range: [0.0, 511.0] };
        let of = TransferFunction::of(vec![(0.0, opacity), (511.0, opacity)], colour);
        bench.harness.event(Event::Paste(Design::from(of).to_text()));
        bench.harness.run_steps(3);
        bench.harness.get_by_label("Streamlines and arrows").click();
        bench.settle();
        assert!(bench.window().scene().expect("open").shows_field());
        // Through the middle of the matter.
        bench.choose("Seeded", "On a plane");
        press(&mut bench, button);
        bench.wait_until(|window| window.scene().is_some_and(|s| !Shown::all_of(s).is_empty()));
        bench.settle();
        assert_eq!(layers(&bench).len(), 1);
        bench
    };
    let told = |bench: &Bench| {
        let shown = bench.window().notices().shown();
        shown.iter().find(|notice| notice.text.contains("would hide")).map(|n| n.text.clone())
    };
    for (button, name) in [("Make streamlines", "streamlines"), ("Make arrows", "arrows")] {
        let thin = made_in(0.005, button);
        assert!(!thin.window().scene().expect("open").inside.is_faded, "{name}");
        assert_eq!(told(&thin), None, "{name}");
        let mut dense = made_in(1.0, button);
        assert!(dense.window().scene().expect("open").inside.is_faded, "{name}");
        let said = told(&dense).expect("it is told");
        assert!(said.contains(name), "{said}");
        // What it offers shows the matter again, and the lines stay.
        let button = dense.harness.get_all_by_label("Show the volume again").next();
        button.expect("on the notice").click();
        dense.settle();
        assert!(!dense.window().scene().expect("open").inside.is_faded, "{name}");
        assert_eq!(layers(&dense).len(), 1);
    }
}

#[test]
fn streamlines_are_seeded_on_a_plane_a_line_or_about_a_point() {
    let mut bench = Bench::empty();
    bench.open("vector.nrrd");
    bench.settle();
    bench.harness.get_by_label("Streamlines and arrows").click();
    bench.settle();
    bench.choose("Seeded", "On a line");
    // Vectors stand at 0 to 7 along each axis: lines begin in the middle.
    bench.set_slider("From y", 1.0);
    bench.set_slider("To y", 1.0);
    bench.set_slider("Streamlines", 5.0);
    let mut boxes = Vec::new();
    for place in ["On a line", "About a point", "On a plane"] {
        bench.choose("Seeded", place);
        let before = layers(&bench);
        press(&mut bench, "Make streamlines");
        bench.wait_until(|window| {
            window.scene().is_some_and(|scene| Shown::all_of(scene) != before)
        });
        bench.settle();
        boxes.push(layers(&bench)[0].mesh.bounds());
    }
    assert!(boxes[0] != boxes[1] && boxes[1] != boxes[2], "{boxes:?}");
}

#[test]
fn what_was_added_is_in_sight_though_its_section_is_closed_at_first() {
    let mut bench = Bench::with_settings(Settings::default());
    bench.open("good.nrrd");
    bench.settle();
    assert!(!bench.shows("Add polygons…"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("labels.nrrd");
    let text = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 1 1\nencoding: ascii\n\n1 0 7\n";
    std::fs::write(&path, text).expect("written");
    bench.harness.get_by_label("Add").click();
    bench.harness.run_steps(2);
    bench.harness.get_by_label("Labels…").click();
    bench.harness.run_steps(3);
    bench.harness.get_by_label(FILE_OF_LABELS).type_text(path.to_str().expect("UTF-8"));
    bench.settle();
    press(&mut bench, "Add");
    bench.wait_until(|window| window.scene().is_some_and(|scene| Shown::all_of(scene).len() == 2));
    bench.settle();
    assert!(bench.shows("Label 7") && bench.shows("Add polygons…"));
}

#[test]
fn labels_that_the_volume_hides_are_said_to_be_hidden_and_seen_once_it_is_faded() {
    let mut bench = Bench::opened();
    let folder = tempfile::tempdir().expect("a folder");
    let mut add = |name: &str, is_label: fn(usize) -> bool| {
        let path = folder.path().join(name);
        let values = (0..512).map(|i| if is_label(i) { "1 " } else { "0 " });
        let head = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nencoding: ascii\n\n";
        let text: String = std::iter::once(head).chain(values).collect();
        std::fs::write(&path, text).expect("written");
        press(&mut bench, "Add labels…");
        bench.harness.get_by_label(FILE_OF_LABELS).type_text(path.to_str().expect("UTF-8"));
        bench.settle();
        press(&mut bench, "Add");
        bench.wait_until(|window| {
            window
                .notices()
                .shown()
                .iter()
                .any(|notice| notice.text.ends_with(&format!("surfaces: {name}")))
        });
        bench.settle();
        let notices = bench.window().notices().shown();
        notices.iter().any(|notice| notice.text.starts_with("The volume hides"))
    };
    // The uppermost layer, and two voxels in the middle.
    assert!(!add("above.nrrd", |i| i >= 448));
    assert!(add("within.nrrd", |i| i % 8 == 4 && i / 8 % 8 == 4 && (3..5).contains(&(i / 64))));
    press(&mut bench, "Fade the volume");
    assert!(bench.last_request().scene.inside.is_faded);
    assert!(!bench.tells("The volume hides"), "it has been done");
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert!(!bench.last_request().scene.inside.is_faded);
}

#[test]
fn labels_are_added_by_their_path_shown_by_name_and_removed_together() {
    let mut bench = Bench::opened();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("labels.nrrd");
    let text = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 1 1\nencoding: ascii\nSegment0_Name:=heart\n\
                Segment0_LabelValue:=1\nSegment0_Color:=1 0 0\n\n1 0 7\n";
    std::fs::write(&path, text).expect("written");
    let add = |bench: &mut Bench, path: &str| {
        press(bench, "Add labels…");
        bench.harness.get_by_label(FILE_OF_LABELS).type_text(path);
        bench.settle();
        press(bench, "Add");
    };
    add(&mut bench, path.to_str().expect("UTF-8"));
    bench.wait_until(|window| window.scene().is_some_and(|scene| Shown::all_of(scene).len() == 2));
    bench.settle();
    let names = |bench: &Bench| {
        layers(bench).iter().map(|layer| layer.mesh.name().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names(&bench), ["heart", "Label 7"]);
    let looks = layers(&bench);
    assert_eq!(looks[0].look.colour, Some(Srgb8([255, 0, 0])));
    assert!(looks[1].look.colour.is_some_and(|colour| colour != Srgb8([255, 0, 0])));
    bench.harness.check_accessibility();
    bench.harness.get_by_role_and_label(Role::CheckBox, "Label 7 shown").click();
    bench.settle();
    assert_eq!(layers(&bench).iter().map(|l| l.is_shown).collect::<Vec<_>>(), [true, false]);
    bench.harness.get_by_role_and_label(Role::CheckBox, "All labels shown").click();
    bench.settle();
    assert!(layers(&bench).iter().all(|layer| layer.is_shown));
    bench.set_slider("Labels opacity", 0.25);
    assert!(layers(&bench).iter().all(|layer| layer.look.opacity == 0.25));
    press(&mut bench, "Remove labels");
    assert!(layers(&bench).is_empty());
    bench.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    bench.settle();
    assert_eq!(layers(&bench).len(), 2, "one step");
    std::fs::write(&path, text.replace("1 0 7", "1 0 300")).expect("written");
    add(&mut bench, path.to_str().expect("UTF-8"));
    bench.wait_until(|window| {
        window.notices().shown().iter().any(|n| n.text.contains("labels.nrrd"))
    });
    assert_eq!(layers(&bench).len(), 2, "what cannot be read changes nothing");
    press(&mut bench, "Add labels…");
    let typed = bench.harness.get_by_label(FILE_OF_LABELS).accesskit_node().value();
    assert_eq!(typed.as_deref(), path.to_str(), "it is there to be corrected");
    std::fs::write(&path, text).expect("written");
    // What was bad news has been read meanwhile.
    bench.harness.run_steps(400);
    press(&mut bench, "Add");
    bench.wait_until(|window| window.scene().is_some_and(|scene| Shown::all_of(scene).len() == 4));
    bench.settle();
    assert!(!bench.tells("300"), "and goes once it went well");
}
