//! JSON that deviates from the schema. A property that is `null` counts as absent, without a warning, wherever it is. A property of the wrong type is
//! read by its meaning if that is clear ("0.5" for 0.5). Otherwise it alone is left out, with a warning that names it, and the rest of the file is
//! read. [`document`] applies the rule once to the whole text, so no reader repeats it.
//!
//! Every property of [`json`](super::json) is optional, so an object is valid exactly when each of its properties is valid by itself. Deviations are
//! found that way, at any depth, without a list of all properties.

use serde::Deserialize;
use serde_json::{Map, Value};

use super::json::Document;

/// Lists of numbers and names from which one entry can be left out by itself. Entries of all other lists are referred to by their index.
const LISTS: &[&str] = &["children", "nodes", "variants", "extensionsUsed", "extensionsRequired"];

/// A document, and warnings about its oddities.
pub(super) type Mended = (Document, Vec<String>);

/// Reads the text of a file.
///
/// # Errors
/// The first fault of a text that is not JSON, or whose JSON is not an object.
pub(super) fn document(text: &[u8]) -> Result<Mended, serde_json::Error> {
    // Nearly all files are valid, and are read directly.
    let fault = match serde_json::from_slice(text) {
        Ok(document) => return Ok((document, Vec::new())),
        Err(fault) => fault,
    };
    let mut warnings = Vec::new();
    let Some(Value::Object(mut root)) = value(text, &mut warnings) else { return Err(fault) };
    root.values_mut().for_each(drop_nulls);
    root.retain(|_, value| !value.is_null());
    let mut value = Value::Object(root);
    let fits = |value: &Value| Document::deserialize(value).map(drop).map_err(|error| error.to_string());
    mend(&mut value, &ValuePath { path: String::new(), key: "" }, &fits, &mut warnings);
    let document = Document::deserialize(&value)?;
    Ok((document, warnings))
}

/// The first value of a text. If JSON refuses the text, its spelling is repaired.
fn value(text: &[u8], warnings: &mut Vec<String>) -> Option<Value> {
    let mut first = |text: &[u8]| {
        let mut values = serde_json::Deserializer::from_slice(text).into_iter::<Value>();
        let value = values.next()?.ok()?;
        let rest = text[values.byte_offset()..].trim_ascii();
        if !rest.is_empty() {
            warnings.push(format!("{} bytes behind its JSON are left out", rest.len()));
        }
        Some(value)
    };
    if let Some(value) = first(text) {
        return Some(value);
    }
    let (text, changes) = respelled(text);
    let value = first(text.as_bytes())?;
    warnings.push(format!("its JSON is odd: {}", changes.join("; ")));
    Some(value)
}

/// Repairs deviations that some writers produce. `NaN` and infinities (Python) become null. Commas before a closing bracket are dropped. Line breaks
/// and other control characters in names, bytes that are not UTF-8 (names of old systems) and halves of surrogate pairs are replaced.
fn respelled(bytes: &[u8]) -> (String, Vec<&'static str>) {
    let mut changes = Vec::new();
    let text = String::from_utf8_lossy(bytes);
    if matches!(text, std::borrow::Cow::Owned(_)) {
        changes.push("some of its names are no UTF-8");
    }
    let mut out = String::with_capacity(text.len());
    let mut rest = text.as_ref();
    let mut note = |change| {
        if !changes.contains(&change) {
            changes.push(change);
        }
    };
    while let Some(next) = rest.chars().next() {
        let used = match next {
            '"' => string(rest, &mut out, &mut note),
            ',' if rest[1..].trim_start().starts_with([']', '}']) => {
                note("commas before a closing bracket");
                1
            }
            '-' | '+' | '.' | '0'..='9' | 'a'..='z' | 'A'..='Z' => word(rest, &mut out, &mut note),
            other => {
                out.push(other);
                other.len_utf8()
            }
        };
        rest = &rest[used..];
    }
    (out, changes)
}

