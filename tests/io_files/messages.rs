//! What a refusal says: what was expected, what was found, what to try, the path last.

use std::path::Path;

use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, Problem, RawOverrides, ReadError, open};
use voxsplat::volume::ScalarType;

use crate::write::{self, Volume, Vti};
use crate::write_legacy::{self, Legacy};

/// The error of a file with this content.
fn refused(name: &str, content: impl AsRef<[u8]>) -> (tempfile::TempDir, ReadError) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("the folder is ours");
    let error = error_of(&path);
    (folder, error)
}

fn error_of(path: &Path) -> ReadError {
    error_with(path, &OpenOptions::default())
}

fn error_with(path: &Path, options: &OpenOptions) -> ReadError {
    match open(path, options, &Ticket::new()) {
        Err(error) => error,
        Ok(opened) => panic!("{} opened: {opened:?}", path.display()),
    }
}

/// What keeps an error's message from having the form that all have, and these words.
fn fault(error: &ReadError, words: &[&str]) -> Option<String> {
    fault_of(&error.to_string(), &error.path, words)
}

fn fault_of(message: &str, path: &Path, words: &[&str]) -> Option<String> {
    let checks = [
        (message.starts_with("expected "), "begins with what was expected"),
        (message.contains(", found "), "says what was found"),
        (message.contains("; "), "says what to try"),
        (message.ends_with(&format!(": {}", path.display())), "ends with the path"),
        (!message.contains('\n'), "is one line"),
        (words.iter().all(|word| message.contains(word)), "has the words"),
    ];
    let (_, rule) = checks.iter().find(|(kept, _)| !kept)?;
    Some(format!("not so: a message {rule} {words:?}: {message}"))
}

#[track_caller]
fn says(name: &str, content: impl AsRef<[u8]>, words: &[&str]) {
    let (_folder, error) = refused(name, content);
    assert_eq!(fault(&error, words), None);
}

fn nrrd(lines: &str, data: &str) -> String {
    format!("NRRD0004\n{lines}\n\n{data}")
}

#[test]
fn the_check_of_a_message_rejects_each_fault() {
    let fault = |message: &str, words: &[&str]| fault_of(message, Path::new("/p"), words);
    assert_eq!(fault("expected a, found b; try c: /p", &["b"]), None);
    for bad in [
        "a, found b; try c: /p",
        "expected a; try c: /p",
        "expected a, found b: /p",
        "expected a, found b; try c",
        "expected a,\nfound b, found c; try d: /p",
    ] {
        assert!(fault(bad, &[]).is_some(), "{bad}");
    }
    assert!(fault("expected a, found b; try c: /p", &["other"]).is_some());
}

#[test]
fn what_is_no_readable_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let absent = error_of(&folder.path().join("absent.nrrd"));
    assert!(matches!(absent.problem, Problem::NotFound));
    assert_eq!(fault(&absent, &["nothing of that name"]), None);
    assert_eq!(fault(&error_of(folder.path()), &["expected a file", "a folder"]), None);
    says("e.nrrd", "", &["an empty file"]);
    says("e.raw", "", &["an empty file"]);
}

#[cfg(unix)]
#[test]
fn names_that_lead_nowhere_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let round = folder.path().join("round.nrrd");
    std::os::unix::fs::symlink(&round, &round).unwrap();
    let long = folder.path().join("x".repeat(400));
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    for (path, found) in [
        (round, "a link that leads to no file"),
        (long, "too long"),
        (file.join("a.nrrd"), "a file where a folder was to be"),
        ("a\0b.nrrd".into(), "one that the system forbids"),
    ] {
        let error = error_of(&path);
        assert_eq!(fault(&error, &["the name of a file", found]), None, "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read_and_a_pipe_are_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("secret.nrrd");
    std::fs::write(&path, "NRRD0004\n").unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o000)).unwrap();
    if std::fs::File::open(&path).is_ok() {
        println!("skipped 1: this user may read everything");
    } else {
        assert_eq!(fault(&error_of(&path), &["permission is denied"]), None);
    }
    assert_eq!(fault(&error_of(Path::new("/dev/null")), &["a pipe or device"]), None);
}

#[test]
fn a_folder_is_refused_with_the_names_of_the_volumes_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    put("a.1", "\0\u{1}");
    put("b.md", "hello");
    assert_eq!(fault(&error_of(folder.path()), &["a folder of other files", "a.1, b.md"]), None);
    put("z.nhdr", "NRRD0004\n");
    assert_eq!(fault(&error_of(folder.path()), &["a folder that holds z.nhdr;"]), None);
}

