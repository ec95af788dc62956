//! Encodings: written, read, damaged.

use std::fs;
use std::path::PathBuf;

use glam::{DMat3, DVec3};
use voxsplat::core::Ticket;
use voxsplat::io::vrbf::Precision;
use voxsplat::io::{Encoded, Format, OpenOptions, Problem, Source, open, vrbf};
use voxsplat::rbf::{Basis, Encoding, Errors, Favour, Function, Region};
use voxsplat::volume::{Component, Lattice, Samples};

/// Two functions in a turned and shifted box far from the origin, as whole numbers of 16 bits.
fn encoded(basis: Basis) -> Encoded {
    encoded_by(basis, Precision::Bits16)
}

fn encoded_by(basis: Basis, precision: Precision) -> Encoded {
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
    let encoding = Encoding::new(basis, 0.1, 1e-3, functions, bounds);
    let encoding = vrbf::rounded(&encoding, precision);
    Encoded {
        encoding,
        errors: Errors { max: 0.25, mean: 0.0625, rms: 0.1 },
        favoured: None,
        source: Source {
            name: "made \"up\".nrrd".to_owned(),
            field: "density".to_owned(),
            samples: 23,
            left_out: 1,
            fills_box: true,
            range: Some([-2.5, 3.5]),
            cover: None,
            wanted: Some(0.3),
            wanted_mean: None,
            wanted_bytes: None,
            favour: None,
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
        between: None,
        ended: None,
    }
}

#[test]
fn a_file_opens_with_its_sources_range_and_holds_nothing_where_that_has_no_values() {
    // Of the first slice the last row, of the second the first column.
    let is_there: Vec<bool> = (0..24).map(|i| if i < 12 { i >= 8 } else { i % 4 == 0 }).collect();
    let mut of = encoded(Basis::Ellipsoid);
    let folder = tempfile::tempdir().expect("a folder");
    let opened = |of: &Encoded| {
        let path = folder.path().join("a.vrbf");
        fs::write(&path, vrbf::bytes(of).expect("finite")).expect("there is room");
        let found = open(&path, &OpenOptions::default(), &Ticket::new()).expect("a valid file");
        (vrbf::load(&path).expect("a valid file"), found.grid)
    };
    for (most, edge) in [(1000, 1), (10, 2)] {
        of.source.cover = vrbf::Cover::of([4, 3, 2], &is_there, most);
        let Some(cover) = &of.source.cover else { panic!("{most}") };
        assert_eq!(cover.edge(), edge);
        let (read, grid) = opened(&of);
        assert_eq!(read.source, of.source);
        let Samples::Float32(values) = &*grid.fields[0].samples else { panic!("floats") };
        for (i, value) in values.iter().enumerate() {
            // Of cubes of two all but those at the beginning of the first row and of what no sample is in.
            let has = cover.has([i % 4, i / 4 % 3, i / 12]);
            assert!(has || !is_there[i]);
            let sum = of.encoding.value(
                of.source
                    .lattice
                    .world_from_index(DVec3::from([i % 4, i / 4 % 3, i / 12].map(|n| n as f64))),
            );
            let is_near = (sum - f64::from(*value)).abs() < 1e-5;
            assert!(if has { is_near } else { value.is_nan() }, "{i}: {value}");
        }
        let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
        let statistics = volume.expect("values").statistics;
        assert_eq!((statistics.min, statistics.nan_count), (-2.5, 0));
        assert!(statistics.max >= 3.5 && statistics.max < 4.0, "{}", statistics.max);
    }
    // As files that do not tell: everywhere, and the range of what there is.
    of.source = Source { cover: None, range: None, ..of.source };
    let (_, grid) = opened(&of);
    let volume = grid.scalar(&grid.fields[0], Component::Index(0), &Ticket::new());
    let statistics = volume.expect("values").statistics;
    assert!(statistics.min > -2.5 && statistics.finite_count == 24, "{statistics:?}");
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
    let all = Basis::ALL.into_iter().flat_map(|b| Precision::ALL.map(|precision| (b, precision)));
    for (basis, precision) in all {
        let original = encoded_by(basis, precision);
        let (_folder, path) = written(&vrbf::bytes(&original).unwrap());
        let read = vrbf::load(&path).unwrap();
        let told = format!("{basis:?} {precision:?}");
        assert_eq!(read.encoding.functions(), original.encoding.functions(), "{told}");
        assert_eq!(read.encoding.functions().len(), 2, "{told}");
        assert_eq!(read.encoding.basis(), basis);
        assert_eq!(read.encoding.bias(), 0.1);
        assert_eq!(read.encoding.epsilon(), 1e-3);
        assert_eq!(read.encoding.bounds(), original.encoding.bounds());
        assert_eq!((read.errors, read.source), (original.errors, original.source), "{told}");
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

/// The same bytes with the checksum that they should have: of what stands before it in the header, and of the body.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let body = body_of(bytes);
    let second = bytes.iter().position(|byte| *byte == b'\n').expect("a header") + 1;
    let tag = b"\"crc32\":";
    let at = bytes[..body].windows(tag.len()).rposition(|part| part == tag).expect("a header");
    let mut crc = flate2::Crc::new();
    crc.update(&bytes[second..at]);
    crc.update(&bytes[body..]);
    let told = format!("{}}}\n", crc.sum());
    [&bytes[..at + tag.len()], told.as_bytes(), &bytes[body..]].concat()
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
        sealed(&[&text.as_bytes()[..line_end], &bytes[old_end..]].concat())
    };
    let valid = vrbf::bytes(&encoded(Basis::Gaussian)).unwrap();
    let old = without(&valid);
    assert!(old.len() < valid.len(), "they were there");
    let (_folder, path) = written(&old);
    let read = vrbf::load(&path).unwrap();
    assert_eq!((read.overshoot, read.source.fills_box), (0.0, true));
}

#[test]
fn what_was_asked_for_and_favoured_is_read_again() {
    let sides = DMat3::from_cols_array(&[1.0, 0.5, 0.0, 0.0, 2.0, 0.0, 0.25, 0.0, 3.0]);
    let region = Region { corner: DVec3::new(0.1, -2.0, 3.0), sides };
    let range = Some([-1.5, 2.25]);
    for favour in [
        Favour { times: 10.0, range, region: Some(region) },
        Favour { times: 1.0, range, region: None },
        Favour { times: 2.5, range: None, region: Some(region) },
    ] {
        let mut original = encoded(Basis::Ellipsoid);
        original.favoured = Some(Errors { max: 0.125, mean: 0.03, rms: 0.05 });
        original.source.favour = Some(favour);
        (original.source.wanted, original.source.wanted_mean) = (None, Some(0.02));
        original.source.wanted_bytes = Some(4096);
        let (_folder, path) = written(&vrbf::bytes(&original).unwrap());
        let read = vrbf::load(&path).unwrap();
        assert_eq!((read.favoured, &read.source), (original.favoured, &original.source));
        let facts = read.facts();
        assert_eq!(
            (facts.favoured_max_error, facts.favoured_mean_error),
            (Some(0.125), Some(0.03))
        );
        let opened = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap();
        assert!(opened.warnings[1].contains("favoured"), "{:?}", opened.warnings);
    }
}

/// Wide and narrow ones all over a box, so that every number has a range.
fn many(basis: Basis) -> Encoding {
    let functions = (0..500_u32).map(|i| {
        let at = |k: u32| f64::from((i * k) % 499) / 499.0;
        let centre = DVec3::new(at(7), at(31), at(113)) * 60.0 - 3.0;
        let wide = 0.03 * 60.0_f64.powf(at(41));
        let shape = match basis {
            Basis::Ellipsoid => DMat3::from_cols_array(&[
                wide,
                0.0,
                0.0,
                (at(3) - 0.5) * wide,
                0.7 * wide,
                0.0,
                0.4 * at(5) * wide,
                -0.3 * at(11) * wide,
                1.6 * wide,
            ]),
            Basis::Gaussian | Basis::Multiquadric => DMat3::from_diagonal(DVec3::splat(wide)),
        };
        Function { centre, shape, weight: 4.0 * (at(17) - 0.5) + 0.01 }
    });
    let bounds = [DVec3::splat(-3.0), DVec3::splat(57.0)];
    Encoding::new(basis, 0.1, 1e-3, functions, bounds)
}

#[test]
fn rounding_is_done_once_and_moves_little() {
    for basis in Basis::ALL {
        let exact = many(basis);
        let count = exact.functions().len();
        let mut off = Vec::new();
        for precision in Precision::ALL {
            let once = vrbf::rounded(&exact, precision);
            let twice = vrbf::rounded(&once, precision);
            assert_eq!(once.functions(), twice.functions(), "{basis:?} {precision:?}");
            assert_eq!(once.functions().len(), count, "{basis:?} {precision:?}");
            let places: Vec<DVec3> = (0..1000_u32)
                .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)))
                .map(|at| at * 6.0 - 1.0)
                .collect();
            let ticket = Ticket::new();
            let [a, b] = [&exact, &once].map(|e| e.values(&places, &ticket).unwrap());
            off.push(a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        }
        // Weights up to 2, so some hundredths of a per cent of these for each that overlaps.
        assert!(off[0] < 0.05 && off[2] < 1e-3 && off[3] < 1e-3, "{basis:?}: {off:?}");
        assert!(off[2] < off[0], "{basis:?}: {off:?}");
    }
}

