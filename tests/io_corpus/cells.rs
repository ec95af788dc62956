//! Entries of points and cells: unstructured grids, polygons, blocks and tables.

use std::ops::Range;

use glam::DVec3;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use voxsplat::cells::{Cells, Listing};
use voxsplat::core::Ticket;
use voxsplat::io::{Info, OpenOptions, Opened, describe, open};
use voxsplat::volume::{Association, Field, Samples, Shape};

use super::{field_differences, numbers, sha256};

pub(super) fn is_of_cells(entry: &Value) -> bool {
    let is_table = entry["kind"] == "array"
        && entry["path"].as_str().is_some_and(|path| path.contains("/points/"));
    let kind = entry["kind"].as_str().unwrap_or_default();
    is_table || matches!(kind, "unstructured" | "polydata" | "multiblock" | "points")
}

/// Everything in which an opened file differs from such an entry.
pub(super) fn differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    match entry["kind"].as_str() {
        Some("points") => table_differences(entry, opened),
        Some("array") => array_differences(entry, opened),
        Some("multiblock") if entry["reader"] == "VTK vtkExodusIIReader" => {
            let opened = as_vtk_reads_exodus(opened);
            block_differences(entry, &opened, info)
        }
        Some("multiblock") => block_differences(entry, opened, info),
        _ => {
            let mut found = grid_differences(entry, opened, (0..usize::MAX, 0..usize::MAX));
            found.extend(cell_differences(entry, opened));
            found.extend(told_differences(entry, opened, info));
            found
        }
    }
}

fn points_of(opened: &Opened) -> &[DVec3] {
    match &opened.grid.shape {
        Shape::Unstructured(cells) => &cells.points()[..cells.own_points()],
        Shape::Curvilinear(points) => points,
        _ => &[],
    }
}

fn cells_of(opened: &Opened) -> Option<&Cells> {
    match &opened.grid.shape {
        Shape::Unstructured(cells) => Some(cells),
        _ => None,
    }
}

/// Samples in the type that the oracle has them in.
fn of_type(values: Vec<f64>, dtype: &Value) -> Samples {
    #[expect(clippy::cast_possible_truncation, reason = "they were 32-bit floats in the file")]
    match dtype.as_str() {
        Some("float32") => Samples::Float32(values.iter().map(|v| *v as f32).collect()),
        _ => Samples::Float64(values),
    }
}

/// A part of a field: the points or cells of a block.
fn part(field: &Field, points: &Range<usize>, cells: &Range<usize>) -> Field {
    let of = if field.association == Association::Point { points } else { cells };
    let count = field.samples.len() / field.components;
    let range = of.start.min(count) * field.components..of.end.min(count) * field.components;
    macro_rules! part {
        ($($kind:ident),*) => {
            match &*field.samples {
                $(Samples::$kind(values) => Samples::$kind(values[range].to_vec()),)*
            }
        };
    }
    let samples = part!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
    Field { samples: samples.into(), ..field.clone() }
}

/// Points and arrays of an entry or a block of one.
fn grid_differences(
    entry: &Value,
    opened: &Opened,
    (points, cells): (Range<usize>, Range<usize>),
) -> Vec<String> {
    let mut found = Vec::new();
    let own = points_of(opened);
    let own = &own[points.start.min(own.len())..points.end.min(own.len())];
    if json!(own.len()) != entry["points"]["n"] {
        found.push(format!("points: expected {}, found {}", entry["points"]["n"], own.len()));
    }
    let places = own.iter().flat_map(|p| p.to_array()).collect();
    if json!(sha256(&of_type(places, &entry["points"]["dtype"]))) != entry["points"]["sha256"] {
        found.push("the points' digest".to_owned());
    }
    let low = own.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
    let high = own.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
    let bounds = [low.x, high.x, low.y, high.y, low.z, high.z];
    let expected = numbers(&entry["points"]["bounds"]).unwrap_or_default();
    #[expect(clippy::cast_possible_truncation, reason = "as the oracle keeps them")]
    let same = expected.iter().zip(bounds).all(|(e, b)| *e == b || *e as f32 == b as f32);
    if expected.len() != 6 || !same {
        found.push(format!("bounds: expected {expected:?}, found {bounds:?}"));
    }
    let arrays = entry["arrays"].as_array().cloned().unwrap_or_default();
    for array in &arrays {
        let is_it = |field: &&Field| {
            array["name"] == json!(field.name) && array["assoc"] == json!(field.association.name())
        };
        let Some(field) = opened.grid.fields.iter().find(is_it) else {
            found.push(format!("no array {}", array["name"]));
            continue;
        };
        let own = part(field, &points, &cells);
        let lattice = opened.grid.lattice;
        let grid = voxsplat::volume::Grid::of(lattice, vec![own]);
        let told = voxsplat::io::info::describe_grid(&grid, "", &[], &Ticket::new())
            .expect("nobody cancels");
        let own = &grid.fields[0];
        let more = field_differences(array, own, &told.fields[0]);
        found.extend(more.into_iter().map(|more| format!("{}: {more}", array["name"])));
    }
    // Of surfaces it is not said: they have a colour without any.
    let is_surface = matches!(&opened.grid.shape, Shape::Unstructured(cells) if cells.is_surface());
    let is_said = opened.warnings.iter().any(|warning| warning.contains("no array of numbers"));
    let stands_in = is_said || (is_surface && opened.grid.fields[0].name == "cell");
    let expected = if stands_in { 1 } else { arrays.len() };
    if stands_in != arrays.is_empty() || opened.grid.fields.len() != expected {
        found.push(format!("{} fields of {} arrays", opened.grid.fields.len(), arrays.len()));
    }
    let first =
        arrays.iter().find(|array| array["active"] == "scalars" && array["assoc"] == "point");
    if first.is_some_and(|first| first["name"] != json!(opened.grid.fields[0].name)) {
        found.push(format!("the active array is not {}", opened.grid.fields[0].name));
    }
    found
}

