//! The reading of an MTL: keywords in any case, numbers checked while their line is known, then tobj; and the options that
//! stand before a map's name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec2;

use super::numbers::{Odd, number};
use super::text::{self, Backslash, Continuation};
use crate::Error;

/// The rules of lines that end with a backslash: names of materials keep it.
const CONTINUATION: Continuation = Continuation { backslash, is_statement };

fn backslash(begun: &str) -> Backslash {
    let (keyword, _) = text::split_keyword(begun);
    let is_text = keyword.starts_with('#') || keyword.eq_ignore_ascii_case("newmtl");
    if is_text { Backslash::Text } else { Backslash::Names }
}

fn is_statement(line: &str) -> bool {
    let (keyword, _) = text::split_keyword(line);
    keyword.eq_ignore_ascii_case("newmtl") || canonical(keyword).is_some()
}

/// A `newmtl` and the statements after it.
#[derive(Debug)]
pub(super) struct Definition {
    pub name: String,
    pub file: PathBuf,
    /// As tobj read it, under a number for a name.
    pub source: tobj::Material,
    /// The line of the last statement of each keyword, spelled as [`canonical`] does.
    pub lines: HashMap<&'static str, usize>,
}

/// Returns the definitions of an MTL file, and warnings about statements that are left out.
///
/// # Errors
/// `Error::Read`, and `Error::Content` for a file that is no text.
pub(super) fn read(path: &Path) -> Result<(Vec<Definition>, Vec<String>), Error> {
    parse(path, &text::read(path)?)
}

fn parse(path: &Path, text: &str) -> Result<(Vec<Definition>, Vec<String>), Error> {
    let mut clean = String::new();
    let mut found: Vec<(String, HashMap<&'static str, usize>)> = Vec::new();
    let (mut unknown, mut wrong, mut homeless) = (Odd::default(), Odd::default(), Odd::default());
    for (line, statement) in text::statements(text, &CONTINUATION) {
        let (keyword, rest) = text::split_keyword(&statement);
        if keyword.eq_ignore_ascii_case("newmtl") {
            clean.push_str(&format!("newmtl {}\n", found.len()));
            found.push((rest.to_owned(), HashMap::new()));
            continue;
        }
        match (canonical(keyword), found.last_mut()) {
            (Some(""), _) => {}
            (_, None) => homeless.add(line, || format!("`{keyword}` belongs to no material")),
            (None, _) => unknown.add(line, || format!("`{keyword}` is not supported")),
            (Some(canonical), Some((_, lines))) => match value(canonical, rest) {
                Ok(Some(value)) => {
                    clean.push_str(&format!("{canonical} {value}\n"));
                    lines.insert(canonical, line);
                }
                Ok(None) => {}
                Err(fault) => wrong.add(line, || fault),
            },
        }
    }
    let parsed = tobj::load_mtl_buf(&mut clean.as_bytes());
    let (sources, _) = parsed.map_err(|cause| Error::Content {
        path: path.to_owned(),
        line: None,
        what: format!("cannot be parsed: {cause}"),
    })?;
    let definitions = found.into_iter().zip(sources);
    let definitions =
        definitions.map(|((name, lines), source)| Definition { name, file: path.to_owned(), source, lines }).collect();
    let left_out = [homeless, unknown, wrong].map(|odd| odd.warning("left out", "lines"));
    let warnings = left_out.into_iter().flatten().map(|warning| format!("{}: {warning}", path.display()));
    Ok((definitions, warnings.collect()))
}

/// A keyword as tobj spells it; empty for one that changes nothing here, none for one that is not supported.
fn canonical(keyword: &str) -> Option<&'static str> {
    Some(match keyword.to_ascii_lowercase().as_str() {
        "ka" => "Ka",
        "kd" => "Kd",
        "ks" => "Ks",
        "ke" => "Ke",
        "ns" => "Ns",
        "d" => "d",
        "tr" => "Tr",
        "pr" => "Pr",
        "pm" => "Pm",
        "map_kd" => "map_Kd",
        "map_ks" => "map_Ks",
        "map_ke" => "map_Ke",
        "map_ns" => "map_Ns",
        "map_d" => "map_d",
        "map_pr" => "map_Pr",
        "map_pm" => "map_Pm",
        "bump" | "map_bump" => "bump",
        "norm" | "map_kn" | "map_norm" => "norm",
        "map_ka" => "map_Ka",
        // Refraction, filters and the choice of a 1990s' light model.
        "" | "ni" | "tf" | "illum" | "sharpness" | "map_aat" => "",
        comment if comment.starts_with('#') => "",
        _ => return None,
    })
}

