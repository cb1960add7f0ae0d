//! A strip for each row of the table: on the left the use that must be over, on the right the one that waits, and between them the hazard that the
//! row prevents.
//!
//! [`proof`](afterlight_proof) finds the hazards of frames from which the row is left out.

use super::svg::{Font, Rect, Svg, TextAnchor, wrap};
use afterlight::frame::rows::{Row, Rows};
use afterlight::gpu::sync::Use;
use afterlight::plan::FramePlan;
use afterlight_proof::{Clash, End, FrameModel, HazardKind, clashes};

/// Width of the page in pixels: about as much as books and README files show.
const WIDTH: f64 = 900.0;
const MARGIN: f64 = 20.0;
/// Width of a box: its longest line is `from DEPTH_STENCIL_ATTACHMENT_OPTIMAL`.
const BOX: f64 = 300.0;
/// Distance from the edge of a box to its words.
const PADDING: f64 = 10.0;
/// Distance between arrows, boxes and strips.
const GAP: f64 = 10.0;

/// A row of the table, as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    pub name: &'static str,
    /// The row's places and its carrier.
    heading: String,
    pub pairs: Vec<HazardPair>,
    /// The row's reason and, for a row that cannot be dropped, why not.
    below: Vec<String>,
}

/// Two boxes, and the arrows between them.
#[derive(Debug, Clone, PartialEq)]
pub struct HazardPair {
    /// The authors of the two uses, the first with its frame where that is another one.
    who: [String; 2],
    pub arrows: Vec<Arrow>,
}

/// A hazard between the two uses, in one memory or several.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrow {
    /// `None` for rows that cannot be dropped: the arrow then names their carrier.
    pub kind: Option<HazardKind>,
    label: String,
    memories: String,
    uses: [StyledLines; 2],
}

/// Stages, accesses and layouts of a use, with classes.
type StyledLines = Vec<(&'static str, String)>;

impl Strip {
    pub fn of(plan: &FramePlan, table: &Rows, row: &Row) -> Self {
        let region = row.region();
        let heading = format!("{} -> {}, {}{region}", row.from, row.to, row.carrier);
        let strip = Self { name: row.name.name(), heading, pairs: Vec::new(), below: vec![row.why.clone()] };
        match table.without(row.name) {
            Ok(without) => strip.with_hazards(&FrameModel::of(plan, &without)),
            Err(_) => strip.with_masks(row),
        }
    }

    fn with_hazards(mut self, frames: &FrameModel) -> Self {
        for clash in clashes(&frames.hazards()) {
            let (who, arrow) = ([describe_clash(&clash), clash.second.who.clone()], Arrow::of(&clash));
            match self.pairs.iter_mut().find(|pair| pair.who == who) {
                Some(pair) => pair.arrows.push(arrow),
                None => self.pairs.push(HazardPair { who, arrows: vec![arrow] }),
            }
        }
        if self.pairs.is_empty() {
            self.below.push("Without it nothing goes wrong: other dependencies order the same.".into());
        }
        self
    }

    fn with_masks(mut self, row: &Row) -> Self {
        let arrow = Arrow {
            kind: None,
            label: row.carrier.to_string(),
            memories: String::new(),
            uses: [row.before, row.after].map(masks),
        };
        self.pairs.push(HazardPair { who: [row.from.to_string(), row.to.to_string()], arrows: vec![arrow] });
        self.below.extend(row.carrier.stays().map(|why| format!("It cannot be dropped: {why}.")));
        self
    }
}

#[cfg(test)]
impl Strip {
    pub fn below_says(&self, words: &str) -> bool {
        self.below.iter().any(|sentence| sentence.contains(words))
    }
}

/// The earlier use's author, with the frame where that is another one.
fn describe_clash(clash: &Clash) -> String {
    let who = &clash.first.who;
    match clash.frames_apart {
        0 => who.clone(),
        1 => format!("{who} of the last frame"),
        _ => format!("{who} of an earlier frame"),
    }
}

impl Arrow {
    fn of(clash: &Clash) -> Self {
        Self {
            kind: Some(clash.kind),
            label: clash.kind.to_string(),
            memories: clash.memories.join(", "),
            uses: [&clash.first, &clash.second].map(end),
        }
    }

    fn color(&self) -> &'static str {
        match self.kind {
            Some(HazardKind::ReadAfterWrite) => "c0",
            Some(HazardKind::WriteAfterRead) => "c1",
            Some(HazardKind::WriteAfterWrite) => "c2",
            Some(HazardKind::ChangeAfterUse | HazardKind::UseAfterChange) => "c3",
            Some(HazardKind::Layout | HazardKind::Owner) => "c6",
            None => "c4",
        }
    }

    fn memory_lines(&self) -> Vec<String> {
        // No memory is one empty word.
        wrap(Font::Prose, &self.memories, MIDDLE).into_iter().filter(|line| !line.is_empty()).collect()
    }

    fn height(&self) -> f64 {
        let uses = self.uses.iter().map(Vec::len).max().unwrap_or(0) as f64 * Font::Code.line();
        let middle = Font::Name.line() + 6.0 + self.memory_lines().len() as f64 * Font::Prose.line();
        uses.max(middle)
    }
}

