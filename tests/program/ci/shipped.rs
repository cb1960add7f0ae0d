//! The suites that the program has, and the files in `docs/ci` that run them on build servers.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use super::{ci, code, errors, results};
use crate::common::program::program;
use crate::common::tries_all;

/// In `make test` one that shows a window's frames and one of textures in blocks, in `make test-all` the largest suite, which has all others.
#[test]
fn all_cases_of_shipped_suites_pass() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let only: &[&str] = if tries_all() { &[] } else { &["--only", r"^(window\.compute|texels\.bc7)$"] };
    let run = ci(folder.path(), &[&["full", "-o", "out"][..], only].concat());
    assert_eq!(code(&run), Some(0), "{}{}", String::from_utf8_lossy(&run.stdout), errors(&run));
    let found = results(&folder.path().join("out/results.csv"));
    let passed = found.values().filter(|status| *status == "Pass").count();
    assert!(passed >= if tries_all() { 100 } else { 2 }, "{found:?}");
    let lines = fs::read_to_string(folder.path().join("out/results.jsonl")).expect("JSON lines");
    let shown = lines.lines().filter(|line| line.contains("shown straight, enlarged, encoded")).count();
    let skipped = lines.lines().filter(|line| line.contains("window: ") && line.contains("skipped")).count();
    assert!(shown + skipped >= 1, "{lines}");
}

/// The commands of the files for build servers try each case once, in whichever part.
#[test]
#[cfg(unix)]
fn files_for_build_servers_run_the_whole_suite_in_parts() {
    let suite = r#"
[[case]]
group = "good"
scene = "builtin:triangle"
settings = "size=16x9"
identical = 1
each = { a = "", b = "", c = "" }
"#;
    let all = ["github.yml", "gitlab-ci.yml", "slurm.sh", "kubernetes.yaml"];
    for name in all {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("own.toml"), suite).expect("written");
        // The shipped file calls the program by its bare name, as on a machine that has it on the path.
        let program = program();
        let words: Vec<_> = [program.get_program()].into_iter().chain(program.get_args()).collect();
        let words: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
        let function = format!("afterlight() {{ {} \"$@\"; }}\n", words.join(" "));
        let file = Path::new(env!("AFTERLIGHT_ROOT")).join("docs/ci").join(name);
        let script = function + &commands(&fs::read_to_string(file).expect("readable"));
        let mut found = BTreeMap::new();
        for part in ["1", "2"] {
            let index = if part == "1" { "0" } else { "1" };
            let variables = [
                ("SUITE", "own.toml"),
                ("PART", part),
                ("PARTS", "2"),
                ("CI_NODE_INDEX", part),
                ("CI_NODE_TOTAL", "2"),
                ("SLURM_ARRAY_TASK_ID", part),
                ("SLURM_ARRAY_TASK_COUNT", "2"),
                ("JOB_COMPLETION_INDEX", index),
            ];
            let output =
                Command::new("bash").args(["-euc", &script]).current_dir(folder.path()).envs(variables).output();
            let output = output.expect("bash starts");
            assert!(output.status.success(), "{name}: {}", errors(&output));
            found.extend(results(&folder.path().join(format!("out-{part}/results.csv"))));
        }
        assert_eq!(found.len(), 3, "{name}: {found:?}");
        assert!(found.values().all(|status| status == "Pass"), "{name}: {found:?}");
    }
}

/// A script whole; of YAML the indented block that starts the program.
fn commands(text: &str) -> String {
    if text.starts_with("#!") {
        return text.to_owned();
    }
    let indent = |line: &str| line.len() - line.trim_start().len();
    let lines: Vec<&str> = text.lines().collect();
    let own =
        lines.iter().position(|line| line.trim_start().starts_with("afterlight ci ")).expect("it starts the program");
    let begin = lines[..own].iter().rposition(|line| line.trim_end().ends_with('|')).expect("a block") + 1;
    let block = lines[begin..].iter().take_while(|line| indent(line) >= indent(lines[begin]));
    block.map(|line| format!("{}\n", line.trim_start())).collect()
}
