//! Commands that are killed or interrupted while they write: old files stay whole, and the next run leaves nothing of the killed one behind.

use std::collections::BTreeSet;
use std::fs;
#[cfg(unix)]
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
#[cfg(unix)]
use std::process::Child;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::failures_layer;
use crate::common::program::program;
use crate::common::tries_all;
use crate::common::whole::{
    is_calibration, is_csv, is_document, is_glb, is_json, is_json_lines, is_picture, is_toml, is_xml,
};

/// A command, the file that it writes or how its name begins, and a check that the file is whole.
struct Writer {
    arguments: &'static [&'static str],
    file: &'static str,
    is_whole: fn(&[u8]) -> bool,
}

/// A scene that Mitsuba can be given.
const LAMBERT: &str = concat!(env!("AFTERLIGHT_ROOT"), "/tests/mitsuba/lambert.toml");

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

const WRITERS: [Writer; 20] = [
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
    Writer { arguments: &["export", "builtin:hall", "-o", "hall.glb"], file: "hall.glb", is_whole: is_glb },
    Writer {
        arguments: &["ci", "--mutants", "--only", r"\.geometry-to-lighting\..*\.plain$", "-o", "mutants"],
        file: "mutants/mutants.jsonl",
        is_whole: is_json_lines,
    },
    Writer {
        arguments: &[
            "render",
            "builtin:spheres",
            "--fxaa",
            "on",
            "--size",
            "64x36",
            "--output",
            "spheres.png",
            "--json",
            "verdicts.json",
        ],
        file: "verdicts.json",
        is_whole: is_json,
    },
    Writer { arguments: &["doctor", "--calibrate"], file: "figures/calibration-", is_whole: is_calibration },
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
    command.env("AFTERLIGHT_CALIBRATION", folder.join("figures"));
    command
}

/// A signal that ends a command.
#[cfg(unix)]
#[derive(Clone, Copy, Debug)]
enum Signal {
    Kill = 9,
    /// Ctrl-C.
    Interrupt = 2,
}

#[cfg(unix)]
impl Signal {
    fn send(self, child: &Child) {
        let number = format!("-{}", self as i32);
        let sent = Command::new("kill").args([&number, &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "a child can be sent a signal");
    }
}

/// Wraps the command so that Ctrl-C ends it: a shell without job control starts its background jobs, and with them this test, with SIGINT ignored.
#[cfg(unix)]
fn interruptible(command: &Command) -> Command {
    let mut hearing = Command::new("env");
    hearing.arg("--default-signal=INT").arg(command.get_program()).args(command.get_args());
    hearing.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    hearing.current_dir(command.get_current_dir().unwrap_or(Path::new(".")));
    hearing.stdout(Stdio::null()).stderr(Stdio::null());
    hearing
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

/// The age at which the next run takes unfinished files for a killed run's.
const JUST_NOW: Duration = Duration::from_secs(2);

#[test]
#[cfg(unix)]
fn a_killed_command_leaves_old_files_whole_and_the_next_one_no_litter() {
    let (writers, moments) = if tries_all() { (&WRITERS[..], 50) } else { (&WRITERS[..1], 4) };
    let layer = failures_layer::folder();
    writers.iter().for_each(|writer| stops(writer, moments, Signal::Kill, layer.path()));
}

#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_leaves_old_files_whole_and_the_next_command_no_litter() {
    let layer = failures_layer::folder();
    stops(&WRITERS[0], if tries_all() { 50 } else { 4 }, Signal::Interrupt, layer.path());
}

/// Seconds in which a writer is begun and stopped again and again; twice in any case.
#[cfg(unix)]
const STOPPING_SECONDS: f64 = 200.0;

/// Stops the writer's command `moments` times, or as often as the time allows, each time at a random moment.
#[cfg(unix)]
fn stops(writer: &Writer, moments: usize, signal: Signal, layer: &Path) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let what = writer.arguments.join(" ");
    prepare(folder.path());
    let begun = Instant::now();
    let status = command(folder.path(), layer, writer).status().expect("the program starts");
    assert!(status.success(), "{what}: {status}");
    let mut took = begun.elapsed();
    let clean = files(folder.path());
    let result = clean.iter().find(|name| name.contains(writer.file)).expect("the result");
    let result = folder.path().join(result);
    // These commands make their folder anew: after a kill it may hold nothing.
    let may_go = ["report/", "ci/", "mutants/"].iter().any(|own| writer.file.starts_with(own));
    let moments = moments.min((STOPPING_SECONDS / took.as_secs_f64()) as usize).max(2);
    let mut random = fastrand::Rng::with_seed(7);
    let mut stopped = 0;
    for _ in 0..moments {
        forget(folder.path());
        let mut command = command(folder.path(), layer, writer);
        if matches!(signal, Signal::Interrupt) {
            command = interruptible(&command);
        }
        let begun = Instant::now();
        let mut child = command.spawn().expect("the program starts");
        thread::sleep(took.mul_f64(random.f64()));
        signal.send(&child);
        let status = child.wait().expect("it has ended");
        assert!(status.success() || status.signal() == Some(signal as i32), "{what}, {signal:?}: {status}");
        if status.success() {
            // Faster than the first, which found no compiled shaders in the driver's cache.
            took = took.min(begun.elapsed());
        } else {
            stopped += 1;
        }
        if let Ok(bytes) = fs::read(&result) {
            assert!((writer.is_whole)(&bytes), "{what}: half of {} is there", writer.file);
        } else {
            assert!(may_go, "{what}: {} is gone", writer.file);
        }
    }
    assert!(stopped * 4 > moments, "{what}: only {stopped} of {moments} were stopped");
    eprintln!("{what}: {took:.2?}, {stopped} of {moments} stopped");
    thread::sleep(JUST_NOW + Duration::from_millis(200));
    forget(folder.path());
    let status = command(folder.path(), layer, writer).status().expect("the program starts");
    assert!(status.success(), "{what}, after the others: {status}");
    let left: Vec<_> = files(folder.path()).difference(&clean).cloned().collect();
    assert!(left.is_empty(), "{what} leaves {left:?}");
    assert!((writer.is_whole)(&fs::read(&result).expect("the result")), "{what}");
}

