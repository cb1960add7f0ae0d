//! One plot of error against time or another quantity, as inline SVG: axes and curves by plotters, and over them marks with tooltips, which plotters
//! cannot make.
//!
//! plotters writes whole pixels and fixed colours. So it draws on a canvas that is larger by [`FINE`], and the style sheet selects its
//! colours by the attributes that it writes, to put others in their place on dark pages.

use std::ops::Range;

use maud::{Markup, PreEscaped, html};
use plotters::coord::Shift;
use plotters::prelude::*;

use super::marks::{Glyph, RADIUS};
use super::scales::Scale;

/// Units of plotters' canvas for a pixel.
const FINE: f64 = 4.0;
/// Width of a character of a label, in pixels, at most.
const ADVANCE: f64 = 6.6;
/// Height of a label's line.
const LINE: f64 = 13.0;

/// As in the style sheet, which selects by them.
const GRID: RGBColor = RGBColor(0xe3, 0xe7, 0xec);
const AXIS: RGBColor = RGBColor(0x8b, 0x94, 0x9e);
const TEXT: RGBColor = RGBColor(0x59, 0x63, 0x6e);
const FRONT: RGBColor = RGBColor(0x1f, 0x23, 0x28);
const CURVE: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const FAINT: RGBColor = RGBColor(0xa0, 0xa8, 0xb1);
const WORST: RGBColor = RGBColor(0xb3, 0x47, 0x00);

#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// The size in pixels.
    pub size: (f64, f64),
    pub x: Axis,
    /// Errors.
    pub y: Axis,
    /// A description of the plot, for readers who do not see it.
    pub label: String,
    pub lines: Vec<Line>,
    pub marks: Vec<Mark>,
    pub area: Option<Area>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub title: String,
    /// `None`: a logarithmic one that holds all marks.
    pub scale: Option<Scale>,
}

impl Axis {
    pub fn of(title: String) -> Self {
        Self { title, scale: None }
    }
}

/// A shaded area under a level of error, down to the plot's lower edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// The class that the style sheet colours it by.
    pub class: &'static str,
    pub level: f64,
    /// Where it begins and ends along the other axis; `None` from one side of the plot to the other.
    pub between: Option<[f64; 2]>,
    /// The text over its right end.
    pub note: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A front: steps, on to the plot's edges.
    Front,
    Curve,
    /// A curve against the lesser of two truths.
    Faint,
    /// A mark of the largest error, where a curve shows the mean of errors.
    Worst,
}

impl Stroke {
    /// Colour, and width in pixels.
    fn style(self) -> (RGBColor, f64) {
        match self {
            Self::Front => (FRONT, 1.8),
            Self::Curve => (CURVE, 1.6),
            Self::Faint => (FAINT, 1.2),
            Self::Worst => (WORST, 1.6),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub stroke: Stroke,
    /// Time, or another quantity, and error; errors of zero lie on the floor, a NaN leaves a gap.
    pub points: Vec<(f64, f64)>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Time, or another quantity: its median and interval.
    pub x: f64,
    pub whisker: Range<f64>,
    /// Error.
    pub y: f64,
    pub glyph: Glyph,
    pub hollow: bool,
    /// A ring around it.
    pub ringed: bool,
    pub tooltip: String,
    pub label: Option<String>,
}

/// The edges of the plot's area, in pixels.
#[derive(Debug, Clone, Copy)]
struct PlotFrame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

/// A mark in its place.
struct PlacedMark<'a> {
    mark: &'a Mark,
    x: f64,
    y: f64,
    low: f64,
    high: f64,
    floor: bool,
}

impl Plot {
    /// Draws the plot, or a sentence if there is nothing to draw.
    pub fn draw(&self) -> Markup {
        let times = self.marks.iter().flat_map(|mark| [mark.x, mark.whisker.start, mark.whisker.end]);
        let level = self.area.as_ref().map(|area| area.level).filter(|level| *level > 0.0);
        let errors = self.marks.iter().map(|mark| mark.y).chain(level);
        let x = self.x.scale.clone().or_else(|| Scale::of(times.filter(|time| *time > 0.0), 1.25));
        let y = self.y.scale.clone().or_else(|| Scale::of(errors, 4.0));
        let Some((x, y)) = x.zip(y) else {
            return html! { p.none { "Nothing to draw: no point has a time and an error that are numbers." } };
        };
        match self.axes_and_lines(&x, &y) {
            Ok(drawn) => self.assemble(&drawn),
            Err(error) => html! { p.none { "The plot could not be drawn: " (error) } },
        }
    }