#[test]
fn whole_numbers_take_half_of_what_floats_do_and_no_more_than_is_said() {
    for basis in Basis::ALL {
        let source = encoded(basis).source;
        let errors = Errors { max: 0.25, mean: 0.0625, rms: 0.1 };
        let len = |encoding: Encoding| {
            let encoded = Encoded {
                encoding,
                errors,
                favoured: None,
                source: source.clone(),
                overshoot: 0.0,
                between: None,
                ended: None,
            };
            vrbf::bytes(&encoded).unwrap().len()
        };
        let short = vrbf::rounded(&many(basis), Precision::Bits16);
        let count = short.functions().len() as u64;
        let [short, long] = [short, many(basis)].map(len);
        assert!((short as f64) < 0.6 * long as f64, "{basis:?}: {short} {long}");
        let most = vrbf::most_bytes(count, basis, &source);
        assert!(short as u64 <= most, "{basis:?}: {short} {most}");
        assert_eq!(vrbf::most_functions(most, basis, &source) as u64, count);
        assert_eq!(vrbf::most_functions(most - 1, basis, &source) as u64, count - 1);
        assert_eq!(vrbf::most_functions(10, basis, &source), 0);
    }
}

#[test]
fn files_of_the_first_version_are_read_and_written_again_as_they_are() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/readers");
    let old = folder.join("blobs.vrbf");
    assert!(fs::read(&old).unwrap().starts_with(b"VOXSPLAT RBF 1\n"));
    let first = vrbf::load(&old).unwrap();
    assert_eq!((first.encoding.functions().len(), first.source.samples), (11, 512));
    assert!(first.source.wanted.is_some() && first.source.wanted_mean.is_none());
    assert_eq!(
        (first.source.wanted_bytes, first.source.favour, first.favoured),
        (None, None, None)
    );
    let (_folder, path) = written(&vrbf::bytes(&first).unwrap());
    let again = vrbf::load(&path).unwrap();
    assert_eq!(again.encoding.functions(), first.encoding.functions());
    assert_eq!((again.errors, again.source), (first.errors, first.source));

    // The same, by hand as whole numbers of 16 bits.
    let short = vrbf::load(&folder.join("blobs_packed.vrbf")).unwrap();
    for (a, b) in short.encoding.functions().iter().zip(first.encoding.functions()) {
        assert!((a.centre - b.centre).length() < 1e-3, "{a:?} {b:?}");
        assert!((a.weight - b.weight).abs() < 1e-3, "{a:?} {b:?}");
        let off = (a.shape - b.shape).to_cols_array().into_iter().map(f64::abs);
        assert!(off.fold(0.0, f64::max) < 1e-2, "{a:?} {b:?}");
    }
    assert_eq!(short.encoding.functions().len(), 11);
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

