//! `afterlight ci` from outside: verdicts, exit codes, bundles and baselines, and processes that are killed.

mod shipped;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::failures_layer;
use crate::common::program::{program, runner, start};

const SUITE: &str = r#"
[defaults]
settings = "size=32x18"

[[case]]
group = "good"
scene = "builtin:triangle"
flip = 0
each = { forward = "light-path=forward", loop = "light-path=loop" }

[[case]]
group = "bad"
scene = "builtin:triangle"
truth = { mean = 0, elsewhere = 0 }
each = { truth = "light-path=forward brdf=phong" }

[[case]]
group = "bad"
scene = "builtin:triangle"
identical = 1
steady_frames = 100000000
timeout = 0.5
each = { slow = "" }

[[case]]
group = "bad"
scene = "missing.toml"
each = { missing = "" }
"#;

fn ci(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = program();
    command.current_dir(folder).arg("ci").args(arguments);
    command.output().expect("the program starts")
}

/// Statuses by case.
fn results(path: &Path) -> BTreeMap<String, String> {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let field = |line: &str, index| line.split(',').nth(index).unwrap_or_default().to_owned();
    text.lines().map(|line| (field(line, 0), field(line, 1))).collect()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Has a shell run a line that the program printed, with the variables that are in it, on the tests' Vulkan stack.
#[cfg(unix)]
fn typed(folder: &Path, line: &str) -> Output {
    let own = program();
    let own: Vec<_> =
        [own.get_program()].into_iter().chain(own.get_args()).map(|word| word.to_string_lossy()).collect();
    // The function below starts the program by the runner of the tests already.
    let runner = runner().map_or_else(String::new, |runner| format!("{} ", runner.display()));
    let line = line.replace(&format!("{runner}afterlight"), "afterlight");
    let script = format!("afterlight() {{ \"{}\" \"$@\"; }}\n{line}", own.join("\" \""));
    let mut shell = Command::new("bash");
    shell.current_dir(folder).env("AFTERLIGHT_CALIBRATION", "").args(["-c", &script]);
    shell.output().expect("a shell")
}

#[test]
#[cfg(unix)]
fn each_case_has_its_verdict_and_what_is_known_is_expected() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("own.toml"), SUITE).expect("written");

    let first = ci(folder.path(), &["own.toml", "-o", "first"]);
    assert_eq!(code(&first), Some(1), "{}", errors(&first));
    let found = results(&at("first/results.csv"));
    let expected = [
        ("bad.missing", "Fail"),
        ("bad.slow", "Timeout"),
        ("bad.truth", "Fail"),
        ("good.forward", "Pass"),
        ("good.loop", "Pass"),
    ];
    assert_eq!(found, expected.map(|(case, status)| (case.to_owned(), status.to_owned())).into());
    assert!(errors(&first).contains("worse than expected: bad.truth, bad.slow, bad.missing"), "{}", errors(&first));
    assert_eq!(results(&at("first/failures.csv")).len(), 3);
    let bundle = at("first/bundles/bad.truth");
    for name in
        ["suite.toml", "plan.txt", "device.json", "environment.txt", "picture.png", "truth.png", "reproduce.txt"]
    {
        assert!(bundle.join(name).exists(), "{name} is not in the bundle");
    }
    let files = fs::read_dir(bundle.join("shaders")).expect("shaders").map(|file| file.expect("a file").path());
    let spirv = files.filter(|path| path.extension().is_some_and(|extension| extension == "spv"));
    let words: Vec<_> = spirv.map(|path| fs::read(path).expect("readable")[..4].to_vec()).collect();
    assert!(words.len() > 1 && words.iter().all(|start| start[..] == 0x0723_0203u32.to_le_bytes()), "{words:?}");
    let xml = fs::read_to_string(at("first/junit.xml")).expect("JUnit");
    let suites = roxmltree::Document::parse(&xml).expect("XML").root_element().attribute("tests").map(str::to_owned);
    assert_eq!(suites.as_deref(), Some("5"));

    let again = program().current_dir(folder.path()).args(["ci", "--repro", "first/bundles/bad.truth"]).output();
    let again = again.expect("the program starts");
    assert_eq!(code(&again), Some(1), "{}", errors(&again));
    assert!(errors(&again).contains("bad.truth: Fail: truth"), "{}", errors(&again));
    // Neither does a case that takes too long go on for ever when it is tried again.
    let again = program().current_dir(folder.path()).args(["ci", "--repro", "first/bundles/bad.slow"]).output();
    let again = again.expect("the program starts");
    assert_eq!(code(&again), Some(1), "{}", errors(&again));
    assert!(errors(&again).contains("bad.slow: Timeout: stopped after 0.5 s"), "{}", errors(&again));

    // The run that blesses is as expected itself, and so is the next.
    for arguments in [&["--bless"][..], &["--since", "first"]] {
        let run = ci(folder.path(), &[&["own.toml", "-o", "next", "--baseline", "known"][..], arguments].concat());
        assert_eq!(code(&run), Some(0), "{arguments:?}: {}", errors(&run));
        let told = String::from_utf8_lossy(&run.stdout);
        let line = "3 cases have no `flip`: their pictures were not compared with the baseline's\n";
        assert_eq!(told.contains(line), arguments != ["--bless"], "{told}");
        let found = results(&at("next/results.csv"));
        assert_eq!((found["bad.truth"].as_str(), found["bad.slow"].as_str()), ("ExpectedFail", "ExpectedFail"));
    }
    let summary = fs::read_to_string(at("next/summary.md")).expect("a summary");
    assert!(summary.contains("- bad.truth: Fail before, ExpectedFail now"), "{summary}");

    // Another picture than the baseline's is a failure, and a case that does not fail any more an improvement.
    let known = only_folder(&only_folder(&at("known")));
    let (picture, other) = (known.join("good.loop.png"), image::RgbImage::from_pixel(32, 18, image::Rgb([255, 0, 0])));
    let kept = fs::read(&picture).expect("the baseline's picture");
    // A case that fails by another check has the baseline's picture and the truth in its bundle all the same.
    fs::write(known.join("bad.truth.png"), &kept).expect("written");
    let run = ci(folder.path(), &["own.toml", "-o", "next", "--baseline", "known", "--only", "truth"]);
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    for name in ["picture.png", "baseline.png", "difference.png", "truth.png", "truth-difference.png"] {
        assert!(at("next/bundles/bad.truth").join(name).exists(), "{name} is not in the bundle");
    }
    other.save(&picture).expect("written");
    let only = ["own.toml", "-o", "next", "--baseline", "known", "--only", "^good"];
    let run = ci(folder.path(), &only);
    assert_eq!(code(&run), Some(1), "{}", errors(&run));
    let bundle = at("next/bundles/good.loop");
    assert!(bundle.join("baseline.png").exists() && bundle.join("difference.png").exists());
    // A bundle that was moved, and whose baseline is gone, has the same verdict by the line that is in it.
    fs::create_dir(at("sent")).expect("made");
    fs::rename(&bundle, at("sent/a bundle")).expect("moved");
    fs::rename(at("known"), at("gone")).expect("moved");
    let line = fs::read_to_string(at("sent/a bundle/reproduce.txt")).expect("a line");
    let again = typed(&at("sent/a bundle"), line.lines().last().expect("it is the last"));
    assert_eq!(code(&again), Some(1), "{line}: {}", errors(&again));
    assert!(errors(&again).contains("good.loop: Fail: picture: FLIP "), "{}", errors(&again));
    assert!(!errors(&again).contains("the bundle's verdict"), "{}", errors(&again));
    fs::rename(at("gone"), at("known")).expect("moved back");
    // Blessing compares with no picture that it replaces.
    for (arguments, expected) in [(&["--bless"][..], 0), (&[], 0)] {
        let run = ci(folder.path(), &[&only[..], arguments].concat());
        assert_eq!(code(&run), Some(expected), "{arguments:?}: {}", errors(&run));
    }
    other.save(&picture).expect("written");
    fs::write(&picture, kept).expect("written");
    fs::write(known.join("failures.csv"), "good.loop,Fail\n").expect("written");
    let run = ci(folder.path(), &only);
    assert_eq!(code(&run), Some(2), "{}", errors(&run));
    assert!(!String::from_utf8_lossy(&run.stdout).contains("no `flip`"), "all that were tried have it");
    assert_eq!(results(&at("next/results.csv"))["good.loop"], "UnexpectedImprovement(Pass)");
}

