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

/// Returns the packages that a registry gets, each with its folder: the libraries that other members of the workspace can name, and the program.
fn published() -> Vec<(String, PathBuf)> {
    let manifest: toml::Table = fs::read_to_string(root().join("Cargo.toml")).expect("readable").parse().expect("TOML");
    let named = manifest["workspace"]["dependencies"].as_table().expect("a table").iter();
    let libraries = named.filter_map(|(name, own)| Some((name.clone(), root().join(own.get("path")?.as_str()?))));
    libraries.chain([("afterlight-cli".to_owned(), root().join("crates/program"))]).collect()
}

/// The files that a source of a package includes before its tests, which no package compiles.
fn included(folder: &Path, source: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(folder.join(source)).expect("readable");
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let beside = source.parent().expect("a folder");
    let starts = ["include_str!(\"", "include_bytes!(\"", "#[path = \""];
    let paths = starts.iter().flat_map(|start| text.split(start).skip(1)).filter_map(|rest| rest.split('"').next());
    paths.map(|path| plain(&beside.join(path))).collect()
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
    // Debian 13's runner starts only its own programs.
    if std::env::var_os("AFTERLIGHT_RUNNER").is_some() {
        return;
    }
    let files = packed("afterlight");
    for needed in
        ["build.rs", "Cargo.lock", "README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "shaders/fog.wgsl"]
    {
        assert!(files.contains(Path::new(needed)), "{needed} is not packed: see `include` in Cargo.toml");
    }
    // Tests, pictures, fuzzing's corpora and the other crates are no part of it.
    let foreign = ["tests", "docs", "assets", "book/exercises", "book/src/made", "book/theme", "fuzz", "crates"];
    let stray: Vec<_> = files.iter().filter(|file| foreign.iter().any(|folder| file.starts_with(folder))).collect();
    assert!(stray.is_empty(), "{stray:?}");
    // The packages that it needs, and the program, are packed beside it.
    let packages = published();
    assert!(packages.len() > 5, "{packages:?}");
    let mut count = 0;
    for (package, folder) in packages {
        let files = packed(&package);
        let is_target = |name: &str| files.contains(Path::new(name));
        assert!(is_target("src/lib.rs") || is_target("src/main.rs"), "{package}: {files:?}");
        let sources = files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "rs"));
        for source in sources.filter(|file| !file.starts_with("tests")) {
            for file in included(&folder, source) {
                count += 1;
                let (source, file) = (source.display(), file.as_path());
                assert!(files.contains(file), "{package}: {source} includes {}, which is not packed", file.display());
            }
        }
    }
    assert!(count > 5, "only {count} files are included anywhere");
}