/// Returns the text that tobj shall read after the keyword; none where nothing is left.
fn value(keyword: &str, rest: &str) -> Result<Option<String>, String> {
    if keyword.starts_with("map_") || keyword == "bump" || keyword == "norm" {
        return Ok(Some(rest.to_owned()).filter(|rest| !rest.is_empty()));
    }
    let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#')).peekable();
    // `d -halo 0.5` fades with the angle; the plain value is the nearest thing.
    words.next_if_eq(&"-halo");
    let numbers: Vec<&str> = words.collect();
    let Some(&first) = numbers.first() else { return Err(format!("`{keyword}` has no value")) };
    if !keyword.starts_with('K') {
        return Ok(Some(number(first)?.into_owned()));
    }
    if first == "spectral" {
        return Err(format!("`{keyword} spectral` is not supported: give red, green and blue"));
    }
    let channels = match *numbers.as_slice() {
        [grey] => [grey; 3],
        ["xyz", ..] => return Err(format!("`{keyword} xyz` is not supported: give red, green and blue")),
        [r, g, b, ..] => [r, g, b],
        _ => return Err(format!("`{keyword}` has {} numbers instead of 3", numbers.len())),
    };
    let channels: Result<Vec<_>, String> = channels.into_iter().map(number).collect();
    Ok(Some(channels?.join(" ")))
}

/// A map statement's value, taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Map {
    pub name: String,
    /// `-bm`
    pub bump_scale: f64,
    /// `-s`, of texture coordinates
    pub scale: DVec2,
    /// `-o`, of texture coordinates
    pub offset: DVec2,
    /// `-imfchan`: r, g, b, m, l or z
    pub channel: Option<char>,
    /// `-clamp on`: the picture is there once, and its edges go on.
    pub is_clamped: bool,
    /// Options that change the picture and are not supported.
    pub ignored: Vec<String>,
}

impl Map {
    /// Takes a map's value apart. The text behind the options is the name, spaces and all.
    pub fn parse(value: &str) -> Self {
        let mut map = Self {
            name: String::new(),
            bump_scale: 1.0,
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            channel: None,
            is_clamped: false,
            ignored: Vec::new(),
        };
        let mut rest = value.trim();
        while let Some(after) = map.option(rest) {
            rest = after;
        }
        map.name = rest.to_owned();
        map
    }

    /// Moves options and a comment that some programs write behind the name off it; the format has options before the name. `None` if
    /// nothing stands behind the name.
    pub fn without_tail(&self) -> Option<Self> {
        let is_start = |at: &usize| self.name[..*at].ends_with(char::is_whitespace);
        let mut starts = self.name.match_indices(['#', '-']).filter(|(at, _)| is_start(at));
        let (at, _) = starts.find(|(at, mark)| *mark == "#" || is_option(text::split_keyword(&self.name[*at..]).0))?;
        let (name, tail) = self.name.split_at(at);
        let mut map = Self { name: name.trim().to_owned(), ..self.clone() };
        // The parser takes the last word for the name, so it needs one.
        let tail = format!("{} name", tail.split('#').next().unwrap_or_default().trim());
        let mut rest = tail.as_str();
        while let Some(after) = map.option(rest) {
            rest = after;
        }
        (!map.name.is_empty()).then_some(map)
    }

