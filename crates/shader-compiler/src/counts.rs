//! The number of variants of a shader, and how many of them have each flag. A line in the shader's head states both, and a build compares it with the
//! compiled variants, so a flag that doubles a shader is noticed.

use std::fmt::Write as _;

use crate::shader::CompiledShader;

/// Counts the variants, as the line `// counts:` states them: `6; with LIGHTS 4, MSAA 3`. The number after a flag counts the variants that have it.
#[must_use]
pub fn count_variants(shader: &CompiledShader) -> String {
    let mut counts = shader.variants.len().to_string();
    for (bit, flag) in shader.flags.iter().enumerate() {
        let with = shader.variants.iter().filter(|variant| variant.bits & (1 << bit) != 0).count();
        let before = if bit == 0 { "; with" } else { "," };
        // Writing to a string cannot fail.
        let _ = write!(counts, "{before} {flag} {with}");
    }
    counts
}

/// Lists the numbers that a shader's file states wrongly, each with the right one: `226 -> 452; MSAA 108 -> 216`.
#[must_use]
pub fn variants_growth(shader: &CompiledShader) -> Option<String> {
    let (before, after) = (shader.counts.as_deref().unwrap_or(""), count_variants(shader));
    Some(changes(before, &after)).filter(|changes| !changes.is_empty())
}

fn changes(before: &str, after: &str) -> String {
    let (before, after) = (entries(before), entries(after));
    let count = |counts: &[(&str, &str)], name: &str| {
        counts
            .iter()
            .find(|(known, _)| *known == name)
            .map_or_else(|| "none".to_owned(), |(_, count)| (*count).to_owned())
    };
    let gone = before.iter().filter(|(name, _)| !after.iter().any(|(known, _)| known == name));
    let names = after.iter().chain(gone).map(|(name, _)| *name);
    let changes = names.map(|name| (name, count(&before, name), count(&after, name)));
    let changes = changes.filter(|(_, old, new)| old != new);
    changes
        .map(|(name, old, new)| format!("{name} {old} -> {new}").trim_start().to_owned())
        .collect::<Vec<_>>()
        .join("; ")
}

/// The flags with their numbers; the number of all has an empty name.
fn entries(counts: &str) -> Vec<(&str, &str)> {
    let (all, flags) = counts.split_once("; with ").unwrap_or((counts, ""));
    let all = (!all.is_empty()).then_some(("", all));
    all.into_iter().chain(flags.split(", ").filter_map(|flag| flag.split_once(' '))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile_source;

    #[test]
    fn growth_names_the_flags_that_have_changed() {
        assert_eq!(
            changes("2; with HDR 1, OLD 1", "4; with HDR 2, NEW 2"),
            "2 -> 4; HDR 1 -> 2; NEW none -> 2; OLD 1 -> none"
        );
        assert_eq!(changes("", "1"), "none -> 1");
    }

    #[test]
    fn a_file_that_states_its_numbers_has_no_growth() {
        let growth = |head: &str| {
            let text = format!("{head}\n@compute @workgroup_size(1)\nfn main() {{}}\n");
            let shader = compile_source(("demo.wgsl", &text), &[]).unwrap_or_else(|errors| panic!("{}", errors[0]));
            variants_growth(&shader)
        };
        assert_eq!(growth("// variants: A B\n// requires: B -> A\n// counts: 3; with A 2, B 1"), None);
        assert_eq!(growth("// counts: 1"), None);
        assert_eq!(growth("// variants: A\n// counts: 1"), Some("1 -> 2; A none -> 1".to_owned()));
        assert_eq!(growth(""), Some("none -> 1".to_owned()));
        // Written otherwise, with the same numbers.
        assert_eq!(growth("// variants: A\n// counts: 2, with A 1"), Some("2, with A 1 -> 2; A none -> 1".to_owned()));
    }
}
