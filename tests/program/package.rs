//! The content of `cargo package`: everything that the library, the program and the examples are made of. scripts/package builds from it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("AFTERLIGHT_ROOT"))
}

/// The files of a crate's package.
fn packed(name: &str) -> BTreeSet<PathBuf> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root()).args(["package", "--list", "--allow-dirty", "--offline", "--package", name]);
    let output = cargo.output().expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).lines().map(PathBuf::from).collect()
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => drop(plain.pop()),
            other => plain.push(other),
        }
    }
    plain
}

/// The files that a source includes before its tests, which no package compiles.
fn included(source: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(root().join(source)).expect("readable");
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let folder = source.parent().expect("a folder");
    let starts = ["include_str!(\"", "include_bytes!(\"", "#[path = \""];
    let paths = starts.iter().flat_map(|start| text.split(start).skip(1)).filter_map(|rest| rest.split('"').next());
    paths.map(|path| plain(&folder.join(path))).collect()
}

/// The files of the package that a text links to where docs.rs shows sources.
fn shown_by_docs_rs(text: &str) -> Vec<&str> {
    let start = "https://docs.rs/crate/afterlight/latest/source/";
    let is_end = |c: char| c.is_whitespace() || ")>#".contains(c);
    text.split(start).skip(1).filter_map(|rest| rest.split(is_end).next()).collect()
}

#[test]
fn links_of_the_documentation_lead_to_files_of_the_package() {
    if std::env::var_os("AFTERLIGHT_RUNNER").is_some() {
        return;
    }
    let files = packed("afterlight");
    let text = fs::read_to_string(root().join("src/lib.rs")).expect("readable");
    let linked = shown_by_docs_rs(&text);
    assert!(linked.len() > 5, "{linked:?}");
    for file in linked {
        assert!(
            files.contains(Path::new(file)),
            "src/lib.rs links to {file}, which is not packed: see `include` in Cargo.toml"
        );
    }
}

#[test]
fn a_package_holds_all_that_its_sources_include() {
    // Debian 13's runner starts programs of its own only.
    if std::env::var_os("AFTERLIGHT_RUNNER").is_some() {
        return;
    }
    let files = packed("afterlight");
    for needed in
        ["build.rs", "Cargo.lock", "README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "shaders/fog.wgsl"]
    {
        assert!(files.contains(Path::new(needed)), "{needed} is not packed: see `include` in Cargo.toml");
    }
    let mut count = 0;
    for source in files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
        for file in included(source) {
            count += 1;
            assert!(files.contains(&file), "{} includes {}, which is not packed", source.display(), file.display());
        }
    }
    assert!(count > 5, "only {count} files are included anywhere");
    // Tests, pictures and fuzzing's corpora are no part of it.
    let foreign = ["tests", "docs", "assets", "book/exercises", "book/src/made", "book/theme", "fuzz"];
    let stray: Vec<_> = files.iter().filter(|file| foreign.iter().any(|folder| file.starts_with(folder))).collect();
    assert!(stray.is_empty(), "{stray:?}");
    // The build script's crate is packed beside it.
    assert!(packed("afterlight-shader-compiler").contains(Path::new("src/lib.rs")));
}
