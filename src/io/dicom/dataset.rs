//! DICOM's data elements, of which those are kept that tell of pictures and of where they lie.
//!
//! Values are read no further than the file goes: a damaged length costs no memory. Pixels stay on disk; only their
//! places are told.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use super::super::bytes::Endian;
use super::super::error::{Problem, corrupt, truncated, unsupported};
use super::super::files;
use super::tags;

/// A longer value is none of those that are kept.
const MOST_VALUE_BYTES: u64 = 1 << 20;
/// Deeper sequences are none that anybody writes.
const MOST_DEPTH: usize = 16;
const UNDEFINED: u32 = u32::MAX;
const ITEM: u32 = 0xfffe_e000;
const ITEM_END: u32 = 0xfffe_e00d;
const SEQUENCE_END: u32 = 0xfffe_e0dd;

/// How elements are written, by the transfer syntax.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Writing {
    explicit: bool,
    endian: Endian,
}

const EXPLICIT: Writing = Writing { explicit: true, endian: Endian::Little };
const IMPLICIT: Writing = Writing { explicit: false, endian: Endian::Little };

/// Where a file's pixels are.
#[derive(Debug, Clone)]
pub(super) enum Pixels {
    /// As they are: place and length.
    Plain(u64, u64),
    /// Packed: the offsets of frames, where they are told, and places and lengths of the fragments.
    Packed(Vec<u32>, Vec<(u64, u64)>),
}

#[derive(Debug, Clone)]
enum Element {
    Value(Vec<u8>),
    Items(Vec<Dataset>),
}

/// Elements by their tag.
#[derive(Debug, Clone)]
pub(super) struct Dataset {
    elements: BTreeMap<u32, Element>,
    endian: Endian,
}

/// A file's elements, how its pixels are packed, and where they are.
#[derive(Debug)]
pub(super) struct Content {
    pub(super) dataset: Dataset,
    /// The transfer syntax, by its UID.
    pub(super) syntax: String,
    pub(super) endian: Endian,
    /// The tag of the pixels: of numbers, or of floats.
    pub(super) pixels: Option<(u32, Pixels)>,
}

impl Dataset {
    fn new(endian: Endian) -> Self {
        Self { elements: BTreeMap::new(), endian }
    }

    fn value(&self, tag: u32) -> Option<&[u8]> {
        match self.elements.get(&tag)? {
            Element::Value(bytes) => Some(bytes),
            Element::Items(_) => None,
        }
    }

    /// The items of a sequence; none where there is none.
    pub(super) fn items(&self, tag: u32) -> &[Self] {
        match self.elements.get(&tag) {
            Some(Element::Items(items)) => items,
            _ => &[],
        }
    }

    /// The only item, or the first, of a sequence.
    pub(super) fn item(&self, tag: u32) -> Option<&Self> {
        self.items(tag).first()
    }

