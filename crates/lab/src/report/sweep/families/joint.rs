//! Combinations of settings: few of very many, spread well and always the same for the same seed.

use std::collections::BTreeSet;

use super::axes::{Candidate, SweepAxis};
use super::{Admission, Base, Selection, name_of};
use afterlight::scene::SettingsPatch;

/// Combinations that are tried for each one that is wanted: the plan refuses some.
const TRIES: usize = 20;

/// Up to `selection.joint - 1` combinations besides the settings as given. First all settings at their least and at their most, then
/// each at its ends alone, then a Latin hypercube (McKay, Beckman and Conover 1979): each value of each setting comes as often as
/// the others, in random company.
pub fn combinations(base: &Base, axes: &[SweepAxis], selection: &Selection) -> Vec<SettingsPatch> {
    let axes: Vec<Vec<&Candidate>> = axes.iter().map(of_joint).filter(|values| !values.is_empty()).collect();
    if axes.len() < 2 {
        return Vec::new();
    }
    let most = selection.joint.saturating_sub(1);
    let mut found = Combinations { base, most, names: BTreeSet::new(), patches: Vec::new() };
    let ends = |values: &Vec<&Candidate>| [values.first(), values.last()].map(|end| end.map(|one| one.patch.clone()));
    for end in 0..2 {
        let corner = axes.iter().filter_map(|values| ends(values)[end].clone());
        found.add(corner.fold(SettingsPatch::default(), |all, one| all.or(&one)));
    }
    // If there are few combinations, most of them must combine several settings.
    let lone = most / 2;
    for patch in axes.iter().flat_map(ends).flatten() {
        if found.patches.len() < lone {
            found.add(patch);
        }
    }
    let mut random = fastrand::Rng::with_seed(selection.seed);
    // More rows than there are combinations would only repeat some.
    let all = axes.iter().fold(1, |all: usize, values| all.saturating_mul(values.len() + 1));
    let rows = most.min(all);
    for _ in 0..TRIES {
        if found.is_full() {
            break;
        }
        let columns: Vec<Vec<Option<&Candidate>>> =
            axes.iter().map(|values| column(values, rows.max(1), &mut random)).collect();
        for row in 0..rows {
            let values = columns.iter().filter_map(|column| column[row]);
            found.add(values.fold(SettingsPatch::default(), |all, one| all.or(&one.patch)));
        }
    }
    found.patches
}

/// The values that take part.
fn of_joint(axis: &SweepAxis) -> Vec<&Candidate> {
    axis.candidates.iter().filter(|candidate| candidate.joint).collect()
}

/// Each value as often as the others, the one as given (`None`) among them, in random order.
fn column<'a>(values: &[&'a Candidate], rows: usize, random: &mut fastrand::Rng) -> Vec<Option<&'a Candidate>> {
    let choices: Vec<Option<&Candidate>> = std::iter::once(None).chain(values.iter().copied().map(Some)).collect();
    let mut column: Vec<_> = choices.iter().copied().cycle().take(rows.max(choices.len())).collect();
    random.shuffle(&mut column);
    column
}

struct Combinations<'a> {
    base: &'a Base<'a>,
    most: usize,
    names: BTreeSet<String>,
    patches: Vec<SettingsPatch>,
}

impl Combinations<'_> {
    fn is_full(&self) -> bool {
        self.patches.len() >= self.most
    }

    /// Takes a combination that is new and possible.
    fn add(&mut self, patch: SettingsPatch) {
        if self.is_full() || patch == SettingsPatch::default() || !self.names.insert(name_of(&patch)) {
            return;
        }
        if matches!(self.base.try_out(&patch), Admission::Point) {
            self.patches.push(patch);
        }
    }
}
