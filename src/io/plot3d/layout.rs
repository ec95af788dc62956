//! How a file is laid out: found by trying all ways until the sizes add up.

use std::io::BufRead;
use std::path::Path;

use super::super::bytes::Endian;
use super::super::error::Problem;
use super::super::files;
use super::{STREAM, UNKNOWNS, start_of};
use crate::core::memory;
use crate::volume::ScalarType;

/// More blocks than this are none.
const MOST_BLOCKS: usize = 4096;
/// And more functions at a point.
const MOST_FUNCTIONS: usize = 4096;
/// No axis of a block has more points.
const MOST_ALONG: i64 = 1 << 24;
/// Bytes that hold all sizes.
const HEADER_BYTES: u64 = 1 << 16;
/// A solution may be padded by as many bytes.
const MOST_PADDING: u64 = 4096;

/// How numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbers {
    Text,
    /// `has_markers`: each record lies between its lengths, as Fortran writes it.
    Binary {
        endian: Endian,
        has_markers: bool,
    },
}

/// Which of a pair a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Grid,
    Solution,
    Functions,
}

impl Role {
    /// Whole numbers that a file has of each block before all of them.
    fn sizes(self) -> usize {
        match self {
            Self::Grid | Self::Solution => 3,
            Self::Functions => 4,
        }
    }
}

/// Points along each axis of each block, and how many functions it has; those of files without any have 0.
type Sizes = (Vec<[usize; 3]>, Vec<usize>);

/// What is found of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) numbers: Numbers,
    /// Whether it begins with the number of blocks.
    pub(super) is_multi: bool,
    /// Points along each axis of each block.
    pub(super) blocks: Vec<[usize; 3]>,
    /// How many functions each block has: none, but in a file of these.
    pub(super) functions: Vec<usize>,
    /// Whether numbers have 64 bits.
    pub(super) is_wide: bool,
    /// Whether a whole number behind the places says of each point whether it is there.
    pub(super) has_blanks: bool,
}

/// A file that begins with sizes of blocks, and is of another length than they ask for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Misfit {
    pub(super) blocks: Vec<[usize; 3]>,
    /// What they ask for, by how numbers are written; rising.
    pub(super) possible: Vec<u64>,
    pub(super) found: u64,
    /// What is counted.
    pub(super) unit: &'static str,
}

impl Layout {
    /// What keeps a file that [`Layout::of_grid`] knows nothing of from being one, if it begins like one.
    ///
    /// # Errors
    /// Those of reading it.
    pub(super) fn misfit(path: &Path) -> Result<Option<Misfit>, Problem> {
        let (start, len) = start_of(path, HEADER_BYTES)?;
        let candidates = Self::candidates(&start, Role::Grid);
        // Records' lengths are no chance; of the others the one that asks for least is likeliest.
        let best = candidates
            .into_iter()
            .min_by_key(|layout| (layout.markers() == 0, layout.needed_bytes(Role::Grid)));
        let Some(layout) = best else { return Ok(None) };
        let (mut possible, found, unit) = match layout.numbers {
            Numbers::Text => {
                let points = layout.points() as u64;
                let words = layout.header_numbers() as u64 + 3 * points;
                let most = usize::try_from(words + points + 1).unwrap_or(usize::MAX);
                (vec![words, words + points], count_words(path, most)? as u64, "numbers")
            }
            Numbers::Binary { .. } => {
                let variants = [(false, false), (true, false), (false, true), (true, true)];
                let of = |(is_wide, has_blanks)| Self { is_wide, has_blanks, ..layout.clone() };
                let lengths = variants.map(|variant| of(variant).needed_bytes(Role::Grid));
                (lengths.to_vec(), len, "bytes")
            }
        };
        possible.sort_unstable();
        possible.dedup();
        Ok(Some(Misfit { blocks: layout.blocks, possible, found, unit }))
    }

    /// That of a grid; `None` of anything else.
    ///
    /// # Errors
    /// Those of reading it.
    pub(super) fn of_grid(path: &Path) -> Result<Option<Self>, Problem> {
        let (start, len) = start_of(path, HEADER_BYTES)?;
        for mut layout in Self::candidates(&start, Role::Grid) {
            if layout.numbers == Numbers::Text {
                let points = layout.points();
                let words = layout.header_numbers() + 3 * points;
                let found = count_words(path, words + points + 1)?;
                layout.has_blanks = found == words + points;
                if found == words || layout.has_blanks {
                    return Ok(Some(layout));
                }
                continue;
            }
            for (is_wide, has_blanks) in
                [(false, false), (true, false), (false, true), (true, true)]
            {
                let tried = Self { is_wide, has_blanks, ..layout.clone() };
                if tried.needed_bytes(Role::Grid) == len {
                    return Ok(Some(tried));
                }
            }
        }
        Ok(None)
    }

