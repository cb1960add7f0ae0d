//! Why a command failed: one line for people and one exit code for scripts.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::process::ExitCode;

use afterlight::{frame, gpu, plan, scene};
use afterlight_lab::stress;
#[cfg(feature = "window")]
use afterlight_window as window;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// The classes of failure; a later one is graver. `EXIT_CODES` says the same in the help.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// A check is better than `afterlight ci` was told to expect.
    #[cfg_attr(not(feature = "ci"), expect(dead_code, reason = "only ci has expectations"))]
    Improved,
    /// The work was done, and a check on it failed.
    FailedCheck,
    /// The command line cannot be understood or asks for something that does not exist.
    Usage,
    /// An input cannot be used, this device cannot hold it, or the output cannot be written.
    BadInput,
    /// There is no loader, driver, layer or device to work with, or it failed.
    NoVulkan,
    /// There is no display to open a window on, or it went away.
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only a window needs a display"))]
    NoDisplay,
}

impl Exit {
    /// Returns the program's exit code.
    pub fn code(self) -> u8 {
        match self {
            Self::FailedCheck => 1,
            // deqp-runner has this code for improvements; `afterlight ci` has none for usage.
            Self::Improved | Self::Usage => 2,
            Self::BadInput => 3,
            Self::NoVulkan => 4,
            Self::NoDisplay => 5,
        }
    }
}

/// The exit codes as the help lists them.
pub const EXIT_CODES: &str = "\
Exit codes:
  0  success
  1  a check failed: with --validate, the validation layer had something to say
     that is not advice, or frames need what --drop leaves out; check-row finds a
     hazard or a mask that is too wide; pictures differ by more than --max, nothing
     keeps the bound of tune or nothing can verify it, a claim of stress does not
     hold, or a case of ci is worse than expected
  2  usage: an option or its value is wrong, or no device has the number or name
     given (ci: 3); a case of ci is only better than expected
  3  bad input: a scene cannot be read or is too large for the device, or the
     output cannot be written
  4  no usable Vulkan: no loader, driver or validation layer, or the driver failed
  5  no display: view has no window system to open a window on, or it went away";

/// An error with its exit code, ready to be printed.
#[derive(Debug)]
pub struct Failure {
    /// `None`: the reader of the output has closed the pipe, and the program ends without a word.
    exit: Option<Exit>,
    message: String,
    hint: Option<String>,
}

impl Failure {
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit: Some(exit), message: message.into(), hint: None }
    }

    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// Adds the place in the input that is to blame.
    pub fn with_place(self, place: &str) -> Self {
        Self { message: format!("{} ({place})", self.message), ..self }
    }

    /// Sets another exit code.
    #[cfg(feature = "ci")]
    pub fn with_exit(self, exit: Exit) -> Self {
        Self { exit: Some(exit), ..self }
    }

    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    /// A failed write to the file or stream that `target` names, with the system's reason.
    pub fn write(target: &str, error: &io::Error) -> Self {
        Self::new(Exit::BadInput, format!("cannot write {target}: {error}"))
    }

    /// A failed write to standard output; a closed pipe, as `| head` leaves it, is no error.
    pub fn stdout(error: &io::Error) -> Self {
        let failure = Self::write("to standard output", error);
        if error.kind() == io::ErrorKind::BrokenPipe { Self { exit: None, ..failure } } else { failure }
    }

    /// The message as one line, as [`Failure::report`] prints it.
    pub fn one_line(&self) -> String {
        one_line(&self.message)
    }

    /// The message.
    pub fn message(&self) -> &str {
        &self.message
    }

    pub fn exit(&self) -> Option<Exit> {
        self.exit
    }

    /// Returns true if it ends the program without a word and with success.
    pub fn is_quiet(&self) -> bool {
        self.exit.is_none()
    }

    /// Turns clap's error into a failure: its first paragraph as one line, its tip as the hint.
    pub fn from_clap(error: &clap::Error) -> Self {
        let text = error.render().to_string();
        let mut paragraphs = text.split("\n\n").map(|paragraph| {
            let lines: Vec<&str> = paragraph.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
            lines.join(" ")
        });
        let message = paragraphs.next().unwrap_or_default();
        let tip = paragraphs.find_map(|paragraph| paragraph.strip_prefix("tip: ").map(str::to_owned));
        let failure = Self::usage(message.strip_prefix("error: ").unwrap_or(&message));
        // The tip to pass an option as a value helps nobody here.
        let tip = tip.filter(|tip| !tip.starts_with("to pass "));
        let lacks_name = matches!(error.kind(), ErrorKind::UnknownArgument | ErrorKind::MissingRequiredArgument);
        let general = || lacks_name.then(|| "--help lists the options and their values".to_owned());
        match tip.or_else(|| missing_option(error)).or_else(general) {
            Some(hint) => failure.with_hint(hint),
            // The message has said why the value is wrong.
            None => failure,
        }
    }

    /// Prints the failure on standard error and gives the exit code.
    pub fn report(&self) -> ExitCode {
        let Some(exit) = self.exit else { return ExitCode::SUCCESS };
        let mut text = format!("error: {}\n", one_line(&self.message));
        if let Some(hint) = &self.hint {
            let _ = writeln!(text, "hint: {}", one_line(hint));
        }
        // If standard error is closed, only the exit code is left.
        let _ = io::stderr().write_all(text.as_bytes());
        ExitCode::from(exit.code())
    }

    #[cfg(test)]
    fn text(&self) -> (Option<Exit>, &str, Option<&str>) {
        (self.exit, &self.message, self.hint.as_deref())
    }
}

