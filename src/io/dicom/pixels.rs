//! A frame's pixels, unpacked: plain ones, RLE, JPEG (8 bits and lossless), JPEG-LS and JPEG 2000.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};

use super::super::bytes::{self, Endian};
use super::super::error::{Problem, corrupt, quoted, truncated, unsupported};
use super::super::files;
use super::dataset::Pixels;
use super::slices::{Form, Slices};
use crate::core::panics::caught;
use crate::volume::{Samples, ScalarType};

/// How pixels are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Packing {
    Rle,
    Jpeg,
    JpegLs,
    Jpeg2000,
}

fn packing(syntax: &str) -> Result<Packing, Problem> {
    let name = syntax.strip_prefix("1.2.840.10008.1.2.").unwrap_or(syntax);
    Ok(match name {
        "5" => Packing::Rle,
        "4.50" | "4.51" | "4.57" | "4.70" => Packing::Jpeg,
        "4.80" | "4.81" => Packing::JpegLs,
        "4.90" | "4.91" => Packing::Jpeg2000,
        _ => {
            let found = match name {
                "4.201" | "4.202" | "4.203" => "high-throughput JPEG 2000".to_owned(),
                "4.110" | "4.111" | "4.112" => "JPEG XL".to_owned(),
                _ if name.starts_with("4.10") => "video".to_owned(),
                _ => format!("the transfer syntax {}", quoted(syntax)),
            };
            return Err(unsupported(
                "plain pixels, RLE, JPEG, JPEG-LS or JPEG 2000",
                found,
                "convert the files (dcmconv, gdcmconv --raw IN OUT)",
            ));
        }
    })
}

/// A file of pictures, from which frames are read one by one.
pub(super) struct Reader<'a> {
    slices: &'a Slices,
    file: File,
    scalar_type: ScalarType,
}

impl<'a> Reader<'a> {
    /// # Errors
    /// No file, or pixels packed in a way that is not read.
    pub(super) fn open(slices: &'a Slices) -> Result<Self, Problem> {
        let (file, _) = files::open_file(&slices.path)?;
        let form = &slices.form;
        if matches!(slices.pixels, Pixels::Packed(..)) {
            packing(&slices.syntax)?;
        }
        Ok(Self { slices, file, scalar_type: form.scalar_type()? })
    }

    /// One frame's numbers as they are stored, those of a pixel together.
    ///
    /// # Errors
    /// Damage.
    pub(super) fn frame(&mut self, index: u32) -> Result<Samples, Problem> {
        let form = &self.slices.form;
        let (bytes, endian) = match &self.slices.pixels {
            Pixels::Plain(at, _) if form.bits_allocated == 1 => {
                (self.bits(*at, index)?, Endian::Little)
            }
            Pixels::Plain(at, _) => {
                let len = form.len() * self.scalar_type.size_bytes();
                let from = at + u64::from(index) * len as u64;
                (self.part(from, len as u64)?, self.slices.endian)
            }
            Pixels::Packed(offsets, fragments) => {
                let packed = self.fragments(offsets, fragments, index)?;
                (unpacked(&packed, packing(&self.slices.syntax)?, form)?, Endian::Little)
            }
        };
        let mut samples = of_bytes(&bytes, self.scalar_type, form.len())?;
        bytes::to_native(&mut samples, endian);
        let is_planar = form.planar && form.components > 1;
        if is_planar && matches!(self.slices.pixels, Pixels::Plain(..)) {
            samples = interleaved(&samples, form);
        }
        without_overlay(&mut samples, form);
        Ok(samples)
    }

    fn part(&mut self, from: u64, len: u64) -> Result<Vec<u8>, Problem> {
        self.file.seek(SeekFrom::Start(from)).map_err(Problem::Io)?;
        let mut part = Vec::new();
        (&mut self.file).take(len).read_to_end(&mut part).map_err(Problem::Io)?;
        Ok(part)
    }

    /// Pixels of one bit, which go on from frame to frame without a gap.
    fn bits(&mut self, at: u64, index: u32) -> Result<Vec<u8>, Problem> {
        let len = self.slices.form.len() as u64;
        let first = u64::from(index) * len;
        let packed = self.part(at + first / 8, (first % 8 + len).div_ceil(8))?;
        let bit = |i: u64| {
            let at = usize::try_from(i / 8).unwrap_or(usize::MAX);
            packed.get(at).map_or(0, |byte| byte >> (i % 8) & 1)
        };
        Ok((first % 8..first % 8 + len).map(bit).collect())
    }

