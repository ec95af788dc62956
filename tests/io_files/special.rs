//! The less common ways to say the same thing.

use std::path::Path;

use glam::DVec3;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::io::{OpenOptions, Opened, Problem, describe, open, probe};
use voxsplat::volume::Samples;

fn put(folder: &Path, name: &str, content: impl AsRef<[u8]>) {
    std::fs::write(folder.join(name), content).expect("the temporary folder is ours");
}

#[track_caller]
fn read(folder: &Path, name: &str) -> Opened {
    match open(&folder.join(name), &OpenOptions::default(), &Ticket::new()) {
        Ok(opened) => opened,
        Err(error) => panic!("{error}"),
    }
}

#[track_caller]
fn read_one(name: &str, content: impl AsRef<[u8]>) -> Opened {
    let folder = tempfile::tempdir().expect("a temporary folder");
    put(folder.path(), name, content);
    read(folder.path(), name)
}

fn bytes(opened: &Opened, field: usize) -> Vec<u8> {
    match &*opened.grid.fields[field].samples {
        Samples::UInt8(values) => values.clone(),
        other => panic!("bytes were written, not {:?}", other.scalar_type()),
    }
}

#[test]
fn content_wins_over_extension() {
    let text = "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 2\nencoding: raw\n\nab";
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "v.raw", text);
    assert_eq!(probe(&folder.path().join("v.raw")).unwrap().name(), "nrrd");
    assert_eq!(bytes(&read(folder.path(), "v.raw"), 0), b"ab");
}

#[test]
fn nrrd_data_in_several_files_by_list_pattern_and_slab() {
    let folder = tempfile::tempdir().unwrap();
    let base = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 4\nencoding: raw\n";
    for i in 0..4_u8 {
        put(folder.path(), &format!("s{:02}.raw", i + 8), [i, i + 10]);
    }
    put(folder.path(), "ab", [0, 10, 1, 11]);
    put(folder.path(), "cd", [2, 12, 3, 13]);
    let heads = [
        "data file: s%02d.raw 8 11 1\n",
        "data file: s%02d.raw 8 11 1 2\n",
        "data file: LIST\ns08.raw\ns09.raw\ns10.raw\ns11.raw\n",
        "datafile: LIST 2\ns08.raw\r\ns09.raw\ns10.raw\ns11.raw",
        "data file: LIST 3\nab\ncd\n",
    ];
    for head in heads {
        put(folder.path(), "v.nhdr", format!("{base}{head}"));
        let opened = read(folder.path(), "v.nhdr");
        assert_eq!(bytes(&opened, 0), [0, 10, 1, 11, 2, 12, 3, 13], "{head}");
        assert_eq!(opened.warnings, Vec::<String>::new());
    }
}

#[test]
fn nrrd_skips_lines_bytes_or_all_but_the_end() {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "v.dat", "one\ntwo\nxxabcd");
    for skip in ["line skip: 2\nbyte skip: 2", "byte skip: 10", "byte skip: -1"] {
        let head = "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4\nencoding: raw\n";
        put(folder.path(), "v.nhdr", format!("{head}{skip}\ndata file: v.dat\n"));
        assert_eq!(bytes(&read(folder.path(), "v.nhdr"), 0), b"abcd", "{skip}");
    }
}

#[test]
fn nrrd_takes_the_end_of_what_was_packed() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let content = b"a header of any length abcd";
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(content).unwrap();
    let mut bzip2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    bzip2.write_all(content).unwrap();
    for (encoding, packed) in [("gzip", gzip.finish().unwrap()), ("bzip2", bzip2.finish().unwrap())]
    {
        put(folder.path(), "v.dat", packed);
        let head = "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4\nbyte skip: -1\n";
        put(folder.path(), "v.nhdr", format!("{head}encoding: {encoding}\ndata file: v.dat\n"));
        assert_eq!(bytes(&read(folder.path(), "v.nhdr"), 0), b"abcd", "{encoding}");
    }
}

