//! The text of a listing, command by command.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use afterlight::gpu::barrier::Half;
use afterlight::gpu::{Arguments, Barrier, Command};
use afterlight_lab::report::commands::{ActingRow, Attachment, ExplainedCommand, is_structure};

use super::super::inspect::flags;
use super::super::table::TextTable;

/// Commands of one kind that were recorded under one pipeline.
struct CommandGroup<'a> {
    /// The pipeline that was bound between the last command of structure and this one.
    pipeline: Option<&'a str>,
    /// The first of them.
    command: &'a Command,
    count: usize,
}

/// The lines of a listing in blocks, each of which is a command, or several of one kind, with all that is printed below it.
pub struct Blocks<'a> {
    blocks: Vec<String>,
    /// Labels and render passes that are open.
    depth: usize,
    counted: Vec<CommandGroup<'a>>,
    pipeline: Option<&'a str>,
    /// Rows that are printed whole above.
    seen: BTreeSet<&'a str>,
}

/// A sequence of more blocks than this is not looked for again.
const LONGEST_REPEAT: usize = 8;

impl<'a> Blocks<'a> {
    pub fn of(lines: &'a [ExplainedCommand]) -> Self {
        let mut own = Self { blocks: Vec::new(), depth: 0, counted: Vec::new(), pipeline: None, seen: BTreeSet::new() };
        let mut command_buffer = None;
        for line in lines {
            if command_buffer != Some(&line.command.command_buffer) {
                command_buffer = Some(&line.command.command_buffer);
                own.flush();
                own.blocks.push(format!("\n{}\n", line.command.command_buffer));
            }
            match is_structure(&line.command) {
                true => {
                    own.flush();
                    own.structure(line);
                }
                false => own.count(&line.command),
            }
        }
        own.flush();
        own
    }

