//! Settings as text: `gbuffer=fat shadow-size=1024`, as `--vary` and reports have them, and as the `[settings]` of a scene file.
//!
//! Both come from one table with a row for each field of [`SettingsPatch`]; only what is said is written.

use std::fmt;
use std::str::FromStr;

use super::suggest::unknown;
use super::{Error, SettingsPatch};

/// A field of the patch.
struct Entry {
    /// As in the text and, behind two dashes, on the command line.
    key: &'static str,
    /// As in a scene file, below `settings`.
    toml: &'static str,
    set: fn(&mut SettingsPatch, &str) -> Result<(), String>,
    text: fn(&SettingsPatch) -> Option<String>,
    toml_value: fn(&SettingsPatch) -> Option<String>,
}

/// Rows of key, key in a scene file, field, and the module that reads and writes its values.
macro_rules! entries {
    ($($key:literal, $toml:literal => $field:ident: $kind:ident;)+) => {
        /// In the order in which settings are written. The table of shadows comes last, as TOML needs it.
        const ENTRIES: &[Entry] = &[$(Entry {
            key: $key,
            toml: $toml,
            set: |patch, text| {
                patch.$field = Some($kind::read(text)?);
                Ok(())
            },
            text: |patch| patch.$field.as_ref().map($kind::text),
            toml_value: |patch| patch.$field.as_ref().map($kind::toml),
        }),+];
    };
}

entries! {
    "size", "size" => size: size;
    "exposure", "exposure" => exposure: number;
    "tonemap", "tonemap" => tonemap: name;
    "brdf", "brdf" => brdf: name;
    "gbuffer", "gbuffer" => gbuffer: name;
    "view", "view" => view: name;
    "light-path", "light_path" => light_path: name;
    "light-cutoff", "light_cutoff" => light_cutoff: on_off;
    "depth-prepass", "depth_prepass" => depth_prepass: on_off;
    "textbook", "textbook" => textbook: on_off;
    "hdr-format", "hdr_format" => hdr_format: name;
    "transparency", "transparency" => transparency: name;
    "samples", "samples" => samples: whole;
    "resolve", "resolve" => resolve: name;
    "fxaa", "fxaa" => fxaa: on_off;
    "msaa", "msaa" => msaa: whole;
    "anisotropy", "anisotropy" => anisotropy: whole;
    "plan", "plan" => keep: name;
    "shadows", "shadows.enabled" => shadows: on_off;
    "shadow-size", "shadows.size" => shadow_size: whole;
    "shadow-filter", "shadows.filter" => shadow_filter: name;
    "cascades", "shadows.cascades" => cascades: whole;
    "shadow-lambda", "shadows.lambda" => shadow_lambda: number;
    "shadow-budget", "shadows.budget" => shadow_budget: whole;
    "shadow-cache", "shadows.cache" => shadow_cache: on_off;
    "shadow-normal-offset", "shadows.normal_offset" => shadow_normal_offset: number;
    "shadow-slope-bias", "shadows.slope_bias" => shadow_slope_bias: number;
}

mod size {
    use crate::scene::parse_size;

    pub fn read(text: &str) -> Result<[u32; 2], String> {
        parse_size(text).map_err(|error| error.to_string())
    }

    pub fn text([width, height]: &[u32; 2]) -> String {
        format!("{width}x{height}")
    }

    pub fn toml([width, height]: &[u32; 2]) -> String {
        format!("[{width}, {height}]")
    }
}

mod number {
    pub fn read(text: &str) -> Result<f32, String> {
        text.parse().map_err(|_| "expected a number".into())
    }

    /// The fewest digits that are read as the same number.
    pub fn text(value: &f32) -> String {
        value.to_string()
    }

    pub use text as toml;
}

mod whole {
    pub fn read(text: &str) -> Result<u32, String> {
        text.parse().map_err(|_| "expected a whole number".into())
    }

    pub fn text(value: &u32) -> String {
        value.to_string()
    }

    pub use text as toml;
}

mod on_off {
    pub fn read(text: &str) -> Result<bool, String> {
        match text {
            "on" | "true" | "yes" => Ok(true),
            "off" | "false" | "no" => Ok(false),
            _ => Err("expected on or off".into()),
        }
    }

    pub fn text(on: &bool) -> String {
        if *on { "on" } else { "off" }.into()
    }

    pub fn toml(on: &bool) -> String {
        on.to_string()
    }
}

mod name {
    use std::fmt::Display;
    use std::str::FromStr;

    pub fn read<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
        text.parse().map_err(|error: T::Err| error.to_string())
    }

    pub fn text(value: &impl Display) -> String {
        value.to_string()
    }

    /// Names are of letters, digits, commas, dashes and equals signs: nothing that TOML would want escaped.
    pub fn toml(value: &impl Display) -> String {
        format!("\"{value}\"")
    }
}

impl SettingsPatch {
    /// The key of every setting, as the text has it.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        ENTRIES.iter().map(|entry| entry.key)
    }

    /// Says one setting, by its key.
    ///
    /// # Errors
    /// [`Error::Setting`] for a key that does not exist, and a value that is none or out of range.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), Error> {
        let entry = ENTRIES.iter().find(|entry| entry.key == key).ok_or_else(|| {
            let keys: Vec<_> = Self::keys().collect();
            Error::Setting(unknown("setting", key, &keys))
        })?;
        (entry.set)(self, value).map_err(|why| Error::Setting(format!("{key}={value}: {why}")))?;
        self.check()
    }

    /// A settings file: the table `[settings]` of a scene file, with what is said and no more.
    pub fn to_toml(&self) -> String {
        let mut text = String::from("[settings]\n");
        let mut in_shadows = false;
        for (entry, value) in ENTRIES.iter().filter_map(|entry| Some((entry, (entry.toml_value)(self)?))) {
            let (table, key) = entry.toml.split_once('.').unwrap_or(("", entry.toml));
            if !table.is_empty() && !in_shadows {
                text += &format!("\n[settings.{table}]\n");
                in_shadows = true;
            }
            text += &format!("{key} = {value}\n");
        }
        text
    }
}

