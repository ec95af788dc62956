//! What is shown of the values along a ray, isosurfaces and slices.

use eframe::egui::{Button, ComboBox, Label, RichText, Ui};

use super::lists::ListUi;
use super::splat::choice_ui;
use super::{number_ui, row_ui, slider_ui, typed};
use crate::app::{modes, theme};
use crate::core::colour::srgb_from_linear;
use crate::core::{Camera, Srgb8};
use crate::kernel::Kernel;
use crate::scene::{
    AlongRay, ClipBox, Effect, Inside, Isosurface, MOST_ISOSURFACES, MOST_SLICES, Plane, Scene,
    Slice, box_of_what_shows, plane_names, projected_range,
};
use crate::transfer::{ColourSource, Kind};
use crate::volume::{ScalarVolume, Statistics};

/// What is said of a surface that cannot be seen for matter, and of one of which little is.
const HIDDEN: [&str; 2] = [
    "Hidden inside what is opaque: fade the volume, or clip",
    "Mostly hidden inside what is opaque: fade the volume, or clip",
];
/// What isosurfaces of values of cells are.
const STEPS: &str = "Each cell has one value: isosurfaces are the faces between cells below and above theirs, in steps. Points as \
                     ellipsoids, under Data, has smooth ones";
/// So much of a surface is next to nothing.
const NEXT_TO_NOTHING: f64 = 0.05;
/// What opacities of surfaces mean.
const HIDES: &str = "How much it hides of what is behind";

/// The section. `space` is what the file calls its space.
pub fn inside_ui(ui: &mut Ui, scene: &mut Scene, space: Option<&str>) {
    let Some((volume, transfer)) = scene.volume().cloned().zip(scene.transfer().cloned()) else {
        return;
    };
    let inside = &scene.inside;
    let isosurfaces = inside.isosurfaces.iter().map(|iso| scene.little_seen_of_isosurface(iso));
    let slices = inside.slices.iter().map(|slice| scene.little_seen_of_slice(slice));
    let little_seen: [Vec<Option<f64>>; 2] = [isosurfaces.collect(), slices.collect()];
    let note_of = |kind: usize, i: usize| {
        let seen = little_seen[kind].get(i).copied().flatten()?;
        let has_more = seen > NEXT_TO_NOTHING;
        // Of an isosurface the far side and inner sheets always are behind something.
        (kind == 1 || !has_more).then_some(HIDDEN[usize::from(has_more)])
    };
    let has_any = !(inside.isosurfaces.is_empty() && inside.slices.is_empty());
    if has_any && !scene.shows_field() {
        note_ui(ui, words_without_field(scene));
    }
    let Scene { inside, camera, splat, .. } = scene;
    let Inside { along, isosurfaces, slices, .. } = inside;
    if *along != AlongRay::Composite && !(isosurfaces.is_empty() && slices.is_empty()) {
        note_ui(ui, "Isosurfaces and slices are shown where Rendering is Volume");
    } else if splat.classify.takes_one_value() && !isosurfaces.is_empty() {
        let text = format!(
            "Isosurfaces need values that are coloured pre-integrated: choose that under {}",
            modes::section(splat)
        );
        note_ui(ui, &text);
    }
    if splat.kernel == Kernel::Cells && volume.has_values_of_cells() && !isosurfaces.is_empty() {
        note_ui(ui, STEPS);
    }
    let statistics = &volume.statistics;
    let colour_at = |value: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
        let encoded =
            transfer.colour_at(value).0.map(|c| (srgb_from_linear(c) * 255.0).round() as u8);
        Srgb8(encoded)
    };
    let help = "A surface where the values pass a level, lit by the scene's lights";
    let more = ["Add isosurface", "isosurfaces", help];
    let one = |ui: &mut Ui, i, iso: &mut _| {
        let removed = isosurface_ui(ui, i, iso, statistics, &colour_at);
        note_of(0, i).into_iter().for_each(|text| note_ui(ui, text));
        removed
    };
    let is_new_isosurface = listed_ui(ui, isosurfaces, MOST_ISOSURFACES, more, one);
    let more = ["Add slice", "slices", "A plane that shows the values on it in their colours"];
    let has_cells = splat.kernel == Kernel::Cells;
    let lattice = &volume.lattice;
    let called = plane_names(lattice, space);
    let one = |ui: &mut Ui, i, slice: &mut _| {
        let removed = slice_ui(ui, (i, has_cells), slice, (&volume, called), camera);
        note_of(1, i).into_iter().for_each(|text| note_ui(ui, text));
        removed
    };
    let is_new_slice = listed_ui(ui, slices, MOST_SLICES, more, one);
    if has_any && slices.is_empty() && isosurfaces.is_empty() {
        show_again(scene);
    }
    if is_new_isosurface {
        add_isosurface(scene);
    }
    if is_new_slice {
        add_slice(scene);
    }
    if (has_any || scene.inside.is_faded) && scene.inside.along == AlongRay::Composite {
        fade_ui(ui, scene);
    }
}

