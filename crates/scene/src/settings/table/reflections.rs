//! The choices of reflections.

use crate::Settings;
use crate::settings::choices::choice;

choice! {
    /// Reflections of surfaces in each other.
    #[derive(Default)]
    pub enum Reflections: "way of reflections" {
        /// They mirror lights and the sky alone.
        #[default]
        Off => "off",
        /// Surfaces mirror what the picture shows of others, as far as a ray through its depth buffer meets it.
        Screen => "screen",
    }
}

impl Settings {
    /// The greatest perceptual roughness of surfaces that mirror others, where some do.
    pub fn mirrored_roughness(&self) -> Option<f64> {
        (self.reflections != Reflections::Off).then_some(f64::from(self.reflection_roughness))
    }
}
