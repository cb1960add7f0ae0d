//! The documents keep their promises: links lead somewhere, examples work when pasted, and lists are complete. (The Rust of README.md is the example
//! `readme`, which `examples` runs.)

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::program::program;
use crate::common::{capabilities, some_of, tries_all};

use afterlight::frame::rows;
use afterlight::gpu::vk;
use afterlight::plan::{Encoding, FramePlan, PresentTarget, Transfer};
use afterlight::scene::{
    AlphaMode, AmbientOcclusion, LightPath, Local, Node, OpenOptions, Placement, Queues, Scene, Settings, Transparency,
    open,
};
use rayon::prelude::*;

pub fn project() -> &'static Path {
    Path::new(env!("AFTERLIGHT_ROOT"))
}

pub fn document(name: &str) -> String {
    fs::read_to_string(project().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The project's own documents, relative to it.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in ["", "docs", "benches", "assets", "book/src"] {
        let Ok(entries) = fs::read_dir(project().join(folder)) else { continue };
        let names = entries.map(|entry| Path::new(folder).join(entry.expect("a readable folder").file_name()));
        found.extend(names.filter(|name| name.extension().is_some_and(|extension| extension == "md")));
    }
    found.sort();
    found
}

/// The blocks of a document that are fenced with this language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.strip_prefix("```").is_some_and(|tag| tag.trim() == language) {
            found.push(lines.by_ref().take_while(|line| *line != "```").map(|line| format!("{line}\n")).collect());
        }
    }
    found
}

/// Text outside fenced blocks.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// Returns the text between the parentheses of each `[..](..)`.
fn links(text: &str) -> Vec<String> {
    let rest = text.split("](").skip(1);
    rest.filter_map(|rest| rest.split_once(')')).map(|(link, _)| link.to_owned()).collect()
}

/// GitHub's anchor of a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn has_heading(text: &str, wanted: &str) -> bool {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).any(|found| found == wanted)
}

#[test]
fn every_relative_link_leads_somewhere() {
    let mut dead = Vec::new();
    for name in documents() {
        let text = document(&name.to_string_lossy());
        for link in links(&prose(&text)).iter().filter(|link| !link.contains("://")) {
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => project().join(&name),
                file => project().join(&name).with_file_name("").join(file),
            };
            let heading_is_there =
                || heading.is_empty() || fs::read_to_string(&target).is_ok_and(|text| has_heading(&text, heading));
            if !target.exists() || !heading_is_there() {
                dead.push(format!("{}: {link}", name.display()));
            }
        }
    }
    assert!(dead.is_empty(), "links that lead nowhere:\n{}", dead.join("\n"));
}

