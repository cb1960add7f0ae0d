//! Keys step through the frame: the picture after each pass and light, and then the whole frame as it was.

use crate::common::some_of;
use std::fs;
use std::path::Path;

use super::harness::{SIZE, Server, View, key, rendered, rgb, size_text};

/// Lights in the order in which a frame has them: directional lights, lights that reach everywhere, lights of limited reach.
const LIGHTS: [(&str, &str); 4] = [
    ("sun", "kind = \"directional\"\ndirection = [-0.4, -1, -0.6]\nintensity = 1.5"),
    ("bulb", "kind = \"point\"\nposition = [0.6, 0.9, 0.8]\nintensity = 0.6\ncolor = [1, 0.6, 0.3]"),
    (
        "spot",
        "kind = \"spot\"\nposition = [-0.8, 1.2, 1]\ntarget = [-0.3, 0, 0]\nintensity = 3\nrange = 4\ncasts_shadow = true",
    ),
    ("lamp", "kind = \"point\"\nposition = [0.5, 0.4, -0.4]\nintensity = 0.8\nrange = 2\ncolor = [0.3, 0.5, 1]"),
];

/// A block on a floor with a pane before it, or without, and some of the lights, in another order than a frame has them.
fn write_scene(folder: &Path, lights: &[(&str, &str)], pane: bool) -> String {
    let mut text = String::from(
        r##"
[[models]]
name = "floor"
shape = { kind = "plane", size = [6, 6] }
[[models]]
name = "block"
shape = { kind = "box", size = [0.6, 0.8, 0.6] }
translation = [-0.3, 0.4, 0]
rotation = [0, 25, 0]
[[materials]]
name = "gauze"
base_color = "#2a55d8"
alpha = 0.5
alpha_mode = "blend"
[environment]
ambient = [0.1, 0.1, 0.12]
background = [0.3, 0.5, 0.8]
[camera]
position = [0.4, 1, 2.2]
target = [0, 0.3, 0]
[settings]
exposure = -1
"##,
    );
    if pane {
        text += "[[models]]\nname = \"pane\"\nshape = { kind = \"plane\", size = [0.8, 0.6] }\nmaterial = \"gauze\"\n";
        text += "translation = [0.3, 0.5, 0.8]\nrotation = [90, 0, 0]\n";
    }
    let (everywhere, limited) = lights.split_at(lights.len().min(2));
    for (name, keys) in limited.iter().chain(everywhere.iter().rev()) {
        text += &format!("[[lights]]\nname = \"{name}\"\n{keys}\n");
    }
    let path = folder.join(format!("{} lights {pane}.toml", lights.len()));
    fs::write(&path, text).expect("a file");
    path.to_str().expect("UTF-8").into()
}

/// The picture behind the panel.
fn screenshot(server: &Server, view: &mut View, number: usize) -> Vec<u8> {
    server.tap(key::P);
    let name = format!("afterlight-{number:04}.png");
    view.waits_to_tell(&name);
    rgb(&view.folder.path().join(name))
}