fn end(end: &End) -> StyledLines {
    let changes = end.changes.iter().flat_map(|[from, to]| [format!("from {from:?}"), format!("to {to:?}")]);
    let operation = end.operation.map(|name| format!("({name})"));
    let masks = masks(Use::new(end.stages, end.accesses));
    masks.into_iter().chain(changes.chain(operation).map(|line| ("", line))).collect()
}

/// The stages and, on separate lines, the accesses.
fn masks(uses: Use) -> StyledLines {
    let lines = |class: &'static str, text: String| -> StyledLines {
        let lines = wrap(Font::Code, &text, BOX - 2.0 * PADDING).into_iter().filter(|line| !line.is_empty());
        lines.map(|line| (class, line)).collect()
    };
    [lines("", uses.stages()), lines("faint", uses.accesses())].concat()
}

/// Width between two boxes, less the room around arrows.
const MIDDLE: f64 = WIDTH - 2.0 * (MARGIN + BOX) - 2.0 * PADDING;

/// Draws the strips below one another.
pub fn draw(title: &str, strips: &[Strip]) -> String {
    let (svg, height) = paint(title, strips);
    svg.finish(title, WIDTH, height)
}

/// The drawing, and its height.
pub fn paint(title: &str, strips: &[Strip]) -> (Svg, f64) {
    let mut svg = Svg::default();
    let legend = "Left: a use that must be over. Right: the use that waits for it. Between them: the hazard that follows without the dependency, \
                  and its memory.";
    let title = format!("What each dependency of {title} prevents");
    let mut y = lines(&mut svg, (Font::Title, ""), &title, MARGIN);
    y = lines(&mut svg, (Font::Prose, "faint"), legend, y);
    for strip in strips {
        svg.polyline("line", &[(MARGIN, y + GAP), (WIDTH - MARGIN, y + GAP)]);
        y = draw_strip(&mut svg, strip, y + 2.0 * GAP);
    }
    (svg, y + MARGIN)
}

/// Sets a sentence over the page's whole width, and gives where it ends.
fn lines(svg: &mut Svg, (font, class): (Font, &str), text: &str, mut y: f64) -> f64 {
    for line in wrap(font, text, WIDTH - 2.0 * MARGIN) {
        svg.text(font, class, (MARGIN, y + font.line() / 2.0), TextAnchor::Start, &line);
        y += font.line();
    }
    y
}

fn draw_strip(svg: &mut Svg, strip: &Strip, y: f64) -> f64 {
    svg.open("dependency", strip.name).tooltip(&strip.below.join(" "));
    let mut y = lines(svg, (Font::Name, ""), strip.name, y);
    y = lines(svg, (Font::Code, "faint"), &strip.heading, y);
    for pair in &strip.pairs {
        y = draw_pair(svg, pair, y + GAP);
    }
    y += GAP / 2.0;
    for sentence in &strip.below {
        y = lines(svg, (Font::Prose, ""), sentence, y);
    }
    svg.close();
    y
}

fn draw_pair(svg: &mut Svg, pair: &HazardPair, top: f64) -> f64 {
    let lefts = [MARGIN, WIDTH - MARGIN - BOX];
    let heads = pair.who.each_ref().map(|who| wrap(Font::Name, who, BOX - 2.0 * PADDING));
    let head = heads.iter().map(Vec::len).max().unwrap_or(1) as f64 * Font::Name.line();
    let height = PADDING + head + pair.arrows.iter().map(|arrow| arrow.height() + GAP).sum::<f64>();
    for (x, head) in lefts.into_iter().zip(&heads) {
        svg.rectangle("box", Rect { x, y: top, width: BOX, height }, 5.0);
        column(svg, (Font::Name, ""), head, (x + PADDING, top + PADDING * 0.6));
    }
    let mut y = top + PADDING * 0.6 + head;
    for arrow in &pair.arrows {
        for (x, uses) in lefts.into_iter().zip(&arrow.uses) {
            for ((class, line), index) in uses.iter().zip(0..) {
                let middle = y + Font::Code.line() * (f64::from(index) + 0.5);
                svg.text(Font::Code, class, (x + PADDING, middle), TextAnchor::Start, line);
            }
        }
        draw_arrow(svg, arrow, y);
        y += arrow.height() + GAP;
    }
    top + height
}

fn draw_arrow(svg: &mut Svg, arrow: &Arrow, y: f64) {
    let (left, right, color) = (MARGIN + BOX, WIDTH - MARGIN - BOX, arrow.color());
    svg.open("hazard", &arrow.label);
    column(svg, (Font::Name, color), std::slice::from_ref(&arrow.label), (left + PADDING, y));
    let line = y + Font::Name.line() + 2.0;
    svg.polyline(&format!("edge {color}"), &[(left, line), (right - 8.0, line)]);
    svg.arrow_head(color, right, line);
    column(svg, (Font::Prose, ""), &arrow.memory_lines(), (left + PADDING, line + 4.0));
    svg.close();
}

/// Sets lines below one another from the upper left.
fn column(svg: &mut Svg, (font, class): (Font, &str), lines: &[String], (x, mut y): (f64, f64)) {
    for line in lines {
        svg.text(font, class, (x, y + font.line() / 2.0), TextAnchor::Start, line);
        y += font.line();
    }
}
