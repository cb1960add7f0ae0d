//! `afterlight bench --plan-cost`: the cost of each part that a plan leaves out, drawn with it and without it in turn.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::{self, capabilities};
use afterlight::gpu::{Device, MemoryKind};
use afterlight::plan::FramePlan;
use afterlight::scene::{Keep, OptionalPart, Settings};
use afterlight_truth::measure::{Distribution, WarmUp};
use serde::Serialize;

use super::contender::{self, Contender};
use super::{Args, report::BenchScene};
use crate::failure::Failure;
use crate::progress;
use crate::table::{TextTable, bytes_more, milliseconds};
use crate::workload::Workload;

/// The cost of keeping parts without need.
#[derive(Serialize)]
pub struct PlanCost {
    /// Each part alone.
    parts: Vec<PartCost>,
    /// Parts whose keeping changes neither the plan nor a frame's draws.
    same: Vec<&'static str>,
    /// Parts that cannot be kept, and why.
    refused: Vec<(&'static str, String)>,
    /// All of them at once, `--plan full`; `null` where that cannot be.
    full: Option<PartCost>,
}

#[derive(Serialize)]
struct PartCost {
    part: &'static str,
    /// Wall times of the frames with it, and of the lean frames between them.
    wall_ms: Option<Distribution>,
    lean_wall_ms: Option<Distribution>,
    /// Ratio of the wall times with it and without it, frame by frame.
    ratio: Option<Distribution>,
    /// Ratio of the times by the device's own clock; `null` if it has none.
    gpu_ratio: Option<Distribution>,
    /// Device memory with it minus device memory without it; and of vertices and indices alone.
    memory_bytes: i64,
    geometry_bytes: i64,
    /// Pipelines of the passes that draw surfaces.
    pipelines: i64,
}

/// Measures one scene.
pub fn measure(args: &Args, workload: &Workload, device: &Arc<Device>) -> Result<BenchScene, Failure> {
    let given = workload.settings(&Default::default(), &device.physical)?;
    // Frames are measured, however many of them a picture is made of.
    let lean = Settings { samples: 1, keep: Keep::NONE, ..given };
    let kept = |keep| Settings { keep, ..lean.clone() };
    let mut base = Contender::new("lean", device, workload, lean.clone())?;
    let left_out: Vec<OptionalPart> = OptionalPart::all().filter(|&part| !has(base.renderer.plan(), part)).collect();
    let rounds = args.frames;
    let steps = u64::from(rounds) * (1 + left_out.len()) as u64;
    let bar = progress::bar(workload.scene.name.clone(), steps, args.quiet);
    let mut warm_up = None;
    let mut costs = PlanCost { parts: Vec::new(), same: Vec::new(), refused: Vec::new(), full: None };
    for part in left_out {
        let cost = base.renderer.plan().cost_of(part, &workload.scene, &lean, &capabilities(&device.physical));
        let settings = kept(Keep::NONE.with(part));
        let made = cost.map_err(frame::Error::from).map_err(Failure::from);
        let made = made.and_then(|cost| Ok((cost, Contender::new(part.name(), device, workload, settings)?)));
        match made {
            Err(refusal) => costs.refused.push((part.name(), refusal.message().to_owned())),
            Ok((cost, mut other)) => {
                if !cost.same || !draws_the_same(&mut base, &mut other, workload)? {
                    take_turns(args, [&mut base, &mut other], workload, (&bar, &mut warm_up))?;
                    costs.parts.push(PartCost::of(part.name(), &base, &other));
                    continue;
                }
                costs.same.push(part.name());
            }
        }
        (0..rounds).for_each(|_| bar.step());
    }
    let mut contenders = vec![base];
    if let Ok(mut full) = Contender::new("full", device, workload, kept(Keep::ALL)) {
        take_turns(args, [&mut contenders[0], &mut full], workload, (&bar, &mut warm_up))?;
        costs.full = Some(PartCost::of("full", &contenders[0], &full));
        contenders.push(full);
    } else {
        contenders[0].times.clear();
    }
    let mut report = BenchScene::of(workload, &contenders, None).after(warm_up);
    report.plan_cost = Some(costs);
    Ok(report)
}

/// Returns true if the plan has a part because the scene needs it.
fn has(plan: &FramePlan, part: OptionalPart) -> bool {
    plan.parts().iter().any(|own| own.optional == Some(part) && own.included)
}

/// Returns true if one frame of each draws as many objects, triangles and maps, from as much memory. The camera decides some parts anew for each
/// frame, of which a plan says nothing.
fn draws_the_same(base: &mut Contender, other: &mut Contender, workload: &Workload) -> Result<bool, Failure> {
    let drawn = |contender: &mut Contender| -> Result<_, Failure> {
        contender.renderer.render(&workload.scene.camera)?;
        Ok(contender.renderer.wait()?.drawn)
    };
    Ok(drawn(base)? == drawn(other)? && base.memory == other.memory)
}

/// Draws both in turn; the first of the two changes from round to round.
fn take_turns(
    args: &Args,
    mut pair: [&mut Contender; 2],
    workload: &Workload,
    (bar, warm_up): (&progress::ProgressDisplay, &mut Option<WarmUp>),
) -> Result<(), Failure> {
    pair[0].times.clear();
    contender::warm_up(&mut pair, &workload.scene.camera, args.warmup, warm_up)?;
    for _ in 0..args.frames {
        for contender in &mut pair {
            contender.draw(&workload.scene.camera, true)?;
        }
        pair.swap(0, 1);
        bar.step();
    }
    Ok(())
}

impl PartCost {
    fn of(part: &'static str, base: &Contender, other: &Contender) -> Self {
        let pairs = || other.times.iter().zip(&base.times);
        let memory = |contender: &Contender| contender.memory.values().sum::<u64>().cast_signed();
        let geometry = |contender: &Contender| {
            contender.memory.get(&MemoryKind::Geometry).copied().unwrap_or_default().cast_signed()
        };
        let pipelines = |contender: &Contender| contender.renderer.plan().keys().count() as i64;
        Self {
            part,
            wall_ms: Distribution::of(other.times.iter().map(|times| times.wall_ms)),
            lean_wall_ms: Distribution::of(base.times.iter().map(|times| times.wall_ms)),
            ratio: Distribution::of(pairs().map(|(own, lean)| own.wall_ms / lean.wall_ms)),
            gpu_ratio: Distribution::of(pairs().filter_map(|(own, lean)| Some(own.gpu_ms? / lean.gpu_ms?))),
            memory_bytes: memory(other) - memory(base),
            geometry_bytes: geometry(other) - geometry(base),
            pipelines: pipelines(other) - pipelines(base),
        }
    }

