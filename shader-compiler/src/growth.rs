//! The number of variants of each shader, and the number that each of its flags adds: a table to keep beside the shaders and to compare with the next
//! build.

use std::fmt::Write as _;

use crate::shader::Shader;

/// A line for each shader, and below it one for each flag: the number of variants that would not exist without it.
#[must_use]
pub fn variants_table(shaders: &[Shader]) -> String {
    let mut table = String::new();
    for shader in shaders {
        // Writing to a string cannot fail.
        let _ = writeln!(table, "{}: {} variants", shader.name, shader.variants.len());
        for (bit, flag) in shader.flags.iter().enumerate() {
            let with = shader.variants.iter().filter(|variant| variant.bits & (1 << bit) != 0).count();
            let _ = writeln!(table, "    {flag} adds {with}");
        }
    }
    table
}

/// Lists the differences of two tables, a line each: `lighting: 226 variants -> 452 variants`, `lighting MSAA: adds 108 -> adds 216`.
#[must_use]
pub fn variants_growth(before: &str, after: &str) -> Vec<String> {
    let (before, after) = (entries(before), entries(after));
    let count = |table: &[(String, String)], name: &str| {
        table.iter().find(|(known, _)| known == name).map_or_else(|| "none".to_owned(), |(_, count)| count.clone())
    };
    let gone = before.iter().filter(|(name, _)| !after.iter().any(|(known, _)| known == name));
    let names = after.iter().chain(gone).map(|(name, _)| name);
    let changes = names.map(|name| (name, count(&before, name), count(&after, name)));
    changes.filter(|(_, old, new)| old != new).map(|(name, old, new)| format!("{name}: {old} -> {new}")).collect()
}

/// The name of each line, a flag's with its shader's before it, and its count.
fn entries(table: &str) -> Vec<(String, String)> {
    let mut entries = Vec::new();
    let mut shader = "";
    for line in table.lines() {
        if let Some((flag, count)) = line.strip_prefix("    ").and_then(|line| line.split_once(' ')) {
            entries.push((format!("{shader} {flag}"), count.to_owned()));
        } else if let Some((name, count)) = line.split_once(": ") {
            shader = name;
            entries.push((name.to_owned(), count.to_owned()));
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_names_shaders_and_flags_that_have_changed() {
        let before = "fxaa: 2 variants\n    HDR adds 1\nview: 3 variants\n";
        let after = "fxaa: 4 variants\n    HDR adds 2\n    NEW adds 2\n";
        assert_eq!(
            variants_growth(before, after),
            [
                "fxaa: 2 variants -> 4 variants",
                "fxaa HDR: adds 1 -> adds 2",
                "fxaa NEW: none -> adds 2",
                "view: 3 variants -> none"
            ]
        );
        assert!(variants_growth(after, after).is_empty());
    }
}
