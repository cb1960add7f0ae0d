//! The program when a call fails: it prints one line, ends with its exit code, and leaves old files and wholly written new ones intact.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use afterlight::gpu::vk;
use afterlight_failures_layer::{OF_THE_LOADER, PRE_INSTANCE, commands};
use tempfile::TempDir;

use crate::common::failures_layer::{environment, folder, implicit_environment};
use crate::common::program::program;
use crate::common::whole::{is_json, is_picture};

#[test]
fn the_program_ends_with_one_line_and_its_exit_code_and_leaves_the_old_picture_whole() {
    let layers = folder();
    for (words, code, part) in [
        ("vkCreateInstance:1:ERROR_INCOMPATIBLE_DRIVER", 4, "no usable Vulkan driver"),
        (
            "vkCreateDevice:1:ERROR_INITIALIZATION_FAILED",
            4,
            "by vkCreateDevice: Vulkan says ERROR_INITIALIZATION_FAILED",
        ),
        ("vkCreateImage:1:ERROR_OUT_OF_DEVICE_MEMORY", 3, "by vkCreateImage: out of memory"),
        ("vkQueueSubmit:2:ERROR_DEVICE_LOST", 4, "by vkQueueSubmit: the device is lost"),
        ("vkEndCommandBuffer:3:ERROR_OUT_OF_HOST_MEMORY", 3, "by vkEndCommandBuffer: out of memory"),
        (
            "incoherent,vkFlushMappedMemoryRanges:2:ERROR_OUT_OF_DEVICE_MEMORY",
            3,
            "by vkFlushMappedMemoryRanges: out of memory",
        ),
        (
            "incoherent,vkInvalidateMappedMemoryRanges:1:ERROR_OUT_OF_HOST_MEMORY",
            3,
            "by vkInvalidateMappedMemoryRanges: out of memory",
        ),
    ] {
        ends_with_one_line(environment(layers.path()), words, code, part);
    }
}

/// Draws over an old picture, in an environment with the layer.
fn draws(environment: Vec<(&str, OsString)>, words: &str) -> (TempDir, Output) {
    let work = tempfile::tempdir().expect("a temporary folder");
    fs::write(work.path().join("x.png"), b"old").expect("it can be written");
    let mut command = program();
    command.args(["render", "builtin:triangle", "--size", "16x9", "--validate", "-o", "x.png"]);
    command.current_dir(work.path()).envs(environment).env("AFTERLIGHT_FAILURES", words);
    (work, command.output().expect("the program starts"))
}

fn ends_with_one_line(environment: Vec<(&str, OsString)>, words: &str, code: i32, part: &str) {
    let (work, output) = draws(environment, words);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{words}: {told}");
    let errors: Vec<&str> = told.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && errors[0].contains(part), "{words}: {told}");
    assert!(!told.contains("Validation"), "{words}: {told}");
    assert_eq!(fs::read(work.path().join("x.png")).expect("it is there"), b"old", "{words}");
    assert_eq!(fs::read_dir(work.path()).expect("a folder").count(), 1, "{words}: a file is left");
}

#[test]
fn a_loader_that_fails_before_there_is_an_instance_is_one_line_or_asked_again() {
    let layers = folder();
    for command in commands().filter(|command| PRE_INSTANCE.contains(&command.name)) {
        for (name, result) in command.results() {
            let words = format!("{}:1:{name}", command.name);
            let environment = implicit_environment(layers.path());
            if result == vk::Result::INCOMPLETE {
                let (_, output) = draws(environment, &words);
                let told = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success() && told.contains(&format!(": {name}")), "{words}: {told}");
                continue;
            }
            let of_memory =
                [vk::Result::ERROR_OUT_OF_HOST_MEMORY, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY].contains(&result);
            let part = if of_memory { ": out of memory" } else { ": Vulkan says ERROR_LAYER_NOT_PRESENT" };
            ends_with_one_line(
                environment,
                &words,
                if of_memory { 3 } else { 4 },
                &format!("by {}{part}", command.name),
            );
        }
    }
}

#[test]
fn an_explicit_layer_refuses_words_for_commands_that_loaders_do_not_ask_it_for() {
    let layers = folder();
    for command in PRE_INSTANCE.iter().chain([&OF_THE_LOADER]) {
        let words = format!("{command}:1:ERROR_OUT_OF_HOST_MEMORY");
        let (_, output) = draws(environment(layers.path()), &words);
        let told = String::from_utf8_lossy(&output.stderr);
        let line = format!("VK_LAYER_AFTERLIGHT_failures: AFTERLIGHT_FAILURES: '{command}' ");
        assert!(output.status.code() == Some(4) && told.contains(&line), "{words}: {told}");
    }
}

#[test]
fn a_picture_is_the_same_where_memory_is_not_coherent() {
    let layers = folder();
    let [picture, expected] = ["incoherent,count", "count"].map(|words| {
        let (work, output) = draws(environment(layers.path()), words);
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !told.contains("Validation"), "{words}: {told}");
        for command in ["vkFlushMappedMemoryRanges", "vkInvalidateMappedMemoryRanges"] {
            assert_eq!(told.contains(command), words != "count", "{words}: {told}");
        }
        fs::read(work.path().join("x.png")).expect("a picture")
    });
    assert!(picture == expected);
}

