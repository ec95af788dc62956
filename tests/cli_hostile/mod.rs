//! The command line in careless and hostile hands: odd values, wrong names, places that take no file.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use voxsplat::task::output_file::OutputFile;

use super::command_line::{errors, program, voxsplat};
use super::{can_draw, fault, file_is_refused, written};

const DEMO: &str = "demo:shells:8";

/// What the program says to a flag's value, with exit 2.
fn refused_value(command: &str, flag: &str, value: &str) -> String {
    let output = voxsplat(&[command, DEMO, "-o", "/nowhere/out.png", flag, value]);
    assert_eq!(output.status.code(), Some(2), "{flag} {value}: {}", errors(&output));
    errors(&output)
}

#[test]
fn every_value_that_is_none_is_refused_in_plain_words() {
    let whole = "expected a whole number";
    for (command, flag, value, words) in [
        ("render", "--sheets-per-kernel", "2.5", "expected a whole number from 1 to 64, found"),
        ("render", "--sheets-per-kernel", "-1", "from 1 to 64, found \"-1\""),
        ("render", "--sheets-per-kernel", "65", "from 1 to 64, found \"65\""),
        ("render", "--component", "x", whole),
        ("render", "--component", "-1", whole),
        ("render", "--component", "99999999999999999999", whole),
        ("render", "--repeat", "-1", whole),
        ("render", "--repeat", "1e3", whole),
        ("render", "--raw-skip", "-1", "expected a whole number of at least 0, found \"-1\""),
        ("render", "--raw-skip", "18446744073709551616", whole),
        ("render", "--raw-dims", "8,8", "three whole numbers X,Y,Z such as"),
        ("render", "--raw-spacing", "1,0,1", "other than 0"),
        ("render", "--resolution", "-4,4", "two whole numbers W,H such as"),
        ("render", "--resolution", "4294967296,1", "two whole numbers W,H such as"),
        ("render", "--color-range", "1", "two numbers LO,HI, found \"1\""),
        ("render", "--camera-direction", "1,2,3,4", "X,Y,Z, found \"1,2,3,4\""),
        ("render", "--opacity", "1:", "expected a number such as 0.5, found nothing"),
        ("render", "--opacity", "1:0,,2:1", "expected VALUE:OPACITY, found nothing"),
        ("render", "--colormap", "a\nb", "found \"a\\nb\""),
        ("render", "--adapter", "", "found nothing"),
        ("render", "--slabs-per-voxel", "1e300", "found 1e300; choose"),
        ("render", "--extent", "1e300", "found 1e300; choose"),
        ("encode", "--max-error", "-1%", "or so many percent, found \"-1%\""),
        ("accuracy", "--pixels", "0", "a whole number from 1 to"),
        ("accuracy", "--pixels", "-3", "found \"-3\""),
        ("accuracy", "--seed", "x", whole),
        ("accuracy", "--repeat", "1.5", whole),
    ] {
        let said = refused_value(command, flag, value);
        assert!(said.contains(words), "{flag} {value}: {said}");
        let jargon = ["digit", "target type", "is not in", "unexpected argument", "float literal"];
        assert!(!jargon.iter().any(|word| said.contains(word)), "{flag} {value}: {said}");
    }
}

#[test]
fn a_value_of_thousands_of_digits_is_quoted_shortly() {
    let long = "9".repeat(5000);
    for flag in ["--ambient", "--opacity", "--second-look", "--gouraud-rings"] {
        let said = refused_value("render", flag, &long);
        assert!(said.contains("expected ") && said.contains(&long[..60]), "{said}");
        assert!(!said.contains(&long[..61]) && said.len() < 500, "{said}");
    }
    for (flag, value) in [
        ("--opacity", "1e300:0,1:1"),
        ("--opacity-by", "view-depth:1e300:1"),
        ("--gouraud-angles", "x"),
    ] {
        let said = refused_value("render", flag, value);
        assert!(said.contains("expected ") && !said.contains("000000"), "{said}");
    }
}

#[test]
fn a_view_without_numbers_is_refused_by_its_flag() {
    for scale in ["1e308", "1e-308"] {
        let run = voxsplat(&["render", DEMO, "-o", "-", "--parallel-scale", scale]);
        let said = errors(&run);
        assert_eq!(run.status.code(), Some(1), "{said}");
        assert!(
            said.contains("--parallel-scale") && said.contains(&format!("found {scale}")),
            "{said}"
        );
    }
}

