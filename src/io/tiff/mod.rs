//! TIFF: stacks of pages, BigTIFF too, with what ImageJ and OME write into them.

pub(super) mod metadata;

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use glam::{DMat3, DVec3};
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use self::metadata::{Dimension, Pages};
use super::axes::{self, Axes, Role};
use super::bytes::{self, Endian};
use super::error::{Problem, corrupt, quoted, unsupported};
use super::files;
use super::numbers::Numbers;
use super::{Format, Opened};
use crate::core::memory;
use crate::core::panics::caught;
use crate::core::progress::Ticket;
use crate::volume::{Grid, Lattice, Samples, ScalarType};

/// No packing shrinks a page further than this (LZW: a string of 4096 for 12 bits).
const PACKED_MOST: u64 = 4096;
/// A directory of more bytes is none.
const MOST_DIRECTORY_BYTES: u64 = 1 << 16;
/// More pages than this are a damaged file.
const MOST_PAGES: usize = 1 << 20;

/// Whether some first bytes are TIFF's, of 32 or of 64 bits.
pub(super) fn looks_like_it(start: &[u8]) -> bool {
    [&b"II*\0"[..], b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| start.starts_with(magic))
}

/// The form of a page's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) components: usize,
    pub(super) scalar_type: ScalarType,
}

impl Form {
    /// Numbers of one page.
    pub(super) fn len(&self) -> usize {
        self.width * self.height * self.components
    }
}

/// A file whose pages are read in turn.
pub(super) struct Reader {
    decoder: Decoder<BufReader<File>>,
    len: u64,
    free_bytes: u64,
}

impl Reader {
    pub(super) fn open(path: &Path, free_bytes: u64) -> Result<Self, Problem> {
        let (file, len) = files::open_file(path)?;
        let mut reader = files::buffered(file);
        check_first_directory(&mut reader, len)?;
        let decoder = guarded(|| Decoder::new(reader))?;
        let mut limits = Limits::default();
        let most = len.saturating_mul(PACKED_MOST).min(free_bytes);
        limits.decoding_buffer_size = usize::try_from(most).unwrap_or(usize::MAX);
        limits.intermediate_buffer_size = limits.decoding_buffer_size;
        Ok(Self { decoder: decoder.with_limits(limits), len, free_bytes })
    }

    /// The numbers of the page that it is at, as they are stored.
    pub(super) fn page(&mut self) -> Result<(Form, Samples), Problem> {
        let (width, height) = guarded(|| self.decoder.dimensions())?;
        let colours = guarded(|| self.decoder.colortype())?;
        let components = usize::from(colours.num_samples());
        let sizes = [u64::from(width), u64::from(height), components as u64];
        // Bytes at least; the type is known when they are there.
        let count = bytes::checked_count("a page", &sizes, ScalarType::UInt8, self.free_bytes)?;
        bytes::require_stored(count as u64 / 8, self.len.saturating_mul(PACKED_MOST))?;
        if components > 8 {
            return Err(unsupported(
                "pages of at most 8 numbers a pixel",
                components.to_string(),
                "split the channels",
            ));
        }
        let decoder = &mut self.decoder;
        let is_inverted = decoder
            .find_tag_unsigned::<u16>(Tag::PhotometricInterpretation)
            .is_ok_and(|p| p == Some(0));
        let read = guarded(|| decoder.read_image())?;
        let mut samples = samples_of(read);
        if is_inverted {
            as_stored(&mut samples);
        }
        if let (ColorType::Gray(bits @ (1 | 2 | 4)), Samples::UInt8(packed)) = (colours, &samples) {
            samples = Samples::UInt8(one_each(packed, [width as usize, height as usize], bits));
        }
        let form = Form {
            width: width as usize,
            height: height as usize,
            components,
            scalar_type: samples.scalar_type(),
        };
        if samples.len() != form.len() {
            return Err(unsupported(
                "pages whose colours lie together, of 8 bits or more",
                format!("{} numbers for {width} × {height} × {components}", samples.len()),
                "save the file again without planes",
            ));
        }
        Ok((form, samples))
    }

