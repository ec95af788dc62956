//! Transfer functions as files: the text of [`Design`], read with care and written whole.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use super::output_file::OutputFile;
use crate::transfer::{Design, DesignError, MOST_TEXT_BYTES};

/// What such files are called.
pub const EXTENSION: &str = "json";

/// Whether a file's name says that it holds a transfer function rather than a volume.
pub fn is_named_so(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Reads a transfer function; no more of the file than one may be long.
///
/// # Errors
/// One sentence with the path last.
pub fn read(path: &Path) -> Result<Design, String> {
    let with_path = |sentence: String| format!("{sentence}: {}", path.display());
    let unreadable = |error: std::io::Error| {
        let found = match error.kind() {
            ErrorKind::NotFound => "no such file".to_owned(),
            ErrorKind::PermissionDenied => "that permission is denied".to_owned(),
            ErrorKind::IsADirectory => "a folder".to_owned(),
            _ => format!("that the system refuses ({error})"),
        };
        with_path(format!("expected a transfer function that can be read, found {found}"))
    };
    let mut file = File::open(path).map_err(unreadable)?;
    let length = file.metadata().map_err(unreadable)?.len();
    let mut bytes = Vec::new();
    // Pipes and devices have no length.
    file.by_ref().take(MOST_TEXT_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() > MOST_TEXT_BYTES {
        let error = DesignError::TooLong { bytes: length.max(bytes.len() as u64) };
        return Err(with_path(error.to_string()));
    }
    let text = String::from_utf8(bytes).map_err(|_| {
        let found = "bytes that are no text".to_owned();
        with_path(DesignError::Unrecognised { found }.to_string())
    })?;
    Design::from_text(&text).map_err(|error| with_path(error.to_string()))
}

/// Writes a transfer function; what was there before stays until the new file is whole.
///
/// # Errors
/// One sentence with the path last.
pub fn write(design: &Design, path: &Path) -> Result<(), String> {
    OutputFile::check(path, "the transfer function")?.write(design.to_text().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::{ColourMap, ColourSource, TransferFunction};

    #[test]
    fn what_is_written_is_read_again_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bone.json");
        let colour = ColourSource::Map { map: ColourMap::Vik, range: [-0.1, 1e300] };
        let opacity = vec![(f64::MIN_POSITIVE, 0.1), (1.0 / 3.0, 1.0)];
        let design = Design::from(TransferFunction::of(opacity, colour));
        write(&design, &path).unwrap();
        assert_eq!(read(&path), Ok(design));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(is_named_so(&path) && is_named_so(Path::new("A.JSON")));
        assert!(!is_named_so(Path::new("json")) && !is_named_so(Path::new("a.nrrd")));
    }

    #[test]
    fn a_huge_file_is_refused_by_its_length_and_binaries_as_no_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        // A hole: nothing of it is on disk.
        File::create(&path).unwrap().set_len(100 << 20).unwrap();
        let refused = read(&path).unwrap_err();
        assert!(refused.contains("at most 1024 KiB, found 104857600 bytes"), "{refused}");
        std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
        let refused = read(&path).unwrap_err();
        assert!(refused.contains("no text") && refused.ends_with("a.json"), "{refused}");
        let refused = read(folder.path()).unwrap_err();
        assert!(refused.contains("that can be read, found a folder: "), "{refused}");
        let refused = read(&folder.path().join("none.json")).unwrap_err();
        assert!(refused.ends_with("none.json"), "{refused}");
        assert!(refused.contains("that can be read, found no such file: "), "{refused}");
    }
}
