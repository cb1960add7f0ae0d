//! Typed reading of TOML values that know where they stand: each error names the file, the line and the key.

use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use glam::{DVec3, Vec3};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::schema::Schema;
use crate::camera::FOV_Y_DEGREES;
use crate::path::MAX_SECONDS;
use crate::suggest::unknown;
use crate::texture::srgb_decode;
use crate::{Error, unit, without_controls};

/// The text that is being read.
#[derive(Clone, Copy)]
pub(super) struct SourceText<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl SourceText<'_> {
    pub fn error(&self, at: usize, what: String) -> Error {
        let line = line_of(self.text, at);
        Error::Content { path: self.path.to_owned(), line: Some(line), what: without_controls(&what) }
    }
}

/// Counted from 1.
fn line_of(text: &str, at: usize) -> usize {
    text.as_bytes().iter().take(at).filter(|byte| **byte == b'\n').count() + 1
}

/// The range of a number.
#[derive(Clone, Copy)]
pub(super) struct NumberRange {
    text: &'static str,
    holds: fn(f64) -> bool,
}

impl NumberRange {
    pub const fn new(text: &'static str, holds: fn(f64) -> bool) -> Self {
        Self { text, holds }
    }
}

/// Positions and lengths: far beyond the observable, and squares of them still fit.
pub(super) const COORDINATE: NumberRange =
    NumberRange { text: "a number from -1e15 to 1e15", holds: |x| x.abs() <= 1e15 };
pub(super) const FINITE: NumberRange = NumberRange { text: "a finite number", holds: f64::is_finite };
/// A length above 0 must stay above 0 as f32, and so must its square.
pub(super) const LENGTH: NumberRange =
    NumberRange { text: "from 1e-12 to 1e15", holds: |x| (1e-12..=1e15).contains(&x) };
pub(super) const SHARE: NumberRange = NumberRange { text: "from 0 to 1", holds: |x| (0.0..=1.0).contains(&x) };
/// Strength of light: a product of two still fits f32.
pub(super) const STRENGTH: NumberRange = NumberRange { text: "from 0 to 1e18", holds: |x| (0.0..=1e18).contains(&x) };
pub(super) const FIELD_OF_VIEW: NumberRange =
    NumberRange { text: "from 0.001 to 179.999 degrees", holds: |x| FOV_Y_DEGREES.contains(&x) };
pub(super) const CONE_ANGLE: NumberRange =
    NumberRange { text: "from 0 to 180 degrees", holds: |x| (0.0..=180.0).contains(&x) };
/// Time of a key of a camera path.
pub(super) const TIME: NumberRange =
    NumberRange { text: "from 0 to 1e9 seconds", holds: |x| (0.0..=MAX_SECONDS).contains(&x) };
/// Temperature of a body that glows by heat.
pub(super) const KELVIN: NumberRange =
    NumberRange { text: "from 1000 to 40000 kelvin", holds: |x| crate::KELVIN.contains(&x) };
/// Radius of a light source; 0 for none.
pub(super) const RADIUS: NumberRange = NumberRange { text: "from 0 to 1e15", holds: |x| (0.0..=1e15).contains(&x) };
pub(super) const SUN_ANGLE: NumberRange =
    NumberRange { text: "from 0 to 90 degrees", holds: |x| (0.0..=90.0).contains(&x) };
/// Indices of refraction: 1 reflects nothing.
pub(super) const REFRACTION: NumberRange = NumberRange { text: "from 1 to 100", holds: |x| (1.0..=100.0).contains(&x) };
pub(super) const DISTANCE: NumberRange =
    NumberRange { text: "above 0, to 1e9, or inf", holds: |x| (1e-9..=1e9).contains(&x) || x == f64::INFINITY };
pub(super) const DISPERSION: NumberRange = NumberRange { text: "from 0 to 40", holds: |x| (0.0..=40.0).contains(&x) };
pub(super) const NANOMETRES: NumberRange = NumberRange { text: "from 0 to 1e6", holds: |x| (0.0..=1e6).contains(&x) };
pub(super) const FACTOR: NumberRange = NumberRange { text: "a number from -1e6 to 1e6", holds: |x| x.abs() <= 1e6 };

/// A value with the key that leads to it.
#[derive(Clone)]
pub(super) struct KeyedValue<'a> {
    source: SourceText<'a>,
    /// As in `lights[1].color`.
    pub key: String,
    value: &'a DeValue<'a>,
    span: Range<usize>,
}

