//! Third-party glTF models, as they looked when somebody last looked at them. docs/GLTF.md says what each of them shows.

use std::path::{Path, PathBuf};

use super::{Album, album};
use crate::common::golden::check;
use crate::common::gpu::{Gpu, is_swiftshader};
use crate::common::{scenes_dir, some_of, tries_all};
use afterlight::scene::{OpenOptions, Settings, open};

const SIZE: [u32; 2] = [96, 72];

/// Frames of a picture.
const SAMPLES: u32 = 4;

/// 1,040,409 triangles, which the others together do not have.
const LARGE: &str = "MetalRoughSpheresNoTextures";

/// Models that are drawn besides the folder of glTF samples.
const OTHERS: [&str; 3] =
    ["dutch_ship_medium/dutch_ship_medium_1k.gltf", "kenney_city/building-small-a.glb", "zdm2/zdm2.glb"];

fn is_gltf(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "gltf" || extension == "glb")
}

/// The files of a folder in the order of their names.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    paths.sort();
    paths
}

fn models(scenes: &Path) -> Vec<PathBuf> {
    let samples = entries(&scenes.join("gltf"));
    let samples = samples.iter().flat_map(|folder| entries(folder)).filter(|path| is_gltf(path));
    let all = samples.chain(OTHERS.iter().map(|other| scenes.join(other)));
    all.filter(|path| tries_all() || path.file_stem().is_none_or(|stem| stem != LARGE)).collect()
}

/// Returns the name of a model's golden image: its file's name without characters that some file systems lack.
fn golden(model: &Path) -> String {
    let stem = model.file_stem().unwrap_or_default().to_string_lossy();
    format!("gltf/{}", stem.chars().filter(|c| c.is_ascii_alphanumeric() || "-_".contains(*c)).collect::<String>())
}

fn compare(gpu: &Gpu, model: &Path) -> Result<(), String> {
    let options = OpenOptions { aspect: f64::from(SIZE[0]) / f64::from(SIZE[1]), ..OpenOptions::default() };
    let scene = open(&model.to_string_lossy(), &options).map_err(|error| error.to_string())?;
    let settings = Settings { size: SIZE, samples: SAMPLES, anisotropy: 1, ..scene.settings.decide() };
    let picture = gpu.renderer(&scene, &settings).picture(&scene.camera, || {});
    check(&golden(model), &picture.map_err(|error| format!("{}: {error}", model.display()))?, &gpu.device.physical)
}

#[test]
fn every_model_looks_as_it_did() {
    let Some(scenes) = scenes_dir() else { return };
    let models = models(&scenes);
    assert!(models.len() >= 39, "only {} models in {}", models.len(), scenes.display());
    album(|Album { gpu, wrong }| {
        if is_swiftshader(&gpu.device.physical) {
            return eprintln!("SKIPPED: golden images of models are lavapipe's");
        }
        // `make test-all` compares all of them.
        wrong.extend(some_of(&models, 3).filter_map(|model| compare(gpu, model).err()));
    });
}
