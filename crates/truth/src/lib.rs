//! The truth of Afterlight, and how far pictures are from it: a reference renderer on the CPU in 64 bits, and measures of error and of time.

#![deny(missing_docs)]

pub mod measure;
pub mod reference;
