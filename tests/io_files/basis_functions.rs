//! Encodings: written, read, damaged.

use std::fs;
use std::path::PathBuf;

use glam::{DMat3, DVec3};
use voxsplat::core::Ticket;
use voxsplat::io::{Encoded, Format, OpenOptions, Problem, Source, open, vrbf};
use voxsplat::rbf::{Basis, Encoding, Errors, Function};
use voxsplat::volume::{Lattice, Samples};

/// Two functions in a turned and shifted box far from the origin.
fn encoded(basis: Basis) -> Encoded {
    let origin = DVec3::new(1e7, -2.0, 0.125);
    let shape = match basis {
        Basis::Ellipsoid => {
            DMat3::from_cols_array(&[0.5, 0.0, 0.0, 0.25, 1.5, 0.0, -0.125, 0.75, 2.0])
        }
        Basis::Gaussian | Basis::Multiquadric => DMat3::from_diagonal(DVec3::splat(0.7)),
    };
    let functions = [
        Function { centre: origin + DVec3::new(1.1, 2.3, 0.4), shape, weight: 3.3 },
        Function { centre: origin + DVec3::new(0.2, -0.7, 1.9), shape: shape * 0.5, weight: -1.7 },
    ];
    let bounds = [origin + DVec3::new(0.0, -1.0, 0.0), origin + DVec3::new(3.0, 3.0, 2.0)];
    let encoding = vrbf::rounded(&Encoding::new(basis, 0.1, 1e-3, functions, bounds));
    Encoded {
        encoding,
        errors: Errors { max: 0.25, mean: 0.0625, rms: 0.1 },
        source: Source {
            name: "made \"up\".nrrd".to_owned(),
            field: "density".to_owned(),
            samples: 23,
            left_out: 1,
            wanted: 0.3,
            fills_box: true,
            lattice: Lattice {
                dims: [4, 3, 2],
                spacing: DVec3::new(1.0, 2.0, 2.0),
                origin,
                direction: DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0]),
            },
            space: Some("left-posterior-superior".to_owned()),
            unit: Some("mm".to_owned()),
        },
        overshoot: 0.0,
    }
}

/// A file of it in a folder that lives as long.
fn written(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("there is room");
    let path = folder.path().join("two.vrbf");
    fs::write(&path, bytes).expect("there is room");
    (folder, path)
}

#[test]
fn what_is_written_is_read() {
    for basis in Basis::ALL {
        let original = encoded(basis);
        let (_folder, path) = written(&vrbf::bytes(&original).unwrap());
        let read = vrbf::load(&path).unwrap();
        assert_eq!(read.encoding.functions(), original.encoding.functions(), "{basis:?}");
        assert_eq!(read.encoding.basis(), basis);
        assert_eq!(read.encoding.bias(), 0.1);
        assert_eq!(read.encoding.epsilon(), 1e-3);
        assert_eq!(read.encoding.bounds(), original.encoding.bounds());
        assert_eq!((read.errors, read.source), (original.errors, original.source), "{basis:?}");
        assert_eq!(read.overshoot, original.overshoot);
    }
}

#[test]
fn what_errors_at_the_samples_do_not_tell_is_said_where_it_is_opened() {
    let warnings = |encoded: &Encoded| {
        let (_folder, path) = written(&vrbf::bytes(encoded).unwrap());
        let read = vrbf::load(&path).unwrap();
        assert_eq!(read.overshoot, encoded.overshoot);
        assert_eq!(read.source.fills_box, encoded.source.fills_box);
        let opened = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap();
        assert_eq!(opened.encoding.unwrap().overshoot, encoded.overshoot);
        opened.warnings[2..].to_vec()
    };
    let plain = encoded(Basis::Ellipsoid);
    assert!(warnings(&plain).is_empty(), "{:?}", warnings(&plain));
    // Its greatest error is 0.25.
    assert!(warnings(&Encoded { overshoot: 0.24, ..plain.clone() }).is_empty());
    let beyond = warnings(&Encoded { overshoot: 0.5, ..plain.clone() });
    assert!(beyond.len() == 1 && beyond[0].contains("up to 0.5 beyond the range"), "{beyond:?}");
    let mut bent = plain.clone();
    bent.source.fills_box = false;
    let box_ = warnings(&bent);
    assert!(box_.len() == 1 && box_[0].contains("in the whole box"), "{box_:?}");

    // Of another two, a ten-thousandth of a width apart, little is left but their rounding.
    let own = &plain.encoding;
    let pair = |weight: f64, apart: f64| {
        let first = own.functions()[0];
        Function { centre: first.centre + DVec3::X * apart, weight, ..first }
    };
    let functions = own.functions().iter().copied();
    let functions = functions.chain([pair(1e6, 0.0), pair(-1e6, 1e-4)]);
    let encoding = Encoding::new(own.basis(), own.bias(), own.epsilon(), functions, own.bounds());
    let cancelling = warnings(&Encoded { encoding, ..plain });
    assert!(
        cancelling.len() == 1 && cancelling[0].contains("in single precision"),
        "{cancelling:?}"
    );
}