    /// That of the flow on a grid, or of functions on it, and how many bytes follow it; `None` of anything else.
    ///
    /// # Errors
    /// Those of reading it.
    pub(super) fn on_grid(
        path: &Path,
        role: Role,
        grid: &Self,
    ) -> Result<Option<(Self, u64)>, Problem> {
        let (start, len) = start_of(path, HEADER_BYTES)?;
        let mut padded = None;
        let all = Self::candidates(&start, role);
        for layout in all.into_iter().filter(|layout| layout.blocks == grid.blocks) {
            if layout.numbers == Numbers::Text {
                let blocks = 0..layout.blocks.len();
                let of_block = |i| layout.stream(role) + layout.record_numbers(role, i);
                let words = layout.header_numbers() + blocks.map(of_block).sum::<usize>();
                if count_words(path, words + 1)? == words {
                    return Ok(Some((layout, 0)));
                }
                continue;
            }
            for is_wide in [grid.is_wide, !grid.is_wide] {
                let tried = Self { is_wide, ..layout.clone() };
                match len.checked_sub(tried.needed_bytes(role)) {
                    Some(0) => return Ok(Some((tried, 0))),
                    Some(more @ ..=MOST_PADDING) if padded.is_none() => {
                        padded = Some((tried, more))
                    }
                    _ => {}
                }
            }
        }
        Ok(padded)
    }

    /// All ways to read the sizes that a file may begin with.
    fn candidates(start: &[u8], role: Role) -> Vec<Self> {
        let mut found = Vec::new();
        for is_multi in [false, true] {
            if let Some(sizes) = text_blocks(start, is_multi, role) {
                found.push(Self::plain(Numbers::Text, is_multi, sizes));
            }
        }
        // A file of text is none of bytes, and the other way round.
        if !found.is_empty() || is_text(start) {
            return found;
        }
        for has_markers in [false, true] {
            for endian in [Endian::Little, Endian::Big] {
                for is_multi in [false, true] {
                    let numbers = Numbers::Binary { endian, has_markers };
                    let sizes = binary_blocks(start, (endian, has_markers), is_multi, role);
                    found.extend(sizes.map(|sizes| Self::plain(numbers, is_multi, sizes)));
                }
            }
        }
        found
    }

    fn plain(numbers: Numbers, is_multi: bool, (blocks, functions): Sizes) -> Self {
        Self { numbers, is_multi, blocks, functions, is_wide: false, has_blanks: false }
    }

    /// Points of all blocks.
    pub(super) fn points(&self) -> usize {
        self.blocks.iter().map(|dims| dims.iter().product::<usize>()).sum()
    }

    pub(super) fn scalar_type(&self) -> ScalarType {
        if self.is_wide { ScalarType::Float64 } else { ScalarType::Float32 }
    }

    fn markers(&self) -> u64 {
        match self.numbers {
            Numbers::Binary { has_markers: true, .. } => 8,
            _ => 0,
        }
    }

    /// Numbers before the first block.
    pub(super) fn header_numbers(&self) -> usize {
        let each = if self.functions[0] > 0 { Role::Functions } else { Role::Grid }.sizes();
        usize::from(self.is_multi) + each * self.blocks.len()
    }

    /// Bytes before the first block.
    pub(super) fn header_bytes(&self) -> u64 {
        let records = if self.is_multi { 2 } else { 1 };
        4 * self.header_numbers() as u64 + records * self.markers()
    }

    /// Numbers before a block's own.
    fn stream(&self, role: Role) -> usize {
        if role == Role::Solution { STREAM } else { 0 }
    }

    /// Numbers of a block's record, but for those that say which points are there.
    fn record_numbers(&self, role: Role, block: usize) -> usize {
        let each = match role {
            Role::Grid => 3,
            Role::Solution => UNKNOWNS,
            Role::Functions => self.functions[block],
        };
        self.blocks[block].iter().product::<usize>().saturating_mul(each)
    }

