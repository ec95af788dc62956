//! The same large volume in many formats, written plainly and apart from the readers.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::write_dicom::Slice;

/// Samples along each axis, of two bytes each.
const SIDE: usize = 512;
/// All samples.
pub(crate) const BYTES: usize = SIDE * SIDE * SIDE * 2;
/// Samples along each axis of a chunk of a Zarr array.
const CHUNK: usize = 128;

/// A file, or a folder of files.
pub(crate) struct Written {
    pub(crate) name: &'static str,
    pub(crate) opened: PathBuf,
    pub(crate) is_gzip: bool,
}

/// What `benches/peers/hdf5_files.py` wrote, where somebody ran it.
const OF_HDF5: [(&str, &str); 5] = [
    ("HDF5", "hdf5.h5"),
    ("HDF5, chunks", "hdf5-chunks.h5"),
    ("HDF5, chunks, gzip", "hdf5-gzip.h5"),
    ("NetCDF-4", "netcdf4.nc"),
    ("NetCDF-4, chunks, zlib", "netcdf4-zlib.nc"),
];

/// Files that lie in the folder already.
pub(crate) fn of_hdf5(folder: &Path) -> Vec<Written> {
    let file = |(name, file): &(&'static str, &str)| {
        let opened = folder.join(file);
        opened.exists().then_some(Written { name, opened, is_gzip: false })
    };
    OF_HDF5.iter().filter_map(file).collect()
}

type Writer = fn(&Path) -> io::Result<Written>;

/// A writer for each format.
pub(crate) const ALL: [Writer; 13] = [
    |folder| plain("NRRD, raw", &folder.join("a.nrrd"), nrrd("raw", SIDE).as_bytes()),
    |folder| plain("MetaImage, raw", &folder.join("a.mha"), meta_image(false).as_bytes()),
    |folder| plain("NumPy", &folder.join("a.npy"), &numpy()),
    |folder| plain("NIfTI", &folder.join("a.nii"), &nifti()),
    |folder| plain("MRC", &folder.join("a.mrc"), &mrc()),
    vti,
    tiff,
    zarr,
    dicom,
    |folder| zipped("NRRD, gzip", &folder.join("a.nrrd"), nrrd("gzip", SIDE).as_bytes()),
    nifti_gzip,
    zarr_zlib,
    meta_image_zlib,
];

/// Two bytes a sample: a ramp with noise in its last four bits, as of a scanner.
fn slice(z: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64 ^ (z as u64 + 1);
    let mut sample = |i: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((((i % SIDE + i / SIDE + z) as u16) & 0x07ff) | (state as u16 & 0xf)).to_le_bytes()
    };
    (0..SIDE * SIDE).flat_map(&mut sample).collect()
}

fn all(to: &mut impl Write) -> io::Result<()> {
    (0..SIDE).try_for_each(|z| to.write_all(&slice(z)))
}

fn plain(name: &'static str, path: &Path, header: &[u8]) -> io::Result<Written> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(header)?;
    all(&mut file)?;
    file.flush()?;
    Ok(Written { name, opened: path.to_owned(), is_gzip: false })
}

/// A plain header, and the samples by gzip behind it. What `zcat` is timed with is a file of these samples alone.
fn zipped(name: &'static str, path: &Path, header: &[u8]) -> io::Result<Written> {
    let mut file = File::create(path)?;
    file.write_all(header)?;
    let mut packed = GzEncoder::new(BufWriter::new(file), Compression::fast());
    all(&mut packed)?;
    packed.finish()?.flush()?;
    Ok(Written { name, opened: path.to_owned(), is_gzip: false })
}

fn nrrd(encoding: &str, slices: usize) -> String {
    format!(
        "NRRD0004\ntype: uint16\ndimension: 3\nsizes: {SIDE} {SIDE} {slices}\nendian: little\nencoding: {encoding}\n\n"
    )
}

