//! `afterlight inspect`: the plan of a scene's frames and the dependencies between their passes.

use std::fmt::Write as _;

use afterlight::frame::rows::{self, Row, RowPart, Rows, Side};
use afterlight::frame::{LayoutChange, layout_changes};
use afterlight::frame::{capabilities, plan_for};
use afterlight::plan::FramePlan;
use afterlight::scene::{Output, SettingsPatch, View};
use afterlight_lab::mutants::{self, PartName, PresentPath};
use afterlight_lab::report::graph;
use afterlight_proof::covered;
use serde::Serialize;

use super::args::{DeviceArgs, SettingsArgs, samples, value};
use super::failure::Failure;
use super::motion_report::MotionReport;
use super::output::Sink;
use super::plan_report::PlanReport;
use super::table::TextTable;
use super::traffic::{self, PassTraffic};
use super::workload::Workload;
use super::{commands, drop, output, session};

/// Print what a scene's frames consist of, what is left out, and every dependency with its reason
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight inspect builtin:hall
  afterlight inspect builtin:hall --graph frame.svg
  afterlight inspect builtin:hall --hazards hazards.svg
  afterlight inspect builtin:hall --hazards row.svg --rows read-back
  afterlight inspect builtin:hall --window direct --hazards window.svg
  afterlight inspect builtin:hall --commands
  afterlight inspect sponza.obj --shadows off --gbuffer fat
  afterlight inspect scene.toml --settings tuned.toml
  afterlight inspect scene.toml --json | jq '.parts[] | select(.included)'
  afterlight inspect builtin:hall --size 320x180 --drop geometry-to-lighting
  afterlight inspect builtin:hall --size 320x180 --drop all")]
pub struct Args {
    /// The scene: a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    scene: String,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    /// Draw the frame into an .svg file as well: passes, what they draw into, and every dependency; - is standard output
    #[arg(long, value_name = "FILE", value_parser = drawing)]
    graph: Option<Sink>,
    /// Draw each dependency with the hazard that it prevents into an .svg file as well; - is standard output
    #[arg(long, value_name = "FILE", value_parser = drawing)]
    hazards: Option<Sink>,
    /// The dependencies that --hazards draws, in this order, instead of all
    #[arg(long, value_name = "DEPENDENCY,...", value_delimiter = ',')]
    rows: Vec<String>,
    /// Print the Vulkan commands of one frame instead, in their order, each with its reason: draws a real frame on the device, so it needs one
    #[arg(long, conflicts_with_all = ["graph", "hazards", "window", "drop"])]
    commands: bool,
    /// Take the frames as a window shows them, with what brings pictures into the swapchain's images: drawing or copying (direct), enlarging (enlarged),
    /// or encoding by a shader, as for images of 10 bits, from the picture (encoded) or from a copy of it (encoded-kept)
    #[arg(
        long,
        value_name = "direct|enlarged|encoded|encoded-kept",
        value_enum,
        hide_possible_values = true,
        conflicts_with = "drop"
    )]
    window: Option<InWindow>,
    /// Draw a few frames without this dependency, or without each in turn (all), and print what may go wrong, what the validation
    /// layer says of it (its own text with -v), and whether the picture changed
    #[arg(long, value_name = "DEPENDENCY|all", conflicts_with_all = ["json", "validate", "graph", "hazards"])]
    drop: Option<String>,
    /// Plan the frame of this view, as for `render`
    #[arg(long, value_name = "NAME", value_parser = value::<View>)]
    view: Option<View>,
    /// Plan the frames of a picture of this many samples, 1 to 4096, as `render` averages them [default: 1]
    #[arg(long, value_name = "N", value_parser = samples, allow_hyphen_values = true)]
    samples: Option<u32>,
    /// Plan the frames of a picture that holds linear light, as an .exr of `render`
    #[arg(long, conflicts_with_all = ["drop", "window"])]
    linear: bool,
    /// Plan frames in which clips play, as in the sequences of `render` and in a window
    #[arg(long, conflicts_with = "drop")]
    playing: bool,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// The way of pictures into a swapchain's images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum InWindow {
    Direct,
    Enlarged,
    Encoded,
    EncodedKept,
}

impl InWindow {
    fn present(self, plan: FramePlan) -> FramePlan {
        let way = match self {
            Self::Direct => PresentPath::Straight,
            Self::Enlarged => PresentPath::Enlarged,
            Self::Encoded => PresentPath::Encoded,
            Self::EncodedKept => PresentPath::EncodedKept,
        };
        mutants::presented(plan, way)
    }
}

/// The output of `--json`.
#[derive(Serialize)]
struct Inspection {
    scene: String,
    device: String,
    /// `null` for pictures that are read back.
    window: Option<InWindow>,
    size: [u32; 2],
    /// As `--camera` takes it.
    camera: String,
    /// The box around all objects, in metres; `null` without objects.
    bounds: Option<[[f64; 3]; 2]>,
    /// The scene's motion, of which the plan covers one moment; `null` where nothing moves.
    motion: Option<MotionReport>,
    gbuffer_bytes_per_pixel: u32,
    #[serde(flatten)]
    plan: PlanReport,
    /// All render passes but the shadow maps', which draw only maps that have changed.
    render_passes: Vec<PassTraffic>,
    dependencies: Vec<RowReport>,
}

