//! What one sees of a model at first: the light that it stands in, all models of a folder, a turntable, a picture without its background.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use image::{DynamicImage, Rgba};
use tempfile::TempDir;

use crate::common::program::program;

/// A cube of two metres.
const CUBE: &str = "v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\nv 1 2 1\nv -1 2 1\n\
                    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";

/// A folder with a cube, a deeper one with another, and a file that is no model inside.
fn models() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("deep")).expect("a folder");
    for (name, text) in [("a.obj", CUBE), ("deep/b.obj", CUBE), ("c.glb", "no model")] {
        fs::write(folder.path().join(name), text).expect("written");
    }
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program().current_dir(folder).args(arguments).output().expect("the program starts")
}

/// Runs `render` with small pictures, and returns its output.
fn render(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = run(folder, &[&["render", "--size", "48x36", "--samples", "2"], arguments].concat());
    let told = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {told}");
    told
}

fn picture(folder: &Path, name: &str) -> DynamicImage {
    image::open(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn a_folder_is_a_sheet_with_a_tile_for_each_model_and_one_that_fails_keeps_no_other() {
    let folder = models();
    let told = render(folder.path(), &[".", "-o", "sheet.png"], 3);
    assert!(told.contains("c.glb failed: ") && told.contains("1 of 3 scenes failed: "), "{told}");
    let sheet = picture(folder.path(), "sheet.png").into_rgb8();
    // Two columns for three models, and some of the grey that the studio has behind them.
    let grey = sheet.pixels().filter(|pixel| pixel.0[0] > 200 && pixel.0[0] == pixel.0[2]).count();
    assert!(sheet.width() > 96 && sheet.height() > 72 && grey > 800 && grey < 2 * 48 * 36 + 2000, "{grey}");
    fs::remove_file(folder.path().join("c.glb")).expect("removed");
    render(folder.path(), &[".", "-o", "{name}.png"], 0);
    assert_eq!(picture(folder.path(), "a.png"), picture(folder.path(), "b.png"));
    let told = render(folder.path(), &[".", "-o", "sheet.png", "--transparent"], 2);
    assert!(told.contains("need one picture a model"), "{told}");
}

#[test]
fn a_turntable_goes_around_and_a_video_is_made_where_there_is_an_encoder() {
    let folder = models();
    render(folder.path(), &["a.obj", "--turntable", "3", "-o", "turn.png"], 0);
    let turned: Vec<DynamicImage> =
        (0..3).map(|index| picture(folder.path(), &format!("turn-000{index}.png"))).collect();
    assert!(turned[0] != turned[1] && turned[1] != turned[2] && turned[0] != turned[2]);
    let told = render(folder.path(), &["a.obj", "-o", "one.mp4"], 2);
    assert!(told.contains("one.mp4 is a video, of several pictures"), "{told}");
    let told = render(folder.path(), &["a.obj", "--turntable", "3", "--camera", "0,1,9/0,1,0", "-o", "turn.png"], 2);
    assert!(told.contains("--turntable") && told.contains("--camera"), "{told}");
    let encoded = |bin: PathBuf| {
        let mut command = program();
        command.current_dir(folder.path()).env("PATH", bin);
        command.args(["render", "a.obj", "--size", "48x36", "--samples", "1", "--turntable", "3", "-o", "turn.webm"]);
        let output = command.output().expect("the program starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, told) = encoded(folder.path().join("deep"));
    assert!(code == Some(3) && told.contains("needs ffmpeg") && !folder.path().join("turn.webm").exists(), "{told}");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let bin = folder.path().join("bin");
        fs::create_dir(&bin).expect("a folder");
        let encoder = |text: &str| {
            fs::write(bin.join("ffmpeg"), text).expect("written");
            fs::set_permissions(bin.join("ffmpeg"), fs::Permissions::from_mode(0o755)).expect("executable");
        };
        // The last argument is the file; this encoder writes the pictures into it unchanged.
        encoder("#!/bin/sh\nfor last; do :; done\n/bin/cat >\"$last\"\n");
        let (code, told) = encoded(bin.clone());
        let video = fs::read(folder.path().join("turn.webm")).unwrap_or_else(|error| panic!("{error}: {told}"));
        assert_eq!((code, video.windows(4).filter(|bytes| bytes == b"IHDR").count()), (Some(0), 3), "{told}");
        encoder("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n");
        let (code, told) = encoded(bin);
        assert!(code == Some(3) && told.contains("ffmpeg could not encode the video: "), "{told}");
        assert!(
            fs::read(folder.path().join("turn.webm")).expect("still there") == video,
            "a failure keeps what was there"
        );
    }
}

#[test]
fn a_picture_without_its_background_has_the_model_s_alpha_and_colours() {
    let folder = models();
    render(folder.path(), &["a.obj", "-o", "whole.png", "--ao", "off"], 0);
    render(folder.path(), &["a.obj", "-o", "clear.png", "--ao", "off", "--transparent"], 0);
    let (whole, clear) =
        (picture(folder.path(), "whole.png").into_rgb8(), picture(folder.path(), "clear.png").into_rgba8());
    assert_eq!(clear.get_pixel(0, 0), &Rgba([0, 0, 0, 0]));
    let own = clear.get_pixel(24, 18);
    assert_eq!((own.0[3], &own.0[..3]), (255, &whole.get_pixel(24, 18).0[..]));
    // Pixels along the edge are partly covered.
    assert!(clear.pixels().any(|pixel| (1..255).contains(&pixel.0[3])));
    render(folder.path(), &["a.obj", "-o", "clear.exr", "--transparent"], 0);
    let light = picture(folder.path(), "clear.exr").into_rgba32f();
    assert_eq!((light.get_pixel(0, 0).0, light.get_pixel(24, 18).0[3]), ([0.0; 4], 1.0));
    for (arguments, why) in [
        (["--bloom", "0.1"], "does not go with bloom"),
        (["--fog", "height"], "does not go with fog"),
        (["--frames", "2"], "draws the lit picture twice"),
        (["--view", "depth"], "draws the lit picture twice"),
    ] {
        let told = render(folder.path(), &[&["a.obj", "-o", "no.png", "--transparent"], &arguments[..]].concat(), 2);
        assert!(told.contains(why), "{told}");
    }
    assert!(!folder.path().join("no.png").exists());
}

#[test]
fn light_is_chosen_by_words_for_bare_models_alone() {
    let folder = models();
    let shown = |light: &str| {
        render(folder.path(), &["a.obj", "-o", "lit.png", "--light", light], 0);
        picture(folder.path(), "lit.png")
    };
    assert!(shown("studio") != shown("sun"));
    for (arguments, code, why) in [
        (["a.obj", "--light", "file"], 3, "has no light of its own"),
        (["builtin:quad", "--light", "studio"], 3, "--light is for a bare model"),
        (["a.obj", "--light", "none.hdr"], 3, "none.hdr"),
        (["a.obj", "--light", "moon"], 2, "expected studio, sun, file, both"),
    ] {
        let told = render(folder.path(), &arguments, code);
        assert!(told.contains(why), "{told}");
    }
}
