//! Cells, blocks and tables: what readers make of files by other writers, and what they refuse.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use voxsplat::cells::Cells;
use voxsplat::core::Ticket;
use voxsplat::io::{Format, OpenOptions, Opened, describe, open};
use voxsplat::volume::{Association, Component, Field, Shape};

use crate::watching::LARGEST;
use crate::write_netcdf::{Attribute, Values, netcdf, plain};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/readers").join(name)
}

fn opened(path: &Path) -> Opened {
    open(path, &OpenOptions::default(), &Ticket::new()).unwrap_or_else(|error| panic!("{error}"))
}

fn cells_of(opened: &Opened) -> Arc<Cells> {
    match &opened.grid.shape {
        Shape::Unstructured(cells) => Arc::clone(cells),
        shape => panic!("{}", shape.name()),
    }
}

/// The sentence with which a text of a name is refused.
fn refused(name: &str, text: impl AsRef<[u8]>) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("the folder is ours");
    let opened = open(&path, &OpenOptions::default(), &Ticket::new());
    let error = opened.expect_err("it must be refused").to_string();
    assert!(error.starts_with("expected ") && !error.contains('\n'), "{error}");
    error
}

fn says(name: &str, text: impl AsRef<[u8]>, words: &[&str]) {
    let error = refused(name, text);
    assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
}

fn made(name: &str, text: impl AsRef<[u8]>) -> Opened {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("the folder is ours");
    opened(&path)
}

fn values(field: &Field) -> Vec<f64> {
    (0..field.samples.len()).map(|i| field.samples.get(i)).collect()
}

#[test]
fn the_same_mesh_in_five_files_is_the_same() {
    let first = opened(&data("two.vtu"));
    for name in ["text.vtu", "lzma.vtu", "v5.vtk", "v42.vtk"] {
        let other = opened(&data(name));
        assert_eq!(cells_of(&first), cells_of(&other), "{name}");
        for field in &first.grid.fields {
            let same = other.grid.field(Some(&field.name)).unwrap();
            assert_eq!((field.components, field.association), (same.components, same.association));
            assert_eq!(values(field), values(same), "{name} {}", field.name);
        }
    }
}

#[test]
fn exodus_of_either_netcdf_has_its_times_and_its_blocks() {
    let classic = opened(&data("mesh.ex2"));
    assert_eq!(classic.format, Format::Exodus);
    assert_eq!(cells_of(&classic), cells_of(&opened(&data("mesh4.e"))));
    let field = |name: &str| classic.grid.field(Some(name)).unwrap();
    assert_eq!(field("vel[time=0.5]").components, 3);
    let second = |name: &str| values(field(name))[3..6].to_vec();
    assert_eq!(second("vel[time=0.5]"), [1.0, 2.0, 3.0], "heat 1, and 1 and 2 more");
    assert_eq!(second("vel[time=1.5]"), [2.0, 3.0, 4.0], "twice that heat");
    for (name, expected) in [("stress[time=0.5]", [1.0, 2.0]), ("stress[time=1.5]", [3.0, 4.0])] {
        let stress = values(field(name));
        assert!(stress[..2] == expected && stress[2].is_nan(), "{name}: {stress:?}");
    }
    let said = |words: &str| classic.warnings.iter().filter(|said| said.contains(words)).count();
    let told = ["2 time steps: each is a field", "joined to the vectors vel", "NaN on 1 of 2"];
    assert_eq!(told.map(said), [1; 3], "{:?}", classic.warnings);
    assert_eq!(values(field("ObjectId")), [10.0, 10.0, 20.0]);
}

#[test]
fn lists_of_grids_say_which_files_to_open() {
    let list = r#"<VTKFile type="Collection"><Collection><DataSet timestep="0" file="a.vtu"/></Collection></VTKFile>"#;
    says(
        "run.pvd",
        list,
        &["one grid", "a list of grids (.pvd)", "one of the files that it names"],
    );
}

#[test]
fn pieces_are_joined_and_polyhedra_are_solid() {
    let both = opened(&data("poly.vtu"));
    let cells = cells_of(&both);
    assert_eq!((cells.own_points(), cells.own_cells()), (8, 3));
    assert_eq!(cells.solids().last().unwrap().corners(), [4, 5, 6, 7], "moved on by four");
    let told = describe(&both, &Ticket::new()).unwrap().cells.unwrap();
    assert!((told.total_volume - 1.0 / 3.0).abs() < 1e-12, "{told:?}");
    assert!(told.to_string().contains("1 polyhedron"), "{told}");
    assert_eq!((told.inverted_cells, told.split_cells), (0, 1));
}

#[test]
fn polyhedra_are_the_same_however_their_faces_are_written() {
    let expected = cells_of(&opened(&data("poly.vtu")));
    // Lists of lists, as since version 2.3 of the format; the first offset may be written or not.
    let xml = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let at = xml.find("<DataArray type=\"Int64\" Name=\"faces\"").unwrap();
    let end = at + xml[at..].find("</Cells>").unwrap();
    for zero in ["", "0 "] {
        let array = |name: &str, numbers: &str| {
            format!(
                "<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{numbers}</DataArray>"
            )
        };
        let lists = [
            array("face_connectivity", "0 2 1 0 1 3 1 2 3 0 3 2"),
            array("face_offsets", &format!("{zero}3 6 9 12")),
            array("polyhedron_to_faces", "0 1 2 3"),
            array("polyhedron_offsets", &format!("{zero}4")),
        ];
        let text = format!("{}{}{}", &xml[..at], lists.concat(), &xml[end..]);
        assert_eq!(cells_of(&made("a.vtu", &text)), expected);
        let wrong = text.replace(
            ">0 1 2 3</DataArray><DataArray type=\"Int64\" Name=\"polyhedron_o",
            ">0 1 2 7</DataArray><DataArray type=\"Int64\" Name=\"polyhedron_o",
        );
        says("a.vtu", wrong, &["faces from 0 to 3", "7 of polyhedron 0"]);
    }
    // Streams of faces in the legacy format.
    let stream = "4 3 0 2 1 3 0 1 3 3 1 2 3 3 0 3 2";
    let text = TETRAHEDRON
        .replace("CELLS 1 5\n4 0 1 2 3", &format!("CELLS 1 18\n17 {stream}"))
        .replace("\n10\n", "\n42\n");
    let found = made("a.vtk", &text);
    let told = describe(&found, &Ticket::new()).unwrap().cells.unwrap();
    assert!((told.total_volume - 1.0 / 6.0).abs() < 1e-12, "{told:?}");
    assert!(!found.warnings.join("; ").contains("closed"), "{:?}", found.warnings);
    let open = text.replace("CELLS 1 18\n17 4", "CELLS 1 14\n13 3").replace(" 3 0 3 2\n", "\n");
    let said = made("a.vtk", open).warnings.join("; ");
    assert!(said.contains("1 polyhedron is not closed"), "{said}");
    says("a.vtk", text.replace("3 0 3 2\n", "3 0 3 9\n"), &["points, 0 to 3", "found 9"]);
    says("a.vtk", text.replace("17 4 3", "17 5 3"), &["faces of polyhedron 0"]);
}