#[derive(Serialize)]
pub(super) struct RowReport {
    name: &'static str,
    carrier: String,
    from: String,
    to: String,
    src_stages: String,
    src_access: String,
    dst_stages: String,
    dst_access: String,
    by_region: bool,
    across_samples: bool,
    layouts: Vec<LayoutReport>,
    /// Parts without which nothing is lost, because other rows order the same. The list of commands does not look for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    covered: Option<Vec<String>>,
    why: String,
}

#[derive(Serialize)]
struct LayoutReport {
    image: Option<String>,
    old: String,
    new: String,
}

impl RowReport {
    pub(super) fn of(row: &Row, changes: &[LayoutChange], covered: Option<&[RowPart]>) -> Self {
        let layout = |change: &LayoutChange| LayoutReport {
            image: change.image.map(|image| image.to_string()),
            old: format!("{:?}", change.old),
            new: format!("{:?}", change.new),
        };
        Self {
            name: row.name.name(),
            carrier: row.carrier.to_string(),
            from: row.from.to_string(),
            to: row.to.to_string(),
            src_stages: flags(&row.before.stage),
            src_access: flags(&row.before.access),
            dst_stages: flags(&row.after.stage),
            dst_access: flags(&row.after.access),
            by_region: row.by_region,
            across_samples: row.across_samples,
            layouts: changes.iter().map(layout).collect(),
            covered: covered.map(|parts| parts.iter().map(|part| PartName(*part).to_string()).collect()),
            why: row.why.clone(),
        }
    }
}

impl Args {
    /// The settings of this command alone. If `--samples` is not given, a picture is a single frame.
    fn variation(&self) -> SettingsPatch {
        let samples = Some(self.samples.unwrap_or(1));
        SettingsPatch { view: self.view, samples, ..SettingsPatch::default() }
    }

    /// The drawings that are asked for, by their options.
    fn drawings(&self) -> impl Iterator<Item = (&'static str, &Sink)> {
        let all = [("--graph", &self.graph), ("--hazards", &self.hazards)];
        all.into_iter().filter_map(|(option, sink)| Some((option, sink.as_ref()?)))
    }

    /// Names the files that were written, a line each.
    fn written(&self) -> String {
        let files = self.drawings().filter(|(_, sink)| !sink.is_stdout());
        files.map(|(option, sink)| format!("{option}: {sink} is written\n")).collect()
    }

    /// Finds out before the work whether the drawings can be written. Returns true if one of them takes standard output.
    fn check_drawings(&self) -> Result<bool, Failure> {
        for (option, sink) in self.drawings() {
            if sink.is_stdout() && self.json {
                return Err(Failure::usage(format!("--json takes standard output: give {option} a file")));
            }
            sink.check()?;
        }
        if let (Some(graph), Some(hazards)) = (&self.graph, &self.hazards)
            && (graph == hazards || graph.is_same(hazards))
        {
            return Err(Failure::usage(format!("--graph takes {graph}: give --hazards another file")));
        }
        Ok(self.drawings().any(|(_, sink)| sink.is_stdout()))
    }
}

/// The rows of these names, in their order; without names all of the table.
fn rows<'a>(names: &[String], plan: &FramePlan, table: &'a Rows) -> Result<Vec<&'a Row>, Failure> {
    match names {
        [] => Ok(table.iter().collect()),
        names => names.iter().map(|name| drop::row(plan, table, name)).collect(),
    }
}

