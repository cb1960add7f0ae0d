//! Reads each file of the corpora of fuzzing: each can be used, or is refused in one line.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

#[path = "../../fuzz/src/lib.rs"]
mod readers;

/// The longest that one file may take, on a machine that does other things as well.
const MOST: Duration = Duration::from_secs(20);

#[test]
fn each_reader_has_a_program_that_fuzzes_it() {
    let manifest = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/Cargo.toml")).expect("a manifest");
    let programs: Vec<&str> =
        manifest.split("[[bin]]\nname = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(programs, readers::TARGETS.map(|target| target.name));
}

#[test]
fn each_file_of_the_corpora_is_used_or_refused_in_one_line() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for target in readers::TARGETS {
        let mut count = 0;
        for entry in fs::read_dir(corpora.join(target.name)).expect("a corpus") {
            let file = entry.expect("an entry").path();
            let start = Instant::now();
            let bytes = fs::read(&file).expect("readable");
            // The reader panics where it finds a fault, and the assertion names the file.
            let found = std::panic::catch_unwind(|| readers::read(target.name, &bytes));
            assert!(found.is_ok() && start.elapsed() < MOST, "{}: {:?}", file.display(), start.elapsed());
            count += 1;
        }
        assert!(count > 0, "no file for {}", target.name);
    }
}
