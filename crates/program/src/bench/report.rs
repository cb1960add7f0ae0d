//! The figures of a benchmark, as JSON and as text. docs/COMMANDS.md documents the JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use afterlight::frame::FrameTimes;
use afterlight::gpu::PhysicalDevice;
use afterlight::scene::counted;
use afterlight_truth::measure::{Distribution, WarmUp, what_moves};
use serde::Serialize;

use super::Args;
use super::contender::Contender;
use super::layers::LayerCosts;
use super::over_sync::OverSyncCosts;
use super::plan_cost::PlanCost;
use super::walk::{Moment, Walk};
use super::why::CostBreakdown;
use crate::table::{TextTable, bytes, milliseconds};
use crate::workload::Workload;

/// Everything that one `bench` measured.
#[derive(Serialize)]
pub struct BenchReport {
    /// The program's version.
    afterlight: &'static str,
    pub device: DeviceSummary,
    /// As `--warmup` has it; `null` where frames were drawn until their times had settled.
    warmup_frames: Option<u32>,
    measured_frames: u32,
    pub scenes: Vec<BenchScene>,
    /// Of the process over all scenes and variants; `null` where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

#[derive(Serialize)]
pub struct DeviceSummary {
    pub name: String,
    kind: String,
    driver: String,
    driver_info: String,
}

#[derive(Serialize)]
pub struct BenchScene {
    scene: String,
    triangles: usize,
    objects: usize,
    lights: usize,
    load_ms: f64,
    /// With `true` every frame draws all shadow maps; with `false` frames keep them.
    moving: bool,
    /// Without `--warmup`: how long it took until times had settled; of several batches the last, or one in which they never did.
    warm_up: Option<WarmUp>,
    /// The camera path of `--path`.
    path: Option<CameraPathReport>,
    /// The settings as given first, then the variants in their order; with `--plan-cost` the lean plan and the full one.
    runs: Vec<RunReport>,
    /// Results of `--plan-cost`.
    pub plan_cost: Option<PlanCost>,
    /// Results of `--why`.
    pub why: Option<CostBreakdown>,
    /// Results of `--layers`.
    pub layers: Option<LayerCosts>,
    /// Results of `--over-sync`.
    pub over_sync: Option<OverSyncCosts>,
}

#[derive(Serialize)]
struct CameraPathReport {
    file: String,
    seconds: f64,
}

#[derive(Serialize)]
struct RunReport {
    variant: String,
    size: [u32; 2],
    first_frame_ms: f64,
    /// Time from the start of recording to the frame's end on the device.
    wall_ms: Option<Distribution>,
    /// Recording on the CPU.
    record_ms: Option<Distribution>,
    /// The call that submits it.
    submit_ms: Option<Distribution>,
    /// Time of the whole frame by the device's own clock; `null` if it has none.
    gpu_ms: Option<Distribution>,
    /// Passes in the order of the frame; empty where the driver's timestamps between passes mean nothing.
    passes: Vec<PassReport>,
    /// This run's wall time over the first run's, frame by frame; `null` for the first run.
    ratio: Option<Distribution>,
    gbuffer_bytes_per_pixel: u32,
    memory_bytes: BTreeMap<&'static str, u64>,
    drawn: DrawnReport,
    /// Each measured frame of `--path`.
    moments: Option<Vec<Moment>>,
}

#[derive(Serialize)]
struct PassReport {
    name: String,
    gpu_ms: Option<Distribution>,
}

/// Counts of the last frame.
#[derive(Serialize, Default)]
struct DrawnReport {
    objects: u64,
    /// Objects that the device tests, and how many of them it found visible. Neither they nor their triangles are counted elsewhere.
    objects_on_device: u64,
    found_on_device: u64,
    /// Commands that draw surfaces.
    commands: u64,
    culled_objects: u64,
    occluded_objects: u64,
    /// Shadow maps that are looked up, how many of them were drawn anew, and how often an object was drawn into these.
    shadow_maps: u64,
    shadow_maps_drawn: u64,
    casters: u64,
    /// Draws into these that were left out, as nothing is seen in their shadow.
    idle_casters: u64,
    triangles: u64,
    /// Lights that reach visible surfaces, and lights of the plan that do not.
    lights: u64,
    idle_lights: u64,
}

impl DrawnReport {
    fn objects_in_words(&self) -> String {
        let Self { objects, objects_on_device, found_on_device, culled_objects, occluded_objects, .. } = self;
        match objects_on_device {
            0 => format!("{objects} ({culled_objects} culled, {occluded_objects} occluded)"),
            all => format!("{objects}, and {found_on_device} of {all} that the device sees"),
        }
    }
}

impl BenchReport {
    pub fn new(device: &PhysicalDevice, args: &Args) -> Self {
        let (warmup_frames, measured_frames) = (args.warmup, args.frames);
        let device = DeviceSummary {
            name: device.name.clone(),
            kind: format!("{:?}", device.kind),
            driver: device.driver_name.clone(),
            driver_info: device.driver_info.clone(),
        };
        let scenes = Vec::new();
        let afterlight = env!("CARGO_PKG_VERSION");
        Self { afterlight, device, warmup_frames, measured_frames, scenes, peak_memory_bytes: None }
    }

