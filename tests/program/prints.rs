//! Output of commands, word for word, as snapshots in `tests/program/snapshots` that are reviewed as text. Times, memory, names of devices and
//! drivers, and versions are replaced, since they differ between machines and runs. After a change that is meant:
//! `INSTA_UPDATE=always scripts/test machine program prints::`, and read the diff before it is committed.

mod advice;
mod bench;
mod passed;

use std::fmt::Write as _;
use std::path::Path;

use crate::common::program::program;

/// Pattern and replacement, in this order.
const DIFFERS: &[(&str, &str)] = &[
    (r"llvmpipe \(LLVM [^)]*\)", "[device]"),
    (r"\b[0-9]+(\.[0-9]+)? ?(ms|s|min)\b", "[time]"),
    (r"\b[0-9]+(\.[0-9]+)? (B|KiB|MiB|GiB)\b", "[memory]"),
    (r"\b1\.[34]\.[0-9]+\b", "[version]"),
    // On an unpacked stack the loader names the layers that it was told to leave out.
    (r"(?m)^ INFO Loader Message: .*\n", ""),
    // Columns are as wide as their content.
    (r"(\S) {2,}", "$1  "),
];

/// Exit code, standard output and standard error of a command.
fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = program().current_dir(folder).args(arguments).output().expect("the program starts");
    let mut text = format!("$ afterlight {}\n", arguments.join(" "));
    for (stream, bytes) in [("", &output.stdout), ("[standard error]\n", &output.stderr)] {
        if !bytes.is_empty() {
            let _ = write!(text, "{stream}{}", String::from_utf8_lossy(bytes));
        }
    }
    let _ = writeln!(text, "[exit code {}]", output.status.code().map_or("none".into(), |code| code.to_string()));
    text.replace(&folder.display().to_string(), "[folder]")
}

/// Runs commands one after another in one folder, and holds their output against the snapshot of this name.
fn assert_prints(name: &str, folder: &Path, commands: &[&[&str]]) {
    let all: Vec<String> = commands.iter().map(|arguments| printed(folder, arguments)).collect();
    assert_text(name, &all.join("\n"));
}

fn assert_text(name: &str, text: &str) {
    insta::with_settings!({ filters => DIFFERS.to_vec(), prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, text);
    });
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn errors_are_one_line_and_hints_say_more_than_they() {
    let folder = folder();
    assert_prints(
        "errors",
        folder.path(),
        &[
            &["render", "missing.obj"],
            &["render", "builtin:hal"],
            &["render", "builtin:spheres", "--gbuffer", "lean,normal=rgba8"],
            &["render", "builtin:spheres", "--camera", "1,2,3/1,2,3"],
            &["inspect", "builtin:spheres", "--drop", "nothing"],
            &["stress", "foo"],
        ],
    );
}

#[test]
fn render_and_inspect_tell_where_one_is_in_few_lines_and_the_rest_when_asked() {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("upright.obj", "v 0 0 0\nv 600 0 0\nv 0 0 100\nf 1 2 3\n");
    let small = ["--size", "64x36"];
    let with_size = |arguments: &[&'static str]| [arguments, &small[..]].concat();
    let commands = [
        with_size(&["render", "upright.obj"]),
        with_size(&["render", "upright.obj", "--scale", "0.01", "--up", "z", "--exposure", "12"]),
        with_size(&[
            "render",
            "builtin:quad?angle=30",
            "--camera",
            "1,2,3/0,0,0/40",
            "--frames",
            "3",
            "--samples",
            "1",
        ]),
        with_size(&["render", "builtin:quad", "--verbose"]),
        with_size(&["inspect", "builtin:quad"]),
    ];
    assert_prints("place", folder.path(), &commands.each_ref().map(|own| own.as_slice()));
}

#[test]
fn a_fitted_camera_is_told_in_numbers_whether_it_was_asked_for_or_not() {
    let folder = folder();
    std::fs::write(folder.path().join("model.obj"), "v 0 0 0\nv 6 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    let camera = |arguments: &[&str]| {
        let mut command = program();
        command.current_dir(folder.path()).args(["inspect", "model.obj", "--size", "64x36"]).args(arguments);
        let told = command.output().expect("the program starts").stdout;
        let told = String::from_utf8_lossy(&told).into_owned();
        let camera =
            told.lines().find_map(|line| line.strip_prefix("camera ")?.split_once(';').map(|(own, _)| own.to_owned()));
        camera.unwrap_or_else(|| panic!("no camera in: {told}"))
    };
    let fitted = camera(&["--camera", "fitted"]);
    assert_eq!(fitted, camera(&[]));
    let (numbers, from) = fitted.split_once(' ').expect("numbers, and where they come from");
    assert_eq!(from, "(fitted to the model)");
    // They are what `--camera` takes.
    assert_eq!(camera(&["--camera", numbers]), format!("{numbers} (as given)"));
}

#[test]
fn odd_scene_files_are_told_with_file_line_and_keys() {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("empty.toml", "");
    write("msaa.toml", "base = \"builtin:spheres\"\n[settings]\nmsaa = 4\n");
    write("both.toml", "base = \"msaa.toml\"\n\n[settings]\nlight_path = \"volumes\"\n");
    let commands: [&[&str]; 4] = [
        &["render", "empty.toml", "--size", "64x36"],
        &["render", "both.toml", "--size", "64x36"],
        &["render", "both.toml", "--size", "64x36", "--light-path", "loop", "-q"],
        &["render", "builtin:hall", "--size", "64x36", "--shadow-budget", "17"],
    ];
    assert_prints("scene-files", folder.path(), &commands);
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let folder = folder();
    let scene = "base = \"builtin:quad\"\n";
    std::fs::write(folder.path().join("s.toml"), scene).expect("written");
    std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    for (arguments, file) in [
        (vec!["render", "s.toml", "-o", "x.png", "--json", "./s.toml"], "s.toml"),
        (vec!["render", "m.obj", "-o", "x.png", "--junit", "m.obj"], "m.obj"),
        (vec!["bench", "m.obj", "--json", "m.obj", "--frames", "1"], "m.obj"),
        (vec!["inspect", "builtin:quad", "--settings", "s.svg", "--graph", "s.svg"], "s.svg"),
        (vec!["compare", "x.png", "x.png", "-o", "x.png"], "x.png"),
    ] {
        let before = match file {
            "s.svg" => "[settings]\nmsaa = 1\n".as_bytes().to_vec(),
            "x.png" => {
                printed(folder.path(), &["render", "builtin:quad", "--size", "8x8", "-q", "-o", "x.png"]);
                std::fs::read(folder.path().join(file)).expect("a picture")
            }
            file => std::fs::read(folder.path().join(file)).expect("a file"),
        };
        std::fs::write(folder.path().join(file), &before).expect("written");
        let told = printed(folder.path(), &arguments);
        assert!(told.contains("is read by this command") && told.contains("[exit code 2]"), "{arguments:?}: {told}");
        assert!(std::fs::read(folder.path().join(file)).expect("still there") == before, "{arguments:?}");
    }
}