/// Every example of README and docs/COMMANDS.md is typed into a shell as it stands, but drawn small and with few frames: it must work, and all of
/// them together must stay quick.
#[test]
fn every_example_works_when_pasted() {
    let scenes = crate::common::scenes_dir();
    let examples: BTreeSet<String> = blocks(&document("README.md"), "sh")
        .into_iter()
        // `make test-all` types all of them.
        .chain(some_of(blocks(&document("docs/COMMANDS.md"), "sh"), 25))
        .filter(|block| block.contains("\nafterlight ") || block.starts_with("afterlight "))
        .filter(|block| {
            let can_be_tried = scenes.is_some() || !block.contains("$AFTERLIGHT_SCENES");
            if !can_be_tried {
                eprintln!("SKIPPED: examples of third-party scenes, as there are none");
            }
            can_be_tried
        })
        .collect();
    // Examples run in parallel, each in a separate folder, so none takes another's files.
    let made: Vec<BTreeSet<String>> = examples
        .par_iter()
        .map(|block| {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let mut shell = Command::new("bash");
            shell.args(["-euo", "pipefail", "-c", &format!("{SMALL}{block}")]).current_dir(folder.path());
            shell.env("PROGRAM", env!("CARGO_BIN_EXE_afterlight")).env("AFTERLIGHT_CALIBRATION", "");
            shell.env("AFTERLIGHT_CACHE", folder.path().join("truths"));
            if let Some(scenes) = &scenes {
                shell.env("AFTERLIGHT_SCENES", fs::canonicalize(scenes).expect("the folder is there"));
            }
            let output = shell.output().expect("bash starts");
            let complaint = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{block}{}\n{complaint}", output.status);
            assert!(!complaint.contains("error:"), "{block}\n{complaint}");
            let entries = fs::read_dir(folder.path()).expect("a readable folder");
            entries.map(|entry| entry.expect("a readable entry").file_name().to_string_lossy().into_owned()).collect()
        })
        .collect();
    let lines = examples.iter().flat_map(|block| block.lines());
    let tried = lines.filter(|line| line.starts_with("afterlight ")).count();
    assert!(tried > 10, "only {tried} examples were found");
    let of_commands: &[&str] = if tries_all() { &["balls.png", "cornell.png", "field.json", "plan.json"] } else { &[] };
    for name in ["hall.png", "triangle.png", "sheet.png", "cornell.exr"].iter().chain(of_commands) {
        assert!(made.iter().any(|files| files.contains(*name)), "no example has made {name}");
    }
}

/// Commands draw the pictures of lights: none is shown without its command, and each command works from the project's folder.
#[test]
fn every_picture_of_a_light_has_a_command_that_draws_it() {
    let text = document("docs/LIGHTS.md");
    let shown = links(&prose(&text)).into_iter().filter(|link| link.starts_with("images/"));
    let shown: BTreeSet<String> = shown.map(|link| format!("docs/{link}")).collect();
    let blocks = blocks(&text, "sh").concat();
    let drawn: Vec<String> =
        blocks.lines().filter_map(|command| command.rsplit_once(" -o ")).map(|(_, file)| file.to_owned()).collect();
    assert_eq!(drawn.len(), blocks.lines().count(), "a command without -o at its end");
    assert!(drawn.len() > 20, "only {} commands were found", drawn.len());
    assert_eq!(shown, drawn.iter().cloned().collect());

    // `make test-all` tries each of them.
    let (tried, drawn): (Vec<&str>, Vec<String>) = some_of(blocks.lines().zip(drawn), 6).unzip();
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir_all(folder.path().join("docs/images/lights")).expect("it can be made");
    std::os::unix::fs::symlink(project().join("assets"), folder.path().join("assets")).expect("a link");
    let mut shell = Command::new("bash");
    shell.args(["-euo", "pipefail", "-c", &format!("{SMALL}{}", tried.join("\n"))]).current_dir(folder.path());
    let output = shell.env("PROGRAM", env!("CARGO_BIN_EXE_afterlight")).output().expect("bash starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && complaint.is_empty(), "{}\n{complaint}", output.status);
    let missing: Vec<&String> = drawn.iter().filter(|name| !folder.path().join(name).is_file()).collect();
    assert!(missing.is_empty(), "not drawn: {missing:?}");
}

/// A shell function in the program's place: the same command at 96x54, and with at most two frames. The runner of another Vulkan stack
/// goes before the program.
const SMALL: &str = r#"
afterlight() {
    local -a given=()
    local command=$1
    while [ $# -gt 0 ]; do
        case $1 in
            --size) given+=(--size 96x54); shift ;;
            --frames) given+=(--frames 2); shift ;;
            *) given+=("$1") ;;
        esac
        shift
    done
    case "$command ${given[*]}" in
        doctor*|compare*|stress*|ci*|gtest*|*--size*) ;;
        *) given+=(--size 96x54) ;;
    esac
    ${AFTERLIGHT_RUNNER:-} "$PROGRAM" "${given[@]}"
}
"#;

