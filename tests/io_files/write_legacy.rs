//! Small valid files of legacy VTK, written plainly and apart from the reader.

use std::path::{Path, PathBuf};

use voxsplat::volume::ScalarType;

use crate::write::{Volume, coordinate, point, save};

/// How legacy VTK is stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legacy {
    /// By VTK's name.
    pub(crate) dataset: &'static str,
    /// `SCALARS`, `VECTORS` or `FIELD`; the volume's components must fit.
    pub(crate) role: &'static str,
    pub(crate) binary: bool,
    pub(crate) cells: bool,
    /// With everything that is read over: metadata, tables, strings, further fields.
    pub(crate) extras: bool,
}

pub(crate) const DATASETS: [&str; 3] = ["STRUCTURED_POINTS", "RECTILINEAR_GRID", "STRUCTURED_GRID"];
pub(crate) const ROLES: [&str; 3] = ["SCALARS", "VECTORS", "FIELD"];

fn word(scalar_type: ScalarType) -> &'static str {
    match scalar_type {
        ScalarType::UInt8 => "unsigned_char",
        ScalarType::Int8 => "char",
        ScalarType::UInt16 => "unsigned_short",
        ScalarType::Int16 => "short",
        ScalarType::UInt32 => "unsigned_int",
        ScalarType::Int32 => "INT",
        ScalarType::UInt64 => "unsigned_long",
        ScalarType::Int64 => "vtktypeint64",
        ScalarType::Float32 => "Float",
        ScalarType::Float64 => "double",
    }
}

/// The file so far.
struct Writer {
    bytes: Vec<u8>,
    binary: bool,
    extras: bool,
}

impl Writer {
    fn line(&mut self, line: &str) {
        self.bytes.extend(line.as_bytes());
        self.bytes.push(b'\n');
    }

    fn numbers(&mut self, volume: &Volume) {
        if self.binary {
            self.bytes.extend(volume.stored(true));
        } else {
            self.bytes.extend(volume.text().into_bytes());
        }
        self.line("");
        if self.extras {
            self.line(
                "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1 \n",
            );
        }
    }

    fn places(&mut self, keyword: &str, values: &[f64], components: usize) {
        self.line(&format!("{keyword} {} double", values.len() / components));
        self.numbers(&Volume {
            dims: [values.len(), 1, 1],
            scalar_type: ScalarType::Float64,
            bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            ..Volume::new([1; 3], ScalarType::UInt8, 1, 1)
        });
    }

    /// A field of strings and one of numbers that fit no points.
    fn further_field(&mut self) {
        self.line("FIELD FieldData 3\nnote 1 2 string");
        if self.binary {
            // Lengths of 6 and of 14 bits.
            self.bytes.extend(b"\xc3abc\x80\x05de\nfg\n");
        } else {
            self.line("SCALARS here\n");
        }
        // More tuples than any volume here has.
        self.line("Times 1 211 double");
        self.numbers(&Volume::new([211, 1, 1], ScalarType::Float64, 1, 4));
        self.line("NULL_ARRAY");
    }
}

pub(crate) fn legacy(folder: &Path, volume: &Volume, how: Legacy) -> PathBuf {
    let mut file = Writer { bytes: Vec::new(), binary: how.binary, extras: how.extras };
    file.line("# vtk DataFile Version 4.2\na title");
    file.line(if how.binary { "BINARY" } else { "ASCII" });
    file.line(&format!("\nDATASET {}", how.dataset));
    if how.extras {
        file.further_field();
    }
    let points = volume.dims.map(|n| n + usize::from(how.cells));
    let [x, y, z] = points;
    file.line(&format!("DIMENSIONS {x} {y} {z}"));
    let triple = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    match how.dataset {
        "STRUCTURED_POINTS" => {
            file.line(&format!(
                "SPACING {}\nORIGIN {}",
                triple(volume.spacing),
                triple(volume.origin)
            ));
        }
        "RECTILINEAR_GRID" => {
            for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
                let values: Vec<f64> = (0..points[axis]).map(|i| coordinate(axis, i)).collect();
                file.places(&format!("{name}_COORDINATES"), &values, 1);
            }
        }
        _ => {
            let count = x * y * z;
            let at = |i: usize| point([i % x, i / x % y, i / (x * y)]);
            file.places("POINTS", &(0..count).flat_map(at).collect::<Vec<_>>(), 3);
        }
    }
    let tuples = volume.dims.iter().product::<usize>();
    let section = if how.cells { "CELL_DATA" } else { "POINT_DATA" };
    file.line(&format!("{section} {tuples}"));
    if how.extras {
        file.further_field();
    }
    let (kind, components) = (word(volume.scalar_type), volume.components);
    match how.role {
        "SCALARS" => {
            let table = if how.extras { "mine" } else { "default" };
            file.line(&format!("SCALARS a%20b {kind} {components}\nLOOKUP_TABLE {table}"));
        }
        "VECTORS" => file.line(&format!("VECTORS a%20b {kind}")),
        _ => file.line(&format!("FIELD F 1\na%20b {components} {tuples} {kind}")),
    }
    file.numbers(volume);
    if how.extras {
        file.line("LOOKUP_TABLE mine 2");
        let scalar_type = if how.binary { ScalarType::UInt8 } else { ScalarType::Float32 };
        file.numbers(&Volume::new([2, 1, 1], scalar_type, 4, 9));
    }
    save(folder.join("v.vtk"), &[&file.bytes])
}
