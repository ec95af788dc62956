//! The less common ways to say the same thing.

use std::path::Path;

use voxsplat::core::Ticket;
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
