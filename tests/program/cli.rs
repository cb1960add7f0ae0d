//! The program from outside: exit codes, one line for each error, whole files or none, and options that work as described.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::program::program;

use serde_json::Value;
use tempfile::TempDir;

const SMALL: [&str; 2] = ["--size", "64x36"];

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program().current_dir(folder).args(arguments).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the program, expects success, and returns its output.
fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// Expects this exit code, one line of error that holds these words, and nothing on standard output.
fn fail(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = run(folder, arguments);
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    let lines: Vec<&str> = errors.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(lines.len(), 1, "{arguments:?}: {errors}");
    let others = errors.lines().filter(|line| !line.starts_with("error: "));
    assert!(others.clone().all(|line| ["hint: ", "warning: "].iter().any(|start| line.starts_with(start))), "{errors}");
    for word in words {
        assert!(lines[0].contains(word), "{arguments:?}: `{word}` is not in: {}", lines[0]);
    }
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", text(&output.stdout));
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn write(folder: &TempDir, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, content).expect("a writable folder");
    path
}

fn pixels(path: &Path) -> image::RgbaImage {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgba8()
}

/// A PNG header that claims an edge, and nothing after it.
fn png_that_claims(edge: u32) -> Vec<u8> {
    let mut chunk = b"IHDR".to_vec();
    chunk.extend(edge.to_be_bytes());
    chunk.extend(edge.to_be_bytes());
    chunk.extend([8, 2, 0, 0, 0]);
    let crc = chunk.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    });
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    png.extend(chunk);
    png.extend((!crc).to_be_bytes());
    png
}

const TRIANGLE: &str = "v -1 0 0\nv 1 0 0\nv 0 2 0\nvt 0 0\n";

