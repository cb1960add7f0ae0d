//! "Did you mean": the nearest known name to a mistyped one.

/// Most candidates that keep their declared order, as `2x2, 3x3, 5x5`; more are sorted by the alphabet.
const MOST_AS_DECLARED: usize = 12;
/// More candidates, as a scene may have materials, would fill the terminal.
const MOST_LISTED: usize = 120;
/// The number of candidates that are listed if there are more: the most similar ones.
const ALIKE: usize = 20;

/// The Jaro-Winkler similarity, from 0 to 1.
#[cfg(feature = "readers")]
fn likeness(name: &str, candidate: &str) -> f64 {
    strsim::jaro_winkler(&name.to_lowercase().replace('_', "-"), &candidate.to_lowercase().replace('_', "-"))
}

/// Finds no similarity: the measure needs the feature `readers`.
#[cfg(not(feature = "readers"))]
fn likeness(_: &str, _: &str) -> f64 {
    0.0
}

/// The candidate that is most similar to `name`, if it may have been meant: its Jaro-Winkler similarity is at least 0.8 and it contains the same
/// digits, since 8 bits are not 32, however alike their names.
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

/// Returns one line: `unknown tonemap "nuetral": did you mean "neutral"? (neutral, agx, aces, none)`.
pub fn unknown(what: &str, name: &str, candidates: &[&str]) -> String {
    let guess = nearest(name, candidates.iter().copied());
    let question = guess.map(|guess| format!(": did you mean \"{guess}\"?")).unwrap_or_default();
    // Quoted as Rust has it, which keeps a name with a line break on one line.
    format!("unknown {what} {name:?}{question} (possible: {})", listed(name, candidates))
}

/// All candidates, or the most similar ones if there are very many.
fn listed(name: &str, candidates: &[&str]) -> String {
    let mut listed = candidates.to_vec();
    let mut more = String::new();
    if candidates.len() > MOST_LISTED {
        listed.sort_by(|a, b| likeness(name, b).total_cmp(&likeness(name, a)));
        listed.truncate(ALIKE);
        more = format!(" and {} more", candidates.len() - ALIKE);
    }
    if candidates.len() > MOST_AS_DECLARED {
        listed.sort_by_key(|candidate| candidate.to_lowercase());
    }
    listed.join(", ") + &more
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
    }

    #[test]
    fn few_names_are_listed_as_declared_more_by_the_alphabet_and_of_very_many_the_most_alike() {
        assert_eq!(listed("x", &["none", "2x2", "3x3", "pcss"]), "none, 2x2, 3x3, pcss");
        let names = |count: usize| (0..count).rev().map(|number| format!("other{number:03}")).chain(["neutral".into()]);
        let some: Vec<String> = names(20).collect();
        let some: Vec<&str> = some.iter().map(String::as_str).collect();
        let text = listed("nuetral", &some);
        assert!(text.starts_with("neutral, other000, other001, ") && text.ends_with(", other019"), "{text}");
        let many: Vec<String> = names(200).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let text = listed("nuetral", &many);
        assert!(text.starts_with("neutral, ") && text.ends_with(" and 181 more"), "{text}");
    }
}
