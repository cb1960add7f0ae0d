//! Camera paths: the camera goes where a file says, and a path that is written is read again.

use std::path::Path;

use afterlight::scene::file::parse_path;
use afterlight::scene::{Camera, CameraPath, Projection};
use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::PATH;

fn read(text: &str) -> Result<CameraPath, String> {
    let camera = Camera { near: 0.25, projection: Projection::perspective(33.0), ..Camera::default() };
    parse_path(text, Path::new("walk.toml"), &camera).map_err(|error| error.to_string())
}

#[test]
fn keys_are_where_they_say_and_take_over_what_they_do_not() {
    let path = read(PATH).unwrap();
    let (start, end) = (path.at(0.0), path.at(path.seconds()));
    assert_eq!(
        (path.seconds(), start.position, end.position),
        (2.5, DVec3::new(0.0, 1.0, 5.0), DVec3::new(2.0, 1.0, 5.0))
    );
    assert!((start.up() - DVec3::X).length() < 1e-12 && (start.forward() - DVec3::NEG_Z).length() < 1e-12);
    assert!((end.forward() - DVec3::NEG_X).length() < 1e-12, "{end:?}");
    let lens = Projection::perspective(40.0);
    assert_eq!((start.projection, end.projection, start.near, end.near), (lens, lens, 0.25, 0.25));
    // Where no key says it, the scene's camera does.
    let still = read("[[keys]]\ntime = 0\n[[keys]]\ntime = 1\nposition = [1, 0, 0]\n").unwrap();
    assert_eq!((still.at(0.0).position, still.at(0.5).projection), (DVec3::Z * 5.0, Projection::perspective(33.0)));
}

#[test]
fn what_is_wrong_ends_in_one_line_that_names_file_line_and_key() {
    let key = "[[keys]]\ntime = 1\n";
    for (text, told) in [
        (String::new(), "walk.toml:1: camera path: a path has two keys or more, and not 0"),
        (key.into(), "walk.toml:1: camera path: a path has two keys or more, and not 1"),
        (
            format!("{key}[[keys]]\ntime = 1\n"),
            "walk.toml:4: keys[1].time = 1: must be after the 1 of the key before it",
        ),
        (format!("{key}[[keys]]\nposition = [1, 2, 3]\n"), "walk.toml:3: keys[1]: needs a time"),
        ("[[keys]]\ntime = -1\n".into(), "walk.toml:2: keys[0].time = -1: must be from 0 to 1e9 seconds"),
        ("[[keys]]\ntime = 1\nfov = 3\n".into(), "walk.toml:3: keys[0]: unknown key \"fov\""),
        (format!("{key}near = 1\n"), "walk.toml:3: keys[0]: unknown key \"near\""),
        (format!("{key}up = [0, 1, 0]\n"), "walk.toml:3: keys[0].up = [0, 1, 0]: up goes with target"),
        (
            format!("{key}[[keys]]\ntime = 2\northographic_height = 2\n"),
            "walk.toml:3: keys[1]: a path is either perspective or orthographic",
        ),
        ("[camera]\n".into(), "walk.toml:1: unknown key \"camera\""),
        ("[[keys]\n".into(), "walk.toml:1: "),
    ] {
        let error = read(&text).expect_err(&text);
        assert!(error.starts_with(told) && error.lines().count() == 1, "{error}\n{told}");
    }
}

proptest! {
    #[test]
    fn a_written_path_is_read_as_it_was(
        numbers in prop::collection::vec((0.001..1e3f64, -1e9..1e9f64, -3.0..3.0f64, 1.0..100.0f64), 2..5), parallel: bool,
    ) {
        let mut time = 0.0;
        let mut text = String::new();
        for (step, x, turn, lens) in numbers {
            time += step;
            let [i, j, k, w] = DQuat::from_euler(glam::EulerRot::XYZ, turn, turn * 0.7, 1.0).to_array();
            let lens = if parallel { format!("orthographic_height = {lens:?}") } else { format!("fov_y_degrees = {lens:?}") };
            text += &format!("[[keys]]\ntime = {time:?}\nposition = [{x:?}, {turn:?}, 0]\n{lens}\n");
            text += &format!("rotation = {{ quaternion = [{i:?}, {j:?}, {k:?}, {w:?}] }}\n");
        }
        let path = read(&text).unwrap();
        let again = read(&path.to_toml()).unwrap();
        prop_assert_eq!(path, again);
    }
}
