//! What was asked for and is not there.

use super::FramePlan;
use super::anisotropy::is_too_slow;
use crate::scene::Settings;

impl FramePlan {
    /// What was asked for and is not there, a line each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Adds what the finished plan lacks to what its parts have said as they were planned.
    pub(super) fn warn(&mut self, settings: &Settings) {
        self.warnings.extend(self.lost_anisotropy(settings));
    }

    /// What somebody asked for whose textures are filtered with less. The default is no wish: where it does not pay, nobody misses it.
    fn lost_anisotropy(&self, settings: &Settings) -> Option<String> {
        let (asked, most) = (settings.anisotropy, self.anisotropy);
        let spared = is_too_slow(self.software, self.msaa);
        let is_missed = if spared { asked != Settings::default().anisotropy } else { true };
        let why = if spared { "a CPU takes too long with several samples a pixel" } else { "the device has no more" };
        (self.textures.have_levels() && asked > most && is_missed)
            .then(|| format!("textures are filtered with an anisotropy of {most}, not {asked}: {why}"))
    }
}