#[test]
fn pictures_that_are_said_to_be_alike_and_are_not_fail() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let suite = r#"
[[case]]
group = "alike"
scene = "builtin:triangle"
settings = "size=32x18"
alike = "fxaa=on"
each = { same = "fxaa=on", other = "fxaa=off" }
"#;
    fs::write(folder.path().join("own.toml"), suite).expect("written");
    let run = ci(folder.path(), &["own.toml", "-o", "out"]);
    assert_eq!(code(&run), Some(1), "{}", errors(&run));
    let found = results(&folder.path().join("out/results.csv"));
    assert_eq!((found["alike.same"].as_str(), found["alike.other"].as_str()), ("Pass", "Fail"));
    assert!(folder.path().join("out/bundles/alike.other/picture-alike.png").exists());
    let told = fs::read_to_string(folder.path().join("out/junit.xml")).expect("JUnit");
    assert!(told.contains("the picture of fxaa=on differs in "), "{told}");
}

/// A driver may crash at the very end, after a verdict; and folders of others stay.
#[test]
#[cfg(unix)]
fn a_crash_after_the_verdict_is_a_crash_and_folders_of_others_stay() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("own.toml"), SUITE).expect("written");
    let start = runner().map_or_else(String::new, |runner| format!("{} ", runner.display()));
    fs::write(at("after.sh"), format!("#!/bin/sh\n{start}\"$@\"\ncase \"$*\" in *--case*) kill -SEGV $$ ;; esac\n"))
        .expect("written");
    fs::set_permissions(at("after.sh"), fs::Permissions::from_mode(0o755)).expect("executable");
    let script = at("after.sh").display().to_string();
    let mut command = program();
    command.current_dir(folder.path());
    command.args(["ci", "own.toml", "-o", "out", "--only", "good.loop", "--quiet", "--runner", &script]);
    let run = command.output().expect("the program starts");
    assert_eq!(code(&run), Some(1), "{}", errors(&run));
    assert_eq!(results(&at("out/results.csv"))["good.loop"], "Crash");
    let lines = fs::read_to_string(at("out/results.jsonl")).expect("JSON lines");
    assert!(lines.contains("ended after the verdict Pass"), "{lines}");

    fs::create_dir_all(at("mine/cases")).expect("made");
    fs::write(at("mine/cases/precious.toml"), "x").expect("written");
    let run = ci(folder.path(), &["own.toml", "-o", "mine", "--only", "good.loop"]);
    assert_eq!(code(&run), Some(3), "{}", errors(&run));
    assert!(at("mine/cases/precious.toml").exists());
}

