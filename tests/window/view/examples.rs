//! The library in a window of the caller's own.

use super::harness::{Server, View, rendered, text};
use crate::common::program::example;

#[test]
fn a_window_of_the_callers_own_shows_what_render_draws() {
    let server = Server::start();
    let mut view = View::example(&server, "own_window", &["builtin:spheres"]);
    let size = view.size();
    let expected = rendered(size, &["builtin:spheres"]);
    view.shows(&expected, "the example's window");
    view.resize([320, 200]);
    let smaller = rendered([320, 200], &["builtin:spheres"]);
    view.shows(&smaller, "the same, smaller");
    view.close();
    let (code, _, errors) = view.ends();
    assert_eq!(code, Some(0), "{errors}");
}

#[test]
fn a_model_is_shown_for_some_frames() {
    let server = Server::start();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join("model.obj");
    std::fs::write(&model, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    let mut command = example("own_window");
    server.serves(&mut command);
    let output = command.arg(&model).arg("4").output().expect("the example starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
}
