//! One WGSL file: its overrides and subpass inputs, found in the text so that errors point at it, and the text that naga is given.

use std::path::Path;

use crate::error::{Error, SourceSpan};
use crate::scan::{self, Token};

/// A texture variable with this prefix is a subpass input.
pub const SUBPASS_PREFIX: &str = "subpass_";
/// The comment after a constant that the host shares.
const HOST_MARK: &str = "// host";

/// `override NAME: T = value;`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OverrideDeclaration {
    /// NAME.
    pub name: String,
    /// The `n` of `@id(n)`.
    pub id: Option<u32>,
    /// The place in the source.
    pub location: SourceSpan,
}

/// `const NAME: T = value; // host`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostDeclaration {
    /// NAME.
    pub name: String,
    /// True if only variants with some flag have it.
    pub conditional: bool,
    /// The place in the source.
    pub location: SourceSpan,
}

/// A WGSL file, read.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file as errors name it.
    pub path: String,
    /// The text, with newlines made `\n`.
    pub text: String,
    /// The text in which overrides are private variables: naga folds overrides, and `patch` makes constants of the variables.
    pub rewritten: String,
    /// The name in `#define_import_path`.
    pub import_path: Option<String>,
    /// The modules it imports something from, in order.
    pub imports: Vec<String>,
    /// The overrides of all variants, in order.
    pub overrides: Vec<OverrideDeclaration>,
    /// The variables that are named as subpass inputs, each with its place in the source.
    pub subpass_inputs: Vec<(String, SourceSpan)>,
    /// The constants that are marked for the host.
    pub host_constants: Vec<HostDeclaration>,
}

impl Source {
    /// Looks through `text`, the content of the file that errors call `path`.
    ///
    /// # Errors
    /// A malformed override, a subpass input that is used for anything but a `textureLoad`, or a mark for the host where no constant is.
    pub fn new(path: &str, text: &str) -> Result<Self, Error> {
        let text = text.trim_start_matches('\u{feff}').replace("\r\n", "\n").replace('\r', "\n");
        let clean = scan::without_directives(&scan::without_comments(&text));
        let tokens = scan::tokens(&clean);
        let (import_path, imports, _) = naga_oil::compose::get_preprocessor_data(&text);
        let mut source = Self {
            path: path.to_owned(),
            rewritten: text.clone(),
            text: String::new(),
            import_path,
            imports: imports.into_iter().map(|import| import.import).collect(),
            overrides: Vec::new(),
            subpass_inputs: Vec::new(),
            host_constants: Vec::new(),
        };
        source.find_host_constants(&text, &tokens)?;
        source.find_overrides(&text, &tokens)?;
        source.find_subpass_inputs(&text, &tokens)?;
        source.text = text;
        Ok(source)
    }

    /// The file's name without `.wgsl`.
    pub fn stem(&self) -> &str {
        Path::new(&self.path).file_stem().and_then(|stem| stem.to_str()).unwrap_or("")
    }

    /// The place of a token of this file.
    fn place(&self, text: &str, token: &Token) -> SourceSpan {
        SourceSpan::of(&self.path, text, token.start, token.text.len())
    }

