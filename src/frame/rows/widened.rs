//! Rows that order more than they must. What too much order costs is measured with them (`afterlight bench --over-sync`): no layer reports it, because
//! nothing of it is wrong.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::super::list::StepList;
use super::{Endpoint, Row, RowError, RowName, Rows};
use crate::gpu::sync::{Dependency, Use};
use crate::plan::FramePlan;
use crate::scene::Passes;

/// All that a barrier can wait for and hold back.
pub(in crate::frame) const EVERYTHING: Dependency =
    Dependency { row: "full-barrier", before: all(S::ALL_COMMANDS), after: all(S::ALL_COMMANDS) };

/// The stages of an attachment: barriers inside of rendering take no others (VUID-vkCmdPipelineBarrier-srcStageMask-09556).
const FRAMEBUFFER: S = S::from_raw(
    S::FRAGMENT_SHADER.as_raw()
        | S::EARLY_FRAGMENT_TESTS.as_raw()
        | S::LATE_FRAGMENT_TESTS.as_raw()
        | S::COLOR_ATTACHMENT_OUTPUT.as_raw(),
);

const HOST: A = A::from_raw(A::HOST_READ.as_raw() | A::HOST_WRITE.as_raw());

const fn all(stages: S) -> Use {
    Use::new(stages, A::from_raw(A::MEMORY_READ.as_raw() | A::MEMORY_WRITE.as_raw()))
}

impl Rows {
    /// Returns a copy of the table with one row widened to all stages and accesses that its carrier allows, on both sides: ALL_COMMANDS, but
    /// ALL_GRAPHICS for a side inside of a render pass, and the attachment stages for a barrier inside of rendering. A row between subpasses loses
    /// its by-region flag, if its carrier permits that.
    ///
    /// # Errors
    /// As [`Rows::without`].
    pub fn widened(&self, plan: &FramePlan, name: RowName) -> Result<Self, RowError> {
        let index = self.changeable(name)?;
        let mut rows = self.rows.clone();
        widen(&mut rows[index], plan);
        Ok(self.with(rows))
    }

    /// Returns a copy of the table with all changeable rows widened.
    pub fn all_widened(&self, plan: &FramePlan) -> Self {
        let mut rows = self.rows.clone();
        rows.iter_mut().filter(|row| row.carrier.stays().is_none()).for_each(|row| widen(row, plan));
        self.with(rows)
    }

    /// Returns a copy of the table with a full memory barrier, which waits for everything, before each render pass and each pass outside of render
    /// passes.
    pub fn with_full_barriers(&self) -> Self {
        Self { has_full_barriers: true, ..self.clone() }
    }
}

fn widen(row: &mut Row, plan: &FramePlan) {
    let Some(pass) = row.carrier.pass() else {
        // The CPU is none of the commands.
        let with_host = |own: Use, all: Use| Use::new(all.stage | own.stage & S::HOST, all.access | own.access & HOST);
        row.before = with_host(row.before, EVERYTHING.before);
        row.after = with_host(row.after, EVERYTHING.after);
        return;
    };
    let list = StepList::of(plan);
    let inside = |place: Endpoint| {
        list.render_passes().any(|(name, subpasses)| name == pass && subpasses.iter().any(|own| own.place == place))
    };
    if row.is_between_subpasses() && plan.passes == Passes::LocalRead {
        (row.before, row.after) = (all(FRAMEBUFFER), all(FRAMEBUFFER));
        return;
    }
    let side = |place| if inside(place) { all(S::ALL_GRAPHICS) } else { all(S::ALL_COMMANDS) };
    (row.before, row.after) = (side(row.from), side(row.to));
    if row.is_between_subpasses() {
        (row.by_region, row.across_samples) = (false, true);
    }
}
