//! Several scenes, one after the other: each has its own picture and verdict, and a scene that fails does not keep the others from being drawn.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::folder;
use super::verdict::{RenderReport, SceneVerdict};
use super::{Args, draw_scene};
use crate::failure::{Exit, Failure};
use crate::image_output::Destination;
use crate::output::{self, Sink};
use crate::session;

/// Draws all scenes and writes their verdicts.
///
/// # Errors
/// The failure of the one scene; of several the first of the gravest, with the names of all that failed.
pub fn run(args: &Args, is_verbose: bool) -> Result<(), Failure> {
    if args.scenes.iter().any(|scene| Path::new(scene).is_dir()) {
        let models = folder::models(&args.scenes)?;
        let args = Args { scenes: models, ..args.clone() };
        return match args.output.sink.to_string().contains("{name}") {
            true => run(&args, is_verbose),
            false => folder::draw_sheet(&args, is_verbose),
        };
    }
    let targets: Vec<Destination> = names_of(&args.scenes).iter().map(|name| args.output.named(name)).collect();
    check_sinks(args, &targets)?;
    let mut cases = Vec::new();
    let mut failures: Vec<(&str, Failure)> = Vec::new();
    let mut read = Vec::new();
    for (scene, output) in args.scenes.iter().zip(targets) {
        let args = Args { output, ..args.clone() };
        let (case, files, outcome) = one(&args, scene, is_verbose)?;
        read.extend(files);
        cases.push(case);
        match outcome {
            Err(failure) if failure.is_quiet() => return Err(failure),
            Err(failure) => {
                if args.scenes.len() > 1 {
                    output::print(&format!("{scene} failed: {}\n", failure.one_line()), true)?;
                }
                failures.push((scene, failure));
            }
            Ok(()) => {}
        }
    }
    output::spare(args.json.iter().chain(&args.junit), &read)?;
    let report = RenderReport::of(cases);
    if let Some(sink) = &args.json {
        sink.write(output::json(&report)?.as_bytes())?;
    }
    if let Some(sink) = &args.junit {
        sink.write(report.junit().as_bytes())?;
    }
    verdict(failures, args.scenes.len())
}

/// The verdict on a scene, the files that it was read from, and the failure, if any.
pub(super) type One = (SceneVerdict, Vec<PathBuf>, Result<(), Failure>);

/// Draws one scene on a separate device, so that all messages of the layer are about this scene.
pub(super) fn one(args: &Args, scene: &str, is_verbose: bool) -> Result<One, Failure> {
    let start = Instant::now();
    let (outcome, heard) = session::observe(&args.device, |device| draw_scene(args, scene, &device, is_verbose));
    heard.print()?;
    let is_taken = [Some(&args.output.sink), args.json.as_ref(), args.junit.as_ref()];
    let is_taken = is_taken.into_iter().flatten().any(Sink::is_stdout);
    let mut told = String::new();
    let (mut hazards, mut files) = (Vec::new(), Vec::new());
    // Nothing was checked in a scene that could not be drawn.
    if let Ok(drawn) = &outcome {
        told.push_str(&drawn.text);
        told.extend(heard.line().map(|line| line + "\n"));
        hazards.clone_from(&drawn.hazards);
        files.clone_from(&drawn.files);
    }
    if !args.quiet {
        output::print(&told, is_taken)?;
    }
    let outcome = heard.judge(outcome.and_then(|drawn| match drawn.hazards.as_slice() {
        [] => Ok(()),
        [first, others @ ..] => {
            let dropped = args.drop.as_deref().unwrap_or_default();
            let samples = args.samples.unwrap_or(1);
            let others = if others.is_empty() { String::new() } else { format!(" (and {} more)", others.len()) };
            Err(Failure::new(Exit::FailedCheck, format!("without {dropped} {first}{others}"))
                .with_hint(format!("`{}` says more", args.inspecting(scene, samples).option("drop", dropped))))
        }
    }));
    let seconds = start.elapsed().as_secs_f64();
    let case = SceneVerdict::of(scene, &args.output.sink.to_string(), seconds, &heard, &outcome);
    Ok((case.without(args.drop.clone(), hazards), files, outcome))
}

pub(super) fn verdict(mut failures: Vec<(&str, Failure)>, scenes: usize) -> Result<(), Failure> {
    if scenes == 1 {
        return failures.pop().map_or(Ok(()), |(_, failure)| Err(failure));
    }
    let Some(exit) = failures.iter().filter_map(|(_, failure)| failure.exit()).max() else { return Ok(()) };
    let names: Vec<&str> = failures.iter().map(|(scene, _)| *scene).collect();
    Err(Failure::new(exit, format!("{} of {scenes} scenes failed: {}", names.len(), names.join(", "))))
}