fn only_folder(path: &Path) -> std::path::PathBuf {
    let mut folders = fs::read_dir(path).expect("a folder").map(|entry| entry.expect("an entry").path());
    folders.next().expect("one folder")
}

#[test]
fn shards_and_skips_leave_cases_out_and_wrong_words_end_with_3() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), SUITE).expect("written");
    fs::write(folder.path().join("skips.txt"), "# slow ones\nbad\\..*\n").expect("written");
    let list = |arguments: &[&str]| {
        let output = ci(folder.path(), &[&["own.toml", "--list"], arguments].concat());
        assert_eq!(code(&output), Some(0), "{}", errors(&output));
        String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let parts: Vec<_> = ["1/2", "2/2"].iter().flat_map(|shard| list(&["--shard", shard])).collect();
    assert_eq!(parts.len(), 5);
    assert_eq!(list(&["--only", "loop$"]), ["good.loop"]);
    let run = ci(folder.path(), &["own.toml", "-o", "out", "--skips", "skips.txt", "--quiet"]);
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    let found = results(&folder.path().join("out/results.csv"));
    assert_eq!((found["bad.slow"].as_str(), found["good.loop"].as_str()), ("Skip", "Pass"));
    assert!(!folder.path().join("out/bundles").exists() && !folder.path().join("out/cases").exists());
    for wrong in [&["nowhere.toml", "-o", "out"][..], &["--no-such-option"], &["smoke"], &["own.toml", "--case", "a.b"]]
    {
        let output = ci(folder.path(), wrong);
        assert_eq!(code(&output), Some(3), "{wrong:?}: {}", errors(&output));
    }
}

