//! The cases of single formulas, which hold for the renderer's own (`tests/truth/catalogue.rs`), fail when a textbook's is planted in their place.

use afterlight_lab::stress::formula::Trial;
use afterlight_lab::stress::{Case, Check, StressOutcome, StressResult, catalogue, run};

use crate::common::gpu::{Gpu, on_gpu};

fn tried(gpu: &Gpu, name: &str, check: fn(f64) -> Trial) -> StressResult {
    let cases = catalogue::named(name);
    let case = Case { check: Check::Formula(check), ..cases[0] };
    run(&gpu.device, &case, false).unwrap_or_else(|error| panic!("{error}"))
}

/// The trial of a case of the catalogue with the textbook's formula in it.
fn planted(name: &str, value: f64) -> Trial {
    let Check::Formula(trial) = catalogue::named(name)[0].check else { panic!("{name} is no formula") };
    Trial { planted: true, ..trial(value) }
}

#[test]
fn one_minus_the_square_of_a_cosine_and_a_bare_normalization_are_caught() {
    on_gpu(|gpu| {
        let verdict = tried(gpu, "formulas/cook-torrance", |value| planted("formulas/cook-torrance", value));
        assert!(!verdict.passes());
        let worst = verdict.worst();
        // Light against the view has no half vector to normalize.
        assert!(worst.not_finite > 0, "{worst:?}");
        // Sharp highlights err by far more than is claimed, and the case tells where.
        let sharp = verdict.findings.iter().find(|finding| finding.value == 0.01);
        let Some(StressOutcome::Measured(errors)) = sharp.map(|finding| &finding.outcome) else {
            panic!("not measured")
        };
        assert!(errors.worst > 2.0 * verdict.case.bound.worst && errors.worst_input.is_some(), "{errors:?}");
    });
}

#[test]
fn the_power_of_a_rounded_cosine_is_caught() {
    on_gpu(|gpu| {
        let verdict = tried(gpu, "formulas/blinn-phong", |value| planted("formulas/blinn-phong", value));
        let (case, last) = (&verdict.case, &verdict.findings[verdict.findings.len() - 1]);
        assert!(!verdict.passes() && !last.holds(case), "{last:?}");
    });
}

#[test]
fn the_power_of_a_rounded_reflected_ray_is_caught() {
    on_gpu(|gpu| {
        let verdict = tried(gpu, "formulas/phong", |value| planted("formulas/phong", value));
        assert!(!verdict.passes());
    });
}

#[test]
fn depth_that_is_not_reversed_is_caught() {
    on_gpu(|gpu| {
        let verdict = tried(gpu, "formulas/position", |value| planted("formulas/position", value));
        assert!(!verdict.passes());
        // The mistake grows with distance: a point as near as the near plane is still where it was.
        let holds: Vec<bool> = verdict.findings.iter().map(|finding| finding.holds(&verdict.case)).collect();
        assert!(holds[0] && !holds[holds.len() - 1], "{:?}", verdict.findings);
    });
}
