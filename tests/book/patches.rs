//! Answers that are code: each patch fits the tree, and in `make test-all` is built and tried.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::chapter::{Chapter, project};
use crate::common::tries_all;
use crate::sessions::{Desk, try_chapter};

fn folder() -> PathBuf {
    project().join("book/exercises")
}

/// The files of a patch, in their order: `NAME.patch`, or `NAME-1-....patch` and so on.
fn parts(name: &str) -> Vec<PathBuf> {
    let whole = folder().join(format!("{name}.patch"));
    if whole.exists() {
        return vec![whole];
    }
    let mut parts: Vec<_> = all()
        .into_iter()
        .filter(|path| {
            stem(path)
                .strip_prefix(name)
                .is_some_and(|rest| rest.starts_with("-1") || rest[1..].starts_with(|c: char| c.is_ascii_digit()))
        })
        .collect();
    parts.sort();
    assert!(!parts.is_empty(), "book/exercises has no patch {name}");
    parts
}

fn all() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).into_iter().flatten();
    let paths = entries.map(|entry| entry.expect("a readable entry").path());
    let mut paths: Vec<_> = paths.filter(|path| path.extension() == Some(OsStr::new("patch"))).collect();
    paths.sort();
    paths
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The names by which chapters ask for patches.
fn asked() -> BTreeSet<String> {
    let chapters = Chapter::all();
    let sessions = chapters.iter().flat_map(Chapter::sessions);
    sessions.filter_map(|session| session.patch().map(str::to_owned)).collect()
}

/// Copies the files of the project that git knows, so that a patch can change them.
fn copy_project(to: &Path) {
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(project()).output().expect("git starts");
    assert!(listed.status.success(), "git: {}", String::from_utf8_lossy(&listed.stderr));
    for name in String::from_utf8_lossy(&listed.stdout).split('\0').filter(|name| !name.is_empty()) {
        let (from, to) = (project().join(name), to.join(name));
        fs::create_dir_all(to.parent().expect("a file lies in a folder")).expect("a folder");
        if from.is_file() {
            // Times are kept, so that files which a patch leaves alone are not compiled again.
            let copied = Command::new("cp").arg("-p").args([&from, &to]).status();
            assert!(copied.is_ok_and(|status| status.success()), "{}", from.display());
        }
    }
}

fn apply(patch: &Path, to: &Path, options: &[&str]) {
    // Not the repository around it: paths are of this folder.
    let mut git = Command::new("git");
    git.arg("apply").args(options).arg(patch).current_dir(to).env("GIT_CEILING_DIRECTORIES", to.parent().unwrap_or(to));
    let output = git.output().expect("git starts");
    assert!(output.status.success(), "{}: {}", patch.display(), String::from_utf8_lossy(&output.stderr));
}

/// The files that patches change.
fn touched(patches: &[PathBuf]) -> BTreeSet<String> {
    let texts = patches.iter().map(|path| fs::read_to_string(path).expect("a patch is text"));
    texts
        .flat_map(|text| {
            text.lines().filter_map(|line| line.strip_prefix("--- a/").map(str::to_owned)).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn every_patch_fits_and_a_chapter_asks_for_it() {
    let mut used = BTreeSet::new();
    for name in asked() {
        let parts = parts(&name);
        let copy = tempfile::tempdir().expect("a temporary folder");
        for file in touched(&parts) {
            let (from, to) = (project().join(&file), copy.path().join(&file));
            fs::create_dir_all(to.parent().expect("a file lies in a folder")).expect("a folder");
            if from.exists() {
                fs::copy(&from, &to).unwrap_or_else(|error| panic!("{file}: {error}"));
            }
        }
        for part in parts {
            apply(&part, copy.path(), &["--whitespace=nowarn"]);
            used.insert(part);
        }
    }
    let unused: Vec<_> = all().into_iter().filter(|path| !used.contains(path)).collect();
    assert!(unused.is_empty() || std::env::var_os("AFTERLIGHT_BOOK").is_some(), "no chapter tries {unused:?}");
}

#[test]
fn every_patch_is_built_and_does_what_its_chapter_says() {
    if !tries_all() {
        eprintln!("NOT RUN: patches of the book are built in make test-all");
        return;
    }
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("patched");
    let mut wrong = Vec::new();
    for name in asked() {
        let tree = root.join("tree");
        let _ = fs::remove_dir_all(&tree);
        copy_project(&tree);
        for part in parts(&name) {
            apply(&part, &tree, &["--whitespace=nowarn"]);
        }
        // In one folder, one after another, so that their common parts are compiled once.
        let target = root.join("target");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["build", "--locked", "--bin", "afterlight"]).current_dir(&tree).env("CARGO_TARGET_DIR", &target);
        let output = cargo.env_remove("RUSTC_WORKSPACE_WRAPPER").output().expect("cargo starts");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let program = target.join("debug/afterlight");
        for chapter in Chapter::all().iter().filter(|own| own.sessions().any(|session| session.patch() == Some(&name)))
        {
            wrong.extend(try_chapter(chapter, &Desk::new(&tree, &program, None), Some(&name)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
