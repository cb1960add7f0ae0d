//! Settings as text: `gbuffer=fat shadow-size=1024`, as `--vary` and reports have them, and as the `[settings]` of a scene file. Only given
//! settings are written.

use std::fmt;
use std::str::FromStr;

use super::{SETTINGS, SettingsPatch};
use crate::Error;
use crate::suggest::unknown;

impl SettingsPatch {
    /// Sets one setting, by its key.
    ///
    /// # Errors
    /// [`Error::Setting`] for a key that does not exist, and a value that is none or out of range.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), Error> {
        let setting = SETTINGS.iter().find(|setting| setting.key == key).ok_or_else(|| {
            let keys: Vec<_> = SETTINGS.iter().map(|setting| setting.key).collect();
            Error::Setting(unknown("setting", key, &keys))
        })?;
        setting.set(self, Some(value)).map_err(|why| Error::Setting(format!("{key}={value}: {why}")))
    }

    /// Checks that each given value is in its range.
    ///
    /// # Errors
    /// [`Error::Setting`], which names the setting, its value and the values that it may have.
    pub fn check(&self) -> Result<(), Error> {
        self.to_string().parse::<Self>().map(|_| ())
    }

    /// Returns a settings file: the table `[settings]` of a scene file, with the given settings only.
    pub fn to_toml(&self) -> String {
        let mut text = String::from("[settings]\n");
        let mut in_shadows = false;
        for (setting, value) in SETTINGS.iter().filter_map(|setting| Some((setting, setting.text(self)?))) {
            let (table, key) = setting.toml.split_once('.').unwrap_or(("", setting.toml));
            if !table.is_empty() && !in_shadows {
                text += &format!("\n[settings.{table}]\n");
                in_shadows = true;
            }
            text += &format!("{key} = {}\n", setting.values.toml(&value));
        }
        text
    }
}

/// `key=value`, several separated by blanks; an empty text gives no setting.
impl FromStr for SettingsPatch {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let mut patch = Self::default();
        let mut said = Vec::new();
        for pair in text.split_whitespace() {
            let (key, value) =
                pair.split_once('=').ok_or_else(|| Error::Setting(format!("\"{pair}\" is not key=value")))?;
            patch.set(key, value)?;
            if said.contains(&key) {
                return Err(Error::Setting(format!("{key} is said twice")));
            }
            said.push(key);
        }
        Ok(patch)
    }
}

