//! Who may import whom (ARCHITECTURE.md): every path in `src/` is held to the tables below, tests
//! included.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs;
use std::path::Path;

/// A room, and the rooms it may import.
const ROOMS: [(&str, &[&str]); 19] = [
    ("core", &[]),
    ("polygons", &["core"]),
    ("rbf", &["core"]),
    ("cells", &["core"]),
    ("volume", &["core", "rbf", "cells"]),
    ("transfer", &["core", "volume"]),
    ("kernel", &["core", "cells", "volume", "transfer", "rbf"]),
    ("hierarchy", &["core", "volume", "transfer"]),
    ("vector", &["core", "volume", "transfer", "kernel", "polygons"]),
    ("scene", &["core", "volume", "transfer", "kernel", "hierarchy", "vector", "polygons", "rbf"]),
    // Truth shares no shortcut with what it judges: neither the GPU nor the hierarchy.
    (
        "reference",
        &["core", "cells", "volume", "transfer", "kernel", "vector", "polygons", "scene", "rbf"],
    ),
    ("io", &["core", "volume", "polygons", "rbf", "cells"]),
    ("plan", &["core", "volume", "transfer", "kernel", "vector", "polygons", "scene"]),
    (
        "gpu",
        &[
            "core",
            "volume",
            "transfer",
            "kernel",
            "hierarchy",
            "vector",
            "polygons",
            "scene",
            "plan",
            "rbf",
            "cells",
        ],
    ),
    // The other engine, which knows nothing of that one.
    (
        "native",
        &[
            "core", "polygons", "volume", "transfer", "kernel", "vector", "scene", "plan", "rbf",
            "cells",
        ],
    ),
    (
        "accuracy",
        &["core", "volume", "transfer", "kernel", "hierarchy", "scene", "reference", "io", "gpu"],
    ),
    (
        "task",
        &[
            "core",
            "volume",
            "transfer",
            "kernel",
            "hierarchy",
            "vector",
            "polygons",
            "scene",
            "plan",
            "reference",
            "io",
            "gpu",
            "native",
            "accuracy",
            "rbf",
        ],
    ),
    // The window and the command line see the engine through `task`, and not each other.
    (
        "app",
        &[
            "core", "volume", "transfer", "kernel", "vector", "polygons", "scene", "io", "rbf",
            "accuracy", "task",
        ],
    ),
    (
        "cli",
        &[
            "core", "volume", "transfer", "kernel", "vector", "polygons", "scene", "plan", "io",
            "accuracy", "task", "rbf",
        ],
    ),
];

/// Names from outside, and the only rooms that may say them.
const OUTSIDE: [(&str, &[&str]); 23] = [
    ("earcut", &["core"]),
    ("memmap2", &["core"]),
    ("nalgebra", &["rbf"]),
    ("rstar", &["rbf"]),
    ("fearless_simd", &["native"]),
    ("wgpu", &["gpu"]),
    ("egui", &["app"]),
    ("eframe", &["app"]),
    ("egui_winit", &["app"]),
    ("softbuffer", &["app"]),
    ("ron", &["app"]),
    ("rfd", &["app"]),
    ("clap", &["cli"]),
    ("plotters", &["cli"]),
    // Words in pictures, without a window.
    ("ab_glyph", &["task"]),
    ("epaint_default_fonts", &["app", "task", "cli"]),
    // One constant: pipes are opened without waiting.
    ("libc", &["task"]),
    ("image", &["io", "task", "app", "cli"]),
    ("std::fs", &["io", "task", "app", "cli"]),
    // Layers of a scene are named after files, which it never opens.
    ("std::path", &["scene", "io", "task", "app", "cli"]),
    ("std::process", &["cli"]),
    ("std::net", &[]),
    ("std::env", &["app", "cli"]),
];

/// The one bridge between the engine's pictures and the screen: it paints them with a pipeline of
/// its own, and so may say `wgpu`, and import the shaders of `gpu` but nothing else of it.
const BRIDGE: &str = "app/painting.rs";

/// All of `vector` that `reference` may import: what people choose, and the sizes that a mark's look is defined
/// by. Its tests hold the rest to it, in files of their own.
const VECTOR_SETTINGS: [&str; 10] = [
    "ColourBy",
    "Design",
    "Foreshortening",
    "VectorMode",
    "VectorSettings",
    "FORESHORTENINGS",
    "MARK_COLUMNS",
    "MARK_SIDE",
    "PHASES",
    "WINDOW",
];

