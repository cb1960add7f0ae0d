//! URIs in glTF files: bytes in the URI itself, or a file in the folder of the glTF file.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

/// Files write base64 with and without its padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The folder in which the URIs of a file are resolved.
#[derive(Debug)]
pub(super) struct Resources {
    folder: PathBuf,
    /// True if files outside the folder may be read.
    allow_outside: bool,
}

/// Bytes, and the file that they are from.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Content {
    pub bytes: Vec<u8>,
    pub file: Option<PathBuf>,
    /// How the file was found, where the URI does not name it as it is.
    pub odd: Option<String>,
}

impl Resources {
    pub fn beside(path: &Path, allow_outside: bool) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self { folder: folder.unwrap_or(Path::new(".")).to_owned(), allow_outside }
    }

    /// The bytes that a URI stands for, `most` of them at most.
    pub fn read(&self, uri: &str, most: u64) -> Result<Content, String> {
        if let Some(data) = strip_scheme(uri, "data:") {
            return decode_data(data).map(|bytes| Content { bytes, file: None, odd: None });
        }
        let ResolvedUri { path, odd } = self.file(uri)?;
        let cannot = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
        let mut bytes = Vec::new();
        // Asked before it is opened: to open a pipe blocks.
        if !fs::metadata(&path).map_err(cannot)?.is_file() {
            return Err(format!("cannot read {}: it is not a regular file", path.display()));
        }
        let file = File::open(&path).map_err(cannot)?;
        file.take(most).read_to_end(&mut bytes).map_err(cannot)?;
        Ok(Content { bytes, file: Some(path), odd })
    }

    /// The file that a URI names, if it may be read.
    fn file(&self, uri: &str) -> Result<ResolvedUri, String> {
        let shown = shortened(uri);
        let decoded = percent_decode_str(uri).decode_utf8();
        let decoded = decoded.map_err(|_| format!("`{shown}` is not UTF-8 once its percent signs are decoded"))?;
        if decoded.is_empty() || decoded.contains('\0') {
            return Err(format!("`{shown}` names no file"));
        }
        if let Some(path) = of_another_machine(&decoded) {
            return self.brought_along(path, &shown);
        }
        if has_scheme(uri) {
            return Err(format!("`{shown}` has a scheme: only files beside the glTF file are read"));
        }
        // Some exporters do not encode a percent sign in a name, and some on Windows write backslashes between folders.
        let bare = uri.split(['?', '#']).next().unwrap_or_default();
        let bare = percent_decode_str(bare).decode_utf8_lossy();
        let names = [Cow::Borrowed(decoded.as_ref()), Cow::Borrowed(uri), bare];
        let slashed = names.clone().map(|name| Cow::Owned(name.replace('\\', "/")));
        let mut names = names.into_iter().chain(slashed);
        let found = names.clone().find(|name| !name.is_empty() && self.folder.join(name.as_ref()).exists());
        let (found, odd) = match found {
            Some(found) => (found.into_owned(), None),
            None => match names.clone().find_map(|name| self.ignoring_case(&name)) {
                Some(found) => (found.clone(), Some(format!("`{shown}` is not there, `{found}` is read in its place"))),
                None if stays_inside(&decoded) => (decoded.replace('\\', "/"), None),
                None => (names.next().unwrap_or_default().into_owned(), None),
            },
        };
        let path = self.folder.join(&found);
        if self.allow_outside {
            return Ok(ResolvedUri { path, odd });
        }
        let outside = || format!("`{shown}` leads out of the glTF file's folder: --allow-outside permits that");
        if !stays_inside(&found) {
            return if decoded.starts_with('/') {
                self.brought_along(&decoded, &shown).map_err(|_| outside())
            } else {
                Err(outside())
            };
        }
        self.inside(&path).then_some(ResolvedUri { path, odd }).ok_or_else(outside)
    }

    /// Returns true unless a link of the file system leads out of the folder. A missing file is an error when it is opened.
    fn inside(&self, path: &Path) -> bool {
        let (folder, real) = (fs::canonicalize(&self.folder), fs::canonicalize(path));
        folder.ok().zip(real.ok()).is_none_or(|(folder, real)| real.starts_with(&folder))
    }

    /// The file of an absolute path of another machine, in the folder: below as many of its last folders as are there.
    fn brought_along(&self, path: &str, shown: &str) -> Result<ResolvedUri, String> {
        let path = path.replace('\\', "/");
        let parts: Vec<&str> = path.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
        let tails = (1..=parts.len().min(MOST_PARTS)).rev().map(|count| parts[parts.len() - count..].join("/"));
        let found = { tails }.filter(|tail| stays_inside(tail)).find_map(|tail| self.ignoring_case(&tail));
        let found = found.ok_or_else(|| {
            format!("`{shown}` is a path of another machine, and no file of its name is beside the glTF file")
        })?;
        let path = self.folder.join(&found);
        if !self.inside(&path) {
            return Err(format!("`{shown}` leads out of the glTF file's folder: --allow-outside permits that"));
        }
        Ok(ResolvedUri {
            path,
            odd: Some(format!("`{shown}` is a path of another machine, `{found}` is read in its place")),
        })
    }

    /// A file in the folder whose path differs in the case of letters at most.
    fn ignoring_case(&self, name: &str) -> Option<String> {
        let name = name.replace('\\', "/");
        if !stays_inside(&name) {
            return None;
        }
        let (mut folder, mut found) = (self.folder.clone(), Vec::new());
        for part in name.split('/').filter(|part| !part.is_empty() && *part != ".") {
            let lower = part.to_lowercase();
            let own = if part == ".." || folder.join(part).exists() {
                part.to_owned()
            } else {
                let names = fs::read_dir(&folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
                // The first by name, so that two machines agree.
                names.filter(|name| name.to_lowercase() == lower).min()?
            };
            folder.push(&own);
            found.push(own);
        }
        (!found.is_empty() && folder.is_file()).then(|| found.join("/"))
    }
}