/// Files of before hold neither how far the sum goes between samples nor whether these fill their box.
#[test]
fn files_that_do_not_say_what_is_between_samples_open_all_the_same() {
    let without = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let text = text.replacen(",\"fills_box\":true,\"overshoot\":0.0", "", 1);
        let line_end = text.match_indices('\n').nth(1).unwrap().0;
        let old_end =
            bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(1).unwrap().0;
        [text[..line_end].as_bytes(), &bytes[old_end..]].concat()
    };
    let valid = vrbf::bytes(&encoded(Basis::Gaussian)).unwrap();
    let old = without(&valid);
    assert!(old.len() < valid.len(), "they were there");
    let (_folder, path) = written(&old);
    let read = vrbf::load(&path).unwrap();
    assert_eq!((read.overshoot, read.source.fills_box), (0.0, true));
}

#[test]
fn it_opens_as_its_values_at_the_sources_samples_or_at_as_many_as_asked_for() {
    let original = encoded(Basis::Ellipsoid);
    let (_folder, path) = written(&vrbf::bytes(&original).unwrap());
    let opened = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap();
    assert_eq!(opened.format, Format::Vrbf);
    assert_eq!(opened.grid.lattice, original.source.lattice);
    assert_eq!(opened.grid.space.as_deref(), Some("left-posterior-superior"));
    let facts = opened.encoding.unwrap();
    assert_eq!((facts.functions, facts.max_error, facts.mean_error), (2, 0.25, 0.0625));
    assert_eq!(facts.source, "made \"up\".nrrd");
    assert!(opened.warnings[0].contains("2 basis functions"), "{:?}", opened.warnings);
    assert!(opened.warnings[1].contains("not finite in the source"));

    let dims = Some([7, 5, 1]);
    let options = OpenOptions { dims, ..OpenOptions::default() };
    let finer = open(&path, &options, &Ticket::new()).unwrap().grid;
    assert_eq!(finer.lattice.dims, [7, 5, 1]);
    assert_eq!(finer.lattice.spacing, DVec3::new(0.5, 1.0, 2.0), "over the same box");
    for grid in [opened.grid, finer] {
        let Samples::Float32(values) = &*grid.fields[0].samples else { panic!("32-bit floats") };
        for (i, value) in values.iter().enumerate() {
            let [x, y, _] = grid.lattice.dims;
            let index = DVec3::new((i % x) as f64, (i / x % y) as f64, (i / (x * y)) as f64);
            let at = grid.lattice.world_from_index(index);
            assert_eq!(*value, original.encoding.value(at) as f32, "{index}");
        }
    }
}

#[test]
fn damage_is_refused_in_one_sentence() {
    let valid = vrbf::bytes(&encoded(Basis::Gaussian)).unwrap();
    let text = String::from_utf8_lossy(&valid).into_owned();
    let body = valid.len() - 2 * 5 * 4;
    let with = |from: &str, to: &str| {
        let header = text[..body.min(text.len())].replacen(from, to, 1);
        assert_ne!(header, text[..body], "{from} is there");
        [header.as_bytes(), &valid[body..]].concat()
    };
    let mut flipped = valid.clone();
    flipped[body + 3] ^= 1;
    let cases: [(&str, Vec<u8>, &str); 12] = [
        ("cut short", valid[..valid.len() - 1].to_vec(), "40 bytes of functions"),
        ("too long", [&valid[..], b"x"].concat(), "found 41"),
        ("a flipped bit", flipped, "checksum"),
        ("without functions", valid[..20].to_vec(), "two lines"),
        ("a later version", with("RBF 1", "RBF 9"), "version 1"),
        ("many functions", with("\"functions\":2", "\"functions\":900000000000"), "at most"),
        ("no number", with("\"bias\":0.1", "\"bias\":null"), "JSON"),
        ("an epsilon of 0", with("\"epsilon\":0.001", "\"epsilon\":0.0"), "finite functions"),
        ("other samples", with("\"dims\":[4,3,2]", "\"dims\":[4,3,9]"), "as many samples"),
        ("a negative error", with("\"wanted\":", "\"wanted\":-"), "errors of 0 or more"),
        ("a negative overshoot", with("\"overshoot\":", "\"overshoot\":-1"), "errors of 0 or more"),
        ("no lattice", with("\"dims\":[4,3,2]", "\"dims\":[0,3,2]"), "expected"),
    ];
    for (name, bytes, words) in cases {
        let (_folder, path) = written(&bytes);
        let refused = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_err();
        let sentence = refused.to_string();
        assert!(sentence.contains(words) && !sentence.contains('\n'), "{name}: {sentence}");
    }
}

#[test]
fn more_samples_than_memory_holds_are_refused() {
    let (_folder, path) = written(&vrbf::bytes(&encoded(Basis::Gaussian)).unwrap());
    for dims in [[100_000; 3], [usize::MAX; 3], [2000, 1000, 1]] {
        let options = OpenOptions {
            dims: Some(dims),
            memory_limit_bytes: Some(1 << 20),
            ..OpenOptions::default()
        };
        let refused = open(&path, &options, &Ticket::new()).unwrap_err();
        assert!(matches!(refused.problem, Problem::TooLarge(_)), "{refused}");
    }
}
