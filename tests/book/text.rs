//! Listings, pictures and exercises: each that a chapter names is there, and none is there that no chapter names.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::chapter::{Chapter, folder, project};
use crate::sessions::blesses;

/// The largest width of a picture in pixels, and the most bytes that a chapter's pictures may take, since the repository keeps them for ever.
const WIDEST: u32 = 480;
const LARGEST_CHAPTER: u64 = 700_000;

const BLESS: &str = "AFTERLIGHT_BLESS=1 scripts/test machine book text:: writes it anew";

/// Chapters without exercises.
const READ_ONLY: [&str; 2] = ["introduction", "one-line"];

/// A listing in a chapter: a line `<!-- listing: PATH:ANCHOR -->`, and the fence below it.
#[derive(Debug, PartialEq, Eq)]
struct Listing {
    /// The path that the mark in the chapter names.
    path: String,
    anchor: Option<String>,
    /// The lines within the fence, counted from 0.
    lines: Range<usize>,
}

/// Returns the listings of a chapter. The error names a mark without a fence below it.
fn listings(text: &str) -> Result<Vec<Listing>, String> {
    let lines: Vec<_> = text.lines().collect();
    let mut found = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some(named) = line.strip_prefix("<!-- listing: ").and_then(|rest| rest.strip_suffix(" -->")) else {
            continue;
        };
        let is_open = lines.get(index + 1).is_some_and(|line| line.starts_with("```"));
        let length = lines.iter().skip(index + 2).position(|line| *line == "```").filter(|_| is_open);
        let Some(length) = length else { return Err(format!("{named} has no fence below its mark")) };
        let (path, anchor) = match named.split_once(':') {
            Some((path, anchor)) => (path.to_owned(), Some(anchor.to_owned())),
            None => (named.to_owned(), None),
        };
        found.push(Listing { path, anchor, lines: index + 2..index + 2 + length });
    }
    Ok(found)
}

/// The lines between the marks of an anchor, without the marks of others, and as far to the left as the first of them may stand.
fn listing(text: &str, anchor: &str) -> Result<Vec<String>, String> {
    let marks = |kind: &str| -> Vec<usize> {
        let is_mark = |line: &str| {
            line.trim_start()
                .trim_start_matches(['/', '#', ' '])
                .strip_prefix(kind)
                .is_some_and(|rest| rest.trim() == anchor)
        };
        text.lines().enumerate().filter(|(_, line)| is_mark(line)).map(|(index, _)| index).collect()
    };
    match (marks("ANCHOR:").as_slice(), marks("ANCHOR_END:").as_slice()) {
        (&[begin], &[end]) if begin + 1 < end => {
            let lines = || text.lines().skip(begin + 1).take(end - begin - 1).filter(|line| !line.contains(" ANCHOR"));
            let indents =
                lines().filter(|line| !line.trim().is_empty()).map(|line| line.len() - line.trim_start().len());
            let indent = indents.min().unwrap_or(0);
            Ok(lines().map(|line| line.get(indent..).unwrap_or_default().to_owned()).collect())
        }
        (begins, ends) => {
            Err(format!("{} begins and {} ends of it, or no lines between them", begins.len(), ends.len()))
        }
    }
}

/// Text files below a folder.
fn files_below(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            files_below(&path, endings, found);
        } else if path.extension().is_some_and(|own| endings.iter().any(|ending| own == *ending)) {
            found.push(path);
        }
    }
}