fn meta_image(is_packed: bool) -> String {
    let packed = if is_packed { "True" } else { "False" };
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = {packed}\n\
         DimSize = {SIDE} {SIDE} {SIDE}\nElementType = MET_USHORT\nElementDataFile = LOCAL\n"
    )
}

fn meta_image_zlib(folder: &Path) -> io::Result<Written> {
    let path = folder.join("a.mha");
    let mut file = File::create(&path)?;
    file.write_all(meta_image(true).as_bytes())?;
    let mut packed = ZlibEncoder::new(BufWriter::new(file), Compression::fast());
    all(&mut packed)?;
    packed.finish()?.flush()?;
    Ok(Written { name: "MetaImage, zlib", opened: path, is_gzip: false })
}

fn numpy() -> Vec<u8> {
    let mut text =
        format!("{{'descr': '<u2', 'fortran_order': False, 'shape': ({SIDE}, {SIDE}, {SIDE}), }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.bytes());
    header
}

/// NIfTI-1 in one file, without a matrix.
fn nifti() -> Vec<u8> {
    let mut header = vec![0; 352];
    let mut at = |offset: usize, bytes: &[u8]| {
        header[offset..offset + bytes.len()].copy_from_slice(bytes);
    };
    at(0, &348_i32.to_le_bytes());
    for (i, size) in [3, SIDE as i16, SIDE as i16, SIDE as i16, 1, 1, 1, 1].iter().enumerate() {
        at(40 + 2 * i, &size.to_le_bytes());
    }
    at(70, &512_i16.to_le_bytes());
    at(72, &16_i16.to_le_bytes());
    for i in 0..4 {
        at(76 + 4 * i, &1_f32.to_le_bytes());
    }
    at(108, &352_f32.to_le_bytes());
    at(344, b"n+1\0");
    header
}

fn nifti_gzip(folder: &Path) -> io::Result<Written> {
    let path = folder.join("a.nii.gz");
    let mut packed = GzEncoder::new(BufWriter::new(File::create(&path)?), Compression::fast());
    packed.write_all(&nifti())?;
    all(&mut packed)?;
    packed.finish()?.flush()?;
    Ok(Written { name: "NIfTI, gzip", opened: path, is_gzip: true })
}

/// An MRC map of mode 6, unsigned 16 bits.
fn mrc() -> Vec<u8> {
    let mut header = vec![0; 1024];
    let mut at =
        |word: usize, bytes: [u8; 4]| header[4 * word..4 * word + 4].copy_from_slice(&bytes);
    for (i, size) in [SIDE as i32, SIDE as i32, SIDE as i32, 6].iter().enumerate() {
        at(i, size.to_le_bytes());
    }
    for i in 0..3 {
        at(7 + i, (SIDE as i32).to_le_bytes());
        at(10 + i, (SIDE as f32).to_le_bytes());
        at(13 + i, 90_f32.to_le_bytes());
        at(16 + i, (i as i32 + 1).to_le_bytes());
    }
    at(52, *b"MAP ");
    at(53, [0x44, 0x44, 0, 0]);
    header
}

fn vti(folder: &Path) -> io::Result<Written> {
    let path = folder.join("a.vti");
    let end = SIDE - 1;
    let mut file = BufWriter::new(File::create(&path)?);
    write!(
        file,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <ImageData WholeExtent=\"0 {end} 0 {end} 0 {end}\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n\
         <Piece Extent=\"0 {end} 0 {end} 0 {end}\"><PointData Scalars=\"v\">\n\
         <DataArray type=\"UInt16\" Name=\"v\" format=\"appended\" offset=\"0\"/>\n\
         </PointData></Piece></ImageData>\n<AppendedData encoding=\"raw\">\n_"
    )?;
    file.write_all(&(BYTES as u64).to_le_bytes())?;
    all(&mut file)?;
    file.write_all(b"\n</AppendedData></VTKFile>\n")?;
    file.flush()?;
    Ok(Written { name: "VTI, raw appended", opened: path, is_gzip: false })
}

fn tiff(folder: &Path) -> io::Result<Written> {
    let path = folder.join("a.tif");
    let failed = |e: ::tiff::TiffError| io::Error::other(e.to_string());
    let file = BufWriter::new(File::create(&path)?);
    let mut encoder = ::tiff::encoder::TiffEncoder::new(file).map_err(failed)?;
    for z in 0..SIDE {
        let samples: Vec<u16> =
            slice(z).chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        let page =
            encoder.new_image::<::tiff::encoder::colortype::Gray16>(SIDE as u32, SIDE as u32);
        page.and_then(|page| page.write_data(&samples)).map_err(failed)?;
    }
    Ok(Written { name: "TIFF", opened: path, is_gzip: false })
}

fn zarr(folder: &Path) -> io::Result<Written> {
    chunks(folder, "Zarr 2, plain", "null", |bytes| Ok(bytes.to_vec()))
}

fn zarr_zlib(folder: &Path) -> io::Result<Written> {
    chunks(folder, "Zarr 2, zlib", "{\"id\": \"zlib\", \"level\": 1}", |bytes| {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        packed.write_all(bytes)?;
        packed.finish()
    })
}

fn chunks(
    folder: &Path,
    name: &'static str,
    compressor: &str,
    pack: impl Fn(&[u8]) -> io::Result<Vec<u8>>,
) -> io::Result<Written> {
    let path = folder.join("a.zarr");
    fs::create_dir_all(&path)?;
    fs::write(
        path.join(".zarray"),
        format!(
            "{{\"zarr_format\": 2, \"shape\": [{SIDE}, {SIDE}, {SIDE}], \"chunks\": [{CHUNK}, {CHUNK}, {CHUNK}], \
             \"dtype\": \"<u2\", \"compressor\": {compressor}, \"fill_value\": 0, \"order\": \"C\", \"filters\": null}}"
        ),
    )?;
    for slab in 0..SIDE / CHUNK {
        let slices: Vec<Vec<u8>> = (0..CHUNK).map(|z| slice(slab * CHUNK + z)).collect();
        for (y, x) in (0..SIDE / CHUNK).flat_map(|y| (0..SIDE / CHUNK).map(move |x| (y, x))) {
            let rows = slices.iter().flat_map(|slice| {
                (0..CHUNK).flat_map(move |row| {
                    let begin = ((y * CHUNK + row) * SIDE + x * CHUNK) * 2;
                    slice[begin..begin + CHUNK * 2].iter().copied()
                })
            });
            fs::write(path.join(format!("{slab}.{y}.{x}")), pack(&rows.collect::<Vec<u8>>())?)?;
        }
    }
    Ok(Written { name, opened: path, is_gzip: false })
}

/// A series of plain slices.
fn dicom(folder: &Path) -> io::Result<Written> {
    let path = folder.join("series");
    fs::create_dir_all(&path)?;
    for z in 0..SIDE {
        let slice = Slice {
            series: "1.2.3",
            number: 1,
            description: "",
            z: z as f64,
            instance: z as u32,
            columns: SIDE as u16,
            rows: SIDE as u16,
            pixels: &slice(z),
        };
        fs::write(path.join(format!("{z:04}.dcm")), slice.file())?;
    }
    Ok(Written { name: "DICOM series", opened: path, is_gzip: false })
}

/// 2 GiB of zeros as NRRD: a file with a hole, which takes no room.
pub(crate) fn two_gigabytes(folder: &Path) -> io::Result<Written> {
    let path = folder.join("large.nrrd");
    let header = nrrd("raw", 4096);
    fs::write(&path, &header)?;
    let file = File::options().write(true).open(&path)?;
    file.set_len(header.len() as u64 + (2 << 30))?;
    Ok(Written { name: "2 GiB", opened: path, is_gzip: false })
}
