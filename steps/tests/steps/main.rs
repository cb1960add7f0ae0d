//! Promises of the steps: each draws the picture that it should, silently under core and synchronization validation; each deliberate mistake has the
//! message, or the picture, that is stated here; and no step differs from the one before by more than 150 lines.

mod lines;
mod mistakes;
mod pictures;
mod program;
mod truth;
