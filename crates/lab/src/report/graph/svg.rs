//! A small writer of SVG: shapes and text by class, escaped, without scripts, legible on light and on dark pages.

use std::fmt::{Display, Write as _};

/// A rectangle for text, in pixels from the upper left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

#[cfg(test)]
impl Rect {
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x < other.x + other.width
            && other.x < self.x + self.width
            && self.y < other.y + other.height
            && other.y < self.y + self.height
    }
}

/// The style of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    Title,
    /// Names of passes and of dependencies.
    Name,
    /// Sentences.
    Prose,
    /// Words of Vulkan.
    Code,
}

impl Font {
    fn class(self) -> &'static str {
        match self {
            Self::Title => "title",
            Self::Name => "name",
            Self::Prose => "prose",
            Self::Code => "code",
        }
    }

    /// Pixels from line to line.
    pub fn line(self) -> f64 {
        match self {
            Self::Title => 26.0,
            Self::Name | Self::Prose => 16.0,
            Self::Code => 14.0,
        }
    }

    /// Pixels for a character: no usual font of the kind is wider on average, and monospaced ones are as wide.
    pub fn advance(self) -> f64 {
        match self {
            Self::Title => 12.6,
            Self::Name => 7.9,
            Self::Prose => 6.8,
            Self::Code => 6.63,
        }
    }

    pub fn width(self, text: &str) -> f64 {
        text.chars().count() as f64 * self.advance()
    }
}

/// The end of a text that is at its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextAnchor {
    Start,
    End,
}

/// Elements, in the order in which they are painted.
#[derive(Default)]
pub struct Svg {
    body: String,
    /// The area of each text, so that tests see that none lies on another.
    pub texts: Vec<(Rect, String)>,
}