#[test]
fn bad_input_is_one_line_with_exit_code_3_and_leaves_no_file() {
    let folder = folder();
    let textured = format!("mtllib m.mtl\n{TRIANGLE}usemtl m\nf 1/1 2/1 3/1\n");
    write(&folder, "m.mtl", "newmtl m\nmap_Kd map.png\n");
    write(&folder, "bad.mtl", "newmtl m\nmap_Kd huge.png\n");
    write(&folder, "map.png", "no image at all");
    write(&folder, "huge.png", png_that_claims(100_000));
    fs::create_dir(folder.path().join("folder.obj")).expect("a writable folder");
    let cases: [(&str, &str, &[&str]); 8] = [
        ("empty.obj", "", &["empty.obj", "face"]),
        ("points.obj", "v 0 0 0\np 1\n", &["points.obj"]),
        ("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &["nan.obj:1"]),
        ("huge.obj", "v 1e38 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &["huge.obj:1", "1e38"]),
        ("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", &["index.obj:4", "7"]),
        ("key.toml", "[camera]\nfov_degrees = 60\n", &["key.toml:2", "fov_y_degrees"]),
        ("range.toml", "[camera]\nfov_y_degrees = 360\n", &["range.toml:2", "fov_y_degrees"]),
        ("model.fbx", "x", &["model.fbx", ".obj"]),
    ];
    for (name, content, words) in cases {
        write(&folder, name, content);
        fail(folder.path(), &["render", name, "-o", "out.png", "--size", "8x8"], 3, words);
    }
    // A texture that cannot be read is named, and the surface drawn without it.
    for (name, content, texture) in
        [("texture.obj", textured.clone(), "map.png"), ("large.obj", textured.replace("m.mtl", "bad.mtl"), "huge.png")]
    {
        write(&folder, name, &content);
        let output = program()
            .current_dir(folder.path())
            .args(["render", name, "-o", "drawn.png", "--size", "8x8"])
            .output()
            .expect("it starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && told.contains(texture), "{name}: {told}");
    }
    fail(folder.path(), &["render", "absent.obj", "-o", "out.png"], 3, &["absent.obj", "No such file"]);
    fail(folder.path(), &["render", "folder.obj", "-o", "out.png"], 3, &["folder.obj", "directory"]);
    assert!(!folder.path().join("out.png").exists());
}

#[test]
fn wrong_usage_has_exit_code_2() {
    let folder = folder();
    let cases: &[(&[&str], &[&str])] = &[
        (&["render"], &["SCENE"]),
        (&["render", "builtin:quad", "--size", "0x0"], &["0x0"]),
        (&["render", "builtin:quad", "--size", "wide"], &["wide"]),
        (&["render", "builtin:quad", "--size", "99999x4"], &["99999x4"]),
        (&["render", "builtin:quad", "--device", "99"], &["99"]),
        (&["render", "builtin:quad", "--device", "no such chip"], &["no such chip"]),
        (&["render", "builtin:quad", "--gbuffer", "lean,normal=rgba8"], &["did you mean \"rgb8\"?"]),
        (&["render", "builtin:quad", "--brdf", "phon"], &["phong"]),
        (&["render", "builtin:quad", "-o", "picture.gif"], &["picture.gif"]),
        (&["render", "builtin:quad", "-o", "x.exr", "--exposure", "3"], &["--exposure"]),
        (&["render", "builtin:quad", "--view", "shadow-map"], &["shadow"]),
        (&["render", "builtin:quad", "--samples", "4097"], &["--samples", "4096"]),
        (&["render", "builtin:quad", "--msaa", "3"], &["--msaa", "2, 4 or 8"]),
        (&["render", "builtin:quad", "--msaa", "4", "--samples", "4"], &["choose one"]),
        (&["render", "builtin:quad", "--msaa", "4", "--view", "normal"], &["normal"]),
        (&["render", "builtin:quad", "--msaa", "4", "--light-path", "volumes"], &["clustered"]),
        (&["render", "builtin:quad", "--view", "complexity"], &["--msaa"]),
        (&["render", "builtin:quad", "--samples", "4", "--view", "normal"], &["normal", "1 sample"]),
        (&["render", "builtin:quad", "--samples", "4", "--fxaa", "on"], &["FXAA needs --samples 1"]),
        (&["render", "builtin:quad", "--samples", "4", "--view", "all"], &["--samples"]),
        (&["render", "builtin:quad", "--fxaa", "on", "--view", "depth"], &["FXAA", "depth"]),
        (&["render", "builtin:quad", "--fxaa", "on", "-o", "x.exr"], &["FXAA", ".exr"]),
        (&["render", "builtin:quad", "--shadow-slope-bias", "-1"], &["--shadow-slope-bias", "0 to 1000"]),
        (&["render", "builtin:quad", "--shadow-normal-offset", "far"], &["--shadow-normal-offset"]),
        (&["bench", "builtin:quad", "--vary", "gbufer=fat"], &["gbuffer"]),
        (&["bench", "builtin:quad", "--vary", "samples=4"], &["single frames"]),
        (&["bench", "builtin:quad", "--vary", " "], &["nothing is varied"]),
    ];
    for (arguments, words) in cases.iter().copied() {
        fail(folder.path(), arguments, 2, words);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0, "something was written");
}

#[test]
fn a_scene_in_a_commands_place_is_answered_with_the_commands_for_it() {
    let folder = folder();
    for (words, scene) in [
        (&["Fox.glb"][..], "Fox.glb"),
        (&["-v", "a scene.TOML", "--size", "8x8"], "\"a scene.TOML\""),
        (&["builtin:hall?detail=8"], "\"builtin:hall?detail=8\""),
        (&["cornell"], "builtin:cornell"),
    ] {
        let output = run(folder.path(), words);
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{errors}");
        let hint = format!(
            "hint: did you mean `afterlight view {scene}` for a window, or `afterlight render {scene}` for a picture?\n"
        );
        assert!(errors.ends_with(&hint), "{errors}");
    }
    let near = text(&run(folder.path(), &["rendr"]).stderr);
    assert!(near.contains("'render'") && !near.contains("picture"), "{near}");
}

/// A FIFO that nothing writes is refused within seconds, wherever a file is named; one that is written is read where a shell may have made it.
#[test]
#[cfg(unix)]
fn a_pipe_that_nothing_writes_stops_no_command() {
    let folder = folder();
    for name in ["fifo", "fifo.toml", "fifo.obj", "fifo.glb", "fifo.hdr", "fifo.png"] {
        let made = std::process::Command::new("mkfifo").arg(folder.path().join(name)).status();
        assert!(made.is_ok_and(|status| status.success()), "mkfifo");
    }
    write(&folder, "texture.obj", format!("mtllib own.mtl\n{TRIANGLE}usemtl own\nf 1/1 2/1 3/1\n"));
    write(&folder, "own.mtl", "newmtl own\nmap_Kd fifo.png\n");
    write(&folder, "library.obj", format!("mtllib fifo\n{TRIANGLE}f 1/1 2/1 3/1\n"));
    write(&folder, "model.toml", "[[models]]\npath = \"fifo.obj\"\n");
    write(&folder, "base.toml", "base = \"fifo.toml\"\n");
    write(&folder, "from.toml", "base = \"builtin:quad\"\nsettings.from = \"fifo\"\n");
    write(&folder, "including.toml", "include = [\"fifo\"]\n");
    // Each is refused, or drawn without the file, but none waits.
    let quick: &[&[&str]] = &[
        &["inspect", "fifo.toml"],
        &["inspect", "fifo.obj"],
        &["inspect", "fifo.glb"],
        &["inspect", "model.toml"],
        &["inspect", "base.toml"],
        &["inspect", "from.toml"],
        &["inspect", "texture.obj"],
        &["inspect", "library.obj"],
        &["inspect", "builtin:quad", "--sky", "fifo.hdr"],
        &["compare", "fifo.png", "fifo.png"],
        &["ci", "fifo", "--list"],
        &["ci", "including.toml", "--list"],
        &["ci", "--repro", "fifo"],
    ];
    let pipes: &[&[&str]] = &[
        &["inspect", "builtin:quad", "--settings", "fifo"],
        &["render", "builtin:quad", "--path", "fifo", "-o", "walk.png"],
        &["ci", "smoke", "-o", "out", "--skips", "fifo"],
        &["ci", "smoke", "-o", "out", "--flakes", "fifo"],
        &["ci", "smoke", "-o", "out", "--baseline", "fifo"],
        &["ci", "smoke", "-o", "out", "--since", "fifo"],
    ];
    let children: Vec<_> = quick
        .iter()
        .chain(pipes)
        .map(|words| {
            let mut command = program();
            command.current_dir(folder.path()).args(*words).stdin(std::process::Stdio::null());
            command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped());
            (words, command.spawn().expect("the program starts"))
        })
        .collect();
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    for (words, mut child) in children {
        while child.try_wait().expect("it can be waited for").is_none() {
            if std::time::Instant::now() > deadline {
                child.kill().expect("it is there");
                panic!("{words:?} waits for the pipe");
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        let output = child.wait_with_output().expect("it has ended");
        let errors = text(&output.stderr);
        assert!(output.status.code().is_some_and(|code| code != 101), "{words:?}: {errors}");
        if pipes.contains(words) {
            assert_eq!(output.status.code(), Some(3), "{words:?}: {errors}");
            assert!(errors.contains("fifo: it is a pipe (FIFO) that nothing writes"), "{words:?}: {errors}");
        }
    }
}

/// What a shell makes of `<(command)` is read.
#[test]
#[cfg(unix)]
fn a_pipe_of_a_shell_is_a_file_like_any_other() {
    let folder = folder();
    let program = program();
    let words: Vec<_> = std::iter::once(program.get_program()).chain(program.get_args()).collect();
    let words: Vec<_> = words.iter().map(|word| format!("'{}'", word.to_string_lossy())).collect();
    let script = format!(
        "{} inspect builtin:quad --json --settings <(echo '[settings]'; echo 'size = [24, 10]')",
        words.join(" ")
    );
    let output = std::process::Command::new("bash").current_dir(folder.path()).args(["-c", &script]).output();
    let output = output.expect("a shell");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)));
    assert_eq!(report["size"], serde_json::json!([24, 10]));
}

#[test]
fn without_a_driver_it_says_what_is_missing_with_exit_code_4() {
    let folder = folder();
    // Debian 13's runner names the driver itself.
    if std::env::var_os("AFTERLIGHT_RUNNER").is_some() {
        return;
    }
    let without = |arguments: &[&str]| {
        let nowhere = folder.path().join("none.json");
        let mut command = program();
        command.env("VK_DRIVER_FILES", &nowhere).env("VK_ICD_FILENAMES", &nowhere);
        command.args(arguments).output().expect("the program starts")
    };
    let render = without(&["render", "builtin:quad", "-o", "-"]);
    assert_eq!(render.status.code(), Some(4), "{}", text(&render.stderr));
    // The file that is missing, and not a driver that may be there.
    let named = format!("VK_DRIVER_FILES names {}, which cannot be read", folder.path().join("none.json").display());
    assert!(text(&render.stderr).contains(&named), "{}", text(&render.stderr));
    assert!(!text(&render.stderr).contains("install"), "{}", text(&render.stderr));
    assert!(render.stdout.is_empty());
    assert_eq!(without(&["doctor"]).status.code(), Some(4));
    assert!(text(&run(folder.path(), &["doctor"]).stdout).contains("Drawing works"));
}

#[test]
fn what_cannot_be_written_is_told_and_nothing_is_lost() {
    let folder = folder();
    let out = |name: &str| ["render", "builtin:quad", "--size", "8x8", "-o", name].map(str::to_owned);
    let expect = |name: &str, words: &[&str]| {
        let arguments = out(name);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        fail(folder.path(), &arguments, 3, words);
    };
    fs::create_dir(folder.path().join("taken.png")).expect("a writable folder");
    expect("taken.png", &["taken.png", "directory"]);
    expect("absent/a.png", &["no folder absent"]);
    write(&folder, "file", "x");
    expect("file/a.png", &["file"]);
    // A scene that cannot be read leaves an older picture as it was.
    let old = write(&folder, "old.png", "old");
    fail(folder.path(), &["render", "absent.toml", "-o", "old.png"], 3, &["absent.toml"]);
    assert_eq!(fs::read(old).expect("still there"), b"old");
    if Path::new("/dev/full").exists() {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full opens");
        let arguments = ["render", "builtin:quad", "--size", "64x64", "-o", "-"];
        let output = program().args(arguments).stdout(full).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    }
}

#[test]
fn pictures_are_png_exr_or_a_stream_and_the_same_in_each() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let render = |out: &str| {
        let arguments = [&["render", "builtin:quad", "-o", out][..], &SMALL].concat();
        succeed(folder.path(), &arguments)
    };
    assert!(render("a.png").contains("times: load"));
    render("a.exr");
    let arguments = [&["render", "builtin:quad", "-o", "-"][..], &SMALL].concat();
    let streamed = run(folder.path(), &arguments);
    assert_eq!(streamed.stdout, fs::read(at("a.png")).expect("the file"), "a stream is the file");
    let png = pixels(&at("a.png"));
    assert_eq!(png.dimensions(), (64, 36));
    // The quad's own radiance: illuminance times albedo over pi, at a right angle.
    let scene = afterlight::scene::open("builtin:quad", &Default::default()).expect("it opens");
    let afterlight::scene::LightKind::Directional { direction } = scene.lights[0].kind else { panic!("a sun") };
    let radiance = f64::from(scene.lights[0].intensity) * -direction.z / std::f64::consts::PI;
    let exr = image::open(at("a.exr")).expect("an EXR").into_rgba32f();
    for channel in 0..3 {
        let expected = radiance * f64::from(scene.materials[0].base_color[channel] * scene.lights[0].color[channel]);
        let found = f64::from(exr.get_pixel(32, 18)[channel]);
        // The albedo has 8 bits.
        assert!((found / expected - 1.0).abs() < 0.01, "channel {channel}: {found} for {expected}");
    }
    assert!(succeed(folder.path(), &[&["render", "builtin:quad", "-q"][..], &SMALL].concat()).is_empty());
    assert!(at("afterlight.png").exists(), "the default name");
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn shards_of_a_sequence_are_the_whole_of_it() {
    let folder = folder();
    let draw = |output: &str, more: &[&str]| {
        let sequence =
            ["render", "builtin:seaweed", "--size", "24x14", "--duration", "0.3", "--fps", "10", "-q", "-o", output];
        succeed(folder.path(), &[&sequence[..], more].concat());
    };
    for taa in ["off", "on"] {
        let whole = ["--taa", taa, "--samples", "1"];
        draw("whole.png", &whole);
        draw("part.png", &[&whole[..], &["--shard", "1/2"]].concat());
        let parts = ["part-0000.png", "part-0002.png"].map(|name| folder.path().join(name));
        assert!(parts.iter().all(|part| part.is_file()) && !folder.path().join("part-0001.png").exists());
        draw("part.png", &[&whole[..], &["--shard", "2/2"]].concat());
        for index in 0..3 {
            let [whole, part] = ["whole", "part"].map(|name| folder.path().join(format!("{name}-000{index}.png")));
            assert_eq!(pixels(&whole), pixels(&part), "{index}, TAA {taa}");
            fs::remove_file(part).expect("there");
        }
    }
    let sequence = ["render", "builtin:triangle", "--duration", "1", "--fps", "2", "--size", "8x8", "--shard"];
    fail(folder.path(), &[&sequence[..], &["1/2", "-o", "-"]].concat(), 2, &["in their order"]);
    fail(folder.path(), &[&sequence[..], &["3/3"]].concat(), 2, &["none is left for this shard"]);
    fail(
        folder.path(),
        &["render", "builtin:triangle", "--shard", "1/2"],
        2,
        &["it needs --path, --fps or --duration"],
    );
}

/// The command that `render` prints says why as many parts are in and out as `render` counts.
#[test]
#[cfg(unix)]
fn the_printed_inspect_has_the_plan_of_the_picture() {
    let folder = folder();
    write(&folder, "own settings.toml", "[settings]\nsize = [40, 30]\nmsaa = 4\n");
    let counted = |parts: &Value| {
        let parts = parts.as_array().expect("a list");
        let included = parts.iter().filter(|part| part["included"] == true).count();
        format!("plan: {included} parts of the frame are in, {} are left out", parts.len() - included)
    };
    let mut plans = std::collections::BTreeSet::new();
    for words in [
        &["builtin:spheres?rows=2&columns=2"][..],
        &["builtin:spheres?rows=2&columns=2", "--sky", "atmosphere:40,30", "--samples", "1"],
        &["builtin:quad", "--settings", "own settings.toml"],
        &["builtin:quad", "-o", "light.exr"],
        &["builtin:quad", "--view", "normal", "--gbuffer", "lean,normal=rgb8"],
        &["builtin:seaweed", "--duration", "0.01", "--samples", "2"],
    ] {
        let small: &[&str] = if words.contains(&"--settings") { &[] } else { &SMALL };
        let told = succeed(folder.path(), &[&["render"], words, small].concat());
        let line = told.lines().find(|line| line.starts_with("plan: ")).expect("a line about the plan");
        let typed = line.split('`').nth(1).expect("a command");
        let own = program();
        let start: Vec<_> =
            std::iter::once(own.get_program()).chain(own.get_args()).map(|word| word.to_string_lossy()).collect();
        let script = format!("afterlight() {{ '{}' \"$@\"; }}\n{typed} --json", start.join("' '"));
        let mut shell = std::process::Command::new("bash");
        shell.current_dir(folder.path()).env("AFTERLIGHT_CALIBRATION", "").args(["-c", &script]);
        let output = shell.output().expect("a shell");
        let report: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)));
        assert!(line.starts_with(&counted(&report["parts"])), "{typed}: {line} and {}", counted(&report["parts"]));
        plans.insert(counted(&report["parts"]));
    }
    assert!(plans.len() > 3, "their plans differ: {plans:?}");
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn the_sheet_of_all_views_holds_each_also_where_one_cannot_be_drawn() {
    let folder = folder();
    for scene in ["builtin:field?objects=20&lights=4", "builtin:hall?detail=8"] {
        succeed(folder.path(), &["render", scene, "--view", "all", "--size", "128x72", "-o", "sheet.png"]);
        let sheet = pixels(&folder.path().join("sheet.png"));
        // Four columns and three rows of half the size, and room for labels.
        assert!(sheet.width() >= 4 * 64 && sheet.height() > 3 * 36, "{:?}", sheet.dimensions());
        let colors: std::collections::BTreeSet<_> = sheet.pixels().map(|pixel| pixel.0).collect();
        assert!(colors.len() > 500, "{scene}: only {} colours", colors.len());
    }
}