#[test]
fn content_that_no_reader_knows_is_named_where_it_is_well_known() {
    says("a.txt", "hello", &["a volume", "a text without a number", "\"hello\""]);
    says("a.txt", "hello 7", &["a table of points", "\"hello 7\""]);
    says("a.md", "hello", &["found a text file"]);
    says("a.md", b"hello\x01", &["hello", "--raw-dims"]);
    says("a.md", b"caf\xe9 au lait", &["--raw-dims"]);
    says("a.md", b"caf\xc3", &["found a text file"]);
    says("a.nii.gz", b"\x1f\x8b\x08\0", &["packed with gzip", "cut short"]);
    says("a.nrrd", "hello", &["NRRD000", "\"hello\"", "extension"]);
    says("a.mhd", "hello", &["NDims", "\"hello\""]);
    says("a.vti", b"\x89PNG\r\n", &["VTKFile", "a PNG picture"]);
    says("a.vth", "<VTKFile type=\"HyperTreeGrid\">", &["ImageData", "\"HyperTreeGrid\""]);
}

#[test]
fn nrrd_headers_that_contradict_themselves_are_quoted() {
    let full = "type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw";
    let with = |from: &str, to: &str| nrrd(&full.replace(from, to), "12345678");
    says("a.nrrd", with("2 2 2", "2 2"), &["3 axes", "\"2 2\""]);
    says("a.nrrd", with("2 2 2", "2 -2 2"), &["at least 1", "\"2 -2 2\""]);
    says("a.nrrd", with("2 2 2", "2 0 2"), &["at least 1", "\"2 0 2\""]);
    says("a.nrrd", with("2 2 2", "2 x 2"), &["whole numbers", "\"x\""]);
    says("a.nrrd", with("2 2 2", "4294967296 4294967296 4"), &["64 bits", "4294967296"]);
    says("a.nrrd", with("uchar", "quux"), &["NRRD type", "\"quux\""]);
    says("a.nrrd", with("raw", "zip"), &["encoding", "\"zip\""]);
    says("a.nrrd", with("dimension: 3", "dimension: many"), &["1 to 16", "\"many\""]);
    says("a.nrrd", with("type: uchar\n", ""), &["\"type\"", "none"]);
    says("a.nrrd", with("uchar", "uchar\nkinds: vector list stub"), &["spatial axis"]);
    says(
        "a.nrrd",
        with("uchar", "uchar\nspacings: 1 0 1"),
        &["non-zero spacing", "[1.0, 0.0, 1.0]"],
    );
    says("a.nrrd", with("uchar", "uchar\nspace directions: (1,0,0) (0,1,0) (1,1,0)"), &["axes"]);
    says(
        "a.nrrd",
        with("uchar", "short\nendian: middle"),
        &["\"little\" or \"big\"", "\"middle\""],
    );
}

#[test]
fn promises_that_the_file_does_not_keep_are_counted_in_bytes() {
    let raw =
        nrrd("type: short\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: big", "12345678");
    says("a.nrrd", raw, &["16 bytes", "found 8", "cut short"]);
    let text = nrrd("type: short\ndimension: 1\nsizes: 4\nencoding: text", "1 2 3 ");
    says("a.nrrd", text.replace("1 2 3 ", "1 2    3"), &["4 numbers", "after 3"]);
    says("a.nrrd", text.replace("1 2 3 ", "1 2 70000 3"), &["int16", "\"70000\""]);
    let volume = Volume::new([9, 8, 7], ScalarType::Float32, 1, 3);
    let folder = tempfile::tempdir().unwrap();
    let how = Vti {
        kind: "ImageData",
        format: "raw",
        compressed: true,
        wide: true,
        big: false,
        split: false,
        cells: false,
    };
    for kind in 0..4 {
        let path = match kind {
            0 => write::nrrd(folder.path(), &volume, "gzip", false, false),
            1 => write::nrrd(folder.path(), &volume, "bzip2", false, false),
            2 => write::metaimage(folder.path(), &volume, "compressed", false, false),
            _ => write::vti(folder.path(), &volume, how),
        };
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() * 3 / 4]).unwrap();
        assert_eq!(fault(&error_of(&path), &["copy it again"]), None);
        // A flipped bit in the stream is noticed by its checksum at the latest.
        let mut flipped = bytes.clone();
        let at = bytes.len() * 4 / 5;
        flipped[at] ^= 0x10;
        std::fs::write(&path, &flipped).unwrap();
        let error = error_of(&path);
        assert!(matches!(error.problem, Problem::Corrupt(_) | Problem::Truncated(_)), "{error}");
        assert_eq!(fault(&error, &["copy it again"]), None);
    }
}

