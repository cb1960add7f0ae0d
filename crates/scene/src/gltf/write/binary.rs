//! The binary chunk: buffer views, accessors, and the container around it all (glTF 2.0, "GLB File Format Specification").

use serde_json::{Map, Value, json};

use super::number;

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Header of the file, and of each of its two chunks.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// Bytes with their views and accessors.
#[derive(Default)]
pub(super) struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Adds bytes as a view. Returns its number. Views begin at multiples of 4, as the widest component needs.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Values of vertices: the number of their accessor. `bounds` has the smallest and largest of each component in it, which positions need.
    pub fn vertices<const N: usize>(&mut self, values: &[[f32; N]], bounds: bool) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind });
        if bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| {
                let component = |axis: usize| values.iter().map(|value| value[axis]).fold(start, pick);
                std::array::from_fn::<f32, N, _>(component).map(number).to_vec()
            };
            accessor["min"] = fold(f32::INFINITY, f32::min).into();
            accessor["max"] = fold(f32::NEG_INFINITY, f32::max).into();
        }
        self.accessor(accessor)
    }

    /// Corners of triangles: the number of their accessor. 65535 is no 16-bit index: it restarts primitives.
    pub fn indices(&mut self, indices: &[u32]) -> usize {
        let short: Option<Vec<u16>> =
            indices.iter().map(|&index| u16::try_from(index).ok().filter(|index| *index < u16::MAX)).collect();
        let (kind, bytes): (u32, Vec<u8>) = match short {
            Some(short) => (UNSIGNED_SHORT, short.iter().flat_map(|index| index.to_le_bytes()).collect()),
            None => (UNSIGNED_INT, indices.iter().flat_map(|index| index.to_le_bytes()).collect()),
        };
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessor(json!({ "bufferView": view, "componentType": kind, "count": indices.len(), "type": "SCALAR" }))
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// The file: this and the other lists of its JSON.
    ///
    /// # Errors
    /// A file longer than its header can say.
    pub fn finish(self, mut file: Map<String, Value>) -> Result<Vec<u8>, String> {
        let Self { bytes, views, accessors } = self;
        file.insert("buffers".into(), json!([{ "byteLength": bytes.len() }]));
        file.insert("bufferViews".into(), views.into());
        file.insert("accessors".into(), accessors.into());
        let mut text = Value::Object(file).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let length = HEADER + CHUNK_HEADER + text.len() + CHUNK_HEADER + bytes.len();
        let Ok(in_header) = u32::try_from(length) else {
            return Err(format!("makes a file of {length} bytes: a .glb has at most {}", u32::MAX));
        };
        let mut all = Vec::with_capacity(length);
        all.extend(b"glTF");
        all.extend(2u32.to_le_bytes());
        all.extend(in_header.to_le_bytes());
        for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bytes)] {
            // Each is shorter than the whole.
            all.extend((chunk.len() as u32).to_le_bytes());
            all.extend(kind);
            all.extend(chunk);
        }
        Ok(all)
    }
}
