//! What the dimensions of a NetCDF file mean, and where they put the samples (the CF conventions, §4).

use std::sync::Arc;

use netcdf_reader::{NcFile, NcVariable};

use crate::volume::length_unit;

/// Dimensions of these names are lists of volumes.
const LISTS: [&str; 17] = [
    "time",
    "t",
    "month",
    "months",
    "day",
    "days",
    "hour",
    "hours",
    "year",
    "step",
    "season",
    "valid_time",
    "time_counter",
    "member",
    "ensemble",
    "number",
    "realization",
];
/// Units of pressure, which falls with height.
const PRESSURES: [&str; 9] =
    ["pa", "hpa", "kpa", "mbar", "mb", "millibar", "millibars", "dbar", "atm"];
/// Coordinates beyond this many are no axis.
const MOST_COORDINATES: u64 = 1 << 24;

/// One dimension and its coordinates.
pub(super) struct Axis {
    pub(super) name: String,
    pub(super) size: u64,
    /// One an entry, rising or falling; `None` where the file tells none.
    pub(super) coordinates: Option<Vec<f64>>,
    units: String,
    is_downward: bool,
}

fn text(variable: &NcVariable, name: &str) -> String {
    let value = variable.attribute(name).and_then(|attribute| attribute.value.as_string());
    value.unwrap_or_default().trim().to_lowercase()
}

fn coordinate_variable<'a>(file: &'a NcFile, name: &str) -> Option<&'a NcVariable> {
    let variable = file.variable(name).ok()?;
    let dimensions = variable.dimensions();
    (dimensions.len() == 1 && dimensions[0].name == name).then_some(variable)
}

/// Whether a dimension's entries are volumes of their own.
pub(super) fn is_list(file: &NcFile, name: &str) -> bool {
    let units = coordinate_variable(file, name).map(|variable| text(variable, "units"));
    LISTS.contains(&name.to_lowercase().as_str())
        || units.is_some_and(|units| units.contains(" since "))
}

impl Axis {
    pub(super) fn of(file: &NcFile, name: &str, size: u64) -> Self {
        let mut axis = Self {
            name: name.to_owned(),
            size,
            coordinates: None,
            units: String::new(),
            is_downward: false,
        };
        let Some(variable) = coordinate_variable(file, name) else { return axis };
        axis.units = text(variable, "units");
        axis.is_downward =
            text(variable, "positive") == "down" || PRESSURES.contains(&axis.units.as_str());
        // What is too long, damaged or no numbers is counted instead, and said to be.
        if variable.shape() == [size] && size <= MOST_COORDINATES {
            let values = file.read_variable_unpacked(name).ok();
            axis.coordinates = values
                .map(|values| values.into_raw_vec_and_offset().0)
                .filter(|values| values.len() as u64 == size && is_monotonic(values));
        }
        axis
    }

    /// The coordinate of an entry in text, or its number where there are none.
    pub(super) fn value(&self, index: u64) -> String {
        let told = self.coordinates.as_ref().zip(usize::try_from(index).ok());
        match told.and_then(|(values, at)| values.get(at)) {
            Some(value) => value.to_string(),
            None => index.to_string(),
        }
    }
}

fn is_monotonic(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
        && (values.windows(2).all(|pair| pair[0] < pair[1])
            || values.windows(2).all(|pair| pair[0] > pair[1]))
}

/// The unit of all axes, where they are drawn in one: degrees of longitude and latitude are one.
pub(super) fn unit(axes: &[Axis]) -> Option<String> {
    let unit_of = |axis: &Axis| match axis.units.as_str() {
        "degrees_east" | "degree_east" | "degrees_north" | "degree_north" => Some("°".to_owned()),
        other => length_unit(other),
    };
    // The third is drawn in the units of the first, or by its numbers alone.
    let mut units = axes.iter().take(2).map(unit_of);
    let first = units.next()??;
    units.all(|unit| unit.as_ref() == Some(&first)).then_some(first)
}

fn extent(values: &[f64]) -> f64 {
    values.first().zip(values.last()).map_or(0.0, |(first, last)| (last - first).abs())
}

/// World coordinates along x, y, z of up to three axes, the fastest first.
///
/// x and y are where the file puts them, in its units. So is z where it has the units of x. Otherwise
/// its entries are laid evenly, in order of height, an eighth as high as the larger of the others is
/// wide: heights in metres or pressures over degrees would make a needle or a sheet.
///
/// The caller has checked that samples on so many points are in the file.
pub(super) fn lists(axes: &[Axis], warnings: &mut Vec<String>) -> [Arc<[f64]>; 3] {
    let counted = |axis: &Axis, warnings: &mut Vec<String>| -> Vec<f64> {
        warnings.push(format!(
            "nothing tells rising or falling coordinates along {}: its entries are counted",
            axis.name
        ));
        (0..axis.size).map(|i| i as f64).collect()
    };
    let mut lists: [Vec<f64>; 3] = [vec![0.0], vec![0.0], vec![0.0]];
    for (list, axis) in lists.iter_mut().zip(axes).take(2) {
        *list = match &axis.coordinates {
            Some(values) => values.clone(),
            None => counted(axis, warnings),
        };
    }
    if let [x, _, z] = axes {
        lists[2] = match &z.coordinates {
            Some(values) if z.units == x.units => {
                values.iter().map(|v| if z.is_downward { -v } else { *v }).collect()
            }
            Some(values) => {
                let n = values.len();
                let high = extent(&lists[0]).max(extent(&lists[1])) / 8.0;
                let step = if n > 1 && high > 0.0 { high / (n - 1) as f64 } else { 1.0 };
                let rises = n < 2 || values[1] > values[0];
                let is_upward = rises != z.is_downward;
                warnings.push(format!(
                    "{} ({} to {} {}) has other units than {} ({}): its {n} entries are drawn {} \
                     apart, the {} on top",
                    z.name,
                    values[0],
                    values[n - 1],
                    z.units,
                    x.name,
                    x.units,
                    (step * 1e4).round() / 1e4,
                    if z.is_downward { "least" } else { "greatest" }
                ));
                (0..n).map(|k| step * (if is_upward { k } else { n - 1 - k }) as f64).collect()
            }
            None => counted(z, warnings),
        };
    }
    lists.map(Arc::from)
}
