//! The promise that fuzzing checks: any bytes end in something that can be used, or in an error of one line.

mod files;
mod scenes;

/// A reader, which panics where it breaks the promise.
pub struct Target {
    /// Of its binary and of its folder below `corpus`.
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

/// Reads bytes by the reader of this name.
///
/// # Panics
/// Where the promise is broken, and where there is no such reader.
pub fn read(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|target| target.name == name);
    (target.unwrap_or_else(|| panic!("no reader is called {name}")).read)(bytes);
}

/// Errors are one line.
fn is_one_line(error: &impl std::fmt::Display) {
    let text = error.to_string();
    assert!(!text.is_empty() && !text.contains('\n'), "an error of several lines: {text:?}");
}