#[test]
fn packed_data_are_refused_where_they_hold_more_or_other_than_was_written() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let head = "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 8\nencoding: gzip\n\n";
    let file = |content: &[u8], flip: bool| {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
        gzip.write_all(content).unwrap();
        let mut packed = gzip.finish().unwrap();
        // A byte of the stored samples; their checksum lies behind them.
        let at = packed.len() - 12;
        packed[at] ^= u8::from(flip);
        let path = folder.path().join("v.nrrd");
        std::fs::write(&path, [head.as_bytes(), &packed].concat()).unwrap();
        open(&path, &OpenOptions::default(), &Ticket::new())
    };
    assert!(file(b"abcdefgh", false).is_ok());
    for (content, flip) in [(&b"abcdefgh"[..], true), (b"abcdefghi", false)] {
        let error = file(content, flip).unwrap_err();
        assert!(matches!(error.problem, Problem::Corrupt(_)), "{error}");
    }
}

#[test]
fn segments_that_name_no_label_or_one_twice_are_said() {
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n\
        Segment0_Name:=liver\nSegment0_LabelValue:=1\nSegment1_Name:=spleen\nSegment1_LabelValue:=1\n\
        Segment2_Name:=vast\nSegment2_LabelValue:=99999999999999999999\n\nab";
    let opened = read_one("seg.nrrd", text);
    let names: Vec<&str> = opened.grid.label_names.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["liver"]);
    let said = opened.warnings.join("\n");
    assert!(said.contains("1 is called \"liver\" and \"spleen\""), "{said}");
    assert!(said.contains("\"vast\" names no label") && said.contains("9999"), "{said}");
}

#[test]
fn nrrd_lists_become_fields_and_say_so() {
    let text = "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 2 1 1 3\nencoding: raw\n\
        space: right-anterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2) none\n\
        kinds: domain domain domain list\n\nabcdef";
    let opened = read_one("dwi.nrrd", text);
    let names: Vec<&str> = opened.grid.fields.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["dwi[0]", "dwi[1]", "dwi[2]"]);
    assert_eq!(bytes(&opened, 2), b"ef");
    assert!(opened.warnings[0].contains("3 volumes"), "{:?}", opened.warnings);
    // The same with a list in front: its samples are brought together.
    let text = text
        .replace("2 1 1 3", "3 2 1 1")
        .replace("(1,0,0) (0,1,0) (0,0,2) none", "none (1,0,0) (0,1,0) (0,0,2)")
        .replace("domain domain domain list", "list domain domain domain");
    assert_eq!(bytes(&read_one("dwi.nrrd", text), 2), b"cf");
}

#[test]
fn nrrd_without_kinds_in_four_dimensions_guesses_and_says_so() {
    let head = "NRRD0001\ntype: uchar\ndimension: 4\nencoding: raw\n";
    let vectors = read_one("v.nrrd", format!("{head}sizes: 3 10 10 10\n\n{}", "x".repeat(3000)));
    assert_eq!((vectors.grid.fields[0].components, vectors.grid.lattice.dims), (3, [10; 3]));
    assert!(vectors.warnings[0].contains("axis 0 of size 3"), "{:?}", vectors.warnings);
    let list = read_one("v.nrrd", format!("{head}sizes: 10 10 10 3\n\n{}", "x".repeat(3000)));
    assert_eq!(list.grid.fields.len(), 3);
}

#[test]
fn nrrd_places_samples_by_mins_and_centerings_where_there_are_no_directions() {
    let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n";
    let data = "x".repeat(24);
    let opened = read_one(
        "v.nrrd",
        format!(
            "{head}axis mins: 10 20 nan\naxis maxs: 14 26 nan\ncenters: cell node ???\n\
             thicknesses: nan nan 2.5\n\n{data}"
        ),
    );
    let lattice = opened.grid.lattice;
    assert_eq!(lattice.spacing.to_array(), [2.0, 3.0, 2.5]);
    assert_eq!(lattice.origin.to_array(), [11.0, 20.0, 0.0]);
    assert!(opened.warnings[0].contains("thickness"), "{:?}", opened.warnings);
}

#[test]
fn metaimage_flat_listed_and_with_a_header_to_skip() {
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "a1", [9, 9, 1, 2]);
    put(folder.path(), "a2", [9, 9, 3, 4]);
    let head = "NDims = 2\nDimSize = 2 2\nElementType = MET_UCHAR\nElementSpacing = 2 3 7\n";
    for (skip, place) in [
        ("HeaderSize = 2", "LIST\na1\na2\n"),
        ("HeaderSize = -1", "LIST 1\na1\na2\n"),
        ("HeaderSize = 2", "a%d 1 2 1\n"),
    ] {
        put(folder.path(), "v.mhd", format!("{head}{skip}\nElementDataFile = {place}"));
        let opened = read(folder.path(), "v.mhd");
        assert_eq!(bytes(&opened, 0), [1, 2, 3, 4], "{skip} {place}");
        assert_eq!(opened.grid.lattice.dims, [2, 2, 1]);
        assert_eq!(opened.grid.lattice.spacing.to_array(), [2.0, 3.0, 1.0]);
        assert!(opened.warnings[0].contains("2 are used"), "{:?}", opened.warnings);
    }
}

