//! Buffers and the views into them. Each is read when something first needs it, and no byte is handed out that is not there.

use std::path::PathBuf;
use std::sync::OnceLock;

use super::json::{Buffer, BufferView, Document, entry, named};
use super::json_extensions::Meshopt;
use super::meshopt;
use super::uri::{Content, Resources};

/// The most bytes of a buffer that does not say how many it has.
const MOST_BYTES: u64 = 1 << 32;

/// The bytes of a file's views.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    resources: &'a Resources,
    /// The chunk of a binary file.
    binary: Option<&'a [u8]>,
    read: Vec<OnceLock<Result<Content, String>>>,
    /// Views that were decompressed.
    unpacked: Vec<OnceLock<Result<Vec<u8>, String>>>,
}

/// The bytes of a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct StridedBytes<'a> {
    pub bytes: &'a [u8],
    /// Bytes from one element to the next, if the view gives them.
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    pub fn new(document: &'a Document, resources: &'a Resources, binary: Option<&'a [u8]>) -> Self {
        let read = document.buffers.iter().map(|_| OnceLock::new()).collect();
        let unpacked = document.buffer_views.iter().map(|_| OnceLock::new()).collect();
        Self { document, resources, binary, read, unpacked }
    }

    /// The files that were read so far.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.read.iter().filter_map(|read| read.get()?.as_ref().ok()?.file.clone())
    }

    /// Oddities of the buffers that were read so far.
    pub fn warnings(&self) -> Vec<String> {
        let of_one = |(index, buffer): (usize, &Buffer)| {
            let content = self.read[index].get().and_then(|read| read.as_ref().ok());
            let odd = content.and_then(|content| content.odd.clone());
            let bytes = match (content, self.binary) {
                (Some(content), _) => Some(content.bytes.len()),
                (None, Some(binary)) if index == 0 && buffer.has_no_uri() => Some(binary.len()),
                _ => None,
            };
            let length = buffer.byte_length.map(|length| length.0);
            let short = length.zip(bytes).filter(|(length, bytes)| bytes < length);
            let short = short.map(|(length, bytes)| format!("should have {length} bytes, but only {bytes} are there"));
            let name = named("buffer", index, buffer.name.as_ref());
            odd.into_iter().chain(short).map(move |what| format!("{name}: {what}")).collect::<Vec<_>>()
        };
        self.document.buffers.iter().enumerate().flat_map(of_one).collect()
    }

    /// The bytes of a view, decompressed.
    pub fn view(&self, index: super::json::Whole) -> Result<StridedBytes<'_>, String> {
        let view = entry("buffer view", &self.document.buffer_views, index)?;
        let within = |what: String| format!("{}: {what}", named("buffer view", index.0, view.name.as_ref()));
        self.bytes_of(index.0, view).map_err(within)
    }

    fn bytes_of(&self, index: usize, view: &BufferView) -> Result<StridedBytes<'_>, String> {
        if let Some(packed) = &view.extensions.meshopt {
            let unpacked = self.unpacked[index].get_or_init(|| self.unpack(packed));
            let bytes = match unpacked {
                Ok(bytes) => bytes.as_slice(),
                // The view itself may have the same bytes, for readers that cannot decompress.
                Err(why) => return self.plain(view).map_err(|_| why.clone()),
            };
            if bytes.len() < view.byte_length.0 {
                return Err(format!(
                    "has {} bytes, but {} come of its compressed ones",
                    view.byte_length.0,
                    bytes.len()
                ));
            }
            return Ok(StridedBytes { bytes: &bytes[..view.byte_length.0], stride: Some(packed.byte_stride.0) });
        }
        self.plain(view)
    }

    fn plain(&self, view: &BufferView) -> Result<StridedBytes<'_>, String> {
        let bytes = self.range(view.buffer, view.byte_offset.0, view.byte_length.0)?;
        // 0 stands for tightly packed elements in files that were glTF 1.0 before.
        let stride = view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0);
        Ok(StridedBytes { bytes, stride })
    }

    fn unpack(&self, packed: &Meshopt) -> Result<Vec<u8>, String> {
        let source = self.range(packed.buffer, packed.byte_offset.0, packed.byte_length.0)?;
        meshopt::decode(packed, source)
    }

    /// Bytes of a buffer; fewer than `length` if the buffer ends before.
    fn range(&self, buffer: Option<super::json::Whole>, offset: usize, length: usize) -> Result<&[u8], String> {
        let buffer = buffer.ok_or("names no buffer")?;
        let bytes = self.buffer(buffer)?;
        let last = offset.saturating_add(length);
        let range = bytes.get(offset..last.min(bytes.len())).filter(|range| !range.is_empty() || length == 0);
        range.ok_or_else(|| {
            format!("reaches from byte {offset} to {last} of buffer {}, which has {}", buffer.0, bytes.len())
        })
    }

    fn buffer(&self, index: super::json::Whole) -> Result<&[u8], String> {
        let buffer = entry("buffer", &self.document.buffers, index)?;
        let within = |what: String| format!("{}: {what}", named("buffer", index.0, buffer.name.as_ref()));
        let most = buffer.byte_length.map_or(MOST_BYTES, |length| length.0 as u64);
        let bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) if !uri.is_empty() => {
                let read = self.read[index.0].get_or_init(|| self.resources.read(uri, most));
                read.as_ref().map_err(|what| within(what.clone()))?.bytes.as_slice()
            }
            (_, Some(binary)) if index.0 == 0 => binary,
            // One that only compressed views fall back to (EXT_meshopt_compression).
            _ => return Err(within("has neither a URI nor a chunk of a binary file".into())),
        };
        Ok(&bytes[..bytes.len().min(usize::try_from(most).unwrap_or(usize::MAX))])
    }
}

impl Buffer {
    fn has_no_uri(&self) -> bool {
        self.uri.as_ref().is_none_or(String::is_empty)
    }
}
