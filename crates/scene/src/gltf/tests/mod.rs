//! Small files, built here, and the scenes and errors that come of them.

mod bad;
mod compressed;
mod encoded;
mod geometry;
mod ktx;
mod materials;
mod motion;
mod sheets;

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{GltfOptions, load};
use crate::Imported;

/// A file as it grows: JSON, and the buffer beside it.
pub(super) struct GltfBuilder {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl GltfBuilder {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "it"}],
            "accessors": [], "bufferViews": [], "meshes": [],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A triangle in one node.
    pub fn triangle() -> Self {
        let mut file = Self::new();
        let position = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": position}}]}]);
        file
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend_from_slice(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        push(
            &mut self.json["accessors"],
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    pub fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(kind, 5126, numbers.len() / width, &bytes)
    }

    pub fn shorts(&mut self, kind: &str, count: usize, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.accessor(kind, 5123, count, &bytes)
    }

    /// Sets a value of the first primitive.
    pub fn primitive(&mut self, key: &str, value: Value) -> &mut Self {
        self.json["meshes"][0]["primitives"][0][key] = value;
        self
    }

    /// Sets an attribute of the first primitive.
    pub fn attribute(&mut self, semantic: &str, accessor: usize) -> &mut Self {
        self.json["meshes"][0]["primitives"][0]["attributes"][semantic] = json!(accessor);
        self
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunk = |kind: u32, data: &[u8]| [&(data.len() as u32).to_le_bytes(), &kind.to_le_bytes(), data].concat();
        let body = [chunk(0x4e4f_534a, &text), chunk(0x004e_4942, &self.bytes)].concat();
        [b"glTF", &2u32.to_le_bytes()[..], &(12 + body.len() as u32).to_le_bytes(), &body].concat()
    }

    pub fn read_with(&self, options: &GltfOptions) -> Result<Imported, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path: PathBuf = folder.path().join("x.glb");
        std::fs::write(&path, self.glb()).expect("written");
        load(&path, options).map_err(|error| error.to_string())
    }

    pub fn read(&self) -> Imported {
        self.read_with(&GltfOptions::default()).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn error(&self) -> String {
        let error = self.read_with(&GltfOptions::default()).expect_err("an error");
        assert!(!error.contains('\n'), "{error}");
        error
    }
}

/// Adds to a list, which may be to begin yet.
pub(super) fn push(list: &mut Value, value: Value) -> usize {
    if list.is_null() {
        *list = json!([]);
    }
    let list = list.as_array_mut().expect("a list");
    list.push(value);
    list.len() - 1
}