/// The text that is parsed, always in the same order; empty if no setting is given.
impl fmt::Display for SettingsPatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pairs = SETTINGS.iter().filter_map(|setting| Some(format!("{}={}", setting.key, setting.text(self)?)));
        f.pad(&pairs.collect::<Vec<_>>().join(" "))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;
    use proptest::sample::{Index, select};

    use super::*;
    use crate::file::parse_settings;
    use crate::{GbufferChoice, GbufferPreset, Keep, OptionalPart, Setting, Settings, TARGETS, ValueKind};

    fn layout() -> impl Strategy<Value = String> {
        let target = |index: usize| proptest::option::of(select(TARGETS[index].1));
        let targets = (target(0), target(1), target(2), target(3));
        (select(GbufferPreset::NAMES), targets).prop_map(|((_, preset), (position, normal, albedo, material))| {
            GbufferChoice { preset, position, normal, albedo, material }.to_string()
        })
    }

    fn parts() -> impl Strategy<Value = String> {
        let parts = proptest::collection::vec(any::<Index>(), 0..4);
        parts.prop_map(|parts| parts.iter().map(|part| part.get(OptionalPart::NAMES).1).collect::<Keep>().to_string())
    }

    /// Any value that a setting may have, as text.
    fn value_of(setting: &Setting) -> BoxedStrategy<String> {
        match setting.values {
            ValueKind::OnOff | ValueKind::Names(_) | ValueKind::Among(_) => select(setting.values.all()).boxed(),
            ValueKind::Whole(from, to) => (from..=to).prop_map(|number| number.to_string()).boxed(),
            ValueKind::Number(from, to) => (from..=to).prop_map(|number| number.to_string()).boxed(),
            ValueKind::Size => [1..=u32::MAX, 1..=u32::MAX].prop_map(|[x, y]| format!("{x}x{y}")).boxed(),
            ValueKind::Grid([across, down, deep], cells) => (1..=across, 1..=down, 1..=deep)
                .prop_filter("few enough", move |&(x, y, z)| x * y * z <= cells)
                .prop_map(|(x, y, z)| format!("{x}x{y}x{z}"))
                .boxed(),
            ValueKind::Aperture => (0.0..=1e6f32, any::<bool>())
                .prop_map(
                    |(number, is_metres)| if is_metres { number.to_string() } else { format!("f/{}", number.max(0.5)) },
                )
                .boxed(),
            ValueKind::Layout => layout().boxed(),
            ValueKind::Parts => parts().boxed(),
        }
    }

    /// Every setting, said or not.
    fn patches() -> impl Strategy<Value = SettingsPatch> {
        let said: Vec<_> = SETTINGS.iter().map(|setting| proptest::option::of(value_of(setting))).collect();
        said.prop_map(|said| {
            let mut patch = SettingsPatch::default();
            for (setting, text) in SETTINGS.iter().zip(&said) {
                setting.set(&mut patch, text.as_deref()).expect("it may have this value");
                assert_eq!(setting.text(&patch), *text, "{}", setting.key);
            }
            patch
        })
    }

    proptest! {
        #[test]
        fn any_patch_is_read_as_it_was_written(patch in patches()) {
            let text = patch.to_string();
            prop_assert_eq!(text.parse::<SettingsPatch>().map_err(|error| error.to_string()), Ok(patch.clone()), "{}", text);
            let toml = patch.to_toml();
            let read = parse_settings(&toml, Path::new("tuned.toml")).map_err(|error| error.to_string());
            prop_assert_eq!(read, Ok(patch.clone()), "{}", toml);
            prop_assert_eq!(patch.decide().patch(), patch.or(&Settings::default().patch()));
            prop_assert!(patch.check().is_ok());
        }
    }

    #[test]
    fn every_row_of_the_table_is_whole_and_names_only_values_that_it_may_have() {
        for setting in SETTINGS {
            let Setting { key, toml, help, title, .. } = setting;
            assert!(!key.is_empty() && !toml.is_empty() && !title.is_empty() && help.len() > 10, "{key}");
            assert!(!help.ends_with('.'), "{key}: its values follow");
            assert_eq!(SETTINGS.iter().filter(|other| [other.key, other.toml].contains(key)).count(), 1, "{key}");
            assert!(setting.unset.is_empty() || setting.text(&Settings::default().patch()).is_none(), "{key}");
            for text in setting.tried.iter().chain(setting.quick) {
                assert!(
                    setting.read(text).is_ok_and(|patch| setting.text(&patch).as_deref() == Some(*text)),
                    "{key}={text}"
                );
            }
        }
    }

    #[test]
    fn what_is_out_of_range_is_refused() {
        let refused = |patch: SettingsPatch| patch.check().map_err(|error| error.to_string()).unwrap_err();
        let exposure = refused(SettingsPatch { exposure: Some(f32::NAN), ..Default::default() });
        assert_eq!(exposure, "exposure=NaN: must be a number from -100 to 100 (EV100)");
        let size = refused(SettingsPatch { size: Some([0, 9]), ..Default::default() });
        assert!(size.starts_with("size=0x9: must be WIDTHxHEIGHT, each at least 1"), "{size}");
        let budget = refused(SettingsPatch { shadow_budget: Some(0), ..Default::default() });
        assert_eq!(budget, "shadow-budget=0: must be a whole number from 1 (MiB)");
    }

    #[test]
    fn what_is_said_is_written_in_one_order() {
        let patch: SettingsPatch = "  shadow-size=1024\tgbuffer=fat,normal=rgb10a2 shadows=off ".parse().unwrap();
        assert_eq!(patch.to_string(), "gbuffer=fat,normal=rgb10a2 shadows=off shadow-size=1024");
        assert_eq!(
            patch.to_toml(),
            "[settings]\ngbuffer = \"fat,normal=rgb10a2\"\n\n[settings.shadows]\nenabled = false\nsize = 1024\n"
        );
        assert_eq!(SettingsPatch::default().to_string(), "");
        assert_eq!("".parse::<SettingsPatch>().unwrap(), SettingsPatch::default());
    }

    #[test]
    fn a_wrong_text_says_what_is_wrong_with_what() {
        let says = |text: &str| text.parse::<SettingsPatch>().unwrap_err().to_string();
        assert!(says("shadows").contains("key=value"));
        assert!(says("shadwos=off").contains("did you mean \"shadows\""));
        assert!(
            says("colour=red").starts_with("unknown setting \"colour\"") && says("colour=red").contains("vignette")
        );
        assert!(says("fxaa=maybe").contains("fxaa=maybe: must be on or off"));
        assert!(says("tonemap=agxx").contains("did you mean \"agx\""));
        assert!(says("size=0x0").contains("at least 1"));
        assert!(says("cascades=5").contains("must be a whole number from 1 to 4"));
        assert!(says("exposure=nan").contains("-100 to 100"));
        assert!(says("fxaa=on size=8x8 fxaa=off").contains("fxaa is said twice"));
        for text in ["samples=-1", "samples=1.5", "samples=", "exposure=bright", "size=10", "size=1x2x3", "size=-1x5"] {
            assert!(says(text).contains(": must be "), "{}", says(text));
        }
    }
}
