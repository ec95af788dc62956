//! Small valid files of every format, written plainly and apart from the readers.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use voxsplat::volume::ScalarType;

/// What is written.
#[derive(Debug, Clone)]
pub(crate) struct Volume {
    pub(crate) dims: [usize; 3],
    pub(crate) scalar_type: ScalarType,
    pub(crate) components: usize,
    /// Little-endian, components interleaved, x fastest.
    pub(crate) bytes: Vec<u8>,
    pub(crate) spacing: [f64; 3],
    pub(crate) origin: [f64; 3],
    /// x's direction, then y's, then z's.
    pub(crate) direction: [f64; 9],
}

impl Volume {
    /// Values from a seed; floats are finite so that text can hold them exactly.
    pub(crate) fn new(
        dims: [usize; 3],
        scalar_type: ScalarType,
        components: usize,
        seed: u64,
    ) -> Self {
        let mut state = seed | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let count = dims.iter().product::<usize>() * components;
        let size = scalar_type.size_bytes();
        let mut bytes = Vec::with_capacity(count * size);
        for _ in 0..count {
            let value = next();
            match scalar_type {
                ScalarType::Float32 => {
                    let float = (value % 2_000_003) as f32 / 7.0 - 1000.0;
                    bytes.extend(float.to_le_bytes());
                }
                ScalarType::Float64 => {
                    let float = (value % 2_000_000_011) as f64 / 7.0 - 1000.0;
                    bytes.extend(float.to_le_bytes());
                }
                _ => bytes.extend(&value.to_le_bytes()[..size]),
            }
        }
        Self {
            dims,
            scalar_type,
            components,
            bytes,
            spacing: [0.5, 2.0, 1.25],
            origin: [-3.0, 1e7, 0.125],
            // A turn of 90° and a reflection.
            direction: [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0],
        }
    }

    pub(crate) fn stored(&self, big: bool) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        if big {
            bytes.chunks_exact_mut(self.scalar_type.size_bytes()).for_each(<[u8]>::reverse);
        }
        bytes
    }

    /// The numbers in decimal.
    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        for bytes in self.bytes.chunks_exact(self.scalar_type.size_bytes()) {
            macro_rules! number {
                ($t:ty) => {
                    <$t>::from_le_bytes(bytes.try_into().expect("one number")).to_string()
                };
            }
            let number = match self.scalar_type {
                ScalarType::UInt8 => number!(u8),
                ScalarType::Int8 => number!(i8),
                ScalarType::UInt16 => number!(u16),
                ScalarType::Int16 => number!(i16),
                ScalarType::UInt32 => number!(u32),
                ScalarType::Int32 => number!(i32),
                ScalarType::UInt64 => number!(u64),
                ScalarType::Int64 => number!(i64),
                ScalarType::Float32 => number!(f32),
                ScalarType::Float64 => number!(f64),
            };
            text += &number;
            text.push(if text.len().is_multiple_of(5) { '\n' } else { ' ' });
        }
        text
    }

    /// Slices `first..last` along z, of the bytes.
    fn slab(&self, first: usize, last: usize) -> Self {
        let slice = self.bytes.len() / self.dims[2];
        let [x, y, _] = self.dims;
        Self {
            dims: [x, y, last - first],
            bytes: self.bytes[first * slice..last * slice].to_vec(),
            ..self.clone()
        }
    }
}

pub(crate) fn save(path: PathBuf, parts: &[&[u8]]) -> PathBuf {
    std::fs::write(&path, parts.concat()).expect("the temporary folder is ours");
    path
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}

fn bzip2(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
    encoder.write_all(bytes).expect("memory takes all");
    encoder.finish().expect("memory takes all")
}

pub(crate) const NRRD_ENCODINGS: [&str; 5] = ["raw", "gzip", "bzip2", "txt", "hex"];

