//! Parameters of built-in scenes: `builtin:NAME?key=value&key=value`, each with a range and a default.

use crate::suggest::unknown;
use crate::{Brdf, Error};

/// The values that a parameter may have.
#[expect(missing_docs, reason = "the variants tell of their fields")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number in a range, both ends included.
    Integer { least: u64, most: u64, default: u64 },
    /// A finite number in a range, both ends included; nearer to 0 than 1e-12 it counts as 0, since its square would as f32.
    Number { least: f64, most: f64, default: f64 },
    /// The name of a reflection model.
    Brdf { default: Brdf },
    /// One of these names; the first is the default.
    Choice { names: &'static [&'static str] },
}

/// A parameter of a built-in scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// The parameter's key.
    pub name: &'static str,
    /// The parameter's meaning, with the unit.
    pub about: &'static str,
    /// Type, range and default.
    pub kind: Kind,
}

impl Parameter {
    pub(super) const fn integer(
        name: &'static str,
        [least, most]: [u64; 2],
        default: u64,
        about: &'static str,
    ) -> Self {
        Self { name, about, kind: Kind::Integer { least, most, default } }
    }

    pub(super) const fn number(name: &'static str, [least, most]: [f64; 2], default: f64, about: &'static str) -> Self {
        Self { name, about, kind: Kind::Number { least, most, default } }
    }

    /// Range and default, as the documentation has it: `1 to 64, default 8`.
    pub fn range(&self) -> String {
        match self.kind {
            Kind::Integer { least, most, default } => format!("{least} to {most}, default {default}"),
            Kind::Number { least, most, default } => format!("{least} to {most}, default {default}"),
            Kind::Brdf { default } => format!("a BRDF's name, default {default}"),
            Kind::Choice { names } => format!("{}, default {}", names.join(", "), names[0]),
        }
    }

    fn parse(&self, text: &str) -> Result<ParameterValue, String> {
        match self.kind {
            Kind::Integer { least, most, .. } => text
                .parse()
                .ok()
                .filter(|value| (least..=most).contains(value))
                .map(ParameterValue::Integer)
                .ok_or_else(|| format!("{}={text:?}: must be a whole number from {least} to {most}", self.name)),
            Kind::Number { least, most, .. } => text
                .parse()
                .ok()
                .filter(|value: &f64| (least..=most).contains(value))
                .map(|value| ParameterValue::Number(if value.abs() < 1e-12 { 0.0 } else { value }))
                .ok_or_else(|| format!("{}={text:?}: must be a number from {least} to {most}", self.name)),
            Kind::Choice { names } => {
                let chosen = names.iter().find(|name| **name == text);
                chosen.map(|name| ParameterValue::Choice(name)).ok_or_else(|| unknown(self.name, text, names))
            }
            Kind::Brdf { .. } => text.parse().map(ParameterValue::Brdf).map_err(|error: Error| error.to_string()),
        }
    }

    fn default(&self) -> ParameterValue {
        match self.kind {
            Kind::Integer { default, .. } => ParameterValue::Integer(default),
            Kind::Number { default, .. } => ParameterValue::Number(default),
            Kind::Brdf { default } => ParameterValue::Brdf(default),
            Kind::Choice { names } => ParameterValue::Choice(names[0]),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum ParameterValue {
    Integer(u64),
    Number(f64),
    Brdf(Brdf),
    Choice(&'static str),
}

/// The decided parameters of one scene: the given values, and defaults for the others.
#[derive(Debug, Clone)]
pub(super) struct Params(Vec<(&'static str, ParameterValue)>);

impl Params {
    /// Reads `key=value&key=value` against the parameters that the scene has. `scene` names it in errors.
    pub(super) fn parse(scene: &str, known: &[Parameter], query: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Builtin(format!("builtin:{scene}: {what}"));
        let mut given: Vec<(&'static str, ParameterValue)> = Vec::new();
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let Some((key, text)) = part.split_once('=') else {
                return Err(wrong(format!("{part:?} should be key=value")));
            };
            let Some(parameter) = known.iter().find(|parameter| parameter.name == key) else {
                let names: Vec<_> = known.iter().map(|parameter| parameter.name).collect();
                return Err(wrong(if names.is_empty() {
                    format!("it has no parameters, but {key:?} was given")
                } else {
                    unknown("parameter", key, &names)
                }));
            };
            if given.iter().any(|(name, _)| *name == key) {
                return Err(wrong(format!("{key} is given twice")));
            }
            given.push((parameter.name, parameter.parse(text).map_err(wrong)?));
        }
        for parameter in known {
            if !given.iter().any(|(name, _)| *name == parameter.name) {
                given.push((parameter.name, parameter.default()));
            }
        }
        Ok(Self(given))
    }

    fn get(&self, name: &str) -> Option<ParameterValue> {
        self.0.iter().find(|(given, _)| *given == name).map(|(_, value)| *value)
    }

    /// A parameter that the scene's own table declares as an integer.
    pub(super) fn integer(&self, name: &str) -> usize {
        match self.get(name) {
            Some(ParameterValue::Integer(value)) => value as usize,
            other => unreachable!("{name} is declared as an integer, not {other:?}"),
        }
    }

    pub(super) fn number(&self, name: &str) -> f64 {
        match self.get(name) {
            Some(ParameterValue::Number(value)) => value,
            other => unreachable!("{name} is declared as a number, not {other:?}"),
        }
    }

    pub(super) fn choice(&self, name: &str) -> &'static str {
        match self.get(name) {
            Some(ParameterValue::Choice(value)) => value,
            other => unreachable!("{name} is declared as a choice, not {other:?}"),
        }
    }

    pub(super) fn brdf(&self, name: &str) -> Brdf {
        match self.get(name) {
            Some(ParameterValue::Brdf(value)) => value,
            other => unreachable!("{name} is declared as a BRDF, not {other:?}"),
        }
    }
}
