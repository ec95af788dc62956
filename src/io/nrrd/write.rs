//! A field as NRRD, attached and raw.

use std::fmt::Write;

use super::super::bytes::Endian;
use crate::volume::{Field, Grid};
use crate::with_samples;

/// The file's bytes: of what is not evenly spaced, as if its samples were. Numbers are as this machine has them.
pub(in crate::io) fn bytes(grid: &Grid, field: &Field) -> Vec<u8> {
    let lattice = grid.lattice_of(field);
    let [x, y, z] = lattice.dims;
    let components = field.components;
    let has_components = components > 1;
    let vector = |v: glam::DVec3| format!("({:?},{:?},{:?})", v.x, v.y, v.z);
    let axes = lattice.axes();
    let directions = [axes.x_axis, axes.y_axis, axes.z_axis].map(vector).join(" ");
    let mut header = String::from("NRRD0005\n");
    let mut line = |key: &str, value: &str| {
        // Writing to a string has no way to fail.
        let _always = writeln!(header, "{key}: {value}");
    };
    line("type", field.samples.scalar_type().name());
    line("dimension", if has_components { "4" } else { "3" });
    match grid.space.as_deref() {
        Some(space) => line("space", space),
        None => line("space dimension", "3"),
    }
    let sizes = format!("{x} {y} {z}");
    let first = if has_components { format!("{components} ") } else { String::new() };
    line("sizes", &format!("{first}{sizes}"));
    line("space directions", &format!("{}{directions}", if has_components { "none " } else { "" }));
    line("kinds", &format!("{}domain domain domain", if has_components { "vector " } else { "" }));
    line("space origin", &vector(lattice.origin));
    if let Some(unit) = &grid.unit {
        line("space units", &format!("\"{unit}\" \"{unit}\" \"{unit}\""));
    }
    line("endian", if Endian::NATIVE == Endian::Little { "little" } else { "big" });
    line("encoding", "raw");
    header.push('\n');
    let samples: &[u8] = with_samples!(&*field.samples, values => bytemuck::cast_slice(values));
    [header.as_bytes(), samples].concat()
}
