//! The layout of the G-buffer as text: a preset, and formats of targets that differ from it.

use std::fmt;
use std::str::FromStr;

use super::choices::choice;
use crate::Error;
use crate::suggest::unknown;

/// The format of each target of the G-buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GbufferChoice {
    /// The formats of targets without an override below.
    pub preset: GbufferPreset,
    /// `Depth`, `Rgba16f` or `Rgba32f`.
    pub position: Option<TargetChoice>,
    /// Any but `Depth` and `Rgba8`.
    pub normal: Option<TargetChoice>,
    /// `Rgba8`, `Rgba16f` or `Rgba32f`.
    pub albedo: Option<TargetChoice>,
    /// As `albedo`.
    pub material: Option<TargetChoice>,
}

choice! {
    /// A format for each target of the G-buffer.
    #[derive(Default)]
    pub enum GbufferPreset: "G-buffer preset" {
        /// Position from depth, `Oct16` normals, `Rgba8` for the rest.
        #[default]
        Lean => "lean",
        /// `Rgba16f` for all, with a target for the position.
        Fat => "fat",
        /// `Rgba32f` for all, with a target for the position.
        Float32 => "float32",
    }
}

choice! {
    /// A format that a G-buffer target can be given; which ones a target takes: `GbufferChoice`'s parser says.
    pub enum TargetChoice: "target format" {
        /// Position only: rebuilt from depth, no target.
        Depth => "depth",
        /// Normal only: octahedral, two 16-bit normalized channels (R16G16_UNORM).
        Oct16 => "oct16",
        /// Normal only: octahedral in R16G16_UINT, for devices without R16G16_UNORM targets.
        Oct16Uint => "oct16-uint",
        /// Normal only: octahedral, two 8-bit normalized channels.
        Oct8 => "oct8",
        /// Normal only: half-encoded xyz, 8 bits each.
        Rgb8 => "rgb8",
        /// Normal only: half-encoded xyz, 10 bits each.
        Rgb10a2 => "rgb10a2",
        /// Albedo (sRGB-encoded) and material.
        Rgba8 => "rgba8",
        /// Every target: half floats, 8 bytes a pixel.
        Rgba16f => "rgba16f",
        /// Every target: single floats, 16 bytes a pixel.
        Rgba32f => "rgba32f",
    }
}

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
}
