//! Sentences of the rooms below, as the window says them: these speak of flags, which it has none of.

/// What flags are called in the window, where that is not their name in plain words.
const NAMES: [(&str, &str); 18] = [
    ("backend", "Back end"),
    ("classify", "Colouring"),
    ("extent", "Extent"),
    ("functions-error", "Leave out"),
    ("functions-per-cell", "Per cell"),
    ("gouraud-angles", "Mesh angles"),
    ("gouraud-rings", "Mesh rings"),
    ("kernel", "Kernel"),
    ("opacity-model", "Opacity"),
    ("opacity-unit-distance", "Opacity over"),
    ("order", "Order"),
    ("projection", "Rendering"),
    ("quick-functions-error", "Quick pictures"),
    ("reconstruction", "Reconstruction"),
    ("sheets-per-kernel", "Sheets"),
    ("slabs-per-voxel", "Slabs per voxel"),
    ("vector-coarser", "Coarser"),
    ("visibility", "Visibility"),
];

/// A sentence in which every flag has its name in the window: `--backend auto` is `Back end auto`, and
/// `--raw-dims` the `raw dims`. Whatever else stands in it stays, names of files that hold dashes among it.
pub(super) fn without_flags(sentence: &str) -> String {
    let mut told = String::with_capacity(sentence.len());
    let mut rest = sentence;
    while let Some(at) = rest.find("--") {
        let (before, flag) = (&rest[..at], &rest[at + 2..]);
        let end = flag.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(flag.len());
        let begins_word = before.chars().next_back().is_none_or(|c| c.is_whitespace() || c == '(');
        let is_flag = begins_word && flag.starts_with(|c: char| c.is_ascii_lowercase());
        told.push_str(before);
        match &flag[..end] {
            _ if !is_flag => told.push_str("--"),
            name => match NAMES.iter().find(|(known, _)| *known == name) {
                Some((_, called)) => told.push_str(called),
                None => told.push_str(&name.replace('-', " ")),
            },
        }
        rest = if is_flag { &flag[end..] } else { flag };
    }
    told.push_str(rest);
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_have_the_windows_names_and_files_keep_theirs() {
        let told =
            without_flags("found --backend raster; choose --backend auto, a smaller --extent");
        assert_eq!(told, "found Back end raster; choose Back end auto, a smaller Extent");
        let told = without_flags("draw means of them with --vector-coarser, or zoom in");
        assert_eq!(told, "draw means of them with Coarser, or zoom in");
        let told =
            without_flags("give --raw-dims X,Y,Z (--raw-skip), or rename it: /a/b--c/-- d--e.raw");
        assert_eq!(told, "give raw dims X,Y,Z (raw skip), or rename it: /a/b--c/-- d--e.raw");
        assert_eq!(without_flags(""), "");
        assert_eq!(without_flags("é -- --"), "é -- --");
    }
}