/// A file that was found, and how, where the URI does not name it as it is.
struct ResolvedUri {
    path: PathBuf,
    odd: Option<String>,
}

/// The most parts of an absolute path that are looked for.
const MOST_PARTS: usize = 8;

/// The path of a URI that names a file by a drive of Windows, a share of a network, or `file:`.
fn of_another_machine(uri: &str) -> Option<&str> {
    if let Some(path) = strip_scheme(uri, "file:") {
        return Some(path);
    }
    let drive =
        uri.get(..2).is_some_and(|start| start.ends_with(':') && start.starts_with(|c: char| c.is_ascii_alphabetic()));
    match drive {
        true => Some(&uri[2..]).filter(|rest| rest.starts_with(['/', '\\'])),
        false => uri.starts_with("\\\\").then_some(uri),
    }
}

/// Returns true if a relative path never leaves its folder, also of a system whose paths have backslashes.
fn stays_inside(path: &str) -> bool {
    if path.starts_with(['/', '\\']) {
        return false;
    }
    let mut depth = 0i64;
    path.split(['/', '\\']).all(|part| {
        depth += match part {
            ".." => -1,
            "" | "." => 0,
            _ => 1,
        };
        depth >= 0
    })
}

/// Returns true if it begins as `http:`, `file:` or `C:` do (RFC 3986, section 3.1).
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, _)) = uri.split_once(':') else { return false };
    let is_of_scheme = |byte: u8| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte);
    scheme.bytes().all(is_of_scheme) && scheme.starts_with(|first: char| first.is_ascii_alphabetic())
}

fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let (start, rest) = uri.split_at_checked(scheme.len())?;
    start.eq_ignore_ascii_case(scheme).then_some(rest)
}

/// The bytes of a data URI (RFC 2397).
fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, text) = data.split_once(',').ok_or("its data URI has no comma before the data")?;
    let is_base64 = kind.rsplit(';').next().is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
    if !is_base64 {
        return Ok(percent_decode_str(text).collect());
    }
    // Only a URI that was encoded once more holds percent signs.
    let decoded = if text.contains('%') { percent_decode_str(text).collect() } else { text.as_bytes().to_vec() };
    BASE64.decode(&decoded).or_else(|error| {
        // Lines are broken by some encoders, and others write the alphabet of URLs.
        let usual = |byte: u8| match byte {
            b'-' => b'+',
            b'_' => b'/',
            other => other,
        };
        let plain: Vec<u8> = decoded.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).map(usual).collect();
        BASE64.decode(plain).map_err(|_| format!("its data URI is no base64: {error}"))
    })
}

