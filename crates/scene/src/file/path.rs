//! Files with a camera path: `[[keys]]`, each a camera at a time.

use std::path::Path;

use super::node::{SourceText, TIME, Table};
use super::{parse_root, read_text, schema, settings};
use crate::{Camera, CameraKey, CameraPath, Error};

/// Opens a camera path. Values that the first key leaves out come from `camera`; values that another key leaves out come from the key before it.
///
/// # Errors
/// [`Error::Read`] when it cannot be read; [`Error::Content`] with the line when something in it is wrong.
pub fn load_path(path: &Path, camera: &Camera) -> Result<CameraPath, Error> {
    parse_path(&read_text(path)?, path, camera)
}

/// Reads the text of a camera path that stands, or would stand, at `path`.
///
/// # Errors
/// As [`load_path`].
pub fn parse_path(text: &str, path: &Path, camera: &Camera) -> Result<CameraPath, Error> {
    let source = SourceText { path, text };
    let root = parse_root(source)?;
    let root = Table::open(source, 0, String::new(), root.get_ref(), schema::PATH)?;
    let mut keys: Vec<CameraKey> = Vec::new();
    for node in root.list("keys")? {
        let table = node.table(schema::KEY)?;
        let Some(time) = table.get("time") else { return Err(table.wrong("needs a time")) };
        let before = keys.last().map(|key| (key.time, key.camera));
        let camera = settings::camera_of(&table, before.map_or(*camera, |(_, camera)| camera))?;
        let key = CameraKey { time: time.number(TIME)?, camera };
        if let Some((earlier, other)) = before {
            if key.time <= earlier {
                return Err(time.wrong(format!("must be after the {earlier} of the key before it")));
            }
            if camera.is_orthographic() != other.is_orthographic() {
                return Err(table.wrong("a path is either perspective or orthographic"));
            }
        }
        keys.push(key);
    }
    CameraPath::new(keys).map_err(|error| source.error(0, error.to_string()))
}