/// How cells differ: how many of each type, their corners where all are solids, their volume.
fn cell_differences(entry: &Value, opened: &Opened) -> Vec<String> {
    let mut found = Vec::new();
    let Some(cells) = cells_of(opened) else { return vec!["no cells".to_owned()] };
    if json!(cells.own_cells()) != entry["n_cells"] {
        found.push(format!("cells: expected {}, found {}", entry["n_cells"], cells.own_cells()));
    }
    if let Some(types) = entry["cell_types"].as_object() {
        let own = &cells.census().by_type;
        let same = own.len() == types.len()
            && own.iter().all(|(kind, count)| types.get(&kind.to_string()) == Some(&json!(count)));
        if !same {
            found.push(format!("types: expected {types:?}, found {own:?}"));
        }
    }
    if let Some((corners, offsets)) = connectivity(cells) {
        let expected = &entry["connectivity"];
        let known = expected.is_object();
        if known && (json!(digest(&corners)) != expected["sha256_i64le"]) {
            found.push("the connectivity's digest".to_owned());
        }
        if known && (json!(digest(&offsets)) != expected["offsets_sha256_i64le"]) {
            found.push("the offsets' digest".to_owned());
        }
    }
    if let Some(expected) = entry["total_volume_all_3d_cells"].as_f64() {
        let volume = volume_of(cells);
        // VTK cuts prisms into tetrahedra in another way, which tells where their faces are bent; and so with hexahedra.
        let is_prism = cells.census().by_type.keys().any(|kind| matches!(kind, 15 | 16));
        let most = if is_prism { 6e-3 } else { 1e-6 };
        if (volume - expected).abs() > most * size(cells).max(expected.abs()) {
            found.push(format!("volume: expected {expected}, found {volume}"));
        }
    }
    found
}

fn digest(numbers: &[i64]) -> String {
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Corners and offsets as the file lists them, where every cell is a solid that was not split.
fn connectivity(cells: &Cells) -> Option<(Vec<i64>, Vec<i64>)> {
    let types = &cells.census().by_type;
    let is_plain = types.keys().all(|kind| (10..=14).contains(kind));
    // Voxels count their corners in rows; of mixtures nothing tells which they are.
    let has_voxels = types.contains_key(&11);
    if !is_plain || (has_voxels && types.len() > 1) || cells.solids().len() != cells.own_cells() {
        return None;
    }
    let (mut corners, mut offsets) = (Vec::new(), vec![0]);
    for solid in cells.solids() {
        let own = solid.corners();
        let order: Vec<usize> = match has_voxels {
            true => vec![0, 1, 3, 2, 4, 5, 7, 6],
            false => (0..own.len()).collect(),
        };
        corners.extend(order.iter().map(|at| i64::from(own[*at])));
        offsets.push(corners.len() as i64);
    }
    Some((corners, offsets))
}

/// The sum of signed volumes.
fn volume_of(cells: &Cells) -> f64 {
    (0..cells.solids().len()).map(|solid| cells.placed(solid).volume()).sum()
}

/// The sum of volumes whatever their signs.
fn size(cells: &Cells) -> f64 {
    (0..cells.solids().len()).map(|solid| cells.placed(solid).volume().abs()).sum()
}

/// What `info` says of them.
fn told_differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let mut found = Vec::new();
    if info.kind != "unstructured"
        || info.dims.is_some()
        || json!(info.points) != entry["points"]["n"]
    {
        found.push(format!("info: {info:?}"));
    }
    let Some(told) = &info.cells else {
        // Vertices and lists of them join no points, which are told once.
        let is_joined = |cells: &Cells| cells.census().by_type.keys().any(|kind| *kind > 2);
        if cells_of(opened).is_none_or(is_joined) {
            found.push("info tells no cells".to_owned());
        }
        return found;
    };
    if json!(told.cells) != entry["n_cells"]
        || told.cell_kinds.values().sum::<usize>() != told.cells
    {
        found.push(format!("info: {told:?}"));
    }
    found
}

