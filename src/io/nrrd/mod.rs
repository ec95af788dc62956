//! NRRD, versions 1 to 5: header and data in one file or in several.

mod header;
mod parts;
mod write;

pub(super) use write::bytes;

use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::DVec3;

use self::header::{Header, wrong_count};
use super::axes::{self, Axes, Role};
use super::bytes::{self, DEFLATE_MOST, Endian, Inflate, Progress};
use super::error::{Problem, header, plain, quoted, unsupported};
use super::files::{self, Part};
use super::{Format, Opened};
use crate::core::progress::Ticket;
use crate::core::{Srgb8, memory};
use crate::volume::{Grid, LabelName, Lattice, Samples, ScalarType, length_unit};

/// How the samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Raw,
    Text,
    Hex,
    Gzip,
    Bzip2,
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let (file, _) = files::open_file(path)?;
    let mut header = Header::read(&mut files::buffered(file))?;
    let mut warnings = std::mem::take(&mut header.warnings);

    let sizes = sizes(&header)?;
    let scalar_type = scalar_type(header.require("type")?)?;
    let encoding = encoding(header.require("encoding")?)?;
    let wide: Vec<u64> = sizes.iter().map(|&n| n as u64).collect();
    let count = bytes::checked_count("the volume", &wide, scalar_type, free_bytes)?;
    let endian = endian(&header, scalar_type, encoding, &mut warnings)?;
    let geometry = Geometry::of(&header, &sizes, &mut warnings)?;
    let axes = Axes { sizes, roles: geometry.roles.clone(), backwards: false };
    if axes.copies() {
        let twice = (count * scalar_type.size_bytes()) as u64 * 2;
        memory::require("the volume and its reordered copy", twice, free_bytes)?;
    }
    let lattice = geometry.lattice(&header, &axes, &mut warnings)?;
    if header.get("measurementframe").is_some() && axes.roles.contains(&Role::Component) {
        warnings.push("the measurement frame is ignored: components stay as stored".into());
    }

    let parts = parts::parts(path, &header, &axes.sizes)?;
    let loading = Loading { encoding, scalar_type, skips: Skips::of(&header)? };
    let samples = loading.read(&parts, count, endian, ticket, &mut warnings)?;

    let name = super::raw::stem(path);
    let fields = axes.fields(&name, samples, ticket)?;
    warnings.extend(axes::several(&fields, "along an axis that is not space"));
    let space = header.get("space").map(str::to_owned);
    let unit = unit(&header, &axes.roles, space.as_deref());
    let label_names = segments(&header, &mut warnings);
    let grid = Grid { space, unit, label_names, ..Grid::of(lattice, fields) };
    Ok(Opened::of(grid, Format::Nrrd, warnings))
}

/// What the values of a segmentation stand for, as 3D Slicer writes it (`Segment0_Name`, …).
fn segments(header: &Header, warnings: &mut Vec<String>) -> Vec<LabelName> {
    let mut read = Vec::<LabelName>::new();
    let named = |number: usize| {
        let pair = |key: &str| header.pair(&format!("Segment{number}_{key}"));
        let whole = |key: &str| pair(key).and_then(|text| text.parse::<i64>().ok());
        let colour = |text: &str| {
            let shares: Vec<f64> =
                text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let shares: [f64; 3] = shares.try_into().ok()?;
            if !shares.iter().all(|share| (0.0..=1.0).contains(share)) {
                return None;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "within 0..=255"
            )]
            Some(Srgb8(shares.map(|share| (share * 255.0).round() as u8)))
        };
        let name = plain(pair("Name").or_else(|| pair("ID"))?);
        // Older files number segments from 1 and do not say so.
        let value = match pair("LabelValue") {
            None => Ok(number as i64 + 1),
            Some(text) => text.parse().map_err(|_| {
                let found = quoted(text);
                format!("the segment {name:?} names no label: its LabelValue is {found}")
            }),
        };
        let colour = pair("Color").and_then(colour);
        let layer = whole("Layer").and_then(|layer| usize::try_from(layer).ok());
        let component = layer.unwrap_or(0);
        Some(value.map(|value| LabelName { component, value, name, colour }))
    };
    for segment in (0..).map_while(named) {
        match segment {
            Err(said) => warnings.push(said),
            Ok(segment) => {
                let same = |other: &&LabelName| {
                    (other.component, other.value) == (segment.component, segment.value)
                };
                match read.iter().find(same) {
                    None => read.push(segment),
                    Some(first) => warnings.push(format!(
                        "the label {} is called {:?} and {:?}: it is shown as the first",
                        segment.value, first.name, segment.name
                    )),
                }
            }
        }
    }
    read
}