/// The names of files in a folder.
fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    entries.map(|name| name.to_string_lossy().into_owned()).collect()
}

/// Commands in a folder, whose device is lost at a later submission.
struct Losing {
    layers: tempfile::TempDir,
    work: tempfile::TempDir,
    caches: tempfile::TempDir,
}

impl Losing {
    fn new() -> Self {
        let new = || tempfile::tempdir().expect("a temporary folder");
        Self { layers: folder(), work: new(), caches: new() }
    }

    fn at(&self, name: &str) -> std::path::PathBuf {
        self.work.path().join(name)
    }

    fn command(&self, words: &str) -> Command {
        let mut command = program();
        command.args(words.split(' ')).current_dir(self.work.path());
        command.env("AFTERLIGHT_CACHE", self.caches.path().join("truths"));
        command.env("AFTERLIGHT_PIPELINE_CACHE", self.caches.path().join("pipelines"));
        command
    }

    fn whole(&self, words: &str) {
        let Output { status, stderr, .. } = self.command(words).output().expect("the program starts");
        let told = String::from_utf8_lossy(&stderr);
        assert!(status.success(), "{words}: {told}");
        assert!(!told.contains("warning"), "{words}: {told}");
    }

    /// Ends as a command does whose device is lost, and no file is half written.
    fn lost_at(&self, submission: u32, words: &str) {
        let mut command = self.command(words);
        command.envs(environment(self.layers.path()));
        command.env("AFTERLIGHT_FAILURES", format!("vkQueueSubmit:{submission}:ERROR_DEVICE_LOST"));
        let output = command.output().expect("the program starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{words}, {submission}: {told}");
        let errors: Vec<&str> = told.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.len() == 1 && errors[0].contains("by vkQueueSubmit: the device is lost"), "{words}: {told}");
        for folder in [self.at(""), self.at("report"), self.at("report/pictures")] {
            if folder.exists() {
                let names = names(&folder);
                assert!(!names.iter().any(|name| name.ends_with(".part")), "{words}: {names:?}");
            }
        }
    }
}

#[test]
fn pictures_of_a_path_that_were_written_before_the_device_is_lost_are_whole() {
    const WALK: &str = "render builtin:triangle --path path.toml --fps 8 --samples 1 --size 64x36 -o walk.png";
    let stand = Losing::new();
    let key = |second: u32| format!("[[keys]]\ntime = {second}\nposition = [0, 0, {}]\n", second + 2);
    fs::write(stand.at("path.toml"), key(0) + &key(1)).expect("written");
    fs::write(stand.at("walk-0008.png"), b"old").expect("written");
    stand.lost_at(9, WALK);
    let found = names(stand.work.path());
    let pictures: Vec<_> = found.iter().filter(|name| name.starts_with("walk-") && *name != "walk-0008.png").collect();
    assert!((1..8).contains(&pictures.len()), "some are written, and some are not: {found:?}");
    let whole: Vec<_> = pictures.iter().map(|name| fs::read(stand.at(name)).expect("read")).collect();
    assert!(whole.iter().all(|bytes| is_picture(bytes)), "{found:?}");
    assert_eq!(fs::read(stand.at("walk-0008.png")).expect("it is there"), b"old");
    stand.whole(WALK);
    assert_eq!(names(stand.work.path()).len(), 10);
    // Pictures before the loss equal an undisturbed run's.
    for (name, bytes) in pictures.iter().zip(whole) {
        assert!(fs::read(stand.at(name)).expect("read") == bytes, "{name}");
    }
}

#[test]
#[cfg(feature = "report")]
fn a_report_whose_device_is_lost_is_none_and_the_next_run_goes_on_from_what_is_whole() {
    use crate::common::whole::is_document;
    const REPORT: &str =
        "report builtin:triangle -o report --quick --families fxaa --joint 0 --size 32x18 --truth-samples 4 --rounds 6";
    let stand = Losing::new();
    stand.whole(REPORT);
    let all = names(&stand.at("report"));
    stand.lost_at(40, &format!("{REPORT} --restart"));
    let left = names(&stand.at("report"));
    assert!(left.contains("journal") && !left.contains("report.html"), "{left:?}");
    for name in names(&stand.at("report/pictures")) {
        assert!(is_picture(&fs::read(stand.at("report/pictures").join(&name)).expect("read")), "{name}");
    }
    // It would warn of a journal that is damaged.
    stand.whole(REPORT);
    assert_eq!(names(&stand.at("report")), all);
    assert!(is_document(&fs::read(stand.at("report/report.html")).expect("read")));
    assert!(is_json(&fs::read(stand.at("report/report.json")).expect("read")));
}

#[test]
fn a_bench_whose_device_is_lost_leaves_the_old_figures() {
    const BENCH: &str = "bench builtin:triangle --size 64x36 --frames 5 --json bench.json";
    let stand = Losing::new();
    stand.whole(BENCH);
    let old = fs::read(stand.at("bench.json")).expect("figures");
    assert!(is_json(&old));
    for submission in [2, 6] {
        stand.lost_at(submission, BENCH);
        assert!(fs::read(stand.at("bench.json")).expect("figures") == old, "{submission}");
        assert_eq!(names(stand.work.path()).len(), 1, "{submission}");
    }
}
