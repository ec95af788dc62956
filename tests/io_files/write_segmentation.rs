//! A DICOM segmentation, written apart from the reader.

use crate::write_dicom::{element, number, text};

/// A segmentation of two planes of 2 × 1 pixels, a millimetre apart: segment 1 has the first pixel of the lower plane, and
/// segment 7 both of the upper one. The first is called "Liver", in the red of sRGB; the other has neither name nor colour.
pub(crate) fn segmentation() -> Vec<u8> {
    let sequence = |tag, items: &[Vec<u8>]| {
        let item = |content: &Vec<u8>| {
            let len = (content.len() as u32).to_le_bytes();
            [&[0xfe, 0xff, 0x00, 0xe0], &len[..], content].concat()
        };
        element(tag, b"SQ", &items.iter().flat_map(item).collect::<Vec<u8>>())
    };
    let frame = |z: u32, segment: u16| {
        let place = text([0x0020, 0x0032], b"DS", &format!("0\\0\\{z}"));
        let which = number([0x0062, 0x000b], segment);
        [sequence([0x0020, 0x9113], &[place]), sequence([0x0062, 0x000a], &[which])].concat()
    };
    // L*a*b* of (54.29, 80.81, 69.89), each brought to 16 bits.
    let red = [35_579_u16, 53_663, 50_857].map(u16::to_le_bytes).concat();
    let liver = [
        number([0x0062, 0x0004], 1),
        text([0x0062, 0x0005], b"LO", "Liver"),
        element([0x0062, 0x000d], b"US", &red),
    ];
    let mut file = vec![0; 128];
    file.extend(b"DICM");
    let syntax = text([0x0002, 0x0010], b"UI", "1.2.840.10008.1.2.1");
    file.extend(element([0x0002, 0], b"UL", &(syntax.len() as u32).to_le_bytes()));
    file.extend(syntax);
    file.extend(text([0x0008, 0x0016], b"UI", "1.2.840.10008.5.1.4.1.1.66.4"));
    file.extend(text([0x0008, 0x0060], b"CS", "SEG"));
    file.extend(text([0x0020, 0x000e], b"UI", "1.2.3"));
    file.extend(text([0x0020, 0x0037], b"DS", "1\\0\\0\\0\\1\\0"));
    file.extend(number([0x0028, 0x0002], 1));
    file.extend(text([0x0028, 0x0004], b"CS", "MONOCHROME2"));
    file.extend(text([0x0028, 0x0008], b"IS", "2"));
    file.extend(number([0x0028, 0x0010], 1));
    file.extend(number([0x0028, 0x0011], 2));
    file.extend(text([0x0028, 0x0030], b"DS", "1\\1"));
    for (which, bits) in [(0x0100, 8), (0x0101, 8), (0x0102, 7), (0x0103, 0)] {
        file.extend(number([0x0028, which], bits));
    }
    file.extend(sequence([0x0062, 0x0002], &[liver.concat(), number([0x0062, 0x0004], 7)]));
    file.extend(sequence([0x5200, 0x9230], &[frame(0, 1), frame(1, 7)]));
    file.extend(element([0x7fe0, 0x0010], b"OW", &[1, 0, 1, 1]));
    file
}