/// An isosurface where matter becomes dense, of which something is seen: where the volume hides it, that is faded. None where there is
/// no field, and no more than there may be.
pub fn add_isosurface(scene: &mut Scene) {
    let Some((volume, transfer)) = scene.volume().cloned().zip(scene.transfer().cloned()) else {
        return;
    };
    if scene.inside.isosurfaces.len() == MOST_ISOSURFACES {
        return;
    }
    let new = Isosurface::first(&transfer, &volume.statistics);
    scene.inside.isosurfaces.push(new);
    // In the colour of the matter about it, it would not be told from that, hidden or not.
    if scene.can_fade() {
        scene.fade(true);
    }
}

/// A slice through the middle of what shows, all of which is seen: where the volume hides it, that is faded. None where there is no
/// field, and no more than there may be.
pub fn add_slice(scene: &mut Scene) {
    let Some((volume, transfer)) = scene.volume().cloned().zip(scene.transfer().cloned()) else {
        return;
    };
    let Scene { inside, camera, .. } = scene;
    let slices = &mut inside.slices;
    if slices.len() == MOST_SLICES {
        return;
    }
    let lattice = &volume.lattice;
    // The axis that has the fewest of them, and of these the one that is looked along most.
    let on = |axis: usize| {
        slices.iter().filter(|s| s.plane.share_across(lattice, axis).is_some()).count()
    };
    #[expect(clippy::cast_possible_truncation, reason = "of 0 to 100")]
    let beside_view = |axis: usize| {
        let normal = Slice::across(lattice, axis, 0.5, 1.0).plane.normal.normalize_or_zero();
        (100.0 * (1.0 - normal.dot(camera.direction).abs())).round() as i32
    };
    let axes = [2, 1, 0].into_iter();
    let axis = axes.min_by_key(|axis| (on(*axis), beside_view(*axis))).unwrap_or_default();
    // What shows may be a small part of the volume.
    let ClipBox { low, high } = box_of_what_shows(&volume, &transfer);
    let new = Slice::across(lattice, axis, (low[axis] + high[axis]) / 2.0, 1.0);
    slices.push(new);
    if scene.little_seen_of_slice(&new).is_some() || scene.is_opaque_body() {
        scene.fade(true);
    }
}

/// A volume that was faded for what lies in it is as dense again as it was, once nothing does.
fn show_again(scene: &mut Scene) {
    if scene.inside.is_faded && scene.vectors().is_empty() && scene.polygons().is_empty() {
        scene.fade(false);
    }
}

