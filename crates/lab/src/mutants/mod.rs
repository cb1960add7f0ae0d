//! Mutants as a test of validation layers: frames from which one dependency is missing, or one bit of one, and a layer's reports of them.
//!
//! [`afterlight_proof`] computes from the specification that each mutant loses something. A mutant that a layer does not report is expected
//! where [`unreported`] argues it, or the layer is too old ([`older`]) or too new ([`newer`]), and a failure elsewhere.

mod carried;
mod cases;
pub mod experiment;
mod laboratory;
mod newer;
mod older;
mod scenes;
pub mod unreported;
mod verdict;
mod watched;

use std::fmt;

use rayon::prelude::*;

use afterlight::frame::plan_with;
use afterlight::frame::rows::{self, Endpoint, Row, RowPart, Rows, Side, SyncKind};
use afterlight::gpu::vk;
use afterlight::plan::{self, Capabilities, Encoding, FramePlan, PresentTarget, Transfer};
use afterlight::scene::{Scene, Settings};
use afterlight_proof::{FrameModel, Hazard};

pub use carried::CarriedFrames;
pub use cases::cases;
pub use experiment::PresentPath;
pub use laboratory::{BrokenRules, Laboratory, MutantError};
pub use newer::Hidden;
pub use older::OlderLayers;
pub use verdict::{Miss, MutantVerdict, verdict};
pub use watched::{Drawn, LayerDevice, NO_EXTENSIONS};

/// A plan to take dependencies from.
#[derive(Debug, Clone)]
pub struct MutantCase {
    /// The name in words: `sunlit`.
    pub name: String,
    /// The scene that is drawn.
    pub scene: Scene,
    /// The settings of its frames.
    pub settings: Settings,
    /// The path by which the frames are presented, with everything that may lie over them; `None` if they are not presented.
    pub presented: Option<PresentPath>,
}

impl MutantCase {
    /// Returns true if a device can carry its frames in the way that they ask for.
    pub fn is_for(&self, device: &Capabilities) -> bool {
        let lacks = |error: &plan::PlanError| match error {
            plan::PlanError::Refused(refusal) => {
                ["--passes local-read", "--sync 2", "--layouts unified", "--queues all"].contains(&refusal.what)
            }
            _ => false,
        };
        !self.plan(device).is_err_and(|error| lacks(&error))
    }

    /// The plan of its frames on a device, or, where that lacks a requirement of the carrier, on a device that can do everything.
    ///
    /// # Errors
    /// As [`plan_with`].
    pub fn plan_or_ample(&self, device: &Capabilities) -> Result<FramePlan, plan::PlanError> {
        let ample = Capabilities::ample();
        self.plan(if self.is_for(device) { device } else { &ample })
    }

    /// The plan of its frames on a device.
    ///
    /// # Errors
    /// As [`plan_with`].
    pub fn plan(&self, device: &Capabilities) -> Result<FramePlan, plan::PlanError> {
        let plan = plan_with(device, &self.scene, &self.settings)?;
        Ok(match self.presented {
            Some(path) => presented(plan, path),
            None => plan,
        })
    }
}

/// As a window has the plan.
pub fn presented(plan: FramePlan, path: PresentPath) -> FramePlan {
    plan.presented_as(match path {
        PresentPath::Straight => PresentTarget::Straight(vk::Format::B8G8R8A8_SRGB),
        PresentPath::Enlarged => PresentTarget::Enlarge(vk::Format::B8G8R8A8_SRGB),
        PresentPath::Encoded => PresentTarget::Encode(Encoding { transfer: Transfer::Srgb, headroom: 1.0 }),
        PresentPath::EncodedKept => PresentTarget::EncodeKept(Encoding { transfer: Transfer::Srgb, headroom: 1.0 }),
    })
}