/// A face that is named again and again takes memory each time, however short the file is.
#[test]
fn faces_that_polyhedra_name_more_often_than_memory_holds_are_refused() {
    let xml = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let at = xml.find("<DataArray type=\"Int64\" Name=\"faces\"").unwrap();
    let end = at + xml[at..].find("</Cells>").unwrap();
    let array = |name: &str, numbers: &str| {
        format!("<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{numbers}</DataArray>")
    };
    let of = |times: usize| {
        let lists = [
            array("face_connectivity", &"0 2 1 ".repeat(1000)),
            array("face_offsets", "3000"),
            array("polyhedron_to_faces", &"0 ".repeat(times)),
            array("polyhedron_offsets", &times.to_string()),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtu");
        std::fs::write(&path, format!("{}{}{}", &xml[..at], lists.concat(), &xml[end..])).unwrap();
        let options = OpenOptions { memory_limit_bytes: Some(8 << 20), ..OpenOptions::default() };
        open(&path, &options, &Ticket::new()).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(of(2), Ok(()));
    let error = of(20_000).unwrap_err();
    assert!(error.starts_with("expected the faces of polyhedra to fit in memory"), "{error}");
}

/// Arrays that a later piece alone has were passed over without a word.
#[test]
fn arrays_that_not_every_piece_has_are_told_whichever_has_them() {
    let xml = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let own =
        "<PointData><DataArray type=\"Float32\" Name=\"load\" format=\"ascii\">1 2 3 4</DataArray>";
    for at in [xml.find("<PointData").unwrap(), xml.rfind("<PointData").unwrap()] {
        let behind = at + xml[at..].find('>').unwrap() + 1;
        let said = made("a.vtu", format!("{}{own}{}", &xml[..at], &xml[behind..])).warnings;
        let told = said.iter().filter(|said| said.contains("\"load\" is ignored: not every piece"));
        assert_eq!(told.count(), 1, "{said:?}");
    }
}

/// A cube with a pyramid on top, by their faces.
#[test]
fn polyhedra_of_exodus_have_the_faces_that_their_block_names() {
    let folder = tempfile::tempdir().unwrap();
    let dims = [
        ("num_dim", 3),
        ("num_nodes", 9),
        ("num_elem", 2),
        ("num_el_blk", 1),
        ("num_fa_blk", 2),
        ("quads", 6),
        ("corners", 4),
        ("num_nod_per_fa2", 12),
        ("num_fa_in_blk2", 4),
        ("num_fac_per_el1", 11),
        ("num_el_in_blk1", 2),
    ];
    let shorts = |values: &[i16]| Values::Short(values.to_vec());
    let places = |axis: [u8; 9]| Values::Float(axis.map(|at| f32::from(at) / 2.0).to_vec());
    let quads = [1, 2, 3, 4, 5, 6, 7, 8, 1, 2, 6, 5, 2, 3, 7, 6, 3, 4, 8, 7, 4, 1, 5, 8];
    let triangles = [5, 6, 9, 6, 7, 9, 7, 8, 9, 8, 5, 9];
    let with = |faces: [i16; 11]| {
        let mut blocks = plain("facconn1", &[9], shorts(&faces));
        blocks.attributes.push(("elem_type", Attribute::Text("NFACED")));
        let variables = [
            plain("coordx", &[1], places([0, 2, 2, 0, 0, 2, 2, 0, 1])),
            plain("coordy", &[1], places([0, 0, 2, 2, 0, 0, 2, 2, 1])),
            plain("coordz", &[1], places([0, 0, 0, 0, 2, 2, 2, 2, 4])),
            plain("fbconn1", &[5, 6], shorts(&quads)),
            plain("fbconn2", &[7], shorts(&triangles)),
            plain("fbepecnt2", &[8], shorts(&[3; 4])),
            blocks,
            plain("ebepecnt1", &[10], shorts(&[6, 5])),
        ];
        let path = netcdf(folder.path(), 1, &dims, &variables);
        open(&path, &OpenOptions::default(), &Ticket::new()).map_err(|error| error.to_string())
    };
    let found = with([1, 2, 3, 4, 5, 6, 2, 7, 8, 9, 10]).unwrap();
    assert_eq!(found.format, Format::Exodus);
    let told = describe(&found, &Ticket::new()).unwrap().cells.unwrap();
    assert!(told.to_string().contains("2 polyhedra"), "{told}");
    assert!((told.total_volume - 4.0 / 3.0).abs() < 1e-9, "{told}");
    assert!(!found.warnings.join("; ").contains("closed"), "{:?}", found.warnings);
    for wrong in [11, 0] {
        let error = with([1, 2, 3, 4, 5, 6, 2, 7, 8, 9, wrong]).unwrap_err();
        let expected = format!("expected faces from 0 to 9, found {} of polyhedron 1", wrong - 1);
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn pieces_in_several_files_share_the_memory_that_is_free() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("all.pvtu");
    for piece in 0..40 {
        std::fs::copy(data("two.vtu"), folder.path().join(format!("{piece}.vtu"))).unwrap();
    }
    let of = |names: &[String]| {
        let piece = |name: &String| format!("<Piece Source=\"{name}\"/>");
        let text = format!(
            "<VTKFile type=\"PUnstructuredGrid\" byte_order=\"LittleEndian\"><PUnstructuredGrid>{}\
             </PUnstructuredGrid></VTKFile>",
            names.iter().map(piece).collect::<String>()
        );
        std::fs::write(&path, text).unwrap();
        let options = OpenOptions { memory_limit_bytes: Some(20_000), ..OpenOptions::default() };
        open(&path, &options, &Ticket::new())
    };
    let with = |count: usize| of(&(0..count).map(|n| format!("{n}.vtu")).collect::<Vec<_>>());
    assert_eq!(cells_of(&with(3).unwrap()).own_cells(), 6);
    let error = with(40).unwrap_err().to_string();
    assert!(error.contains("fit in memory"), "{error}");
    // The same file again is refused before any is read.
    for twins in [["0.vtu", "1.vtu", "0.vtu"], ["gone.vtu", "0.vtu", "./0.vtu"]] {
        let error = of(&twins.map(str::to_owned)).unwrap_err().to_string();
        let words =
            format!("expected a file of its own for every piece, found the piece {:?}", twins[2]);
        assert!(error.starts_with(&words), "{error}");
    }
}

#[test]
fn a_file_that_names_pieces_opens_them_and_tells_which_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    std::fs::copy(data("two.vtu"), folder.path().join("parts/a.vtu")).unwrap();
    std::fs::copy(data("text.vtu"), folder.path().join("parts/b.vtu")).unwrap();
    let path = folder.path().join("all.pvtu");
    let text = "<VTKFile type=\"PUnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\
        <PUnstructuredGrid GhostLevel=\"0\"><PPointData><PDataArray type=\"Float64\" Name=\"heat\"/>\
        </PPointData><Piece Source=\"parts/a.vtu\"/><Piece Source=\"parts/b.vtu\"/>\
        </PUnstructuredGrid></VTKFile>";
    std::fs::write(&path, text).unwrap();
    let whole = opened(&path);
    assert_eq!((cells_of(&whole).own_points(), cells_of(&whole).own_cells()), (24, 4));
    assert_eq!(whole.grid.field(Some("heat")).unwrap().samples.len(), 24);
    let damaged = std::fs::read_to_string(data("text.vtu")).unwrap().replacen(
        "Points=\"12\"",
        "Points=\"13\"",
        1,
    );
    std::fs::write(folder.path().join("parts/b.vtu"), damaged).unwrap();
    let error = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_err().to_string();
    assert!(error.contains("in the piece \"parts/b.vtu\""), "{error}");
    std::fs::remove_file(folder.path().join("parts/b.vtu")).unwrap();
    let error = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_err().to_string();
    assert!(error.contains("b.vtu") && error.contains("put it there"), "{error}");
}

#[test]
fn polygons_are_counted_by_kind() {
    for name in ["polygons.vtk", "polygons.vtp"] {
        let found = opened(&data(name));
        let types: Vec<(u8, usize)> =
            cells_of(&found).census().by_type.iter().map(|(kind, n)| (*kind, *n)).collect();
        assert_eq!(types, [(1, 2), (4, 1), (6, 1), (9, 1)], "{name}");
        assert_eq!(found.grid.field(Some("mark")).unwrap().association, Association::Cell);
    }
}

#[test]
fn blocks_of_plot3d_are_one_grid_and_one_block_is_curvilinear() {
    let both = opened(&data("blocks.xyz"));
    let cells = cells_of(&both);
    assert_eq!((cells.own_points(), cells.own_cells()), (24, 4));
    let names: Vec<&str> = both.grid.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["Density", "Momentum", "StagnationEnergy", "IBlank"]);
    // Planes of 12 numbers: the second point's momentum is 13, 25, 37.
    assert_eq!(values(&both.grid.fields[1])[3..6], [13.0, 25.0, 37.0]);
    // The fifth point of the first block is blanked: its density is none, and what was drawn there is not.
    let folder = tempfile::tempdir().unwrap();
    let [grid, flow] = ["blocks.xyz", "blocks.q"].map(|name| std::fs::read(data(name)).unwrap());
    let mut blanked = grid;
    let first = 4 * 48;
    assert_eq!(blanked[first + 16..first + 20], [0, 0, 0, 1]);
    blanked[first + 19] = 0;
    std::fs::write(folder.path().join("blocks.xyz"), blanked).unwrap();
    std::fs::write(folder.path().join("blocks.q"), flow).unwrap();
    let holed = opened(&folder.path().join("blocks.xyz"));
    let density = values(&holed.grid.fields[0]);
    assert_eq!((density[4].is_nan(), density[3], density[5]), (true, 3.0, 5.0));
    let momentum = values(&holed.grid.fields[1]);
    assert!(momentum[12..15].iter().all(|v| v.is_nan()) && momentum[11].is_finite());
    assert_eq!(values(&holed.grid.fields[3])[4], 0.0);
    assert!(holed.warnings.iter().any(|said| said.contains("1 point is blanked")));
    for name in ["single.x", "single.q"] {
        let single = opened(&data(name));
        // Its points lie evenly, but it is told what it is.
        assert!(matches!(single.grid.shape, Shape::Curvilinear(_)), "{name}");
        assert_eq!(single.grid.lattice.dims, [3, 2, 2]);
    }
    // Without its flow it has numbers of cells.
    let alone = made("alone.x", std::fs::read(data("single.x")).unwrap());
    assert_eq!(alone.grid.fields[0].name, "cell");
    assert!(alone.warnings.iter().any(|w| w.contains("no solution")), "{:?}", alone.warnings);
    // A number less, and it is none.
    let text = std::fs::read_to_string(data("single.x")).unwrap();
    let cut = text.trim_end().rsplit_once(' ').unwrap().0;
    refused("cut.x", cut);
}

#[test]
fn functions_of_plot3d_are_fields() {
    let [grid, flow] = ["blocks.xyz", "blocks.q"].map(|name| std::fs::read(data(name)).unwrap());
    // In another order of bytes than the grid, and without records; of the second block the third function is 2.
    let mut functions = [2_i32, 3, 2, 2, 3, 2, 2, 3, 3].map(i32::to_le_bytes).concat();
    let numbers = (0..72_u8).map(|i| if i < 60 { f32::from(i) } else { 2.0 });
    functions.extend(numbers.flat_map(f32::to_le_bytes));
    let folder = tempfile::tempdir().unwrap();
    let save = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    save("a.xyz", &grid);
    save("a.fun", &functions);
    let read = |name: &str| opened(&folder.path().join(name));
    let names = |of: &Opened| -> Vec<String> {
        of.grid.fields.iter().map(|field| field.name.clone()).collect()
    };
    let alone = read("a.xyz");
    assert_eq!(names(&alone), ["Function0", "Function1", "Function2", "IBlank"]);
    assert!(!alone.warnings.join("; ").contains("no solution"), "{:?}", alone.warnings);
    // A block has all of its functions before the next one's.
    let second = values(alone.grid.field(Some("Function1")).unwrap());
    assert_eq!((second[0], second[11], second[12], second[23]), (12.0, 23.0, 48.0, 59.0));
    assert_eq!(values(alone.grid.field(Some("Function2")).unwrap())[12..], [2.0; 12]);
    // Whichever of the three is asked for, all open; names lie beside them, and what has one of the flow's is told apart.
    save("a.q", &flow);
    save("a.nam", b"Mach number\nDensity ; Flow\n");
    for name in ["a.xyz", "a.fun", "a.q"] {
        let all = read(name);
        let flow = ["Density", "Momentum", "StagnationEnergy"];
        let own = ["Mach number", "Density 2", "Function2", "IBlank"];
        assert_eq!(names(&all), [&flow[..], &own[..]].concat(), "{name}");
        assert_eq!(values(all.grid.field(Some("Density 2")).unwrap()), second, "{name}");
        assert_eq!(all.warnings.iter().filter(|w| w.contains("several arrays")).count(), 1);
    }
    // One that is cut short is told, and the rest opens.
    save("a.fun", &functions[..functions.len() - 4]);
    let cut = read("a.fun");
    assert_eq!(names(&cut).len(), 4);
    assert!(cut.warnings.join("; ").contains("a.fun is left out: it has no functions"));
    // As text, on a single block; and named by a third file, where they may be missing.
    save("s.x", &std::fs::read(data("single.x")).unwrap());
    save("s.f", format!("3 2 2 1\n{}", "4.5 ".repeat(12)).as_bytes());
    let single = read("s.x");
    assert!(matches!(single.grid.shape, Shape::Curvilinear(_)));
    assert_eq!(values(single.grid.field(Some("Function0")).unwrap()), [4.5; 12]);
    let list = |function: &str| {
        save(
            "s.p3d",
            format!(r#"{{"filenames":[{{"xyz":"s.x","function":"{function}"}}]}}"#).as_bytes(),
        );
        read("s.p3d")
    };
    assert_eq!(names(&list("s.f")), ["Function0"]);
    let missing = list("gone.f");
    assert!(missing.warnings.join("; ").contains("\"gone.f\" that the file names are not there"));
}

#[test]
fn damaged_plot3d_is_known_and_says_what_is_missing() {
    let whole = std::fs::read(data("blocks.xyz")).unwrap();
    let needed = format!(" or {} or ", whole.len());
    says(
        "a.xyz",
        &whole[..whole.len() - 7],
        &[&needed, "bytes for the 2 blocks that a PLOT3D", "cut short"],
    );
    let text = std::fs::read_to_string(data("single.x")).unwrap();
    let cut = text.trim_end().rsplit_once(' ').unwrap().0;
    says("a.x", cut, &["numbers for the", "PLOT3D", "cut short"]);
    says("a.x", text.clone() + &" 1".repeat(20), &["PLOT3D", "more follows than a grid"]);
    says("a.p3d", "0 0 0\n", &["PLOT3D grid, which begins with", "\"0 0 0\""]);
}

/// A .vtu of one cell of four points, and the values there.
fn vtu(kind: u8, places: &str, values: &str) -> String {
    let array = |of: &str, name: &str, text: &str| {
        format!(
            "<DataArray type=\"{of}\" Name=\"{name}\" NumberOfComponents=\"{}\" format=\"ascii\">{text}</DataArray>",
            if name == "p" { 3 } else { 1 }
        )
    };
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece \
         NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData>{}</PointData><Points>{}</Points><Cells>{}{}{}</Cells></Piece>\
         </UnstructuredGrid></VTKFile>",
        array("Float64", "f", values),
        array("Float64", "p", places),
        array("Int64", "connectivity", "0 1 2 3"),
        array("Int64", "offsets", "4"),
        array("UInt8", "types", &kind.to_string()),
    )
}

const CORNERS: &str = "0 0 0 1 0 0 0 1 0 0 0 1";

#[test]
fn cells_that_lack_something_say_what() {
    says(
        "a.vtu",
        vtu(42, CORNERS, "0 1 2 3"),
        &["\"faces\" and \"faceoffsets\"", "type 42", "neither"],
    );
    let tiny = CORNERS.replace('1', "1e-300");
    says(
        "a.vtu",
        vtu(10, &tiny, "0 1 2 3"),
        &["more than 1e-100", "within 1e-300", "a smaller unit"],
    );
    let parallel = "<VTKFile type=\"PUnstructuredGrid\" version=\"0.1\"><PUnstructuredGrid></PUnstructuredGrid></VTKFile>";
    says("a.pvtu", parallel, &["at least one Piece", "found none"]);
    says("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["at least one face", "found none"]);
    says(
        "a.vtk",
        TETRAHEDRON.replace(
            "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10",
            "CELLS 1 500\n4 0 1 2 3\nCELL_TYPES 1\n10",
        ),
        &["500 numbers in text", "bytes, which hold fewer"],
    );
}

#[test]
fn arrays_of_unknown_types_are_told_with_those_that_are_read() {
    let of = |name: &str| {
        let (before, after) = vtu(10, CORNERS, "0 1 2 3")
            .split_once(&format!("\" Name=\"{name}\""))
            .map(|(before, after)| (before.to_owned(), after.to_owned()))
            .expect("an array of that name");
        let (before, _) = before.rsplit_once("type=\"").expect("its type");
        format!("{before}type=\"Quaternion\" Name=\"{name}\"{after}")
    };
    let said = made("a.vtu", of("f")).warnings.join("; ");
    assert!(
        said.contains("\"f\" of type \"Quaternion\" is ignored")
            && said.contains("types Int8, UInt8,")
            && said.contains("Float32 or Float64"),
        "{said}"
    );
    for name in ["p", "connectivity", "types"] {
        let array = format!("array \"{name}\" that is Int8,");
        says("a.vtu", of(name), &[&array, "Float64, found \"Quaternion\""]);
    }
}

#[test]
fn cells_that_are_said_to_be_nothing_are_counted() {
    let kinds = |kinds: &str| {
        let count = kinds.split_whitespace().count();
        let cells = "4 0 1 2 3\n".repeat(count);
        let old = "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10";
        assert!(TETRAHEDRON.contains(old));
        let new = format!("CELLS {count} {}\n{cells}CELL_TYPES {count}\n{kinds}", 5 * count);
        let found = made("a.vtk", TETRAHEDRON.replace(old, &new));
        let told = describe(&found, &Ticket::new()).unwrap().cells.unwrap().to_string();
        (found.warnings.join("; "), told)
    };
    let (said, told) = kinds("10 0 0");
    assert!(said.contains("2 cells are empty (VTK's type 0): left out"), "{said}");
    assert!(told.contains("2 empty cells, 1 tetrahedron"), "{told}");
    let (said, told) = kinds("0 10");
    assert!(said.contains("1 cell is empty") && told.contains("1 empty cell,"), "{said} {told}");
    let (said, _) = kinds("10 10");
    assert!(!said.contains("empty"), "{said}");
    let said = made("a.vtu", vtu(0, CORNERS, "0 1 2 3")).warnings.join("; ");
    assert!(said.contains("1 cell is empty"), "{said}");
}

#[test]
fn lines_and_points_beside_cells_are_told() {
    let said = |kinds: &[(&str, &str)]| {
        let cells: Vec<&str> = kinds.iter().map(|(_, cell)| *cell).collect();
        let size: usize = cells.iter().map(|cell| cell.split_whitespace().count()).sum();
        let types: Vec<&str> = kinds.iter().map(|(kind, _)| *kind).collect();
        let count = kinds.len();
        let (cells, types) = (cells.join("\n"), types.join(" "));
        let new = format!("CELLS {count} {size}\n{cells}\nCELL_TYPES {count}\n{types}");
        let text = TETRAHEDRON.replace("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10", &new);
        made("a.vtk", text).warnings.join("; ")
    };
    let (solid, line, point) = (("10", "4 0 1 2 3"), ("3", "2 0 1"), ("1", "1 2"));
    let beside = "beside cells with an area or a volume: left out";
    assert!(
        said(&[solid, line, line, point]).contains(&format!("2 lines and 1 single point {beside}"))
    );
    assert!(said(&[("5", "3 0 1 2"), line]).contains(&format!("1 line {beside}")));
    assert!(said(&[solid, point, point]).contains(&format!("2 single points {beside}")));
    assert!(!said(&[solid]).contains(beside) && !said(&[line, point]).contains(beside));
}

/// As pieces of parallel grids have them: 1 is another piece's, 32 hidden, 2 has no meaning for cells.
#[test]
fn ghosts_are_left_out_and_counted_and_no_field() {
    let with = |marks: &str| {
        let count = marks.split_whitespace().count();
        let cells = "4 0 1 2 3\n".repeat(count);
        let kinds = "10 ".repeat(count);
        let new = format!("CELLS {count} {}\n{cells}CELL_TYPES {count}\n{kinds}", 5 * count);
        let text = TETRAHEDRON.replace("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10", &new);
        let mark = "SCALARS vtkGhostType unsigned_char 1\nLOOKUP_TABLE default";
        made("a.vtk", format!("{text}\nCELL_DATA {count}\n{mark}\n{marks}\n"))
    };
    let found = with("0 1 32 2");
    assert_eq!(cells_of(&found).solids().len(), 2);
    let said = found.warnings.join("; ");
    assert!(said.contains("2 cells are ghosts of another piece, or hidden"), "{said}");
    assert!(!said.contains("empty"), "{said}");
    assert!(found.grid.fields.iter().all(|field| field.name != "vtkGhostType"));
    assert!(!with("0 0").warnings.join("; ").contains("ghost"));
}

#[test]
fn types_that_are_not_read_are_not_the_files_fault() {
    says("a.vtu", vtu(74, CORNERS, "0 1 2 3"), &["VTK's type 74 at cell 0", "Tetrahedralize"]);
    let cut = TETRAHEDRON.replace("CELLS 1 5\n4 0 1 2 3", "CELLS 1 4\n3 0 1 2");
    says("a.vtk", cut, &["4 corners of cell 0", "copy it again"]);
    for kind in [76, 77] {
        let words = [&format!("VTK's type {kind}, Bézier's, at cell 0"), "split such cells"];
        says("a.vtu", vtu(kind, CORNERS, "0 1 2 3"), &words.map(|word| word as &str));
    }
}

#[test]
fn lagrange_polygons_are_a_surface() {
    let square = made("a.vtu", vtu(70, "0 0 0 1 0 0 1 1 0 0 1 0", "0 1 2 3"));
    let cells = cells_of(&square);
    assert!(cells.is_surface() && square.warnings.is_empty(), "{:?}", square.warnings);
    let told = describe(&square, &Ticket::new()).expect("not cancelled").to_string();
    assert!(told.contains("1 Lagrange quadrilateral"), "{told}");
}

#[test]
fn cells_thinner_than_a_pixel_are_told() {
    let said = |places: &str| made("a.vtu", vtu(10, places, "0 1 2 3")).warnings.join("; ");
    let needle = said("0 0 0 1e9 0 0 0 1e-3 0 0 0 1e-3");
    assert!(
        needle.contains("1.00e9 long and 0.001 wide") && needle.contains("zoom in"),
        "{needle}"
    );
    assert_eq!(said("0 0 0 1900 0 0 0 1 0 0 0 1"), "");
    assert_eq!(said("0 0 0 1 0 0 0 1 0 0 0 1e-6"), "", "a plate is seen from above");
    assert!(said("0 0 0 0 2100 0 1 0 0 0 0 1").contains("2100 long and 1 wide"));
}

#[test]
fn values_that_no_cell_shows_are_counted_as_they_are() {
    let refused = |values: &str| {
        let opened = made("a.vtu", vtu(10, CORNERS, values));
        let field = &opened.grid.fields[0];
        let drawn = opened.grid.scalar(field, Component::Index(0), &Ticket::new());
        drawn.expect_err("nothing is drawn").to_string()
    };
    let some = refused("0 1 inf -inf");
    assert!(some.contains("found only 2 infinite and 2 on no cell that can be drawn"), "{some}");
    assert!(refused("nan nan nan nan").ends_with("found only 4 NaN"));
}

#[test]
fn points_that_stand_in_for_cells_are_told_and_field_data_only_where_they_are_lost() {
    let lost = vtu(10, &CORNERS.replacen('1', "inf", 1), "0 1 2 3");
    let said = made("a.vtu", lost).warnings.join("; ");
    assert!(
        said.contains("all cells of the file have corners that lie nowhere: its points are drawn"),
        "{said}"
    );
    let none = vtu(10, CORNERS, "0 1 2 3").replace("NumberOfCells=\"1\"", "NumberOfCells=\"0\"");
    let (cells, behind) = none.split_once("<Cells>").unwrap();
    let empty = ["0 1 2 3", "4", "10"]
        .iter()
        .fold(behind.to_owned(), |text, numbers| text.replace(&format!(">{numbers}<"), "><"));
    let none = format!("{cells}<Cells>{empty}");
    let said = made("a.vtu", none).warnings.join("; ");
    assert!(said.contains("the file has no cells: its points are drawn by themselves"), "{said}");
    let with = |tuples: usize| {
        let own = format!(
            "<UnstructuredGrid><FieldData><DataArray type=\"Float64\" Name=\"t\" NumberOfTuples=\"{tuples}\" \
             format=\"ascii\">{}</DataArray></FieldData>",
            "1 ".repeat(tuples)
        );
        let text = vtu(10, CORNERS, "0 1 2 3").replacen("<UnstructuredGrid>", &own, 1);
        made("a.vtu", text).warnings.join("; ")
    };
    assert!(with(4).contains("field data"), "as many as there are points");
    assert_eq!(with(44), "", "a number for each time step");
}

#[test]
fn tables_take_places_by_name_and_keep_other_columns() {
    let table = opened(&data("table.csv"));
    let cells = cells_of(&table);
    assert_eq!(cells.points()[1].to_array(), [1.0, 0.0, 0.0]);
    let names: Vec<&str> = table.grid.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["id", "heat"]);
    let cloud = opened(&data("cloud.npy"));
    assert_eq!(cells_of(&cloud).points()[..12], cells.points()[..12]);
    let plain = made("a.txt", "1 2 3\n4 5 6\n");
    assert_eq!(plain.grid.fields[0].name, "log10 density");
    let commented = made("a.xyz", "# x y z val\n1 2 3 nan\n4 5 6 7\n");
    assert_eq!(commented.grid.fields[0].name, "val");
    says("a.txt", "1 2 3\n4 5\n", &["3 columns on line 2", "found 2"]);
    says("a.csv", "x,y,z\n1,2,3\n1,2,three\n", &["numbers on line 3", "\"three\""]);
    says("a.csv", "x,y\n1,2\n", &["csv"]);
}

#[test]
fn a_table_that_ends_within_a_line_says_which() {
    let within = |line: usize, found: usize| {
        [format!("on line {line}, found that the file ends within that line, behind {found};")]
    };
    for (text, line, found) in [
        ("0 0 0 1\n1 0 0 2\n0 1 0 3\n1 1 0", 4, 3),
        ("0 0 0 1\n1 0", 2, 2),
        ("# x y z t\n0 0 0 1\n1 0 0 2\n1", 4, 1),
    ] {
        let words = within(line, found);
        says("a.xyz", text, &["expected 4 columns", &words[0], "cut short"]);
        // Where the line has its end, it was written so.
        says("a.xyz", format!("{text}\n"), &["as on those before it", "correct the line"]);
    }
    let words = within(5, 3);
    let water = "3\nwater\nO 0 0 0\nH 1 0 0\nH 0 1";
    says("a.xyz", water, &["an element and three numbers", &words[0], "cut short"]);
    says("a.xyz", format!("{water}\n"), &["on line 5", "correct the line"]);
    made("a.xyz", "0 0 0 1\n1 0 0 2");
}

#[test]
fn molecules_are_points_with_their_elements() {
    let water =
        made("a.xyz", "3\n# water\nO 0.0 0.0 0.117\nH 0.0 0.757 -0.469\nH 0.0 -0.757 -0.469\n");
    assert_eq!((water.format, water.warnings.join("; ")), (Format::Table, String::new()));
    assert_eq!(cells_of(&water).points()[1].to_array(), [0.0, 0.757, -0.469]);
    let [field] = &water.grid.fields[..] else { panic!("{:?}", water.grid.fields) };
    assert_eq!((field.name.as_str(), values(field)), ("element", vec![8.0, 1.0, 1.0]));
    assert_eq!(water.grid.unit.as_deref(), Some("Å"));
    let told = describe(&water, &Ticket::new()).unwrap().to_string();
    assert!(told.contains("1 is H") && told.contains("8 is O"), "{told}");
    let drawn = water.grid.scalar(field, Component::Index(0), &Ticket::new());
    assert!(drawn.is_ok(), "{:?}", drawn.err());
    // Steps in time, and charges.
    let step = "2\n\nC 0 0 0 0.5\nN 1.1 0 0 -0.5\n";
    let steps = made("a.xyz", step.repeat(3));
    assert_eq!(cells_of(&steps).own_points(), 2);
    let said = steps.warnings.join("; ");
    assert!(said.contains("2 more molecules follow the first: left out"), "{said}");
    assert!(said.contains("1 column behind the atoms' places is left out"), "{said}");
    let said = made("a.xyz", format!("{step}\nthe end\n")).warnings.join("; ");
    assert!(said.contains("1 line follows the 2 atoms: left out"), "{said}");
    says("a.xyz", "3\nwater\nO 0 0 0\nH 0 1 0\n", &["3 atoms", "found 2"]);
    says("a.xyz", "2\n\nO 0 0 0\nWater 0 1 0\n", &["on line 4", "\"Water 0 1 0\""]);
    // Places alone are a table.
    let plain = made("a.xyz", "1 2 3\n4 5 6\n");
    assert_eq!((cells_of(&plain).own_points(), plain.grid.label_names.len()), (2, 0));
}

#[test]
fn headers_of_tables_are_read_as_programs_write_them() {
    let names_of = |text: &str| {
        let table = made("a.csv", text);
        let names = table.grid.fields.iter().map(|field| field.name.clone()).collect::<Vec<_>>();
        (cells_of(&table).points()[1].to_array(), names, table.warnings.join("; "))
    };
    let (place, names, said) = names_of("\"p (Pa, abs)\",x,y,z\n9,0,0,0\n9,5,1,1\n9,0,1,0\n");
    assert_eq!(
        (place, names, said),
        ([5.0, 1.0, 1.0], vec!["p (Pa, abs)".to_owned()], String::new())
    );
    // A separator that nothing follows, and a mark of the encoding.
    let (place, names, said) = names_of("\u{feff}x,y,z,v\n0,0,0,1,\n1,2,3,4,\n5,6,7,8,\n");
    assert_eq!((place, names, said), ([1.0, 2.0, 3.0], vec!["v".to_owned()], String::new()));
    let (place, _, said) = names_of("T,x_coord,y_coord,Z [mm]\n7,0,0,0\n7,1,2,3\n");
    assert_eq!((place, said), ([1.0, 2.0, 3.0], String::new()));
    let (_, _, said) = names_of("a,b,c\n1,2,3,4\n5,6,7,8\n");
    assert!(said.contains("another number of words than the rows, 4"), "{said}");
    let (_, _, said) = names_of("a,b,c,d\n1,2,3,4\n5,6,7,8\n");
    assert!(said.contains("\"a\", \"b\", \"c\"") && said.contains("rename the columns"), "{said}");
}

#[test]
fn tables_leave_out_columns_of_words_and_take_values_as_missing() {
    let table = made(
        "a.csv",
        "name,lat,lon,depth,\"mag\",kind\na,1,2,3,4,\"q\"\nb,2,3,5,NA,\"r\"\nc,7,1,0,n/a,\n",
    );
    assert_eq!(cells_of(&table).points()[2].to_array(), [7.0, 1.0, 0.0]);
    let [field] = &table.grid.fields[..] else { panic!("{:?}", table.grid.fields) };
    assert!(field.name == "mag" && field.samples.get(0) == 4.0 && field.samples.get(1).is_nan());
    let said = table.warnings.join("; ");
    let words = "columns of words are left out: \"name\" (such as \"a\"), \"kind\" (such as \"q\")";
    assert!(said.contains(words) && said.contains("\"lat\", \"lon\", \"depth\""), "{said}");
    assert!(said.contains("2 of 3 in \"mag\""), "{said}");
    // Without names, and with decimal commas.
    let bare = made("a.csv", "1,5;2;3;st1\n4;5;6,25;st2\n");
    assert_eq!(cells_of(&bare).points()[1].to_array(), [4.0, 5.0, 6.25]);
    let said = bare.warnings.join("; ");
    assert!(said.contains("a column of words is left out: \"column 4\""), "{said}");
    assert!(said.contains("\"1,5\", are taken for decimal points"), "{said}");
    // Between tabs an entry may be empty, inside a line and at its end, and one line may have blanks.
    let tabs =
        made("a.tsv", "x\ty\tz\tv\tw\n1\t2\t3\t4\t5\n5\t6\t7\t\t8\n1\t1\t1\t2\t\n8 9 10 11 12\n");
    let values = |field: usize| {
        let samples = &tabs.grid.fields[field].samples;
        (0..samples.len()).map(|i| samples.get(i)).collect::<Vec<f64>>()
    };
    assert_eq!(cells_of(&tabs).points()[3].to_array(), [8.0, 9.0, 10.0]);
    let [v, w] = [0, 1].map(values);
    assert!(
        v[1].is_nan() && w[2].is_nan() && [v[3], w[1], w[3]] == [11.0, 8.0, 12.0],
        "{v:?} {w:?}"
    );
    // The first row may end with one, too; where every row without names does, nothing follows.
    let first = made("a.tsv", "x\ty\tz\tt\n1\t2\t3\t\n4\t5\t6\t7\n");
    assert_eq!(
        (first.grid.fields[0].name.as_str(), first.grid.fields[0].samples.get(1)),
        ("t", 7.0)
    );
    for rows in ["1\t2\t3\t\n4\t5\t6\t\n", "1,2,3,\n4,5,6,\n"] {
        let names =
            made("a.csv", rows).grid.fields.iter().map(|f| f.name.clone()).collect::<Vec<_>>();
        assert_eq!(names, ["log10 density"]);
    }
    // What lies nowhere is told once.
    let nowhere = made("a.csv", "1,2,3,4\nnan,2,3,4\n").warnings.join("; ");
    assert_eq!(nowhere, "1 point lies nowhere (NaN or infinite): left out");
    says("a.csv", "x,y,z,t\n1,2,3,4\n1,2,3,5\n1,b,3,c\n", &["numbers on line 4", "\"b\""]);
    says("a.csv", "x,y,z,t\na,1,2,3\nb,1,2,4\n", &["column \"x\" of a place", "such as \"a\""]);
    says(
        "a.csv",
        "a,b,c,d,e\n1,2,3,p,q\nr,s,t,p,q\nr,s,t,p,q\n",
        &["three columns of numbers", "0 beside 5"],
    );
}

#[test]
fn tables_without_rows_or_places_say_what_is_missing() {
    says("a.csv", "x,y,z,t\n", &["below the names of its columns", "\"x,y,z,t\" alone"]);
    says(
        "a.csv",
        "x,y,z,t\na,b,c,d\n",
        &["a table of points", "a text without a number", "\"x,y,z,t\""],
    );
    says(
        "a.csv",
        "x,y,z,t\nnan,NA,,1\n-,nan,nan,2\n",
        &["finite place", "2 points that lie nowhere"],
    );
    says(
        "a.csv",
        "x,y,z,v\r1,2,3,4\r2,3,5,5\r",
        &["a line feed", "carriage return alone in line 1"],
    );
    let thousands = refused("a.csv", "x,y,z,v\n\"1,000\",2,3,4\n\"2,000\",3,5,5\n");
    assert!(thousands.contains("separators of thousands"), "{thousands}");
    let lacking = made("a.csv", "x,y,z,t\n1,2,3,inf\n1,inf,3,4\n5,5,1,3\n").warnings.join("; ");
    assert!(lacking.contains("1 of 3 in \"t\""), "{lacking}");
    assert!(lacking.contains("1 point lies nowhere (NaN or infinite): left out"), "{lacking}");
}

#[test]
fn what_is_left_out_or_told_apart_is_said() {
    let flat = TETRAHEDRON.replace(
        "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10",
        "CELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10 5",
    );
    let said = made("a.vtk", flat).warnings.join("; ");
    assert!(said.contains("1 polygon has no volume"), "{said}");
    let alone = TETRAHEDRON
        .replace("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10", "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5");
    // It is shown as a surface.
    let said = made("a.vtk", alone).warnings.join("; ");
    assert!(!said.contains("volume"), "{said}");
    assert!(!made("a.vtk", TETRAHEDRON).warnings.join("; ").contains("volume"));
    let twice = format!(
        "{TETRAHEDRON}POINT_DATA 4\nSCALARS a float 1\nLOOKUP_TABLE default\n1 2 3 4\n\
        SCALARS a float 1\nLOOKUP_TABLE default\n5 6 7 8\n"
    );
    let twice = made("a.vtk", twice);
    let names: Vec<&str> = twice.grid.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["a", "a 2"]);
    assert!(twice.warnings.join("; ").contains("several arrays are called \"a\""));
}