/// A process of a case that takes long is killed: for good it is a crash, once it is a flake.
#[test]
#[cfg(target_os = "linux")]
fn a_killed_case_is_a_crash_and_one_that_then_passes_a_flake() {
    let suite = r#"
[[case]]
group = "long"
scene = "builtin:triangle"
settings = "size=32x18"
identical = 1
steady_frames = 100000000
each = { killed = "" }

[[case]]
group = "long"
scene = "builtin:triangle"
settings = "size=32x18"
identical = 1
steady_frames = 1000
each = { flaky = "" }

[[case]]
group = "good"
scene = "builtin:triangle"
settings = "size=32x18"
each = { triangle = "" }
"#;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("own.toml");
    fs::write(&path, suite).expect("written");
    let mut command = program();
    command.current_dir(folder.path()).args(["ci", "own.toml", "-o", "out", "--jobs", "1", "--quiet"]);
    let mut run = command.spawn().expect("the program starts");
    let cases = folder.path().join("out/cases");
    let begun = Instant::now();
    let mut killed = 0;
    let status = loop {
        assert!(begun.elapsed() < Duration::from_secs(120), "it does not end");
        if let Some(status) = run.try_wait().expect("it can be waited for") {
            break status;
        }
        // Once it draws, so that its last label is known.
        for name in ["long.killed", "long.killed.again", "long.flaky"] {
            let label = fs::read_to_string(cases.join(name).join("last-label.txt")).unwrap_or_default();
            if !label.trim().is_empty() {
                killed += usize::from(kill(&cases.join(name)));
            }
        }
        thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(1));
    assert!(killed >= 3, "{killed}");
    let found = results(&folder.path().join("out/results.csv"));
    assert_eq!(found["long.killed"], "Crash");
    assert_eq!(found["long.flaky"], "Flake");
    assert_eq!(found["good.triangle"], "Pass");
    let lines = fs::read_to_string(folder.path().join("out/results.jsonl")).expect("JSON lines");
    let crash = lines.lines().find(|line| line.contains("long.killed")).expect("a line");
    let report: serde_json::Value = serde_json::from_str(crash).expect("JSON");
    let reason = report["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("signal: 9") && reason.contains("after the label "), "{reason}");
    assert!(!report["driver"].as_str().unwrap_or_default().is_empty(), "{report}");
}

/// A case that passes, with a bound on its time, and one that fails.
const JUDGED: &str = r#"
[defaults]
settings = "size=32x18"
identical = 1

[[case]]
group = "good"
scene = "builtin:triangle"
slower = 3
each = { timed = "" }

[[case]]
group = "bad"
scene = "missing.toml"
each = { missing = "" }
"#;

/// Findings of the only case in `out`.
fn findings(folder: &Path) -> Vec<serde_json::Value> {
    let lines = fs::read_to_string(folder.join("out/results.jsonl")).expect("JSON lines");
    let report: serde_json::Value = serde_json::from_str(lines.trim()).expect("one case");
    report["findings"].as_array().expect("findings").clone()
}

#[test]
fn a_frame_that_takes_longer_than_the_baseline_allows_fails_and_the_figure_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), JUDGED).expect("written");
    let timed = ["own.toml", "-o", "out", "--baseline", "known", "--only", "timed"];
    let run = ci(folder.path(), &[&timed[..], &["--jobs", "1", "--bless"]].concat());
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    let times = only_folder(&only_folder(&folder.path().join("known"))).join("times.csv");
    let own = fs::read_to_string(&times).expect("times");
    let Some(own) = own.trim().strip_prefix("good.timed,") else {
        return eprintln!("SKIPPED: the device measures no times");
    };
    assert!(own.parse::<f64>().is_ok_and(|ms| ms > 0.0), "{own}");
    for (ms, jobs, expected, outcome, told) in [
        ("1000000", "1", 0, "held", " times the baseline's; at most 3"),
        ("0.000001", "1", 1, "failed", " times the baseline's; at most 3"),
        // Others may use the device meanwhile.
        ("0.000001", "2", 0, "skipped", "--jobs 1"),
    ] {
        fs::write(&times, format!("good.timed,{ms}\n")).expect("written");
        let run = ci(folder.path(), &[&timed[..], &["--jobs", jobs]].concat());
        assert_eq!(code(&run), Some(expected), "{ms}: {}", errors(&run));
        let found = findings(folder.path());
        let time = found.iter().find(|own| own["check"] == "time").unwrap_or_else(|| panic!("{found:?}"));
        assert_eq!(time["outcome"], outcome, "{time}");
        let detail = time["detail"].as_str().unwrap_or_default();
        assert!(detail.contains(told), "{detail}");
        if let Some((now, rest)) = detail.split_once(" ms a frame on the device, ") {
            let ratio: f64 = rest.split(' ').next().unwrap_or_default().parse().expect("a ratio");
            let now: f64 = now.parse().expect("milliseconds");
            let bound: f64 = ms.parse().expect("milliseconds");
            // Each is rounded: the one to a microsecond, the other to a hundredth.
            assert!((ratio - now / bound).abs() <= 0.0005 / bound + 0.005, "{detail}");
        }
    }
}

