//! Afterlight.

pub mod gpu;
