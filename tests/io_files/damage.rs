//! Damaged files: an answer, never a panic, and no more memory than the file justifies.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, RawOverrides, open};
use voxsplat::volume::ScalarType;

use crate::watching::LARGEST;
use crate::write::{self, META_STORAGES, NRRD_ENCODINGS, VTI_FORMATS, VTI_KINDS, Volume, Vti};
use crate::write_legacy::{self, DATASETS, Legacy};

/// The largest request that any test of small files may make. Deflate's best is a thousandfold,
/// which a damaged header may claim and a damaged stream of 4 kB could just keep.
const MOST_BYTES: usize = 8 << 20;

fn try_open(path: &Path) -> bool {
    open(path, &OpenOptions::default(), &Ticket::new()).is_ok()
}

/// One small file of every encoding.
fn every_kind(folder: &Path) -> Vec<PathBuf> {
    let volume = Volume::new([5, 4, 6], ScalarType::UInt16, 1, 77);
    let mut paths = Vec::new();
    let mut keep = |path: PathBuf| {
        let extension = path.extension().unwrap_or_default().display().to_string();
        let kept = folder.join(format!("{}.{extension}", paths.len()));
        std::fs::rename(path, &kept).expect("the temporary folder is ours");
        paths.push(kept);
    };
    for encoding in NRRD_ENCODINGS {
        keep(write::nrrd(folder, &volume, encoding, true, false));
    }
    for storage in META_STORAGES {
        keep(write::metaimage(folder, &volume, storage, false, false));
    }
    for format in VTI_FORMATS {
        for compressed in [false, true] {
            for kind in VTI_KINDS {
                let wide = compressed;
                let (big, split, cells) = (false, true, false);
                keep(write::vti(
                    folder,
                    &volume,
                    Vti { kind, format, compressed, wide, big, split, cells },
                ));
            }
        }
    }
    for dataset in DATASETS {
        for (binary, role) in [(true, "SCALARS"), (false, "FIELD")] {
            let how = Legacy { dataset, role, binary, cells: binary, extras: true };
            keep(write_legacy::legacy(folder, &volume, how));
        }
    }
    for version in [1, 2] {
        keep(crate::winds::winds(folder, version));
    }
    paths
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % n as u64).expect("below a usize")
    }
}

