//! Afterlight.
