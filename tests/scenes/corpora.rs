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
    let manifest = fs::read_to_string(concat!(env!("AFTERLIGHT_ROOT"), "/fuzz/Cargo.toml")).expect("a manifest");
    let programs: Vec<&str> =
        manifest.split("[[bin]]\nname = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(programs, readers::TARGETS.map(|target| target.name));
}

/// The fuzzing programs' workspace has a separate lock file, which nothing else checks. If the file lacks a package, fuzzing changes it, and a
/// `--locked` build fails.
#[test]
fn their_lock_file_knows_what_the_libraries_always_need() {
    let read = |name: &str| -> toml::Table {
        let path = Path::new(env!("AFTERLIGHT_ROOT")).join(name);
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let (workspace, lock) = (read("Cargo.toml"), read("fuzz/Cargo.lock"));
    let mut count = 0;
    for package in lock["package"].as_array().expect("packages") {
        let name = package["name"].as_str().expect("a name");
        // Packages of the workspace, and no others, are among its dependencies with their folders.
        let Some(path) = workspace["workspace"]["dependencies"].get(name).and_then(|own| own.get("path")) else {
            continue;
        };
        let manifest = read(&format!("{}/Cargo.toml", path.as_str().expect("a path")));
        // A package of which there are two versions is named with its own: `toml 0.9.1`.
        let listed: Vec<&str> = package["dependencies"]
            .as_array()
            .expect("dependencies")
            .iter()
            .filter_map(|name| name.as_str()?.split(' ').next())
            .collect();
        let of_systems =
            manifest.get("target").and_then(toml::Value::as_table).into_iter().flat_map(toml::Table::values);
        let tables = std::iter::once(manifest.get("dependencies"))
            .chain([manifest.get("build-dependencies")])
            .chain(of_systems.map(|own| own.get("dependencies")));
        let named: Vec<&str> = tables
            .flatten()
            .flat_map(|own| own.as_table().expect("a table"))
            // Features bring the optional ones, and the programs need few.
            .filter(|(_, value)| value.get("optional").is_none())
            .map(|(name, value)| value.get("package").and_then(toml::Value::as_str).unwrap_or(name))
            .collect();
        count += named.len();
        let missing: Vec<_> = named.into_iter().filter(|name| !listed.contains(name)).collect();
        assert!(missing.is_empty(), "`cargo update --workspace` in fuzz adds {missing:?} of {name} to its lock file");
    }
    assert!(count > 40, "only {count} dependencies are named");
}

#[test]
fn each_file_of_the_corpora_is_used_or_refused_in_one_line() {
    let corpora = Path::new(env!("AFTERLIGHT_ROOT")).join("fuzz/corpus");
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
