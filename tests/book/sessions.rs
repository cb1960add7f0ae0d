//! The commands of chapters: their output and their pictures.

use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use rayon::prelude::*;

use crate::chapter::{Chapter, Command, Piece, Session, project};
use crate::common::golden::{LARGEST_MEAN, flip_error};
use crate::common::program::runner;
use crate::common::some_of;

/// Begins a line before which a command is over, and which says how it ended.
const MARK: char = '\u{1e}';

/// The project's folders that lie beside a chapter's own files while its commands run.
const LINKED: [&str; 6] = ["assets", "crates", "docs", "examples", "shaders", "src"];

pub fn blesses() -> bool {
    std::env::var("AFTERLIGHT_BLESS").is_ok_and(|value| value == "1")
}

/// Returns the version of the machine's validation layer, such as 1.4.309, or `None` if it is not installed.
fn layer() -> Option<String> {
    use afterlight::gpu::{Instance, InstanceOptions, Validation, vk};
    let options = InstanceOptions { validation: Validation::Core, ..InstanceOptions::default() };
    let version = Instance::new(&options).ok()?.validation_layer()?;
    let [major, minor] = [vk::api_version_major(version), vk::api_version_minor(version)];
    Some(format!("{major}.{minor}.{}", vk::api_version_patch(version)))
}

/// The program that commands mean by `afterlight`.
fn afterlight() -> PathBuf {
    std::env::var_os("AFTERLIGHT_PROGRAM").map_or_else(|| env!("CARGO_BIN_EXE_afterlight").into(), PathBuf::from)
}

/// A folder in which a chapter's commands run.
pub struct Desk {
    folder: tempfile::TempDir,
    /// A folder on the path, with the program.
    programs: tempfile::TempDir,
    layer: Option<String>,
}

impl Desk {
    /// Prepares a desk with links to the folders of `project` and with a script that starts `program`.
    pub fn new(project: &Path, program: &Path, layer: Option<String>) -> Self {
        let [folder, programs] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
        for name in LINKED {
            symlink(project.join(name), folder.path().join(name)).expect("a link");
        }
        let runner = runner().map(|runner| format!("{} ", runner.display())).unwrap_or_default();
        let script = programs.path().join("afterlight");
        fs::write(&script, format!("#!/bin/sh\nexec {runner}'{}' \"$@\"\n", program.display())).expect("a script");
        fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).expect("a script that can be started");
        Self { folder, programs, layer }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Types the commands of these sessions, and returns the output of each. The error says where they ended.
    fn run(&self, name: &str, sessions: &[&Session]) -> Result<Vec<Vec<String>>, String> {
        let mut script = "exec 2>&1\n".to_owned();
        for (session, command) in sessions.iter().flat_map(|own| own.commands.iter().map(move |command| (own, command)))
        {
            let failed = format!("echo \"{name}.md, the session of line {}: ended with $?\"; exit 1;", session.line);
            script += &format!("{}\n[ $? = 0 ] || {{ {failed} }}\nprintf '\\n{MARK}\\n'\n", command.typed);
        }
        let path = std::env::var("PATH").unwrap_or_default();
        let mut bash = Process::new("bash");
        bash.env("PATH", format!("{}:{path}", self.programs.path().display()));
        bash.args(["-c", &script]).current_dir(self.path());
        bash.env("AFTERLIGHT_CALIBRATION", "").env("COLUMNS", "100").env("NO_COLOR", "1").env("LC_ALL", "C.UTF-8");
        bash.env("AFTERLIGHT_CACHE", Path::new(env!("CARGO_TARGET_TMPDIR")).join("book-truths"));
        let output = bash.output().expect("bash starts");
        let printed = String::from_utf8_lossy(&output.stdout);
        if !output.status.success() {
            // The last command's output is behind the last mark.
            return Err(tidy(printed.rsplit(MARK).next().unwrap_or_default(), self.path()));
        }
        let mut printed = printed.split(MARK).map(|text| tidy(text, self.path()));
        Ok(sessions.iter().map(|session| printed.by_ref().take(session.commands.len()).collect()).collect())
    }
}

