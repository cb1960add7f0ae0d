//! The program itself and the examples, as tests start them.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_afterlight");

/// Returns a command that starts the program on the Vulkan stack that the tests run on, through [`runner`] if there is one.
pub fn program() -> Command {
    start(Path::new(PROGRAM))
}

/// Returns a command that starts an example as [`program`] starts the program. `cargo test` builds the examples of other packages only with
/// `--workspace`.
pub fn example(name: &str) -> Command {
    let path = Path::new(PROGRAM).with_file_name("examples").join(name).with_extension(std::env::consts::EXE_EXTENSION);
    assert!(path.exists(), "{} is not there: type `cargo build --workspace --examples`", path.display());
    start(&path)
}

/// Returns the program that starts others on the Vulkan stack of the tests, where that is not the machine's own: `AFTERLIGHT_RUNNER`.
pub fn runner() -> Option<OsString> {
    std::env::var_os("AFTERLIGHT_RUNNER")
}

/// Returns a command that starts a program of this project as [`program`] does.
pub fn start(binary: &Path) -> Command {
    let mut command = Command::new(runner().unwrap_or_else(|| binary.into()));
    if runner().is_some() {
        command.arg(binary);
    }
    // Figures that were measured on this machine are ignored, so that plans follow from the kind of device alone.
    command.env("AFTERLIGHT_CALIBRATION", "");
    command
}
