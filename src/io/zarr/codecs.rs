//! How Zarr packs chunks: gzip, zlib, bzip2, zstd, LZ4, Blosc (of LZ4, zlib and zstd), and checksums.

use std::io::Read;

use super::super::error::{Problem, corrupt, quoted, unsupported};
use crate::core::panics::caught;

/// One step of packing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Gzip,
    Zlib,
    Bzip2,
    Zstd,
    /// The length, then a block.
    Lz4,
    Blosc,
    /// A checksum of four bytes at the end.
    Crc32c,
}

impl Codec {
    /// # Errors
    /// One that is not read.
    pub(super) fn of(name: &str) -> Result<Self, Problem> {
        Ok(match name {
            "gzip" => Self::Gzip,
            "zlib" | "numcodecs.zlib" => Self::Zlib,
            "bz2" | "numcodecs.bz2" => Self::Bzip2,
            "zstd" => Self::Zstd,
            "lz4" | "numcodecs.lz4" => Self::Lz4,
            "blosc" => Self::Blosc,
            "crc32c" => Self::Crc32c,
            _ => {
                return Err(unsupported(
                    "chunks packed with gzip, zlib, bzip2, zstd, LZ4 or Blosc",
                    quoted(name),
                    "write the array with one of these",
                ));
            }
        })
    }

    /// What was packed; no more than `most` bytes of it.
    ///
    /// # Errors
    /// Damage, or more bytes.
    pub(super) fn unpack(self, packed: &[u8], most: usize) -> Result<Vec<u8>, Problem> {
        caught(|| match self {
            Self::Gzip => limited(flate2::read::MultiGzDecoder::new(packed), most),
            Self::Zlib => limited(flate2::read::ZlibDecoder::new(packed), most),
            Self::Bzip2 => limited(bzip2::read::MultiBzDecoder::new(packed), most),
            Self::Zstd => zstd(packed, most),
            Self::Lz4 => {
                let (len, block) =
                    packed.split_first_chunk::<4>().ok_or_else(|| damaged("no length"))?;
                let len = u32::from_le_bytes(*len) as usize;
                if len > most {
                    return Err(damaged("more bytes than the chunk has"));
                }
                lz4(block, len)
            }
            Self::Blosc => blosc(packed, most),
            Self::Crc32c => {
                let (content, sum) =
                    packed.split_last_chunk::<4>().ok_or_else(|| damaged("no checksum"))?;
                if crc32c(content) != u32::from_le_bytes(*sum) {
                    return Err(damaged("a wrong checksum"));
                }
                Ok(content.to_vec())
            }
        })
        .unwrap_or_else(|words| Err(damaged(&words)))
    }
}

fn damaged(words: &str) -> Problem {
    corrupt("chunks that unpack", quoted(words), "the folder was altered: copy it again")
}

fn limited(reader: impl Read, most: usize) -> Result<Vec<u8>, Problem> {
    let mut unpacked = Vec::new();
    let read = reader.take(most as u64 + 1).read_to_end(&mut unpacked);
    read.map_err(|error| damaged(&error.to_string()))?;
    if unpacked.len() > most {
        return Err(damaged("more bytes than the chunk has"));
    }
    Ok(unpacked)
}

fn zstd(packed: &[u8], most: usize) -> Result<Vec<u8>, Problem> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(packed)
        .map_err(|error| damaged(&error.to_string()))?;
    limited(decoder, most)
}

fn lz4(block: &[u8], len: usize) -> Result<Vec<u8>, Problem> {
    // A byte of a run stands for 255.
    if len / 256 > block.len() {
        return Err(damaged("more bytes than a block can hold"));
    }
    let mut unpacked = vec![0; len];
    let filled = lz4_flex::block::decompress_into(block, &mut unpacked)
        .map_err(|error| damaged(&error.to_string()))?;
    if filled < len {
        return Err(damaged("a block that ends early"));
    }
    Ok(unpacked)
}

/// Blosc of version 1: blocks, in which bytes or bits of one kind lie together.
fn blosc(packed: &[u8], most: usize) -> Result<Vec<u8>, Problem> {
    const HEAD: usize = 16;
    /// Of an element, whose bytes are packed apart.
    const MOST_SPLITS: usize = 16;
    const LEAST_SPLIT: usize = 128;
    let number = |at: usize| -> Result<usize, Problem> {
        let bytes = packed.get(at..).and_then(|rest| rest.first_chunk::<4>());
        Ok(u32::from_le_bytes(*bytes.ok_or_else(|| damaged("a cut Blosc chunk"))?) as usize)
    };
    let (bytes, block_bytes) = (number(4)?, number(8)?);
    let (flags, element) = (packed[2], usize::from(packed[3]).max(1));
    if bytes > most {
        return Err(damaged("more bytes than the chunk has"));
    }
    if flags & 2 != 0 {
        let stored = packed.get(HEAD..).and_then(|rest| rest.get(..bytes));
        return stored.map(<[u8]>::to_vec).ok_or_else(|| damaged("a cut Blosc chunk"));
    }
    if bytes == 0 {
        return Ok(Vec::new());
    }
    if block_bytes == 0 || bytes.div_ceil(block_bytes) > packed.len() / 4 {
        return Err(damaged("a Blosc chunk of too many blocks"));
    }
    let mut unpacked = Vec::new();
    for block in 0..bytes.div_ceil(block_bytes) {
        let len = block_bytes.min(bytes - block * block_bytes);
        let is_whole = len == block_bytes;
        let splits = match flags & 16 == 0 && element <= MOST_SPLITS && is_whole {
            true if block_bytes / element >= LEAST_SPLIT && len % element == 0 => element,
            _ => 1,
        };
        let mut at = number(HEAD + 4 * block)?;
        let mut shuffled = Vec::new();
        for _ in 0..splits {
            let packed_len = number(at)?;
            let part = packed.get(at + 4..).and_then(|rest| rest.get(..packed_len));
            let part = part.ok_or_else(|| damaged("a cut Blosc block"))?;
            at += 4 + packed_len;
            let wanted = len / splits;
            if packed_len == wanted {
                shuffled.extend_from_slice(part);
                continue;
            }
            let plain = match flags >> 5 {
                1 => lz4(part, wanted)?,
                3 => limited(flate2::read::ZlibDecoder::new(part), wanted)?,
                4 => zstd(part, wanted)?,
                other => {
                    let name = if other == 0 { "BloscLZ" } else { "Snappy" };
                    return Err(unsupported(
                        "Blosc chunks of LZ4, zlib or zstd",
                        name,
                        "write the array with one of these",
                    ));
                }
            };
            if plain.len() != wanted {
                return Err(damaged("a Blosc block that ends early"));
            }
            shuffled.extend(plain);
        }
        match (flags & 1 != 0, flags & 4 != 0) {
            (true, _) if element > 1 => unpacked.extend(unshuffled(&shuffled, element)),
            (_, true) => unpacked.extend(bits_unshuffled(&shuffled, element)),
            _ => unpacked.extend(shuffled),
        }
    }
    Ok(unpacked)
}

