//! The program and its house: commands, exit codes, documents, imports, and everything that exists while the cheapest scene is drawn.

#[path = "../common/mod.rs"]
mod common;

#[cfg(target_os = "linux")]
mod caches;
mod calibration;
mod cheapest;
mod ci;
mod cli;
mod devices;
mod docs;
mod examples;
mod killed;
mod layering;
mod library;
mod prints;
mod settings;
#[cfg(feature = "hot-reload")]
mod shader_exchange;
