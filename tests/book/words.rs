//! Spelling, by hunspell's British dictionary and the book's own list of words.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::chapter::{Chapter, Piece, project};

/// A chapter's prose: without blocks, code, addresses, paths, tags and comments.
fn prose(chapter: &Chapter) -> String {
    let texts = chapter.pieces.iter().filter_map(|piece| match piece {
        Piece::Text(text) => Some(text.as_str()),
        Piece::Session(_) => None,
    });
    let text = texts.collect::<String>();
    let text: String = text.split("```").step_by(2).collect();
    let text: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let text = without(&without(&without(&text, "<", ">"), "](", ")"), "{{", "}}");
    let text = text.replace('\u{2019}', "'");
    // Nor paths.
    text.split_whitespace()
        .filter(|word| !word.contains('/') && !word.contains(".rs") && !word.contains(".md"))
        .map(|word| format!("{word}\n"))
        .collect()
}

/// The text without all that stands between these, and without them.
fn without(text: &str, begin: &str, end: &str) -> String {
    let mut parts = text.split(begin);
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once(end) {
            Some((_, rest)) => kept += &format!(" {rest}"),
            None => kept += part,
        }
    }
    kept
}

#[test]
fn every_word_is_spelled() {
    let Ok(mut speller) = Command::new("hunspell")
        .args(["-d", "en_GB", "-i", "utf-8", "-l"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
    else {
        eprintln!("NOT RUN: spelling needs hunspell with a British dictionary");
        return;
    };
    let chapters = Chapter::all();
    let text: String = chapters.iter().map(prose).collect();
    let mut input = speller.stdin.take().expect("a pipe");
    let writer = std::thread::spawn(move || input.write_all(text.as_bytes()));
    let output = speller.wait_with_output().expect("hunspell ends");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !complaint.contains("Can't open"), "hunspell: {complaint}");
    writer.join().expect("no panic").expect("hunspell reads all");
    let list = fs::read_to_string(project().join("book/words.txt")).expect("the book has a list of words");
    let known: BTreeSet<&str> = list.lines().collect();
    let printed = String::from_utf8_lossy(&output.stdout);
    let unknown: BTreeSet<&str> = printed.lines().filter(|word| !known.contains(word)).collect();
    let unknown: Vec<_> = unknown.into_iter().collect();
    assert!(unknown.is_empty(), "misspelled, or words that book/words.txt lacks: {}", unknown.join(" "));
    if std::env::var_os("AFTERLIGHT_BOOK").is_none() {
        let mut sorted: Vec<_> = list.lines().collect();
        sorted.sort();
        sorted.dedup();
        assert!(sorted == list.lines().collect::<Vec<_>>(), "book/words.txt is not sorted");
        let used: String = chapters.iter().map(prose).collect();
        let stale: Vec<_> = known.iter().filter(|word| !used.contains(**word)).collect();
        assert!(stale.is_empty(), "no chapter has these words of book/words.txt: {stale:?}");
    }
}
