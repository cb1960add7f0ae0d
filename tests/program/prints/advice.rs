//! Sentences of `tune` and `report` on bounds, near misses and progress. Times decide which settings are recommended, so the sentences themselves are
//! tested beside the code that makes them.

use super::{assert_prints, folder, printed};

const SPHERES: &str = "builtin:spheres?columns=2&rows=1";

#[test]
fn bounds_without_sense_are_refused_in_one_line() {
    let tune = |bound: &[&'static str]| [&["tune", SPHERES], bound].concat();
    let commands = [
        tune(&["--max-loss", "0"]),
        tune(&["--max-loss", "0%"]),
        tune(&["--max-loss", "-3%"]),
        tune(&["--max-loss", "abc"]),
        tune(&["--max-loss", "2%", "--max-error", "0.05"]),
        tune(&["--max-error", "0"]),
        tune(&[]),
    ];
    let commands: Vec<&[&str]> = commands.iter().map(Vec::as_slice).collect();
    assert_prints("bounds", folder().path(), &commands);
}

/// A small scene, measured little.
fn measured(folder: &std::path::Path, arguments: &[&str]) -> String {
    let small = ["--size", "48x27", "--quick", "--joint", "0", "--rounds", "6", "--truth-samples", "4"];
    printed(folder, &[arguments, &small].concat())
}

#[test]
fn off_a_terminal_each_point_is_a_line_unless_quiet() {
    let folder = folder();
    let report = ["report", SPHERES, "-o", "out", "--families", "gbuffer", "--all"];
    let told = measured(folder.path(), &report);
    let (shown, progress) = told.split_once("[standard error]\n").expect("progress");
    for line in [
        format!("{SPHERES}: pictures 1/3: default\n"),
        format!("{SPHERES}: pictures 3/3: gbuffer=float32\n"),
        format!("{SPHERES}: times 1/2: "),
        format!("{SPHERES}: the parts of the error\n"),
    ] {
        assert!(progress.contains(&line), "`{line}` is not in: {progress}");
    }
    // All three are in the table, and the paragraph above it says what to change.
    for row in ["\n  default (as given)", "\n  gbuffer=fat", "\n  gbuffer=float32", "\nWhat to change: "] {
        assert!(shown.contains(row), "`{row}` is not in: {shown}");
    }
    assert!(!shown.contains("--all lists them"), "{shown}");
    let again = measured(folder.path(), &report[..report.len() - 1]);
    assert!(again.contains("--all lists them") || again.contains("\n  gbuffer=fat"), "{again}");
    let reference = ["reference", SPHERES, "-o", "truth.exr", "--size", "48x27", "--no-cache", "-q"];
    let told = printed(folder.path(), &reference[..reference.len() - 1]);
    assert!(told.contains(&format!("[standard error]\n{SPHERES}: samples: 0%\n")), "{told}");
    assert!(!printed(folder.path(), &reference).contains("[standard error]"));
    let quiet = measured(folder.path(), &["report", SPHERES, "-o", "quiet", "--families", "gbuffer", "-q"]);
    assert!(!quiet.contains("[standard error]") && quiet.contains("[exit code 0]"), "{quiet}");
}
