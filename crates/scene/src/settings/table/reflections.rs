//! The choices of reflections.

use crate::Settings;
use crate::settings::choices::choice;

choice! {
    /// Reflections of surfaces in each other.
    #[derive(Default)]
    pub enum Reflections: "way of reflections" {
        /// Surfaces mirror lights and the sky only.
        #[default]
        Off => "off",
        /// Screen-space reflections: surfaces mirror other surfaces in the picture, if a ray through the depth buffer meets them.
        Screen => "screen",
    }
}

impl Settings {
    /// The greatest perceptual roughness of surfaces with screen-space reflections; `None` if they are off.
    pub fn mirrored_roughness(&self) -> Option<f64> {
        (self.reflections != Reflections::Off).then_some(f64::from(self.reflection_roughness))
    }
}
