//! The command line: one file a subcommand. Each command returns what went wrong as a [`Failure`]; `main` alone prints the error, once, and picks the
//! exit code.

#![cfg_attr(
    not(all(feature = "ci", feature = "report", feature = "window")),
    allow(dead_code, reason = "subcommands share more than those of one feature need")
)]

mod args;
mod bench;
#[cfg(feature = "report")]
mod check_row;
#[cfg(feature = "ci")]
mod ci;
mod commands;
mod compare;
mod contact_sheet;
mod doctor;
mod drop;
mod export;
mod failure;
mod image_output;
mod inspect;
mod logs;
#[cfg(feature = "report")]
mod measuring;
mod memory;
mod merging;
mod motion_report;
mod output;
mod own;
mod plan_report;
mod progress;
mod reference;
mod render;
#[cfg(feature = "report")]
mod report;
mod session;
mod stress;
mod table;
mod traffic;
#[cfg(feature = "report")]
mod tune;
mod typed;
mod version;
mod video;
#[cfg(feature = "window")]
mod view;
mod workload;

use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use afterlight::scene::builtin;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgAction, CommandFactory, Parser, Subcommand};

use failure::{EXIT_CODES, Failure};
use typed::Typed;

/// A deferred renderer on raw Vulkan that knows its own error.
#[derive(Debug, Parser)]
#[command(name = "afterlight", version, long_version = version::LONG, disable_version_flag = true, after_help = after_help())]
struct Cli {
    #[command(subcommand)]
    command: CliCommand,
    /// Log what is done, to standard error; -vv logs more. AFTERLIGHT_LOG takes a filter of its own, as
    /// `afterlight=debug`
    #[arg(short, long, action = ArgAction::Count, global = true)]
    verbose: u8,
    /// Print the version; --version adds commit, features, Vulkan's loader, layers and drivers
    #[arg(short = 'V', long, action = ArgAction::Version)]
    version: (),
}

#[derive(Debug, Subcommand)]
enum CliCommand {
    Render(render::Args),
    Bench(bench::Args),
    Inspect(inspect::Args),
    #[cfg(feature = "report")]
    CheckRow(check_row::Args),
    Compare(compare::Args),
    Doctor(doctor::Args),
    Reference(reference::Args),
    Export(export::Args),
    Stress(stress::Args),
    #[cfg(feature = "ci")]
    Ci(Box<ci::Args>),
    #[cfg(feature = "ci")]
    Gtest(ci::gtest::Args),
    #[cfg(feature = "report")]
    Report(report::Args),
    #[cfg(feature = "report")]
    Tune(tune::Args),
    #[cfg(feature = "window")]
    View(view::Args),
}

fn after_help() -> String {
    format!(
        "Examples:\n  \
         afterlight render builtin:hall -o hall.png --size 1280x720\n  \
         afterlight render sponza.obj --view all -o sheet.png\n  \
         afterlight bench builtin:hall --vary shadows=off\n  \
         afterlight inspect builtin:spheres\n  \
         afterlight reference builtin:hall -o truth.exr\n  \
         afterlight compare hall.exr truth.exr -o difference.png\n  \
         afterlight export builtin:hall -o hall.glb\n  \
         afterlight doctor\n\n{EXIT_CODES}"
    )
}

/// Lists the commands to choose from, which depend on the features.
fn commands() -> String {
    Cli::command().get_subcommands().map(clap::Command::get_name).collect::<Vec<_>>().join(", ")
}

/// Returns true if these words behind the program's name are a command line.
fn parses(words: &[OsString]) -> bool {
    Cli::try_parse_from(std::iter::once("afterlight".into()).chain(words.iter().cloned())).is_ok()
}

/// Turns clap's error into a failure. `ci` has another use for the exit code of usage.
fn of_command_line(error: &clap::Error) -> Failure {
    let failure = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(word)) => match meant(word) {
            Some(hint) => Failure::from_clap(error).with_hint(hint),
            None => Failure::from_clap(error),
        },
        _ => Failure::from_clap(error),
    };
    #[cfg(feature = "ci")]
    if std::env::args_os()
        .skip(1)
        .find(|word| !word.to_string_lossy().starts_with('-'))
        .is_some_and(|word| word == "ci")
    {
        return failure.with_exit(failure::Exit::BadInput);
    }
    failure
}