    /// The fragments of a frame, joined.
    fn fragments(
        &mut self,
        offsets: &[u32],
        fragments: &[(u64, u64)],
        index: u32,
    ) -> Result<Vec<u8>, Problem> {
        let frames = self.slices.frames.len();
        let index = index as usize;
        let own: Vec<(u64, u64)> = if fragments.len() == frames {
            fragments.get(index).copied().into_iter().collect()
        } else if frames == 1 {
            fragments.to_vec()
        } else {
            // Offsets count from the first fragment's head.
            let start = fragments.first().map_or(0, |(at, _)| at - 8);
            let from = offsets.get(index).map_or(u64::MAX, |n| u64::from(*n));
            let to = offsets.get(index + 1).map_or(u64::MAX, |n| u64::from(*n));
            let range = from..to;
            fragments.iter().copied().filter(|(at, _)| range.contains(&(at - 8 - start))).collect()
        };
        if own.is_empty() {
            return Err(truncated(
                format!("packed pixels of {frames} frames"),
                format!("none of frame {}", index + 1),
                "the file was cut short: copy it again",
            ));
        }
        let mut joined = Vec::new();
        for (at, len) in own {
            joined.extend(self.part(at, len)?);
        }
        Ok(joined)
    }
}

/// Little-endian pixels of a packed frame.
fn unpacked(packed: &[u8], packing: Packing, form: &Form) -> Result<Vec<u8>, Problem> {
    let made = caught(|| match packing {
        Packing::Rle => of_rle(packed, form),
        Packing::Jpeg => of_jpeg(packed, form),
        Packing::JpegLs => of_jpeg_ls(packed, form),
        Packing::Jpeg2000 => of_jpeg_2000(packed, form),
    });
    made.unwrap_or_else(|words| Err(damaged(&words)))
}

fn damaged(words: &str) -> Problem {
    corrupt("packed pixels that decode", quoted(words), "the file was altered: copy it again")
}

fn other_form(form: &Form, found: &str) -> Problem {
    corrupt(
        format!("a packed picture of {} × {} pixels", form.columns, form.rows),
        found.to_owned(),
        "the file was altered: export it again",
    )
}

/// Planes of bytes, the most significant first, packed in runs.
fn of_rle(packed: &[u8], form: &Form) -> Result<Vec<u8>, Problem> {
    /// Two bytes stand for so many at most.
    const MOST: u64 = 128;
    let pixels = form.columns * form.rows;
    let each = usize::from(form.bits_allocated / 8).max(1);
    let planes = form.components * each;
    bytes::require_stored((pixels * planes) as u64, (packed.len() as u64).saturating_mul(MOST))?;
    let number = |i: usize| {
        let bytes = packed.get(4 * i..4 * i + 4)?;
        Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize)
    };
    if number(0) != Some(planes) || planes > 15 {
        return Err(damaged(&format!("{:?} planes rather than {planes}", number(0).unwrap_or(0))));
    }
    let mut made = vec![0; pixels * planes];
    for plane in 0..planes {
        let from = number(1 + plane).unwrap_or(usize::MAX);
        let to = if plane + 1 < planes { number(2 + plane) } else { None }.unwrap_or(packed.len());
        let segment = packed.get(from..to).ok_or_else(|| damaged("a plane beyond the end"))?;
        // Numbers lie with their least byte first.
        let place = plane / each * each + (each - 1 - plane % each);
        let mut filled = 0;
        let mut at = 0;
        while filled < pixels && at < segment.len() {
            let code = segment[at];
            at += 1;
            let (run, step) = match code {
                0..=127 => (usize::from(code) + 1, 1),
                128 => continue,
                129..=255 => (257 - usize::from(code), 0),
            };
            for _ in 0..run.min(pixels - filled) {
                let Some(&byte) = segment.get(at) else { break };
                made[filled * planes + place] = byte;
                at += step;
                filled += 1;
            }
            at += 1 - step;
        }
        if filled < pixels {
            return Err(damaged("a plane that ends early"));
        }
    }
    Ok(made)
}