#[test]
fn a_missing_data_file_is_named_beside_the_header_that_asked_for_it() {
    let (folder, error) = refused(
        "h.nhdr",
        "NRRD0004\ntype: uchar\ndimension: 1\nsizes: 4\nencoding: raw\ndata file: gone.raw\n",
    );
    assert!(matches!(&error.problem, Problem::MissingData { name, .. }
        if *name == folder.path().join("gone.raw")));
    assert_eq!(fault(&error, &["gone.raw", "no such file"]), None);
    says(
        "h.mhd",
        "NDims = 2\nDimSize = 2 2\nElementType = MET_UCHAR\nElementDataFile = gone.raw\n",
        &["gone.raw", "no such file"],
    );
    let list =
        "NRRD0004\ntype: uchar\ndimension: 2\nsizes: 4 3\nencoding: raw\ndata file: LIST\na\n";
    says("h.nhdr", list, &["3 data files", "found 1"]);
}

#[test]
fn metaimage_headers_that_contradict_themselves_are_quoted() {
    let full = "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n\
        ElementDataFile = LOCAL\n12345678";
    let with = |from: &str, to: &str| full.replace(from, to);
    says("a.mha", with("2 2 2", "2 2"), &["NDims", "[2, 2]"]);
    says("a.mha", with("2 2 2", "2 -2 2"), &["DimSize", "\"2 -2 2\""]);
    says("a.mha", with("MET_UCHAR", "MET_STRING"), &["ElementType", "\"MET_STRING\""]);
    says("a.mha", with("Image", "Tube"), &["ObjectType = Image", "\"Tube\""]);
    says("a.mha", with("2 2 2", "2 2 3"), &["12 bytes", "found 8"]);
    says("a.mha", with("NDims", "ElementSpacing = 1 1\nNDims"), &["3 numbers", "\"1 1\""]);
    says("a.mha", with("NDims", "CompressedData = Maybe\nNDims"), &["True or False", "\"Maybe\""]);
    says("a.mha", with("ElementDataFile = LOCAL", ""), &["Key = Value"]);
    says("a.mha", "NDims = 3\nDimSize = 2 2 2\n", &["ElementDataFile", "none"]);
}

#[test]
fn vti_headers_that_contradict_themselves_are_quoted() {
    let full = "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData \
        WholeExtent=\"0 1 0 1 0 0\"><Piece Extent=\"0 1 0 1 0 0\"><PointData><DataArray \
        type=\"UInt8\" Name=\"n\" format=\"ascii\">1 2 3 4</DataArray></PointData></Piece>\
        </ImageData></VTKFile>";
    let with = |from: &str, to: &str| full.replace(from, to);
    says("a.vti", with("0 1 0 1 0 0", "0 1 0 1 0"), &["extent", "\"0 1 0 1 0\""]);
    says("a.vti", with("0 1 0 1 0 0", "0 1 1 0 0 0"), &["extent", "\"0 1 1 0 0 0\""]);
    says("a.vti", with("UInt8", "String"), &["at least one array", "Float32 or Float64"]);
    says("a.vti", with("ascii", "morse"), &["ascii, binary or appended", "\"morse\""]);
    says("a.vti", with("1 2 3 4", "1 2    3"), &["4 numbers", "found 3"]);
    says("a.vti", with("1 2 3 4", "1 2 300 4"), &["uint8", "\"300\""]);
    says("a.vti", with("</VTKFile>", ""), &["</VTKFile>"]);
    says("a.vti", with("</Piece>", "</Peace>"), &["well-formed XML"]);
    says("a.vti", with("LittleEndian", "MiddleEndian"), &["byte_order", "\"MiddleEndian\""]);
    let order = "byte_order=\"LittleEndian\"";
    let content = with(order, &format!("{order} compressor=\"vtkOtherCompressor\""));
    says("a.vti", content, &["vtkLZMADataCompressor", "\"vtkOtherCompressor\"", "with zlib"]);
    let pieces = "<Piece Extent=\"9 10 0 1 0 0\"><PointData><DataArray type=\"UInt8\" Name=\"n\" \
        format=\"ascii\">1 2 3 4</DataArray></PointData></Piece></ImageData>";
    says("a.vti", with("</ImageData>", pieces), &["fill the grid", "a gap"]);
}

