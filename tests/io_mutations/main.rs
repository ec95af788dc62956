//! 20 000 seeded mutations of small valid files a reader: an answer each, without panic, hang, or more memory than the
//! file justifies.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../io_files/watching.rs"]
mod watching;

use std::path::{Path, PathBuf};
use std::sync::Once;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use voxsplat::core::{Ticket, panics};
use voxsplat::io::{OpenOptions, open};

use watching::LARGEST;

/// Of each reader.
const ROUNDS: usize = 20_000;
/// Longest that any of these files may take; all have a few kilobytes.
const MOST_TIME: Duration = Duration::from_secs(5);
/// The largest request for memory: a thousand times the largest file.
const MOST_BYTES: usize = 16 << 20;

/// Grids of PLOT3D and the flow on them.
const PAIRS: [[&str; 2]; 2] = [["blocks.xyz", "blocks.q"], ["single.x", "single.q"]];

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % n.max(1) as u64).expect("below a usize")
    }
}

/// Cut, or with bits, numbers or digits changed, most of it in the header.
fn mutated(valid: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    let header = valid.len().min(600);
    match random.below(8) {
        0 => bytes.truncate(random.below(valid.len())),
        1 => {
            let at = random.below(header);
            let value = [0, 0xff, 0x7f, 0x80, b'9', b'-', b'{', b'"'][random.below(8)];
            bytes[at] = value;
        }
        2 => {
            // A whole number becomes a large one.
            let at = random.below(header);
            for byte in bytes.iter_mut().skip(at).take(1 + random.below(8)) {
                *byte = 0xff;
            }
        }
        3 => {
            let digits: Vec<usize> = (0..header).filter(|&i| bytes[i].is_ascii_digit()).collect();
            if !digits.is_empty() {
                let at = digits[random.below(digits.len())];
                bytes.splice(at..=at, vec![b'9'; 1 + random.below(20)]);
            }
        }
        4 => {
            let (from, to) = (random.below(bytes.len()), random.below(bytes.len()));
            let len = random.below(32).min(bytes.len() - from.max(to));
            bytes.copy_within(from..from + len, to);
        }
        _ => {
            let within = if random.below(2) == 0 { header } else { bytes.len() };
            for _ in 0..=random.below(4) {
                let at = random.below(within);
                bytes[at] ^= 1 << random.below(8);
            }
        }
    }
    bytes
}

/// What libraries panic with is told as an error: nobody wants it twice, thousands of times.
fn hush() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !panics::are_caught() {
                before(info);
            }
        }));
    });
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/readers").join(name)
}

/// Mutates files one at a time; of a folder the file `inside` it.
fn mutate(seed: u64, names: &[(&str, &str)]) {
    hush();
    let folder = tempfile::tempdir().unwrap();
    // Told rather than asked of the system, each time anew.
    let options = OpenOptions { memory_limit_bytes: Some(1 << 30), ..OpenOptions::default() };
    let mut random = Random(seed);
    let (mut opened, mut refused) = (0, 0);
    for (index, (name, inside)) in names.iter().enumerate() {
        let own = folder.path().join(index.to_string());
        std::fs::create_dir(&own).unwrap();
        let asked = own.join(name);
        if inside.is_empty() {
            std::fs::copy(data(name), &asked).unwrap();
        } else {
            copy_all(&data(name), &asked);
        }
        // What a header alone needs.
        if name.ends_with(".hdr") {
            std::fs::copy(data("pair.img"), own.join("pair.img")).unwrap();
        }
        // A grid, or its flow, has the other beside it.
        for (of, beside) in PAIRS.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
            if *name == of {
                std::fs::copy(data(beside), own.join(beside)).unwrap();
            }
        }
        let changed = if inside.is_empty() { asked.clone() } else { asked.join(inside) };
        let valid = std::fs::read(&changed).unwrap();
        let read = || open(&asked, &options, &Ticket::new());
        assert!(read().is_ok(), "{name} is valid as written");
        for _ in 0..ROUNDS / names.len() {
            let bytes = mutated(&valid, &mut random);
            std::fs::write(&changed, &bytes).unwrap();
            let start = Instant::now();
            match read() {
                Ok(_) => opened += 1,
                Err(error) => {
                    refused += 1;
                    let message = error.to_string();
                    assert!(message.starts_with("expected "), "{name}: {message}");
                    assert!(!message.contains('\n'), "{name}: {message}");
                }
            }
            if start.elapsed() > MOST_TIME || LARGEST.load(Ordering::Relaxed) > MOST_BYTES {
                let kept = std::env::temp_dir().join(format!("mutated-{seed:x}"));
                std::fs::write(&kept, &bytes).unwrap();
                let largest = LARGEST.load(Ordering::Relaxed);
                panic!(
                    "{name}: {:?}, {largest} bytes at once: {}",
                    start.elapsed(),
                    kept.display()
                );
            }
        }
        std::fs::write(&changed, &valid).unwrap();
    }
    println!("seed {seed:#x}: {opened} still opened, {refused} refused");
    assert!(refused > opened / 20, "damage must be noticed");
}