fn of_jpeg(packed: &[u8], form: &Form) -> Result<Vec<u8>, Problem> {
    use jpeg_decoder::{Decoder, PixelFormat};
    let failed = |error: jpeg_decoder::Error| damaged(&error.to_string());
    let mut decoder = Decoder::new(Cursor::new(packed));
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or_else(|| damaged("no picture"))?;
    let format = (info.pixel_format, form.components, form.bits_allocated);
    let fits = matches!(
        format,
        (PixelFormat::L8, 1, 8 | 16) | (PixelFormat::L16, 1, 16) | (PixelFormat::RGB24, 3, 8)
    );
    if [usize::from(info.width), usize::from(info.height)] != [form.columns, form.rows] || !fits {
        return Err(other_form(
            form,
            &format!("{} × {} of {:?}", info.width, info.height, format.0),
        ));
    }
    let made = decoder.decode().map_err(failed)?;
    Ok(match (info.pixel_format, form.bits_allocated) {
        (PixelFormat::L8, 16) => made.iter().flat_map(|v| u16::from(*v).to_le_bytes()).collect(),
        // The decoder's order is this machine's.
        (PixelFormat::L16, _) => made
            .chunks_exact(2)
            .flat_map(|v| u16::from_ne_bytes([v[0], v[1]]).to_le_bytes())
            .collect(),
        _ => made,
    })
}

fn of_jpeg_ls(packed: &[u8], form: &Form) -> Result<Vec<u8>, Problem> {
    if form.components != 1 || !matches!(form.bits_allocated, 8 | 16) {
        return Err(unsupported(
            "grey pictures of 8 or 16 bits in JPEG-LS",
            format!("{} colours of {} bits", form.components, form.bits_allocated),
            "convert the files (gdcmconv --raw IN OUT)",
        ));
    }
    let too_large = |_| other_form(form, "more");
    let width = u32::try_from(form.columns).map_err(too_large)?;
    let height = u32::try_from(form.rows).map_err(too_large)?;
    // Its own header first, so that nothing is made for another size.
    let sizes = frame_of_jpeg_ls(packed).ok_or_else(|| damaged("no frame in JPEG-LS"))?;
    if sizes != [width, height] {
        return Err(other_form(form, &format!("{} × {}", sizes[0], sizes[1])));
    }
    let (made, _, _) =
        jpegls::decode(packed, width, height).map_err(|error| damaged(&error.to_string()))?;
    Ok(of_shorts(&made, form))
}

/// Columns and rows by the frame's header.
fn frame_of_jpeg_ls(packed: &[u8]) -> Option<[u32; 2]> {
    let mut at = 2;
    loop {
        let head = packed.get(at..at + 4)?;
        let len = usize::from(u16::from_be_bytes([head[2], head[3]]));
        if head[0] != 0xff || len < 2 {
            return None;
        }
        if head[1] == 0xf7 {
            let body = packed.get(at + 4..at + 9)?;
            let short = |i: usize| u32::from(u16::from_be_bytes([body[i], body[i + 1]]));
            return Some([short(3), short(1)]);
        }
        at += 2 + len;
    }
}

/// Numbers of 16 bits as bytes of the form's.
fn of_shorts(numbers: &[u16], form: &Form) -> Vec<u8> {
    match form.bits_allocated {
        #[expect(clippy::cast_possible_truncation, reason = "the upper byte is empty")]
        8 => numbers.iter().map(|v| *v as u8).collect(),
        _ => numbers.iter().flat_map(|v| v.to_le_bytes()).collect(),
    }
}

fn of_jpeg_2000(packed: &[u8], form: &Form) -> Result<Vec<u8>, Problem> {
    use hayro_jpeg2000::{DecodeSettings, DecoderContext, Image};
    let failed = |error: hayro_jpeg2000::DecodeError| damaged(&error.to_string());
    if !matches!(form.bits_allocated, 8 | 16) {
        return Err(damaged("a picture of more than 16 bits"));
    }
    let image = Image::new(packed, &DecodeSettings::default()).map_err(failed)?;
    let sizes = [image.width() as usize, image.height() as usize];
    if sizes != [form.columns, form.rows] {
        return Err(other_form(form, &format!("{} × {}", sizes[0], sizes[1])));
    }
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(failed)?;
    let components = decoded.components();
    let whole = components.len() == form.components
        && components.iter().all(|c| c.samples().len() == form.columns * form.rows);
    if !whole {
        return Err(other_form(form, &format!("{} components", components.len())));
    }
    let numbers = (0..form.columns * form.rows).flat_map(|pixel| {
        components.iter().map(move |component| {
            let value = component.samples()[pixel].round();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "16 bits, signed or not"
            )]
            let bits = value as i32 as u16;
            bits
        })
    });
    Ok(of_shorts(&numbers.collect::<Vec<u16>>(), form))
}

