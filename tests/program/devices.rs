//! Devices with low limits or few features draw the same picture, or the program names the lack in a sentence. The layer of `tests/devices-layer`
//! plays these devices, below the validation layer, which holds the program against the played limits: any message fails. docs/DEVICES.md has the
//! table.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::{env, fs};

use afterlight::scene::LightPath;
use rayon::prelude::*;
use tempfile::TempDir;

use crate::common::program::program;
use crate::common::{some_of, tries_all};

const NAME: &str = "VK_LAYER_AFTERLIGHT_devices";

/// The devices that the layer plays, in its words.
const PROFILES: [&str; 4] = ["portability", "least", "phone", "small-shared-memory"];

/// A refusal of a device to draw by some light paths.
struct Refusal {
    profile: &'static str,
    /// The light paths that are asked for; `auto` if empty.
    paths: &'static [&'static str],
    /// A part of the sentence.
    says: &'static str,
}

const fn refusal(profile: &'static str, paths: &'static [&'static str], says: &'static str) -> Refusal {
    Refusal { profile, paths, says }
}

const FLOAT_BLENDING: &str = "adds lights by blending into 32-bit floats, which this device cannot: try clustered";
const COLOURS: &str = "needs a G-buffer of 5 colour attachments in one subpass, and the device has 4";

/// All refusals of these devices. docs/DEVICES.md has them in a table.
const REFUSALS: &[Refusal] = &[
    refusal("least", &["per-light", "volumes"], FLOAT_BLENDING),
    refusal(
        "least",
        &["compute", "visibility"],
        "needs work groups of 256 invocations, and this device has at most 128: try clustered",
    ),
    refusal("least", &["loop", "clustered"], COLOURS),
    refusal(
        "least",
        &["auto"],
        "a shader names 5 buffers for them, and on this device at most 4: choose --transparency oit",
    ),
    refusal(
        "least",
        &["auto"],
        "a shader names 7 buffers for them, and on this device at most 4: choose --particles off",
    ),
    refusal("phone", &["per-light", "volumes"], FLOAT_BLENDING),
    refusal(
        "phone",
        &["visibility"],
        "(non-uniform indexing, VK_EXT_descriptor_indexing): choose another, as compute or clustered",
    ),
    refusal("phone", &["loop", "clustered", "compute"], COLOURS),
    refusal(
        "small-shared-memory",
        &["auto"],
        "work groups share 16384 bytes, and those of this device at most 4096: choose --transparency oit",
    ),
];

/// A picture to be drawn.
#[derive(Clone, Debug)]
struct Case {
    scene: String,
    path: LightPath,
    profile: &'static str,
}

impl Case {
    fn of(scene: &str, path: LightPath, profile: &'static str) -> Self {
        Self { scene: scene.into(), path, profile }
    }
}

/// The layer's folder, and the driver of a device that is Vulkan in part only: loaders list that for programs alone that ask for it.
pub struct LayerSetup {
    folder: TempDir,
    partial_driver: Option<PathBuf>,
}

impl LayerSetup {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let deps = Path::new(env!("CARGO_BIN_EXE_afterlight")).with_file_name("deps");
        let library = deps.join(libloading::library_filename("afterlight_devices_layer"));
        assert!(library.exists(), "{} is not there", library.display());
        let text = fs::read_to_string(Path::new(env!("AFTERLIGHT_ROOT")).join("tests/devices-layer/devices.json"));
        let mut manifest: serde_json::Value = serde_json::from_str(&text.expect("a manifest")).expect("JSON");
        manifest["layer"]["library_path"] = library.to_str().expect("a path of UTF-8").into();
        let layers = folder.path().join("layers");
        fs::create_dir(&layers).expect("a folder");
        fs::write(layers.join("devices.json"), manifest.to_string()).expect("a manifest");
        // Absent where the loader finds the driver by itself.
        let driver = env::var_os("VK_DRIVER_FILES").and_then(|all| env::split_paths(&all).next());
        let partial_driver = driver.map(|driver| {
            let text = fs::read_to_string(driver).expect("a driver's manifest");
            let mut manifest: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            manifest["ICD"]["is_portability_driver"] = true.into();
            let place = folder.path().join("driver.json");
            fs::write(&place, manifest.to_string()).expect("a manifest");
            place
        });
        Self { folder, partial_driver }
    }

    /// Returns the environment in which a program finds the played device.
    pub fn environment(&self, profile: &str) -> Vec<(&'static str, OsString)> {
        let layers = self.folder.path().join("layers");
        // Layers in the order from the program down to the driver. Loaders about 1.3.239 order layers by their folders instead, so the layer's folder
        // is the last.
        let order = format!("VK_LAYER_KHRONOS_validation:{NAME}");
        let folders = match env::var_os("VK_LAYER_PATH") {
            Some(own) => env::split_paths(&own).collect(),
            None => usual_folders(),
        };
        let folders = env::join_paths(folders.into_iter().chain([layers.clone()])).expect("folders");
        let mut all = vec![
            ("AFTERLIGHT_PLAYS", profile.into()),
            ("VK_INSTANCE_LAYERS", order.into()),
            ("VK_LAYER_PATH", folders),
            // Debian 13's stack has separate folders and drivers.
            ("AFTERLIGHT_LAYERS", layers.into()),
        ];
        if let Some(driver) = self.partial_driver.as_ref().filter(|_| profile == "portability") {
            all.extend(["VK_DRIVER_FILES", "VK_ICD_FILENAMES", "AFTERLIGHT_DRIVER"].map(|name| (name, driver.into())));
        }
        all
    }

    pub fn run(&self, profile: Option<&str>, arguments: &[&str]) -> Output {
        let mut command = program();
        command.args(arguments).envs(profile.into_iter().flat_map(|profile| self.environment(profile)));
        command.output().expect("the program starts")
    }

    /// Draws a case under validation, on the played device or on the real one. The error is the exit code with the program's message.
    fn draw(&self, case: &Case, profile: Option<&str>) -> Result<image::RgbImage, String> {
        let place = tempfile::Builder::new().suffix(".png").tempfile().expect("a file");
        let [path, place] = [case.path.to_string(), place.path().to_str().expect("a path of UTF-8").to_owned()];
        let mut arguments = vec!["render", &case.scene, "--size", "160x90", "--validate", "--output", &place];
        if case.path != LightPath::Auto {
            arguments.extend(["--samples", "1", "--light-path", &path]);
        }
        // The one lack that every picture with textures shows: both filter without it.
        if case.profile == "least" {
            arguments.extend(["--anisotropy", "1"]);
        }
        let output = self.run(profile, &arguments);
        if output.status.success() {
            return Ok(image::open(&place).expect("a picture").to_rgb8());
        }
        Err(format!("exit code {:?}: {}", output.status.code(), String::from_utf8_lossy(&output.stderr)))
    }

    /// Returns the fault of a case, if there is one. Each refusal that the case meets is counted.
    fn fault(&self, case: &Case, met: &Mutex<BTreeSet<usize>>) -> Option<String> {
        let told = match self.draw(case, Some(case.profile)) {
            Ok(played) => match self.draw(case, None) {
                Ok(real) => return differs(&played, &real),
                Err(told) => return Some(format!("drawn, and the real device refuses: {told}")),
            },
            Err(told) => told,
        };
        let path = case.path.to_string();
        let known = REFUSALS
            .iter()
            .position(|own| own.profile == case.profile && own.paths.contains(&&*path) && told.contains(own.says));
        match known {
            Some(index) if told.starts_with("exit code Some(2)") => {
                met.lock().expect("no test has failed here").insert(index);
                None
            }
            // No device draws this case: the real one refuses it in the same words.
            None if self.draw(case, None).is_err_and(|real| real == told) => None,
            _ => Some(told),
        }
    }
}