impl From<scene::Error> for Failure {
    fn from(error: scene::Error) -> Self {
        Self::new(Exit::BadInput, with_causes(&error))
    }
}

impl From<gpu::Error> for Failure {
    fn from(error: gpu::Error) -> Self {
        let exit = match &error {
            gpu::Error::NoSuchDevice { .. } => Exit::Usage,
            // A larger device could draw the same scene and size: the input is at fault, not the system.
            gpu::Error::TooLarge { .. } | gpu::Error::OutOfMemory { .. } => Exit::BadInput,
            _ => Exit::NoVulkan,
        };
        Self::new(exit, with_causes(&error))
    }
}

impl From<plan::PlanError> for Failure {
    fn from(error: plan::PlanError) -> Self {
        let exit = match error {
            plan::PlanError::Scene(_) => Exit::BadInput,
            // The command line or a scene file asks for more than this device or this scene has.
            _ => Exit::Usage,
        };
        Self::new(exit, with_causes(&error))
    }
}

impl From<stress::StressError> for Failure {
    fn from(error: stress::StressError) -> Self {
        match error {
            stress::StressError::Refused(why) => Self::new(Exit::Usage, why),
            stress::StressError::Frame(error) => error.into(),
        }
    }
}

impl From<frame::Error> for Failure {
    fn from(error: frame::Error) -> Self {
        match error {
            frame::Error::Plan(error) => error.into(),
            frame::Error::Gpu(error) => error.into(),
        }
    }
}

#[cfg(feature = "window")]
impl From<window::Error> for Failure {
    fn from(error: window::Error) -> Self {
        match error {
            window::Error::Frame(error) => error.into(),
            window::Error::NoDisplay(_) => Self::new(Exit::NoDisplay, with_causes(&error))
                .with_hint("`afterlight render` draws into a file, without a display"),
            window::Error::ScaleFactor(_) => Self::usage(with_causes(&error)),
            window::Error::System(_) => Self::new(Exit::NoDisplay, with_causes(&error)),
        }
    }
}

/// Returns the option to type if exactly one is missing: `-o DIR` for clap's `--output <DIR>`.
fn missing_option(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::Strings(missing)) = error.get(ContextKind::InvalidArg) else { return None };
    let [option] = missing.as_slice() else { return None };
    let is_missing = error.kind() == ErrorKind::MissingRequiredArgument && option.starts_with('-');
    let typed = option.replace("--output", "-o").replace(['<', '>'], "");
    is_missing.then(|| format!("type `{typed}`"))
}

/// The error and its causes, outermost first. A cause that the text before it has quoted already is left out.
pub fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let next = error.to_string();
        if !text.contains(&next) {
            let _ = write!(text, ": {next}");
        }
        cause = error.source();
    }
    text
}

fn one_line(text: &str) -> String {
    text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("{text}")]
    struct Chained {
        text: &'static str,
        source: Option<Box<Chained>>,
    }

    #[test]
    fn causes_follow_once_each() {
        let inner = Chained { text: "disk full", source: None };
        let middle = Chained { text: "cannot write: disk full", source: Some(Box::new(inner)) };
        let outer = Chained { text: "cannot save", source: Some(Box::new(middle)) };
        assert_eq!(with_causes(&outer), "cannot save: cannot write: disk full");
    }

    #[test]
    fn a_closed_pipe_is_no_error_and_a_full_disk_is() {
        assert_eq!(Failure::stdout(&io::ErrorKind::BrokenPipe.into()).text().0, None);
        assert_eq!(Failure::stdout(&io::ErrorKind::StorageFull.into()).text().0, Some(Exit::BadInput));
    }

    #[test]
    fn messages_are_one_line() {
        assert_eq!(one_line("a\n  b\r\n\nc"), "a b c");
    }
}
