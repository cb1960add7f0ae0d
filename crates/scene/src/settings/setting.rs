//! A setting: its row in the table, its range, and how its values are read from text and written as text.

use std::fmt::{self, Display};

use super::SettingsPatch;
use crate::Aperture;

/// A setting, with all properties that code outside its consumer needs: the command line, `--vary`, scene files, docs/SETTINGS.md, the window's
/// panel, the sweep of a report and the tests are made from these rows.
pub struct Setting {
    /// The key in text (`key=value`) and, after two dashes, on the command line.
    pub key: &'static str,
    /// The key in a scene file, below `settings`.
    pub toml: &'static str,
    /// The effect of the setting: a sentence, verb or noun first, without its period.
    pub help: &'static str,
    /// A few words: its label in the window's panel, and the heading of its family in a report.
    pub title: &'static str,
    /// Type and range.
    pub values: ValueKind,
    /// The unit of a number; empty if it has none.
    pub unit: &'static str,
    /// A phrase for the rule that decides if the setting is not given; empty if a default does.
    pub unset: &'static str,
    /// Frames of another value may have another plan; otherwise it is looked up for each frame.
    pub changes_plan: bool,
    /// True if the reference renderer has it, too: it changes the true picture, and not a frame's way to approximate it.
    pub of_truth: bool,
    /// True if it works on the finished picture as a display shows it: not on light, and not on the values that views show.
    pub on_picture: bool,
    /// True if it belongs to the lit picture alone: frames that show values of surfaces instead have its default.
    pub of_lit_picture: bool,
    /// True if it decides how edges are smoothed, by looking at more of a pixel than its middle.
    pub smooths: bool,
    /// True if glTF cannot express its part of the picture.
    pub beyond_gltf: bool,
    /// The only commands that have it as an option, each in its own way; empty if all commands that draw have it.
    pub only: &'static str,
    /// A phrase for the default of that option, if it differs from the library's.
    pub option_default: &'static str,
    /// It has a row in the window's panel.
    pub in_panel: bool,
    /// Says which other values of it `afterlight report` tries.
    pub sweep: SweepMode,
    /// The numbers that a sweep tries, and that the panel's menu offers. If empty, they are all possible values.
    pub tried: &'static [&'static str],
    /// The values that `--quick` tries. If empty, they are the values of `tried`.
    pub quick: &'static [&'static str],
    /// Values that may make a frame cheaper than the default does: `bench --why` tries them, and the default.
    pub cheaper: &'static [&'static str],
    pub(super) get: fn(&SettingsPatch) -> Option<String>,
    pub(super) set: fn(&Setting, &mut SettingsPatch, Option<&str>) -> Result<(), String>,
}

/// The way in which a report sweeps a setting.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepMode {
    /// The report draws everything with the given value.
    No,
    /// Sweeps it by itself, and not with `--quick`.
    Alone,
    /// Sweeps it by itself and in combinations.
    Joint,
}

/// The range of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueKind {
    /// A boolean; in text also `true`, `yes`, `false` and `no`.
    OnOff,
    /// One of these words.
    Names(&'static [&'static str]),
    /// Whole numbers from one to another.
    Whole(u32, u32),
    /// One of these whole numbers.
    Among(&'static [u32]),
    /// Numbers from one to another.
    Number(f32, f32),
    /// Width and height in pixels.
    Size,
    /// Cells across, down and in depth: the largest number on each axis, and the largest number of cells.
    Grid([u32; 3], u32),
    /// The aperture of a lens: metres, or an f-number.
    Aperture,
    /// Formats of the G-buffer's targets.
    Layout,
    /// Parts of a frame.
    Parts,
}

