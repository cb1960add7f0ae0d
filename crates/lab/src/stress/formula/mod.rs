//! Single formulas of the shaders, on the device, against 64 bits: no scene, no rasterizer, no buffer of few bits lies between. The truth
//! gets the same single-precision inputs, so that only the formula's own error is left.
//!
//! Every output must be finite and not negative, for any input. At some inputs, such as directions along the horizon, the
//! formula itself turns rounding into error without limit: there nothing else is asked ([`FormulaTruth::held`]), and separate cases show how the error grows.

mod device;
pub mod inputs;
pub mod truth;

use std::fmt;
use std::sync::Arc;

use super::{Errors, StressError};
use afterlight::frame;
use afterlight::gpu::Device;
use afterlight::gpu_scene::FrameUniform;

/// Sixteen numbers with the meanings that the formula gives them, see `shaders/formulas.wgsl`.
pub type Input = [f32; 16];
/// Four numbers; 0 where a formula gives fewer.
pub type FormulaOutput = [f32; 4];

/// A function of the shaders, by its number in `shaders/formulas.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formula {
    /// Reflection models, times the cosine to the light.
    CookTorrance,
    Phong,
    BlinnPhong,
    /// GGX D.
    Distribution,
    /// Height-correlated Smith V.
    Masking,
    /// Schlick's Fresnel.
    Fresnel,
    /// Share of light from everywhere that is reflected.
    Ambient,
    /// Fall-off of a light times its cone.
    Strength,
    /// A normal through the octahedral map and back, and through its codes of 16 bits.
    Octahedral,
    Octahedral16,
    ToneMap,
    EncodeSrgb,
    /// Position from pixel and depth.
    Position,
    /// A specular power through its encoding and back.
    Shininess,
    /// Direction to a light.
    ToLight,
    /// The lobe of a sheen, times the cosine to the light.
    Sheen,
    /// The reflectance of a thin film.
    Film,
    /// D V of a stretched highlight, times the cosine to the light.
    Grooves,
    /// Light through a surface, times the cosine to the light.
    Through,
    /// Light through a surface plus reflected light, with an equal light on each side.
    Leaf,
}

/// The value that a formula should give for an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormulaTruth {
    pub values: [f64; 4],
    /// Errors are relative to the largest of the values, or to this if it is larger.
    pub floor: f64,
    /// True if the error counts; else the output need only be sane.
    pub held: bool,
}

/// The rule by which outputs are held against the truth.
#[derive(Debug, Clone, Copy)]
pub enum Judge {
    /// Each output by itself; components may be negative (directions, positions) or not.
    Each { truth: fn(&Input) -> FormulaTruth, signed: bool },
    /// The weighted sums of `of` successive outputs each: all light that a lobe collects or sends out. `weight` gives the weight of an input's
    /// output. No sum exceeds 1 by more than 1%, the accuracy of the sums themselves.
    Sums { of: usize, truth: fn(&Input) -> FormulaTruth, weight: fn(&Input) -> f64 },
    /// Light and eye change places from each input to the next: both reflect alike. Outputs are divided by `cosine`.
    Pairs { cosine: fn(&Input) -> f64 },
}

/// A formula's inputs for a value, and how the device's outputs are judged.
#[derive(Debug, Clone)]
pub struct Trial {
    pub formula: Formula,
    pub inputs: Vec<Input>,
    /// The names of an input's numbers, and how many each takes; others are left out.
    pub names: &'static [(&'static str, usize)],
    /// Frame data, for formulas that read it.
    pub frame: Option<FrameUniform>,
    pub judge: Judge,
    /// Takes the textbook's unstable formula in place of the renderer's: a test plants it to see that it is caught.
    pub planted: bool,
}

/// The input at which a formula errs most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstInput {
    pub names: &'static [(&'static str, usize)],
    pub input: Input,
    pub found: [f64; 4],
    pub expected: [f64; 4],
}

impl fmt::Display for WorstInput {
    /// `roughness 0.5, normal (0 1 0): (0.1 0 0) for (0.2 0 0)`, each number with the digits that tell it from its neighbours.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |value: f64| {
            let plain = value == 0.0 || (1e-3..1e6).contains(&value.abs());
            if plain { value.to_string() } else { format!("{value:e}") }
        };
        let single = |value: &f32| {
            let plain = *value == 0.0 || (1e-3..1e6).contains(&value.abs());
            if plain { value.to_string() } else { format!("{value:e}") }
        };
        let mut at = 0;
        for (name, count) in self.names {
            let numbers: Vec<String> = self.input[at..at + count].iter().map(single).collect();
            if !name.is_empty() {
                write!(f, "{name} {}, ", numbers.join(" "))?;
            }
            at += count;
        }
        let all = |values: [f64; 4]| values.map(number).join(" ");
        write!(f, "found {}, expected {}", all(self.found), all(self.expected))
    }
}

/// Evaluates the formula on the device, and finds out how far it is from the truth.
///
/// # Errors
/// A device that is lost or out of memory.
pub fn compare(device: &Arc<Device>, trial: &Trial) -> Result<Errors, StressError> {
    let outputs = device::evaluate(device, trial).map_err(frame::Error::from)?;
    Ok(judged(trial, &outputs))
}