/// Makes the volume faint about what lies inside it, or as dense again as it was.
fn fade_ui(ui: &mut Ui, scene: &mut Scene) {
    let is_faded = scene.inside.is_faded;
    let (name, help) = match is_faded {
        true => ("Show the volume again", "Draws the volume with all of its opacities again"),
        false => (
            "Fade the volume",
            "Draws the volume with a small part of its opacities, so that what lies inside it is seen",
        ),
    };
    let fade = ui
        .add_enabled(is_faded || scene.can_fade(), Button::new(name))
        .on_hover_text(help)
        .on_disabled_hover_text("It is faint already");
    if fade.clicked() {
        scene.fade(!is_faded);
    }
}

/// Why slices and isosurfaces are not there without a field, and the way out.
fn words_without_field(scene: &Scene) -> &'static str {
    match scene.refusal_of(Effect::Clip) {
        Some(_) => {
            "Vectors without their field have neither slices nor isosurfaces: show that under Vectors"
        }
        None => {
            "A surface by itself has neither slices nor isosurfaces: show its points under Data for these"
        }
    }
}

/// What there is to know before a part is changed.
pub fn note_ui(ui: &mut Ui, text: &str) {
    ui.add(Label::new(RichText::new(text).size(12.0).color(theme::NOTE)).wrap());
}

/// Every one, by a function that tells whether it is to be removed, and a button for one more, which says what it
/// is, while there are less than `most`; whether that was pressed.
pub(super) fn listed_ui<T>(
    ui: &mut Ui,
    all: &mut Vec<T>,
    most: usize,
    [called, kind, help]: [&str; 3],
    mut one: impl FnMut(&mut Ui, usize, &mut T) -> bool,
) -> bool {
    let mut removed = None;
    for (i, item) in all.iter_mut().enumerate() {
        if one(ui, i, item) {
            removed = Some(i);
        }
    }
    if let Some(i) = removed {
        all.remove(i);
    }
    let add = ui.add_enabled(all.len() < most, Button::new(called));
    add.on_hover_text(help)
        .on_disabled_hover_text(format!("There are {most} {kind}, and no more"))
        .clicked()
}

/// A button that takes away what is called so; whether it was pressed.
pub(super) fn remove_ui(ui: &mut Ui, name: &str, help: &str) -> bool {
    let button = ui.small_button("×").accessible_name(format!("Remove {}", name.to_lowercase()));
    button.on_hover_text(help).clicked()
}

pub(super) fn opacity_ui(ui: &mut Ui, name: &str, opacity: &mut f64, help: &str) {
    row_ui(ui, "Opacity", |ui| {
        let name = format!("{name} opacity");
        let slider = typed::slider(ui, &name, opacity, 0.0..=1.0);
        slider_ui(ui, &name, true, slider.max_decimals(2)).on_hover_text(help);
    });
}

/// One isosurface; whether it is to be removed.
fn isosurface_ui(
    ui: &mut Ui,
    i: usize,
    iso: &mut Isosurface,
    statistics: &Statistics,
    colour_at: &dyn Fn(f64) -> Srgb8,
) -> bool {
    let name = format!("Isosurface {}", i + 1);
    row_ui(ui, &name, |ui| {
        let name = format!("{name} value");
        let slider = typed::slider(ui, &name, &mut iso.value, statistics.min..=statistics.max);
        slider_ui(ui, &name, true, slider)
            .on_hover_text("The value at which the surface lies, in the data's units");
    });
    opacity_ui(ui, &name, &mut iso.opacity, HIDES);
    row_ui(ui, "", |ui| {
        let mut own = iso.colour.is_some();
        let switch =
            ui.checkbox(&mut own, "Own colour").accessible_name(format!("{name} own colour"));
        if switch
            .on_hover_text("Another colour than the transfer function's of its value")
            .changed()
        {
            iso.colour = own.then(|| colour_at(iso.value));
        }
        if let Some(Srgb8(colour)) = &mut iso.colour {
            ui.color_edit_button_srgb(colour)
                .accessible_name(format!("{name} colour"))
                .on_hover_text("The surface's colour");
        }
        remove_ui(ui, &name, "Remove it")
    })
}

