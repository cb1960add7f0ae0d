//! The choices of ambient occlusion.

use crate::settings::choices::choice;
use crate::{Settings, SettingsPatch};

choice! {
    /// The way that ambient occlusion is found on the screen.
    #[derive(Default)]
    pub enum AmbientOcclusion: "ambient occlusion" {
        /// Surfaces hide nothing from each other.
        #[default]
        Off => "off",
        /// Places in the hemisphere above a surface are hidden where something nearer is seen in front of them (after M. Mittring, "Finding Next Gen",
        /// 2007).
        Ssao => "ssao",
        /// Slices of the hemisphere are marched, and a visibility bitmask keeps the angles that samples hide (O. Therrien, Y. Levesque and G. Gilet,
        /// "Screen Space Indirect Lighting with Visibility Bitmask", 2023).
        Bitmask => "bitmask" | "gtao",
    }
}

choice! {
    /// The pixels for which ambient occlusion is found.
    #[derive(Default)]
    pub enum AoResolution: "resolution" {
        /// Each.
        #[default]
        Full => "full",
        /// One of two across and of two down.
        Half => "half",
    }
}

impl Settings {
    /// The radius of ambient occlusion in metres; `None` if it is off.
    pub fn occlusion_radius(&self) -> Option<f64> {
        (self.ao != AmbientOcclusion::Off).then_some(f64::from(self.ao_radius))
    }
}

impl SettingsPatch {
    /// Adds ambient occlusion with a radius of `metres`. Given settings take precedence.
    #[must_use]
    pub(crate) fn hiding_within(self, metres: f64) -> Self {
        let radius = (metres as f32).clamp(0.001, 1000.0);
        let usual = Self { ao: Some(AmbientOcclusion::Bitmask), ao_radius: Some(radius), ..Self::default() };
        self.or(&usual)
    }

    /// Removes the occlusion that [`SettingsPatch::hiding_within`] has added; another kind of occlusion stays.
    #[must_use]
    pub(crate) fn without_hiding(self) -> Self {
        match self.ao {
            Some(AmbientOcclusion::Bitmask) => Self { ao: None, ao_radius: None, ..self },
            _ => self,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replaced_name_is_read_wherever_settings_are_and_never_written() {
        use crate::SettingsPatch;
        use crate::file::parse_settings;

        let text = "ao=gtao".parse::<SettingsPatch>().unwrap();
        let file = parse_settings("[settings]\nao = \"GTAO\"\n", std::path::Path::new("old.toml")).unwrap();
        for patch in [&text, &file] {
            assert_eq!((patch.ao, patch.to_string().as_str()), (Some(AmbientOcclusion::Bitmask), "ao=bitmask"));
            assert_eq!(patch.to_toml(), "[settings]\nao = \"bitmask\"\n");
        }
        let json: AmbientOcclusion = serde_json::from_str("\"gtao\"").unwrap();
        assert_eq!(serde_json::to_string(&json).unwrap(), "\"bitmask\"");
        let error = "gtoa".parse::<AmbientOcclusion>().unwrap_err().to_string();
        assert!(error.ends_with("(possible: off, ssao, bitmask)"), "{error}");
    }
}
