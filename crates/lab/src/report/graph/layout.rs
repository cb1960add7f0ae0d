//! The layout of the drawing: time goes down, images are lanes on the right, dependencies are lines on the left.
//!
//! Each stop is a box across the middle. The dependencies that it waits for are written above it; a line leads there from the box that it waits for.

use std::fmt::Debug;

use ash::vk;

use super::model::{FrameImage, Graph, GraphStop, When};
use super::svg::{COLORS, Font, Rect, Svg, TextAnchor, wrap};
use afterlight::frame::rows::Row;
use afterlight::plan::FramePlan;

const MARGIN: f64 = 24.0;
/// The distance between the lines of dependencies.
const TRACK: f64 = 13.0;
/// The width of boxes.
const WIDTH: f64 = 620.0;
/// The distance between lanes; the longest word under a mark is `test, write`.
const LANE: f64 = 92.0;
const GAP: f64 = 14.0;
/// A box's own two lines.
const BOX: f64 = 44.0;
/// The distance between ends of arrows on the edge of a box.
const PORT: f64 = 12.0;

/// A box and the notes above it.
struct StopBox {
    at: Rect,
    notes: Vec<Note>,
}

/// The text that describes a dependency, above the box that waits.
struct Note {
    edge: usize,
    top: f64,
    lines: Vec<TextLine>,
}

struct TextLine {
    font: Font,
    class: &'static str,
    /// The distance from the left edge of boxes.
    indent: f64,
    /// Stands before the line, at the notes' own indent.
    word: &'static str,
    text: String,
}

/// The distance of notes from the left edge of boxes.
const INDENT: f64 = 14.0;

/// Draws it.
pub fn draw(title: &str, plan: &FramePlan, graph: &Graph) -> String {
    let (svg, width, height) = paint(title, plan, graph);
    svg.finish(title, width, height)
}

/// The drawing with its width and height.
pub fn paint(title: &str, plan: &FramePlan, graph: &Graph) -> (Svg, f64, f64) {
    let mut svg = Svg::default();
    let mut y = heading(&mut svg, title, plan);
    y = images(&mut svg, graph, plan, y);
    let tracks = tracks(graph);
    let left = MARGIN + TRACK * (1 + tracks.iter().max().copied().unwrap_or(0)) as f64 + 22.0;
    let lanes = left + WIDTH + 40.0;
    y = lane_names(&mut svg, graph, lanes, y);
    let placed = place(graph, left, y);
    let bottom = placed.last().map_or(y, |last| last.at.y + last.at.height);
    let right = lanes + LANE * graph.images.len() as f64;
    frames(&mut svg, graph, &placed, left);
    life_lines(&mut svg, graph, &placed, lanes, right);
    for (stop, placed) in graph.stops.iter().zip(&placed) {
        draw_stop(&mut svg, graph, stop, placed, lanes);
    }
    for (index, &track) in tracks.iter().enumerate() {
        draw_edge(&mut svg, graph, index, &placed, left - 22.0 - TRACK * track as f64);
    }
    (svg, right.max(MARGIN + TABLE) + MARGIN, bottom + MARGIN)
}

fn heading(svg: &mut Svg, title: &str, plan: &FramePlan) -> f64 {
    let mut y = MARGIN + 10.0;
    let [width, height] = plan.size;
    svg.text(Font::Title, "", (MARGIN, y), TextAnchor::Start, &format!("A frame of {title}, {width}x{height}"));
    y += 10.0;
    let mut legend = vec![
        "Time goes down. A box is a subpass or another pass; a frame around boxes is a render pass. Lanes on the right are images: a full dot writes, a ring reads; numbers are the shader's.",
        "A line on the left is a dependency: what is named after \"after\" must be over before what is named after \"before\" begins. Dashed: by region, each pixel waits only for itself.",
    ];
    if plan.lazily_allocated {
        legend.push("What is dropped lives in tile memory alone.");
    }
    for line in legend.into_iter().flat_map(|line| wrap(Font::Prose, line, TABLE)) {
        y += Font::Prose.line();
        svg.text(Font::Prose, "faint", (MARGIN, y), TextAnchor::Start, &line);
    }
    y + 30.0
}

/// Columns of the table of images, and their widths.
const COLUMNS: [(&str, f64); 8] = [
    ("image", 100.0),
    ("format", 230.0),
    ("samples", 80.0),
    ("bytes a pixel", 110.0),
    ("bytes", 90.0),
    ("load", 90.0),
    ("store", 90.0),
    ("layout: at first -> after the pass", 480.0),
];

