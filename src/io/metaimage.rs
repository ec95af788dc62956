//! MetaImage: `.mha` (header and data in one file) and `.mhd` (data beside it).

use std::collections::BTreeMap;
use std::io::{BufRead, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{DMat3, DVec3};

use super::axes::{self, Axes, Role};
use super::bytes::{self, DEFLATE_MOST, Endian, Inflate, Progress};
use super::error::{Problem, header, quoted, truncated, unsupported};
use super::files::{self, DataFile, Part, numbered};
use super::{Format, Opened};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Grid, Lattice, Samples, ScalarType};

/// A header beyond this is none.
const MOST_HEADER_BYTES: u64 = 16 << 20;
/// More data files than this are a mistake in the header.
const MOST_FILES: i64 = 1 << 16;

/// Keys that are understood, or known to describe nothing that a lattice needs; lower case.
const KNOWN: [&str; 32] = [
    "anatomicalorientation",
    "binarydata",
    "binarydatabyteordermsb",
    "centerofrotation",
    "comment",
    "compresseddata",
    "compresseddatasize",
    "dimsize",
    "elementbyteordermsb",
    "elementdatafile",
    "elementmax",
    "elementmin",
    "elementnumberofchannels",
    "elementsize",
    "elementspacing",
    "elementtype",
    "headersize",
    "id",
    "kinds",
    "modality",
    "name",
    "ndims",
    "objectsubtype",
    "objecttype",
    "offset",
    "orientation",
    "origin",
    "parentid",
    "position",
    "rotation",
    "transformmatrix",
    "transformtype",
];

/// Whether the first bytes are a MetaImage header: it has no magic, only its keys.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start).to_lowercase();
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let key = first.split_once('=').map_or("", |(key, _)| key.trim());
    KNOWN.contains(&key) && (text.contains("ndims") || text.contains("dimsize"))
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, len) = files::open_file(path)?;
    let keys = Keys::read(&mut files::buffered(file))?;
    let mut warnings = keys.ignored();

    if let Some(kind) = keys.get("objecttype").filter(|v| !v.eq_ignore_ascii_case("image")) {
        return Err(unsupported(
            "ObjectType = Image",
            quoted(kind),
            "export the object as an image",
        ));
    }
    let shape = Shape::of(&keys)?;
    let wide: Vec<u64> = shape.axes.sizes.iter().map(|&n| n as u64).collect();
    let count = bytes::checked_count("the volume", &wide, shape.scalar_type, free_bytes)?;
    if shape.axes.copies() {
        let twice = (count * shape.scalar_type.size_bytes()) as u64 * 2;
        memory::require("the volume and its copy by entries", twice, free_bytes)?;
    }
    let lattice = lattice(&keys, &shape, &mut warnings)?;
    let storage = Storage::of(&keys)?;
    let parts = parts(path, len, &keys, &shape, count)?;
    let samples = storage.read(&parts, count, shape.scalar_type, ticket, &mut warnings)?;
    if let (true, [part], Some(told)) =
        (storage.compressed, &parts[..], keys.get("compresseddatasize"))
    {
        // Some writers get it wrong; a reader that obeys drops the last slices without a word.
        let stored = part.file.len.saturating_sub(part.start);
        if told.parse() != Ok(stored) {
            warnings.push(format!(
                "CompressedDataSize is {}, but {stored} bytes are there: the compressed stream's own \
                 end is used",
                quoted(told)
            ));
        }
    }
    let fields = shape.axes.fields(&super::raw::stem(path), samples, ticket)?;
    warnings.extend(axes::several(&fields, "along the axes beyond the third"));
    let orientation = keys.get("anatomicalorientation").filter(|v| !v.contains('?'));
    let space = orientation.map(|told| match space_of(told, &lattice.direction) {
        Some(space) => space,
        None => {
            warnings.push(format!(
                "AnatomicalOrientation is {}, which does not name one end of each axis: it is ignored",
                quoted(told)
            ));
            format!("AnatomicalOrientation {told}")
        }
    });
    // The format's lengths are in millimetres.
    let grid = Grid { space, unit: Some("mm".to_owned()), ..Grid::of(lattice, fields) };
    Ok(Opened::of(grid, Format::MetaImage, warnings))
}

