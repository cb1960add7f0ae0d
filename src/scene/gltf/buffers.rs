//! Buffers and the views into them. Each is read when something first needs it, and no byte is handed out that is not there.

use std::path::PathBuf;
use std::sync::OnceLock;

use super::json::{BufferView, Document, entry, named};
use super::json_extensions::Meshopt;
use super::meshopt;
use super::uri::{Content, Resources};

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
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    /// From one element to the next, where the view says so.
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
        self.read.iter().filter_map(|read| read.get()?.as_ref().ok()?.1.clone())
    }

    /// The bytes of a view, decompressed.
    pub fn view(&self, index: super::json::Whole) -> Result<View<'_>, String> {
        let view = entry("buffer view", &self.document.buffer_views, index)?;
        let within = |what: String| format!("{}: {what}", named("buffer view", index.0, view.name.as_ref()));
        self.bytes_of(index.0, view).map_err(within)
    }

    fn bytes_of(&self, index: usize, view: &BufferView) -> Result<View<'_>, String> {
        if let Some(packed) = &view.extensions.meshopt {
            let unpacked = self.unpacked[index].get_or_init(|| self.unpack(packed));
            let bytes = unpacked.as_ref().map_err(Clone::clone)?.as_slice();
            if bytes.len() < view.byte_length.0 {
                return Err(format!(
                    "has {} bytes, but {} come of its compressed ones",
                    view.byte_length.0,
                    bytes.len()
                ));
            }
            return Ok(View { bytes: &bytes[..view.byte_length.0], stride: Some(packed.byte_stride.0) });
        }
        let bytes = self.range(view.buffer, view.byte_offset.0, view.byte_length.0)?;
        let stride = view.byte_stride.map(|stride| stride.0);
        if let Some(stride) = stride.filter(|stride| !(1..=255).contains(stride)) {
            return Err(format!("its stride is {stride} bytes, not from 4 to 252"));
        }
        Ok(View { bytes, stride })
    }

    fn unpack(&self, packed: &Meshopt) -> Result<Vec<u8>, String> {
        let source = self.range(packed.buffer, packed.byte_offset.0, packed.byte_length.0)?;
        meshopt::decode(packed, source)
    }

    /// Bytes of a buffer.
    fn range(&self, buffer: super::json::Whole, offset: usize, length: usize) -> Result<&[u8], String> {
        let bytes = self.buffer(buffer)?;
        let end = offset.checked_add(length).filter(|&end| end <= bytes.len());
        let range = end.map(|end| &bytes[offset..end]);
        range.ok_or_else(|| {
            let last = offset.saturating_add(length);
            format!("reaches from byte {offset} to {last} of buffer {}, which has {}", buffer.0, bytes.len())
        })
    }

    fn buffer(&self, index: super::json::Whole) -> Result<&[u8], String> {
        let buffer = entry("buffer", &self.document.buffers, index)?;
        let length = buffer.byte_length.0;
        let within = |what: String| format!("{}: {what}", named("buffer", index.0, buffer.name.as_ref()));
        let bytes = match (&buffer.uri, self.binary) {
            (Some(uri), _) => {
                let read = self.read[index.0].get_or_init(|| self.resources.read(uri, length as u64));
                read.as_ref().map_err(|what| within(what.clone()))?.0.as_slice()
            }
            (None, Some(binary)) if index.0 == 0 => binary,
            // One that only compressed views fall back to (EXT_meshopt_compression).
            (None, _) => return Err(within("has neither a URI nor a chunk of a binary file".into())),
        };
        if bytes.len() < length {
            return Err(within(format!("should have {length} bytes, but only {} are there", bytes.len())));
        }
        Ok(&bytes[..length])
    }
}