/// Copies a string; returns its length in bytes, its quotes included.
fn string(text: &str, out: &mut String, note: &mut impl FnMut(&'static str)) -> usize {
    out.push('"');
    let mut rest = &text[1..];
    while let Some(next) = rest.chars().next() {
        let mut used = next.len_utf8();
        match next {
            '"' => {
                out.push('"');
                return text.len() - rest.len() + 1;
            }
            '\\' => {
                let is_whole = |own: &&str| serde_json::from_str::<String>(&format!("\"{own}\"")).is_ok();
                let single = rest.get(..6).filter(|own| own.starts_with("\\u"));
                let pair = rest.get(..12).filter(|own| own[1..].contains("\\u")).filter(is_whole);
                used = rest.chars().take(2).map(char::len_utf8).sum();
                match (single, pair) {
                    (Some(single), Some(pair)) if !is_whole(&single) => {
                        used = 12;
                        out.push_str(pair);
                    }
                    (Some(own), _) => {
                        used = 6;
                        out.push_str(if is_whole(&own) { own } else { "\\ufffd" });
                        if !is_whole(&own) {
                            note("halves of surrogate pairs");
                        }
                    }
                    _ if rest[1..].starts_with(['"', '\\', '/', 'b', 'f', 'n', 'r', 't']) => {
                        out.push_str(&rest[..used]);
                    }
                    _ => {
                        note("backslashes within names that escape nothing");
                        used = 1;
                        out.push_str("\\\\");
                    }
                }
            }
            '\0'..='\x1f' => {
                note("control characters within names");
                out.push(' ');
            }
            other => out.push(other),
        }
        rest = &rest[used..];
    }
    text.len()
}

/// Copies a number or a word; returns its length in bytes.
fn word(text: &str, out: &mut String, note: &mut impl FnMut(&'static str)) -> usize {
    let is_of_word = |next: char| next.is_ascii_alphanumeric() || "+-._#".contains(next);
    let length = text.find(|next| !is_of_word(next)).unwrap_or(text.len());
    let own = &text[..length];
    let bare = own.trim_start_matches(['+', '-']).to_ascii_lowercase();
    let is_infinite = bare.starts_with("nan") || bare.starts_with("inf") || bare.starts_with("1.#");
    let overflows =
        || bare.starts_with(|first: char| first.is_ascii_digit()) && own.parse().is_ok_and(f64::is_infinite);
    if is_infinite || overflows() {
        note("numbers that are not finite, taken as absent");
        out.push_str("null");
    } else {
        out.push_str(own);
    }
    length
}

/// Drops each property of an object that is null, at any depth.
fn drop_nulls(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|_, value| !value.is_null());
            map.values_mut().for_each(drop_nulls);
        }
        Value::Array(list) => list.iter_mut().for_each(drop_nulls),
        _ => {}
    }
}

/// The place of a value in the file.
struct ValuePath<'a> {
    path: String,
    /// The name of the property, or of the list that the value is an entry of.
    key: &'a str,
}

/// Makes a value valid, as far as possible. `fits` puts a value in its place in an otherwise empty document. Returns false if only leaving it out
/// would be valid.
fn mend(
    value: &mut Value,
    place: &ValuePath,
    fits: &dyn Fn(&Value) -> Result<(), String>,
    warnings: &mut Vec<String>,
) -> bool {
    if fits(value).is_ok() {
        return true;
    }
    match value {
        Value::Object(map) if fits(&Value::Object(Map::new())).is_ok() => {
            let keys: Vec<String> = map.keys().cloned().collect();
            for key in keys {
                let Some(own) = map.get_mut(&key) else { continue };
                let within = |value: &Value| fits(&Value::Object([(key.clone(), value.clone())].into_iter().collect()));
                let path = if place.path.is_empty() { key.clone() } else { format!("{}.{key}", place.path) };
                let before = within(own).err();
                if !mend(own, &ValuePath { path: path.clone(), key: &key }, &within, warnings) {
                    warnings.push(left_out(&path, own, &before.unwrap_or_default()));
                    map.remove(&key);
                }
            }
            without_rivals(value, place, fits, warnings)
        }
        Value::Array(list) if fits(&Value::Array(Vec::new())).is_ok() => {
            let within = |value: &Value| fits(&Value::Array(vec![value.clone()]));
            let mut kept = Vec::with_capacity(list.len());
            for (index, mut own) in list.iter().cloned().enumerate() {
                let path = format!("{}[{index}]", place.path);
                let before = within(&own).err();
                if mend(&mut own, &ValuePath { path: path.clone(), key: place.key }, &within, warnings) {
                    kept.push(own);
                    continue;
                }
                let empty = Value::Object(Map::new());
                if within(&empty).is_ok() {
                    // Entries after it keep their indices.
                    kept.push(empty);
                } else if !LISTS.contains(&place.key) {
                    return false;
                }
                if !own.is_null() {
                    warnings.push(left_out(&path, &own, &before.unwrap_or_default()));
                }
            }
            *list = kept;
            fits(value).is_ok()
        }
        _ => match reread(value, place.key).into_iter().find(|other| fits(other).is_ok()) {
            Some(other) => {
                warnings.push(format!("{} is {}, read as {}", place.path, shown(value), shown(&other)));
                *value = other;
                true
            }
            None => false,
        },
    }
}

