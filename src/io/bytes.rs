//! Bytes to samples: in pieces, so that a cancel is answered soon, and into memory that grows with
//! what was really decoded.

use std::io::{self, BufRead, Read};

use bytemuck::Pod;
use bzip2::bufread::BzDecoder;
use flate2::bufread::{GzDecoder, ZlibDecoder};
use serde::{Deserialize, Serialize};

use super::error::{Problem, corrupt, quoted_bytes, truncated};
use crate::core::memory::{self, TooLarge};
use crate::core::progress::Ticket;
use crate::volume::{Samples, ScalarType};
use crate::with_samples;

/// Bytes read or decoded between two looks at the ticket: well under a millisecond of work.
const PIECE_BYTES: usize = 1 << 18;
/// Deflate cannot shrink anything further than this (two bits for 258).
pub(super) const DEFLATE_MOST: u64 = 1032;

/// What gzip data begin with.
pub(super) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// The order of a stored number's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Endian {
    /// Least significant first.
    Little,
    /// Most significant first.
    Big,
}

impl Endian {
    /// This machine's.
    pub const NATIVE: Self = if cfg!(target_endian = "little") { Self::Little } else { Self::Big };
}

/// One load's way to its ticket.
pub(super) struct Progress<'a> {
    ticket: &'a Ticket,
    done_bytes: u64,
    total_bytes: u64,
}

impl<'a> Progress<'a> {
    /// Of a load that will decode `total_bytes`.
    pub(super) fn new(ticket: &'a Ticket, total_bytes: u64) -> Self {
        Self { ticket, done_bytes: 0, total_bytes }
    }

    pub(super) fn advance(&mut self, bytes: usize) -> Result<(), Problem> {
        self.done_bytes += bytes as u64;
        Ok(self.ticket.checkpoint(self.done_bytes, self.total_bytes)?)
    }

    pub(super) fn ticket(&self) -> &Ticket {
        self.ticket
    }
}

/// A stored number: any bytes make one, and it can change its byte order.
pub(super) trait Stored: Pod + Send + Sync {
    fn swapped(self) -> Self;
    /// The number in decimal text, if it is one of this type.
    fn from_text(text: &str) -> Option<Self>;
}

macro_rules! stored {
    ($swap:expr, $($t:ty),*) => { $(impl Stored for $t {
        fn swapped(self) -> Self {
            let swap: fn(Self) -> Self = $swap;
            swap(self)
        }

        fn from_text(text: &str) -> Option<Self> {
            text.parse().ok()
        }
    })* };
}
stored!(|v| v.swap_bytes(), u8, i8, u16, i16, u32, i32, u64, i64);
stored!(|v| Self::from_bits(v.to_bits().swap_bytes()), f32, f64);

/// No samples yet, of a type.
pub(super) fn no_samples(scalar_type: ScalarType) -> Samples {
    match scalar_type {
        ScalarType::UInt8 => Samples::UInt8(Vec::new()),
        ScalarType::Int8 => Samples::Int8(Vec::new()),
        ScalarType::UInt16 => Samples::UInt16(Vec::new()),
        ScalarType::Int16 => Samples::Int16(Vec::new()),
        ScalarType::UInt32 => Samples::UInt32(Vec::new()),
        ScalarType::Int32 => Samples::Int32(Vec::new()),
        ScalarType::UInt64 => Samples::UInt64(Vec::new()),
        ScalarType::Int64 => Samples::Int64(Vec::new()),
        ScalarType::Float32 => Samples::Float32(Vec::new()),
        ScalarType::Float64 => Samples::Float64(Vec::new()),
    }
}

/// `count` zeros of a type; the caller has checked that memory holds them.
pub(super) fn zero_samples(scalar_type: ScalarType, count: usize) -> Result<Samples, Problem> {
    let mut samples = no_samples(scalar_type);
    with_samples!(&mut samples, values => {
        reserve(values, count)?;
        values.resize(count, bytemuck::Zeroable::zeroed());
    });
    Ok(samples)
}

