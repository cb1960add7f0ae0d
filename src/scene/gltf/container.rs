//! The two containers of glTF: JSON text, and a binary file of chunks, the first of them JSON. Content tells them apart, not the file's name.

use std::ops::Range;

use super::json::Document;

/// A file's JSON, and the buffer that a binary file holds beside it.
pub(super) struct Container {
    pub document: Document,
    bytes: Vec<u8>,
    binary: Option<Range<usize>>,
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
        let (json, binary) =
            if is_binary { chunks(&bytes).map_err(|what| (None, what))? } else { (0..bytes.len(), None) };
        let text = &bytes[json];
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let document: Document = serde_json::from_slice(text).map_err(|error| {
            let what = error.to_string().replace(['\n', '\r'], " ");
            let what = what.split(" at line ").next().unwrap_or(&what).to_owned();
            let column = error.column();
            match is_binary {
                true => (None, format!("its JSON is wrong at byte {column} of line {}: {what}", error.line())),
                false => (Some(error.line()), format!("is no glTF: {what} (column {column})")),
            }
        })?;
        check_version(&document).map_err(|what| (None, what))?;
        Ok(Self { document, bytes, binary })
    }

    /// The content of the binary chunk.
    pub fn binary(&self) -> Option<&[u8]> {
        self.binary.clone().map(|range| &self.bytes[range])
    }
}

/// Returns the ranges of the JSON and of the binary chunk of a binary file (glTF 2.0, "GLB File Format").
fn chunks(bytes: &[u8]) -> Result<(Range<usize>, Option<Range<usize>>), String> {
    let word = |at: usize| {
        let word = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(word.try_into().ok()?))
    };
    let cut = || format!("is cut short: it has {} bytes", bytes.len());
    let (version, length) = (word(4).ok_or_else(cut)?, word(8).ok_or_else(cut)? as usize);
    if version != 2 {
        return Err(format!("is a binary glTF of version {version}, but only version 2 is read"));
    }
    if length > bytes.len() {
        return Err(format!("is cut short: its header says {length} bytes, but it has {}", bytes.len()));
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while at + 8 <= length {
        let (size, kind) = (word(at).ok_or_else(cut)? as usize, word(at + 4).ok_or_else(cut)?);
        let start = at + 8;
        let end = start.checked_add(size).filter(|&end| end <= length);
        let end = end.ok_or_else(|| format!("has a chunk of {size} bytes at byte {at}, which reaches past its end"))?;
        match kind {
            JSON if json.is_none() => json = Some(start..end),
            _ if json.is_none() => return Err("does not begin with a chunk of JSON".into()),
            BIN if binary.is_none() => binary = Some(start..end),
            // Of other kinds there may be any number.
            _ => {}
        }
        at = end.next_multiple_of(4);
    }
    Ok((json.ok_or("has no chunk of JSON")?, binary))
}

fn check_version(document: &Document) -> Result<(), String> {
    let Some(asset) = &document.asset else {
        return Err("has no asset.version, so that it is no glTF 2.0".into());
    };
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    let major = version.split('.').next().unwrap_or_default();
    if major != "2" || (asset.min_version.is_some() && version != "2.0") {
        return Err(format!("is glTF of version {version:?}, but only \"2.0\" is read"));
    }
    Ok(())
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
        for length in 0..whole.len() {
            let error = error(whole[..length].to_vec());
            assert!(!error.contains('\n'), "{length}: {error}");
        }
        let mut other = whole.clone();
        other[4] = 1;
        assert!(error(other).contains("version 1, but"));
        assert!(error(glb(&[(BIN, b"data"), (JSON, ASSET)])).contains("does not begin with"));
        let mut long = whole;
        long[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(error(long).contains("reaches past its end"));
        assert!(error(br#"{"asset":{"version":"1.0"}}"#.to_vec()).contains("of version \"1.0\""));
        assert!(error(br#"{"asset":{"version":"2.0","minVersion":"2.1"}}"#.to_vec()).contains("of version \"2.1\""));
        assert!(error(b"{\n\"asset\": {\n".to_vec()).starts_with("Some("));
        assert!(error(b"{\"scene\":\n \"x\"}".to_vec()).contains("whole number"));
    }
}