/// Words that put pixels on the screen, and the only files that may say them.
const TEXTURE_WORDS: [&str; 5] =
    ["ColorImage", "TextureHandle", "TextureOptions", "TextureId", "load_texture"];
const TEXTURE_FILES: [&str; 4] = [
    // The squares behind pictures without a background, and lines over them.
    "app/viewport.rs",
    // A grey slice of a file's bytes, which never was a picture of the engine.
    "app/dialogs/raw.rs",
    // Who paints egui's textures where no adapter does.
    "app/software/canvas.rs",
    "app/software/triangle.rs",
];

/// Macros at the crate's root, and the room each belongs to.
const ROOT_MACROS: [(&str, &str); 1] = [("with_samples", "volume")];

/// Where something stands that should not.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Violation {
    file: String,
    line: usize,
    what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "src/{}:{}: {}", self.file, self.line, self.what)
    }
}

/// A word, `::`, or one other character, and its line.
type Token = (usize, String);

/// The tokens of Rust source, without comments, strings, characters and lifetimes.
fn tokens(source: &str) -> Vec<Token> {
    let bytes: Vec<char> = source.chars().collect();
    let (mut tokens, mut at, mut line) = (Vec::new(), 0, 1);
    let starts = |at: usize, text: &str| {
        text.chars().enumerate().all(|(i, c)| bytes.get(at + i) == Some(&c))
    };
    while at < bytes.len() {
        let begin = at;
        let c = bytes[at];
        if starts(at, "//") {
            at += bytes[at..].iter().take_while(|&&c| c != '\n').count();
        } else if starts(at, "/*") {
            let mut depth = 0;
            loop {
                if starts(at, "/*") {
                    (depth, at) = (depth + 1, at + 2);
                } else if starts(at, "*/") {
                    (depth, at) = (depth - 1, at + 2);
                } else {
                    at += 1;
                }
                if depth == 0 || at >= bytes.len() {
                    break;
                }
            }
        } else if let Some(end) = string_end(&bytes, at) {
            at = end;
        } else if c == '\'' {
            // A lifetime unless a quote closes it.
            let is_char = bytes.get(at + 1) == Some(&'\\') || bytes.get(at + 2) == Some(&'\'');
            at += 1;
            if is_char {
                at += if bytes[at] == '\\' { 2 } else { 1 };
                at += bytes[at..].iter().take_while(|&&c| c != '\'').count() + 1;
            }
        } else if c.is_alphanumeric() || c == '_' {
            at += bytes[at..].iter().take_while(|c| c.is_alphanumeric() || **c == '_').count();
            tokens.push((line, bytes[begin..at].iter().collect()));
        } else if starts(at, "::") {
            tokens.push((line, "::".to_owned()));
            at += 2;
        } else {
            if !c.is_whitespace() {
                tokens.push((line, c.to_string()));
            }
            at += 1;
        }
        line += bytes[begin..at.min(bytes.len())].iter().filter(|&&c| c == '\n').count();
    }
    tokens
}

/// Where the string literal that begins at `at` ends, if one does.
fn string_end(bytes: &[char], at: usize) -> Option<usize> {
    if at > 0 && (bytes[at - 1].is_alphanumeric() || bytes[at - 1] == '_') {
        return None;
    }
    let prefix = bytes[at..].iter().take_while(|c| matches!(c, 'b' | 'c' | 'r')).count().min(2);
    let raw = bytes[at..at + prefix].contains(&'r');
    let hashes =
        if raw { bytes[at + prefix..].iter().take_while(|&&c| c == '#').count() } else { 0 };
    let mut end = at + prefix + hashes;
    if bytes.get(end) != Some(&'"') {
        return None;
    }
    end += 1;
    while end < bytes.len() {
        match bytes[end] {
            '\\' if !raw => end += 2,
            '"' if bytes[end + 1..].iter().take_while(|&&c| c == '#').count() >= hashes => {
                return Some(end + 1 + hashes);
            }
            _ => end += 1,
        }
    }
    Some(end)
}

/// A path as written, the modules it stands in, and its line.
struct Written {
    line: usize,
    segments: Vec<String>,
    inline_modules: usize,
}