    /// Goes to the next page; false where there is none.
    pub(super) fn next(&mut self) -> Result<bool, Problem> {
        if !self.decoder.more_images() {
            return Ok(false);
        }
        let decoder = &mut self.decoder;
        guarded(|| decoder.next_image())?;
        Ok(true)
    }

    fn description(&mut self) -> String {
        let decoder = &mut self.decoder;
        guarded(|| decoder.get_tag_ascii_string(Tag::ImageDescription)).unwrap_or_default()
    }

    /// Pixels a unit of length along x and y.
    fn resolution(&mut self) -> [Option<f64>; 2] {
        let decoder = &mut self.decoder;
        let mut ratio = |tag| {
            let pair = guarded(|| decoder.get_tag_u32_vec(tag)).ok()?;
            let [over, under] = pair[..] else { return None };
            let value = f64::from(over) / f64::from(under);
            (value.is_finite() && value > 0.0).then_some(value)
        };
        [ratio(Tag::XResolution), ratio(Tag::YResolution)]
    }

    /// Numbers that lie behind one another from the first page's on, as ImageJ writes stacks beyond 4 GB.
    fn contiguous(
        &mut self,
        form: Form,
        pages: usize,
        ticket: &Ticket,
    ) -> Result<Option<Samples>, Problem> {
        let decoder = &mut self.decoder;
        let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression).ok().flatten();
        if compression.unwrap_or(1) != 1 {
            return Ok(None);
        }
        let Ok(offsets) = guarded(|| decoder.get_tag_u64_vec(Tag::StripOffsets)) else {
            return Ok(None);
        };
        let Some(from) = offsets.first().copied() else { return Ok(None) };
        let sizes = [form.len() as u64, pages as u64];
        let count = bytes::checked_count("the stack", &sizes, form.scalar_type, self.free_bytes)?;
        let needed = (count * form.scalar_type.size_bytes()) as u64;
        if needed > self.len.saturating_sub(from) {
            return Ok(None);
        }
        let endian = match self.decoder.byte_order() {
            tiff::tags::ByteOrder::LittleEndian => Endian::Little,
            tiff::tags::ByteOrder::BigEndian => Endian::Big,
        };
        let reader = self.decoder.inner();
        reader.seek(SeekFrom::Start(from)).map_err(Problem::Io)?;
        let mut samples = bytes::no_samples(form.scalar_type);
        bytes::reserve_samples(&mut samples, count)?;
        let mut progress = bytes::Progress::new(ticket, needed);
        bytes::append(&mut samples, &mut reader.take(needed), count, &mut progress)?;
        bytes::to_native(&mut samples, endian);
        Ok(Some(samples))
    }
}

/// Refuses a first directory with more values than the file has bytes: the decoder makes room for them before it can
/// be told any limits.
fn check_first_directory(reader: &mut BufReader<File>, len: u64) -> Result<(), Problem> {
    let mut start = [0; 16];
    bytes::read_full(reader, &mut start).map_err(Problem::Io)?;
    let endian = if start[0] == b'M' { Endian::Big } else { Endian::Little };
    let head = Numbers { bytes: &start, endian };
    let is_wide = head.i16(2) == 43;
    let offset = if is_wide { head.i64(8) } else { i64::from(head.i32(4)) & 0xffff_ffff };
    let place = u64::try_from(offset).unwrap_or(u64::MAX).min(len);
    reader.seek(SeekFrom::Start(place)).map_err(Problem::Io)?;
    let mut directory = Vec::new();
    reader.take(MOST_DIRECTORY_BYTES).read_to_end(&mut directory).map_err(Problem::Io)?;
    let numbers = Numbers { bytes: &directory, endian };
    let entries = if is_wide { numbers.i64(0) } else { i64::from(numbers.i16(0)) & 0xffff };
    let (head_bytes, entry_bytes) = if is_wide { (8, 20) } else { (2, 12) };
    let within = directory.len() / entry_bytes;
    for entry in 0..usize::try_from(entries).unwrap_or(usize::MAX).min(within) {
        let at = head_bytes + entry * entry_bytes + 4;
        let count =
            if is_wide { numbers.i64(at) } else { i64::from(numbers.i32(at)) & 0xffff_ffff };
        if u64::try_from(count).map_or(true, |count| count > len) {
            return Err(corrupt(
                format!("at most {len} values in a TIFF directory"),
                count.to_string(),
                "the file was altered: copy it again",
            ));
        }
    }
    reader.rewind().map_err(Problem::Io)
}

