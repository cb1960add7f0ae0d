//! `afterlight check-row`: passes and rows that somebody wrote down, judged by the proof. No Vulkan.

use std::fmt::Write as _;
use std::io::{self, Read as _};
use std::path::PathBuf;

use afterlight::frame::rows::{RowPart, SUPPORTED, Side, masks};
use afterlight::gpu::sync::Use;
use afterlight::gpu::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};
use afterlight::scene::counted;
use afterlight_files::regular_file::read_given;
use afterlight_proof::in_words;
use afterlight_proof::sequence::{Sequence, SequenceRow, SequenceStep, SequenceUse, Superfluous};
use serde::Deserialize;
use toml::Spanned;

use super::failure::{Exit, Failure};
use super::output;

/// The most bytes of a file: exercises have a few hundred.
const MOST_BYTES: u64 = 1 << 20;

/// The most frames: each costs time, and the third finds nothing that the second does not.
const MOST_FRAMES: usize = 8;

/// The most steps: the search for parts that can be left out judges the whole file again for each of them.
const MOST_STEPS: usize = 64;

/// Judge rows that you wrote: which hazards they leave, and what of them is more than needed
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file has the steps of a frame in their order, passes and rows:

  [[step]]
  pass = \"GEOMETRY\"
  uses = [{ of = \"albedo\", stage = \"COLOR_ATTACHMENT_OUTPUT\", access = \"COLOR_ATTACHMENT_WRITE\", layout = \"COLOR_ATTACHMENT_OPTIMAL\" }]

  [[step]]
  row = \"geometry-to-lighting\"
  of = [\"albedo\"]
  before = { stage = \"COLOR_ATTACHMENT_OUTPUT\", access = \"COLOR_ATTACHMENT_WRITE\" }
  after = { stage = \"FRAGMENT_SHADER\", access = \"SHADER_READ\" }
  layouts = [\"COLOR_ATTACHMENT_OPTIMAL\", \"SHADER_READ_ONLY_OPTIMAL\"]

Examples:
  afterlight check-row exercise.toml
  afterlight check-row two-frames.toml")]
pub struct Args {
    /// The steps, as TOML (docs/COMMANDS.md has the keys); - is standard input
    file: PathBuf,
}

/// A file of steps.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default = "one")]
    frames: Spanned<usize>,
    step: Vec<Spanned<Step>>,
}

fn one() -> Spanned<usize> {
    Spanned::new(0..0, 1)
}

/// A pass or a row, as a file has it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    pass: Option<String>,
    #[serde(default)]
    uses: Vec<UseEntry>,
    render_pass: Option<u32>,
    row: Option<String>,
    of: Option<Vec<String>>,
    before: Option<Mask>,
    after: Option<Mask>,
    layouts: Option<[String; 2]>,
    #[serde(default)]
    by_region: bool,
}

/// A use, as a file has it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct UseEntry {
    of: String,
    stage: String,
    access: String,
    layout: Option<String>,
    #[serde(default)]
    own_pixel: bool,
}

/// Stages and accesses, as a file has them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mask {
    stage: String,
    #[serde(default)]
    access: String,
}

/// Checks the rows of a file.
///
/// # Errors
/// When the file cannot be read or understood, or its rows leave a hazard or order more than they need to.
pub fn run(args: &Args) -> Result<(), Failure> {
    let name = args.file.display().to_string();
    let bytes = match args.file.to_str() {
        Some("-") => read_stdin(),
        _ => read_given(&args.file, MOST_BYTES),
    };
    let bytes = bytes.map_err(|error| Failure::new(Exit::BadInput, format!("cannot read {name}: {error}")))?;
    let text = String::from_utf8(bytes)
        .map_err(|error| Failure::new(Exit::BadInput, format!("{name}: {}", error.utf8_error())))?;
    let sequence = parse(&text)
        .map_err(|(offset, why)| Failure::new(Exit::BadInput, format!("{name}:{}: {why}", line_of(&text, offset))))?;
    let (hazards, superfluous) = (sequence.hazards(), sequence.superfluous());
    let mut report = String::new();
    if !hazards.is_empty() {
        let _ = writeln!(report, "What may go wrong:");
        for line in in_words(hazards.iter().map(|hazard| &hazard.consequence)) {
            let _ = writeln!(report, "  {line}");
        }
        let _ = writeln!(report, "What is missing:");
        for hazard in &hazards {
            let _ = writeln!(report, "  {hazard}");
        }
    }
    if !superfluous.is_empty() {
        let _ = writeln!(report, "What is more than needed:");
        for own in &superfluous {
            let _ = writeln!(report, "  {}", in_a_line(own));
        }
    }
    let discarded = sequence.discarded();
    if !discarded.is_empty() {
        let _ = writeln!(report, "What is discarded:");
        for [row, image, pass] in &discarded {
            let _ = writeln!(
                report,
                "  {pass} reads {image}, whose contents the row {row} discards: it changes the layout from UNDEFINED"
            );
        }
    }
    if report.is_empty() {
        report = "The rows order all that must be ordered, and nothing more\n".into();
    }
    output::write_stdout(report.as_bytes())?;
    match (hazards.len() + discarded.len(), superfluous.len()) {
        (0, 0) => Ok(()),
        (0, 1) => Err(Failure::new(Exit::FailedCheck, "1 part of the rows can be left out")),
        (0, count) => {
            let why = format!("{count} parts of the rows can be left out, each while the others stay");
            Err(Failure::new(Exit::FailedCheck, why))
        }
        (count, _) => Err(Failure::new(Exit::FailedCheck, format!("the rows leave {}", counted(count, "fault")))),
    }
}

/// The line of a place in a text, from 1.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

fn read_stdin() -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    io::stdin().lock().take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > MOST_BYTES {
        true => Err(io::Error::other(format!("it has more than {MOST_BYTES} bytes"))),
        false => Ok(bytes),
    }
}

fn in_a_line(own: &Superfluous) -> String {
    match own.part {
        RowPart::Bits(side, bits) => {
            let side = if side == Side::Before { "before" } else { "after" };
            let name = if bits.access.is_empty() { bits.stages() } else { bits.accesses() };
            format!("{}: {name} {side} it", own.row)
        }
        RowPart::Row | RowPart::AcrossSamples => format!("{}: all of it", own.row),
    }
}

/// The steps of a file. The error is a place in the text and what is wrong there.
fn parse(text: &str) -> Result<Sequence, (usize, String)> {
    let file: File = toml::from_str(text).map_err(|error| {
        let why = error.message().lines().collect::<Vec<_>>().join(", ");
        (error.span().map_or(0, |span| span.start), why)
    })?;
    let frames = *file.frames.get_ref();
    if !(1..=MOST_FRAMES).contains(&frames) {
        return Err((file.frames.span().start, format!("frames are 1 to {MOST_FRAMES}, and not {frames}")));
    }
    if let Some(more) = file.step.get(MOST_STEPS) {
        let why = format!("a file has at most {MOST_STEPS} steps, and not {}", file.step.len());
        return Err((more.span().start, why));
    }
    let begins: Vec<_> = file.step.iter().map(|step| step.span().start).collect();
    let steps = file.step.into_iter().map(|step| {
        let at = step.span().start;
        step.into_inner().sequence_step().map_err(|why| (at, why))
    });
    let steps = steps.collect::<Result<Vec<_>, _>>()?;
    let used = |name: &str| {
        steps
            .iter()
            .any(|step| matches!(step, SequenceStep::Pass(_, uses, _) if uses.iter().any(|own| own.memory == name)))
    };
    let names = steps.iter().filter_map(|step| match step {
        SequenceStep::Row(row) => Some(row.memory.iter().map(|name| (row.name, *name))),
        SequenceStep::Pass(..) => None,
    });
    if let Some((row, name)) = names.flatten().find(|(_, name)| !used(name)) {
        let at = text.find(&format!("row = \"{row}\"")).unwrap_or(0);
        return Err((at, format!("the row {row} is of {name:?}, which no pass uses")));
    }
    let render_pass = |step: &SequenceStep| match step {
        SequenceStep::Pass(_, _, number) => Some(*number),
        SequenceStep::Row(_) => None,
    };
    for (index, step) in steps.iter().enumerate() {
        let SequenceStep::Row(SequenceRow { name, by_region: true, .. }) = step else { continue };
        let before = steps[..index].iter().rev().find_map(render_pass).flatten();
        let after = steps[index..].iter().find_map(render_pass).flatten();
        if before.is_none() || before != after {
            let why =
                format!("the row {name} is by region, so that it must stand between two passes of one render_pass");
            return Err((begins[index], why));
        }
    }
    Ok(Sequence { steps, frames })
}

impl Step {
    fn sequence_step(self) -> Result<SequenceStep, String> {
        match (self.pass, self.row) {
            (Some(pass), None) => {
                let of_rows =
                    self.of.is_some() || self.before.is_some() || self.after.is_some() || self.layouts.is_some();
                if of_rows || self.by_region {
                    return Err(format!("{pass} is a pass: of, before, after, layouts and by_region are of rows"));
                }
                let uses = self.uses.into_iter().map(|own| own.sequence_use(self.render_pass.is_some()));
                Ok(SequenceStep::Pass(kept(pass), uses.collect::<Result<_, _>>()?, self.render_pass))
            }
            (None, Some(row)) => {
                if !self.uses.is_empty() || self.render_pass.is_some() {
                    return Err(format!("{row} is a row: uses and render_pass are of passes"));
                }
                let mask = |mask: Option<Mask>, side| {
                    let mask = mask.ok_or_else(|| format!("the row {row} lacks its stages and accesses {side}"))?;
                    Ok::<_, String>(Use::new(stages(&mask.stage)?, accesses(&mask.access)?))
                };
                let (before, after) = (mask(self.before, "before")?, mask(self.after, "after")?);
                let layouts = match self.layouts {
                    None => None,
                    Some(_) if self.of.is_none() => {
                        return Err(format!("the row {row} changes layouts, so `of` must name its images"));
                    }
                    Some([from, to]) => Some([layout(&from)?, layout(&to)?]),
                };
                let of = self.of.unwrap_or_else(|| vec![String::new()]);
                if of.is_empty() {
                    return Err(format!("`of` of the row {row} is empty: leave it out for all memory"));
                }
                if let Some(twice) = (1..of.len()).find(|&at| of[..at].contains(&of[at])) {
                    return Err(format!("the row {row} names {:?} twice", of[twice]));
                }
                let memory = of.into_iter().filter(|name| !name.is_empty()).map(kept).collect();
                let name = kept(row);
                Ok(SequenceStep::Row(SequenceRow { name, memory, before, after, layouts, by_region: self.by_region }))
            }
            _ => Err("a step is a pass or a row: it has one of the keys `pass` and `row`".into()),
        }
    }
}

impl UseEntry {
    fn sequence_use(self, in_render_pass: bool) -> Result<SequenceUse, String> {
        if self.own_pixel && !in_render_pass {
            return Err(format!(
                "own_pixel of {:?} needs a render_pass: regions are those of its attachments",
                self.of
            ));
        }
        let layout = self.layout.as_deref().map_or(Ok(ImageLayout::UNDEFINED), layout)?;
        let uses = Use::new(stages(&self.stage)?, accesses(&self.access)?);
        if uses.access.is_empty() {
            return Err(format!("the use of {:?} has no access, so that it reads and writes nothing", self.of));
        }
        // The proof takes each stage with each access that it supports: what fits nothing would be no use at all.
        let is_known = |bit: &Use| {
            SUPPORTED.iter().any(|&(access, stages)| match bit.access.is_empty() {
                true => bit.stage.intersects(stages) && uses.access.contains(access),
                false => bit.access == access && uses.stage.intersects(stages),
            })
        };
        if let Some(bit) = masks::bits(uses).find(|bit| !is_known(bit)) {
            let name = if bit.access.is_empty() { bit.stages() } else { bit.accesses() };
            return Err(format!(
                "the use of {:?} has {name}, which fits no other part of it, or is unknown to the proof",
                self.of
            ));
        }
        Ok(SequenceUse { memory: kept(self.of), uses, layout, own_pixel: self.own_pixel })
    }
}

/// The proof knows passes and images by names that last as long as the program, since those of the renderer do.
fn kept(name: String) -> &'static str {
    Box::leak(name.into_boxed_str())
}

