//! Deliberate mistakes: what follows if a line of a step is deleted.

use crate::program::{FIRST_OF_NEWER, layer, layer_text, start, whole_if_possible};
use ash::vk;

/// The picture without the line.
#[derive(Debug, PartialEq)]
enum Shows {
    /// The right picture, on lavapipe.
    Right,
    Wrong,
    /// The right picture or another one, as threads happen to run.
    Either,
}

/// A line that `--without` leaves out, and what follows.
struct Mistake {
    name: &'static str,
    /// Part of a message of the layers 1.3.239, 1.4.309 and 1.4.363, and of those near them; empty where they are silent.
    says: [&'static str; 3],
    shows: Shows,
}

impl Mistake {
    /// All layers say the same.
    const fn says(name: &'static str, text: &'static str, shows: Shows) -> Self {
        Self { name, says: [text; 3], shows }
    }

    /// No layer notices.
    const fn is_unnoticed(name: &'static str, shows: Shows) -> Self {
        Self::says(name, "", shows)
    }
}

const FIRST_OF_NEWEST: u32 = vk::make_api_version(0, 1, 4, 330);

const LAYOUT_OF_OLDER: &str = "UNASSIGNED-CoreValidation-DrawState-InvalidImageLayout";
const LAYOUT: &str = "VUID-vkCmdDraw-None-09600";
const PRESENTED_LAYOUT: &str = "VUID-VkPresentInfoKHR-pImageIndices-01430";
const READ_AFTER_WRITE: &str = "SYNC-HAZARD-READ-AFTER-WRITE";
const WRITE_AFTER_READ: &str = "SYNC-HAZARD-WRITE-AFTER-READ";
const WRITE_AFTER_WRITE: &str = "SYNC-HAZARD-WRITE-AFTER-WRITE";

/// The host's reads are outside of what layers follow, and lavapipe has no cache of its own between device and host.
const PICTURE_TO_HOST: Mistake = Mistake::is_unnoticed("picture-to-host", Shows::Right);
/// Nobody can see when the host reads.
const FENCE: Mistake = Mistake::is_unnoticed("fence", Shows::Either);

fn check(step: &str, mistakes: &[Mistake]) {
    // The right picture, if it is needed.
    let mut right = None;
    if mistakes.iter().any(|mistake| mistake.shows != Shows::Either) {
        let Some(ended) = whole_if_possible(step) else { return };
        right = Some(ended.picture);
    }
    for Mistake { name, says, shows } in mistakes {
        let ended = start(step, Some(name));
        let on = format!("{step} without {name} on {}", layer_text());
        let said = match layer() {
            ..FIRST_OF_NEWER => says[0],
            FIRST_OF_NEWER..FIRST_OF_NEWEST => says[1],
            FIRST_OF_NEWEST.. => says[2],
        };
        match said.is_empty() {
            true => assert!(ended.succeeded, "{on}: expected silence, got: {}", ended.messages),
            false => assert!(ended.messages.contains(said), "{on}: expected {said}, got: {}", ended.messages),
        }
        match shows {
            Shows::Either => {}
            _ => {
                assert_eq!(
                    *shows == Shows::Right,
                    Some(ended.picture) == right,
                    "{on}: expected a picture that is {shows:?}"
                )
            }
        }
    }
}

/// The names in the calls of `Gpu::keep`.
#[test]
fn every_line_that_can_be_left_out_is_in_this_file() {
    let folder = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("the folder of the steps");
    let sources = folder.filter_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("main.rs")).ok());
    let mut names: Vec<_> = sources
        .flat_map(|source| {
            let calls = source.split("gpu.keep(\"").skip(1);
            calls.filter_map(|call| call.split_once('"')).map(|(name, _)| name.to_owned()).collect::<Vec<_>>()
        })
        .collect();
    names.sort_unstable();
    names.dedup();
    assert!(names.len() > 30, "{names:?}");
    names.retain(|name| !include_str!("mistakes.rs").contains(&format!("\"{name}\"")));
    assert!(names.is_empty(), "not tried: {names:?}");
}

