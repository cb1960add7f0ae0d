//! A chapter as a file: its text, and the sessions in it.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

/// The project's folder.
pub fn project() -> PathBuf {
    env!("AFTERLIGHT_ROOT").into()
}

/// The folder of the chapters.
pub fn folder() -> PathBuf {
    project().join("book/src")
}

/// A command, and its output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    /// The text that is typed, without prompts.
    pub typed: String,
    pub output: String,
}

/// A block of commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Session {
    /// The words behind `console`.
    pub words: Vec<String>,
    /// True for a block in a comment, whose output is not compared.
    pub hidden: bool,
    /// The number of the first line, from 1.
    pub line: usize,
    pub commands: Vec<Command>,
}

impl Session {
    pub fn varies(&self) -> bool {
        self.words.iter().any(|word| word == "varies")
    }

    pub fn layer(&self) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix("layer="))
    }

    pub fn patch(&self) -> Option<&str> {
        self.words.iter().find_map(|word| word.strip_prefix("patch="))
    }

    fn parse(opening: &str, line: usize, hidden: bool, body: &[&str]) -> Self {
        let words = opening.split(' ').skip(1).filter(|word| !word.is_empty()).map(str::to_owned).collect();
        let mut commands: Vec<Command> = Vec::new();
        for (index, text) in body.iter().enumerate() {
            match (text.strip_prefix("$ "), text.strip_prefix("> "), commands.last_mut()) {
                (Some(typed), ..) => commands.push(Command { typed: typed.to_owned(), output: String::new() }),
                (None, Some(typed), Some(last)) if last.output.is_empty() => {
                    last.typed = format!("{}\n{typed}", last.typed)
                }
                (None, _, Some(last)) => last.output += &format!("{text}\n"),
                (None, _, None) => panic!("line {}: a session begins with `$ `, and not with {text}", line + index + 1),
            }
        }
        Self { words, hidden, line, commands }
    }

    fn write(&self, text: &mut String) {
        let fence = if self.hidden { "<!--" } else { "```" };
        let opening = if self.hidden { "<!-- console".to_owned() } else { format!("{fence}console") };
        let words = self.words.iter().map(|word| format!(" {word}")).collect::<String>();
        let _ = writeln!(text, "{opening}{words}");
        for command in &self.commands {
            let _ = writeln!(text, "$ {}", command.typed.replace('\n', "\n> "));
            text.push_str(&command.output);
        }
        let _ = writeln!(text, "{}", if self.hidden { "-->" } else { fence });
    }
}

/// A part of a chapter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Piece {
    /// Whole lines.
    Text(String),
    Session(Session),
}

#[derive(Debug, Clone)]
pub struct Chapter {
    /// The name of its file, without the ending.
    pub name: String,
    pub pieces: Vec<Piece>,
}

impl Chapter {
    pub fn read(name: &str) -> Self {
        let path = folder().join(format!("{name}.md"));
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Self { name: name.to_owned(), pieces: pieces(&text) }
    }

    /// Returns the chapters in the order of SUMMARY.md, or only the ones that `AFTERLIGHT_BOOK` names.
    pub fn all() -> Vec<Self> {
        let summary = fs::read_to_string(folder().join("SUMMARY.md")).expect("the book has a summary");
        let links = summary.split("](").skip(1).filter_map(|rest| rest.split_once(".md)"));
        let wanted = std::env::var("AFTERLIGHT_BOOK").unwrap_or_default();
        let is_wanted = |name: &str| wanted.is_empty() || wanted.split(',').any(|wanted| wanted == name);
        links.filter(|(name, _)| !name.contains('/') && is_wanted(name)).map(|(name, _)| Self::read(name)).collect()
    }

    pub fn path(&self) -> PathBuf {
        folder().join(format!("{}.md", self.name))
    }

    /// The folder of the files that its commands have made, as they are kept.
    pub fn made(&self) -> PathBuf {
        folder().join("made").join(&self.name)
    }

    pub fn sessions(&self) -> impl Iterator<Item = &Session> {
        self.pieces.iter().filter_map(|piece| match piece {
            Piece::Session(session) => Some(session),
            Piece::Text(_) => None,
        })
    }

    /// Returns its Markdown.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for piece in &self.pieces {
            match piece {
                Piece::Text(lines) => text.push_str(lines),
                Piece::Session(session) => session.write(&mut text),
            }
        }
        text
    }

    /// Returns the names of the chapter's own files that it shows or includes.
    pub fn shown(&self) -> Vec<String> {
        let prefix = format!("made/{}/", self.name);
        let text = self.text();
        let mut names: Vec<_> = text
            .match_indices(&prefix)
            .map(|(at, _)| &text[at + prefix.len()..])
            .map(|rest| rest.split([')', '"', '}', ' ', '#', ':']).next().unwrap_or_default().to_owned())
            .collect();
        names.sort();
        names.dedup();
        names
    }
}

fn pieces(text: &str) -> Vec<Piece> {
    let lines: Vec<&str> = text.lines().collect();
    let (mut pieces, mut plain, mut at) = (Vec::new(), String::new(), 0);
    while at < lines.len() {
        let line = lines[at];
        let (opening, end) = match (line.strip_prefix("```console"), line.strip_prefix("<!-- console")) {
            (Some(rest), _) if rest.is_empty() || rest.starts_with(' ') => (format!("console{rest}"), "```"),
            (_, Some(rest)) => (format!("console{rest}"), "-->"),
            // Other blocks are text, whatever stands in them.
            _ => {
                plain += &format!("{line}\n");
                at += 1;
                if line.starts_with("```") {
                    while let Some(inner) = lines.get(at) {
                        plain += &format!("{inner}\n");
                        at += 1;
                        if inner.starts_with("```") {
                            break;
                        }
                    }
                }
                continue;
            }
        };
        let length = lines[at + 1..].iter().position(|line| *line == end);
        let length = length.unwrap_or_else(|| panic!("line {}: the session has no end", at + 1));
        pieces.push(Piece::Text(std::mem::take(&mut plain)));
        let body = &lines[at + 1..at + 1 + length];
        pieces.push(Piece::Session(Session::parse(&opening, at + 1, end == "-->", body)));
        at += length + 2;
    }
    pieces.push(Piece::Text(plain));
    pieces
}

const SAMPLE: &str = "# Title\n\n```rust\n$ not a session\n```\n\n```console varies layer=1.4.309\n$ echo \\\n> one\none\n$ true\n```\nEnd.\n<!-- console\n$ touch x.png\n-->\n";

#[test]
fn a_chapter_that_is_read_is_written_the_same() {
    let chapter = Chapter { name: "sample".into(), pieces: pieces(SAMPLE) };
    assert_eq!(chapter.text(), SAMPLE);
    let sessions: Vec<_> = chapter.sessions().collect();
    assert_eq!(sessions.len(), 2);
    assert!(sessions[0].varies() && !sessions[0].hidden && sessions[1].hidden);
    assert_eq!((sessions[0].layer(), sessions[0].line), (Some("1.4.309"), 7));
    let commands = [("echo \\\none", "one\n"), ("true", "")];
    let expected = commands.map(|(typed, output)| Command { typed: typed.into(), output: output.into() });
    assert_eq!(sessions[0].commands, expected);
}
