//! Counts with their nouns, for everything that is printed.

use std::fmt::Display;

/// A count with its noun, which is given in the singular: `1 light`, `3 lights`.
pub fn counted<T: Display + PartialEq + From<u8>>(count: T, noun: &str) -> String {
    if count == T::from(1) { format!("1 {noun}") } else { format!("{count} {}", plural(noun)) }
}

/// The plural of a noun, or of the last of several words.
pub fn plural(noun: &str) -> String {
    let ends = |ends: &[&str]| ends.iter().any(|end| noun.ends_with(end));
    if let Some(stem) = noun.strip_suffix("ex") {
        format!("{stem}ices")
    } else if let Some(stem) = noun.strip_suffix("y").filter(|_| !ends(&["ay", "ey", "oy", "uy"])) {
        format!("{stem}ies")
    } else if ends(&["s", "x", "sh", "ch"]) {
        format!("{noun}es")
    } else {
        format!("{noun}s")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular_and_all_else_plural() {
        assert_eq!([0, 1, 2].map(|count| counted(count, "light")), ["0 lights", "1 light", "2 lights"]);
        assert_eq!(
            (counted(1_u64, "shadow map"), counted(3_usize, "shadow map")),
            ("1 shadow map".into(), "3 shadow maps".into())
        );
        let nouns = ["mesh", "vertex", "pass", "box", "family", "key", "array", "pixel"];
        let plurals = ["meshes", "vertices", "passes", "boxes", "families", "keys", "arrays", "pixels"];
        assert_eq!(nouns.map(plural), plurals);
    }
}
