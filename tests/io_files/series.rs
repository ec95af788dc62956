//! Several DICOM series in one folder, and segmentations.

use std::fs;
use std::path::Path;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::io::{OpenOptions, Opened, labels, open};
use voxsplat::scene::place_over;
use voxsplat::volume::{Lattice, Shape};

use crate::write_dicom::{Slice, element, number, text};
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

/// A slice of 2 × 2 pixels at a height, its pixels all `value`, and what of it is said otherwise (the last holds).
fn slice_with(z: f64, instance: u32, value: u16, more: &[Vec<u8>]) -> Vec<u8> {
    let pixels = value.to_le_bytes().repeat(4);
    let slice = Slice {
        series: "1.2.3",
        number: 1,
        description: "Head",
        z,
        instance,
        columns: 2,
        rows: 2,
        pixels: &pixels,
    };
    let mut file = slice.file();
    // Before the pixels, the last element: their 8 bytes, and 12 of its head.
    let at = file.len() - pixels.len() - 12;
    file.splice(at..at, more.concat());
    file
}

/// A folder of such slices, read.
fn read_slices(slices: &[Vec<u8>]) -> Opened {
    let folder = tempfile::tempdir().expect("a folder");
    for (index, slice) in slices.iter().enumerate() {
        fs::write(folder.path().join(format!("{index}.dcm")), slice).expect("written");
    }
    read(folder.path(), None)
}

fn place(x: f64, y: f64, z: f64) -> Vec<u8> {
    text([0x0020, 0x0032], b"DS", &format!("{x}\\{y}\\{z}"))
}

fn samples(opened: &Opened) -> Vec<f64> {
    (0..opened.grid.lattice.dims[2]).map(|z| opened.grid.fields[0].samples.get(4 * z)).collect()
}

#[test]
fn slices_apart_in_unlike_steps_are_shown_where_they_lie_and_said() {
    let slices = [0.0, 2.0, 6.0].map(|z| slice_with(z, 1 + z as u32, 0, &[]));
    let opened = read_slices(&slices);
    let Shape::Rectilinear(lists) = &opened.grid.shape else { panic!("{:?}", opened.grid.shape) };
    assert_eq!(lists[2][..], [0.0, 2.0, 6.0]);
    let said = opened.warnings.join("\n");
    assert!(said.contains("2.0000 to 4.0000 mm apart, as if 1 of them were missing"), "{said}");
}

#[test]
fn slices_of_a_tilted_gantry_are_sheared_and_said() {
    let slices = [0, 1, 2].map(|i| {
        let z = f64::from(i);
        slice_with(z, i + 1, 0, &[place(0.0, z, z)])
    });
    let opened = read_slices(&slices);
    let lattice = opened.grid.lattice;
    assert!((lattice.world_from_index(DVec3::Z * 2.0) - DVec3::new(0.0, 2.0, 2.0)).length() < 1e-9);
    let said = opened.warnings.join("\n");
    assert!(said.contains("lean by 45.0°") && said.contains("sheared"), "{said}");
}

#[test]
fn slices_that_are_left_out_are_counted() {
    let whole = [0, 1, 2].map(|z| slice_with(f64::from(z), z + 1, 7, &[]));
    let with = |more: &[Vec<u8>], z: f64| {
        let other = slice_with(z, 9, 1, more);
        let opened = read_slices(&[&whole[..], &[other]].concat());
        assert_eq!(samples(&opened), [7.0; 3]);
        opened.warnings.join("\n")
    };
    let coronal = text([0x0020, 0x0037], b"DS", "1\\0\\0\\0\\0\\-1");
    let wide = text([0x0028, 0x0030], b"DS", "2\\2");
    for (other, z) in [(coronal, 3.0), (wide, 3.0)] {
        let said = with(&[other], z);
        assert!(said.contains("1 slice lies in another plane"), "{said}");
    }
    let said = with(&[], 1.0);
    assert!(said.contains("1 slice lies where others do: the first of each place"), "{said}");
    let said = with(&[text([0x0020, 0x0032], b"DS", "")], 3.0);
    assert!(said.contains("1 pictures that do not say where they lie are left out"), "{said}");
}