    /// Returns the text that is printed once, after all scenes.
    pub fn closing_text(&self) -> String {
        let after = match self.warmup_frames {
            Some(frames) => format!("{frames} to warm up"),
            None => "a warm-up until their times settle".into(),
        };
        let frames = format!("{} each, after {after}", counted(self.measured_frames, "frame"));
        match self.peak_memory_bytes {
            Some(peak) => format!("{frames}; peak memory of the process {}\n", bytes(peak)),
            None => format!("{frames}\n"),
        }
    }
}

impl BenchScene {
    pub fn of(workload: &Workload, contenders: &[Contender], walk: Option<&Walk>) -> Self {
        let scene = &workload.scene;
        let base = contenders.first().map_or(&[][..], |first| &first.times);
        let run = |(index, contender)| RunReport::of(contender, (index > 0).then_some(base), walk);
        Self {
            scene: scene.name.clone(),
            triangles: scene.triangle_count(),
            objects: scene.objects.len(),
            lights: scene.lights.len(),
            load_ms: workload.load_ms,
            moving: contenders.first().is_some_and(|first| !first.settings.shadows.cache),
            warm_up: None,
            path: walk.map(|walk| CameraPathReport { file: walk.file.clone(), seconds: walk.seconds() }),
            runs: contenders.iter().enumerate().map(run).collect(),
            plan_cost: None,
            why: None,
            layers: None,
            over_sync: None,
        }
    }

    /// Adds the warm-up before its frames.
    pub fn after(self, warm_up: Option<WarmUp>) -> Self {
        Self { warm_up, ..self }
    }

    /// The tables of one scene.
    pub fn text(&self, device: &str) -> String {
        let mut text = format!(
            "{} on {device}: {} in {}, {}; loaded in {}\ntimes: {}\n",
            self.scene,
            counted(self.triangles, "triangle"),
            counted(self.objects, "object"),
            counted(self.lights, "light"),
            milliseconds(self.load_ms),
            if self.path.is_some() && !self.moving { "only the camera moves" } else { what_moves(self.moving) }
        );
        text.extend(self.warm_up.and_then(|warm_up| warm_up.words()).map(|words| words + "\n"));
        if let Some(costs) = &self.plan_cost {
            let _ = writeln!(text, "{}", costs.text());
        }
        if let Some(why) = &self.why {
            let _ = writeln!(text, "{}", why.text());
        }
        if let Some(costs) = &self.layers {
            let _ = writeln!(text, "{}", costs.text());
        }
        if let Some(costs) = &self.over_sync {
            let _ = writeln!(text, "{}", costs.text());
        }
        let _ = writeln!(text, "{}", self.times().render());
        let _ = writeln!(text, "{}", details(&self.runs).render());
        text
    }

    fn times(&self) -> TextTable {
        let mut table = TextTable::with_figures_from(1);
        table.row(["", "median", "p5", "p95", "min", "CPU", "GPU", "first frame", "ratio"]);
        let figure = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), milliseconds);
        let median = |times: &Option<Distribution>| figure(times.map(|times| times.median));
        for run in &self.runs {
            table.row([
                run.variant.clone(),
                median(&run.wall_ms),
                figure(run.wall_ms.map(|wall| wall.p5)),
                figure(run.wall_ms.map(|wall| wall.p95)),
                figure(run.wall_ms.map(|wall| wall.min)),
                median(&run.record_ms),
                median(&run.gpu_ms),
                milliseconds(run.first_frame_ms),
                run.ratio.map_or_else(|| "1".to_owned(), |ratio| format!("{:.3}", ratio.median)),
            ]);
        }
        table
    }
}

