//! Entries whose oracle tells samples as they are stored, several volumes in one, and an affine matrix.

use std::path::Path;

use glam::DVec3;
use serde_json::{Value, json};
use voxsplat::core::Ticket;
use voxsplat::io::{Info, OpenOptions, Opened, open};
use voxsplat::volume::{Samples, Scalar};
use voxsplat::with_samples;

use super::{numbers, padded, sha256};

/// Everything in which an opened file differs from such an entry.
pub(super) fn differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let mut found = Vec::new();
    let dims = info.dims.unwrap_or([0; 3]).map(|n| n as f64);
    let expected = entry["expected_volume"]["dims"]
        .as_array()
        .map_or(&entry["dims"], |_| &entry["expected_volume"]["dims"]);
    if numbers(expected).map(|d| padded(&d, 1.0)) != Some(dims.to_vec()) {
        found.push(format!("dims: expected {expected}, found {dims:?}"));
    }
    found.extend(place_differences(entry, opened));
    found.extend(sample_differences(entry, opened, info));
    found
}

/// Whether the header says where the samples lie in the world.
fn is_placed(entry: &Value) -> bool {
    let code = |name: &str| entry[name].as_i64().unwrap_or(1);
    code("sform_code") > 0 || code("qform_code") > 0
}

fn place_differences(entry: &Value, opened: &Opened) -> Vec<String> {
    let lattice = &opened.grid.lattice;
    let mut found = Vec::new();
    // Of 32-bit floats, by other routes.
    let near = |a: f64, b: f64| (a - b).abs() <= 2e-5 * b.abs().max(1.0);
    if let Some(rows) = entry["affine"].as_array().filter(|_| is_placed(entry)) {
        let axes = lattice.axes();
        for (row, expected) in rows.iter().filter_map(numbers).take(3).enumerate() {
            let ours = [axes.x_axis[row], axes.y_axis[row], axes.z_axis[row], lattice.origin[row]];
            if !ours.iter().zip(&expected).all(|(a, b)| near(*a, *b)) {
                found.push(format!(
                    "row {row} of the affine: expected {expected:?}, found {ours:?}"
                ));
            }
        }
    } else if let Some(expected) = numbers(&entry["ImagePositionPatient"]) {
        let ours = lattice.origin.to_array();
        if !ours.iter().zip(&expected).all(|(a, b)| near(*a, *b)) {
            found.push(format!("origin: expected {expected:?}, found {ours:?}"));
        }
        let spacing = numbers(&entry["PixelSpacing"]).unwrap_or_default();
        // Rows first.
        if spacing.len() == 2
            && ![lattice.spacing.y, lattice.spacing.x]
                .iter()
                .zip(&spacing)
                .all(|(a, b)| near(*a, *b))
        {
            found.push(format!("spacing: expected {spacing:?}, found {:?}", lattice.spacing));
        }
    } else if let Some(expected) =
        numbers(&entry["expected_volume"]["spacing"]).or_else(|| numbers(&entry["spacing"]))
    {
        let ours = lattice.spacing.to_array();
        if !ours.iter().zip(&padded(&expected, 1.0)).all(|(a, b)| near(*a, *b)) {
            found.push(format!("spacing: expected {expected:?}, found {ours:?}"));
        }
    }
    found
}

/// All fields one after another, as the file has them.
fn all_samples(opened: &Opened) -> Vec<f64> {
    let fields = opened.grid.fields.iter();
    fields
        .flat_map(|field| with_samples!(&*field.samples, v => v.iter().map(|v| v.to_f64()).collect::<Vec<f64>>()))
        .collect()
}

fn sample_differences(entry: &Value, opened: &Opened, info: &Info) -> Vec<String> {
    let mut found = Vec::new();
    let values = all_samples(opened);
    let told = match entry["scaled"].is_object() {
        true => &entry["scaled"],
        false => entry,
    };
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let number = |name: &str| entry[name].as_f64();
    // What DICOM's numbers mean; the oracle tells those that are stored.
    let slope = number("RescaleSlope").or_else(|| number("DoseGridScaling")).unwrap_or(1.0);
    let intercept = number("RescaleIntercept").unwrap_or(0.0);
    for (what, ours) in [("min", low), ("max", high), ("mean", mean)] {
        let Some(expected) = told[what].as_f64() else { continue };
        let expected = expected * slope + intercept;
        // Scaled values are kept with 24 bits.
        if (ours - expected).abs() > 2e-7 * (low.abs().max(high.abs())) {
            found.push(format!("{what}: expected {expected}, found {ours}"));
        }
    }
    // Sorted by another rule, or of other numbers.
    if entry["scaled"].is_object()
        || entry["expected_volume"].is_object()
        || (slope, intercept) != (1.0, 0.0)
    {
        return found;
    }
    let expected_type = match entry["dtype"].as_str() {
        Some("RGB24") => "uint8",
        other => other.unwrap_or_default(),
    };
    if info.fields[0].scalar_type != expected_type {
        let ours = &info.fields[0].scalar_type;
        found.push(format!("dtype: expected {expected_type}, found {ours}"));
    }
    let mut joined = opened.grid.fields[0].samples.as_ref().clone();
    for field in &opened.grid.fields[1..] {
        append(&mut joined, &field.samples);
    }
    if json!(sha256(&joined)) != entry["sha256_array"] {
        found.push("the samples' digest".to_owned());
    }
    found
}

fn append(joined: &mut Samples, more: &Samples) {
    macro_rules! append {
        ($($kind:ident),*) => {
            match (joined, more) {
                $((Samples::$kind(to), Samples::$kind(from)) => to.extend_from_slice(from),)*
                _ => panic!("fields of one file have one type"),
            }
        };
    }
    append!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
}

#[test]
fn a_series_of_time_steps_is_the_reference_conversion_of_it() {
    let folder = super::data_root().join("formats/dicom");
    let reference = folder.join("ge_epi_ref/DCM2NIIX_regression_test_4.nii");
    if !reference.exists() {
        println!("skipped 1: no series of time steps in this copy of the pack");
        return;
    }
    let read = |path: &Path| open(path, &OpenOptions::default(), &Ticket::new()).unwrap().grid;
    let expected = read(&reference);
    let series = folder.join("ge_epi_mr_0004");
    let one = series.join("axial_epi_fmri_interleaved_i_to_s-00077.dcm");
    for path in [&series, &one] {
        let found = read(path);
        assert_eq!((found.fields.len(), found.lattice.dims), (10, [64, 64, 15]));
        // To the right and front there, to the left and back here.
        let place = found.lattice.world_from_index(DVec3::new(3.0, 4.0, 5.0));
        let there = expected.lattice.world_from_index(DVec3::new(3.0, 59.0, 5.0));
        assert!((place - there * DVec3::new(-1.0, -1.0, 1.0)).length() < 2e-3, "{place} {there}");
        for (ours, theirs) in found.fields.iter().zip(&expected.fields) {
            for (z, y) in (0..15).flat_map(|z| (0..64).map(move |y| (z, y))) {
                let row = |y: usize| (z * 64 + y) * 64;
                let same = (0..64)
                    .all(|x| ours.samples.get(row(y) + x) == theirs.samples.get(row(63 - y) + x));
                assert!(same, "{} in row {y} of slice {z}", ours.name);
            }
        }
    }
}