    /// All blocks. A sequence that is repeated is printed once, with the number of its repeats.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let mut rest = &self.blocks[..];
        while !rest.is_empty() {
            let (length, repeats) = first_repeat(rest);
            rest[..length].iter().for_each(|block| text.push_str(block));
            if repeats > 1 {
                let indent = rest[0].len() - rest[0].trim_start().len();
                let steps = if length == 1 { "this".to_owned() } else { format!("these {length} steps") };
                let _ = writeln!(text, "{:indent$}({steps}: {repeats} times in all)", "");
            }
            rest = &rest[length * repeats..];
        }
        text
    }

    fn structure(&mut self, line: &'a ExplainedCommand) {
        let arguments = &line.command.arguments;
        let name = line.command.name;
        match name {
            "vkCmdBeginDebugUtilsLabelEXT" => {
                let colon = if line.reason.is_empty() { "" } else { ": " };
                self.block(format!("{}{colon}{}", arguments.objects.join(""), line.reason), "");
                self.depth += 1;
            }
            "vkCmdEndDebugUtilsLabelEXT" => self.depth = self.depth.saturating_sub(1),
            "vkCmdPipelineBarrier" | "vkCmdPipelineBarrier2" => {
                if let Some(barrier) = &arguments.barrier {
                    let below = self.barrier(barrier, &line.reason);
                    self.block(format!("{name}  {}", barrier.row), &below);
                }
            }
            _ => {
                let (ends, begins) = (!name.contains("Begin"), !name.contains("End"));
                self.depth = self.depth.saturating_sub(usize::from(ends));
                let mut below = attachments(&line.attachments);
                line.dependencies.iter().for_each(|acting| below.push_str(&self.dependency(acting)));
                let objects = arguments.objects.join(", ");
                self.block(format!("{name}  {objects}"), &below);
                self.depth += usize::from(begins);
            }
        }
    }

    /// A line, and the lines below it, which are indented under it.
    fn block(&mut self, line: impl AsRef<str>, below: &str) {
        let indent = 2 * (self.depth + 1);
        let mut block = format!("{:indent$}{}\n", "", line.as_ref().trim_end());
        for line in below.lines() {
            let _ = writeln!(block, "{:indent$}{line}", "");
        }
        self.blocks.push(block);
    }

    fn barrier(&mut self, barrier: &'a Barrier, why: &str) -> String {
        let mut text = String::new();
        if let Some((half, [from, to])) = barrier.handed {
            // Each half of a row has separate masks.
            let _ = match half {
                Half::Release => writeln!(text, "    release: the {} gives it to the {}", from.name(), to.name()),
                Half::Acquire => writeln!(text, "    acquire: the {} takes it from the {}", to.name(), from.name()),
            };
        } else if !barrier.row.is_empty() && !self.seen.insert(barrier.row) {
            return text;
        }
        // All parts of a row have its accesses.
        let both = barrier.parts.first().map(|part| [flags(&part.src_access), flags(&part.dst_access)]);
        let [before, after] = both.unwrap_or_default();
        text.push_str(&masks([(flags(&barrier.src_stages), before), (flags(&barrier.dst_stages), after)]));
        for part in &barrier.parts {
            let object = part.object.as_deref().unwrap_or("all memory");
            let _ = match part.layouts {
                Some([old, new]) => writeln!(text, "    on: {object}, {old:?} -> {new:?}"),
                None => writeln!(text, "    on: {object}"),
            };
        }
        if !why.is_empty() {
            let _ = writeln!(text, "    why: {why}");
        }
        text
    }

    fn dependency(&mut self, ActingRow { row, layouts }: &'a ActingRow) -> String {
        let mut text = format!("  {}: {} -> {}{}\n", row.name, row.from, row.to, row.region());
        if !self.seen.insert(row.name.name()) {
            return text;
        }
        let side = |uses: afterlight::gpu::sync::Use| (flags(&uses.stage), flags(&uses.access));
        text.push_str(&masks([side(row.before), side(row.after)]));
        for change in layouts {
            let _ = writeln!(text, "    layout: {change}");
        }
        let _ = writeln!(text, "    why: {}", row.why);
        text
    }

    fn count(&mut self, command: &'a Command) {
        if command.name == "vkCmdBindPipeline" {
            self.pipeline = command.arguments.objects.first().map(String::as_str);
        }
        let pipeline = self.pipeline;
        let own = |counted: &&mut CommandGroup| counted.command.name == command.name && counted.pipeline == pipeline;
        match self.counted.iter_mut().find(own) {
            Some(counted) => counted.count += 1,
            None => self.counted.push(CommandGroup { pipeline, command, count: 1 }),
        }
    }

    /// Prints the counted commands, each pipeline above the commands that were recorded with it.
    fn flush(&mut self) {
        let mut counted = std::mem::take(&mut self.counted);
        self.pipeline = None;
        let order: Vec<_> = counted.iter().map(|own| own.pipeline).collect();
        counted.sort_by_key(|own| order.iter().position(|pipeline| *pipeline == own.pipeline));
        for CommandGroup { pipeline, command, count } in counted {
            let is_bind = command.name == "vkCmdBindPipeline";
            let what = match count {
                1 => said(command),
                _ if is_bind => format!("{}  x{count}", said(command)),
                _ => format!("x{count}"),
            };
            let indent = if pipeline.is_some() && !is_bind { "  " } else { "" };
            self.block(format!("{indent}{}  {what}", command.name), "");
        }
    }
}

/// The length of the shortest sequence at the front that is repeated, and the number of its repeats; 1 and 1 if nothing is repeated.
fn first_repeat(blocks: &[String]) -> (usize, usize) {
    let repeats = |length: usize| {
        let first = &blocks[..length];
        blocks.chunks(length).take_while(|next| *next == first).count()
    };
    let lengths = 1..=LONGEST_REPEAT.min(blocks.len());
    let found = lengths.map(|length| (length, repeats(length))).find(|&(_, repeats)| repeats > 1);
    found.unwrap_or((1, 1))
}

/// Both sides of a row, as `inspect` prints them.
fn masks([before, after]: [(String, String); 2]) -> String {
    let mut table = TextTable::new();
    table.row(["  after ".to_owned(), before.0, before.1]);
    table.row(["  before".to_owned(), after.0, after.1]);
    table.render()
}