#[test]
fn metaimage_in_four_dimensions_becomes_fields() {
    let text = "ObjectType = Image\r\nNDims = 4\r\nDimSize = 2 1 1 2\r\n\
        ElementSpacing = 1 2 3 4\r\nElementType = MET_UCHAR\r\nFoo = bar\r\n\
        ElementDataFile = LOCAL\r\nabcd";
    let opened = read_one("t.mha", text);
    assert_eq!((bytes(&opened, 0), bytes(&opened, 1)), (b"ab".to_vec(), b"cd".to_vec()));
    assert_eq!(opened.grid.lattice.spacing.to_array(), [1.0, 2.0, 3.0]);
    assert!(opened.warnings.iter().any(|w| w.contains("Foo")), "{:?}", opened.warnings);
}

#[test]
fn vti_puts_the_active_array_first_and_shifts_the_origin_to_the_first_point() {
    let array = |name: &str, text: &str| {
        format!("<DataArray type=\"UInt8\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    let text = format!(
        "<VTKFile type='ImageData' byte_order='LittleEndian'><ImageData WholeExtent='4 5 0 0 0 1' \
         Origin='1 2 3' Spacing='10 1 1'><FieldData/><Piece Extent='4 5 0 0 0 1'><PointData \
         Scalars='b'>{}{}<DataArray type='String' Name='s' format='ascii'>7</DataArray>\
         </PointData><CellData>{}</CellData></Piece></ImageData></VTKFile>",
        array("a", "1 2 3 4"),
        array("b", "5 6 7 8"),
        array("c", "9"),
    );
    let opened = read_one("v.vti", text);
    let names: Vec<&str> = opened.grid.fields.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["b", "a", "c"]);
    assert_eq!((bytes(&opened, 0), bytes(&opened, 2)), (vec![5, 6, 7, 8], vec![9]));
    assert_eq!(opened.grid.lattice.origin.to_array(), [41.0, 2.0, 3.0]);
    assert!(opened.warnings.iter().any(|w| w.contains("\"s\"")), "{:?}", opened.warnings);
}

#[test]
fn a_raw_name_is_enough_and_assumptions_are_told() {
    let opened = read_one("v_2x2x2_uint16.raw", [0, 1].repeat(8));
    assert_eq!(*opened.grid.fields[0].samples, Samples::UInt16(vec![256; 8]));
    assert!(opened.warnings[0].contains("little"), "{:?}", opened.warnings);
    let longer = read_one("v_2x2x2_uint8.raw", b"123456789");
    assert!(longer.warnings[0].contains("1 bytes follow"), "{:?}", longer.warnings);
}

#[test]
fn info_has_the_names_that_scripts_use() {
    let text = "NRRD0004\ntype: float\ndimension: 2\nsizes: 2 2\nencoding: txt\n\
        spacings: 2 3\n\n1 nan 3 inf\n";
    let info = describe(&read_one("v.nrrd", text), &Ticket::new()).unwrap();
    let json = serde_json::to_value(&info).unwrap();
    let expected = serde_json::json!({
        "format": "nrrd", "kind": "grid", "dims": [2, 2, 1], "spacing": [2.0, 3.0, 1.0],
        "origin": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "space": null, "warnings": [],
        "fields": [{
            "name": "v", "components": 1, "is_vectors": false, "scalar_type": "float32", "association": "point",
            "min": 1.0, "max": 3.0, "mean": 2.0, "nan_count": 1, "infinite_count": 1,
        }],
    });
    assert_eq!(json, expected);
    let text = info.to_string();
    assert!(text.contains("2 × 2 × 1") && text.contains("1 NaN, 1 infinite"), "{text}");
}

