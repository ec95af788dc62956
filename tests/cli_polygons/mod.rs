//! Polygons, streamlines and arrows on the command line.

use std::fs;
use std::path::Path;

use super::can_draw;
use crate::command_line::{errors, voxsplat};

const DEMO: &str = "demo:tornado:12";

fn rendered(folder: &Path, flags: &[&str]) -> Result<Vec<u8>, String> {
    let path = folder.join("picture.png");
    let mut all =
        vec!["render", DEMO, "--resolution", "48,36", "-o", path.to_str().expect("UTF-8")];
    all.extend(flags);
    let output = voxsplat(&all);
    match output.status.success() {
        true => Ok(fs::read(&path).expect("a picture")),
        false => Err(errors(&output)),
    }
}

#[test]
fn meshes_are_embedded_or_refused_in_a_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = folder.path().join("a mesh.obj");
    fs::write(&mesh, "v -0.8 -0.8 0\nv 0.8 -0.8 0\nv 0 0.8 0.8\nf 1 2 3\n").expect("written");
    let mesh = mesh.to_str().expect("UTF-8");
    let of = |flags: &[&str]| rendered(folder.path(), flags);
    let refused = of(&["--mesh", "nothing.stl"]).unwrap_err();
    assert!(refused.contains("found nothing of that name"), "{refused}");
    let refused = of(&["--mesh", mesh, "--backend", "raster"]).unwrap_err();
    assert!(refused.contains("with --mesh, found --backend raster"), "{refused}");
    let refused = of(&["--mesh", mesh, "--projection", "maximum"]).unwrap_err();
    assert!(refused.contains("--projection composite with polygons"), "{refused}");
    let coarse = ["--refine", "coarse", "--max-error", "0.1", "--cut-balanced"];
    let refused = of(&[&["--mesh", mesh][..], &coarse].concat()).unwrap_err();
    assert!(refused.contains("--refine full or converged with polygons"), "{refused}");
    let refused = of(&["--streamlines", "9", "--field", "speed"]).unwrap_err();
    assert!(refused.contains("expected vectors with --streamlines"), "{refused}");
    if !can_draw() {
        return;
    }
    let red = format!("{mesh},color=ff0000,opacity=0.5");
    let pictures = [
        of(&[]),
        of(&["--mesh", mesh]),
        of(&["--mesh", &red]),
        of(&["--classify", "before"]),
        of(&["--classify", "before", "--mesh", &red]),
        of(&["--vector", "velocity", "--vectors-only", "--streamlines", "9", "--no-vector-splats"]),
        of(&["--vector", "velocity", "--arrows", "4", "--no-vector-splats"]),
    ];
    let pictures: Vec<Vec<u8>> = pictures.into_iter().map(|p| p.expect("a picture")).collect();
    for (i, picture) in pictures.iter().enumerate() {
        assert!(pictures[..i].iter().all(|other| other != picture), "{i}");
    }
}

#[test]
fn polygons_that_reach_beyond_the_volume_are_in_the_first_view() {
    let folder = tempfile::tempdir().expect("a folder");
    let [mesh, picture] = ["m.obj", "m.png"].map(|name| folder.path().join(name));
    let square = "v -3 -3 0\nv 3 -3 0\nv 3 3 0\nv -3 3 0\nf 1 2 3\nf 1 3 4\n";
    fs::write(&mesh, square).expect("written");
    let [file, to] = [&mesh, &picture].map(|path| path.to_str().expect("UTF-8"));
    // The first and the last column that are lit, and how many pixels are.
    let lit = |flags: &[&str]| {
        let own = [
            "render",
            DEMO,
            "--engine",
            "native",
            "--resolution",
            "64,64",
            "--mesh",
            file,
            "--opacity",
            "0:0,1:0",
            "--shading",
            "none",
            "--camera-direction",
            "0,0,-1",
            "--camera-view-up",
            "0,1,0",
            "-o",
            to,
        ];
        let output = voxsplat(&[&own[..], flags].concat());
        assert!(output.status.success(), "{}", errors(&output));
        let drawn = image::open(&picture).expect("a picture").to_rgb8();
        let lit: Vec<u32> =
            drawn.enumerate_pixels().filter(|(_, _, p)| p.0 != [0; 3]).map(|(x, ..)| x).collect();
        (lit.iter().min().copied(), lit.iter().max().copied(), lit.len())
    };
    // The square and a margin of a twentieth.
    let (first, last, count) = lit(&[]);
    assert!(first.is_some_and(|x| (1..4).contains(&x)), "{first:?} to {last:?}");
    assert!(last.is_some_and(|x| (60..63).contains(&x)), "{first:?} to {last:?}");
    assert!(count > 3300, "{count}");
    // What is asked for is what is seen.
    let near = lit(&["--camera-focal-point", "0,0,0", "--parallel-scale", "1"]);
    assert_eq!(near, (Some(0), Some(63), 64 * 64));
}

