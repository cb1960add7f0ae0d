//! Lobes of materials that are drawn otherwise than a scene file says: named in warnings.

use std::fs;

use afterlight::scene::{OpenOptions, Scene, open};
use tempfile::TempDir;

fn read(folder: &TempDir, material: &str) -> Scene {
    let path = folder.path().join("scene.toml");
    let model = "[[models]]\nshape = { kind = 'box', size = [1, 1, 1] }\nmaterial = 'a'\n";
    fs::write(&path, format!("[[materials]]\nname = 'a'\n{material}\n{model}")).unwrap();
    open(path.to_str().expect("a name"), &OpenOptions::default()).unwrap_or_else(|error| panic!("{material}: {error}"))
}

#[test]
fn lobes_that_are_drawn_otherwise_than_said_are_named_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    for (material, words) in [
        ("film = 1\nfilm_thickness = [0, 0]", "materials[0].film = 1: its film is 0 nm thick: drawn without it"),
        (
            "sheen_color = [1, 1, 1]",
            "materials[0].sheen_color = [1, 1, 1]: its sheen has a sheen_roughness of 0, below the least of the model: taken for 0.07",
        ),
        ("anisotropy = 0.5\nbrdf = 'phong'", "its anisotropy is not drawn: phong has none"),
        ("film = 0.5\nunlit = true", "its film is not drawn: an unlit material has none"),
        ("diffuse_transmission = 0.5\nalpha_mode = 'coat'", "its diffuse transmission is not drawn: a coat has none"),
    ] {
        let told = read(&folder, material).warnings.join("\n");
        assert!(told.contains(words) && told.contains("scene.toml:3"), "{material}: {told}");
    }
    for material in [
        "film = 1",
        "film = 0\nfilm_thickness = [0, 0]",
        "sheen_color = [1, 1, 1]\nsheen_roughness = 0.5",
        "anisotropy = 0.5",
        "diffuse_transmission = 1",
        "brdf = 'phong'\nanisotropy = 0",
    ] {
        let told = read(&folder, material).warnings;
        assert_eq!(told, Vec::<String>::new(), "{material}");
    }
}

/// A triangle without texture coordinates has no tangents.
#[test]
fn grooves_on_a_mesh_without_tangents_are_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("bare.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n").unwrap();
    let path = folder.path().join("scene.toml");
    let text = "[[materials]]\nname = 'a'\nanisotropy = 0.5\n[[models]]\npath = 'bare.obj'\nmaterial = 'a'\n";
    fs::write(&path, text).unwrap();
    let scene = open(path.to_str().expect("a name"), &OpenOptions::default()).expect("a scene");
    let told = scene.warnings.join("\n");
    let words = "which has neither tangents nor texture coordinates to make them of: drawn as rough in each direction";
    assert!(told.contains(words) && told.contains("scene.toml:3"), "{told}");
}
