//! Scenes that nobody thought of: everything at once at its extremes, drawn from a seed.

mod draw;
mod extremes;
mod scene;

pub use extremes::{Extremes, NUMBERS};

use super::super::{Bound, Case, Check, Values};

pub const CASES: &[Case] = &[
    Case::new(
        "random/tame",
        "random scenes of wide highlights without shadows, in a G-buffer of 32-bit floats",
        (SEEDS, ""),
        // A lamp a millimetre above a floor that is seen from eight metres.
        (CLAIM, Bound { worst: 1e-2, mean: 1e-3 }),
        Check::Picture(|seed| Extremes::wild(seed as u64).tamed().subject()),
    ),
    Case::new(
        "random/tame-lean",
        "the same in a lean G-buffer",
        (SEEDS, ""),
        // Some pictures are all flank of a highlight, where 8 bits of its power and 16 of the normal are 4% of the light.
        (CLAIM, Bound { worst: 1.0, mean: 0.05 }),
        Check::Picture(|seed| Extremes::wild(seed as u64).tamed().leaned().subject()),
    ),
    Case::new(
        "random/wild",
        "random scenes of anything, which need only be sane",
        (SEEDS, ""),
        (CLAIM, Bound { worst: 0.0, mean: 0.0 }),
        Check::Sane(|seed| Extremes::wild(seed as u64).subject()),
    ),
];

const SEEDS: Values = Values::Seeds { first: 0, end: 48 };
const CLAIM: [f64; 2] = [0.0, 47.0];
