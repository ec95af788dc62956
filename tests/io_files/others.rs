//! Small files by the writers that people have (h5py, netCDF4, zarr, tifffile, numpy, pydicom): `tests/data/readers`.

use std::path::{Path, PathBuf};

use glam::DVec3;
use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, Opened, open};
use voxsplat::volume::{Field, ScalarType};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/readers")
}

#[track_caller]
fn read(name: &str) -> Opened {
    match open(&folder().join(name), &OpenOptions::default(), &Ticket::new()) {
        Ok(opened) => opened,
        Err(error) => panic!("{error}"),
    }
}

/// Whether a field is 4 × 5 × 6 samples of x + 10 y + 100 z.
fn is_the_volume(field: &Field, plus: f64) -> bool {
    let value = |i: usize| (i % 4 + 10 * (i / 4 % 5) + 100 * (i / 20)) as f64 + plus;
    field.samples.len() == 120 && (0..120).all(|i| field.samples.get(i) == value(i))
}

#[test]
fn the_same_volume_is_read_of_every_writer() {
    for name in [
        "one.nii",
        "one.nii.gz",
        "two.nii",
        "pair.hdr",
        "pair.img",
        "map.mrc",
        "fortran.npy",
        "two.npz",
        "two_c.npz",
        "plain.h5",
        "itk.h5",
        "n4.nc",
        "c_lzw.tif",
        "c_zlib.tif",
        "c_packbits.tif",
        "lz4.zarr",
        "zstd.zarr",
        "shards.zarr",
        "shards.zarr/zarr.json",
        "lz4.zarr/.zarray",
        "pyramid.zarr",
    ] {
        let opened = read(name);
        assert_eq!(opened.grid.lattice.dims, [4, 5, 6], "{name}");
        assert!(is_the_volume(&opened.grid.fields[0], 0.0), "{name}: {:?}", opened.grid.fields[0]);
    }
}

#[test]
fn lengths_and_places_are_those_that_each_format_tells() {
    let of = |name: &str| {
        let grid = read(name).grid;
        (grid.lattice, grid.unit, grid.space)
    };
    let (sform, unit, space) = of("one.nii");
    assert_eq!(sform.world_from_index(DVec3::new(2.0, 1.0, 1.0)), DVec3::new(9.0, -19.25, 7.0));
    assert_eq!((unit.as_deref(), space.as_deref()), (Some("mm"), Some("right-anterior-superior")));
    let (qform, _, space) = of("two.nii");
    assert_eq!(qform.world_from_index(DVec3::new(2.0, 1.0, 1.0)), DVec3::new(11.0, -19.25, 7.0));
    assert_eq!(space.as_deref(), Some("right-anterior-superior"));
    let (pair, _, _) = of("pair.hdr");
    assert_eq!(pair, sform);
    let (map, unit, _) = of("map.mrc");
    assert_eq!((map.spacing, unit.as_deref()), (DVec3::new(0.5, 0.75, 2.0), Some("Å")));
    let (itk, unit, _) = of("itk.h5");
    assert_eq!((itk.spacing, itk.origin), (DVec3::new(0.5, 0.6, 0.7), DVec3::new(1.0, 2.0, 3.0)));
    // Rows of its matrix are (0, −1, 0), (1, 0, 0).
    assert_eq!((itk.direction.x_axis, unit.as_deref()), (DVec3::Y, Some("mm")));
    let (pyramid, unit, _) = of("pyramid.zarr");
    assert_eq!((pyramid.spacing, unit.as_deref()), (DVec3::new(0.25, 0.5, 2.0), Some("µm")));
    assert_eq!(pyramid.origin, DVec3::new(2.0, 1.0, 0.0));
    let (imagej, unit, _) = of("ij.tif");
    assert_eq!((imagej.spacing, unit.as_deref()), (DVec3::new(0.25, 0.25, 0.75), Some("µm")));
    let (ome, unit, _) = of("ome.ome.tif");
    assert_eq!((ome.spacing, unit.as_deref()), (DVec3::new(0.1, 0.2, 0.3), Some("µm")));
}

#[test]
fn arrays_channels_and_times_are_fields() {
    let names = |opened: &Opened| -> Vec<String> {
        opened.grid.fields.iter().map(|field| field.name.clone()).collect()
    };
    let pyramid = read("pyramid.zarr");
    assert_eq!(names(&pyramid), ["DAPI", "GFP"]);
    assert!(is_the_volume(&pyramid.grid.fields[1], 1.0));
    let archive = read("two_c.npz");
    assert_eq!(names(&archive), ["a", "b"]);
    // 16-bit floats.
    assert_eq!(archive.grid.fields[1].samples.scalar_type(), ScalarType::Float32);
    assert!(is_the_volume(&archive.grid.fields[1], 0.0));
    let several = read("several.h5");
    assert_eq!(names(&several), ["be", "g/labels", "raw"]);
    assert!(
        is_the_volume(&several.grid.fields[0], 0.0) && is_the_volume(&several.grid.fields[2], 0.0)
    );
    assert_eq!(several.grid.fields[1].samples.get(60), 1.0, "a truth");
    // Times, slices, channels, rows, columns; counted in that order.
    let stack = read("ij.tif");
    assert_eq!((stack.grid.fields.len(), stack.grid.lattice.dims), (6, [6, 5, 4]));
    assert_eq!(stack.grid.fields[1].samples.get(0), 30.0, "the second channel");
    assert_eq!(stack.grid.fields[2].samples.get(0), 240.0, "the second time");
    assert_eq!(stack.grid.fields[0].samples.get(30), 60.0, "the second slice");
    let ome = read("ome.ome.tif");
    assert_eq!((ome.grid.fields.len(), ome.grid.fields[1].samples.get(30)), (2, 90.0));
}

#[test]
fn a_finer_level_is_shown_where_memory_has_room_for_it() {
    let options = OpenOptions { memory_limit_bytes: Some(1500), ..OpenOptions::default() };
    let opened = open(&folder().join("pyramid.zarr"), &options, &Ticket::new()).unwrap();
    assert_eq!(opened.grid.lattice.dims, [2, 3, 6]);
    assert_eq!(opened.grid.lattice.spacing, DVec3::new(0.5, 1.0, 2.0));
    assert!(opened.warnings.iter().any(|w| w.contains("level 2 of 2")), "{:?}", opened.warnings);
}

#[test]
fn packed_dicom_pixels_are_those_that_were_packed() {
    let plain = read("plain.dcm");
    let expected = &plain.grid.fields[0].samples;
    assert_eq!(
        (plain.grid.lattice.dims, expected.scalar_type()),
        ([16, 12, 1], ScalarType::UInt16)
    );
    for name in ["rle.dcm", "jls.dcm", "j2k.dcm", "ljpeg.dcm"] {
        assert_eq!(&read(name).grid.fields[0].samples, expected, "{name}");
    }
    let signed = read("rle_signed.dcm");
    for i in 0..expected.len() {
        assert_eq!(signed.grid.fields[0].samples.get(i), expected.get(i) - 800.0);
    }
    let colours = read("jpeg.dcm");
    assert_eq!((colours.grid.fields[0].components, colours.grid.lattice.dims), (3, [16, 16, 1]));
    // Lossy.
    assert!((colours.grid.fields[0].samples.get(0) - 200.0).abs() < 12.0);
}