/// Elements whose first bytes, second bytes and so on lie together.
fn unshuffled(shuffled: &[u8], element: usize) -> Vec<u8> {
    let count = shuffled.len() / element;
    let mut plain = Vec::with_capacity(shuffled.len());
    for index in 0..count {
        plain.extend((0..element).map(|byte| shuffled[byte * count + index]));
    }
    plain.extend_from_slice(&shuffled[count * element..]);
    plain
}

/// The same of bits, in groups of eight elements.
fn bits_unshuffled(shuffled: &[u8], element: usize) -> Vec<u8> {
    let count = shuffled.len() / element / 8 * 8;
    let row = count / 8;
    let mut plain = vec![0; count * element];
    for (index, bytes) in plain.chunks_exact_mut(element).enumerate() {
        for (byte, value) in bytes.iter_mut().enumerate() {
            for bit in 0..8 {
                let packed = shuffled[(byte * 8 + bit) * row + index / 8];
                *value |= (packed >> (index % 8) & 1) << bit;
            }
        }
    }
    plain.extend_from_slice(&shuffled[count * element..]);
    plain
}

/// Castagnoli's checksum, of few and short indices.
pub(super) fn crc32c(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0x82f6_3b78;
    let mut sum = u32::MAX;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = sum >> 1 ^ if sum & 1 == 1 { POLYNOMIAL } else { 0 };
        }
    }
    !sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_castagnolis() {
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        let mut packed = b"123456789".to_vec();
        packed.extend(0xe306_9283_u32.to_le_bytes());
        assert_eq!(Codec::Crc32c.unpack(&packed, 99).unwrap(), b"123456789");
        packed[0] ^= 1;
        assert!(Codec::Crc32c.unpack(&packed, 99).is_err());
    }

    #[test]
    fn bytes_and_bits_of_one_kind_are_taken_apart() {
        assert_eq!(unshuffled(&[1, 3, 5, 2, 4, 6, 9], 2), [1, 2, 3, 4, 5, 6, 9]);
        // Eight elements of a byte: the rows are their bits.
        let elements = [1_u8, 2, 4, 8, 16, 32, 64, 128];
        assert_eq!(bits_unshuffled(&elements, 1), elements);
        let rows = [0xff, 0, 0, 0, 0, 0, 0, 0x80, 7];
        assert_eq!(bits_unshuffled(&rows, 1), [1, 1, 1, 1, 1, 1, 1, 0x81, 7]);
    }

    #[test]
    fn blosc_blocks_of_lz4_are_unpacked() {
        // Two blocks of 256 bytes, the second shorter, of elements of two bytes, split and shuffled.
        let plain: Vec<u8> = (0..400_u32).map(|i| u8::try_from(i * 7 % 251).unwrap()).collect();
        let mut packed = vec![2, 1, 1 | 1 << 5, 2];
        packed.extend(400_u32.to_le_bytes());
        packed.extend(256_u32.to_le_bytes());
        packed.extend(0_u32.to_le_bytes());
        packed.extend([24_u32.to_le_bytes(), [0; 4]].concat());
        let shuffle = |part: &[u8]| -> Vec<Vec<u8>> {
            (0..2).map(|byte| part.iter().skip(byte).step_by(2).copied().collect()).collect()
        };
        for half in shuffle(&plain[..256]) {
            let block = lz4_flex::block::compress(&half);
            // A part as long as it would be is stored as it is.
            let stored = if block.len() < 128 { block } else { half };
            packed.extend(u32::try_from(stored.len()).unwrap().to_le_bytes());
            packed.extend(stored);
        }
        let start = u32::try_from(packed.len()).unwrap();
        packed[20..24].copy_from_slice(&start.to_le_bytes());
        let rest = shuffle(&plain[256..]).concat();
        packed.extend(u32::try_from(rest.len()).unwrap().to_le_bytes());
        packed.extend(&rest);
        assert_eq!(Codec::Blosc.unpack(&packed, 400).unwrap(), plain);
        assert!(Codec::Blosc.unpack(&packed, 399).is_err(), "no more than was asked for");
        for cut in 0..packed.len() {
            assert!(Codec::Blosc.unpack(&packed[..cut], 400).is_err(), "cut at {cut}");
        }
    }
}