    /// plotters' part, and where it put the marks.
    fn axes_and_lines(&self, x: &Scale, y: &Scale) -> Result<PlotLayout<'_>, Box<dyn std::error::Error>> {
        let mut svg = String::new();
        let (width, height) = (fine(self.size.0), fine(self.size.1));
        let drawn = {
            let area = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
            let drawn = self.chart(&area, x, y)?;
            area.present()?;
            drawn
        };
        let inner = svg.split_once('>').map_or("", |(_, rest)| rest).trim_end();
        Ok(PlotLayout { axes: inner.trim_end_matches("</svg>").to_owned(), ..drawn })
    }

    fn chart<'a>(
        &'a self,
        area: &DrawingArea<SVGBackend, Shift>,
        x: &Scale,
        y: &Scale,
    ) -> Result<PlotLayout<'a>, Box<dyn std::error::Error>> {
        let widest = y.ticks().iter().map(|tick| y.label(*tick).chars().count()).max().unwrap_or(0);
        let mut chart = ChartBuilder::on(area)
            .margin_top(fine(24.0))
            .margin_right(fine(14.0))
            .margin_bottom(fine(20.0))
            .x_label_area_size(fine(20.0))
            .y_label_area_size(fine(12.0 + ADVANCE * widest as f64))
            .build_cartesian_2d(x.clone(), y.clone())?;
        let text = ("sans-serif", 11.0 * 1.24 * FINE).into_font().color(&TEXT);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(fine(1.0)))
            .axis_style(AXIS.stroke_width(fine(1.0)))
            .set_all_tick_mark_size(fine(4.0))
            .label_style(text)
            .x_label_formatter(&|place| x.label(*place))
            .y_label_formatter(&|place| y.label(*place))
            .draw()?;
        let runs = self.runs(x, y);
        for (stroke, run) in &runs {
            let (color, width) = stroke.style();
            chart.draw_series(LineSeries::new(run.iter().copied(), color.stroke_width(fine(width))))?;
        }
        let pixel = |time: f64, error: f64| {
            let (x, y) = chart.backend_coord(&(time, error));
            (f64::from(x) / FINE, f64::from(y) / FINE)
        };
        let place = |mark: &'a Mark| {
            let (time, error) = x.place(mark.x).zip(y.place(mark.y))?;
            let at = pixel(time, error);
            let end = |time: f64| x.place(time).filter(|_| time > 0.0).map_or(at.0, |time| pixel(time, error).0);
            let (low, high) = (end(mark.whisker.start), end(mark.whisker.end));
            Some(PlacedMark { mark, x: at.0, y: at.1, low, high, floor: mark.y == 0.0 })
        };
        let (left, bottom) = pixel(x.range.start, y.range.start);
        let (right, top) = pixel(x.range.end, y.range.end);
        Ok(PlotLayout {
            axes: String::new(),
            frame: PlotFrame { left, right, top, bottom },
            marks: self.marks.iter().filter_map(place).collect(),
            area: self.area.as_ref().and_then(|area| {
                let place = |value: f64| Some(pixel(x.place(value)?, y.range.start).0.clamp(left, right));
                let [from, to] = area.between.map_or([None; 2], |ends| ends.map(place));
                let level = pixel(x.range.start, y.place(area.level)?).1;
                Some((area, PlotFrame { left: from.unwrap_or(left), right: to.unwrap_or(right), top: level, bottom }))
            }),
            zero: x.zero.map(|zero| pixel(zero, y.range.start).0),
            floor: y.zero.map(|zero| pixel(x.range.start, zero).1),
            strokes: runs
                .iter()
                .flat_map(|(_, run)| along(run.iter().map(|(time, error)| pixel(*time, *error))))
                .collect(),
        })
    }

    /// The lines between their gaps, in places on the axes.
    fn runs(&self, x: &Scale, y: &Scale) -> Vec<(Stroke, Vec<(f64, f64)>)> {
        let mut runs = Vec::new();
        for line in &self.lines {
            let points = line.points.iter().map(|(time, error)| x.place(*time).zip(y.place(*error)));
            let points: Vec<Option<(f64, f64)>> = points.collect();
            for run in points.split(Option::is_none).filter(|run| !run.is_empty()) {
                let run = run.iter().copied().flatten();
                runs.push(match line.stroke {
                    Stroke::Front => (line.stroke, steps(run, &x.range, &y.range)),
                    _ => (line.stroke, run.collect()),
                });
            }
        }
        runs
    }

    fn assemble(&self, drawn: &PlotLayout) -> Markup {
        let PlotFrame { left, right, top, bottom } = drawn.frame;
        let labels = labels(drawn);
        html! {
            svg.plot viewBox=(format!("0 0 {} {}", self.size.0, self.size.1)) role="img" aria-label=(self.label) {
                g transform=(format!("scale({})", 1.0 / FINE)) { (PreEscaped(&drawn.axes)) }
                @if let Some(zero) = drawn.zero {
                    line.floor x1=(px(zero)) x2=(px(zero)) y1=(px(top)) y2=(px(bottom)) {}
                    text.note x=(px(zero)) y=(px(bottom + 16.0)) text-anchor="middle" { "0" }
                }
                @if let Some(floor) = drawn.floor {
                    line.floor x1=(px(left)) x2=(px(right)) y1=(px(floor)) y2=(px(floor)) {}
                    text.note x=(px(left - 7.0)) y=(px(floor + 4.0)) text-anchor="end" { "0" }
                }
                @if let Some((Area { class, note, .. }, PlotFrame { left, right, top, bottom })) = drawn.area {
                    rect class=(class) x=(px(left)) width=(px(right - left)) y=(px(top)) height=(px((bottom - top).max(0.0))) {}
                    line class=(class) x1=(px(left)) x2=(px(right)) y1=(px(top)) y2=(px(top)) {}
                    text.note x=(px(right - 4.0)) y=(px(top - 5.5)) text-anchor="end" { (note) }
                }
                text.axis x=(px(4.0)) y=(px(top - 10.0)) { (self.y.title) }
                text.axis x=(px(right)) y=(px(self.size.1 - 5.0)) text-anchor="end" { (self.x.title) }
                @for placed in &drawn.marks { (mark(placed)) }
                @for (x, y, anchor, text) in &labels {
                    text.label x=(px(*x)) y=(px(*y)) text-anchor=(anchor) { (text) }
                }
            }
        }
    }
}