impl ValueKind {
    /// Returns true if a text is one of the values. Named values are always admitted: their parsers report faults.
    fn admit(self, text: &str) -> bool {
        match self {
            Self::OnOff => bool::read(text).is_ok(),
            Self::Whole(from, to) => text.parse().is_ok_and(|number: u32| (from..=to).contains(&number)),
            Self::Among(numbers) => text.parse().is_ok_and(|number| numbers.contains(&number)),
            Self::Number(from, to) => text.parse().is_ok_and(|number: f32| (from..=to).contains(&number)),
            Self::Size => <[u32; 2]>::read(text).is_ok(),
            Self::Grid(most, most_cells) => <[u32; 3]>::read(text).is_ok_and(|grid| {
                let cells: u64 = grid.into_iter().map(u64::from).product();
                grid.iter().zip(most).all(|(&own, most)| own <= most) && cells <= most_cells.into()
            }),
            Self::Aperture => Aperture::read(text).is_ok(),
            Self::Names(_) | Self::Layout | Self::Parts => true,
        }
    }

    /// All values, if they are few.
    pub fn all(self) -> Vec<String> {
        match self {
            Self::OnOff => [false, true].map(SettingValue::text).to_vec(),
            Self::Names(names) => names.iter().map(|name| (*name).to_owned()).collect(),
            Self::Among(numbers) => numbers.iter().map(u32::to_string).collect(),
            _ => Vec::new(),
        }
    }

    /// The TOML form of a value's text. Names consist of letters, digits, commas, dashes and equals signs, so nothing needs escaping.
    pub(super) fn toml(self, text: &str) -> String {
        match self {
            Self::OnOff => (text == "on").to_string(),
            Self::Whole(..) | Self::Among(_) | Self::Number(..) => text.to_owned(),
            Self::Size | Self::Grid(..) => format!("[{}]", text.replace('x', ", ")),
            Self::Aperture if text.parse::<f64>().is_ok() => text.to_owned(),
            Self::Names(_) | Self::Aperture | Self::Layout | Self::Parts => format!("\"{text}\""),
        }
    }
}

/// The range in words: `on or off`, `a whole number from 1 to 16`.
impl Display for ValueKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(from, u32::MAX) => write!(f, "a whole number from {from}"),
            Self::Whole(from, to) => write!(f, "a whole number from {from} to {to}"),
            Self::Number(from, to) => write!(f, "a number from {from} to {to}"),
            Self::Size => f.write_str("WIDTHxHEIGHT, each at least 1, as in 1280x720"),
            Self::Grid([across, down, deep], cells) => write!(
                f,
                "COLUMNSxROWSxSLICES, each at least 1, at most {across}x{down}x{deep} and {cells} in all, as in 160x90x64"
            ),
            Self::Aperture => f.write_str(Aperture::RANGE),
            Self::Layout => f.write_str("lean, fat or float32, and overrides by target, as in lean,normal=rgb10a2"),
            Self::Parts => {
                f.write_str("lean (nothing), full (everything), or names as `inspect` lists them, separated by commas")
            }
            Self::OnOff => f.write_str("on or off"),
            Self::Names(_) | Self::Among(_) => match self.all().split_last() {
                Some((last, [])) => f.write_str(last),
                Some((last, others)) => write!(f, "{} or {last}", others.join(", ")),
                None => Ok(()),
            },
        }
    }
}

impl Setting {
    /// Returns its value in a patch, as text.
    pub fn text(&self, patch: &SettingsPatch) -> Option<String> {
        (self.get)(patch)
    }

    /// Sets the setting in a patch; `None` removes it.
    ///
    /// # Errors
    /// The range, if the text is not a valid value.
    pub fn set(&self, patch: &mut SettingsPatch, text: Option<&str>) -> Result<(), String> {
        (self.set)(self, patch, text)
    }

    /// A patch with this setting only.
    ///
    /// # Errors
    /// As [`Setting::set`].
    pub fn read(&self, text: &str) -> Result<SettingsPatch, String> {
        let mut patch = SettingsPatch::default();
        self.set(&mut patch, Some(text))?;
        Ok(patch)
    }

    /// Reads a value from its text.
    pub(super) fn value<T: SettingValue>(&self, text: &str) -> Result<T, String> {
        if self.values.admit(text) { T::read(text) } else { Err(format!("must be {}", self.range())) }
    }