#[test]
fn damaged_files_are_answered_without_panic_and_without_absurd_memory() {
    const ROUNDS: usize = 120;
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(0x5eed_0001);
    let (mut opened, mut refused) = (0, 0);
    for path in every_kind(folder.path()) {
        assert!(try_open(&path), "{} is valid as written", path.display());
        let valid = std::fs::read(&path).unwrap();
        let header = valid.windows(2).position(|w| w == b"\n\n").unwrap_or(valid.len() / 2);
        for _ in 0..ROUNDS {
            let mut bytes = valid.clone();
            match random.below(5) {
                0 => bytes.truncate(random.below(bytes.len())),
                1 => {
                    // A digit of the header becomes nines.
                    let digits: Vec<usize> =
                        (0..header).filter(|&i| bytes[i].is_ascii_digit()).collect();
                    // Headers of bytes have few or none.
                    let at = if digits.is_empty() { 4 } else { digits[random.below(digits.len())] };
                    let nines = vec![b'9'; 1 + random.below(20)];
                    bytes.splice(at..=at, nines);
                }
                2 => {
                    let at = random.below(header);
                    bytes[at] = [b'-', b'0', b' ', b'\n', b'"', 0xff][random.below(6)];
                }
                _ => {
                    for _ in 0..=random.below(4) {
                        let at = random.below(bytes.len());
                        bytes[at] ^= 1 << random.below(8);
                    }
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            match open(&path, &OpenOptions::default(), &Ticket::new()) {
                Ok(_) => opened += 1,
                Err(error) => {
                    refused += 1;
                    let message = error.to_string();
                    assert!(message.starts_with("expected "), "{message}");
                    assert!(message.ends_with(&path.display().to_string()), "{message}");
                    assert!(!message.contains('\n'), "{message}");
                }
            }
        }
    }
    println!("seed 0x5eed0001: {opened} still opened, {refused} refused");
    assert!(refused > opened / 4, "most damage must be noticed");
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(largest <= MOST_BYTES, "a request for {largest} bytes");
}

#[test]
fn random_bytes_behind_every_magic_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noise");
    let mut random = Random(0x5eed_0002);
    let starts: [&[u8]; 11] = [
        b"",
        b"NRRD0004\n",
        b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 9 9 9\nencoding: gzip\n\n",
        b"ObjectType = Image\nNDims = 3\n",
        b"<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\">",
        b"<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 9 0 9 0 9\"><Piece><PointData>\
          <DataArray type=\"UInt8\" format=\"appended\" offset=\"0\"/></PointData></Piece>\
          </ImageData><AppendedData encoding=\"raw\">_",
        b"# vtk DataFile Version 3.0\n",
        b"# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 9 9 9\n\
          POINT_DATA 729\nSCALARS a float\nLOOKUP_TABLE default\n",
        b"# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS 2 2 2\nPOINTS 8 float\n",
        b"CDF\x01\0\0\0\0\0\0\0\x0a\0\0\0\x02",
        b"CDF\x02",
    ];
    for start in starts {
        for _ in 0..200 {
            let mut bytes = start.to_vec();
            let length = random.below(600);
            bytes.extend((0..length).map(|_| u8::try_from(random.below(256)).unwrap()));
            std::fs::write(&path, &bytes).unwrap();
            assert!(!try_open(&path));
        }
    }
}

#[test]
fn headers_that_promise_the_earth_allocate_nothing_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("promise");
    let nrrd = |sizes: &str, encoding: &str| {
        format!(
            "NRRD0004\ntype: float\ndimension: 3\nsizes: {sizes}\nendian: little\nencoding: {encoding}\n\nabc"
        )
    };
    let vti = |last: &str, format: &str| {
        format!(
            "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"0 \
             {last} 0 {last} 0 {last}\"><Piece Extent=\"0 {last} 0 {last} 0 {last}\"><PointData>\
             <DataArray type=\"UInt8\" format=\"{format}\">AAAA</DataArray></PointData></Piece>\
             </ImageData></VTKFile>"
        )
    };
    let legacy = |dataset: &str, size: &str, mode: &str, rest: &str| {
        format!(
            "# vtk DataFile Version 3.0\nt\n{mode}\nDATASET {dataset}\nDIMENSIONS {size} {size} \
             {size}\n{rest}"
        )
    };
    let mut promises_of_bytes = Vec::new();
    let mut promises = Vec::new();
    for mode in ["ASCII", "BINARY"] {
        for (size, points) in
            [("300", "27000000"), ("4000000000", "1"), ("2000000", "8000000000000000000")]
        {
            let data = format!("POINT_DATA {points}\nSCALARS a float\nLOOKUP_TABLE default\n1 2 3");
            promises.push(legacy("STRUCTURED_POINTS", size, mode, &data));
            promises.push(legacy(
                "STRUCTURED_GRID",
                size,
                mode,
                &format!("POINTS {points} double\n1 2"),
            ));
            let list = format!("X_COORDINATES {size} double\n1 2");
            promises.push(legacy("RECTILINEAR_GRID", size, mode, &list));
        }
        for field in [
            "a 1 4000000000 float",
            "a 4000000000 4000000000 int",
            "a 1 4000000000 string",
            "a 9 9 bit",
        ] {
            promises.push(legacy(
                "STRUCTURED_POINTS",
                "2",
                mode,
                &format!("FIELD f 2\n{field}\n1 2\n"),
            ));
        }
        promises.push(legacy(
            "STRUCTURED_POINTS",
            "2",
            mode,
            "LOOKUP_TABLE a 4000000000000000000\n1\n",
        ));
        promises.push(legacy("STRUCTURED_POINTS", "2", mode, "FIELD f 99999999999\n"));
        let wide = "POINT_DATA 8\nSCALARS a float 4000000000000000000\nLOOKUP_TABLE default\n1\n";
        promises.push(legacy("STRUCTURED_POINTS", "2", mode, wide));
    }
    for encoding in NRRD_ENCODINGS {
        promises.push(nrrd("300 300 300", encoding));
        promises.push(nrrd("4000000000 4000000000 4000000000", encoding));
        promises.push(nrrd("9223372036854775807 2 2", encoding));
    }
    for compressed in ["True", "False"] {
        promises.push(format!(
            "NDims = 3\nDimSize = 500 500 500\nElementType = MET_UCHAR\nCompressedData = \
             {compressed}\nElementDataFile = LOCAL\nabc"
        ));
    }
    for last in ["300", "4000000000", "9223372036854775807"] {
        promises.extend(["ascii", "binary"].map(|format| vti(last, format)));
    }
    // The sizes of a NetCDF file's dimensions stand behind their names.
    let winds = std::fs::read(crate::winds::winds(folder.path(), 1)).unwrap();
    for (name, size) in [("lev\0", 0x7fff_ffff_u32), ("lat\0", 0x00ff_ffff), ("time", 0xffff_fff0)]
    {
        let at = winds.windows(4).position(|window| window == name.as_bytes()).unwrap() + 4;
        let mut promise = winds.clone();
        promise[at..at + 4].copy_from_slice(&size.to_be_bytes());
        promises_of_bytes.push(promise);
    }
    for promise in promises_of_bytes {
        std::fs::write(&path, &promise).unwrap();
        let error = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_err();
        assert!(error.to_string().starts_with("expected "), "{error}");
    }
    for promise in promises {
        std::fs::write(&path, &promise).unwrap();
        let error = open(&path, &OpenOptions::default(), &Ticket::new()).unwrap_err();
        assert!(error.to_string().starts_with("expected "), "{promise}: {error}");
    }
    let known = RawOverrides {
        dims: Some([usize::MAX, 3, 3]),
        scalar_type: Some(ScalarType::Float64),
        ..Default::default()
    };
    let options = OpenOptions { raw: Some(known), ..Default::default() };
    assert!(open(&path, &options, &Ticket::new()).is_err());
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(largest <= MOST_BYTES, "a request for {largest} bytes");
}

#[test]
fn the_watch_over_memory_sees_a_large_request() {
    // As large as the limit, not larger: the other tests share the watch.
    let block = std::hint::black_box(vec![1_u8; MOST_BYTES]);
    assert!(LARGEST.load(Ordering::Relaxed) >= block.len());
}