#[test]
fn the_command_line_overrides_the_scene_file() {
    let folder = folder();
    let toml = "base = \"builtin:spheres?rows=2&columns=2\"\n[settings]\nsize = [40, 30]\nexposure = 9.0\n\
                tonemap = \"none\"\ngbuffer = \"fat\"\n";
    write(&folder, "scene.toml", toml);
    let render = |more: &[&str]| {
        let arguments = [&["render", "scene.toml", "-q", "-o", "a.png"][..], more].concat();
        succeed(folder.path(), &arguments);
        pixels(&folder.path().join("a.png"))
    };
    let own = render(&[]);
    assert_eq!(own.dimensions(), (40, 30));
    let said = render(&["--exposure", "9", "--tonemap", "none", "--gbuffer", "fat", "--frames", "3"]);
    assert!(own == said, "the same settings give another picture");
    assert_eq!(render(&["--size", "20x10"]).dimensions(), (20, 10));
    let changes: &[&[&str]] = &[
        &["--samples", "1"],
        &["--samples", "9"],
        &["--fxaa", "on"],
        &["--exposure", "10"],
        &["--tonemap", "agx"],
        &["--brdf", "lambert"],
        &["--camera", "0,0,30/0,0,0"],
        &["--view", "normal"],
    ];
    for change in changes {
        assert!(own != render(change), "{change:?} changes nothing");
    }
    let bytes = |more: &[&str]| {
        let arguments = [&["inspect", "scene.toml", "--json"][..], more].concat();
        let report: Value = serde_json::from_str(&succeed(folder.path(), &arguments)).expect("JSON");
        report["gbuffer_bytes_per_pixel"].as_u64().expect("a number")
    };
    assert_eq!((bytes(&[]), bytes(&["--gbuffer", "lean"])), (32, 14));
    let shadow = |more: &[&str]| {
        let arguments = [&["inspect", "builtin:hall?detail=8", "--json"][..], more].concat();
        let report: Value = serde_json::from_str(&succeed(folder.path(), &arguments)).expect("JSON");
        let parts = report["parts"].as_array().expect("a list").clone();
        let map = parts.into_iter().find(|part| part["name"] == "shadow maps").expect("the part");
        (map["included"].as_bool().expect("a bool"), map["bytes"].as_u64().expect("a number"))
    };
    assert_eq!(shadow(&["--shadow-size", "64"]), (true, 2 * 64 * 64 * 4));
    assert_eq!(shadow(&["--shadow-size", "64", "--cascades", "3"]), (true, 3 * 64 * 64 * 4));
    assert!(!shadow(&["--shadows", "off"]).0);
}