pub(crate) fn nrrd(
    folder: &Path,
    volume: &Volume,
    encoding: &str,
    big: bool,
    detached: bool,
) -> PathBuf {
    let word = match volume.scalar_type {
        ScalarType::UInt8 => "uchar",
        ScalarType::Int8 => "signed char",
        ScalarType::UInt16 => "unsigned short int",
        ScalarType::Int16 => "short",
        ScalarType::UInt32 => "uint",
        ScalarType::Int32 => "signed int",
        ScalarType::UInt64 => "unsigned long long",
        ScalarType::Int64 => "int64_t",
        ScalarType::Float32 => "float",
        ScalarType::Float64 => "double",
    };
    let [x, y, z] = volume.dims;
    let vector = |v: [f64; 3]| format!("({},{},{})", v[0], v[1], v[2]);
    let d = volume.direction;
    let step = |axis: usize| vector([0, 1, 2].map(|row| d[axis * 3 + row] * volume.spacing[axis]));
    let steps = format!("{} {} {}", step(0), step(1), step(2));
    let (more, none, kinds) = match volume.components {
        1 => (String::new(), "", "domain domain domain"),
        n => (format!("{n} "), "none ", "vector domain domain domain"),
    };
    let mut header = format!(
        "NRRD0005\n# written by a test\ntype: {word}\ndimension: {}\nsizes: {more}{x} {y} {z}\n\
         space: left-posterior-superior\nspace directions: {none}{steps}\nkinds: {kinds}\n\
         endian: {}\nencoding: {encoding}\nspace origin: {}\nkey:=value\n",
        if volume.components == 1 { 3 } else { 4 },
        if big { "big" } else { "little" },
        vector(volume.origin),
    );
    let stored = volume.stored(big);
    let data = match encoding {
        "gzip" => gzip(&stored),
        "bzip2" => bzip2(&stored),
        "txt" => volume.text().into_bytes(),
        "hex" => stored.iter().map(|b| format!("{b:02x}")).collect::<String>().into_bytes(),
        _ => stored,
    };
    if detached {
        save(folder.join("v.data"), &[&data]);
        header += "data file: v.data\n";
        return save(folder.join("v.nhdr"), &[header.as_bytes()]);
    }
    save(folder.join("v.nrrd"), &[header.as_bytes(), b"\n", &data])
}

/// How a MetaImage is stored.
pub(crate) const META_STORAGES: [&str; 3] = ["binary", "compressed", "text"];

pub(crate) fn metaimage(
    folder: &Path,
    volume: &Volume,
    storage: &str,
    big: bool,
    detached: bool,
) -> PathBuf {
    let word = match volume.scalar_type {
        ScalarType::UInt8 => "MET_UCHAR",
        ScalarType::Int8 => "MET_CHAR",
        ScalarType::UInt16 => "MET_USHORT",
        ScalarType::Int16 => "MET_SHORT",
        ScalarType::UInt32 => "MET_UINT",
        ScalarType::Int32 => "MET_INT",
        ScalarType::UInt64 => "MET_ULONG_LONG",
        ScalarType::Int64 => "MET_LONG_LONG",
        ScalarType::Float32 => "MET_FLOAT",
        ScalarType::Float64 => "MET_DOUBLE",
    };
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let stored = volume.stored(big);
    let data = match storage {
        "compressed" => zlib(&stored),
        "text" => volume.text().into_bytes(),
        _ => stored,
    };
    let [x, y, z] = volume.dims;
    let header = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = {}\nBinaryDataByteOrderMSB = {}\n\
         CompressedData = {}\nTransformMatrix = {}\nOffset = {}\nElementSpacing = {}\n\
         DimSize = {x} {y} {z}\nElementNumberOfChannels = {}\nElementType = {word}\n\
         ElementDataFile = {}\n",
        if storage == "text" { "False" } else { "True" },
        if big { "True" } else { "False" },
        if storage == "compressed" { "True" } else { "False" },
        list(&volume.direction),
        list(&volume.origin),
        list(&volume.spacing),
        volume.components,
        if detached { "v.data" } else { "LOCAL" },
    );
    if detached {
        save(folder.join("v.data"), &[&data]);
        return save(folder.join("v.mhd"), &[header.as_bytes()]);
    }
    save(folder.join("v.mha"), &[header.as_bytes(), &data])
}

