//! Ways to read and to write a file that hold for all of Afterlight: within a bound, and whole or not at all. Writing ([`whole_file`]) needs the feature
//! `write`, which is on by default.

#![deny(missing_docs)]

pub mod regular_file;
pub mod user_cache;
#[cfg(feature = "write")]
pub mod whole_file;
