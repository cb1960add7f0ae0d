//! Text files as they come: encodings, continued lines, and names that were written on another system.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;
use afterlight_files::regular_file::read_regular;

/// The longest text that is read: some 100 million triangles.
const MOST_BYTES: u64 = 16 << 30;

/// The share of NUL bytes in a file's first 4096 above which it is no text: a 64th.
const BINARY_SHARE: usize = 64;

/// Reads a text file: UTF-8 or UTF-16, with or without a byte order mark; a line of any other bytes is taken for Latin-1, in which old
/// exporters write names. Line ends become `\n`, whether the file has CR LF, CR alone or both.
///
/// # Errors
/// `Error::Read` when it cannot be read; `Error::Content` for binary files.
pub(super) fn read(path: &Path) -> Result<String, Error> {
    let bytes = read_regular(path, MOST_BYTES);
    let bytes = bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?;
    let text = decode(bytes).map_err(|what| Error::Content { path: path.to_owned(), line: None, what: what.into() })?;
    let text = match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    };
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text })
}

fn decode(mut bytes: Vec<u8>) -> Result<String, &'static str> {
    let of_words = |to_word: fn([u8; 2]) -> u16| {
        let words: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|&pair| to_word(pair)).collect();
        Ok(String::from_utf16_lossy(&words))
    };
    match *bytes.as_slice() {
        [0xff, 0xfe, ..] => return of_words(u16::from_le_bytes),
        [0xfe, 0xff, ..] => return of_words(u16::from_be_bytes),
        // Keywords are ASCII, so that UTF-16 without a mark shows in the first two characters.
        [1..=255, 0, 1..=255, 0, ..] => return of_words(u16::from_le_bytes),
        [0, 1..=255, 0, 1..=255, ..] => return of_words(u16::from_be_bytes),
        _ => {}
    }
    // Blocks of archives are filled up with NULs; one within a text separates words.
    let length = bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    bytes.truncate(length);
    let start = &bytes[..length.min(4096)];
    if start.iter().filter(|&&byte| byte == 0).count() * BINARY_SHARE > start.len() {
        return Err("is no text file (it holds NUL bytes)");
    }
    bytes.iter_mut().filter(|byte| **byte == 0).for_each(|byte| *byte = b' ');
    Ok(String::from_utf8(bytes).unwrap_or_else(|not_utf8| {
        let mut text = String::with_capacity(not_utf8.as_bytes().len());
        for line in not_utf8.as_bytes().split_inclusive(|byte| b"\r\n".contains(byte)) {
            match std::str::from_utf8(line) {
                Ok(line) => text.push_str(line),
                Err(_) => text.extend(line.iter().map(|&byte| char::from(byte))),
            }
        }
        text
    }))
}

/// The meaning of a backslash at a line's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Backslash {
    /// It is part of the text: of a comment, or of a name, as `C:\walls\` or the second byte of a Shift-JIS character.
    Text,
    /// It continues the line, unless the next line is a statement; then it is part of a name.
    Names,
    /// It continues the line, unless the next line is a statement; then it is nothing.
    Numbers,
}

/// The rules of a format for lines that a backslash ends.
pub(super) struct Continuation {
    /// The meaning of the backslash behind this statement.
    pub backslash: fn(&str) -> Backslash,
    /// True for a line that begins with a keyword of the format, for a comment and for an empty line.
    pub is_statement: fn(&str) -> bool,
}

/// The statements of a text with the line that each begins on, counted from 1.
pub(super) fn statements<'a>(
    text: &'a str,
    rules: &'static Continuation,
) -> impl Iterator<Item = (usize, Cow<'a, str>)> {
    let mut lines = text.lines().map(trimmed).enumerate().peekable();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let Some(begun) = line.strip_suffix('\\') else { return Some((number + 1, Cow::Borrowed(line))) };
        let backslash = (rules.backslash)(begun);
        let mut goes_on = || lines.next_if(|(_, next)| backslash != Backslash::Text && !(rules.is_statement)(next));
        let Some((_, mut next)) = goes_on() else {
            return Some((number + 1, Cow::Borrowed(if backslash == Backslash::Numbers { begun } else { line })));
        };
        let mut whole = begun.to_owned();
        loop {
            whole.push(' ');
            let Some(part) = next.strip_suffix('\\') else {
                whole.push_str(next);
                break;
            };
            whole.push_str(part);
            let Some((_, following)) = goes_on() else { break };
            next = following;
        }
        Some((number + 1, Cow::Owned(whole)))
    })
}

/// A line without white space, marks of byte order (of files that were joined) and the DOS mark of a file's end around it.
fn trimmed(line: &str) -> &str {
    line.trim_matches(|c: char| c.is_whitespace() || matches!(c, '\u{feff}' | '\u{1a}'))
}

/// Splits a statement into its keyword and the rest.
pub(super) fn split_keyword(statement: &str) -> (&str, &str) {
    match statement.split_once(char::is_whitespace) {
        Some((keyword, rest)) => (keyword, rest.trim_start()),
        None => (statement, ""),
    }
}