#[test]
fn how_far_straight_parts_of_curved_cells_are_off_is_said() {
    let cell = |kind: u8, count: usize, values: &str| {
        let points: String =
            (0..count).map(|i| format!("{i} {} {}\n", i * i % 7, i * 3 % 5)).collect();
        let corners: String = (0..count).map(|i| format!(" {i}")).collect();
        let text = format!(
            "# vtk DataFile Version 3.0\nq\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {count} float\n{points}\
             CELLS 1 {}\n{count}{corners}\nCELL_TYPES 1\n{kind}\nPOINT_DATA {count}\n\
             SCALARS flat float 1\nLOOKUP_TABLE default\n{}\nSCALARS T float 1\nLOOKUP_TABLE default\n{values}\n",
            count + 1,
            "2 ".repeat(count)
        );
        made("a.vtk", text).warnings.join("; ")
    };
    // Along the edge from 0 to 1 by way of the fifth point: 0, 1, 0, with a range of 2. |0 − 2 + 0| / 8 / 2.
    let said = cell(24, 10, "0 0 2 0 1 1 1 0 0 1");
    assert!(said.contains("along edges \"T\" is off by up to 12.50 % of its range"), "{said}");
    let said = cell(25, 20, &["0 4 4 0 0 4 4 0", "3 4 2 0 2 4 2 0", "0 4 4 0"].join(" "));
    assert!(said.contains("up to 6.25 %"), "|0 − 6 + 4| / 8 / 4: {said}");
    // Of the third order: along the edge from 1 to 2, of four points, 0, 0, 0, 2.
    let said = cell(71, 20, &format!("0 0 2 0{}", " 0".repeat(16)));
    assert!(said.contains("\"T\" is off by up to 12.50 %"), "|0 − 0 + 2| / 8 / 2: {said}");
    // Straight along all edges.
    let said = cell(24, 10, "0 2 0 0 1 1 0 0 1 0");
    assert!(said.contains("straight parts") && !said.contains('%'), "{said}");
    assert!(!cell(10, 4, "0 1 2 3").contains("straight"));
}