/// The drawing that plotters made, and the marks to be put over it.
struct PlotLayout<'a> {
    axes: String,
    frame: PlotFrame,
    marks: Vec<PlacedMark<'a>>,
    area: Option<(&'a Area, PlotFrame)>,
    /// The places of zeros along both axes.
    zero: Option<f64>,
    floor: Option<f64>,
    /// Along the lines, every few pixels.
    strokes: Vec<(f64, f64)>,
}

fn fine(pixels: f64) -> u32 {
    (pixels * FINE).round() as u32
}

/// Pixels to a tenth.
fn px(pixels: f64) -> String {
    format!("{pixels:.1}")
}

/// The border of the area that a front beats: from the upper edge down its points to the right edge.
fn steps(points: impl Iterator<Item = (f64, f64)>, x: &Range<f64>, y: &Range<f64>) -> Vec<(f64, f64)> {
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for (time, error) in points {
        steps.push((time, steps.last().map_or(y.end, |last| last.1)));
        steps.push((time, error));
    }
    if let Some(last) = steps.last().copied() {
        steps.push((x.end, last.1));
    }
    steps
}

/// Points every few pixels along a line.
fn along(corners: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let corners: Vec<(f64, f64)> = corners.collect();
    let mut along = Vec::new();
    for pair in corners.windows(2) {
        let (width, height) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let count = (width.hypot(height) / 3.0).ceil().max(1.0);
        let parts = (0..=count as usize).map(|index| index as f64 / count);
        along.extend(parts.map(|part| (pair[0].0 + part * width, pair[0].1 + part * height)));
    }
    along
}

fn mark(placed: &PlacedMark) -> Markup {
    let PlacedMark { mark, x, y, low, high, floor } = placed;
    html! {
        g class=(mark.glyph.class(mark.hollow)) {
            title { (mark.tooltip) }
            @if high - low > 0.5 {
                line x1=(px(*low)) x2=(px(*high)) y1=(px(*y)) y2=(px(*y)) {}
                line x1=(px(*low)) x2=(px(*low)) y1=(px(y - 3.0)) y2=(px(y + 3.0)) {}
                line x1=(px(*high)) x2=(px(*high)) y1=(px(y - 3.0)) y2=(px(y + 3.0)) {}
            }
            @if mark.ringed { circle.ring cx=(px(*x)) cy=(px(*y)) r=(px(RADIUS + 4.0)) {} }
            path d=(mark.glyph.path(*x, *y)) {}
            // An arrow: it lies further down than any axis goes.
            @if *floor { path.arrow d=(format!("M{:.1} {:.1}l-3.5 -5h7Z", x, y + 15.0)) {} }
        }
    }
}

