//! Settings of a frame: [`SettingsPatch`] holds the settings that a scene file or a command line gives, [`Settings`] all decided settings. Both are
//! made from [`SETTINGS`], the one table of settings.

mod choices;
mod gbuffer;
mod patch;
pub(super) mod setting;
mod table;

pub use choices::*;
pub use gbuffer::{GbufferChoice, GbufferPreset, TARGETS, TargetChoice};
pub use setting::{Setting, SweepMode, ValueKind};
pub use table::*;

impl Settings {
    /// Returns the settings for the values that a view shows. A buffer's contents do not depend on the light path, and not every light path
    /// has buffers.
    pub fn showing(&self, view: View) -> Self {
        Self { view, output: Output::Nits, ..self.without(|row| row.on_picture || row.of_lit_picture) }
    }

    /// Returns the settings with the defaults of all settings that work on the finished picture.
    pub fn without_effects(&self) -> Self {
        self.without(|row| row.on_picture)
    }

    /// Returns the settings with the rows that `is_left_out` selects set to their defaults.
    fn without(&self, is_left_out: fn(&Setting) -> bool) -> Self {
        let mut patch = self.patch();
        for row in SETTINGS.iter().filter(|row| is_left_out(row)) {
            // Nothing is a value of every setting.
            _ = row.set(&mut patch, None);
        }
        Self { output: self.output, ..patch.decide() }
    }

    /// Only the settings that work on the finished picture; all others are defaults.
    pub fn effects(&self) -> Self {
        let (all, mut patch) = (self.patch(), SettingsPatch::default());
        for row in SETTINGS.iter().filter(|row| row.on_picture) {
            // It is the text of a value.
            _ = row.set(&mut patch, row.text(&all).as_deref());
        }
        patch.decide()
    }

    /// The title of the first setting by which something works on the finished picture.
    pub fn first_effect(&self) -> Option<&'static str> {
        self.on_picture().next().map(|row| row.title)
    }

    /// Returns true if edges of the finished picture are smoothed.
    pub fn smooths_picture(&self) -> bool {
        self.on_picture().any(|row| row.smooths)
    }

    /// The settings by which something works on the finished picture.
    fn on_picture(&self) -> impl Iterator<Item = &'static Setting> {
        let (all, none) = (self.patch(), Self::default().patch());
        SETTINGS.iter().filter(move |row| row.on_picture && row.text(&all) != row.text(&none))
    }
}