#[test]
fn render_passes_are_listed_with_the_bits_that_a_pixel_keeps_and_the_bytes_that_they_move() {
    let folder = folder();
    let passes = |more: &[&str]| {
        let usual = ["inspect", "builtin:hall?detail=8", "--light-path", "loop", "--size", "96x54", "--json"];
        let report: Value = serde_json::from_str(&succeed(folder.path(), &[&usual, more].concat())).expect("JSON");
        let passes = report["render_passes"].as_array().expect("a list").clone();
        let sum = |key: &str| passes.iter().map(|pass| pass[key].as_u64().expect("a number")).sum::<u64>();
        let bits = passes.iter().map(|pass| pass["color_bits"].as_u64().expect("a number")).max();
        (bits, [sum("loaded_bytes"), sum("stored_bytes")])
    };
    let pixels = 96 * 54;
    // Three colours of 32 bits, and light of 64 or 32. Depth is none.
    assert_eq!(passes(&[]), (Some(160), [0, 4 * pixels]));
    assert_eq!(passes(&["--hdr-format", "b10g11r11"]), (Some(128), [0, 4 * pixels]));
    // GEOMETRY stores depth, colours and light, LIGHTING loads and stores light again, and TONEMAP loads light.
    assert_eq!(passes(&["--passes", "stored"]).1, [(16 + 8 + 8) * pixels, (16 + 8 + 8 + 4) * pixels]);
}