    fn row(&self) -> [String; 8] {
        let figure = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), milliseconds);
        let ratio =
            |ratio: Option<Distribution>| ratio.map_or_else(|| "-".to_owned(), |one| format!("{:.3}", one.median));
        [
            self.part.to_owned(),
            figure(self.wall_ms.map(|wall| wall.median)),
            figure(self.lean_wall_ms.map(|wall| wall.median)),
            ratio(self.ratio),
            self.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{:.3}..{:.3}", ratio.p5, ratio.p95)),
            bytes_more(self.memory_bytes),
            bytes_more(self.geometry_bytes),
            format!("{:+}", self.pipelines),
        ]
    }
}

impl PlanCost {
    /// Returns the table, and a list of the parts that change nothing.
    pub fn text(&self) -> String {
        let mut table = TextTable::with_figures_from(1);
        table.row([
            "kept without need",
            "with it",
            "lean",
            "ratio",
            "p5..p95",
            "device memory",
            "of it geometry",
            "pipelines",
        ]);
        for cost in self.parts.iter().chain(&self.full) {
            table.row(cost.row());
        }
        let mut text = table.render();
        if !self.same.is_empty() {
            let _ = writeln!(text, "  keeping these changes nothing here: {}", self.same.join(", "));
        }
        for (part, why) in &self.refused {
            let _ = writeln!(text, "  {part} cannot be kept: {why}");
        }
        text
    }
}
