//! Verdicts on a layer: a mutant is noticed, or missed for a known reason, or not.

use super::unreported::{self, UnreportedMutants};
use super::{BrokenRules, CarriedFrames, Hidden, Mutant, OlderLayers, carried, newer, older};

/// Why a layer's silence is expected.
#[derive(Debug, Clone, Copy)]
pub enum Miss {
    /// Neither this layer nor an older one says anything. The specification requires the part all the same.
    Argued(&'static UnreportedMutants),
    /// Later layers notice it.
    Older(&'static OlderLayers),
    /// Older layers notice it.
    Newer(&'static Hidden),
    /// The frames are carried in another way.
    Carried(&'static CarriedFrames),
}

impl Miss {
    /// Returns the reason, in a sentence.
    pub fn why(self) -> &'static str {
        match self {
            Self::Argued(entry) => entry.why,
            Self::Older(entry) => entry.why,
            Self::Newer(entry) => entry.why,
            Self::Carried(entry) => entry.why,
        }
    }
}

/// Judges a layer's messages, or its silence, about a mutant.
#[derive(Debug, Clone, Copy)]
pub enum MutantVerdict {
    /// The layer says so.
    Noticed,
    /// It does not, for a known reason.
    ExpectedMiss(Miss),
    /// It does not, and nobody knows why.
    UnexpectedMiss,
    /// The layer reports a mutant that it was argued to miss: it is better than the reason.
    UnexpectedNotice(Miss),
}

/// The verdict on a layer of this version.
pub fn verdict(layer: u32, mutant: &Mutant, broken: &BrokenRules) -> MutantVerdict {
    if carried::is_carried(mutant) {
        return of_carried(layer, mutant, broken);
    }
    let argued = unreported::reason(mutant.plan, &mutant.row, mutant.part)
        .filter(|entry| entry.seen_from.is_none_or(|first| layer < first));
    let older = || older::reason(layer, mutant).map(Miss::Older);
    let newer = || newer::reason(layer, mutant).map(Miss::Newer);
    match (broken.anything(), argued.map(Miss::Argued).or_else(older).or_else(newer)) {
        (true, None) => MutantVerdict::Noticed,
        (true, Some(miss)) => MutantVerdict::UnexpectedNotice(miss),
        (false, Some(miss)) => MutantVerdict::ExpectedMiss(miss),
        (false, None) => MutantVerdict::UnexpectedMiss,
    }
}

/// The verdict on frames in another carrier than the frames with which the other reasons were found.
fn of_carried(layer: u32, mutant: &Mutant, broken: &BrokenRules) -> MutantVerdict {
    if broken.anything() {
        return MutantVerdict::Noticed;
    }
    let own = carried::reason(layer, mutant).map(Miss::Carried);
    let coarse = mutant.coarse();
    let argued = || {
        unreported::reason(coarse.plan, &coarse.row, coarse.part)
            .filter(|entry| entry.seen_from.is_none_or(|first| layer < first))
            .map(Miss::Argued)
    };
    let older = || older::reason(layer, &coarse).map(Miss::Older);
    let newer = || newer::reason(layer, &coarse).map(Miss::Newer);
    own.or_else(argued).or_else(older).or_else(newer).map_or(MutantVerdict::UnexpectedMiss, MutantVerdict::ExpectedMiss)
}
