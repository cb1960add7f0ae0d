//! What several tests share.

// Each test file is a program of its own and uses a part of this.
#![allow(dead_code)]

pub mod compare;
#[cfg(feature = "report")]
pub mod golden;
pub mod gpu;
pub mod scenes;
pub mod stage;
pub mod truth;

use std::path::PathBuf;

/// The folder of third-party scenes: `AFTERLIGHT_SCENES`, else `../shared/scenes` beside the project. Where it is absent,
/// says so and returns none; the caller then skips what needs it.
pub fn scenes_dir() -> Option<PathBuf> {
    let folder = match std::env::var_os("AFTERLIGHT_SCENES") {
        Some(folder) => PathBuf::from(folder),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"),
    };
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: no scenes in {} (set AFTERLIGHT_SCENES to their folder)", folder.display());
    None
}
