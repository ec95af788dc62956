//! The lines of an NRRD header.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::super::error::{Problem, header, quoted, quoted_bytes, truncated};

/// A header beyond this is none.
const MOST_BYTES: u64 = 16 << 20;

/// Fields that the reader understands or knows to describe nothing it needs.
const KNOWN: [&str; 37] = [
    "axismaxs",
    "axismins",
    "blocksize",
    "byteskip",
    "centerings",
    "centers",
    "content",
    "datafile",
    "dimension",
    "encoding",
    "endian",
    "kinds",
    "labels",
    "lineskip",
    "max",
    "measurementframe",
    "min",
    "number",
    "oldmax",
    "oldmin",
    "sampleunits",
    "sizes",
    "space",
    "spacedimension",
    "spacedirections",
    "spaceorigin",
    "spaceunits",
    "spacings",
    "thicknesses",
    "type",
    "units",
    // Not in the definition, but written by well-known programs and of no consequence here.
    "axislabels",
    "comment",
    "date",
    "modality",
    "name",
    "range",
];

/// A parsed header: what it says, and where the data begin.
#[derive(Debug, Default)]
pub(super) struct Header {
    fields: BTreeMap<String, String>,
    /// Key/value pairs: metadata that no lattice depends on.
    pairs: BTreeMap<String, String>,
    /// File names that follow `data file: LIST`.
    pub(super) listed_files: Vec<String>,
    /// Bytes up to and including the blank line.
    pub(super) len: u64,
    pub(super) warnings: Vec<String>,
}

impl Header {
    /// # Errors
    /// A line that is none, a field twice, or no end.
    pub(super) fn read(reader: &mut dyn BufRead) -> Result<Self, Problem> {
        let mut parsed = Self::default();
        let magic = parsed.line(reader)?.unwrap_or_default();
        let version = magic.strip_prefix("NRRD").and_then(|v| v.trim().parse::<u32>().ok());
        match version {
            Some(1..=5) => {}
            Some(other) => {
                parsed.warnings.push(format!("NRRD version {other} is read as version 5"));
            }
            None => {
                return Err(header(
                    "\"NRRD\" and a version of four digits on the first line",
                    quoted(&magic),
                    "check that the file is an NRRD file",
                ));
            }
        }
        while let Some(line) = parsed.line(reader)? {
            if line.is_empty() {
                break;
            }
            if line.starts_with('#') {
                continue;
            }
            let Some((key, value)) = line.split_once(':') else {
                return Err(header(
                    "header lines of the form \"field: value\"",
                    quoted(&line),
                    "correct the line",
                ));
            };
            if let Some(value) = value.strip_prefix('=') {
                parsed.pairs.insert(key.trim().to_owned(), value.trim().to_owned());
                continue;
            }
            let key: String = key.to_lowercase().chars().filter(|c| !c.is_whitespace()).collect();
            let value = value.trim().to_owned();
            if !KNOWN.contains(&key.as_str()) {
                parsed.warnings.push(format!("the unknown field {} is ignored", quoted(&line)));
                continue;
            }
            let is_list = key == "datafile"
                && value.split_whitespace().next().is_some_and(|w| w.eq_ignore_ascii_case("list"));
            if parsed.fields.insert(key, value).is_some() {
                return Err(header("each field once", quoted(&line), "remove one of the two"));
            }
            if is_list {
                while let Some(name) = parsed.line(reader)? {
                    if !name.trim().is_empty() {
                        parsed.listed_files.push(name.trim().to_owned());
                    }
                }
                break;
            }
        }
        Ok(parsed)
    }

