//! The machine around the program: no home, one that nobody can write into, a terminal that can do nothing, a locale with commas, a pipe that closes, and
//! names of files with spaces, emoji and hundreds of characters.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::program::program;

const SCENE: &str = "builtin:triangle";

fn run(command: &mut Command) -> Output {
    command.output().expect("the program starts")
}

/// Draws a small picture in these surroundings, and returns its bytes.
fn drawn(folder: &Path, name: &str, change: impl Fn(&mut Command)) -> Vec<u8> {
    let mut command = program();
    command.args(["render", SCENE, "--size", "48x27", "--fxaa", "off", "-o", name]).current_dir(folder);
    change(&mut command);
    let output = run(&mut command);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !errors.contains("panic"), "{name}: {errors}");
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn a_picture_is_the_same_wherever_the_program_runs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let expected = drawn(folder.path(), "plain.png", |_| ());
    let homes = ["HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "AFTERLIGHT_CACHE", "AFTERLIGHT_PIPELINE_CACHE"];
    let without_home = |command: &mut Command| homes.iter().for_each(|name| _ = command.env_remove(name));
    let same = |name: &str, change: &dyn Fn(&mut Command)| {
        assert!(drawn(folder.path(), name, change) == expected, "{name}: another picture");
    };
    same("no-home.png", &without_home);
    same("no-such-home.png", &|command| {
        without_home(command);
        // Nobody can make a folder there, not even root.
        command.env("HOME", "/proc");
    });
    same("dumb.png", &|command| _ = command.env("TERM", "dumb"));
    same("commas.png", &|command| _ = command.env("LC_ALL", "de_DE.UTF-8").env("LANG", "de_DE.UTF-8"));
    same("a name with spaces, an é and a \u{1f40b}.png", &|_| ());
    same(&format!("{}.png", "x".repeat(250)), &|_| ());
    let deep = format!("{}/{}", "d".repeat(150), "e".repeat(150));
    fs::create_dir_all(folder.path().join(&deep)).expect("a folder of 300 characters");
    same(&format!("{deep}/deep.png"), &|_| ());
}

#[test]
fn a_terminal_that_can_do_nothing_gets_no_escape_sequence() {
    let mut command = program();
    command.args(["-v", "inspect", SCENE]).env("TERM", "dumb").env_remove("NO_COLOR");
    let output = run(&mut command);
    assert!(output.status.success() && !output.stderr.is_empty());
    assert!(!output.stdout.contains(&0x1b) && !output.stderr.contains(&0x1b));
}

#[test]
fn a_pipe_that_closes_ends_the_program_without_a_word() {
    let mut command = program();
    let mut child = command
        .args(["inspect", "builtin:hall", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
}
