//! The reading of an MTL: keywords in any case, numbers checked while their line is known, then tobj; and the options that
//! stand before a map's name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec2;

use super::scan::check_number;
use super::text;
use crate::scene::Error;

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

/// Returns the definitions of an MTL file, and warnings about unsupported statements.
///
/// # Errors
/// `Error::Read`, and `Error::Content` for a number that is none, not finite or too large.
pub(super) fn read(path: &Path) -> Result<(Vec<Definition>, Vec<String>), Error> {
    parse(path, &text::read(path)?)
}

fn parse(path: &Path, text: &str) -> Result<(Vec<Definition>, Vec<String>), Error> {
    let wrong = |line, what| Error::Content { path: path.to_owned(), line, what };
    let mut clean = String::new();
    let mut found: Vec<(String, HashMap<&'static str, usize>)> = Vec::new();
    let mut unknown: Option<(usize, &str, usize)> = None;
    for (number, line) in text.lines().map(str::trim).enumerate().map(|(i, line)| (i + 1, line)) {
        let (keyword, rest) = text::split_keyword(line);
        if keyword.eq_ignore_ascii_case("newmtl") {
            clean.push_str(&format!("newmtl {}\n", found.len()));
            found.push((rest.to_owned(), HashMap::new()));
            continue;
        }
        let Some((_, lines)) = found.last_mut() else { continue };
        match canonical(keyword) {
            Some("") => {}
            Some(canonical) => {
                let value = value(canonical, rest).map_err(|what| wrong(Some(number), what))?;
                if let Some(value) = value {
                    clean.push_str(&format!("{canonical} {value}\n"));
                    lines.insert(canonical, number);
                }
            }
            None => unknown = Some(unknown.map_or((number, keyword, 0), |(line, first, more)| (line, first, more + 1))),
        }
    }
    let parsed = tobj::load_mtl_buf(&mut clean.as_bytes());
    let (sources, _) = parsed.map_err(|cause| wrong(None, format!("cannot be parsed: {cause}")))?;
    let definitions = found.into_iter().zip(sources);
    let definitions =
        definitions.map(|((name, lines), source)| Definition { name, file: path.to_owned(), source, lines }).collect();
    let warnings = unknown.map(|(line, keyword, more)| {
        let others = if more > 0 { format!(", and {more} more such lines") } else { String::new() };
        format!("{}:{line}: `{keyword}` is not supported and left out{others}", path.display())
    });
    Ok((definitions, warnings.into_iter().collect()))
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
        // Refraction, filters and the choice of a 1990s' light model; the ambient map repeats the diffuse one.
        "" | "ni" | "tf" | "illum" | "sharpness" | "map_ka" | "map_aat" => "",
        comment if comment.starts_with('#') => "",
        _ => return None,
    })
}

/// Returns the text that tobj shall read after the keyword; none where nothing is left.
fn value(keyword: &str, rest: &str) -> Result<Option<String>, String> {
    if keyword.starts_with("map_") || keyword == "bump" || keyword == "norm" {
        check_options(rest)?;
        return Ok(Some(rest.to_owned()).filter(|rest| !rest.is_empty()));
    }
    let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#')).peekable();
    // `d -halo 0.5` fades with the angle; the plain value is the nearest thing.
    words.next_if_eq(&"-halo");
    let numbers: Vec<&str> = words.collect();
    let Some(&first) = numbers.first() else { return Err(format!("`{keyword}` has no value")) };
    if !keyword.starts_with('K') {
        check_number(first)?;
        return Ok(Some(first.to_owned()));
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
    channels.iter().try_for_each(|channel| check_number(channel))?;
    Ok(Some(channels.join(" ")))
}

/// Checks the numbers of a map's options. A word that is no number, or the last one, is the map's name.
fn check_options(text: &str) -> Result<(), String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    for (index, option) in words.iter().enumerate() {
        let most = match *option {
            "-s" | "-o" | "-t" => 3,
            "-bm" => 1,
            _ => 0,
        };
        let last = words.len() - 1;
        let numbers = words[(index + 1).min(last)..last].iter().take(most);
        numbers.take_while(|word| word.parse::<f64>().is_ok()).try_for_each(|word| check_number(word))?;
    }
    Ok(())
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
            ignored: Vec::new(),
        };
        let mut rest = value.trim();
        while let Some(after) = map.option(rest) {
            rest = after;
        }
        map.name = rest.to_owned();
        map
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
        let (numbers, after_numbers) = leading_numbers(rest, most_numbers);
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
            "-mm" => ignore_unless(numbers == [0.0, 1.0]),
            "-boost" => ignore_unless(numbers == [0.0]),
            "-texres" => {}
            "-blendu" | "-blendv" => ignore_unless(word == "on"),
            "-cc" | "-clamp" => ignore_unless(word == "off"),
            "-imfchan" => self.channel = word.chars().next(),
            // A name may begin with a dash.
            _ => return None,
        }
        let after = if most_numbers > 0 { after_numbers } else { after_word };
        (!after.is_empty()).then_some(after)
    }
}

/// Returns up to `most` numbers at the front, and the rest of the text. The last word is never taken: it is the name.
fn leading_numbers(text: &str, most: usize) -> (Vec<f64>, &str) {
    let (mut numbers, mut rest) = (Vec::new(), text);
    while numbers.len() < most {
        let (word, after) = text::split_keyword(rest);
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() && !after.is_empty() => numbers.push(number),
            _ => break,
        }
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
        assert_eq!((map.channel, map.ignored), (Some('r'), vec!["-clamp on".to_owned()]));
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
        assert_eq!(warnings, ["m.mtl:8: `foo` is not supported and left out, and 1 more such lines"]);
    }

    #[test]
    fn wrong_numbers_are_refused_with_their_line() {
        for (text, expected) in [
            ("newmtl a\nKd 1 nan 1", "m.mtl:2: `nan` is not a finite number"),
            ("newmtl a\nmap_Kd -s 1 nan 1 a.png", "m.mtl:2: `nan` is not a finite number"),
            ("newmtl a\nmap_Kd -o inf a.png", "m.mtl:2: `inf` is not a finite number"),
            ("newmtl a\n\nmap_Bump -bm 1e39 a.png", "m.mtl:3: 1e39 is out of range: at most 1e15"),
            ("newmtl a\n\nNs 1e39", "m.mtl:3: 1e39 is out of range: at most 1e15"),
            ("newmtl a\nKd 1 2", "m.mtl:2: `Kd` has 2 numbers instead of 3"),
            ("newmtl a\nd", "m.mtl:2: `d` has no value"),
            ("newmtl a\nd x", "m.mtl:2: `x` is not a number"),
        ] {
            assert_eq!(parse(Path::new("m.mtl"), text).unwrap_err().to_string(), expected);
        }
    }
}