#[test]
fn the_summary_is_added_to_that_of_a_github_step_and_costs_no_verdict() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("own.toml"), JUDGED).expect("written");
    fs::write(at("step.md"), "# Before\n").expect("written");
    let run = |step: &Path| {
        let mut command = program();
        command.current_dir(folder.path()).args(["ci", "own.toml", "-o", "out", "--quiet"]);
        command.env("GITHUB_STEP_SUMMARY", step).output().expect("the program starts")
    };
    let first = run(&at("step.md"));
    assert_eq!(code(&first), Some(1), "{}", errors(&first));
    let summary = fs::read_to_string(at("out/summary.md")).expect("a summary");
    assert!(summary.contains("bad.missing"), "{summary}");
    assert_eq!(fs::read_to_string(at("step.md")).expect("the step's"), format!("# Before\n{summary}"));
    // A folder cannot be added to.
    let second = run(&at("out"));
    assert_eq!(code(&second), Some(1), "{}", errors(&second));
    assert!(errors(&second).contains("warning: cannot write "), "{}", errors(&second));
}

#[test]
fn a_case_that_a_file_of_flakes_names_may_fail() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("own.toml"), JUDGED).expect("written");
    fs::write(at("flakes.txt"), "# now and then\nbad\\..*\n").expect("written");
    fs::write(at("others.txt"), "bad.missing.too\n").expect("written");
    let judged = |flakes: &str| {
        let run = ci(folder.path(), &["own.toml", "-o", "out", "--flakes", flakes]);
        let found = results(&at("out/results.csv"));
        (code(&run), found["bad.missing"].clone(), found["good.timed"].clone())
    };
    assert_eq!(judged("flakes.txt"), (Some(0), "KnownFlake".into(), "Pass".into()));
    assert_eq!(judged("others.txt"), (Some(1), "Fail".into(), "Pass".into()));
    // A device's folder in the baseline has a separate file of flakes.
    let run = ci(folder.path(), &["own.toml", "-o", "out", "--baseline", "known", "--bless", "--only", "good"]);
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    let known = only_folder(&only_folder(&at("known")));
    fs::rename(at("flakes.txt"), known.join("flakes.txt")).expect("moved");
    let run = ci(folder.path(), &["own.toml", "-o", "out", "--baseline", "known"]);
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    assert_eq!(results(&at("out/results.csv"))["bad.missing"], "KnownFlake");
    assert!(at("out/bundles/bad.missing").exists(), "its bundle is kept");
}

/// The layer speaks where its variable asks for advice, which nobody here has asked for: every version has some about the view of triangles.
#[test]
#[cfg(target_os = "linux")]
fn messages_of_the_layer_outlive_a_case_that_is_killed() {
    let suite = r#"
[defaults]
settings = "size=32x18 view=triangle"
identical = 1
validate = ["sync"]

[[case]]
group = "long"
scene = "builtin:hall"
settings = "size=1280x720 view=triangle"
each = { killed = "" }

[[case]]
group = "short"
scene = "builtin:triangle"
each = { spoken = "" }
"#;
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), suite).expect("written");
    let mut command = program();
    command.current_dir(folder.path()).args(["ci", "own.toml", "-o", "out", "--jobs", "1", "--quiet"]);
    command.env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT");
    let mut run = command.spawn().expect("the program starts");
    let (cases, begun) = (folder.path().join("out/cases"), Instant::now());
    let status = loop {
        assert!(begun.elapsed() < Duration::from_secs(120), "it does not end");
        if let Some(status) = run.try_wait().expect("it can be waited for") {
            break status;
        }
        for name in ["long.killed", "long.killed.again"] {
            let log = fs::read_to_string(cases.join(name).join("layer-sync.log"));
            if log.is_ok_and(|log| log.contains("BestPractices-")) {
                kill(&cases.join(name));
            }
        }
        thread::sleep(Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(1));
    let found = results(&folder.path().join("out/results.csv"));
    assert_eq!((found["long.killed"].as_str(), found["short.spoken"].as_str()), ("Crash", "Fail"));
    for name in ["long.killed", "short.spoken"] {
        let log = fs::read_to_string(folder.path().join("out/bundles").join(name).join("layer-sync.log"));
        let log = log.unwrap_or_else(|error| panic!("{name}: {error}"));
        let said = log.lines().filter(|line| line.starts_with("Warning (") && line.contains("BestPractices-"));
        assert!(said.count() > 0, "{name}: {log}");
    }
    // A silent layer leaves no file, and no empty one.
    let mut command = program();
    command.current_dir(folder.path()).args(["ci", "own.toml", "--case", "short.spoken", "-o", "silent", "--quiet"]);
    let run = command.output().expect("the program starts");
    assert_eq!(code(&run), Some(0), "{}", errors(&run));
    assert!(folder.path().join("silent/picture.png").exists());
    // Layers from 1.4.309 on have something to say of the system.
    let log = fs::read_to_string(folder.path().join("silent/layer-sync.log"));
    if let Ok(log) = log {
        assert!(log.contains(" (General) ") && !log.contains("(Validation)"), "{log}");
    }
}