impl<'a> KeyedValue<'a> {
    fn of(source: SourceText<'a>, key: String, value: &'a Spanned<DeValue<'a>>) -> Self {
        Self { source, key, value: value.get_ref(), span: value.span() }
    }

    /// An error about this value: `camera.near = -1: must be above 0`.
    /// The file and the line where it begins.
    pub fn place(&self) -> String {
        let SourceText { path, text } = self.source;
        format!("{}:{}", path.display(), line_of(text, self.span.start))
    }

    pub fn wrong(&self, what: impl std::fmt::Display) -> Error {
        let written = self.source.text.get(self.span.clone()).unwrap_or_default();
        let is_short = written.len() <= 60 && !written.contains('\n');
        let found = if is_short && !written.is_empty() { format!(" = {written}") } else { String::new() };
        self.source.error(self.span.start, format!("{}{found}: {what}", self.key))
    }

    pub fn number(&self, limit: NumberRange) -> Result<f64, Error> {
        let parsed = match self.value {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|n| n as f64),
            _ => None,
        };
        parsed.filter(|number| (limit.holds)(*number)).ok_or_else(|| self.wrong(format!("must be {}", limit.text)))
    }

    pub fn number_f32(&self, limit: NumberRange) -> Result<f32, Error> {
        self.number(limit).map(|number| number as f32)
    }

    /// A number as a single float, or as a whole number, is written.
    pub fn digits(&self) -> Option<String> {
        match self.value {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok().map(|number| format!("{:?}", number as f32)),
            DeValue::Integer(own) => i64::from_str_radix(own.as_str(), own.radix()).ok().map(|n| n.to_string()),
            _ => None,
        }
    }

    /// A whole number in a range.
    pub fn integer(&self, range: std::ops::RangeInclusive<u32>) -> Result<u32, Error> {
        let parsed = match self.value {
            DeValue::Integer(integer) => u32::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        };
        parsed
            .filter(|number| range.contains(number))
            .ok_or_else(|| self.wrong(format!("must be a whole number from {} to {}", range.start(), range.end())))
    }

    pub fn boolean(&self) -> Result<bool, Error> {
        self.value.as_bool().ok_or_else(|| self.wrong("must be true or false"))
    }

    pub fn string(&self) -> Result<&'a str, Error> {
        self.value.as_str().ok_or_else(|| self.wrong("must be a string"))
    }

    /// A string that names something: a BRDF, a view.
    pub fn name<T: FromStr<Err = Error>>(&self) -> Result<T, Error> {
        self.string()?.parse().map_err(|error: Error| self.wrong(error))
    }

    /// One of a few words.
    pub fn word(&self, words: &[&'static str]) -> Result<&'static str, Error> {
        let text = self.string()?;
        let spelled = text.to_lowercase().replace('_', "-");
        let known = words.iter().copied().find(|word| *word == spelled);
        known.ok_or_else(|| self.wrong(unknown("word", text, words)))
    }

    pub fn is_table(&self) -> bool {
        self.value.is_table()
    }

    pub fn is_string(&self) -> bool {
        self.value.is_str()
    }

    pub fn is_number(&self) -> bool {
        self.value.is_integer() || self.value.is_float()
    }

    pub fn is_boolean(&self) -> bool {
        self.value.is_bool()
    }

    pub fn table(&self, schema: Schema) -> Result<Table<'a>, Error> {
        match self.value {
            DeValue::Table(table) => Table::open(self.source, self.span.start, self.key.clone(), table, schema),
            _ => Err(self.wrong(format!("must be a table of {}", schema.keys.join(", ")))),
        }
    }

    /// A table whose keys are names of the user's own.
    pub fn entries(&self) -> Result<Vec<(&'a str, KeyedValue<'a>)>, Error> {
        let DeValue::Table(table) = self.value else { return Err(self.wrong("must be a table")) };
        let entry = |(key, value): (&'a Spanned<_>, &'a Spanned<DeValue<'a>>)| {
            let key: &'a std::borrow::Cow<'a, str> = key.get_ref();
            (key.as_ref(), KeyedValue::of(self.source, format!("{}.{key}", self.key), value))
        };
        Ok(table.iter().map(entry).collect())
    }

    pub fn list(&self) -> Result<Vec<KeyedValue<'a>>, Error> {
        let DeValue::Array(array) = self.value else { return Err(self.wrong("must be an array")) };
        let item = |(index, value)| KeyedValue::of(self.source, format!("{}[{index}]", self.key), value);
        Ok(array.iter().enumerate().map(item).collect())
    }

    /// An array of exactly `N` items; `what` they are, for the message.
    pub fn items<const N: usize>(&self, what: &str) -> Result<[KeyedValue<'a>; N], Error> {
        let list = self.value.as_array().and(self.list().ok());
        list.and_then(|list| list.try_into().ok()).ok_or_else(|| self.wrong(format!("must be {N} numbers, {what}")))
    }

    pub fn numbers<const N: usize>(&self, limit: NumberRange, what: &str) -> Result<[f64; N], Error> {
        let items = self.items::<N>(what)?;
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(&items) {
            *number = item.number(limit)?;
        }
        Ok(numbers)
    }

    pub fn point(&self) -> Result<DVec3, Error> {
        self.numbers(COORDINATE, "[x, y, z]").map(DVec3::from)
    }

    /// A direction of any length but zero; comes out with length 1.
    pub fn direction(&self) -> Result<DVec3, Error> {
        let direction = self.numbers(FINITE, "[x, y, z]").map(DVec3::from)?;
        unit(direction).ok_or_else(|| self.wrong("must not be zero: it is a direction"))
    }

    /// Linear `[r, g, b]`, or `"#rrggbb"` as sRGB has it.
    pub fn color(&self, limit: NumberRange) -> Result<Vec3, Error> {
        if !self.is_string() {
            return self.numbers(limit, "linear [r, g, b], or \"#rrggbb\"").map(|rgb| DVec3::from(rgb).as_vec3());
        }
        let text = self.string()?;
        let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()));
        let bits = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let bits = bits.ok_or_else(|| self.wrong("must be \"#rrggbb\", or linear [r, g, b]"))?;
        let channel = |shift: u32| srgb_decode(f64::from((bits >> shift) & 255) / 255.0) as f32;
        Ok(Vec3::new(channel(16), channel(8), channel(0)))
    }
}