/// A segmentation of the demo as 3D Slicer writes it, over a patient's axes: a block of 4³ of the sixth label, beside one of
/// the second.
fn segmentation(space: &str) -> Vec<u8> {
    let header = format!(
        "NRRD0004\ntype: uint8\ndimension: 3\nspace: {space}\nsizes: 12 12 12\n\
         space directions: (0.181818182,0,0) (0,0.181818182,0) (0,0,0.181818182)\nspace origin: (-1,-1,-1)\nencoding: raw\n\
         Segment0_Name:=core of the wind\nSegment0_LabelValue:=6\nSegment0_Color:=1 0 0\n\
         Segment1_Name:=still air\nSegment1_LabelValue:=2\n\n"
    );
    let label = |i: usize| match [i % 12, i / 12 % 12, i / 144].map(|at| at / 4) {
        [1, 1, 1] => 6,
        [2, 1, 1] => 2,
        _ => 0,
    };
    header.into_bytes().into_iter().chain((0..1728).map(label)).collect()
}

#[test]
fn labels_of_another_file_are_surfaces_of_their_names_and_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("labels.seg.nrrd");
    fs::write(&path, segmentation("right-anterior-superior")).expect("written");
    let labels = path.to_str().expect("UTF-8");
    let told = String::from_utf8(voxsplat(&["info", labels]).stdout).expect("UTF-8");
    assert!(
        told.contains("6 is core of the wind\n") && told.contains("2 is still air\n"),
        "{told}"
    );
    let of = |flags: &[&str]| rendered(folder.path(), flags);
    let refused = of(&["--labels", DEMO]).unwrap_err();
    assert!(refused.contains("found nothing of that name"), "{refused}");
    let measured = folder.path().join("measured.nrrd");
    let text = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 1 1\nencoding: ascii\n\n0.5 1\n";
    fs::write(&measured, text).expect("written");
    let refused = of(&["--labels", measured.to_str().expect("UTF-8")]).unwrap_err();
    assert!(refused.contains("expected labels, which are at most 255") && refused.contains("0.5"));
    let colours = folder.path().join("colours.nrrd");
    let text = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 2 1 1\nkinds: RGB-color domain domain domain\n\
                encoding: ascii\n\n1 2 3 4 5 6\n";
    fs::write(&colours, text).expect("written");
    let refused = of(&["--labels", colours.to_str().expect("UTF-8")]).unwrap_err();
    assert!(refused.contains("found 3 numbers a sample"), "{refused}");
    let refused = of(&["--labels", labels, "--backend", "raster"]).unwrap_err();
    assert!(refused.contains("with --labels, found --backend raster"), "{refused}");
    // The picture is not written over the labels, whatever they are called.
    let named = folder.path().join("labels.png");
    fs::copy(&path, &named).expect("copied");
    let named = named.to_str().expect("UTF-8");
    let said = errors(&voxsplat(&["render", DEMO, "--labels", named, "-o", named]));
    assert!(said.contains("--labels"), "{said}");
    let far = folder.path().join("far.nrrd");
    let text = String::from_utf8_lossy(&segmentation("LPS")).replace("(-1,-1,-1)", "(500,0,0)");
    fs::write(&far, text).expect("written");
    let picture = folder.path().join("far.png");
    let (far, picture) = (far.to_str().expect("UTF-8"), picture.to_str().expect("UTF-8"));
    let small = ["render", DEMO, "--resolution", "16,12", "--engine", "native", "-o", picture];
    let said = errors(&voxsplat(&[&small[..], &["--labels", far]].concat()));
    assert!(
        said.contains("these surfaces lie beside the volume") && said.contains("far.nrrd"),
        "{said}"
    );
    let said = errors(&voxsplat(&[&small[..], &["--labels", labels]].concat()));
    assert!(!said.contains("beside the volume"), "{said}");
    let hides = |opacity: &str| {
        let flags = ["--labels", labels, "--opacity", opacity];
        let said = errors(&voxsplat(&[&small[..], &flags].concat()));
        said.contains("labels or meshes lie in opaque matter, which hides them")
    };
    assert!(hides("0:1,1:1") && !hides("0:0,1:0"));
    if !can_draw() {
        return;
    }
    // Nothing of the field itself, seen along z: x to the right.
    let clear = [
        "--opacity",
        "0:0,1:0",
        "--camera-direction",
        "0,0,-1",
        "--camera-view-up",
        "0,1,0",
        "--shading",
        "none",
        "--background",
        "000000",
    ];
    let pixel = |flags: &[&str], x: u32| {
        let picture = of(&[&clear[..], flags].concat()).expect("a picture");
        let picture = image::load_from_memory(&picture).expect("a PNG").to_rgb8();
        picture.get_pixel(x, 18).0
    };
    // The middle block, and that to its right.
    let found = [24, 30].map(|x| pixel(&["--labels", labels], x));
    assert!(
        found[0][0] > 60 && found[0][1] < 5 && found[0][2] < 5,
        "red, as the file says: {found:?}"
    );
    assert!(found[1][2] > found[1][0] && found[1][2] > 60, "a colour of its own: {found:?}");
    let half = pixel(&["--labels", &format!("{labels},opacity=0.5")], 24);
    assert!(half[0] < found[0][0], "{half:?}");
}

