//! The program on another Vulkan stack than the machine's: processes that it starts run on that stack as well.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Returns the script that starts programs on a stack of Debian's (`debian13`, `newest`), where `scripts/fetch-NAME` has unpacked it.
pub(crate) fn runner_of(stack: &str) -> Option<PathBuf> {
    let project = Path::new(env!("AFTERLIGHT_ROOT"));
    let cache = std::env::var_os("AFTERLIGHT_CACHE").map_or_else(|| project.join(".cache"), PathBuf::from);
    cache.join(stack).join("packages.txt").exists().then(|| project.join("scripts").join(format!("on-{stack}")))
}

/// Two cases. Each runs in its own process, and one of them with the stack's layer.
const SUITE: &str = r#"
[defaults]
settings = "size=32x18"

[[case]]
group = "own"
scene = "builtin:triangle"
each = { plain = "" }

[[case]]
group = "own"
scene = "builtin:triangle"
validate = ["sync"]
each = { layer = "" }
"#;

/// Runs a program of this project on Debian 13's stack, as a user types it; `None` where the stack is not there.
fn on_debian13(folder: &Path, program: &str, arguments: &[&str], variables: &[(&str, &str)]) -> Option<Output> {
    let Some(runner) = runner_of("debian13") else {
        eprintln!("SKIPPED: scripts/fetch-debian13 has unpacked no stack");
        return None;
    };
    let mut command = Command::new(runner);
    // The tests' own stack may be another one.
    command.env_remove("AFTERLIGHT_RUNNER").current_dir(folder).arg(program).args(arguments);
    Some(command.envs(variables.iter().copied()).output().expect("the script starts"))
}

fn succeeds(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

#[test]
fn cases_of_a_suite_run_on_the_stack_of_the_program_that_starts_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("own.toml"), SUITE).expect("written");
    let program = env!("CARGO_BIN_EXE_afterlight");
    let Some(run) = on_debian13(folder.path(), program, &["ci", "own.toml", "-o", "out"], &[]) else { return };
    assert!(succeeds(&run).contains("2 Pass, in "));
    let results = fs::read_to_string(folder.path().join("out/results.jsonl")).expect("JSON lines");
    for line in results.lines() {
        let report: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert!(report["driver"].as_str().is_some_and(|driver| driver.contains("Mesa 25.")), "{report}");
    }
    let gtest = env!("CARGO_BIN_EXE_afterlight-gtest");
    let of_suite = [("AFTERLIGHT_SUITE", "own.toml")];
    if let Some(run) = on_debian13(folder.path(), gtest, &["--gtest_filter=own.layer"], &of_suite) {
        assert!(succeeds(&run).contains("[       OK ] own.layer"));
    }
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn the_suite_smoke_passes_on_the_stack_that_a_script_chooses() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let program = env!("CARGO_BIN_EXE_afterlight");
    if let Some(run) = on_debian13(folder.path(), program, &["ci", "smoke", "-o", "out"], &[]) {
        assert!(succeeds(&run).contains("smoke: 8 Pass, in "));
    }
}