impl RunReport {
    fn of(contender: &Contender, base: Option<&[FrameTimes]>, walk: Option<&Walk>) -> Self {
        let times = &contender.times;
        let ratio = base
            .and_then(|base| Distribution::of(times.iter().zip(base).map(|(own, first)| own.wall_ms / first.wall_ms)));
        let drawn = times.last().map(|last| DrawnReport {
            objects: last.drawn.objects as u64,
            objects_on_device: last.drawn.on_device as u64,
            found_on_device: last.drawn.found.unwrap_or(0) as u64,
            commands: last.drawn.commands as u64,
            culled_objects: last.drawn.culled as u64,
            occluded_objects: last.drawn.occluded as u64,
            shadow_maps: last.drawn.shadow_maps as u64,
            shadow_maps_drawn: last.drawn.shadow_maps_drawn as u64,
            casters: last.drawn.casters as u64,
            idle_casters: last.drawn.idle_casters as u64,
            triangles: last.drawn.triangles as u64,
            lights: last.drawn.lights as u64,
            idle_lights: last.drawn.idle_lights as u64,
        });
        Self {
            variant: contender.name.clone(),
            size: contender.settings.size,
            first_frame_ms: contender.first_frame_ms,
            wall_ms: Distribution::of(times.iter().map(|frame| frame.wall_ms)),
            record_ms: Distribution::of(times.iter().map(|frame| frame.record_ms)),
            submit_ms: Distribution::of(times.iter().map(|frame| frame.submit_ms)),
            gpu_ms: Distribution::of(times.iter().filter_map(|frame| frame.gpu_ms)),
            passes: passes(times),
            ratio,
            gbuffer_bytes_per_pixel: contender.renderer.plan().gbuffer_bytes_per_pixel(),
            memory_bytes: contender.memory.iter().map(|(kind, bytes)| (kind.text(), *bytes)).collect(),
            drawn: drawn.unwrap_or_default(),
            moments: walk.map(|walk| times.iter().zip(0..).map(|(frame, index)| walk.moment(index, frame)).collect()),
        }
    }

    /// The rows of the table: the run's figures, its passes and its memory, each by its name.
    fn facts(&self) -> Vec<(String, String)> {
        let ([width, height], drawn) = (self.size, &self.drawn);
        let fact = |name: &str, value: String| (name.to_owned(), value);
        let mut facts = vec![
            fact("size", format!("{width}x{height}")),
            fact("shadow maps drawn", format!("{} of {}", drawn.shadow_maps_drawn, drawn.shadow_maps)),
            fact("casters", format!("{} ({} idle)", drawn.casters, drawn.idle_casters)),
            fact("triangles", drawn.triangles.to_string()),
            fact("objects", drawn.objects_in_words()),
            fact("commands that draw them", drawn.commands.to_string()),
            fact("lights", format!("{} ({} idle)", drawn.lights, drawn.idle_lights)),
        ];
        let slowest = self.moments.iter().flatten().max_by(|a, b| a.wall_ms.total_cmp(&b.wall_ms));
        if let Some(Moment { at_s, wall_ms, triangles, .. }) = slowest {
            let text = format!("{} at {at_s:.2} s, with {}", milliseconds(*wall_ms), counted(*triangles, "triangle"));
            facts.push(fact("slowest along the path", text));
        }
        facts.extend(self.passes.iter().map(|pass| {
            let median = pass.gpu_ms.map_or_else(|| "-".to_owned(), |times| milliseconds(times.median));
            (format!("{} on the GPU", pass.name), median)
        }));
        facts.extend(self.memory_bytes.iter().map(|(kind, size)| fact(kind, bytes(*size))));
        facts.push(fact("G-buffer, a pixel", format!("{} B", self.gbuffer_bytes_per_pixel)));
        facts
    }
}

/// A column for each run. A value that equals the first run's stands there alone; a dash is a value that a run does not have.
fn details(runs: &[RunReport]) -> TextTable {
    let all: Vec<_> = runs.iter().map(RunReport::facts).collect();
    let mut names: Vec<&String> = Vec::new();
    for (name, _) in all.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let mut table = TextTable::with_figures_from(1);
    if runs.len() > 1 {
        table.row(std::iter::once(String::new()).chain(runs.iter().map(|run| run.variant.clone())));
    }
    for name in names {
        let of = |facts: &[(String, String)]| {
            facts.iter().find(|(own, _)| own == name).map_or_else(|| "-".to_owned(), |(_, value)| value.clone())
        };
        let values: Vec<String> = all.iter().map(|facts| of(facts)).collect();
        let differs = |(index, value): (usize, &String)| match index > 0 && *value == values[0] {
            true => String::new(),
            false => value.clone(),
        };
        table.row(std::iter::once(name.clone()).chain(values.iter().enumerate().map(differs)));
    }
    table
}

/// The distribution of each pass's time over the frames, in the order in which the first frame names them.
fn passes(times: &[FrameTimes]) -> Vec<PassReport> {
    let names = times.first().map_or(&[][..], |first| &first.passes);
    let of = |name: &str| {
        let samples = times.iter().flat_map(|frame| &frame.passes).filter(|(pass, _)| pass == name);
        PassReport { name: name.to_owned(), gpu_ms: Distribution::of(samples.map(|(_, gpu_ms)| *gpu_ms)) }
    };
    names.iter().map(|(name, _)| of(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_keep_their_order_and_get_their_own_samples() {
        let frame = |shadow: f64, main: f64| FrameTimes {
            passes: vec![("shadow".into(), shadow), ("main".into(), main)],
            ..FrameTimes::default()
        };
        let passes = passes(&[frame(1.0, 10.0), frame(3.0, 30.0)]);
        let medians: Vec<_> = passes.iter().map(|pass| (&*pass.name, pass.gpu_ms.map(|times| times.median))).collect();
        assert_eq!(medians, [("shadow", Some(2.0)), ("main", Some(20.0))]);
    }
}
