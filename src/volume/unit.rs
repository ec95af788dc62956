//! Units of length as files write them.

/// Longest name of a unit that is taken as it is written, characters.
const LONGEST: usize = 12;

/// A unit of length by its symbol, where a file's word for it is known, or else the word itself; `None` for what is no
/// word.
pub fn length_unit(word: &str) -> Option<String> {
    let word = word.trim().trim_matches('"').trim();
    let symbol = match word.to_lowercase().trim_end_matches('s') {
        "nm" | "nanometer" | "nanometre" => "nm",
        "um" | "µm" | "μm" | "micron" | "micrometer" | "micrometre" => "µm",
        "mm" | "millimeter" | "millimetre" => "mm",
        "cm" | "centimeter" | "centimetre" => "cm",
        "m" | "meter" | "metre" => "m",
        "km" | "kilometer" | "kilometre" => "km",
        "" | "none" | "???" | "unknown" | "pixel" | "voxel" => return None,
        _ => word,
    };
    let is_word = symbol.chars().count() <= LONGEST && !symbol.chars().any(char::is_control);
    is_word.then(|| symbol.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_length_are_known_by_the_words_that_files_have_for_them() {
        for (word, symbol) in [
            ("\"mm\"", Some("mm")),
            ("Millimeters", Some("mm")),
            ("um", Some("µm")),
            ("microns", Some("µm")),
            ("m", Some("m")),
            ("Å", Some("Å")),
            ("\"\"", None),
            ("???", None),
            ("a very long word for it", None),
        ] {
            assert_eq!(length_unit(word).as_deref(), symbol, "{word}");
        }
    }
}
