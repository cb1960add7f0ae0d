//! Tries the values of a case, and says how far its claim goes.

use std::sync::Arc;

use serde::Serialize;

use super::pixel_errors::{self, Errors, PicturePair, Subject};
use super::{Case, Check, StressError, exposures, formula, mean_light, position, range};
use afterlight::gpu::Device;
use afterlight::scene::Scene;

/// The program, the device and the options of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunInfo {
    /// The program's version.
    pub version: String,
    pub device: String,
    pub driver: String,
    /// Only a part of the values was tried.
    pub quick: bool,
    pub seconds: f64,
}

/// The outcome of one value.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a case has a few dozen, of which hardly one is refused")]
pub enum StressOutcome {
    Measured(Errors),
    /// The device or the plan refuses it, in words.
    Refused(String),
}

/// A value with its outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueFinding {
    pub value: f64,
    pub outcome: StressOutcome,
    /// Pictures of a value whose claim does not hold, or which is not sane.
    pub evidence: Option<PicturePair>,
}

/// A case, tried.
#[derive(Debug, Clone)]
pub struct StressResult {
    pub case: Case,
    /// Findings from the least value to the greatest.
    pub findings: Vec<ValueFinding>,
}

/// Tries a case.
///
/// # Errors
/// When the device is lost.
pub fn run(device: &Arc<Device>, case: &Case, quick: bool) -> Result<StressResult, StressError> {
    run_told(device, case, quick, &|_, _| {})
}

/// Tries a case, and calls `told` before each value with its index and the number of values.
///
/// # Errors
/// As [`run`].
pub fn run_told(
    device: &Arc<Device>,
    case: &Case,
    quick: bool,
    told: &dyn Fn(usize, usize),
) -> Result<StressResult, StressError> {
    run_with(device, case, quick, (&|_| {}, told))
}

/// Holds a subject against the truth of a scene.
type Compare = fn(&Arc<Device>, &Subject, &Scene) -> Result<(Errors, PicturePair), StressError>;

/// Tries a case, but spoils each scene before it is drawn: a planted mistake must be found.
///
/// # Errors
/// As [`run`].
pub fn run_spoiled(
    device: &Arc<Device>,
    case: &Case,
    quick: bool,
    spoil: &dyn Fn(&mut Scene),
) -> Result<StressResult, StressError> {
    run_with(device, case, quick, (spoil, &|_, _| {}))
}

/// Called with the index of each value before it is tried, and the number of values.
type Told<'a> = &'a dyn Fn(usize, usize);

