//! The numbers of one array: text, base64 or appended bytes, plain or in blocks of zlib, LZ4 or LZMA.

use std::io::{self, BufRead, Read, Seek, SeekFrom};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::bufread::ZlibDecoder;
use lzma_rust2::XzReader;

use super::super::bytes::{self, DEFLATE_MOST, Endian, Progress};
use super::super::error::{Problem, corrupt, header, quoted, truncated};
use super::super::files;
use super::xml::{Array, Place};
use crate::core::Cancelled;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::volume::Samples;
use crate::with_samples;

/// Bytes that one of LZMA can stand for, at most: runs of 273 in 0.3 bits.
const LZMA_MOST: u64 = 8192;
/// Memory that a block of LZMA may ask for, KiB: the greatest preset asks for 65.
const MOST_LZMA_KIB: u32 = 1 << 17;

/// The file behind the XML.
pub(super) struct Appended<'a> {
    pub(super) path: &'a Path,
    /// Byte after the underscore that opens the appended data; `None` where there are none.
    pub(super) start: Option<u64>,
    pub(super) is_base64: bool,
    pub(super) len: u64,
}

/// How blocks are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    /// Blocks without a frame.
    Lz4,
    /// Streams of the xz format.
    Lzma,
}

/// How every binary array of the file is written.
#[derive(Clone, Copy)]
pub(super) struct Packing {
    pub(super) endian: Endian,
    pub(super) word_bytes: usize,
    pub(super) compressor: Option<Compressor>,
    pub(super) counted_by: CountedBy,
}

/// What says how many numbers an array has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CountedBy {
    /// That of the samples along x, y and z.
    Extent,
    /// `NumberOfPoints`, `NumberOfCells` and the like.
    Piece,
}

/// All `count` samples of one array of one piece.
///
/// # Errors
/// Fewer or more samples than `count`, damage, or cancelled.
pub(super) fn read(
    array: &Array<'_>,
    count: usize,
    packing: Packing,
    appended: &Appended<'_>,
    progress: &mut Progress<'_>,
) -> Result<Samples, Problem> {
    let mut samples = bytes::no_samples(array.scalar_type);
    if let Place::Text(text) = &array.place {
        // More would be passed over.
        let found = text.split_ascii_whitespace().count();
        if found != count {
            let expected = format!("{count} numbers in the array {}", quoted(&array.name));
            let advice = "correct its length or the counts it follows from, or copy the file again";
            return Err(match found < count {
                true => truncated(expected, found.to_string(), advice),
                false => header(expected, found.to_string(), advice),
            });
        }
        bytes::append_text(&mut samples, &mut text.as_bytes(), count, progress)?;
        return Ok(samples);
    }
    with_bytes(array, appended, |reader, stored| {
        unpack(&mut samples, reader, count, stored, packing, progress)
    })?;
    bytes::to_native(&mut samples, packing.endian);
    Ok(samples)
}

/// How many numbers an array has, by what precedes its data, or by its words.
///
/// # Errors
/// Damage, or cancelled.
pub(super) fn count(
    array: &Array<'_>,
    packing: Packing,
    appended: &Appended<'_>,
    progress: &mut Progress<'_>,
) -> Result<u64, Problem> {
    progress.advance(0)?;
    if let Place::Text(text) = &array.place {
        return Ok(text.split_whitespace().count() as u64);
    }
    let bytes = with_bytes(array, appended, |reader, stored| {
        if packing.compressor.is_none() {
            return word(reader, packing);
        }
        let [blocks, full, last] =
            [word(reader, packing)?, word(reader, packing)?, word(reader, packing)?];
        bytes::require_stored(blocks.saturating_mul(packing.word_bytes as u64), stored)?;
        Ok(unpacked_bytes(blocks, full, last).unwrap_or(u64::MAX))
    })?;
    Ok(bytes / array.scalar_type.size_bytes() as u64)
}