#[test]
fn a_wrong_name_is_usage_unless_only_the_file_or_the_machine_can_tell() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("out.png");
    let name = picture.to_str().expect("UTF-8");
    let commands = |file: &'static str| {
        [
            vec!["info", file],
            vec!["render", file, "-o", name],
            vec!["accuracy", file, "-o", name],
            vec![file],
        ]
    };
    for (file, words) in [
        ("demo:nothing", &["demo:NAME:SIZE", "shells", "demo:nothing"][..]),
        ("demo:", &["demo:NAME:SIZE", "shells"]),
        ("demo:shells:1000", &["from 2 to 512", "samples along each axis", "\"1000\""]),
        ("demo:shells:8:8", &["from 2 to 512", "\"8:8\""]),
        ("-", &["standard input", "./-"]),
    ] {
        for arguments in commands(file) {
            let output = voxsplat(&arguments);
            assert_eq!(fault(&output, 2, words, None), None, "{arguments:?}");
        }
    }
    for (flag, value, words) in [
        ("--field", "nope", &["the field shell", "\"nope\"", "voxsplat info"][..]),
        ("--component", "7", &["component 0 of field \"shell\"", "component 7", "voxsplat info"]),
    ] {
        for command in ["render", "accuracy"] {
            let output = voxsplat(&[command, DEMO, "-o", name, flag, value]);
            assert_eq!(fault(&output, 1, words, Some(Path::new(DEMO))), None, "{command} {flag}");
        }
    }
    assert!(!picture.exists(), "a picture of nothing");
}

#[test]
fn an_adapter_that_is_not_there_is_refused_with_those_that_are() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (picture, stats) = (at("out.png"), at("stats.json"));
    let small = ["render", DEMO, "-o", &picture, "--resolution", "8,8"];
    let drawn = voxsplat(&[&small[..], &["--stats", &stats, "--engine", "gpu"]].concat());
    assert!(drawn.status.success(), "{}", errors(&drawn));
    let text = std::fs::read_to_string(&stats).expect("statistics");
    let found: Value = serde_json::from_str(&text).expect("JSON");
    let adapter = found["adapter"].as_str().expect("a name");
    let own_name = adapter.split(" (").next().expect("a first part");
    let refused = voxsplat(&[&small[..], &["--adapter", "bogus"]].concat());
    assert_eq!(fault(&refused, 1, &["\"bogus\"", own_name, "name one of these"], None), None);
    assert!(!errors(&refused).contains("mesa"), "there is a driver: {}", errors(&refused));
}

#[test]
fn lights_beside_none_are_refused_and_a_flag_of_slices_without_any_is_told() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("out.png").to_str().expect("UTF-8").to_owned();
    let small = ["render", DEMO, "-o", &picture, "--resolution", "8,8"];
    let both = voxsplat(&[&small[..], &["--shading", "none", "--light", "1,1,1"]].concat());
    assert_eq!(fault(&both, 2, &["--shading none", "found --light"], None), None);
    let without = voxsplat(&[&small[..], &["--slice-only-shown"]].concat());
    assert!(without.status.success());
    assert!(
        errors(&without).contains("--slice-only-shown changes nothing"),
        "{}",
        errors(&without)
    );
}

#[test]
fn help_and_refusals_tell_what_can_be_asked_for() {
    let help = |command: &[&str]| {
        let output = voxsplat(&[command, &["--help"]].concat());
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    for command in [&[][..], &["render"], &["info"], &["accuracy"]] {
        let text = help(command);
        for words in ["demo:NAME:SIZE", "2 to 512", "Exit codes: 0 success", "2 wrong usage"] {
            assert!(text.contains(words), "{command:?} has no {words}: {text}");
        }
    }
    let render = help(&["render"]);
    for words in ["tan(angle / 2)", "an EXR has none", "as an EXR always does"] {
        assert!(render.contains(words), "{words}: {render}");
    }
    let accuracy = help(&["accuracy"]);
    for words in
        ["Scene: these flags hold for every picture", "measured first", "The\nrest does not"]
    {
        assert!(accuracy.contains(words), "{words}: {accuracy}");
    }
    assert!(voxsplat(&["render", "-V"]).status.success());
}

#[test]
fn places_that_no_file_can_be_in_are_called_what_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = written(folder.path(), "file.txt", b"x");
    let inside = file.join("x.png");
    let deeper = file.join("a/x.png");
    let mut places = vec![
        (inside.as_path(), "file.txt is a file"),
        (deeper.as_path(), "file.txt is a file"),
        (Path::new("/no\nwhere/x.png"), "none of that name"),
    ];
    if cfg!(target_os = "linux") {
        places.push((Path::new("/proc/x.png"), "takes no new files"));
    }
    for (place, words) in places {
        let name = place.to_str().expect("UTF-8");
        let output = voxsplat(&["render", DEMO, "-o", name]);
        let ends = name.replace('\n', "\\n");
        assert_eq!(fault(&output, 1, &[words], Some(Path::new(&ends))), None);
    }
}

