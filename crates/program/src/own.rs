//! This program as one that is started again: its file, and the command that starts it on the libraries that it runs on.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf, absolute};

/// The command that starts programs on the Vulkan stack of this one, where that is not the system's (`scripts/on-newest`): loaders, drivers and C libraries
/// of two systems do not go together.
const RUNNER: &str = "AFTERLIGHT_RUNNER";

/// This program's own file. A program that a dynamic linker was told to start has its name from its command line.
///
/// # Errors
/// When the system does not say.
pub fn program() -> io::Result<PathBuf> {
    let own = env::current_exe()?;
    let is_linker = own.file_name().is_some_and(|name| name.to_string_lossy().starts_with("ld-"));
    match env::args_os().next().filter(|_| is_linker) {
        Some(name) => absolute(name),
        None => Ok(own),
    }
}

/// The words that start a program of this project: its path, behind `AFTERLIGHT_RUNNER` where that is set.
pub fn command(program: &Path) -> Vec<OsString> {
    let runner = env::var_os(RUNNER).filter(|runner| !runner.is_empty());
    runner.into_iter().chain([program.into()]).collect()
}