#[test]
fn arrays_that_are_too_short_or_too_long_are_named() {
    let text = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let array = "<PointData><DataArray type=\"Float32\" Name=\"heat\" format=\"ascii\">";
    let with = |numbers: &str| {
        text.replacen("<Points>", &format!("{array}{numbers}</DataArray></PointData><Points>"), 1)
    };
    made("a.vtu", with("1 2 3 4"));
    for (numbers, found) in [("1 2 3", "found 3"), ("1 2 3 4 5 6", "found 6")] {
        says("a.vtu", with(numbers), &["expected 4 numbers in the array \"heat\"", found]);
    }
    let many = text.replacen("NumberOfPoints=\"4\"", "NumberOfPoints=\"1000000000\"", 1);
    says("a.vtu", many, &["100000000", "bytes in all", "cut short"]);
}

const TETRAHEDRON: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";

#[test]
fn cells_that_cannot_be_are_refused_in_a_sentence() {
    let with = |from: &str, to: &str| TETRAHEDRON.replace(from, to);
    assert_eq!(made("a.vtk", TETRAHEDRON).grid.fields[0].name, "cell");
    says("a.vtk", with("4 0 1 2 3", "4 0 1 2 4"), &["points, 0 to 3", "found 4"]);
    says("a.vtk", with("4 0 1 2 3", "4 0 1 2 -1"), &["points, 0 to 3", "found -1"]);
    says("a.vtk", with("4 0 1 2 3", "3 0 1 2 3"), &["1 cells that end with their 5", "after 4"]);
    says("a.vtk", with("CELLS 1 5\n4 0 1 2 3", "CELLS 1 4\n3 0 1 2"), &["4 corners", "found 3"]);
    says("a.vtk", with("TYPES 1\n10", "TYPES 2\n10 10"), &["CELL_TYPES of 1", "found 2"]);
    says("a.vtk", with("\n10\n", "\n99\n"), &["type 99 at cell 0"]);
    says("a.vtk", with("\n10\n", "\n300\n"), &["0 to 255", "300"]);
    says("a.vtk", with("CELL_TYPES 1\n10\n", ""), &["CELL_TYPES before the data"]);
    says("a.vtk", with("CELLS 1 5", "CELLS 9 5"), &["9 numbers or more for 9 cells"]);
    let new = "CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\n";
    let new = with("CELLS 1 5\n4 0 1 2 3\n", new);
    assert_eq!(cells_of(&made("a.vtk", &new)).solids().len(), 1);
    says("a.vtk", new.replace("0 4\n", "0 3\n"), &["offsets that end", "found 3"]);
    says("a.vtk", new.replace("0 4\n", "0 5\n"), &["offsets of cells that rise", "5 after 0"]);
    says("a.vtk", new.replace("0 4\n", "1 4\n"), &["an offset for each of 1 cells"]);
    says("a.vtk", new.replace("OFFSETS vtktypeint64", "OFFSETS float"), &["whole numbers"]);
}