/// One slice, perhaps through cells, of a volume whose planes are called so; whether it is to be removed.
fn slice_ui(
    ui: &mut Ui,
    (i, has_cells): (usize, bool),
    slice: &mut Slice,
    (volume, called): (&ScalarVolume, [&str; 3]),
    camera: &Camera,
) -> bool {
    let name = format!("Slice {}", i + 1);
    let lattice = &volume.lattice;
    let across = slice.plane.axis_across(lattice);
    let removed = row_ui(ui, &name, |ui| {
        let combo = ComboBox::from_id_salt(("slice", i)).width(112.0);
        let shown =
            combo.selected_text(across.map_or("Oblique", |axis| called[axis])).show_ui(ui, |ui| {
                for (axis, label) in called.into_iter().enumerate() {
                    if ui.choice(across == Some(axis), label).clicked() {
                        slice.plane = Slice::across(lattice, axis, 0.5, 1.0).plane;
                    }
                }
                if ui.choice(false, "Across the view").clicked() {
                    slice.plane = Plane { point: lattice.centre(), normal: camera.direction };
                }
            });
        let help = "What it lies across: an axis of the volume, or the view as it is now";
        shown.response.accessible_name(format!("{name} lies")).on_hover_text(help);
        remove_ui(ui, &name, "Remove it")
    });
    row_ui(ui, "Position", |ui| {
        let label = format!("{name} position");
        match across {
            Some(axis) => {
                let share = slice.plane.share_across(lattice, axis).unwrap_or(0.5);
                if let Some(share) = place_ui(ui, &label, share, volume, axis) {
                    slice.plane = Slice::across(lattice, axis, share, 1.0).plane;
                }
            }
            None => super::clip::offset_ui(ui, &label, &mut slice.plane, lattice),
        }
    });
    opacity_ui(ui, &name, &mut slice.opacity, HIDES);
    row_ui(ui, "", |ui| {
        ui.checkbox(&mut slice.only_shown, "Hide transparent parts")
            .accessible_name(format!("{name} hides transparent parts"))
            .on_hover_text(
                "Leaves out values that the transfer function makes transparent, such as the air around a head: what \
                 lies behind is seen through them. Without it the slice shows every value in its colour",
            );
    });
    if has_cells {
        row_ui(ui, "", |ui| {
            ui.checkbox(&mut slice.edges, "Edges of cells")
                .accessible_name(format!("{name} edges of cells"))
                .on_hover_text("Lines where the slice cuts from one cell of the mesh into another");
        });
    }
    removed
}

/// Where a slice lies across an axis, at a share of the extent: the number of a sample, or a coordinate where samples have none.
/// Where it is moved to.
fn place_ui(
    ui: &mut Ui,
    label: &str,
    share: f64,
    volume: &ScalarVolume,
    axis: usize,
) -> Option<f64> {
    let Some(along) = volume.coordinates(axis) else {
        let samples = volume.lattice.dims[axis] as f64;
        let mut sample = share * samples - 0.5;
        let slider = typed::slider(ui, label, &mut sample, 0.0..=samples - 1.0);
        let moved = slider_ui(ui, label, true, slider.max_decimals(1));
        let moved = moved.on_hover_text("The number of the sample that it passes, from 0");
        return moved.changed().then_some((sample + 0.5) / samples);
    };
    let ([low, high], mut coordinate) = (along.ends, along.at(share));
    let slider =
        typed::slider(ui, label, &mut coordinate, low..=high).max_decimals(along.decimals());
    let unit = volume.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
    let slider = slider.suffix(unit);
    let moved = slider_ui(ui, label, true, slider);
    let moved = moved.on_hover_text("The coordinate that it passes, as the file has it");
    moved.changed().then(|| along.share(coordinate))
}