fn attachments(attachments: &[Attachment]) -> String {
    let mut table = TextTable::new();
    for Attachment { name, description: own } in attachments {
        let samples = own.samples.as_raw();
        let format = if samples > 1 { format!("{:?} x{samples}", own.format) } else { format!("{:?}", own.format) };
        let operations = format!("{:?} .. {:?}", own.load_op, own.store_op);
        let layouts = match own.initial_layout == own.final_layout {
            true => format!("{:?}", own.final_layout),
            false => format!("{:?} -> {:?}", own.initial_layout, own.final_layout),
        };
        table.row([name.clone(), format, operations, layouts]);
    }
    table.render()
}

/// The arguments of a command in words.
fn said(Command { name, arguments, .. }: &Command) -> String {
    let Arguments { objects, numbers, .. } = arguments;
    let objects = objects.join(", ");
    match (*name, &numbers[..]) {
        ("vkCmdDraw", [vertices, instances, ..]) => format!("{vertices} vertices{}", times(*instances)),
        ("vkCmdDrawIndexed", [indices, instances, ..]) => format!("{indices} indices{}", times(*instances)),
        ("vkCmdDrawIndexedIndirect", [_, draws, _]) => format!("{draws} draws from {objects}"),
        ("vkCmdDispatch", [x, y, z]) => format!("{x} x {y} x {z} groups"),
        ("vkCmdBindDescriptorSets", [first]) => format!("{objects} from set {first} on"),
        ("vkCmdPushConstants", [_, bytes]) => format!("{bytes} bytes"),
        ("vkCmdSetViewport" | "vkCmdSetScissor", [x, y, width, height]) => format!("{width}x{height} at {x},{y}"),
        ("vkCmdWriteTimestamp" | "vkCmdWriteTimestamp2", [query]) => format!("query {query} of {objects}"),
        ("vkCmdBindPipeline", _) => without_false(&objects),
        (name, _) if name.contains("Copy") || name.contains("Blit") => arguments.objects.join(" -> "),
        _ => objects,
    }
}

/// A pipeline's name without the fields of its key that are false, and without structures that have no other field.
fn without_false(name: &str) -> String {
    let mut kept: Vec<&str> = Vec::new();
    for word in name.split(' ') {
        match word {
            // The word before it is the field.
            "false" | "false," => _ = kept.pop(),
            "}" | "}," if kept.last() == Some(&"{") => {
                let has_field = kept.iter().rev().nth(2).is_some_and(|field| field.ends_with(':'));
                kept.truncate(kept.len().saturating_sub(if has_field { 3 } else { 2 }));
            }
            "}" | "}," => {
                if let Some(last) = kept.last_mut() {
                    *last = last.trim_end_matches(',');
                }
                kept.push(word);
            }
            _ => kept.push(word),
        }
    }
    kept.join(" ")
}

fn times(instances: i64) -> String {
    if instances == 1 { String::new() } else { format!(", {instances} instances") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipelines_name_has_no_field_that_is_false() {
        assert_eq!(without_false("lighting"), "lighting");
        assert_eq!(without_false("shadow Key { masked: false, clamps: true }"), "shadow Key { clamps: true }");
        assert_eq!(without_false("shadow Key { masked: true, clamps: false }"), "shadow Key { masked: true }");
        let nested = "shadow Key { extras: Extras { colors: false, cells: false }, textures: Mask(3) }";
        assert_eq!(without_false(nested), "shadow Key { textures: Mask(3) }");
        assert_eq!(without_false("shadow Key { extras: Extras { colors: false } }"), "shadow");
    }

    #[test]
    fn repeated_blocks_are_found_by_their_shortest_sequence() {
        let blocks = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(first_repeat(&blocks("a b c")), (1, 1));
        assert_eq!(first_repeat(&blocks("a a a b")), (1, 3));
        assert_eq!(first_repeat(&blocks("a b a b a c")), (2, 2));
    }
}