/// The width of the table of images, and of the sentences above it.
const TABLE: f64 = 1270.0;

fn images(svg: &mut Svg, graph: &Graph, plan: &FramePlan, mut y: f64) -> f64 {
    let row = |svg: &mut Svg, font: Font, class: &str, cells: [String; 8], y: f64| {
        let mut x = MARGIN;
        for (cell, (_, width)) in cells.iter().zip(COLUMNS) {
            svg.text(font, class, (x, y), TextAnchor::Start, cell);
            x += width;
        }
    };
    row(svg, Font::Prose, "faint", COLUMNS.map(|(name, _)| name.to_owned()), y);
    for image in &graph.images {
        y += Font::Code.line() + 2.0;
        svg.open("image", &image.name);
        row(svg, Font::Code, "", cells(image, plan), y);
        svg.close();
    }
    let per_pixel: u32 = graph.images.iter().filter_map(|image| image.bytes_per_pixel).sum();
    let bytes: u64 = graph.images.iter().map(|image| image.bytes).sum();
    y += Font::Code.line() + 2.0;
    let sums = ["all", "", "", &per_pixel.to_string(), &mebibytes(bytes), "", "", ""].map(str::to_owned);
    row(svg, Font::Code, "faint", sums, y);
    y + 40.0
}

fn cells(image: &FrameImage, plan: &FramePlan) -> [String; 8] {
    let (load, store, layouts) = match image.attachment {
        Some(attachment) => (
            words(&attachment.load_op),
            words(&attachment.store_op),
            format!("{} -> {}", words(&attachment.initial_layout), words(&attachment.final_layout)),
        ),
        None => ("-".into(), "-".into(), "no attachment: a storage image".into()),
    };
    let per_pixel = match (image.bytes_per_pixel, &plan.shadow) {
        (Some(bytes), _) => bytes.to_string(),
        (None, Some(shadow)) => format!("{}x{}x{}", shadow.size, shadow.size, shadow.layers),
        (None, None) => "-".into(),
    };
    let samples = image.samples.to_string();
    [image.name.clone(), words(&image.format), samples, per_pixel, mebibytes(image.bytes), load, store, layouts]
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

/// A value of Vulkan by its own name.
fn words(value: &impl Debug) -> String {
    format!("{value:?}")
}

fn lane_names(svg: &mut Svg, graph: &Graph, lanes: f64, y: f64) -> f64 {
    for (image, index) in graph.images.iter().zip(0..) {
        svg.text(Font::Prose, "", (lanes + LANE * f64::from(index) - 4.0, y), TextAnchor::Start, &image.name);
    }
    y + 16.0
}

/// A track for each dependency, 0 being next to the boxes: short ones first, and no two that share a height.
fn tracks(graph: &Graph) -> Vec<usize> {
    let mut order: Vec<usize> = (0..graph.edges.len()).collect();
    let span = |index: usize| {
        let [from, to] = graph.edges[index].1;
        (from.min(to), from.max(to))
    };
    order.sort_by_key(|&index| (span(index).1 - span(index).0, span(index)));
    let mut taken: Vec<Vec<(usize, usize)>> = Vec::new();
    let mut tracks = vec![0; order.len()];
    for index in order {
        let (first, last) = span(index);
        let free = |track: &Vec<(usize, usize)>| track.iter().all(|&(from, to)| last < from || to < first);
        let track = taken.iter().position(free).unwrap_or_else(|| {
            taken.push(Vec::new());
            taken.len() - 1
        });
        taken[track].push((first, last));
        tracks[index] = track;
    }
    tracks
}

fn note_lines(row: &Row) -> Vec<TextLine> {
    let masks = INDENT + Font::Code.width("before ");
    let region = row.region();
    let head = format!("{}: {} -> {}{region}", row.name, row.from, row.to);
    let mut lines = vec![TextLine { font: Font::Name, class: "", indent: INDENT, word: "", text: head }];
    let mut add = |font: Font, class, indent: f64, word, text: &str| {
        let wrapped = wrap(font, text, WIDTH - indent - 10.0).into_iter().enumerate();
        lines.extend(wrapped.map(|(index, text)| {
            let word = if index == 0 { word } else { "" };
            TextLine { font, class, indent, word, text }
        }));
    };
    add(Font::Prose, "", INDENT, "", &row.why);
    for (word, side) in [("after", row.before), ("before", row.after)] {
        let (stages, access) = (side.stages(), or_none(side.accesses()));
        let both = format!("{stages}: {access}");
        if masks + Font::Code.width(&both) + 10.0 < WIDTH {
            add(Font::Code, "", masks, word, &both);
        } else {
            add(Font::Code, "", masks, word, &format!("{stages}:"));
            add(Font::Code, "faint", masks, "", &access);
        }
    }
    // A dependency of a render pass stands in that pass's frame.
    if !row.carrier.is_render_pass() {
        add(Font::Code, "", masks, "by", &row.carrier.to_string());
    }
    lines
}

/// The accesses of a side, or `no access`.
fn or_none(text: String) -> String {
    if text.is_empty() { "no access".into() } else { text }
}

fn place(graph: &Graph, left: f64, mut y: f64) -> Vec<StopBox> {
    let mut placed = Vec::new();
    for (index, stop) in graph.stops.iter().enumerate() {
        let previous = index.checked_sub(1).and_then(|index| graph.stops[index].pass);
        // Room for the frame of a pass that ends here, and the name of one that begins.
        y += if previous.is_some() && previous != stop.pass { GAP } else { 0.0 };
        y += if stop.pass.is_some() && previous != stop.pass { 30.0 } else { 0.0 };
        let mut notes = Vec::new();
        for (edge, (row, [_, to])) in graph.edges.iter().enumerate() {
            if *to == index {
                let lines = note_lines(row);
                let height: f64 = lines.iter().map(|line| line.font.line()).sum();
                notes.push(Note { edge, top: y, lines });
                y += height + 10.0;
            }
        }
        let ends = graph.edges.iter().filter(|(_, ends)| ends.contains(&index)).count();
        let words = lane_words(graph, stop, index).iter().map(|(_, words)| words.len()).max().unwrap_or(0);
        let height = BOX.max(PORT * (ends + 1) as f64).max(10.0 + Font::Code.line() * words as f64);
        placed.push(StopBox { at: Rect { x: left, y, width: WIDTH, height }, notes });
        y += height + GAP;
    }
    placed
}

/// The words under the marks of a stop, by image: the stop's uses of it, and the render pass's load before the first use and store after the last.
fn lane_words(graph: &Graph, stop: &GraphStop, index: usize) -> Vec<(usize, Vec<String>)> {
    let mut words: Vec<(usize, Vec<String>)> = Vec::new();
    for touch in &stop.touches {
        match words.iter_mut().find(|(image, _)| *image == touch.image) {
            Some((_, words)) => words.push(touch.how.clone()),
            None => words.push((touch.image, vec![touch.how.clone()])),
        }
    }
    for (image, words) in &mut words {
        let in_pass = |other: &GraphStop| other.touches.iter().any(|touch| touch.image == *image && touch.attached);
        let Some(attachment) = graph.images[*image].attachment else { continue };
        if graph.stops.iter().position(in_pass) == Some(index) {
            words.insert(
                0,
                match attachment.load_op {
                    vk::AttachmentLoadOp::CLEAR => "cleared".into(),
                    vk::AttachmentLoadOp::LOAD => "loaded".into(),
                    _ => "not loaded".into(),
                },
            );
        }
        if graph.stops.iter().rposition(in_pass) == Some(index) {
            words.push(if attachment.store_op == vk::AttachmentStoreOp::STORE { "stored" } else { "dropped" }.into());
        }
    }
    words
}

fn frames(svg: &mut Svg, graph: &Graph, placed: &[StopBox], left: f64) {
    let mut index = 0;
    for stops in graph.stops.chunk_by(|one, next| one.pass == next.pass) {
        let (first, last) = (&placed[index], &placed[index + stops.len() - 1]);
        index += stops.len();
        let Some(pass) = stops[0].pass else { continue };
        let top = first.notes.first().map_or(first.at.y, |note| note.top) - 30.0;
        let height = last.at.y + last.at.height + 10.0 - top;
        svg.open("pass", pass);
        svg.rectangle("pass", Rect { x: left - 10.0, y: top, width: WIDTH + 20.0, height }, 8.0);
        svg.text(Font::Name, "faint", (left + WIDTH, top + 12.0), TextAnchor::End, &format!("render pass: {pass}"));
        svg.close();
    }
}

/// A lane from the first use of each image to its last, and a band across all lanes at each box.
fn life_lines(svg: &mut Svg, graph: &Graph, placed: &[StopBox], lanes: f64, right: f64) {
    for (_, placed) in graph.stops.iter().zip(placed).filter(|(stop, _)| !stop.touches.is_empty()) {
        let (x, at) = (placed.at.x + placed.at.width + 12.0, placed.at);
        svg.rectangle("row", Rect { x, width: right - x, ..at }, 4.0);
    }
    for image in 0..graph.images.len() {
        let Some((first, last)) = graph.life(image) else { continue };
        let x = lanes + LANE * image as f64;
        svg.polyline("lane", &[(x, mark(&placed[first])), (x, mark(&placed[last]))]);
    }
}

/// Returns the height at which a box has its marks.
fn mark(placed: &StopBox) -> f64 {
    placed.at.y + 12.0
}

fn draw_stop(svg: &mut Svg, graph: &Graph, stop: &GraphStop, placed: &StopBox, lanes: f64) {
    let at = placed.at;
    let index = graph.stops.iter().position(|own| own == stop).unwrap_or(0);
    svg.open(if stop.pass.is_some() { "subpass" } else { "stop" }, &stop.name);
    let class = if stop.when == When::During { "box" } else { "outside" };
    svg.rectangle(class, at, 5.0);
    let middle = at.y + at.height / 2.0;
    svg.text(Font::Name, "", (at.x + 18.0, middle - 8.0), TextAnchor::Start, &stop.name);
    svg.text(Font::Prose, "faint", (at.x + 18.0, middle + 9.0), TextAnchor::Start, stop.what);
    for (image, words) in lane_words(graph, stop, index) {
        let x = lanes + LANE * image as f64;
        let writes = stop.touches.iter().any(|touch| touch.image == image && touch.writes);
        svg.circle(if writes { "write" } else { "read" }, x, mark(placed), 4.5);
        for (word, line) in words.iter().zip(0..) {
            let y = mark(placed) + Font::Code.line() * f64::from(line);
            svg.text(Font::Code, "", (x + 10.0, y), TextAnchor::Start, word);
        }
    }
    svg.close();
}

/// Returns the height at which an edge meets a box: arriving edges are above leaving ones.
fn port(graph: &Graph, edge: usize, stop: usize, placed: &StopBox) -> f64 {
    let arriving = graph.edges.iter().enumerate().filter(|(_, (_, [_, to]))| *to == stop);
    let leaving = graph.edges.iter().enumerate().filter(|(_, (_, [from, _]))| *from == stop);
    let ends: Vec<usize> = arriving.chain(leaving).map(|(index, _)| index).collect();
    let place = ends.iter().position(|&own| own == edge).unwrap_or(0);
    placed.at.y + placed.at.height * (place + 1) as f64 / (ends.len() + 1) as f64
}

fn draw_edge(svg: &mut Svg, graph: &Graph, index: usize, placed: &[StopBox], x: f64) {
    let (edge, [from, to]) = &graph.edges[index];
    let color = format!("c{}", index % COLORS);
    let line = format!("edge {color}{}", if edge.by_region { " by-region" } else { "" });
    let left = placed[*to].at.x;
    let (start, end) = (port(graph, index, *from, &placed[*from]), port(graph, index, *to, &placed[*to]));
    let layouts = graph.layouts[index].iter().map(|change| format!("; {change}"));
    svg.open("dependency", edge.name.name()).tooltip(&format!("{}{}", edge.why, layouts.collect::<String>()));
    // By its text, which stands above the box; of a place that waits for itself, too.
    let text =
        placed[*to].notes.iter().find(|note| note.edge == index).map_or(end, |note| note.top + Font::Name.line() / 2.0);
    svg.polyline(&line, &[(left, start), (x, start), (x, text), (x, end), (left - 8.0, end)]);
    svg.circle(&color, left, start, 3.0);
    svg.arrow_head(&color, left, end);
    for note in placed[*to].notes.iter().filter(|note| note.edge == index) {
        let mut y = note.top;
        for (position, line) in note.lines.iter().enumerate() {
            let middle = y + line.font.line() / 2.0;
            if position == 0 {
                svg.polyline(&format!("edge {color}"), &[(x, middle), (left + 8.0, middle)]);
                svg.circle(&color, x, middle, 3.0);
            }
            let class = if position == 0 { color.as_str() } else { line.class };
            svg.text(line.font, "faint", (left + INDENT, middle), TextAnchor::Start, line.word);
            svg.text(line.font, class, (left + line.indent, middle), TextAnchor::Start, &line.text);
            y += line.font.line();
        }
    }
    svg.close();
}