/// Two triangles side by side with a number on each corner.
const SURFACE: &str = "# vtk DataFile Version 3.0\ns\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n\
    -1 -1 0 1 -1 0 1 1 0 -1 1 0\nPOLYGONS 2 8\n3 0 1 2\n3 0 2 3\n\
    POINT_DATA 4\nSCALARS heat float 1\nLOOKUP_TABLE default\n0 0 10 10\n";

/// Mean of the red and of the blue of pixels that are not black, in the upper and in the lower half.
fn halves(path: &Path) -> [[f64; 2]; 2] {
    let picture = image::open(path).expect("a picture").to_rgb8();
    let middle = picture.height() / 2;
    let mean = |is_upper: bool, channel: usize| {
        let own = picture.enumerate_pixels().filter(|(_, y, _)| (*y < middle) == is_upper);
        let seen: Vec<f64> = own
            .filter(|(_, _, p)| p.0 != [0; 3])
            .map(|(_, _, p)| f64::from(p.0[channel]))
            .collect();
        seen.iter().sum::<f64>() / seen.len() as f64
    };
    [true, false].map(|is_upper| [0, 2].map(|channel| mean(is_upper, channel)))
}

#[test]
fn colours_by_value_are_refused_where_no_number_is_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let to = folder.path().join("s.png");
    let said = |name: &str, text: &str, flags: &[&str]| {
        let file = folder.path().join(name);
        fs::write(&file, text).expect("written");
        let [file, to] = [&file, &to].map(|path| path.to_str().expect("UTF-8"));
        let own = ["render", file, "--engine", "native", "--resolution", "32,32", "-o", to];
        errors(&voxsplat(&[&own[..], flags].concat()))
    };
    let bare = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let refused = said("s.obj", bare, &["--colormap", "gray"]);
    assert!(
        refused.contains("numbers to colour by with --colormap, found a surface by itself"),
        "{refused}"
    );
    let head = "ply\nformat ascii 1.0\nelement vertex 2\n";
    let of = |kind: &str, name: &str| format!("property {kind} {name}\n");
    let places = ["x", "y", "z"].map(|name| of("float", name)).concat();
    let colours = ["red", "green", "blue"].map(|name| of("uchar", name)).concat();
    let cloud = format!(
        "{head}{places}{colours}{}end_header\n0 0 0 255 0 0 1\n1 1 1 0 0 255 2\n",
        of("float", "heat")
    );
    let refused = said("c.ply", &cloud, &["--field", "rgb", "--colormap", "gray"]);
    assert!(refused.contains("with --colormap, found points in their own colours"), "{refused}");
    let stops = ["--field", "heat", "--color", "0:000000,2:ffffff"];
    let refused = said("c.ply", &cloud, &stops);
    assert!(refused.contains("expected --colormap for the colours"), "{refused}");
    let opacity = said("c.ply", &cloud, &["--opacity", "0:0,1:1"]);
    assert!(opacity.contains("found points in their own colours, without opacities"), "{opacity}");
    assert_eq!(said("c.ply", &cloud, &["--field", "heat", "--colormap", "gray"]), "");
    // Colours are no vectors.
    let file = folder.path().join("c.ply");
    let file = file.to_str().expect("UTF-8");
    // From above a point lies near the lower left corner.
    let seen = (0..16).map(|i| format!("{},{}", 25 + i % 4, 30 + i / 4)).find_map(|at| {
        let seen = voxsplat(&[
            "probe",
            file,
            "--field",
            "rgb",
            "--resolution",
            "80,40",
            "--camera-direction",
            "0,0,-1",
            "--at",
            &at,
        ]);
        let said = String::from_utf8_lossy(&seen.stdout).into_owned();
        said.contains("Seen").then_some(said)
    });
    let seen = seen.expect("a body is met");
    assert!(!seen.contains("Vector") && !seen.contains("vector"), "{seen}");
}