/// A box as left, top, right and bottom.
type Extent = [f64; 4];

fn overlap(a: &Extent, b: &Extent) -> f64 {
    let (width, height) = (a[2].min(b[2]) - a[0].max(b[0]), a[3].min(b[3]) - a[1].max(b[1]));
    width.max(0.0) * height.max(0.0)
}

/// Extents that a label may hide, with how much each matters.
struct LabelObstacles(Vec<(Extent, f64)>);

impl LabelObstacles {
    fn of(drawn: &PlotLayout) -> Self {
        let reach = RADIUS + 1.0;
        let marks = drawn.marks.iter().map(|own| ([own.x - reach, own.y - reach, own.x + reach, own.y + reach], 3.0));
        let whiskers = drawn.marks.iter().map(|own| ([own.low, own.y - 1.0, own.high, own.y + 1.0], 1.0));
        let strokes = drawn.strokes.iter().map(|(x, y)| ([x - 1.5, y - 1.5, x + 1.5, y + 1.5], 1.0));
        let note =
            drawn.area.map(|(_, PlotFrame { right, top, .. })| ([right - 160.0, top - 14.0, right, top + 1.0], 3.0));
        Self(marks.chain(whiskers).chain(strokes).chain(note).collect())
    }

    fn hidden(&self, extent: &Extent) -> f64 {
        self.0.iter().map(|(other, weight)| weight * overlap(extent, other)).sum()
    }
}

/// Places for the labels, each where it hides least: right, left, above or below its mark, at a corner, or a line further off.
fn labels(drawn: &PlotLayout) -> Vec<(f64, f64, &'static str, String)> {
    let PlotFrame { left, right, top, bottom } = drawn.frame;
    let mut obstacles = LabelObstacles::of(drawn);
    let mut labels = Vec::new();
    for placed in &drawn.marks {
        let Some(text) = &placed.mark.label else { continue };
        let width = ADVANCE * text.chars().count() as f64;
        let gap = RADIUS + if placed.mark.ringed { 8.0 } else { 4.0 };
        let extent = |(x, y, anchor): (f64, f64, &str)| {
            let start = match anchor {
                "start" => x,
                "end" => x - width,
                _ => x - width / 2.0,
            };
            [start, y, start + width, y + LINE]
        };
        let cost = |(rank, place): (usize, (f64, f64, &str))| {
            let extent = extent(place);
            let outside = extent[0] < left || extent[2] > right || extent[1] < top || extent[3] > bottom;
            // Among places that are as good the first.
            obstacles.hidden(&extent) + rank as f64 + if outside { 1e5 } else { 0.0 }
        };
        let places = places(placed, gap).into_iter().enumerate();
        if let Some((_, best)) = places.min_by(|a, b| cost(*a).total_cmp(&cost(*b))) {
            obstacles.0.push((extent(best), 10.0));
            labels.push((best.0, best.1 + LINE - 3.0, best.2, text.clone()));
        }
    }
    labels
}

/// Returns the places that the label of a mark may have: its left end, middle or right end, and its upper edge. The best first.
fn places(placed: &PlacedMark, gap: f64) -> [(f64, f64, &'static str); 12] {
    let (x, y, aside) = (placed.x, placed.y, 0.7 * gap);
    let (above, level, below) = (y - gap - LINE, y - LINE / 2.0, y + gap);
    [
        (x + gap, level, "start"),
        (x + aside, above + 2.0, "start"),
        (x + aside, below - 2.0, "start"),
        (x, above, "middle"),
        (x, below, "middle"),
        (x - gap, level, "end"),
        (x - aside, above + 2.0, "end"),
        (x - aside, below - 2.0, "end"),
        (x, below + LINE, "middle"),
        (x, above - LINE, "middle"),
        (x, below + 2.0 * LINE, "middle"),
        (x, above - 2.0 * LINE, "middle"),
    ]
}
