//! A file's bytes from some place on, unpacked where it is compressed with gzip.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::bytes::{self, DEFLATE_MOST, Endian, GZIP_MAGIC, Inflate, Progress};
use super::error::Problem;
use super::files;
use crate::core::progress::Ticket;
use crate::volume::{Samples, ScalarType};

/// A file that is read from its start, packed or not.
pub(super) enum Stream {
    Plain(BufReader<File>),
    Gzip(Inflate<BufReader<File>>),
}

impl Stream {
    /// Opens a file; and how many bytes it may hold at most, unpacked.
    ///
    /// # Errors
    /// Not a file that can be read.
    pub(super) fn open(path: &Path) -> Result<(Self, u64), Problem> {
        let (file, len) = files::open_file(path)?;
        let mut reader = files::buffered(file);
        let is_gzip = reader.fill_buf().map_err(Problem::Io)?.starts_with(&GZIP_MAGIC);
        Ok(match is_gzip {
            true => (Self::Gzip(Inflate::gzip(reader)), len.saturating_mul(DEFLATE_MOST)),
            false => (Self::Plain(reader), len),
        })
    }

    /// Up to `count` bytes of the start of what a file holds, unpacked; fewer where it ends or is damaged.
    pub(super) fn start(path: &Path, count: usize) -> Result<Vec<u8>, Problem> {
        let (mut stream, _) = Self::open(path)?;
        let mut start = vec![0; count];
        let mut filled = 0;
        while filled < count {
            match stream.read(&mut start[filled..]) {
                Ok(0) | Err(_) => break,
                Ok(read) => filled += read,
            }
        }
        start.truncate(filled);
        Ok(start)
    }

    /// Passes over bytes.
    ///
    /// # Errors
    /// The data end before; cancelled.
    pub(super) fn skip(&mut self, count: u64, ticket: &Ticket) -> Result<(), Problem> {
        match self {
            // What lies beyond the end is told when samples are read.
            Self::Plain(reader) => {
                let count = i64::try_from(count).unwrap_or(i64::MAX);
                reader.seek_relative(count).map_err(Problem::Io)
            }
            Self::Gzip(reader) => bytes::discard(reader, count, ticket),
        }
    }

    /// `count` samples in this machine's order from here on, the last of the file: what follows them is refused
    /// in packed data and told of others.
    ///
    /// # Errors
    /// Fewer samples, damage, cancelled.
    pub(super) fn last_samples(
        mut self,
        (scalar_type, count): (ScalarType, usize),
        endian: Endian,
        ticket: &Ticket,
        warnings: &mut Vec<String>,
    ) -> Result<Samples, Problem> {
        let samples = self.samples((scalar_type, count), endian, ticket)?;
        if self.finish()? {
            warnings.push("more bytes follow the samples: they are ignored".into());
        }
        Ok(samples)
    }

    /// `count` samples in this machine's order from here on.
    ///
    /// # Errors
    /// Fewer samples, damage, cancelled.
    pub(super) fn samples(
        &mut self,
        (scalar_type, count): (ScalarType, usize),
        endian: Endian,
        ticket: &Ticket,
    ) -> Result<Samples, Problem> {
        let mut samples = bytes::no_samples(scalar_type);
        if matches!(self, Self::Plain(_)) {
            bytes::reserve_samples(&mut samples, count)?;
        }
        let total = (count * scalar_type.size_bytes()) as u64;
        bytes::append(&mut samples, self, count, &mut Progress::new(ticket, total))?;
        bytes::to_native(&mut samples, endian);
        Ok(samples)
    }

    /// Whether bytes follow; of packed data after their checksums were checked.
    ///
    /// # Errors
    /// A wrong checksum, or more packed data.
    pub(super) fn finish(&mut self) -> Result<bool, Problem> {
        match self {
            Self::Plain(reader) => Ok(bytes::rest(reader)? > 0),
            Self::Gzip(reader) => reader.finish(),
        }
    }
}

impl Read for Stream {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::Plain(reader) => reader.read(bytes),
            Self::Gzip(reader) => reader.read(bytes),
        }
    }
}