#[test]
fn a_field_without_any_number_has_no_extremes_in_info() {
    let text = "NRRD0004\ntype: float\ndimension: 1\nsizes: 2\nencoding: txt\n\nnan nan\n";
    let info = describe(&read_one("v.nrrd", text), &Ticket::new()).unwrap();
    assert_eq!(
        (info.fields[0].min, info.fields[0].mean, info.fields[0].nan_count),
        (None, None, 2)
    );
}

#[test]
fn units_of_length_are_read_where_a_file_or_its_format_says() {
    let unit = |name: &str, content: &str| read_one(name, content).grid.unit;
    let nrrd = |more: &str| {
        let head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n";
        unit("v.nrrd", &format!("{head}{more}\nab"))
    };
    let directions = "space directions: (1,0,0) (0,1,0) (0,0,1)\n";
    let space = format!("space: left-posterior-superior\n{directions}");
    let told = nrrd(&format!("{space}space units: \"mm\" \"mm\" \"mm\"\n"));
    assert_eq!(told.as_deref(), Some("mm"));
    let mixed = nrrd(&format!("{space}space units: \"mm\" \"mm\" \"s\"\n"));
    assert_eq!(mixed, None, "no one unit");
    assert_eq!(nrrd("units: \"um\" \"um\" \"microns\"\n").as_deref(), Some("µm"), "of its axes");
    assert_eq!(nrrd(""), None, "not told");
    assert_eq!(nrrd(&space).as_deref(), Some("mm"), "of a patient, and silent");
    assert_eq!(nrrd(&space.replace("left-posterior-superior", "RAS")).as_deref(), Some("mm"));
    assert_eq!(nrrd(&space.replace("left-posterior-superior", "3D-left-handed")), None);
    let meta = "ObjectType = Image\nNDims = 3\nDimSize = 2 1 1\nElementType = MET_UCHAR\n\
                ElementDataFile = LOCAL\nab";
    assert_eq!(unit("v.mha", meta).as_deref(), Some("mm"), "the format's own");
}

#[test]
fn what_an_nrrd_header_leaves_open_or_is_ignored_of_it_is_said() {
    let said = |text: &str| read_one("v.nrrd", text).warnings.join("\n");
    let short = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n";
    assert!(said(&format!("{short}\nabcd")).contains("byte order: little is assumed"));
    let told = format!("{short}endian: little\n");
    assert_eq!(said(&format!("{told}\nabcd")), "");
    let newer = format!("{told}\nabcd").replace("NRRD0004", "NRRD0009");
    assert!(said(&newer).contains("NRRD version 9 is read as version 5"));
    let none = format!("{told}space dimension: 3\nspace directions: none none none\n\nabcd");
    assert!(said(&none).contains("no axis has a space direction"));
    let vectors = "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 3 2 1 1\nencoding: raw\n\
        space dimension: 3\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n\
        kinds: vector domain domain domain\nmeasurement frame: (0,1,0) (1,0,0) (0,0,1)\n\nabcdef";
    assert!(said(vectors).contains("the measurement frame is ignored"));
}

#[test]
fn nrrd_skips_bytes_of_what_was_unpacked() {
    use std::io::Write;
    let folder = tempfile::tempdir().unwrap();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(b"xxxabcd").unwrap();
    let mut bzip2 = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    bzip2.write_all(b"xxxabcd").unwrap();
    for (encoding, packed) in [("gzip", gzip.finish().unwrap()), ("bzip2", bzip2.finish().unwrap())]
    {
        let head = "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4\nbyte skip: 3\n";
        let head = format!("{head}encoding: {encoding}\n\n");
        put(folder.path(), "v.nrrd", [head.as_bytes(), &packed].concat());
        assert_eq!(bytes(&read(folder.path(), "v.nrrd"), 0), b"abcd", "{encoding}");
    }
}

#[test]
fn a_time_axis_of_a_patients_space_is_no_space_and_components_have_no_say_in_its_unit() {
    let timed = read_one(
        "v.nrrd",
        "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 2 1 1 3\nencoding: raw\n\
         space: right-anterior-superior-time\n\
         space directions: (1,0,0,0) (0,1,0,0) (0,0,2,0) (0,0,0,1)\n\nabcdef",
    );
    assert_eq!((timed.grid.fields.len(), timed.grid.unit.as_deref()), (3, Some("mm")));
    assert_eq!(timed.warnings.len(), 1, "nothing is guessed: {:?}", timed.warnings);
    let velocity = read_one(
        "v.nrrd",
        "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 3 2 1 1\nencoding: raw\n\
         kinds: vector domain domain domain\nunits: \"m/s\" \"mm\" \"mm\" \"mm\"\n\nabcdef",
    );
    assert_eq!(velocity.grid.unit.as_deref(), Some("mm"));
    // Nothing tells components from times: small first axes are the former only beside large ones.
    let text = format!(
        "NRRD0001\ntype: uchar\ndimension: 4\nsizes: 3 4 5 6\nencoding: raw\n\n{}",
        "x".repeat(360)
    );
    assert_eq!(read_one("v.nrrd", text).grid.fields.len(), 6);
}