/// Where the functions begin.
fn body_of(file: &[u8]) -> usize {
    let mut lines = file.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
    lines.nth(1).expect("two lines").0 + 1
}

#[test]
fn damage_is_refused_in_one_sentence() {
    let valid = vrbf::bytes(&encoded(Basis::Gaussian)).unwrap();
    let text = String::from_utf8_lossy(&valid).into_owned();
    let body = body_of(&valid);
    // Two functions are too few to be worth deflating.
    assert_eq!(valid.len() - body, 20);
    let altered = |from: &str, to: &str| {
        let header = text[..body.min(text.len())].replacen(from, to, 1);
        assert_ne!(header, text[..body], "{from} is there");
        [header.as_bytes(), &valid[body..]].concat()
    };
    let with = |from: &str, to: &str| sealed(&altered(from, to));
    let mut flipped = valid.clone();
    flipped[body + 3] ^= 1;
    let cases: [(&str, Vec<u8>, &str); 22] = [
        ("cut short", valid[..valid.len() - 1].to_vec(), "20 bytes of functions"),
        ("too long", [&valid[..], b"x"].concat(), "found 21"),
        ("a flipped bit", flipped, "checksum"),
        ("another bias", altered("\"bias\":0.1", "\"bias\":9.1"), "checksum"),
        ("a smaller error", altered("\"max\":0.25", "\"max\":0.01"), "checksum"),
        ("without functions", valid[..20].to_vec(), "two lines"),
        ("a later version", with("RBF 3", "RBF 9"), "version 1 to 3"),
        ("many functions", with("\"functions\":2", "\"functions\":900000000000"), "at most"),
        ("more than there are", with("\"functions\":2", "\"functions\":3"), "of 3 functions"),
        ("no number", with("\"bias\":0.1", "\"bias\":null"), "JSON"),
        ("an epsilon of 0", with("\"epsilon\":0.001", "\"epsilon\":0.0"), "finite functions"),
        ("other samples", with("\"dims\":[4,3,2]", "\"dims\":[4,3,9]"), "as many samples"),
        ("a negative error", with("\"wanted\":", "\"wanted\":-"), "errors of 0 or more"),
        ("a negative overshoot", with("\"overshoot\":", "\"overshoot\":-1"), "errors of 0 or more"),
        ("no lattice", with("\"dims\":[4,3,2]", "\"dims\":[0,3,2]"), "expected"),
        ("too many columns", with("\"columns\":[[", "\"columns\":[[0,0,2],["), "whole numbers"),
        ("a step without end", with("\"columns\":[[-", "\"columns\":[[-99"), "whole numbers"),
        ("no deflated bytes", with("\"deflated\":false", "\"deflated\":true"), "the numbers of"),
        ("bytes of none", with("\"packed\":{", "\"packed\":null,\"x\":{"), "JSON"),
        (
            "other bytes",
            with("\"bytes\":20", "\"bytes\":900000000000"),
            "at most 20 bytes of functions, found 900000000000",
        ),
        (
            "nothing favoured",
            with("\"source\"", "\"favour\":{\"times\":0.0},\"source\""),
            "favoured",
        ),
        ("a favour of no one", with("\"source\"", "\"favour\":{},\"source\""), "JSON"),
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

/// Deflated zeros, of which a few hundred bytes are a million functions.
#[test]
fn functions_that_no_such_body_can_hold_are_refused_before_there_is_room_for_them() {
    let mut encoded = encoded(Basis::Gaussian);
    let two = encoded.encoding.functions().to_vec();
    let alike = (0..4000).map(|i| two[i % 2]);
    encoded.encoding = Encoding::new(Basis::Gaussian, 0.1, 1e-3, alike, encoded.encoding.bounds());
    let valid = vrbf::bytes(&encoded).unwrap();
    let (_folder, path) = written(&valid);
    assert_eq!(vrbf::load(&path).unwrap().encoding.functions(), encoded.encoding.functions());
    let body = body_of(&valid);
    let header = String::from_utf8(valid[..body].to_vec()).unwrap();
    assert!(header.contains("\"deflated\":true") && valid.len() - body < 1000);
    for (count, words) in [
        // More than any file has, than memory has, and than is there.
        (1_000_000_000, "at most"),
        (16_000_000, "the functions"),
        (1_000_000, "the numbers of 1000000 functions"),
        (4001, "the numbers of 4001 functions"),
        (3999, "the numbers of 3999 functions"),
    ] {
        let told = format!("\"functions\":{count}");
        let claims = header.replacen("\"functions\":4000", &told, 1);
        assert_ne!(claims, header);
        let (_folder, path) = written(&sealed(&[claims.as_bytes(), &valid[body..]].concat()));
        let options = OpenOptions { memory_limit_bytes: Some(1 << 30), ..OpenOptions::default() };
        let refused = open(&path, &options, &Ticket::new()).unwrap_err().to_string();
        assert!(refused.contains(words) && !refused.contains('\n'), "{count}: {refused}");
    }
}