pub fn help_of(command: &str) -> String {
    let output = program().args([command, "--help"]).output().expect("the program starts");
    assert!(output.status.success(), "{command} --help: {}", output.status);
    String::from_utf8(output.stdout).expect("help is UTF-8")
}

#[test]
fn the_documents_name_every_option_and_no_other() {
    let documents =
        ["README.md", "docs/COMMANDS.md", "docs/SETTINGS.md", "docs/WINDOW.md", "docs/CI.md"].map(document).concat();
    let options = |text: &str| -> BTreeSet<String> {
        let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
        let options = words.filter(|word| word.len() > 3 && word.starts_with("--") && !word[2..].starts_with('-'));
        options.map(str::to_owned).collect()
    };
    let defined: BTreeSet<String> = [
        "render",
        "bench",
        "inspect",
        "compare",
        "doctor",
        "reference",
        "export",
        "stress",
        "report",
        "tune",
        "view",
        "ci",
        "gtest",
    ]
    .iter()
    .flat_map(|command| options(&help_of(command)))
    // An option of the program itself.
    .chain(["--version".to_owned()])
    .collect();
    assert!(defined.contains("--gbuffer") && defined.contains("--warmup"), "{defined:?}");
    // Options of cargo, and one that only development builds have.
    let mut foreign = BTreeSet::from(["--locked", "--features"].map(str::to_owned));
    if !cfg!(feature = "hot-reload") {
        foreign.insert("--shaders".to_owned());
    }
    let named: BTreeSet<String> = options(&documents).difference(&foreign).cloned().collect();
    let missing: Vec<_> = defined.difference(&named).filter(|option| *option != "--help").collect();
    let invented: Vec<_> = named.difference(&defined).collect();
    assert!(missing.is_empty() && invented.is_empty(), "missing: {missing:?}, invented: {invented:?}");
}

/// The documented exit codes equal the codes that the help prints.
#[test]
fn the_exit_codes_are_those_that_the_program_prints() {
    let output = program().arg("--help").output().expect("the program starts");
    let help = String::from_utf8(output.stdout).expect("help is UTF-8");
    let (_, codes) = help.split_once("Exit codes:\n").expect("a list of exit codes");
    let mut rows: Vec<String> = Vec::new();
    for line in codes.lines() {
        match line.trim_start().split_once("  ").filter(|(code, _)| code.parse::<u8>().is_ok()) {
            Some((code, meaning)) => rows.push(format!("| {code} | {}", meaning.trim())),
            None => rows.last_mut().expect("a code first").push_str(&format!(" {}", line.trim())),
        }
    }
    assert_eq!(rows.len(), 6, "{rows:?}");
    let text = document("docs/COMMANDS.md");
    for row in rows {
        let row = format!("{} |", row.trim_end());
        assert!(text.contains(&row), "docs/COMMANDS.md should say {row}");
    }
}

