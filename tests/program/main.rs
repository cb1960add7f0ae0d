//! The program and its house: commands, exit codes, documents, imports, and everything that exists while the cheapest scene is drawn.

#[path = "../common/mod.rs"]
mod common;

#[cfg(target_os = "linux")]
mod caches;
mod calibration;
mod cheapest;
mod ci;
mod cli;
mod comments;
mod devices;
// They are typed into bash, in folders with links.
#[cfg(unix)]
mod docs;
mod examples;
mod first_look;
mod frames_on_queues;
mod killed;
mod layering;
mod library;
mod modules;
mod package;
mod prints;
mod queues;
mod reach;
mod settings;
mod setup;
#[cfg(feature = "hot-reload")]
mod shader_exchange;
mod stacks;
mod surroundings;
mod version;
