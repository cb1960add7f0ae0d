//! A case: a quantity, its values, the claim on them, and how one is tried.

use std::fmt;

use super::formula::Trial;
use super::pixel_errors::Subject;

/// A quantity that goes to its extremes.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// `group/quantity`.
    pub name: &'static str,
    /// The extreme of the case, in words.
    pub extreme: &'static str,
    /// The unit of the values; empty for a plain number.
    pub unit: &'static str,
    pub values: SweepValues,
    /// The first and the last value for which the bound is to hold.
    pub claim: [f64; 2],
    pub bound: Bound,
    pub check: Check,
}

/// The values that a case sweeps, from the least to the greatest.
#[derive(Debug, Clone, Copy)]
pub enum SweepValues {
    /// Powers of ten, each exponent from the first to the second.
    Decades(i32, i32),
    /// As they stand.
    List(&'static [f64]),
    /// Whole numbers from the first up to, not including, the end: seeds of random scenes.
    Seeds { first: u32, end: u32 },
}

/// The most that pictures and formulas may err by, relative to the light of the pixel or the value of the formula ([`super::Errors`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The error of any pixel or input.
    pub worst: f64,
    /// The mean error of all of them.
    pub mean: f64,
}

/// The share of pixels on which raster and truth may see different triangles where a case does not say: edges of meshes in small pictures.
pub const MOST_ELSEWHERE: f64 = 0.1;

/// The way that a value is tried.
#[derive(Debug, Clone, Copy)]
pub enum Check {
    /// A scene is drawn, and held against the reference.
    Picture(fn(f64) -> Subject),
    /// A scene is held against the reference, with its own limit for the share of pixels that show another triangle than the truth.
    Placed(fn(f64) -> Subject, f64),
    /// Places of surfaces, as the G-buffer has them, against the truth: errors are distances over the distance from the camera.
    Position(fn(f64) -> Subject),
    /// The mean light of the whole picture, against a truth of many samples: single samples may err, but not all in the same direction.
    Whole(fn(f64) -> Subject),
    /// This many frames of one renderer while its exposure changes, against the first.
    Exposures(fn(f64) -> Subject),
    /// A scene is drawn that need only be sane. The error is the share of pixels that are black though the truth is bright: a shader's last
    /// `max` makes black of a NaN.
    Sane(fn(f64) -> Subject),
    /// A formula of the shaders is evaluated on many inputs.
    Formula(fn(f64) -> Trial),
}

impl Check {
    /// The greatest share of pixels that may show another triangle than the truth, or of inputs that need only be sane.
    pub fn elsewhere(&self) -> f64 {
        match self {
            Self::Placed(_, share) => *share,
            // Reflection off a surface that is seen or lit from behind, or along its horizon.
            Self::Formula(_) => 0.7,
            Self::Sane(_) => 1.0,
            _ => MOST_ELSEWHERE,
        }
    }

    /// Returns the word for the things that errors are counted over.
    pub fn compared(&self) -> &'static str {
        if let Self::Formula(_) = self { "inputs" } else { "pixels" }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:e} / {:e}", self.worst, self.mean)
    }
}

impl SweepValues {
    pub fn all(&self) -> Vec<f64> {
        match *self {
            Self::Decades(first, last) => (first..=last).map(|exponent| 10f64.powi(exponent)).collect(),
            Self::List(values) => values.to_vec(),
            Self::Seeds { first, end } => (first..end).map(f64::from).collect(),
        }
    }
}

/// A case that nothing tries yet.
pub struct Untried(Case);

/// A case of this name, with its extreme in words. Values, claim and check must follow in a chain.
pub const fn case(name: &'static str, extreme: &'static str) -> Untried {
    let (values, bound) = (SweepValues::List(&[]), Bound { worst: 0.0, mean: 0.0 });
    Untried(Case { name, extreme, unit: "", values, claim: [0.0; 2], bound, check: Check::Whole(|_| unreachable!()) })
}

impl Untried {
    /// Sweeps these values, which have this unit.
    pub const fn over(self, values: SweepValues, unit: &'static str) -> Self {
        Self(Case { values, unit, ..self.0 })
    }

    /// Sets the bound, and the first and the last value for which it is to hold.
    pub const fn claim(self, claim: [f64; 2], bound: Bound) -> Self {
        Self(Case { claim, bound, ..self.0 })
    }

    pub const fn check(self, check: Check) -> Case {
        Case { check, ..self.0 }
    }
}

impl Case {
    /// The values to try: all of them, or with `quick` the ends, the ends of the claim, and every third.
    pub fn tried(&self, quick: bool) -> Vec<f64> {
        let all = self.values.all();
        let last = all.len().saturating_sub(1);
        let is_kept = |index: usize, value: f64| {
            !quick || index == 0 || index == last || index.is_multiple_of(3) || self.claim.contains(&value)
        };
        all.into_iter().enumerate().filter(|&(index, value)| is_kept(index, value)).map(|(_, value)| value).collect()
    }

    /// Returns true if the bound is to hold for a value.
    pub fn claims(&self, value: f64) -> bool {
        (self.claim[0]..=self.claim[1]).contains(&value)
    }

    /// Takes other seeds, if the case has seeds.
    pub fn with_seeds(self, first: u32, end: u32) -> Self {
        match self.values {
            SweepValues::Seeds { .. } => {
                let claim = [f64::from(first), f64::from(end.saturating_sub(1))];
                Self { values: SweepValues::Seeds { first, end }, claim, ..self }
            }
            _ => self,
        }
    }

    /// The part of the name before the slash.
    pub fn group(&self) -> &'static str {
        self.name.split_once('/').map_or(self.name, |(group, _)| group)
    }
}

/// As `1e-6..1e3 m`; one value alone where both are the same.
pub fn range(range: Option<[f64; 2]>, unit: &str) -> String {
    let Some([first, last]) = range else { return "-".into() };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    if first == last {
        format!("{}{unit}", number(first))
    } else {
        format!("{}..{}{unit}", number(first), number(last))
    }
}

fn number(value: f64) -> String {
    let plain = value == 0.0 || (1e-3..1e5).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}