/// Children of a run end with it, though the terminal alone would have told them, too.
#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_ends_the_cases_of_ci_with_it_and_the_next_run_leaves_no_litter() {
    let suite = r#"
[defaults]
settings = "size=32x18"
identical = 1

[[case]]
group = "good"
scene = "builtin:triangle"
each = { first = "" }

[[case]]
group = "long"
scene = "builtin:triangle"
steady_frames = 100000000
each = { a = "", b = "" }
"#;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("own.toml"), suite).expect("written");
    let run = |arguments: &[&str]| {
        let mut command = program();
        command.current_dir(folder.path()).args(["ci", "own.toml", "-o", "out", "--jobs", "2"]).args(arguments);
        interruptible(&command)
    };
    let clean = ["--only", "first"];
    let status = run(&clean).status().expect("the program starts");
    assert!(status.success(), "{status}");
    let before = files(folder.path());
    let mut child = run(&[]).spawn().expect("the program starts");
    let begun = Instant::now();
    // The first case is done, and the others draw.
    let draws =
        |case: &str| fs::read(at("out/cases").join(case).join("last-label.txt")).is_ok_and(|own| !own.is_empty());
    while !(draws("long.a") && draws("long.b")) {
        assert!(begun.elapsed() < Duration::from_secs(120), "its cases do not draw");
        assert!(child.try_wait().expect("it can be waited for").is_none(), "it has ended");
        thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(processes_in(folder.path()), 3, "a run and two cases");
    Signal::Interrupt.send(&child);
    let status = child.wait().expect("it has ended");
    assert_eq!(status.signal(), Some(2), "{status}");
    let begun = Instant::now();
    while processes_in(folder.path()) > 0 {
        assert!(begun.elapsed() < Duration::from_secs(10), "{} cases go on", processes_in(folder.path()));
        thread::sleep(Duration::from_millis(20));
    }
    assert!(is_json_lines(&fs::read(at("out/results.jsonl")).expect("results so far")));
    assert!(!at("out/results.csv").exists() && !at("out/junit.xml").exists(), "results of the run before are there");
    for name in files(folder.path()) {
        let is_whole = match Path::new(&name).extension().and_then(|extension| extension.to_str()) {
            Some("png") => is_picture as fn(&[u8]) -> bool,
            Some("json") => is_json,
            Some("xml") => is_xml,
            _ => continue,
        };
        assert!(is_whole(&fs::read(at(&name)).expect("read")), "half of {name} is there");
    }
    thread::sleep(JUST_NOW + Duration::from_millis(200));
    let status = run(&clean).status().expect("the program starts");
    assert!(status.success(), "{status}");
    assert_eq!(files(folder.path()), before);
}

/// Processes that were started in a folder.
#[cfg(target_os = "linux")]
fn processes_in(folder: &Path) -> usize {
    let folder = folder.canonicalize().expect("a folder");
    let all = fs::read_dir("/proc").expect("processes").filter_map(|entry| Some(entry.ok()?.path()));
    all.filter(|process| fs::read_link(process.join("cwd")).is_ok_and(|own| own == folder)).count()
}
