//! The catalogue of stiff and extreme cases. Each case sweeps one quantity over decades and compares every value with the truth in 64 bits, which
//! shows not only that the renderer works somewhere, but also its limits.
//!
//! Every pixel must stay finite and not negative at any value. Within the range that a case claims, its error stays within its bound; outside, the
//! error is only reported.

pub mod case;
pub mod catalogue;
mod comparison;
mod exposures;
pub mod formula;
mod grid;
mod mean_light;
#[cfg(feature = "report")]
pub mod page;
mod pixel_errors;
mod position;
mod run;

pub use case::{Bound, Case, Check, MOST_ELSEWHERE, SweepValues, case, range};
pub use pixel_errors::{Errors, FLOOR, PicturePair, Subject, WorstPixel, compare};
pub use run::{RunInfo, StressOutcome, StressResult, ValueFinding, run, run_spoiled, run_told, sane};

use afterlight::frame;

/// Why nothing was found out.
#[derive(Debug, thiserror::Error)]
pub enum StressError {
    /// A plan, which becomes a [`StressOutcome`] of its case.
    #[error("{0}")]
    Refused(String),
    /// The device is lost or out of memory.
    #[error(transparent)]
    Frame(frame::Error),
}

impl From<frame::Error> for StressError {
    fn from(error: frame::Error) -> Self {
        match error {
            frame::Error::Plan(refusal) => Self::Refused(refusal.to_string()),
            error => Self::Frame(error),
        }
    }
}
