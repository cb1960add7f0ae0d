//! Readers of scenes and of the files that scenes are made of.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use afterlight::plan::{Capabilities, FramePlan};
use afterlight::scene::file::{parse, parse_path, parse_settings};
use afterlight::scene::gltf::GltfOptions;
use afterlight::scene::{Camera, Error, OpenOptions, Scene, SettingsPatch, gltf, open, read_panorama};

use super::is_one_line;

/// A folder with files that others may name: a model with its material and its texture, a sky, and scenes to build on.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = super::folder("scenes");
    let put = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("written");
    put("a.obj", b"mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    put("a.mtl", b"newmtl m\nKd 1 0.5 0\nmap_Kd a.png\n");
    put("a.png", include_bytes!("../../assets/gallery/perforated.png"));
    // A grey sky of 4 x 2 texels.
    put("a.hdr", &[b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", &[0x80; 32][..]].concat());
    put("stage.toml", include_bytes!("../../assets/gallery/stage.toml"));
    put("room.toml", include_bytes!("../../assets/gallery/room.toml"));
    put("directional.toml", include_bytes!("../../assets/gallery/directional.toml"));
    put("settings.toml", b"[settings]\nsize = [32, 18]\n");
    folder
});

/// A file in that folder.
fn file(name: &str) -> PathBuf {
    FOLDER.join(name)
}

/// Writes a file there and opens it, or another one that names it, as a scene.
fn open_with(name: &str, bytes: &[u8], opened: &str) {
    fs::write(file(name), bytes).expect("written");
    can_be_drawn(open(file(opened).to_str().expect("a name in UTF-8"), &OpenOptions::default()));
}

/// A scene that was read has a plan, unless its settings ask for something that no device has.
fn can_be_drawn(read: Result<Scene, Error>) {
    match read {
        Ok(scene) => {
            scene.check().unwrap_or_else(|error| panic!("what was read cannot be drawn: {error}"));
            scene.warnings.iter().for_each(is_one_line);
            if let Err(error) = FramePlan::of(&scene, &scene.settings.decide(), &Capabilities::ample()) {
                is_one_line(&error);
            }
        }
        Err(error) => is_one_line(&error),
    }
}

pub fn gltf(bytes: &[u8]) {
    can_be_drawn(gltf::parse(bytes.to_vec(), Path::new("/no/such/folder/x.gltf"), &GltfOptions::default()).map(
        |read| {
            let mut scene = Scene::default();
            read.append_to(&mut scene, glam::DAffine3::IDENTITY);
            scene
        },
    ));
}

pub fn obj(bytes: &[u8]) {
    open_with("fuzzed.obj", bytes, "fuzzed.obj");
}

pub fn mtl(bytes: &[u8]) {
    static OBJ: LazyLock<()> = LazyLock::new(|| {
        let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
        let faces: String = ["a", "b", "c"].iter().map(|name| format!("usemtl {name}\nf 1/1 2/2 3/3 4/4\n")).collect();
        fs::write(file("of_mtl.obj"), format!("mtllib fuzzed.mtl\n{square}{faces}")).expect("written");
    });
    LazyLock::force(&OBJ);
    open_with("fuzzed.mtl", bytes, "of_mtl.obj");
}

pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    can_be_drawn(parse(text, &file("fuzzed.toml"), &OpenOptions::default()));
}

pub fn path(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let read = |text: &str| parse_path(text, Path::new("path.toml"), &Camera::default());
    match read(text) {
        Ok(path) => {
            for share in [0.0, 0.1, 0.5, 0.99, 1.0, 2.0] {
                let camera = path.at(share * path.seconds());
                assert!(camera.position.is_finite() && camera.rotation.is_finite(), "{share}: {camera:?}");
            }
            assert_eq!(read(&path.to_toml()).expect("what was written is a path"), path);
        }
        Err(error) => is_one_line(&error),
    }
}

pub fn settings(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let file = Path::new("settings.toml");
    for read in [text.parse::<SettingsPatch>(), parse_settings(text, file)] {
        match read {
            Ok(patch) => {
                patch.check().expect("what was read is in its range");
                assert_eq!(patch.to_string().parse::<SettingsPatch>().expect("its text"), patch);
                assert_eq!(parse_settings(&patch.to_toml(), file).expect("its file"), patch);
                patch.decide();
            }
            Err(error) => is_one_line(&error),
        }
    }
}

pub fn image(bytes: &[u8]) {
    // Formats are told by their content, and TGA, which has no mark, by its name.
    fs::write(file("fuzzed.tga"), bytes).expect("written");
    let text = "base = \"builtin:triangle\"\n[[models]]\nshape = { kind = \"box\", size = [1, 1, 1] }\nmaterial = \"m\"\n\
                [[materials]]\nname = \"m\"\nbase_color_texture = \"fuzzed.tga\"\nnormal_texture = \"fuzzed.tga\"\n";
    can_be_drawn(parse(text, &file("of_image.toml"), &OpenOptions::default()));
}

pub fn sky_hdr(bytes: &[u8]) {
    sky("fuzzed.hdr", bytes);
}

pub fn sky_exr(bytes: &[u8]) {
    sky("fuzzed.exr", bytes);
}

fn sky(name: &str, bytes: &[u8]) {
    fs::write(file(name), bytes).expect("written");
    let mut warnings = Vec::new();
    match read_panorama(&file(name), &mut warnings) {
        Ok(image) => {
            assert_eq!(image.texels.len(), image.size.iter().product::<u32>() as usize);
            assert!(image.texels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
            warnings.iter().for_each(is_one_line);
        }
        Err(error) => is_one_line(&error),
    }
}