/// Drops properties that are valid alone but not together, as two names of one extension, last first.
fn without_rivals(
    value: &mut Value,
    place: &ValuePath,
    fits: &dyn Fn(&Value) -> Result<(), String>,
    warnings: &mut Vec<String>,
) -> bool {
    while let Err(why) = fits(value) {
        let Value::Object(map) = value else { return false };
        let Some(key) = map.keys().next_back().cloned() else { return false };
        map.remove(&key);
        warnings.push(format!("{}.{key} goes with no other property there ({why}): left out", place.path));
    }
    true
}

/// Other readings of a value. A colour with a superfluous alpha loses it, and a colour without one gets 1.
fn reread(value: &Value, key: &str) -> Vec<Value> {
    let number = |text: &str| serde_json::from_str::<serde_json::Number>(text.trim()).ok().map(Value::Number);
    match value {
        Value::String(text) => {
            let truth = match text.trim().to_ascii_lowercase().as_str() {
                "true" => Some(Value::Bool(true)),
                "false" => Some(Value::Bool(false)),
                _ => None,
            };
            number(text).into_iter().chain(truth).collect()
        }
        Value::Number(own) => match own.as_f64() {
            Some(0.0) => vec![Value::Bool(false), Value::String(own.to_string())],
            Some(1.0) => vec![Value::Bool(true), Value::String(own.to_string())],
            _ => vec![Value::String(own.to_string())],
        },
        // Numbers as strings in a list of fixed length.
        Value::Array(list) if list.iter().all(|own| own.is_string() || own.is_number()) => {
            let numbers: Option<Vec<Value>> = list
                .iter()
                .map(|own| if let Value::String(text) = own { number(text) } else { Some(own.clone()) })
                .collect();
            let as_color = |numbers: &Vec<Value>| match (numbers.len(), key.ends_with("Factor")) {
                (3, true) => Some([&numbers[..], &[Value::from(1.0)]].concat()),
                (4, true) => Some(numbers[..3].to_vec()),
                _ => None,
            };
            let color = numbers.as_ref().and_then(as_color);
            numbers.into_iter().chain(color).map(Value::Array).collect()
        }
        _ => Vec::new(),
    }
}

fn left_out(path: &str, value: &Value, why: &str) -> String {
    let why = why.replace(['\n', '\r'], " ");
    let expected = why.split_once(", expected ").map_or(why.as_str(), |(_, expected)| expected);
    let expected = match expected.split(" at line ").next().unwrap_or(expected) {
        "f64" => "a number",
        "a sequence" => "a list",
        own if own.starts_with("struct ") || own == "a map" => "an object",
        own => own,
    };
    format!("{path} is {}, not {expected}: left out", shown(value))
}

