//! URIs in glTF files: bytes in the URI itself, or a file in the folder of the glTF file.

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
pub(super) type Content = (Vec<u8>, Option<PathBuf>);

impl Resources {
    pub fn beside(path: &Path, allow_outside: bool) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self { folder: folder.unwrap_or(Path::new(".")).to_owned(), allow_outside }
    }

    /// The bytes that a URI stands for, `most` of them at most.
    pub fn read(&self, uri: &str, most: u64) -> Result<Content, String> {
        if let Some(data) = strip_scheme(uri, "data:") {
            return decode_data(data).map(|bytes| (bytes, None));
        }
        let path = self.file(uri)?;
        let cannot = |error: std::io::Error| format!("cannot read {}: {error}", path.display());
        let mut bytes = Vec::new();
        // Asked before it is opened: to open a pipe blocks.
        if !fs::metadata(&path).map_err(cannot)?.is_file() {
            return Err(format!("cannot read {}: it is not a regular file", path.display()));
        }
        let file = File::open(&path).map_err(cannot)?;
        file.take(most).read_to_end(&mut bytes).map_err(cannot)?;
        Ok((bytes, Some(path)))
    }

    /// The file that a URI names, if it may be read.
    fn file(&self, uri: &str) -> Result<PathBuf, String> {
        let shown = shortened(uri);
        if has_scheme(uri) {
            return Err(format!("`{shown}` has a scheme: only files beside the glTF file are read"));
        }
        let decoded = percent_decode_str(uri).decode_utf8();
        let decoded = decoded.map_err(|_| format!("`{shown}` is not UTF-8 once its percent signs are decoded"))?;
        if decoded.is_empty() || decoded.contains('\0') {
            return Err(format!("`{shown}` names no file"));
        }
        // Some exporters do not encode a percent sign that is part of a name.
        let names = [decoded.as_ref(), uri];
        let found = names.into_iter().find(|name| self.folder.join(name).exists()).unwrap_or(names[0]);
        let path = self.folder.join(found);
        if self.allow_outside {
            return Ok(path);
        }
        let outside = || format!("`{shown}` leads out of the glTF file's folder: --allow-outside permits that");
        if !stays_inside(found) {
            return Err(outside());
        }
        // Links of the file system may lead out as well. A missing file is an error when it is opened.
        if let (Ok(folder), Ok(real)) = (fs::canonicalize(&self.folder), fs::canonicalize(&path))
            && !real.starts_with(&folder)
        {
            return Err(outside());
        }
        Ok(path)
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
    BASE64.decode(decoded).map_err(|error| format!("its data URI is no base64: {error}"))
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
        ] {
            let (bytes, file) = resources.read(uri, 1 << 20).unwrap_or_else(|error| panic!("{uri}: {error}"));
            assert_eq!((String::from_utf8(bytes).unwrap().as_str(), file.is_some()), (expected, true));
        }
        assert_eq!(resources.read("a b.bin", 3).unwrap().0, b"a b");
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
                assert_eq!(open.read(&uri, 99).unwrap_or_else(|error| panic!("{uri}: {error}")).0, b"secret");
            }
        }
        for uri in ["http://a.b/c.bin", "file:///etc/passwd", "C:\\x.bin", "a:b"] {
            assert!(open.read(uri, 9).unwrap_err().contains("has a scheme"), "{uri}");
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
        ] {
            assert_eq!(resources.read(uri, 1).unwrap(), (b"hello".to_vec(), None), "{uri}");
        }
        assert!(resources.read("data:;base64", 9).unwrap_err().contains("no comma"));
        assert!(resources.read("data:;base64,!!!", 9).unwrap_err().contains("no base64"));
    }
}
