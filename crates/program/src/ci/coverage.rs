//! Counts the parts that the cases of a suite use, from their plans: no device is asked, so that the table is the same everywhere. Each case is
//! planned on a device that lacks nothing, and on the same as a CPU.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use afterlight::frame::list::{self, StepList};
use afterlight::frame::rows;
use afterlight::plan::{Capabilities, CostModel, FramePlan, PartGroup};
use afterlight::scene::{BlockFormat, LightPath, Settings, View};
use afterlight_lab::mutants;

use super::examine::CaseSetup;
use super::suite::SuiteCase;
use crate::failure::{Exit, Failure};

/// A kind of which not all names are known.
const FORMATS: &str = "formats of attachments";

/// All names of each kind, with the number of plans that use each.
#[derive(Default)]
struct UseCounts(BTreeMap<&'static str, BTreeMap<String, usize>>);

impl UseCounts {
    fn count(&mut self, kind: &'static str, name: impl Into<String>, is_used: bool) {
        *self.0.entry(kind).or_default().entry(name.into()).or_default() += usize::from(is_used);
    }

    fn add(&mut self, plan: &FramePlan, settings: &Settings) {
        for part in list::parts(plan) {
            self.count("passes", part.name, part.included);
        }
        for part in plan.parts().iter().filter(|part| part.group == PartGroup::Targets) {
            let name = part.name.split(" (").next().unwrap_or_default();
            self.count("targets", name, part.included);
        }
        for &(name, path) in LightPath::NAMES.iter().filter(|(_, path)| *path != LightPath::Auto) {
            self.count("light paths", name, plan.light_path == path);
        }
        let table = rows::table(plan);
        for edge in table.iter() {
            self.count("dependencies", edge.name.name(), true);
        }
        let formats: BTreeSet<String> = StepList::of(plan)
            .render_passes()
            .flat_map(|(name, _)| StepList::of(plan).attachments(plan, name))
            .map(|(_, attachment)| format!("{:?}", attachment.format))
            .collect();
        for format in formats {
            self.count(FORMATS, format, true);
        }
        let textures: BTreeSet<_> = plan.textures.images.iter().map(|texture| texture.blocks).collect();
        for blocks in [None].into_iter().chain(BlockFormat::ALL.map(Some)) {
            let name = blocks.map_or_else(|| "RGBA8".to_owned(), |format| format.to_string());
            self.count("texels of textures", name, textures.contains(&blocks));
        }
        let is_compressed = |formats: &[BlockFormat]| formats.iter().any(|format| textures.contains(&Some(*format)));
        let features = [
            ("depthClamp", plan.has_directional_shadows()),
            ("samplerAnisotropy", plan.anisotropy > 1),
            ("sampleRateShading", plan.msaa > 1),
            ("geometryShader (the number of a triangle)", settings.view == View::Triangle),
            (
                "shaderSampledImageArrayDynamicIndexing and shaderSampledImageArrayNonUniformIndexing",
                plan.light_path == LightPath::Visibility && !plan.textures.images.is_empty(),
            ),
            ("multiDrawIndirect and drawIndirectFirstInstance", plan.culls_on_device),
            ("textureCompressionBC", is_compressed(&BlockFormat::ALL[..1])),
            ("textureCompressionETC2", is_compressed(&BlockFormat::ALL[1..])),
        ];
        for (name, is_used) in features {
            self.count("optional features", name, is_used);
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for (kind, names) in &self.0 {
            let used = names.values().filter(|count| **count > 0).count();
            // Formats are known as they are used.
            let all = if *kind == FORMATS { String::new() } else { format!(" of {}", names.len()) };
            let _ = writeln!(text, "{kind}: {used}{all}");
            for (name, count) in names {
                let _ = writeln!(text, "  {count:>5}  {name}");
            }
        }
        text
    }

    /// Names that no case uses.
    #[cfg(test)]
    fn unused(&self) -> Vec<(&'static str, &str)> {
        self.0
            .iter()
            .flat_map(|(kind, names)| {
                names.iter().filter(|(_, count)| **count == 0).map(move |(name, _)| (*kind, name.as_str()))
            })
            .collect()
    }
}

fn counted(cases: &[&SuiteCase]) -> Result<UseCounts, Failure> {
    let devices =
        [Capabilities::ample(), Capabilities { software: true, costs: CostModel::CPU, ..Capabilities::ample() }];
    let mut all = UseCounts::default();
    for case in cases {
        let wrong = |why: &str| Failure::new(Exit::BadInput, format!("{}: {why}", case.name));
        let drawing = CaseSetup::open(case).map_err(|stop| wrong(&stop.why))?;
        for device in &devices {
            let plan = FramePlan::of(&drawing.scene, &drawing.settings, device);
            let plan = plan.map_err(|error| wrong(&error.to_string()))?;
            all.add(&plan, &drawing.settings);
            for &way in &case.holds.window {
                all.add(&mutants::presented(plan.clone(), way), &drawing.settings);
            }
        }
    }
    Ok(all)
}

/// The table: for each name the number of plans, two a case, that use it.
///
/// # Errors
/// When a case cannot be planned on any device.
pub fn of(cases: &[&SuiteCase]) -> Result<String, Failure> {
    Ok(counted(cases)?.text())
}

#[cfg(test)]
mod tests {
    use super::super::suite::Suite;
    use super::*;

    /// A line of `inspect` for frames without one.
    const ELSEWHERE: [&str; 1] = ["G-buffer"];

    #[test]
    fn the_quick_suite_uses_all_that_frames_can_have() {
        let suite = Suite::open("quick").expect("it is shipped");
        let counted =
            counted(&suite.cases.iter().collect::<Vec<_>>()).unwrap_or_else(|failure| panic!("{}", failure.one_line()));
        let unused: Vec<_> = counted.unused().into_iter().filter(|(_, name)| !ELSEWHERE.contains(name)).collect();
        assert!(unused.is_empty(), "nothing in the suite uses {unused:?}");
    }
}
