//! All cases, by group.

mod ao;
mod bloom;
mod exposure;
mod fog;
mod formulas;
mod froxels;
mod geometry;
mod glass;
mod highlights;
mod lens;
mod lights;
mod looks;
mod motion;
mod particles;
pub mod random;
mod reflections;
mod sampling;
mod shadows;
mod sky;
mod space;
mod stage;
mod taa;
mod targets;

use super::Case;

/// Every case, in the order in which they are told.
pub fn all() -> Vec<Case> {
    [
        formulas::CASES,
        lights::CASES,
        exposure::CASES,
        bloom::CASES,
        highlights::CASES,
        shadows::CASES,
        sky::CASES,
        space::CASES,
        motion::CASES,
        geometry::CASES,
        sampling::CASES,
        looks::CASES,
        ao::CASES,
        lens::CASES,
        fog::CASES,
        froxels::CASES,
        taa::CASES,
        particles::CASES,
        reflections::CASES,
        glass::CASES,
        targets::CASES,
        random::CASES,
    ]
    .concat()
}

/// The cases that a name or the name of a group means.
pub fn named(name: &str) -> Vec<Case> {
    all().into_iter().filter(|case| case.name == name || case.group() == name).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_case_has_a_name_of_its_own_and_claims_what_it_sweeps() {
        let cases = all();
        let names: BTreeSet<&str> = cases.iter().map(|case| case.name).collect();
        assert_eq!(names.len(), cases.len());
        for case in &cases {
            let values = case.values.all();
            assert!(values.is_sorted() && case.name.contains('/'), "{}", case.name);
            // The ends of a claim are tried themselves.
            assert!(case.claim.iter().all(|end| values.contains(end)), "{}: {:?} of {values:?}", case.name, case.claim);
            assert!(case.bound.worst >= case.bound.mean && case.bound.mean >= 0.0, "{}", case.name);
            assert_eq!(named(case.name).len(), 1);
            assert!(named(case.group()).len() >= named(case.name).len());
        }
    }
}
