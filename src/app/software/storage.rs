//! What is remembered between runs, in the file that `eframe` reads and writes where an adapter paints the window.

use std::collections::HashMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Texts by name, in a file of the desktop's folder for programs' data.
#[derive(Debug)]
pub(super) struct FileStorage {
    path: PathBuf,
    texts: HashMap<String, String>,
    has_changed: bool,
}

impl FileStorage {
    /// What an earlier window has left; `None` where the desktop has no place for it.
    pub(super) fn open(app_id: &str) -> Option<Self> {
        Some(Self::at(eframe::storage_dir(app_id)?.join("app.ron")))
    }

    fn at(path: PathBuf) -> Self {
        let texts = Self::read(&path).unwrap_or_else(|error| {
            log::warn!(
                "expected the settings of an earlier window, found that they cannot be read ({error}); they are set \
                 anew: {}",
                path.display()
            );
            HashMap::new()
        });
        Self { path, texts, has_changed: false }
    }

    /// Nothing where there is no file.
    fn read(path: &Path) -> anyhow::Result<HashMap<String, String>> {
        match fs::read_to_string(path) {
            Ok(text) => Ok(ron::from_str(&text)?),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(HashMap::new()),
            Err(error) => Err(error.into()),
        }
    }

    fn write(&self) -> anyhow::Result<()> {
        let text = ron::ser::to_string_pretty(&self.texts, ron::ser::PrettyConfig::default())?;
        if let Some(folder) = self.path.parent() {
            fs::create_dir_all(folder)?;
        }
        // Whole or not at all.
        let beside = self.path.with_extension("ron.new");
        fs::write(&beside, text)?;
        fs::rename(&beside, &self.path)?;
        Ok(())
    }
}

impl eframe::Storage for FileStorage {
    fn get_string(&self, key: &str) -> Option<String> {
        self.texts.get(key).cloned()
    }

    fn set_string(&mut self, key: &str, value: String) {
        if self.texts.get(key) != Some(&value) {
            self.texts.insert(key.to_owned(), value);
            self.has_changed = true;
        }
    }

    fn remove_string(&mut self, key: &str) {
        self.has_changed |= self.texts.remove(key).is_some();
    }

    fn flush(&mut self) {
        if !std::mem::take(&mut self.has_changed) {
            return;
        }
        if let Err(error) = self.write() {
            log::warn!(
                "expected a place for settings, found that it cannot be written to ({error}); they are forgotten when \
                 the window closes: {}",
                self.path.display()
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use eframe::Storage;

    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_a_broken_file_is_passed_over() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("deeper").join("app.ron");
        let mut storage = FileStorage::at(path.clone());
        storage.set_string("settings", "a \"text\"\nof two lines".to_owned());
        storage.flush();
        let again = FileStorage::at(path.clone());
        assert_eq!(again.get_string("settings").as_deref(), Some("a \"text\"\nof two lines"));
        fs::write(&path, "(((").expect("writable");
        assert_eq!(FileStorage::at(path).get_string("settings"), None);
    }
}
