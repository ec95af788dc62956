//! Numbers at places of a binary header.

use super::bytes::Endian;

/// A header's bytes, and the order of those of its numbers. What lies beyond its end is 0.
#[derive(Clone, Copy)]
pub(super) struct Numbers<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) endian: Endian,
}

impl Numbers<'_> {
    fn at<const N: usize>(self, place: usize) -> [u8; N] {
        let mut found = [0; N];
        if let Some(bytes) = place.checked_add(N).and_then(|end| self.bytes.get(place..end)) {
            found.copy_from_slice(bytes);
        }
        if self.endian == Endian::Big {
            found.reverse();
        }
        found
    }

    pub(super) fn i16(self, place: usize) -> i16 {
        i16::from_le_bytes(self.at(place))
    }

    pub(super) fn i32(self, place: usize) -> i32 {
        i32::from_le_bytes(self.at(place))
    }

    pub(super) fn i64(self, place: usize) -> i64 {
        i64::from_le_bytes(self.at(place))
    }

    pub(super) fn f32(self, place: usize) -> f64 {
        f64::from(f32::from_le_bytes(self.at(place)))
    }

    pub(super) fn f64(self, place: usize) -> f64 {
        f64::from_le_bytes(self.at(place))
    }
}