#[test]
fn segments_of_older_files_are_numbered_from_1_and_colours_are_of_0_to_1() {
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n\
        Segment0_Name:=liver\nSegment0_Color:=1 0.5 0\n\
        Segment1_Name:=spleen\nSegment1_Color:=255 128 0\n\nab";
    let names = read_one("seg.nrrd", text).grid.label_names;
    let told: Vec<_> = names.iter().map(|n| (n.value, n.name.as_str(), n.colour)).collect();
    assert_eq!(told, [(1, "liver", Some(Srgb8([255, 128, 0]))), (2, "spleen", None)]);
}

#[test]
fn metaimage_keys_that_mean_the_same_are_read_alike() {
    let text = "NDims = 3\nDimSize = 1 1 2\nElementByteOrderMSB = True\nElementType = MET_LONG\n\
        ElementSize = 2 3 4\nPosition = 5 6 7\nRotation = 0 1 0 1 0 0 0 0 -1\n\
        ElementDataFile = LOCAL\n\0\0\0\x01\0\0\x01\0";
    for (position, rotation) in
        [("Position", "Rotation"), ("Origin", "Orientation"), ("Offset", "TransformMatrix")]
    {
        let text = text.replace("Position", position).replace("Rotation", rotation);
        let grid = read_one("v.mha", text).grid;
        assert_eq!(*grid.fields[0].samples, Samples::Int32(vec![1, 256]));
        assert_eq!(grid.lattice.spacing, DVec3::new(2.0, 3.0, 4.0));
        assert_eq!(grid.lattice.origin, DVec3::new(5.0, 6.0, 7.0), "{position}");
        assert_eq!(grid.lattice.direction.x_axis, DVec3::Y, "{rotation}");
    }
}

#[test]
fn metaimage_turns_space_alone_and_says_what_it_leaves() {
    let text = |matrix: &str| {
        format!(
            "NDims = 4\nDimSize = 2 1 1 2\nElementType = MET_UCHAR\nTransformMatrix = {matrix}\n\
             ElementDataFile = LOCAL\nabcd"
        )
    };
    let turned = read_one("t.mha", text("0 1 0 0 1 0 0 0 0 0 -1 0 0 0 0 1"));
    assert_eq!(
        turned.grid.lattice.direction.to_cols_array(),
        [0., 1., 0., 1., 0., 0., 0., 0., -1.]
    );
    assert!(!turned.warnings.iter().any(|w| w.contains("mixes")), "{:?}", turned.warnings);
    let mixed = read_one("t.mha", text("0 1 0 0.5 1 0 0 0 0 0 -1 0 0 0 0 1"));
    assert!(mixed.warnings.iter().any(|w| w.contains("mixes space")), "{:?}", mixed.warnings);
}

#[test]
fn bytes_behind_the_samples_and_values_next_to_zero_are_said() {
    let head = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 5), }";
    let opened = read_one("v.npy", npy(head, b"0123456789+"));
    assert!(opened.warnings.join("\n").contains("more bytes follow the samples"));
    let text = "NRRD0004\ntype: double\ndimension: 1\nsizes: 2\nencoding: txt\n\n1e-40 2e-40\n";
    assert!(read_one("v.nrrd", text).warnings.join("\n").contains("nearer to zero than"));
    let text = "NRRD0004\ntype: uint64\ndimension: 1\nsizes: 2\nencoding: txt\n\n\
        9007199254740993 9007199254740999\n";
    assert!(read_one("v.nrrd", text).warnings.join("\n").contains("cannot be told apart"));
}

/// An array of NumPy's first version.
fn npy(head: &str, data: &[u8]) -> Vec<u8> {
    let len = (head.len() as u16).to_le_bytes();
    [&b"\x93NUMPY\x01\0"[..], &len, head.as_bytes(), data].concat()
}