#[test]
fn pictures_without_a_place_are_stacked_by_their_numbers() {
    let nowhere = text([0x0020, 0x0032], b"DS", "");
    let pictures = [3, 1, 2].map(|instance| {
        let number = text([0x0020, 0x0013], b"IS", &instance.to_string());
        let thick = text([0x0018, 0x0050], b"DS", "2.5");
        slice_with(0.0, instance, instance as u16, &[nowhere.clone(), number, thick])
    });
    let opened = read_slices(&pictures);
    assert_eq!(samples(&opened), [1.0, 2.0, 3.0]);
    assert_eq!((opened.grid.lattice.spacing.z, opened.grid.space), (2.5, None));
    let said = opened.warnings.join("\n");
    assert!(said.contains("stacked in their order, and they are as far apart as they are thick"));
    // Frames that share one place have none each.
    let halves = [text([0x0028, 0x0008], b"IS", "2"), number([0x0028, 0x0010], 1)];
    let opened = read_slices(&[slice_with(4.0, 1, 0, &halves)]);
    assert_eq!((opened.grid.lattice.dims, opened.grid.space), ([2, 1, 2], None));
}

#[test]
fn distances_of_pixels_and_slices_are_those_that_are_told() {
    let of = |more: &[Vec<u8>]| read_slices(&[slice_with(0.0, 1, 0, more)]);
    let spacing = |group: u16, element: u16, words: &str| text([group, element], b"DS", words);
    // Of rows first.
    let unlike = of(&[spacing(0x28, 0x30, "3\\2"), spacing(0x18, 0x50, "5")]);
    assert_eq!(unlike.grid.lattice.spacing, DVec3::new(2.0, 3.0, 5.0));
    let both = of(&[spacing(0x18, 0x50, "5"), spacing(0x18, 0x88, "4")]);
    assert_eq!(both.grid.lattice.spacing.z, 4.0);
    let radiograph = of(&[spacing(0x28, 0x30, ""), spacing(0x18, 0x1164, "0.2\\0.1")]);
    assert_eq!(radiograph.grid.lattice.spacing, DVec3::new(0.1, 0.2, 1.0));
    let said = of(&[spacing(0x28, 0x30, "")]).warnings.join("\n");
    assert!(said.contains("nothing tells the distance of pixels: 1 mm is used"), "{said}");
}

#[test]
fn each_slice_is_rescaled_by_its_own_numbers() {
    let scaled = |z: u32, slope: &str, intercept: &str| {
        let scale = [text([0x28, 0x1053], b"DS", slope), text([0x28, 0x1052], b"DS", intercept)];
        slice_with(f64::from(z), z + 1, 10, &scale)
    };
    let unlike = read_slices(&[scaled(0, "0.5", "1"), scaled(1, "2", "-3")]);
    assert_eq!(samples(&unlike), [6.0, 17.0]);
    let alike = read_slices(&[scaled(0, "2", "-1024"), scaled(1, "2", "-1024")]);
    assert_eq!(samples(&alike), [-1004.0; 2]);
}

#[test]
fn what_the_numbers_of_pictures_mean_and_is_not_shown_is_said() {
    let said = |more: Vec<u8>| read_slices(&[slice_with(0.0, 1, 0, &[more])]).warnings.join("\n");
    let meaning = |words: &str| text([0x0028, 0x0004], b"CS", words);
    assert!(said(meaning("MONOCHROME1")).contains("low values are meant to be bright"));
    assert!(said(meaning("PALETTE COLOR")).contains("the palette is ignored"));
    let item = [&[0xfe, 0xff, 0x00, 0xe0][..], &[0; 4]].concat();
    assert!(said(element([0x0028, 0x3000], b"SQ", &item)).contains("Modality LUT"));
}

#[test]
fn stored_bits_alone_are_shown_and_colours_in_planes_are_brought_together() {
    let twelve = [number([0x28, 0x101], 12), number([0x28, 0x102], 11)];
    let overlaid = read_slices(&[slice_with(0.0, 1, 0xf123, &twelve)]);
    assert_eq!(overlaid.grid.fields[0].samples.get(0), f64::from(0x123));
    // Two pixels of two numbers of 16 bits: 1, 2 in one plane, and 3, 4 in the other.
    let mut file = slice_with(
        0.0,
        1,
        0,
        &[number([0x28, 2], 2), number([0x28, 6], 1), number([0x28, 0x10], 1)],
    );
    let at = file.len() - 8;
    file[at..].copy_from_slice(&[1, 0, 2, 0, 3, 0, 4, 0]);
    let mixed = read_slices(&[file]);
    let found: Vec<f64> = (0..4).map(|i| mixed.grid.fields[0].samples.get(i)).collect();
    assert_eq!(found, [1.0, 3.0, 2.0, 4.0]);
}

