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

/// They took what the file might hold at most, a thousand times its length: 20 MB were refused.
#[test]
fn netcdf_4_takes_the_memory_of_its_file_and_its_variables() {
    let open_within = |limit: u64| {
        let options = OpenOptions { memory_limit_bytes: Some(limit), ..OpenOptions::default() };
        open(&folder().join("n4.nc"), &options, &Ticket::new())
    };
    assert!(open_within(1 << 20).is_ok(), "of 12 kB");
    let error = open_within(1 << 13).unwrap_err().to_string();
    assert!(error.contains("fit in memory"), "{error}");
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

/// The first by name, which says nothing, was asked alone.
#[test]
fn hdf5_lies_where_one_of_its_data_sets_says() {
    let several = read("several.h5").grid;
    let unit = several.unit.as_deref();
    assert_eq!((several.lattice.spacing, unit), (DVec3::new(0.25, 0.5, 2.0), Some("µm")));
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

/// One of these files with other bytes at some places.
#[track_caller]
fn read_with(name: &str, changes: &[(usize, &[u8])]) -> Opened {
    let mut bytes = std::fs::read(folder().join(name)).expect("a file of this repository");
    for (at, with) in changes {
        bytes[*at..at + with.len()].copy_from_slice(with);
    }
    let place = tempfile::tempdir().expect("a temporary folder");
    let path = place.path().join(name);
    std::fs::write(&path, bytes).expect("the folder is ours");
    open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn nifti_headers_mean_what_their_codes_say() {
    let float = |v: f32| v.to_le_bytes();
    let units = |code: u8| read_with("one.nii", &[(123, &[code])]).grid.unit;
    // With seconds in the upper bits, and without.
    assert_eq!([1, 9].map(units), [Some("m".to_owned()), Some("m".to_owned())]);
    assert_eq!([3, 11].map(units), [Some("µm".to_owned()), Some("µm".to_owned())]);
    let wide = read_with("two.nii", &[(500, &[0, 0, 0, 3])]);
    assert_eq!(wide.grid.unit.as_deref(), Some("µm"));
    // No sform, but a qform that turns nothing; mirrored along the third axis where qfac is −1.
    for (qfac, expected) in [(1.0, DVec3::Z), (-1.0, DVec3::NEG_Z)] {
        let turned = [(254, &[0, 0][..]), (252, &[1, 0]), (256, &[0; 12]), (76, &float(qfac))];
        assert_eq!(read_with("one.nii", &turned).grid.lattice.direction.z_axis, expected);
    }
    let scaled = read_with("one.nii", &[(112, &float(2.0)), (116, &float(-5.0))]);
    assert_eq!(scaled.grid.fields[0].samples.get(119), 543.0 * 2.0 - 5.0);
    // Colours are not scaled.
    let colours = [(46, &[4, 0][..]), (70, &[128, 0]), (72, &[24, 0]), (112, &float(2.0))];
    let colours = read_with("one.nii", &colours).grid;
    assert_eq!((colours.fields[0].components, colours.fields[0].samples.get(2)), (3, 1.0));
    // A fifth axis of three displacements is inside the samples.
    let vectors = [(40, &[5, 0, 5, 0, 4, 0, 2, 0, 1, 0, 3, 0][..]), (68, &[0xee, 3])];
    let vectors = read_with("one.nii", &vectors).grid;
    assert_eq!((vectors.fields.len(), vectors.fields[0].components), (1, 3));
    assert_eq!(vectors.fields[0].samples.get(1), 200.0);
}

#[test]
fn what_nifti_headers_leave_open_is_said() {
    let said = |changes: &[(usize, &[u8])]| read_with("one.nii", changes).warnings.join("\n");
    assert_eq!(said(&[]), "");
    assert!(said(&[(254, &[0, 0])]).contains("left and right may be swapped"));
    assert!(said(&[(254, &[0, 0]), (84, &[0; 4])]).contains("axis 1 has no spacing"));
    assert!(said(&[(280, &[0; 48])]).contains("the sform of the header makes no volume"));
    let float = |v: f32| v.to_le_bytes();
    let (two, nan, far) = (float(2.0), float(f32::NAN), float(f32::INFINITY));
    let ignored = "makes no numbers: they are as stored";
    assert!(said(&[(112, &two), (116, &nan)]).contains(ignored));
    assert!(said(&[(112, &far)]).contains(ignored));
    // These say that there is none.
    assert_eq!(said(&[(112, &nan)]), "");
}

#[test]
fn maps_lie_where_their_headers_say() {
    let long = |n: i32| n.to_le_bytes();
    let float = |v: f32| v.to_le_bytes();
    // Columns along y, rows along x; the cell's steps stay those of x, y and z.
    let turned = read_with("map.mrc", &[(64, &long(2)), (68, &long(1)), (72, &long(3))]).grid;
    assert_eq!(turned.lattice.spacing, DVec3::new(0.75, 0.5, 2.0));
    assert_eq!(turned.lattice.direction.x_axis, DVec3::Y);
    let (first, seven, nine) = ([2, -4, 1].map(long), float(7.0), float(9.0));
    let starts: [(usize, &[u8]); 3] = [(16, &first[0]), (20, &first[1]), (24, &first[2])];
    let begun = read_with("map.mrc", &starts).grid;
    assert_eq!(begun.lattice.origin, DVec3::new(1.0, -3.0, 2.0));
    // A stated origin is used rather than these.
    let origin = [&starts[..], &[(196, &seven), (204, &nine)]].concat();
    assert_eq!(read_with("map.mrc", &origin).grid.lattice.origin, DVec3::new(7.0, 0.0, 9.0));
    let oblique = read_with("map.mrc", &[(60, &float(120.0))]).grid.lattice.direction.y_axis;
    assert!((oblique - DVec3::new(-0.5, 0.75_f64.sqrt(), 0.0)).length() < 1e-6, "{oblique}");
    for (angle, is_said) in [(120.0, false), (0.5, true), (f32::NAN, true)] {
        let warnings = read_with("map.mrc", &[(60, &float(angle))]).warnings.join("\n");
        assert_eq!(warnings.contains("make no cell: right angles are used"), is_said, "{warnings}");
    }
    let stack = read_with("map.mrc", &[(88, &long(401)), (36, &long(3))]).grid;
    assert_eq!((stack.fields.len(), stack.lattice.dims), (2, [4, 5, 3]));
    assert_eq!(stack.fields[1].samples.get(0), 300.0);
    // Four pixels of an extended header of 8 bytes are none of the map.
    let behind = read_with("map.mrc", &[(8, &long(5)), (36, &long(5)), (92, &long(8))]);
    assert_eq!(behind.grid.fields[0].samples.get(0), 10.0);
    assert!(behind.warnings.join("\n").contains("more bytes follow the samples"));
}

#[test]
fn maps_have_the_numbers_that_their_modes_say() {
    let long = |n: i32| n.to_le_bytes();
    // Bits of a 16-bit float: 100 is 100 · 2⁻²⁴.
    let halves = read_with("map.mrc", &[(12, &long(12))]).grid;
    assert_eq!(halves.fields[0].samples.get(20), 100.0 / f64::from(1 << 24));
    let (stamp, flag) = (long(1_146_047_817), long(1));
    let bytes: [(usize, &[u8]); 2] = [(12, &[0; 4]), (1024, &[200])];
    assert_eq!(read_with("map.mrc", &bytes).grid.fields[0].samples.get(0), -56.0);
    let of_imod = [&bytes[..], &[(152, &stamp)]].concat();
    assert_eq!(read_with("map.mrc", &of_imod).grid.fields[0].samples.get(0), 200.0);
    let signed = [&of_imod[..], &[(156, &flag)]].concat();
    assert_eq!(read_with("map.mrc", &signed).grid.fields[0].samples.get(0), -56.0);
}

/// A TIFF of 16-bit or smaller greys, a strip a page.
struct Page {
    size: [u32; 2],
    bits: u32,
    /// Whether 0 is black, rather than white.
    black: u32,
    /// Pixels an inch along x and y, and what the page is described by.
    resolution: [u32; 2],
    description: &'static str,
    data: Vec<u8>,
}

fn tiff(big: bool, pages: &[Page]) -> Vec<u8> {
    let long = |n: u32| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let short = |n: u16| if big { n.to_be_bytes() } else { n.to_le_bytes() };
    let mut file = if big { b"MM\0*".to_vec() } else { b"II*\0".to_vec() };
    file.extend(long(0));
    let mut link = 4;
    for page in pages {
        let put = |file: &mut Vec<u8>, bytes: &[u8]| {
            file.resize(file.len().next_multiple_of(4), 0);
            file.extend(bytes);
            (file.len() - bytes.len()) as u32
        };
        let strip = put(&mut file, &page.data);
        let [across, down] = page.resolution.map(|n| put(&mut file, &[long(n), long(1)].concat()));
        let text = format!("{}\0\0\0\0", page.description);
        let words = put(&mut file, text.as_bytes());
        let entries = [
            (256, 4, 1, page.size[0]),
            (257, 4, 1, page.size[1]),
            (258, 3, 1, page.bits),
            (259, 3, 1, 1),
            (262, 3, 1, page.black),
            (270, 2, text.len() as u32, words),
            (273, 4, 1, strip),
            (277, 3, 1, 1),
            (278, 4, 1, page.size[1]),
            (279, 4, 1, page.data.len() as u32),
            (282, 5, 1, across),
            (283, 5, 1, down),
        ];
        let mut directory = short(entries.len() as u16).to_vec();
        for (tag, kind, count, value) in entries {
            directory.extend([short(tag), short(kind)].concat());
            directory.extend(long(count));
            match kind {
                3 => directory.extend([short(value as u16), [0; 2]].concat()),
                _ => directory.extend(long(value)),
            }
        }
        directory.extend(long(0));
        let at = put(&mut file, &directory);
        file[link..link + 4].copy_from_slice(&long(at));
        link = file.len() - 4;
    }
    file
}

#[track_caller]
fn read_tiff(big: bool, pages: &[Page]) -> Opened {
    let place = tempfile::tempdir().expect("a temporary folder");
    let path = place.path().join("v.tif");
    std::fs::write(&path, tiff(big, pages)).expect("the folder is ours");
    open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn pages_are_shown_as_they_are_stored_and_others_are_counted() {
    let page = |size, bits, black, data: &[u8]| Page {
        size,
        bits,
        black,
        resolution: [200, 100],
        description: "",
        data: data.to_vec(),
    };
    let all = |opened: &Opened| -> Vec<f64> {
        let samples = &opened.grid.fields[0].samples;
        (0..samples.len()).map(|i| samples.get(i)).collect()
    };
    // White is 0; and the first pixel is the most significant bit.
    assert_eq!(all(&read_tiff(false, &[page([2, 1], 8, 0, &[3, 250])])), [3.0, 250.0]);
    let bits = read_tiff(false, &[page([3, 1], 1, 1, &[0b1100_0000])]);
    assert_eq!(all(&bits), [1.0, 1.0, 0.0]);
    // Twice as many pixels an inch along x: they are half as wide as they are high.
    assert_eq!(bits.grid.lattice.spacing, DVec3::new(1.0, 2.0, 1.0));
    let mixed = read_tiff(false, &[page([2, 1], 8, 1, &[1, 2]), page([1, 1], 8, 1, &[3])]);
    assert_eq!(all(&mixed), [1.0, 2.0]);
    assert!(mixed.warnings.join("\n").contains("1 page of another size or type"));
}

#[test]
fn stacks_of_imagej_and_ome_are_what_their_descriptions_say() {
    let page = |description, data: &[u8], bits| Page {
        size: [2, 1],
        bits,
        black: 1,
        resolution: [4, 2],
        description,
        data: data.to_vec(),
    };
    // One page alone, with the others behind it.
    let stack = "ImageJ=1.53t\nimages=2\nslices=2\nunit=micron\nspacing=3\n";
    let large = read_tiff(true, &[page(stack, &[0, 1, 0, 2, 0, 3, 1, 0], 16)]);
    let found: Vec<f64> = (0..4).map(|i| large.grid.fields[0].samples.get(i)).collect();
    assert_eq!((found, large.grid.lattice.dims), (vec![1.0, 2.0, 3.0, 256.0], [2, 1, 2]));
    assert_eq!(large.grid.lattice.spacing, DVec3::new(0.25, 0.5, 3.0));
    // Of a stack that was cut off one page is left.
    let promise = "ImageJ=1.53t\nimages=9999\nslices=9999\n";
    let cut = read_tiff(false, &[page(promise, &[1, 2], 8)]);
    let said = cut.warnings.join("\n");
    assert!(said.contains("of another number than the 1 that there are"), "{said}");
    let ome = "<OME><Image><Pixels DimensionOrder=\"XYCZT\" SizeX=\"2\" SizeY=\"1\" SizeC=\"2\" \
        SizeZ=\"3\" SizeT=\"1\" PhysicalSizeX=\"2\" PhysicalSizeXUnit=\"nm\" PhysicalSizeY=\"2\"/>\
        </Image></OME>";
    let pages: Vec<Page> = (0..6).map(|i| page(ome, &[i, i], 8)).collect();
    let ome = read_tiff(false, &pages);
    assert_eq!((ome.grid.lattice.dims, ome.grid.unit.as_deref()), ([2, 1, 3], Some("nm")));
    // The second slice of the first channel.
    assert_eq!(ome.grid.fields[0].samples.get(2), 2.0);
}

#[test]
fn packed_or_indexed_bytes_that_were_altered_are_refused_though_they_make_numbers() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let refused = |path: &Path| open(path, &OpenOptions::default(), &Ticket::new()).is_err();
    let mut packed = std::fs::read(folder().join("one.nii.gz")).unwrap();
    let sum = packed.len() - 8;
    packed[sum] ^= 1;
    std::fs::write(place.path().join("one.nii.gz"), packed).unwrap();
    assert!(refused(&place.path().join("one.nii.gz")), "its checksum is wrong");
    let shards = place.path().join("shards.zarr");
    for name in ["zarr.json", "c/0/0/0", "c/1/0/0"] {
        std::fs::create_dir_all(shards.join(name).parent().unwrap()).unwrap();
        std::fs::copy(folder().join("shards.zarr").join(name), shards.join(name)).unwrap();
    }
    assert!(!refused(&shards));
    let mut shard = std::fs::read(shards.join("c/1/0/0")).unwrap();
    *shard.last_mut().unwrap() ^= 1;
    std::fs::write(shards.join("c/1/0/0"), shard).unwrap();
    assert!(refused(&shards), "the checksum of an index is wrong");
}

#[test]
fn the_first_channel_is_shown_alone_where_memory_has_room_for_no_more() {
    let options = OpenOptions { memory_limit_bytes: Some(800), ..OpenOptions::default() };
    let opened = open(&folder().join("pyramid.zarr"), &options, &Ticket::new()).unwrap();
    assert_eq!((opened.grid.fields.len(), opened.grid.lattice.dims), (1, [2, 3, 6]));
    let said = opened.warnings.join("\n");
    assert!(said.contains("the first is shown alone"), "{said}");
}

#[test]
fn data_sets_of_halves_and_colours_lie_as_their_attributes_say_and_others_are_named() {
    let opened = read_with("um.h5", &[]);
    let names: Vec<&str> = opened.grid.fields.iter().map(|f| f.name.as_str()).collect();
    assert_eq!((names, opened.grid.lattice.dims), (vec!["halves", "packed", "rgb"], [4, 3, 2]));
    // The distances are in the order of the axes: z first.
    assert_eq!(opened.grid.lattice.spacing, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(opened.grid.unit.as_deref(), Some("µm"));
    assert_eq!(
        (opened.grid.fields[0].samples.get(23), opened.grid.fields[2].components),
        (123.0, 3)
    );
    let said = opened.warnings.join("\n");
    assert!(said.contains("the data sets on other grids are ignored: other"), "{said}");
    // A byte of the packed numbers.
    let file = std::fs::read(folder().join("um.h5")).unwrap();
    let at = file.windows(2).position(|bytes| bytes == [0x78, 0x5e]).expect("packed by zlib");
    let damaged = read_with("um.h5", &[(at + 8, &[0xff])]);
    assert_eq!(damaged.grid.fields.len(), 2);
    let said = damaged.warnings.join("\n");
    assert!(said.contains("the data set \"packed\" is left out"), "{said}");
}

#[test]
fn maps_of_either_order_of_bytes_are_read() {
    let mut bytes = std::fs::read(folder().join("map.mrc")).unwrap();
    bytes[..1024].chunks_exact_mut(4).for_each(<[u8]>::reverse);
    bytes[208..212].copy_from_slice(b"MAP ");
    bytes[1024..].chunks_exact_mut(2).for_each(<[u8]>::reverse);
    let map = read_with("map.mrc", &[(0, &bytes)]).grid;
    assert!(is_the_volume(&map.fields[0], 0.0));
}
