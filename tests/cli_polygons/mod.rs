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
    fs::write(&mesh, "v 1 1 1\nv 9 1 1\nv 1 9 9\nf 1 2 3\n").expect("written");
    let mesh = mesh.to_str().expect("UTF-8");
    let of = |flags: &[&str]| rendered(folder.path(), flags);
    // The window has no volume to put it into.
    let output = voxsplat(&[mesh]);
    let said = errors(&output);
    assert!(output.status.code() == Some(2) && said.contains("expected a volume"), "{said}");
    let refused = of(&["--mesh", "nothing.stl"]).unwrap_err();
    assert!(refused.contains("found nothing of that name"), "{refused}");
    let refused = of(&["--mesh", mesh, "--backend", "raster"]).unwrap_err();
    assert!(refused.contains("with --mesh, found --backend raster"), "{refused}");
    let refused = of(&["--mesh", mesh, "--projection", "maximum"]).unwrap_err();
    assert!(refused.contains("--projection composite with polygons"), "{refused}");
    let refused = of(&["--mesh", mesh, "--refine", "coarse", "--budget-ms", "9"]).unwrap_err();
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
