//! The readers against the data pack's oracle: what independent readers found in the same files.
//!
//! The pack lies at `VOXSPLAT_DATA` (default `../shared/data` beside this package). Files that are
//! not there are counted and printed, never passed over silently.

mod cells;
mod stored;

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use voxsplat::core::Ticket;
use voxsplat::io::info::FieldInfo;
use voxsplat::io::{Info, OpenOptions, Opened, describe, open};
use voxsplat::volume::{Association, Field, Samples, Shape};
use voxsplat::with_samples;

fn data_root() -> PathBuf {
    std::env::var_os("VOXSPLAT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    )
}

/// The manifest's entries; none where the pack is absent.
fn datasets() -> Vec<Value> {
    let path = data_root().join("manifest.json");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped the whole corpus: no manifest at {}", path.display());
        return Vec::new();
    };
    let manifest: Value = serde_json::from_str(&text).expect("the manifest is JSON");
    manifest["datasets"].as_array().cloned().expect("the manifest lists data sets")
}

fn open_entry(entry: &Value) -> Result<Opened, String> {
    let path = data_root().join(entry["path"].as_str().unwrap_or_default());
    open(&path, &OpenOptions::default(), &Ticket::new()).map_err(|error| error.to_string())
}

/// SHA-256 of samples as little-endian bytes, in hexadecimal.
fn sha256(samples: &Samples) -> String {
    let mut bytes = Vec::new();
    with_samples!(samples, values => {
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    });
    Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

/// `numbers` with what the file lacks filled in, to three entries.
fn padded(numbers: &[f64], fill: f64) -> Vec<f64> {
    numbers.iter().copied().chain(std::iter::repeat(fill)).take(3).collect()
}

/// Directions as columns: from NRRD's step vectors, or from a row-major matrix.
fn direction_columns(entry: &Value) -> Option<Vec<f64>> {
    let mut columns: Vec<f64> = (0..9).map(|i| f64::from(u8::from(i % 4 == 0))).collect();
    if let Some(steps) = entry["space_directions"].as_array() {
        for (axis, step) in steps.iter().filter_map(numbers).enumerate() {
            let length = step.iter().map(|v| v * v).sum::<f64>().sqrt();
            for (row, value) in step.iter().enumerate() {
                columns[axis * 3 + row] = value / length;
            }
        }
        return Some(columns);
    }
    let rows = numbers(&entry["direction"])?;
    let n = if rows.len() == 9 { 3 } else { 2 };
    for (i, value) in rows.iter().enumerate() {
        columns[(i % n) * 3 + i / n] = *value;
    }
    Some(columns)
}

/// Everything in which an opened file differs from the oracle's entry.
fn differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let mut found = Vec::new();
    let mut near = |what: &str, expected: Option<Vec<f64>>, actual: &[f64]| {
        let Some(expected) = expected else { return };
        let scale = expected.iter().fold(1e-300_f64, |m, v| m.max(v.abs()));
        let same = expected.len() == actual.len()
            && expected.iter().zip(actual).all(|(e, a)| (e - a).abs() <= 1e-12 * scale);
        if !same {
            found.push(format!("{what}: expected {expected:?}, found {actual:?}"));
        }
    };
    let dims = info.dims.unwrap_or([0; 3]).map(|n| n as f64);
    near("dims", numbers(&entry["dims"]).map(|d| padded(&d, 1.0)), &dims);
    let told = |list: Option<&[f64]>| list.unwrap_or_default().to_vec();
    let spacing = told(info.spacing.as_ref().map(|s| &s[..]));
    // A flat image may tell no distance across; 1 is used.
    let spread = |s: &[f64]| -> Vec<f64> {
        let padded = padded(s, 1.0);
        padded.iter().zip(dims).map(|(s, n)| if *s == 0.0 && n == 1.0 { 1.0 } else { *s }).collect()
    };
    near("spacing", numbers(&entry["spacing"]).map(|s| spread(&s)), &spacing);
    let origin = told(info.origin.as_ref().map(|o| &o[..]));
    // A map whose header tells no origin begins where its first sample lies in the cell.
    let expected_origin = match (numbers(&entry["nstart"]), numbers(&entry["spacing"])) {
        (Some(starts), Some(steps)) if numbers(&entry["origin"]) == Some(vec![0.0; 3]) => {
            Some(starts.iter().zip(&steps).map(|(start, step)| start * step).collect())
        }
        _ => numbers(&entry["origin"]),
    };
    near("origin", expected_origin.map(|o| padded(&o, 0.0)), &origin);
    let direction = told(info.direction.as_ref().map(|d| &d[..]));
    near("direction", direction_columns(entry), &direction);
    found.extend(shape_differences(entry, opened, info));
    let arrays = match entry["arrays"].as_array() {
        Some(arrays) => arrays.clone(),
        None if entry["dtype"].is_string() => {
            let mut array = entry.clone();
            array["sha256"] = entry["sha256_array"].clone();
            vec![array]
        }
        None => Vec::new(),
    };
    for array in &arrays {
        let is_named = |field: &Field| match array["name"].as_str() {
            Some(name) => {
                field.name == name && array["assoc"].as_str() == Some(field.association.name())
            }
            None => true,
        };
        match opened.grid.fields.iter().position(is_named) {
            Some(at) => {
                found.extend(field_differences(array, &opened.grid.fields[at], &info.fields[at]));
                let is_first = array["active"] == "scalars" && array["assoc"] == "point";
                if is_first && at != 0 {
                    found.push(format!("the active array is field {at}"));
                }
            }
            None => found.push(format!("no array {}", array["name"])),
        }
    }
    found
}