#[test]
fn numpy_tables_of_columns_one_after_another_are_points() {
    let head = "{'descr': '<f4', 'fortran_order': True, 'shape': (2, 4), }";
    let columns = [[0.0_f32, 1.0], [0.0, 2.0], [0.0, 3.0], [5.0, 6.0]];
    let data: Vec<u8> = columns.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let opened = read_one("v.npy", npy(head, &data));
    assert_eq!([0, 1].map(|i| opened.grid.fields[0].samples.get(i)), [5.0, 6.0]);
    let said = opened.warnings.join("\n");
    assert!(said.contains("taken for a table of 2 points"), "{said}");
}

#[test]
fn numpy_archives_say_what_they_leave_and_refuse_what_goes_on() {
    use std::io::Write;
    let head =
        |shape: &str| format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}");
    let archive = |arrays: &[(&str, &str, &[u8])]| {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, shape, data) in arrays {
            zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default())
                .unwrap();
            zip.write_all(&npy(&head(shape), data)).unwrap();
        }
        zip.finish().unwrap().into_inner()
    };
    let whole = [("a", "(2, 5)", &b"0123456789"[..]), ("b", "(5,)", b"01234")];
    let opened = read_one("v.npz", archive(&whole));
    assert_eq!(opened.grid.fields.len(), 1);
    assert!(opened.warnings.join("\n").contains("other shapes or types are ignored: b"));
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), "v.npz", archive(&[("a", "(2, 5)", b"0123456789+")]));
    let options = OpenOptions::default();
    let error = open(&folder.path().join("v.npz"), &options, &Ticket::new()).unwrap_err();
    assert!(matches!(error.problem, Problem::Corrupt(_)), "{error}");
}

/// A Zarr array of some metadata and objects.
fn zarr(files: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, content) in files {
        let path = folder.path().join("v.zarr").join(name);
        std::fs::create_dir_all(path.parent().expect("in the folder")).expect("ours");
        std::fs::write(path, content).expect("ours");
    }
    folder
}

#[test]
fn zarr_chunks_of_any_order_are_laid_beside_what_fills_their_gaps() {
    let array =
        br#"{"zarr_format": 2, "shape": [2, 6], "chunks": [2, 3], "dtype": ">u2", "order": "F",
        "fill_value": 7, "compressor": null, "filters": null}"#;
    let folder = zarr(&[(".zarray", array), ("0.0", &[0, 1, 1, 0, 0, 2, 2, 0, 0, 3, 3, 0])]);
    let opened = read(folder.path(), "v.zarr");
    let expected = vec![1, 2, 3, 7, 7, 7, 256, 512, 768, 7, 7, 7];
    assert_eq!(*opened.grid.fields[0].samples, Samples::UInt16(expected));
}

#[test]
fn what_is_not_stored_of_half_floats_has_their_fill_value() {
    for (fill, expected) in [("\"NaN\"", f32::NAN), ("2.5", 2.5), ("0", 0.0)] {
        let array = format!(
            r#"{{"zarr_format": 2, "shape": [2, 4], "chunks": [2, 2], "dtype": "<f2", "order": "C",
            "fill_value": {fill}, "compressor": null, "filters": null}}"#
        );
        // 1 in the first chunk; the second is not there.
        let chunk = [0x00, 0x3c].repeat(4);
        let folder = zarr(&[(".zarray", array.as_bytes()), ("0.0", &chunk)]);
        let opened = read(folder.path(), "v.zarr");
        let Samples::Float32(found) = &*opened.grid.fields[0].samples else { panic!("{fill}") };
        let is_it =
            |at: usize, value: f32| found[at] == value || found[at].is_nan() && value.is_nan();
        assert!(is_it(0, 1.0) && is_it(5, 1.0), "{found:?}");
        assert!([2, 3, 6, 7].into_iter().all(|at| is_it(at, expected)), "{fill}: {found:?}");
    }
}

#[test]
fn a_fill_value_that_is_no_number_is_refused() {
    let array =
        br#"{"zarr_format": 2, "shape": [2, 4], "chunks": [2, 2], "dtype": "<f4", "order": "C",
        "fill_value": "seven", "compressor": null, "filters": null}"#;
    let folder = zarr(&[(".zarray", array), ("0.0", &[0; 16])]);
    let refused = open(&folder.path().join("v.zarr"), &OpenOptions::default(), &Ticket::new());
    let said = refused.map(drop).unwrap_err().to_string();
    assert!(said.contains("a number for fill_value") && said.contains("seven"), "{said}");
}

