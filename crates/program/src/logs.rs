//! Logs, on standard error.

use std::env::{self, VarError};

use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;

use super::failure::Failure;

/// The variable that holds a log filter: levels, each with the crate or module that it is for, as `warn,afterlight::plan=debug`. It wins
/// over `-v`.
const VARIABLE: &str = "AFTERLIGHT_LOG";

/// Starts logging: warnings; with `-v` steps, with `-vv` their details, with more everything of other crates too.
pub fn start(verbosity: u8) -> Result<(), Failure> {
    let wrong = |why: &dyn std::fmt::Display| Failure::usage(format!("{VARIABLE} holds no log filter: {why}"));
    let parse = |text: &str| text.parse::<Targets>().map_err(|error| wrong(&error));
    let filter = match env::var(VARIABLE) {
        Ok(text) => parse(&text)?,
        Err(VarError::NotPresent) => parse(match verbosity {
            // The window library warns of extensions that an X server lacks, which does no harm.
            0 => "warn,winit=error",
            1 => "warn,winit=error,afterlight=info",
            2 => "info,afterlight=debug",
            _ => "trace",
        })?,
        Err(error) => return Err(wrong(&error)),
    };
    // The stream drops colours as the command line's does: without a terminal, and where TERM or NO_COLOR says so. It converts them for an old
    // console of Windows.
    let lines = tracing_subscriber::fmt::layer().with_writer(anstream::stderr).with_ansi(true);
    let lines = lines.without_time().with_target(false);
    // Fails only when logging has been started before, which does no harm.
    let _ = tracing_subscriber::registry().with(lines).with(filter).try_init();
    Ok(())
}