fn sizes(header: &Header) -> Result<Vec<usize>, Problem> {
    const MOST_AXES: usize = 16;
    let dimension = header.require("dimension")?;
    let axes = dimension
        .parse()
        .ok()
        .filter(|n| (1..=MOST_AXES).contains(n))
        .ok_or_else(|| header_error("dimension", "a dimension from 1 to 16", dimension))?;
    let text = header.require("sizes")?;
    let sizes = header.integers("sizes")?.unwrap_or_default();
    if sizes.len() != axes {
        return Err(wrong_count("sizes", axes, text));
    }
    let positive = |n: i64| usize::try_from(n).ok().filter(|&n| n > 0);
    sizes
        .into_iter()
        .map(|n| positive(n).ok_or_else(|| header_error("sizes", "sizes of at least 1", text)))
        .collect()
}

fn header_error(field: &str, expected: &str, found: &str) -> Problem {
    header(expected, quoted(found), format!("correct the field \"{field}\""))
}

fn scalar_type(name: &str) -> Result<ScalarType, Problem> {
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower.split_whitespace().collect();
    Ok(match words.join(" ").as_str() {
        "signed char" | "int8" | "int8_t" => ScalarType::Int8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => ScalarType::UInt8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            ScalarType::Int16
        }
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => {
            ScalarType::UInt16
        }
        "int" | "signed int" | "int32" | "int32_t" => ScalarType::Int32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => ScalarType::UInt32,
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => ScalarType::Int64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            ScalarType::UInt64
        }
        "float" | "float32" => ScalarType::Float32,
        "double" | "float64" => ScalarType::Float64,
        _ => {
            return Err(unsupported(
                "a numeric NRRD type such as \"unsigned char\", \"short\" or \"float\"",
                quoted(name),
                "convert the file to one of these types",
            ));
        }
    })
}

fn encoding(name: &str) -> Result<Encoding, Problem> {
    Ok(match name.to_lowercase().as_str() {
        "raw" => Encoding::Raw,
        "txt" | "text" | "ascii" => Encoding::Text,
        "hex" => Encoding::Hex,
        "gz" | "gzip" => Encoding::Gzip,
        "bz2" | "bzip2" => Encoding::Bzip2,
        _ => {
            return Err(unsupported(
                "the encoding raw, text, hex, gzip or bzip2",
                quoted(name),
                "write the file again with one of these",
            ));
        }
    })
}

fn endian(
    header: &Header,
    scalar_type: ScalarType,
    encoding: Encoding,
    warnings: &mut Vec<String>,
) -> Result<Endian, Problem> {
    match header.get("endian").map(str::to_lowercase).as_deref() {
        Some("little") => Ok(Endian::Little),
        Some("big") => Ok(Endian::Big),
        Some(other) => Err(header_error("endian", "\"little\" or \"big\"", other)),
        None => {
            if scalar_type.size_bytes() > 1 && encoding != Encoding::Text {
                warnings.push("the header does not tell the byte order: little is assumed".into());
            }
            Ok(Endian::Little)
        }
    }
}

/// What is passed over before the samples of each file.
struct Skips {
    lines: u64,
    /// `None`: the samples are the last bytes of the file.
    bytes: Option<u64>,
}

