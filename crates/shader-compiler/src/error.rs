//! A fault of a shader: one message, the line that it is about and a caret under it.

use std::fmt;

/// A place in a shader file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SourceSpan {
    /// The file as it was named to the compiler.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Characters that the caret line underlines, at least 1.
    pub length: usize,
    /// The text of the line.
    pub text: String,
}

impl SourceSpan {
    /// The place of the bytes `start..start + length` of `text`, which is the content of `file`.
    #[must_use]
    pub fn of(file: &str, text: &str, start: usize, length: usize) -> Self {
        let start = floor_char_boundary(text, start);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |length| start + length);
        let end = floor_char_boundary(text, (start + length).min(line_end)).max(start);
        Self {
            file: file.to_owned(),
            line: text[..start].matches('\n').count() + 1,
            column: text[line_start..start].chars().count() + 1,
            length: text[start..end].chars().count().max(1),
            text: text[line_start..line_end].to_owned(),
        }
    }
}

fn floor_char_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// A shader that cannot be built, and why.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct Error {
    /// One line that names the thing at fault.
    pub message: String,
    /// The file, when no place in it is known.
    pub file: String,
    /// The place, when it is known.
    pub location: Option<Box<SourceSpan>>,
    /// Further help: causes, the variant.
    pub notes: Vec<String>,
}

impl Error {
    /// An error about a whole file.
    #[must_use]
    pub fn in_file(file: &str, message: impl Into<String>) -> Self {
        Self { message: message.into(), file: file.to_owned(), location: None, notes: Vec::new() }
    }

    /// An error at a place.
    #[must_use]
    pub fn at(location: SourceSpan, message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            file: location.file.clone(),
            location: Some(Box::new(location)),
            notes: Vec::new(),
        }
    }

    /// Adds a note under the error.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Returns true if both errors have the same message and place; notes, which name the variant, may differ.
    #[must_use]
    pub fn same_fault(&self, other: &Self) -> bool {
        self.message == other.message && self.file == other.file && self.location == other.location
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "error: {}", self.message)?;
        match &self.location {
            Some(at) => {
                let gutter = at.line.to_string().len();
                // Tabs keep their width under the caret only if the caret line has the same tabs.
                let indent: String =
                    at.text.chars().take(at.column - 1).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
                writeln!(f, "{:gutter$}--> {}:{}:{}", "", at.file, at.line, at.column)?;
                writeln!(f, "{:gutter$} |", "")?;
                writeln!(f, "{} | {}", at.line, at.text)?;
                write!(f, "{:gutter$} | {indent}{}", "", "^".repeat(at.length))?;
            }
            None => write!(f, " --> {}", self.file)?,
        }
        for note in &self.notes {
            write!(f, "\n = {note}")?;
        }
        Ok(())
    }
}