/// The dependencies of a frame that has everything, as docs/SYNCHRONIZATION.md lists them: name, from, to and why.
#[test]
fn the_documents_list_every_dependency_with_its_reason() {
    let device = capabilities();
    let mut scene = open("builtin:hall?detail=6", &OpenOptions::default()).expect("it is built in");
    // One of its textures without levels, which the device then makes.
    scene.textures[0].rgba8_mut();
    let rows = |scene: &Scene, settings: &Settings| -> Vec<String> {
        let plan = FramePlan::of(scene, settings, &device).expect("a plan");
        rows::table(&plan).iter().map(row).collect()
    };
    let deferred = Settings { light_path: LightPath::Clustered, ..Settings::default() };
    let base = rows(&scene, &deferred);
    assert_eq!(listed_dependencies(0), base, "the table of docs/SYNCHRONIZATION.md should be\n{}", base.join("\n"));
    // Then the rows that are new or differ if something is transparent.
    let material = scene.objects[0].material;
    scene.materials[material].alpha_mode = AlphaMode::Blend;
    for (index, (name, transparency)) in Transparency::NAMES.iter().enumerate() {
        let mut changed = rows(&scene, &Settings { transparency: *transparency, ..deferred.clone() });
        changed.retain(|row| !base.contains(row));
        assert_eq!(listed_dependencies(1 + index), changed, "{name}: it should be\n{}", changed.join("\n"));
    }
    // Then frames without a G-buffer, and frames that compute lights.
    scene.materials[material].alpha_mode = AlphaMode::Opaque;
    for (number, light_path) in [(3, LightPath::Forward), (4, LightPath::Compute)] {
        let mut changed = rows(&scene, &Settings { light_path, ..Settings::default() });
        changed.retain(|row| !base.contains(row));
        assert_eq!(listed_dependencies(number), changed, "{light_path}: it should be\n{}", changed.join("\n"));
    }
    // Then frames that spread light, in a separate section.
    let in_section = |title: &str, scene: &Scene, settings: &Settings| {
        let mut changed = rows(scene, settings);
        changed.retain(|row| !base.contains(row));
        // This row differs only in the picture's source.
        changed.retain(|row| !row.contains("`read-back`"));
        let text = document("docs/SYNCHRONIZATION.md");
        let section = text.split(title).nth(1).expect("a section");
        let listed: Vec<_> = section.lines().filter(|line| line.starts_with("| `")).map(str::to_owned).collect();
        assert_eq!(listed[..changed.len().min(listed.len())], changed, "it should be\n{}", changed.join("\n"));
    };
    in_section("## Where light is spread\n", &scene, &Settings { bloom: 0.1, ..deferred.clone() });
    // Then frames that are averaged over time while something moves by itself.
    let local = Local::Parts(Placement::default());
    scene.motion.nodes.push(Node { name: "carrier".into(), parent: None, local, weights: Vec::new() });
    scene.objects[0].node = Some(0);
    in_section("## Where frames are averaged over time\n", &scene, &Settings { taa: true, ..deferred.clone() });
    // Then rows between queues.
    let occluded = Settings { ao: AmbientOcclusion::Ssao, ..deferred };
    let one = rows(&scene, &occluded);
    let mut between = rows(&scene, &Settings { queues: Queues::All, ..occluded });
    between.retain(|row| !one.contains(row));
    let text = document("docs/SYNCHRONIZATION.md");
    let section = text.split("## On several queues\n").nth(1).expect("a section");
    let listed: Vec<_> =
        section.lines().take_while(|line| !line.starts_with("## ")).filter(|line| line.starts_with("| `")).collect();
    assert_eq!(listed, between, "it should be\n{}", between.join("\n"));
}

/// The rows of frames that a window shows, which others have not.
#[test]
fn the_documents_list_what_a_window_adds() {
    let scene = open("builtin:hall?detail=6", &OpenOptions::default()).expect("it is built in");
    let headless = listed_dependencies(0);
    let straight = PresentTarget::Straight(vk::Format::B8G8R8A8_SRGB);
    let encoded = PresentTarget::Encode(Encoding { transfer: Transfer::Srgb, headroom: 1.0 });
    for (number, light_path, target) in
        [(5, LightPath::Clustered, straight), (6, LightPath::Compute, straight), (7, LightPath::Clustered, encoded)]
    {
        let plan =
            FramePlan::of(&scene, &Settings { light_path, ..Settings::default() }, &capabilities()).expect("a plan");
        let rows = |plan: &FramePlan| -> Vec<String> { rows::table(plan).iter().map(row).collect() };
        let before = rows(&plan);
        let mut added = rows(&plan.presented_as(target));
        added.retain(|row| !before.contains(row) && !headless.contains(row));
        assert_eq!(listed_dependencies(number), added, "{light_path}: it should be\n{}", added.join("\n"));
    }
}

