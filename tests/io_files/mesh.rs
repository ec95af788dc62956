//! Files of triangles: what they hold, and what is said of damaged ones.

use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use proptest::prelude::*;
use voxsplat::core::{Srgb8, Ticket};
use voxsplat::io::OpenOptions;
use voxsplat::io::mesh::{OpenedMesh, open, surface_of};
use voxsplat::polygons::{Mesh, MeshValues};
use voxsplat::volume::Component;

/// A square of two triangles, askew.
const CORNERS: [[f32; 3]; 4] =
    [[0.0, 0.0, 1.5], [2.0, -0.0, 1.5], [2.0, 3.25, -1.0], [0.0, 3.25, -1.0]];
const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn saved(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("written");
    (folder, path)
}

fn read(name: &str, bytes: &[u8]) -> Result<OpenedMesh, String> {
    let (_folder, path) = saved(name, bytes);
    open(&path, None, &Ticket::new()).map_err(|error| {
        let text = error.to_string();
        assert!(text.starts_with("expected ") && !text.contains('\n'), "{text}");
        assert!(text.ends_with(&format!(": {}", path.display())), "the path is last: {text}");
        text.replace(&path.display().to_string(), "PATH")
    })
}

#[test]
fn volumes_are_no_triangles_and_that_is_said() {
    let vtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\n\
               SPACING 1 1 1\nPOINT_DATA 8\nSCALARS v float\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8\n";
    let nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\nx";
    for (name, text) in [("a.vtk", vtk), ("a.nrrd", nrrd)] {
        let told = read(name, text.as_bytes()).expect_err("no triangles");
        let format = &name[2..];
        assert!(
            told.contains(&format!("found a volume or points ({format}); open it by itself")),
            "{told}"
        );
    }
}

/// Corners of every triangle, in order.
fn soup(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles(false).map(|t| t.corners).collect()
}

fn square() -> Vec<[Vec3; 3]> {
    TRIANGLES.map(|t| t.map(|i| Vec3::from(CORNERS[i as usize]))).to_vec()
}

