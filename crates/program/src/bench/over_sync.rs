//! `afterlight bench --over-sync`: what too much order costs. Each dependency is widened to all commands, drawn in turn with the frame as it is; then all of
//! them at once; then frames with a full barrier before each pass. The pictures are the same, and no layer reports any of it.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::rows::{self, Endpoint, Row, Rows, SyncKind};
use afterlight::gpu::Device;
use afterlight::scene::Settings;
use afterlight_truth::measure::Distribution;
use serde::Serialize;

use super::Args;
use super::contender::{self, Contender};
use super::report::BenchScene;
use crate::failure::Failure;
use crate::progress;
use crate::table::{TextTable, milliseconds};
use crate::workload::Workload;

/// What wider dependencies cost.
#[derive(Serialize)]
pub struct OverSyncCosts {
    rows: Vec<WideCost>,
    /// Dependencies that measured frames do not record: uploads, copies, fences, and the semaphores of a window.
    not_recorded: Vec<&'static str>,
}

#[derive(Serialize)]
struct WideCost {
    /// A dependency, all of them, or a barrier before each pass.
    widened: String,
    carrier: String,
    /// Frames by themselves: by the device's own clock where that means something.
    alone: FramesInTurn,
    /// Frames one after the other, two in flight, which overlap on the device as far as their dependencies let them.
    in_a_row: FramesInTurn,
}

/// The times of a frame, in milliseconds, of two kinds that were drawn in turn.
#[derive(Serialize)]
struct FramesInTurn {
    ms: Option<Distribution>,
    as_given_ms: Option<Distribution>,
    /// One over the other, round by round.
    ratio: Option<Distribution>,
}

/// Frames that are drawn one after the other before the last of them is waited for.
const IN_A_ROW: u32 = 8;

/// Measures one scene.
///
/// # Errors
/// As [`Contender::new`].
pub fn measure(args: &Args, workload: &Workload, device: &Arc<Device>) -> Result<BenchScene, Failure> {
    let given = workload.settings(&Default::default(), &device.physical)?;
    let settings = Settings { samples: 1, ..given };
    let mut base = Contender::new("as given", device, workload, settings.clone())?;
    let plan = base.renderer.plan().clone();
    let table = rows::table(&plan);
    let (own, others): (Vec<&Row>, Vec<&Row>) = table.iter().partition(|row| is_of_frames(row));
    let mut wide: Vec<(String, String, Rows)> = Vec::new();
    for row in own {
        let rows = table.widened(&plan, row.name).map_err(|error| Failure::usage(error.to_string()))?;
        wide.push((row.label.to_owned(), row.carrier.to_string(), rows));
    }
    // What two measurements of one thing differ by.
    wide.insert(0, ("nothing: the same again".into(), "-".into(), table.clone()));
    wide.push(("all dependencies".into(), "-".into(), table.all_widened(&plan)));
    wide.push(("a full barrier before each pass".into(), "memory barrier".into(), table.with_full_barriers()));
    let steps = u64::from(args.frames) * wide.len() as u64;
    let bar = progress::bar(workload.scene.name.clone(), steps, args.quiet);
    let mut warm_up = None;
    let mut costs = OverSyncCosts { rows: Vec::new(), not_recorded: others.iter().map(|row| row.label).collect() };
    for (widened, carrier, rows) in wide {
        // SAFETY: they order all that the plan's own table orders, and more.
        let mut other = unsafe { Contender::with_rows(&widened, device, workload, settings.clone(), rows) }?;
        let camera = &workload.scene.camera;
        contender::warm_up(&mut [&mut base, &mut other], camera, args.warmup, &mut warm_up)?;
        let (mut alone, mut in_a_row) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
        for round in 0..args.frames {
            // The first of the two changes from round to round.
            for index in if round % 2 == 0 { [0, 1] } else { [1, 0] } {
                let own = if index == 0 { &mut base } else { &mut other };
                alone[index].push(own.draw(camera, index == 0)?);
                in_a_row[index].push(own.draw_in_a_row(camera, IN_A_ROW)?);
            }
            bar.step();
        }
        costs.rows.push(WideCost {
            widened,
            carrier,
            alone: FramesInTurn::of(alone),
            in_a_row: FramesInTurn::of(in_a_row),
        });
    }
    drop(bar);
    let mut report = BenchScene::of(workload, &[base], None).after(warm_up);
    report.over_sync = Some(costs);
    Ok(report)
}

/// Returns true for a row that measured frames record: a dependency of a render pass, a barrier of a pass, or a wait or a transfer between queues.
fn is_of_frames(row: &Row) -> bool {
    let is_between_queues = matches!(row.carrier, SyncKind::QueueSemaphore | SyncKind::Ownership(_));
    let is_recorded = row.carrier.is_render_pass() || !row.waiting.is_empty();
    row.carrier.stays().is_none() && (is_recorded || is_between_queues && row.from != Endpoint::UPLOAD)
}

impl FramesInTurn {
    /// Compares frames as given with wider ones.
    fn of([given, wide]: [Vec<f64>; 2]) -> Self {
        Self {
            ratio: Distribution::of(wide.iter().zip(&given).map(|(wide, given)| wide / given)),
            ms: Distribution::of(wide),
            as_given_ms: Distribution::of(given),
        }
    }

    /// The columns of the table: the median, its ratio, and where that lies.
    fn columns(&self) -> [String; 3] {
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        [
            or_dash(self.ms.map(|own| milliseconds(own.median))),
            or_dash(self.ratio.map(|ratio| format!("{:.3}", ratio.median))),
            or_dash(self.ratio.map(|ratio| format!("{:.3}..{:.3}", ratio.p5, ratio.p95))),
        ]
    }
}

impl OverSyncCosts {
    /// Returns the table.
    pub fn text(&self) -> String {
        let mut table = TextTable::with_figures_from(2);
        table.row(["widened", "", "a frame alone", "ratio", "p5..p95", "frames in a row", "ratio", "p5..p95"]);
        for cost in &self.rows {
            let figures = [cost.alone.columns(), cost.in_a_row.columns()].concat();
            table.row([cost.widened.clone(), cost.carrier.clone()].into_iter().chain(figures));
        }
        let mut text = table.render();
        if !self.not_recorded.is_empty() {
            let _ = writeln!(text, "  not recorded in these frames: {}", self.not_recorded.join(", "));
        }
        text
    }
}