/// A value in a message, of one line.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(_) => "an object".into(),
        Value::Array(list) => {
            let text = value.to_string();
            if text.len() <= 60 { text } else { format!("a list of {}", list.len()) }
        }
        other => {
            let text = other.to_string();
            if text.chars().count() <= 60 { text } else { text.chars().take(57).collect::<String>() + "..." }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Mended {
        document(text.as_bytes()).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn null_is_absence_wherever_it_stands() {
        for text in [
            r#"{"nodes":null,"asset":null,"extensions":null,"scene":null}"#,
            r#"{"nodes":[{"children":null,"matrix":null,"extensions":null,"mesh":null,"name":null,"weights":null}]}"#,
            r#"{"meshes":[{"primitives":[{"mode":null,"targets":null,"attributes":{"NORMAL":null},"extensions":null}]}]}"#,
            r#"{"accessors":[{"count":null,"normalized":null,"type":null,"componentType":null,"sparse":{"count":null}}]}"#,
            r#"{"materials":[{"doubleSided":null,"emissiveFactor":null,"pbrMetallicRoughness":null,"normalTexture":{"index":null}}]}"#,
            r#"{"extensions":{"KHR_lights_punctual":{"lights":[{"type":null,"color":null,"spot":null}]}}}"#,
            r#"{"nodes":[null,{}],"meshes":[null],"animations":[{"channels":[null]}]}"#,
        ] {
            let (document, warnings) = read(text);
            assert_eq!(warnings, Vec::<String>::new(), "{text}");
            assert!(document.nodes.iter().all(|node| node.children.is_empty() && node.matrix.is_none()));
        }
        assert_eq!(read(r#"{"nodes":[null,{"name":"b"}]}"#).0.nodes[1].name.as_deref(), Some("b"));
    }

    #[test]
    fn an_odd_property_is_left_out_alone_and_by_its_place() {
        for (text, words) in [
            (r#"{"nodes":[{"name":"a"},{"mesh":-1}]}"#, "nodes[1].mesh is -1, not a whole number that is not negative"),
            (r#"{"nodes":[{"name":"a","children":[1,-1]}]}"#, "nodes[0].children[1] is -1, not"),
            (
                r#"{"nodes":[{"name":"a","translation":[null,0,0]}]}"#,
                "nodes[0].translation is [null,0,0], not a number",
            ),
            (r#"{"nodes":[{"name":"a","scale":[1,1]}]}"#, "nodes[0].scale is [1,1], not an array of length 3"),
            (r#"{"nodes":[{"name":"a","extensions":7}]}"#, "nodes[0].extensions is 7, not an object: left out"),
            (r#"{"nodes":[{"name":"a"},5]}"#, "nodes[1] is 5, not"),
            (r#"{"nodes":[{"name":"a"}],"meshes":{"x":1}}"#, "meshes is an object, not a list"),
            (r#"{"nodes":[{"name":"a"}],"skins":[{"joints":[0,"x"]}]}"#, r#"skins[0].joints is [0,"x"], not"#),
        ] {
            let (document, warnings) = read(text);
            assert!(warnings.len() == 1 && warnings[0].contains(words), "{text}: {warnings:?}");
            assert_eq!(document.nodes[0].name.as_deref(), Some("a"), "{text}");
        }
        let (document, _) = read(r#"{"nodes":[{"children":[1,-1,2]}]}"#);
        assert_eq!(document.nodes[0].children.iter().map(|own| own.0).collect::<Vec<_>>(), [1, 2]);
    }

    #[test]
    fn values_whose_meaning_is_clear_are_read_by_it() {
        let text = r#"{"asset":{"version":2.0},"nodes":[{"mesh":"3","scale":["1","2",3]}],"materials":[{"doubleSided":1,
            "alphaCutoff":"0.25"},{"doubleSided":"true"}]}"#;
        let (document, warnings) = read(text);
        assert_eq!(document.asset.map(|asset| asset.version), Some("2.0".to_owned()));
        assert_eq!(
            (document.nodes[0].mesh.map(|own| own.0), document.nodes[0].scale),
            (Some(3), Some([1.0, 2.0, 3.0]))
        );
        assert_eq!(document.materials[0].alpha_cutoff, Some(0.25));
        assert!(document.materials.iter().all(|own| own.double_sided));
        assert_eq!(warnings.len(), 6, "{warnings:?}");
        assert!(warnings.contains(&r#"nodes[0].mesh is "3", read as 3"#.to_owned()), "{warnings:?}");
    }

    #[test]
    fn spelling_that_other_parsers_take_is_mended() {
        for (text, words) in [
            (&br#"{"nodes":[{"name":"a","translation":[NaN,0,-Infinity]}]}"#[..], "not finite"),
            (br#"{"nodes":[{"name":"a","translation":[1e999,0,0]}]}"#, "not finite"),
            (br#"{"nodes":[{"name":"a",},],}"#, "commas before a closing bracket"),
            (b"{\"nodes\":[{\"name\":\"a\"},{\"name\":\"b\tc\n\"}]}", "control characters"),
            (b"{\"nodes\":[{\"name\":\"a\"},{\"name\":\"\xfc\"}]}", "no UTF-8"),
            (br#"{"nodes":[{"name":"a"},{"name":"\ud83d\ude00 \ud83d"}]}"#, "halves of surrogate pairs"),
            (br#"{"nodes":[{"name":"a"},{"name":"C:\x \" \\"}]}"#, "escape nothing"),
            (br#"{"nodes":[{"name":"a"}]} xx"#, "2 bytes behind its JSON"),
        ] {
            let (document, warnings) = document(text).unwrap_or_else(|error| panic!("{words}: {error}"));
            assert!(warnings.iter().any(|own| own.contains(words)), "{words}: {warnings:?}");
            assert_eq!(document.nodes[0].name.as_deref(), Some("a"), "{words}");
        }
        let (document, _) = document(br#"{"nodes":[{"name":"\ud83d\ude00 \u00fc \ud83d,"},]}"#).unwrap();
        assert_eq!(document.nodes[0].name.as_deref(), Some("\u{1f600} \u{fc} \u{fffd},"));
    }

    #[test]
    fn what_is_no_json_is_told_where() {
        for text in ["", "7", "{", "{\"nodes\":[", "\u{0}\u{1}", "{\"a\":\"b", "{\"a\":\\", "{\"\\u12", "<html>"] {
            assert!(document(text.as_bytes()).is_err(), "{text}");
        }
    }
}