/// Whole lines without spaces at their ends, and without empty lines at both ends.
fn tidy(printed: &str, folder: &Path) -> String {
    let printed = printed.replace(&format!("{}/", folder.display()), "");
    let lines: Vec<_> = printed.lines().map(str::trim_end).collect();
    let text = lines.join("\n");
    let text = text.trim_matches('\n');
    if text.is_empty() { String::new() } else { format!("{text}\n") }
}

/// The text with all numbers alike and all spaces alike, since a machine's times and sizes change both.
fn without_numbers(text: &str) -> String {
    let mut kept = String::new();
    for c in text.chars() {
        let c = match c {
            '0'..='9' => '#',
            c if c.is_whitespace() => ' ',
            c => c,
        };
        let repeats = matches!(c, '#' | ' ') && kept.ends_with(c);
        // 12.5 and 13 are one number, and so are -3 and 3.
        if !repeats && c != '.' && c != '-' {
            kept.push(c);
        }
    }
    kept
}

fn same(session: &Session, expected: &str, actual: &str) -> bool {
    match session.varies() {
        true => without_numbers(expected) == without_numbers(actual),
        false => expected == actual,
    }
}

/// Types the commands of a chapter that are for the tree as it stands, or for a patch. Returns the differences from the chapter, and the chapter as
/// it would be right.
fn try_commands(chapter: &Chapter, desk: &Desk, patch: Option<&str>) -> Result<(Vec<String>, Chapter), String> {
    let (mut wrong, mut right) = (Vec::new(), chapter.clone());
    let runs =
        |own: &Session| own.patch() == patch && own.layer().is_none_or(|wanted| desk.layer.as_deref() == Some(wanted));
    let sessions: Vec<&Session> = chapter.sessions().filter(|session| runs(session)).collect();
    let mut printed = desk.run(&chapter.name, &sessions)?.into_iter();
    for piece in &mut right.pieces {
        let Piece::Session(session) = piece else { continue };
        if !runs(session) {
            continue;
        }
        let printed = printed.next().unwrap_or_default();
        // Another stack has other bits: there only sessions about its layer matter.
        if session.hidden || (runner().is_some() && session.layer().is_none()) {
            continue;
        }
        let told = session.clone();
        for (Command { typed, output }, printed) in session.commands.iter_mut().zip(printed) {
            if printed.lines().any(|line| line.starts_with("> ") || line.starts_with("$ ")) {
                wrong.push(format!(
                    "{}.md, line {}: $ {typed}\nprints lines that look like commands",
                    chapter.name, told.line
                ));
            } else if blesses() {
                *output = printed;
            } else if !same(&told, output, &printed) {
                wrong.push(format!(
                    "{}.md, line {}: $ {typed}\nthe chapter says:\n{output}it prints:\n{printed}",
                    chapter.name, told.line
                ));
            }
        }
    }
    Ok((wrong, right))
}

