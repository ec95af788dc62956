//! Values that differ in the file and are drawn alike: told, never passed over.

use crate::volume::{Field, Samples};

/// Whole numbers are noted to be too large for doubles where those divide their range into fewer steps
/// than this.
const FEW_STEPS: f64 = 4096.0;

/// A sentence for a field of whole numbers so large that doubles, which they are drawn as, do not tell
/// neighbours apart, and whose range is so small that it shows.
pub(super) fn merged_neighbours(field: &Field) -> Option<String> {
    let [least, greatest] = match &*field.samples {
        Samples::UInt64(values) => {
            [values.iter().min(), values.iter().max()].map(|end| end.map(|&v| i128::from(v)))
        }
        Samples::Int64(values) => {
            [values.iter().min(), values.iter().max()].map(|end| end.map(|&v| i128::from(v)))
        }
        _ => return None,
    };
    let (least, greatest) = (least?, greatest?);
    // Doubles lie further apart the further from zero: between the ends of the range, as far as here.
    let [nearest, farthest] = match least.unsigned_abs() < greatest.unsigned_abs() {
        true => [least, greatest].map(|end| end.unsigned_abs() as f64),
        false => [greatest, least].map(|end| end.unsigned_abs() as f64),
    };
    let step = f64::max(nearest.next_up() - nearest, farthest - farthest.next_down());
    let range = (greatest - least) as f64;
    (step > 1.0 && range > 0.0 && range / step < FEW_STEPS).then(|| {
        format!(
            "field \"{}\" has whole numbers from {least} to {greatest}, where 64-bit floats, which are \
             drawn, lie {step} apart: neighbouring values cannot be told apart; subtract {least} from \
             all of them",
            field.name
        )
    })
}

/// Where all values are nearer to zero than this, tables (never narrower than 1e-30 · 2⁻²²) have few
/// entries for them, and below 1.2e-38 32-bit devices take them for zero.
const NEXT_TO_ZERO: f64 = 1e-33;

/// A sentence for a field of floats that are all so near to zero that they are drawn as next to one value.
pub(super) fn merged_at_zero(field: &Field) -> Option<String> {
    // Stops at the first that is not, which is soon.
    fn least_and_most(mut values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
        values.try_fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], value| match value {
            v if !v.is_finite() => Some([least, most]),
            v if v.abs() >= NEXT_TO_ZERO => None,
            v => Some([least.min(v), most.max(v)]),
        })
    }
    let [least, most] = match &*field.samples {
        Samples::Float32(values) => least_and_most(values.iter().map(|&v| f64::from(v))),
        Samples::Float64(values) => least_and_most(values.iter().copied()),
        _ => None,
    }?;
    (least < most).then(|| {
        format!(
            "field \"{}\" has values from {least:e} to {most:e}, nearer to zero than the {NEXT_TO_ZERO:e} \
             from which drawing tells them apart; multiply all of them by a power of ten",
            field.name
        )
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::volume::Association;

    fn note(values: Vec<f32>) -> Option<String> {
        merged_at_zero(&Field {
            name: "heat".to_owned(),
            components: 1,
            association: Association::Point,
            samples: Arc::new(Samples::Float32(values)),
        })
    }

    #[test]
    fn denormals_are_told_where_there_is_nothing_else() {
        let denormals: Vec<f32> = (0..200_u8).map(|i| f32::from(i) * 1e-41).collect();
        let told = note(denormals.clone()).expect("told");
        assert!(told.starts_with("field \"heat\" has values from 0e0 to 1.9"), "{told}");
        assert!(told.ends_with("multiply all of them by a power of ten"), "{told}");
        let negative = denormals.iter().map(|v| -v).chain([f32::NAN, f32::INFINITY]).collect();
        assert!(note(negative).is_some());
        // Beside others they are zeros, and are one value as zeros are.
        assert_eq!(note(denormals.into_iter().chain([1.0]).collect()), None);
        assert_eq!(note(vec![0.0; 8]), None);
        assert_eq!(note(vec![0.0, 2e-33]), None);
    }
}
