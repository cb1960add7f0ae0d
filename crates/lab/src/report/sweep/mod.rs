//! Error against run time: families of settings, measured on the device at hand against the truth.
//!
//! [`families`] chooses the points, [`accuracy`] and [`timing`] measure them, [`journal`] keeps the measurements, so that a run that is broken off
//! goes on and several can be joined, and [`assemble`] makes the [`model::Report`] of them. [`run`] puts the steps in order. [`attribution`] takes a
//! frame's error apart.

pub mod accuracy;
pub mod assemble;
pub mod attribution;
pub mod choice;
mod convergence;
mod error;
pub mod families;
pub mod journal;
pub mod line;
pub mod machine;
pub mod merge;
pub mod meter;
pub mod model;
pub mod run;
pub mod table;
pub mod timing;

pub use error::SweepError;
