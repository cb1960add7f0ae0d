//! The two containers of glTF: JSON text, and a binary file of chunks, the first of them JSON. Content tells them apart, not the file's name.

use std::borrow::Cow;
use std::ops::Range;

use super::json::Document;
use super::odd_json;

/// A file's JSON, and the buffer that a binary file holds beside it.
pub(super) struct Container {
    pub document: Document,
    bytes: Vec<u8>,
    binary: Option<Range<usize>>,
    /// Oddities of both, a line each.
    pub warnings: Vec<String>,
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

impl Container {
    /// Takes the bytes of a file.
    ///
    /// # Errors
    /// The line of text with the fault, if it has one, and the fault.
    pub fn parse(bytes: Vec<u8>) -> Result<Self, (Option<usize>, String)> {
        let is_binary = bytes.starts_with(MAGIC);
        let Chunks { json, binary, mut warnings } =
            if is_binary { chunks(&bytes).map_err(|what| (None, what))? } else { Chunks::text(&bytes) };
        let text = utf8(&bytes[json]);
        let (document, odd) = odd_json::document(unpadded(&text)).map_err(|error| {
            let what = error.to_string().replace(['\n', '\r'], " ");
            let what = what.split(" at line ").next().unwrap_or(&what).to_owned();
            let column = error.column();
            match is_binary {
                true => (None, format!("its JSON is wrong at byte {column} of line {}: {what}", error.line())),
                false => (Some(error.line()), format!("is no glTF: {what} (column {column})")),
            }
        })?;
        warnings.extend(odd);
        warnings.extend(check_version(&document).map_err(|what| (None, what))?);
        Ok(Self { document, bytes, binary, warnings })
    }

    /// The content of the binary chunk.
    pub fn binary(&self) -> Option<&[u8]> {
        self.binary.clone().map(|range| &self.bytes[range])
    }
}

/// A text as UTF-8, which it nearly always is: some shells and editors write UTF-16.
fn utf8(text: &[u8]) -> Cow<'_, [u8]> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = text[2..].as_chunks::<2>().0.iter().map(|unit| from(*unit)).collect();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    };
    match text {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => Cow::Borrowed(text),
    }
}

/// A text without a byte order mark, and without the padding behind it: spaces by the specification (glTF 2.0, "Structured JSON Content"), NUL by several
/// writers.
fn unpadded(text: &[u8]) -> &[u8] {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let end = text.iter().rposition(|byte| *byte != 0 && !byte.is_ascii_whitespace()).map_or(0, |last| last + 1);
    &text[..end]
}

/// The ranges of a file's JSON and of its binary chunk.
struct Chunks {
    json: Range<usize>,
    binary: Option<Range<usize>>,
    warnings: Vec<String>,
}

impl Chunks {
    fn text(bytes: &[u8]) -> Self {
        Self { json: 0..bytes.len(), binary: None, warnings: Vec::new() }
    }
}

/// Returns the chunks of a binary file (glTF 2.0, "GLB File Format"). Lengths that are wrong are told: the bytes that are there count.
fn chunks(bytes: &[u8]) -> Result<Chunks, String> {
    let word = |at: usize| {
        let word = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(word.try_into().ok()?))
    };
    let cut = || format!("is cut short: it has {} bytes", bytes.len());
    let (version, length) = (word(4).ok_or_else(cut)?, word(8).ok_or_else(cut)? as usize);
    if version != 2 {
        return Err(format!("is a binary glTF of version {version}, but only version 2 is read"));
    }
    let mut warnings = Vec::new();
    if length != bytes.len() {
        warnings.push(format!("its header says {length} bytes, but it has {}", bytes.len()));
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while let (Some(size), Some(kind)) = (word(at), word(at + 4)) {
        // Bytes behind the file's own end are no chunks, unless the end that it states is before its buffer.
        if at >= length && !(kind == BIN && binary.is_none()) && json.is_some() {
            break;
        }
        let start = at + 8;
        let end = start.saturating_add(size as usize);
        if end > bytes.len() {
            let what = format!("has a chunk of {size} bytes at byte {at}, which reaches past its end");
            if json.is_none() {
                return Err(what);
            }
            if kind != BIN || binary.is_some() {
                warnings.push(what + ": left out");
                break;
            }
            warnings
                .push(format!("is cut short: its buffer should have {size} bytes, but has {}", bytes.len() - start));
        }
        let range = start..end.min(bytes.len());
        match kind {
            JSON if json.is_none() => json = Some(range),
            BIN if binary.is_none() => binary = Some(range),
            // A file may have any number of chunks of other kinds.
            _ => {}
        }
        // Some writers let the next chunk begin at once, where its length is no multiple of 4.
        let is_next = |at: usize| word(at + 4).is_some_and(|kind| kind == BIN || kind == JSON);
        at = if is_next(end) { end } else { end.next_multiple_of(4) };
    }
    Ok(Chunks { json: json.ok_or("has no chunk of JSON")?, binary, warnings })
}

