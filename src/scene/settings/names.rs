//! The names of settings, as a command line and a scene file spell them: `FromStr` and `Display` for each, with errors that
//! list what is possible. Names are kebab-case; an underscore and upper case do as well.

use std::fmt;
use std::str::FromStr;

use super::setting::{Value, ValueKind, plain_text};
use super::{
    AmbientOcclusion, AoResolution, Culling, Fog, GbufferChoice, GbufferPreset, HdrFormat, LightPath, Output,
    Reflections, Resolve, ShadowFilter, TargetChoice, Tonemap, Transparency, View,
};
use crate::scene::suggest::unknown;
use crate::scene::{Brdf, Error};

/// Gives a type `NAMES`, `name()`, `FromStr` and `Display` out of one table. A name that has been replaced stands behind the new one, is still read, and is
/// neither listed nor written.
macro_rules! named {
    ($type:ty, $what:literal, $($name:literal $(| $replaced:literal)* => $value:ident),+ $(,)?) => {
        impl $type {
            /// Every value with its name.
            pub const NAMES: &'static [(&'static str, Self)] = &[$(($name, Self::$value)),+];

            /// The value's name, as its parser takes it.
            pub fn name(self) -> &'static str {
                match self { $(Self::$value => $name),+ }
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }

        plain_text! { $type: ValueKind::Names(&[$($name),+]); }

        impl FromStr for $type {
            type Err = Error;

            fn from_str(text: &str) -> Result<Self, Error> {
                match text.trim().to_lowercase().replace('_', "-").as_str() {
                    $($name $(| $replaced)* => Ok(Self::$value),)+
                    _ => Err(Error::Setting(unknown($what, text, &[$($name),+]))),
                }
            }
        }
    };
}

named!(Tonemap, "tonemap", "neutral" => Neutral, "agx" => Agx, "aces" => Aces, "none" => None);
named!(Brdf, "brdf", "cook-torrance" => CookTorrance, "phong" => Phong, "blinn-phong" => BlinnPhong, "lambert" => Lambert);
named!(View, "view",
    "final" => Final, "position" => Position, "normal" => Normal, "normal-absolute" => NormalAbsolute,
    "albedo" => Albedo, "metallic" => Metallic, "roughness" => Roughness, "depth" => Depth,
    "shadow-map" => ShadowMap, "lighting" => Lighting, "ambient" => Ambient, "bloom" => Bloom, "fog" => Fog, "particles" => Particles, "overdraw" => Overdraw,
    "lights-per-pixel" => LightsPerPixel, "complexity" => Complexity, "triangle" => Triangle, "ao" => Ao, "velocity" => Velocity,
    "reflections" => Reflections);
named!(Fog, "fog", "off" => Off, "height" => Height, "froxels" => Froxels);
named!(AmbientOcclusion, "ambient occlusion", "off" => Off, "ssao" => Ssao, "bitmask" | "gtao" => Bitmask);
named!(AoResolution, "resolution", "full" => Full, "half" => Half);
named!(Reflections, "way of reflections", "off" => Off, "screen" => Screen);
named!(Culling, "culling", "auto" => Auto, "cpu" => Cpu, "gpu" => Gpu);
named!(LightPath, "light path",
    "auto" => Auto, "loop" => Loop, "per-light" => PerLight, "volumes" => Volumes, "clustered" => Clustered,
    "compute" => Compute, "visibility" => Visibility, "forward" => Forward, "forward-naive" => ForwardNaive);
named!(Output, "output", "srgb8" => Srgb8, "nits" => Nits, "exposed" => Exposed);
named!(Resolve, "resolve", "linear" => Linear, "tone-mapped" => ToneMapped);
named!(HdrFormat, "HDR format", "rgba16f" => Rgba16f, "b10g11r11" => B10g11r11, "rgba32f" => Rgba32f);
named!(ShadowFilter, "shadow filter",
    "none" => None, "2x2" => Box2, "3x3" => Box3, "5x5" => Box5, "poisson" => Poisson, "pcss" => Pcss);
named!(Transparency, "transparency", "sorted" => Sorted, "oit" => Oit);
named!(GbufferPreset, "G-buffer preset", "lean" => Lean, "fat" => Fat, "float32" => Float32);
named!(TargetChoice, "target format",
    "depth" => Depth, "oct16" => Oct16, "oct16-uint" => Oct16Uint, "oct8" => Oct8, "rgb8" => Rgb8, "rgb10a2" => Rgb10a2,
    "rgba8" => Rgba8, "rgba16f" => Rgba16f, "rgba32f" => Rgba32f);