/// VTK's reader keeps points in the order in which hexahedra use them, and widens variables to 64 bits.
fn as_vtk_reads_exodus(opened: &Opened) -> Opened {
    let Some(cells) = cells_of(opened) else { return opened.clone() };
    let (mut order, mut number) = (Vec::new(), vec![None; cells.own_points()]);
    let mut listing = Listing { starts: vec![0], ..Listing::default() };
    for solid in cells.solids() {
        for corner in solid.corners() {
            let at = *number[*corner as usize].get_or_insert_with(|| {
                order.push(*corner as usize);
                u32::try_from(order.len() - 1).expect("a small file")
            });
            listing.corners.push(at);
        }
        listing.types.push(12);
        listing.starts.push(listing.corners.len());
    }
    listing.points = order.iter().map(|at| cells.points()[*at]).collect();
    let mut opened = opened.clone();
    for field in &mut opened.grid.fields {
        if field.association == Association::Point {
            let n = field.components;
            let tuple =
                |at: &usize| (0..n).map(|i| field.samples.get(at * n + i)).collect::<Vec<_>>();
            field.samples = Samples::Float64(order.iter().flat_map(tuple).collect()).into();
        }
    }
    let cells = Cells::new(listing).expect("they were cells before");
    opened.grid.shape = Shape::Unstructured(cells.into());
    opened
}

/// Blocks lie in one grid one after another.
fn block_differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let blocks = entry["blocks"].as_array().cloned().unwrap_or_default();
    let (mut point, mut cell) = (0, 0);
    let mut found = Vec::new();
    let count = |value: &Value| usize::try_from(value.as_u64().unwrap_or(0)).unwrap_or(0);
    for (at, block) in blocks.iter().enumerate() {
        let points = point..point + count(&block["points"]["n"]);
        let cells = cell..cell + count(&block["n_cells"]);
        (point, cell) = (points.end, cells.end);
        let more = grid_differences(block, opened, (points, cells));
        found.extend(more.into_iter().map(|more| format!("block {at}: {more}")));
    }
    match (&opened.grid.shape, &blocks[..]) {
        (Shape::Curvilinear(_), [block]) => {
            if block["dims"] != json!(info.dims) {
                found.push(format!("dims: {:?}", info.dims));
            }
        }
        (Shape::Unstructured(cells), _) => {
            if (cells.own_points(), cells.own_cells()) != (point, cell) {
                found.push(format!("{} points, {} cells", cells.own_points(), cells.own_cells()));
            }
            if let [block] = &blocks[..] {
                found.extend(cell_differences(block, opened));
            }
        }
        _ => found.push(format!("kind {}", info.kind)),
    }
    found
}

/// A table's columns: the places' three, then those of the fields.
fn columns(opened: &Opened) -> Vec<Vec<f64>> {
    let points = points_of(opened);
    let mut columns: Vec<Vec<f64>> =
        (0..3).map(|axis| points.iter().map(|point| point[axis]).collect()).collect();
    // What stands in where the file has no values is none of its columns.
    let is_own = |f: &&Field| f.association == Association::Point && f.name != "log10 density";
    let on_points = opened.grid.fields.iter().filter(is_own);
    columns.extend(on_points.map(|f| (0..f.samples.len()).map(|i| f.samples.get(i)).collect()));
    columns
}

fn table_differences(entry: &Value, opened: &Opened) -> Vec<String> {
    let columns = columns(opened);
    let mut found = Vec::new();
    if entry["shape"] != json!([points_of(opened).len(), columns.len()]) {
        found.push(format!("shape: expected {}, found {}", entry["shape"], columns.len()));
    }
    for (what, pick) in [("column_min", f64::min as fn(f64, f64) -> f64), ("column_max", f64::max)]
    {
        let own: Vec<f64> =
            columns.iter().filter_map(|column| column.iter().copied().reduce(pick)).collect();
        if numbers(&entry[what]) != Some(own.clone()) {
            found.push(format!("{what}: expected {}, found {own:?}", entry[what]));
        }
    }
    if let Some(header) = entry["header"].as_str() {
        let names: Vec<&str> = header.split_whitespace().skip(3).collect();
        let own: Vec<&str> = opened.grid.fields.iter().map(|field| field.name.as_str()).collect();
        if names != own {
            found.push(format!("names: expected {names:?}, found {own:?}"));
        }
    }
    found
}

