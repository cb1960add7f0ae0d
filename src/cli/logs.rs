//! Logs, on standard error.

use std::env::{self, VarError};
use std::io::{self, IsTerminal};

use tracing_subscriber::EnvFilter;

use super::failure::Failure;

/// The variable that holds a log filter, in the syntax of `tracing_subscriber::EnvFilter`. It wins over `-v`.
const VARIABLE: &str = "AFTERLIGHT_LOG";

/// Starts logging: warnings; with `-v` what is done, with `-vv` the details, with more everything of other crates too.
///
/// # Errors
/// When AFTERLIGHT_LOG holds no filter.
pub fn start(verbosity: u8) -> Result<(), Failure> {
    let wrong = |why: &dyn std::fmt::Display| Failure::usage(format!("{VARIABLE} holds no log filter: {why}"));
    let filter = match env::var(VARIABLE) {
        Ok(text) => EnvFilter::try_new(text).map_err(|error| wrong(&error))?,
        Err(VarError::NotPresent) => EnvFilter::new(match verbosity {
            // The window library warns of what an X server lacks, which does no harm.
            0 => "warn,winit=error",
            1 => "warn,winit=error,afterlight=info",
            2 => "info,afterlight=debug",
            _ => "trace",
        }),
        Err(error) => return Err(wrong(&error)),
    };
    let logs = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
    let logs = logs.with_ansi(io::stderr().is_terminal()).without_time().with_target(false);
    // Fails only when logging has been started before, which does no harm.
    let _ = logs.try_init();
    Ok(())
}
