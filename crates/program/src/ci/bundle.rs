//! Bundles: the folders of cases that ended badly, with all that another machine needs to try them again.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::evidence::{SCENE_FILES, SUITE};
use super::suite::{SceneSource, SuiteCase};
use super::verdict::{CaseReport, Verdict};
use super::{Args, evidence, make_own, remove_own, runner, suite};
use crate::failure::Failure;
use crate::output::{self, Sink};
use crate::own;
use crate::typed::{Typed, quoted};

/// The folder of a bundle that the scene's files are copied into.
const SCENE: &str = "scene";

/// Moves the files of bad cases into the folder of bundles, each with the files of its scene and the line that tries it again. Removes the files of
/// other cases.
///
/// # Errors
/// When a bundle cannot be written. If files of a scene cannot be copied, a warning is logged.
pub fn keep(
    reports: &[CaseReport],
    cases: &[&SuiteCase],
    (working, bundles): (&Path, &Path),
    args: &Args,
) -> Result<BTreeMap<String, PathBuf>, Failure> {
    let failed = |error: &io::Error| Failure::write(&bundles.display().to_string(), error);
    let mut kept = BTreeMap::new();
    let mut copies = BTreeMap::new();
    let is_kept = |report: &&CaseReport| report.verdict.is_bad() || report.verdict == Verdict::Flake;
    for report in reports.iter().filter(is_kept) {
        make_own(bundles)?;
        let (from, to) = (working.join(&report.case), bundles.join(&report.case));
        fs::rename(&from, &to).map_err(|error| failed(&error))?;
        if let Some(case) = cases.iter().find(|case| case.name == report.case)
            && let Err(error) = keep_scene(case, &to, &mut copies)
        {
            tracing::warn!("the files of the scene of {} are not in its bundle: {error}", case.name);
        }
        let line = reproducing(args);
        Sink::File(to.join("reproduce.txt")).write(line.as_bytes())?;
        Sink::File(to.join(runner::VERDICT)).write(output::json(report)?.as_bytes())?;
        kept.insert(report.case.clone(), to);
    }
    remove_own(working)?;
    Ok(kept)
}

/// Copies the files of the case's scene into its bundle, and points the bundle's suite at the copies. Files keep their places below their deepest
/// common folder, so that relative paths between them still hold. `copies` maps files to their copies in earlier bundles, which bundles share where
/// the file system can.
fn keep_scene(case: &SuiteCase, bundle: &Path, copies: &mut BTreeMap<PathBuf, PathBuf>) -> io::Result<()> {
    let listed = match fs::read_to_string(bundle.join(SCENE_FILES)) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        listed => listed?,
    };
    let own = match &case.scene {
        SceneSource::Named(name) => plain(Path::new(name))?,
        SceneSource::Text { folder, .. } => plain(folder)?,
    };
    let files = listed.lines().filter_map(|line| line.split_once("  ")).map(|(_, path)| plain(Path::new(path)));
    // The text of a scene is in the suite, although it is listed as a file.
    let files: Vec<PathBuf> =
        files.filter(|path| path.as_ref().is_ok_and(|path| path.is_file())).collect::<Result<_, _>>()?;
    if files.is_empty() {
        return Ok(());
    }
    let folders = files.iter().filter_map(|path| path.parent()).chain(match &case.scene {
        SceneSource::Named(_) => None,
        SceneSource::Text { .. } => Some(own.as_path()),
    });
    let root = folders.map(Path::to_owned).reduce(|one, other| common(&one, &other)).unwrap_or_default();
    let place = |path: &Path| path.strip_prefix(&root).map(|below| Path::new(SCENE).join(below)).ok();
    for file in &files {
        let Some(to) = place(file).map(|below| bundle.join(below)) else { continue };
        to.parent().map_or(Ok(()), fs::create_dir_all)?;
        let is_shared = copies.get(file).is_some_and(|copy| fs::hard_link(copy, &to).is_ok());
        if !is_shared {
            fs::copy(file, &to)?;
            copies.insert(file.clone(), to);
        }
    }
    // Paths of a text begin in its folder, which need not have a file.
    if let (SceneSource::Text { .. }, Some(folder)) = (&case.scene, place(&own)) {
        fs::create_dir_all(bundle.join(folder))?;
    }
    place(&own).map_or(Ok(()), |kept| fs::write(bundle.join(SUITE), suite::alone(case, Some(&kept))))
}