#[test]
fn an_unstructured_grid_that_ends_before_its_cells_is_cut_short() {
    let (points, _) = TETRAHEDRON.split_once("CELLS").unwrap();
    says("a.vtk", points, &["expected CELLS", "found that the file ends", "POLYDATA"]);
    let alone = made("a.vtk", points.replace("UNSTRUCTURED_GRID", "POLYDATA"));
    assert_eq!(cells_of(&alone).own_points(), 4, "the advice works");
    // What says that it has none, or has more behind, is whole.
    made("a.vtk", format!("{points}CELLS 0 0\nCELL_TYPES 0\n"));
    let data = "POINT_DATA 4\nSCALARS t float 1\nLOOKUP_TABLE default\n1 2 3 4\n";
    let said = made("a.vtk", format!("{points}{data}")).warnings.join("; ");
    assert!(said.contains("the file has no cells: its points are drawn by themselves"), "{said}");
}

#[test]
fn exodus_without_elements_says_that_its_nodes_are_points() {
    let folder = tempfile::tempdir().unwrap();
    let places = |axis: [u8; 4]| Values::Float(axis.map(f32::from).to_vec());
    let axes = [
        plain("coordx", &[0], places([0, 1, 0, 1])),
        plain("coordy", &[0], places([0, 0, 1, 1])),
        plain("coordz", &[0], places([0, 0, 0, 2])),
    ];
    let said = |dims: &[(&str, usize)]| {
        let found = opened(&netcdf(folder.path(), 1, dims, &axes));
        assert_eq!(found.format, Format::Exodus);
        let cells = cells_of(&found);
        assert_eq!(cells.points()[3].to_array(), [1.0, 1.0, 2.0]);
        assert_eq!((cells.own_points(), cells.own_cells()), (4, 0));
        found.warnings.join("; ")
    };
    let none = "no block of elements was found: its nodes are shown as points";
    for dims in [&[("num_nodes", 4), ("num_dim", 3)][..], &[("num_nodes", 4)]] {
        let said = said(dims);
        assert!(said.contains(none) && !said.contains("no cells"), "{said}");
    }
    let said = said(&[("num_nodes", 4), ("num_dim", 3), ("num_elem", 5), ("num_el_blk", 1)]);
    assert!(said.contains("found, though the file promises 5 elements: its nodes"), "{said}");
}