/// How VTK's XML is stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vti {
    /// Images, rectilinear or structured grids, by their elements' names.
    pub(crate) kind: &'static str,
    /// `ascii`, `binary`, `raw` or `base64` (the latter two appended).
    pub(crate) format: &'static str,
    pub(crate) compressed: bool,
    pub(crate) wide: bool,
    pub(crate) big: bool,
    /// Two pieces that share a layer of points, where z allows it.
    pub(crate) split: bool,
    pub(crate) cells: bool,
}

pub(crate) const VTI_FORMATS: [&str; 4] = ["ascii", "binary", "raw", "base64"];

pub(crate) const VTI_KINDS: [&str; 3] = ["ImageData", "RectilinearGrid", "StructuredGrid"];

/// A coordinate of the grids that are not evenly spaced, with 32 bits to spare in none.
pub(crate) fn coordinate(axis: usize, index: usize) -> f64 {
    let i = index as f64;
    [0.5 + i * i, -3.0 * i, 0.125 * i * (i + 4.0) - 1e3][axis]
}

/// A point of the curvilinear grid.
pub(crate) fn point([i, j, k]: [usize; 3]) -> [f64; 3] {
    [i as f64 + 0.25 * k as f64, (j + i * k) as f64, (3 * k) as f64 - 0.5 * j as f64]
}

/// Numbers of a type that are no samples but places.
fn places(values: &[f64], components: usize) -> Volume {
    Volume {
        dims: [values.len() / components, 1, 1],
        scalar_type: ScalarType::Float64,
        components,
        bytes: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        ..Volume::new([1; 3], ScalarType::UInt8, 1, 1)
    }
}

/// One `DataArray`, with its numbers or the place of these behind `appended`.
fn data_array(volume: &Volume, name: &str, how: Vti, appended: &mut Vec<u8>) -> String {
    let word = volume.scalar_type.name().replace("uint", "UInt").replace("int", "Int");
    let word = word.replace("float", "Float");
    let data = packed(volume, how);
    let (place, text) = match how.format {
        "ascii" => ("format=\"ascii\"".to_owned(), volume.text()),
        "binary" => ("format=\"binary\"".to_owned(), encoded(&data)),
        _ => (format!("format=\"appended\" offset=\"{}\"", appended.len()), String::new()),
    };
    match how.format {
        "raw" => appended.extend(data.concat()),
        "base64" => appended.extend(encoded(&data).into_bytes()),
        _ => {}
    }
    format!(
        "<DataArray type=\"{word}\" Name=\"{name}\" NumberOfComponents=\"{}\" {place}>\n\
         <InformationKey name=\"k\">7 7</InformationKey>{text}</DataArray>\n",
        volume.components
    )
}

/// What places the points from `first` to `last` along x, y, z.
fn geometry(first: [usize; 3], last: [usize; 3], how: Vti, appended: &mut Vec<u8>) -> String {
    match how.kind {
        "RectilinearGrid" => {
            let list = |axis: usize| {
                let values: Vec<f64> =
                    (first[axis]..=last[axis]).map(|i| coordinate(axis, i)).collect();
                places(&values, 1)
            };
            let mut arrays = String::new();
            for axis in 0..3 {
                arrays += &data_array(&list(axis), &format!("c{axis}"), how, appended);
            }
            format!("<Coordinates>\n{arrays}</Coordinates>\n")
        }
        "StructuredGrid" => {
            let mut values = Vec::new();
            for k in first[2]..=last[2] {
                for j in first[1]..=last[1] {
                    for i in first[0]..=last[0] {
                        values.extend(point([i, j, k]));
                    }
                }
            }
            let array = data_array(&places(&values, 3), "Points", how, appended);
            format!("<Points>\n{array}</Points>\n")
        }
        _ => String::new(),
    }
}

