//! The harbour of assets: its example makes its files, and each of its clips moves something.

use std::path::Path;

use afterlight::scene::{ClipChoice, Playing, Scene};

use crate::common::stage::open;

#[path = "../../examples/harbour/scene.rs"]
mod made;

#[test]
fn the_harbours_files_are_what_its_example_makes() {
    let folder = Path::new(env!("AFTERLIGHT_ROOT")).join("assets/harbour");
    for (name, bytes) in made::files() {
        let kept = std::fs::read(folder.join(name)).unwrap_or_default();
        assert!(kept == bytes, "{name} is not what `cargo run --package afterlight --example harbour` makes");
    }
}

/// Prints a moment of the scene: places of objects, bounds of meshes, lights, and materials with the places of their textures.
fn told(scene: &Scene, time: f64, clips: ClipChoice) -> String {
    let now = scene.at(&Playing { time, clips, ..Playing::default() });
    let points: Vec<_> = now.meshes.iter().map(|mesh| mesh.bounds).collect();
    let places: Vec<_> = now.objects.iter().map(|object| object.transform).collect();
    format!("{places:?} {points:?} {:?} {:?}", now.lights, now.materials)
}

#[test]
fn each_clip_of_the_harbour_moves_something_and_nothing_else_does() {
    let scene = open("assets/harbour.toml");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let rest = told(&scene, 1.3, ClipChoice::None);
    assert_eq!(rest, told(&scene, 0.7, ClipChoice::None));
    let mut names = Vec::new();
    for (index, clip) in scene.motion.clips.iter().enumerate() {
        let [early, late] = [0.7, 1.3].map(|time| told(&scene, time, ClipChoice::Only(vec![index])));
        assert!(early != late && early != rest && late != rest, "{}", clip.name);
        names.push(clip.name.as_str());
    }
    assert_eq!(names, ["sea", "wind", "crane", "lighthouse", "gulls", "ripples"]);
}