#[test]
fn exodus_has_its_numbers_in_the_types_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let dims =
        [("num_dim", 3), ("num_nodes", 4), ("time_step", 1), ("num_nod_var", 2), ("len_name", 4)];
    let zeros = || Values::Float(vec![0.0, 1.0, 0.0, 1.0]);
    let variables = [
        plain("coordx", &[1], zeros()),
        plain("coordy", &[1], zeros()),
        plain("coordz", &[1], zeros()),
        plain("name_nod_var", &[3, 4], Values::Text("a\0\0\0b\0\0\0")),
        plain("vals_nod_var1", &[2, 1], Values::Float(vec![1.0, 2.0, 3.0, 0.1])),
        plain("vals_nod_var2", &[2, 1], Values::Double(vec![1.0, 2.0, 3.0, 0.1])),
    ];
    let found = opened(&netcdf(folder.path(), 1, &dims, &variables));
    let told = describe(&found, &Ticket::new()).unwrap();
    let types: Vec<(&str, &str)> =
        told.fields.iter().map(|field| (&*field.name, &*field.scalar_type)).collect();
    assert_eq!(types, [("a", "float32"), ("b", "float64")]);
    let text = told.to_string();
    assert!(text.contains("a: 1 × float32") && text.contains("b: 1 × float64"), "{text}");
}