/// The whole path, without `.` and `..`.
fn plain(path: &Path) -> io::Result<PathBuf> {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let mut plain = PathBuf::new();
    for component in std::path::absolute(path)?.components() {
        match component {
            Component::ParentDir => _ = plain.pop(),
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    Ok(plain)
}

/// The deepest folder that has both.
fn common(one: &Path, other: &Path) -> PathBuf {
    one.components().zip(other.components()).take_while(|(one, other)| one == other).map(|(one, _)| one).collect()
}

/// Variables of this program's own that change a verdict: calls that fail, devices that lack much, and the figures that `auto` chooses by.
const OWN_VARIABLES: [&str; 3] = ["AFTERLIGHT_FAILURES", "AFTERLIGHT_PLAYS", "AFTERLIGHT_CALIBRATION"];

/// The line that tries a bundle's case again, from the bundle's folder wherever it is: with the same device, variables and command that starts it.
fn reproducing(args: &Args) -> String {
    let matters = |name: &str| !name.starts_with("AFTERLIGHT_") || OWN_VARIABLES.contains(&name);
    let variables = evidence::variables().into_iter().filter(|(name, _)| matters(name));
    let mut line: String = variables.map(|(name, value)| format!("{name}={} ", quoted(&value))).collect();
    let started: Vec<OsString> = match &args.runner {
        Some(runner) => runner.split_whitespace().map(OsString::from).collect(),
        // `own::command` ends with the program's name. The typed command begins with it, so it is left out here.
        None => own::command(Path::new("afterlight")).into_iter().filter(|word| word != "afterlight").collect(),
    };
    line.extend(started.iter().map(|word| quoted(word) + " "));
    let typed = Typed::new("ci").option("repro", ".");
    let typed = typed.option_if("device", args.device.as_ref().map(ToString::to_string));
    format!("# In this folder, wherever it is:\n{line}{typed}\n")
}

#[cfg(test)]
mod tests {
    use super::super::evidence::EvidenceFolder;
    use super::super::examine::CaseSetup;
    use super::super::suite::Suite;
    use super::*;

    const SUITE_TEXT: &str = r#"
[scenes]
own = """
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
[[models]]
path = "../models/quad.obj"
"""
[[case]]
group = "scene"
scene = "own"
each = { text = "" }
[[case]]
group = "scene"
scene = "../models/quad.obj"
each = { file = "" }
"#;

    #[test]
    fn a_bundle_has_the_files_of_its_scene_and_finds_them_where_the_own_ones_are_gone() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        for name in ["here/suites", "here/models", "bundles"] {
            fs::create_dir_all(at(name)).expect("made");
        }
        let obj = "mtllib quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3 4\n";
        fs::write(at("here/models/quad.obj"), obj).expect("written");
        fs::write(at("here/models/quad.mtl"), "newmtl red\nKd 0.5 0.25 0.125\n").expect("written");
        fs::write(at("here/suites/own.toml"), SUITE_TEXT).expect("written");

        let suite = Suite::open(&at("here/suites/own.toml").display().to_string()).expect("a suite");
        let mut copies = BTreeMap::new();
        let open = |case: &SuiteCase| CaseSetup::open(case).unwrap_or_else(|stop| panic!("{}", stop.why)).scene;
        let before: Vec<_> = suite.cases.iter().map(open).collect();
        for (case, scene) in suite.cases.iter().zip(&before) {
            let bundle = at("bundles").join(&case.name);
            fs::create_dir(&bundle).expect("made");
            let evidence = EvidenceFolder::new(Some(bundle.clone()));
            evidence.write(SUITE, suite::alone(case, None).as_bytes());
            evidence.scene_files(&scene.files);
            keep_scene(case, &bundle, &mut copies).expect("copied");
        }
        assert_eq!(copies.len(), 2, "{copies:?}");
        fs::rename(at("here"), at("gone")).expect("renamed");
        fs::rename(at("bundles"), at("sent")).expect("renamed");
        for (case, before) in suite.cases.iter().zip(&before) {
            let suite = Suite::open(&at("sent").join(&case.name).join(SUITE).display().to_string()).expect("a suite");
            let scene = open(suite.case(&case.name).expect("the case"));
            assert_eq!(
                (scene.meshes.len(), &scene.materials),
                (before.meshes.len(), &before.materials),
                "{}",
                case.name
            );
            let is_sent = |file: &&PathBuf| file.ends_with("quad.mtl") && file.starts_with(at("sent"));
            assert_eq!(scene.files.iter().filter(is_sent).count(), 1, "{:?}", scene.files);
        }
        fs::remove_file(at("sent/scene.file/scene/quad.obj")).expect("removed");
        let suite = Suite::open(&at("sent/scene.file/suite.toml").display().to_string()).expect("a suite");
        assert!(CaseSetup::open(&suite.cases[0]).is_err(), "it is read from the bundle");
    }
}