/// How the points of a grid that is not evenly spaced differ from the oracle's.
fn shape_differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let kind = entry["kind"].as_str().unwrap_or("grid");
    let mut found = Vec::new();
    // Other readers have other words for what is evenly spaced.
    if matches!(kind, "rectilinear" | "curvilinear") && kind != info.kind {
        found.push(format!("kind: expected {kind}, found {}", info.kind));
    }
    let same = |numbers: &[f64], expected: &Value| {
        let dtype = expected["dtype"].as_str().unwrap_or_default();
        #[expect(clippy::cast_possible_truncation, reason = "they were 32-bit floats in the file")]
        let samples = match dtype {
            "float32" => Samples::Float32(numbers.iter().map(|v| *v as f32).collect()),
            _ => Samples::Float64(numbers.to_vec()),
        };
        json!(sha256(&samples)) == expected["sha256"]
    };
    match &opened.grid.shape {
        Shape::Affine | Shape::Unstructured(_) => {}
        Shape::Rectilinear(lists) => {
            let told = info.coordinates.expect("told of rectilinear grids");
            for ((list, told), axis) in lists.iter().zip(told).zip(["x", "y", "z"]) {
                let expected = &entry[format!("{axis}_coords")];
                if expected.is_null() {
                    continue;
                }
                if !same(list, expected) {
                    found.push(format!("coordinates along {axis}"));
                }
                let values = [Some(told.first), Some(told.last), told.min_step, told.max_step];
                for (what, value) in ["first", "last", "min_step", "max_step"].iter().zip(values) {
                    if expected[what].as_f64() != value {
                        found.push(format!("{axis} {what}: {value:?}, not {}", expected[what]));
                    }
                }
            }
        }
        Shape::Curvilinear(points) => {
            let places: Vec<f64> = points.iter().flat_map(|p| p.to_array()).collect();
            if !same(&places, &entry["points"]) {
                found.push("points".to_owned());
            }
            let bounds = numbers(&entry["points"]["bounds"]);
            if bounds != info.bounds.map(|bounds| bounds.to_vec()) {
                found.push(format!("bounds: expected {bounds:?}, found {:?}", info.bounds));
            }
        }
    }
    found
}

fn field_differences(expected: &Value, field: &Field, info: &FieldInfo) -> Vec<String> {
    let mut found = Vec::new();
    let mut same = |what: &str, actual: Value| {
        if !expected[what].is_null() && expected[what] != actual {
            found.push(format!("{what}: expected {}, found {actual}", expected[what]));
        }
    };
    same("components", json!(field.components));
    same("dtype", json!(info.scalar_type));
    same("sha256", json!(sha256(&field.samples)));
    same("tuples", json!(field.samples.len() / field.components));
    let told = [
        ("min", info.min),
        ("max", info.max),
        ("mean", info.mean),
        ("magnitude_max", info.magnitude_max),
    ];
    for (what, actual) in told {
        let Some(wanted) = expected[what].as_f64() else { continue };
        // The oracle sums in another order: 1e-9 of the value, 1e-12 near zero.
        let is_near = actual.is_some_and(|a| (a - wanted).abs() <= 1e-9 * wanted.abs() + 1e-12);
        if !is_near {
            found.push(format!("{what}: expected {wanted}, found {actual:?}"));
        }
    }
    found
}

/// The oracle misjudges this file: its header's CompressedDataSize (260020) is less than the
/// stream, which is whole (262087 bytes, its checksum matches) and unpacks to exactly the promised
/// size. The oracle's reader obeyed the header, lost the last slices and left zeros there. What is
/// read here agrees with it up to that place, and goes on.
const CUT_BY_THE_ORACLE: &str = "scalar/frog/frogtissue.mhd";