fn reserve<T>(values: &mut Vec<T>, more: usize) -> Result<(), Problem> {
    values.try_reserve_exact(more).map_err(|_refused| {
        let needed_bytes = (values.len() as u64 + more as u64) * size_of::<T>() as u64;
        let free_bytes = memory::free_bytes().min(needed_bytes.saturating_sub(1));
        TooLarge { what: "the samples".into(), needed_bytes, free_bytes }.into()
    })
}

/// Room for `count` samples at once, for when the file is known to hold them.
pub(super) fn reserve_samples(samples: &mut Samples, count: usize) -> Result<(), Problem> {
    with_samples!(samples, values => reserve(values, count))
}

/// Appends `count` samples as stored; memory doubles as decoding proves that they are there.
///
/// # Errors
/// [`Problem::Truncated`] where the reader ends early, [`Problem::Corrupt`] where it fails.
pub(super) fn append(
    samples: &mut Samples,
    reader: &mut dyn Read,
    count: usize,
    progress: &mut Progress<'_>,
) -> Result<(), Problem> {
    with_samples!(samples, values => append_values(values, reader, count, progress))
}

fn append_values<T: Stored>(
    values: &mut Vec<T>,
    reader: &mut dyn Read,
    count: usize,
    progress: &mut Progress<'_>,
) -> Result<(), Problem> {
    let piece = PIECE_BYTES / size_of::<T>();
    let start = values.len();
    while values.len() - start < count {
        let len = values.len();
        let left = count - (len - start);
        let take = left.min(piece);
        if values.capacity() - len < take {
            reserve(values, left.min(len.max(take)))?;
        }
        values.resize(len + take, T::zeroed());
        let bytes = bytemuck::cast_slice_mut(&mut values[len..]);
        let read = read_full(reader, bytes).map_err(decoding)?;
        if read < bytes.len() {
            let size = size_of::<T>();
            return Err(truncated(
                format!("{} bytes of samples", count * size),
                format!("that they end after {}", (len - start) * size + read),
                "the file was cut short or its header is wrong: copy it again",
            ));
        }
        progress.advance(read)?;
    }
    Ok(())
}

/// A decoder's failure in the words of an error.
fn decoding(error: io::Error) -> Problem {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => truncated(
            "a complete compressed stream",
            "that it ends in the middle",
            "the file was cut short: copy it again",
        ),
        io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput | io::ErrorKind::Other => corrupt(
            "samples that decode",
            format!("damage ({error})"),
            "the file was altered: copy it again",
        ),
        _ => Problem::Io(error),
    }
}

