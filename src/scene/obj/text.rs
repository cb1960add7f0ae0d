//! Text files as they come: encodings, continued lines, and names that were written on another system.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use crate::regular_file::read_regular;
use crate::scene::Error;

/// The longest text that is read: some 100 million triangles.
const MOST_BYTES: u64 = 16 << 30;

/// Reads a text file: UTF-8 with or without a byte order mark; any other bytes are taken for Latin-1, in which old exporters write
/// names.
///
/// # Errors
/// `Error::Read` when it cannot be read; `Error::Content` for UTF-16 and for binary files.
pub(super) fn read(path: &Path) -> Result<String, Error> {
    let bytes = read_regular(path, MOST_BYTES);
    let bytes = bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?;
    let wrong = |what: &str| Error::Content { path: path.to_owned(), line: None, what: what.into() };
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(wrong("is UTF-16 text; save it as UTF-8"));
    }
    // The start is enough: formats that are no text show it in their header.
    if bytes.iter().take(4096).any(|&byte| byte == 0) {
        return Err(wrong("is no text file (it holds NUL bytes)"));
    }
    let text = String::from_utf8(bytes)
        .unwrap_or_else(|not_utf8| not_utf8.as_bytes().iter().map(|&byte| char::from(byte)).collect());
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// The statements of a text with the line that each begins on, counted from 1. A backslash at a line's end continues it.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let line = line.trim();
        let Some(begun) = line.strip_suffix('\\') else { return Some((number + 1, Cow::Borrowed(line))) };
        let mut whole = begun.to_owned();
        for (_, next) in lines.by_ref() {
            let next = next.trim();
            whole.push(' ');
            match next.strip_suffix('\\') {
                Some(part) => whole.push_str(part),
                None => {
                    whole.push_str(next);
                    break;
                }
            }
        }
        Some((number + 1, Cow::Owned(whole)))
    })
}

/// A statement's keyword and what follows it.
pub(super) fn split_keyword(statement: &str) -> (&str, &str) {
    match statement.split_once(char::is_whitespace) {
        Some((keyword, rest)) => (keyword, rest.trim_start()),
        None => (statement, ""),
    }
}

/// The file that `name` means, seen from `folder`: as written; with backslashes as separators; with each component's case
/// ignored; and, for an absolute path of somebody else's machine, its last component in `folder`.
pub(super) fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.trim().trim_matches('"');
    if name.is_empty() {
        return None;
    }
    let slashed = name.replace('\\', "/");
    [name, slashed.as_str()]
        .into_iter()
        .map(|name| folder.join(name))
        .find(|path| path.exists())
        .or_else(|| find_ignoring_case(folder, &slashed))
        .or_else(|| {
            let is_absolute = slashed.starts_with('/') || slashed.as_bytes().get(1) == Some(&b':');
            let last = slashed.rsplit('/').next().filter(|_| is_absolute)?;
            find_ignoring_case(folder, last)
        })
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
    path.exists().then_some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backslash_continues_a_statement_and_lines_are_still_counted() {
        let found: Vec<_> = statements("a \\\n b\\\r\n c\nd\n").map(|(n, s)| (n, s.into_owned())).collect();
        let words: Vec<_> = found.iter().map(|(n, s)| (*n, s.split_whitespace().collect::<Vec<_>>())).collect();
        assert_eq!(words, [(1, vec!["a", "b", "c"]), (4, vec!["d"])]);
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
    fn utf_16_and_binary_files_are_refused_and_latin_1_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.obj");
        fs::write(&path, [0xff, 0xfe, b'v', 0]).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("UTF-16"));
        fs::write(&path, b"\x89PNG\0").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("no text"));
        fs::write(&path, b"g caf\xe9").unwrap();
        assert_eq!(read(&path).unwrap(), "g café");
        fs::write(&path, "\u{feff}v").unwrap();
        assert_eq!(read(&path).unwrap(), "v");
        assert!(matches!(read(folder.path()), Err(Error::Read { .. })));
    }
}
