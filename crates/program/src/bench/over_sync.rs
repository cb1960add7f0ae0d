//! `afterlight bench --over-sync`: what too much order costs. Each dependency is widened to all commands, drawn in turn with the frame as it is; then all of
//! them at once; then frames with a full barrier before each pass. The pictures are the same, and no layer reports any of it.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::rows::{self, Row, Rows};
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
    /// Dependencies that these frames do not record: those of uploads and of copies, and what is no barrier.
    not_recorded: Vec<&'static str>,
}

#[derive(Serialize)]
struct WideCost {
    /// A dependency, all of them, or a barrier before each pass.
    widened: String,
    carrier: String,
    /// Frames with it, and those as they are between them: by the device's own clock where that means something.
    ms: Option<Distribution>,
    as_given_ms: Option<Distribution>,
    /// One over the other, frame by frame.
    ratio: Option<Distribution>,
}

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
    wide.push(("all dependencies".into(), "-".into(), table.all_widened(&plan)));
    wide.push(("a full barrier before each pass".into(), "memory barrier".into(), table.with_full_barriers()));
    let steps = u64::from(args.frames) * wide.len() as u64;
    let bar = progress::bar(workload.scene.name.clone(), steps, args.quiet);
    let mut warm_up = None;
    let mut costs = OverSyncCosts { rows: Vec::new(), not_recorded: others.iter().map(|row| row.label).collect() };
    for (widened, carrier, rows) in wide {
        // SAFETY: they order all that the plan's own table orders, and more.
        let mut other = unsafe { Contender::with_rows(&widened, device, workload, settings.clone(), rows) }?;
        contender::take_turns(args, [&mut base, &mut other], workload, (&bar, &mut warm_up))?;
        costs.rows.push(WideCost::of((widened, carrier), [&base, &other]));
    }
    drop(bar);
    let mut report = BenchScene::of(workload, &[base], None).after(warm_up);
    report.over_sync = Some(costs);
    Ok(report)
}

/// Returns true for a row that measured frames record: a dependency of a render pass, or a barrier of a pass.
fn is_of_frames(row: &Row) -> bool {
    row.carrier.stays().is_none() && (row.carrier.is_render_pass() || !row.waiting.is_empty())
}

impl WideCost {
    fn of((widened, carrier): (String, String), [base, other]: [&Contender; 2]) -> Self {
        let own = |contender: &Contender| -> Vec<f64> {
            let software = contender.renderer.plan().software;
            contender.times.iter().map(|times| contender::decisive(times, software)).collect()
        };
        let (given, wide) = (own(base), own(other));
        Self {
            widened,
            carrier,
            ratio: Distribution::of(wide.iter().zip(&given).map(|(wide, given)| wide / given)),
            ms: Distribution::of(wide),
            as_given_ms: Distribution::of(given),
        }
    }
}

impl OverSyncCosts {
    /// Returns the table.
    pub fn text(&self) -> String {
        let mut table = TextTable::with_figures_from(2);
        table.row(["widened", "", "frame", "as given", "ratio", "p5..p95"]);
        let figure = |value: Option<Distribution>| value.map_or_else(|| "-".to_owned(), |own| milliseconds(own.median));
        for cost in &self.rows {
            table.row([
                cost.widened.clone(),
                cost.carrier.clone(),
                figure(cost.ms),
                figure(cost.as_given_ms),
                cost.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{:.3}", ratio.median)),
                cost.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{:.3}..{:.3}", ratio.p5, ratio.p95)),
            ]);
        }
        let mut text = table.render();
        if !self.not_recorded.is_empty() {
            let _ = writeln!(text, "  not recorded in these frames: {}", self.not_recorded.join(", "));
        }
        text
    }
}
