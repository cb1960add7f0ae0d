//! How a frame is asked to be drawn: [`SettingsPatch`] is what a scene file or a command line says, [`Settings`] what is decided. Both are made from
//! [`SETTINGS`], the one table that says what settings there are.

mod choices;
mod names;
mod patch;
mod setting;
mod table;

pub use choices::{
    GbufferChoice, GbufferPreset, HdrFormat, LightPath, MSAA, Output, Resolve, ShadowFilter, TargetChoice, Tonemap,
    Transparency, View,
};
pub use names::TARGETS;
pub use setting::{Setting, Sweep, ValueKind};
pub(super) use table::{KEYS, SHADOW_KEYS};
pub use table::{SETTINGS, Settings, SettingsPatch, ShadowSettings};

impl Settings {
    /// For the values that a view shows: what a buffer holds does not depend on how its pixels are lit, and not every way of that has
    /// buffers.
    pub(crate) fn showing(&self, view: View) -> Self {
        Self {
            view,
            light_path: LightPath::Auto,
            light_cutoff: false,
            output: Output::Nits,
            samples: 1,
            msaa: 1,
            fxaa: false,
            ..self.clone()
        }
    }
}