/// Returns the commands that show and draw a scene, where one stands in a command's place.
fn meant(word: &str) -> Option<String> {
    const SCENES: [&str; 4] = ["toml", "gltf", "glb", "obj"];
    let extension = Path::new(word).extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let is_builtin = builtin::CATALOGUE.iter().any(|own| own.name == word);
    let is_file = extension.is_some_and(|extension| SCENES.contains(&extension.as_str()));
    let scene = match () {
        () if is_builtin => format!("{}{word}", builtin::PREFIX),
        () if word.starts_with(builtin::PREFIX) || is_file => word.to_owned(),
        () => return None,
    };
    let typed = |subcommand| format!("`{}`", Typed::new(subcommand).about(&scene));
    let window = if cfg!(feature = "window") { typed("view") + " for a window, or " } else { String::new() };
    Some(format!("did you mean {window}{} for a picture?", typed("render")))
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// Runs the command line's command.
fn run() -> Result<(), Failure> {
    memory::give_back_large_pieces();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.kind() == ErrorKind::DisplayVersion => return version::print(&error.to_string()),
        Err(error) if error.kind() == ErrorKind::DisplayHelp => {
            return error.print().map_err(|error| Failure::stdout(&error));
        }
        // Without a command there is nothing to name in an error: the help says more.
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            return Err(Failure::usage(format!("a command is needed: {}", commands())));
        }
        Err(error) => return Err(of_command_line(&error)),
    };
    logs::start(cli.verbose)?;
    match cli.command {
        CliCommand::Render(args) => render::run(&args, cli.verbose > 0),
        CliCommand::Bench(args) => bench::run(&args),
        CliCommand::Inspect(args) => inspect::run(&args, cli.verbose > 0),
        #[cfg(feature = "report")]
        CliCommand::CheckRow(args) => check_row::run(&args),
        CliCommand::Compare(args) => compare::run(&args),
        CliCommand::Doctor(args) => doctor::run(&args),
        CliCommand::Reference(args) => reference::run(&args),
        CliCommand::Export(args) => export::run(&args),
        CliCommand::Stress(args) => stress::run(&args),
        #[cfg(feature = "ci")]
        CliCommand::Ci(args) => ci::run(&args),
        #[cfg(feature = "ci")]
        CliCommand::Gtest(args) => ci::gtest::run(&args),
        #[cfg(feature = "report")]
        CliCommand::Report(args) => report::run(&args),
        #[cfg(feature = "report")]
        CliCommand::Tune(args) => tune::run(&args),
        #[cfg(feature = "window")]
        CliCommand::View(args) => view::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_has_examples_and_every_option_a_help_text() {
        for command in Cli::command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Examples:"), "{} has no examples", command.get_name());
            for option in command.get_arguments() {
                assert!(option.get_help().is_some(), "{} {} has no help", command.get_name(), option.get_id());
            }
        }
    }
    /// The words that a shell makes of a line up to its first pipe, redirection or `&&`.
    fn words(line: &str) -> Vec<String> {
        let mut words = Vec::new();
        let (mut word, mut quote) = (None::<String>, None);
        for character in line.chars() {
            match character {
                _ if quote == Some(character) => quote = None,
                '"' | '\'' if quote.is_none() => {
                    quote = Some(character);
                    word.get_or_insert_default();
                }
                '|' | '>' | '&' if quote.is_none() => break,
                '?' | '*' | '$' | '(' if quote.is_none() => panic!("a shell reads {character} in {line} as its own"),
                ' ' if quote.is_none() => words.extend(word.take()),
                _ => word.get_or_insert_default().push(character),
            }
        }
        words.extend(word);
        words
    }

    #[test]
    fn examples_work_when_pasted() {
        let mut examples = Vec::new();
        for command in Cli::command().get_subcommands().chain([&Cli::command()]) {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            examples.extend(help.lines().filter(|line| line.starts_with("  afterlight ")).map(str::to_owned));
        }
        assert!(examples.len() > 10, "{examples:?}");
        for example in examples {
            // A longer line would be wrapped by the help of a usual terminal, and break when pasted.
            assert!(example.len() <= 80, "{example}");
            Cli::try_parse_from(words(&example)).unwrap_or_else(|error| panic!("{example}: {error}"));
        }
    }
}
