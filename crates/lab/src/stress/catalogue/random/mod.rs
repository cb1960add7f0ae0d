//! Scenes that nobody thought of: everything at once at its extremes, drawn from a seed.

mod draw;
mod extremes;
mod scene;

pub use extremes::{Extremes, NUMBERS};

use super::super::{Bound, Case, Check, SweepValues, case};

pub const CASES: &[Case] = &[
    case("random/tame", "random scenes of wide highlights without shadows, in a G-buffer of 32-bit floats")
        .over(SEEDS, "")
        // A lamp a millimetre above a floor that is seen from eight metres.
        .claim(CLAIM, Bound { worst: 1e-2, mean: 1e-3 })
        .check(Check::Picture(|seed| Extremes::wild(seed as u64).tamed().subject())),
    case("random/tame-lean", "the same in a lean G-buffer")
        .over(SEEDS, "")
        // Some pictures are all flank of a highlight, where 8 bits of its power and 16 of the normal are 4% of the light.
        .claim(CLAIM, Bound { worst: 1.0, mean: 0.05 })
        .check(Check::Picture(|seed| Extremes::wild(seed as u64).tamed().leaned().subject())),
    case("random/wild", "random scenes of anything, which need only be sane")
        .over(SEEDS, "")
        .claim(CLAIM, Bound { worst: 0.0, mean: 0.0 })
        .check(Check::Sane(|seed| Extremes::wild(seed as u64).subject())),
];

const SEEDS: SweepValues = SweepValues::Seeds { first: 0, end: 48 };
const CLAIM: [f64; 2] = [0.0, 47.0];
