//! "Did you mean": the nearest known name to a mistyped one.

/// More candidates would hide the message.
const MOST_LISTED: usize = 20;
/// Candidates that are listed of more.
const ALIKE: usize = 5;

/// From 0 to 1 (Jaro-Winkler).
fn likeness(name: &str, candidate: &str) -> f64 {
    strsim::jaro_winkler(&name.to_lowercase().replace('_', "-"), &candidate.to_lowercase().replace('_', "-"))
}

/// The candidate that is most like `name`, if it is so alike that it may have been meant (Jaro-Winkler 0.8 and up) and has the same numbers in
/// it: 8 bits are not 32, however alike their names.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .filter(|candidate| digits(candidate) == digits(name))
        .map(|candidate| (likeness(name, candidate), candidate))
        .filter(|(score, _)| *score >= 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

fn digits(name: &str) -> String {
    name.chars().filter(char::is_ascii_digit).collect()
}

/// One line: `unknown tonemap "nuetral": did you mean "neutral"? (neutral, agx, aces, none)`.
pub fn unknown(what: &str, name: &str, candidates: &[&str]) -> String {
    let guess = nearest(name, candidates.iter().copied());
    let question = guess.map(|guess| format!(": did you mean \"{guess}\"?")).unwrap_or_default();
    // Quoted as Rust has it, which keeps a name with a line break on one line.
    format!("unknown {what} {name:?}{question} (possible: {})", listed(name, candidates))
}

/// All candidates, or the most alike of many.
fn listed(name: &str, candidates: &[&str]) -> String {
    if candidates.len() <= MOST_LISTED {
        return candidates.join(", ");
    }
    let mut alike = candidates.to_vec();
    alike.sort_by(|a, b| likeness(name, b).total_cmp(&likeness(name, a)));
    alike.truncate(ALIKE);
    format!("{} and {} more", alike.join(", "), candidates.len() - ALIKE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typo_finds_its_name_and_nonsense_finds_none() {
        assert_eq!(nearest("fov_y_degree", ["near", "fov_y_degrees"]), Some("fov_y_degrees"));
        assert_eq!(nearest("zzz", ["near", "target"]), None);
        assert_eq!(nearest("rgba8", ["rgb10a2", "rgba32f"]), None);
        assert_eq!(nearest("rgba8", ["rgb10a2", "rgb8"]), Some("rgb8"));
        assert_eq!(
            unknown("tonemap", "nuetral", &["neutral", "agx"]),
            "unknown tonemap \"nuetral\": did you mean \"neutral\"? (possible: neutral, agx)"
        );
        let many: Vec<String> = (0..20).map(|number| format!("other{number}")).chain(["neutral".into()]).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let text = unknown("tonemap", "nuetral", &many);
        assert!(text.contains("(possible: neutral, ") && text.ends_with(" and 16 more)"), "{text}");
    }
}
