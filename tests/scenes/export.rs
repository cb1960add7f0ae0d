//! `afterlight export`: a file opens as the scene that was written, needs the same plan, and gives the same picture.

use std::fs;

use afterlight::frame::Pixels;
use afterlight::plan::FramePlan;
use afterlight::scene::gltf::{self, Exported, ExportedView};
use afterlight::scene::{OpenOptions, Output, Scene, Settings, SettingsPatch, metered_ev100, open};

use crate::common::gpu::{Gpu, on_gpu};
use crate::common::program::program;
use crate::common::stage::{self, gbuffer};
use crate::common::{capabilities, tries_all};

const SIZE: [u32; 2] = [96, 54];

/// The greatest difference of a lambert surface's light, as a share of the brightest, if it is drawn by the formula of a dielectric that reflects
/// nothing: roundings of a few products in f32.
const MOST: f32 = 1e-6;

/// Scenes between them have every material, light and texture that glTF has words for.
fn specs() -> Vec<String> {
    let gallery = |name: &str| format!("{}/assets/gallery/{name}.toml", env!("AFTERLIGHT_ROOT"));
    let hall = if tries_all() { "builtin:hall" } else { "builtin:hall?bays=3&detail=12" };
    let mut specs = vec![
        hall.into(),
        "builtin:spheres".into(),
        "builtin:field?objects=100&lights=8".into(),
        "builtin:cornell".into(),
        gallery("transparency"),
    ];
    if tries_all() {
        specs.extend([gallery("spot"), gallery("point"), gallery("several-directional"), "builtin:seaweed".into()]);
    }
    specs
}

