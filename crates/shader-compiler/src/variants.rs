//! The comment lines in a shader's head that define its variants.
//!
//! ```wgsl
//! // variants: TEXTURED NORMAL_MAP MASKED     each flag on or off: all combinations ...
//! // requires: NORMAL_MAP -> TEXTURED         ... but those with the first and without the second,
//! // excludes: NORMAL_MAP MASKED              ... and those with more than one of these.
//! // always: LIGHTS                          on in every variant and no flag of it: for code that is shared,
//! // precise                                  no contraction of arithmetic (see `patch`)
//! // counts: 5; with TEXTURED 4, NORMAL_MAP 2  the number of variants, and of those that have each flag (see `counts`)
//! ```

use crate::error::{Error, SourceSpan};

/// More flags or combinations than this in one shader are a mistake rather than a wish.
const MOST_FLAGS: usize = 16;
const MOST_VARIANTS: usize = 1024;

/// The content of a shader's head.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Head {
    /// The flags; bit `i` of a variant's number is flag `i`.
    pub flags: Vec<String>,
    /// A variant with the first bits must have the second.
    requires: Vec<(u32, Vec<u32>)>,
    /// A variant may have at most one of these bits.
    excludes: Vec<u32>,
    /// Flags that are on in every variant and have no bit.
    always: Vec<String>,
    /// True if floating-point arithmetic is decorated NoContraction.
    pub precise: bool,
    /// The numbers of variants that the file states.
    pub counts: Option<String>,
}

impl Head {
    /// Reads the head of `text`, the content of `file`: all lines before the first that is neither blank, comment nor directive.
    ///
    /// # Errors
    /// An unknown, repeated or ill-formed flag; a malformed line; too many combinations; a `variants:` line below the head.
    pub fn parse(file: &str, text: &str) -> Result<Self, Error> {
        let mut head = Self::default();
        let mut in_head = true;
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let at = SourceSpan::of(file, text, start + line.len() - line.trim_start().len(), line.trim().len());
            start += line.len();
            let line = line.trim();
            match line.strip_prefix("//").map(str::trim) {
                Some(comment) if in_head => head.line(comment, &at)?,
                Some(comment) if comment.starts_with("variants:") => {
                    return Err(Error::at(
                        at,
                        "`variants:` must stand in the shader's head, before its first declaration",
                    ));
                }
                Some(_) => {}
                None => in_head &= line.is_empty() || line.starts_with('#'),
            }
        }
        if head.combinations().len() > MOST_VARIANTS {
            let message =
                format!("more than {MOST_VARIANTS} variants: use fewer flags, or `requires:` and `excludes:`");
            return Err(Error::in_file(file, message));
        }
        Ok(head)
    }

    fn line(&mut self, comment: &str, at: &SourceSpan) -> Result<(), Error> {
        if let Some(names) = comment.strip_prefix("variants:") {
            for name in words(names) {
                self.add_flag(name, at)?;
            }
        } else if let Some(names) = comment.strip_prefix("always:") {
            for name in words(names) {
                check_name(name, at)?;
                self.always.push(name.to_owned());
            }
        } else if let Some(rule) = comment.strip_prefix("requires:") {
            let (from, to) = rule
                .split_once("->")
                .ok_or_else(|| Error::at(at.clone(), "`requires:` is written `requires: FLAG -> FLAG`"))?;
            let any = to.split('|').map(|names| self.bits(names, at)).collect::<Result<_, _>>()?;
            self.requires.push((self.bits(from, at)?, any));
        } else if let Some(names) = comment.strip_prefix("excludes:") {
            let bits = self.bits(names, at)?;
            if bits.count_ones() < 2 {
                return Err(Error::at(at.clone(), "`excludes:` needs two flags or more"));
            }
            self.excludes.push(bits);
        } else if comment == "precise" {
            self.precise = true;
        } else if let Some(numbers) = comment.strip_prefix("counts:")
            && self.counts.replace(numbers.trim().to_owned()).is_some()
        {
            return Err(Error::at(at.clone(), "`counts:` stands here twice"));
        }
        Ok(())
    }

    fn add_flag(&mut self, name: &str, at: &SourceSpan) -> Result<(), Error> {
        check_name(name, at)?;
        if self.flags.iter().any(|flag| flag == name) {
            return Err(Error::at(at.clone(), format!("the flag {name} is declared twice")));
        }
        if self.flags.len() == MOST_FLAGS {
            return Err(Error::at(at.clone(), format!("more than {MOST_FLAGS} flags")));
        }
        self.flags.push(name.to_owned());
        Ok(())
    }

    fn bits(&self, names: &str, at: &SourceSpan) -> Result<u32, Error> {
        let mut bits = 0;
        for name in words(names) {
            let index = self.flags.iter().position(|flag| flag == name);
            let index = index
                .ok_or_else(|| Error::at(at.clone(), format!("no `variants:` line above declares the flag {name}")))?;
            bits |= 1 << index;
        }
        if bits == 0 { Err(Error::at(at.clone(), "a flag is missing here")) } else { Ok(bits) }
    }

    /// Every combination that the rules allow, ascending.
    #[must_use]
    pub fn combinations(&self) -> Vec<u32> {
        let allowed = |bits: &u32| {
            self.requires.iter().all(|(from, any)| bits & from != *from || any.iter().any(|to| bits & to == *to))
                && self.excludes.iter().all(|group| (bits & group).count_ones() <= 1)
        };
        (0..1_u32 << self.flags.len()).filter(allowed).collect()
    }

    /// The names of the flags that are on in `bits`.
    pub fn names(&self, bits: u32) -> impl Iterator<Item = &str> {
        let on = self.flags.iter().enumerate().filter(move |(index, _)| bits & (1 << index) != 0);
        self.always.iter().map(String::as_str).chain(on.map(|(_, name)| name.as_str()))
    }
}

