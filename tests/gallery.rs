//! Every scalar file of the data pack, opened cold: what is seen of it first is a picture that one could show.
//!
//! The pack lies at `VOXSPLAT_DATA` (default `../shared/data` beside this package). Drawn by the native engine, small.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde_json::Value;
use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, open};
use voxsplat::rbf::Basis;
use voxsplat::scene::{self, SampleSource, Scene, SplatSettings};
use voxsplat::task::encode::{Asked, Wanted, encode_field};
use voxsplat::task::engine::{Engine, EngineChoice};
use voxsplat::task::still::{Refine, Still, StillRequest};
use voxsplat::volume::{Component, Grid, demo};

const SIDE: u32 = 160;
/// Opacity from which a pixel counts as one of the object's.
const SEEN: f32 = 0.05;
/// Least part of the frame's side that the object spans, one way or the other. (Measured: 0.86, of RectGrid2, and
/// more.)
const LEAST_SPAN: f64 = 0.8;
/// Least part of the frame that it covers. (Measured: 0.089, of a rod seen from the front, and more.)
const LEAST_SHARE: f64 = 0.05;
/// Most of it that may be white, or black.
const MOST_BLOWN: f64 = 0.5;

fn data_root() -> PathBuf {
    std::env::var_os("VOXSPLAT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    )
}

/// The volumes of three dimensions in the manifest that are no damaged ones.
fn volumes() -> Vec<PathBuf> {
    let root = data_root();
    let Ok(text) = std::fs::read_to_string(root.join("manifest.json")) else {
        println!("skipped the whole gallery: no manifest at {}", root.display());
        return Vec::new();
    };
    let manifest: Value = serde_json::from_str(&text).expect("the manifest is JSON");
    let is_one = |entry: &&Value| {
        let path = entry["path"].as_str().unwrap_or_default();
        let dims = entry["dims"].as_array().map_or(&[][..], Vec::as_slice);
        let kind = entry["kind"].as_str().unwrap_or_default();
        let is_grid = ["grid", "rectilinear", "curvilinear", "stack", "dicom-series"]
            .contains(&kind)
            && dims.len() == 3
            && dims.iter().all(|n| n.as_u64() >= Some(8));
        // Meshes of a hundred cells or more.
        let is_mesh = kind == "unstructured"
            && entry["n_cells"].as_u64() >= Some(100)
            && entry["total_volume_all_3d_cells"].as_f64().is_some_and(|v| v.abs() > 1e-9)
            && entry["arrays"].as_array().is_some_and(|arrays| !arrays.is_empty());
        !path.contains("malformed") && (is_grid || is_mesh || kind == "points")
    };
    let entries = manifest["datasets"].as_array().unwrap();
    let paths = entries.iter().filter(is_one).filter_map(|entry| entry["path"].as_str());
    paths.map(PathBuf::from).collect()
}

/// What is first seen of the first field of a grid, as the window and `render` open it.
fn first_look(grid: &Grid, name: &Path) -> Result<Scene, String> {
    let field = grid.field(None).map_err(|error| error.to_string())?;
    let component = Component::usual(field.components);
    let volume =
        grid.scalar(field, component, &Ticket::new()).map_err(|error| error.to_string())?;
    let source = SampleSource::component(name, &field.name, component);
    Ok(scene::first_look(source, Arc::new(volume), grid.space.as_deref()))
}

fn drawn(engine: &Engine, scene: &Scene) -> Still {
    let size = [SIDE; 2];
    let scene = scene.clone();
    let request = StillRequest {
        scene,
        size,
        refine: Refine::Full,
        repeat: 0,
        time_passes: false,
        smooth_edges: false,
    };
    engine.still(request, &Ticket::new()).unwrap()
}

/// What is wrong with a first picture.
fn faults(still: &Still) -> Vec<String> {
    let side = SIDE as usize;
    let object: Vec<usize> = (0..side * side).filter(|&i| still.light[i][3] > SEEN).collect();
    let share = object.len() as f64 / (side * side) as f64;
    let span = |of: &dyn Fn(usize) -> usize| {
        let (least, most) = object
            .iter()
            .fold((side, 0), |(least, most), &i| (least.min(of(i)), most.max(of(i) + 1)));
        most.saturating_sub(least) as f64 / side as f64
    };
    let spans = [span(&|i| i % side), span(&|i| i / side)];
    let bytes = |i: usize| &still.rgba[4 * i..4 * i + 3];
    let part = |is_so: &dyn Fn(&[u8]) -> bool| {
        object.iter().filter(|&&i| is_so(bytes(i))).count() as f64 / object.len().max(1) as f64
    };
    let white = part(&|rgb| rgb.iter().all(|&byte| byte >= 250));
    let black = part(&|rgb| rgb.iter().all(|&byte| byte <= 16));
    println!("{share:.3} of the frame, spans {spans:.2?}, white {white:.2}, black {black:.2}");
    let mut found = Vec::new();
    if share < LEAST_SHARE {
        found.push(format!("empty: it covers {:.1} % of the frame", 100.0 * share));
    }
    if spans[0].max(spans[1]) < LEAST_SPAN {
        found.push(format!("small: it spans {spans:.2?} of the frame"));
    }
    if white > MOST_BLOWN {
        found.push(format!("saturated: {:.0} % of it is white", 100.0 * white));
    }
    if black > MOST_BLOWN {
        found.push(format!("dark: {:.0} % of it is black", 100.0 * black));
    }
    found
}

#[test]
fn every_scalar_file_opened_cold_fills_the_frame_and_is_neither_blown_nor_black() {
    let engine = Engine::start(EngineChoice::Native, || ());
    let root = data_root();
    let (mut wrong, mut looked_at) = (Vec::new(), 0);
    for path in volumes() {
        // What no reader opens yet is another test's matter.
        let Ok(opened) = open(&root.join(&path), &OpenOptions::default(), &Ticket::new()) else {
            continue;
        };
        let scene = match first_look(&opened.grid, &path) {
            Ok(scene) => scene,
            Err(reason) => {
                println!("skipped {}: {reason}", path.display());
                continue;
            }
        };
        looked_at += 1;
        let still = drawn(&engine, &scene);
        print!("{}: ", path.display());
        wrong
            .extend(faults(&still).into_iter().map(|fault| format!("{}: {fault}", path.display())));
    }
    println!("{looked_at} files");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(looked_at > 25 || !root.join("manifest.json").exists(), "{looked_at}");
}

#[test]
fn the_gallerys_own_test_finds_what_is_wrong() {
    let engine = Engine::start(EngineChoice::Native, || ());
    let grid = demo::open("blobs:24", None).unwrap();
    let scene = first_look(&grid, Path::new("demo:blobs")).unwrap();
    assert_eq!(faults(&drawn(&engine, &scene)), [""; 0]);
    let mut far = scene.clone();
    far.camera.parallel_scale *= 3.0;
    let small = faults(&drawn(&engine, &far));
    assert!(
        small.iter().any(|fault| fault.starts_with("small")),
        "a third of the frame: {small:?}"
    );
    let mut aside = scene.clone();
    aside.camera.focal_point += aside.camera.up * 50.0;
    assert!(faults(&drawn(&engine, &aside))[0].starts_with("empty"), "beside the frame");
    let all_white = [0.0, 1.0].map(|value| (value, voxsplat::core::Srgb8([255; 3])));
    let mut white = Scene { shading: Default::default(), ..scene };
    let transfer = white.transfer_mut().unwrap();
    transfer.opacity = vec![(0.0, 0.9), (1.0, 0.9)];
    transfer.colour = voxsplat::transfer::ColourSource::Stops(all_white.to_vec());
    assert!(faults(&drawn(&engine, &white)).iter().any(|fault| fault.starts_with("saturated")));
}

/// Whatever way round a file's axes run, who is in it stands upright and is seen from the front.
#[test]
fn patients_of_the_pack_stand_upright_and_are_seen_from_the_front() {
    let root = data_root();
    for (name, ahead, up) in [
        // MetaImage, AnatomicalOrientation RPS: stored from the feet backwards.
        ("scalar/LIDC2.mha", DVec3::Y, DVec3::Z),
        // NRRD, left-posterior-superior.
        ("scalar/brain_mr/brain1_image.nrrd", DVec3::Y, DVec3::Z),
        // The same as LIDC2.mha in a file that says nothing: the scanner's table does. It opened upside down, seen through the
        // table.
        ("scalar/LIDC2.vti", DVec3::NEG_Y, DVec3::NEG_Z),
    ] {
        let Ok(opened) = open(&root.join(name), &OpenOptions::default(), &Ticket::new()) else {
            println!("skipped {name}: not there");
            continue;
        };
        let camera = first_look(&opened.grid, Path::new(name)).unwrap().camera;
        assert!((camera.direction - ahead).length() < 1e-9, "{name}: {}", camera.direction);
        assert!((camera.up - up).length() < 1e-9, "{name}: {}", camera.up);
    }
    // A tree in a pot, whose file says nothing, stands on the pot: it lay on its side. A vase stands on its base. What has no heavy end stays as it was.
    for (name, up) in [
        ("scalar/bonsai.vti", DVec3::Y),
        ("scalar/aneurism.vti", DVec3::Z),
        ("scalar/vase.vti", DVec3::Y),
        ("scalar/headmr/HeadMRVolume.mhd", DVec3::Z),
        ("scalar/hydrogen.vti", DVec3::Z),
    ] {
        let Ok(opened) = open(&root.join(name), &OpenOptions::default(), &Ticket::new()) else {
            println!("skipped {name}: not there");
            continue;
        };
        let camera = first_look(&opened.grid, Path::new(name)).unwrap().camera;
        assert!(camera.up.dot(up) > 0.5, "{name}: {}", camera.up);
    }
    // A left-handed space, stacked downwards: it stood on its head.
    let name = "scalar/headsq/quarter.nhdr";
    if let Ok(opened) = open(&root.join(name), &OpenOptions::default(), &Ticket::new()) {
        let camera = first_look(&opened.grid, Path::new(name)).unwrap().camera;
        assert!(camera.up.z < -0.5, "{}", camera.up);
    }
}

/// Letters in this scan, R and L, reach through all of its slices: they hid the head behind white bars.
#[test]
fn marks_burned_into_a_scan_of_the_pack_hide_nothing_of_it() {
    let root = data_root();
    for name in
        ["avg152T1_LR_nifti.nii.gz", "avg152T1_LR_nifti2.nii.gz", "avg152T1_RL_nifti.nii.gz"]
    {
        let path = root.join("scalar").join(name);
        let Ok(opened) = open(&path, &OpenOptions::default(), &Ticket::new()) else {
            println!("skipped {name}: not there");
            continue;
        };
        let scene = first_look(&opened.grid, Path::new(name)).unwrap();
        let transfer = scene.transfer().unwrap();
        assert_eq!(transfer.opacity_at(255.0), 0.0, "{name}");
        assert!(transfer.opacity_at(150.0) > 0.01, "{name}: {transfer:?}");
    }
}

/// A slice by itself is a picture: all of it is seen, from its darkest to its brightest.
#[test]
fn slices_by_themselves_are_seen_whole() {
    let root = data_root();
    for name in [
        "formats/dicom/CT_small.dcm",
        "formats/dicom/MR_small.dcm",
        "formats/metaimage/foot.mha",
        "formats/nrrd/NrrdSample.igs.nrrd",
        "formats/tiff/minisblack-1c-16b.tiff",
    ] {
        let Ok(opened) = open(&root.join(name), &OpenOptions::default(), &Ticket::new()) else {
            println!("skipped {name}: not there");
            continue;
        };
        let scene = first_look(&opened.grid, Path::new(name)).unwrap();
        let statistics = &scene.volume().unwrap().statistics;
        let transfer = scene.transfer().unwrap();
        let [low, high] = [0.005, 0.995].map(|share| statistics.quantile(share));
        assert!([low, high].iter().all(|value| transfer.opacity_at(*value) == 1.0), "{name}");
        let [dark, bright] = [low, high].map(|value| transfer.colour.srgb_at(value).0[1]);
        assert!(dark < 30 && bright > 225, "{name}: {dark} to {bright}");
    }
}

/// The kinds of the pack, as a person would name them, and what follows.
#[test]
fn files_of_the_pack_are_lit_and_drawn_by_their_kind() {
    let root = data_root();
    let slabs = |slabs_per_voxel| SplatSettings { slabs_per_voxel, ..SplatSettings::EXACT };
    // (file, lit, mode)
    for (name, is_lit, splat) in [
        ("scalar/headsq/quarter.nhdr", true, slabs(2.0)),
        ("scalar/aneurism.vti", true, SplatSettings::EXACT),
        ("scalar/headmr/HeadMRVolume.mhd", true, slabs(4.0)),
        // Slices of 6.5 mm over pixels of 0.78.
        ("scalar/brain_mr/brain1_image.nrrd", true, SplatSettings::SMOOTH),
        ("scalar/brain_mr/brain1_label.nrrd", true, SplatSettings::NAMES),
        // Computed, and rounded to 8 bits, whose steps would be seen in its light.
        (
            "scalar/ironProt.vtk",
            true,
            SplatSettings { slabs_per_voxel: 2.0, ..SplatSettings::SMOOTH },
        ),
        // Orbitals, and noise.
        ("scalar/hydrogen.vti", false, SplatSettings::EXACT),
        ("formats/nrrd/small.nrrd", false, SplatSettings::EXACT),
        ("vector/RectGrid2.vtk", false, SplatSettings::EXACT),
        ("formats/vtk-xml/chombo3d_1.vti", true, slabs(4.0)),
    ] {
        let Ok(opened) = open(&root.join(name), &OpenOptions::default(), &Ticket::new()) else {
            println!("skipped {name}: not there");
            continue;
        };
        let scene = first_look(&opened.grid, Path::new(name)).unwrap();
        assert_eq!(scene.shading.lighting.is_some(), is_lit, "{name}");
        assert_eq!(scene.splat, splat, "{name}");
    }
}

/// Held at the points of this mesh alone, the sum went 1.85 beyond their range of 1.29 in its cells, and little else was seen of it.
#[test]
fn an_encoded_mesh_of_the_pack_stays_near_its_range_between_its_points() {
    let name = "unstructured/post.vtk";
    let Ok(opened) = open(&data_root().join(name), &OpenOptions::default(), &Ticket::new()) else {
        println!("skipped {name}: not there");
        return;
    };
    let asked = Asked {
        basis: Basis::Ellipsoid,
        max_error: Some(Wanted::Percent(2.0)),
        mean_error: None,
        bytes: None,
        functions: 114,
        favour: None,
    };
    let what = (&opened.grid, &opened.grid.fields[0], Component::Index(0));
    let told = |_| ControlFlow::Continue(());
    let encoded = encode_field(what, name, asked, None, &Ticket::new(), told).unwrap();
    println!("measured: {} beyond, greatest error {}", encoded.overshoot, encoded.errors.max);
    assert!(encoded.overshoot < 0.4 && encoded.errors.max < 0.3, "{}", encoded.overshoot);
}
