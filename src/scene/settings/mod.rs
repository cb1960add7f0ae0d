//! Settings of a frame: [`SettingsPatch`] holds those that a scene file or a command line gives, [`Settings`] all of them, decided. Both are made
//! from [`SETTINGS`], the one table of settings.

mod choices;
mod names;
mod patch;
mod setting;
mod table;

pub use choices::{
    AmbientOcclusion, AoResolution, Culling, Fog, GbufferChoice, GbufferPreset, HdrFormat, LightPath, MSAA, Output,
    Reflections, Resolve, ShadowFilter, TargetChoice, Tonemap, Transparency, View,
};
pub use names::TARGETS;
pub use setting::{Setting, Sweep, ValueKind};
pub(super) use table::{KEYS, SHADOW_KEYS};
pub use table::{SETTINGS, Settings, SettingsPatch, ShadowSettings};

impl View {
    /// Returns true if it shows what surfaces emit, or where that is mirrored.
    pub(crate) fn shows_emission(self) -> bool {
        matches!(self, Self::Final | Self::Reflections)
    }
}

impl Settings {
    /// Metres within which surfaces hide light from everywhere, where they do.
    pub fn occlusion_radius(&self) -> Option<f64> {
        (self.ao != AmbientOcclusion::Off).then_some(f64::from(self.ao_radius))
    }

    /// Frames that a picture has, where they are averaged over time.
    pub fn frames_over_time(&self) -> Option<u32> {
        self.taa.then_some(self.taa_frames)
    }

    /// Returns true if frames that show this view need the ones before them.
    pub fn follows_time(&self, shown: View) -> bool {
        self.taa || shown == View::Velocity
    }

    /// The greatest perceptual roughness of surfaces that mirror others, where some do.
    pub fn mirrored_roughness(&self) -> Option<f64> {
        (self.reflections != Reflections::Off).then_some(f64::from(self.reflection_roughness))
    }

    /// Returns the settings for the values that a view shows. A buffer's contents do not depend on the light path, and not every light path
    /// has buffers.
    pub(crate) fn showing(&self, view: View) -> Self {
        Self {
            view,
            light_path: LightPath::Auto,
            light_cutoff: false,
            output: Output::Nits,
            samples: 1,
            msaa: 1,
            bloom: 0.0,
            reflections: Reflections::Off,
            ..self.without_effects()
        }
    }

    /// Returns the settings without those that work on the finished picture.
    pub fn without_effects(&self) -> Self {
        let mut patch = self.patch();
        for row in SETTINGS.iter().filter(|row| row.on_picture) {
            // Nothing is a value of every setting.
            _ = row.set(&mut patch, None);
        }
        Self { output: self.output, ..patch.decide() }
    }

    /// Only the settings that work on the finished picture; all others are defaults.
    pub(crate) fn effects(&self) -> Self {
        let (all, mut patch) = (self.patch(), SettingsPatch::default());
        for row in SETTINGS.iter().filter(|row| row.on_picture) {
            // It is the text of a value.
            _ = row.set(&mut patch, row.text(&all).as_deref());
        }
        patch.decide()
    }

    /// The title of the first setting by which something works on the finished picture.
    pub(crate) fn first_effect(&self) -> Option<&'static str> {
        let (all, none) = (self.patch(), Self::default().patch());
        let differs = |row: &&Setting| row.on_picture && row.text(&all) != row.text(&none);
        SETTINGS.iter().find(differs).map(|row| row.title)
    }
}