#[test]
fn keys_step_through_passes_and_lights_and_end_with_the_whole_frame() {
    let (server, folder) = (Server::start(), tempfile::tempdir().expect("a temporary folder"));
    let scene = write_scene(folder.path(), &LIGHTS, true);
    let scene = scene.as_str();
    let path = ["--light-path", "loop"];
    let drawn = |scene: &str, more: &[&str]| rendered(SIZE, &[&[scene], &path[..], more].concat());
    let of_view = |name: &str| drawn(scene, &["--view", name]);
    let lit = |count: usize| {
        // Nothing transparent, in a frame that could draw it.
        drawn(&write_scene(folder.path(), &LIGHTS[..count], false), &["--plan", "transparent"])
    };
    let unsmoothed = drawn(scene, &[]);
    let mut steps = vec![
        ("SHADOW, shadow maps", of_view("shadow-map")),
        ("GEOMETRY, depth", of_view("depth")),
        ("GEOMETRY, normal", of_view("normal")),
        ("GEOMETRY, albedo", of_view("albedo")),
        ("GEOMETRY, roughness", of_view("roughness")),
        ("LIGHTING, no light", lit(0)),
    ];
    let names = ["LIGHTING, sun", "LIGHTING, bulb", "LIGHTING, spot", "LIGHTING, lamp"];
    steps.extend(names.into_iter().zip(1..).map(|(name, count)| (name, lit(count))));
    let whole = drawn(scene, &["--fxaa", "on"]);
    steps.extend([
        ("TRANSPARENT, transparent surfaces", unsmoothed.clone()),
        ("TONEMAP, light before the curve", drawn(scene, &["--tonemap", "none"])),
        ("TONEMAP, the curve", unsmoothed),
        ("FXAA, the picture after it", whole.clone()),
    ]);

    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene, path[0], path[1], "--fxaa", "on", "--size", &size]);
    view.shows(&whole, "as it was opened");
    for (place, (name, expected)) in steps.iter().enumerate() {
        server.tap(key::PERIOD);
        view.waits_to_tell(&format!("step {} of {}: {name}\n", place + 1, steps.len()));
        let found = screenshot(&server, &mut view, place + 1);
        assert!(found == *expected, "{name}: {} of its bytes differ", different(&found, expected));
    }
    for pair in steps[5..11].windows(2) {
        assert!(pair[0].1 != pair[1].1, "{} shows what {} does", pair[1].0, pair[0].0);
    }
    server.tap(key::PERIOD);
    view.waits_to_tell("step: the whole frame\n");
    view.shows(&whole, "after the last step");

    // Backwards, over the edge of view and light, through a change of size; and Esc.
    for _ in 0..10 {
        server.tap(key::COMMA);
    }
    view.waits_to_tell(&format!("step 5 of {}", steps.len()));
    view.resize([200, 120]);
    view.resize(SIZE.map(u32::from));
    let found = screenshot(&server, &mut view, steps.len() + 1);
    assert!(found == steps[4].1, "back at the roughness");
    server.tap(key::ESCAPE);
    view.shows(&whole, "after Esc");
    server.tap(key::ESCAPE);
    view.ends_well();
}

fn different(a: &[u8], b: &[u8]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// Other kinds of frame: the first and the last picture, and the way back.
#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn frames_of_every_kind_step_from_no_light_to_the_whole_picture() {
    let (server, folder) = (Server::start(), tempfile::tempdir().expect("a temporary folder"));
    let scene = write_scene(folder.path(), &LIGHTS, false);
    let unlit = write_scene(folder.path(), &[], false);
    let size = size_text(SIZE);
    let kinds = [
        (&["--light-path", "forward"][..], "FORWARD, no light", 1, 6),
        (&["--light-path", "forward", "--msaa", "4"], "FORWARD, no light", 1, 6),
        (&["--light-path", "compute"], "TILED, no light", 5, 10),
        (&["--light-path", "volumes"], "LIGHTING, no light", 5, 12),
        (&["--light-path", "clustered", "--msaa", "4"], "LIGHTING, no light", 6, 11),
    ];
    for (more, first, before, count) in some_of(kinds, 2) {
        let whole = rendered(SIZE, &[&[scene.as_str()], more].concat());
        let mut view = View::open(&server, &[&[scene.as_str()], more, &["--size", size.as_str()]].concat());
        view.shows(&whole, &format!("{more:?}"));
        for _ in 0..=before {
            server.tap(key::PERIOD);
        }
        view.waits_to_tell(&format!("step {} of {count}: {first}\n", before + 1));
        let found = screenshot(&server, &mut view, 1);
        let expected = rendered(SIZE, &[&[unlit.as_str()], more].concat());
        // A code where light is blended into other formats than without any.
        let most = found.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most <= Some(1) && found != whole, "{more:?}: without lights it is off by {most:?}");
        for _ in 0..4 {
            server.tap(key::PERIOD);
        }
        view.waits_to_tell(&format!("step {} of {count}: ", before + 5));
        let found = screenshot(&server, &mut view, 2);
        if before + 5 == count {
            assert!(found == whole, "{more:?}: {} bytes of the last step differ", different(&found, &whole));
        }
        server.tap(key::ESCAPE);
        view.shows(&whole, &format!("{more:?}, after Esc"));
        view.closes_well();
    }
}