/// A URI in a message: long ones are cut, and none breaks the line.
fn shortened(uri: &str) -> String {
    let mut shown: String = uri.chars().take(80).collect::<String>().escape_debug().to_string();
    if uri.chars().nth(80).is_some() {
        shown.push_str("...");
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, PathBuf) {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("inner");
        fs::create_dir_all(inner.join("sub")).unwrap();
        fs::write(outer.path().join("secret.bin"), "secret").unwrap();
        for name in ["a b.bin", "sub/c.bin", "ü.bin", "50%20.bin"] {
            fs::write(inner.join(name), name).unwrap();
        }
        (outer, inner)
    }

    #[test]
    fn names_are_decoded_and_read_in_the_folder() {
        let (_outer, inner) = folder();
        let resources = Resources::beside(&inner.join("x.gltf"), false);
        for (uri, expected) in [
            ("a%20b.bin", "a b.bin"),
            ("a b.bin", "a b.bin"),
            ("sub/c.bin", "sub/c.bin"),
            ("./sub/../sub/c.bin", "sub/c.bin"),
            ("%C3%BC.bin", "ü.bin"),
            ("50%20.bin", "50%20.bin"),
            ("sub\\c.bin", "sub/c.bin"),
            (".\\sub\\c.bin", "sub/c.bin"),
            ("sub%5Cc.bin", "sub/c.bin"),
            ("sub%5cc.bin", "sub/c.bin"),
            ("sub//c.bin", "sub/c.bin"),
            ("sub/c.bin?version=3", "sub/c.bin"),
            ("a%20b.bin#part", "a b.bin"),
        ] {
            let Content { bytes, file, odd } =
                resources.read(uri, 1 << 20).unwrap_or_else(|error| panic!("{uri}: {error}"));
            assert_eq!((String::from_utf8(bytes).unwrap().as_str(), file.is_some(), odd), (expected, true, None));
        }
        assert_eq!(resources.read("a b.bin", 3).unwrap().bytes, b"a b");
    }

    #[test]
    fn other_cases_and_paths_of_another_machine_are_found_in_the_folder_and_told() {
        let (outer, inner) = folder();
        let resources = Resources::beside(&inner.join("x.gltf"), false);
        for (uri, expected) in [
            ("SUB/C.BIN", "sub/c.bin"),
            ("Sub\\c.Bin", "sub/c.bin"),
            ("%C3%9C.bin", "ü.bin"),
            ("C:\\Users\\me\\model\\sub\\c.bin", "sub/c.bin"),
            ("d:/model/A%20B.bin", "a b.bin"),
            ("\\\\server\\share\\sub\\c.bin", "sub/c.bin"),
            ("file:///home/me/sub/c.bin", "sub/c.bin"),
            ("/home/me/sub/c.bin", "sub/c.bin"),
        ] {
            let found = resources.read(uri, 1 << 20).unwrap_or_else(|error| panic!("{uri}: {error}"));
            assert_eq!(String::from_utf8(found.bytes).unwrap(), expected, "{uri}");
            assert!(found.odd.is_some_and(|odd| odd.contains(expected)), "{uri}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.path().join("secret.bin"), inner.join("link.bin")).unwrap();
            for uri in ["C:\\link.bin", "LINK.bin", "/x/link.bin"] {
                assert!(resources.read(uri, 9).unwrap_err().contains("--allow-outside"), "{uri}");
            }
        }
        drop(outer);
    }

    #[test]
    fn nothing_outside_the_folder_is_read_unless_it_is_allowed() {
        let (outer, inner) = folder();
        let secret = outer.path().join("secret.bin");
        let mut refused = vec!["../secret.bin".to_owned(), "sub/../../secret.bin".into(), "..\\secret.bin".into()];
        refused.extend(["%2e%2e/secret.bin".into(), secret.to_str().unwrap().into()]);
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, inner.join("link.bin")).unwrap();
            std::os::unix::fs::symlink(outer.path(), inner.join("out")).unwrap();
            refused.extend(["link.bin".into(), "out/secret.bin".into()]);
        }
        let strict = Resources::beside(&inner.join("x.gltf"), false);
        let open = Resources::beside(&inner.join("x.gltf"), true);
        for uri in refused {
            let error = strict.read(&uri, 99).expect_err(&uri);
            assert!(error.contains("--allow-outside"), "{error}");
            if !uri.contains('\\') {
                assert_eq!(open.read(&uri, 99).unwrap_or_else(|error| panic!("{uri}: {error}")).bytes, b"secret");
            }
        }
        for (uri, words) in [
            ("http://a.b/c.bin", "has a scheme"),
            ("a:b", "has a scheme"),
            ("file:///etc/passwd", "path of another machine"),
            ("C:\\x.bin", "path of another machine"),
        ] {
            assert!(open.read(uri, 9).unwrap_err().contains(words), "{uri}");
        }
        for uri in ["", "a%00b", "%ff", "sub", "none.bin"] {
            let error = strict.read(uri, 9).expect_err(uri);
            assert!(!error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn data_is_read_from_the_uri() {
        let resources = Resources::beside(Path::new("x.gltf"), false);
        for uri in [
            "data:application/octet-stream;base64,aGVsbG8=",
            "data:;base64,aGVsbG8",
            "DATA:application/gltf-buffer;base64,aGVsbG8%3D",
            "data:text/plain,hel%6Co",
            "data:;base64,aGVs\n  bG8=",
        ] {
            let expected = Content { bytes: b"hello".to_vec(), file: None, odd: None };
            assert_eq!(resources.read(uri, 1).unwrap(), expected, "{uri}");
        }
        assert!(resources.read("data:;base64", 9).unwrap_err().contains("no comma"));
        assert!(resources.read("data:;base64,!!!", 9).unwrap_err().contains("no base64"));
    }
}