pub(crate) fn vti(folder: &Path, volume: &Volume, how: Vti) -> PathBuf {
    let [x, y, z] = volume.dims;
    // Cells are one fewer than points.
    let extra = usize::from(how.cells);
    let last = |n: usize| n - 1 + extra;
    let cut = z / 2;
    let slabs: Vec<(usize, usize)> = match how.split && z >= 4 {
        true if how.cells => vec![(0, cut), (cut, z)],
        true => vec![(0, cut + 1), (cut, z)],
        false => vec![(0, z)],
    };
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let d = volume.direction;
    let rows = [d[0], d[3], d[6], d[1], d[4], d[7], d[2], d[5], d[8]];
    let kind = how.kind;
    let mut xml = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" \
         byte_order=\"{}Endian\" header_type=\"UInt{}\"{}>\n<{kind} WholeExtent=\"0 {} 0 {} 0 \
         {}\" Origin=\"{}\" Spacing=\"{}\" Direction=\"{}\">\n",
        if how.big { "Big" } else { "Little" },
        if how.wide { 64 } else { 32 },
        if how.compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" },
        last(x),
        last(y),
        last(z),
        list(&volume.origin),
        list(&volume.spacing),
        list(&rows),
    );
    let mut appended = Vec::new();
    for (first, end) in slabs {
        let slab = volume.slab(first, end);
        let section = if how.cells { "CellData" } else { "PointData" };
        let z_last = end - 1 + extra;
        let array = data_array(&slab, "a &amp; b", how, &mut appended);
        let places = geometry([0, 0, first], [last(x), last(y), z_last], how, &mut appended);
        write!(
            xml,
            "<Piece Extent=\"0 {} 0 {} {first} {z_last}\"><{section} Scalars=\"a &amp; b\">\n\
             {array}</{section}>\n{places}</Piece>\n",
            last(x),
            last(y),
        )
        .expect("a string takes all");
    }
    xml += &format!("</{kind}>\n");
    let name = format!(
        "v.{}",
        match kind {
            "ImageData" => "vti",
            "RectilinearGrid" => "vtr",
            _ => "vts",
        }
    );
    if matches!(how.format, "raw" | "base64") {
        xml += &format!("<AppendedData encoding=\"{}\">\n _", how.format);
        let tail = b"\n</AppendedData>\n</VTKFile>\n";
        return save(folder.join(name), &[xml.as_bytes(), &appended, tail]);
    }
    save(folder.join(name), &[xml.as_bytes(), b"</VTKFile>\n"])
}

/// Header and data of one array, as two units of base64 need them.
fn packed(volume: &Volume, how: Vti) -> Vec<Vec<u8>> {
    let word = |n: usize| {
        let wide = (n as u64).to_le_bytes();
        let mut bytes = wide[..if how.wide { 8 } else { 4 }].to_vec();
        if how.big {
            bytes.reverse();
        }
        bytes
    };
    let stored = volume.stored(how.big);
    if !how.compressed {
        return vec![[word(stored.len()), stored].concat()];
    }
    // A block size that no sample size divides.
    const BLOCK: usize = 37;
    let blocks: Vec<Vec<u8>> = stored.chunks(BLOCK).map(zlib).collect();
    let mut header = [word(blocks.len()), word(BLOCK), word(stored.len() % BLOCK)].concat();
    header.extend(blocks.iter().flat_map(|block| word(block.len())));
    vec![header, blocks.concat()]
}

fn encoded(units: &[Vec<u8>]) -> String {
    units.iter().map(|unit| STANDARD.encode(unit)).collect()
}

pub(crate) fn raw(folder: &Path, volume: &Volume, big: bool, skip: usize) -> PathBuf {
    save(folder.join("v.raw"), &[&vec![9; skip], &volume.stored(big)])
}
