//! OBJ, read by `tobj`: positions, normals and colours of corners, and faces of all objects together.
//! Materials are other files, and not looked for.

use std::io::BufReader;

use glam::{DVec3, Vec3};

use super::{Parts, Watched, corrupt};
use crate::core::Srgb8;
use crate::core::progress::Ticket;
use crate::io::error::{Problem, quoted};

pub(super) fn read(bytes: Vec<u8>, ticket: &Ticket) -> Result<Parts, Problem> {
    let mut reader = BufReader::new(Watched::new(bytes, ticket));
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    // None is read: those of a file that is not there would be an error.
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, no_materials).map_err(|error| {
        corrupt(
            "an OBJ file that can be read",
            quoted(&error.to_string()),
            "the file is damaged, or of another format: write it again",
        )
    })?;
    let mut parts = Parts::default();
    let meshes = || models.iter().map(|model| &model.mesh);
    // Each object may have them or not.
    let have_normals = meshes().all(|mesh| mesh.normals.len() == mesh.positions.len());
    let have_colours = meshes().all(|mesh| mesh.vertex_color.len() == mesh.positions.len());
    for mesh in meshes() {
        let first = parts.positions.len() as u32;
        let places =
            |flat: &[f64]| -> Vec<DVec3> { flat.chunks_exact(3).map(DVec3::from_slice).collect() };
        let vectors =
            |flat: &[f64]| -> Vec<Vec3> { places(flat).into_iter().map(DVec3::as_vec3).collect() };
        parts.positions.extend(places(&mesh.positions));
        if have_normals {
            parts.normals.extend(vectors(&mesh.normals));
        }
        if have_colours {
            parts.colours.extend(vectors(&mesh.vertex_color).into_iter().map(encoded));
        }
        let corners = mesh.indices.chunks_exact(3);
        parts.triangles.extend(corners.map(|c| [first + c[0], first + c[1], first + c[2]]));
    }
    Ok(parts)
}

/// Programs write such colours as they are shown, in 0..=1.
fn encoded(colour: Vec3) -> Srgb8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=255")]
    let byte = |c: f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
    Srgb8(colour.to_array().map(byte))
}