/// Stages by Vulkan's names without their prefix, with `|` between them.
fn stages(text: &str) -> Result<PipelineStageFlags2, String> {
    let bits = named(text, "stage", |raw| format!("{:?}", PipelineStageFlags2::from_raw(raw)))?;
    Ok(PipelineStageFlags2::from_raw(bits))
}

/// Accesses, as [`stages`].
fn accesses(text: &str) -> Result<AccessFlags2, String> {
    let bits = named(text, "access", |raw| format!("{:?}", AccessFlags2::from_raw(raw)))?;
    Ok(AccessFlags2::from_raw(bits))
}

/// The bits that `name` has the words of `text` for.
fn named(text: &str, kind: &str, name: impl Fn(u64) -> String) -> Result<u64, String> {
    let mut bits = 0;
    for word in text.split('|').map(str::trim).filter(|word| !word.is_empty()) {
        // The old name of the same stage.
        let own = if word == "TRANSFER" { "ALL_TRANSFER" } else { word };
        let found = (0..u64::BITS).map(|bit| 1 << bit).find(|&bit| name(bit) == own);
        bits |= found.ok_or_else(|| {
            let all: Vec<_> = (0..u64::BITS)
                .map(|bit| name(1 << bit))
                .filter(|own| is_word(own) && strsim::jaro_winkler(own, word) > 0.8)
                .collect();
            let near = all
                .iter()
                .max_by(|one, other| strsim::jaro_winkler(one, word).total_cmp(&strsim::jaro_winkler(other, word)));
            let near = near.map_or_else(String::new, |near| format!("; did you mean {near}?"));
            format!("{word:?} is no {kind} of Vulkan's, without its prefix{near}")
        })?;
    }
    Ok(bits)
}

/// Returns true for a name; bits without one are printed as numbers.
fn is_word(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_uppercase())
}

fn layout(text: &str) -> Result<ImageLayout, String> {
    const LAYOUTS: [ImageLayout; 9] = [
        ImageLayout::UNDEFINED,
        ImageLayout::GENERAL,
        ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
        ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        ImageLayout::TRANSFER_SRC_OPTIMAL,
        ImageLayout::TRANSFER_DST_OPTIMAL,
        ImageLayout::PRESENT_SRC_KHR,
    ];
    let found = LAYOUTS.into_iter().find(|own| format!("{own:?}") == text);
    found.ok_or_else(|| format!("{text:?} is none of the layouts {}", LAYOUTS.map(|own| format!("{own:?}")).join(", ")))
}

#[cfg(test)]
mod tests;
