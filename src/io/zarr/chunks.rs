//! The numbers of an array, chunk by chunk: found, unpacked, and copied to their place.

use std::io::Read;
use std::path::Path;

use super::Part;
use super::codecs;
use super::metadata::{Array, Packing, Shard};
use crate::core::memory;
use crate::core::parallel;
use crate::core::progress::Ticket;
use crate::io::error::{Problem, corrupt, quoted};
use crate::io::scale::converted;
use crate::io::{bytes, files};
use crate::volume::Samples;
use crate::with_samples;

/// No packing shrinks further than this, and what is not stored at all is a small part of an array.
const PACKED_MOST: u64 = 4096;
/// A chunk of more bytes is a damaged number.
const MOST_CHUNK_BYTES: u64 = 1 << 32;
/// Memory always holds so many bytes of a chunk.
const MOST_UNASKED_BYTES: u64 = 1 << 26;
/// More chunks than this are none that were written.
const MOST_CHUNKS: u64 = 1 << 26;

/// The numbers of a part, chunk by chunk; what is not stored has the array's number for it.
pub(super) fn read_part(part: &Part, ticket: &Ticket) -> Result<Samples, Problem> {
    let array = &part.array;
    let size = array.scalar_type.size_bytes();
    let count = usize::try_from(memory::checked_product(&part.sizes).unwrap_or(u64::MAX));
    let count = count.unwrap_or(usize::MAX);
    let chunk_bytes =
        memory::checked_product(&array.chunks).and_then(|n| n.checked_mul(size as u64));
    let chunk_bytes = chunk_bytes.filter(|&n| n <= MOST_CHUNK_BYTES).ok_or_else(|| {
        corrupt("chunks of at most 4 GB", format!("{:?}", array.chunks), "write the array again")
    })?;
    let grid: Vec<u64> =
        part.sizes.iter().zip(&array.chunks).map(|(n, c)| n.div_ceil(*c)).collect();
    let chunks = memory::checked_product(&grid).filter(|&n| n <= MOST_CHUNKS).ok_or_else(|| {
        corrupt(
            format!("at most {MOST_CHUNKS} chunks"),
            format!("{grid:?}"),
            "write the array again",
        )
    })?;
    // As many at a time as there are processors, and no more than fit.
    let at_once = (rayon::current_num_threads() as u64).min((1 << 30) / chunk_bytes.max(1)).max(1);
    let needed = (count as u64).saturating_mul(size as u64);
    bytes::require_stored(needed, stored_bytes(&part.folder, needed).saturating_mul(PACKED_MOST))?;
    let mut samples = bytes::zero_samples(array.scalar_type, 0)?;
    let mut is_made = false;
    let mut first = 0;
    while first < chunks {
        ticket.checkpoint(first, chunks)?;
        let places: Vec<Vec<u64>> =
            (first..(first + at_once).min(chunks)).map(|index| place_of(index, &grid)).collect();
        let read = |i: usize| chunk(part, &places[i], chunk_bytes);
        let read: Vec<Option<Vec<u8>>> = parallel::try_list(places.len(), read)?;
        if !is_made {
            samples = filled(array, count)?;
            is_made = true;
        }
        for (place, stored) in places.iter().zip(read) {
            let Some(stored) = stored else { continue };
            let from: Vec<u64> = place.iter().zip(&array.chunks).map(|(p, c)| p * c).collect();
            copy(&stored, (&array.chunks, &array.packing), &from, &mut samples, &part.sizes);
        }
        first += at_once;
    }
    Ok(samples)
}

/// Bytes of all files in a folder, as far as they matter for a promise of `needed`.
fn stored_bytes(folder: &Path, needed: u64) -> u64 {
    let mut folders = vec![folder.to_owned()];
    let mut total = 0_u64;
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(folder) else { continue };
        for entry in entries.filter_map(Result::ok) {
            match entry.metadata() {
                Ok(facts) if facts.is_dir() => folders.push(entry.path()),
                Ok(facts) => total = total.saturating_add(facts.len()),
                Err(_) => {}
            }
            if total.saturating_mul(PACKED_MOST) >= needed {
                return total;
            }
        }
    }
    total
}

