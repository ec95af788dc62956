//! `voxsplat info`.

use super::flags::InfoFlags;
use super::{Destination, Failure, open};
use crate::core::Ticket;
use crate::io::info;

pub(super) fn run(flags: &InfoFlags) -> Result<(), Failure> {
    let input = open::grid(&flags.input, None)?;
    let info = info::describe_grid(&input.grid, &input.format, &input.warnings, &Ticket::new())
        .map_err(Failure::failed)?;
    let info = info::Info { series: input.series, encoding: input.encoding, ..info };
    let text = if flags.json {
        serde_json::to_string_pretty(&info).map_err(Failure::failed)?
    } else {
        info.to_string()
    };
    // A reader that has seen enough (`| head`) is no failure.
    Destination::Stdout("what is in the file").write(format!("{}\n", text.trim_end()).as_bytes())
}
