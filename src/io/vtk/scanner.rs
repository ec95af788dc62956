//! A legacy VTK file from front to back: lines of words, and between them numbers as text or bytes.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};

use super::super::bytes::{self, Endian, Progress};
use super::super::error::{Problem, corrupt, header, quoted, quoted_bytes, truncated, unsupported};
use crate::core::memory;
use crate::core::progress::Ticket;
use crate::volume::{Samples, ScalarType};

/// No line of keywords is longer.
const LONGEST_LINE: usize = 4096;

/// How an array is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stored {
    /// Numbers of a type.
    Numbers(ScalarType),
    /// Eight in a byte, the first the highest; as text 0 or 1.
    Bits,
    /// Text of any length: read over.
    Strings,
}

impl Stored {
    /// The type of VTK's name, any letters' case.
    ///
    /// # Errors
    /// No type, or one whose size nothing tells.
    pub(super) fn from_name(name: &str) -> Result<Self, Problem> {
        Ok(Self::Numbers(match name.to_ascii_lowercase().as_str() {
            "bit" => return Ok(Self::Bits),
            "string" | "utf8_string" => return Ok(Self::Strings),
            "unsigned_char" | "vtktypeuint8" => ScalarType::UInt8,
            "char" | "signed_char" | "vtktypeint8" => ScalarType::Int8,
            "unsigned_short" | "vtktypeuint16" => ScalarType::UInt16,
            "short" | "vtktypeint16" => ScalarType::Int16,
            "unsigned_int" | "vtktypeuint32" => ScalarType::UInt32,
            // Ids are written with 32 bits, whatever they have in memory.
            "int" | "vtkidtype" | "vtktypeint32" => ScalarType::Int32,
            "unsigned_long" | "unsigned_long_long" | "vtktypeuint64" => ScalarType::UInt64,
            "long" | "long_long" | "vtktypeint64" => ScalarType::Int64,
            "float" | "vtktypefloat32" => ScalarType::Float32,
            "double" | "vtktypefloat64" => ScalarType::Float64,
            _ => {
                return Err(unsupported(
                    "a type of legacy VTK such as unsigned_char, short, int, float or double",
                    quoted(name),
                    "correct the type, or write the file again",
                ));
            }
        }))
    }
}