fn array_differences(entry: &Value, opened: &Opened) -> Vec<String> {
    let columns = columns(opened);
    let rows = points_of(opened).len();
    let mut found = Vec::new();
    if entry["shape"] != json!([rows, columns.len()]) {
        found.push(format!("shape: expected {}, found {rows} rows", entry["shape"]));
        return found;
    }
    let values = (0..rows).flat_map(|row| columns.iter().map(move |column| column[row])).collect();
    if json!(sha256(&of_type(values, &entry["dtype"]))) != entry["sha256_array"] {
        found.push("the array's digest".to_owned());
    }
    found
}

/// A tetrahedron and a triangle with arrays, and a true entry for them.
fn known() -> (Value, Opened) {
    let directory = tempfile::tempdir().expect("a temporary folder");
    let path = directory.path().join("known.vtk");
    let text = "# vtk DataFile Version 2.0\nknown\nASCII\nDATASET UNSTRUCTURED_GRID\n\
        POINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n\
        POINT_DATA 4\nSCALARS heat float\nLOOKUP_TABLE default\n1 2 3 10\n\
        CELL_DATA 1\nSCALARS mark int\nLOOKUP_TABLE default\n7\n";
    std::fs::write(&path, text).expect("the folder is ours");
    let opened = open(&path, &OpenOptions::default(), &Ticket::new()).expect("the file is valid");
    let places = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let entry = json!({
        "kind": "unstructured", "n_cells": 1, "cell_types": {"10": 1},
        "points": {
            "n": 4, "dtype": "float64", "bounds": [0.0, 1.0, 0.0, 1.0, 0.0, 1.0],
            "sha256": sha256(&Samples::Float64(places)),
        },
        "connectivity": {
            "sha256_i64le": digest(&[0, 1, 2, 3]), "offsets_sha256_i64le": digest(&[0, 4]),
        },
        "total_volume_all_3d_cells": 1.0 / 6.0,
        "arrays": [
            {"assoc": "point", "name": "heat", "components": 1, "tuples": 4, "dtype": "float32",
             "sha256": sha256(&Samples::Float32(vec![1.0, 2.0, 3.0, 10.0])), "min": 1.0,
             "max": 10.0, "mean": 4.0, "active": "scalars"},
            {"assoc": "cell", "name": "mark", "components": 1, "tuples": 1, "dtype": "int32",
             "sha256": sha256(&Samples::Int32(vec![7])), "min": 7.0, "max": 7.0, "mean": 7.0},
        ],
    });
    (entry, opened)
}

fn compared(entry: &Value, opened: &Opened) -> Vec<String> {
    differences(entry, opened, &describe(opened, &Ticket::new()).expect("nobody cancels"))
}

#[test]
fn the_comparison_of_cells_accepts_a_true_entry() {
    let (entry, opened) = known();
    assert_eq!(compared(&entry, &opened), Vec::<String>::new());
}

#[test]
fn the_comparison_of_cells_rejects_every_single_wrong_value() {
    let (entry, opened) = known();
    let wrong = [
        ("/points/n", json!(5)),
        ("/points/sha256", json!(digest(&[1]))),
        ("/points/bounds/3", json!(1.001)),
        ("/n_cells", json!(2)),
        ("/cell_types/10", json!(2)),
        ("/connectivity/sha256_i64le", json!(digest(&[0, 1, 3, 2]))),
        ("/connectivity/offsets_sha256_i64le", json!(digest(&[0, 3]))),
        ("/total_volume_all_3d_cells", json!(-1.0 / 6.0)),
        ("/arrays/0/name", json!("cold")),
        ("/arrays/0/dtype", json!("float64")),
        ("/arrays/0/sha256", json!(digest(&[1]))),
        ("/arrays/0/max", json!(10.001)),
        ("/arrays/0/components", json!(2)),
        ("/arrays/1/assoc", json!("point")),
        ("/arrays/1/min", json!(6.0)),
    ];
    for (at, value) in wrong {
        let mut entry = entry.clone();
        *entry.pointer_mut(at).expect("the entry has it") = value;
        assert!(!compared(&entry, &opened).is_empty(), "a wrong {at} must be noticed");
    }
    let table = json!({
        "kind": "points", "shape": [4, 4], "header": null,
        "column_min": [0.0, 0.0, 0.0, 1.0], "column_max": [1.0, 1.0, 1.0, 10.0],
    });
    assert_eq!(compared(&table, &opened), Vec::<String>::new());
    for (at, value) in [
        ("/shape/0", json!(3)),
        ("/column_min/3", json!(0.0)),
        ("/column_max/0", json!(1.5)),
        ("/header", json!("x y z cold")),
    ] {
        let mut table = table.clone();
        *table.pointer_mut(at).expect("the entry has it") = value;
        assert!(!compared(&table, &opened).is_empty(), "a wrong {at} must be noticed");
    }
}