/// Greys, and eight colours that tell neighbours apart (after Okabe and Ito, 2008, darker on light pages).
const STYLE: &str = "\
.page{fill:#ffffff}.title{font:600 19px sans-serif}.name{font:600 12.5px sans-serif}.prose{font:11px sans-serif}
.code{font:11px monospace}text{fill:#1f2328;font-family:'DejaVu Sans','Segoe UI',Helvetica,Arial,sans-serif}
text.code{font-family:'DejaVu Sans Mono',Menlo,Consolas,monospace}.faint{fill:#59636e}
.pass{fill:#f3f5f8;stroke:#8b949e}.box{fill:#ffffff;stroke:#59636e;stroke-width:1.4}.outside{fill:#f3f5f8;stroke:#8b949e;stroke-dasharray:2 3}
.row{fill:#8b949e;fill-opacity:.10}.lane{stroke:#8b949e;stroke-width:5;stroke-opacity:.45;fill:none}.line{stroke:#d1d9e0}
.write{fill:#1f2328;stroke:#1f2328;stroke-width:1.6}.read{fill:#ffffff;stroke:#1f2328;stroke-width:1.6}
.edge{fill:none;stroke-width:1.7}.by-region{stroke-dasharray:6 3}
.c0{stroke:#0072b2;fill:#0072b2}.c1{stroke:#b34700;fill:#b34700}.c2{stroke:#00785a;fill:#00785a}.c3{stroke:#a3477f;fill:#a3477f}
.c4{stroke:#7a5c00;fill:#7a5c00}.c5{stroke:#5b4bb7;fill:#5b4bb7}.c6{stroke:#b3002d;fill:#b3002d}.c7{stroke:#3d6b00;fill:#3d6b00}
path.edge{fill:none}text.c0,text.c1,text.c2,text.c3,text.c4,text.c5,text.c6,text.c7{stroke:none}
@media (prefers-color-scheme:dark){.page{fill:#0d1117}text{fill:#e6edf3}.faint{fill:#9198a1}.pass,.outside{fill:#151b23;stroke:#656c76}
.box{fill:#0d1117;stroke:#9198a1}.line{stroke:#3d444d}.write{fill:#e6edf3;stroke:#e6edf3}.read{fill:#0d1117;stroke:#e6edf3}
.c0{stroke:#58b0e8;fill:#58b0e8}.c1{stroke:#ff9a57;fill:#ff9a57}.c2{stroke:#35c79d;fill:#35c79d}.c3{stroke:#e79bc6;fill:#e79bc6}
.c4{stroke:#e3c04a;fill:#e3c04a}.c5{stroke:#a99cf5;fill:#a99cf5}.c6{stroke:#ff7b8f;fill:#ff7b8f}.c7{stroke:#9ccc54;fill:#9ccc54}
path.edge{fill:none}text.c0,text.c1,text.c2,text.c3,text.c4,text.c5,text.c6,text.c7{stroke:none}}";

/// Colours of edges and texts, by the class `c0` and so on.
pub const COLORS: usize = 8;

impl Svg {
    /// Opens a group with an attribute for its kind and name, as `data-dependency="..."`.
    pub fn open(&mut self, kind: &str, name: impl Display) -> &mut Self {
        let _ = writeln!(self.body, "<g data-{kind}=\"{}\">", escape(&name.to_string()));
        self
    }

    /// Sets the text that a pointer over the group shows.
    pub fn tooltip(&mut self, text: &str) -> &mut Self {
        let _ = writeln!(self.body, "<title>{}</title>", escape(text));
        self
    }

    pub fn close(&mut self) -> &mut Self {
        self.body.push_str("</g>\n");
        self
    }

    pub fn rectangle(&mut self, class: &str, at: Rect, radius: f64) -> &mut Self {
        let Rect { x, y, width, height } = at;
        let _ = writeln!(
            self.body,
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"{radius}\"/>"
        );
        self
    }

    pub fn circle(&mut self, class: &str, x: f64, y: f64, radius: f64) -> &mut Self {
        let _ = writeln!(self.body, "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>");
        self
    }

    /// Straight from point to point.
    pub fn polyline(&mut self, class: &str, points: &[(f64, f64)]) -> &mut Self {
        let mut path = String::new();
        for (index, (x, y)) in points.iter().enumerate() {
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
        }
        let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{path}\"/>");
        self
    }

    /// The head of an arrow that points right, with its tip at this point.
    pub fn arrow_head(&mut self, class: &str, x: f64, y: f64) -> &mut Self {
        let (back, top, bottom) = (x - 9.0, y - 4.0, y + 4.0);
        let _ = writeln!(
            self.body,
            "<path class=\"{class}\" d=\"M{x:.1} {y:.1}L{back:.1} {top:.1}L{back:.1} {bottom:.1}Z\"/>"
        );
        self
    }

    /// One line, `y` being its middle. `class` besides the font's.
    pub fn text(&mut self, font: Font, class: &str, (x, y): (f64, f64), anchor: TextAnchor, text: &str) -> &mut Self {
        if text.is_empty() {
            return self;
        }
        let width = font.width(text);
        let (anchor, left) = match anchor {
            TextAnchor::Start => ("start", x),
            TextAnchor::End => ("end", x - width),
        };
        let height = font.line() - 2.0;
        self.texts.push((Rect { x: left, y: y - height / 2.0, width, height }, text.to_owned()));
        // The baseline: capitals are about 0.7 of the size, which is 0.7 of a line.
        let baseline = y + font.line() * 0.25;
        let _ = writeln!(
            self.body,
            "<text class=\"{} {class}\" x=\"{x:.1}\" y=\"{baseline:.1}\" text-anchor=\"{anchor}\">{}</text>",
            font.class(),
            escape(text)
        );
        self
    }

    /// The whole document.
    pub fn finish(&self, title: &str, width: f64, height: f64) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
             height=\"{height:.0}\" role=\"img\">\n<title>{}</title>\n<style>{}</style>\n\
             <rect class=\"page\" width=\"100%\" height=\"100%\"/>\n{}</svg>\n",
            escape(title),
            escape(STYLE),
            self.body
        )
    }
}

/// Text as XML has it. Characters that XML cannot hold are replaced.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\t' | '\n' => escaped.push(character),
            '\0'..'\u{20}' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Wraps `text` into lines of at most `width` pixels; a longer word gets a line to itself.
pub fn wrap(font: Font, text: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if font.width(line) + font.width(word) + font.advance() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_to_xml_is_escaped() {
        assert_eq!(escape("a<b & \"c\">\u{1}"), "a&lt;b &amp; &quot;c&quot;&gt;\u{fffd}");
    }

    #[test]
    fn lines_are_filled_up_to_their_width() {
        let wrapped = wrap(Font::Code, "A | B | LONG_WORD_ALONE", 7.5 * Font::Code.advance());
        assert_eq!(wrapped, ["A | B |", "LONG_WORD_ALONE"]);
    }
}
