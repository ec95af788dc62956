//! The polygons of a file that is opened by itself and has nothing else.

use std::sync::Arc;

use super::flags::SceneFlags;
use super::open::Input;
use super::{Failure, note};
use crate::core::{Camera, Ticket};
use crate::io;
use crate::polygons::Mesh;
use crate::scene::{ByArray, Look, PolygonLayer, PolygonLook, Scene, framing_surfaces};
use crate::transfer::ColourSource;
use crate::transfer::presets::{self, RangeRule};
use crate::volume::{Component, Field, Shape};

/// The polygons; `None` of files that have anything else.
pub(super) fn of(input: &Input, flags: &SceneFlags) -> Result<Option<Mesh>, Failure> {
    let drawn = drawn(input, flags)?;
    let opened =
        io::mesh::surface_of(&input.path, &input.grid, drawn, &input.warnings, &Ticket::new());
    let Some(opened) = opened.map_err(Failure::failed)? else { return Ok(None) };
    refuse_opacities(input, flags)?;
    opened.warnings.iter().for_each(|warning| note(warning));
    Ok(Some(opened.mesh))
}

/// What is shown of a file in place of a field.
fn noun(input: &Input) -> &'static str {
    match &input.grid.shape {
        Shape::Unstructured(cells) if !cells.is_surface() => {
            let is_of_colours = |field: &Field| {
                io::mesh::drawn_name(field, Component::usual(field.components)).is_none()
            };
            match input.grid.fields.iter().any(is_of_colours) {
                true => "points in their own colours",
                false => "points, each as a small body",
            }
        }
        _ => "a surface by itself",
    }
}

/// Refuses what says how much of each value is seen, which surfaces and points show whole.
fn refuse_opacities(input: &Input, flags: &SceneFlags) -> Result<(), Failure> {
    let given = [(flags.opacity.is_some(), "--opacity"), (flags.transfer.is_some(), "--transfer")];
    let Some((_, flag)) = given.into_iter().find(|(is_given, _)| *is_given) else { return Ok(()) };
    Err(Failure::Usage(format!(
        "expected a field of values with {flag}, found {}, without opacities by value; add --kernel ellipsoids, which draws \
         points by their values, or leave {flag} out",
        noun(input)
    )))
}

/// Shows them in place of the field, from the same side.
pub(super) fn show(scene: &mut Scene, input: &Input, mesh: Mesh) {
    scene.add(input.source(mesh.name()), PolygonLayer::new(Arc::new(mesh)));
    scene.show_field(false);
    let Camera { direction, up, .. } = scene.camera;
    scene.camera = framing_surfaces(scene, direction, up).unwrap_or(scene.camera);
}

/// Gives them the colours of the field.
pub(super) fn colour(scene: &mut Scene, input: &Input, flags: &SceneFlags) -> Result<(), Failure> {
    let (field, component) = drawn(input, flags)?;
    let name = io::mesh::drawn_name(field, component);
    let map = match scene.transfer().map(|transfer| &transfer.colour) {
        Some(ColourSource::Map { map, .. }) => *map,
        _ => {
            refuse_stops(input, flags)?;
            ByArray::FIRST_MAP
        }
    };
    // No outlier decides their colours.
    let usual = scene.volume().map(|v| presets::range(&v.statistics, RangeRule::Percentiles));
    let own = scene.polygons().into_iter().next();
    let of = |own: PolygonLayer| {
        PolygonLayer::of_surface(own.mesh, name.as_deref(), map, flags.color_range.or(usual))
    };
    let look = own.map(|own| of(own).look);
    if let (Some(PolygonLook { by: None, .. }), Some(flag)) = (look, flags.of_colours()) {
        return Err(Failure::Usage(format!(
            "expected numbers to colour by with {flag}, found {} and no number of it chosen; choose a field of numbers with \
             --field, where `voxsplat info` tells of one, or leave {flag} out",
            noun(input)
        )));
    }
    for layer in &mut scene.layers {
        if let (Look::Polygons(old), Some(look)) = (&mut layer.look, look) {
            *old = look;
        }
    }
    Ok(())
}

/// Refuses colours at single values, of which surfaces have none: theirs run along a map.
fn refuse_stops(input: &Input, flags: &SceneFlags) -> Result<(), Failure> {
    let given = [(flags.color.is_some(), "--color"), (flags.preset.is_some(), "--preset")];
    let Some((_, flag)) = given.into_iter().find(|(is_given, _)| *is_given) else { return Ok(()) };
    Err(Failure::Usage(format!(
        "expected --colormap for the colours of a file's polygons and points, found {flag} with {}; choose a \
         colour map, or add --kernel ellipsoids, which draws points by their values",
        noun(input)
    )))
}

/// Which number of which field is asked for.
fn drawn<'a>(input: &'a Input, flags: &SceneFlags) -> Result<(&'a Field, Component), Failure> {
    let field = input.field(flags.field.as_deref());
    let field = field.map_err(|error| Failure::Failed(input.about(&error.to_string())))?;
    Ok((field, flags.component.unwrap_or(Component::usual(field.components))))
}