/// Does what may fail, or panic, in the decoder.
fn guarded<T>(work: impl FnOnce() -> tiff::TiffResult<T>) -> Result<T, Problem> {
    let damaged = |words: &str| {
        corrupt("TIFF pages that decode", quoted(words), "save the file again, or copy it again")
    };
    match caught(work) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(tiff::TiffError::UnsupportedError(error))) => Err(unsupported(
            "TIFF of grey or RGB pages, plain or packed with LZW, Deflate, PackBits or JPEG",
            quoted(&error.to_string()),
            "save the file again in one of these ways",
        )),
        Ok(Err(error)) => Err(damaged(&error.to_string())),
        Err(words) => Err(damaged(&words)),
    }
}

/// Numbers of a few bits, whose rows begin with a byte each, a byte each.
fn one_each(packed: &[u8], [width, height]: [usize; 2], bits: u8) -> Vec<u8> {
    let bits = usize::from(bits);
    let row_bytes = (width * bits).div_ceil(8);
    let mask = (1_u8 << bits) - 1;
    let rows = packed.chunks(row_bytes.max(1)).take(height);
    rows.flat_map(|row| {
        (0..width.min(row.len() * 8 / bits))
            .map(move |x| row[x * bits / 8] >> (8 - bits - x * bits % 8) & mask)
    })
    .collect()
}

fn samples_of(read: DecodingResult) -> Samples {
    match read {
        DecodingResult::U8(values) => Samples::UInt8(values),
        DecodingResult::U16(values) => Samples::UInt16(values),
        DecodingResult::U32(values) => Samples::UInt32(values),
        DecodingResult::U64(values) => Samples::UInt64(values),
        DecodingResult::I8(values) => Samples::Int8(values),
        DecodingResult::I16(values) => Samples::Int16(values),
        DecodingResult::I32(values) => Samples::Int32(values),
        DecodingResult::I64(values) => Samples::Int64(values),
        DecodingResult::F16(values) => {
            Samples::Float32(values.into_iter().map(f32::from).collect())
        }
        DecodingResult::F32(values) => Samples::Float32(values),
        DecodingResult::F64(values) => Samples::Float64(values),
    }
}

/// Back to what is stored of pages whose white is 0, which the decoder turned round.
fn as_stored(samples: &mut Samples) {
    macro_rules! turned {
        ($($kind:ident),*) => {
            match samples {
                $(Samples::$kind(values) => values.iter_mut().for_each(|v| *v = !*v),)*
                Samples::Float32(values) => values.iter_mut().for_each(|v| *v = 1.0 - *v),
                Samples::Float64(values) => values.iter_mut().for_each(|v| *v = 1.0 - *v),
                _ => {}
            }
        };
    }
    turned!(UInt8, UInt16, UInt32, UInt64);
}

