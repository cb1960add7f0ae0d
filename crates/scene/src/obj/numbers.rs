//! Numbers in the spellings of exporters, and counts of lines that are left out.

use std::borrow::Cow;

/// Largest magnitude of any number: f64 still tells an eighth of a metre apart there, and squares stay finite in f32.
const LARGEST: f64 = 1e15;

/// A word as Rust parses it: with a point for a decimal comma, and `e` for the `d` before a Fortran program's exponent.
///
/// # Errors
/// What is wrong with a word that is no number, not finite or too large.
pub(super) fn number(word: &str) -> Result<Cow<'_, str>, String> {
    if let Ok(number) = word.parse() {
        return checked(word, number).map(|()| Cow::Borrowed(word));
    }
    let has_one_comma = word.matches(',').count() == 1 && !word.contains('.');
    let mut own = if has_one_comma { word.replace(',', ".") } else { word.to_owned() };
    if own.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
        own = own.replace(['d', 'D'], "e");
    }
    let number = own.parse().map_err(|_| format!("`{word}` is not a number"))?;
    checked(word, number).map(|()| Cow::Owned(own))
}

fn checked(word: &str, number: f64) -> Result<(), String> {
    if !number.is_finite() {
        return Err(format!("`{word}` is not a finite number"));
    }
    if number.abs() > LARGEST {
        return Err(format!("{word} is out of range: at most {LARGEST:e}"));
    }
    Ok(())
}

/// An index of a corner, counted from 1, where `count` elements have been defined so far.
pub(super) fn index(part: &str, word: &str, count: usize) -> Result<usize, String> {
    let index: i64 = part.parse().map_err(|_| format!("`{part}` is not an index"))?;
    match index {
        0 => Err(format!("index 0 in `{word}`: OBJ counts from 1")),
        1.. => Ok(usize::try_from(index).unwrap_or(usize::MAX)),
        _ => usize::try_from(index.unsigned_abs())
            .ok()
            .and_then(|back| (count + 1).checked_sub(back))
            .filter(|&index| index > 0)
            .ok_or_else(|| format!("index {index} is out of range: {count} have been defined so far")),
    }
}

/// Lines of one kind that something is wrong with: the first, and their number.
#[derive(Debug, Default)]
pub(super) struct Odd {
    pub first: Option<(usize, String)>,
    pub count: usize,
}

impl Odd {
    pub fn add(&mut self, line: usize, what: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(|| (line, what()));
    }

    /// A warning that names the first line and its consequence, and counts the other lines.
    pub fn warning(&self, consequence: &str, others: &str) -> Option<String> {
        let (line, what) = self.first.as_ref()?;
        let more = match self.count - 1 {
            0 => String::new(),
            count => format!(", and {count} more such {others}"),
        };
        Some(format!("line {line}: {what}; {consequence}{more}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_other_countries_and_languages_are_read() {
        for (word, expected) in [
            ("-1.5", "-1.5"),
            ("0,25", "0.25"),
            ("1,", "1."),
            ("1.5D+02", "1.5e+02"),
            ("-1d0", "-1e0"),
            ("1e-400", "1e-400"),
        ] {
            assert_eq!(number(word).as_deref(), Ok(expected));
        }
        for word in
            ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND00", "inf", "1e400", "1e16", "1,000.5", "1,2,3", "x", "d", ""]
        {
            assert!(number(word).is_err(), "{word}");
        }
    }
}
