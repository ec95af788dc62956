//! A scene as text: everything but the samples, which its layers name.

use serde::{Deserialize, Serialize};

use super::Scene;

/// The version of the text that this program writes.
pub const SAVED_VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct Saved<S> {
    version: u32,
    scene: S,
}

/// Any text with a version.
#[derive(Deserialize)]
struct Versioned {
    version: u32,
}

/// What is no saved scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedError {
    /// Not JSON, or not of a scene.
    #[error("expected a saved scene, found text that is none ({0}); save it anew")]
    Text(#[from] serde_json::Error),
    /// Of another version.
    #[error(
        "expected a saved scene of version {SAVED_VERSION}, found version {found}; open it with the version of \
         the program that saved it"
    )]
    Version {
        /// The text's.
        found: u32,
    },
    /// NaN or ±∞, which the text has no words for.
    #[error(
        "expected finite numbers in a scene to be saved, found others; reset what was set last"
    )]
    NotFinite,
}

impl Scene {
    /// The scene without its samples, as JSON.
    ///
    /// # Errors
    /// [`SavedError::NotFinite`].
    pub fn to_json(&self) -> Result<String, SavedError> {
        let text = serde_json::to_string_pretty(&Saved { version: SAVED_VERSION, scene: self })?;
        // What is not finite was written as null, which is no number when it is read.
        match Self::from_json(&text) {
            Ok(_) => Ok(text),
            Err(_) => Err(SavedError::NotFinite),
        }
    }

    /// The scene of such a text. Its store is empty.
    ///
    /// # Errors
    /// [`SavedError::Text`] and [`SavedError::Version`].
    pub fn from_json(text: &str) -> Result<Self, SavedError> {
        match serde_json::from_str(text)? {
            Versioned { version: SAVED_VERSION } => {
                let Saved { version: _, scene } = serde_json::from_str(text)?;
                Ok(scene)
            }
            Versioned { version: found } => Err(SavedError::Version { found }),
        }
    }
}
