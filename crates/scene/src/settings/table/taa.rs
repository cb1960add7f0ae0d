//! Frames that a picture needs for temporal anti-aliasing.

use super::View;
use crate::Settings;

impl Settings {
    /// Frames that a picture has, where they are averaged over time.
    pub fn frames_over_time(&self) -> Option<u32> {
        self.taa.then_some(self.taa_frames)
    }

    /// Returns true if frames that show this view need the ones before them.
    pub fn follows_time(&self, shown: View) -> bool {
        self.taa || shown == View::Velocity
    }
}