/// Fills `bytes` as far as the reader goes.
pub(super) fn read_full(reader: &mut dyn Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < bytes.len() {
        match reader.read(&mut bytes[filled..]) {
            Ok(0) => break,
            Ok(read) => filled += read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Reads and drops `count` bytes.
pub(super) fn discard(
    reader: &mut dyn Read,
    mut count: u64,
    ticket: &Ticket,
) -> Result<(), Problem> {
    let mut waste = vec![0; PIECE_BYTES];
    while count > 0 {
        if ticket.is_cancelled() {
            return Err(crate::core::Cancelled.into());
        }
        let take = usize::try_from(count).map_or(PIECE_BYTES, |n| n.min(PIECE_BYTES));
        if read_full(reader, &mut waste[..take]).map_err(decoding)? < take {
            return Err(truncated(
                "as many bytes as the header says to skip",
                "that the data end before",
                "correct the skip in the header",
            ));
        }
        count -= take as u64;
    }
    Ok(())
}

/// Reads to the end and counts.
pub(super) fn count_rest(reader: &mut dyn Read, ticket: &Ticket) -> Result<u64, Problem> {
    let mut waste = vec![0; PIECE_BYTES];
    let mut count = 0;
    loop {
        if ticket.is_cancelled() {
            return Err(crate::core::Cancelled.into());
        }
        match read_full(reader, &mut waste).map_err(decoding)? {
            0 => return Ok(count),
            read => count += read as u64,
        }
    }
}

/// How many bytes are left, up to the first piece: 0 is the end. Reading to the end also makes a
/// decoder check its stream's checksum.
pub(super) fn rest(reader: &mut dyn Read) -> Result<usize, Problem> {
    let mut tail = [0; 64];
    read_full(reader, &mut tail).map_err(decoding)
}

/// Puts samples that were stored in `endian` into this machine's order.
pub(super) fn to_native(samples: &mut Samples, endian: Endian) {
    if endian == Endian::NATIVE {
        return;
    }
    with_samples!(samples, values => values.iter_mut().for_each(|v| *v = v.swapped()));
}

/// Appends `count` numbers written in decimal, separated by white space or commas.
///
/// # Errors
/// [`Problem::Corrupt`] at the first word that is no number of the type.
pub(super) fn append_text(
    samples: &mut Samples,
    reader: &mut dyn BufRead,
    count: usize,
    progress: &mut Progress<'_>,
) -> Result<(), Problem> {
    let type_name = samples.scalar_type().name();
    with_samples!(samples, values => {
        let mut words = Words { reader, word: Vec::new() };
        for done in 0..count {
            words.expect_next(done, count)?;
            let number = std::str::from_utf8(&words.word).ok().and_then(Stored::from_text);
            values.push(number.ok_or_else(|| corrupt(
                format!("numbers of type {type_name} in text"),
                quoted_bytes(&words.word),
                "correct the number or the type in the header",
            ))?);
            if done % 4096 == 0 {
                progress.advance(4096.min(count))?;
            }
        }
    });
    Ok(())
}

/// The samples of several files, one after another; `append` adds those of one, and says whether more bytes follow
/// them. Room is made at once where the samples are stored as they are.
pub(super) fn of_parts<P>(
    parts: &[P],
    (scalar_type, count, is_plain): (ScalarType, usize, bool),
    ticket: &Ticket,
    warnings: &mut Vec<String>,
    mut append: impl FnMut(&P, &mut Samples, &mut Progress<'_>) -> Result<bool, Problem>,
) -> Result<Samples, Problem> {
    let mut samples = no_samples(scalar_type);
    if is_plain {
        reserve_samples(&mut samples, count)?;
    }
    let mut progress = Progress::new(ticket, (count * scalar_type.size_bytes()) as u64);
    let mut more = false;
    for part in parts {
        more |= append(part, &mut samples, &mut progress)?;
    }
    if more {
        warnings.push("more bytes follow the samples: they are ignored".into());
    }
    Ok(samples)
}

/// Reads over `count` words of text.
///
/// # Errors
/// [`Problem::Truncated`] where there are fewer.
pub(super) fn skip_text(
    reader: &mut dyn BufRead,
    count: usize,
    progress: &mut Progress<'_>,
) -> Result<(), Problem> {
    let mut words = Words { reader, word: Vec::new() };
    for done in 0..count {
        words.expect_next(done, count)?;
        if done % 4096 == 0 {
            progress.advance(4096.min(count))?;
        }
    }
    Ok(())
}

/// Words between white space and commas.
pub(super) struct Words<'a> {
    reader: &'a mut dyn BufRead,
    word: Vec<u8>,
}

impl Words<'_> {
    /// Moves to the word behind `done` of `count`.
    fn expect_next(&mut self, done: usize, count: usize) -> Result<(), Problem> {
        if self.next()? {
            return Ok(());
        }
        Err(truncated(
            format!("{count} numbers in text"),
            format!("that they end after {done}"),
            "the file was cut short or its header is wrong: copy it again",
        ))
    }

    /// Moves to the next word; false at the end.
    fn next(&mut self) -> Result<bool, Problem> {
        const LONGEST: usize = 4096;
        let separates = |b: &u8| b.is_ascii_whitespace() || *b == b',';
        self.word.clear();
        loop {
            let buffer = self.reader.fill_buf().map_err(decoding)?;
            if buffer.is_empty() {
                return Ok(!self.word.is_empty());
            }
            let skipped = if self.word.is_empty() {
                buffer.iter().position(|b| !separates(b)).unwrap_or(buffer.len())
            } else {
                0
            };
            let word = &buffer[skipped..];
            let end = word.iter().position(separates);
            let taken = end.unwrap_or(word.len());
            // No number is longer; the rest of a longer word is dropped, it fails as it is.
            let kept = taken.min(LONGEST.saturating_sub(self.word.len()));
            self.word.extend_from_slice(&word[..kept]);
            self.reader.consume(skipped + taken);
            if end.is_some() && !self.word.is_empty() {
                return Ok(true);
            }
        }
    }
}

/// A compressed stream of one or more members, followed by anything.
///
/// Unlike the decoders' own multi-member forms it does not fail on what follows the last member
/// as long as no more bytes are asked for than the members hold.
pub(super) enum Inflate<R: BufRead> {
    /// See [`GzDecoder`].
    Gzip(GzDecoder<R>),
    /// See [`BzDecoder`].
    Bzip2(BzDecoder<R>),
    /// One zlib stream.
    Zlib(ZlibDecoder<R>),
    /// Behind the last member, where bytes of no stream may follow.
    After(R),
    /// Between members.
    Spent,
}

impl<R: BufRead> Inflate<R> {
    pub(super) fn gzip(reader: R) -> Self {
        Self::Gzip(GzDecoder::new(reader))
    }

    pub(super) fn bzip2(reader: R) -> Self {
        Self::Bzip2(BzDecoder::new(reader))
    }

    /// zlib, or gzip where its magic says so.
    pub(super) fn zlib(mut reader: R) -> io::Result<Self> {
        let is_gzip = reader.fill_buf()?.starts_with(&GZIP_MAGIC);
        Ok(if is_gzip { Self::gzip(reader) } else { Self::Zlib(ZlibDecoder::new(reader)) })
    }

    /// Reads to the end of the data, which has every checksum checked; whether bytes that are of no stream
    /// follow.
    ///
    /// # Errors
    /// [`Problem::Corrupt`] where the data hold more than was asked for: what they are is not what the header says.
    pub(super) fn finish(&mut self) -> Result<bool, Problem> {
        let more = self.read(&mut [0; 1]);
        match more {
            Ok(0) => {}
            Ok(_) => {
                return Err(corrupt(
                    "compressed data that end where the samples do",
                    "more data",
                    "the file was altered or its header's sizes are wrong: copy it again",
                ));
            }
            Err(error) => return Err(decoding(error)),
        }
        Ok(match self {
            Self::After(reader) => !reader.fill_buf().map_err(decoding)?.is_empty(),
            Self::Gzip(_) | Self::Bzip2(_) | Self::Zlib(_) | Self::Spent => false,
        })
    }

    fn read_member(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Gzip(decoder) => decoder.read(bytes),
            Self::Bzip2(decoder) => decoder.read(bytes),
            Self::Zlib(decoder) => decoder.read(bytes),
            Self::After(_) | Self::Spent => Ok(0),
        }
    }
}

impl<R: BufRead> Read for Inflate<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if bytes.is_empty() {
            return Ok(0);
        }
        loop {
            let read = self.read_member(bytes)?;
            if read > 0 {
                return Ok(read);
            }
            *self = match std::mem::replace(self, Self::Spent) {
                Self::Gzip(decoder) => {
                    let mut reader = decoder.into_inner();
                    match reader.fill_buf()?.starts_with(&GZIP_MAGIC) {
                        true => Self::gzip(reader),
                        false => Self::After(reader),
                    }
                }
                Self::Bzip2(decoder) => {
                    let mut reader = decoder.into_inner();
                    match reader.fill_buf()?.starts_with(b"BZh") {
                        true => Self::bzip2(reader),
                        false => Self::After(reader),
                    }
                }
                Self::Zlib(decoder) => Self::After(decoder.into_inner()),
                Self::After(reader) => Self::After(reader),
                Self::Spent => Self::Spent,
            };
            if matches!(self, Self::After(_) | Self::Spent) {
                return Ok(0);
            }
        }
    }
}

