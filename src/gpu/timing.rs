//! Pass times: by the device's own clock, or the wall's.

use super::context::Context;

/// Where pass times come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Timer {
    /// Timestamps on the device.
    Device,
    /// A submit of its own for every pass, waited for.
    Wall,
}

impl Timer {
    /// Software adapters have clocks that report compute passes in a fraction of the time they take.
    pub(super) fn of(context: &Context) -> Self {
        let is_believed = context.granted.timestamps && !context.ends_loops;
        if is_believed { Self::Device } else { Self::Wall }
    }
}
