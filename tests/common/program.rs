//! The program itself, as tests start it.

use std::process::Command;

/// Returns a command that starts the program on the Vulkan stack that the tests run on: `AFTERLIGHT_RUNNER`, where set, names what starts programs there.
pub fn program() -> Command {
    let binary = env!("CARGO_BIN_EXE_afterlight");
    let Some(runner) = std::env::var_os("AFTERLIGHT_RUNNER") else { return Command::new(binary) };
    let mut command = Command::new(runner);
    command.arg(binary);
    command
}