/// Prints the plan.
pub fn run(args: &Args, is_verbose: bool) -> Result<(), Failure> {
    if let Some(name) = &args.drop {
        let variation = args.variation();
        return drop::run(name, &args.scene, &args.settings, &variation, &args.device, is_verbose);
    }
    if !args.rows.is_empty() && args.hazards.is_none() {
        return Err(Failure::usage("--rows needs --hazards: it chooses which dependencies that drawing has"));
    }
    let drawn_to_stdout = args.check_drawings()?;
    session::with_device(&args.device, |device| {
        let workload = match args.playing {
            true => Workload::open_moving(&args.scene, &args.settings, false)?,
            false => Workload::open_for_frames(&args.scene, &args.settings, args.view, false)?,
        };
        workload.spare(args.drawings().map(|(_, sink)| sink))?;
        let mut settings = workload.settings(&args.variation(), &device.physical)?;
        if args.linear {
            settings.output = Output::Nits;
        }
        if args.commands {
            return commands::print(&device, &workload, &settings, args.json);
        }
        let plan = plan_for(&device, &workload.scene, &settings);
        let plan = plan.map_err(|error| workload.blame(error, &device.physical, &settings))?;
        let plan = match args.window {
            Some(window) => window.present(plan),
            None => plan,
        };
        let parts = PlanReport::of(&plan, &workload.scene, &settings, &capabilities(&device.physical));
        let dependencies = rows::table(&plan);
        let layouts = |row: &Row| layout_changes(&plan, &dependencies, row);
        if let Some(sink) = &args.graph {
            sink.write(graph::draw(&workload.scene.name, &plan, &dependencies).as_bytes())?;
        }
        if let Some(sink) = &args.hazards {
            let rows = rows(&args.rows, &plan, &dependencies)?;
            sink.write(graph::draw_hazards(&workload.scene.name, &plan, &dependencies, &rows).as_bytes())?;
        }
        let motion = MotionReport::of(&workload.motion);
        if args.json {
            let bounds = workload.scene.model_bounds();
            let report = Inspection {
                scene: workload.scene.name.clone(),
                device: device.physical.name.clone(),
                window: args.window,
                size: settings.size,
                camera: workload.scene.camera.to_string(),
                bounds: (!bounds.is_empty()).then(|| [bounds.min, bounds.max].map(Into::into)),
                motion,
                gbuffer_bytes_per_pixel: plan.gbuffer_bytes_per_pixel(),
                plan: parts,
                render_passes: traffic::of(&plan, &dependencies, &device)?,
                dependencies: dependencies
                    .iter()
                    .map(|row| RowReport::of(row, &layouts(row), Some(&covered(&plan, &dependencies, row))))
                    .collect(),
            };
            output::print(&args.written(), true)?;
            return output::print(&output::json(&report)?, false);
        }
        let [width, height] = settings.size;
        let name = &workload.scene.name;
        let (content, place) = (workload.content(), workload.place(&settings));
        let window = args.window.map_or("", |_| ", in a window");
        let mut text = format!("{name}: {width}x{height} on {}{window}\n{content}\n{place}\n\n", device.physical.name);
        text.push_str(&motion.map_or_else(String::new, |motion| motion.text(is_verbose)));
        text.push_str(&parts.text());
        let _ = writeln!(text, "The G-buffer takes {} bytes a pixel.", plan.gbuffer_bytes_per_pixel());
        let _ = write!(text, "\nRender passes\n{}", traffic::text(&traffic::of(&plan, &dependencies, &device)?));
        let _ = write!(text, "\nDependencies\n{}", row_list(&plan, &dependencies, layouts));
        let files = args.written();
        let between = if files.is_empty() { "" } else { "\n" };
        output::print(&(text + between + &files), drawn_to_stdout)
    })
}

/// A file for a drawing, or standard output.
fn drawing(text: &str) -> Result<Sink, String> {
    match Sink::parse(text)? {
        Sink::File(path) if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("svg")) => {
            Err("drawings are .svg files".into())
        }
        sink => Ok(sink),
    }
}

/// A paragraph for each dependency: a row of a table would be 200 columns wide.
fn row_list(plan: &FramePlan, rows: &Rows, layouts: impl Fn(&Row) -> Vec<LayoutChange>) -> String {
    let mut text = String::new();
    for row in rows.iter() {
        let region = row.region();
        let _ = writeln!(text, "  {}: {} -> {}, {}{region}", row.name, row.from, row.to, row.carrier);
        let mut masks = TextTable::new();
        for (what, uses) in [("  after ", row.before), ("  before", row.after)] {
            masks.row([what.to_owned(), flags(&uses.stage), flags(&uses.access)]);
        }
        text.push_str(&masks.render());
        // A barrier's is told above, with its kind.
        for change in layouts(row).iter().filter(|change| change.image.is_some()) {
            let _ = writeln!(text, "    layout: {change}");
        }
        let covered = covered(plan, rows, row);
        if covered.contains(&RowPart::Row) {
            text.push_str("    other rows order all of this as well\n");
        } else if !covered.is_empty() {
            // The lines above call the first scope "after" and the second "before".
            let of = |side| {
                let own = covered.iter().filter_map(move |part| match part {
                    RowPart::Bits(own, bits) if *own == side && bits.access.is_empty() => Some(flags(&bits.stage)),
                    RowPart::Bits(own, bits) if *own == side => Some(flags(&bits.access)),
                    _ => None,
                });
                own.collect::<Vec<_>>().join(" | ")
            };
            let samples = if covered.contains(&RowPart::AcrossSamples) { ", across samples" } else { "" };
            let told =
                [("after", of(Side::Before)), ("before", of(Side::After))].map(|(word, bits)| match bits.is_empty() {
                    true => String::new(),
                    false => format!(", {word} {bits}"),
                });
            let _ =
                writeln!(text, "    other rows order as well: {}", (told.concat() + samples).trim_start_matches(", "));
        }
        let _ = writeln!(text, "    why: {}", row.why);
    }
    text
}

/// The bits' names; a dash when there are none.
pub(super) fn flags(flags: &impl std::fmt::Debug) -> String {
    // The old name of the same stage.
    let text = format!("{flags:?}").replace("ALL_TRANSFER", "TRANSFER");
    if text.is_empty() { "-".to_owned() } else { text }
}