#[test]
fn offsets_and_connectivity_that_disagree_are_refused() {
    let text = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let with = |from: &str, to: &str| text.replacen(from, to, 1);
    says("a.vtu", with(">0 1 2 3<", ">0 1 2 9<"), &["points, 0 to 3", "found 9"]);
    says("a.vtu", with(">4<", ">3<"), &["a connectivity of 3 corners", "found 4"]);
    says("a.vtu", with(">4 6<", ">6 4<"), &["a connectivity of 4 corners", "found 6"]);
    says("a.vtu", with(">4 6<", ">7 6<"), &["offsets of cells that rise", "7 after 0"]);
    says("a.vtu", with(">17<", ">16<"), &["16 numbers in the array \"faces\"", "found 17"]);
    says("a.vtu", with("\"offsets\"", "\"offsts\""), &["the array \"offsets\" of cells"]);
    let other = with("type=", "compressor=\"vtkOtherCompressor\" type=");
    says("a.vtu", other, &["vtkOtherCompressor", "zlib"]);
}

#[test]
fn blocks_of_lzma_have_the_bytes_that_they_say_and_their_checksum() {
    let text = std::fs::read_to_string(data("lzma.vtu")).unwrap();
    // 96 bytes as one of 128; and as one of 64.
    let head = "AQAAAACAAABgAAAAXAAAAA==";
    let with = |from: &str, to: &str| text.replacen(from, to, 1);
    assert!(text.contains(head) && text.contains("c19X4ABf") && text.contains("aCUiYAAE5"));
    says("a.vtu", with("AQAAAACAAABgAAAA", "AQAAAACAAABAAAAA"), &["expected 96 bytes", "has 64"]);
    // A letter of what is packed, and one of its checksum.
    says("a.vtu", with("c19X4ABf", "c19X4ABg"), &["data that decode", "damage"]);
    says("a.vtu", with("aCUiYAAE5", "aCUiZAAE5"), &["data that decode", "damage"]);
}

#[test]
fn a_thousand_million_promised_cells_are_refused_before_they_are_allocated() {
    let many = "1000000000";
    let xml = std::fs::read_to_string(data("poly.vtu")).unwrap();
    let xml = |name: &str, n: &str| {
        let [from, to] = [n, many].map(|n| format!("{name}=\"{n}\""));
        xml.replacen(&from, &to, 1)
    };
    let texts = [
        ("a.vtu", xml("NumberOfCells", "1")),
        ("a.vtu", xml("NumberOfPoints", "4")),
        ("a.vtk", TETRAHEDRON.replace("CELLS 1 5", &format!("CELLS {many} 5000000000"))),
        ("a.vtk", TETRAHEDRON.replace("CELL_TYPES 1", &format!("CELL_TYPES {many}"))),
        ("a.vtk", TETRAHEDRON.replace("POINTS 4", &format!("POINTS {many}"))),
    ];
    for (name, text) in texts {
        let said = refused(name, text);
        assert!(!said.contains("close other programs"), "the file is at fault: {said}");
    }
    assert!(LARGEST.load(Ordering::Relaxed) < 64 << 20, "nothing of that size was asked for");
}

/// A point at no place took the whole grid away.
#[test]
fn curvilinear_grids_are_without_the_cells_at_points_that_lie_nowhere() {
    let place = |i: usize| format!("{} {} {}", i % 3, i / 3 % 2, i / 6);
    let places = |nowhere: &[usize]| -> String {
        let place = |i| if nowhere.contains(&i) { "0 nan 0".to_owned() } else { place(i) };
        (0..12).map(place).collect::<Vec<_>>().join("\n")
    };
    let heat: Vec<String> = (0..12).map(|i| i.to_string()).collect();
    let legacy = |nowhere: &[usize]| {
        format!(
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS 3 2 2\nPOINTS 12 double\n{}\n\
             POINT_DATA 12\nSCALARS heat double 1\nLOOKUP_TABLE default\n{}\n",
            places(nowhere),
            heat.join(" ")
        )
    };
    let xml = |nowhere: &[usize]| {
        format!(
            "<VTKFile type=\"StructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><StructuredGrid \
             WholeExtent=\"0 2 0 1 0 1\"><Piece Extent=\"0 2 0 1 0 1\"><PointData><DataArray type=\"Float64\" \
             Name=\"heat\" format=\"ascii\">{}</DataArray></PointData><Points><DataArray type=\"Float64\" Name=\"p\" \
             NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points></Piece></StructuredGrid></VTKFile>",
            heat.join(" "),
            places(nowhere)
        )
    };
    let plot3d = |nowhere: &[usize]| {
        let text = std::fs::read_to_string(data("single.x")).unwrap();
        let mut words: Vec<&str> = text.split_whitespace().collect();
        for point in nowhere {
            // Behind three sizes.
            words[3 + point] = "nan";
        }
        words.join(" ")
    };
    let texts = |nowhere: &[usize]| {
        [("a.vtk", legacy(nowhere)), ("a.vts", xml(nowhere)), ("a.x", plot3d(nowhere))]
    };
    for (name, text) in texts(&[]) {
        let whole = made(name, text);
        assert!(matches!(whole.grid.shape, Shape::Curvilinear(_)), "{name}");
        let told = told(&whole);
        assert!(told.contains("points     12\ncells      2 hexahedra\nvolume     2"), "{told}");
    }
    // A corner of the first of two cells.
    for (name, text) in texts(&[3]) {
        let holed = made(name, text);
        let cells = cells_of(&holed);
        assert_eq!((cells.own_points(), cells.own_cells()), (12, 2), "{name}");
        assert_eq!((cells.solids().len(), cells.sources()), (1, &[1][..]), "{name}");
        let said = holed.warnings.join("; ");
        assert!(said.contains("1 cell with corners that lie nowhere"), "{name}: {said}");
        let field = &holed.grid.fields[0];
        let drawn = holed.grid.scalar(field, Component::Index(0), &Ticket::new());
        assert!(drawn.unwrap_or_else(|error| panic!("{name}: {error}")).cells.is_some());
    }
    for (name, text) in texts(&(0..12).collect::<Vec<usize>>()) {
        says(name, text, &["at least one point at a finite place", "12 points"]);
    }
}