/// Does what needs the bytes of an array that is not written as text, and how many there may be.
fn with_bytes<T>(
    array: &Array<'_>,
    appended: &Appended<'_>,
    work: impl FnOnce(&mut dyn Read, u64) -> Result<T, Problem>,
) -> Result<T, Problem> {
    match &array.place {
        Place::Text(_) => work(&mut io::empty(), 0),
        Place::Base64(text) => {
            let stored = text.len() as u64 / 4 * 3;
            work(&mut Base64::new(text.as_bytes()), stored)
        }
        Place::Appended(offset) => {
            let start = appended.start.and_then(|start| start.checked_add(*offset));
            let Some(start) = start.filter(|&start| start < appended.len) else {
                return Err(truncated(
                    format!("appended data at offset {offset}"),
                    "that the file ends before",
                    "the file was cut short: copy it again",
                ));
            };
            let (file, _) = files::open_file(appended.path)?;
            let mut reader = files::buffered(file);
            reader.seek(SeekFrom::Start(start)).map_err(Problem::Io)?;
            let left = appended.len - start;
            if appended.is_base64 {
                return work(&mut Base64::new(reader), left / 4 * 3);
            }
            work(&mut reader, left)
        }
    }
}

/// Reads one of the unsigned numbers that precede the data.
fn word(reader: &mut dyn Read, packing: Packing) -> Result<u64, Problem> {
    let mut bytes = [0; 8];
    let used = &mut bytes[..packing.word_bytes];
    if bytes::read_full(reader, used).map_err(damaged)? < packing.word_bytes {
        return Err(truncated(
            "the length of an array before its data",
            "that the data end",
            "the file was cut short: copy it again",
        ));
    }
    Ok(match packing.endian {
        Endian::Little => used.iter().rev().fold(0, |n, &byte| n << 8 | u64::from(byte)),
        Endian::Big => used.iter().fold(0, |n, &byte| n << 8 | u64::from(byte)),
    })
}

fn unpack(
    samples: &mut Samples,
    reader: &mut dyn Read,
    count: usize,
    stored_bytes: u64,
    packing: Packing,
    progress: &mut Progress<'_>,
) -> Result<(), Problem> {
    let needed = (count * samples.scalar_type().size_bytes()) as u64;
    if let Some(compressor) = packing.compressor {
        let blocks = Blocks::read(reader, needed, stored_bytes, (packing, compressor))?;
        return blocks.unpack(samples, reader, progress);
    }
    check_length(word(reader, packing)?, needed, packing.counted_by)?;
    bytes::require_stored(needed, stored_bytes)?;
    bytes::reserve_samples(samples, count)?;
    bytes::append(samples, reader, count, progress)
}

fn check_length(found: u64, needed: u64, counted_by: CountedBy) -> Result<(), Problem> {
    if found == needed {
        return Ok(());
    }
    let (of, what) = match counted_by {
        CountedBy::Extent => ("of samples for the extent", "the extent"),
        CountedBy::Piece => {
            ("of an array for the points and cells of the piece", "the numbers of points and cells")
        }
    };
    Err(header(
        format!("{needed} bytes {of}"),
        format!("that the array has {found}"),
        format!("correct {what}, the type or the components, or copy the file again"),
    ))
}

/// The table before compressed data.
struct Blocks {
    compressor: Compressor,
    /// Bytes of each block but the last, uncompressed.
    full_bytes: usize,
    last_bytes: usize,
    /// Bytes of each block, compressed.
    packed_bytes: Vec<usize>,
}

/// Bytes of so many blocks; a last block of 0 bytes means a full one.
fn unpacked_bytes(count: u64, full: u64, last: u64) -> Option<u64> {
    match (count, last) {
        (0, _) => Some(0),
        (count, 0) => count.checked_mul(full),
        (count, last) => (count - 1).checked_mul(full).and_then(|n| n.checked_add(last)),
    }
}

impl Blocks {
    fn read(
        reader: &mut dyn Read,
        needed: u64,
        stored_bytes: u64,
        (packing, compressor): (Packing, Compressor),
    ) -> Result<Self, Problem> {
        let (count, full, last) =
            (word(reader, packing)?, word(reader, packing)?, word(reader, packing)?);
        let total = unpacked_bytes(count, full, last);
        check_length(total.unwrap_or(u64::MAX), needed, packing.counted_by)?;
        bytes::require_stored(count.saturating_mul(packing.word_bytes as u64), stored_bytes)?;
        let mut packed_bytes = Vec::new();
        let mut sum = 0_u64;
        for _ in 0..count {
            let packed = word(reader, packing)?;
            sum = sum.saturating_add(packed);
            packed_bytes.push(usize::try_from(packed).unwrap_or(usize::MAX));
        }
        bytes::require_stored(sum, stored_bytes)?;
        let most = if compressor == Compressor::Lzma { LZMA_MOST } else { DEFLATE_MOST };
        bytes::require_stored(needed, sum.saturating_mul(most))?;
        let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
        let last_bytes = if last == 0 { size(full) } else { size(last) };
        Ok(Self { compressor, full_bytes: size(full), last_bytes, packed_bytes })
    }

