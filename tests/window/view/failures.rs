//! Windows that stay open when calls of Vulkan fail: the surface is lost, or memory runs out for frames of another size.

use std::process::{Command, Stdio};

use afterlight_failures_layer::commands;

use crate::common::failures_layer::{environment, folder};
use crate::common::program::program;

use super::harness::{SIZE, Server, View, end, key, rendered, rgb, size_text, text, until};
use super::wayland::Compositor;

const SCENE: [&str; 1] = ["builtin:spheres"];
const OTHER: [u32; 2] = [200, 120];

/// A server whose programs have the layer on, told to let these calls fail.
fn server(folder: &tempfile::TempDir, words: &str) -> Server {
    let environment = [environment(folder.path()), vec![("AFTERLIGHT_FAILURES", words.into())]].concat();
    Server::start().with_environment(environment)
}

fn open(server: &Server) -> View<'_> {
    View::open(server, &[SCENE[0], "--size", &size_text(SIZE)])
}

#[test]
fn a_window_whose_surface_is_lost_goes_on_with_a_new_one_and_says_so() {
    let (layers, expected) = (folder(), rendered(SIZE, &SCENE));
    for words in ["vkAcquireNextImageKHR:1:ERROR_SURFACE_LOST_KHR", "vkQueuePresentKHR:1:ERROR_SURFACE_LOST_KHR"] {
        let server = server(&layers, words);
        let mut view = open(&server);
        view.waits_to_tell("warning: the window's surface was lost; frames go on with a new one");
        view.shows(&expected, words);
        server.tap(key::ESCAPE);
        view.ends_well();
    }
}

/// Returns how often a command is called until the window has shown its first picture and is closed.
fn calls(command: &str) -> u64 {
    let (layers, expected) = (folder(), rendered(SIZE, &SCENE));
    let server = server(&layers, "count");
    let mut view = open(&server);
    view.shows(&expected, "the first picture");
    server.tap(key::ESCAPE);
    let errors = view.ends_telling();
    let line = errors.lines().find(|line| line.trim_end().ends_with(command));
    let number = line.and_then(|line| line.split_whitespace().next()?.parse().ok());
    number.unwrap_or_else(|| panic!("{command} is not counted: {errors}"))
}

#[test]
fn a_window_without_memory_for_another_size_stays_and_tries_again() {
    let layers = folder();
    let expected = [rendered(SIZE, &SCENE), rendered(OTHER.map(|own| own as u16), &SCENE)];
    for (command, nth) in [("vkCreateSwapchainKHR", 2), ("vkCreateImage", calls("vkCreateImage") + 1)] {
        let server = server(&layers, &format!("{command}:{nth}:ERROR_OUT_OF_DEVICE_MEMORY"));
        let mut view = open(&server);
        view.shows(&expected[0], command);
        view.resize(OTHER);
        view.waits_to_tell(&format!("by {command}: out of memory; the window keeps its last picture and tries again"));
        until("the other size", || (view.size() == OTHER.map(|own| own as u16)).then_some(()));
        view.shows(&expected[1], command);
        server.tap(key::ESCAPE);
        view.ends_well();
    }
}

/// Holds that a window whose surface cannot be created, with each result of its command, is one error and exit code 3: both results are a lack of memory.
fn surfaces_fail(command: &str, has_for: impl Fn(&mut Command)) {
    let layers = folder();
    let known = commands().find(|known| known.name == command).expect("a command that the layer knows");
    for (result, _) in known.results() {
        let words = format!("{command}:1:{result}");
        let mut program = program();
        has_for(&mut program);
        program.envs(environment(layers.path())).env("AFTERLIGHT_FAILURES", &words);
        program.args(["view", SCENE[0], "--validate", "--size", &size_text(SIZE)]);
        program.stdout(Stdio::piped()).stderr(Stdio::piped());
        let output = end(program.spawn().expect("the program starts"));
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{words}: {told}");
        let errors: Vec<&str> =
            told.lines().filter(|line| !line.starts_with("VK_LAYER_AFTERLIGHT_failures: ")).collect();
        let expected = format!("creating the window's surface by {command}: out of memory");
        assert!(matches!(errors[..], [error] if error == format!("error: {expected}")), "{words}: {told}");
    }
}

#[test]
fn a_window_whose_surface_cannot_be_created_is_one_error_on_x11() {
    let server = Server::start();
    surfaces_fail("vkCreateXlibSurfaceKHR", |program| server.serves(program));
}

#[test]
fn a_window_whose_surface_cannot_be_created_is_one_error_under_wayland() {
    let compositor = Compositor::start();
    surfaces_fail("vkCreateWaylandSurfaceKHR", |program| compositor.has_for(program));
}

#[test]
fn a_window_without_memory_for_a_new_surface_stays_and_tries_again() {
    let (layers, expected) = (folder(), rendered(SIZE, &SCENE));
    let words = "vkAcquireNextImageKHR:1:ERROR_SURFACE_LOST_KHR,vkCreateXlibSurfaceKHR:2:ERROR_OUT_OF_DEVICE_MEMORY";
    let server = server(&layers, words);
    let mut view = open(&server);
    view.waits_to_tell("by vkCreateXlibSurfaceKHR: out of memory; the window keeps its last picture and tries again");
    view.waits_to_tell("warning: the window's surface was lost; frames go on with a new one");
    view.shows(&expected, words);
    server.tap(key::ESCAPE);
    view.ends_well();
}

#[test]
fn a_screenshot_that_lacks_memory_comes_with_a_later_frame() {
    let (layers, expected) = (folder(), rendered(SIZE, &SCENE));
    let command = "vkInvalidateMappedMemoryRanges";
    let server = server(&layers, &format!("incoherent,{command}:1:ERROR_OUT_OF_DEVICE_MEMORY"));
    let mut view = open(&server);
    view.shows(&expected, "the first picture");
    server.tap(key::P);
    view.waits_to_tell(&format!("by {command}: out of memory; the window keeps its last picture and tries again"));
    view.waits_to_tell("screenshot: ");
    assert!(rgb(&view.folder.path().join("afterlight-0001.png")) == expected);
    server.tap(key::ESCAPE);
    view.ends_well();
}
