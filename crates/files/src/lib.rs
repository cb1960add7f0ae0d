//! Ways to read and to write a file that hold for all of Afterlight: within a bound, and whole or not at all.

#![deny(missing_docs)]

pub mod regular_file;
pub mod user_cache;
pub mod whole_file;