    /// Returns its range, with its unit.
    pub fn range(&self) -> String {
        match self.unit {
            "" => self.values.to_string(),
            unit => format!("{} ({unit})", self.values),
        }
    }

    /// The title with the unit.
    pub fn label(&self) -> String {
        if self.unit.is_empty() { self.title.to_owned() } else { format!("{}, {}", self.title, self.unit) }
    }

    /// Returns its default, or a phrase for the rule that decides in the place of one.
    pub fn default(&self) -> String {
        self.text(&super::Settings::default().patch()).unwrap_or_else(|| self.unset.to_owned())
    }

    /// Returns the placeholder of its value in a line of help.
    pub fn value_name(&self) -> &'static str {
        match self.values {
            ValueKind::OnOff => "on|off",
            ValueKind::Size => "WxH",
            ValueKind::Grid(..) => "WxHxD",
            ValueKind::Aperture => "METRES|f/N",
            ValueKind::Layout => "LAYOUT",
            ValueKind::Parts => "PARTS",
            ValueKind::Names(_) => "NAME",
            _ if !self.unit.is_empty() => self.unit,
            ValueKind::Number(..) => "NUMBER",
            ValueKind::Whole(..) | ValueKind::Among(_) => "N",
        }
    }
}

/// A type in which a setting is kept.
pub trait SettingValue: Copy {
    /// The range of a setting of this type whose row gives no other.
    const VALUES: ValueKind;

    fn read(text: &str) -> Result<Self, String>;

    /// Is read as the same value.
    fn text(self) -> String;
}

impl SettingValue for bool {
    const VALUES: ValueKind = ValueKind::OnOff;

    fn read(text: &str) -> Result<Self, String> {
        match text {
            "on" | "true" | "yes" => Ok(true),
            "off" | "false" | "no" => Ok(false),
            _ => Err("must be on or off".into()),
        }
    }

    fn text(self) -> String {
        if self { "on" } else { "off" }.into()
    }
}

impl SettingValue for [u32; 2] {
    const VALUES: ValueKind = ValueKind::Size;

    fn read(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok().filter(|&edge: &u32| edge > 0 && !text.contains('+'));
        let size = text.split_once(['x', 'X']).and_then(|(width, height)| Some([number(width)?, number(height)?]));
        size.ok_or_else(|| format!("must be {}", ValueKind::Size))
    }

    fn text(self) -> String {
        format!("{}x{}", self[0], self[1])
    }
}

impl SettingValue for [u32; 3] {
    const VALUES: ValueKind = ValueKind::Grid([u32::MAX; 3], u32::MAX);

    fn read(text: &str) -> Result<Self, String> {
        let numbers = text.split(['x', 'X']).map(|text| text.trim().parse().ok().filter(|&edge: &u32| edge > 0));
        let wrong = || format!("must be {}", Self::VALUES);
        let grid: Option<Vec<u32>> = numbers.collect();
        grid.filter(|_| !text.contains('+')).and_then(|grid| grid.try_into().ok()).ok_or_else(wrong)
    }

    fn text(self) -> String {
        format!("{}x{}x{}", self[0], self[1], self[2])
    }
}

/// Values that are read from their text as it is written: numbers in the fewest digits, and names.
macro_rules! plain_text {
    ($($type:ty: $values:expr;)+) => {$(
        impl $crate::settings::setting::SettingValue for $type {
            const VALUES: $crate::settings::ValueKind = $values;

            fn read(text: &str) -> Result<Self, String> {
                text.parse().map_err(|error| format!("{error}"))
            }

            fn text(self) -> String {
                self.to_string()
            }
        }
    )+};
}
pub(crate) use plain_text;

plain_text! {
    u32: ValueKind::Whole(0, u32::MAX);
    f32: ValueKind::Number(f32::MIN, f32::MAX);
    super::GbufferChoice: ValueKind::Layout;
    crate::Keep: ValueKind::Parts;
    Aperture: ValueKind::Aperture;
}