/// As many numbers as an array has for what is not stored.
fn filled(array: &Array, count: usize) -> Result<Samples, Problem> {
    let zeros = bytes::zero_samples(array.scalar_type, count)?;
    match array.fill {
        0.0 => Ok(zeros),
        // They are still bits.
        fill if array.halves => {
            let bits = f64::from(half::f16::from_f64(fill).to_bits());
            converted(&zeros, array.scalar_type, |_| bits)
        }
        fill => converted(&zeros, array.scalar_type, |_| fill),
    }
}

/// Where the chunk of a number lies, the last axis being the fastest.
fn place_of(index: u64, grid: &[u64]) -> Vec<u64> {
    let mut place = vec![0; grid.len()];
    let mut left = index;
    for (at, n) in place.iter_mut().zip(grid).rev() {
        *at = left % n;
        left /= n;
    }
    place
}

/// The bytes of a stored object, unpacked; `None` where it is not stored.
fn chunk(part: &Part, place: &[u64], chunk_bytes: u64) -> Result<Option<Vec<u8>>, Problem> {
    let array = &part.array;
    let path = part.folder.join(array.names.key(place));
    let (mut file, len) = match files::open_file(&path) {
        Ok(opened) => opened,
        Err(Problem::NotFound) => return Ok(None),
        Err(problem) => return Err(problem),
    };
    // What is free is asked of the system, which takes longer than to read a chunk.
    if len > MOST_UNASKED_BYTES {
        memory::require("a chunk", len, memory::free_bytes())?;
    }
    let mut stored = Vec::new();
    file.read_to_end(&mut stored).map_err(Problem::Io)?;
    let size = array.scalar_type.size_bytes();
    let result = match &array.packing.shard {
        Some(shard) => of_shard(&stored, shard, array, chunk_bytes, size),
        None => unpack(stored, &array.packing, chunk_bytes),
    };
    result.map(Some).map_err(|problem| {
        let name = path.strip_prefix(&part.folder).unwrap_or(&path).display().to_string();
        match problem {
            Problem::Corrupt(mismatch) => {
                let found = format!("{} in the chunk {}", mismatch.found, quoted(&name));
                corrupt(mismatch.expected, found, mismatch.advice)
            }
            other => other,
        }
    })
}

fn unpack(stored: Vec<u8>, packing: &Packing, chunk_bytes: u64) -> Result<Vec<u8>, Problem> {
    let most = usize::try_from(chunk_bytes).unwrap_or(usize::MAX);
    let mut bytes = stored;
    for (index, codec) in packing.codecs.iter().enumerate().rev() {
        // Checksums and the like between steps.
        let room = if index == 0 { most } else { most.saturating_add(1 << 16) };
        bytes = codec.unpack(&bytes, room)?;
    }
    if bytes.len() as u64 != chunk_bytes {
        return Err(corrupt(
            format!("chunks of {chunk_bytes} bytes"),
            bytes.len().to_string(),
            "the folder was altered: copy it again",
        ));
    }
    Ok(bytes)
}

