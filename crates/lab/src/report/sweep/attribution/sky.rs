//! Light of the sky: the part of a frame's error that it has.

use glam::DVec3;

use super::decomposition::Decomposition;
use super::{AttributedFrame, place};

pub const NAME: &str = "light of the sky";
pub(super) const NOTE: &str = "what PREFILTER makes of the sky against its integral by rays, and what stands before it, of which no surface knows";

impl Decomposition<'_> {
    /// Returns the sky's part of the truth's light, exposed.
    pub(super) fn light_of_sky(&self, pixel: usize) -> DVec3 {
        if self.captured.without_sky.is_none() {
            return DVec3::ZERO;
        }
        let AttributedFrame { reference, view, .. } = self.subject;
        DVec3::from(reference.light_of_sky(view, place(view, pixel))) * self.exposure
    }
}