/// The file that `name` means, seen from `folder`: as written; with backslashes as separators; with each component's case
/// ignored; and, for a path of somebody else's machine, its last component in `folder`. No folder is a file.
pub(super) fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().trim_matches('"');
    if name.is_empty() {
        return None;
    }
    let slashed = name.replace('\\', "/");
    [name, slashed.as_str()]
        .into_iter()
        .map(|name| folder.join(name))
        .find(|path| is_file(path))
        .or_else(|| find_ignoring_case(folder, &slashed))
        .or_else(|| find_ignoring_case(folder, slashed.rsplit('/').next()?))
}

/// True for anything but a folder; reading a pipe or a device gives an error that says so.
fn is_file(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|about| !about.is_dir())
}

fn find_ignoring_case(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut path = folder.to_owned();
    for component in name.split('/').filter(|component| !component.is_empty() && *component != ".") {
        let exact = path.join(component);
        if component == ".." || exact.exists() {
            path = exact;
            continue;
        }
        let wanted = component.to_lowercase();
        let listed = if path.as_os_str().is_empty() { fs::read_dir(".") } else { fs::read_dir(&path) };
        // The first in order, so that the choice between two candidates does not depend on the file system.
        path = listed
            .ok()?
            .filter_map(|entry| Some(entry.ok()?.file_name()))
            .filter(|entry| entry.to_string_lossy().to_lowercase() == wanted)
            .min()
            .map(|entry| path.join(entry))?;
    }
    is_file(&path).then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `f` has numbers, `g` names, `o` one name.
    const RULES: Continuation = Continuation {
        backslash: |line| match line.as_bytes().first() {
            Some(b'f') => Backslash::Numbers,
            Some(b'g') => Backslash::Names,
            _ => Backslash::Text,
        },
        is_statement: |line| line.is_empty() || line.starts_with(['f', 'g', 'o', '#']),
    };

    #[test]
    fn a_backslash_continues_a_statement_and_lines_are_still_counted() {
        for (text, expected) in [
            ("f \\\n b\\ \n c\nf d\n", vec![(1, "f b c"), (4, "f d")]),
            ("f 1 \\\nf 2\n", vec![(1, "f 1"), (2, "f 2")]),
            ("f 1 \\\n2 \\\nf 3", vec![(1, "f 1 2"), (3, "f 3")]),
            ("f 1 \\\n\n2", vec![(1, "f 1"), (2, ""), (3, "2")]),
            ("f 1 \\", vec![(1, "f 1")]),
            ("g a \\\nb\nf", vec![(1, "g a b"), (3, "f")]),
            ("g C:\\\nf 1", vec![(1, "g C:\\"), (2, "f 1")]),
            ("o a\\\nb", vec![(1, "o a\\"), (2, "b")]),
            ("# D:\\\nb\u{1a}", vec![(1, "# D:\\"), (2, "b")]),
        ] {
            let found: Vec<_> = statements(text, &RULES).collect();
            let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
            let found: Vec<_> = found.iter().map(|(number, text)| (*number, words(text))).collect();
            let expected: Vec<_> = expected.iter().map(|(number, text)| (*number, words(text))).collect();
            assert_eq!(found, expected, "{text:?}");
        }
    }

    #[test]
    fn names_are_found_whatever_their_case_and_slashes() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("Textures")).unwrap();
        let file = folder.path().join("Textures/Wall 1.PNG");
        fs::write(&file, "").unwrap();
        for name in
            ["Textures/Wall 1.PNG", "textures\\wall 1.png", ".\\TEXTURES\\wall 1.png", "\"textures/wall 1.png\""]
        {
            assert_eq!(find_file(folder.path(), name).as_ref(), Some(&file), "{name}");
        }
        let inside = folder.path().join("Textures");
        assert_eq!(find_file(&inside, "C:\\art\\wall 1.png").as_ref(), Some(&file));
        assert_eq!(find_file(folder.path(), "wall 2.png"), None);
        assert_eq!(find_file(folder.path(), " "), None);
    }

    #[test]
    fn every_encoding_and_line_end_is_read_and_binary_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.obj");
        let wide = |text: &str, mark: bool, to_bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            mark.then_some(0xfeff).into_iter().chain(text.encode_utf16()).flat_map(to_bytes).collect()
        };
        let text = "g café\nv 1";
        for bytes in [
            b"g caf\xe9\nv 1".to_vec(),
            "\u{feff}g café\nv 1".into(),
            "g café\rv 1".into(),
            "g café\r\nv 1\0\0\0".into(),
            wide(text, true, u16::to_le_bytes),
            wide(text, true, u16::to_be_bytes),
            wide(text, false, u16::to_le_bytes),
            wide(text, false, u16::to_be_bytes),
        ] {
            fs::write(&path, &bytes).unwrap();
            assert_eq!(read(&path).unwrap(), text, "{bytes:?}");
        }
        // One line of Latin-1 does not change the others.
        fs::write(&path, b"g \xe8\xa1\xa8\ng caf\xe9\n").unwrap();
        assert_eq!(read(&path).unwrap(), "g 表\ng café\n");
        fs::write(&path, b"\x89PNG\0\0\0\rIHDR").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("no text"));
        assert!(matches!(read(folder.path()), Err(Error::Read { .. })));
    }
}