/// Writes the scene of a spec as a file, and returns it with the scene that the file is read as.
fn there_and_back(spec: &str) -> (Exported, Scene) {
    let scene = stage::open(spec);
    let shot =
        ExportedView { size: SIZE, exposure: exposure(&scene), settings: SettingsPatch::default(), copyright: None };
    let exported = gltf::write(scene, &shot).unwrap_or_else(|error| panic!("{error}"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("scene.glb");
    fs::write(&file, &exported.bytes).expect("a writable folder");
    let read = open(&file.to_string_lossy(), &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    (exported, read)
}

fn exposure(scene: &Scene) -> f32 {
    scene.settings.exposure.unwrap_or_else(|| metered_ev100(scene))
}

fn settings() -> Settings {
    Settings { size: SIZE, output: Output::Nits, gbuffer: gbuffer("float32"), ..Settings::default() }
}

fn light(gpu: &Gpu, scene: &Scene) -> Vec<f32> {
    let mut renderer = gpu.renderer(scene, &settings());
    let picture = renderer.picture(&scene.camera, || ()).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
    let Pixels::LinearF32(light) = picture.pixels else { panic!("light in nits") };
    light
}

/// Returns the lines in which two plans differ, as they print themselves: all of one is too long to read.
fn differences(found: &FramePlan, expected: &FramePlan) -> Vec<String> {
    let [found, expected] = [found, expected].map(|plan| format!("{plan:#?}"));
    if found.lines().count() != expected.lines().count() {
        return vec!["they have other parts".into()];
    }
    let pairs = found.lines().zip(expected.lines()).filter(|(found, expected)| found != expected);
    pairs.map(|(found, expected)| format!("{} for {}", found.trim(), expected.trim())).collect()
}

#[test]
fn a_file_opens_as_the_scene_that_was_written_with_the_same_plan_and_picture() {
    on_gpu(|gpu| {
        for spec in specs() {
            let (exported, read) = there_and_back(&spec);
            let own = &exported.scene;
            assert_eq!(read.warnings, Vec::<String>::new(), "{spec}");
            let counts = |scene: &Scene| {
                let Scene { objects, meshes, materials, textures, lights, .. } = scene;
                [objects.len(), scene.triangle_count(), meshes.len(), materials.len(), textures.len(), lights.len()]
            };
            assert_eq!(counts(&read), counts(own), "{spec}");
            assert_eq!(read.materials, own.materials, "{spec}");
            assert!(!read.fitted.camera && !read.fitted.light, "{spec}");
            let plan = |scene: &Scene| {
                FramePlan::of(scene, &settings(), &capabilities()).unwrap_or_else(|error| panic!("{spec}: {error}"))
            };
            let changes = differences(&plan(&read), &plan(own));
            assert!(changes.is_empty(), "{spec}: {changes:#?}");
            // A built-in scene is written with all of its surroundings.
            let original = Some(stage::open(&spec)).filter(|_| spec.starts_with("builtin:"));
            if let Some(original) = &original {
                assert_eq!((read.environment, exposure(&read)), (original.environment, exposure(original)), "{spec}");
            }
            let [found, expected] = [&read, own].map(|scene| light(gpu, scene));
            // Places and directions are read in 64 bits, and the device gets the same 32.
            let changed = found.iter().zip(&expected).filter(|(found, own)| found != own).count();
            assert!(changed == 0 && expected.iter().any(|light| *light > 0.0), "{spec}: {changed} values differ");
            // Of the built-in scenes the hall alone has painted textures, and every one of its materials is one that glTF has.
            if spec.starts_with("builtin:hall") {
                assert!(original.is_some_and(|original| light(gpu, &original) == found), "{spec}");
            }
        }
    });
}

#[test]
fn lambert_surfaces_look_as_they_did() {
    on_gpu(|gpu| {
        let (exported, _) = there_and_back("builtin:cornell");
        let [found, expected] = [&exported.scene, &stage::open("builtin:cornell")].map(|scene| light(gpu, scene));
        let brightest = expected.iter().copied().fold(0.0, f32::max);
        let worst = found.iter().zip(&expected).map(|(found, own)| (found - own).abs() / brightest).fold(0.0, f32::max);
        assert!(brightest > 0.0 && worst <= MOST, "{worst:e}");
    });
}

#[test]
fn the_command_writes_a_file_and_tells_what_is_not_in_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = |arguments: &[&str]| {
        let output = program().current_dir(folder.path()).arg("export").args(arguments).output().expect("it starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, told, warned) = run(&["builtin:cornell", "-o", "box.glb", "--size", "64x64", "--exposure", "3.5"]);
    assert_eq!(code, Some(0), "{warned}");
    for words in ["8 objects, 32 triangles", "KHR_lights_punctual", "--size 64x64 --exposure 3.5", "box.glb: "] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert!(warned.contains("warning: not in the file: ambient light of 4, 3.6, 3 nits"), "{warned}");
    let written = fs::read(folder.path().join("box.glb")).expect("the file");
    assert!(written.starts_with(b"glTF"));
    let (code, _, warned) = run(&["builtin:cornell", "-o", "again.glb", "--size", "64x64", "--exposure", "3.5", "-q"]);
    assert_eq!((code, warned.as_str()), (Some(0), ""));
    assert_eq!(fs::read(folder.path().join("again.glb")).expect("the file"), written);

    for (arguments, code, words) in [
        (&["builtin:cornell", "-o", "box.obj"][..], 2, "'.obj' is not written; use .glb"),
        (&["builtin:cornell"], 2, "--output"),
        (&["builtin:cornell", "-o", "absent/box.glb"], 3, "there is no folder absent"),
        (&["absent.obj", "-o", "none.glb"], 3, "absent.obj"),
        (&["box.glb", "-o", "box.glb"], 2, "box.glb is read by this command"),
        (&["builtin:field?objects=0&overdraw=0", "-o", "none.glb"], 3, "overdraw"),
    ] {
        let (found, told, warned) = run(arguments);
        assert_eq!(found, Some(code), "{arguments:?}: {warned}");
        let error = warned.lines().find(|line| line.starts_with("error: ")).unwrap_or_default();
        assert!(error.contains(words) && told.is_empty(), "{arguments:?}: {warned}");
    }
    assert!(!folder.path().join("none.glb").exists());
    assert_eq!(fs::read(folder.path().join("box.glb")).expect("the file"), written);
}