    /// Bytes of a block's record, without its markers.
    pub(super) fn record_bytes(&self, role: Role, block: usize) -> u64 {
        let width = self.scalar_type().size_bytes() as u64;
        let blanks = match self.has_blanks && role == Role::Grid {
            true => 4 * self.blocks[block].iter().product::<usize>() as u64,
            false => 0,
        };
        (self.record_numbers(role, block) as u64).saturating_mul(width).saturating_add(blanks)
    }

    fn needed_bytes(&self, role: Role) -> u64 {
        let stream = match self.stream(role) {
            0 => 0,
            count => (count * self.scalar_type().size_bytes()) as u64 + self.markers(),
        };
        let block = |i| self.record_bytes(role, i).saturating_add(self.markers() + stream);
        (0..self.blocks.len()).map(block).fold(self.header_bytes(), u64::saturating_add)
    }
}

/// Sizes that may be a block's: a surface at least, of points that 32 bits number.
fn dims_of(numbers: &[i64]) -> Option<[usize; 3]> {
    let [x, y, z] = numbers else { return None };
    let dims = [*x, *y, *z];
    let is_possible = dims.iter().all(|n| (1..=MOST_ALONG).contains(n));
    let is_surface = dims.iter().filter(|n| **n > 1).count() >= 2;
    let count = memory::checked_product(&dims.map(i64::unsigned_abs)).unwrap_or(u64::MAX);
    (is_possible && is_surface && count < u64::from(u32::MAX))
        .then(|| dims.map(|n| usize::try_from(n).unwrap_or(1)))
}

fn blocks_of(numbers: &[i64], is_multi: bool, role: Role) -> Option<Sizes> {
    let sizes = if is_multi {
        let count =
            usize::try_from(*numbers.first()?).ok().filter(|n| (1..=MOST_BLOCKS).contains(n))?;
        numbers.get(1..1 + role.sizes() * count)?
    } else {
        numbers.get(..role.sizes())?
    };
    sizes_of(sizes, role)
}

/// Those of each block, one after another.
fn sizes_of(sizes: &[i64], role: Role) -> Option<Sizes> {
    let dims = |own: &[i64]| dims_of(&own[..3]);
    let blocks = sizes.chunks_exact(role.sizes()).map(dims).collect::<Option<Vec<_>>>()?;
    let functions = |own: &[i64]| match own.get(3) {
        None => Some(0),
        Some(count) => usize::try_from(*count).ok().filter(|n| (1..=MOST_FUNCTIONS).contains(n)),
    };
    let functions = sizes.chunks_exact(role.sizes()).map(functions).collect::<Option<Vec<_>>>()?;
    let points = blocks.iter().map(|dims| dims.iter().product::<usize>() as u64);
    let is_possible = points.fold(0, u64::saturating_add) < u64::from(u32::MAX);
    is_possible.then_some((blocks, functions))
}

fn is_text(start: &[u8]) -> bool {
    start.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace())
}

fn separates(byte: &u8) -> bool {
    byte.is_ascii_whitespace() || *byte == b','
}

fn text_blocks(start: &[u8], is_multi: bool, role: Role) -> Option<Sizes> {
    if !is_text(start) {
        return None;
    }
    let words = start.split(separates).filter(|word| !word.is_empty());
    let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<i64>().ok();
    let numbers: Vec<i64> = words.take(1 + role.sizes() * MOST_BLOCKS).map_while(number).collect();
    blocks_of(&numbers, is_multi, role)
}

fn binary_blocks(
    start: &[u8],
    (endian, has_markers): (Endian, bool),
    is_multi: bool,
    role: Role,
) -> Option<Sizes> {
    let words: Vec<i64> = start
        .chunks_exact(4)
        .map(|bytes| {
            let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
            i64::from(match endian {
                Endian::Little => i32::from_le_bytes(bytes),
                Endian::Big => i32::from_be_bytes(bytes),
            })
        })
        .collect();
    if !has_markers {
        return blocks_of(&words, is_multi, role);
    }
    // Each record between its lengths.
    let (sizes, count) = match is_multi {
        false => (&words[..], 1),
        true => {
            let [4, count, 4, ..] = words[..] else { return None };
            (words.get(3..)?, usize::try_from(count).ok()?)
        }
    };
    let count = Some(count).filter(|n| (1..=MOST_BLOCKS).contains(n))?;
    let each = role.sizes();
    let length = (4 * each * count) as i64;
    let is_whole = sizes.first() == Some(&length) && sizes.get(1 + each * count) == Some(&length);
    sizes_of(sizes.get(1..1 + each * count).filter(|_| is_whole)?, role)
}