fn copy_all(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().filter_map(Result::ok) {
        let target = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy_all(&entry.path(), &target),
            false => std::fs::copy(entry.path(), &target).map(drop).unwrap(),
        }
    }
}

#[test]
fn nifti_and_analyze() {
    mutate(0x5eed_0101, &[("one.nii", ""), ("one.nii.gz", ""), ("two.nii", ""), ("pair.hdr", "")]);
}

#[test]
fn numpy() {
    mutate(0x5eed_0102, &[("fortran.npy", ""), ("two.npz", ""), ("two_c.npz", "")]);
}

#[test]
fn mrc() {
    mutate(0x5eed_0103, &[("map.mrc", "")]);
}

#[test]
fn dicom() {
    mutate(
        0x5eed_0104,
        &[
            ("plain.dcm", ""),
            ("rle.dcm", ""),
            ("jls.dcm", ""),
            ("j2k.dcm", ""),
            ("ljpeg.dcm", ""),
            ("jpeg.dcm", ""),
        ],
    );
}

#[test]
fn tiff() {
    mutate(
        0x5eed_0105,
        &[("c_lzw.tif", ""), ("c_zlib.tif", ""), ("c_packbits.tif", ""), ("ome.ome.tif", "")],
    );
}

#[test]
fn hdf5() {
    mutate(0x5eed_0106, &[("plain.h5", ""), ("several.h5", ""), ("itk.h5", "")]);
}

#[test]
fn netcdf_4() {
    mutate(0x5eed_0107, &[("n4.nc", "")]);
}

#[test]
fn zarr() {
    mutate(
        0x5eed_0108,
        &[
            ("lz4.zarr", ".zarray"),
            ("lz4.zarr", "0.0.0"),
            ("zstd.zarr", "0.0.0"),
            ("shards.zarr", "zarr.json"),
            ("shards.zarr", "c/0/0/0"),
            ("pyramid.zarr", "zarr.json"),
        ],
    );
}

#[test]
fn basis_functions() {
    mutate(0x5eed_0109, &[("blobs.vrbf", ""), ("blobs_packed.vrbf", "")]);
}

#[test]
fn vtk_cells() {
    mutate(0x5eed_010a, &[("two.vtu", ""), ("text.vtu", ""), ("v5.vtk", ""), ("v42.vtk", "")]);
}

#[test]
fn polyhedra_and_polygons() {
    mutate(
        0x5eed_010b,
        &[("poly.vtu", ""), ("lzma.vtu", ""), ("polygons.vtk", ""), ("polygons.vtp", "")],
    );
}

#[test]
fn exodus() {
    mutate(0x5eed_010c, &[("mesh.ex2", ""), ("mesh4.e", "")]);
}

#[test]
fn plot3d() {
    mutate(
        0x5eed_010d,
        &[("blocks.xyz", ""), ("blocks.q", ""), ("single.x", ""), ("single.q", "")],
    );
}

#[test]
fn tables() {
    mutate(0x5eed_010e, &[("table.csv", ""), ("cloud.npy", "")]);
}