/// The formats that each target of the G-buffer takes.
pub const TARGETS: &[(&str, &[TargetChoice])] = &[
    ("position", &[TargetChoice::Depth, TargetChoice::Rgba16f, TargetChoice::Rgba32f]),
    (
        "normal",
        &[
            TargetChoice::Oct16,
            TargetChoice::Oct16Uint,
            TargetChoice::Oct8,
            TargetChoice::Rgb8,
            TargetChoice::Rgb10a2,
            TargetChoice::Rgba16f,
            TargetChoice::Rgba32f,
        ],
    ),
    ("albedo", &[TargetChoice::Rgba8, TargetChoice::Rgba16f, TargetChoice::Rgba32f]),
    ("material", &[TargetChoice::Rgba8, TargetChoice::Rgba16f, TargetChoice::Rgba32f]),
];

impl GbufferChoice {
    fn targets_mut(&mut self) -> [&mut Option<TargetChoice>; 4] {
        [&mut self.position, &mut self.normal, &mut self.albedo, &mut self.material]
    }

    fn targets(&self) -> [Option<TargetChoice>; 4] {
        [self.position, self.normal, self.albedo, self.material]
    }
}

/// A preset first or not at all (then `lean`), and overrides after it: `fat`, `lean,normal=rgb10a2`, `position=rgba32f`.
impl FromStr for GbufferChoice {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let mut choice = Self::default();
        for (index, part) in text.split(',').map(str::trim).enumerate() {
            match part.split_once('=') {
                None if index == 0 => choice.preset = part.parse()?,
                None => {
                    return Err(Error::Setting(format!(
                        "gbuffer \"{text}\": \"{part}\" should be target=format (a preset stands first, and once)"
                    )));
                }
                Some((target, format)) => set_target(&mut choice, text, target.trim(), format.trim())?,
            }
        }
        Ok(choice)
    }
}

fn set_target(choice: &mut GbufferChoice, text: &str, target: &str, format: &str) -> Result<(), Error> {
    let lower = target.to_lowercase();
    let Some(index) = TARGETS.iter().position(|(name, _)| *name == lower) else {
        let names: Vec<_> = TARGETS.iter().map(|(name, _)| *name).collect();
        return Err(Error::Setting(format!("gbuffer \"{text}\": {}", unknown("target", target, &names))));
    };
    let (name, allowed) = TARGETS[index];
    let wanted = format.parse::<TargetChoice>().ok().filter(|format| allowed.contains(format));
    let Some(wanted) = wanted else {
        let names: Vec<_> = allowed.iter().map(|format| format.name()).collect();
        return Err(Error::Setting(format!(
            "gbuffer \"{text}\": {}",
            unknown(&format!("{name} format"), format, &names)
        )));
    };
    let slot = &mut *choice.targets_mut()[index];
    if slot.replace(wanted).is_some() {
        return Err(Error::Setting(format!("gbuffer \"{text}\": {name} is given twice")));
    }
    Ok(())
}

impl fmt::Display for GbufferChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.preset.name())?;
        for ((name, _), format) in TARGETS.iter().zip(self.targets()) {
            if let Some(format) = format {
                write!(f, ",{name}={format}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_parses_to_its_value_and_back() {
        for &(name, value) in View::NAMES {
            assert_eq!((name.parse::<View>().unwrap(), value.to_string().as_str()), (value, name));
        }
        for &(name, value) in Tonemap::NAMES {
            assert_eq!(name.parse::<Tonemap>().unwrap(), value);
        }
        assert_eq!("Cook_Torrance".parse::<Brdf>().unwrap(), Brdf::CookTorrance);
    }

    #[test]
    fn a_replaced_name_is_read_wherever_settings_are_and_never_written() {
        use crate::scene::SettingsPatch;
        use crate::scene::file::parse_settings;

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

    #[test]
    fn gbuffer_choices_parse_and_print_the_same() {
        for text in
            ["lean", "fat", "float32", "lean,position=rgba32f,normal=rgb10a2", "fat,albedo=rgba8,material=rgba32f"]
        {
            assert_eq!(text.parse::<GbufferChoice>().unwrap().to_string(), text);
        }
        assert_eq!("normal=oct16_uint".parse::<GbufferChoice>().unwrap().normal, Some(TargetChoice::Oct16Uint));
    }

    #[test]
    fn a_wrong_gbuffer_says_what_is_possible() {
        let says = |text: &str| text.parse::<GbufferChoice>().unwrap_err().to_string();
        assert!(
            says("lean,normal=rgba8")
                .contains("did you mean \"rgb8\"? (possible: oct16, oct16-uint, oct8, rgb8, rgb10a2")
        );
        assert!(says("lean,norml=oct16").contains("did you mean \"normal\""));
        assert!(says("laen").contains("did you mean \"lean\""));
        assert!(says("lean,fat").contains("stands first"));
        assert!(says("lean,normal=oct16,normal=oct16").contains("twice"));
        assert!(says("").contains("possible: lean, fat, float32"));
    }

    #[test]
    fn a_wrong_name_is_answered_with_a_suggestion() {
        let error = "blin-phong".parse::<Brdf>().unwrap_err().to_string();
        assert!(error.contains("did you mean \"blinn-phong\""), "{error}");
    }
}