fn stl_ascii() -> Vec<u8> {
    let mut text = "solid\n".to_owned();
    for t in TRIANGLES {
        text += "facet normal 0 0 0\n outer loop\n";
        for i in t {
            let [x, y, z] = CORNERS[i as usize];
            text += &format!("  vertex {x} {y:e} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn stl_binary(comment: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes[..comment.len()].copy_from_slice(comment);
    bytes.extend(2_u32.to_le_bytes());
    for t in TRIANGLES {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flat_map(|i| CORNERS[*i as usize]).flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

const PLY_HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty double z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n\
    property float ny\nproperty float nz\nelement face 1\nproperty uchar quality\n\
    property list uchar int vertex_indices\nend_header\n";

fn ply_ascii() -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\ncomment of ours\n{PLY_HEADER}");
    for (i, [x, y, z]) in CORNERS.into_iter().enumerate() {
        text += &format!("{x} {y} {z} {} 20 255 0 0 2\n", 10 * i);
    }
    (text + "7 4 0 1 2 3\n").into_bytes()
}

fn ply_binary(is_big: bool) -> Vec<u8> {
    let order = if is_big { "big" } else { "little" };
    let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{PLY_HEADER}").into_bytes();
    let single = |v: f32| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    let double = |v: f64| if is_big { v.to_be_bytes() } else { v.to_le_bytes() };
    for (i, [x, y, z]) in CORNERS.into_iter().enumerate() {
        bytes.extend([single(x), single(y)].concat());
        bytes.extend(double(f64::from(z)));
        bytes.extend([10 * i as u8, 20, 255]);
        bytes.extend([single(0.0), single(0.0), single(2.0)].concat());
    }
    bytes.extend([7, 4]);
    bytes.extend((0..4_i32).flat_map(|i| if is_big { i.to_be_bytes() } else { i.to_le_bytes() }));
    bytes
}

const OBJ: &str = "# a square\nmtllib none.mtl\no one\nv 0 0 1.5\nv 2 0 1.5\nv 2 3.25 -1\n\
    v 0 3.25 -1\nvn 0 0 1\nusemtl none\nf 1//1 2//1 -2//1 4//1\n";

#[test]
fn every_format_has_the_same_square() {
    for (name, bytes) in [
        ("a.stl", stl_ascii()),
        ("A.STL", stl_binary(b"")),
        ("b.stl", stl_binary(b"solid but binary")),
        ("a.ply", ply_ascii()),
        ("b.ply", ply_binary(false)),
        ("no ending", ply_binary(true)),
        ("a.obj", OBJ.as_bytes().to_vec()),
    ] {
        let opened = read(name, &bytes).unwrap();
        assert_eq!(soup(&opened.mesh), square(), "{name}");
        assert_eq!((opened.mesh.name(), &opened.warnings), (name, &Vec::new()));
    }
}

#[test]
fn colours_and_normals_come_along() {
    for bytes in [ply_ascii(), ply_binary(false), ply_binary(true)] {
        let mesh = read("a.ply", &bytes).unwrap().mesh;
        let first = mesh.triangles(true).next().unwrap();
        assert_eq!(first.normals, [Vec3::Z; 3], "unit");
        let colours = first.colours.unwrap();
        assert_eq!(colours, [Srgb8([0, 20, 255]), Srgb8([10, 20, 255]), Srgb8([20, 20, 255])]);
    }
    let mesh = read("a.obj", OBJ.as_bytes()).unwrap().mesh;
    assert!(mesh.has_normals() && !mesh.has_colours());
    let coloured = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0.5\nv 0 1 0 0 0 1\nf 1 2 3\n";
    let mesh = read("a.obj", coloured.as_bytes()).unwrap().mesh;
    let colours = mesh.triangles(false).next().unwrap().colours.unwrap();
    assert_eq!(colours, [Srgb8([255, 0, 0]), Srgb8([0, 255, 128]), Srgb8([0, 0, 255])]);
    // Shared corners are shared: the square has four, and smooth normals go across its diagonal.
    let mesh = read("a.stl", &stl_binary(b"")).unwrap().mesh;
    let [a, b] = [0, 1].map(|i| mesh.triangles(true).nth(i).unwrap().normals[0]);
    assert_eq!(a, b);
}

#[test]
fn what_is_wrong_is_said_in_one_sentence() {
    let binary = stl_binary(b"");
    let short = read("a.stl", &binary[..binary.len() - 7]).unwrap_err();
    assert!(short.contains("found 177 bytes instead of 184"), "{short}");
    let cut = read("a.ply", &ply_binary(false)[..400]).unwrap_err();
    assert!(cut.contains("too soon") || cut.contains("a file of"), "{cut}");
    let text = String::from_utf8(ply_ascii()).unwrap();
    let huge = text.replace("vertex 4", "vertex 4000000000");
    let huge = read("a.ply", huge.as_bytes()).unwrap_err();
    assert!(huge.contains("4000000000 elements \"vertex\""), "{huge}");
    let empty = "ply\nformat ascii 1.0\nelement thing 9000000000000\nend_header\n";
    let empty = read("a.ply", empty.as_bytes()).unwrap_err();
    assert!(empty.contains("9000000000000 elements"), "{empty}");
    let mut nan = stl_binary(b"");
    nan[84 + 24..84 + 28].copy_from_slice(&f32::NAN.to_le_bytes());
    let nan = read("a.stl", &nan).unwrap_err();
    assert!(nan.contains("finite positions") && nan.contains("at corner 1"), "{nan}");
    let index = read("a.ply", text.replace("7 4 0 1 2 3", "7 4 0 1 2 9").as_bytes()).unwrap_err();
    assert!(index.contains("numbered below 4, found 9 in triangle 1"), "{index}");
    let line = read("a.ply", text.replace("7 4 0 1 2 3", "7 2 0 1").as_bytes()).unwrap_err();
    assert!(line.contains("three corners or more, found 2 in face 0"), "{line}");
    let flat = read("a.ply", text.replace("property double z\n", "property double w\n").as_bytes());
    assert!(flat.unwrap_err().contains("x, y and z"), "a place is missing");
    assert!(read("a.obj", b"v 0 0 0\n").unwrap_err().contains("at least one triangle"));
    let far = read("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n").unwrap_err();
    assert!(far.contains("an OBJ file that can be read"), "{far}");
    assert!(read("a.obj", b"").unwrap_err().contains("an empty file"));
    assert!(read("a.txt", b"hello").unwrap_err().contains("STL, PLY or OBJ"));
    let line = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n";
    let opened = read("a.obj", line.as_bytes()).unwrap();
    assert_eq!(opened.warnings, ["1 of 2 triangles have no area and are not drawn"]);
    let doubled = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nf 3 2 4\nf 2 1 3\n";
    let opened = read("a.obj", doubled.as_bytes()).unwrap();
    let said = "2 of 3 triangles lie exactly on others and are left out";
    assert_eq!((opened.mesh.len(), &opened.warnings[..]), (1, &[said.to_owned()][..]));
}

#[test]
fn memory_and_cancelling_are_heeded() {
    let (_folder, path) = saved("a.stl", &stl_binary(b""));
    let refused = open(&path, Some(100), &Ticket::new()).unwrap_err().to_string();
    assert!(refused.contains("a mesh to fit in memory"), "{refused}");
    let ticket = Ticket::new();
    ticket.cancel();
    for (name, bytes) in
        [("a.stl", stl_binary(b"")), ("a.ply", ply_ascii()), ("a.obj", OBJ.as_bytes().to_vec())]
    {
        let (_folder, path) = saved(name, &bytes);
        assert!(open(&path, None, &ticket).unwrap_err().is_cancelled(), "{name}");
    }
}

/// A mesh as binary STL.
fn written(corners: &[[f32; 3]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((corners.len() as u32 / 3).to_le_bytes());
    for t in corners.chunks_exact(3) {
        bytes.extend([0; 12]);
        bytes.extend(t.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// What is written is read, whatever the triangles.
    #[test]
    fn triangles_go_round(corners in prop::collection::vec([-1e6f32..1e6, -1e6f32..1e6, -1e6f32..1e6], 3..60)) {
        let whole = corners.len() / 3 * 3;
        let mesh = read("a.stl", &written(&corners[..whole])).expect("a mesh").mesh;
        let found: Vec<Vec3> = soup(&mesh).concat();
        prop_assert_eq!(found, corners[..whole].iter().map(|c| Vec3::from(*c)).collect::<Vec<_>>());
    }

    /// Damaged files are read or refused in a sentence, and never anything else.
    #[test]
    fn damage_is_never_more_than_an_error(which in 0_usize..6, at in 0.0_f64..1.0, byte: u8, cut: bool) {
        let all = [stl_ascii(), stl_binary(b""), ply_ascii(), ply_binary(false), ply_binary(true), OBJ.into()];
        let name = ["a.stl", "a.stl", "a.ply", "a.ply", "a.ply", "a.obj"][which];
        let mut bytes = all[which].clone();
        let at = (at * bytes.len() as f64) as usize;
        if cut { bytes.truncate(at) } else { bytes[at] = byte }
        // The sentence is checked there.
        drop(read(name, &bytes));
    }
}

/// Two squares side by side, a number at each point, one a cell and a vector at each point; the first is of two triangles.
const SURFACE: &str = "# vtk DataFile Version 3.0\nsurface\nASCII\nDATASET POLYDATA\nPOINTS 7 float\n\
    0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0 9 9 9\nPOLYGONS 3 13\n3 0 1 4\n3 0 4 3\n4 1 2 5 4\n\
    CELL_DATA 3\nSCALARS load float 1\nLOOKUP_TABLE default\n10 20 30\n\
    POINT_DATA 7\nSCALARS heat float 1\nLOOKUP_TABLE default\n0 1 2 3 4 5 nan\n\
    VECTORS wind float\n3 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n";

fn surface(name: &str, bytes: &[u8], field: Option<&str>) -> (Option<Mesh>, Vec<String>) {
    let (_folder, path) = saved(name, bytes);
    let ticket = Ticket::new();
    let opened = voxsplat::io::open(&path, &OpenOptions::default(), &ticket).expect("a file");
    let field = opened.grid.field(field).expect("a field");
    let drawn = (field, Component::usual(field.components));
    let told = &opened.warnings;
    let surface = surface_of(&path, &opened.grid, drawn, told, &ticket).expect("a surface");
    let more = surface.iter().flat_map(|surface| surface.warnings.clone());
    (
        surface.as_ref().map(|surface| surface.mesh.clone()),
        told.iter().cloned().chain(more).collect(),
    )
}

fn array<'a>(mesh: &'a Mesh, name: &str) -> &'a MeshValues {
    &mesh.arrays().iter().find(|array| array.name == name).expect("an array").values
}

#[test]
fn files_of_polygons_alone_are_surfaces_with_their_numbers_on_them() {
    let (mesh, said) = surface("a.vtk", SURFACE.as_bytes(), Some("heat"));
    let mesh = mesh.expect("a surface");
    assert_eq!((mesh.len(), said), (4, Vec::new()));
    // The point that no cell has lies nowhere far away.
    assert_eq!(mesh.bounds()[1].to_array(), [2.0, 1.0, 0.0]);
    assert_eq!(mesh.arrays()[0].name, "heat");
    let MeshValues::Corners(heat) = array(&mesh, "heat") else { panic!("on points") };
    assert_eq!(heat[..6], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    // Both triangles of the square have its number.
    assert_eq!(*array(&mesh, "load"), MeshValues::Triangles(vec![10.0, 20.0, 30.0, 30.0]));
    let MeshValues::Corners(wind) = array(&mesh, "wind (magnitude)") else { panic!("on points") };
    assert_eq!(wind[..2], [5.0, 0.0]);
    // How it is lit comes last, and is how it is lit.
    let normals = SURFACE
        .replace("VECTORS wind", "NORMALS Normals")
        .replace("CELL_DATA 3\nSCALARS load float 1\nLOOKUP_TABLE default\n10 20 30\n", "");
    let normals = normals.replacen("POINT_DATA 7\n", "POINT_DATA 7\nVECTORS wind float\n", 1);
    let normals =
        normals.replacen("wind float\n", &format!("wind float\n{}\n", "1 ".repeat(21)), 1);
    let (mesh, _) = surface("a.vtk", normals.as_bytes(), None);
    let mesh = mesh.expect("a surface");
    assert!(mesh.has_normals());
    let names: Vec<&str> = mesh.arrays().iter().map(|array| &*array.name).collect();
    assert_eq!(names, ["heat", "wind (magnitude)", "Normals (magnitude)"]);
    let smooth = mesh.triangles(true).next().expect("a triangle").normals[0];
    assert!((smooth - Vec3::new(0.6, 0.8, 0.0)).length() < 1e-6, "{smooth}");
    // Without arrays it has no numbers: those of its cells, which stand in, say nothing.
    let bare = SURFACE.split("CELL_DATA").next().expect("a head");
    let (mesh, _) = surface("a.vtk", bare.as_bytes(), None);
    assert!(mesh.expect("a surface").arrays().is_empty());
}

#[test]
fn polygons_that_lie_exactly_on_others_are_left_out_and_told_of() {
    let twice =
        SURFACE.replace("POLYGONS 3 13\n3 0 1 4\n3 0 4 3", "POLYGONS 3 13\n3 0 1 4\n3 4 1 0");
    let (mesh, said) = surface("a.vtk", twice.as_bytes(), Some("heat"));
    let mesh = mesh.expect("a surface");
    assert_eq!(
        (mesh.len(), &said[..]),
        (3, &["1 of 4 triangles lie exactly on others and are left out".to_owned()][..])
    );
    assert_eq!(*array(&mesh, "load"), MeshValues::Triangles(vec![10.0, 30.0, 30.0]));
}

#[test]
fn files_of_triangles_open_by_themselves_and_those_of_points_as_points() {
    for (name, bytes) in [("a.stl", stl_ascii()), ("a.obj", OBJ.as_bytes().to_vec())] {
        let (mesh, said) = surface(name, &bytes, None);
        assert_eq!(soup(&mesh.expect("a surface")), square(), "{name}");
        assert_eq!(said, Vec::<String>::new(), "{name}");
    }
    let (mesh, _) = surface("no ending", &ply_binary(true), None);
    assert_eq!(mesh.expect("a surface").len(), 2);
    let points = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float heat\nproperty int id\n\
        end_header\n0 0 0 1 2 3 0.5 7\n1 0 0 1 2 3 1.5 8\n0 1 0 1 2 3 2.5 9\n";
    let (_folder, path) = saved("cloud.ply", points.as_bytes());
    let opened =
        voxsplat::io::open(&path, &OpenOptions::default(), &Ticket::new()).expect("points");
    let values = |name: &str| {
        let samples = &opened.grid.field(Some(name)).expect("a field").samples;
        (0..samples.len()).map(|i| samples.get(i)).collect::<Vec<_>>()
    };
    assert_eq!((values("heat"), values("id")), (vec![0.5, 1.5, 2.5], vec![7.0, 8.0, 9.0]));
    assert_eq!(opened.format.name(), "ply");
    // They are first seen in their own colours, as small bodies, which other numbers colour, too.
    assert_eq!(opened.grid.fields[0].name, "rgb");
    let (mesh, said) = surface("cloud.ply", points.as_bytes(), None);
    let mesh = mesh.expect("their bodies");
    // Balls, of an octahedron split three times.
    assert_eq!((mesh.len(), said), (3 * 512, Vec::new()));
    let colours = mesh.triangles(false).next().expect("a triangle").colours;
    assert_eq!(colours, Some([Srgb8([1, 2, 3]); 3]));
    let MeshValues::Corners(heat) = array(&mesh, "heat") else { panic!("on points") };
    assert_eq!((heat[0], heat[257], heat[258], heat.len()), (0.5, 0.5, 1.5, 3 * 258));
    // As polygons in a volume it has none.
    let refused = read("cloud.ply", points.as_bytes()).unwrap_err();
    assert!(refused.contains("at least one triangle"), "{refused}");
}

#[test]
fn polygons_have_the_colours_of_their_file_by_corner_or_by_cell() {
    let head = SURFACE.split("CELL_DATA").next().expect("a head");
    let by_cell = format!(
        "{head}CELL_DATA 3\nSCALARS load float 1\nLOOKUP_TABLE default\n1 2 3\n\
        COLOR_SCALARS paint 3\n1 0 0 0 1 0 0 0 1\n"
    );
    let (mesh, _) = surface("a.vtk", by_cell.as_bytes(), Some("paint"));
    let mesh = mesh.expect("a surface");
    let colours: Vec<_> = mesh.triangles(false).filter_map(|t| t.colours).collect();
    let [red, green, blue] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]].map(|c| [Srgb8(c); 3]);
    assert_eq!(colours, [red, green, blue, blue]);
    let by_corner =
        format!("{head}POINT_DATA 7\nCOLOR_SCALARS paint 4\n{}0 1 0 1\n", "1 0 0 1 ".repeat(6));
    let (mesh, _) = surface("a.vtk", by_corner.as_bytes(), None);
    let mesh = mesh.expect("a surface");
    assert_eq!(mesh.triangles(false).next().and_then(|t| t.colours), Some(red));
}

#[test]
fn points_that_lie_nowhere_in_a_text_of_points_are_left_out_and_told() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        property float heat\nend_header\n0 0 0 1\n1 0 0 2\nnan NaN -nan 3\n0 1 0 inf\n0 0 0 4\n";
    let (_folder, path) = saved("cloud.ply", text.as_bytes());
    let opened =
        voxsplat::io::open(&path, &OpenOptions::default(), &Ticket::new()).expect("points");
    let said = &opened.warnings;
    assert!(said.iter().any(|said| said.starts_with("1 point lies nowhere")), "{said:?}");
    assert!(
        said.iter().any(|said| said.starts_with("1 of 4 points lie where others are")),
        "{said:?}"
    );
    let heat = &opened.grid.field(Some("heat")).expect("a field").samples;
    assert!(heat.get(3).is_nan() && heat.get(4) == 4.0);
}

/// A square of two triangles, and a point beside it.
fn ply_of(places: [&str; 5], property: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n{property}\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n{}\n3 0 1 2\n3 1 3 2\n",
        places.join("\n")
    )
}

#[test]
fn what_is_nowhere_or_no_number_everywhere_is_called_by_its_own_name() {
    let open = |text: String| {
        let (_folder, path) = saved("a.ply", text.as_bytes());
        voxsplat::io::open(&path, &OpenOptions::default(), &Ticket::new()).expect("a file")
    };
    let places = ["0 0 0 nan", "1 0 0 nan", "0 1 0 nan", "1 1 0 nan", "5 5 5 nan"];
    let nothing = open(ply_of(places, "property float t\n"));
    let drawn = nothing.grid.scalar(&nothing.grid.fields[0], Component::Index(0), &Ticket::new());
    let error = drawn.expect_err("nothing is drawn").to_string();
    assert_eq!(error, "expected at least one finite value in field \"t\", found only 5 NaN");
    // No triangle lies anywhere: what is left is a point.
    let nowhere = open(ply_of(["0 0 nan", "1 0 nan", "0 1 nan", "1 1 nan", "5 5 5"], ""));
    assert_eq!(nowhere.grid.fields[0].name, "log10 density");
    let said = nowhere.warnings.join("; ");
    assert!(said.contains("2 cells with corners that lie nowhere"), "{said}");
    assert!(said.contains("its points are drawn by themselves"), "{said}");
    let field = &nowhere.grid.fields[0];
    let drawn = nowhere.grid.scalar(field, Component::Index(0), &Ticket::new());
    assert!(drawn.is_ok(), "{:?}", drawn.err());
}

#[test]
fn meshes_of_cells_have_their_arrays_on_their_outer_faces() {
    let text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n\
        0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10 10\n\
        CELL_DATA 2\nSCALARS load float 1\nLOOKUP_TABLE default\n1 2\n";
    let mesh = read("a.vtk", text.as_bytes()).expect("a surface").mesh;
    let MeshValues::Triangles(load) = array(&mesh, "load") else { panic!("on cells") };
    let count = |of: f32| load.iter().filter(|value| **value == of).count();
    assert_eq!((mesh.len(), count(1.0), count(2.0)), (6, 3, 3));
}

#[test]
fn large_surfaces_are_read_without_a_look_at_their_neighbours_and_corners_that_lie_nowhere_are_left_out()
 {
    // A strip of 12 000 triangles, whose points count; and once more with one of them nowhere.
    let count = 12_002;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         property float number\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        count - 2
    );
    for i in 0..count {
        text += &format!("{} {} 0 {i}\n", i / 2, i % 2);
    }
    for i in 0..count - 2 {
        text += &format!("3 {i} {} {}\n", i + 1, i + 2);
    }
    let (_folder, path) = saved("strip.ply", text.as_bytes());
    let opened =
        voxsplat::io::open(&path, &OpenOptions::default(), &Ticket::new()).expect("a strip");
    let field = opened.grid.field(None).expect("a field");
    let volume = opened.grid.scalar(field, Component::Index(0), &Ticket::new()).expect("values");
    assert!(volume.scattered.is_none(), "ellipsoids about its points would take long");
    let (least, most) = (volume.statistics.min, volume.statistics.max);
    assert_eq!((least, most), (0.0, f64::from(count - 1)));
    // An array of the file that counts is one all the same.
    let (mesh, _) = surface("strip.ply", text.as_bytes(), None);
    assert!(matches!(array(&mesh.expect("a surface"), "number"), MeshValues::Corners(_)));
    let mut bytes = stl_binary(b"");
    bytes[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let (mesh, said) = surface("a.stl", &bytes, None);
    assert_eq!(mesh.expect("the other triangle").len(), 1);
    assert!(said.iter().any(|said| said.starts_with("1 cell with corners")), "{said:?}");
}

/// A table of several times at a few stations.
#[test]
fn points_at_one_place_are_one_body_with_the_mean_of_their_numbers() {
    let row = |i: usize| format!("{},{},0,{i}\n", i % 4, i % 2);
    let text = "x,y,z,heat\n".to_owned() + &(0..4000).map(row).collect::<String>();
    let (mesh, _) = surface("stations.csv", text.as_bytes(), None);
    let mesh = mesh.expect("their bodies");
    assert_eq!(mesh.len(), 4 * 512);
    let MeshValues::Corners(heat) = array(&mesh, "heat") else { panic!("on points") };
    // Of four in a square no ball is wider than a twentieth of it.
    let (low, high) =
        mesh.framed_places().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at.x), high.max(at.x))
        });
    assert!((low + 0.15).abs() < 1e-6 && (high - 3.15).abs() < 1e-6, "{low} {high}");
    // 0, 4, 8 … 3996 at the first.
    assert_eq!([heat[0], heat[258], heat[3 * 258]], [1998.0, 1999.0, 2001.0]);
}