impl Skips {
    fn of(header: &Header) -> Result<Self, Problem> {
        let one = |name| -> Result<i64, Problem> {
            match header.integers(name)?.as_deref() {
                None => Ok(0),
                Some([n]) => Ok(*n),
                Some(_) => Err(wrong_count(name, 1, header.get(name).unwrap_or_default())),
            }
        };
        let (lines, bytes) = (one("lineskip")?, one("byteskip")?);
        let lines = u64::try_from(lines)
            .map_err(|_| header_error("line skip", "lines to skip", &lines.to_string()))?;
        let bytes = match bytes {
            -1 => None,
            n => Some(u64::try_from(n).map_err(|_| {
                header_error("byte skip", "bytes to skip, or -1 for the file's end", &n.to_string())
            })?),
        };
        Ok(Self { lines, bytes })
    }
}

/// Reads the parts one after another.
struct Loading {
    encoding: Encoding,
    scalar_type: ScalarType,
    skips: Skips,
}

impl Loading {
    fn read(
        self,
        parts: &[Part],
        count: usize,
        endian: Endian,
        ticket: &Ticket,
        warnings: &mut Vec<String>,
    ) -> Result<Samples, Problem> {
        for part in parts {
            self.check_promise(part)?;
        }
        let wanted = (self.scalar_type, count, self.encoding == Encoding::Raw);
        let mut samples =
            bytes::of_parts(parts, wanted, ticket, warnings, |part, samples, progress| {
                self.read_part(part, samples, progress)
            })?;
        if self.encoding != Encoding::Text {
            bytes::to_native(&mut samples, endian);
        }
        Ok(samples)
    }

    /// Refuses what the stored bytes cannot hold, before any is read.
    fn check_promise(&self, part: &Part) -> Result<(), Problem> {
        let stored = part.file.len.saturating_sub(part.start);
        let needed = (part.count * self.scalar_type.size_bytes()) as u64;
        match self.encoding {
            Encoding::Raw => {
                let skipped = self.skips.bytes.unwrap_or(0);
                bytes::require_stored(needed, stored.saturating_sub(skipped))
            }
            Encoding::Hex => bytes::require_stored(needed, stored / 2),
            // A digit and a space, but for the last.
            Encoding::Text => bytes::require_text(part.count as u64, stored),
            Encoding::Gzip => bytes::require_stored(needed, stored.saturating_mul(DEFLATE_MOST)),
            // A run of any length takes a few bytes: only decoding tells.
            Encoding::Bzip2 => Ok(()),
        }
    }

    /// Appends one file's samples; whether more bytes follow them.
    fn read_part(
        &self,
        part: &Part,
        samples: &mut Samples,
        progress: &mut Progress<'_>,
    ) -> Result<bool, Problem> {
        let mut reader = part.file.open()?;
        let needed = (part.count * self.scalar_type.size_bytes()) as u64;
        if self.skips.bytes.is_none() && self.encoding == Encoding::Raw {
            let from = part.file.len.saturating_sub(needed);
            reader.seek(SeekFrom::Start(from)).map_err(Problem::Io)?;
            bytes::append(samples, &mut reader, part.count, progress)?;
            return Ok(false);
        }
        reader.seek(SeekFrom::Start(part.start)).map_err(Problem::Io)?;
        for _ in 0..self.skips.lines {
            skip_line(&mut reader, progress.ticket())?;
        }
        let skipped = match self.skips.bytes {
            Some(skipped) => skipped,
            None => {
                let from = reader.stream_position().map_err(Problem::Io)?;
                let skipped = self.before_the_last(&mut reader, needed, progress.ticket())?;
                reader.seek(SeekFrom::Start(from)).map_err(Problem::Io)?;
                skipped
            }
        };
        Ok(match self.encoding {
            Encoding::Raw => {
                bytes::discard(&mut reader, skipped, progress.ticket())?;
                bytes::append(samples, &mut reader, part.count, progress)?;
                bytes::rest(&mut reader)? > 0
            }
            Encoding::Hex => {
                bytes::discard(&mut reader, skipped, progress.ticket())?;
                bytes::append(samples, &mut bytes::Hex(reader), part.count, progress)?;
                false
            }
            Encoding::Text => {
                bytes::discard(&mut reader, skipped, progress.ticket())?;
                bytes::append_text(samples, &mut reader, part.count, progress)?;
                false
            }
            // Bytes are skipped in what was decoded, lines in what was not.
            Encoding::Gzip => {
                self.inflate(Inflate::gzip(reader), skipped, part.count, samples, progress)?
            }
            Encoding::Bzip2 => {
                self.inflate(Inflate::bzip2(reader), skipped, part.count, samples, progress)?
            }
        })
    }