/// The chunks of a shard, each where it belongs, in the order of bytes of the outer array's.
fn of_shard(
    stored: &[u8],
    shard: &Shard,
    array: &Array,
    chunk_bytes: u64,
    size: usize,
) -> Result<Vec<u8>, Problem> {
    let cut = || {
        corrupt(
            "the index of a shard",
            "none that is whole",
            "the folder was altered: copy it again",
        )
    };
    let grid: Vec<u64> = array.chunks.iter().zip(&shard.chunks).map(|(n, c)| n / c).collect();
    let is_even = array.chunks.iter().zip(&shard.chunks).all(|(n, c)| n % c == 0);
    let count = memory::checked_product(&grid).filter(|_| is_even).ok_or_else(cut)?;
    let index_bytes =
        count.checked_mul(16).and_then(|n| usize::try_from(n).ok()).ok_or_else(cut)?;
    let sum_bytes = if shard.index_checksum { 4 } else { 0 };
    let whole = index_bytes.checked_add(sum_bytes).ok_or_else(cut)?;
    let index = match shard.index_at_start {
        true => stored.get(..whole),
        false => stored.len().checked_sub(whole).and_then(|at| stored.get(at..)),
    };
    let index = index.ok_or_else(cut)?;
    let (index, sum) = index.split_at(index_bytes);
    if let Some(sum) = sum.first_chunk::<4>().filter(|_| shard.index_checksum)
        && codecs::crc32c(index) != u32::from_le_bytes(*sum)
    {
        return Err(cut());
    }
    let inner_bytes =
        memory::checked_product(&shard.chunks).unwrap_or(u64::MAX).saturating_mul(size as u64);
    bytes::require_stored(chunk_bytes, (stored.len() as u64).saturating_mul(PACKED_MOST))?;
    let total = usize::try_from(chunk_bytes / size as u64).unwrap_or(usize::MAX);
    let mut samples = filled(array, total)?;
    for (number, entry) in index.chunks_exact(16).enumerate() {
        let at = |from: usize| {
            entry[from..].first_chunk::<8>().map_or(u64::MAX, |b| u64::from_le_bytes(*b))
        };
        let (from, len) = (at(0), at(8));
        if from == u64::MAX {
            continue;
        }
        let range = usize::try_from(from).ok().zip(usize::try_from(len).ok());
        let packed = range.and_then(|(from, len)| stored.get(from..from.checked_add(len)?));
        let plain = unpack(packed.ok_or_else(cut)?.to_vec(), &shard.packing, inner_bytes)?;
        let place = place_of(number as u64, &grid);
        let from: Vec<u64> = place.iter().zip(&shard.chunks).map(|(p, c)| p * c).collect();
        copy(&plain, (&shard.chunks, &shard.packing), &from, &mut samples, &array.chunks);
    }
    // As the outer array's bytes are read.
    let mut bytes = Vec::with_capacity(total * size);
    bytes::to_native(&mut samples, array.packing.endian);
    with_samples!(&samples, values => bytes.extend_from_slice(bytemuck::cast_slice(values)));
    Ok(bytes)
}

/// Copies a chunk to its place in an array, as far as this goes.
fn copy(
    stored: &[u8],
    (chunk, packing): (&[u64], &Packing),
    from: &[u64],
    samples: &mut Samples,
    sizes: &[u64],
) {
    let rank = sizes.len();
    let strides = |sizes: &[u64], fortran: bool| -> Vec<u64> {
        let mut strides = vec![1; rank];
        let order: Vec<usize> =
            if fortran { (0..rank).collect() } else { (0..rank).rev().collect() };
        for pair in order.windows(2) {
            strides[pair[1]] = strides[pair[0]] * sizes[pair[0]];
        }
        strides
    };
    let chunk_strides = strides(chunk, packing.fortran);
    let array_strides = strides(sizes, false);
    // Entries of the chunk that the array has.
    let extent: Vec<u64> =
        (0..rank).map(|a| chunk[a].min(sizes[a].saturating_sub(from[a]))).collect();
    let last = rank - 1;
    let rows: u64 = extent[..last].iter().product();
    let swaps = packing.endian != bytes::Endian::NATIVE;
    with_samples!(samples, values => {
        let size = size_of_val(&values[..1]);
        let target: &mut [u8] = bytemuck::cast_slice_mut(values);
        for row in 0..rows {
            let at = place_of(row, &extent[..last]);
            let index = |strides: &[u64], shift: bool| -> u64 {
                (0..last).map(|a| (at[a] + if shift { from[a] } else { 0 }) * strides[a]).sum()
            };
            let source = index(&chunk_strides, false);
            let to = index(&array_strides, true) + from[last];
            if chunk_strides[last] == 1 {
                let (s, t, len) = (source as usize * size, to as usize * size, extent[last] as usize * size);
                target[t..t + len].copy_from_slice(&stored[s..s + len]);
                if swaps {
                    target[t..t + len].chunks_exact_mut(size).for_each(<[u8]>::reverse);
                }
                continue;
            }
            for column in 0..extent[last] {
                let s = (source + column * chunk_strides[last]) as usize * size;
                let t = (to + column) as usize * size;
                target[t..t + size].copy_from_slice(&stored[s..s + size]);
                if swaps {
                    target[t..t + size].reverse();
                }
            }
        }
    });
}
