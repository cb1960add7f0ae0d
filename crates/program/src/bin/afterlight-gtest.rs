//! `afterlight gtest` as a separate program, as runners of googletest programs want it: they start it without arguments, or with the protocol's
//! alone. The program `afterlight` stands beside it.

#[path = "../own.rs"]
mod own;

use std::env::{self, consts::EXE_SUFFIX};
use std::io;
use std::process::{Command, ExitCode, ExitStatus};

fn main() -> ExitCode {
    let beside = own::program().ok().and_then(|own| Some(own.parent()?.join(format!("afterlight{EXE_SUFFIX}"))));
    let program = beside.filter(|path| path.exists()).unwrap_or_else(|| "afterlight".into());
    let words = own::command(&program);
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).arg("gtest").args(env::args_os().skip(1));
    // In this process, if the system allows it: a runner that kills it kills the tests.
    #[cfg(unix)]
    let ended: io::Result<ExitStatus> = Err(std::os::unix::process::CommandExt::exec(&mut command));
    #[cfg(not(unix))]
    let ended: io::Result<ExitStatus> = command.status();
    match ended {
        Ok(status) => status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from),
        Err(error) => {
            eprintln!("error: cannot start {}: {error}", program.display());
            ExitCode::from(3)
        }
    }
}
