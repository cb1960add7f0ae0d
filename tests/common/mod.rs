//! Code that several tests share.

// Each group of tests is a separate program and uses only a part of this module.
#![allow(dead_code)]

pub mod compare;
pub mod failures_layer;
#[cfg(feature = "report")]
pub mod golden;
pub mod gpu;
pub mod hdr;
pub mod moving;
pub mod plain_gltf;
pub mod program;
pub mod scenes;
pub mod stage;
pub mod truth;
pub mod whole;

use std::path::PathBuf;

use afterlight::plan::Capabilities;

/// Returns true in `make test-all`, where long tests try all of their cases; in `make test` they try some.
pub fn tries_all() -> bool {
    std::env::var("AFTERLIGHT_TESTS").is_ok_and(|value| value == "all")
}

/// Returns all of the cases in `make test-all`, and in `make test` the first of every `every`.
pub fn some_of<T>(cases: impl IntoIterator<Item = T>, every: usize) -> impl Iterator<Item = T> {
    cases.into_iter().step_by(if tries_all() { 1 } else { every })
}

/// Returns all of the cases in `make test-all`, and in `make test` every `every`-th of them, beginning with the one whose turn it is. For
/// inner loops over many cases: with the outer loop's index as `turn`, each case comes up in some of the outer loop's rounds.
pub fn some_in_turn<T: Copy>(cases: &[T], turn: usize, every: usize) -> impl Iterator<Item = T> {
    let (first, step) = if tries_all() { (0, 1) } else { (turn % every, every) };
    cases.iter().copied().skip(first).step_by(step)
}

/// Returns all of the cases in `make test-all`, and in `make test` the one whose turn it is. For inner loops: with the sum of the outer loops'
/// indices as `turn`, each value of an outer loop meets each case.
pub fn one_of<T>(cases: &[T], turn: usize) -> &[T] {
    let index = turn % cases.len();
    if tries_all() { cases } else { &cases[index..=index] }
}

/// Returns the folder of third-party scenes: `AFTERLIGHT_SCENES`, else `../shared/scenes` beside the project. Prints a note and returns `None` if the
/// folder does not exist; the caller then skips the tests that need it.
pub fn scenes_dir() -> Option<PathBuf> {
    let folder = match std::env::var_os("AFTERLIGHT_SCENES") {
        Some(folder) => PathBuf::from(folder),
        None => PathBuf::from(env!("AFTERLIGHT_ROOT")).join("../shared/scenes"),
    };
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: no scenes in {} (set AFTERLIGHT_SCENES to their folder)", folder.display());
    None
}

/// A usual GPU, for plans that are made without one.
pub fn capabilities() -> Capabilities {
    Capabilities { max_layers: 256, msaa: 1, compute_invocations: 256, ..Capabilities::ample() }
}