#[test]
fn pixels_of_one_bit_go_on_from_frame_to_frame() {
    let frame = |z: u32| {
        let item = |content: &[u8]| {
            [&[0xfe, 0xff, 0x00, 0xe0], &(content.len() as u32).to_le_bytes()[..], content].concat()
        };
        item(&element([0x20, 0x9113], b"SQ", &item(&place(0.0, 0.0, f64::from(z)))))
    };
    let one_bit = [(0x100, 1), (0x101, 1), (0x102, 0), (0x10, 1), (0x11, 3)];
    let mut more: Vec<Vec<u8>> = one_bit.map(|(which, n)| number([0x28, which], n)).to_vec();
    more.push(text([0x28, 8], b"IS", "2"));
    more.push(element([0x5200, 0x9230], b"SQ", &[frame(0), frame(1)].concat()));
    // The least bit first: 1, 0, 0, then 1, 1, 0.
    let opened = read_slices(&[slice_with(0.0, 1, 0b011001, &more)]);
    assert_eq!(opened.grid.lattice.dims, [3, 1, 2]);
    let found: Vec<f64> = (0..6).map(|i| opened.grid.fields[0].samples.get(i)).collect();
    assert_eq!(found, [1.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn fragments_of_packed_frames_are_found_by_their_offsets() {
    let item = |content: &[u8]| {
        [&[0xfe, 0xff, 0x00, 0xe0], &(content.len() as u32).to_le_bytes()[..], content].concat()
    };
    // Four pixels of 16 bits in runs: two planes, in a head of 64 bytes; split behind it.
    let frame = |value: u8| {
        let mut head = vec![0; 64];
        head[0] = 2;
        head[4] = 64;
        head[8] = 66;
        [item(&head), item(&[253, 0, 253, value])].concat()
    };
    let frames = [frame(5), frame(6)];
    let offsets = [0_u32, frames[0].len() as u32].map(u32::to_le_bytes).concat();
    let mut file = slice_with(0.0, 1, 0, &[text([0x28, 8], b"IS", "2")]);
    file.truncate(file.len() - 20);
    file.extend([0xe0, 0x7f, 0x10, 0, b'O', b'B', 0, 0, 0xff, 0xff, 0xff, 0xff]);
    file.extend([item(&offsets), frames.concat()].concat());
    file.extend([0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]);
    // Explicit and plain becomes packed in runs.
    let plain = b"1.2.840.10008.1.2.1\0";
    let at = file.windows(plain.len()).position(|bytes| bytes == plain).expect("a syntax");
    file[at + 18] = b'5';
    assert_eq!(samples(&read_slices(&[file])), [5.0, 6.0]);
}

#[test]
fn labels_are_named_by_their_layer_and_lie_where_their_field_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let laid = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).expect("written");
        let place = |lattice: &Lattice, _: Option<&str>| {
            (glam::DAffine3::from_translation(lattice.origin), Some("they lie so"))
        };
        labels::open(&path, None, place, &Ticket::new())
    };
    let layers = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 1 1 1\nencoding: txt\n\
        kinds: vector domain domain domain\n\
        Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n\
        Segment1_Name:=spleen\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n\n1 1\n";
    let laid_out = laid("v.nrrd", layers).expect("labels");
    let names: Vec<&str> = laid_out.labels.iter().map(|label| label.mesh.name()).collect();
    assert_eq!(names, ["liver", "spleen"]);
    assert!(laid_out.warnings.contains(&"they lie so".to_owned()), "{:?}", laid_out.warnings);
    let cells = "<VTKFile type='ImageData' byte_order='LittleEndian'><ImageData \
        WholeExtent='0 1 0 1 0 1'><Piece Extent='0 1 0 1 0 1'><CellData><DataArray type='UInt8' \
        Name='a' format='ascii'>3</DataArray></CellData></Piece></ImageData></VTKFile>";
    let [low, high] = laid("v.vti", cells).expect("labels").labels[0].mesh.bounds();
    assert!(((low + high) / 2.0 - DVec3::splat(0.5)).length() < 1e-6, "{low} {high}");
    let uneven = cells
        .replace(
            "<CellData>",
            "<Coordinates><DataArray type='Float32' format='ascii'>0 1</DataArray>\
            <DataArray type='Float32' format='ascii'>0 1</DataArray><DataArray type='Float32' \
            format='ascii'>0 5</DataArray></Coordinates><CellData>",
        )
        .replace("ImageData", "RectilinearGrid");
    let refused = laid("v.vtr", &uneven).unwrap_err().to_string();
    assert!(refused.contains("labels on an evenly spaced grid"), "{refused}");
}
