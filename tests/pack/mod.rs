//! The scalar files of the data pack, as the program opens them: at `VOXSPLAT_DATA`, by default `../shared/data` beside this
//! package.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, open};
use voxsplat::scene::{self, SampleSource, Scene};
use voxsplat::volume::Component;

fn root() -> PathBuf {
    std::env::var_os("VOXSPLAT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    )
}

/// Grids of three dimensions of no more than so many samples, each by its name; nothing, said in a line, where there is no pack.
/// Of files that are the same volume in another format the first stands for all.
pub(crate) fn scans(most_samples: u64) -> Vec<(String, Scene)> {
    let Ok(text) = std::fs::read_to_string(root().join("manifest.json")) else {
        println!("skipped all files of the data pack: no manifest at {}", root().display());
        return Vec::new();
    };
    let manifest: Value = serde_json::from_str(&text).expect("the manifest is JSON");
    let (mut found, mut left_out, mut seen) = (Vec::new(), 0, Vec::new());
    for entry in manifest["datasets"].as_array().expect("a list") {
        let path = entry["path"].as_str().unwrap_or_default();
        let dims = entry["dims"].as_array().map_or(&[][..], Vec::as_slice);
        let dims: Vec<u64> = dims.iter().filter_map(Value::as_u64).collect();
        let is_grid = matches!(entry["kind"].as_str(), Some("grid" | "rectilinear"));
        if !is_grid || dims.len() != 3 || dims.iter().any(|&n| n < 8) || path.contains("malformed")
        {
            continue;
        }
        let folder = Path::new(path).parent().map(Path::to_path_buf);
        if seen.contains(&(folder.clone(), dims.clone())) {
            continue;
        }
        if dims.iter().product::<u64>() > most_samples {
            left_out += 1;
            continue;
        }
        match first_look(path) {
            Ok(scene) => {
                seen.push((folder, dims));
                found.push((path.to_owned(), scene));
            }
            Err(reason) => println!("skipped {path}: {reason}"),
        }
    }
    if left_out > 0 {
        println!("skipped {left_out} files of more than {most_samples} samples");
    }
    found
}

/// What is first seen of the first field of a file, as the window and `render` open it.
fn first_look(path: &str) -> Result<Scene, String> {
    let opened = open(&root().join(path), &OpenOptions::default(), &Ticket::new());
    let grid = opened.map_err(|_| "it does not open".to_owned())?.grid;
    let field = grid.field(None).map_err(|error| error.to_string())?;
    let component = Component::usual(field.components);
    let volume = grid.scalar(field, component, &Ticket::new());
    let volume = volume.map_err(|error| error.to_string())?;
    let source = SampleSource::component(Path::new(path), &field.name, component);
    Ok(scene::first_look(source, Arc::new(volume), grid.space.as_deref()))
}