    /// A value of text, without what fills it up.
    pub(super) fn text(&self, tag: u32) -> Option<String> {
        let text = String::from_utf8_lossy(self.value(tag)?);
        let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// Numbers written in text.
    pub(super) fn decimals(&self, tag: u32) -> Option<Vec<f64>> {
        let text = self.text(tag)?;
        let numbers: Option<Vec<f64>> = text
            .split('\\')
            .map(|word| word.trim().parse().ok().filter(|n: &f64| n.is_finite()))
            .collect();
        numbers
    }

    pub(super) fn decimal(&self, tag: u32) -> Option<f64> {
        self.decimals(tag)?.first().copied()
    }

    /// A whole number of 16 bits.
    pub(super) fn short(&self, tag: u32) -> Option<u16> {
        self.shorts(tag).map(|[number]| number)
    }

    /// Whole numbers of 16 bits, the first so many.
    pub(super) fn shorts<const N: usize>(&self, tag: u32) -> Option<[u16; N]> {
        let bytes = self.value(tag)?.get(..2 * N)?;
        let number = |at: usize| {
            let bytes = [bytes[2 * at], bytes[2 * at + 1]];
            match self.endian {
                Endian::Little => u16::from_le_bytes(bytes),
                Endian::Big => u16::from_be_bytes(bytes),
            }
        };
        Some(std::array::from_fn(number))
    }

    /// A whole number of 32 bits.
    pub(super) fn long(&self, tag: u32) -> Option<u32> {
        let bytes: [u8; 4] = self.value(tag)?.get(..4)?.try_into().ok()?;
        Some(match self.endian {
            Endian::Little => u32::from_le_bytes(bytes),
            Endian::Big => u32::from_be_bytes(bytes),
        })
    }
}

impl Content {
    /// Reads a file up to its pixels.
    ///
    /// # Errors
    /// No DICOM file, one that is cut, or of a transfer syntax that is not read.
    pub(super) fn read(path: &Path) -> Result<Self, Problem> {
        let (file, len) = files::open_file(path)?;
        let mut source = Source { reader: files::buffered(file), at: 0, len };
        let mut start = [0; 132];
        let most = usize::try_from(len.min(132)).unwrap_or(132);
        source.fill(&mut start[..most])?;
        let from = if start[128..] == *b"DICM" { 132 } else { 0 };
        source.reader.seek(std::io::SeekFrom::Start(from)).map_err(Problem::Io)?;
        source.at = from;

        let mut meta = Dataset::new(Endian::Little);
        // The group that says how the others are written.
        if from > 0 || start.starts_with(&[2, 0]) {
            source.dataset(EXPLICIT, Place::root(len).of_meta(), &mut meta)?;
        }
        let syntax = meta.text(tags::TRANSFER_SYNTAX);
        let writing = match syntax.as_deref() {
            Some("1.2.840.10008.1.2") => IMPLICIT,
            Some("1.2.840.10008.1.2.2") => Writing { explicit: true, endian: Endian::Big },
            Some("1.2.840.10008.1.2.1.99") => {
                return Err(unsupported(
                    "a DICOM file whose elements are not packed",
                    "a deflated one",
                    "convert it (dcmconv +te IN OUT)",
                ));
            }
            Some(_) => EXPLICIT,
            None => source.guess_writing()?,
        };
        let mut content = Self {
            dataset: Dataset::new(writing.endian),
            syntax: syntax.unwrap_or_default(),
            endian: writing.endian,
            pixels: None,
        };
        content.pixels = source.dataset(writing, Place::root(len), &mut content.dataset)?;
        Ok(content)
    }
}

/// Where elements lie, and which of them are kept.
#[derive(Clone, Copy)]
struct Place {
    /// Their end, or that of what they are in.
    end: u64,
    depth: usize,
    keeps: bool,
    only_meta: bool,
}

impl Place {
    fn root(end: u64) -> Self {
        Self { end, depth: 0, keeps: true, only_meta: false }
    }

    fn of_meta(self) -> Self {
        Self { only_meta: true, ..self }
    }
}

/// A file that is read from its start.
struct Source {
    reader: BufReader<File>,
    at: u64,
    len: u64,
}

impl Source {
    fn cut() -> Problem {
        truncated(
            "DICOM elements of the lengths that they tell",
            "that the file ends within one",
            "the file was cut short or altered: copy it again",
        )
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), Problem> {
        self.reader.read_exact(bytes).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => Self::cut(),
            _ => Problem::Io(error),
        })?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    fn skip(&mut self, count: u64) -> Result<(), Problem> {
        if count > self.len.saturating_sub(self.at) {
            return Err(Self::cut());
        }
        self.reader.seek_relative(i64::try_from(count).unwrap_or(i64::MAX)).map_err(Problem::Io)?;
        self.at += count;
        Ok(())
    }

    /// Back to where an element begins.
    fn unread(&mut self, count: u64) -> Result<(), Problem> {
        self.reader.seek_relative(-i64::try_from(count).unwrap_or(0)).map_err(Problem::Io)?;
        self.at -= count;
        Ok(())
    }

    fn short(&mut self, endian: Endian) -> Result<u16, Problem> {
        let mut bytes = [0; 2];
        self.fill(&mut bytes)?;
        Ok(match endian {
            Endian::Little => u16::from_le_bytes(bytes),
            Endian::Big => u16::from_be_bytes(bytes),
        })
    }

    fn long(&mut self, endian: Endian) -> Result<u32, Problem> {
        let mut bytes = [0; 4];
        self.fill(&mut bytes)?;
        Ok(match endian {
            Endian::Little => u32::from_le_bytes(bytes),
            Endian::Big => u32::from_be_bytes(bytes),
        })
    }

    /// How elements are written where nothing says so: with letters behind the first tag, or without.
    fn guess_writing(&mut self) -> Result<Writing, Problem> {
        let mut start = [0; 6];
        self.fill(&mut start)?;
        self.unread(6)?;
        let has_letters = start[4..].iter().all(u8::is_ascii_uppercase);
        Ok(if has_letters { EXPLICIT } else { IMPLICIT })
    }