/// A table whose keys have been checked against its schema.
pub(super) struct Table<'a> {
    source: SourceText<'a>,
    /// The table's start in the text.
    start: usize,
    /// Empty for the root.
    key: String,
    table: &'a DeTable<'a>,
    schema: Schema,
}

impl<'a> Table<'a> {
    /// # Errors
    /// At the first key that the schema does not have, with the one that was likely meant.
    pub fn open(
        source: SourceText<'a>,
        start: usize,
        key: String,
        table: &'a DeTable<'a>,
        schema: Schema,
    ) -> Result<Self, Error> {
        for name in table.keys() {
            if !schema.keys.contains(&name.get_ref().as_ref()) {
                let place = if key.is_empty() { String::new() } else { format!("{key}: ") };
                let what = format!("{place}{}", unknown("key", name.get_ref(), schema.keys));
                return Err(source.error(name.span().start, what));
            }
        }
        Ok(Self { source, start, key, table, schema })
    }

    pub fn get(&self, name: &str) -> Option<KeyedValue<'a>> {
        debug_assert!(self.schema.keys.contains(&name), "{name} is not in the schema of {}", self.schema.table);
        let key = if self.key.is_empty() { name.to_owned() } else { format!("{}.{name}", self.key) };
        let entry = self.table.iter().find(|(key, _)| key.get_ref() == name);
        entry.map(|(_, value)| KeyedValue::of(self.source, key, value))
    }

    /// The value that `read` makes of a key, if it is there.
    pub fn read<T>(
        &self,
        name: &str,
        read: impl FnOnce(&KeyedValue<'a>) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        self.get(name).map(|node| read(&node)).transpose()
    }

    pub fn list(&self, name: &str) -> Result<Vec<KeyedValue<'a>>, Error> {
        self.get(name).map_or(Ok(Vec::new()), |node| node.list())
    }

    /// An error about the table as a whole, told where it starts: `models[0]: needs …`.
    pub fn wrong(&self, what: &str) -> Error {
        self.source.error(self.start, format!("{}: {what}", if self.key.is_empty() { "scene" } else { &self.key }))
    }
}