/// Kills the process that was given this folder. Returns true if there was one.
#[cfg(target_os = "linux")]
fn kill(folder: &Path) -> bool {
    let Ok(processes) = fs::read_dir("/proc") else { return false };
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_told = |id: &str| {
        let words = fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        let words: Vec<_> = words.split(|byte| *byte == 0).map(String::from_utf8_lossy).collect();
        let is_here = fs::read_link(format!("/proc/{id}/cwd")).is_ok_and(|cwd| folder.starts_with(cwd));
        is_here
            && words.iter().any(|word| word == "--case")
            && words.iter().any(|word| word.ends_with(&format!("/{name}")))
    };
    let ids = processes.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let told: Vec<_> = ids.filter(|id| id.bytes().all(|byte| byte.is_ascii_digit()) && is_told(id)).collect();
    told.iter().any(|id| Command::new("kill").args(["-KILL", id]).status().is_ok_and(|status| status.success()))
}

#[test]
fn gtest_lists_and_runs_as_googletest_does() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("own.toml");
    fs::write(&path, SUITE).expect("written");
    let run = |arguments: &[&str]| {
        let output = start(Path::new(env!("CARGO_BIN_EXE_afterlight-gtest")))
            .env("AFTERLIGHT_SUITE", &path)
            .args(arguments)
            .output();
        let output = output.expect("the program starts");
        (code(&output), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (ended, list) = run(&["--gtest_list_tests"]);
    assert_eq!((ended, list.as_str()), (Some(0), "good.\n  forward\n  loop\nbad.\n  truth\n  slow\n  missing\n"));
    let (ended, text) = run(&["--gtest_filter=good.loop:bad.missing"]);
    assert_eq!(ended, Some(1), "{text}");
    let lines: Vec<_> =
        text.lines().filter(|line| line.contains("good.loop") || line.contains("] bad.missing")).collect();
    assert_eq!((lines[0], lines[2]), ("[ RUN      ] good.loop", "[ RUN      ] bad.missing"));
    assert!(
        lines[1].starts_with("[       OK ] good.loop (") && lines[3].starts_with("[  FAILED  ] bad.missing ("),
        "{text}"
    );
}

/// Each failure that the layer of `tests/failures-layer` causes has a separate verdict.
#[test]
fn a_lost_device_and_a_lack_of_memory_are_told_apart() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), SUITE).expect("written");
    let layer = failures_layer::folder();
    // ANCHOR: failures
    for (failure, verdict, status) in [
        ("vkQueueSubmit:2:ERROR_DEVICE_LOST", "Lost", "Crash"),
        ("vkCreateBuffer:1:ERROR_OUT_OF_DEVICE_MEMORY", "OutOfMemory", "Fail"),
    ] {
        let mut command = program();
        command.current_dir(folder.path()).args(["ci", "own.toml", "-o", "out", "--only", "good.loop", "--quiet"]);
        command.envs(failures_layer::environment(layer.path())).env("AFTERLIGHT_FAILURES", failure);
        // ANCHOR_END: failures
        let output = command.output().expect("the program starts");
        assert_eq!(code(&output), Some(1), "{failure}: {}", errors(&output));
        assert_eq!(results(&folder.path().join("out/results.csv"))["good.loop"], status, "{failure}");
        let line = fs::read_to_string(folder.path().join("out/results.jsonl")).expect("JSON lines");
        let report: serde_json::Value = serde_json::from_str(line.trim()).expect("JSON");
        assert_eq!(report["verdict"], verdict, "{report}");
        let command = failure.split(':').next().unwrap_or_default();
        assert!(report["reason"].as_str().is_some_and(|reason| reason.contains(command)), "{report}");
    }
}