/// The header's keys, lower case, and where it ends.
struct Keys {
    /// Key as written, and value.
    values: BTreeMap<String, (String, String)>,
    /// Key as written, for those that are not known.
    unknown: Vec<String>,
    listed_files: Vec<String>,
    len: u64,
}

impl Keys {
    fn read(reader: &mut dyn BufRead) -> Result<Self, Problem> {
        let mut keys =
            Self { values: BTreeMap::new(), unknown: Vec::new(), listed_files: Vec::new(), len: 0 };
        while let Some(line) = keys.line(reader)? {
            if line.trim().is_empty() {
                continue;
            }
            let Some((key, value)) = line.split_once('=') else {
                return Err(header(
                    "header lines of the form \"Key = Value\" up to ElementDataFile",
                    quoted(&line),
                    "correct the line",
                ));
            };
            let (written, value) = (key.trim(), value.trim());
            let key = written.to_lowercase();
            if !KNOWN.contains(&key.as_str()) {
                keys.unknown.push(written.to_owned());
            }
            let is_last = key == "elementdatafile";
            let is_list = is_last && is_list(value);
            keys.values.insert(key, (written.to_owned(), value.to_owned()));
            if is_list {
                while let Some(name) = keys.line(reader)? {
                    if !name.trim().is_empty() {
                        keys.listed_files.push(name.trim().to_owned());
                    }
                }
            }
            if is_last {
                return Ok(keys);
            }
        }
        Err(truncated(
            "a header that ends with ElementDataFile",
            "none",
            "the header was cut short: copy the file again",
        ))
    }

    fn line(&mut self, reader: &mut dyn BufRead) -> Result<Option<String>, Problem> {
        let mut bytes = Vec::new();
        let left = MOST_HEADER_BYTES.saturating_sub(self.len);
        reader.take(left).read_until(b'\n', &mut bytes).map_err(Problem::Io)?;
        self.len += bytes.len() as u64;
        if self.len >= MOST_HEADER_BYTES {
            return Err(header(
                "a header of at most 16 MB that ends with ElementDataFile",
                "more",
                "check that the file is a MetaImage",
            ));
        }
        Ok((!bytes.is_empty()).then(|| String::from_utf8_lossy(&bytes).trim_end().to_owned()))
    }

    fn ignored(&self) -> Vec<String> {
        const SHOWN: usize = 3;
        let Some(first) = self.unknown.get(..self.unknown.len().min(SHOWN)) else {
            return Vec::new();
        };
        if first.is_empty() {
            return Vec::new();
        }
        let more = if self.unknown.len() > SHOWN { ", …" } else { "" };
        let names = quoted(&first.join(", "));
        vec![format!("{} unknown header keys are ignored ({names}{more})", self.unknown.len())]
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(|(_, value)| value.as_str())
    }

    /// The first of several keys that mean the same, as written, and its value.
    fn any(&self, keys: &[&str]) -> Option<(&str, &str)> {
        let found = keys.iter().find_map(|key| self.values.get(*key));
        found.map(|(written, value)| (written.as_str(), value.as_str()))
    }

    fn require(&self, key: &str, written: &str) -> Result<&str, Problem> {
        self.get(key).ok_or_else(|| {
            truncated(
                format!("the key {written} in the header"),
                "none",
                "the header was never complete: add the key",
            )
        })
    }

    fn truth(&self, keys: &[&str]) -> Result<bool, Problem> {
        let Some((written, value)) = self.any(keys) else { return Ok(false) };
        match value.to_lowercase().as_str() {
            "false" | "0" | "f" | "no" => Ok(false),
            "true" | "1" | "t" | "yes" => Ok(true),
            _ => Err(header(
                format!("True or False for {written}"),
                quoted(value),
                "correct the key",
            )),
        }
    }