    /// Reads a few blocks at a time and decodes them side by side.
    fn unpack(
        &self,
        samples: &mut Samples,
        reader: &mut dyn Read,
        progress: &mut Progress<'_>,
    ) -> Result<(), Problem> {
        const BATCH_BYTES: usize = 1 << 22;
        let blocks = self.packed_bytes.len();
        let size = samples.scalar_type().size_bytes();
        let mut packed = Vec::new();
        let mut unpacked: Vec<u8> = Vec::new();
        let mut first = 0;
        while first < blocks {
            let (mut end, mut in_bytes, mut out_bytes) = (first, 0, 0);
            while end < blocks && (end == first || in_bytes.max(out_bytes) < BATCH_BYTES) {
                in_bytes += self.packed_bytes[end];
                out_bytes += self.block_bytes(end);
                end += 1;
            }
            read_piecewise(reader, in_bytes, &mut packed, progress.ticket())?;
            // What a batch leaves of a sample that straddles it stays for the next.
            let kept = unpacked.len();
            unpacked.resize(kept + out_bytes, 0);
            self.decode(first..end, &packed, &mut unpacked[kept..], progress.ticket())?;
            let whole = unpacked.len() / size * size;
            append_bytes(samples, &unpacked[..whole])?;
            unpacked.drain(..whole);
            progress.advance(out_bytes)?;
            first = end;
        }
        Ok(())
    }

    fn block_bytes(&self, block: usize) -> usize {
        if block + 1 == self.packed_bytes.len() { self.last_bytes } else { self.full_bytes }
    }

    fn decode(
        &self,
        blocks: std::ops::Range<usize>,
        mut packed: &[u8],
        mut unpacked: &mut [u8],
        ticket: &Ticket,
    ) -> Result<(), Problem> {
        let mut jobs = Vec::with_capacity(blocks.len());
        for block in blocks {
            let (from, packed_rest) = packed.split_at(self.packed_bytes[block]);
            let (to, unpacked_rest) = unpacked.split_at_mut(self.block_bytes(block));
            (packed, unpacked) = (packed_rest, unpacked_rest);
            jobs.push((block, from, to));
        }
        parallel::try_each(jobs.into_iter(), |(block, from, to)| {
            let mut decoder: Box<dyn Read> = match self.compressor {
                Compressor::Lz4 => return decode_lz4(from, to, block),
                Compressor::Zlib => Box::new(ZlibDecoder::new(from)),
                Compressor::Lzma => Box::new(XzReader::new_mem_limit(from, false, MOST_LZMA_KIB)),
            };
            for piece in to.chunks_mut(1 << 18) {
                if ticket.is_cancelled() {
                    return Err(Cancelled.into());
                }
                let read = bytes::read_full(&mut decoder, piece).map_err(damaged)?;
                if read < piece.len() {
                    return Err(corrupt(
                        format!("{} bytes in block {block}", self.block_bytes(block)),
                        "fewer",
                        "the file was altered: copy it again",
                    ));
                }
            }
            // Reading to the end has the checksum checked.
            let more = decoder.read(&mut [0; 1]).map_err(damaged)?;
            if more > 0 {
                return Err(corrupt(
                    format!("{} bytes in block {block}", self.block_bytes(block)),
                    "more",
                    "the file was altered: copy it again",
                ));
            }
            Ok(())
        })
    }
}

fn decode_lz4(from: &[u8], to: &mut [u8], block: usize) -> Result<(), Problem> {
    let expected = to.len();
    let wrong = |found: String| {
        corrupt(
            format!("{expected} bytes in block {block}"),
            found,
            "the file was altered: copy it again",
        )
    };
    match lz4_flex::block::decompress_into(from, to) {
        Ok(written) if written == expected => Ok(()),
        Ok(written) => Err(wrong(written.to_string())),
        Err(error) => Err(wrong(format!("damage ({error})"))),
    }
}