/// By their numbers; many are read without a look at their neighbours, and all count in what is known of the values.
#[test]
fn points_without_colours_are_bodies_coloured_by_their_numbers() {
    // Of many octahedra; of few balls.
    for (count, [faces, corners]) in [(5_usize, [512, 258]), (12_000, [8, 6])] {
        let row = |i: usize| format!("{},{},{},{i}\n", i / 35, i / 5 % 7, i % 5);
        let text = "x,y,z,heat\n".to_owned() + &(0..count).map(row).collect::<String>();
        let (mesh, said) = surface("cloud.csv", text.as_bytes(), None);
        let mesh = mesh.expect("their bodies");
        assert_eq!((mesh.len(), said), (faces * count, Vec::new()));
        assert_eq!(mesh.triangles(false).next().expect("a triangle").colours, None);
        let MeshValues::Corners(heat) = array(&mesh, "heat") else { panic!("on points") };
        assert_eq!((heat[corners - 1], heat[corners]), (0.0, 1.0));
        assert_eq!(heat.len(), corners * count);
        let (_folder, path) = saved("cloud.csv", text.as_bytes());
        let opened =
            voxsplat::io::open(&path, &OpenOptions::default(), &Ticket::new()).expect("points");
        let field = opened.grid.field(None).expect("a field");
        let volume =
            opened.grid.scalar(field, Component::Index(0), &Ticket::new()).expect("values");
        let scattered = volume.scattered.as_ref().expect("points");
        assert!(scattered.are_points() && scattered.count() == count);
        assert_eq!(volume.statistics.mean, (count - 1) as f64 / 2.0);
        let all = scattered.ellipsoids(&Ticket::new()).expect("not cancelled");
        assert_eq!(all.functions().len(), count);
    }
}
