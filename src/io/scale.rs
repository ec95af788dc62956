//! Stored numbers to what they stand for: slope × stored + intercept.

use super::bytes::{no_samples, reserve_samples};
use super::error::Problem;
use crate::core::parallel;
use crate::volume::{Samples, ScalarType};

/// Whole numbers beyond this are not exact among 64-bit floats.
const MOST_EXACT: f64 = 9.007_199_254_740_992e15;

/// The values of stored numbers. Whole ones stay whole, in their own type where that holds them; others become
/// floats of as many bits as the stored ones' digits need.
///
/// # Errors
/// Too little memory for numbers of another type.
pub(super) fn rescaled(samples: Samples, slope: f64, intercept: f64) -> Result<Samples, Problem> {
    if (slope, intercept) == (1.0, 0.0) {
        return Ok(samples);
    }
    let kept = kept_type(&samples, slope, intercept);
    converted(&samples, kept, |value| value * slope + intercept)
}

/// The type that holds the values of all of some stored numbers.
pub(super) fn kept_type(samples: &Samples, slope: f64, intercept: f64) -> ScalarType {
    let stored = samples.scalar_type();
    let is_whole = |number: f64| number.fract() == 0.0;
    if stored.is_integer() && is_whole(slope) && is_whole(intercept) {
        let ends = parallel::merged(
            samples.len(),
            || (f64::INFINITY, f64::NEG_INFINITY),
            |i| (samples.get(i), samples.get(i)),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
        let [a, b] = [ends.0, ends.1].map(|end| end * slope + intercept);
        let (low, high) = (a.min(b), a.max(b));
        let candidates =
            [stored, ScalarType::Int16, ScalarType::UInt16, ScalarType::Int32, ScalarType::Int64];
        let holds = |candidate: &ScalarType| {
            let (least, greatest) = limits(*candidate);
            low >= least && high <= greatest
        };
        if let Some(kept) = candidates.into_iter().find(holds) {
            return kept;
        }
    }
    match stored {
        ScalarType::UInt8
        | ScalarType::Int8
        | ScalarType::UInt16
        | ScalarType::Int16
        | ScalarType::Float32 => ScalarType::Float32,
        _ => ScalarType::Float64,
    }
}

/// The least and greatest number of a type of whole numbers, as far as floats tell them apart.
fn limits(scalar_type: ScalarType) -> (f64, f64) {
    match scalar_type {
        ScalarType::UInt8 => (0.0, f64::from(u8::MAX)),
        ScalarType::Int8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        ScalarType::UInt16 => (0.0, f64::from(u16::MAX)),
        ScalarType::Int16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        ScalarType::UInt32 => (0.0, f64::from(u32::MAX)),
        ScalarType::Int32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        ScalarType::UInt64 => (0.0, MOST_EXACT),
        ScalarType::Int64 => (-MOST_EXACT, MOST_EXACT),
        ScalarType::Float32 | ScalarType::Float64 => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

/// Samples of another type, each made of one.
///
/// # Errors
/// Too little memory.
pub(super) fn converted(
    samples: &Samples,
    to: ScalarType,
    value: impl Fn(f64) -> f64 + Sync,
) -> Result<Samples, Problem> {
    let mut made = no_samples(to);
    reserve_samples(&mut made, samples.len())?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the type holds them"
    )]
    match &mut made {
        Samples::UInt8(to) => extend(to, samples, &value, |v| v as u8),
        Samples::Int8(to) => extend(to, samples, &value, |v| v as i8),
        Samples::UInt16(to) => extend(to, samples, &value, |v| v as u16),
        Samples::Int16(to) => extend(to, samples, &value, |v| v as i16),
        Samples::UInt32(to) => extend(to, samples, &value, |v| v as u32),
        Samples::Int32(to) => extend(to, samples, &value, |v| v as i32),
        Samples::UInt64(to) => extend(to, samples, &value, |v| v as u64),
        Samples::Int64(to) => extend(to, samples, &value, |v| v as i64),
        Samples::Float32(to) => extend(to, samples, &value, |v| v as f32),
        Samples::Float64(to) => extend(to, samples, &value, |v| v),
    }
    Ok(made)
}

/// Compiled for each type that is made, and not for each that is read or each `value`, too.
fn extend<T: Send>(
    to: &mut Vec<T>,
    from: &Samples,
    value: &(dyn Fn(f64) -> f64 + Sync),
    narrow: impl Fn(f64) -> T + Sync,
) {
    parallel::extend(to, from.len(), |i| narrow(value(from.get(i))));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_stay_whole_and_others_become_floats() {
        let ct = Samples::Int16(vec![0, 1024, 3000]);
        assert_eq!(rescaled(ct, 1.0, -1024.0).unwrap(), Samples::Int16(vec![-1024, 0, 1976]));
        let unsigned = Samples::UInt16(vec![0, 5000]);
        assert_eq!(rescaled(unsigned, 1.0, -1000.0).unwrap(), Samples::Int16(vec![-1000, 4000]));
        let wide = Samples::UInt16(vec![0, 65535]);
        assert_eq!(rescaled(wide, 2.0, -1.0).unwrap(), Samples::Int32(vec![-1, 131_069]));
        let halves = Samples::UInt8(vec![1, 255]);
        assert_eq!(rescaled(halves, 0.5, 0.0).unwrap(), Samples::Float32(vec![0.5, 127.5]));
        let dose = Samples::UInt32(vec![4_000_000_001]);
        assert_eq!(rescaled(dose, 0.5, 0.0).unwrap(), Samples::Float64(vec![2_000_000_000.5]));
        let same = Samples::Float32(vec![f32::NAN]);
        assert!(matches!(rescaled(same, 1.0, 0.0).unwrap(), Samples::Float32(v) if v[0].is_nan()));
    }
}