fn cut_as_the_oracle_does(opened: &mut Opened) {
    /// Bytes that 260020 bytes of the stream unpack to.
    const CUT: usize = 30_963_285;
    assert!(opened.warnings.iter().any(|w| w.contains("260020")), "{:?}", opened.warnings);
    let field = &mut opened.grid.fields[0];
    let Samples::UInt8(values) = Arc::make_mut(&mut field.samples) else {
        panic!("the file holds bytes")
    };
    // What the oracle lost is there, and is not nothing.
    assert_eq!(values[CUT..].iter().filter(|&&v| v > 0).count(), 2670);
    values[CUT..].fill(0);
}

fn compare(entry: &Value, opened: &Opened) -> Vec<String> {
    let info = describe(opened, &Ticket::new()).expect("nobody cancels");
    if cells::is_of_cells(entry) {
        return cells::differences(entry, opened, &info);
    }
    match entry["reader"].as_str() {
        Some(reader) if reader.starts_with("nibabel") || reader.starts_with("pydicom") => {
            stored::differences(entry, opened, &info)
        }
        _ if entry["expected_volume"].is_object() => stored::differences(entry, opened, &info),
        _ => differences(entry, opened, &info),
    }
}

#[test]
fn every_file_of_the_formats_that_are_read_is_what_the_oracle_says() {
    let (mut checked, mut refused, mut skipped) = (0, 0, 0);
    let mut failures = Vec::new();
    for entry in &datasets() {
        let path = entry["path"].as_str().expect("entries have paths");
        if !data_root().join(path).exists() {
            println!("skipped {path}: not in this copy of the pack");
            skipped += 1;
            continue;
        }
        match (entry["expect"].as_str().unwrap_or_default(), open_entry(entry)) {
            ("reject", Ok(_)) => failures.push(format!("{path}: opened, but must be refused")),
            ("reject", Err(message)) => {
                refused += 1;
                if !message.starts_with("expected ") || !message.ends_with(path) {
                    failures.push(format!("{path}: a message of another form: {message}"));
                }
            }
            (expect, Err(message)) if expect.starts_with("reject-or-open") => {
                refused += 1;
                println!("refused {path}: {message}");
            }
            (_, Err(message)) => failures.push(format!("{path}: {message}")),
            (_, Ok(mut opened)) => {
                checked += 1;
                if path == CUT_BY_THE_ORACLE {
                    cut_as_the_oracle_does(&mut opened);
                }
                let differences = compare(entry, &opened);
                failures.extend(differences.into_iter().map(|d| format!("{path}: {d}")));
            }
        }
    }
    println!("io_corpus: checked {checked}, refused {refused}, skipped {skipped}");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn all_of_the_pack_that_should_open_does() {
    let entries = datasets();
    let due: Vec<&Value> = entries.iter().filter(|entry| entry["expect"] == "open").collect();
    let opened = due.iter().filter(|entry| open_entry(entry).is_ok()).count();
    println!("io_corpus: {opened} of {} files that should open do", due.len());
    assert!(due.is_empty() || opened == due.len(), "{opened}");
}

#[test]
fn nan_and_infinities_are_counted_as_the_oracle_counts_them() {
    let entries = datasets();
    let entry = entries
        .iter()
        .find(|e| e["path"].as_str().is_some_and(|p| p.ends_with("nrrd_nan_inf.nrrd")));
    let Some(entry) = entry else {
        println!("skipped 1: nrrd_nan_inf.nrrd");
        return;
    };
    let info = describe(&open_entry(entry).unwrap(), &Ticket::new()).unwrap();
    assert_eq!((info.fields[0].nan_count, info.fields[0].infinite_count), (140, 20));
}

/// Whether the stored 16-bit numbers of a variable are those of the oracle, packed again from its fields.
fn packs_to(variable: &Value, fields: &[&Field]) -> bool {
    let number = |name: &str| variable[name].as_f64().expect("a packed variable tells it");
    let (scale, offset) = (number("scale_factor"), number("add_offset"));
    let values = fields.iter().flat_map(|f| (0..f.samples.len()).map(|i| f.samples.get(i)));
    #[expect(clippy::cast_possible_truncation, reason = "they had 16 bits in the file")]
    let packed = values.map(|value| ((value - offset) / scale).round() as i16);
    json!(sha256(&Samples::Int16(packed.collect()))) == variable["sha256"]
}

#[test]
fn winds_in_netcdf_are_what_the_oracle_says() {
    let entries = datasets();
    let Some(entry) = entries.iter().find(|entry| entry["kind"] == "netcdf") else {
        println!("skipped 1: no NetCDF in this copy of the pack");
        return;
    };
    let opened = open_entry(entry).unwrap();
    let info = describe(&opened, &Ticket::new()).unwrap();
    assert_eq!((info.kind.as_str(), info.dims), ("rectilinear", Some([480, 241, 3])));
    let variables = entry["variables"].as_array().unwrap();
    let variable = |name: &str| variables.iter().find(|v| v["name"] == name).unwrap();
    for (name, list) in ["longitude", "latitude"].into_iter().zip(info.coordinates.unwrap()) {
        let ends = [list.first.min(list.last), list.first.max(list.last)];
        let expected = ["min", "max"].map(|end| variable(name)[end].as_f64().unwrap());
        assert_eq!(ends, expected, "{name}");
    }
    let [u, v, z] = ["u", "v", "z"].map(|name| {
        let of_name = |f: &&Field| f.name.starts_with(&format!("{name}[month="));
        let fields: Vec<&Field> = opened.grid.fields.iter().filter(of_name).collect();
        assert!(fields.len() == 2 && packs_to(variable(name), &fields), "{name}");
        let mut wrong = variable(name).clone();
        wrong["add_offset"] = json!(wrong["add_offset"].as_f64().unwrap() + 1.0);
        assert!(!packs_to(&wrong, &fields), "a wrong offset must be noticed");
        for (end, pick) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
            let told = info.fields.iter().filter(|f| fields.iter().any(|g| g.name == f.name));
            let all = told.map(|f| if end == "min" { f.min } else { f.max }.unwrap());
            let (all, expected) = (all.reduce(pick), variable(name)["scaled"][end].as_f64());
            // 32-bit floats of 1e5 at most.
            assert!((all.unwrap() - expected.unwrap()).abs() < 4e-3, "{name} {end}: {all:?}");
        }
        fields
    });
    assert_eq!(z.len(), 2);
    for (at, month) in [1, 7].into_iter().enumerate() {
        let field = opened.grid.field(Some(&format!("(u, v)[month={month}]"))).unwrap();
        let vectors = opened.grid.vectors(field, &Ticket::new()).unwrap();
        for index in [0, 1000, 300_000] {
            let expected = [u[at], v[at]].map(|f| f.samples.get(index));
            let found = vectors.vectors[index].as_dvec3();
            assert_eq!([found.x, found.y, found.z], [expected[0], expected[1], 0.0]);
        }
    }
}