/// `key=value`, several separated by blanks; nothing at all says nothing.
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

/// As it is parsed, always in the same order; empty where nothing is said.
impl fmt::Display for SettingsPatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pairs = ENTRIES.iter().filter_map(|entry| Some(format!("{}={}", entry.key, (entry.text)(self)?)));
        f.pad(&pairs.collect::<Vec<_>>().join(" "))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;
    use proptest::sample::{Index, select};

    use super::*;
    use crate::scene::file::parse_settings;
    use crate::scene::{
        Brdf, GbufferChoice, GbufferPreset, HdrFormat, Keep, LightPath, MAX_ANISOTROPY, MAX_SAMPLES, MAX_SHADOW_SIZE,
        MIN_SHADOW_SIZE, MSAA, OptionalPart, Resolve, ShadowFilter, TARGETS, Tonemap, Transparency, View,
    };

    fn named<T: Copy + fmt::Debug + 'static>(names: &'static [(&'static str, T)]) -> impl Strategy<Value = T> {
        select(names).prop_map(|(_, value)| value)
    }

    fn gbuffer() -> impl Strategy<Value = GbufferChoice> {
        let target = |index: usize| proptest::option::of(select(TARGETS[index].1));
        let targets = (target(0), target(1), target(2), target(3));
        (named(GbufferPreset::NAMES), targets).prop_map(|(preset, (position, normal, albedo, material))| {
            GbufferChoice { preset, position, normal, albedo, material }
        })
    }

    fn keep() -> impl Strategy<Value = Keep> {
        proptest::collection::vec(any::<Index>(), 0..4)
            .prop_map(|parts| parts.iter().map(|part| part.get(OptionalPart::NAMES).1).collect())
    }

    /// Every field, said or not.
    fn patches() -> impl Strategy<Value = SettingsPatch> {
        use proptest::option::of;
        let picture = (
            of([1..=u32::MAX, 1..=u32::MAX]),
            of(-100.0..=100f32),
            of(named(Tonemap::NAMES)),
            of(named(Brdf::NAMES)),
            of(gbuffer()),
            of(named(View::NAMES)),
            of(named(HdrFormat::NAMES)),
            of(named(Transparency::NAMES)),
        );
        let shadows = (
            of(any::<bool>()),
            of(MIN_SHADOW_SIZE..=MAX_SHADOW_SIZE),
            of(named(ShadowFilter::NAMES)),
            of(1..=4u32),
            of(0.0..=1f32),
            of(1..=u32::MAX),
            of(any::<bool>()),
            of(0.0..=1000f32),
            of(0.0..=1000f32),
        );
        let frame = (
            of(named(LightPath::NAMES)),
            of(any::<bool>()),
            of(any::<bool>()),
            of(1..=MAX_SAMPLES),
            of(named(Resolve::NAMES)),
            of(any::<bool>()),
            of(select(&MSAA[..])),
            of(1..=MAX_ANISOTROPY),
            of(keep()),
            of(any::<bool>()),
        );
        (picture, shadows, frame).prop_map(|(picture, shadows, frame)| {
            let (size, exposure, tonemap, brdf, gbuffer, view, hdr_format, transparency) = picture;
            let (enabled, shadow_size, shadow_filter, cascades, shadow_lambda, shadow_budget, shadow_cache, ..) =
                shadows;
            let (light_path, light_cutoff, depth_prepass, samples, resolve, fxaa, msaa, anisotropy, keep, textbook) =
                frame;
            SettingsPatch {
                size,
                exposure,
                tonemap,
                brdf,
                gbuffer,
                shadows: enabled,
                shadow_size,
                shadow_filter,
                cascades,
                shadow_lambda,
                shadow_budget,
                shadow_cache,
                shadow_normal_offset: shadows.7,
                shadow_slope_bias: shadows.8,
                view,
                light_path,
                light_cutoff,
                depth_prepass,
                textbook,
                samples,
                resolve,
                fxaa,
                hdr_format,
                transparency,
                msaa,
                anisotropy,
                keep,
            }
        })
    }

    proptest! {
        #[test]
        fn any_patch_is_read_as_it_was_written(patch in patches()) {
            let text = patch.to_string();
            prop_assert_eq!(text.parse::<SettingsPatch>().map_err(|error| error.to_string()), Ok(patch.clone()), "{}", text);
            let toml = patch.to_toml();
            let read = parse_settings(&toml, Path::new("tuned.toml")).map_err(|error| error.to_string());
            prop_assert_eq!(read, Ok(patch), "{}", toml);
        }
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
        assert!(says("colour=red").contains("gbuffer"));
        assert!(says("fxaa=maybe").contains("fxaa=maybe: expected on or off"));
        assert!(says("tonemap=agxx").contains("did you mean \"agx\""));
        assert!(says("size=0x0").contains("at least 1"));
        assert!(says("cascades=5").contains("1 to 4"));
        assert!(says("exposure=nan").contains("-100 to 100"));
        assert!(says("fxaa=on size=8x8 fxaa=off").contains("fxaa is said twice"));
        for text in ["samples=-1", "samples=1.5", "samples=", "exposure=bright"] {
            assert!(says(text).contains("expected a "), "{}", says(text));
        }
    }
}