/// A case's frames with something missing.
#[derive(Debug, Clone)]
pub struct Mutant<'a> {
    /// The case whose table lacks it.
    pub case: &'a MutantCase,
    /// The plan of the case.
    pub plan: &'a FramePlan,
    /// The row as the plan has it.
    pub row: Row,
    /// The part of the row that is missing.
    pub part: RowPart,
    /// All rows that are left.
    pub rows: Rows,
}

impl Mutant<'_> {
    /// `mutants.ROW.PART.CASE`, unique among [`mutants`] and without characters that CSV files and regular expressions read otherwise.
    pub fn name(&self) -> String {
        let letters = self.case.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
        let slug = letters.collect::<String>().split('-').filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-");
        format!("mutants.{}.{}.{slug}", self.row.name, PartName(self.part))
    }

    /// All rows of the plan.
    fn rows_of_plan(&self) -> Rows {
        rows::table(self.plan)
    }

    /// The mutant in the words of the first API of synchronization, in which reasons for a layer's silence are written.
    fn coarse(&self) -> Self {
        let part = match self.part {
            RowPart::Bits(side, bits) => RowPart::Bits(side, bits.coarse()),
            part => part,
        };
        let row = Row { before: self.row.before.coarse(), after: self.row.after.coarse(), ..self.row.clone() };
        Self { row, part, ..self.clone() }
    }

    /// Returns the hazards that the specification's rules find in its frames. There is always one.
    pub fn hazards(&self) -> Vec<Hazard> {
        FrameModel::of(self.plan, &self.rows).hazards()
    }
}

/// `row`, `across-samples`, or the side and the bit: `after.SHADER_READ`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartName(pub RowPart);

impl fmt::Display for PartName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (side, bits) = match self.0 {
            RowPart::Row => return f.write_str("row"),
            RowPart::AcrossSamples => return f.write_str("across-samples"),
            RowPart::Bits(side, bits) => (side, bits),
        };
        f.write_str(match side {
            Side::Before => "before.",
            Side::After => "after.",
        })?;
        match bits.stage.is_empty() {
            true => f.write_str(&bits.accesses()),
            false => f.write_str(&bits.stages()),
        }
    }
}

/// Every row of every plan, and each bit of each distinct row, without which the proof finds a hazard. Presented frames give only rows that no other
/// frames have: in them a render pass ends with a layout change and no reader, which the layer takes to be ordered with anything that follows.
///
/// # Panics
/// Never: the rows that cannot be dropped are left out.
pub fn mutants<'a>(cases: &'a [MutantCase], plans: &'a [FramePlan]) -> Vec<Mutant<'a>> {
    let mut mutants = Vec::new();
    let mut tried = Vec::new();
    for (case, plan) in cases.iter().zip(plans) {
        let table = rows::table(plan);
        // Frames that overwrite more than one buffer of the last frame give their new rows alone, too: the layer takes the barrier of one buffer to order the others.
        let is_of_buffer = |row: &&Row| matches!(row.carrier, SyncKind::BufferBarrier | SyncKind::MemoryBarrier);
        let overwrites_buffers = table.iter().filter(|row| row.from == Endpoint::OUTSIDE).filter(is_of_buffer).count();
        for row in table.iter().filter(|row| row.carrier.stays().is_none()) {
            let masks = row.masks();
            let is_new = !tried.contains(&masks);
            tried.push(masks);
            let hides = case.presented.is_some() || overwrites_buffers > 1;
            let is_tried = |part: &RowPart| is_new || *part == RowPart::Row && !hides;
            for part in row.parts().into_iter().filter(is_tried) {
                let rows = table.without_part(row.name, part).expect("rows that stay are left out above");
                mutants.push(Mutant { case, plan, row: row.clone(), part, rows });
            }
        }
    }
    // A part is no mutant if other rows order the same.
    let is_fault = |mutant: &Mutant| !FrameModel::of(mutant.plan, &mutant.rows).are_safe();
    mutants.into_par_iter().filter(is_fault).collect()
}