#[test]
fn grids_that_contradict_themselves_are_quoted() {
    let full = "<VTKFile type=\"RectilinearGrid\" byte_order=\"LittleEndian\"><RectilinearGrid \
        WholeExtent=\"0 1 0 0 0 0\"><Piece Extent=\"0 1 0 0 0 0\"><PointData><DataArray \
        type=\"UInt8\" Name=\"n\" format=\"ascii\">1 2</DataArray></PointData><Coordinates>\
        <DataArray type=\"Float32\" format=\"ascii\">0 1.5</DataArray><DataArray type=\"Float32\" \
        format=\"ascii\">0</DataArray><DataArray type=\"Float32\" format=\"ascii\">0</DataArray>\
        </Coordinates></Piece></RectilinearGrid></VTKFile>";
    let with = |from: &str, to: &str| full.replace(from, to);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.vtr"), full).unwrap();
    assert!(open(&folder.path().join("a.vtr"), &OpenOptions::default(), &Ticket::new()).is_ok());
    says("a.vtr", with("0 1.5", "0 0"), &["rise or fall", "0 after 0 along x"]);
    says("a.vtr", with("0 1.5", "0 nan"), &["finite points", "NaN along x"]);
    says("a.vtr", with("0 1.5", "0    "), &["2 numbers", "found 1"]);
    says("a.vtr", with("Coordinates", "Places"), &["Coordinates", "found 0"]);
    let points = with("RectilinearGrid", "StructuredGrid").replace("Coordinates", "Points");
    says("a.vts", &points, &["one array in the element Points", "found 3"]);
    says("a.vtu", with("RectilinearGrid", "UnstructuredGrid"), &["at least one point", "none"]);
    says("a.vts", "hello", &["<VTKFile", "\"hello\""]);
}

#[test]
fn legacy_vtk_that_contradicts_itself_is_quoted() {
    let full = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET STRUCTURED_POINTS\n\
        DIMENSIONS 2 2 1\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 4\nSCALARS n int\n\
        LOOKUP_TABLE default\n1 2 3 4\n";
    let with = |from: &str, to: &str| full.replace(from, to);
    let words = ["UNSTRUCTURED_GRID or POLYDATA", "\"TABLE\"", "resample"];
    says("a.vtk", with("STRUCTURED_POINTS", "TABLE"), &words);
    for kind in ["UNSTRUCTURED_GRID", "POLYDATA"] {
        says("a.vtk", with("STRUCTURED_POINTS", kind), &["a keyword of the grid"]);
    }
    says("a.vtk", "hello", &["# vtk DataFile", "\"hello\""]);
    says("a.vtk", with("ASCII", "MORSE"), &["ASCII or BINARY", "\"MORSE\""]);
    says("a.vtk", with("2 2 1", "2 0 1"), &["at least one sample", "[2, 0, 1]"]);
    says("a.vtk", with("2 2 1", "2 2 x"), &["a number after \"DIMENSIONS\"", "\"x\""]);
    says("a.vtk", with("SPACING 1 1 1", "SPACING 1 0 1"), &["non-zero spacing"]);
    says("a.vtk", with("POINT_DATA 4", "POINT_DATA 5"), &["POINT_DATA of 4", "\"5\""]);
    says("a.vtk", with("POINT_DATA 4", "CELL_DATA 4"), &["CELL_DATA of 1", "\"4\""]);
    says("a.vtk", with("int", "quux"), &["a type of legacy VTK", "\"quux\""]);
    says("a.vtk", with("1 2 3 4", "1 2    3"), &["4 numbers", "after 3"]);
    says("a.vtk", with("1 2 3 4", "1 2 3 4 5"), &["SCALARS, VECTORS", "\"5\""]);
    says("a.vtk", with("n int", "n"), &["2 words after \"SCALARS\"", "\"SCALARS n\""]);
    says("a.vtk", with("DIMENSIONS 2 2 1\n", ""), &["DIMENSIONS before the data"]);
    says("a.vtk", with("SPACING", "SPADING"), &["a keyword of the grid", "\"SPADING 1 1 1\""]);
    says("a.vtk", &full[..full.find("POINT_DATA").unwrap()], &["at least one array"]);
    says("a.vtk", &full[..full.find("DATASET").unwrap()], &["a DATASET"]);
    let grid = with("STRUCTURED_POINTS", "STRUCTURED_GRID");
    let grid = grid.replace("SPACING 1 1 1\nORIGIN 0 0 0\n", "");
    says("a.vtk", &grid, &["POINTS before the data"]);
    let points = "POINTS 3 float\n0 0 0\n";
    says(
        "a.vtk",
        grid.replace("POINT_DATA", &format!("{points}POINT_DATA")),
        &["POINTS of 4", "\"3\""],
    );
}

