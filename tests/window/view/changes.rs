//! Files that change while the window is open: the scene's, and in builds with the feature `hot-reload` the shaders'.

use std::fs;
#[cfg(feature = "hot-reload")]
use std::path::Path;
#[cfg(feature = "hot-reload")]
use std::{thread::sleep, time::Duration};

#[cfg(feature = "hot-reload")]
use super::harness::until;
use super::harness::{SIZE, Server, View, key, rendered, size_text};

const SCENE: &str = "base = 'builtin:spheres'\n";
const DARK: &str = "base = 'builtin:spheres'\nbase_lights = false\n[environment]\nambient = [300, 300, 300]\n";

/// Hides the text over the picture, and waits for the expected picture.
fn without_a_word(server: &Server, view: &mut View, expected: &[u8], what: &str) {
    server.tap(key::ESCAPE);
    view.shows(expected, what);
}

#[test]
fn a_scene_file_is_read_again_when_it_changes_and_a_fault_leaves_the_picture_as_it_was() {
    let server = Server::start();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.toml");
    let name = file.to_str().expect("is UTF-8");
    let size = size_text(SIZE);
    let write = |text: &str| fs::write(&file, text).expect("written");
    write(DARK);
    let dark = rendered(SIZE, &[name]);
    write(SCENE);
    let first = rendered(SIZE, &[name]);
    let mut view = View::open(&server, &[name, "--size", &size]);
    view.shows(&first, "as it was opened");
    write(DARK);
    view.shows(&dark, "with other lights");

    write(&format!("{SCENE}exposure = 'bright'\n"));
    view.waits_to_tell("scene.toml:2");
    view.settles_elsewhere(&dark);
    without_a_word(&server, &mut view, &dark, "as it was before the fault");
    // Read well, and then not to be drawn: this device has no such picture.
    let elsewhere = "[camera]\nposition = [0, 2, 9]\ntarget = [0, 1, 0]\n";
    write(&format!("{DARK}[settings]\nlight_path = 'compute'\nfxaa = true\n{elsewhere}"));
    view.settles_elsewhere(&dark);
    without_a_word(&server, &mut view, &dark, "as it was before settings that do not go together");

    // A fault that is mended is told no more.
    write("nonsense");
    view.settles_elsewhere(&dark);
    write(&format!("{SCENE}{elsewhere}"));
    view.shows(&rendered(SIZE, &[name]), "from the camera that the file names now");
    view.closes_well();
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_camera_that_is_zoomed_stays_so_when_the_scene_is_read_again() {
    let server = Server::start();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.toml");
    let scene =
        "base = 'builtin:hall'\n[camera]\nposition = [0, 9, 30]\ntarget = [0, 4, 0]\northographic_height = 40\n";
    fs::write(&file, scene).expect("written");
    let name = file.to_str().expect("is UTF-8");
    let size = size_text(SIZE);
    let first = rendered(SIZE, &[name]);
    let mut view = View::open(&server, &[name, "--size", &size]);
    view.shows(&first, "as it was opened");
    server.press(key::W);
    std::thread::sleep(std::time::Duration::from_millis(2500));
    server.release(key::W);
    let nearer = view.settles_elsewhere(&first);
    fs::write(&file, format!("{scene}# The same.\n")).expect("written");
    view.waits_to_tell("scene: read again");
    view.rests();
    view.shows(&nearer, "as near as before");
    server.tap(key::R);
    view.shows(&first, "as it was opened");
    view.closes_well();
}

#[cfg(feature = "hot-reload")]
#[test]
fn a_shader_is_compiled_again_when_it_changes_and_a_fault_leaves_its_pipeline_as_it_was() {
    let server = Server::start();
    let folder = tempfile::tempdir().expect("a folder");
    copy_shaders(folder.path());
    let shader = folder.path().join("lighting.wgsl");
    let good = fs::read_to_string(&shader).expect("LIGHTING's shader");
    let (own, size) = ("tone_map(exposed, OPERATOR)", size_text(SIZE));
    assert_eq!(good.matches(own).count(), 1, "LIGHTING maps tones in one place");
    let scene = ["builtin:spheres", "--light-path", "loop"];
    let first = rendered(SIZE, &scene);
    let shaders = folder.path().to_str().expect("is UTF-8");
    let mut view = View::open(&server, &[&scene[..], &["--size", &size, "--shaders", shaders]].concat());
    view.waits_to_tell("shaders: compiled, none differs");
    view.shows(&first, "with the shaders that it was built with");

    fs::write(&shader, good.replace(own, "tone_map(exposed, OPERATER)")).expect("written");
    view.waits_to_tell("warning: shaders: error");
    let told = view.errors();
    let caret = told.lines().find(|line| line.trim_end().ends_with('^')).unwrap_or_else(|| panic!("no caret: {told}"));
    let source = told.lines().find(|line| line.contains("OPERATER)")).expect("the line is told");
    assert_eq!(caret.find('^'), source.find("OPERATER"), "{told}");
    view.settles_elsewhere(&first);
    without_a_word(&server, &mut view, &first, "with the last good pipeline");

    // Red for blue, which nothing but this shader could do.
    fs::write(&shader, good.replace(own, "tone_map(exposed, OPERATOR).bgr")).expect("written");
    view.waits_to_tell("shaders: compiled, lighting");
    let changed = view.settles_elsewhere(&first);
    let (own, other) = (first.as_chunks::<3>().0, changed.as_chunks::<3>().0);
    assert!(own.iter().zip(other).all(|(&[r, g, b], other)| *other == [b, g, r] || *other == [r, g, b]));

    // Rust was compiled against the shader's interface, which cannot change under it.
    fs::write(
        &shader,
        good.replace("override AMBIENT: bool", "override AMBIENCE: bool").replace("(AMBIENT,", "(AMBIENCE,"),
    )
    .expect("written");
    view.waits_to_tell("the program has to be built anew");
    fs::write(&shader, &good).expect("written");
    view.shows(&first, "with the shader as it was");
    // Other pipelines are made of the folder's sources too.
    let forward = folder.path().join("view.wgsl");
    let source = fs::read_to_string(&forward).expect("VIEW's shader");
    fs::write(&forward, format!("{source}\nfn broken() {{\n")).expect("written");
    sleep(Duration::from_millis(300));
    server.tap(key::V);
    view.waits_to_tell("view.wgsl");
    view.closes_well();
}

#[cfg(feature = "hot-reload")]
#[test]
fn the_shader_that_encodes_is_compiled_again_too() {
    if !super::deep::shows() {
        return;
    }
    let server = Server::of_depth(30);
    let folder = tempfile::tempdir().expect("a folder");
    copy_shaders(folder.path());
    let shader = folder.path().join("encode.wgsl");
    let good = fs::read_to_string(&shader).expect("ENCODE's shader");
    let own = "encode_srgb(saturate(light))";
    assert_eq!(good.matches(own).count(), 1, "ENCODE encodes sRGB in one place");
    let (shaders, size) = (folder.path().to_str().expect("is UTF-8"), size_text(SIZE));
    let mut view = View::open(&server, &["builtin:spheres", "--size", &size, "--shaders", shaders]);
    view.waits_to_tell("shaders: compiled, none differs");
    view.rests();
    let first = view.codes_of_10_bits();

    fs::write(&shader, good.replace(own, "encode_srgb(saturate(lite))")).expect("written");
    view.waits_to_tell("warning: shaders: error");
    server.tap(key::ESCAPE);
    view.rests();
    assert!(view.codes_of_10_bits() == first, "with the last good pipeline");
    // Red for blue.
    fs::write(&shader, good.replace(own, "encode_srgb(saturate(light.bgr))")).expect("written");
    view.waits_to_tell("shaders: compiled, encode");
    let swapped: Vec<u16> = first.as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [b, g, r]).collect();
    assert!(swapped != first, "the picture has colours");
    until("red for blue", || (view.codes_of_10_bits() == swapped).then_some(()));
    fs::write(&shader, &good).expect("written");
    until("the shader as it was", || (view.codes_of_10_bits() == first).then_some(()));
    view.closes_well();
}

#[cfg(feature = "hot-reload")]
fn copy_shaders(to: &Path) {
    for part in ["", "shared"] {
        let from = Path::new(env!("AFTERLIGHT_ROOT")).join("shaders").join(part);
        fs::create_dir_all(to.join(part)).expect("a folder");
        for entry in fs::read_dir(from).expect("the shaders") {
            let path = entry.expect("a file").path();
            if path.is_file() {
                fs::copy(&path, to.join(part).join(path.file_name().expect("a file"))).expect("copied");
            }
        }
    }
}