    /// How many decompressed bytes come before the last `needed`.
    fn before_the_last<R: BufRead>(
        &self,
        reader: R,
        needed: u64,
        ticket: &Ticket,
    ) -> Result<u64, Problem> {
        let mut reader = match self.encoding {
            Encoding::Gzip => Inflate::gzip(reader),
            Encoding::Bzip2 => Inflate::bzip2(reader),
            Encoding::Raw | Encoding::Text | Encoding::Hex => {
                return Err(header(
                    "raw or compressed samples where \"byte skip\" is -1",
                    "samples in text",
                    "give the number of bytes to skip",
                ));
            }
        };
        let all = bytes::count_rest(&mut reader, ticket)?;
        bytes::require_stored(needed, all)?;
        Ok(all - needed)
    }

    fn inflate<R: BufRead>(
        &self,
        mut reader: Inflate<R>,
        skipped: u64,
        count: usize,
        samples: &mut Samples,
        progress: &mut Progress<'_>,
    ) -> Result<bool, Problem> {
        bytes::discard(&mut reader, skipped, progress.ticket())?;
        bytes::append(samples, &mut reader, count, progress)?;
        reader.finish()
    }
}

fn skip_line<R: Read>(reader: &mut BufReader<R>, ticket: &Ticket) -> Result<(), Problem> {
    ticket.checkpoint(0, 1)?;
    loop {
        let buffer = reader.fill_buf().map_err(Problem::Io)?;
        if buffer.is_empty() {
            return Err(super::error::truncated(
                "as many lines as \"line skip\" says",
                "that the data end before",
                "correct the field",
            ));
        }
        let newline = buffer.iter().position(|&b| b == b'\n');
        let taken = newline.map_or(buffer.len(), |at| at + 1);
        reader.consume(taken);
        if newline.is_some() {
            return Ok(());
        }
    }
}

/// What the header says of its axes.
struct Geometry {
    roles: Vec<Role>,
    /// Steps of each axis in the world, where it has one.
    directions: Option<Vec<Option<DVec3>>>,
}

impl Geometry {
    fn of(header: &Header, sizes: &[usize], warnings: &mut Vec<String>) -> Result<Self, Problem> {
        let axes = sizes.len();
        let mut directions = header.vectors("spacedirections")?;
        if let Some(vectors) = &directions {
            if vectors.len() != axes {
                let text = header.get("spacedirections").unwrap_or_default();
                return Err(wrong_count("space directions", axes, text));
            }
            if vectors.iter().all(Option::is_none) {
                warnings.push("no axis has a space direction: the world's axes are used".into());
                directions = None;
            }
        }
        let directions: Option<Vec<Option<DVec3>>> =
            directions.map(|all| all.iter().map(|v| v.as_deref().and_then(spatial)).collect());
        let kinds: Option<Vec<&str>> = header.get("kinds").map(|v| v.split_whitespace().collect());
        if let Some(kinds) = kinds.as_ref().filter(|kinds| kinds.len() != axes) {
            return Err(wrong_count("kinds", axes, &kinds.join(" ")));
        }
        let mut roles: Vec<Role> = (0..axes)
            .map(|axis| {
                let kind = kinds.as_ref().map_or("", |kinds| kinds[axis]).to_lowercase();
                let direction = directions.as_ref().map(|d| d[axis].is_some());
                role(axis, &kind, direction)
            })
            .collect();
        limit_domains(&mut roles, sizes, kinds.is_some() || directions.is_some(), warnings);
        if !roles.contains(&Role::Domain) {
            return Err(unsupported(
                "at least one spatial axis",
                format!("the kinds {}", quoted(header.get("kinds").unwrap_or("none"))),
                "mark the spatial axes as \"domain\" in \"kinds\"",
            ));
        }
        Ok(Self { roles, directions })
    }