/// Two hexadecimal digits a byte, white space ignored.
pub(super) struct Hex<R>(pub(super) R);

impl<R: BufRead> Read for Hex<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        let mut high = None;
        while filled < bytes.len() {
            let buffer = self.0.fill_buf()?;
            let Some(&byte) = buffer.first() else { break };
            self.0.consume(1);
            if byte.is_ascii_whitespace() {
                continue;
            }
            let digit = char::from(byte).to_digit(16).and_then(|d| u8::try_from(d).ok());
            let digit = digit.ok_or_else(|| {
                io::Error::new(io::ErrorKind::InvalidData, "a byte that is no hexadecimal digit")
            })?;
            match high.take() {
                None => high = Some(digit),
                Some(high) => {
                    bytes[filled] = high << 4 | digit;
                    filled += 1;
                }
            }
        }
        Ok(filled)
    }
}

/// The number of samples and their bytes, refused before anything is allocated for them.
///
/// # Errors
/// A zero or overflowing size, or more than `free_bytes`.
pub(super) fn checked_count(
    what: &str,
    sizes: &[u64],
    scalar_type: ScalarType,
    free_bytes: u64,
) -> Result<usize, Problem> {
    use super::error::header;
    if sizes.contains(&0) {
        return Err(header(
            format!("{what} of at least one sample along each axis"),
            format!("sizes {sizes:?}"),
            "correct the sizes in the header",
        ));
    }
    let count = memory::checked_product(sizes);
    let bytes = count.and_then(|n| n.checked_mul(scalar_type.size_bytes() as u64));
    let (Some(count), Some(bytes)) = (count, bytes) else {
        return Err(header(
            format!("{what} whose size in bytes fits in 64 bits"),
            format!("sizes {sizes:?} of {}", scalar_type.name()),
            "correct the sizes in the header",
        ));
    };
    memory::require(what, bytes, free_bytes)?;
    usize::try_from(count).map_err(|_too_many| {
        TooLarge { what: what.to_owned(), needed_bytes: bytes, free_bytes: usize::MAX as u64 }
            .into()
    })
}