fn run_with(
    device: &Arc<Device>,
    case: &Case,
    quick: bool,
    (spoil, told): (&dyn Fn(&mut Scene), Told<'_>),
) -> Result<StressResult, StressError> {
    let values = case.tried(quick);
    let count = values.len();
    let attempt = |(index, value): (usize, f64)| {
        told(index, count);
        let drawn = |subject: fn(f64) -> Subject| {
            let mut subject = subject(value);
            let truth = subject.truth.take().unwrap_or_else(|| subject.still());
            spoil(&mut subject.scene);
            (subject, truth)
        };
        let held = |subject: fn(f64) -> Subject, compare: Compare| {
            let (subject, truth) = drawn(subject);
            compare(device, &subject, &truth)
        };
        let compared = match case.check {
            Check::Picture(subject) | Check::Placed(subject, _) => held(subject, pixel_errors::compare),
            Check::Sane(subject) => held(subject, sane),
            Check::Position(subject) => held(subject, position::compare),
            Check::Whole(subject) => held(subject, mean_light::compare),
            Check::Exposures(subject) => exposures::compare(device, &drawn(subject).0, value as usize),
            Check::Formula(trial) => {
                let errors = formula::compare(device, &trial(value))?;
                return Ok(ValueFinding { value, outcome: StressOutcome::Measured(errors), evidence: None });
            }
        };
        let mut finding = match compared {
            Ok((errors, evidence)) => {
                ValueFinding { value, outcome: StressOutcome::Measured(errors), evidence: Some(evidence) }
            }
            Err(StressError::Refused(refusal)) => {
                ValueFinding { value, outcome: StressOutcome::Refused(refusal), evidence: None }
            }
            Err(error) => return Err(error),
        };
        if finding.is_as_claimed(case) {
            finding.evidence = None;
        }
        Ok(finding)
    };
    let findings = values.into_iter().enumerate().map(attempt).collect::<Result<_, StressError>>()?;
    Ok(StressResult { case: *case, findings })
}

/// Draws the subject. Of its error only pixels that are black where they should be bright count; none count with shadows, which may lie anywhere, or
/// with several samples, which see other things than the truth.
///
/// # Errors
/// A lost device, and a subject that a plan refuses.
pub fn sane(device: &Arc<Device>, subject: &Subject, truth: &Scene) -> Result<(Errors, PicturePair), StressError> {
    let (errors, evidence) = pixel_errors::compare(device, subject, truth)?;
    let settings = subject.decided();
    let is_single = settings.samples == 1 && settings.msaa == 1;
    let is_plain = is_single && !truth.lights.iter().any(|light| light.casts_shadow);
    let black = if is_plain { evidence.black().saturating_sub(errors.elsewhere) } else { 0 };
    let share = black as f64 / evidence.drawn.len() as f64;
    Ok((Errors { worst: share, mean: share, ..errors }, evidence))
}

impl ValueFinding {
    /// Returns true if all light is finite and none below zero; a refused value shows nothing.
    pub fn is_sane(&self) -> bool {
        match &self.outcome {
            StressOutcome::Measured(errors) => errors.not_finite == 0 && errors.negative == 0,
            StressOutcome::Refused(_) => true,
        }
    }

    /// Returns true if the finding is sane and within the bound.
    pub fn holds(&self, case: &Case) -> bool {
        let within = match &self.outcome {
            StressOutcome::Measured(errors) => {
                // Pixels that show another triangle were not compared: their share has a separate bound.
                errors.elsewhere_share() <= case.check.elsewhere()
                    && errors.worst <= case.bound.worst
                    && errors.mean <= case.bound.mean
            }
            StressOutcome::Refused(_) => false,
        };
        within && self.is_sane()
    }

    /// Returns true if the finding is sane and, if the case claims its value, within the bound.
    pub fn is_as_claimed(&self, case: &Case) -> bool {
        self.is_sane() && (!case.claims(self.value) || self.holds(case))
    }
}

impl StressResult {
    /// Returns true if the case claims any of its values, and all findings are as claimed.
    pub fn passes(&self) -> bool {
        let is_claimed = self.findings.iter().any(|finding| self.case.claims(finding.value));
        is_claimed && self.findings.iter().all(|finding| finding.is_as_claimed(&self.case))
    }

    /// Returns the first and the last value of the gapless range around the claim in which the bound holds; `None` if it fails inside the claim.
    pub fn holds(&self) -> Option<[f64; 2]> {
        let holds: Vec<bool> = self.findings.iter().map(|finding| finding.holds(&self.case)).collect();
        let inside: Vec<usize> =
            (0..holds.len()).filter(|&index| self.case.claims(self.findings[index].value)).collect();
        let (&first, &last) = (inside.first()?, inside.last()?);
        if !holds[first..=last].iter().all(|&holds| holds) {
            return None;
        }
        let from = (0..first).rev().take_while(|&index| holds[index]).last().unwrap_or(first);
        let to = (last + 1..holds.len()).take_while(|&index| holds[index]).last().unwrap_or(last);
        Some([self.findings[from].value, self.findings[to].value])
    }

    /// The cells of a table: claim, range that holds, worst error, mean, bounds, and the numbers of values that are not finite and below zero.
    pub fn cells(&self) -> [String; 7] {
        let (case, worst) = (&self.case, self.worst());
        [
            range(Some(case.claim), case.unit),
            range(self.holds(), case.unit),
            format!("{:.1e}", worst.worst),
            format!("{:.1e}", worst.mean),
            case.bound.to_string(),
            worst.not_finite.to_string(),
            worst.negative.to_string(),
        ]
    }

    /// Returns the greatest errors within the claim, and the pixels that are not sane of all values.
    pub fn worst(&self) -> Errors {
        let mut all = Errors::default();
        for finding in &self.findings {
            let StressOutcome::Measured(errors) = &finding.outcome else { continue };
            all.not_finite += errors.not_finite;
            all.negative += errors.negative;
            if self.case.claims(finding.value) {
                if errors.worst > all.worst || all.worst_input.is_none() {
                    all.worst_input = errors.worst_input;
                }
                all.worst = all.worst.max(errors.worst);
                all.mean = all.mean.max(errors.mean);
                all.compared += errors.compared;
                all.elsewhere += errors.elsewhere;
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Bound, SweepValues, case};
    use super::*;

    fn verdict(worst: [f64; 6]) -> StressResult {
        let case = case("group/quantity", "nothing")
            .over(SweepValues::Decades(-3, 2), "m")
            .claim([0.1, 1.0], Bound { worst: 0.5, mean: 0.5 })
            .check(Check::Picture(|_| Subject::new(Scene::default())));
        let finding = |(value, worst)| ValueFinding {
            value,
            outcome: StressOutcome::Measured(Errors { worst, compared: 1, ..Errors::default() }),
            evidence: None,
        };
        StressResult { case, findings: case.tried(false).into_iter().zip(worst).map(finding).collect() }
    }

    #[test]
    fn the_range_in_which_a_bound_holds_has_no_gap_and_contains_the_claim() {
        let found = verdict([0.1, 0.9, 0.1, 0.1, 0.1, 0.9]);
        assert!(found.passes());
        assert_eq!(found.holds(), Some([0.1, 10.0]));
        let broken = verdict([0.1, 0.1, 0.9, 0.1, 0.1, 0.1]);
        assert_eq!((broken.passes(), broken.holds()), (false, None));
        assert_eq!(broken.worst().worst, 0.9);
    }

    #[test]
    fn nothing_outside_of_a_claim_may_be_infinite_and_nothing_inside_refused_or_unseen() {
        for (index, passes) in [(0, false), (3, false)] {
            let mut found = verdict([0.1; 6]);
            found.findings[index].outcome =
                StressOutcome::Measured(Errors { not_finite: 1, compared: 1, ..Errors::default() });
            assert_eq!(found.passes(), passes);
        }
        for (index, passes) in [(0, true), (3, false)] {
            let mut found = verdict([0.1; 6]);
            found.findings[index].outcome = StressOutcome::Refused("no".into());
            assert_eq!(found.passes(), passes);
        }
        let mut unseen = verdict([0.1; 6]);
        unseen.findings[3].outcome = StressOutcome::Measured(Errors::default());
        assert!(!unseen.passes());
    }

    #[test]
    fn a_case_may_bound_what_is_seen_elsewhere_itself() {
        let errors = |elsewhere| Errors { compared: 90, elsewhere, ..Errors::default() };
        let mut case = verdict([0.0; 6]).case;
        let holds = |case: &Case, elsewhere| {
            ValueFinding { value: 1.0, outcome: StressOutcome::Measured(errors(elsewhere)), evidence: None }.holds(case)
        };
        assert!(holds(&case, 10) && !holds(&case, 11));
        case.check = Check::Placed(|_| Subject::new(Scene::default()), 0.2);
        assert!(holds(&case, 22) && !holds(&case, 23));
    }

    #[test]
    fn a_quick_sweep_has_the_ends_and_the_claim() {
        let case = verdict([0.0; 6]).case;
        assert_eq!(case.tried(true), [1e-3, 0.1, 1.0, 100.0]);
        assert_eq!((case.group(), case.tried(false).len()), ("group", 6));
    }
}