/// Compares a file that a chapter shows with the one that its commands made.
fn compare_file(kept: &Path, made: &Path) -> Result<(), String> {
    let name = kept.display();
    if !kept.exists() {
        return Err(format!("{name} is not there"));
    }
    match kept.extension().and_then(|extension| extension.to_str()) {
        Some("png") => {
            let open = |path: &Path| {
                image::open(path).map(|image| image.into_rgb8()).map_err(|error| format!("{}: {error}", path.display()))
            };
            let (expected, actual) = (open(kept)?, open(made)?);
            if expected.dimensions() != actual.dimensions() {
                return Err(format!("{name} has another size than what is drawn"));
            }
            let (mean, _) = flip_error(&expected, &actual);
            if mean > LARGEST_MEAN { Err(format!("{name} is not what is drawn: FLIP {mean:.4}")) } else { Ok(()) }
        }
        // A page of times is another one each time; its sections stay.
        Some("html") => {
            let headings = |path: &Path| -> Result<Vec<String>, String> {
                let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
                let found = text.split("<h").filter(|rest| rest.starts_with(['1', '2', '3']));
                let found = found.filter_map(|rest| rest.split_once("</h"));
                Ok(found.map(|(heading, _)| without_numbers(heading)).collect())
            };
            let (expected, actual) = (headings(kept)?, headings(made)?);
            if expected == actual { Ok(()) } else { Err(format!("{name} has other headings than what is made")) }
        }
        _ => {
            let read = |path: &Path| fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()));
            if read(kept)? == read(made)? { Ok(()) } else { Err(format!("{name} is not what is made")) }
        }
    }
}

/// Compares the files that the chapter shows with the files that its commands have made, or keeps the new ones.
fn try_files(chapter: &Chapter, desk: &Desk, patch: Option<&str>) -> Vec<String> {
    let mut wrong = Vec::new();
    for name in chapter.shown() {
        let (kept, made) = (chapter.made().join(&name), desk.path().join(&name));
        if !made.exists() {
            let names_it = |own: &Session| own.commands.iter().any(|command| command.typed.contains(&name));
            // Otherwise a patched program makes it, or the program as it stands.
            if patch.is_none() && !chapter.sessions().any(|own| own.patch().is_some() && names_it(own)) {
                wrong.push(format!("{}.md shows {name}, which no command makes", chapter.name));
            }
            continue;
        }
        if runner().is_some() {
            continue;
        }
        if blesses() {
            fs::create_dir_all(chapter.made()).expect("a folder for pictures");
            fs::copy(&made, &kept).unwrap_or_else(|error| panic!("{}: {error}", kept.display()));
        } else if let Err(what) = compare_file(&kept, &made) {
            wrong.push(what);
        }
    }
    wrong
}

/// Tries a chapter, and with `AFTERLIGHT_BLESS` makes it right.
pub fn try_chapter(chapter: &Chapter, desk: &Desk, patch: Option<&str>) -> Vec<String> {
    let (mut wrong, right) = match try_commands(chapter, desk, patch) {
        Ok(tried) => tried,
        Err(why) => return vec![why],
    };
    wrong.extend(try_files(chapter, desk, patch));
    if blesses() {
        fs::write(chapter.path(), right.text()).unwrap_or_else(|error| panic!("{}: {error}", chapter.path().display()));
    }
    wrong
}

#[test]
fn commands_print_and_draw_what_the_chapters_say() {
    let (layer, project) = (layer(), project());
    let chapters = Chapter::all();
    let every = if blesses() || std::env::var_os("AFTERLIGHT_BOOK").is_some() { 1 } else { 6 };
    // Another stack is asked about its layer only.
    let chapters =
        chapters.iter().filter(|own| runner().is_none() || own.sessions().any(|own| own.layer() == layer.as_deref()));
    let chapters: Vec<_> = some_of(chapters, every).collect();
    let wrong: Vec<String> = chapters
        .into_par_iter()
        .flat_map(|chapter| try_chapter(chapter, &Desk::new(&project, &afterlight(), layer.clone()), None))
        .collect();
    assert!(wrong.is_empty(), "{}\nAFTERLIGHT_BLESS=1 writes what is printed and drawn", wrong.join("\n"));
}

#[test]
fn numbers_that_vary_are_not_compared_and_words_are() {
    assert_eq!(without_numbers("GEOMETRY   1.25 ms, -3"), without_numbers("GEOMETRY 12 ms, 4.5"));
    assert_ne!(without_numbers("GEOMETRY 1.25 ms"), without_numbers("LIGHTING 1.25 ms"));
    assert_ne!(without_numbers("a 1 b"), without_numbers("a b"));
}
