//! The catalogue of stiff and extreme cases. Each case sweeps one quantity over decades and holds every value against the truth in 64
//! bits, so that it is known not only that it works somewhere, but where it ends.
//!
//! Whatever the value, every pixel must stay finite and not negative. Within the range that a case claims, its error stays within its
//! bound; outside, it is only told.

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

pub use case::{Bound, Case, Check, Values, range};
pub use pixel_errors::{Errors, Evidence, FLOOR, Subject, compare};
pub use run::{Finding, Outcome, Verdict, run, run_spoiled, sane};

use crate::frame;

/// Why nothing could be found out at all: the device is lost or out of memory. What a case refuses is an [`Outcome`].
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error(transparent)]
    Frame(#[from] frame::Error),
}