/// The file, and how far into it.
pub(super) struct Scanner<'a> {
    reader: BufReader<File>,
    at: u64,
    len: u64,
    pub(super) is_binary: bool,
    free_bytes: u64,
    taken_bytes: u64,
    progress: Progress<'a>,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(
        reader: BufReader<File>,
        len: u64,
        free_bytes: u64,
        ticket: &'a Ticket,
    ) -> Self {
        let progress = Progress::new(ticket, len);
        Self { reader, at: 0, len, is_binary: false, free_bytes, taken_bytes: 0, progress }
    }

    fn left_bytes(&self) -> u64 {
        self.len.saturating_sub(self.at)
    }

    /// Takes note of memory that is about to be asked for.
    ///
    /// # Errors
    /// More than is free.
    pub(super) fn take_memory(&mut self, more_bytes: u64) -> Result<(), Problem> {
        self.taken_bytes = self.taken_bytes.saturating_add(more_bytes);
        Ok(memory::require("the arrays of the file", self.taken_bytes, self.free_bytes)?)
    }

    /// Refuses a promise of numbers that what is left of the file cannot keep, before memory is asked for them: each takes a
    /// byte at least.
    pub(super) fn require_numbers(&self, count: usize) -> Result<(), Problem> {
        match self.is_binary {
            true => bytes::require_stored(count as u64, self.left_bytes()),
            false => bytes::require_text(count as u64, self.left_bytes()),
        }
    }

    /// The next line without its end; `None` at the end of the file.
    pub(super) fn raw_line(&mut self) -> Result<Option<String>, Problem> {
        let mut line = Vec::new();
        let most = (LONGEST_LINE + 1) as u64;
        let read =
            (&mut self.reader).take(most).read_until(b'\n', &mut line).map_err(Problem::Io)?;
        self.at += read as u64;
        if read == 0 {
            return Ok(None);
        }
        if read > LONGEST_LINE {
            return Err(corrupt(
                format!("lines of keywords of at most {LONGEST_LINE} bytes"),
                format!("a longer one that begins with {}", quoted_bytes(&line)),
                "the file was altered, or a count before it is wrong: copy it again",
            ));
        }
        Ok(Some(String::from_utf8_lossy(&line).trim_end_matches(['\n', '\r']).to_owned()))
    }

    /// The words of the next line that has any; `None` at the end of the file.
    pub(super) fn line(&mut self) -> Result<Option<Vec<String>>, Problem> {
        while let Some(line) = self.raw_line()? {
            let words: Vec<String> = line.split_ascii_whitespace().map(str::to_owned).collect();
            if !words.is_empty() {
                return Ok(Some(words));
            }
        }
        Ok(None)
    }

    /// `words` with those of the lines below, until there are `count`.
    pub(super) fn words(
        &mut self,
        mut words: Vec<String>,
        count: usize,
    ) -> Result<Vec<String>, Problem> {
        while words.len() < count {
            let Some(more) = self.line()? else {
                return Err(truncated(
                    format!("{} values after {}", count - 1, quoted(&words[0])),
                    format!("that the file ends after {}", words.len() - 1),
                    "the file was cut short: copy it again",
                ));
            };
            words.extend(more);
        }
        Ok(words)
    }

    /// Whether a word follows next, in any letters' case; nothing is consumed.
    pub(super) fn is_next(&mut self, word: &str) -> Result<bool, Problem> {
        let mut ahead = vec![0; word.len() + 16];
        let read = bytes::read_full(&mut self.reader, &mut ahead).map_err(Problem::Io)?;
        let back = i64::try_from(read).unwrap_or(0);
        self.reader.seek_relative(-back).map_err(Problem::Io)?;
        let ahead = ahead[..read].trim_ascii_start();
        let same = ahead.get(..word.len()).is_some_and(|a| a.eq_ignore_ascii_case(word.as_bytes()));
        let ends = ahead.get(word.len()).is_none_or(u8::is_ascii_whitespace);
        Ok(same && ends)
    }

    /// The next `count` numbers, in this machine's order.
    ///
    /// # Errors
    /// More than memory or the file holds, or text that is no number.
    pub(super) fn samples(&mut self, stored: Stored, count: usize) -> Result<Samples, Problem> {
        let scalar_type = match stored {
            Stored::Numbers(scalar_type) => scalar_type,
            Stored::Bits => ScalarType::UInt8,
            Stored::Strings => {
                return Err(unsupported(
                    "numbers",
                    "an array of strings",
                    "write the file again without it",
                ));
            }
        };
        let bytes = (count as u64).saturating_mul(scalar_type.size_bytes() as u64);
        self.take_memory(bytes)?;
        let mut samples = bytes::no_samples(scalar_type);
        if !self.is_binary {
            // A number is a character at least, and a blank between two.
            bytes::require_text(count as u64, self.left_bytes())?;
            let mut reader = Counting { reader: &mut self.reader, at: &mut self.at };
            bytes::append_text(&mut samples, &mut reader, count, &mut self.progress)?;
            return Ok(samples);
        }
        if stored == Stored::Bits {
            return self.bits(count);
        }
        bytes::require_stored(bytes, self.left_bytes())?;
        bytes::reserve_samples(&mut samples, count)?;
        let mut reader = Counting { reader: &mut self.reader, at: &mut self.at };
        bytes::append(&mut samples, &mut reader, count, &mut self.progress)?;
        bytes::to_native(&mut samples, Endian::Big);
        Ok(samples)
    }

    fn bits(&mut self, count: usize) -> Result<Samples, Problem> {
        let Samples::UInt8(packed) =
            self.samples(Stored::Numbers(ScalarType::UInt8), count.div_ceil(8))?
        else {
            unreachable!("bytes were asked for")
        };
        let bit = |i: usize| packed[i / 8] >> (7 - i % 8) & 1;
        Ok(Samples::UInt8((0..count).map(bit).collect()))
    }

    /// Reads over `count` values.
    pub(super) fn skip(&mut self, stored: Stored, count: usize) -> Result<(), Problem> {
        match stored {
            Stored::Strings => {
                for _ in 0..count {
                    self.skip_string()?;
                }
                Ok(())
            }
            Stored::Numbers(scalar_type) if self.is_binary => {
                let bytes = (count as u64).saturating_mul(scalar_type.size_bytes() as u64);
                self.skip_bytes(bytes)
            }
            Stored::Bits if self.is_binary => self.skip_bytes(count.div_ceil(8) as u64),
            // Words of text, whatever they are.
            _ => {
                bytes::require_text(count as u64, self.left_bytes())?;
                let mut reader = Counting { reader: &mut self.reader, at: &mut self.at };
                bytes::skip_text(&mut reader, count, &mut self.progress)
            }
        }
    }

    fn skip_bytes(&mut self, count: u64) -> Result<(), Problem> {
        bytes::require_stored(count, self.left_bytes())?;
        let mut reader = Counting { reader: &mut self.reader, at: &mut self.at };
        bytes::discard(&mut reader, count, self.progress.ticket())
    }

    /// One string: a line as text; as bytes, a length whose own is in its first two bits, and so many.
    fn skip_string(&mut self) -> Result<(), Problem> {
        let ended = || {
            truncated("more strings", "that the file ends", "the file was cut short: copy it again")
        };
        if !self.is_binary {
            return self.raw_line()?.map(|_| ()).ok_or_else(ended);
        }
        let mut bytes = [0_u8; 8];
        let mut reader = Counting { reader: &mut self.reader, at: &mut self.at };
        if bytes::read_full(&mut reader, &mut bytes[..1]).map_err(Problem::Io)? < 1 {
            return Err(ended());
        }
        let more = [7, 3, 1, 0][usize::from(bytes[0] >> 6)];
        if bytes::read_full(&mut reader, &mut bytes[1..=more]).map_err(Problem::Io)? < more {
            return Err(ended());
        }
        let first = u64::from(bytes[0] & 0x3f);
        let length = bytes[1..=more].iter().fold(first, |n, &byte| n << 8 | u64::from(byte));
        self.skip_bytes(length)
    }
}

/// Counts what is consumed.
struct Counting<'a> {
    reader: &'a mut BufReader<File>,
    at: &'a mut u64,
}

impl Read for Counting<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(bytes)?;
        *self.at += read as u64;
        Ok(read)
    }
}

impl BufRead for Counting<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        *self.at += count as u64;
        self.reader.consume(count);
    }
}

/// One word as a number.
///
/// # Errors
/// Text that is none.
pub(super) fn number<T: std::str::FromStr>(keyword: &str, text: &str) -> Result<T, Problem> {
    text.parse().map_err(|_not| {
        header(
            format!("a number after {}", quoted(keyword)),
            quoted(text),
            "correct the number, or a count before it",
        )
    })
}
