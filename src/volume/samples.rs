//! Samples in the scalar type their file stores.

use serde::{Deserialize, Serialize};

use crate::core::names;

/// A scalar type, named as NumPy names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it all")]
pub enum ScalarType {
    UInt8,
    Int8,
    UInt16,
    Int16,
    UInt32,
    Int32,
    UInt64,
    Int64,
    Float32,
    Float64,
}

names!(
    /// The smallest first.
    ScalarType[10] {
        UInt8 => "uint8",
        Int8 => "int8",
        UInt16 => "uint16",
        Int16 => "int16",
        UInt32 => "uint32",
        Int32 => "int32",
        UInt64 => "uint64",
        Int64 => "int64",
        Float32 => "float32",
        Float64 => "float64",
    }
);

impl ScalarType {
    /// Whether its values are whole numbers.
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::Float32 | Self::Float64)
    }

    /// Bytes of one sample.
    pub fn size_bytes(self) -> usize {
        match self {
            Self::UInt8 | Self::Int8 => 1,
            Self::UInt16 | Self::Int16 => 2,
            Self::UInt32 | Self::Int32 | Self::Float32 => 4,
            Self::UInt64 | Self::Int64 | Self::Float64 => 8,
        }
    }
}

/// Samples of one scalar type, components interleaved, x fastest.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it all")]
pub enum Samples {
    UInt8(Vec<u8>),
    Int8(Vec<i8>),
    UInt16(Vec<u16>),
    Int16(Vec<i16>),
    UInt32(Vec<u32>),
    Int32(Vec<i32>),
    UInt64(Vec<u64>),
    Int64(Vec<i64>),
    Float32(Vec<f32>),
    Float64(Vec<f64>),
}

/// Runs `$body` with `$values` bound to the typed `Vec` inside a [`Samples`].
#[macro_export]
macro_rules! with_samples {
    ($samples:expr, $values:ident => $body:expr) => {
        match $samples {
            $crate::volume::Samples::UInt8($values) => $body,
            $crate::volume::Samples::Int8($values) => $body,
            $crate::volume::Samples::UInt16($values) => $body,
            $crate::volume::Samples::Int16($values) => $body,
            $crate::volume::Samples::UInt32($values) => $body,
            $crate::volume::Samples::Int32($values) => $body,
            $crate::volume::Samples::UInt64($values) => $body,
            $crate::volume::Samples::Int64($values) => $body,
            $crate::volume::Samples::Float32($values) => $body,
            $crate::volume::Samples::Float64($values) => $body,
        }
    };
}

/// A stored scalar as `f64`. Integers beyond 2⁵³ are rounded to the nearest double.
pub trait Scalar: Copy + Send + Sync + 'static {
    /// The value as a double.
    fn to_f64(self) -> f64;

    /// The value as a whole number: what lies between is cut off, what lies beyond 64 bits lowered to
    /// them, and NaN 0.
    fn to_i64(self) -> i64;
}

macro_rules! scalar {
    ($($t:ty),*) => { $(impl Scalar for $t {
        fn to_f64(self) -> f64 { self as f64 }
        fn to_i64(self) -> i64 { self as i64 }
    })* };
}
scalar!(u8, i8, u16, i16, u32, i32, u64, i64, f32, f64);

impl Samples {
    /// The scalar type of every sample.
    pub fn scalar_type(&self) -> ScalarType {
        match self {
            Self::UInt8(_) => ScalarType::UInt8,
            Self::Int8(_) => ScalarType::Int8,
            Self::UInt16(_) => ScalarType::UInt16,
            Self::Int16(_) => ScalarType::Int16,
            Self::UInt32(_) => ScalarType::UInt32,
            Self::Int32(_) => ScalarType::Int32,
            Self::UInt64(_) => ScalarType::UInt64,
            Self::Int64(_) => ScalarType::Int64,
            Self::Float32(_) => ScalarType::Float32,
            Self::Float64(_) => ScalarType::Float64,
        }
    }

    /// Number of samples (tuples × components).
    pub fn len(&self) -> usize {
        with_samples!(self, values => values.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes the samples take.
    pub fn size_bytes(&self) -> usize {
        self.len() * self.scalar_type().size_bytes()
    }

    /// Sample `index` as a double (see [`Scalar`]). Panics beyond the end, which is our own bug.
    pub fn get(&self, index: usize) -> f64 {
        with_samples!(self, values => values[index].to_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_found_by_its_name() {
        for t in ScalarType::ALL {
            assert_eq!(ScalarType::from_name(t.name()), Some(t));
        }
        assert_eq!(ScalarType::from_name("complex64"), None);
    }

    #[test]
    fn samples_keep_type_and_value() {
        let samples = Samples::Int16(vec![-3, 7]);
        assert_eq!(samples.scalar_type(), ScalarType::Int16);
        assert_eq!((samples.get(0), samples.get(1)), (-3.0, 7.0));
        assert_eq!(samples.size_bytes(), 4);
    }
}
