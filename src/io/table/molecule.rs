//! Molecules as chemists write them (`.xyz`): how many atoms there are, a line about them, and an atom a line, its element
//! before its place.

use std::collections::BTreeSet;
use std::io::BufRead;

use glam::DVec3;

use super::super::error::{Problem, header, quoted, truncated};
use super::super::unstructured::{self, Part, field_of};
use super::super::{Format, Opened};
use super::{Lines, cloud, ends_within};
use crate::core::counted;
use crate::core::progress::Ticket;
use crate::volume::{Association, Grid, LabelName, Samples};

/// Symbols of the elements, by their numbers from 1.
const ELEMENTS: [&str; 118] = [
    "H", "He", "Li", "Be", "B", "C", "N", "O", "F", "Ne", "Na", "Mg", "Al", "Si", "P", "S", "Cl",
    "Ar", "K", "Ca", "Sc", "Ti", "V", "Cr", "Mn", "Fe", "Co", "Ni", "Cu", "Zn", "Ga", "Ge", "As",
    "Se", "Br", "Kr", "Rb", "Sr", "Y", "Zr", "Nb", "Mo", "Tc", "Ru", "Rh", "Pd", "Ag", "Cd", "In",
    "Sn", "Sb", "Te", "I", "Xe", "Cs", "Ba", "La", "Ce", "Pr", "Nd", "Pm", "Sm", "Eu", "Gd", "Tb",
    "Dy", "Ho", "Er", "Tm", "Yb", "Lu", "Hf", "Ta", "W", "Re", "Os", "Ir", "Pt", "Au", "Hg", "Tl",
    "Pb", "Bi", "Po", "At", "Rn", "Fr", "Ra", "Ac", "Th", "Pa", "U", "Np", "Pu", "Am", "Cm", "Bk",
    "Cf", "Es", "Fm", "Md", "No", "Lr", "Rf", "Db", "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh",
    "Fl", "Mc", "Lv", "Ts", "Og",
];

/// The number of an element.
fn element(symbol: &str) -> Option<u8> {
    let at = ELEMENTS.iter().position(|known| known.eq_ignore_ascii_case(symbol))?;
    u8::try_from(at + 1).ok()
}

/// The element and the place on a line.
fn atom(line: &str) -> Option<(u8, DVec3)> {
    let mut words = line.split_whitespace();
    let element = element(words.next()?)?;
    let mut number = || words.next()?.parse::<f64>().ok();
    Some((element, DVec3::new(number()?, number()?, number()?)))
}

/// How many atoms a line announces.
fn count_of(line: &str) -> Option<u64> {
    line.trim_start_matches('\u{feff}').trim().parse::<u64>().ok().filter(|count| *count > 0)
}

/// Whether some first bytes are a molecule's.
pub(super) fn is_it(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = text.lines();
    let has_count = lines.next().and_then(count_of).is_some();
    has_count && lines.nth(1).and_then(atom).is_some()
}

/// The first molecule of a file.
pub(super) fn read<R: BufRead>(
    lines: &mut Lines<R>,
    (len, free_bytes): (u64, u64),
    ticket: &Ticket,
) -> Result<Opened, Problem> {
    let first = lines.any()?.unwrap_or_default();
    let count = count_of(&first).ok_or_else(|| {
        header("how many atoms there are on the first line", quoted(&first), "correct the line")
    })?;
    lines.any()?;
    let (mut points, mut elements) = (Vec::new(), Vec::new());
    let (mut done, mut more_columns) = (0, 0_usize);
    for _ in 0..count {
        let line = lines.any()?.ok_or_else(|| {
            truncated(
                format!("{count} atoms, as the first line says"),
                points.len().to_string(),
                "the file was cut short, or the number is wrong: copy or write it again",
            )
        })?;
        let (element, place) = atom(&line).ok_or_else(|| {
            let words = line.split_whitespace().count();
            if words < 4 && !lines.is_whole() {
                let expected = "an element and three numbers".to_owned();
                return ends_within(lines.line, expected, words);
            }
            header(
                format!("an element and three numbers on line {}", lines.line),
                quoted(&line),
                "correct the line, or write the file again",
            )
        })?;
        more_columns = more_columns.max(line.split_whitespace().count() - 4);
        points.push(place);
        elements.push(element);
        done += line.len() as u64;
        if lines.line.is_multiple_of(1024) {
            ticket.checkpoint(done, len)?;
        }
    }
    let mut warnings = Vec::new();
    if more_columns > 0 {
        let verb = if more_columns == 1 { "is" } else { "are" };
        let columns = counted(more_columns, "column");
        warnings.push(format!("{columns} behind the atoms' places {verb} left out"));
    }
    warnings.extend(behind(lines, points.len(), len, ticket)?);
    let atoms = points.len() as u64;
    unstructured::require_memory(atoms, atoms, atoms, free_bytes)?;
    let there: BTreeSet<u8> = elements.iter().copied().collect();
    let name = |number: u8| LabelName {
        component: 0,
        value: i64::from(number),
        name: ELEMENTS[usize::from(number) - 1].to_owned(),
        colour: None,
    };
    let label_names = there.into_iter().map(name).collect();
    let fields = vec![field_of("element", (1, Association::Point), Samples::UInt8(elements))];
    let part = Part { listing: cloud(points), fields };
    let grid = unstructured::grid(part, &[], free_bytes, &mut warnings)?;
    // As everybody writes them.
    let grid = Grid { unit: Some("Å".to_owned()), label_names, ..grid };
    Ok(Opened::of(grid, Format::Table, warnings))
}

/// What is said of the lines behind the first molecule: others, such as its steps in time, or anything else.
fn behind<R: BufRead>(
    lines: &mut Lines<R>,
    atoms: usize,
    len: u64,
    ticket: &Ticket,
) -> Result<Option<String>, Problem> {
    let (mut molecules, mut others, mut left) = (0, 0, 0_u64);
    while let Some(line) = lines.any()? {
        if lines.line.is_multiple_of(1024) {
            ticket.checkpoint(len, len)?;
        }
        match count_of(&line) {
            _ if left > 0 => left -= 1,
            // The line about them, too.
            Some(count) => {
                molecules += 1;
                left = count.saturating_add(1);
            }
            None => others += usize::from(!line.trim().is_empty()),
        }
    }
    let verb = |count: usize| if count == 1 { "follows" } else { "follow" };
    Ok(match (molecules, others) {
        (0, 0) => None,
        (0, _) => Some(format!(
            "{} {} the {}: left out",
            counted(others, "line"),
            verb(others),
            counted(atoms, "atom")
        )),
        _ => Some(format!(
            "{} {} the first: left out",
            counted(molecules, "more molecule"),
            verb(molecules)
        )),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_have_their_numbers() {
        for (symbol, number) in [("H", 1), ("C", 6), ("fe", 26), ("AU", 79), ("Og", 118)] {
            assert_eq!(element(symbol), Some(number));
        }
        assert_eq!((element("Xx"), element(""), element("6")), (None, None, None));
    }

    #[test]
    fn molecules_are_known_by_three_lines() {
        assert!(is_it(b"3\nwater\nO 0 0 0\nH 1"));
        assert!(is_it(b" 3 \r\n\r\n O 0.0 -1e-3 0 0.5\r\n"));
        assert!(!is_it(b"3\nO 0 0 0\nwater\n"));
        assert!(!is_it(b"3\nwater\n1 0 0 0\n"), "a table may begin with how many rows it has");
        assert!(!is_it(b"0\nnothing\nO 0 0 0\n"));
        assert!(!is_it(b"1 2 3\n4 5 6\n7 8 9\n"));
    }
}
