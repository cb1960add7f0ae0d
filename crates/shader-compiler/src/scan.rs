//! Just enough of WGSL's lexical grammar to find declarations and uses in a file before any variant of it is composed.

/// A word, `::` or a single other character, with its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token<'a> {
    /// The characters.
    pub text: &'a str,
    /// Byte at which it begins.
    pub start: usize,
}

impl Token<'_> {
    /// Byte after its last.
    #[must_use]
    pub fn end(&self) -> usize {
        self.start + self.text.len()
    }
}

/// `text` with every comment turned into as many spaces, so that places stay as they are.
#[must_use]
pub fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let length = comment_length(rest);
        if length > 0 {
            let (comment, after) = rest.split_at(length);
            out.extend(comment.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
            rest = after;
        } else {
            let until =
                rest.char_indices().skip(1).find(|(_, character)| *character == '/').map_or(rest.len(), |(at, _)| at);
            out.push_str(&rest[..until]);
            rest = &rest[until..];
        }
    }
    out
}

/// Bytes of the comment that `text` begins with; 0 if it begins with none. Block comments nest, as WGSL has it.
fn comment_length(text: &str) -> usize {
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if !text.starts_with("/*") {
        return 0;
    }
    let (mut depth, mut at) = (0_usize, 0);
    loop {
        let rest = &text.as_bytes()[at..];
        if rest.starts_with(b"/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if rest.starts_with(b"*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                return at;
            }
        } else if rest.is_empty() {
            return at;
        } else {
            at += 1;
        }
    }
}

/// `text`, which has no comments, with every preprocessor line (`#import`, also over several lines, `#ifdef`, ...) turned into spaces.
#[must_use]
pub fn without_directives(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut open_braces = 0_isize;
    for line in text.split_inclusive('\n') {
        let directive = line.trim_start().starts_with('#');
        if directive || open_braces > 0 {
            let count = |brace| line.matches(brace).count() as isize;
            let import = open_braces > 0 || line.trim_start()[1..].trim_start().starts_with("import");
            open_braces = if import { open_braces + count('{') - count('}') } else { 0 };
            out.extend(line.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
        } else {
            out.push_str(line);
        }
    }
    out
}

/// The tokens of `text`, which has no comments.
#[must_use]
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut characters = text.char_indices().peekable();
    while let Some((start, first)) = characters.next() {
        if first.is_whitespace() {
            continue;
        }
        let mut end = start + first.len_utf8();
        if is_word(first) {
            while let Some(&(at, next)) = characters.peek().filter(|(_, next)| is_word(*next)) {
                end = at + next.len_utf8();
                characters.next();
            }
        } else if first == ':' && characters.peek().is_some_and(|(_, next)| *next == ':') {
            characters.next();
            end += 1;
        }
        tokens.push(Token { text: &text[start..end], start });
    }
    tokens
}

fn is_word(character: char) -> bool {
    character == '_' || character.is_alphanumeric()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_vanish_and_places_stay() {
        let text = "a /* x /* é */ y */ b // c\n/d";
        let clean = without_comments(text);
        assert_eq!(clean.len(), text.len());
        assert_eq!(clean.find('b'), text.find('b'));
        assert!(!clean.contains('c') && !clean.contains('y') && clean.ends_with("\n/d"));
    }

    #[test]
    fn directives_vanish_over_several_lines() {
        let clean = without_directives("#import a::{\n  b,\n}\nfn c() {}\n#ifdef D\ne\n");
        let words: Vec<_> = tokens(&clean).iter().map(|token| token.text).collect();
        assert_eq!(words, ["fn", "c", "(", ")", "{", "}", "e"]);
    }

    #[test]
    fn paths_are_three_tokens() {
        let words: Vec<_> = tokens("a::b(c_1)").iter().map(|token| token.text).collect();
        assert_eq!(words, ["a", "::", "b", "(", "c_1", ")"]);
    }
}