/// A small volume, and a true entry for it.
fn known() -> (Value, Opened) {
    let directory = tempfile::tempdir().expect("a temporary folder");
    let path = directory.path().join("known.nrrd");
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\nencoding: txt\n\
        space: left-posterior-superior\nspace directions: (0,2,0) (3,0,0) (0,0,1)\n\
        space origin: (5,6,7)\n\n1 2 3 10\n";
    std::fs::write(&path, text).expect("the folder is ours");
    let opened = open(&path, &OpenOptions::default(), &Ticket::new()).expect("the file is valid");
    let entry = json!({
        "dims": [2, 2, 1], "spacing": [2.0, 3.0, 1.0], "origin": [5.0, 6.0, 7.0],
        "space_directions": [[0.0, 2.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        "components": 1, "dtype": "uint8", "min": 1.0, "max": 10.0, "mean": 4.0,
        "sha256_array": sha256(&Samples::UInt8(vec![1, 2, 3, 10])),
    });
    (entry, opened)
}

#[test]
fn the_comparison_accepts_a_true_entry() {
    let (entry, opened) = known();
    assert_eq!(compare(&entry, &opened), Vec::<String>::new());
    assert_eq!(opened.grid.fields[0].association, Association::Point);
}

#[test]
fn the_comparison_rejects_every_single_wrong_value() {
    let (entry, opened) = known();
    let wrong = [
        ("dims", json!([2, 1, 2])),
        ("spacing", json!([2.0, 3.000_001, 1.0])),
        ("origin", json!([5.0, 6.0, 7.000_001])),
        ("space_directions", json!([[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]])),
        ("components", json!(2)),
        ("dtype", json!("int8")),
        ("min", json!(0.0)),
        ("max", json!(10.001)),
        ("mean", json!(4.000_001)),
        ("sha256_array", json!(sha256(&Samples::UInt8(vec![1, 2, 3, 11])))),
    ];
    for (key, value) in wrong {
        let mut entry = entry.clone();
        entry[key] = value;
        assert_eq!(compare(&entry, &opened).len(), 1, "a wrong {key} must be noticed");
    }
    let mut entry = entry;
    entry["arrays"] = json!([{"name": "other", "assoc": "point"}]);
    assert_eq!(compare(&entry, &opened).len(), 1, "a missing array must be noticed");
}

#[test]
fn a_row_major_direction_is_turned_into_columns() {
    let entry = json!({"direction": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]});
    let columns = direction_columns(&entry).unwrap();
    assert_eq!(columns, [1.0, 4.0, 7.0, 2.0, 5.0, 8.0, 3.0, 6.0, 9.0]);
}
