//! Plain DICOM slices, written apart from the reader.

/// One slice of a scan of 16 bits, explicit and little-endian.
pub(crate) struct Slice<'a> {
    pub(crate) series: &'a str,
    pub(crate) number: u32,
    pub(crate) description: &'a str,
    /// Millimetres up.
    pub(crate) z: f64,
    /// Of what no other slice is called.
    pub(crate) instance: u32,
    pub(crate) columns: u16,
    pub(crate) rows: u16,
    /// Two bytes each.
    pub(crate) pixels: &'a [u8],
}

impl Slice<'_> {
    pub(crate) fn file(&self) -> Vec<u8> {
        let mut file = vec![0; 128];
        file.extend(b"DICM");
        let syntax = text([0x0002, 0x0010], b"UI", "1.2.840.10008.1.2.1");
        file.extend(element([0x0002, 0], b"UL", &(syntax.len() as u32).to_le_bytes()));
        file.extend(syntax);
        file.extend(text([0x0008, 0x0016], b"UI", "1.2.840.10008.5.1.4.1.1.2"));
        file.extend(text([0x0008, 0x0018], b"UI", &format!("{}.{}", self.series, self.instance)));
        file.extend(text([0x0008, 0x0060], b"CS", "CT"));
        if !self.description.is_empty() {
            file.extend(text([0x0008, 0x103e], b"LO", self.description));
        }
        file.extend(text([0x0020, 0x000e], b"UI", self.series));
        file.extend(text([0x0020, 0x0011], b"IS", &self.number.to_string()));
        file.extend(text([0x0020, 0x0032], b"DS", &format!("0\\0\\{}", self.z)));
        file.extend(text([0x0020, 0x0037], b"DS", "1\\0\\0\\0\\1\\0"));
        file.extend(number([0x0028, 0x0002], 1));
        file.extend(text([0x0028, 0x0004], b"CS", "MONOCHROME2"));
        file.extend(number([0x0028, 0x0010], self.rows));
        file.extend(number([0x0028, 0x0011], self.columns));
        file.extend(text([0x0028, 0x0030], b"DS", "1\\1"));
        for (which, bits) in [(0x0100, 16), (0x0101, 16), (0x0102, 15), (0x0103, 0)] {
            file.extend(number([0x0028, which], bits));
        }
        file.extend(element([0x7fe0, 0x0010], b"OW", self.pixels));
        file
    }
}

pub(crate) fn text(tag: [u16; 2], kind: &[u8; 2], words: &str) -> Vec<u8> {
    let mut padded = words.to_owned();
    if padded.len() % 2 == 1 {
        padded.push(if kind == b"UI" { '\0' } else { ' ' });
    }
    element(tag, kind, padded.as_bytes())
}

pub(crate) fn number(tag: [u16; 2], value: u16) -> Vec<u8> {
    element(tag, b"US", &value.to_le_bytes())
}

pub(crate) fn element(tag: [u16; 2], kind: &[u8; 2], value: &[u8]) -> Vec<u8> {
    let mut bytes = [tag[0].to_le_bytes(), tag[1].to_le_bytes(), *kind].concat();
    if [b"OW", b"SQ"].contains(&kind) {
        bytes.extend([0, 0]);
        bytes.extend((value.len() as u32).to_le_bytes());
    } else {
        bytes.extend((value.len() as u16).to_le_bytes());
    }
    bytes.extend(value);
    bytes
}