/// Soaks a scene with little to draw. The unit tests of the curve show growth, which the rule sees.
#[test]
fn a_soak_passes_and_leaves_its_curve() {
    let suite = r#"
[[case]]
group = "soak"
scene = "builtin:spheres?columns=2&rows=1"
settings = "size=16x9 shadow-size=64 fog-froxels=4x4x4"
identical = 1
soak = { frames = 300, changes_every = 10, seed = 1 }
each = { spheres = "" }
"#;
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), suite).expect("written");
    let run = ci(folder.path(), &["own.toml", "-o", "out"]);
    assert_eq!(code(&run), Some(0), "{}{}", String::from_utf8_lossy(&run.stdout), errors(&run));
    let line = fs::read_to_string(folder.path().join("out/results.jsonl")).expect("JSON lines");
    let report: serde_json::Value = serde_json::from_str(line.trim()).expect("JSON");
    let details: Vec<_> =
        report["findings"].as_array().expect("findings").iter().map(|own| own["detail"].to_string()).collect();
    for part in
        ["at home all 13 pictures are equal", "memory of objects on the device went from", "objects on the device"]
    {
        assert!(details.iter().any(|detail| detail.contains(part)), "{part}: {details:?}");
    }
    let curve = fs::read_to_string(folder.path().join("out/curves/soak.spheres.csv")).expect("a curve");
    let frames: Vec<u32> = curve
        .lines()
        .skip(1)
        .map(|line| line.split(',').next().unwrap_or_default().parse().expect("a number"))
        .collect();
    assert_eq!((frames.len(), frames[0]), (13, 8), "{curve}");
    assert!(frames.is_sorted() && frames[12] >= 300, "{curve}");
}

/// Mutants of one dependency of the smallest frames, on the layer at hand: nothing is unexpected, and the layer notices some and misses some.
#[test]
fn mutants_test_the_layer_and_shards_of_them_are_all_of_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mutants = |arguments: &[&str]| {
        let only = ["--mutants", "--only", r"\.geometry-to-lighting\..*\.plain$"];
        ci(folder.path(), &[&only[..], arguments].concat())
    };
    let all = mutants(&["-o", "all"]);
    assert_eq!(code(&all), Some(0), "{}", errors(&all));
    let found = results(&folder.path().join("all/results.csv"));
    assert_eq!(found["mutants.geometry-to-lighting.row.plain"], "Pass");
    assert_eq!(found["mutants.geometry-to-lighting.after.EARLY_FRAGMENT_TESTS.plain"], "ExpectedFail");
    assert!(found.values().all(|status| ["Pass", "ExpectedFail"].contains(&status.as_str())), "{found:?}");
    let page = fs::read_to_string(folder.path().join("all/mutants.md")).expect("a page");
    let row = "| `geometry-to-lighting` | row | 1 |";
    assert!(page.contains(row) && page.contains("## Reasons\n\n1. "), "{page}");
    let lines = fs::read_to_string(folder.path().join("all/mutants.jsonl")).expect("JSON lines");
    for line in lines.lines() {
        let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert!(line["must_follow"].as_array().is_some_and(|kinds| !kinds.is_empty()), "nothing is lost: {line}");
        assert_eq!(line["why"].is_string(), line["verdict"] == "ExpectedFail", "{line}");
    }
    let mut parts = BTreeMap::new();
    for part in ["1/2", "2/2"] {
        let run = mutants(&["-o", "part", "--shard", part]);
        assert_eq!(code(&run), Some(0), "{}", errors(&run));
        parts.extend(results(&folder.path().join("part/results.csv")));
    }
    assert_eq!(parts, found);
    let nothing = ci(folder.path(), &["--mutants", "--only", "no-such-row"]);
    assert_eq!(code(&nothing), Some(3), "{}", errors(&nothing));
}