/// Refuses other versions than 2.0. A file that says none is read as that, with a warning.
fn check_version(document: &Document) -> Result<Option<String>, String> {
    let asset = document.asset.as_ref().filter(|asset| asset.min_version.is_some() || !asset.version.is_empty());
    let Some(asset) = asset else {
        return if document.meshes.is_empty() {
            Err("has no asset.version, so that it is no glTF 2.0".into())
        } else {
            Ok(Some("has no asset.version, read as glTF 2.0".into()))
        };
    };
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    let major = version.split('.').next().unwrap_or_default();
    if major != "2" || (asset.min_version.is_some() && version != "2.0") {
        return Err(format!("is glTF of version {version:?}, but only \"2.0\" is read"));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let body: Vec<u8> = chunks
            .iter()
            .flat_map(|(kind, data)| [&(data.len() as u32).to_le_bytes(), &kind.to_le_bytes(), *data].concat())
            .collect();
        [MAGIC, &2u32.to_le_bytes(), &(12 + body.len() as u32).to_le_bytes(), &body].concat()
    }

    fn error(bytes: Vec<u8>) -> String {
        let (line, what) = Container::parse(bytes).err().expect("an error");
        format!("{line:?} {what}")
    }

    const ASSET: &[u8] = br#"{"asset":{"version":"2.0"}} "#;

    #[test]
    fn chunks_are_found_and_others_passed_over() {
        let file = Container::parse(glb(&[(JSON, ASSET), (7, b"what"), (BIN, b"data"), (BIN, b"more")])).unwrap();
        assert_eq!(file.binary(), Some(b"data".as_slice()));
        assert_eq!(Container::parse(glb(&[(JSON, ASSET)])).unwrap().binary(), None);
        assert!(Container::parse([b"\xef\xbb\xbf", ASSET].concat()).is_ok());
    }

    #[test]
    fn what_is_cut_or_of_another_version_is_told() {
        let whole = glb(&[(JSON, ASSET), (BIN, b"data")]);
        // Up to the last byte of its JSON; of the buffer behind it the bytes that are there are read.
        for length in 0..20 + ASSET.len() {
            let error = error(whole[..length].to_vec());
            assert!(!error.contains('\n'), "{length}: {error}");
        }
        let cut = Container::parse(whole[..whole.len() - 1].to_vec()).unwrap();
        assert_eq!(cut.binary(), Some(b"dat".as_slice()));
        assert!(cut.warnings.iter().any(|own| own.contains("should have 4 bytes, but has 3")), "{:?}", cut.warnings);
        let mut other = whole.clone();
        other[4] = 1;
        assert!(error(other).contains("version 1, but"));
        let mut long = whole;
        long[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(error(long).contains("reaches past its end"));
        assert!(error(br#"{"asset":{"version":"1.0"}}"#.to_vec()).contains("of version \"1.0\""));
        assert!(error(br#"{"asset":{"version":"2.0","minVersion":"2.1"}}"#.to_vec()).contains("of version \"2.1\""));
        assert!(error(b"{\n\"asset\": {\n".to_vec()).starts_with("Some("));
        assert!(error(b"{\"scene\":\n \"x\"}".to_vec()).contains("no asset.version"));
    }

    #[test]
    fn padding_lengths_and_order_of_chunks_may_be_odd() {
        let text = ASSET.trim_ascii_end();
        for padding in ["", "\0", "\0\0", "\0\0\0", " \0", "\n", "\n\0 "] {
            let file = Container::parse(glb(&[(JSON, &[text, padding.as_bytes()].concat()), (BIN, b"data")])).unwrap();
            assert_eq!((file.binary(), file.warnings.len()), (Some(b"data".as_slice()), 0), "{padding:?}");
            assert!(Container::parse([text, padding.as_bytes()].concat()).is_ok(), "{padding:?}");
        }
        let first = Container::parse(glb(&[(BIN, b"data"), (JSON, ASSET)])).unwrap();
        assert_eq!(first.binary(), Some(b"data".as_slice()));
        for said in [0, 20, 4000] {
            let mut bytes = glb(&[(JSON, ASSET), (BIN, b"data")]);
            bytes[8..12].copy_from_slice(&u32::to_le_bytes(said));
            let file = Container::parse(bytes).unwrap();
            assert_eq!((file.binary(), file.warnings.len()), (Some(b"data".as_slice()), 1), "{said}");
        }
        let behind =
            Container::parse([&glb(&[(JSON, ASSET), (BIN, b"data")])[..], b"junk of any kind"].concat()).unwrap();
        assert_eq!((behind.binary(), behind.warnings.len()), (Some(b"data".as_slice()), 1));
    }

    #[test]
    fn text_of_16_bits_and_without_a_version_is_read() {
        let wide = |to: fn(u16) -> [u8; 2]| {
            let text = String::from_utf8(ASSET.to_vec()).unwrap();
            std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(to).collect::<Vec<u8>>()
        };
        assert!(Container::parse(wide(u16::to_le_bytes)).is_ok() && Container::parse(wide(u16::to_be_bytes)).is_ok());
        let unnamed = Container::parse(br#"{"meshes":[{}]}"#.to_vec()).unwrap();
        assert!(unnamed.warnings[0].contains("no asset.version"), "{:?}", unnamed.warnings);
    }
}
