//! The program when a call fails: it prints one line, ends with its exit code, and leaves the old picture as it was.

use std::fs;

use crate::common::failures_layer::{environment, folder};
use crate::common::program::program;

#[test]
fn the_program_ends_with_one_line_and_its_exit_code_and_leaves_the_old_picture_whole() {
    let layers = folder();
    for (words, code, part) in [
        ("vkCreateInstance:1:ERROR_INCOMPATIBLE_DRIVER", 4, "no usable Vulkan driver"),
        (
            "vkCreateDevice:1:ERROR_INITIALIZATION_FAILED",
            4,
            "by vkCreateDevice: Vulkan says ERROR_INITIALIZATION_FAILED",
        ),
        ("vkCreateImage:1:ERROR_OUT_OF_DEVICE_MEMORY", 3, "by vkCreateImage: out of memory"),
        ("vkQueueSubmit:2:ERROR_DEVICE_LOST", 4, "by vkQueueSubmit: the device is lost"),
        ("vkEndCommandBuffer:3:ERROR_OUT_OF_HOST_MEMORY", 3, "by vkEndCommandBuffer: out of memory"),
    ] {
        let work = tempfile::tempdir().expect("a temporary folder");
        let picture = work.path().join("x.png");
        fs::write(&picture, b"old").expect("it can be written");
        let mut command = program();
        command.args(["render", "builtin:triangle", "--size", "16x9", "--validate", "-o", "x.png"]);
        command.current_dir(work.path()).envs(environment(layers.path())).env("AFTERLIGHT_FAILURES", words);
        let output = command.output().expect("the program starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{words}: {told}");
        let errors: Vec<&str> = told.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.len() == 1 && errors[0].contains(part), "{words}: {told}");
        assert!(!told.contains("Validation"), "{words}: {told}");
        assert_eq!(fs::read(&picture).expect("it is there"), b"old", "{words}");
        assert_eq!(fs::read_dir(work.path()).expect("a folder").count(), 1, "{words}: a file is left");
    }
}
