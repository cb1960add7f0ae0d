//! The promise that fuzzing checks: any bytes end in something that can be used, or in an error of one line.

use std::fs;
use std::path::PathBuf;

mod files;
mod scenes;

/// A reader, which panics where it breaks the promise.
pub struct Target {
    /// The name of its binary and of its folder below `corpus`.
    pub name: &'static str,
    /// Reads bytes as the file would hold them.
    pub read: fn(&[u8]),
}

/// All readers.
pub const TARGETS: [Target; 12] = [
    Target { name: "gltf", read: scenes::gltf },
    Target { name: "obj", read: scenes::obj },
    Target { name: "mtl", read: scenes::mtl },
    Target { name: "scene", read: scenes::scene },
    Target { name: "path", read: scenes::path },
    Target { name: "settings", read: scenes::settings },
    Target { name: "image", read: scenes::image },
    Target { name: "sky_hdr", read: scenes::sky_hdr },
    Target { name: "sky_exr", read: scenes::sky_exr },
    Target { name: "journal", read: files::journal },
    Target { name: "pipeline_cache", read: files::pipeline_cache },
    Target { name: "truth", read: files::truth },
];

/// Crates whose panics the program turns into errors.
#[cfg(fuzzing)]
const FENCED: [&str; 1] = ["/zune-jpeg-"];

/// libFuzzer's program ends at each panic, also at one that is caught: those of fenced crates are let through.
#[cfg(fuzzing)]
fn let_fenced_panics_through() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let ends = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let of = |name: &&str| panic.location().is_some_and(|place| place.file().contains(name));
            if !FENCED.iter().any(|name| of(name)) {
                ends(panic);
            }
        }));
    });
}

/// Reads bytes by the reader of this name.
///
/// # Panics
/// When the promise is broken, or there is no such reader.
pub fn read(name: &str, bytes: &[u8]) {
    #[cfg(fuzzing)]
    let_fenced_panics_through();
    let target = TARGETS.iter().find(|target| target.name == name);
    (target.unwrap_or_else(|| panic!("no reader is called {name}")).read)(bytes);
}

/// A folder of this process, empty. Statics are never dropped: tests have theirs in the build's folder, and fuzzing in the one that `TMPDIR` names.
fn folder(name: &str) -> PathBuf {
    let base = option_env!("CARGO_TARGET_TMPDIR").map_or_else(std::env::temp_dir, PathBuf::from);
    let folder = base.join(format!("readers-{}", std::process::id())).join(name);
    fs::create_dir_all(&folder).expect("a folder that can be written");
    folder
}

/// Errors are one line.
fn is_one_line(error: &impl std::fmt::Display) {
    let text = error.to_string();
    assert!(!text.is_empty() && !text.contains('\n'), "an error of several lines: {text:?}");
}