#[cfg(feature = "window")]
#[test]
fn the_documents_have_the_keys_that_the_window_prints() {
    let text = document("docs/WINDOW.md");
    for (keys, what) in afterlight_window::keys::HELP {
        assert!(text.contains(&format!("| `{keys}` | {what} |")), "{keys}");
    }
}

fn row(edge: &rows::Row) -> String {
    format!("| `{}` | {} | {} | {} |", edge.name, edge.from, edge.to, edge.why)
}

/// The rows of docs/SYNCHRONIZATION.md's dependency table of this number.
fn listed_dependencies(number: usize) -> Vec<String> {
    let text = document("docs/SYNCHRONIZATION.md");
    let table = text.split("| Dependency |").nth(1 + number).unwrap_or_default();
    table.lines().skip(2).take_while(|line| line.starts_with('|')).map(str::to_owned).collect()
}

/// `afterlight inspect builtin:hall --graph docs/images/frame.svg` writes the drawing of the hall's frame, and the program prints the row that
/// ARCHITECTURE.md shows.
#[test]
fn the_drawn_frame_is_that_of_the_program() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut run = program();
    run.args(["inspect", "builtin:hall", "--graph", "frame.svg"]).current_dir(folder.path());
    let output = run.output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let drawn = fs::read_to_string(folder.path().join("frame.svg")).expect("it was written");
    let command = "afterlight inspect builtin:hall --graph docs/images/frame.svg";
    let text = document("ARCHITECTURE.md");
    assert!(text.contains(command));
    assert!(drawn == document("docs/images/frame.svg"), "docs/images/frame.svg is old: run {command}");

    let output = program().args(["inspect", "builtin:hall"]).output().expect("the program starts");
    let printed = String::from_utf8(output.stdout).expect("reports are UTF-8");
    let printed: Vec<&str> = printed.lines().map(str::trim).collect();
    let shown = blocks(&text, "text").into_iter().find(|block| block.starts_with("geometry-to-lighting"));
    let shown = shown.expect("ARCHITECTURE.md shows a row");
    let shown: Vec<&str> = shown.lines().map(str::trim).collect();
    assert!(printed.windows(shown.len()).any(|lines| lines == shown), "not printed: {shown:#?}");
}

#[test]
fn paths_that_the_documents_name_exist() {
    // The book also names files that its patches make.
    let entries = fs::read_dir(project().join("book/exercises")).expect("the book has exercises");
    let patches = entries.map(|entry| fs::read_to_string(entry.expect("a readable entry").path()).expect("text"));
    let patches = patches.collect::<String>();
    let is_made = |path: &str| patches.contains(&format!("--- /dev/null\n+++ b/{path}\n"));
    let mut missing = Vec::new();
    for name in documents() {
        let text = document(&name.to_string_lossy());
        let quoted = text.split('`').skip(1).step_by(2);
        let is_path = |word: &&str| {
            ["src/", "crates/", "examples/", "shaders/", "tests/", "scripts/"].iter().any(|root| word.starts_with(root))
                && word.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
                && !word.contains("NAME")
        };
        missing.extend(
            quoted
                .filter(is_path)
                .filter(|path| !project().join(path).exists() && !is_made(path))
                .map(|path| format!("{}: {path}", name.display())),
        );
    }
    assert!(missing.is_empty(), "{missing:?}");
}

/// Counting takes minutes, so that the daily run holds the page and not each change.
#[test]
fn the_page_of_coverage_is_about_all_cases() {
    if !tries_all() {
        println!("NOT RUN: `make test-all` holds the page of coverage");
        return;
    }
    let listed = program().args(["ci", "quick", "--list"]).output().expect("the program starts");
    let cases = String::from_utf8_lossy(&listed.stdout).lines().count();
    let coverage = document("docs/CI_COVERAGE.md");
    assert!(
        cases > 50 && coverage.contains(&format!("each of the {cases} cases of `afterlight ci quick`")),
        "the quick suite has {cases} cases: scripts/count-coverage counts what they call"
    );
}
