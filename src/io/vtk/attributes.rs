//! The arrays behind `POINT_DATA` and `CELL_DATA`.

use std::sync::Arc;

use super::super::bytes;
use super::super::error::{Problem, header, quoted};
use super::scanner::{Scanner, Stored, number};
use crate::volume::{Association, Field, Samples, ScalarType};

/// Arrays of one field are no more than anybody lists.
const MOST_ARRAYS: usize = 100_000;

/// What `POINT_DATA` and `CELL_DATA` hold.
#[derive(Default)]
pub(super) struct Attributes {
    pub(super) fields: Vec<Field>,
    /// By rank: scalars before vectors, points before cells.
    active: Vec<(u8, Association, String)>,
    pub(super) warnings: Vec<String>,
}

/// Where arrays belong, and how many tuples they have there.
#[derive(Clone, Copy)]
pub(super) struct Section {
    pub(super) association: Association,
    pub(super) tuples: usize,
}

impl Attributes {
    /// Names of what the file calls active, the first the most.
    pub(super) fn active(&self) -> Vec<(Association, String)> {
        let mut active = self.active.clone();
        active.sort_by_key(|(rank, association, _)| (*rank, *association == Association::Cell));
        active.into_iter().map(|(_, association, name)| (association, name)).collect()
    }