#[test]
fn points_far_from_all_others_are_told_and_decide_neither_frame_nor_colours() {
    let folder = tempfile::tempdir().expect("a folder");
    let [table, picture] = ["t.csv", "p.png"].map(|name| folder.path().join(name));
    let [file, to] = [&table, &picture].map(|path| path.to_str().expect("UTF-8"));
    let row = |i: usize| format!("{},{},{},{}\n", i % 10, i / 10 % 10, i / 100, i % 10);
    let body: String = (0..1000).map(row).collect();
    fs::write(&table, format!("x,y,z,v\n{body}100000,0,0,5000\n")).expect("written");
    let draw = || {
        let flags = ["--resolution", "160,120", "--engine", "native", "-o", to];
        let output = voxsplat(&[&["render", file][..], &flags].concat());
        assert!(output.status.success(), "{}", errors(&output));
        let drawn = image::open(&picture).expect("a picture").to_rgb8();
        let count = |is: fn(&image::Rgb<u8>) -> bool| drawn.pixels().filter(|p| is(p)).count();
        let (blue, red) = (
            count(|p| p.0[2] > p.0[0].saturating_add(40)),
            count(|p| p.0[0] > p.0[2].saturating_add(40)),
        );
        (errors(&output), count(|p| p.0 != [0; 3]), blue, red)
    };
    let (said, seen, blue, red) = draw();
    assert!(said.contains("1 of 1001 points lies far from the others"), "{said}");
    assert!(seen > 4000, "they fill the frame: {seen} pixels");
    assert!(blue > 200 && red > 200, "the outlier is beyond their colours: {blue} {red}");
    fs::write(&table, format!("x,y,z,v\n{body}")).expect("written");
    let (said, without, ..) = draw();
    assert!(!said.contains("far from"), "{said}");
    assert_eq!(seen, without, "the frame is that of the others");
    // Two clusters far apart are framed both, and each point is too small to be seen.
    let there: String = (0..1000)
        .map(|i| format!("{},{},{},1\n", i % 10 + 100_000, i / 10 % 10, i / 100))
        .collect();
    fs::write(&table, format!("x,y,z,v\n{body}{there}")).expect("written");
    let (said, ..) = draw();
    assert!(said.contains("smaller than a pixel") && !said.contains("far from"), "{said}");
    // Those without a value are holes.
    let number = |i: usize| if i % 10 < 5 { "nan".to_owned() } else { i.to_string() };
    let holed: String = (0..1000)
        .map(|i| format!("{},{},{},{}\n", i % 10, i / 10 % 10, i / 100, number(i)))
        .collect();
    fs::write(&table, format!("x,y,z,v\n{holed}")).expect("written");
    let (said, half, ..) = draw();
    assert!(said.contains("500 of 1000 points have no value of \"v\" (NaN)"), "{said}");
    assert!(half > 1000 && half < without * 4 / 5, "{half} of {without} pixels");
}