    /// Takes one option off the front.
    fn option<'a>(&mut self, text: &'a str) -> Option<&'a str> {
        let (option, rest) = text::split_keyword(text);
        let most_numbers = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            "-bm" | "-boost" | "-texres" => 1,
            _ => 0,
        };
        let (mut numbers, after_numbers) = leading_numbers(rest, most_numbers);
        if numbers.iter().any(|number| number.is_nan()) {
            let words = rest[..rest.len() - after_numbers.len()].trim_end();
            self.ignored.push(format!("{option} {words}"));
            // As if it were not there.
            numbers.clear();
            if option == "-bm" {
                return Some(after_numbers);
            }
        }
        let (word, after_word) = text::split_keyword(rest);
        let pair = |default: f64| {
            DVec2::new(numbers.first().copied().unwrap_or(default), numbers.get(1).copied().unwrap_or(default))
        };
        let mut ignore_unless = |is_default: bool| {
            if !is_default {
                self.ignored.push(format!("{option} {word}"));
            }
        };
        match option {
            "-bm" => self.bump_scale = *numbers.first()?,
            "-s" => self.scale = pair(1.0),
            "-o" => self.offset = pair(0.0),
            "-t" => ignore_unless(numbers.iter().all(|&n| n == 0.0)),
            "-mm" => ignore_unless(numbers.is_empty() || numbers == [0.0, 1.0]),
            "-boost" => ignore_unless(numbers.iter().all(|&n| n == 0.0)),
            "-texres" => {}
            "-blendu" | "-blendv" => ignore_unless(word == "on"),
            "-cc" => ignore_unless(word == "off"),
            "-clamp" => self.is_clamped = word == "on",
            "-imfchan" => self.channel = word.chars().next(),
            // A name may begin with a dash.
            _ => return None,
        }
        let after = if most_numbers > 0 { after_numbers } else { after_word };
        (!after.is_empty()).then_some(after)
    }
}

/// The options of maps that [`Map::option`] takes off.
fn is_option(word: &str) -> bool {
    matches!(
        word,
        "-s" | "-o"
            | "-t"
            | "-mm"
            | "-bm"
            | "-boost"
            | "-texres"
            | "-blendu"
            | "-blendv"
            | "-cc"
            | "-clamp"
            | "-imfchan"
    )
}

