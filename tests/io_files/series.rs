//! Several DICOM series in one folder, and segmentations.

use std::fs;
use std::path::Path;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::io::{OpenOptions, Opened, labels, open};
use voxsplat::scene::place_over;
use voxsplat::volume::Lattice;

use crate::write_dicom::Slice;
use crate::write_segmentation::segmentation;

/// A series of slices of 4 × 3 pixels, all of one value, in a folder.
fn write(folder: &Path, number: u32, description: &str, slices: u32, value: u16) {
    fs::create_dir_all(folder).expect("a temporary folder has room");
    let pixels = value.to_le_bytes().repeat(12);
    for z in 0..slices {
        let slice = Slice {
            series: &format!("1.2.{number}"),
            number,
            description,
            z: f64::from(z),
            instance: z + 1,
            columns: 4,
            rows: 3,
            pixels: &pixels,
        };
        let path = folder.join(format!("{number}-{z}.dcm"));
        fs::write(path, slice.file()).expect("a temporary folder has room");
    }
}

fn read(path: &Path, series: Option<&str>) -> Opened {
    let options = OpenOptions { series: series.map(str::to_owned), ..OpenOptions::default() };
    open(path, &options, &Ticket::new()).expect("it is a valid series")
}

/// The value of all its samples, and its slices.
fn value_and_slices(opened: &Opened) -> (f64, usize) {
    (opened.grid.fields[0].samples.get(0), opened.grid.lattice.dims[2])
}

/// What is listed, with a star at the open one.
fn listed(opened: &Opened) -> Vec<String> {
    let star = |open| if open { "*" } else { "" };
    opened.series.iter().map(|s| format!("{}{} {}", star(s.is_open), s.name, s.slices)).collect()
}

#[test]
fn series_are_listed_by_number_under_names_of_their_own_and_one_is_chosen_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("a"), 7, "Thorax", 5, 70);
    write(&folder.path().join("b"), 2, "Scout", 2, 20);
    write(&folder.path().join("c"), 3, "Thorax", 4, 30);
    write(&folder.path().join("c"), 4, "", 3, 40);

    let largest = read(folder.path(), None);
    assert_eq!(value_and_slices(&largest), (70.0, 5));
    let all = ["Scout 2", "Thorax (series 3) 4", "series 4 3", "*Thorax (series 7) 5"];
    assert_eq!(listed(&largest), all);
    let told = largest.warnings.join("\n");
    assert!(told.contains("3 more series are in the folder"), "{told}");
    assert!(!told.contains("series 7"), "the open one is none of the others: {told}");

    for (name, expected) in [
        ("Scout", (20.0, 2)),
        ("Thorax (series 3)", (30.0, 4)),
        ("series 4", (40.0, 3)),
        ("Thorax (series 7)", (70.0, 5)),
        ("Thorax", (70.0, 5)),
    ] {
        assert_eq!(value_and_slices(&read(folder.path(), Some(name))), expected, "{name}");
    }
    // Each path opens just its series.
    for series in &largest.series {
        assert_eq!(value_and_slices(&read(&series.path, None)).1, series.slices, "{}", series.name);
    }
    // A file opens its own, and names what lies beside it.
    let beside = read(&folder.path().join("c/4-1.dcm"), None);
    assert_eq!(listed(&beside), ["Thorax 4", "*series 4 3"]);
    assert_eq!(value_and_slices(&beside), (40.0, 3));
    assert_eq!(
        value_and_slices(&read(&folder.path().join("c/4-1.dcm"), Some("Thorax"))),
        (30.0, 4)
    );
}

#[test]
fn series_of_one_number_and_description_have_names_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), 1, "Head", 3, 10);
    let pixels = 5_u16.to_le_bytes().repeat(12);
    for z in 0..2 {
        let slice = Slice {
            series: "9.9",
            number: 1,
            description: "Head",
            z: f64::from(z),
            instance: z + 1,
            columns: 4,
            rows: 3,
            pixels: &pixels,
        };
        fs::write(folder.path().join(format!("other-{z}.dcm")), slice.file()).unwrap();
    }
    let opened = read(folder.path(), None);
    assert_eq!(listed(&opened), ["*Head (series 1) 3", "Head (series 1), 2 2"]);
    let second = read(folder.path(), Some("Head (series 1), 2"));
    assert_eq!(value_and_slices(&second), (5.0, 2));
}

#[test]
fn one_series_is_no_choice() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), 1, "Head", 3, 10);
    assert_eq!(listed(&read(folder.path(), None)), [""; 0]);
}

#[test]
fn segments_are_labels_with_the_names_and_colours_that_the_file_gives() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("segmentation.dcm");
    fs::write(&path, segmentation()).expect("written");
    let opened = read(&path, None);
    let grid = &opened.grid;
    assert_eq!(grid.lattice.dims, [2, 1, 2]);
    let found: Vec<f64> = (0..4).map(|i| grid.fields[0].samples.get(i)).collect();
    assert_eq!(found, [1.0, 0.0, 7.0, 7.0]);
    let [liver] = &grid.label_names[..] else { panic!("{:?}", grid.label_names) };
    assert_eq!((liver.value, liver.name.as_str(), liver.component), (1, "Liver", 0));
    let Some(Srgb8([r, g, b])) = liver.colour else { panic!("no colour") };
    assert!(r >= 252 && g <= 3 && b <= 3, "{r} {g} {b}");
    // As surfaces over a scan whose x and y point the other way.
    let scan = (&Lattice::unit([9; 3]), Some("right-anterior-superior"));
    let place = |theirs: &Lattice, space: Option<&str>| place_over((theirs, space), scan);
    let laid = labels::open(&path, None, place, &Ticket::new()).expect("labels");
    let names: Vec<&str> = laid.labels.iter().map(|label| label.mesh.name()).collect();
    assert_eq!(names, ["Liver", "Label 7"]);
    let [low, high] = laid.labels[1].mesh.bounds();
    // Half a sample beyond those at x of 0 and −1, y of 0 and z of 1.
    let is_near = |found: DVec3, expected: [f64; 3]| (found - DVec3::from(expected)).length() < 0.6;
    assert!(is_near(low, [-1.4, -0.4, 0.6]) && is_near(high, [0.4, 0.4, 1.4]), "{low} {high}");
}