    fn lattice(
        &self,
        header: &Header,
        axes: &Axes,
        warnings: &mut Vec<String>,
    ) -> Result<Lattice, Problem> {
        let count = axes.sizes.len();
        let domain: Vec<usize> =
            (0..count).filter(|&axis| self.roles[axis] == Role::Domain).collect();
        let dims = axes.dims();
        let origin = match header.vectors("spaceorigin")?.as_deref() {
            None | Some([None]) => None,
            Some([Some(vector)]) => Some(origin_of(vector)),
            Some(_) => {
                let text = header.get("spaceorigin").unwrap_or_default();
                return Err(wrong_count("space origin", 1, text));
            }
        };
        if let Some(directions) = &self.directions {
            let steps: Vec<DVec3> =
                domain.iter().map(|&axis| directions[axis].unwrap_or(DVec3::ZERO)).collect();
            return Ok(axes::lattice(dims, origin.unwrap_or(DVec3::ZERO), &steps, warnings));
        }
        let placed = placements(header, &axes.sizes, warnings)?;
        let mut spacing = DVec3::ONE;
        let mut start = DVec3::ZERO;
        for (to, &axis) in domain.iter().enumerate() {
            (spacing[to], start[to]) = placed[axis];
        }
        let origin = origin.unwrap_or(start);
        Ok(axes::lattice_of_spacing(dims, origin, spacing, glam::DMat3::IDENTITY, warnings))
    }
}

/// Whether a space is a patient's: its axes are named by where they point in a body.
fn is_of_a_patient(space: &str) -> bool {
    let space = space.trim().to_ascii_lowercase();
    let space = space.trim_end_matches("-time");
    ["right", "left"].iter().any(|side| space.starts_with(side)) && space.ends_with("-superior")
        || ["ras", "las", "lps", "rast", "last", "lpst"].contains(&space)
}

/// What lengths are given in: of the space, or of the axes that span it where these have one unit. Where a file is silent
/// in a patient's space, millimetres, as every program for patients reads it.
fn unit(header: &Header, roles: &[Role], space: Option<&str>) -> Option<String> {
    let words = |name| -> Vec<&str> {
        // Each in quotes.
        header
            .get(name)
            .map(|value| value.split('"').skip(1).step_by(2).collect())
            .unwrap_or_default()
    };
    let of_space = words("spaceunits");
    let of_axes = words("units").into_iter().zip(roles);
    let of_axes = of_axes.filter(|(_, role)| **role == Role::Domain).map(|(word, _)| word);
    let all = if of_space.is_empty() { of_axes.collect() } else { of_space };
    if all.is_empty() {
        return space.is_some_and(is_of_a_patient).then(|| "mm".to_owned());
    }
    let mut units = all.iter().take(3).map(|word| length_unit(word));
    let first = units.next()??;
    units.all(|unit| unit.as_ref() == Some(&first)).then_some(first)
}

/// A step vector in space; `None` for one that has no part in it, such as time's.
fn spatial(vector: &[f64]) -> Option<DVec3> {
    let step = origin_of(vector);
    let beyond = vector.get(3..).unwrap_or_default();
    (beyond.iter().all(|&v| v == 0.0) || step != DVec3::ZERO).then_some(step)
}

