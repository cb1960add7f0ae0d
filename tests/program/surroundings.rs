//! The machine around the program: no home, one that nobody can write into, a terminal that can do nothing, a locale with commas, a pipe that closes, and
//! names of files with spaces, emoji and hundreds of characters.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::program::program;
use crate::common::tries_all;

const SCENE: &str = "builtin:triangle";

fn run(command: &mut Command) -> Output {
    command.output().expect("the program starts")
}

/// Draws a small picture in these surroundings, and returns its bytes.
fn drawn(folder: &Path, name: &str, change: impl Fn(&mut Command)) -> Vec<u8> {
    drawn_of(folder, SCENE, name, change)
}

fn drawn_of(folder: &Path, scene: &str, name: &str, change: impl Fn(&mut Command)) -> Vec<u8> {
    let mut command = program();
    command.args(["render", scene, "--size", "48x27", "--fxaa", "off", "-o", name]).current_dir(folder);
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

/// Each file of a scene gets the name: the scene, the model that it names, the model's materials, and their texture.
#[test]
fn a_scene_is_the_same_whatever_the_names_of_its_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |place: &str, name: &str| {
        let at = |suffix: &str| folder.path().join(place).join(format!("{name}.{suffix}"));
        fs::create_dir_all(folder.path().join(place)).expect("a folder");
        let scene = format!(
            "[[models]]\npath = \"{name}.obj\"\n\n[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\nfov_y_degrees = 45\n\n[sky.atmosphere]\nelevation_degrees = 40\n"
        );
        let model = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl own\nf 1/1 2/2 3/3\n";
        fs::write(at("toml"), scene).expect("written");
        fs::write(at("obj"), format!("mtllib {name}.mtl\n{model}")).expect("written");
        fs::write(at("mtl"), format!("newmtl own\nmap_Kd {name}.png\n")).expect("written");
        let texels = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 60 * y as u8, 99]));
        texels.save(at("png")).expect("written");
        format!("{place}/{name}.toml")
    };
    let draw = |scene: &str| drawn_of(folder.path(), scene, "picture.png", |_| ());
    let expected = draw(&write("plain", "scene"));
    let long = format!("{}/{}", "a deep folder ".repeat(10).trim(), "and a deeper one ".repeat(9).trim());
    let whales = "\u{1f40b} ".repeat(49);
    for (place, name) in [
        ("a folder with spaces, an é and a \u{1f40b}", "a name with spaces, an é and a \u{1f40b}"),
        (&*long, "a \u{1f40b}'s name"),
        ("long", whales.trim()),
    ] {
        let scene = write(place, name);
        assert!(draw(&scene) == expected, "{scene}: another picture");
        // The scene is opened by its whole path as well.
        assert!(
            !tries_all() || draw(folder.path().join(&scene).to_str().expect("UTF-8")) == expected,
            "{scene}: another picture"
        );
    }
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