#[test]
fn a_settings_file_wins_over_the_scene_file_and_other_options_over_it() {
    let folder = folder();
    let plain = "base = \"builtin:spheres?rows=2&columns=2\"\n";
    write(&folder, "scene.toml", format!("{plain}[settings]\nsize = [40, 30]\ngbuffer = \"lean\"\nsamples = 3\n"));
    write(&folder, "plain.toml", plain);
    write(&folder, "tuned.toml", "[settings]\nsize = [20, 10]\ngbuffer = \"fat\"\nmsaa = 4\n[evidence]\nms = 3\n");
    let tuned = ["--settings", "tuned.toml"];
    let render = |scene: &str, more: &[&str]| {
        succeed(folder.path(), &[&["render", scene, "-q", "-o", "a.png"][..], more].concat());
        pixels(&folder.path().join("a.png"))
    };
    let said = ["--size", "20x10", "--gbuffer", "fat", "--msaa", "4", "--samples", "1"];
    assert!(render("scene.toml", &tuned) == render("plain.toml", &said));
    assert_eq!(render("scene.toml", &[&tuned[..], &["--size", "30x20"]].concat()).dimensions(), (30, 20));
    let one = render("scene.toml", &[&tuned[..], &["--msaa", "1", "--samples", "2"]].concat());
    assert!(one == render("plain.toml", &["--size", "20x10", "--gbuffer", "fat", "--samples", "2"]));
    let inspect = |more: &[&str]| {
        let printed = succeed(folder.path(), &[&["inspect", "scene.toml", "--json"][..], more].concat());
        let report: Value = serde_json::from_str(&printed).expect("JSON");
        report["gbuffer_bytes_per_pixel"].as_u64().expect("a number")
    };
    assert!(inspect(&tuned) > inspect(&[]));
    assert_eq!(inspect(&[&tuned[..], &["--gbuffer", "lean", "--msaa", "1"]].concat()), inspect(&[]));
    let bench = ["bench", "scene.toml", "--frames", "1", "--warmup", "0", "-q", "--json", "-"];
    let report: Value = serde_json::from_str(&succeed(folder.path(), &[&bench[..], &tuned].concat())).expect("JSON");
    assert_eq!(report["scenes"][0]["runs"][0]["size"], serde_json::json!([20, 10]));
    write(&folder, "wrong.toml", "[settings]\n\ngbufer = \"fat\"\n");
    let wrong = ["render", "plain.toml", "--settings", "wrong.toml", "-o", "b.png"];
    fail(folder.path(), &wrong, 3, &["wrong.toml:3", "did you mean \"gbuffer\""]);
    let none = ["inspect", "plain.toml", "--settings", "none.toml"];
    fail(folder.path(), &none, 3, &["cannot read none.toml", "No such file"]);
    assert!(!folder.path().join("b.png").exists());
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn biases_of_shadows_are_options_too() {
    let folder = folder();
    let render = |more: &[&str]| {
        let hall = ["render", "builtin:hall?detail=8", "--samples", "1", "-q", "-o", "a.png"];
        succeed(folder.path(), &[&hall[..], &SMALL, more].concat());
        pixels(&folder.path().join("a.png"))
    };
    let usual = render(&[]);
    assert!(usual == render(&["--shadow-normal-offset", "0.25", "--shadow-slope-bias", "0.5"]));
    assert!(usual != render(&["--shadow-normal-offset", "40"]));
    assert!(usual != render(&["--shadow-slope-bias", "200"]));
}

#[test]
fn a_picture_has_eight_samples_until_something_else_is_said() {
    let folder = folder();
    write(&folder, "four.toml", "base = \"builtin:spheres?rows=2&columns=2\"\nsettings.samples = 4\n");
    let render = |scene: &str, more: &[&str]| {
        succeed(folder.path(), &[&["render", scene, "--size", "40x30", "-q", "-o", "a.png"][..], more].concat());
        pixels(&folder.path().join("a.png"))
    };
    let plain = "builtin:spheres?rows=2&columns=2";
    assert!(render(plain, &[]) == render(plain, &["--samples", "8"]));
    assert!(render("four.toml", &[]) == render(plain, &["--samples", "4"]));
    assert!(render("four.toml", &["--msaa", "4"]) == render(plain, &["--msaa", "4", "--samples", "1"]));
    assert!(render(plain, &["--msaa", "4"]) != render(plain, &["--samples", "1"]));
    let told = succeed(folder.path(), &["render", plain, "--msaa", "4", "--view", "complexity", "-o", "c.png"]);
    assert!(told.contains("are shaded once a sample"), "{told}");
    assert!(render("four.toml", &["--fxaa", "on"]) == render(plain, &["--fxaa", "on", "--samples", "1"]));
    assert!(render("four.toml", &["--view", "lighting"]) == render(plain, &["--view", "lighting", "--samples", "1"]));
    let far_too_bright = render(plain, &["--exposure", "6"]);
    assert!(far_too_bright == render(plain, &["--exposure", "6", "--resolve", "tone-mapped"]));
    assert!(far_too_bright != render(plain, &["--exposure", "6", "--resolve", "linear"]));
    assert!(render(plain, &["--view", "lighting"]) != render(plain, &["--view", "lighting", "--samples", "4"]));
}

#[test]
fn bench_measures_variants_in_turn_and_writes_json() {
    let folder = folder();
    let arguments = ["bench", "builtin:field?objects=20&lights=8", "--size", "64x36", "--frames", "5", "--warmup", "1"];
    let more = ["--vary", "gbuffer=fat", "--json", "bench.json"];
    let printed = succeed(folder.path(), &[&arguments[..], &more].concat());
    assert!(printed.contains("median") && printed.contains("gbuffer=fat"), "{printed}");
    let json = fs::read_to_string(folder.path().join("bench.json")).expect("the file");
    let report: Value = serde_json::from_str(&json).expect("JSON");
    let runs = report["scenes"][0]["runs"].as_array().unwrap_or_else(|| panic!("{json}"));
    assert_eq!(runs.len(), 2);
    for run in runs {
        let [low, median, high] = ["p5", "median", "p95"].map(|name| run["wall_ms"][name].as_f64().expect("a number"));
        assert!(0.0 < low && low <= median && median <= high, "{run}");
    }
    assert_eq!(runs[1]["gbuffer_bytes_per_pixel"], 32);
}

#[test]
fn inspect_prints_the_plan_and_every_dependency_with_its_reason() {
    let folder = folder();
    let printed = succeed(folder.path(), &["inspect", "builtin:cornell"]);
    for word in ["geometry-to-lighting", "lighting-to-tonemap", "why:", "INPUT_ATTACHMENT_READ"] {
        assert!(printed.contains(word), "{printed}");
    }
}

#[test]
fn validation_is_silent_and_counts_what_the_layer_says() {
    let folder = folder();
    succeed(folder.path(), &["render", "builtin:hall?detail=8", "--size", "64x36", "--frames", "3", "--validate"]);
    // The layer's own demonstration that its messages arrive: best practices have something against this view.
    let talkative = program()
        .current_dir(folder.path())
        .env("VK_LAYER_ENABLES", "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT")
        .args(["render", "builtin:hall?detail=8", "--size", "64x36", "--view", "triangle", "--validate", "-q"])
        .output()
        .expect("the program starts");
    // Newer layers take the setting by another name and stay silent; where it talks, the command fails.
    let said = text(&talkative.stderr).contains("BestPractices");
    assert_eq!(talkative.status.code(), Some(if said { 1 } else { 0 }), "{}", text(&talkative.stderr));
    assert!(said || std::env::var_os("AFTERLIGHT_RUNNER").is_some(), "the machine's own layer knows best practices");
}

#[test]
fn advice_that_was_asked_for_is_told_and_fails_nothing() {
    let folder = folder();
    // Every version of the layer has advice about this view.
    let arguments = ["render", "builtin:quad", "--size", "8x8", "--view", "triangle", "-q"];
    let asked = program().current_dir(folder.path()).args(arguments).arg("--validate=best-practices").output();
    let asked = asked.expect("the program starts");
    assert!(asked.status.success() && text(&asked.stderr).contains("BestPractices"), "{}", text(&asked.stderr));
    fail(
        folder.path(),
        &[&arguments[..], &["--validate=synch"]].concat(),
        2,
        &["did you mean \"sync\"", "gpu-assisted"],
    );
}

#[test]
fn a_drawn_frame_is_an_svg_file_or_a_stream() {
    let folder = folder();
    let inspect = |more: &[&str]| succeed(folder.path(), &[&["inspect", "builtin:quad"], more].concat());
    let told = inspect(&["--graph", "frame.svg"]);
    assert!(told.contains("Targets") && told.ends_with("\n\n--graph: frame.svg is written\n"), "{told}");
    let file = fs::read_to_string(folder.path().join("frame.svg")).expect("it was written");
    assert!(file.starts_with("<svg ") && file.ends_with("</svg>\n"), "{file}");
    assert_eq!(inspect(&["--graph", "-"]), file, "a stream is the file");
    let report: Value = serde_json::from_str(&inspect(&["--json", "--graph", "b.svg"])).expect("JSON");
    assert!(folder.path().join("b.svg").exists() && report["parts"].is_array());
    fail(folder.path(), &["inspect", "builtin:quad", "--graph", "frame.png"], 2, &[".svg"]);
    fail(folder.path(), &["inspect", "builtin:quad", "--json", "--graph", "-"], 2, &["--graph"]);
}

#[test]
fn drawn_hazards_are_an_svg_file_or_a_stream() {
    let folder = folder();
    let inspect = |more: &[&str]| succeed(folder.path(), &[&["inspect", "builtin:quad"], more].concat());
    let told = inspect(&["--hazards", "hazards.svg", "--graph", "frame.svg"]);
    let written = "\n--graph: frame.svg is written\n--hazards: hazards.svg is written\n";
    assert!(told.contains("Targets") && told.ends_with(written), "{told}");
    let file = fs::read_to_string(folder.path().join("hazards.svg")).expect("it was written");
    assert!(file.starts_with("<svg ") && file.ends_with("</svg>\n") && folder.path().join("frame.svg").exists());
    assert_eq!(inspect(&["--hazards", "-"]), file, "a stream is the file");
    let one = inspect(&["--hazards", "-", "--rows", "read-back"]);
    assert!(one.contains("data-dependency=\"read-back\"") && one.matches("data-dependency").count() == 1, "{one}");
    for (arguments, words) in [
        (&["--hazards", "hazards.png"][..], ".svg"),
        (&["--hazards", "-", "--json"], "--hazards"),
        (&["--hazards", "-", "--graph", "-"], "--hazards"),
        (&["--hazards", "same.svg", "--graph", "same.svg"], "--hazards"),
        (&["--hazards", "-", "--rows", "reed-back"], "read-back"),
        (&["--hazards", "-", "--rows", "acquire"], "no window"),
        (&["--rows", "read-back"], "--hazards"),
    ] {
        fail(folder.path(), &[&["inspect", "builtin:quad"], arguments].concat(), 2, &[words]);
    }
}

#[test]
fn a_part_that_is_out_says_what_it_would_cost() {
    let folder = folder();
    let report: Value = serde_json::from_str(&succeed(
        folder.path(),
        &["inspect", "builtin:quad", "--light-path", "loop", "--size", "100x50", "--json"],
    ))
    .expect("JSON");
    let parts = report["parts"].as_array().expect("a list");
    let sum: u64 = parts.iter().map(|part| part["bytes"].as_u64().expect("a number")).sum();
    assert_eq!(report["bytes"], sum);
    for part in parts {
        let (included, optional) = (part["included"] == true, part["plan"].is_string());
        assert!(included || part["bytes"] == 0, "{part}");
        let told = part["cost"].is_object() || part["refused"].is_string();
        assert_eq!(told, !included && optional, "{part}");
    }
    assert!(report["full"]["bytes"].is_i64(), "{}", report["full"]);
}

#[test]
fn each_part_left_out_has_its_cost_or_a_reason_why_not() {
    let folder = folder();
    let arguments = ["bench", "builtin:quad", "--plan-cost", "--frames", "2", "--warmup", "1", "--json", "costs.json"];
    let told = succeed(folder.path(), &[&arguments[..], &SMALL].concat());
    let json = fs::read_to_string(folder.path().join("costs.json")).expect("it was written");
    let report: Value = serde_json::from_str(&json).expect("JSON");
    let scene = &report["scenes"][0];
    let names: Vec<&str> =
        scene["runs"].as_array().expect("runs").iter().map(|run| run["variant"].as_str().expect("a name")).collect();
    assert_eq!(names, ["lean", "full"]);
    let costs = &scene["plan_cost"];
    let list = |key: &str| costs[key].as_array().expect("a list").clone();
    for cost in list("parts").iter().chain([&costs["full"]]) {
        assert_eq!((&cost["ratio"]["count"], &cost["wall_ms"]["count"]), (&2.into(), &2.into()), "{cost}");
        assert!(cost["memory_bytes"].is_i64() && cost["pipelines"].is_i64(), "{cost}");
        assert!(told.contains(cost["part"].as_str().expect("a name")), "{told}");
    }
    // Each part is either needed, measured, without effect, or refused.
    let inspected = succeed(folder.path(), &[&["inspect", "builtin:quad", "--json"][..], &SMALL].concat());
    let inspected: Value = serde_json::from_str(&inspected).expect("JSON");
    let needed = inspected["parts"].as_array().expect("a list");
    let needed = needed.iter().filter(|part| part["included"] == true && part["plan"].is_string()).count();
    let told = list("parts").len() + list("same").len() + list("refused").len();
    assert_eq!(needed + told, afterlight::scene::OptionalPart::NAMES.len(), "{costs}");
    fail(folder.path(), &["bench", "builtin:quad", "--plan-cost", "--vary", "fxaa=on"], 2, &["--plan-cost"]);
}

#[test]
fn layers_and_wide_dependencies_have_their_costs() {
    let folder = folder();
    let bench = |option: &str| {
        let arguments = ["bench", "builtin:quad", option, "--frames", "2", "--warmup", "1", "--json", "costs.json"];
        let told = succeed(folder.path(), &[&arguments[..], &SMALL].concat());
        let json = fs::read_to_string(folder.path().join("costs.json")).expect("it was written");
        let report: Value = serde_json::from_str(&json).expect("JSON");
        (told, report["scenes"][0].clone())
    };
    let list = |value: &Value| value.as_array().expect("a list").clone();

    let (told, scene) = bench("--over-sync");
    let inspected = succeed(folder.path(), &[&["inspect", "builtin:quad", "--json"][..], &SMALL].concat());
    let inspected: Value = serde_json::from_str(&inspected).expect("JSON");
    let costs = &scene["over_sync"];
    for cost in list(&costs["rows"]) {
        assert_eq!((&cost["alone"]["ratio"]["count"], &cost["in_a_row"]["ms"]["count"]), (&2.into(), &2.into()));
        assert!(told.contains(cost["widened"].as_str().expect("a name")), "{told}");
    }
    // Each row of the frame is one of these. The frame as it is, all rows at once and the full barriers are besides.
    let rows = list(&inspected["dependencies"]).len();
    assert_eq!(list(&costs["rows"]).len() + list(&costs["not_recorded"]).len(), rows + 3, "{costs}");

    let (told, scene) = bench("--layers");
    let costs = &scene["layers"];
    let checks: Vec<_> =
        list(&costs["checks"]).iter().map(|own| own["checks"].as_str().expect("a name").to_owned()).collect();
    assert_eq!(checks[..3], ["no layer", "core", "core, synchronization"], "{costs}");
    assert_eq!(checks.len() + list(&costs["refused"]).len(), 6, "{costs}");
    for cost in list(&costs["checks"]) {
        let median = |key: &str| cost[key]["median"].as_f64().expect("a number");
        assert!(median("cpu_ms") >= median("record_ms") && median("wall_ms") >= median("record_ms"), "{cost}");
        assert_eq!(cost["ratio"].is_null(), cost["checks"] == "no layer", "{cost}");
        // Best practices are advice.
        assert!(cost["messages"] == 0 || cost["checks"] == "core, best practices", "{cost}");
    }
    assert!(told.contains(costs["layer"].as_str().expect("a version")), "{told}");
    fail(folder.path(), &["bench", "builtin:quad", "--layers", "--validate"], 2, &["--layers", "--validate"]);
}

/// Off a terminal there is no bar: lines say how far the cases have come, on standard error.
#[test]
fn stress_tells_in_lines_how_far_it_has_come() {
    let folder = folder();
    let cases = ["stress", "formulas/fresnel", "formulas/srgb", "--quick"];
    let told = text(&run(folder.path(), &cases).stderr);
    assert!(told.starts_with("case 1/2: formulas/fresnel, value 1/"), "{told}");
    let quiet = run(folder.path(), &[&cases[..], &["-q"]].concat());
    assert!(quiet.status.success() && quiet.stderr.is_empty(), "{}", text(&quiet.stderr));
}

#[test]
fn help_names_the_exit_codes_and_a_closed_pipe_is_no_error() {
    let folder = folder();
    let help = succeed(folder.path(), &["--help"]);
    for word in ["render", "bench", "inspect", "compare", "doctor", "Exit codes"] {
        assert!(help.contains(word), "{help}");
    }
    for command in ["render", "bench", "inspect", "compare", "doctor"] {
        assert!(succeed(folder.path(), &[command, "--help"]).contains("Examples:"), "{command}");
    }
}

#[test]
fn a_dropped_dependency_is_complained_of_and_one_that_is_not_there_is_told() {
    let folder = folder();
    let inspect = |name: &'static str| {
        let scene = ["inspect", "builtin:quad", "--light-path", "loop"];
        [&scene[..], &SMALL, &["--drop", name]].concat()
    };
    let verbose = |name| succeed(folder.path(), &[&inspect(name)[..], &["-v"]].concat());
    let told = verbose("geometry-to-lighting");
    assert!(told.contains("GEOMETRY -> LIGHTING") && told.contains("why it is there"), "{told}");
    assert!(told.contains("SYNC-HAZARD-") && told.contains(" times, as:"), "{told}");
    assert!(
        told.contains("The specification's rules:") && told.contains("of the target Depth: nothing orders"),
        "{told}"
    );
    let unheard = verbose("picture-to-host");
    assert!(unheard.contains("read after write of the read-back buffer: nothing orders COPY"), "{unheard}");
    assert!(unheard.contains("nothing") && unheard.contains("The specification says (Fences)"), "{unheard}");
    // The hall's shadow maps are cached by default.
    let shadows = ["inspect", "builtin:hall", "--light-path", "loop", "--drop", "shadow-reuse"];
    let told = succeed(folder.path(), &[&shadows[..], &SMALL].concat());
    // Old layers do not compare submissions, and then that is all that is said.
    assert!(told.contains("SYNC-HAZARD-") || told.contains("says nothing of these frames"), "{told}");
    fail(folder.path(), &inspect("geometry-to-lightning"), 2, &["did you mean \"geometry-to-lighting\"?", "read-back"]);
    fail(folder.path(), &inspect("frame-to-host"), 2, &["frame-to-host", "cannot be dropped"]);
    fail(folder.path(), &[&inspect("read-back")[..], &["--json"]].concat(), 2, &["--drop"]);
    // Layers are looked for elsewhere, but Debian 13's runner names their place itself.
    if std::env::var_os("AFTERLIGHT_RUNNER").is_none() {
        let nowhere = folder.path().join("none");
        let without_layer = |name| {
            let mut without = program();
            without.env("VK_LAYER_PATH", &nowhere).env("VK_EXPLICIT_LAYER_PATH", &nowhere).args(inspect(name));
            let output = without.output().expect("the program starts");
            assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
            text(&output.stdout).to_owned()
        };
        // The verdict of the proof and the picture need no layer, and the words are the same.
        let verdict = |told: &str| told.split("\n\n").nth(1).expect("what may go wrong").to_owned();
        for (name, adds) in
            [("geometry-to-lighting", "SYNC-HAZARD-"), ("picture-to-host", "No layer is known to notice")]
        {
            let told = without_layer(name);
            assert!(told.contains("VK_LAYER_KHRONOS_validation is not installed"), "{told}");
            assert!(told.contains("What a layer would add:\n") && told.contains(adds), "{told}");
            assert!(told.contains("The picture on this device: "), "{told}");
            assert_eq!(verdict(&told), verdict(&succeed(folder.path(), &inspect(name))));
        }
        let told = without_layer("all");
        assert!(told.contains("the specification's rules need") && !told.contains("the layer notices"), "{told}");
        assert!(
            told.lines().any(|line| line.split_whitespace().take(2).eq(["geometry-to-lighting", "hazard"])),
            "{told}"
        );
    }
}