#[test]
fn values_that_a_mesh_lacks_are_told_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, picture] = ["m.vtk", "m.png"].map(|name| folder.path().join(name));
    let [file, to] = [&file, &picture].map(|path| path.to_str().expect("UTF-8"));
    let said = |dataset: &str, values: &str| {
        let text = format!("# vtk DataFile Version 3.0\nm\nASCII\nDATASET {dataset}\n{values}\n");
        fs::write(file, text.replace("VALUES", "SCALARS t float 1\nLOOKUP_TABLE default"))
            .expect("written");
        let output =
            voxsplat(&["render", file, "-o", to, "--resolution", "16,12", "--engine", "native"]);
        assert!(output.status.success(), "{}", errors(&output));
        let notes = errors(&output);
        let found: Vec<&str> = notes.lines().filter(|line| line.contains("(NaN)")).collect();
        found.join("\n")
    };
    let tetrahedra = "UNSTRUCTURED_GRID\nPOINTS 5 float\n0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 2 10\n4 0 1 2 3\n\
        4 1 2 3 4\nCELL_TYPES 2\n10 10\n";
    assert_eq!(
        said(tetrahedra, "POINT_DATA 5\nVALUES\n1 2 3 4 nan"),
        "voxsplat: note: 1 of 5 points has no value of \"t\" (NaN): what lies about it is not drawn"
    );
    assert_eq!(
        said(tetrahedra, "CELL_DATA 2\nVALUES\n1 nan"),
        "voxsplat: note: 1 of 2 cells has no value of \"t\" (NaN) and is not drawn"
    );
    assert_eq!(said(tetrahedra, "CELL_DATA 2\nVALUES\n1 2"), "");
    let square = "POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\nPOLYGONS 1 5\n4 0 1 2 3\n";
    assert_eq!(
        said(square, "POINT_DATA 4\nVALUES\n1 nan nan 4"),
        "voxsplat: note: 2 of 4 points have no value of \"t\" (NaN): the surface has a plain colour at them"
    );
}

#[test]
fn cells_without_volume_are_drawn_as_polygons_or_as_points() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, picture] = ["f.vtk", "f.png"].map(|name| folder.path().join(name));
    let [file, to] = [&file, &picture].map(|path| path.to_str().expect("UTF-8"));
    let render = |input: &str, more: &[&str]| {
        let fixed = ["render", input, "-o", to, "--resolution", "48,36", "--engine", "native"];
        voxsplat(&[&fixed[..], more].concat())
    };
    let with = |layer: &str| {
        let text = format!(
            "# vtk DataFile Version 3.0\nf\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n{layer}{layer}CELLS 1 9\n\
             8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\nPOINT_DATA 8\nSCALARS t float 1\nLOOKUP_TABLE default\n\
             0 1 2 3 4 5 6 7\n"
        );
        fs::write(file, text).expect("written");
        errors(&render(file, &[]))
    };
    let seen = || {
        let seen = image::open(&picture).expect("a picture").to_rgb8();
        seen.pixels().filter(|p| p.0 != [0; 3]).count()
    };
    let flat = with("0 0 0 1 0 0 1 1 0 0 1 0\n");
    assert!(flat.contains("1 cell has no volume, and no other has"), "{flat}");
    assert!(seen() > 100, "{flat}");
    let line = with("0 0 0 1 0 0 1 0 0 0 0 0\n");
    assert!(line.contains("its points are drawn by themselves"), "{line}");
    assert!(seen() > 10, "{line}");
}

