//! The laboratory of Afterlight: it measures the renderer and does not draw for anyone.
//!
//! [`report`] has error against time, tuned settings, and drawings of a frame; [`stress`] a catalogue of extreme cases; [`mutants`] frames with a part
//! of their synchronization left out, for validation layers to find.

#![deny(missing_docs)]

// Tests of validation layers, for the program.
#[doc(hidden)]
pub mod mutants;
#[cfg(feature = "report")]
mod page;
pub mod report;
// The catalogue of extreme cases, for the program.
#[doc(hidden)]
pub mod stress;