/// Every path of two segments or more, and every `use`, with groups multiplied out.
fn paths(tokens: &[Token]) -> Vec<Written> {
    let word = |at: usize| tokens.get(at).map_or("", |t| t.1.as_str());
    let is_name = |text: &str| text.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let mut found = Vec::new();
    // For each open brace, whether it is a module's.
    let mut braces: Vec<bool> = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        match word(at) {
            "{" => braces.push(at >= 2 && word(at - 2) == "mod"),
            "}" => {
                braces.pop();
            }
            text if is_name(text) => {
                let after_use = at > 0 && matches!(word(at - 1), "use" | "crate" | "extern");
                let inline_modules = braces.iter().filter(|&&is_module| is_module).count();
                let mut leaves = Vec::new();
                let end = tree(tokens, at, &mut Vec::new(), &mut leaves);
                found.extend(
                    leaves
                        .into_iter()
                        .filter(|(_, segments)| segments.len() > 1 || after_use)
                        .map(|(line, segments)| Written { line, segments, inline_modules }),
                );
                at = end;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// Reads a path or a use tree from `at`; where it ends.
fn tree(
    tokens: &[Token],
    mut at: usize,
    before: &mut Vec<String>,
    leaves: &mut Vec<(usize, Vec<String>)>,
) -> usize {
    let word = |at: usize| tokens.get(at).map_or("", |t| t.1.as_str());
    let (depth, line) = (before.len(), tokens[at].0);
    loop {
        before.push(word(at).to_owned());
        at += 1;
        if word(at) != "::" || matches!(word(at + 1), "<" | "*" | "(" | "" | "$") {
            break;
        }
        at += 1;
        if word(at) == "{" {
            at += 1;
            while at < tokens.len() && word(at) != "}" {
                if matches!(word(at), "," | "*") {
                    at += 1;
                    continue;
                }
                at = tree(tokens, at, before, leaves);
                if word(at) == "as" {
                    at += 2;
                }
            }
            before.truncate(depth);
            return at + 1;
        }
    }
    leaves.push((line, before.clone()));
    before.truncate(depth);
    at
}

/// What a file of a room breaks. `file` is relative to `src/`.
fn violations(file: &str, source: &str) -> Vec<Violation> {
    let room = file.split(['/', '.']).next().unwrap_or_default();
    let allowed = ROOMS.iter().find(|(name, _)| *name == room).map(|(_, allowed)| *allowed);
    // The crate's root is no room: lib.rs names all, main.rs hands one to the other.
    let Some(allowed) = allowed else { return Vec::new() };
    let tokens = tokens(source);
    let mut found = BTreeSet::new();
    let mut report = |line: usize, what: String| {
        found.insert(Violation { file: file.to_owned(), line, what });
    };
    // `super`s from the file's own module to the crate's root.
    let steps = file.split('/').count() - usize::from(file.ends_with("/mod.rs"));
    for Written { line, segments, inline_modules } in paths(&tokens) {
        let supers = segments.iter().take_while(|s| *s == "super").count();
        let from_root = match segments[0].as_str() {
            "crate" | "voxsplat" => 1,
            "super" if supers >= steps + inline_modules => supers,
            _ => 0,
        };
        if from_root > 0 {
            let Some(target) = segments.get(from_root) else { continue };
            let target = ROOT_MACROS
                .iter()
                .find(|(name, _)| name == target)
                .map_or(target.as_str(), |(_, owner)| owner);
            let of_bridge = file == BRIDGE
                && target == "gpu"
                && segments.get(from_root + 1).is_some_and(|part| part == "shader");
            if target != room && !allowed.contains(&target) && !of_bridge {
                report(line, format!("{room} may not import {target}"));
            }
            let name = segments.get(from_root + 1).map_or("*", String::as_str);
            if room == "reference"
                && target == "vector"
                && !file.ends_with("_tests.rs")
                && !VECTOR_SETTINGS.contains(&name)
            {
                report(line, format!("{room} may not import {target}::{name}"));
            }
            continue;
        }
        // Re-exports count as what they are: `eframe::egui` is egui.
        for start in 0..segments.len() {
            for (outside, rooms) in OUTSIDE {
                let same = outside.split("::").eq(segments[start..]
                    .iter()
                    .take(outside.split("::").count())
                    .map(String::as_str));
                // Modules of ours may bear any name; crates come first or behind a re-export.
                let is_crate = start == 0 || segments[0] == "eframe";
                let of_bridge = file == BRIDGE && outside == "wgpu";
                if same && is_crate && !rooms.contains(&room) && !of_bridge {
                    report(line, format!("{room} may not name {outside}"));
                }
            }
        }
    }
    if !TEXTURE_FILES.contains(&file) {
        for (line, word) in &tokens {
            if TEXTURE_WORDS.contains(&word.as_str()) {
                report(*line, format!("{word} belongs to {}", TEXTURE_FILES[0]));
            }
        }
    }
    found.into_iter().collect()
}

/// Every `.rs` file under `folder`: its path relative to `root`, with `/`.
fn sources(root: &Path, folder: &Path, found: &mut Vec<String>) {
    let entries = fs::read_dir(folder).unwrap();
    let mut entries: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(root, &path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let relative = path.strip_prefix(root).unwrap();
            let parts: Vec<_> = relative.iter().map(|part| part.to_str().unwrap()).collect();
            found.push(parts.join("/"));
        }
    }
}

fn all_sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &root, &mut files);
    let read = |file: String| {
        let source = fs::read_to_string(root.join(&file)).unwrap();
        (file, source)
    };
    files.into_iter().map(read).collect()
}