#[test]
fn step_00() {
    check(
        "step-00-clear",
        &[
            Mistake { name: "new-to-clear", says: [LAYOUT_OF_OLDER, LAYOUT, LAYOUT], shows: Shows::Right },
            Mistake::says("read-back", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("clear-write", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("copy-read", READ_AFTER_WRITE, Shows::Right),
            PICTURE_TO_HOST,
            FENCE,
        ],
    );
}

#[test]
fn step_01() {
    check(
        "step-01-triangle",
        &[
            Mistake::says("reuse", WRITE_AFTER_READ, Shows::Right),
            Mistake::says("reuse-write", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("read-back", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("copy-read", READ_AFTER_WRITE, Shows::Right),
            PICTURE_TO_HOST,
            FENCE,
        ],
    );
}

#[test]
fn step_02() {
    check(
        "step-02-mesh",
        &[
            Mistake::says("upload-to-vertices", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("fetch", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("reuse", WRITE_AFTER_READ, Shows::Right),
            Mistake::says("last-depth", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("clear-depth", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("read-back", READ_AFTER_WRITE, Shows::Right),
        ],
    );
}

#[test]
fn step_03() {
    // All lights are dark: nothing fills the buffer.
    check("step-03-forward", &[Mistake::is_unnoticed("host-to-frame", Shows::Wrong)]);
}

#[test]
fn step_04() {
    check(
        "step-04-gbuffer",
        &[
            Mistake::says("gbuffer-reuse", WRITE_AFTER_READ, Shows::Right),
            Mistake::says("gbuffer-to-lighting", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("gbuffer-write", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("gbuffer-read", READ_AFTER_WRITE, Shows::Right),
        ],
    );
}

#[test]
fn step_05() {
    check(
        "step-05-subpasses",
        &[
            Mistake::says("gbuffer-reuse", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("last-drop", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("gbuffer-to-lighting", "SYNC-HAZARD-READ-RACING-WRITE", Shows::Right),
            // Older layers see whether two subpasses have a dependency, and not its masks.
            Mistake { name: "gbuffer-write", says: ["", WRITE_AFTER_WRITE, WRITE_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "gbuffer-read", says: ["", READ_AFTER_WRITE, READ_AFTER_WRITE], shows: Shows::Right },
            // The layout changes before the shader reads, and layers take the write of DONT_CARE as ordered after the read.
            Mistake::is_unnoticed("gbuffer-drop", Shows::Right),
            // It is allowed, and costs bandwidth alone: a GPU with tiles writes the G-buffer to memory and reads it back.
            Mistake::is_unnoticed("by-region", Shows::Right),
            Mistake::is_unnoticed("drop", Shows::Right),
            Mistake::says("reuse", WRITE_AFTER_READ, Shows::Right),
            Mistake::says("read-back", READ_AFTER_WRITE, Shows::Right),
        ],
    );
}

#[test]
fn step_05b() {
    check(
        "step-05b-local-read",
        &[
            Mistake::says("last-drop", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("last-depth", WRITE_AFTER_WRITE, Shows::Right),
            // Layers about 1.4.309 do not follow reads of attachments in a rendering.
            Mistake { name: "gbuffer-to-lighting", says: ["", "", READ_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "gbuffer-write", says: ["", "", READ_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "gbuffer-read", says: ["", "", READ_AFTER_WRITE], shows: Shows::Right },
            Mistake::is_unnoticed("gbuffer-drop", Shows::Right),
            // Inside a rendering the flag is required.
            Mistake::says("by-region", "VUID-vkCmdPipelineBarrier2-dependencyFlags-07891", Shows::Right),
            Mistake::says("read-back", READ_AFTER_WRITE, Shows::Right),
        ],
    );
}

#[test]
fn step_06() {
    check(
        "step-06-lean",
        &[
            Mistake::says("gbuffer-to-lighting", "SYNC-HAZARD-READ-RACING-WRITE", Shows::Right),
            Mistake { name: "depth-write", says: ["", WRITE_AFTER_WRITE, WRITE_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "gbuffer-write", says: ["", WRITE_AFTER_WRITE, WRITE_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "gbuffer-read", says: ["", READ_AFTER_WRITE, READ_AFTER_WRITE], shows: Shows::Right },
        ],
    );
    check(
        "step-06b-errors",
        &[
            // Layers take the change of layout, which comes before the tests, for what the tests wait for.
            Mistake::is_unnoticed("depth-test", Shows::Right),
            Mistake::is_unnoticed("errors-to-host", Shows::Right),
        ],
    );
}

#[test]
fn step_07() {
    check(
        "step-07-hdr",
        &[
            Mistake::says("hdr-reuse", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("hdr-to-tonemap", "SYNC-HAZARD-READ-RACING-WRITE", Shows::Right),
            Mistake { name: "hdr-write", says: ["", WRITE_AFTER_WRITE, WRITE_AFTER_WRITE], shows: Shows::Right },
            Mistake { name: "hdr-read", says: ["", READ_AFTER_WRITE, READ_AFTER_WRITE], shows: Shows::Right },
        ],
    );
}

#[test]
fn step_08() {
    check(
        "step-08-shadow",
        &[
            Mistake::says("shadow-reuse", WRITE_AFTER_READ, Shows::Right),
            Mistake::says("shadow-to-lighting", READ_AFTER_WRITE, Shows::Right),
            Mistake::says("shadow-write", WRITE_AFTER_WRITE, Shows::Right),
            Mistake::says("shadow-read", READ_AFTER_WRITE, Shows::Right),
            // Surfaces shadow themselves, in stripes.
            Mistake::is_unnoticed("bias", Shows::Wrong),
        ],
    );
}

/// No layer sees what the host writes. The program finds a frame that differs.
#[test]
fn step_09() {
    const DIFFERS: &str = "differs from the one that was drawn alone";
    check(
        "step-09-in-flight",
        &[Mistake::says("frame-to-host", DIFFERS, Shows::Either), Mistake::says("own-lights", DIFFERS, Shows::Either)],
    );
}

#[test]
fn step_10() {
    const NOT_FREE: &str = "VUID-vkAcquireNextImageKHR-semaphore-01286";
    const NOT_READY: &str = "SYNC-HAZARD-PRESENT-AFTER-WRITE";
    check(
        "step-10-window",
        &[
            // Nothing waits for the semaphore, so it is still signalled when it is used again.
            Mistake::says("acquire", NOT_FREE, Shows::Right),
            Mistake {
                name: "present",
                says: ["UNASSIGNED-CoreValidation-DrawState-QueueForwardProgress", NOT_READY, NOT_READY],
                shows: Shows::Right,
            },
            Mistake {
                name: "blit-to-present",
                says: ["VUID-VkPresentInfoKHR-pImageIndices-01296", PRESENTED_LAYOUT, PRESENTED_LAYOUT],
                shows: Shows::Right,
            },
        ],
    );
}