#[test]
fn a_surface_by_itself_is_drawn_in_the_colours_of_its_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let [file, picture] = ["s.vtk", "s.png"].map(|name| folder.path().join(name));
    fs::write(&file, SURFACE).expect("written");
    let [file, to] = [&file, &picture].map(|path| path.to_str().expect("UTF-8"));
    let draw = |flags: &[&str]| {
        let own = ["--camera-direction", "0,0,-1", "--camera-view-up", "0,1,0", "-o", to];
        let all =
            [&["render", file, "--engine", "native", "--resolution", "64,64"][..], &own, flags];
        let output = voxsplat(&all.concat());
        match output.status.success() {
            true => Ok(halves(&picture)),
            false => Err(errors(&output)),
        }
    };
    // Inferno runs from black over red to a yellow with little blue.
    let [above, below] = draw(&["--colormap", "inferno"]).expect("drawn");
    assert!(above[0] > below[0] + 30.0, "{above:?} {below:?}");
    let turned = draw(&["--colormap", "inferno", "--color-range", "10,0"]).expect("drawn");
    assert!(turned[1][0] > turned[0][0] + 30.0, "{turned:?}");
    // Cut, half of it is left.
    draw(&["--clip-plane", "0,0,0,0,1,0"]).expect("cut");
    let lit = |image: &image::RgbImage| image.pixels().filter(|p| p.0 != [0; 3]).count();
    let cut = lit(&image::open(&picture).expect("a picture").to_rgb8());
    draw(&[]).expect("drawn");
    let whole = lit(&image::open(&picture).expect("a picture").to_rgb8());
    assert!(whole > 200 && (whole / 2).abs_diff(cut) < whole / 20, "{cut} of {whole}");
    let refused = draw(&["--slice", "x=50%"]).expect_err("it has no values between");
    assert!(refused.contains("expected a field that is drawn with slices"), "{refused}");
    let refused = draw(&["--iso", "5"]).expect_err("it has no levels");
    assert!(
        refused.contains("expected a field that is drawn with isosurfaces")
            && refused.contains("--kernel ellipsoids"),
        "{refused}"
    );
    let refused = draw(&["--opacity", "0:0,10:1"]).expect_err("it has no opacities by value");
    assert!(refused.contains("with --opacity, found a surface by itself"), "{refused}");
    draw(&["--iso", "5", "--kernel", "ellipsoids"]).expect("points have them");
    // Its points where they are asked for.
    let points = draw(&["--kernel", "ellipsoids"]).expect("drawn");
    assert_ne!(points, draw(&[]).expect("drawn"));
    let nowhere = errors(&voxsplat(&["probe", file, "--point", "0,0,0"]));
    assert!(nowhere.contains("expected a field of values with --point"), "{nowhere}");
    let seen = voxsplat(&["probe", file, "--at", "320,200", "--resolution", "640,400"]);
    let said = String::from_utf8_lossy(&seen.stdout);
    assert!(said.contains("polygon"), "{said} {}", errors(&seen));
    // In its middle, where numbers are between those of the corners.
    let value: f64 = said
        .lines()
        .find_map(|line| line.strip_prefix("Value"))
        .and_then(|value| value.trim().parse().ok())
        .expect("a value");
    assert!((value - 5.0).abs() < 0.1 && !said.contains("Index"), "{said}");
    // Embedded in another file it takes its colours from an array that is named.
    let by = format!("{file},by=heat,map=gray,range=0:20");
    let output = voxsplat(&["render", DEMO, "--engine", "native", "--mesh", &by, "-o", to]);
    assert!(output.status.success(), "{}", errors(&output));
    let refused = |what: &str| {
        let mesh = format!("{file},{what}");
        errors(&voxsplat(&["render", DEMO, "--engine", "native", "--mesh", &mesh, "-o", to]))
    };
    let comma = folder.path().join("comma.vtk");
    fs::write(&comma, SURFACE.replace("SCALARS heat", "SCALARS heat,K")).expect("written");
    let by = format!("{},by=\"heat,K\",opacity=0.5", comma.display());
    let output = voxsplat(&["render", DEMO, "--engine", "native", "--mesh", &by, "-o", to]);
    assert!(output.status.success(), "{}", errors(&output));
    let said = refused("by=");
    assert!(said.contains("expected the name of an array after by=, found none"), "{said}");
    let said = refused("by=cold");
    assert!(said.contains("found cold") && said.contains("the file has heat"), "{said}");
    assert!(refused("map=gray").contains("expected by=ARRAY"), "{}", refused("map=gray"));
    let said = refused("by=field,range=0:1");
    assert!(said.contains("expected by=field without map= and range="), "{said}");
}

#[test]
fn a_mesh_in_the_fields_colours_has_those_of_its_transfer_function() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plane.obj");
    fs::write(&path, "v -2 -2 0\nv 4 -2 0\nv -2 4 0\nf 1 2 3\n").expect("written");
    let picture = folder.path().join("plane.png");
    let draw = |by: &str| {
        let mesh = format!("{}{by}", path.display());
        let to = picture.to_str().expect("UTF-8");
        let scene = ["render", "demo:shells:16", "--engine", "native", "--mesh", &mesh, "-o", to];
        let look =
            ["--opacity", "0:0", "--color", "0:ff0000,255:00ff00", "--resolution", "160,120"];
        let output = voxsplat(&[&scene[..], &look].concat());
        assert!(output.status.success(), "{}", errors(&output));
        image::open(&picture).expect("a picture").to_rgb8()
    };
    // Red and green have no blue, and grey has as much as of the others.
    let is_coloured = |p: &image::Rgb<u8>| {
        let [red, green, blue] = p.0.map(u32::from);
        red.max(green) > 40 && 3 * blue < red.max(green)
    };
    let count = |image: &image::RgbImage| image.pixels().filter(|p| is_coloured(p)).count();
    let (plain, coloured) = (draw(""), draw(",by=field"));
    assert_eq!(count(&plain), 0);
    // The box is some 500 of the pixels.
    assert!(count(&coloured) > 100, "{}", count(&coloured));
    // Beside the field it is as it was.
    let same = plain.pixels().zip(coloured.pixels()).filter(|(a, b)| a == b && a.0 != [0; 3]);
    assert!(same.count() > 100);
}