/// The first three coordinates, zeros where there are fewer.
fn origin_of(vector: &[f64]) -> DVec3 {
    let mut point = DVec3::ZERO;
    for (axis, &value) in vector.iter().take(3).enumerate() {
        point[axis] = value;
    }
    point
}

/// What an axis is, from its kind and whether it has a direction in space (`None`: nobody has).
fn role(axis: usize, kind: &str, has_direction: Option<bool>) -> Role {
    let aside = if axis == 0 { Role::Component } else { Role::List };
    match kind {
        "domain" | "space" if has_direction != Some(false) => Role::Domain,
        "domain" | "space" => aside,
        "list" | "time" => Role::List,
        "" | "none" | "???" | "unknown" => match has_direction {
            Some(false) => aside,
            _ => Role::Domain,
        },
        // Vectors, colours, matrices, quaternions and whatever else is one sample's inside.
        _ => Role::Component,
    }
}

/// Leaves at most three spatial axes, by a guess that is told.
fn limit_domains(roles: &mut [Role], sizes: &[usize], told: bool, warnings: &mut Vec<String>) {
    loop {
        let domains: Vec<usize> =
            (0..roles.len()).filter(|&axis| roles[axis] == Role::Domain).collect();
        let [first, .., last] = domains[..] else { return };
        if domains.len() <= 3 {
            return;
        }
        let looks_like_components =
            !told && first == 0 && (2..=9).contains(&sizes[0]) && sizes[1..].iter().all(|&n| n > 9);
        let (axis, role, word) = if looks_like_components {
            (first, Role::Component, "the components of one sample")
        } else {
            (last, Role::List, "a list of volumes")
        };
        roles[axis] = role;
        warnings.push(format!(
            "the header does not tell which axes are space: axis {axis} of size {} is taken as {word}",
            sizes[axis]
        ));
    }
}

/// Spacing and world position of the first sample along each axis, from the fields that need no
/// directions.
fn placements(
    header: &Header,
    sizes: &[usize],
    warnings: &mut Vec<String>,
) -> Result<Vec<(f64, f64)>, Problem> {
    let axes = sizes.len();
    let given = |name| header.per_axis(name, axes);
    let (spacings, thicknesses) = (given("spacings")?, given("thicknesses")?);
    let (mins, maxs) = (given("axismins")?, given("axismaxs")?);
    let centerings = header.get("centerings").or_else(|| header.get("centers"));
    let centerings: Option<Vec<String>> =
        centerings.map(|v| v.split_whitespace().map(str::to_lowercase).collect());
    if let Some(words) = centerings.as_ref().filter(|words| words.len() != axes) {
        return Err(wrong_count("centerings", axes, &words.join(" ")));
    }
    let number = |field: &Option<Vec<f64>>, axis: usize| {
        field.as_ref().map(|all| all[axis]).filter(|v| !v.is_nan())
    };
    let mut placed = Vec::with_capacity(axes);
    for (axis, &size) in sizes.iter().enumerate() {
        let at_nodes = centerings.as_ref().is_some_and(|words| words[axis] == "node");
        let (min, max) = (number(&mins, axis), number(&maxs, axis));
        let steps = if at_nodes { size - 1 } else { size };
        let spanned = min.zip(max).filter(|_| steps > 0).map(|(a, b)| (b - a) / steps as f64);
        let spacing = match (number(&spacings, axis), spanned, number(&thicknesses, axis)) {
            (Some(spacing), _, _) => spacing,
            (None, Some(spacing), _) => spacing,
            (None, None, Some(thickness)) => {
                warnings.push(format!(
                    "axis {axis} has a thickness but no spacing: the thickness is used"
                ));
                thickness
            }
            (None, None, None) => 1.0,
        };
        // A cell's first sample lies half a spacing inside its border.
        let inset = if at_nodes { 0.0 } else { spacing / 2.0 };
        placed.push((spacing, min.map_or(0.0, |min| min + inset)));
    }
    Ok(placed)
}
