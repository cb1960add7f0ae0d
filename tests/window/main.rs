//! Frames in windows, without a display and with one.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "window")]
mod present;
#[cfg(all(feature = "window", target_os = "linux"))]
mod view;