#[test]
fn a_raw_file_of_another_size_is_held_to_what_was_said_of_it_and_to_no_header() {
    let folder = tempfile::tempdir().expect("a folder");
    let named = written(folder.path(), "x_8x8x10_uint8.raw", &[7; 600]);
    file_is_refused(&named, &["640 bytes for 8 × 8 × 10 samples of uint8", "600", "--raw-dims"]);
    let plain = written(folder.path(), "x.raw", &[7; 600]);
    let info = |more: &[&str]| {
        let name = plain.to_str().expect("UTF-8");
        let output = voxsplat(&[&["info", name, "--raw-type", "uint16"], more].concat());
        assert!(!errors(&output).contains("header"), "{}", errors(&output));
        output
    };
    let skipped = info(&["--raw-dims", "8,8,4", "--raw-skip", "100"]);
    let words = ["512 bytes after 100 others", "a file of 600 bytes", "--raw-skip"];
    assert_eq!(fault(&skipped, 1, &words, Some(&plain)), None);
    let huge = info(&["--raw-dims", "100000000,100000000,100000000"]);
    assert_eq!(fault(&huge, 1, &["2⁶⁴"], Some(&plain)), None);
    assert!(info(&["--raw-dims", "8,8,4"]).status.success());
}

#[test]
fn the_parallel_scale_counts_in_perspective_too() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let drawn = |scale: &str| {
        let path = folder.path().join(format!("{scale}.exr"));
        let name = path.to_str().expect("UTF-8");
        let run = voxsplat(&[
            "render",
            DEMO,
            "-o",
            name,
            "--resolution",
            "16,16",
            "--camera-view-angle",
            "30",
            "--parallel-scale",
            scale,
        ]);
        assert!(run.status.success(), "{}", errors(&run));
        let light = image::open(&path).expect("an EXR").into_rgba32f();
        light.pixels().filter(|pixel| pixel[3] > 0.0).count()
    };
    let (near, far) = (drawn("0.5"), drawn("4"));
    assert!(near > 4 * far && far > 0, "{near} pixels from near, {far} from far");
}

#[test]
fn statistics_go_to_stdout_alone_and_never_beside_the_picture() {
    let both = voxsplat(&["render", DEMO, "-o", "-", "--stats", "-"]);
    assert_eq!(fault(&both, 2, &["--output and --stats"], Some(Path::new("-"))), None);
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("out.png");
    let name = picture.to_str().expect("UTF-8");
    let run = voxsplat(&["render", DEMO, "-o", name, "--resolution", "8,8", "--stats", "-"]);
    assert!(run.status.success(), "{}", errors(&run));
    let stats: Value = serde_json::from_slice(&run.stdout).expect("JSON and nothing else");
    assert_eq!(stats["resolution"], serde_json::json!([8, 8]));
    assert!(!Path::new("-").exists());
}

#[cfg(unix)]
#[test]
fn a_pipe_without_a_reader_is_refused_at_once_and_one_with_a_reader_is_written_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.png");
    let made = Command::new("mkfifo").arg(&pipe).status().expect("mkfifo");
    assert!(made.success());
    let name = pipe.to_str().expect("UTF-8");
    let render = ["render", DEMO, "-o", name, "--resolution", "8,8"];
    let start = |arguments: &[&str]| {
        let mut command = program(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().expect("the program starts")
    };
    let mut child = start(&render);
    let begin = Instant::now();
    while child.try_wait().expect("ours").is_none() {
        if begin.elapsed() > Duration::from_secs(20) {
            child.kill().expect("ours");
            panic!("it waits for a reader");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let refused = child.wait_with_output().expect("ours");
    assert_eq!(fault(&refused, 1, &["found nobody", "start the reader first"], Some(&pipe)), None);
    let from = voxsplat(&["info", name]);
    assert_eq!(fault(&from, 1, &["a pipe or device"], Some(&pipe)), None);

    if !can_draw() {
        return;
    }
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read(pipe).expect("what is written")
    });
    // A reader that is not there yet is no reader.
    let begin = Instant::now();
    while !start(&render).wait().expect("ours").success() {
        assert!(begin.elapsed() < Duration::from_secs(20), "never written to");
    }
    let picture = reader.join().expect("it reads");
    assert_eq!(image::load_from_memory(&picture).expect("a PNG").width(), 8);
    assert_eq!(std::fs::read_dir(folder.path()).expect("ours").count(), 1, "the pipe alone");
}