#[test]
fn a_device_without_graphics_is_refused_in_a_sentence() {
    let setup = LayerSetup::new();
    let output = setup.run(Some("no-graphics"), &["render", "builtin:triangle", "--size", "16x9", "--output", "-"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && told.contains("has no queue for graphics and compute"), "{told}");
    assert_eq!(told.trim().lines().count(), 1, "{told}");
}

/// The device lists an extension and does not open with it: frames are drawn without it, and only settings that need it are refused.
#[test]
fn a_device_that_breaks_a_promise_draws_without_what_it_promised() {
    let stage = LayerSetup::new();
    let draw = |profile: Option<&str>, more: &[&str]| {
        let usual = ["render", "builtin:cornell", "--size", "64x36", "--validate", "--output", "-"];
        let output = stage.run(profile, &[&usual[..], more].concat());
        (output.status.code(), output.stdout, String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let fault = "lists VK_KHR_synchronization2 and does not open with it, a fault of its driver or of a layer";
    let ((code, picture, told), (_, real, _)) = (draw(Some("broken-promise"), &[]), draw(None, &[]));
    assert!(code == Some(0) && picture == real, "{told}");
    let warnings: Vec<&str> = told.lines().filter(|line| line.starts_with("warning: ")).collect();
    assert!(warnings.len() == 1 && warnings[0].contains(fault), "{told}");
    let (code, _, told) = draw(Some("broken-promise"), &["--sync", "2"]);
    let refusal = told.lines().last().unwrap_or_default();
    assert!(code == Some(2) && refusal.contains("--sync 2") && refusal.contains(fault), "{told}");
}

/// Vulkan 1.4 lets a device have local read and say that it cannot read depth so. Pictures with positions in the G-buffer are drawn all the same.
#[test]
fn a_device_that_reads_no_depth_locally_refuses_what_does_by_that_name() {
    let stage = LayerSetup::new();
    let has_local_read = |profile: Option<&str>| {
        let output = stage.run(profile, &["doctor"]);
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        told.lines().find(|line| line.contains("--passes local-read")).unwrap_or_default().trim().to_owned()
    };
    if has_local_read(None).contains("no: ") {
        println!("NOT RUN: the device below has no local read");
        return;
    }
    let own = has_local_read(Some("no-local-depth"));
    assert!(own.ends_with("of colour: a G-buffer needs positions"), "{own}");
    let draw = |more: &[&str]| {
        let usual = ["render", "builtin:cornell", "--size", "64x36", "--passes", "local-read", "--output", "-"];
        let output = stage.run(Some("no-local-depth"), &[&usual[..], more].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, told) = draw(&["--light-path", "loop"]);
    assert_eq!(code, Some(2), "{told}");
    for says in ["LIGHTING reads depth", "dynamicRenderingLocalReadDepthStencilAttachments is false", "float32"] {
        assert!(told.contains(says), "'{says}' is not in '{told}'");
    }
    let (code, told) = draw(&["--light-path", "loop", "--gbuffer", "float32"]);
    assert_eq!(code, Some(0), "{told}");
}

/// Pictures are the same where no channel is off by more than a code: other formats of the G-buffer and of light round otherwise.
fn differs(a: &image::RgbImage, b: &image::RgbImage) -> Option<String> {
    assert_eq!(a.dimensions(), b.dimensions());
    let off = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
    (off > 1).then(|| format!("a channel is off by {off} codes"))
}

/// Returns the folders where loaders look for explicit layers.
fn usual_folders() -> Vec<PathBuf> {
    let home = env::home_dir().unwrap_or_default();
    let own = env::var_os("XDG_DATA_HOME").map_or_else(|| home.join(".local/share"), PathBuf::from);
    let all = ["/etc", "/usr/local/share", "/usr/share"].into_iter().map(PathBuf::from);
    [own]
        .into_iter()
        .chain(all)
        .map(|folder| folder.join("vulkan/explicit_layer.d"))
        .filter(|own| own.is_dir())
        .collect()
}

fn gallery(name: &str) -> String {
    Path::new(env!("AFTERLIGHT_ROOT")).join("assets/gallery").join(name).to_str().expect("UTF-8").into()
}

/// All scenes of the gallery with the light path that the plan chooses, and the built-in ones with each. In `make test` a sample: one scene on every
/// device, one that has more targets than some have, and one that some refuse.
fn cases() -> Vec<Case> {
    let auto = LightPath::Auto;
    if !tries_all() {
        let mut some = PROFILES.map(|profile| Case::of("builtin:triangle", auto, profile)).to_vec();
        some.extend([
            Case::of("builtin:cornell", auto, "least"),
            Case::of("builtin:quad", LightPath::Clustered, "phone"),
            Case::of(&gallery("particles.toml"), auto, "small-shared-memory"),
            Case::of("builtin:cornell", auto, "queues"),
        ]);
        return some;
    }
    let built_in = afterlight::scene::builtin::CATALOGUE.iter().map(|own| match own.name {
        "field" => "builtin:field?objects=300&lights=32".to_owned(),
        name => format!("builtin:{name}"),
    });
    let built_in: Vec<_> = built_in.collect();
    let files = fs::read_dir(gallery("")).expect("the gallery").map(|entry| entry.expect("an entry").path());
    let files = files.filter(|own| own.extension().is_some_and(|own| own == "toml"));
    let mut files: Vec<_> = files.map(|own| own.to_str().expect("UTF-8").to_owned()).collect();
    files.sort();
    let lit = built_in.iter().flat_map(|scene| LightPath::NAMES.iter().map(move |&(_, path)| (scene.clone(), path)));
    let all: Vec<_> = lit.chain(files.into_iter().map(|scene| (scene, auto))).collect();
    let on_each = |(scene, path): &(String, LightPath)| PROFILES.map(|profile| Case::of(scene, *path, profile));
    all.iter().flat_map(on_each).chain([Case::of("builtin:cornell", auto, "queues")]).collect()
}

#[test]
fn devices_that_lack_much_draw_the_same_or_are_refused_in_a_sentence() {
    let (stage, met) = (LayerSetup::new(), Mutex::new(BTreeSet::new()));
    let fault = |case: &Case| Some(format!("{case:?}: {}", stage.fault(case, &met)?));
    let faults: Vec<_> = cases().par_iter().filter_map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let met = met.into_inner().expect("no test has failed here");
    if tries_all() {
        let idle: Vec<_> =
            (0..REFUSALS.len()).filter(|index| !met.contains(index)).map(|own| REFUSALS[own].says).collect();
        assert!(idle.is_empty(), "nothing is refused so any more: {idle:?}");
    } else {
        assert!(!met.is_empty(), "nothing was refused");
    }
}

/// Types the options that errors put into backquotes exactly as printed, along with the options that were typed before.
#[test]
fn what_a_refusal_advises_draws() {
    let harbour = Path::new(env!("AFTERLIGHT_ROOT")).join("assets/harbour.toml");
    let (stage, cornell) = (LayerSetup::new(), "builtin:cornell");
    let cases: [(&[&str], &str); 5] = [
        (&[cornell, "--ao", "bitmask"], "ambient occlusion needs a G-buffer of 5 colour attachments"),
        (
            &[cornell, "--ao", "bitmask", "--gbuffer", "lean"],
            "ambient occlusion needs a G-buffer of 5 colour attachments",
        ),
        (&[cornell, "--ao", "bitmask", "--light-path", "loop"], "choose `--light-path forward --ao off`"),
        (&[harbour.to_str().expect("UTF-8")], "choose `--reflections off --particles off`"),
        (&[cornell, "--reflections", "screen"], "reflections need a G-buffer of 5 colour attachments"),
    ];
    // The harbour and one of the others take most of the time.
    for (typed, says) in some_of(cases, 2) {
        let place = stage.folder.path().join("advised.png");
        let usual =
            ["--size", "32x18", "--samples", "1", "--anisotropy", "1", "--output", place.to_str().expect("UTF-8")];
        // Options that the advice names replace earlier ones.
        let draw = |more: &[&str]| {
            let named = |own: &[&str]| more.contains(&own[0]);
            let kept = typed[1..].chunks(2).filter(|own| !named(own)).flatten();
            let all = ["render", typed[0]].iter().chain(kept).chain(more).chain(&usual).copied().collect::<Vec<_>>();
            let output = stage.run(Some("least"), &all);
            (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
        };
        let (code, told) = draw(&[]);
        assert!(code == Some(2) && told.contains(says), "{typed:?}: {told}");
        let advice: Vec<&str> = told.split('`').skip(1).step_by(2).collect();
        assert!(!advice.is_empty() && !place.exists(), "{typed:?}: {told}");
        for options in advice {
            let (code, told) = draw(&options.split(' ').collect::<Vec<_>>());
            assert!(code == Some(0) && place.exists(), "{typed:?} with {options}: {told}");
            fs::remove_file(&place).expect("the picture");
        }
    }
}

/// Without VK_KHR_maintenance4 no pipeline may be used after its layouts are destroyed, so the second scene must make its own pipelines.
/// Layer 1.4.363 has a message where one does.
#[test]
fn one_scene_after_another_is_silent_where_pipelines_are_not_kept() {
    let (stage, scenes) = (LayerSetup::new(), ["sky.toml", "sky-spheres.toml"].map(gallery));
    // Both are lit by their skies, whose prefilters are alike.
    let settings = ["--size", "64x36", "--anisotropy", "1", "--validate", "--warmup", "1", "--frames", "2"];
    let output = stage.run(Some("least"), &[&["bench", &scenes[0], &scenes[1]], &settings[..]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn inspect_prints_which_subpasses_a_driver_merges_where_it_tells() {
    let stage = LayerSetup::new();
    let inspect = |profile: Option<&str>, options: &[&str]| {
        let usual = ["inspect", "builtin:hall", "--size", "64x36", "--validate"];
        let output = stage.run(profile, &[&usual[..], options].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{options:?}: {told}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let lines = [
        "  the driver merges the 3 subpasses of the GEOMETRY pass into 2",
        "    LIGHTING  merged into subpass 0",
        "    TONEMAP   not merged: too many attachments (VK_SUBPASS_MERGE_STATUS_NOT_MERGED_TOO_MANY_ATTACHMENTS_EXT): \
         6 attachments, and a tile has room for 5",
    ];
    // Frames by either API: the question is asked by the second.
    for sync in ["1", "2"] {
        let text = inspect(Some("merge-feedback"), &["--sync", sync]);
        assert!(text.contains(&lines.join("\n")), "{text}");
    }
    let text = inspect(Some("merge-feedback"), &["--msaa", "4"]);
    let mismatch = "TONEMAP   not merged: the subpass before it has another number of samples";
    assert!(text.contains(mismatch), "{text}");
    // Each subpass is a render pass, and none can be merged.
    let text = inspect(Some("merge-feedback"), &["--passes", "stored"]);
    assert!(!text.contains("the driver merges"), "{text}");

    let passes = |profile| {
        let report: serde_json::Value = serde_json::from_str(&inspect(profile, &["--json"])).expect("JSON");
        report["render_passes"].clone()
    };
    let merging = passes(Some("merge-feedback"))[0]["merging"].clone();
    assert!(merging["merged_into"] == 2 && merging["subpasses"][1]["is_merged"] == true, "{merging}");
    assert!(merging["subpasses"][2]["index"] == 1, "{merging}");
    // The real device does not tell: lavapipe lacks the extension.
    let real = passes(None);
    assert!(real[0]["name"] == "GEOMETRY pass" && real[0]["merging"].is_null(), "{real}");
    assert!(!inspect(None, &[]).contains("the driver merges"));
}

#[test]
fn a_device_of_vulkan_1_1_meets_no_roadmap_and_says_its_version_first() {
    let stage = LayerSetup::new();
    let roadmaps = |profile| {
        let output = stage.run(profile, &["doctor", "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        report["devices"][0]["roadmaps"].clone()
    };
    let phone = roadmaps(Some("phone"));
    for (index, (year, first)) in
        [(2022, "Vulkan 1.3 (the device has 1.1)"), (2024, "Roadmap 2022"), (2026, "Roadmap 2024")]
            .into_iter()
            .enumerate()
    {
        let own = &phone[index];
        assert!(own["year"] == year && own["met"] == false && own["missing"][0] == first, "{own}");
    }
    // Frames use only features that the device has.
    let used = |own: &serde_json::Value| own[0]["used"].as_array().expect("a list").clone();
    let names = ["independentBlend", "sampleRateShading", "drawIndirectFirstInstance", "samplerAnisotropy"];
    assert_eq!(used(&phone), names);
    let real = used(&roadmaps(None));
    assert!(real.iter().any(|own| own == "synchronization2"), "{real:?}");
}

#[test]
fn a_played_device_is_what_the_program_sees() {
    let stage = LayerSetup::new();
    for (profile, says) in [
        ("portability", ["lazily allocated memory  no", "the view triangle        no"]),
        ("least", ["push constants           128 B", "timestamps               no"]),
        ("phone", ["lazily allocated memory  yes", "colour attachments       4"]),
    ] {
        let output = stage.run(Some(profile), &["doctor"]);
        let told = String::from_utf8_lossy(&output.stdout);
        for line in says {
            assert!(output.status.success() && told.contains(line), "{profile} has no line '{line}': {told}");
        }
    }
    let output = stage.run(Some("toaster"), &["render", "builtin:triangle", "--output", "-"]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(4), "{told}");
    assert!(told.contains("AFTERLIGHT_PLAYS is 'toaster', and the layer plays portability, least, phone"), "{told}");
}