fn check_name(name: &str, at: &SourceSpan) -> Result<(), Error> {
    let upper = |c: char| c.is_ascii_uppercase() || c == '_' || c.is_ascii_digit();
    if !name.starts_with(|c: char| c.is_ascii_uppercase()) || !name.chars().all(upper) || name == "NONE" {
        return Err(Error::at(
            at.clone(),
            format!("`{name}` is no name for a flag: it is written IN_CAPITALS, and NONE is taken"),
        ));
    }
    Ok(())
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split([' ', '\t', ',']).filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_combinations_but_the_forbidden() {
        let head =
            Head::parse("a.wgsl", "// variants: A B C\n// requires: B -> A\n// excludes: B C\n\nstruct S {}").unwrap();
        assert_eq!(head.combinations(), [0b000, 0b001, 0b011, 0b100, 0b101]);
        assert_eq!(head.names(0b011).collect::<Vec<_>>(), ["A", "B"]);
        assert!(!head.precise);
    }

    #[test]
    fn a_flag_may_require_one_of_several() {
        let head = Head::parse("a.wgsl", "// variants: A B C\n// requires: C -> A | B\n").unwrap();
        assert_eq!(head.combinations(), [0b000, 0b001, 0b010, 0b011, 0b101, 0b110, 0b111]);
    }

    #[test]
    fn no_line_means_one_variant() {
        let head = Head::parse("a.wgsl", "// precise\n#define_import_path a\nfn f() {}\n").unwrap();
        assert_eq!(head.combinations(), [0]);
        assert!(head.precise);
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let fails = |text: &str, message: &str, line: usize| {
            let error = Head::parse("a.wgsl", text).unwrap_err();
            assert!(error.message.contains(message), "{error}");
            assert_eq!(error.location.map(|at| at.line), Some(line));
        };
        fails("// variants: A\n// requires: B -> A\n", "flag B", 2);
        fails("// variants: A\n// requires: A B\n", "requires: FLAG -> FLAG", 2);
        fails("// variants: A A\n", "declared twice", 1);
        fails("// variants: lower\n", "IN_CAPITALS", 1);
        fails("// variants: A\n// excludes: A\n", "two flags", 2);
        fails("fn f() {}\n// variants: A\n", "head", 2);
        fails("// counts: 1\n// counts: 1\n", "twice", 2);
    }
}