#[test]
fn every_import_is_allowed() {
    let found: Vec<String> = all_sources()
        .iter()
        .flat_map(|(file, source)| violations(file, source))
        .map(|violation| violation.to_string())
        .collect();
    assert!(found.is_empty(), "{} imports break the rules:\n{}", found.len(), found.join("\n"));
}

#[test]
fn every_room_is_in_the_table_and_the_table_has_no_cycle() {
    let present: BTreeSet<String> = all_sources()
        .iter()
        .filter_map(|(file, _)| file.split_once('/').map(|(room, _)| room.to_owned()))
        .collect();
    let listed: BTreeSet<String> = ROOMS.iter().map(|(room, _)| (*room).to_owned()).collect();
    assert_eq!(present, listed);
    for (index, (room, allowed)) in ROOMS.iter().enumerate() {
        for other in *allowed {
            let before = ROOMS[..index].iter().any(|(earlier, _)| earlier == other);
            assert!(before, "{room} may import {other}, which does not come before it");
        }
    }
}

/// Which modules of a room name which others of it, from its files below its `mod.rs`.
fn imports_within(room: &str, files: &[(String, String)]) -> BTreeMap<String, BTreeSet<String>> {
    let own: Vec<(Vec<&str>, &str)> = files
        .iter()
        .filter_map(|(file, source)| {
            let path = file.strip_suffix("/mod.rs").or_else(|| file.strip_suffix(".rs"))?;
            let path: Vec<&str> = path.split('/').collect();
            (path[0] == room && path.len() > 1).then_some((path, source.as_str()))
        })
        .collect();
    let mut found: BTreeMap<String, BTreeSet<String>> =
        own.iter().map(|(path, _)| (path[1].to_owned(), BTreeSet::new())).collect();
    let modules: BTreeSet<String> = found.keys().cloned().collect();
    for (path, source) in own {
        for Written { segments, inline_modules, .. } in paths(&tokens(source)) {
            let supers = segments.iter().take_while(|s| *s == "super").count();
            let named: Vec<&str> = match segments[0].as_str() {
                "crate" => segments[1..].iter().map(String::as_str).collect(),
                "super" if supers > inline_modules => {
                    let above = path.len().saturating_sub(supers - inline_modules);
                    let rest = segments[supers..].iter().map(String::as_str);
                    path[..above].iter().copied().chain(rest).collect()
                }
                _ => continue,
            };
            if let [of, module, ..] = named[..]
                && of == room
                && module != path[1]
                && modules.contains(module)
            {
                found.entry(path[1].to_owned()).or_default().insert(module.to_owned());
            }
        }
    }
    found
}

/// Modules that import each other, each by way of the next; empty where none do.
fn circle(imports: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut left = imports.clone();
    // Those that import nothing that is left are in no circle.
    while let Some(free) = left.iter().find(|(_, of)| !of.iter().any(|o| left.contains_key(o))) {
        let free = free.0.clone();
        left.remove(&free);
    }
    let mut way: Vec<String> = left.keys().next().cloned().into_iter().collect();
    while let Some(next) = way.last().and_then(|at| left[at].iter().find(|o| left.contains_key(*o)))
    {
        if let Some(begin) = way.iter().position(|at| at == next) {
            return way.split_off(begin);
        }
        way.push(next.clone());
    }
    Vec::new()
}

#[test]
fn no_modules_of_the_engines_import_each_other_in_a_circle() {
    let files = all_sources();
    for room in ["gpu", "plan"] {
        let imports = imports_within(room, &files);
        assert!(!imports.is_empty(), "{room} has no files");
        assert_eq!(circle(&imports), [""; 0], "{room}");
    }
}

