//! Commands that are killed while they write: old files stay whole, and the next run leaves nothing of the killed one behind.

use std::collections::BTreeSet;
use std::fs;
#[cfg(unix)]
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::failures_layer;
use crate::common::program::program;
use crate::common::tries_all;

/// A command, the file that it writes, and a check that the file is whole.
struct Writer {
    arguments: &'static [&'static str],
    file: &'static str,
    is_whole: fn(&[u8]) -> bool,
}

fn is_picture(bytes: &[u8]) -> bool {
    image::load_from_memory(bytes).is_ok()
}

fn is_json(bytes: &[u8]) -> bool {
    serde_json::from_slice::<serde_json::Value>(bytes).is_ok()
}

fn is_document(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.trim_end().ends_with("</svg>") || text.trim_end().ends_with("</html>")
}

fn is_xml(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| roxmltree::Document::parse(text).is_ok())
}

fn is_toml(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|text| text.contains("[settings]") && text.parse::<toml::Table>().is_ok())
}

/// A scene that can be exported.
const LAMBERT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mitsuba/lambert.toml");

const TUNE: [&str; 19] = [
    "tune",
    "builtin:triangle",
    "--max-error",
    "0.1",
    "--quick",
    "--rounds",
    "6",
    "--truth-samples",
    "4",
    "--cameras",
    "0",
    "--joint",
    "0",
    "--size",
    "32x18",
    "-o",
    "tuned.toml",
    "--quiet",
    "--restart",
];

fn is_csv(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.ends_with('\n') && text.lines().all(|line| line.split(',').count() == 3)
}

const WRITERS: [Writer; 16] = [
    Writer {
        arguments: &["render", "builtin:spheres", "--size", "320x180", "-o", "out.png"],
        file: "out.png",
        is_whole: is_picture,
    },
    Writer {
        arguments: &["render", "builtin:spheres", "--size", "320x180", "-o", "out.exr"],
        file: "out.exr",
        is_whole: is_picture,
    },
    Writer {
        arguments: &["reference", "builtin:spheres", "--size", "48x27", "--samples", "4", "-o", "truth.exr"],
        file: "truth.exr",
        is_whole: is_picture,
    },
    Writer {
        arguments: &["inspect", "builtin:spheres", "--graph", "frame.svg"],
        file: "frame.svg",
        is_whole: is_document,
    },
    Writer {
        arguments: &["bench", "builtin:triangle", "--size", "64x36", "--frames", "5", "--json", "bench.json"],
        file: "bench.json",
        is_whole: is_json,
    },
    Writer {
        arguments: &["stress", "space/detail", "--quick", "--json", "stress.json"],
        file: "stress.json",
        is_whole: is_json,
    },
    Writer {
        arguments: &["stress", "space/detail", "--quick", "--html", "stress.html"],
        file: "stress.html",
        is_whole: is_document,
    },
    Writer {
        arguments: &[
            "report",
            "builtin:triangle",
            "-o",
            "report",
            "--quick",
            "--families",
            "fxaa",
            "--joint",
            "0",
            "--size",
            "32x18",
            "--truth-samples",
            "4",
            "--rounds",
            "6",
            "--restart",
        ],
        file: "report/report.html",
        is_whole: is_document,
    },
    Writer { arguments: &["ci", "smoke", "--only", "compute", "-o", "ci"], file: "ci/results.csv", is_whole: is_csv },
    Writer {
        arguments: &["ci", "smoke", "--only", "compute", "-o", "ci", "--baseline", "known", "--bless"],
        file: "smoke.compute.png",
        is_whole: is_picture,
    },
    Writer { arguments: &TUNE, file: "tuned.toml", is_whole: is_toml },
    Writer {
        arguments: &["reference", LAMBERT, "--size", "48x27", "--export", "mitsuba"],
        file: "mitsuba/scene.xml",
        is_whole: is_xml,
    },
    Writer {
        arguments: &[
            "reference",
            "builtin:spheres",
            "--size",
            "48x27",
            "--samples",
            "4",
            "-o",
            "truth.exr",
            "--standard-error",
            "error.exr",
        ],
        file: "error.exr",
        is_whole: is_picture,
    },
    // Numbered pictures, one after another.
    Writer {
        arguments: &[
            "render",
            "builtin:triangle",
            "--path",
            "path.toml",
            "--fps",
            "8",
            "--samples",
            "1",
            "--size",
            "64x36",
            "-o",
            "walk.png",
        ],
        file: "walk-0008.png",
        is_whole: is_picture,
    },
    // Several scenes, with verdicts.
    Writer {
        arguments: &[
            "render",
            "builtin:triangle",
            "builtin:spheres",
            "--samples",
            "1",
            "--size",
            "64x36",
            "-o",
            "{name}.png",
            "--junit",
            "junit.xml",
        ],
        file: "junit.xml",
        is_whole: is_xml,
    },
    Writer {
        arguments: &["compare", "a.png", "b.png", "-o", "difference.png"],
        file: "difference.png",
        is_whole: is_picture,
    },
];