/// Refuses a promise that the stored bytes cannot keep.
///
/// # Errors
/// [`Problem::Truncated`].
pub(super) fn require_stored(needed_bytes: u64, stored_bytes: u64) -> Result<(), Problem> {
    if needed_bytes <= stored_bytes {
        return Ok(());
    }
    Err(truncated(
        format!("{needed_bytes} bytes of data, as the header promises"),
        format!("{stored_bytes}"),
        "the file was cut short or its header is wrong: copy it again",
    ))
}

/// Refuses a promise of so many numbers in text that so many bytes cannot keep: each is a character and a blank behind it, but
/// for the last.
///
/// # Errors
/// [`Problem::Truncated`].
pub(super) fn require_text(numbers: u64, stored_bytes: u64) -> Result<(), Problem> {
    if numbers <= stored_bytes.div_ceil(2) {
        return Ok(());
    }
    Err(truncated(
        format!("{numbers} numbers in text, as the header promises"),
        format!("{stored_bytes} bytes, which hold fewer"),
        "the file was cut short or its header is wrong: copy it again",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floats(text: &str, count: usize) -> Result<Samples, Problem> {
        let mut samples = no_samples(ScalarType::Float32);
        let ticket = Ticket::new();
        let mut progress = Progress::new(&ticket, 1);
        append_text(&mut samples, &mut text.as_bytes(), count, &mut progress)?;
        Ok(samples)
    }

    #[test]
    fn numbers_in_text_may_be_separated_by_anything_blank_and_be_infinite() {
        let read = floats(" 1,2.5\n-3e2\t inf", 4).unwrap();
        assert_eq!(read, Samples::Float32(vec![1.0, 2.5, -300.0, f32::INFINITY]));
        assert!(matches!(floats("1 2", 3), Err(Problem::Truncated(_))));
        assert!(matches!(floats("1 two 3", 3), Err(Problem::Corrupt(_))));
    }

    #[test]
    fn a_stream_of_two_members_is_one_stream_and_what_follows_is_left_alone() {
        use std::io::Write;
        let mut file = Vec::new();
        for part in [b"abc", b"def"] {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), Default::default());
            encoder.write_all(part).unwrap();
            file.extend(encoder.finish().unwrap());
        }
        file.extend(b"not gzip");
        let mut reader = Inflate::gzip(&file[..]);
        let mut bytes = [0; 6];
        assert_eq!(read_full(&mut reader, &mut bytes).unwrap(), 6);
        assert_eq!(&bytes, b"abcdef");
        assert!(reader.finish().unwrap(), "bytes follow");
        let mut whole = Inflate::gzip(&file[..file.len() - 8]);
        read_full(&mut whole, &mut bytes).unwrap();
        assert!(!whole.finish().unwrap(), "nothing follows");
        // Members and bytes of one that nobody asked for.
        for asked in [2, 3] {
            let mut reader = Inflate::gzip(&file[..]);
            read_full(&mut reader, &mut bytes[..asked]).unwrap();
            assert!(matches!(reader.finish(), Err(Problem::Corrupt(_))), "after {asked}");
        }
    }

    #[test]
    fn a_checksum_is_looked_at_though_all_samples_were_read() {
        use std::io::Write;
        let content = b"samples of noise: 8f3kq0";
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::none());
        encoder.write_all(content).unwrap();
        let mut file = encoder.finish().unwrap();
        let at = file.len() - 12;
        file[at] ^= 1;
        let mut reader = Inflate::gzip(&file[..]);
        let mut bytes = [0; 24];
        assert_eq!(read_full(&mut reader, &mut bytes).unwrap(), 24);
        assert_ne!(&bytes, content);
        assert!(matches!(reader.finish(), Err(Problem::Corrupt(_))));
    }

    #[test]
    fn sizes_that_are_zero_overflow_or_do_not_fit_are_refused() {
        let count = |sizes: &[u64]| checked_count("a volume", sizes, ScalarType::Float64, 1 << 20);
        assert_eq!(count(&[4, 4, 4]).unwrap(), 64);
        assert!(matches!(count(&[4, 0, 4]), Err(Problem::Header(_))));
        assert!(matches!(count(&[1 << 31, 1 << 31, 2]), Err(Problem::Header(_))));
        assert!(matches!(count(&[1 << 10, 1 << 10, 1]), Err(Problem::TooLarge(_))));
    }

    #[test]
    fn a_cancelled_read_stops_within_a_piece() {
        let ticket = Ticket::new();
        ticket.cancel();
        let mut samples = no_samples(ScalarType::UInt8);
        let mut progress = Progress::new(&ticket, 1 << 30);
        let result = append(&mut samples, &mut io::repeat(7), 1 << 30, &mut progress);
        assert!(matches!(result, Err(Problem::Cancelled(_))));
        assert!(samples.len() <= PIECE_BYTES);
    }

    #[test]
    fn hexadecimal_is_read_across_lines_and_letters_beyond_f_are_refused() {
        let mut bytes = [0; 3];
        assert_eq!(read_full(&mut Hex(&b"00 fF\n7a"[..]), &mut bytes).unwrap(), 3);
        assert_eq!(bytes, [0, 255, 122]);
        assert!(read_full(&mut Hex(&b"0g"[..]), &mut bytes).is_err());
    }
}