#[test]
fn circles_of_imports_are_found() {
    let of = |files: &[(&str, &str)]| {
        let files: Vec<_> = files.iter().map(|(f, s)| ((*f).to_owned(), (*s).to_owned())).collect();
        circle(&imports_within("gpu", &files))
    };
    let chain =
        [("gpu/a.rs", "use super::b::B;"), ("gpu/b.rs", "use crate::gpu::c;"), ("gpu/c.rs", "")];
    assert_eq!(of(&chain), [""; 0]);
    let [a, b, _] = chain;
    assert_eq!(of(&[a, b, ("gpu/c.rs", "fn f() { super::a::go(); }")]), ["a", "b", "c"]);
    // Children are of their parent, and groups and other rooms are seen through.
    let child = ("gpu/b/x.rs", "use super::super::{GpuError, a::A};");
    assert_eq!(of(&[a, ("gpu/b/mod.rs", ""), child]), ["a", "b"]);
    let tests = ("gpu/b.rs", "mod tests { use super::super::a::A; use super::*; }");
    assert_eq!(of(&[a, tests]), ["a", "b"]);
    assert_eq!(of(&[a, ("gpu/b.rs", "use crate::core::a; use super::GpuError;")]), [""; 0]);
}

/// `./test` runs no code of documentation: there is none, but for text.
#[test]
fn documentation_has_no_code_to_run() {
    let fences = |source: &str| -> Vec<String> {
        let comments = source.lines().map(str::trim_start).filter(|line| line.starts_with("//"));
        let fences = comments.filter_map(|line| line.split_once("```"));
        fences.map(|(_, kind)| kind.trim().to_owned()).collect()
    };
    let opens_code = |source: &str| fences(source).chunks(2).any(|pair| pair[0] != "text");
    for (file, source) in all_sources() {
        assert!(!opens_code(&source), "src/{file}: code in documentation is not run by ./test");
    }
    assert!(opens_code("/// ```\n/// let a = 1;\n/// ```\n"));
    assert!(opens_code("//! ```rust\n//! ```\n"));
    assert!(!opens_code("/// ```text\n/// a b\n/// ```\n"));
}

/// Each use of rayon's iterators is compiled as some sixty functions: `core::parallel` shares work out in few.
#[test]
fn work_is_shared_out_in_one_place() {
    for (file, source) in all_sources() {
        for name in ["rayon::prelude", "rayon::iter", "ParallelIterator"] {
            assert!(!source.contains(name), "src/{file} names {name}: see core::parallel");
        }
    }
}

/// Most loops of the native engine that are compiled for each instruction set: each takes its time to compile, and its bytes.
const MOST_LOOPS: usize = 24;

/// How many loops a source has compiled, or that they are too many.
fn compiled_loops(source: &str) -> Result<usize, String> {
    let count = source.lines().filter(|line| line.starts_with("compiled!(")).count();
    if count > MOST_LOOPS {
        return Err(format!("{count} loops are compiled, and {MOST_LOOPS} may be"));
    }
    Ok(count)
}

#[test]
fn the_native_engine_has_few_loops_compiled_and_in_one_file() {
    let mut found = 0;
    for (file, source) in all_sources() {
        let here = compiled_loops(&source).unwrap_or_else(|error| panic!("src/{file}: {error}"));
        assert!(here == 0 || file == "native/loops.rs", "src/{file} has {here} loops of its own");
        found += here;
    }
    // Where they are written otherwise, none are counted.
    assert!(found > 10, "{found}");
}

#[test]
fn a_loop_too_many_is_found_and_words_about_loops_are_none() {
    let of = |count: usize| {
        let one = "compiled!(wide a(scene: &Scene<'_>) => |simd, tile, out| {\n    draw()\n});\n";
        let about = "// compiled!(in a comment)\n        compiled!(@module in its own macro)\n";
        compiled_loops(&(about.to_owned() + &one.repeat(count)))
    };
    assert_eq!((of(0), of(MOST_LOOPS)), (Ok(0), Ok(MOST_LOOPS)));
    assert!(of(25).is_err_and(|error| error.starts_with("25 loops")));
}

#[test]
fn every_room_says_what_it_owns_and_what_it_refuses() {
    for (file, source) in all_sources() {
        if file.ends_with("/mod.rs") && file.matches('/').count() == 1 {
            let words: String = source.lines().take_while(|l| l.starts_with("//!")).collect();
            for needed in ["Owns ", "Refuses "] {
                let said = words.contains(needed);
                assert!(said, "src/{file} does not say what the room {needed}");
            }
        }
    }
}