#[test]
fn zarr_shards_may_begin_with_their_index() {
    let array = br#"{"zarr_format": 3, "node_type": "array", "shape": [2, 2], "data_type": "uint8",
        "fill_value": 0, "chunk_key_encoding": {"name": "default"},
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2, 2]}},
        "codecs": [{"name": "sharding_indexed", "configuration": {"chunk_shape": [1, 2],
        "codecs": [{"name": "bytes"}], "index_codecs": [{"name": "bytes"}],
        "index_location": "start"}}]}"#;
    let mut shard = [32_u64, 2, 34, 2].map(u64::to_le_bytes).concat();
    shard.extend([1, 2, 3, 4]);
    let folder = zarr(&[("zarr.json", array), ("c/0/0", &shard)]);
    assert_eq!(bytes(&read(folder.path(), "v.zarr"), 0), [1, 2, 3, 4]);
}

#[test]
fn zarr_has_a_unit_where_all_axes_have_it_and_says_which_arrays_it_leaves() {
    let array = |shape: &str| {
        let head = r#"{"zarr_format": 2, "dtype": "|u1", "order": "C", "fill_value": 0,
            "compressor": null, "filters": null"#;
        format!(r#"{head}, "shape": {shape}, "chunks": {shape}}}"#)
    };
    let axes = |y: &str, x: &str| {
        let told = r#"{"multiscales": [{"datasets": [{"path": "0"}], "axes": ["#;
        let axis =
            |name, unit| format!(r#"{{"name": "{name}", "type": "space", "unit": "{unit}"}}"#);
        format!("{told}{}, {}]}}]}}", axis("y", y), axis("x", x))
    };
    let unit = |y, x| {
        let (told, array) = (axes(y, x), array("[2, 1]"));
        let folder = zarr(&[
            (".zattrs", told.as_bytes()),
            ("0/.zarray", array.as_bytes()),
            ("0/0.0", b"ab"),
        ]);
        read(folder.path(), "v.zarr").grid.unit
    };
    assert_eq!(unit("micrometer", "micrometer").as_deref(), Some("µm"));
    assert_eq!(unit("micrometer", "nanometer"), None);
    let (large, small) = (array("[2, 2]"), array("[2, 1]"));
    let group = zarr(&[
        (".zgroup", br#"{"zarr_format": 2}"#),
        ("a/.zarray", large.as_bytes()),
        ("a/0.0", b"abcd"),
        ("b/.zarray", small.as_bytes()),
        ("b/0.0", b"ab"),
    ]);
    let opened = read(group.path(), "v.zarr");
    assert!(opened.warnings.join("\n").contains("other shapes or types are ignored: b"));
}

#[test]
fn legacy_vtk_puts_active_points_first_and_reads_colours_bits_and_aspects() {
    let head = |mode: &str| {
        format!(
            "# vtk DataFile Version 3.0\nt\n{mode}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\n\
             ASPECT_RATIO 2 3 4\nORIGIN 0 0 0\n"
        )
    };
    let text = format!(
        "{}CELL_DATA 1\nSCALARS c int\nLOOKUP_TABLE default\n9\nPOINT_DATA 4\n\
         COLOR_SCALARS rgb 1\n0 0.2 0.4 1\nSCALARS p int\nLOOKUP_TABLE default\n1 2 3 4\n\
         FIELD f 1\nodd 1 3 int\n1 2 3\n",
        head("ASCII")
    );
    let opened = read_one("v.vtk", text);
    let names: Vec<&str> = opened.grid.fields.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["p", "c", "rgb"]);
    assert_eq!(bytes(&opened, 2), [0, 51, 102, 255]);
    assert_eq!(opened.grid.lattice.spacing.to_array(), [2.0, 3.0, 4.0]);
    let said = opened.warnings.join("\n");
    assert!(said.contains("\"odd\" is ignored: it has 3 tuples"), "{said}");
    let head = head("BINARY");
    let binary = [
        head.as_bytes(),
        b"POINT_DATA 4\nSCALARS b bit\nLOOKUP_TABLE t\n\xc0\nLOOKUP_TABLE t 2\n01234567\n",
        b"SCALARS n unsigned_char\nLOOKUP_TABLE default\n\x01\x02\x03\x04\n",
    ];
    let opened = read_one("v.vtk", binary.concat());
    assert_eq!((bytes(&opened, 0), bytes(&opened, 1)), (vec![1, 1, 0, 0], vec![1, 2, 3, 4]));
}

/// Four bytes in one block that says how it is packed, and how long it is unpacked and packed.
fn vti_of_block(compressor: &str, sizes: [u32; 3], block: &[u8]) -> String {
    use base64::Engine;
    let encode = |bytes: &[u8]| base64::engine::general_purpose::STANDARD.encode(bytes);
    let [blocks, full, last] = sizes;
    let header = [blocks, full, last, block.len() as u32].map(u32::to_le_bytes).concat();
    format!(
        "<VTKFile type='ImageData' byte_order='LittleEndian' header_type='UInt32' \
         compressor='{compressor}'><ImageData WholeExtent='0 3 0 0 0 0'><Piece Extent='0 3 0 0 0 0'>\
         <PointData><DataArray type='UInt8' Name='a' format='binary'>{}{}</DataArray></PointData>\
         </Piece></ImageData></VTKFile>",
        encode(&header),
        encode(block)
    )
}

#[test]
fn blocks_of_vtk_have_the_bytes_that_they_say() {
    use std::io::Write;
    let zlib = |content: &[u8]| {
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        zlib.write_all(content).unwrap();
        zlib.finish().unwrap()
    };
    const ZLIB: &str = "vtkZLibDataCompressor";
    // A last block of no bytes is a full one.
    for sizes in [[1, 4, 0], [1, 9, 4]] {
        assert_eq!(
            bytes(&read_one("v.vti", vti_of_block(ZLIB, sizes, &zlib(b"abcd"))), 0),
            b"abcd"
        );
    }
    let lz4 = lz4_flex::block::compress(b"abc");
    for (compressor, block) in [(ZLIB, zlib(b"abcde")), ("vtkLZ4DataCompressor", lz4)] {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), "v.vti", vti_of_block(compressor, [1, 4, 0], &block));
        let opened = open(&folder.path().join("v.vti"), &OpenOptions::default(), &Ticket::new());
        let error = opened.unwrap_err();
        assert!(matches!(error.problem, Problem::Corrupt(_)), "{error}");
    }
}

