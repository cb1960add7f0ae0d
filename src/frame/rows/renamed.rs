//! Names that rows had when each was written for a pair of passes, so that commands which name them still work, and the reason why a plan has no row of a name.

use super::{Row, Rows};
use crate::frame::list;
use crate::gpu::vk;
use crate::passes::{Endpoint, Presence};
use crate::plan::effect::FormerRow;
use crate::plan::effects::EFFECTS;
use crate::plan::{Encoding, FramePlan, PresentTarget, Transfer};

/// The passes of no effect that draw light or the picture.
const DRAWS: [&str; 5] = ["tonemap", "composite", "transparent", "lighting", "forward"];

/// Former names of rows between passes of no effect.
const FORMER_ROWS: &[FormerRow] = &[
    ("deformed-reuse", &["skin-reuse"]),
    ("skin-to-draws", &["skin-to-readers"]),
    ("culled-reuse", &["cull-reuse"]),
    ("fill-to-draws", &["fill-to-readers"]),
    ("shadow-map-reuse", &["shadow-reuse"]),
    ("shadow-map-to-lighting", &["shadow-to-readers", "shadow-to-lighting", "shadow-to-forward", "shadow-to-tiled"]),
    ("pyramid-to-cull", &["pyramid-to-readers"]),
    ("gbuffer-reuse", &["geometry-reuse"]),
    ("gbuffer-to-lighting", &["geometry-to-lighting"]),
    ("gbuffer-to-tiled", &["geometry-to-tiled"]),
    ("hdr-reuse", &["lighting-reuse"]),
    ("samples-reuse", &["lighting-reuse"]),
    ("output-reuse", &["tonemap-reuse", "lighting-reuse"]),
    ("targets-reuse", &["forward-reuse", "lighting-reuse"]),
    ("sums-reuse", &["transparent-reuse"]),
    ("sums-to-composite", &["transparent-to-composite"]),
    ("hdr-to-tonemap", &["*-to-tonemap"]),
    ("picture-to-tone", &["*-to-tone"]),
];

/// All former row names. Each effect declares former names of the rows that it owns.
fn former_rows() -> impl Iterator<Item = &'static FormerRow> {
    FORMER_ROWS.iter().chain(EFFECTS.iter().flat_map(|effect| effect.former_rows))
}

/// The passes that draw light or the picture, the last first: a former row that followed whichever came last is today's row of the first of these that has one.
fn last_draws() -> impl Iterator<Item = String> {
    let draws: Vec<&str> = EFFECTS.iter().flat_map(|effect| effect.draws).copied().chain(DRAWS).collect();
    let passes = list::passes().into_iter().rev().map(|pass| spelled(pass.name));
    passes.filter(move |pass| draws.contains(&pass.as_str()))
}

/// The row between two passes, or to one from the frame before. Where several passes wait for one by the same row, each of their pairs has that row.
pub(super) fn row_of<'a>(table: &'a Rows, name: &str) -> Option<&'a Row> {
    table.iter().find(|row| row.label == name).or_else(|| {
        let (from, to) = name.split_once("-to-")?;
        let readers = format!("{from}-to-readers");
        table.iter().find(|row| row.label == readers && row.waiting.iter().any(|place| spelled(*place) == to))
    })
}

/// The row that has taken the place of one which had this name.
pub(super) fn successor<'a>(table: &'a Rows, name: &str) -> Option<&'a Row> {
    let (_, patterns) = former_rows().find(|(former, _)| *former == name)?;
    patterns.iter().find_map(|pattern| match pattern.strip_prefix('*') {
        Some(rest) => last_draws().find_map(|from| row_of(table, &format!("{from}{rest}"))),
        None => row_of(table, pattern),
    })
}

/// The reason why a plan has no row of a name: the window or the pass that it lacks.
pub fn lack(plan: &FramePlan, name: &str) -> Option<String> {
    let has = |plan: &FramePlan| super::table(plan).iter().any(|row| row.label == name);
    if plan.presented.is_none() && in_windows(plan).iter().any(has) {
        return Some("no window".into());
    }
    let own = former_rows().find(|(former, _)| *former == name).map_or(name, |(_, patterns)| patterns[0]);
    let (from, to) = own.split_once("-to-").or(own.strip_suffix("-reuse").map(|to| ("", to)))?;
    [from, to].into_iter().find_map(|one| {
        let pass = list::passes().into_iter().find(|pass| spelled(pass.name) == one)?;
        match (pass.presence)(plan) {
            Presence::Out(why) => Some(format!("no {} pass ({why})", pass.name)),
            Presence::In(_) => None,
        }
    })
}

/// Variants of a plan in a window, one for each way in which a picture gets there.
pub fn in_windows(plan: &FramePlan) -> [FramePlan; 3] {
    let format = vk::Format::B8G8R8A8_SRGB;
    let encoding = Encoding { transfer: Transfer::Srgb, headroom: 1.0 };
    [PresentTarget::Straight(format), PresentTarget::Enlarge(format), PresentTarget::Encode(encoding)]
        .map(|target| plan.clone().presented_as(target))
}

/// A place as rows' names have it: `ao-denoise`.
pub(super) fn spelled(place: Endpoint) -> String {
    place.name().to_lowercase().replace('_', "-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::rows;
    use crate::plan::samples;

    /// The pass that a former name spoke of, where it did so: `light-to-taa` of TAA.
    fn reader(name: &str) -> Option<&str> {
        let (_, to) = name.split_once("-to-")?;
        list::passes().iter().any(|pass| spelled(pass.name) == to).then_some(to)
    }

    #[test]
    fn a_former_name_stands_for_a_row_of_the_pass_that_it_spoke_of() {
        let mut found = 0;
        for (plan_name, plan) in samples::of_every_kind() {
            let table = rows::table(&plan);
            for (former, _) in former_rows() {
                let Some(row) = successor(&table, former) else { continue };
                found += 1;
                let waits = |to: &str| row.waiting.iter().chain([&row.to]).any(|place| spelled(*place) == to);
                let is_right = reader(former).is_none_or(|to| waits(to) || *former == "shadow-map-to-lighting");
                assert!(is_right, "{plan_name}: {former} is said to be {}", row.label);
            }
        }
        assert!(found > 1000, "{found}");
    }

    /// Rows between AO and passes that no sample plan has with it.
    const UNSAMPLED: [&str; 2] = ["occlusion-to-tiled", "ao-to-fog"];

    #[test]
    fn each_former_name_stands_for_a_row_of_some_plan() {
        let plans = samples::of_every_kind();
        let tables: Vec<_> = plans.iter().map(|(_, plan)| rows::table(plan)).collect();
        let is_lost = |former: &str| tables.iter().all(|table| successor(table, former).is_none());
        let former = former_rows().map(|(former, _)| *former).filter(|former| !UNSAMPLED.contains(former));
        let lost: Vec<_> = former.filter(|former| is_lost(former)).collect();
        assert!(lost.is_empty(), "{lost:?}");
    }
}