#[cfg(unix)]
#[test]
fn a_full_pipe_is_waited_for_and_one_whose_reader_leaves_is_no_failure() {
    let folder = tempfile::tempdir().expect("ours");
    let pipe = folder.path().join("pipe.png");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let error = OutputFile::check(&pipe, "the picture").expect_err("nobody reads");
    assert!(error.contains("found nobody") && error.contains("the reader first"), "{error}");
    assert!(error.ends_with("/pipe.png"), "{error}");

    // More than a pipe holds, so that the writer has to wait.
    let bytes: Vec<u8> = (0..1_000_000_u32).map(|i| (i % 251) as u8).collect();
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || std::fs::read(pipe).expect("ours")
    });
    let file = loop {
        // Until the reader has opened it.
        if let Ok(file) = OutputFile::check(&pipe, "the picture") {
            break file;
        }
        std::thread::yield_now();
    };
    file.write(&bytes).expect("ours");
    drop(file);
    assert!(reader.join().expect("it reads") == bytes, "all of it arrived");

    // A reader that leaves is no failure.
    let leaves = pipe.clone();
    let reader = std::thread::spawn(move || drop(std::fs::File::open(leaves).expect("ours")));
    let file = loop {
        if let Ok(file) = OutputFile::check(&pipe, "the picture") {
            break file;
        }
        std::thread::yield_now();
    };
    reader.join().expect("it reads");
    assert_eq!(file.write(&bytes), Ok(()));
}

#[test]
fn what_is_given_twice_or_to_itself_changes_nothing() {
    let twice =
        voxsplat(&["render", DEMO, "-o", "a.png", "--kernel", "cubic", "--kernel", "cubic"]);
    assert_eq!(twice.status.code(), Some(2));
    assert!(errors(&twice).contains("multiple times"), "{}", errors(&twice));
    let folder = tempfile::tempdir().expect("a folder");
    let raw = written(folder.path(), "x_8x8x8_uint8.png", &[7; 512]);
    let name = raw.to_str().expect("UTF-8");
    let over = voxsplat(&["render", name, "-o", name]);
    assert_eq!(fault(&over, 2, &["FILE and --output"], Some(&raw)), None);
    assert_eq!(std::fs::read(&raw).expect("it is there"), [7; 512]);
    for flag in ["--opacity", "--output", "--field"] {
        let empty = voxsplat(&["render", DEMO, "-o", "a.png", flag]);
        assert_eq!(empty.status.code(), Some(2), "{}", errors(&empty));
    }
}

/// The device that takes nothing.
#[cfg(target_os = "linux")]
fn full() -> std::fs::File {
    std::fs::File::options().write(true).open("/dev/full").expect("a device of every Linux")
}

#[cfg(target_os = "linux")]
#[test]
fn where_nothing_can_be_written_there_is_an_exit_code_all_the_same() {
    for arguments in [&["info", DEMO][..], &["info", DEMO, "--json"]] {
        let run = program(arguments).stdout(full()).output().expect("the program starts");
        assert_eq!(fault(&run, 1, &["standard output", "refuses"], None), None, "{arguments:?}");
    }
    for asked in ["--help", "--version"] {
        let run = program(&[asked]).stdout(full()).output().expect("the program starts");
        assert_eq!(
            fault(&run, 1, &["the help", "standard output", "refuses"], None),
            None,
            "{asked}"
        );
    }
    for (arguments, code) in [(&["info", "missing.nrrd"][..], 1), (&["info", "demo:nothing"], 2)] {
        let run = program(arguments).stderr(full()).output().expect("the program starts");
        assert_eq!(run.status.code(), Some(code), "{arguments:?}");
    }
    if can_draw() {
        let picture = ["render", DEMO, "-o", "-", "--resolution", "8,8"];
        let run = program(&picture).stdout(full()).output().expect("the program starts");
        assert_eq!(fault(&run, 1, &["the picture", "standard output", "refuses"], None), None);
        // A note that nobody reads spoils no picture.
        let unseen = [&picture[..], &["--opacity", "1:0"]].concat();
        let run = program(&unseen).stderr(full()).output().expect("the program starts");
        assert_eq!(run.status.code(), Some(0));
        assert!(image::load_from_memory(&run.stdout).is_ok());
    }
}

#[test]
fn sizes_beyond_the_adapter_are_refused_before_the_work() {
    if !can_draw() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let table = folder.path().join("table.json");
    let name = table.to_str().expect("UTF-8");
    for (size, found) in [("100000,4", "100000 × 1"), ("4,100000", "1 × 100000")] {
        // As many pixels as this take hours.
        let begin = Instant::now();
        let most = ["--resolution", size, "--pixels", "4294967295"];
        let of_gpu = ["accuracy", DEMO, "--engine", "gpu", "-o", name];
        let output = voxsplat(&[&of_gpu[..], &most].concat());
        assert_eq!(fault(&output, 1, &["pixels a side", found], None), None);
        assert!(begin.elapsed() < Duration::from_secs(60));
    }
    assert!(!table.exists());
}