    /// Finds the lines `const NAME: T = value; // host`.
    fn find_host_constants(&mut self, text: &str, tokens: &[Token]) -> Result<(), Error> {
        let (mut end, mut conditions, mut braces) = (0, 0_usize, 0_usize);
        let mut rest = tokens.iter().peekable();
        for line in text.split_inclusive('\n') {
            let start = end;
            end += line.len();
            let own: Vec<_> = std::iter::from_fn(|| rest.next_if(|token| token.start < end)).collect();
            match line.split_whitespace().next() {
                Some("#if" | "#ifdef" | "#ifndef") => conditions += 1,
                Some("#endif") => conditions = conditions.saturating_sub(1),
                _ => {}
            }
            if line.trim_end().ends_with(HOST_MARK) {
                let [Token { text: "const", .. }, name, .., Token { text: ";", .. }] = own[..] else {
                    let at =
                        SourceSpan::of(&self.path, text, start + line.rfind(HOST_MARK).unwrap_or(0), HOST_MARK.len());
                    return Err(Error::at(
                        at,
                        "this marks a constant in a line of its own: `const NAME: T = value; // host`",
                    ));
                };
                let (name, location, conditional) = (name.text.to_owned(), self.place(text, name), conditions > 0);
                if braces > 0 || (conditional && self.import_path.is_some()) {
                    let message = format!(
                        "`{name}` is for the host, so it cannot stand in a function, nor under a flag in a module"
                    );
                    return Err(Error::at(location, message));
                }
                self.host_constants.push(HostDeclaration { name, conditional, location });
            }
            for token in own {
                match token.text {
                    "{" => braces += 1,
                    "}" => braces = braces.saturating_sub(1),
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn find_overrides(&mut self, text: &str, tokens: &[Token]) -> Result<(), Error> {
        // Goes from the last to the first, so that replacements do not move the tokens that are still to be replaced.
        for index in (0..tokens.len()).rev().filter(|index| tokens[*index].text == "override") {
            let word = |ahead: usize| tokens.get(index + ahead).map_or("", |token| token.text);
            // `override fn` is naga_oil's way to replace a function, not WGSL's override.
            if word(1) == "fn" {
                continue;
            }
            let name = tokens.get(index + 1).unwrap_or(&tokens[index]);
            let location = self.place(text, name);
            let statement = tokens[index..].iter().take_while(|token| token.text != ";");
            if !statement.clone().any(|token| token.text == "=") {
                let message =
                    format!("the override `{}` needs a default value (`override {0}: T = value;`)", name.text);
                return Err(Error::at(location, message));
            }
            self.rewritten.replace_range(tokens[index].start..tokens[index].end(), "var<private>");
            let id = self.take_id(text, tokens, index)?;
            self.overrides.push(OverrideDeclaration { name: name.text.to_owned(), id, location });
        }
        self.overrides.reverse();
        Ok(())
    }

    /// Reads and blanks the `@id(n)` before the override at `index`.
    fn take_id(&mut self, text: &str, tokens: &[Token], index: usize) -> Result<Option<u32>, Error> {
        let Some([at, id, open, number, close]) = index.checked_sub(5).map(|first| &tokens[first..index]) else {
            return Ok(None);
        };
        if [at.text, id.text, open.text, close.text] != ["@", "id", "(", ")"] {
            return Ok(None);
        }
        let digits = number.text.trim_end_matches(['u', 'i']);
        let value = digits.parse().map_err(|_| {
            Error::at(
                self.place(text, number),
                format!("`{}` is no id: @id takes a literal from 0 to 4294967295", number.text),
            )
        })?;
        self.rewritten.replace_range(at.start..close.end(), &" ".repeat(close.end() - at.start));
        Ok(Some(value))
    }

    fn find_subpass_inputs(&mut self, text: &str, tokens: &[Token]) -> Result<(), Error> {
        for (index, token) in tokens.iter().enumerate().filter(|(_, token)| token.text.starts_with(SUBPASS_PREFIX)) {
            // The part of a path: `gbuffer::subpass_albedo`.
            let mut first = index;
            while first >= 2 && tokens[first - 1].text == "::" {
                first -= 2;
            }
            let word = |back: usize| first.checked_sub(back).map_or("", |at| tokens[at].text);
            let next = tokens.get(index + 1).map_or("", |token| token.text);
            match (word(1), next) {
                ("var", ":") => self.subpass_inputs.push((token.text.to_owned(), self.place(text, token))),
                ("(", ",") if word(2) == "textureLoad" => {}
                _ => return Err(Error::at(self.place(text, token), misuse(token.text, &tokens[..first], next))),
            }
        }
        Ok(())
    }
}

/// Explains the fault of a use of the subpass input `name` after the tokens `before`.
fn misuse(name: &str, before: &[Token], next: &str) -> String {
    const ONLY: &str = "it can only be read with `textureLoad(NAME, vec2<i32>(0, 0), 0)`";
    let only = ONLY.replace("NAME", name);
    if next == ":" || before.last().is_some_and(|token| matches!(token.text, "let" | "const" | "var" | ">")) {
        return format!(
            "`{name}`: names that begin with `{SUBPASS_PREFIX}` are kept for subpass inputs (`var {name}: texture_2d<f32>;`)"
        );
    }
    match enclosing_call(before) {
        Some(call) if call.starts_with("textureSample") || call.starts_with("textureGather") => {
            format!("the subpass input `{name}` is sampled by `{call}`: {only}")
        }
        Some("textureStore") => format!("the subpass input `{name}` is written by `textureStore`: {only}"),
        Some(call) if call.starts_with("texture") => {
            format!("the subpass input `{name}` is asked for by `{call}`: {only}")
        }
        Some(call) => format!("the subpass input `{name}` is passed to the function `{call}`: {only}"),
        None => format!("the subpass input `{name}` is used as a value: {only}"),
    }
}

/// The name before the innermost parenthesis that `before` leaves open.
fn enclosing_call<'a>(before: &[Token<'a>]) -> Option<&'a str> {
    let mut depth = 0;
    for (index, token) in before.iter().enumerate().rev() {
        match token.text {
            ")" => depth += 1,
            "(" if depth > 0 => depth -= 1,
            "(" => return index.checked_sub(1).map(|name| before[name].text),
            ";" | "{" | "}" => return None,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_become_private_variables_in_place() {
        let source = Source::new(
            "a.wgsl",
            "@id(7) override A: u32 = 1;\n// override C\noverride B = 2.0;\noverride fn f() {}\n",
        )
        .unwrap();
        let found: Vec<_> = source.overrides.iter().map(|o| (o.name.as_str(), o.id, o.location.line)).collect();
        assert_eq!(found, [("A", Some(7), 1), ("B", None, 3)]);
        assert!(source.rewritten.starts_with("       var<private> A: u32 = 1;\n// override C\nvar<private> B"));
        assert!(source.rewritten.contains("override fn f"));
    }

    #[test]
    fn wrong_uses_of_subpass_inputs_are_named() {
        let fails = |line: &str, message: &str| {
            let error = Source::new("a.wgsl", &format!("var subpass_a: texture_2d<f32>;\n{line}\n")).unwrap_err();
            assert!(error.message.contains("`subpass_a`") && error.message.contains(message), "{error}");
            assert_eq!(error.location.map(|at| at.line), Some(2));
        };
        fails("let x = shade(1.0, max(2.0, 3.0), subpass_a);", "passed to the function `shade`");
        fails("let x = textureSample(subpass_a, s, uv);", "sampled by `textureSample`");
        fails("let x = textureDimensions(subpass_a);", "`textureDimensions`");
        fails("textureStore(subpass_a, c, v);", "textureStore");
        fails("let x = subpass_a;", "used as a value");
        fails("fn f(subpass_a: texture_2d<f32>) {}", "kept for subpass inputs");
    }

    #[test]
    fn constants_for_the_host_are_found_in_place() {
        let text = "const A: u32 = 1u; // host\nconst B: u32 = 2u;\nfn f() {}\n#ifdef MORE\nconst C = 2.0 * f32(A); // host\n#endif\n";
        let source = Source::new("a.wgsl", text).unwrap();
        let found = source.host_constants.iter().map(|own| (own.name.as_str(), own.conditional, own.location.line));
        assert_eq!(found.collect::<Vec<_>>(), [("A", false, 1), ("C", true, 5)]);
    }

    #[test]
    fn wrong_marks_for_the_host_are_pointed_at() {
        let fails = |text: &str, message: &str, line: usize| {
            let error = Source::new("a.wgsl", text).unwrap_err();
            assert!(error.message.contains(message), "{error}");
            assert_eq!(error.location.map(|at| at.line), Some(line));
        };
        fails("fn f() {}\nvar<private> a: u32; // host\n", "marks a constant", 2);
        fails("// host\nconst A = 1u;\n", "marks a constant", 1);
        fails("const A: u32 =\n    1u; // host\n", "marks a constant", 2);
        fails("#define_import_path a\n#ifdef MORE\nconst A = 1u; // host\n#endif\n", "under a flag", 3);
        fails("fn f() {\n    const A = 1u; // host\n}\n", "in a function", 2);
    }

    #[test]
    fn right_uses_pass() {
        let text = "#import a::{subpass_b}\nvar subpass_a: texture_2d<f32>;\nfn f() { let x = textureLoad(subpass_a, Z, 0) + textureLoad(a::subpass_b, Z, 0); }";
        assert_eq!(Source::new("a.wgsl", text).unwrap().subpass_inputs.len(), 1);
    }
}