#[test]
fn every_listing_is_code_of_the_project_and_every_anchor_is_shown() {
    let mut shown: BTreeMap<PathBuf, BTreeSet<String>> = BTreeMap::new();
    let mut wrong = Vec::new();
    for chapter in Chapter::all() {
        let text = chapter.text();
        let found = listings(&text).unwrap_or_else(|why| panic!("{}.md: {why}", chapter.name));
        let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
        // The last first, so that lines of the others stay where they are.
        for Listing { path, anchor, lines: own } in found.into_iter().rev() {
            let full = folder().join(&path);
            let Ok(text) = fs::read_to_string(&full) else {
                wrong.push(format!("{}.md lists {path}, which is not there", chapter.name));
                continue;
            };
            let code = match &anchor {
                Some(anchor) => listing(&text, anchor),
                None => Ok(text.lines().map(str::to_owned).collect()),
            };
            match code {
                Ok(code) if lines[own.clone()] == code => {}
                Ok(code) if blesses() => _ = lines.splice(own, code),
                Ok(_) => wrong.push(format!(
                    "{}.md: line {}: the listing is no longer what {path} has; {BLESS}",
                    chapter.name,
                    own.start + 1
                )),
                Err(why) => wrong.push(format!("{}.md lists {path}: {why}", chapter.name)),
            }
            let full = fs::canonicalize(&full).expect("it was read");
            shown.entry(full).or_default().extend(anchor);
        }
        let blessed = lines.join("\n") + "\n";
        if blesses() && blessed != text {
            fs::write(chapter.path(), blessed).unwrap_or_else(|error| panic!("{}.md: {error}", chapter.name));
        }
    }
    for chapter in Chapter::all() {
        let text = chapter.text();
        let lines: Vec<_> = text.lines().collect();
        let is_code = |line: &str| ["```rust", "```wgsl", "```diff"].iter().any(|fence| line.starts_with(fence));
        let copied = lines.windows(2).filter(|pair| is_code(pair[1]) && !pair[0].starts_with("<!-- listing: "));
        wrong.extend(copied.map(|pair| format!("{}.md has code of its own, below: {}", chapter.name, pair[0])));
        // Only mdBook knows them: wherever else a chapter is read, they would stand in place of code.
        let bare = lines.iter().filter(|line| line.contains("{{#"));
        wrong.extend(bare.map(|line| format!("{}.md has what only mdBook shows: {line}", chapter.name)));
    }
    let mut sources = Vec::new();
    for folder in ["src", "crates", "shaders", "examples", "assets", "tests"] {
        files_below(&project().join(folder), &["rs", "wgsl", "toml"], &mut sources);
    }
    for source in sources {
        let text = fs::read_to_string(&source).expect("a source is text");
        let source = fs::canonicalize(&source).expect("it was read");
        for (_, rest) in text.match_indices("ANCHOR: ").map(|(at, mark)| text.split_at(at + mark.len())) {
            let anchor = rest.lines().next().unwrap_or_default().trim();
            // This file has examples of anchors.
            if source.ends_with("tests/book/text.rs") {
                continue;
            }
            // If only some chapters are tried, a chapter that is left out may show the anchor.
            let is_shown = shown.get(&source).is_some_and(|anchors| anchors.contains(anchor));
            if !is_shown && std::env::var_os("AFTERLIGHT_BOOK").is_none() {
                wrong.push(format!("{} has the anchor {anchor}, which no chapter shows", source.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn pictures_are_small_and_few_and_all_are_shown() {
    let mut wrong = Vec::new();
    for chapter in Chapter::all() {
        let (shown, mut bytes) = (chapter.shown(), 0);
        for entry in fs::read_dir(chapter.made()).into_iter().flatten() {
            let entry = entry.expect("a readable entry");
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if !shown.contains(&name) {
                wrong.push(format!("{} is shown nowhere", path.display()));
            }
            bytes += entry.metadata().expect("a readable entry").len();
            if path.extension().is_some_and(|ending| ending == "png") {
                let (width, _) =
                    image::image_dimensions(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                if width > WIDEST {
                    wrong.push(format!("{} is {width} pixels wide, and may have {WIDEST}", path.display()));
                }
            }
        }
        if bytes > LARGEST_CHAPTER {
            wrong.push(format!("{}.md shows {bytes} bytes, and may show {LARGEST_CHAPTER}", chapter.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Headings of exercises, each with the text below it.
fn exercises(text: &str) -> Vec<(&str, &str)> {
    let Some((_, rest)) = text.split_once("\n## Exercises\n") else { return Vec::new() };
    let rest = rest.split("\n## ").next().unwrap_or_default();
    rest.split("\n### ").skip(1).filter_map(|own| own.split_once('\n')).collect()
}

/// Returns true if an answer has a command whose output is compared, or one that draws a picture, which is.
fn is_tried(answer: &str) -> bool {
    let blocks = answer.split("```console").skip(1).filter_map(|rest| rest.split("\n```").next());
    let prints = blocks
        .clone()
        .any(|block| block.lines().skip(1).any(|line| !line.starts_with("$ ") && !line.starts_with("> ")));
    prints || answer.contains("](made/") && (answer.contains("<!-- console") || blocks.count() > 0)
}

#[test]
fn every_chapter_has_three_exercises_whose_answers_are_tried() {
    let mut wrong = Vec::new();
    for chapter in Chapter::all().into_iter().filter(|own| !READ_ONLY.contains(&own.name.as_str())) {
        let text = chapter.text();
        let exercises = exercises(&text);
        if exercises.len() < 3 {
            wrong.push(format!("{}.md has {} exercises", chapter.name, exercises.len()));
        }
        for (title, body) in exercises {
            let answer =
                body.split_once("<summary>Answer</summary>").and_then(|(_, rest)| rest.split_once("</details>"));
            if !answer.is_some_and(|(answer, _)| is_tried(answer)) {
                let title = format!("\u{201c}{title}\u{201d}");
                wrong.push(format!("{}.md: the answer of {title} has no command with output or picture", chapter.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn listings_are_found_by_their_marks() {
    let text = "a\n    // ANCHOR: one\nb\nc\n    // ANCHOR_END: one\n# ANCHOR: two\n# ANCHOR_END: two\n";
    assert_eq!(listing(text, "one"), Ok(vec!["b".to_owned(), "c".to_owned()]));
    assert!(listing(text, "two").is_err() && listing(text, "three").is_err());
    let nested = "// ANCHOR: a\n    x\n\n        // ANCHOR: b\n        y\n        // ANCHOR_END: b\n// ANCHOR_END: a\n";
    assert_eq!(listing(nested, "a"), Ok(["x", "", "    y"].map(str::to_owned).to_vec()));
    let chapter = "a\n<!-- listing: ../a.rs:b -->\n```rust\nx\ny\n```\n<!-- listing: c.patch -->\n```diff\n```\n";
    let of =
        |path: &str, anchor: Option<&str>, lines| Listing { path: path.into(), anchor: anchor.map(Into::into), lines };
    assert_eq!(listings(chapter), Ok(vec![of("../a.rs", Some("b"), 3..5), of("c.patch", None, 8..8)]));
    assert!(listings("<!-- listing: a -->\ntext\n```rust\n```\n").is_err());
    assert!(is_tried("```console\n$ a\nb\n```") && !is_tried("```console\n$ a\n> b\n```\nc"));
    assert_eq!(exercises("x\n## Exercises\n\n### A\nb\n### C\nd\n## E\n### F\ng"), [("A", "b"), ("C", "d")]);
}