/// Writes the files that some of the commands read.
fn prepare(folder: &Path) {
    let keys = [0, 1].map(|second| format!("[[keys]]\ntime = {second}\nposition = [0, 0, {}]\n", second + 2));
    fs::write(folder.join("path.toml"), keys.concat()).expect("written");
    for (name, shade) in [("a.png", 0), ("b.png", 9)] {
        let picture = image::RgbImage::from_fn(320, 180, |x, y| image::Rgb([x as u8, y as u8, (x ^ y) as u8 ^ shade]));
        picture.save(folder.join(name)).expect("written");
    }
}

/// Removes the caches' own files, so that they are written again; files that killed commands have left there stay.
fn forget(folder: &Path) {
    for cache in ["truths", "pipelines"] {
        for entry in fs::read_dir(folder.join(cache)).into_iter().flatten().flatten() {
            let name = entry.file_name();
            if ["truth-", "pipelines-"].iter().any(|own| name.to_string_lossy().starts_with(own)) {
                fs::remove_file(entry.path()).expect("removed");
            }
        }
    }
}

fn command(folder: &Path, layer: &Path, writer: &Writer) -> Command {
    let mut command = program();
    // Lavapipe keeps nothing in its pipeline cache: the layer has something to keep.
    command.envs(failures_layer::environment(layer)).env("AFTERLIGHT_FAILURES", "cache:100000");
    command.current_dir(folder).args(writer.arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command.env("AFTERLIGHT_CACHE", folder.join("truths")).env("AFTERLIGHT_PIPELINE_CACHE", folder.join("pipelines"));
    command
}

/// All files below a folder, by their paths.
fn files(folder: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found
                .extend(files(&path).into_iter().map(|name| format!("{}/{name}", entry.file_name().to_string_lossy())));
        } else {
            found.insert(entry.file_name().to_string_lossy().into_owned());
        }
    }
    found
}

/// The age at which the next run takes unfinished files for those of a killed one.
const JUST_NOW: Duration = Duration::from_secs(2);

#[test]
#[cfg(unix)]
fn a_killed_command_leaves_old_files_whole_and_the_next_one_no_litter() {
    let (writers, moments) = if tries_all() { (&WRITERS[..], 50) } else { (&WRITERS[..1], 4) };
    let layer = failures_layer::folder();
    for writer in writers {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let what = writer.arguments.join(" ");
        prepare(folder.path());
        let begun = Instant::now();
        let status = command(folder.path(), layer.path(), writer).status().expect("the program starts");
        assert!(status.success(), "{what}: {status}");
        let took = begun.elapsed();
        let clean = files(folder.path());
        let result = clean.iter().find(|name| name.ends_with(writer.file)).expect("the result");
        let result = folder.path().join(result);
        // These commands make their folder anew: after a kill it may hold nothing.
        let may_go = ["report/", "ci/"].iter().any(|own| writer.file.starts_with(own));
        let mut random = fastrand::Rng::with_seed(7);
        let mut killed = 0;
        for _ in 0..moments {
            forget(folder.path());
            let mut child = command(folder.path(), layer.path(), writer).spawn().expect("the program starts");
            thread::sleep(took.mul_f64(random.f64()));
            child.kill().expect("a child can be killed");
            let status = child.wait().expect("it has ended");
            assert!(status.success() || status.signal() == Some(9), "{what}, after a killed one: {status}");
            killed += usize::from(!status.success());
            if let Ok(bytes) = fs::read(&result) {
                assert!((writer.is_whole)(&bytes), "{what}: half of {} is there", writer.file);
            } else {
                assert!(may_go, "{what}: {} is gone", writer.file);
            }
        }
        assert!(killed * 4 > moments, "{what}: only {killed} of {moments} were killed");
        eprintln!("{what}: {took:.2?}, {killed} of {moments} killed");
        thread::sleep(JUST_NOW + Duration::from_millis(200));
        forget(folder.path());
        let status = command(folder.path(), layer.path(), writer).status().expect("the program starts");
        assert!(status.success(), "{what}, after the others: {status}");
        let left: Vec<_> = files(folder.path()).difference(&clean).cloned().collect();
        assert!(left.is_empty(), "{what} leaves {left:?}");
        assert!((writer.is_whole)(&fs::read(&result).expect("the result")), "{what}");
    }
}