#[test]
fn vti_shifts_its_origin_along_its_own_axes_and_says_what_pieces_do_not_cover() {
    let text = "<VTKFile type='ImageData' byte_order='LittleEndian'><ImageData \
        WholeExtent='0 5 0 0 0 0' Origin='1 2 3' Spacing='10 1 1' Direction='0 1 0 1 0 0 0 0 1'>\
        <Piece Extent='4 5 0 0 0 0'><PointData><DataArray type='UInt8' Name='a' format='ascii'>1 2\
        </DataArray></PointData></Piece></ImageData></VTKFile>";
    let opened = read_one("v.vti", text);
    assert_eq!(opened.grid.lattice.origin.to_array(), [1.0, 42.0, 3.0]);
    let said = opened.warnings.join("\n");
    assert!(said.contains("WholeExtent is [[0, 5]") && said.contains("pieces cover"), "{said}");
}

#[test]
fn whole_numbers_are_said_to_merge_where_doubles_have_few_steps_for_all_of_them() {
    let is_said = |least: i64, greatest: i64| {
        let head = "NRRD0004\ntype: int64\ndimension: 1\nsizes: 2\nencoding: txt\n\n";
        let opened = read_one("v.nrrd", format!("{head}{least} {greatest}\n"));
        opened.warnings.join("\n").contains("cannot be told apart")
    };
    let first = 1_i64 << 53;
    assert!(is_said(first, first + 8000) && !is_said(first, first + 8200));
    // Doubles lie 2 apart at one end alone.
    assert!(is_said(first - 9, first + 9) && !is_said(first - 9, first));
}

#[test]
fn a_short_last_index_behind_three_others_is_of_components() {
    let head = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 2, 3), }";
    let opened = read_one("v.npy", npy(head, &(0..24).collect::<Vec<u8>>()));
    assert_eq!((opened.grid.lattice.dims, opened.grid.fields[0].components), ([2; 3], 3));
}
