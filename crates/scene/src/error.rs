//! Errors of input.

use std::path::PathBuf;

/// An input that cannot become a scene. Displays as one line: the thing at fault, the expectation, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file could not be read at all.
    #[error("cannot read {path}: {cause}", path = .path.display())]
    Read {
        /// As the user or the scene file named it.
        path: PathBuf,
        /// The system's message, or the fault of the name.
        cause: String,
    },
    /// The file's content is wrong.
    #[error("{path}{at}: {what}", path = .path.display(), at = .line.map(|n| format!(":{n}")).unwrap_or_default())]
    Content {
        /// As the user or the scene file named it.
        path: PathBuf,
        /// Line, counted from 1; `None` for binary files and for faults of the whole file.
        line: Option<usize>,
        /// The fault and the expectation; displayed behind the path.
        what: String,
    },
    /// A `builtin:` name or a parameter of it is wrong.
    #[error("{0}")]
    Builtin(String),
    /// A scene that code has put together cannot be drawn: see [`super::Scene::check`].
    #[error("{0}")]
    Scene(String),
    /// A setting has a value out of its range.
    #[error("{0}")]
    Setting(String),
}

/// Spells out control characters: names and paths may hold line breaks, and escapes that a terminal would obey.
pub fn without_controls(text: &str) -> String {
    text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
}