fn of_bytes(bytes: &[u8], scalar_type: ScalarType, count: usize) -> Result<Samples, Problem> {
    let mut samples = bytes::no_samples(scalar_type);
    let ticket = crate::core::Ticket::new();
    let mut progress = bytes::Progress::new(&ticket, 1);
    bytes::append(&mut samples, &mut &*bytes, count, &mut progress)?;
    Ok(samples)
}

/// Colours of each pixel together.
fn interleaved(planes: &Samples, form: &Form) -> Samples {
    let pixels = form.columns * form.rows;
    macro_rules! interleaved {
        ($($kind:ident),*) => {
            match planes {
                $(Samples::$kind(values) => Samples::$kind(
                    (0..pixels * form.components)
                        .map(|i| values[i % form.components * pixels + i / form.components])
                        .collect(),
                ),)*
            }
        };
    }
    interleaved!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64, Float32, Float64)
}

/// Keeps the stored bits of each pixel: others are of overlays, or of nothing.
fn without_overlay(samples: &mut Samples, form: &Form) {
    if form.is_float || form.bits_stored == form.bits_allocated {
        return;
    }
    let up = form.bits_allocated - 1 - form.high_bit;
    let down = form.bits_allocated - form.bits_stored;
    macro_rules! shifted {
        ($($kind:ident),*) => {
            match samples {
                // Shifts of signed numbers keep the sign.
                $(Samples::$kind(values) => values.iter_mut().for_each(|v| *v = (*v << up) >> down),)*
                Samples::Float32(_) | Samples::Float64(_) => {}
            }
        };
    }
    shifted!(UInt8, Int8, UInt16, Int16, UInt32, Int32, UInt64, Int64);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(bits_allocated: u16, components: usize) -> Form {
        Form {
            columns: 3,
            rows: 2,
            components,
            planar: false,
            bits_allocated,
            bits_stored: bits_allocated,
            high_bit: bits_allocated - 1,
            signed: false,
            is_float: false,
            photometric: "MONOCHROME2".to_owned(),
        }
    }

    #[test]
    fn runs_and_literals_of_two_planes_become_numbers() {
        let mut packed = vec![0; 64];
        packed[0] = 2;
        packed[4..8].copy_from_slice(&64_u32.to_le_bytes());
        packed[8..12].copy_from_slice(&66_u32.to_le_bytes());
        // Six times 1; then 10 to 12, and three times 7.
        packed.extend([251, 1, 2, 10, 11, 12, 128, 254, 7]);
        let made = of_rle(&packed, &form(16, 1)).unwrap();
        let expected = [266_u16, 267, 268, 263, 263, 263];
        assert_eq!(made, expected.map(u16::to_le_bytes).concat());
        packed.truncate(70);
        assert!(of_rle(&packed, &form(16, 1)).is_err(), "a plane is cut");
        assert!(of_rle(&packed[..60], &form(16, 1)).is_err(), "the head is cut");
        assert!(of_rle(&packed, &form(8, 1)).is_err(), "another number of planes");
    }

    #[test]
    fn bits_that_are_not_stored_are_dropped_and_signs_extended() {
        let twelve = Form { bits_stored: 12, high_bit: 11, ..form(16, 1) };
        let mut samples = Samples::UInt16(vec![0xf123, 0x0fff]);
        without_overlay(&mut samples, &twelve);
        assert_eq!(samples, Samples::UInt16(vec![0x123, 0xfff]));
        let mut samples = Samples::Int16(vec![0x0fff, 0x7001]);
        without_overlay(&mut samples, &twelve);
        assert_eq!(samples, Samples::Int16(vec![-1, 1]));
        let high = Form { bits_stored: 12, high_bit: 15, ..form(16, 1) };
        let mut samples = Samples::UInt16(vec![0xabcd]);
        without_overlay(&mut samples, &high);
        assert_eq!(samples, Samples::UInt16(vec![0xabc]));
    }

    #[test]
    fn colours_in_planes_are_brought_together() {
        let planes = Samples::UInt8((0..12).collect());
        let mixed = interleaved(&planes, &form(8, 2));
        assert_eq!(mixed, Samples::UInt8(vec![0, 6, 1, 7, 2, 8, 3, 9, 4, 10, 5, 11]));
    }
}