/// A rendering is called so, and means this, one line.
pub fn rendering_words(along: AlongRay) -> (&'static str, &'static str) {
    match along {
        AlongRay::Composite => {
            ("Volume", "Matter in its colours, each value hiding what is behind it by its opacity")
        }
        AlongRay::Maximum => (
            "Maximum (MIP)",
            "The greatest value along each line of sight, in its colour: opacities do not count",
        ),
        AlongRay::Minimum => (
            "Minimum (MinIP)",
            "The least value along each line of sight, in its colour: opacities do not count",
        ),
        AlongRay::Average => (
            "Average",
            "The mean of the values along each line of sight, in its colour, as an X-ray picture: opacities \
             do not count",
        ),
    }
}

/// Shows something else of the values along each line of sight. `first` are the colours of the first look.
pub fn choose_rendering(scene: &mut Scene, chosen: AlongRay, first: &ColourSource) {
    let before = std::mem::replace(&mut scene.inside.along, chosen);
    // Names of things keep their own colours.
    let volume = scene.volume().filter(|_| scene.splat.kernel != Kernel::Nearest);
    scene.inside.projected_range = volume.and_then(|volume| projected_range(volume, chosen));
    let is_scan = scene.volume().is_some_and(|v| Kind::of(&v.statistics).is_of_scan());
    let is_first = scene.transfer().is_some_and(|transfer| transfer.colour == *first);
    scene.inside.projected_grey = match (before, chosen) {
        (_, AlongRay::Composite) => false,
        // As colleagues know them from elsewhere, unless somebody chose colours.
        (AlongRay::Composite, _) => is_first && is_scan,
        _ => scene.inside.projected_grey,
    };
}

/// What is shown of the values along each line of sight: the first thing that a viewer is asked for.
/// `first` are the colours of the first look.
pub fn rendering_ui(ui: &mut Ui, scene: &mut Scene, first: &ColourSource) {
    let before = scene.inside.along;
    if let Some(chosen) = choice_ui(ui, "Rendering", AlongRay::ALL, before, rendering_words)
        && chosen != before
    {
        choose_rendering(scene, chosen, first);
    }
    if scene.inside.along == AlongRay::Composite {
        return;
    }
    if !scene.shows_field() {
        note_ui(
            ui,
            "Nothing is projected: no volume is shown, but surfaces, points or vectors alone",
        );
        return;
    }
    if Inside::is_shown_by(&scene.splat) {
        projected_range_ui(ui, scene);
        row_ui(ui, "", |ui| {
            ui.checkbox(&mut scene.inside.projected_grey, "In grey").on_hover_text(
                "From black to white within the range, rather than in the colours of the transfer function",
            );
        });
    } else {
        note_ui(
            ui,
            "This mode colours samples before they are put together: it shows the volume. Choose the exact mode \
             under Splats",
        );
    }
}

/// The values that the first and the last colour of a projection belong to.
fn projected_range_ui(ui: &mut Ui, scene: &mut Scene) {
    let along = scene.inside.along;
    let Some((volume, transfer)) = scene.volume().zip(scene.transfer()) else { return };
    let Statistics { min, max, .. } = volume.statistics;
    let shown = scene.inside.projected_range.unwrap_or_else(|| transfer.colour.range());
    let mut range = shown;
    let mut is_fitted = false;
    row_ui(ui, "Range", |ui| {
        let help = "Projected values have their colours between these two, in the data's units: at first from the \
                    least to the greatest that rays come to";
        for (end, name) in range.iter_mut().zip(["Range from", "Range to"]) {
            let drag = typed::number(ui, name, end, min..=max).speed(0.002 * (max - min));
            number_ui(ui, name, drag.max_decimals(3)).on_hover_text(help);
        }
        is_fitted = ui
            .button("Fit")
            .accessible_name("Fit the range")
            .on_hover_text("From the least to the greatest value that rays come to")
            .clicked();
    });
    if is_fitted {
        scene.inside.projected_range = projected_range(volume, along);
    } else if range != shown && range[0] != range[1] {
        scene.inside.projected_range = Some(range);
    }
}
