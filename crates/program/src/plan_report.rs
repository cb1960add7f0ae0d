//! A plan as people read it, and as JSON: every part with its cost, or the cost that it would have had.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use afterlight::frame::list;
use afterlight::plan::{Capabilities, Cost, FramePlan, Part};
use afterlight::scene::{Keep, OptionalPart, Scene, Settings};
use rayon::prelude::*;
use serde::Serialize;

use super::table::{TextTable, bytes, bytes_more};

/// The parts of a plan, and the cost of keeping the parts that are out.
#[derive(Serialize)]
pub struct PlanReport {
    parts: Vec<PartReport>,
    /// Device memory of all parts that are in.
    bytes: u64,
    /// Size of attachments and the output.
    target_bytes_per_pixel: u64,
    /// The additional cost of `--plan full`; `null` where it cannot be planned.
    full: Option<CostReport>,
}

#[derive(Serialize)]
struct PartReport {
    name: String,
    group: &'static str,
    /// The word for `--plan`; `null` for a part that the settings or the view decide.
    plan: Option<&'static str>,
    included: bool,
    reason: String,
    /// Device memory that it takes.
    bytes: u64,
    /// The cost of keeping it without need; `null` if it is in, or cannot stay.
    cost: Option<CostReport>,
    /// Why it cannot stay.
    refused: Option<String>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct CostReport {
    bytes: i64,
    bytes_per_pixel: i64,
    /// Keeping it changes nothing that a plan decides.
    same: bool,
}

impl From<Cost> for CostReport {
    fn from(Cost { bytes, bytes_per_pixel, same }: Cost) -> Self {
        Self { bytes, bytes_per_pixel, same }
    }
}

impl PlanReport {
    /// Reports on a plan, which must be made of the other arguments.
    pub fn of(plan: &FramePlan, scene: &Scene, settings: &Settings, device: &Capabilities) -> Self {
        let out = |part: OptionalPart| plan.parts().iter().any(|own| own.optional == Some(part) && !own.included);
        let tried: Vec<_> = OptionalPart::all().filter(|&part| out(part)).collect();
        // Each cost takes another plan, which may look at every texel.
        let costs = tried.into_par_iter().map(|part| (part, plan.cost_of(part, scene, settings, device)));
        let costs: BTreeMap<_, _> = costs.collect();
        let report = |part: &Part| {
            let cost = part.optional.and_then(|optional| costs.get(&optional));
            PartReport {
                name: part.name.clone(),
                group: part.group.name(),
                plan: part.optional.map(OptionalPart::name),
                included: part.included,
                reason: part.reason.clone(),
                bytes: part.bytes,
                cost: cost.and_then(|cost| cost.as_ref().ok()).map(|&cost| cost.into()),
                refused: cost.and_then(|cost| cost.as_ref().err()).map(ToString::to_string),
            }
        };
        let passes = list::parts(plan);
        let mut parts: Vec<&Part> = passes.iter().chain(plan.parts()).collect();
        // Each group has a heading, and its included parts come first.
        parts.sort_by_key(|part| (part.group, !part.included));
        Self {
            parts: parts.into_iter().map(report).collect(),
            bytes: plan.bytes(),
            target_bytes_per_pixel: plan.target_bytes_per_pixel(),
            full: plan.cost_of_all(Keep::ALL, scene, settings, device).ok().map(Into::into),
        }
    }

    /// A table for each group, and the sums.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for parts in self.parts.chunk_by(|one, next| one.group == next.group) {
            let _ = writeln!(text, "{}", parts[0].group);
            text.push_str(&Self::table(parts));
            text.push('\n');
        }
        let _ = writeln!(
            text,
            "In the plan: {}, of which attachments and the output are {} bytes a pixel.",
            bytes(self.bytes),
            self.target_bytes_per_pixel
        );
        if let Some(full) = self.full {
            let (more, per_pixel) = (bytes_more(full.bytes), full.bytes_per_pixel);
            let _ = writeln!(text, "With everything kept (--plan full): {more}, {per_pixel:+} bytes a pixel.");
        }
        text
    }

    fn table(parts: &[PartReport]) -> String {
        let mut table = TextTable::new();
        // Every group is a separate table, and all of them align.
        let heading = [("", 3), ("part", 36), ("takes", 10), ("if kept", 10), ("--plan", 27)];
        let heading = heading.map(|(name, width)| format!("{name:width$}"));
        table.row(heading.into_iter().chain(["why".to_owned()]));
        for part in parts {
            let state = if part.included { "in" } else { "out" };
            let takes = if part.bytes > 0 { bytes(part.bytes) } else { String::new() };
            let kept = match (&part.cost, &part.refused) {
                (Some(cost), _) if cost.bytes != 0 => bytes_more(cost.bytes),
                (Some(cost), _) if cost.same => "the same".into(),
                (Some(_), _) => "+0 B".into(),
                (None, Some(_)) => "cannot be".into(),
                (None, None) => String::new(),
            };
            let why = match &part.refused {
                Some(refused) => format!("{}; {refused}", part.reason),
                None => part.reason.clone(),
            };
            let plan = part.plan.unwrap_or_default().to_owned();
            table.row([state.to_owned(), part.name.clone(), takes, kept, plan, why]);
        }
        table.render()
    }
}
