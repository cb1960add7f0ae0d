//! Errors that keep a report from being made.

use afterlight::scene::without_controls;
use afterlight::{frame, gpu, plan};
use afterlight_truth::measure;

#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    #[error(transparent)]
    Frame(#[from] frame::Error),
    #[error(transparent)]
    Mismatch(#[from] measure::Mismatch),
    /// The folder's contents, or the parts of a merge, do not fit.
    #[error("{}", without_controls(.0))]
    Refused(String),
    #[error("cannot {doing}: {error}")]
    File { doing: String, error: std::io::Error },
}

impl SweepError {
    pub(crate) fn file(doing: impl Into<String>, error: std::io::Error) -> Self {
        Self::File { doing: doing.into(), error }
    }

    /// Returns true if only the settings at hand are too much for the device, and others may do.
    pub(crate) fn is_of_point(&self) -> bool {
        match self {
            Self::Frame(frame::Error::Plan(_)) => true,
            Self::Frame(frame::Error::Gpu(error)) => {
                matches!(error, gpu::Error::TooLarge { .. } | gpu::Error::OutOfMemory { .. })
            }
            _ => false,
        }
    }
}

impl From<plan::PlanError> for SweepError {
    fn from(error: plan::PlanError) -> Self {
        Self::Frame(error.into())
    }
}

impl From<gpu::Error> for SweepError {
    fn from(error: gpu::Error) -> Self {
        Self::Frame(error.into())
    }
}