    /// At least `count` numbers; more, as some programs write for flat images, are dropped aloud.
    fn numbers(
        &self,
        keys: &[&str],
        count: usize,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Vec<f64>>, Problem> {
        let Some((key, value)) = self.any(keys) else { return Ok(None) };
        let parsed: Option<Vec<f64>> =
            value.split_whitespace().map(|word| word.parse().ok()).collect();
        let mut numbers = parsed.filter(|numbers| numbers.len() >= count).ok_or_else(|| {
            header(format!("{count} numbers for {key}"), quoted(value), "correct the key")
        })?;
        if numbers.len() > count {
            warnings.push(format!("{key} has {} numbers, {count} are used", numbers.len()));
            numbers.truncate(count);
        }
        Ok(Some(numbers))
    }
}

/// The array: its axes and the type of its numbers.
struct Shape {
    axes: Axes,
    /// Axes of the file, without the channels.
    file_dims: Vec<usize>,
    channels: usize,
    scalar_type: ScalarType,
}

impl Shape {
    fn of(keys: &Keys) -> Result<Self, Problem> {
        const MOST_AXES: usize = 10;
        let whole = |key: &str, written: &str| {
            let value = keys.require(key, written)?;
            let sizes: Option<Vec<usize>> =
                value.split_whitespace().map(|word| word.parse().ok().filter(|&n| n > 0)).collect();
            sizes.ok_or_else(|| {
                header(
                    format!("whole numbers of at least 1 for {written}"),
                    quoted(value),
                    "correct the key",
                )
            })
        };
        let file_dims = whole("dimsize", "DimSize")?;
        let ndims = whole("ndims", "NDims")?;
        if ndims != [file_dims.len()] || file_dims.len() > MOST_AXES {
            return Err(header(
                format!("NDims to say how many sizes DimSize has, up to {MOST_AXES}"),
                format!("NDims = {ndims:?} and DimSize = {file_dims:?}"),
                "correct the two keys",
            ));
        }
        let channels = match keys.get("elementnumberofchannels") {
            None => 1,
            Some(_) => match whole("elementnumberofchannels", "ElementNumberOfChannels")?[..] {
                [channels] => channels,
                _ => {
                    return Err(header(
                        "one number for ElementNumberOfChannels",
                        "several",
                        "correct the key",
                    ));
                }
            },
        };
        let scalar_type = scalar_type(keys.require("elementtype", "ElementType")?)?;
        let sizes = std::iter::once(channels).chain(file_dims.iter().copied()).collect();
        let roles = std::iter::once(Role::Component)
            .chain(
                (0..file_dims.len()).map(|axis| if axis < 3 { Role::Domain } else { Role::List }),
            )
            .collect();
        Ok(Self { axes: Axes { sizes, roles, backwards: false }, file_dims, channels, scalar_type })
    }
}

fn scalar_type(name: &str) -> Result<ScalarType, Problem> {
    let upper = name.to_uppercase();
    Ok(match upper.strip_suffix("_ARRAY").unwrap_or(&upper) {
        "MET_CHAR" => ScalarType::Int8,
        "MET_UCHAR" => ScalarType::UInt8,
        "MET_SHORT" => ScalarType::Int16,
        "MET_USHORT" => ScalarType::UInt16,
        // MET_LONG has four bytes in files, whatever the writer's `long` was.
        "MET_INT" | "MET_LONG" => ScalarType::Int32,
        "MET_UINT" | "MET_ULONG" => ScalarType::UInt32,
        "MET_LONG_LONG" => ScalarType::Int64,
        "MET_ULONG_LONG" => ScalarType::UInt64,
        "MET_FLOAT" => ScalarType::Float32,
        "MET_DOUBLE" => ScalarType::Float64,
        _ => {
            return Err(unsupported(
                "a numeric ElementType such as MET_UCHAR, MET_SHORT or MET_FLOAT",
                quoted(name),
                "convert the file to one of these types",
            ));
        }
    })
}

fn lattice(keys: &Keys, shape: &Shape, warnings: &mut Vec<String>) -> Result<Lattice, Problem> {
    let n = shape.file_dims.len();
    let spatial = n.min(3);
    let spacings = keys.numbers(&["elementspacing", "elementsize"], n, warnings)?;
    let mut spacing = DVec3::ONE;
    for (axis, value) in spacings.iter().flatten().take(spatial).enumerate() {
        spacing[axis] = *value;
    }
    let mut origin = DVec3::ZERO;
    let position = keys.numbers(&["offset", "position", "origin"], n, warnings)?;
    for (axis, value) in position.iter().flatten().take(spatial).enumerate() {
        origin[axis] = *value;
    }
    // The file lists the x axis' direction first, then y's: one after another, our columns.
    let mut direction = DMat3::IDENTITY;
    let matrix = keys.numbers(&["transformmatrix", "rotation", "orientation"], n * n, warnings)?;
    if let Some(matrix) = matrix {
        for axis in 0..spatial {
            for row in 0..spatial {
                direction.col_mut(axis)[row] = matrix[axis * n + row];
            }
        }
        let mixes =
            |axis: usize, row: usize| (axis < 3) != (row < 3) && matrix[axis * n + row] != 0.0;
        if (0..n).any(|axis| (0..n).any(|row| mixes(axis, row))) {
            warnings.push(
                "TransformMatrix mixes space with the axes beyond the third: that part is ignored"
                    .into(),
            );
        }
    }
    let dims = shape.axes.dims();
    Ok(axes::lattice_of_spacing(dims, origin, spacing, direction, warnings))
}

/// What the world's axes point to, by what `AnatomicalOrientation` says of the file's, a letter each.
///
/// Letters are where an axis comes from, as ITK writes them (RAI: from the right to the left, from the front to the back,
/// upwards), or where it goes to, as MetaIO's own manual has it. One is the opposite of the other: of the two that holds
/// in which the world's axis points to the head, rather than to the feet.
fn space_of(told: &str, direction: &DMat3) -> Option<String> {
    let letters: Vec<char> = told.trim().to_ascii_uppercase().chars().collect();
    let mut towards = [None; 3];
    for (axis, letter) in letters.iter().enumerate() {
        let [to, from] = match letter {
            'R' => ["left", "right"],
            'L' => ["right", "left"],
            'A' => ["posterior", "anterior"],
            'P' => ["anterior", "posterior"],
            'I' => ["superior", "inferior"],
            'S' => ["inferior", "superior"],
            _ => return None,
        };
        let column = direction.col(axis.min(2));
        // The world's axis that it runs along most.
        let along = if axis < 3 { column.abs().max_position() } else { return None };
        towards[along] = Some(if column[along] < 0.0 { from } else { to });
    }
    let [Some(x), Some(y), Some(z)] = towards else { return None };
    let [x, y, z] =
        if [x, y, z].contains(&"inferior") { [x, y, z].map(opposite) } else { [x, y, z] };
    let ends = [["left", "right"], ["anterior", "posterior"], ["superior", "inferior"]];
    let is_whole = ends.iter().all(|ends| [x, y, z].iter().any(|end| ends.contains(end)));
    is_whole.then(|| format!("{x}-{y}-{z}"))
}

fn opposite(end: &'static str) -> &'static str {
    match end {
        "left" => "right",
        "right" => "left",
        "anterior" => "posterior",
        "posterior" => "anterior",
        "superior" => "inferior",
        _ => "superior",
    }
}

fn is_list(value: &str) -> bool {
    value.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("list"))
}

fn parts(
    path: &Path,
    len: u64,
    keys: &Keys,
    shape: &Shape,
    count: usize,
) -> Result<Vec<Part>, Problem> {
    let value = keys.require("elementdatafile", "ElementDataFile")?;
    if value.eq_ignore_ascii_case("local") {
        let file = DataFile { path: path.to_owned(), len };
        return Ok(vec![Part { file, start: keys.len, count }]);
    }
    let n = shape.file_dims.len();
    let words: Vec<&str> = value.split_whitespace().collect();
    let (names, file_axes) = if is_list(value) {
        let axes = words.get(1).map(|word| word.trim_end_matches(['D', 'd']).parse::<usize>());
        match axes {
            None => (keys.listed_files.clone(), n - 1),
            Some(Ok(axes)) if (1..=n).contains(&axes) => (keys.listed_files.clone(), axes),
            Some(_) => return Err(bad_data_file(value)),
        }
    } else if value.contains('%') && words.len() >= 3 {
        (expand(value, &words)?, n - 1)
    } else {
        let file = DataFile::find(path, value)?;
        return Ok(vec![Part { file, start: 0, count }]);
    };
    let each = shape.file_dims[..file_axes].iter().product::<usize>() * shape.channels;
    if count / each != names.len() {
        return Err(header(
            format!("{} data files for DimSize = {:?}", count / each, shape.file_dims),
            names.len().to_string(),
            "correct ElementDataFile",
        ));
    }
    names
        .iter()
        .map(|name| Ok(Part { file: DataFile::find(path, name)?, start: 0, count: each }))
        .collect()
}

fn bad_data_file(value: &str) -> Problem {
    header(
        "ElementDataFile = LOCAL, a name, \"LIST [axes]\" or \"PATTERN MIN MAX [STEP]\"",
        quoted(value),
        "correct the key",
    )
}

fn expand(value: &str, words: &[&str]) -> Result<Vec<String>, Problem> {
    let at = words.iter().position(|word| word.contains('%')).unwrap_or(0);
    let numbers: Option<Vec<i64>> = words[at + 1..].iter().map(|word| word.parse().ok()).collect();
    let (min, max, step) = match numbers.as_deref() {
        Some([min, max]) => (*min, *max, 1),
        Some([min, max, step]) if *step > 0 => (*min, *max, *step),
        _ => return Err(bad_data_file(value)),
    };
    let steps = max.checked_sub(min).filter(|span| *span >= 0).map(|span| span / step);
    let steps = steps.filter(|&n| n < MOST_FILES).ok_or_else(|| bad_data_file(value))?;
    let pattern = words[..=at].join(" ");
    (0..=steps)
        .map(|i| numbered(&pattern, min + i * step).ok_or_else(|| bad_data_file(value)))
        .collect()
}

/// How the samples are stored.
struct Storage {
    compressed: bool,
    text: bool,
    endian: Endian,
    /// Bytes before the samples; `None`: the samples are the last bytes.
    skip: Option<u64>,
}

impl Storage {
    fn of(keys: &Keys) -> Result<Self, Problem> {
        let big = keys.truth(&["binarydatabyteordermsb", "elementbyteordermsb"])?;
        let skip = match keys.get("headersize").map(|v| (v, v.parse::<i64>())) {
            None => Some(0),
            Some((_, Ok(-1))) => None,
            Some((_, Ok(n))) if n >= 0 => Some(n.unsigned_abs()),
            Some((value, _)) => {
                return Err(header(
                    "HeaderSize of 0 or more, or -1",
                    quoted(value),
                    "correct the key",
                ));
            }
        };
        Ok(Self {
            compressed: keys.truth(&["compresseddata"])?,
            text: keys.get("binarydata").is_some() && !keys.truth(&["binarydata"])?,
            endian: if big { Endian::Big } else { Endian::Little },
            skip,
        })
    }