pub(super) fn read(path: &Path, free_bytes: u64, ticket: &Ticket) -> Result<Opened, Problem> {
    let mut reader = Reader::open(path, free_bytes)?;
    let description = reader.description();
    let resolution = reader.resolution();
    let mut warnings = Vec::new();
    let (form, first) = reader.page()?;
    let mut count = 1;
    let mut others = 0;
    let promised =
        Pages::promised(&description).filter(|&n| n > 1 && !reader.decoder.more_images());
    let contiguous = match promised {
        Some(pages) => reader.contiguous(form, pages, ticket)?.map(|samples| (samples, pages)),
        None => None,
    };
    let samples = match contiguous {
        Some((samples, pages)) => {
            count = pages;
            samples
        }
        None => {
            let mut samples = first;
            while reader.next()? {
                ticket.checkpoint(0, 1)?;
                let (other, page) = reader.page()?;
                if other != form {
                    others += 1;
                } else {
                    let bytes = (samples.len() * 2 + page.len()) * form.scalar_type.size_bytes();
                    memory::require("the pages", bytes as u64, free_bytes)?;
                    append(&mut samples, &page)?;
                    count += 1;
                }
                if count + others > MOST_PAGES {
                    return Err(corrupt(
                        format!("at most {MOST_PAGES} pages"),
                        "more",
                        "copy the file again",
                    ));
                }
            }
            samples
        }
    };
    if others > 0 {
        let noun = if others == 1 { "page" } else { "pages" };
        warnings
            .push(format!("{others} {noun} of another size or type than the first are left out"));
    }
    let pages = Pages::of(&description, count).unwrap_or_else(|| {
        if Pages::are_told(&description) {
            warnings.push(format!(
                "the description of the pages is none, or of another number than the {count} that there are: these are \
                 taken for slices"
            ));
        }
        Pages::plain(count)
    });
    let mut axes = Axes {
        sizes: vec![form.components, form.width, form.height],
        roles: vec![Role::Component, Role::Domain, Role::Domain],
        backwards: false,
    };
    for (dimension, size) in &pages.order {
        axes.sizes.push(*size);
        axes.roles.push(match dimension {
            Dimension::Slices => Role::Domain,
            Dimension::Channels | Dimension::Times => Role::List,
        });
    }
    if axes.copies() {
        let bytes = (samples.len() * form.scalar_type.size_bytes()) as u64;
        memory::require(
            "the pages and their copy by channel",
            bytes.saturating_mul(2),
            free_bytes,
        )?;
    }
    let (spacing, unit) = spacing(&pages, resolution);
    let lattice =
        Lattice { dims: axes.dims(), spacing, origin: DVec3::ZERO, direction: DMat3::IDENTITY };
    let fields = axes.fields(&super::raw::stem(path), samples, ticket)?;
    warnings.extend(axes::several(&fields, "in channels or times"));
    let grid = Grid { unit, ..Grid::of(lattice, fields) };
    Ok(Opened::of(grid, Format::Tiff, warnings))
}

/// Distances of pixels and slices, and their unit.
fn spacing(pages: &Pages, resolution: [Option<f64>; 2]) -> (DVec3, Option<String>) {
    if let [Some(x), Some(y)] = pages.spacing {
        return (DVec3::new(x, y, pages.slice_spacing.unwrap_or(x)), pages.unit.clone());
    }
    let [Some(x), Some(y)] = resolution else {
        return (DVec3::new(1.0, 1.0, pages.slice_spacing.unwrap_or(1.0)), None);
    };
    if pages.resolution_is_of_unit && pages.unit.is_some() {
        let (x, y) = (1.0 / x, 1.0 / y);
        return (DVec3::new(x, y, pages.slice_spacing.unwrap_or(x)), pages.unit.clone());
    }
    // Dots an inch are of paper; what they say of a sample is their ratio.
    (DVec3::new(1.0, x / y, pages.slice_spacing.unwrap_or(1.0)), None)
}

pub(super) fn append(values: &mut Samples, more: &Samples) -> Result<(), Problem> {
    macro_rules! append {
        ($($kind:ident),*) => {
            match (values, more) {
                $((Samples::$kind(to), Samples::$kind(from)) => {
                    to.try_reserve(from.len()).map_err(|_refused| {
                        let needed_bytes = ((to.len() + from.len()) * size_of_val(&from[..1])) as u64;
                        let free_bytes = memory::free_bytes().min(needed_bytes.saturating_sub(1));
                        memory::TooLarge { what: "the samples".into(), needed_bytes, free_bytes }
                    })?;
                    to.extend_from_slice(from);
                })*
                _ => unreachable!("pages of one form have one type"),
            }
        };
    }
    append!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64);
    Ok(())
}
