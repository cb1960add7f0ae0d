//! Windows that stay open when calls of Vulkan fail: where a surface is lost, and where there is no memory for frames of another size.

use crate::common::failures_layer::{environment, folder};

use super::harness::{SIZE, Server, View, key, rendered, size_text, until};

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