    /// Reads one attribute; whether its keyword is one.
    pub(super) fn read(
        &mut self,
        scanner: &mut Scanner<'_>,
        words: &[String],
        section: Option<Section>,
    ) -> Result<bool, Problem> {
        let keyword = words[0].to_ascii_lowercase();
        let section = match (section, keyword.as_str()) {
            (_, "field") => return self.field(scanner, words, section).map(|()| true),
            (_, "lookup_table") => return skip_table(scanner, words).map(|()| true),
            (Some(section), _) => section,
            (None, _) => return Ok(false),
        };
        let named = |at: usize| word(words, at);
        match keyword.as_str() {
            "scalars" => {
                let (name, stored) = (decoded(named(1)?), Stored::from_name(named(2)?)?);
                let components = match words.get(3) {
                    Some(text) => number::<u64>("SCALARS", text)?,
                    None => 1,
                };
                // Files without a table are against the format, but there are some.
                if scanner.is_next("LOOKUP_TABLE")? {
                    scanner.line()?;
                }
                self.active.push((0, section.association, name.clone()));
                self.array(scanner, section, name, components, stored)?;
            }
            "vectors" => {
                let (name, stored) = (decoded(named(1)?), Stored::from_name(named(2)?)?);
                self.active.push((1, section.association, name.clone()));
                self.array(scanner, section, name, 3, stored)?;
            }
            "normals" | "tensors" | "tensors6" | "global_ids" | "pedigree_ids" | "edge_flags" => {
                let components = match keyword.as_str() {
                    "normals" => 3,
                    "tensors" => 9,
                    "tensors6" => 6,
                    _ => 1,
                };
                let stored = Stored::from_name(named(2)?)?;
                self.array(scanner, section, decoded(named(1)?), components, stored)?;
            }
            "texture_coordinates" => {
                let components = number(&words[0], named(2)?)?;
                let stored = Stored::from_name(named(3)?)?;
                self.array(scanner, section, decoded(named(1)?), components, stored)?;
            }
            "color_scalars" => {
                let components = number(&words[0], named(2)?)?;
                // As text from 0 to 1.
                let binary = scanner.is_binary;
                let scalar_type = if binary { ScalarType::UInt8 } else { ScalarType::Float32 };
                let stored = Stored::Numbers(scalar_type);
                self.array(scanner, section, decoded(named(1)?), components, stored)?;
                if let (false, Some(field)) = (binary, self.fields.last_mut()) {
                    field.samples = Arc::new(bytes_of(&field.samples));
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Every array of a `FIELD`; read over where it belongs to no points and no cells.
    fn field(
        &mut self,
        scanner: &mut Scanner<'_>,
        words: &[String],
        section: Option<Section>,
    ) -> Result<(), Problem> {
        let arrays: usize = number("FIELD", word(words, 2)?)?;
        if arrays > MOST_ARRAYS {
            return Err(header(
                format!("at most {MOST_ARRAYS} arrays in a FIELD"),
                arrays.to_string(),
                "correct the number, or copy the file again",
            ));
        }
        let mut read = 0;
        while read < arrays {
            let Some(line) = scanner.line()? else {
                return Err(super::super::error::truncated(
                    format!("{arrays} arrays in a FIELD"),
                    format!("that the file ends after {read}"),
                    "the file was cut short: copy it again",
                ));
            };
            if line[0].eq_ignore_ascii_case("METADATA") {
                super::skip_metadata(scanner)?;
                continue;
            }
            read += 1;
            if line[0] == "NULL_ARRAY" {
                continue;
            }
            let line = scanner.words(line, 4)?;
            let name = decoded(&line[0]);
            let components: u64 = number(&line[0], &line[1])?;
            let tuples: u64 = number(&line[0], &line[2])?;
            let stored = Stored::from_name(&line[3])?;
            match section {
                Some(section) if tuples == section.tuples as u64 && components > 0 => {
                    self.array(scanner, section, name, components, stored)?;
                }
                _ => {
                    if let Some(section) = section {
                        self.warn(format!(
                            "the array {} is ignored: it has {tuples} tuples of {components} numbers \
                             for {} {}s",
                            quoted(&name),
                            section.tuples,
                            section.association.name()
                        ));
                    }
                    // A time or a title is no loss, a list may be one.
                    let is_list = tuples > 1 && matches!(stored, Stored::Numbers(_));
                    if section.is_none() && is_list {
                        self.warn("field data (no samples) are ignored".to_owned());
                    }
                    scanner.skip(stored, count(&name, tuples, components)?)?;
                }
            }
        }
        Ok(())
    }

    fn array(
        &mut self,
        scanner: &mut Scanner<'_>,
        section: Section,
        name: String,
        components: u64,
        stored: Stored,
    ) -> Result<(), Problem> {
        let what = format!("the array {}", quoted(&name));
        let sizes = [components, section.tuples as u64];
        // The scanner checks the bytes against the file and against memory.
        let total = bytes::checked_count(&what, &sizes, ScalarType::UInt8, u64::MAX)?;
        if stored == Stored::Strings {
            self.warn(format!("the array {} is ignored: it holds no numbers", quoted(&name)));
            return scanner.skip(stored, total);
        }
        let samples = scanner.samples(stored, total)?;
        self.fields.push(Field {
            name: if name.is_empty() { format!("array {}", self.fields.len()) } else { name },
            components: total / section.tuples,
            association: section.association,
            samples: Arc::new(samples),
        });
        Ok(())
    }

    fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}

/// Colours from 0 to 1 as the bytes that binary files have.
fn bytes_of(colours: &Samples) -> Samples {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts to bytes stop at their ends, and NaN is 0"
    )]
    let byte = |at: usize| (colours.get(at) * 255.0).round() as u8;
    Samples::UInt8((0..colours.len()).map(byte).collect())
}

/// Tuples times components, which may be none.
fn count(name: &str, tuples: u64, components: u64) -> Result<usize, Problem> {
    let product = tuples.checked_mul(components).and_then(|n| usize::try_from(n).ok());
    product.ok_or_else(|| {
        header(
            format!("an array {} whose size fits in 64 bits", quoted(name)),
            format!("{tuples} tuples of {components}"),
            "correct the sizes, or copy the file again",
        )
    })
}

/// A table of colours: four numbers each, bytes in binary files.
fn skip_table(scanner: &mut Scanner<'_>, words: &[String]) -> Result<(), Problem> {
    let size: u64 = number("LOOKUP_TABLE", word(words, 2)?)?;
    let scalar_type = if scanner.is_binary { ScalarType::UInt8 } else { ScalarType::Float32 };
    scanner.skip(Stored::Numbers(scalar_type), count("LOOKUP_TABLE", size, 4)?)
}

fn word(words: &[String], at: usize) -> Result<&str, Problem> {
    words.get(at).map(String::as_str).ok_or_else(|| {
        header(
            format!("{at} words after {}", quoted(&words[0])),
            quoted(&words.join(" ")),
            "add what is missing, or copy the file again",
        )
    })
}

/// A name as people know it: `%20` stands for a blank, and other bytes likewise.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = after.get(..2).filter(|_| first == b'%');
        let code = code.and_then(|digits| std::str::from_utf8(digits).ok());
        match code.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded_as_vtk_encodes_them() {
        assert_eq!(decoded("Nodal%20Stress"), "Nodal Stress");
        assert_eq!(decoded("100%"), "100%");
        assert_eq!(decoded("a%zzb%C3%A9"), "a%zzbé");
    }
}