/// What `info` says in text.
fn told(opened: &Opened) -> String {
    describe(opened, &Ticket::new()).expect("not cancelled").to_string()
}

#[test]
fn cells_of_curvilinear_grids_are_told_as_those_of_others_are() {
    let grid = |dims: &str, places: &str| {
        let count = places.split_whitespace().count() / 3;
        let text = format!(
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS {dims}\nPOINTS {count} double\n\
             {places}\nPOINT_DATA {count}\nSCALARS heat double 1\nLOOKUP_TABLE default\n{}\n",
            "1 ".repeat(count)
        );
        made("a.vtk", text)
    };
    let layer = |z: f64| format!("0 0 {z} 1 0 {z} 0 1 {z} 1 1 {z} ");
    // Up by 1, nowhere, and down by 3, into the first one.
    let layers = [0.0, 1.0, 1.0, -2.0].map(layer).concat();
    let bent = grid("2 2 4", &layers);
    let json = serde_json::to_value(describe(&bent, &Ticket::new()).unwrap()).unwrap();
    for (name, expected) in
        [("points", 16), ("cells", 3), ("flat_cells", 1), ("inverted_cells", 1), ("split_cells", 0)]
    {
        assert_eq!(json[name], expected, "{name}: {json}");
    }
    assert_eq!(json["cell_kinds"], serde_json::json!({ "hexahedra": 3 }));
    let text = told(&bent);
    assert!(text.contains("1 without volume") && text.contains("1 inverted"), "{text}");
    let flat = told(&grid("2 2 1", &layer(0.0)));
    assert!(flat.contains("points     4\ncells      1 quadrilateral\n"), "{flat}");
}

/// A line through many points has one number, its own, which would be one body.
#[test]
fn points_of_a_line_are_told_apart() {
    let text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 3 1 0\nLINES 1 5\n4 0 1 2 3\n";
    let Opened { grid, .. } = made("a.vtk", text);
    let [field] = &grid.fields[..] else { panic!("{:?}", grid.fields) };
    assert_eq!((field.association, field.samples.len()), (Association::Point, 4));
}

/// The middle of no faces lies nowhere and has no number.
#[test]
fn points_of_a_polyhedron_without_faces_are_drawn() {
    let array = |name: &str, kind: &str, values: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{values}</DataArray>")
    };
    let text = format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" \
         NumberOfCells=\"1\"><PointData>{}</PointData><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" \
         format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>{}{}{}{}{}</Cells></Piece></UnstructuredGrid>\
         </VTKFile>",
        array("s", "Float64", "0 1 2 3"),
        array("connectivity", "Int64", "0 1 2 3"),
        array("offsets", "Int64", "4"),
        array("types", "UInt8", "42"),
        array("faces", "Int64", "0"),
        array("faceoffsets", "Int64", "1"),
    );
    let Opened { grid, .. } = made("a.vtu", text);
    let drawn = (&grid.fields[0], Component::Index(0));
    let path = Path::new("a.vtu");
    let mesh = voxsplat::io::mesh::surface_of(path, &grid, drawn, &[], &Ticket::new());
    let mesh = mesh.expect("drawn").expect("a file of points").mesh;
    assert_eq!(mesh.arrays()[0].range(), Some([0.0, 3.0]));
}

#[test]
fn lengths_of_arrays_are_said_to_follow_from_the_counts_of_pieces() {
    // The length of 3 numbers of 32 bits, and these, where there are 4 points.
    let three = "DAAAAAAAAAAAAAAAAAAAAA==";
    let ascii = "format=\"ascii\">1 2 3 4<";
    let text = std::fs::read_to_string(data("poly.vtu")).unwrap();
    assert!(text.contains(ascii));
    let short = text.replacen(ascii, &format!("format=\"binary\">{three}<"), 1);
    let error = refused("a.vtu", short);
    assert!(error.contains("expected 16 bytes of an array for the points and cells"), "{error}");
    assert!(
        error.contains("found that the array has 12; correct the numbers of points"),
        "{error}"
    );
    assert!(!error.contains("extent"), "{error}");
}

#[test]
fn files_of_nothing_of_one_and_of_nowhere() {
    let only_points = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\n\
        POINTS 2 float\n0 0 0 1 0 nan\n";
    let points = made("a.vtk", only_points);
    assert_eq!(
        (points.grid.fields[0].name.as_str(), points.grid.fields.len()),
        ("log10 density", 1)
    );
    assert_eq!(cells_of(&points).own_cells(), 0);
    let one = made("a.vtk", TETRAHEDRON.replace("0 0 1\n", "0 0 inf\n"));
    assert_eq!(cells_of(&one).census().not_finite, 1);
    assert!(one.warnings.iter().any(|w| w.contains("1 cell with corners that lie nowhere")));
    says("a.vtk", only_points.replace("0 0 0 1 0 nan", "nan 0 0 1 0 inf"), &["finite place"]);
    let empty = only_points.replace("POINTS 2 float\n0 0 0 1 0 nan", "POINTS 0 float");
    says("a.vtk", empty, &["none"]);
    // Wherever a file is cut it has an answer.
    for at in (1..TETRAHEDRON.len()).step_by(7) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vtk");
        std::fs::write(&path, &TETRAHEDRON[..at]).unwrap();
        drop(open(&path, &OpenOptions::default(), &Ticket::new()));
    }
}

/// Two tetrahedra, the second a little beside the first: the middle of each is inside the other.
#[test]
fn cells_inside_others_are_told() {
    let both = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n\
        0 0 0 1 0 0 0 1 0 0 0 1 0.05 0.05 0.05 1.05 0.05 0.05 0.05 1.05 0.05 0.05 0.05 1.05\n\
        CELLS 2 10\n4 0 1 2 3\n4 4 5 6 7\nCELL_TYPES 2\n10 10\n";
    let told = |text: &str| describe(&made("a.vtk", text), &Ticket::new()).unwrap();
    let info = told(both);
    assert_eq!(info.cells.as_ref().unwrap().overlapping_cells, 2);
    let text = info.to_string();
    assert!(text.contains("2 with their middle inside another"), "{text}");
    let apart = told(&both.replace("1.05", "9").replace("0.05", "8"));
    assert_eq!(apart.cells.as_ref().unwrap().overlapping_cells, 0);
    assert!(!apart.to_string().contains("inside another"), "{apart}");
}

/// Two hexahedra of which one is nine times as long: statistics and the histogram count by volume, not by cells or points.
#[test]
fn means_and_histograms_of_meshes_are_weighted_by_volume() {
    let text = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 12 float\n\
        0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1 10 0 0 10 1 0 10 0 1 10 1 1\n\
        CELLS 2 18\n8 0 1 2 3 4 5 6 7\n8 1 8 9 2 5 10 11 6\nCELL_TYPES 2\n12 12\n\
        CELL_DATA 2\nSCALARS load double 1\nLOOKUP_TABLE default\n0 1\n";
    let opened = made("a.vtk", text);
    let field = opened.grid.field(Some("load")).unwrap();
    let volume = opened.grid.scalar(field, Component::Index(0), &Ticket::new()).unwrap();
    let statistics = &volume.statistics;
    assert!((statistics.mean - 0.9).abs() < 0.01, "{}", statistics.mean);
    let counts = &statistics.histogram;
    let all: u64 = counts.iter().sum();
    let share = counts[counts.len() / 2..].iter().sum::<u64>() as f64 / all as f64;
    assert!((share - 0.9).abs() < 0.01, "{share}");
}
