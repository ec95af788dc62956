//! The command line where no graphics driver is installed: what needs none looks for none, and what needs one says which
//! package has it.

use std::path::Path;
use std::process::Output;

use super::fault;
use crate::command_line::{can_draw, errors, program};

/// Nodes of graphics processors: where there is one, `auto` has drivers asked.
const NODES: [&str; 5] = ["/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/kfd", "/dev/mali0"];
/// Names of all that draws: the loaders of Vulkan and OpenGL, and what Mesa's drivers and layers are called.
const DRIVERS: [&str; 6] = ["libvulkan", "libGL", "libEGL", "libVkLayer", "libgallium", "_dri.so"];

/// What the program does with these arguments where no driver is found. With a folder, the dynamic linker writes there
/// what it opens.
fn without_driver(arguments: &[&str], linked: Option<&Path>) -> Output {
    let mut program = program(arguments);
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "__EGL_VENDOR_LIBRARY_FILENAMES"] {
        program.env(variable, "/none");
    }
    if let Some(folder) = linked {
        program.env("LD_DEBUG", "files").env("LD_DEBUG_OUTPUT", folder.join("ld"));
    }
    program.output().expect("the program starts")
}

/// What a dynamic linker wrote of files that it was asked for, whether they are there or not.
fn asked_for(folder: &Path) -> Vec<String> {
    let logs = std::fs::read_dir(folder).expect("a folder");
    let logs = logs.map(|entry| std::fs::read_to_string(entry.expect("a log").path()));
    let logs: String = logs.map(|log| log.expect("text")).collect();
    let file = |line: &str| Some(line.split_once("file=")?.1.split([' ', ';']).next()?.to_owned());
    logs.lines().filter_map(file).collect()
}

/// Those of them that belong to a graphics driver.
fn drivers(files: &[String]) -> Vec<&String> {
    let is_driver = |file: &&String| DRIVERS.iter().any(|name| file.contains(name));
    files.iter().filter(is_driver).collect()
}

#[test]
fn headless_commands_need_and_load_no_graphics_driver() {
    let node = NODES.iter().find(|node| Path::new(node).exists());
    // Where there is a graphics processor `auto` asks for its driver; by name the native engine does not.
    let engine = match node {
        None => "auto",
        Some(node) => {
            println!("skipped `auto` without a driver: {node} is there, `native` instead");
            "native"
        }
    };
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let paths = ["p.png", "s.json", "t.json"].map(at);
    let [picture, stats, table] = paths.each_ref().map(String::as_str);
    let with = |command: &'static str| {
        vec![command, "demo:shells:8", "--resolution", "16,12", "--engine", engine]
    };
    let commands = [
        ([with("render"), vec!["--output", picture, "--stats", stats]].concat(), false),
        ([with("render"), vec!["--output", picture, "--kernel", "cubic"]].concat(), false),
        (vec!["probe", "demo:shells:8", "--resolution", "16,12", "--at", "8,6"], false),
        (vec!["info", "demo:shells:8"], false),
        // One row of its table is of triangles, for which it looks for an adapter: it needs none, and says in that row that
        // there is none.
        ([with("accuracy"), vec!["--output", table]].concat(), true),
    ];
    for (arguments, may_look) in commands {
        let logs = tempfile::tempdir().expect("a folder");
        let output = without_driver(&arguments, Some(logs.path()));
        assert!(output.status.success(), "{arguments:?}: {}", errors(&output));
        let said = errors(&output);
        assert!(said.lines().all(|line| line.starts_with("voxsplat: ")), "{arguments:?}: {said}");
        let files = asked_for(logs.path());
        // Else the linker is another one, and tells nothing.
        if !files.iter().any(|file| file.contains("libc.so")) {
            println!("skipped what is loaded by {}: the linker does not say", arguments[0]);
            continue;
        }
        let found = drivers(&files);
        assert!(may_look || found.is_empty(), "{arguments:?}: {found:?}");
    }
    let told = std::fs::read_to_string(stats).expect("statistics");
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    assert_eq!(told["engine"], "native");
    let told = std::fs::read_to_string(table).expect("a table");
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    let points = told["points"].as_array().expect("rows");
    let failed = points.iter().filter(|point| !point["failed"].is_null()).count();
    assert!(points.len() > 10 && failed <= 2, "{failed} of {} rows", points.len());
}

/// The search above finds what it looks for: who asks for an adapter has the loaders opened.
#[test]
fn what_asks_for_an_adapter_is_seen_to_load_a_driver() {
    let logs = tempfile::tempdir().expect("a folder");
    let arguments = ["render", "demo:shells:8", "--engine", "gpu", "--output", "-"];
    let output = without_driver(&arguments, Some(logs.path()));
    assert!(!output.status.success());
    let files = asked_for(logs.path());
    match files.iter().any(|file| file.contains("libc.so")) {
        true => assert!(!drivers(&files).is_empty(), "{files:?}"),
        false => println!("skipped what is loaded for an adapter: the linker does not say"),
    }
}

#[test]
fn where_there_is_no_adapter_what_needs_one_names_the_package_in_a_sentence() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("p.png");
    let name = picture.to_str().expect("UTF-8");
    let render = |more: &[&str]| {
        without_driver(&[&["render", "demo:shells:8", "--output", name], more].concat(), None)
    };
    for (more, words) in [
        (&["--kernel", "gouraud", "--engine", "native"][..], "splats as triangles"),
        (&["--backend", "raster", "--engine", "native"], "splats as triangles"),
        (&["--engine", "gpu"], "expected a graphics adapter, found none at all"),
        (&["--adapter", "software"], "expected a software adapter, found none at all"),
    ] {
        let output = render(more);
        let words = [words, "install a Vulkan driver", "mesa-vulkan-drivers"];
        assert_eq!(fault(&output, 1, &words, None), None, "{more:?}");
        assert!(!picture.exists(), "{more:?}: a picture of nothing");
    }
}

/// Vulkan's loader looks for a screen even where a picture goes to a file, and libwayland writes to stderr where nobody says in
/// which folder that might be.
#[test]
fn no_librarys_line_stands_among_the_programs_words() {
    if !can_draw("splats as triangles") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("p.png");
    let picture = picture.to_str().expect("UTF-8");
    let render = ["render", "demo:shells:8", "--resolution", "16,12", "--kernel", "gouraud"];
    let mut program = program(&[&render[..], &["--output", picture]].concat());
    let output = program.env_remove("XDG_RUNTIME_DIR").output().expect("the program starts");
    assert!(output.status.success(), "{}", errors(&output));
    let foreign = errors(&output).lines().filter(|line| !line.starts_with("voxsplat")).count();
    assert_eq!(foreign, 0, "{}", errors(&output));
}
