//! The limits on lines.

use std::path::{Path, PathBuf};

/// Each step with the one that it goes on from.
const STEPS: [(&str, &str); 14] = [
    ("01-triangle", "00-clear"),
    ("02-mesh", "01-triangle"),
    ("03-forward", "02-mesh"),
    ("04-gbuffer", "03-forward"),
    ("05-subpasses", "04-gbuffer"),
    ("05b-local-read", "05-subpasses"),
    ("06-lean", "05-subpasses"),
    ("06b-errors", "06-lean"),
    ("07-hdr", "06-lean"),
    ("08-shadow", "07-hdr"),
    ("09-in-flight", "08-shadow"),
    ("10-window", "09-in-flight"),
    ("11-rows", "09-in-flight"),
    ("11b-proof", "11-rows"),
];

const MOST_LINES_OF_HELPER: usize = 300;
const MOST_LINES_CHANGED: usize = 150;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// The lines of a file, none if it is not there.
fn lines(path: &Path) -> Vec<String> {
    std::fs::read_to_string(path).map(|text| text.lines().map(str::to_owned).collect()).unwrap_or_default()
}

/// Lines of the one file that are not in the other, and the reverse, by the longest sequence of lines that both have, as diff counts them.
fn changed(old: &[String], new: &[String]) -> usize {
    let mut above = vec![0; new.len() + 1];
    for line in old {
        let mut row = vec![0; new.len() + 1];
        for (column, other) in new.iter().enumerate() {
            row[column + 1] = if line == other { above[column] + 1 } else { row[column].max(above[column + 1]) };
        }
        above = row;
    }
    old.len() + new.len() - 2 * above[new.len()]
}

fn step_lines(step: &str) -> [Vec<String>; 2] {
    ["main.rs", "shaders.wgsl"].map(|file| lines(&folder().join(step).join(file)))
}

fn lines_changed(step: &str, before: &str) -> usize {
    std::iter::zip(step_lines(before), step_lines(step)).map(|(old, new)| changed(&old, &new)).sum()
}

#[test]
fn the_helper_has_at_most_300_lines() {
    let count = lines(&folder().join("src/lib.rs")).len();
    assert!((1..=MOST_LINES_OF_HELPER).contains(&count), "src/lib.rs has {count} lines");
}

#[test]
fn a_step_differs_from_the_one_before_by_at_most_150_lines() {
    for (step, before) in STEPS {
        let count = lines_changed(step, before);
        assert!((1..=MOST_LINES_CHANGED).contains(&count), "{step} differs from {before} by {count} lines");
    }
}

#[test]
fn the_table_of_the_readme_counts_right() {
    let readme = lines(&folder().join("README.md"));
    for step in std::iter::once("00-clear").chain(STEPS.map(|(step, _)| step)) {
        let count = step_lines(step).map(|file| file.len()).iter().sum::<usize>();
        let before = STEPS.iter().find(|row| row.0 == step);
        let changed = before.map_or_else(String::new, |(step, before)| lines_changed(step, before).to_string());
        let row = readme.iter().find(|line| line.contains(&format!("({step}/main.rs)")));
        let row = row.unwrap_or_else(|| panic!("README.md has no row of {step}"));
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        assert_eq!(cells[cells.len() - 3..cells.len() - 1], [count.to_string(), changed], "{row}");
    }
}