    fn read(
        &self,
        parts: &[Part],
        count: usize,
        scalar_type: ScalarType,
        ticket: &Ticket,
        warnings: &mut Vec<String>,
    ) -> Result<Samples, Problem> {
        let size = scalar_type.size_bytes();
        for part in parts {
            let stored = (part.file.len.saturating_sub(part.start))
                .saturating_sub(self.skip.unwrap_or_default());
            let needed = (part.count * size) as u64;
            match (self.compressed, self.text) {
                (true, _) => bytes::require_stored(needed, stored.saturating_mul(DEFLATE_MOST)),
                (false, true) => bytes::require_stored(part.count as u64, stored.div_ceil(2)),
                (false, false) => bytes::require_stored(needed, stored),
            }?;
        }
        let wanted = (scalar_type, count, !self.compressed && !self.text);
        let mut samples =
            bytes::of_parts(parts, wanted, ticket, warnings, |part, samples, progress| {
                self.read_part(part, samples, progress)
            })?;
        if !self.text {
            bytes::to_native(&mut samples, self.endian);
        }
        Ok(samples)
    }

    /// Appends one file's samples; whether more bytes follow them.
    fn read_part(
        &self,
        part: &Part,
        samples: &mut Samples,
        progress: &mut Progress<'_>,
    ) -> Result<bool, Problem> {
        let mut reader = part.file.open()?;
        let needed = (part.count * samples.scalar_type().size_bytes()) as u64;
        let start = match self.skip {
            Some(skip) => part.start.saturating_add(skip),
            None if self.compressed || self.text => {
                return Err(header(
                    "plain binary samples where HeaderSize is -1",
                    "compressed or written ones",
                    "give the number of bytes to skip",
                ));
            }
            None => part.file.len.saturating_sub(needed),
        };
        reader.seek(SeekFrom::Start(start)).map_err(Problem::Io)?;
        if self.compressed {
            let mut reader = Inflate::zlib(reader).map_err(Problem::Io)?;
            bytes::append(samples, &mut reader, part.count, progress)?;
            reader.finish()
        } else if self.text {
            bytes::append_text(samples, &mut reader, part.count, progress)?;
            Ok(false)
        } else {
            bytes::append(samples, &mut reader, part.count, progress)?;
            Ok(bytes::rest(&mut reader)? > 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_known_by_their_first_key() {
        assert!(looks_like_it(b"ObjectType = Image\nNDims = 3\n"));
        assert!(looks_like_it(b"\r\nNDims=2\r\n"));
        assert!(!looks_like_it(b"key = value\nNDims = 3\n"));
        assert!(!looks_like_it(b""));
    }

    #[test]
    fn an_anatomical_orientation_says_what_the_axes_of_the_world_point_to() {
        let flipped = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let coronal = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
        for (told, direction, expected) in [
            ("RAI", DMat3::IDENTITY, "left-posterior-superior"),
            ("RPS", flipped, "left-posterior-superior"),
            ("RSA", coronal, "left-posterior-superior"),
            ("LPI", DMat3::IDENTITY, "right-anterior-superior"),
            ("RAS", DMat3::IDENTITY, "right-anterior-superior"),
        ] {
            assert_eq!(space_of(told, &direction).as_deref(), Some(expected), "{told}");
        }
        for nonsense in ["", "RA", "RAIX", "RLI", "RRA", "xyz"] {
            assert_eq!(space_of(nonsense, &DMat3::IDENTITY), None, "{nonsense}");
        }
    }

    #[test]
    fn patterns_name_every_file_in_turn() {
        let names = |value: &str| expand(value, &value.split_whitespace().collect::<Vec<_>>());
        assert_eq!(names("s%02d.raw 8 10").unwrap(), ["s08.raw", "s09.raw", "s10.raw"]);
        assert_eq!(names("s%d.raw 1 5 3").unwrap(), ["s1.raw", "s4.raw"]);
        for bad in ["s%d 5 1 1", "s%d 1 5 0", "s%d 0 9999999999 1", "s%d a b c"] {
            assert!(names(bad).is_err(), "{bad}");
        }
    }
}