/// A scene's name in file names: its file's stem, or a built-in scene's name with a dash for each character that is no letter or digit.
pub(super) fn name_of(scene: &str) -> String {
    match scene.strip_prefix("builtin:") {
        Some(name) => name.replace(|c: char| !c.is_alphanumeric(), "-"),
        None => Path::new(scene).file_stem().unwrap_or_default().to_string_lossy().into_owned(),
    }
}

/// A name for each scene. Scenes whose files share a name are told apart by extension, by folder, or by the whole path.
pub(super) fn names_of(scenes: &[String]) -> Vec<String> {
    let folder = |scene: &str| {
        Path::new(scene).parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned()
    };
    let extension = |scene: &str| Path::new(scene).extension().unwrap_or_default().to_string_lossy().into_owned();
    let forms: [&dyn Fn(&str) -> String; 5] = [
        &name_of,
        &|scene| format!("{}-{}", name_of(scene), extension(scene)),
        &|scene| format!("{}-{}", folder(scene), name_of(scene)),
        &|scene| format!("{}-{}-{}", folder(scene), name_of(scene), extension(scene)),
        &|scene| scene.replace(|c: char| !c.is_alphanumeric(), "-"),
    ];
    let named = |scene: &String| {
        let alike: Vec<_> = scenes.iter().filter(|other| name_of(other) == name_of(scene)).collect();
        let are_apart =
            |form: &&&dyn Fn(&str) -> String| alike.iter().filter(|other| form(other) == form(scene)).count() <= 1;
        forms.iter().find(are_apart).unwrap_or(&forms[0])(scene)
    };
    scenes.iter().map(named).collect()
}

/// Checks before the work that all results can be written, each to a different place.
fn check_sinks(args: &Args, targets: &[Destination]) -> Result<(), Failure> {
    let name = "give -o a name with {name} in it, as -o {name}.png";
    if targets.len() > 1 && args.output.sink.is_stdout() {
        return Err(Failure::usage("-o - has room for the picture of one scene").with_hint(name));
    }
    let pictures =
        args.scenes.iter().zip(targets).map(|(scene, target)| (format!("the picture of {scene}"), &target.sink));
    let json = args.json.iter().map(|sink| ("--json".to_owned(), sink));
    let junit = args.junit.iter().map(|sink| ("--junit".to_owned(), sink));
    let mut taken: Vec<(String, &Sink)> = Vec::new();
    let named: Vec<PathBuf> = args.scenes.iter().map(PathBuf::from).collect();
    for (what, sink) in pictures.chain(json).chain(junit) {
        output::spare([sink], named.iter().chain(&args.path).chain(&args.settings.file))?;
        let same = |own: &Sink| own.is_same(sink) || own.is_stdout() && sink.is_stdout();
        if let Some((other, _)) = taken.iter().find(|(_, own)| same(own)) {
            let failure = Failure::usage(format!("{other} and {what} would both be written to {sink}"));
            let is_named = targets.len() == 1 || args.output.sink.to_string().contains("{name}");
            return Err(if is_named { failure } else { failure.with_hint(name) });
        }
        sink.check()?;
        taken.push((what, sink));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_named_after_its_file_or_what_is_built_in() {
        let names = ["a/b.c.obj", "builtin:hall?detail=8&seed=2", "scene.toml"].map(name_of);
        assert_eq!(names, ["b.c", "hall-detail-8-seed-2", "scene"]);
    }

    #[test]
    fn files_of_one_name_are_told_apart() {
        let names = |scenes: &[&str]| names_of(&scenes.iter().map(|scene| (*scene).to_owned()).collect::<Vec<_>>());
        assert_eq!(names(&["a/box.obj", "b/ball.obj"]), ["box", "ball"]);
        assert_eq!(names(&["a/box.obj", "a/box.glb", "b/ball.obj"]), ["box-obj", "box-glb", "ball"]);
        assert_eq!(names(&["a/box.obj", "b/box.obj"]), ["a-box", "b-box"]);
        assert_eq!(names(&["a/b/box.obj", "c/b/box.obj"]), ["a-b-box-obj", "c-b-box-obj"]);
        // A scene that is given twice keeps one name, and `check_sinks` refuses that.
        assert_eq!(names(&["a/box.obj", "a/box.obj"]), ["box", "box"]);
    }

    #[test]
    fn several_failures_are_one_with_the_gravest_code() {
        let failed = |exit| Failure::new(exit, "why");
        let all = vec![("a", failed(Exit::FailedCheck)), ("b", failed(Exit::BadInput)), ("c", failed(Exit::Usage))];
        let failure = verdict(all, 4).expect_err("three failed");
        assert_eq!((failure.exit(), failure.message()), (Some(Exit::BadInput), "3 of 4 scenes failed: a, b, c"));
        assert!(verdict(Vec::new(), 4).is_ok());
        assert_eq!(verdict(vec![("a", failed(Exit::Usage))], 1).expect_err("it failed").message(), "why");
    }
}
