//! `afterlight bench --layers`: the cost of the validation layer's checks, drawn with each kind of them in turn, and without the layer.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::FrameTimes;
use afterlight::gpu::{Device, Error, Instance, InstanceOptions, MessageKind, Validation};
use afterlight::scene::counted;
use afterlight_truth::measure::Distribution;
use serde::Serialize;

use super::Args;
use super::contender::{self, Contender};
use super::report::BenchScene;
use crate::failure::{Exit, Failure};
use crate::progress;
use crate::table::{TextTable, milliseconds, version};
use crate::workload::Workload;

/// The kinds of checks, with their names in the table. Synchronization checks have two modes.
const CHECKS: &[(&str, Validation, bool)] = &[
    ("no layer", Validation::Off, false),
    ("core", Validation::Core, false),
    ("core, synchronization", Validation::Synchronization, false),
    ("the same by what shaders access", Validation::Synchronization, true),
    ("GPU-assisted", Validation::GpuAssisted, false),
    ("core, best practices", Validation::BestPractices, false),
];

/// What checks cost.
#[derive(Serialize)]
pub struct LayerCosts {
    /// The version of the validation layer.
    layer: String,
    /// Costs of each kind, no layer first.
    checks: Vec<CheckCost>,
    /// Checks that this layer has not, and why.
    refused: Vec<(&'static str, String)>,
}

#[derive(Serialize)]
struct CheckCost {
    checks: &'static str,
    /// Recording a frame and submitting it.
    cpu_ms: Option<Distribution>,
    record_ms: Option<Distribution>,
    submit_ms: Option<Distribution>,
    wall_ms: Option<Distribution>,
    /// The CPU's time over that without the layer, frame by frame; `null` for that itself.
    ratio: Option<Distribution>,
    first_frame_ms: f64,
    /// What the layer said of these frames.
    messages: usize,
}

/// A device under one kind of checks, and the renderer on it.
struct CheckedRun {
    checks: &'static str,
    instance: Arc<Instance>,
    contender: Contender,
}

/// Measures one scene.
///
/// # Errors
/// Where there is no layer, and as [`Contender::new`].
pub fn measure(args: &Args, workload: &Workload) -> Result<BenchScene, Failure> {
    let mut runs = Vec::new();
    let mut refused = Vec::new();
    let mut layer = None;
    for &(checks, validation, by_shaders) in CHECKS {
        match open(validation, by_shaders) {
            Ok(Some(instance)) => {
                let device = Device::new(&instance, &args.device.device.clone().unwrap_or_default())?;
                layer = layer.or(instance.validation_layer());
                let settings = workload.settings(&Default::default(), &device.physical)?;
                let settings = afterlight::scene::Settings { samples: 1, ..settings };
                let contender = Contender::new(checks, &device, workload, settings)?;
                runs.push(CheckedRun { checks, instance, contender });
            }
            Ok(None) => refused.push((checks, "this layer has no such mode".to_owned())),
            Err(Error::Unsupported(why)) if validation != Validation::Off => refused.push((checks, why)),
            Err(error) => return Err(error.into()),
        }
    }
    let Some(layer) = layer else {
        return Err(Failure::new(Exit::NoVulkan, "there is no validation layer to measure"));
    };
    let camera = &workload.scene.camera;
    let bar = progress::bar(workload.scene.name.clone(), u64::from(args.frames), args.quiet);
    let mut warm_up = None;
    let mut all: Vec<_> = runs.iter_mut().map(|run| &mut run.contender).collect();
    contender::warm_up(&mut all, camera, args.warmup, &mut warm_up)?;
    for _ in 0..args.frames {
        all.iter_mut().try_for_each(|contender| contender.draw(camera, true).map(drop))?;
        // Another one is first in each round.
        all.rotate_left(1);
        bar.step();
    }
    drop(bar);
    let base = runs.first().map_or_else(Vec::new, |run| run.contender.times.clone());
    let checks = runs.iter().enumerate().map(|(index, run)| CheckCost::of(run, (index > 0).then_some(&base))).collect();
    let contenders: Vec<_> = runs.into_iter().map(|run| run.contender).collect();
    let mut report = BenchScene::of(workload, &contenders, None).after(warm_up);
    report.layers = Some(LayerCosts { layer: version(layer), checks, refused });
    Ok(report)
}

/// An instance with these checks; none where the layer lacks that mode.
fn open(validation: Validation, by_shaders: bool) -> Result<Option<Arc<Instance>>, Error> {
    let instance = Instance::new(&InstanceOptions { validation, sync_shader_heuristic: by_shaders, calibrated: true })?;
    Ok((!by_shaders || instance.sync_shader_heuristic()).then_some(instance))
}

/// Recording and submitting a frame.
fn cpu_ms(times: &FrameTimes) -> f64 {
    times.record_ms + times.submit_ms
}

impl CheckCost {
    fn of(run: &CheckedRun, base: Option<&Vec<FrameTimes>>) -> Self {
        let times = &run.contender.times;
        let of = |value: fn(&FrameTimes) -> f64| Distribution::of(times.iter().map(value));
        let about_us = run.instance.take_messages().iter().filter(|own| own.kind != MessageKind::General).count();
        Self {
            checks: run.checks,
            cpu_ms: of(cpu_ms),
            record_ms: of(|own| own.record_ms),
            submit_ms: of(|own| own.submit_ms),
            wall_ms: of(|own| own.wall_ms),
            ratio: base.and_then(|base| {
                Distribution::of(times.iter().zip(base).map(|(own, bare)| cpu_ms(own) / cpu_ms(bare)))
            }),
            first_frame_ms: run.contender.first_frame_ms,
            messages: about_us,
        }
    }
}

impl LayerCosts {
    /// Returns the table.
    pub fn text(&self) -> String {
        let mut table = TextTable::with_figures_from(1);
        let layer = format!("layer {}", self.layer);
        table.row([
            &layer,
            "CPU a frame",
            "recording",
            "submitting",
            "ratio",
            "p5..p95",
            "wall",
            "first frame",
            "messages",
        ]);
        let figure = |value: Option<Distribution>| value.map_or_else(|| "-".to_owned(), |own| milliseconds(own.median));
        for cost in &self.checks {
            table.row([
                cost.checks.to_owned(),
                figure(cost.cpu_ms),
                figure(cost.record_ms),
                figure(cost.submit_ms),
                cost.ratio.map_or_else(|| "1".to_owned(), |ratio| format!("{:.2}", ratio.median)),
                cost.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{:.2}..{:.2}", ratio.p5, ratio.p95)),
                figure(cost.wall_ms),
                milliseconds(cost.first_frame_ms),
                cost.messages.to_string(),
            ]);
        }
        let mut text = table.render();
        for (checks, why) in &self.refused {
            let _ = writeln!(text, "  {checks}: {why}");
        }
        let heard: usize = self.checks.iter().map(|cost| cost.messages).sum();
        if heard > 0 {
            let _ =
                writeln!(text, "  {}: `render --validate` lists those of a kind of checks", counted(heard, "message"));
        }
        text
    }
}