fn judged(trial: &Trial, outputs: &[FormulaOutput]) -> Errors {
    let mut found = TrialErrors { trial, errors: Errors::default(), sum: 0.0 };
    let signed = matches!(trial.judge, Judge::Each { signed: true, .. });
    for value in outputs.iter().flatten() {
        found.errors.not_finite += usize::from(!value.is_finite());
        found.errors.negative += usize::from(!signed && *value < 0.0);
    }
    match trial.judge {
        Judge::Each { truth, .. } => {
            for (input, output) in trial.inputs.iter().zip(outputs) {
                found.note(input, output.map(f64::from), truth(input));
            }
        }
        Judge::Sums { of, truth, weight } => {
            for (inputs, outputs) in trial.inputs.chunks_exact(of).zip(outputs.chunks_exact(of)) {
                found.note_sum(inputs, outputs, truth, weight);
            }
        }
        Judge::Pairs { cosine } => {
            for (inputs, outputs) in trial.inputs.as_chunks::<2>().0.iter().zip(outputs.as_chunks::<2>().0) {
                let [there, back] = [0, 1].map(|i| outputs[i].map(|value| f64::from(value) / cosine(&inputs[i])));
                found.note(&inputs[0], there, FormulaTruth { values: back, floor: 1e-4, held: true });
            }
        }
    }
    found.errors.mean = found.sum / found.errors.compared.max(1) as f64;
    found.errors
}

struct TrialErrors<'a> {
    trial: &'a Trial,
    errors: Errors,
    sum: f64,
}

impl TrialErrors<'_> {
    fn note(&mut self, input: &Input, found: [f64; 4], truth: FormulaTruth) {
        if !truth.held {
            self.errors.elsewhere += 1;
            return;
        }
        self.errors.compared += 1;
        let own = truth.values.iter().fold(truth.floor, |most, value| most.max(value.abs()));
        let difference = found.iter().zip(truth.values).fold(0.0f64, |most, (a, b)| {
            // `max` would pass over a NaN.
            if (a - b).is_finite() { most.max((a - b).abs()) } else { f64::INFINITY }
        });
        let error = if difference == 0.0 { 0.0 } else { difference / own };
        self.sum += error;
        if error > self.errors.worst || self.errors.worst_input.is_none() {
            self.errors.worst = error;
            let names = self.trial.names;
            self.errors.worst_input = Some(WorstInput { names, input: *input, found, expected: truth.values });
        }
    }

    fn note_sum(
        &mut self,
        inputs: &[Input],
        outputs: &[FormulaOutput],
        truth: fn(&Input) -> FormulaTruth,
        weight: fn(&Input) -> f64,
    ) {
        let (mut found, mut expected) = ([0.0; 4], [0.0; 4]);
        for (input, output) in inputs.iter().zip(outputs) {
            let weight = weight(input) / inputs.len() as f64;
            let values = truth(input).values;
            for channel in 0..4 {
                found[channel] += weight * f64::from(output[channel]);
                expected[channel] += weight * values[channel];
            }
        }
        // A sum above 1 is an error by its excess, also where the truth agrees.
        let limited = expected.map(|share| if share > 1.01 { 1.0 } else { share });
        self.note(&inputs[0], found, FormulaTruth { values: limited, floor: 1e-3, held: true });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(judge: Judge, firsts: &[f32]) -> Trial {
        let inputs = firsts.iter().map(|&first| inputs::filled([first])).collect();
        Trial { formula: Formula::Fresnel, inputs, names: &[("share", 1)], frame: None, judge, planted: false }
    }

    fn itself(input: &Input) -> FormulaTruth {
        FormulaTruth { values: [f64::from(input[0]), 0.0, 0.0, 0.0], floor: 1e-3, held: input[0] < 10.0 }
    }

    fn first(value: f32) -> FormulaOutput {
        [value, 0.0, 0.0, 0.0]
    }

    #[test]
    fn the_input_that_errs_most_is_told_and_what_is_not_held_need_only_be_sane() {
        let trial = trial(Judge::Each { truth: itself, signed: false }, &[1.0, 0.5, 0.0, 10.0]);
        let errors = judged(&trial, &[first(1.0), first(0.75), first(1e-4), first(-1.0)]);
        assert_eq!((errors.compared, errors.elsewhere, errors.not_finite, errors.negative), (3, 1, 0, 1));
        assert_eq!(errors.worst, 0.5);
        let told = errors.worst_input.map(|input| input.to_string());
        assert_eq!(told.as_deref(), Some("share 0.5, found 0.75 0 0 0, expected 0.5 0 0 0"));
        // A NaN is the worst of errors.
        let errors = judged(&trial, &[first(1.0), first(0.75), first(f32::NAN), first(1.0)]);
        assert_eq!((errors.worst, errors.not_finite), (f64::INFINITY, 1));
    }

    #[test]
    fn sums_above_one_are_errors_even_if_the_truth_agrees() {
        let sums = Judge::Sums { of: 2, truth: itself, weight: |_| 1.0 };
        let errors = judged(&trial(sums, &[0.5, 1.0, 1.0, 2.0]), &[0.5, 1.0, 1.0, 2.0].map(first));
        assert_eq!((errors.worst, errors.compared), (0.5, 2));
    }

    #[test]
    fn pairs_must_agree_once_each_is_divided_by_its_cosine() {
        let pairs = Judge::Pairs { cosine: |input| f64::from(input[0]) };
        let errors = judged(&trial(pairs, &[0.5, 1.0]), &[1.0, 2.0].map(first));
        assert_eq!((errors.worst, errors.compared), (0.0, 1));
        assert!(judged(&trial(pairs, &[0.5, 1.0]), &[1.0, 1.0].map(first)).worst > 0.9);
    }
}