#[test]
fn netcdf_that_is_not_read_says_how_to_convert_it() {
    says("a.nc", b"\x89HDF\r\n\x1a\n12345678", &["a NetCDF header", "copy it again"]);
    says("a.h5", b"\x89HDF\r\n\x1a\n12345678", &["an HDF5 file that is whole"]);
    says("a.nc", b"CDF\x03\0\0\0\0", &["version 1, 2 or 5", "version 3", "nccopy"]);
    says("a.nc", b"CDF\x01\0\0\0\0", &["a NetCDF header", "cut short"]);
    says("a.nc", "hello", &["a NetCDF header", "\"hello\""]);
    let folder = tempfile::tempdir().unwrap();
    let path = crate::winds::winds(folder.path(), 2);
    let bytes = std::fs::read(&path).unwrap();
    says("a.nc", &bytes[..bytes.len() - 200], &["copy the file again"]);
}

#[test]
fn raw_files_whose_layout_nobody_knows_say_how_to_tell_it() {
    says("head.raw", "12345678", &["dimensions", "\"head.raw\"", "--raw-dims"]);
    says("head_2x2x3.raw", "1234567", &["the type", "7 bytes", "--raw-type"]);
    says("head_2x2x3_uint16.raw", "12345678", &["24 bytes", "found a file of 8 bytes"]);
}

#[test]
fn more_than_memory_allows_is_refused_with_both_figures() {
    let folder = tempfile::tempdir().unwrap();
    let volume = Volume::new([20, 20, 20], ScalarType::Float64, 1, 3);
    let path = write::nrrd(folder.path(), &volume, "raw", false, false);
    let options = OpenOptions { memory_limit_bytes: Some(10_000), ..Default::default() };
    let error = open(&path, &options, &Ticket::new()).unwrap_err();
    assert_eq!(fault(&error, &["64.0 kB", "10.0 kB"]), None);
    // Points and samples together.
    let options = OpenOptions { memory_limit_bytes: Some(400_000), ..Default::default() };
    for binary in [false, true] {
        let how = Legacy {
            dataset: "STRUCTURED_GRID",
            role: "SCALARS",
            binary,
            cells: false,
            extras: false,
        };
        let error = error_with(&write_legacy::legacy(folder.path(), &volume, how), &options);
        assert_eq!(fault(&error, &["448.0 kB", "400.0 kB"]), None);
    }
    let how = Vti {
        kind: "StructuredGrid",
        format: "raw",
        compressed: true,
        wide: false,
        big: false,
        split: false,
        cells: false,
    };
    let error = error_with(&write::vti(folder.path(), &volume, how), &options);
    assert_eq!(fault(&error, &["448.0 kB", "400.0 kB"]), None);
    let options = OpenOptions { memory_limit_bytes: Some(3000), ..Default::default() };
    let error = error_with(&crate::winds::winds(folder.path(), 1), &options);
    assert_eq!(fault(&error, &["the variables", "3.0 kB"]), None);
}

#[test]
fn a_cancelled_load_is_cancelled_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let volume = Volume::new([4, 4, 4], ScalarType::UInt8, 1, 3);
    let how = Vti {
        kind: "ImageData",
        format: "raw",
        compressed: true,
        wide: false,
        big: false,
        split: false,
        cells: false,
    };
    let ticket = Ticket::new();
    ticket.cancel();
    for path in [
        write::nrrd(folder.path(), &volume, "gzip", false, false),
        write::metaimage(folder.path(), &volume, "binary", false, false),
        write::vti(folder.path(), &volume, how),
        write::vti(folder.path(), &volume, Vti { kind: "RectilinearGrid", ..how }),
        write_legacy::legacy(
            folder.path(),
            &volume,
            Legacy {
                dataset: "RECTILINEAR_GRID",
                role: "FIELD",
                binary: true,
                cells: false,
                extras: false,
            },
        ),
        crate::winds::winds(folder.path(), 2),
    ] {
        let error = open(&path, &OpenOptions::default(), &ticket).unwrap_err();
        assert!(error.is_cancelled(), "{error}");
    }
    let path = write::raw(folder.path(), &volume, false, 0);
    let known = RawOverrides {
        dims: Some([4, 4, 4]),
        scalar_type: Some(ScalarType::UInt8),
        ..Default::default()
    };
    let options = OpenOptions { raw: Some(known), ..Default::default() };
    assert!(open(&path, &options, &ticket).unwrap_err().is_cancelled());
}
