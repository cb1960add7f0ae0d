//! `render --path` and `bench --path`: each picture is drawn from its moment's camera, and a path that cannot be drawn is refused before its first
//! picture.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::program::program;

use afterlight::scene::file::load_path;
use afterlight::scene::{OpenOptions, open};
use serde_json::Value;
use tempfile::TempDir;

const SCENE: &str = "builtin:spheres";
/// Three moments at two pictures a second: both keys and halfway. It zooms, and looks along -Z so that `--camera` can say the same.
const WALK: &str = "\
[[keys]]
time = 2
position = [0, 1.5, 6]
target = [0, 1.5, 0]
fov_y_degrees = 60

[[keys]]
time = 3
position = [1, 2.5, 4]
fov_y_degrees = 40
";

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = program();
    command.current_dir(folder).args(arguments).output().expect("the program starts")
}

fn succeed(folder: &TempDir, arguments: &[&str]) -> Vec<u8> {
    let output = run(folder.path(), arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("walk.toml"), WALK).expect("a writable folder");
    folder
}

fn files(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into()).collect();
    names.sort();
    names
}

#[test]
fn each_picture_is_that_of_its_camera() {
    let folder = folder();
    let common = ["render", SCENE, "--size", "96x54", "--validate", "--samples", "2"];
    let render = |more: &[&str]| succeed(&folder, &[&common[..], more].concat());
    let table = render(&["--path", "walk.toml", "--fps", "2", "-o", "out.png"]);
    assert!(String::from_utf8_lossy(&table).contains("out-0000.png to out-0002.png"));
    assert_eq!(files(&folder), ["out-0000.png", "out-0001.png", "out-0002.png", "walk.toml"]);
    let scene = open(SCENE, &OpenOptions::default()).expect("is built in");
    let path = load_path(&folder.path().join("walk.toml"), &scene.camera).expect("is a path");
    let pixels = |name: &str| fs::read(folder.path().join(name)).expect("a picture");
    let mut stream = Vec::new();
    for (index, seconds) in [0.0, 0.5, 1.0].into_iter().enumerate() {
        let camera = path.at(seconds);
        let [x, y, z] = camera.position.to_array();
        let fov = 2.0 * camera.half_height().atan().to_degrees();
        let camera = format!("{x:?},{y:?},{z:?}/{x:?},{y:?},{:?}/{fov:?}", z - 1.0);
        render(&["--camera", &camera, "-o", "still.png"]);
        let own = pixels(&format!("out-{index:04}.png"));
        let still = image::load_from_memory(&pixels("still.png")).expect("a PNG").into_rgb8();
        let moving = image::load_from_memory(&own).expect("a PNG").into_rgb8();
        // The angle went through its tangent and a decimal text: a pixel at an edge may see another surface.
        let other = still
            .pixels()
            .zip(moving.pixels())
            .filter(|(still, moving)| still.0.iter().zip(&moving.0).any(|(still, moving)| still.abs_diff(*moving) > 1));
        assert!(other.count() <= 5, "{index}");
        assert!(still.pixels().any(|pixel| pixel.0 != still.get_pixel(0, 0).0), "{index} shows nothing");
        stream.extend(own);
    }
    let streamed = render(&["--path", "walk.toml", "--fps", "2", "-o", "-"]);
    assert!(streamed == stream, "standard output has not the same pictures one after another");
}

#[test]
fn a_benchmark_tells_each_moment_and_the_slowest() {
    let folder = folder();
    let scene = ["bench", SCENE, "--size", "64x36", "--path", "walk.toml", "--frames", "5", "--warmup", "1"];
    let vary = ["--vary", "shadows=off", "--json", "bench.json"];
    let table = succeed(&folder, &[&scene[..], &vary].concat());
    let table = String::from_utf8_lossy(&table).into_owned();
    let slowest = table.lines().find(|line| line.trim_start().starts_with("slowest along the path")).expect("a row");
    let json = fs::read_to_string(folder.path().join("bench.json")).expect("a report");
    let report: Value = serde_json::from_str(&json).expect("is JSON");
    let scene = &report["scenes"][0];
    assert_eq!((&scene["path"]["file"], &scene["path"]["seconds"]), (&"walk.toml".into(), &1.0.into()));
    for run in scene["runs"].as_array().expect("runs") {
        let moments = run["moments"].as_array().expect("moments");
        let times: Vec<f64> = moments.iter().map(|moment| moment["at_s"].as_f64().expect("a time")).collect();
        assert_eq!(times, [0.0, 0.25, 0.5, 0.75, 1.0]);
        let walls: Vec<f64> = moments.iter().map(|moment| moment["wall_ms"].as_f64().expect("a time")).collect();
        let longest = walls.iter().copied().fold(0.0, f64::max);
        assert_eq!(run["wall_ms"]["max"].as_f64(), Some(longest));
        // A column whose text equals the first column's stays empty, so the row has each text at least once.
        let told = moments.iter().filter(|moment| moment["wall_ms"].as_f64() == Some(longest)).any(|moment| {
            let at = moment["at_s"].as_f64().expect("a time");
            slowest.contains(&format!(" at {at:.2} s, with {} triangles", moment["triangles"]))
        });
        assert!(told, "{slowest}: {moments:?}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_no_file() {
    let folder = folder();
    fs::write(folder.path().join("long.toml"), WALK.replace("time = 3", "time = 1e8")).expect("a writable folder");
    fs::write(folder.path().join("bad.toml"), WALK.replace("time = 3", "time = 1")).expect("a writable folder");
    let refused = |arguments: &[&str], code: i32, told: &str| {
        let output = run(folder.path(), &[&["render", SCENE, "-o", "out.png"], arguments].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
        let line = errors.lines().find(|line| line.starts_with("error: ")).expect("an error");
        assert!(line.contains(told), "{arguments:?}: {errors}");
    };
    refused(&["--path", "none.toml"], 3, "none.toml");
    refused(&["--path", "bad.toml"], 3, "bad.toml:8: keys[1].time = 1: must be after the 2");
    refused(&["--path", "long.toml"], 2, "at most 1e6");
    refused(&["--path", "walk.toml", "--fps", "0"], 2, "0.001");
    refused(&["--path", "walk.toml", "--frames", "3"], 2, "--frames");
    refused(&["--path", "walk.toml", "--view", "all"], 2, "--view all");
    refused(&["--fps", "3"], 2, "--path");
    assert_eq!(files(&folder), ["bad.toml", "long.toml", "walk.toml"]);
}