/// Appends bytes that are whole samples, in the file's order still.
fn append_bytes(samples: &mut Samples, stored: &[u8]) -> Result<(), Problem> {
    let size = samples.scalar_type().size_bytes();
    let count = stored.len() / size;
    with_samples!(samples, values => {
        let start = values.len();
        values.try_reserve(count).map_err(|_refused| {
            crate::core::memory::TooLarge {
                what: "the samples".into(),
                needed_bytes: (start + count) as u64 * size as u64,
                free_bytes: 0,
            }
        })?;
        values.resize(start + count, bytemuck::Zeroable::zeroed());
        bytemuck::cast_slice_mut::<_, u8>(&mut values[start..]).copy_from_slice(stored);
    });
    Ok(())
}

/// Exactly `count` bytes, in pieces, into memory that grows with them.
fn read_piecewise(
    reader: &mut dyn Read,
    count: usize,
    into: &mut Vec<u8>,
    ticket: &Ticket,
) -> Result<(), Problem> {
    const PIECE: usize = 1 << 18;
    into.clear();
    while into.len() < count {
        if ticket.is_cancelled() {
            return Err(Cancelled.into());
        }
        let start = into.len();
        into.resize(start + (count - start).min(PIECE), 0);
        let wanted = into.len() - start;
        if bytes::read_full(reader, &mut into[start..]).map_err(damaged)? < wanted {
            return Err(truncated(
                format!("{count} more bytes of compressed blocks"),
                "that the data end before",
                "the file was cut short: copy it again",
            ));
        }
    }
    Ok(())
}

fn damaged(error: io::Error) -> Problem {
    corrupt(
        "data that decode",
        format!("damage ({error})"),
        "the file was cut short or altered: copy it again",
    )
}

/// Base64 in units that may each end with padding, white space anywhere, up to the next `<`.
struct Base64<R> {
    reader: R,
    /// Characters of an unfinished group of four.
    group: Vec<u8>,
    decoded: Vec<u8>,
    /// How many of `decoded` were handed out.
    used: usize,
    is_at_end: bool,
}

impl<R: BufRead> Base64<R> {
    fn new(reader: R) -> Self {
        Self { reader, group: Vec::new(), decoded: Vec::new(), used: 0, is_at_end: false }
    }

    /// Decodes what the reader has buffered.
    fn refill(&mut self) -> io::Result<()> {
        self.decoded.clear();
        self.used = 0;
        let buffer = self.reader.fill_buf()?;
        // A slice's buffer is all of it: take it in pieces.
        let buffer = &buffer[..buffer.len().min(1 << 16)];
        let end = buffer.iter().position(|&b| b == b'<');
        let text = &buffer[..end.unwrap_or(buffer.len())];
        self.group.extend(text.iter().filter(|b| !b.is_ascii_whitespace()));
        let taken = text.len();
        self.is_at_end = buffer.is_empty() || end.is_some();
        self.reader.consume(taken);
        let whole = self.group.len() / 4 * 4;
        let mut rest = &self.group[..whole];
        while !rest.is_empty() {
            // A unit ends with the group that has padding in it.
            let padding = rest.iter().position(|&b| b == b'=');
            let unit = padding.map_or(rest.len(), |at| (at / 4 + 1) * 4);
            let start = self.decoded.len();
            self.decoded.resize(start + unit / 4 * 3, 0);
            let written = STANDARD
                .decode_slice(&rest[..unit], &mut self.decoded[start..])
                .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.to_string()))?;
            self.decoded.truncate(start + written);
            rest = &rest[unit..];
        }
        self.group.drain(..whole);
        if self.is_at_end && !self.group.is_empty() {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "base64 that ends in a group"));
        }
        Ok(())
    }
}

impl<R: BufRead> Read for Base64<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        while self.used == self.decoded.len() {
            if self.is_at_end {
                return Ok(0);
            }
            self.refill()?;
        }
        let ready = &self.decoded[self.used..];
        let taken = ready.len().min(bytes.len());
        bytes[..taken].copy_from_slice(&ready[..taken]);
        self.used += taken;
        Ok(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_base64_follow_each_other_whatever_their_padding() {
        let mut text = String::new();
        for part in ["a", "bcd", "ef"] {
            text += &STANDARD.encode(part);
            text += "\n ";
        }
        let mut decoded = String::new();
        Base64::new((text + "<!").as_bytes()).read_to_string(&mut decoded).unwrap();
        assert_eq!(decoded, "abcdef");
        assert!(Base64::new(&b"YWJ"[..]).read_to_string(&mut decoded).is_err());
        assert!(Base64::new(&b"Y*Jj"[..]).read_to_string(&mut decoded).is_err());
    }
}