/// How many words a text has, counted up to `most`.
fn count_words(path: &Path, most: usize) -> Result<usize, Problem> {
    let (file, _) = files::open_file(path)?;
    let mut reader = files::buffered(file);
    let (mut count, mut is_in_word) = (0, false);
    loop {
        let buffer = reader.fill_buf().map_err(Problem::Io)?;
        if buffer.is_empty() || count > most {
            return Ok(count);
        }
        for byte in buffer {
            let is_separator = separates(byte);
            count += usize::from(!is_separator && !is_in_word);
            is_in_word = !is_separator;
        }
        let taken = buffer.len();
        reader.consume(taken);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_found_whatever_their_order_and_markers() {
        let words = |list: &[i32], endian: Endian| -> Vec<u8> {
            let bytes = |n: &i32| match endian {
                Endian::Little => n.to_le_bytes(),
                Endian::Big => n.to_be_bytes(),
            };
            list.iter().flat_map(bytes).collect()
        };
        let grids = |blocks: &[[usize; 3]]| Some((blocks.to_vec(), vec![0; blocks.len()]));
        let grid = Role::Grid;
        for endian in [Endian::Little, Endian::Big] {
            let single = words(&[3, 4, 5], endian);
            assert_eq!(binary_blocks(&single, (endian, false), false, grid), grids(&[[3, 4, 5]]));
            let multi = words(&[4, 2, 4, 24, 3, 4, 5, 6, 7, 1, 24], endian);
            let both = grids(&[[3, 4, 5], [6, 7, 1]]);
            assert_eq!(binary_blocks(&multi, (endian, true), true, grid), both);
            let cut = binary_blocks(&multi[..40], (endian, true), true, grid);
            assert_eq!(cut, None, "no marker behind");
            assert_eq!(binary_blocks(&multi, (endian, false), true, grid), None);
            let with_functions = words(&[4, 2, 4, 32, 3, 4, 5, 2, 6, 7, 1, 9, 32], endian);
            let found = binary_blocks(&with_functions, (endian, true), true, Role::Functions);
            assert_eq!(found, Some((vec![[3, 4, 5], [6, 7, 1]], vec![2, 9])));
            assert_eq!(binary_blocks(&with_functions, (endian, true), true, grid), None);
        }
        let text = |text: &str, is_multi: bool| text_blocks(text.as_bytes(), is_multi, grid);
        assert_eq!(text("2\n3 4 5 6 7 2\n0.5", true), grids(&[[3, 4, 5], [6, 7, 2]]));
        assert_eq!(text("3 4 5 0.5", false), grids(&[[3, 4, 5]]));
        assert_eq!(text("3.5 4 5", false), None);
        assert_eq!(text("1 1 5 6", false), None, "a line is no block");
        assert_eq!(text("65536 65536 2 6", false), None, "more points than have numbers");
        for none in ["3 4 5 0 1.5", "3 4 5 5000 1.5", "3 4 5 -1 2.5", "3 4 5"] {
            assert_eq!(text_blocks(none.as_bytes(), false, Role::Functions), None, "{none}");
        }
    }

    #[test]
    fn lengths_add_up() {
        let numbers = Numbers::Binary { endian: Endian::Big, has_markers: true };
        let layout = Layout::plain(numbers, true, (vec![[2, 3, 4]], vec![0]));
        // Two records before, one of the block, each with 8 bytes of markers.
        assert_eq!(layout.needed_bytes(Role::Grid), (4 + 8) + (12 + 8) + (24 * 12 + 8));
        let flow = (4 + 8) + (12 + 8) + (4 * 4 + 8) + (24 * 20 + 8);
        assert_eq!(layout.needed_bytes(Role::Solution), flow);
        let layout = Layout::plain(numbers, true, (vec![[2, 3, 4]], vec![7]));
        let functions = (4 + 8) + (16 + 8) + (24 * 7 * 4 + 8);
        assert_eq!(layout.needed_bytes(Role::Functions), functions);
    }
}