/// What the scanner says of a made-up file, without the file's name.
fn judged(file: &str, source: &str) -> Vec<String> {
    violations(file, source).into_iter().map(|v| format!("{}: {}", v.line, v.what)).collect()
}

#[test]
fn forbidden_imports_are_caught_however_they_are_written() {
    let refused = |file: &str, source: &str, expected: &str| {
        assert_eq!(judged(file, source), [expected], "{file}: {source}");
    };
    refused("core/x.rs", "\nuse crate::volume::Grid;", "2: core may not import volume");
    refused("volume/x.rs", "use crate::{core, io::open};", "1: volume may not import io");
    refused("gpu/x.rs", "use crate::{core::{self, Camera},\n app};", "2: gpu may not import app");
    refused("reference/x.rs", "fn f() { crate::gpu::go(); }", "1: reference may not import gpu");
    refused("reference/mod.rs", "use super::gpu;", "1: reference may not import gpu");
    refused(
        "reference/x.rs",
        "use crate::vector::{Design, Marks};",
        "1: reference may not import vector::Marks",
    );
    refused("reference/x.rs", "use crate::vector::*;", "1: reference may not import vector::*");
    refused("io/vti/xml.rs", "use super::super::super::gpu;", "1: io may not import gpu");
    refused(
        "hierarchy/x.rs",
        "#[cfg(test)] mod tests { use super::super::super::scene; }",
        "1: hierarchy may not import scene",
    );
    refused("cli/x.rs", "impl crate::app::Window {}", "1: cli may not import app");
    refused("io/x.rs", "type T = Vec<crate::task::Job>;", "1: io may not import task");
    refused("gpu/x.rs", "use std::path::Path;", "1: gpu may not name std::path");
    refused("gpu/x.rs", "use std::{io, fs::File};", "1: gpu may not name std::fs");
    refused("gpu/x.rs", "use egui as e;", "1: gpu may not name egui");
    refused("task/x.rs", "fn f(c: &eframe::Frame) {}", "1: task may not name eframe");
    refused("app/x.rs", "#[derive(clap::Args)] struct A;", "1: app may not name clap");
    refused("task/x.rs", "let d: ::wgpu::Device;", "1: task may not name wgpu");
    refused("core/x.rs", "crate::with_samples!(s, v => v)", "1: core may not import volume");
    refused(
        "app/panels/view.rs",
        "fn f(c: &Context) { c.load_texture(); }",
        "1: load_texture belongs to app/viewport.rs",
    );
    refused("app/painting.rs", "use crate::gpu::Renderer;", "1: app may not import gpu");
    refused("app/viewport.rs", "use wgpu::Texture;", "1: app may not name wgpu");
    let cast = "use eframe::{egui, wgpu};";
    assert_eq!(judged("app/x.rs", cast), ["1: app may not name wgpu"]);
}

#[test]
fn words_in_comments_and_strings_and_allowed_imports_pass() {
    for (file, source) in [
        (
            "core/x.rs",
            "// use crate::gpu;\n/* /* crate::io::x */ crate::gpu::y */ //! clap::Parser",
        ),
        (
            "core/x.rs",
            r###"const A: &str = "crate::gpu::x \" crate::io"; const B: &str = r#"clap::"#;"###,
        ),
        ("core/x.rs", "fn f<'a>(c: &'a str) -> bool { c == '\"' || '\\'' == 'x' } // \""),
        ("gpu/x.rs", "use super::super::core; use super::context; use crate::gpu::frame;"),
        ("gpu/x.rs", "mod tests { use super::*; fn f() { super::x(); } }"),
        ("task/x.rs", "let image = 5; image + eframe; use crate::gpu::Renderer;"),
        ("io/x.rs", "use std::{fs, path::{Path, PathBuf}}; crate::with_samples!(a, b => c);"),
        ("app/painting.rs", "use crate::gpu::shader; use wgpu::Texture;"),
        ("app/viewport.rs", "ctx.load_texture();"),
        ("reference/x.rs", "use crate::vector::{WINDOW, VectorSettings};"),
        ("reference/x_tests.rs", "use crate::vector::Marks;"),
        ("main.rs", "voxsplat::cli::run(); eframe::run_native();"),
    ] {
        assert_eq!(judged(file, source), [""; 0], "{file}: {source}");
    }
}