    /// The next line without its end; `None` at the end of the file.
    fn line(&mut self, reader: &mut dyn BufRead) -> Result<Option<String>, Problem> {
        let mut bytes = Vec::new();
        let left = MOST_BYTES.saturating_sub(self.len);
        let mut limited = std::io::Read::take(&mut *reader, left);
        limited.read_until(b'\n', &mut bytes).map_err(Problem::Io)?;
        self.len += bytes.len() as u64;
        if self.len >= MOST_BYTES {
            return Err(header(
                "a header of at most 16 MB that ends with a blank line",
                quoted_bytes(&bytes),
                "check that the file is an NRRD file",
            ));
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        while let [rest @ .., b'\n' | b'\r'] = &bytes[..] {
            bytes.truncate(rest.len());
        }
        Ok(Some(String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// The value of a field by its name without spaces, lower case.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.fields.get(name).map(String::as_str)
    }

    /// The value of a key of metadata.
    pub(super) fn pair(&self, key: &str) -> Option<&str> {
        self.pairs.get(key).map(String::as_str)
    }

    /// # Errors
    /// The field is missing.
    pub(super) fn require(&self, name: &str) -> Result<&str, Problem> {
        self.get(name).ok_or_else(|| {
            truncated(
                format!("the field \"{name}\" in the header"),
                "none",
                "the header was cut short or never complete: add the field",
            )
        })
    }

    /// A field of whole numbers.
    ///
    /// # Errors
    /// A word that is none.
    pub(super) fn integers(&self, name: &str) -> Result<Option<Vec<i64>>, Problem> {
        let parse = |word: &str| word.parse().map_err(|_not| bad_number(name, word, "whole "));
        self.get(name).map(|v| v.split_whitespace().map(parse).collect()).transpose()
    }

    /// One number for each axis; NaN where the file has none.
    ///
    /// # Errors
    /// A word that is no number, or another count than `axes`.
    pub(super) fn per_axis(&self, name: &str, axes: usize) -> Result<Option<Vec<f64>>, Problem> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let numbers: Vec<f64> = value
            .split_whitespace()
            .map(|word| word.parse().map_err(|_not| bad_number(name, word, "")))
            .collect::<Result<_, _>>()?;
        if numbers.len() != axes {
            return Err(wrong_count(name, axes, value));
        }
        Ok(Some(numbers))
    }

    /// Vectors in parentheses, or `none`.
    ///
    /// # Errors
    /// Anything else.
    pub(super) fn vectors(&self, name: &str) -> Result<Option<Vec<Option<Vec<f64>>>>, Problem> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let malformed = || {
            header(
                format!("vectors like (1,0,0), or none, in \"{name}\""),
                quoted(value),
                "correct the field",
            )
        };
        let mut vectors = Vec::new();
        let mut rest = value.trim();
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix('(') {
                let (inside, after) = after.split_once(')').ok_or_else(malformed)?;
                let numbers = inside
                    .split(',')
                    .map(|word| word.trim().parse().map_err(|_not| malformed()))
                    .collect::<Result<Vec<f64>, _>>()?;
                vectors.push(Some(numbers));
                rest = after.trim_start();
            } else {
                let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                if !word.eq_ignore_ascii_case("none") {
                    return Err(malformed());
                }
                vectors.push(None);
                rest = after.trim_start();
            }
        }
        Ok(Some(vectors))
    }
}

pub(super) fn wrong_count(name: &str, axes: usize, found: &str) -> Problem {
    header(
        format!("one entry for each of {axes} axes in \"{name}\""),
        quoted(found),
        "correct the field or the dimension",
    )
}

fn bad_number(name: &str, word: &str, kind: &str) -> Problem {
    header(format!("{kind}numbers in \"{name}\""), quoted(word), "correct the field")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Header, Problem> {
        Header::read(&mut text.as_bytes())
    }

    #[test]
    fn fields_comments_pairs_and_either_line_end_are_read() {
        let h =
            parse("NRRD0005\r\n# c\r\ntype:short\r\nSpace Origin: (1, 2,3)\r\nk:=v: w\r\n\r\nxx")
                .unwrap();
        assert_eq!(h.get("type"), Some("short"));
        assert_eq!(h.vectors("spaceorigin").unwrap(), Some(vec![Some(vec![1.0, 2.0, 3.0])]));
        assert_eq!(h.len, 62, "all but the two bytes of data");
        assert!(h.warnings.is_empty());
    }

    #[test]
    fn lists_run_to_the_end_of_the_file() {
        let h = parse("NRRD0004\ndata file: LIST 2\na.raw\nb c.raw\n").unwrap();
        assert_eq!(h.listed_files, ["a.raw", "b c.raw"]);
    }

    #[test]
    fn lines_that_are_no_fields_and_fields_given_twice_are_refused() {
        for bad in ["NRRD0004\nnonsense\n", "NRRD0004\ntype: a\ntype: b\n", "NRRDx\n"] {
            assert!(matches!(parse(bad), Err(Problem::Header(_))), "{bad}");
        }
        assert_eq!(parse("NRRD0004\nfoo: 1\n").unwrap().warnings.len(), 1);
    }
}
