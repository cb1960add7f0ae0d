//! Plain comments: sentences that one understands at the first reading. A script cannot read, but it knows forms in which a sentence has no head, or its subject
//! comes last. Their number may fall and not grow.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use regex::Regex;

/// The most comment sentences, in percent, that may have one of [`FORMS`].
const MOST_PERCENT: f64 = 4.0;

/// Forms of sentences to write again, each with an example.
const FORMS: [(&str, &str); 9] = [
    (r"^(The same|Likewise|Those|None|Its|Their)\b", "The same of shadow maps."),
    (
        r"^(Of|By|In|With|For|To|On|From|Without|Into|At|Before|After|Between|Over) [^.]{0,60}\.$",
        "With the views of all.",
    ),
    (r"\bthose\b", "Textures, and those of the sky, are copied."),
    (r"\bthat of\b", "Writes the depth, and that of the mask."),
    (r"\bwhere (there (is|are)|it (is|has)|some|any|none)\b", "Reads the mask where there is one."),
    (r"\b(so many|such an?|so much)\b", "Draws so many of them."),
    (r"\bof (its|their) own\b", "Has a buffer of its own."),
    (r"\b(is|are|was|has|have|does) (so|likewise)\b", "The second is so."),
    (r"\bwhat (it|they|a|an|the|is|was|has|others?|draws?|lies|comes?|goes|[a-z]+s)\b", "Draws what lies behind."),
];

/// A sentence of a comment.
struct Sentence {
    file: String,
    line: usize,
    text: String,
}

/// The sentences of the comments of a file. Consecutive lines of one kind of comment (`//`, `///` or `//!`) are read as one text; fenced code and the reasons of
/// unsafe blocks are left out.
fn sentences(file: &str, text: &str) -> Vec<Sentence> {
    let mut found = Vec::new();
    let (mut run, mut begin, mut kind): (Vec<&str>, _, _) = (Vec::new(), 0, "");
    let mut flush = |run: &mut Vec<&str>, line| {
        let joined = std::mem::take(run).join(" ");
        let mut rest = joined.as_str();
        while !rest.is_empty() {
            let is_end = |(at, own): &(usize, char)| {
                let after = rest[at + own.len_utf8()..].trim_start();
                let begins = after.starts_with(|next: char| next.is_uppercase() || next == '`' || next == '[');
                ".!?".contains(*own) && rest[at + 1..].starts_with(' ') && begins
            };
            let end = rest.char_indices().find(is_end).map_or(rest.len(), |(at, _)| at + 1);
            found.push(Sentence { file: file.to_owned(), line, text: rest[..end].trim().to_owned() });
            rest = rest[end..].trim_start();
        }
    };
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim_start();
        let own = ["///", "//!", "//"].into_iter().find(|mark| line.starts_with(mark)).unwrap_or_default();
        let is_mark = ["// SAFETY", "// ANCHOR"].iter().any(|mark| line.starts_with(mark));
        let text = if own.is_empty() || is_mark { "" } else { line[own.len()..].trim() };
        if text.is_empty() || text.starts_with("```") || own != kind {
            flush(&mut run, begin);
            begin = number;
        }
        if !text.is_empty() && !text.starts_with("```") {
            run.push(text);
        }
        kind = own;
    }
    flush(&mut run, begin);
    found
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.expect("a readable entry").path();
        match path.extension().and_then(|ending| ending.to_str()) {
            _ if path.is_dir() => sources(&path, found),
            Some("rs" | "wgsl") => found.push(path),
            _ => {}
        }
    }
}

/// Lines that are not committed, and lines of the last commit: a hint at which sentence is new.
fn added() -> String {
    let diff = |revision: &str| {
        let mut git = Command::new("git");
        git.args(["diff", "-U0", revision, "--", "*.rs", "*.wgsl"]).current_dir(env!("AFTERLIGHT_ROOT"));
        git.output().map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default()
    };
    diff("HEAD~1")
}

#[test]
fn few_sentences_of_comments_must_be_read_twice() {
    let root = Path::new(env!("AFTERLIGHT_ROOT"));
    let forms = FORMS.map(|(form, _)| Regex::new(form).expect("an expression"));
    let mut files = Vec::new();
    for folder in ["src", "crates", "shaders", "tests", "steps", "examples", "benches"] {
        sources(&root.join(folder), &mut files);
    }
    let read = |path: &PathBuf| {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        sentences(&path.strip_prefix(root).unwrap_or(path).to_string_lossy(), &text)
    };
    let all: Vec<Sentence> = files.iter().flat_map(read).collect();
    let odd: Vec<&Sentence> = all.iter().filter(|own| forms.iter().any(|form| form.is_match(&own.text))).collect();
    let percent = 100.0 * odd.len() as f64 / all.len() as f64;
    println!("{} of {} sentences of comments, {percent:.2}%", odd.len(), all.len());
    assert!(all.len() > 10_000, "only {} sentences were found", all.len());
    let added = added();
    let is_new = |own: &&&Sentence| {
        let words: Vec<_> = own.text.split(' ').collect();
        words.windows(words.len().min(6)).any(|part| added.contains(&part.join(" ")))
    };
    let new: Vec<_> = odd.iter().filter(is_new).map(|own| format!("{}:{}: {}", own.file, own.line, own.text)).collect();
    assert!(
        percent <= MOST_PERCENT,
        "{percent:.2}% of the sentences have a form that is hard to read, and may be {MOST_PERCENT}%; new ones among them:\n{}",
        new.join("\n")
    );
}

#[test]
fn forms_that_are_hard_to_read_are_found_and_plain_sentences_are_not() {
    for (form, example) in FORMS {
        assert!(Regex::new(form).is_ok_and(|form| form.is_match(example)), "{form}: {example}");
    }
    let text = "/// Draws the mask. `Mask` is empty\n/// at first! And then?\n//! A module.\n// SAFETY: it is alive.\nlet a = 1; // trailing\n";
    let found: Vec<_> = sentences("a.rs", text).into_iter().map(|own| (own.line, own.text)).collect();
    let expected = [(1, "Draws the mask."), (1, "`Mask` is empty at first!"), (1, "And then?"), (3, "A module.")];
    assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
    for plain in ["Copies the picture into a buffer.", "Returns true if the map is dirty.", "Waits for the fence."] {
        assert!(FORMS.iter().all(|(form, _)| Regex::new(form).is_ok_and(|form| !form.is_match(plain))), "{plain}");
    }
}
