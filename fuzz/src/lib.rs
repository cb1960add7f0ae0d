//! The promise that fuzzing checks: any bytes end in a scene that can be drawn, or in an error of one line.

use std::path::Path;

use afterlight::scene::Scene;
use afterlight::scene::gltf::{GltfOptions, parse};

/// Reads bytes as a glTF file in a folder that does not exist, and panics where a promise is broken.
pub fn read_gltf(bytes: &[u8]) {
    match parse(bytes.to_vec(), Path::new("/no/such/folder/x.gltf"), &GltfOptions::default()) {
        Ok(imported) => {
            let mut scene = Scene::default();
            imported.append_to(&mut scene, glam::DAffine3::IDENTITY);
            scene.check().unwrap_or_else(|error| panic!("what was read cannot be drawn: {error}"));
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}