    /// Tag, length, and whether it is a sequence by its letters.
    fn head(&mut self, writing: Writing) -> Result<(u32, u32, bool, u64), Problem> {
        let group = self.short(writing.endian)?;
        let element = self.short(writing.endian)?;
        let tag = u32::from(group) << 16 | u32::from(element);
        if !writing.explicit || group == 0xfffe {
            let len = self.long(writing.endian)?;
            return Ok((tag, len, tags::SEQUENCES.contains(&tag), 8));
        }
        let mut letters = [0; 2];
        self.fill(&mut letters)?;
        const LONG: [&[u8; 2]; 13] = [
            b"OB", b"OW", b"OF", b"OD", b"OL", b"OV", b"SQ", b"UC", b"UN", b"UR", b"UT", b"SV",
            b"UV",
        ];
        if LONG.contains(&&letters) {
            self.short(writing.endian)?;
            let len = self.long(writing.endian)?;
            return Ok((tag, len, letters == *b"SQ", 12));
        }
        Ok((tag, u32::from(self.short(writing.endian)?), false, 8))
    }

    /// Reads elements up to the place's end or a delimiter; the pixels, where it comes to them.
    fn dataset(
        &mut self,
        writing: Writing,
        place: Place,
        into: &mut Dataset,
    ) -> Result<Option<(u32, Pixels)>, Problem> {
        if place.depth > MOST_DEPTH {
            return Err(corrupt(
                format!("sequences of at most {MOST_DEPTH} levels"),
                "deeper ones",
                "the file was altered: copy it again",
            ));
        }
        // Fewer bytes than an element's head are what files are filled up with.
        while self.at + 8 <= place.end {
            let (tag, len, is_sequence, head_bytes) = self.head(writing)?;
            if place.only_meta && tag >> 16 != 2 {
                self.unread(head_bytes)?;
                return Ok(None);
            }
            if tag == ITEM_END || tag == SEQUENCE_END {
                return Ok(None);
            }
            if place.depth == 0 && tags::PIXELS.contains(&tag) {
                return Ok(Some((tag, self.pixels(writing, len)?)));
            }
            let left = place.end - self.at;
            if len != UNDEFINED && u64::from(len) > left {
                return Err(Self::cut());
            }
            let keeps = place.keeps && tags::KEPT.binary_search(&tag).is_ok();
            if len == UNDEFINED || is_sequence && keeps {
                let items = self.items(writing, len, Place { keeps, ..place })?;
                if keeps {
                    into.elements.insert(tag, Element::Items(items));
                }
            } else if keeps && u64::from(len) <= MOST_VALUE_BYTES {
                let mut value = vec![0; usize::try_from(len).unwrap_or_default()];
                self.fill(&mut value)?;
                into.elements.insert(tag, Element::Value(value));
            } else {
                self.skip(u64::from(len))?;
            }
        }
        Ok(None)
    }

    fn items(&mut self, writing: Writing, len: u32, place: Place) -> Result<Vec<Dataset>, Problem> {
        let end = match len {
            UNDEFINED => place.end,
            len => self.at + u64::from(len),
        };
        let mut items = Vec::new();
        while self.at + 8 <= end {
            let (tag, len, _, _) = self.head(writing)?;
            match tag {
                SEQUENCE_END => return Ok(items),
                ITEM => {}
                _ => {
                    return Err(corrupt(
                        "items in a DICOM sequence",
                        format!("the tag {:04x},{:04x}", tag >> 16, tag & 0xffff),
                        "the file was altered: copy it again",
                    ));
                }
            }
            let item_end = match len {
                UNDEFINED => end,
                len if u64::from(len) <= end - self.at => self.at + u64::from(len),
                _ => return Err(Self::cut()),
            };
            let mut item = Dataset::new(writing.endian);
            let inside = Place {
                end: item_end,
                depth: place.depth + 1,
                keeps: place.keeps,
                only_meta: false,
            };
            self.dataset(writing, inside, &mut item)?;
            if len != UNDEFINED {
                // Bytes too few for an element.
                self.skip(item_end.saturating_sub(self.at))?;
            }
            if place.keeps {
                items.push(item);
            }
        }
        Ok(items)
    }

    fn pixels(&mut self, writing: Writing, len: u32) -> Result<Pixels, Problem> {
        if len != UNDEFINED {
            // What a cut file holds is told when it is read.
            return Ok(Pixels::Plain(self.at, u64::from(len).min(self.len - self.at)));
        }
        let mut offsets = None;
        let mut fragments = Vec::new();
        while self.at + 8 <= self.len {
            let (tag, len, _, _) = self.head(writing)?;
            if tag == SEQUENCE_END {
                break;
            }
            if tag != ITEM || u64::from(len) > self.len - self.at {
                return Err(Self::cut());
            }
            if offsets.is_none() {
                let mut bytes = vec![0; usize::try_from(len).unwrap_or_default()];
                self.fill(&mut bytes)?;
                let numbers = bytes.chunks_exact(4);
                let number = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                offsets = Some(numbers.map(number).collect());
            } else {
                fragments.push((self.at, u64::from(len)));
                self.skip(u64::from(len))?;
            }
        }
        Ok(Pixels::Packed(offsets.unwrap_or_default(), fragments))
    }
}