/// Returns up to `most` numbers at the front (not a number where one cannot be used), and the rest of the text. The last word is never taken:
/// it is the name.
fn leading_numbers(text: &str, most: usize) -> (Vec<f64>, &str) {
    let (mut numbers, mut rest) = (Vec::new(), text);
    while numbers.len() < most {
        let (word, after) = text::split_keyword(rest);
        let own = match number(word) {
            Ok(own) => own.parse().ok(),
            Err(_) => word.parse::<f64>().ok().map(|_| f64::NAN),
        };
        let Some(own) = own.filter(|_| !after.is_empty()) else { break };
        numbers.push(own);
        rest = after;
    }
    (numbers, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> (Vec<Definition>, Vec<String>) {
        parse(Path::new("m.mtl"), text).unwrap()
    }

    #[test]
    fn options_before_a_name_are_taken_off_it() {
        let map = Map::parse("-bm 0.2 -s 2 3 1 -o 0.5 0 -clamp on -imfchan r  wall no 1.png");
        assert_eq!(map.name, "wall no 1.png");
        assert_eq!((map.bump_scale, map.scale, map.offset), (0.2, DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!((map.channel, map.is_clamped, map.ignored), (Some('r'), true, Vec::new()));
        let odd = Map::parse("-s 1 nan 1 -bm 1e39 -o inf a.png");
        assert_eq!((odd.name.as_str(), odd.scale, odd.bump_scale, odd.offset), ("a.png", DVec2::ONE, 1.0, DVec2::ZERO));
        assert_eq!(odd.ignored, ["-s 1 nan 1", "-bm 1e39", "-o inf"]);
        for (value, name) in [
            ("01.png", "01.png"),
            ("-bm 2 3 walls.png", "3 walls.png"),
            ("-s 1 1 1 7", "7"),
            ("-dash.png", "-dash.png"),
            ("-bm", "-bm"),
            ("-mm 0 1 a.png", "a.png"),
        ] {
            assert_eq!(Map::parse(value).name, name);
        }
    }

    #[test]
    fn options_and_comments_behind_a_name_are_taken_off_it() {
        let map = Map::parse("wall-1 #2.png -s 0.5 2 1 -clamp on # the wall").without_tail().unwrap();
        assert_eq!(
            (map.name.as_str(), map.scale, map.is_clamped),
            ("wall-1", DVec2::ONE, false),
            "a number sign first"
        );
        let map = Map::parse("-bm 3 wall-1.png -s 0.5 2 1 -clamp on # the wall").without_tail().unwrap();
        assert_eq!((map.name.as_str(), map.scale, map.is_clamped), ("wall-1.png", DVec2::new(0.5, 2.0), true));
        assert_eq!(map.bump_scale, 3.0);
        for name in ["wall -1.png", "-dash.png", "wall#1.png", "-s 1 1 1 a.png"] {
            assert_eq!(Map::parse(name).without_tail(), None, "{name}");
        }
    }

    #[test]
    fn keywords_in_any_case_short_colours_and_comments_are_read() {
        let (definitions, warnings) = parsed(
            "Kd 1 1 1\n newmtl  a b \nKD 0.5 # grey\nd -halo 0.25\nMAP_KD x y.png\nPr .5\nnorm n.png\nfoo\nbar\nnewmtl c\nmap_d\n",
        );
        assert_eq!(definitions.len(), 2);
        let Definition { name, source, lines, .. } = &definitions[0];
        assert_eq!((name.as_str(), source.diffuse, source.dissolve), ("a b", Some([0.5; 3]), Some(0.25)));
        assert_eq!(source.diffuse_texture.as_deref(), Some("x y.png"));
        assert_eq!(source.unknown_param.get("norm").map(String::as_str), Some("n.png"));
        assert_eq!(lines.get("map_Kd"), Some(&5));
        let expected = [
            "m.mtl: line 1: `Kd` belongs to no material; left out",
            "m.mtl: line 8: `foo` is not supported; left out, and 1 more such lines",
        ];
        assert_eq!(warnings, expected);
    }

    #[test]
    fn a_statement_with_a_wrong_number_is_left_out_and_told_by_its_line() {
        for (text, expected) in [
            ("Kd 1 nan 1", "line 3: `nan` is not a finite number"),
            ("Ns 1e39", "line 3: 1e39 is out of range: at most 1e15"),
            ("Kd 1 2", "line 3: `Kd` has 2 numbers instead of 3"),
            ("Ke spectral a.rfl", "line 3: `Ke spectral` is not supported: give red, green and blue"),
            ("d", "line 3: `d` has no value"),
            ("d x", "line 3: `x` is not a number"),
        ] {
            let (definitions, warnings) = parsed(&format!("newmtl a\nPr 0,5\n{text}\nPm 1\n"));
            assert_eq!(warnings, [format!("m.mtl: {expected}; left out")]);
            let Definition { source, lines, .. } = &definitions[0];
            assert_eq!(
                (source.diffuse, source.dissolve, source.shininess, lines.len()),
                (None, None, None, 2),
                "{text}"
            );
            assert_eq!(source.unknown_param.get("Pr").map(String::as_str), Some("0.5"));
        }
    }

    #[test]
    fn names_keep_a_backslash_and_statements_go_on_behind_one() {
        let (definitions, warnings) =
            parsed("newmtl Solid\\\nKd 1 \\\n 0 \\\n 0\nmap_Kd C:\\tex\\\nNs 3\n# D:\\\nd 1\n");
        let Definition { name, source, .. } = &definitions[0];
        assert_eq!((name.as_str(), source.diffuse, source.dissolve), ("Solid\\", Some([1.0, 0.0, 0.0]), Some(1.0)));
        assert_eq!((source.diffuse_texture.as_deref(), source.shininess), (Some("C:\\tex\\"), Some(3.0)));
        assert_eq!(warnings, Vec::<String>::new());
    }
}
